//! What the rows of one surface tell of a state: its gap, the normal motion, what is zero where a flight lands.

use super::AffineSurface;
use crate::flow::{AffineFieldRows, AffineRows, RowTable};
use crate::hybrid::landing::Landing;
use crate::hybrid::sensing::{Clearance, Sense};
use crate::numeric::Real;

/// Rows of one surface along the free flow.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTables<S> {
    event: EventRow<S>,
    /// `h, h', h'', h'''`.
    normal: RowTable<S>,
    /// Each state after an impact.
    pub(super) reset: Option<RowTable<S>>,
    /// `h, h'` and the derivatives of the states.
    contact: RowTable<S>,
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
            size = if term.abs() > size { term.abs() } else { size };
        }
        let rounding = S::from_f64(16.0 * S::ROUNDOFF) * size;
        Clearance { gap, rounding }
    }

    /// The normal motion.
    #[inline(always)]
    pub(super) fn sense(&self, extended: &[S]) -> Sense<S> {
        let mut motion = [S::zero(); 4];
        self.normal.multiply(extended, &mut motion);
        let [gap, velocity, acceleration, jerk] = motion;
        let rounding = self.clearance(extended).rounding;
        Sense {
            gap,
            velocity,
            acceleration,
            jerk,
            rounding,
        }
    }

    /// The function that is zero where a flight lands, its slope, and the derivatives of the states.
    #[inline(always)]
    pub(super) fn landing(&self, landing: Landing) -> Option<&RowTable<S>> {
        match landing {
            Landing::Contact { .. } => Some(&self.contact),
            Landing::Release { .. } => self.release.as_ref(),
        }
    }
}

impl<S: Real> EventRow<S> {
    fn new(row: &[S], states: usize) -> Self {
        let one = row.len() - 1;
        let moves = row[states..one].iter().any(|&factor| factor != S::zero());
        let factors = if moves { &row[..one] } else { &row[..states] };
        Self {
            factors: factors.to_vec(),
            constant: row[one],
            moves,
        }
    }
}
