//! The floors of the house, checked against every `crate::` path in `src/`.
//!
//! Change the table on purpose, in the same commit as docs/architecture.md, when a better house is
//! found.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Floors, lowest first, each with the floors it may name.
const FLOORS: [(&str, &[&str]); 14] = [
    ("numeric", &[]),
    ("jet", &["numeric"]),
    ("model", &["numeric"]),
    ("flow", &["numeric", "jet", "model"]),
    ("hybrid", &["numeric", "model", "flow"]),
    ("orbit", &["numeric", "jet", "model", "flow"]),
    ("expansion", &["numeric", "jet", "model", "flow", "orbit"]),
    ("emission", &["numeric", "jet", "model", "expansion"]),
    ("iteration", &["numeric", "jet", "expansion"]),
    (
        "analysis",
        &[
            "numeric",
            "jet",
            "model",
            "flow",
            "hybrid",
            "orbit",
            "expansion",
            "iteration",
        ],
    ),
    (
        "convergence",
        &[
            "numeric",
            "jet",
            "model",
            "flow",
            "hybrid",
            "orbit",
            "expansion",
            "emission",
            "iteration",
            "analysis",
        ],
    ),
    (
        "report",
        &[
            "numeric",
            "jet",
            "model",
            "hybrid",
            "orbit",
            "expansion",
            "iteration",
            "analysis",
            "convergence",
        ],
    ),
    (
        "pipeline",
        &[
            "numeric",
            "jet",
            "model",
            "flow",
            "hybrid",
            "orbit",
            "expansion",
            "emission",
            "iteration",
            "analysis",
            "convergence",
            "report",
        ],
    ),
    (
        "cli",
        &[
            "numeric",
            "jet",
            "model",
            "flow",
            "hybrid",
            "orbit",
            "expansion",
            "emission",
            "iteration",
            "analysis",
            "convergence",
            "report",
            "pipeline",
        ],
    ),
];

fn source(relative: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["src", "crates/jet/src", "crates/sim/src"]
        .map(|package| root.join(package).join(relative))
        .into_iter()
        .find(|folder| folder.exists())
        .expect("a floor has its folder in one package")
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a floor has its folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// Code without comments and without the unit tests at its end.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a readable source file");
    let body = text
        .split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or_default();
    body.lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// Floors named by `crate::floor` or inside `use crate::{floor::..., ...}`.
fn floors_named(code: &str) -> BTreeSet<String> {
    let mut named = BTreeSet::new();
    for (position, _) in code.match_indices("crate::") {
        let rest = &code[position + "crate::".len()..];
        let group = rest
            .strip_prefix('{')
            .and_then(|inner| inner.split(';').next());
        let paths: Vec<&str> = group.map_or_else(
            || vec![rest],
            |group| group.split(['{', ',', '}']).collect(),
        );
        for path in paths {
            let name: String = path
                .trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            named.insert(name);
        }
    }
    named.retain(|name| FLOORS.iter().any(|(floor, _)| floor == name));
    named
}

#[test]
fn a_floor_names_only_the_floors_it_may() {
    for (floor, allowed) in FLOORS {
        for file in rust_files(&source(floor)) {
            for named in floors_named(&code(&file)) {
                assert!(
                    named == floor || allowed.contains(&named.as_str()),
                    "{} names `{named}`; floor `{floor}` may name only {allowed:?}",
                    file.display()
                );
            }
        }
    }
}

#[test]
fn floors_name_lower_floors_only() {
    for (position, (floor, allowed)) in FLOORS.iter().enumerate() {
        for name in *allowed {
            let below = FLOORS[..position].iter().any(|(lower, _)| lower == name);
            assert!(
                below,
                "`{floor}` may not name `{name}`, which is not below it"
            );
        }
    }
}

#[test]
fn the_two_oracles_stay_independent() {
    let allowed = |floor: &str| {
        FLOORS
            .iter()
            .find(|(name, _)| *name == floor)
            .expect("a floor of the table")
            .1
    };
    assert!(!allowed("orbit").contains(&"hybrid") && !allowed("expansion").contains(&"hybrid"));
    assert!(!allowed("hybrid").contains(&"orbit") && !allowed("hybrid").contains(&"expansion"));
}

#[test]
fn the_library_lists_its_floors_in_order() {
    let library = code(&source("lib.rs"));
    let modules: Vec<&str> = library
        .lines()
        .filter_map(|line| line.trim().strip_prefix("pub mod ")?.strip_suffix(';'))
        .collect();
    let floors: Vec<&str> = FLOORS.iter().map(|(floor, _)| *floor).collect();
    assert_eq!(modules, floors);
}

#[test]
fn the_reader_of_paths_sees_groups_and_inline_paths() {
    let named =
        floors_named("use crate::{jet::Jet, numeric::{Dd, Real}};\nlet x = crate::flow::horner;");
    assert_eq!(
        named.into_iter().collect::<Vec<_>>(),
        ["flow", "jet", "numeric"]
    );
}
