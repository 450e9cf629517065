//! `grazemap emit`: the crate of Rust code, or whether a folder holds it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::arguments::{EmitArguments, SceneOptions};
use super::error::CliError;
use super::expand::{Expanded, expand};
use super::output::{Results, print};
use super::prepare::{grazing_orbit, map_orders, prepare};
use crate::emission::{EmitOptions, EmittedCrate, EmittedModule, EmittedShape, emitted_module};
use crate::model::{Orders, Scene, Shape, catalogue};
use crate::report::{OutputFolder, to_dense_json};

/// Where a crate goes when no folder is named.
const FOLDER: &str = "out/crate";
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
}

pub(super) fn run(options: &EmitArguments) -> Result<(), CliError> {
    let (modules, emitted) = match &options.scene {
        Some(scene) => {
            let module = emit_scene(&SceneOptions {
                scene: scene.clone(),
                common: options.common.clone(),
            })?;
            let emitted = EmittedCrate::standalone(&module)?;
            (vec![module], emitted)
        }
        None => {
            let modules = catalogue::names()
                .map(|name| emit_named(name, options))
                .collect::<Result<Vec<_>, _>>()?;
            let emitted = EmittedCrate::catalogue(&modules)?;
            (modules, emitted)
        }
    };
    let default = if options.catalogue {
        CATALOGUE_FOLDER
    } else {
        FOLDER
    };
    let folder = options
        .common
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(default));
    if options.check {
        return check(&emitted, &folder, options.common.quiet);
    }
    write_crate(&emitted, &folder)?;
    let text = text(&modules, &emitted, &folder);
    let mut common = options.common.clone();
    common.output = None;
    Results::named(
        "emit",
        text,
        to_dense_json(&summary(&modules, &emitted))?,
        None,
    )
    .deliver("emit", &common)
}

fn emit_named(name: &str, options: &EmitArguments) -> Result<EmittedModule, CliError> {
    emit_scene(&SceneOptions {
        scene: PathBuf::from(name),
        common: options.common.clone(),
    })
}

fn emit_scene(options: &SceneOptions) -> Result<EmittedModule, CliError> {
    let scene = prepare(options)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let expanded = expand(
        &scene,
        &orbit,
        map_orders(&scene, &orbit)?,
        options.common.quiet,
    )?;
    emit(&scene, &expanded)
}

/// The module of an expanded scene, in the shape it asks for.
pub(super) fn emit(scene: &Scene, expanded: &Expanded) -> Result<EmittedModule, CliError> {
    let tolerance = match scene.expansion.orders {
        Orders::Fixed { .. } => None,
        Orders::Tolerance(tolerance) => Some(tolerance),
    };
    let shaped = |shape| {
        let options = EmitOptions {
            shape,
            lanes: scene.emit.lanes,
            tolerance,
            measured_error: None,
        };
        emitted_module(&expanded.map, Some(&expanded.composed), &options)
    };
    let module = match scene.emit.shape {
        Shape::Factored | Shape::Flown => shaped(EmittedShape::Factored)?,
        Shape::Composed => shaped(EmittedShape::Composed)?,
        Shape::Auto => {
            let (factored, composed) = (
                shaped(EmittedShape::Factored)?,
                shaped(EmittedShape::Composed)?,
            );
            if composed.frozen_operations.total() < factored.frozen_operations.total() {
                composed
            } else {
                factored
            }
        }
    };
    Ok(module)
}

/// Writes the files of a crate, each whole or not at all.
pub(super) fn write_crate(emitted: &EmittedCrate, folder: &Path) -> Result<(), CliError> {
    let folder = OutputFolder::create(folder)?;
    for (path, text) in &emitted.files {
        folder.write(path, text)?;
    }
    Ok(())
}

/// Says how a folder differs from the emission.
fn check(emitted: &EmittedCrate, folder: &Path, quiet: bool) -> Result<(), CliError> {
    let differences = emitted.check(folder);
    if differences.is_empty() {
        let said = format!(
            "{}: {} files as they would be emitted now\n",
            folder.display(),
            emitted.files.len()
        );
        return if quiet { Ok(()) } else { print(&said) };
    }
    let list: Vec<String> = differences
        .iter()
        .map(|difference| format!("\n  {difference}"))
        .collect();
    Err(CliError::NotCurrent {
        folder: folder.to_owned(),
        differences: list.concat(),
    })
}

fn summary(modules: &[EmittedModule], emitted: &EmittedCrate) -> Summary {
    let module = |module: &EmittedModule| ModuleSummary {
        identifier: module.identifier.clone(),
        step_multiply_adds: module.step_operations.multiply_adds,
        frozen_step_multiply_adds: module.frozen_operations.multiply_adds,
        frozen_jacobian_multiply_adds: module.jacobian_operations.multiply_adds,
    };
    Summary {
        modules: modules.iter().map(module).collect(),
        files: emitted.files.keys().cloned().collect(),
    }
}

fn text(modules: &[EmittedModule], emitted: &EmittedCrate, folder: &Path) -> String {
    let mut text = format!(
        "wrote {} files to {}\n",
        emitted.files.len(),
        folder.display()
    );
    for module in modules {
        let (step, frozen) = (module.step_operations, module.frozen_operations);
        text.push_str(&format!(
            "  {}: {} multiply-adds a step, {} with the parameters frozen\n",
            module.identifier, step.multiply_adds, frozen.multiply_adds
        ));
    }
    text
}
