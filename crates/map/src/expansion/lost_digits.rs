//! Properties of a map that its expansion gives: digits of the coefficients lost to rounding, and
//! the lengths on which its polynomials vary.
//!
//! Digits: expansion is repeated in double-double, by the independent route (Taylor's method
//! instead of collocation), at a low order at which that is cheap, and compared degree by degree.

use super::error::ExpansionError;
use super::expand::{Expander, Legs};
use super::local_map::{Leg, LocalMap, MapWindow, Stage};
use super::pruning::monomial_size;
use super::variables::DEVIATION_WEIGHT;
use crate::jet::Jet;
use crate::model::MapOrders;
use crate::numeric::{Dd, Real};

/// Highest order of `P_smooth` in the repeated expansion.
const SMOOTH_ORDER: u32 = 2;
/// Number of products in a field, and the order used for fields with more.
const SMOOTH_ORDER_OF_MANY: (usize, u32) = (100, 1);
/// Weight to which `D` is always expanded again; higher weights are used while the space has at
/// most `MONOMIALS` monomials.
const CONTACT_WEIGHT: u32 = 6;
const MONOMIALS: usize = 1000;
/// All digits of double precision: no more can be lost.
const ALL: f64 = 15.95;

/// Decimal digits lost per output coordinate: `log10` of the largest error of a coefficient,
/// relative to the largest coefficient of its degree, in units of roundoff. The range is 0 to the
/// 16 digits of double precision.
///
/// Deviations are measured in their own sizes (that of the states, that of each parameter), so that
/// a length of `1e-15` beside a frequency of 1 hides nothing.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LostDigits {
    /// Digits lost in `P_smooth` (the worst of the legs).
    pub smooth: Vec<f64>,
    /// Digits lost in `D` (the worst of the passages).
    pub discontinuity: Vec<f64>,
}

impl Expander<'_> {
    /// Estimates the digits lost in a map of these orders: in `P_smooth` from its lower degrees; in
    /// `D` from all degrees if its space is small, otherwise up to weight 6.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] as for the expansions themselves.
    pub fn lost_digits(&self, orders: MapOrders) -> Result<LostDigits, ExpansionError> {
        let (many, order_of_many) = SMOOTH_ORDER_OF_MANY;
        let is_long = self.products_of_step() > many;
        let order = if is_long { order_of_many } else { SMOOTH_ORDER }.min(orders.smooth_order);
        let (legs, exact) = (self.legs(order)?, self.legs_by_taylor::<Dd>(order)?);
        let units = self.units(self.section_passage());
        let legs = all(&legs).zip(all(&exact));
        let legs: Vec<_> = legs.map(|pair| lost_by_leg(pair, &units)).collect();
        let contacts = (0..self.passages())
            .map(|passage| self.lost_by_contact(passage, orders.contact_weight))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(LostDigits { smooth: worst(&legs), discontinuity: worst(&contacts) })
    }

    fn lost_by_contact(&self, passage: usize, weight: u32) -> Result<Vec<f64>, ExpansionError> {
        let weight = self.affordable_weight(passage, weight)?;
        let (contact, exact) =
            (self.contact(passage, weight)?, self.contact_in::<Dd>(passage, weight)?);
        let units = self.units(passage);
        let lost = |coordinate: usize| {
            let parts = contact.corrections(coordinate).zip(exact.corrections(coordinate));
            let parts: Vec<_> =
                parts.map(|(own, exact)| Compared::new(own, exact, &units)).collect();
            // A part that is zero to rounding is measured against the others.
            let all = parts.iter().map(Compared::largest).fold(0.0, f64::max);
            parts.iter().map(|part| part.lost(all)).fold(0.0, f64::max)
        };
        Ok((0..contact.linear.len()).map(lost).collect())
    }

    /// Highest weight, at most `asked`, to which a contact can be expanded twice at little cost.
    fn affordable_weight(&self, passage: usize, asked: u32) -> Result<u32, ExpansionError> {
        let variables = self.variables_at(passage);
        let mut weight = asked.min(CONTACT_WEIGHT);
        while weight < asked && variables.contact_space(weight + 1)?.len() <= MONOMIALS {
            weight += 1;
        }
        Ok(weight)
    }
}

fn all<S: Real>(legs: &Legs<S>) -> impl Iterator<Item = &Leg<S>> {
    legs.before.iter().chain(&legs.after)
}

fn lost_by_leg((leg, exact): (&Leg, &Leg<Dd>), units: &[f64]) -> Vec<f64> {
    let pairs = leg.image.iter().zip(&exact.image);
    let lost = |(jet, exact)| {
        let compared = Compared::new(jet, exact, units);
        compared.lost(compared.largest())
    };
    pairs.map(lost).collect()
}

/// Largest loss of each coordinate.
fn worst(losses: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = 0..losses.first().map_or(0, Vec::len);
    let worst = |coordinate: usize| losses.iter().map(|loss| loss[coordinate]).fold(0.0, f64::max);
    coordinates.map(worst).collect()
}

/// A jet and its exact value, with every variable in its unit.
struct Compared<'a> {
    jet: &'a Jet<f64>,
    exact: Vec<f64>,
    errors: Vec<f64>,
}

impl<'a> Compared<'a> {
    fn new(jet: &'a Jet<f64>, exact: &Jet<Dd>, units: &[f64]) -> Self {
        let sizes = |((exponents, exact), &found): ((&[u8], Dd), &f64)| {
            let unit = monomial_size(exponents, units);
            let error = (Dd::from(found) - exact).to_f64().abs() * unit;
            (exact.to_f64().abs() * unit, error)
        };
        let (exact, errors) = exact.terms().zip(jet.coefficients()).map(sizes).unzip();
        Self { jet, exact, errors }
    }

    fn largest(&self) -> f64 {
        largest(&self.exact)
    }

    /// Digits lost, the largest over the degrees.
    ///
    /// Degrees whose coefficients are zero to rounding are measured against `all`, the largest
    /// coefficient of the whole.
    fn lost(&self, all: f64) -> f64 {
        let space = self.jet.space();
        let worst = (0..=space.order())
            .map(|degree| {
                let range = space.degree_range(degree);
                let of_degree = largest(&self.exact[range.clone()]);
                let scale = if of_degree > VANISHING * all { of_degree } else { all };
                if scale > 0.0 {
                    largest(&self.errors[range]) / (scale * f64::EPSILON)
                } else {
                    0.0
                }
            })
            .fold(1.0, larger);
        if worst.is_finite() { worst.log10().min(ALL) } else { ALL }
    }
}

/// A degree whose coefficients are below this share of the largest coefficient counts as zero.
const VANISHING: f64 = 1e-13;

fn largest(sizes: &[f64]) -> f64 {
    sizes.iter().copied().fold(0.0, larger)
}

/// The larger of two values; NaN if one is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Natural sizes of the depth and of the variables of a map, which are the lengths on which its
/// polynomials vary, and the weights by which they scale.
///
/// A window that is to be measured needs a shape before it has a size. A variable has the size at
/// which some monomial in it alone moves an image by the size of a state, or its own size if that
/// is smaller. The depth has the size that belongs to a period of the free motion, `h'' (T/2π)²`.
/// Under the weights of the expansion (`y` has weight 1) one factor scales them all.
#[derive(Clone, Debug, PartialEq)]
pub struct NaturalWindow {
    /// Largest `y²` within the radius of convergence of every series in `y`; `None` if no series is
    /// infinite.
    pub reach: Option<f64>,
    depth: f64,
    coordinates: usize,
    widths: Vec<f64>,
    weights: Vec<u32>,
}

impl NaturalWindow {
    /// The window scaled by a factor: the depth and variables of weight 2 by the factor itself, a
    /// variable of weight `w` by its power `w/2`.
    pub fn scaled(&self, factor: f64) -> MapWindow {
        let pairs = self.widths.iter().zip(&self.weights);
        let scaled = pairs.map(|(width, &weight)| {
            width * factor.powf(f64::from(weight) / f64::from(DEVIATION_WEIGHT))
        });
        let mut state: Vec<f64> = scaled.collect();
        let parameter = state.split_off(self.coordinates);
        MapWindow { depth: self.depth * factor, state, parameter }
    }
}

impl Expander<'_> {
    /// Natural sizes of a map of this scene. The depth is no larger than `reach`, the square of the
    /// smallest radius of its series in `y`.
    pub fn natural_window(&self, map: &LocalMap, reach: Option<f64>) -> NaturalWindow {
        let passage = self.section_passage();
        let units = self.units(passage);
        let depths = (0..self.passages()).map(|passage| self.depth_unit(passage));
        let depth = depths.chain(reach).fold(f64::INFINITY, f64::min);
        let coordinates = map.dimension();
        let mut widths = units.clone();
        let mut limit = |jets: &[Jet<f64>], share: f64| {
            for (jet, unit) in jets.iter().zip(&units[..coordinates]) {
                narrow(&mut widths, jet, unit / share);
            }
        };
        for stage in &map.stages {
            match stage {
                Stage::Leg(leg) => limit(&leg.image, 1.0),
                Stage::Contact(contact) => {
                    limit(&contact.linear, depth.sqrt());
                    limit(&contact.quadratic, depth);
                    for (exponent, term) in contact.powers.with_exponents() {
                        let factor = depth.powf(0.5 * exponent);
                        limit(&term.linear, factor * depth.sqrt());
                        limit(&term.quadratic, factor * depth);
                    }
                }
                // Polynomials of a flown contact are not those of an image.
                Stage::Flown(_) => {}
            }
        }
        let weights = self.variables().weights.clone();
        NaturalWindow { reach, depth, coordinates, widths, weights }
    }
}

/// Narrows every width to the value at which a monomial in that variable alone reaches a size.
fn narrow(widths: &mut [f64], jet: &Jet<f64>, size: f64) {
    for (powers, value) in jet.terms() {
        let mut varied = (0..powers.len()).filter(|&variable| powers[variable] > 0);
        if let (Some(variable), None) = (varied.next(), varied.next()) {
            let reached = (size / value.abs()).powf(1.0 / f64::from(powers[variable]));
            widths[variable] = widths[variable].min(reached);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    #[test]
    fn a_variable_is_as_large_as_its_steepest_monomial_allows() {
        // 2 a + 16 a^4 + 5 a b reaches 1 at a = 1/2 by either; mixed monomials do not limit b.
        let space = JetSpace::uniform(2, 4).expect("a small space");
        let [a, b] = [0, 1].map(|at| Jet::variable(&space, at, 0.0));
        let fourth = &(&a * &a) * &(&a * &a);
        let [two, sixteen, five] = [2.0, 16.0, 5.0].map(|value| Jet::constant(&space, value));
        let jet = &(&(&two * &a) + &(&sixteen * &fourth)) + &(&five * &(&a * &b));
        let mut widths = [3.0, 3.0];
        narrow(&mut widths, &jet, 1.0);
        assert_eq!(widths, [0.5, 3.0]);
    }
}
