//! `grazemap emit`: the crate of Rust code, or the map in C or CUDA, or whether a folder holds it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{map, open, remark_on_window};
use crate::cli::arguments::{EmitArguments, SceneOptions};
use crate::cli::output::{CliError, Results, counted, print};
use grazemap::convergence::MeasuredWindow;
use grazemap::emission::{EmissionError, EmittedCrate, EmittedModule, Target};
use grazemap::expansion::WindowEdge;
use grazemap::model::{EmitPrecision, catalogue};
use grazemap::numeric::FloatFormat;
use grazemap::pipeline::{EmitRequest, Source};
use grazemap::report::{OutputFolder, SectionDocument, bounds_words, to_json};
use grazemap::{Error, Map};

/// Where the catalogue's crate goes when no folder is named.
const CATALOGUE_FOLDER: &str = "generated";

/// What `--json` says about an emission.
#[derive(Debug, Serialize)]
struct Summary {
    modules: Vec<ModuleSummary>,
    files: Vec<String>,
}

#[derive(Debug, Serialize)]
struct ModuleSummary {
    identifier: String,
    step_multiply_adds: usize,
    frozen_step_multiply_adds: usize,
    frozen_jacobian_multiply_adds: usize,
    precision: FloatFormat,
    measured_error: Option<f64>,
    window: MeasuredWindow,
    window_edges: Vec<WindowEdge>,
    section: SectionDocument,
}

/// A module, and its map.
type Emitted = (EmittedModule, Map);

pub(in crate::cli) fn run(options: &EmitArguments) -> Result<(), CliError> {
    let (modules, emitted) = match &options.scene {
        Some(scene) => {
            let emitted = emit(opened(scene.clone(), options)?, options)?;
            let files = EmittedCrate::standalone(&emitted.0);
            (vec![emitted], files)
        }
        None => {
            let scenes = catalogue::names().map(|name| opened(PathBuf::from(name), options));
            let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
            refuse_single(&scenes)?;
            let all = scenes.into_iter().map(|scene| emit(scene, options));
            let all = all.collect::<Result<Vec<_>, _>>()?;
            let modules: Vec<_> = all.iter().map(|(module, _)| module.clone()).collect();
            (all, EmittedCrate::catalogue(&modules))
        }
    };
    let emitted = emitted.map_err(Error::from)?;
    let default = match options.catalogue {
        true => CATALOGUE_FOLDER,
        false => folder_of(options.target.into()),
    };
    let mut outlets = options.common.outlets.clone();
    let folder = outlets.output.take().unwrap_or_else(|| PathBuf::from(default));
    if options.check {
        return check(&emitted, &folder, outlets.quiet);
    }
    OutputFolder::create(&folder)?.write_all(&emitted.files)?;
    modules.iter().for_each(|(_, map)| remark_on_window(map, outlets.quiet));
    let text = text(&modules, &emitted, &folder);
    let json = to_json(&summary(modules, &emitted))?;
    Results::named("emit", text, json, None).deliver("emit", &outlets)
}

/// Where an emission goes when no folder is named.
fn folder_of(target: Target) -> &'static str {
    match target {
        Target::Rust => "out/crate",
        Target::C => "out/c",
        Target::Cuda => "out/cuda",
    }
}

fn opened(scene: PathBuf, options: &EmitArguments) -> Result<Source, CliError> {
    let common = options.common.clone();
    open(&SceneOptions { scene, common })
}

/// Refuses, before anything is computed, a scene of the catalogue that asks for single precision.
fn refuse_single(scenes: &[Source]) -> Result<(), CliError> {
    let single = EmitPrecision::Given(FloatFormat::F32);
    let mut scenes = scenes.iter().map(Source::scene);
    match scenes.find(|scene| scene.emit.precision == single) {
        None => Ok(()),
        Some(scene) => {
            Err(Error::from(EmissionError::SingleInCatalogue { name: scene.identifier.clone() })
                .into())
        }
    }
}

fn emit(source: Source, options: &EmitArguments) -> Result<Emitted, CliError> {
    let map = map(source, options.common.outlets.quiet)?;
    let module =
        map.module(EmitRequest { target: options.target.into(), measure: !options.no_measure })?;
    Ok((module, map))
}

/// Says how a folder differs from the emission.
fn check(emitted: &EmittedCrate, folder: &Path, quiet: bool) -> Result<(), CliError> {
    let differences = emitted.check(folder);
    if differences.is_empty() {
        let they = match emitted.files.len() {
            1 => "1 file as it".to_owned(),
            count => format!("{count} files as they"),
        };
        let said = format!("{}: {they} would be emitted now\n", folder.display());
        return if quiet { Ok(()) } else { print(&said) };
    }
    let list: Vec<String> =
        differences.iter().map(|difference| format!("\n  {difference}")).collect();
    Err(CliError::NotCurrent { folder: folder.to_owned(), differences: list.concat() })
}

fn summary(modules: Vec<Emitted>, emitted: &EmittedCrate) -> Summary {
    let module = |(module, map): Emitted| ModuleSummary {
        identifier: module.identifier,
        step_multiply_adds: module.step_operations.multiply_adds,
        frozen_step_multiply_adds: module.frozen_operations.multiply_adds,
        frozen_jacobian_multiply_adds: module.jacobian_operations.multiply_adds,
        precision: module.precision,
        measured_error: module.measured_error,
        window: map.window().clone(),
        window_edges: map.window_edges().to_vec(),
        section: map.section(),
    };
    Summary {
        modules: modules.into_iter().map(module).collect(),
        files: emitted.files.keys().cloned().collect(),
    }
}

fn text(modules: &[Emitted], emitted: &EmittedCrate, folder: &Path) -> String {
    let mut text =
        format!("wrote {} to {}\n", counted(emitted.files.len(), "file"), folder.display());
    for (module, map) in modules {
        let (step, frozen) = (module.step_operations, module.frozen_operations);
        text.push_str(&format!(
            "  {}: {} multiply-adds a step, {} with the parameters frozen{}\n",
            module.identifier,
            step.multiply_adds,
            frozen.multiply_adds,
            match module.precision {
                FloatFormat::F32 => ", in single precision",
                FloatFormat::F64 => "",
            }
        ));
        if let Some(error) = module.measured_error {
            text.push_str(&format!(
                "    within {error:.1e} of direct simulation at {} points of the window: {}\n",
                map.window().sample.points,
                bounds_words(map.window())
            ));
        }
    }
    text
}
