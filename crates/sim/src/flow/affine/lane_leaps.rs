//! Tables of leaps for orbits that are flown side by side, each at its own parameters.
//!
//! One idea: rows stand with those of all orbits side by side, so that a product with the extended
//! states is the one of a single orbit, in lanes. The flows to nodes stay the orbits' own
//! ([`LaneNodes`]), for each orbit goes to another node.

use super::fixed::ShapedLeaps;
use super::lane_nodes::{FixedNodes, LaneNodes};
use super::leaps::{AffineLeaps, LeadingState, LeapTables, NODES, PIECES, states_at};
use super::looks::Looks;
use super::rows::{BLOCK, RowTable};
use crate::numeric::{Branched, LaneMask, Lanes, Mask};

/// [`AffineLeaps`] of `N` orbits.
#[derive(Clone, Debug)]
pub(crate) struct LaneLeaps<const N: usize> {
    nodes: LaneNodes<N>,
    span: Lanes<N>,
    spacing: Lanes<N>,
    inverse_spacing: Lanes<N>,
    reach: Lanes<N>,
    piece: Lanes<N>,
    phase_rate: Lanes<N>,
    time_scale: Lanes<N>,
    columns: usize,
    points: usize,
    terms: usize,
    looks: Vec<Looks<Lanes<N>>>,
    watched: Vec<RowTable<Lanes<N>>>,
    states: Vec<LeadingState<Lanes<N>>>,
}

impl<const N: usize> LaneLeaps<N> {
    /// From the tables of every lane; `None` where they have other shapes.
    ///
    /// # Panics
    ///
    /// If there is not one table for every lane.
    pub(crate) fn new(alone: Vec<AffineLeaps<f64>>) -> Option<Self> {
        assert_eq!(alone.len(), N, "tables of every lane");
        let first = &alone[0];
        let points = first.points();
        let leading = |leaps: &AffineLeaps<f64>| {
            let states = leaps.states.iter();
            states.map(|state| (state.0, state.2)).collect::<Vec<_>>()
        };
        let known = leading(first);
        let is_alike =
            |leaps: &AffineLeaps<f64>| leaps.points() == points && leading(leaps) == known;
        let terms = alone.iter().map(|leaps| leaps.terms).max()?;
        let columns = first.watched.first()?.columns();
        if !alone.iter().all(is_alike) {
            return None;
        }
        let each = |value: fn(&AffineLeaps<f64>) -> f64| Lanes::from_fn(|lane| value(&alone[lane]));
        let surfaces = 0..first.looks.len();
        Some(Self {
            span: each(LeapTables::span),
            spacing: each(|leaps| leaps.spacing),
            inverse_spacing: each(|leaps| leaps.inverse_spacing),
            reach: each(|leaps| leaps.reach),
            piece: each(AffineLeaps::piece),
            phase_rate: each(AffineLeaps::phase_rate),
            time_scale: each(AffineLeaps::time_scale),
            columns,
            points,
            terms,
            looks: surfaces.clone().map(|watch| looks(&alone, watch)).collect(),
            watched: surfaces
                .map(|watch| series(&alone, terms, |leaps| &leaps.watched[watch]))
                .collect(),
            states: (0..first.states.len())
                .map(|place| {
                    let (state, _, slope) = first.states[place];
                    let table = series(&alone, terms, |leaps| &leaps.states[place].1);
                    (state, table, slope)
                })
                .collect(),
            nodes: LaneNodes::new(&alone, columns),
        })
    }

    /// Length of a piece.
    #[inline(always)]
    pub(crate) fn piece(&self) -> Lanes<N> {
        self.piece
    }

    /// Number of pieces.
    pub(crate) fn pieces(&self) -> usize {
        PIECES
    }

    /// Number of control points on a piece.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// Length of an extended state.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Rate of the phase.
    #[inline(always)]
    pub(crate) fn phase_rate(&self) -> Lanes<N> {
        self.phase_rate
    }

    /// The time in which the field changes.
    #[inline(always)]
    pub(crate) fn time_scale(&self) -> Lanes<N> {
        self.time_scale
    }

    /// Control points of a watched function on a piece.
    #[inline(always)]
    pub(crate) fn look(
        &self,
        watched: usize,
        piece: usize,
        extended: &[Lanes<N>],
        out: &mut [Lanes<N>],
    ) {
        self.looks[watched].pieces[piece].combine(extended, out);
    }

    /// A bound of the size of the terms of which the control points of any piece are sums.
    #[inline(always)]
    pub(crate) fn size(&self, watched: usize, extended: &[Lanes<N>]) -> Lanes<N> {
        let terms = self.looks[watched].sizes.iter().zip(extended);
        terms.fold(Lanes::splat(0.0), |sum, (&size, y)| {
            sum + size * y.map(f64::abs)
        })
    }
}

fn series<const N: usize>(
    alone: &[AffineLeaps<f64>],
    terms: usize,
    table: impl Fn(&AffineLeaps<f64>) -> &RowTable<f64>,
) -> RowTable<Lanes<N>> {
    RowTable::interleaved(std::array::from_fn(|lane| table(&alone[lane])), terms)
}

fn looks<const N: usize>(alone: &[AffineLeaps<f64>], watched: usize) -> Looks<Lanes<N>> {
    let looks = |lane: usize| &alone[lane].looks[watched];
    let piece = |piece: usize| {
        let tables: [_; N] = std::array::from_fn(|lane| &looks(lane).pieces[piece]);
        RowTable::interleaved(tables, alone[0].points())
    };
    let size = |column: usize| Lanes::from_fn(|lane| looks(lane).sizes[column]);
    Looks {
        pieces: std::array::from_fn(piece),
        sizes: (0..looks(0).sizes.len()).map(size).collect(),
    }
}

impl<const N: usize> LeapTables for LaneLeaps<N> {
    type Number = Lanes<N>;
    type Node = Lanes<N>;
    const NOWHERE: Lanes<N> = Lanes::splat(f64::NAN);

    #[inline(always)]
    fn span(&self) -> Lanes<N> {
        self.span
    }

    #[inline(always)]
    fn reach(&self) -> Lanes<N> {
        self.reach
    }

    fn terms(&self) -> usize {
        self.terms
    }

    #[inline(always)]
    fn node(&self, time: Lanes<N>) -> (Lanes<N>, Lanes<N>) {
        let last = (PIECES * NODES) as f64;
        let shares = time * self.inverse_spacing + Lanes::splat(0.5);
        let node = shares.map(|share| share.clamp(0.0, last).trunc());
        (node, self.spacing * node)
    }

    #[inline(always)]
    fn go_to(
        &self,
        node: Lanes<N>,
        wanted: LaneMask<N>,
        known: &mut Lanes<N>,
        extended: &[Lanes<N>],
        out: &mut [Lanes<N>],
    ) {
        if (wanted & !node.is_equal(*known)).any() {
            *known = node;
            self.nodes.take_to(node, extended, out);
            out[self.columns - 1] = Lanes::splat(1.0);
        }
    }

    #[inline(always)]
    fn watched_series(&self, watched: usize, at_node: &[Lanes<N>], out: &mut [Lanes<N>]) {
        self.watched[watched].combine(at_node, out);
    }

    #[inline(always)]
    fn states_at(
        &self,
        time: Lanes<N>,
        at_node: &[Lanes<N>],
        series: &mut [Lanes<N>],
        states: &mut [Lanes<N>],
    ) {
        states_at(&self.states, time, at_node, series, states);
    }
}

impl<const N: usize> ShapedLeaps for LaneLeaps<N> {
    type Flows<'t, const C: usize, const B: usize> = FixedNodes<'t, N, C, B>;

    #[inline(always)]
    fn flows<const C: usize, const B: usize>(&self) -> Option<FixedNodes<'_, N, C, B>> {
        self.nodes.fixed()
    }

    #[inline(always)]
    fn go_by<const C: usize, const B: usize>(
        flows: &FixedNodes<'_, N, C, B>,
        nodes: Lanes<N>,
        known: &mut Lanes<N>,
        extended: &[Lanes<N>; C],
        values: &mut [[Lanes<N>; BLOCK]; B],
    ) {
        if (!nodes.is_equal(*known)).any() {
            *known = nodes;
            flows.take_to(nodes, extended, values);
        }
    }

    #[inline(always)]
    fn looks(&self) -> &[Looks<Lanes<N>>] {
        &self.looks
    }

    #[inline(always)]
    fn watched(&self) -> &[RowTable<Lanes<N>>] {
        &self.watched
    }

    #[inline(always)]
    fn states(&self) -> &[LeadingState<Lanes<N>>] {
        &self.states
    }

    #[inline(always)]
    fn piece(&self) -> Lanes<N> {
        self.piece
    }

    #[inline(always)]
    fn phase_rate(&self) -> Lanes<N> {
        self.phase_rate
    }
}
