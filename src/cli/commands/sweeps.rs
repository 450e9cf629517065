//! `grazemap diagram` and `grazemap chart`: bifurcation diagrams, two-parameter charts.

use serde::Serialize;

use super::{map, open, remark_on_window};
use crate::cli::arguments::SceneOptions;
use crate::cli::output::{Bar, CliError, Results, note, stem};
use grazemap::Map;
use grazemap::analysis::chart::Chart;
use grazemap::analysis::diagram::Diagram;
use grazemap::convergence::MeasuredWindow;
use grazemap::expansion::WindowEdge;
use grazemap::report::{
    DocumentKind, Figure, ReportError, SectionDocument, chart_array, chart_figure, chart_table,
    chart_timing_table, diagram_array, diagram_figures, diagram_table, diagram_timing_table,
    to_json,
};

/// Bifurcation diagrams.
pub(in crate::cli) fn diagram(options: &SceneOptions) -> Result<(), CliError> {
    let (source, outlets) = (open(options)?, &options.common.outlets);
    if source.scene().diagrams.is_empty() {
        return Err(CliError::NoDiagram);
    }
    let map = map(source, outlets.quiet)?;
    let diagrams = map.diagrams(&Bar::new("diagram", outlets.quiet))?;
    remark_on_window(&map, outlets.quiet);
    warn_of_values(&diagrams, outlets.quiet);
    let results = Results {
        text: diagram_timing_table(&diagrams)?.to_text(),
        json: to_json(&ByMap::each(DocumentKind::Diagram, &diagrams, &map))?,
        csv: Some(diagram_table(&diagrams)?.to_csv()?),
        files: diagram_files(&diagrams, &map)?,
    };
    results.deliver("diagram", outlets)
}

/// Two-parameter charts.
pub(in crate::cli) fn chart(options: &SceneOptions) -> Result<(), CliError> {
    let (source, outlets) = (open(options)?, &options.common.outlets);
    if source.scene().charts.is_empty() {
        return Err(CliError::NoChart);
    }
    let map = map(source, outlets.quiet)?;
    let charts = map.charts(&Bar::new("chart", outlets.quiet))?;
    remark_on_window(&map, outlets.quiet);
    let results = Results {
        text: chart_timing_table(&charts)?.to_text(),
        json: to_json(&ByMap::each(DocumentKind::Chart, &charts, &map))?,
        csv: Some(chart_table(&charts)?.to_csv()?),
        files: chart_files(&charts, &map)?,
    };
    results.deliver("chart", outlets)
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

/// Data and pictures of diagrams, without times: the same bytes from run to run.
pub(super) fn diagram_files(
    diagrams: &[Diagram],
    map: &Map,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let untimed: Vec<Diagram> = diagrams.iter().map(Diagram::without_timing).collect();
    let json = to_json(&ByMap::each(DocumentKind::Diagram, &untimed, map))?;
    let csv = diagram_table(&untimed)?.to_csv()?;
    let mut files = vec![
        ("diagram.json".to_owned(), json.into_bytes()),
        ("diagram.csv".to_owned(), csv.into_bytes()),
    ];
    for (number, diagram) in untimed.iter().enumerate() {
        let stem = stem("diagram", number, untimed.len());
        files.push((format!("{stem}.npy"), diagram_array(diagram)?));
        for (suffix, figure) in diagram_figures(diagram) {
            push_figure(&mut files, &format!("{stem}{suffix}"), &figure)?;
        }
    }
    Ok(files)
}

/// Data and pictures of charts, without times: the same bytes from run to run.
pub(super) fn chart_files(
    charts: &[Chart],
    map: &Map,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let untimed: Vec<Chart> = charts.iter().map(Chart::without_timing).collect();
    let json = to_json(&ByMap::each(DocumentKind::Chart, &untimed, map))?;
    let csv = chart_table(&untimed)?.to_csv()?;
    let mut files = vec![
        ("chart.json".to_owned(), json.into_bytes()),
        ("chart.csv".to_owned(), csv.into_bytes()),
    ];
    for (number, chart) in untimed.iter().enumerate() {
        let stem = stem("chart", number, untimed.len());
        files.push((format!("{stem}.npy"), chart_array(chart)?));
        push_figure(&mut files, &stem, &chart_figure(chart))?;
    }
    Ok(files)
}

/// A picture as SVG and PNG.
pub(super) fn push_figure(
    files: &mut Vec<(String, Vec<u8>)>,
    stem: &str,
    figure: &Figure,
) -> Result<(), ReportError> {
    files.push((format!("{stem}.svg"), figure.to_svg()?.into_bytes()));
    files.push((format!("{stem}.png"), figure.to_png()?));
    Ok(())
}

/// What a map was used for, as it is written to JSON.
#[derive(Serialize)]
struct ByMap<'a, T> {
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
        let by_map = |content| Self {
            document,
            format: DocumentKind::FORMAT,
            content,
            window: map.window(),
            window_edges: map.window_edges(),
            section: map.section(),
        };
        contents.iter().map(by_map).collect()
    }
}
