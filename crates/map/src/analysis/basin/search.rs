//! Search for the attractors of a map at fixed parameters, while states are followed to their
//! destinations.
//!
//! One idea: attractors are found, not given. A state that reaches no known attractor is followed
//! until it settles, and the attractor found is known from then on. States are taken in rounds: the
//! states of a round are followed in parallel against the attractors known at its beginning, and
//! the findings are then added in the order of the states, so that results do not depend on the
//! number of cores.

use std::collections::HashMap;
use std::mem;

use serde::{Deserialize, Serialize};

use super::known::{Cells, Cycle};
use super::{Attractor, BasinClass};
use crate::analysis::diagram::{SideBySide, SweptMap, name, nominal_period};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{NoProgress, PartProgress, Progress, Shard, resumed_if};
use crate::expansion::MapWindow;
use crate::iteration::parallel;
use crate::iteration::{
    DiscreteMap, MapOrbit, OrbitEnd, OrbitRequest, Period, largest_lyapunov_exponent,
};
use crate::model::Method;

/// Iterates between two tests for known attractors.
const CHUNK: usize = 16;
/// Consecutive states in the cells of an attractor from which on an orbit counts as on it.
const STAYED: usize = 3 * CHUNK;
/// States of the first round, growth factor of a round, and states of the largest round.
const FIRST_ROUND: usize = 48;
const ROUND_GROWTH: usize = 8;
const LARGEST_ROUND: usize = 1 << 16;
/// Rounds that every share of a grid computes, in order to know the attractors.
const ROUNDS_OF_ALL: usize = 2;
/// States that one thread follows at a time: enough to make the cost of preparation small.
const BLOCK: usize = 256;

/// Largest distance, in scales, between a settled orbit and a known periodic orbit for them to
/// count as one: with both refined by Newton's method, and otherwise.
const SETTLED: f64 = 1e-6;
const SETTLED_ROUGHLY: f64 = 1e-4;
/// Magnitude of the largest multiplier above which an orbit counts as repelling.
const REPELLING: f64 = 1.0 + 1e-6;
/// Displacement off a repelling orbit, in scales, and most displacements of a state.
const KICK: f64 = 1e-6;
const KICKS: usize = 2;
/// Longest period of an orbit that is looked for around states that settle slowly.
const SLOW_PERIODS: usize = 16;
/// Factor by which an orbit without a period is followed longer before it becomes an attractor.
const LONGER: usize = 8;
/// States from which the cells of an attractor without a period are taken, and iterates over which
/// its exponent is.
const COVERING: usize = 1 << 13;
const EXPONENT_ITERATES: usize = 1 << 12;
/// States of an attractor without a period that are kept for output.
const SHOWN: usize = 2000;
/// Fraction of the kept states of an orbit in the cells of an attractor from which on the orbit is
/// on it.
const SHARED: f64 = 0.5;

/// Destination of a state.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Goal {
    Class(BasinClass),
    /// No known attractor: the last states of the orbit, and their period.
    Open {
        states: Vec<f64>,
        period: Period,
    },
}

/// Index and value of a state.
type IndexedState = (usize, Vec<f64>);
/// Findings of a share: the number of attractors known, and the destinations of states by index.
pub(super) type FoundByShare = (usize, Vec<(usize, Followed)>);

/// Positions of `count` states, split into rounds. The first round has states from everywhere, so
/// that it finds most attractors.
fn rounds(count: usize) -> Vec<Vec<usize>> {
    let stride = (count / FIRST_ROUND).max(1);
    let order: Vec<usize> = (0..stride).flat_map(|first| (first..count).step_by(stride)).collect();
    let (mut rest, mut size, mut rounds) = (&order[..], FIRST_ROUND, Vec::new());
    while !rest.is_empty() {
        let (round, others) = rest.split_at(size.min(rest.len()));
        rounds.push(round.to_vec());
        (rest, size) = (others, LARGEST_ROUND.min(ROUND_GROWTH * size));
    }
    rounds
}

/// Destination of a state, and the iterates it took.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Followed {
    goal: Goal,
    iterates: u64,
    /// Number of iterates made by the map.
    mapped: u64,
}

/// An attractor that was found.
#[derive(Clone, Debug)]
enum KnownAttractor {
    Cycle(Cycle),
    /// An attractor without a period: its cells, and the orbit that they are taken from.
    Cells(Cells, MapOrbit),
}

/// Search for the attractors of a map at fixed parameters.
pub(super) struct BasinSearch<'a> {
    pub(super) map: &'a dyn SweptMap,
    pub(super) parameters: &'a [f64],
    pub(super) window: &'a MapWindow,
    /// Iterates before an orbit counts as settled, states kept then, and escape bounds.
    pub(super) request: OrbitRequest,
    pub(super) progress: &'a dyn Progress,
    fixed: Box<dyn DiscreteMap + Send + 'a>,
    known: Vec<KnownAttractor>,
    /// Findings of shares, by the number of attractors known and the index of the state.
    found: HashMap<(usize, usize), Followed>,
    rounds: u64,
    /// Iterates made in rounds, and the number of them made by the map.
    pub(super) iterates: u64,
    pub(super) mapped: u64,
}

impl<'a> BasinSearch<'a> {
    pub(super) fn new(
        map: &'a dyn SweptMap,
        parameters: &'a [f64],
        window: &'a MapWindow,
        request: OrbitRequest,
        progress: &'a dyn Progress,
    ) -> Self {
        let fixed = map.at(parameters);
        Self {
            map,
            parameters,
            window,
            request,
            progress,
            fixed,
            known: Vec::new(),
            found: HashMap::new(),
            rounds: 0,
            iterates: 0,
            mapped: 0,
        }
    }

    /// Adds findings of shares: destinations of states by index, each for a number of known
    /// attractors. Those attractors are the first ones of this search too.
    pub(super) fn with_found(mut self, found: impl Iterator<Item = FoundByShare>) -> Self {
        for (known, found) in found {
            let found = found.into_iter().map(|(number, followed)| ((known, number), followed));
            self.found.extend(found);
        }
        self
    }

    /// Classes of the states with the given indices, in their order.
    pub(super) fn classes(
        &mut self,
        numbers: &[usize],
        state: impl Fn(usize) -> Vec<f64>,
    ) -> Vec<BasinClass> {
        let mut classes = vec![BasinClass::Undecided; numbers.len()];
        for round in rounds(numbers.len()) {
            let starts: Vec<_> =
                round.iter().map(|&place| (numbers[place], state(numbers[place]))).collect();
            for (&place, class) in round.iter().zip(self.round(&starts)) {
                classes[place] = class;
            }
        }
        classes
    }

    /// Follows states in parallel, and adds the attractors found.
    fn round(&mut self, starts: &[IndexedState]) -> Vec<BasinClass> {
        let found = self.followed(starts, self.progress);
        found.into_iter().map(|followed| self.take(followed, KICKS)).collect()
    }

    /// Follows states in parallel, as a round of its own.
    fn followed(&mut self, starts: &[IndexedState], progress: &dyn Progress) -> Vec<Followed> {
        let round = self.rounds;
        self.rounds += 1;
        let block = |(number, starts): (usize, &[IndexedState])| -> Vec<Followed> {
            let place = [round, number as u64];
            let fits = |found: &Vec<Followed>| {
                found.len() == starts.len() && found.iter().all(|followed| self.fits(followed))
            };
            let part = PartProgress::new(progress, starts.len());
            resumed_if(progress, &place, fits, || self.follow_but(starts, &part))
        };
        parallel::map(starts.chunks(BLOCK).enumerate(), block).concat()
    }

    /// Whether a finding read back is consistent: its attractor is known, or its states fit the
    /// map.
    fn fits(&self, followed: &Followed) -> bool {
        match &followed.goal {
            Goal::Class(BasinClass::Attractor(number)) => *number < self.known.len(),
            Goal::Class(_) => true,
            Goal::Open { states, period } => {
                let least = match period {
                    Period::Periodic(period) => *period,
                    Period::NotFound => 1,
                };
                let rows = states.len() / self.dimension();
                states.len().is_multiple_of(self.dimension()) && (1..=rows).contains(&least)
            }
        }
    }

    /// Follows those of the states that no share has followed.
    fn follow_but(&self, starts: &[IndexedState], progress: &dyn Progress) -> Vec<Followed> {
        let known = |number: usize| {
            let found = self.found.get(&(self.known.len(), number));
            found.filter(|followed| self.fits(followed))
        };
        let others = starts.iter().filter(|(number, _)| known(*number).is_none());
        let others: Vec<&[f64]> = others.map(|(_, state)| &state[..]).collect();
        let mut others = self.follow(&others, progress).into_iter();
        let found = |(number, _): &IndexedState| known(*number).cloned().or_else(|| others.next());
        starts.iter().filter_map(found).collect()
    }

    /// Computes a share of the states of a grid that `refine` refines: first the first rounds of
    /// the states asked for first, which find the attractors; then the states that the share's own
    /// tiles need, against those attractors.
    pub(super) fn share(
        &mut self,
        first: &[usize],
        state: impl Fn(usize) -> Vec<f64>,
        refine: impl FnOnce(&mut dyn FnMut(&[usize]) -> Vec<BasinClass>),
        shard: &Shard<'_>,
    ) {
        let starts = |numbers: &mut dyn Iterator<Item = usize>| -> Vec<IndexedState> {
            numbers.map(|number| (number, state(number))).collect()
        };
        let mut classes = HashMap::new();
        // All shares compute the same here; only the first one hands it over.
        let hands_over = shard.share.number() == 1;
        for round in rounds(first.len()).into_iter().take(ROUNDS_OF_ALL) {
            let starts = starts(&mut round.iter().map(|&place| first[place]));
            PartProgress::announce(shard.own, starts.len());
            let progress: &dyn Progress = if hands_over { shard } else { shard.own };
            for ((number, _), followed) in starts.iter().zip(self.followed(&starts, progress)) {
                classes.insert(*number, self.take(followed, KICKS));
            }
        }
        let (known, mut found) = (self.known.len(), Vec::new());
        refine(&mut |wanted| {
            let new = wanted.iter().copied().filter(|number| !classes.contains_key(number));
            let new = starts(&mut new.collect::<Vec<_>>().into_iter());
            PartProgress::announce(shard.own, new.len());
            // New attractors separate cells; they do not end the orbits of other states.
            let more = self.known.split_off(known);
            let followed = self.followed(&new, shard.own);
            self.known.extend(more);
            for ((number, _), followed) in new.iter().zip(followed) {
                classes.insert(*number, self.take(followed.clone(), KICKS));
                found.push((*number, followed));
            }
            wanted.iter().map(|number| classes[number]).collect()
        });
        shard.give(&(known, found));
    }

    /// Follows states, as many at a time as the map has lanes.
    fn follow(&self, starts: &[&[f64]], progress: &dyn Progress) -> Vec<Followed> {
        progress.expect((starts.len() * self.request.transient.max(1)) as u64);
        let mut found = Vec::new();
        self.map.side_by_side(self.parameters, &mut |orbits| {
            found = Follower::new(self, starts).run(orbits, progress);
        });
        found
    }

    /// Class of a state that was followed; a new attractor is known from then on.
    fn take(&mut self, followed: Followed, kicks: usize) -> BasinClass {
        self.iterates += followed.iterates;
        self.mapped += followed.mapped;
        match followed.goal {
            Goal::Class(class) => class,
            Goal::Open { states, period: Period::Periodic(period) } => {
                let points: Vec<Vec<f64>> = self.rows(&states[..period * self.dimension()]);
                self.take_cycle(&points, kicks)
            }
            Goal::Open { states, period: Period::NotFound } => self.take_wanderer(&states, kicks),
        }
    }

    fn dimension(&self) -> usize {
        self.request.scales.len()
    }

    fn rows(&self, states: &[f64]) -> Vec<Vec<f64>> {
        states.chunks_exact(self.dimension()).map(<[f64]>::to_vec).collect()
    }

    /// Class of an orbit that settled on a period.
    fn take_cycle(&mut self, points: &[Vec<f64>], kicks: usize) -> BasinClass {
        if let Some(number) = self.known_cycle(points, true) {
            return BasinClass::Attractor(number);
        }
        let cycle = Cycle::near(&*self.fixed, points, &self.request.scales);
        if cycle.largest_multiplier() > REPELLING {
            return self.take_kicked(&cycle.points[0], kicks);
        }
        BasinClass::Attractor(self.number_of(cycle))
    }

    /// Number of a periodic orbit, known from then on.
    fn number_of(&mut self, cycle: Cycle) -> usize {
        self.known_cycle(&cycle.points, cycle.is_refined())
            .unwrap_or_else(|| self.learn(KnownAttractor::Cycle(cycle)))
    }

    /// Number of the known periodic orbit through the first of some points; `refined` by Newton's
    /// method or not.
    fn known_cycle(&self, points: &[Vec<f64>], refined: bool) -> Option<usize> {
        self.known.iter().position(|known| {
            let KnownAttractor::Cycle(cycle) = known else { return false };
            let both = refined && cycle.is_refined();
            let tolerance = if both { SETTLED } else { SETTLED_ROUGHLY };
            cycle.passes(points, &self.request.scales, tolerance)
        })
    }

    /// Class of a state near a repelling orbit, displaced off it.
    fn take_kicked(&mut self, state: &[f64], kicks: usize) -> BasinClass {
        if kicks == 0 {
            return BasinClass::Undecided;
        }
        let pairs = state.iter().zip(&self.request.scales);
        let beside: Vec<f64> = pairs.map(|(value, scale)| value + KICK * scale).collect();
        let followed = self.follow(&[&beside], &NoProgress).pop();
        followed.map_or(BasinClass::Undecided, |followed| self.take(followed, kicks - 1))
    }

    /// Class of an orbit that has not settled on a period yet.
    fn take_wanderer(&mut self, states: &[f64], kicks: usize) -> BasinClass {
        let rows = self.rows(states);
        let shares = |known: &KnownAttractor| match known {
            KnownAttractor::Cycle(_) => false,
            KnownAttractor::Cells(cells, _) => {
                let held = rows.iter().filter(|state| cells.hold(state)).count();
                held as f64 >= SHARED * rows.len() as f64
            }
        };
        if let Some(number) = self.known.iter().position(shares) {
            return BasinClass::Attractor(number);
        }
        let Some(last) = rows.last() else { return BasinClass::Undecided };
        if let Some(cycle) = self.cycle_around(last, |cycle| cycle.holds(last)) {
            return BasinClass::Attractor(self.number_of(cycle));
        }
        let orbit = MapOrbit::of(&*self.fixed, last, &[], &self.request.longer(LONGER));
        match (orbit.end, orbit.period) {
            (OrbitEnd::Completed, Period::Periodic(period)) => {
                let points: Vec<Vec<f64>> =
                    orbit.states().take(period).map(<[f64]>::to_vec).collect();
                self.take_cycle(&points, kicks)
            }
            (OrbitEnd::Completed, Period::NotFound) => {
                match self.cycle_around(&orbit.last, |cycle| cycle.draws(&orbit)) {
                    Some(cycle) => BasinClass::Attractor(self.number_of(cycle)),
                    None => self.take_attractor(&orbit.last),
                }
            }
            (end, _) => left(end),
        }
    }

    /// Attracting periodic orbit about a state that settles slowly.
    fn cycle_around(&self, state: &[f64], attracts: impl Fn(&Cycle) -> bool) -> Option<Cycle> {
        Cycle::around(&*self.fixed, state, SLOW_PERIODS, &self.request.scales).find(attracts)
    }

    /// Class of an orbit that stays without a period: a new attractor.
    fn take_attractor(&mut self, state: &[f64]) -> BasinClass {
        let request = OrbitRequest { transient: 0, keep: COVERING, ..self.request.clone() };
        let orbit = MapOrbit::of(&*self.fixed, state, &[], &request);
        if orbit.end != OrbitEnd::Completed {
            return left(orbit.end);
        }
        let cells = Cells::of(&orbit, &self.request.scales);
        BasinClass::Attractor(self.learn(KnownAttractor::Cells(cells, orbit)))
    }

    fn learn(&mut self, known: KnownAttractor) -> usize {
        self.known.push(known);
        self.known.len() - 1
    }

    /// Attractors found, in their order.
    pub(super) fn attractors(&self) -> Vec<Attractor> {
        parallel::map(&self.known, |known| self.describe(known))
    }

    fn describe(&self, known: &KnownAttractor) -> Attractor {
        match known {
            KnownAttractor::Cycle(cycle) => self.describe_cycle(cycle),
            KnownAttractor::Cells(_, orbit) => self.describe_wanderer(orbit),
        }
    }

    fn describe_wanderer(&self, orbit: &MapOrbit) -> Attractor {
        let exponent =
            largest_lyapunov_exponent(&*self.fixed, &orbit.last, &[], 0, EXPONENT_ITERATES);
        Attractor {
            period: Period::NotFound,
            itinerary: None,
            orbit: None,
            states: orbit.states().take(SHOWN).map(<[f64]>::to_vec).collect(),
            multipliers: Vec::new(),
            lyapunov: exponent.map(|exponent| exponent.value),
            lyapunov_error: exponent.and_then(|exponent| exponent.error),
        }
    }

    fn describe_cycle(&self, cycle: &Cycle) -> Attractor {
        let period = cycle.points.len();
        let request = OrbitRequest { transient: 0, keep: 2 * period, ..self.request.clone() };
        // Starts from the last point, so that the first state kept is the first point.
        let mut orbit = MapOrbit::of(&*self.fixed, &cycle.points[period - 1], &[], &request);
        orbit.period = Period::Periodic(period);
        let returns = orbit.steps.iter().skip(1).take(period).map(|step| step.passages).collect();
        let passages = self.map.itinerary().passages.len();
        let (itinerary, first) = ContactItinerary::new(passages, returns).largest_rotation();
        let mut states = cycle.points.clone();
        states.rotate_left(first);
        let largest = cycle.largest_multiplier();
        let is_known = cycle.is_refined();
        Attractor {
            period: nominal_period(self.map, &orbit),
            itinerary: Some(itinerary),
            orbit: name(self.map, &orbit, self.parameters),
            states,
            multipliers: cycle.multipliers.iter().map(|value| [value.re, value.im]).collect(),
            lyapunov: is_known.then(|| largest.ln() / period as f64),
            lyapunov_error: None,
        }
    }
}

/// Class of an orbit that ended early.
fn left(end: OrbitEnd) -> BasinClass {
    match end {
        OrbitEnd::NoImage { .. } => BasinClass::NoImage,
        OrbitEnd::Escaped { .. } | OrbitEnd::Completed => BasinClass::Escaped,
    }
}

/// A state that is being followed.
struct Slot {
    /// Position of the state among the starts.
    number: usize,
    state: Vec<f64>,
    iterates: usize,
    mapped: u64,
    /// Whether the next iterates are kept, to determine where the orbit settled.
    keeps: bool,
    /// Consecutive states in the cells of each attractor.
    stayed: Vec<usize>,
}

/// States that are followed side by side; a finished one is replaced by the next.
struct Follower<'s, 'a> {
    search: &'s BasinSearch<'a>,
    starts: &'s [&'s [f64]],
    next: usize,
    slots: Vec<Slot>,
    found: Vec<Option<Followed>>,
}

impl<'s, 'a> Follower<'s, 'a> {
    fn new(search: &'s BasinSearch<'a>, starts: &'s [&'s [f64]]) -> Self {
        Self { search, starts, next: 0, slots: Vec::new(), found: vec![None; starts.len()] }
    }

    fn run(mut self, orbits: &mut SideBySide<'_>, progress: &dyn Progress) -> Vec<Followed> {
        let chunk = OrbitRequest { transient: 0, keep: CHUNK, ..self.search.request.clone() };
        let last = OrbitRequest { transient: 0, ..self.search.request.clone() };
        loop {
            self.refill();
            if self.slots.is_empty() {
                break;
            }
            let (settled, moving): (Vec<Slot>, Vec<Slot>) =
                mem::take(&mut self.slots).into_iter().partition(|slot| slot.keeps);
            for (slots, request) in [(settled, &last), (moving, &chunk)] {
                if slots.is_empty() {
                    continue;
                }
                let states: Vec<&[f64]> = slots.iter().map(|slot| &slot.state[..]).collect();
                let made = orbits(&states, request);
                for (slot, orbit) in slots.into_iter().zip(made) {
                    progress.advance(orbit.steps.len() as u64);
                    self.advance(slot, orbit);
                }
            }
        }
        self.found.into_iter().flatten().collect()
    }

    /// Fills free slots with states that were not followed yet.
    fn refill(&mut self) {
        while self.slots.len() < self.search.map.lanes() && self.next < self.starts.len() {
            self.slots.push(Slot {
                number: self.next,
                state: self.starts[self.next].to_vec(),
                iterates: 0,
                mapped: 0,
                keeps: false,
                stayed: vec![0; self.search.known.len()],
            });
            self.next += 1;
        }
    }

    /// Updates a slot with the next iterates of its state.
    fn advance(&mut self, mut slot: Slot, orbit: MapOrbit) {
        slot.iterates += orbit.steps.len();
        slot.mapped += orbit.steps.iter().filter(|step| !step.simulated).count() as u64;
        let goal = match self.class(&mut slot, &orbit) {
            Some(class) => Some(Goal::Class(class)),
            None if slot.keeps => {
                let states = orbit.states().flatten().copied().collect();
                Some(Goal::Open { states, period: orbit.period })
            }
            None => None,
        };
        if let Some(goal) = goal {
            let (iterates, mapped) = (slot.iterates as u64, slot.mapped);
            self.found[slot.number] = Some(Followed { goal, iterates, mapped });
            return;
        }
        slot.keeps = slot.iterates >= self.search.request.transient;
        slot.state.copy_from_slice(&orbit.last);
        self.slots.push(slot);
    }

    /// Class of an orbit, if its destination is known.
    fn class(&self, slot: &mut Slot, orbit: &MapOrbit) -> Option<BasinClass> {
        let search = self.search;
        if search.map.method() == Method::Map {
            let mut made = orbit.origins().zip(&orbit.steps);
            let inside = made.all(|(origin, step)| {
                search.window.holds(origin, search.parameters, &[step.depth])
            });
            if !inside || orbit.end != OrbitEnd::Completed {
                return Some(BasinClass::Outside);
            }
        }
        if orbit.end != OrbitEnd::Completed {
            return Some(left(orbit.end));
        }
        let reached = |(known, stayed): (&KnownAttractor, &mut usize)| match known {
            KnownAttractor::Cycle(cycle) => cycle.holds(&orbit.last),
            KnownAttractor::Cells(cells, _) => {
                let stays = orbit.states().all(|state| cells.hold(state));
                *stayed = if stays { *stayed + orbit.steps.len() } else { 0 };
                *stayed >= STAYED
            }
        };
        let number = search.known.iter().zip(&mut slot.stayed).position(reached);
        number.map(BasinClass::Attractor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::diagram::UnobservedSweep;
    use crate::iteration::{Itinerary, StepInfo};

    /// A map of the plane with a Jacobian by differences.
    struct Plane<F>(F);

    impl<F: Fn([f64; 2]) -> [f64; 2] + Sync> DiscreteMap for Plane<F> {
        fn dimension(&self) -> usize {
            2
        }
        fn parameters(&self) -> usize {
            0
        }
        fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
            image.copy_from_slice(&self.0([state[0], state[1]]));
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            const STEP: f64 = 1e-6;
            for column in 0..2 {
                let moved = |by: f64| {
                    let mut state = [state[0], state[1]];
                    state[column] += by;
                    self.0(state)
                };
                let (more, less) = (moved(STEP), moved(-STEP));
                for row in 0..2 {
                    jacobian[2 * row + column] = (more[row] - less[row]) / (2.0 * STEP);
                }
            }
            self.step(state, parameters, image)
        }
    }

    /// States of a square grid about the origin, their classes, and the attractors.
    fn classes<F: Fn([f64; 2]) -> [f64; 2] + Sync>(
        map: F,
        half_width: f64,
    ) -> (Vec<Vec<f64>>, Vec<BasinClass>, Vec<Attractor>) {
        let itinerary = Itinerary {
            surfaces: vec!["stop".to_owned()],
            passages: vec![0],
            nominal_hits: vec![0],
            periods: 1,
        };
        let swept = UnobservedSweep { map: Plane(map), itinerary };
        let window = MapWindow { depth: 1.0, state: vec![1e9; 2], parameter: Vec::new() };
        let request = OrbitRequest::new(600, 32, &[1.0; 2]).escaping_at(&[1e12; 2]);
        let mut search = BasinSearch::new(&swept, &[], &window, request, &NoProgress);
        let offset = |number: i32| half_width * f64::from(number) / 20.0;
        let states: Vec<Vec<f64>> = (-20..=20)
            .flat_map(|row| (-20..=20).map(move |column| vec![offset(column), offset(row) + 1e-4]))
            .collect();
        let numbers: Vec<usize> = (0..states.len()).collect();
        let classes = search.classes(&numbers, |number| states[number].clone());
        (states, classes, search.attractors())
    }

    /// State after `count` iterates.
    fn iterated<F: Fn([f64; 2]) -> [f64; 2]>(map: F, state: &[f64], count: usize) -> [f64; 2] {
        (0..count).fold([state[0], state[1]], |state, _| map(state))
    }

    #[test]
    fn basins_of_newtons_method_for_three_roots_are_those_of_plain_iteration() {
        // z ↦ z − (z³ − 1)/(3 z²), whose three basins share one border.
        let newton = |[x, y]: [f64; 2]| {
            let (a, b) = (x * x - y * y, 2.0 * x * y);
            let size = 3.0 * (a * a + b * b);
            [2.0 * x / 3.0 + a / size, 2.0 * y / 3.0 - b / size]
        };
        let (states, classes, attractors) = classes(newton, 2.0);
        assert_eq!(attractors.len(), 3);
        assert!(attractors.iter().all(|found| found.period == Period::Periodic(1)));
        for (state, class) in states.iter().zip(classes) {
            let [x, y] = iterated(newton, state, 200);
            let near = |root: &[f64]| (root[0] - x).hypot(root[1] - y) < 1e-6;
            let root = attractors.iter().position(|found| near(&found.states[0]));
            assert_eq!(Some(class), root.map(BasinClass::Attractor), "{state:?}");
        }
    }

    #[test]
    fn the_attractor_of_henon_is_one_without_a_period_and_other_states_escape() {
        let henon = |[x, y]: [f64; 2]| [1.0 - 1.4 * x * x + y, 0.3 * x];
        let (states, classes, attractors) = classes(henon, 2.0);
        let [attractor] = &attractors[..] else { panic!("{} attractors", attractors.len()) };
        assert_eq!(attractor.period, Period::NotFound);
        // 0.41922 +- 0.00006 (Sprott, Chaos and Time-Series Analysis, 2003); over 4096 iterates
        // the mean scatters by about 0.01.
        assert!((attractor.lyapunov.expect("a derivative") - 0.41922).abs() < 0.03);
        for (state, class) in states.iter().zip(classes) {
            let [x, _] = iterated(henon, state, 600);
            let expected =
                if x.abs() < 2.0 { BasinClass::Attractor(0) } else { BasinClass::Outside };
            assert_eq!(class, expected, "{state:?}");
        }
    }

    #[test]
    fn states_that_settle_slowly_reach_one_orbit() {
        // A rotation about (-3, 0) that contracts by 1e-5 an iterate.
        let slow = |[x, y]: [f64; 2]| {
            let (sin, cos, factor) = (0.7_f64.sin(), 0.7_f64.cos(), 1.0 - 1e-5);
            let x = x + 3.0;
            [-(factor * (cos * x - sin * y)) - 3.0, -(factor * (sin * x + cos * y))]
        };
        let (_, classes, attractors) = classes(slow, 1.5);
        let [attractor] = &attractors[..] else { panic!("{} attractors", attractors.len()) };
        assert_eq!(attractor.period, Period::Periodic(1));
        assert!((attractor.states[0][0] + 3.0).abs() < 1e-9, "{:?}", attractor.states);
        assert!(classes.iter().all(|class| *class == BasinClass::Attractor(0)));
    }

    #[test]
    fn attractors_without_a_period_are_told_apart() {
        // Cubic maps below their merging crisis at a = 3√3/2: one attractor on each side of 0.
        let cubic = |[x, y]: [f64; 2]| [2.5 * x - x * x * x, 0.3 * y];
        let (states, classes, attractors) = classes(cubic, 1.5);
        assert_eq!(attractors.len(), 2);
        assert!(attractors.iter().all(|found| found.period == Period::NotFound));
        let side = |class: &BasinClass| match class {
            BasinClass::Attractor(number) => attractors[*number].states[0][0],
            _ => f64::NAN,
        };
        for (state, class) in states.iter().zip(&classes).filter(|(state, _)| state[0] != 0.0) {
            let [x, _] = iterated(cubic, state, 600);
            assert!(side(class) * x > 0.0, "{state:?} goes to {x}, {class:?}");
        }
    }

    #[test]
    fn states_on_a_repelling_orbit_leave_it() {
        // (0, 0) repels along x, and the states with x = 0 run into it.
        let (states, classes, attractors) =
            classes(|[x, y]: [f64; 2]| [1.5 * x - 0.5 * x * x * x, 0.5 * y], 1.2);
        assert_eq!(attractors.len(), 2);
        let all = states.iter().zip(&classes);
        for (state, class) in all.filter(|(state, _)| state[0] == 0.0) {
            assert!(matches!(class, BasinClass::Attractor(_)), "{state:?} {class:?}");
        }
    }
}
