//! Products of few coefficients, pair by pair.
//!
//! One idea: where a factor has two or three coefficients, or the degree is low, finding the runs of a product costs more than
//! the product; its pairs of coefficients are listed once.

use std::ops::Range;

use super::gauss::{NODES, NodeValues};
use super::sparse::Reach;
use crate::jet::{JetSpace, Span, VariableSet};
use crate::numeric::{Lanes, Scalar};

/// Highest degree in which a factor that may differ from zero in all monomials is listed.
const LOW: usize = 2;

/// The products that the monomials of a part sum.
pub(super) struct Pairs {
    /// Of each monomial, where its pairs end.
    ends: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

/// A product of two slots: its terms, and the monomials in which its factors can differ from zero.
pub(super) struct Factors<'a> {
    pub(super) space: &'a JetSpace,
    /// Variables of every monomial.
    pub(super) monomials: &'a [VariableSet],
    pub(super) span: Span,
    pub(super) left: Reach,
    pub(super) right: Reach,
}

impl Factors<'_> {
    /// The pairs of the monomials of a part of a degree, if they are few.
    pub(super) fn pairs(&self, degree: usize, part: Range<usize>) -> Option<Pairs> {
        let shortest = self.left.degree.min(self.right.degree);
        if shortest > 1 && degree > LOW {
            return None;
        }
        let mut pairs = Pairs {
            ends: Vec::with_capacity(part.len()),
            pairs: Vec::new(),
        };
        let few = self.space.degree_range(shortest.min(degree)).end;
        for monomial in part {
            for one in 0..few {
                let Some(other) = self.cofactor(monomial, one) else {
                    continue;
                };
                let pair = if self.left.degree <= self.right.degree {
                    (one, other)
                } else {
                    (other, one)
                };
                if self.has(pair) {
                    pairs.pairs.push((pair.0 as u32, pair.1 as u32));
                }
            }
            pairs.ends.push(pairs.pairs.len() as u32);
        }
        Some(pairs)
    }

    /// The monomial whose product with another one is a given one.
    fn cofactor(&self, product: usize, factor: usize) -> Option<usize> {
        if self.monomials[factor] & !self.monomials[product] != 0 {
            return None;
        }
        let exponents = self.space.exponents(product).iter();
        let exponents = exponents.zip(self.space.exponents(factor));
        let rest = exponents.map(|(&a, &b)| a.checked_sub(b));
        self.space.monomial(&rest.collect::<Option<Vec<_>>>()?)
    }

    /// Whether a pair is one of the terms and both its coefficients can differ from zero.
    fn has(&self, (left, right): (usize, usize)) -> bool {
        let reaches = |reach: Reach, monomial: usize| {
            self.monomials[monomial] & !reach.variables == 0
                && self.space.degree(monomial) <= reach.degree
        };
        let is_left_out = match self.span {
            Span::Full => false,
            Span::WithoutFirst => left == 0,
            Span::WithoutLast => right == 0,
            Span::Interior => left == 0 || right == 0,
        };
        !is_left_out && reaches(self.left, left) && reaches(self.right, right)
    }
}

impl Pairs {
    /// The sum of the products of a monomial, given by its place in the part.
    #[inline(always)]
    pub(super) fn sum(&self, place: usize, a: &[NodeValues], b: &[NodeValues]) -> NodeValues {
        let start = place.checked_sub(1).map_or(0, |before| self.ends[before]);
        let mut sum = Lanes([0.0; NODES]);
        for &(i, j) in &self.pairs[start as usize..self.ends[place] as usize] {
            sum = a[i as usize].mul_add(b[j as usize], sum);
        }
        sum
    }
}
