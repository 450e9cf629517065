//! Work on the repository of Grazemap: `cargo run --release -p xtask -- COMMAND`.
//!
//! The exit code is 0 if everything is as it should be, 1 if something is not, 2 for wrong
//! arguments and for a command that could not do its work.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::benchmark::Benchmark;
use xtask::fuzz::Fuzz;
use xtask::generated::Generated;
use xtask::interruptions::Interruptions;
use xtask::near_grazing::NearGrazing;
use xtask::random_oscillators::RandomOscillators;
use xtask::record::Record;
use xtask::section_phases::SectionPhases;
use xtask::{Outcome, Verdict};

/// Work on the repository of Grazemap
#[derive(Debug, Parser)]
#[command(name = "xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write the tables of the benchmark, or this program's answers to them
    Benchmark(Benchmark),
    /// Call the program with randomly changed scenes or saved files, and keep those that end wrongly
    Fuzz(Fuzz),
    /// Write the crate of emitted maps, or compare it with the emission of today
    Generated(Generated),
    /// Kill long commands at random moments, and compare what they leave and how they go on
    Interruptions(Interruptions),
    /// Compare simulation in lanes near grazes with double-double
    NearGrazing(NearGrazing),
    /// Compare simulation and diagrams of random oscillators with an independent simulator
    RandomOscillators(RandomOscillators),
    /// Compare all results with the record of their bits, or write it anew
    Record(Record),
    /// Compare returns to sections at every phase with simulation without a section
    SectionPhases(SectionPhases),
}

impl Command {
    fn run(&self) -> Outcome {
        match self {
            Self::Benchmark(benchmark) => benchmark.run(),
            Self::Fuzz(fuzz) => fuzz.run(),
            Self::Generated(generated) => generated.run(),
            Self::Interruptions(interruptions) => interruptions.run(),
            Self::NearGrazing(campaign) => campaign.run(),
            Self::RandomOscillators(campaign) => campaign.run(),
            Self::Record(record) => record.run(),
            Self::SectionPhases(campaign) => campaign.run(),
        }
    }
}

fn main() -> ExitCode {
    match Arguments::parse().command.run() {
        Ok(Verdict::Good) => ExitCode::SUCCESS,
        Ok(Verdict::Faulty) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
