//! Corners of a field: places where `abs`, `sign`, `min` or `max` changes its branch, or where
//! `atan2` meets its cut.
//!
//! A series knows one branch alone. One idea: a step that would pass a corner ends just behind it,
//! by the rounding of the function whose zero the corner is, so that the next series is that of the
//! other branch. The wrong branch is followed for that rounding alone.

use super::program::{InputKind, Operation, Program, Slot};
use crate::numeric::polynomial::{crossings, evaluate, size};
use crate::numeric::{Branched, Mask as _, Scalar};

/// A corner: the zero of a slot of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// The slot whose sign decides.
    argument: Slot,
    /// A slot that is negative where the corner exists: the `x` of `atan2(y, x)`.
    beside: Option<Slot>,
}

/// The corners of a program's operations that a solution may meet; `inputs` as it was lowered with.
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

/// Roundings of an argument within which it is on its corner.
const ROUNDINGS: f64 = 8.0;

/// Most halvings of a step towards the time in which an argument is led by its slope.
const MOST_HALVES: usize = 100;

/// Largest share of a step by which it ends behind a corner.
const BEHIND: f64 = 1e-6;

/// A length of either sign, cut just behind the first of some corners on the way; `series` gives
/// the coefficients of a slot.
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
    /// The slots that tell where it is.
    pub(super) fn slots(&self) -> impl Iterator<Item = Slot> {
        std::iter::once(self.argument).chain(self.beside)
    }

    /// Time just behind the corner on the way to a time of either sign.
    fn met(&self, series: impl Fn(Slot) -> Vec<f64>, end: f64) -> Option<f64> {
        let argument = series(self.argument);
        let beside = self.beside.map(series);
        let exists = |time: f64| beside.as_ref().is_none_or(|x| evaluate(x, time).0 < 0.0);
        first_change(&argument, end, exists)
    }
}

/// The first time on the way to `end` by which a polynomial has another sign than at the start, by
/// more than its rounding, where the corner exists.
fn first_change(coefficients: &[f64], end: f64, exists: impl Fn(f64) -> bool) -> Option<f64> {
    let rounding = ROUNDINGS * f64::EPSILON * size(coefficients, reach(coefficients, end.abs()));
    let mut way = coefficients.to_vec();
    if way[0].abs() <= rounding {
        // NOTE: 0 at 0, as the operations have it.
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

/// The longest time, of the halves of another, in which a polynomial is led by its first two
/// coefficients: a step may be much longer than what its roundings come from.
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
        // Twice the rounding, 8 units of 2.2, over the slope, 1/2.
        let ahead = first_change(&[0.1875, -1.0, 1.0], 1.0, anywhere).unwrap();
        assert!(ahead > 0.25 && ahead < 0.25 + 2e-14, "{ahead}");
        let back = first_change(&[0.1875, 1.0, 1.0], -1.0, anywhere).unwrap();
        assert_eq!(back, -ahead);
        assert_eq!(first_change(&[0.1875, -1.0, 1.0], -1.0, anywhere), None);
        assert_eq!(first_change(&[1.0, 0.0, 1.0], 1.0, anywhere), None);
    }

    #[test]
    fn a_start_on_a_corner_leaves_it_on_the_side_to_which_the_argument_goes() {
        // Positive there by its sign, and going down: across at once, by its rounding.
        let across = first_change(&[0.0, -1.0], 1.0, anywhere).unwrap();
        assert!(across > 0.0 && across < 1e-14, "{across}");
        assert_eq!(first_change(&[-1e-17, -1.0], 1.0, anywhere), None);
        // Zero has no sign yet.
        assert!(first_change(&[0.0, 1.0], 1.0, anywhere).unwrap() < 1e-14);
        // At rest on it.
        assert_eq!(first_change(&[0.0, 0.0, 0.0], 1.0, anywhere), None);
    }

    #[test]
    fn a_corner_that_does_not_exist_there_is_passed() {
        let beyond = |time: f64| time > 0.5;
        let found = first_change(&[0.1875, -1.0, 1.0], 1.0, beyond).unwrap();
        assert!((found - 0.75).abs() < 2e-14, "{found}");
    }
}
