//! A branch of periodic orbits, followed in a coordinate of its first point.

use super::newton::periodic_orbit;
use super::orbit::PeriodicOrbit;
use super::problem::{Guess, Held, PeriodicProblem};
use super::section_map::SectionMap;
use crate::numeric::Real;

/// Orbits at these values of a coordinate of the first point, each search beginning at the last
/// orbit found, or beyond it on the line through the last two; the branch ends with the first value
/// at which there is no orbit of the itinerary.
///
/// ```text
/// P^n(x, p) = x,   x_c = value:   p along the branch is a smooth function of the value, through folds too
/// ```
pub fn branch<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    coordinate: usize,
    values: &[S],
    guess: &Guess<S>,
) -> Vec<PeriodicOrbit<S>> {
    let mut orbits: Vec<PeriodicOrbit<S>> = Vec::with_capacity(values.len());
    for &value in values {
        let start = predicted(&orbits, coordinate, value, guess);
        let held = Held::Coordinate(coordinate);
        match periodic_orbit(map, problem, held, &start).found() {
            Some(orbit) => orbits.push(orbit),
            None => break,
        }
    }
    orbits
}

/// The guess with the coordinate set: the line through the last two orbits, the last, or the guess
/// given.
fn predicted<S: Real>(
    orbits: &[PeriodicOrbit<S>],
    coordinate: usize,
    value: S,
    guess: &Guess<S>,
) -> Guess<S> {
    let mut start = match orbits {
        [.., before, last] => line(&before.guess(), &last.guess(), coordinate, value),
        [last] => last.guess(),
        [] => guess.clone(),
    };
    start.state[coordinate] = value;
    start
}

/// The point of the line through two guesses at which a coordinate has a value; the second where it
/// does not vary.
pub(super) fn line<S: Real>(a: &Guess<S>, b: &Guess<S>, coordinate: usize, value: S) -> Guess<S> {
    let run = b.state[coordinate] - a.state[coordinate];
    let share = if run == S::zero() {
        S::one()
    } else {
        (value - a.state[coordinate]) / run
    };
    let between = |a: &[S], b: &[S]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(&a, &b)| a + share * (b - a)).collect()
    };
    Guess {
        state: between(&a.state, &b.state),
        parameters: between(&a.parameters, &b.parameters),
    }
}
