//! Legs: pieces of free flow between two charts, as jets in (coordinates; parameters).

use std::sync::Arc;

use super::approach::time_of_minimum;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{DEVIATION_WEIGHT, Variables};
use super::{ExpansionError, Leg};
use crate::flow::{
    FlowError, Program, at_series_time, evaluate, jet_transport, jet_transport_taylor, local_series,
};
use crate::jet::{Jet, JetSpace};
use crate::model::Model;
use crate::numeric::{Dd, Real};
use crate::orbit::PoincareSectionKind;

/// Relative accuracy asked of the jets of the flow.
const TOLERANCE: f64 = 1e-15;

/// Largest offset by which an orbit may miss its own section point.
const LARGEST_DEFECT: f64 = 1e-9;

/// Where a leg begins and ends on the grazing orbit.
#[derive(Clone, Debug)]
pub struct Route {
    /// Chart of the section it leaves.
    pub from: SectionChart,
    /// Chart of the section it reaches.
    pub to: SectionChart,
    /// Time it takes on the grazing orbit.
    pub duration: Dd,
    /// What is added to the far chart's phase.
    pub phase_advance: Dd,
}

/// Expands legs of one model about its grazing orbit.
#[derive(Clone, Debug)]
pub struct LegExpansion<'a> {
    model: &'a Model,
    passage: &'a Passage,
    variables: &'a Variables,
    rate: Option<Program>,
}

impl<'a> LegExpansion<'a> {
    /// Lowers the rate of the model's phase for jets; the field is the passage's.
    pub fn new(model: &'a Model, passage: &'a Passage, variables: &'a Variables) -> Self {
        let rate = model
            .phase
            .as_ref()
            .map(|phase| passage.jet_program(model, &[phase.rate]));
        Self {
            model,
            passage,
            variables,
            rate,
        }
    }

    /// The leg from one chart to another, `duration` later on the grazing orbit, to the total degree
    /// `smooth_order` (weighted degree `2 · smooth_order`); the phase advances by `phase_advance`.
    ///
    /// The jets of the flow come from collocation, order by order.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] if the flow fails, a space is too large, or the orbit misses the far chart.
    pub fn expand(&self, route: &Route, smooth_order: u32) -> Result<Leg, ExpansionError> {
        self.expand_with(route, smooth_order, |start, parameters| {
            Ok(jet_transport(
                &self.passage.field,
                start,
                parameters,
                route.duration.to_f64(),
                TOLERANCE,
            )?
            .image)
        })
    }

    /// The same leg in any scalar, its jets from Taylor's method: slower, and independent of
    /// [`expand`](Self::expand).
    ///
    /// # Errors
    ///
    /// As [`expand`](Self::expand).
    pub fn expand_by_taylor<S: Real>(
        &self,
        route: &Route,
        smooth_order: u32,
    ) -> Result<Leg<S>, ExpansionError> {
        self.expand_with(route, smooth_order, |start, parameters| {
            jet_transport_taylor(
                &self.passage.field,
                start,
                parameters,
                S::from_dd(route.duration),
            )
        })
    }

    fn expand_with<S: Real>(
        &self,
        route: &Route,
        smooth_order: u32,
        fly: impl Fn(&[Jet<S>], &[Jet<S>]) -> Result<Vec<Jet<S>>, FlowError>,
    ) -> Result<Leg<S>, ExpansionError> {
        let space = self
            .variables
            .smooth_space(DEVIATION_WEIGHT * smooth_order)?;
        let start = route.from.embed(self.passage, &space, 0)?;
        let parameters = self
            .passage
            .parameter_jets(&space, self.variables.coordinates);
        let flown = fly(&start, &parameters)?;
        let origin = self.origin(&route.to, route.phase_advance);
        let state = self.reach(&route.to, &space, &flown, &parameters, &origin)?;
        let image = route.to.offsets(&state, &origin);
        Ok(Leg {
            image: image
                .into_iter()
                .map(without_constant)
                .collect::<Result<_, _>>()?,
        })
    }

    /// The point of the far chart, its phase advanced.
    fn origin(&self, to: &SectionChart, phase_advance: Dd) -> Vec<Dd> {
        let mut origin = to.point.clone();
        if self.model.phase.is_some()
            && let Some(phase) = origin.last_mut()
        {
            *phase += phase_advance;
        }
        origin
    }

    /// Flies the last little way to the far section.
    fn reach<S: Real>(
        &self,
        to: &SectionChart,
        space: &Arc<JetSpace>,
        state: &[Jet<S>],
        parameters: &[Jet<S>],
        origin: &[Dd],
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let order = (space.order() + 1).max(2);
        let series = local_series(&self.passage.field, state, parameters, order);
        let time = match (to.section.kind, &self.rate) {
            (PoincareSectionKind::Stroboscopic { .. }, Some(rate)) => {
                let inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
                let rate = &evaluate(rate, space, &inputs)[0];
                let phase = state.len() - 1;
                &(-&state[phase].add_constant(-S::from_dd(origin[phase]))) / rate
            }
            _ => time_of_minimum(series.watched(0), &Jet::zero(space))?,
        };
        let time = time.add_constant(-time.head());
        Ok((0..state.len())
            .map(|component| at_series_time(series.state(component), &time))
            .collect())
    }
}

/// Drops the constant term, which is the orbit's defect in rounding.
fn without_constant<S: Real>(mut jet: Jet<S>) -> Result<Jet<S>, ExpansionError> {
    if !jet.is_finite() {
        return Err(ExpansionError::NotFinite { part: "P_smooth" });
    }
    let defect = jet.head().magnitude();
    if defect > LARGEST_DEFECT {
        return Err(ExpansionError::NotPeriodic { defect });
    }
    jet.coefficients_mut()[0] = S::zero();
    Ok(jet)
}
