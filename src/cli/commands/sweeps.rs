//! `grazemap diagram` and `grazemap chart`: bifurcation diagrams, two-parameter charts.

use std::path::Path;

use serde::Serialize;

use super::{map, open, remark_on_window, shard};
use crate::cli::arguments::{ChartArguments, SweepArguments};
use crate::cli::output::{Bar, CliError, Outlets, deliver, note_all, refuse};
use crate::cli::resume::Resumable;
use grazemap::analysis::Joining;
use grazemap::analysis::chart::chart_bytes;
use grazemap::analysis::diagram::{Diagram, Timing, diagram_bytes};
use grazemap::pipeline::{Answer, Device};
use grazemap::report::{
    OutputFolder, chart_overlay_words, chart_rows, chart_timing_table, chart_warnings,
    diagram_rows, diagram_timing_table, diagram_warnings, to_json, write_json,
};
use grazemap::{Error, Map};

/// Bifurcation diagrams.
pub(in crate::cli) fn diagram(options: &SweepArguments) -> Result<(), CliError> {
    let common = &options.scene.common;
    let (source, outlets) = (open(&options.scene)?, &common.outlets);
    if source.scene().diagrams.is_empty() {
        return Err(CliError::NoDiagram);
    }
    source.scene().check_diagrams().map_err(Error::from)?;
    refuse(diagram_bytes(source.scene()), outlets.quiet)?;
    let map = map(source, outlets.quiet)?;
    if let Some(share) = options.sharding.share {
        return shard(share, ("diagram", &map, ""), outlets, |shard| map.share_diagrams(shard));
    }
    let resumable = resumable("diagram", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("diagram", outlets.quiet).resuming(0, resumable.journal());
    let mut diagrams = map.diagrams(&Joining::new(&bar, common.pieces()))?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    note_all(&diagram_warnings(&diagrams), outlets.quiet);
    let text = diagram_timing_table(&diagrams)?.to_text();
    outlets.write_json(&|out| write_json(out, &map.diagram_documents(&diagrams)))?;
    outlets.write_csv(&|out| diagram_rows(&diagrams).write_csv(out))?;
    if let Some(folder) = &outlets.output {
        diagrams.iter_mut().for_each(Diagram::take_timing);
        note_all(&map.write_diagrams(&OutputFolder::create(folder)?, &diagrams)?, false);
    }
    resumable.finish();
    outlets.show(&text)
}

/// Two-parameter charts.
pub(in crate::cli) fn chart(options: &ChartArguments) -> Result<(), CliError> {
    let device = Device::open(&options.device)?;
    let options = &options.sweep;
    let common = &options.scene.common;
    let (source, outlets) = (open(&options.scene)?, &common.outlets);
    if source.scene().charts.is_empty() {
        return Err(CliError::NoChart);
    }
    source.scene().check_charts().map_err(Error::from)?;
    refuse(chart_bytes(source.scene()), outlets.quiet)?;
    let map = map(source, outlets.quiet)?.on(&device)?;
    if let Some(share) = options.sharding.share {
        return shard(share, ("chart", &map, ""), outlets, |shard| map.share_charts(shard));
    }
    let resumable = resumable("chart", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("chart", outlets.quiet).resuming(0, resumable.journal());
    let mut charts = map.charts(&Joining::new(&bar, common.pieces()))?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    note_all(&chart_warnings(&charts), outlets.quiet);
    let mut text = chart_timing_table(&charts)?.to_text();
    for words in charts.iter().filter_map(chart_overlay_words) {
        text.push_str(&format!("{words}\n"));
    }
    outlets.write_json(&|out| write_json(out, &map.chart_documents(&charts)))?;
    outlets.write_csv(&|out| chart_rows(&charts).write_csv(out))?;
    if let Some(folder) = &outlets.output {
        charts.iter_mut().for_each(|chart| chart.timing = Timing::default());
        note_all(&map.write_charts(&OutputFolder::create(folder)?, &charts)?, false);
    }
    resumable.finish();
    outlets.show(&text)
}

/// A command that answers keys by a map and keeps its finished pieces.
pub(super) fn answered(
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
    // That nothing was found is known once it is written.
    let ended = answer.ended.take();
    deliver(answer, command, outlets)?;
    resumable.finish();
    ended.map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}

/// Keeps the finished pieces of a command that uses a map, and that was asked for more than its
/// scene says, beside its results.
pub(super) fn resumable(
    command: &str,
    folder: Option<&Path>,
    map: &Map,
    asked: &str,
    quiet: bool,
) -> Result<Resumable, CliError> {
    let decisive = [&*map.scene().text, &to_json(map.local())?, asked];
    Ok(Resumable::begin(command, folder, &decisive, quiet))
}
