//! Guarded iteration: what it settles on against direct simulation, and what it costs.
//!
//! `cargo run --release --example guarded -- agree [VALUES [SCENE...]]` sweeps every diagram of the
//! catalogue's scenes, or of these files, by both and prints where they settle on different orbits,
//! and why. `cargo run --release --example guarded -- speed` prints the time of an iterate by the
//! map, guarded and by direct simulation, for shares outside the window from none to all.

mod agreement;
mod speed;

use std::error::Error;
use std::fmt;

use agreement::{Agreement, Effort};
use grazemap::model::{Scene, SceneError, catalogue};

/// What the columns of an agreement are.
const HEADINGS: &str = "scene and parameter                by map %   same chaotic transient \
                        coexisting unexplained   difference";

/// Values of a sweep where none are named.
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
        _ => Err("say `agree` or `speed`".into()),
    }
}

/// A scene of the catalogue.
fn of_catalogue(name: &str) -> Result<Scene, SceneError> {
    Scene::parse(catalogue::text(name).unwrap_or_default(), name)
}

fn agree(values: usize, files: Vec<String>) -> Result<(), Box<dyn Error>> {
    let scenes: Vec<Scene> = if files.is_empty() {
        catalogue::names().map(of_catalogue).collect::<Result<_, _>>()?
    } else {
        files.iter().map(Scene::load).collect::<Result<_, _>>()?
    };
    println!("{HEADINGS}");
    for scene in scenes {
        let effort = Effort { values, transient: 600, keep: 60 };
        for agreement in agreement::of_scene(scene, &effort)? {
            println!("{agreement}");
            agreement.unexplained.iter().for_each(|words| println!("    {words}"));
        }
    }
    Ok(())
}

impl fmt::Display for Agreement {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, by_map, same, chaotic, transient, coexisting, unexplained, difference } =
            self;
        let (share, left) = (100.0 * by_map, unexplained.len());
        write!(
            out,
            "{name:34} {share:8.2} {same:6} {chaotic:7} {transient:9} {coexisting:10} {left:11} \
             {difference:12.1e}"
        )
    }
}
