//! Jets at the nodes of an element, monomials that vanish whatever the orbit left out.
//!
//! One idea: a slot depends on some of the jets' variables only (a forcing on its phase, frequency
//! and amplitude), up to some degree (a driven phase up to the first), and all other monomials are
//! zero.

use std::ops::Range;

use super::gauss::NodeValues;
use super::pairs::Pairs;
use super::subject::Inputs;
use crate::flow::Program;
use crate::jet::{Graded, HeadFunction, JetSpace, PartOf, Selection, Span, VariableSet};
use crate::numeric::Lanes;

/// The monomials in which an element can differ from zero: those of some variables, up to a degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) variables: VariableSet,
    pub(super) degree: usize,
}

impl Reach {
    /// The monomials of both.
    fn or(self, other: Self) -> Self {
        Self { variables: self.variables | other.variables, degree: self.degree.max(other.degree) }
    }
}

/// What each slot can reach at any time, from what the inputs do at the start.
pub(super) fn reach_of_slots(
    program: &Program,
    inputs: &Inputs,
    dimension: usize,
    order: usize,
) -> Vec<Reach> {
    let nothing = Reach { variables: 0, degree: 0 };
    let mut reach: Vec<_> = (0..program.inputs()).map(|i| inputs.reach(i)).collect();
    reach.resize(program.slots(), nothing);
    loop {
        for slot in program.inputs()..program.slots() {
            let read = program.operands(slot).map(|operand| reach[operand]);
            let degree = program.operation(slot).highest_degree(order, |slot| reach[slot].degree);
            reach[slot] = Reach { degree, ..read.fold(reach[slot], Reach::or) };
        }
        let mut grown = false;
        for state in 0..dimension {
            let grows_to = reach[state].or(reach[program.output(state)]);
            grown |= grows_to != reach[state];
            reach[state] = grows_to;
        }
        if !grown {
            return reach;
        }
    }
}

/// A space of jets as a set of variables sees it: of every degree the least range of monomials that
/// holds all of these variables, whole runs.
#[derive(Clone, Debug)]
pub(super) struct Support {
    variables: VariableSet,
    /// Whether every monomial of the space is one of these variables.
    is_whole: bool,
    /// The monomials of every degree, and the numbers of their runs.
    parts: Vec<Range<usize>>,
    runs: Vec<Range<usize>>,
}

impl Support {
    pub(super) fn new(space: &JetSpace, monomials: &[VariableSet], variables: VariableSet) -> Self {
        let selection = Selection { monomials, variables };
        let runs = |degree: usize| {
            let all = space.runs(degree);
            let mut reached = all.clone().filter(|&run| selection.reaches(&space.run(run)));
            let first = reached.next();
            first.map_or(all.start..all.start, |first| first..reached.last().unwrap_or(first) + 1)
        };
        let runs: Vec<_> = (0..=space.order()).map(runs).collect();
        let part = |(degree, runs): (usize, &Range<usize>)| {
            let start = space.degree_range(degree).start;
            match runs.clone().next_back() {
                Some(last) => space.run(runs.start).start..space.run(last).end,
                None => start..start,
            }
        };
        Self {
            variables,
            is_whole: monomials.iter().all(|set| set & !variables == 0),
            parts: runs.iter().enumerate().map(part).collect(),
            runs,
        }
    }

    /// The monomials of a degree.
    #[inline(always)]
    pub(super) fn part(&self, degree: usize) -> Range<usize> {
        self.parts[degree].clone()
    }
}

/// A space of jets seen by one slot: products are formed for monomials of its variables only, and
/// neighbours of these.
#[derive(Clone, Copy)]
pub(super) struct SparseSpace<'s> {
    pub(super) space: &'s JetSpace,
    pub(super) monomials: &'s [VariableSet],
    pub(super) support: &'s Support,
    /// The pairs of the product that is formed, if they are few.
    pub(super) pairs: Option<&'s Pairs>,
}

impl SparseSpace<'_> {
    /// The part of a degree, its runs without a monomial of the variables left out.
    #[inline(always)]
    fn part_of<'o>(&'o self, degree: usize, out: &'o mut [NodeValues]) -> PartOf<'o, NodeValues> {
        let selection = Selection { monomials: self.monomials, variables: self.support.variables };
        PartOf {
            runs: self.support.runs[degree].clone(),
            out,
            selection: (!self.support.is_whole).then_some(selection),
        }
    }
}

impl Graded<NodeValues> for SparseSpace<'_> {
    fn order(&self) -> usize {
        self.space.order()
    }

    fn element_len(&self) -> usize {
        self.space.len()
    }

    #[inline(always)]
    fn part(&self, degree: usize) -> Range<usize> {
        self.support.part(degree)
    }

    #[inline(always)]
    fn convolve(
        &self,
        degree: usize,
        span: Span,
        a: &[NodeValues],
        b: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        if let Some(pairs) = self.pairs {
            for (place, value) in out.iter_mut().enumerate() {
                *value += pairs.sum(place, a, b);
            }
            return;
        }
        self.space.convolve_part(self.part_of(degree, out), span, (a, b));
    }

    #[inline(always)]
    fn scaled_convolution(
        &self,
        degree: usize,
        span: Span,
        (a, b): (&[NodeValues], &[NodeValues]),
        factor: NodeValues,
        out: &mut [NodeValues],
    ) {
        if let Some(pairs) = self.pairs {
            for (place, value) in out.iter_mut().enumerate() {
                *value = pairs.sum(place, a, b) * factor;
            }
            return;
        }
        self.space.scaled_part(self.part_of(degree, out), span, (a, b), factor);
    }

    #[inline(always)]
    fn quotient_part(
        &self,
        degree: usize,
        (a, b): (&[NodeValues], &[NodeValues]),
        u: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        if let Some(pairs) = self.pairs {
            let inverse = Lanes::splat(1.0) / b[0];
            let numerators = &a[self.part(degree)];
            for (place, (value, &numerator)) in out.iter_mut().zip(numerators).enumerate() {
                *value = (numerator - pairs.sum(place, b, u)) * inverse;
            }
            return;
        }
        self.space.quotient_part_of(self.part_of(degree, out), (a, b), u);
    }

    #[inline(always)]
    fn multiply_by_head(
        &self,
        degree: usize,
        a: &[NodeValues],
        part: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        self.space.multiply_by_head(degree, a, part, out);
    }

    #[inline(always)]
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
