//! Taylor coefficients in time of a solution, as numbers: the integrator's inner loop.
//!
//! One idea: a field's program is lowered once more, for series in time only, to few instructions
//! ([`lowering`]). Functions of the parameters are computed when these change, functions of the
//! phase before the series of the states, watched functions afterwards. Only the rest runs degree
//! by degree, with products four degrees at a time ([`expansion`]). Any scalar will do; lanes give
//! the bits of single numbers.

mod expansion;
mod lowering;

use super::corners::Corner;
use super::program::{Operation, Slot, run};
use super::resolution::Argument;
use crate::jet::TimeSeries;
use crate::numeric::{Dd, Scalar};

use expansion::{BLOCK, Block};

/// Largest number of blocks of a series: order 39, which double-double uses.
///
/// NOTE: all series have this room, so that their places follow without a multiplication or a
/// check.
const MOST_BLOCKS: usize = 10;

/// Blocks of a series.
type Blocks<S> = [Block<S>; MOST_BLOCKS];

/// A field's program for series in time, with numbers as coefficients.
#[derive(Clone, Debug)]
pub(super) struct SeriesProgram {
    dimension: usize,
    /// Number of states and parameters, which are the first slots.
    inputs: usize,
    slots: usize,
    /// Factors of linear combinations: sums of products of constants.
    factors: Vec<Vec<Factor>>,
    constants: ConstantSlots,
    tables: Vec<PhaseTable>,
    /// Groups of mutually dependent instructions: functions of the phase; then the states'
    /// derivatives with their operands and integrals; then all others.
    groups: Vec<Vec<Instruction>>,
    /// Components whose series limit a step.
    limiting: Vec<usize>,
    /// Arguments of functions that may have narrow features.
    arguments: Vec<Argument>,
    /// Corners behind which a step ends.
    corners: Vec<Corner>,
    /// Whether each slot of the field's program is a linear combination of inputs.
    combinations: Vec<bool>,
}

impl SeriesProgram {
    /// Components whose series limit a step: all except phases and integrals of one component.
    pub(super) fn limiting(&self) -> &[usize] {
        &self.limiting
    }

    /// Arguments of functions that may have narrow features; they limit a step too.
    pub(super) fn arguments(&self) -> &[Argument] {
        &self.arguments
    }

    /// Corners that a solution may meet.
    pub(super) fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// Whether a slot of the field's program is a linear combination of the states, and so as well
    /// resolved as these.
    pub(super) fn is_combination(&self, slot: Slot) -> bool {
        self.combinations[slot]
    }
}

/// Slots that depend on the parameters and the phases only.
#[derive(Clone, Debug)]
struct ConstantSlots {
    /// Slots that depend on the parameters only, with their operations.
    heads: Vec<(Slot, Operation)>,
    /// Phases, with the slots of their rates.
    rates: Vec<(Slot, Slot)>,
    /// Slots that are linear in the phases, with their operations.
    linear: Vec<(Slot, Operation)>,
}

/// A slot that holds `a_1^k/k!` for a phase `a`.
#[derive(Clone, Copy, Debug)]
struct PhaseTable {
    phase: Slot,
    table: Slot,
}

/// Series of all slots of a program, with the parameters for which they were computed.
#[derive(Clone, Debug)]
pub(super) struct Series<'p, S> {
    program: &'p SeriesProgram,
    /// Number of blocks of a series.
    blocks: usize,
    tape: Vec<Blocks<S>>,
    factors: Vec<S>,
    /// `1/(k + 1)`.
    inverses: Blocks<S>,
    parameters: Option<Vec<S>>,
}

impl<'p, S: Scalar> Series<'p, S> {
    /// Series of at least the given order, or of the highest order possible.
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

    /// Highest power of time.
    pub(super) fn order(&self) -> usize {
        self.blocks * BLOCK - 1
    }

    /// Coefficients of a slot of the program, in ascending powers.
    #[inline]
    pub(super) fn coefficients(&self, slot: Slot) -> &[S] {
        self.tape[slot][..self.blocks].as_flattened()
    }

    /// Computes the coefficients of every needed slot, about a state.
    #[inline(never)]
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

    /// Computes the slots that depend on the parameters only.
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
/// NOTE: not inlined, so that the common recurrences remain a few instructions each.
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

/// A product of a number and heads of constant slots.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Factor {
    pub(super) number: Dd,
    pub(super) heads: Vec<Slot>,
}

/// An operand whose coefficient of the current degree is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Operand {
    pub(super) slot: Slot,
    /// Whether that coefficient is the result of the instruction before this one.
    ///
    /// NOTE: the coefficient is then in a register: through memory each instruction of a degree
    /// would wait for the one before.
    pub(super) is_fresh: bool,
}

/// A factor, by index, and the operand that it multiplies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ScaledOperand {
    pub(super) factor: usize,
    pub(super) operand: Operand,
}

/// Terms of a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Terms {
    One(ScaledOperand),
    Two([ScaledOperand; 2]),
    /// Three terms; only the last of several terms may be fresh.
    Three([ScaledOperand; 3]),
}

/// `Σ_i factor_i · operand_i`, and a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sum {
    pub(super) terms: Terms,
    /// The constant, a factor by its index.
    pub(super) constant: Option<usize>,
}

impl Sum {
    fn terms(&mut self) -> &mut [ScaledOperand] {
        match &mut self.terms {
            Terms::One(term) => std::slice::from_mut(term),
            Terms::Two(terms) => terms,
            Terms::Three(terms) => terms,
        }
    }
}

/// One recurrence: computes the coefficients of a slot from those of others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Instruction {
    /// A linear combination.
    Linear { out: Slot, sum: Sum },
    /// `x_{k+1} = sum_k / (k + 1)`.
    Integral { out: Slot, sum: Sum },
    /// A square.
    Square { out: Slot, a: Operand },
    /// A product.
    Product { out: Slot, a: Operand, b: Operand },
    /// `(numerator_k − Σ_{j ≥ 1} b_j u_{k−j}) / b_0`.
    Quotient {
        out: Slot,
        numerator: Operand,
        denominator: Operand,
        /// Slot of `1/b_0`.
        reciprocal: Slot,
    },
    /// Sine and cosine, if needed, of a phase `a = a_0 + a_1 t`: `a_1^k/k!` from a table, times the
    /// derivatives of the functions at `a_0`.
    Phase { a: Slot, table: Slot, sine: Option<Slot>, cosine: Option<Slot> },
    /// The Euler derivative `k a_k`.
    Euler { out: Slot, a: Operand },
    /// A function of a slot whose derivative is a partner, or minus the partner:
    /// `u_k = ±(1/k) Σ_{j ≥ 1} (Ea)_j v_{k−j}`.
    Function {
        out: Slot,
        /// The operation that gives the head.
        operation: Operation,
        sign: Sign,
        euler_a: Operand,
        partner: Slot,
    },
    /// Any other operation of the program.
    Other { out: Slot, operation: Operation },
}

/// Sign of a product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sign {
    Plus,
    Minus,
}

impl Instruction {
    /// Slot whose coefficient the instruction computes last.
    pub(super) fn out(&self) -> Option<Slot> {
        match *self {
            Instruction::Linear { out, .. }
            | Instruction::Integral { out, .. }
            | Instruction::Square { out, .. }
            | Instruction::Product { out, .. }
            | Instruction::Quotient { out, .. }
            | Instruction::Euler { out, .. }
            | Instruction::Function { out, .. }
            | Instruction::Other { out, .. } => Some(out),
            Instruction::Phase { .. } => None,
        }
    }

    /// Whether the instruction reads the newest coefficient of a slot.
    pub(super) fn takes(&self, slot: Slot) -> bool {
        let mut found = false;
        let mut copy = *self;
        copy.each_operand(&mut |operand| found |= operand.slot == slot);
        found
    }

    /// Marks the operand that is the result of the instruction before.
    pub(super) fn take_from(&mut self, before: Slot) {
        if let Instruction::Linear { sum, .. } | Instruction::Integral { sum, .. } = self {
            let terms = sum.terms();
            let last = terms.len() - 1;
            if let Some(fresh) = terms.iter().position(|term| term.operand.slot == before) {
                terms.swap(fresh, last);
            }
        }
        self.each_operand(&mut |operand| operand.is_fresh = operand.slot == before);
    }

    fn each_operand(&mut self, visit: &mut dyn FnMut(&mut Operand)) {
        match self {
            Instruction::Linear { sum, .. } | Instruction::Integral { sum, .. } => {
                let terms = sum.terms().iter_mut();
                terms.for_each(|term| visit(&mut term.operand));
            }
            Instruction::Square { a, .. }
            | Instruction::Euler { a, .. }
            | Instruction::Function { euler_a: a, .. } => visit(a),
            Instruction::Product { a, b, .. } => [a, b].into_iter().for_each(visit),
            Instruction::Quotient { numerator, denominator, .. } => {
                [numerator, denominator].into_iter().for_each(visit)
            }
            Instruction::Phase { .. } | Instruction::Other { .. } => {}
        }
    }
}

#[cfg(test)]
mod tests {
    //! Coefficients by instructions, compared with those of the program they are made from, which
    //! is run by the recurrences of any graded algebra.

    use super::*;
    use crate::flow::jet_transport::expand;
    use crate::flow::{Field, InputKind, samples};
    use crate::model::{ExpressionGraph, Unary};
    use crate::numeric::{Dd, Real};

    /// `x' = y, y' = −x y² + y sin(x)/(2 + x) + cos²θ − sin θ cos θ + p x + e^{−y} + |x|, θ' = 2p`,
    /// watching `x y + θ + p` and `sin² θ`: products, sums of many terms, functions of states, and
    /// of the phase alone.
    fn everything() -> Field {
        let mut g = ExpressionGraph::new();
        let [x, y, theta, p] = std::array::from_fn(|input| g.input(input));
        let square = g.power_integer(y, 2);
        let drag = g.mul(x, square);
        let (sine, two) = (g.unary(Unary::Sin, x), g.number(2.0));
        let (top, bottom) = (g.mul(y, sine), g.add(two, x));
        let quotient = g.div(top, bottom);
        let (s, c) = (g.unary(Unary::Sin, theta), g.unary(Unary::Cos, theta));
        let (cc, sc, ss) = (g.power_integer(c, 2), g.mul(s, c), g.power_integer(s, 2));
        let (spring, minus) = (g.mul(p, x), g.neg(y));
        let (decay, size) = (g.unary(Unary::Exp, minus), g.unary(Unary::Abs, x));
        let mut rate = g.neg(drag);
        for term in [quotient, cc, spring, decay, size] {
            rate = g.add(rate, term);
        }
        let rate = g.sub(rate, sc);
        let turn = g.mul(two, p);
        let (xy, shifted) = (g.mul(x, y), g.add(theta, p));
        let watched = g.add(xy, shifted);
        Field::new(&g, &[y, rate, turn], &[watched, ss], &[InputKind::HeadOnly])
    }

    /// `x' = y, y' = −x + Σ f(x) over all functions of one argument that are smooth at the state`,
    /// watching `sinh x cosh x`.
    fn all_functions() -> Field {
        let mut g = ExpressionGraph::new();
        let [x, y] = std::array::from_fn(|input| g.input(input));
        let mut rate = g.neg(x);
        for function in [
            Unary::Sinh,
            Unary::Cosh,
            Unary::Tanh,
            Unary::Sech,
            Unary::Logistic,
            Unary::Softplus,
            Unary::LogCosh,
            Unary::Tan,
            Unary::Sqrt,
            Unary::Log,
            Unary::Asin,
            Unary::Atan,
        ] {
            let value = g.unary(function, x);
            rate = g.add(rate, value);
        }
        let (sinh, cosh) = (g.unary(Unary::Sinh, x), g.unary(Unary::Cosh, x));
        let watched = g.mul(sinh, cosh);
        Field::new(&g, &[y, rate], &[watched], &[])
    }

    /// Largest difference of the coefficients of states and watched functions, relative to the
    /// largest coefficient of this degree or above.
    fn largest_difference<S: Real>(field: &Field, state: &[f64], parameters: &[f64]) -> f64 {
        let values =
            |values: &[f64]| -> Vec<S> { values.iter().map(|&v| S::from_f64(v)).collect() };
        let (state, parameters) = (values(state), values(parameters));
        let mut series = Series::new(field.series(), 30);
        // Twice, so that leftovers of a first expansion would show.
        series.expand(&another_state(&state), &parameters);
        series.expand(&state, &parameters);
        let (order, program) = (series.order(), field.time_program());
        let mut tape = vec![S::zero(); program.slots() * (order + 1)];
        for (input, &value) in state.iter().chain(&parameters).enumerate() {
            tape[input * (order + 1)] = value;
        }
        expand(field, &TimeSeries { order }, &mut tape, &mut [S::zero()]);
        let watched = (0..field.watched()).map(|w| program.output(field.dimension() + w));
        let slots: Vec<_> = (0..field.dimension()).chain(watched).collect();
        let (mut size, mut largest) = (1e-300, 0.0_f64);
        for degree in (0..=order).rev() {
            for &slot in &slots {
                size = tape[slot * (order + 1) + degree].magnitude().max(size);
            }
            for &slot in &slots {
                let (found, expected) =
                    (series.coefficients(slot)[degree], tape[slot * (order + 1) + degree]);
                largest = largest.max((found - expected).magnitude() / size);
            }
        }
        largest
    }

    fn another_state<S: Real>(state: &[S]) -> Vec<S> {
        state.iter().map(|&value| value * S::from_f64(0.5)).collect()
    }

    #[test]
    fn instructions_give_the_series_of_the_program() {
        let kinds = [InputKind::HeadOnly; 3];
        let cases: [(Field, &[f64], &[f64]); 7] = [
            (everything(), &[0.4, -0.3, 0.8], &[0.7]),
            (all_functions(), &[0.4, -0.3], &[]),
            (samples::electrostatic(&kinds), &[0.3, 0.1, 0.4], &[0.02, 0.3, 0.6]),
            (samples::linear(&kinds), &[0.3, 0.1, 0.4], &[0.05, 1.1, 1.8]),
            (samples::kepler(), &[0.5, 0.1, 0.2, 1.5], &[]),
            (samples::pendulum(), &[0.7, 0.4], &[]),
            (samples::quadratic(), &[0.7], &[]),
        ];
        for (index, (field, state, parameters)) in cases.iter().enumerate() {
            // Roundings of some 30 coefficients of 30 terms each, which later coefficients inherit.
            let double = largest_difference::<f64>(field, state, parameters);
            assert!(double < 1e-12, "{index}: {double:e}");
            let exact = largest_difference::<Dd>(field, state, parameters);
            assert!(exact < 1e-27, "{index}: {exact:e}");
        }
    }

    #[test]
    fn squares_of_the_phase_need_no_products() {
        let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
        let products = field.series().groups.iter().flatten().filter(|instruction| {
            matches!(
                instruction,
                Instruction::Square { .. }
                    | Instruction::Product { .. }
                    | Instruction::Quotient { .. }
            )
        });
        // The quotient `V sin θ/(1 − x)` and its square; the phase is in neither convolution twice.
        assert_eq!(products.count(), 2);
        let phase_alone = everything();
        let before = &phase_alone.series().groups[..2];
        assert!(before.iter().flatten().all(|instruction| matches!(
            instruction,
            Instruction::Phase { .. } | Instruction::Linear { .. }
        )));
    }
}
