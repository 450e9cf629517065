//! `grazemap orbits`, `branch`, `loci`, `trajectory`, `derivatives`, `contact` and `converge`: turn
//! options into keys of the pipeline and deliver its answer.

use std::cell::Cell;

use serde::Serialize;

use super::points::measured_series;
use super::{Contacts, open, resumable, settle, shard};
use crate::cli::arguments::{
    BranchArguments, ContactArguments, ConvergeOptions, DerivativesArguments, FitArguments,
    LociArguments, NoiseArguments, OrbitsArguments, SceneOptions, TrajectoryArguments,
};
use crate::cli::output::{Bar, CliError, Outlets, deliver, note_all};
use crate::cli::pieces::Resumable;
use crate::cli::positions::{Finite, Origin, Positive};
use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::{Joining, TimeSeriesRequest, each_moment};
use grazemap::model::Method;
use grazemap::pipeline::{
    Answer, BranchKeys, ContactKeys, ConvergenceKeys, DerivativesKeys, Ended, FitKeys, LociKeys,
    NoiseKeys, OrbitsKeys, OrbitsOf, Settled, TrajectoryKeys, is_standard,
};
use grazemap::report::{CsvStream, time_series_columns, time_series_row, to_json};
use grazemap::{Error, Map};

pub(in crate::cli) fn orbits(options: &OrbitsArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let direct = options.which.method == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let kinds = [(options.fold, BifurcationKind::Fold), (options.flip, BifurcationKind::Flip)];
    let kinds = kinds.into_iter().filter(|(asked, _)| *asked);
    let origin = Origin::new(map.settled().graze(), options.counting);
    let stepped = options.plane.first().map_or("", String::as_str);
    let [from, to] = origin.range(stepped, [options.from, options.to]);
    let keys = OrbitsKeys {
        at: options.at.iter().map(|at| origin.offsets(at)).collect(),
        period: options.period,
        itineraries: options.which.itinerary.clone(),
        method: options.which.method,
        kind: kinds.map(|(_, kind)| kind).collect(),
        plane: options.plane.clone(),
        from,
        to,
        points: options.points,
    };
    answered(&keys, "orbits", &map, outlets, |bar| keys.answer(&map, bar))
}

pub(in crate::cli) fn branch(options: &BranchArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let direct = options.which.method == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let origin = Origin::new(map.settled().graze(), options.stretch.counting);
    let [from, to] = options.stretch.range(&origin, &options.along);
    let keys = BranchKeys {
        along: options.along.clone(),
        from,
        to,
        at: options.stretch.at(&origin),
        itineraries: options.which.itinerary.clone(),
        period: options.period,
        method: options.which.method,
        starts: options.start.iter().map(|start| origin.offsets(start)).collect(),
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
    let direct = options.which.method == OrbitsOf::Direct;
    let contacts = Contacts::unless(direct, Contacts::Searched);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let origin = Origin::new(map.settled().graze(), options.stretch.counting);
    let first = options.plane.first().map_or("", String::as_str);
    let [from, to] = options.stretch.range(&origin, first);
    let keys = LociKeys {
        plane: options.plane.clone(),
        from,
        to,
        at: options.stretch.at(&origin),
        kind: options.kind.clone(),
        itineraries: options.which.itinerary.clone(),
        method: options.which.method,
        chart: outlets.output.is_some(),
    };
    answered(&keys, "loci", &map, outlets, |bar| keys.answer(&map, bar))
}

/// Soft stops of a wanted restitution, at the stop of a scene if there is one.
pub(in crate::cli) fn contact(options: &ContactArguments) -> Result<(), CliError> {
    let common = &options.common;
    let graze = match &options.scene {
        Some(scene) => {
            let scene = SceneOptions { scene: scene.clone(), common: common.clone() };
            Some(open(&scene)?.graze()?)
        }
        None if common.set.is_empty() => None,
        None => return Err(CliError::NothingToSet),
    };
    let number = |given: Option<Finite>| given.map(|Finite(value)| value);
    let keys = ContactKeys {
        restitution: options.restitution.0,
        time: number(options.time),
        stiffness: number(options.stiffness),
        speed: number(options.speed),
        exponent: options.exponent.0,
        mass: options.mass.0,
    };
    let bar = Bar::new("contact", common.outlets.quiet);
    let answer = keys.answer(graze.as_ref(), &bar)?;
    drop(bar);
    deliver(answer, "contact", &common.outlets)
}

/// Derivatives of a state after hits.
pub(in crate::cli) fn derivatives(options: &DerivativesArguments) -> Result<(), CliError> {
    let source = open(&options.scene)?;
    let keys = DerivativesKeys {
        start: options.start.clone().unwrap_or_default(),
        at: options.time.map(|Positive(time)| time),
        returns: options.returns,
        parameters: Some(options.parameters.clone()).filter(|names| !names.is_empty()),
        order: options.order,
    };
    let outlets = &options.scene.common.outlets;
    let bar = Bar::new("derivatives", outlets.quiet);
    let answer = keys.answer(source.scene(), &bar)?;
    drop(bar);
    deliver(answer, "derivatives", outlets)
}

pub(in crate::cli) fn trajectory(options: &TrajectoryArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let origin = Origin::new(settled.graze(), options.counting);
    let keys = TrajectoryKeys {
        at: origin.named(options.at.as_ref()),
        start: origin.named(options.start.as_ref()),
        itinerary: options.itinerary.clone(),
        settle: options.settle,
        periods: options.periods,
        samples: options.samples,
    };
    let bar = Bar::new("trajectory", outlets.quiet);
    if let Some(order) = options.derivatives {
        return deliver(keys.derivatives(&settled, order, &bar)?, "trajectory", outlets);
    }
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

pub(in crate::cli) fn noise(options: &NoiseArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let contacts = Contacts::unless(options.method == Method::Direct, Contacts::Unused);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let origin = Origin::new(map.settled().graze(), options.counting);
    let keys = NoiseKeys {
        deviations: options.deviation.clone(),
        at: origin.named(options.at.as_ref()),
        law: options.law,
        start: origin.named(options.start.as_ref()),
        orbits: options.orbits as usize,
        transient: options.transient as usize,
        keep: options.keep as usize,
        range: options.range.as_ref().map(|ranges| ranges.offsets(&origin)).unwrap_or_default(),
        cells: options.cells as usize,
        seed: options.seed,
        method: options.method,
    };
    let bar = Bar::new("noise", outlets.quiet);
    let answer = keys.answer(&map, &bar)?;
    drop(bar);
    deliver(answer, "noise", outlets)
}

pub(in crate::cli) fn fit(options: &FitArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    if is_standard(&options.scene.scene) && is_standard(&options.data) {
        return Err(CliError::StandardInputTwice);
    }
    let contacts = Contacts::unless(options.method == Method::Direct, Contacts::Unused);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let origin = Origin::new(map.settled().graze(), options.counting);
    let keys = FitKeys {
        parameters: options.parameters.clone(),
        at: origin.named(options.at.as_ref()),
        noise: options.noise.clone().unwrap_or_default(),
        piece: options.piece as usize,
        withheld: options.withheld as usize,
        method: options.method,
    };
    let series = measured_series(&options.data, map.local())?;
    let bar = Bar::new("fit", outlets.quiet);
    let answer = keys.answer(&map, series, &bar)?;
    drop(bar);
    deliver(answer, "fit", outlets)
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
