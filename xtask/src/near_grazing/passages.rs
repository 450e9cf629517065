//! Passages with depths down to 1e-14 in lanes, compared with double-double.
//!
//! Both simulations start from the same numbers, so that every difference is an error of the
//! simulation and not the rounding of its input.

use grazemap::analysis::SectionFrame;
use grazemap::hybrid::{DirectReturn, HybridSystem, LaneReturns, ReturnOutcome};
use grazemap::model::{Model, Scene, catalogue};
use grazemap::numeric::{Dd, Lanes};
use grazemap::orbit::{GrazingOrbit, locate};

const LANES: usize = 8;

/// Difference of an image, or of the speed of a contact, that counts as an error.
pub const WRONG: f64 = 1e-6;

/// Range of the distance from the graze, in powers of ten.
const DECADES: [f64; 2] = [-14.0, -2.0];

/// Scene of the catalogue on a section, with its flow method.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Name in the catalogue.
    pub scene: &'static str,
    /// Overrides of the scene that select the section.
    pub section: &'static [(&'static str, &'static str)],
    /// Constructor of the system: it decides how free flights are flown.
    pub lowered: fn(&Model) -> HybridSystem,
}

/// Counts and errors of passages.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Number of passages.
    pub passages: usize,
    /// Number of passages with contact.
    pub contacts: usize,
    /// Number of passages flown in lanes.
    pub together: usize,
    /// Largest error.
    pub largest: f64,
    /// Wrong passages, as text.
    pub wrong: Vec<String>,
}

impl Tally {
    /// Sum of two tallies.
    pub fn and(mut self, other: Self) -> Self {
        self.passages += other.passages;
        self.contacts += other.contacts;
        self.together += other.together;
        self.largest = self.largest.max(other.largest);
        self.wrong.extend(other.wrong);
        self
    }
}

/// Scene, located and lowered.
pub struct Graze {
    case: Case,
    scene: Scene,
    orbit: GrazingOrbit,
    system: HybridSystem,
}

impl Case {
    /// Locates the grazing orbit of the scene.
    pub fn graze(self) -> Result<Graze, String> {
        let text = catalogue::text(self.scene).ok_or_else(|| format!("no {}", self.scene))?;
        let set: Vec<_> =
            self.section.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let scene = Scene::parse_with(text, self.scene, &set).map_err(|e| e.to_string())?;
        let found = locate(&scene).map_err(|error| error.to_string())?.into_result();
        let orbit = found.map_err(|reason| reason.to_string())?;
        Ok(Graze { case: self, system: (self.lowered)(&scene.model), scene, orbit })
    }
}

impl Graze {
    /// Simulates the passages of these blocks of eight.
    ///
    /// # Panics
    ///
    /// If the scene has no lanes.
    pub fn passages(&self, blocks: std::ops::Range<usize>) -> Tally {
        let mut frame = SectionFrame::<f64>::new(&self.scene, &self.orbit);
        let each = blocks.map(|block| self.block(&mut frame, block));
        each.fold(Tally::default(), Tally::and)
    }

    fn block(&self, frame: &mut SectionFrame<f64>, block: usize) -> Tally {
        let (mut maps, mut starts) = (Vec::new(), Vec::new());
        for number in block * LANES..(block + 1) * LANES {
            let (offsets, own) = offsets(number, frame.dimension(), frame.active());
            frame.place(&offsets, &own).expect("its lengths");
            let duration = frame.duration();
            let (section, periods) = (frame.return_section(), frame.periods());
            let map =
                DirectReturn::new(&self.system, frame.parameters(), section, duration, periods);
            let map = map.and_then(|map| map.with_passages(&frame.nominal_passages(duration)));
            maps.push(map.expect("finite parameters"));
            starts.push((frame.state().to_vec(), frame.parameters().to_vec(), duration));
        }
        let mut lanes = LaneReturns::<'_, LANES>::new(maps).expect("a scene with lanes");
        let component = |place| Lanes::from_fn(|lane| starts[lane].0[place]);
        let states: Vec<_> = (0..starts[0].0.len()).map(component).collect();
        let found = lanes.images(&states, [true; LANES]);
        let mut tally = Tally { passages: LANES, ..Tally::default() };
        for (lane, (state, parameters, duration)) in starts.iter().enumerate() {
            let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect();
            let (state, parameters): (Vec<Dd>, Vec<Dd>) = (exact(state), exact(parameters));
            let (section, periods) = (frame.return_section(), frame.periods());
            let truth =
                DirectReturn::new(&self.system, &parameters, section, Dd::from(*duration), periods);
            let truth = truth
                .and_then(|map| map.with_passages(&frame.nominal_passages(*duration)))
                .and_then(|mut map| map.image(&state))
                .expect("finite numbers");
            let is_there = truth.outcome == ReturnOutcome::Returned;
            let mut error = if is_there == found.returned[lane] { 0.0 } else { f64::INFINITY };
            if is_there && found.returned[lane] {
                let pairs = found.state.iter().zip(&truth.state);
                for (lanes, truth) in pairs {
                    error = f64::max(error, (*truth - Dd::from(lanes[lane])).abs().to_f64());
                }
                for (speeds, truth) in found.speeds.iter().zip(&truth.passages) {
                    let truth = truth.map_or(0.0, Dd::to_f64);
                    error = f64::max(error, (speeds[lane].unwrap_or(0.0) - truth).abs());
                }
            }
            tally.contacts += usize::from(truth.contacts > 0);
            tally.together += usize::from(found.together[lane]);
            tally.largest = tally.largest.max(error);
            if error.is_nan() || error > WRONG {
                let number = block * LANES + lane;
                tally.wrong.push(format!("{:?}, {number}: {error:e} {truth:?}", self.case));
            }
        }
        tally
    }
}

/// Offsets of coordinates and parameters, all at one distance from the graze.
fn offsets(number: usize, dimension: usize, active: usize) -> (Vec<f64>, Vec<f64>) {
    let steps = [0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122, 0.185_037];
    let share = |place: usize| (0.31 + (number + 1) as f64 * steps[place % 6]).fract();
    let [from, to] = DECADES;
    let distance = 10f64.powf(from + (to - from) * share(5));
    let state = (0..dimension).map(|place| distance * (2.0 * share(place) - 1.0));
    let own = (0..active).map(|place| 1e-2 * distance * (2.0 * share(place + 2) - 1.0));
    (state.collect(), own.collect())
}
