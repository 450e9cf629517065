//! Record of results that a change of the code must not change.
//!
//! ```text
//! cargo run --release -p xtask -- record                   # compares all with tests/data/record
//! cargo run --release -p xtask -- record returns linear    # compares groups and scenes
//! cargo run --release -p xtask -- record --all-sets        # with SSE2, AVX2 and AVX-512
//! cargo run --release -p xtask -- record --update          # writes the record anew
//! cargo run --release -p xtask -- record --times           # prints what each part takes
//! cargo run --release -p xtask -- record --threads 7       # computes on seven threads, not on two
//! ```
//!
//! A line is a hash of all bits of results: grazing orbits, returns and forcing periods by direct
//! simulation (of one orbit and in lanes), coefficients, images by map, diagrams, charts and
//! emitted text of every scene; branches, loci, crises, searches, grazing curves, basins,
//! manifolds, fits, noise, windows and choices of orders of about five scenes each. The group
//! `documents` is a golden text instead: the program's JSON, with numbers to twelve digits.
//!
//! The record is the same for every instruction set, number of threads and profile, as far as the
//! platform's exponential, logarithm, powers, inverse and hyperbolic functions have the same bits.

mod answers;
mod documents;
mod hash;
mod maps;
mod questions;
pub mod recorder;
mod simulation;
mod subject;

use std::error::Error;
use std::fs;
use std::process::Command;
use std::time::Instant;

use grazemap::model::catalogue;
use grazemap::numeric::{INSTRUCTION_LIMIT, unknown_instruction_limit};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::{Outcome, Verdict};
pub use documents::golden_text;
use recorder::{Lines, computed, differences, file, groups, is_of, recorded};

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct Record {
    /// Groups and scenes; all of those that are not named
    words: Vec<String>,
    /// Write the record anew
    #[arg(long)]
    update: bool,
    /// Compare with every instruction set of this machine
    #[arg(long, conflicts_with = "update")]
    all_sets: bool,
    /// Print what each part takes
    #[arg(long)]
    times: bool,
    /// Number of threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

impl Record {
    /// Compares, or writes the record.
    ///
    /// # Errors
    ///
    /// A word that is no group and no scene; a record that cannot be read or written.
    pub fn run(&self) -> Outcome {
        if let Some(value) = unknown_instruction_limit() {
            return Err(format!("{INSTRUCTION_LIMIT}: `{value}` is no instruction set").into());
        }
        let part = Part::named(&self.words)?;
        let sets = instruction_sets();
        if self.all_sets && !sets.is_empty() {
            return part.compare_with(&sets);
        }
        let computed = part.computed(self.threads, self.times)?;
        if self.update { part.write(&computed) } else { part.compare(&computed) }
    }
}

/// Scenes of the record: those of the catalogue, but for one whose returns in double-double and
/// jets of high order take ten minutes.
pub fn scenes() -> impl Iterator<Item = &'static str> {
    catalogue::names().filter(|&name| name != "hunt_crossley")
}

/// Part of the record.
#[derive(Debug)]
struct Part {
    groups: Vec<&'static str>,
    scenes: Vec<&'static str>,
}

impl Part {
    /// Part that words name: groups and scenes, all of those that are not named.
    fn named(words: &[String]) -> Result<Self, String> {
        let mut part = Self { groups: Vec::new(), scenes: Vec::new() };
        for word in words {
            let scene = scenes().find(|name| name == word);
            let group = groups().find(|name| name == word);
            match (group, scene) {
                (Some(group), _) => part.groups.push(group),
                (_, Some(scene)) => part.scenes.push(scene),
                _ => return Err(format!("`{word}` is no group and no scene")),
            }
        }
        if part.groups.is_empty() {
            part.groups = groups().collect();
        }
        if part.scenes.is_empty() {
            part.scenes = scenes().collect();
        }
        Ok(part)
    }

    /// Lines computed by the present code.
    fn computed(&self, threads: usize, times: bool) -> Result<Lines, Box<dyn Error>> {
        let threads = ThreadPoolBuilder::new().num_threads(threads).build()?;
        let compute = |&scene: &&'static str| {
            let mut lines = Lines::new();
            for &group in &self.groups {
                let clock = Instant::now();
                lines.append(&mut computed(scene, &[group]));
                if times {
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

    /// Writes lines into the record.
    fn write(&self, computed: &Lines) -> Outcome {
        for &group in &self.groups {
            let mut all = recorded(group).unwrap_or_default();
            all.retain(|key, _| !is_of(key, &[group], &self.scenes));
            all.extend(self.of(computed, group));
            let lines = all.iter().map(|(key, hash)| format!("{key} {hash}\n"));
            fs::write(file(group), lines.collect::<String>())?;
        }
        println!("{} lines written", computed.len());
        Ok(Verdict::Good)
    }

    /// Compares lines with the record.
    fn compare(&self, computed: &Lines) -> Outcome {
        let mut different = 0;
        for &group in &self.groups {
            let [was, is] = [&recorded(group)?, computed].map(|lines| self.of(lines, group));
            for difference in differences(&was, &is) {
                println!("{difference}");
                different += 1;
            }
        }
        println!("{} lines compared, {different} differ", computed.len());
        Ok(Verdict::of(different))
    }

    /// Lines of a group that belong to these scenes.
    fn of(&self, lines: &Lines, group: &str) -> Lines {
        let lines = lines.iter().filter(|(key, _)| is_of(key, &[group], &self.scenes));
        lines.map(|(key, hash)| (key.clone(), hash.clone())).collect()
    }

    /// Compares with every one of these instruction sets.
    fn compare_with(&self, sets: &[&str]) -> Outcome {
        let mut different = 0;
        for set in sets {
            println!("with {set}");
            let words = self.groups.iter().chain(&self.scenes);
            let mut again = Command::new(std::env::current_exe()?);
            again.arg("record").args(words).env(INSTRUCTION_LIMIT, set);
            different += usize::from(!again.status()?.success());
        }
        Ok(Verdict::of(different))
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
