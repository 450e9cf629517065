//! Branches of one motion: on a tangency section a motion with several minima of the gap in one
//! return has as many section points, and each of them a branch of its own.

use super::{DirectBranches, DirectTrace, guesses_at};
use crate::analysis::branches::trace::Traces;
use crate::analysis::motion::MotionEvents;
use crate::analysis::periodic::{ContactItinerary, DirectOrbit};
use crate::analysis::time_series::TimeSeriesRequest;
use crate::continuation::{corrected, unit_vector};

/// Places of orbits that are compared, as shares of the points of a branch.
const COMPARED: [f64; 3] = [0.25, 0.5, 0.75];
/// Distance, in units of the parameter, within which ends of branches are one.
const SAME_END: f64 = 1e-4;

/// A branch by its itinerary and its trace.
type OfItinerary<'t> = (&'t ContactItinerary, &'t DirectTrace);

impl DirectBranches<'_> {
    /// Drops branches whose motions are those of another one all the way, which reaches as far.
    pub(super) fn one_of_each_motion(&self, found: &mut Traces<DirectOrbit<f64>>) {
        if !self.image.is_on_tangency() {
            return;
        }
        let all: Vec<OfItinerary<'_>> = found
            .iter()
            .flat_map(|(of, traces)| traces.iter().map(move |trace| (of, trace)))
            .collect();
        let mut kept = vec![true; all.len()];
        for number in 0..all.len() {
            let is_of = |&other: &usize| {
                let both_ways = reaches_as_far(all[number].1, all[other].1);
                other != number
                    && kept[other]
                    && reaches_as_far(all[other].1, all[number].1)
                    && (other < number || !both_ways)
                    && self.is_motion_of(all[number], all[other])
            };
            kept[number] = !(0..all.len()).any(|other| is_of(&other));
        }
        let mut kept = kept.into_iter();
        for (_, traces) in found {
            traces.retain(|_| kept.next().unwrap_or(true));
        }
    }

    /// Whether the motions of a branch are those of another one.
    fn is_motion_of(&self, (itinerary, trace): OfItinerary<'_>, other: OfItinerary<'_>) -> bool {
        let points = &trace.points;
        COMPARED.iter().all(|share| {
            let point = &points[(share * points.len() as f64) as usize];
            let orbit = &point.linearised.extra;
            let at = point.unknowns[point.unknowns.len() - 1];
            let length = self.forcing_periods(itinerary, orbit);
            let is_like = |there: &DirectOrbit<f64>| {
                there.hits == orbit.hits && self.forcing_periods(other.0, there) == length
            };
            if !other.1.points.iter().any(|point| is_like(&point.linearised.extra)) {
                return false;
            }
            let others = self.orbits_at(other, at).into_iter().filter(is_like);
            let motions = others.filter_map(|there| self.motion(other.0, &there, at));
            let motions: Vec<MotionEvents> = motions.collect();
            let own = || self.motion(itinerary, orbit, at);
            !motions.is_empty()
                && own().is_some_and(|own| motions.iter().any(|of| of.is_same(&own)))
        })
    }

    fn forcing_periods(&self, itinerary: &ContactItinerary, orbit: &DirectOrbit<f64>) -> i64 {
        (itinerary.period() * self.scene.grazing.periods) as i64 + i64::from(orbit.turns)
    }

    /// Orbits of a branch at a value of the varied parameter, in units.
    fn orbits_at(&self, (itinerary, trace): OfItinerary<'_>, at: f64) -> Vec<DirectOrbit<f64>> {
        let mut equations = self.equations_with(itinerary, &trace.points[0].linearised.extra);
        let last = trace.points[0].unknowns.len() - 1;
        let normal = unit_vector(last + 1, last);
        let orbits = guesses_at(trace, at)
            .filter_map(|guess| Some(corrected(&mut equations, &guess, &guess, &normal)?.1.extra));
        orbits.collect()
    }

    fn motion(
        &self,
        itinerary: &ContactItinerary,
        orbit: &DirectOrbit<f64>,
        at: f64,
    ) -> Option<MotionEvents> {
        let flight = TimeSeriesRequest {
            start: orbit.states[0].clone(),
            parameters: self.request.parameters(at * self.units.parameters[0]),
            settle: 0,
            returns: 2 * itinerary.period(),
            samples: 1,
        };
        MotionEvents::of(self.scene, self.orbit, &flight).ok().flatten()
    }
}

/// Whether a branch covers the values of the varied parameter of another one.
fn reaches_as_far(branch: &DirectTrace, other: &DirectTrace) -> bool {
    let ends = |trace: &DirectTrace| {
        let values = trace.points.iter().filter_map(|point| point.unknowns.last().copied());
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    };
    let ([low, high], [from, to]) = (ends(branch), ends(other));
    low <= from + SAME_END && high >= to - SAME_END
}
