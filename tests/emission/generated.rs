//! Emitted maps of the catalogue: the checked-in crate is what would be emitted today, and compiled
//! maps equal the interpreted ones.
//!
//! `UPDATE_GENERATED=1 cargo test --test emission generated::` rewrites the crate.
//! `.ci/full` compiles the maps of the whole catalogue.

use std::fs;
use std::path::Path;

use grazemap::Map;
use grazemap::emission::{EmittedCrate, EmittedModule};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::catalogue;
use grazemap::pipeline::{EmitRequest, write_emitted};
use xtask::generated::{SCENES, emitted, map_of};

use crate::rust::agree;
use crate::support::driver::{answers, optimised, rustc};
use crate::support::synthetic::Numbers;
use crate::support::tiers;

#[test]
fn the_generated_crate_is_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("generated");
    let emitted = emitted().expect("scenes of the catalogue can be emitted");
    if std::env::var_os("UPDATE_GENERATED").is_some() {
        write_emitted(&emitted, &folder).expect("the folder can be written");
    }
    assert_eq!(emitted.check(&folder), []);
}

/// Program that reads the name of a map, a state and parameters (bits of their numbers), and prints
/// image and Jacobian (bits).
const DRIVER: &str = r#"
fn main() {
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let mut words = line.split(' ');
        let map = maps::find(words.next().unwrap()).unwrap();
        let numbers: Vec<f64> = words.map(|word| f64::from_bits(word.parse().unwrap())).collect();
        let (state, parameters) = numbers.split_at(map.dimension);
        let (mut image, mut depths) = (vec![0.0; map.dimension], vec![0.0; map.passages]);
        let mut jacobian = vec![0.0; map.dimension * map.dimension];
        (map.step_jacobian)(state, parameters, &mut image, &mut depths, &mut jacobian).unwrap();
        let bits = image.iter().chain(&jacobian).map(|x: &f64| x.to_bits().to_string());
        println!("{}", bits.collect::<Vec<_>>().join(" "));
    }
}
"#;

/// Map of a scene, its emission, and the interpreter of the emitted form.
fn emission(name: &str) -> (Map, EmittedModule, HornerMap) {
    let map = map_of(name).expect("a map");
    let request = EmitRequest { measure: false, derivatives: false, ..EmitRequest::default() };
    let module = map.module(request).expect("finite coefficients");
    let interpreter = match module.text().contains("Shape: composed") {
        true => HornerMap::composed(map.local(), map.composed().expect("a composed form")),
        false => map.discrete().clone(),
    };
    (map, module, interpreter)
}

/// Points of a map's window: state and parameters.
fn points(map: &Map) -> Vec<[Vec<f64>; 2]> {
    let window = &map.local().window;
    let mut numbers = Numbers::new(17);
    let mut within = |widths: &[f64]| -> Vec<f64> {
        let width = |&width: &f64| if width.is_finite() { width } else { 1e-3 };
        widths.iter().map(|given| width(given) * numbers.next()).collect()
    };
    (0..50).map(|_| [within(&window.state), within(&window.parameter)]).collect()
}

#[test]
fn compiled_maps_of_the_catalogue_equal_the_interpreted_ones() {
    let all = || catalogue::names().collect();
    let names: Vec<&str> = if tiers::are_whole() { all() } else { SCENES.to_vec() };
    let emissions: Vec<_> = names.iter().map(|name| emission(name)).collect();
    let modules: Vec<EmittedModule> =
        emissions.iter().map(|(_, module, _)| module.clone()).collect();
    let files = EmittedCrate::catalogue(&modules).expect("maps in double precision");
    let folder = tempfile::tempdir().expect("a folder");
    write_emitted(&files, folder.path()).expect("written");
    fs::write(folder.path().join("main.rs"), DRIVER).expect("written");
    let library = ["--crate-type", "lib", "--crate-name", "maps", "src/lib.rs"];
    rustc(&[&optimised()[..], &library].concat(), folder.path());
    let program = ["--extern", "maps=libmaps.rlib", "main.rs", "-o", "driver"];
    rustc(&[&optimised()[..], &program].concat(), folder.path());
    let mut queries = Vec::new();
    for (name, (map, ..)) in names.iter().zip(&emissions) {
        for point in points(map) {
            let bits = point.concat().into_iter().map(|value| value.to_bits().to_string());
            queries.push(format!("{name} {}", bits.collect::<Vec<_>>().join(" ")));
        }
    }
    let text = answers(&folder.path().join("driver"), &queries);
    let mut lines = text.lines();
    for (map, _, interpreter) in &emissions {
        for [state, parameters] in points(map) {
            let mut image = vec![0.0; state.len()];
            let mut jacobian = vec![0.0; state.len() * state.len()];
            interpreter.step_jacobian(&state, &parameters, &mut image, &mut jacobian);
            let line = lines.next().expect("a line for every query");
            let found = line.split(' ').map(|word| word.parse().map(f64::from_bits));
            let found: Vec<f64> = found.collect::<Result<_, _>>().expect("bits");
            agree(&found[..state.len()], &image, 1e-14);
            agree(&found[state.len()..], &jacobian, 1e-12);
        }
    }
}
