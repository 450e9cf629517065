//! One file per command, or per few of one kind; here what they begin with: the scene, orbit or map
//! named, and what is said of it on the way.

pub(super) mod answers;
pub(super) mod emit;
pub(super) mod grazes;
pub(super) mod image;
pub(super) mod run;
pub(super) mod scenes;
pub(super) mod sweeps;

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

/// Opens what is named in the place of a scene, shows its warnings and starts the threads asked
/// for.
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

/// The scene on the section that its map is taken on; says, unless `quiet`, what decided it where
/// the scene takes any.
fn settle(source: Source, quiet: bool) -> Result<Settled, CliError> {
    let settled = source.settle()?;
    note_section(&settled, quiet);
    Ok(settled)
}

/// Says, unless `quiet`, what decided the section where the scene takes any.
fn note_section(settled: &Settled, quiet: bool) {
    if let Some(decision) = settled.section().decided.filter(|_| !quiet) {
        note(&decision.words());
    }
}

/// The map of what is named. What is to be said of its window is [said](remark_on_window) once the
/// rest of the call is known to be right.
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

/// Use that a command makes of the contacts of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contacts {
    /// It iterates them.
    Iterated,
    /// Direct simulation answers, and looks where the map has orbits, if there is one.
    Searched,
    /// None: direct simulation answers.
    Unused,
}

impl Contacts {
    /// The use that is made where all, or not all, is asked of direct simulation.
    fn unless(direct: bool, otherwise: Self) -> Self {
        if direct { otherwise } else { Self::Iterated }
    }

    /// As much of the map of what is named as this needs.
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

/// Computes a shard of a command that uses a map, and that was asked for more than its scene says.
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

/// Keeps the finished pieces of a command that uses a map, and that was asked for more than its
/// scene says, beside its results.
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

/// Refuses orders that take too long, before an orbit is looked for.
fn refuse_orders(scene: &Scene) -> Result<(), CliError> {
    Ok(check_orders(scene).map_err(Error::from)?)
}

/// Says on standard error where a map errs on its window more than it should, and where the window
/// is deeper than the series of the passage whose contact loses most.
fn remark_on_window(map: &Map, quiet: bool) {
    note_all(&map.remarks().collect::<Vec<_>>(), quiet);
}
