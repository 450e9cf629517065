//! How many digits rounding took from the coefficients.
//!
//! One idea: expand again in double-double, by the independent route (Taylor's method instead of
//! collocation), at a low order where that is cheap, and compare degree by degree.

use super::{Expander, ExpansionError, Leg, Legs, MapOrders};
use crate::jet::Jet;
use crate::numeric::{Dd, Real};

/// Highest degree of `P_smooth` that is expanded again.
const SMOOTH_ORDER: u32 = 2;
/// Highest weight of `D` that is expanded again.
const CONTACT_WEIGHT: u32 = 6;

/// Decimal digits lost per output coordinate: `log10` of the largest error of a coefficient, relative to
/// the largest of its degree, in units of roundoff; at least 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LostDigits {
    /// Of `P_smooth` (the worst of the legs).
    pub smooth: Vec<f64>,
    /// Of `D` (the worst of the passages).
    pub discontinuity: Vec<f64>,
}

impl Expander<'_> {
    /// Estimates the digits lost in a map of these orders from its lower degrees.
    ///
    /// # Errors
    ///
    /// [`ExpansionError`] as the expansions themselves.
    pub fn lost_digits(&self, orders: MapOrders) -> Result<LostDigits, ExpansionError> {
        let degree = orders.smooth_order.min(SMOOTH_ORDER);
        let weight = orders.contact_weight.min(CONTACT_WEIGHT);
        let (legs, exact) = (self.legs(degree)?, self.legs_by_taylor::<Dd>(degree)?);
        let legs: Vec<_> = all(&legs).zip(all(&exact)).map(lost_by_leg).collect();
        let contacts = (0..self.passages())
            .map(|passage| self.lost_by_contact(passage, weight))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(LostDigits {
            smooth: worst(&legs),
            discontinuity: worst(&contacts),
        })
    }

    fn lost_by_contact(&self, passage: usize, weight: u32) -> Result<Vec<f64>, ExpansionError> {
        let (contact, exact) = (
            self.contact(passage, weight)?,
            self.contact_in::<Dd>(passage, weight)?,
        );
        let linear = contact.linear.iter().zip(&exact.linear);
        let quadratic = contact.quadratic.iter().zip(&exact.quadratic);
        let pairs = linear.zip(quadratic);
        Ok(pairs
            .map(|((l, exact_l), (q, exact_q))| lost(l, exact_l).max(lost(q, exact_q)))
            .collect())
    }
}

fn all<S: Real>(legs: &Legs<S>) -> impl Iterator<Item = &Leg<S>> {
    legs.before.iter().chain(&legs.after)
}

fn lost_by_leg((leg, exact): (&Leg, &Leg<Dd>)) -> Vec<f64> {
    let pairs = leg.image.iter().zip(&exact.image);
    pairs.map(|(jet, exact)| lost(jet, exact)).collect()
}

/// The largest loss of each coordinate.
fn worst(losses: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = 0..losses.first().map_or(0, Vec::len);
    let worst = |coordinate: usize| {
        losses
            .iter()
            .map(|loss| loss[coordinate])
            .fold(0.0, f64::max)
    };
    coordinates.map(worst).collect()
}

/// Digits lost by a jet, the worst over its degrees.
///
/// Degrees whose coefficients vanish but for rounding are measured against the largest of the jet.
fn lost(jet: &Jet<f64>, exact: &Jet<Dd>) -> f64 {
    let space = jet.space();
    let all = largest(exact.coefficients());
    let worst = (0..=space.order())
        .map(|degree| {
            let range = space.degree_range(degree);
            let exact = &exact.coefficients()[range.clone()];
            let of_degree = largest(exact);
            let scale = if of_degree > VANISHING * all {
                of_degree
            } else {
                all
            };
            let pairs = jet.coefficients()[range].iter().zip(exact);
            let errors = pairs.map(|(&a, &b)| (Dd::from(a) - b).to_f64().abs());
            let error = errors.fold(0.0, f64::max);
            if scale > 0.0 {
                error / (scale * f64::EPSILON)
            } else {
                0.0
            }
        })
        .fold(1.0, f64::max);
    worst.log10()
}

/// Below this share of a jet's largest coefficient a whole degree counts as zero.
const VANISHING: f64 = 1e-13;

fn largest(coefficients: &[Dd]) -> f64 {
    coefficients
        .iter()
        .map(|value| value.to_f64().abs())
        .fold(0.0, f64::max)
}
