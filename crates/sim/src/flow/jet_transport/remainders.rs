//! Slots of a field over jets whose coefficients are node values: their parts of one degree with
//! the state's own part left out (remainders), and the contributions of the state's part.

use std::rc::Rc;
use std::sync::Arc;

use super::gauss::{NodeValues, ZERO};
use super::plan::{Action, CacheKey, Plan, Reach};
use super::sparse::{MonomialSupport, Pairs, SparseSpace, pairs_of_actions, reach_of_slots};
use crate::flow::program::run;
use crate::jet::{JetSpace, VariableSet, variables_of_monomials};
use crate::numeric::{Lanes, Scalar, Vectorised, one_by_one, widest};

/// The stored slots of a program, the states first.
pub(super) struct Remainders {
    plan: Plan,
    /// For every action in each degree the pairs of its product, if they are few.
    pairs: Vec<Vec<Option<Pairs>>>,
    space: Arc<JetSpace>,
    dimension: usize,
    monomials: Vec<VariableSet>,
    /// Supports (sets of monomials) of each place.
    supports: Vec<Rc<MonomialSupport>>,
    /// Whether each place holds an Euler derivative.
    is_euler: Vec<bool>,
    /// By degree: index at which the remainder of each component begins in the places after the
    /// states; `None` if it vanishes.
    starts: Vec<Vec<Option<usize>>>,
    tape: Vec<NodeValues>,
    scratch: Vec<NodeValues>,
}

/// View of the tape in one degree.
pub(super) struct DegreeOfTape<'a> {
    /// Elements of the states, and elements of all other places.
    pub(super) states: &'a mut [NodeValues],
    pub(super) others: &'a [NodeValues],
    /// Index at which the remainder of each component begins in `others`; `None` if it vanishes.
    pub(super) starts: &'a [Option<usize>],
    /// Supports of the states.
    pub(super) supports: &'a [Rc<MonomialSupport>],
}

impl Remainders {
    /// Remainders for a key, in the memory of another tape.
    pub(super) fn new(key: &CacheKey, mut tape: Vec<NodeValues>) -> Self {
        let CacheKey { program, dimension, space, inputs } = key;
        let (monomials, dimension) = (variables_of_monomials(space), *dimension);
        let reach = reach_of_slots(program, inputs, dimension, space.order());
        let supports = supports(space, &monomials, &reach);
        let reaches = |slot: usize, degree: usize| match slot {
            _ if slot < dimension || slot >= program.inputs() => {
                !supports[slot].part(degree).is_empty()
            }
            parameter => inputs.has_part(parameter, degree),
        };
        let plan = Plan::new(program, dimension, space.order(), reaches);
        let start = |degree: usize, place: usize| {
            (place - dimension) * space.len() + space.degree_range(degree).start
        };
        let starts = plan.remainders.iter().enumerate().map(|(degree, places)| {
            let starts = places.iter().map(|place| Some(start(degree, (*place)?)));
            starts.collect()
        });
        let pairs = pairs_of_actions(&plan, space, &monomials, &reach, &supports);
        let stored = plan.stored.iter();
        tape.resize(plan.stored.len() * space.len(), ZERO);
        let mut remainders = Self {
            supports: stored.clone().map(|&slot| Rc::clone(&supports[slot])).collect(),
            is_euler: stored.map(|&slot| program.is_euler(slot)).collect(),
            starts: starts.collect(),
            tape,
            pairs,
            plan,
            dimension,
            monomials,
            scratch: vec![ZERO; space.len()],
            space: Arc::clone(space),
        };
        remainders.clear_beyond_supports();
        remainders
    }

    /// Memory of the tape, for reuse.
    pub(super) fn into_tape(self) -> Vec<NodeValues> {
        self.tape
    }

    /// Number of values on the tape.
    pub(super) fn tape_len(&self) -> usize {
        self.tape.len()
    }

    /// Sets to zero the coefficients that no action writes but a recurrence of a slot with more
    /// variables reads.
    fn clear_beyond_supports(&mut self) {
        let elements = self.tape.chunks_exact_mut(self.space.len());
        for (element, support) in elements.zip(&self.supports) {
            for degree in 0..=self.space.order() {
                let (all, part) = (self.space.degree_range(degree), support.part(degree));
                element[all.start..part.start].fill(ZERO);
                element[part.end..all.end].fill(ZERO);
            }
        }
    }

    /// Sets the parameters from their coefficients.
    pub(super) fn set_parameters(&mut self, parameters: &[&[f64]]) {
        let (dimension, len) = (self.dimension, self.space.len());
        let elements = self.tape.chunks_exact_mut(len).zip(&self.supports);
        for ((element, support), coefficients) in elements.skip(dimension).zip(parameters) {
            for part in (0..=self.space.order()).map(|degree| support.part(degree)) {
                let values = element[part.clone()].iter_mut();
                for (values, &coefficient) in values.zip(&coefficients[part]) {
                    *values = Lanes::splat(coefficient);
                }
            }
        }
    }

    /// Number of stored slots.
    pub(super) fn places(&self) -> usize {
        self.plan.stored.len()
    }

    /// Slot that a place stores.
    pub(super) fn slot(&self, place: usize) -> usize {
        self.plan.stored[place]
    }

    /// Whether a recurrence reads lower parts of a place.
    pub(super) fn is_read_again(&self, place: usize) -> bool {
        self.plan.history[place]
    }

    /// Sets the head of a place.
    #[inline(always)]
    pub(super) fn set_head(&mut self, place: usize, head: NodeValues) {
        self.tape[place * self.space.len()] = head;
    }

    /// The tape in one degree.
    #[inline(always)]
    pub(super) fn degree(&mut self, degree: usize) -> DegreeOfTape<'_> {
        let (states, others) = self.tape.split_at_mut(self.dimension * self.space.len());
        DegreeOfTape {
            states,
            others,
            starts: &self.starts[degree],
            supports: &self.supports[..self.dimension],
        }
    }

    /// Remainder of a component in one degree; `None` if it vanishes.
    #[inline(always)]
    pub(super) fn remainder(&self, component: usize, degree: usize) -> Option<&[NodeValues]> {
        let start = self.starts[degree][component]? + self.dimension * self.space.len();
        Some(&self.tape[start..][..self.space.degree_range(degree).len()])
    }

    /// Computes the parts of one degree of all stored slots, with the parts of the states set to
    /// zero.
    ///
    /// Parts of lower degree that recurrences read must be complete.
    ///
    /// NOTE: never inlined: the recurrences are long, and the time of their compilation grows
    /// faster than their length.
    #[inline(never)]
    pub(super) fn compute(&mut self, degree: usize) {
        widest(PartsOfDegree { remainders: self, degree });
    }

    /// Adds to a place its slope times a state's part of a degree.
    #[inline(always)]
    pub(super) fn add_share(
        &mut self,
        degree: usize,
        place: usize,
        slope: NodeValues,
        state: usize,
    ) {
        let (len, part) = (self.space.len(), self.supports[state].part(degree));
        let factor = if self.is_euler[place] { degree as f64 } else { 1.0 };
        let slope = slope * Lanes::splat(factor);
        let (states, others) = self.tape.split_at_mut(self.dimension * len);
        let state = &states[state * len..][part.clone()];
        let place = &mut others[(place - self.dimension) * len..][part];
        for (index, (value, &state)) in place.iter_mut().zip(state).enumerate() {
            one_by_one::<NodeValues>(index);
            *value = slope.mul_add(state, *value);
        }
    }
}

/// Vectorised work for the parts of one degree of all stored slots.
struct PartsOfDegree<'r> {
    remainders: &'r mut Remainders,
    degree: usize,
}

impl Vectorised for PartsOfDegree<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let degree = self.degree;
        let Remainders { plan, pairs, space, monomials, supports, tape, scratch, .. } =
            self.remainders;
        let len = space.len();
        for (action, pairs) in plan.actions[degree].iter().zip(&pairs[degree]) {
            match action {
                Action::Run { operation, place, reads_before } => {
                    let support = &supports[*place];
                    let algebra = SparseSpace { space, monomials, support, pairs: pairs.as_ref() };
                    let part = support.part(degree);
                    let start = place * len + part.start;
                    let (read, out) = if *reads_before {
                        let (before, rest) = tape.split_at_mut(start);
                        (&*before, &mut rest[..part.len()])
                    } else {
                        (&tape[..], &mut scratch[..part.len()])
                    };
                    run(operation, *place, &algebra, degree, len, read, out);
                    if !reads_before {
                        tape[start..start + part.len()].copy_from_slice(&scratch[..part.len()]);
                    }
                }
                Action::Copy { from, place } => {
                    let part = supports[*place].part(degree);
                    let source = from * len + part.start..from * len + part.end;
                    tape.copy_within(source, place * len + part.start);
                }
                Action::Clear { place } => {
                    let part = supports[*place].part(degree);
                    tape[place * len..][part].fill(ZERO);
                }
            }
        }
    }
}

/// Supports of all slots; slots with the same variables share one.
fn supports(
    space: &JetSpace,
    monomials: &[VariableSet],
    reach: &[Reach],
) -> Vec<Rc<MonomialSupport>> {
    let mut known: Vec<(VariableSet, Rc<MonomialSupport>)> = Vec::new();
    let mut support = |&Reach { variables, .. }: &Reach| {
        if let Some((_, support)) = known.iter().find(|(set, _)| *set == variables) {
            return Rc::clone(support);
        }
        let support = Rc::new(MonomialSupport::new(space, monomials, variables));
        known.push((variables, Rc::clone(&support)));
        support
    };
    reach.iter().map(&mut support).collect()
}
