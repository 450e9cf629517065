//! PseudoArclength of a grazing orbit in a second parameter: steps, points, and the special points
//! between them.

use super::curve_context::{CurveContext, TestedPoint, correct};
use super::grazing_curve::{CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, SpecialKind};
use super::grazing_orbit::Location;
use super::locate::locate;
use super::outcome::{OrbitError, Stop, settled};
use super::special::{corner_between, special_between};
use crate::model::Scene;

/// Continues the grazing orbit of a scene in a second parameter, `with`, from one value of it to
/// another.
///
/// The orbit is located at the scene's own parameters and followed to `from` first. Steps are of
/// pseudo-arclength, so the curve is followed round folds; points where a `xi_n` vanishes, a
/// parameter turns or multipliers change between real and complex are refined in double-double.
///
/// # Errors
///
/// [`OrbitError`] as [`locate`](super::locate), and [`OrbitError::SecondParameter`] for a second
/// parameter that does not exist or is already adjusted.
pub fn curve(
    scene: &Scene,
    with: usize,
    from: f64,
    to: f64,
    options: &CurveOptions,
) -> Result<CurveOutcome, OrbitError> {
    if with >= scene.model.parameters.len() || scene.grazing.solve_for.contains(&with) {
        return Err(OrbitError::SecondParameter { parameter: with });
    }
    let orbit = match locate(scene)? {
        Location::Located(orbit) => orbit,
        Location::NotLocated(reason) => return Ok(CurveOutcome::NotLocated(reason)),
    };
    let pass = |count| -> Result<PseudoArclength<'_>, OrbitError> {
        let context = CurveContext::new(scene, &orbit, with, count)?;
        Ok(PseudoArclength { context, options })
    };
    let here = scene.model.parameters[with].value.to_f64();
    let mut start = CurveContext::new(scene, &orbit, with, 0)?.start(&orbit);
    if here != from {
        // On the way to the start no condition is followed.
        let (lead, last) = pass(0)?.trace(&start, from)?;
        if lead.end != CurveEnd::Reached {
            return Ok(CurveOutcome::StartNotReached(lead));
        }
        start = last;
    }
    Ok(CurveOutcome::Traced(pass(options.xi_count)?.trace(&start, to)?.0))
}

/// One pass along a curve, with its options.
struct PseudoArclength<'a> {
    context: CurveContext<'a>,
    options: &'a CurveOptions,
}

/// Cosine of the largest turn of the tangent in one step.
const STRAIGHT: f64 = 0.98;

/// Largest departure of a condition from its linear extrapolation in one step, as a share of its
/// size nearby: a sinusoid's phase then advances by a third of a radian at most, and two zeros do
/// not fit between two points.
const CURVED: f64 = 0.1;

/// A condition below this share of the largest is not followed in steps of its own.
const FAINT: f64 = 1e-9;

/// Steps are not made smaller than this share of the largest step for the sake of the conditions.
const FINEST: f64 = 1e-3;

impl PseudoArclength<'_> {
    /// Follows the curve until the second parameter is `to`; also the last unknowns.
    fn trace(&self, start: &[f64], to: f64) -> Result<(GrazingCurve, Vec<f64>), OrbitError> {
        let mut curve = GrazingCurve {
            free: self.context.system.free().to_vec(),
            points: Vec::new(),
            special: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let mut unknowns = start.to_vec();
        if let Err(end) = settled(self.follow(&mut curve, &mut unknowns, to))? {
            curve.end = end;
        }
        Ok((curve, unknowns))
    }

    /// Adds points to a curve until it ends; nothing stops it after the most steps.
    fn follow(
        &self,
        curve: &mut GrazingCurve,
        unknowns: &mut Vec<f64>,
        to: f64,
    ) -> Result<(), Stop<CurveEnd>> {
        let last = unknowns.len() - 1;
        let from = unknowns[last];
        let mut along = vec![0.0; unknowns.len()];
        along[last] = if to < from { -1.0 } else { 1.0 };
        let mut here = self.context.at(unknowns.clone(), &along)?;
        curve.points.push(here.point.clone());
        if from == to {
            return Err(Stop::Ended(CurveEnd::Reached));
        }
        let mut before: Option<TestedPoint> = None;
        let mut ds = self.options.ds;
        for _ in 0..self.options.max_steps {
            let (mut next, taken) = self.step(before.as_ref(), &here, ds)?;
            ds = (taken * 1.3).min(self.options.ds_max);
            if (here.unknowns[last] - to) * (next.unknowns[last] - to) <= 0.0 {
                next = self.at_value(&here, &next, to)?.unwrap_or(next);
            }
            let special = special_between(&self.context, &here, &next)?;
            curve.special.extend(special);
            curve.points.push(next.point.clone());
            unknowns.clone_from(&next.unknowns);
            let (value, normal_acceleration) = (unknowns[last], next.point.normal_acceleration);
            if normal_acceleration <= 0.0 {
                return Err(Stop::Ended(CurveEnd::DegenerateGraze { normal_acceleration }));
            }
            if ((value - from) * 2.0 - (to - from)).abs() > 3.0 * (to - from).abs() {
                return Err(Stop::Ended(CurveEnd::LeftRange));
            }
            if value == to {
                return Err(Stop::Ended(CurveEnd::Reached));
            }
            before = Some(std::mem::replace(&mut here, next));
        }
        Ok(())
    }

    /// The next point and the step that led there.
    fn step(
        &self,
        before: Option<&TestedPoint>,
        here: &TestedPoint,
        mut ds: f64,
    ) -> Result<(TestedPoint, f64), Stop<CurveEnd>> {
        let mut end = CurveEnd::StepTooSmall { ds: self.options.ds_min };
        while ds >= self.options.ds_min {
            let predicted: Vec<f64> =
                here.unknowns.iter().zip(&here.tangent).map(|(u, t)| u + ds * t).collect();
            if let Some(found) = correct(&self.context.system, &predicted, &here.tangent)?
                && distance(&found, &predicted) < 0.3 * ds
            {
                match settled(self.context.at(found, &here.tangent))? {
                    Ok(next)
                        if dot(&next.tangent, &here.tangent) > STRAIGHT
                            && (ds <= FINEST * self.options.ds_max
                                || before.is_none_or(|before| resolved(before, here, &next))) =>
                    {
                        match corner_between(&self.context, here, &next)? {
                            None => return Ok((next, ds)),
                            Some(corner) => end = corner,
                        }
                    }
                    Ok(_) => {}
                    Err(reason) => end = reason,
                }
            }
            ds *= 0.5;
        }
        Err(Stop::Ended(end))
    }

    /// The point between two where the second parameter has a value; none where no orbit is found.
    /// The curve ends where its orbit has a corner.
    fn at_value(
        &self,
        here: &TestedPoint,
        next: &TestedPoint,
        to: f64,
    ) -> Result<Option<TestedPoint>, Stop<CurveEnd>> {
        let last = here.unknowns.len() - 1;
        let (a, b) = (here.unknowns[last], next.unknowns[last]);
        let share = if a == b { 1.0 } else { (to - a) / (b - a) };
        let ends = here.unknowns.iter().zip(&next.unknowns);
        let mut origin: Vec<f64> = ends.map(|(a, b)| a + share * (b - a)).collect();
        origin[last] = to;
        let mut normal = vec![0.0; last + 1];
        normal[last] = 1.0;
        let Some(mut found) = correct(&self.context.system, &origin, &normal)? else {
            return Ok(None);
        };
        found[last] = to;
        match self.context.at(found, &here.tangent) {
            Err(Stop::Ended(end)) if !matches!(end, CurveEnd::Corner { .. }) => Ok(None),
            there => there.map(Some),
        }
    }
}

/// Whether the conditions bend little enough over two steps that none of them vanishes twice in the
/// second.
fn resolved(before: &TestedPoint, here: &TestedPoint, next: &TestedPoint) -> bool {
    let grown =
        distance(&next.unknowns, &here.unknowns) / distance(&here.unknowns, &before.unknowns);
    let values = |point: &TestedPoint| {
        let conditions = point.tests.iter();
        let of = |(kind, value): &(SpecialKind, f64)| match kind {
            SpecialKind::Codimension2 { .. } => Some(*value),
            _ => None,
        };
        conditions.filter_map(of).collect::<Vec<f64>>()
    };
    let (a, b, c) = (values(before), values(here), values(next));
    let largest = b.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    a.iter().zip(&b).zip(&c).all(|((a, b), c)| {
        let size = a.abs().max(b.abs()).max(c.abs());
        let extrapolated = b + (b - a) * grown;
        size < FAINT * largest || (c - extrapolated).abs() <= CURVED * size
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
