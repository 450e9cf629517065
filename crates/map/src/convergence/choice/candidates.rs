//! One expansion that maps are chosen from, and its truncations, cheapest first.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use super::economise::Economiser;
use super::forecast::{Forecaster, OrderRule, weighted_degrees};
use crate::convergence::ConvergenceError;
use crate::convergence::family::MapFamily;
use crate::convergence::sample::SamplePoint;
use crate::expansion::{DEVIATION_WEIGHT, LocalMap, MapOrders, Stage, Variables};
use crate::jet::{Jet, JetSpace};

/// Weights of a parameter that are tried.
const WEIGHTS: [u32; 3] = [2, 4, 6];

/// Largest number of parameters with weights of their own; more parameters share one weight.
const ALONE: usize = 2;

/// Orders and weights of a map that may meet the tolerance.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Truncation orders.
    pub(super) orders: MapOrders,
    /// Weights of parameters, by name, if they differ from the scene's.
    pub(super) weights: BTreeMap<String, u32>,
    /// Weights of all active parameters.
    parameters: Vec<u32>,
    /// Number of terms of a step with the parameters folded in, and number of all terms.
    pub(super) cost: (usize, usize),
    /// Forecast truncation error.
    pub(super) forecast: f64,
}

impl Candidate {
    /// The candidate's map, from the family it was found in.
    pub(super) fn map(&self, family: &MapFamily<'_>) -> Result<LocalMap, ConvergenceError> {
        Ok(family.weighted_map(self.orders, &self.parameters)?)
    }
}

/// Every pair of orders with every choice of weights, cheapest first.
pub(super) fn candidates(family: &MapFamily<'_>, forecaster: &Forecaster) -> Vec<Candidate> {
    let (highest, map) = (family.highest(), &forecaster.map);
    let variables = family.expander().variables();
    let names = &variables.names[variables.coordinates..];
    let base = &variables.weights[variables.coordinates..];
    let mut found = Vec::new();
    for parameters in parameter_weights(base) {
        let weights = [&variables.weights[..variables.coordinates], &parameters].concat();
        let (forecast, costs) = (forecaster.forecast(&weights), Costs::of(map, &weights));
        let named = names.iter().cloned().zip(parameters.iter().copied());
        let changed = named.zip(base).filter(|((_, weight), base)| weight != *base);
        let changed: BTreeMap<String, u32> = changed.map(|(named, _)| named).collect();
        found.extend(highest.pairs().map(|orders| Candidate {
            orders,
            weights: changed.clone(),
            parameters: parameters.clone(),
            cost: costs.at(orders),
            forecast: forecast.error(orders),
        }));
    }
    found.sort_by_key(|candidate| candidate.cost);
    found
}

/// Weights of the parameters that are tried: the scene's, and heavier ones if it states none.
fn parameter_weights(base: &[u32]) -> Vec<Vec<u32>> {
    if base.iter().any(|&weight| weight != WEIGHTS[0]) {
        return vec![base.to_vec()];
    }
    if base.len() > ALONE {
        return WEIGHTS.iter().map(|&weight| vec![weight; base.len()]).collect();
    }
    let grow = |all: Vec<Vec<u32>>| -> Vec<Vec<u32>> {
        let longer =
            |weights: Vec<u32>| WEIGHTS.map(|weight| [weights.as_slice(), &[weight]].concat());
        all.into_iter().flat_map(longer).collect()
    };
    base.iter().fold(vec![Vec::new()], |all, _| grow(all))
}

/// Number of terms that each cut keeps: with the parameters folded in (monomials in the
/// coordinates), and in all.
#[derive(Debug)]
struct Costs {
    /// Terms of the legs, by degree.
    legs: Vec<(usize, usize)>,
    /// Terms of the contacts, by weight.
    contacts: Vec<(usize, usize)>,
}

impl Costs {
    fn of(map: &LocalMap, weights: &[u32]) -> Self {
        let orders = map.orders;
        let mut costs = Self {
            legs: vec![(0, 0); orders.smooth_order as usize + 1],
            contacts: vec![(0, 0); orders.contact_weight as usize + 1],
        };
        let (dimension, leg_degree) = (map.dimension(), DEVIATION_WEIGHT as usize);
        for stage in &map.stages {
            match stage {
                Stage::Leg(leg) => leg.image.iter().for_each(|jet| {
                    let kept = Kept::new(jet, weights, dimension);
                    kept.add(&mut costs.legs, |degree| Some(leg_degree * degree));
                }),
                Stage::Contact(law) => {
                    let mut add = |jet: &Jet<f64>, lower: usize, higher: usize| {
                        let cut = |weight: usize| (weight + higher).checked_sub(lower);
                        Kept::new(jet, weights, dimension).add(&mut costs.contacts, cut);
                    };
                    add(&law.depth, 0, 1);
                    law.linear.iter().for_each(|jet| add(jet, 1, 0));
                    law.quadratic.iter().for_each(|jet| add(jet, 2, 0));
                    for (exponent, term) in law.powers.with_exponents() {
                        let exponent = exponent.ceil() as usize;
                        term.linear.iter().for_each(|jet| add(jet, exponent + 1, 0));
                        term.quadratic.iter().for_each(|jet| add(jet, exponent + 2, 0));
                    }
                }
                Stage::Flown(_) => {}
            }
        }
        costs
    }

    fn at(&self, orders: MapOrders) -> (usize, usize) {
        let leg = self.legs[orders.smooth_order as usize];
        let contact = self.contacts[orders.contact_weight as usize];
        (leg.0 + contact.0, leg.1 + contact.1)
    }
}

/// Weighted degrees of a polynomial's terms, and the lowest degree for each set of powers of the
/// coordinates.
struct Kept {
    all: Vec<usize>,
    folded: Vec<usize>,
}

impl Kept {
    fn new(jet: &Jet<f64>, weights: &[u32], dimension: usize) -> Self {
        let degrees = weighted_degrees(jet, weights);
        let terms = jet.terms().zip(degrees);
        let mut terms: Vec<(usize, &[u8])> = terms
            .filter(|((_, value), _)| *value != 0.0)
            .map(|((exponents, _), degree)| (degree, &exponents[..dimension]))
            .collect();
        terms.sort_unstable();
        let mut seen = BTreeSet::new();
        let first = terms.iter().filter(|(_, powers)| seen.insert(*powers));
        Self {
            folded: first.map(|&(degree, _)| degree).collect(),
            all: terms.iter().map(|&(degree, _)| degree).collect(),
        }
    }

    /// Adds the number of terms up to the weighted degree at which each order is cut.
    fn add(&self, costs: &mut [(usize, usize)], cut: impl Fn(usize) -> Option<usize>) {
        for (order, cost) in costs.iter_mut().enumerate() {
            if let Some(highest) = cut(order) {
                let within =
                    |degrees: &[usize]| degrees.partition_point(|&degree| degree <= highest);
                cost.0 += within(&self.folded);
                cost.1 += within(&self.all);
            }
        }
    }
}

/// Largest number of monomials of a leg, of the depth, and of a contact whose depth variable
/// replaces a coordinate: a full product of two such series has up to ten million terms.
const MONOMIALS: u128 = 20_000;

/// Highest orders of a first search, for any number of variables.
const HIGHEST: MapOrders = MapOrders::new(14, 20);

/// Highest orders of all, if no lower ones meet the tolerance and terms fall.
const DEEPEST: MapOrders = MapOrders::new(14, 40);

/// Largest number of monomials of a fit.
const FITTED: usize = 800;

/// One expansion with its forecasts.
pub(super) struct Level<'a> {
    pub(super) family: MapFamily<'a>,
    /// All truncations, cheapest first.
    pub(super) candidates: Vec<Candidate>,
    /// Decay of the terms.
    pub(super) rule: OrderRule,
    map: LocalMap,
    economiser: OnceCell<Option<Economiser>>,
}

impl<'a> Level<'a> {
    /// An expansion with forecasts at `points`.
    pub(super) fn new(
        family: MapFamily<'a>,
        points: &[SamplePoint],
    ) -> Result<Self, ConvergenceError> {
        let map = family.map(family.highest())?;
        let forecaster = Forecaster::new(map, points);
        let forecast = forecaster.forecast(&family.expander().variables().weights);
        Ok(Self {
            candidates: candidates(&family, &forecaster),
            rule: OrderRule::new(&forecast),
            map: forecaster.map,
            economiser: OnceCell::new(),
            family,
        })
    }

    /// Truncation error of the expansion itself, which every truncation has.
    pub(super) fn remainder(&self) -> f64 {
        self.rule.error(self.family.highest())
    }

    /// Estimated number of products of coefficients in the composition of a candidate: those of one
    /// product in the space of substitution, times the number of monomials in the coordinates.
    pub(super) fn products(&self, candidate: &Candidate) -> u128 {
        let coordinates = self.map.dimension();
        let MapOrders { smooth_order, contact_weight } = candidate.orders;
        let variables = self.family.expander().variables();
        let weights = [&variables.weights[..coordinates], &candidate.parameters].concat();
        let begins_with_contact = matches!(self.map.stages.first(), Some(Stage::Contact(_)));
        let (replaced, contacts) = match self.map.passages() {
            1 if begins_with_contact => (1, 0),
            passages => (0, passages),
        };
        let depths = vec![1; self.map.passages()];
        let space = [depths.as_slice(), &weights[replaced..]].concat();
        let product = JetSpace::check(&space, contact_weight.max(smooth_order) as usize);
        let monomials = |degree: u32| JetSpace::count(&vec![1; coordinates], degree);
        let legs = (self.map.stages.len() - self.map.passages()) as u128 * monomials(smooth_order);
        let contacts = contacts as u128 * monomials(contact_weight / DEVIATION_WEIGHT);
        product.map_or(u128::MAX, |product| product as u128 * (legs + contacts))
    }

    /// Fits to the highest orders; `None` if they would take too long or the window has no points.
    pub(super) fn economiser(&self) -> Option<&Economiser> {
        let made = || {
            let small = Economiser::size(&self.map) <= FITTED;
            small.then(|| Economiser::new(self.map.clone()).ok()).flatten()
        };
        self.economiser.get_or_init(made).as_ref()
    }
}

/// Highest orders that are expanded: in a first search, and if that fails.
pub(super) fn highest_orders(variables: &Variables) -> [MapOrders; 2] {
    let leg = |degree: u32| JetSpace::count(&variables.weights, DEVIATION_WEIGHT * degree);
    let contact = |weight: u32| {
        let (_, others) = variables.weights.split_first().unwrap_or((&0, &[]));
        let with_depth: Vec<u32> = std::iter::once(1).chain(others.iter().copied()).collect();
        let depth = JetSpace::count(&variables.weights, weight + 1);
        depth.max(JetSpace::count(&with_depth, weight))
    };
    let within = |monomials: &dyn Fn(u32) -> u128, highest: u32| {
        let mut orders = (1..=highest).rev();
        orders.find(|&order| monomials(order) <= MONOMIALS).unwrap_or(1)
    };
    [HIGHEST, DEEPEST].map(|highest| MapOrders {
        smooth_order: within(&leg, highest.smooth_order),
        contact_weight: within(&contact, highest.contact_weight),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_given_every_weight_one_by_one_unless_the_scene_gives_them() {
        assert_eq!(parameter_weights(&[2, 2]).len(), 9);
        assert_eq!(parameter_weights(&[2, 2, 2]).len(), 3);
        assert_eq!(parameter_weights(&[2, 4]), [[2, 4]]);
        assert_eq!(parameter_weights(&[]), [[0; 0]]);
    }

    #[test]
    fn more_variables_have_lower_highest_orders() {
        let orders = [4, 6, 8].map(|count| {
            let [first, deepest] = highest_orders(&Variables {
                names: vec![String::new(); count],
                weights: vec![2; count],
                coordinates: count - 2,
            });
            let pair = |orders: MapOrders| (orders.smooth_order, orders.contact_weight);
            (pair(first), pair(deepest))
        });
        // C(14 + 4, 4) = 3060, C(12 + 6, 6) = 18 564, C(8 + 8, 8) = 12 870 monomials of a leg. With
        // y in place of one of the variables there are 19 481, 16 016 and 19 305 monomials of a
        // contact to weights 40, 21 and 16.
        let expected = [((14, 20), (14, 40)), ((12, 20), (12, 21)), ((8, 16), (8, 16))];
        assert_eq!(orders, expected);
    }
}
