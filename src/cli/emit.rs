//! `grazemap emit`: the crate of Rust code, or the map in C or CUDA, or whether a folder holds it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::arguments::{EmitArguments, SceneOptions};
use super::error::CliError;
use super::expand::{Expanded, expand};
use super::output::{Results, counted, print};
use super::prepare::{Plan, grazing_orbit, plan, prepare, settle};
use grazemap::convergence::{Choice, measured_error};
use grazemap::emission::{
    EmissionError, EmitOptions, EmittedCrate, EmittedModule, EmittedShape, Target, emitted_module,
    prune, prune_composed,
};
use grazemap::expansion::WindowEdge;
use grazemap::iteration::HornerMap;
use grazemap::model::{EmitPrecision, Scene, Shape, catalogue};
use grazemap::numeric::FloatFormat;
use grazemap::orbit::GrazingOrbit;
use grazemap::report::{OutputFolder, SectionDocument, to_dense_json};

/// Where the catalogue's crate goes when no folder is named.
const CATALOGUE_FOLDER: &str = "generated";

/// Fresh points at which the error of an emitted map is measured.
const MEASURED_POINTS: usize = 1000;

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
    window_edges: Vec<WindowEdge>,
    section: SectionDocument,
}

/// What is said of a map beside its module.
struct Beside {
    /// What its contacts leave out at the edge of the window.
    window_edges: Vec<WindowEdge>,
    /// Its section.
    section: SectionDocument,
}

pub(super) fn run(options: &EmitArguments) -> Result<(), CliError> {
    let (modules, beside, emitted) = match &options.scene {
        Some(scene) => {
            let (module, beside) = emit_scene(&loaded(scene.clone(), options)?, options)?;
            let emitted = EmittedCrate::standalone(&module)?;
            (vec![module], vec![beside], emitted)
        }
        None => {
            let scenes = catalogue::names().map(|name| loaded(PathBuf::from(name), options));
            let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
            refuse_single(&scenes)?;
            let all = scenes.iter().map(|scene| emit_scene(scene, options));
            let all = all.collect::<Result<Vec<_>, _>>()?;
            let (modules, beside): (Vec<_>, _) = all.into_iter().unzip();
            let emitted = EmittedCrate::catalogue(&modules)?;
            (modules, beside, emitted)
        }
    };
    let default = if options.catalogue {
        CATALOGUE_FOLDER
    } else {
        folder_of(options.target.into())
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
        to_dense_json(&summary(&modules, beside, &emitted))?,
        None,
    )
    .deliver("emit", &common)
}

/// Where an emission goes when no folder is named.
fn folder_of(target: Target) -> &'static str {
    match target {
        Target::Rust => "out/crate",
        Target::C => "out/c",
        Target::Cuda => "out/cuda",
    }
}

fn loaded(scene: PathBuf, options: &EmitArguments) -> Result<Scene, CliError> {
    let common = options.common.clone();
    Ok(prepare(&SceneOptions { scene, common })?.scene)
}

/// Refuses, before anything is computed, a scene of the catalogue that asks for single precision.
fn refuse_single(scenes: &[Scene]) -> Result<(), CliError> {
    let single = EmitPrecision::Given(FloatFormat::F32);
    match scenes.iter().find(|scene| scene.emit.precision == single) {
        None => Ok(()),
        Some(scene) => Err(EmissionError::SingleInCatalogue {
            name: scene.identifier.clone(),
        }
        .into()),
    }
}

/// The module of a scene, and what is said beside it.
fn emit_scene(scene: &Scene, options: &EmitArguments) -> Result<(EmittedModule, Beside), CliError> {
    let orbit = grazing_orbit(scene)?;
    let settled = settle(scene, &orbit, options.common.quiet)?;
    let (plan, orbit) = (plan(&settled)?, &settled.orbit);
    let expanded = expand(&plan, orbit, options.common.quiet)?;
    let asked = if options.measure {
        Measurement::Always
    } else {
        Measurement::WithTolerance
    };
    let module = emit(&plan, orbit, &expanded, asked, options.target.into())?;
    let beside = Beside {
        window_edges: expanded.window_edges,
        section: plan.section,
    };
    Ok((module, beside))
}

/// Of which maps the error is measured for the emitted constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measurement {
    /// Of all.
    Always,
    /// Of those of a scene that names a tolerance.
    WithTolerance,
}

/// The module of an expanded scene, in the shape it asks for.
pub(super) fn emit(
    plan: &Plan,
    orbit: &GrazingOrbit,
    expanded: &Expanded,
    measurement: Measurement,
    target: Target,
) -> Result<EmittedModule, CliError> {
    let choice = plan.choice.as_ref();
    let precision = plan.precision();
    let options = EmitOptions {
        target,
        shape: EmittedShape::Factored,
        precision,
        lanes: plan.scene.emit.lanes(precision),
        tolerance: choice.map(|choice| choice.tolerance),
        drop_within: choice.and_then(Choice::drop_after),
        measured_error: None,
    };
    let mut options = EmitOptions {
        shape: emitted_shape(plan, expanded, &options)?,
        ..options
    };
    if choice.is_some() || measurement == Measurement::Always {
        let map = as_emitted(expanded, &options);
        let map = map.in_format(precision);
        let measured = measured_error(&plan.scene, orbit, &expanded.map, &*map, MEASURED_POINTS)?;
        options.measured_error = measured.rounded_up();
    }
    module(expanded, &options)
}

/// The shape chosen with the orders, the one a scene names, or the one with fewer operations.
fn emitted_shape(
    plan: &Plan,
    expanded: &Expanded,
    options: &EmitOptions,
) -> Result<EmittedShape, CliError> {
    let shape = match &plan.choice {
        Some(choice) => choice.shape,
        None => plan.scene.emit.shape,
    };
    Ok(match shape {
        Shape::Factored | Shape::Flown => EmittedShape::Factored,
        Shape::Composed => EmittedShape::Composed,
        Shape::Auto => {
            let operations = |shape| {
                let options = EmitOptions {
                    shape,
                    ..options.clone()
                };
                Ok::<_, CliError>(module(expanded, &options)?.frozen_operations.total())
            };
            if operations(EmittedShape::Composed)? < operations(EmittedShape::Factored)? {
                EmittedShape::Composed
            } else {
                EmittedShape::Factored
            }
        }
    })
}

fn module(expanded: &Expanded, options: &EmitOptions) -> Result<EmittedModule, CliError> {
    Ok(emitted_module(
        &expanded.map,
        Some(&expanded.composed),
        options,
    )?)
}

/// The map that the emitted code computes, interpreted.
fn as_emitted(expanded: &Expanded, options: &EmitOptions) -> HornerMap {
    let (map, composed) = (&expanded.map, &expanded.composed);
    match (options.shape, options.drop_within) {
        (EmittedShape::Factored, None) => HornerMap::new(map),
        (EmittedShape::Factored, Some(tolerance)) => HornerMap::new(&prune(map, tolerance).0),
        (EmittedShape::Composed, None) => HornerMap::composed(map, composed),
        (EmittedShape::Composed, Some(tolerance)) => {
            HornerMap::composed(map, &prune_composed(map, composed, tolerance).0)
        }
    }
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
        let they = match emitted.files.len() {
            1 => "1 file as it".to_owned(),
            count => format!("{count} files as they"),
        };
        let said = format!("{}: {they} would be emitted now\n", folder.display());
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

fn summary(modules: &[EmittedModule], beside: Vec<Beside>, emitted: &EmittedCrate) -> Summary {
    let module = |(module, beside): (&EmittedModule, Beside)| ModuleSummary {
        identifier: module.identifier.clone(),
        step_multiply_adds: module.step_operations.multiply_adds,
        frozen_step_multiply_adds: module.frozen_operations.multiply_adds,
        frozen_jacobian_multiply_adds: module.jacobian_operations.multiply_adds,
        precision: module.precision,
        measured_error: module.measured_error,
        window_edges: beside.window_edges,
        section: beside.section,
    };
    Summary {
        modules: modules.iter().zip(beside).map(module).collect(),
        files: emitted.files.keys().cloned().collect(),
    }
}

fn text(modules: &[EmittedModule], emitted: &EmittedCrate, folder: &Path) -> String {
    let mut text = format!(
        "wrote {} to {}\n",
        counted(emitted.files.len(), "file"),
        folder.display()
    );
    for module in modules {
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
                "    within {error:.1e} of direct simulation at {MEASURED_POINTS} points of the window\n"
            ));
        }
    }
    text
}
