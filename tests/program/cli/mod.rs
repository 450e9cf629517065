//! The program as users run it: messages, exit codes, files.

mod atlas;
mod branch;
mod checks;
#[cfg(all(feature = "cuda", target_os = "linux"))]
mod cuda;
mod emission;
mod images;
mod loci;
mod orbits;
mod outputs;
mod resuming;
mod saved;
mod shards;
#[cfg(unix)]
mod view;
mod vocabulary;
mod wrong_calls;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Overrides that make a scene small enough to be run twice.
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

/// The program in a folder.
fn program(folder: &Path) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_grazemap"));
    program.current_dir(folder).env("XDG_CACHE_HOME", cache(folder));
    program
}

/// Cache of the commands in a folder; it is outside the folder.
fn cache(folder: &Path) -> PathBuf {
    let name = folder.file_name().unwrap_or_default();
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache").join(name)
}

pub(crate) fn grazemap(folder: &Path, arguments: &[&str]) -> Output {
    program(folder).args(arguments).output().expect("the program can be started")
}

/// The program with a text on its standard input.
fn grazemap_reading(folder: &Path, arguments: &[&str], input: &str) -> Output {
    let mut child = program(folder)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let mut standard = child.stdin.take().expect("it is piped");
    standard.write_all(input.as_bytes()).expect("the program reads");
    drop(standard);
    child.wait_with_output().expect("the program ends")
}

pub(crate) fn scratch() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = grazemap(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("standard output is JSON alone")
}

/// Words of a text, independent of line breaks and frames.
fn words(text: &str) -> String {
    text.split(|c: char| c.is_whitespace() || "│×╭─╰╴┬·".contains(c)).collect()
}

#[test]
fn every_wrong_scene_ends_with_exit_code_2_and_its_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/bad_input");
    let scratch = scratch();
    let mut count = 0;
    for entry in fs::read_dir(&folder).expect("the folder is part of the repository") {
        let path = entry.expect("readable").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let output =
            grazemap(scratch.path(), &["check", path.to_str().expect("a name of plain letters")]);
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
    assert!(grazemap(folder.path(), &["check", "linear.toml"]).status.success());
    let orbit =
        json(folder.path(), &["locate", "linear.toml", "--set", "omega=2.5", "--json", "-"]);
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
    assert_eq!(orbit["section"]["coordinates"], serde_json::json!(["x", "theta"]));
    assert_eq!(orbit["passages"][0]["state"], orbit["state"]);
    assert_eq!(orbit["conditions"][0]["values"], orbit["xi"]);
    assert_eq!(orbit["conditions"][0]["surfaces"], serde_json::json!(["stop", "stop"]));
}

#[test]
fn an_expansion_has_the_fields_promised() {
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
    assert_eq!(map["smooth"]["variables"], serde_json::json!(["x", "theta", "alpha", "omega"]));
    assert_eq!(map["discontinuity"].as_array().map(Vec::len), Some(1));
    for part in [&map["discontinuity"][0], &map["composed"]] {
        assert_eq!(part["variables"], serde_json::json!(["y", "x", "theta", "alpha", "omega"]));
        for coordinate in ["x", "theta"] {
            let terms = part["outputs"][coordinate].as_array().expect("terms");
            assert!(
                terms.iter().all(|term| {
                    term["powers"].as_array().is_some_and(|powers| powers.len() == 5)
                })
            );
        }
    }
    assert!(map["lost_digits"]["x"].is_number() && map["parameters"]["omega"] == 1.8);
    assert_eq!((&map["document"], &map["format"]), (&"map".into(), &1.into()));
    assert_eq!(map["digest"].as_str().map(str::len), Some(16));
}

#[test]
fn a_scene_of_any_section_says_which_it_takes_and_every_command_is_on_it() {
    let folder = scratch();
    let states = "x,v,alpha\n-1e-4,0.01,1e-4\n3e-4,-0.02,-5e-4\n";
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    let run = |command: &[&str]| {
        let any = ["--set", "expansion.tolerance=1e-6", "--set", "section.kind=any", "--json", "-"];
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

    let (emitted, said) = run(&["emit", "moving_stop", "-o", "crate"]);
    let of = |section: &serde_json::Value| {
        let taken = operations(&section["decided"]["taken"]);
        (section["kind"].clone(), section["coordinates"].clone(), taken)
    };
    assert_eq!(of(&emitted["modules"][0]["section"]), of(section));
    let error = emitted["modules"][0]["measured_error"].as_f64();
    // The choice uses only points off the verge of contact. The claim covers all points, and a
    // larger error is reported.
    let error = error.expect("measured");
    assert!(error <= 1e-6 || said.contains("errs by up to"), "{error}: {said}");

    let few = ["--set", "diagram.0.points=3", "--set", "diagram.0.keep=2"];
    let (diagram, _) = run(&[&["diagram", "moving_stop"], &few[..]].concat());
    assert_eq!(of(&diagram[0]["section"]), of(section));

    let image =
        |using| run(&["image", "moving_stop", "--states", "states.csv", "--using", using]).0;
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
    assert_eq!((&run["listed"], &run["run"]), (&"taylor".into(), &"economised".into()));
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
    let errors: Vec<_> = maps.iter().filter_map(|map| map["error"].as_f64()).collect();
    assert!(errors.len() == maps.len() && errors.is_sorted_by(|a, b| a > b), "{errors:?}");
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
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
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
            &[&["run", "linear", "-q", "--threads", threads, "-o", out][..], &QUICK].concat(),
        );
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty() && output.stderr.is_empty());
    }
    let (a, b) = (files(&folder.path().join("a")), files(&folder.path().join("b")));
    assert_eq!(a.len(), b.len());
    let names: Vec<String> = a
        .iter()
        .map(|path| path.file_name().expect("named").to_string_lossy().into_owned())
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
        assert!(names.iter().any(|known| known == name), "{name} is not in {names:?}");
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

#[test]
fn an_unknown_instruction_set_is_refused() {
    let folder = scratch();
    let limited = |set: &str| {
        Command::new(env!("CARGO_BIN_EXE_grazemap"))
            .args(["check", "linear"])
            .env("GRAZEMAP_SIMD", set)
            .current_dir(folder.path())
            .output()
            .expect("the program can be started")
    };
    assert_eq!(limited("sse2").status.code(), Some(0));
    let refused = limited("avx");
    assert_eq!(refused.status.code(), Some(2));
    let said = text(&refused.stderr);
    assert!(said.contains("GRAZEMAP_SIMD is `avx`; expected sse2"), "{said}");
}
