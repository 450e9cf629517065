//! Cells of a chart: starts, attractors, and the choice of cells to compute.

use std::collections::HashMap;

use super::data::{ChartAttractor, ChartAxis, ChartCell, ChartClass};
use crate::analysis::basin::are_one_cycle;
use crate::analysis::diagram::{
    Entry, Settled, Shares, Start, SweptMap, agree, exponent, kept_contacts, name, nominal_period,
    settle,
};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{MOST_ITERATES, PartProgress, Progress, Shard, given, resumed_if};
use crate::analysis::refinement::{BlockProbes, Tiles, refine, refine_share};
use crate::expansion::MapWindow;
use crate::iteration::parallel;
use crate::iteration::{OrbitEnd, OrbitRequest, Period};
use crate::model::{ChartObservable, ChartRequest};

/// Factor by which an orbit without a period is followed longer where attractors are compared.
const LONGER: usize = 8;

/// Attractors of a cell, and the iterates needed to find them.
type CellFound = (Vec<ChartAttractor>, u64);
/// Cells already computed, by index.
type KnownCells = HashMap<usize, CellFound>;

/// Whether a cell has an attractor, as every computed cell has, and a possible number of iterates.
fn is_found((attractors, iterates): &CellFound) -> bool {
    !attractors.is_empty() && *iterates < MOST_ITERATES
}

/// The cells of a chart.
pub(super) struct ChartGrid<'a> {
    pub(super) map: &'a dyn SweptMap,
    pub(super) axes: &'a [ChartAxis; 2],
    /// Indices of the axes' parameters among the map's; the others stay at 0.
    pub(super) places: [usize; 2],
    pub(super) orbit: OrbitRequest,
    pub(super) window: &'a MapWindow,
    /// Start states of every cell; `None` for the map's own start.
    pub(super) starts: &'a [Option<Vec<f64>>],
    pub(super) request: &'a ChartRequest,
}

impl ChartGrid<'_> {
    /// All cells, the probes of those filled, and the iterates needed; cells found by shares are
    /// not computed again.
    pub(super) fn cells(&self, progress: &dyn Progress) -> (Vec<ChartCell>, BlockProbes, u64) {
        let size = self.size();
        let known = given::<Vec<(usize, CellFound)>>(progress).flatten();
        let known: KnownCells = known.filter(|(_, found)| is_found(found)).collect();
        let (mut round, mut iterates) = (0, 0);
        let mut compute = |wanted: &[usize]| {
            let found = self.round(round, wanted, &known, progress);
            round += 1;
            iterates += found.iter().map(|(_, made)| made).sum::<u64>();
            found.into_iter().map(|(attractors, _)| cell(attractors)).collect::<Vec<_>>()
        };
        let (cells, probes) = if self.computes_all() {
            (compute(&Vec::from_iter(0..size[0] * size[1])), BlockProbes::default())
        } else {
            let refined = refine(size, |a, b| self.are_alike(a, b), compute);
            let probes = refined.probes();
            let cells = refined.into_cells(|mut cell| {
                cell.computed = false;
                let attractors = std::iter::once(&mut cell.attractor).chain(&mut cell.others);
                attractors.for_each(|one| (one.lyapunov, one.lyapunov_error) = (None, None));
                cell
            });
            (cells, probes)
        };
        (cells, probes, iterates)
    }

    /// Computes a share of the cells.
    pub(super) fn share(&self, shard: &Shard<'_>) {
        let (size, mut round, mut all) = (self.size(), 0, Vec::new());
        let mut compute = |wanted: &[usize]| {
            let found = self.round(round, wanted, &KnownCells::new(), shard.own);
            round += 1;
            let cells = found.iter().map(|(attractors, _)| cell(attractors.clone())).collect();
            all.extend(wanted.iter().copied().zip(found));
            cells
        };
        if self.computes_all() {
            let _cells: Vec<_> = compute(&Tiles::of(size).cells(shard.share));
        } else {
            refine_share(size, Some(shard.share), |a, b| self.are_alike(a, b), compute);
        }
        shard.give(&all);
    }

    /// Numbers of columns and rows.
    fn size(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.axes[axis].offsets.len())
    }

    /// Whether all cells are computed: exponents have no borders.
    fn computes_all(&self) -> bool {
        self.request.every_cell || self.request.observe == ChartObservable::Lyapunov
    }

    /// Whether two cells have the same attractors, by their classes and itineraries.
    fn are_alike(&self, a: &ChartCell, b: &ChartCell) -> bool {
        let classes = |cell: &ChartCell| {
            let mut classes: Vec<_> = cell.attractors().map(|one| self.class(one)).collect();
            classes.sort_unstable();
            classes
        };
        let itineraries = |cell: &ChartCell| {
            let named = cell.attractors().filter_map(|one| one.itinerary.as_ref());
            let mut named: Vec<String> = named.map(ToString::to_string).collect();
            named.sort_unstable();
            named
        };
        classes(a) == classes(b) && itineraries(a) == itineraries(b)
    }

    fn class(&self, attractor: &ChartAttractor) -> ChartClass {
        ChartClass::of(self.map.method(), attractor)
    }

    /// Attractors of `wanted` cells, as many at a time as the map has lanes, on all cores.
    fn round(
        &self,
        round: u64,
        wanted: &[usize],
        known: &KnownCells,
        progress: &dyn Progress,
    ) -> Vec<CellFound> {
        PartProgress::announce(progress, wanted.len());
        let lanes = self.map.lanes();
        let block = |(number, cells): (usize, &[usize])| {
            // NOTE: blocks have other lengths on another device.
            let place = [round, number as u64, lanes as u64];
            let part = PartProgress::new(progress, cells.len());
            let fits =
                |found: &Vec<CellFound>| found.len() == cells.len() && found.iter().all(is_found);
            resumed_if(progress, &place, fits, || self.block_but(cells, known, &part))
        };
        parallel::map(wanted.chunks(lanes).enumerate(), block).into_iter().flatten().collect()
    }

    /// Attractors of cells, of which some are known.
    fn block_but(
        &self,
        cells: &[usize],
        known: &KnownCells,
        progress: &dyn Progress,
    ) -> Vec<CellFound> {
        let others: Vec<usize> =
            cells.iter().copied().filter(|cell| !known.contains_key(cell)).collect();
        let mut others = self.block(&others, progress).into_iter();
        let found = |cell| known.get(cell).cloned().or_else(|| others.next());
        cells.iter().filter_map(found).collect()
    }

    /// Attractors of cells, and the iterates needed.
    fn block(&self, cells: &[usize], progress: &dyn Progress) -> Vec<CellFound> {
        if cells.is_empty() {
            return Vec::new();
        }
        let entries: Vec<Entry> = cells.iter().map(|&cell| self.entry(cell)).collect();
        let mut known: Vec<(Vec<Settled>, u64)> = vec![(Vec::new(), 0); cells.len()];
        let returns = self.orbit.transient + self.orbit.keep;
        progress.expect((self.starts.len() * returns) as u64);
        let watch = || progress.advance(1);
        for start in self.starts {
            let found = settle(self.map, entries.clone(), start.as_deref(), &self.orbit, &watch);
            for ((found, entry), (known, iterates)) in
                found.into_iter().zip(&entries).zip(&mut known)
            {
                *iterates += found.iterates;
                *iterates += self.take(known, found.settled, &entry.parameters);
            }
        }
        let attractors = known.iter().zip(&entries).map(|((known, iterates), entry)| {
            let attractor = |settled| self.attractor(settled, &entry.parameters);
            (known.iter().map(attractor).collect(), *iterates)
        });
        attractors.collect()
    }

    /// Parameters of a cell.
    fn entry(&self, cell: usize) -> Entry {
        let [horizontal, vertical] = self.axes;
        let (row, column) = (cell / horizontal.offsets.len(), cell % horizontal.offsets.len());
        let mut parameters = vec![0.0; self.map.parameters()];
        parameters[self.places[0]] = horizontal.offsets[column];
        parameters[self.places[1]] = vertical.offsets[row];
        Entry { parameters, carried: None }
    }

    /// Adds the attractor that a start of a cell leads to, if it is new; returns the iterates
    /// needed to decide.
    fn take(&self, known: &mut Vec<Settled>, mut settled: Settled, parameters: &[f64]) -> u64 {
        let stays = |settled: &Settled| settled.orbit.end == OrbitEnd::Completed;
        if self.starts.len() == 1 {
            known.push(settled);
            return 0;
        }
        // An orbit that left is no attractor, but represents the cell until one is found.
        known.retain(stays);
        if !stays(&settled) {
            if known.is_empty() {
                known.push(settled);
            }
            return 0;
        }
        let mut iterates = 0;
        let is_known =
            |settled: &Settled| known.iter().any(|other| self.are_one(other, settled, parameters));
        if settled.orbit.period == Period::NotFound && !is_known(&settled) {
            let start = Start { state: settled.orbit.last.clone(), parameters: parameters.into() };
            let longer = self.orbit.longer(LONGER);
            iterates = (longer.transient + longer.keep) as u64;
            settled = self.map.settle(&[start], &longer, &|| ()).remove(0);
        }
        let is_new = stays(&settled) && !is_known(&settled);
        if known.is_empty() || is_new && known.len() < self.request.attractors {
            known.push(settled);
        }
        iterates
    }

    /// Whether two orbits settled on one attractor: they have the same extent, or Newton's method
    /// finds the same periodic orbit from both.
    fn are_one(&self, a: &Settled, b: &Settled, parameters: &[f64]) -> bool {
        if agree(&a.orbit, &b.orbit) {
            return true;
        }
        let points = |settled: &Settled| match settled.orbit.period {
            Period::Periodic(period) => {
                Some(settled.orbit.states().take(period).map(<[f64]>::to_vec).collect::<Vec<_>>())
            }
            Period::NotFound => None,
        };
        let (Some(a), Some(b)) = (points(a), points(b)) else { return false };
        are_one_cycle(&*self.map.at(parameters), [&a, &b], &self.orbit.scales)
    }

    fn attractor(&self, settled: &Settled, parameters: &[f64]) -> ChartAttractor {
        let orbit = &settled.orbit;
        let Shares { by_map, outside } =
            Shares::of(self.map.method(), orbit, parameters, self.window);
        let itinerary = match orbit.period {
            Period::Periodic(period) if self.request.observe == ChartObservable::Itinerary => {
                let returns = orbit.steps.iter().skip(1).take(period).map(|step| step.passages);
                let passages = self.map.itinerary().passages.len();
                Some(ContactItinerary::new(passages, returns.collect()).largest_rotation().0)
            }
            _ => None,
        };
        let simulated = || {
            let shown = self.request.observe == ChartObservable::Lyapunov;
            let follows = shown && orbit.end == OrbitEnd::Completed;
            follows.then(|| exponent(&*self.map.at(parameters), orbit, &self.orbit)).flatten()
        };
        let lyapunov = settled.lyapunov.or_else(simulated);
        ChartAttractor {
            period: nominal_period(self.map, orbit),
            converging: orbit.converges,
            itinerary,
            orbit: name(self.map, orbit, parameters),
            kept_contacts: kept_contacts(orbit),
            lyapunov: lyapunov.map(|exponent| exponent.value),
            lyapunov_error: lyapunov.and_then(|exponent| exponent.error),
            end: orbit.end,
            by_map,
            outside,
        }
    }
}

/// Cell with the attractors computed for it.
fn cell(mut attractors: Vec<ChartAttractor>) -> ChartCell {
    ChartCell { attractor: attractors.remove(0), others: attractors, computed: true }
}
