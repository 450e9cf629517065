//! `P_smooth` and `D` one at a time, by flying them: no expansion.
//!
//! What the two factors of a map are measured against. The flights are those of the definition: the
//! free flow with the surface ignored; back to the surface, through the reset, and on to the section.

use super::AnalysisError;
use super::section_frame::SectionFrame;
use super::values::Values;
use crate::flow::{Field, Integrator};
use crate::model::{Response, Scene};
use crate::numeric::Real;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Newton steps in time before giving up.
const NEWTON_STEPS: usize = 60;

/// Flies the smooth part and the contact of a rigid stop apart, over `f64` or double-double.
#[derive(Clone, Debug)]
pub struct FreeFlight<S: Real> {
    section: SectionFrame<S>,
    graze: SectionFrame<S>,
    field: Field,
    /// `h, h', h''`.
    normal: Values<S>,
    reset: Option<Values<S>>,
    phase: Option<usize>,
}

impl<S: Real> FreeFlight<S> {
    /// The flights of a scene about its grazing orbit.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let model = &scene.model;
        let surface = &model.surfaces[orbit.grazing_point().surface];
        let normal = [
            surface.event,
            surface.normal_velocity,
            surface.normal_acceleration,
        ];
        let reset = match &surface.response {
            Response::Impact { reset } => Some(Values::new(model, &model.graph, reset)),
            Response::Contact { .. } => None,
        };
        Self {
            section: SectionFrame::new(scene, orbit),
            graze: SectionFrame::at_graze(scene, orbit),
            field: Field::free(model, &[]),
            normal: Values::new(model, &model.graph, &normal),
            reset,
            phase: model.phase.is_some().then(|| model.dimension() - 1),
        }
    }

    /// `P_smooth` of a section point, in offsets.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`], [`AnalysisError::Flow`].
    pub fn smooth(&mut self, offsets: &[S], parameters: &[S]) -> Result<Vec<S>, AnalysisError> {
        self.section.place(offsets, parameters)?;
        let duration = self.section.duration();
        let values = self.section.parameters().to_vec();
        let mut state = self.fly(self.section.state(), &values, duration)?;
        if self.section.kind() == PoincareSectionKind::Tangency {
            state = self.minimum_near(&state, &values)?.0;
        }
        let mut offsets = self.section.offsets(&self.without_advance(state));
        if offsets.iter().any(|value| !value.is_finite()) {
            offsets.fill(S::from_f64(f64::NAN));
        }
        Ok(offsets)
    }

    /// `D` of a point in the grazing chart, in offsets, with its depth `−h_min`: the point itself where
    /// that is not positive; NaN for a surface that is not rigid.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`], [`AnalysisError::Flow`].
    pub fn discontinuity(
        &mut self,
        offsets: &[S],
        parameters: &[S],
    ) -> Result<(Vec<S>, S), AnalysisError> {
        self.graze.place(offsets, parameters)?;
        let values = self.graze.parameters().to_vec();
        let start = self.graze.state().to_vec();
        let (minimum, until_minimum) = self.minimum_near(&start, &values)?;
        let depth = -self.normal.evaluate(&minimum, &values).get(0);
        if depth <= S::zero() {
            return Ok((offsets.to_vec(), depth));
        }
        let since_minimum = self.entry_time(&minimum, &values)?;
        let entry = self.fly(&minimum, &values, since_minimum)?;
        let after = self.reset(&entry, &values);
        let image = if self.graze.kind() == PoincareSectionKind::Tangency {
            self.minimum_near(&after, &values)?.0
        } else {
            self.fly(&after, &values, -(until_minimum + since_minimum))?
        };
        Ok((self.graze.offsets(&image), depth))
    }

    fn fly(&self, state: &[S], parameters: &[S], duration: S) -> Result<Vec<S>, AnalysisError> {
        Ok(Integrator::new(&self.field).flow(state, parameters, duration)?)
    }

    /// The nearby point of the free flow with `h' = 0`, and the time to it.
    fn minimum_near(
        &mut self,
        state: &[S],
        parameters: &[S],
    ) -> Result<(Vec<S>, S), AnalysisError> {
        let (mut time, mut last) = (S::zero(), f64::INFINITY);
        let mut at = state.to_vec();
        for _ in 0..NEWTON_STEPS {
            let normal = self.normal.evaluate(&at, parameters);
            let step = -(normal.get(1) / normal.get(2));
            let size = step.magnitude();
            if size == 0.0 || !size.is_finite() || size >= last {
                break;
            }
            (time, last) = (time + step, size);
            at = self.fly(state, parameters, time)?;
        }
        Ok((at, time))
    }

    /// The time, negative, from a minimum beyond the surface back to the surface.
    fn entry_time(&mut self, minimum: &[S], parameters: &[S]) -> Result<S, AnalysisError> {
        let normal = self.normal.evaluate(minimum, parameters);
        let (depth, acceleration) = (-normal.get(0), normal.get(2));
        let mut time = -(S::from_f64(2.0) * depth / acceleration).sqrt();
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            let at = self.fly(minimum, parameters, time)?;
            let normal = self.normal.evaluate(&at, parameters);
            let step = normal.get(0) / normal.get(1);
            let size = step.magnitude();
            if size == 0.0 || !size.is_finite() || size >= last {
                break;
            }
            (time, last) = (time - step, size);
        }
        Ok(time)
    }

    fn reset(&mut self, state: &[S], parameters: &[S]) -> Vec<S> {
        match &mut self.reset {
            Some(reset) => {
                let values = reset.evaluate(state, parameters);
                (0..state.len())
                    .map(|component| values.get(component))
                    .collect()
            }
            None => vec![S::from_f64(f64::NAN); state.len()],
        }
    }

    fn without_advance(&self, mut state: Vec<S>) -> Vec<S> {
        if let Some(phase) = self.phase {
            state[phase] -= self.section.advance();
        }
        state
    }
}
