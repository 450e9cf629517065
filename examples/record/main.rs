//! Records results that a change of the code must not change, and reports differences.
//!
//! ```text
//! cargo run --release --example record                     # compares all with tests/data/record
//! cargo run --release --example record -- returns linear   # compares groups and scenes
//! cargo run --release --example record -- --all-sets       # with SSE2, AVX2 and AVX-512
//! cargo run --release --example record -- --update         # writes the record anew
//! cargo run --release --example record -- --times          # prints what each part takes
//! ```
//!
//! A line is a hash of all bits of results: grazing orbits, returns and forcing periods by direct
//! simulation (of one orbit and in lanes), coefficients, images by map, diagrams, charts and
//! emitted text. The record is the same for every instruction set and every profile, as far as the
//! platform's exponential, logarithm, powers, inverse and hyperbolic functions have the same bits.
//! The exit code is 1 if a line differs, 2 for wrong arguments.

mod recorder;

use std::error::Error;
use std::fs;
use std::process::{Command, ExitCode};
use std::time::Instant;

use grazemap::model::catalogue;
use grazemap::numeric::{INSTRUCTION_LIMIT, unknown_instruction_limit};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use recorder::{Lines, computed, differences, file, groups, is_of, recorded};

/// Request on the command line.
#[derive(Debug, Default)]
struct Request {
    groups: Vec<&'static str>,
    scenes: Vec<&'static str>,
    update: bool,
    all_sets: bool,
    timed: bool,
}

impl Request {
    /// Parses the arguments. By default, all groups and all scenes.
    fn of(arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut request = Self::default();
        for word in arguments {
            let scene = catalogue::names().find(|&name| name == word);
            let group = groups().find(|&name| name == word);
            match (&word[..], group, scene) {
                ("--update", ..) => request.update = true,
                ("--all-sets", ..) => request.all_sets = true,
                ("--times", ..) => request.timed = true,
                (_, Some(group), _) => request.groups.push(group),
                (_, _, Some(scene)) => request.scenes.push(scene),
                _ => return Err(format!("`{word}` is no group, no scene and no option")),
            }
        }
        if request.groups.is_empty() {
            request.groups = groups().collect();
        }
        if request.scenes.is_empty() {
            request.scenes = catalogue::names().collect();
        }
        Ok(request)
    }

    /// Lines computed by the present code, on at most two threads.
    fn computed(&self) -> Result<Lines, Box<dyn Error>> {
        let threads = ThreadPoolBuilder::new().num_threads(2).build()?;
        let compute = |&scene: &&'static str| {
            let mut lines = Lines::new();
            for &group in &self.groups {
                let clock = Instant::now();
                lines.append(&mut computed(scene, &[group]));
                if self.timed {
                    println!("{group} {scene}: {:.2} s", clock.elapsed().as_secs_f64());
                }
            }
            lines
        };
        let parts: Vec<Lines> = threads.install(|| {
            let scenes = self.scenes.par_iter().with_max_len(1);
            scenes.map(compute).collect()
        });
        Ok(parts.into_iter().flatten().collect())
    }

    /// Compares with the record, or writes it. Returns whether they agree.
    fn settle(&self, computed: &Lines) -> Result<bool, Box<dyn Error>> {
        let mut different = 0;
        for &group in &self.groups {
            let of = |lines: &Lines, is: bool| -> Lines {
                let lines = lines.iter();
                let lines = lines.filter(|(key, _)| is_of(key, &[group], &self.scenes) == is);
                lines.map(|(key, hash)| (key.clone(), hash.clone())).collect()
            };
            let new = of(computed, true);
            if self.update {
                let mut all = recorded(group).map_or(Lines::new(), |old| of(&old, false));
                all.extend(new);
                let lines = all.iter().map(|(key, hash)| format!("{key} {hash}\n"));
                fs::write(file(group), lines.collect::<String>())?;
                continue;
            }
            for difference in differences(&of(&recorded(group)?, true), &new) {
                println!("{difference}");
                different += 1;
            }
        }
        let done = if self.update { "written" } else { "compared" };
        println!("{} lines {done}, {different} differ", computed.len());
        Ok(different == 0)
    }

    /// Compares with every instruction set of this machine. Returns whether all agree.
    fn settle_with_all_sets(&self) -> Result<bool, Box<dyn Error>> {
        let mut agree = true;
        for set in instruction_sets() {
            println!("with {set}");
            let words = self.groups.iter().chain(&self.scenes);
            let mut again = Command::new(std::env::current_exe()?);
            again.args(words).env(INSTRUCTION_LIMIT, set);
            agree &= again.status()?.success();
        }
        Ok(agree)
    }
}

/// Instruction sets of this machine for which kernels are compiled.
#[cfg(target_arch = "x86_64")]
fn instruction_sets() -> Vec<&'static str> {
    let mut sets = vec!["sse2"];
    if is_x86_feature_detected!("avx2") {
        sets.push("avx2");
    }
    if is_x86_feature_detected!("avx512vl") {
        sets.push("avx512");
    }
    sets
}

/// Instruction sets of other machines: one, which has no name in the limit.
#[cfg(not(target_arch = "x86_64"))]
fn instruction_sets() -> Vec<&'static str> {
    Vec::new()
}

fn run() -> Result<bool, Box<dyn Error>> {
    if let Some(value) = unknown_instruction_limit() {
        return Err(format!("{INSTRUCTION_LIMIT}: `{value}` is no instruction set").into());
    }
    let request = Request::of(std::env::args().skip(1))?;
    if request.all_sets && !request.update {
        return request.settle_with_all_sets();
    }
    request.settle(&request.computed()?)
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
