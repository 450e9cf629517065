//! Periods of orbits of maps.

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
    /// States agree if every coordinate agrees to `tolerance` times its scale. A period is accepted if
    /// *all* states agree with those a period later, and the run holds it at least twice.
    pub fn of(states: &[f64], scales: &[f64], tolerance: f64) -> Self {
        let dimension = scales.len().max(1);
        let count = states.len() / dimension;
        let agree = |shift: usize| {
            let later = states[shift * dimension..].chunks_exact(dimension);
            states
                .chunks_exact(dimension)
                .zip(later)
                .all(|(now, then)| {
                    now.iter()
                        .zip(then)
                        .zip(scales)
                        .all(|((a, b), scale)| (a - b).abs() <= tolerance * scale)
                })
        };
        (1..=count / 2)
            .find(|&shift| agree(shift))
            .map_or(Self::NotFound, Self::Periodic)
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
                let contacts = steps.iter().take(period).map(|step| step.contacts).sum();
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
    fn a_drift_has_no_period() {
        let states: Vec<f64> = (0..50).map(|n| f64::from(n) * 1e-3).collect();
        assert_eq!(Period::of(&states, &[1.0], 1e-6), Period::NotFound);
        assert_eq!(Period::of(&[], &[1.0], 1e-6), Period::NotFound);
    }
}
