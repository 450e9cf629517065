//! `P_smooth` and `D` computed separately by integrating the flow, without an expansion.
//!
//! The factors of a map are measured against these flights, which follow the definition: the free
//! flow with the surface ignored; back to the surface, through the reset or the contact, and on to
//! the section.
//!
//! The free flight also carries section points to another section of the same grazing orbit, so
//! that maps on different sections can be compared on one window.

use super::error::AnalysisError;
use super::section_frame::{SectionFrame, Values, newton_to_rounding};
use crate::hybrid::{HybridSystem, Simulator};
use crate::model::{Response, Scene};
use crate::numeric::Real;
use crate::orbit::{GrazingOrbit, PiecewiseFlow, PoincareSectionKind};

/// Most Newton steps in time.
const NEWTON_STEPS: usize = 60;

/// Integrates the smooth part and the contact separately, over `f64` or double-double.
#[derive(Clone, Debug)]
pub struct FreeFlight<'a, S: Real> {
    section: SectionFrame<S>,
    graze: SectionFrame<S>,
    flow: PiecewiseFlow,
    /// `h, h', h''`.
    normal: Values<S>,
    response: FlownResponse<'a, S>,
    phase: Option<usize>,
}

/// Response of the surface, ready to be integrated.
#[derive(Clone, Debug)]
enum FlownResponse<'a, S: Real> {
    /// The reset, which takes no time.
    Reset(Values<S>),
    /// The contact, up to its release.
    Contact(Box<Simulator<'a, S>>),
}

impl<'a, S: Real> FreeFlight<'a, S> {
    /// Flights of a scene about its grazing orbit; `system` is the scene's model, lowered.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
    pub fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, AnalysisError> {
        let model = &scene.model;
        let surface = &model.surfaces[orbit.grazing_point().surface];
        let normal = [surface.event, surface.normal_velocity, surface.normal_acceleration];
        let section = SectionFrame::new(scene, orbit);
        let response = match &surface.response {
            Response::Impact { reset } => {
                FlownResponse::Reset(Values::new(model, &model.graph, reset))
            }
            Response::Contact { .. } => {
                FlownResponse::Contact(Box::new(Simulator::new(system, section.parameters())?))
            }
        };
        Ok(Self {
            section,
            graze: SectionFrame::at_graze(scene, orbit),
            flow: PiecewiseFlow::free(scene, &[]),
            normal: Values::new(model, &model.graph, &normal),
            response,
            phase: model.phase.is_some().then(|| model.dimension() - 1),
        })
    }

    /// `P_smooth` of a section point, in offsets; `None` if the flight diverges or no minimum of
    /// the gap lies near its end.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`].
    pub fn smooth(
        &mut self,
        offsets: &[S],
        parameters: &[S],
    ) -> Result<Option<Vec<S>>, AnalysisError> {
        self.section.place(offsets, parameters)?;
        let duration = self.section.duration();
        let values = self.section.parameters().to_vec();
        let mut end = self.fly(self.section.state(), &values, duration);
        if self.section.kind() == PoincareSectionKind::Tangency {
            end = end.and_then(|state| Some(self.minimum_near(&state, &values)?.0));
        }
        let image = end.map(|state| self.section.offsets(&self.without_advance(state)));
        Ok(image.filter(|image| image.iter().all(|value| value.is_finite())))
    }

    /// `D` of a point in the grazing chart, in offsets, and its depth `−h_min`. Without contact
    /// (depth ≤ 0) `D` is the point itself. `None` if no minimum of the gap is near or a contact
    /// does not end within a return time.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`], [`AnalysisError::Hybrid`].
    pub fn discontinuity(
        &mut self,
        offsets: &[S],
        parameters: &[S],
    ) -> Result<Option<(Vec<S>, S)>, AnalysisError> {
        self.graze.place(offsets, parameters)?;
        let values = self.graze.parameters().to_vec();
        let start = self.graze.state().to_vec();
        let Some((minimum, until_minimum)) = self.minimum_near(&start, &values) else {
            return Ok(None);
        };
        let depth = -self.normal.evaluate(&minimum, &values).get(0);
        if depth <= S::zero() {
            return Ok(Some((offsets.to_vec(), depth)));
        }
        let Some((entry, since_minimum)) = self.entry(&minimum, &values) else {
            return Ok(None);
        };
        let Some((after, contact_time)) = self.respond(&entry, &values)? else {
            return Ok(None);
        };
        let image = if self.graze.kind() == PoincareSectionKind::Tangency {
            self.minimum_near(&after, &values).map(|(image, _)| image)
        } else {
            let elapsed = until_minimum + since_minimum + contact_time;
            self.fly(&after, &values, -elapsed)
        };
        Ok(image.map(|image| (self.graze.offsets(&image), depth)))
    }

    /// Section point at the end of a free flight that takes about `duration`, in offsets, with
    /// `turns` subtracted from its phase; `None` as for [`smooth`](Self::smooth).
    fn arrive(&mut self, state: &[S], parameters: &[S], duration: S, turns: S) -> Option<Vec<S>> {
        let mut end = self.fly(state, parameters, duration)?;
        if self.section.kind() == PoincareSectionKind::Tangency {
            end = self.minimum_near(&end, parameters)?.0;
        }
        if let Some(phase) = self.phase {
            end[phase] -= turns;
        }
        let offsets = self.section.offsets(&end);
        offsets.iter().all(|offset| offset.is_finite()).then_some(offsets)
    }

    /// State after a time of either sign along the flow without contact at the grazes, with the
    /// hits of the orbit; `None` if it diverges.
    fn fly(&self, state: &[S], parameters: &[S], duration: S) -> Option<Vec<S>> {
        let end = self.flow.flow(state, parameters, duration);
        end.ok().filter(|state| state.iter().all(|value| value.is_finite()))
    }

    /// Nearby minimum of the gap along the free flow (`h' = 0`, `h'' > 0`), and the time to it.
    fn minimum_near(&mut self, state: &[S], parameters: &[S]) -> Option<(Vec<S>, S)> {
        let mut at = state.to_vec();
        let time = newton_to_rounding(S::zero(), NEWTON_STEPS, |time| {
            if time != S::zero() {
                at = self.fly(state, parameters, time)?;
            }
            let normal = self.normal.evaluate(&at, parameters);
            if normal.get(2) <= S::zero() {
                return None;
            }
            Some(normal.get(1) / normal.get(2))
        })?;
        Some((at, time))
    }

    /// Point where the free flow towards a minimum beyond the surface enters the surface, and its
    /// time relative to the minimum (negative).
    fn entry(&mut self, minimum: &[S], parameters: &[S]) -> Option<(Vec<S>, S)> {
        let normal = self.normal.evaluate(minimum, parameters);
        let (depth, acceleration) = (-normal.get(0), normal.get(2));
        let start = -(S::from_f64(2.0) * depth / acceleration).sqrt();
        let mut at = Vec::new();
        let time = newton_to_rounding(start, NEWTON_STEPS, |time| {
            at = self.fly(minimum, parameters, time)?;
            let normal = self.normal.evaluate(&at, parameters);
            Some(normal.get(0) / normal.get(1))
        })?;
        Some((at, time))
    }

    /// State after the reset or at the end of the contact, and the duration of the contact.
    fn respond(
        &mut self,
        state: &[S],
        parameters: &[S],
    ) -> Result<Option<(Vec<S>, S)>, AnalysisError> {
        match &mut self.response {
            FlownResponse::Reset(reset) => {
                let values = reset.evaluate(state, parameters);
                let after = (0..state.len()).map(|component| values.get(component));
                Ok(Some((after.collect(), S::zero())))
            }
            FlownResponse::Contact(simulator) => {
                let longest = self.graze.duration();
                simulator.set_parameters(parameters)?;
                Ok(simulator.contact_phase(self.graze.surface(), state, longest)?)
            }
        }
    }

    fn without_advance(&self, mut state: Vec<S>) -> Vec<S> {
        if let Some(phase) = self.phase {
            state[phase] -= self.section.advance();
        }
        state
    }
}

/// Carries points of one section to another, with the surfaces ignored.
#[derive(Clone, Debug)]
pub struct SectionChange<'a, S: Real> {
    from: SectionFrame<S>,
    to: FreeFlight<'a, S>,
    /// Time from one section to the other along the grazing orbit, in periods of the orbit;
    /// negative backwards.
    share: S,
}

impl<'a, S: Real> SectionChange<'a, S> {
    /// Change between the sections of two scenes that differ in their sections only; each section
    /// is taken within the period before the first passage.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
    pub fn new(
        system: &'a HybridSystem,
        from: (&Scene, &GrazingOrbit),
        to: (&Scene, &GrazingOrbit),
    ) -> Result<Self, AnalysisError> {
        let ahead = |(scene, orbit): (&Scene, &GrazingOrbit)| {
            let passages = orbit.passages_after_section(scene);
            let first = passages.iter().find(|passage| passage.place == 0);
            first.map_or(S::zero(), |first| S::from_dd(first.time / orbit.period))
        };
        Ok(Self {
            from: SectionFrame::new(from.0, from.1),
            to: FreeFlight::new(system, to.0, to.1)?,
            share: ahead(from) - ahead(to),
        })
    }

    /// The point carried to the other section, in its offsets; `None` if the flight diverges or no
    /// minimum of the gap lies near its end.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`].
    pub fn carry(
        &mut self,
        offsets: &[S],
        parameters: &[S],
    ) -> Result<Option<Vec<S>>, AnalysisError> {
        self.from.place(offsets, parameters)?;
        let (duration, advance) = (self.from.duration(), self.from.advance());
        let (state, values) = (self.from.state(), self.from.parameters());
        let phases = self.from.phase().zip(self.to.section.phase());
        let Some((late, phase, other)) = phases.map(|((phase, origin), (_, other))| {
            let arrival = origin + self.share * advance;
            ((phase - origin) / advance, arrival, other)
        }) else {
            return Ok(self.to.arrive(state, values, self.share * duration, S::zero()));
        };
        // On a stroboscopic section a late point has less time left to fly.
        let share = match self.to.section.kind() {
            PoincareSectionKind::Stroboscopic { .. } => self.share - late,
            PoincareSectionKind::Tangency => self.share,
        };
        Ok(self.to.arrive(state, values, share * duration, phase - other))
    }
}
