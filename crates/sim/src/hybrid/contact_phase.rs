//! One compliant contact by itself: from the surface to the release.

use super::HybridError;
use super::simulator::{Approach, Simulator, Stop, check_finite};
use super::system::Regime;
use super::trajectory::Outcome;
use crate::numeric::Real;

impl<S: Real> Simulator<'_, S> {
    /// Flies the contact with a compliant surface from a full state on it: the state at the release
    /// and the time since. A rigid surface applies its reset, in no time.
    ///
    /// `None` where the contact has not ended after `longest`, where another surface is met before,
    /// or where the simulation ends otherwise.
    ///
    /// # Errors
    ///
    /// [`HybridError::NoSuchSurface`], [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn contact_phase(
        &mut self,
        surface: usize,
        state: &[S],
        longest: S,
    ) -> Result<Option<(Vec<S>, S)>, HybridError> {
        let surfaces = self.surfaces.len();
        if surface >= surfaces {
            return Err(HybridError::NoSuchSurface { surface, surfaces });
        }
        check_finite(&[longest], 0)?;
        self.set_state(state)?;
        let released = self.fly_to_release(surface, longest).unwrap_or(false);
        Ok(released.then(|| (self.motion.state.clone(), self.motion.time)))
    }

    /// Applies the response and flies on until it is over; whether it was before `horizon`.
    fn fly_to_release(&mut self, surface: usize, horizon: S) -> Result<bool, Outcome<S>> {
        self.respond(surface, &mut |_| {})?;
        for _ in 0..self.step_limit {
            if self.regime() == Regime::Free {
                return Ok(true);
            }
            if self.motion.time >= horizon {
                return Ok(false);
            }
            match self.step(horizon, Approach::default(), &mut |_| {})? {
                None => {}
                Some(Stop::Release) => self.release(&mut |_| {}),
                Some(_) => return Ok(false),
            }
        }
        Ok(false)
    }
}
