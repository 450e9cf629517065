//! Tables of leaps in as many columns and terms as the compiler knows, at one watched function, of
//! one orbit or of several in lanes.
//!
//! One idea: half of what it takes to multiply a few rows with a few components is to find out how
//! many there are.

use num_traits::Zero as _;

use super::leaps::{AffineLeaps, LeadingState, LeapTables, PIECES, RoundedNumber};
use super::looks::{LOOK, Looks};
use super::nodes::Nodes;
use super::rows::{BLOCK, FixedRows, RowTable};
use crate::numeric::{Real, Scalar, polynomial};

/// Blocks of the control points of a piece.
const POINTS: usize = 2;
/// Blocks of a series about a node.
const TERMS: usize = 3;

/// Number of coefficients of a series about a node.
pub(crate) const SERIES: usize = TERMS * BLOCK;

/// Tables of leaps whose shape the compiler may know.
pub(crate) trait ShapedLeaps: LeapTables {
    /// The flows to nodes in as many columns and blocks.
    type Flows<'t, const C: usize, const B: usize>
    where
        Self: 't;

    /// The flows to nodes, where they have this shape.
    fn flows<const C: usize, const B: usize>(&self) -> Option<Self::Flows<'_, C, B>>;

    /// The extended state at a node without its last component, where it is not known.
    fn go_by<const C: usize, const B: usize>(
        flows: &Self::Flows<'_, C, B>,
        node: Self::Node,
        known: &mut Self::Node,
        extended: &[Self::Number; C],
        values: &mut [[Self::Number; BLOCK]; B],
    );

    /// The control points of watched functions.
    fn looks(&self) -> &[Looks<RoundedNumber<Self>>];

    /// The series of watched functions about nodes.
    fn watched(&self) -> &[RowTable<Self::Number>];

    /// Those of the states.
    fn states(&self) -> &[LeadingState<Self::Number>];

    /// Length of a piece.
    fn piece(&self) -> RoundedNumber<Self>;

    /// Rate of the phase.
    fn phase_rate(&self) -> Self::Number;
}

/// [`ShapedLeaps`] with `C` columns; the flow to a node has `B` blocks of rows.
pub(crate) struct FixedLeaps<'t, T: ShapedLeaps, const C: usize, const B: usize> {
    leaps: &'t T,
    flows: T::Flows<'t, C, B>,
    looks: [FixedRows<'t, RoundedNumber<T>, C, POINTS, LOOK>; PIECES],
    sizes: &'t [RoundedNumber<T>; C],
    watched: FixedRows<'t, T::Number, C, TERMS>,
    states: &'t [LeadingState<T::Number>],
}

/// The extended state at the node visited last, without its last component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedVisit<T: LeapTables, const B: usize> {
    node: T::Node,
    values: [[T::Number; BLOCK]; B],
}

impl<T: LeapTables, const B: usize> FixedVisit<T, B> {
    /// No node yet.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self {
            node: T::NOWHERE,
            values: [[T::Number::zero(); BLOCK]; B],
        }
    }
}

impl<'t, T: ShapedLeaps, const C: usize, const B: usize> FixedLeaps<'t, T, C, B> {
    /// The same tables; `None` where they have another shape.
    #[inline(always)]
    pub(crate) fn new(leaps: &'t T) -> Option<Self> {
        let ([looks], [watched]) = (leaps.looks(), leaps.watched()) else {
            return None;
        };
        let [first, second, third] = &looks.pieces;
        let is_fixed =
            |(_, table, _): &LeadingState<T::Number>| table.fixed::<C, TERMS>().is_some();
        if !leaps.states().iter().all(is_fixed) {
            return None;
        }
        Some(Self {
            flows: leaps.flows()?,
            looks: [first.fixed()?, second.fixed()?, third.fixed()?],
            sizes: looks.sizes.as_slice().try_into().ok()?,
            watched: watched.fixed()?,
            states: leaps.states(),
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
    pub(crate) fn piece(&self) -> RoundedNumber<T> {
        self.leaps.piece()
    }

    /// Length of the whole span.
    #[inline(always)]
    pub(crate) fn span(&self) -> T::Number {
        self.leaps.span()
    }

    /// How far from a node its series are good.
    #[inline(always)]
    pub(crate) fn reach(&self) -> T::Number {
        self.leaps.reach()
    }

    /// Rate of the phase.
    #[inline(always)]
    pub(crate) fn phase_rate(&self) -> T::Number {
        self.leaps.phase_rate()
    }

    /// Control points of the watched function on a piece.
    #[inline(always)]
    pub(crate) fn look(
        &self,
        piece: usize,
        extended: &[RoundedNumber<T>; C],
    ) -> [[RoundedNumber<T>; LOOK]; POINTS] {
        self.looks[piece].times(extended)
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub(crate) fn size(&self, extended: &[RoundedNumber<T>; C]) -> RoundedNumber<T> {
        let mut sum = RoundedNumber::<T>::zero();
        for (&size, y) in self.sizes.iter().zip(extended) {
            sum += size * y.abs();
        }
        sum
    }

    /// Goes to the node nearest to a time of the span, and its time.
    #[inline(always)]
    pub(crate) fn go_to(
        &self,
        time: RoundedNumber<T>,
        extended: &[T::Number; C],
        visit: &mut FixedVisit<T, B>,
    ) -> T::Number {
        let (node, start) = self.leaps.node(time);
        T::go_by(
            &self.flows,
            node,
            &mut visit.node,
            extended,
            &mut visit.values,
        );
        start
    }

    /// Taylor coefficients of the watched function about the node visited.
    #[inline(always)]
    pub(crate) fn watched_series(&self, visit: &FixedVisit<T, B>) -> [[T::Number; BLOCK]; TERMS] {
        series(self.watched, &visit.values)
    }

    /// The states at a time after the node visited, or before.
    #[inline(always)]
    pub(crate) fn states_at<const STATES: usize>(
        &self,
        time: T::Number,
        visit: &FixedVisit<T, B>,
    ) -> [T::Number; STATES] {
        let mut states = [T::Number::zero(); STATES];
        for (leading, table, slope) in self.states {
            let table = table.fixed::<C, TERMS>().expect("its shape was asked for");
            let series = series(table, &visit.values);
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
        states
    }
}

/// A series about the node visited.
///
/// NOTE: left to itself, the compiler takes blocks apart into pairs for the sums that follow, at
/// three times the cost.
#[inline(always)]
fn series<S: Scalar, const C: usize, const B: usize>(
    rows: FixedRows<'_, S, C, TERMS>,
    values: &[[S; BLOCK]; B],
) -> [[S; BLOCK]; TERMS] {
    let mut series = rows.times(values.as_flattened());
    std::hint::black_box(&mut series);
    series
}

impl<S: Real> ShapedLeaps for AffineLeaps<S> {
    type Flows<'t, const C: usize, const B: usize> = &'t Nodes<S>;

    #[inline(always)]
    fn flows<const C: usize, const B: usize>(&self) -> Option<&Nodes<S>> {
        self.nodes.get(1).fixed::<C, B>().map(|_| &self.nodes)
    }

    #[inline(always)]
    fn go_by<const C: usize, const B: usize>(
        flows: &&Nodes<S>,
        node: Option<usize>,
        known: &mut Option<usize>,
        extended: &[S; C],
        values: &mut [[S; BLOCK]; B],
    ) {
        if *known == node {
            return;
        }
        *known = node;
        match node {
            None | Some(0) => {
                values.as_flattened_mut()[..C - 1].copy_from_slice(&extended[..C - 1]);
            }
            Some(node) => {
                let flow = flows.get(node).fixed::<C, B>();
                *values = flow.expect("the shape of the first").times(extended);
            }
        }
    }

    #[inline(always)]
    fn looks(&self) -> &[Looks<f64>] {
        &self.looks
    }

    #[inline(always)]
    fn watched(&self) -> &[RowTable<S>] {
        &self.watched
    }

    #[inline(always)]
    fn states(&self) -> &[LeadingState<S>] {
        &self.states
    }

    #[inline(always)]
    fn piece(&self) -> f64 {
        Self::piece(self)
    }

    #[inline(always)]
    fn phase_rate(&self) -> S {
        Self::phase_rate(self)
    }
}
