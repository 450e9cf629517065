//! All of a product, family by family.
//!
//! The one idea: the product of two families is a product of truncated polynomials in two
//! variables, whose runs are found once for all the products of runs in it: one straight line of
//! code for each number of runs, its sums in registers. The terms of a sum are in the order of the
//! table, so that the bits are those of products run by run.

use super::convolution::{Convolution, Factor, Finish, RunSums, Terms};
use super::table::{Family, Pair, ProductTable, Run};
use crate::jet::Span;
use crate::numeric::{Kernel, Scalar, one_by_one};

/// Most runs of a family that are summed at once: fifteen sums.
///
/// NOTE: with one more the sums and what is multiplied have too few registers, and all is half as
/// fast again.
const MOST_RUNS: usize = 5;

/// All of the product of two elements, which an element becomes (`SET`) or to which it is added.
pub(super) struct FullProduct<'a, S, const SET: bool> {
    pub(super) table: &'a ProductTable,
    pub(super) a: &'a [S],
    pub(super) b: &'a [S],
    pub(super) out: &'a mut [S],
}

impl<S: Scalar, const SET: bool> Kernel for FullProduct<'_, S, SET> {
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

    /// The coefficients of the shortest runs of a family, `COUNT` in all.
    #[inline(always)]
    fn add_family<const RUNS: usize, const COUNT: usize>(&mut self, family: &Family) {
        let mut sums = [S::zero(); COUNT];
        // Those of the last left factor, which is the family: its right one is the constant's.
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

/// Place of the sums of a run among those of its family.
const fn place(len: usize) -> usize {
    len * (len - 1) / 2
}

/// Products that belong to one run.
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

/// The product of a run of `LEFT` coefficients with one of `LEN + 1 − LEFT`.
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
