//! Parts that users see before the program runs: completions, manual, citation, paper.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::cli::{grazemap, scratch};

fn file(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(path).expect("it is part of the repository")
}

fn printed(arguments: &[&str]) -> String {
    let output = grazemap(scratch().path(), arguments);
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stdout).expect("a text")
}

/// The commands that `--help` lists.
fn commands() -> Vec<String> {
    let help = printed(&["--help"]);
    let (groups, _) = help.split_once("Options:\n").expect("groups of commands, then options");
    let rows = groups.lines().filter(|line| line.starts_with("  "));
    let names = rows.filter_map(|row| row.split_whitespace().next()).map(str::to_owned);
    let names: Vec<_> = names.filter(|name| name != "help").collect();
    assert!(names.len() > 15, "{names:?}");
    names
}

#[test]
fn completions_know_every_command_in_every_shell() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let text = printed(&["completions", shell]);
        for command in commands() {
            assert!(text.contains(&command), "{shell}: {command}");
        }
    }
    assert_eq!(grazemap(scratch().path(), &["completions", "csh"]).status.code(), Some(2));
}

#[test]
fn the_manual_has_a_page_of_every_command() {
    let folder = scratch();
    assert!(grazemap(folder.path(), &["man", "-o", "man1"]).status.success());
    let pages = fs::read_dir(folder.path().join("man1")).expect("a folder");
    let pages = pages.map(|page| page.expect("readable").file_name().into_string());
    let pages: BTreeSet<_> = pages.map(|name| name.expect("a name")).collect();
    let commands = commands().into_iter().map(|command| format!("grazemap-{command}.1"));
    assert_eq!(pages, commands.chain(["grazemap.1".to_owned()]).collect());
    let page = fs::read_to_string(folder.path().join("man1/grazemap-diagram.1")).expect("a page");
    assert!(page.contains(".TH grazemap-diagram 1") && page.contains("SCENE"), "{page}");
}

#[test]
fn the_citation_has_the_version_and_the_licence_of_the_package() {
    let citation = file("CITATION.cff");
    let line = |key: &str| citation.lines().find_map(|line| line.strip_prefix(key));
    assert_eq!(line("version: "), Some(env!("CARGO_PKG_VERSION")));
    let licences = env!("CARGO_PKG_LICENSE").split(" OR ");
    let stated = licences.map(|licence| format!("  - {licence}\n")).collect::<String>();
    assert!(citation.contains(&format!("license:\n{stated}")), "{stated}");
    let author = line("  - name: ").expect("authors");
    assert!(file("LICENSE-MIT").contains(author), "{author}");
}

#[test]
fn the_paper_cites_what_there_is_and_is_short() {
    let (paper, references) = (file("docs/paper/paper.md"), file("docs/references.bib"));
    let cited = paper.split('@').skip(1);
    let cited = cited.map(|text| text.split(|c: char| !c.is_alphanumeric()).next());
    let mut count = 0;
    for key in cited.flatten() {
        assert!(references.contains(&format!("{{{key},")), "{key}");
        count += 1;
    }
    assert!(count >= 10, "{count}");
    for section in [
        "Summary",
        "Statement of need",
        "State of the field",
        "Software design",
        "Research impact statement",
        "AI usage disclosure",
        "Acknowledgements",
        "References",
    ] {
        assert!(paper.contains(&format!("\n# {section}\n")), "{section}");
    }
    // The limits of the journal that the paper is written for.
    let words = paper.split_whitespace().count();
    assert!((750..=1750).contains(&words), "{words}");
}
