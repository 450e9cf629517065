//! Example of README: the program prints the output that stands there, and the pictures show the
//! scene that stands there.

use std::fs;
use std::path::Path;

use crate::cli::{grazemap, scratch};

fn file(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(path).expect("it is part of the repository")
}

/// First code block in a language.
fn block<'a>(readme: &'a str, language: &str) -> &'a str {
    let (_, rest) = readme.split_once(&format!("```{language}\n")).expect("a block");
    rest.split_once("```").expect("the end of the block").0
}

#[test]
fn the_first_command_of_readme_prints_what_stands_there() {
    let readme = file("README.md");
    let folder = scratch();
    fs::write(folder.path().join("oscillator.toml"), block(&readme, "toml")).expect("written");
    let (line, shown) = block(&readme, "console").split_once('\n').expect("a command and output");
    let line = line.strip_prefix("$ grazemap ").expect("a command");
    let arguments: Vec<&str> = line.split(' ').collect();
    let output = grazemap(folder.path(), &arguments);
    assert!(output.status.success(), "{line}");
    let printed = String::from_utf8(output.stdout).expect("a text");
    let shown = shown.strip_suffix("...\n").expect("the output goes on");
    assert!(printed.starts_with(shown), "{printed}");
}

#[test]
fn the_first_picture_of_readme_shows_its_scene_and_its_command() {
    let readme = file("README.md");
    for name in ["hero-light", "hero-dark"] {
        let path = format!("docs/images/{name}.svg");
        assert!(readme.contains(&path), "{path}");
        let picture = file(&path);
        let parts = picture.split('<').filter_map(|part| part.split_once('>'));
        let text: String = parts.map(|(_, text)| text).collect();
        for line in block(&readme, "toml").lines() {
            assert!(text.contains(line), "{path}: {line}");
        }
    }
    // The script that makes the pictures has the command of README.
    let script = file("docs/images/make");
    let command = script.lines().find_map(|line| line.strip_prefix("HERO = (\""));
    let (command, _) = command.expect("a command").split_once('"').expect("its end");
    assert!(readme.contains(&format!("$ grazemap {command} -o diagram\n")), "{command}");
}
