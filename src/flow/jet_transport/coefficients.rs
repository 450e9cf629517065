//! The solved equations of an element applied to coefficients, several together.

use std::hint::black_box;
use std::ops::Range;

use super::gauss::{Functionals, NODES, NodeValues};
use super::solver::ElementSolver;
use crate::numeric::{Lanes, Scalar, one_by_one};

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

/// Sizes of the coefficients of one degree.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// Largest functionals of a rate.
    pub(super) rates: Functionals,
    /// Largest coefficients at either end.
    pub(super) largest: Lanes<{ 2 * TOGETHER }>,
}

impl Sizes {
    /// Those of no coefficients.
    pub(super) const NONE: Self = Self {
        rates: Lanes([0.0; 8]),
        largest: Lanes([0.0; 2 * TOGETHER]),
    };
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

    /// Moves the coefficients of some monomials of all states whose rate is that of a component, itself no integral, to the
    /// end; the changes' modes and the largest coefficients.
    ///
    /// NOTE: of twice as many together as states, for functionals are half as long as node values.
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
        // NOTE: the last ones are done again with those before them where that makes a whole chunk.
        while first < end {
            let left = end - first;
            if left > TOGETHER && len >= 2 * TOGETHER {
                let start = first.min(end - 2 * TOGETHER);
                self.advance_some::<{ 2 * TOGETHER }>(component, part, start, image, &mut sizes);
                first = start + 2 * TOGETHER;
            } else if len >= TOGETHER {
                let start = first.min(end - TOGETHER);
                self.advance_some::<TOGETHER>(component, part, start, image, &mut sizes);
                first = start + TOGETHER;
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
        // NOTE: kept from the compiler, which would spread the sums over registers the way their first lanes are used.
        let functionals = black_box(self.functionals_at::<COUNT>(component, part, first));
        for (k, value) in functionals.iter().enumerate() {
            one_by_one::<Functionals>(k);
            sizes.rates = sizes.rates.zip_map(*value, |a, b| larger(a, b.abs()));
        }
        let start = |state: usize| state * part.stride + first;
        for state in 0..self.chains.len() {
            let (Some(initial), Some(image)) = (
                part.initial[start(state)..].first_chunk::<COUNT>(),
                image[start(state)..].first_chunk_mut::<COUNT>(),
            ) else {
                return;
            };
            if state == component {
                for k in 0..COUNT {
                    image[k] = initial[k] + self.length * functionals[k].0[0];
                }
            } else if self.chains[state] == Some(component)
                && let Some(rates) = part.initial[start(component)..].first_chunk::<COUNT>()
            {
                for k in 0..COUNT {
                    let rate = rates[k] + self.length * functionals[k].0[1];
                    image[k] = initial[k] + self.length * rate;
                }
            } else {
                continue;
            }
            for (k, largest) in sizes.largest.0.iter_mut().enumerate().take(COUNT) {
                *largest = larger(larger(*largest, initial[k].abs()), image[k].abs());
            }
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
}

/// The larger of two numbers, the first if the second is not a number.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
