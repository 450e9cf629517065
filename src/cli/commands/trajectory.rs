//! `grazemap trajectory`: time series and phase portraits by direct simulation.

use std::cell::Cell;

use super::orbits::{ACTIVE, COORDINATES, named_offsets, searched};
use super::sweeps::pictures;
use super::{open, settle};
use crate::cli::arguments::{SAMPLES, TrajectoryArguments};
use crate::cli::output::{Bar, CliError, Outlets, Results, counted, note};
use grazemap::Error;
use grazemap::analysis::orbits::{OrbitsRequest, orbits};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{EarlyEnd, TimeSeries, TimeSeriesRequest, each_moment, time_series};
use grazemap::pipeline::Settled;
use grazemap::report::{
    CsvStream, Document, DocumentKind, TimeSeriesListing, time_series_columns, time_series_figures,
    time_series_row, time_series_table, to_json,
};

pub(in crate::cli) fn run(options: &TrajectoryArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let request = request(options, &settled)?;
    if outlets.csv.is_some() && outlets.json.is_none() && outlets.output.is_none() {
        return stream(&settled, &request, outlets);
    }
    let series = time_series(settled.scene(), settled.orbit(), &request).map_err(Error::from)?;
    let early_end = series.early_end;
    let results = results(&settled, &(request, series))?;
    results.deliver("trajectory", outlets)?;
    judge(early_end)
}

/// The grazing orbit over a period.
pub(super) fn grazing_series(
    settled: &Settled,
) -> Result<(TimeSeriesRequest, TimeSeries), CliError> {
    let request = TimeSeriesRequest {
        start: vec![0.0; settled.orbit().section.coordinates.len()],
        parameters: vec![0.0; settled.scene().expansion.active.len()],
        settle: 0,
        returns: 1,
        samples: SAMPLES as usize,
    };
    let series = time_series(settled.scene(), settled.orbit(), &request).map_err(Error::from)?;
    Ok((request, series))
}

/// Data and pictures of a series.
pub(super) fn trajectory_files(
    settled: &Settled,
    series: &(TimeSeriesRequest, TimeSeries),
) -> Result<Vec<(String, Vec<u8>)>, CliError> {
    Ok(results(settled, series)?.files)
}

fn results(
    settled: &Settled,
    (request, series): &(TimeSeriesRequest, TimeSeries),
) -> Result<Results, CliError> {
    let (scene, orbit) = (settled.scene(), settled.orbit());
    let listing = TimeSeriesListing::new(scene, settled.section(), request, series);
    let json = to_json(&Document::new(DocumentKind::Trajectory, scene, listing))?;
    let csv = time_series_table(&scene.model, series)?.to_csv()?;
    let mut results = Results::named("trajectory", text(settled, series), json, Some(csv));
    for (ending, figure) in time_series_figures(scene, orbit, series) {
        results.files.extend(pictures(&format!("trajectory{ending}"), &figure));
    }
    Ok(results)
}

/// Writes the table row by row, as the rows are simulated.
fn stream(
    settled: &Settled,
    request: &TimeSeriesRequest,
    outlets: &Outlets,
) -> Result<(), CliError> {
    let model = &settled.scene().model;
    let ended = Cell::new(None);
    outlets.write_csv(&|out| {
        let mut table = CsvStream::new(out, &time_series_columns(model))?;
        let mut written = Ok(());
        ended.set(Some(each_moment(settled.scene(), settled.orbit(), request, &mut |point| {
            if written.is_ok() {
                written = table.push(&time_series_row(model, &point));
            }
        })));
        written.and_then(|()| table.finish())
    })?;
    match ended.into_inner() {
        Some(ran) => judge(ran.map_err(Error::from)?.early_end),
        None => Ok(()),
    }
}

/// What the options ask for, in numbers.
fn request(
    options: &TrajectoryArguments,
    settled: &Settled,
) -> Result<TimeSeriesRequest, CliError> {
    let scene = settled.scene();
    let active = scene.expansion.active.iter();
    let active: Vec<&str> =
        active.map(|&parameter| scene.model.parameters[parameter].name.as_str()).collect();
    let parameters = match &options.at {
        Some(named) => named_offsets("--at", ACTIVE, named, &active)?,
        None => vec![0.0; active.len()],
    };
    let coordinates = settled.orbit().section_coordinates(scene);
    let coordinates: Vec<&str> = coordinates.into_iter().map(|(name, _)| name).collect();
    let mut request = TimeSeriesRequest {
        start: vec![0.0; coordinates.len()],
        parameters,
        settle: options.settle as usize,
        returns: options.periods as usize,
        samples: options.samples as usize,
    };
    if let Some(named) = &options.start {
        request.start = named_offsets("--start", COORDINATES, named, &coordinates)?;
    }
    if let Some(digits) = &options.itinerary {
        let quiet = options.scene.common.outlets.quiet;
        let (start, returns) = periodic_start(digits, settled, &request.parameters, quiet)?;
        request.start = start;
        request.returns *= returns;
    }
    Ok(request)
}

/// The first point of a physical orbit by its itinerary, by direct simulation, and its returns.
fn periodic_start(
    digits: &str,
    settled: &Settled,
    parameters: &[f64],
    quiet: bool,
) -> Result<(Vec<f64>, usize), CliError> {
    let map = settled.clone().plan()?.expand()?;
    let itinerary = ContactItinerary::parse(digits, map.local().passages())?;
    let returns = itinerary.returns().len();
    let request = OrbitsRequest {
        itineraries: vec![itinerary],
        at: vec![parameters.to_vec()],
        direct: true,
        far: true,
        loci: None,
    };
    let progress = Bar::new("orbits", quiet);
    let found = orbits(map.scene(), map.orbit(), map.local(), &request, &progress);
    let found = found.map_err(Error::from)?;
    let first = found.orbits.first().and_then(|orbit| orbit.states.first());
    let searched = || searched(&map, &found, &request);
    let first = first.ok_or_else(|| CliError::NoOrbits { at: 1, searched: searched() })?;
    if found.orbits.len() > 1 && !quiet {
        let others = counted(found.orbits.len() - 1, "other orbit");
        note(&format!("the first of its itinerary; {others}: `grazemap orbits` lists them"));
    }
    Ok((first.clone(), returns))
}

/// The series as a person reads it: its length and what happens in it.
fn text(settled: &Settled, series: &TimeSeries) -> String {
    let surfaces = &settled.scene().model.surfaces;
    let first = series.points.first().map_or(0.0, |point| point.time);
    let last = series.points.last().map_or(0.0, |point| point.time);
    let mut text = format!(
        "trajectory of `{}` from t = {first:.6} to {last:.6} in {}\n",
        settled.scene().identifier,
        counted(series.points.len(), "row")
    );
    for (event, surface, count) in series.event_counts() {
        text.push_str(&format!(
            "{} at `{}`\n",
            counted(count, event.word()),
            surfaces[surface].name
        ));
    }
    text
}

/// A simulation that ended early is mathematics that ended otherwise.
fn judge(early_end: Option<EarlyEnd>) -> Result<(), CliError> {
    early_end.map_or(Ok(()), |end| Err(CliError::TrajectoryEnded(end)))
}
