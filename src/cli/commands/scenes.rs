//! Commands that need no computing: `grazemap check` and `new`, for scenes; `completions` and
//! `man`, for the shell and `man`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::CommandFactory;
use serde::Serialize;

use super::{open, refuse_orders};
use crate::cli::arguments::{Arguments, CompletionsOptions, ManOptions, NewOptions, SceneOptions};
use crate::cli::output::{CliError, deliver, note, print, refuse};
use grazemap::Error;
use grazemap::analysis::{charts_bytes, diagrams_bytes};
use grazemap::model::{Digest, Scene, catalogue, nearest};
use grazemap::pipeline::Answer;
use grazemap::report::{Named, OutputFolder, to_json, write_atomically};

/// Contents of a checked scene.
#[derive(Debug, Serialize)]
struct SceneSummary<'a> {
    scene: &'a str,
    digest: Digest,
    model: &'a str,
    states: &'a [String],
    phase: Option<&'a str>,
    parameters: Vec<&'a str>,
    surfaces: Vec<&'a str>,
    active: Vec<&'a str>,
    window: Named<Option<f64>>,
    diagrams: usize,
    charts: usize,
    warnings: &'a [String],
}

/// Runs `grazemap check`: parses and checks a scene.
pub(in crate::cli) fn check(options: &SceneOptions) -> Result<(), CliError> {
    let source = open(options)?;
    let scene = source.scene();
    refuse_orders(scene)?;
    let faults = [scene.check_diagrams(), scene.check_charts(), scene.check_tangent_states()];
    faults.into_iter().collect::<Result<(), _>>().map_err(Error::from)?;
    let outlets = &options.common.outlets;
    refuse(diagrams_bytes(scene).saturating_add(charts_bytes(scene)), outlets.quiet)?;
    let (name, summary) = (options.scene.display(), SceneSummary::new(source.scene()));
    let text = format!("{name}: no fault found\n{}\n", summary.words());
    deliver(&mut Answer::without_table("check", text, to_json(&summary)?), outlets)
}

impl<'a> SceneSummary<'a> {
    fn new(scene: &'a Scene) -> Self {
        let model = &scene.model;
        let parameter = |&index: &usize| model.parameters[index].name.as_str();
        Self {
            scene: &scene.identifier,
            digest: scene.digest,
            model: &model.name,
            states: &model.states,
            phase: model.phase.as_ref().map(|phase| phase.name.as_str()),
            parameters: model.parameters.iter().map(|parameter| parameter.name.as_str()).collect(),
            surfaces: model.surfaces.iter().map(|surface| surface.name.as_str()).collect(),
            active: scene.expansion.active.iter().map(parameter).collect(),
            window: stated_window(scene),
            diagrams: scene.diagrams.len(),
            charts: scene.charts.len(),
            warnings: &scene.warnings,
        }
    }

    fn window_words(&self) -> String {
        let stated = self.window.0.iter().filter_map(|(name, bound)| {
            let bound = (*bound)?;
            Some(match name.as_str() {
                "depth" => format!("y^2 <= {bound:e}"),
                _ => format!("{name} ± {bound:e}"),
            })
        });
        let stated: Vec<String> = stated.collect();
        let stated = if stated.is_empty() { "open".to_owned() } else { stated.join(", ") };
        format!("{stated}; `expand` measures open bounds and the map's errors")
    }

    fn words(&self) -> String {
        let phase = self.phase.map_or("none".to_owned(), str::to_owned);
        format!(
            "  model       {}\n  states      {}\n  phase       {phase}\n  parameters  {}\n  \
                surfaces    {}\n  active      {}\n  window      {}\n  diagrams    {}\n  \
                charts      {}",
            self.model,
            self.states.join(", "),
            self.parameters.join(", "),
            self.surfaces.join(", "),
            self.active.join(", "),
            self.window_words(),
            self.diagrams,
            self.charts,
        )
    }
}

/// Window of a scene as bounds by name: depth `y²`, full state, active parameters. A bound is
/// `None` if the scene leaves it open.
fn stated_window(scene: &Scene) -> Named<Option<f64>> {
    let (model, window) = (&scene.model, &scene.window);
    let phase = model.phase.iter().map(|phase| &phase.name);
    let states = model.states.iter().chain(phase).cloned().zip(window.state.iter().copied());
    let active =
        scene.expansion.active.iter().map(|&parameter| {
            (model.parameters[parameter].name.clone(), window.parameter[parameter])
        });
    let depth = [("depth".to_owned(), window.depth)].into_iter();
    let bounds = depth.chain(states).chain(active);
    Named::new(bounds.map(|(name, bound)| (name, bound.is_finite().then_some(bound))))
}

/// Runs `grazemap new`: copies a scene of the catalogue to a file, or lists the catalogue.
pub(in crate::cli) fn new(options: &NewOptions) -> Result<(), CliError> {
    match &options.name {
        Some(name) if !options.list => write(name, options),
        _ => print(&list()),
    }
}

/// Names and summaries of the catalogue's scenes, one a line.
fn list() -> String {
    let width = catalogue::names().map(str::len).max().unwrap_or(0);
    catalogue::names().fold(String::new(), |mut text, name| {
        let summary = catalogue::summary(name).unwrap_or_default();
        let _infallible = writeln!(text, "{name:width$}  {summary}");
        text
    })
}

fn write(name: &str, options: &NewOptions) -> Result<(), CliError> {
    let text = catalogue::text(name).ok_or_else(|| CliError::NotInCatalogue {
        name: name.to_owned(),
        nearest: nearest(name, catalogue::names()),
    })?;
    let path = options.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    if path.as_os_str() == "-" {
        return print(text);
    }
    if path.symlink_metadata().is_ok() {
        return Err(CliError::Exists { path });
    }
    write_atomically(&path, text.as_bytes())?;
    if !options.quiet {
        let path = path.display();
        note(&format!("wrote {path}; edit it, then: grazemap check {path}"));
    }
    Ok(())
}

/// Prints shell completions to standard output.
pub(in crate::cli) fn completions(options: &CompletionsOptions) -> Result<(), CliError> {
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut Arguments::command(), "grazemap", &mut text);
    print(&String::from_utf8_lossy(&text))
}

/// Writes the manual into a folder: one page for the program and one for each command.
pub(in crate::cli) fn man(options: &ManOptions) -> Result<(), CliError> {
    let folder = OutputFolder::create(&options.output)?;
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let commands: Vec<_> = program.get_subcommands().cloned().collect();
    for command in commands.into_iter().chain([program]) {
        let page = clap_mangen::Man::new(command);
        let mut text = Vec::new();
        page.render(&mut text).map_err(CliError::StandardOutput)?;
        folder.write(&page.get_filename(), text)?;
    }
    Ok(())
}
