//! What the field gives in one degree where the state's own part is left out.
//!
//! One idea: sums and multiples of what vanishes vanish, and a sum with it is the other term, so that most linear
//! operations need not be run: a slot's part is zero, that of another slot, or its own.

use std::sync::Arc;

use super::gauss::{NODES, NodeValues};
use super::sparse::{
    SparseSpace, Support, VariableSet, variables_of_monomials, variables_of_slots,
};
use crate::flow::Program;
use crate::flow::program::{Operation, run};
use crate::jet::JetSpace;
use crate::numeric::{Lanes, Scalar};

const ZERO: NodeValues = Lanes([0.0; NODES]);

/// The slots of a program over jets whose coefficients are node values.
pub(super) struct Remainders<'a> {
    program: &'a Program,
    space: Arc<JetSpace>,
    dimension: usize,
    monomials: Vec<VariableSet>,
    supports: Vec<Support>,
    /// Whether a recurrence reads lower parts of a slot.
    pub(super) history: Vec<bool>,
    /// Where each slot's part of the degree at hand is; `None` if it vanishes.
    sources: Vec<Option<usize>>,
    scratch: Vec<NodeValues>,
}

impl<'a> Remainders<'a> {
    /// For a field's program, its inputs given as coefficients at the start.
    pub(super) fn new(
        program: &'a Program,
        space: &Arc<JetSpace>,
        inputs: &[&[f64]],
        dimension: usize,
    ) -> Self {
        let monomials = variables_of_monomials(space);
        let set = |coefficients: &&[f64]| {
            let terms = coefficients.iter().zip(&monomials);
            let present = terms.filter(|(value, _)| **value != 0.0);
            present.fold(0, |set, (_, monomial)| set | monomial)
        };
        let inputs: Vec<_> = inputs.iter().map(set).collect();
        let variables = variables_of_slots(program, &inputs, dimension);
        let mut history = vec![false; program.slots()];
        for slot in program.inputs()..program.slots() {
            for read in program.operation(slot).history(slot) {
                history[read] = true;
            }
        }
        let supports = variables
            .iter()
            .map(|&variables| Support::new(space, &monomials, variables));
        Self {
            program,
            dimension,
            supports: supports.collect(),
            monomials,
            history,
            sources: vec![None; program.slots()],
            scratch: vec![ZERO; space.len()],
            space: Arc::clone(space),
        }
    }

    /// The monomials of a degree on which a slot can depend.
    #[inline(always)]
    pub(super) fn support(&self, slot: usize) -> &Support {
        &self.supports[slot]
    }

    /// The slot that holds the remainder of a slot; `None` if it vanishes.
    #[inline(always)]
    pub(super) fn source(&self, slot: usize) -> Option<usize> {
        self.sources[slot]
    }

    /// Computes the parts of one degree of all slots, those of the states being zero.
    ///
    /// Parts of lower degree of all slots in [`history`](Self::history) must be complete.
    #[inline(always)]
    pub(super) fn compute(&mut self, degree: usize, tape: &mut [NodeValues]) {
        let (program, len) = (self.program, self.space.len());
        for input in 0..program.inputs() {
            let part = self.supports[input].part(degree);
            let values = &mut tape[input * len + part.start..input * len + part.end];
            if input < self.dimension {
                values.fill(ZERO);
                continue;
            }
            let vanishes = values.iter().all(|value| *value == ZERO);
            self.sources[input] = (!vanishes).then_some(input);
        }
        for slot in program.inputs()..program.slots() {
            if self.supports[slot].part(degree).is_empty() {
                self.sources[slot] = None;
                continue;
            }
            let source = self.compute_slot(slot, degree, tape);
            self.sources[slot] = source;
            if self.history[slot] && source != Some(slot) {
                self.copy(source, slot, degree, tape);
            }
        }
    }

    /// One slot: runs its operation if it must, and says where its part is.
    #[inline(always)]
    fn compute_slot(
        &mut self,
        slot: usize,
        degree: usize,
        tape: &mut [NodeValues],
    ) -> Option<usize> {
        let operation = self.program.operation(slot);
        let operands = match *operation {
            Operation::Constant(_) | Operation::Sign(_) => return None,
            Operation::Add(a, b) => match (self.sources[a], self.sources[b]) {
                (None, source) | (source, None) => return source,
                (Some(a), Some(b)) => Operation::Add(a, b),
            },
            Operation::Sub(a, b) => match (self.sources[a], self.sources[b]) {
                (source, None) => return source,
                (None, Some(b)) => Operation::Neg(b),
                (Some(a), Some(b)) => Operation::Sub(a, b),
            },
            Operation::AddConstant(a, _) => return self.sources[a],
            Operation::Neg(a) => Operation::Neg(self.sources[a]?),
            Operation::Scale(a, factor) => Operation::Scale(self.sources[a]?, factor),
            Operation::Euler(a) => Operation::Euler(self.sources[a]?),
            Operation::SignTimes { a, b } => Operation::SignTimes {
                a,
                b: self.sources[b]?,
            },
            nonlinear => nonlinear,
        };
        let algebra = SparseSpace {
            space: &self.space,
            monomials: &self.monomials,
            support: &self.supports[slot],
        };
        let (len, part) = (self.space.len(), self.supports[slot].part(degree));
        let out = &mut self.scratch[..part.len()];
        run(&operands, slot, &algebra, degree, len, tape, out);
        tape[slot * len + part.start..slot * len + part.end].copy_from_slice(out);
        Some(slot)
    }

    /// Puts a part where the recurrences of higher degrees read it.
    #[inline(always)]
    fn copy(&self, source: Option<usize>, slot: usize, degree: usize, tape: &mut [NodeValues]) {
        let (len, part) = (self.space.len(), self.supports[slot].part(degree));
        let target = slot * len + part.start;
        match source {
            Some(source) => {
                tape.copy_within(source * len + part.start..source * len + part.end, target)
            }
            None => tape[target..slot * len + part.end].fill(ZERO),
        }
    }

    /// Adds the share of the states' parts of a degree to a slot, by its slope.
    #[inline(always)]
    pub(super) fn add_share(
        &self,
        degree: usize,
        (slot, slope): (usize, NodeValues),
        state: usize,
        tape: &mut [NodeValues],
    ) {
        let (len, part) = (self.space.len(), self.supports[state].part(degree));
        let factor = if self.program.is_euler(slot) {
            degree as f64
        } else {
            1.0
        };
        let slope = slope * Lanes::splat(factor);
        let (states, slots) = tape.split_at_mut(self.dimension * len);
        let states = &states[state * len + part.start..state * len + part.end];
        let first = (slot - self.dimension) * len;
        let slots = &mut slots[first + part.start..first + part.end];
        for (value, &state) in slots.iter_mut().zip(states) {
            *value = slope.mul_add(state, *value);
        }
    }
}
