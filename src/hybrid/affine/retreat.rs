//! Free flight backward to where a gap was zero or least, where it is convex along the way.
//!
//! One idea: a convex gap that is negative now was zero once, and one that rises now was least once, as far back as the
//! series about the present goes.

use super::leap::LeapBuffers;
use super::newton::GapCourse;
use crate::flow::AffineLeaps;
use crate::hybrid::backward::Back;
use crate::numeric::{Kernel, Real};

/// A retreat to be flown.
pub(super) struct Retreat<'t, S: Real> {
    pub(super) leaps: &'t AffineLeaps<S>,
    pub(super) extended: &'t [S],
    pub(super) buffers: &'t mut LeapBuffers<S>,
    pub(super) surface: usize,
    pub(super) goal: Back,
    pub(super) longest: S,
    /// Where the states go.
    pub(super) states: &'t mut [S],
}

impl<S: Real> Kernel for Retreat<'_, S> {
    type Output = Option<S>;

    #[inline(always)]
    fn run(self) -> Option<S> {
        let visit = &mut self.buffers.visit;
        visit.forget();
        let mut gap = GapCourse {
            leaps: self.leaps,
            extended: self.extended,
            surface: self.surface,
            visit,
        };
        let time = match self.goal {
            Back::ToSurface => gap.fall_about(0, S::zero()).ok()?,
            Back::ToMinimum => gap.turn_about(0, S::zero()).ok()?.time,
        };
        let series = &gap.visit.series;
        let starts_right = match self.goal {
            Back::ToSurface => series[0] < S::zero(),
            Back::ToMinimum => series[1] > S::zero(),
        };
        let is_reached = starts_right && time < S::zero() && -time <= self.longest;
        if !is_reached || !is_convex(series, self.leaps.reach().to_f64()) {
            return None;
        }
        visit.states_at(time, self.leaps, self.extended, self.states);
        Some(-time)
    }
}

/// Whether the second derivative is positive from the start of a series to a distance: it is larger than the sum of what
/// its further terms can take away.
#[inline(always)]
fn is_convex<S: Real>(series: &[S], reach: f64) -> bool {
    let mut bound = 0.0;
    for (degree, coefficient) in series.iter().enumerate().skip(3).rev() {
        bound = (bound + (degree * (degree - 1)) as f64 * coefficient.magnitude()) * reach;
    }
    2.0 * series[2].to_f64() > bound
}
