//! From a steady state to a graze: settle, shoot, and move the parameter until the orbit touches.

use super::free_flow::{Minimum, gaps, watching_field};
use super::newton::Scaled;
use super::outcome::{NamedValues, NotLocated, OrbitError, Stop};
use super::system::{ExtendedSystem, Shooting, solve_either};
use crate::flow::{Field, Integrator};
use crate::model::Scene;

/// A search along the periodic orbits of one parameter.
pub(super) struct Search<'a> {
    scene: &'a Scene,
    system: &'a ExtendedSystem,
    surface: usize,
    parameter: usize,
    watching: Field,
}

/// A periodic orbit of the free flow at one value of the parameter.
#[derive(Clone, Debug)]
struct Periodic {
    value: f64,
    start: Vec<f64>,
    lowest: Minimum,
    largest: f64,
    /// Whether all of it lies beyond the surface.
    beyond: bool,
}

/// Periods flown to settle.
const SETTLING: usize = 400;
/// Change of a period, in the unit of the states, of a motion that has settled.
const SETTLED: f64 = 1e-10;
/// Parameter values tried.
const TRIALS: usize = 60;
/// Part of the range of `h` within which Newton on the extended system is tried.
const NEAR: f64 = 0.2;

impl<'a> Search<'a> {
    /// A search for the graze of a system that has one, in its parameter.
    pub(super) fn new(scene: &'a Scene, system: &'a ExtendedSystem, parameter: usize) -> Self {
        Self {
            scene,
            system,
            surface: system.grazes.surfaces[0],
            parameter,
            watching: watching_field(&scene.model),
        }
    }

    /// Unknowns of the extended system at a graze with `h'' > 0`, from a full state and the
    /// parameter's first value.
    pub(super) fn run(&self, start: &[f64], value: f64) -> Result<Vec<f64>, Stop<NotLocated>> {
        let mut orbit = match self.periodic(value, start) {
            Some(orbit) => orbit,
            None => {
                let (settled, change) = self.settle(start, value);
                let orbit = self.periodic(value, &settled);
                orbit.ok_or_else(|| Stop::Ended(self.no_orbit(value, change)))?
            }
        };
        let mut closest = orbit.clone();
        let mut beyond = orbit.beyond.then(|| orbit.clone());
        let mut previous: Option<Periodic> = None;
        for _ in 0..TRIALS {
            self.system.check_limit()?;
            if let Some(unknowns) = self.touch(&orbit)? {
                return Ok(unknowns);
            }
            let Some(next) = self.advance(&orbit, previous.as_ref()) else {
                break;
            };
            previous = Some(std::mem::replace(&mut orbit, next));
            if orbit.lowest.event.abs() < closest.lowest.event.abs() {
                closest = orbit.clone();
            }
            if beyond.is_none() && orbit.beyond {
                beyond = Some(orbit.clone());
            }
        }
        Err(Stop::Ended(match beyond {
            Some(orbit) => self.wrong_side(&orbit),
            None => self.never_touches(&closest),
        }))
    }

    /// The free flow's state after many periods, and how much the last one changed it.
    fn settle(&self, start: &[f64], value: f64) -> (Vec<f64>, f64) {
        let (parameters, states) = (self.parameters(value), self.system.states);
        let period = self.system.period(&self.unknowns(start, value));
        let mut state = start.to_vec();
        let mut change = f64::NAN;
        for _ in 0..SETTLING {
            let mut integrator = Integrator::<f64>::new(&self.watching);
            let mut next = match self.system.flow(&mut integrator, &state, &parameters, period) {
                Ok(next) => next,
                Err(OrbitError::SearchTooLong) => return (state, change),
                Err(_) => return (state, f64::NAN),
            };
            next[states..].copy_from_slice(&start[states..]);
            change = next.iter().zip(&state).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            state = next;
            if change < SETTLED * self.system.length(&self.unknowns(&state, value)) {
                break;
            }
        }
        (state, change)
    }

    /// The periodic orbit near a full state, its phase kept.
    fn periodic(&self, value: f64, start: &[f64]) -> Option<Periodic> {
        let (states, parameters) = (self.system.states, self.parameters(value));
        let shooting = Shooting::new(self.system, *start.get(states)?, &parameters);
        let length = self.system.length(&self.unknowns(start, value));
        let scaled =
            Scaled { equations: &shooting, units: vec![length; states], residual_unit: length };
        let Ok(Ok(root)) = scaled.solve(&start[..states], 1e-9) else {
            return None;
        };
        let mut full = start.to_vec();
        full[..states].copy_from_slice(&root);
        let period = self.system.period(&self.unknowns(&full, value));
        let gaps = gaps(&self.watching, &full, &parameters, period).ok()?;
        self.system.counted(gaps.steps, period);
        let beyond = gaps.beyond().is_some_and(|(surface, _)| surface == self.surface);
        let mine = gaps.minima.into_iter().filter(|minimum| minimum.surface == self.surface);
        let lowest = mine.min_by(|a, b| a.event.total_cmp(&b.event))?;
        Some(Periodic { value, start: full, lowest, largest: gaps.largest[self.surface], beyond })
    }

    /// Newton on the extended system from an orbit's lowest point, where that is near the surface.
    fn touch(&self, orbit: &Periodic) -> Result<Option<Vec<f64>>, OrbitError> {
        if orbit.lowest.event.abs() > NEAR * (orbit.largest - orbit.lowest.event) {
            return Ok(None);
        }
        let Ok(root) =
            solve_either(self.system, &self.unknowns(&orbit.lowest.state, orbit.value), 1e-9)?
        else {
            return Ok(None);
        };
        let state = &root[..self.system.dimension];
        let acceleration =
            self.system.geometry(0).at(state, &self.system.parameters(&root)).acceleration();
        Ok((acceleration > 0.0).then_some(root))
    }

    /// The orbit at the secant's next parameter value, nearer where it cannot be followed that far.
    fn advance(&self, orbit: &Periodic, previous: Option<&Periodic>) -> Option<Periodic> {
        let scale = orbit.value.abs().max(0.1);
        let slope = previous
            .map(|last| (orbit.lowest.event - last.lowest.event) / (orbit.value - last.value));
        let mut step = match slope {
            Some(slope) if slope != 0.0 && slope.is_finite() => {
                (-orbit.lowest.event / slope).clamp(-0.5 * scale, 0.5 * scale)
            }
            Some(_) => 0.1 * scale,
            None => 1e-3 * scale,
        };
        for _ in 0..12 {
            if let Some(next) = self.periodic(orbit.value + step, &orbit.start) {
                return Some(next);
            }
            step *= 0.5;
        }
        None
    }

    fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.system.parameters(&vec![value; self.system.unknowns()]);
        parameters[self.parameter] = value;
        parameters
    }

    fn unknowns(&self, state: &[f64], value: f64) -> Vec<f64> {
        self.system.assemble(state, 0.0, &[], &self.parameters(value))
    }

    fn name(&self) -> String {
        self.scene.model.parameters[self.parameter].name.clone()
    }

    fn no_orbit(&self, value: f64, change: f64) -> NotLocated {
        NotLocated::NoPeriodicOrbit { parameter: self.name(), value, periods: SETTLING, change }
    }

    fn wrong_side(&self, orbit: &Periodic) -> NotLocated {
        NotLocated::WrongSide {
            surface: self.scene.model.surfaces[self.surface].name.clone(),
            at: NamedValues(vec![(self.name(), orbit.value)]),
            largest: orbit.largest,
        }
    }

    fn never_touches(&self, closest: &Periodic) -> NotLocated {
        NotLocated::NeverTouches {
            surface: self.scene.model.surfaces[self.surface].name.clone(),
            parameter: self.name(),
            value: closest.value,
            clearance: closest.lowest.event,
            tried: TRIALS,
        }
    }
}
