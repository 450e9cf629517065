//! Plane of two coordinates of an atlas: words of contacts, boxes, and the graze curve, to be
//! drawn.

use super::region_atlas::ReportedReturn;
use crate::atlas::{Atlas, LeafKind};

/// Cells along each axis.
pub(super) const CELLS: usize = 160;
/// Cells along each side of a box, on which the graze curve is found.
const CURVE_CELLS: usize = 16;

/// Plane of the first two axes of a region, through the middle of the others.
#[derive(Clone, Debug, PartialEq)]
pub struct AtlasPlane {
    /// Names of the axes.
    pub names: [String; 2],
    /// Ranges of the axes.
    pub ranges: [[f64; 2]; 2],
    /// Number of cells along each axis.
    pub cells_per_axis: usize,
    /// Classes of the cells, row by row from the lower edge.
    pub cells: Vec<PlaneCell>,
    /// Words of contacts that occur: surfaces in the order in which they are hit.
    pub words: Vec<Vec<usize>>,
    /// Boxes with polynomials that the plane cuts: ends along both axes.
    pub boxes: Vec<[[f64; 2]; 2]>,
    /// Segments of the graze curve.
    pub graze: Vec<[[f64; 2]; 2]>,
}

/// Class of a cell of the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneCell {
    /// Polynomials; index of the word of contacts.
    Word(usize),
    /// Simulated.
    Direct,
    /// No point came here.
    Open,
}

impl AtlasPlane {
    /// Plane of an atlas; `None` for a region of one axis. Calls `look` after each row of cells.
    pub(super) fn new(atlas: &mut Atlas<ReportedReturn<'_>>, look: impl Fn()) -> Option<Self> {
        let axes = atlas.map().map.region().axes.clone();
        let [first, second, ..] = &axes[..] else { return None };
        let middle: Vec<f64> =
            axes.iter().map(|axis| 0.5 * (axis.range[0] + axis.range[1])).collect();
        let on = |at: [f64; 2]| {
            let mut point = middle.clone();
            point[..2].copy_from_slice(&at);
            point
        };
        let ranges = [first.range, second.range];
        let mut plane = Self {
            names: [first.name.clone(), second.name.clone()],
            ranges,
            cells_per_axis: CELLS,
            cells: Vec::with_capacity(CELLS * CELLS),
            words: Vec::new(),
            boxes: Vec::new(),
            graze: Vec::new(),
        };
        for cell in 0..CELLS * CELLS {
            let share = [cell % CELLS, cell / CELLS].map(|at| (at as f64 + 0.5) / CELLS as f64);
            let at = [0, 1].map(|axis| between(ranges[axis], share[axis]));
            let class = plane.class(atlas, &on(at));
            plane.cells.push(class);
            if (cell + 1) % CELLS == 0 {
                look();
            }
        }
        for leaf in atlas.boxes() {
            let sides = leaf.cell.centre.iter().zip(&leaf.cell.half).zip(&middle).skip(2);
            let mut cut = sides.map(|((centre, half), middle)| (middle - centre).abs() <= *half);
            let has_polynomials = matches!(leaf.kind, LeafKind::Smooth | LeafKind::Grazed);
            if !has_polynomials || !cut.all(|cut| cut) {
                continue;
            }
            let ends = [0, 1].map(|axis| {
                let (centre, half) = (leaf.cell.centre[axis], leaf.cell.half[axis]);
                [centre - half, centre + half]
            });
            plane.boxes.push(ends);
            if leaf.kind == LeafKind::Grazed {
                let depth = |at: [f64; 2]| atlas.depth_in(leaf.node, &on(at));
                plane.graze.extend(zero_set(ends, depth));
            }
        }
        Some(plane)
    }

    fn class(&mut self, atlas: &mut Atlas<ReportedReturn<'_>>, point: &[f64]) -> PlaneCell {
        match atlas.kind_at(point) {
            LeafKind::Open => return PlaneCell::Open,
            LeafKind::Direct => return PlaneCell::Direct,
            LeafKind::Smooth | LeafKind::Grazed => {}
        }
        let Some(word) = atlas.map().map.word(point) else { return PlaneCell::Direct };
        let known = self.words.iter().position(|known| *known == word);
        PlaneCell::Word(known.unwrap_or_else(|| {
            self.words.push(word);
            self.words.len() - 1
        }))
    }
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    low + (high - low) * share
}

/// Segments on which a function is zero in a rectangle, linear between the corners of triangles.
fn zero_set(ends: [[f64; 2]; 2], mut function: impl FnMut([f64; 2]) -> f64) -> Vec<[[f64; 2]; 2]> {
    let corner = |column: usize, row: usize| {
        let share = [column, row].map(|at| at as f64 / CURVE_CELLS as f64);
        [between(ends[0], share[0]), between(ends[1], share[1])]
    };
    let width = CURVE_CELLS + 1;
    let corners: Vec<_> =
        (0..width * width).map(|place| corner(place % width, place / width)).collect();
    let values: Vec<f64> = corners.iter().map(|&at| function(at)).collect();
    let crossing = |a: usize, b: usize| {
        let share = values[a] / (values[a] - values[b]);
        let meets = (values[a] > 0.0) != (values[b] > 0.0);
        meets.then(|| [0, 1].map(|axis| between([corners[a][axis], corners[b][axis]], share)))
    };
    let mut segments = Vec::new();
    for place in 0..CURVE_CELLS * CURVE_CELLS {
        let low = (place / CURVE_CELLS) * width + place % CURVE_CELLS;
        let [right, up, far] = [low + 1, low + width, low + width + 1];
        for [a, b, c] in [[low, right, far], [low, up, far]] {
            let found: Vec<_> =
                [(a, b), (b, c), (a, c)].iter().filter_map(|&(a, b)| crossing(a, b)).collect();
            if let [from, to] = found[..] {
                segments.push([from, to]);
            }
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zero_set_of_a_linear_function_is_a_straight_line() {
        let segments = zero_set([[0.0, 1.0], [0.0, 2.0]], |[x, y]| x + y - 1.05);
        let length: f64 = segments.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        assert!(segments.iter().flatten().all(|[x, y]| (x + y - 1.05).abs() < 1e-12));
        assert!((length - 2.0_f64.sqrt()).abs() < 1e-12, "{length}");
    }
}
