//! Random oscillators by direct simulation against a simulator that knows nothing of it
//! (`examples/random_oscillators` goes on for longer).

#[path = "../../examples/random_oscillators/campaign/mod.rs"]
mod campaign;

use crate::support::independent;
use campaign::{Choice, Tally, compared};

#[test]
fn returns_of_random_oscillators_are_those_of_an_independent_simulator() {
    let from: u64 = std::env::var("FROM").map_or(0, |text| text.parse().expect("a number"));
    let number: u64 = std::env::var("NUMBER").map_or(20, |text| text.parse().expect("a number"));
    let mut tally = Tally::default();
    for case in from..from + number {
        tally = tally.and(compared(1, case, Choice::default()));
    }
    let wrong = std::mem::take(&mut tally.wrong);
    println!("{tally:?}");
    if let Ok(file) = std::env::var("WRONG") {
        std::fs::write(file, wrong.join("\n")).expect("written");
    }
    assert!(wrong.is_empty(), "{}", wrong.len());
}
