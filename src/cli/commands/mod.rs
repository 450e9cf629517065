//! Commands: one file each, or one for a few of a kind. Shared first steps: open the scene, orbit
//! or map, choose the section, report warnings.

pub(super) mod answers;
pub(super) mod atlas;
pub(super) mod emit;
pub(super) mod grazes;
pub(super) mod image;
mod points;
pub(super) mod run;
pub(super) mod scenes;
pub(super) mod sweeps;
mod tables;

use std::path::PathBuf;

use super::arguments::SceneOptions;
use super::output::{CliError, Outlets, note, note_all};
use super::pieces::{Resumable, Sharded};
use grazemap::analysis::{Shard, Share};
use grazemap::expansion::check_orders;
use grazemap::iteration::parallel;
use grazemap::model::Scene;
use grazemap::pipeline::{Settled, Source};
use grazemap::report::to_json;
use grazemap::{Error, Map};

/// Opens the argument SCENE, prints its warnings, and starts the threads asked for.
fn open(options: &SceneOptions) -> Result<Source, CliError> {
    if let Some(threads) = options.common.threads
        && !parallel::start(threads.into())
    {
        return Err(CliError::Threads);
    }
    let joined = options.common.joined.as_ref().and_then(|joined| joined.map.clone());
    let source = match joined {
        Some(map) => Source::Map(map),
        None => Source::open(&options.scene, &options.common.set)?,
    };
    if !options.common.outlets.quiet {
        for warning in &source.scene().warnings {
            note(&format!("warning: {warning}"));
        }
    }
    Ok(source)
}

/// Scene on the section of its map. Prints the reason for that section, unless `quiet`, where the
/// scene allows any.
fn settle(source: Source, quiet: bool) -> Result<Settled, CliError> {
    let settled = source.settle()?;
    note_section(&settled, quiet);
    Ok(settled)
}

/// Prints the reason for the chosen section, unless `quiet`, where the scene allows any.
fn note_section(settled: &Settled, quiet: bool) {
    if let Some(decision) = settled.section().decided.filter(|_| !quiet) {
        note(&decision.words());
    }
}

/// Map of the source. Warnings about its window come from [`remark_on_window`], once the rest of
/// the call is known to be valid.
fn map(source: Source, quiet: bool) -> Result<Map, CliError> {
    let saved = match &source {
        Source::Map(map) => Some(map.clone()),
        Source::Scene(_) | Source::Graze(_) => None,
    };
    refuse_orders(source.scene())?;
    let settled = settle(source, quiet)?;
    Ok(match saved {
        Some(map) => map,
        None => settled.plan()?.expand()?,
    })
}

/// Role of the map's contacts in a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contacts {
    /// The command iterates the contacts.
    Iterated,
    /// Direct simulation computes the result; if there is a map, its orbits guide the search.
    Searched,
    /// Direct simulation computes the result; no contacts are expanded.
    Unused,
}

impl Contacts {
    /// [`Self::Iterated`], or `otherwise` if everything is computed by direct simulation.
    fn unless(direct: bool, otherwise: Self) -> Self {
        if direct { otherwise } else { Self::Iterated }
    }

    /// Map of the source, with as much of its expansion as this role needs.
    fn map(self, source: Source, quiet: bool) -> Result<Map, CliError> {
        let map = match self {
            Self::Iterated => return map(source, quiet),
            Self::Searched => source.map_or_free_flight()?,
            Self::Unused => source.free_flight()?,
        };
        note_section(map.settled(), quiet);
        Ok(map)
    }
}

/// Computes a shard of a command on a map. `asked` holds its settings beyond the scene, as text.
fn shard(
    share: Share,
    (command, map, asked): (&'static str, &Map, &str),
    outlets: &Outlets,
    compute: impl FnOnce(&Shard<'_>) -> Result<(), Error>,
) -> Result<(), CliError> {
    let scene = Some(map.scene().digest);
    let document = map.local().has_contacts().then(|| map.to_json()).transpose()?;
    let sharded = Sharded { share, command, scene, map: document.as_deref(), asked };
    sharded.write(outlets, compute)
}

/// Keeps the finished pieces of a command on a map beside its results. `asked` holds the command's
/// settings beyond the scene, as text.
fn resumable(
    command: &str,
    folder: Option<PathBuf>,
    map: &Map,
    asked: &str,
    quiet: bool,
) -> Result<Resumable, CliError> {
    let decisive = [&*map.scene().text, &to_json(map.local())?, asked];
    Ok(Resumable::begin(command, folder, &decisive, quiet))
}

/// Refuses orders that take too long, before an orbit is searched for.
fn refuse_orders(scene: &Scene) -> Result<(), CliError> {
    Ok(check_orders(scene).map_err(Error::from)?)
}

/// Warns on standard error if the map's error on its window is too large, or if the window exceeds
/// the radius of a depth series.
fn remark_on_window(map: &Map, quiet: bool) {
    note_all(&map.remarks().collect::<Vec<_>>(), quiet);
}
