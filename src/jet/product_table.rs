//! Which products of coefficients a product of jets sums, by blocks.
//!
//! One idea: monomials of one degree that differ in their last two variables only are neighbours, a *run*,
//! and the product of two runs is the product of two polynomials in one variable, its coefficients neighbours
//! again. One entry of the table stands for all of these products, and a run of the result is summed in registers.

use std::ops::Range;

use super::Span;
use super::monomials::{RankTable, next_divisor};

/// The products of a space, run by run of the result.
#[derive(Debug)]
pub(super) struct ProductTable {
    runs: Vec<Run>,
    /// First run of every degree, and the number of runs.
    degree_starts: Vec<usize>,
    groups: Vec<Group>,
    blocks: Vec<Block>,
}

/// Neighbouring monomials of one degree with the same exponents in all variables but the last two.
///
/// It has as many groups of blocks as monomials: the left runs of the first have one monomial, those of
/// the second two, and so on. Its first block is `1 · run`, its last one `run · 1`.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// The monomials.
    pub(super) monomials: Range<usize>,
    /// The first monomial of the run of which it is the square, if it is one.
    pub(super) root: Option<u32>,
    first_group: usize,
}

/// Blocks whose left runs have one length, by ascending left monomials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    first: u32,
    /// End of the blocks whose left run comes before the right one.
    mirror: u32,
    end: u32,
}

/// First monomials of two runs, whose product is the first monomial of a third.
pub(super) type Block = (u32, u32);

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

    /// The pairs `(i, j)` of monomials whose product is a given one, by ascending `i`.
    fn list_pairs(&self, product: usize, pairs: &mut Vec<Block>) {
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
        let mut table = Self {
            runs: Vec::new(),
            degree_starts: Vec::with_capacity(monomials.degree_starts.len()),
            groups: Vec::new(),
            blocks: Vec::new(),
        };
        let mut pairs = Vec::new();
        for degree in monomials.degree_starts.windows(2) {
            table.degree_starts.push(table.runs.len());
            let mut first = degree[0];
            while first < degree[1] {
                let length = monomials.run_length(first);
                monomials.list_pairs(first, &mut pairs);
                table.push_run(first..first + length, &pairs, |left| {
                    monomials.run_length(left as usize)
                });
                first += length;
            }
        }
        table.degree_starts.push(table.runs.len());
        table
    }

    /// Adds a run, from the pairs of first monomials that multiply to its first.
    fn push_run(
        &mut self,
        monomials: Range<usize>,
        pairs: &[Block],
        length: impl Fn(u32) -> usize,
    ) {
        let first_group = self.groups.len();
        for left_len in 1..=monomials.len() {
            let first = self.blocks.len() as u32;
            let group = pairs.iter().filter(|pair| length(pair.0) == left_len);
            self.blocks.extend(group);
            let mirror = self.blocks[first as usize..].partition_point(|&(i, j)| i < j) as u32;
            self.groups.push(Group {
                first,
                mirror: first + mirror,
                end: self.blocks.len() as u32,
            });
        }
        let root = pairs.iter().find(|(left, right)| left == right);
        self.runs.push(Run {
            monomials,
            root: root.map(|&(left, _)| left),
            first_group,
        });
    }

    /// The runs of a range of degrees, by ascending monomials.
    #[inline(always)]
    pub(super) fn runs(&self, degrees: Range<usize>) -> &[Run] {
        &self.runs[self.degree_starts[degrees.start]..self.degree_starts[degrees.end]]
    }

    /// The pairs of monomials whose product is a given one, in the order of the sums.
    pub(super) fn pairs(&self, monomial: usize) -> Vec<(usize, usize)> {
        let after = self
            .runs
            .partition_point(|run| run.monomials.start <= monomial);
        let run = &self.runs[after - 1];
        let (place, len) = (monomial - run.monomials.start, run.monomials.len());
        let blocks = (1..=len).flat_map(|left_len| {
            let place = PlaceOfGroup::new(left_len, len);
            let group = &self.groups(run)[left_len - 1];
            let blocks = self.blocks(group, place, Span::Full).iter();
            blocks.map(move |&(left, right)| (left as usize, right as usize, left_len))
        });
        blocks
            .flat_map(|(left, right, left_len)| {
                let first = (place + left_len).saturating_sub(len);
                (first..left_len.min(place + 1)).map(move |p| (left + p, right + place - p))
            })
            .collect()
    }

    /// The groups of a run.
    #[inline(always)]
    pub(super) fn groups(&self, run: &Run) -> &[Group] {
        &self.groups[run.first_group..run.first_group + run.monomials.len()]
    }

    /// The blocks of a group that a span takes.
    #[inline(always)]
    pub(super) fn blocks(&self, group: &Group, place: PlaceOfGroup, span: Span) -> &[Block] {
        let first = group.first + u32::from(place.is_first && span.leaves_first());
        let end = group.end - u32::from(place.is_last && span.leaves_last());
        &self.blocks[first as usize..end.max(first) as usize]
    }

    /// Those of them whose left run comes before the right one.
    #[inline(always)]
    pub(super) fn blocks_before_mirror(
        &self,
        group: &Group,
        place: PlaceOfGroup,
        span: Span,
    ) -> &[Block] {
        let first = group.first + u32::from(place.is_first && span.leaves_first());
        &self.blocks[first as usize..group.mirror.max(first) as usize]
    }
}

/// Whether a group is the first of its run, or the last.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceOfGroup {
    is_first: bool,
    is_last: bool,
}

impl PlaceOfGroup {
    /// That of the group whose left runs have a length, among those of a run.
    #[inline(always)]
    pub(super) fn new(left_len: usize, run_len: usize) -> Self {
        Self {
            is_first: left_len == 1,
            is_last: left_len == run_len,
        }
    }
}
