//! What most commands begin with: the scene, its warnings, the threads, the orbit.

use std::path::Path;

use super::arguments::{Common, SceneOptions};
use super::error::CliError;
use super::output::note;
use grazemap::analysis::AnalysisError;
use grazemap::convergence::{Choice, SettledScene, choose_orders, settle_section};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::{Orders, Scene, Shape, catalogue, nearest};
use grazemap::numeric::FloatFormat;
use grazemap::orbit::{GrazingOrbit, locate};
use grazemap::report::{SectionDecision, SectionDocument};

/// A scene and the text it was read from.
#[derive(Debug)]
pub(super) struct Loaded {
    /// The checked scene, overrides in it.
    pub(super) scene: Scene,
    /// What it was read from: the file's name, or the name in the catalogue.
    pub(super) name: String,
    /// Its text, overrides in it.
    pub(super) text: String,
}

/// Reads and checks the scene, shows its warnings and starts the threads asked for.
pub(super) fn prepare(options: &SceneOptions) -> Result<Loaded, CliError> {
    start_threads(&options.common)?;
    let loaded = load(&options.scene, &options.common.set)?;
    if !options.common.quiet {
        for warning in &loaded.scene.warnings {
            note(&format!("warning: {warning}"));
        }
    }
    Ok(loaded)
}

/// The scene of a path, or of the catalogue where there is no such file.
pub(super) fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded, CliError> {
    let name = path.display().to_string();
    if path.exists() {
        let scene = Scene::load_with(path, overrides)?;
        let source = std::fs::read_to_string(path).map_err(|source| CliError::UnreadableScene {
            path: path.to_owned(),
            source,
        })?;
        let text = Scene::text_with(&source, &name, overrides)?;
        return Ok(Loaded { scene, name, text });
    }
    match path.to_str().and_then(catalogue::text) {
        Some(source) => {
            let file = format!("{name}.toml");
            let scene = Scene::parse_with(source, &file, overrides)?;
            let text = Scene::text_with(source, &file, overrides)?;
            Ok(Loaded { scene, name, text })
        }
        None => Err(CliError::NoSuchScene {
            path: path.to_owned(),
            nearest: nearest_scene(&name),
        }),
    }
}

/// The name of the catalogue nearest to a mistyped one.
pub(super) fn nearest_scene(name: &str) -> Option<String> {
    nearest(name, catalogue::names())
}

/// Refuses diagrams and charts of parameters that the map does not keep, before anything is
/// computed for them.
pub(super) fn refuse_frozen_sweeps(scene: &Scene) -> Result<(), CliError> {
    let diagrams = scene.diagrams.iter().map(|diagram| diagram.parameter);
    let charts = scene.charts.iter().flat_map(|chart| chart.parameters);
    let frozen = diagrams
        .chain(charts)
        .find(|swept| !scene.expansion.active.contains(swept));
    frozen.map_or(Ok(()), |swept| {
        let parameter = scene.model.parameters[swept].name.clone();
        Err(AnalysisError::NotActive { parameter }.into())
    })
}

/// The grazing orbit of a scene.
pub(super) fn grazing_orbit(scene: &Scene) -> Result<GrazingOrbit, CliError> {
    Ok(locate(scene)?.into_result()?)
}

/// The scene on the section that its map is taken on; says, unless `quiet`, what decided it where
/// the scene takes any.
pub(super) fn settle(
    scene: &Scene,
    orbit: &GrazingOrbit,
    quiet: bool,
) -> Result<SettledScene, CliError> {
    let settled = settle_section(scene, orbit)?;
    if let Some(decision) = SectionDecision::of(&settled).filter(|_| !quiet) {
        note(&decision.words());
    }
    Ok(settled)
}

/// Starts the threads asked for.
pub(super) fn start_threads(common: &Common) -> Result<(), CliError> {
    match common.threads {
        Some(threads) => Ok(rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()?),
        None => Ok(()),
    }
}

/// What of a scene is expanded.
#[derive(Debug)]
pub(super) struct Plan {
    /// The scene, with the weights and the shape chosen where it names a tolerance.
    pub(super) scene: Scene,
    /// The truncation orders.
    pub(super) orders: MapOrders,
    /// How they were chosen, where the scene names a tolerance.
    pub(super) choice: Option<Choice>,
    /// The section, with what decided it.
    pub(super) section: SectionDocument,
}

impl Plan {
    /// What the map is run in: as chosen, or as the scene says.
    pub(super) fn precision(&self) -> FloatFormat {
        let choice = self.choice.as_ref();
        choice.map_or(self.scene.emit.precision.first(), |choice| choice.precision)
    }

    /// The map, stage by stage, in the shape asked for or chosen.
    pub(super) fn map(&self, orbit: &GrazingOrbit) -> Result<LocalMap, CliError> {
        if let Some(choice) = &self.choice {
            return Ok(choice.local_map(&self.scene, orbit)?);
        }
        let expander = Expander::new(&self.scene, orbit)?;
        Ok(match self.scene.emit.shape {
            Shape::Flown => expander.flown(self.orders)?,
            _ => expander.expand(self.orders)?,
        })
    }
}

/// The orders that a scene names, or the cheapest map that meets the tolerance it names.
pub(super) fn plan(settled: &SettledScene) -> Result<Plan, CliError> {
    let (scene, section) = (&settled.scene, SectionDocument::settled(settled));
    let tolerance = match scene.expansion.orders {
        Orders::Fixed(orders) => {
            return Ok(Plan {
                scene: scene.clone(),
                orders,
                choice: None,
                section,
            });
        }
        Orders::Tolerance(tolerance) => tolerance,
    };
    let choice = match settled.choice() {
        Some(choice) => choice.clone(),
        None => choose_orders(scene, &settled.orbit, tolerance)?,
    };
    if !choice.met {
        return Err(CliError::ToleranceNotMet {
            tolerance,
            orders: choice.orders,
            error: choice.fresh_error.or(choice.error),
            precision: choice.precision,
            limit: choice.limit,
        });
    }
    let mut scene = choice.weighted(scene);
    scene.emit.shape = choice.shape;
    Ok(Plan {
        scene,
        orders: choice.orders,
        choice: Some(choice),
        section,
    })
}
