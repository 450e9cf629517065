//! Legs: pieces of free flow between two charts, as jets in (coordinates; parameters).

use std::sync::Arc;

use super::approach::time_of_minimum;
use super::graze::Graze;
use super::routes::Route;
use super::variables::DEVIATION_WEIGHT;
use super::{ExpansionError, Leg};
use crate::flow::{
    Field, FlowError, Program, at_series_time, evaluate, jet_transport, jet_transport_taylor,
    local_series,
};
use crate::jet::{Jet, JetSpace};
use crate::model::Model;
use crate::numeric::{Dd, Real, Scalar};
use crate::orbit::PoincareSectionKind;

/// Relative accuracy asked of the jets of the flow.
const TOLERANCE: f64 = 1e-15;

/// Largest offset by which an orbit may miss its own section point.
const LARGEST_DEFECT: f64 = 1e-9;

/// Expands legs of one model about its grazing orbit.
#[derive(Clone, Debug)]
pub struct LegExpansion<'a> {
    model: &'a Model,
    grazes: &'a [Graze],
    rate: Option<Program>,
}

impl<'a> LegExpansion<'a> {
    /// Lowers the rate of the model's phase for jets; the field is that of the passages.
    pub(super) fn new(model: &'a Model, grazes: &'a [Graze]) -> Self {
        let clock = model.phase.as_ref();
        let rate = clock
            .zip(grazes.first())
            .map(|(phase, graze)| graze.passage.jet_program(model, &[phase.rate]));
        Self {
            model,
            grazes,
            rate,
        }
    }

    /// The leg along a route, to the total degree `smooth_order` (weighted degree `2 ·
    /// smooth_order`).
    ///
    /// The jets of the flow come from collocation, order by order.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] if the flow fails, a space is too large, or the orbit misses the far
    /// chart.
    pub fn expand(&self, route: &Route, smooth_order: u32) -> Result<Leg, ExpansionError> {
        self.expand_with(route, smooth_order, |start, parameters| {
            Ok(jet_transport(
                self.field(route),
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
                self.field(route),
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
        let Graze {
            passage, variables, ..
        } = &self.grazes[route.from.passage];
        let space = variables.smooth_space(DEVIATION_WEIGHT * smooth_order)?;
        let start = route.from.chart.embed(passage, &space, 0)?;
        let parameters = passage.parameter_jets(&space, variables.coordinates);
        let flown = fly(&start, &parameters)?;
        let origin = self.origin(route);
        let state = self.reach(route, &space, &flown, &parameters, &origin)?;
        let image = route.to.chart.offsets(&state, &origin);
        let sizes = self.sizes(route, &origin);
        let image = image.into_iter().zip(sizes);
        Ok(Leg {
            image: image
                .map(|(jet, size)| without_constant(jet, size))
                .collect::<Result<_, _>>()?,
        })
    }

    /// What a defect of each coordinate is small against: the states at the far end where they
    /// exceed 1, otherwise 1.
    fn sizes(&self, route: &Route, origin: &[Dd]) -> Vec<f64> {
        let states = self.model.states.len();
        let length = origin[..states].iter().map(|value| value.magnitude());
        let length = length.fold(1.0, f64::max);
        let coordinates = route.to.chart.section.coordinates.iter();
        coordinates
            .map(|&component| if component < states { length } else { 1.0 })
            .collect()
    }

    /// The free field, the event function at the far end watched.
    fn field(&self, route: &Route) -> &Field {
        &self.grazes[route.to.passage].passage.field
    }

    /// The point of the far chart, its phase advanced.
    fn origin(&self, route: &Route) -> Vec<Dd> {
        let mut origin = route.to.chart.point.clone();
        if self.model.phase.is_some()
            && let Some(phase) = origin.last_mut()
        {
            *phase += route.phase_advance;
        }
        origin
    }

    /// Flies the last little way to the far section.
    fn reach<S: Real>(
        &self,
        route: &Route,
        space: &Arc<JetSpace>,
        state: &[Jet<S>],
        parameters: &[Jet<S>],
        origin: &[Dd],
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let order = (space.order() + 1).max(2);
        let series = local_series(self.field(route), state, parameters, order);
        let time = match (route.to.chart.section.kind, &self.rate) {
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
fn without_constant<S: Real>(mut jet: Jet<S>, size: f64) -> Result<Jet<S>, ExpansionError> {
    if !jet.is_finite() {
        return Err(ExpansionError::NotFinite { part: "P_smooth" });
    }
    let defect = jet.head().magnitude();
    if defect > LARGEST_DEFECT * size {
        return Err(ExpansionError::NotPeriodic { defect });
    }
    jet.coefficients_mut()[0] = S::zero();
    Ok(jet)
}
