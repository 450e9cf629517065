//! Random oscillators: direct simulation compared with an [independent](crate::independent)
//! simulator. Grazing orbits, returns to sections of both kinds, and attractors of diagrams.
//!
//! ```text
//! cargo run --release -p xtask -- random-oscillators                     # 1000 oscillators
//! cargo run --release -p xtask -- random-oscillators --seed 7 --minutes 60
//! cargo run --release -p xtask -- random-oscillators --seed 7 --case 12  # one again, with its scene
//! cargo run --release -p xtask -- random-oscillators --narrow            # narrow pulses too
//! cargo run --release -p xtask -- random-oscillators --returns           # without diagrams
//! cargo run --release -p xtask -- random-oscillators --only adhesive     # or --without
//! ```
//!
//! An oscillator is determined by the seed and its number.

mod attractors;
pub mod campaign;
mod generator;
mod returns;

pub use generator::Choice;

use std::time::{Duration, Instant};

use campaign::{Tally, compared, kind, scene};
use rayon::prelude::*;

use crate::{Outcome, Verdict};

/// Number of oscillators in a piece of work.
const PIECE: u64 = 8;

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct RandomOscillators {
    /// Seed of the oscillators
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of oscillators
    #[arg(long, default_value_t = 1000)]
    count: u64,
    /// Number of the first oscillator
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Time in minutes, in place of a number of oscillators
    #[arg(long, conflicts_with = "count")]
    minutes: Option<f64>,
    /// Number of one oscillator, whose scene is printed
    #[arg(long)]
    case: Option<u64>,
    /// Word that the description of an oscillator must contain
    #[arg(long)]
    only: Option<String>,
    /// Word that the description of an oscillator must not contain
    #[arg(long)]
    without: Option<String>,
    /// Allow pulses as narrow as a hundredth of a period, or narrower
    #[arg(long)]
    narrow: bool,
    /// Compare returns alone, without diagrams
    #[arg(long)]
    returns: bool,
}

impl RandomOscillators {
    /// Compares the oscillators.
    pub fn run(&self) -> Outcome {
        let clock = Instant::now();
        let seed = self.seed;
        let choice = Choice { narrow: self.narrow, diagrams: !self.returns, ..Choice::default() };
        if let Some(case) = self.case {
            println!("{}", scene(seed, case, choice));
            let tally = compared(seed, case, choice);
            tally.wrong.iter().for_each(|words| println!("{words}\n"));
            println!("{}", figures(&tally, clock.elapsed()));
            return Ok(Verdict::of(tally.wrong.len()));
        }
        let mut all = Tally::default();
        let mut from = self.from;
        let end = self.minutes.map_or(self.from + self.count, |_| u64::MAX);
        let limit = self.minutes.map_or(f64::INFINITY, |minutes| 60.0 * minutes);
        while from < end && clock.elapsed().as_secs_f64() < limit {
            let piece = from..end.min(from + PIECE);
            from = piece.end;
            let asked = |&case: &u64| {
                let kind = kind(seed, case, choice);
                self.only.as_ref().is_none_or(|word| kind.contains(word))
                    && self.without.as_ref().is_none_or(|word| !kind.contains(word))
            };
            let cases = piece.into_par_iter().filter(asked);
            let tallies = cases.map(|case| compared(seed, case, choice));
            let tally = tallies.reduce(Tally::default, Tally::and);
            tally.wrong.iter().for_each(|words| println!("{words}\n"));
            all = all.and(tally);
            // What a campaign found until it is ended by hand.
            eprintln!("to {from}: {}", figures(&all, clock.elapsed()));
        }
        println!("{}", figures(&all, clock.elapsed()));
        Ok(Verdict::of(all.wrong.len()))
    }
}

/// Summary in one line.
fn figures(tally: &Tally, time: Duration) -> String {
    format!(
        "{} oscillators, {} grazing orbits ({} past another stop), {} returns ({} to tangency \
         sections, {} with contact), {} values of diagrams ({} periods confirmed, {} without an \
         image, {} scenes without a map): {} differences above {:e} of scale; {} more are in a \
         chatter, {} growth of rounding, {} sections do not tell, {} returns end, {} are not judged; \
         largest {:.1e}; {:.0} s",
        tally.oscillators,
        tally.grazes,
        tally.through,
        tally.returns,
        tally.tangencies,
        tally.contacts,
        tally.attractors,
        tally.periodic,
        tally.no_image,
        tally.no_map,
        tally.wrong.len(),
        campaign::TOLERANCE,
        tally.chatters,
        tally.grown,
        tally.ambiguous,
        tally.ended,
        tally.unjudged,
        tally.largest,
        time.as_secs_f64()
    )
}
