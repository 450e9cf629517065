//! The flows to the nodes of the spans of several orbits.
//!
//! One idea: every orbit goes to a node of its own, so that its flow is read alone, without a
//! branch; what comes of all is then put side by side.

use super::leaps::{AffineLeaps, NODES, PIECES};
use super::matrix::unit;
use super::rows::{BLOCK, FixedRows, RowTable, product};
use crate::numeric::Lanes;

/// The flows to all nodes, that to the start among them, of `N` orbits.
#[derive(Clone, Debug)]
pub(super) struct LaneNodes<const N: usize> {
    columns: usize,
    /// Rows of each orbit's nodes, in blocks, one after another.
    flows: Vec<Vec<[f64; BLOCK]>>,
}

/// The same in as many columns and blocks as the compiler knows.
pub(crate) struct FixedNodes<'t, const N: usize, const C: usize, const B: usize>(
    [OwnNodes<'t, C, B>; N],
);

/// The flows to the nodes of one orbit.
type OwnNodes<'t, const C: usize, const B: usize> = &'t [[[[f64; BLOCK]; C]; B]];

impl<const N: usize> LaneNodes<N> {
    /// Those of tables with as many columns.
    pub(super) fn new(alone: &[AffineLeaps<f64>], columns: usize) -> Self {
        let flows = alone.iter().map(|own| flows(own, columns));
        Self {
            columns,
            flows: flows.collect(),
        }
    }

    /// The flows of every orbit, where they have this shape.
    #[inline(always)]
    pub(super) fn fixed<const C: usize, const B: usize>(&self) -> Option<FixedNodes<'_, N, C, B>> {
        let mut all: [OwnNodes<'_, C, B>; N] = [&[]; N];
        for (fixed, flows) in all.iter_mut().zip(&self.flows) {
            *fixed = flows.as_chunks::<C>().0.as_chunks::<B>().0;
        }
        let is_whole = |fixed: &OwnNodes<'_, C, B>| fixed.len() == PIECES * NODES + 1;
        (self.columns == C && all.iter().all(is_whole)).then_some(FixedNodes(all))
    }

    /// The extended states at nodes, given by their numbers, but for their last components; `out`
    /// has whole blocks.
    #[inline(always)]
    pub(super) fn take_to(&self, nodes: Lanes<N>, extended: &[Lanes<N>], out: &mut [Lanes<N>]) {
        match self.columns {
            5 => self.take(nodes, &extended[..5], out),
            7 => self.take(nodes, &extended[..7], out),
            columns => self.take(nodes, &extended[..columns], out),
        }
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
                let rows = &self.flows[lane][place..][..columns];
                *there = product(extended, |value| value[lane], rows);
            }
            *out = side_by_side(&there);
        }
    }
}

impl<const N: usize, const C: usize, const B: usize> FixedNodes<'_, N, C, B> {
    /// The extended states at nodes, given by their numbers, but for their last components.
    #[inline(always)]
    pub(super) fn take_to(
        &self,
        nodes: Lanes<N>,
        extended: &[Lanes<N>; C],
        out: &mut [[Lanes<N>; BLOCK]; B],
    ) {
        let mut there = [[[0.0; BLOCK]; N]; B];
        for lane in 0..N {
            let mut own = [0.0; C];
            for (own, value) in own.iter_mut().zip(extended) {
                *own = value[lane];
            }
            let flow = FixedRows::new(&self.0[lane][nodes[lane] as usize]);
            for (there, own) in there.iter_mut().zip(flow.times(&own)) {
                there[lane] = own;
            }
        }
        for (out, there) in out.iter_mut().zip(&there) {
            *out = side_by_side(there);
        }
    }
}

/// Numbers of every orbit as lanes.
#[inline(always)]
fn side_by_side<const N: usize>(each: &[[f64; BLOCK]; N]) -> [Lanes<N>; BLOCK] {
    let mut all = [Lanes::splat(0.0); BLOCK];
    for (row, all) in all.iter_mut().enumerate() {
        *all = Lanes::from_fn(|lane| each[lane][row]);
    }
    all
}

fn flows(alone: &AffineLeaps<f64>, columns: usize) -> Vec<[f64; BLOCK]> {
    let units: Vec<Vec<f64>> = (0..columns - 1).map(|row| unit(row, columns)).collect();
    let start = RowTable::new(units.iter().map(Vec::as_slice), columns);
    let mut flows = start.blocks().to_vec();
    for node in 1..=PIECES * NODES {
        flows.extend_from_slice(alone.flow_to(node).blocks());
    }
    flows
}
