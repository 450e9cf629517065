//! Whether two runs have settled on the same thing.

use crate::iteration::{MapOrbit, OrbitEnd, Period};

/// Extent of an orbit without a period may differ by this part of itself: how far that of a chaotic
/// attractor wanders from run to run.
const CHAOTIC: f64 = 0.2;
/// Extent of a periodic orbit may differ by this part of its size: it may still approach.
const PERIODIC: f64 = 1e-6;

/// What is remembered of an orbit for telling attractors apart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Attractor {
    completed: bool,
    period: Period,
    /// Least and greatest value of every coordinate.
    extent: Vec<[f64; 2]>,
}

impl Attractor {
    pub(super) fn of(orbit: &MapOrbit) -> Self {
        Self {
            completed: orbit.end == OrbitEnd::Completed,
            period: orbit.period,
            extent: extent(orbit),
        }
    }

    /// Whether both ended alike: early; with one period and extent; or without a period, over much
    /// the same extent.
    ///
    /// Where it errs by saying no, a sweep does work twice; saying yes of two attractors takes two
    /// of one period and extent.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        if self.completed != other.completed || !self.completed {
            return self.completed == other.completed;
        }
        let alike = |(a, b): (&[f64; 2], &[f64; 2])| {
            let allowed = match self.period {
                Period::Periodic(_) => PERIODIC * a[0].abs().max(a[1].abs()),
                Period::NotFound => CHAOTIC * (a[1] - a[0]),
            };
            a == b || (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) <= allowed
        };
        self.period == other.period && self.extent.iter().zip(&other.extent).all(alike)
    }
}

/// Least and greatest value of every coordinate over the kept states, which are finite.
fn extent(orbit: &MapOrbit) -> Vec<[f64; 2]> {
    const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
    let wider = |[least, greatest]: [f64; 2], [low, high]: [f64; 2]| {
        [
            if low < least { low } else { least },
            if high > greatest { high } else { greatest },
        ]
    };
    // Four extents in turn, for each state waits for the one before in the same.
    let mut parts = vec![[NOTHING; 4]; orbit.last.len()];
    for (number, state) in orbit.states().enumerate() {
        for (parts, &value) in parts.iter_mut().zip(state) {
            let part = &mut parts[number % 4];
            *part = wider(*part, [value, value]);
        }
    }
    let whole = |parts: [[f64; 2]; 4]| parts.into_iter().fold(NOTHING, wider);
    parts.into_iter().map(whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attractor(period: Period, extent: [f64; 2]) -> Attractor {
        Attractor {
            completed: true,
            period,
            extent: vec![extent],
        }
    }

    #[test]
    fn periodic_orbits_agree_closely_and_chaotic_ones_roughly() {
        let periodic = |extent| attractor(Period::Periodic(2), extent);
        let chaotic = |extent| attractor(Period::NotFound, extent);
        assert!(periodic([1.0, 2.0]).agrees(&periodic([1.0, 2.000_000_1])));
        assert!(!periodic([1.0, 2.0]).agrees(&periodic([1.0, 2.1])));
        assert!(chaotic([1.0, 2.0]).agrees(&chaotic([0.9, 2.1])));
        assert!(!chaotic([1.0, 2.0]).agrees(&chaotic([1.0, 3.0])));
        assert!(!chaotic([1.0, 2.0]).agrees(&periodic([1.0, 2.0])));
        let ended = Attractor {
            completed: false,
            ..chaotic([1.0, 2.0])
        };
        assert!(!ended.agrees(&chaotic([1.0, 2.0])) && ended.agrees(&ended));
    }
}
