//! What a sweep asks for, and what it finds at one parameter value.

use std::time::{Duration, Instant};

use super::attractor::Attractor;
use super::data::{DiagramPoint, SweepHeading, one_period};
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
    /// The map's parameters at an offset of the swept one.
    pub(super) fn parameters(&self, map: &dyn SweptMap, offset: f64) -> Vec<f64> {
        let mut parameters = vec![0.0; map.parameters()];
        parameters[self.parameter] = offset;
        parameters
    }

    /// All offsets in the order of a heading.
    pub(super) fn offsets(&self, heading: SweepHeading) -> Vec<f64> {
        let mut offsets = offsets(self.range, self.points);
        if heading == SweepHeading::Down {
            offsets.reverse();
        }
        offsets
    }
}

/// Evenly spaced offsets, increasing; both ends are met exactly.
pub(in crate::analysis) fn offsets([first, last]: [f64; 2], points: usize) -> Vec<f64> {
    let offset = |index: usize| {
        if index + 1 == points && points > 1 {
            return last;
        }
        let share = index as f64 / (points.max(2) - 1) as f64;
        first + share * (last - first)
    };
    (0..points).map(offset).collect()
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

/// Visits some values side by side, as many at a time as the map has lanes; each is a starting
/// state, `None` for the map's own, and a value of the swept parameter.
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
            iterates: made(settled.orbit.end, &request.orbit),
            carried: (settled.orbit.end == OrbitEnd::Completed).then_some(settled.orbit.last),
            time,
        })
        .collect()
}

/// Iterates an orbit made.
pub(in crate::analysis) fn made(end: OrbitEnd, request: &OrbitRequest) -> u64 {
    let count = match end {
        OrbitEnd::Completed => request.transient + request.keep,
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
        values: one_period(map.observe_all(orbit, parameters)),
        kept: orbit.steps.len(),
        period: orbit.period,
        contacts: orbit.contacts_per_period(),
        orbit: name(map, orbit, parameters),
        kept_contacts: kept_contacts(orbit),
        lyapunov: settled.lyapunov,
        end: orbit.end,
        outside: outside(orbit, parameters, &request.window),
    }
}

/// Kept iterates outside the window: beyond a half-width, or reached by a passage deeper than the
/// window's; all of them where the parameter is beyond its own.
pub(in crate::analysis) fn outside(
    orbit: &MapOrbit,
    parameters: &[f64],
    window: &MapWindow,
) -> usize {
    let kept = orbit.states().zip(&orbit.steps);
    let outside = kept.filter(|(state, step)| !window.holds(state, parameters, &[step.depth]));
    outside.count()
}

/// Contacts over all kept iterates.
pub(in crate::analysis) fn kept_contacts(orbit: &MapOrbit) -> u32 {
    orbit.steps.iter().map(StepInfo::contacts).sum()
}

/// The name of a periodic orbit; `None` without a period.
pub(in crate::analysis) fn name(
    map: &dyn SweptMap,
    orbit: &MapOrbit,
    parameters: &[f64],
) -> Option<OrbitName> {
    match orbit.period {
        Period::Periodic(period) => {
            // The orbit holds its period twice, so that there is a next state.
            let hits = (0..period).map(|number| map.hits(orbit, number, parameters));
            Some(map.itinerary().name(hits))
        }
        Period::NotFound => None,
    }
}
