//! Floors of the architecture, checked against the names that every source file uses:
//! `crate::floor`, paths by `super` that leave a floor, other packages of the workspace, and
//! re-exports.
//!
//! Change the table on purpose, in the same commit as docs/development/architecture.md, when a
//! better structure is found.

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use source::{Found, House, Module, Package, Place};

/// Floors, lowest first, each with the floors it may name.
const FLOORS: [(&str, &[&str]); 17] = [
    ("interruption", &[]),
    ("numeric", &[]),
    ("jet", &["interruption", "numeric"]),
    ("model", &["numeric"]),
    ("flow", &["interruption", "numeric", "jet", "model"]),
    ("hybrid", &["interruption", "numeric", "model", "flow"]),
    ("atlas", &["interruption", "numeric", "jet", "model", "flow", "hybrid"]),
    ("continuation", &["numeric"]),
    ("orbit", &["interruption", "numeric", "jet", "model", "flow", "continuation"]),
    ("expansion", &["numeric", "jet", "model", "flow", "orbit"]),
    ("iteration", &["interruption", "numeric", "jet", "expansion"]),
    (
        "analysis",
        &[
            "numeric",
            "jet",
            "model",
            "flow",
            "hybrid",
            "atlas",
            "continuation",
            "orbit",
            "expansion",
            "iteration",
        ],
    ),
    (
        "convergence",
        &[
            "interruption",
            "numeric",
            "jet",
            "model",
            "hybrid",
            "orbit",
            "expansion",
            "iteration",
            "analysis",
        ],
    ),
    ("emission", &["numeric", "jet", "model", "expansion"]),
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
            "interruption",
            "numeric",
            "jet",
            "model",
            "atlas",
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
            "model",
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

/// The workspace, read once for all tests.
static HOUSE: LazyLock<House> =
    LazyLock::new(|| House::read(Path::new(env!("CARGO_MANIFEST_DIR"))));

/// Floor of a module; `None` at the root of a package and for modules beside the floors.
fn floor(place: &Place) -> Option<&'static str> {
    let first = place.path.first()?;
    let mut floors = FLOORS.iter().map(|(floor, _)| *floor);
    floors.find(|floor| floor == first)
}

/// Floors in a package, in the order of declaration.
fn floors_of(package: &Package) -> Vec<&String> {
    let root = &package.modules[&Vec::new()];
    let is_floor = |name: &&String| FLOORS.iter().any(|(floor, _)| floor == name);
    root.children.iter().filter(is_floor).collect()
}

fn level(floor: &str) -> usize {
    let mut floors = FLOORS.iter();
    let level = floors.position(|(name, _)| *name == floor);
    level.expect("a floor of the table")
}

/// Floors on the way of a path.
fn floors_on(found: &Found) -> BTreeSet<&'static str> {
    let way = found.way.iter().chain([&found.place]);
    way.filter_map(floor).collect()
}

/// Floors that each floor names in its files.
static FLOORS_NAMED: LazyLock<BTreeMap<&str, BTreeSet<&str>>> = LazyLock::new(|| {
    let mut all: BTreeMap<_, _> = FLOORS.map(|(floor, _)| (floor, BTreeSet::new())).into();
    for place in HOUSE.places() {
        let Some(own) = floor(&place) else { continue };
        let named = HOUSE.named(&place);
        let named = named.iter().flat_map(|(_, found)| floors_on(found));
        all.entry(own).or_default().extend(named.filter(|name| *name != own));
    }
    all
});

#[test]
fn a_floor_names_only_the_floors_it_may() {
    for place in HOUSE.places() {
        let Some(own) = floor(&place) else { continue };
        let (_, allowed) = FLOORS[level(own)];
        let file = HOUSE.module(&place).file.display();
        for (path, found) in HOUSE.named(&place) {
            // Modules beside the floors of a package know all floors, and only the highest floor
            // may use them. A package without floors is treated as any other library.
            let package = &HOUSE.packages[found.place.package];
            assert!(
                own == "cli" || !floors_on(&found).is_empty() || floors_of(package).is_empty(),
                "{file} names `{path}`, which is on no floor"
            );
            for named in floors_on(&found) {
                assert!(
                    named == own || allowed.contains(&named),
                    "{file} names `{named}` by `{path}`; floor `{own}` may name only {allowed:?}"
                );
            }
        }
    }
}

#[test]
fn a_floor_names_every_floor_it_may() {
    for (floor, allowed) in FLOORS {
        for name in allowed {
            assert!(
                FLOORS_NAMED[floor].contains(name),
                "`{floor}` may name `{name}` and does not: take it out of the table"
            );
        }
    }
}

#[test]
fn floors_name_lower_floors_only() {
    for (floor, named) in &*FLOORS_NAMED {
        for name in named {
            assert!(level(name) < level(floor), "`{floor}` names `{name}`, which is not below it");
        }
    }
}

/// Dependencies through a third floor count as well.
#[test]
fn the_two_oracles_stay_independent() {
    let below = |floor: &'static str| {
        let mut all = BTreeSet::from([floor]);
        loop {
            let more = all.iter().flat_map(|floor| &FLOORS_NAMED[*floor]).copied();
            let more: BTreeSet<_> = more.collect();
            if more.is_subset(&all) {
                break all;
            }
            all.extend(more);
        }
    };
    let simulation = below("hybrid");
    for series in ["orbit", "expansion"] {
        assert!(!simulation.contains(series), "`hybrid` knows of `{series}`");
        assert!(!below(series).contains("hybrid"), "`{series}` knows of `hybrid`");
    }
}

#[test]
fn packages_list_their_floors_in_order_and_every_folder_is_a_floor() {
    let mut listed = Vec::new();
    for package in &HOUSE.packages {
        let floors = floors_of(package);
        if floors.is_empty() {
            continue;
        }
        let root = &package.modules[&Vec::new()];
        let levels = floors.iter().map(|name| level(name));
        assert!(levels.is_sorted(), "{}: {floors:?}", root.file.display());
        for module in root.children.iter().filter(|name| !floors.contains(name)) {
            let parts = package.modules.keys().filter(|path| path[..] != [module.clone()]);
            let mut parts = parts.filter(|path| path.first() == Some(module));
            assert!(parts.next().is_none(), "`{module}` is a folder and no floor");
        }
        listed.extend(floors.into_iter().cloned());
    }
    listed.sort_by_key(|name| level(name));
    assert_eq!(listed, FLOORS.map(|(floor, _)| floor));
}

/// docs/development/architecture.md lists the floors in the same order.
#[test]
fn the_page_of_the_house_lists_its_floors_in_order() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/development/architecture.md");
    let page = fs::read_to_string(page).expect("the page");
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    let names: Vec<_> = rows.filter_map(|row| row.split('`').next()).collect();
    let floors: Vec<_> = FLOORS.iter().map(|(floor, _)| *floor).collect();
    let listed: Vec<_> = names.into_iter().filter(|name| floors.contains(name)).collect();
    assert_eq!(listed, floors);
}

/// Largest set of files of a floor that depend on each other in a circle.
fn largest_circle(house: &House, name: &str) -> Vec<Place> {
    let mut places = house.places();
    places.retain(|place| floor(place) == Some(name));
    let number: BTreeMap<_, _> = places.iter().zip(0..).collect();
    let mut leads: Vec<Vec<bool>> = Vec::new();
    for place in &places {
        let mut row = vec![false; places.len()];
        let used = house.used(place);
        for other in used.iter().filter_map(|other| number.get(other)) {
            row[*other] = true;
        }
        leads.push(row);
    }
    for by in 0..places.len() {
        let ahead = leads[by].clone();
        for row in leads.iter_mut().filter(|row| row[by]) {
            for (leads, ahead) in row.iter_mut().zip(&ahead) {
                *leads |= ahead;
            }
        }
    }
    let circle = |from: usize| {
        let others = (0..places.len()).filter(|&to| leads[from][to] && leads[to][from]);
        others.map(|to| places[to].clone()).collect::<Vec<_>>()
    };
    let circles = (0..places.len()).map(circle);
    circles.max_by_key(Vec::len).unwrap_or_default()
}

#[test]
fn no_floor_has_a_circle_of_more_than_two_files() {
    for (name, _) in FLOORS {
        let circle = largest_circle(&HOUSE, name);
        if circle.len() > 2 {
            let inside: BTreeSet<_> = circle.iter().cloned().collect();
            for place in &circle {
                let used = HOUSE.used(place);
                let used: Vec<_> = used.intersection(&inside).map(|p| p.path.join("::")).collect();
                eprintln!("{} uses {}", place.path.join("::"), used.join(", "));
            }
        }
        assert!(circle.len() <= 2, "a circle of {} files in `{name}`", circle.len());
    }
}

/// Names that stand for several types, with the files: on one floor, or `pub` in one package.
#[test]
fn a_type_has_a_name_of_its_own_on_its_floor_and_a_public_one_in_its_package() {
    let places = HOUSE.places();
    let mut files: BTreeMap<(usize, &str, &str), Vec<String>> = BTreeMap::new();
    for place in &places {
        let module = HOUSE.module(place);
        let floor = place.path.first().map_or("the root", String::as_str);
        for (name, is_public) in &module.types {
            for scope in [Some(floor), is_public.then_some("public")].into_iter().flatten() {
                let same = files.entry((place.package, scope, name.as_str())).or_default();
                same.push(module.file.display().to_string());
            }
        }
    }
    assert!(files.len() > 1000, "{}", files.len());
    let several = files.iter().filter(|(_, files)| files.len() > 1);
    let fault = |((_, scope, name), files): (&(usize, &str, &str), &Vec<String>)| {
        format!("`{name}` ({scope}): {}", files.join(", "))
    };
    let faults: Vec<String> = several.map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Source file of a place; that of the root of a package is its `lib.rs`, if it has one.
fn source_file(place: &Place) -> Option<PathBuf> {
    let file = HOUSE.module(place).file.clone();
    if !file.is_dir() {
        return Some(file);
    }
    let roots = ["lib.rs", "src/lib.rs"].map(|root| file.join(root));
    roots.into_iter().find(|root| root.exists())
}

/// Lines of source files have at most 100 columns.
#[test]
fn lines_of_source_files_have_at_most_a_hundred_columns() {
    for place in HOUSE.places() {
        let Some(file) = source_file(&place) else { continue };
        let text = fs::read_to_string(&file).expect("a source file");
        for (line, number) in text.lines().zip(1..) {
            let columns = line.chars().count();
            assert!(columns <= 100, "{}:{number} has {columns} columns", file.display());
        }
    }
}

/// Whether a line of code holds a text that names an option of the program.
fn names_an_option(line: &str) -> bool {
    // Colours of a page begin alike.
    let code = line.trim_start().replace("var(--", "");
    let is_option = |(at, _): (usize, &str)| {
        let before = code[..at].chars().next_back();
        let after = code[at + 2..].chars().next();
        before.is_some_and(|c| " `(\"".contains(c)) && after.is_some_and(|c| c.is_ascii_lowercase())
    };
    !code.starts_with("//") && code.match_indices("--").any(is_option)
}

/// Messages of the library serve Python and C too: none names an option of the program.
#[test]
fn the_library_names_no_option_of_the_program() {
    assert!(names_an_option("    \"shorter --period, or fewer\""));
    assert!(names_an_option("`--period` is too long"));
    assert!(
        !names_an_option("// as `--period` asks") && !names_an_option("\"var(--ink)\", a -- b")
    );
    let mut faults = Vec::new();
    for place in HOUSE.places() {
        let Some(file) = source_file(&place) else { continue };
        let path = file.to_string_lossy();
        // The program, commands in heads of emitted files, and packages that start compilers.
        let others = ["/src/cli", "/src/emission", "/crates/cuda"];
        if others.iter().any(|part| path.contains(part)) {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a source file");
        let code = text.lines().take_while(|line| *line != "#[cfg(test)]").zip(1..);
        let named = code.filter(|(line, _)| names_an_option(line));
        faults.extend(named.map(|(line, number)| format!("{path}:{number}: {line}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Beginnings of the paths that a file includes: `include_str!("../a")`, also within `concat!`.
fn included(text: &str) -> impl Iterator<Item = &str> {
    let calls = text.match_indices("include_str!(").chain(text.match_indices("include_bytes!("));
    calls.filter_map(|(at, call)| {
        let arguments = text[at + call.len()..].trim_start();
        let path = arguments.strip_prefix("concat!(").unwrap_or(arguments).strip_prefix('"')?;
        path.split('"').next()
    })
}

/// Beginnings of the paths that a manifest publishes; none where it publishes its whole folder.
fn published(manifest: &str) -> Vec<&str> {
    let listed = manifest.split_once("\ninclude = [").and_then(|(_, rest)| rest.split_once(']'));
    let entries = listed.map_or("", |(entries, _)| entries).split('"').skip(1).step_by(2);
    entries.filter_map(|entry| entry.trim_start_matches('/').split('*').next()).collect()
}

/// A package is published with what lies in its folder and its manifest lists, so it includes
/// nothing from elsewhere.
#[test]
fn packages_include_files_that_are_published_with_them() {
    let manifest = "[package]\ninclude = [\n  \"/src\",\n  \"/gallery/**/*.toml\",\n]\n[lib]\n";
    assert_eq!(published(manifest), ["src", "gallery/"]);
    let text = "include_str!(concat!(\"../a/\", $name)); x(include_bytes!(\"b.ttf\"))";
    assert_eq!(included(text).collect::<Vec<_>>(), ["../a/", "b.ttf"]);
    let (mut paths, mut faults) = (0, Vec::new());
    for place in HOUSE.places() {
        let Some(file) = source_file(&place) else { continue };
        let package = file.ancestors().find(|folder| folder.join("Cargo.toml").exists());
        let package = package.expect("a package");
        let manifest = fs::read_to_string(package.join("Cargo.toml")).expect("a manifest");
        let published = published(&manifest);
        let inside = file.strip_prefix(package).expect("inside").to_string_lossy().into_owned();
        for path in included(&fs::read_to_string(&file).expect("a source file")) {
            paths += 1;
            let mut parts: Vec<&str> = inside.split('/').collect();
            parts.pop();
            let stays = path.split('/').all(|part| match part {
                ".." => parts.pop().is_some(),
                part => {
                    parts.push(part);
                    true
                }
            });
            let path_inside = parts.join("/");
            let listed = published.iter().any(|begin| path_inside.starts_with(begin));
            if !stays || !(published.is_empty() || listed) {
                faults.push(format!("{}: {path}", file.display()));
            }
        }
    }
    assert!(paths > 15, "{paths}");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Openings of a doc comment whose subject stands elsewhere.
const REFUSED_OPENINGS: [&str; 8] =
    ["What", "How", "Where", "Those", "That of", "The same", "Of", "It"];

/// Number and first line of every doc comment of a file.
fn doc_comments(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().zip(1..).scan("", |before, (line, number)| {
        let line = line.trim_start();
        let is_doc = |mark: &str| line.strip_prefix(mark).filter(|rest| !rest.starts_with('/'));
        let found = ["///", "//!"].into_iter().find_map(|mark| Some((mark, is_doc(mark)?)));
        let (mark, words) = found.unwrap_or(("", ""));
        let begins = !mark.is_empty() && *before != mark;
        *before = mark;
        Some(begins.then_some((number, words.trim())))
    });
    lines.flatten()
}

/// Doc comments begin with a noun or a verb.
#[test]
fn doc_comments_name_their_subject() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders: Vec<PathBuf> = [
        "src",
        "crates",
        "tests",
        "examples",
        "benches",
        "python/src",
        "studies",
        "xtask",
        "generated/src",
    ]
    .map(|folder| root.join(folder))
    .into();
    let (mut comments, mut faults) = (0, Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of the workspace") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("a source file");
                for (number, words) in doc_comments(&text) {
                    comments += 1;
                    let begins = |opening: &&str| {
                        let rest = words.strip_prefix(*opening);
                        rest.is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
                    };
                    if REFUSED_OPENINGS.iter().any(begins) {
                        faults.push(format!("{}:{number}: {words}", path.display()));
                    }
                }
            }
        }
    }
    assert!(comments > 9000, "{comments}");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Doc comments are told by their marks, and every first line is looked at.
#[test]
fn first_lines_of_doc_comments_are_found() {
    let text = "//! One\n//! two\n\n/// Three\n/// four\nfn a() {}\n//// no\n// no\n    /// It\n";
    let found: Vec<_> = doc_comments(text).collect();
    assert_eq!(found, [(1, "One"), (4, "Three"), (9, "It")]);
}

/// Test of the reader itself, on a small workspace.
#[test]
fn the_reader_sees_what_a_file_names_in_every_form() {
    let text = r##"
        use crate::{jet::Jet, numeric::{Dd, Real as Number}};
        pub(crate) use self::child::{self, Kept};
        use super::super::flow::*;
        mod child;
        // crate::comment
        const TEXT: &str = "crate::text"; const RAW: &str = r#"crate::"raw""#;
        fn f<'a>(x: &'a Number, c: char) -> bool { c == '"' || grazemap_sim::hybrid::g::<f64>(x) || super::h() }
        #[cfg(test)]
        mod tests { use crate::unseen::A; fn g() {} }
        fn last() -> Kept { crate::orbit::locate() }
    "##;
    let module = Module::parse(text);
    let mut paths: Vec<_> = module.all_paths().map(|path| path.join("::")).collect();
    paths.sort();
    let expected = [
        "crate::jet::Jet",
        "crate::numeric::Dd",
        "crate::numeric::Real",
        "crate::orbit::locate",
        "grazemap_sim::hybrid::g",
        "self::child",
        "self::child::Kept",
        "super::h",
        "super::super::flow",
    ];
    assert_eq!(paths, expected);
    assert_eq!(module.children, ["child"]);
}

/// Types are found at the level of the module alone, and `pub` is told from `pub(crate)`.
#[test]
fn the_reader_sees_the_types_of_a_file_and_which_are_public() {
    let text =
        "pub struct A<T>(T); pub(crate) enum B {} trait C { type Inner; } pub type D = A<f64>;
        impl C for B { type Inner = u8; } fn f() { struct Local; }
        #[cfg(test)] mod tests { struct Unseen; }";
    let expected = [("A", true), ("B", false), ("C", false), ("D", true)];
    let types = Module::parse(text).types;
    assert!(types.iter().map(|(name, is_public)| (&**name, *is_public)).eq(expected), "{types:?}");
}
