//! Grazing orbits continued in a second parameter: the equations of the curve, what ends it, and
//! its special points, which are zeros of test functions.

use nalgebra::{DMatrix, DVector};

use super::curve_context::{CurveContext, Described, Distance, KindOfTest, NOISE};
use super::effort::Effort;
use super::grazing_curve::{
    CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, SpecialKind, SpecialPoint,
};
use super::grazing_orbit::{GrazingOrbit, Location};
use super::locate::locate;
use super::newton::{Equations, refine};
use super::outcome::{OrbitError, Stop};
use crate::continuation::{
    ContinuationEnd, ContinuationPoint, Curve, CurveEquations, Linearised, Solution, StepControl,
    TestValue, apart, bordered, by_chords, corrected, follow, largest, unit_vector, zero_on_chord,
};
use crate::flow::Field;
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};

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
    let pass = |count| -> Result<CurveOfGrazes<'_>, OrbitError> {
        let context = CurveContext::new(scene, &orbit, (with, size), count, &effort)?;
        Ok(CurveOfGrazes::new(context, (options, &effort), watch))
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
    let options = CurveOptions::default();
    let pass = CurveOfGrazes::new(context, (&options, effort), watch);
    Ok(pass.trace(&start, to)?.0)
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

/// A corner's argument has passed zero if it is below this, relative to its values at the ends.
const VANISHED: f64 = 1e-6;
/// Distance of two points that are one: special points of several kinds may lie at one place.
const SAME_POINT: f64 = 1e-8;
/// Step of a difference quotient, relative to the unknown.
const DIFFERENCE: f64 = 1e-7;
/// Largest residual of a point refined in double-double.
const REFINED: f64 = 1e-22;

/// Point of a grazing curve; it has its orbit where it is complete.
type PointOfGrazes = ContinuationPoint<f64, Option<Box<Described>>>;
type FollowedCurve = Curve<f64, Option<Box<Described>>>;

/// Curve of grazing orbits, followed once from a value of the second parameter to another.
struct CurveOfGrazes<'a> {
    context: CurveContext<'a>,
    options: &'a CurveOptions,
    effort: &'a Effort,
    /// Called with the share done.
    watch: &'a dyn Fn(f64),
    /// First and last value of the second parameter, scaled.
    ends: [f64; 2],
    /// Form of the equations by which the last solution was found.
    matching: usize,
    /// Reason why the curve could not be followed, or failure.
    stop: Option<Stop<CurveEnd>>,
    /// Arclength over the range, and work, since the last stretch ended.
    covered: f64,
    spent: u64,
}

impl<'a> CurveOfGrazes<'a> {
    fn new(
        context: CurveContext<'a>,
        (options, effort): (&'a CurveOptions, &'a Effort),
        watch: &'a dyn Fn(f64),
    ) -> Self {
        Self {
            context,
            options,
            effort,
            watch,
            ends: [0.0; 2],
            matching: 0,
            stop: None,
            covered: 0.0,
            spent: effort.spent(),
        }
    }

    /// Follows the curve until the second parameter is `to`; returns the curve and the last
    /// unknowns.
    fn trace(mut self, start: &[f64], to: f64) -> Result<(GrazingCurve, Vec<f64>), OrbitError> {
        let last = start.len() - 1;
        self.ends = [start[last], self.context.in_unit(to)];
        let (change, range) = (self.ends[1] - self.ends[0], self.range());
        let mut along = unit_vector(start.len(), last);
        along[last] = if change < 0.0 { -1.0 } else { 1.0 };
        let longest = self.options.ds_max.min(range);
        let control = StepControl {
            first: self.options.ds.min(longest),
            longest,
            shortest: self.options.ds_min.min(range * SHORTEST),
            most: if change == 0.0 { 0 } else { self.options.max_steps },
            unresolved: self.options.max_steps,
            far: Some(FAR),
        };
        let mut curve = GrazingCurve {
            free: self.context.system().free.clone(),
            points: Vec::new(),
            special: Vec::new(),
            unresolved: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let followed = follow(&mut self, start, &along, &control);
        let Some(mut followed) = followed else {
            curve.end = self.reason(&curve, 0.0)?;
            return Ok((curve, start.to_vec()));
        };
        if let (ContinuationEnd::Border { .. }, Some(point)) =
            (followed.end, followed.points.last_mut())
        {
            // The value of the border was put in place of one that is equal to rounding.
            self.complete(point);
        }
        self.describe(&mut curve, &followed)?;
        curve.end = match followed.end {
            _ if change == 0.0 => CurveEnd::Reached,
            ContinuationEnd::Border { .. } if self.value(&followed.points) == self.ends[1] => {
                CurveEnd::Reached
            }
            ContinuationEnd::Border { .. } => CurveEnd::LeftRange,
            ContinuationEnd::Closed => CurveEnd::Closed,
            ContinuationEnd::StepLimit => CurveEnd::StepLimit,
            ContinuationEnd::Last | ContinuationEnd::StepTooSmall | ContinuationEnd::WorkLimit => {
                self.reason(&curve, control.shortest)?
            }
        };
        let unknowns = followed.points.pop().map_or(start.to_vec(), |point| point.unknowns);
        Ok((curve, unknowns))
    }

    /// Width of the range of the second parameter, scaled.
    fn range(&self) -> f64 {
        (self.ends[1] - self.ends[0]).abs()
    }

    /// Second parameter at the last of some points, scaled.
    fn value(&self, points: &[PointOfGrazes]) -> f64 {
        let last = points.last().and_then(|point| point.unknowns.last());
        last.copied().unwrap_or(f64::NAN)
    }

    /// Reason for the end of a curve: the one kept, the work limit, or a shortest step.
    fn reason(&mut self, curve: &GrazingCurve, shortest: f64) -> Result<CurveEnd, OrbitError> {
        match self.stop.take() {
            Some(Stop::Ended(CurveEnd::Reached)) => Ok(CurveEnd::Reached),
            // A failure that the work limit caused is no reason of its own.
            Some(Stop::Ended(_) | Stop::Failed(OrbitError::SearchTooLong)) | None
                if self.effort.is_spent() =>
            {
                let period = curve.points.last().map_or(f64::NAN, |point| point.period);
                Ok(CurveEnd::WorkLimit { period, steps: self.effort.steps(period) })
            }
            Some(Stop::Ended(end)) => Ok(end),
            Some(Stop::Failed(error)) => Err(error),
            None => Ok(CurveEnd::StepTooSmall { ds: shortest }),
        }
    }

    /// Result of a computation at a point of the curve; the reason of a failure is kept.
    fn kept<T>(&mut self, found: Result<T, Stop<CurveEnd>>) -> Option<T> {
        match found {
            Ok(found) => Some(found),
            Err(Stop::Failed(OrbitError::Flow(_))) => None,
            Err(stop) => {
                self.stop = Some(stop);
                None
            }
        }
    }

    /// Adds the points of a curve, its special points and the stretches that may have more.
    fn describe(
        &self,
        curve: &mut GrazingCurve,
        followed: &FollowedCurve,
    ) -> Result<(), OrbitError> {
        let points = &followed.points;
        let Some(first) = points.first() else { return Ok(()) };
        let kinds: Vec<Option<SpecialKind>> =
            self.kinds_of_tests(first).into_iter().map(|(kind, _)| kind).collect();
        let orbits = points.iter().filter_map(|point| point.linearised.extra.as_ref());
        curve.points = orbits.map(|orbit| orbit.point.clone()).collect();
        for turn in &followed.turns {
            // A function that stays zero has no special point where the curve begins.
            let stays = turn.point == 0 && is_zero(points.get(1), turn.test);
            if let (Some(kind), false) = (kinds[turn.test], stays) {
                curve.special.extend(self.refined(kind, turn.test, &points[turn.point])?);
            }
        }
        let is_still = |[from, to]: [usize; 2], test| {
            points[from..=to].iter().all(|point| is_zero(Some(point), test))
        };
        let parameters = |place: usize| -> &[f64] {
            let orbit = points[place].linearised.extra.as_ref();
            orbit.map_or(&[], |orbit| &orbit.point.parameters)
        };
        for (test, ends) in followed.unresolved.iter().copied().chain(zero_stretches(followed)) {
            match kinds[test] {
                // A parameter that does not vary has no fold.
                Some(SpecialKind::Fold { .. }) if is_still(ends, test) => {}
                Some(kind) => curve.add_unresolved(kind, ends.map(parameters)),
                None => {}
            }
        }
        Ok(())
    }

    /// Test functions at a point; none if it is not complete. Those without a kind are the
    /// arguments of functions with a corner, and the distance of the second parameter from the
    /// value asked for: the curve may pass their zeros twice in one step.
    fn kinds_of_tests(&self, point: &PointOfGrazes) -> Vec<KindOfTest> {
        let Some(orbit) = &point.linearised.extra else { return Vec::new() };
        let [_, to] = self.ends;
        let ahead = point.unknowns[point.unknowns.len() - 1] - to;
        let corners = orbit.corners.iter().map(|&argument| TestValue::known_to(argument, 0.0));
        let others = corners.chain([TestValue::known_to(ahead, NOISE * to.abs())]);
        let mut tests = self.context.tests((&point.unknowns, &point.tangent), orbit);
        tests.extend(others.map(|test| (None, test)));
        tests
    }

    /// A special point to the roundoff of double-double: the zero itself for a condition; for other
    /// functions, the point of the curve on the plane normal to it.
    fn refined(
        &self,
        kind: SpecialKind,
        test: usize,
        point: &PointOfGrazes,
    ) -> Result<Option<SpecialPoint>, OrbitError> {
        let Some(orbit) = &point.linearised.extra else { return Ok(None) };
        let exact = match kind {
            SpecialKind::Codimension2 { n, from, to } => {
                let size = point.tests[test].noise() / NOISE;
                let zero = Zero { context: &self.context, from, to, n, size };
                refine(&zero, &point.unknowns, REFINED)?.ok().map(|root| root.unknowns)
            }
            _ => self.refined_on_plane(point),
        };
        let unknowns = exact.unwrap_or_else(|| converted(&point.unknowns));
        let parameters = self.context.parameters(&unknowns);
        Ok(Some(SpecialPoint { kind, parameters, point: orbit.point.clone() }))
    }

    /// Unknowns of the curve on the plane normal to it at a point, in double-double.
    fn refined_on_plane(&self, point: &PointOfGrazes) -> Option<Vec<Dd>> {
        let [tangent, origin]: [Vec<Dd>; 2] =
            [&point.tangent, &point.unknowns].map(|v| converted(v));
        self.context.scaled().iter().find_map(|system| {
            let (_, jacobian) = system.linearised(&point.unknowns).ok()?;
            let jacobian: DMatrix<Dd> = jacobian.map(Dd::from);
            let (unknowns, (), residual) = by_chords(&jacobian, &tangent, origin.clone(), |at| {
                Some(((), DVector::from_vec(system.residual(at).ok()?)))
            })?;
            (largest(&residual) <= REFINED).then_some(unknowns)
        })
    }

    /// End of the curve at the first corner that an argument at a graze passes between two points.
    fn corner_between(&mut self, ends: [&PointOfGrazes; 2]) -> Option<CurveEnd> {
        let [a, b] = ends.map(|point| point.linearised.extra.as_ref());
        let pairs: Vec<_> = a?.corners.iter().copied().zip(b?.corners.iter().copied()).collect();
        pairs.into_iter().enumerate().find_map(|(index, (a, b))| {
            if a * b >= 0.0 {
                return None;
            }
            let near = |curve: &mut Self, unknowns: &[f64]| {
                let found = curve.context.corner_near(unknowns, index).map_err(Stop::Failed);
                curve.kept(found)?
            };
            let (value, end) = zero_on_chord(self, ends, [a, b], near)?;
            // The sign of an argument may also change by a jump, when the phase is reduced.
            (value.abs() <= VANISHED * a.abs().max(b.abs())).then_some(end)
        })
    }

    /// Whether the work since the last stretch of the curve ended is too much for a stretch, with a
    /// point that is `step` ahead.
    fn is_too_much(&mut self, step: f64) -> bool {
        self.covered += step / self.range();
        if self.covered > STRETCH {
            (self.covered, self.spent) = (0.0, self.effort.spent());
        }
        self.effort.spent() - self.spent > self.options.most_products / STRETCH_SHARE
    }
}

impl CurveEquations<f64> for CurveOfGrazes<'_> {
    type Extra = Option<Box<Described>>;

    fn linearised(&mut self, unknowns: &[f64]) -> Option<Linearised<f64, Self::Extra>> {
        let found = self.context.scaled()[self.matching].linearised(unknowns);
        let (residual, jacobian) = self.kept(found.map_err(Stop::Failed))?;
        Some(Linearised { residual: DVector::from_vec(residual), jacobian, extra: None })
    }

    fn residual(&mut self, unknowns: &[f64]) -> Option<DVector<f64>> {
        let found = self.context.scaled()[self.matching].residual(unknowns);
        self.kept(found.map_err(Stop::Failed)).map(DVector::from_vec)
    }

    fn solution(
        &mut self,
        start: &[f64],
        [origin, normal]: [&[f64]; 2],
    ) -> Option<Solution<f64, Self::Extra>> {
        (0..self.context.scaled().len()).find_map(|matching| {
            self.matching = matching;
            corrected(self, start, origin, normal)
        })
    }

    fn complete(&mut self, point: &mut PointOfGrazes) -> bool {
        let found = self.context.describe(&point.unknowns);
        point.linearised.extra = self.kept(found).map(Box::new);
        point.linearised.extra.is_some()
    }

    fn tests(&self, point: &PointOfGrazes) -> Vec<TestValue<f64>> {
        self.kinds_of_tests(point).into_iter().map(|(_, test)| test).collect()
    }

    /// The second parameter is between the value asked for and one as far on the other side of the
    /// first.
    fn range(&self, unknown: usize) -> [f64; 2] {
        let [from, to] = self.ends;
        match unknown + 1 == self.context.system().unknowns() {
            true if to < from => [to, from + self.range()],
            true => [from - self.range(), to],
            false => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    fn is_spent(&self) -> bool {
        matches!(self.stop, Some(Stop::Failed(_)))
    }

    fn is_passable(&mut self, ends: [&PointOfGrazes; 2]) -> bool {
        let corner = self.corner_between(ends);
        let is_passable = corner.is_none();
        self.stop = corner.map(Stop::Ended).or(self.stop.take());
        is_passable
    }

    fn is_last(&mut self, [before, point]: [&PointOfGrazes; 2]) -> bool {
        let Some(orbit) = &point.linearised.extra else { return true };
        let step = apart(&before.unknowns, &point.unknowns);
        let [from, to] = self.ends;
        let value = point.unknowns.last().copied().unwrap_or(from);
        let ahead = ((value - from) / (to - from)).clamp(0.0, 1.0);
        (self.watch)(ahead.max(self.effort.share()));
        let normal_acceleration = orbit.point.normal_acceleration;
        self.stop = match () {
            () if normal_acceleration <= 0.0 => {
                Some(CurveEnd::DegenerateGraze { normal_acceleration })
            }
            () if self.context.is_beyond(&orbit.point) => Some(CurveEnd::Reached),
            () if self.is_too_much(step) => {
                let period = orbit.point.period;
                Some(CurveEnd::WorkLimit { period, steps: self.effort.steps(period) })
            }
            () => None,
        }
        .map(Stop::Ended);
        self.stop.is_some()
    }
}

/// Whether a test function is zero to rounding at a point, if there is one.
fn is_zero(point: Option<&PointOfGrazes>, test: usize) -> bool {
    point.is_none_or(|point| point.tests[test].beyond_rounding() == 0.0)
}

/// Test functions that stay zero between two successive points that are apart, with these points.
fn zero_stretches(curve: &FollowedCurve) -> impl Iterator<Item = (usize, [usize; 2])> + use<'_> {
    let points = &curve.points;
    let tests = points.first().map_or(0, |point| point.tests.len());
    let is_apart =
        |from: usize, to: usize| apart(&points[from].unknowns, &points[to].unknowns) > SAME_POINT;
    let pairs = (1..points.len()).map(|place| [place - 1, place]);
    let pairs = pairs.filter(move |&[from, to]| is_apart(from, to));
    pairs
        .flat_map(move |ends| (0..tests).map(move |test| (test, ends)))
        .filter(move |&(test, ends)| ends.into_iter().all(|at| is_zero(Some(&points[at]), test)))
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
