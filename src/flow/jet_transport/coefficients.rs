//! The solved equations of an element applied to coefficients, several together.

use std::ops::Range;

use super::gauss::{Functionals, NODES, NodeValues};
use super::solver::ElementSolver;
use crate::numeric::{Lanes, Scalar};

/// Coefficients whose node values are solved for together: their sums fit the registers and hide each other's latency.
const TOGETHER: usize = 4;

const ZERO: NodeValues = Lanes([0.0; NODES]);

/// Coefficients of one degree: what their node values follow from.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    /// Initial values of component `c`: `initial[c · stride + m]` for the monomial `m`.
    pub(super) initial: &'a [f64],
    pub(super) stride: usize,
    /// The first monomial of the remainders.
    pub(super) first: usize,
    /// Where the remainders of every component begin among some values, unless they all vanish.
    pub(super) starts: &'a [Option<usize>],
    pub(super) remainders: &'a [NodeValues],
}

impl<'a> Part<'a> {
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
    /// Adds to the remainders of a component what it owes to those of a driven one.
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

    /// Node values of a state for some monomials.
    #[inline(always)]
    pub(super) fn states(
        &self,
        state: usize,
        part: Part<'_>,
        monomials: Range<usize>,
        out: &mut [NodeValues],
    ) {
        let (chunks, rest) = out.as_chunks_mut::<TOGETHER>();
        let mut first = monomials.start;
        for chunk in chunks {
            *chunk = self.states_of(state, part, first);
            first += TOGETHER;
        }
        for value in rest {
            [*value] = self.states_of(state, part, first);
            first += 1;
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
                let values = &part.initial[initial * part.stride + first..][..COUNT];
                for (sum, &value) in sums.iter_mut().zip(values) {
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

    /// Functionals of the rates of a component that is no integral, for some monomials: of twice as many together, for they are
    /// half as long as node values.
    #[inline(always)]
    pub(super) fn functionals(
        &self,
        component: usize,
        part: Part<'_>,
        monomials: Range<usize>,
        out: &mut [Functionals],
    ) {
        let mut first = monomials.start;
        let (pairs, rest) = out.as_chunks_mut::<{ 2 * TOGETHER }>();
        for chunk in pairs {
            *chunk = self.functionals_at(component, part, first);
            first += chunk.len();
        }
        let (chunks, rest) = rest.as_chunks_mut::<TOGETHER>();
        for chunk in chunks {
            *chunk = self.functionals_at(component, part, first);
            first += chunk.len();
        }
        for value in rest {
            [*value] = self.functionals_at(component, part, first);
            first += 1;
        }
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
            let values = &part.initial[initial * part.stride + first..][..COUNT];
            for (sum, &value) in sums.iter_mut().zip(values) {
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

    /// The state at the end of the element less its value at the start, from functionals of the rate of its root.
    #[inline(always)]
    pub(super) fn advance(
        &self,
        state: usize,
        functionals: Functionals,
        initial: impl Fn(usize) -> f64,
    ) -> f64 {
        match self.chains[state] {
            None => self.length * functionals.0[0],
            Some(root) => self.length * (initial(root) + self.length * functionals.0[1]),
        }
    }
}
