//! Gauss collocation on one element: nodes, weights, integration matrix, highest Legendre modes;
//! and square blocks over the nodes.

use std::ops::Add;
use std::sync::LazyLock;

use crate::numeric::{Dd, Lanes, Scalar, one_by_one};

/// Number of collocation nodes of an element.
pub(super) const NODES: usize = 16;

/// Values at the nodes of an element.
pub(super) type NodeValues = Lanes<NODES>;

/// Zero at every node.
pub(super) const ZERO: NodeValues = Lanes([0.0; NODES]);

/// Functionals of a function: integral, double integral, and the coefficients of the Legendre
/// polynomials of degree 10, 11, 14 and 15; two lanes are idle.
pub(super) type Functionals = Lanes<8>;

/// Degrees of the Legendre polynomials in [`Functionals`].
const MODES: [usize; 4] = [NODES - 6, NODES - 5, NODES - 2, NODES - 1];

/// Gauss-Legendre collocation on `[0, 1]`.
pub(super) struct Gauss {
    /// The nodes `c_i`, increasing.
    pub(super) nodes: [f64; NODES],
    /// `A_ij = ∫_0^{c_i} ℓ_j`, with `ℓ_j` the Lagrange polynomials of the nodes, and its square.
    pub(super) integration: [NodeMatrix; 2],
    /// Weights of the functionals of a rate, node by node: `b` and `b A`, of the integral and
    /// double integral over the element, and the weights of the modes.
    pub(super) functionals: [Functionals; NODES],
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
            // ℓ_j = Σ_m (2m + 1)/2 w_j P_m(ξ_j) P_m and (2m + 1) ∫_{−1}^x P_m = P_{m+1}(x) −
            // P_{m−1}(x).
            let mode = |m: usize| {
                let primitive = match m {
                    0 => roots[i] + Dd::ONE,
                    _ => legendre[i][m + 1] - legendre[i][m - 1],
                };
                legendre[j][m] * primitive
            };
            let sum = (0..NODES).map(mode).fold(Dd::ZERO, |sum, term| sum + term);
            weights[j] * sum * half * half
        };
        let matrix: [[Dd; NODES]; NODES] =
            std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        let sum_over = |term: &dyn Fn(usize) -> Dd| (0..NODES).map(term).fold(Dd::ZERO, Add::add);
        let square = |i: usize, j: usize| sum_over(&|m| matrix[i][m] * matrix[m][j]);
        let double = |j: usize| sum_over(&|i| weights[i] * half * matrix[i][j]);
        let block = |entry: &dyn Fn(usize, usize) -> Dd| {
            NodeMatrix(std::array::from_fn(|j| Lanes::from_fn(|i| entry(i, j).to_f64())))
        };
        let mode = |m: usize, j: usize| weights[j] * legendre[j][m] * Dd::from(m as f64 + 0.5);
        Self {
            nodes: roots.map(|root| ((root + Dd::ONE) * half).to_f64()),
            integration: [block(&|i, j| matrix[i][j]), block(&square)],
            functionals: std::array::from_fn(|j| {
                let [a, b, c, d] = MODES.map(|m| mode(m, j));
                let values = [weights[j] * half, double(j), a, b, c, d, Dd::ZERO, Dd::ZERO];
                Lanes(values.map(Dd::to_f64))
            }),
        }
    }

    /// Functionals of the function with these node values.
    #[inline(always)]
    pub(super) fn functionals_of(&self, values: NodeValues) -> Functionals {
        let terms = self.functionals.iter().zip(&values.0);
        terms
            .fold(Lanes([0.0; 8]), |sum, (column, &value)| column.mul_add(Lanes::splat(value), sum))
    }

    /// Adds the functionals of every column of a block.
    #[inline(always)]
    pub(super) fn functionals_of_columns(
        &self,
        block: &NodeMatrix,
        sums: &mut [Functionals; NODES],
    ) {
        let (columns, _) = block.0.as_chunks::<TOGETHER>();
        let (sums, _) = sums.as_chunks_mut::<TOGETHER>();
        for (columns, sums) in columns.iter().zip(sums) {
            for (node, functionals) in self.functionals.iter().enumerate() {
                for (sum, column) in sums.iter_mut().zip(columns) {
                    *sum = functionals.mul_add(Lanes::splat(column.0[node]), *sum);
                }
            }
        }
    }
}

/// Root `i` of `P_16`, increasing, by Newton's method from Tricomi's guess.
fn root(i: usize) -> Dd {
    let order = NODES as f64;
    let angle = std::f64::consts::PI * (4.0 * (NODES - i) as f64 - 1.0) / (4.0 * order + 2.0);
    let mut x = Dd::from(Scalar::sin_cos(angle).1);
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

/// A matrix over the nodes, by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeMatrix(pub(super) [NodeValues; NODES]);

/// Magnitude that a diagonal entry must exceed to be the pivot; the natural size of diagonal
/// entries here is `1 − small`.
const GOOD_PIVOT: f64 = 0.5;

/// Number of columns that a product computes together: their sums fit the registers and hide each
/// other's latency.
pub(super) const TOGETHER: usize = 4;

impl NodeMatrix {
    /// The zero block.
    pub(super) const ZERO: Self = Self([ZERO; NODES]);

    /// The identity.
    pub(super) const IDENTITY: Self = {
        let mut identity = Self::ZERO;
        let mut node = 0;
        while node < NODES {
            identity.0[node].0[node] = 1.0;
            node += 1;
        }
        identity
    };

    /// Adds the products with several columns to other columns.
    #[inline(always)]
    pub(super) fn add_products<const COLUMNS: usize>(
        &self,
        values: &[NodeValues; COLUMNS],
        sums: &mut [NodeValues; COLUMNS],
    ) {
        for (j, column) in self.0.iter().enumerate() {
            for (sum, values) in sums.iter_mut().zip(values) {
                *sum = column.mul_add(Lanes::splat(values.0[j]), *sum);
            }
        }
    }

    /// Product with a column of node values.
    #[inline(always)]
    pub(super) fn apply(&self, values: NodeValues) -> NodeValues {
        let mut sums = [ZERO];
        self.add_products(&[values], &mut sums);
        sums[0]
    }

    /// `self · other`.
    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = Self::ZERO;
        self.add_times(other, &mut product);
        product
    }

    /// Adds `self · other` to a sum.
    #[inline(always)]
    pub(super) fn add_times(&self, other: &Self, sum: &mut Self) {
        let (values, _) = other.0.as_chunks::<TOGETHER>();
        let (sums, _) = sum.0.as_chunks_mut::<TOGETHER>();
        for (sums, values) in sums.iter_mut().zip(values) {
            self.add_products(values, sums);
        }
    }

    /// `factor · self`.
    #[inline(always)]
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let mut block = *self;
        for (j, column) in block.0.iter_mut().enumerate() {
            one_by_one::<NodeValues>(j);
            *column *= Lanes::splat(factor);
        }
        block
    }

    /// Sets the block to `from − diag(rows) · factor`.
    #[inline(always)]
    pub(super) fn set_difference(&mut self, from: &Self, rows: NodeValues, factor: &Self) {
        let columns = from.0.iter().zip(&factor.0);
        for (j, (column, (from, factor))) in self.0.iter_mut().zip(columns).enumerate() {
            one_by_one::<NodeValues>(j);
            *column = *from - rows * *factor;
        }
    }

    /// Subtracts `diag(rows) · other`.
    #[inline(always)]
    pub(super) fn subtract_scaled_rows(&mut self, rows: NodeValues, other: &Self) {
        for (j, (column, other)) in self.0.iter_mut().zip(&other.0).enumerate() {
            one_by_one::<NodeValues>(j);
            *column -= rows * *other;
        }
    }

    /// Subtracts another block.
    #[inline(always)]
    pub(super) fn subtract(&mut self, other: &Self) {
        for (j, (column, other)) in self.0.iter_mut().zip(&other.0).enumerate() {
            one_by_one::<NodeValues>(j);
            *column -= *other;
        }
    }

    /// Inverts the block by elimination in place; `false` if it is singular, and then its content
    /// is lost.
    ///
    /// NOTE: the elimination runs along columns, which inverts the transpose.
    #[inline(always)]
    pub(super) fn invert(&mut self) -> bool {
        let columns = &mut self.0;
        let mut pivots = [0; NODES];
        for k in 0..NODES {
            let pivot = pivot(columns, k);
            pivots[k] = pivot;
            if pivot != k {
                columns.swap(k, pivot);
            }
            let factor = 1.0 / columns[k].0[k];
            if !factor.is_finite() {
                return false;
            }
            // NOTE: no lane is written alone, because a vector read after such a write would wait
            // until it has reached the cache.
            let (unit, others) = (Self::IDENTITY.0[k], OTHERS[k]);
            let column = (columns[k] * others + unit) * Lanes::splat(factor);
            for (i, target) in columns.iter_mut().enumerate() {
                one_by_one::<NodeValues>(i);
                let factor = Lanes::splat(target.0[k]);
                *target = *target * others - column * factor;
            }
            columns[k] = column;
        }
        for (k, &pivot) in pivots.iter().enumerate().rev() {
            if pivot != k {
                columns.iter_mut().for_each(|column| column.0.swap(k, pivot));
            }
        }
        true
    }
}

/// Ones in all lanes except lane `k`.
const OTHERS: [NodeValues; NODES] = {
    let mut others = [Lanes([1.0; NODES]); NODES];
    let mut lane = 0;
    while lane < NODES {
        others[lane].0[lane] = 0.0;
        lane += 1;
    }
    others
};

/// The column from `k` on with the largest entry in row `k`, or `k` itself if its entry is large
/// enough.
#[inline(always)]
fn pivot(columns: &[NodeValues; NODES], k: usize) -> usize {
    if columns[k].0[k].abs() >= GOOD_PIVOT {
        return k;
    }
    let size = |column: &usize| columns[*column].0[k].abs();
    (k..NODES).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(k)
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
            assert!((gauss.functionals_of(values).0[0] - exact).abs() < 4e-16, "power {power}");
            if power < NODES as i32 {
                for (i, &c) in gauss.nodes.iter().enumerate() {
                    let sum: f64 =
                        (0..NODES).map(|j| gauss.integration[0].0[j].0[i] * values.0[j]).sum();
                    let twice: f64 =
                        (0..NODES).map(|j| gauss.integration[1].0[j].0[i] * values.0[j]).sum();
                    let exact_twice = c.powi(power + 2) * exact / f64::from(power + 2);
                    assert!(
                        power == 15 || (twice - exact_twice).abs() < 1e-15,
                        "power {power}, node {i}, twice"
                    );
                    assert!(
                        (sum - c.powi(power + 1) * exact).abs() < 1e-15,
                        "power {power}, node {i}"
                    );
                }
            }
        }
    }

    #[test]
    fn modes_are_blind_to_other_polynomials() {
        for degree in 0..NODES {
            let polynomial = |c: f64| legendre(Dd::from(2.0 * c - 1.0))[degree].to_f64();
            let functionals = GAUSS.functionals_of(Lanes(GAUSS.nodes.map(polynomial)));
            for (mode, value) in MODES.iter().zip(&functionals.0[2..]) {
                let expected = f64::from(*mode == degree);
                assert!((value - expected).abs() < 1e-13, "{mode} of {degree}");
            }
        }
    }

    fn assert_inverts(block: &NodeMatrix, tolerance: f64) {
        let mut inverse = *block;
        assert!(inverse.invert());
        let mut difference = inverse.times(block);
        difference.subtract(&NodeMatrix::IDENTITY);
        for column in difference.0 {
            assert!(column.0.iter().all(|entry| entry.abs() < tolerance));
        }
    }

    #[test]
    fn inverse_times_block_is_the_identity() {
        assert_inverts(
            &NodeMatrix(std::array::from_fn(|j| {
                Lanes::from_fn(|i| {
                    1.0 / (1.0 + (i as f64 - 0.7 * j as f64).powi(2)) + 0.3 * (i == j) as u8 as f64
                })
            })),
            1e-12,
        );
    }

    #[test]
    fn a_block_without_a_diagonal_is_inverted_by_pivots() {
        let cycle = |j: usize| Lanes::from_fn(|i| f64::from(i == (j + 3) % NODES) * (j + 1) as f64);
        assert_inverts(&NodeMatrix(std::array::from_fn(cycle)), 1e-15);
    }

    #[test]
    fn singular_blocks_have_no_inverse() {
        assert!(!NodeMatrix([Lanes([1.0; NODES]); NODES]).invert());
    }
}
