//! Points of a grazing curve, with the functions whose zeros are its special points.

use nalgebra::DMatrix;

use crate::model::Scene;
use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::conditions::{GrazingConditions, conditions, legs, round};
use super::continuation::tangent;
use super::corners::Corners;
use super::curve::{CurveEnd, CurvePoint, SpecialKind};
use super::describe::{clearance, kicks, points};
use super::grazes::Grazes;
use super::kick::Kick;
use super::monodromy::{multipliers, on_section};
use super::outcome::NotLocated;
use super::passages::{Touch, passages};
use super::point::GrazingOrbit;
use super::section::PoincareSection;
use super::system::ExtendedSystem;

/// What is the same at every point of a curve.
pub(super) struct Stations<'a> {
    pub(super) scene: &'a Scene,
    pub(super) system: ExtendedSystem,
    /// How many conditions are followed from every passage to every other.
    count: usize,
    kicks: Vec<Kick>,
    corners: Option<Corners<'a>>,
}

/// A point on the way, with the functions whose zeros are special points.
#[derive(Clone, Debug)]
pub(super) struct Station {
    pub(super) unknowns: Vec<f64>,
    pub(super) tangent: Vec<f64>,
    pub(super) signs: Vec<(SpecialKind, f64)>,
    /// Arguments of functions with a corner, at the grazes.
    pub(super) corners: Vec<f64>,
    pub(super) point: CurvePoint,
}

/// The orbit at a point.
pub(super) struct Described {
    pub(super) point: CurvePoint,
    /// Of its two multipliers, where there are two.
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

impl<'a> Stations<'a> {
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
        let kicks = kicks(scene, &system, &orbit.passages)?;
        Ok(Self {
            scene,
            system,
            count,
            kicks,
            corners: Corners::of(scene, &[with]),
        })
    }

    /// Unknowns of a located orbit.
    pub(super) fn start(&self, orbit: &GrazingOrbit) -> Vec<f64> {
        let graze = orbit.grazing_point();
        let independent = &orbit.passages[1..self.system.grazes.independent];
        let times: Vec<Dd> = independent.iter().map(|passage| passage.time).collect();
        let unknowns = self
            .system
            .assemble(&graze.state, orbit.period, &times, &graze.parameters);
        unknowns.iter().map(|value| value.to_f64()).collect()
    }

    /// Everything about a point of the curve, or why the curve ends there.
    pub(super) fn at(
        &self,
        unknowns: Vec<f64>,
        along: &[f64],
    ) -> Result<Result<Station, CurveEnd>, OrbitError> {
        let Some(tangent) = tangent(&self.system, &unknowns, along)? else {
            return Ok(Err(CurveEnd::StepTooSmall { ds: 0.0 }));
        };
        let Described {
            point,
            discriminant,
            corners,
        } = match self.describe(&unknowns)? {
            Ok(described) => described,
            Err(end) => return Ok(Err(end)),
        };
        let turning = tangent[self.system.first_parameter()..].iter();
        let folds = self
            .system
            .free()
            .iter()
            .zip(turning)
            .map(|(&parameter, &component)| (SpecialKind::Fold { parameter }, component));
        let switch = discriminant.map(|value| (SpecialKind::MultiplierSwitch, value));
        let signs = self.codimension2(&point.conditions).chain(folds);
        Ok(Ok(Station {
            signs: signs.chain(switch).collect(),
            unknowns,
            tangent,
            corners,
            point,
        }))
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
        let Ok(passed) = self.passed(unknowns, f64::INFINITY)? else {
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
            &self.kicks,
            &passed.touches,
            &passed.legs,
            &passed.parameters,
            count,
        )
    }

    fn passed<S: Real>(
        &self,
        unknowns: &[S],
        tolerance: f64,
    ) -> Result<Result<Passed<S>, CurveEnd>, OrbitError> {
        let touches = match passages(self.scene, &self.system, unknowns, tolerance)? {
            Ok(found) => found.touches,
            Err(reason) => return Ok(Err(lost(&reason))),
        };
        let parameters = self.system.parameters(unknowns);
        let period = self.system.period(unknowns);
        Ok(Ok(Passed {
            legs: legs(&self.system.field, &touches, &parameters, period)?,
            parameters,
            period,
            touches,
        }))
    }

    /// The orbit at a point.
    pub(super) fn describe(
        &self,
        unknowns: &[f64],
    ) -> Result<Result<Described, CurveEnd>, OrbitError> {
        let passed = match self.passed(unknowns, TOUCHING)? {
            Ok(passed) => passed,
            Err(end) => return Ok(Err(end)),
        };
        if let Some(end) = self.corner(&passed)? {
            return Ok(Err(end));
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
        Ok(Ok(Described {
            point,
            discriminant,
            corners,
        }))
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
        let (Some(corners), Ok(passed)) = (&self.corners, self.passed(unknowns, TOUCHING)?) else {
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
        NotLocated::Corner { function, key, at } => CurveEnd::Corner {
            function,
            key: key.clone(),
            at: at.clone(),
        },
        _ => CurveEnd::StepTooSmall { ds: 0.0 },
    }
}
