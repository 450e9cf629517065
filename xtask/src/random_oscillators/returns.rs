//! Returns from points of an orbit to the sections of a scene, by both simulators.

use grazemap::hybrid::{DirectReturn, HybridSystem, Return, ReturnOutcome, ReturnSection};

use super::campaign::{TOLERANCE, Tally};
use crate::independent::{
    Failure, Happening, Mode, Simulator, next_approach, speeds, tangency_return,
};
use crate::random::Random;

/// Largest number of periods in which an orbit may settle.
const SETTLE: usize = 12;
/// Number of consecutive returns to the phase of a graze.
const CHAIN: usize = 3;
/// Perturbation used to measure the growth of rounding, in units of the orbit's size.
const NUDGE: f64 = 1e-12;
/// Speed below which a contact may differ or vanish by rounding, or belong to a chatter whose end
/// the program sums. The state reveals these too.
const SLOW: f64 = 5e-3;

/// Number of phases at which the room between stops is looked at.
const PHASES: usize = 64;

/// Oscillator at fixed parameters.
#[derive(Clone, Debug)]
pub(super) struct Orbit<'a> {
    pub(super) system: &'a HybridSystem,
    pub(super) simulator: Simulator<'a, f64>,
    /// Number of periods followed.
    pub(super) periods: usize,
    /// Size of the orbit's states.
    pub(super) size: f64,
}

/// Image by one of the simulators.
struct Image {
    state: Vec<f64>,
    speeds: Vec<f64>,
    /// Speed of the contact behind which the section point lies.
    ahead: Option<f64>,
}

impl Image {
    /// Whether consecutive impacts are so slow that some belong to a chatter. The program sums the
    /// end of a chatter, and has no section points in it.
    fn chatters(&self) -> bool {
        let slow = |speed: &&f64| **speed < SLOW;
        self.speeds.iter().chain(&self.ahead).filter(slow).count() > 1
    }
}

impl Orbit<'_> {
    /// Follows an orbit from a random state, and compares all returns from its points.
    pub(super) fn followed(mut self, random: &mut Random, phase: f64, tally: &mut Tally) {
        let dimension = self.simulator.state.len();
        let mut start: Vec<f64> = (1..dimension).map(|_| random.between(-1.0, 1.0)).collect();
        start.push(phase);
        self.simulator.place(&start);
        let stops = self.simulator.oscillator.stops.len();
        // Moves the state away from stops that it is beyond.
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
        if self.is_squeezed() {
            tally.unjudged += 1;
            return;
        }
        self.phases(period, tally);
        for stop in 0..stops {
            self.tangencies(stop, period, tally);
            self.grazing_phases(stop, period, tally);
        }
    }

    /// Whether the stops leave no room between them at some phase. A mass hits such stops ever
    /// faster, and nothing tells where it is behind both.
    fn is_squeezed(&self) -> bool {
        let mut orbit = self.simulator.clone();
        let stops = orbit.oscillator.stops.len();
        let last = orbit.state.len() - 1;
        stops > 1
            && (0..PHASES).any(|number| {
                orbit.state[last] = number as f64 / PHASES as f64 * std::f64::consts::TAU;
                (0..stops).map(|stop| orbit.gap(stop).0).sum::<f64>() <= 0.0
            })
    }

    /// Compares returns to the orbit's phase, with full simulation.
    fn phases(&self, period: f64, tally: &mut Tally) {
        let mut orbit = self.simulator.clone();
        for _ in 0..self.periods {
            let start = orbit.clone();
            let truth = orbit.advance(period).map(|happened| Image {
                state: reduced(&orbit.state, &start.state),
                speeds: speeds(&happened).iter().map(|&(_, speed)| speed).collect(),
                ahead: None,
            });
            let failed = truth.is_err();
            let again = |state: &[f64]| {
                let mut nudged = start.clone();
                nudged.state = state.to_vec();
                nudged.advance(period).ok()?;
                Some(reduced(&nudged.state, &start.state))
            };
            let section = ReturnSection::OtherPhase;
            match self.image(section, &start.state) {
                Ok(found) => {
                    let at = (section, &start.state[..]);
                    self.judge(at, &found, truth.map(Some), &again, tally);
                }
                Err(words) => tally.wrong.push(words),
            }
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

    /// Compares returns from the orbit's approaches to a stop.
    fn tangencies(&self, stop: usize, period: f64, tally: &mut Tally) {
        let mut orbit = self.simulator.clone();
        let until = self.periods as f64 * period;
        let mut happened = Vec::new();
        while let Ok(Some(approach)) = next_approach(&mut orbit, stop, until, &mut happened) {
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
                    ahead: found.ahead,
                })
            });
            let again = |state: &[f64]| Some(reduced(&image(state).ok()??.state, &start));
            let section = ReturnSection::Tangency { surface: stop };
            tally.tangencies += 1;
            match self.image(section, &start) {
                Ok(found) => {
                    self.judge((section, &start), &found, truth, &again, tally);
                }
                Err(words) => tally.wrong.push(words),
            }
        }
    }

    /// Compares returns to the phase of a graze. A section point behind a contact belongs to the
    /// flight without the stop.
    fn grazing_phases(&self, stop: usize, period: f64, tally: &mut Tally) {
        let mut orbit = self.simulator.clone();
        for _ in 0..self.periods / CHAIN {
            let Ok(before) = orbit.advance(period) else { return };
            let clear = |at: f64| at < orbit.time - 0.25 * period;
            let mut ahead = orbit.clone();
            let is_clear = before.iter().all(|event| clear(event.time) || !event.acts())
                && orbit.mode == Mode::Free
                && ahead
                    .advance(0.25 * period)
                    .is_ok_and(|after| !after.iter().any(Happening::acts));
            if is_clear {
                let mut start = orbit.clone();
                start.reduce_phase();
                start.time = 0.0;
                self.chain(stop, period, &start, tally);
            }
        }
    }

    /// Compares several returns to the phase of a graze, from a state away from contacts.
    fn chain(&self, stop: usize, period: f64, orbit: &Simulator<'_, f64>, tally: &mut Tally) {
        let section = ReturnSection::GrazingPhase { surface: stop };
        let (mut start, mut before) = (orbit.state.clone(), 0);
        for number in 1..=CHAIN {
            let time = number as f64 * period;
            let Ok(truths) = self.at_phase(stop, time, orbit, &start) else { return };
            let Ok(found) = self.image(section, &start) else { return };
            let state = reduced(&found.state, &start);
            let distance = |truth: &Image| apart(&truth.state, &state);
            let nearest = |truths: Vec<Image>| {
                truths.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
            };
            let Some(mut truth) = nearest(truths) else { return };
            let made = truth.speeds.len();
            truth.speeds.drain(..before.min(made));
            let next = truth.state.clone();
            let again = |state: &[f64]| {
                // The start of the chain is perturbed in the same way.
                let mut nudged = orbit.clone();
                for ((nudged, &moved), &start) in nudged.state.iter_mut().zip(state).zip(&start) {
                    *nudged += moved - start;
                }
                let truths = self.at_phase(stop, time, &nudged, &start).ok()?;
                nearest(truths).map(|truth| truth.state)
            };
            if !self.judge((section, &start), &found, Ok(Some(truth)), &again, tally) {
                return;
            }
            (start, before) = (next, made);
        }
    }

    /// Possible section points of a state at the phase of a graze, with the number of contacts
    /// before each: the state itself, or its flight from a contact on without the stop.
    fn at_phase(
        &self,
        stop: usize,
        time: f64,
        orbit: &Simulator<'_, f64>,
        about: &[f64],
    ) -> Result<Vec<Image>, Failure> {
        let mut orbit = orbit.clone();
        let happened: Vec<_> = orbit.advance(time)?.into_iter().filter(Happening::acts).collect();
        let told: Vec<f64> = speeds(&happened).iter().map(|&(_, speed)| speed).collect();
        let mut truths = Vec::new();
        let contacts = happened.iter().filter(|event| event.kind.speed().is_some());
        for (number, met) in contacts.enumerate().filter(|(_, met)| met.stop == stop) {
            let mut beyond = orbit.clone();
            beyond.place(&met.state);
            beyond.time = met.time;
            beyond.ignored = Some(stop);
            if beyond.advance(time - met.time).is_ok() {
                let (speeds, ahead) = (told[..number].to_vec(), met.kind.speed());
                truths.push(Image { state: reduced(&beyond.state, about), speeds, ahead });
            }
        }
        truths.push(Image { state: reduced(&orbit.state, about), speeds: told, ahead: None });
        Ok(truths)
    }

    /// Image of a section point by the program.
    fn image(&self, section: ReturnSection, start: &[f64]) -> Result<Return<f64>, String> {
        let map = DirectReturn::over_periods(self.system, &self.simulator.parameters, section, 1);
        let image = map.and_then(|mut map| map.image(start));
        image.map_err(|error| format!("{section:?}: {error}"))
    }

    /// Compares the program's image of a section point with the reference. Returns whether both
    /// exist and agree.
    fn judge(
        &self,
        (section, start): (ReturnSection, &[f64]),
        found: &Return<f64>,
        truth: Result<Option<Image>, Failure>,
        again: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
        tally: &mut Tally,
    ) -> bool {
        let words = |what: &str| {
            let parameters = &self.simulator.parameters;
            let (outcome, elapsed) = (found.outcome, found.elapsed);
            format!(
                "{section:?} at {parameters:?} from {start:?}: {what}; {outcome:?} after {elapsed}"
            )
        };
        let truth = match (truth, found.outcome) {
            (_, ReturnOutcome::Ambiguous { .. }) => {
                tally.ambiguous += 1;
                return false;
            }
            (Ok(Some(truth)), ReturnOutcome::Returned) => truth,
            (Ok(None), ReturnOutcome::NoReturn { .. }) | (Err(_), ReturnOutcome::Ended(_)) => {
                tally.ended += 1;
                return false;
            }
            // NOTE: the program may know a rest where the independent simulator does not.
            (Err(_), _) => {
                tally.unjudged += 1;
                return false;
            }
            (Ok(truth), _) => {
                let truth = truth.map(|truth| (truth.state, truth.speeds));
                tally.wrong.push(words(&format!("{truth:?} is right")));
                return false;
            }
        };
        tally.returns += 1;
        tally.contacts += usize::from(!truth.speeds.is_empty());
        let state = reduced(&found.state, start);
        let error = apart(&state, &truth.state) / self.size;
        let speeds = speeds_apart(&found.impact_speeds, &truth.speeds);
        if error <= TOLERANCE && speeds == Some(0.0) {
            tally.largest = tally.largest.max(error);
            return true;
        }
        if truth.chatters() {
            tally.chatters += 1;
            return false;
        }
        let grown = self.growth(start, &truth.state, again);
        let excuse = |grown: f64| match speeds {
            Some(speeds) => error.max(speeds / self.size) <= 4.0 * grown,
            None => grown > 1e-3,
        };
        if grown.is_none_or(excuse) {
            tally.grown += 1;
            return false;
        }
        tally.wrong.push(words(&format!(
            "{state:?} with {:?}; {:?} with {:?} is right; {error:e}, rounding grows to {grown:?}",
            found.impact_speeds, truth.state, truth.speeds
        )));
        false
    }

    /// Largest distance to the images of neighbours, in units of the orbit's size; `None` if one
    /// has none.
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
pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| {
        let apart = (a - b).abs();
        if apart.is_nan() { f64::INFINITY } else { most.max(apart) }
    })
}

/// State whose phase is shifted to within half a period of another state's.
pub(super) fn reduced(state: &[f64], about: &[f64]) -> Vec<f64> {
    let mut state = state.to_vec();
    if let (Some(phase), Some(about)) = (state.last_mut(), about.last()) {
        let period = std::f64::consts::TAU;
        *phase -= period * ((*phase - about) / period).round();
    }
    state
}

/// Largest difference of the speeds of contacts, 0 where all agree, slow ones ignored; `None` if
/// there are more of one than of the other.
fn speeds_apart(found: &[f64], truth: &[f64]) -> Option<f64> {
    let fast = |speeds: &[f64]| -> Vec<f64> {
        speeds.iter().copied().filter(|&speed| speed > SLOW).collect()
    };
    let near = |speeds: &[f64]| speeds.iter().any(|speed| (speed / SLOW - 1.0).abs() < 1e-3);
    if near(found) || near(truth) {
        return Some(0.0);
    }
    let (found, truth) = (fast(found), fast(truth));
    let apart = |(a, b): (&f64, &f64)| {
        let apart = (a - b).abs();
        if apart <= 1e-7 * (1.0 + 1e-3 / b) { 0.0 } else { apart }
    };
    let same = found.len() == truth.len();
    same.then(|| found.iter().zip(&truth).map(apart).fold(0.0, f64::max))
}
