//! The flow from the start of a span to each of its nodes.

use std::sync::OnceLock;

use super::flow::AffineFieldRows;
use super::leaps::{NODES, PIECES};
use super::matrix::{sum_at, unit};
use super::rows::{RowTable, Rows};
use crate::numeric::Real;

/// The flows to the nodes of a span but its start; each is formed when it is first asked for.
///
/// A flow is its matrix over the extended state, all rows but that of the number 1.
#[derive(Clone, Debug)]
pub(crate) struct Nodes<S>(Vec<OnceLock<RowTable<S>>>);

impl<S: Real> Nodes<S> {
    /// From the series of the states on the first stretch.
    pub(super) fn new(field: &AffineFieldRows<'_, S>, series: &[Rows<S>], spacing: S) -> Self {
        let states = series.len();
        let columns = states + 2 * field.multiples.len() + 1;
        let mut first: Vec<Vec<S>> = series.iter().map(|rows| sum_at(rows, spacing)).collect();
        for (harmonic, &multiple) in field.multiples.iter().enumerate() {
            let (sine, cosine) = (multiple * field.phase_rate * spacing).sin_cos();
            let place = states + 2 * harmonic;
            for (component, entries) in [(place, [cosine, -sine]), (place + 1, [sine, cosine])] {
                let mut row = unit(component, columns);
                row[place..place + 2].copy_from_slice(&entries);
                first.push(row);
            }
        }
        let first = RowTable::new(first.iter().map(Vec::as_slice), columns);
        let mut nodes = vec![OnceLock::from(first)];
        nodes.resize_with(PIECES * NODES, OnceLock::new);
        Self(nodes)
    }

    /// The flow to a node: from the two halves of the way, so that rounding grows with the number
    /// of digits of a node alone.
    ///
    /// # Panics
    ///
    /// For the start, to which nothing flows.
    #[inline(always)]
    pub(super) fn get(&self, node: usize) -> &RowTable<S> {
        match self.0[node - 1].get() {
            Some(known) => known,
            None => self.formed(node),
        }
    }

    #[cold]
    #[inline(never)]
    fn formed(&self, node: usize) -> &RowTable<S> {
        let (half, rest) = (self.get(node / 2), self.get(node - node / 2));
        self.0[node - 1].get_or_init(|| half.after(rest))
    }
}
