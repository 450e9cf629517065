//! Tables of leaps in as many columns and terms as the compiler knows, at one watched function.
//!
//! One idea: half of what it takes to multiply a few rows with a few components is to find out how many there are.

use super::leaps::{AffineLeaps, LeadingState, LeapTables, PIECES};
use super::looks::LOOK;
use super::rows::{BLOCK, FixedRows};
use crate::numeric::{Real, polynomial};

/// Blocks of the control points of a piece.
pub(super) const POINTS: usize = 2;
/// Blocks of a series about a node.
pub(super) const TERMS: usize = 3;

/// Number of coefficients of a series about a node.
pub(crate) const SERIES: usize = TERMS * BLOCK;

/// [`AffineLeaps`] with `C` columns; the flow to a node has `B` blocks of rows.
pub(crate) struct FixedLeaps<'t, S: Real, const C: usize, const B: usize> {
    leaps: &'t AffineLeaps<S>,
    looks: [FixedRows<'t, f64, C, POINTS, LOOK>; PIECES],
    sizes: &'t [f64; C],
    watched: FixedRows<'t, S, C, TERMS>,
    states: &'t [LeadingState<S>],
}

/// The extended state at the node visited last, without its last component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedVisit<S, const B: usize> {
    node: Option<usize>,
    values: [[S; BLOCK]; B],
}

impl<S: Real, const B: usize> FixedVisit<S, B> {
    /// No node yet.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self {
            node: None,
            values: [[S::zero(); BLOCK]; B],
        }
    }
}

impl<'t, S: Real, const C: usize, const B: usize> FixedLeaps<'t, S, C, B> {
    /// The same tables; `None` where they have another shape.
    #[inline(always)]
    pub(crate) fn new(leaps: &'t AffineLeaps<S>) -> Option<Self> {
        let ([looks], [watched]) = (&leaps.looks[..], &leaps.watched[..]) else {
            return None;
        };
        let [first, second, third] = &looks.pieces;
        Some(Self {
            looks: [first.fixed()?, second.fixed()?, third.fixed()?],
            sizes: looks.sizes.as_slice().try_into().ok()?,
            watched: watched.fixed()?,
            states: &leaps.states,
            leaps,
        })
    }

    /// Number of pieces.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> usize {
        PIECES
    }

    /// Length of a piece.
    #[inline(always)]
    pub(crate) fn piece(&self) -> f64 {
        self.leaps.piece()
    }

    /// Length of the whole span.
    #[inline(always)]
    pub(crate) fn span(&self) -> S {
        self.leaps.span()
    }

    /// How far from a node its series are good.
    #[inline(always)]
    pub(crate) fn reach(&self) -> S {
        self.leaps.reach
    }

    /// Control points of the watched function on a piece, in `f64`.
    #[inline(always)]
    pub(crate) fn look(&self, piece: usize, extended: &[f64; C]) -> [[f64; LOOK]; POINTS] {
        self.looks[piece].times(extended)
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub(crate) fn size(&self, extended: &[S; C]) -> f64 {
        let terms = self.sizes.iter().zip(extended);
        terms.fold(0.0, |sum, (size, y)| sum + size * y.magnitude())
    }

    /// Goes to the node nearest to a time of the span, and its time.
    #[inline(always)]
    pub(crate) fn go_to(
        &self,
        time: f64,
        extended: &[S; C],
        visit: &mut FixedVisit<S, B>,
    ) -> Option<S> {
        let (node, start) = self.leaps.node(time);
        if visit.node != node {
            visit.node = node;
            match node {
                None | Some(0) => {
                    let values = visit.values.as_flattened_mut();
                    values[..C - 1].copy_from_slice(&extended[..C - 1]);
                }
                Some(node) => {
                    let flow = self.leaps.flow_to(node).fixed::<C, B>()?;
                    visit.values = flow.times(extended);
                }
            }
        }
        Some(start)
    }

    /// Taylor coefficients of the watched function about the node visited.
    #[inline(always)]
    pub(crate) fn watched_series(&self, visit: &FixedVisit<S, B>) -> [[S; BLOCK]; TERMS] {
        series(self.watched, visit)
    }

    /// The states at a time after the node visited, or before.
    #[inline(always)]
    pub(crate) fn states_at<const STATES: usize>(
        &self,
        time: S,
        visit: &FixedVisit<S, B>,
    ) -> Option<[S; STATES]> {
        let mut states = [S::zero(); STATES];
        for (leading, table, slope) in self.states {
            let series = series(table.fixed::<C, TERMS>()?, visit);
            let (value, rate) = polynomial::value_and_slope(series.as_flattened(), time);
            // NOTE: places that are known leave the states in registers.
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

/// A series about the node visited.
///
/// NOTE: left to itself, the compiler takes blocks apart into pairs for the sums that follow, at three times the cost.
#[inline(always)]
fn series<S: Real, const C: usize, const B: usize>(
    rows: FixedRows<'_, S, C, TERMS>,
    visit: &FixedVisit<S, B>,
) -> [[S; BLOCK]; TERMS] {
    let mut series = rows.times(visit.values.as_flattened());
    std::hint::black_box(&mut series);
    series
}
