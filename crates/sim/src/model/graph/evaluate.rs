//! The plain interpreter of an [`ExpressionGraph`]: one value per node, over any [`Scalar`].

use super::{Binary, ExpressionGraph, Node, Unary};
use crate::numeric::{Dd, Scalar};

impl ExpressionGraph {
    /// Fills `values` with the value of every node at `inputs` (full state, then parameters).
    ///
    /// Functions outside their domain give NaN, as in [`Scalar`].
    ///
    /// # Panics
    ///
    /// If `inputs` is shorter than the largest input number of the graph.
    pub fn evaluate<S: Scalar>(&self, inputs: &[S], values: &mut Vec<S>) {
        values.clear();
        values.reserve(self.nodes.len());
        for node in &self.nodes {
            let value = match *node {
                Node::Constant(value) => S::from_dd(value),
                Node::Input(input) => inputs[input],
                Node::Neg(a) => -values[a.index()],
                Node::PowerInteger(a, exponent) => power(values[a.index()], exponent),
                Node::PowerReal(a, exponent) => values[a.index()].powf(S::from_dd(exponent)),
                Node::Unary(function, a) => unary(function, values[a.index()]),
                Node::Binary(function, a, b) => {
                    binary(function, values[a.index()], values[b.index()])
                }
            };
            values.push(value);
        }
    }
}

/// `aⁿ` by repeated squaring; a negative exponent is the reciprocal of the positive one.
pub(super) fn power<S: Scalar>(base: S, exponent: i32) -> S {
    let mut result = S::one();
    let mut square = base;
    let mut remaining = exponent.unsigned_abs();
    while remaining > 0 {
        if remaining & 1 == 1 {
            result *= square;
        }
        remaining >>= 1;
        if remaining > 0 {
            square = square * square;
        }
    }
    if exponent < 0 {
        S::one() / result
    } else {
        result
    }
}

/// A function of one argument.
pub(super) fn unary<S: Scalar>(function: Unary, a: S) -> S {
    match function {
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Log => a.ln(),
        Unary::Sin => a.sin_cos().0,
        Unary::Cos => a.sin_cos().1,
        Unary::Tan => {
            let (sine, cosine) = a.sin_cos();
            sine / cosine
        }
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh_cosh().0,
        Unary::Cosh => a.sinh_cosh().1,
        Unary::Tanh => tanh(a),
        Unary::Abs => a.abs(),
        Unary::Sign => a.signum(),
    }
}

/// Hyperbolic tangent; the argument is limited to where it is ±1 to every digit, so that nothing
/// overflows.
fn tanh<S: Scalar>(a: S) -> S {
    let limit = S::from_dd(Dd { hi: 300.0, lo: 0.0 });
    let (sine, cosine) = a.max(-limit).min(limit).sinh_cosh();
    sine / cosine
}

/// A function of two arguments.
pub(super) fn binary<S: Scalar>(function: Binary, a: S, b: S) -> S {
    match function {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Atan2 => a.atan2(b),
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
    }
}
