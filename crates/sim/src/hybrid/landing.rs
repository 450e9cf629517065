//! The state brought onto the surface it was flown to.
//!
//! The time of an event is a root of a polynomial and the state there the value of others: it lies
//! beside the surface by the rounding of its largest component, and a stiff contact multiplies that
//! distance by its acceleration. One step of Newton's method along the *free* flow,
//!
//! ```text
//! x += f s,   t += s,   s = −g(x) / L_f g(x),
//! ```
//!
//! leaves the rounding of `g` alone. `g` is the gap where a contact begins, the release function
//! where one ends; see docs/mathematics/direct-simulation.md for why the free flow serves both.

use super::motion::Regime;
use super::passage::{Landing, REDUCED, ends_before_turn};
use super::simulator::Simulator;
use crate::numeric::Real;

impl<S: Real> Simulator<'_, S> {
    /// Brings the state onto the zero it has landed beside, where it meets it transversally.
    ///
    /// NOTE: where the step does not halve the distance or leads to where `g` turns, `|g g''| ≥
    /// g'²`, the depth of the approach is itself within the rounding of `g`: nothing is known
    /// that a correction could restore, and the state stays where it is.
    pub(super) fn settle_on(&mut self, landing: Landing) {
        let falling = match landing {
            Landing::Contact { .. } => S::one(),
            Landing::Release { .. } => self.motion.release_sign,
        };
        let Some((value, slope)) = self.read_landing(landing) else {
            return;
        };
        if value == S::zero() || slope * falling >= S::zero() {
            return;
        }
        if let Landing::Contact { surface } = landing
            && !ends_before_turn(value, slope, self.sense(surface).acceleration)
        {
            return;
        }
        let shift = -value / slope;
        self.work.next.copy_from_slice(&self.motion.state);
        for (state, &rate) in self.motion.state.iter_mut().zip(&self.work.landing[2..]) {
            *state = rate.mul_add(shift, *state);
        }
        let after = match landing {
            Landing::Contact { surface } => Some(self.clearance(surface).gap),
            Landing::Release { .. } => self
                .read_landing(landing)
                .filter(|after| (after.1 - slope).abs() < slope.abs())
                .map(|after| after.0),
        };
        if after.is_some_and(|after| after.abs() <= value.abs() * S::from_f64(REDUCED)) {
            self.motion.time += shift;
        } else {
            self.motion.state.copy_from_slice(&self.work.next);
        }
    }

    /// The same at the end of a compliant contact; a resting contact ends where nothing jumps.
    pub(super) fn settle_on_release(&mut self) {
        if let Regime::Contact { surface } = self.motion.regime {
            self.settle_on(Landing::Release { surface });
        }
    }

    /// Value and slope of the function at the present state, put to the working memory with the
    /// rates of the free flow; `None` for a surface that has none.
    fn read_landing(&mut self, landing: Landing) -> Option<(S, S)> {
        let Self { affine, motion, parameters, work, surfaces, .. } = self;
        let values = &mut work.landing;
        let is_read = affine
            .as_mut()
            .is_some_and(|tools| tools.read_landing(landing, motion, parameters, values));
        if !is_read {
            let evaluator = match landing {
                Landing::Contact { surface } => Some(&mut surfaces[surface].contact),
                Landing::Release { surface } => surfaces[surface].release.as_mut(),
            }?;
            let found = evaluator.evaluate(&motion.state, parameters);
            let count = values.len();
            values.copy_from_slice(&found[..count]);
        }
        Some((values[0], values[1]))
    }
}
