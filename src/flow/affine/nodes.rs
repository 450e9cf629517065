//! The flow from the start of a span to each of its nodes.

use super::flow::AffineFieldRows;
use super::leaps::{NODES, PIECES};
use super::matrix::sum_at;
use super::rows::RowTable;
use crate::numeric::Real;

/// Matrices over the extended state, one for every node from the start of the span on, by rows.
pub(super) struct Nodes<S> {
    columns: usize,
    entries: Vec<S>,
}

impl<S: Real> Nodes<S> {
    /// From the series of the states on the first stretch: by halves, so that rounding grows with the number of digits
    /// of a node alone.
    pub(super) fn new(field: &AffineFieldRows<'_, S>, series: &[Vec<Vec<S>>], spacing: S) -> Self {
        let states = series.len();
        let columns = states + 2 * field.multiples.len() + 1;
        let mut nodes = Self {
            columns,
            entries: vec![S::zero(); (PIECES * NODES + 1) * columns * columns],
        };
        let (start, rest) = nodes.entries.split_at_mut(columns * columns);
        for component in 0..columns {
            start[component * columns + component] = S::one();
        }
        for (state, rows) in series.iter().enumerate() {
            rest[state * columns..(state + 1) * columns].copy_from_slice(&sum_at(rows, spacing));
        }
        for (harmonic, &multiple) in field.multiples.iter().enumerate() {
            let (sine, cosine) = (multiple * field.phase_rate * spacing).sin_cos();
            let place = states + 2 * harmonic;
            for (row, pair) in [[cosine, -sine], [sine, cosine]].iter().enumerate() {
                let first = (place + row) * columns + place;
                rest[first..first + 2].copy_from_slice(pair);
            }
        }
        rest[columns * columns - 1] = S::one();
        for node in 2..=PIECES * NODES {
            nodes.compose(node);
        }
        nodes
    }

    /// A node from the two halves of the way.
    fn compose(&mut self, node: usize) {
        let (columns, size) = (self.columns, self.columns * self.columns);
        let (known, rest) = self.entries.split_at_mut(node * size);
        let matrix = |node: usize| known[node * size..][..size].chunks_exact(columns);
        let rows = rest[..size].chunks_exact_mut(columns);
        for (row, factors) in rows.zip(matrix(node / 2)) {
            for (&factor, line) in factors.iter().zip(matrix(node - node / 2)) {
                if factor != S::zero() {
                    for (value, &entry) in row.iter_mut().zip(line) {
                        *value = factor.mul_add(entry, *value);
                    }
                }
            }
        }
    }

    fn matrix(&self, node: usize) -> &[S] {
        let size = self.columns * self.columns;
        &self.entries[node * size..][..size]
    }

    /// All rows but that of the number 1, for every node but the first.
    pub(super) fn tables(&self) -> Vec<RowTable<S>> {
        let columns = self.columns;
        let table = |node| {
            let matrix = self.matrix(node);
            RowTable::from_fn(columns - 1, columns, |row, column| {
                matrix[row * columns + column]
            })
        };
        (1..=PIECES * NODES).map(table).collect()
    }

    /// Rows after the flow to the start of a piece, in `f64`.
    pub(super) fn before_piece(&self, piece: usize, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let matrix: Vec<f64> = self
            .matrix(piece * NODES)
            .iter()
            .map(|m| m.to_f64())
            .collect();
        let image = |row: &Vec<f64>| {
            let mut image = vec![0.0; self.columns];
            for (factor, line) in row.iter().zip(matrix.chunks_exact(self.columns)) {
                for (value, entry) in image.iter_mut().zip(line) {
                    *value += factor * entry;
                }
            }
            image
        };
        rows.iter().map(image).collect()
    }
}
