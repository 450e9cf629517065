//! Gauss' collocation on one element: nodes, weights, integration matrix, highest Legendre modes.

use std::sync::LazyLock;

use crate::numeric::{Dd, Lanes};

/// Number of collocation nodes of an element.
pub(super) const NODES: usize = 16;

/// Values at the nodes of an element.
pub(super) type NodeValues = Lanes<NODES>;

/// Gauss-Legendre collocation on `[0, 1]`.
pub(super) struct Gauss {
    /// The nodes `c_i`, increasing.
    pub(super) nodes: [f64; NODES],
    /// The weights `b_i`: `∫_0^1 f = Σ_i b_i f(c_i)` up to degree 31.
    pub(super) weights: NodeValues,
    /// Columns of `A_ij = ∫_0^{c_i} ℓ_j`, with `ℓ_j` the Lagrange polynomials of the nodes.
    pub(super) integration: [NodeValues; NODES],
    /// Row vectors that give the coefficients of the Legendre polynomials of degree 14 and 15.
    pub(super) last_modes: [NodeValues; 2],
}

/// The scheme, computed in double-double once and rounded.
pub(super) static GAUSS: LazyLock<Gauss> = LazyLock::new(Gauss::new);

impl Gauss {
    fn new() -> Self {
        let roots: [Dd; NODES] = std::array::from_fn(root);
        let legendre = roots.map(legendre);
        let weights: [Dd; NODES] = std::array::from_fn(|i| {
            let slope = legendre_slope(roots[i]);
            Dd::from(2.0) / ((Dd::ONE - roots[i] * roots[i]) * slope * slope)
        });
        let half = Dd::from(0.5);
        let entry = |i: usize, j: usize| {
            // ℓ_j = Σ_m (2m + 1)/2 w_j P_m(ξ_j) P_m and (2m + 1) ∫_{−1}^x P_m = P_{m+1}(x) − P_{m−1}(x).
            let mode = |m: usize| {
                let primitive = match m {
                    0 => roots[i] + Dd::ONE,
                    _ => legendre[i][m + 1] - legendre[i][m - 1],
                };
                legendre[j][m] * primitive
            };
            let sum = (0..NODES).map(mode).fold(Dd::ZERO, |sum, term| sum + term);
            (weights[j] * sum * half * half).to_f64()
        };
        let mode = |m: usize| {
            let norm = Dd::from(m as f64 + 0.5);
            Lanes::from_fn(|i| (weights[i] * legendre[i][m] * norm).to_f64())
        };
        Self {
            nodes: roots.map(|root| ((root + Dd::ONE) * half).to_f64()),
            weights: Lanes::from_fn(|i| (weights[i] * half).to_f64()),
            integration: std::array::from_fn(|j| Lanes::from_fn(|i| entry(i, j))),
            last_modes: [mode(NODES - 2), mode(NODES - 1)],
        }
    }

    /// `∫_0^1` of the function with these node values.
    pub(super) fn integral(&self, values: NodeValues) -> f64 {
        dot(self.weights, values)
    }

    /// Largest of the last two Legendre coefficients.
    pub(super) fn tail(&self, values: NodeValues) -> f64 {
        dot(self.last_modes[0], values)
            .abs()
            .max(dot(self.last_modes[1], values).abs())
    }
}

#[inline(always)]
fn dot(a: NodeValues, b: NodeValues) -> f64 {
    let products = a * b;
    let mut quads = [0.0; 4];
    for (lane, &value) in products.0.iter().enumerate() {
        quads[lane % 4] += value;
    }
    (quads[0] + quads[1]) + (quads[2] + quads[3])
}

/// Root `i` of `P_16`, increasing, by Newton's method from Tricomi's guess.
fn root(i: usize) -> Dd {
    let order = NODES as f64;
    let angle = std::f64::consts::PI * (4.0 * (NODES - i) as f64 - 1.0) / (4.0 * order + 2.0);
    let mut x = Dd::from(angle.cos());
    for _ in 0..6 {
        x = x - legendre(x)[NODES] / legendre_slope(x);
    }
    x
}

/// `P_0 … P_16` at a point.
fn legendre(x: Dd) -> [Dd; NODES + 1] {
    let mut values = [Dd::ONE; NODES + 1];
    values[1] = x;
    for m in 1..NODES {
        let (a, b, c) = (2.0 * m as f64 + 1.0, m as f64, m as f64 + 1.0);
        values[m + 1] = (Dd::from(a) * x * values[m] - Dd::from(b) * values[m - 1]) / Dd::from(c);
    }
    values
}

/// `P_16'` at a point.
fn legendre_slope(x: Dd) -> Dd {
    let values = legendre(x);
    Dd::from(NODES as f64) * (x * values[NODES] - values[NODES - 1]) / (x * x - Dd::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collocation_integrates_the_powers_it_must() {
        let gauss = &*GAUSS;
        for power in 0..2 * NODES as i32 {
            let values = Lanes(gauss.nodes.map(|c| c.powi(power)));
            let exact = 1.0 / f64::from(power + 1);
            assert!(
                (gauss.integral(values) - exact).abs() < 4e-16,
                "power {power}"
            );
            if power < NODES as i32 {
                for (i, &c) in gauss.nodes.iter().enumerate() {
                    let sum: f64 = (0..NODES)
                        .map(|j| gauss.integration[j].0[i] * values.0[j])
                        .sum();
                    assert!(
                        (sum - c.powi(power + 1) * exact).abs() < 1e-15,
                        "power {power}, node {i}"
                    );
                }
            }
        }
    }

    #[test]
    fn last_modes_are_blind_to_lower_ones() {
        let square = Lanes(GAUSS.nodes.map(|c| c * c));
        assert!(GAUSS.tail(square) < 1e-15);
        let last = Lanes(
            GAUSS
                .nodes
                .map(|c| legendre(Dd::from(2.0 * c - 1.0))[15].to_f64()),
        );
        assert!((GAUSS.tail(last) - 1.0).abs() < 1e-13);
    }
}
