//! The orders that a tolerance needs, predicted from a low expansion.
//!
//! One idea: on the window the terms of each degree of the legs, and of each weight of the
//! contacts, fall as a power; where the tails of both reach half a tolerance is what to expand to.
//! See docs/mathematics/orders.md.

use super::forecast::Forecast;
use crate::expansion::MapOrders;

/// Orders that predictions are made from.
pub(super) const PROBE: MapOrders = MapOrders::new(4, 8);

/// Orders of a block of the legs, and of the contacts.
const LEG_PERIOD: usize = 1;
const CONTACT_PERIOD: usize = 4;

/// Ratios of blocks that are averaged, the last ones.
const AVERAGED: usize = 3;

/// Largest ratio of successive terms that is believed to converge.
const SLOWEST: f64 = 0.95;

/// Orders beyond which nothing is predicted.
const HIGHEST: u32 = 40;

/// How the terms of a map fall on its window.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderRule {
    /// Of the legs, by degree.
    pub legs: Decay,
    /// Of the contacts, by weight.
    pub contacts: Decay,
}

/// Sizes of terms by order: those known, and beyond them each over that of `period` orders before
/// by the same factor.
///
/// With deviations of weight 2 of which even powers matter more than odd ones, the terms of a
/// contact come in blocks of four weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Decay {
    /// What the terms of each order from 2 contribute to an image, in the units of the offsets.
    pub sizes: Vec<f64>,
    /// Orders of a block.
    pub period: usize,
    /// Factor from an order to the next, in the mean over a block.
    pub ratio: f64,
}

impl OrderRule {
    pub(super) fn new(forecast: &Forecast) -> Self {
        Self {
            legs: Decay::of(forecast.leg_sizes(), LEG_PERIOD),
            contacts: Decay::of(forecast.contact_sizes(), CONTACT_PERIOD),
        }
    }

    /// The least orders whose neglected terms come to at most half a tolerance each.
    ///
    /// ```
    /// use grazemap::convergence::{Decay, OrderRule};
    ///
    /// let decay = |sizes: &[f64]| Decay { sizes: sizes.to_vec(), period: 1, ratio: 0.1 };
    /// let rule = OrderRule { legs: decay(&[1e-2, 1e-3, 1e-4]), contacts: decay(&[1e-5, 1e-6]) };
    /// let orders = rule.orders(1e-6);
    /// // Σ_{n>6} 1e-4 · 0.1^(n−4) = 1.1e-7 and Σ_{w>3} 1e-6 · 0.1^(w−3) = 1.1e-7.
    /// assert_eq!((orders.smooth_order, orders.contact_weight), (6, 3));
    /// ```
    pub fn orders(&self, tolerance: f64) -> MapOrders {
        MapOrders {
            smooth_order: self.legs.order(0.5 * tolerance),
            contact_weight: self.contacts.order(0.5 * tolerance),
        }
    }

    /// What orders leave out, by the same power laws.
    pub fn error(&self, orders: MapOrders) -> f64 {
        self.legs.tail(orders.smooth_order) + self.contacts.tail(orders.contact_weight)
    }

    /// Whether the terms of both factors fall.
    pub fn converges(&self) -> bool {
        self.legs.ratio < SLOWEST && self.contacts.ratio < SLOWEST
    }
}

impl Decay {
    /// From sizes of the terms of orders 2, 3, …
    fn of(sizes: Vec<f64>, period: usize) -> Self {
        let factors = (period..sizes.len()).map(|at| sizes[at] / sizes[at - period]);
        let known: Vec<f64> = factors
            .filter(|factor| *factor > 0.0 && factor.is_finite())
            .collect();
        let last = &known[known.len().saturating_sub(AVERAGED)..];
        let logarithms: f64 = last.iter().map(|factor| factor.ln()).sum();
        let ratio = match last.len() {
            0 => 0.0,
            count => (logarithms / (count * period) as f64).exp(),
        };
        Self {
            sizes,
            period,
            ratio,
        }
    }

    /// What the terms beyond an order contribute.
    fn tail(&self, order: u32) -> f64 {
        let factor = self.ratio.min(SLOWEST).powi(self.period as i32);
        let size = |order: usize| match self.sizes.get(order - 2) {
            Some(size) => *size,
            None => {
                let beyond = order - 2 - self.sizes.len();
                let block = self.sizes.len().checked_sub(self.period);
                let last = block.map_or(0.0, |block| self.sizes[block + beyond % self.period]);
                last * factor.powi((1 + beyond / self.period) as i32)
            }
        };
        let first = (order as usize + 1).max(2);
        let end = first.max(self.sizes.len() + 2);
        let known: f64 = (first..end).map(size).sum();
        let block: f64 = (end..end + self.period).map(size).sum();
        known + block / (1.0 - factor)
    }

    /// The least order whose tail is within a bound.
    fn order(&self, bound: f64) -> u32 {
        let orders = 1..HIGHEST;
        orders
            .into_iter()
            .find(|&order| self.tail(order) <= bound)
            .unwrap_or(HIGHEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_in_blocks_is_found_and_continued() {
        // Two sizes a block, each block a hundredth of the one before.
        let decay = Decay::of(vec![1.0, 0.5, 1e-2, 5e-3, 1e-4], 2);
        assert!((decay.ratio - 0.1).abs() < 1e-12, "{decay:?}");
        // Orders 2 to 6 are known; 7 is 5e-5, 8 is 1e-6.
        let geometric = 1.0 / 0.99;
        assert!((decay.tail(6) / ((5e-5 + 1e-6) * geometric) - 1.0).abs() < 1e-12);
        assert!((decay.tail(7) / ((1e-6 + 5e-7) * geometric) - 1.0).abs() < 1e-12);
        assert!((decay.tail(1) - 1.51515151515).abs() < 1e-10);
    }

    #[test]
    fn the_tail_of_the_order_found_is_within_the_bound_and_of_one_less_it_is_not() {
        let decay = Decay::of(vec![1.0, 0.3, 0.09, 0.027], 1);
        for bound in [1e-1, 1e-5, 1e-9] {
            let order = decay.order(bound);
            assert!(
                decay.tail(order) <= bound && decay.tail(order - 1) > bound,
                "{bound}"
            );
        }
    }
}
