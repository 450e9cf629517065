//! `grazemap orbits` as users run it.

use std::fs;

use super::{grazemap, json, scratch, text};

#[test]
fn orbits_have_the_fields_promised_and_their_table_has_the_same_numbers() {
    let folder = scratch();
    let found =
        json(folder.path(), &["orbits", "linear", "--at", "alpha=-1e-4", "--json", "-", "-q"]);
    assert_eq!(found["passages"], serde_json::json!(["stop"]));
    assert_eq!(found["section"]["coordinates"], serde_json::json!(["x", "theta"]));
    assert!(found["loci"].is_null() && found["using"] == "map");
    let orbits = found["orbits"].as_array().expect("a list");
    let of = |itinerary: &str| {
        let found = orbits.iter().filter(|orbit| orbit["itinerary"] == itinerary);
        found.filter(|orbit| orbit["physical"] == true).collect::<Vec<_>>()
    };
    // Before the graze the free orbit is stable, and one with a contact a return is a saddle.
    let (free, touching) = (of("0"), of("1"));
    assert_eq!((free.len(), touching.len()), (1, 1));
    assert!(free[0]["stable"] == true && touching[0]["stable"] == false);
    assert_eq!(free[0]["contacts"], serde_json::json!([]));
    let orbit = touching[0];
    assert_eq!((&orbit["name"], &orbit["inside"]), (&"(1,1)".into(), &true.into()));
    assert_eq!(orbit["parameters"], serde_json::json!({ "alpha": -1e-4, "omega": 0.0 }));
    assert_eq!(orbit["contacts"][0]["surface"], "stop");
    assert!(orbit["contacts"][0]["speed"].as_f64() > Some(0.0));
    assert_eq!(orbit["multipliers"].as_array().map(Vec::len), Some(2));

    let arguments = ["orbits", "linear", "--at", "alpha=-1e-4", "-q", "-o", "out"];
    assert!(grazemap(folder.path(), &arguments).status.success());
    let written = fs::read_to_string(folder.path().join("out/orbits.csv")).expect("written");
    let mut lines = written.lines();
    assert_eq!(
        lines.next(),
        Some(
            "itinerary,name,alpha,omega,x,theta,multiplier_1_re,multiplier_1_im,multiplier_2_re,multiplier_2_im,stable,physical,inside,extra_contacts,speeds"
        )
    );
    assert_eq!(lines.count(), orbits.len());
    assert!(folder.path().join("out/orbits.json").exists());
}

#[test]
fn direct_simulation_has_the_orbits_of_the_map_and_says_so() {
    let folder = scratch();
    let run = |using: &str| {
        let arguments = ["orbits", "moving_stop", "--period", "2", "--using", using, "--json", "-"];
        json(folder.path(), &arguments)
    };
    let (map, direct) = (run("map"), run("direct"));
    let physical = map["orbits"].as_array().expect("a list").iter();
    let physical: Vec<_> = physical.filter(|orbit| orbit["physical"] == true).collect();
    let direct = direct["orbits"].as_array().expect("a list");
    assert!(!direct.is_empty() && physical.len() == direct.len());
    for (map, direct) in physical.iter().zip(direct) {
        assert_eq!(map["itinerary"], direct["itinerary"]);
        assert_eq!((&direct["extra_contacts"], &direct["physical"]), (&0.into(), &true.into()));
        assert!(map["extra_contacts"].is_null());
    }
}

#[test]
fn loci_are_written_beside_the_orbits() {
    let folder = scratch();
    let arguments = [
        "orbits",
        "linear_codim2",
        "--itinerary",
        "1",
        "--fold",
        "--flip",
        "--in",
        "omega,alpha",
        "--points",
        "5",
        "--csv",
        "-",
        "-q",
        "-o",
        "out",
    ];
    let output = grazemap(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let csv = text(&output.stdout);
    // At two offsets below the point there are folds, above it flips, and at it none.
    let kinds = |kind: &str| csv.lines().filter(|line| line.starts_with(kind)).count();
    assert_eq!((kinds("fold,1,"), kinds("flip,1,")), (2, 2), "{csv}");
    let written = |name: &str| fs::read_to_string(folder.path().join("out").join(name));
    assert_eq!(written("loci.csv").expect("written"), csv);
    let json: serde_json::Value =
        serde_json::from_str(&written("orbits.json").expect("written")).expect("JSON");
    assert_eq!(json["loci"][0]["kind"], "fold");
    assert_eq!(json["loci"][0]["points"].as_array().map(Vec::len), Some(2));
}

#[test]
fn an_unstable_orbit_is_said_to_be_unstable_once() {
    let folder = scratch();
    let words = |zeta: &str, name: &str| {
        let zeta = format!("model.parameters.zeta={zeta}");
        let output = grazemap(folder.path(), &["locate", name, "--set", &zeta]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout).matches("orbit is unstable").count()
    };
    assert_eq!(["-0.02", "0", "0.05"].map(|zeta| words(zeta, "linear")), [1, 0, 0]);
    // Theory says nothing of the stability of an orbit with two passages.
    assert_eq!(words("-0.02", "two_stops_t1"), 1);
}

#[test]
fn a_stop_that_the_orbit_does_not_hit_is_named() {
    let folder = scratch();
    let words = |changes: &[&str]| {
        let output = grazemap(folder.path(), &[&["locate", "two_sided"], changes].concat());
        (text(&output.stdout), text(&output.stderr))
    };
    let unhit = "note: the orbit does not hit `left`, which `hits` names";
    assert!(!words(&[]).0.contains(unhit));
    // The free motion reaches 2.70.
    let (found, problems) = words(&["--set", "dl=20"]);
    assert!(found.contains(unhit), "{found}{problems}");
    // A ball that starts on the table, falls through it and meets it no more.
    let ball = r#"
[model]
states = ["x", "v"]
parameters = { A = 0.62, g = 1.0, w = 2.0, r = 0.5 }
phase = { name = "theta", rate = "w", period = "2*pi" }
flow = { x = "v", v = "-g" }
[[model.surface]]
name = "table"
event = "x - A*sin(theta)"
impact = { v = "-r*v + (1 + r)*A*w*cos(theta)" }
[grazing]
surface = "table"
hits = "table"
periods = 2
solve_for = "A"
"#;
    fs::write(folder.path().join("ball.toml"), ball).expect("written");
    let problems = text(&grazemap(folder.path(), &["locate", "ball.toml"]).stderr);
    assert!(problems.contains("no periodic orbit that hits `table`"), "{problems}");
}
