//! Events of a motion, by which motions are told apart.
//!
//! On a tangency section a motion with several minima of the gap in one return has as many section
//! points, each a fixed point of its own. The events of their flights are the same.

use super::error::AnalysisError;
use super::progress::NoProgress;
use super::section_frame::Values;
use super::time_series::{TimeSeriesRequest, time_series};
use crate::hybrid::MomentEvent;
use crate::iteration::PhaseCircle;
use crate::model::{NodeId, Scene};
use crate::orbit::GrazingOrbit;

/// Contacts of a motion, and minima of its gaps.
#[derive(Clone, Debug)]
pub struct MotionEvents {
    /// Surface (index) and full state just before each event, the phase from 0 to its period.
    events: Vec<(usize, Vec<f64>)>,
    /// The phase as a component of the full state.
    circle: PhaseCircle,
    impact_speed: f64,
}

/// Largest difference of a component, relative to its size along the motion, within which events
/// are one.
const SAME: f64 = 1e-5;

impl MotionEvents {
    /// Events of a simulation; `None` if it ends early.
    ///
    /// # Errors
    ///
    /// As [`time_series`].
    pub fn of(
        scene: &Scene,
        orbit: &GrazingOrbit,
        request: &TimeSeriesRequest,
    ) -> Result<Option<Self>, AnalysisError> {
        let series = time_series(scene, orbit, request, &NoProgress)?;
        if series.early_end.is_some() {
            return Ok(None);
        }
        let model = &scene.model;
        let velocities = model.surfaces.iter().map(|surface| surface.normal_velocity);
        let velocities: Vec<NodeId> = velocities.collect();
        let mut velocities = Values::<f64>::new(model, &model.graph, &velocities);
        let (mut events, mut impact_speed) = (Vec::new(), 0.0_f64);
        for row in series.points {
            match row.event {
                Some((MomentEvent::Impact | MomentEvent::Contact, surface)) => {
                    let there = velocities.evaluate(&row.state, &series.parameters);
                    impact_speed = impact_speed.max(-there.get(surface));
                    events.push((surface, row.state));
                }
                Some((MomentEvent::Minimum, surface)) => events.push((surface, row.state)),
                Some((MomentEvent::Release, _)) | None => {}
            }
        }
        let circle = model.phase.as_ref().map_or_else(PhaseCircle::none, |phase| {
            PhaseCircle::new(model.states.len(), phase.period.to_f64())
        });
        Ok(Some(Self { events, circle, impact_speed }))
    }

    /// Largest normal speed of a contact; 0 without contact.
    pub fn impact_speed(&self) -> f64 {
        self.impact_speed
    }

    /// Whether the motion passes through the last event of another one. Both cover a period.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let Some(last) = other.events.last() else { return self.events.is_empty() };
        self.passes(self.events.len(), last)
    }

    /// Whether the motion repeats itself, and is not on its way to another one: each event of its
    /// second half is one of its first half, which is to cover a period.
    pub fn repeats(&self) -> bool {
        let half = self.events.len() / 2;
        self.events[half..].iter().all(|event| self.passes(half, event))
    }

    /// Whether an event is one of the first `count`.
    fn passes(&self, count: usize, (surface, there): &(usize, Vec<f64>)) -> bool {
        let size = |component: usize| match self.circle.phase() {
            Some((phase, period)) if phase == component => period,
            _ => {
                let sizes = self.events.iter().map(|(_, at)| at[component].abs());
                sizes.fold(f64::MIN_POSITIVE, f64::max)
            }
        };
        let sizes: Vec<f64> = (0..there.len()).map(size).collect();
        let mut first = self.events[..count].iter();
        first.any(|(of, here)| of == surface && self.circle.apart(here, there, &sizes) <= SAME)
    }

    /// Index of the first of some motions that each one is: its own if there is none before, and
    /// of a motion that is not known.
    pub fn first_of_each(motions: &[Option<Self>]) -> Vec<usize> {
        let mut first: Vec<usize> = Vec::with_capacity(motions.len());
        for (number, own) in motions.iter().enumerate() {
            let is_it = |&earlier: &usize| {
                let both = motions[earlier].as_ref().zip(own.as_ref());
                first[earlier] == earlier && both.is_some_and(|(known, own)| known.is_same(own))
            };
            let found = (0..number).find(is_it);
            first.push(found.unwrap_or(number));
        }
        first
    }
}
