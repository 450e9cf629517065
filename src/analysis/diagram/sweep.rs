//! What a sweep asks for, and what it finds at one parameter value.

use std::time::{Duration, Instant};

use super::attractor::Attractor;
use super::data::{DiagramPoint, SweepHeading};
use super::{Settled, Start, SweptMap};
use crate::expansion::MapWindow;
use crate::iteration::{MapOrbit, OrbitEnd, OrbitName, OrbitRequest, Period, StepInfo};

/// What is asked of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRequest {
    /// Position of the swept parameter among the map's parameters; the others stay at 0.
    pub parameter: usize,
    /// First and last offset, increasing.
    pub range: [f64; 2],
    /// Number of parameter values.
    pub points: usize,
    /// Iterates at each value, and when an orbit has escaped.
    pub orbit: OrbitRequest,
    /// The window, to count iterates outside.
    pub window: MapWindow,
}

impl SweepRequest {
    /// Offset number `index` of the sweep, counted upwards; both ends are met exactly.
    fn offset(&self, index: usize) -> f64 {
        let [first, last] = self.range;
        if index + 1 == self.points && self.points > 1 {
            return last;
        }
        let share = index as f64 / (self.points.max(2) - 1) as f64;
        first + share * (last - first)
    }

    /// The map's parameters at an offset of the swept one.
    pub(super) fn parameters(&self, map: &dyn SweptMap, offset: f64) -> Vec<f64> {
        let mut parameters = vec![0.0; map.parameters()];
        parameters[self.parameter] = offset;
        parameters
    }

    /// All offsets in the order of a heading.
    pub(super) fn offsets(&self, heading: SweepHeading) -> Vec<f64> {
        let upwards = (0..self.points).map(|index| self.offset(index));
        match heading {
            SweepHeading::Up => upwards.collect(),
            SweepHeading::Down => upwards.rev().collect(),
        }
    }
}

/// What a map settles on at one value, and where the next one starts.
#[derive(Clone, Debug)]
pub(super) struct Visit {
    pub(super) point: DiagramPoint,
    pub(super) attractor: Attractor,
    /// The last state; `None` after an escape.
    pub(super) carried: Option<Vec<f64>>,
    pub(super) iterates: u64,
    pub(super) time: Duration,
}

/// Visits some values side by side, as many at a time as the map has lanes; each is a starting state, `None` for the map's own, and a
/// value of the swept parameter.
pub(super) fn visit(
    map: &dyn SweptMap,
    request: &SweepRequest,
    values: &[(Option<Vec<f64>>, f64)],
) -> Vec<Visit> {
    let start = |(state, offset): &(Option<Vec<f64>>, f64)| {
        let parameters = request.parameters(map, *offset);
        let state = state.clone().unwrap_or_else(|| map.start(&parameters));
        Start { state, parameters }
    };
    let clock = Instant::now();
    let starts: Vec<Start> = values.iter().map(start).collect();
    let settled = map.settle(&starts, &request.orbit);
    let time = clock.elapsed() / values.len().max(1) as u32;
    let settled = settled.into_iter().zip(&starts).zip(values);
    settled
        .map(|((settled, start), &(_, offset))| Visit {
            point: point(map, &start.parameters, offset, &settled, request),
            attractor: Attractor::of(&settled.orbit),
            iterates: made(&settled.orbit, request),
            carried: (settled.orbit.end == OrbitEnd::Completed).then_some(settled.orbit.last),
            time,
        })
        .collect()
}

/// Iterates an orbit made.
fn made(orbit: &MapOrbit, request: &SweepRequest) -> u64 {
    let count = match orbit.end {
        OrbitEnd::Completed => request.orbit.transient + request.orbit.keep,
        OrbitEnd::Escaped { iterate } | OrbitEnd::NoImage { iterate } => iterate,
    };
    count as u64
}

fn point(
    map: &dyn SweptMap,
    parameters: &[f64],
    offset: f64,
    settled: &Settled,
    request: &SweepRequest,
) -> DiagramPoint {
    let orbit = &settled.orbit;
    DiagramPoint {
        offset,
        values: map.observe_all(orbit, parameters),
        period: orbit.period,
        contacts: orbit.contacts_per_period(),
        orbit: name(map, orbit, parameters),
        kept_contacts: orbit.steps.iter().map(StepInfo::contacts).sum(),
        lyapunov: settled.lyapunov,
        end: orbit.end,
        outside: outside(orbit, parameters, request),
    }
}

/// Kept iterates outside the window: beyond a half-width, or reached by a passage deeper than the window's; all of them where
/// the parameter is beyond its own.
fn outside(orbit: &MapOrbit, parameters: &[f64], request: &SweepRequest) -> usize {
    let kept = orbit.states().zip(&orbit.steps);
    let outside =
        kept.filter(|(state, step)| !request.window.holds(state, parameters, &[step.depth]));
    outside.count()
}

/// The name of a periodic orbit; `None` without a period.
fn name(map: &dyn SweptMap, orbit: &MapOrbit, parameters: &[f64]) -> Option<OrbitName> {
    match orbit.period {
        Period::Periodic(period) => {
            // The orbit holds its period twice, so that there is a next state.
            let hits = (0..period).map(|number| map.hits(orbit, number, parameters));
            Some(map.itinerary().name(hits))
        }
        Period::NotFound => None,
    }
}
