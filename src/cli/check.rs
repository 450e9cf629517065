//! `grazemap check`: parse and check, no computing.

use serde::Serialize;

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{prepare, refuse_frozen_sweeps};
use grazemap::model::Scene;
use grazemap::report::to_json;

/// What a checked scene holds.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    scene: &'a str,
    digest: String,
    model: &'a str,
    states: &'a [String],
    phase: Option<&'a str>,
    parameters: Vec<&'a str>,
    surfaces: Vec<&'a str>,
    active: Vec<&'a str>,
    diagrams: usize,
    charts: usize,
    warnings: &'a [String],
}

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let loaded = prepare(options)?;
    refuse_frozen_sweeps(&loaded.scene)?;
    let summary = Summary::new(&loaded.scene);
    let text = format!("{}: no fault found\n{}\n", loaded.name, summary.words());
    let results = Results::named("check", text, to_json(&summary)?, None);
    results.deliver("check", &options.common)
}

impl<'a> Summary<'a> {
    fn new(scene: &'a Scene) -> Self {
        let model = &scene.model;
        let parameter = |&index: &usize| model.parameters[index].name.as_str();
        Self {
            scene: &scene.identifier,
            digest: scene.digest.to_string(),
            model: &model.name,
            states: &model.states,
            phase: model.phase.as_ref().map(|phase| phase.name.as_str()),
            parameters: model
                .parameters
                .iter()
                .map(|parameter| parameter.name.as_str())
                .collect(),
            surfaces: model
                .surfaces
                .iter()
                .map(|surface| surface.name.as_str())
                .collect(),
            active: scene.expansion.active.iter().map(parameter).collect(),
            diagrams: scene.diagrams.len(),
            charts: scene.charts.len(),
            warnings: &scene.warnings,
        }
    }

    fn words(&self) -> String {
        let phase = self.phase.map_or("none".to_owned(), str::to_owned);
        format!(
            "  model       {}\n  states      {}\n  phase       {phase}\n  parameters  {}\n  surfaces    {}\n  active      {}\n  diagrams    {}\n  charts      {}",
            self.model,
            self.states.join(", "),
            self.parameters.join(", "),
            self.surfaces.join(", "),
            self.active.join(", "),
            self.diagrams,
            self.charts,
        )
    }
}
