//! `grazemap emit`: writes the map as source code, or checks that a folder is up to date.

use std::path::{Component, Path, PathBuf};

use serde::Serialize;

use super::{map, open};
use crate::cli::arguments::{EmitArguments, SceneOptions};
use crate::cli::output::{CliError, deliver, note_all, print};
use grazemap::convergence::MeasuredWindow;
use grazemap::emission::{EmissionError, EmittedCrate, EmittedModule, Target, shell_word};
use grazemap::expansion::WindowEdge;
use grazemap::model::{EmitPrecision, catalogue};
use grazemap::numeric::FloatFormat;
use grazemap::pipeline::{Answer, EmitRequest, Source, is_standard, write_emitted};
use grazemap::report::{SectionDocument, bounds_words, counted, to_json};
use grazemap::{Error, Map};

/// Default folder of the catalogue's crate.
const CATALOGUE_FOLDER: &str = "out/catalogue";

/// Document of `--json`.
#[derive(Debug, Serialize)]
struct EmitSummary {
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

/// Emitted module, window with measured errors, and map.
type Emitted = (EmittedModule, MeasuredWindow, Map);

pub(in crate::cli) fn run(options: &EmitArguments) -> Result<(), CliError> {
    let default = match options.catalogue {
        true => PathBuf::from(CATALOGUE_FOLDER),
        false => folder_of(options.target),
    };
    let mut outlets = options.common.outlets.clone();
    let folder = outlets.output.take().unwrap_or(default);
    let command = Reproduction::of(options).command(&folder);
    let (modules, emitted) = match &options.scene {
        Some(scene) => {
            let source = opened(scene.clone(), options)?;
            if !options.check {
                let files = options.target.files(&source.scene().identifier);
                EmittedCrate::refuse_foreign(&folder, &files).map_err(Error::from)?;
            }
            let emitted = emit(source, options, &command)?;
            let files = EmittedCrate::standalone(&emitted.0);
            (vec![emitted], files)
        }
        None => {
            let scenes = catalogue::names().map(|name| opened(PathBuf::from(name), options));
            let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
            refuse_single(&scenes)?;
            let all = scenes.into_iter().map(|scene| emit(scene, options, &command));
            let all = all.collect::<Result<Vec<_>, _>>()?;
            let modules: Vec<_> = all.iter().map(|(module, ..)| module.clone()).collect();
            (all, EmittedCrate::catalogue(&modules))
        }
    };
    let emitted = emitted.map_err(Error::from)?;
    if options.check {
        return check(&emitted, &folder, outlets.quiet);
    }
    write_emitted(&emitted, &folder)?;
    let remarks = modules.iter().filter_map(|(_, window, map)| map.remark_on(window));
    note_all(&remarks.collect::<Vec<_>>(), outlets.quiet);
    let text = text(&modules, &emitted, &folder);
    let json = to_json(&summary(modules, &emitted))?;
    deliver(&mut Answer::without_table("emit", text, json), &outlets)
}

/// Arguments of the command that reproduces a module.
pub(super) struct Reproduction<'a> {
    /// Argument in the place of SCENE; `None` for the catalogue.
    pub(super) scene: Option<&'a Path>,
    pub(super) overrides: &'a [(String, String)],
    pub(super) target: Target,
    pub(super) measure: bool,
}

impl<'a> Reproduction<'a> {
    fn of(options: &'a EmitArguments) -> Self {
        Self {
            scene: options.scene.as_deref(),
            overrides: &options.common.set,
            target: options.target,
            measure: !options.no_measure,
        }
    }

    /// Command for a shell in the folder of the module's file, which reproduces an emission into
    /// `folder`.
    pub(super) fn command(&self, folder: &Path) -> String {
        let mut words = vec!["grazemap".to_owned(), "emit".to_owned()];
        let from = match self.target {
            Target::Rust => folder.join("src"),
            _ => folder.to_owned(),
        };
        match self.scene {
            Some(scene) if scene.exists() => {
                let whole = std::path::absolute(scene).unwrap_or_else(|_| scene.to_owned());
                let scene = match (whole.parent(), whole.file_name()) {
                    (Some(parent), Some(name)) => settled(parent).join(name),
                    _ => whole,
                };
                let scene = relative(&settled(&from), &scene);
                words.push(shell_word(scene.as_os_str().as_encoded_bytes()));
            }
            Some(input) if is_standard(input) => words.push("- < SCENE".to_owned()),
            Some(name) => words.push(shell_word(name.as_os_str().as_encoded_bytes())),
            None => words.push("--catalogue".to_owned()),
        }
        for (name, value) in self.overrides {
            words.extend(["--set".to_owned(), shell_word(format!("{name}={value}").as_bytes())]);
        }
        if self.target != Target::Rust {
            words.extend(["--target".to_owned(), self.target.word().to_owned()]);
        }
        if !self.measure {
            words.push("--no-measure".to_owned());
        }
        words.extend(["-o".to_owned(), self.target.root_from_module().to_owned()]);
        words.join(" ")
    }
}

/// Absolute path of a folder with links resolved; names that do not exist yet are kept.
fn settled(folder: &Path) -> PathBuf {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    whole.canonicalize().unwrap_or_else(|_| match (whole.parent(), whole.file_name()) {
        (Some(parent), Some(name)) => settled(parent).join(name),
        _ => whole,
    })
}

/// Path relative to a folder, both absolute.
fn relative(folder: &Path, path: &Path) -> PathBuf {
    let (here, there): (Vec<_>, Vec<_>) =
        (folder.components().collect(), path.components().collect());
    let common = here.iter().zip(&there).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return path.to_owned();
    }
    let up = match here.len() - common {
        // NOTE: a name that begins with a dash would be read as an option.
        0 => vec![Component::CurDir],
        levels => vec![Component::ParentDir; levels],
    };
    up.into_iter().chain(there[common..].iter().copied()).collect()
}

/// Default folder of an emission.
fn folder_of(target: Target) -> PathBuf {
    Path::new("out").join(match target {
        Target::Rust => "crate",
        other => other.word(),
    })
}

fn opened(scene: PathBuf, options: &EmitArguments) -> Result<Source, CliError> {
    let common = options.common.clone();
    open(&SceneOptions { scene, common })
}

/// Refuses, before any computing, scenes of the catalogue that ask for single precision.
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

fn emit(source: Source, options: &EmitArguments, command: &str) -> Result<Emitted, CliError> {
    let map = map(source, options.common.outlets.quiet)?;
    let (module, window) = map.emitted(EmitRequest {
        target: options.target,
        measure: !options.no_measure,
        derivatives: !options.catalogue,
        command: Some(command.to_owned()),
    })?;
    Ok((module, window, map))
}

/// Compares a folder with the emission and reports the differences.
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

fn summary(modules: Vec<Emitted>, emitted: &EmittedCrate) -> EmitSummary {
    let module = |(module, window, map): Emitted| ModuleSummary {
        identifier: module.identifier,
        step_multiply_adds: module.step_operations.multiply_adds,
        frozen_step_multiply_adds: module.frozen_operations.multiply_adds,
        frozen_jacobian_multiply_adds: module.jacobian_operations.multiply_adds,
        precision: module.precision,
        measured_error: module.measured_error,
        window,
        window_edges: map.window_edges().to_vec(),
        section: map.section(),
    };
    EmitSummary {
        modules: modules.into_iter().map(module).collect(),
        files: emitted.files.keys().cloned().collect(),
    }
}

fn text(modules: &[Emitted], emitted: &EmittedCrate, folder: &Path) -> String {
    let mut text =
        format!("wrote {} to {}\n", counted(emitted.files.len(), "file"), folder.display());
    for (module, window, _) in modules {
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
                window.sample.points,
                bounds_words(window)
            ));
        }
    }
    text
}
