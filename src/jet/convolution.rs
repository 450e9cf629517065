//! Sums of products of coefficients, a run of the result at a time.
//!
//! One idea: the coefficients of a run are summed side by side, in registers where the run is short. Each is one chain of
//! sums, its terms in the order of the table whatever the scalar, so that lanes give the bits of single numbers.

use super::Span;
use super::product_table::{Pair, ProductTable, Run};
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

    /// The same, its head left out or not.
    #[inline(always)]
    fn from(self, leaves_head: bool) -> Self {
        Self {
            first: self.first.max(u32::from(leaves_head)),
            ..self
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
    /// NOTE: the one place of the program where the loops are compiled, once per scalar and instruction set, and apart for the
    /// common kinds: a sum with no choice in it stays in registers.
    #[inline(never)]
    pub(super) fn form(self) {
        let square = self.is_square();
        match (self.span, square) {
            _ if self.a.first.max(self.b.first) > 0 => S::dispatch(Formed(self, Any { square })),
            (Span::Full, false) => S::dispatch(Formed(self, All::<false, false>)),
            (Span::Full, true) => S::dispatch(Formed(self, All::<false, true>)),
            (Span::WithoutFirst, false) => S::dispatch(Formed(self, All::<true, false>)),
            _ => S::dispatch(Formed(self, Any { square })),
        }
    }

    /// Whether it is the square of an element, of which half the products are formed.
    #[inline(always)]
    fn is_square(&self) -> bool {
        std::ptr::eq(self.a.coefficients, self.b.coefficients)
            && matches!(self.span, Span::Full | Span::Interior)
    }

    /// Adds to every run that is asked for.
    #[inline(always)]
    fn add<A: Addition>(self, addition: A) {
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
                a: self.a.from(self.span.leaves_first()),
                b: self.b.from(self.span.leaves_last()),
                finish: self.finish,
            };
            addition.add(&terms, out);
        }
    }
}

/// A way to add to a run.
///
/// NOTE: not a closure, for these are not always inlined, and what is not is compiled for the least machine.
trait Addition {
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]);
}

/// Any product, or the square of an element.
struct Any {
    square: bool,
}

impl Addition for Any {
    #[inline(always)]
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]) {
        match out.len() {
            1 => terms.add_some::<1>(self.square, out),
            2 => terms.add_some::<2>(self.square, out),
            3 => terms.add_some::<3>(self.square, out),
            4 => terms.add_some::<4>(self.square, out),
            5 => terms.add_some::<5>(self.square, out),
            6 => terms.add_some::<6>(self.square, out),
            7 => terms.add_some::<7>(self.square, out),
            LONGEST_IN_REGISTERS => terms.add_some::<LONGEST_IN_REGISTERS>(self.square, out),
            _ => terms.add_in_memory(self.square, out),
        }
    }
}

/// A product of elements that may differ from zero everywhere: all of it, all but the head of the left one, or a square.
struct All<const WITHOUT_FIRST: bool, const SQUARE: bool>;

impl<const WITHOUT_FIRST: bool, const SQUARE: bool> Addition for All<WITHOUT_FIRST, SQUARE> {
    #[inline(always)]
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]) {
        match out.len() {
            1 => terms.add_all::<1, WITHOUT_FIRST, SQUARE>(out),
            2 => terms.add_all::<2, WITHOUT_FIRST, SQUARE>(out),
            3 => terms.add_all::<3, WITHOUT_FIRST, SQUARE>(out),
            4 => terms.add_all::<4, WITHOUT_FIRST, SQUARE>(out),
            5 => terms.add_all::<5, WITHOUT_FIRST, SQUARE>(out),
            6 => terms.add_all::<6, WITHOUT_FIRST, SQUARE>(out),
            7 => terms.add_all::<7, WITHOUT_FIRST, SQUARE>(out),
            LONGEST_IN_REGISTERS => {
                terms.add_all::<LONGEST_IN_REGISTERS, WITHOUT_FIRST, SQUARE>(out);
            }
            _ => terms.add_in_memory(SQUARE, out),
        }
    }
}

/// All of the product of two elements, added to an element.
///
/// NOTE: compiled apart: knowing that all is wanted saves a quarter.
pub(super) struct FullProduct<'a, S> {
    pub(super) table: &'a ProductTable,
    pub(super) a: &'a [S],
    pub(super) b: &'a [S],
    pub(super) out: &'a mut [S],
}

impl<S: Scalar> Kernel for FullProduct<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let product = Convolution {
            table: self.table,
            runs: self.table.all_runs(),
            span: Span::Full,
            a: Factor::full(self.a),
            b: Factor::full(self.b),
            finish: Finish::Add,
            first: 0,
            out: self.out,
            selection: None,
        };
        if product.is_square() {
            product.form();
        } else {
            product.add(All::<false, false>);
        }
    }
}

/// A product and the way to form it.
struct Formed<'a, S, A>(Convolution<'a, S>, A);

impl<S: Scalar, A: Addition> Kernel for Formed<'_, S, A> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add(self.1);
    }
}

/// The terms of one run of the result.
struct Terms<'a, S> {
    table: &'a ProductTable,
    run: &'a Run,
    a: Factor<'a, S>,
    b: Factor<'a, S>,
    finish: Finish<'a, S>,
}

/// The first monomials of the runs of two families, by length.
#[derive(Clone, Copy)]
struct Families<'a> {
    left: &'a [u32],
    right: &'a [u32],
}

impl<'a, S: Scalar> Terms<'a, S> {
    /// The pairs of which products are formed, and of a square the family that is multiplied with itself.
    #[inline(always)]
    fn pairs(&self, square: bool) -> (&'a [Pair], Option<Pair>) {
        let pairs = self.table.pairs_of(self.run);
        if square {
            let (half, rest) = pairs.split_at(pairs.len() / 2);
            (half, rest.first().copied().filter(|_| pairs.len() % 2 == 1))
        } else {
            (pairs, None)
        }
    }

    /// The runs of a pair.
    #[inline(always)]
    fn families(&self, (left, right): Pair, len: usize) -> Option<Families<'a>> {
        Some(Families {
            left: self.table.starts(left, len)?,
            right: self.table.starts(right, len)?,
        })
    }

    /// Whether a left run of a length and the right one that goes with it can differ from zero.
    #[inline(always)]
    fn counts(&self, families: Families<'_>, left: usize) -> bool {
        let right = families.right.len() - left;
        families.left[left - 1] >= self.a.first && families.right[right] >= self.b.first
    }

    #[inline(always)]
    fn add_all<const LEN: usize, const WITHOUT_FIRST: bool, const SQUARE: bool>(
        &self,
        out: &mut [S],
    ) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        let (mut pairs, root) = self.pairs(SQUARE);
        if WITHOUT_FIRST && let [first, rest @ ..] = pairs {
            let Some(families) = self.families(*first, LEN) else {
                return;
            };
            self.add_blocks::<LEN>(families, 2, LEN, &mut sums);
            pairs = rest;
        }
        for &pair in pairs {
            let Some(families) = self.families(pair, LEN) else {
                return;
            };
            self.add_blocks::<LEN>(families, 1, LEN, &mut sums);
        }
        if SQUARE {
            if let Some(families) = root.and_then(|root| self.families(root, LEN)) {
                self.add_blocks::<LEN>(families, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(families) = root.and_then(|root| self.families(root, LEN))
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks::<LEN>(families, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Products of the runs of two families, the left ones of lengths in a range that is known in advance.
    #[inline(always)]
    fn add_blocks<const LEN: usize>(
        &self,
        families: Families<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes = |left: usize| from <= left && left <= to;
        self.add_block::<1, LEN>(families, takes(1), sums);
        self.add_block::<2, LEN>(families, takes(2), sums);
        self.add_block::<3, LEN>(families, takes(3), sums);
        self.add_block::<4, LEN>(families, takes(4), sums);
        self.add_block::<5, LEN>(families, takes(5), sums);
        self.add_block::<6, LEN>(families, takes(6), sums);
        self.add_block::<7, LEN>(families, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(families, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
    #[inline(always)]
    fn add_block<const LEFT: usize, const LEN: usize>(
        &self,
        families: Families<'_>,
        is_taken: bool,
        sums: &mut [S; LEN],
    ) {
        if LEFT > LEN || !is_taken {
            return;
        }
        let right = LEN + 1 - LEFT;
        let i = families.left[LEFT - 1] as usize;
        let j = families.right[right - 1] as usize;
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

    /// Products that can differ from zero.
    #[inline(always)]
    fn add_some<const LEN: usize>(&self, square: bool, out: &mut [S]) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        let (pairs, root) = self.pairs(square);
        for &pair in pairs {
            if let Some(families) = self.families(pair, LEN) {
                self.add_blocks_that_count(families, 1, LEN, &mut sums);
            }
        }
        if square {
            if let Some(families) = root.and_then(|root| self.families(root, LEN)) {
                self.add_blocks_that_count(families, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(families) = root.and_then(|root| self.families(root, LEN))
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks_that_count(families, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Those of the products of two families that can differ from zero.
    #[inline(always)]
    fn add_blocks_that_count<const LEN: usize>(
        &self,
        families: Families<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes =
            |left: usize| left <= LEN && from <= left && left <= to && self.counts(families, left);
        self.add_block::<1, LEN>(families, takes(1), sums);
        self.add_block::<2, LEN>(families, takes(2), sums);
        self.add_block::<3, LEN>(families, takes(3), sums);
        self.add_block::<4, LEN>(families, takes(4), sums);
        self.add_block::<5, LEN>(families, takes(5), sums);
        self.add_block::<6, LEN>(families, takes(6), sums);
        self.add_block::<7, LEN>(families, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(families, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// The same for a run of any length.
    #[inline(always)]
    fn add_in_memory(&self, square: bool, out: &mut [S]) {
        let len = out.len();
        let mut sums = vec![S::zero(); len];
        let (pairs, root) = self.pairs(square);
        for &pair in pairs {
            if let Some(families) = self.families(pair, len) {
                self.add_blocks_of(families, 1..=len, &mut sums);
            }
        }
        if square {
            let families = root.and_then(|root| self.families(root, len));
            if let Some(families) = families {
                self.add_blocks_of(families, 1..=len / 2, &mut sums);
            }
            sums.iter_mut().for_each(|sum| *sum += *sum);
            if let Some(families) = families.filter(|_| len % 2 == 1) {
                let half = len.div_ceil(2);
                self.add_blocks_of(families, half..=half, &mut sums);
            }
        }
        let monomials = self.run.monomials.clone();
        for ((monomial, &sum), value) in monomials.zip(&sums).zip(out) {
            self.finish
                .store(monomial, [sum], std::array::from_mut(value));
        }
    }

    #[inline(always)]
    fn add_blocks_of(
        &self,
        families: Families<'_>,
        lefts: std::ops::RangeInclusive<usize>,
        sums: &mut [S],
    ) {
        for left in lefts {
            if !self.counts(families, left) {
                continue;
            }
            let right = sums.len() + 1 - left;
            let (i, j) = (families.left[left - 1], families.right[right - 1]);
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
