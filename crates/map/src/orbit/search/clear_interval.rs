//! The interval of a parameter in which the orbit that the free flow settles on does not touch: the
//! orbit is followed to both sides, to its first graze or fold.

use super::{
    Curve, FAR, FamilyPoint, GROWTH, Graze, HALVINGS, LARGEST_STEP, NEAR_SETTLED, Periodic,
    SMALLEST_STEP, STEP, Search, distance, dot, moved, scale,
};
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
        let found = search
            .unit(&first)
            .and_then(|unit| Curve::through(&search, &first, unit).first_end(&first, side));
        *end = match found {
            Err(OrbitError::SearchTooLong) => None,
            found => found?,
        };
    }
    Ok(Ok(ClearInterval { start: first.start, gap: first.lowest.event, ends }))
}

/// First step, in units of the curve: an orbit may graze just beside the scene's.
const FIRST_STEP: f64 = 0.01 * STEP;
/// Largest change of the lowest `h` in one step, relative to the range of `h`.
const CHANGE: f64 = 0.05;
/// Longest period along an interval, in that at its value: a frequency falls no lower.
const SLOWEST: f64 = 20.0;
/// Largest number of steps towards an end of an interval, and of halvings at a fold.
const MOST_STEPS_TO_END: usize = 2000;
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
        let orbit = orbit.filter(|orbit| distance(&orbit.start, &settled) < reach);
        let orbit = orbit.or_else(near);
        orbit.ok_or_else(|| Stop::Ended(self.no_orbit(start, value, change)))
    }

    /// Unit of the parameter at an orbit: its size, or if that is larger, the change that moves the
    /// states or the gap by as much as they are.
    fn unit(&self, orbit: &Periodic) -> Result<f64, OrbitError> {
        let size = orbit.value.abs();
        let trial = if size > 0.0 { size } else { 1.0 };
        let start = Curve::through(self, orbit, trial).start(orbit, 1.0)?;
        let by_states = start.map_or(f64::INFINITY, |point| {
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

impl Curve<'_> {
    /// First graze or fold on one side of an orbit.
    fn first_end(&self, first: &Periodic, side: f64) -> Result<Option<IntervalEnd>, OrbitError> {
        let states = self.search.system.states;
        let Some(mut here) = self.start(first, side)? else { return Ok(None) };
        let (mut before, mut step): (Option<FamilyPoint>, f64) = (None, FIRST_STEP);
        for _ in 0..MOST_STEPS_TO_END {
            let next = self.stepped(&here, step)?;
            let range = here.orbit.largest - here.orbit.lowest.event;
            let is_fine = |next: &FamilyPoint| {
                let change = (next.orbit.lowest.event - here.orbit.lowest.event).abs();
                change <= CHANGE * range || !change.is_finite() || step < STEP * CHANGE
            };
            let Some(next) = next.filter(is_fine) else {
                step *= 0.5;
                if step < SMALLEST_STEP {
                    return Ok(None);
                }
                continue;
            };
            let dip = before.as_ref().map(|before| self.dip(before, &here, &next)).transpose()?;
            let [crossed, rest] = [dip.flatten(), Some(next.clone())];
            for to in crossed.into_iter().chain(rest) {
                if here.orbit.lowest.event * to.orbit.lowest.event < 0.0
                    && let Some(graze) = self.graze_inside(&here, &to)?
                {
                    let state = graze.unknowns[..self.search.system.dimension].to_vec();
                    return Ok(Some(IntervalEnd::Graze { value: graze.value, state }));
                }
            }
            if next.tangent[states] * here.tangent[states] < 0.0 {
                return Ok(Some(IntervalEnd::Fold { value: self.fold(&here, &next)? }));
            }
            let period = self.period(&next.orbit);
            let unit = self.units[states];
            if next.orbit.value * first.value < 0.0
                || (next.orbit.value - first.value).abs() > FAR * unit
                || !(0.0..SLOWEST * self.period(first)).contains(&period)
            {
                return Ok(None);
            }
            before = Some(std::mem::replace(&mut here, next));
            step = (step * GROWTH).min(LARGEST_STEP);
        }
        Ok(None)
    }

    /// Graze between two points at which the lowest `h` has opposite signs, at a value between
    /// theirs: Newton's method may come to a further one.
    fn graze_inside(
        &self,
        here: &FamilyPoint,
        to: &FamilyPoint,
    ) -> Result<Option<Graze>, OrbitError> {
        let (mut ends, mut found) = ([here.clone(), to.clone()], None);
        for _ in 0..HALVINGS {
            let [from, to] = [0, 1].map(|end| ends[end].orbit.value);
            let Some(graze) = self.graze_between(&ends[0], &ends[1])? else { break };
            let is_inside = (graze.value - from) * (graze.value - to) <= 0.0;
            found = Some(graze);
            if is_inside {
                break;
            }
            let Some(middle) = self.halfway(&ends)? else { break };
            let same = middle.orbit.lowest.event * ends[0].orbit.lowest.event > 0.0;
            ends[usize::from(!same)] = middle;
        }
        Ok(found)
    }

    fn period(&self, orbit: &Periodic) -> f64 {
        let Search { system, .. } = self.search;
        system.period(&self.search.unknowns(&orbit.start, orbit.value))
    }

    /// Orbit between three others at which the lowest `h` has another sign, where a parabola
    /// through theirs has.
    fn dip(
        &self,
        before: &FamilyPoint,
        here: &FamilyPoint,
        next: &FamilyPoint,
    ) -> Result<Option<FamilyPoint>, OrbitError> {
        let gap = |point: &FamilyPoint| point.orbit.lowest.event;
        let sign = gap(here).signum();
        let [a, b, c] = [gap(before), gap(here), gap(next)].map(|gap| sign * gap);
        if !(b < a && b < c && a.is_finite() && c.is_finite()) {
            return Ok(None);
        }
        let left = -distance(&before.unknowns, &here.unknowns);
        let right = distance(&next.unknowns, &here.unknowns);
        // b + s (place) + q place²
        let (by_left, by_right) = ((a - b) / left, (c - b) / right);
        let curvature = (by_right - by_left) / (right - left);
        let slope = by_right - curvature * right;
        let place = -0.5 * slope / curvature;
        if b + 0.5 * slope * place > 0.5 * b {
            return Ok(None);
        }
        let there = if place < 0.0 { before } else { next };
        let ends = moved(&there.unknowns, &here.unknowns, -1.0);
        let share = place.abs() / if place < 0.0 { -left } else { right };
        let middle = moved(&here.unknowns, &ends, share);
        let found = self.corrected(&middle, &middle, &ends)?;
        let Some(found) = found else { return Ok(None) };
        let middle = self.point(found, &here.tangent)?;
        Ok(middle.filter(|middle| sign * gap(middle) < 0.0))
    }

    /// Value of the parameter at the fold between two points of the curve.
    fn fold(&self, here: &FamilyPoint, next: &FamilyPoint) -> Result<f64, OrbitError> {
        let last = self.search.system.states;
        let mut ends = [here.clone(), next.clone()];
        for _ in 0..FOLD_HALVINGS {
            let Some(middle) = self.halfway(&ends)? else { break };
            let same = middle.tangent[last] * ends[0].tangent[last] > 0.0;
            ends[usize::from(!same)] = middle;
        }
        Ok(ends[0].orbit.value)
    }
}
