//! Hostile scenes, saved files and calls, and the judgement of the program's behaviour.
//!
//! Every case is determined by a seed and a number. A call is a child process with limits of memory
//! and of processor time: it must end by itself with the exit code 0, 1 or 2 and, unless that is 0,
//! give the reason in few lines. A call beyond the limit of processor time is called again on a
//! terminal: it is no fault if a bar states a bound there and moves to the end.

use std::fmt;
use std::fs;
use std::io;
use std::path::PathBuf;
use std::process::{Command, Output};

use super::mutation;
use super::saved::{Change, Saved};
use super::shown::{Shown, write_call};
use crate::random::Random;
use crate::root;

/// Limit of a call's processor time without progress, in seconds.
pub const SECONDS: u32 = 20;
/// Limit of a call's memory, in KiB: 2 GB.
const MEMORY: u32 = 2_000_000;
/// Limits of a message: lines, and characters per line.
const MESSAGE: [usize; 2] = [40, 1000];

/// Judgement of a call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// The call ended as it should.
    Good,
    /// The call took more processor time than the limit, and its bar stated a bound and moved.
    Long {
        /// Last count of the bar.
        done: u64,
        /// Bound of the count.
        of: u64,
    },
    /// Fault in words.
    Fault(String),
}

impl Judgement {
    /// Whether the call is at fault.
    pub fn is_fault(&self) -> bool {
        matches!(self, Self::Fault(_))
    }
}

impl fmt::Display for Judgement {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Good => formatter.write_str("good"),
            Self::Long { done, of } => write!(formatter, "long, with a bar at {done} of {of}"),
            Self::Fault(fault) => formatter.write_str(fault),
        }
    }
}

/// Scene and call of the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// Text of `scene.toml`.
    pub scene: String,
    /// Arguments of the program.
    pub arguments: Vec<String>,
    /// Text of `states.csv`.
    states: &'static str,
}

/// Texts of starting points for images.
const STATES: [&str; 6] = [
    "x\n0\n1e-6\n",
    "theta\n1e-3\n-1e300\n0.1\n",
    "x,theta\n1e-9,1e-9\n",
    "q\n1e-6\n1e-3\n-1e-2\n",
    "x,v\n1e308,-1e308\n",
    "x\nnan\n",
];

impl Case {
    /// Case with a number in the campaign of a seed.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut random = Random::new(seed, number);
        let scene = mutation::scene(&mut random);
        let calls: [&[&str]; 17] = [
            &["check", "scene.toml"],
            &["check", "scene.toml"],
            &["locate", "scene.toml", "--json", "-"],
            &["expand", "scene.toml", "--csv", "-"],
            &["emit", "scene.toml", "-o", "out"],
            &["emit", "scene.toml", "--target", "c", "-o", "out"],
            &["image", "scene.toml", "--states", "states.csv"],
            &["image", "scene.toml", "--states", "states.csv", "--method", "direct"],
            &["safe", "scene.toml", "--points", "2"],
            &["contact", "scene.toml", "--restitution", "0.5"],
            &["contact", "scene.toml", "--restitution", "0.9", "--exponent", "1.1"],
            &["derivatives", "scene.toml", "--order", "3", "--returns", "3"],
            &["derivatives", "scene.toml", "--returns", "1000000"],
            &["atlas", "scene.toml", "--boxes", "20", "--points", "20", "--save", "atlas"],
            &["fit", "scene.toml", "--data", "states.csv", "--parameters", "alpha"],
            &["noise", "scene.toml", "--deviation", "alpha=1e-6", "--orbits", "3", "--keep", "9"],
            &["noise", "scene.toml", "--deviation", "omega=1e9", "--orbits", "3", "--keep", "9"],
        ];
        let mut arguments: Vec<String> = vec!["--threads".to_owned(), "1".to_owned()];
        if !random.one_in(8) {
            for (key, most) in [("smooth_order", 4), ("contact_weight", 6)] {
                let set = format!("expansion.{key}={}", 1 + random.below(most));
                arguments.extend(["--set".to_owned(), set]);
            }
        }
        let call = random.of(&calls).iter().map(|&word| word.to_owned());
        arguments.splice(0..0, call);
        Self { scene, arguments, states: random.of(&STATES) }
    }

    /// Reads a case from a file of the corpus, whose first line is `# ` and the arguments.
    pub fn read(text: &str) -> Option<Self> {
        let call = text.lines().next()?.strip_prefix("# ")?;
        let arguments = call.split_whitespace().map(str::to_owned).collect();
        Some(Self { scene: text.to_owned(), arguments, states: STATES[0] })
    }
}

/// Folder of the inputs that revealed faults.
pub fn corpus() -> PathBuf {
    root().join("xtask/corpus")
}

/// Program under test, with a folder of its own.
#[derive(Debug)]
pub struct Campaign {
    program: PathBuf,
    folder: PathBuf,
    /// Limit of a call's processor time without progress, in seconds.
    seconds: u32,
}

impl Campaign {
    /// Campaign of a program in a folder that may be written to.
    pub fn new(program: PathBuf, folder: PathBuf) -> Self {
        Self { program, folder, seconds: SECONDS }
    }

    /// Sets the limit of a call's processor time without progress, in seconds.
    pub fn within(self, seconds: u32) -> Self {
        Self { seconds, ..self }
    }

    /// Judges a case.
    ///
    /// # Errors
    ///
    /// An error of the system, if the case cannot be set up.
    pub fn judge(&self, case: &Case) -> io::Result<Judgement> {
        fs::write(self.folder.join("scene.toml"), &case.scene)?;
        fs::write(self.folder.join("states.csv"), case.states)?;
        self.judge_call(&case.arguments)
    }

    /// Judges a call with a changed file, which is put back afterwards.
    pub(super) fn judge_change(&self, change: &Change) -> io::Result<Judgement> {
        let file = self.folder.join(change.file);
        fs::write(&file, &change.content)?;
        fs::write(self.folder.join("states.csv"), STATES[2])?;
        let judgement = self.judge_call(&change.arguments)?;
        fs::write(file, &change.before)?;
        Ok(judgement)
    }

    /// Files that the program writes into the folder.
    pub(super) fn saved(&self) -> Result<Saved, String> {
        Saved::written(&self.program, &self.folder)
    }

    fn judge_call(&self, arguments: &[String]) -> io::Result<Judgement> {
        let limits = format!("ulimit -t {} && ulimit -v {MEMORY}", self.seconds);
        self.remove_results()?;
        let output = Command::new("sh")
            .args(["-c", &format!("{limits} && exec \"$0\" \"$@\"")])
            .arg(&self.program)
            .args(arguments)
            .current_dir(&self.folder)
            .env_remove("RUST_BACKTRACE")
            .output()?;
        if is_out_of_time(&output) {
            return self.judge_long_call(&limits, arguments);
        }
        Ok(fault(&output).map_or(Judgement::Good, Judgement::Fault))
    }

    /// Judges a call beyond the limit of processor time by its progress.
    fn judge_long_call(&self, limits: &str, arguments: &[String]) -> io::Result<Judgement> {
        self.remove_results()?;
        let file = self.folder.join("call.sh");
        write_call(&file, limits, &self.program, arguments)?;
        let (shown, duration) = Shown::of_call(&file, &self.folder)?;
        Ok(match shown.moving(duration) {
            Some([done, of]) => Judgement::Long { done, of },
            None => Judgement::Fault(format!(
                "more than {} s of processor time without a bar that moves to the end; {shown}",
                self.seconds
            )),
        })
    }

    fn remove_results(&self) -> io::Result<()> {
        let out = self.folder.join("out");
        if out.exists() { fs::remove_dir_all(&out) } else { Ok(()) }
    }
}

/// Whether a call was ended by the limit of processor time.
fn is_out_of_time(output: &Output) -> bool {
    let status = output.status.to_string();
    let is_ended_by = |signal: &&str| status.contains(*signal);
    output.status.code().is_none() && ["SIGKILL", "SIGXCPU"].iter().any(is_ended_by)
}

/// Fault of a call that ended within its limits; `None` if there is none.
fn fault(output: &Output) -> Option<String> {
    let said = String::from_utf8_lossy(&output.stderr);
    let last = || said.chars().take(400).collect::<String>();
    let Some(code) = output.status.code() else {
        return Some(format!("{}: {}", output.status, last()));
    };
    if !(0..=2).contains(&code) {
        return Some(format!("exit code {code}: {}", last()));
    }
    if code != 0 && said.trim().is_empty() {
        return Some(format!("exit code {code} without a message"));
    }
    let longest = said.lines().map(|line| line.chars().count()).max().unwrap_or(0);
    let found = [said.lines().count(), longest];
    let is_long = found.iter().zip(MESSAGE).any(|(&found, most)| found > most);
    is_long
        .then(|| format!("a message of {} lines, the longest of {longest}: {}", found[0], last()))
}
