//! Maps that may meet a tolerance, cheapest first.

use std::collections::{BTreeMap, BTreeSet};

use super::ConvergenceError;
use super::family::MapFamily;
use super::forecast::Forecast;
use super::sample::SamplePoint;
use crate::expansion::{LocalMap, MapOrders, Stage};
use crate::jet::Jet;

/// Weights of a parameter that are tried.
const WEIGHTS: [u32; 3] = [2, 4, 6];

/// Parameters that are given weights one by one; more of them are given the same one.
const ALONE: usize = 2;

/// Sample points of a forecast.
const POINTS: usize = 24;

/// A map is measured where its forecast is within this many times the tolerance.
const SLACK: f64 = 2.0;

/// Orders and weights that may meet the tolerance.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Truncation orders.
    pub(super) orders: MapOrders,
    /// Weights of parameters, by name, where they differ from the scene's.
    pub(super) weights: BTreeMap<String, u32>,
    /// Weights of all active parameters.
    parameters: Vec<u32>,
    /// Terms of a step once the parameters are folded in, then all terms.
    cost: (usize, usize),
}

impl Candidate {
    /// Its map, out of the family it was found in.
    pub(super) fn map(&self, family: &MapFamily<'_>) -> Result<LocalMap, ConvergenceError> {
        Ok(family.weighted_map(self.orders, &self.parameters)?)
    }
}

/// The candidates of an expansion, cheapest first; the highest orders are always among them.
pub(super) fn candidates(
    family: &MapFamily<'_>,
    points: &[SamplePoint],
    tolerance: f64,
) -> Result<Vec<Candidate>, ConvergenceError> {
    let highest = family.highest();
    let map = family.map(highest)?;
    let variables = family.expander().variables();
    let names = &variables.names[variables.coordinates..];
    let base = &variables.weights[variables.coordinates..];
    let points = &points[..points.len().min(POINTS)];
    let mut found = Vec::new();
    for parameters in parameter_weights(base) {
        let weights = [&variables.weights[..variables.coordinates], &parameters].concat();
        let forecast = Forecast::new(&map, &weights, points);
        let named = names.iter().cloned().zip(parameters.iter().copied());
        let changed = named
            .zip(base)
            .filter(|((_, weight), base)| weight != *base);
        let changed: BTreeMap<String, u32> = changed.map(|(named, _)| named).collect();
        let pairs = (1..=highest.smooth_order)
            .flat_map(|n| (1..=highest.contact_weight).map(move |w| (n, w)));
        for (smooth_order, contact_weight) in pairs {
            let orders = MapOrders {
                smooth_order,
                contact_weight,
            };
            let top = orders == highest && changed.is_empty();
            if forecast.error(orders) <= SLACK * tolerance || top {
                let cost = cost(&family.weighted_map(orders, &parameters)?);
                found.push(Candidate {
                    orders,
                    weights: changed.clone(),
                    parameters: parameters.clone(),
                    cost,
                });
            }
        }
    }
    found.sort_by_key(|candidate| candidate.cost);
    Ok(found)
}

/// Weights of the parameters: the scene's, and heavier ones where it names none.
fn parameter_weights(base: &[u32]) -> Vec<Vec<u32>> {
    if base.iter().any(|&weight| weight != WEIGHTS[0]) {
        return vec![base.to_vec()];
    }
    if base.len() > ALONE {
        return WEIGHTS
            .iter()
            .map(|&weight| vec![weight; base.len()])
            .collect();
    }
    let grow = |all: Vec<Vec<u32>>| -> Vec<Vec<u32>> {
        let longer =
            |weights: Vec<u32>| WEIGHTS.map(|weight| [weights.as_slice(), &[weight]].concat());
        all.into_iter().flat_map(longer).collect()
    };
    base.iter().fold(vec![Vec::new()], |all, _| grow(all))
}

/// Terms with the parameters folded in (monomials in the coordinates), then all terms.
fn cost(map: &LocalMap) -> (usize, usize) {
    let dimension = map.dimension();
    let mut cost = (0, 0);
    let mut add = |jet: &Jet<f64>| {
        let terms = jet.terms().filter(|&(_, value)| value != 0.0);
        let exponents: Vec<&[u8]> = terms.map(|(exponents, _)| exponents).collect();
        let folded: BTreeSet<&[u8]> = exponents
            .iter()
            .map(|powers| &powers[..dimension])
            .collect();
        cost.0 += folded.len();
        cost.1 += exponents.len();
    };
    let polynomials = map.stages.iter().flat_map(Stage::polynomials);
    polynomials.for_each(&mut add);
    cost
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
}
