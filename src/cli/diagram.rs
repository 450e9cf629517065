//! `grazemap diagram`: bifurcation diagrams.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::expand::local_map;
use super::output::Results;
use super::prepare::{grazing_orbit, prepare};
use super::progress::Bar;
use crate::analysis::Progress;
use crate::analysis::diagram::{Diagram, diagram};
use crate::expansion::LocalMap;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;
use crate::report::{
    ReportError, diagram_array, diagram_figures, diagram_table, diagram_timing_table, to_dense_json,
};

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let scene = prepare(options)?.scene;
    if scene.diagrams.is_empty() {
        return Err(CliError::NoDiagram);
    }
    let orbit = grazing_orbit(&scene)?;
    let map = local_map(&scene, &orbit)?;
    let bar = Bar::new("diagram", &options.common);
    let diagrams = diagrams(&scene, &orbit, &map, &bar)?;
    drop(bar);
    results(&diagrams)?.deliver("diagram", &options.common)
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

/// The diagrams as text, data and pictures; times only in the text and in the JSON on request.
fn results(diagrams: &[Diagram]) -> Result<Results, CliError> {
    let text = diagram_timing_table(diagrams)?.to_text();
    let csv = diagram_table(diagrams)?.to_csv()?;
    let untimed: Vec<Diagram> = diagrams.iter().map(Diagram::without_timing).collect();
    let json = to_dense_json(diagrams)?;
    Ok(Results {
        text,
        json,
        csv: Some(csv),
        files: diagram_files(&untimed)?,
    })
}

/// Data and pictures of diagrams, without times: the same bytes from run to run.
pub(super) fn diagram_files(diagrams: &[Diagram]) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let mut files = vec![
        (
            "diagram.json".to_owned(),
            to_dense_json(diagrams)?.into_bytes(),
        ),
        (
            "diagram.csv".to_owned(),
            diagram_table(diagrams)?.to_csv()?.into_bytes(),
        ),
    ];
    for (number, diagram) in diagrams.iter().enumerate() {
        let stem = if diagrams.len() == 1 {
            "diagram".to_owned()
        } else {
            format!("diagram-{}", number + 1)
        };
        files.push((format!("{stem}.npy"), diagram_array(diagram)?));
        for (suffix, figure) in diagram_figures(diagram) {
            files.push((format!("{stem}{suffix}.svg"), figure.to_svg()?.into_bytes()));
            files.push((format!("{stem}{suffix}.png"), figure.to_png()?));
        }
    }
    Ok(files)
}
