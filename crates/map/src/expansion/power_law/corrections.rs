//! Corrections of a contact with powers of the depth variable that are not whole.

use serde::{Deserialize, Serialize};

use crate::expansion::flown::Arithmetic;
use crate::jet::Jet;
use crate::numeric::{Dd, Real, Scalar};

/// Terms of a passage beside `y linear + y² quadratic`:
///
/// ```text
/// x_i ↦ x_i + … + Σ_m z^m (y linear_{m,i}(x, p) + y² quadratic_{m,i}(x, p)),    z_k = y^{e_k}
/// ```
///
/// A power `d^β` of the penetration that is not half a whole number brings a variable `y^{2β}`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PowerCorrections<S: Scalar = f64> {
    /// Exponents `e_k` of the variables `z_k = y^{e_k}`.
    pub exponents: Vec<Dd>,
    /// Terms, each with its powers of the variables.
    pub terms: Vec<PowerTerm<S>>,
}

/// Corrections with one product of powers of the variables `z_k`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PowerTerm<S: Scalar = f64> {
    /// Power of each variable.
    pub powers: Vec<u8>,
    /// Coefficient of `z^m y`, one polynomial per coordinate.
    pub linear: Vec<Jet<S>>,
    /// Coefficient of `z^m y²`, one polynomial per coordinate.
    pub quadratic: Vec<Jet<S>>,
}

impl<S: Scalar> Default for PowerCorrections<S> {
    fn default() -> Self {
        Self { exponents: Vec::new(), terms: Vec::new() }
    }
}

/// Exponent of `y` in a product of powers of the variables `y^{e_k}`.
pub(in crate::expansion) fn exponent_of(powers: &[u8], exponents: &[Dd]) -> f64 {
    let powers = powers.iter().zip(exponents);
    powers.map(|(&power, exponent)| f64::from(power) * exponent.to_f64()).sum()
}

/// Lowest power of `y` above a weight that a product of `y`, once at least, and of the variables
/// `y^{e_k}` can have.
pub(crate) fn omitted_exponent(exponents: &[Dd], weight: u32) -> f64 {
    let weight = f64::from(weight);
    let mut sums = vec![0.0];
    for exponent in exponents.iter().map(|exponent| exponent.to_f64()) {
        let multiples = move |sum: f64| (0..).map(move |power| sum + f64::from(power) * exponent);
        let next = sums.iter().flat_map(|&sum| multiples(sum).take_while(|&e| e <= weight));
        sums = next.collect();
    }
    let above = sums.iter().map(|sum| sum + ((weight - sum).floor() + 1.0).max(1.0));
    above.fold(weight + 1.0, f64::min)
}

impl<S: Scalar> PowerCorrections<S> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Terms, each with the exponent of `y` in its product of powers.
    pub fn with_exponents(&self) -> impl Iterator<Item = (f64, &PowerTerm<S>)> {
        self.terms.iter().map(|term| (exponent_of(&term.powers, &self.exponents), term))
    }

    /// All polynomials.
    pub fn polynomials(&self) -> impl Iterator<Item = &Jet<S>> {
        self.terms.iter().flat_map(|term| term.linear.iter().chain(&term.quadratic))
    }

    /// Converts every polynomial.
    pub fn map<T: Scalar>(&self, convert: impl Fn(&Jet<S>) -> Jet<T>) -> PowerCorrections<T> {
        let terms = self.terms.iter().map(|term| PowerTerm {
            powers: term.powers.clone(),
            linear: term.linear.iter().map(&convert).collect(),
            quadratic: term.quadratic.iter().map(&convert).collect(),
        });
        PowerCorrections { exponents: self.exponents.clone(), terms: terms.collect() }
    }

    /// Adds the corrections of a contact of depth variable `y` at a point (coordinates; parameters)
    /// to its image.
    pub fn add_to<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
        image: &mut [A::Value],
    ) {
        let variables: Vec<A::Value> = self
            .exponents
            .iter()
            .map(|&exponent| power_of_depth(arithmetic, y, exponent))
            .collect();
        for term in &self.terms {
            let mut product = y.clone();
            for (variable, &power) in variables.iter().zip(&term.powers) {
                for _ in 0..power {
                    product = arithmetic.multiply(&product, variable);
                }
            }
            let corrections = term.linear.iter().zip(&term.quadratic);
            for (image, (linear, quadratic)) in image.iter_mut().zip(corrections) {
                let linear = arithmetic.polynomial(linear, point);
                let quadratic = arithmetic.polynomial(quadratic, point);
                let slope = arithmetic.multiply_add(y, &quadratic, &linear);
                *image = arithmetic.multiply_add(&product, &slope, image);
            }
        }
    }
}

impl PowerCorrections {
    /// Whether its parts have the sizes of a map with so many coordinates and parameters.
    pub fn fits(&self, coordinates: usize, parameters: usize) -> bool {
        let variables = coordinates + parameters;
        let exponents = self.exponents.iter().map(|exponent| exponent.to_f64());
        let mut exponents =
            exponents.map(|exponent| exponent > 0.0 && exponent <= LARGEST_EXPONENT);
        let of_term = |term: &PowerTerm| {
            term.powers.len() == self.exponents.len()
                && [term.linear.len(), term.quadratic.len()] == [coordinates; 2]
        };
        exponents.all(|is_known| is_known)
            && self.terms.iter().all(of_term)
            && self.polynomials().all(|jet| jet.space().variables() == variables)
    }
}

impl<S: Real> PowerCorrections<S> {
    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        self.polynomials().all(Jet::is_finite)
    }
}

/// Largest exponent of a variable.
pub(super) const LARGEST_EXPONENT: f64 = 64.0;

/// Weights of powers of `y`, in units in which they are whole.
#[derive(Clone, Copy, Debug)]
pub(in crate::expansion) struct WeightScale {
    /// Weight of `y`.
    pub(in crate::expansion) unit: u32,
}

impl WeightScale {
    /// Smallest unit in which the weights of these powers are whole; else a quarter.
    pub(in crate::expansion) fn of(powers: &[Dd]) -> Self {
        let is_whole = |unit: &u32| {
            let mut scaled = powers.iter().map(|power| f64::from(*unit) * power.to_f64());
            scaled.all(|scaled| (scaled - scaled.round()).abs() < 1e-9)
        };
        Self { unit: (1..=MOST_UNITS).find(is_whole).unwrap_or(4) }
    }

    /// Weight of a power, rounded down where it is not whole: a lower weight leaves out less.
    pub(in crate::expansion) fn weight(self, power: Dd) -> u32 {
        ((f64::from(self.unit) * power.to_f64() + 1e-9).floor() as u32).max(1)
    }
}

/// Largest weight of `y`.
const MOST_UNITS: u32 = 5;

/// Number of square roots. What is left is a power of a number that differs from 1 by 0.006 for
/// `y` = 1e-20.
const ROOTS: i32 = 13;

/// Number of terms of the binomial series, for a rounding of 1e-16 and of 1e-32.
const TERMS: [usize; 2] = [8, 14];

/// Power `y^e` of a depth variable with a positive exponent.
///
/// With square roots, products and a binomial series: operations that every language rounds alike,
/// free of branches.
///
/// ```text
/// y^e = y^⌊e⌋ Π_k (y^{2^{−k}})^{b_k} (1 + t)^f,    1 + t = y^{2^{−13}}
/// ```
///
/// with the binary digits `b_k` of the fraction of `e`, and `f` what they leave, in units of
/// `2^{−13}`. The derivative is `e z / y`, 0 at `y` = 0.
pub(crate) fn power_of_depth<A: Arithmetic>(
    arithmetic: &mut A,
    y: &A::Value,
    exponent: Dd,
) -> A::Value {
    let one = Dd::from_f64(1.0);
    let at = arithmetic.held(y);
    let whole = exponent.to_f64().floor();
    let mut rest = exponent - Dd::from_f64(whole);
    let mut factors = vec![at.clone(); whole as usize];
    let mut root = at.clone();
    for _ in 0..ROOTS {
        root = arithmetic.root_of_positive_part(&root);
        rest = rest + rest;
        if rest >= one {
            rest -= one;
            factors.push(root.clone());
        }
    }
    if rest > Dd::ZERO {
        factors.push(binomial_power(arithmetic, &root, rest));
    }
    let mut factors = factors.into_iter();
    let first = factors.next().unwrap_or_else(|| at.clone());
    let value = factors.fold(first, |product, factor| arithmetic.multiply(&product, &factor));
    // The value is constant in differentiation: its slope is given beside.
    let value = arithmetic.held(&value);
    let twice = arithmetic.constant(A::Scalar::from_dd(exponent + exponent));
    let half_reciprocal = arithmetic.half_reciprocal(&at);
    let slope = arithmetic.multiply(&value, &half_reciprocal);
    let slope = arithmetic.multiply(&slope, &twice);
    let minus = arithmetic.constant(A::Scalar::from_f64(-1.0));
    let since = arithmetic.multiply_add(&at, &minus, y);
    arithmetic.multiply_add(&slope, &since, &value)
}

/// Power `(1 + t)^f` of a number `1 + t` near 1, by its binomial series.
fn binomial_power<A: Arithmetic>(arithmetic: &mut A, base: &A::Value, f: Dd) -> A::Value {
    let minus = arithmetic.constant(A::Scalar::from_f64(-1.0));
    let t = arithmetic.add(base, &minus);
    let count = TERMS[usize::from(A::Scalar::ROUNDOFF < 1e-20)];
    let mut coefficient = Dd::from_f64(1.0);
    let coefficients: Vec<Dd> = (0..count)
        .map(|power| {
            let own = coefficient;
            let power = Dd::from_f64(power as f64);
            coefficient = coefficient * (f - power) / (power + Dd::from_f64(1.0));
            own
        })
        .collect();
    let mut highest_first = coefficients.iter().rev().map(|&value| A::Scalar::from_dd(value));
    let last = highest_first.next().unwrap_or_else(|| A::Scalar::from_f64(0.0));
    let mut sum = arithmetic.constant(last);
    for value in highest_first {
        let value = arithmetic.constant(value);
        sum = arithmetic.multiply_add(&sum, &t, &value);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expansion::Numbers;

    #[test]
    fn a_power_of_the_depth_variable_is_that_of_the_logarithm() {
        for exponent in [0.2, 1.0, 2.2, 2.5, 4.936, 7.4, 0.600_000_000_1] {
            for y in [1e-12, 3e-7, 1e-4, 0.02, 0.7, 1.0, 1.9] {
                let found = power_of_depth(&mut Numbers::<f64>::new(), &y, Dd::from(exponent));
                assert!((found / y.powf(exponent) - 1.0).abs() < 2e-15, "{y}^{exponent}: {found}");
                let y = Dd::from(y);
                let found = power_of_depth(&mut Numbers::<Dd>::new(), &y, Dd::from(exponent));
                let error = (found / y.powf(Dd::from(exponent)) - Dd::from(1.0)).magnitude();
                assert!(error < 1e-29, "{y}^{exponent}: {error:e}");
            }
            let at_zero = power_of_depth(&mut Numbers::<f64>::new(), &0.0, Dd::from(exponent));
            assert_eq!(at_zero, 0.0);
        }
    }
}
