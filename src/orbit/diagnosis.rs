//! What is wrong with a root of the extended system, or with an iteration that found none.

use crate::flow::Integrator;
use crate::model::Scene;

use super::minima::{gaps, watching_field};
use super::monodromy::{full_monodromy, multipliers};
use super::newton::NewtonFailure;
use super::outcome::{NamedValues, NotLocated};
use super::system::ExtendedSystem;

/// `h'' T² / max h` below which a graze is not simple.
const DEGENERATE: f64 = 1e-6;
/// The same where Newton's method has stalled, which it does near a degenerate graze.
const NEARLY_DEGENERATE: f64 = 1e-2;

/// The unknowns of a system, under examination.
pub(super) struct Diagnosis<'a> {
    scene: &'a Scene,
    system: &'a ExtendedSystem,
    unknowns: &'a [f64],
    parameters: Vec<f64>,
}

impl<'a> Diagnosis<'a> {
    /// A diagnosis of unknowns of a system.
    pub(super) fn new(scene: &'a Scene, system: &'a ExtendedSystem, unknowns: &'a [f64]) -> Self {
        Self {
            scene,
            system,
            unknowns,
            parameters: system.parameters(unknowns),
        }
    }

    /// Why a root is not an orbit of simple grazes.
    pub(super) fn degeneracy(&self) -> Option<NotLocated> {
        self.degenerate_below(DEGENERATE)
    }

    /// Why Newton's method failed here.
    pub(super) fn failed(&self, failure: &NewtonFailure) -> NotLocated {
        let last = failure.history.last().copied().unwrap_or(f64::NAN);
        if last < 1e-4
            && let Some(reason) = self.degenerate_below(NEARLY_DEGENERATE)
        {
            return reason;
        }
        let at = self.adjusted();
        if let Some(condition) = failure.singular {
            let [re, im] = self.multiplier_nearest_one();
            return NotLocated::Singular {
                at,
                condition,
                re,
                im,
            };
        }
        NotLocated::NotConverged {
            at,
            first: failure.history.first().copied().unwrap_or(f64::NAN),
            last,
            history: failure.history.clone(),
        }
    }

    /// The adjusted parameters here.
    pub(super) fn adjusted(&self) -> NamedValues {
        let named = self.system.free().iter().map(|&parameter| {
            let name = self.scene.model.parameters[parameter].name.clone();
            (name, self.parameters[parameter])
        });
        NamedValues(named.collect())
    }

    /// The first degenerate graze, `h'' T² / max h` being below a bound.
    fn degenerate_below(&self, bound: f64) -> Option<NotLocated> {
        let start = &self.unknowns[..self.system.dimension()];
        let period = self.system.period(self.unknowns);
        let watching = watching_field(&self.scene.model);
        let largest = gaps(&watching, start, &self.parameters, period).map(|gaps| gaps.largest);
        let mut integrator = Integrator::<f64>::new(&self.system.field);
        let times = self.system.times(self.unknowns);
        times.into_iter().enumerate().find_map(|(passage, time)| {
            let there = integrator.flow(start, &self.parameters, time);
            let geometry = self.system.geometry(passage);
            let normal_acceleration = there.map_or(f64::NAN, |state| {
                geometry.at(&state, &self.parameters).acceleration()
            });
            let surface = self.system.grazes.surfaces[passage];
            let range = largest.as_ref().map_or(1.0, |largest| largest[surface]);
            let relative =
                normal_acceleration * period * period / range.abs().max(f64::MIN_POSITIVE);
            (relative.is_nan() || relative < bound).then(|| NotLocated::DegenerateGraze {
                surface: self.scene.model.surfaces[surface].name.clone(),
                at: self.adjusted(),
                normal_acceleration,
                relative,
            })
        })
    }

    fn multiplier_nearest_one(&self) -> [f64; 2] {
        let state = &self.unknowns[..self.system.dimension()];
        let period = self.system.period(self.unknowns);
        let states = self.system.states();
        let full = full_monodromy(&self.system.field, state, &self.parameters, period);
        let block = full.map(|full| full.view((0, 0), (states, states)).into_owned());
        let found = block.and_then(|block| multipliers(&block));
        let distance = |value: &[f64; 2]| (value[0] - 1.0).hypot(value[1]);
        found
            .unwrap_or_default()
            .into_iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or([f64::NAN; 2])
    }
}
