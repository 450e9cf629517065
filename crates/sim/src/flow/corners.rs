//! Corners of a field: zeros at which `abs`, `sign`, `min` or `max` changes its branch, or `atan2`
//! meets its cut.
//!
//! A series represents one branch only. One idea: a step that would pass a corner ends just behind
//! it, by the rounding of the function that is zero at the corner, so that the next series is that
//! of the other branch. The solution follows the wrong branch only for that rounding.

use super::program::{InputKind, Operation, Program, Slot};
use crate::numeric::polynomial::{crossings, evaluate, size};
use crate::numeric::{Branched, Mask as _, Scalar};

/// A corner: the zero of a slot of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Slot whose sign selects the branch.
    argument: Slot,
    /// Slot that must be negative for the corner to exist: the `x` of `atan2(y, x)`.
    beside: Option<Slot>,
}

/// Corners of a program's operations that a solution may meet; `inputs` as in the lowering.
pub(super) fn corners(program: &Program, inputs: &[InputKind]) -> Vec<Corner> {
    let moves = program.moving(inputs);
    let mut found = Vec::new();
    for slot in inputs.len()..program.slots() {
        let corner = match *program.operation(slot) {
            Operation::SignTimes { a, .. } | Operation::Sign(a) => {
                Corner { argument: a, beside: None }
            }
            Operation::Atan2 { y, x, .. } => Corner { argument: y, beside: Some(x) },
            _ => continue,
        };
        if moves[corner.argument] && !found.contains(&corner) {
            found.push(corner);
        }
    }
    found
}

/// Number of roundings of an argument within which it counts as zero.
const ROUNDINGS: f64 = 8.0;

/// Largest number of halvings of a step in the search for the time on which the slope dominates.
const MOST_HALVES: usize = 100;

/// Largest distance behind a corner at which a step ends, as a share of the step.
const BEHIND: f64 = 1e-6;

/// A length of either sign, cut just behind the first corner on the way; `series` gives the
/// coefficients of a slot.
pub(super) fn cut<'s, S: Branched>(
    corners: &[Corner],
    series: impl Fn(Slot) -> &'s [S],
    length: S,
) -> S {
    if corners.is_empty() {
        return length;
    }
    let whole = length.rounded();
    let mut shortest = whole;
    for lane in whole.is_equal(whole).lanes() {
        let of_lane =
            |slot: Slot| -> Vec<f64> { series(slot).iter().map(|c| c.lane(lane)).collect() };
        let end = length.lane(lane);
        let met = corners.iter().filter_map(|corner| corner.met(of_lane, end));
        let first = met.fold(end.abs(), |first, met| first.min(met.abs()));
        let first = S::Rounded::from_f64(first.copysign(end));
        shortest = S::Rounded::select(S::Mask::only(lane), first, shortest);
    }
    S::select(shortest.is_equal(whole), length, S::from_rounded(shortest))
}

impl Corner {
    /// Slots that determine the corner.
    pub(super) fn slots(&self) -> impl Iterator<Item = Slot> {
        std::iter::once(self.argument).chain(self.beside)
    }

    /// Time just behind the corner on the way to `end`, which has either sign.
    fn met(&self, series: impl Fn(Slot) -> Vec<f64>, end: f64) -> Option<f64> {
        let argument = series(self.argument);
        let beside = self.beside.map(series);
        let exists = |time: f64| beside.as_ref().is_none_or(|x| evaluate(x, time).0 < 0.0);
        first_change(&argument, end, exists)
    }
}

/// First time on the way to `end` at which the sign of a polynomial differs from that at the start
/// by more than its rounding, and at which the corner exists.
fn first_change(coefficients: &[f64], end: f64, exists: impl Fn(f64) -> bool) -> Option<f64> {
    let rounding = ROUNDINGS * f64::EPSILON * size(coefficients, reach(coefficients, end.abs()));
    let mut way = coefficients.to_vec();
    if way[0].abs() <= rounding {
        // NOTE: the sign of 0 is 0, as in the operations.
        let sign = Scalar::signum(way[0]);
        way[0] = 0.0;
        let term = |k: usize| way[k] * end.powi(k as i32);
        let leads = (1..way.len()).find(|&k| term(k).abs() > rounding)?;
        if term(leads).signum() != sign && exists(0.0) {
            let share = (2.0 * rounding / term(leads).abs()).powf(1.0 / leads as f64);
            return Some(share.min(1.0) * end);
        }
    }
    let there = crossings(&way, end).into_iter().map(|crossing| crossing.time);
    let time = there.into_iter().find(|&time| exists(time))?;
    let behind = (2.0 * rounding / evaluate(&way, time).1.abs()).min(BEHIND * end.abs());
    Some(time + behind.copysign(end))
}

/// The longest time, of `longest` and its repeated halves, on which the first two coefficients of a
/// polynomial dominate. The roundings are judged on this time, because a step may be much longer.
fn reach(coefficients: &[f64], longest: f64) -> f64 {
    let [value, slope] = [0, 1].map(|k| coefficients.get(k).map_or(0.0, |c| c.abs()));
    if value == 0.0 && slope == 0.0 {
        return longest;
    }
    let is_led = |&time: &f64| size(coefficients, time) <= 2.0 * (value + slope * time);
    let halves = std::iter::successors(Some(longest), |time| Some(0.5 * time));
    halves.take(MOST_HALVES).find(is_led).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn anywhere(_: f64) -> bool {
        true
    }

    #[test]
    fn a_step_ends_just_behind_the_first_zero_in_its_direction() {
        // (t − 1/4)(t − 3/4) and its mirror image.
        // Twice the rounding, 8 units of 2.2, divided by the slope, 1/2.
        let ahead = first_change(&[0.1875, -1.0, 1.0], 1.0, anywhere).unwrap();
        assert!(ahead > 0.25 && ahead < 0.25 + 2e-14, "{ahead}");
        let back = first_change(&[0.1875, 1.0, 1.0], -1.0, anywhere).unwrap();
        assert_eq!(back, -ahead);
        assert_eq!(first_change(&[0.1875, -1.0, 1.0], -1.0, anywhere), None);
        assert_eq!(first_change(&[1.0, 0.0, 1.0], 1.0, anywhere), None);
    }

    #[test]
    fn a_start_on_a_corner_leaves_it_on_the_side_to_which_the_argument_goes() {
        // The sign at the start is positive, and the value falls: the change is at once, by the
        // rounding.
        let across = first_change(&[0.0, -1.0], 1.0, anywhere).unwrap();
        assert!(across > 0.0 && across < 1e-14, "{across}");
        assert_eq!(first_change(&[-1e-17, -1.0], 1.0, anywhere), None);
        // A zero at the start has no sign yet.
        assert!(first_change(&[0.0, 1.0], 1.0, anywhere).unwrap() < 1e-14);
        // The polynomial rests on the corner.
        assert_eq!(first_change(&[0.0, 0.0, 0.0], 1.0, anywhere), None);
    }

    #[test]
    fn a_corner_that_does_not_exist_there_is_passed() {
        let beyond = |time: f64| time > 0.5;
        let found = first_change(&[0.1875, -1.0, 1.0], 1.0, beyond).unwrap();
        assert!((found - 0.75).abs() < 2e-14, "{found}");
    }
}
