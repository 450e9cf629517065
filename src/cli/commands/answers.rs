//! `grazemap orbits`, `branch`, `loci`, `trajectory`, `derivatives`, `contact`, `noise`, `fit` and
//! `converge`: hand the keys of the pipeline on and deliver its answer.

use std::cell::Cell;

use serde::Serialize;

use super::points::measured_series;
use super::{Contacts, open, resumable, settle, shard};
use crate::cli::arguments::{Asked, BranchArguments, ContactArguments, FitArguments, SceneOptions};
use crate::cli::output::{Bar, CliError, Outlets, deliver, note_all};
use crate::cli::pieces::Resumable;
use grazemap::analysis::{Joining, TimeSeriesRequest, each_moment};
use grazemap::model::Method;
use grazemap::pipeline::{
    Answer, BranchKeys, ConvergenceKeys, DerivativesKeys, Ended, LociKeys, NoiseKeys, OrbitsKeys,
    OrbitsOf, Settled, TrajectoryKeys, is_standard,
};
use grazemap::report::{CsvStream, time_series_columns, time_series_row, to_json};
use grazemap::{Error, Map};

/// Map in which orbits are searched for.
fn searched(scene: &SceneOptions, method: OrbitsOf) -> Result<Map, CliError> {
    let contacts = Contacts::unless(method == OrbitsOf::Direct, Contacts::Searched);
    contacts.map(open(scene)?, scene.common.outlets.quiet)
}

pub(in crate::cli) fn orbits(asked: &Asked<OrbitsKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let map = searched(scene, keys.method)?;
    answered(keys, "orbits", &map, &scene.common.outlets, |bar| keys.answer(&map, bar))
}

pub(in crate::cli) fn branch(options: &BranchArguments) -> Result<(), CliError> {
    let BranchArguments { scene, keys, sharding } = options;
    let outlets = &scene.common.outlets;
    let map = searched(scene, keys.method)?;
    let iterates = outlets.output.is_some() || sharding.share.is_some();
    let keys = BranchKeys { iterates, ..keys.clone() };
    if let Some(share) = sharding.share {
        let asked = to_json(&keys)?;
        return shard(share, ("branch", &map, &asked), outlets, |shard| keys.share(&map, shard));
    }
    let pieces = scene.common.pieces();
    answered(&keys, "branch", &map, outlets, |bar| keys.answer(&map, &Joining::new(bar, pieces)))
}

pub(in crate::cli) fn loci(asked: &Asked<LociKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let outlets = &scene.common.outlets;
    let map = searched(scene, keys.method)?;
    let keys = LociKeys { chart: outlets.output.is_some(), ..keys.clone() };
    answered(&keys, "loci", &map, outlets, |bar| keys.answer(&map, bar))
}

/// Soft stops of a wanted restitution, at the stop of a scene if there is one.
pub(in crate::cli) fn contact(options: &ContactArguments) -> Result<(), CliError> {
    let ContactArguments { scene, keys, common } = options;
    let graze = match scene {
        Some(scene) => {
            let scene = SceneOptions { scene: scene.clone(), common: common.clone() };
            Some(open(&scene)?.graze()?)
        }
        None if common.set.is_empty() => None,
        None => return Err(CliError::NothingToSet),
    };
    told("contact", &common.outlets, |bar| keys.answer(graze.as_ref(), bar))
}

/// Derivatives of a state after hits.
pub(in crate::cli) fn derivatives(asked: &Asked<DerivativesKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let source = open(scene)?;
    told("derivatives", &scene.common.outlets, |bar| keys.answer(source.scene(), bar))
}

pub(in crate::cli) fn trajectory(asked: &Asked<TrajectoryKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let outlets = &scene.common.outlets;
    let settled = settle(open(scene)?, outlets.quiet)?;
    let is_streamed = keys.derivatives.is_none()
        && outlets.csv.is_some()
        && outlets.json.is_none()
        && outlets.output.is_none();
    if is_streamed {
        let bar = Bar::new("trajectory", outlets.quiet);
        let (request, remarks) = keys.request(&settled, &bar)?;
        note_all(&remarks, outlets.quiet);
        return stream(&settled, &request, outlets, &bar);
    }
    told("trajectory", outlets, |bar| keys.answer(&settled, bar))
}

/// Writes the time series as CSV, row by row as it is simulated.
fn stream(
    settled: &Settled,
    request: &TimeSeriesRequest,
    outlets: &Outlets,
    bar: &Bar,
) -> Result<(), CliError> {
    let model = &settled.scene().model;
    let ended = Cell::new(None);
    outlets.write_csv(&|out| {
        let mut table = CsvStream::new(out, &time_series_columns(model))?;
        let mut written = Ok(());
        let push = &mut |point| {
            if written.is_ok() {
                written = table.push(&time_series_row(model, &point));
            }
        };
        let (scene, orbit) = (settled.scene(), settled.orbit());
        ended.set(Some(each_moment(scene, orbit, request, bar, push)));
        written.and_then(|()| table.finish())
    })?;
    match ended.into_inner() {
        Some(ran) => match ran.map_err(Error::from)?.early_end {
            Some(end) => Err(Error::from(Ended::Trajectory(end)).into()),
            None => Ok(()),
        },
        None => Ok(()),
    }
}

pub(in crate::cli) fn noise(asked: &Asked<NoiseKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let outlets = &scene.common.outlets;
    let contacts = Contacts::unless(keys.method == Method::Direct, Contacts::Unused);
    let map = contacts.map(open(scene)?, outlets.quiet)?;
    told("noise", outlets, |bar| keys.answer(&map, bar))
}

pub(in crate::cli) fn fit(options: &FitArguments) -> Result<(), CliError> {
    let FitArguments { scene, data, keys } = options;
    let outlets = &scene.common.outlets;
    if is_standard(&scene.scene) && is_standard(data) {
        return Err(CliError::StandardInputTwice);
    }
    let contacts = Contacts::unless(keys.method == Method::Direct, Contacts::Unused);
    let map = contacts.map(open(scene)?, outlets.quiet)?;
    let series = measured_series(data, map.local())?;
    told("fit", outlets, |bar| keys.answer(&map, series, bar))
}

pub(in crate::cli) fn converge(asked: &Asked<ConvergenceKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let outlets = &scene.common.outlets;
    let settled = settle(open(scene)?, outlets.quiet)?;
    let decisive = [&*settled.graze().to_json()?, &keys.fresh.to_string()];
    let resumable = Resumable::begin("converge", outlets.folder(), &decisive, outlets.quiet);
    let bar = Bar::new("convergence", outlets.quiet).resuming(0, resumable.journal());
    let mut answer = keys.answer(&settled, &bar)?;
    drop(bar);
    deliver(&mut answer, outlets)?;
    resumable.finish();
    Ok(())
}

/// Runs a command that keeps no pieces.
pub(in crate::cli) fn told(
    command: &'static str,
    outlets: &Outlets,
    answer: impl FnOnce(&Bar) -> Result<Answer, Error>,
) -> Result<(), CliError> {
    let bar = Bar::new(command, outlets.quiet);
    let mut answer = answer(&bar)?;
    drop(bar);
    deliver(&mut answer, outlets)
}

/// Runs a command whose keys are answered by a map, and keeps its finished pieces.
fn answered(
    keys: &impl Serialize,
    command: &'static str,
    map: &Map,
    outlets: &Outlets,
    answer: impl FnOnce(&Bar) -> Result<Answer, Error>,
) -> Result<(), CliError> {
    let resumable = resumable(command, outlets.folder(), map, &to_json(keys)?, outlets.quiet)?;
    let bar = Bar::new(command, outlets.quiet).resuming(0, resumable.journal());
    let mut answer = answer(&bar)?;
    drop(bar);
    // NOTE: an answer without a result is written before its error is returned.
    let ended = answer.ended.take();
    deliver(&mut answer, outlets)?;
    resumable.finish();
    ended.map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}
