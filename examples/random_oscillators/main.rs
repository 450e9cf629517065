//! Random oscillators: direct simulation compared with an independent simulator
//! (`tests/support/independent`). Grazing orbits, returns to sections of both kinds, and attractors
//! of diagrams.
//!
//! ```text
//! cargo run --release --example random_oscillators                      # 1000 oscillators
//! cargo run --release --example random_oscillators -- --seed 7 --minutes 60
//! cargo run --release --example random_oscillators -- --seed 7 --case 12     # one again, with its scene
//! cargo run --release --example random_oscillators -- --narrow          # with pulses that are narrow
//! cargo run --release --example random_oscillators -- --returns         # without diagrams
//! cargo run --release --example random_oscillators -- --only adhesive   # or --without: by what they are
//! ```
//!
//! An oscillator is determined by the seed and its number. The exit code is 1 if something differs.

mod campaign;
#[path = "../../tests/support/independent/mod.rs"]
mod independent;

use std::error::Error;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use campaign::{Choice, Tally, compared, kind, scene};
use rayon::prelude::*;

/// Number of oscillators in a piece of work.
const PIECE: u64 = 8;

/// Request on the command line.
struct Request {
    seed: u64,
    count: u64,
    from: u64,
    minutes: f64,
    case: Option<u64>,
    /// Words that the oscillators' names must contain, and must not contain.
    only: Option<String>,
    without: Option<String>,
    choice: Choice,
}

impl Request {
    fn of(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut request = Self {
            seed: 1,
            count: 1000,
            from: 0,
            minutes: f64::INFINITY,
            case: None,
            only: None,
            without: None,
            choice: Choice::default(),
        };
        while let Some(option) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("`{option}` needs a value"));
            match option.as_str() {
                "--seed" => request.seed = value()?.parse()?,
                "--count" => request.count = value()?.parse()?,
                "--from" => request.from = value()?.parse()?,
                "--minutes" => {
                    request.minutes = value()?.parse()?;
                    request.count = u64::MAX / 2;
                }
                "--case" => request.case = Some(value()?.parse()?),
                "--only" => request.only = Some(value()?),
                "--without" => request.without = Some(value()?),
                "--narrow" => request.choice.narrow = true,
                "--returns" => request.choice.diagrams = false,
                _ => return Err(format!("`{option}` is no option").into()),
            }
        }
        Ok(request)
    }
}

fn main() -> ExitCode {
    match run() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Runs the request and returns the number of differences.
fn run() -> Result<usize, Box<dyn Error>> {
    let request = Request::of(std::env::args().skip(1))?;
    let (clock, limit) = (Instant::now(), 60.0 * request.minutes);
    let Request { seed, choice, .. } = request;
    if let Some(case) = request.case {
        println!("{}", scene(seed, case, choice));
        let tally = compared(seed, case, choice);
        tally.wrong.iter().for_each(|words| println!("{words}\n"));
        println!("{}", figures(&tally, clock.elapsed()));
        return Ok(tally.wrong.len());
    }
    let mut all = Tally::default();
    let mut from = request.from;
    let end = request.from + request.count;
    while from < end && clock.elapsed().as_secs_f64() < limit {
        let piece = from..end.min(from + PIECE);
        from = piece.end;
        let asked = |&case: &u64| {
            let kind = kind(seed, case, choice);
            request.only.as_ref().is_none_or(|word| kind.contains(word))
                && request.without.as_ref().is_none_or(|word| !kind.contains(word))
        };
        let cases = piece.into_par_iter().filter(asked);
        let tallies = cases.map(|case| compared(seed, case, choice));
        let tally = tallies.reduce(Tally::default, Tally::and);
        tally.wrong.iter().for_each(|words| println!("{words}\n"));
        all = all.and(tally);
    }
    println!("{}", figures(&all, clock.elapsed()));
    Ok(all.wrong.len())
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
