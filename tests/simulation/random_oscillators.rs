//! Random oscillators by direct simulation, compared with an independent simulator
//! (`xtask random-oscillators` runs a thousand, and for longer).

use xtask::random_oscillators::Choice;
use xtask::random_oscillators::campaign::{Tally, compared};

/// Compares the oscillators of a seed; nothing may differ.
fn tally(seed: u64, cases: std::ops::Range<u64>, choice: Choice) -> Tally {
    let tallies = cases.map(|case| compared(seed, case, choice));
    let tally = tallies.fold(Tally::default(), Tally::and);
    assert!(tally.wrong.is_empty(), "{}: {:#?}", tally.wrong.len(), tally.wrong);
    tally
}

#[test]
fn returns_of_random_oscillators_are_those_of_an_independent_simulator() {
    let choice = Choice { places: 2, periods: 4, diagrams: false, ..Choice::default() };
    let tally = tally(1, 0..24, choice);
    assert!(tally.returns > 300 && tally.contacts > 200, "{tally:?}");
    assert!(tally.tangencies > 150 && tally.grazes > 10, "{tally:?}");
    // Sections that do not tell, chatters and growth of rounding are few.
    assert!((tally.ambiguous + tally.chatters + tally.grown) * 20 < tally.returns, "{tally:?}");
}

/// A mass that meets a stop many times in a row, so that the next tangency lies behind a contact
/// from before the one at which the return began.
#[test]
fn returns_between_contacts_that_follow_each_other_fast_are_those_of_an_independent_simulator() {
    let choice = Choice { diagrams: false, ..Choice::default() };
    for case in [128, 205] {
        let tally = tally(1, case..case + 1, choice);
        assert!(tally.tangencies > 30, "{tally:?}");
    }
}

#[test]
fn diagrams_of_random_oscillators_settle_on_orbits_of_an_independent_simulator() {
    let choice = Choice { places: 1, periods: 1, ..Choice::default() };
    let tally = tally(1, 0..8, choice);
    assert!(tally.periodic > 8, "{tally:?}");
}
