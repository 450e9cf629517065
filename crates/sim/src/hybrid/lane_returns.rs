//! Returns of several orbits in lanes, each at its own parameters.
//!
//! One idea: lanes fly what returns have in common; a return that does anything else is flown by a
//! scalar simulator, from its start. So an image is, to the last bit, that of [`DirectReturn`],
//! whatever its neighbours do.

use super::affine::{LaneTools, OrbitTables};
use super::lane_flight::LaneFlight;
use super::lane_flow::LaneFlow;
use super::lane_taylor::LaneTaylor;
use super::return_map::DirectReturn;
use super::returned::ReturnOutcome;
use super::simulator::Simulator;
use super::system::{FlowMethod, Law};
use crate::numeric::{LaneMask, Lanes, Real, is_wide};

/// The return map of a section by direct simulation, other parameters in every lane.
///
/// It is for systems with one rigid surface, on every section and with any number of grazing
/// passages. Impacts and near misses are flown in lanes. A return that sticks, chatters or does not
/// come back, or whose events are not found in lanes, is flown by a scalar simulator, from its
/// start.
#[derive(Clone, Debug)]
pub struct LaneReturns<'a, const N: usize> {
    scalar: Vec<DirectReturn<'a, f64>>,
    flight: Flight<'a, N>,
    images: LaneImages<N>,
}

/// The method by which lanes are flown, that of each scalar simulator.
#[derive(Clone, Debug)]
enum Flight<'a, const N: usize> {
    Exact(Box<LaneFlight<LaneTools<N>, N>>),
    Taylor(Box<LaneFlight<LaneTaylor<'a, N>, N>>),
}

/// Images of the states of every lane.
#[derive(Clone, Debug)]
pub struct LaneImages<const N: usize> {
    /// The full states at the next section points, the nominal advance of the phase removed; not
    /// to be used where none was reached.
    pub state: Vec<Lanes<N>>,
    /// Speeds at which each passage met the surface, in the order of their numbers; `None` without
    /// contact.
    pub speeds: Vec<[Option<f64>; N]>,
    /// Whether the section was reached.
    pub returned: [bool; N],
    /// Whether the return was flown in lanes.
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
    /// The return maps of lanes at their parameters; `None` unless all are of one system with one
    /// rigid surface, on one section and with as many passages, and on machines without wide
    /// registers ([`is_wide`]).
    ///
    /// # Panics
    ///
    /// If there are none, or more than lanes.
    pub fn new(mut scalar: Vec<DirectReturn<'a, f64>>) -> Option<Self> {
        let lanes = scalar.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let fits = |map: &DirectReturn<'a, f64>| map.fits_lanes() && map.is_like(&scalar[0]);
        if !scalar.iter().all(fits) {
            return None;
        }
        let flight = Flight::new(&mut scalar)?;
        let zero = Lanes::splat(0.0);
        let images = LaneImages {
            state: vec![zero; scalar[0].simulator.system().dimension()],
            speeds: vec![[None; N]; scalar[0].itinerary.len()],
            returned: [false; N],
            together: [false; N],
        };
        Some(Self { scalar, flight, images })
    }

    /// The next section points from full states at the section, of the lanes that are wanted.
    #[inline(never)]
    pub fn images(&mut self, states: &[Lanes<N>], wanted: [bool; N]) -> &LaneImages<N> {
        let used = self.scalar.len();
        let wanted = LaneMask::from_fn(|lane| wanted[lane] && lane < used);
        let done = match &mut self.flight {
            Flight::Exact(flight) => self.images.fly(flight, states, wanted),
            Flight::Taylor(flight) => self.images.fly(flight, states, wanted),
        };
        for lane in (wanted & !done).lanes() {
            self.fly_scalar(lane, states);
        }
        &self.images
    }

    /// The image of one lane by its own simulator.
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
    /// Takes the images of the wanted lanes from a flight; those that it reached.
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

impl<'a, const N: usize> Flight<'a, N> {
    /// From the return maps of lanes; lanes without one take the first.
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
    /// The tables of the orbit's exact steps, where it has them.
    fn orbit_tables(&mut self) -> Option<OrbitTables> {
        let tools = self.affine.as_mut()?;
        tools.orbit_tables(&mut self.motion, &self.parameters)
    }
}

impl<S: Real> DirectReturn<'_, S> {
    /// Whether returns of this kind may be flown in lanes.
    pub fn fits_lanes(&self) -> bool {
        let surfaces = &self.simulator.system().surfaces[..];
        is_wide() && matches!(surfaces, [surface] if matches!(surface.law, Law::Rigid { .. }))
    }

    /// Whether returns of both are flown in one way.
    fn is_like(&self, other: &Self) -> bool {
        std::ptr::eq(self.simulator.system(), other.simulator.system())
            && (self.section, self.periods) == (other.section, other.periods)
            && self.itinerary.len() == other.itinerary.len()
    }
}
