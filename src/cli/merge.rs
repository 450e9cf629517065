//! `grazemap merge`: the results of a command from the pieces of all its shards.
//!
//! The command itself runs, as its shards were called, on the map that they hold: what their pieces
//! hold it does not compute.

use std::sync::{Arc, Mutex};

use clap::Parser;

use super::arguments::{Arguments, Command, Joined, MergeArguments};
use super::output::CliError;
use grazemap::Map;
use grazemap::report::{ShardError, join_shards};

pub(super) fn run(
    options: &MergeArguments,
    command: &dyn Fn(Command) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let (header, pieces) = join_shards(&options.pieces)?;
    let foreign = || ShardError::Foreign { path: options.pieces[0].clone() };
    let mut arguments = Arguments::try_parse_from(&header.arguments).map_err(|_| foreign())?;
    let map = header.map.as_deref().map(Map::from_json).transpose()?;
    let joined = Arc::new(Joined { map, pieces: Mutex::new(pieces) });
    if !arguments.join(options, joined) {
        return Err(foreign().into());
    }
    arguments.refuse_lost_output()?;
    arguments.command.map_or(Ok(()), command)
}
