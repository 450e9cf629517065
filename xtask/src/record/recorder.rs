//! Results that a change of the code must not change, as hashes of all bits.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::PathBuf;

use super::hash::Hash;
use super::subject::Subjects;
use super::{maps, simulation};
use crate::root;

/// Hashes by name: `group scene variant`.
pub type Lines = BTreeMap<String, String>;

/// Function that records a group for a scene.
type Recorded = fn(&Subjects, &mut Page);

/// Groups, each recorded in a file of its own.
const GROUPS: [(&str, Recorded); 8] = [
    ("orbits", maps::orbits),
    ("returns", simulation::returns),
    ("lanes", simulation::lanes),
    ("periods", simulation::periods),
    ("jets", maps::jets),
    ("images", maps::images),
    ("sweeps", maps::sweeps),
    ("emitted", maps::emitted),
];

/// Names of all groups.
pub fn groups() -> impl Iterator<Item = &'static str> {
    GROUPS.iter().map(|&(name, _)| name)
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

    fn line(&mut self, variant: &str, value: String) {
        let key = format!("{} {} {variant}", self.group, self.scene);
        self.lines.insert(key, value);
    }
}

/// Lines of some groups of a scene, computed by the present code.
pub fn computed(scene: &'static str, groups: &[&str]) -> Lines {
    let subjects = Subjects::new(scene);
    let mut lines = Lines::new();
    for (group, record) in GROUPS.iter().filter(|(name, _)| groups.contains(name)) {
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
