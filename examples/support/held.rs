//! Periodic orbits of any map along a coordinate of their first point, and the folds and flips
//! between two of them, from `det(J − I)` and `det(J + I)` alone: a second way beside continuation
//! by arclength, of which neither knows the other.

use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{
    Guess, Held, PeriodicOrbit, PeriodicProblem, SectionMap, periodic_orbit,
};
use grazemap::numeric::{Bracket, Real};

/// Orbits at these values of a coordinate of the first point, each search beginning at the last
/// orbit found, or beyond it on the line through the last two; the branch ends with the first value
/// at which there is no orbit of the itinerary.
///
/// ```text
/// P^n(x, p) = x,   x_c = value
/// ```
///
/// Along the branch `p` is a smooth function of the value, through folds too.
pub(crate) fn branch<S: Real>(
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
fn line<S: Real>(a: &Guess<S>, b: &Guess<S>, coordinate: usize, value: S) -> Guess<S> {
    let run = b.state[coordinate] - a.state[coordinate];
    let share = if run == S::zero() { S::one() } else { (value - a.state[coordinate]) / run };
    let between = |a: &[S], b: &[S]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(&a, &b)| a + share * (b - a)).collect()
    };
    Guess { state: between(&a.state, &b.state), parameters: between(&a.parameters, &b.parameters) }
}

/// A bifurcation of a branch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bifurcation<S> {
    /// Which.
    pub(crate) kind: BifurcationKind,
    /// The orbit.
    pub(crate) orbit: PeriodicOrbit<S>,
}

/// The bifurcation between two orbits of a branch, which differ in a coordinate of their first
/// points; `None` if `det(J ∓ I)` has the same sign at both, or the branch is lost in between.
///
/// A safeguarded search (no derivative of a determinant is needed) over the coordinate, the orbit
/// solved for at each trial from its neighbours; the depth of the graze is never the unknown of a
/// Newton step, in which it would be a root.
pub(crate) fn bifurcation<S: Real>(
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

/// The orbit between two of a branch at which a function of orbits vanishes; `None` if it has the
/// same sign at both.
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

/// The orbit at a value, looked for on the line through two others.
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
