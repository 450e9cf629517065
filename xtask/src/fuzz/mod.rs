//! Fuzzer: calls the program with randomly changed scenes of the catalogue, and keeps cases with a
//! wrong end: a panic, more than 20 seconds, more than 2 GB, or no message.
//!
//! ```text
//! cargo build --release
//! cargo run --release -p xtask -- fuzz                         # ten minutes
//! cargo run --release -p xtask -- fuzz --minutes 60 --seed 7
//! cargo run --release -p xtask -- fuzz --seed 7 --case 1234    # one case again
//! cargo run --release -p xtask -- fuzz --corpus                # what was found before
//! ```
//!
//! A case is determined by the seed and its number. Faults are written to `fuzz-found`, in the form
//! of `xtask/corpus`: the arguments in the first line, then the scene. Needs a shell with `ulimit`.

pub mod campaign;
mod mutation;

use std::error::Error;
use std::fs;
use std::time::{Duration, Instant};

use campaign::{Campaign, Case, corpus};

use crate::program::program;
use crate::{Outcome, Verdict};

/// Folder of the cases that revealed faults.
const FOUND: &str = "fuzz-found";

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct Fuzz {
    /// Time, in minutes
    #[arg(long, default_value_t = 10.0)]
    minutes: f64,
    /// Number of cases, in place of a time
    #[arg(long, conflicts_with = "minutes")]
    cases: Option<u64>,
    /// Seed of the cases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of one case, which is printed
    #[arg(long)]
    case: Option<u64>,
    /// Run the cases that revealed faults before
    #[arg(long)]
    corpus: bool,
}

impl Fuzz {
    /// Runs the cases.
    ///
    /// # Errors
    ///
    /// A missing program, or an error of the system.
    pub fn run(&self) -> Outcome {
        let folder = tempfile::tempdir()?;
        let campaign = Campaign::new(program()?, folder.path().to_owned());
        let faults = match self.case {
            _ if self.corpus => replay(&campaign)?,
            Some(number) => {
                let case = Case::new(self.seed, number);
                println!("{}", file(&case));
                usize::from(report(&campaign, &case, self.seed, number)?)
            }
            None => self.random(&campaign)?,
        };
        Ok(Verdict::of(faults))
    }

    /// Runs random cases and returns the number of faults.
    fn random(&self, campaign: &Campaign) -> Result<usize, Box<dyn Error>> {
        let clock = Instant::now();
        let time = Duration::try_from_secs_f64(60.0 * self.minutes)?;
        let (mut cases, mut found) = (0, 0);
        while self.cases.map_or(clock.elapsed() < time, |count| cases < count) {
            let case = Case::new(self.seed, cases);
            found += usize::from(report(campaign, &case, self.seed, cases)?);
            cases += 1;
            if cases % 500 == 0 {
                println!("{cases} cases, {found} faults, {:.0} s", clock.elapsed().as_secs_f64());
            }
        }
        println!("seed {}: {cases} cases, {found} faults", self.seed);
        Ok(found)
    }
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
