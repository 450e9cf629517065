//! `grazemap chart`: two-parameter charts.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::{Results, stem};
use super::prepare::{grazing_orbit, prepare, settle};
use super::progress::Bar;
use super::window_edge::{ByMap, local_map};
use grazemap::analysis::Progress;
use grazemap::analysis::chart::{Chart, chart};
use grazemap::expansion::{LocalMap, WindowEdge};
use grazemap::model::Scene;
use grazemap::orbit::GrazingOrbit;
use grazemap::report::{
    ReportError, SectionDocument, chart_array, chart_figure, chart_table, chart_timing_table,
    to_dense_json,
};

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let scene = prepare(options)?.scene;
    if scene.charts.is_empty() {
        return Err(CliError::NoChart);
    }
    let orbit = grazing_orbit(&scene)?;
    let settled = settle(&scene, &orbit, options.common.quiet)?;
    let (map, edges) = local_map(&settled, options.common.quiet)?;
    let bar = Bar::new("chart", &options.common);
    let charts = charts(&settled.scene, &settled.orbit, &map, &bar)?;
    drop(bar);
    let section = SectionDocument::settled(&settled);
    let untimed: Vec<Chart> = charts.iter().map(Chart::without_timing).collect();
    let results = Results {
        text: chart_timing_table(&charts)?.to_text(),
        json: to_dense_json(&ByMap::each(&charts, &edges, &section))?,
        csv: Some(chart_table(&charts)?.to_csv()?),
        files: chart_files(&untimed, &edges, &section)?,
    };
    results.deliver("chart", &options.common)
}

/// Every chart a scene asks for.
pub(super) fn charts(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    progress: &dyn Progress,
) -> Result<Vec<Chart>, CliError> {
    let compute = |request| Ok(chart(scene, orbit, map, request, progress)?);
    scene.charts.iter().map(compute).collect()
}

/// Data and pictures of charts, without times: the same bytes from run to run.
pub(super) fn chart_files(
    charts: &[Chart],
    edges: &[WindowEdge],
    section: &SectionDocument,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let mut files = vec![
        (
            "chart.json".to_owned(),
            to_dense_json(&ByMap::each(charts, edges, section))?.into_bytes(),
        ),
        (
            "chart.csv".to_owned(),
            chart_table(charts)?.to_csv()?.into_bytes(),
        ),
    ];
    for (number, chart) in charts.iter().enumerate() {
        let stem = stem("chart", number, charts.len());
        let figure = chart_figure(chart);
        files.push((format!("{stem}.npy"), chart_array(chart)?));
        files.push((format!("{stem}.svg"), figure.to_svg()?.into_bytes()));
        files.push((format!("{stem}.png"), figure.to_png()?));
    }
    Ok(files)
}
