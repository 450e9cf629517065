//! Integrals of functions that change rapidly, by Gauss' rule on cells that shrink towards known
//! places, or on many equal cells.

use std::f64::consts::{PI, TAU};

const POINTS: usize = 16;

/// Distance from a place within which a function changes by nothing that counts, and the ratio of
/// neighbouring cells.
const LEAST: f64 = 1e-12;
const RATIO: f64 = 1.25;

/// Nodes and weights of Gauss' rule on `[−1, 1]`.
fn gauss() -> [(f64, f64); POINTS] {
    std::array::from_fn(|i| {
        let order = POINTS as f64;
        let mut x = (PI * (i as f64 + 0.75) / (order + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..10 {
            let (mut before, mut value) = (1.0, x);
            for m in 1..POINTS {
                let (m, next) = (m as f64, value);
                value = ((2.0 * m + 1.0) * x * value - m * before) / (m + 1.0);
                before = next;
            }
            slope = order * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// The integral from `from` to `to` of a function of period 2π that changes rapidly at some phases.
pub(crate) fn integral(value: impl Fn(f64) -> f64, [from, to]: [f64; 2], places: &[f64]) -> f64 {
    let mut ends = vec![from, to];
    for &place in places {
        let first = ((from - place) / TAU).floor() as i32 - 1;
        let last = ((to - place) / TAU).ceil() as i32 + 1;
        for turn in first..=last {
            let centre = place + TAU * f64::from(turn);
            ends.push(centre);
            let mut distance = LEAST;
            while distance < PI {
                ends.extend([centre - distance, centre + distance]);
                distance *= RATIO;
            }
        }
    }
    ends.retain(|end| (from..=to).contains(end));
    ends.sort_by(f64::total_cmp);
    on_cells(value, &ends)
}

/// The integral from `from` to `to` of a function, on a number of equal cells.
pub(crate) fn even_integral(value: impl Fn(f64) -> f64, [from, to]: [f64; 2], cells: usize) -> f64 {
    let end = |cell: usize| from + (to - from) * cell as f64 / cells as f64;
    on_cells(value, &Vec::from_iter((0..=cells).map(end)))
}

/// The integral over cells, given by their ends.
fn on_cells(value: impl Fn(f64) -> f64, ends: &[f64]) -> f64 {
    let rule = gauss();
    let (mut sum, mut rest) = (0.0, 0.0);
    for pair in ends.windows(2) {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let terms = rule.iter().map(|&(x, weight)| weight * value(middle + half * x));
        // Kahan's sum.
        let term = half * terms.sum::<f64>() - rest;
        let next = sum + term;
        rest = (next - sum) - term;
        sum = next;
    }
    sum
}
