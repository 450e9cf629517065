//! The interval of a parameter in which the orbit that the free flow settles on does not touch: the
//! orbit is followed to both sides, to its first graze or fold.

use super::{
    FAR, Family, FamilyPoint, Graze, HALVINGS, NEAR_SETTLED, Periodic, STEPS, Search, Visit,
    lowest, scale, value_at,
};
use crate::continuation::{StepControl, apart, dot, point_on};
use crate::model::Scene;
use crate::orbit::effort::Effort;
use crate::orbit::grazing_orbit::Grazes;
use crate::orbit::outcome::{NotLocated, OrbitError, Stop, settled};
use crate::orbit::system::ExtendedSystem;

/// Interval of a parameter about a value in which a periodic orbit of the free flow neither
/// touches the surface nor ends.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearInterval {
    /// Full state of the orbit at the value.
    pub start: Vec<f64>,
    /// Lowest gap of the orbit at the value; negative where it goes beyond the surface.
    pub gap: f64,
    /// Lower and upper end of the interval; `None` if none was found.
    pub ends: [Option<IntervalEnd>; 2],
}

/// End of the interval of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum IntervalEnd {
    /// The orbit grazes.
    Graze {
        /// Value of the parameter.
        value: f64,
        /// Full state at the graze.
        state: Vec<f64>,
    },
    /// The orbit meets another one and both vanish.
    Fold {
        /// Value of the parameter.
        value: f64,
    },
}

impl IntervalEnd {
    /// Value of the parameter.
    pub fn value(&self) -> f64 {
        match self {
            Self::Graze { value, .. } | Self::Fold { value } => *value,
        }
    }
}

/// Interval of a parameter about a scene's value in which an orbit of the free flow does not touch
/// the grazed surface, by following that orbit to both sides.
///
/// The orbit is that near `start`, a full state, or near the scene's guess, or without either the
/// one that the flow settles on from rest. A parameter keeps its sign, and a frequency does not
/// fall below a twentieth.
///
/// # Errors
///
/// As [`locate`](crate::orbit::locate); [`OrbitError::AutonomousWithoutGuess`] for a model without
/// a phase, whose orbits are not followed in this way.
pub fn clear_interval(
    scene: &Scene,
    parameter: usize,
    start: Option<&[f64]>,
) -> Result<Result<ClearInterval, NotLocated>, OrbitError> {
    if scene.model.phase.is_none() {
        return Err(OrbitError::AutonomousWithoutGuess);
    }
    let mut scene = scene.clone();
    scene.grazing.solve_for = vec![parameter];
    let base = scene.model.parameter_values();
    let system = ExtendedSystem::new(&scene, Grazes::of(&scene)?, &base, &[parameter]);
    let system = system.first_graze(parameter);
    let limited = || system.clone().limited(&Effort::new(system.flow.field()));
    let settling = limited();
    let rest = || vec![0.0; scene.model.dimension()];
    let near = start.map(<[f64]>::to_vec).or_else(|| scene.grazing.guess.clone());
    let (is_near, value) = (near.is_some(), base[parameter].to_f64());
    let search = Search::new(&scene, &settling, parameter);
    let first = search.nominal(&near.unwrap_or_else(rest), value, is_near);
    let first = match settled(first)? {
        Ok(first) => first,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut ends = [None, None];
    for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
        let system = limited();
        let search = Search::new(&scene, &system, parameter);
        let mut family = Family::through(&search, &first, search.unit(&first)?);
        let mut visit = FirstEnd { first: &first, before: None, found: None };
        family.follow(&first, side, &STEPS_TO_END, &mut visit);
        *end = match family.error {
            None => visit.found,
            Some(OrbitError::SearchTooLong) => None,
            Some(error) => return Err(error),
        };
    }
    Ok(Ok(ClearInterval { start: first.start, gap: first.lowest.event, ends }))
}

/// Steps towards an end of an interval: an orbit may graze just beside the scene's.
const STEPS_TO_END: StepControl = StepControl { first: 0.01 * STEPS.first, most: 2000, ..STEPS };
/// Largest change of the lowest `h` in one step, relative to the range of `h`.
const CHANGE: f64 = 0.05;
/// Longest period along an interval, in that at its value: a frequency falls no lower.
const SLOWEST: f64 = 20.0;
/// Largest number of halvings at a fold.
const FOLD_HALVINGS: usize = 40;

impl Search<'_> {
    /// Periodic orbit that the free flow settles on from a full state, or the one near that state
    /// if it settles on none or is asked for.
    fn nominal(
        &self,
        start: &[f64],
        value: f64,
        is_near: bool,
    ) -> Result<Periodic, Stop<NotLocated>> {
        let near = || self.periodic(value, start);
        let first = match is_near {
            true => near(),
            false if self.system.flow.hits() => self.commonest(start, value),
            false => None,
        };
        if let Some(orbit) = first {
            return Ok(orbit);
        }
        let (settled, change) = self.settle(start, value);
        let reach = NEAR_SETTLED * self.system.length(&self.unknowns(&settled, value));
        let orbit = self.periodic(value, &settled);
        let orbit = orbit.filter(|orbit| apart(&orbit.start, &settled) < reach);
        let orbit = orbit.or_else(near);
        orbit.ok_or_else(|| Stop::Ended(self.no_orbit(start, value, change)))
    }

    /// Unit of the parameter at an orbit: its size, or if that is larger, the change that moves the
    /// states or the gap by as much as they are.
    fn unit(&self, orbit: &Periodic) -> Result<f64, OrbitError> {
        let size = orbit.value.abs();
        let trial = if size > 0.0 { size } else { 1.0 };
        let mut family = Family::through(self, orbit, trial);
        let [start, along] = family.start(orbit, 1.0);
        let there = point_on(&mut family, &start, [&start, &along], &along);
        if let Some(error) = family.error {
            return Err(error);
        }
        let by_states = there.map_or(f64::INFINITY, |point| {
            let (parameter, states) = point.tangent.split_last().unwrap_or((&0.0, &[]));
            trial * parameter.abs() / dot(states, states).sqrt()
        });
        let local = self.system.geometry(0).at(&orbit.lowest.state, &self.parameters(orbit.value));
        let slope = local.event_gradient()[self.system.dimension + self.parameter].abs();
        let by_gap = (orbit.largest - orbit.lowest.event) / slope;
        let natural = by_states.min(by_gap);
        Ok(match natural.is_finite() {
            true => size.max(natural),
            false => scale(size),
        })
    }
}

/// Search for the first graze or fold on one side of an orbit.
struct FirstEnd<'a> {
    first: &'a Periodic,
    /// Last point but two.
    before: Option<FamilyPoint>,
    found: Option<IntervalEnd>,
}

impl Visit for FirstEnd<'_> {
    fn may_pass(&self, [here, next]: [&FamilyPoint; 2]) -> bool {
        let Some(orbit) = &here.linearised.extra else { return false };
        let change = (lowest(next) - lowest(here)).abs();
        change <= CHANGE * (orbit.largest - orbit.lowest.event)
            || !change.is_finite()
            || apart(&here.unknowns, &next.unknowns) < CHANGE * STEPS.first
    }

    fn is_last(&mut self, family: &mut Family<'_>, [here, next]: [&FamilyPoint; 2]) -> bool {
        let Some(orbit) = &next.linearised.extra else { return true };
        let dip = self.before.as_ref().and_then(|before| family.dip(before, here, next));
        self.before = Some(here.clone());
        for to in dip.iter().chain([next]) {
            if lowest(here) * lowest(to) < 0.0
                && let Some(graze) = family.graze_inside([here, to])
            {
                let state = graze.unknowns[..family.search.system.dimension].to_vec();
                self.found = Some(IntervalEnd::Graze { value: graze.value, state });
                return true;
            }
        }
        let parameter = family.search.system.states;
        if next.tangent[parameter] * here.tangent[parameter] < 0.0 {
            self.found = Some(IntervalEnd::Fold { value: family.fold([here, next]) });
            return true;
        }
        let [period, first] = [orbit, self.first].map(|orbit| family.period(orbit));
        orbit.value * self.first.value < 0.0
            || (orbit.value - self.first.value).abs() > FAR * family.units[parameter]
            || !(0.0..SLOWEST * first).contains(&period)
    }
}

impl Family<'_> {
    /// Graze between two points at which the lowest `h` has opposite signs, at a value between
    /// theirs: Newton's method may come to a further one.
    fn graze_inside(&mut self, ends: [&FamilyPoint; 2]) -> Option<Graze> {
        let (mut ends, mut found) = (ends.map(Clone::clone), None);
        for _ in 0..HALVINGS {
            let [from, to] = ends.each_ref().map(value_at);
            let Some(graze) = self.graze_between(ends.each_ref()) else { break };
            let is_inside = (graze.value - from) * (graze.value - to) <= 0.0;
            found = Some(graze);
            if is_inside || self.halve(&mut ends, lowest).is_none() {
                break;
            }
        }
        found
    }

    fn period(&self, orbit: &Periodic) -> f64 {
        let Search { system, .. } = self.search;
        system.period(&self.search.unknowns(&orbit.start, orbit.value))
    }

    /// Orbit between three others at which the lowest `h` has another sign, where a parabola
    /// through theirs has.
    fn dip(
        &mut self,
        before: &FamilyPoint,
        here: &FamilyPoint,
        next: &FamilyPoint,
    ) -> Option<FamilyPoint> {
        let sign = lowest(here).signum();
        let [a, b, c] = [before, here, next].map(|point| sign * lowest(point));
        if !(b < a && b < c && a.is_finite() && c.is_finite()) {
            return None;
        }
        let left = -apart(&before.unknowns, &here.unknowns);
        let right = apart(&next.unknowns, &here.unknowns);
        // b + s (place) + q place²
        let (by_left, by_right) = ((a - b) / left, (c - b) / right);
        let curvature = (by_right - by_left) / (right - left);
        let slope = by_right - curvature * right;
        let place = -0.5 * slope / curvature;
        if b + 0.5 * slope * place > 0.5 * b {
            return None;
        }
        let (there, length) = if place < 0.0 { (before, -left) } else { (next, right) };
        let middle = self.between([here, there], place.abs() / length)?;
        (sign * lowest(&middle) < 0.0).then_some(middle)
    }

    /// Value of the parameter at the fold between two points of the curve.
    fn fold(&mut self, ends: [&FamilyPoint; 2]) -> f64 {
        let last = self.search.system.states;
        let mut ends = ends.map(Clone::clone);
        for _ in 0..FOLD_HALVINGS {
            if self.halve(&mut ends, |point| point.tangent[last]).is_none() {
                break;
            }
        }
        value_at(&ends[0])
    }
}
