//! The program as users run it: messages, exit codes, files.
//!
//! Each wrong call of [`wrong_calls`] must end with the exit code and the message recorded in `tests/cli/NAME.expected`;
//! `UPDATE_EXPECTED=1 cargo test --test cli` writes those anew.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use grazemap::numeric::Dd;

fn grazemap(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grazemap"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program can be started")
}

fn scratch() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = grazemap(folder, arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        text(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("standard output is JSON alone")
}

/// Wrong calls: a name, the arguments.
fn wrong_calls() -> Vec<(&'static str, Vec<&'static str>)> {
    vec![
        ("unknown_command", vec!["lokate", "linear"]),
        ("unknown_flag", vec!["locate", "linear", "--fast"]),
        ("chart_is_not_there_yet", vec!["chart", "linear"]),
        ("orbits_is_not_there_yet", vec!["orbits", "linear"]),
        ("no_scene_named", vec!["locate"]),
        ("no_such_scene", vec!["check", "lineer"]),
        ("no_such_file", vec!["check", "nowhere/scene.toml"]),
        ("scene_is_a_folder", vec!["check", "."]),
        ("scene_is_not_text", vec!["check", "garbage.toml"]),
        (
            "set_without_value",
            vec!["check", "linear", "--set", "omega"],
        ),
        (
            "set_unknown_parameter",
            vec!["check", "linear", "--set", "omgea=2"],
        ),
        (
            "set_unknown_key",
            vec!["check", "linear", "--set", "expansion.smoth_order=3"],
        ),
        (
            "set_not_a_number",
            vec!["check", "linear", "--set", "omega=fast"],
        ),
        (
            "set_restitution_above_one",
            vec!["check", "linear", "--set", "r=1.5"],
        ),
        (
            "set_order_absurd",
            vec!["check", "linear", "--set", "expansion.smooth_order=1000"],
        ),
        ("threads_zero", vec!["check", "linear", "--threads", "0"]),
        (
            "threads_not_a_number",
            vec!["check", "linear", "--threads", "many"],
        ),
        ("new_unknown", vec!["new", "linaer"]),
        ("new_exists", vec!["new", "linear", "-o", "taken.toml"]),
        (
            "new_into_no_folder",
            vec!["new", "linear", "-o", "nowhere/linear.toml"],
        ),
        ("new_without_name", vec!["new"]),
        (
            "json_into_no_folder",
            vec!["locate", "linear", "--json", "nowhere/orbit.json"],
        ),
        (
            "json_onto_a_folder",
            vec!["locate", "linear", "--json", "folder"],
        ),
        (
            "output_onto_a_file",
            vec!["locate", "linear", "-o", "taken.toml"],
        ),
        ("csv_of_nothing", vec!["check", "linear", "--csv", "-"]),
        (
            "order_beyond_memory",
            vec!["expand", "linear", "--set", "expansion.smooth_order=64"],
        ),
        (
            "weight_beyond_memory",
            vec![
                "expand",
                "linear",
                "--set",
                "expansion.contact_weight=64",
                "--set",
                "expansion.active=[\"alpha\", \"omega\", \"zeta\", \"delta\"]",
            ],
        ),
        (
            "orbit_never_touches",
            vec![
                "locate",
                "linear",
                "--set",
                "grazing.solve_for=zeta",
                "--set",
                "delta=1.5",
            ],
        ),
        (
            "stop_below_the_equilibrium",
            vec!["locate", "linear", "--set", "delta=-1"],
        ),
        (
            "delta_at_the_equilibrium",
            vec!["locate", "linear", "--set", "delta=0"],
        ),
        (
            "corner_at_the_graze",
            vec![
                "locate",
                "linear",
                "--set",
                "model.flow.v=alpha*cos(theta) - 2*zeta*v - x - 0.1*abs(x - delta)",
            ],
        ),
        (
            "corner_along_the_orbit",
            vec![
                "locate",
                "linear",
                "--set",
                "model.flow.v=alpha*cos(theta) - 2*zeta*v - x - 0.1*max(x, 0.3)",
            ],
        ),
        (
            "corner_of_dry_friction",
            vec![
                "locate",
                "linear",
                "--set",
                "model.flow.v=alpha*cos(theta) - 0.1*sign(v) - x",
            ],
        ),
        (
            "corner_in_the_event",
            vec![
                "locate",
                "linear",
                "--set",
                "model.surface.0.event=delta - x + abs(v)",
            ],
        ),
        (
            "two_parameters_solved_for",
            vec![
                "locate",
                "linear",
                "--set",
                "grazing.solve_for=[\"alpha\", \"omega\"]",
            ],
        ),
        (
            "half_period_symmetry",
            vec!["locate", "linear", "--set", "grazing.symmetry=half-period"],
        ),
        (
            "forcing_stands_still",
            vec!["locate", "linear", "--set", "omega=0"],
        ),
        (
            "state_named_as_the_depth",
            vec!["expand", "depth_state.toml"],
        ),
        ("image_without_states", vec!["image", "linear"]),
        (
            "image_no_such_file",
            vec!["image", "linear", "--states", "nowhere.csv"],
        ),
        (
            "image_empty_file",
            vec!["image", "linear", "--states", "empty.csv"],
        ),
        (
            "image_header_alone",
            vec!["image", "linear", "--states", "header.csv"],
        ),
        (
            "image_unknown_column",
            vec!["image", "linear", "--states", "unknown.csv"],
        ),
        (
            "image_column_twice",
            vec!["image", "linear", "--states", "twice.csv"],
        ),
        (
            "image_not_a_number",
            vec!["image", "linear", "--states", "word.csv"],
        ),
        (
            "image_not_finite",
            vec!["image", "linear", "--states", "infinite.csv"],
        ),
        (
            "image_ragged",
            vec!["image", "linear", "--states", "ragged.csv"],
        ),
        (
            "image_no_iterations",
            vec![
                "image",
                "linear",
                "--states",
                "good.csv",
                "--iterations",
                "0",
            ],
        ),
        (
            "image_unknown_method",
            vec![
                "image", "linear", "--states", "good.csv", "--using", "magic",
            ],
        ),
        (
            "image_unknown_precision",
            vec![
                "image",
                "linear",
                "--states",
                "good.csv",
                "--precision",
                "f32",
            ],
        ),
        (
            "image_far_away",
            vec![
                "image", "mems", "--states", "far.csv", "--using", "direct", "-q",
            ],
        ),
        (
            "curve_without_range",
            vec!["curve", "linear", "--with", "omega"],
        ),
        (
            "curve_unknown_parameter",
            vec![
                "curve", "linear", "--with", "omgea", "--from", "1", "--to", "2",
            ],
        ),
        (
            "curve_in_the_adjusted_parameter",
            vec![
                "curve", "linear", "--with", "alpha", "--from", "1", "--to", "2",
            ],
        ),
        (
            "curve_not_finite",
            vec![
                "curve", "linear", "--with", "omega", "--from", "1.8", "--to", "inf",
            ],
        ),
        (
            "diagram_of_a_frozen_parameter",
            vec!["diagram", "linear", "--set", "expansion.active=[\"omega\"]"],
        ),
        ("emit_nothing", vec!["emit"]),
        (
            "emit_in_another_language",
            vec!["emit", "linear", "--target", "cobol"],
        ),
        (
            "emit_catalogue_in_c",
            vec!["emit", "--catalogue", "--target", "c"],
        ),
        (
            "emit_check_of_nothing",
            vec!["emit", "linear", "--check", "-o", "nowhere"],
        ),
        (
            "emit_onto_a_file",
            vec!["emit", "linear", "-o", "taken.toml"],
        ),
        ("tolerance_out_of_reach", vec!["expand", "tolerance.toml"]),
        (
            "any_section_without_tolerance",
            vec!["expand", "linear", "--set", "section.kind=any"],
        ),
        (
            "orders_beside_a_tolerance",
            vec![
                "expand",
                "linear",
                "--set",
                "expansion.tolerance=1e-6",
                "--set",
                "expansion.smooth_order=4",
            ],
        ),
        (
            "image_columns_of_another_section",
            vec![
                "image",
                "moving_stop",
                "--states",
                "good.csv",
                "--set",
                "expansion.tolerance=1e-6",
                "--set",
                "section.kind=any",
                "-q",
            ],
        ),
    ]
}

/// The files that wrong calls name.
fn set_up(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("writable");
    write("taken.toml", b"mine");
    write("garbage.toml", b"\xff\xfe\x00[model]");
    write("empty.csv", b"");
    write("header.csv", b"x,theta\n");
    write("good.csv", b"x,theta\n1e-6,1e-6\n");
    write("unknown.csv", b"x,phi\n1,2\n");
    write("twice.csv", b"x,x\n1,2\n");
    write("word.csv", b"x,theta\n1e-6,0\n1e-6,small\n");
    write("infinite.csv", b"x\ninf\n");
    write("ragged.csv", b"x,theta\n1\n");
    write("far.csv", b"x,theta\n0.6,0\n");
    fs::create_dir(folder.join("folder")).expect("writable");
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let renamed = linear
        .replace("states = [\"x\", \"v\"]", "states = [\"y\", \"v\"]")
        .replace("x = \"v\"", "y = \"v\"")
        .replace("- x\"", "- y\"")
        .replace("{ x = ", "{ y = ");
    write("depth_state.toml", renamed.as_bytes());
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-30\n")
        .replace("contact_weight = 6\n", "");
    write("tolerance.toml", tolerant.as_bytes());
}

fn record(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/cli")
        .join(format!("{name}.expected"))
}

#[test]
fn every_wrong_call_ends_with_its_recorded_message_and_exit_code() {
    let folder = scratch();
    set_up(folder.path());
    let update = std::env::var_os("UPDATE_EXPECTED").is_some();
    let mut differences = Vec::new();
    for (name, arguments) in wrong_calls() {
        let output = grazemap(folder.path(), &arguments);
        let code = output.status.code().unwrap_or(-1);
        assert!(
            code == 1 || code == 2,
            "{name}: exit {code}: {}",
            text(&output.stderr)
        );
        let found = format!(
            "$ grazemap {}\nexit {code}\n{}",
            arguments.join(" "),
            text(&output.stderr)
        );
        if update {
            fs::write(record(name), &found).expect("the record can be written");
        }
        let expected = fs::read_to_string(record(name)).unwrap_or_default();
        if found != expected {
            differences.push(format!("{name}: expected\n{expected}\nfound\n{found}"));
        }
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
    assert_eq!(
        fs::read(folder.path().join("taken.toml")).expect("there"),
        b"mine"
    );
}

/// The words of a text, however a terminal broke its lines.
fn words(text: &str) -> String {
    text.split(|c: char| c.is_whitespace() || "│×╭─╰╴┬·".contains(c))
        .collect()
}

#[test]
fn every_wrong_scene_ends_with_exit_code_2_and_its_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_input");
    let scratch = scratch();
    let mut count = 0;
    for entry in fs::read_dir(&folder).expect("the folder is part of the repository") {
        let path = entry.expect("readable").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let output = grazemap(
            scratch.path(),
            &["check", path.to_str().expect("a name of plain letters")],
        );
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{}: {said}", path.display());
        assert!(output.stdout.is_empty());
        let recorded = fs::read_to_string(path.with_extension("expected")).expect("recorded");
        let message = recorded.splitn(4, ':').last().unwrap_or_default().trim();
        let message = message.split(" (").next().unwrap_or_default();
        assert!(
            words(&said).contains(&words(message)),
            "{}: `{message}` is not in\n{said}",
            path.display()
        );
        count += 1;
    }
    assert!(count >= 40, "{count}");
}

#[test]
fn a_new_scene_checks_and_gives_the_orbit_of_the_closed_form() {
    let folder = scratch();
    assert!(grazemap(folder.path(), &["new", "linear"]).status.success());
    assert!(
        grazemap(folder.path(), &["check", "linear.toml"])
            .status
            .success()
    );
    let orbit = json(
        folder.path(),
        &["locate", "linear.toml", "--set", "omega=2.5", "--json", "-"],
    );
    let (omega, zeta): (f64, f64) = (2.5, 0.05);
    let alpha = (1.0 - omega * omega).hypot(2.0 * zeta * omega);
    let found = orbit["parameters"]["alpha"].as_f64().expect("a number");
    assert!((found - alpha).abs() < 1e-14 * alpha);
    let keys = [
        "parameters",
        "state",
        "period",
        "normal_acceleration",
        "section",
        "monodromy",
        "multipliers",
        "xi",
        "passages",
        "conditions",
        "residual",
    ];
    assert!(keys.iter().all(|key| !orbit[key].is_null()), "{orbit}");
    assert_eq!(
        orbit["section"]["coordinates"],
        serde_json::json!(["x", "theta"])
    );
    assert_eq!(orbit["passages"][0]["state"], orbit["state"]);
    assert_eq!(orbit["conditions"][0]["values"], orbit["xi"]);
    assert_eq!(
        orbit["conditions"][0]["surfaces"],
        serde_json::json!(["stop", "stop"])
    );
}

#[test]
fn an_expansion_has_the_fields_promised_and_17_digits() {
    let folder = scratch();
    let map = json(
        folder.path(),
        &[
            "expand",
            "linear",
            "--set",
            "expansion.smooth_order=2",
            "--set",
            "expansion.contact_weight=2",
            "--json",
            "-",
        ],
    );
    assert_eq!(
        map["smooth"]["variables"],
        serde_json::json!(["x", "theta", "alpha", "omega"])
    );
    for part in ["discontinuity", "composed"] {
        assert_eq!(
            map[part]["variables"],
            serde_json::json!(["y", "x", "theta", "alpha", "omega"])
        );
        for coordinate in ["x", "theta"] {
            let terms = map[part]["outputs"][coordinate].as_array().expect("terms");
            assert!(terms.iter().all(|term| {
                term["powers"]
                    .as_array()
                    .is_some_and(|powers| powers.len() == 5)
            }));
        }
    }
    assert!(map["lost_digits"]["x"].is_number() && map["parameters"]["omega"] == 1.8);
    let output = grazemap(folder.path(), &["expand", "linear", "--json", "-"]);
    assert!(text(&output.stdout).contains("\"omega\": 1.8000000000000000e0"));
}

#[test]
fn images_by_map_and_by_simulation_agree_and_the_columns_are_those_promised() {
    let folder = scratch();
    fs::write(
        folder.path().join("states.csv"),
        "theta,alpha\n1e-4,1e-6\n-2e-4,0\n",
    )
    .expect("writable");
    let image = |using: &str, precision: &str| {
        let arguments = [
            "image",
            "linear",
            "--states",
            "states.csv",
            "--using",
            using,
            "--precision",
            precision,
            "--iterations",
            "2",
        ];
        let output = grazemap(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let (map, direct) = (image("map", "f64"), image("direct", "dd"));
    assert!(
        map.starts_with("row,iteration,x,theta,contacts,inside\n0,1,"),
        "{map}"
    );
    assert!(
        direct.starts_with("row,iteration,x,theta,contacts,inside,extra_contacts\n0,1,"),
        "{direct}"
    );
    assert_eq!((map.lines().count(), direct.lines().count()), (5, 5));
    let numbers = |table: &str| -> Vec<f64> {
        let cells = table
            .lines()
            .skip(1)
            .flat_map(|line| line.split(',').skip(2).take(2));
        cells.map(|cell| cell.parse().expect("a number")).collect()
    };
    for (a, b) in numbers(&map).into_iter().zip(numbers(&direct)) {
        // The second images start some 1e-3 away, where the orders (5, 6) leave a few 1e-9.
        assert!((a - b).abs() < 1e-8, "{a:e} {b:e}");
    }
}

#[test]
fn images_of_a_scene_that_flies_its_contacts_are_exact_where_its_series_end() {
    let folder = scratch();
    // The depth at the graze, a thousand times beyond the radius of the series in y² (3e-7).
    fs::write(folder.path().join("states.csv"), "u\n5e-4\n").expect("a file can be written");
    let offsets = |using: &str| -> Vec<f64> {
        let states = [
            "--states",
            "states.csv",
            "--using",
            using,
            "--csv",
            "-",
            "-q",
        ];
        let arguments = [&["image", "soft_a_stiff"], &states[..]].concat();
        let output = grazemap(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let csv = text(&output.stdout);
        let row = csv.lines().nth(1).expect("a row").split(',');
        let numbers = row.skip(2).take(2);
        numbers
            .map(|number| number.parse().expect("a number"))
            .collect()
    };
    let (map, direct) = (offsets("map"), offsets("direct"));
    for (map, direct) in map.iter().zip(&direct) {
        // Degree 6 of the legs leaves 1e-7 at y = 0.02; the series is off by more than 1.
        assert!((map - direct).abs() < 1e-6, "{map} {direct}");
    }
}

fn reference_error(arguments: &[&str]) -> f64 {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/rigid/public_linear_w1.8.json"
    );
    let data: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(path).expect("there")).expect("JSON");
    let rows = data["rows"].as_array().expect("rows");
    let word = |value: &serde_json::Value| value.as_str().expect("a decimal").to_owned();
    let mut states = "x,theta,alpha,omega\n".to_owned();
    for row in rows {
        let cells = [
            &row["x_minus_delta"],
            &row["dtheta"],
            &row["param_offsets"][0],
            &row["param_offsets"][1],
        ];
        states += &format!("{}\n", cells.map(word).join(","));
    }
    let folder = scratch();
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    let output = grazemap(
        folder.path(),
        &[
            &["image", "linear", "-q", "--states", "states.csv"],
            arguments,
        ]
        .concat(),
    );
    assert!(output.status.success(), "{}", text(&output.stderr));
    let number = |decimal: &str| Dd::from_decimal(decimal).expect("a decimal");
    let mut worst: f64 = 0.0;
    for (line, row) in text(&output.stdout).lines().skip(1).zip(rows) {
        let cells: Vec<&str> = line.split(',').collect();
        for (cell, key) in cells[2..4].iter().zip(["x_minus_delta", "dtheta"]) {
            worst = worst.max(
                (number(cell) - number(&word(&row["images"][0][key])))
                    .abs()
                    .to_f64(),
            );
        }
    }
    worst
}

#[test]
fn reference_images_are_met_to_double_double_and_by_the_map_to_rounding() {
    // A simulated period costs some hundred roundings of numbers of order 1.
    assert!(reference_error(&["--using", "direct", "--precision", "dd"]) < 1e-27);
    assert!(reference_error(&["--using", "direct"]) < 1e-11);
    let orders = [
        "--set",
        "expansion.smooth_order=8",
        "--set",
        "expansion.contact_weight=10",
    ];
    assert!(reference_error(&orders) < 1e-13);
}

#[test]
fn an_emitted_crate_checks_until_it_is_touched() {
    let folder = scratch();
    let emit = |arguments: &[&str]| {
        grazemap(
            folder.path(),
            &[&["emit", "linear", "-o", "crate"], arguments].concat(),
        )
        .status
        .code()
    };
    assert_eq!(emit(&[]), Some(0));
    assert_eq!(emit(&["--check"]), Some(0));
    assert_eq!(
        emit(&["--check", "--target", "c"]),
        Some(1),
        "no header is there"
    );
    assert_eq!(emit(&["--target", "c"]), Some(0));
    assert_eq!(emit(&["--check", "--target", "c"]), Some(0));
    assert_eq!(
        emit(&["--check", "--set", "expansion.smooth_order=4"]),
        Some(1)
    );
    fs::write(folder.path().join("crate/src/linear.rs"), "").expect("writable");
    assert_eq!(emit(&["--check"]), Some(1));
}

/// A scene small enough to be run twice.
const QUICK: [&str; 10] = [
    "--set",
    "expansion.smooth_order=2",
    "--set",
    "expansion.contact_weight=3",
    "--set",
    "diagram.0.points=40",
    "--set",
    "diagram.0.transient=50",
    "--set",
    "diagram.0.keep=20",
];

#[test]
fn a_crate_emitted_for_a_tolerance_states_the_measured_error_and_is_the_same_twice() {
    let folder = scratch();
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-6\n")
        .replace("contact_weight = 6\n", "");
    fs::write(folder.path().join("linear.toml"), tolerant).expect("writable");
    let emit = |scene: &str, output: &str, measure: bool| {
        let mut arguments = vec!["emit", scene, "-o", output];
        arguments.extend(measure.then_some("--measure"));
        let done = grazemap(folder.path(), &arguments);
        assert!(done.status.success(), "{}", text(&done.stderr));
        let sources = files(&folder.path().join(output));
        let texts = sources
            .iter()
            .map(|path| fs::read_to_string(path).unwrap_or_default());
        texts.collect::<String>()
    };
    let constant = |source: &str, name: &str| -> Option<f64> {
        let line = source
            .lines()
            .find(|line| line.contains(&format!("const {name}:")));
        let value = line.and_then(|line| line.split("Some(").nth(1))?;
        value.split(')').next()?.parse().ok()
    };
    let tolerant = emit("linear.toml", "a", false);
    assert_eq!(constant(&tolerant, "TOLERANCE"), Some(1e-6));
    assert!(tolerant.contains("Coefficients: economised"), "{tolerant}");
    let error = constant(&tolerant, "MEASURED_ERROR").expect("measured");
    // Rounded up to two digits, at most a tenth.
    assert!((1e-9..=1.1e-6).contains(&error), "{error:e}");
    assert_eq!(tolerant, emit("linear.toml", "b", false));
    assert_eq!(
        constant(&emit("linear", "c", false), "MEASURED_ERROR"),
        None
    );
    let error = constant(&emit("linear", "d", true), "MEASURED_ERROR").expect("measured");
    assert!((1e-9..1e-6).contains(&error), "{error:e}");
}

#[test]
fn a_scene_of_any_section_says_which_it_takes_and_every_command_is_on_it() {
    let folder = scratch();
    let states = "x,v,alpha\n-1e-4,0.01,1e-4\n3e-4,-0.02,-5e-4\n";
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    let run = |command: &[&str]| {
        let any = [
            "--set",
            "expansion.tolerance=1e-6",
            "--set",
            "section.kind=any",
            "--json",
            "-",
        ];
        let output = grazemap(folder.path(), &[command, &any].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let json: serde_json::Value =
            serde_json::from_slice(&output.stdout).expect("standard output is JSON alone");
        (json, text(&output.stderr))
    };
    let (map, said) = run(&["expand", "moving_stop"]);
    let section = &map["section"];
    assert_eq!(section["kind"], "stroboscopic");
    assert_eq!(section["coordinates"], serde_json::json!(["x", "v"]));
    let phase = section["phase"].as_f64().expect("a phase");
    let decided = &section["decided"];
    let operations = |section: &serde_json::Value| section["operations"].as_u64();
    assert_eq!(decided["others"][0]["ahead"], serde_json::Value::Null);
    assert!(operations(&decided["taken"]) < operations(&decided["others"][0]));
    assert!(decided["window"]["v"].as_f64() > Some(0.0));
    assert!(
        said.contains("stroboscopic at the graze") && said.contains(&format!("{phase:.6}")),
        "{said}"
    );

    let (emitted, _) = run(&["emit", "moving_stop", "-o", "crate"]);
    let of = |section: &serde_json::Value| {
        let taken = operations(&section["decided"]["taken"]);
        (
            section["kind"].clone(),
            section["coordinates"].clone(),
            taken,
        )
    };
    assert_eq!(of(&emitted["modules"][0]["section"]), of(section));
    let error = emitted["modules"][0]["measured_error"].as_f64();
    // Measured on points that the choice knew: within the tolerance.
    assert!(error.expect("measured") <= 1e-6, "{error:?}");

    let few = ["--set", "diagram.0.points=3", "--set", "diagram.0.keep=2"];
    let (diagram, _) = run(&[&["diagram", "moving_stop"], &few[..]].concat());
    assert_eq!(of(&diagram[0]["section"]), of(section));

    let image = |using| {
        run(&[
            "image",
            "moving_stop",
            "--states",
            "states.csv",
            "--using",
            using,
        ])
        .0
    };
    let (mapped, direct) = (image("map"), image("direct"));
    for row in 0..2 {
        assert_eq!(mapped[row]["inside"], 1);
        assert_eq!(mapped[row]["section"]["phase"].as_f64(), Some(phase));
        for coordinate in ["x", "v"] {
            let offset = |image: &serde_json::Value| image[row]["offsets"][coordinate].as_f64();
            let [mapped, direct] = [&mapped, &direct].map(|image| offset(image).expect("a number"));
            assert!((mapped - direct).abs() < 1e-6, "{mapped:e} {direct:e}");
        }
    }

    // No map is made here, and none is chosen.
    let (orbit, _) = run(&["locate", "moving_stop"]);
    assert_eq!(orbit["section"]["kind"], "tangency");
    assert_eq!(orbit["section"]["rule"], "any");
}

#[test]
fn an_expansion_says_what_it_lists_and_what_is_run() {
    let folder = scratch();
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-6\n")
        .replace("contact_weight = 6\n", "");
    fs::write(folder.path().join("tolerant.toml"), tolerant).expect("writable");
    let chosen = |scene: &str| {
        let map = json(folder.path(), &["expand", scene, "--json", "-", "-q"]);
        map["chosen"].clone()
    };
    let run = chosen("tolerant.toml");
    assert_eq!(
        (&run["listed"], &run["run"]),
        (&"taylor".into(), &"economised".into())
    );
    assert!(run["fitted_to"]["smooth_order"].is_number() && run["coefficients"].is_number());
    // Orders that a scene names are run as they are listed.
    assert!(chosen("linear").is_null());
}

#[test]
fn a_study_says_what_was_chosen_where_it_holds_and_the_front_with_direct_simulation() {
    let folder = scratch();
    let arguments = ["converge", "linear", "--fresh", "200", "--json", "-", "-q"];
    let study = json(folder.path(), &arguments);
    assert!(study["chosen"]["met"].is_boolean() && study["chosen"]["seconds"].is_number());
    assert!(study["validity"]["scale"].is_number() && study["validity"]["depth"].is_number());
    assert_eq!(study["sections"].as_array().map(Vec::len), Some(4));
    assert!(study["validity"]["parameter"]["alpha"].is_number());
    assert!(study["validity"]["state"]["theta"].is_number());
    let front = study["pareto"].as_array().expect("a list");
    let (direct, maps) = front.split_last().expect("direct simulation");
    assert!(direct["map"].is_null() && !maps.is_empty());
    let errors: Vec<_> = maps
        .iter()
        .filter_map(|map| map["error"].as_f64())
        .collect();
    assert!(
        errors.len() == maps.len() && errors.is_sorted_by(|a, b| a > b),
        "{errors:?}"
    );
    let windows = study["accuracy"]["windows"].as_array().expect("a list");
    let crossing = study["accuracy"]["crossing"].as_f64().expect("a depth");
    for window in windows {
        let number = |name: &str| window[name].as_f64().expect("a number");
        if number("depth") < crossing {
            assert!(number("map") <= number("direct"), "{window}");
        }
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            found.extend(files(&path))
        } else {
            found.push(path)
        }
    }
    found.sort();
    found
}

#[test]
fn a_scene_run_twice_gives_the_same_bytes_but_for_measured_times() {
    let folder = scratch();
    for (out, threads) in [("a", "1"), ("b", "2")] {
        let output = grazemap(
            folder.path(),
            &[
                &["run", "linear", "-q", "--threads", threads, "-o", out][..],
                &QUICK,
            ]
            .concat(),
        );
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty() && output.stderr.is_empty());
    }
    let (a, b) = (
        files(&folder.path().join("a")),
        files(&folder.path().join("b")),
    );
    assert_eq!(a.len(), b.len());
    let names: Vec<String> = a
        .iter()
        .map(|path| {
            path.file_name()
                .expect("named")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    for name in [
        "scene.toml",
        "orbit.json",
        "map.json",
        "diagram.npy",
        "diagram.svg",
        "convergence.json",
        "report.html",
        "timings.json",
    ] {
        assert!(
            names.iter().any(|known| known == name),
            "{name} is not in {names:?}"
        );
    }
    for ((first, second), name) in a.iter().zip(&b).zip(&names) {
        let timed = name.starts_with("convergence-speed")
            || name == "report.html"
            || name == "timings.json";
        assert!(
            timed || fs::read(first).expect("there") == fs::read(second).expect("there"),
            "{name} differs"
        );
    }
    let page = fs::read_to_string(folder.path().join("a/report.html")).expect("there");
    let outside = ["src=\"http", "href=\"http", "url(http", "@import"];
    assert!(outside.iter().all(|link| !page.contains(link)));
}
