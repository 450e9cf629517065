//! First variations through a contact whose law is not analytic on the surface: a force that is a
//! non-integer power of the depth.
//!
//! One idea: with the logarithm of the time since the beginning of the contact as the time, and of
//! the time to its end from its middle on, powers of the depth become exponential functions, which
//! have series of any reach. With `T` that time,
//!
//! ```text
//! dx/ds = T f(x),     dT/ds = ±T
//! ```
//!
//! The first and the last stretch, in which the depth is rounding, pass at constant rates. Every
//! unit of `s` begins with `T` as it should be: beside positions its rounding would be lost.

use super::motion::Regime;
use super::rough_contact::moved;
use super::variation::{At, Change, ChangeKind, Variation, VariedField};
use crate::flow::{Field, Integrator};
use crate::numeric::Real;

/// Rounding errors of a position at which a depth has a meaning.
const RESOLVED: f64 = 1e3;
/// Rounding errors of a position within which it is on the surface.
const ON_SURFACE: f64 = 1e4;
/// Share of a contact that is its first and last stretch at most; of a shorter contact only the
/// middle is looked at.
const STRETCH: f64 = 0.125;

impl<S: Real> At<'_, S> {
    /// Carries variations along the field of a regime between two states of an orbit, which are a
    /// time of either sign apart.
    pub(super) fn fly(
        &self,
        regime: Regime,
        [start, end]: [&[S]; 2],
        duration: S,
        changes: &mut [Variation<S>],
    ) -> Option<()> {
        let field = self.of.field(regime)?;
        match (&field.graded, regime) {
            (Some(graded), Regime::Contact { surface }) => {
                let stretches = [start, end].map(|state| {
                    self.stretch(surface, state).unwrap_or(duration * S::from_f64(S::ROUNDOFF))
                });
                self.fly_rough((field, graded), (start, stretches), duration, changes)
            }
            _ => self.carry(field, start, duration, changes),
        }
    }

    /// Carries variations through a contact that begins with a state, with the lengths of its first
    /// and last stretch.
    fn fly_rough(
        &self,
        (field, graded): (&VariedField, &Field),
        (start, [first, last]): (&[S], [S; 2]),
        duration: S,
        changes: &mut [Variation<S>],
    ) -> Option<()> {
        let free = self.rates(&self.of.free, start);
        let half = duration * S::from_f64(0.5);
        if first.max(last) > duration * S::from_f64(STRETCH) {
            let middle = moved(start, &free, half);
            return self.drift(field, &middle, duration, changes);
        }
        let within = moved(start, &free, first);
        self.drift(field, &within, first, changes)?;
        let mut orbit = within.clone();
        let mut integrator = Integrator::new(graded);
        let parts = [(first, half, S::one()), (half, last, -S::one())];
        for (number, change) in changes.iter_mut().enumerate() {
            let from = [&within, self.parameters, &change.state, &change.parameters];
            let mut state = [&from.concat()[..], &[first, S::one()]].concat();
            for (begin, end, side) in parts {
                grade(&mut integrator, &mut state, [begin, end], side)?;
            }
            let varied = self.of.dimension + self.parameters.len();
            change.state.copy_from_slice(&state[varied..varied + self.of.dimension]);
            if number == 0 {
                orbit.copy_from_slice(&state[..self.of.dimension]);
            }
        }
        self.drift(field, &orbit, last, changes)
    }

    /// Carries variations for a short time with their rates at a state.
    fn drift(
        &self,
        field: &VariedField,
        state: &[S],
        time: S,
        changes: &mut [Variation<S>],
    ) -> Option<()> {
        for change in changes {
            let slopes = self.values(&field.slopes, state, change);
            self.delay(change, &slopes, time);
            if !change.state.iter().all(|value| value.is_finite()) {
                return None;
            }
        }
        Some(())
    }

    /// Time near a state on a surface in which the depth is rounding; `None` for a state that is
    /// not on the surface.
    fn stretch(&self, surface: usize, state: &[S]) -> Option<S> {
        let still = self.of_state(vec![S::zero(); self.of.dimension]);
        let motion = self.values(&self.of.surfaces[surface].motion, state, &still);
        let size = state.iter().fold(S::one(), |size, x| size.max(x.abs()));
        let rounding = size * S::from_f64(S::ROUNDOFF);
        (motion[0].abs() <= rounding * S::from_f64(ON_SURFACE))
            .then(|| rounding * S::from_f64(RESOLVED) / motion[1].abs())
    }

    /// Rates just before and just after the beginning or the end, on the surface, of a contact
    /// whose law is not analytic there; `None` for other events.
    ///
    /// NOTE: on the surface, because of rounding, the law may not be defined. It changes the rates
    /// by what it changes them by beside the surface, in the contact.
    pub(super) fn beside(&self, event: &Change<S>) -> Option<(Vec<S>, Vec<S>)> {
        let (regime, side) = match event.kind {
            ChangeKind::Begin => (event.regimes[1], S::one()),
            ChangeKind::Release => (event.regimes[0], -S::one()),
            ChangeKind::Impact | ChangeKind::Rest => return None,
        };
        let field = self.of.field(regime).filter(|field| field.graded.is_some())?;
        let state = &event.states[0];
        let stretch = self.stretch(event.surface, state)?;
        let free = self.rates(&self.of.free, state);
        let inside = moved(state, &free, side * stretch);
        let beside = [&self.of.free, field].map(|field| self.rates(field, &inside));
        let held = free.iter().zip(beside[0].iter().zip(&beside[1]));
        let held = held.map(|(&rate, (&free, &held))| rate + (held - free)).collect();
        Some(if event.kind == ChangeKind::Begin { (free, held) } else { (held, free) })
    }
}

/// Carries a state, its variation and the graded time `T` from one value of `T` to another.
fn grade<S: Real>(
    integrator: &mut Integrator<'_, S>,
    state: &mut [S],
    [begin, end]: [S; 2],
    side: S,
) -> Option<()> {
    let place = state.len() - 2;
    let whole = (end / begin).ln() * side;
    let pieces = whole.to_f64().ceil().max(1.0);
    let length = whole / S::from_f64(pieces);
    for piece in 0..pieces as usize {
        let passed = length * S::from_f64(piece as f64);
        state[place..].copy_from_slice(&[begin * (side * passed).exp(), side]);
        let carried = integrator.carry(state, &[], length);
        if carried.not_finite || carried.remaining != S::zero() {
            return None;
        }
    }
    Some(())
}
