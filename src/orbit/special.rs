//! Special points between two points of a grazing curve: zeros of functions along it.

use nalgebra::DMatrix;

use super::curve_context::{CurveContext, TestedPoint, bordered, correct, correct_dd};
use super::grazing_curve::{CurveEnd, SpecialKind, SpecialPoint};
use super::newton::{Equations, Solve, refine};
use super::outcome::{OrbitError, settled};
use crate::numeric::{Bracket, Dd, Real};

/// An argument of this size, relative to those it lies between, has passed 0.
const VANISHED: f64 = 1e-6;
/// Length along the chord, and value of the function, at which the search for a zero ends.
const ENOUGH: f64 = 1e-14;
/// Step of a difference quotient, relative to the unknown.
const DIFFERENCE: f64 = 1e-7;
/// Largest residual of a point refined in double-double.
const REFINED: f64 = 1e-22;

/// Special points between two points, in order along the curve.
pub(super) fn special_between(
    context: &CurveContext<'_>,
    here: &TestedPoint,
    next: &TestedPoint,
) -> Result<Vec<SpecialPoint>, OrbitError> {
    let mut found = Vec::new();
    for (index, (&(kind, a), &(_, b))) in here.tests.iter().zip(&next.tests).enumerate() {
        let value = |unknowns: &[f64]| {
            let point = settled(context.at(unknowns.to_vec(), &here.tangent))?;
            Ok(point.ok().map(|point| point.tests[index].1))
        };
        if a * b < 0.0
            && let Some((share, unknowns)) = Chord::new(here, next).zero(context, [a, b], value)?
            && let Some(special) = refined(context, here, next, kind, share, &unknowns)?
        {
            found.push((share, special));
        }
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(found.into_iter().map(|(_, special)| special).collect())
}

/// The end of a curve at the first corner that an argument at a graze passes between two points.
pub(super) fn corner_between(
    context: &CurveContext<'_>,
    here: &TestedPoint,
    next: &TestedPoint,
) -> Result<Option<CurveEnd>, OrbitError> {
    let mut first: Option<(f64, CurveEnd)> = None;
    for (index, (&a, &b)) in here.corners.iter().zip(&next.corners).enumerate() {
        let near = |unknowns: &[f64]| context.corner_near(unknowns, index);
        let value = |unknowns: &[f64]| Ok(near(unknowns)?.map(|(value, _)| value));
        if a * b < 0.0
            && let Some((share, unknowns)) = Chord::new(here, next).zero(context, [a, b], value)?
            && let Some((value, end)) = near(&unknowns)?
            // An argument may change its sign by a jump, where the phase begins anew.
            && value.abs() <= ENOUGH.max(VANISHED * a.abs().max(b.abs()))
            && first.as_ref().is_none_or(|(before, _)| share < *before)
        {
            first = Some((share, end));
        }
    }
    Ok(first.map(|(_, end)| end))
}

/// The chord between two points, with planes across it.
struct Chord<'a> {
    here: &'a TestedPoint,
    next: &'a TestedPoint,
    length: f64,
    normal: Vec<f64>,
}

impl<'a> Chord<'a> {
    fn new(here: &'a TestedPoint, next: &'a TestedPoint) -> Self {
        let ends = next.unknowns.iter().zip(&here.unknowns);
        let chord: Vec<f64> = ends.map(|(b, a)| b - a).collect();
        let length = chord.iter().map(|value| value * value).sum::<f64>().sqrt();
        Self { here, next, length, normal: chord.iter().map(|value| value / length).collect() }
    }

    fn origin(&self, share: f64) -> Vec<f64> {
        let ends = self.here.unknowns.iter().zip(&self.next.unknowns);
        ends.map(|(a, b)| a + share * (b - a)).collect()
    }

    /// The zero of one function of which the values at the ends are given, in the share of the
    /// chord, every trial corrected onto the curve: the trial nearest to it.
    fn zero(
        &self,
        context: &CurveContext<'_>,
        ends: [f64; 2],
        value: impl Fn(&[f64]) -> Result<Option<f64>, OrbitError>,
    ) -> Result<Option<(f64, Vec<f64>)>, OrbitError> {
        let Ok(bracket) = Bracket::new(0.0, 1.0, ends[0], ends[1]) else {
            return Ok(None);
        };
        let trial = |share: f64| -> Result<Option<(f64, Vec<f64>)>, OrbitError> {
            let origin = self.origin(share);
            let Some(found) = correct(&context.system, &origin, &self.normal)? else {
                return Ok(None);
            };
            Ok(value(&found)?.map(|value| (value, found)))
        };
        let mut best: Option<(f64, f64, Vec<f64>)> = None;
        let mut failure = None;
        let tolerance = 0.5 * ENOUGH / self.length;
        bracket.itp((ends[0], ends[1]), tolerance, |share| {
            let (value, unknowns) = match trial(share) {
                Ok(Some(found)) => found,
                Ok(None) => return f64::NAN,
                Err(error) => {
                    failure = Some(error);
                    return f64::NAN;
                }
            };
            if best.as_ref().is_none_or(|(least, ..)| value.abs() < *least) {
                best = Some((value.abs(), share, unknowns));
            }
            if value.abs() < ENOUGH { 0.0 } else { value }
        });
        match failure {
            Some(error) => Err(error),
            None => Ok(best.map(|(_, share, unknowns)| (share, unknowns))),
        }
    }
}

/// A special point to the roundoff of double-double: a condition's zero itself, of other functions
/// the point of the curve.
fn refined(
    context: &CurveContext<'_>,
    here: &TestedPoint,
    next: &TestedPoint,
    kind: SpecialKind,
    share: f64,
    unknowns: &[f64],
) -> Result<Option<SpecialPoint>, OrbitError> {
    let Ok(described) = settled(context.describe(unknowns))? else {
        return Ok(None);
    };
    let point = described.point;
    let root = match kind {
        SpecialKind::Codimension2 { n, from, to } => {
            let zero = Zero { context, from, to, n };
            refine(&zero, unknowns, REFINED)?
        }
        _ => {
            let chord = Chord::new(here, next);
            let origin = chord.origin(share);
            correct_dd(&context.system, unknowns, &origin, &chord.normal)?
        }
    };
    let unknowns = match root {
        Solve::Root(root) => root.unknowns,
        Solve::Failed(_) => unknowns.iter().map(|&value| Dd::from(value)).collect(),
    };
    Ok(Some(SpecialPoint { kind, parameters: context.system.parameters(&unknowns), point }))
}

/// The extended system with one condition required to vanish.
struct Zero<'a> {
    context: &'a CurveContext<'a>,
    from: usize,
    to: usize,
    n: usize,
}

impl Zero<'_> {
    fn condition<S: Real>(&self, unknowns: &[S]) -> Result<S, OrbitError> {
        self.context.condition(unknowns, self.from, self.to, self.n)
    }
}

impl Equations for Zero<'_> {
    /// The condition's row by differences: a correction needs few digits.
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.context.system.differentiate(unknowns)?;
        let value = self.condition(unknowns)?;
        residual.push(value);
        let slope = |position: usize| {
            let mut moved = unknowns.to_vec();
            let step = DIFFERENCE * moved[position].abs().max(1.0);
            moved[position] += step;
            Ok((self.condition(&moved)? - value) / step)
        };
        let row: Result<Vec<f64>, OrbitError> = (0..unknowns.len()).map(slope).collect();
        Ok((residual, bordered(&jacobian, &row?)))
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let mut residual = self.context.system.evaluate(unknowns)?;
        residual.push(self.condition(unknowns)?);
        Ok(residual)
    }
}
