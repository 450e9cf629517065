//! What a sweep asks for, what it finds at one parameter value, and whether two runs have settled
//! on the same thing.

use serde::{Deserialize, Serialize};

use super::data::{DiagramPoint, Shares, SweepHeading, one_period};
use super::starts::{Entry, settle};
use super::swept_map::{Settled, SweptMap};
use crate::expansion::MapWindow;
use crate::iteration::{MapOrbit, OrbitEnd, OrbitName, OrbitRequest, Period, StepInfo};

/// What is asked of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRequest {
    /// Position of the swept parameter among the map's parameters; the others stay at 0.
    pub parameter: usize,
    /// Offsets of the swept parameter, increasing.
    pub offsets: Vec<f64>,
    /// States at which sweeps start, a sweep for each; none for one sweep that starts beside the
    /// map's own start.
    pub starts: Vec<Vec<f64>>,
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
        let mut offsets = self.offsets.clone();
        if heading == SweepHeading::Down {
            offsets.reverse();
        }
        offsets
    }
}

/// What a map settles on at one value, and where the next one starts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Visit {
    pub(super) point: DiagramPoint,
    pub(super) attractor: Attractor,
    /// The last state, after an escape that with which the value was entered.
    pub(super) carried: Option<Vec<f64>>,
    pub(super) iterates: u64,
}

impl Visit {
    /// Whether both settled on the same, so that what follows is the same.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        let carried = self.attractor.completed || self.carried == other.carried;
        carried && self.attractor.agrees(&other.attractor)
    }
}

/// Visits some values side by side, as many at a time as the map has lanes; each is a state that is
/// carried there, if any, and a value of the swept parameter. Where the carried state escapes, the
/// start of the sweep is tried.
pub(super) fn visit(
    map: &dyn SweptMap,
    request: &SweepRequest,
    start: Option<&[f64]>,
    values: Vec<(Option<Vec<f64>>, f64)>,
) -> Vec<Visit> {
    let entry = |(carried, offset): &(Option<Vec<f64>>, f64)| Entry {
        parameters: request.parameters(map, *offset),
        carried: carried.clone(),
    };
    let found = settle(map, values.iter().map(entry).collect(), start, &request.orbit);
    let visits = found.into_iter().zip(values).map(|(found, (carried, offset))| {
        let (settled, parameters) = (found.settled, request.parameters(map, offset));
        let stayed = settled.orbit.end == OrbitEnd::Completed;
        Visit {
            point: point(map, &parameters, offset, &settled, request),
            attractor: Attractor::of(&settled.orbit),
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
        period: orbit.period,
        contacts: orbit.contacts_per_period(),
        orbit: name(map, orbit, parameters),
        kept_contacts: kept_contacts(orbit),
        lyapunov: settled.lyapunov,
        end: orbit.end,
        by_map,
        outside,
    }
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

/// Extent of an orbit without a period may differ by this part of itself: how far that of a chaotic
/// attractor wanders from run to run.
const CHAOTIC: f64 = 0.2;
/// Extent of a periodic orbit may differ by this part of its size: it may still approach.
const PERIODIC: f64 = 1e-6;

/// What is remembered of an orbit for telling attractors apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Attractor {
    pub(super) completed: bool,
    period: Period,
    /// Least and greatest value of every coordinate.
    extent: Vec<[f64; 2]>,
}

impl Attractor {
    pub(super) fn of(orbit: &MapOrbit) -> Self {
        Self {
            completed: orbit.end == OrbitEnd::Completed,
            period: orbit.period,
            extent: orbit.extent(),
        }
    }

    /// Whether both ended alike: early; with one period and extent; or without a period, over much
    /// the same extent.
    ///
    /// Where it errs by saying no, a sweep does work twice; saying yes of two attractors takes two
    /// of one period and extent.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        if self.completed != other.completed || !self.completed {
            return self.completed == other.completed;
        }
        let alike = |(a, b): (&[f64; 2], &[f64; 2])| {
            let allowed = match self.period {
                Period::Periodic(_) => PERIODIC * a[0].abs().max(a[1].abs()),
                Period::NotFound => CHAOTIC * (a[1] - a[0]),
            };
            a == b || (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) <= allowed
        };
        self.period == other.period && self.extent.iter().zip(&other.extent).all(alike)
    }
}

/// Whether two orbits settled on the same, by the same measure.
pub(in crate::analysis) fn agree(a: &MapOrbit, b: &MapOrbit) -> bool {
    Attractor::of(a).agrees(&Attractor::of(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attractor(period: Period, extent: [f64; 2]) -> Attractor {
        Attractor { completed: true, period, extent: vec![extent] }
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
        let ended = Attractor { completed: false, ..chaotic([1.0, 2.0]) };
        assert!(!ended.agrees(&chaotic([1.0, 2.0])) && ended.agrees(&ended));
    }
}
