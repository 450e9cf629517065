//! The phase of a section point: a coordinate on a circle.
//!
//! Values of the phase a period apart are one point. Offsets are kept within half a period of the
//! section's origin, the periods removed are counted, and points are compared by differences of at
//! most half a period.

use serde::{Deserialize, Serialize};

use crate::numeric::Real;

/// The coordinate of a section that is a phase, with its period. Stroboscopic sections and
/// autonomous systems have none.
///
/// ```
/// use grazemap_map::iteration::PhaseCircle;
///
/// let circle = PhaseCircle::new(1, 6.0);
/// let mut point = [0.5, 13.0];
/// assert_eq!((circle.reduce(&mut point), point), (2, [0.5, 1.0]));
/// assert_eq!(circle.shortest(1, 5.0), -1.0);
/// assert_eq!(PhaseCircle::none().shortest(1, 5.0), 5.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseCircle<S = f64> {
    phase: Option<(usize, S)>,
}

impl<S: Real> PhaseCircle<S> {
    /// A circle of no coordinate.
    pub fn none() -> Self {
        Self { phase: None }
    }

    /// The circle of a coordinate, given by its number and its period.
    pub fn new(coordinate: usize, period: S) -> Self {
        Self { phase: Some((coordinate, period)) }
    }

    /// Number of the phase among the coordinates, and its period.
    pub fn phase(&self) -> Option<(usize, S)> {
        self.phase
    }

    /// Period of a coordinate, if it is the phase.
    fn period(&self, coordinate: usize) -> Option<S> {
        self.phase.filter(|(phase, _)| *phase == coordinate).map(|(_, period)| period)
    }

    /// Difference of two values of a coordinate; of a phase, reduced to at most half a period.
    pub fn shortest(&self, coordinate: usize, difference: S) -> S {
        let period = self.period(coordinate);
        period.map_or(difference, |period| without(period, difference).0)
    }

    /// Value of a coordinate; of a phase, moved by whole periods to within half a period of
    /// `other`.
    pub fn near(&self, coordinate: usize, value: S, other: S) -> S {
        let period = self.period(coordinate);
        period.map_or(value, |period| {
            let (_, turns) = without(period, value - other);
            value - period * S::from_f64(turns.into())
        })
    }

    /// Removes whole periods from the phase of a section point, which then lies within half a
    /// period of the origin; returns their number.
    pub fn reduce(&self, offsets: &mut [S]) -> i32 {
        let Some((phase, period)) = self.phase else { return 0 };
        let (reduced, turns) = without(period, offsets[phase]);
        offsets[phase] = reduced;
        turns
    }

    /// Adds whole periods to the phase of a section point; inverse of [`reduce`](Self::reduce).
    pub fn lift(&self, offsets: &mut [S], turns: i32) {
        if let Some((phase, period)) = self.phase.filter(|_| turns != 0) {
            offsets[phase] += period * S::from_f64(turns.into());
        }
    }

    /// Removes whole periods from the phase of a section point, which then lies within half a
    /// period of `other`; returns their number.
    pub fn bring_near(&self, offsets: &mut [S], other: &[S]) -> i32 {
        let Some((phase, period)) = self.phase else { return 0 };
        let (_, turns) = without(period, offsets[phase] - other[phase]);
        self.lift(offsets, -turns);
        turns
    }
}

impl PhaseCircle {
    /// Largest difference of a coordinate of two points, in units of the scales; NaN if one is NaN.
    pub fn apart(&self, a: &[f64], b: &[f64], scales: &[f64]) -> f64 {
        let pairs = a.iter().zip(b).zip(scales).enumerate();
        let scaled =
            pairs.map(|(place, ((a, b), scale))| self.shortest(place, a - b).abs() / scale);
        scaled.fold(0.0, |largest, value| if value <= largest { largest } else { value })
    }

    /// Shortest interval that holds all values of a coordinate, given their least and greatest. For
    /// a phase it is an arc that begins within half a period of the origin.
    pub(super) fn arc(
        &self,
        coordinate: usize,
        extent: [f64; 2],
        values: impl Iterator<Item = f64>,
    ) -> [f64; 2] {
        let Some(period) = self.period(coordinate) else { return extent };
        if extent[1] - extent[0] <= 0.5 * period || !(extent[1] - extent[0]).is_finite() {
            return extent;
        }
        let mut sorted: Vec<f64> = values.map(|value| without(period, value).0).collect();
        sorted.sort_by(f64::total_cmp);
        let gaps = sorted.windows(2).map(|pair| [pair[0], pair[1]]);
        // The arc is the complement of the widest gap; the first gap is the one through the cut.
        let [first, last] = [sorted[0], sorted[sorted.len() - 1]];
        let (_, arc) = gaps.fold((first + period - last, [first, last]), |widest, [end, begin]| {
            if begin - end > widest.0 { (begin - end, [begin, end + period]) } else { widest }
        });
        arc
    }
}

/// Difference of phases without whole periods, and their number; 0 if the difference is not finite.
fn without<S: Real>(period: S, difference: S) -> (S, i32) {
    let turns = (difference / period).to_f64().round();
    // A point farther away has escaped, and rounding leaves no digits of its phase.
    match turns != 0.0 && turns.abs() < MOST_TURNS {
        true => (difference - period * S::from_f64(turns), turns as i32),
        false => (difference, 0),
    }
}

/// Largest number of whole periods that is removed from a phase.
const MOST_TURNS: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_on_both_sides_of_the_cut_are_near() {
        let circle = PhaseCircle::new(0, 6.0);
        assert!((circle.apart(&[2.9, 1.0], &[-2.9, 1.0], &[1.0, 1.0]) - 0.2).abs() < 1e-15);
        let mut point = [-2.9, 1.0];
        circle.bring_near(&mut point, &[2.9, 0.0]);
        assert!((point[0] - 3.1).abs() < 1e-15);
        assert!(circle.apart(&[f64::NAN], &[1.0], &[1.0]).is_nan());
    }

    #[test]
    fn what_was_reduced_is_lifted_again() {
        let circle = PhaseCircle::new(0, 6.0);
        for value in [-15.5_f64, -3.5, -0.25, 2.75, 9.25] {
            let mut point = [value];
            let turns = circle.reduce(&mut point);
            assert!(point[0].abs() <= 3.0);
            circle.lift(&mut point, turns);
            assert_eq!(point[0], value);
        }
    }

    #[test]
    fn an_arc_passes_the_cut_where_that_is_shorter() {
        let circle = PhaseCircle::new(0, 6.0);
        let arc = |values: &[f64]| {
            let extent = values
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [v.min(a), v.max(b)]);
            circle.arc(0, extent, values.iter().copied())
        };
        assert_eq!(arc(&[-1.0, 1.5, 0.0]), [-1.0, 1.5]);
        assert_eq!(arc(&[2.5, -2.75, -2.5, 2.75]), [2.5, 3.5]);
        assert_eq!(PhaseCircle::none().arc(0, [-3.0, 3.0], [3.0, -3.0].into_iter()), [-3.0, 3.0]);
    }
}
