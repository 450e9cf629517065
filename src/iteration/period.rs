//! Periods of orbits of maps.

use std::ops::Range;

use super::StepInfo;

/// Period of an orbit, in iterates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Period {
    /// The states repeat after this many iterates, and after none fewer.
    Periodic(usize),
    /// No period up to half the number of states.
    NotFound,
}

impl Period {
    /// The period of a run of states (`dimension` numbers each, one state after another).
    ///
    /// States agree if every coordinate agrees to `tolerance` times its scale. A period is accepted
    /// if *all* states agree with those a period later, and the run holds it at least twice. An
    /// orbit that still approaches a period by alternating about it (a multiplier near −1)
    /// seems to have twice that period: where the alternation shrinks along the run, half of it
    /// is the period.
    pub fn of(states: &[f64], scales: &[f64], tolerance: f64) -> Self {
        let run = Run { states, scales };
        let agree = |shift: usize| {
            let mut states = 0..run.count() - shift;
            states.all(|number| run.apart(number, shift) <= tolerance)
        };
        let found = (1..=run.count() / 2).find(|&shift| agree(shift));
        match found {
            None => Self::NotFound,
            Some(period) if run.alternation_shrinks(period) => Self::Periodic(period / 2),
            Some(period) => Self::Periodic(period),
        }
    }
}

/// Share of its first amplitude below which an alternation has shrunk.
const SHRUNK: f64 = 0.95;

/// States one after another, with the scales of their coordinates.
struct Run<'a> {
    states: &'a [f64],
    scales: &'a [f64],
}

impl Run<'_> {
    fn count(&self) -> usize {
        self.states.len() / self.scales.len().max(1)
    }

    /// Distance, in scales, of a state from the one `shift` later; NaN if a coordinate is.
    fn apart(&self, number: usize, shift: usize) -> f64 {
        let dimension = self.scales.len();
        let state = |number: usize| &self.states[number * dimension..(number + 1) * dimension];
        let pairs = state(number).iter().zip(state(number + shift));
        let scaled = pairs
            .zip(self.scales)
            .map(|((a, b), scale)| (a - b).abs() / scale);
        scaled.fold(
            0.0,
            |largest, value| if value <= largest { largest } else { value },
        )
    }

    /// Largest distance of these states from those `shift` later.
    fn distance(&self, shift: usize, states: Range<usize>) -> f64 {
        states
            .map(|number| self.apart(number, shift))
            .fold(0.0, f64::max)
    }

    /// Whether states half a period apart come closer along the run.
    fn alternation_shrinks(&self, period: usize) -> bool {
        let (half, count) = (period / 2, self.count());
        if period % 2 == 1 || count < half + 2 * period {
            return false;
        }
        let first = self.distance(half, 0..period);
        let last = self.distance(half, count - half - period..count - half);
        last < SHRUNK * first
    }
}

/// Contacts in one period: printed `contacts/period`, for instance `1/3`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct ContactsPerPeriod {
    /// Contacts in one period of the orbit.
    pub contacts: u32,
    /// Period in iterates.
    pub period: usize,
}

impl ContactsPerPeriod {
    /// Contacts of a periodic run; `None` without a period.
    pub fn of(period: Period, steps: &[StepInfo]) -> Option<Self> {
        match period {
            Period::Periodic(period) => {
                let contacts = steps.iter().take(period).map(StepInfo::contacts).sum();
                Some(Self { contacts, period })
            }
            Period::NotFound => None,
        }
    }
}

impl std::fmt::Display for ContactsPerPeriod {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.contacts, self.period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_period_is_found() {
        let states: Vec<f64> = (0..12).flat_map(|n| [f64::from(n % 3), 1.0]).collect();
        assert_eq!(Period::of(&states, &[1.0, 1.0], 1e-9), Period::Periodic(3));
        assert_eq!(Period::of(&states, &[1e12, 1.0], 1e-9), Period::Periodic(1));
    }

    #[test]
    fn a_slow_alternating_approach_has_the_period_it_approaches() {
        // Period 3, approached by a factor of −0.99 every three iterates, from 1e-3 of its scale.
        let approach = |n: i32| 1e-3 * (-0.99_f64).powi(n / 3);
        let states: Vec<f64> = (0..200).map(|n| f64::from(n % 3) + approach(n)).collect();
        assert_eq!(Period::of(&states, &[1.0], 1e-4), Period::Periodic(3));
    }

    #[test]
    fn a_doubled_period_is_kept() {
        let states: Vec<f64> = (0..200)
            .map(|n| f64::from(n % 3) + 1e-3 * f64::from(n / 3 % 2))
            .collect();
        assert_eq!(Period::of(&states, &[1.0], 1e-4), Period::Periodic(6));
    }

    #[test]
    fn a_drift_has_no_period() {
        let states: Vec<f64> = (0..50).map(|n| f64::from(n) * 1e-3).collect();
        assert_eq!(Period::of(&states, &[1.0], 1e-6), Period::NotFound);
        assert_eq!(Period::of(&[], &[1.0], 1e-6), Period::NotFound);
    }
}
