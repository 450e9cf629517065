//! The command line in groups, each naming the ones before it alone: output; what can be resumed;
//! shards; arguments; commands; the gallery and the joining of shards, which run commands.
//!
//! A command is: its arguments, one call of the library, its results handed to `report`.
//!
//! Exit codes: 0 done; 1 the mathematics ended otherwise, and what was found is said; 2 wrong
//! input.
//!
//! Deliberately absent: numerics.

mod arguments;
mod commands;
mod gallery;
mod merge;
mod output;
mod resume;
mod shards;

use std::ffi::OsString;

use clap::Parser;

use arguments::{Arguments, Command};
use commands::{
    basin, branch, converge, emit, expand, grazes, image, loci, orbits, run, scenes, shell, sweeps,
    trajectory, view,
};
use output::CliError;
use resume::catch_interruptions;

use grazemap::numeric::unknown_instruction_limit;

/// Runs the program on these arguments, the first being the program's name; gives its exit code.
///
/// Wrong arguments are said on standard error and end with exit code 2, as every wrong input does.
pub(crate) fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(refusal) => {
            // NOTE: `--help` and `--version` arrive here too, with exit code 0; a closed standard
            // output is no fault.
            let _shown = refusal.print();
            return u8::try_from(refusal.exit_code()).unwrap_or(2);
        }
    };
    match dispatch(arguments) {
        Ok(()) => 0,
        Err(error) => {
            error.show();
            error.exit_code()
        }
    }
}

fn dispatch(arguments: Arguments) -> Result<(), CliError> {
    arguments.refuse_lost_output()?;
    catch_interruptions();
    if let Some(value) = unknown_instruction_limit() {
        return Err(CliError::InstructionLimit { value });
    }
    match arguments.command {
        Some(Command::Merge(options)) => merge::run(&options, &in_shards),
        Some(command) => in_shards(command),
        None => run::built_in(&arguments.common),
    }
}

/// Runs a command that may be one of shards.
fn in_shards(command: Command) -> Result<(), CliError> {
    match command {
        Command::Gallery(options) => gallery::run(&options, &execute),
        command => execute(command),
    }
}

/// Runs a command that computes one thing.
fn execute(command: Command) -> Result<(), CliError> {
    match command {
        Command::New(options) => scenes::new(&options),
        Command::Check(options) => scenes::check(&options),
        Command::Locate(options) => grazes::locate(&options),
        Command::Expand(options) => expand::run(&options),
        Command::Curve(options) => grazes::curve(&options),
        Command::Image(options) => image::run(&options),
        Command::Converge(options) => converge::run(&options),
        Command::Diagram(options) => sweeps::diagram(&options),
        Command::Chart(options) => sweeps::chart(&options),
        Command::Orbits(options) => orbits::run(&options),
        Command::Basin(options) => basin::run(&options),
        Command::Branch(options) => branch::run(&options),
        Command::Loci(options) => loci::run(&options),
        Command::Trajectory(options) => trajectory::run(&options),
        Command::Emit(options) => emit::run(&options),
        Command::Run(options) => run::run(&options),
        Command::View(options) => view::run(&options),
        Command::Completions(options) => shell::completions(&options),
        Command::Man(options) => shell::man(&options),
        // A gallery in a gallery has nothing to add, nor has it shards.
        Command::Gallery(_) | Command::Merge(_) => Ok(()),
    }
}
