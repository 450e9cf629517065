//! Wrong scenes are refused with a message that states the fault and its place.
//!
//! Each `tests/program/bad_input/*.toml` has its expected message in an `.expected` file;
//! `UPDATE_EXPECTED=1 cargo test --test program bad_input::` rewrites those files.

use std::fs;
use std::path::{Path, PathBuf};

use grazemap::model::Scene;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/bad_input")
}

/// The scenes of the folder, in order.
fn scenes() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).expect("the folder is part of the repository");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    paths
}

/// Message of a wrong scene, with files named without their folder.
fn message(path: &Path) -> String {
    let error =
        Scene::load(path).err().unwrap_or_else(|| panic!("{} was accepted", path.display()));
    let place = format!("{}{}", folder().display(), std::path::MAIN_SEPARATOR);
    format!("{}\n", error.to_string().replace(&place, ""))
}

#[test]
fn every_wrong_scene_is_refused_with_its_recorded_message() {
    let scenes = scenes();
    assert!(scenes.len() >= 40, "only {} wrong scenes", scenes.len());
    let update = std::env::var_os("UPDATE_EXPECTED").is_some();
    let mut differences = Vec::new();
    for path in scenes {
        let found = message(&path);
        let record = path.with_extension("expected");
        if update {
            fs::write(&record, &found).expect("the record can be written");
        }
        let expected = fs::read_to_string(&record).unwrap_or_default();
        if found != expected {
            differences.push(format!("expected {expected}   found {found}"));
        }
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

#[test]
fn every_message_is_one_line_without_control_characters() {
    for path in scenes() {
        let message = message(&path);
        let line = message.trim_end_matches('\n');
        assert!(!line.chars().any(char::is_control), "{line:?}");
        assert!(line.len() < 400, "{line}");
    }
}
