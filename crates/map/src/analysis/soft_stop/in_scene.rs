//! Soft stop in the place of a scene's own: its lines in the scene's names, and how far a rigid
//! stop is from it over one return.

use super::{SoftStop, StopLaw};
use crate::analysis::error::AnalysisError;
use crate::analysis::section_frame::{Values, extent, orbit_samples};
use crate::hybrid::{HybridSystem, Simulator};
use crate::model::{ExpressionGraph, Model, NodeId, Response, Scene};
use crate::numeric::{Dd, converted};
use crate::orbit::{GrazingOrbit, PiecewiseFlow};

/// Share of the largest normal speed along the grazing orbit that is the speed of an impact, where
/// none is named.
const SHARE_OF_SPEED: f64 = 0.1;

/// Share of the period that is a contact time, where none is named.
const SHARE_OF_PERIOD: f64 = 0.01;

/// Largest difference, relative, of two numbers that are equal but for rounding.
const EQUAL: f64 = 1e-9;

/// The grazed stop of a scene, where the stop and its response may be replaced.
#[derive(Clone, Debug)]
pub struct StopInScene<'a> {
    scene: &'a Scene,
    /// Index of the stop.
    surface: usize,
    parameters: Vec<f64>,
    graze: Vec<f64>,
    free: PiecewiseFlow,
    /// Duration of a return.
    period: f64,
    /// Extents of the states along the grazing orbit, without the phase.
    extents: Vec<f64>,
    /// Largest normal speed along the grazing orbit.
    fastest: f64,
    /// Change of the full state that raises the normal velocity by 1: what a contact pushes.
    direction: Vec<f64>,
    /// Coefficients of the states in the rate of the penetration, if that is linear in them.
    rate: Option<Vec<f64>>,
}

/// A scene's stop that pushes nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{surface}` does not act on the velocity with which it is met; expected an impact or a \
         contact that does"
)]
pub struct NoDirection {
    /// Name of the stop.
    pub surface: String,
}

impl<'a> StopInScene<'a> {
    /// Stop of the first passage of a scene's grazing orbit.
    ///
    /// A soft stop acts on the states on which the stop of the scene acts, in the same proportions:
    /// those of its impact, or of its contact, at the graze.
    ///
    /// # Errors
    ///
    /// [`NoDirection`] if the stop of the scene does not change the normal velocity.
    pub fn new(scene: &'a Scene, orbit: &GrazingOrbit) -> Result<Self, NoDirection> {
        let model = &scene.model;
        let point = orbit.grazing_point();
        let (surface, states) = (point.surface, model.states.len());
        let stop = &model.surfaces[surface];
        let parameters: Vec<f64> = converted(orbit.parameters());
        let graze: Vec<f64> = converted(&point.state);
        let samples = orbit_samples(scene, orbit);
        let mut velocity = Values::new(model, &model.graph, &[stop.normal_velocity]);
        let speeds =
            samples.iter().map(|sample| velocity.evaluate(sample, &parameters).get(0).abs());
        let fastest = speeds.fold(0.0, f64::max);
        let mut found = Self {
            scene,
            surface,
            free: PiecewiseFlow::free(scene, &[]),
            period: orbit.period.to_f64(),
            extents: (0..states).map(|state| extent(&samples, state)).collect(),
            fastest,
            direction: Vec::new(),
            rate: None,
            parameters,
            graze,
        };
        found.direction =
            found.pushed().ok_or_else(|| NoDirection { surface: stop.name.clone() })?;
        found.rate = found.linear_rate();
        Ok(found)
    }

    /// Name of the stop.
    pub fn surface(&self) -> &str {
        &self.scene.model.surfaces[self.surface].name
    }

    /// Speed of an impact where none is named: a tenth of the largest normal speed along the
    /// grazing orbit.
    pub fn usual_speed(&self) -> f64 {
        SHARE_OF_SPEED * self.fastest
    }

    /// Contact time where none is named: a hundredth of the orbit's period.
    pub fn usual_time(&self) -> f64 {
        SHARE_OF_PERIOD * self.period
    }

    /// States on which the stop acts, each with its acceleration by a unit force on a unit mass.
    pub fn pushes(&self) -> impl Iterator<Item = (&'a str, f64)> + '_ {
        let names = self.scene.model.states.iter().map(String::as_str);
        names.zip(self.direction.iter().copied()).filter(|(_, push)| *push != 0.0)
    }

    /// States of which the rate of the penetration is a linear combination, with their
    /// coefficients; `None` if it is another function.
    pub fn rate(&self) -> Option<impl Iterator<Item = (&'a str, f64)> + '_> {
        let rate = self.rate.as_ref()?;
        let names = self.scene.model.states.iter().map(String::as_str);
        Some(names.zip(rate.iter().copied()).filter(|(_, factor)| *factor != 0.0))
    }

    /// Error of a rigid stop of a restitution in the place of a soft stop, over one return from an
    /// impact at the grazing point at this speed; `None` if the soft contact does not end within
    /// the return.
    ///
    /// Both states are flown freely to the end of the period that began with the impact. The error
    /// is the distance between them, in extents of the grazing orbit, over the distance that the
    /// rigid impact moves the state there.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Hybrid`] and [`AnalysisError::Orbit`] if a flight fails.
    pub fn error_of_rigid(
        &self,
        stop: &SoftStop,
        restitution: f64,
        speed: f64,
    ) -> Result<Option<f64>, AnalysisError> {
        let met = self.at_speed(-speed);
        let system = HybridSystem::new(&self.with_stop(stop));
        let mut simulator = Simulator::<f64>::new(&system, &self.parameters)?;
        let released = simulator.contact_phase(self.surface, &met, self.period)?;
        let Some((state, time)) = released else { return Ok(None) };
        let after = |state: &[f64], time: f64| self.free.flow(state, &self.parameters, time);
        let soft = after(&state, self.period - time)?;
        let rigid = after(&self.at_speed(restitution * speed), self.period)?;
        let unhindered = after(&met, self.period)?;
        Ok(Some(self.distance(&soft, &rigid) / self.distance(&rigid, &unhindered)))
    }

    /// Distance of two states at one phase, in extents of the grazing orbit.
    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let moving = self.extents.iter().zip(a.iter().zip(b)).filter(|(extent, _)| **extent > 0.0);
        moving.map(|(extent, (a, b))| ((a - b) / extent).powi(2)).sum::<f64>().sqrt()
    }

    /// State at the graze, moved to a normal velocity.
    fn at_speed(&self, normal_velocity: f64) -> Vec<f64> {
        let moved = self.graze.iter().zip(&self.direction);
        moved.map(|(value, push)| value + push * normal_velocity).collect()
    }

    /// The model of the scene with a soft stop in the place of its own.
    fn with_stop(&self, stop: &SoftStop) -> Model {
        let mut model = self.scene.model.clone();
        let surface = &model.surfaces[self.surface];
        let (event, velocity) = (surface.event, surface.normal_velocity);
        let force = stop.force(&mut model.graph, event, velocity);
        let scale = |graph: &mut ExpressionGraph, push: f64| {
            let factor = graph.number(push / stop.mass);
            graph.mul(factor, force)
        };
        let mut field = model.flow.clone();
        for (rate, &push) in field.iter_mut().zip(&self.direction).filter(|(_, push)| **push != 0.0)
        {
            let pushed = scale(&mut model.graph, push);
            *rate = model.graph.add(*rate, pushed);
        }
        let release = if stop.law.lets_go() { force } else { event };
        model.surfaces[self.surface].response = Response::Contact { field, release };
        model
    }

    /// Change of the full state, over that of the normal velocity, by the scene's own stop: by its
    /// impact at a small speed, or by its contact at a small depth and speed.
    fn pushed(&self) -> Option<Vec<f64>> {
        let model = &self.scene.model;
        let stop = &model.surfaces[self.surface];
        let mut graph = model.graph.clone();
        let size = model.dimension();
        let slopes = |graph: &mut ExpressionGraph, of: NodeId| -> Vec<NodeId> {
            (0..size).map(|component| graph.derivative(of, component)).collect()
        };
        let (by_gap, by_velocity) =
            (slopes(&mut graph, stop.event), slopes(&mut graph, stop.normal_velocity));
        let values = |outputs: &[NodeId], at: &[f64]| -> Vec<f64> {
            let mut values = Values::new(model, &graph, outputs);
            values.evaluate(at, &self.parameters);
            (0..outputs.len()).map(|output| values.get(output)).collect()
        };
        let by_gap = values(&by_gap, &self.graze);
        let by_velocity = values(&by_velocity, &self.graze);
        let states = 0..model.states.len();
        let of_velocity = states.clone().find(|&i| by_gap[i] == 0.0 && by_velocity[i] != 0.0)?;
        let mut at = self.graze.clone();
        at[of_velocity] -= self.usual_speed() / by_velocity[of_velocity];
        let change: Vec<f64> = match &stop.response {
            Response::Impact { reset } => {
                values(reset, &at).iter().zip(&at).map(|(after, before)| after - before).collect()
            }
            Response::Contact { field, .. } => {
                let of_gap = states.clone().find(|&i| by_gap[i] != 0.0)?;
                at[of_gap] -= self.usual_speed() * self.usual_time() / by_gap[of_gap];
                let (held, free) = (values(field, &at), values(&model.flow, &at));
                held.iter().zip(&free).map(|(held, free)| held - free).collect()
            }
        };
        let change = &change[..model.states.len()];
        let normal: f64 = change.iter().zip(&by_velocity).map(|(change, by)| change * by).sum();
        let largest = change.iter().fold(0.0_f64, |largest, change| largest.max(change.abs()));
        let push = |change: &f64| match change.abs() <= EQUAL * largest {
            true => 0.0,
            false => rounded(change / normal),
        };
        let mut direction: Vec<f64> = change.iter().map(push).collect();
        direction.resize(size, 0.0);
        direction.iter().all(|push| push.is_finite()).then_some(direction)
    }

    /// Coefficients of the states in the rate of the penetration, `−h'`, if it is a linear
    /// combination of them with constant coefficients.
    fn linear_rate(&self) -> Option<Vec<f64>> {
        let model = &self.scene.model;
        let velocity = model.surfaces[self.surface].normal_velocity;
        let mut graph = model.graph.clone();
        let mut slope = |component: usize| {
            let slope = graph.derivative(velocity, component);
            graph.constant_value(slope).map(Dd::to_f64)
        };
        let slopes: Vec<f64> = (0..model.dimension()).map(&mut slope).collect::<Option<_>>()?;
        let states = model.states.len();
        let of_phase = slopes[states..].iter().any(|slope| *slope != 0.0);
        let terms = slopes[..states].iter().zip(&self.graze).map(|(slope, state)| slope * state);
        let terms: Vec<f64> = terms.collect();
        // At the graze the rate is zero.
        let (rest, size) =
            (terms.iter().sum::<f64>(), terms.iter().map(|term| term.abs()).sum::<f64>());
        let is_linear = !of_phase && rest.abs() <= EQUAL * (size + self.fastest);
        is_linear.then(|| slopes[..states].iter().map(|slope| -slope).collect())
    }
}

impl SoftStop {
    /// Force in the inputs of a model, from a stop's event function and normal velocity.
    fn force(&self, graph: &mut ExpressionGraph, event: NodeId, velocity: NodeId) -> NodeId {
        let (depth, rate) = (graph.neg(event), graph.neg(velocity));
        let [stiffness, damper] = [self.stiffness, self.damper].map(|value| graph.number(value));
        let power = graph.power_real(depth, Dd::from(self.exponent));
        let spring = graph.mul(stiffness, power);
        let damping = graph.mul(damper, rate);
        match self.law {
            StopLaw::HuntCrossley => {
                let product = graph.mul(spring, damping);
                graph.add(spring, product)
            }
            _ => graph.add(spring, damping),
        }
    }
}

/// The nearest whole number, if the difference is rounding; else the number itself.
fn rounded(value: f64) -> f64 {
    if (value - value.round()).abs() <= EQUAL { value.round() } else { value }
}
