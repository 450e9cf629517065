//! How many digits rounding took from the coefficients.
//!
//! One idea: expand again in double-double, by the independent route (Taylor's method instead of
//! collocation), at a low order where that is cheap, and compare degree by degree.

use super::{Contact, Expander, ExpansionError, Legs, MapOrders};
use crate::jet::Jet;
use crate::numeric::Dd;

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
    /// Of `D`.
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
        let (legs, exact_legs) = (self.legs(degree)?, self.legs_by_taylor::<Dd>(degree)?);
        let (contact, exact) = (self.contact(weight)?, self.contact_in::<Dd>(weight)?);
        let coordinates = 0..self.variables().coordinates;
        Ok(LostDigits {
            smooth: coordinates
                .clone()
                .map(|i| lost_by_legs(&legs, &exact_legs, i))
                .collect(),
            discontinuity: coordinates
                .map(|i| lost_by_contact(&contact, &exact, i))
                .collect(),
        })
    }
}

fn lost_by_legs(legs: &Legs, exact: &Legs<Dd>, coordinate: usize) -> f64 {
    let after = lost(
        &legs.after.image[coordinate],
        &exact.after.image[coordinate],
    );
    match (&legs.before, &exact.before) {
        (Some(before), Some(exact)) => {
            after.max(lost(&before.image[coordinate], &exact.image[coordinate]))
        }
        _ => after,
    }
}

fn lost_by_contact(contact: &Contact, exact: &Contact<Dd>, coordinate: usize) -> f64 {
    let linear = lost(&contact.linear[coordinate], &exact.linear[coordinate]);
    let quadratic = lost(&contact.quadratic[coordinate], &exact.quadratic[coordinate]);
    linear.max(quadratic)
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
