//! Returns to a section from states on true orbits, compared with a simulation without a section.
//!
//! A simulator that runs without interruption knows its full state; a return knows only the
//! coordinates. Both must make the same contacts, wherever the section is.

use grazemap::hybrid::{
    DirectReturn, EventKind, HybridSystem, Outcome, Regime, Return, ReturnOutcome, ReturnSection,
    Simulator,
};

/// Number of periods before a state is used, and number of returns of one orbit.
const SETTLE: usize = 4;
const RETURNS: usize = 4;
/// Speed below which a contact may differ by rounding, or belong to a chatter.
const SLOW: f64 = 1e-4;
/// Largest difference of speeds and states; at a graze rounding is the square of it.
const TOLERANCE: f64 = 1e-6;

/// Counts of returns.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Number of returns that agree with the simulation.
    pub agreed: usize,
    /// Number of returns that started in contact, or at rest on a surface.
    pub held: usize,
    /// Number of returns that report the section as ambiguous.
    pub ambiguous: usize,
    /// Number of returns that ended early, as the simulation did or on the way to a section.
    pub ended: usize,
    /// Wrong returns, as text.
    pub wrong: Vec<String>,
}

/// Orbits of a model to compare.
pub struct Campaign<'a> {
    /// Model, lowered.
    pub system: &'a HybridSystem,
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// Number of phases of the sections, equally spaced over a period.
    pub phases: usize,
}

impl Campaign<'_> {
    /// Compares returns of the orbit from a state; none if the simulation ends before.
    pub fn follow(&self, start: &[f64], tally: &mut Tally) {
        let Ok(mut orbit) = Simulator::new(self.system, &self.parameters) else {
            return;
        };
        let (Ok(period), Ok(())) = (orbit.forcing_period(), orbit.set_state(start)) else {
            return;
        };
        for _ in 0..SETTLE {
            if orbit.advance_period(period, &mut |_| {}) != Ok(Outcome::Completed) {
                return;
            }
        }
        let mut free_since = orbit.time();
        for _ in 0..self.phases {
            self.whole_period(&orbit, period, tally);
            if orbit.regime() == Regime::Free && orbit.time() - free_since > 0.25 * period {
                for surface in 0..self.system.surfaces() {
                    let sections = [
                        ReturnSection::GrazingPhase { surface },
                        ReturnSection::Tangency { surface },
                    ];
                    for section in sections {
                        self.several(section, &orbit, period, tally);
                    }
                }
            }
            let flown = orbit.advance(period / self.phases as f64, &mut |event| {
                if !matches!(event.kind, EventKind::NearMiss { .. }) {
                    free_since = event.time;
                }
            });
            if flown != Ok(Outcome::Completed) {
                return;
            }
        }
    }

    /// Compares one return at a phase, with full simulation.
    fn whole_period(&self, orbit: &Simulator<'_, f64>, period: f64, tally: &mut Tally) {
        let mut truth = orbit.clone();
        tally.held += usize::from(truth.regime() != Regime::Free);
        let start = truth.state().to_vec();
        let mut speeds = Vec::new();
        let end = truth.advance_period(period, &mut |event| {
            speeds.extend(event.kind.contact_speed());
        });
        let section = ReturnSection::OtherPhase;
        let Some(found) = self.image(section, period, &start) else {
            return;
        };
        if end != Ok(Outcome::Completed) {
            tally.ended += 1;
            return;
        }
        let pairs = found.state.iter().zip(truth.state());
        let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let agree = || apart < TOLERANCE && same(&found.impact_speeds, &speeds);
        self.count(section, &found, agree(), tally, &|| {
            format!("{start:?} in {:?}: {speeds:?}, {:?}", orbit.regime(), truth.state())
        });
    }

    /// Compares several returns; their contacts must follow each other as those of the simulation.
    ///
    /// A section point may lie behind a contact. That contact, and all that follow it, belong to
    /// the next return.
    fn several(
        &self,
        section: ReturnSection,
        orbit: &Simulator<'_, f64>,
        period: f64,
        tally: &mut Tally,
    ) {
        let (mut state, mut elapsed) = (orbit.state().to_vec(), 0.0);
        let mut speeds = Vec::new();
        for _ in 0..RETURNS {
            let Some(found) = self.image(section, period, &state) else {
                return;
            };
            speeds.extend_from_slice(&found.impact_speeds);
            elapsed += found.elapsed;
            let mut truth = orbit.clone();
            let mut contacts = Vec::new();
            let end = truth.advance(elapsed, &mut |event| {
                contacts.extend(event.kind.contact_speed().map(|speed| (event.time, speed)));
            });
            let before: Vec<f64> = contacts.iter().map(|contact| contact.1).collect();
            let until = orbit.time() + elapsed - period;
            let least = contacts.iter().filter(|contact| contact.0 < until).count();
            if end != Ok(Outcome::Completed) {
                tally.ended += 1;
                return;
            }
            let made = (least..=before.len()).rev().map(|made| &before[..made]);
            let agree = made.into_iter().any(|made| same(&speeds, made));
            let returned = self.count(section, &found, agree, tally, &|| {
                format!(
                    "{speeds:?} from {:?} at {} after {elapsed}; {contacts:?} by simulation",
                    orbit.state(),
                    orbit.time()
                )
            });
            if !returned {
                return;
            }
            state = found.state;
        }
    }

    fn image(&self, section: ReturnSection, period: f64, start: &[f64]) -> Option<Return<f64>> {
        let map = DirectReturn::new(self.system, &self.parameters, section, period, 1);
        map.ok()?.image(start).ok()
    }

    /// Counts a return. Returns whether it reached the section and agrees.
    fn count(
        &self,
        section: ReturnSection,
        found: &Return<f64>,
        agree: bool,
        tally: &mut Tally,
        words: &dyn Fn() -> String,
    ) -> bool {
        match found.outcome {
            ReturnOutcome::Ambiguous { .. } => tally.ambiguous += 1,
            ReturnOutcome::NoReturn { .. } => tally.ended += 1,
            ReturnOutcome::Returned if agree => {
                tally.agreed += 1;
                return true;
            }
            _ => tally.wrong.push(format!(
                "{section:?}: {:?}, {:?}, {:?}; {}",
                found.outcome,
                found.impact_speeds,
                found.state,
                words()
            )),
        }
        false
    }
}

/// Whether the speeds of two orbits agree.
fn same(found: &[f64], truth: &[f64]) -> bool {
    let fast = |speeds: &[f64]| -> Vec<f64> {
        speeds.iter().copied().filter(|speed| *speed > SLOW).collect()
    };
    let (found, truth) = (fast(found), fast(truth));
    found.len() == truth.len()
        && found.iter().zip(&truth).all(|(a, b)| (a - b).abs() <= TOLERANCE * (1.0 + 1.0 / b))
}
