//! Points of a grazing curve, by pseudo-arclength continuation of the extended system, with the
//! functions whose zeros are its special points.

use nalgebra::{DMatrix, DVector};

use super::corners::Corners;
use super::grazes::{Grazes, Touch};
use super::grazing_curve::{CurveEnd, CurvePoint, SpecialKind};
use super::grazing_orbit::{GrazingConditions, GrazingOrbit};
use super::monodromy::{conditions, legs, multipliers, on_section, round};
use super::newton::{Equations, Root, Solve, refine, solve};
use super::outcome::{NotLocated, OrbitError, Stop, settled};
use super::passages::{clearance, passages, points, stretches};
use super::section::PoincareSection;
use super::stretch::Stretch;
use super::system::{ExtendedSystem, Matching};
use crate::model::Scene;
use crate::numeric::{Dd, Real};

/// What every point of a curve shares: the scene, its equations, and how grazes are stretched.
pub(super) struct CurveContext<'a> {
    pub(super) scene: &'a Scene,
    pub(super) system: ExtendedSystem,
    /// How many conditions are followed from every passage to every other.
    count: usize,
    stretches: Vec<Stretch>,
    corners: Option<Corners<'a>>,
}

/// A point of the curve with its test functions, whose zeros are special points.
#[derive(Clone, Debug)]
pub(super) struct TestedPoint {
    pub(super) unknowns: Vec<f64>,
    pub(super) tangent: Vec<f64>,
    pub(super) tests: Vec<(SpecialKind, f64)>,
    /// Arguments of functions with a corner, at the grazes.
    pub(super) corners: Vec<f64>,
    pub(super) point: CurvePoint,
}

/// The orbit at a point.
pub(super) struct Described {
    pub(super) point: CurvePoint,
    /// Discriminant of the two multipliers, where there are two.
    discriminant: Option<f64>,
    corners: Vec<f64>,
}

/// The passages of an orbit with the flow between them.
struct Passed<S> {
    parameters: Vec<S>,
    period: S,
    touches: Vec<Touch<S>>,
    legs: Vec<DMatrix<S>>,
}

/// Largest `|h|` of a passage that no equation holds, relative to the range of `h`: the roundoff of
/// an `f64` root.
const TOUCHING: f64 = 1e-8;

impl<'a> CurveContext<'a> {
    /// The curve through an orbit, in the parameters it was adjusted in and `with`.
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &GrazingOrbit,
        with: usize,
        count: usize,
    ) -> Result<Self, OrbitError> {
        let adjusted = scene.grazing.solve_for.iter().copied();
        let free: Vec<usize> = adjusted.chain([with]).collect();
        let system = ExtendedSystem::new(scene, Grazes::of(scene)?, orbit.parameters(), &free);
        let stretches = stretches(scene, &system, &orbit.passages)?;
        Ok(Self { scene, system, count, stretches, corners: Corners::of(scene, &[with]) })
    }

    /// Unknowns of a located orbit.
    pub(super) fn start(&self, orbit: &GrazingOrbit) -> Vec<f64> {
        let graze = orbit.grazing_point();
        let independent = &orbit.passages[1..self.system.grazes.independent];
        let times: Vec<Dd> = independent.iter().map(|passage| passage.time).collect();
        let unknowns = self.system.assemble(&graze.state, orbit.period, &times, &graze.parameters);
        unknowns.iter().map(|value| value.to_f64()).collect()
    }

    /// Everything about a point of the curve, or why the curve ends there.
    pub(super) fn at(
        &self,
        unknowns: Vec<f64>,
        along: &[f64],
    ) -> Result<TestedPoint, Stop<CurveEnd>> {
        let Some(tangent) = tangent(&self.system, &unknowns, along)? else {
            return Err(Stop::Ended(CurveEnd::StepTooSmall { ds: 0.0 }));
        };
        let Described { point, discriminant, corners } = self.describe(&unknowns)?;
        let turning = tangent[self.system.first_parameter()..].iter();
        let folds = self
            .system
            .free()
            .iter()
            .zip(turning)
            .map(|(&parameter, &component)| (SpecialKind::Fold { parameter }, component));
        let switch = discriminant.map(|value| (SpecialKind::MultiplierSwitch, value));
        let tests = self.codimension2(&point.conditions).chain(folds);
        Ok(TestedPoint { tests: tests.chain(switch).collect(), unknowns, tangent, corners, point })
    }

    /// The conditions as functions along the curve. Those from mirror images repeat the others and
    /// are left out.
    fn codimension2<'c>(
        &self,
        conditions: &'c [GrazingConditions<f64>],
    ) -> impl Iterator<Item = (SpecialKind, f64)> + use<'c> {
        let unmirrored = self.system.grazes.unmirrored();
        let followed = conditions.iter().filter(move |at| at.from < unmirrored);
        followed.flat_map(|pair| {
            let (from, to) = (pair.from, pair.to);
            let kind = move |n| SpecialKind::Codimension2 { n, from, to };
            (1..).map(kind).zip(pair.values.iter().copied())
        })
    }

    /// One condition at unknowns near the curve, whether or not every passage touches there.
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
        let all = self.conditions(&passed, n)?;
        let mine = all.iter().find(|at| at.from == from && at.to == to);
        let value = mine.and_then(|at| at.values.get(n - 1));
        Ok(value.copied().unwrap_or(nowhere))
    }

    fn conditions<S: Real>(
        &self,
        passed: &Passed<S>,
        count: usize,
    ) -> Result<Vec<GrazingConditions<S>>, OrbitError> {
        conditions(
            &self.system,
            &self.stretches,
            &passed.touches,
            &passed.legs,
            &passed.parameters,
            count,
        )
    }

    fn passed<S: Real>(&self, unknowns: &[S], tolerance: f64) -> Result<Passed<S>, Stop<CurveEnd>> {
        let found = passages(self.scene, &self.system, unknowns, tolerance);
        let touches = found.map_err(|stop| stop.map(|reason| lost(&reason)))?.touches;
        let parameters = self.system.parameters(unknowns);
        let period = self.system.period(unknowns);
        Ok(Passed {
            legs: legs(&self.system.field, &touches, &parameters, period)?,
            parameters,
            period,
            touches,
        })
    }

    /// The orbit at a point.
    pub(super) fn describe(&self, unknowns: &[f64]) -> Result<Described, Stop<CurveEnd>> {
        let passed = self.passed(unknowns, TOUCHING)?;
        if let Some(end) = self.corner(&passed)? {
            return Err(Stop::Ended(end));
        }
        let corners = self.corner_arguments(&passed)?;
        let conditions = self.conditions(&passed, self.count)?;
        let parameters = &passed.parameters;
        let exact: Vec<Dd> = parameters.iter().map(|&value| Dd::from(value)).collect();
        let passages = points(self.scene, &self.system, &passed.touches, &exact)?;
        let (graze, state) = (&passages[0], passed.touches[0].state.clone());
        let local = self.system.geometry(0).at(&state, parameters);
        let model = &self.scene.model;
        let section = PoincareSection::tangency(model, graze.surface, &graze.state, &exact);
        let monodromy = on_section(&round(&passed.legs), &section, &local);
        let discriminant = (monodromy.shape() == (2, 2)).then(|| {
            let half_difference = (monodromy[(0, 0)] - monodromy[(1, 1)]) * 0.5;
            half_difference * half_difference + monodromy[(0, 1)] * monodromy[(1, 0)]
        });
        let point = CurvePoint {
            normal_acceleration: local.acceleration(),
            multipliers: multipliers(&monodromy)?,
            xi: conditions[0].values.clone(),
            conditions,
            clearance: clearance(self.scene, &passages, Dd::from(passed.period))?,
            parameters: passed.parameters,
            state,
        };
        Ok(Described { point, discriminant, corners })
    }

    /// The end of the curve at an orbit along which the free flow has a corner.
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

    /// The argument of a function with a corner at unknowns near the curve, and the end that a
    /// corner would be there.
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
    /// The surface and the state of every graze.
    fn grazes(&self) -> Vec<(usize, Vec<f64>)> {
        let touches = self.touches.iter();
        touches.map(|at| (at.surface, at.state.clone())).collect()
    }
}

/// The end of a curve where a passage ceases to graze, or the free flow has a corner.
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

/// Largest residual a corrector may stall at.
const TOLERANCE: f64 = 1e-9;

/// The extended system in two parameters, on the plane through `origin` across `normal`.
#[derive(Clone, Debug)]
struct Bordered {
    system: ExtendedSystem,
    origin: Vec<f64>,
    normal: Vec<f64>,
}

impl Equations for Bordered {
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.system.differentiate(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok((residual, bordered(&jacobian, &self.normal)))
    }

    fn residual<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let mut residual = self.system.evaluate(unknowns)?;
        residual.push(self.offset(unknowns));
        Ok(residual)
    }
}

impl Bordered {
    fn offset<S: Real>(&self, unknowns: &[S]) -> S {
        let terms = unknowns.iter().zip(&self.origin).zip(&self.normal);
        terms
            .map(|((&value, &origin), &normal)| (value - S::from_f64(origin)) * S::from_f64(normal))
            .sum()
    }
}

/// The point of the curve on the plane through `origin` across `normal`, or `None` where Newton's
/// method finds none.
pub(super) fn correct(
    system: &ExtendedSystem,
    origin: &[f64],
    normal: &[f64],
) -> Result<Option<Vec<f64>>, OrbitError> {
    for matching in [Matching::AtEnd, Matching::AtMiddle] {
        let equations = Bordered {
            system: system.matched(matching),
            origin: origin.to_vec(),
            normal: normal.to_vec(),
        };
        match solve(&equations, origin, TOLERANCE) {
            Ok(Solve::Root(root)) => return Ok(Some(root)),
            Ok(Solve::Failed(_)) | Err(OrbitError::Flow(_)) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// A point found by [`correct`], to the roundoff of double-double.
pub(super) fn correct_dd(
    system: &ExtendedSystem,
    point: &[f64],
    origin: &[f64],
    normal: &[f64],
) -> Result<Solve<Root>, OrbitError> {
    let equations = |matching| Bordered {
        system: system.matched(matching),
        origin: origin.to_vec(),
        normal: normal.to_vec(),
    };
    match refine(&equations(Matching::AtEnd), point, 1e-22) {
        Ok(Solve::Root(root)) => Ok(Solve::Root(root)),
        _ => refine(&equations(Matching::AtMiddle), point, 1e-22),
    }
}

/// The unit tangent of the curve at a point, on the side of `along`; `None` where it is not
/// determined.
pub(super) fn tangent(
    system: &ExtendedSystem,
    point: &[f64],
    along: &[f64],
) -> Result<Option<Vec<f64>>, OrbitError> {
    for matching in [Matching::AtEnd, Matching::AtMiddle] {
        let Ok((_, jacobian)) = system.matched(matching).differentiate(point) else {
            continue;
        };
        let mut right = DVector::zeros(point.len());
        right[point.len() - 1] = 1.0;
        if let Some(direction) = bordered(&jacobian, along).lu().solve(&right)
            && direction.iter().all(|value| value.is_finite())
        {
            let length = direction.norm();
            return Ok(Some(direction.iter().map(|value| value / length).collect()));
        }
    }
    Ok(None)
}

/// A Jacobian with one more row.
pub(super) fn bordered(jacobian: &DMatrix<f64>, normal: &[f64]) -> DMatrix<f64> {
    let rows = jacobian.nrows();
    let mut matrix = jacobian.clone().insert_row(rows, 0.0);
    for (column, &value) in normal.iter().enumerate() {
        matrix[(rows, column)] = value;
    }
    matrix
}
