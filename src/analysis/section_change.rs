//! Section points carried along the free flow to another section of the same grazing orbit.
//!
//! What one window is on the other section: the same orbits, so that maps of different sections can
//! be compared.

use super::AnalysisError;
use super::free_flight::FreeFlight;
use super::section_frame::SectionFrame;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::Real;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Carries points of one section to another, with the surfaces ignored.
#[derive(Clone, Debug)]
pub struct SectionChange<'a, S: Real> {
    from: SectionFrame<S>,
    to: FreeFlight<'a, S>,
    /// Time from one section to the other along the grazing orbit, negative backwards, over its
    /// period.
    share: S,
}

impl<'a, S: Real> SectionChange<'a, S> {
    /// Between the sections of two scenes that differ in them alone; each is taken within the
    /// period before the first passage.
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

    /// A point on the other section, in its offsets; `None` where the flight leaves the finite
    /// numbers or ends near no minimum of the gap.
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
        let phases = self.from.phase().zip(self.to.origin_phase());
        let Some((late, phase, other)) = phases.map(|((phase, origin), other)| {
            let arrival = origin + self.share * advance;
            ((phase - origin) / advance, arrival, other)
        }) else {
            return Ok(self
                .to
                .arrive(state, values, self.share * duration, S::zero()));
        };
        // On a stroboscopic section a point that is late has less far to fly.
        let share = match self.to.kind() {
            PoincareSectionKind::Stroboscopic { .. } => self.share - late,
            PoincareSectionKind::Tangency => self.share,
        };
        Ok(self
            .to
            .arrive(state, values, share * duration, phase - other))
    }
}
