//! From a steady state to a graze: settle, shoot, and change the parameter until the orbit touches.

mod clear_interval;

pub use clear_interval::{ClearInterval, IntervalEnd, clear_interval};

use nalgebra::DVector;

use super::effort::Effort;
use super::free_flow::{Minimum, gaps, singular, watching};
use super::grazing_orbit::with_reduced_phase;
use super::newton::{Equations, Scaled, unit_of};
use super::outcome::{NamedValues, NotLocated, OrbitError, Stop};
use super::piecewise::PiecewiseFlow;
use super::system::{ExtendedSystem, HeldComponent, PeriodicFamily, solve_either};
use crate::continuation::{
    ContinuationEnd, ContinuationPoint, CurveEquations, Linearised, StepControl, TestValue, apart,
    between, follow, moved, point_on, unit_vector,
};
use crate::flow::Step;
use crate::model::{OrbitContact, Scene};
use crate::numeric::{converted, low_discrepancy};

/// A search for a graze along the periodic orbits in one parameter.
pub(super) struct Search<'a> {
    scene: &'a Scene,
    system: &'a ExtendedSystem,
    surface: usize,
    parameter: usize,
    watching: PiecewiseFlow,
}

/// A periodic orbit of the free flow at one value of the parameter.
#[derive(Clone, Debug)]
struct Periodic {
    value: f64,
    start: Vec<f64>,
    period: f64,
    /// Lowest minimum of the event function. Between the hits of an orbit there may be none; its
    /// value is infinite then.
    lowest: Minimum,
    largest: f64,
    /// Whether the whole orbit lies beyond the surface.
    beyond: bool,
    /// Another surface beyond which the orbit goes, and does not hit.
    through: Option<usize>,
}

/// Result of a search: a graze.
pub(super) struct Met {
    /// Unknowns of the extended system.
    pub(super) unknowns: Vec<f64>,
    /// Values of the parameter at the other grazes met, in the order of the search.
    pub(super) others: Vec<f64>,
}

/// A graze of the curve of periodic orbits.
struct Graze {
    unknowns: Vec<f64>,
    value: f64,
    /// Whether the orbit passes through no surface.
    physical: bool,
}

/// Summary of the orbits that a search tried.
struct Looked {
    orbits: usize,
    /// Least and largest value of the parameter.
    range: [f64; 2],
    /// Least and largest of the lowest gaps.
    gaps: [f64; 2],
    closest: Periodic,
    /// First orbit that lies wholly beyond the surface.
    beyond: Option<Periodic>,
}

impl Looked {
    fn at(first: &Periodic) -> Self {
        Self {
            orbits: 1,
            range: [first.value; 2],
            gaps: [first.lowest.event; 2],
            closest: first.clone(),
            beyond: first.beyond.then(|| first.clone()),
        }
    }

    fn add(&mut self, orbit: &Periodic) {
        self.orbits += 1;
        let gap = orbit.lowest.event;
        self.range = [self.range[0].min(orbit.value), self.range[1].max(orbit.value)];
        self.gaps = [self.gaps[0].min(gap), self.gaps[1].max(gap)];
        if orbit.lowest.event.abs() < self.closest.lowest.event.abs() {
            self.closest = orbit.clone();
        }
        if self.beyond.is_none() && orbit.beyond {
            self.beyond = Some(orbit.clone());
        }
    }
}

/// Largest number of periods flown to settle.
const SETTLING: usize = 400;
/// A motion has settled if a period changes the state by less than this, in units of the states.
const SETTLED: f64 = 1e-10;
/// Number of states from which the commonest motion with hits is sought.
const STARTS: usize = 24;
/// Size of the box of these states, relative to the settled motion.
const ENLARGED: f64 = 1.25;
/// Largest distance of a periodic orbit from the motion that settled on it.
const NEAR_SETTLED: f64 = 1e-3;
/// Distance below which two periodic orbits are the same.
const SAME_ORBIT: f64 = 1e-6;
/// Slope of a gap, relative to its acceleration times the period, that is rounding.
const STATIONARY: f64 = 1e-12;
/// Largest number of secant steps.
const TRIALS: usize = 60;
/// Minima of the gap among which the return after a period is looked for.
const RETURNS: usize = 8;
/// Distance from a state of the return after a period, relative to that of the nearest one.
const AS_NEAR: f64 = 2.0;
/// Most doublings of the time in which minima of the gap are looked for, and most Taylor steps of
/// a flight after which it is doubled.
const DOUBLINGS: usize = 60;
const MOST_STEPS: usize = 10_000;
/// Time of a minimum, relative to the time between minima, that is one at the start itself.
const AT_START: f64 = 0.1;
/// Newton's method on the extended system is tried if the lowest `h` is within this part of its
/// range.
const NEAR: f64 = 0.2;

impl<'a> Search<'a> {
    /// A search for the graze of a system of one graze, in its parameter.
    pub(super) fn new(scene: &'a Scene, system: &'a ExtendedSystem, parameter: usize) -> Self {
        Self {
            scene,
            system,
            surface: system.grazes.surfaces[0],
            parameter,
            watching: watching(scene),
        }
    }

    /// The graze with `h'' > 0` nearest to the initial parameter value, from a full state at that
    /// value.
    ///
    /// The parameter is first moved by secant steps in the lowest `h`. If these find no graze, as
    /// beyond a fold, the curve of periodic orbits is followed by arclength to both sides.
    pub(super) fn run(&self, start: &[f64], value: f64) -> Result<Met, Stop<NotLocated>> {
        let near = match self.scene.grazing.guess {
            None if self.system.flow.hits() => self.commonest(start, value),
            _ => self.periodic(value, start, 0.0),
        };
        let first = match near {
            Some(orbit) => orbit,
            None => {
                let (settled, change) = self.settle(start, value);
                let orbit = self.periodic(value, &settled, 0.0);
                orbit.ok_or_else(|| Stop::Ended(self.no_orbit(start, value, change)))?
            }
        };
        let mut looked = Looked::at(&first);
        let approaches = first.lowest.event.is_finite();
        if let Some(unknowns) =
            if approaches { self.by_secants(&first, &mut looked)? } else { None }
        {
            return Ok(Met { unknowns, others: Vec::new() });
        }
        if let Some(orbit) = looked.beyond {
            return Err(Stop::Ended(self.wrong_side(&orbit)));
        }
        let mut grazes = self.follow(&first, &mut looked)?;
        let nearest = (0..grazes.len()).min_by(|&a, &b| {
            let key = |at: usize| (!grazes[at].physical, (grazes[at].value - value).abs());
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let Some(nearest) = nearest else {
            return Err(Stop::Ended(match looked.closest.beyond {
                true => self.wrong_side(&looked.closest),
                false => self.never_touches(&looked),
            }));
        };
        let unknowns = grazes.remove(nearest).unknowns;
        Ok(Met { unknowns, others: grazes.into_iter().map(|graze| graze.value).collect() })
    }

    /// Moves the parameter by secant steps in the lowest `h` until the orbit touches.
    fn by_secants(
        &self,
        first: &Periodic,
        looked: &mut Looked,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let mut orbit = first.clone();
        let mut previous: Option<Periodic> = None;
        for _ in 0..TRIALS {
            self.system.check_limit()?;
            if let Some(unknowns) = self.touch(&orbit)? {
                return Ok(Some(unknowns));
            }
            let Some(next) = self.advance(&orbit, previous.as_ref()) else {
                break;
            };
            previous = Some(std::mem::replace(&mut orbit, next));
            looked.add(&orbit);
        }
        Ok(None)
    }

    /// State of the free flow after many periods, and its change in the last period.
    fn settle(&self, start: &[f64], value: f64) -> (Vec<f64>, f64) {
        let (parameters, states) = (self.parameters(value), self.system.states);
        let period = self.forced_period(start, value);
        let mut state = start.to_vec();
        let mut change = f64::NAN;
        for _ in 0..SETTLING {
            let mut next = match self.system.flow(&state, &parameters, period) {
                Ok(next) => next,
                Err(OrbitError::SearchTooLong) => return (state, change),
                Err(_) => return (state, f64::NAN),
            };
            next[states..].copy_from_slice(&start[states..]);
            change = next.iter().zip(&state).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            state = next;
            if change < SETTLED * self.system.length(&self.unknowns(&state, value, period)) {
                break;
            }
        }
        (state, change)
    }

    /// Periodic orbit that most states settle on, among those with the hits that the scene names.
    ///
    /// States are spread over the box that the motion from `start` visits, enlarged; a motion
    /// begins at the phase of `start`.
    fn commonest(&self, start: &[f64], value: f64) -> Option<Periodic> {
        let (states, parameters) = (self.system.states, self.parameters(value));
        let period = self.forced_period(start, value);
        let (settled, _) = self.settle(start, value);
        let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; states];
        let look = |_: f64, _: f64, state: &[f64], _: &Step<'_, f64>| -> Option<()> {
            for (ends, &value) in ends.iter_mut().zip(state) {
                *ends = [ends[0].min(value), ends[1].max(value)];
            }
            None
        };
        self.system.each_step(&settled, &parameters, period, look).ok()?;
        let spread = (0..STARTS).map(|number| {
            let mut state = start.to_vec();
            let shares = low_discrepancy(number, states);
            for ((state, share), [least, most]) in state.iter_mut().zip(shares).zip(&ends) {
                *state = least + (most - least) * (ENLARGED * (share - 0.5) + 0.5);
            }
            state
        });
        let mut found: Vec<(usize, Periodic)> = Vec::new();
        for state in [start.to_vec()].into_iter().chain(spread) {
            let (settled, _) = self.settle(&state, value);
            let near = |orbit: &Periodic| apart(&orbit.start, &settled) < NEAR_SETTLED;
            let orbit = self.periodic(value, &settled, period);
            let fits = |orbit: &Periodic| near(orbit) && self.hits_as_named(orbit);
            let Some(orbit) = orbit.filter(fits) else {
                continue;
            };
            let same = |known: &Periodic| apart(&known.start, &orbit.start) < SAME_ORBIT;
            match found.iter_mut().find(|(_, known)| same(known)) {
                Some((count, _)) => *count += 1,
                None => found.push((1, orbit)),
            }
        }
        let commonest = found.into_iter().rev().max_by_key(|(count, _)| *count);
        commonest.and_then(|(_, orbit)| self.between_hits(&orbit))
    }

    /// The orbit from a start in the middle of its longest stretch without a hit: while the
    /// parameter changes, no hit then passes the phase of the start soon.
    fn between_hits(&self, orbit: &Periodic) -> Option<Periodic> {
        let (parameters, period) = (self.parameters(orbit.value), orbit.period);
        let events = self.system.events(&orbit.start, &parameters, period).ok()?;
        let mut times: Vec<f64> = events.iter().map(|event| event.time).collect();
        let Some(first) = times.first().copied() else { return Some(orbit.clone()) };
        times.push(first + period);
        let longest = times.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
        let middle = 0.5 * (longest[0] + longest[1]) % period;
        let start = self.system.flow(&orbit.start, &parameters, middle).ok()?;
        self.periodic(orbit.value, &with_reduced_phase(self.scene, start), period)
    }

    /// Whether an orbit hits the surfaces that the scene names, in that order from any of them.
    fn hits_as_named(&self, orbit: &Periodic) -> bool {
        let Some(order) = &self.scene.grazing.hits.order else { return true };
        let named = order.iter().filter_map(|contact| match contact {
            OrbitContact::Hit(surface) => Some(*surface),
            OrbitContact::Graze(_) => None,
        });
        let mut named: Vec<usize> = named.collect();
        let (parameters, period) = (self.parameters(orbit.value), orbit.period);
        let Ok(events) = self.system.events(&orbit.start, &parameters, period) else {
            return false;
        };
        let hits: Vec<usize> =
            events.iter().filter(|event| event.meets).map(|event| event.surface).collect();
        let turns = 0..named.len();
        hits.len() == named.len()
            && turns.into_iter().any(|_| {
                named.rotate_left(1);
                named == hits
            })
    }

    /// Periodic orbit near a full state, with the same phase. `period` is a guess of its period,
    /// used only without a phase.
    fn periodic(&self, value: f64, start: &[f64], period: f64) -> Option<Periodic> {
        let unknowns = self.unknowns(start, value, period);
        let (length, residual_units) = self.system.state_units(&unknowns);
        let held = HeldComponent::of(self.system, &unknowns, &residual_units);
        let fixed = self.system.with(&converted(&self.parameters(value)), &[]);
        let equations = PeriodicFamily::new(&fixed, held);
        let units = self.units(held, &residual_units, period, None);
        let scaled = Scaled { equations: &equations, residual_units, units, length };
        let start = fixed.assemble(start, period, &[], &[]);
        let Ok(Ok(root)) = scaled.solve(&held.remove(start), 1e-9) else {
            return None;
        };
        self.described(value, held.insert(&root))
    }

    /// Units of the unknowns of a family: those of the states, of a period, and of the parameter if
    /// it is free.
    fn units(
        &self,
        held: HeldComponent,
        states: &[f64],
        period: f64,
        parameter: Option<f64>,
    ) -> Vec<f64> {
        // The phase has no unit of its own, and is no unknown.
        let mut units = states.to_vec();
        units.resize(self.system.dimension, 1.0);
        let autonomous = self.scene.model.phase.is_none();
        units.extend(autonomous.then(|| unit_of(period)).into_iter().chain(parameter));
        held.remove(units)
    }

    /// Periodic orbit through unknowns of the extended system, with its lowest point; `None`
    /// without a period or a minimum of the gap.
    fn described(&self, value: f64, mut full: Vec<f64>) -> Option<Periodic> {
        let parameters = self.parameters(value);
        let period = match self.scene.model.phase {
            Some(_) => self.forced_period(&full, value),
            None => full[self.system.dimension],
        };
        full.truncate(self.system.dimension);
        if !(period > 0.0 && period.is_finite()) {
            return None;
        }
        let gaps = gaps(&self.watching, &full, &parameters, period).ok()?;
        self.system.counted(gaps.steps, period);
        let beyond = gaps.beyond().is_some_and(|(surface, _)| surface == self.surface);
        let others = (0..gaps.largest.len()).filter(|&other| {
            other != self.surface && !self.scene.grazing.hits.surfaces.contains(&other)
        });
        let mut others = others.filter(|&other| {
            let own = gaps.minima.iter().filter(|minimum| minimum.surface == other);
            let largest = gaps.largest[other];
            own.map(|minimum| minimum.event).fold(largest, f64::min) < -TOUCH * largest.abs()
        });
        let through = others.next();
        let mine = gaps.minima.into_iter().filter(|minimum| minimum.surface == self.surface);
        // Where the slope at the start is rounding, no change of its sign shows a minimum there.
        let local = self.system.geometry(0).at(&full, &parameters);
        let turns = local.acceleration() > 0.0
            && local.velocity().abs() <= STATIONARY * local.acceleration() * period;
        let at_start = turns.then(|| Minimum {
            surface: self.surface,
            time: 0.0,
            state: full.clone(),
            event: local.event(),
        });
        let lowest = mine.chain(at_start).min_by(|a, b| a.event.total_cmp(&b.event));
        let none = || Minimum {
            surface: self.surface,
            time: 0.0,
            state: full.clone(),
            event: f64::INFINITY,
        };
        let lowest = match self.system.flow.hits() {
            true => lowest.unwrap_or_else(none),
            false => lowest?,
        };
        Some(Periodic {
            value,
            start: full,
            period,
            lowest,
            largest: gaps.largest[self.surface],
            beyond,
            through,
        })
    }

    /// Newton's method on the extended system from an orbit's lowest point, if that is near the
    /// surface.
    fn touch(&self, orbit: &Periodic) -> Result<Option<Vec<f64>>, OrbitError> {
        match orbit.lowest.event.abs() > NEAR * (orbit.largest - orbit.lowest.event) {
            true => Ok(None),
            false => self.touch_from(orbit),
        }
    }

    /// Newton's method on the extended system from an orbit's lowest point.
    fn touch_from(&self, orbit: &Periodic) -> Result<Option<Vec<f64>>, OrbitError> {
        let unknowns = self.unknowns(&orbit.lowest.state, orbit.value, orbit.period);
        let Ok(root) = solve_either(self.system, &unknowns, 1e-9)? else {
            return Ok(None);
        };
        let state = &root[..self.system.dimension];
        let acceleration =
            self.system.geometry(0).at(state, &self.system.parameters(&root)).acceleration();
        Ok((acceleration > 0.0).then_some(root))
    }

    /// Orbit at the secant's next parameter value, or at a nearer one if it cannot be followed that
    /// far.
    fn advance(&self, orbit: &Periodic, previous: Option<&Periodic>) -> Option<Periodic> {
        let scale = orbit.value.abs().max(0.1);
        let slope = previous
            .map(|last| (orbit.lowest.event - last.lowest.event) / (orbit.value - last.value));
        let mut step = match slope {
            Some(slope) if slope != 0.0 && slope.is_finite() => {
                (-orbit.lowest.event / slope).clamp(-0.5 * scale, 0.5 * scale)
            }
            Some(_) => 0.1 * scale,
            None => 1e-3 * scale,
        };
        for _ in 0..12 {
            if let Some(next) = self.periodic(orbit.value + step, &orbit.start, orbit.period) {
                return Some(next);
            }
            step *= 0.5;
        }
        None
    }

    fn parameters(&self, value: f64) -> Vec<f64> {
        let mut parameters = self.system.parameters(&vec![value; self.system.unknowns()]);
        parameters[self.parameter] = value;
        parameters
    }

    /// Unknowns of the extended system; `period` is used only without a phase.
    fn unknowns(&self, state: &[f64], value: f64, period: f64) -> Vec<f64> {
        self.system.assemble(state, period, &[], &self.parameters(value))
    }

    /// Unknowns of the extended system at the start of an orbit.
    fn unknowns_of(&self, orbit: &Periodic) -> Vec<f64> {
        self.unknowns(&orbit.start, orbit.value, orbit.period)
    }

    /// Period of orbits of a system with a phase; 0 without one.
    fn forced_period(&self, state: &[f64], value: f64) -> f64 {
        self.system.period(&self.unknowns(state, value, 0.0))
    }

    fn name(&self) -> String {
        self.scene.model.parameters[self.parameter].name.clone()
    }

    fn no_orbit(&self, start: &[f64], value: f64, change: f64) -> NotLocated {
        let period = self.forced_period(start, value);
        let stops = || singular(self.scene, start, &self.parameters(value), period);
        let singular = if change.is_nan() { stops() } else { None };
        let surfaces = self.scene.grazing.hits.surfaces.iter();
        let name = |&surface: &usize| self.scene.model.surfaces[surface].name.clone();
        singular.unwrap_or_else(|| NotLocated::NoPeriodicOrbit {
            hits: surfaces.map(name).collect(),
            parameter: self.name(),
            value,
            periods: SETTLING,
            change,
        })
    }

    fn wrong_side(&self, orbit: &Periodic) -> NotLocated {
        NotLocated::WrongSide {
            surface: self.scene.model.surfaces[self.surface].name.clone(),
            at: NamedValues(vec![(self.name(), orbit.value)]),
            largest: orbit.largest,
        }
    }

    fn never_touches(&self, looked: &Looked) -> NotLocated {
        let surface = self.scene.model.surfaces[self.surface].name.clone();
        let ([least, largest], clearance) = (looked.gaps, looked.closest.lowest.event);
        if looked.range[0] < looked.range[1] && largest - least <= TOUCH * clearance.abs() {
            let (parameter, range) = (self.name(), looked.range);
            return NotLocated::Unmoved { surface, parameter, range, clearance };
        }
        NotLocated::NeverTouches {
            surface,
            parameter: self.name(),
            value: looked.closest.value,
            clearance,
            tried: looked.orbits,
            range: looked.range,
        }
    }
}

/// Steps along the curve of periodic orbits, in units of its unknowns.
const STEPS: StepControl =
    StepControl { first: 0.02, longest: 0.25, shortest: 1e-6, most: 250, ..StepControl::DEFAULT };
/// Largest change of the parameter along the curve, relative to its size: after the first graze is
/// found (`REACH`), and as long as none is found (`FAR`).
const REACH: f64 = 2.0;
const FAR: f64 = 10.0;
/// Largest number of halvings of a step in which the lowest `h` changes its sign.
const HALVINGS: usize = 20;
/// Lowest `h`, relative to the largest, that counts as a touch.
const TOUCH: f64 = 1e-9;

/// A point of the curve of periodic orbits; it has its orbit where it is complete. Unknowns are the
/// states at the fixed phase, then the parameter, scaled.
type FamilyPoint = ContinuationPoint<f64, Option<Periodic>>;

/// Lowest `h` of the orbit at a point.
fn lowest(point: &FamilyPoint) -> f64 {
    point.linearised.extra.as_ref().map_or(f64::NAN, |orbit| orbit.lowest.event)
}

/// Value of the parameter at a point.
fn value_at(point: &FamilyPoint) -> f64 {
    point.linearised.extra.as_ref().map_or(f64::NAN, |orbit| orbit.value)
}

/// The curve of periodic orbits through one of them, with the units of its unknowns.
struct Family<'a> {
    search: &'a Search<'a>,
    equations: PeriodicFamily,
    held: HeldComponent,
    units: Vec<f64>,
    residual_units: Vec<f64>,
    length: f64,
    /// Error that ends the curve.
    error: Option<OrbitError>,
}

/// A search along the curve of periodic orbits.
trait Visit {
    /// Whether the curve may pass from one point to the next.
    fn may_pass(&self, _ends: [&FamilyPoint; 2]) -> bool {
        true
    }

    /// Looks at two successive points; returns whether the curve ends at the last one.
    fn is_last(&mut self, family: &mut Family<'_>, ends: [&FamilyPoint; 2]) -> bool;
}

/// Equations of the curve, with a search along it.
struct Visited<'v, 'a, V> {
    family: &'v mut Family<'a>,
    visit: &'v mut V,
}

impl<V: Visit> CurveEquations<f64> for Visited<'_, '_, V> {
    type Extra = Option<Periodic>;

    fn linearised(&mut self, unknowns: &[f64]) -> Option<Linearised<f64, Self::Extra>> {
        self.family.linearised(unknowns)
    }

    fn residual(&mut self, unknowns: &[f64]) -> Option<DVector<f64>> {
        self.family.residual(unknowns)
    }

    fn complete(&mut self, point: &mut FamilyPoint) -> bool {
        self.family.complete(point)
    }

    fn tests(&self, point: &FamilyPoint) -> Vec<TestValue<f64>> {
        self.family.tests(point)
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        self.family.range(unknown)
    }

    fn is_spent(&self) -> bool {
        self.family.is_spent()
    }

    fn is_passable(&mut self, ends: [&FamilyPoint; 2]) -> bool {
        self.visit.may_pass(ends)
    }

    fn is_last(&mut self, ends: [&FamilyPoint; 2]) -> bool {
        self.visit.is_last(self.family, ends)
    }
}

impl CurveEquations<f64> for Family<'_> {
    type Extra = Option<Periodic>;

    fn linearised(&mut self, unknowns: &[f64]) -> Option<Linearised<f64, Self::Extra>> {
        let found = self.system().linearised(unknowns);
        let (residual, jacobian) = self.kept(found)?;
        Some(Linearised { residual: DVector::from_vec(residual), jacobian, extra: None })
    }

    fn residual(&mut self, unknowns: &[f64]) -> Option<DVector<f64>> {
        let found = self.system().residual(unknowns);
        self.kept(found).map(DVector::from_vec)
    }

    /// Adds the orbit.
    fn complete(&mut self, point: &mut FamilyPoint) -> bool {
        let mut values = self.system().without_units(&point.unknowns);
        let value = values.pop().unwrap_or(f64::NAN);
        point.linearised.extra = self.search.described(value, self.held.insert(&values));
        point.linearised.extra.is_some()
    }

    fn tests(&self, _: &FamilyPoint) -> Vec<TestValue<f64>> {
        Vec::new()
    }

    fn range(&self, _: usize) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    fn is_spent(&self) -> bool {
        self.error.is_some()
    }
}

/// Search for all grazes on one side of an orbit.
struct AllGrazes<'a> {
    /// Value of the parameter at the orbit.
    from: f64,
    grazes: &'a mut Vec<Graze>,
    looked: &'a mut Looked,
}

impl Visit for AllGrazes<'_> {
    fn is_last(&mut self, family: &mut Family<'_>, [here, next]: [&FamilyPoint; 2]) -> bool {
        let Some(orbit) = &next.linearised.extra else { return true };
        self.looked.add(orbit);
        if lowest(here) * lowest(next) < 0.0 {
            self.grazes.extend(family.graze_between([here, next]));
        }
        let reach = if self.grazes.is_empty() { FAR } else { REACH };
        (orbit.value - self.from).abs() > reach * scale(self.from)
    }
}

impl Search<'_> {
    /// Grazes along the curve of periodic orbits through one of them, to both sides, within the
    /// work limit of one search.
    fn follow(&self, first: &Periodic, looked: &mut Looked) -> Result<Vec<Graze>, OrbitError> {
        let system = self.system.clone().limited(&Effort::new(self.system.flow.field()));
        let search = Search { system: &system, watching: self.watching.clone(), ..*self };
        let mut family = Family::through(&search, first, scale(first.value));
        let mut grazes = Vec::new();
        for side in [1.0, -1.0] {
            let (grazes, looked) = (&mut grazes, &mut *looked);
            let mut visit = AllGrazes { from: first.value, grazes, looked };
            let end = family.follow(first, side, &STEPS, &mut visit);
            match family.error.take() {
                None if end == Some(ContinuationEnd::Closed) => break,
                None | Some(OrbitError::SearchTooLong) => {}
                Some(error) => return Err(error),
            }
        }
        Ok(grazes)
    }
}

/// Minima of a surface's event function that follow a full state along a [`watching`] flow, at
/// least [`RETURNS`] if there are as many; one at the state itself is left out.
///
/// The time in which they come is not known: it is doubled from the time that the fastest component
/// takes. A flow that ends before has those until then.
pub(super) fn next_minima(
    flow: &PiecewiseFlow,
    system: &ExtendedSystem,
    start: &[f64],
    parameters: &[f64],
) -> Result<Vec<Minimum>, OrbitError> {
    let surface = system.grazes.surfaces[0];
    let largest =
        |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let rates = system.geometry(0).at(start, parameters).flow();
    let mut horizon = largest(start) / largest(&rates);
    if !(horizon > 0.0 && horizon.is_finite()) {
        horizon = 1.0;
    }
    let mut found: Vec<Minimum> = Vec::new();
    for _ in 0..DOUBLINGS {
        let gaps = match gaps(flow, start, parameters, horizon) {
            Ok(gaps) => gaps,
            Err(OrbitError::Flow(_)) => break,
            Err(error) => return Err(error),
        };
        system.counted(gaps.steps, horizon);
        system.check_limit()?;
        found = gaps.minima;
        found.retain(|minimum| minimum.surface == surface);
        if found.len() > RETURNS + 1 || gaps.steps > MOST_STEPS {
            break;
        }
        horizon *= 2.0;
    }
    let last = found.last().map_or(0.0, |minimum| minimum.time);
    let at_start = AT_START * last / found.len() as f64;
    found.retain(|minimum| minimum.time > at_start);
    Ok(found)
}

/// Time after which a flow comes back to a full state, about as near as it does at the first minima
/// of the gap that follow; `None` without one.
pub(super) fn time_of_return(minima: &[Minimum], start: &[f64], length: f64) -> Option<f64> {
    let away = |minimum: &Minimum| apart(&minimum.state, start);
    let nearest = minima.iter().map(away).fold(f64::INFINITY, f64::min);
    let is_back = |minimum: &&Minimum| away(minimum) <= AS_NEAR * nearest + SAME_ORBIT * length;
    minima.iter().find(is_back).map(|minimum| minimum.time)
}

/// Scale for changes of a parameter.
fn scale(value: f64) -> f64 {
    value.abs().max(0.1)
}

impl<'a> Family<'a> {
    /// The curve through an orbit, with a unit of the parameter.
    fn through(search: &'a Search<'a>, first: &Periodic, unit: f64) -> Self {
        let system = search.system;
        let unknowns = search.unknowns_of(first);
        let (length, residual_units) = system.state_units(&unknowns);
        let held = HeldComponent::of(system, &unknowns, &residual_units);
        Self {
            equations: PeriodicFamily::new(system, held),
            held,
            search,
            units: search.units(held, &residual_units, first.period, Some(unit)),
            residual_units,
            length,
            error: None,
        }
    }

    fn system(&self) -> Scaled<'_, PeriodicFamily> {
        Scaled {
            equations: &self.equations,
            units: self.units.clone(),
            residual_units: self.residual_units.clone(),
            length: self.length,
        }
    }

    /// Result of a computation; an error that ends the curve is kept.
    fn kept<T>(&mut self, found: Result<T, OrbitError>) -> Option<T> {
        match found {
            Ok(found) => Some(found),
            Err(OrbitError::Flow(_)) => None,
            Err(error) => {
                self.error = Some(error);
                None
            }
        }
    }

    /// Unknowns of an orbit, and the direction in which the parameter changes.
    fn start(&self, first: &Periodic, side: f64) -> [Vec<f64>; 2] {
        let states = self.search.system.states;
        let unknowns = self.held.remove(self.search.unknowns_of(first));
        let mut along = unit_vector(states + 1, states);
        along[states] = side;
        [self.system().in_units(&unknowns), along]
    }

    /// Follows one side of the curve; `None` if it has no first point.
    fn follow(
        &mut self,
        first: &Periodic,
        side: f64,
        steps: &StepControl,
        visit: &mut impl Visit,
    ) -> Option<ContinuationEnd> {
        let [start, along] = self.start(first, side);
        let curve = follow(&mut Visited { family: self, visit }, &start, &along, steps);
        curve.map(|curve| curve.end)
    }

    /// Point of the curve on the plane across a share of the chord between two others.
    fn between(&mut self, [a, b]: [&FamilyPoint; 2], share: f64) -> Option<FamilyPoint> {
        let middle = between(&a.unknowns, &b.unknowns, share);
        let chord = moved(&b.unknowns, &a.unknowns, -1.0);
        point_on(self, &middle, [&middle, &chord], &a.tangent)
    }

    /// Graze between two points of the curve at which the lowest `h` has opposite signs.
    fn graze_between(&mut self, ends: [&FamilyPoint; 2]) -> Option<Graze> {
        let mut ends = ends.map(Clone::clone);
        for _ in 0..HALVINGS {
            let nearer = usize::from(lowest(&ends[1]).abs() < lowest(&ends[0]).abs());
            let orbit = ends[nearer].linearised.extra.as_ref()?;
            let touched = self.search.touch_from(orbit);
            if let Some(unknowns) = self.kept(touched).flatten() {
                let graze = self.search.graze(unknowns);
                let apart = apart(&ends[0].unknowns, &ends[1].unknowns);
                let moved = (graze.value - value_at(&ends[nearer])).abs();
                if moved <= 2.0 * apart * self.units[self.units.len() - 1] {
                    return Some(graze);
                }
            }
            self.halve(&mut ends, lowest)?;
        }
        None
    }

    /// Replaces the end of a stretch at which a function has the sign that it has halfway.
    fn halve(
        &mut self,
        ends: &mut [FamilyPoint; 2],
        function: impl Fn(&FamilyPoint) -> f64,
    ) -> Option<()> {
        let middle = self.between(ends.each_ref(), 0.5)?;
        let same = function(&middle) * function(&ends[0]) > 0.0;
        ends[usize::from(!same)] = middle;
        Some(())
    }
}

impl Search<'_> {
    /// Graze with these unknowns.
    fn graze(&self, unknowns: Vec<f64>) -> Graze {
        let parameters = self.system.parameters(&unknowns);
        let (start, period) = (&unknowns[..self.system.dimension], self.system.period(&unknowns));
        let gaps = gaps(&self.watching, start, &parameters, period);
        let physical = gaps.is_ok_and(|gaps| {
            let touch = |at: &Minimum| -TOUCH * gaps.largest[at.surface].abs();
            gaps.minima.iter().all(|at| at.event >= touch(at))
        });
        Graze { value: parameters[self.parameter], physical, unknowns }
    }
}
