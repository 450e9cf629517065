//! The arithmetic of values with derivatives by a number of variables.

use std::marker::PhantomData;

use crate::expansion::Arithmetic;
use crate::jet::Jet;
use crate::numeric::Real;

/// The arithmetic of values with derivatives by a number of variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangents<S = f64> {
    directions: usize,
    scalar: PhantomData<S>,
}

/// A value and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tangent<S = f64> {
    /// The value.
    pub(crate) value: S,
    /// Its derivatives.
    pub(crate) tangent: Vec<S>,
}

impl<S: Real> Tangents<S> {
    /// Derivatives by this many variables.
    pub(crate) fn new(directions: usize) -> Self {
        Self { directions, scalar: PhantomData }
    }

    /// A point whose first components are the variables.
    pub(crate) fn variables(&self, point: &[S]) -> Vec<Tangent<S>> {
        point.iter().enumerate().map(|(number, &value)| self.variable(number, value)).collect()
    }

    /// One variable, by its number; a constant where there are not so many.
    pub(crate) fn variable(&self, number: usize, value: S) -> Tangent<S> {
        let unit = |direction: usize| if direction == number { S::one() } else { S::zero() };
        Tangent { value, tangent: (0..self.directions).map(unit).collect() }
    }

    fn combined(&self, value: S, parts: &[(S, &Tangent<S>)]) -> Tangent<S> {
        let along = |direction: usize| {
            let parts = parts.iter();
            parts.map(|(factor, part)| *factor * part.tangent[direction]).sum()
        };
        let tangent = (0..self.directions).map(along).collect();
        Tangent { value, tangent }
    }
}

impl<S: Real> Arithmetic for Tangents<S> {
    type Scalar = S;
    type Value = Tangent<S>;

    fn constant(&mut self, value: S) -> Tangent<S> {
        self.combined(value, &[])
    }

    fn add(&mut self, a: &Tangent<S>, b: &Tangent<S>) -> Tangent<S> {
        self.combined(a.value + b.value, &[(S::one(), a), (S::one(), b)])
    }

    fn multiply(&mut self, a: &Tangent<S>, b: &Tangent<S>) -> Tangent<S> {
        self.combined(a.value * b.value, &[(b.value, a), (a.value, b)])
    }

    fn multiply_add(&mut self, a: &Tangent<S>, b: &Tangent<S>, c: &Tangent<S>) -> Tangent<S> {
        let value = a.value * b.value + c.value;
        self.combined(value, &[(b.value, a), (a.value, b), (S::one(), c)])
    }

    fn root_of_positive_part(&mut self, a: &Tangent<S>) -> Tangent<S> {
        let value = a.value.max(S::zero()).sqrt();
        let slope = if value > S::zero() { S::from_f64(0.5) / value } else { S::zero() };
        self.combined(value, &[(slope, a)])
    }

    fn half_reciprocal(&mut self, a: &Tangent<S>) -> Tangent<S> {
        let half = S::from_f64(0.5);
        let value = if a.value > S::zero() { half / a.value } else { S::zero() };
        self.combined(value, &[(S::from_f64(-2.0) * value * value, a)])
    }

    fn held(&mut self, a: &Tangent<S>) -> Tangent<S> {
        self.constant(a.value)
    }

    fn polynomial(&mut self, jet: &Jet<S>, point: &[Tangent<S>]) -> Tangent<S> {
        let values: Vec<S> = point.iter().map(|value| value.value).collect();
        let mut gradient = vec![S::zero(); values.len()];
        let value = jet.evaluate_with_gradient(&values, &mut gradient);
        let parts: Vec<_> = gradient.into_iter().zip(point).collect();
        self.combined(value, &parts)
    }
}
