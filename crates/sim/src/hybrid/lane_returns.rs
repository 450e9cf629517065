//! Returns of several orbits in lanes, each at its own parameters.
//!
//! One idea: lanes fly the common course of returns; a return that does anything else is flown by a
//! scalar simulator, from its start. An image is therefore, to the last bit, that of
//! [`DirectReturn`], independent of its neighbours.
//!
//! Taylor steps of several orbits at one rigid surface ([`LaneTaylor`]): a step computes the series
//! of all orbits at once; each orbit has its own length and its own event, and lands at its own
//! time.

use super::affine::{LaneTools, OrbitTables};
use super::lane_flight::LaneFlight;
use super::lane_flow::{LaneAsked, LaneFlow, LaneLog, LaneStepEnd, LoggedFrom};
use super::motion::{Evaluator, LaneMotion, Sense, Sensor};
use super::passage::{Back, Goal, NoLog, REDUCED, Start, ends_before_turn};
use super::return_map::DirectReturn;
use super::search::{Gap, SearchEnd, search};
use super::simulator::Simulator;
use super::stationary::StationaryPoints;
use super::stepping::reversed_gap;
use super::system::{FlowMethod, HybridSystem, Law};
use super::trajectory::ReturnOutcome;
use crate::flow::{LaneIntegrator, LaneStep};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, Real, Scalar, is_wide};

/// The return map of a section by direct simulation, with its own parameters in every lane.
///
/// The system must have one rigid surface; every section and any number of grazing passages are
/// allowed. Impacts and near misses are flown in lanes. A scalar simulator flies returns that
/// stick, chatter or do not come back, or whose events are not found in lanes, from their start.
#[derive(Clone, Debug)]
pub struct LaneReturns<'a, const N: usize> {
    scalar: Vec<DirectReturn<'a, f64>>,
    flight: LaneMethod<'a, N>,
    images: LaneImages<N>,
}

/// Method by which lanes fly, the same as that of each scalar simulator.
#[derive(Clone, Debug)]
enum LaneMethod<'a, const N: usize> {
    Exact(Box<LaneFlight<LaneTools<N>, N>>),
    Taylor(Box<LaneFlight<LaneTaylor<'a, N>, N>>),
}

/// Images of the states of all lanes.
#[derive(Clone, Debug)]
pub struct LaneImages<const N: usize> {
    /// Full states at the next section points, with the nominal advance of the phase removed;
    /// undefined in lanes that did not return.
    pub state: Vec<Lanes<N>>,
    /// Speeds at which each passage made contact, in the order of the passages; `None` without
    /// contact.
    pub speeds: Vec<[Option<f64>; N]>,
    /// Whether each lane reached the section.
    pub returned: [bool; N],
    /// Whether each lane was flown together with the others.
    pub together: [bool; N],
}

/// Compiles returns of eight orbits here, once: instances that are never inlined are shared with
/// dependants.
#[cfg(not(test))]
#[used]
static IN_EIGHT_LANES: for<'r> fn(
    &'r mut LaneReturns<'static, 8>,
    &[Lanes<8>],
    [bool; 8],
) -> &'r LaneImages<8> = LaneReturns::images;

impl<'a, const N: usize> LaneReturns<'a, N> {
    /// Return maps of lanes at their parameters; `None` unless all are of one system with one rigid
    /// surface, on one section and with equally many passages, and on machines without wide
    /// registers ([`is_wide`]).
    ///
    /// # Panics
    ///
    /// If there are no return maps, or more than `N`.
    pub fn new(mut scalar: Vec<DirectReturn<'a, f64>>) -> Option<Self> {
        let lanes = scalar.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let fits = |map: &DirectReturn<'a, f64>| map.fits_lanes() && map.is_like(&scalar[0]);
        if !scalar.iter().all(fits) {
            return None;
        }
        let flight = LaneMethod::new(&mut scalar)?;
        let zero = Lanes::splat(0.0);
        let images = LaneImages {
            state: vec![zero; scalar[0].simulator.system().dimension()],
            speeds: vec![[None; N]; scalar[0].itinerary.len()],
            returned: [false; N],
            together: [false; N],
        };
        Some(Self { scalar, flight, images })
    }

    /// Next section points from full states at the section, for the wanted lanes.
    #[inline(never)]
    pub fn images(&mut self, states: &[Lanes<N>], wanted: [bool; N]) -> &LaneImages<N> {
        let used = self.scalar.len();
        let wanted = LaneMask::from_fn(|lane| wanted[lane] && lane < used);
        let done = match &mut self.flight {
            LaneMethod::Exact(flight) => self.images.fly(flight, states, wanted),
            LaneMethod::Taylor(flight) => self.images.fly(flight, states, wanted),
        };
        for lane in (wanted & !done).lanes() {
            self.fly_scalar(lane, states);
        }
        &self.images
    }

    /// Image of one lane by its own simulator.
    #[cold]
    fn fly_scalar(&mut self, lane: usize, states: &[Lanes<N>]) {
        let images = &mut self.images;
        let state: Vec<f64> = states.iter().map(|value| value[lane]).collect();
        let image = self.scalar[lane].image(&state);
        let image = image.ok().filter(|image| image.outcome == ReturnOutcome::Returned);
        images.returned[lane] = image.is_some();
        if let Some(image) = image {
            for (speeds, speed) in images.speeds.iter_mut().zip(image.passages) {
                speeds[lane] = speed;
            }
            for (out, value) in images.state.iter_mut().zip(image.state) {
                out[lane] = value;
            }
        }
    }
}

impl<const N: usize> LaneImages<N> {
    /// Takes the images of the wanted lanes from a flight. Returns the mask of lanes that reached
    /// the section.
    fn fly<F: LaneFlow<N>>(
        &mut self,
        flight: &mut LaneFlight<F, N>,
        states: &[Lanes<N>],
        wanted: LaneMask<N>,
    ) -> LaneMask<N> {
        let done = flight.fly(states, wanted);
        self.state.copy_from_slice(flight.states());
        for lane in 0..N {
            let together = done.holds(lane);
            for (passage, speeds) in self.speeds.iter_mut().enumerate() {
                speeds[lane] = flight.speed(passage, lane);
            }
            (self.returned[lane], self.together[lane]) = (together, together);
        }
        done
    }
}

impl<'a, const N: usize> LaneMethod<'a, N> {
    /// Builds the flight from the return maps of lanes; lanes without one use the first.
    fn new(scalar: &mut [DirectReturn<'a, f64>]) -> Option<Self> {
        let lanes = scalar.len();
        let own = |lane: usize| if lane < lanes { lane } else { 0 };
        let system = scalar[0].simulator.system();
        if system.method() == FlowMethod::Taylor {
            let maps = std::array::from_fn(|lane| &scalar[own(lane)]);
            let parameters = maps.map(|map| &map.simulator.parameters[..]);
            let flow = LaneTaylor::new(system, parameters)?;
            return Some(Self::Taylor(Box::new(LaneFlight::new(flow, maps))));
        }
        let tables: Option<Vec<OrbitTables>> =
            scalar.iter_mut().map(|own| own.simulator.orbit_tables()).collect();
        let tables = tables?;
        let flow = LaneTools::new(std::array::from_fn(|lane| tables[own(lane)].clone()))?;
        let maps = std::array::from_fn(|lane| &scalar[own(lane)]);
        Some(Self::Exact(Box::new(LaneFlight::new(flow, maps))))
    }
}

impl Simulator<'_, f64> {
    /// Tables of the orbit's exact steps, if it has any.
    fn orbit_tables(&mut self) -> Option<OrbitTables> {
        let tools = self.affine.as_mut()?;
        tools.orbit_tables(&mut self.motion, &self.parameters)
    }
}

impl<S: Real> DirectReturn<'_, S> {
    /// Whether returns of this kind can be flown in lanes.
    pub fn fits_lanes(&self) -> bool {
        let system = self.simulator.system();
        let surfaces = &system.surfaces[..];
        // NOTE: a corner ends a step in one direction only, which lanes do not distinguish.
        let is_smooth = !system.free.field.has_corners();
        is_smooth
            && is_wide()
            && !self.itinerary.has_hits()
            && !self.ends_at_first
            && matches!(surfaces, [surface] if matches!(surface.law, Law::Rigid { .. }))
    }

    /// Whether both returns are flown in the same way.
    fn is_like(&self, other: &Self) -> bool {
        std::ptr::eq(self.simulator.system(), other.simulator.system())
            && (self.section, self.periods) == (other.section, other.periods)
            && self.itinerary.len() == other.itinerary.len()
    }
}

/// The surface at which lanes fly, the only watched one.
const SURFACE: usize = 0;

/// Taylor steps of several orbits, each at its own parameters.
#[derive(Clone, Debug)]
struct LaneTaylor<'a, const N: usize> {
    parameters: Vec<Lanes<N>>,
    integrator: LaneIntegrator<'a, N>,
    sensor: Sensor<'a, Lanes<N>>,
    contact: Evaluator<'a, Lanes<N>>,
    reset: Evaluator<'a, Lanes<N>>,
    points: StationaryPoints<Lanes<N>>,
    /// Gaps and their slopes, in reversed time.
    reversed: (Vec<Lanes<N>>, Vec<Lanes<N>>),
}

impl<'a, const N: usize> LaneTaylor<'a, N> {
    /// Steps at the parameters of every lane; `None` unless the system has one rigid surface.
    pub(super) fn new(system: &'a HybridSystem, parameters: [&[f64]; N]) -> Option<Self> {
        let [surface] = &system.surfaces[..] else {
            return None;
        };
        let Law::Rigid { reset, .. } = &surface.law else {
            return None;
        };
        let parameter = |place: usize| Lanes::from_fn(|lane| parameters[lane][place]);
        let dimension = system.dimension;
        Some(Self {
            parameters: (0..system.parameters).map(parameter).collect(),
            integrator: LaneIntegrator::new(&system.free.field),
            sensor: Sensor::new(&surface.sensor, dimension),
            contact: Evaluator::new(&surface.landing, 2 + dimension),
            reset: Evaluator::new(reset, dimension),
            points: StationaryPoints::new(),
            reversed: (Vec::new(), Vec::new()),
        })
    }
}

impl<const N: usize> LaneFlow<N> for LaneTaylor<'_, N> {
    #[inline(always)]
    fn forget(&mut self) {}

    #[inline(always)]
    fn time_scale(&self, motion: &LaneMotion<N>) -> Lanes<N> {
        motion.last_step
    }

    #[inline(always)]
    fn step(
        &mut self,
        motion: &mut LaneMotion<N>,
        horizon: Lanes<N>,
        asked: LaneAsked<N>,
        log: &mut LaneLog<N>,
    ) -> LaneStepEnd<N> {
        let (wanted, remaining) = (asked.wanted, asked.longest);
        let step = self.integrator.expand(&motion.state, &self.parameters);
        let (admissible, mut undecided) = admissible(&step, motion, wanted);
        let slack = Lanes::splat(8.0 * <f64 as Scalar>::ROUNDOFF) * admissible;
        let is_last = remaining.is_at_most(admissible + slack);
        let length = Lanes::select(is_last, remaining, admissible);
        let gap = Gap {
            value: step.watched_coefficients(2 * SURFACE),
            slope: step.watched_coefficients(2 * SURFACE + 1),
            sign: Lanes::splat(1.0),
            surface: SURFACE,
        };
        let goal = Goal {
            minima: asked.ignoring,
            stopping: asked.stopping,
            near: Lanes::splat(f64::INFINITY),
        };
        let flown = wanted & !undecided;
        let watched = flown & !asked.blind;
        let start = motion.start();
        let mut passage = SearchEnd::none(length);
        if watched.any() {
            let from = motion.time;
            let log = LoggedFrom { start: from, log };
            passage = search(&mut self.points, gap, length, start, goal, watched, log);
        }
        let goes_on = flown & !passage.minimum & !passage.crossing;
        motion.lose_headings(wanted);
        motion.rises |= (goes_on & watched & !passage.falls) | (flown & passage.minimum);
        motion.falls |= goes_on & watched & passage.falls;
        let there = motion.time + passage.time;
        let is_over = passage.time.is_equal(remaining);
        let is_stuck = goes_on & passage.time.is_below(remaining) & there.is_equal(motion.time);
        undecided |= is_stuck;
        let mut rises_for = Lanes::splat(0.0);
        if (passage.minimum & !asked.passing).any() {
            rises_for = gap.rises_for(passage.time, admissible);
        }
        let of_use = !(goes_on & is_over) | asked.landing;
        let useful = flown & of_use & !(passage.minimum & asked.passing);
        if useful.any() {
            step.states_at(passage.time, useful, &mut motion.state);
        }
        let time = Lanes::select(is_over, horizon, there);
        motion.time = Lanes::select(flown, time, motion.time);
        LaneStepEnd {
            time: passage.time,
            contact: flown & passage.crossing,
            minimum: flown & passage.minimum,
            rises_for,
            undecided,
        }
    }

    /// NOTE: by one step; the scalar simulator flies an orbit that needs more.
    #[inline(always)]
    fn retreat(
        &mut self,
        motion: &mut LaneMotion<N>,
        goal: Back,
        wanted: LaneMask<N>,
        longest: Lanes<N>,
    ) -> LaneMask<N> {
        let step = self.integrator.expand(&motion.state, &self.parameters);
        let (admissible, undecided) = admissible(&step, motion, wanted);
        let length = admissible.min(longest);
        let value = step.watched_coefficients(2 * SURFACE);
        let slope = step.watched_coefficients(2 * SURFACE + 1);
        let (gap, goal) = reversed_gap(value, slope, goal, &mut self.reversed);
        let start = Start {
            rose: LaneMask::NONE,
            fell: LaneMask::NONE,
            leaving: LaneMask::NONE,
            ..motion.start()
        };
        let flown = wanted & !undecided;
        let points = &mut self.points;
        let passage = search(points, gap, length, start, goal, flown, NoLog);
        let known = flown & (passage.crossing | passage.minimum);
        step.states_at(-passage.time, known, &mut motion.state);
        motion.time = Lanes::select(known, motion.time - passage.time, motion.time);
        known
    }

    #[inline(always)]
    fn sense(&mut self, motion: &LaneMotion<N>, _: LaneMask<N>) -> Sense<Lanes<N>> {
        self.sensor.sense(&motion.state, &self.parameters)
    }

    #[inline(always)]
    fn approach(&mut self, motion: &LaneMotion<N>, _: LaneMask<N>) -> [Lanes<N>; 2] {
        self.sensor.approach(&motion.state, &self.parameters)
    }

    #[inline(always)]
    fn gap(&mut self, motion: &LaneMotion<N>, wanted: LaneMask<N>) -> Lanes<N> {
        self.approach(motion, wanted)[0]
    }

    #[inline(always)]
    fn reset(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) {
        let image = self.reset.evaluate(&motion.state, &self.parameters);
        for (state, &image) in motion.state.iter_mut().zip(image) {
            *state = Lanes::select(wanted, image, *state);
        }
    }

    #[inline(always)]
    fn settle(&mut self, motion: &mut LaneMotion<N>, wanted: LaneMask<N>) -> LaneMask<N> {
        let curvature = self.sense(motion, wanted).acceleration;
        let landing = self.contact.evaluate(&motion.state, &self.parameters);
        let (value, slope, zero) = (landing[0], landing[1], Lanes::splat(0.0));
        let settles = wanted & !value.is_equal(zero) & slope.is_below(zero);
        let shift = -value / slope;
        for (state, &rate) in motion.state.iter_mut().zip(&landing[2..]) {
            *state = Lanes::select(settles, rate.mul_add(shift, *state), *state);
        }
        let after = self.gap(motion, settles);
        let less = after.abs().is_at_most(value.abs() * Lanes::splat(REDUCED));
        motion.time = Lanes::select(settles, motion.time + shift, motion.time);
        settles & !(less & ends_before_turn(value, slope, curvature))
    }
}

/// Lengths on which states and gaps meet the tolerance, which are also the time scales of the
/// motions; and the mask of lanes in which they exist.
#[inline(always)]
fn admissible<const N: usize>(
    step: &LaneStep<'_, N>,
    motion: &mut LaneMotion<N>,
    wanted: LaneMask<N>,
) -> (Lanes<N>, LaneMask<N>) {
    let lengths = step.length.min(step.watched_length(2 * SURFACE));
    motion.last_step = Lanes::select(wanted, lengths, motion.last_step);
    (lengths, wanted & !Lanes::splat(0.0).is_below(step.length))
}
