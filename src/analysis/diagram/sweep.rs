//! One sweep: parameter values in order, the last state carried along.

use std::time::{Duration, Instant};

use super::SweptMap;
use super::data::{DiagramPoint, Sweep, SweepHeading, Timing};
use crate::analysis::Progress;
use crate::expansion::MapWindow;
use crate::iteration::{
    DiscreteMap, MapOrbit, OrbitEnd, OrbitName, OrbitRequest, Period, StepInfo,
    largest_lyapunov_exponent,
};

/// Iterates in which the tangent vector of a Lyapunov exponent turns to its direction.
const TANGENT_TRANSIENT: usize = 20;

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

    /// All offsets in the order of a heading.
    fn offsets(&self, heading: SweepHeading) -> Vec<f64> {
        let upwards = (0..self.points).map(|index| self.offset(index));
        match heading {
            SweepHeading::Up => upwards.collect(),
            SweepHeading::Down => upwards.rev().collect(),
        }
    }
}

/// Runs one sweep, from the map's start at its first parameter value.
pub(super) fn sweep(
    map: &dyn SweptMap,
    request: &SweepRequest,
    heading: SweepHeading,
    progress: &dyn Progress,
) -> Sweep {
    let start = Instant::now();
    let mut iterating = Duration::ZERO;
    let mut iterates = 0;
    let mut carried = None;
    let mut parameters = vec![0.0; map.parameters()];
    let mut points = Vec::with_capacity(request.points);
    for offset in request.offsets(heading) {
        parameters[request.parameter] = offset;
        let clock = Instant::now();
        let fixed = map.at(&parameters);
        let state = carried.unwrap_or_else(|| map.start(&parameters));
        let orbit = MapOrbit::of(&*fixed, &state, &[], &request.orbit);
        iterating += clock.elapsed();
        iterates += made(&orbit, request);
        points.push(point(map, &*fixed, &parameters, offset, &orbit, request));
        carried = (orbit.end == OrbitEnd::Completed).then_some(orbit.last);
        progress.advance(1);
    }
    Sweep {
        method: map.method(),
        heading,
        points,
        timing: Timing {
            iterates,
            seconds: iterating.as_secs_f64(),
            total_seconds: start.elapsed().as_secs_f64(),
        },
    }
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
    fixed: &dyn DiscreteMap,
    parameters: &[f64],
    offset: f64,
    orbit: &MapOrbit,
    request: &SweepRequest,
) -> DiagramPoint {
    DiagramPoint {
        offset,
        values: orbit
            .states()
            .map(|state| map.observe(state, parameters))
            .collect(),
        period: orbit.period,
        contacts: orbit.contacts_per_period(),
        orbit: name(map, orbit, parameters),
        kept_contacts: orbit.steps.iter().map(StepInfo::contacts).sum(),
        lyapunov: lyapunov(map, fixed, orbit, request),
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
            let returns = orbit.states().take(period);
            let hits = returns.map(|state| map.hits(state, parameters));
            Some(map.itinerary().name(hits))
        }
        Period::NotFound => None,
    }
}

/// The largest Lyapunov exponent over as many iterates as were kept, onwards from the orbit's end.
fn lyapunov(
    map: &dyn SweptMap,
    fixed: &dyn DiscreteMap,
    orbit: &MapOrbit,
    request: &SweepRequest,
) -> Option<f64> {
    if !map.has_jacobian() || orbit.end != OrbitEnd::Completed {
        return None;
    }
    largest_lyapunov_exponent(
        fixed,
        &orbit.last,
        &[],
        TANGENT_TRANSIENT,
        request.orbit.keep,
    )
}
