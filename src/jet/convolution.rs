//! Sums of products of coefficients, a run of the result at a time.
//!
//! One idea: the coefficients of a run are summed side by side, in registers where the run is short. Each is one chain of
//! sums, its terms in the order of the table whatever the scalar, so that lanes give the bits of single numbers.

use super::Span;
use super::product_table::{Block, Group, PlaceOfGroup, ProductTable, Run};
use super::selection::Selection;
use crate::numeric::{Kernel, Scalar, one_by_one};

/// Longest run that is summed in registers.
const LONGEST_IN_REGISTERS: usize = 8;

/// A factor of which the coefficients before `first`, the first of a degree, are known to vanish.
#[derive(Clone, Copy)]
pub(super) struct Factor<'a, S> {
    pub(super) coefficients: &'a [S],
    pub(super) first: u32,
}

impl<'a, S> Factor<'a, S> {
    /// A factor whose coefficients may all differ from zero.
    pub(super) fn full(coefficients: &'a [S]) -> Self {
        Self {
            coefficients,
            first: 0,
        }
    }
}

/// What becomes of a sum of products.
#[derive(Clone, Copy)]
pub(super) enum Finish<'a, S> {
    /// It is added to the coefficient there is.
    Add,
    /// It is multiplied by a factor.
    Scale(S),
    /// It is subtracted from the coefficient of an element, and the difference multiplied by a factor.
    Subtract { from: &'a [S], factor: S },
}

impl<S: Scalar> Finish<'_, S> {
    /// Stores the sums of some monomials, the first of them given.
    #[inline(always)]
    fn store<const LEN: usize>(&self, first: usize, sums: [S; LEN], out: &mut [S; LEN]) {
        match *self {
            Finish::Add => {
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] += sums[k];
                }
            }
            Finish::Scale(factor) => {
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] = sums[k] * factor;
                }
            }
            Finish::Subtract { from, factor } => {
                let Some(from) = from.get(first..).and_then(|from| from.first_chunk::<LEN>())
                else {
                    return;
                };
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] = (from[k] - sums[k]) * factor;
                }
            }
        }
    }
}

/// A product, or part of one: what is added to the coefficients of some runs.
pub(super) struct Convolution<'a, S> {
    pub(super) table: &'a ProductTable,
    pub(super) runs: &'a [Run],
    pub(super) span: Span,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
    /// The coefficients from the monomial `first` on.
    pub(super) first: usize,
    pub(super) out: &'a mut [S],
    /// The runs whose sums can differ from zero, if not all.
    pub(super) selection: Option<Selection<'a>>,
}

impl<S: Scalar> Convolution<'_, S> {
    /// Forms the product.
    ///
    /// NOTE: the one place of the program where the loops are compiled, once per scalar and instruction set.
    #[inline(never)]
    pub(super) fn form(self) {
        S::dispatch(self);
    }
}

impl<S: Scalar> Kernel for Convolution<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let square = std::ptr::eq(self.a.coefficients, self.b.coefficients)
            && matches!(self.span, Span::Full | Span::Interior);
        let end = self.first + self.out.len();
        let from = self
            .runs
            .partition_point(|run| run.monomials.start < self.first);
        let until = self.runs.partition_point(|run| run.monomials.end <= end);
        for run in self.runs.get(from..until).unwrap_or_default() {
            let place = run.monomials.start - self.first;
            let out = &mut self.out[place..place + run.monomials.len()];
            let reaches = |selection: Selection| selection.reaches(&run.monomials);
            if !self.selection.is_none_or(reaches) {
                if !matches!(self.finish, Finish::Add) {
                    out.fill(S::zero());
                }
                continue;
            }
            let terms = Terms {
                table: self.table,
                run,
                span: self.span,
                square,
                a: self.a,
                b: self.b,
                finish: self.finish,
            };
            add_run(&terms, out);
        }
    }
}

/// Adds to the coefficients of one run; of the square of an element, half of the products is formed.
#[inline(always)]
fn add_run<S: Scalar>(terms: &Terms<'_, S>, out: &mut [S]) {
    match out.len() {
        1 => terms.add_in_registers::<1>(out),
        2 => terms.add_in_registers::<2>(out),
        3 => terms.add_in_registers::<3>(out),
        4 => terms.add_in_registers::<4>(out),
        5 => terms.add_in_registers::<5>(out),
        6 => terms.add_in_registers::<6>(out),
        7 => terms.add_in_registers::<7>(out),
        LONGEST_IN_REGISTERS => terms.add_in_registers::<LONGEST_IN_REGISTERS>(out),
        _ => terms.add_in_memory(out),
    }
}

/// The terms of one run of the result.
struct Terms<'a, S> {
    table: &'a ProductTable,
    run: &'a Run,
    span: Span,
    square: bool,
    a: Factor<'a, S>,
    b: Factor<'a, S>,
    finish: Finish<'a, S>,
}

impl<S: Scalar> Terms<'_, S> {
    /// The blocks of a group whose factors can differ from zero; of a square, those before the mirror.
    #[inline(always)]
    fn blocks(&self, group: &Group, place: PlaceOfGroup) -> &[Block] {
        let blocks = match self.square {
            true => self.table.blocks_before_mirror(group, place, self.span),
            false => self.table.blocks(group, place, self.span),
        };
        if self.a.first == 0 && self.b.first == 0 {
            return blocks;
        }
        let from = blocks.partition_point(|&(i, _)| i < self.a.first);
        let until = blocks.partition_point(|&(_, j)| j >= self.b.first);
        &blocks[from.min(until)..until]
    }

    /// The block of a square that is its own mirror image.
    #[inline(always)]
    fn root(&self) -> Option<Block> {
        let root = self.run.root?;
        let is_head = self.run.monomials.start == 0;
        (self.span == Span::Full || !is_head).then_some((root, root))
    }

    #[inline(always)]
    fn add_in_registers<const LEN: usize>(&self, out: &mut [S]) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let Some(groups) = self.table.groups(self.run).first_chunk::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        self.add_group::<1, LEN>(groups, &mut sums);
        self.add_group::<2, LEN>(groups, &mut sums);
        self.add_group::<3, LEN>(groups, &mut sums);
        self.add_group::<4, LEN>(groups, &mut sums);
        self.add_group::<5, LEN>(groups, &mut sums);
        self.add_group::<6, LEN>(groups, &mut sums);
        self.add_group::<7, LEN>(groups, &mut sums);
        self.add_group::<LONGEST_IN_REGISTERS, LEN>(groups, &mut sums);
        if self.square {
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(root) = self.root() {
                match LEN {
                    1 => self.add_blocks::<1, LEN>(&[root], &mut sums),
                    3 => self.add_blocks::<2, LEN>(&[root], &mut sums),
                    5 => self.add_blocks::<3, LEN>(&[root], &mut sums),
                    _ => self.add_blocks::<4, LEN>(&[root], &mut sums),
                }
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    #[inline(always)]
    fn add_group<const LEFT: usize, const LEN: usize>(
        &self,
        groups: &[Group; LEN],
        sums: &mut [S; LEN],
    ) {
        if let Some(group) = groups.get(LEFT - 1) {
            let place = PlaceOfGroup::new(LEFT, LEN);
            self.add_blocks::<LEFT, LEN>(self.blocks(group, place), sums);
        }
    }

    /// Products of runs of `LEFT` coefficients with runs of `LEN + 1 − LEFT`.
    #[inline(always)]
    fn add_blocks<const LEFT: usize, const LEN: usize>(
        &self,
        blocks: &[Block],
        sums: &mut [S; LEN],
    ) {
        let right = (LEN + 1).saturating_sub(LEFT);
        for &(i, j) in blocks {
            let (i, j) = (i as usize, j as usize);
            let (Some(a), Some(b)) = (
                self.a.coefficients.get(i..i + LEFT),
                self.b.coefficients.get(j..j + right),
            ) else {
                return;
            };
            for p in 0..LEFT {
                for q in 0..right {
                    sums[p + q] = a[p].mul_add(b[q], sums[p + q]);
                }
            }
        }
    }

    /// The same for a run of any length.
    #[inline(always)]
    fn add_in_memory(&self, out: &mut [S]) {
        let mut sums = vec![S::zero(); out.len()];
        for (group, left) in self.table.groups(self.run).iter().zip(1..) {
            let place = PlaceOfGroup::new(left, out.len());
            self.add_blocks_of(left, self.blocks(group, place), &mut sums);
        }
        if self.square {
            sums.iter_mut().for_each(|sum| *sum += *sum);
            if let Some(root) = self.root() {
                self.add_blocks_of(out.len().div_ceil(2), &[root], &mut sums);
            }
        }
        let monomials = self.run.monomials.clone();
        for ((monomial, &sum), value) in monomials.zip(&sums).zip(out) {
            self.finish
                .store(monomial, [sum], std::array::from_mut(value));
        }
    }

    #[inline(always)]
    fn add_blocks_of(&self, left: usize, blocks: &[Block], sums: &mut [S]) {
        let right = sums.len() + 1 - left;
        for &(i, j) in blocks {
            let a = &self.a.coefficients[i as usize..i as usize + left];
            let b = &self.b.coefficients[j as usize..j as usize + right];
            for (p, &a) in a.iter().enumerate() {
                for (sum, &b) in sums[p..].iter_mut().zip(b) {
                    *sum = a.mul_add(b, *sum);
                }
            }
        }
    }
}
