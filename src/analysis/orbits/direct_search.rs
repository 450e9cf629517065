//! Periodic orbits by direct simulation alone, where no map reaches.
//!
//! One idea: what the simulation settles on, or nearly repeats, at parameters far and wide is where
//! Newton's method begins; from each orbit its branch is followed both ways, through folds, as long
//! as it makes its contacts.

use super::data::DirectReach;
use crate::analysis::direct_image::DirectImage;
use crate::analysis::periodic::{
    BifurcationKind, ContactItinerary, Guess, Held, PeriodicOrbit, PeriodicProblem, SectionMap,
    periodic_orbit,
};
use crate::iteration::PassageSet;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// Values of the parameter at which orbits are flown, up and down.
const VALUES: usize = 48;
/// The parameter's offsets, in sizes of it at the graze.
const RANGE: [f64; 2] = [-0.95, 4.0];
/// Scattered states from which orbits are flown at each value, beside those that are carried.
const SCATTERED: usize = 3;
/// Returns flown before any are looked at, and those looked at.
const TRANSIENT: usize = 150;
const KEPT: usize = 80;
/// Lengths of the first, the longest and the shortest step along a branch, relative to the size of
/// what varies.
const STEPS: [f64; 3] = [0.01, 0.05, 1e-4];
/// Most steps each way.
const MOST_STEPS: usize = 300;
/// Offsets of the parameter up to this many sizes of it are followed to.
const FARTHEST: f64 = 1000.0;
/// Orbits are the same where all coordinates agree to this share of their sizes.
const SAME: f64 = 1e-6;

/// A parameter far and wide about its value at the graze, and the section there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Its number among the active ones.
    pub(super) free: usize,
    /// Its size at the graze.
    pub(super) size: f64,
    /// The coordinate that is the phase, where there is one, and its period.
    phase: Option<(usize, f64)>,
}

impl Reach {
    /// About the graze of an orbit.
    pub(super) fn of(scene: &Scene, orbit: &GrazingOrbit, free: usize) -> Self {
        let size = orbit.parameters()[scene.expansion.active[free]].to_f64().abs();
        let clock = scene.model.phase.as_ref();
        let phase = clock.and_then(|clock| {
            let component = scene.model.dimension() - 1;
            let mut coordinates = orbit.section.coordinates.iter();
            let place = coordinates.position(|&coordinate| coordinate == component)?;
            Some((place, clock.period.to_f64()))
        });
        Self { free, size: if size == 0.0 { 1.0 } else { size }, phase }
    }

    /// Takes whole periods off the phase.
    fn reduce(&self, state: &mut [f64]) {
        if let Some((place, period)) = self.phase {
            state[place] -= period * (state[place] / period).round();
        }
    }

    /// The same as it is told.
    pub(super) fn words(self) -> DirectReach {
        let range = RANGE.map(|offset| self.size * offset);
        DirectReach { parameter: self.free, range, values: VALUES }
    }

    /// The offsets at which orbits are flown, denser towards the smallest size.
    pub(super) fn values(&self) -> Vec<f64> {
        let [from, to] = RANGE;
        let value = |number: usize| {
            let share = number as f64 / (VALUES - 1) as f64;
            self.size * (from + (to - from) * share * share)
        };
        (0..VALUES).map(value).collect()
    }
}

/// A branch of orbits, in order along it.
pub(super) type Branch = Vec<PeriodicOrbit<f64>>;

/// Consecutive section points of one flight at one value of the parameter.
struct Flight {
    parameters: Vec<f64>,
    states: Vec<Vec<f64>>,
    /// Contacts of each return, and how many no passage accounts for.
    returns: Vec<(PassageSet, usize)>,
}

/// Flights at fixed other parameters, and the search in them.
pub(super) struct DirectSearch<'s, 'a> {
    image: &'s mut DirectImage<'a, f64>,
    reach: Reach,
    /// Lengths of Newton's method.
    scales: &'s [f64],
    flights: Vec<Flight>,
    /// Sizes of the coordinates on the flights, and of the parameter.
    sizes: Vec<f64>,
}

impl<'s, 'a> DirectSearch<'s, 'a> {
    /// Flies from the graze through all values of the parameter, up and down, every flight begun
    /// where the last one ended; then from scattered states as far away as those flights came.
    pub(super) fn new(
        image: &'s mut DirectImage<'a, f64>,
        reach: Reach,
        scales: &'s [f64],
        at: &[f64],
    ) -> Self {
        let dimension = image.dimension();
        let up = reach.values();
        let down = up.iter().rev().copied().collect();
        let mut flights = Vec::new();
        for values in [up, down] {
            let mut state = vec![0.0; dimension];
            for value in values {
                let mut parameters = at.to_vec();
                parameters[reach.free] = value;
                let flight = fly(image, &reach, &state, parameters);
                state = flight.states.last().cloned().unwrap_or_else(|| vec![0.0; dimension]);
                flights.push(flight);
            }
        }
        let extent = |place: usize| {
            let values = flights.iter().flat_map(|flight| &flight.states).map(|state| state[place]);
            values.fold(0.0_f64, |most, value| most.max(value.abs())).max(f64::MIN_POSITIVE)
        };
        let sizes: Vec<f64> = (0..dimension).map(extent).chain([reach.size]).collect();
        for number in 0..VALUES * SCATTERED {
            let parameters = flights[number / SCATTERED].parameters.clone();
            let state: Vec<f64> =
                (0..dimension).map(|place| sizes[place] * scattered(number, place)).collect();
            flights.push(fly(image, &reach, &state, parameters));
        }
        Self { image, reach, scales, flights, sizes }
    }

    /// The branches of an itinerary's orbits, each once.
    pub(super) fn branches(&mut self, itinerary: &ContactItinerary) -> Vec<Branch> {
        let problem = PeriodicProblem {
            returns: itinerary.period(),
            free: self.reach.free,
            itinerary: Some(itinerary.returns().to_vec()),
            scales: self.scales.to_vec(),
        };
        let guesses: Vec<_> =
            self.flights.iter().filter_map(|flight| self.near_period(flight, itinerary)).collect();
        let mut branches: Vec<Branch> = Vec::new();
        for guess in guesses {
            let Some(seed) = self.solved(&problem, Held::Parameter, &guess) else {
                continue;
            };
            if self.repeats(&seed, itinerary) || self.is_known(&problem, &seed, &branches) {
                continue;
            }
            let [back, on] = [-1.0, 1.0].map(|way| self.followed(&problem, &seed, way));
            branches.push(back.into_iter().rev().chain([seed]).chain(on).collect());
        }
        branches
    }

    /// The neighbours on branches between which a multiplier passes through that of a bifurcation,
    /// and the coordinate that tells them apart best.
    pub(super) fn changes<'b>(
        &self,
        kind: BifurcationKind,
        branches: &'b [Branch],
    ) -> Vec<([&'b PeriodicOrbit<f64>; 2], usize)> {
        let value = |orbit: &PeriodicOrbit<f64>| orbit.characteristic(kind.multiplier());
        let pairs = branches.iter().flat_map(|branch| branch.windows(2));
        let changed = pairs.filter(|pair| match (value(&pair[0]), value(&pair[1])) {
            (Ok(before), Ok(after)) => before * after <= 0.0,
            _ => false,
        });
        let ends = changed.map(|pair| {
            let changes = self.change(&pair[0], &pair[1]);
            let coordinate = largest(&changes[..changes.len() - 1]);
            ([&pair[0], &pair[1]], coordinate)
        });
        ends.collect()
    }

    /// Where branches pass a value of the parameter: guesses.
    pub(super) fn passing(&self, value: f64, branches: &[Branch]) -> Vec<Guess<f64>> {
        let pairs = branches.iter().flat_map(|branch| branch.windows(2));
        pairs.filter_map(|pair| between(&pair[0], &pair[1], self.reach.free, value)).collect()
    }

    /// The kept returns that come nearest to a period of an itinerary.
    fn near_period(&self, flight: &Flight, itinerary: &ContactItinerary) -> Option<Guess<f64>> {
        let (period, asked) = (itinerary.period(), itinerary.returns());
        let made = |start: &usize| {
            let made = &flight.returns[*start..*start + period];
            made.iter().zip(asked).all(|((made, extra), asked)| made == asked && *extra == 0)
        };
        let apart = |start: usize| {
            let pairs = flight.states[start].iter().zip(&flight.states[start + period]);
            let pairs = pairs.zip(&self.sizes);
            pairs.fold(0.0_f64, |most, ((a, b), size)| most.max((a - b).abs() / size))
        };
        let last = (flight.returns.len() + 1).checked_sub(period)?;
        let starts = (0..last).filter(made);
        let nearest = starts.min_by(|&a, &b| apart(a).total_cmp(&apart(b)))?;
        Some(Guess { state: flight.states[nearest].clone(), parameters: flight.parameters.clone() })
    }

    fn solved(
        &mut self,
        problem: &PeriodicProblem,
        held: Held,
        guess: &Guess<f64>,
    ) -> Option<PeriodicOrbit<f64>> {
        let found = periodic_orbit(self.image, problem, held, guess).found();
        found.filter(|orbit| orbit.extra_contacts == 0)
    }

    /// Whether an orbit is one of a shorter period.
    fn repeats(&self, orbit: &PeriodicOrbit<f64>, itinerary: &ContactItinerary) -> bool {
        let mut later = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        later.any(|later| self.is_near(&orbit.states[0], &orbit.states[later]))
    }

    fn is_near(&self, a: &[f64], b: &[f64]) -> bool {
        let mut pairs = a.iter().zip(b).zip(&self.sizes);
        pairs.all(|((a, b), size)| (a - b).abs() <= SAME * size)
    }

    /// Whether an orbit lies on one of the branches followed.
    fn is_known(
        &mut self,
        problem: &PeriodicProblem,
        seed: &PeriodicOrbit<f64>,
        branches: &[Branch],
    ) -> bool {
        let passing = self.passing(seed.parameters[self.reach.free], branches);
        passing.iter().any(|guess| {
            let found = self.solved(problem, Held::Parameter, guess);
            let states = |orbit: PeriodicOrbit<f64>| orbit.states;
            let states = found.map(states).unwrap_or_default();
            states.iter().any(|state| self.is_near(state, &seed.states[0]))
        })
    }

    /// The branch from an orbit on, the parameter growing first or shrinking. What changes most is
    /// held at every step, the parameter or a coordinate.
    fn followed(
        &mut self,
        problem: &PeriodicProblem,
        seed: &PeriodicOrbit<f64>,
        way: f64,
    ) -> Branch {
        let mut orbits: Branch = Vec::new();
        let dimension = self.sizes.len() - 1;
        let mut direction = vec![0.0; dimension + 1];
        direction[dimension] = way;
        let [mut step, longest, shortest] = STEPS;
        while orbits.len() < MOST_STEPS && step >= shortest {
            let last = orbits.last().unwrap_or(seed);
            let place = largest(&direction);
            let held = match place {
                place if place == dimension => Held::Parameter,
                place => Held::Coordinate(place),
            };
            let mut guess = last.guess();
            let scale = self.sizes_at(last);
            for (place, share) in direction.iter().enumerate() {
                let change = step * share * scale[place];
                match place {
                    place if place == dimension => guess.parameters[self.reach.free] += change,
                    place => guess.state[place] += change,
                }
            }
            if guess.parameters[self.reach.free].abs() > FARTHEST * self.reach.size {
                break;
            }
            let next = self.solved(problem, held, &guess);
            let moved = next.as_ref().map(|next| self.change(last, next));
            // An orbit much further than the step is one of another branch.
            match (next, moved) {
                (Some(next), Some(moved)) if moved.iter().all(|m| m.abs() <= 4.0 * step) => {
                    let size = moved.iter().fold(0.0_f64, |most, m| most.max(m.abs()));
                    direction = moved.iter().map(|m| m / size).collect();
                    orbits.push(next);
                    step = (1.5 * step).min(longest);
                }
                _ => step *= 0.5,
            }
        }
        orbits
    }

    /// What lengths are measured in at an orbit: sizes on the flights, or its own if those are
    /// larger.
    fn sizes_at(&self, orbit: &PeriodicOrbit<f64>) -> Vec<f64> {
        let values = orbit.states[0].iter().chain([&orbit.parameters[self.reach.free]]);
        values.zip(&self.sizes).map(|(value, size)| value.abs().max(*size)).collect()
    }

    /// The change from an orbit to another, of coordinates and parameter.
    fn change(&self, from: &PeriodicOrbit<f64>, to: &PeriodicOrbit<f64>) -> Vec<f64> {
        let free = self.reach.free;
        let pairs = from.states[0].iter().zip(&to.states[0]);
        let pairs = pairs.chain([(&from.parameters[free], &to.parameters[free])]);
        pairs.zip(self.sizes_at(from)).map(|((from, to), size)| (to - from) / size).collect()
    }
}

/// The returns from a state on, after a transient, as far as there are any.
fn fly(
    image: &mut DirectImage<'_, f64>,
    reach: &Reach,
    start: &[f64],
    parameters: Vec<f64>,
) -> Flight {
    let mut state = start.to_vec();
    let (mut states, mut returns) = (Vec::new(), Vec::new());
    for number in 0..TRANSIENT + KEPT {
        let Some(mut step) = SectionMap::image(image, &state, &parameters) else {
            break;
        };
        reach.reduce(&mut step.offsets);
        if number >= TRANSIENT {
            if states.is_empty() {
                states.push(state);
            }
            states.push(step.offsets.clone());
            returns.push((step.contacts, step.extra_contacts));
        }
        state = step.offsets;
    }
    Flight { parameters, states, returns }
}

/// A number from −1 to 1 for every pair of numbers: a Kronecker sequence.
fn scattered(number: usize, component: usize) -> f64 {
    let golden = 0.618_033_988_749_894_9;
    2.0 * ((number + 1) as f64 * (golden / (component + 1) as f64).sqrt()).fract() - 1.0
}

/// The point of the line through two orbits at a value of the parameter, if that lies between.
fn between(
    a: &PeriodicOrbit<f64>,
    b: &PeriodicOrbit<f64>,
    free: usize,
    value: f64,
) -> Option<Guess<f64>> {
    let (from, to) = (a.parameters[free], b.parameters[free]);
    let share = (value - from) / (to - from);
    (0.0..=1.0).contains(&share).then(|| {
        let pairs = a.states[0].iter().zip(&b.states[0]);
        let mut parameters = a.parameters.clone();
        parameters[free] = value;
        Guess { state: pairs.map(|(a, b)| a + share * (b - a)).collect(), parameters }
    })
}

/// The place of the number of the largest size.
fn largest(values: &[f64]) -> usize {
    let sizes = values.iter().map(|value| value.abs()).enumerate();
    sizes.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place)
}
