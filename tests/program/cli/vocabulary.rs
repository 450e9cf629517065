//! One vocabulary: names of options with their older spellings, offsets and values, pictures that
//! options ask for, and the commands in groups.

use std::f64::consts::PI;
use std::fs;

use grazemap::Scene;
use grazemap::hybrid::{HybridSystem, Simulator};

use super::{grazemap, json, scratch, text};

fn printed(arguments: &[&str]) -> String {
    let folder = scratch();
    let output = grazemap(folder.path(), arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn older_spellings_give_the_same_bytes() {
    let csv = |arguments: &[&str]| printed(&[arguments, &["--csv", "-", "-q"]].concat());
    let branch = ["branch", "linear", "--along", "alpha", "--from=-1e-4", "--to=1e-4"];
    let one = ["--itinerary", "1"];
    let pairs: [[&[&str]; 2]; 3] = [
        [
            &[&branch[..], &one, &["--method", "map"]].concat(),
            &[&branch[..], &one, &["--using", "map"]].concat(),
        ],
        [
            &["loci", "linear", "--plane", "omega,alpha", "--kind", "GR", "--from=-1e-4", "--to=0"],
            &["loci", "linear", "--in", "omega,alpha", "--kind", "graze", "--from=-1e-4", "--to=0"],
        ],
        [
            &["basin", "linear", "--plane", "x,theta", "--points", "8", "--method", "direct"],
            &["basin", "linear", "--axes", "x,theta", "--points", "8", "--with", "direct"],
        ],
    ];
    for [newer, older] in pairs {
        assert_eq!(csv(newer), csv(older), "{newer:?}");
    }
}

#[test]
fn ends_of_a_curve_are_offsets_or_values() {
    let folder = scratch();
    let curve = |arguments: &[&str]| {
        let command = [&["curve", "linear"], arguments, &["--json", "-", "-q"]].concat();
        json(folder.path(), &command)["points"].clone()
    };
    let values = curve(&["--with", "omega", "--from", "1.75", "--to", "2"]);
    assert_eq!(curve(&["--along", "omega", "--from", "@1.75", "--to", "@2"]), values);
    let all = ["--along", "omega", "--from", "1.75", "--to", "2", "--values"];
    assert_eq!(curve(&all), values);
    let offsets = curve(&["--along", "omega", "--from=-0.05", "--to", "0.2"]);
    let ends = |points: &serde_json::Value| {
        let points = points.as_array().expect("a list").clone();
        [0, points.len() - 1].map(|at| points[at]["parameters"]["omega"].as_f64().expect("omega"))
    };
    for (by_value, by_offset) in ends(&values).iter().zip(ends(&offsets)) {
        assert!((by_value - by_offset).abs() < 1e-12, "{by_value} {by_offset}");
    }
}

#[test]
fn positions_with_an_at_sign_are_values() {
    let folder = scratch();
    let orbits = |at: &str| {
        let command = ["orbits", "linear", "--itinerary", "1", "--at", at, "--json", "-", "-q"];
        json(folder.path(), &command)["orbits"][0]["parameters"]["alpha"].as_f64().expect("alpha")
    };
    let grazing = (1.0_f64 - 1.8 * 1.8).hypot(0.18);
    let by_value = orbits(&format!("alpha=@{}", grazing - 1e-4));
    assert!((by_value - orbits("alpha=-1e-4")).abs() < 1e-14, "{by_value}");
}

#[test]
fn options_ask_for_diagrams_and_charts_as_tables_do() {
    let csv = |arguments: &[&str]| printed(&[arguments, &["--csv", "-", "-q"]].concat());
    let by_options = csv(&[
        "diagram",
        "linear",
        "--along",
        "alpha",
        "--from=-1e-4",
        "--to",
        "1e-4",
        "--points",
        "5",
        "--keep",
        "3",
        "--transient",
        "20",
        "--direction",
        "up",
        "--method",
        "map",
    ]);
    let by_table = csv(&[
        "diagram",
        "linear",
        "--set",
        "diagram.0.range=[-1e-4, 1e-4]",
        "--set",
        "diagram.0.points=5",
        "--set",
        "diagram.0.keep=3",
        "--set",
        "diagram.0.transient=20",
        "--set",
        "diagram.0.direction=\"up\"",
        "--set",
        "diagram.0.with=\"map\"",
    ]);
    assert_eq!(by_options, by_table);
    let chart = csv(&[
        "chart",
        "linear",
        "--plane",
        "alpha,omega",
        "--range",
        "alpha=-1e-4:1e-4,omega=-1e-4:0",
        "--points",
        "4,3",
        "--keep",
        "8",
        "--transient",
        "20",
    ]);
    assert_eq!(chart.lines().count(), 1 + 4 * 3, "{chart}");
    let folder = scratch();
    let unknown = grazemap(folder.path(), &["diagram", "linear", "--along", "beta"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("beta"), "{}", text(&unknown.stderr));
}

#[test]
fn noise_and_fits_are_commands() {
    let folder = scratch();
    let noise = ["noise", "linear", "--deviation", "alpha=1e-6", "--orbits", "4", "--keep", "5"];
    let counted = json(folder.path(), &[&noise[..], &["--json", "-", "-q"]].concat());
    assert_eq!(counted["document"], "noise");
    // Returns of direct simulation at an offset of alpha, found again.
    let states = folder.path().join("states.csv");
    std::fs::write(&states, "x,theta,alpha\n-2e-6,0,3e-7\n-4e-6,0,3e-7\n").expect("writable");
    let image = ["image", "linear", "--states", "states.csv", "--iterations", "6"];
    let images = grazemap(folder.path(), &[&image[..], &["--method", "direct", "-q"]].concat());
    let images = text(&images.stdout);
    let mut lines = images.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let place = |name: &str| header.iter().position(|known| *known == name).expect("a column");
    let [row, x, theta] = ["row", "x", "theta"].map(place);
    let rows = lines.map(|cells| format!("{},{},{}\n", cells[row], cells[x], cells[theta]));
    let measured = format!("series,x,theta\n{}", rows.collect::<String>());
    std::fs::write(folder.path().join("measured.csv"), measured).expect("writable");
    let fit = ["fit", "linear", "--data", "measured.csv", "--parameters", "alpha", "-q"];
    let fitted = json(folder.path(), &[&fit[..], &["--json", "-"]].concat());
    let offset = fitted["parameters"][0]["offset"].as_f64().expect("an offset");
    assert!((offset - 3e-7).abs() < 1e-9, "{offset:e}");
}

#[test]
fn the_program_alone_prints_its_commands_in_groups() {
    let alone = printed(&[]);
    assert_eq!(alone, printed(&["--help"]));
    for heading in ["Scenes:", "Dynamics:", "Program:"] {
        assert!(alone.contains(heading), "{alone}");
    }
}

#[test]
fn safe_tells_the_sides_of_a_closed_form() {
    // The steady amplitude is alpha/|1 − ω² + 2iζω| for a gap of 1.
    let folder = scratch();
    let grazing = |omega: f64| (1.0 - omega * omega).hypot(0.1 * omega);
    let safe = |alpha: f64, tolerance: &str| {
        let alpha = format!("alpha={alpha}");
        let command =
            ["safe", "linear", "--set", &alpha, "--tolerance", tolerance, "--points", "0"];
        json(folder.path(), &[&command[..], &["--json", "-", "-q"]].concat())
    };
    let below = safe(2.0, "alpha=5%,omega=1%");
    assert_eq!(below["clears"], true);
    let of = |name: &str| {
        let intervals = below["intervals"].as_array().expect("a list").clone();
        intervals.into_iter().find(|one| one["parameter"] == name).expect("an interval")
    };
    let above = of("alpha")["above"].as_f64().expect("a graze");
    assert!((above - grazing(1.8)).abs() < 1e-12, "{above}");
    // 2.1 at the corner omega = 1.782 is below the grazing 2.182.
    assert_eq!(below["tolerance"]["touched"].as_array().map(Vec::len), Some(0), "{below}");
    let tight = safe(2.2, "alpha=5%,omega=1%");
    assert_eq!(tight["clears"], true);
    assert_ne!(tight["tolerance"]["touched"].as_array().map(Vec::len), Some(0), "{tight}");
    assert_eq!(safe(2.3, "alpha=1%")["clears"], false);
    for wrong in [["--tolerance", "alpha=-5%"], ["--points", "1001"]] {
        let wrong = grazemap(folder.path(), &[&["safe", "linear"][..], &wrong].concat());
        assert_eq!(wrong.status.code(), Some(2));
    }
}

/// Oscillator of the first tutorial.
const TUTORIAL: &str = include_str!("../../../docs/tutorials/first-graze.in/oscillator.toml");

#[test]
fn safe_tells_a_long_transient_from_a_motion_without_contact() {
    let folder = scratch();
    fs::write(folder.path().join("oscillator.toml"), TUTORIAL).expect("a file");
    // Below the fold of the motion with three impacts, at 3.7832, starts are chaotic for up to
    // thousands of returns.
    let set = ["safe", "oscillator.toml", "--set", "alpha=3.6662969", "--points", "10"];
    let safe = json(folder.path(), &[&set[..], &["--json", "-", "-q"]].concat());
    let attractors = safe["attractors"].as_array().expect("a list");
    let named = |orbit: serde_json::Value| {
        let found = attractors.iter().find(|attractor| attractor["orbit"] == orbit);
        found.unwrap_or_else(|| panic!("{orbit} of {safe}"))
    };
    assert_eq!(named("(0,1)".into())["impact_speed"], serde_json::Value::Null);
    let speed = named(serde_json::Value::Null)["impact_speed"].as_f64().expect("a speed");
    assert!((2.0..5.0).contains(&speed), "{speed}");
}

#[test]
fn safe_follows_a_motion_that_turns_about_its_section_point() {
    // Hardening spring: section points come nearer by 4 % in a return, and repeat nearly after 11.
    let scene = r#"
[model]
states = ["z", "v"]
parameters = { A = 3.0, f = 25.0, r = 0.7 }
phase = { name = "theta", rate = "2*pi*f", period = "2*pi" }

[model.flow]
z = "v"
v = "-A*cos(theta) - 2*v - 1e4*z - 2e8*z^3"

[[model.surface]]
name = "limiter"
event = "0.002 - z"
impact = { v = "-r*v" }

[grazing]
solve_for = "A"
"#;
    let folder = scratch();
    fs::write(folder.path().join("spring.toml"), scene).expect("a file");
    let asked = ["safe", "spring.toml", "--points", "2", "--json", "-", "-q"];
    let safe = json(folder.path(), &asked);
    let free = &safe["attractors"][0];
    assert_eq!((free["orbit"].as_str(), free["to"].is_null()), (Some("(0,1)"), false), "{safe}");
}

#[test]
fn a_diagram_says_at_which_value_it_holds_the_adjusted_parameter() {
    let folder = scratch();
    fs::write(folder.path().join("oscillator.toml"), TUTORIAL).expect("a file");
    let short = ["--points", "2", "--transient", "1", "--keep", "1", "--threads", "1"];
    let note = |set: &str, along: &str| {
        let active = r#"expansion.active=["alpha","omega"]"#;
        let command =
            ["diagram", "oscillator.toml", "--set", active, "--set", set, "--along", along];
        let output = grazemap(folder.path(), &[&command[..], &short].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr).contains("note: alpha stays at its grazing value 3.8463")
    };
    assert!(note("alpha=5", "omega"));
    // A value that is a guess of the graze, and the parameter itself.
    assert!(!note("alpha=3.8", "omega") && !note("alpha=5", "alpha"));
}

/// Linear oscillator with a constant force between two stops, of which the scene's orbit grazes the
/// farther one.
const BETWEEN_STOPS: &str = r#"
[model]
name = "linear oscillator between two stops"
states = ["x", "v"]
parameters = { zeta = 0.05, omega = 1.8, alpha = 2.0, b = 0.1, d = 2.0, e = 1.2, r = 0.7 }

[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"

[model.flow]
x = "v"
v = "-x - 2*zeta*v + b + alpha*cos(theta)"

[[model.surface]]
name = "right"
event = "d - x"
impact = { v = "-r*v" }

[[model.surface]]
name = "left"
event = "e + x"
impact = { v = "-r*v" }

[grazing]
surface = "right"
solve_for = "alpha"

[section]
kind = "tangency"

[expansion]
active = ["alpha", "b", "d", "e"]
smooth_order = 2
contact_weight = 3
"#;

#[test]
fn safe_and_the_nearest_graze_count_every_stop() {
    let folder = scratch();
    fs::write(folder.path().join("between.toml"), BETWEEN_STOPS).expect("a file");
    let ask = |command: &[&str]| json(folder.path(), &[command, &["--json", "-", "-q"]].concat());
    let safe = ask(&["safe", "between.toml", "--points", "0", "--tolerance", "alpha=60%,b=1%"]);
    // x = b + a cos(ωt + ...), a = alpha/|1 − ω² + 2iζω|.
    let resistance = (1.0 - 1.8_f64 * 1.8).hypot(2.0 * 0.05 * 1.8);
    let amplitude = 2.0 / resistance;
    assert_eq!(safe["clears"], true);
    assert_eq!(safe["stops"], serde_json::json!(["right", "left"]));
    let end = |parameter: &str, side: &str, stop: &str| {
        let intervals = safe["intervals"].as_array().expect("a list");
        let of = intervals.iter().find(|one| one["parameter"] == parameter).expect("an interval");
        assert_eq!(of[format!("stop_{side}")], stop, "{parameter}");
        of[side].as_f64().expect("a graze")
    };
    for (found, exact) in [
        (end("alpha", "above", "left"), 1.3 * resistance),
        (end("b", "above", "right"), 2.0 - amplitude),
        (end("d", "below", "right"), amplitude + 0.1),
        (end("e", "below", "left"), amplitude - 0.1),
    ] {
        assert!((found - exact).abs() < 1e-12, "{found}, {exact}");
    }
    let touched = safe["tolerance"]["touched"].as_array().expect("a list");
    assert_eq!(touched.len(), 3, "{safe}");
    assert_eq!(safe["tolerance"]["stops"], serde_json::json!(["left", "left", "left"]));
    let nearest = ask(&["curve", "between.toml", "--nearest", "alpha"]);
    assert_eq!((nearest["surface"].as_str(), &nearest["clears"]), (Some("left"), &true.into()));
    let change = nearest["changes"][0]["change"].as_f64().expect("a number");
    assert!((change - (1.3 * resistance - 2.0)).abs() < 1e-12, "{change}");
    // Beyond the left stop and clear of the right one, whose graze is nearer.
    let beyond = ask(&["curve", "between.toml", "--nearest", "alpha", "--set", "alpha=3.7"]);
    assert_eq!((beyond["surface"].as_str(), &beyond["clears"]), (Some("left"), &false.into()));
}

#[test]
fn contact_gives_stops_and_lines_with_and_without_a_scene() {
    let folder = scratch();
    let asked = ["contact", "--restitution", "0.8", "--time", "0.01", "--json", "-", "-q"];
    let alone = json(folder.path(), &asked);
    let law = |document: &serde_json::Value, name: &str| {
        let laws = document["laws"].as_array().expect("a list").clone();
        laws.into_iter().find(|one| one["law"] == name).expect("a law")
    };
    // In closed form: c = −2 log(e)/T, k = (π² + log² e)/T².
    let linear = law(&alone, "linear_to_surface");
    let (log, time) = (0.8_f64.ln(), 0.01);
    let near = |found: &serde_json::Value, expected: f64| {
        let found = found.as_f64().expect("a number");
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}, expected {expected}");
    };
    near(&linear["damper"], -2.0 * log / time);
    near(&linear["stiffness"], (PI * PI + log * log) / (time * time));
    let force = law(&alone, "linear_to_force");
    let release = force["release"].as_str().expect("a release").to_owned();
    assert_eq!(force["contact"]["v"], format!("free - ({release})"));
    assert_eq!(alone["surface"], serde_json::Value::Null);
    // The stop of this scene is met at negative velocity of `u`.
    let scene = json(folder.path(), &[&["contact", "cantilever_0_12"][..], &asked[1..]].concat());
    let crossley = law(&scene, "hunt_crossley");
    let line = crossley["contact"]["u"].as_str().expect("a line");
    assert!(line.starts_with("free + ") && line.contains("*d^1.5*(1 - "), "{line}");
    let errors = crossley["impacts"].as_array().expect("a list").iter();
    assert!(errors.map(|impact| impact["error_of_return"].as_f64()).all(|e| e.is_some()));
    // A ball falls onto the stop that the lines describe, with the speed that was asked for.
    for one in alone["laws"].as_array().expect("a list") {
        let contact = one["contact"]["v"].as_str().expect("a line");
        let release = one["release"].as_str();
        let release = release.map_or_else(String::new, |line| format!("release = \"{line}\"\n"));
        let text = format!(
            "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ g = 0.0 }}\n\
             [model.flow]\nx = \"v\"\nv = \"g\"\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\n\
             contact = {{ v = \"{contact}\" }}\n{release}\
             [grazing]\nsurface = \"stop\"\nsolve_for = \"g\"\n"
        );
        let model = Scene::parse(&text, "ball").expect("the lines are those of a scene").model;
        let system = HybridSystem::new(&model);
        let mut simulator = Simulator::<f64>::new(&system, &[0.0]).expect("finite parameters");
        simulator.set_state(&[0.5, 1.0]).expect("a finite state");
        let end = simulator.run(2.0).expect("a finite time").state;
        assert!((end[1] + 0.8).abs() < 1e-11, "{contact}: {end:?}");
    }
    let wrong = grazemap(folder.path(), &["contact", "--restitution", "1.5"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert_eq!(text(&wrong.stderr), "error: --restitution must be from 0.01 to 1, found 1.5\n");
}
