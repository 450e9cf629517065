//! Checks that the header is current, and that a C program gives the same numbers as `grazemap`.

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use grazemap::prelude::*;

const TABLES: &str = "
[[diagram]]
parameter = \"alpha\"
range = [-1e-4, 1e-4]
points = 12
transient = 100
keep = 8
";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The header as cbindgen makes it.
fn made() -> String {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml")).expect("a good table");
    let sources = cbindgen::Builder::new().with_config(config);
    let sources = sources.with_src(here.join("src/values.rs"));
    let header = sources.with_src(here.join("src/border.rs")).generate().expect("a header");
    let mut text = Vec::new();
    header.write(&mut text);
    String::from_utf8(text).expect("a text")
}

/// `GRAZEMAP_HEADER=write` rewrites the header.
#[test]
fn the_header_is_what_cbindgen_makes_of_the_source() {
    let (path, made) = (root().join("include/grazemap.h"), made());
    if env::var_os("GRAZEMAP_HEADER").is_some_and(|word| word == "write") {
        fs::write(&path, &made).expect("the folder is there");
    }
    let kept = fs::read_to_string(path).expect("the header is part of the repository");
    assert!(kept == made, "write include/grazemap.h anew: GRAZEMAP_HEADER=write cargo test");
}

/// The folder with the libraries that were built with this test.
fn libraries() -> PathBuf {
    let test = env::current_exe().expect("a path");
    test.parent().expect("a folder").to_owned()
}

/// The `grazemap` executable, if it was built beside this test.
fn program() -> Option<PathBuf> {
    let path = libraries().parent()?.join(format!("grazemap{}", env::consts::EXE_SUFFIX));
    path.exists().then_some(path)
}

fn success(output: Output) -> String {
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    String::from_utf8(output.stdout).expect("a text")
}

/// Compiles a C program; prints a note and returns `None` if there is no compiler.
fn compile(source: &Path, binary: &Path) -> Option<()> {
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]);
    compiler.arg(root().join("include")).arg(source).arg("-o").arg(binary);
    compiler.arg("-L").arg(libraries()).arg("-lgrazemap_c");
    match compiler.output() {
        Ok(output) => success(output),
        Err(error) => return left_out("C", &format!("no compiler `cc`: {error}")),
    };
    Some(())
}

fn left_out<T>(what: &str, why: &str) -> Option<T> {
    eprintln!("{what} is left out: {why}");
    None
}

/// A command that finds the library when it is run.
fn with_library(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.env("LD_LIBRARY_PATH", libraries());
    command.env("GRAZEMAP_LIBRARY", libraries().join("libgrazemap_c.so"));
    command
}

/// Output of the C program, and the diagram that it writes.
fn by_c(folder: &Path) -> Option<(String, String)> {
    let (binary, csv) = (folder.join("program"), folder.join("diagram.csv"));
    compile(&root().join("crates/c/tests/abi/program.c"), &binary)?;
    let printed = with_library(binary).arg(TABLES).arg(&csv).output().expect("it was made");
    Some((success(printed), fs::read_to_string(csv).expect("a diagram")))
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|word| word.parse().expect("a number")).collect()
}

/// The rows that begin with a word.
fn lines<'a>(printed: &'a str, word: &str) -> Vec<&'a str> {
    let lines = printed.lines().filter_map(|line| line.split_once(' '));
    lines.filter(|(first, _)| *first == word).map(|(_, rest)| rest).collect()
}

/// Images as `grazemap` writes them, and whether the points lay in the window.
fn by_program(program: &Path, folder: &Path, using: &str) -> (Vec<f64>, Vec<f64>) {
    let states = "x,theta,alpha,omega\n1e-5,2e-5,1e-6,0\n0.4,0.3,1e-6,0\n-3e-6,1e-6,1e-6,0\n";
    fs::write(folder.join("states.csv"), states).expect("writable");
    let mut command = Command::new(program);
    command.args(["image", "linear", "--states", "states.csv", "--iterations", "4", "-q"]);
    command.args(["--using", using, "--csv", "-"]).current_dir(folder);
    let text = success(command.output().expect("it was built"));
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a heading");
    assert_eq!(header[..4], ["row", "iteration", "x", "theta"]);
    assert_eq!(header[5], "inside");
    let rows: Vec<_> = lines.collect();
    let images = rows.iter().flat_map(|row| numbers(&row[2..4].join(" "))).collect();
    let first = rows.iter().filter(|row| row[1] == "1");
    (images, first.map(|row| f64::from(u8::from(row[5] == "1"))).collect())
}

#[test]
fn a_program_in_c_gives_the_numbers_of_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some((printed, csv)) = by_c(folder.path()) else { return };
    let the = |word: &str| numbers(lines(&printed, word)[0]);
    let scene = Scene::of_catalogue("linear").expect("a scene");
    let graze = scene.clone().graze().expect("it grazes");
    assert_eq!(the("alpha"), [graze.parameter("alpha").expect("a parameter")]);
    assert_eq!(the("sizes"), [2.0, 2.0, 1.0]);
    assert_eq!(lines(&printed, "version"), [env!("CARGO_PKG_VERSION")]);
    let offsets: Vec<_> = csv.lines().skip(1).filter_map(|row| row.split(',').nth(5)).collect();
    assert_eq!(the("offset"), numbers(&offsets.join(" ")));

    // Single steps, in the operations of emitted code and diagrams: `image` sums in another order.
    let map = graze.map().expect("a map");
    let starts = [[1e-5, 2e-5], [0.4, 0.3], [-3e-6, 1e-6]];
    let orbits = starts.map(|start| map.iterate(&start, &[1e-6, 0.0], 4).expect("a point"));
    let orbits = orbits.iter().flatten().flat_map(|image| image.offsets.clone());
    assert_eq!(the("map"), orbits.collect::<Vec<_>>());

    let Some(program) = program() else {
        eprintln!("what the program prints is left out: it was not built beside this test");
        return;
    };
    for using in ["guarded", "direct"] {
        let (images, inside) = by_program(&program, folder.path(), using);
        assert_eq!(the(using), images, "{using}");
        assert_eq!(the("inside"), inside);
    }
    let first = the("map").chunks(8).flat_map(|orbit| orbit[..2].to_vec()).collect::<Vec<_>>();
    assert_eq!(the("step"), first);
    let asked = scene.asking(TABLES).expect("good tables").text;
    fs::write(folder.path().join("linear.toml"), &*asked).expect("writable");
    let mut command = Command::new(program);
    command.args(["diagram", "linear.toml", "-q", "--csv", "-"]).current_dir(folder.path());
    assert_eq!(csv, success(command.output().expect("it was built")));
}

/// Differences of single-step images are an oracle independent of derivatives.
#[test]
fn derivatives_in_c_are_differences_of_images() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some((printed, _)) = by_c(folder.path()) else { return };
    let derivatives = numbers(lines(&printed, "jacobian")[0]);
    let scene = Scene::of_catalogue("linear").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let step = 1e-8;
    for column in 0..4 {
        let image = |by: f64| {
            let mut point = [1e-5, 2e-5, 1e-6, 0.0];
            point[column] += by;
            map.step(&point[..2], &point[2..]).expect("a point").offsets
        };
        let (ahead, behind) = (image(step), image(-step));
        for row in 0..2 {
            let difference = (ahead[row] - behind[row]) / (2.0 * step);
            let derivative = derivatives[row * 4 + column];
            let error = (derivative - difference).abs() / derivative.abs().max(1.0);
            // The cubic term of the root divided by its distance from the graze, squared.
            assert!(error < 1e-4, "{row} {column}: {derivative} {difference}");
        }
    }
}

#[test]
fn what_cannot_be_right_is_refused_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some((printed, _)) = by_c(folder.path()) else { return };
    let fault = "2 2 10 scene.toml:2:10: `model.states` must be a list of names, found a whole \
                 number";
    let expected = [
        "2 0 0 `values` has room for 25 numbers, the result has 24",
        "2 0 0 column `method` holds words",
        fault,
        // The handle is null.
        fault,
        "2 0 0 no scene `linaer` in the catalogue: linear, ",
        "2 0 0 `source` is GRAZEMAP_PATH, _TEXT or _CATALOGUE, found 9",
        "2 0 0 `text` is no UTF-8 text",
        "2 0 0 a null handle",
        "2 0 0 expected rows of 2 coordinates, found 5 numbers",
        "2 0 0 expected one row of 2 parameters or a row for each of 3 states, found 1 numbers",
        "2 0 0 `states` points to no 6 numbers",
        "2 0 0 `images` is null",
        "2 0 0 `images` has room for 4 numbers, the result has 6",
        "2 0 0 `method` is GRAZEMAP_MAP, _GUARDED or _DIRECT, found 7",
        "2 0 0 `images` has room for 6 numbers, the result has more than there are",
    ];
    let refused = lines(&printed, "refused");
    assert_eq!(refused.len(), expected.len());
    for (found, expected) in refused.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} instead of {expected}");
    }
}

/// Code block of the guide in a language.
fn block(language: &str) -> String {
    let page = fs::read_to_string(root().join("docs/reference/c.md")).expect("the page");
    let begin = format!("```{language}\n");
    let (_, block) = page.split_once(&begin).expect("a block of the language");
    block.split_once("```").expect("its end").0.to_owned()
}

/// Output of a program of the guide; prints a note and returns `None` if its interpreter is
/// missing.
fn by_guide(language: &str, file: &str, commands: &[&[&str]], folder: &Path) -> Option<String> {
    fs::write(folder.join(file), block(language)).expect("writable");
    let mut printed = None;
    for command in commands {
        let mut run = with_library(command[0]);
        run.args(&command[1..]).current_dir(folder);
        match run.output() {
            Ok(output) => printed = Some(success(output)),
            Err(error) => return left_out(language, &format!("no `{}`: {error}", command[0])),
        }
    }
    printed
}

#[test]
fn the_programs_of_the_guide_print_the_same_orbits() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let Some((printed, _)) = by_c(folder) else { return };
    let guarded = numbers(lines(&printed, "guarded")[0]);
    // Three of four iterates of the first and the third state.
    let expected: Vec<f64> = [&guarded[..6], &guarded[16..22]].concat();

    fs::write(folder.join("guide.c"), block("c")).expect("writable");
    compile(&folder.join("guide.c"), &folder.join("guide")).expect("there is a compiler");
    let guide = with_library(folder.join("guide")).output().expect("it was made");
    assert_eq!(numbers(&success(guide)), expected);

    let (include, libraries) = (root().join("include"), libraries());
    let (include, libraries) = (include.display(), libraries.display());
    let saved = folder.join("map.json");
    let scene = Scene::of_catalogue("linear").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    map.save(&saved).expect("writable");
    let orbits = "images = grazed('map.json', [1e-5 -3e-6; 2e-5 1e-6], [1e-6 0], 3); \
                  printf('%.17g %.17g\\n', images);";
    let paths = format!("addpath('{include}', '{libraries}'); run('guide.m')");
    let (include, libraries) = (format!("-I{include}"), format!("-L{libraries}"));
    let make = ["mkoctfile", "--mex", &include, &libraries, "-lgrazemap_c", "grazed.c"];
    let languages: [(&str, &str, &[&[&str]]); 3] = [
        ("julia", "guide.jl", &[&["julia", "guide.jl"]]),
        ("matlab", "guide.m", &[&["matlab", "-batch", &paths]]),
        ("mex", "grazed.c", &[&make, &["octave-cli", "--eval", orbits]]),
    ];
    for (language, file, commands) in languages {
        if let Some(printed) = by_guide(language, file, commands, folder) {
            assert_eq!(numbers(&printed), expected, "{language}");
        }
    }
}
