//! Emitted code is compiled, run, and compared with the map evaluated from its jets.

use std::fs;
use std::path::Path;

use grazemap::emission::{
    Difference, EmissionError, EmitOptions, EmittedCrate, EmittedModule, EmittedShape,
    emitted_module,
};
use grazemap::expansion::{Expander, LocalMap, MapOrders, SectionKind};
use grazemap::iteration::{DifferentiableMap, DiscreteMap, HornerMap, InterpretedMap};
use grazemap::report::OutputFolder;

use crate::support::driver::{run, rustc};
use crate::support::scenes::grazing;
use crate::support::synthetic::{self, Numbers};

/// Writes the files of a crate.
fn write(emitted: &EmittedCrate, folder: &Path) {
    let folder = OutputFolder::create(folder).expect("the test can be set up");
    for (path, text) in &emitted.files {
        folder.write(path, text).expect("the test can be set up");
    }
}

fn named(name: &str, mut map: LocalMap) -> LocalMap {
    map.scene = name.into();
    map
}

/// The maps under test and their emissions.
fn maps() -> Vec<(LocalMap, EmittedModule)> {
    let tangency = named("tangency", synthetic::map(3, 4, SectionKind::Tangency));
    let stroboscopic = named("stroboscopic", synthetic::map(4, 5, SectionKind::Stroboscopic));
    let lowest = named("lowest", synthetic::map(1, 1, SectionKind::Tangency));
    // Long enough to be printed in blocks.
    let long = named("long", synthetic::map(7, 8, SectionKind::Tangency));
    let options = EmitOptions::default();
    let emit = |map: LocalMap| {
        let module = emitted_module(&map, None, &options).expect("the test can be set up");
        (map, module)
    };
    [tangency, stroboscopic, lowest, long].map(emit).into()
}

fn composed_module() -> (LocalMap, EmittedModule) {
    let map = named("composed", synthetic::map(3, 4, SectionKind::Tangency));
    let options = EmitOptions { shape: EmittedShape::Composed, ..EmitOptions::default() };
    let module = emitted_module(&map, Some(&synthetic::composed(6)), &options)
        .expect("the test can be set up");
    (map, module)
}

#[test]
fn compiled_maps_equal_the_interpreted_ones() {
    let (mut maps, composed) = (maps(), composed_module());
    let mut horner: Vec<HornerMap> = maps.iter().map(|(map, _)| HornerMap::new(map)).collect();
    horner.push(HornerMap::composed(&composed.0, &synthetic::composed(6)));
    let references: Vec<InterpretedMap> =
        maps.iter().map(|(map, _)| InterpretedMap::new(map)).collect();
    maps.push(composed);
    let mut numbers = Numbers::new(5);
    let points: Vec<_> = (0..100).map(|_| synthetic::point(&mut numbers)).collect();
    let mut queries = Vec::new();
    for (map, _) in &maps {
        for (state, parameters) in &points {
            let bits: Vec<String> =
                state.iter().chain(parameters).map(|x| x.to_bits().to_string()).collect();
            queries.push(format!("{} {}", map.scene, bits.join(" ")));
        }
    }
    let modules: Vec<&EmittedModule> = maps.iter().map(|(_, module)| module).collect();
    let answers = run(&modules, &queries);
    assert_eq!(answers.len(), queries.len());
    let (mut with, mut without) = (0, 0);
    for (number, answer) in answers.iter().enumerate() {
        let (which, (state, parameters)) = (number / points.len(), points[number % points.len()]);
        let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
        let info = horner[which].step_jacobian(&state, &parameters, &mut image, &mut jacobian);
        agree(&answer[..2], &image, 1e-14);
        agree(&answer[3..7], &jacobian, 1e-12);
        let mut derivatives = [0.0; 8];
        horner[which].step_derivatives(&state, &parameters, &mut image, &mut derivatives);
        agree(&answer[7..], &derivatives, 1e-12);
        assert_eq!(answer[2] > 0.0, info.contacts() == 1);
        if let Some(reference) = references.get(which) {
            reference.step_jacobian(&state, &parameters, &mut image, &mut jacobian);
            agree(&answer[..2], &image, 1e-14);
            agree(&answer[3..7], &jacobian, 1e-12);
        }
        if !info.passages.is_empty() { with += 1 } else { without += 1 }
    }
    assert!(with > 50 && without > 50, "{with} points with contact, {without} without");
}

/// Agreement to `tolerance` relative to the largest entry (at least 1).
pub(crate) fn agree(found: &[f64], expected: &[f64], tolerance: f64) {
    let size = expected.iter().fold(1.0f64, |size, value| size.max(value.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance * size, "{found} and {expected}");
    }
}

#[test]
fn standalone_crates_compile_with_and_without_the_standard_library() {
    let (_, module) = composed_module();
    let folder = tempfile::tempdir().expect("the test can be set up");
    write(&EmittedCrate::standalone(&module).expect("the test can be set up"), folder.path());
    rustc(
        &["--crate-type", "lib", "--cfg", "feature=\"std\"", "src/lib.rs", "--crate-name", "a"],
        folder.path(),
    );
    rustc(&["--crate-type", "lib", "src/lib.rs", "--crate-name", "b"], folder.path());
    let root =
        fs::read_to_string(folder.path().join("src/lib.rs")).expect("the test can be set up");
    assert!(root.contains("no_std"));
}

#[test]
fn maps_of_thousands_of_operations_compile_with_debug_information() {
    let (scene, orbit) = grazing("two_stops_t1");
    let orders = MapOrders { smooth_order: 4, contact_weight: 8 };
    let map = Expander::new(&scene, &orbit).and_then(|expander| expander.expand(orders));
    let module = emitted_module(&map.expect("an expansion"), None, &EmitOptions::default());
    let module = module.expect("finite coefficients");
    let folder = tempfile::tempdir().expect("the test can be set up");
    let standalone = EmittedCrate::standalone(&module).expect("the test can be set up");
    write(&standalone, folder.path());
    // As Cargo's development profile with optimisation: one scope for each of 7000 statements
    // overflows its stack.
    let profile = ["-C", "opt-level=2", "-C", "debuginfo=1"];
    let library = ["--crate-type", "lib", "--cfg", "feature=\"std\"", "src/lib.rs"];
    rustc(&[&library[..], &profile[..]].concat(), folder.path());
}

#[test]
fn the_catalogue_compiles_with_its_registry() {
    let (maps, composed) = (maps(), composed_module());
    let modules: Vec<EmittedModule> =
        maps.into_iter().map(|(_, module)| module).chain([composed.1]).collect();
    let emitted = EmittedCrate::catalogue(&modules).expect("the test can be set up");
    let folder = tempfile::tempdir().expect("the test can be set up");
    write(&emitted, folder.path());
    assert_eq!(emitted.check(folder.path()), []);
    rustc(
        &["--crate-type", "lib", "--cfg", "feature=\"std\"", "src/lib.rs", "--crate-name", "a"],
        folder.path(),
    );
    rustc(&["--crate-type", "lib", "src/lib.rs", "--crate-name", "b"], folder.path());
    let twice = [modules[0].clone(), modules[0].clone()];
    assert!(matches!(EmittedCrate::catalogue(&twice), Err(EmissionError::DuplicateModule { .. })));
    let empty = EmittedCrate::catalogue(&[]).expect("the test can be set up");
    write(&empty, folder.path());
    rustc(&["--crate-type", "lib", "src/lib.rs", "--crate-name", "c"], folder.path());
}

#[test]
fn a_changed_or_missing_file_is_a_difference() {
    let (_, module) = composed_module();
    let folder = tempfile::tempdir().expect("the test can be set up");
    let emitted = EmittedCrate::standalone(&module).expect("the test can be set up");
    write(&emitted, folder.path());
    assert_eq!(emitted.check(folder.path()), []);
    let file = folder.path().join("src/composed.rs");
    fs::write(&file, module.text().replacen("DIMENSION: usize = 2", "DIMENSION: usize = 3", 1))
        .expect("the test can be set up");
    let line = module
        .text()
        .lines()
        .position(|line| line.contains("DIMENSION: usize"))
        .expect("the test can be set up")
        + 1;
    let path = "src/composed.rs".to_owned();
    assert_eq!(emitted.check(folder.path()), [Difference::Changed { path: path.clone(), line }]);
    fs::remove_file(&file).expect("the test can be set up");
    assert_eq!(emitted.check(folder.path()), [Difference::Missing { path }]);
}

#[test]
fn emitted_text_is_stamped_deterministic_and_short_of_line() {
    let (again, maps) = (maps(), maps());
    for ((_, module), (_, same)) in maps.iter().zip(&again) {
        assert_eq!(module, same);
        let text = module.text();
        let first = text.lines().next().expect("the test can be set up");
        assert!(first.contains("@generated") && first.contains("format 3"), "{first}");
        let stamps = [
            "digest 0123456789abcdef",
            "--check",
            "multiply-adds",
            "smooth_order",
            "Tolerance asked none",
        ];
        stamps.iter().for_each(|stamp| assert!(module.text().contains(stamp), "{stamp}"));
        let longest = module.text().lines().map(str::len).max().expect("the test can be set up");
        assert!(longest <= 120, "a line of {longest} characters");
        assert!(module.text().lines().all(|line| line.trim_end() == line));
    }
}

#[test]
fn hostile_names_cannot_reach_emitted_code() {
    for name in ["a; fn evil() {}", "../evil", "fn", "a\nb", "", "A", "x\"y", "ä"] {
        let map = named(name, synthetic::map(1, 1, SectionKind::Tangency));
        let refused = emitted_module(&map, None, &EmitOptions::default());
        assert!(matches!(refused, Err(EmissionError::NotAnIdentifier { .. })), "{name:?}");
    }
    let mut map = named("hostile", synthetic::map(1, 1, SectionKind::Tangency));
    map.section.coordinates = vec![
        "x\"; } compile_error!(\"a\");\n//".into(),
        "{{ map.scene }} */ \u{2028}\u{202e}\\".into(),
    ];
    map.parameters[0].name = "\n#![feature(evil)]\ncompile_error!(\"b\");\n{% raw %}".repeat(9);
    let module =
        emitted_module(&map, None, &EmitOptions::default()).expect("the test can be set up");
    assert!(module.text().is_ascii());
    assert!(!module.text().lines().any(
        |line| line.trim_start().starts_with("compile_error") || line.starts_with("#![feature")
    ));
    let folder = tempfile::tempdir().expect("the test can be set up");
    write(&EmittedCrate::standalone(&module).expect("the test can be set up"), folder.path());
    rustc(
        &["--crate-type", "lib", "--cfg", "feature=\"std\"", "src/lib.rs", "--crate-name", "a"],
        folder.path(),
    );
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    use grazemap::expansion::Stage;
    let mut map = synthetic::map(1, 1, SectionKind::Tangency);
    let Some(Stage::Leg(leg)) = map.stages.last_mut() else {
        unreachable!("the last stage is a leg")
    };
    leg.image[0].coefficients_mut()[1] = f64::NAN;
    let refused = emitted_module(&map, None, &EmitOptions::default());
    assert!(matches!(refused, Err(EmissionError::NonFinite { .. })), "{refused:?}");
    let lanes = EmitOptions { lanes: 0, ..EmitOptions::default() };
    let map = synthetic::map(1, 1, SectionKind::Tangency);
    assert!(matches!(emitted_module(&map, None, &lanes), Err(EmissionError::Lanes { lanes: 0 })));
    let composed = EmitOptions { shape: EmittedShape::Composed, ..EmitOptions::default() };
    assert!(matches!(emitted_module(&map, None, &composed), Err(EmissionError::NoComposedForm)));
}

#[test]
fn dropped_monomials_stay_below_their_bound() {
    let map = synthetic::map(6, 7, SectionKind::Tangency);
    let (pruned, report) = grazemap::expansion::prune(&map, 1e-3);
    assert!(report.dropped > 5 && report.bound <= 1e-4, "{report:?}");
    let (whole, pruned) = (InterpretedMap::new(&map), InterpretedMap::new(&pruned));
    let (mut numbers, mut seen) = (Numbers::new(9), 0);
    for _ in 0..300 {
        let (state, parameters) = synthetic::point(&mut numbers);
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        let info = whole.step(&state, &parameters, &mut a);
        pruned.step(&state, &parameters, &mut b);
        if info.depth <= map.window.depth {
            seen += 1;
            agree(&a, &b, report.bound);
        }
    }
    assert!(seen > 100, "{seen} points inside the window");
}
