//! Jets of a trajectory, carried from event to event of a simulated one.
//!
//! The simulated trajectory starts at the centre of a box and gives the order and the times of the
//! events. The jets pass each event as in docs/mathematics/hits.md: the time of the event is a jet,
//! and the state is moved to the event and back. A quantity that must keep its sign on the box is
//! bounded by the sum of its coefficients: the gap at each minimum, the speed at each contact, the
//! gap at the end.

use std::fmt;
use std::sync::Arc;

use crate::flow::{
    Field, FlowError, InputKind, LocalSeries, Program, bound_but, evaluate, local_series,
    watched_jet_transport_taylor,
};
use crate::hybrid::{Event, EventKind};
use crate::jet::{Jet, JetError, implicit_root, power_series_at, power_series_with_slope_at};
use crate::model::{Model, Response, Surface};
use crate::numeric::Dd;

/// Fields, resets and gaps of a model; all parameters but the active ones are bound.
#[derive(Clone, Debug)]
pub(super) struct Fields {
    /// Free flight; watches the gap of each surface.
    pub(super) free: Field,
    /// Response of each surface.
    pub(super) responses: Vec<FieldResponse>,
}

/// Response of a surface over jets.
#[derive(Clone, Debug)]
pub(super) enum FieldResponse {
    /// State after an impact.
    Rigid(Program),
    /// Field in contact; watches all gaps, then the release function.
    Compliant(Field),
}

/// Reason why the jets of a trajectory are no piece of an atlas.
#[derive(Debug)]
pub(super) enum Stopped {
    /// A quantity changes its sign on the box.
    Crossing(Box<Jet<f64>>),
    /// The event of a number may be a graze.
    Graze(usize, Box<Jet<f64>>),
    /// Nothing is known but that there are no jets.
    Failed,
}

impl From<JetError> for Stopped {
    fn from(_: JetError) -> Self {
        Self::Failed
    }
}

impl From<FlowError> for Stopped {
    fn from(_: FlowError) -> Self {
        Self::Failed
    }
}

impl Fields {
    pub(super) fn new(model: &Model, active: &[usize], values: &[Dd]) -> Self {
        let kinds = bound_but(active, values);
        let gaps: Vec<_> = model.surfaces.iter().map(|surface| surface.event).collect();
        let inputs: Vec<_> = (0..model.dimension())
            .map(|_| InputKind::Variable)
            .chain(kinds.iter().copied())
            .collect();
        let response = |surface: &Surface| match &surface.response {
            Response::Impact { reset } => {
                FieldResponse::Rigid(Program::new(&model.graph, reset, &inputs))
            }
            Response::Contact { field, release } => {
                let watched: Vec<_> = gaps.iter().copied().chain([*release]).collect();
                FieldResponse::Compliant(Field::new(&model.graph, field, &watched, &kinds))
            }
        };
        Self {
            free: Field::new(&model.graph, &model.flow, &gaps, &kinds),
            responses: model.surfaces.iter().map(response).collect(),
        }
    }
}

/// Most Taylor steps of jets between two events.
const MOST_STEPS: usize = 100_000;

/// Receiver of a time or a share that is reached on the way.
#[derive(Clone, Copy)]
pub(super) struct Watch<'w>(pub(super) &'w (dyn Fn(f64) + Sync));

impl fmt::Debug for Watch<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Watch")
    }
}

/// Jets under way.
#[derive(Clone, Debug)]
pub(super) struct Flight<'f> {
    fields: &'f Fields,
    parameters: &'f [Jet<f64>],
    /// Full state at `time` of the simulated trajectory.
    pub(super) state: Vec<Jet<f64>>,
    time: f64,
    /// Compliant surface in contact.
    contact: Option<usize>,
    /// Receiver of the times that are reached.
    watch: Watch<'f>,
}

impl<'f> Flight<'f> {
    pub(super) fn new(
        fields: &'f Fields,
        state: Vec<Jet<f64>>,
        parameters: &'f [Jet<f64>],
        contact: Option<usize>,
        watch: Watch<'f>,
    ) -> Self {
        Self { fields, parameters, state, time: 0.0, contact, watch }
    }

    /// Whether no surface is in contact.
    pub(super) fn is_free(&self) -> bool {
        self.contact.is_none()
    }

    fn field(&self) -> &'f Field {
        match self.contact.map(|surface| &self.fields.responses[surface]) {
            Some(FieldResponse::Compliant(field)) => field,
            _ => &self.fields.free,
        }
    }

    /// Flies to a time without events.
    pub(super) fn fly_to(&mut self, time: f64) -> Result<(), Stopped> {
        let (field, duration, watch) = (self.field(), time - self.time, self.watch);
        let reached = &mut |remaining| watch.0(time - remaining);
        let steps = &mut { MOST_STEPS };
        let parameters = self.parameters;
        self.state =
            watched_jet_transport_taylor(field, &self.state, parameters, duration, steps, reached)?;
        self.time = time;
        Ok(())
    }

    /// Series in time about the present state.
    pub(super) fn series(&self) -> LocalSeries<f64> {
        series(self.field(), &self.state, self.parameters)
    }

    /// Flies through all events.
    ///
    /// # Errors
    ///
    /// [`Stopped::Graze`] at the first event that may be a graze somewhere on the box.
    pub(super) fn pass_all(&mut self, events: &[Event<f64>]) -> Result<(), Stopped> {
        events.iter().enumerate().try_for_each(|(number, event)| self.pass(number, event))
    }

    fn pass(&mut self, number: usize, event: &Event<f64>) -> Result<(), Stopped> {
        self.fly_to(event.time)?;
        let surface = event.surface;
        let around = self.series();
        let gap = around.watched(surface);
        match event.kind {
            EventKind::NearMiss { .. } if self.contact == Some(surface) => Ok(()),
            EventKind::NearMiss { .. } => {
                let least = power_series_at(gap, &time_of_minimum(gap)?);
                must_keep_sign(least).map_err(|least| Stopped::Graze(number, least))
            }
            EventKind::Impact { .. } | EventKind::ContactBegin { .. } => {
                // NOTE: next to a graze the terms of the time grow so fast that it has no digits.
                let Ok(time) = root(gap) else {
                    return Err(Stopped::Graze(number, Box::new(gap[1].clone())));
                };
                let speed = power_series_at(&slopes(gap), &time);
                must_keep_sign(speed).map_err(|speed| Stopped::Graze(number, speed))?;
                let met = around.state_at(&time);
                let after = match &self.fields.responses[surface] {
                    FieldResponse::Rigid(reset) => reset_state(reset, &met, self.parameters),
                    FieldResponse::Compliant(_) => {
                        self.contact = Some(surface);
                        met
                    }
                };
                self.state = series(self.field(), &after, self.parameters).state_at(&-&time);
                Ok(())
            }
            EventKind::ContactEnd { .. } => {
                let time = root(around.watched(self.fields.responses.len()))?;
                let met = around.state_at(&time);
                self.contact = None;
                self.state = series(self.field(), &met, self.parameters).state_at(&-&time);
                Ok(())
            }
            EventKind::ChatterEnd { .. } | EventKind::Stick | EventKind::Release => {
                Err(Stopped::Failed)
            }
        }
    }

    /// Flies to the end of the simulated trajectory and by a small time, a jet, beyond.
    ///
    /// # Errors
    ///
    /// [`Stopped::Crossing`] if a gap changes its sign there: a contact is then before the end on a
    /// part of the box only.
    pub(super) fn end(
        mut self,
        duration: f64,
        beyond: &Jet<f64>,
    ) -> Result<Vec<Jet<f64>>, Stopped> {
        self.fly_to(duration)?;
        let around = self.series();
        for surface in 0..self.fields.responses.len() {
            let gap = power_series_at(around.watched(surface), beyond);
            must_keep_sign(gap).map_err(Stopped::Crossing)?;
        }
        Ok(around.state_at(beyond))
    }
}

/// State after an impact.
pub(super) fn reset_state(
    reset: &Program,
    state: &[Jet<f64>],
    parameters: &[Jet<f64>],
) -> Vec<Jet<f64>> {
    let inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
    evaluate(reset, &Arc::clone(state[0].space()), &inputs)
}

/// Series in time about a state, with as many powers as a time without constant term needs.
pub(super) fn series(
    field: &Field,
    state: &[Jet<f64>],
    parameters: &[Jet<f64>],
) -> LocalSeries<f64> {
    local_series(field, state, parameters, (state[0].space().order() + 1).max(2))
}

/// Time, a jet, of the minimum of a gap near the time 0 of its series.
pub(super) fn time_of_minimum(gap: &[Jet<f64>]) -> Result<Jet<f64>, JetError> {
    root(&slopes(gap))
}

/// Derivative of a series by time.
fn slopes(series: &[Jet<f64>]) -> Vec<Jet<f64>> {
    let powers = series.iter().enumerate().skip(1);
    powers.map(|(power, coefficient)| coefficient.scale(power as f64)).collect()
}

/// Root of a series near the time 0.
fn root(series: &[Jet<f64>]) -> Result<Jet<f64>, JetError> {
    implicit_root(&Jet::zero(series[0].space()), |time| power_series_with_slope_at(series, time))
}

/// Refuses a jet whose sign the bound by its coefficients does not fix on the box.
pub(super) fn must_keep_sign(jet: Jet<f64>) -> Result<(), Box<Jet<f64>>> {
    let swing: f64 = jet.coefficients()[1..].iter().map(|value| value.abs()).sum();
    match jet.head().abs() > swing {
        true => Ok(()),
        false => Err(Box::new(jet)),
    }
}
