//! Returns of several orbits in lanes, each at its own parameters.
//!
//! One idea: lanes hold what returns have in common, and what one of them has alone is left to its own simulator from the
//! start. So an image is, to the last bit, that of [`DirectReturn`], whatever its neighbours do.

use super::affine::{LaneTools, OrbitTables};
use super::lane_flight::LaneFlight;
use super::return_map::DirectReturn;
use super::returned::{ReturnOutcome, ReturnSection};
use super::system::Law;
use crate::numeric::{LaneMask, Lanes};

/// The return map of a tangency section by direct simulation, other parameters in every lane.
///
/// It is for systems with one rigid surface whose free flight and reset are affine, and returns with one grazing passage.
/// Impacts and near misses are flown in lanes. A return that control points do not decide, that sticks, chatters or does not
/// come back is simulated alone, from its start.
#[derive(Clone, Debug)]
pub struct LaneReturns<'a, const N: usize> {
    alone: Vec<DirectReturn<'a, f64>>,
    flight: LaneFlight<N>,
    images: LaneImages<N>,
}

/// Images of the states of every lane.
#[derive(Clone, Debug)]
pub struct LaneImages<const N: usize> {
    /// The full states at the next section points, the nominal advance of the phase removed; not to be used where none was
    /// reached.
    pub state: Vec<Lanes<N>>,
    /// Speeds at which the passages met the surface; `None` without contact.
    pub speeds: [Option<f64>; N],
    /// Whether the section was reached.
    pub returned: [bool; N],
    /// Whether the return was flown in lanes.
    pub together: [bool; N],
}

impl<'a, const N: usize> LaneReturns<'a, N> {
    /// The return maps of lanes at their parameters; `None` where they cannot be flown in lanes.
    ///
    /// # Panics
    ///
    /// If there are none, or more than lanes.
    pub fn new(mut alone: Vec<DirectReturn<'a, f64>>) -> Option<Self> {
        let lanes = alone.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let tables: Option<Vec<OrbitTables>> = alone.iter_mut().map(tables).collect();
        let tables = tables?;
        let own = |lane: usize| if lane < lanes { lane } else { 0 };
        let tools = LaneTools::new(std::array::from_fn(|lane| tables[own(lane)].clone()))?;
        let durations = Lanes::from_fn(|lane| alone[own(lane)].duration);
        let first = &alone[0];
        let flight = LaneFlight::new(tools, first.simulator.system(), durations, first.periods);
        let images = LaneImages {
            state: flight.states().to_vec(),
            speeds: [None; N],
            returned: [false; N],
            together: [false; N],
        };
        Some(Self {
            alone,
            flight,
            images,
        })
    }

    /// The next section points from full states at the section, of the lanes that are wanted.
    pub fn images(&mut self, states: &[Lanes<N>], wanted: [bool; N]) -> &LaneImages<N> {
        let used = self.alone.len();
        let wanted = LaneMask::from_fn(|lane| wanted[lane] && lane < used);
        let done = self.flight.fly(states, wanted);
        self.images.state.copy_from_slice(self.flight.states());
        for lane in 0..N {
            let together = done.holds(lane);
            self.images.speeds[lane] = self.flight.speed(lane);
            (self.images.returned[lane], self.images.together[lane]) = (together, together);
        }
        for lane in (wanted & !done).lanes() {
            self.fly_alone(lane, states);
        }
        &self.images
    }

    /// The image of one lane by its own simulator.
    #[cold]
    fn fly_alone(&mut self, lane: usize, states: &[Lanes<N>]) {
        let images = &mut self.images;
        let state: Vec<f64> = states.iter().map(|value| value[lane]).collect();
        let image = self.alone[lane].image(&state);
        let image = image
            .ok()
            .filter(|image| image.outcome == ReturnOutcome::Returned);
        images.returned[lane] = image.is_some();
        if let Some(image) = image {
            images.speeds[lane] = image.passages.first().copied().flatten();
            for (out, value) in images.state.iter_mut().zip(image.state) {
                out[lane] = value;
            }
        }
    }
}

/// What an orbit flies by in lanes, where it can.
fn tables(alone: &mut DirectReturn<'_, f64>) -> Option<OrbitTables> {
    let simulator = &mut alone.simulator;
    let is_common = matches!(alone.section, ReturnSection::Tangency { surface: 0 })
        && alone.itinerary.is_own_alone()
        && matches!(&simulator.system.surfaces[..], [surface] if matches!(surface.law, Law::Rigid { .. }));
    let tools = simulator.affine.as_mut().filter(|_| is_common)?;
    tools.orbit_tables(&mut simulator.motion, &simulator.parameters)
}
