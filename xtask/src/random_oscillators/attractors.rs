//! Attractors of diagrams by direct simulation, compared with returns of the independent simulator.

use grazemap::analysis::NoProgress;
use grazemap::analysis::diagram::{DiagramPoint, diagram};
use grazemap::expansion::Expander;
use grazemap::iteration::{OrbitEnd, Period};
use grazemap::model::{MapOrders, Scene, Section};
use grazemap::orbit::GrazingOrbit;

use super::campaign::Tally;
use super::returns::{apart, reduced};
use crate::independent::{Mode, Oscillator, Simulator, speeds, tangency_return};

/// Longest period compared, in returns.
const LONGEST: usize = 12;
/// Largest difference of the states of a period, in units of the orbit's size: diagrams accept
/// orbits that are still settling.
const SETTLED: f64 = 1e-4;
/// Difference up to which two states count as equal.
const SAME: f64 = 1e-8;
/// Bound of an orbit, in units of its size, and number of forcing periods over which it is checked.
const BOUND: f64 = 50.0;
const WATCHED: usize = 40;

/// Tables of diagrams, one for every component of the full state.
pub(super) fn tables(parameter: &str, offsets: &[f64], states: &[String]) -> String {
    let mut text = String::new();
    for state in states {
        text += &format!(
            "[[diagram]]\nparameter = \"{parameter}\"\nvalues = {offsets:?}\ntransient = 200\n\
             keep = {}\nobserve = \"{state}\"\ndirection = \"up\"\nwith = [\"direct\"]\n",
            2 * LONGEST
        );
    }
    text
}

/// Checks the diagrams of a scene with such tables, on its section.
pub(super) fn diagrams(
    scene: &Scene,
    orbit: &GrazingOrbit,
    oscillator: &Oscillator,
    look: f64,
    tally: &mut Tally,
) -> Result<(), String> {
    let expanded = Expander::new(scene, orbit);
    let expanded = expanded.and_then(|expander| expander.expand(MapOrders::new(1, 2)));
    let Ok(map) = expanded else {
        tally.no_map += 1;
        return Ok(());
    };
    let mut observed = Vec::new();
    for request in &scene.diagrams {
        let diagram = diagram(scene, orbit, &map, request, &NoProgress);
        observed.push(diagram.map_err(|error| format!("a diagram: {error}"))?);
    }
    let adjusted = scene.grazing.solve_for[0];
    for number in 0..observed[0].sweeps[0].points.len() {
        let point = &observed[0].sweeps[0].points[number];
        let mut parameters: Vec<f64> =
            orbit.parameters().iter().map(|value| value.to_f64()).collect();
        parameters[adjusted] += point.offset;
        let last = |component: &grazemap::Diagram| {
            component.sweeps[0].points[number].values.last().copied()
        };
        let state: Option<Vec<f64>> = observed.iter().map(last).collect();
        let simulator = Simulator::new(oscillator, &parameters, look);
        let start = orbit.section_point.iter().map(|value| value.to_f64()).collect();
        let stop = orbit.grazing_point().surface;
        let kept = observed.iter().map(|of| &of.sweeps[0].points[number].values[..]).collect();
        let settled = Settled { point, kept, simulator, start, stop };
        tally.attractors += 1;
        let is_tangency = scene.section == Section::Tangency;
        if let Err(words) = settled.checked(state, is_tangency, tally) {
            let section = if is_tangency { "tangency" } else { "phase" };
            tally.wrong.push(format!("diagram at a {section}, {parameters:?}: {words}"));
        }
    }
    Ok(())
}

/// Point of a diagram, with the independent simulator.
struct Settled<'a> {
    point: &'a DiagramPoint,
    /// Values of each component of the state at the iterates kept.
    kept: Vec<&'a [f64]>,
    simulator: Simulator<'a, f64>,
    /// Section point of the grazing orbit, with which the diagram begins.
    start: Vec<f64>,
    stop: usize,
}

impl Settled<'_> {
    fn checked(
        &self,
        state: Option<Vec<f64>>,
        is_tangency: bool,
        tally: &mut Tally,
    ) -> Result<(), String> {
        let period = self.simulator.forcing_period().ok_or("no phase")?;
        let state = match (self.point.end, state) {
            (OrbitEnd::Completed, Some(state)) => state,
            (OrbitEnd::NoImage { .. }, _) => {
                tally.no_image += 1;
                return Ok(());
            }
            (end, _) => return self.is_unbounded(period, end),
        };
        let size = size(&state);
        let Some(returns) = self.returns(&state, is_tangency, period) else { return Ok(()) };
        let closes = |number: usize| apart(&returns[number].state, &state) / size;
        let returned = (0..returns.len()).find(|&number| closes(number) < SETTLED);
        let closed = returned.map(|number| number + 1);
        let claimed = self.point.returns.map_or(Period::NotFound, Period::Periodic);
        match (claimed, closed) {
            (Period::Periodic(claimed), _) if claimed > LONGEST => Ok(()),
            (Period::Periodic(claimed), Some(closed)) if claimed == closed => {
                let hits: usize = returns[..closed].iter().map(|one| one.hits).sum();
                let time: f64 = returns[..closed].iter().map(|one| one.elapsed).sum();
                let periods = (time / period).round() as usize;
                let Some(name) = &self.point.orbit else { return Ok(()) };
                let told: u32 = name.hits.iter().sum();
                if (told as usize, name.periods) == (hits, periods) || self.chatters(&returns) {
                    tally.periodic += 1;
                    return Ok(());
                }
                Err(format!("{name} for ({hits},{periods}) from {state:?}"))
            }
            // NOTE: an orbit of a long period may pass near itself.
            (Period::Periodic(claimed), Some(closed)) if closed < claimed => {
                if closes(closed - 1) > SAME {
                    return Ok(());
                }
                Err(format!("a period of {claimed} returns for one of {closed}, from {state:?}"))
            }
            // NOTE: where a mass comes to rest, contacts behind the first are section points of no
            // fixed choice; the motion itself closes.
            (Period::Periodic(_), _) if self.chatters(&returns) && self.repeats(&state, period) => {
                tally.chatters += 1;
                Ok(())
            }
            (Period::Periodic(claimed), _) => {
                let far = closes(claimed - 1);
                Err(format!("a period of {claimed} returns does not close by {far:e}: {state:?}"))
            }
            (Period::NotFound, Some(closed)) if self.repeated(closed, size) => {
                Err(format!("no period for one of {closed} returns, from {state:?}"))
            }
            (Period::NotFound, _) => Ok(()),
        }
    }

    /// Whether the iterates kept repeat after a number of returns, from the first of them on: a
    /// diagram names no period of an orbit that still settles.
    fn repeated(&self, returns: usize, size: f64) -> bool {
        let closes = |pair: (&f64, &f64)| (pair.0 - pair.1).abs() < 1e-2 * SAME * size;
        self.kept.iter().all(|values| {
            let later = values.iter().skip(returns);
            values.len() > returns && values.iter().zip(later).all(closes)
        })
    }

    /// Whether contacts are so slow that a chatter may be counted differently.
    fn chatters(&self, returns: &[Returned]) -> bool {
        returns.iter().any(|one| one.slowest < 1e-2)
    }

    /// Whether the motion from a section point comes back after the forcing periods of the orbit's
    /// name, without any section.
    fn repeats(&self, state: &[f64], period: f64) -> bool {
        let Some(name) = &self.point.orbit else { return false };
        let mut orbit = self.simulator.clone();
        orbit.place(state);
        let is_free = (0..orbit.oscillator.stops.len()).all(|stop| orbit.gap(stop).0 > 0.0);
        let size = size(state);
        is_free
            && orbit.advance(period * name.periods as f64).is_ok()
            && apart(&reduced(&orbit.state, state), state) / size < SETTLED
    }

    /// The first [`LONGEST`] returns from a section point; `None` if one fails, does not end in free
    /// flight, or begins at a stop or beyond it.
    fn returns(&self, state: &[f64], is_tangency: bool, period: f64) -> Option<Vec<Returned>> {
        let mut returns: Vec<Returned> = Vec::new();
        let mut orbit = self.simulator.clone();
        orbit.place(state);
        if !is_tangency && (0..orbit.oscillator.stops.len()).any(|stop| orbit.gap(stop).0 < 1e-9) {
            return None;
        }
        let mut at = state.to_vec();
        for _ in 0..LONGEST {
            let (next, elapsed, speeds) = if is_tangency {
                let found = tangency_return(&self.simulator, self.stop, &at, period).ok()??;
                if !found.is_free {
                    return None;
                }
                (found.state, found.elapsed, found.speeds)
            } else {
                let happened = orbit.advance(period).ok()?;
                if orbit.mode != Mode::Free {
                    return None;
                }
                (orbit.state.clone(), period, speeds(&happened))
            };
            let own = speeds.iter().filter(|(stop, _)| *stop == self.stop);
            let slowest = speeds.iter().fold(f64::INFINITY, |least, &(_, speed)| least.min(speed));
            at = reduced(&next, state);
            returns.push(Returned { state: at.clone(), elapsed, hits: own.count(), slowest });
        }
        Some(returns)
    }

    /// Checks that an orbit that is said to escape does, from the diagram's start or from rest.
    fn is_unbounded(&self, period: f64, end: OrbitEnd) -> Result<(), String> {
        let rest = vec![0.0; self.start.len()];
        let mut stays = Vec::new();
        for start in [&self.start, &rest] {
            match self.bounded(start, period) {
                Some(state) => stays.push(state),
                None => return Ok(()),
            }
        }
        Err(format!("{end:?}, though orbits stay: {stays:?}"))
    }

    /// State of an orbit after the time watched; `None` if it left its bound or cannot begin.
    fn bounded(&self, start: &[f64], period: f64) -> Option<Vec<f64>> {
        let mut orbit = self.simulator.clone();
        orbit.place(start);
        if (0..orbit.oscillator.stops.len()).any(|stop| orbit.gap(stop).0 < -SAME) {
            return None;
        }
        for _ in 0..WATCHED {
            orbit.advance(period).ok()?;
            orbit.reduce_phase();
            if orbit.state.iter().any(|value| value.abs() > BOUND) {
                return None;
            }
        }
        Some(orbit.state)
    }
}

/// Size of a state, with which its differences are compared.
fn size(state: &[f64]) -> f64 {
    state.iter().fold(1.0f64, |size, value| size.max(value.abs()))
}

/// Return to the section.
struct Returned {
    state: Vec<f64>,
    elapsed: f64,
    hits: usize,
    slowest: f64,
}
