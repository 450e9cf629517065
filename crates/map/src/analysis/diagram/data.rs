//! A bifurcation diagram as plain data.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::analysis::section_frame::EscapeBound;
use crate::expansion::MapWindow;
use crate::iteration::parallel;
use crate::iteration::{ContactsPerPeriod, MapOrbit, OrbitEnd, OrbitName, Period};
use crate::model::{Digest, Method};

/// A bifurcation diagram: all sweeps of a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagram {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Name of the swept parameter.
    pub parameter: String,
    /// Grazing value of the parameter, to which offsets are relative.
    pub grazing_value: f64,
    /// Whether the values have equal ratios, for a logarithmic axis.
    pub is_logarithmic: bool,
    /// Observable: `h`, `impact_speed`, or an expression.
    pub observable: String,
    /// Observable of the grazing orbit on its section.
    pub observable_at_graze: f64,
    /// Names of the surfaces that graze, in the model's order, which is the order of the hits in
    /// names of orbits.
    pub surfaces: Vec<String>,
    /// Iterates dropped at each parameter value.
    pub transient: usize,
    /// Iterates kept at each parameter value.
    pub keep: usize,
    /// Escape bounds of the section's coordinates.
    pub escape: Vec<EscapeBound>,
    /// One sweep per method, start and direction.
    pub sweeps: Vec<Sweep>,
    /// Time of one iterate by direct simulation over that by the map; `None` unless both were run.
    pub speed_ratio: Option<f64>,
}

/// One sweep along the parameter, the last state carried from value to value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// Method that computed the sweep.
    pub method: Method,
    /// Direction of the sweep.
    pub heading: SweepHeading,
    /// Start state as offsets of the section's coordinates; `None` for a start beside the fixed
    /// point of `P_smooth`.
    pub start: Option<Vec<f64>>,
    /// One entry per parameter value, in the order of the sweep.
    pub points: Vec<DiagramPoint>,
    /// Fraction of all kept iterates made by the map; the others are direct returns.
    pub by_map: f64,
    /// Fraction of all kept iterates outside the window.
    pub outside: f64,
    /// Computing time.
    pub timing: Timing,
}

/// Fractions of the kept iterates; 0 if there are none.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::analysis) struct Shares {
    /// Fraction made by the map.
    pub(in crate::analysis) by_map: f64,
    /// Fraction outside the window.
    pub(in crate::analysis) outside: f64,
}

impl Shares {
    /// Fractions for the kept iterates of one orbit.
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
            Method::Map | Method::Direct | Method::Atlas => {
                !window.holds(origin, parameters, &[step.depth])
            }
        });
        Self { by_map: share(mapped), outside: share(outside.count()) }
    }

    /// Mean over parts, weighted by the numbers of kept iterates.
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
    /// Whether the map was used alone and beyond its window at a point.
    pub fn is_outside(&self, point: &DiagramPoint) -> bool {
        self.method == Method::Map && point.outside > 0.0
    }

    /// Number of points at which the map was used alone and beyond its window.
    pub fn outside(&self) -> usize {
        self.points.iter().filter(|point| self.is_outside(point)).count()
    }
}

/// Direction of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SweepHeading {
    /// Increasing parameter.
    Up,
    /// Decreasing parameter.
    Down,
}

/// Attractor of a map at one parameter value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagramPoint {
    /// Offset of the parameter from its grazing value.
    pub offset: f64,
    /// Observable at the kept iterates, in order: all values, or one period if they repeat bit for
    /// bit. NaN (`null` in a document) where it is undefined.
    #[serde(deserialize_with = "crate::analysis::numbers_or_nan")]
    pub values: Vec<f64>,
    /// Number of iterates kept; fewer than asked for after an early end.
    pub kept: usize,
    /// Period in nominal returns (those of the grazing orbit): forcing periods of the orbit over
    /// those of the grazing orbit.
    pub period: Period,
    /// Returns to the section in one period of the orbit, after which `values` repeat; `None`
    /// without a period. Differs from `period` for orbits that do not make one return per nominal
    /// return.
    #[serde(default)]
    pub returns: Option<usize>,
    /// Contacts per period; `None` without a period.
    pub contacts: Option<ContactsPerPeriod>,
    /// Name of the orbit; `None` without a period. Its hits count every contact at a surface that
    /// grazes.
    pub orbit: Option<OrbitName>,
    /// Number of passages with contact over all kept iterates.
    pub kept_contacts: u32,
    /// Largest Lyapunov exponent per iterate, from the multipliers for a periodic orbit; `None` for
    /// direct simulation or after an early end.
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an orbit without a period, which is a mean over iterates.
    #[serde(default)]
    pub lyapunov_error: Option<f64>,
    /// End of the orbit. After an early end the sweep continues from the last state that stayed.
    pub end: OrbitEnd,
    /// Fraction of the kept iterates made by the map; the others are direct returns.
    pub by_map: f64,
    /// Fraction of the kept iterates outside the window in which the map is trusted: an iterate is
    /// outside if its start exceeds the half-width of a coordinate or a parameter, or has a passage
    /// deeper than the window.
    pub outside: f64,
}

/// Wall-clock time of a sweep or a chart.
///
/// The only part of a result that differs from run to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Number of iterates.
    pub iterates: u64,
    /// Seconds from the first start to the last observable.
    pub seconds: f64,
    /// Number of threads that shared the work.
    pub threads: usize,
}

impl Timing {
    /// Time since a start.
    pub(in crate::analysis) fn since(start: Instant, iterates: u64) -> Self {
        Self { iterates, seconds: start.elapsed().as_secs_f64(), threads: parallel::threads() }
    }

    /// Nanoseconds per iterate; NaN without iterates.
    pub fn nanoseconds_per_iterate(&self) -> f64 {
        1e9 * self.seconds / self.iterates as f64
    }
}

impl DiagramPoint {
    /// Observable at every kept iterate.
    pub fn kept_values(&self) -> impl Iterator<Item = f64> + Clone {
        self.values.iter().copied().cycle().take(self.kept)
    }
}

/// Values cut to one period, if they repeat bit for bit to the end at least twice; otherwise all.
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
    /// The diagram with its times reset: equal for equal requests on every machine.
    pub fn without_timing(&self) -> Self {
        let mut diagram = self.clone();
        diagram.take_timing();
        diagram
    }

    /// Resets the times of the diagram.
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
