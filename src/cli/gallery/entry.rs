//! Entries of the gallery: one published figure or table each, in files under `gallery/`, and the
//! papers they are from. Their numbers are read from the JSON of commands, or are expressions of
//! such numbers.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;
use toml_edit::{DocumentMut, Item, TableLike};

use grazemap::Scene;
use grazemap::iteration::OrbitName;
use grazemap::model::catalogue;

/// Published figure or table, with the commands that reproduce it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    /// `PAPER/FIGURE`: path of the file under `gallery/`, without its extension.
    #[serde(skip)]
    pub(super) name: &'static str,
    /// Short name of the paper.
    pub(super) paper: String,
    /// Number of the figure or table in the paper.
    pub(super) figure: String,
    /// Title, in a few words.
    pub(super) title: String,
    /// Contents of the published figure.
    pub(super) shows: String,
    /// Whether the results agree, or why they do not.
    #[serde(default)]
    pub(super) verdict: String,
    /// Feature that the program lacks to reproduce it.
    pub(super) needs: Option<String>,
    /// Commands to run, in order.
    #[serde(default)]
    pub(super) computation: Vec<Computation>,
    /// Numbers to compare.
    #[serde(default)]
    pub(super) number: Vec<Number>,
}

/// Command of the program.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Computation {
    /// Name of the computation in the entry, and of its folder.
    pub(super) name: String,
    /// Command, scene of the catalogue or of `outside/scenes`, and further arguments, separated by
    /// blanks.
    pub(super) command: String,
    /// Tables appended to the scene's text, in TOML.
    pub(super) append: Option<String>,
    /// Values of `--set`.
    #[serde(default)]
    pub(super) set: Vec<String>,
    /// Further values of `--set` where numbers alone are compared: fewer points.
    #[serde(default)]
    pub(super) small: Vec<String>,
    /// Whether the computation is left out where numbers alone are compared, with the numbers read
    /// from it.
    #[serde(default)]
    pub(super) large: bool,
    /// Pictures to show, out of those that the command writes.
    #[serde(default)]
    pub(super) picture: Vec<Shown>,
}

/// Picture and its caption.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shown {
    /// File name without extension.
    pub(super) file: String,
    /// Caption.
    pub(super) caption: String,
}

/// Number or word to compare.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Number {
    /// Name of the quantity.
    pub(super) what: String,
    /// Value as the paper prints it.
    pub(super) printed: Option<String>,
    /// Value known by other means: a closed form, or another program.
    pub(super) reference: Option<String>,
    /// Path of the value in the results, which begins with the name of a computation and goes on as
    /// [`find`] reads it; or an expression in the names of `of`.
    pub(super) value: String,
    /// Names in the expression, with the paths of their values.
    #[serde(default)]
    pub(super) of: BTreeMap<String, String>,
    /// Largest difference from the printed value and from the reference. Default: one unit of the
    /// last digit given, 0 for whole numbers.
    pub(super) tolerance: Option<f64>,
    /// Reason why the value differs from the printed one.
    pub(super) differs: Option<String>,
    /// Further remark.
    #[serde(default)]
    pub(super) remark: String,
}

impl Number {
    /// Largest difference from a number as it is written.
    pub(super) fn tolerance(&self, written: &str) -> f64 {
        let (digits, exponent) = written.split_once('e').unwrap_or((written, "0"));
        let Some((_, decimals)) = digits.split_once('.') else {
            return self.tolerance.unwrap_or(if written.contains('e') { 0.5 } else { 0.0 });
        };
        let place = exponent.parse().unwrap_or(0) - decimals.len() as i32;
        // NOTE: the last digit of the written number is rounded too.
        self.tolerance.unwrap_or_else(|| 1.000_001 * 10_f64.powi(place))
    }
}

impl Computation {
    /// Whether its scene is written to a file first: it is not of the catalogue, or has tables
    /// appended.
    pub(super) fn is_file(&self, scene: &str) -> bool {
        self.append.is_some() || catalogue::text(scene).is_none()
    }

    /// Whether the computation is left out of a version.
    pub(super) fn is_left_out(&self, version: Version) -> bool {
        version == Version::Numbers && self.large
    }

    /// Arguments of the program.
    pub(super) fn arguments(&self, version: Version) -> Vec<String> {
        let words = self.command.split_whitespace().map(str::to_owned);
        let more = if version == Version::Numbers { self.small.as_slice() } else { &[] };
        let set = self.set.iter().chain(more);
        words.chain(set.flat_map(|set| ["--set".to_owned(), set.clone()])).collect()
    }

    /// Command as typed in a shell.
    pub(super) fn line(&self, version: Version) -> String {
        let quoted = |word: &String| match word.contains(['"', '[', '*', '{', ' ']) {
            true => format!("'{word}'"),
            false => word.clone(),
        };
        let mut words: Vec<String> = self.arguments(version).iter().map(quoted).collect();
        if let Some(scene) = words.get_mut(1)
            && self.is_file(scene)
        {
            scene.push_str(".toml");
        }
        format!("grazemap {}", words.join(" "))
    }
}

impl Entry {
    /// Folder of the entry: the key of its paper.
    pub(super) fn folder(&self) -> &'static str {
        self.name.split_once('/').map_or(self.name, |(folder, _)| folder)
    }

    /// Whether the entry takes seconds: no computation has a version with fewer points.
    pub(super) fn is_short(&self) -> bool {
        self.computation.iter().all(|one| one.small.is_empty() && !one.large)
    }

    /// Whether a number is read from a computation that is left out of a version.
    pub(super) fn is_left_out(&self, number: &Number, version: Version) -> bool {
        let mut left_out = self.computation.iter().filter(|one| one.is_left_out(version));
        let paths = || number.of.values().chain([&number.value]);
        left_out.any(|one| paths().any(|path| path.split('/').next() == Some(one.name.as_str())))
    }

    /// Parses an entry. The files are part of the program, and a test parses them all.
    fn parse(name: &'static str, text: &str) -> Result<Self, String> {
        let document: DocumentMut = text.parse().map_err(|fault| format!("{name}: {fault}"))?;
        let entry: Result<Self, _> = serde_json::from_value(table_value(&*document));
        entry.map(|entry| Self { name, ..entry }).map_err(|fault| format!("{name}: {fault}"))
    }
}

/// Parts of the gallery that are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    /// Every entry, whole.
    Full,
    /// Entries that take seconds, whole.
    Small,
    /// The numbers of every entry, with few points and no pictures.
    Numbers,
}

/// Paper whose figures are entries.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Paper {
    pub(super) title: String,
    pub(super) authors: Option<String>,
    pub(super) year: Option<String>,
    /// Journal, volume, pages.
    pub(super) published: Option<String>,
    pub(super) doi: Option<String>,
    /// Further remark.
    pub(super) note: Option<String>,
}

impl Paper {
    /// Authors and year, journal and DOI, as far as they are known.
    pub(super) fn citation(&self) -> Option<String> {
        let doi = self.doi.as_ref().map(|doi| format!("doi:{doi}"));
        let known = [&self.authors, &self.year, &self.published, &doi, &self.note];
        let known: Vec<&str> = known.into_iter().flatten().map(|part| part.trim()).collect();
        (!known.is_empty()).then(|| known.join(", "))
    }
}

/// All papers, by the folder of their entries.
pub(super) fn papers() -> Result<BTreeMap<String, Paper>, String> {
    let fault = |fault: &dyn std::fmt::Display| format!("papers: {fault}");
    let text = include_str!("../../../gallery/papers.toml");
    let document: DocumentMut = text.parse().map_err(|found| fault(&found))?;
    serde_json::from_value(table_value(&*document)).map_err(|found| fault(&found))
}

/// All entries, by paper.
pub(super) fn entries() -> Result<Vec<Entry>, String> {
    FILES.iter().map(|(name, text)| Entry::parse(name, text)).collect()
}

/// TOML table as JSON.
fn table_value(table: &dyn TableLike) -> Value {
    let pairs = table.iter().map(|(key, item)| (key.to_owned(), item_value(item)));
    Value::Object(pairs.collect())
}

fn item_value(item: &Item) -> Value {
    if let Some(table) = item.as_table_like() {
        return table_value(table);
    }
    if let Some(tables) = item.as_array_of_tables() {
        return tables.iter().map(|table| table_value(table)).collect();
    }
    if let Some(values) = item.as_array() {
        return values.iter().map(|value| item_value(&Item::Value(value.clone()))).collect();
    }
    let text = item.as_str().map(Value::from).or(item.as_bool().map(Value::from));
    let number =
        || item.as_float().or(item.as_integer().map(|whole| whole as f64)).map(Value::from);
    text.or_else(number).unwrap_or_default()
}

/// Files under `gallery/`, by paper and figure.
macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../../gallery/", $name, ".toml")))),*]
    };
}

const FILES: &[(&str, &str)] = files![
    "thota2006/fig1",
    "thota2006/fig2",
    "thota2006/fig3",
    "thota2006/fig4",
    "thota2006/fig5",
    "thota2006/fig6",
    "thota2006/fig7",
    "thota2006/fig8",
    "two_masses/fig2",
    "two_masses/fig3",
    "two_masses/fig4",
    "two_masses/fig6",
    "two_masses/fig7",
    "two_masses/fig8",
    "two_masses/fig9",
    "two_masses/fig10",
    "cantilever/table1",
    "cantilever/table2",
    "cantilever/fig3",
    "cantilever/fig4",
    "cantilever/fig5",
    "kundu2012/fig6b",
    "kundu2012/fig7",
    "kundu2012/fig8",
    "kundu2012/fig9",
    "kundu2012/fig10",
    "kundu2012/fig11",
    "kundu2012/fig12",
    "kundu2012/fig13",
    "kundu2012/fig14",
    "foale1994/fig1",
    "foale1994/fig2",
    "foale1994/fig3",
    "foale1994/fig4",
    "foale1994/fig5",
    "foale1994/fig6",
    "foale1994/fig7",
    "outside/bilinear_rig",
    "outside/elastic_stop",
    "outside/gear_backlash",
    "outside/impact_at_resonance",
    "outside/impacting_absorber",
    "outside/inverted_pendulum",
    "outside/relief_valve",
    "outside/resonant_graze",
    "outside/soft_impact",
    "outside/undamped",
    "outside/van_der_pol_wall",
];

/// Scenes of systems from outside, which are not of the catalogue.
const SCENES: &[(&str, &str)] = files![
    "outside/scenes/bilinear_rig",
    "outside/scenes/elastic_stop",
    "outside/scenes/gear_backlash",
    "outside/scenes/impact_at_resonance",
    "outside/scenes/impacting_absorber",
    "outside/scenes/inverted_pendulum",
    "outside/scenes/relief_valve",
    "outside/scenes/resonant_graze",
    "outside/scenes/soft_impact",
    "outside/scenes/undamped",
    "outside/scenes/van_der_pol_wall",
];

/// Text of a scene: of a system from outside, or of the catalogue.
pub(super) fn scene_text(name: &str) -> Option<&'static str> {
    let outside = SCENES.iter().find(|(path, _)| path.ends_with(&format!("/{name}")));
    outside.map(|(_, text)| *text).or_else(|| catalogue::text(name))
}

/// Finds the value at a path of keys and list positions, separated by `/`.
///
/// In a list, `key=value` takes the first element whose `key` is the word `value`, or else the one
/// whose number is nearest to it, and `a=b&c=d` does so among those equal in all but the last; a
/// key inside a key is `outer.inner`. An element that has no value at the rest of the path is
/// passed over. `count` is the length of a list, and `count(key=value)` the number of its elements
/// with that value. An object that names an orbit is its name in words.
pub(super) fn find(document: &Value, path: &str) -> Option<Value> {
    let (segment, rest) = match path.split_once('/') {
        Some((segment, rest)) => (segment, Some(rest)),
        None => (path, None),
    };
    if let Some(counted) = count(document, segment) {
        return Some(counted.into());
    }
    let onward = |value: &Value| match rest {
        Some(rest) => find(value, rest),
        None => {
            let name: Result<OrbitName, _> = serde_json::from_value(value.clone());
            Some(name.map_or_else(|_| value.clone(), |name| name.to_string().into()))
        }
    };
    match document {
        Value::Array(list) if segment.contains('=') => {
            selected(list, segment)?.into_iter().find_map(onward)
        }
        Value::Array(list) => onward(list.get(segment.parse::<usize>().ok()?)?),
        other => onward(other.get(segment)?),
    }
}

fn count(value: &Value, segment: &str) -> Option<usize> {
    let list = value.as_array()?;
    let condition = segment.strip_prefix("count")?;
    if condition.is_empty() {
        return Some(list.len());
    }
    let (key, wanted) = condition.strip_prefix('(')?.strip_suffix(')')?.split_once('=')?;
    Some(list.iter().filter(|element| is_equal(element, key, wanted)).count())
}

/// Elements of a list that a segment of a path selects, the first choice first.
fn selected<'a>(list: &'a [Value], segment: &str) -> Option<Vec<&'a Value>> {
    let (all, last) = segment.rsplit_once('&').unwrap_or(("", segment));
    let conditions = all.split('&').filter_map(|condition| condition.split_once('='));
    let candidates = list
        .iter()
        .filter(|element| conditions.clone().all(|(key, wanted)| is_equal(element, key, wanted)));
    let (key, wanted) = last.split_once('=')?;
    let equal = candidates.clone().filter(|element| is_equal(element, key, wanted));
    let equal: Vec<&Value> = equal.collect();
    let Ok(number) = wanted.parse::<f64>() else { return Some(equal) };
    if !equal.is_empty() {
        return Some(equal);
    }
    let distance = |element: &&Value| {
        let value = inner(element, key).and_then(Value::as_f64);
        value.map_or(f64::INFINITY, |value| (value - number).abs())
    };
    let mut nearest: Vec<&Value> = candidates.collect();
    nearest.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    Some(nearest)
}

fn is_equal(element: &Value, key: &str, wanted: &str) -> bool {
    let word = inner(element, key).map(|value| match value {
        Value::String(word) => word.clone(),
        other => other.to_string(),
    });
    word.as_deref() == Some(wanted)
}

fn inner<'a>(element: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(element, |value, key| match value {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        other => other.get(key),
    })
}

/// Value of an expression in which names stand for numbers; `None` if the text is not an
/// expression.
///
/// The expression is evaluated by a scene, as the value of a parameter.
pub(super) fn evaluate(expression: &str, named: &[(&str, f64)]) -> Option<f64> {
    const SCENE: &str = "linear";
    const PARAMETER: &str = "omega";
    let value = format!("\"{}\"", inserted(expression, named));
    let overrides = [(PARAMETER.to_owned(), value)];
    let scene = Scene::parse_with(catalogue::text(SCENE)?, SCENE, &overrides).ok()?;
    let mut parameters = scene.model.parameters.iter();
    Some(parameters.find(|parameter| parameter.name == PARAMETER)?.value.to_f64())
}

/// Expression with names replaced by their numbers.
fn inserted(expression: &str, named: &[(&str, f64)]) -> String {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let (mut text, mut word) = (String::new(), String::new());
    for letter in expression.chars().chain([' ']) {
        if is_part(letter) {
            word.push(letter);
            continue;
        }
        match named.iter().find(|(name, _)| *name == word) {
            Some((_, value)) => text.push_str(&format!("({value:e})")),
            None => text.push_str(&word),
        }
        word.clear();
        text.push(letter);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_has_its_paper_and_some_take_seconds() {
        let (papers, entries) = (papers().expect("papers"), entries().expect("entries"));
        for entry in &entries {
            let paper = papers.get(entry.folder()).expect(entry.name);
            assert!(paper.citation().is_some(), "{}", entry.name);
        }
        let short = entries.iter().filter(|entry| entry.is_short());
        assert!(short.filter(|entry| !entry.number.is_empty()).count() >= 12);
    }

    #[test]
    fn a_path_leads_by_keys_places_and_nearest_values() {
        let document = serde_json::json!({
            "list": [
                {"n": 1, "at": {"omega": 2.0}, "word": "a"},
                {"n": 2, "at": {"omega": 2.1}, "word": "b"},
                {"n": 2, "at": {"omega": 4.0}, "word": "c", "more": [5]},
            ],
            "orbit": {"hits": [1, 1], "periods": 3},
        });
        let found = |path| find(&document, path).map(|value| value.to_string());
        assert_eq!(found("list/1/at/omega").as_deref(), Some("2.1"));
        assert_eq!(found("list/at.omega=2.09/word").as_deref(), Some("\"b\""));
        assert_eq!(found("list/n=2&at.omega=1.0/word").as_deref(), Some("\"b\""));
        assert_eq!(found("list/word=c/n").as_deref(), Some("2"));
        // The first with that number has no value at the rest of the path.
        assert_eq!(found("list/n=2/more/0").as_deref(), Some("5"));
        assert_eq!(found("list/n=1/more/0"), None);
        assert_eq!(found("list/count").as_deref(), Some("3"));
        assert_eq!(found("list/count(n=2)").as_deref(), Some("2"));
        assert_eq!(found("orbit").as_deref(), Some("\"(1,1,3)\""));
        assert_eq!(found("list/7/n"), None);
        assert_eq!(found("list/word=d"), None);
    }

    #[test]
    fn names_stand_for_their_numbers() {
        let value = evaluate("2*sqrt(a) + ab^2 - 1.5e-1", &[("a", 9.0), ("ab", -0.5)]);
        assert_eq!(value, Some(6.1));
        assert_eq!(evaluate("2*c", &[("a", 9.0)]), None);
    }
}
