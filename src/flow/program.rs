//! Expressions lowered to a straight line of recurrences, run degree by degree in any graded algebra.
//!
//! One idea: a vector field is evaluated in time series, in jets, or in jets of time series by the
//! *same* program; only the [`Graded`] algebra differs. Slots of the tape hold one element each. The
//! part of degree `k` of every slot follows from lower parts of all slots and from parts of degree `k`
//! of the inputs and of earlier slots, so calling [`Program::advance`] for `k = 0, 1, …` evaluates it.

use std::collections::HashMap;

use crate::jet::elementary::{
    atan2, exp, hyperbolic, power, primitive, product_part, quotient, sqrt, trigonometric,
};
use crate::jet::{Graded, HeadFunction};
use crate::model::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::{Dd, Scalar};

/// How an input of the graph enters a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputKind {
    /// Any part may be non-zero: a state, or in a jet any active variable.
    Variable,
    /// Only the head is non-zero: a parameter in a time series.
    HeadOnly,
    /// Only the parts of degree 0 and 1 are non-zero, in a series in time: the phase of a forcing.
    LinearInTime,
    /// A number, folded into the program.
    Bound(Dd),
}

/// Slot of the tape.
type Slot = usize;

/// One recurrence. Operands named `euler_*` are slots of Euler derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
    Input,
    Constant(Dd),
    Euler(Slot),
    Add(Slot, Slot),
    Sub(Slot, Slot),
    Neg(Slot),
    Scale(Slot, Dd),
    AddConstant(Slot, Dd),
    /// Product with a slot of which only the head is non-zero.
    MulByHead {
        head: Slot,
        factor: Slot,
    },
    Mul(Slot, Slot),
    Div(Slot, Slot),
    Sqrt(Slot),
    Exp {
        a: Slot,
        euler_a: Slot,
    },
    Sine {
        a: Slot,
        euler_a: Slot,
        cosine: Slot,
    },
    Cosine {
        a: Slot,
        euler_a: Slot,
        sine: Slot,
    },
    /// Sine or cosine of a slot linear in time; its partner is `partner`.
    OfPhase {
        function: HeadFunction,
        a: Slot,
        partner: Slot,
    },
    Sinh {
        a: Slot,
        euler_a: Slot,
        cosh: Slot,
    },
    Cosh {
        a: Slot,
        euler_a: Slot,
        sinh: Slot,
    },
    Primitive {
        function: HeadFunction,
        a: Slot,
        w: Slot,
        euler_u: Slot,
    },
    Power {
        a: Slot,
        exponent: Dd,
        euler_a: Slot,
        euler_u: Slot,
    },
    Atan2 {
        y: Slot,
        x: Slot,
        euler_y: Slot,
        euler_x: Slot,
        w: Slot,
        euler_u: Slot,
    },
    /// `sign(head of a) · b`, constant sign: `abs` and the corners of `min` and `max`.
    SignTimes {
        a: Slot,
        b: Slot,
    },
    /// The sign of the head, a constant.
    Sign(Slot),
}

/// A lowered set of expressions.
#[derive(Clone, Debug)]
pub struct Program {
    operations: Vec<Operation>,
    supports: Vec<Support>,
    /// Slots with a part of degree 0, 1, and 2 or more.
    reaching: [Vec<Slot>; 3],
    inputs: usize,
    outputs: Vec<Slot>,
}

impl Program {
    /// Lowers the expressions `outputs` of a graph; `inputs` says how each input enters.
    ///
    /// Input `i` of the graph is slot `i` of the tape.
    pub fn new(graph: &ExpressionGraph, outputs: &[NodeId], inputs: &[InputKind]) -> Self {
        let mut lowering = Lowering::new(graph, inputs);
        lowering.mark_needed(outputs);
        lowering.lower_nodes();
        let outputs = outputs.iter().map(|&node| lowering.slot_of(node)).collect();
        let reaching = [0, 1, 2].map(|degree| {
            let reaches = |&slot: &Slot| lowering.support[slot].reaches(degree);
            (inputs.len()..lowering.operations.len())
                .filter(reaches)
                .collect()
        });
        let supports = lowering.support;
        Self {
            operations: lowering.operations,
            supports,
            reaching,
            inputs: inputs.len(),
            outputs,
        }
    }

    /// Number of slots: a tape holds `slots · element_len` scalars.
    pub fn slots(&self) -> usize {
        self.operations.len()
    }

    /// Number of inputs: slots `0..inputs`.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of output expressions.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Slot of an output expression.
    pub fn output(&self, output: usize) -> usize {
        self.outputs[output]
    }

    /// Whether the linear part of a slot in a variable is that of the Euler derivative of a function:
    /// at degree `k` it carries the factor `k`.
    pub(crate) fn is_euler(&self, slot: usize) -> bool {
        matches!(self.operations[slot], Operation::Euler(_))
    }

    /// Whether a slot is the same number whatever the inputs.
    pub(crate) fn is_number(&self, slot: usize) -> bool {
        matches!(self.supports[slot], Support::Number(_))
    }

    /// Number of products of two full elements per evaluation: the unit of cost.
    pub fn products(&self) -> usize {
        let is_product = |operation: &&Operation| {
            !matches!(
                operation,
                Operation::Input
                    | Operation::Constant(_)
                    | Operation::Euler(_)
                    | Operation::Add(..)
                    | Operation::Sub(..)
                    | Operation::Neg(_)
                    | Operation::Scale(..)
                    | Operation::AddConstant(..)
                    | Operation::OfPhase { .. }
                    | Operation::SignTimes { .. }
                    | Operation::Sign(_)
            )
        };
        self.operations.iter().filter(is_product).count()
    }

    /// Computes the part of one degree of every slot but the inputs'.
    ///
    /// `tape` holds the slots one after another, each [`Graded::element_len`] scalars; `scratch` at
    /// least the length of the largest part. Parts of lower degree must have been computed before and
    /// the inputs' parts of this degree filled in. Parts that vanish whatever the inputs (beyond the head
    /// of a constant, say) are not written: the tape must be zero there.
    pub fn advance<S: Scalar, A: Graded<S>>(
        &self,
        algebra: &A,
        degree: usize,
        tape: &mut [S],
        scratch: &mut [S],
    ) {
        let len = algebra.element_len();
        let part = algebra.part(degree);
        let out = &mut scratch[..part.len()];
        for &slot in &self.reaching[degree.min(2)] {
            run(
                &self.operations[slot],
                slot,
                algebra,
                degree,
                len,
                tape,
                out,
            );
            tape[slot * len + part.start..slot * len + part.end].copy_from_slice(out);
        }
    }
}

/// One operation at one degree: reads the tape, writes the part to `out`.
#[inline]
fn run<S: Scalar, A: Graded<S>>(
    operation: &Operation,
    slot: Slot,
    algebra: &A,
    k: usize,
    len: usize,
    tape: &[S],
    out: &mut [S],
) {
    let range = algebra.part(k);
    let element = |slot: Slot| &tape[slot * len..(slot + 1) * len];
    let part = |slot: Slot| &tape[slot * len + range.start..slot * len + range.end];
    match *operation {
        Operation::Input => out.copy_from_slice(part(slot)),
        Operation::Constant(value) => constant_part(k, S::from_dd(value), out),
        Operation::Euler(a) => map(part(a), out, |a| a * S::from_f64(k as f64)),
        Operation::Add(a, b) => zip(part(a), part(b), out, |a, b| a + b),
        Operation::Sub(a, b) => zip(part(a), part(b), out, |a, b| a - b),
        Operation::Neg(a) => map(part(a), out, |a| -a),
        Operation::Scale(a, factor) => {
            let factor = S::from_dd(factor);
            map(part(a), out, |a| a * factor);
        }
        Operation::AddConstant(a, value) => {
            out.copy_from_slice(part(a));
            if k == 0 {
                out[0] += S::from_dd(value);
            }
        }
        Operation::MulByHead { head, factor } => {
            out.fill(S::zero());
            algebra.multiply_by_head(k, element(head), part(factor), out);
        }
        Operation::Mul(a, b) => product_part(algebra, k, element(a), element(b), out),
        Operation::Div(a, b) => {
            quotient::part(algebra, k, element(a), element(b), element(slot), out)
        }
        Operation::Sqrt(a) => sqrt::part(algebra, k, element(a), element(slot), out),
        Operation::Exp { a, euler_a } => {
            exp::part(algebra, k, element(a), element(euler_a), element(slot), out)
        }
        Operation::Sine { a, euler_a, cosine } => {
            trigonometric::sine_part(
                algebra,
                k,
                element(a),
                element(euler_a),
                element(cosine),
                out,
            );
        }
        Operation::Cosine { a, euler_a, sine } => {
            trigonometric::cosine_part(
                algebra,
                k,
                element(a),
                element(euler_a),
                element(sine),
                out,
            );
        }
        Operation::OfPhase {
            function,
            a,
            partner,
        } => {
            phase_part(algebra, function, k, element(a), element(partner), out);
        }
        Operation::Sinh { a, euler_a, cosh } => {
            hyperbolic::sinh_part(algebra, k, element(a), element(euler_a), element(cosh), out);
        }
        Operation::Cosh { a, euler_a, sinh } => {
            hyperbolic::cosh_part(algebra, k, element(a), element(euler_a), element(sinh), out);
        }
        Operation::Primitive {
            function,
            a,
            w,
            euler_u,
        } => {
            primitive::part(
                algebra,
                function,
                k,
                element(a),
                element(w),
                element(euler_u),
                out,
            );
        }
        Operation::Power {
            a,
            exponent,
            euler_a,
            euler_u,
        } => {
            let exponent = S::from_dd(exponent);
            power::part(
                algebra,
                exponent,
                k,
                element(a),
                element(euler_a),
                element(slot),
                element(euler_u),
                out,
            );
        }
        Operation::Atan2 {
            y,
            x,
            euler_y,
            euler_x,
            w,
            euler_u,
        } => {
            let (y, x, ey, ex) = (element(y), element(x), element(euler_y), element(euler_x));
            atan2::part(algebra, k, y, x, ey, ex, element(w), element(euler_u), out);
        }
        Operation::SignTimes { a, b } => {
            let sign = element(a)[0].signum();
            map(part(b), out, |b| sign * b);
        }
        Operation::Sign(a) => constant_part(k, element(a)[0].signum(), out),
    }
}

/// Part of degree `k` of `u = sin a` or `cos a` where `a = a_0 + a_1`, `c` being the other of the two:
///
/// ```text
/// u_k = ±(1/k) a_1 c_{k−1}
/// ```
fn phase_part<S: Scalar, A: Graded<S>>(
    algebra: &A,
    function: HeadFunction,
    degree: usize,
    a: &[S],
    partner: &[S],
    out: &mut [S],
) {
    if degree == 0 {
        return algebra.head(function, &a[algebra.part(0)], out);
    }
    out.fill(S::zero());
    let slope = &a[algebra.part(1).start..];
    algebra.multiply_by_head(degree, slope, &partner[algebra.part(degree - 1)], out);
    let sign = if function == HeadFunction::Cos {
        -1.0
    } else {
        1.0
    };
    let factor = S::from_f64(sign) / S::from_f64(degree as f64);
    out.iter_mut().for_each(|value| *value *= factor);
}

fn constant_part<S: Scalar>(degree: usize, value: S, out: &mut [S]) {
    out.fill(S::zero());
    if degree == 0 {
        out[0] = value;
    }
}

#[inline(always)]
fn map<S: Scalar>(a: &[S], out: &mut [S], f: impl Fn(S) -> S) {
    for (value, &a) in out.iter_mut().zip(a) {
        *value = f(a);
    }
}

#[inline(always)]
fn zip<S: Scalar>(a: &[S], b: &[S], out: &mut [S], f: impl Fn(S, S) -> S) {
    for ((value, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *value = f(a, b);
    }
}

/// What lowering knows of a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Support {
    Number(Dd),
    Head,
    Linear,
    Full,
}

impl Support {
    /// Whether a part of a degree can be non-zero (degree 2 stands for all higher ones).
    fn reaches(self, degree: usize) -> bool {
        match self {
            Support::Number(_) | Support::Head => degree == 0,
            Support::Linear => degree <= 1,
            Support::Full => true,
        }
    }
}

/// The state of a lowering.
struct Lowering<'a> {
    graph: &'a ExpressionGraph,
    operations: Vec<Operation>,
    support: Vec<Support>,
    slots: Vec<Option<Slot>>,
    needed: Vec<bool>,
    /// Slots of operations that several nodes share: Euler derivatives, sine and cosine pairs, products.
    shared: HashMap<SharedKey, Slot>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum SharedKey {
    Euler(Slot),
    Circular(Slot),
    Hyperbolic(Slot),
    Square(Slot),
    Constant(u64, u64),
}

impl<'a> Lowering<'a> {
    fn new(graph: &'a ExpressionGraph, inputs: &[InputKind]) -> Self {
        let support = |kind: &InputKind| match *kind {
            InputKind::Variable => Support::Full,
            InputKind::HeadOnly => Support::Head,
            InputKind::LinearInTime => Support::Linear,
            InputKind::Bound(value) => Support::Number(value),
        };
        Self {
            graph,
            operations: vec![Operation::Input; inputs.len()],
            support: inputs.iter().map(support).collect(),
            slots: vec![None; graph.nodes().len()],
            needed: vec![false; graph.nodes().len()],
            shared: HashMap::new(),
        }
    }

    fn mark_needed(&mut self, outputs: &[NodeId]) {
        for output in outputs {
            self.needed[output.index()] = true;
        }
        for index in (0..self.needed.len()).rev() {
            if self.needed[index] {
                for operand in self.graph.nodes()[index].operands() {
                    self.needed[operand.index()] = true;
                }
            }
        }
    }

    fn lower_nodes(&mut self) {
        for index in 0..self.needed.len() {
            if self.needed[index] {
                self.slots[index] = Some(self.lower(self.graph.nodes()[index]));
            }
        }
    }

    fn slot_of(&self, node: NodeId) -> Slot {
        self.slots[node.index()].expect("operands are lowered before their users")
    }

    fn lower(&mut self, node: Node) -> Slot {
        match node {
            Node::Constant(value) => self.constant(value),
            Node::Input(input) => match self.support[input] {
                Support::Number(value) => self.constant(value),
                _ => input,
            },
            Node::Neg(a) => {
                let a = self.slot_of(a);
                self.neg(a)
            }
            Node::PowerInteger(a, exponent) => {
                let a = self.slot_of(a);
                self.power_integer(a, exponent)
            }
            Node::PowerReal(a, exponent) => {
                let a = self.slot_of(a);
                self.power_real(a, exponent)
            }
            Node::Unary(function, a) => {
                let a = self.slot_of(a);
                self.unary(function, a)
            }
            Node::Binary(function, a, b) => {
                let (a, b) = (self.slot_of(a), self.slot_of(b));
                self.binary(function, a, b)
            }
        }
    }

    fn push(&mut self, operation: Operation, support: Support) -> Slot {
        self.operations.push(operation);
        self.support.push(support);
        self.operations.len() - 1
    }

    fn shared(&mut self, key: SharedKey, build: impl FnOnce(&mut Self) -> Slot) -> Slot {
        if let Some(&slot) = self.shared.get(&key) {
            return slot;
        }
        let slot = build(self);
        self.shared.insert(key, slot);
        slot
    }

    fn number(&self, slot: Slot) -> Option<Dd> {
        match self.support[slot] {
            Support::Number(value) => Some(value),
            _ => None,
        }
    }

    /// Support of a function of these operands, numbers having been folded before.
    fn joint(&self, operands: &[Slot]) -> Support {
        let beyond_head = operands.iter().any(|&slot| self.support[slot].reaches(1));
        if beyond_head {
            Support::Full
        } else {
            Support::Head
        }
    }

    /// Support of a sum.
    fn joint_of_sum(&self, a: Slot, b: Slot) -> Support {
        let full = [a, b]
            .iter()
            .any(|&slot| self.support[slot] == Support::Full);
        let linear = [a, b]
            .iter()
            .any(|&slot| self.support[slot] == Support::Linear);
        match (full, linear) {
            (true, _) => Support::Full,
            (false, true) => Support::Linear,
            (false, false) => Support::Head,
        }
    }

    fn constant(&mut self, value: Dd) -> Slot {
        let key = SharedKey::Constant(value.hi.to_bits(), value.lo.to_bits());
        self.shared(key, |this| {
            this.push(Operation::Constant(value), Support::Number(value))
        })
    }

    fn euler(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::Euler(a), |this| {
            this.push(Operation::Euler(a), this.joint(&[a]))
        })
    }

    fn neg(&mut self, a: Slot) -> Slot {
        match self.number(a) {
            Some(value) => self.constant(-value),
            None => self.push(Operation::Neg(a), self.support[a]),
        }
    }

    fn binary(&mut self, function: Binary, a: Slot, b: Slot) -> Slot {
        match function {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            Binary::Div => self.div(a, b),
            Binary::Atan2 => self.atan2(a, b),
            Binary::Min => self.select(a, b, |this, mean, half_gap| this.sub(mean, half_gap)),
            Binary::Max => self.select(a, b, |this, mean, half_gap| this.add(mean, half_gap)),
        }
    }

    fn add(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a + b),
            (Some(value), None) => self.push(Operation::AddConstant(b, value), self.support[b]),
            (None, Some(value)) => self.push(Operation::AddConstant(a, value), self.support[a]),
            (None, None) => self.push(Operation::Add(a, b), self.joint_of_sum(a, b)),
        }
    }

    fn sub(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a - b),
            (None, Some(value)) => self.push(Operation::AddConstant(a, -value), self.support[a]),
            _ => self.push(Operation::Sub(a, b), self.joint_of_sum(a, b)),
        }
    }

    fn mul(&mut self, a: Slot, b: Slot) -> Slot {
        if a == b {
            return self.square(a);
        }
        match (self.support[a], self.support[b]) {
            (Support::Number(a), Support::Number(b)) => self.constant(a * b),
            (Support::Number(factor), _) => self.push(Operation::Scale(b, factor), self.support[b]),
            (_, Support::Number(factor)) => self.push(Operation::Scale(a, factor), self.support[a]),
            (Support::Head, support) => {
                self.push(Operation::MulByHead { head: a, factor: b }, support)
            }
            (support, Support::Head) => {
                self.push(Operation::MulByHead { head: b, factor: a }, support)
            }
            _ => self.push(Operation::Mul(a, b), Support::Full),
        }
    }

    fn square(&mut self, a: Slot) -> Slot {
        if let Some(value) = self.number(a) {
            return self.constant(value * value);
        }
        self.shared(SharedKey::Square(a), |this| {
            this.push(Operation::Mul(a, a), this.joint(&[a]))
        })
    }

    fn div(&mut self, a: Slot, b: Slot) -> Slot {
        match (self.number(a), self.number(b)) {
            (Some(a), Some(b)) => self.constant(a / b),
            (None, Some(b)) => self.mul_by_inverse(a, b),
            _ if self.support[b] == Support::Head && self.support[a].reaches(1) => {
                let one = self.constant(Dd::from(1.0));
                let inverse = self.push(Operation::Div(one, b), Support::Head);
                self.mul(a, inverse)
            }
            _ => self.push(Operation::Div(a, b), self.joint(&[a, b])),
        }
    }

    fn mul_by_inverse(&mut self, a: Slot, divisor: Dd) -> Slot {
        let inverse = self.constant(Dd::from(1.0) / divisor);
        self.mul(a, inverse)
    }

    fn power_integer(&mut self, a: Slot, exponent: i32) -> Slot {
        let mut rest = exponent.unsigned_abs();
        let (mut square, mut result) = (a, None);
        while rest > 0 {
            if rest & 1 == 1 {
                result = Some(result.map_or(square, |result| self.mul(result, square)));
            }
            rest >>= 1;
            if rest > 0 {
                square = self.square(square);
            }
        }
        let one = self.constant(Dd::from(1.0));
        let power = result.unwrap_or(one);
        if exponent < 0 {
            self.div(one, power)
        } else {
            power
        }
    }

    fn power_real(&mut self, a: Slot, exponent: Dd) -> Slot {
        let euler_a = self.euler(a);
        let euler_u = self.operations.len() + 1;
        let u = self.push(
            Operation::Power {
                a,
                exponent,
                euler_a,
                euler_u,
            },
            self.joint(&[a]),
        );
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    fn unary(&mut self, function: Unary, a: Slot) -> Slot {
        match function {
            Unary::Sqrt => self.push(Operation::Sqrt(a), self.joint(&[a])),
            Unary::Exp => {
                let euler_a = self.euler(a);
                self.push(Operation::Exp { a, euler_a }, self.joint(&[a]))
            }
            Unary::Log => self.primitive(HeadFunction::Log, a, a),
            Unary::Sin => self.circular(a),
            Unary::Cos => self.circular(a) + 1,
            Unary::Tan => {
                let sine = self.circular(a);
                self.div(sine, sine + 1)
            }
            Unary::Asin => {
                let w = self.cathetus(a);
                self.primitive(HeadFunction::Asin, a, w)
            }
            Unary::Acos => {
                let w = self.cathetus(a);
                let w = self.neg(w);
                self.primitive(HeadFunction::Acos, a, w)
            }
            Unary::Atan => {
                let square = self.square(a);
                let one = self.constant(Dd::from(1.0));
                let w = self.add(one, square);
                self.primitive(HeadFunction::Atan, a, w)
            }
            Unary::Sinh => self.hyperbolic(a),
            Unary::Cosh => self.hyperbolic(a) + 1,
            Unary::Tanh => {
                let sinh = self.hyperbolic(a);
                self.div(sinh, sinh + 1)
            }
            Unary::Abs => self.push(Operation::SignTimes { a, b: a }, self.joint(&[a])),
            Unary::Sign => self.push(Operation::Sign(a), Support::Head),
        }
    }

    /// `√(1 − a²)`.
    fn cathetus(&mut self, a: Slot) -> Slot {
        let square = self.square(a);
        let one = self.constant(Dd::from(1.0));
        let difference = self.sub(one, square);
        self.push(Operation::Sqrt(difference), self.joint(&[difference]))
    }

    fn primitive(&mut self, function: HeadFunction, a: Slot, w: Slot) -> Slot {
        let euler_u = self.operations.len() + 1;
        let u = self.push(
            Operation::Primitive {
                function,
                a,
                w,
                euler_u,
            },
            self.joint(&[a]),
        );
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    /// The sine; the cosine is the slot after it.
    fn circular(&mut self, a: Slot) -> Slot {
        if self.support[a] == Support::Linear {
            return self.circular_of_phase(a);
        }
        let euler_a = self.euler(a);
        self.shared(SharedKey::Circular(a), |this| {
            let (sine, support) = (this.operations.len(), this.joint(&[a]));
            this.push(
                Operation::Sine {
                    a,
                    euler_a,
                    cosine: sine + 1,
                },
                support,
            );
            this.push(Operation::Cosine { a, euler_a, sine }, support);
            sine
        })
    }

    /// The sine of a slot linear in time; the cosine is the slot after it.
    fn circular_of_phase(&mut self, a: Slot) -> Slot {
        self.shared(SharedKey::Circular(a), |this| {
            let sine = this.operations.len();
            this.push(
                Operation::OfPhase {
                    function: HeadFunction::Sin,
                    a,
                    partner: sine + 1,
                },
                Support::Full,
            );
            this.push(
                Operation::OfPhase {
                    function: HeadFunction::Cos,
                    a,
                    partner: sine,
                },
                Support::Full,
            );
            sine
        })
    }

    /// The hyperbolic sine; the cosine is the slot after it.
    fn hyperbolic(&mut self, a: Slot) -> Slot {
        let euler_a = self.euler(a);
        self.shared(SharedKey::Hyperbolic(a), |this| {
            let (sinh, support) = (this.operations.len(), this.joint(&[a]));
            this.push(
                Operation::Sinh {
                    a,
                    euler_a,
                    cosh: sinh + 1,
                },
                support,
            );
            this.push(Operation::Cosh { a, euler_a, sinh }, support);
            sinh
        })
    }

    fn atan2(&mut self, y: Slot, x: Slot) -> Slot {
        let (euler_y, euler_x) = (self.euler(y), self.euler(x));
        let (y_square, x_square) = (self.square(y), self.square(x));
        let w = self.add(y_square, x_square);
        let euler_u = self.operations.len() + 1;
        let u = self.push(
            Operation::Atan2 {
                y,
                x,
                euler_y,
                euler_x,
                w,
                euler_u,
            },
            self.joint(&[y, x]),
        );
        self.push(Operation::Euler(u), self.joint(&[u]));
        u
    }

    /// `min` and `max` from `(a + b)/2` and `|a − b|/2`.
    fn select(
        &mut self,
        a: Slot,
        b: Slot,
        combine: impl FnOnce(&mut Self, Slot, Slot) -> Slot,
    ) -> Slot {
        let half = self.constant(Dd::from(0.5));
        let (sum, gap) = (self.add(a, b), self.sub(a, b));
        let (mean, half_gap) = (self.mul(sum, half), self.mul(gap, half));
        let size = self.unary(Unary::Abs, half_gap);
        combine(self, mean, size)
    }
}
