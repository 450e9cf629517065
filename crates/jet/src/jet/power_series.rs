//! Power series in a jet, `Σ_k c_k t^k`.
//!
//! One idea: by Horner's rule the sum that is yet to be multiplied by `t^k` matters only up to the
//! order less `k` times the lowest degree of `t`, and vanishes below a degree of its own. Most of
//! the products are short: with `t` of degree 1, of the work of full ones about one part in as many
//! as the space has variables is left.

use super::Jet;
use crate::numeric::Scalar;

/// `Σ_k c_k t^k`, to the order of the space.
///
/// Of `c_k` only what `t^k` does not lift above the order is read. The sum is that of an infinite
/// series if `t` has no constant term and the coefficients reach the power at which `t^k` vanishes:
/// the order over the lowest degree of `t`.
///
/// # Panics
///
/// If the jets' spaces differ.
///
/// ```
/// use grazemap_jet::jet::{Jet, JetSpace, power_series_at};
/// let space = JetSpace::uniform(2, 4)?;
/// let (x, y) = (Jet::variable(&space, 0, 0.0), Jet::variable(&space, 1, 0.0));
/// let t = &x + &(&x * &y);
/// let geometric = power_series_at(&vec![Jet::constant(&space, 1.0); 5], &t); // 1/(1 − t)
/// assert_eq!(&geometric * &(-&t).add_constant(1.0), Jet::constant(&space, 1.0));
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
pub fn power_series_at<S: Scalar>(coefficients: &[Jet<S>], t: &Jet<S>) -> Jet<S> {
    let (factor, order) = (Factor::of(t), t.space().order());
    let mut value = Sum::zero(t);
    for (power, coefficient) in coefficients.iter().enumerate().rev() {
        if let Some(kept) = order.checked_sub(factor.reach(power)) {
            value = value.times(&factor, kept).plus(coefficient, kept);
        }
    }
    value.jet
}

/// [`power_series_at`] with its derivative `Σ_k k c_k t^{k−1}`.
///
/// # Panics
///
/// As [`power_series_at`].
pub fn power_series_with_slope_at<S: Scalar>(
    coefficients: &[Jet<S>],
    t: &Jet<S>,
) -> (Jet<S>, Jet<S>) {
    let (factor, order) = (Factor::of(t), t.space().order());
    let (mut value, mut slope) = (Sum::zero(t), Sum::zero(t));
    for (power, coefficient) in coefficients.iter().enumerate().rev() {
        if let Some(kept) = order.checked_sub(factor.reach(power)) {
            slope = slope.times(&factor, kept).plus(&value.jet, kept);
        }
        // The slope takes the sum one degree of `t` further.
        if let Some(kept) = order.checked_sub(factor.reach(power.saturating_sub(1))) {
            value = value.times(&factor, kept).plus(coefficient, kept);
        }
    }
    (value.jet, slope.jet)
}

/// The factor by which Horner's rule multiplies a sum.
struct Factor<'a, S: Scalar> {
    jet: &'a Jet<S>,
    low: usize,
}

impl<'a, S: Scalar> Factor<'a, S> {
    fn of(jet: &'a Jet<S>) -> Self {
        Self { jet, low: lowest(jet) }
    }

    /// Lowest degree of a power.
    fn reach(&self, power: usize) -> usize {
        self.low.saturating_mul(power)
    }
}

/// A sum that vanishes below a degree.
struct Sum<S: Scalar> {
    jet: Jet<S>,
    low: usize,
}

impl<S: Scalar> Sum<S> {
    fn zero(like: &Jet<S>) -> Self {
        Self { jet: Jet::zero(like.space()), low: above(like) }
    }

    /// The product with a factor, up to a degree.
    fn times(&self, factor: &Factor<'_, S>, order: usize) -> Self {
        let space = self.jet.space();
        let mut jet = Jet::zero(space);
        let (left, right) = (self.jet.coefficients(), factor.jet.coefficients());
        let (left, right) = ((left, self.low), (right, factor.low));
        space.multiply_between(left, right, order, jet.coefficients_mut());
        Self { jet, low: self.low.saturating_add(factor.low) }
    }

    /// The sum with a jet, that cut at a degree.
    fn plus(mut self, addend: &Jet<S>, order: usize) -> Self {
        addend.assert_same_space(&self.jet);
        let kept = ..self.jet.space().degree_start(order + 1);
        let values = self.jet.coefficients_mut()[kept].iter_mut();
        let addends = &addend.coefficients()[kept];
        values.zip(addends).for_each(|(value, &addend)| *value += addend);
        self.low = self.low.min(lowest(addend));
        self
    }
}

/// Lowest degree with a coefficient other than zero; above the order for the zero jet.
fn lowest<S: Scalar>(jet: &Jet<S>) -> usize {
    jet.lowest_degree().unwrap_or(above(jet))
}

fn above<S: Scalar>(jet: &Jet<S>) -> usize {
    jet.space().order() + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    /// Jets with small whole coefficients, so that sums are exact, whose lowest degree is given.
    fn jet(space: &std::sync::Arc<JetSpace>, seed: usize, low: usize) -> Jet<f64> {
        let coefficient = |m: usize| match space.degree(m) < low {
            true => 0.0,
            false => ((m * 7 + seed * 5) % 11) as f64 - 5.0,
        };
        Jet::from_coefficients(space, (0..space.len()).map(coefficient).collect())
    }

    #[test]
    fn short_products_sum_to_what_full_ones_do() {
        let space = JetSpace::new(&[1, 2, 2], 9).unwrap();
        for low in 0..4 {
            let t = jet(&space, 3, low);
            for first in [0, 2] {
                let coefficients: Vec<_> = (0..5).map(|k| jet(&space, k, first + k)).collect();
                let (mut value, mut slope) = (Jet::zero(&space), Jet::zero(&space));
                for coefficient in coefficients.iter().rev() {
                    slope = &(&slope * &t) + &value;
                    value = &(&value * &t) + coefficient;
                }
                assert_eq!(power_series_at(&coefficients, &t), value, "{low} {first}");
                let both = power_series_with_slope_at(&coefficients, &t);
                assert_eq!(both, (value, slope), "{low} {first}");
            }
        }
    }

    #[test]
    fn at_zero_the_constant_and_the_linear_coefficient_are_left() {
        let space = JetSpace::uniform(2, 3).unwrap();
        let coefficients = [1, 2, 3].map(|seed| jet(&space, seed, 0));
        let (value, slope) = power_series_with_slope_at(&coefficients, &Jet::zero(&space));
        assert_eq!([value, slope], [coefficients[0].clone(), coefficients[1].clone()]);
    }
}
