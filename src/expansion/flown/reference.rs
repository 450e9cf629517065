//! The contact of one point flown step by step to its first release: what the fixed plan is checked
//! against.

use super::arithmetic::Numbers;
use super::contact::FlownContact;
use super::flight::{scaled, scaled_all, shift};
use crate::numeric::Dd;
use crate::numeric::polynomial::{CrossingDirection, crossings, evaluate};

/// Steps within the shorter of the contact time at small depths and the law's own time.
const STEPS_PER_TIME: f64 = 4.0;
/// Powers of time in a step: `(1/4)^25/25!` is below the rounding of double-double.
const ORDER: usize = 24;
/// Share of the first step at which the release function has its sign.
const EARLY: f64 = 0.125;
/// Steps after which a contact counts as one without release.
pub(super) const MOST_STEPS: usize = 4096;

/// Flies contacts of one law, slowly and surely.
pub(super) struct Reference<'a> {
    pub(super) contact: &'a FlownContact<Dd>,
    /// Contact time over `y` at small depths.
    pub(super) factor: f64,
    /// Largest magnitude of an eigenvalue of the contact's matrix.
    pub(super) rate: f64,
}

/// One contact.
pub(super) struct FlownReference {
    /// Contact time.
    pub(super) time: Dd,
    /// Sign of the release function before the release.
    pub(super) sign: f64,
    /// Corrections of the coordinates.
    pub(super) corrections: Vec<Dd>,
}

impl Reference<'_> {
    /// The contact of depth variable `y > 0` at a point; `None` if it has no release.
    pub(super) fn fly(&self, y: Dd, point: &[Dd]) -> Option<FlownReference> {
        let numbers = &mut Numbers::default();
        let entry = self.contact.entry(numbers, &y, point);
        let time = (self.factor * y.to_f64()).min(1.0 / self.rate);
        let length = Dd::from(time / STEPS_PER_TIME);
        let mut forces = scaled_all(numbers, &entry.forces, &length);
        let mut release = scaled(numbers, &entry.release, &length);
        let law = &self.contact.law;
        let mut state = vec![Dd::ZERO; law.matrix.len()];
        let mut sign = None;
        for number in 0..MOST_STEPS {
            let step = law.step(numbers, &forces, &release, state, &length, ORDER);
            let part = first_change(&step.release, &mut sign);
            let at = part.unwrap_or(Dd::ONE);
            let added = step.states.iter().map(|series| evaluate(series, at).0);
            let added: Vec<_> = added.collect();
            if part.is_some() {
                let time = (Dd::from(number as f64) + at) * length;
                let since_minimum = entry.time + time;
                let corrections = self
                    .contact
                    .on_section(numbers, &since_minimum, &added, point);
                return Some(FlownReference {
                    time,
                    sign: sign?,
                    corrections,
                });
            }
            state = added;
            forces
                .iter_mut()
                .for_each(|series| shift(numbers, series, None));
            shift(numbers, &mut release, None);
        }
        None
    }
}

/// Where a polynomial on `[0, 1]` first loses its sign, which is that of an early place of the first
/// step: there it may begin at zero.
fn first_change(release: &[Dd], sign: &mut Option<f64>) -> Option<Dd> {
    let Some(sign) = *sign else {
        let early = evaluate(release, Dd::from(EARLY)).0.to_f64();
        *sign = Some(early.signum());
        return crossing_from(release, early);
    };
    if release[0].to_f64() * sign < 0.0 {
        return Some(Dd::ZERO);
    }
    crossing_from(release, sign)
}

/// The first place at which a polynomial on `[0, 1]` leaves a sign.
fn crossing_from(release: &[Dd], sign: f64) -> Option<Dd> {
    let direction = if sign > 0.0 {
        CrossingDirection::Entering
    } else {
        CrossingDirection::Leaving
    };
    let mut found = crossings(release, Dd::ONE).into_iter();
    Some(found.find(|crossing| crossing.direction == direction)?.time)
}
