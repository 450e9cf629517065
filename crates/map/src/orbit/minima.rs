//! Every minimum of the event functions along a stretch of the free flow.

use std::ops::Range;

use super::outcome::OrbitError;
use crate::flow::{Field, FlowError, Integrator, Step, horner};
use crate::model::Model;
use crate::numeric::polynomial::{ExtremumKind, extrema};

/// A minimum of an event function.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Minimum {
    /// The surface.
    pub(super) surface: usize,
    /// Time since the start.
    pub(super) time: f64,
    /// Full state there.
    pub(super) state: Vec<f64>,
    /// The event function there.
    pub(super) event: f64,
}

/// Minima along a stretch, and the range of the event functions.
#[derive(Clone, Debug)]
pub(super) struct Gaps {
    /// Minima of all surfaces, by time.
    pub(super) minima: Vec<Minimum>,
    /// Largest value of each event function.
    pub(super) largest: Vec<f64>,
    /// How many Taylor steps the stretch took.
    pub(super) steps: usize,
}

/// Largest value of an event function along an orbit, relative to the lowest, that is rounding at
/// a touch.
const TOUCH: f64 = 1e-9;

impl Gaps {
    /// The first surface beyond which the whole stretch lies, touching it at most, with the largest
    /// value of its event function.
    pub(super) fn beyond(&self) -> Option<(usize, f64)> {
        let mut surfaces = self.largest.iter().copied().enumerate();
        surfaces.find(|&(surface, largest)| {
            let mine = self.minima.iter().filter(|minimum| minimum.surface == surface);
            let lowest = mine.map(|minimum| minimum.event).fold(largest, f64::min);
            lowest < 0.0 && largest <= -TOUCH * lowest
        })
    }

    /// The minima strictly inside a range of times.
    pub(super) fn between(&self, times: Range<f64>) -> impl Iterator<Item = &Minimum> {
        let within =
            move |minimum: &&Minimum| times.start < minimum.time && minimum.time < times.end;
        self.minima.iter().filter(within)
    }
}

/// Most steps of a stretch.
const MAX_STEPS: usize = 1_000_000;

/// A field that watches the event function of every surface.
pub(super) fn watching_field(model: &Model) -> Field {
    let watched: Vec<_> = model.surfaces.iter().map(|surface| surface.event).collect();
    Field::free(model, &watched)
}

/// Minima of every event function on `(0, duration]` along the free flow, `field` being a
/// [`watching_field`].
///
/// The event function along a step is a polynomial in time, and every zero of its derivative is
/// isolated, however many there are in a step.
pub(super) fn gaps(
    field: &Field,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
) -> Result<Gaps, OrbitError> {
    let largest = vec![f64::NEG_INFINITY; field.watched()];
    let mut found = Gaps { minima: Vec::new(), largest, steps: 0 };
    each_step(field, start, parameters, duration, |elapsed, length, state, step| -> Option<()> {
        found.steps += 1;
        for surface in 0..field.watched() {
            let event = step.watched_coefficients(surface);
            found.largest[surface] = found.largest[surface].max(horner(event, 0.0));
            for turn in extrema(event, length) {
                if turn.kind == ExtremumKind::Maximum {
                    found.largest[surface] = found.largest[surface].max(turn.value);
                    continue;
                }
                let mut there = state.to_vec();
                step.state_at(turn.time, &mut there);
                found.minima.push(Minimum {
                    surface,
                    time: elapsed + turn.time,
                    state: there,
                    event: turn.value,
                });
            }
        }
        None
    })?;
    found.minima.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(found)
}

/// Steps along the free flow for a duration, until `look` returns a value. Its arguments are the
/// time since the start, the length of the step, the state at its start and the step.
pub(super) fn each_step<T>(
    field: &Field,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
    mut look: impl FnMut(f64, f64, &[f64], &Step<'_, f64>) -> Option<T>,
) -> Result<Option<T>, OrbitError> {
    let mut integrator = Integrator::<f64>::new(field);
    let (mut state, mut elapsed) = (start.to_vec(), 0.0);
    for _ in 0..MAX_STEPS {
        if elapsed >= duration {
            return Ok(None);
        }
        let step = integrator.step(&state, parameters)?;
        let rest = duration - elapsed;
        let length = step.length.min(rest);
        if let Some(found) = look(elapsed, length, &state, &step) {
            return Ok(Some(found));
        }
        step.state_at(length, &mut state);
        elapsed = if length == rest { duration } else { elapsed + length };
    }
    Err(OrbitError::Flow(FlowError::TooManySteps {
        limit: MAX_STEPS,
        remaining: duration - elapsed,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;

    /// A harmonic oscillator `x = sin t` whose gap has two minima, at `x = -0.01` and `x = 0.01`.
    const DOUBLE_WELL: &str = r#"
[model]
states = ["x", "v"]
parameters = { half = 0.01, floor = 0.1 }
[model.flow]
x = "v"
v = "-x"
[[model.surface]]
name = "stop"
event = "floor + 1000*(x^2 - half^2)^2"
impact = { v = "-v" }
[grazing]
surface = "stop"
solve_for = "floor"
guess = { x = 0.01, v = 1.0 }
"#;

    #[test]
    fn minima_nearer_to_each_other_than_a_part_of_a_step_are_all_found() {
        let scene = Scene::parse(DOUBLE_WELL, "double_well.toml").expect("a scene");
        let field = watching_field(&scene.model);
        let start = [-0.2_f64.sin(), 0.2_f64.cos()];
        let found = gaps(&field, &start, &[0.01, 0.1], 0.4).expect("a smooth flow");
        let expected = [0.2 - 0.01_f64.asin(), 0.2 + 0.01_f64.asin()];
        assert_eq!(found.minima.len(), 2, "{found:?}");
        for (minimum, expected) in found.minima.iter().zip(expected) {
            // The terms of a step's polynomial reach 1000 x^4 = 2, of which rounding is 4e-16;
            // h'' = 0.8, and h' loses another digit or two.
            assert!((minimum.time - expected).abs() < 1e-12, "{minimum:?}");
            assert!((minimum.event - 0.1).abs() < 1e-13, "{minimum:?}");
        }
    }
}
