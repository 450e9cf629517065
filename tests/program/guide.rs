//! The guide's examples: its scenes are checked, its commands run in the order of the page.

use std::fs;
use std::path::Path;

use grazemap::model::Scene;

use crate::cli::{grazemap, scratch};

/// Blocks of a page: language and text.
fn blocks(page: &str) -> Vec<(String, String)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide").join(page);
    let text = fs::read_to_string(path).expect("the page is part of the repository");
    let mut blocks = Vec::new();
    let mut parts = text.split("```");
    parts.next();
    while let (Some(block), _) = (parts.next(), parts.next()) {
        let (language, body) = block.split_once('\n').expect("a language, then lines");
        blocks.push((language.to_owned(), body.to_owned()));
    }
    blocks
}

#[test]
fn every_scene_of_the_guide_is_a_good_one_without_warnings() {
    let scenes: Vec<_> =
        blocks("scene.md").into_iter().filter(|(language, _)| language == "toml").collect();
    assert!(!scenes.is_empty());
    for (_, text) in scenes {
        let scene = Scene::parse(&text, "guide.toml").expect("a good scene");
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
}

#[test]
fn the_commands_of_getting_started_work_in_an_empty_folder() {
    let folder = scratch();
    let mut commands = 0;
    for (language, body) in blocks("getting-started.md") {
        match language.as_str() {
            "csv" => fs::write(folder.path().join("states.csv"), body).expect("writable"),
            "sh" => {
                for line in body.lines() {
                    let mut words = line.split_whitespace();
                    assert_eq!(words.next(), Some("grazemap"), "{line}");
                    let output = grazemap(folder.path(), &words.collect::<Vec<_>>());
                    assert!(
                        output.status.success(),
                        "{line}: {}",
                        String::from_utf8_lossy(&output.stderr)
                    );
                    commands += 1;
                }
            }
            other => panic!("unexpected block of {other}"),
        }
    }
    assert!(commands >= 10, "{commands}");
    assert!(folder.path().join("results/report.html").exists());
}
