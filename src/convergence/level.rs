//! One expansion that maps are chosen from, and the highest that are made.

use std::cell::OnceCell;

use super::ConvergenceError;
use super::candidates::{Candidate, candidates};
use super::economise::Economiser;
use super::family::MapFamily;
use super::forecast::Forecaster;
use super::rule::OrderRule;
use super::sample::SamplePoint;
use crate::expansion::{LocalMap, MapOrders};

/// Most monomials of a leg, and of a contact while its depth variable is free.
const MONOMIALS: u64 = 13_000;

/// Highest orders, however few the variables.
const HIGHEST: MapOrders = MapOrders {
    smooth_order: 14,
    contact_weight: 20,
};

/// Most monomials of a fit.
const FITTED: usize = 800;

/// One expansion with what it forecasts.
pub(super) struct Level<'a> {
    pub(super) family: MapFamily<'a>,
    /// Every truncation, cheapest first.
    pub(super) candidates: Vec<Candidate>,
    /// How its terms fall.
    pub(super) rule: OrderRule,
    map: LocalMap,
    economiser: OnceCell<Option<Economiser>>,
}

impl<'a> Level<'a> {
    /// `points` are those that forecasts are made at.
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
            map: forecaster.map().clone(),
            economiser: OnceCell::new(),
            family,
        })
    }

    /// What every truncation leaves out, and this expansion as well.
    pub(super) fn remainder(&self) -> f64 {
        self.rule.error(self.family.highest())
    }

    /// Fits to the highest orders; `None` where they would take too long or the window has no points.
    pub(super) fn economiser(&self) -> Option<&Economiser> {
        let made = || {
            let small = Economiser::size(&self.map) <= FITTED;
            small
                .then(|| Economiser::new(self.map.clone()).ok())
                .flatten()
        };
        self.economiser.get_or_init(made).as_ref()
    }
}

/// The highest orders that are expanded for a number of variables.
pub(super) fn highest_orders(variables: usize) -> MapOrders {
    let within = |monomials: &dyn Fn(u32) -> u64, highest: u32| {
        let orders = (1..=highest).rev();
        orders
            .into_iter()
            .find(|&order| monomials(order) <= MONOMIALS)
            .unwrap_or(1)
    };
    let of_degree = |degree: u32| {
        // Monomials of one degree in so many variables.
        (1..variables as u64).fold(1, |count, k| count * (u64::from(degree) + k) / k)
    };
    let leg = |order: u32| (0..=order).map(of_degree).sum();
    let contact = |weight: u32| {
        let degrees = 0..=weight / 2;
        degrees
            .map(|degree| of_degree(degree) * u64::from(weight - 2 * degree + 1))
            .sum()
    };
    MapOrders {
        smooth_order: within(&leg, HIGHEST.smooth_order),
        contact_weight: within(&contact, HIGHEST.contact_weight),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_variables_have_lower_highest_orders() {
        let orders = [4, 6, 8].map(highest_orders);
        let pairs = orders.map(|orders| (orders.smooth_order, orders.contact_weight));
        // C(14 + 4, 4) = 3060, C(11 + 6, 6) = 12 376, C(8 + 8, 8) = 12 870.
        assert_eq!(pairs.map(|pair| pair.0), [14, 11, 8]);
        assert!(
            pairs.map(|pair| pair.1).is_sorted_by(|a, b| a >= b),
            "{pairs:?}"
        );
    }
}
