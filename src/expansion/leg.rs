//! Legs: pieces of free flow between two charts, as jets in (coordinates; parameters).

use std::sync::Arc;

use super::discontinuity::time_of_minimum;
use super::passage::{Passage, jet_inputs};
use super::section_chart::SectionChart;
use super::variables::Variables;
use super::{ExpansionError, Leg};
use crate::flow::{Field, Program, at_series_time, evaluate, jet_transport, local_series};
use crate::jet::{Jet, JetSpace};
use crate::model::Model;
use crate::numeric::Dd;
use crate::orbit::PoincareSectionKind;

/// Relative accuracy asked of the jets of the flow.
const TOLERANCE: f64 = 1e-15;

/// Largest offset by which an orbit may miss its own section point.
const LARGEST_DEFECT: f64 = 1e-9;

/// Expands legs of one model about its grazing orbit.
#[derive(Clone, Debug)]
pub struct LegExpansion<'a> {
    model: &'a Model,
    passage: &'a Passage,
    variables: &'a Variables,
    field: Field,
    rate: Option<Program>,
}

impl<'a> LegExpansion<'a> {
    /// Lowers the free field of the model for jets.
    pub fn new(
        model: &'a Model,
        passage: &'a Passage,
        variables: &'a Variables,
        parameters: &'a [Dd],
        active: &'a [usize],
    ) -> Self {
        let inputs = jet_inputs(model, parameters, active);
        Self {
            model,
            passage,
            variables,
            field: Field::free_bound(model, &[], active, parameters),
            rate: model
                .phase
                .as_ref()
                .map(|phase| Program::new(&model.graph, &[phase.rate], &inputs)),
        }
    }

    /// The leg from one chart to another, `duration` later on the grazing orbit, to the total degree
    /// `smooth_order` (weighted degree `2 · smooth_order`); the phase advances by `phase_advance`.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] if the flow fails, a space is too large, or the orbit misses the far chart.
    pub fn expand(
        &self,
        from: &SectionChart,
        to: &SectionChart,
        duration: Dd,
        phase_advance: Dd,
        smooth_order: u32,
    ) -> Result<Leg, ExpansionError> {
        let space = self
            .variables
            .smooth_space(super::variables::DEVIATION_WEIGHT * smooth_order)?;
        let start = from.embed::<f64>(self.passage, &space, 0)?;
        let parameters = self
            .passage
            .parameter_jets(&space, self.variables.coordinates);
        let flown = jet_transport(
            &self.field,
            &start,
            &parameters,
            duration.to_f64(),
            TOLERANCE,
        )?;
        let origin = self.origin(to, phase_advance);
        let state = self.reach(to, &space, &flown.image, &parameters, &origin)?;
        let image = to.offsets(&state, &origin);
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
    fn reach(
        &self,
        to: &SectionChart,
        space: &Arc<JetSpace>,
        state: &[Jet<f64>],
        parameters: &[Jet<f64>],
        origin: &[Dd],
    ) -> Result<Vec<Jet<f64>>, ExpansionError> {
        let series = local_series(&self.passage.field, state, parameters, space.order().max(2));
        let time = match (to.section.kind, &self.rate) {
            (PoincareSectionKind::Stroboscopic { .. }, Some(rate)) => {
                let inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
                let rate = &evaluate(rate, space, &inputs)[0];
                let phase = state.len() - 1;
                &(-&state[phase].add_constant(-origin[phase].to_f64())) / rate
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
fn without_constant(mut jet: Jet<f64>) -> Result<Jet<f64>, ExpansionError> {
    if !jet.is_finite() {
        return Err(ExpansionError::NotFinite { part: "P_smooth" });
    }
    let defect = jet.head().abs();
    if defect > LARGEST_DEFECT {
        return Err(ExpansionError::NotPeriodic { defect });
    }
    jet.coefficients_mut()[0] = 0.0;
    Ok(jet)
}
