//! Long commands killed at random moments, by the signals of an impatient user and of a machine out
//! of memory. Checks that no file is damaged, that the same command ends with the bytes of an
//! uninterrupted run, and that little work is repeated, by processor time. Needs `/proc`.
//!
//! ```text
//! cargo build --release
//! cargo run --release -p xtask -- interruptions 200
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use grazemap::model::catalogue;

use crate::program::program;
use crate::{Outcome, Verdict};

type Files = BTreeMap<String, Vec<u8>>;

/// Chart, added to the diagram of the scene.
const CHART: &str = "\n[[chart]]\nparameters = [\"alpha\", \"omega\"]\n\
                     ranges = [[-1e-3, 5e-3], [-1e-3, 1e-3]]\npoints = 150\nkeep = 16\n";

/// The name of the scene's file.
const SCENE: &str = "scene.toml";

/// Commands that take some seconds: name and arguments.
fn commands() -> Vec<(&'static str, Vec<String>)> {
    let call = |command: &str, scene: &str, options: &[&str]| {
        let options = options.iter().copied();
        let call = [command, scene].into_iter().chain(options).chain(["-o", "out"]);
        call.map(str::to_owned).collect::<Vec<_>>()
    };
    let set = |command: &str, keys: &[&str]| {
        let keys: Vec<&str> = keys.iter().flat_map(|key| ["--set", key]).collect();
        call(command, SCENE, &keys)
    };
    let map = "diagram.0.with=[\"map\"]";
    let long = [map, "diagram.0.points=20000", "diagram.0.transient=1000", "diagram.0.keep=1000"];
    let direct = ["diagram.0.with=[\"direct\"]", "diagram.0.points=1000"];
    let all = [map, "diagram.0.points=20000", "diagram.0.keep=200", "chart.0.points=300"];
    vec![
        ("diagram by the map", set("diagram", &long)),
        ("diagram by direct simulation", set("diagram", &direct)),
        ("chart", set("chart", &["chart.0.points=400"])),
        ("converge", call("converge", "impact_pair", &[])),
        ("run", set("run", &all)),
        ("basin", call("basin", SCENE, &["--points", "2400", "--at", "alpha=1e-3"])),
        ("branch", call("branch", SCENE, &["--along", "alpha", "--period", "6"])),
        ("loci", call("loci", SCENE, &["--plane", "alpha,omega", "--method", "direct"])),
        ("atlas", call("atlas", SCENE, &["--tolerance", "1e-12", "--boxes", "300"])),
        ("safe", call("safe", SCENE, &[])),
        ("noise", call("noise", SCENE, &["--deviation", "alpha=1e-5", "--orbits", "50"])),
        ("derivatives", call("derivatives", SCENE, &["--order", "4", "--returns", "100"])),
    ]
}

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct Interruptions {
    /// Number of moments, shared by the commands
    #[arg(default_value_t = 200)]
    moments: usize,
}

impl Interruptions {
    /// Kills commands, and compares.
    ///
    /// # Errors
    ///
    /// A missing program, a command that fails without being killed, or an error of the system.
    pub fn run(&self) -> Outcome {
        let program = program()?;
        let commands = commands();
        let trials = self.moments.div_ceil(commands.len());
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut damaged = 0;
        let text = catalogue::text("linear").ok_or("a scene of the catalogue")?;
        let scene = format!("{text}{CHART}");
        println!(
            "| command | processor time, s | moments | damaged | done twice, mean | largest |"
        );
        println!("|---|---|---|---|---|---|");
        for (name, call) in &commands {
            let whole = tempfile::tempdir()?;
            fs::write(whole.path().join(SCENE), &scene)?;
            let (clock, before) = (Instant::now(), processor_time()?);
            run(&program, call, whole.path())?;
            let (seconds, busy) = (clock.elapsed().as_secs_f64(), processor_time()? - before);
            let expected = comparable(whole.path())?;
            let (mut wrong, mut twice) = (0, Vec::new());
            for trial in 0..trials {
                let folder = tempfile::tempdir()?;
                fs::write(folder.path().join(SCENE), &scene)?;
                let before = processor_time()?;
                let signal = ["-KILL", "-INT"][trial % 2];
                let killed = kill(&program, call, folder.path(), seconds * random.next(), signal)?;
                run(&program, call, folder.path())?;
                if killed {
                    twice.push((processor_time()? - before) / busy - 1.0);
                }
                let found = comparable(folder.path())?;
                if found != expected {
                    wrong += 1;
                    eprintln!("{name}, trial {trial}: {:?}", differences(&found, &expected));
                }
            }
            let mean = twice.iter().sum::<f64>() / twice.len() as f64;
            let most = twice.iter().copied().fold(0.0, f64::max);
            println!(
                "| {name} | {busy:.2} | {} | {wrong} | {:.1} % | {:.1} % |",
                twice.len(),
                100.0 * mean,
                100.0 * most
            );
            damaged += wrong;
        }
        Ok(Verdict::of(damaged))
    }
}

/// Processor time in seconds of all commands that have ended, in steps of 10 ms.
fn processor_time() -> Result<f64, Box<dyn Error>> {
    let status = fs::read_to_string("/proc/self/stat")?;
    let after_name = status.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(13).take(2).map(str::parse::<u32>);
    Ok(f64::from(ticks.sum::<Result<u32, _>>()?) / 100.0)
}

/// Runs a command to its end.
fn run(program: &Path, call: &[String], folder: &Path) -> Result<(), Box<dyn Error>> {
    let output = Command::new(program).args(call).current_dir(folder).output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    Ok(())
}

/// Runs a command and kills it after some seconds; `false` if it had ended by then.
fn kill(
    program: &Path,
    call: &[String],
    folder: &Path,
    seconds: f64,
    signal: &str,
) -> Result<bool, Box<dyn Error>> {
    let mut command = Command::new(program);
    let command = command.args(call).current_dir(folder).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::null()).spawn()?;
    sleep(Duration::from_secs_f64(seconds));
    let runs = child.try_wait()?.is_none();
    if runs {
        Command::new("kill").args([signal, &child.id().to_string()]).status()?;
    }
    child.wait()?;
    Ok(runs)
}

/// Files that a command wrote, except those with measured times.
fn comparable(folder: &Path) -> Result<Files, Box<dyn Error>> {
    let mut files = Files::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next)? {
            let path = entry?.path();
            let name = path.strip_prefix(folder)?.display().to_string();
            let timed = ["speed", "report.html", "timings.json"];
            if path.is_dir() {
                folders.push(path);
            } else if !timed.iter().any(|part| name.contains(part)) {
                files.insert(name, fs::read(path)?);
            }
        }
    }
    Ok(files)
}

/// Names of files that differ.
fn differences(a: &Files, b: &Files) -> Vec<String> {
    let names = a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name));
    names.cloned().collect()
}

/// Random numbers between 0 and 1 (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}
