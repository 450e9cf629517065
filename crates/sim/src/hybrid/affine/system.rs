//! The affine expressions of a model, read from its graph once for all parameters, and the rows of
//! one surface: the gap, the normal motion, and the function whose zero ends a flight.

use crate::flow::{AffineExpressions, AffineFieldRows, AffineRows, RowTable};
use crate::hybrid::motion::{Clearance, Sense};
use crate::hybrid::passage::Landing;
use crate::model::{Model, NodeId, Response};
use crate::numeric::{Branched, Lanes, Real};

/// The affine expressions of a model. Numbers in the fields are positions in the list of
/// expressions.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct AffineSystem {
    pub(super) expressions: AffineExpressions,
    pub(super) phase_rate: Option<usize>,
    /// Derivative of each state in free flight.
    pub(super) free: Vec<usize>,
    pub(super) surfaces: Vec<AffineSurface>,
}

#[derive(Clone, Debug)]
pub(super) struct AffineSurface {
    pub(super) event: usize,
    /// Each state after an impact, if the reset is affine and keeps the phase.
    pub(super) reset: Option<Vec<usize>>,
    pub(super) contact: Option<AffineContact>,
}

/// A contact with an affine field and release function.
#[derive(Clone, Debug)]
pub(super) struct AffineContact {
    pub(super) derivatives: Vec<usize>,
    pub(super) release: usize,
    /// The other surfaces, which are watched after the release.
    pub(super) others: Vec<usize>,
}

impl AffineSystem {
    /// Decomposes a model; `None` unless free flight and all events are affine.
    pub(in crate::hybrid) fn new(model: &Model) -> Option<Self> {
        let mut list = List::default();
        let states = model.states.len();
        let phase = model.phase.as_ref();
        let phase_rate = phase.map(|phase| list.push(phase.rate));
        let free = list.push_all(&model.flow[..states]);
        let surfaces: Vec<_> =
            (0..model.surfaces.len()).map(|surface| list.surface(model, surface)).collect();
        let expressions = AffineExpressions::new(
            &model.graph,
            &list.nodes,
            model.dimension(),
            phase.map(|_| states),
            model.parameters.len(),
        );
        let affine = |&place: &usize| expressions.is_affine(place);
        let needed = surfaces.iter().map(|surface| surface.event);
        let needed = needed.chain(phase_rate).chain(free.iter().copied());
        if !needed.into_iter().all(|place| affine(&place)) {
            return None;
        }
        let without_others = |surface: AffineSurface| AffineSurface {
            event: surface.event,
            reset: surface.reset.filter(|reset| reset.iter().all(affine)),
            contact: surface.contact.filter(|contact| {
                affine(&contact.release) && contact.derivatives.iter().all(affine)
            }),
        };
        Some(Self {
            surfaces: surfaces.into_iter().map(without_others).collect(),
            expressions,
            phase_rate,
            free,
        })
    }
}

/// Expressions in the order of their positions.
#[derive(Default)]
struct List {
    nodes: Vec<NodeId>,
}

impl List {
    fn push(&mut self, node: NodeId) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn push_all(&mut self, nodes: &[NodeId]) -> Vec<usize> {
        nodes.iter().map(|&node| self.push(node)).collect()
    }

    fn surface(&mut self, model: &Model, index: usize) -> AffineSurface {
        let surface = &model.surfaces[index];
        let states = model.states.len();
        let event = self.push(surface.event);
        let (mut reset, mut contact) = (None, None);
        match &surface.response {
            Response::Impact { reset: image } => {
                let keeps_phase = (image.get(states)).is_none_or(|&phase| {
                    model.graph.node(phase) == crate::model::Node::Input(states)
                });
                reset = keeps_phase.then(|| self.push_all(&image[..states]));
            }
            Response::Contact { field, release } => {
                let keeps_rate = field.get(states) == model.flow.get(states);
                let others = (0..model.surfaces.len()).filter(|&other| other != index);
                contact = keeps_rate.then(|| AffineContact {
                    derivatives: self.push_all(&field[..states]),
                    release: self.push(*release),
                    others: others.collect(),
                });
            }
        }
        AffineSurface { event, reset, contact }
    }
}

/// Rows of one surface along the free flow.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTables<S> {
    event: EventRow<S>,
    /// `h, h', h'', h'''`.
    normal: RowTable<S>,
    /// Row of each state after an impact.
    pub(super) reset: Option<RowTable<S>>,
    /// Rows `h, h'` and the derivatives of the states.
    pub(super) contact: RowTable<S>,
    /// Rows of the release function, its derivative, and the derivatives of the states.
    release: Option<RowTable<S>>,
}

/// Row of a gap, without the columns that are zero.
#[derive(Clone, Debug)]
struct EventRow<S> {
    /// Factors of the states, and of the harmonics if the surface moves.
    factors: Vec<S>,
    constant: S,
    moves: bool,
}

impl<S: Real> SurfaceTables<S> {
    pub(super) fn new(
        surface: &AffineSurface,
        rows: &AffineRows<S>,
        field: &AffineFieldRows<'_, S>,
    ) -> Self {
        let event = rows.row(surface.event);
        let reset = |places: &Vec<usize>| {
            RowTable::new(places.iter().map(|&place| rows.row(place)), event.len())
        };
        let landing = |row: &[S]| field.lie_derivatives(row, 2).followed_by(field.derivatives);
        let release = surface.contact.as_ref().map(|contact| contact.release);
        Self {
            event: EventRow::new(event, field.derivatives.len()),
            normal: field.lie_derivatives(event, 4),
            reset: surface.reset.as_ref().map(reset),
            contact: landing(event),
            release: release.map(|release| landing(rows.row(release))),
        }
    }
}

impl<S: Branched> SurfaceTables<S> {
    /// Whether the gap depends on the phase.
    #[inline(always)]
    pub(super) fn moves(&self) -> bool {
        self.event.moves
    }

    /// The gap with its rounding; `state` includes the harmonics if the surface moves.
    #[inline(always)]
    pub(super) fn clearance(&self, state: &[S]) -> Clearance<S> {
        let (mut gap, mut size) = (self.event.constant, S::zero());
        for (&factor, &value) in self.event.factors.iter().zip(state) {
            let term = factor * value;
            gap += term;
            size = S::select(size.is_below(term.abs()), term.abs(), size);
        }
        let rounding = S::from_f64(16.0 * S::ROUNDOFF) * size;
        Clearance { gap, rounding }
    }

    /// Normal motion.
    #[inline(always)]
    pub(super) fn sense(&self, extended: &[S]) -> Sense<S> {
        let mut motion = [S::zero(); 4];
        self.normal.multiply(extended, &mut motion);
        self.sensed(motion, extended)
    }

    #[inline(always)]
    fn sensed(&self, motion: [S; 4], extended: &[S]) -> Sense<S> {
        let [gap, velocity, acceleration, jerk] = motion;
        let rounding = self.clearance(extended).rounding;
        Sense { gap, velocity, acceleration, jerk, rounding }
    }

    /// Rows of the function that is zero at the end of a flight, of its slope, and of the
    /// derivatives of the states.
    #[inline(always)]
    pub(super) fn landing(&self, landing: Landing) -> Option<&RowTable<S>> {
        match landing {
            Landing::Contact { .. } => Some(&self.contact),
            Landing::Release { .. } => self.release.as_ref(),
        }
    }
}

impl<const N: usize> SurfaceTables<Lanes<N>> {
    /// Combines the tables of a rigid surface in all lanes; `None` if their shapes differ or there
    /// is no reset.
    pub(super) fn interleaved(alone: [&SurfaceTables<f64>; N]) -> Option<Self> {
        let first = alone[0].reset.as_ref()?;
        let tables = |table: fn(&SurfaceTables<f64>) -> &RowTable<f64>| {
            let tables = alone.map(table);
            RowTable::interleaved(tables, tables[0].rows())
        };
        let resets = alone.map(|tables| tables.reset.as_ref().unwrap_or(first));
        Some(Self {
            event: EventRow::interleaved(alone.map(|tables| &tables.event))?,
            normal: tables(|tables| &tables.normal),
            reset: Some(RowTable::interleaved(resets, first.rows())),
            contact: tables(|tables| &tables.contact),
            release: None,
        })
    }
}

impl<const N: usize> EventRow<Lanes<N>> {
    fn interleaved(alone: [&EventRow<f64>; N]) -> Option<Self> {
        let factors = alone[0].factors.len();
        if alone.iter().any(|row| row.factors.len() != factors) {
            return None;
        }
        let factor = |place: usize| Lanes::from_fn(|lane| alone[lane].factors[place]);
        Some(Self {
            factors: (0..factors).map(factor).collect(),
            constant: Lanes::from_fn(|lane| alone[lane].constant),
            moves: alone[0].moves,
        })
    }
}

impl<S: Real> EventRow<S> {
    fn new(row: &[S], states: usize) -> Self {
        let one = row.len() - 1;
        let moves = row[states..one].iter().any(|&factor| factor != S::zero());
        let factors = if moves { &row[..one] } else { &row[..states] };
        Self { factors: factors.to_vec(), constant: row[one], moves }
    }
}
