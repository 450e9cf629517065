//! The flow from the start of a span to each of its nodes.

use std::sync::OnceLock;

use super::flow::AffineFieldRows;
use super::leaps::{NODES, PIECES};
use super::matrix::sum_at;
use super::rows::RowTable;
use crate::numeric::Real;

/// The flows to the nodes of a span, from its start on; each is formed when it is first asked for.
#[derive(Clone, Debug)]
pub(super) struct Nodes<S> {
    columns: usize,
    nodes: Vec<OnceLock<Node<S>>>,
}

/// The flow to one node.
#[derive(Clone, Debug)]
pub(super) struct Node<S> {
    /// Over the extended state, by rows.
    matrix: Vec<S>,
    /// All rows but that of the number 1.
    pub(super) table: RowTable<S>,
}

impl<S: Real> Nodes<S> {
    /// From the series of the states on the first stretch.
    pub(super) fn new(field: &AffineFieldRows<'_, S>, series: &[Vec<Vec<S>>], spacing: S) -> Self {
        let states = series.len();
        let columns = states + 2 * field.multiples.len() + 1;
        let mut first = identity(columns);
        for (state, rows) in series.iter().enumerate() {
            first[state * columns..(state + 1) * columns].copy_from_slice(&sum_at(rows, spacing));
        }
        for (harmonic, &multiple) in field.multiples.iter().enumerate() {
            let (sine, cosine) = (multiple * field.phase_rate * spacing).sin_cos();
            let place = states + 2 * harmonic;
            for (row, pair) in [[cosine, -sine], [sine, cosine]].iter().enumerate() {
                let entry = (place + row) * columns + place;
                first[entry..entry + 2].copy_from_slice(pair);
            }
        }
        let known = [identity(columns), first].map(|matrix| Node::new(matrix, columns));
        let mut nodes = Vec::from(known.map(OnceLock::from));
        nodes.resize_with(PIECES * NODES + 1, OnceLock::new);
        Self { columns, nodes }
    }

    /// The flow to a node: from the two halves of the way, so that rounding grows with the number of digits of a node
    /// alone.
    #[inline(always)]
    pub(super) fn get(&self, node: usize) -> &Node<S> {
        match self.nodes[node].get() {
            Some(known) => known,
            None => self.formed(node),
        }
    }

    #[cold]
    #[inline(never)]
    fn formed(&self, node: usize) -> &Node<S> {
        let halves = (self.get(node / 2), self.get(node - node / 2));
        self.nodes[node].get_or_init(|| {
            let matrix = product(&halves.0.matrix, &halves.1.matrix, self.columns);
            Node::new(matrix, self.columns)
        })
    }

    /// Rows after the flow to the start of a piece, in `f64`.
    pub(super) fn before_piece(&self, piece: usize, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let matrix = &self.get(piece * NODES).matrix;
        let matrix: Vec<f64> = matrix.iter().map(|entry| entry.to_f64()).collect();
        let image = |row: &Vec<f64>| product(row, &matrix, self.columns);
        rows.iter().map(image).collect()
    }
}

impl<S: Real> Node<S> {
    fn new(matrix: Vec<S>, columns: usize) -> Self {
        let entry = |row: usize, column: usize| matrix[row * columns + column];
        Self {
            table: RowTable::from_fn(columns - 1, columns, entry),
            matrix,
        }
    }
}

fn identity<S: Real>(columns: usize) -> Vec<S> {
    let mut matrix = vec![S::zero(); columns * columns];
    matrix
        .iter_mut()
        .step_by(columns + 1)
        .for_each(|entry| *entry = S::one());
    matrix
}

/// Rows times a matrix.
fn product<S: Real>(rows: &[S], matrix: &[S], columns: usize) -> Vec<S> {
    let mut image = vec![S::zero(); rows.len()];
    for (image, row) in image
        .chunks_exact_mut(columns)
        .zip(rows.chunks_exact(columns))
    {
        for (&factor, line) in row.iter().zip(matrix.chunks_exact(columns)) {
            if factor != S::zero() {
                for (value, &entry) in image.iter_mut().zip(line) {
                    *value = factor.mul_add(entry, *value);
                }
            }
        }
    }
    image
}
