//! Results that a change of the code must not change, as hashes of all bits and as golden texts.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::PathBuf;

use super::hash::Hash;
use super::questions::{BASINS, BRANCHES, CRISES, CURVES, FITS, LOCI, MANIFOLDS, NOISE, SEARCHES};
use super::subject::Subjects;
use super::{answers, documents, maps, simulation};
use crate::root;

/// Hashes, or values of golden texts, by name: `group scene variant`.
pub type Lines = BTreeMap<String, String>;

/// Function that records a group for a scene.
type Recorded = fn(&Subjects, &mut Page);

/// Scenes of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scenes {
    /// Every scene of the catalogue.
    All,
    /// Scenes that questions name, or that lanes can simulate.
    Few,
}

/// Groups, each recorded in a file of its own.
const GROUPS: [(&str, Scenes, Recorded); 20] = [
    ("orbits", Scenes::All, maps::orbits),
    ("returns", Scenes::All, simulation::returns),
    ("lanes", Scenes::Few, simulation::lanes),
    ("periods", Scenes::All, simulation::periods),
    ("jets", Scenes::All, maps::jets),
    ("images", Scenes::All, maps::images),
    ("sweeps", Scenes::All, maps::sweeps),
    ("emitted", Scenes::All, maps::emitted),
    ("branches", Scenes::Few, |subjects, page| answers::commands(subjects, page, BRANCHES)),
    ("loci", Scenes::Few, |subjects, page| answers::commands(subjects, page, LOCI)),
    ("crises", Scenes::Few, |subjects, page| answers::commands(subjects, page, CRISES)),
    ("searches", Scenes::Few, |subjects, page| answers::commands(subjects, page, SEARCHES)),
    ("curves", Scenes::Few, |subjects, page| answers::commands(subjects, page, CURVES)),
    ("basins", Scenes::Few, |subjects, page| answers::basins(subjects, page, BASINS)),
    ("manifolds", Scenes::Few, |subjects, page| answers::basins(subjects, page, MANIFOLDS)),
    ("fits", Scenes::Few, |subjects, page| answers::fits(subjects, page, FITS)),
    ("noise", Scenes::Few, |subjects, page| answers::commands(subjects, page, NOISE)),
    ("windows", Scenes::Few, answers::windows),
    ("choices", Scenes::Few, answers::choices),
    ("documents", Scenes::Few, documents::documents),
];

/// Names of all groups.
pub fn groups() -> impl Iterator<Item = &'static str> {
    GROUPS.iter().map(|&(name, ..)| name)
}

/// Names of the groups of these scenes.
pub fn groups_of(scenes: Scenes) -> impl Iterator<Item = &'static str> {
    GROUPS.iter().filter(move |(_, own, _)| *own == scenes).map(|&(name, ..)| name)
}

/// Collector of the lines of a group and a scene.
#[derive(Debug)]
pub(super) struct Page {
    group: &'static str,
    scene: &'static str,
    lines: Lines,
}

impl Page {
    /// Adds a hash.
    pub(super) fn put(&mut self, variant: &str, hash: Hash) {
        self.line(variant, format!("{:016x}", hash.value()));
    }

    /// Adds a hash, or a note that there is no result.
    pub(super) fn put_or(&mut self, variant: &str, hash: Option<Hash>) {
        match hash {
            Some(hash) => self.put(variant, hash),
            None => self.refuse(variant, "refused"),
        }
    }

    /// Adds a word instead of a hash.
    pub(super) fn refuse(&mut self, variant: &str, reason: &str) {
        self.line(variant, reason.to_owned());
    }

    /// Adds a value without spaces, as a member of a golden text.
    pub(super) fn line(&mut self, variant: &str, value: String) {
        let key = format!("{} {} {variant}", self.group, self.scene);
        self.lines.insert(key, value);
    }
}

/// Lines of some groups of a scene, computed by the present code.
pub fn computed(scene: &'static str, groups: &[&str]) -> Lines {
    let subjects = Subjects::new(scene);
    let mut lines = Lines::new();
    for (group, _, record) in GROUPS.iter().filter(|(name, ..)| groups.contains(name)) {
        let mut page = Page { group, scene, lines: Lines::new() };
        record(&subjects, &mut page);
        lines.append(&mut page.lines);
    }
    lines
}

/// Path of the file of a group.
pub fn file(group: &str) -> PathBuf {
    let folder = root().join("tests/data/record");
    folder.join(format!("{group}.txt"))
}

/// Recorded lines of a group.
pub fn recorded(group: &str) -> io::Result<Lines> {
    let text = fs::read_to_string(file(group))?;
    let lines = text.lines().filter_map(|line| line.rsplit_once(' '));
    Ok(lines.map(|(key, hash)| (key.into(), hash.into())).collect())
}

/// Whether a line belongs to some of these groups and scenes.
pub fn is_of(line: &str, groups: &[&str], scenes: &[&str]) -> bool {
    let mut words = line.split(' ');
    let mut among = |names: &[&str]| words.next().is_some_and(|word| names.contains(&word));
    among(groups) && among(scenes)
}

/// Differences between computed and recorded lines, one line each.
pub fn differences(recorded: &Lines, computed: &Lines) -> Vec<String> {
    let missing = |key: &&String| !recorded.contains_key(*key);
    let keys = recorded.keys().chain(computed.keys().filter(missing));
    let said = |value: Option<&String>| value.cloned().unwrap_or_else(|| "nothing".to_owned());
    keys.filter(|&key| recorded.get(key) != computed.get(key))
        .map(|key| {
            let [was, is] = [recorded, computed].map(|lines| said(lines.get(key)));
            format!("{key}: recorded {was}, computed {is}")
        })
        .collect()
}
