//! The flow from the start of a span to each of its nodes, for one orbit or for several in lanes.
//!
//! One idea: in lanes every orbit goes to a node of its own, so that its flow is read separately,
//! without a branch; the results are then put side by side. Besides this, lanes differ from one
//! orbit only in what is compiled as a separate function; both are in a [`Backend`].

use std::fmt::Debug;
use std::marker::PhantomData;
use std::sync::OnceLock;

use super::matrix::{AffineFieldRows, sum_at, unit};
use super::rows::{BLOCK, RowTable, Rows, product};
use crate::numeric::{Branched, Lanes, Real, Vectorised};

/// Number of pieces of a span.
pub(super) const PIECES: usize = 3;
/// Number of nodes of a piece, including its start.
pub(super) const NODES: usize = 12;
/// Number of the last node.
const LAST: f64 = (PIECES * NODES) as f64;

/// Operations of the exact flow that differ between one orbit and several in lanes.
pub(crate) trait Backend: Clone + Debug {
    /// Type of states and times.
    type Number: Branched;
    /// Type of the flows to nodes.
    type Nodes: Clone + Debug;
    /// Type of the numbers of a node, one for every orbit.
    ///
    /// NOTE: it is an integer for one orbit, so that reads at this index do not wait for two
    /// conversions.
    type Node: Copy + Debug;
    /// Marker for no node.
    const NOWHERE: Self::Node;

    /// Number of a node, from a time divided by the spacing of nodes, plus a half.
    fn nearest_node(share: RoundedNumber<Self>) -> Self::Node;

    /// Number of a node as a double.
    fn node_number(node: Self::Node) -> RoundedNumber<Self>;

    /// Mask: two nodes differ.
    fn differ(one: Self::Node, other: Self::Node) -> NumberMask<Self>;

    /// Extended states at nodes, given by their numbers, without their last components; `out` has
    /// whole blocks.
    fn flow_to_node(
        nodes: &Self::Nodes,
        node: Self::Node,
        extended: &[Self::Number],
        out: &mut [Self::Number],
    );

    /// Runs a part of the work that is rarely needed: by a call for one orbit, inlined for lanes.
    fn seldom<W: Vectorised>(work: W) -> W::Output;
}

/// Type of doubles with as many lanes as the numbers of a backend.
pub(crate) type RoundedNumber<B> = <<B as Backend>::Number as Branched>::Rounded;
/// Type of masks for the numbers of a backend.
pub(crate) type NumberMask<B> = <<B as Backend>::Number as Branched>::Mask;

/// Backend of one orbit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Single<S>(PhantomData<S>);

/// Backend of several orbits in lanes, each at its own parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch<const N: usize>;

impl<S: Real> Backend for Single<S> {
    type Number = S;
    type Nodes = Nodes<S>;
    type Node = usize;
    const NOWHERE: usize = usize::MAX;

    #[inline(always)]
    fn nearest_node(share: f64) -> usize {
        share.clamp(0.0, LAST) as usize
    }

    #[inline(always)]
    fn node_number(node: usize) -> f64 {
        node as f64
    }

    #[inline(always)]
    fn differ(one: usize, other: usize) -> bool {
        one != other
    }

    #[inline(always)]
    fn flow_to_node(nodes: &Nodes<S>, node: usize, extended: &[S], out: &mut [S]) {
        match node {
            0 => out[..extended.len()].copy_from_slice(extended),
            node => nodes.get(node).combine(extended, out),
        }
    }

    #[inline(never)]
    fn seldom<W: Vectorised>(work: W) -> W::Output {
        work.run()
    }
}

impl<const N: usize> Backend for Batch<N> {
    type Number = Lanes<N>;
    type Nodes = LaneNodes<N>;
    type Node = Lanes<N>;
    const NOWHERE: Lanes<N> = Lanes([f64::NAN; N]);

    #[inline(always)]
    fn nearest_node(share: Lanes<N>) -> Lanes<N> {
        share.map(|share| share.clamp(0.0, LAST).trunc())
    }

    #[inline(always)]
    fn node_number(node: Lanes<N>) -> Lanes<N> {
        node
    }

    #[inline(always)]
    fn differ(one: Lanes<N>, other: Lanes<N>) -> NumberMask<Self> {
        !one.is_equal(other)
    }

    #[inline(always)]
    fn flow_to_node(
        nodes: &LaneNodes<N>,
        node: Lanes<N>,
        extended: &[Lanes<N>],
        out: &mut [Lanes<N>],
    ) {
        match extended.len() {
            5 => nodes.take(node, &extended[..5], out),
            7 => nodes.take(node, &extended[..7], out),
            _ => nodes.take(node, extended, out),
        }
    }

    #[inline(always)]
    fn seldom<W: Vectorised>(work: W) -> W::Output {
        work.run()
    }
}

/// The flows to the nodes of a span except its start; each is computed when it is first needed.
///
/// A flow is its matrix over the extended state, without the row of the number 1.
#[derive(Clone, Debug)]
pub(crate) struct Nodes<S>(Vec<OnceLock<RowTable<S>>>);

impl<S: Real> Nodes<S> {
    /// Flows from the series of the states on the first interval between nodes.
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

    /// The flow to a node, composed of the two halves of the way, so that rounding grows with the
    /// number of binary digits of the node's number only.
    ///
    /// # Panics
    ///
    /// For node 0, the start, which has no flow.
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

/// The flows to all nodes, including the start, of `N` orbits: for each orbit the blocks of rows of
/// its nodes, one after another.
#[derive(Clone, Debug)]
pub(crate) struct LaneNodes<const N: usize>([Vec<[f64; BLOCK]>; N]);

impl<const N: usize> LaneNodes<N> {
    /// Flows of `N` orbits whose tables have `columns` columns each.
    pub(super) fn new(alone: [&Nodes<f64>; N], columns: usize) -> Self {
        let units: Vec<Vec<f64>> = (0..columns - 1).map(|row| unit(row, columns)).collect();
        let start: RowTable<f64> = RowTable::new(units.iter().map(Vec::as_slice), columns);
        Self(alone.map(|nodes| {
            let mut flows = start.blocks().to_vec();
            for node in 1..=PIECES * NODES {
                flows.extend_from_slice(nodes.get(node).blocks());
            }
            flows
        }))
    }

    #[inline(always)]
    fn take(&self, nodes: Lanes<N>, extended: &[Lanes<N>], out: &mut [Lanes<N>]) {
        let columns = extended.len();
        let size = (columns - 1).div_ceil(BLOCK) * columns;
        let blocks = out.as_chunks_mut::<BLOCK>().0.iter_mut();
        for (first, out) in (0..size).step_by(columns).zip(blocks) {
            let mut there = [[0.0; BLOCK]; N];
            for (lane, there) in there.iter_mut().enumerate() {
                let place = nodes[lane] as usize * size + first;
                let rows = &self.0[lane][place..][..columns];
                *there = product(extended, |value| value[lane], rows);
            }
            for (row, out) in out.iter_mut().enumerate() {
                *out = Lanes::from_fn(|lane| there[lane][row]);
            }
        }
    }
}
