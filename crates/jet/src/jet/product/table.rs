//! Product table of a space of jets: the products of coefficients in a product, by pairs of
//! families.
//!
//! One idea: monomials of one degree that differ in their last two variables only are neighbours, a
//! *run*, and the runs with the same other exponents are a *family*, one run of every length. A run
//! of the result is a sum over the pairs of families whose product is its family. The terms are
//! products of two runs whose lengths sum to the length of the result plus one: products of
//! polynomials in one variable, whose coefficients are summed in registers. One entry of the table
//! covers all these products, for every run of a family; it holds the first monomials of the runs,
//! so that a visit to a pair reads nothing else of the table.
//!
//! In small spaces products are straight-line code. One idea: if a product sums a few dozen terms,
//! selecting them takes longer than summing them; in one variable, and up to the second order in
//! any number of variables, they are known without a table.

use std::ops::Range;

use crate::jet::space::{RankTable, next_divisor};
use crate::numeric::{Scalar, Vectorised};

/// The products of a space, run by run of the result.
#[derive(Debug)]
pub(in crate::jet) struct ProductTable {
    runs: Vec<Run>,
    /// Number of the first run of every degree, then the number of all runs.
    degree_starts: Vec<usize>,
    families: Vec<Family>,
    /// For every pair of families the first monomials of the left and right runs, by ascending
    /// length, as many of each as their product has runs.
    pairs: Vec<u32>,
}

/// Neighbouring monomials of one degree with the same exponents in all variables but the last two.
#[derive(Clone, Debug)]
pub(in crate::jet) struct Run {
    /// Numbers of the monomials.
    pub(in crate::jet) monomials: Range<usize>,
    family: Family,
}

/// All runs with the same exponents in all variables but the last two.
#[derive(Clone, Debug)]
pub(in crate::jet) struct Family {
    runs: usize,
    pairs: Range<usize>,
}

impl Family {
    /// Number of runs, equal to the length of the longest.
    #[inline(always)]
    pub(in crate::jet) fn runs(&self) -> usize {
        self.runs
    }
}

/// The pairs of families whose product is one family, by ascending left family. In the first pair
/// the left family is that of the constant, in the last pair the right one.
#[derive(Clone, Copy)]
pub(in crate::jet) struct Pairs<'a> {
    firsts: &'a [u32],
    /// Number of runs of the product.
    runs: usize,
}

/// First monomials of the runs of two families, by ascending length, as many of each as their
/// product has runs.
#[derive(Clone, Copy)]
pub(in crate::jet) struct Pair<'a> {
    pub(in crate::jet) left: &'a [u32],
    pub(in crate::jet) right: &'a [u32],
}

impl<'a> Pair<'a> {
    /// The `RUNS` shortest runs of both families; `None` if there are fewer.
    #[inline(always)]
    pub(in crate::jet) fn shortest<const RUNS: usize>(self) -> Option<[&'a [u32; RUNS]; 2]> {
        Some([self.left.first_chunk()?, self.right.first_chunk()?])
    }
}

impl<'a> Pairs<'a> {
    #[inline(always)]
    pub(in crate::jet) fn iter(self) -> impl Iterator<Item = Pair<'a>> {
        let pair = move |firsts: &'a [u32]| {
            let (left, right) = firsts.split_at(self.runs);
            Pair { left, right }
        };
        self.firsts.chunks_exact(2 * self.runs).map(pair)
    }

    /// The first half of the pairs, and the middle pair if their number is odd.
    #[inline(always)]
    pub(in crate::jet) fn half(self) -> (Self, Option<Pair<'a>>) {
        let entry = 2 * self.runs;
        let count = self.firsts.len() / entry;
        let (half, rest) = self.firsts.split_at(count / 2 * entry);
        let firsts = &rest[..(count % 2) * entry];
        let middle = Self { firsts, ..self }.iter().next();
        (Self { firsts: half, ..self }, middle)
    }

    /// The first pair, and the others.
    #[inline(always)]
    pub(in crate::jet) fn split_first(self) -> (Option<Pair<'a>>, Self) {
        let entry = (2 * self.runs).min(self.firsts.len());
        let firsts = &self.firsts[entry..];
        (self.iter().next(), Self { firsts, ..self })
    }
}

/// Exponents and weights from which a table is built.
pub(in crate::jet) struct Monomials<'a> {
    pub(in crate::jet) weights: &'a [u32],
    pub(in crate::jet) exponents: &'a [u8],
    pub(in crate::jet) degree_starts: &'a [usize],
    pub(in crate::jet) ranks: &'a RankTable,
}

impl Monomials<'_> {
    fn exponents(&self, monomial: usize) -> &[u8] {
        let variables = self.weights.len();
        &self.exponents[monomial * variables..(monomial + 1) * variables]
    }

    /// Number of monomials in the run that begins with monomial `first`; 1 if the last two weights
    /// differ.
    fn run_length(&self, first: usize) -> usize {
        match (self.weights, self.exponents(first)) {
            ([.., a, b], [.., exponent, _]) if a == b => usize::from(*exponent) + 1,
            _ => 1,
        }
    }

    /// First monomials of the runs of the family whose shortest run is the monomial `shortest`.
    fn family(&self, shortest: usize) -> impl Iterator<Item = u32> {
        let mut exponents = self.exponents(shortest).to_vec();
        let grows = matches!(self.weights, [.., a, b] if a == b);
        let longer = move || {
            let [.., exponent, _] = exponents.as_mut_slice() else {
                return None;
            };
            *exponent = exponent.checked_add(1).filter(|_| grows)?;
            self.ranks.find(&exponents).map(|monomial| monomial as u32)
        };
        std::iter::once(shortest as u32).chain(std::iter::from_fn(longer))
    }

    /// Lists the pairs `(i, j)` of monomials with product `product`, by ascending `i`.
    fn list_pairs(&self, product: usize, pairs: &mut Vec<(u32, u32)>) {
        pairs.clear();
        let bound = self.exponents(product);
        let (mut left, mut right) = (vec![0u8; bound.len()], vec![0u8; bound.len()]);
        let rank =
            |e: &[u8]| self.ranks.find(e).expect("a divisor of a kept monomial is kept") as u32;
        loop {
            for ((right, &left), &exponent) in right.iter_mut().zip(&left).zip(bound) {
                *right = exponent - left;
            }
            pairs.push((rank(&left), rank(&right)));
            if !next_divisor(&mut left, bound) {
                break;
            }
        }
        pairs.sort_unstable();
    }
}

impl ProductTable {
    /// The table of a space.
    pub(in crate::jet) fn new(monomials: &Monomials<'_>) -> Self {
        let count = monomials.degree_starts.last().copied().unwrap_or(0);
        let mut table = Self {
            runs: Vec::new(),
            degree_starts: Vec::with_capacity(monomials.degree_starts.len()),
            families: Vec::new(),
            pairs: Vec::new(),
        };
        // `starts`: the first monomials of all runs, family by family. `families`: for the first
        // monomial of every run its family, and the index of that family's first run in `starts`.
        let mut starts: Vec<u32> = Vec::with_capacity(count);
        let mut families = vec![(0, 0); count];
        let mut products = Vec::new();
        for degree in monomials.degree_starts.windows(2) {
            table.degree_starts.push(table.runs.len());
            let mut first = degree[0];
            while first < degree[1] {
                let length = monomials.run_length(first);
                if length == 1 {
                    let place = starts.len();
                    starts.extend(monomials.family(first));
                    let runs = starts.len() - place;
                    for &start in &starts[place..] {
                        families[start as usize] = (table.families.len(), place);
                    }
                    monomials.list_pairs(first, &mut products);
                    let begin = table.pairs.len();
                    for factor in products.iter().flat_map(|&(left, right)| [left, right]) {
                        let (_, place) = families[factor as usize];
                        table.pairs.extend(&starts[place..place + runs]);
                    }
                    table.families.push(Family { runs, pairs: begin..table.pairs.len() });
                }
                let (family, _) = families[first];
                table.runs.push(Run {
                    monomials: first..first + length,
                    family: table.families[family].clone(),
                });
                first += length;
            }
        }
        table.degree_starts.push(table.runs.len());
        table
    }

    /// The numbers of the runs of a range of degrees.
    #[inline(always)]
    pub(in crate::jet) fn run_numbers(&self, degrees: Range<usize>) -> Range<usize> {
        self.degree_starts[degrees.start]..self.degree_starts[degrees.end]
    }

    /// All runs, by ascending monomials.
    #[inline(always)]
    pub(in crate::jet) fn all_runs(&self) -> &[Run] {
        &self.runs
    }

    /// All families.
    #[inline(always)]
    pub(in crate::jet) fn families(&self) -> &[Family] {
        &self.families
    }

    /// The pairs of families whose product is a family.
    #[inline(always)]
    pub(in crate::jet) fn pairs_of(&self, family: &Family) -> Pairs<'_> {
        Pairs { firsts: &self.pairs[family.pairs.clone()], runs: family.runs }
    }

    /// The pairs of families whose product is the family of a run.
    #[inline(always)]
    pub(in crate::jet) fn pairs_of_run(&self, run: &Run) -> Pairs<'_> {
        self.pairs_of(&run.family)
    }

    /// The pairs of monomials whose product is a given one, in the order of summation.
    pub(in crate::jet) fn pairs(&self, monomial: usize) -> Vec<(usize, usize)> {
        let after = self.runs.partition_point(|run| run.monomials.start <= monomial);
        let run = &self.runs[after - 1];
        let (place, len) = (monomial - run.monomials.start, run.monomials.len());
        let mut pairs = Vec::new();
        for Pair { left, right } in self.pairs_of_run(run).iter() {
            for left_len in 1..=len {
                let left = left[left_len - 1] as usize;
                let right = right[len - left_len] as usize;
                let first = (place + left_len).saturating_sub(len);
                let terms = first..left_len.min(place + 1);
                pairs.extend(terms.map(|p| (left + p, right + place - p)));
            }
        }
        pairs
    }
}

/// Largest number of coefficients of a small space of one variable.
const LONGEST: usize = 8;
/// Largest number of variables of a small space of the second order.
const MOST_VARIABLES: usize = 6;

/// A space with straight-line code for its products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::jet) enum SmallSpace {
    /// One variable, with this number of powers.
    OneVariable(usize),
    /// Constants and linear terms.
    Linear,
    /// Constants, linear and quadratic terms in this number of variables.
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

/// The product of two elements, which replaces `out` (`SET`) or is added to it.
pub(in crate::jet) struct SmallProduct<'a, S, const SET: bool> {
    pub(in crate::jet) space: SmallSpace,
    pub(in crate::jet) a: &'a [S],
    pub(in crate::jet) b: &'a [S],
    pub(in crate::jet) out: &'a mut [S],
}

impl<S: Scalar, const SET: bool> Vectorised for SmallProduct<'_, S, SET> {
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

    /// The coefficient of `x_i x_j` is `a_0 b_ij + a_i b_j + a_j b_i + a_ij b_0`. The two middle
    /// terms are exchanged if `x_j` alone is one of the last two variables, to keep the order of
    /// the table.
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

    /// Product as a sum over the pairs of the table, in their order.
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
