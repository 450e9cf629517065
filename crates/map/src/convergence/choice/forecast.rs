//! Truncation errors forecast from one expansion of higher order, and the orders predicted from it
//! for a tolerance.
//!
//! At a point of the sample the stages act one after another. If a monomial `m` of a stage lies
//! beyond a cut, the truncation error is `c m(x)` at the input of the stage, and the Jacobian of
//! the following stages carries it to the image. Monomials are summed by weighted degree, so that
//! one pass forecasts every cut. On the window the terms of each degree of the legs, and of each
//! weight of the contacts, fall as a power; the predicted orders are those at which the tails of
//! both reach half the tolerance. See docs/mathematics/orders.md.

use crate::analysis::MapEvaluation;
use crate::convergence::sample::SamplePoint;
use crate::expansion::{Contact, DEVIATION_WEIGHT, LocalMap, MapOrders, Stage};
use crate::jet::Jet;

/// Step of a difference quotient, relative to the state: less than the margin of a second contact
/// on its verge.
const STEP: f64 = 1e-9;

/// A map followed stage by stage from sample points, from which forecasts for any weights are made.
#[derive(Clone, Debug)]
pub(super) struct Forecaster {
    /// The map of higher order.
    pub(super) map: LocalMap,
    /// Inputs of the stages, by point, then by stage.
    routes: Vec<Vec<StageInput>>,
}

/// Input of a stage on the path of a point, and its effect on the image.
#[derive(Clone, Debug)]
struct StageInput {
    /// Input of the stage: coordinates and parameters.
    here: Vec<f64>,
    /// Jacobian of the following stages, row by row.
    jacobian: Vec<Vec<f64>>,
}

/// Forecasts for one choice of weights: at each point, the truncation error of each cut in the
/// image.
#[derive(Clone, Debug)]
pub(super) struct Forecast {
    /// Effects of the legs, by point, then by degree from 1.
    smooth: Vec<Effects>,
    /// Effects of the contacts, by point, then by weight from 1.
    contact: Vec<Effects>,
}

/// Truncation errors by cut, then by coordinate of the image.
type Effects = Vec<Vec<f64>>;

impl Forecaster {
    /// Follows sample points through a map.
    pub(super) fn new(map: LocalMap, points: &[SamplePoint]) -> Self {
        let count = map.stages.len();
        let part = |numbers| MapEvaluation::stages(&map, numbers);
        let parts = (0..count).map(|number| [part(number..number + 1), part(number + 1..count)]);
        let parts: Vec<_> = parts.collect();
        let routes = points.iter().map(|point| route(point, &parts)).collect();
        Self { map, routes }
    }

    /// Forecast with given weights of (coordinates; parameters).
    pub(super) fn forecast(&self, weights: &[u32]) -> Forecast {
        let degrees: Vec<_> = self.map.stages.iter().map(|s| degrees(s, weights)).collect();
        let of = |route: &Vec<StageInput>| at_point(&self.map, route, &degrees);
        let (smooth, contact) = self.routes.iter().map(of).unzip();
        Forecast { smooth, contact }
    }
}

impl Forecast {
    /// Largest truncation error of a coordinate at a pair of orders, over the points. It is no
    /// bound, because higher terms are missing.
    pub(super) fn error(&self, orders: MapOrders) -> f64 {
        let (n, w) = (orders.smooth_order as usize - 1, orders.contact_weight as usize - 1);
        let pairs = self.smooth.iter().zip(&self.contact);
        let sizes = pairs.flat_map(|(smooth, contact)| {
            let sums = smooth[n].iter().zip(&contact[w]);
            sums.map(|(leg, contact)| (leg + contact).abs())
        });
        sizes.fold(0.0, f64::max)
    }
}

/// Contribution to the image of the terms of each degree of the legs, or of each weight of the
/// contacts, from 2: the largest difference, over points and coordinates, between a cut and the one
/// before it.
fn sizes(effects: &[Effects]) -> Vec<f64> {
    let cuts = effects.first().map_or(0, Vec::len);
    let size = |cut: usize| {
        let differences = effects.iter().flat_map(|effects| {
            let pairs = effects[cut - 1].iter().zip(&effects[cut]);
            pairs.map(|(before, after)| (before - after).abs())
        });
        differences.fold(0.0, f64::max)
    };
    (1..cuts).map(size).collect()
}

/// Inputs of all stages on the path of a point; `parts` holds each stage and the stages that follow
/// it.
fn route(point: &SamplePoint, parts: &[[MapEvaluation<f64>; 2]]) -> Vec<StageInput> {
    let mut here = [point.state.as_slice(), &point.parameters].concat();
    let mut inputs = Vec::with_capacity(parts.len());
    for [stage, rest] in parts {
        let image = stage.image(&here[..point.state.len()], &point.parameters);
        inputs.push(StageInput {
            jacobian: jacobian(rest, &image.offsets, &point.parameters),
            here: here.clone(),
        });
        here[..point.state.len()].copy_from_slice(&image.offsets);
    }
    inputs
}

/// Weighted degrees of the monomials in the spaces of a stage: of a leg, or of a depth and the two
/// parts of a correction.
fn degrees(stage: &Stage, weights: &[u32]) -> Vec<Vec<usize>> {
    let of = |jet: Option<&Jet<f64>>| jet.map_or(Vec::new(), |jet| weighted_degrees(jet, weights));
    match stage {
        Stage::Leg(leg) => vec![of(leg.image.first())],
        Stage::Contact(law) => {
            vec![of(Some(&law.depth)), of(law.linear.first()), of(law.quadratic.first())]
        }
        Stage::Flown(_) => Vec::new(),
    }
}

/// Weighted degree of every monomial of a jet's space.
pub(super) fn weighted_degrees(jet: &Jet<f64>, weights: &[u32]) -> Vec<usize> {
    let degree = |(exponents, _): (&[u8], f64)| {
        let pairs = exponents.iter().zip(weights);
        pairs.map(|(&exponent, &weight)| usize::from(exponent) * weight as usize).sum()
    };
    jet.terms().map(degree).collect()
}

fn at_point(
    map: &LocalMap,
    route: &[StageInput],
    degrees: &[Vec<Vec<usize>>],
) -> (Effects, Effects) {
    let dimension = map.dimension();
    let mut smooth = vec![vec![0.0; dimension]; map.orders.smooth_order as usize];
    let mut contact = vec![vec![0.0; dimension]; map.orders.contact_weight as usize];
    for ((stage, input), degrees) in map.stages.iter().zip(route).zip(degrees) {
        let (cuts, effects) = match stage {
            Stage::Leg(leg) => {
                let sums = all_sums(&leg.image, &degrees[0], &input.here);
                let left = |cut: usize| {
                    let degree = DEVIATION_WEIGHT as usize * cut;
                    sums.iter().map(|sums| sums.beyond(degree)).collect()
                };
                let cuts: Effects = (1..=smooth.len()).map(left).collect();
                (cuts, &mut smooth)
            }
            Stage::Contact(law) => {
                let cuts = contact_cuts(law, degrees, &input.here, contact.len());
                (cuts, &mut contact)
            }
            Stage::Flown(_) => continue,
        };
        for (effect, cut) in effects.iter_mut().zip(&cuts) {
            for (row, sum) in input.jacobian.iter().zip(effect.iter_mut()) {
                *sum += row.iter().zip(cut).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
    (smooth, contact)
}

/// Truncation error of a contact `x + y B + y² C` at each weight: the terms of `B` and `C` beyond
/// the cut, and those of the depth through `δy = δ(y²)/2y`.
fn contact_cuts(law: &Contact, degrees: &[Vec<usize>], here: &[f64], count: usize) -> Effects {
    let depths = &all_sums(std::slice::from_ref(&law.depth), &degrees[0], here)[0];
    let depth = depths.total();
    if depth <= 0.0 {
        return vec![vec![0.0; law.linear.len()]; count];
    }
    let y = depth.sqrt();
    let linear = all_sums(&law.linear, &degrees[1], here);
    let quadratic = all_sums(&law.quadratic, &degrees[2], here);
    let left = |weight: usize| {
        let shift = 0.5 * depths.beyond(weight + 1) / y;
        let of_coordinate = |(b, c): (&Sums, &Sums)| {
            let quadratic = match weight.checked_sub(2) {
                Some(degree) => c.beyond(degree),
                None => c.total(),
            };
            let steepness = b.total() + 2.0 * y * c.total();
            y * (b.beyond(weight - 1) + y * quadratic) + shift * steepness
        };
        linear.iter().zip(&quadratic).map(of_coordinate).collect()
    };
    (1..=count).map(left).collect()
}

/// Sums of a polynomial's terms at a point, by weighted degree.
#[derive(Debug, Default)]
struct Sums(Vec<f64>);

/// Sums of each of several polynomials of one space.
fn all_sums(jets: &[Jet<f64>], degrees: &[usize], here: &[f64]) -> Vec<Sums> {
    let mut monomials = Vec::with_capacity(degrees.len());
    if let Some(jet) = jets.first() {
        jet.space().monomials_at(here, &mut monomials);
    }
    let highest = degrees.iter().copied().max().unwrap_or(0);
    let of = |jet: &Jet<f64>| {
        let mut sums = vec![0.0; highest + 1];
        let terms = jet.coefficients().iter().zip(&monomials).zip(degrees);
        terms.for_each(|((coefficient, monomial), &degree)| sums[degree] += coefficient * monomial);
        Sums(sums)
    };
    jets.iter().map(of).collect()
}

impl Sums {
    fn beyond(&self, degree: usize) -> f64 {
        self.0.iter().skip(degree + 1).sum()
    }

    fn total(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// Jacobian of the following stages, row by row.
fn jacobian(rest: &MapEvaluation<f64>, state: &[f64], parameters: &[f64]) -> Vec<Vec<f64>> {
    let size = state.iter().fold(0.0f64, |max, value| max.max(value.abs()));
    let step = STEP * if size > 0.0 { size } else { 1.0 };
    let mut rows = vec![vec![0.0; state.len()]; state.len()];
    for column in 0..state.len() {
        let at = |sign: f64| {
            let mut shifted = state.to_vec();
            shifted[column] += sign * step;
            rest.image(&shifted, parameters).offsets
        };
        let (above, below) = (at(1.0), at(-1.0));
        for (row, (a, b)) in rows.iter_mut().zip(above.iter().zip(&below)) {
            row[column] = (a - b) / (2.0 * step);
        }
    }
    rows
}

/// Number of orders in a block of the legs, and of the contacts.
const LEG_PERIOD: usize = 1;
const CONTACT_PERIOD: usize = 4;

/// Number of ratios of blocks that are averaged, the last ones.
const AVERAGED: usize = 3;

/// Largest ratio of successive terms that counts as convergence.
const SLOWEST: f64 = 0.95;

/// Highest order that is predicted.
const HIGHEST: u32 = 40;

/// Decay of the terms of a map on its window.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderRule {
    /// Decay of the legs, by degree.
    pub legs: Decay,
    /// Decay of the contacts, by weight.
    pub contacts: Decay,
}

/// Sizes of terms by order. Beyond the known orders, each size is that of `period` orders before
/// times a fixed factor.
///
/// If deviations have weight 2 and their even powers matter more than odd ones, the terms of a
/// contact come in blocks of four weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Decay {
    /// Contribution of the terms of each order from 2 to an image, in the units of the offsets.
    pub sizes: Vec<f64>,
    /// Number of orders in a block.
    pub period: usize,
    /// Mean factor from an order to the next, over a block.
    pub ratio: f64,
}

impl OrderRule {
    pub(super) fn new(forecast: &Forecast) -> Self {
        Self {
            legs: Decay::of(sizes(&forecast.smooth), LEG_PERIOD),
            contacts: Decay::of(sizes(&forecast.contact), CONTACT_PERIOD),
        }
    }

    /// Lowest orders whose neglected terms amount to at most half a tolerance each.
    ///
    /// ```
    /// use grazemap_map::convergence::{Decay, OrderRule};
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

    /// Truncation error at given orders, by the same power laws.
    pub fn error(&self, orders: MapOrders) -> f64 {
        self.legs.tail(orders.smooth_order) + self.contacts.tail(orders.contact_weight)
    }

    /// Whether the terms of both factors fall.
    pub fn converges(&self) -> bool {
        self.legs.ratio < SLOWEST && self.contacts.ratio < SLOWEST
    }
}

impl Decay {
    /// Decay from the sizes of the terms of orders 2, 3, …
    fn of(sizes: Vec<f64>, period: usize) -> Self {
        let factors = (period..sizes.len()).map(|at| sizes[at] / sizes[at - period]);
        let known: Vec<f64> =
            factors.filter(|factor| *factor > 0.0 && factor.is_finite()).collect();
        let last = &known[known.len().saturating_sub(AVERAGED)..];
        let logarithms: f64 = last.iter().map(|factor| factor.ln()).sum();
        let ratio = match last.len() {
            0 => 0.0,
            count => (logarithms / (count * period) as f64).exp(),
        };
        Self { sizes, period, ratio }
    }

    /// Contribution of the terms beyond an order.
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

    /// Lowest order whose tail is within a bound.
    fn order(&self, bound: f64) -> u32 {
        let orders = 1..HIGHEST;
        orders.into_iter().find(|&order| self.tail(order) <= bound).unwrap_or(HIGHEST)
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
            assert!(decay.tail(order) <= bound && decay.tail(order - 1) > bound, "{bound}");
        }
    }
}
