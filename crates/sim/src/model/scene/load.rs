//! A scene from a file or a text, with overrides; and checks that only some commands make: sweeps
//! of frozen parameters, and resets that move tangent states.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use toml_edit::{Document, DocumentMut, Item, TableLike, Value};

use super::document::{Table, shown};
use super::{Digest, Scene, diagram, oscillator, period, tables};
use crate::model::catalogue;
use crate::model::error::{Checked, Fault, OverrideReason, SceneError, SceneProblem};
use crate::model::graph::NodeId;
use crate::model::names::{self, nearest};
use crate::model::oscillator::Response;
use crate::numeric::Dd;

/// Name of the file of tables that a request adds, in messages.
const REQUEST: &str = "request";

/// Longest text read, in bytes.
const LONGEST: usize = 1 << 20;

/// Error in a scene's file, or in the tables of a request, which begin at a place in the text.
fn in_request(fault: Fault, name: &str, text: &str, request_at: Option<usize>) -> SceneError {
    match request_at.map(|at| (at, fault.clone().behind(at))) {
        Some((at, Some(fault))) => fault.in_file(REQUEST, &text[at..]),
        _ => fault.in_file(name, text),
    }
}

/// Tables of a scene.
const KEYS: [&str; 10] = [
    "model",
    "grazing",
    "section",
    "expansion",
    "window",
    "direct",
    "emit",
    "diagram",
    "chart",
    "basin",
];

impl Scene {
    /// Reads and checks a scene. `file_name` appears in messages and determines the identifier.
    ///
    /// ```
    /// use grazemap_sim::model::{Scene, catalogue};
    ///
    /// let source = catalogue::text("linear").expect("the catalogue holds it");
    /// let scene = Scene::parse(source, "linear.toml")?;
    /// assert_eq!(scene.model.full_state_names(), ["x", "v", "theta"]);
    /// # Ok::<(), grazemap_sim::model::SceneError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The first fault of the text, with its place.
    pub fn parse(source: &str, file_name: &str) -> Result<Self, SceneError> {
        Self::parse_with(source, file_name, &[])
    }

    /// Reads and checks a scene, with overrides `(key, value)` applied to the text first.
    ///
    /// A bare name is a parameter of the model; a dotted key is a place of the scene, with list
    /// entries by number (`expansion.smooth_order`, `diagram.0.points`).
    ///
    /// # Errors
    ///
    /// The first fault of the overrides, or of the text after them.
    pub fn parse_with(
        source: &str,
        file_name: &str,
        overrides: &[(String, String)],
    ) -> Result<Self, SceneError> {
        let text =
            overridden(source, overrides).map_err(|fault| fault.in_file(file_name, source))?;
        read(&text, file_name).map_err(|fault| fault.in_file(file_name, &text))
    }

    /// Text of a scene with overrides applied, as in [`parse_with`](Scene::parse_with); the digest
    /// is that of this text.
    ///
    /// # Errors
    ///
    /// The first fault of the overrides.
    pub fn text_with(
        source: &str,
        file_name: &str,
        overrides: &[(String, String)],
    ) -> Result<String, SceneError> {
        overridden(source, overrides).map_err(|fault| fault.in_file(file_name, source))
    }

    /// The scene with other `[[diagram]]`, `[[chart]]` and `[[basin]]` tables, given as text.
    /// Settled section and window are kept; text and digest are those of the new scene.
    ///
    /// ```
    /// use grazemap_sim::model::Scene;
    ///
    /// let tables = "[[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 1e-4]\n";
    /// let scene = Scene::of_catalogue("linear")?.asking(tables)?;
    /// assert_eq!((scene.diagrams.len(), scene.charts.len()), (1, 0));
    /// # Ok::<(), grazemap_sim::model::SceneError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The first fault, with its place in the tables, whose file is called `request`, or in the
    /// scene's text.
    pub fn asking(&self, tables: &str) -> Result<Self, SceneError> {
        let name = &self.file_name;
        let kept = without_requests(&self.text).map_err(|fault| fault.in_file(name, &self.text))?;
        let kept = kept.trim_end();
        let text = format!("{kept}\n\n{tables}");
        let request_at = Some(kept.len() + 2);
        let asked =
            read(&text, name).map_err(|fault| in_request(fault, name, &text, request_at))?;
        Ok(Self {
            request_at,
            identifier: self.identifier.clone(),
            section: self.section,
            section_rule: self.section_rule,
            window: self.window.clone(),
            ..asked
        })
    }

    /// Scene of the [catalogue], by its name.
    ///
    /// ```
    /// use grazemap_sim::model::Scene;
    ///
    /// let scene = Scene::of_catalogue("linear")?;
    /// assert_eq!(scene.model.full_state_names(), ["x", "v", "theta"]);
    /// assert!(Scene::of_catalogue("linaer").is_err());
    /// # Ok::<(), grazemap_sim::model::SceneError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`SceneProblem::NotInCatalogue`].
    pub fn of_catalogue(name: &str) -> Result<Self, SceneError> {
        let file_name = format!("{name}.toml");
        let unknown = || {
            let (name, nearest) = (name.to_owned(), nearest(name, catalogue::names()));
            Fault::nowhere(SceneProblem::NotInCatalogue { name, nearest }).in_file(&file_name, "")
        };
        Self::parse(catalogue::text(name).ok_or_else(unknown)?, &file_name)
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::Unreadable`] if the file cannot be read as UTF-8 text; otherwise the errors
    /// of [`parse`](Scene::parse).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::load_with(path.as_ref(), &[])
    }

    /// Reads and checks a scene file, with overrides as in [`parse_with`](Scene::parse_with).
    ///
    /// # Errors
    ///
    /// The errors of [`load`](Scene::load) and [`parse_with`](Scene::parse_with).
    pub fn load_with(path: &Path, overrides: &[(String, String)]) -> Result<Self, SceneError> {
        let file_name = path.display().to_string();
        let unreadable = |reason: String| {
            Fault::nowhere(SceneProblem::Unreadable { reason }).in_file(&file_name, "")
        };
        let bytes = at_most(LONGEST + 1, path).map_err(|error| unreadable(error.to_string()))?;
        let source = String::from_utf8(bytes).map_err(|error| {
            unreadable(format!(
                "it is not text (byte {} is not UTF-8)",
                error.utf8_error().valid_up_to()
            ))
        })?;
        Self::parse_with(&source, &file_name, overrides)
    }
}

/// Bytes of a file, at most `limit`: a device may have no end.
fn at_most(limit: usize, path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(limit as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Text of a scene with the overrides applied.
fn overridden(source: &str, values: &[(String, String)]) -> Checked<String> {
    if source.len() > LONGEST {
        return Err(Fault::nowhere(SceneProblem::TooLong { limit: LONGEST }));
    }
    if values.is_empty() {
        return Ok(source.to_owned());
    }
    let mut document = parsed(source)?.into_mut();
    apply(&mut document, values)?;
    Ok(document.to_string())
}

/// Text of a scene without its diagrams, charts and basins.
fn without_requests(text: &str) -> Checked<String> {
    let mut document = parsed(text)?.into_mut();
    for key in ["diagram", "chart", "basin"] {
        document.remove(key);
    }
    Ok(document.to_string())
}

fn parsed(text: &str) -> Checked<Document<&str>> {
    Document::parse(text).map_err(|error| {
        let problem = SceneProblem::Toml { reason: error.message().trim().replace('\n', "; ") };
        Fault { problem: Box::new(problem), span: error.span() }
    })
}

/// Reads a whole scene.
fn read(text: &str, file_name: &str) -> Checked<Scene> {
    let document = parsed(text)?;
    let root = Table::root(text, document.as_table());
    root.only(&KEYS)?;
    let identifier = names::identifier(file_name);
    let (mut model, scope) = oscillator::read(&root.require("model")?.table()?, &identifier)?;
    let table = |key: &str| root.field(key).map(|field| field.table()).transpose();
    let tables = |key: &str| root.field(key).map_or(Ok(Vec::new()), |field| field.tables());
    let grazing_table = root.require("grazing")?.table()?;
    let grazing = tables::read_grazing(&grazing_table, &model)?;
    let warnings = tables::idle_parameters(&grazing_table, &model, &grazing)?;
    let expansion = tables::read_expansion(table("expansion")?.as_ref(), &model, &grazing)?;
    let (section, section_rule) =
        tables::read_section(table("section")?.as_ref(), &model, expansion.orders)?;
    let window = tables::read_window(table("window")?.as_ref(), &model, &expansion.active)?;
    let direct = tables::read_direct(table("direct")?.as_ref())?;
    let emit = tables::read_emit(table("emit")?.as_ref(), expansion.orders)?;
    let mut diagrams = Vec::new();
    for table in tables("diagram")? {
        diagrams.push(diagram::read(&table, &mut model, &scope)?);
    }
    let mut charts = Vec::new();
    for table in tables("chart")? {
        charts.push(diagram::read_chart(&table, &model)?);
    }
    let basins = tables("basin")?;
    let basins = basins.iter().map(|table| diagram::read_basin(table, &model, &expansion.active));
    let basins = basins.collect::<Checked<_>>()?;
    let swept = diagrams.iter().map(|diagram| diagram.parameter);
    let swept = swept.chain(charts.iter().flat_map(|chart| chart.parameters));
    let varied: BTreeSet<usize> =
        grazing.solve_for.iter().chain(&expansion.active).copied().chain(swept).collect();
    period::check(&root.require("model")?.table()?, &model, &varied, grazing.guess.as_deref())?;
    Ok(Scene {
        file_name: file_name.to_owned(),
        identifier,
        text: text.into(),
        request_at: None,
        digest: Digest::of(text),
        model,
        grazing,
        section,
        section_rule,
        expansion,
        window,
        emit,
        direct,
        diagrams,
        charts,
        basins,
        warnings,
    })
}

/// Largest number of parts of a dotted key.
const MOST_PARTS: usize = 16;

/// Applies every override to the document.
///
/// A bare name is a parameter of the model; a dotted key is a place of the scene, with list entries
/// by number. A value that is not TOML is taken as text.
pub(super) fn apply(document: &mut DocumentMut, overrides: &[(String, String)]) -> Checked<()> {
    for (key, text) in overrides {
        let value = text.trim().parse::<Value>().unwrap_or_else(|_| Value::from(text.as_str()));
        let key = key.trim();
        let parts: Vec<&str> = if key.contains('.') {
            key.split('.').collect()
        } else {
            vec!["model", "parameters", key]
        };
        let fail = |part: &str, reason| {
            let (key, part) = (shown(key), shown(part));
            Fault::nowhere(SceneProblem::Override { key, part, reason, nearest: None })
        };
        if let Some(empty) = parts.iter().take(MOST_PARTS + 1).find(|part| part.is_empty()) {
            return Err(fail(empty, OverrideReason::Empty));
        }
        if parts.len() > MOST_PARTS {
            return Err(fail(parts[MOST_PARTS], OverrideReason::NotATable));
        }
        if !key.contains('.') && !parameters(document).any(|known| known == key) {
            return Err(unknown_parameter(document, key));
        }
        set(document.as_item_mut(), &parts, value).map_err(|(part, reason)| fail(part, reason))?;
    }
    give_way(document, overrides);
    freeze(document, overrides);
    Ok(())
}

/// Keys of `[expansion]` that exclude each other: a tolerance and orders.
const ORDER_WAYS: [[&[&str]; 2]; 2] = [
    [&["tolerance"], &["smooth_order", "contact_weight"]],
    [&["smooth_order", "contact_weight"], &["tolerance"]],
];

/// Keys of `[grazing]` that exclude each other: one surface and a list of passages.
const GRAZING_WAYS: [[&[&str]; 2]; 2] =
    [[&["surface"], &["passages"]], [&["passages"], &["surface"]]];

/// Keys of a `[[diagram]]` that exclude each other: listed values and a range, two kinds of starts,
/// and both names of the methods.
const SWEEP_WAYS: [[&[&str]; 2]; 6] = [
    [&["values"], &["range", "points", "scale"]],
    [&["range"], &["values"]],
    [&["start"], &["starts"]],
    [&["starts"], &["start"]],
    [&["method"], &["with"]],
    [&["with"], &["method"]],
];

/// Removes keys that an override excludes, unless they are overridden too.
fn give_way(document: &mut DocumentMut, overrides: &[(String, String)]) {
    let ways: [(&str, &[[&[&str]; 2]]); 2] =
        [("expansion", &ORDER_WAYS), ("grazing", &GRAZING_WAYS)];
    for (key, ways) in ways {
        if let Some(table) = document.get_mut(key).and_then(Item::as_table_like_mut) {
            give_way_in(table, key, ways, overrides);
        }
    }
    let Some(diagrams) = document.get_mut("diagram").and_then(Item::as_array_of_tables_mut) else {
        return;
    };
    for (number, table) in diagrams.iter_mut().enumerate() {
        give_way_in(table, &format!("diagram.{number}"), &SWEEP_WAYS, overrides);
    }
}

fn give_way_in(
    table: &mut dyn TableLike,
    path: &str,
    ways: &[[&[&str]; 2]],
    overrides: &[(String, String)],
) {
    let is_set = |names: &[&str]| {
        let keys: Vec<String> = names.iter().map(|name| format!("{path}.{name}")).collect();
        overrides.iter().any(|(set, _)| keys.iter().any(|key| set.trim() == key))
    };
    for [these, those] in ways {
        if is_set(these) && !is_set(those) {
            those.iter().for_each(|name| {
                table.remove(name);
            });
        }
    }
}

/// Removes from `[window]` and the weights the parameters that an override of `expansion.active`
/// leaves out, unless they are overridden too.
fn freeze(document: &mut DocumentMut, overrides: &[(String, String)]) {
    let is_set = |key: &str| overrides.iter().any(|(set, _)| set.trim() == key);
    let active = document.get("expansion").and_then(|expansion| expansion.get("active"));
    let Some(active) = active.filter(|_| is_set("expansion.active")) else {
        return;
    };
    let texts = active.as_array().into_iter().flat_map(|list| list.iter());
    let texts = texts.filter_map(Value::as_str).chain(active.as_str());
    let active: Vec<String> = texts.map(str::to_owned).collect();
    let frozen: Vec<String> = parameters(document)
        .filter(|parameter| !active.iter().any(|name| name == parameter))
        .map(str::to_owned)
        .collect();
    for [table, key] in [["window", "parameter"], ["expansion", "weights"]] {
        let inner = document.get_mut(table).and_then(|table| table.get_mut(key));
        let Some(inner) = inner.and_then(Item::as_table_like_mut) else {
            continue;
        };
        for name in frozen.iter().filter(|name| !is_set(&format!("{table}.{key}.{name}"))) {
            inner.remove(name);
        }
    }
}

/// Names of the document's parameters.
fn parameters(document: &DocumentMut) -> impl Iterator<Item = &str> {
    let model = document.get("model").and_then(Item::as_table_like);
    let parameters = model.and_then(|model| model.get("parameters"));
    let parameters = parameters.and_then(Item::as_table_like);
    parameters.into_iter().flat_map(|table| table.iter().map(|(name, _)| name))
}

fn unknown_parameter(document: &DocumentMut, key: &str) -> Fault {
    let shown = shown(key);
    Fault::nowhere(SceneProblem::Override {
        key: shown.clone(),
        part: shown,
        reason: OverrideReason::UnknownParameter,
        nearest: nearest(key, parameters(document)),
    })
}

/// Sets the value at the place `parts` under `item`; otherwise returns the part that failed and the
/// reason.
fn set<'k>(
    item: &mut Item,
    parts: &[&'k str],
    value: Value,
) -> Result<(), (&'k str, OverrideReason)> {
    let Some((&part, rest)) = parts.split_first() else {
        replace(item, value);
        return Ok(());
    };
    if item.is_array() || item.is_array_of_tables() {
        return set_in_list(item, part, rest, value);
    }
    let Some(table) = item.as_table_like_mut() else {
        return Err((part, OverrideReason::NotATable));
    };
    if !table.contains_key(part) {
        let fresh =
            if rest.is_empty() { Item::Value(value.clone()) } else { Item::Table(implicit()) };
        table.insert(part, fresh);
    }
    match table.get_mut(part) {
        Some(inner) => set(inner, rest, value),
        None => Err((part, OverrideReason::NotATable)),
    }
}

/// Sets a value under an entry of a list, as [`set`].
fn set_in_list<'k>(
    item: &mut Item,
    part: &'k str,
    rest: &[&'k str],
    value: Value,
) -> Result<(), (&'k str, OverrideReason)> {
    let index = part.parse::<usize>().map_err(|_| (part, OverrideReason::NotAnEntry))?;
    if let Some(tables) = item.as_array_of_tables_mut() {
        let table = tables.get_mut(index).ok_or((part, OverrideReason::NotAnEntry))?;
        let Some((&key, _)) = rest.split_first() else {
            return Err((part, OverrideReason::NotATable));
        };
        let mut entry = Item::Table(std::mem::take(table));
        let outcome = set(&mut entry, rest, value);
        *table = entry.into_table().map_err(|_| (key, OverrideReason::NotATable))?;
        return outcome;
    }
    let slot = item
        .as_array_mut()
        .and_then(|list| list.get_mut(index))
        .ok_or((part, OverrideReason::NotAnEntry))?;
    let mut entry = Item::Value(slot.clone());
    set(&mut entry, rest, value)?;
    *slot = entry.into_value().map_err(|_| (part, OverrideReason::NotATable))?;
    Ok(())
}

/// Replaces a value and keeps the space and comment around it.
fn replace(item: &mut Item, mut value: Value) {
    if let Some(old) = item.as_value() {
        *value.decor_mut() = old.decor().clone();
    }
    *item = Item::Value(value);
}

/// A table whose header is not written if it is empty.
fn implicit() -> toml_edit::Table {
    let mut table = toml_edit::Table::new();
    table.set_implicit(true);
    table
}

impl Scene {
    /// Refuses diagrams of a parameter that is not active.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::NotActive`] for the first such diagram.
    pub fn check_diagrams(&self) -> Result<(), SceneError> {
        self.check_swept("diagram", "parameter")
    }

    /// Refuses charts of parameters that are not active.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::NotActive`] for the first such chart.
    pub fn check_charts(&self) -> Result<(), SceneError> {
        self.check_swept("chart", "parameters")
    }

    /// Refuses inactive parameters under a key of a list of tables.
    fn check_swept(&self, list: &str, key: &str) -> Result<(), SceneError> {
        self.located(|root| {
            let tables = root.field(list).map_or(Ok(Vec::new()), |field| field.tables())?;
            for table in &tables {
                for entry in table.require(key)?.one_or_list("a parameter's name")? {
                    let name = entry.text("a parameter's name")?;
                    let mut active = self.expansion.active.iter();
                    if !active.any(|&parameter| self.model.parameters[parameter].name == name) {
                        let (key, name) = (entry.path.clone(), name.to_owned());
                        return Err(entry.fault(SceneProblem::NotActive { key, name }));
                    }
                }
            }
            Ok(())
        })
    }

    /// Refuses a model that does not repeat after the period of its phase while the parameters
    /// `varied` vary.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::PeriodOfParameter`] for the first expression that does not repeat.
    pub fn check_period(&self, varied: &[usize]) -> Result<(), SceneError> {
        let varied = varied.iter().copied().collect();
        self.located(|root| {
            let model = root.require("model")?.table()?;
            period::check(&model, &self.model, &varied, self.grazing.guess.as_deref())
        })
    }

    /// Refuses an impact at a grazing surface if the reset moves every sampled state that touches
    /// with zero normal velocity: then no orbit has a map near its graze.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::MovesTangentState`] at the `impact` of the first such surface.
    pub fn check_tangent_states(&self) -> Result<(), SceneError> {
        let mut surfaces = self.grazing.passages.iter();
        let moved = surfaces.find_map(|&surface| Some((surface, self.moved(surface)?)));
        let Some((number, (component, displacement))) = moved else {
            return Ok(());
        };
        let problem = SceneProblem::MovesTangentState {
            surface: self.model.surfaces[number].name.clone(),
            component: self.model.full_state_names()[component].to_owned(),
            displacement,
        };
        self.located(|root| {
            let model = root.require("model")?.table()?;
            let surfaces = model.require("surface")?.tables()?;
            let impact = surfaces.get(number).map(|surface| surface.require("impact"));
            Err(impact
                .transpose()?
                .map_or(Fault::nowhere(problem.clone()), |impact| impact.fault(problem)))
        })
    }

    /// Runs a check on the scene's text and adds the file to its fault.
    fn located(&self, check: impl FnOnce(&Table<'_>) -> Checked<()>) -> Result<(), SceneError> {
        let found = parsed(&self.text)
            .and_then(|document| check(&Table::root(&self.text, document.as_table())));
        found.map_err(|fault| in_request(fault, &self.file_name, &self.text, self.request_at))
    }

    /// The component that the reset at a surface moves farthest, and its displacement, at the first
    /// of several states that touch with zero normal velocity; `None` unless the reset moves all of
    /// them.
    fn moved(&self, surface: usize) -> Option<(usize, f64)> {
        let surface = &self.model.surfaces[surface];
        let Response::Impact { reset } = &surface.response else {
            return None;
        };
        let conditions = [surface.event, surface.normal_velocity];
        let starts = (0..SAMPLES).map(|sample| self.start(sample));
        let touching = starts.filter_map(|start| self.touching(start, conditions));
        let mut first = None;
        let mut count = 0;
        for state in touching {
            let image = self.values(&state, reset);
            let moves = image.iter().zip(&state).map(|(after, before)| after - before).enumerate();
            let farthest = moves.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            if farthest.1.abs() <= MOVED * size(&state) || !farthest.1.is_finite() {
                return None;
            }
            count += 1;
            first.get_or_insert(farthest);
        }
        first.filter(|_| count >= LEAST)
    }

    /// Start of the search for a touching state: the guess of the scene, or a state near it.
    fn start(&self, sample: usize) -> Vec<f64> {
        let dimension = self.model.dimension();
        let guess = self.grazing.guess.clone().unwrap_or_else(|| vec![0.0; dimension]);
        let wave = |component: usize| (1.3 * sample as f64 + 2.1 * component as f64).sin();
        let spread = |(component, value): (usize, f64)| match sample {
            0 => value,
            _ => value + wave(component) * 0.3 * value.abs().max(1.0),
        };
        guess.into_iter().enumerate().map(spread).collect()
    }

    /// A state near `state` at which both conditions vanish, by Newton's method with steps of least
    /// norm and difference quotients.
    fn touching(&self, mut state: Vec<f64>, conditions: [NodeId; 2]) -> Option<Vec<f64>> {
        for _ in 0..ITERATIONS {
            let found = self.values(&state, &conditions);
            let small = found.iter().all(|value| value.abs() <= TOUCHES * size(&state));
            if small {
                return Some(state);
            }
            let rows: Vec<Vec<f64>> = (0..state.len())
                .map(|component| {
                    let step = DIFFERENCE * state[component].abs().max(1.0);
                    let mut beside = state.clone();
                    beside[component] += step;
                    let ahead = self.values(&beside, &conditions);
                    ahead.iter().zip(&found).map(|(a, b)| (a - b) / step).collect()
                })
                .collect();
            let product =
                |a: usize, b: usize| -> f64 { rows.iter().map(|row| row[a] * row[b]).sum() };
            let (aa, ab, bb) = (product(0, 0), product(0, 1), product(1, 1));
            let determinant = aa * bb - ab * ab;
            let first = (bb * found[0] - ab * found[1]) / determinant;
            let second = (aa * found[1] - ab * found[0]) / determinant;
            for (value, row) in state.iter_mut().zip(&rows) {
                *value -= row[0] * first + row[1] * second;
            }
            if !state.iter().all(|value| value.is_finite()) {
                return None;
            }
        }
        None
    }

    /// Values of nodes at a state and the scene's parameters.
    fn values(&self, state: &[f64], nodes: &[NodeId]) -> Vec<f64> {
        let parameters = self.model.parameters.iter().map(|parameter| parameter.value);
        let parameters = parameters.map(Dd::to_f64);
        let inputs: Vec<f64> = state.iter().copied().chain(parameters).collect();
        let mut values = Vec::new();
        self.model.graph.evaluate(&inputs, &mut values);
        nodes.iter().map(|node| values[node.index()]).collect()
    }
}

/// Number of states tried.
const SAMPLES: usize = 8;
/// Least number of touching states that must be found.
const LEAST: usize = 3;
/// Displacement below which a state counts as not moved, relative to the size of the state.
const MOVED: f64 = 1e-6;
/// Tolerance of a condition, relative to the size of the state.
const TOUCHES: f64 = 1e-10;
/// Step of a difference, relative to the component.
const DIFFERENCE: f64 = 1e-7;
/// Largest number of Newton steps.
const ITERATIONS: usize = 40;

/// Size of a state: its largest component, at least 1.
fn size(state: &[f64]) -> f64 {
    state.iter().fold(1.0, |size, value| size.max(value.abs()))
}
