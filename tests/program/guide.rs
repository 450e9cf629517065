//! Pages of the documentation: the scenes of the reference are checked, the commands of how-to pages
//! run in the order of the page, every link leads somewhere.

use std::path::Path;

use grazemap::model::Scene;

use super::cli::{grazemap, scratch};
use super::documents::{Document, Documents};
use crate::support::tiers;

/// Pages whose `sh` blocks are run, each page in a folder of its own, with the number of commands.
const RUN: [(&str, usize); 3] =
    [("docs/how-to/tour.md", 10), ("docs/how-to/atlas.md", 5), ("docs/reference/page.md", 1)];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn documents() -> Documents {
    Documents::read(root()).expect("a checkout")
}

#[test]
fn every_scene_of_the_reference_is_a_good_one_without_warnings() {
    let mut scenes = documents().0["docs/reference/scene.md"].blocks();
    scenes.retain(|block| block.language == "toml");
    assert!(!scenes.is_empty());
    for block in scenes {
        let scene = Scene::parse(&block.text, "guide.toml").expect("a good scene");
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
}

/// A CSV block of a page is `states.csv` of the commands below it.
#[test]
fn the_commands_of_how_to_pages_work() {
    let documents = documents();
    for &(path, least) in tiers::part(&RUN, 2) {
        let (folder, mut commands) = (scratch(), 0);
        for block in documents.0[path].blocks() {
            match block.language.as_str() {
                "sh" => {
                    for line in block.text.lines() {
                        let words: Vec<&str> = line.split_whitespace().collect();
                        assert_eq!(words[0], "grazemap", "{path}: {line}");
                        let output = grazemap(folder.path(), &words[1..]);
                        let said = String::from_utf8_lossy(&output.stderr);
                        assert!(output.status.success(), "{path}: {line}: {said}");
                        commands += 1;
                    }
                }
                "csv" => {
                    let path = folder.path().join("states.csv");
                    std::fs::write(path, &block.text).expect("writable");
                }
                _ => {}
            }
        }
        assert!(commands >= least, "{path}: {commands}");
    }
}

#[test]
fn every_link_of_the_documentation_leads_somewhere() {
    let faults = documents().faults(root());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Anchors of headings as on GitHub, and missing targets.
#[test]
fn links_that_lead_nowhere_are_named_with_their_page() {
    let page = |path: &str, text: &str| {
        (path.to_owned(), Document { path: path.to_owned(), text: text.to_owned() })
    };
    let first = "# A
[1](docs/b.md#who-hits-what--when-1) [2](docs/b.md#who) [3](docs/c.md) [4](#a)
[5](../x.md) [6](https://a.example/x.md) `[7](no.md)` ![8](no.svg)

    [9](no.md)
";
    let second = "# B
## Who *hits* `what` & when?
## Who hits what  when
[1](../README.md#a) [2](#b-1)
";
    let documents = Documents([page("README.md", first), page("docs/b.md", second)].into());
    let found = documents.faults(root());
    let expected = [
        "README.md: `docs/b.md#who` names no heading of `docs/b.md`",
        "README.md: `docs/c.md` leads to `docs/c.md`, which is no page and no file",
        "README.md: `../x.md` leads out of the repository",
        "README.md: `no.svg` leads to `no.svg`, which is no page and no file",
        "docs/b.md: `#b-1` names no heading of `docs/b.md`",
    ];
    assert_eq!(found, expected);
}
