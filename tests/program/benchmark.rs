//! Benchmark for other programs: its tables hold the reference numbers, and its checker
//! distinguishes right answers from wrong ones.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use xtask::benchmark::files;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("gallery/benchmark")
}

#[test]
fn the_tables_are_those_of_the_reference_numbers() {
    let tables = files::tables().expect("the reference files are read");
    assert!(tables.len() >= 29, "{}", tables.len());
    for table in tables {
        let path = folder().join(&table.path);
        let written = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        assert_eq!(written, table.csv(), "{path:?}: run `cargo run -p xtask -- benchmark`");
    }
}

/// Output of the checker for one table of answers; `None` without Python.
fn checked(answers: &str) -> Option<Output> {
    let here = tempfile::tempdir().expect("a folder");
    let table = here.path().join("linear/zeros_of_xi.csv");
    fs::create_dir_all(table.parent().expect("a folder")).expect("made");
    fs::write(table, answers).expect("written");
    let program = Command::new("python3").arg(folder().join("check.py")).arg(here.path()).output();
    if program.is_err() {
        println!("skipped: there is no python3");
    }
    program.ok()
}

#[test]
fn the_checker_tells_right_answers_from_wrong_ones() {
    let right = fs::read_to_string(folder().join("linear/zeros_of_xi.csv")).expect("a table");
    let Some(output) = checked(&right) else { return };
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("36/36") && text.contains("40.0"), "{text}");

    let rounded = right.replace("1.99749843554381789157803823281", "1.9974984");
    let text = checked(&rounded).map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    assert!(text.as_deref().is_some_and(|text| text.contains("3.6e-08")), "{text:?}");

    let wrong = right.replacen("1.99749843554381789157803823281", "nan", 1);
    let wrong = wrong.replace("6,6,", "7,6,");
    let output = checked(&wrong).expect("Python was there");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("result.omega is NaN") && text.contains("no row 7,6"), "{text}");
}
