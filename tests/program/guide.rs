//! Examples of the guide: scenes are checked, and commands run in the order of the page. All links
//! in the documentation have a target.

#[path = "../../examples/site/commands.rs"]
mod commands;
#[path = "../../examples/site/documents.rs"]
mod documents;
#[path = "../../examples/site/pages.rs"]
mod pages;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use grazemap::model::Scene;
use grazemap_figure::escape_html;

use super::cli::scratch;
use commands::{RUN, Runner, blocks};
use documents::{Document, Documents, is_address};
use pages::{Site, place};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn documents() -> Documents {
    Documents::read(root()).expect("a checkout")
}

#[test]
fn every_scene_of_the_guide_is_a_good_one_without_warnings() {
    let mut scenes = blocks(&documents().0["docs/reference/scene.md"]);
    scenes.retain(|block| block.language == "toml");
    assert!(!scenes.is_empty());
    for block in scenes {
        let scene = Scene::parse(&block.text, "guide.toml").expect("a good scene");
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
}

#[test]
fn the_commands_of_the_guide_work_and_its_page_shows_what_they_print_and_draw() {
    let documents = documents();
    for (path, commands) in RUN.into_iter().zip([10, 1]) {
        let folder = scratch();
        let runner = Runner::new(env!("CARGO_BIN_EXE_grazemap"), folder.path());
        let done = runner.page(&documents.0[path]).unwrap_or_else(|fault| panic!("{fault}"));
        let lines: Vec<String> =
            done.iter().flatten().map(|done| escape_html(&done.line)).collect();
        assert!(lines.len() >= commands, "{path}: {lines:?}");
        let done = [(path.to_owned(), (done, folder.path().to_owned()))].into();
        let site = Site { root: root(), documents: &documents, done, gallery: false };
        let page = site.page(&documents.0[path]).expect("a page");
        for line in lines {
            assert!(page.contains(&format!("<pre><code>{line}</code></pre>")), "{line}");
        }
        assert!(page.contains("<img src=\"data:image/svg+xml;base64,"), "{path}");
    }
}

#[test]
fn every_link_of_the_documentation_leads_somewhere() {
    let faults = documents().faults(root());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Check of the written pages by an independent reader.
#[test]
fn every_link_of_the_site_is_to_a_part_of_one_of_its_pages() {
    let documents = documents();
    let (done, gallery) = (BTreeMap::new(), false);
    let site = Site { root: root(), documents: &documents, done, gallery };
    let written: BTreeMap<String, String> = documents
        .0
        .values()
        .map(|page| (place(&page.path), site.page(page).expect("a page")))
        .collect();
    let copied = documents.files();
    let values = |text: &str, name: &str| -> BTreeSet<String> {
        let opening = format!(" {name}=\"");
        let parts = text.split(opening.as_str()).skip(1);
        parts.filter_map(|part| Some(part.split_once('"')?.0.to_owned())).collect()
    };
    for (own, text) in &written {
        assert!(!text.contains("<script") && text.contains("default-src 'none'"), "{own}");
        assert!(values(text, "src").iter().all(|src| src.starts_with("data:")), "{own}");
        for link in values(text, "href").into_iter().filter(|link| !is_address(link)) {
            let (path, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let here = Document { path: own.clone(), text: String::new() };
            let target = here.place_of(path).unwrap_or_else(|| panic!("{own}: `{link}`"));
            if copied.contains(&target) {
                continue;
            }
            let target = written.get(&target);
            let target = target.unwrap_or_else(|| panic!("{own}: `{link}` is no page"));
            let is_named = anchor.is_empty() || values(target, "id").contains(anchor);
            assert!(is_named, "{own}: `{link}` is no part");
        }
    }
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
