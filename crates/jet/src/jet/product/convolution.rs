//! Sums of products of coefficients, one run of the result at a time.
//!
//! One idea: the coefficients of a run are summed side by side, in registers if the run is short.
//! Each sum is one chain, its terms in the order of the table for every scalar type, so that lanes
//! give the bits of single numbers.

use super::table::{Family, Pair, Pairs, ProductTable, Run};
use crate::jet::{Selection, Span};
use crate::numeric::{Scalar, Vectorised, one_by_one};

/// Longest run that is summed in registers.
const LONGEST_IN_REGISTERS: usize = 8;
/// Longest run that is summed without an allocation.
const LONGEST_ON_STACK: usize = 16;

/// A factor whose coefficients before number `first`, the first of a degree, are known to vanish.
#[derive(Clone, Copy)]
pub(super) struct Factor<'a, S> {
    pub(super) coefficients: &'a [S],
    pub(super) first: u32,
}

impl<'a, S> Factor<'a, S> {
    /// A factor whose coefficients may all differ from zero.
    pub(super) fn full(coefficients: &'a [S]) -> Self {
        Self { coefficients, first: 0 }
    }

    /// The factor without its head, if `leaves_head`.
    #[inline(always)]
    fn from(self, leaves_head: bool) -> Self {
        Self { first: self.first.max(u32::from(leaves_head)), ..self }
    }
}

/// Operation that stores a sum of products in the result.
#[derive(Clone, Copy)]
pub(super) enum Finish<'a, S> {
    /// The sum replaces the coefficient.
    Set,
    /// The sum is added to the coefficient.
    Add,
    /// The sum times a factor replaces the coefficient.
    Scale(S),
    /// The coefficient becomes `factor` times the difference of the element's coefficient and the
    /// sum.
    Subtract { from: &'a [S], factor: S },
}

impl<S: Scalar> Finish<'_, S> {
    /// Stores the sums of neighbouring monomials; `first` is the number of the first.
    #[inline(always)]
    fn store<const LEN: usize>(&self, first: usize, sums: [S; LEN], out: &mut [S; LEN]) {
        match *self {
            Finish::Set => *out = sums,
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

/// A product, or its part in some runs.
pub(super) struct Convolution<'a, S> {
    pub(super) table: &'a ProductTable,
    /// Neighbouring runs, whose coefficients are in `out`.
    pub(super) runs: &'a [Run],
    pub(super) span: Span,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
    pub(super) out: &'a mut [S],
    /// Runs whose sums can differ from zero; `None` for all.
    pub(super) selection: Option<Selection<'a>>,
}

impl<S: Scalar> Convolution<'_, S> {
    /// Forms the product.
    ///
    /// NOTE: the loops are compiled at this place only, once per scalar and instruction set, and
    /// separately for the common kinds of terms: a sum without branches stays in registers.
    #[inline(never)]
    pub(super) fn form(self) {
        let is_square = self.is_square();
        let all = self.a.first.max(self.b.first) == 0;
        match self.span {
            Span::Full if all && !is_square => S::dispatch(Formed(self, Terms::ALL)),
            Span::Full if all => S::dispatch(Formed(self, Terms::SQUARE)),
            Span::WithoutFirst if all && !is_square => {
                S::dispatch(Formed(self, Terms::WITHOUT_FIRST));
            }
            _ => S::dispatch(Formed(self, Terms::nonzero(is_square))),
        }
    }

    /// Whether the product is the square of an element; then half of the products are formed.
    #[inline(always)]
    fn is_square(&self) -> bool {
        std::ptr::eq(self.a.coefficients, self.b.coefficients)
            && matches!(self.span, Span::Full | Span::Interior)
    }

    /// Adds to every selected run; with `UNROLLED` all sums of a short run are kept in registers.
    #[inline(always)]
    fn add<const UNROLLED: bool>(self, terms: Terms) {
        let first = self.runs.first().map_or(0, |run| run.monomials.start);
        for run in self.runs {
            let place = run.monomials.start - first;
            let out = &mut self.out[place..place + run.monomials.len()];
            let reaches = |selection: Selection| selection.reaches(&run.monomials);
            if !self.selection.is_none_or(reaches) {
                if !matches!(self.finish, Finish::Add) {
                    out.fill(S::zero());
                }
                continue;
            }
            let sums = RunSums {
                table: self.table,
                run,
                a: self.a.from(self.span.leaves_first()),
                b: self.b.from(self.span.leaves_last()),
                finish: self.finish,
            };
            sums.add::<UNROLLED>(terms, out);
        }
    }

    /// Adds to every selected run, with one small piece of code for all kinds of products.
    #[inline(never)]
    fn add_compactly(self) {
        let terms = Terms::nonzero(self.is_square());
        self.add::<false>(terms);
    }
}

/// A product and the kind of its terms.
struct Formed<'a, S>(Convolution<'a, S>, Terms);

impl<S: Scalar> Vectorised for Formed<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add::<true>(self.1);
    }

    #[inline(always)]
    fn run_compact(self) {
        self.0.add_compactly();
    }
}

/// Kind of the terms of a sum; a constant wherever sums are kept in registers.
#[derive(Clone, Copy)]
pub(super) struct Terms {
    /// Whether products with the head of the left factor are left out.
    leave_head: bool,
    /// Whether the factors are the same element: each product of two different runs is formed once.
    are_square: bool,
    /// Whether factors may vanish in low degrees, whose terms are skipped.
    may_vanish: bool,
}

impl Terms {
    /// All terms.
    pub(super) const ALL: Self = Self { leave_head: false, are_square: false, may_vanish: false };
    const WITHOUT_FIRST: Self = Self { leave_head: true, ..Self::ALL };
    const SQUARE: Self = Self { are_square: true, ..Self::ALL };

    /// Terms that can differ from zero.
    #[inline(always)]
    const fn nonzero(are_square: bool) -> Self {
        Self { leave_head: false, are_square, may_vanish: true }
    }
}

/// The sums of one run of the result.
pub(super) struct RunSums<'a, S> {
    pub(super) table: &'a ProductTable,
    pub(super) run: &'a Run,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
}

impl<'a, S: Scalar> RunSums<'a, S> {
    /// Forms the sums and stores them. Runs of more than three monomials are summed in registers
    /// only if `UNROLLED`.
    #[inline(always)]
    pub(super) fn add<const UNROLLED: bool>(&self, terms: Terms, out: &mut [S]) {
        if !UNROLLED {
            return match out.len() {
                1 => self.add_in_registers::<1>(terms, out),
                2 => self.add_in_registers::<2>(terms, out),
                3 => self.add_in_registers::<3>(terms, out),
                _ => self.add_in_memory(terms.are_square, out),
            };
        }
        match out.len() {
            1 => self.add_in_registers::<1>(terms, out),
            2 => self.add_in_registers::<2>(terms, out),
            3 => self.add_in_registers::<3>(terms, out),
            4 => self.add_in_registers::<4>(terms, out),
            5 => self.add_in_registers::<5>(terms, out),
            6 => self.add_in_registers::<6>(terms, out),
            7 => self.add_in_registers::<7>(terms, out),
            LONGEST_IN_REGISTERS => self.add_in_registers::<LONGEST_IN_REGISTERS>(terms, out),
            _ => self.add_in_memory(terms.are_square, out),
        }
    }

    /// The pairs of families whose products are formed; for a square also the pair of a family with
    /// itself, if there is one.
    #[inline(always)]
    fn pairs(&self, square: bool) -> (Pairs<'a>, Option<Pair<'a>>) {
        let pairs = self.table.pairs_of_run(self.run);
        if square { pairs.half() } else { (pairs, None) }
    }

    /// Whether the product of a left run of this length with the matching right run can differ from
    /// zero.
    #[inline(always)]
    fn counts(&self, pair: Pair<'_>, left: usize, len: usize) -> bool {
        pair.left[left - 1] >= self.a.first && pair.right[len - left] >= self.b.first
    }

    #[inline(always)]
    fn add_in_registers<const LEN: usize>(&self, terms: Terms, out: &mut [S]) {
        let Some(out) = out.first_chunk_mut::<LEN>() else {
            return;
        };
        let mut sums = [S::zero(); LEN];
        let (mut pairs, root) = self.pairs(terms.are_square);
        if terms.leave_head {
            let (first, rest) = pairs.split_first();
            if let Some(pair) = first {
                self.add_blocks(terms, pair, 2, LEN, &mut sums);
            }
            pairs = rest;
        }
        for pair in pairs.iter() {
            self.add_blocks(terms, pair, 1, LEN, &mut sums);
        }
        if terms.are_square {
            if let Some(pair) = root {
                self.add_blocks(terms, pair, 1, LEN / 2, &mut sums);
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                one_by_one::<S>(k);
                *sum += *sum;
            }
            if let Some(pair) = root
                && LEN % 2 == 1
            {
                let half = LEN.div_ceil(2);
                self.add_blocks(terms, pair, half, half, &mut sums);
            }
        }
        self.finish.store(self.run.monomials.start, sums, out);
    }

    /// Adds the products of the runs of two families, for a range of lengths of the left runs that
    /// is known at compile time.
    #[inline(always)]
    fn add_blocks<const LEN: usize>(
        &self,
        terms: Terms,
        pair: Pair<'_>,
        from: usize,
        to: usize,
        sums: &mut [S; LEN],
    ) {
        let takes = |left: usize| {
            left <= LEN
                && from <= left
                && left <= to
                && (!terms.may_vanish || self.counts(pair, left, LEN))
        };
        let Some(pair) = pair.shortest::<LEN>() else {
            return;
        };
        self.add_block::<1, LEN>(pair, takes(1), sums);
        self.add_block::<2, LEN>(pair, takes(2), sums);
        self.add_block::<3, LEN>(pair, takes(3), sums);
        self.add_block::<4, LEN>(pair, takes(4), sums);
        self.add_block::<5, LEN>(pair, takes(5), sums);
        self.add_block::<6, LEN>(pair, takes(6), sums);
        self.add_block::<7, LEN>(pair, takes(7), sums);
        self.add_block::<LONGEST_IN_REGISTERS, LEN>(pair, takes(LONGEST_IN_REGISTERS), sums);
    }

    /// Adds the product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
    #[inline(always)]
    fn add_block<const LEFT: usize, const LEN: usize>(
        &self,
        [left, right]: [&[u32; LEN]; 2],
        is_taken: bool,
        sums: &mut [S; LEN],
    ) {
        if LEFT > LEN || !is_taken {
            return;
        }
        let rest = LEN + 1 - LEFT;
        let (i, j) = (left[LEFT - 1] as usize, right[rest - 1] as usize);
        let (Some(a), Some(b)) =
            (self.a.coefficients.get(i..i + LEFT), self.b.coefficients.get(j..j + rest))
        else {
            return;
        };
        for p in 0..LEFT {
            for q in 0..rest {
                sums[p + q] = a[p].mul_add(b[q], sums[p + q]);
            }
        }
    }

    /// Forms the sums of a run of any length in loops, and stores them.
    #[inline(always)]
    fn add_in_memory(&self, square: bool, out: &mut [S]) {
        let len = out.len();
        let (mut short, mut long) = ([S::zero(); LONGEST_ON_STACK], Vec::new());
        let sums = if len <= LONGEST_ON_STACK {
            &mut short[..len]
        } else {
            long.resize(len, S::zero());
            &mut long[..]
        };
        let (pairs, root) = self.pairs(square);
        for pair in pairs.iter() {
            self.add_blocks_in_memory(pair, 1, len, sums);
        }
        if square {
            if let Some(pair) = root {
                self.add_blocks_in_memory(pair, 1, len / 2, sums);
            }
            sums.iter_mut().for_each(|sum| *sum += *sum);
            if let Some(pair) = root.filter(|_| len % 2 == 1) {
                let half = len.div_ceil(2);
                self.add_blocks_in_memory(pair, half, half, sums);
            }
        }
        let monomials = self.run.monomials.clone();
        for ((monomial, &sum), value) in monomials.zip(&*sums).zip(out) {
            self.finish.store(monomial, [sum], std::array::from_mut(value));
        }
    }

    #[inline(always)]
    fn add_blocks_in_memory(&self, pair: Pair<'_>, from: usize, to: usize, sums: &mut [S]) {
        for left in from..to + 1 {
            if !self.counts(pair, left, sums.len()) {
                continue;
            }
            let right = sums.len() + 1 - left;
            let (i, j) = (pair.left[left - 1], pair.right[right - 1]);
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

/// Largest number of runs of a family that are summed at once: fifteen sums.
///
/// NOTE: with one run more there are too few registers for the sums and the factors, and the
/// product is slower by about half.
const MOST_RUNS: usize = 5;

/// The full product of two elements, which replaces `out` (`SET`) or is added to it.
pub(super) struct FullProduct<'a, S, const SET: bool> {
    pub(super) table: &'a ProductTable,
    pub(super) a: &'a [S],
    pub(super) b: &'a [S],
    pub(super) out: &'a mut [S],
}

impl<S: Scalar, const SET: bool> Vectorised for FullProduct<'_, S, SET> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        if std::ptr::eq(self.a, self.b) {
            self.run_by_run().form();
            return;
        }
        for family in self.table.families() {
            match family.runs() {
                1 => self.add_family::<1, 1>(family),
                2 => self.add_family::<2, 3>(family),
                3 => self.add_family::<3, 6>(family),
                4 => self.add_family::<4, 10>(family),
                _ => self.add_family::<MOST_RUNS, 15>(family),
            }
        }
        let long = |run: &&Run| run.monomials.len() > MOST_RUNS;
        for run in self.table.all_runs().iter().filter(long) {
            let sums = RunSums {
                table: self.table,
                run,
                a: Factor::full(self.a),
                b: Factor::full(self.b),
                finish: Self::FINISH,
            };
            let out = &mut self.out[run.monomials.clone()];
            sums.add::<true>(Terms::ALL, out);
        }
    }

    #[inline(always)]
    fn run_compact(self) {
        self.run_by_run().form();
    }
}

impl<'a, S: Scalar, const SET: bool> FullProduct<'a, S, SET> {
    const FINISH: Finish<'static, S> = if SET { Finish::Set } else { Finish::Add };

    fn run_by_run(self) -> Convolution<'a, S> {
        Convolution {
            table: self.table,
            runs: self.table.all_runs(),
            span: Span::Full,
            a: Factor::full(self.a),
            b: Factor::full(self.b),
            finish: Self::FINISH,
            out: self.out,
            selection: None,
        }
    }

    /// The shortest runs of both families of a pair.
    #[inline(always)]
    fn factors<const RUNS: usize>(&self, pair: Pair<'_>) -> Option<[[&'a [S]; RUNS]; 2]> {
        let [left, right] = pair.shortest::<RUNS>()?;
        Some([runs(self.a, left)?, runs(self.b, right)?])
    }

    /// Adds to the shortest runs of a family, `COUNT` coefficients in all.
    #[inline(always)]
    fn add_family<const RUNS: usize, const COUNT: usize>(&mut self, family: &Family) {
        let mut sums = [S::zero(); COUNT];
        // The starts of the last left factor, which is the family itself: its right factor is the
        // constant.
        let mut starts: &[u32] = &[];
        for pair in self.table.pairs_of(family).iter() {
            let Some([a, b]) = self.factors::<RUNS>(pair) else {
                debug_assert!(false, "a factor has as many runs as its product, or more");
                return;
            };
            starts = pair.left;
            add_run::<S, 1, RUNS, COUNT>(&a, &b, &mut sums);
            add_run::<S, 2, RUNS, COUNT>(&a, &b, &mut sums);
            add_run::<S, 3, RUNS, COUNT>(&a, &b, &mut sums);
            add_run::<S, 4, RUNS, COUNT>(&a, &b, &mut sums);
            add_run::<S, MOST_RUNS, RUNS, COUNT>(&a, &b, &mut sums);
        }
        for (run, &start) in starts.iter().take(RUNS).enumerate() {
            let start = start as usize;
            let sums = &sums[place(run + 1)..place(run + 2)];
            let out = &mut self.out[start..start + run + 1];
            for (k, (value, &sum)) in out.iter_mut().zip(sums).enumerate() {
                one_by_one::<S>(k);
                *value = if SET { sum } else { *value + sum };
            }
        }
    }
}

/// The shortest runs of a family.
#[inline(always)]
fn runs<'a, S, const RUNS: usize>(
    element: &'a [S],
    starts: &[u32; RUNS],
) -> Option<[&'a [S]; RUNS]> {
    let mut runs: [&[S]; RUNS] = [&[]; RUNS];
    for run in 0..RUNS {
        let start = starts[run] as usize;
        runs[run] = element.get(start..start + run + 1)?;
    }
    Some(runs)
}

/// Index of a run's first sum among the sums of its family.
const fn place(len: usize) -> usize {
    len * (len - 1) / 2
}

/// Adds the products that belong to one run.
#[inline(always)]
fn add_run<S: Scalar, const LEN: usize, const RUNS: usize, const COUNT: usize>(
    a: &[&[S]; RUNS],
    b: &[&[S]; RUNS],
    sums: &mut [S; COUNT],
) {
    add_block::<S, 1, LEN, RUNS, COUNT>(a, b, sums);
    add_block::<S, 2, LEN, RUNS, COUNT>(a, b, sums);
    add_block::<S, 3, LEN, RUNS, COUNT>(a, b, sums);
    add_block::<S, 4, LEN, RUNS, COUNT>(a, b, sums);
    add_block::<S, MOST_RUNS, LEN, RUNS, COUNT>(a, b, sums);
}

/// Adds the product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
#[inline(always)]
fn add_block<
    S: Scalar,
    const LEFT: usize,
    const LEN: usize,
    const RUNS: usize,
    const COUNT: usize,
>(
    a: &[&[S]; RUNS],
    b: &[&[S]; RUNS],
    sums: &mut [S; COUNT],
) {
    if LEFT > LEN || LEN > RUNS {
        return;
    }
    let right = LEN + 1 - LEFT;
    for p in 0..LEFT {
        for q in 0..right {
            let sum = &mut sums[place(LEN) + p + q];
            *sum = a[LEFT - 1][p].mul_add(b[right - 1][q], *sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    #[test]
    fn the_compact_form_has_the_bits_of_the_unrolled_one() {
        for (variables, order) in [(2, 20), (3, 7), (5, 4)] {
            let space = JetSpace::uniform(variables, order).expect("a small space");
            let filled = |seed: f64| -> Vec<f64> {
                let value = |m: usize| ((m as f64 + seed) * 0.618).sin();
                (0..space.len()).map(value).collect()
            };
            let (a, b) = (filled(0.3), filled(0.7));
            let spans = [Span::Full, Span::WithoutFirst, Span::WithoutLast, Span::Interior];
            for (span, right) in spans.into_iter().flat_map(|span| [(span, &a), (span, &b)]) {
                let formed = |work: fn(Convolution<'_, f64>)| {
                    let mut out = filled(0.9);
                    work(Convolution {
                        table: space.table(),
                        runs: space.table().all_runs(),
                        span,
                        a: Factor::full(&a),
                        b: Factor::full(right),
                        finish: Finish::Add,
                        out: &mut out,
                        selection: None,
                    });
                    out
                };
                let unrolled = formed(|convolution| convolution.form());
                assert_eq!(unrolled, formed(|convolution| convolution.add_compactly()));
            }
        }
    }
}
