//! Guarded iteration compared with direct simulation: attractors, errors and times.
//!
//! ```text
//! cargo run --release -p grazemap-studies --bin guarded -- agree [VALUES [SCENE...]]
//! cargo run --release -p grazemap-studies --bin guarded -- speed
//! cargo run --release -p grazemap-studies --bin guarded -- bound [POINTS [SCENE...]]
//! ```
//!
//! `agree` sweeps every diagram of the catalogue's scenes, or of these files, by both methods and
//! prints the values at which they settle on different orbits, with the reason. `speed` prints the
//! time of an iterate by the map, guarded and by direct simulation, for shares outside the window
//! from none to all. `bound` searches the windows of the catalogue, or of these files, for points
//! at which the error of the map exceeds its claim.

mod speed;

use std::error::Error;

use grazemap::model::{Scene, SceneError, catalogue};
use grazemap::prelude::*;
use grazemap_studies::adversary::attack;
use grazemap_studies::agreement::{self, Effort, HEADINGS};
use rayon::prelude::*;

/// Seed of the random numbers of an attack.
const SEED: u64 = 39;

/// Default number of values of a sweep.
const VALUES: usize = 160;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("agree") => {
            let values = arguments.next().map_or(Ok(VALUES), |text| text.parse())?;
            agree(values, arguments.collect())
        }
        Some("speed") => {
            print!("{}", speed::table()?.to_text());
            Ok(())
        }
        Some("bound") => {
            let points = arguments.next().map_or(Ok(POINTS), |text| text.parse())?;
            bound(points, arguments.collect())
        }
        _ => Err("say `agree`, `speed` or `bound`".into()),
    }
}

/// Scenes of these files, or the whole catalogue.
fn scenes(files: Vec<String>) -> Result<Vec<Scene>, SceneError> {
    match files.is_empty() {
        true => catalogue::names().map(Scene::of_catalogue).collect(),
        false => files.iter().map(Scene::load).collect(),
    }
}

fn agree(values: usize, files: Vec<String>) -> Result<(), Box<dyn Error>> {
    println!("{HEADINGS}");
    for scene in scenes(files)? {
        let effort = Effort { values, transient: 600, keep: 60 };
        for agreement in agreement::of_scene(scene, &effort)? {
            println!("{agreement}");
            agreement.unexplained.iter().for_each(|words| println!("    {words}"));
        }
    }
    Ok(())
}

/// Default number of points of an attack on one window.
const POINTS: usize = 20_000;

/// Attacks the claims of all maps.
fn bound(points: usize, files: Vec<String>) -> Result<(), Box<dyn Error>> {
    println!("{:26} {:>9} {:>6} {:>8} coordinate and where", "scene", "points", "lost", "excess");
    let attacked = |scene: Scene| {
        let name = scene.identifier.clone();
        let map = scene.graze()?.map()?;
        let errors = map.window().errors.iter();
        let claims: Vec<f64> = errors.clone().map(|it| it.error.unwrap_or(f64::NAN)).collect();
        let found = attack(&map, map.discrete(), &claims, (points, SEED))?;
        let (coordinate, excess, worst) = found.largest();
        let coordinate = &map.window().errors[coordinate].coordinate;
        Ok(format!(
            "{name:26} {:9} {:6} {excess:8.4} {coordinate} at {:.4?}, {:?}",
            found.points, found.lost, worst.shares, worst.held
        ))
    };
    let lines: Vec<Result<String, grazemap::Error>> =
        scenes(files)?.into_par_iter().map(attacked).collect();
    for line in lines {
        println!("{}", line?);
    }
    Ok(())
}
