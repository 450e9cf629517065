//! Returns from points of an orbit to the sections of a scene, by both.

use grazemap::hybrid::{DirectReturn, HybridSystem, Return, ReturnOutcome, ReturnSection};

use super::super::independent::{Failure, Simulator, next_approach, speeds, tangency_return};
use super::random::Random;
use super::{TOLERANCE, Tally};

/// Periods that an orbit is followed for after it has settled, and those that it may settle.
const PERIODS: usize = 10;
const SETTLE: usize = 12;
/// Perturbation that rounding is grown from, in units of the orbit's size.
const NUDGE: f64 = 1e-12;
/// Contacts that are slower may be others, or none, by rounding, or belong to a chatter, the end of
/// which the program sums. The state tells of them too.
const SLOW: f64 = 5e-3;

/// An oscillator at fixed parameters.
#[derive(Clone, Debug)]
pub(super) struct Orbit<'a> {
    pub(super) system: &'a HybridSystem,
    pub(super) simulator: Simulator<'a, f64>,
    /// Size of the orbit's states.
    pub(super) size: f64,
}

/// An image as both tell it.
struct Image {
    state: Vec<f64>,
    speeds: Vec<f64>,
}

impl Orbit<'_> {
    /// Follows an orbit from somewhere, and compares all returns from its points.
    pub(super) fn followed(mut self, random: &mut Random, phase: f64, tally: &mut Tally) {
        let dimension = self.simulator.state.len();
        let mut start: Vec<f64> = (1..dimension).map(|_| random.between(-1.0, 1.0)).collect();
        start.push(phase);
        self.simulator.place(&start);
        let stops = self.simulator.oscillator.stops.len();
        // Away from stops that the place is beyond.
        for _ in 0..60 {
            if (0..stops).all(|stop| self.simulator.gap(stop).0 > 0.0) {
                break;
            }
            start[..dimension - 1].iter_mut().for_each(|value| *value *= 0.8);
            self.simulator.place(&start);
        }
        if (0..stops).any(|stop| self.simulator.gap(stop).0 <= 0.0) {
            return;
        }
        let Some(period) = self.simulator.forcing_period() else { return };
        let settle = random.below(SETTLE);
        if self.simulator.advance(settle as f64 * period).is_err() {
            return;
        }
        self.simulator.reduce_phase();
        self.simulator.state[dimension - 1] = phase;
        self.simulator.time = 0.0;
        let states = &self.simulator.state[..dimension - 1];
        self.size = states.iter().fold(1.0, |size: f64, value| size.max(value.abs()));
        if self.size > 1e3 {
            return;
        }
        self.phases(period, tally);
        for stop in 0..stops {
            self.tangencies(stop, period, tally);
        }
    }

    /// Returns to the orbit's phase, at which everything is simulated.
    fn phases(&self, period: f64, tally: &mut Tally) {
        let mut orbit = self.simulator.clone();
        for _ in 0..PERIODS {
            let start = orbit.clone();
            let truth = orbit.advance(period).map(|happened| Image {
                state: reduced(&orbit.state, &start.state),
                speeds: speeds(&happened).iter().map(|&(_, speed)| speed).collect(),
            });
            let failed = truth.is_err();
            let again = |state: &[f64]| {
                let mut nudged = start.clone();
                nudged.state = state.to_vec();
                nudged.advance(period).ok()?;
                Some(reduced(&nudged.state, &start.state))
            };
            let section = ReturnSection::OtherPhase;
            self.judge(section, &start.state, truth.map(Some), &again, tally);
            if failed {
                return;
            }
            orbit.reduce_phase();
            if let Some(phase) = orbit.state.last_mut() {
                *phase = start.state[start.state.len() - 1];
            }
            orbit.time = 0.0;
        }
    }

    /// Returns from the orbit's approaches to a stop.
    fn tangencies(&self, stop: usize, period: f64, tally: &mut Tally) {
        let mut orbit = self.simulator.clone();
        let until = PERIODS as f64 * period;
        let mut happened = Vec::new();
        while let Ok(Some(approach)) = next_approach(&mut orbit, stop, until, period, &mut happened)
        {
            if !approach.is_free {
                continue;
            }
            let mut start = approach.state;
            let last = start.len() - 1;
            start[last] = start[last].rem_euclid(std::f64::consts::TAU);
            let image = |state: &[f64]| tangency_return(&self.simulator, stop, state, period);
            let found = image(&start);
            if let Ok(Some(found)) = &found
                && !found.is_free
            {
                tally.ambiguous += 1;
                continue;
            }
            let truth = found.map(|found| {
                found.map(|found| Image {
                    state: reduced(&found.state, &start),
                    speeds: found.speeds.iter().map(|&(_, speed)| speed).collect(),
                })
            });
            let again = |state: &[f64]| Some(reduced(&image(state).ok()??.state, &start));
            let section = ReturnSection::Tangency { surface: stop };
            tally.tangencies += 1;
            self.judge(section, &start, truth, &again, tally);
        }
    }

    /// Compares the program's image of a section point with the truth.
    fn judge(
        &self,
        section: ReturnSection,
        start: &[f64],
        truth: Result<Option<Image>, Failure>,
        again: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
        tally: &mut Tally,
    ) {
        let parameters = &self.simulator.parameters;
        let map = DirectReturn::over_periods(self.system, parameters, section, 1);
        let found = map.and_then(|mut map| map.image(start));
        let found: Return<f64> = match found {
            Ok(found) => found,
            Err(error) => return tally.wrong.push(format!("{section:?}: {error}")),
        };
        let words = |what: &str| {
            format!("{section:?} at {parameters:?} from {start:?}: {what}; {:?}", found.outcome)
        };
        let truth = match (truth, found.outcome) {
            (_, ReturnOutcome::Ambiguous { .. }) => return tally.ambiguous += 1,
            (Ok(Some(truth)), ReturnOutcome::Returned) => truth,
            (Ok(None), ReturnOutcome::NoReturn { .. }) => return tally.ended += 1,
            (Err(_), ReturnOutcome::Ended(_)) => return tally.ended += 1,
            (Ok(truth), _) => {
                let truth = truth.map(|truth| (truth.state, truth.speeds));
                return tally.wrong.push(words(&format!("{truth:?} is right")));
            }
            // NOTE: the program goes on where the independent simulator does not know how.
            (Err(reason), _) => {
                tally.ended += 1;
                let _ = reason;
                return;
            }
        };
        tally.returns += 1;
        tally.contacts += usize::from(!truth.speeds.is_empty());
        let state = reduced(&found.state, start);
        let error = apart(&state, &truth.state) / self.size;
        let speeds = differ(&found.impact_speeds, &truth.speeds);
        if error <= TOLERANCE && !speeds {
            tally.largest = tally.largest.max(error);
            return;
        }
        let grown = self.growth(start, &truth.state, again);
        if !speeds && grown.is_none_or(|grown| error <= 4.0 * grown) {
            tally.grown += 1;
            return;
        }
        if speeds && grown.is_none_or(|grown| grown > 1e-3) {
            tally.grown += 1;
            return;
        }
        tally.wrong.push(words(&format!(
            "{state:?} with {:?}; {:?} with {:?} is right; {error:e}, rounding grows to {grown:?}",
            found.impact_speeds, truth.state, truth.speeds
        )));
    }

    /// How far images of neighbours go, in units of the orbit's size; `None` where one has none.
    fn growth(
        &self,
        start: &[f64],
        truth: &[f64],
        again: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
    ) -> Option<f64> {
        let mut most = 0.0f64;
        for place in 0..start.len() {
            for sign in [-1.0, 1.0] {
                let mut nudged = start.to_vec();
                nudged[place] += sign * NUDGE * self.size;
                most = most.max(apart(&again(&nudged)?, truth) / self.size);
            }
        }
        Some(most)
    }
}

/// Largest difference of two states.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| {
        let apart = (a - b).abs();
        if apart.is_nan() { f64::INFINITY } else { most.max(apart) }
    })
}

/// A state with its phase within half a period of that of another.
fn reduced(state: &[f64], about: &[f64]) -> Vec<f64> {
    let mut state = state.to_vec();
    if let (Some(phase), Some(about)) = (state.last_mut(), about.last()) {
        let period = std::f64::consts::TAU;
        *phase -= period * ((*phase - about) / period).round();
    }
    state
}

/// Whether speeds of contacts differ, but for slow ones.
fn differ(found: &[f64], truth: &[f64]) -> bool {
    let fast = |speeds: &[f64]| -> Vec<f64> {
        speeds.iter().copied().filter(|&speed| speed > SLOW).collect()
    };
    let near = |speeds: &[f64]| speeds.iter().any(|speed| (speed / SLOW - 1.0).abs() < 1e-3);
    if near(found) || near(truth) {
        return false;
    }
    let (found, truth) = (fast(found), fast(truth));
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-7 * (1.0 + 1e-3 / b);
    found.len() != truth.len() || !found.iter().zip(&truth).all(same)
}
