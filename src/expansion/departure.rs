//! What follows a contact: the free flow from the surface to the section.

use std::sync::Arc;

use super::ExpansionError;
use super::approach::{Approach, kept_to_minimum, time_of_minimum};
use super::contact_law::ContactLaw;
use super::passage::Passage;
use super::release::ReleaseBalance;
use super::section_chart::SectionChart;
use super::variables::Variables;
use crate::flow::{Field, LocalSeries, Program, at_series_time, evaluate, local_series_kept_to};
use crate::jet::{Jet, JetSpace};
use crate::numeric::Real;

/// The state just after the contact, as jets in `(y; coordinates; parameters)`.
pub(super) struct Departure<S: Real> {
    space: Arc<JetSpace>,
    first_parameter: usize,
    /// The state.
    pub(super) state: Vec<Jet<S>>,
    /// Time from the section point.
    pub(super) time: Jet<S>,
}

/// How a passage goes through its surface.
pub(super) enum Through<'a> {
    /// By a reset.
    Reset(&'a Program),
    /// Along the contact field, until the release.
    Contact {
        field: &'a Field,
        release: ReleaseBalance,
    },
}

impl<'a> Through<'a> {
    /// The way through the surface of a passage.
    ///
    /// # Errors
    ///
    /// [`ContactLawError`](super::ContactLawError) where a contact has no release near the graze.
    pub(super) fn of(
        passage: &'a Passage,
        chart: &SectionChart,
        variables: &Variables,
    ) -> Result<Self, ExpansionError> {
        Ok(match &passage.law {
            ContactLaw::Rigid { reset } => Self::Reset(reset),
            ContactLaw::Compliant { field, .. } => Self::Contact {
                field,
                release: ReleaseBalance::new(passage, field, chart, variables)?,
            },
        })
    }

    /// Weights by which the image is less exact than the state on the surface.
    pub(super) fn lost_weights(&self) -> u32 {
        match self {
            Self::Reset(_) => 0,
            Self::Contact { release, .. } => release.lost_weights(),
        }
    }
}

impl<S: Real> Approach<S> {
    /// Through the contact: the reset of a rigid stop, or the contact field up to the release.
    pub(super) fn departure(
        &self,
        passage: &Passage,
        through: &Through<'_>,
    ) -> Result<Departure<S>, ExpansionError> {
        let entry = self.entry()?;
        let parameters = passage.parameter_jets(&self.space, self.first_parameter);
        let (state, time) = match through {
            Through::Contact { field, release } => {
                let exit = release.exit(field, &entry.state, &parameters)?;
                (exit.state, &entry.time + &exit.contact_time)
            }
            Through::Reset(reset) => {
                let inputs: Vec<_> = entry.state.iter().chain(&parameters).cloned().collect();
                (evaluate(reset, &self.space, &inputs), entry.time)
            }
        };
        Ok(Departure {
            space: Arc::clone(&self.space),
            first_parameter: self.first_parameter,
            state,
            time,
        })
    }
}

impl<S: Real> Departure<S> {
    /// Along the free flow to `h' = 0`: the image on a tangency section.
    pub(super) fn project_to_tangency(
        &self,
        passage: &Passage,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let series = self.series(passage);
        let time = time_of_minimum(series.watched(0), &Jet::zero(&self.space))?;
        Ok(self.states_at(&series, &time))
    }

    /// Back along the free flow by the time since the section point: the image at zero net time.
    pub(super) fn back_to_zero_time(
        &self,
        passage: &Passage,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        Ok(self.states_at(&self.series(passage), &-&self.time))
    }

    fn series(&self, passage: &Passage) -> LocalSeries<S> {
        let parameters = passage.parameter_jets(&self.space, self.first_parameter);
        let kept = kept_to_minimum(self.space.order());
        local_series_kept_to(&passage.field, &self.state, &parameters, kept)
    }

    fn states_at(&self, series: &LocalSeries<S>, time: &Jet<S>) -> Vec<Jet<S>> {
        (0..self.state.len())
            .map(|component| at_series_time(series.state(component), time))
            .collect()
    }
}
