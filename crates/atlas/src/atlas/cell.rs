//! Dyadic boxes of a region.

/// Box of a region: a centre and a half-width along every axis, and the number of times the region
/// was halved along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Centre, one coordinate per axis.
    pub centre: Vec<f64>,
    /// Half-widths, one per axis.
    pub half: Vec<f64>,
    /// Number of halvings along each axis.
    pub halvings: Vec<u32>,
}

impl Cell {
    /// Whole region, given by the ends of its axes.
    pub fn whole(ranges: &[[f64; 2]]) -> Self {
        Self {
            centre: ranges.iter().map(|[low, high]| 0.5 * (low + high)).collect(),
            half: ranges.iter().map(|[low, high]| 0.5 * (high - low)).collect(),
            halvings: vec![0; ranges.len()],
        }
    }

    /// The two halves along an axis, the lower one first.
    pub fn halves(&self, axis: usize) -> [Self; 2] {
        [-1.0, 1.0].map(|side| {
            let mut half = self.clone();
            half.half[axis] *= 0.5;
            half.centre[axis] += side * half.half[axis];
            half.halvings[axis] += 1;
            half
        })
    }

    /// Total number of halvings.
    pub fn depth(&self) -> u32 {
        self.halvings.iter().sum()
    }

    /// Point of the box with coordinates in `[−1, 1]`, or in the unit cube if `unit` holds them.
    pub(super) fn point(&self, unit: &[f64]) -> Vec<f64> {
        let sides = self.centre.iter().zip(&self.half).zip(unit);
        sides.map(|((centre, half), share)| centre + half * (2.0 * share - 1.0)).collect()
    }

    /// Axis along which the box was halved least; the first of several.
    pub(super) fn widest(&self) -> usize {
        let least = self.halvings.iter().enumerate().min_by_key(|&(_, halvings)| halvings);
        least.map_or(0, |(axis, _)| axis)
    }
}
