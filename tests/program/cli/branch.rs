//! `grazemap branch` as users run it.

use std::fs;

use grazemap::model::catalogue;

use super::{grazemap, json, scratch, text};

#[test]
fn branches_have_the_columns_promised_and_meet_at_the_graze() {
    let folder = scratch();
    let arguments =
        ["branch", "foale_omega_2_2", "--along", "alpha", "--period", "1", "-q", "-o", "out"];
    let output = grazemap(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = fs::read_to_string(folder.path().join("out/branch.csv")).expect("written");
    let mut lines = written.lines();
    assert_eq!(
        lines.next(),
        Some(
            "branch,itinerary,period,alpha,alpha_value,x,theta,re1,im1,re2,im2,stable,physical,\
             inside,speeds,label,name"
        )
    );
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let grazes: Vec<_> = rows.iter().filter(|row| row[15] == "GR").collect();
    // The orbit without contact and that with one, each at its graze; a multiplier is infinite
    // where a contact has no speed.
    let itineraries: Vec<&str> = grazes.iter().map(|row| row[1]).collect();
    assert_eq!(itineraries, ["1", "0"]);
    assert!(grazes.iter().all(|row| row[3].parse::<f64>().is_ok_and(|x| x.abs() < 1e-12)));
    assert!(grazes[0][7].is_empty() && grazes[0][11].is_empty() && !grazes[1][7].is_empty());
    // Above omega = 2 the orbit with a contact is physical beyond the graze alone.
    let physical = |row: &&Vec<&str>| row[1] == "1" && row[12] == "1" && row[15].is_empty();
    let mut offsets = rows.iter().filter(physical).map(|row| row[3].parse::<f64>());
    assert!(offsets.all(|offset| offset.is_ok_and(|offset| offset > 0.0)));
    for name in ["branch.json", "branch.svg", "branch.png", "branch-x.svg", "branch-theta.png"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
}

#[test]
fn branches_have_the_fields_promised() {
    let folder = scratch();
    let arguments = [
        "branch",
        "foale",
        "--along",
        "alpha",
        "--itinerary",
        "1",
        "--from",
        "-1e-3",
        "--to",
        "1e-3",
        "--json",
        "-",
        "-q",
    ];
    let found = json(folder.path(), &arguments);
    assert_eq!(found["document"], "branch");
    assert_eq!((&found["using"], &found["along"]), (&"map".into(), &"alpha".into()));
    let branches = found["branches"].as_array().expect("a list");
    // The one without contact is followed unasked: the graze leads to it.
    let itineraries: Vec<_> = branches.iter().map(|branch| &branch["itinerary"]).collect();
    assert_eq!(itineraries, ["1", "0"]);
    let points = branches[0]["points"].as_array().expect("a list");
    let graze = points.iter().find(|point| point["label"] == "GR").expect("its graze");
    assert_eq!(graze["grazing"], serde_json::json!([[0, 0]]));
    // Foale: near grazing alpha = alpha_c + r z y, z = -0.4719 at omega = 1.8.
    let slope = graze["coefficient"].as_f64().expect("a slope");
    assert!((slope - 0.7 * -0.4719).abs() < 1e-4, "{slope}");
}

#[test]
fn a_branch_that_is_not_there_and_parameters_that_do_not_vary_are_said() {
    let folder = scratch();
    let far = ["branch", "linear", "--along", "alpha", "--itinerary", "1", "--from", "5e-4", "-q"];
    let output = grazemap(folder.path(), &far);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("another range of the parameter, further starts"));
    let frozen = grazemap(folder.path(), &["branch", "linear", "--along", "zeta"]);
    assert_eq!(frozen.status.code(), Some(2));
    assert!(text(&frozen.stderr).contains("--along"), "{}", text(&frozen.stderr));
}

/// Scene `two_sided` without its hits: the orbit of its free flow passes through the left stop.
fn without_hits() -> String {
    let text = catalogue::text("two_sided").expect("a scene of the catalogue");
    text.replace("hits = \"left\"\n", "")
}

/// Oscillator that grazes the right stop, then hits it, and grazes the left one at a larger `a`.
const OTHER_STOP: &str = r#"
[model]
states = ["x", "v"]
parameters = { z = 0.1, a = 1.0, w = 0.9, dl = 1.6, dr = 1.0, r = 0.5 }
phase = { name = "theta", rate = "w", period = "2*pi" }
[model.flow]
x = "v"
v = "a*cos(theta) - 2*z*v - x"
[[model.surface]]
name = "right"
event = "dr - x"
impact = { v = "-r*v" }
[[model.surface]]
name = "left"
event = "x + dl"
impact = { v = "-r*v" }
[grazing]
surface = "right"
solve_for = "a"
[expansion]
active = ["a", "w"]
"#;

/// Numbers of the special points of a branch document, with their labels and offsets of `dr`.
fn special_points(document: &serde_json::Value) -> Vec<(usize, String, f64)> {
    let branches = document["branches"].as_array().expect("a list").iter();
    let points = branches.flat_map(|branch| branch["points"].as_array().expect("a list"));
    let special = points.filter(|point| point["label"].is_string());
    let described = special.zip(1..).map(|(point, number)| {
        let label = point["label"].as_str().expect("letters").to_owned();
        (number, label, point["parameters"]["dr"].as_f64().expect("an offset"))
    });
    described.collect()
}

#[test]
fn a_graze_of_a_branch_is_located_with_the_hits_of_its_orbit() {
    let folder = scratch();
    fs::write(folder.path().join("two.toml"), without_hits()).expect("writable");
    let range = ["--along", "dr", "--from", "-1", "--to", "-0.8", "--period", "2"];
    let branch = [&["branch", "two.toml"], &range[..], &["--method", "direct", "-q"]].concat();
    let output = grazemap(folder.path(), &[&branch[..], &["--json", "branch.json"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let document = fs::read_to_string(folder.path().join("branch.json")).expect("written");
    let document: serde_json::Value = serde_json::from_str(&document).expect("JSON");
    let points = special_points(&document);
    let locate = |scene: &str, number: usize| {
        let from = format!("branch.json#{number}");
        grazemap(folder.path(), &["locate", scene, "--from", &from])
    };
    let graze =
        points.iter().find(|(_, label, dr)| label == "GR" && (dr + 0.905_917_8).abs() < 1e-7);
    let output = locate("two.toml", graze.expect("the graze of the attractor").0);
    let (found, said) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(found.contains("grazes `right` at dr = 1.805712936554821"), "{found}");
    assert!(found.contains("hits of a period") && found.contains("1.884269457"), "{found}");
    assert!(said.contains("grazing.hits = [\"left\"]"), "{said}");

    let refused = |scene: &str, number: usize, reason: &str| {
        let output = locate(scene, number);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(reason), "{said}");
    };
    let flip = points.iter().find(|(_, label, _)| label == "PD").expect("a period-doubling");
    refused("two.toml", flip.0, "is a PD, not a graze (GR)");
    refused("two.toml", points.len() + 1, &format!("it has {}, numbered from 1", points.len()));
    refused("two_sided", 1, "its branches are those of a scene `two` with the digest");
}

#[test]
fn a_graze_of_a_stop_without_a_passage_is_located() {
    let folder = scratch();
    fs::write(folder.path().join("two.toml"), OTHER_STOP).expect("writable");
    let branch = ["branch", "two.toml", "--along", "a", "--from", "0.2", "--to", "0.9", "--period"];
    let saved = ["1", "--method", "direct", "--json", "branch.json"];
    let output = grazemap(folder.path(), &[&branch[..], &saved].concat());
    let listed = text(&output.stdout);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let row = listed.lines().find(|line| line.contains("GR left")).expect("a graze of that stop");
    let number = row.split_whitespace().next().expect("a number");
    let from = format!("branch.json#{number}");
    let output = grazemap(folder.path(), &["locate", "two.toml", "--from", &from]);
    let (found, said) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(found.contains("grazes `left` at a = 1.11521829"), "{found}");
    assert!(said.contains("grazing.hits = [\"right\"]"), "{said}");
}

#[test]
fn a_place_that_is_no_point_of_a_branch_document_is_refused() {
    let folder = scratch();
    let saved = grazemap(folder.path(), &["locate", "linear", "-q", "--json", "orbit.json"]);
    assert!(saved.status.success(), "{}", text(&saved.stderr));
    let cases = [
        ("orbit.json#1", "it is a document of kind Orbit"),
        ("nothing.json#1", "cannot read nothing.json"),
        ("branch.json", "expected FILE#N"),
        ("branch.json#0", "expected FILE#N"),
    ];
    for (place, reason) in cases {
        let output = grazemap(folder.path(), &["locate", "linear", "--from", place]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{place}: {said}");
        assert!(said.contains(reason), "{place}: {said}");
    }
}
