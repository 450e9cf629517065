//! `grazemap trajectory`: time series and phase portraits by direct simulation.

use std::cell::Cell;

use super::{open, settle};
use crate::cli::arguments::TrajectoryArguments;
use crate::cli::output::{Bar, CliError, Outlets, deliver, note_all};
use grazemap::Error;
use grazemap::analysis::{TimeSeriesRequest, each_moment};
use grazemap::pipeline::{Ended, Settled, TrajectoryKeys};
use grazemap::report::{CsvStream, time_series_columns, time_series_row};

pub(in crate::cli) fn run(options: &TrajectoryArguments) -> Result<(), CliError> {
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
    let bar = Bar::new("orbits", outlets.quiet);
    if outlets.csv.is_some() && outlets.json.is_none() && outlets.output.is_none() {
        let (request, remarks) = keys.request(&settled, &bar)?;
        note_all(&remarks, outlets.quiet);
        return stream(&settled, &request, outlets);
    }
    deliver(keys.answer(&settled, &bar)?, "trajectory", outlets)
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
        Some(ran) => match ran.map_err(Error::from)?.early_end {
            Some(end) => Err(Error::from(Ended::Trajectory(end)).into()),
            None => Ok(()),
        },
        None => Ok(()),
    }
}
