//! Periodic orbits of any map along a coordinate of their first point, and the folds and flips
//! between two of them, from `det(J − I)` and `det(J + I)` alone: a method that is independent of
//! continuation by arclength.

use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{
    Guess, Held, PeriodicOrbit, PeriodicProblem, SectionMap, periodic_orbit,
};
use grazemap::numeric::{Bracket, Real};

/// Orbits at these values of a coordinate of the first point. Each search begins at the last orbit
/// found, or beyond it on the line through the last two. The branch ends at the first value without
/// an orbit of the itinerary.
///
/// ```text
/// P^n(x, p) = x,   x_c = value
/// ```
///
/// Along the branch `p` is a smooth function of the value, even through folds.
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

/// Guess with the coordinate set: on the line through the last two orbits, else the last orbit,
/// else the guess given.
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

/// Point of the line through two guesses at which a coordinate has a value; the second guess if the
/// coordinate is constant.
fn line<S: Real>(a: &Guess<S>, b: &Guess<S>, coordinate: usize, value: S) -> Guess<S> {
    let run = b.state[coordinate] - a.state[coordinate];
    let share = if run == S::zero() { S::one() } else { (value - a.state[coordinate]) / run };
    let between = |a: &[S], b: &[S]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(&a, &b)| a + share * (b - a)).collect()
    };
    Guess { state: between(&a.state, &b.state), parameters: between(&a.parameters, &b.parameters) }
}

/// Bifurcation of a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct Bifurcation<S> {
    /// Kind of the bifurcation.
    pub kind: BifurcationKind,
    /// Orbit at the bifurcation.
    pub orbit: PeriodicOrbit<S>,
}

/// Bifurcation between two orbits of a branch that differ in a coordinate of their first points;
/// `None` if `det(J ∓ I)` has the same sign at both, or if the branch is lost in between.
///
/// Safeguarded search over the coordinate, without derivatives of the determinant. At each trial
/// the orbit is solved for from its neighbours. The depth of the graze is never the unknown of a
/// Newton step, in which it would be a root.
pub fn bifurcation<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    kind: BifurcationKind,
    coordinate: usize,
    ends: [&PeriodicOrbit<S>; 2],
) -> Option<Bifurcation<S>> {
    let test = |orbit: &PeriodicOrbit<S>| orbit.characteristic(kind.multiplier()).ok();
    let orbit = zero_between(map, problem, coordinate, ends, test)?;
    Some(Bifurcation { kind, orbit })
}

/// Orbit between two of a branch at which a function of orbits vanishes; `None` if it has the same
/// sign at both.
fn zero_between<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    coordinate: usize,
    ends: [&PeriodicOrbit<S>; 2],
    test: impl Fn(&PeriodicOrbit<S>) -> Option<S>,
) -> Option<PeriodicOrbit<S>> {
    let place = |orbit: &PeriodicOrbit<S>| orbit.states[0][coordinate];
    let (lower, upper) = (place(ends[0]), place(ends[1]));
    let values = (test(ends[0])?, test(ends[1])?);
    let bracket = Bracket::new(lower, upper, values.0, values.1).ok()?;
    let mut known = [ends[0].clone(), ends[1].clone()];
    let tolerance = (upper - lower).abs() * S::from_f64(S::ROUNDOFF.powf(0.75));
    let root =
        bracket.itp(values, tolerance, |value| match at(map, problem, coordinate, &known, value) {
            Some(orbit) => {
                let value = test(&orbit).unwrap_or(S::from_f64(f64::NAN));
                known = [std::mem::replace(&mut known[1], orbit.clone()), orbit];
                value
            }
            None => S::from_f64(f64::NAN),
        });
    at(map, problem, coordinate, &known, root.root()?)
}

/// Orbit at a value, searched for on the line through two others.
fn at<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    coordinate: usize,
    known: &[PeriodicOrbit<S>; 2],
    value: S,
) -> Option<PeriodicOrbit<S>> {
    let mut guess = line(&known[0].guess(), &known[1].guess(), coordinate, value);
    guess.state[coordinate] = value;
    periodic_orbit(map, problem, Held::Coordinate(coordinate), &guess).found()
}
