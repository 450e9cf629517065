//! Sweeps at one parameter value: requests, starts of orbits (at states named by a scene, spread
//! over the window, or beside a fixed point), results, and comparison of attractors.
//!
//! One idea: only attracting orbits are shown. A repelling fixed point is also fixed in floating
//! point, so no orbit starts exactly on it, and an orbit found to be repelling is displaced and
//! followed once more.

use crate::numeric::low_discrepancy;
use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::data::{DiagramPoint, Shares, SweepHeading, one_period};
use super::swept_map::{Settled, Start, SweptMap};
use crate::analysis::error::{AnalysisError, coordinate_place};
use crate::expansion::{LocalMap, MapWindow};
use crate::iteration::{
    MapOrbit, OrbitEnd, OrbitName, OrbitRequest, Period, PhaseCircle, StepInfo,
    periodic_lyapunov_exponent,
};
use crate::model::{Scene, Starts};

/// Request of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRequest {
    /// Index of the swept parameter among the map's parameters; the others stay at 0.
    pub parameter: usize,
    /// Offsets of the swept parameter, increasing.
    pub offsets: Vec<f64>,
    /// Start states, one sweep for each; empty for one sweep that starts beside the map's own
    /// start.
    pub starts: Vec<Vec<f64>>,
    /// Iterates at each value, and escape bounds.
    pub orbit: OrbitRequest,
    /// Window in which the map is trusted; iterates outside are counted.
    pub window: MapWindow,
}

impl SweepRequest {
    /// Parameters of the map at an offset of the swept one.
    pub(super) fn parameters(&self, map: &dyn SweptMap, offset: f64) -> Vec<f64> {
        let mut parameters = vec![0.0; map.parameters()];
        parameters[self.parameter] = offset;
        parameters
    }

    /// All offsets in the order of a heading.
    pub(super) fn offsets(&self, heading: SweepHeading) -> Vec<f64> {
        let mut offsets = self.offsets.clone();
        if heading == SweepHeading::Down {
            offsets.reverse();
        }
        offsets
    }
}

/// Distance from a fixed point at which an orbit starts, in half-widths of the window: below the
/// tolerance of periods, so that no transient is needed if the fixed point attracts.
const BESIDE: f64 = 1e-9;

/// Displacement of an orbit off a repelling period, in half-widths.
const KICK: f64 = 1e-3;

/// Magnitude of a multiplier above which a period repels; the margin above 1 is for rounding.
const REPELLING: f64 = 1.0 + 1e-6;

/// Start states of a scene, as offsets of the section's coordinates; empty if orbits start beside
/// the fixed point of `P_smooth`.
///
/// # Errors
///
/// [`AnalysisError::NotACoordinate`] for a component that is no coordinate of the section,
/// [`AnalysisError::NoWidth`] if starts are to be spread over a window without bound.
pub(in crate::analysis) fn states(
    starts: &Starts,
    scene: &Scene,
    map: &LocalMap,
) -> Result<Vec<Vec<f64>>, AnalysisError> {
    let coordinates = &map.section.coordinates;
    match starts {
        Starts::Smooth => Ok(Vec::new()),
        Starts::Given(states) => {
            let names = scene.model.full_state_names();
            let offsets = |state: &Vec<Option<f64>>| {
                let mut offsets = vec![0.0; coordinates.len()];
                for (name, offset) in names.iter().zip(state) {
                    let Some(offset) = offset else { continue };
                    offsets[coordinate_place(map, name)?] = *offset;
                }
                Ok(offsets)
            };
            states.iter().map(offsets).collect()
        }
        Starts::Spread(count) => {
            let widths = &map.window.state;
            if let Some(unbounded) = widths.iter().position(|width| !width.is_finite()) {
                return Err(AnalysisError::NoWidth { name: coordinates[unbounded].clone() });
            }
            let spread = |number: usize| {
                let shares = low_discrepancy(number, widths.len()).into_iter().zip(widths);
                shares.map(|(share, width)| width * (2.0 * share - 1.0)).collect()
            };
            Ok((0..*count).map(spread).collect())
        }
    }
}

/// Start of an orbit.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::analysis) struct Entry {
    /// All parameters of the map.
    pub(in crate::analysis) parameters: Vec<f64>,
    /// State carried over from the value before, which is tried first.
    pub(in crate::analysis) carried: Option<Vec<f64>>,
}

/// Start states of an orbit within a reach: the state given, or both sides of the map's own start;
/// or states about the section's origin, where contact begins.
pub(super) fn starts(
    map: &dyn SweptMap,
    given: Option<&[f64]>,
    parameters: &[f64],
    scales: &[f64],
    reach: Reach,
) -> Vec<Vec<f64>> {
    match (given, reach) {
        (Some(state), Reach::Beside) => vec![state.to_vec()],
        (Some(_), Reach::Around) => Vec::new(),
        (None, Reach::Beside) => beside(&map.start(parameters), scales, BESIDE).into(),
        (None, Reach::Around) => AROUND.iter().flat_map(|&share| around(scales, share)).collect(),
    }
}

/// Region of start states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// States beside the map's start.
    Beside,
    /// States about the section's origin.
    Around,
}

/// Shares of the half-widths within which starts are tried if no orbit from beside the map's start
/// stays.
const AROUND: [f64; 2] = [0.1, 0.01];

/// Number of start states for each share.
const DIRECTIONS: usize = 8;

/// States spread over a share of the half-widths about the section's origin.
fn around(scales: &[f64], share: f64) -> Vec<Vec<f64>> {
    let spread = |number: usize| {
        let shares = low_discrepancy(number, scales.len()).into_iter();
        shares.zip(scales).map(|(x, scale)| share * scale * (2.0 * x - 1.0)).collect()
    };
    (0..DIRECTIONS).map(spread).collect()
}

/// State displaced to both sides by a share of the half-width of every coordinate.
fn beside(state: &[f64], scales: &[f64], share: f64) -> [Vec<f64>; 2] {
    [share, -share].map(|share| {
        let pairs = state.iter().zip(scales);
        pairs.map(|(value, scale)| value + share * scale).collect()
    })
}

/// Attractor of a map at some parameters, and the iterates needed to find it.
#[derive(Clone, Debug)]
pub(in crate::analysis) struct FoundAttractor {
    pub(in crate::analysis) settled: Settled,
    pub(in crate::analysis) iterates: u64,
}

/// A state to start an orbit from.
struct Candidate {
    state: Vec<f64>,
    /// Whether the state was displaced off a repelling period.
    kicked: bool,
}

/// Search for the attractor of one entry.
struct AttractorSearch {
    parameters: Vec<f64>,
    candidates: VecDeque<Candidate>,
    /// Regions of start states that are still to be tried, in order.
    reaches: &'static [Reach],
    found: Option<FoundAttractor>,
}

/// Attractors of a map for several entries, in parallel for at most as many as the map has lanes:
/// the first orbit that stays, started from the carried state or else from the start. An orbit on a
/// repelling period is displaced and followed further. `watch` is told of every step in which an
/// orbit is simulated.
pub(in crate::analysis) fn settle(
    map: &dyn SweptMap,
    entries: Vec<Entry>,
    start: Option<&[f64]>,
    request: &OrbitRequest,
    watch: &dyn Fn(),
) -> Vec<FoundAttractor> {
    let mut searches: Vec<AttractorSearch> =
        entries.into_iter().map(AttractorSearch::new).collect();
    loop {
        let next = |(place, search): (usize, &mut AttractorSearch)| {
            let candidate = search.next(map, start, request)?;
            let parameters = search.parameters.clone();
            Some(((place, candidate.kicked), Start { state: candidate.state, parameters }))
        };
        let next = searches.iter_mut().enumerate().filter_map(next);
        let (places, starts): (Vec<_>, Vec<_>) = next.unzip();
        if starts.is_empty() {
            break;
        }
        let settled = map.settle(&starts, request, watch);
        for ((place, kicked), settled) in places.into_iter().zip(settled) {
            searches[place].take(map, settled, kicked, request);
        }
    }
    searches.into_iter().filter_map(|search| search.found).collect()
}

impl AttractorSearch {
    fn new(entry: Entry) -> Self {
        // A carried state shows where orbits stay.
        let reaches: &[Reach] = match entry.carried {
            Some(_) => &[Reach::Beside],
            None => &[Reach::Beside, Reach::Around],
        };
        let carried = entry.carried.map(|state| Candidate { state, kicked: false });
        Self {
            parameters: entry.parameters,
            candidates: carried.into_iter().collect(),
            reaches,
            found: None,
        }
    }

    /// Next state to try.
    fn next(
        &mut self,
        map: &dyn SweptMap,
        start: Option<&[f64]>,
        request: &OrbitRequest,
    ) -> Option<Candidate> {
        while self.candidates.is_empty()
            && let Some((&reach, rest)) = self.reaches.split_first()
        {
            self.reaches = rest;
            let starts = starts(map, start, &self.parameters, &request.scales, reach).into_iter();
            self.candidates.extend(starts.map(|state| Candidate { state, kicked: false }));
        }
        self.candidates.pop_front()
    }

    /// Processes the orbit of a candidate.
    fn take(&mut self, map: &dyn SweptMap, settled: Settled, kicked: bool, request: &OrbitRequest) {
        let stays = settled.orbit.end == OrbitEnd::Completed;
        if stays && !kicked && repels(map, &settled, &self.parameters) {
            for state in beside(&settled.orbit.last, &request.scales, KICK).into_iter().rev() {
                self.candidates.push_front(Candidate { state, kicked: true });
            }
        } else if stays {
            self.candidates.clear();
            self.reaches = &[];
        }
        let before = self.found.as_ref().map_or(0, |found| found.iterates);
        let iterates = before + made(settled.orbit.end, request);
        self.found = Some(FoundAttractor { settled, iterates });
    }
}

/// Number of iterates of an orbit.
fn made(end: OrbitEnd, request: &OrbitRequest) -> u64 {
    let count = match end {
        OrbitEnd::Completed => request.transient + request.keep,
        OrbitEnd::Escaped { iterate } | OrbitEnd::NoImage { iterate } => iterate,
    };
    count as u64
}

/// Whether an orbit settled on a period with a multiplier outside the unit circle.
fn repels(map: &dyn SweptMap, settled: &Settled, parameters: &[f64]) -> bool {
    let Period::Periodic(period) = settled.orbit.period else { return false };
    let by_multipliers = || periodic_lyapunov_exponent(&*map.at(parameters), &settled.orbit, &[]);
    let exponent = settled.lyapunov.or_else(by_multipliers);
    exponent.is_some_and(|exponent| exponent.value * period as f64 > REPELLING.ln())
}

/// Attractor at one value of a sweep, and the state carried to the next value.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Visit {
    pub(super) point: DiagramPoint,
    pub(super) attractor: AttractorSummary,
    /// Last state; after an escape the state with which the value was entered.
    pub(super) carried: Option<Vec<f64>>,
    pub(super) iterates: u64,
}

impl Visit {
    /// Whether both visits settled on the same attractor, so that the rest of the sweep is the
    /// same.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        let carried = self.attractor.completed || self.carried == other.carried;
        carried && self.attractor.agrees(&other.attractor)
    }
}

/// Visits values in parallel, as many at a time as the map has lanes; each is a carried state, if
/// any, and a value of the swept parameter. If the carried state escapes, the start of the sweep is
/// tried.
pub(super) fn visit(
    map: &dyn SweptMap,
    request: &SweepRequest,
    start: Option<&[f64]>,
    values: Vec<(Option<Vec<f64>>, f64)>,
    watch: &dyn Fn(),
) -> Vec<Visit> {
    let entry = |(carried, offset): &(Option<Vec<f64>>, f64)| Entry {
        parameters: request.parameters(map, *offset),
        carried: carried.clone(),
    };
    let entries = values.iter().map(entry).collect();
    let found = settle(map, entries, start, &request.orbit, watch);
    let visits = found.into_iter().zip(values).map(|(found, (carried, offset))| {
        let (settled, parameters) = (found.settled, request.parameters(map, offset));
        let stayed = settled.orbit.end == OrbitEnd::Completed;
        Visit {
            point: point(map, &parameters, offset, &settled, request),
            attractor: AttractorSummary::of(&settled.orbit),
            iterates: found.iterates,
            carried: if stayed { Some(settled.orbit.last) } else { carried },
        }
    });
    visits.collect()
}

fn point(
    map: &dyn SweptMap,
    parameters: &[f64],
    offset: f64,
    settled: &Settled,
    request: &SweepRequest,
) -> DiagramPoint {
    let orbit = &settled.orbit;
    let Shares { by_map, outside } = Shares::of(map.method(), orbit, parameters, &request.window);
    DiagramPoint {
        offset,
        values: one_period(map.observe_all(orbit, parameters)),
        kept: orbit.steps.len(),
        period: nominal_period(map, orbit),
        returns: match orbit.period {
            Period::Periodic(returns) => Some(returns),
            Period::NotFound => None,
        },
        contacts: orbit.contacts_per_period(),
        orbit: name(map, orbit, parameters),
        kept_contacts: kept_contacts(orbit),
        lyapunov: settled.lyapunov.map(|exponent| exponent.value),
        lyapunov_error: settled.lyapunov.and_then(|exponent| exponent.error),
        end: orbit.end,
        by_map,
        outside,
    }
}

/// Number of passages with contact over all steps of an orbit.
pub(in crate::analysis) fn kept_contacts(orbit: &MapOrbit) -> u32 {
    orbit.steps.iter().map(StepInfo::contacts).sum()
}

/// Period of an orbit in nominal returns, whatever its number of returns to the section.
pub(in crate::analysis) fn nominal_period(map: &dyn SweptMap, orbit: &MapOrbit) -> Period {
    match orbit.period {
        Period::Periodic(returns) => {
            let itinerary = map.itinerary();
            let periods = itinerary.periods_of(returns, orbit.turns());
            Period::Periodic(itinerary.nominal_returns(periods))
        }
        Period::NotFound => Period::NotFound,
    }
}

/// Name of a periodic orbit; `None` without a period.
pub(in crate::analysis) fn name(
    map: &dyn SweptMap,
    orbit: &MapOrbit,
    parameters: &[f64],
) -> Option<OrbitName> {
    match orbit.period {
        Period::Periodic(period) => {
            // Two periods of the orbit were kept, so that a next state exists.
            let hits = (0..period).map(|number| map.hits(orbit, number, parameters));
            Some(map.itinerary().name(hits, orbit.turns()))
        }
        Period::NotFound => None,
    }
}

/// Largest relative difference of the extents of orbits without a period that count as equal: the
/// extent of a chaotic attractor varies that much from run to run.
const CHAOTIC: f64 = 0.2;
/// Largest difference of the extents of equal periodic orbits, relative to their size: an orbit may
/// still converge.
const PERIODIC: f64 = 1e-6;

/// Summary of an orbit for comparing attractors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct AttractorSummary {
    pub(super) completed: bool,
    period: Period,
    /// Smallest and largest value of every coordinate.
    extent: Vec<[f64; 2]>,
    /// Phase as one of the coordinates, if any.
    circle: PhaseCircle,
}

impl AttractorSummary {
    pub(super) fn of(orbit: &MapOrbit) -> Self {
        Self {
            completed: orbit.end == OrbitEnd::Completed,
            period: orbit.period,
            extent: orbit.extent(),
            circle: orbit.circle(),
        }
    }

    /// Whether both ended early; or have the same period and extent; or have no period and about
    /// the same extent.
    ///
    /// A false no makes a sweep do work twice; a false yes needs two attractors of the same period
    /// and extent.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        if self.completed != other.completed || !self.completed {
            return self.completed == other.completed;
        }
        let alike = |(place, (a, b)): (usize, (&[f64; 2], &[f64; 2]))| {
            let allowed = match self.period {
                Period::Periodic(_) => PERIODIC * a[0].abs().max(a[1].abs()),
                Period::NotFound => CHAOTIC * (a[1] - a[0]),
            };
            let ends = [0, 1].map(|end| self.circle.shortest(place, a[end] - b[end]).abs());
            a == b || ends[0].max(ends[1]) <= allowed
        };
        let mut extents = self.extent.iter().zip(&other.extent).enumerate();
        self.period == other.period && extents.all(alike)
    }
}

/// Whether two orbits settled on the same attractor, by [`AttractorSummary::agrees`].
pub(in crate::analysis) fn agree(a: &MapOrbit, b: &MapOrbit) -> bool {
    AttractorSummary::of(a).agrees(&AttractorSummary::of(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attractor(period: Period, extent: [f64; 2]) -> AttractorSummary {
        let circle = PhaseCircle::none();
        AttractorSummary { completed: true, period, extent: vec![extent], circle }
    }

    #[test]
    fn periodic_orbits_agree_closely_and_chaotic_ones_roughly() {
        let periodic = |extent| attractor(Period::Periodic(2), extent);
        let chaotic = |extent| attractor(Period::NotFound, extent);
        assert!(periodic([1.0, 2.0]).agrees(&periodic([1.0, 2.000_000_1])));
        assert!(!periodic([1.0, 2.0]).agrees(&periodic([1.0, 2.1])));
        assert!(chaotic([1.0, 2.0]).agrees(&chaotic([0.9, 2.1])));
        assert!(!chaotic([1.0, 2.0]).agrees(&chaotic([1.0, 3.0])));
        assert!(!chaotic([1.0, 2.0]).agrees(&periodic([1.0, 2.0])));
        let ended = AttractorSummary { completed: false, ..chaotic([1.0, 2.0]) };
        assert!(!ended.agrees(&chaotic([1.0, 2.0])) && ended.agrees(&ended));
    }
}
