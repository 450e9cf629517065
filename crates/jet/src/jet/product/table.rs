//! Which products of coefficients a product of jets sums, by pairs of families.
//!
//! One idea: monomials of one degree that differ in their last two variables only are neighbours, a
//! *run*, and the runs with the same other exponents are a *family*, one run of every length. A run
//! of the result is the sum over the pairs of families that multiply to its own of the products of
//! their runs, whose lengths add up to one more than its own: polynomials in one variable, whose
//! coefficients are summed in registers. One entry of the table stands for all of these products,
//! for every run of a family; it says where the runs begin, so that a visit to a pair reads nothing
//! else of the table.

use std::ops::Range;

use crate::jet::space::{RankTable, next_divisor};

/// The products of a space, run by run of the result.
#[derive(Debug)]
pub(in crate::jet) struct ProductTable {
    runs: Vec<Run>,
    /// First run of every degree, and the number of runs.
    degree_starts: Vec<usize>,
    families: Vec<Family>,
    /// Of every pair of families the first monomials of the left runs and of the right ones, by
    /// ascending length, as many of each as their product has runs.
    pairs: Vec<u32>,
}

/// Neighbouring monomials of one degree with the same exponents in all variables but the last two.
#[derive(Clone, Debug)]
pub(in crate::jet) struct Run {
    /// The monomials.
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
    /// Number of runs, which is the length of the longest.
    #[inline(always)]
    pub(in crate::jet) fn runs(&self) -> usize {
        self.runs
    }
}

/// The pairs of families that multiply to one family, by ascending left ones; the first begins with
/// the constant, the last ends with it.
#[derive(Clone, Copy)]
pub(in crate::jet) struct Pairs<'a> {
    firsts: &'a [u32],
    /// Runs of the product.
    runs: usize,
}

/// The first monomials of the runs of two families, by ascending length, as many of each as their
/// product has.
#[derive(Clone, Copy)]
pub(in crate::jet) struct Pair<'a> {
    pub(in crate::jet) left: &'a [u32],
    pub(in crate::jet) right: &'a [u32],
}

impl<'a> Pair<'a> {
    /// The shortest runs of both, as many as asked for; `None` if there are fewer.
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

    /// The first half of the pairs, and the one in the middle if their number is odd.
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

/// Exponents and weights, as a table is built from them.
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

    /// Number of monomials in the run that begins with a monomial: one where the last two weights
    /// differ.
    fn run_length(&self, first: usize) -> usize {
        match (self.weights, self.exponents(first)) {
            ([.., a, b], [.., exponent, _]) if a == b => usize::from(*exponent) + 1,
            _ => 1,
        }
    }

    /// The first monomials of the runs of the family whose shortest run is a monomial.
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

    /// The pairs `(i, j)` of monomials whose product is a given one, by ascending `i`.
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
        // The first monomials of all runs, family by family; of the first monomial of every run its
        // family and the place of that.
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

    /// The pairs of families that multiply to a family.
    #[inline(always)]
    pub(in crate::jet) fn pairs_of(&self, family: &Family) -> Pairs<'_> {
        Pairs { firsts: &self.pairs[family.pairs.clone()], runs: family.runs }
    }

    /// The pairs of families that multiply to that of a run.
    #[inline(always)]
    pub(in crate::jet) fn pairs_of_run(&self, run: &Run) -> Pairs<'_> {
        self.pairs_of(&run.family)
    }

    /// The pairs of monomials whose product is a given one, in the order of the sums.
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
