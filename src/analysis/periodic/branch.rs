//! A branch of periodic orbits, followed in a coordinate of its first point, and its folds and
//! flips: zeros of `det(J − I)` and `det(J + I)` between two of its orbits.

use super::orbit::{Guess, Held, PeriodicOrbit, PeriodicProblem, periodic_orbit};
use super::section_map::SectionMap;
use crate::numeric::{Bracket, Real};

/// Orbits at these values of a coordinate of the first point, each search beginning at the last
/// orbit found, or beyond it on the line through the last two; the branch ends with the first value
/// at which there is no orbit of the itinerary.
///
/// ```text
/// P^n(x, p) = x,   x_c = value
/// ```
///
/// Along the branch `p` is a smooth function of the value, through folds too.
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
    let share = if run == S::zero() { S::one() } else { (value - a.state[coordinate]) / run };
    let between = |a: &[S], b: &[S]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(&a, &b)| a + share * (b - a)).collect()
    };
    Guess { state: between(&a.state, &b.state), parameters: between(&a.parameters, &b.parameters) }
}

/// A change of stability of a periodic orbit that one parameter meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BifurcationKind {
    /// Saddle-node: a multiplier 1, the branch turns back in the parameter.
    Fold,
    /// Period-doubling: a multiplier −1.
    Flip,
}

/// A bifurcation of a branch.
#[derive(Clone, Debug, PartialEq)]
pub struct Bifurcation<S> {
    /// Which.
    pub kind: BifurcationKind,
    /// The orbit.
    pub orbit: PeriodicOrbit<S>,
}

impl BifurcationKind {
    /// `fold` or `flip`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fold => "fold",
            Self::Flip => "flip",
        }
    }

    /// The multiplier.
    pub fn multiplier(self) -> f64 {
        match self {
            Self::Fold => 1.0,
            Self::Flip => -1.0,
        }
    }
}

/// The bifurcation between two orbits of a branch, which differ in a coordinate of their first
/// points; `None` if `det(J ∓ I)` has the same sign at both, or the branch is lost in between.
///
/// A safeguarded search (no derivative of a determinant is needed) over the coordinate, the orbit
/// solved for at each trial from its neighbours; the depth of the graze is never the unknown of a
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

/// The orbit between two of a branch at which a function of orbits vanishes; `None` if it has the
/// same sign at both.
pub(super) fn zero_between<S: Real>(
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

#[cfg(test)]
mod tests {
    use super::super::orbit::{Guess, PeriodicOutcome};
    use super::super::section_map::SectionStep;
    use super::*;
    use crate::iteration::PassageSet;
    use crate::numeric::Dd;

    /// `x ↦ p + x/2` without contact, `x ↦ p − k √x` with: the one-dimensional square-root map, `k
    /// = 3/10`.
    struct SquareRoot;

    const KICK: f64 = 0.3;

    impl<S: Real> SectionMap<S> for SquareRoot {
        fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
            let (x, p) = (state[0], parameters[0]);
            let contact = x > S::zero();
            let image = match contact {
                true => p - S::from_f64(KICK) * x.sqrt(),
                false => p + S::from_f64(0.5) * x,
            };
            Some(SectionStep {
                offsets: vec![image],
                contacts: contact.then_some(0).into_iter().collect(),
                depth: x.max(S::zero()),
                extra_contacts: 0,
            })
        }
    }

    fn problem(contact: bool) -> PeriodicProblem {
        let made: PassageSet = contact.then_some(0).into_iter().collect();
        PeriodicProblem { returns: 1, free: 0, itinerary: Some(vec![made]), scales: vec![1.0, 1.0] }
    }

    fn guess<S: Real>(state: f64, parameter: f64) -> Guess<S> {
        Guess { state: vec![S::from_f64(state)], parameters: vec![S::from_f64(parameter)] }
    }

    /// The orbit has `x + k √x = p` and the multiplier `−k/(2√x)`, which is −1 at `x = k²/4`, `p =
    /// 3k²/4`.
    fn flips_in<S: Real>(tolerance: f64) {
        let depths = [1e-4, 1e-3, 1e-2, 1e-1].map(S::from_f64);
        let orbits = branch(&mut SquareRoot, &problem(true), 0, &depths, &guess(0.0, 0.0));
        assert_eq!(orbits.len(), 4);
        let flips = orbits.windows(2).filter_map(|pair| {
            let ends = [&pair[0], &pair[1]];
            bifurcation(&mut SquareRoot, &problem(true), BifurcationKind::Flip, 0, ends)
        });
        let flips: Vec<_> = flips.collect();
        assert_eq!(flips.len(), 1);
        let expected = 0.75 * KICK * KICK;
        let error = flips[0].orbit.parameters[0] - S::from_f64(expected);
        assert!(error.magnitude() < tolerance, "{error:?}");
    }

    #[test]
    fn the_flip_of_the_square_root_map_is_where_algebra_has_it() {
        // In double precision derivatives keep twelve digits; in double-double the expected value
        // is rounded to sixteen.
        flips_in::<f64>(1e-11);
        flips_in::<Dd>(1e-16);
    }

    #[test]
    fn an_orbit_of_other_contacts_is_not_the_one_asked_for() {
        // Without contact x = 2p: for p > 0 it would be beyond the stop.
        let held = Held::Parameter;
        let found = periodic_orbit(&mut SquareRoot, &problem(false), held, &guess(0.3, 0.2));
        assert!(
            matches!(&found, PeriodicOutcome::<f64>::OtherItinerary(orbit) if orbit.states[0][0] > 0.0),
            "{found:?}"
        );
        let found = periodic_orbit(&mut SquareRoot, &problem(false), held, &guess(-0.1, -0.2));
        let orbit: PeriodicOrbit<f64> = found.found().expect("x = 2p");
        assert!((orbit.states[0][0] + 0.4).abs() < 1e-14 && orbit.is_stable() == Ok(true));
    }

    #[test]
    fn a_fixed_point_of_no_map_is_not_found() {
        /// `x ↦ x + 1 + p²`: never fixed.
        struct Shift;
        impl SectionMap<f64> for Shift {
            fn image(&mut self, state: &[f64], parameters: &[f64]) -> Option<SectionStep<f64>> {
                Some(SectionStep {
                    offsets: vec![state[0] + 1.0 + parameters[0].powi(2)],
                    contacts: PassageSet::default(),
                    depth: 0.0,
                    extra_contacts: 0,
                })
            }
        }
        let found = periodic_orbit(&mut Shift, &problem(false), Held::Parameter, &guess(0.0, 0.5));
        let parted = |outcome: &PeriodicOutcome<f64>| {
            matches!(
                outcome,
                PeriodicOutcome::Singular { .. } | PeriodicOutcome::NotConverged { .. }
            )
        };
        assert!(parted(&found), "{found:?}");
        let held = Held::Coordinate(0);
        let found = periodic_orbit(&mut Shift, &problem(false), held, &guess(0.0, 0.5));
        assert!(parted(&found), "{found:?}");
    }
}
