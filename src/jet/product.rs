//! The product of two jets as a pass over the space's product table.
//!
//! One idea: the table is output-major, so every coefficient of the product is one sum of
//! products; several running sums hide the latency of the multiply-adds.

use super::JetSpace;
use crate::numeric::Scalar;

/// `sum + Σ a_i b_j` over a list of pairs, in four running sums; in one where a scalar is itself
/// several vectors wide, whose lanes are chains enough and whose four sums would not fit the registers.
#[inline(always)]
pub(super) fn sum_of_products<S: Scalar>(pairs: &[(u32, u32)], a: &[S], b: &[S], sum: S) -> S {
    let add = |sum: S, (i, j): (u32, u32)| a[i as usize].mul_add(b[j as usize], sum);
    if size_of::<S>() > 64 {
        return pairs.iter().fold(sum, |sum, &pair| add(sum, pair));
    }
    let (fours, rest) = pairs.as_chunks::<4>();
    let mut sums = [
        rest.iter().fold(sum, |sum, &pair| add(sum, pair)),
        S::zero(),
        S::zero(),
        S::zero(),
    ];
    if fours.is_empty() {
        return sums[0];
    }
    for four in fours {
        sums = [
            add(sums[0], four[0]),
            add(sums[1], four[1]),
            add(sums[2], four[2]),
            add(sums[3], four[3]),
        ];
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

impl JetSpace {
    /// `out += a b` for coefficient slices of this space.
    ///
    /// # Panics
    ///
    /// If a slice is shorter than the space.
    #[inline]
    pub fn multiply_add<S: Scalar>(&self, a: &[S], b: &[S], out: &mut [S]) {
        for (monomial, value) in out.iter_mut().enumerate() {
            *value = sum_of_products(self.pairs(monomial), a, b, *value);
        }
    }

    /// `out = a b` in the degrees from `low_a + low_b` to `order`, where `a` has no term below degree
    /// `low_a` nor `b` below `low_b`; other coefficients of `out` are left alone.
    ///
    /// Only the products of terms that can differ from zero are formed.
    pub(super) fn multiply_between<S: Scalar>(
        &self,
        (a, low_a): (&[S], usize),
        (b, low_b): (&[S], usize),
        order: usize,
        out: &mut [S],
    ) {
        let (first_a, first_b) = (
            self.degree_start(low_a) as u32,
            self.degree_start(low_b) as u32,
        );
        let kept = self.degree_start(low_a + low_b)..self.degree_start(order + 1);
        for (monomial, value) in kept.clone().zip(&mut out[kept]) {
            let pairs = self.pairs(monomial);
            let from = pairs.partition_point(|&(i, _)| i < first_a);
            let rest = &pairs[from..];
            // NOTE: degrees of `i` ascend, so those of `j` descend, though `j` itself need not.
            let until = rest.partition_point(|&(_, j)| j >= first_b);
            *value = sum_of_products(&rest[..until], a, b, S::zero());
        }
    }
}
