//! Very many dots, drawn once for every cell of a grid that holds any.
//!
//! Ink laid twice on a place shows nothing new. The grid is finer than a screen resolves; where the
//! cells would still make the SVG too large it is halved until they do not.

use std::collections::BTreeSet;

use super::clip::Area;
use super::drawing::{DotRuns, Point};
use super::palette::Rgb;

/// Up to so many dots of a figure are drawn where they are.
pub(super) const EXACT_DOTS: usize = 4000;
/// Columns and rows of the finest grid.
const FINEST: (usize, usize) = (1600, 1000);
/// Runs of cells, about eight bytes each, that keep an SVG well below 2 MB.
const MOST_RUNS: usize = 170_000;
/// Smallest and largest diameter of a dot, in pixels.
const DIAMETERS: (f64, f64) = (0.9, 3.0);

/// The diameter of so many dots: 1.8 pixels of [`EXACT_DOTS`], and the ink shrinks with the root of
/// their number.
pub(super) fn diameter(dots: usize) -> f64 {
    let share = EXACT_DOTS as f64 / dots.max(1) as f64;
    (1.8 * share.powf(0.25)).clamp(DIAMETERS.0, DIAMETERS.1)
}

/// All dots of a figure on one grid, the diameter not yet set.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ThinnedDots {
    pub(super) grid: (usize, usize),
    pub(super) cells: usize,
    pub(super) dots: Vec<DotRuns>,
}

/// The series of a figure, each with its colour, on the finest grid that stays within bounds.
pub(super) fn thin(series: &[(Vec<Point>, Rgb)], area: &Area) -> ThinnedDots {
    let mut grid = FINEST;
    loop {
        let found = on_grid(series, area, grid);
        let runs: usize = found.dots.iter().map(|dots| dots.runs.len()).sum();
        if runs <= MOST_RUNS || grid.0 < 100 {
            return found;
        }
        grid = (grid.0 / 2, grid.1 / 2);
    }
}

fn on_grid(series: &[(Vec<Point>, Rgb)], area: &Area, grid: (usize, usize)) -> ThinnedDots {
    let pitch = (area.width() / grid.0 as f64, area.height() / grid.1 as f64);
    let cell_of = |x: f64, start: f64, size: f64, count: usize| {
        (((x - start) / size).max(0.0) as u32).min(count as u32 - 1)
    };
    let mut cells = 0;
    let dots = series
        .iter()
        .map(|(points, color)| {
            let filled: BTreeSet<(u32, u32)> = points
                .iter()
                .map(|&(x, y)| {
                    let column = cell_of(x, area.left, pitch.0, grid.0);
                    (cell_of(y, area.top, pitch.1, grid.1), column)
                })
                .collect();
            cells += filled.len();
            DotRuns {
                origin: (area.left + pitch.0 / 2.0, area.top + pitch.1 / 2.0),
                pitch,
                runs: runs(&filled),
                diameter: pitch.0.max(pitch.1),
                color: *color,
            }
        })
        .collect();
    ThinnedDots { grid, cells, dots }
}

fn runs(filled: &BTreeSet<(u32, u32)>) -> Vec<(u32, u32, u32)> {
    let mut runs: Vec<(u32, u32, u32)> = Vec::new();
    for &(row, column) in filled {
        match runs.last_mut() {
            Some((r, first, count)) if *r == row && *first + *count == column => *count += 1,
            _ => runs.push((row, column, 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { left: 0.0, top: 0.0, right: 800.0, bottom: 500.0 };

    #[test]
    fn dots_of_one_cell_are_drawn_once_and_neighbours_join() {
        let points = vec![(0.1, 0.1), (0.2, 0.3), (0.6, 0.1), (800.0, 500.0)];
        let thinned = thin(&[(points, [0, 0, 0])], &AREA);
        assert_eq!(thinned.grid, FINEST);
        assert_eq!(thinned.cells, 3);
        assert_eq!(thinned.dots[0].runs, [(0, 0, 2), (999, 1599, 1)]);
    }

    #[test]
    fn a_full_plane_takes_a_coarser_grid() {
        let points: Vec<Point> = (0..1_000_000_u64)
            .map(|k| {
                let scattered = k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 20;
                ((scattered % 8000) as f64 / 10.0, (scattered / 8000 % 5000) as f64 / 10.0)
            })
            .collect();
        let thinned = thin(&[(points, [0, 0, 0])], &AREA);
        assert!(thinned.grid.0 < FINEST.0);
        assert!(thinned.dots[0].runs.len() <= MOST_RUNS);
    }
}
