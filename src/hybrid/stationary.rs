//! Isolation of every stationary point of a gap in a step: all zeros of its slope, in `f64`.
//!
//! An interval of half-width `w` about `m` holds no zero of `p` if `|p(m)| > w (|p'(m)| + B w/2)` and at
//! most one if `|p'(m)| > B w`, where `B` bounds `|p''|` on it; otherwise it is halved.

use crate::numeric::Real;
use crate::numeric::polynomial::value_and_slope;

/// Zeros of a slope, and the memory to find them.
#[derive(Clone, Debug, Default)]
pub(super) struct StationaryPoints {
    /// The zeros in units of the step, increasing.
    pub(super) roots: Vec<f64>,
    scaled: Vec<f64>,
    pending: Vec<(f64, f64)>,
}

/// Intervals examined per step before the rest is given up; a step of an analytic field needs tens.
const MAX_INTERVALS: usize = 100_000;
/// Half-width, relative to the step, below which a multiple zero of the slope is not resolved.
const SMALLEST_HALF: f64 = 1e-9;

impl StationaryPoints {
    /// Fills `roots` with the zeros of the slope in units of the length, increasing.
    pub(super) fn isolate<S: Real>(&mut self, slope: &[S], length: f64) {
        self.scaled.clear();
        let mut power = 1.0;
        for coefficient in slope {
            self.scaled.push(coefficient.to_f64() * power);
            power *= length;
        }
        self.roots.clear();
        let size: f64 = self.scaled.iter().map(|c| c.abs()).sum();
        if !(size > 0.0 && size.is_finite()) {
            return;
        }
        while self.scaled.len() > 2 && self.scaled.last().is_some_and(|c| c.abs() < 1e-18 * size) {
            self.scaled.pop();
        }
        self.pending.clear();
        self.pending.push((0.0, 1.0));
        for _ in 0..MAX_INTERVALS {
            let Some((a, b)) = self.pending.pop() else {
                return;
            };
            self.examine(a, b);
        }
    }

    /// Excludes, solves or splits one interval.
    fn examine(&mut self, a: f64, b: f64) {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let (value, slope) = value_and_slope(&self.scaled, middle);
        let bound = curvature_bound(&self.scaled, b);
        if value.abs() > half * (slope.abs() + 0.5 * bound * half) {
            return;
        }
        if slope.abs() > bound * half || half < SMALLEST_HALF {
            let (left, right) = (
                value_and_slope(&self.scaled, a).0,
                value_and_slope(&self.scaled, b).0,
            );
            if (left < 0.0) != (right < 0.0) {
                let root = monotone_root(&self.scaled, (a, middle, b), left < 0.0);
                self.roots.push(root);
            }
            return;
        }
        self.pending.push((middle, b));
        self.pending.push((a, middle));
    }
}

/// Bound of the second derivative on `[0, at]`.
fn curvature_bound(coefficients: &[f64], at: f64) -> f64 {
    let mut bound = 0.0;
    for (degree, coefficient) in coefficients.iter().enumerate().skip(2).rev() {
        bound = bound * at + (degree * (degree - 1)) as f64 * coefficient.abs();
    }
    bound
}

/// The one zero of a polynomial with a sign change on `[a, b]`: Newton from `at`, kept inside by bisection.
fn monotone_root(
    coefficients: &[f64],
    (mut a, mut at, mut b): (f64, f64, f64),
    rising: bool,
) -> f64 {
    let size = b;
    for _ in 0..60 {
        let (value, slope) = value_and_slope(coefficients, at);
        if (value < 0.0) == rising {
            a = at;
        } else {
            b = at;
        }
        let newton = at - value / slope;
        let next = if newton > a && newton < b {
            newton
        } else {
            0.5 * (a + b)
        };
        if (next - at).abs() < 1e-9 * size && next == newton {
            // NOTE: Newton's method squares the error.
            return next;
        }
        if next == at {
            return next;
        }
        at = next;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_and_distant_zeros_are_all_isolated() {
        // (t − 0.2)(t − 0.2 − 1e-6)(t − 0.9)
        let (a, b, c) = (0.2, 0.2 + 1e-6, 0.9);
        let coefficients = [-a * b * c, a * b + a * c + b * c, -(a + b + c), 1.0];
        let mut found = StationaryPoints::default();
        found.isolate(&coefficients, 1.0);
        assert_eq!(found.roots.len(), 3, "{:?}", found.roots);
        for (root, expected) in found.roots.iter().zip([a, b, c]) {
            // Conditioning of the close pair: rounding 1e-17 over the slope 7e-7.
            assert!((root - expected).abs() < 1e-9, "{root} {expected}");
        }
    }

    #[test]
    fn a_vanishing_slope_has_no_stationary_points() {
        let mut found = StationaryPoints::default();
        found.isolate(&[0.0f64; 8], 1.0);
        assert!(found.roots.is_empty());
    }
}
