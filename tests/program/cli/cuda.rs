//! Charts on a GPU, replaced here by a double (`double.cpp`) that compiles the same source for the
//! CPU. Without a C++ compiler the tests print that they were skipped.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::resuming::files;
use super::{grazemap, scratch, text};

/// Builds the double into a folder; prints a note and returns `false` without a compiler.
fn double(folder: &Path) -> bool {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/cli/double.cpp");
    let library = folder.join("libcuda.so");
    let built = Command::new("c++")
        .args(["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-o"])
        .args([&library, &source])
        .arg("-ldl")
        .output();
    match built {
        Err(_) => {
            eprintln!("skipped: there is no compiler `c++` for the double of a graphics processor");
            false
        }
        Ok(output) => {
            assert!(output.status.success(), "{}", text(&output.stderr));
            fs::copy(&library, folder.join("libnvrtc.so")).expect("a file");
            true
        }
    }
}

/// Runs the program with the double instead of a GPU.
fn on_double(folder: &Path, arguments: &[&str], more: &[(&str, &str)]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grazemap"))
        .args(arguments)
        .env("LD_LIBRARY_PATH", folder)
        .env("DOUBLE_NOTES", folder.join("notes"))
        .envs(more.iter().copied())
        .current_dir(folder)
        .output()
        .expect("the program can be started")
}

/// Saves a map with charts: by the map and guarded, with every kind of observable.
fn charted(folder: &Path) {
    let call = |arguments: &[&str]| {
        let output = grazemap(folder, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    };
    call(&["new", "cantilever_3_5_soft", "-q", "-o", "scene.toml"]);
    let scene = fs::read_to_string(folder.join("scene.toml")).expect("readable");
    let own = scene.find("[[diagram]]").unwrap_or(scene.len());
    let chart = |rest: &str| {
        format!(
            "[[chart]]\nparameters = [\"beta\", \"Q\"]\nranges = [[-3.3e-4, 3.3e-4], \
             [-1e-4, 1.8e-4]]\ntransient = 100\nkeep = 12\n{rest}\n"
        )
    };
    let charts = [
        chart("points = 24\nwith = [\"map\", \"guarded\"]\ncells = \"all\""),
        chart("points = [48, 40]\nobserve = \"itinerary\"\ncells = \"borders\""),
        chart("points = 5\nobserve = \"lyapunov\"\nwith = [\"map\", \"guarded\"]"),
        chart("points = 14\nobserve = \"attractors\"\nattractors = 3\ncells = \"all\""),
        chart("points = 3\nwith = [\"direct\"]\ncells = \"all\""),
    ];
    let scene = format!("{}\n{}", &scene[..own], charts.concat());
    fs::write(folder.join("scene.toml"), scene).expect("written");
    call(&["expand", "scene.toml", "-q", "-o", "."]);
}

fn equal(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn a_chart_on_a_graphics_processor_has_the_bytes_of_the_processors_chart() {
    let folder = scratch();
    let folder = folder.path();
    if !double(folder) {
        return;
    }
    charted(folder);
    let expected = grazemap(folder, &["chart", "map.json", "-o", "expected"]);
    assert!(expected.status.success(), "{}", text(&expected.stderr));
    let expected = files(&folder.join("expected"));
    let chart = ["chart", "map.json", "--device", "cuda", "-o"];

    let output = on_double(folder, &[&chart[..], &["found"]].concat(), &[]);
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("double: ") && said.contains("handed back"), "{said}");
    assert!(said.contains("direct simulation is not there"), "{said}");
    equal(&files(&folder.join("found")), &expected);
    // Copies overlap with kernels if several streams have work.
    let notes = fs::read_to_string(folder.join("notes")).expect("the double was called");
    assert!(!notes.contains(" 1 streams") && !notes.contains(" 0 streams"), "{notes}");

    // A device that fails midway loses no results.
    let fails = [("DOUBLE_FAILS_AT", "3")];
    let output = on_double(folder, &[&chart[..], &["failed"]].concat(), &fails);
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("double failed") && said.contains("LAUNCH_FAILED"), "{said}");
    equal(&files(&folder.join("failed")), &expected);

    // Shards of one device and of the other are joined.
    for (shard, device) in [("1/2", "cuda"), ("2/2", "cpu")] {
        let call =
            ["chart", "map.json", "--device", device, "--shard", shard, "-o", "pieces", "-q"];
        let output = on_double(folder, &call, &[]);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    let pieces = ["pieces/chart-1-of-2.pieces", "pieces/chart-2-of-2.pieces"];
    let output = grazemap(folder, &[&["merge", "-o", "joined"], &pieces[..]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    equal(&files(&folder.join("joined")), &expected);
}

#[test]
fn without_a_driver_or_a_compiler_it_is_said_what_was_looked_for() {
    let folder = scratch();
    let call = ["chart", "cantilever_3_5_soft", "--device", "cuda"];
    let refused = |what: &str| {
        let output = on_double(folder.path(), &call, &[]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what) && said.contains("LD_LIBRARY_PATH"), "{said}");
        assert!(output.stdout.is_empty());
    };
    if on_double(folder.path(), &call, &[]).status.success() {
        eprintln!("skipped: this machine has a graphics processor");
        return;
    }
    refused("libcuda.so");
    if double(folder.path()) {
        fs::remove_file(folder.path().join("libnvrtc.so")).expect("a file");
        refused("libnvrtc.so");
    }
    let output = grazemap(folder.path(), &["chart", "linear", "--device", "abacus"]);
    assert_eq!(output.status.code(), Some(2));
}
