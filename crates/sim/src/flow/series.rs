//! Taylor coefficients in time of a solution, as numbers: the integrator's inner loop.
//!
//! One idea: a field's program is lowered once more, for series in time alone, to few instructions
//! ([`lowering`](self::lowering)): functions of the parameters are computed when these change,
//! functions of the phase before the series of the states, watched functions after, and only
//! what is left goes degree by degree, products four degrees at a time ([`block`](self::block)).
//! Any scalar will do; lanes give the bits of single numbers.

mod block;
mod expansion;
mod instruction;
mod lowering;

use super::program::{Operation, Slot, run};
use crate::jet::TimeSeries;
use crate::numeric::Scalar;
use block::{BLOCK, Block};
use instruction::{Factor, Instruction};

/// Most blocks of a series: order 39, which double-double takes.
///
/// NOTE: all series have this room, so that their places are known without a multiplication and a
/// check.
const MOST_BLOCKS: usize = 10;

/// The blocks of a series.
type Blocks<S> = [Block<S>; MOST_BLOCKS];

/// A field's program for series in time, with numbers as coefficients.
#[derive(Clone, Debug)]
pub(super) struct SeriesProgram {
    dimension: usize,
    /// States and parameters: the first slots.
    inputs: usize,
    slots: usize,
    /// Factors of linear combinations: sums of products of constants.
    factors: Vec<Vec<Factor>>,
    constants: ConstantSlots,
    tables: Vec<PhaseTable>,
    /// Groups of instructions that need each other: functions of the phase, then what the
    /// derivatives need of the states with the integrals of these, then all else.
    groups: Vec<Vec<Instruction>>,
    /// The components whose series limit a step.
    limiting: Vec<usize>,
    /// Whether each slot of the field's program is a linear combination of inputs.
    combinations: Vec<bool>,
}

impl SeriesProgram {
    /// The components whose series limit a step: all but phases and integrals of one of them.
    pub(super) fn limiting(&self) -> &[usize] {
        &self.limiting
    }

    /// Whether a slot of the field's program is as well resolved as the states are: a linear
    /// combination of them.
    pub(super) fn is_combination(&self, slot: Slot) -> bool {
        self.combinations[slot]
    }
}

/// Slots of which the parameters and the phases say everything.
#[derive(Clone, Debug)]
struct ConstantSlots {
    /// Functions of the parameters.
    heads: Vec<(Slot, Operation)>,
    /// Phases, and the slots of their rates.
    rates: Vec<(Slot, Slot)>,
    /// Linear functions of the phases.
    linear: Vec<(Slot, Operation)>,
}

/// A slot that holds `a_1^k/k!` for a phase `a`.
#[derive(Clone, Copy, Debug)]
struct PhaseTable {
    phase: Slot,
    table: Slot,
}

/// The series of all slots of a program, with the parameters they were computed for.
#[derive(Clone, Debug)]
pub(super) struct Series<'p, S> {
    program: &'p SeriesProgram,
    /// Blocks of a series.
    blocks: usize,
    tape: Vec<Blocks<S>>,
    factors: Vec<S>,
    /// `1/(k + 1)`.
    inverses: Blocks<S>,
    parameters: Option<Vec<S>>,
}

impl<'p, S: Scalar> Series<'p, S> {
    /// Series up to an order at least the one given, or the highest there is.
    pub(super) fn new(program: &'p SeriesProgram, order: usize) -> Self {
        let blocks = (order / BLOCK + 1).min(MOST_BLOCKS);
        let inverse = |k: usize| S::one() / S::from_f64((k + 1) as f64);
        Self {
            program,
            blocks,
            tape: vec![[[S::zero(); BLOCK]; MOST_BLOCKS]; program.slots],
            factors: vec![S::zero(); program.factors.len()],
            inverses: std::array::from_fn(|block| {
                std::array::from_fn(|i| inverse(BLOCK * block + i))
            }),
            parameters: None,
        }
    }

    /// The highest power of time.
    pub(super) fn order(&self) -> usize {
        self.blocks * BLOCK - 1
    }

    /// Coefficients of a slot of the program, in ascending powers.
    #[inline]
    pub(super) fn coefficients(&self, slot: Slot) -> &[S] {
        self.tape[slot][..self.blocks].as_flattened()
    }

    /// Computes the coefficients of every slot that is needed, about a state.
    pub(super) fn expand(&mut self, state: &[S], parameters: &[S]) {
        if self.parameters.as_deref() != Some(parameters) {
            self.set_parameters(parameters);
        }
        for (slot, &value) in state.iter().enumerate() {
            *self.coefficient(slot, 0) = value;
        }
        for &(slot, operation) in &self.program.constants.linear {
            self.run(slot, &operation, 0);
        }
        S::dispatch(expansion::Expansion {
            program: self.program,
            blocks: self.blocks,
            tape: &mut self.tape,
            factors: &self.factors,
            inverses: &self.inverses,
        });
    }

    /// Computes what depends on the parameters alone.
    fn set_parameters(&mut self, parameters: &[S]) {
        let program = self.program;
        let kept = self.parameters.get_or_insert_default();
        kept.clear();
        kept.extend(parameters);
        for (slot, &value) in (program.dimension..program.inputs).zip(parameters) {
            *self.coefficient(slot, 0) = value;
        }
        for &(slot, operation) in &program.constants.heads {
            self.run(slot, &operation, 0);
        }
        for &(phase, rate) in &program.constants.rates {
            *self.coefficient(phase, 1) = *self.coefficient(rate, 0);
        }
        for &(slot, operation) in &program.constants.linear {
            self.run(slot, &operation, 1);
        }
        for &PhaseTable { phase, table } in &program.tables {
            let rate = *self.coefficient(phase, 1);
            let mut power = S::one();
            for k in 0..=self.order() {
                *self.coefficient(table, k) = power;
                power = power * rate * self.inverses.as_flattened()[k];
            }
        }
        for (index, summands) in program.factors.iter().enumerate() {
            let summands = summands.iter().map(|factor| {
                let heads = factor.heads.iter().map(|&slot| self.coefficients(slot)[0]);
                heads.fold(S::from_dd(factor.number), |product, head| product * head)
            });
            self.factors[index] = summands.fold(S::zero(), |sum, summand| sum + summand);
        }
    }

    fn coefficient(&mut self, slot: Slot, k: usize) -> &mut S {
        &mut self.tape[slot].as_flattened_mut()[k]
    }

    fn run(&mut self, slot: Slot, operation: &Operation, k: usize) {
        *self.coefficient(slot, k) = any_coefficient(&self.tape, slot, operation, k);
    }
}

/// A coefficient by the recurrence of any graded algebra.
///
/// NOTE: not inlined, so that the common recurrences stay a few instructions each.
#[inline(never)]
fn any_coefficient<S: Scalar>(
    tape: &[Blocks<S>],
    slot: Slot,
    operation: &Operation,
    k: usize,
) -> S {
    let (len, mut out) = (MOST_BLOCKS * BLOCK, [S::zero()]);
    let algebra = TimeSeries { order: len - 1 };
    run(operation, slot, &algebra, k, len, tape.as_flattened().as_flattened(), &mut out);
    out[0]
}

#[cfg(test)]
mod tests;
