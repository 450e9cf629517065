//! The solved equations of an element, applied to several coefficients together.

use std::hint::black_box;
use std::ops::Range;

use super::gauss::{Functionals, NodeValues, ZERO};
use super::solver::ElementSolver;
use crate::numeric::{Lanes, Scalar, one_by_one};

/// Number of coefficients whose node values are solved for together: their sums fit the registers
/// and hide each other's latency.
const TOGETHER: usize = 4;

/// Coefficients of one degree: the data that determine their node values.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    /// Initial values of component `c`: `initial[c · stride + m]` for the monomial `m`.
    pub(super) initial: &'a [f64],
    pub(super) stride: usize,
    /// Number of the first monomial of the remainders.
    pub(super) first: usize,
    /// Index in `remainders` at which the remainders of each component begin; `None` if they
    /// vanish.
    pub(super) starts: &'a [Option<usize>],
    pub(super) remainders: &'a [NodeValues],
}

/// Largest magnitudes in the coefficients of one degree.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// Largest functionals of the rates.
    pub(super) rates: Functionals,
    /// Largest coefficients at either end.
    pub(super) largest: Lanes<{ 2 * TOGETHER }>,
}

impl Sizes {
    /// Sizes before any coefficient is included: zeros.
    pub(super) const NONE: Self =
        Self { rates: Lanes([0.0; 8]), largest: Lanes([0.0; 2 * TOGETHER]) };

    #[inline(always)]
    fn include_rates(&mut self, functionals: &[Functionals]) {
        for (k, value) in functionals.iter().enumerate() {
            one_by_one::<Functionals>(k);
            self.rates = self.rates.zip_map(*value, |a, b| larger(a, b.abs()));
        }
    }

    #[inline(always)]
    fn include<const COUNT: usize>(&mut self, coefficients: &[f64; COUNT]) {
        for (largest, value) in self.largest.0.iter_mut().zip(coefficients) {
            *largest = larger(*largest, value.abs());
        }
    }
}

impl<'a> Part<'a> {
    /// Initial values of a component, from monomial `first` on.
    #[inline(always)]
    fn initial<const COUNT: usize>(&self, component: usize, first: usize) -> [f64; COUNT] {
        let mut values = [0.0; COUNT];
        values.copy_from_slice(&self.initial[component * self.stride + first..][..COUNT]);
        values
    }

    #[inline(always)]
    fn remainder<const COUNT: usize>(
        &self,
        component: usize,
        monomial: usize,
    ) -> Option<&'a [NodeValues; COUNT]> {
        let start = self.starts[component]? + monomial - self.first;
        self.remainders.get(start..)?.first_chunk()
    }
}

impl ElementSolver {
    /// Adds to the remainders of a component the contributions of a driven component's remainders.
    #[inline(always)]
    pub(super) fn pass_on(
        &self,
        driven: usize,
        sources: &[NodeValues],
        component: usize,
        targets: &mut [NodeValues],
    ) {
        for state in 0..self.chains.len() {
            let slopes = self.slopes(component, state);
            if self.root(state) != driven || slopes == ZERO {
                continue;
            }
            for (target, source) in targets.iter_mut().zip(sources) {
                if *source != ZERO {
                    *target = slopes.mul_add(self.weight(state).apply(*source), *target);
                }
            }
        }
    }

    /// Node values of a state for a range of monomials.
    #[inline(always)]
    pub(super) fn states(
        &self,
        state: usize,
        part: Part<'_>,
        monomials: Range<usize>,
        out: &mut [NodeValues],
    ) {
        let (len, start) = (monomials.len(), monomials.start);
        let mut done = 0;
        // NOTE: the last monomials are computed again, with those before them, if that makes a
        // whole chunk.
        while done < len {
            if len >= TOGETHER {
                done = done.min(len - TOGETHER);
                if let Some(chunk) = out[done..].first_chunk_mut::<TOGETHER>() {
                    *chunk = self.states_of(state, part, start + done);
                }
                done += TOGETHER;
            } else {
                [out[done]] = self.states_of(state, part, start + done);
                done += 1;
            }
        }
    }

    #[inline(always)]
    fn states_of<const COUNT: usize>(
        &self,
        state: usize,
        part: Part<'_>,
        first: usize,
    ) -> [NodeValues; COUNT] {
        let dimension = self.chains.len();
        let mut sums = [ZERO; COUNT];
        for initial in 0..dimension {
            if let Some(response) = &self.to_initial[state * dimension + initial] {
                let values = part.initial::<COUNT>(initial, first);
                for (sum, &value) in sums.iter_mut().zip(&values) {
                    *sum = response.mul_add(Lanes::splat(value), *sum);
                }
            }
        }
        let (root, weight) = (self.root(state), self.weight(state));
        for source in 0..dimension {
            let block = match &self.to_remainder[state * dimension + source] {
                Some(block) => block,
                None if source == root && self.is_driven(source) => weight,
                None => continue,
            };
            if let Some(values) = part.remainder(source, first) {
                block.add_products(values, &mut sums);
            }
        }
        sums
    }

    /// Writes the coefficients at the end of the element, for some monomials of all states that
    /// integrate the rate of `component` (which is not an integral itself); updates the sizes of
    /// the functionals and of the coefficients.
    ///
    /// NOTE: twice as many monomials together as in `states`, since functionals are half as long as
    /// node values.
    #[inline(always)]
    pub(super) fn advance(
        &self,
        component: usize,
        part: Part<'_>,
        monomials: Range<usize>,
        image: &mut [f64],
        mut sizes: Sizes,
    ) -> Sizes {
        let (len, end) = (monomials.len(), monomials.end);
        let mut first = monomials.start;
        while first < end {
            if end - first > TOGETHER && len >= 2 * TOGETHER {
                first = first.min(end - 2 * TOGETHER);
                self.advance_some::<{ 2 * TOGETHER }>(component, part, first, image, &mut sizes);
                first += 2 * TOGETHER;
            } else if len >= TOGETHER {
                first = first.min(end - TOGETHER);
                self.advance_some::<TOGETHER>(component, part, first, image, &mut sizes);
                first += TOGETHER;
            } else {
                self.advance_some::<1>(component, part, first, image, &mut sizes);
                first += 1;
            }
        }
        sizes
    }

    #[inline(always)]
    fn advance_some<const COUNT: usize>(
        &self,
        component: usize,
        part: Part<'_>,
        first: usize,
        image: &mut [f64],
        sizes: &mut Sizes,
    ) {
        // NOTE: hidden from the compiler, which would otherwise spread the sums over registers in
        // the way their first lanes are used.
        let functionals = black_box(self.functionals_at::<COUNT>(component, part, first));
        sizes.include_rates(&functionals);
        for state in (0..self.chains.len()).filter(|&state| self.root(state) == component) {
            let initial = part.initial::<COUNT>(state, first);
            let end = self.end(state, &functionals, part, first);
            image[state * part.stride + first..][..COUNT].copy_from_slice(&end);
            sizes.include(&initial);
            sizes.include(&end);
        }
    }

    /// Coefficients of a state at the end, from the functionals of its root's rate.
    #[inline(always)]
    fn end<const COUNT: usize>(
        &self,
        state: usize,
        functionals: &[Functionals; COUNT],
        part: Part<'_>,
        first: usize,
    ) -> [f64; COUNT] {
        let mut end = part.initial::<COUNT>(state, first);
        match self.chains[state] {
            None => {
                for k in 0..COUNT {
                    end[k] += self.length * functionals[k].0[0];
                }
            }
            Some(root) => {
                let rates = part.initial::<COUNT>(root, first);
                for k in 0..COUNT {
                    end[k] += self.length * (rates[k] + self.length * functionals[k].0[1]);
                }
            }
        }
        end
    }

    #[inline(always)]
    fn functionals_at<const COUNT: usize>(
        &self,
        component: usize,
        part: Part<'_>,
        first: usize,
    ) -> [Functionals; COUNT] {
        let dimension = self.chains.len();
        let mut sums = [Lanes([0.0; 8]); COUNT];
        for initial in 0..dimension {
            let response = self.functionals_to_initial[component * dimension + initial];
            let values = part.initial::<COUNT>(initial, first);
            for (sum, &value) in sums.iter_mut().zip(&values) {
                *sum = response.mul_add(Lanes::splat(value), *sum);
            }
        }
        for source in 0..dimension {
            let entry = component * dimension + source;
            if let Some(columns) = &self.functionals_to_remainder[entry]
                && let Some(values) = part.remainder::<COUNT>(source, first)
            {
                for (node, column) in columns.iter().enumerate() {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum = column.mul_add(Lanes::splat(value.0[node]), *sum);
                    }
                }
            }
        }
        sums
    }
}

/// The larger of two numbers; the first if the second is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
