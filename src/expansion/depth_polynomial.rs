//! Polynomials in the depth variables of several passages.
//!
//! One idea: `y_k² = depth_k(y_1 … y_{k−1}; x, p)` where passage `k` makes contact, so that no
//! power of `y_k` above the second is needed, or, with one depth variable, no power of one of the
//! coordinates. A polynomial in all depth variables is then a list of polynomials in (coordinates;
//! parameters), one for each choice of a power of every `y_k`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ExpansionError;
use super::variables::Variables;
use crate::jet::{Jet, JetSpace, power_series_at};
use crate::numeric::{Real, Scalar};

/// A polynomial in `(y_1 … y_K; coordinates; parameters)`, with several passages at most quadratic
/// in each `y_k`.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct DepthPolynomial<S: Scalar = f64> {
    /// Its terms by increasing powers of the depth variables; the first has none of them.
    pub terms: Vec<DepthTerm<S>>,
}

/// The part of a polynomial with given powers of the depth variables.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct DepthTerm<S: Scalar = f64> {
    /// Power of each depth variable.
    pub powers: Vec<u8>,
    /// What they multiply, in (coordinates; parameters).
    pub coefficient: Jet<S>,
}

impl<S: Real> DepthPolynomial<S> {
    /// Its value at depth variables and a point (coordinates; parameters).
    pub fn evaluate(&self, depths: &[S], point: &[S]) -> S {
        let value = |term: &DepthTerm<S>| {
            let powers = term.powers.iter().zip(depths);
            powers.fold(term.coefficient.evaluate(point), |product, (&power, &y)| {
                (0..power).fold(product, |product, _| product * y)
            })
        };
        self.terms
            .iter()
            .fold(S::zero(), |sum, term| sum + value(term))
    }
}

impl DepthPolynomial {
    /// From coefficients by the powers of the depth variables that they belong to.
    pub(super) fn of(terms: impl IntoIterator<Item = (Vec<u8>, Jet<f64>)>) -> Self {
        let terms = terms.into_iter().map(|(powers, coefficient)| DepthTerm {
            powers,
            coefficient,
        });
        Self {
            terms: terms.collect(),
        }
    }

    /// The same polynomial over another scalar.
    pub fn map_scalars<T: Real>(&self, convert: impl Fn(f64) -> T + Copy) -> DepthPolynomial<T> {
        let terms = self.terms.iter().map(|term| DepthTerm {
            powers: term.powers.clone(),
            coefficient: term.coefficient.map_scalars(convert),
        });
        DepthPolynomial {
            terms: terms.collect(),
        }
    }

    /// Number of coefficients that are not zero.
    pub fn coefficients(&self) -> usize {
        let terms = self.terms.iter();
        terms.map(|term| term.coefficient.nonzero()).sum()
    }
}

/// The space of `(y_1 … y_K; coordinates; parameters)` up to a weighted degree, every `y_k` of
/// weight 1.
pub(super) struct DepthSpace<'a> {
    pub(super) space: Arc<JetSpace>,
    pub(super) passages: usize,
    variables: &'a Variables,
    weight: u32,
}

impl<'a> DepthSpace<'a> {
    pub(super) fn new(
        passages: usize,
        variables: &'a Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let weights = [vec![1; passages], variables.weights.clone()].concat();
        Ok(Self {
            space: JetSpace::new(&weights, weight as usize)?,
            passages,
            variables,
            weight,
        })
    }

    /// The variables (coordinates; parameters) as themselves.
    pub(super) fn identity(&self) -> Vec<Jet<f64>> {
        (0..self.variables.len())
            .map(|variable| Jet::variable(&self.space, self.passages + variable, 0.0))
            .collect()
    }

    /// The depth variable of a passage.
    pub(super) fn depth_variable(&self, passage: usize) -> Jet<f64> {
        Jet::variable(&self.space, passage, 0.0)
    }

    /// The jet with powers of `y_k` above the second lowered by `y_k² = depths[k]`, the last
    /// passage first.
    pub(super) fn reduced(&self, jet: &Jet<f64>, depths: &[Jet<f64>]) -> Jet<f64> {
        let passages = depths.iter().enumerate().rev();
        passages.fold(jet.clone(), |jet, (passage, depth)| {
            self.reduced_in(passage, &jet, depth)
        })
    }

    /// `f_0 + y Σ_j f_{1+2j} depth^j + y² Σ_j f_{2+2j} depth^j`, `f_j` being what multiplies `y^j`.
    fn reduced_in(&self, passage: usize, jet: &Jet<f64>, depth: &Jet<f64>) -> Jet<f64> {
        let fold = |first: u8| {
            let powers = (first..=self.weight.min(255) as u8).step_by(2);
            let coefficients: Vec<_> = powers
                .map(|power| self.without_power(jet, passage, power))
                .collect();
            power_series_at(&coefficients, depth)
        };
        let y = self.depth_variable(passage);
        let corrections = &fold(1) + &(&y * &fold(2));
        &self.without_power(jet, passage, 0) + &(&y * &corrections)
    }

    /// What multiplies `y_k^power`.
    fn without_power(&self, jet: &Jet<f64>, passage: usize, power: u8) -> Jet<f64> {
        let mut result = Jet::zero(&self.space);
        let mut lowered = vec![0; self.space.variables()];
        for (exponents, value) in jet.terms() {
            if exponents[passage] == power {
                lowered.copy_from_slice(exponents);
                lowered[passage] = 0;
                if let Some(monomial) = self.space.monomial(&lowered) {
                    result.coefficients_mut()[monomial] = value;
                }
            }
        }
        result
    }

    /// A reduced jet as a polynomial; what has no depth variable is taken from `smooth` instead.
    pub(super) fn polynomial(
        &self,
        smooth: Jet<f64>,
        jet: &Jet<f64>,
    ) -> Result<DepthPolynomial, ExpansionError> {
        let mut terms = BTreeMap::from([(vec![0; self.passages], smooth)]);
        for (exponents, value) in jet.terms().filter(|(_, value)| *value != 0.0) {
            let (powers, rest) = exponents.split_at(self.passages);
            let degree: u32 = powers.iter().map(|&power| u32::from(power)).sum();
            if degree == 0 {
                continue;
            }
            if !terms.contains_key(powers) {
                let space = self.variables.smooth_space(self.weight - degree)?;
                terms.insert(powers.to_vec(), Jet::zero(&space));
            }
            if let Some(coefficient) = terms.get_mut(powers)
                && let Some(monomial) = coefficient.space().monomial(rest)
            {
                coefficient.coefficients_mut()[monomial] = value;
            }
        }
        Ok(DepthPolynomial::of(terms))
    }
}
