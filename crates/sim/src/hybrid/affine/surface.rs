//! What the rows of one surface tell of a state: its gap, the normal motion, what is zero where a
//! flight lands.

use super::system::AffineSurface;
use crate::flow::{AffineFieldRows, AffineRows, RowTable};
use crate::hybrid::passage::Landing;
use crate::hybrid::sensing::{Clearance, Sense};
use crate::numeric::{Branched, Lanes, Real};

/// Rows of one surface along the free flow.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTables<S> {
    event: EventRow<S>,
    /// `h, h', h'', h'''`.
    normal: RowTable<S>,
    /// Each state after an impact.
    pub(super) reset: Option<RowTable<S>>,
    /// `h, h'` and the derivatives of the states.
    pub(super) contact: RowTable<S>,
    /// The release function, its derivative, and those of the states.
    release: Option<RowTable<S>>,
}

/// The row of a gap, without what it has no part in.
#[derive(Clone, Debug)]
struct EventRow<S> {
    /// Of the states, and of the harmonics of a surface that moves.
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

    /// The gap; `state` holds the harmonics as well where the surface moves.
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

    /// The normal motion.
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

    /// The function that is zero where a flight lands, its slope, and the derivatives of the
    /// states.
    #[inline(always)]
    pub(super) fn landing(&self, landing: Landing) -> Option<&RowTable<S>> {
        match landing {
            Landing::Contact { .. } => Some(&self.contact),
            Landing::Release { .. } => self.release.as_ref(),
        }
    }
}

impl<const N: usize> SurfaceTables<Lanes<N>> {
    /// The tables of a rigid surface in every lane as one; `None` where they have other shapes, or
    /// no reset.
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
