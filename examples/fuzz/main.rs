//! Fuzzer: calls the program with randomly changed scenes of the catalogue, and keeps cases with a
//! wrong end: a panic, more than 20 seconds, more than 2 GB, or no message.
//!
//! ```text
//! cargo build --release
//! cargo run --release --example fuzz                        # ten minutes
//! cargo run --release --example fuzz -- --minutes 60 --seed 7
//! cargo run --release --example fuzz -- --seed 7 --case 1234    # one case again
//! cargo run --release --example fuzz -- --corpus            # what was found before
//! ```
//!
//! A case is determined by the seed and its number. Faults are written to `fuzz-found`, in the form
//! of `examples/fuzz/corpus`: the arguments in the first line, then the scene. The exit code is 1
//! if a fault was found. Needs a shell with `ulimit`.

mod campaign;
#[path = "../support/program.rs"]
mod program;

use std::error::Error;
use std::fs;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use campaign::{Campaign, Case, corpus};
use program::program;

/// Folder of the cases that revealed faults.
const FOUND: &str = "fuzz-found";

/// Request on the command line.
struct Request {
    minutes: f64,
    seed: u64,
    case: Option<u64>,
    corpus: bool,
}

impl Request {
    fn of(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut request = Self { minutes: 10.0, seed: 1, case: None, corpus: false };
        while let Some(option) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("`{option}` needs a number"));
            match option.as_str() {
                "--minutes" => request.minutes = value()?.parse()?,
                "--seed" => request.seed = value()?.parse()?,
                "--case" => request.case = Some(value()?.parse()?),
                "--corpus" => request.corpus = true,
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

/// Runs the request and returns the number of faults.
fn run() -> Result<usize, Box<dyn Error>> {
    let request = Request::of(std::env::args().skip(1))?;
    let folder = tempfile::tempdir()?;
    let campaign = Campaign::new(program()?, folder.path().to_owned());
    if request.corpus {
        return replay(&campaign);
    }
    if let Some(number) = request.case {
        let case = Case::new(request.seed, number);
        println!("{}", file(&case));
        return Ok(usize::from(report(&campaign, &case, request.seed, number)?));
    }
    let (clock, time) = (Instant::now(), Duration::from_secs_f64(60.0 * request.minutes));
    let (mut cases, mut found) = (0, 0);
    while clock.elapsed() < time {
        let case = Case::new(request.seed, cases);
        found += usize::from(report(&campaign, &case, request.seed, cases)?);
        cases += 1;
        if cases % 500 == 0 {
            println!("{cases} cases, {found} faults, {:.0} s", clock.elapsed().as_secs_f64());
        }
    }
    println!("seed {}: {cases} cases, {found} faults", request.seed);
    Ok(found)
}

/// Prints and keeps the fault of a case. Returns whether there was one.
fn report(
    campaign: &Campaign,
    case: &Case,
    seed: u64,
    number: u64,
) -> Result<bool, Box<dyn Error>> {
    let Some(fault) = campaign.fault(case)? else {
        return Ok(false);
    };
    println!("--seed {seed} --case {number}: {}: {fault}", case.arguments.join(" "));
    fs::create_dir_all(FOUND)?;
    fs::write(format!("{FOUND}/seed_{seed}_case_{number}.toml"), file(case))?;
    Ok(true)
}

/// Case in the form of the corpus.
fn file(case: &Case) -> String {
    format!("# {}\n{}", case.arguments.join(" "), case.scene)
}

/// Replays the corpus and returns the number of faults.
fn replay(campaign: &Campaign) -> Result<usize, Box<dyn Error>> {
    let mut found = 0;
    for entry in fs::read_dir(corpus())? {
        let path = entry?.path();
        let case = Case::read(&fs::read_to_string(&path)?).ok_or("a file without arguments")?;
        if let Some(fault) = campaign.fault(&case)? {
            println!("{}: {fault}", path.display());
            found += 1;
        }
    }
    println!("corpus: {found} faults");
    Ok(found)
}
