//! Values that carry their derivatives along: forward differentiation of a flown contact.

use crate::expansion::Arithmetic;
use crate::jet::Jet;

/// The arithmetic of values with derivatives by a number of variables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangents {
    directions: usize,
}

/// A value and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tangent {
    /// The value.
    pub(super) value: f64,
    /// Its derivatives.
    pub(super) tangent: Vec<f64>,
}

impl Tangents {
    /// Derivatives by this many variables.
    pub(super) fn new(directions: usize) -> Self {
        Self { directions }
    }

    /// A point whose first components are the variables.
    pub(super) fn variables(&self, point: &[f64]) -> Vec<Tangent> {
        let variable = |(number, &value): (usize, &f64)| {
            let unit = |direction: usize| if direction == number { 1.0 } else { 0.0 };
            let tangent = (0..self.directions).map(unit).collect();
            Tangent { value, tangent }
        };
        point.iter().enumerate().map(variable).collect()
    }

    fn combined(&self, value: f64, parts: &[(f64, &Tangent)]) -> Tangent {
        let along = |direction: usize| {
            let parts = parts.iter();
            parts
                .map(|(factor, part)| factor * part.tangent[direction])
                .sum()
        };
        let tangent = (0..self.directions).map(along).collect();
        Tangent { value, tangent }
    }
}

impl Arithmetic for Tangents {
    type Scalar = f64;
    type Value = Tangent;

    fn constant(&mut self, value: f64) -> Tangent {
        self.combined(value, &[])
    }

    fn add(&mut self, a: &Tangent, b: &Tangent) -> Tangent {
        self.combined(a.value + b.value, &[(1.0, a), (1.0, b)])
    }

    fn multiply(&mut self, a: &Tangent, b: &Tangent) -> Tangent {
        self.combined(a.value * b.value, &[(b.value, a), (a.value, b)])
    }

    fn multiply_add(&mut self, a: &Tangent, b: &Tangent, c: &Tangent) -> Tangent {
        let value = a.value * b.value + c.value;
        self.combined(value, &[(b.value, a), (a.value, b), (1.0, c)])
    }

    fn root_of_positive_part(&mut self, a: &Tangent) -> Tangent {
        let value = a.value.max(0.0).sqrt();
        let slope = if value > 0.0 { 0.5 / value } else { 0.0 };
        self.combined(value, &[(slope, a)])
    }

    fn half_reciprocal(&mut self, a: &Tangent) -> Tangent {
        let value = if a.value > 0.0 { 0.5 / a.value } else { 0.0 };
        self.combined(value, &[(-2.0 * value * value, a)])
    }

    fn held(&mut self, a: &Tangent) -> Tangent {
        self.constant(a.value)
    }

    fn polynomial(&mut self, jet: &Jet<f64>, point: &[Tangent]) -> Tangent {
        let values: Vec<f64> = point.iter().map(|value| value.value).collect();
        let mut gradient = vec![0.0; values.len()];
        let value = jet.evaluate_with_gradient(&values, &mut gradient);
        let parts: Vec<_> = gradient.into_iter().zip(point).collect();
        self.combined(value, &parts)
    }
}
