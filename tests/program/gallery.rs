//! The gallery: the numbers of every entry, the page of entries that take seconds, and the list of
//! entries.

use super::cli::{grazemap, scratch};

/// Number of figures and tables of five papers that can be reproduced at least in kind, and of
/// systems from outside.
const ENTRIES: usize = 37 + 11;

#[test]
fn every_figure_and_table_is_listed_once() {
    let folder = scratch();
    let output = grazemap(folder.path(), &["gallery", "--list"]);
    assert!(output.status.success());
    let listed = String::from_utf8(output.stdout).expect("words");
    let mut names: Vec<&str> = listed.lines().filter_map(|line| line.split("  ").next()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), ENTRIES);
    assert!(listed.lines().any(|line| line.contains("(needs ")), "{listed}");
}

#[test]
fn an_unknown_entry_is_refused_and_the_nearest_is_named() {
    let folder = scratch();
    let output = grazemap(folder.path(), &["gallery", "thota2006/fig11"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("did you mean `thota2006/fig1`?"), "{said}");
}

/// Computes the entries of a paper. The program compares the numbers, and ends with exit code 1 if
/// one disagrees with its entry.
fn reproduces(paper: &str) {
    let folder = scratch();
    let output = grazemap(folder.path(), &["gallery", paper, "--numbers", "-o", "page"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let page = folder.path().join("page");
    let numbers = std::fs::read_to_string(page.join("numbers.csv")).expect("the table");
    assert!(numbers.lines().count() > 1 && numbers.contains("agrees"), "{numbers}");
    assert!(!page.join("index.html").exists());
}

#[test]
fn the_small_gallery_has_fewer_entries_by_paper_with_their_pictures_and_counts() {
    let folder = scratch();
    let output = grazemap(folder.path(), &["gallery", "thota2006", "--small", "-o", "page"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("1 entry") && said.contains("agree with the print"), "{said}");
    let html = std::fs::read_to_string(folder.path().join("page/index.html")).expect("the page");
    for words in ["<svg", "P. Thota, X. Zhao, H. Dankowicz, 2006", "not printed", "Left out"] {
        assert!(html.contains(words), "{words}");
    }
    let output = grazemap(folder.path(), &["gallery", "foale1994/fig3", "--small"]);
    assert!(!output.status.success());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("foale1994/fig3"), "{said}");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn the_numbers_of_thota_zhao_and_dankowicz_are_reproduced() {
    reproduces("thota2006");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn the_numbers_of_the_cantilever_are_reproduced() {
    reproduces("cantilever");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn the_numbers_of_soft_impacts_are_reproduced() {
    reproduces("kundu2012");
}

#[test]
fn the_numbers_of_foale_are_reproduced() {
    reproduces("foale1994");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn the_numbers_of_systems_from_outside_are_reproduced() {
    reproduces("outside");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn the_orbits_of_two_masses_are_reproduced() {
    reproduces("two_masses");
}
