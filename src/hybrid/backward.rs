//! Free flight backward in time, to the minimum of a gap or to the surface itself.

use super::passage::{Gap, Goal, Passage};
use super::simulator::Simulator;
use super::stepping::admissible_length;
use super::trajectory::Outcome;
use crate::numeric::Real;

/// Where a backward flight ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Back {
    /// At the first local minimum of the gap, whatever its depth.
    ToMinimum,
    /// Where the gap, negative at the start, rises through zero.
    ToSurface,
}

/// Most backward steps.
const MAX_STEPS: usize = 10_000;

impl<S: Real> Simulator<'_, S> {
    /// Flies freely backward, at most until the time `earliest`; `false` if that came first.
    pub(super) fn back(
        &mut self,
        surface: usize,
        goal: Back,
        earliest: S,
    ) -> Result<bool, Outcome<S>> {
        for _ in 0..MAX_STEPS {
            let remaining = self.motion.time - earliest;
            if remaining <= S::zero() {
                return Ok(false);
            }
            if self.step_back(surface, goal, remaining)? {
                self.motion.at_minimum = (goal == Back::ToMinimum).then_some(surface);
                return Ok(true);
            }
        }
        Err(Outcome::StepLimit {
            limit: MAX_STEPS,
            time: self.motion.time,
        })
    }

    fn step_back(&mut self, surface: usize, goal: Back, remaining: S) -> Result<bool, Outcome<S>> {
        let Ok(step) = self.free.step(&self.motion.state, &self.parameters) else {
            return Err(Outcome::Diverged {
                time: self.motion.time,
            });
        };
        let length = admissible_length(&step, self.surfaces.len()).min(remaining);
        let (value, slope) = (
            step.watched_coefficients(2 * surface),
            step.watched_coefficients(2 * surface + 1),
        );
        // In s = −t the gap is Σ g_k (−s)^k, its slope −g'(−s); the surface is where −gap falls through 0.
        let (value_sign, goal) = match goal {
            Back::ToMinimum => (S::one(), Goal::Minima),
            Back::ToSurface => (
                -S::one(),
                Goal::Crossing {
                    near: S::from_f64(-1.0),
                },
            ),
        };
        alternate(value, value_sign, &mut self.reversed.0);
        alternate(slope, -value_sign, &mut self.reversed.1);
        let gap = Gap {
            value: &self.reversed.0,
            slope: &self.reversed.1,
            sign: S::one(),
        };
        self.found.clear();
        self.search.search(
            &gap,
            length,
            self.motion.start(surface),
            goal,
            &mut self.found,
        );
        let found = self.found.first().map(Passage::time);
        let time = found.unwrap_or(length);
        step.state_at(-time, &mut self.next);
        std::mem::swap(&mut self.motion.state, &mut self.next);
        self.motion.time -= time;
        Ok(found.is_some())
    }
}

/// Coefficients of `sign · p(−s)`.
fn alternate<S: Real>(coefficients: &[S], sign: S, out: &mut Vec<S>) {
    out.clear();
    let mut sign = sign;
    for &coefficient in coefficients {
        out.push(coefficient * sign);
        sign = -sign;
    }
}
