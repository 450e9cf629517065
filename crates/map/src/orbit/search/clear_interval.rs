//! The interval of a parameter in which the orbit that the free flow settles on does not touch: the
//! orbit is followed to both sides, to its first graze or fold.

use super::{
    FAR, Family, FamilyPoint, Graze, HALVINGS, NEAR_SETTLED, Periodic, RETURNS, SETTLED, SETTLING,
    STEPS, Search, Visit, lowest, next_minima, scale, time_of_return, value_at,
};
use crate::continuation::{StepControl, apart, dot, point_on};
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::effort::Effort;
use crate::orbit::free_flow::Minimum;
use crate::orbit::grazing_orbit::Grazes;
use crate::orbit::monodromy::orbit_multipliers;
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
    /// Another surface beyond which the orbit goes at the value without hitting it, as an index.
    pub through: Option<usize>,
    /// Whether a multiplier of the orbit at the value lies outside of the unit circle.
    pub unstable: bool,
    /// Lower and upper end of the interval; `None` if none was found.
    pub ends: [Option<IntervalEnd>; 2],
}

impl ClearInterval {
    /// Whether the orbit at the value goes beyond no surface.
    pub fn clears(&self) -> bool {
        self.gap >= 0.0 && self.through.is_none()
    }

    /// A scene at the nearer end that is a graze, with a guess there; the interval is that of the
    /// first adjusted parameter about the scene's value.
    pub(in crate::orbit) fn at_graze(&self, scene: &Scene) -> Option<Scene> {
        let parameter = *scene.grazing.solve_for.first()?;
        let own = scene.model.parameters[parameter].value.to_f64();
        let grazes = self.ends.iter().flatten().filter_map(|end| match end {
            IntervalEnd::Graze { value, state } => Some((*value, state.clone())),
            IntervalEnd::Fold { .. } => None,
        });
        let (value, state) =
            grazes.min_by(|a, b| (a.0 - own).abs().total_cmp(&(b.0 - own).abs()))?;
        let mut there = scene.clone();
        there.model.parameters[parameter].value = Dd::from(value);
        there.grazing.guess = Some(state);
        Some(there)
    }
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
/// a phase where neither is given.
pub fn clear_interval(
    scene: &Scene,
    parameter: usize,
    start: Option<&[f64]>,
) -> Result<Result<ClearInterval, NotLocated>, OrbitError> {
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
    let first = match (scene.model.phase.is_some(), &near) {
        (true, _) => search.nominal(&near.unwrap_or_else(rest), value, is_near),
        (false, Some(near)) => search.cycle(near, value),
        (false, None) => return Err(OrbitError::AutonomousWithoutGuess),
    };
    let first = match settled(first)? {
        Ok(first) => first,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut ends = [None, None];
    for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
        let system = limited();
        let search = Search::new(&scene, &system, parameter);
        let mut visit = FirstEnd { first: &first, before: None, turned: None, found: None };
        let (mut from, mut side) = (first.clone(), side);
        for _ in 0..MOST_TURNS {
            let mut family = Family::through(&search, &from, search.unit(&first)?);
            family.follow(&from, side, &STEPS_TO_END, &mut visit);
            match family.error {
                None | Some(OrbitError::SearchTooLong) => {}
                Some(error) => return Err(error),
            }
            let Some(turned) = visit.turned.take() else { break };
            (from, side) = turned;
            visit.before = None;
        }
        *end = visit.found;
    }
    // What was spent to settle is no reason to refuse the multipliers.
    let system = limited();
    let unstable = Search::new(&scene, &system, parameter).is_unstable(&first)?;
    let (gap, through) = (first.lowest.event, first.through);
    Ok(Ok(ClearInterval { start: first.start, gap, through, unstable, ends }))
}

/// Steps towards an end of an interval: an orbit may graze just beside the scene's.
const STEPS_TO_END: StepControl = StepControl { first: 0.01 * STEPS.first, most: 2000, ..STEPS };
/// Largest change of the lowest `h` in one step, relative to the range of `h`.
const CHANGE: f64 = 0.05;
/// Longest period along an interval, in that at its value: a frequency falls no lower.
const SLOWEST: f64 = 20.0;
/// Most times that another component of the state is held on the way to an end.
const MOST_TURNS: usize = 50;
/// Way of a cycle, relative to its length, that is one of rounding.
const AT_REST: f64 = 1e-6;
/// Range of the gap along a cycle, relative to that of the scene's, below which it shrinks to a
/// point.
const SHRUNK: f64 = 1e-3;
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
        let near = || self.periodic(value, start, 0.0);
        let first = match is_near {
            true => near(),
            false if self.system.flow.hits() => self.commonest(start, value),
            false => None,
        };
        if let Some(orbit) = first {
            return Ok(orbit);
        }
        let (settled, change) = self.settle(start, value);
        let reach = NEAR_SETTLED * self.system.length(&self.unknowns(&settled, value, 0.0));
        let orbit = self.periodic(value, &settled, 0.0);
        let orbit = orbit.filter(|orbit| apart(&orbit.start, &settled) < reach);
        let orbit = orbit.or_else(near);
        orbit.ok_or_else(|| Stop::Ended(self.no_orbit(start, value, change)))
    }

    /// Periodic orbit without a phase: the one near a full state, or if there is none, the one that
    /// the flow settles on from there. It starts at its lowest point.
    fn cycle(&self, start: &[f64], value: f64) -> Result<Periodic, Stop<NotLocated>> {
        let mut found = self.cycle_near(start, value)?;
        // Change over the last return; 0 at rest.
        let mut change = 0.0;
        if found.is_none() {
            let mut state = start.to_vec();
            for _ in 0..SETTLING / RETURNS {
                let minima = self.next_minima(&state, value)?;
                let Some((last, others)) = minima.split_last() else { break };
                let length = self.system.length(&self.unknowns(&last.state, value, last.time));
                state.clone_from(&last.state);
                let away = others.iter().map(|other| apart(&other.state, &state));
                change = away.fold(f64::INFINITY, f64::min);
                if change < SETTLED * length {
                    change = 0.0;
                    break;
                }
            }
            found = self.cycle_near(&state, value)?;
        }
        let lowest = found.and_then(|orbit| {
            self.periodic(value, &orbit.lowest.state, orbit.period).or(Some(orbit))
        });
        lowest.ok_or_else(|| Stop::Ended(self.no_orbit(start, value, change)))
    }

    /// Periodic orbit without a phase near a full state.
    fn cycle_near(&self, start: &[f64], value: f64) -> Result<Option<Periodic>, OrbitError> {
        let minima = self.next_minima(start, value)?;
        let first = minima.first().map_or(0.0, |minimum| minimum.time);
        let length = self.system.length(&self.unknowns(start, value, first));
        let period = time_of_return(&minima, start, length);
        let found = period.and_then(|period| self.periodic(value, start, period));
        Ok(found.filter(|orbit| !self.is_at_rest(orbit)))
    }

    /// Whether an orbit is an equilibrium, to rounding.
    fn is_at_rest(&self, orbit: &Periodic) -> bool {
        let unknowns = self.unknowns_of(orbit);
        let rates = self.system.geometry(0).at(&orbit.start, &self.parameters(orbit.value)).flow();
        let way = rates.iter().fold(0.0, |most: f64, rate| most.max(rate.abs())) * orbit.period;
        way <= AT_REST * self.system.length(&unknowns)
    }

    fn next_minima(&self, start: &[f64], value: f64) -> Result<Vec<Minimum>, OrbitError> {
        next_minima(&self.watching, self.system, start, &self.parameters(value))
    }

    /// Whether a multiplier of an orbit lies outside of the unit circle, by more than rounding.
    fn is_unstable(&self, orbit: &Periodic) -> Result<bool, OrbitError> {
        let parameters = self.parameters(orbit.value);
        let found = orbit_multipliers(self.system, &orbit.start, &parameters, orbit.period)?;
        Ok(found.first().is_some_and(|[re, im]| re.hypot(*im) > 1.0 + SETTLED))
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
        let by_gap = extent(orbit) / slope;
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
    /// Orbit from which the curve goes on with another component held, and the sign of the change
    /// of the parameter.
    turned: Option<(Periodic, f64)>,
    found: Option<IntervalEnd>,
}

impl Visit for FirstEnd<'_> {
    fn may_pass(&self, [here, next]: [&FamilyPoint; 2]) -> bool {
        let Some(orbit) = &here.linearised.extra else { return false };
        let change = (lowest(next) - lowest(here)).abs();
        change <= CHANGE * extent(orbit)
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
            let Some(fold) = family.fold([here, next]) else { return true };
            if family.is_oblique(&fold) {
                // The held component turns, and not the curve.
                let here = here.linearised.extra.clone().zip(Some(here.tangent[parameter]));
                self.turned = here.map(|(orbit, sign)| (orbit, sign.signum()));
            } else if extent(&fold) > SHRUNK * extent(self.first) {
                self.found = Some(IntervalEnd::Fold { value: fold.value });
            }
            // A cycle that shrinks to a point turns back as its own mirror image: no fold.
            return true;
        }
        if orbit.value * self.first.value < 0.0
            || (orbit.value - self.first.value).abs() > FAR * family.units[parameter]
            || !(0.0..SLOWEST * self.first.period).contains(&orbit.period)
        {
            return true;
        }
        let is_oblique = family.is_oblique(orbit);
        if is_oblique {
            self.turned = Some((orbit.clone(), next.tangent[parameter].signum()));
        }
        is_oblique
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

    /// Whether another component is to be held on the way to the next orbits.
    fn is_oblique(&self, orbit: &Periodic) -> bool {
        let unknowns = self.search.unknowns_of(orbit);
        self.held.is_oblique(self.search.system, &unknowns, &self.residual_units)
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

    /// Orbit at the fold between two points of the curve.
    fn fold(&mut self, ends: [&FamilyPoint; 2]) -> Option<Periodic> {
        let last = self.search.system.states;
        let mut ends = ends.map(Clone::clone);
        for _ in 0..FOLD_HALVINGS {
            if self.halve(&mut ends, |point| point.tangent[last]).is_none() {
                break;
            }
        }
        let [at, _] = ends;
        at.linearised.extra
    }
}

/// Range of the gap along an orbit.
fn extent(orbit: &Periodic) -> f64 {
    orbit.largest - orbit.lowest.event
}
