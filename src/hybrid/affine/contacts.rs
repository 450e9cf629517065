//! The first contact of a free flight, in as many columns as the compiler knows.
//!
//! One idea: control points say whether a gap stays open on a piece, falls through zero once, or has one minimum, which then says
//! whether there is a contact before it. A series about the node nearest to a contact has it.

use super::newton::turn;
use super::parabolas::falling_zero;
use super::polygon::{Piece, Polygon, ROUNDING};
use crate::flow::{FixedLeaps, FixedVisit, SERIES};
use crate::numeric::{Branched, Real, polynomial};

/// A flight on which contacts are looked for.
pub(super) struct Contacts<'t, S: Real, const C: usize, const B: usize> {
    pub(super) leaps: &'t FixedLeaps<'t, S, C, B>,
    pub(super) extended: &'t [S; C],
    /// The time up to which contacts are of interest.
    pub(super) until: S,
    pub(super) visit: &'t mut FixedVisit<S, B>,
}

/// A contact to be found: near a time, and within which.
struct Sought<S> {
    near: f64,
    within: Option<[S; 2]>,
}

impl<S: Real, const C: usize, const B: usize> Contacts<'_, S, C, B> {
    /// The time of the first contact, if there is one; `None` where control points do not decide. `leaving` says that the surface has
    /// just been left.
    #[inline(always)]
    pub(super) fn first(&mut self, leaving: bool) -> Option<Option<S>> {
        let leaps = self.leaps;
        let until = self.until.to_f64();
        let rounding = ROUNDING * leaps.size(self.extended);
        let mut rounded = [0.0; C];
        for (rounded, value) in rounded.iter_mut().zip(self.extended) {
            *rounded = value.to_f64();
        }
        for piece in 0..leaps.pieces() {
            let from = leaps.piece() * piece as f64;
            if from >= until {
                break;
            }
            let points = leaps.look(piece, &rounded);
            let polygon = Polygon {
                points: points.as_flattened(),
                rounding,
            };
            let on_zero = piece == 0 && leaving;
            let sought = if polygon.is_above(0.0, on_zero) {
                None
            } else {
                let fall = polygon.one_fall(on_zero);
                if fall.exists {
                    Some(Sought {
                        near: from + polygon.fall(&fall) * leaps.piece(),
                        within: None,
                    })
                } else if on_zero {
                    return None;
                } else {
                    self.unclear(&polygon, from)?
                }
            };
            if let Some(sought) = sought
                && let Some(time) = self.found(&sought)?
            {
                return Some(Some(time));
            }
            if from + leaps.piece() >= until {
                break;
            }
        }
        Some(None)
    }

    /// What is to be sought on a piece where control points come near the surface; `None` where that is not known.
    #[inline(always)]
    fn unclear(&mut self, polygon: &Polygon<'_, f64>, from: f64) -> Option<Option<Sought<S>>> {
        let [starts, ends] = polygon.ends_above();
        let shape = polygon.shape(false);
        if shape.known && shape.falls && shape.turns {
            return self.valley(polygon, from, polygon.turn(&shape));
        }
        let falls_at_end = shape.falls || shape.turns;
        let stays_open = shape.known && (starts || shape.falls) && (ends || !falls_at_end);
        stays_open.then_some(None)
    }

    /// The same of a gap with one extremum, a minimum near a place.
    #[inline(always)]
    fn valley(
        &mut self,
        polygon: &Polygon<'_, f64>,
        from: f64,
        place: f64,
    ) -> Option<Option<Sought<S>>> {
        let (length, reach) = (self.leaps.piece(), self.leaps.reach());
        let near = from + place * length;
        let start = self.leaps.go_to(near, self.extended, self.visit)?;
        let series = self.leaps.watched_series(self.visit);
        let mut slopes = [S::zero(); SERIES];
        let guess = S::from_f64(near) - start;
        let mut minimum = turn(series.as_flattened(), &mut slopes, guess, reach, true);
        minimum.time += start;
        let first = S::from_f64(from);
        let last = first + S::from_f64(length);
        if !minimum.found || minimum.time < first || minimum.time > last {
            return None;
        }
        if minimum.gap >= S::zero() {
            return (minimum.gap > S::zero()).then_some(None);
        }
        let reach = reach.to_f64();
        let piece = Piece {
            from,
            length,
            reach,
        };
        let (near, known) = polygon.fall_before(&minimum, piece, true);
        if !known {
            return None;
        }
        let within = Some([first, minimum.time]);
        Some(Some(Sought { near, within }))
    }

    /// The contact that is sought, where it does not lie later than is of interest; `None` where it is not known about the nearest
    /// node.
    #[inline(always)]
    fn found(&mut self, sought: &Sought<S>) -> Option<Option<S>> {
        let (leaps, until) = (self.leaps, self.until.to_f64());
        let Sought { near, within } = *sought;
        if near > until {
            let start = leaps.go_to(until, self.extended, self.visit)?;
            let series = leaps.watched_series(self.visit);
            if polynomial::value(series.as_flattened(), self.until - start) > S::zero() {
                return Some(None);
            }
        }
        let start = leaps.go_to(near, self.extended, self.visit)?;
        let series = leaps.watched_series(self.visit);
        let series = series.as_flattened();
        let mut room = [0.0; SERIES];
        let rounded = S::all_rounded(series, &mut room);
        let reach = leaps.reach().to_f64();
        let guess = (S::from_f64(near) - start).to_f64();
        let zero = falling_zero(rounded, guess, reach, true).polished(series, reach);
        let time = start + zero.time;
        let is_outside = within.is_some_and(|[from, to]| time < from || time > to);
        if !zero.found || is_outside {
            return None;
        }
        Some((time <= self.until).then_some(time))
    }
}
