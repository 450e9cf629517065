//! Folds and flips of the orbits of an itinerary in one parameter.
//!
//! One idea: along a branch the first depth variable is held and the parameter solved for, so that
//! a branch runs from the graze to the edge of the window through every fold on its way.

use super::branch::{BifurcationKind, branch, zero_between};
use super::contact_itinerary::ContactItinerary;
use super::depth_variable_map::{DepthVariableMap, ItineraryOrbit};
use super::itinerary_search::{ItinerarySearch, SAME};
use super::orbit::{Guess, Held, PeriodicOrbit, PeriodicProblem, periodic_orbit};

/// Decades of the first depth variable along a branch, down from beyond the window's edge, and
/// values in each.
const DECADES: usize = 4;
const PER_DECADE: usize = 6;
/// Values of the list at which branches are looked for, as shares of it.
const LOOKED_AT: [f64; 3] = [0.3, 0.7, 1.0];
/// Relative distance of the neighbours of a bifurcation on its branch.
const APART: f64 = 0.02;

/// How near to the multiplier of a bifurcation one of its orbit's is; of another branch, onto which
/// a search may step, it is not.
const NEAR: f64 = 1e-4;

/// A fold or a flip of an itinerary's orbits.
#[derive(Clone, Debug)]
pub struct ItineraryBifurcation {
    /// Which.
    pub kind: BifurcationKind,
    /// The orbit.
    pub orbit: ItineraryOrbit<f64>,
    /// Orbits of the branch before and after it.
    pub neighbours: [ItineraryOrbit<f64>; 2],
}

/// Branches of one itinerary, the parameter `free` solved for.
struct Branches<'a> {
    search: &'a ItinerarySearch<'a>,
    map: DepthVariableMap<'a, f64>,
    problem: PeriodicProblem,
    /// The coordinate held, and its values.
    coordinate: usize,
    values: Vec<f64>,
}

impl ItinerarySearch<'_> {
    /// The bifurcations of these kinds that physical orbits of an itinerary with contacts meet in
    /// the parameter `free`, the others held; by the first depth variable, least first.
    pub fn bifurcations(
        &self,
        itinerary: &ContactItinerary,
        kinds: &[BifurcationKind],
        free: usize,
        parameters: &[f64],
    ) -> Vec<ItineraryBifurcation> {
        if itinerary.contacts() == 0 {
            return Vec::new();
        }
        let map = DepthVariableMap::new(&self.map, itinerary, self.dimension, self.unit());
        let mut branches = Branches {
            search: self,
            problem: map.problem(self.window, free),
            coordinate: map.first_depth_variable(),
            values: values(2.0 * self.unit()),
            map,
        };
        let mut found: Vec<ItineraryBifurcation> = Vec::new();
        for branch in branches.all(itinerary, parameters) {
            for pair in branch.windows(2) {
                for &kind in kinds {
                    let Some(next) = branches.between(kind, [&pair[0], &pair[1]]) else {
                        continue;
                    };
                    let known = found.iter().filter(|known| known.kind == kind);
                    let known: Vec<_> = known.map(|known| known.orbit.clone()).collect();
                    if next.orbit.is_physical() && self.is_new(itinerary, &next.orbit, &known) {
                        found.push(next);
                    }
                }
            }
        }
        found.sort_by(|a, b| a.orbit.depth_variables[0].total_cmp(&b.orbit.depth_variables[0]));
        found
    }
}

/// Values of the depth variable along a branch, ascending.
fn values(largest: f64) -> Vec<f64> {
    let below = (0..=DECADES * PER_DECADE).rev();
    let value = |step: usize| largest * 10f64.powf(-(step as f64) / PER_DECADE as f64);
    below.map(value).collect()
}

impl Branches<'_> {
    /// Every branch met at some of the values, each once, as fixed points by ascending value.
    fn all(
        &mut self,
        itinerary: &ContactItinerary,
        parameters: &[f64],
    ) -> Vec<Vec<PeriodicOrbit<f64>>> {
        let mut branches: Vec<Vec<PeriodicOrbit<f64>>> = Vec::new();
        for share in LOOKED_AT {
            let place = (share * (self.values.len() - 1) as f64) as usize;
            for guess in self.guesses(itinerary, self.values[place], parameters) {
                let held = Held::Coordinate(self.coordinate);
                let found = periodic_orbit(&mut self.map, &self.problem, held, &guess).found();
                let Some(seed) = found.filter(|seed| !self.is_known(seed, &branches)) else {
                    continue;
                };
                branches.push(self.followed(&seed, place));
            }
        }
        branches
    }

    /// Guesses at a value of the first depth variable: the others of its size, of either sign, or
    /// smaller.
    fn guesses(
        &self,
        itinerary: &ContactItinerary,
        value: f64,
        parameters: &[f64],
    ) -> Vec<Guess<f64>> {
        let others = self.search.sides(itinerary.contacts() - 1);
        let guess = |others: Vec<f64>| {
            let size = value / (2.0 * self.search.unit());
            let others = others.into_iter().map(|y| y * size);
            let state = std::iter::repeat_n(0.0, self.coordinate).chain([value]);
            Guess { state: state.chain(others).collect(), parameters: parameters.to_vec() }
        };
        others.into_iter().map(guess).collect()
    }

    /// Whether an orbit is one of those already followed.
    fn is_known(&self, seed: &PeriodicOrbit<f64>, branches: &[Vec<PeriodicOrbit<f64>>]) -> bool {
        let same = |orbit: &PeriodicOrbit<f64>| {
            let pairs = orbit.states[0].iter().zip(&seed.states[0]);
            let mut pairs = pairs.zip(&self.problem.scales);
            pairs.all(|((a, b), scale)| (a - b).abs() <= SAME * scale)
        };
        branches.iter().flatten().any(same)
    }

    /// The branch through an orbit at one of the values, up and down from it.
    fn followed(&mut self, seed: &PeriodicOrbit<f64>, place: usize) -> Vec<PeriodicOrbit<f64>> {
        let down: Vec<f64> = self.values[..place].iter().rev().copied().collect();
        let up = self.values[place..].to_vec();
        let mut follow = |values: &[f64]| {
            branch(&mut self.map, &self.problem, self.coordinate, values, &seed.guess())
        };
        let (down, up) = (follow(&down), follow(&up));
        down.into_iter().rev().chain(up).collect()
    }

    /// The bifurcation between two neighbours of a branch, with its neighbours.
    fn between(
        &mut self,
        kind: BifurcationKind,
        ends: [&PeriodicOrbit<f64>; 2],
    ) -> Option<ItineraryBifurcation> {
        let map = self.map.clone();
        // Where another depth variable passes through zero, J has a pole; the product of all takes
        // it away.
        let test = |fixed: &PeriodicOrbit<f64>| {
            let orbit = map.orbit(fixed)?;
            let depths: f64 = orbit.depth_variables.iter().product();
            Some(depths * orbit.orbit.characteristic(kind.multiplier()).ok()?)
        };
        let fixed = zero_between(&mut self.map, &self.problem, self.coordinate, ends, test)?;
        let orbit = map.orbit(&fixed).filter(|orbit| is_at(kind, orbit))?;
        let value = fixed.states[0][self.coordinate];
        let mut neighbour = |share: f64| {
            let value = [value * (1.0 + share)];
            let guess = fixed.guess();
            let orbits = branch(&mut self.map, &self.problem, self.coordinate, &value, &guess);
            map.orbit(orbits.first()?)
        };
        let neighbours = [neighbour(-APART)?, neighbour(APART)?];
        Some(ItineraryBifurcation { kind, orbit, neighbours })
    }
}

/// Whether an orbit has the multiplier of a bifurcation.
fn is_at(kind: BifurcationKind, orbit: &ItineraryOrbit<f64>) -> bool {
    let multipliers = orbit.orbit.multipliers().unwrap_or_default();
    let mut apart = multipliers.iter().map(|value| (value - kind.multiplier()).norm());
    apart.any(|apart| apart < NEAR)
}
