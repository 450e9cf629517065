//! Fuzzer: calls the program with randomly changed scenes of the catalogue or saved files, and
//! keeps cases with a wrong end: a panic, more than 2 GB, no message, or more than 20 seconds
//! without a bar that states a bound and moves. Long calls with such a bar are counted apart.
//!
//! ```text
//! cargo build --release
//! cargo run --release -p xtask -- fuzz                         # ten minutes
//! cargo run --release -p xtask -- fuzz --minutes 60 --seed 7
//! cargo run --release -p xtask -- fuzz --saved --cases 2000    # saved files
//! cargo run --release -p xtask -- fuzz --seed 7 --case 1234    # one case again
//! cargo run --release -p xtask -- fuzz --corpus                # what was found before
//! ```
//!
//! A case is determined by the seed and its number. Inputs that revealed faults are written to
//! `fuzz-found`, scenes in the form of `xtask/corpus`: the arguments in the first line, then the
//! scene. Needs a shell with `ulimit`, and `script` for long calls.

pub mod campaign;
mod mutation;
mod saved;
mod shown;

use std::error::Error;
use std::fs;
use std::time::{Duration, Instant};

pub use saved::HUGE;

use campaign::{Campaign, Case, Judgement, SECONDS, corpus};
use saved::{Change, Saved};

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
    /// Change saved orbits, maps, pieces of shards and atlases, in place of scenes
    #[arg(long)]
    saved: bool,
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
        if self.corpus {
            return Ok(Verdict::of(replay(&campaign)?));
        }
        let inputs = match self.saved {
            true => Inputs::Saved(campaign.saved()?),
            false => Inputs::Scenes,
        };
        let faults = match self.case {
            Some(number) => {
                println!("{}", inputs.case(self.seed, number).text());
                usize::from(inputs.report(&campaign, self.seed, number)?.is_fault())
            }
            None => self.random(&campaign, &inputs)?,
        };
        Ok(Verdict::of(faults))
    }

    /// Runs random cases and returns the number of faults.
    fn random(&self, campaign: &Campaign, inputs: &Inputs) -> Result<usize, Box<dyn Error>> {
        let clock = Instant::now();
        let time = Duration::try_from_secs_f64(60.0 * self.minutes)?;
        let (mut cases, mut found, mut long) = (0, 0, 0);
        while self.cases.map_or(clock.elapsed() < time, |count| cases < count) {
            let judgement = inputs.report(campaign, self.seed, cases)?;
            found += usize::from(judgement.is_fault());
            long += usize::from(matches!(judgement, Judgement::Long { .. }));
            cases += 1;
            if cases % 500 == 0 {
                println!("{cases} cases, {found} faults, {:.0} s", clock.elapsed().as_secs_f64());
            }
        }
        println!(
            "seed {}: {cases} cases, {found} faults, {long} beyond {SECONDS} s with progress",
            self.seed
        );
        Ok(found)
    }
}

/// Kind of the inputs.
enum Inputs {
    Scenes,
    Saved(Saved),
}

/// Random case.
enum Input {
    Scene(Case),
    Saved(Change),
}

impl Inputs {
    fn case(&self, seed: u64, number: u64) -> Input {
        match self {
            Self::Scenes => Input::Scene(Case::new(seed, number)),
            Self::Saved(saved) => Input::Saved(saved.change(seed, number)),
        }
    }

    /// Runs a case, prints what is not good, and keeps a case with a fault.
    fn report(
        &self,
        campaign: &Campaign,
        seed: u64,
        number: u64,
    ) -> Result<Judgement, Box<dyn Error>> {
        let case = self.case(seed, number);
        let (judgement, option, file) = match &case {
            Input::Scene(case) => (campaign.judge(case)?, "", "scene.toml"),
            Input::Saved(change) => (campaign.judge_change(change)?, "--saved ", change.file),
        };
        if judgement != Judgement::Good {
            let call = case.arguments().join(" ");
            println!("{option}--seed {seed} --case {number}: {call}: {judgement}");
        }
        if judgement.is_fault() {
            fs::create_dir_all(FOUND)?;
            fs::write(format!("{FOUND}/seed_{seed}_case_{number}_{file}"), case.content())?;
        }
        Ok(judgement)
    }
}

impl Input {
    fn arguments(&self) -> &[String] {
        match self {
            Self::Scene(case) => &case.arguments,
            Self::Saved(change) => &change.arguments,
        }
    }

    /// Content of the file: a scene in the form of the corpus, a saved file as it is.
    fn content(&self) -> Vec<u8> {
        match self {
            Self::Scene(case) => {
                format!("# {}\n{}", case.arguments.join(" "), case.scene).into_bytes()
            }
            Self::Saved(change) => change.content.clone(),
        }
    }

    /// Case in words.
    fn text(&self) -> String {
        match self {
            Self::Scene(_) => String::from_utf8_lossy(&self.content()).into_owned(),
            Self::Saved(change) => change.arguments.join(" "),
        }
    }
}

/// Replays the corpus and returns the number of faults.
fn replay(campaign: &Campaign) -> Result<usize, Box<dyn Error>> {
    let mut found = 0;
    for entry in fs::read_dir(corpus())? {
        let path = entry?.path();
        let case = Case::read(&fs::read_to_string(&path)?).ok_or("a file without arguments")?;
        let judgement = campaign.judge(&case)?;
        if judgement.is_fault() {
            println!("{}: {judgement}", path.display());
            found += 1;
        }
    }
    println!("corpus: {found} faults");
    Ok(found)
}
