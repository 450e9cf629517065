//! Every minimum of the event functions along a stretch of the free flow.

use std::ops::Range;

use crate::flow::{Field, Integrator, horner};
use crate::model::Model;

use super::OrbitError;

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
    /// Largest value of each event function seen.
    pub(super) largest: Vec<f64>,
    /// The state at the end.
    pub(super) end: Vec<f64>,
}

impl Gaps {
    /// The minima strictly inside a range of times.
    pub(super) fn between(&self, times: Range<f64>) -> impl Iterator<Item = &Minimum> {
        let within =
            move |minimum: &&Minimum| times.start < minimum.time && minimum.time < times.end;
        self.minima.iter().filter(within)
    }
}

/// Pieces of a step on which `h'` is taken to change sign at most once.
const PIECES: usize = 16;
const MAX_STEPS: usize = 1_000_000;

/// A field that watches `h` and `h'` of every surface.
pub(super) fn watching_field(model: &Model) -> Field {
    let watched: Vec<_> = model
        .surfaces
        .iter()
        .flat_map(|surface| [surface.event, surface.normal_velocity])
        .collect();
    Field::free(model, &watched)
}

/// Minima of every event function on `(0, duration]` along the free flow, `field` being a
/// [`watching_field`].
pub(super) fn gaps(
    field: &Field,
    start: &[f64],
    parameters: &[f64],
    duration: f64,
) -> Result<Gaps, OrbitError> {
    let surfaces = field.watched() / 2;
    let mut integrator = Integrator::<f64>::new(field);
    let mut found = Gaps {
        minima: Vec::new(),
        largest: vec![f64::NEG_INFINITY; surfaces],
        end: start.to_vec(),
    };
    let mut elapsed = 0.0;
    for _ in 0..MAX_STEPS {
        if elapsed >= duration {
            found.minima.sort_by(|a, b| a.time.total_cmp(&b.time));
            return Ok(found);
        }
        let step = integrator.step(&found.end, parameters)?;
        let rest = duration - elapsed;
        let length = step.length.min(rest);
        for surface in 0..surfaces {
            let event = step.watched_coefficients(2 * surface);
            let velocity = step.watched_coefficients(2 * surface + 1);
            found.largest[surface] = found.largest[surface].max(horner(event, 0.0));
            for time in rising_roots(velocity, length) {
                let mut state = found.end.clone();
                step.state_at(time, &mut state);
                found.minima.push(Minimum {
                    surface,
                    time: elapsed + time,
                    state,
                    event: horner(event, time),
                });
            }
        }
        step.state_at(length, &mut found.end);
        elapsed = if length == rest {
            duration
        } else {
            elapsed + length
        };
    }
    let remaining = duration - elapsed;
    Err(crate::flow::FlowError::TooManySteps {
        limit: MAX_STEPS,
        remaining,
    }
    .into())
}

/// Roots in `(0, length]` where a polynomial passes from negative to positive.
fn rising_roots(coefficients: &[f64], length: f64) -> Vec<f64> {
    let at = |piece: usize| length * piece as f64 / PIECES as f64;
    (0..PIECES)
        .filter(|&piece| {
            horner(coefficients, at(piece)) < 0.0 && horner(coefficients, at(piece + 1)) >= 0.0
        })
        .map(|piece| bisect(coefficients, at(piece), at(piece + 1)))
        .collect()
}

fn bisect(coefficients: &[f64], mut low: f64, mut high: f64) -> f64 {
    while high - low > 1e-15 * high.abs() {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if horner(coefficients, middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    high
}
