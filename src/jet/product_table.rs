//! Which products of coefficients a product of jets sums, by pairs of families.
//!
//! One idea: monomials of one degree that differ in their last two variables only are neighbours, a *run*, and the
//! runs with the same other exponents are a *family*, one run of every length. A run of the result is the sum over the pairs of
//! families that multiply to its own of the products of their runs, whose lengths add up to one more than its own: polynomials in one
//! variable, whose coefficients are summed in registers. One entry of the table stands for all of these products, for every run of
//! a family.

use std::ops::Range;

use super::monomials::{RankTable, next_divisor};

/// The products of a space, run by run of the result.
#[derive(Debug)]
pub(super) struct ProductTable {
    runs: Vec<Run>,
    /// First run of every degree, and the number of runs.
    degree_starts: Vec<usize>,
    /// The first monomials of the runs of every family, by length.
    starts: Vec<u32>,
    pairs: Vec<Pair>,
    families: Vec<Family>,
}

/// Neighbouring monomials of one degree with the same exponents in all variables but the last two.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// The monomials.
    pub(super) monomials: Range<usize>,
    pairs: Range<usize>,
}

/// All runs with the same exponents in all variables but the last two.
#[derive(Clone, Debug)]
pub(super) struct Family {
    /// Place of its shortest run among the first monomials of all runs, and places of the others.
    runs: Range<usize>,
    pairs: Range<usize>,
}

impl Family {
    /// Number of runs, which is the length of the longest.
    #[inline(always)]
    pub(super) fn runs(&self) -> usize {
        self.runs.len()
    }
}

/// Two families, each by the place of the first monomial of its shortest run among those of all runs.
pub(super) type Pair = (u32, u32);

/// Exponents and weights, as a table is built from them.
pub(super) struct Monomials<'a> {
    pub(super) weights: &'a [u32],
    pub(super) exponents: &'a [u8],
    pub(super) degree_starts: &'a [usize],
    pub(super) ranks: &'a RankTable,
}

impl Monomials<'_> {
    fn exponents(&self, monomial: usize) -> &[u8] {
        let variables = self.weights.len();
        &self.exponents[monomial * variables..(monomial + 1) * variables]
    }

    /// Number of monomials in the run that begins with a monomial: one where the last two weights differ.
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
        let rank = |e: &[u8]| {
            self.ranks
                .find(e)
                .expect("a divisor of a kept monomial is kept") as u32
        };
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
    pub(super) fn new(monomials: &Monomials<'_>) -> Self {
        let count = monomials.degree_starts.last().copied().unwrap_or(0);
        let mut table = Self {
            runs: Vec::new(),
            degree_starts: Vec::with_capacity(monomials.degree_starts.len()),
            starts: Vec::with_capacity(count),
            pairs: Vec::new(),
            families: Vec::new(),
        };
        // Of the first monomial of every run: the place of its family and the family's pairs.
        let mut families = vec![(0, 0..0); count];
        let mut products = Vec::new();
        for degree in monomials.degree_starts.windows(2) {
            table.degree_starts.push(table.runs.len());
            let mut first = degree[0];
            while first < degree[1] {
                let length = monomials.run_length(first);
                if length == 1 {
                    let place = table.starts.len();
                    table.starts.extend(monomials.family(first));
                    families[first].0 = place as u32;
                    monomials.list_pairs(first, &mut products);
                    let family = |monomial: u32| families[monomial as usize].0;
                    let begin = table.pairs.len();
                    let pairs = products.iter().map(|&(i, j)| (family(i), family(j)));
                    table.pairs.extend(pairs);
                    let pairs = begin..table.pairs.len();
                    table.families.push(Family {
                        runs: place..table.starts.len(),
                        pairs: pairs.clone(),
                    });
                    for &start in &table.starts[place..] {
                        families[start as usize] = (place as u32, pairs.clone());
                    }
                }
                table.runs.push(Run {
                    monomials: first..first + length,
                    pairs: families[first].1.clone(),
                });
                first += length;
            }
        }
        table.degree_starts.push(table.runs.len());
        table
    }

    /// The numbers of the runs of a range of degrees.
    #[inline(always)]
    pub(super) fn run_numbers(&self, degrees: Range<usize>) -> Range<usize> {
        self.degree_starts[degrees.start]..self.degree_starts[degrees.end]
    }

    /// All runs, by ascending monomials.
    #[inline(always)]
    pub(super) fn all_runs(&self) -> &[Run] {
        &self.runs
    }

    /// All families.
    #[inline(always)]
    pub(super) fn families(&self) -> &[Family] {
        &self.families
    }

    /// The first monomials of the runs of a family, by ascending length, and the pairs of families that multiply to it.
    #[inline(always)]
    pub(super) fn starts_and_pairs(&self, family: &Family) -> (&[u32], &[Pair]) {
        (
            &self.starts[family.runs.clone()],
            &self.pairs[family.pairs.clone()],
        )
    }

    /// The pairs of families that multiply to that of a run, by ascending left ones; the first begins with the constant, the last ends with it.
    #[inline(always)]
    pub(super) fn pairs_of(&self, run: &Run) -> &[Pair] {
        &self.pairs[run.pairs.clone()]
    }

    /// The first monomials of the runs of a family, by ascending length, as many as asked for.
    #[inline(always)]
    pub(super) fn starts(&self, family: u32, count: usize) -> Option<&[u32]> {
        let family = family as usize;
        self.starts.get(family..family + count)
    }

    /// The pairs of monomials whose product is a given one, in the order of the sums.
    pub(super) fn pairs(&self, monomial: usize) -> Vec<(usize, usize)> {
        let after = self
            .runs
            .partition_point(|run| run.monomials.start <= monomial);
        let run = &self.runs[after - 1];
        let (place, len) = (monomial - run.monomials.start, run.monomials.len());
        let mut pairs = Vec::new();
        for &(left, right) in self.pairs_of(run) {
            for left_len in 1..=len {
                let left = self.starts[left as usize + left_len - 1] as usize;
                let right = self.starts[right as usize + len - left_len] as usize;
                let first = (place + left_len).saturating_sub(len);
                let terms = first..left_len.min(place + 1);
                pairs.extend(terms.map(|p| (left + p, right + place - p)));
            }
        }
        pairs
    }
}
