//! The operations of a program: one recurrence each.

use crate::jet::elementary::{
    atan2_part, exponential_part, power_part, primitive_part, product_part, quotient_part,
    sech_squared_part, sqrt_part,
};
use crate::jet::{Graded, HeadFunction, Span};
use crate::numeric::{Dd, Scalar};

/// Slot of the tape.
pub(in crate::flow) type Slot = usize;

/// One recurrence. Operands named `euler_*` are slots of Euler derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::flow) enum Operation {
    Input,
    Constant(Dd),
    Euler(Slot),
    Add(Slot, Slot),
    Sub(Slot, Slot),
    Neg(Slot),
    Scale(Slot, Dd),
    AddConstant(Slot, Dd),
    /// Product with a slot of which only the head is nonzero.
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
    /// Sine or cosine of a slot linear in time; `partner` is the slot of the other.
    OfPhase {
        function: HeadFunction,
        a: Slot,
        partner: Slot,
    },
    /// A function whose derivative with respect to its argument is the partner, or minus the
    /// partner: the sine and the cosine are each other's, as are those of the hyperbola.
    Function {
        function: HeadFunction,
        a: Slot,
        euler_a: Slot,
        partner: Slot,
    },
    /// Derivative `1/cosh² a` of the hyperbolic tangent `tanh`.
    SechSquared {
        a: Slot,
        tanh: Slot,
    },
    Primitive {
        function: HeadFunction,
        a: Slot,
        b: Slot,
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
    /// `sign(head of a) · b`, with constant sign: `abs` and the corners of `min` and `max`.
    SignTimes {
        a: Slot,
        b: Slot,
    },
    /// The sign of the head, a constant.
    Sign(Slot),
    /// A number that prevents overflow and underflow of the squares of two heads.
    Balance(Slot, Slot),
}

/// Runs one operation at one degree: reads the tape, writes the part to `out`.
///
/// The tape may end within an element whose higher parts are not read.
#[inline(always)]
pub(in crate::flow) fn run<S: Scalar, A: Graded<S>>(
    operation: &Operation,
    slot: Slot,
    algebra: &A,
    k: usize,
    len: usize,
    tape: &[S],
    out: &mut [S],
) {
    let range = algebra.part(k);
    let element = |slot: Slot| &tape[slot * len..((slot + 1) * len).min(tape.len())];
    let part = |slot: Slot| &tape[slot * len + range.start..slot * len + range.end];
    // NOTE: functions with a partner share one call, which is inlined with its convolution.
    let (function, a, euler_a, partner) = match *operation {
        Operation::Exp { a, euler_a } => (HeadFunction::Exp, a, euler_a, slot),
        Operation::Function { function, a, euler_a, partner } => (function, a, euler_a, partner),
        Operation::Input => return out.copy_from_slice(part(slot)),
        Operation::Constant(value) => return constant_part(k, S::from_dd(value), out),
        Operation::Euler(a) => return map(part(a), out, |a| a * S::from_f64(k as f64)),
        Operation::Add(a, b) => return zip(part(a), part(b), out, |a, b| a + b),
        Operation::Sub(a, b) => return zip(part(a), part(b), out, |a, b| a - b),
        Operation::Neg(a) => return map(part(a), out, |a| -a),
        Operation::Scale(a, factor) => {
            let factor = S::from_dd(factor);
            return map(part(a), out, |a| a * factor);
        }
        Operation::AddConstant(a, value) => {
            out.copy_from_slice(part(a));
            if k == 0 {
                out[0] += S::from_dd(value);
            }
            return;
        }
        Operation::MulByHead { head, factor } => {
            out.fill(S::zero());
            return algebra.multiply_by_head(k, element(head), part(factor), out);
        }
        Operation::Mul(a, b) => return product_part(algebra, k, element(a), element(b), out),
        Operation::Div(a, b) => {
            return quotient_part(algebra, k, element(a), element(b), element(slot), out);
        }
        Operation::Sqrt(a) => return sqrt_part(algebra, k, element(a), element(slot), out),
        Operation::OfPhase { function, a, partner } => {
            return phase_part(algebra, function, k, element(a), element(partner), out);
        }
        Operation::SechSquared { a, tanh } => {
            return sech_squared_part(algebra, k, element(a), element(tanh), out);
        }
        Operation::Primitive { function, a, b, w, euler_u } => {
            let (arguments, w) = ((element(a), element(b)), element(w));
            return primitive_part(algebra, function, k, arguments, w, element(euler_u), out);
        }
        Operation::Power { a, exponent, euler_a, euler_u } => {
            let (exponent, u) = (S::from_dd(exponent), element(slot));
            let (a, euler_a, euler_u) = (element(a), element(euler_a), element(euler_u));
            return power_part(algebra, exponent, k, a, euler_a, u, euler_u, out);
        }
        Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u } => {
            let (y, x, ey, ex) = (element(y), element(x), element(euler_y), element(euler_x));
            return atan2_part(algebra, k, y, x, ey, ex, element(w), element(euler_u), out);
        }
        Operation::SignTimes { a, b } => {
            let sign = element(a)[0].signum();
            return map(part(b), out, |b| sign * b);
        }
        Operation::Sign(a) => return constant_part(k, element(a)[0].signum(), out),
        Operation::Balance(a, b) => {
            return constant_part(k, element(a)[0].balance(element(b)[0]), out);
        }
    };
    let (a, euler_a, partner) = (element(a), element(euler_a), element(partner));
    exponential_part(algebra, function, k, a, euler_a, partner, out);
}

/// Part of degree `k` of `u = sin a` or `cos a` for `a = a_0 + a_1`, where `c` is the other of the
/// two:
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
    let sign = if function == HeadFunction::Cos { -1.0 } else { 1.0 };
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

impl Operation {
    /// Slots of which a recurrence reads parts of lower degree too; none for linear operations.
    pub(in crate::flow) fn history(&self, slot: Slot) -> Vec<Slot> {
        match *self {
            Operation::Mul(a, b) => vec![a, b],
            Operation::MulByHead { head, factor } => vec![head, factor],
            Operation::Div(a, b) => vec![a, b, slot],
            Operation::Sqrt(a) => vec![a, slot],
            Operation::Exp { a, euler_a } => vec![a, euler_a, slot],
            Operation::Function { a, euler_a, partner, .. } => vec![a, euler_a, partner],
            Operation::SechSquared { a, tanh } => vec![a, tanh],
            Operation::OfPhase { a, partner, .. } => vec![a, partner],
            Operation::Primitive { a, b, w, euler_u, .. } => vec![a, b, w, euler_u],
            Operation::Power { a, euler_a, euler_u, .. } => vec![a, euler_a, euler_u, slot],
            Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u } => {
                vec![y, x, euler_y, euler_x, w, euler_u]
            }
            Operation::SignTimes { a, .. } => vec![a],
            Operation::Sign(_)
            | Operation::Balance(..)
            | Operation::Input
            | Operation::Constant(_)
            | Operation::Euler(_)
            | Operation::Add(..)
            | Operation::Sub(..)
            | Operation::Neg(_)
            | Operation::Scale(..)
            | Operation::AddConstant(..) => Vec::new(),
        }
    }

    /// The operation on renamed slots.
    pub(in crate::flow) fn renamed(mut self, name: impl Fn(Slot) -> Slot) -> Self {
        for slot in self.slots_mut().into_iter().flatten().flatten() {
            *slot = name(*slot);
        }
        self
    }

    /// Slots that an operation reads, except its own.
    pub(in crate::flow) fn operands(&self) -> impl Iterator<Item = Slot> + use<> {
        let [operands, _] = self.slots();
        operands.into_iter().flatten()
    }

    /// All slots that an operation reads, including those that are computed after it.
    pub(in crate::flow) fn reads(&self) -> impl Iterator<Item = Slot> + use<> {
        self.slots().into_iter().flatten().flatten()
    }

    fn slots(mut self) -> [[Option<Slot>; 3]; 2] {
        self.slots_mut().map(|slots| slots.map(|slot| slot.copied()))
    }

    /// Slots that an operation reads: its operands, then slots that are computed with it or after
    /// it.
    fn slots_mut(&mut self) -> [[Option<&mut Slot>; 3]; 2] {
        let none = || [const { None }; 3];
        match self {
            Operation::Input | Operation::Constant(_) => [none(), none()],
            Operation::Euler(a)
            | Operation::Neg(a)
            | Operation::Scale(a, _)
            | Operation::AddConstant(a, _)
            | Operation::Sqrt(a)
            | Operation::Sign(a) => [[Some(a), None, None], none()],
            Operation::Add(a, b)
            | Operation::Sub(a, b)
            | Operation::Mul(a, b)
            | Operation::Div(a, b)
            | Operation::MulByHead { head: a, factor: b }
            | Operation::Balance(a, b)
            | Operation::SechSquared { a, tanh: b }
            | Operation::SignTimes { a, b } => [[Some(a), Some(b), None], none()],
            Operation::Exp { a, euler_a: partner } | Operation::OfPhase { a, partner, .. } => {
                [[Some(a), None, None], [Some(partner), None, None]]
            }
            Operation::Function { a, euler_a, partner, .. }
            | Operation::Power { a, euler_a, euler_u: partner, .. } => {
                [[Some(a), None, None], [Some(euler_a), Some(partner), None]]
            }
            Operation::Primitive { a, b, w, euler_u, .. } => {
                [[Some(a), Some(b), Some(w)], [Some(euler_u), None, None]]
            }
            Operation::Atan2 { y, x, euler_y, euler_x, w, euler_u } => {
                [[Some(y), Some(x), Some(w)], [Some(euler_y), Some(euler_x), Some(euler_u)]]
            }
        }
    }

    /// Factors and terms of a product, if the part is a single product, possibly scaled.
    pub(in crate::flow) fn product(&self, slot: Slot) -> Option<(Slot, Slot, Span)> {
        match *self {
            Operation::Mul(a, b) => Some((a, b, Span::Full)),
            Operation::Div(_, b) => Some((b, slot, Span::WithoutFirst)),
            Operation::Function {
                function: HeadFunction::Sin | HeadFunction::Cos,
                euler_a,
                partner,
                ..
            } => Some((euler_a, partner, Span::WithoutFirst)),
            _ => None,
        }
    }

    /// Highest degree, up to an order, of a part that can be nonzero, from the highest degrees of
    /// the slots it reads.
    pub(in crate::flow) fn highest_degree(
        &self,
        order: usize,
        of: impl Fn(Slot) -> usize,
    ) -> usize {
        match *self {
            Operation::Constant(_) | Operation::Sign(_) | Operation::Balance(..) => 0,
            Operation::Euler(a)
            | Operation::Neg(a)
            | Operation::Scale(a, _)
            | Operation::AddConstant(a, _)
            | Operation::MulByHead { factor: a, .. }
            | Operation::SignTimes { b: a, .. } => of(a),
            Operation::Add(a, b) | Operation::Sub(a, b) => of(a).max(of(b)),
            Operation::Mul(a, b) => (of(a) + of(b)).min(order),
            _ if self.operands().all(|operand| of(operand) == 0) => 0,
            _ => order,
        }
    }
}
