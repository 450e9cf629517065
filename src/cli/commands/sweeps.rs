//! `grazemap diagram` and `grazemap chart`: bifurcation diagrams, two-parameter charts.

use std::path::Path;

use serde::Serialize;

use super::{map, open, remark_on_window};
use crate::cli::arguments::SceneOptions;
use crate::cli::memory::refuse_memory;
use crate::cli::output::{Bar, CliError, note, pairs, stem};
use crate::cli::resume::Resumable;
use grazemap::analysis::chart::{Chart, chart_bytes};
use grazemap::analysis::diagram::{Diagram, Timing, diagram_bytes};
use grazemap::convergence::MeasuredWindow;
use grazemap::expansion::WindowEdge;
use grazemap::report::{
    DocumentKind, Figure, OutputFolder, ReportError, SectionDocument, chart_array, chart_figure,
    chart_outside_words, chart_overlay_words, chart_rows, chart_timing_table, diagram_array,
    diagram_figures, diagram_outside_words, diagram_rows, diagram_timing_table, to_json,
    write_json,
};
use grazemap::{Error, Map};

/// Bifurcation diagrams.
pub(in crate::cli) fn diagram(options: &SceneOptions) -> Result<(), CliError> {
    let (source, outlets) = (open(options)?, &options.common.outlets);
    if source.scene().diagrams.is_empty() {
        return Err(CliError::NoDiagram);
    }
    source.scene().check_diagrams().map_err(Error::from)?;
    refuse_memory(diagram_bytes(source.scene()), outlets.quiet)?;
    let map = map(source, outlets.quiet)?;
    let resumable = resumable("diagram", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("diagram", outlets.quiet).resuming(0, resumable.journal());
    let mut diagrams = map.diagrams(&bar)?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    warn_of_values(&diagrams, outlets.quiet);
    warn_of_windows(&diagrams, &[], outlets.quiet);
    let text = diagram_timing_table(&diagrams)?.to_text();
    outlets.write_json(&|out| write_json(out, &diagram_documents(&diagrams, &map)))?;
    outlets.write_csv(&|out| diagram_rows(&diagrams).write_csv(out))?;
    if let Some(folder) = &outlets.output {
        take_diagram_times(&mut diagrams);
        write_diagrams(&OutputFolder::create(folder)?, &diagrams, &map)?;
    }
    resumable.finish();
    outlets.show(&text)
}

/// Two-parameter charts.
pub(in crate::cli) fn chart(options: &SceneOptions) -> Result<(), CliError> {
    let (source, outlets) = (open(options)?, &options.common.outlets);
    if source.scene().charts.is_empty() {
        return Err(CliError::NoChart);
    }
    source.scene().check_charts().map_err(Error::from)?;
    refuse_memory(chart_bytes(source.scene()), outlets.quiet)?;
    let map = map(source, outlets.quiet)?;
    let resumable = resumable("chart", outlets.folder(), &map, "", outlets.quiet)?;
    let bar = Bar::new("chart", outlets.quiet).resuming(0, resumable.journal());
    let mut charts = map.charts(&bar)?;
    drop(bar);
    remark_on_window(&map, outlets.quiet);
    warn_of_windows(&[], &charts, outlets.quiet);
    let mut text = chart_timing_table(&charts)?.to_text();
    for words in charts.iter().filter_map(chart_overlay_words) {
        text.push_str(&format!("{words}\n"));
    }
    outlets.write_json(&|out| write_json(out, &chart_documents(&charts, &map)))?;
    outlets.write_csv(&|out| chart_rows(&charts).write_csv(out))?;
    if let Some(folder) = &outlets.output {
        take_chart_times(&mut charts);
        write_charts(&OutputFolder::create(folder)?, &charts, &map)?;
    }
    resumable.finish();
    outlets.show(&text)
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

/// Says where an observable was no finite number: nothing is drawn there.
pub(super) fn warn_of_values(diagrams: &[Diagram], quiet: bool) {
    for diagram in diagrams.iter().filter(|_| !quiet) {
        let points = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
        let values = points.flat_map(|point| point.kept_values());
        let lost = values.clone().filter(|value| !value.is_finite()).count();
        if lost > 0 {
            note(&format!(
                "warning: `{}` over {} is not finite at {lost} of {} iterates; nothing is drawn \
                    there",
                diagram.observable,
                diagram.parameter,
                values.count()
            ));
        }
    }
}

/// Says where the map alone was used beyond its window.
pub(super) fn warn_of_windows(diagrams: &[Diagram], charts: &[Chart], quiet: bool) {
    let diagrams = diagrams.iter().filter_map(diagram_outside_words);
    let words = diagrams.chain(charts.iter().filter_map(chart_outside_words));
    words.filter(|_| !quiet).for_each(|words| note(&format!("warning: {words}")));
}

/// Takes the times out of diagrams, which then hold the same from run to run.
pub(super) fn take_diagram_times(diagrams: &mut [Diagram]) {
    diagrams.iter_mut().for_each(Diagram::take_timing);
}

/// Takes the times out of charts, which then hold the same from run to run.
pub(super) fn take_chart_times(charts: &mut [Chart]) {
    charts.iter_mut().for_each(|chart| chart.timing = Timing::default());
}

/// Writes data and pictures of diagrams without times: the same bytes from run to run.
pub(super) fn write_diagrams(
    folder: &OutputFolder,
    diagrams: &[Diagram],
    map: &Map,
) -> Result<(), ReportError> {
    folder
        .write_streamed("diagram.json", |out| write_json(out, &diagram_documents(diagrams, map)))?;
    folder.write_streamed("diagram.csv", |out| diagram_rows(diagrams).write_csv(out))?;
    for (number, diagram) in diagrams.iter().enumerate() {
        let stem = stem("diagram", number, diagrams.len());
        folder.write(&format!("{stem}.npy"), diagram_array(diagram)?)?;
    }
    for (number, diagram) in diagrams.iter().enumerate() {
        let stem = stem("diagram", number, diagrams.len());
        for (suffix, figure) in diagram_figures(diagram) {
            folder.write_all(pairs(&pictures(&format!("{stem}{suffix}"), &figure)))?;
        }
    }
    Ok(())
}

/// Writes data and pictures of charts without times: the same bytes from run to run.
pub(super) fn write_charts(
    folder: &OutputFolder,
    charts: &[Chart],
    map: &Map,
) -> Result<(), ReportError> {
    folder.write_streamed("chart.json", |out| write_json(out, &chart_documents(charts, map)))?;
    folder.write_streamed("chart.csv", |out| chart_rows(charts).write_csv(out))?;
    for (number, chart) in charts.iter().enumerate() {
        let stem = stem("chart", number, charts.len());
        folder.write(&format!("{stem}.npy"), chart_array(chart)?)?;
    }
    for (number, chart) in charts.iter().enumerate() {
        let stem = stem("chart", number, charts.len());
        folder.write_all(pairs(&pictures(&stem, &chart_figure(chart))))?;
    }
    Ok(())
}

/// A picture as SVG and PNG. One that cannot be drawn costs no data: that is said instead.
pub(super) fn pictures(stem: &str, figure: &Figure) -> Vec<(String, Vec<u8>)> {
    let svg = || figure.to_svg().map(String::into_bytes);
    let drawn = [("svg", svg()), ("png", figure.to_png())];
    let picture = |(ending, bytes): (&str, Result<Vec<u8>, _>)| match bytes {
        Ok(bytes) => Some((format!("{stem}.{ending}"), bytes)),
        Err(error) => {
            note(&format!("warning: {stem}.{ending} is not written: {error}"));
            None
        }
    };
    drawn.into_iter().filter_map(picture).collect()
}

fn diagram_documents<'a>(diagrams: &'a [Diagram], map: &'a Map) -> Vec<ByMap<'a, Diagram>> {
    ByMap::each(DocumentKind::Diagram, diagrams, map)
}

fn chart_documents<'a>(charts: &'a [Chart], map: &'a Map) -> Vec<ByMap<'a, Chart>> {
    ByMap::each(DocumentKind::Chart, charts, map)
}

/// What a map was used for, as it is written to JSON.
#[derive(Serialize)]
pub(super) struct ByMap<'a, T> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    content: &'a T,
    /// The window of the map, measured.
    window: &'a MeasuredWindow,
    /// What the contacts of the map leave out at the edge of the window, by passage.
    window_edges: &'a [WindowEdge],
    /// The section that it is on.
    section: SectionDocument,
}

impl<'a, T> ByMap<'a, T> {
    /// All that one map was used for.
    fn each(document: DocumentKind, contents: &'a [T], map: &'a Map) -> Vec<Self> {
        contents.iter().map(|content| Self::new(document, content, map)).collect()
    }

    /// What one map was used for.
    pub(super) fn new(document: DocumentKind, content: &'a T, map: &'a Map) -> Self {
        Self {
            document,
            format: DocumentKind::FORMAT,
            content,
            window: map.window(),
            window_edges: map.window_edges(),
            section: map.section(),
        }
    }
}
