//! A bifurcation diagram as plain data.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::analysis::section_frame::EscapeBound;
use crate::expansion::MapWindow;
use crate::iteration::parallel;
use crate::iteration::{ContactsPerPeriod, MapOrbit, OrbitEnd, OrbitName, Period};
use crate::model::{Digest, Method};

/// A bifurcation diagram: every sweep that was asked for, by every method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagram {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Name of the swept parameter.
    pub parameter: String,
    /// Its grazing value, from which the offsets count.
    pub grazing_value: f64,
    /// Whether the values have equal ratios, so that the parameter's axis is logarithmic.
    pub is_logarithmic: bool,
    /// What is drawn: `h`, `impact_speed`, or an expression.
    pub observable: String,
    /// Names of the surfaces that graze, in the model's order: that of the hits in the names of
    /// orbits.
    pub surfaces: Vec<String>,
    /// Iterates dropped at each parameter value.
    pub transient: usize,
    /// Iterates kept at each parameter value.
    pub keep: usize,
    /// How far the coordinates of the section may go before an orbit has escaped.
    pub escape: Vec<EscapeBound>,
    /// One sweep per method and direction.
    pub sweeps: Vec<Sweep>,
    /// Time of one iterate by direct simulation over that by the map, where both were run.
    pub speed_ratio: Option<f64>,
}

/// One sweep along the parameter, the last state carried from value to value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// What computed it.
    pub method: Method,
    /// Which way it went.
    pub heading: SweepHeading,
    /// Where it started, in offsets of the section's coordinates; `None` beside the fixed point of
    /// `P_smooth`.
    pub start: Option<Vec<f64>>,
    /// One entry per parameter value, in the order in which they were visited.
    pub points: Vec<DiagramPoint>,
    /// Share of all kept iterates that the map made; the others are direct returns.
    pub by_map: f64,
    /// Share of all kept iterates outside the window.
    pub outside: f64,
    /// How long it took.
    pub timing: Timing,
}

/// Shares of kept iterates, 0 of none.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::analysis) struct Shares {
    /// Share that the map made.
    pub(in crate::analysis) by_map: f64,
    /// Share outside the window.
    pub(in crate::analysis) outside: f64,
}

impl Shares {
    /// Of the kept iterates of an orbit.
    pub(in crate::analysis) fn of(
        method: Method,
        orbit: &MapOrbit,
        parameters: &[f64],
        window: &MapWindow,
    ) -> Self {
        let share = |count: usize| count as f64 / orbit.steps.len().max(1) as f64;
        let mapped = orbit.steps.iter().filter(|step| !step.simulated).count();
        let kept = orbit.origins().zip(&orbit.steps);
        let outside = kept.filter(|(origin, step)| match method {
            Method::Guarded => step.simulated,
            Method::Map | Method::Direct => !window.holds(origin, parameters, &[step.depth]),
        });
        Self { by_map: share(mapped), outside: share(outside.count()) }
    }

    /// Of all kept iterates, from the shares and numbers of parts of them.
    pub(in crate::analysis) fn mean(parts: impl Iterator<Item = (Self, usize)>) -> Self {
        let sum = |(all, kept): (Self, f64), (part, count): (Self, usize)| {
            let weight = count as f64;
            let (by_map, outside) =
                (all.by_map + weight * part.by_map, all.outside + weight * part.outside);
            (Self { by_map, outside }, kept + weight)
        };
        let (all, kept) = parts.fold((Self::default(), 0.0), sum);
        let kept = kept.max(1.0);
        Self { by_map: all.by_map / kept, outside: all.outside / kept }
    }
}

impl Sweep {
    /// Whether the map alone was used beyond its window at one of the points.
    pub fn is_outside(&self, point: &DiagramPoint) -> bool {
        self.method == Method::Map && point.outside > 0.0
    }

    /// Points at which the map alone was used beyond its window.
    pub fn outside(&self) -> usize {
        self.points.iter().filter(|point| self.is_outside(point)).count()
    }
}

/// Which way a sweep goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SweepHeading {
    /// Increasing parameter.
    Up,
    /// Decreasing parameter.
    Down,
}

/// What a map settles on at one parameter value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagramPoint {
    /// Offset of the parameter from its grazing value.
    pub offset: f64,
    /// The observable at the kept iterates, in order: all of them, or the first few where these
    /// repeat bit for bit. NaN where there is none: `null` in a document.
    #[serde(deserialize_with = "crate::analysis::numbers_or_nan")]
    pub values: Vec<f64>,
    /// Iterates kept; fewer than asked for where the orbit ended early.
    pub kept: usize,
    /// Period in nominal returns, those of the grazing orbit: forcing periods over theirs.
    pub period: Period,
    /// Returns to the section in one period of the orbit, after which `values` repeat; `None`
    /// without a period. Orbits that do not come back once in a nominal return have others than
    /// `period`.
    #[serde(default)]
    pub returns: Option<usize>,
    /// Contacts per period; `None` without a period.
    pub contacts: Option<ContactsPerPeriod>,
    /// Name of the orbit, `None` without a period; its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Contacts over all kept iterates.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate, of a periodic orbit by its multipliers; `None` for
    /// direct simulation or where the orbit ended early.
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an orbit without a period, a mean over its iterates.
    #[serde(default)]
    pub lyapunov_error: Option<f64>,
    /// How the orbit ended. After an early end the sweep goes on from the last state that stayed.
    pub end: OrbitEnd,
    /// Share of the kept iterates that the map made; the others are direct returns.
    pub by_map: f64,
    /// Share of the kept iterates outside the window in which the map is to be trusted: where the
    /// point that was mapped lies beyond the half-width of a coordinate or a parameter, or has a
    /// passage deeper than the window.
    pub outside: f64,
}

/// Time spent in a sweep or a chart, by the clock.
///
/// Differs from run to run: everything else does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Iterates made.
    pub iterates: u64,
    /// Seconds by the clock, from the first start to the last observable.
    pub seconds: f64,
    /// Threads that shared the work.
    pub threads: usize,
}

impl Timing {
    /// The time since a start.
    pub(in crate::analysis) fn since(start: Instant, iterates: u64) -> Self {
        Self { iterates, seconds: start.elapsed().as_secs_f64(), threads: parallel::threads() }
    }

    /// Nanoseconds by the clock per iterate; NaN before the first.
    pub fn nanoseconds_per_iterate(&self) -> f64 {
        1e9 * self.seconds / self.iterates as f64
    }
}

impl DiagramPoint {
    /// The observable at every kept iterate.
    pub fn kept_values(&self) -> impl Iterator<Item = f64> + Clone {
        self.values.iter().copied().cycle().take(self.kept)
    }
}

/// The values up to where they begin to repeat, bit for bit and to the end; all of them where they
/// do not do so twice.
pub(super) fn one_period(mut values: Vec<f64>) -> Vec<f64> {
    let repeats = |&period: &usize| {
        let mut pairs = values.iter().zip(&values[period..]);
        pairs.all(|(a, b)| a.to_bits() == b.to_bits())
    };
    if let Some(period) = (1..=values.len() / 2).find(repeats) {
        values.truncate(period);
    }
    values
}

impl Diagram {
    /// The diagram without its times: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        let mut diagram = self.clone();
        diagram.take_timing();
        diagram
    }

    /// Takes the times out of the diagram.
    pub fn take_timing(&mut self) {
        self.speed_ratio = None;
        self.sweeps.iter_mut().for_each(|sweep| sweep.timing = Timing::default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_repeat_are_kept_once() {
        let values = [1.0, -0.0, 1.0, -0.0, 1.0];
        assert_eq!(one_period(values.to_vec()), [1.0, 0.0]);
        let signs = [1.0, -0.0, 1.0, 0.0];
        assert_eq!(one_period(signs.to_vec()).len(), 4);
        assert_eq!(one_period(vec![f64::NAN; 7]).len(), 1);
        assert_eq!(one_period(vec![1.0, 2.0, 1.0]).len(), 3);
        assert_eq!(one_period(Vec::new()), [0.0; 0]);
    }
}
