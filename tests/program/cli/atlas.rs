//! `grazemap atlas`: a region about the grazing orbit, its measurement, its file.

use std::fs;

use super::{grazemap, json, scratch, text};

/// A small region of the linear oscillator, at few points.
const SMALL: [&str; 4] = ["atlas", "linear", "--points", "60"];

fn count(document: &serde_json::Value, kind: &str, of: &str) -> f64 {
    let leaves = document["leaves"].as_array().expect("a list");
    let record = leaves.iter().find(|record| record["kind"] == kind).expect("every kind");
    record[of].as_f64().expect("a number")
}

#[test]
fn an_atlas_of_the_linear_oscillator_keeps_its_tolerance_on_its_own_region() {
    let folder = scratch();
    let found = json(folder.path(), &["atlas", "linear", "--json", "-"]);
    assert_eq!(found["document"], "atlas");
    assert_eq!(found["points"]["tabulated"], 500);
    assert_eq!(found["violations"], serde_json::json!([]));
    assert!(found["largest_error"].as_f64().expect("a number") < 1e-6);
    assert!(count(&found, "grazed", "leaves") > 0.0);
    let kinds = ["smooth", "grazed", "direct", "not made"];
    let shares: f64 = kinds.iter().map(|kind| count(&found, kind, "share")).sum();
    assert!((shares - 1.0).abs() < 1e-12, "{shares}");
    // The orbit is x = cos(theta - 3.0614): at the phase farthest from the stop x = -1, v = 0.
    let middle = |name: &str| {
        let ends = &found["region"][name];
        let ends = [0, 1].map(|end| ends[end].as_f64().expect("a number"));
        (0.5 * (ends[0] + ends[1]), ends[1] - ends[0])
    };
    let ((x, wide), (v, fast)) = (middle("x"), middle("v"));
    assert!((x + 1.0).abs() < 1e-3 && v.abs() < 0.05, "{x} {v}");
    assert!((wide - 0.2).abs() < 1e-3 && (fast - 0.36).abs() < 1e-3, "{wide} {fast}");
}

#[test]
fn ranges_of_an_atlas_are_offsets_or_values() {
    let folder = scratch();
    let region = |range: &str| {
        let more = ["--range", range, "--phase", "0", "--json", "-", "-q"];
        json(folder.path(), &[&SMALL[..], &more].concat())["region"].clone()
    };
    let values = region("x=@-1.02:@-0.98,v=@0.1:@0.2,alpha=@2.24:@2.26");
    let ends = |name: &str| [0, 1].map(|end| values[name][end].as_f64().expect("a number"));
    for (name, [from, to]) in [("x", [-1.02, -0.98]), ("v", [0.1, 0.2]), ("alpha", [2.24, 2.26])] {
        let [low, high] = ends(name);
        assert!((low - from).abs() < 1e-14 && (high - to).abs() < 1e-14, "{name} {low} {high}");
    }
    let offsets = region("x=-0.02:0.02,v=-0.05:0.05,alpha=-0.01:0.01");
    let middle = 0.5
        * (offsets["alpha"][0].as_f64().expect("a number")
            + offsets["alpha"][1].as_f64().expect("a number"));
    assert!((middle - 2.247_220_505_424_423).abs() < 1e-12, "{middle}");
}

#[test]
fn an_atlas_ends_at_its_bound_on_boxes_and_says_so() {
    let folder = scratch();
    let bounded = [&SMALL[..], &["--boxes", "6", "--json", "-"]].concat();
    let output = grazemap(folder.path(), &bounded);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let words = text(&output.stderr);
    assert!(words.contains("the bound of 6 expanded boxes was reached"), "{words}");
    let found = json(folder.path(), &bounded);
    assert_eq!((&found["limit_reached"], &found["expanded"]), (&true.into(), &6.into()));
    assert!(found["points"]["direct"].as_u64().expect("a count") > 0);
}

#[test]
fn a_saved_atlas_goes_on_without_new_boxes() {
    let folder = scratch();
    let saving = [&SMALL[..], &["--save", "a.atlas", "--json", "-"]].concat();
    let made = json(folder.path(), &saving);
    let loading = [&SMALL[..], &["--load", "a.atlas", "--boxes", "0", "--json", "-"]].concat();
    let loaded = json(folder.path(), &loading);
    for key in ["region", "expanded", "leaves", "points", "largest_error", "tolerance"] {
        assert_eq!(loaded[key], made[key], "{key}");
    }
}

#[test]
fn an_atlas_of_another_scene_or_a_damaged_one_is_refused() {
    let folder = scratch();
    let saved = grazemap(folder.path(), &[&SMALL[..], &["--save", "a.atlas", "-q"]].concat());
    assert!(saved.status.success(), "{}", text(&saved.stderr));
    let refused = |arguments: &[&str]| {
        let output = grazemap(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        text(&output.stderr)
    };
    let words = refused(&["atlas", "foale", "--load", "a.atlas"]);
    assert!(words.contains("made for a scene with the digest"), "{words}");
    let words = refused(&["atlas", "linear", "--set", "r=0.7", "--load", "a.atlas"]);
    assert!(words.contains("made for a scene with the digest"), "{words}");
    let path = folder.path().join("a.atlas");
    let mut bytes = fs::read(&path).expect("it was written");
    *bytes.last_mut().expect("content") ^= 1;
    fs::write(&path, bytes).expect("a scratch file");
    let words = refused(&["atlas", "linear", "--load", "a.atlas"]);
    assert!(words.contains("does not match its digest"), "{words}");
    fs::write(&path, "nothing").expect("a scratch file");
    let words = refused(&["atlas", "linear", "--load", "a.atlas"]);
    assert!(words.contains("its first line is not `grazemap atlas 1`"), "{words}");
}

#[test]
fn scenes_and_ranges_that_an_atlas_cannot_hold_are_refused_with_the_reason() {
    let folder = scratch();
    let refused = |arguments: &[&str]| {
        let output = grazemap(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stderr));
        text(&output.stderr)
    };
    let words = refused(&["atlas", "self_excited"]);
    assert!(words.contains("needs a model with a forcing phase"), "{words}");
    let words = refused(&["atlas", "linear", "--range", "y=0:1"]);
    assert!(words.contains("`y` is neither a state nor a parameter"), "{words}");
    let words = refused(&["atlas", "linear", "--range", "x=0.1:-0.1"]);
    assert!(words.contains("from a lower to a higher number"), "{words}");
    let words = refused(&["atlas", "linear", "--range", "alpha=0:1e-3", "--at", "alpha=1e-3"]);
    assert!(words.contains("`alpha` twice"), "{words}");
    let words = refused(&["atlas", "linear", "--tolerance=-1"]);
    assert!(words.contains("must be a positive number; -1 was given"), "{words}");
}

#[test]
fn the_picture_of_an_atlas_names_words_of_contacts_and_shows_the_graze_curve() {
    let folder = scratch();
    let output = grazemap(folder.path(), &[&SMALL[..], &["-o", "out", "-q"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let read = |name: &str| {
        let path = folder.path().join("out").join(name);
        fs::read_to_string(path).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let picture = read("atlas.svg");
    for name in ["no contact", "stop", "boxes", "graze"] {
        assert!(picture.contains(name), "{name}");
    }
    let document: serde_json::Value = serde_json::from_str(&read("atlas.json")).expect("JSON");
    assert_eq!(document["times"], serde_json::Value::Null);
    assert_eq!(read("atlas.csv").lines().count(), 5);
}

#[test]
fn a_region_with_a_parameter_has_a_time_with_the_parameter_fixed() {
    let folder = scratch();
    let more = ["--range", "alpha=-1e-3:1e-3", "--json", "-", "-q"];
    let found = json(folder.path(), &[&SMALL[..], &more].concat());
    for name in ["step", "frozen_step", "direct"] {
        assert!(found["times"][name].as_f64().is_some_and(|time| time > 0.0), "{name}: {found}");
    }
    let plain = json(folder.path(), &[&SMALL[..], &["--json", "-", "-q"]].concat());
    assert_eq!(plain["times"]["frozen_step"], serde_json::Value::Null);
}

#[test]
fn an_atlas_of_more_boxes_than_fit_in_memory_is_refused_before_it_is_made() {
    let folder = scratch();
    let more = ["--range", "alpha=-1e-3:1e-3,omega=-1e-3:1e-3", "--order", "20"];
    let call = [&["atlas", "linear", "--boxes", "100000000"], &more[..]].concat();
    let output = grazemap(folder.path(), &call);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).starts_with("error: the results take about "));
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_exceed_the_limit_of_the_process_are_refused() {
    let script = "ulimit -v 2000000; exec \"$0\" atlas linear --boxes 5000000 --points 5";
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", script, env!("CARGO_BIN_EXE_grazemap")]);
    let output = shell.current_dir(scratch().path()).output().expect("a shell");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).starts_with("error: the results take about 3"), "{output:?}");
}
