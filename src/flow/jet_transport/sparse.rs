//! Jets at the nodes of an element, monomials that vanish whatever the orbit left out.
//!
//! One idea: a slot depends on some of the jets' variables only (a forcing on its phase, frequency and
//! amplitude), and monomials with other variables are zero.

use std::ops::Range;

use super::gauss::NodeValues;
use crate::flow::Program;
use crate::jet::{Graded, HeadFunction, JetSpace, Span};
use crate::numeric::Scalar;

/// Set of variables of a jet: bit `min(i, 63)` for variable `i`.
pub(super) type VariableSet = u64;

/// Variables of every monomial of a space.
pub(super) fn variables_of_monomials(space: &JetSpace) -> Vec<VariableSet> {
    let bit = |(variable, &exponent): (usize, &u8)| u64::from(exponent > 0) << variable.min(63);
    let set = |monomial: usize| {
        space
            .exponents(monomial)
            .iter()
            .enumerate()
            .map(bit)
            .fold(0, |a, b| a | b)
    };
    (0..space.len()).map(set).collect()
}

/// Variables on which each slot can depend at any time, from those of the inputs at the start.
pub(super) fn variables_of_slots(
    program: &Program,
    inputs: &[VariableSet],
    dimension: usize,
) -> Vec<VariableSet> {
    let mut sets = vec![0; program.slots()];
    sets[..inputs.len()].copy_from_slice(inputs);
    loop {
        for slot in program.inputs()..program.slots() {
            sets[slot] = program
                .operands(slot)
                .fold(sets[slot], |set, operand| set | sets[operand]);
        }
        let mut grown = false;
        for state in 0..dimension {
            let set = sets[state] | sets[program.output(state)];
            grown |= set != sets[state];
            sets[state] = set;
        }
        if !grown {
            return sets;
        }
    }
}

/// A space of jets seen by one slot: products are formed for the monomials of its variables only.
#[derive(Clone, Copy)]
pub(super) struct SparseSpace<'s> {
    pub(super) space: &'s JetSpace,
    pub(super) monomials: &'s [VariableSet],
    pub(super) variables: VariableSet,
}

impl Graded<NodeValues> for SparseSpace<'_> {
    fn order(&self) -> usize {
        self.space.order()
    }

    fn element_len(&self) -> usize {
        self.space.len()
    }

    fn part(&self, degree: usize) -> Range<usize> {
        self.space.degree_range(degree)
    }

    #[inline]
    fn convolve(
        &self,
        degree: usize,
        span: Span,
        a: &[NodeValues],
        b: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        let square = std::ptr::eq(a, b) && matches!(span, Span::Full | Span::Interior);
        for (monomial, value) in self.space.degree_range(degree).zip(out) {
            if self.monomials[monomial] & !self.variables != 0 {
                continue;
            }
            let pairs = self.space.pairs(monomial);
            let pairs = &pairs[span.range(pairs.len())];
            *value = if square {
                square_of(pairs, a, *value)
            } else {
                product_of(pairs, a, b, *value)
            };
        }
    }

    fn multiply_by_head(
        &self,
        degree: usize,
        a: &[NodeValues],
        part: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        self.space.multiply_by_head(degree, a, part, out);
    }

    fn divide_by_head(&self, b: &[NodeValues], part: &mut [NodeValues]) {
        self.space.divide_by_head(b, part);
    }

    fn head(&self, function: HeadFunction, a: &[NodeValues], out: &mut [NodeValues]) {
        self.space.head(function, a, out);
    }

    fn head_power(&self, a: &[NodeValues], exponent: NodeValues, out: &mut [NodeValues]) {
        self.space.head_power(a, exponent, out);
    }

    fn head_atan2(&self, y: &[NodeValues], x: &[NodeValues], out: &mut [NodeValues]) {
        self.space.head_atan2(y, x, out);
    }
}

#[inline(always)]
fn product_of(
    pairs: &[(u32, u32)],
    a: &[NodeValues],
    b: &[NodeValues],
    sum: NodeValues,
) -> NodeValues {
    pairs.iter().fold(sum, |sum, &(i, j)| {
        a[i as usize].mul_add(b[j as usize], sum)
    })
}

/// The same for `a = b`: pairs `(i, j)` and `(j, i)` at once, the list being its own mirror image.
#[inline(always)]
fn square_of(pairs: &[(u32, u32)], a: &[NodeValues], sum: NodeValues) -> NodeValues {
    let half = product_of(&pairs[..pairs.len() / 2], a, a, NodeValues::splat(0.0));
    let middle = &pairs[pairs.len() / 2..pairs.len().div_ceil(2)];
    product_of(middle, a, a, sum) + (half + half)
}
