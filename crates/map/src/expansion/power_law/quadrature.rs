//! Integrals of `u^α A(u)` with an analytic `A`, from values of `A` at the nodes of Chebyshev.
//!
//! ```text
//! ∫_0^u u'^α A(u') du' = u^{α+1} C(u),    (1 + α + u d/du) C = A
//! ```
//!
//! `C` is as analytic as `A`, whatever the exponent: the equation is solved at the nodes.

use nalgebra::{DMatrix, DVector};

use crate::numeric::linear::inverse;
use crate::numeric::{Dd, NumericError, Real, Scalar};

/// Nodes on `(0, length)`, the zeros of a polynomial of Chebyshev.
pub(super) struct Nodes<S: Scalar> {
    /// The nodes.
    pub(super) at: Vec<S>,
    /// End of the interval.
    length: S,
    /// Row that interpolates from the nodes to the end of the interval.
    end: DVector<S>,
    /// Matrix of `u d/du` at the nodes.
    euler: DMatrix<S>,
}

impl<S: Real> Nodes<S> {
    /// A number of nodes on `(0, length)`.
    pub(super) fn new(count: usize, length: S) -> Self {
        let angle = |node: usize| {
            let odd = Dd::from_f64((2 * node + 1) as f64);
            S::from_dd(odd * Dd::PI / Dd::from_f64((2 * count) as f64))
        };
        let half = S::from_f64(0.5);
        // The node is sin² and its distance from the end cos² of half the angle.
        let halves: Vec<(S, S)> = (0..count).map(|node| (angle(node) * half).sin_cos()).collect();
        let unit: Vec<S> = halves.iter().map(|&(sine, _)| sine * sine).collect();
        // Weights of the barycentric formula.
        let weights: Vec<S> = (0..count)
            .map(|node| {
                let (sine, _) = angle(node).sin_cos();
                if node % 2 == 0 { sine } else { -sine }
            })
            .collect();
        let shares = halves.iter().zip(&weights);
        let shares = shares.map(|(&(_, cosine), &weight)| weight / (cosine * cosine));
        let shares: Vec<S> = shares.collect();
        let sum = shares.iter().fold(S::zero(), |sum, &share| sum + share);
        let mut euler = DMatrix::from_fn(count, count, |row, column| match row == column {
            true => S::zero(),
            false => unit[row] * weights[column] / (weights[row] * (unit[row] - unit[column])),
        });
        for row in 0..count {
            let others = (0..count).map(|column| euler[(row, column)]);
            euler[(row, row)] = -others.fold(S::zero(), |sum, value| sum + value);
        }
        Self {
            at: unit.iter().map(|&at| at * length).collect(),
            length,
            end: DVector::from_iterator(count, shares.into_iter().map(|share| share / sum)),
            euler,
        }
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.at.len()
    }

    /// Integrals with the factor `u^exponent`.
    ///
    /// # Errors
    ///
    /// [`NumericError`] if the exponent is not above −1, so that the equation has no solution.
    pub(super) fn integrals(&self, exponent: S) -> Result<Integrals<S>, NumericError> {
        let count = self.len();
        let mut equation = self.euler.clone();
        for node in 0..count {
            equation[(node, node)] += S::one() + exponent;
        }
        let solution = inverse(&equation)?;
        let at = |node: usize| self.at[node];
        let primitive =
            DMatrix::from_fn(count, count, |row, column| at(row) * solution[(row, column)]);
        let moment = DMatrix::from_fn(count, count, |row, column| {
            solution[(row, column)] * (at(row) - at(column))
        });
        let power = if exponent == S::zero() { S::one() } else { self.length.powf(exponent) };
        let to_end = |matrix: &DMatrix<S>, factor: S| {
            DVector::from_fn(count, |column, _| {
                let terms = (0..count).map(|row| self.end[row] * matrix[(row, column)]);
                terms.fold(S::zero(), |sum, term| sum + term) * factor
            })
        };
        let total = to_end(&solution, self.length * power);
        let first = DVector::from_fn(count, |column, _| total[column] * at(column));
        let moment_at_end = DVector::from_fn(count, |column, _| {
            (total[column] * self.length - first[column]) / self.length
        });
        Ok(Integrals { primitive, moment, total, first, moment_at_end })
    }
}

/// Integrals with a factor `u^α`, as matrices and rows on the values of `A` at the nodes.
pub(super) struct Integrals<S: Scalar> {
    /// `u^{−α} ∫_0^u u'^α A du'` at each node.
    pub(super) primitive: DMatrix<S>,
    /// `u^{−α−1} ∫_0^u (u − u') u'^α A du'` at each node.
    pub(super) moment: DMatrix<S>,
    /// `∫ u^α A du` over the interval.
    pub(super) total: DVector<S>,
    /// `∫ u · u^α A du` over the interval.
    pub(super) first: DVector<S>,
    /// `(1/ℓ) ∫ (ℓ − u) u^α A du` over the interval of length `ℓ`.
    pub(super) moment_at_end: DVector<S>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `∫ u^α cos u du` by its series in powers of `u`.
    fn series(exponent: f64, extra: u32, to: Dd) -> Dd {
        let mut sum = Dd::ZERO;
        let mut term = Dd::from_f64(1.0);
        for k in 0..40 {
            let power = Dd::from_f64(f64::from(2 * k + extra) + 1.0) + Dd::from_f64(exponent);
            sum += term * to.powf(power) / power;
            term = -term / Dd::from_f64(f64::from((2 * k + 1) * (2 * k + 2)));
        }
        sum
    }

    #[test]
    fn integrals_with_a_power_are_exact_to_rounding() {
        let length = Dd::from_f64(0.5);
        let nodes = Nodes::<Dd>::new(24, length);
        let cosine: Vec<Dd> = nodes.at.iter().map(|at| at.sin_cos().1).collect();
        for exponent in [0.0, 1.5, 2.2, 7.4, 0.25] {
            let found = nodes.integrals(Dd::from_f64(exponent)).unwrap();
            let row = |row: &DVector<Dd>| {
                row.iter().zip(&cosine).fold(Dd::ZERO, |sum, (&a, &b)| sum + a * b)
            };
            let close = |found: Dd, expected: Dd| {
                let error = (found - expected).magnitude() / expected.magnitude();
                assert!(error < 1e-28, "{exponent}: {error:e}");
            };
            close(row(&found.total), series(exponent, 0, length));
            close(row(&found.first), series(exponent, 1, length));
            let (node, at) = (9, nodes.at[9]);
            let primitive = found.primitive.row(node).transpose();
            close(row(&primitive) * at.powf(Dd::from_f64(exponent)), series(exponent, 0, at));
            let moment = found.moment.row(node).transpose();
            let expected = at * series(exponent, 0, at) - series(exponent, 1, at);
            close(row(&moment) * at.powf(Dd::from_f64(exponent + 1.0)), expected);
        }
    }
}
