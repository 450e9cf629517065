//! The catalogue: one scene per system of the literature, built into the program.

/// A scene of the catalogue.
struct Entry {
    name: &'static str,
    summary: &'static str,
    text: &'static str,
}

/// An entry whose text is the file of that name under `scenes/`.
macro_rules! entry {
    ($name:literal, $summary:literal) => {
        Entry {
            name: $name,
            summary: $summary,
            text: include_str!(concat!("../../scenes/", $name, ".toml")),
        }
    };
}

/// Every scene of the catalogue, the first being the one the program runs when none is named.
const ENTRIES: &[Entry] = &[entry!(
    "linear",
    "linear oscillator with a rigid stop, omega = 1.8 (Thota, Zhao, Dankowicz 2006)"
)];

/// Names of the scenes, in the order of the catalogue.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|entry| entry.name)
}

/// The text of a scene, or `None` if the catalogue holds none of this name.
pub fn text(name: &str) -> Option<&'static str> {
    find(name).map(|entry| entry.text)
}

/// What a scene of the catalogue is, in one line.
pub fn summary(name: &str) -> Option<&'static str> {
    find(name).map(|entry| entry.summary)
}

fn find(name: &str) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.name == name)
}
