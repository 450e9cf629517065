//! Lowering of a program to the instructions of its series.
//!
//! One idea: slots that do not depend on the states are completed before, slots that the
//! derivatives do not need afterwards. In the rest, sums are gathered into single instructions, and
//! each instruction is placed after the one whose result it waits for.

use super::{
    ConstantSlots, Factor, Instruction, Operand, PhaseTable, ScaledOperand, SeriesProgram, Sign,
    Sum, Terms,
};
use crate::flow::corners::corners;
use crate::flow::program::{InputKind, Operation, Program, Slot};
use crate::flow::resolution::arguments;
use crate::jet::HeadFunction;
use crate::jet::elementary::partner_sign;
use crate::numeric::Dd;

impl SeriesProgram {
    /// Series of a field's program whose first outputs are the derivatives of the states; `inputs`
    /// as in the lowering.
    pub(in crate::flow) fn new(program: &Program, inputs: &[InputKind], dimension: usize) -> Self {
        let mut lowering = SeriesLowering::new(program, inputs);
        let units = lowering.units();
        lowering.mark_feeding(&units, dimension);
        let constants = lowering.constants(dimension);
        let (mut before, mut feeding, mut after) = (Vec::new(), Vec::new(), Vec::new());
        let integrated = lowering.integrated(dimension).into_iter();
        let integrals: Vec<_> = integrated.map(|one| lowering.integral(one)).collect();
        lowering.mark_outputs(dimension);
        for unit in units.iter().rev() {
            let Some(instructions) = lowering.unit(unit) else {
                continue;
            };
            if !lowering.of_state[unit[0]] {
                before.push(instructions);
            } else if lowering.feeds[unit[0]] {
                feeding.push(instructions);
            } else {
                after.push(instructions);
            }
        }
        let mut during: Vec<_> = feeding.into_iter().rev().flatten().chain(integrals).collect();
        chain(&mut during);
        let groups = before.into_iter().rev().chain([during]);
        Self {
            dimension,
            inputs: inputs.len(),
            slots: lowering.slots,
            factors: lowering.factors,
            constants,
            tables: lowering.tables,
            groups: groups.chain(after.into_iter().rev()).collect(),
            limiting: limiting(program, &inputs[..dimension]),
            arguments: arguments(program, inputs),
            corners: corners(program, inputs),
            combinations: combinations(program),
        }
    }
}

/// Orders the integrals so that the next instruction waits least, and marks the operands that are
/// results of the instruction before.
fn chain(during: &mut [Instruction]) {
    let is_integral =
        |instruction: &Instruction| matches!(instruction, Instruction::Integral { .. });
    let others = during.iter().take_while(|one| !is_integral(one)).count();
    let (first, integrals) = during.split_at_mut(others);
    if let Some(given) = first.last().and_then(Instruction::out)
        && let Some(found) = integrals.iter().position(|one| one.takes(given))
    {
        integrals.swap(0, found);
    }
    let feeds_first = |one: &Instruction| {
        let start = first.first();
        start.is_some_and(|start| one.out().is_some_and(|out| start.takes(out)))
    };
    if let Some(found) = integrals.iter().skip(1).position(feeds_first) {
        let last = integrals.len() - 1;
        integrals.swap(found + 1, last);
    }
    // NOTE: an integral gives the next degree, for the first instruction of that degree.
    let mut before = during.last().and_then(Instruction::out);
    for instruction in during {
        if let Some(before) = before {
            instruction.take_from(before);
        }
        before = instruction.out().filter(|_| !is_integral(instruction));
    }
}

/// Kind of a slot's series, known before a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SlotKind {
    /// A function of the parameters.
    Constant,
    /// A phase, or a function linear in phases with constant factors.
    Linear,
    /// Any other series.
    Series,
}

struct SeriesLowering<'p> {
    program: &'p Program,
    inputs: &'p [InputKind],
    /// Number of slots: of the program, and those added for reciprocals and tables.
    slots: usize,
    /// Whether each slot depends on a state other than a phase.
    of_state: Vec<bool>,
    kinds: Vec<SlotKind>,
    /// Number of operations and outputs that read each slot.
    uses: Vec<usize>,
    /// Number of terms of each slot's linear combination, with linear operands used only there
    /// expanded.
    terms: Vec<usize>,
    /// Whether the derivatives of the states need each slot.
    feeds: Vec<bool>,
    /// Whether instructions or outputs read each slot.
    needed: Vec<bool>,
    factors: Vec<Vec<Factor>>,
    tables: Vec<PhaseTable>,
}

impl<'p> SeriesLowering<'p> {
    fn new(program: &'p Program, inputs: &'p [InputKind]) -> Self {
        let slots = program.slots();
        let mut of_state = vec![false; slots];
        let mut uses = vec![0; slots];
        for (slot, kind) in inputs.iter().enumerate() {
            of_state[slot] = *kind == InputKind::Variable;
        }
        for slot in inputs.len()..slots {
            of_state[slot] = program.operands(slot).any(|operand| of_state[operand]);
        }
        let read = (0..slots).flat_map(|slot| program.operation(slot).reads());
        let outputs = (0..program.outputs()).map(|output| program.output(output));
        read.chain(outputs).for_each(|slot| uses[slot] += 1);
        let mut lowering = Self {
            program,
            inputs,
            slots,
            of_state,
            kinds: Vec::new(),
            uses,
            terms: Vec::new(),
            feeds: vec![false; slots],
            needed: vec![false; slots],
            factors: Vec::new(),
            tables: Vec::new(),
        };
        for slot in 0..slots {
            lowering.kinds.push(lowering.kind(slot));
            lowering.terms.push(lowering.gathered_terms(slot));
        }
        lowering
    }

    fn kind(&self, slot: Slot) -> SlotKind {
        if let Some(input) = self.inputs.get(slot) {
            return match input {
                InputKind::Variable => SlotKind::Series,
                InputKind::LinearInTime => SlotKind::Linear,
                InputKind::HeadOnly | InputKind::Bound(_) => SlotKind::Constant,
            };
        }
        let has = |kind| self.program.operands(slot).any(|operand| self.kinds[operand] == kind);
        if has(SlotKind::Series) || has(SlotKind::Linear) && !self.is_linear(slot) {
            SlotKind::Series
        } else if has(SlotKind::Linear) {
            SlotKind::Linear
        } else {
            SlotKind::Constant
        }
    }

    /// Slots beyond the inputs, grouped by mutual dependence.
    fn units(&self) -> Vec<Vec<Slot>> {
        let mut units: Vec<Vec<Slot>> = Vec::new();
        let mut open = 0;
        for slot in self.inputs.len()..self.program.slots() {
            if slot < open
                && let Some(unit) = units.last_mut()
            {
                unit.push(slot);
            } else {
                units.push(vec![slot]);
            }
            let last = self.program.operation(slot).reads().max().unwrap_or(0);
            open = open.max(last + 1);
        }
        units
    }

    fn mark_feeding(&mut self, units: &[Vec<Slot>], dimension: usize) {
        for component in 0..dimension {
            self.feeds[self.program.output(component)] = true;
        }
        for unit in units.iter().rev() {
            if unit.iter().any(|&slot| self.feeds[slot]) {
                for &slot in unit {
                    self.feeds[slot] = true;
                    let reads = self.program.operation(slot).reads();
                    reads.for_each(|read| self.feeds[read] = true);
                }
            }
        }
    }

    /// Whether a slot is a function of the parameters.
    fn is_constant(&self, slot: Slot) -> bool {
        self.kinds[slot] == SlotKind::Constant
    }

    /// States that are not linear in time.
    fn integrated(&self, dimension: usize) -> Vec<Slot> {
        let states = (0..dimension).filter(|&state| self.inputs[state] == InputKind::Variable);
        states.collect()
    }

    fn constants(&self, dimension: usize) -> ConstantSlots {
        let beyond = self.inputs.len()..self.program.slots();
        let with_operation = |slot: Slot| (slot, *self.program.operation(slot));
        let is_linear = |&slot: &Slot| self.kinds[slot] == SlotKind::Linear;
        let phases = (0..dimension).filter(|&state| self.inputs[state] != InputKind::Variable);
        ConstantSlots {
            heads: beyond
                .clone()
                .filter(|&slot| self.is_constant(slot))
                .map(with_operation)
                .collect(),
            rates: phases.map(|state| (state, self.program.output(state))).collect(),
            linear: beyond.filter(is_linear).map(with_operation).collect(),
        }
    }

    /// Marks the outputs that must be slots: the watched functions.
    fn mark_outputs(&mut self, dimension: usize) {
        for output in dimension..self.program.outputs() {
            self.needed[self.program.output(output)] = true;
        }
    }

    fn integral(&mut self, state: Slot) -> Instruction {
        let derivative = self.program.output(state);
        Instruction::Integral { out: state, sum: self.sum(derivative) }
    }

    /// Instructions of mutually dependent slots, if any of these is needed.
    fn unit(&mut self, unit: &[Slot]) -> Option<Vec<Instruction>> {
        let is_done = |&slot: &Slot| self.kinds[slot] != SlotKind::Series;
        if !unit.iter().any(|&slot| self.needed[slot]) || unit.iter().all(is_done) {
            return None;
        }
        if let [slot] = *unit {
            return Some(vec![self.instruction(slot)]);
        }
        if let [sine, cosine] = *unit
            && let Operation::OfPhase { a, .. } = *self.program.operation(sine)
            && self.kinds[a] == SlotKind::Linear
        {
            return Some(vec![self.phase(a, sine, cosine)]);
        }
        Some(unit.iter().map(|&slot| self.instruction(slot)).collect())
    }

    fn phase(&mut self, a: Slot, sine: Slot, cosine: Slot) -> Instruction {
        let table = self.added_slot();
        self.tables.push(PhaseTable { phase: a, table });
        Instruction::Phase {
            a,
            table,
            sine: self.needed[sine].then_some(sine),
            cosine: self.needed[cosine].then_some(cosine),
        }
    }

    fn instruction(&mut self, out: Slot) -> Instruction {
        match *self.program.operation(out) {
            Operation::Mul(a, b) if a == b => Instruction::Square { out, a: self.operand(a) },
            Operation::Mul(a, b) => {
                Instruction::Product { out, a: self.operand(a), b: self.operand(b) }
            }
            Operation::Div(a, b) => Instruction::Quotient {
                out,
                numerator: self.operand(a),
                denominator: self.operand(b),
                reciprocal: self.added_slot(),
            },
            Operation::Euler(a) => Instruction::Euler { out, a: self.operand(a) },
            Operation::Exp { euler_a, .. } => self.function(out, HeadFunction::Exp, [euler_a, out]),
            Operation::Function { function, euler_a, partner, .. } => {
                self.function(out, function, [euler_a, partner])
            }
            _ if self.is_linear(out) => Instruction::Linear { out, sum: self.sum(out) },
            _ => self.other(out),
        }
    }

    fn function(
        &mut self,
        out: Slot,
        function: HeadFunction,
        [euler_a, partner]: [Slot; 2],
    ) -> Instruction {
        let operation = self.read_by(out);
        let sign = if partner_sign(function) > 0.0 { Sign::Plus } else { Sign::Minus };
        Instruction::Function { out, operation, sign, euler_a: self.operand(euler_a), partner }
    }

    fn other(&mut self, out: Slot) -> Instruction {
        Instruction::Other { out, operation: self.read_by(out) }
    }

    /// Operation of a slot, whose reads are needed.
    fn read_by(&mut self, slot: Slot) -> Operation {
        let operation = *self.program.operation(slot);
        operation.reads().for_each(|read| self.needed[read] = true);
        operation
    }

    fn operand(&mut self, slot: Slot) -> Operand {
        self.needed[slot] = true;
        Operand { slot, is_fresh: false }
    }

    fn added_slot(&mut self) -> Slot {
        self.slots += 1;
        self.slots - 1
    }
}

/// Components that limit the step: all except phases and components whose rate is another component
/// `v` that is not itself such an integral.
///
/// NOTE: if `x' = v`, then `x_{k+1} = v_k/(k + 1)`: from `|v_k| h^k ≤ ε |v_j| h^j` follows
/// `|x_{k+1}| h^{k+1} ≤ ε (j + 1)/(k + 1) |x_{j+1}| h^{j+1}`, so that the series of `x` is less
/// restrictive than that of `v`.
fn limiting(program: &Program, states: &[InputKind]) -> Vec<usize> {
    let is_state = |component: usize| program.output(component) < states.len();
    let is_integral =
        |component: usize| is_state(component) && !is_state(program.output(component));
    let limits = |&component: &usize| {
        states[component] != InputKind::LinearInTime && !is_integral(component)
    };
    (0..states.len()).filter(limits).collect()
}

/// Whether each slot is a linear combination of inputs and constants with factors constant in time.
fn combinations(program: &Program) -> Vec<bool> {
    let mut are = Vec::with_capacity(program.slots());
    for slot in 0..program.slots() {
        are.push(match *program.operation(slot) {
            Operation::Input | Operation::Constant(_) => true,
            Operation::Add(a, b) | Operation::Sub(a, b) => are[a] && are[b],
            Operation::Neg(a) | Operation::Scale(a, _) | Operation::AddConstant(a, _) => are[a],
            Operation::MulByHead { factor, .. } => are[factor],
            _ => false,
        });
    }
    are
}

/// A linear combination: constants, and factors with the slots that they multiply.
#[derive(Clone, Default)]
struct SlotForm {
    constants: Vec<Factor>,
    terms: Vec<(Factor, Slot)>,
}

impl SlotForm {
    fn of_slot(slot: Slot) -> Self {
        Self { constants: Vec::new(), terms: vec![(Factor::one(), slot)] }
    }

    fn plus(mut self, other: Self) -> Self {
        self.constants.extend(other.constants);
        self.terms.extend(other.terms);
        self
    }

    fn times(mut self, number: Dd, head: Option<Slot>) -> Self {
        let factors = self.constants.iter_mut();
        for factor in factors.chain(self.terms.iter_mut().map(|term| &mut term.0)) {
            factor.number *= number;
            factor.heads.extend(head);
        }
        self
    }
}

impl Factor {
    fn one() -> Self {
        Self { number: Dd::from(1.0), heads: Vec::new() }
    }
}

impl SeriesLowering<'_> {
    /// Whether an operation is a linear combination with constant factors.
    fn is_linear(&self, slot: Slot) -> bool {
        match *self.program.operation(slot) {
            Operation::Add(..)
            | Operation::Sub(..)
            | Operation::Neg(_)
            | Operation::Scale(..)
            | Operation::AddConstant(..) => true,
            Operation::MulByHead { head, .. } => self.is_constant(head),
            _ => false,
        }
    }

    /// Number of terms of a slot's linear combination, with linear operands used only there
    /// expanded; those of its operands are known.
    fn gathered_terms(&self, slot: Slot) -> usize {
        let of = |operand: Slot| match () {
            () if self.is_constant(operand) => 0,
            () if self.uses[operand] == 1 && self.is_linear(operand) => self.terms[operand],
            () => 1,
        };
        match *self.program.operation(slot) {
            Operation::Add(a, b) | Operation::Sub(a, b) => of(a) + of(b),
            Operation::Neg(a) | Operation::Scale(a, _) | Operation::AddConstant(a, _) => of(a),
            Operation::MulByHead { head, factor } if self.is_constant(head) => of(factor),
            _ => 1,
        }
    }

    /// A slot as a linear combination of others. A combination of more than three terms is left to
    /// the separate operations.
    pub(super) fn sum(&mut self, slot: Slot) -> Sum {
        let form = if self.is_linear(slot) {
            self.form(slot, self.terms[slot] <= 3)
        } else {
            self.form_of_operand(slot, false)
        };
        let terms: Vec<_> = form.terms.into_iter().map(|term| self.term(term)).collect();
        let terms = match terms[..] {
            [a, b, c] => Terms::Three([a, b, c]),
            [a, b] => Terms::Two([a, b]),
            [a, ..] => Terms::One(a),
            [] => Terms::One(self.term((Factor::one(), slot))),
        };
        let constant = (!form.constants.is_empty()).then(|| self.factor(form.constants));
        Sum { terms, constant }
    }

    fn term(&mut self, (factor, slot): (Factor, Slot)) -> ScaledOperand {
        ScaledOperand { factor: self.factor(vec![factor]), operand: self.operand(slot) }
    }

    fn factor(&mut self, summands: Vec<Factor>) -> usize {
        self.factors.push(summands);
        self.factors.len() - 1
    }

    /// Linear combination of an operation; `gathers` tells whether linear operands used only here
    /// are expanded.
    fn form(&self, slot: Slot, gathers: bool) -> SlotForm {
        let of = |operand: Slot| self.form_of_operand(operand, gathers);
        let minus = Dd::from(-1.0);
        match *self.program.operation(slot) {
            Operation::Add(a, b) => of(a).plus(of(b)),
            Operation::Sub(a, b) => of(a).plus(of(b).times(minus, None)),
            Operation::Neg(a) => of(a).times(minus, None),
            Operation::Scale(a, factor) => of(a).times(factor, None),
            Operation::AddConstant(a, number) => {
                let mut form = of(a);
                form.constants.push(Factor { number, heads: Vec::new() });
                form
            }
            Operation::MulByHead { head, factor } => of(factor).times(Dd::from(1.0), Some(head)),
            _ => SlotForm::of_slot(slot),
        }
    }

    fn form_of_operand(&self, slot: Slot, gathers: bool) -> SlotForm {
        if let Operation::Constant(number) = *self.program.operation(slot) {
            let mut form = SlotForm::default();
            form.constants.push(Factor { number, heads: Vec::new() });
            form
        } else if self.is_constant(slot) {
            let mut form = SlotForm::default();
            form.constants.push(Factor { number: Dd::from(1.0), heads: vec![slot] });
            form
        } else if gathers && self.uses[slot] == 1 && self.is_linear(slot) {
            self.form(slot, true)
        } else {
            SlotForm::of_slot(slot)
        }
    }
}
