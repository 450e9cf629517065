//! Time series by direct simulation, starting at a point of the section.

use serde::{Deserialize, Serialize};

use super::direct_image::{hit_together, products_of_step};
use super::error::AnalysisError;
use super::progress::{PartProgress, Progress};
use super::section_frame::{SectionFrame, Values};
use super::work::MOST_WORK;
use crate::hybrid::{DirectReturn, HybridSystem, Moment, MomentEvent, Outcome};
use crate::model::{Model, Response, Scene};
use crate::numeric::converted;
use crate::orbit::{FlowEvent, GrazingOrbit, PiecewiseFlow};

/// Request of [`time_series`] and [`each_moment`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeSeriesRequest {
    /// Offsets of the section's coordinates at the start; all 0 for the grazing orbit.
    pub start: Vec<f64>,
    /// Offsets of the active parameters.
    pub parameters: Vec<f64>,
    /// Returns to the section that are simulated first, without rows, so that an orbit settles on
    /// its attractor. Ignored on the grazing orbit at its own parameters.
    #[serde(default)]
    pub settle: usize,
    /// Nominal length of the recorded simulation, in returns to the section.
    pub returns: usize,
    /// States at evenly spaced times per return, in addition to those at events.
    pub samples: usize,
}

/// One row of a time series.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesPoint {
    /// Time since the section point, or since the end of the settling time; negative on the way to
    /// a section point beyond the surface.
    pub time: f64,
    /// Full state, with the phase from 0 to its period.
    pub state: Vec<f64>,
    /// Gaps of all surfaces of the model.
    pub gaps: Vec<f64>,
    /// Event at this moment and index of its surface; the state is the one before the event.
    pub event: Option<(MomentEvent, usize)>,
}

/// A time series.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeSeries {
    /// All parameters of the model.
    pub parameters: Vec<f64>,
    /// Time of one nominal return.
    pub duration: f64,
    /// Rows in order of time.
    pub points: Vec<SeriesPoint>,
    /// Early end of the simulation; `None` if it is complete.
    pub early_end: Option<EarlyEnd>,
}

/// Reason and time of the early end of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct EarlyEnd {
    /// Reason, in words.
    pub reason: String,
    /// Time of the end.
    pub time: f64,
}

impl EarlyEnd {
    /// Early end for an outcome; `None` if the simulation is complete.
    fn of(outcome: Outcome<f64>, model: &Model) -> Option<Self> {
        let name = |surface: usize| &model.surfaces[surface].name;
        let (reason, time) = match outcome {
            Outcome::Completed => return None,
            Outcome::Diverged { time } => ("the solution leaves the finite numbers".into(), time),
            Outcome::Penetrating { surface, time, .. } => {
                (format!("the state is beyond the rigid surface `{}`", name(surface)), time)
            }
            Outcome::GoesThrough { surface, time } => {
                (format!("the reset of `{}` leaves the state moving into it", name(surface)), time)
            }
            Outcome::HeldTwice { surfaces: [a, b], time } => {
                (format!("surfaces `{}` and `{}` hold the state at once", name(a), name(b)), time)
            }
            Outcome::HitTogether { surfaces, time } => (hit_together(model, surfaces), time),
            Outcome::NoStickingField { surface, time } => {
                let why = match model.surfaces[surface].response {
                    Response::Impact { .. } => "whose reset defines no contact force",
                    Response::Contact { .. } => "which pushes it off as the free flow presses on",
                };
                (format!("the state must stay on surface `{}`, {why}", name(surface)), time)
            }
            Outcome::Slides { time } => (
                "the field presses the state from both sides onto a zero of `sign`, `abs`, `min` \
                 or `max` (dry friction at rest, for example), where the model has no field"
                    .into(),
                time,
            ),
            Outcome::StepLimit { time, limit } => {
                (format!("a trajectory takes {limit} steps at most"), time)
            }
        };
        Some(Self { reason, time })
    }
}

impl TimeSeriesRequest {
    /// Whether the start is on the grazing orbit at its own parameters.
    fn is_grazing_orbit(&self) -> bool {
        self.start.iter().chain(&self.parameters).all(|&offset| offset == 0.0)
    }
}

impl TimeSeries {
    /// Number of events of each kind at each surface, as (kind, surface, count); zero counts left
    /// out.
    pub fn event_counts(&self) -> Vec<(MomentEvent, usize, usize)> {
        let mut counts: Vec<(MomentEvent, usize, usize)> = Vec::new();
        for (event, surface) in self.points.iter().filter_map(|point| point.event) {
            match counts.iter_mut().find(|(kind, at, _)| (*kind, *at) == (event, surface)) {
                Some((_, _, count)) => *count += 1,
                None => counts.push((event, surface, 1)),
            }
        }
        counts
    }
}

/// Simulates from a point of the section.
///
/// The grazing orbit at its own parameters is its own flow, repeated period by period, with a
/// minimum at each graze, unless it passes through a surface. Everything else is simulated. A
/// section point beyond the surface is taken back along the free flow to the surface, where the
/// series starts, at a negative time. An impact has two rows at one time: the state before it,
/// which names the event, and the state after it.
///
/// # Errors
///
/// [`AnalysisError::Length`]; [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
pub fn time_series(
    scene: &Scene,
    orbit: &GrazingOrbit,
    request: &TimeSeriesRequest,
    progress: &dyn Progress,
) -> Result<TimeSeries, AnalysisError> {
    let mut points = Vec::new();
    let push = &mut |point| points.push(point);
    let mut series = each_moment(scene, orbit, request, progress, push)?;
    series.points = points;
    Ok(series)
}

/// Most steps of a simulation, whatever a step costs.
const MOST_STEPS: u64 = 10_000_000;

/// Simulates as [`time_series`] does and passes each row to `record`, for series too long for
/// memory; the returned series has no rows.
///
/// # Errors
///
/// As [`time_series`].
pub fn each_moment(
    scene: &Scene,
    orbit: &GrazingOrbit,
    request: &TimeSeriesRequest,
    progress: &dyn Progress,
    record: &mut dyn FnMut(SeriesPoint),
) -> Result<TimeSeries, AnalysisError> {
    let model = &scene.model;
    let system = HybridSystem::new(model);
    let mut frame = SectionFrame::<f64>::new(scene, orbit);
    frame.place(&request.start, &request.parameters)?;
    let (section, duration) = (frame.return_section(), frame.duration());
    let parameters = frame.parameters().to_vec();
    let mut returns = DirectReturn::new(&system, &parameters, section, duration, frame.periods())?;
    let most = (10 * MOST_WORK / products_of_step(scene) as u64).min(MOST_STEPS);
    returns.set_step_limit(most as usize);
    let mut rows = Rows::new(model, &parameters);
    PartProgress::announce(progress, 1);
    let part = PartProgress::new(progress, 1);
    if request.is_grazing_orbit() && orbit.is_physical() {
        let length = duration * request.returns as f64;
        grazing_orbit(scene, orbit, request, &mut |moment| {
            part.reach(moment.time / length);
            record(rows.row(&moment));
        })?;
        return Ok(TimeSeries { parameters, duration, points: Vec::new(), early_end: None });
    }
    let settled = duration * request.settle as f64;
    let length = settled + duration * request.returns as f64;
    let samples = request.returns.saturating_add(request.settle).saturating_mul(request.samples);
    let outcome = returns.sample(frame.state(), length, samples, &mut |moment| {
        part.reach(moment.time / length);
        if request.settle == 0 || moment.time >= settled {
            record(rows.row(&Moment { time: moment.time - settled, ..moment }));
        }
    })?;
    let early_end = EarlyEnd::of(outcome, model);
    Ok(TimeSeries { parameters, duration, points: Vec::new(), early_end })
}

/// Records the grazing orbit period by period, each from the section point, by its own flow: a
/// simulation would leave it at the first graze that rounding turns into a contact.
fn grazing_orbit(
    scene: &Scene,
    orbit: &GrazingOrbit,
    request: &TimeSeriesRequest,
    record: &mut dyn FnMut(Moment<'_, f64>),
) -> Result<(), AnalysisError> {
    let start: Vec<f64> = converted(&orbit.section_point);
    let parameters: Vec<f64> = converted(orbit.parameters());
    let duration = orbit.period.to_f64();
    let passages = orbit.passages_after_section(scene);
    let grazes = |share: f64| passages.iter().find(|passage| passage.share == share);
    let samples = request.samples.max(1);
    let mut shares: Vec<f64> = (0..samples).map(|number| number as f64 / samples as f64).collect();
    shares.extend(passages.iter().map(|passage| passage.share));
    shares.sort_by(f64::total_cmp);
    shares.dedup();
    let flow = PiecewiseFlow::free(scene, &[]);
    let graze = |share: f64| grazes(share).map(|at| (MomentEvent::Minimum, at.surface));
    let mut hand_on = |period: usize, share: f64, state: &[f64], event| {
        record(Moment { time: duration * (period as f64 + share), state, event });
    };
    for period in 0..request.returns {
        let (mut state, mut reached) = (start.clone(), 0.0);
        for &share in &shares {
            let flown = duration * (share - reached);
            let (end, events) = match orbit.hits.is_empty() {
                true => (flow.flow(&state, &parameters, flown)?, Vec::new()),
                false => flow.flight(&state, &parameters, flown)?,
            };
            for FlowEvent { time, surface, state, after, meets, .. } in events {
                let resets = meets && after != state;
                let kind = match (meets, resets) {
                    (true, true) => MomentEvent::Impact,
                    (true, false) => MomentEvent::Contact,
                    (false, _) => MomentEvent::Release,
                };
                let there = reached + time / duration;
                hand_on(period, there, &state, Some((kind, surface)));
                if resets {
                    hand_on(period, there, &after, None);
                }
            }
            (state, reached) = (end, share);
            if let Some(passage) = grazes(share) {
                state = converted(&orbit.passages[passage.place].state);
            }
            hand_on(period, share, &state, graze(share));
        }
    }
    hand_on(request.returns, 0.0, &start, graze(0.0));
    Ok(())
}

/// Converts moments of a simulation to rows.
struct Rows<'a> {
    parameters: &'a [f64],
    gaps: Values<f64>,
    surfaces: usize,
    /// Component of the state that is the phase, and its period.
    phase: Option<(usize, f64)>,
}

impl<'a> Rows<'a> {
    fn new(model: &Model, parameters: &'a [f64]) -> Self {
        let events: Vec<_> = model.surfaces.iter().map(|surface| surface.event).collect();
        Self {
            parameters,
            gaps: Values::new(model, &model.graph, &events),
            surfaces: events.len(),
            phase: model.phase.as_ref().map(|phase| (model.states.len(), phase.period.to_f64())),
        }
    }

    fn row(&mut self, moment: &Moment<'_, f64>) -> SeriesPoint {
        let gaps = self.gaps.evaluate(moment.state, self.parameters);
        let gaps = (0..self.surfaces).map(|surface| gaps.get(surface)).collect();
        let mut state = moment.state.to_vec();
        if let Some((place, period)) = self.phase {
            state[place] = state[place].rem_euclid(period);
        }
        SeriesPoint { time: moment.time, state, gaps, event: moment.event }
    }
}
