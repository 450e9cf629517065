//! Saved orbits and maps in place of a scene: results have the same bits.

use std::fs;
use std::path::Path;

use grazemap::analysis::basin::Basin;
use grazemap::report::to_json;
use grazemap::{Chart, ConvergenceStudy, Diagram};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{QUICK, grazemap, scratch, text};

/// Commands whose results are the same, except for times, for a scene, its saved map and its saved
/// orbit.
const COMMANDS: [&[&str]; 5] = [
    &["expand"],
    &["image", "--states", "states.csv", "--iterations", "3"],
    &["emit", "-o", "crate", "--measure"],
    &["diagram"],
    &["orbits"],
];

/// Standard output of a command, as JSON without times. Direct simulation alone measures no map:
/// the corresponding members of a saved map are dropped.
fn result(folder: &Path, command: &[&str], source: &str, set: &[&str]) -> serde_json::Value {
    let ([name], options) = command.split_at(1) else { unreachable!("a command has a name") };
    let arguments = [&[name, source], options, &["-q", "--json", "-"], set].concat();
    let output = grazemap(folder, &arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    let mut json = serde_json::from_slice(&output.stdout).expect("standard output is JSON alone");
    let measured: &[&str] = if options.contains(&"direct") { &["errors", "sample"] } else { &[] };
    drop_members(&mut json, &[&["timing", "speed_ratio"], measured].concat());
    json
}

fn drop_members(json: &mut serde_json::Value, names: &[&str]) {
    match json {
        serde_json::Value::Array(values) => {
            values.iter_mut().for_each(|value| drop_members(value, names));
        }
        serde_json::Value::Object(members) => {
            members.retain(|key, _| !names.contains(&key.as_str()));
            members.values_mut().for_each(|value| drop_members(value, names));
        }
        _ => {}
    }
}

/// Saves map and orbit of a scene, and compares the results of commands on all three.
fn agree(scene: &str, set: &[&str], states: &str, commands: &[&[&str]]) {
    let folder = scratch();
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    for (command, file) in [("expand", "map.json"), ("locate", "orbit.json")] {
        let save = [&[command, scene, "-q", "--json", file], set].concat();
        let output = grazemap(folder.path(), &save);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    for command in commands {
        let expected = result(folder.path(), command, scene, set);
        let from = |file| result(folder.path(), command, file, &[]);
        assert!(from("map.json") == expected, "{scene}: {command:?} of the map");
        assert!(from("orbit.json") == expected, "{scene}: {command:?} of the orbit");
    }
}

#[test]
fn a_saved_orbit_and_a_saved_map_give_the_bits_of_their_scene() {
    agree("linear", &QUICK, "x,theta,alpha\n1e-6,2e-5,1e-6\n-1e-5,1e-4,0\n", &COMMANDS);
}

#[test]
fn a_saved_map_is_the_one_that_was_chosen_on_the_section_that_was_taken() {
    let set = ["--set", "expansion.tolerance=1e-3", "--set", "section.kind=any"];
    agree("moving_stop", &set, "x,v,alpha\n-1e-4,0.01,1e-4\n", &COMMANDS[..2]);
}

#[test]
fn a_saved_flown_map_and_one_of_several_passages_give_the_bits_of_their_scenes() {
    let flown = ["--set", "emit.shape=flown"];
    agree("soft_a", &flown, "u\n1e-6\n-2e-6\n", &COMMANDS[..2]);
    agree("two_stops_t1", &[], "x1\n1e-6\n-2e-6\n", &COMMANDS[..2]);
}

#[test]
fn a_study_of_a_saved_map_is_that_of_its_scene() {
    let folder = scratch();
    let study = |source: &str, set: &[&str]| {
        let converge = ["converge", source, "-q", "--fresh", "5", "-o", "out"];
        let output = grazemap(folder.path(), &[&converge[..], set].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        fs::read_to_string(folder.path().join("out/convergence.json")).expect("there")
    };
    let expected = study("linear", &QUICK);
    let save = [&["expand", "linear", "-q", "--json", "map.json"], &QUICK[..]].concat();
    assert!(grazemap(folder.path(), &save).status.success());
    assert_eq!(study("map.json", &[]), expected);
}

/// Checks that a document, read and written again, is the same.
fn reads_back<T: Serialize + DeserializeOwned>(folder: &Path, file: &str) {
    let text = fs::read_to_string(folder.join(file)).expect("there");
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).expect("JSON");
    let read: T = serde_json::from_str(&text).unwrap_or_else(|fault| panic!("{file}: {fault}"));
    let again = json(&to_json(&read).expect("JSON"));
    let members = |json: serde_json::Value| match json {
        serde_json::Value::Array(documents) => documents,
        document => vec![document],
    };
    let (written, again) = (members(json(&text)), members(again));
    assert_eq!(written.len(), again.len(), "{file}");
    for (written, again) in written.iter().zip(&again) {
        let again = again.as_object().expect("an object");
        assert!(again.len() > 5, "{file}");
        for (key, value) in again {
            assert!(written[key] == *value, "{file}: {key}");
        }
    }
}

#[test]
fn results_are_read_back_as_the_values_that_they_were() {
    let folder = scratch();
    let run = |arguments: &[&str]| {
        let output = grazemap(folder.path(), &[arguments, &["-q", "-o", "out"], &QUICK].concat());
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    };
    // The root of a negative number is no number.
    run(&["diagram", "linear", "--set", "diagram.0.observe=sqrt(x - 1)"]);
    run(&["chart", "cantilever_3_5_soft", "--set", "chart.0.points=[6, 5]"]);
    run(&["basin", "linear", "--points", "12"]);
    run(&["converge", "linear", "--fresh", "5"]);
    let out = folder.path().join("out");
    let diagrams = fs::read_to_string(out.join("diagram.json")).expect("there");
    assert!(diagrams.contains("\"values\": [null"), "no value is missing");
    reads_back::<Vec<Diagram>>(&out, "diagram.json");
    reads_back::<Vec<Chart>>(&out, "chart.json");
    reads_back::<Basin>(&out, "basin.json");
    reads_back::<ConvergenceStudy>(&out, "convergence.json");
}

#[test]
fn images_in_double_double_and_by_simulation_are_those_of_the_scene() {
    let exact = ["image", "--states", "states.csv", "--precision", "dd"];
    let direct = [&exact[..], &["--using", "direct"]].concat();
    agree("linear", &QUICK, "x,theta,alpha\n1e-6,2e-5,1e-6\n", &[&exact, &direct]);
}

#[test]
fn a_changed_coefficient_changes_the_image_and_a_wrong_document_is_refused() {
    let folder = scratch();
    let place = |name: &str| folder.path().join(name);
    fs::write(place("states.csv"), "x\n1e-6\n").expect("writable");
    let save = [&["expand", "linear", "-q", "--json", "map.json"], &QUICK[..]].concat();
    assert!(grazemap(folder.path(), &save).status.success());
    let saved = fs::read_to_string(place("map.json")).expect("there");
    let image = |text: &str| {
        fs::write(place("map.json"), text).expect("writable");
        let image = ["image", "map.json", "--states", "states.csv"];
        let output = grazemap(folder.path(), &image);
        (output.status.code(), [output.stdout, output.stderr].map(|said| super::text(&said)))
    };
    let (code, [before, _]) = image(&saved);
    assert_eq!(code, Some(0));

    let json = || serde_json::from_str::<serde_json::Value>(&saved).expect("JSON");
    let mut changed = json();
    let stages = changed["map"]["stages"].as_array_mut().expect("a list");
    let leg = stages.iter_mut().find(|stage| !stage["leg"].is_null());
    let coefficient = &mut leg.expect("a leg")["leg"]["image"][0]["coefficients"][1];
    *coefficient = (coefficient.as_f64().expect("a number") * (1.0 + 1e-9)).into();
    let (code, [_, said]) = image(&changed.to_string());
    assert!(code == Some(2) && said.contains("not those that were saved"), "{said}");
    let members = changed.as_object_mut().expect("an object");
    assert!(members.remove("integrity").is_some());
    let (code, [after, _]) = image(&changed.to_string());
    assert!(code == Some(0) && after != before, "{after}");

    let spoil = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut spoilt = json();
        spoilt.as_object_mut().expect("an object").remove("integrity");
        change(&mut spoilt);
        image(&spoilt.to_string())
    };
    let (code, [_, said]) = spoil(&|map| map["format"] = 2.into());
    let expected = "error: map.json holds no saved orbit or map: expected format 1, found format 2";
    assert_eq!((code, said.trim()), (Some(2), expected));
    let (code, [_, said]) = spoil(&|map| map["document"] = "chart".into());
    assert!(code == Some(2) && said.contains("kind Chart"), "{said}");
    let (code, [_, said]) = spoil(&|map| map["map"]["section"]["point"] = serde_json::json!([]));
    assert!(
        code == Some(2) && said.contains("its coordinates are not those of its scene"),
        "{said}"
    );
    let (code, [_, said]) = spoil(&|map| map["orbit"]["passages"] = serde_json::json!([]));
    assert!(code == Some(2) && said.contains("its passages are not those"), "{said}");
    let (code, _) = image("{}");
    assert_eq!(code, Some(2));
    let output = grazemap(folder.path(), &["expand", "map.json", "--set", "omega=2"]);
    let said = text(&output.stderr);
    assert!(
        output.status.code() == Some(2) && said.contains("`omega` can be set in a scene alone")
    );
}
