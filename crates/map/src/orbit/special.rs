//! Special points between two points of a grazing curve: zeros of functions along it.

use nalgebra::DMatrix;

use super::curve_context::{CurveContext, TestValue, TestedPoint, bordered};
use super::grazing_curve::{CurveEnd, SpecialKind, SpecialPoint};
use super::newton::{Equations, Solve, refine};
use super::outcome::{OrbitError, Stop, settled};
use crate::numeric::{Bracket, Dd, Real};

/// An argument of this size, relative to those it lies between, has passed 0.
const VANISHED: f64 = 1e-6;
/// Length along the chord, and value of the function relative to those it lies between, at which
/// the search for a zero ends.
const ENOUGH: f64 = 1e-14;
/// Step of a difference quotient, relative to the unknown.
const DIFFERENCE: f64 = 1e-7;
/// Largest residual of a point refined in double-double.
const REFINED: f64 = 1e-22;

/// Special points after a point, up to another, in order along the curve; at the first point of the
/// curve, too, where nothing lies before it.
pub(super) fn special_between(
    context: &CurveContext<'_>,
    here: &TestedPoint,
    next: &TestedPoint,
    is_first: bool,
) -> Result<Vec<SpecialPoint>, OrbitError> {
    let mut found = Vec::new();
    let chord = Chord::new(here, next);
    for (index, (test, after)) in here.tests.iter().zip(&next.tests).enumerate() {
        let (a, b) = (test.beyond_rounding(), after.beyond_rounding());
        let value = |unknowns: &[f64]| {
            let point = settled(context.at(unknowns.to_vec(), &here.tangent))?;
            Ok(point.ok().map(|point| point.tests[index].value))
        };
        let zero = if a * b < 0.0 {
            chord.zero(context, [a, b], value)?
        } else if a != 0.0 && b == 0.0 {
            Some((1.0, next.unknowns.clone()))
        } else if is_first && a == 0.0 && b != 0.0 {
            Some((0.0, here.unknowns.clone()))
        } else {
            None
        };
        let Some((share, unknowns)) = zero else { continue };
        let origin = chord.origin(share);
        if let Some(special) = refined(context, test, &unknowns, [&origin, &chord.normal])? {
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
            && value.abs() <= VANISHED * a.abs().max(b.abs())
            && first.as_ref().is_none_or(|(before, _)| share < *before)
        {
            first = Some((share, end));
        }
    }
    Ok(first.map(|(_, end)| end))
}

/// The chord between two points, with planes across it.
pub(super) struct Chord<'a> {
    here: &'a TestedPoint,
    next: &'a TestedPoint,
    length: f64,
    normal: Vec<f64>,
}

impl<'a> Chord<'a> {
    pub(super) fn new(here: &'a TestedPoint, next: &'a TestedPoint) -> Self {
        let ends = next.unknowns.iter().zip(&here.unknowns);
        let chord: Vec<f64> = ends.map(|(b, a)| b - a).collect();
        let length = chord.iter().map(|value| value * value).sum::<f64>().sqrt();
        Self { here, next, length, normal: chord.iter().map(|value| value / length).collect() }
    }

    fn origin(&self, share: f64) -> Vec<f64> {
        let ends = self.here.unknowns.iter().zip(&self.next.unknowns);
        ends.map(|(a, b)| a + share * (b - a)).collect()
    }

    /// The unknowns of the curve across a share of the chord; Newton's method starts from the cubic
    /// with the tangents at the ends.
    fn unknowns(
        &self,
        context: &CurveContext<'_>,
        share: f64,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let rest = 1.0 - share;
        let origin = self.origin(share);
        let tangents = self.here.tangent.iter().zip(&self.next.tangent);
        let bend = tangents.zip(&self.normal).map(|((a, b), normal)| {
            self.length * share * rest * (rest * (a - normal) - share * (b - normal))
        });
        let start: Vec<f64> = origin.iter().zip(bend).map(|(origin, bend)| origin + bend).collect();
        context.correct(&start, &origin, &self.normal)
    }

    /// The point of the curve across a share of the chord; `None` where Newton's method finds none.
    pub(super) fn point(
        &self,
        context: &CurveContext<'_>,
        share: f64,
    ) -> Result<Option<TestedPoint>, Stop<CurveEnd>> {
        match self.unknowns(context, share)? {
            Some(unknowns) => context.at(unknowns, &self.here.tangent).map(Some),
            None => Ok(None),
        }
    }

    /// The zero of one function of which the values at the ends are given, in the share of the
    /// chord, every trial corrected onto the curve: the trial nearest to it.
    fn zero(
        &self,
        context: &CurveContext<'_>,
        ends: [f64; 2],
        value: impl Fn(&[f64]) -> Result<Option<f64>, OrbitError>,
    ) -> Result<Option<(f64, Vec<f64>)>, OrbitError> {
        let largest = ends[0].abs().max(ends[1].abs());
        let Ok(bracket) = Bracket::new(0.0, 1.0, ends[0], ends[1]) else {
            return Ok(None);
        };
        let trial = |share: f64| -> Result<Option<(f64, Vec<f64>)>, OrbitError> {
            let Some(found) = self.unknowns(context, share)? else {
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
            if value.abs() < ENOUGH * largest { 0.0 } else { value }
        });
        match failure {
            Some(error) => Err(error),
            None => Ok(best.map(|(_, share, unknowns)| (share, unknowns))),
        }
    }
}

/// A special point to the roundoff of double-double: a condition's zero itself, of other functions
/// the point of the curve on the plane through `origin` across `normal`.
fn refined(
    context: &CurveContext<'_>,
    &TestValue { kind, size, .. }: &TestValue,
    unknowns: &[f64],
    [origin, normal]: [&[f64]; 2],
) -> Result<Option<SpecialPoint>, OrbitError> {
    let Ok(described) = settled(context.describe(unknowns))? else {
        return Ok(None);
    };
    let point = described.point;
    let root = match kind {
        SpecialKind::Codimension2 { n, from, to } => {
            refine(&Zero { context, from, to, n, size }, unknowns, REFINED)?
        }
        _ => context.correct_dd(unknowns, origin, normal)?,
    };
    let unknowns = match root {
        Solve::Root(root) => root.unknowns,
        Solve::Failed(_) => unknowns.iter().map(|&value| Dd::from(value)).collect(),
    };
    Ok(Some(SpecialPoint { kind, parameters: context.parameters(&unknowns), point }))
}

/// The extended system with one condition, relative to a size, required to vanish.
struct Zero<'a> {
    context: &'a CurveContext<'a>,
    from: usize,
    to: usize,
    n: usize,
    size: f64,
}

impl Zero<'_> {
    fn condition<S: Real>(&self, unknowns: &[S]) -> Result<S, OrbitError> {
        let value = self.context.condition(unknowns, self.from, self.to, self.n)?;
        Ok(value / S::from_f64(self.size))
    }
}

impl Equations for Zero<'_> {
    /// The condition's row by differences: a correction needs few digits.
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.context.equations().linearised(unknowns)?;
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
        let mut residual = self.context.equations().residual(unknowns)?;
        residual.push(self.condition(unknowns)?);
        Ok(residual)
    }
}
