//! Tables of leaps in lanes in as many columns and terms as the compiler knows: [`FixedLeaps`](super::fixed::FixedLeaps) of
//! several orbits.
//!
//! One idea: half of what it takes to multiply a few rows with a few components is to find out how many there are.

use super::fixed::{POINTS, TERMS};
use super::lane_leaps::LaneLeaps;
use super::lane_nodes::{FixedNodes, side_by_side};
use super::leaps::{LeadingState, LeapTables, PIECES};
use super::looks::LOOK;
use super::rows::{BLOCK, FixedRows};
use crate::numeric::{Branched, Lanes, Mask, Scalar, polynomial};

/// [`LaneLeaps`] with `C` columns; the flow to a node has `B` blocks of rows.
pub(crate) struct FixedLaneLeaps<'t, const N: usize, const C: usize, const B: usize> {
    leaps: &'t LaneLeaps<N>,
    looks: [FixedRows<'t, Lanes<N>, C, POINTS, LOOK>; PIECES],
    sizes: &'t [Lanes<N>; C],
    watched: FixedRows<'t, Lanes<N>, C, TERMS>,
    states: &'t [LeadingState<Lanes<N>>],
    nodes: [FixedNodes<'t, C, B>; N],
}

/// The extended states at the nodes visited last, without their last components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedLaneVisit<const N: usize, const B: usize> {
    /// NaN before the first.
    nodes: Lanes<N>,
    values: [[Lanes<N>; BLOCK]; B],
}

impl<const N: usize, const B: usize> FixedLaneVisit<N, B> {
    /// No nodes yet.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self {
            nodes: Lanes::splat(f64::NAN),
            values: [[Lanes::splat(0.0); BLOCK]; B],
        }
    }
}

impl<'t, const N: usize, const C: usize, const B: usize> FixedLaneLeaps<'t, N, C, B> {
    /// The same tables; `None` where they have another shape.
    #[inline(always)]
    pub(crate) fn new(leaps: &'t LaneLeaps<N>) -> Option<Self> {
        let ([looks], [watched]) = (&leaps.looks[..], &leaps.watched[..]) else {
            return None;
        };
        let [first, second, third] = &looks.pieces;
        Some(Self {
            looks: [first.fixed()?, second.fixed()?, third.fixed()?],
            sizes: looks.sizes.as_slice().try_into().ok()?,
            watched: watched.fixed()?,
            states: &leaps.states,
            nodes: leaps.nodes().fixed()?,
            leaps,
        })
    }

    /// Number of pieces.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> usize {
        PIECES
    }

    /// Lengths of a piece.
    #[inline(always)]
    pub(crate) fn piece(&self) -> Lanes<N> {
        self.leaps.piece()
    }

    /// Lengths of the whole span.
    #[inline(always)]
    pub(crate) fn span(&self) -> Lanes<N> {
        self.leaps.span()
    }

    /// How far from a node its series are good.
    #[inline(always)]
    pub(crate) fn reach(&self) -> Lanes<N> {
        self.leaps.reach()
    }

    /// Rates of the phases.
    #[inline(always)]
    pub(crate) fn phase_rate(&self) -> Lanes<N> {
        self.leaps.phase_rate()
    }

    /// Control points of the watched functions on a piece.
    #[inline(always)]
    pub(crate) fn look(
        &self,
        piece: usize,
        extended: &[Lanes<N>; C],
    ) -> [[Lanes<N>; LOOK]; POINTS] {
        self.looks[piece].times(extended)
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub(crate) fn size(&self, extended: &[Lanes<N>; C]) -> Lanes<N> {
        let mut sum = Lanes::splat(0.0);
        for (&size, y) in self.sizes.iter().zip(extended) {
            sum += size * y.abs();
        }
        sum
    }

    /// Goes to the nodes nearest to times of the span, and their times.
    #[inline(always)]
    pub(crate) fn go_to(
        &self,
        time: Lanes<N>,
        extended: &[Lanes<N>; C],
        visit: &mut FixedLaneVisit<N, B>,
    ) -> Lanes<N> {
        let (nodes, start) = self.leaps.node(time);
        if (!nodes.is_equal(visit.nodes)).any() {
            visit.nodes = nodes;
            let mut there = [[[0.0; BLOCK]; N]; B];
            for lane in 0..N {
                let mut own = [0.0; C];
                for (own, value) in own.iter_mut().zip(extended) {
                    *own = value[lane];
                }
                let flow = FixedRows::new(&self.nodes[lane][nodes[lane] as usize]);
                for (there, own) in there.iter_mut().zip(flow.times(&own)) {
                    there[lane] = own;
                }
            }
            for (values, there) in visit.values.iter_mut().zip(&there) {
                *values = side_by_side(there);
            }
        }
        start
    }

    /// Taylor coefficients of the watched functions about the nodes visited.
    #[inline(always)]
    pub(crate) fn watched_series(
        &self,
        visit: &FixedLaneVisit<N, B>,
    ) -> [[Lanes<N>; BLOCK]; TERMS] {
        self.watched.times(visit.values.as_flattened())
    }

    /// The states at times after the nodes visited, or before.
    #[inline(always)]
    pub(crate) fn states_at<const STATES: usize>(
        &self,
        time: Lanes<N>,
        visit: &FixedLaneVisit<N, B>,
    ) -> Option<[Lanes<N>; STATES]> {
        let mut states = [Lanes::splat(0.0); STATES];
        for (leading, table, slope) in self.states {
            let series = table
                .fixed::<C, TERMS>()?
                .times(visit.values.as_flattened());
            let (value, rate) = polynomial::value_and_slope(series.as_flattened(), time);
            for (place, state) in states.iter_mut().enumerate() {
                if place == *leading {
                    *state = value;
                } else if Some(place) == *slope {
                    *state = rate;
                }
            }
        }
        Some(states)
    }
}
