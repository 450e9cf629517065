//! Forcing periods of several orbits in lanes, each at its own parameters.
//!
//! One idea: lanes hold what orbits have in common; an orbit that is about to do something else is
//! flown on by its own simulator, from there to the end of the period. So every state is, to the
//! last bit, that of [`Simulator::advance_period`].

use super::affine::{LaneImpacts, OrbitTables};
use super::lane_motion::{EventRecord, LaneLeft, LaneMotion};
use super::lane_stepping::LaneStepping;
use super::lane_taylor::LaneTaylor;
use super::passage::Heading;
use super::simulator::{Simulator, Stop};
use super::system::{FlowMethod, Law, Regime};
use super::trajectory::{Event, Outcome};
use crate::numeric::{Branched, LaneMask, Lanes, Mask, is_wide};

/// Direct simulation of up to `N` orbits by forcing periods, contacts alone asked for:
/// [`Simulator::advance_period`] in lanes.
///
/// It is for systems with one rigid surface; where free flight is affine, of one mass or two under
/// one force, at a stop at rest. The simulators' limits on steps hold for what is flown alone;
/// lanes have their own, after which an orbit flies on alone.
///
/// ```
/// use grazemap_sim::hybrid::{HybridSystem, LanePeriods, Simulator};
/// use grazemap_sim::model::{Scene, catalogue};
///
/// let scene = Scene::parse(catalogue::text("linear").unwrap(), "linear").unwrap();
/// let system = HybridSystem::new(&scene.model);
/// let parameters: Vec<f64> = scene.model.parameter_values().iter().map(|p| p.hi).collect();
/// let mut orbits = Vec::new();
/// for number in 0..8 {
///     let mut orbit = Simulator::new(&system, &parameters)?;
///     orbit.set_state(&[0.1 * f64::from(number), 0.0, 0.0])?;
///     orbits.push(orbit);
/// }
/// // None where the processor has no wide registers: such orbits are simulated one by one.
/// if let Some(mut orbits) = LanePeriods::<8>::new(orbits) {
///     let mut impacts = [0; 8];
///     for _ in 0..100 {
///         orbits.advance(&mut |orbit, _| impacts[orbit] += 1);
///     }
///     assert!(orbits.state(3)[0] <= 1.0 && impacts[3] > 0);
/// }
/// # Ok::<(), grazemap_sim::hybrid::HybridError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LanePeriods<'a, const N: usize> {
    alone: Vec<Simulator<'a, f64>>,
    flight: Flight<'a, N>,
    motion: LaneMotion<N>,
    /// Place of the phase in a state.
    component: usize,
    /// Of the phase, and in time.
    period: f64,
    durations: Lanes<N>,
    /// The lanes that have orbits.
    used: LaneMask<N>,
    /// Those whose states are in lanes.
    together: LaneMask<N>,
    outcomes: Vec<Outcome<f64>>,
}

/// How lanes are flown: as each orbit alone is.
#[derive(Clone, Debug)]
enum Flight<'a, const N: usize> {
    Exact(Box<LaneImpacts<N>>),
    Taylor(Box<LaneStepping<LaneTaylor<'a, N>, N>>),
}

impl<'a, const N: usize> LanePeriods<'a, N> {
    /// The orbits that start from the present states of simulators; `None` where they cannot be
    /// flown in lanes, and on machines without wide registers ([`is_wide`]).
    ///
    /// # Panics
    ///
    /// If there are none, or more than lanes.
    pub fn new(mut alone: Vec<Simulator<'a, f64>>) -> Option<Self> {
        let lanes = alone.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let system = alone[0].system();
        let phase = system.phase.as_ref()?;
        let is_fit = matches!(&system.surfaces[..], [one] if matches!(one.law, Law::Rigid { .. }));
        if !is_wide() || !is_fit {
            return None;
        }
        let durations: Result<Vec<_>, _> = alone.iter().map(Simulator::forcing_period).collect();
        let durations = durations.ok()?;
        let own = |lane: usize| if lane < lanes { lane } else { 0 };
        let flight = Flight::new(&mut alone)?;
        for simulator in &mut alone {
            simulator.set_near_miss_limit(0.0);
        }
        Some(Self {
            flight,
            motion: LaneMotion::new(system.dimension()),
            component: phase.component,
            period: phase.period.hi,
            durations: Lanes::from_fn(|lane| durations[own(lane)]),
            used: LaneMask::from_fn(|lane| lane < lanes),
            together: LaneMask::NONE,
            outcomes: vec![Outcome::Completed; lanes],
            alone,
        })
    }

    /// Simulates one forcing period of every orbit, handing every event to `record` with the
    /// orbit's number; how each ended.
    ///
    /// Phases are then exactly where they were, and times are counted from the start of the period.
    /// The events of one orbit come in the order of their times, those of two in any.
    pub fn advance(&mut self, record: &mut dyn FnMut(usize, Event<f64>)) -> &[Outcome<f64>] {
        self.join();
        let wanted = self.together;
        let reference = self.motion.state[self.component];
        let left = self.fly(wanted, record);
        self.together &= !left.open & !left.contact;
        let phase = &mut self.motion.state[self.component];
        *phase = Lanes::select(self.together, reference, *phase);
        if self.together != self.used {
            self.finish_alone(wanted, reference, &left, record);
        }
        &self.outcomes
    }

    /// Flies the wanted lanes through a period; where that ended early.
    fn fly(&mut self, wanted: LaneMask<N>, record: EventRecord<'_>) -> LaneLeft<N> {
        let (motion, horizon) = (&mut self.motion, self.durations);
        match &mut self.flight {
            Flight::Exact(impacts) => {
                let left = impacts.fly(motion, wanted, horizon, self.period, record);
                motion.lose_headings(left.flown);
                left
            }
            Flight::Taylor(stepping) => stepping.fly(motion, wanted, horizon, record),
        }
    }

    /// The full state of an orbit, counted from 0.
    ///
    /// # Panics
    ///
    /// If there is no such orbit.
    pub fn state(&self, orbit: usize) -> Vec<f64> {
        if self.together.holds(orbit) {
            let states = self.motion.state.iter();
            return states.map(|state| state[orbit]).collect();
        }
        self.alone[orbit].state().to_vec()
    }

    /// Whether the last period of an orbit was flown in lanes to its end.
    pub fn is_together(&self, orbit: usize) -> bool {
        self.together.holds(orbit)
    }

    /// Takes orbits into their lanes that are in free flight.
    fn join(&mut self) {
        if self.together == self.used {
            return;
        }
        for lane in (self.used & !self.together).lanes() {
            if self.alone[lane].regime() == Regime::Free {
                self.take(lane);
            }
        }
    }

    /// Takes an orbit into its lane.
    fn take(&mut self, lane: usize) {
        let (simulator, motion) = (&self.alone[lane], &mut self.motion);
        let own = &simulator.motion;
        for (state, &value) in motion.state.iter_mut().zip(&own.state) {
            state[lane] = value;
        }
        motion.leaving.set(lane, own.leaving[0].is_some());
        motion.rounding[lane] = own.leaving[0].unwrap_or(0.0);
        motion.rises.set(lane, own.headings[0] == Heading::Rising);
        motion.falls.set(lane, own.headings[0] == Heading::Falling);
        if let (Flight::Exact(impacts), Some(tools)) = (&mut self.flight, &simulator.affine) {
            impacts.put_harmonic(lane, tools.harmonic());
        }
        self.outcomes[lane] = Outcome::Completed;
        self.together.set(lane, true);
    }

    /// The rest of the period of orbits that have left the lanes, and all of it of those that were
    /// not there.
    #[cold]
    fn finish_alone(
        &mut self,
        wanted: LaneMask<N>,
        reference: Lanes<N>,
        left: &LaneLeft<N>,
        record: &mut dyn FnMut(usize, Event<f64>),
    ) {
        for lane in (self.used & !self.together).lanes() {
            let record = &mut |event| record(lane, event);
            if wanted.holds(lane) {
                self.give_back(lane, reference[lane]);
            }
            let (simulator, duration) = (&mut self.alone[lane], self.durations[lane]);
            let outcome = if left.flown.holds(lane) {
                let contact = left.contact.holds(lane);
                let stop = contact.then_some(Stop::Contact { surface: 0 });
                simulator.finish_period(stop, duration, record)
            } else {
                simulator.advance_period(duration, record)
            };
            // A phase there is: no error.
            self.outcomes[lane] = outcome.unwrap_or(Outcome::Completed);
        }
    }

    /// Puts an orbit back into its simulator, on its way through a period that began at a phase.
    fn give_back(&mut self, lane: usize, reference: f64) {
        let simulator = &mut self.alone[lane];
        let (own, motion) = (&mut simulator.motion, &self.motion);
        for (state, value) in own.state.iter_mut().zip(&motion.state) {
            *state = value[lane];
        }
        (own.time, own.turns) = (motion.time[lane], motion.turns[lane] as i64);
        own.reference_phase = reference;
        let leaving = motion.leaving.holds(lane);
        own.leaving[0] = leaving.then_some(motion.rounding[lane]);
        own.headings[0] = match (motion.rises.holds(lane), motion.falls.holds(lane)) {
            (true, _) => Heading::Rising,
            (_, true) => Heading::Falling,
            _ => Heading::Unknown,
        };
        if let (Flight::Exact(impacts), Some(tools)) = (&self.flight, &mut simulator.affine) {
            tools.put_harmonic(impacts.harmonic(lane));
        }
    }
}

impl<'a, const N: usize> Flight<'a, N> {
    /// From the simulators of lanes; lanes without one take the first.
    fn new(alone: &mut [Simulator<'a, f64>]) -> Option<Self> {
        let lanes = alone.len();
        let own = |lane: usize| if lane < lanes { lane } else { 0 };
        let system = alone[0].system();
        if system.method() == FlowMethod::Taylor {
            let parameters = std::array::from_fn(|lane| &alone[own(lane)].parameters[..]);
            let flow = LaneTaylor::new(system, parameters)?;
            return Some(Self::Taylor(Box::new(LaneStepping::new(flow, system))));
        }
        let tables: Option<Vec<_>> = alone.iter_mut().map(Simulator::orbit_tables).collect();
        let tables = tables?;
        let impacts = LaneImpacts::new(std::array::from_fn(|lane| &tables[own(lane)]))?;
        Some(Self::Exact(Box::new(impacts)))
    }
}

impl Simulator<'_, f64> {
    /// What the orbit leaps by, where it can.
    pub(super) fn orbit_tables(&mut self) -> Option<OrbitTables> {
        let tools = self.affine.as_mut()?;
        tools.orbit_tables(&mut self.motion, &self.parameters)
    }
}
