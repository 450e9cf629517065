//! One expansion that maps are chosen from, and the highest that are made.

use std::cell::OnceCell;

use super::ConvergenceError;
use super::candidates::{Candidate, candidates};
use super::economise::Economiser;
use super::family::MapFamily;
use super::forecast::Forecaster;
use super::rule::OrderRule;
use super::sample::SamplePoint;
use crate::expansion::{DEVIATION_WEIGHT, LocalMap, MapOrders, Stage, Variables};
use crate::jet::JetSpace;

/// Most monomials of a leg, of the depth, and of a contact while its depth variable stands in the
/// place of a coordinate: a whole product of two such series has up to ten million terms.
const MONOMIALS: u128 = 20_000;

/// Highest orders of a first search, however few the variables.
const HIGHEST: MapOrders = MapOrders::new(14, 20);

/// Highest orders of all: where no lower ones serve and terms do fall.
const DEEPEST: MapOrders = MapOrders::new(14, 40);

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

    /// About how many products of coefficients the composition of a candidate takes: of the spaces
    /// in which stages are substituted, for every monomial in the coordinates.
    pub(super) fn products(&self, candidate: &Candidate) -> u128 {
        let coordinates = self.map.dimension();
        let MapOrders {
            smooth_order,
            contact_weight,
        } = candidate.orders;
        let variables = self.family.expander().variables();
        let weights = &candidate.weights_of(&variables.weights[..coordinates]);
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

    /// Fits to the highest orders; `None` where they would take too long or the window has no
    /// points.
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

/// The highest orders that are expanded, first and where those do not serve.
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
        orders
            .find(|&order| monomials(order) <= MONOMIALS)
            .unwrap_or(1)
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
        // C(14 + 4, 4) = 3060, C(12 + 6, 6) = 18 564, C(8 + 8, 8) = 12 870 monomials of a leg; with
        // y for one of the variables 19 481, 16 016 and 19 305 of a contact to weights 40,
        // 21 and 16.
        let expected = [
            ((14, 20), (14, 40)),
            ((12, 20), (12, 21)),
            ((8, 16), (8, 16)),
        ];
        assert_eq!(orders, expected);
    }
}
