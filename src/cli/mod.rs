//! Command line program, in groups that each use only those before them: output; resuming and
//! sharding; arguments; commands; the gallery, which runs commands.
//!
//! A command parses its arguments, makes one call of the library, and hands the results to
//! `report`.
//!
//! Exit codes: 0 done; 1 no result (no grazing orbit, for example), with the reason printed; 2
//! wrong input.
//!
//! Deliberately absent: numerics.

mod arguments;
mod commands;
mod gallery;
mod help;
mod output;
mod pieces;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use arguments::{Arguments, Command, Joined, MergeArguments};
use commands::{answers, atlas, emit, grazes, image, run, scenes, sweeps};
use output::CliError;
use pieces::{VERSION, catch_interruptions, program};

use grazemap::Map;
use grazemap::numeric::unknown_instruction_limit;
use grazemap::report::{ShardError, join_shards};

/// Runs the program and returns its exit code. The first argument is the program's name.
///
/// Wrong arguments are reported on standard error and end with exit code 2, as all wrong input
/// does.
pub(crate) fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = match help::parse(arguments) {
        Ok(arguments) => arguments,
        Err(refusal) => {
            // NOTE: `--help` and `--version` arrive here too, with exit code 0. A closed standard
            // output is no error.
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
        Some(Command::Merge(options)) => merge(&options),
        Some(command) => in_shards(command),
        None if arguments.common.asks_for_nothing() => output::print(&help::help()),
        None => run::built_in(&arguments.common),
    }
}

/// Joins the pieces of all shards of a command into its results.
///
/// The command runs with the arguments and the map of its shards, and takes finished pieces from
/// their files instead of computing them.
fn merge(options: &MergeArguments) -> Result<(), CliError> {
    options.outlets.check(options.pieces.iter().map(PathBuf::as_path), None, &[])?;
    let (header, pieces) = join_shards(&options.pieces)?;
    header.check_program(VERSION, program()?)?;
    let foreign = || ShardError::Foreign { path: options.pieces[0].clone() };
    let mut arguments =
        help::parse(header.arguments.iter().map(OsString::from)).map_err(|_| foreign())?;
    let map = header.map.as_deref().map(Map::from_json).transpose()?;
    let joined = Arc::new(Joined { map, pieces: Mutex::new(pieces) });
    if !arguments.join(options, joined) {
        return Err(foreign().into());
    }
    arguments.refuse_lost_output()?;
    arguments.command.map_or(Ok(()), in_shards)
}

/// Runs a command that can be sharded.
fn in_shards(command: Command) -> Result<(), CliError> {
    match command {
        Command::Gallery(options) => gallery::run(&options, &execute),
        command => execute(command),
    }
}

/// Runs a command other than `gallery` and `merge`.
fn execute(command: Command) -> Result<(), CliError> {
    match command {
        Command::New(options) => scenes::new(&options),
        Command::Check(options) => scenes::check(&options),
        Command::Locate(options) => grazes::locate(&options),
        Command::Safe(options) => grazes::safe(&options),
        Command::Derivatives(options) => answers::derivatives(&options),
        Command::Contact(options) => answers::contact(&options),
        Command::Expand(options) => grazes::expand(&options),
        Command::Curve(options) => grazes::curve(&options),
        Command::Image(options) => image::run(&options),
        Command::Converge(options) => answers::converge(&options),
        Command::Diagram(options) => sweeps::diagram(&options),
        Command::Chart(options) => sweeps::chart(&options),
        Command::Orbits(options) => answers::orbits(&options),
        Command::Basin(options) => sweeps::basin(&options),
        Command::Branch(options) => answers::branch(&options),
        Command::Loci(options) => answers::loci(&options),
        Command::Trajectory(options) => answers::trajectory(&options),
        Command::Atlas(options) => atlas::run(&options),
        Command::Noise(options) => answers::noise(&options),
        Command::Fit(options) => answers::fit(&options),
        Command::Emit(options) => emit::run(&options),
        Command::Demo(common) => run::built_in(&common),
        Command::Run(options) => run::run(&options),
        Command::View(options) => run::view(&options),
        Command::Completions(options) => scenes::completions(&options),
        Command::Man(options) => scenes::man(&options),
        // A gallery within a gallery would add nothing, and cannot be sharded.
        Command::Gallery(_) | Command::Merge(_) => Ok(()),
    }
}
