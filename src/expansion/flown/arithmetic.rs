//! The operations a flown contact is made of, on whatever carries them.

use std::marker::PhantomData;

use crate::jet::Jet;
use crate::numeric::{Real, Scalar};

/// What a flown contact is computed with: numbers, values with tangents, or the operations of a
/// kernel.
///
/// One sequence of operations is written once and run on all of them, so that the map read off its
/// coefficients, the kernel and the emitted code do the same.
pub trait Arithmetic {
    /// The numbers of the coefficients.
    type Scalar: Scalar;
    /// A value.
    type Value: Clone;

    /// A constant.
    fn constant(&mut self, value: Self::Scalar) -> Self::Value;
    /// `a + b`.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// `a b`.
    fn multiply(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// `a b + c`.
    fn multiply_add(&mut self, a: &Self::Value, b: &Self::Value, c: &Self::Value) -> Self::Value;
    /// `√max(0, a)`.
    fn root_of_positive_part(&mut self, a: &Self::Value) -> Self::Value;
    /// `1/(2a)`, and 0 where `a` is not positive.
    fn half_reciprocal(&mut self, a: &Self::Value) -> Self::Value;
    /// `a`, a constant to differentiation: a choice on which no result depends.
    fn held(&mut self, a: &Self::Value) -> Self::Value;
    /// A polynomial at a point.
    fn polynomial(&mut self, jet: &Jet<Self::Scalar>, point: &[Self::Value]) -> Self::Value;
}

/// Plain numbers.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<S>(PhantomData<S>);

impl<S: Real> Numbers<S> {
    /// Plain numbers.
    pub fn new() -> Self {
        Self(PhantomData)
    }
}

impl<S: Real> Default for Numbers<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: Real> Arithmetic for Numbers<S> {
    type Scalar = S;
    type Value = S;

    fn constant(&mut self, value: S) -> S {
        value
    }

    fn add(&mut self, a: &S, b: &S) -> S {
        *a + *b
    }

    fn multiply(&mut self, a: &S, b: &S) -> S {
        *a * *b
    }

    fn multiply_add(&mut self, a: &S, b: &S, c: &S) -> S {
        a.mul_add(*b, *c)
    }

    fn root_of_positive_part(&mut self, a: &S) -> S {
        if *a > S::zero() { a.sqrt() } else { S::zero() }
    }

    fn half_reciprocal(&mut self, a: &S) -> S {
        if *a > S::zero() {
            S::from_f64(0.5) / *a
        } else {
            S::zero()
        }
    }

    fn held(&mut self, a: &S) -> S {
        *a
    }

    fn polynomial(&mut self, jet: &Jet<S>, point: &[S]) -> S {
        jet.evaluate(point)
    }
}
