//! Products in small spaces, as straight lines of code.
//!
//! One idea: where a product sums a few dozen terms, finding out which takes longer than summing
//! them; in one variable, and up to the second order in any number, that is known without a table.

use crate::numeric::{Kernel, Scalar};

/// Most coefficients of a jet in one variable here.
const LONGEST: usize = 8;
/// Most variables of a jet of the second order here.
const MOST_VARIABLES: usize = 6;

/// A space whose products are written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::jet) enum SmallSpace {
    /// One variable: so many powers.
    OneVariable(usize),
    /// Constants and linear terms.
    Linear,
    /// Quadratic terms too, in so many variables.
    Quadratic(usize),
}

impl SmallSpace {
    /// The kind of a space with these weights and this order; `None` if its products need a table.
    pub(in crate::jet) fn of(weights: &[u32], order: usize) -> Option<Self> {
        if weights.iter().any(|&weight| weight != 1) {
            return None;
        }
        match (weights.len(), order) {
            (_, 0 | 1) => Some(Self::Linear),
            (1, order) => (order < LONGEST).then_some(Self::OneVariable(order + 1)),
            (variables @ 2..=MOST_VARIABLES, 2) => Some(Self::Quadratic(variables)),
            _ => None,
        }
    }
}

/// The product of two elements, which an element becomes (`SET`) or to which it is added.
pub(in crate::jet) struct SmallProduct<'a, S, const SET: bool> {
    pub(in crate::jet) space: SmallSpace,
    pub(in crate::jet) a: &'a [S],
    pub(in crate::jet) b: &'a [S],
    pub(in crate::jet) out: &'a mut [S],
}

impl<S: Scalar, const SET: bool> Kernel for SmallProduct<'_, S, SET> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        match self.space {
            SmallSpace::Linear => self.linear(),
            SmallSpace::Quadratic(2) => self.quadratic(2),
            SmallSpace::Quadratic(3) => self.quadratic(3),
            SmallSpace::Quadratic(4) => self.quadratic(4),
            SmallSpace::Quadratic(5) => self.quadratic(5),
            SmallSpace::Quadratic(_) => self.quadratic(MOST_VARIABLES),
            SmallSpace::OneVariable(3) => self.one_variable(3),
            SmallSpace::OneVariable(4) => self.one_variable(4),
            SmallSpace::OneVariable(5) => self.one_variable(5),
            SmallSpace::OneVariable(6) => self.one_variable(6),
            SmallSpace::OneVariable(7) => self.one_variable(7),
            SmallSpace::OneVariable(_) => self.one_variable(LONGEST),
        }
    }

    #[inline(always)]
    fn run_compact(self) {
        match self.space {
            SmallSpace::Linear => self.linear(),
            SmallSpace::Quadratic(variables) => self.quadratic(variables),
            SmallSpace::OneVariable(len) => self.one_variable(len),
        }
    }
}

impl<S: Scalar, const SET: bool> SmallProduct<'_, S, SET> {
    #[inline(always)]
    fn put(out: &mut S, sum: S) {
        *out = if SET { sum } else { *out + sum };
    }

    #[inline(always)]
    fn linear(self) {
        let ([a0, a @ ..], [b0, b @ ..], [out0, out @ ..]) = (self.a, self.b, self.out) else {
            return;
        };
        Self::put(out0, *a0 * *b0);
        for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
            Self::put(out, a.mul_add(*b0, *a0 * b));
        }
    }

    /// The coefficient of `x_i x_j` is `a_0 b_ij + a_i b_j + a_j b_i + a_ij b_0`, the two in the
    /// middle the other way round where `x_j` alone is one of the last two variables: the order
    /// of the table.
    #[inline(always)]
    fn quadratic(self, variables: usize) {
        let linear = 1 + variables;
        let len = linear * (linear + 1) / 2;
        let (a, b, out) = (&self.a[..len], &self.b[..len], &mut self.out[..len]);
        let (a0, b0) = (a[0], b[0]);
        let mut product = linear;
        for i in 1..linear {
            for j in i..linear {
                let mut sum = a0 * b[product];
                if i == j {
                    sum = a[i].mul_add(b[i], sum);
                } else if i + 1 < variables && j + 1 >= variables {
                    sum = a[i].mul_add(b[j], a[j].mul_add(b[i], sum));
                } else {
                    sum = a[j].mul_add(b[i], a[i].mul_add(b[j], sum));
                }
                Self::put(&mut out[product], a[product].mul_add(b0, sum));
                product += 1;
            }
        }
        let (a, b, out) = (&a[..linear], &b[..linear], &mut out[..linear]);
        let space = SmallSpace::Linear;
        SmallProduct::<S, SET> { space, a, b, out }.linear();
    }

    #[inline(always)]
    fn one_variable(self, len: usize) {
        let (a, b, out) = (&self.a[..len], &self.b[..len], &mut self.out[..len]);
        for power in 0..len {
            let mut sum = a[0] * b[power];
            for left in 1..power + 1 {
                sum = a[left].mul_add(b[power - left], sum);
            }
            Self::put(&mut out[power], sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::{Jet, JetSpace};
    use crate::numeric::{Dd, Lanes};

    fn filled<S: Scalar>(len: usize, seed: f64) -> Vec<S> {
        let value = |m: usize| S::from_f64(((m as f64 + seed) * 0.618).sin());
        (0..len).map(value).collect()
    }

    /// The sum over the pairs of the table, in their order.
    fn by_pairs<S: Scalar>(space: &JetSpace, a: &[S], b: &[S]) -> Vec<S> {
        let sum = |monomial: usize| {
            let pairs = space.pairs(monomial);
            let (first, rest) = pairs.split_first().expect("a pair");
            let product = a[first.0] * b[first.1];
            rest.iter().fold(product, |sum, &(i, j)| a[i].mul_add(b[j], sum))
        };
        (0..space.len()).map(sum).collect()
    }

    fn agree<S: Scalar + PartialEq + std::fmt::Debug>() {
        for (variables, order) in (0..=12)
            .flat_map(|variables| (0..=1).map(move |order| (variables, order)))
            .chain((1..=MOST_VARIABLES).map(|variables| (variables, 2)))
            .chain((3..LONGEST).map(|order| (1, order)))
        {
            let space = JetSpace::uniform(variables, order).expect("a small space");
            assert!(space.small().is_some(), "{variables} {order}");
            let (a, b) = (filled::<S>(space.len(), 0.3), filled(space.len(), 0.7));
            let expected = by_pairs(&space, &a, &b);
            let mut out = filled::<S>(space.len(), 0.9);
            space.multiply_add(&a, &b, &mut out);
            let added = filled::<S>(space.len(), 0.9);
            let added = added.iter().zip(&expected).map(|(&out, &sum)| out + sum);
            assert_eq!(out, added.collect::<Vec<_>>(), "{variables} {order}");
            space.multiply(&a, &b, &mut out);
            assert_eq!(out, expected, "{variables} {order}");
        }
    }

    #[test]
    fn products_are_the_sums_over_the_pairs_of_the_table_to_the_last_bit() {
        agree::<f64>();
        agree::<Dd>();
        agree::<Lanes<8>>();
    }

    #[test]
    fn spaces_with_weights_and_longer_ones_have_the_table() {
        for (weights, order) in [
            (&[][..], 2),
            (&[1, 2], 2),
            (&[2], 3),
            (&[1], LONGEST),
            (&[1, 1], 3),
            (&[1; MOST_VARIABLES + 1], 2),
        ] {
            let space = JetSpace::new(weights, order).expect("a small space");
            assert_eq!(space.small(), None, "{weights:?} {order}");
        }
        let space = JetSpace::uniform(2, 2).expect("a small space");
        let x: Jet<f64> = Jet::variable(&space, 0, 3.0);
        assert_eq!((&x * &x).coefficients(), [9.0, 6.0, 0.0, 1.0, 0.0, 0.0]);
    }
}
