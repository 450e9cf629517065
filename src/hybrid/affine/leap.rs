//! Free flight to the next contact over a span of several steps, where nothing but contacts is asked for.
//!
//! One idea: the control points of every gap on one piece after another say that there is no zero, or exactly one, which
//! is found there; what they leave open is left to the general search, from the start of that piece.

use super::flight::{ROUNDING, signs};
use crate::flow::AffineLeaps;
use crate::hybrid::flight::Outlook;
use crate::numeric::{Kernel, Real, polynomial};

/// Where a leap ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::hybrid) enum Leap<S> {
    /// After the time asked for, or the whole span where that is longer.
    Quiet {
        /// Time flown.
        time: S,
    },
    /// A surface is met.
    Contact {
        /// The surface.
        surface: usize,
        /// Time flown.
        time: S,
    },
    /// Nothing happened so far; what follows must be searched.
    Open {
        /// Time flown.
        time: S,
    },
}

impl<S: Copy> Leap<S> {
    /// Time flown.
    pub(in crate::hybrid) fn time(&self) -> S {
        match *self {
            Leap::Quiet { time } | Leap::Contact { time, .. } | Leap::Open { time } => time,
        }
    }
}

/// Working memory of leaps.
#[derive(Clone, Debug)]
pub(super) struct LeapBuffers<S> {
    pub(super) series: Vec<S>,
    pub(super) control: Vec<f64>,
    pub(super) rounded: Vec<f64>,
    /// Rounding of the control points of each gap.
    pub(super) rounding: Vec<f64>,
}

impl<S: Real> LeapBuffers<S> {
    pub(super) fn new(leaps: &AffineLeaps<S>, columns: usize, surfaces: usize) -> Self {
        Self {
            series: vec![S::zero(); leaps.terms()],
            control: vec![0.0; leaps.points()],
            rounded: vec![0.0; columns],
            rounding: vec![0.0; surfaces],
        }
    }
}

/// A leap to be flown.
pub(super) struct Leaper<'t, S: Real> {
    pub(super) leaps: &'t AffineLeaps<S>,
    pub(super) extended: &'t [S],
    pub(super) buffers: &'t mut LeapBuffers<S>,
    /// The longest flight asked for.
    pub(super) longest: S,
    /// Per surface whether its gap may start at zero.
    pub(super) leaving: &'t [Option<S>],
    /// Where the states after the leap go.
    pub(super) states: &'t mut [S],
}

/// Most steps of Newton's method, and most changes of the node.
const MAX_NEWTON: usize = 8;

impl<S: Real> Kernel for Leaper<'_, S> {
    type Output = Leap<S>;

    #[inline(always)]
    fn run(mut self) -> Leap<S> {
        for (rounded, value) in self.buffers.rounded.iter_mut().zip(self.extended) {
            *rounded = value.to_f64();
        }
        for (surface, rounding) in self.buffers.rounding.iter_mut().enumerate() {
            *rounding = ROUNDING * self.leaps.size(surface, &self.buffers.rounded);
        }
        let leap = self.fly();
        let Self {
            leaps,
            extended,
            buffers,
            states,
            ..
        } = self;
        leaps.states_at(leap.time(), extended, &mut buffers.series, states);
        leap
    }
}

impl<S: Real> Leaper<'_, S> {
    #[inline(always)]
    fn fly(&mut self) -> Leap<S> {
        let quiet = self.longest.min(self.leaps.span());
        for piece in 0..self.leaps.pieces() {
            let start = self.leaps.piece() * piece as f64;
            if start >= quiet.to_f64() {
                break;
            }
            let mut first = None;
            for surface in 0..self.leaving.len() {
                let crossing = match self.look(surface, piece) {
                    Some(Outlook::OneCrossing { near }) => {
                        self.crossing(surface, start + near * self.leaps.piece())
                    }
                    Some(_) => continue,
                    None => None,
                };
                let Some(time) = crossing else {
                    return Leap::Open {
                        time: self.leaps.node(start).1,
                    };
                };
                if first.is_none_or(|(_, earlier)| time < earlier) {
                    first = Some((surface, time));
                }
            }
            if let Some((surface, time)) = first {
                return if time <= quiet {
                    Leap::Contact { surface, time }
                } else {
                    Leap::Quiet { time: quiet }
                };
            }
        }
        Leap::Quiet { time: quiet }
    }

    /// What the control points of a gap on a piece tell of its zeros.
    #[inline(always)]
    fn look(&mut self, surface: usize, piece: usize) -> Option<Outlook> {
        let LeapBuffers {
            control,
            rounded,
            rounding,
            ..
        } = &mut *self.buffers;
        self.leaps.look(surface, piece, rounded, control);
        let on_zero = piece == 0 && self.leaving[surface].is_some();
        signs(control, on_zero, rounding[surface])
    }

    /// The one zero of a gap near a time, by Newton's method about the nearest node, from the zero of the parabola there.
    ///
    /// After a step `Δ` the error is about `Δ² |h''/2h'|`; `h''` is taken from the last two slopes, and twice as large.
    #[inline(always)]
    fn crossing(&mut self, surface: usize, near: f64) -> Option<S> {
        let (leaps, series) = (self.leaps, &mut self.buffers.series[..]);
        let spacing = leaps.spacing();
        let rounding = S::from_f64(0.25 * S::ROUNDOFF) * spacing;
        let least = S::from_f64(4.0) / spacing;
        let mut guess = S::from_f64(near);
        for _ in 0..MAX_NEWTON {
            let (node, start) = leaps.node(guess.to_f64());
            leaps.watched_series(surface, node, self.extended, series);
            let parabola = falling_root(series).filter(|time| time.abs() <= spacing + spacing);
            let mut time = parabola.unwrap_or(guess - start);
            let mut before = None;
            for _ in 0..MAX_NEWTON {
                let (value, slope) = polynomial::value_and_slope(series, time);
                let change = -value / slope;
                let is_last = |(last, last_slope): (S, S)| {
                    let bend = (slope - last_slope) / ((time - last) * slope);
                    (bend.abs() + least) * change * change <= rounding
                };
                let settled = change == S::zero() || before.is_some_and(is_last);
                before = Some((time, slope));
                time += change;
                let is_near = time.abs() <= spacing;
                if settled && is_near {
                    return (slope < S::zero()).then_some(start + time);
                }
                if !is_near {
                    break;
                }
            }
            guess = start + time;
            if !(guess > -spacing && guess < leaps.span() + spacing) {
                return None;
            }
        }
        None
    }
}

/// Where the parabola of a series' first terms falls through zero, to `f64`.
#[inline(always)]
fn falling_root<S: Real>(series: &[S]) -> Option<S> {
    let [value, slope, curvature] = series.first_chunk()?.map(Real::to_f64);
    let root = (slope * slope - 4.0 * value * curvature).sqrt();
    let time = 2.0 * value / (root - slope);
    time.is_finite().then(|| S::from_f64(time))
}
