//! Digits of the coefficients lost to rounding.
//!
//! One idea: expand again in double-double, by the independent route (Taylor's method instead of
//! collocation), at a low order where that is cheap, and compare degree by degree.

use super::error::ExpansionError;
use super::expand::{Expander, Legs};
use super::local_map::Leg;
use crate::jet::Jet;
use crate::model::MapOrders;
use crate::numeric::{Dd, Real};

/// Highest order of `P_smooth` that is expanded again.
const SMOOTH_ORDER: u32 = 2;
/// A number of products of a field, and the order of those with more.
const SMOOTH_ORDER_OF_MANY: (usize, u32) = (100, 1);
/// Weight to which `D` is always expanded again, and beyond it as far as the space has no more
/// monomials than this.
const CONTACT_WEIGHT: u32 = 6;
const MONOMIALS: usize = 1000;
/// All digits of double precision: no more can be lost.
const ALL: f64 = 15.95;

/// Decimal digits lost per output coordinate: `log10` of the largest error of a coefficient,
/// relative to the largest of its degree, in units of roundoff; from 0 to the 16 digits of double
/// precision.
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
    /// Estimates the digits lost in a map of these orders: of `P_smooth` from its lower degrees, of
    /// `D` from all where its space is small, otherwise from weight 6.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] as the expansions themselves.
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
        let linear = contact.linear.iter().zip(&exact.linear);
        let quadratic = contact.quadratic.iter().zip(&exact.quadratic);
        let lost = |((linear, exact_linear), (quadratic, exact_quadratic))| {
            let (linear, quadratic) = (
                Compared::new(linear, exact_linear, &units),
                Compared::new(quadratic, exact_quadratic, &units),
            );
            // A part that vanishes but for rounding is measured against the other.
            let all = linear.largest().max(quadratic.largest());
            linear.lost(all).max(quadratic.lost(all))
        };
        Ok(linear.zip(quadratic).map(lost).collect())
    }

    /// The highest weight, at most the one asked, to which a contact is expanded twice at little
    /// cost.
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

/// The largest loss of each coordinate.
fn worst(losses: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = 0..losses.first().map_or(0, Vec::len);
    let worst = |coordinate: usize| losses.iter().map(|loss| loss[coordinate]).fold(0.0, f64::max);
    coordinates.map(worst).collect()
}

/// A jet and its exact value, every variable in its unit.
struct Compared<'a> {
    jet: &'a Jet<f64>,
    exact: Vec<f64>,
    errors: Vec<f64>,
}

impl<'a> Compared<'a> {
    fn new(jet: &'a Jet<f64>, exact: &Jet<Dd>, units: &[f64]) -> Self {
        let unit = |exponents: &[u8]| {
            let powers = exponents.iter().zip(units);
            powers.fold(1.0, |unit, (&power, size)| unit * size.powi(power.into()))
        };
        let sizes = |pair: ((&[u8], Dd), &f64)| {
            let ((exponents, exact), &found) = pair;
            let unit = unit(exponents);
            let error = (Dd::from(found) - exact).to_f64().abs() * unit;
            (exact.to_f64().abs() * unit, error)
        };
        let (exact, errors) = exact.terms().zip(jet.coefficients()).map(sizes).unzip();
        Self { jet, exact, errors }
    }

    fn largest(&self) -> f64 {
        largest(&self.exact)
    }

    /// Digits lost, the worst over the degrees.
    ///
    /// Degrees whose coefficients vanish but for rounding are measured against `all`, the largest
    /// of the whole.
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

/// Below this share of the largest coefficient a whole degree counts as zero.
const VANISHING: f64 = 1e-13;

fn largest(sizes: &[f64]) -> f64 {
    sizes.iter().copied().fold(0.0, larger)
}

/// The larger of two, NaN winning.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
