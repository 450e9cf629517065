//! Jets at the nodes of an element, without the monomials that are zero for every orbit.
//!
//! One idea: a slot depends on some of the jets' variables only (a forcing on its phase, frequency
//! and amplitude), up to some degree (a driven phase up to the first), and all other monomials are
//! zero.
//!
//! Products of few coefficients are formed pair by pair: if a factor has two or three coefficients,
//! or the degree is low, finding the runs of a product costs more than the product; its pairs of
//! coefficients are listed once.

use std::ops::Range;
use std::rc::Rc;

use super::gauss::{NodeValues, ZERO};
use super::plan::{Action, Inputs, Plan, Reach};
use crate::flow::Program;
use crate::jet::{Graded, HeadFunction, JetSpace, PartOf, Selection, Span, VariableSet};
use crate::numeric::{Lanes, Scalar};

/// Reach of each slot at any time, from the reach of the inputs at the start.
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

/// Support of a set of variables in a space of jets: for every degree the least range of monomials
/// with all monomials of these variables, as whole runs.
#[derive(Clone, Debug)]
pub(super) struct MonomialSupport {
    variables: VariableSet,
    /// Whether every monomial of the space has only these variables.
    is_whole: bool,
    /// Ranges of monomials by degree, and ranges of the numbers of their runs.
    parts: Vec<Range<usize>>,
    runs: Vec<Range<usize>>,
}

impl MonomialSupport {
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

    /// Range of the monomials of a degree.
    #[inline(always)]
    pub(super) fn part(&self, degree: usize) -> Range<usize> {
        self.parts[degree].clone()
    }
}

/// A space of jets restricted to one slot: products are formed only for monomials of its variables
/// and for neighbours of these.
#[derive(Clone, Copy)]
pub(super) struct SparseSpace<'s> {
    pub(super) space: &'s JetSpace,
    pub(super) monomials: &'s [VariableSet],
    pub(super) support: &'s MonomialSupport,
    /// Pairs of the current product, if they are few.
    pub(super) pairs: Option<&'s Pairs>,
}

impl SparseSpace<'_> {
    /// Part of a degree without the runs that have no monomial of the variables.
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

/// Highest degree in which pairs are listed for a factor that may be nonzero in all monomials.
const LOW: usize = 2;

/// Pairs of monomials whose products are summed, for each monomial of a part.
pub(super) struct Pairs {
    /// End of the pairs of each monomial.
    ends: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

/// For every action of a plan in each degree, the pairs of its product, if it has few.
pub(super) fn pairs_of_actions(
    plan: &Plan,
    space: &JetSpace,
    monomials: &[VariableSet],
    reach: &[Reach],
    supports: &[Rc<MonomialSupport>],
) -> Vec<Vec<Option<Pairs>>> {
    let pairs = |degree: usize, action: &Action| {
        let Action::Run { operation, place, .. } = action else {
            return None;
        };
        let (left, right, span) = operation.product(*place)?;
        let [left, right, slot] = [left, right, *place].map(|place| plan.stored[place]);
        let factors = Factors { space, monomials, span, left: reach[left], right: reach[right] };
        factors.pairs(degree, supports[slot].part(degree))
    };
    let actions = plan.actions.iter().enumerate();
    actions
        .map(|(degree, actions)| actions.iter().map(|action| pairs(degree, action)).collect())
        .collect()
}

/// A product of two slots: its terms, and the monomials in which its factors can differ from zero.
struct Factors<'a> {
    space: &'a JetSpace,
    /// Variables of every monomial.
    monomials: &'a [VariableSet],
    span: Span,
    left: Reach,
    right: Reach,
}

impl Factors<'_> {
    /// Pairs of the monomials of a part of a degree, if they are few.
    fn pairs(&self, degree: usize, part: Range<usize>) -> Option<Pairs> {
        let is_left_short = self.left.degree <= self.right.degree;
        let short = if is_left_short { self.left } else { self.right };
        if short.degree > 1 && degree > LOW {
            return None;
        }
        let low = 0..self.space.degree_range(short.degree.min(degree)).end;
        let few: Vec<_> = low.filter(|&m| self.reaches(short, m)).collect();
        let mut pairs = Pairs {
            ends: Vec::with_capacity(part.len()),
            pairs: Vec::with_capacity(few.len() * part.len()),
        };
        let mut exponents = Vec::with_capacity(self.space.variables());
        for product in part {
            for &one in &few {
                let Some(other) = self.cofactor(product, one, &mut exponents) else {
                    continue;
                };
                let pair = if is_left_short { (one, other) } else { (other, one) };
                if self.has(pair) {
                    pairs.pairs.push((pair.0 as u32, pair.1 as u32));
                }
            }
            pairs.ends.push(pairs.pairs.len() as u32);
        }
        Some(pairs)
    }

    /// Monomial whose product with `factor` is `product`; `exponents` is scratch memory.
    fn cofactor(&self, product: usize, factor: usize, exponents: &mut Vec<u8>) -> Option<usize> {
        if self.monomials[factor] & !self.monomials[product] != 0 {
            return None;
        }
        exponents.clear();
        let both = self.space.exponents(product).iter().zip(self.space.exponents(factor));
        for (product, factor) in both {
            exponents.push(product.checked_sub(*factor)?);
        }
        self.space.monomial(exponents)
    }

    /// Whether a pair is one of the terms and both its coefficients can differ from zero.
    fn has(&self, (left, right): (usize, usize)) -> bool {
        let is_left_out = match self.span {
            Span::Full => false,
            Span::WithoutFirst => left == 0,
            Span::WithoutLast => right == 0,
            Span::Interior => left == 0 || right == 0,
        };
        !is_left_out && self.reaches(self.left, left) && self.reaches(self.right, right)
    }

    fn reaches(&self, reach: Reach, monomial: usize) -> bool {
        self.monomials[monomial] & !reach.variables == 0
            && self.space.degree(monomial) <= reach.degree
    }
}

impl Pairs {
    /// Sum of the products of a monomial, given by its place in the part.
    #[inline(always)]
    pub(super) fn sum(&self, place: usize, a: &[NodeValues], b: &[NodeValues]) -> NodeValues {
        let start = place.checked_sub(1).map_or(0, |before| self.ends[before]);
        let mut sum = ZERO;
        for &(i, j) in &self.pairs[start as usize..self.ends[place] as usize] {
            sum = a[i as usize].mul_add(b[j as usize], sum);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::variables_of_monomials;

    /// Pairs of a degree from the table of the space, without the pairs that a reach or the span
    /// excludes.
    fn of_table(factors: &Factors<'_>, degree: usize) -> Vec<Vec<(usize, usize)>> {
        let space = factors.space;
        let reaches = |reach: Reach, monomial: usize| {
            let exponents = space.exponents(monomial);
            let is_one = |variable: usize| reach.variables >> variable & 1 == 1;
            let degree: usize = exponents.iter().map(|&e| usize::from(e)).sum();
            degree <= reach.degree
                && (0..exponents.len()).all(|variable| exponents[variable] == 0 || is_one(variable))
        };
        let counts = |&(i, j): &(usize, usize)| {
            let is_first = i == 0 && factors.span == Span::WithoutFirst;
            !is_first && reaches(factors.left, i) && reaches(factors.right, j)
        };
        let sorted = |monomial: usize| {
            let mut pairs: Vec<_> = space.pairs(monomial).into_iter().filter(counts).collect();
            pairs.sort_unstable();
            pairs
        };
        space.degree_range(degree).map(sorted).collect()
    }

    #[test]
    fn listed_pairs_are_those_of_the_table_whose_factors_can_differ_from_zero() {
        let space = JetSpace::uniform(3, 4).unwrap();
        let monomials = variables_of_monomials(&space);
        let reach = |variables, degree| Reach { variables, degree };
        for (left, right, span, degree) in [
            (reach(0b001, 1), reach(0b110, 4), Span::Full, 3),
            (reach(0b111, 4), reach(0b011, 1), Span::WithoutFirst, 4),
            (reach(0b111, 4), reach(0b111, 4), Span::WithoutFirst, 2),
        ] {
            let factors = Factors { space: &space, monomials: &monomials, span, left, right };
            let pairs = factors.pairs(degree, space.degree_range(degree)).unwrap();
            let mut start = 0;
            for (&end, expected) in pairs.ends.iter().zip(of_table(&factors, degree)) {
                let listed = pairs.pairs[start..end as usize].iter();
                let mut listed: Vec<_> = listed.map(|&(i, j)| (i as usize, j as usize)).collect();
                listed.sort_unstable();
                assert_eq!(listed, expected);
                start = end as usize;
            }
            assert_eq!(pairs.ends.len(), space.degree_range(degree).len());
        }
    }

    #[test]
    fn products_of_many_pairs_are_not_listed() {
        let space = JetSpace::uniform(3, 4).unwrap();
        let whole = Reach { variables: 0b111, degree: 4 };
        let factors = Factors {
            space: &space,
            monomials: &variables_of_monomials(&space),
            span: Span::Full,
            left: whole,
            right: whole,
        };
        assert!(factors.pairs(3, space.degree_range(3)).is_none());
    }
}
