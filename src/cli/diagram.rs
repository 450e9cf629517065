//! `grazemap diagram`: bifurcation diagrams.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::{Results, note, stem};
use super::prepare::{grazing_orbit, prepare, settle};
use super::progress::Bar;
use super::window_edge::{ByMap, local_map};
use grazemap::analysis::Progress;
use grazemap::analysis::diagram::{Diagram, diagram};
use grazemap::expansion::{LocalMap, WindowEdge};
use grazemap::model::Scene;
use grazemap::orbit::GrazingOrbit;
use grazemap::report::{
    ReportError, SectionDocument, diagram_array, diagram_figures, diagram_table,
    diagram_timing_table, to_dense_json,
};

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let scene = prepare(options)?.scene;
    if scene.diagrams.is_empty() {
        return Err(CliError::NoDiagram);
    }
    let orbit = grazing_orbit(&scene)?;
    let settled = settle(&scene, &orbit, options.common.quiet)?;
    let (map, edges) = local_map(&settled, options.common.quiet)?;
    let bar = Bar::new("diagram", &options.common);
    let diagrams = diagrams(&settled.scene, &settled.orbit, &map, &bar)?;
    drop(bar);
    warn_of_values(&diagrams, options.common.quiet);
    results(&diagrams, &edges, &SectionDocument::settled(&settled))?
        .deliver("diagram", &options.common)
}

/// Every diagram a scene asks for.
pub(super) fn diagrams(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    progress: &dyn Progress,
) -> Result<Vec<Diagram>, CliError> {
    let compute = |request| Ok(diagram(scene, orbit, map, request, progress)?);
    scene.diagrams.iter().map(compute).collect()
}

/// Says where an observable was no finite number: nothing is drawn there.
pub(super) fn warn_of_values(diagrams: &[Diagram], quiet: bool) {
    for diagram in diagrams.iter().filter(|_| !quiet) {
        let points = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
        let values = points.flat_map(|point| point.kept_values());
        let lost = values.clone().filter(|value| !value.is_finite()).count();
        if lost > 0 {
            note(&format!(
                "warning: `{}` over {} is not finite at {lost} of {} iterates; nothing is drawn there",
                diagram.observable,
                diagram.parameter,
                values.count()
            ));
        }
    }
}

/// The diagrams as text, data and pictures; times only in the text and in the JSON on request.
fn results(
    diagrams: &[Diagram],
    edges: &[WindowEdge],
    section: &SectionDocument,
) -> Result<Results, CliError> {
    let text = diagram_timing_table(diagrams)?.to_text();
    let csv = diagram_table(diagrams)?.to_csv()?;
    let untimed: Vec<Diagram> = diagrams.iter().map(Diagram::without_timing).collect();
    let json = to_dense_json(&ByMap::each(diagrams, edges, section))?;
    Ok(Results {
        text,
        json,
        csv: Some(csv),
        files: diagram_files(&untimed, edges, section)?,
    })
}

/// Data and pictures of diagrams, without times: the same bytes from run to run.
pub(super) fn diagram_files(
    diagrams: &[Diagram],
    edges: &[WindowEdge],
    section: &SectionDocument,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let mut files = vec![
        (
            "diagram.json".to_owned(),
            to_dense_json(&ByMap::each(diagrams, edges, section))?.into_bytes(),
        ),
        (
            "diagram.csv".to_owned(),
            diagram_table(diagrams)?.to_csv()?.into_bytes(),
        ),
    ];
    for (number, diagram) in diagrams.iter().enumerate() {
        let stem = stem("diagram", number, diagrams.len());
        files.push((format!("{stem}.npy"), diagram_array(diagram)?));
        for (suffix, figure) in diagram_figures(diagram) {
            files.push((format!("{stem}{suffix}.svg"), figure.to_svg()?.into_bytes()));
            files.push((format!("{stem}{suffix}.png"), figure.to_png()?));
        }
    }
    Ok(files)
}
