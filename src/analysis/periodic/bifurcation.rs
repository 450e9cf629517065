//! Folds and flips of a branch: zeros of `det(J − I)` and `det(J + I)` between two of its orbits.

use super::branch::line;
use super::newton::periodic_orbit;
use super::orbit::PeriodicOrbit;
use super::problem::{Held, PeriodicProblem};
use super::section_map::SectionMap;
use crate::numeric::{Bracket, Real};

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
    /// The multiplier.
    pub fn multiplier(self) -> f64 {
        match self {
            Self::Fold => 1.0,
            Self::Flip => -1.0,
        }
    }
}

/// The bifurcation between two orbits of a branch, which differ in a coordinate of their first points; `None` if `det(J ∓ I)`
/// has the same sign at both, or the branch is lost in between.
///
/// A safeguarded search (no derivative of a determinant is needed) over the coordinate, the orbit solved for at each trial from its
/// neighbours; the depth of the graze is never the unknown of a Newton step, in which it would be a root.
pub fn bifurcation<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    kind: BifurcationKind,
    coordinate: usize,
    ends: [&PeriodicOrbit<S>; 2],
) -> Option<Bifurcation<S>> {
    let test = |orbit: &PeriodicOrbit<S>| orbit.characteristic(kind.multiplier()).ok();
    let place = |orbit: &PeriodicOrbit<S>| orbit.states[0][coordinate];
    let (lower, upper) = (place(ends[0]), place(ends[1]));
    let values = (test(ends[0])?, test(ends[1])?);
    let bracket = Bracket::new(lower, upper, values.0, values.1).ok()?;
    let mut known = [ends[0].clone(), ends[1].clone()];
    let tolerance = (upper - lower).abs() * S::from_f64(S::ROUNDOFF.powf(0.75));
    let root = bracket.itp(values, tolerance, |value| {
        match at(map, problem, coordinate, &known, value) {
            Some(orbit) => {
                let value = test(&orbit).unwrap_or(S::from_f64(f64::NAN));
                known = [std::mem::replace(&mut known[1], orbit.clone()), orbit];
                value
            }
            None => S::from_f64(f64::NAN),
        }
    });
    let orbit = at(map, problem, coordinate, &known, root.root()?)?;
    Some(Bifurcation { kind, orbit })
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
