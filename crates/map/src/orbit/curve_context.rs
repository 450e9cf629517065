//! Orbits at the points of a grazing curve, with the test functions whose zeros are its special
//! points.

use nalgebra::DMatrix;

use super::effort::Effort;
use super::free_flow::Corners;
use super::grazing_curve::{CurveEnd, CurvePoint, SpecialKind};
use super::grazing_orbit::{Grazes, GrazingConditions, GrazingOrbit, Penetration, Touch};
use super::monodromy::{ConditionFactors, Stretch, across_flow, legs, multipliers, round};
use super::newton::{Equations, Scaled, unit_of};
use super::outcome::{NotLocated, OrbitError, Stop, settled};
use super::passages::{clearance, other_minima, passages, points, stretches};
use super::system::ExtendedSystem;
use crate::continuation::{TestValue, dot, tangent_at};
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};

/// Data shared by all points of a curve: the scene, its equations, and the causes of `β` at its
/// grazes.
///
/// Unknowns are scaled by their units everywhere except in described orbits, so that steps and
/// tolerances mean the same at every size.
pub(super) struct CurveContext<'a> {
    scene: &'a Scene,
    /// The equations, matched at the end of the period and in its middle.
    systems: [ExtendedSystem; 2],
    units: Vec<f64>,
    residual_units: Vec<f64>,
    length: f64,
    /// Largest distance of each component of the full state from the graze along the orbit.
    reach: Vec<f64>,
    /// Number of conditions followed between every two passages.
    count: usize,
    stretches: Vec<Stretch>,
    corners: Option<Corners<'a>>,
    nearest: Option<Distance>,
}

/// A distance from given values of the free parameters, each in its own scale.
#[derive(Clone, Debug)]
pub(super) struct Distance {
    pub(super) from: Vec<f64>,
    pub(super) scales: Vec<f64>,
    /// Smallest distance found so far.
    pub(super) least: f64,
}

impl Distance {
    /// Differences from the given values, each over its scale.
    pub(super) fn scaled(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let from = self.from.iter().zip(&self.scales);
        values.zip(from).map(|(value, (from, scale))| (value - from) / scale).collect()
    }
}

/// Rounding of a test function, relative to its size.
pub(super) const NOISE: f64 = 1e-11;

/// A test function at one point of the curve, and the kind of special point that its zeros are, if
/// they are special.
pub(super) type KindOfTest = (Option<SpecialKind>, TestValue<f64>);

/// Value of a test function of a size.
fn test(kind: SpecialKind, value: f64, size: f64) -> KindOfTest {
    (Some(kind), TestValue::known_to(value, NOISE * size))
}

/// Description of the orbit at a point.
#[derive(Clone, Debug)]
pub(super) struct Described {
    pub(super) point: CurvePoint,
    /// Scale of the rounding of each condition.
    sizes: Vec<GrazingConditions<f64>>,
    /// Discriminant of the two multipliers and its size; `None` unless there are two.
    discriminant: Option<[f64; 2]>,
    /// Arguments of functions with a corner, at the grazes.
    pub(super) corners: Vec<f64>,
}

/// The passages of an orbit, with the derivatives of the flow between them.
struct Passed<S> {
    parameters: Vec<S>,
    period: S,
    touches: Vec<Touch<S>>,
    legs: Vec<DMatrix<S>>,
}

/// Largest `|h|` of a passage without an equation, relative to the range of `h`: the roundoff of an
/// `f64` root.
const TOUCHING: f64 = 1e-8;

impl<'a> CurveContext<'a> {
    /// The curve through an orbit in its adjusted parameters and `with`, whose values are of this
    /// size. `effort` counts all work together.
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &GrazingOrbit,
        (with, size): (usize, f64),
        count: usize,
        effort: &Effort,
    ) -> Result<Self, OrbitError> {
        let adjusted = scene.grazing.solve_for.iter().copied();
        let free: Vec<usize> = adjusted.chain([with]).collect();
        let system = ExtendedSystem::new(scene, Grazes::of(scene)?, orbit.parameters(), &free);
        let system = system.limited(effort);
        let stretches = stretches(scene, &system, &orbit.passages)?;
        let start = start(&system, orbit);
        let Scaled { mut units, residual_units, length, .. } = system.scaled(&start);
        if let (Some(unit), Some(value)) = (units.last_mut(), start.last()) {
            *unit = unit_of(value.abs().max(size));
        }
        Ok(Self {
            scene,
            reach: reach(&system, &start)?,
            systems: [system.clone(), system.matched(system.other_matching())],
            units,
            residual_units,
            length,
            count,
            stretches,
            corners: Corners::of(scene, &[with]),
            nearest: None,
        })
    }

    /// Adds the points at which a distance is stationary to the special points.
    pub(super) fn towards(self, distance: Distance) -> Self {
        Self { nearest: Some(distance), ..self }
    }

    /// The equations, matched at the end of the period.
    pub(super) fn system(&self) -> &ExtendedSystem {
        &self.systems[0]
    }

    /// Scaled equations, matched at the end of the period and, without hits, in its middle.
    pub(super) fn scaled(&self) -> [Scaled<'_, ExtendedSystem>; 2] {
        let Self { units, residual_units, length, .. } = self;
        let [end, middle] = &self.systems;
        [end, middle].map(|equations| Scaled {
            equations,
            units: units.clone(),
            residual_units: residual_units.clone(),
            length: *length,
        })
    }

    /// Scaled equations, matched at the end of the period.
    pub(super) fn equations(&self) -> Scaled<'_, ExtendedSystem> {
        let [end, _] = self.scaled();
        end
    }

    fn without_units<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        self.equations().without_units(unknowns)
    }

    /// Value of the second parameter, scaled.
    pub(super) fn in_unit(&self, value: f64) -> f64 {
        value / self.units.last().copied().unwrap_or(1.0)
    }

    /// All parameters at these unknowns.
    pub(super) fn parameters<S: Real>(&self, unknowns: &[S]) -> Vec<S> {
        self.system().parameters(&self.without_units(unknowns))
    }

    /// Scaled unknowns of a located orbit.
    pub(super) fn start(&self, orbit: &GrazingOrbit) -> Vec<f64> {
        self.equations().in_units(&start(self.system(), orbit))
    }

    /// Test functions at a point with this orbit.
    pub(super) fn tests(
        &self,
        (unknowns, tangent): (&[f64], &[f64]),
        orbit: &Described,
    ) -> Vec<KindOfTest> {
        let turning = tangent[self.system().first_parameter()..].iter();
        let folds =
            self.system().free.iter().zip(turning).map(|(&parameter, &component)| {
                test(SpecialKind::Fold { parameter }, component, 1.0)
            });
        let switch = orbit.discriminant;
        let switch = switch.map(|[value, size]| test(SpecialKind::MultiplierSwitch, value, size));
        let nearest = self.nearest.as_ref();
        let nearest = nearest.map(|distance| self.stationarity(distance, unknowns, tangent));
        let conditions = self.codimension2(&orbit.point.conditions, &orbit.sizes);
        conditions.chain(folds).chain(switch).chain(nearest).collect()
    }

    /// Whether a point is farther off in the second parameter alone than the nearest point known,
    /// which may be this one.
    pub(super) fn is_beyond(&mut self, point: &CurvePoint) -> bool {
        let offsets = |distance: &Distance| {
            distance.scaled(self.system().free.iter().map(|&free| point.parameters[free]))
        };
        let Some(offsets) = self.nearest.as_ref().map(offsets) else { return false };
        let Some(distance) = &mut self.nearest else { return false };
        distance.least = distance.least.min(dot(&offsets, &offsets).sqrt());
        offsets.last().is_some_and(|last| last.abs() > distance.least)
    }

    /// Half the derivative of the squared distance along the curve, as a test function.
    fn stationarity(&self, distance: &Distance, unknowns: &[f64], tangent: &[f64]) -> KindOfTest {
        let first = self.system().first_parameter();
        let values = &self.without_units(unknowns)[first..];
        let slopes = &self.without_units(tangent)[first..];
        let offsets = distance.scaled(values.iter().copied());
        let (mut value, mut size) = (0.0, 0.0);
        for (number, offset) in offsets.iter().enumerate() {
            let slope = slopes[number] / distance.scales[number];
            value += offset * slope;
            // A parameter is known to 14 digits.
            size += 1e-14 / NOISE * (values[number] / distance.scales[number] * slope).abs();
        }
        test(SpecialKind::Nearest, value, size)
    }

    /// Conditions as test functions. Those from mirror images repeat the others and are left out.
    fn codimension2<'c>(
        &self,
        conditions: &'c [GrazingConditions<f64>],
        sizes: &'c [GrazingConditions<f64>],
    ) -> impl Iterator<Item = KindOfTest> + use<'c> {
        let unmirrored = self.system().grazes.unmirrored();
        let followed = conditions.iter().zip(sizes);
        let followed = followed.filter(move |(at, _)| at.from < unmirrored);
        followed.flat_map(|(pair, sizes)| {
            let (from, to) = (pair.from, pair.to);
            let kinds = (1..).map(move |n| SpecialKind::Codimension2 { n, from, to });
            let values = pair.values.iter().zip(&sizes.values);
            kinds.zip(values).map(|(kind, (&value, &size))| test(kind, value, size))
        })
    }

    /// One condition at unknowns near the curve, even if not every passage touches there.
    pub(super) fn condition<S: Real>(
        &self,
        unknowns: &[S],
        from: usize,
        to: usize,
        n: usize,
    ) -> Result<S, OrbitError> {
        let nowhere = S::from_f64(f64::NAN);
        let Ok(passed) = settled(self.passed(unknowns, f64::INFINITY))? else {
            return Ok(nowhere);
        };
        let all = self.factors(&passed)?.conditions(n);
        let mine = all.iter().find(|at| at.from == from && at.to == to);
        let value = mine.and_then(|at| at.values.get(n - 1));
        Ok(value.copied().unwrap_or(nowhere))
    }

    fn factors<S: Real>(&self, passed: &Passed<S>) -> Result<ConditionFactors<S>, OrbitError> {
        ConditionFactors::new(
            self.system(),
            &self.stretches,
            &passed.touches,
            &passed.legs,
            &passed.parameters,
        )
    }

    fn passed<S: Real>(&self, unknowns: &[S], tolerance: f64) -> Result<Passed<S>, Stop<CurveEnd>> {
        let (unknowns, system) = (self.without_units(unknowns), self.system());
        let found = passages(self.scene, system, &unknowns, tolerance);
        let touches = found.map_err(|stop| stop.map(|reason| lost(&reason)))?.touches;
        let parameters = system.parameters(&unknowns);
        let period = system.period(&unknowns);
        Ok(Passed {
            legs: legs(system, &touches, &parameters, period)?,
            parameters,
            period,
            touches,
        })
    }

    /// Description of the orbit at a point.
    pub(super) fn describe(&self, unknowns: &[f64]) -> Result<Described, Stop<CurveEnd>> {
        let passed = self.passed(unknowns, TOUCHING)?;
        if let Some(end) = self.corner(&passed)? {
            return Err(Stop::Ended(end));
        }
        let corners = self.corner_arguments(&passed)?;
        let factors = self.factors(&passed)?;
        let conditions = factors.conditions(self.count);
        let parameters = &passed.parameters;
        let exact: Vec<Dd> = converted(parameters);
        let passages = points(self.scene, self.system(), &passed.touches, &exact)?;
        let state = passed.touches[0].state.clone();
        let local = self.system().geometry(0).at(&state, parameters);
        let monodromy = across_flow(&round(&passed.legs), &local);
        let discriminant = (monodromy.shape() == (2, 2)).then(|| {
            let half_difference = (monodromy[(0, 0)] - monodromy[(1, 1)]) * 0.5;
            let product = monodromy[(0, 1)] * monodromy[(1, 0)];
            let largest = monodromy[(0, 0)].abs().max(monodromy[(1, 1)].abs());
            let size = largest * largest + product.abs();
            [half_difference * half_difference + product, size]
        });
        let others = other_minima(self.scene, &passages, Dd::from(passed.period))?;
        self.system().counted(others.steps, passed.period);
        let others = others.minima;
        let point = CurvePoint {
            normal_acceleration: local.acceleration(),
            multipliers: multipliers(&monodromy)?,
            xi: conditions[0].values.clone(),
            conditions,
            clearance: clearance(&others),
            penetration: Penetration::deepest(self.scene, &others),
            period: passed.period,
            parameters: passed.parameters,
            state,
        };
        Ok(Described {
            point,
            sizes: factors.sizes(self.count, &self.reach),
            discriminant,
            corners,
        })
    }

    /// End of the curve at an orbit along which the free flow has a corner.
    fn corner(&self, passed: &Passed<f64>) -> Result<Option<CurveEnd>, OrbitError> {
        let Some(corners) = &self.corners else {
            return Ok(None);
        };
        let met = corners.of_orbit(&passed.grazes(), &passed.parameters, passed.period)?;
        Ok(met.as_ref().map(lost))
    }

    fn corner_arguments(&self, passed: &Passed<f64>) -> Result<Vec<f64>, OrbitError> {
        match &self.corners {
            Some(corners) => corners.arguments(&passed.grazes(), &passed.parameters),
            None => Ok(Vec::new()),
        }
    }

    /// Argument of a function with a corner at unknowns near the curve, and the end of the curve if
    /// that argument is at its corner.
    pub(super) fn corner_near(
        &self,
        unknowns: &[f64],
        index: usize,
    ) -> Result<Option<(f64, CurveEnd)>, OrbitError> {
        let passed = settled(self.passed(unknowns, TOUCHING))?;
        let (Some(corners), Ok(passed)) = (&self.corners, passed) else {
            return Ok(None);
        };
        let arguments = self.corner_arguments(&passed)?;
        let met = corners.of_argument(&passed.grazes(), index);
        Ok(arguments.get(index).copied().zip(met.as_ref().map(lost)))
    }
}

impl Passed<f64> {
    /// Surface and state of every graze.
    fn grazes(&self) -> Vec<(usize, Vec<f64>)> {
        let touches = self.touches.iter();
        touches.map(|at| (at.surface, at.state.clone())).collect()
    }
}

/// End of a curve at which a passage ceases to graze, or the free flow has a corner.
fn lost(reason: &NotLocated) -> CurveEnd {
    match reason {
        &NotLocated::OutOfOrder { passage, .. }
        | &NotLocated::NoMinimum { passage, .. }
        | &NotLocated::DoesNotTouch { passage, .. }
        | &NotLocated::NotMirrored { passage, .. } => CurveEnd::PassageLost { passage },
        NotLocated::Corner { function, key, at } => {
            CurveEnd::Corner { function, key: key.clone(), at: at.clone() }
        }
        _ => CurveEnd::StepTooSmall { ds: 0.0 },
    }
}

impl CurveContext<'_> {
    /// Unit tangent of the curve at a point, on the side of `along`; `None` if it is not
    /// determined.
    pub(super) fn tangent(&self, point: &[f64], along: &[f64]) -> Option<Vec<f64>> {
        self.scaled().iter().find_map(|system| {
            let (_, jacobian) = system.linearised(point).ok()?;
            tangent_at(&jacobian, along)
        })
    }
}

/// Unknowns of a located orbit, not scaled.
pub(super) fn start(system: &ExtendedSystem, orbit: &GrazingOrbit) -> Vec<f64> {
    let graze = orbit.grazing_point();
    let independent = &orbit.passages[1..system.grazes.independent];
    let times: Vec<Dd> = independent.iter().map(|passage| passage.time).collect();
    let unknowns = system.assemble(&graze.state, orbit.period, &times, &graze.parameters);
    converted(&unknowns)
}

/// Largest distance of each component of the full state from the graze along an orbit; 1 for a
/// constant component.
pub(super) fn reach(system: &ExtendedSystem, start: &[f64]) -> Result<Vec<f64>, OrbitError> {
    let graze = &start[..system.dimension];
    let (parameters, period) = (system.parameters(start), system.period(start));
    let mut reach = vec![0.0_f64; graze.len()];
    system.each_step(graze, &parameters, period, |_, _, state, _| -> Option<()> {
        for ((reach, value), graze) in reach.iter_mut().zip(state).zip(graze) {
            *reach = reach.max((value - graze).abs());
        }
        None
    })?;
    Ok(reach.into_iter().map(|reach| if reach > 0.0 { reach } else { 1.0 }).collect())
}
