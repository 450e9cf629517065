//! Maps chosen for a scene, and their errors at points that were not used for the choice.

use grazemap::convergence::{Choice, Chooser, ConvergenceError, ExactImages, chosen_map, step_ns};
use grazemap::iteration::HornerMap;
use grazemap::model::Scene;
use grazemap::orbit::{GrazingOrbit, locate};

use crate::TOLERANCES;

/// Index in the sequence of the first point of the comparison, beyond all points used for a choice.
const FIRST: usize = 200_000;
/// Number of points of the comparison.
const POINTS: usize = 10_000;
/// Number of points at which direct simulation is timed.
const TIMED: usize = 300;
/// Number of new points on which a chosen map must hold, as for a scene that names a tolerance.
const FRESH: usize = 1000;
/// Number of points with two contacts to look for.
const JOINT: usize = 2_000;
/// Multiple of the tolerance above which an error is counted.
const EXCEEDS: f64 = 1.1;

/// Scene with its maps and their errors.
pub(crate) struct Case {
    scene: Scene,
    orbit: GrazingOrbit,
    exact: ExactImages,
    maps: Vec<Chosen>,
}

/// Map and its errors.
struct Chosen {
    choice: Choice,
    map: HornerMap,
    coordinates: usize,
    errors: Vec<f64>,
    /// Errors at points where two passages make contact.
    joint_errors: Vec<f64>,
}

/// Row of the study.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) coordinates: usize,
    pub(crate) choice: Choice,
    /// Largest error at the points of the comparison.
    pub(crate) error: f64,
    /// Number of points compared, and of those whose error exceeds the tolerance by more than a
    /// tenth.
    pub(crate) points: usize,
    pub(crate) exceeding: usize,
    /// Number of points at which two passages make contact, and the largest error there.
    pub(crate) joint_points: usize,
    pub(crate) joint_error: f64,
    pub(crate) step_ns: f64,
    pub(crate) floor_ns: f64,
    pub(crate) direct_ns: f64,
}

impl Case {
    /// Chooses maps for all tolerances. The reference is simulated once.
    pub(crate) fn new(name: &str) -> Result<Self, String> {
        let said = |error: &dyn std::error::Error| error.to_string();
        let scene = Scene::of_catalogue(name).map_err(|error| said(&error))?;
        let location = locate(&scene).map_err(|error| said(&error))?;
        let orbit = location.into_result().map_err(|error| said(&error))?;
        let (exact, maps) = chosen(&scene, &orbit).map_err(|error| said(&error))?;
        Ok(Self { scene, orbit, exact, maps })
    }

    /// Rows of the scene, with times.
    pub(crate) fn rows(&self, multiply_add_ns: f64) -> Result<Vec<Row>, ConvergenceError> {
        let (direct_ns, _) = self.exact.direct(&self.scene, &self.orbit, TIMED)?;
        let row = |chosen: &Chosen| {
            let largest = |max: f64, &error: &f64| if error <= max { max } else { error };
            let limit = EXCEEDS * chosen.choice.tolerance;
            let exceeds =
                |error: &&f64| error.partial_cmp(&&limit).is_none_or(|order| order.is_gt());
            Row {
                scene: self.scene.identifier.clone(),
                coordinates: chosen.coordinates,
                choice: chosen.choice.clone(),
                error: chosen.errors.iter().fold(0.0, largest),
                points: chosen.errors.len(),
                exceeding: chosen.errors.iter().filter(exceeds).count(),
                joint_points: chosen.joint_errors.len(),
                joint_error: chosen.joint_errors.iter().fold(0.0, largest),
                step_ns: step_ns(&chosen.map, &self.exact.points()[0]),
                floor_ns: multiply_add_ns * chosen.choice.operations as f64,
                direct_ns,
            }
        };
        Ok(self.maps.iter().map(row).collect())
    }
}

fn chosen(
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<(ExactImages, Vec<Chosen>), ConvergenceError> {
    let mut chooser = Chooser::new(scene, orbit, FRESH)?;
    let mut exact = None;
    let joint = chooser.joint_points(FIRST, JOINT);
    let joint = match joint.is_empty() {
        true => None,
        false => Some(ExactImages::new(scene, orbit, joint)?),
    };
    let mut maps = Vec::new();
    for tolerance in TOLERANCES {
        let choice = chooser.choose(tolerance)?;
        let (local, map) = chosen_map(&choice, scene, orbit)?;
        let exact = match &exact {
            Some(exact) => exact,
            None => {
                let points = chooser.points(FIRST, POINTS);
                exact.insert(ExactImages::new(scene, orbit, points)?)
            }
        };
        maps.push(Chosen {
            errors: exact.errors(&map),
            joint_errors: joint.as_ref().map_or(Vec::new(), |joint| joint.errors(&map)),
            coordinates: local.dimension(),
            choice,
            map,
        });
    }
    let exact = exact.ok_or(ConvergenceError::NoTruth { tried: POINTS })?;
    Ok((exact, maps))
}
