//! `grazemap orbits`, `branch`, `loci`, `trajectory` and `converge`: turn options into keys of the
//! pipeline and deliver its answer.

use std::cell::Cell;

use serde::Serialize;

use super::{Contacts, open, resumable, settle, shard};
use crate::cli::arguments::{
    BranchArguments, ConvergeOptions, LociArguments, OrbitsArguments, TrajectoryArguments,
};
use crate::cli::output::{Bar, CliError, Outlets, deliver, note_all};
use crate::cli::pieces::Resumable;
use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::{Joining, TimeSeriesRequest, each_moment};
use grazemap::pipeline::{
    Answer, BranchKeys, ConvergenceKeys, Ended, LociKeys, OrbitsKeys, OrbitsOf, Settled,
    TrajectoryKeys,
};
use grazemap::report::{CsvStream, time_series_columns, time_series_row, to_json};
use grazemap::{Error, Map};

pub(in crate::cli) fn orbits(options: &OrbitsArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let direct = options.which.using == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let kinds = [(options.fold, BifurcationKind::Fold), (options.flip, BifurcationKind::Flip)];
    let kinds = kinds.into_iter().filter(|(asked, _)| *asked);
    let keys = OrbitsKeys {
        at: options.at.clone(),
        period: options.period,
        itineraries: options.which.itinerary.clone(),
        using: options.which.using,
        kind: kinds.map(|(_, kind)| kind).collect(),
        plane: options.plane.clone(),
        from: options.from,
        to: options.to,
        points: options.points,
    };
    answered(&keys, "orbits", &map, outlets, |bar| keys.answer(&map, bar))
}

pub(in crate::cli) fn branch(options: &BranchArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let direct = options.which.using == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let keys = BranchKeys {
        along: options.along.clone(),
        from: options.stretch.from,
        to: options.stretch.to,
        at: options.stretch.at.clone().unwrap_or_default(),
        itineraries: options.which.itinerary.clone(),
        period: options.period,
        using: options.which.using,
        starts: options.start.clone(),
        observe: options.observe.clone(),
        iterates: outlets.output.is_some() || options.sharding.share.is_some(),
    };
    if let Some(share) = options.sharding.share {
        let asked = to_json(&keys)?;
        return shard(share, ("branch", &map, &asked), outlets, |shard| keys.share(&map, shard));
    }
    let pieces = options.scene.common.pieces();
    answered(&keys, "branch", &map, outlets, |bar| keys.answer(&map, &Joining::new(bar, pieces)))
}

pub(in crate::cli) fn loci(options: &LociArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let direct = options.which.using == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let keys = LociKeys {
        plane: options.plane.clone(),
        from: options.stretch.from,
        to: options.stretch.to,
        at: options.stretch.at.clone().unwrap_or_default(),
        kind: options.kind.clone(),
        itineraries: options.which.itinerary.clone(),
        using: options.which.using,
        chart: outlets.output.is_some(),
    };
    answered(&keys, "loci", &map, outlets, |bar| keys.answer(&map, bar))
}

pub(in crate::cli) fn trajectory(options: &TrajectoryArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let keys = TrajectoryKeys {
        at: options.at.clone().unwrap_or_default(),
        start: options.start.clone().unwrap_or_default(),
        itinerary: options.itinerary.clone(),
        settle: options.settle,
        periods: options.periods,
        samples: options.samples,
    };
    let bar = Bar::new("trajectory", outlets.quiet);
    if outlets.csv.is_some() && outlets.json.is_none() && outlets.output.is_none() {
        let (request, remarks) = keys.request(&settled, &bar)?;
        note_all(&remarks, outlets.quiet);
        return stream(&settled, &request, outlets, &bar);
    }
    deliver(keys.answer(&settled, &bar)?, "trajectory", outlets)
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

pub(in crate::cli) fn converge(options: &ConvergeOptions) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let keys = ConvergenceKeys { fresh: options.fresh };
    let decisive = [&*settled.graze().to_json()?, &options.fresh.to_string()];
    let resumable = Resumable::begin("converge", outlets.folder(), &decisive, outlets.quiet);
    let bar = Bar::new("convergence", outlets.quiet).resuming(0, resumable.journal());
    let answer = keys.answer(&settled, &bar)?;
    drop(bar);
    deliver(answer, "converge", outlets)?;
    resumable.finish();
    Ok(())
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
    deliver(answer, command, outlets)?;
    resumable.finish();
    ended.map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}
