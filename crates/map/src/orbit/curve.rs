//! Pseudo-arclength continuation of a grazing orbit in a second parameter: steps, points, and the
//! special points between them, which are zeros of test functions along the curve.

use std::array::from_fn;

use nalgebra::DMatrix;

use super::arclength::{CORRECTION, GROWTH, STRAIGHT, bordered, distance, dot};
use super::curve_context::{CurveContext, Distance, NOISE, TestValue, TestedPoint};
use super::effort::Effort;
use super::grazing_curve::{
    CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, SpecialKind, SpecialPoint,
};
use super::grazing_orbit::{GrazingOrbit, Location};
use super::locate::locate;
use super::newton::{Equations, refine};
use super::outcome::{OrbitError, Stop, settled};
use super::sampled::{SAMPLES, Zeros, places, zeros};
use crate::flow::Field;
use crate::model::Scene;
use crate::numeric::{Bracket, Real, converted};

/// Continues the grazing orbit of a scene in a second parameter, `with`, from the value `from` to
/// the value `to`.
///
/// The orbit is located at the scene's own parameters and first followed to `from`. Steps are of
/// pseudo-arclength, so the curve is followed round folds. Points at which a `xi_n` vanishes, a
/// parameter turns or multipliers change between real and complex are refined in double-double.
///
/// # Errors
///
/// [`OrbitError`] as from [`locate`], and [`OrbitError::SecondParameter`] for a second parameter
/// that does not exist or is already adjusted.
pub fn curve(
    scene: &Scene,
    with: usize,
    from: f64,
    to: f64,
    options: &CurveOptions,
) -> Result<CurveOutcome, OrbitError> {
    watched_curve(scene, with, [from, to], options, &|_| {})
}

/// Computes [`curve`] between two values of the second parameter and reports the share done, from 0
/// to 1: of the range or of the work limit, whichever is larger.
///
/// # Errors
///
/// As [`curve`].
pub fn watched_curve(
    scene: &Scene,
    with: usize,
    [from, to]: [f64; 2],
    options: &CurveOptions,
    watch: &dyn Fn(f64),
) -> Result<CurveOutcome, OrbitError> {
    if with >= scene.model.parameters.len() || scene.grazing.solve_for.contains(&with) {
        return Err(OrbitError::SecondParameter { parameter: with });
    }
    let orbit = match locate(scene)? {
        Location::Located(orbit) => orbit,
        Location::NotLocated(reason) => return Ok(CurveOutcome::NotLocated(reason)),
    };
    let size = from.abs().max(to.abs());
    let effort = Effort::new(&Field::free(&scene.model, &[])).within(options.most_products);
    let pass = |count| -> Result<PseudoArclength<'_>, OrbitError> {
        let context = CurveContext::new(scene, &orbit, (with, size), count, &effort)?;
        Ok(PseudoArclength { context, options, effort: &effort, watch })
    };
    let here = scene.model.parameters[with].value.to_f64();
    let lead = pass(0)?;
    let mut start = lead.context.start(&orbit);
    if here != from {
        // No condition is followed on the way to the start.
        let (lead, last) = lead.trace(&start, from)?;
        if lead.end != CurveEnd::Reached {
            return Ok(CurveOutcome::StartNotReached(lead));
        }
        start = last;
    }
    Ok(CurveOutcome::Traced(pass(options.xi_count)?.trace(&start, to)?.0))
}

/// Curve of a grazing orbit from its own value of the second parameter towards another. The curve
/// ends where no point beyond can be nearer than the nearest one known; stationary points of the
/// distance are special points.
pub(super) fn curve_towards(
    (scene, orbit): (&Scene, &GrazingOrbit),
    (with, to): (usize, f64),
    distance: Distance,
    effort: &Effort,
    watch: &dyn Fn(f64),
) -> Result<GrazingCurve, OrbitError> {
    let from = orbit.parameters()[with].to_f64();
    let size = from.abs().max(to.abs());
    let context = CurveContext::new(scene, orbit, (with, size), 0, effort)?.towards(distance);
    let start = context.start(orbit);
    let pass = PseudoArclength { context, options: &CurveOptions::default(), effort, watch };
    Ok(pass.trace(&start, to)?.0)
}

/// One pass along a curve, with its options.
struct PseudoArclength<'a> {
    context: CurveContext<'a>,
    options: &'a CurveOptions,
    effort: &'a Effort,
    /// Called with the share done.
    watch: &'a dyn Fn(f64),
}

/// A step: its points and their places in `(0, 1]`.
struct CurveStep {
    points: Vec<(f64, TestedPoint)>,
    resolution: Resolution,
}

/// Information on the zeros of all functions along a step, from their samples.
#[derive(Default)]
struct Resolution {
    /// Places between the sample places that separate the zeros.
    parting: Vec<f64>,
    /// Kinds of special points of which more may exist, each with its place; `None` is the whole
    /// step.
    unresolved: Vec<(SpecialKind, Option<f64>)>,
    /// Whether a shorter step would resolve more.
    too_long: bool,
}

/// Length of a stretch with a work limit of its own, relative to the range, and that limit as a
/// fraction `1/STRETCH_SHARE` of the whole.
const STRETCH: f64 = 0.01;
const STRETCH_SHARE: u64 = 15;

/// Smallest step, relative to the range, if the range is shorter than the steps requested.
const SHORTEST: f64 = 1e-6;

/// The largest step grows with the largest scaled unknown beyond this size, which no unknown
/// exceeds at the beginning of a curve.
const FAR: f64 = 32.0;

impl PseudoArclength<'_> {
    /// Follows the curve until the second parameter is `to`; returns the curve and the last
    /// unknowns.
    fn trace(&self, start: &[f64], to: f64) -> Result<(GrazingCurve, Vec<f64>), OrbitError> {
        let mut curve = GrazingCurve {
            free: self.context.system().free.clone(),
            points: Vec::new(),
            special: Vec::new(),
            unresolved: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let mut unknowns = start.to_vec();
        let followed = self.follow(&mut curve, &mut unknowns, self.context.in_unit(to));
        curve.end = match settled(followed) {
            Ok(Ok(())) => CurveEnd::StepLimit,
            Ok(Err(CurveEnd::Reached)) => CurveEnd::Reached,
            // A failure that the work limit caused is no reason of its own.
            Ok(Err(_)) | Err(OrbitError::SearchTooLong) if self.effort.is_spent() => {
                self.work_limit(&curve)
            }
            ended => ended?.err().unwrap_or(CurveEnd::StepLimit),
        };
        Ok((curve, unknowns))
    }

    /// The end of a curve that exceeded the work limit.
    fn work_limit(&self, curve: &GrazingCurve) -> CurveEnd {
        let period = curve.points.last().map_or(f64::NAN, |point| point.period);
        CurveEnd::WorkLimit { period, steps: self.effort.steps(period) }
    }

    /// Adds points to a curve until it ends; returns normally after the largest number of steps.
    fn follow(
        &self,
        curve: &mut GrazingCurve,
        unknowns: &mut Vec<f64>,
        to: f64,
    ) -> Result<(), Stop<CurveEnd>> {
        let last = unknowns.len() - 1;
        let (from, range) = (unknowns[last], (to - unknowns[last]).abs());
        let mut along = vec![0.0; unknowns.len()];
        along[last] = if to < from { -1.0 } else { 1.0 };
        let mut here = self.context.at(unknowns.clone(), &along)?;
        curve.points.push(here.point.clone());
        if from == to {
            return Err(Stop::Ended(CurveEnd::Reached));
        }
        let ds_max = self.options.ds_max.min(range);
        let ds_min = self.options.ds_min.min(range * SHORTEST);
        let mut ds = self.options.ds.min(ds_max);
        // Arclength over the range, and work, since the last stretch ended.
        let (mut covered, mut spent) = (0.0, self.effort.spent());
        for _ in 0..self.options.max_steps {
            let (step, taken) = self.step(&here, (ds_min, ds), to)?;
            let largest = here.unknowns.iter().fold(FAR, |most, value| most.max(value.abs()));
            ds = (taken * GROWTH).min(ds_max * (largest / FAR));
            let mut before = 0.0;
            for (place, mut next) in step.points {
                if (here.unknowns[last] - to) * (next.unknowns[last] - to) <= 0.0 {
                    next = self.at_value(&here, &next, to)?.unwrap_or(next);
                }
                let is_first = curve.points.len() == 1;
                curve.special.extend(special_between(&self.context, &here, &next, is_first)?);
                curve.points.push(next.point.clone());
                unknowns.clone_from(&next.unknowns);
                for &(kind, at) in &step.resolution.unresolved {
                    if at.is_none_or(|at| before < at && at <= place) {
                        let ends = [&here, &next].map(|end| end.point.parameters.as_slice());
                        curve.add_unresolved(kind, ends);
                    }
                }
                let (value, normal_acceleration) = (unknowns[last], next.point.normal_acceleration);
                if normal_acceleration <= 0.0 {
                    return Err(Stop::Ended(CurveEnd::DegenerateGraze { normal_acceleration }));
                }
                if ((value - from) * 2.0 - (to - from)).abs() > 3.0 * range {
                    return Err(Stop::Ended(CurveEnd::LeftRange));
                }
                if value == to || self.context.is_beyond(&curve.points) {
                    return Err(Stop::Ended(CurveEnd::Reached));
                }
                (here, before) = (next, place);
            }
            covered += taken / range;
            if covered > STRETCH {
                (covered, spent) = (0.0, self.effort.spent());
            } else if self.effort.spent() - spent > self.options.most_products / STRETCH_SHARE {
                return Err(Stop::Ended(self.work_limit(curve)));
            }
            let ahead = ((here.unknowns[last] - from) / (to - from)).clamp(0.0, 1.0);
            (self.watch)(ahead.max(self.effort.share()));
        }
        Ok(())
    }

    /// The next step and its length. If no step is short enough to resolve everything, the longest
    /// one for which Newton's method converges.
    fn step(
        &self,
        here: &TestedPoint,
        (ds_min, mut ds): (f64, f64),
        to: f64,
    ) -> Result<(CurveStep, f64), Stop<CurveEnd>> {
        let mut end = CurveEnd::StepTooSmall { ds: ds_min };
        let mut longest = None;
        while ds >= ds_min {
            match settled(self.try_step(here, ds, to))? {
                Ok(Some(step)) if step.resolution.too_long => {
                    longest = longest.or(Some((step, ds)))
                }
                Ok(Some(step)) => return Ok((step, ds)),
                Ok(None) => {}
                Err(reason) => end = reason,
            }
            ds *= 0.5;
        }
        longest.ok_or(Stop::Ended(end))
    }

    /// A step of a given length; `None` if the curve cannot be followed that far.
    fn try_step(
        &self,
        here: &TestedPoint,
        ds: f64,
        to: f64,
    ) -> Result<Option<CurveStep>, Stop<CurveEnd>> {
        let straight = |point: &TestedPoint| dot(&point.tangent, &here.tangent) > STRAIGHT;
        let predicted: Vec<f64> =
            here.unknowns.iter().zip(&here.tangent).map(|(u, t)| u + ds * t).collect();
        let found = self.context.correct(&predicted, &predicted, &here.tangent)?;
        let Some(found) = found.filter(|found| distance(found, &predicted) < CORRECTION * ds)
        else {
            return Ok(None);
        };
        let next = self.context.at(found, &here.tangent)?;
        if !straight(&next) {
            return Ok(None);
        }
        let chord = Chord::new(here, &next);
        let mut points = Vec::new();
        for place in places() {
            points.push((
                place,
                match place {
                    0.0 => here.clone(),
                    1.0 => next.clone(),
                    _ => match chord.point(&self.context, place)? {
                        Some(point) if straight(&point) => point,
                        _ => return Ok(None),
                    },
                },
            ));
        }
        let resolution = self.resolution(&points, to);
        for &place in &resolution.parting {
            match chord.point(&self.context, place)? {
                Some(point) => points.push((place, point)),
                None => return Ok(None),
            }
        }
        points.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        for pair in points.windows(2) {
            if let Some(corner) = corner_between(&self.context, &pair[0].1, &pair[1].1)? {
                return Err(Stop::Ended(corner));
            }
        }
        points.remove(0);
        Ok(Some(CurveStep { points, resolution }))
    }

    /// Separating places and unresolved functions of a step, from the samples at its first points.
    fn resolution(&self, points: &[(f64, TestedPoint)], to: f64) -> Resolution {
        let mut found = Resolution::default();
        let mut look = |samples: [f64; SAMPLES], noise: f64, kind: Option<SpecialKind>| {
            let places = match zeros(&samples, noise) {
                Zeros::Parted(places) => return found.parting.extend(places),
                Zeros::Rounding(places) if !places.is_empty() => {
                    places.into_iter().map(Some).collect()
                }
                // A parameter that does not vary has no fold.
                Zeros::Rounding(_) if matches!(kind, Some(SpecialKind::Fold { .. })) => Vec::new(),
                Zeros::Rounding(_) => vec![None],
                Zeros::TooLong => {
                    found.too_long = true;
                    vec![None]
                }
            };
            found.unresolved.extend(places.into_iter().flat_map(|at| kind.map(|kind| (kind, at))));
        };
        let of = |value: &dyn Fn(&TestedPoint) -> f64| from_fn(|place| value(&points[place].1));
        let first = &points[0].1;
        for (number, test) in first.tests.iter().enumerate() {
            let sizes = points.iter().map(|(_, point)| point.tests[number].size);
            let size = sizes.fold(0.0, f64::max);
            look(of(&|point| point.tests[number].value), NOISE * size, Some(test.kind));
        }
        for number in 0..first.corners.len() {
            look(of(&|point| point.corners[number]), 0.0, None);
        }
        let last = first.unknowns.len() - 1;
        look(of(&|point| point.unknowns[last] - to), NOISE * to.abs(), None);
        found
    }

    /// The point between two others at which the second parameter is `to`; `None` if no orbit is
    /// found. If the orbit has a corner there, the curve ends.
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
        let Some(mut found) = self.context.correct(&origin, &origin, &normal)? else {
            return Ok(None);
        };
        found[last] = to;
        match self.context.at(found, &here.tangent) {
            Err(Stop::Ended(end)) if !matches!(end, CurveEnd::Corner { .. }) => Ok(None),
            there => there.map(Some),
        }
    }
}

/// A corner's argument has passed zero if it is below this, relative to its values at the ends.
const VANISHED: f64 = 1e-6;
/// The search for a zero ends at this length along the chord, or at this value of the function
/// relative to its values at the ends.
const ENOUGH: f64 = 1e-14;
/// Step of a difference quotient, relative to the unknown.
const DIFFERENCE: f64 = 1e-7;
/// Largest residual of a point refined in double-double.
const REFINED: f64 = 1e-22;

/// Special points after `here` and up to `next`, in order along the curve. A special point at
/// `here` itself is included only at the first point of the curve.
fn special_between(
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

/// End of a curve at the first corner that an argument at a graze passes between two points.
fn corner_between(
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
            // The sign of an argument may also change by a jump, when the phase is reduced.
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

    /// Unknowns of the curve on the plane across a share of the chord; Newton's method starts from
    /// the cubic with the tangents at the ends.
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

    /// Point of the curve on the plane across a share of the chord; `None` if Newton's method
    /// fails.
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

    /// Zero of a function with given values at the ends, as a share of the chord, with its
    /// unknowns. Every trial is corrected onto the curve; the trial with the smallest value is
    /// returned.
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

/// A special point to the roundoff of double-double: the zero itself for a condition; for other
/// functions, the point of the curve on the plane through `origin` with normal `normal`.
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
    let unknowns = root.map_or_else(|_| converted(unknowns), |root| root.unknowns);
    Ok(Some(SpecialPoint { kind, parameters: context.parameters(&unknowns), point }))
}

/// The extended system with one condition, divided by `size`, required to vanish.
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
    /// The condition's row is a difference quotient: a correction needs few digits.
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
