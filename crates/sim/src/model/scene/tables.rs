//! The tables other than the model: `[grazing]`, `[section]`, `[expansion]`, `[window]`, `[direct]`
//! and `[emit]`; and lookups of the parameters and components that they name.

use std::collections::BTreeSet;

use super::document::{Entry, Field, Table, shown};
use super::{
    Direct, Emit, EmitPrecision, Expansion, Grazing, Hits, MapOrders, OrbitContact, Orders,
    Section, SectionRule, Shape, StroboscopicPhase, Symmetry, Window,
};
use crate::model::error::{Checked, SceneProblem};
use crate::model::names;
use crate::model::oscillator::{Model, Response};
use crate::numeric::FloatFormat;

/// Keys of `[grazing]`.
const GRAZING_KEYS: [&str; 7] =
    ["surface", "passages", "hits", "solve_for", "periods", "guess", "symmetry"];

/// Largest number of forcing periods of an orbit.
const MOST_PERIODS: u64 = 1000;

/// Largest number of grazing passages of an orbit.
const MOST_PASSAGES: usize = 64;

/// Reads `[grazing]`.
pub(super) fn read_grazing(table: &Table<'_>, model: &Model) -> Checked<Grazing> {
    table.only(&GRAZING_KEYS)?;
    let (passages, hits) = contacts(table, model)?;
    let solve_for = solve_for(table, model, passages.len())?;
    let periods = table.field("periods").map_or(Ok(1), |field| field.count(1, MOST_PERIODS))?;
    let guess = table.field("guess").map(|field| guess(&field.table()?, model)).transpose()?;
    let symmetry = symmetry(table, model, &hits)?;
    Ok(Grazing { passages, hits, solve_for, periods: periods as usize, guess, symmetry })
}

/// Surfaces that are grazed, in order, and those that are hit between the grazes.
fn contacts(table: &Table<'_>, model: &Model) -> Checked<(Vec<usize>, Hits)> {
    let mut order = passages(table, model)?;
    let is_graze = |contact: &OrbitContact| matches!(contact, OrbitContact::Graze(_));
    let Some(first) = order.iter().position(is_graze) else {
        let named = table.require("passages")?;
        return Err(named.fault(SceneProblem::NoGrazeAmongHits));
    };
    order.rotate_left(first);
    let grazes: Vec<usize> =
        order.iter().filter(|&at| is_graze(at)).map(|at| at.surface()).collect();
    let hit = |contact: &&OrbitContact| !is_graze(contact);
    let mut surfaces: Vec<usize> = order.iter().filter(hit).map(|at| at.surface()).collect();
    let exact = !surfaces.is_empty();
    if let Some(field) = table.field("hits") {
        if exact {
            let first = "passages = [{ hit = ... }]";
            let problem = SceneProblem::Exclusive { first, second: "hits" };
            return Err(field.key_fault(problem));
        }
        let entries = field.one_or_list("a surface's name")?;
        field.check_length(entries.len(), MOST_PASSAGES)?;
        surfaces = entries.iter().map(|entry| surface(entry, model)).collect::<Checked<_>>()?;
    }
    surfaces.sort_unstable();
    surfaces.dedup();
    Ok((grazes, Hits { surfaces, order: exact.then_some(order) }))
}

/// Contacts from `surface` or `passages`; both may be absent if the model has one surface only.
fn passages(table: &Table<'_>, model: &Model) -> Checked<Vec<OrbitContact>> {
    let entries = match (table.field("surface"), table.field("passages")) {
        (Some(_), Some(passages)) => {
            let problem = SceneProblem::Exclusive { first: "surface", second: "passages" };
            return Err(passages.key_fault(problem));
        }
        (Some(surface), None) => vec![surface.entry("a surface's name")?],
        (None, Some(passages)) => {
            let list = passages.list("a list of surfaces, hits as `{ hit = \"name\" }`")?;
            passages.check_length(list.len(), MOST_PASSAGES)?;
            list
        }
        (None, None) if model.surfaces.len() == 1 => return Ok(vec![OrbitContact::Graze(0)]),
        (None, None) => {
            let names = model.surfaces.iter().map(|surface| format!("`{}`", surface.name));
            let surfaces = names.collect::<Vec<_>>().join(", ");
            return Err(table.fault(SceneProblem::NoGrazedSurface { surfaces }));
        }
    };
    entries.iter().map(|entry| contact(entry, model)).collect()
}

/// A graze, written as a surface's name, or a hit, written as `{ hit = "name" }`.
fn contact(entry: &Entry<'_>, model: &Model) -> Checked<OrbitContact> {
    let Some(table) = entry.table() else {
        return Ok(OrbitContact::Graze(surface(entry, model)?));
    };
    table.only(&["hit"])?;
    let hit = table.require("hit")?.entry("a surface's name")?;
    Ok(OrbitContact::Hit(surface(&hit, model)?))
}

/// Number of the surface that an entry names.
fn surface(entry: &Entry<'_>, model: &Model) -> Checked<usize> {
    let name = entry.text("a surface's name")?;
    let known = model.surfaces.iter().map(|surface| surface.name.as_str());
    let known: Vec<&str> = known.collect();
    position("surface", name, &known).map_err(|problem| entry.fault(problem))
}

fn solve_for(table: &Table<'_>, model: &Model, passages: usize) -> Checked<Vec<usize>> {
    let field = table.require("solve_for")?;
    let entries = field.one_or_list("a parameter's name")?;
    field.check_length(entries.len(), usize::MAX)?;
    let parameters = distinct(&entries, |entry| parameter(entry, model))?;
    if parameters.len() > passages {
        let problem = SceneProblem::TooManyUnknowns { parameters: parameters.len(), passages };
        return Err(field.fault(problem));
    }
    Ok(parameters)
}

/// Value for every component of the full state.
fn guess(table: &Table<'_>, model: &Model) -> Checked<Vec<f64>> {
    let names = model.full_state_names();
    let mut guess = vec![None; names.len()];
    for field in table.fields() {
        guess[key_position("state", &field, &names)?] = Some(field.double()?);
    }
    let values = guess.into_iter().zip(&names).map(|(value, name)| {
        let missing = || SceneProblem::IncompleteGuess { component: (*name).to_owned() };
        value.ok_or_else(|| table.fault(missing()))
    });
    values.collect()
}

fn symmetry(table: &Table<'_>, model: &Model, hits: &Hits) -> Checked<Symmetry> {
    let Some(field) = table.field("symmetry") else {
        return Ok(Symmetry::None);
    };
    let options = [("none", Symmetry::None), ("half-period", Symmetry::HalfPeriod)];
    let symmetry = field.choice(&options, "\"none\", \"half-period\"")?;
    if symmetry == Symmetry::HalfPeriod && model.phase.is_none() {
        return Err(field.fault(SceneProblem::NeedsPhase { what: "a half-period symmetry" }));
    }
    if symmetry == Symmetry::HalfPeriod && !hits.surfaces.is_empty() {
        return Err(field.fault(SceneProblem::SymmetryWithHits));
    }
    Ok(symmetry)
}

/// Kinds of sections.
#[derive(Clone, Copy)]
enum Kind {
    Tangency,
    Stroboscopic,
    Any,
}

/// Reads `[section]`; the default is the tangency section.
pub(super) fn read_section(
    table: Option<&Table<'_>>,
    model: &Model,
    orders: Orders,
) -> Checked<(Section, SectionRule)> {
    let Some(table) = table else {
        return Ok((Section::Tangency, SectionRule::Named));
    };
    table.only(&["kind", "phase"])?;
    let options =
        [("tangency", Kind::Tangency), ("stroboscopic", Kind::Stroboscopic), ("any", Kind::Any)];
    let kind = table.require("kind")?;
    let fault = |problem| Err(kind.fault(problem));
    match kind.choice(&options, "\"tangency\", \"stroboscopic\", \"any\"")? {
        Kind::Tangency => Ok((Section::Tangency, SectionRule::Named)),
        Kind::Any => match orders {
            Orders::Tolerance(_) => Ok((Section::Tangency, SectionRule::Any)),
            Orders::Fixed(_) => fault(SceneProblem::AnySectionWithoutTolerance),
        },
        Kind::Stroboscopic if model.phase.is_none() => {
            fault(SceneProblem::NeedsPhase { what: "a stroboscopic section" })
        }
        Kind::Stroboscopic => Ok((Section::Stroboscopic(phase(table)?), SectionRule::Named)),
    }
}

/// Phase of a stroboscopic section; the default is the phase of the graze.
fn phase(table: &Table<'_>) -> Checked<StroboscopicPhase> {
    let Some(field) = table.field("phase") else {
        return Ok(StroboscopicPhase::Grazing);
    };
    let entry = field.entry("\"grazing\" or an expression of numbers")?;
    if entry.value.as_str() == Some("grazing") {
        return Ok(StroboscopicPhase::Grazing);
    }
    Ok(StroboscopicPhase::At(entry.number()?))
}

/// Keys of `[expansion]`.
const EXPANSION_KEYS: [&str; 5] =
    ["active", "smooth_order", "contact_weight", "weights", "tolerance"];

/// Highest order or weight.
const HIGHEST: u64 = 64;

/// Default orders.
const DEFAULT_ORDERS: MapOrders = MapOrders::new(5, 6);

/// Reads `[expansion]`; by default the parameters solved for are active and the orders are 5 and 6.
pub(super) fn read_expansion(
    table: Option<&Table<'_>>,
    model: &Model,
    grazing: &Grazing,
) -> Checked<Expansion> {
    let Some(table) = table else {
        return Ok(Expansion {
            active: grazing.solve_for.clone(),
            orders: Orders::Fixed(DEFAULT_ORDERS),
            weights: Vec::new(),
        });
    };
    table.only(&EXPANSION_KEYS)?;
    let active = match table.field("active") {
        Some(field) => {
            distinct(&field.one_or_list("a parameter's name")?, |entry| parameter(entry, model))?
        }
        None => grazing.solve_for.clone(),
    };
    let orders = orders(table)?;
    let weights =
        table.field("weights").map(|field| weights(&field.table()?, model, &active)).transpose()?;
    Ok(Expansion { active, orders, weights: weights.unwrap_or_default() })
}

fn orders(table: &Table<'_>) -> Checked<Orders> {
    if let Some(tolerance) = table.field("tolerance") {
        for first in ["smooth_order", "contact_weight"] {
            if table.field(first).is_some() {
                let second = "tolerance";
                let problem = SceneProblem::Exclusive { first, second };
                return Err(tolerance.key_fault(problem));
            }
        }
        return Ok(Orders::Tolerance(tolerance.positive()?.hi));
    }
    let order = |key: &str, default: u32| -> Checked<u32> {
        let given = table.field(key).map(|field| field.count(1, HIGHEST));
        Ok(given.transpose()?.map_or(default, |order| order as u32))
    };
    Ok(Orders::Fixed(MapOrders::new(
        order("smooth_order", DEFAULT_ORDERS.smooth_order)?,
        order("contact_weight", DEFAULT_ORDERS.contact_weight)?,
    )))
}

/// Weights, by the name of a component of the full state or of an active parameter.
fn weights(table: &Table<'_>, model: &Model, active: &[usize]) -> Checked<Vec<(String, u32)>> {
    let known = [model.full_state_names(), model.parameter_names()].concat();
    let weight = |field: &Field<'_>| {
        let place = key_position("state or parameter", field, &known)?;
        if let Some(parameter) = place.checked_sub(model.dimension()) {
            refuse_frozen(field, parameter, active)?;
        }
        Ok((field.key.to_owned(), field.count(1, HIGHEST)? as u32))
    };
    table.fields().iter().map(weight).collect()
}

/// Reads `[window]`; bounds that are not named are open.
pub(super) fn read_window(
    table: Option<&Table<'_>>,
    model: &Model,
    active: &[usize],
) -> Checked<Window> {
    let mut window = Window {
        depth: f64::INFINITY,
        state: vec![f64::INFINITY; model.dimension()],
        parameter: vec![f64::INFINITY; model.parameters.len()],
    };
    let Some(table) = table else {
        return Ok(window);
    };
    table.only(&["depth", "state", "parameter"])?;
    if let Some(depth) = table.field("depth") {
        window.depth = depth.positive()?.hi;
    }
    let widths = [
        ("state", model.full_state_names(), &mut window.state),
        ("parameter", model.parameter_names(), &mut window.parameter),
    ];
    for (kind, known, widths) in widths {
        let Some(field) = table.field(kind) else {
            continue;
        };
        for field in field.table()?.fields() {
            let place = key_position(kind, &field, &known)?;
            if kind == "parameter" {
                refuse_frozen(&field, place, active)?;
            }
            widths[place] = field.positive()?.hi;
        }
    }
    Ok(window)
}

/// Refuses a key that names an inactive parameter.
pub(super) fn refuse_frozen(field: &Field<'_>, parameter: usize, active: &[usize]) -> Checked<()> {
    if active.contains(&parameter) {
        return Ok(());
    }
    let (key, name) = (field.path.clone(), field.key.to_owned());
    Err(field.key_fault(SceneProblem::NotActive { key, name }))
}

/// Reads `[direct]`.
pub(super) fn read_direct(table: Option<&Table<'_>>) -> Checked<Direct> {
    let mut direct = Direct { escape: 100.0 };
    let Some(table) = table else { return Ok(direct) };
    table.only(&["escape"])?;
    if let Some(escape) = table.field("escape") {
        direct.escape = escape.positive()?.hi;
    }
    Ok(direct)
}

/// Keys of `[emit]`.
const EMIT_KEYS: [&str; 4] = ["shape", "precision", "lanes", "tolerance"];

/// Largest number of points per call of the lane kernel.
const MOST_LANES: u64 = 64;

/// Reads `[emit]`; by default the shape is chosen later and the precision is double.
pub(super) fn read_emit(table: Option<&Table<'_>>, orders: Orders) -> Checked<Emit> {
    let mut emit = Emit {
        shape: Shape::Auto,
        precision: EmitPrecision::Given(FloatFormat::F64),
        lanes: None,
        tolerance: None,
    };
    let Some(table) = table else { return Ok(emit) };
    table.only(&EMIT_KEYS)?;
    if let Some(shape) = table.field("shape") {
        let options = [
            ("auto", Shape::Auto),
            ("factored", Shape::Factored),
            ("composed", Shape::Composed),
            ("flown", Shape::Flown),
        ];
        emit.shape = shape.choice(&options, "\"factored\", \"composed\", \"flown\", \"auto\"")?;
    }
    if let Some(precision) = table.field("precision") {
        let options = [
            ("f64", EmitPrecision::Given(FloatFormat::F64)),
            ("f32", EmitPrecision::Given(FloatFormat::F32)),
            ("any", EmitPrecision::Any),
        ];
        emit.precision = precision.choice(&options, "\"f64\", \"f32\", \"any\"")?;
        if emit.precision == EmitPrecision::Any && !matches!(orders, Orders::Tolerance(_)) {
            return Err(precision.fault(SceneProblem::NeedsTolerance));
        }
    }
    if let Some(lanes) = table.field("lanes") {
        emit.lanes = Some(lanes.count(1, MOST_LANES)? as usize);
    }
    if let Some(tolerance) = table.field("tolerance") {
        if matches!(orders, Orders::Tolerance(_)) {
            let problem =
                SceneProblem::Exclusive { first: "emit.tolerance", second: "expansion.tolerance" };
            return Err(tolerance.key_fault(problem));
        }
        emit.tolerance = Some(tolerance.positive()?.hi);
    }
    Ok(emit)
}

/// Refuses a parameter to be solved for on which nothing depends; returns a warning for every other
/// such parameter.
pub(super) fn idle_parameters(
    table: &Table<'_>,
    model: &Model,
    grazing: &Grazing,
) -> Checked<Vec<String>> {
    let used = used_inputs(model);
    let idle = |parameter: usize| !used.contains(&model.parameter_input(parameter));
    if let Some(&parameter) = grazing.solve_for.iter().find(|&&parameter| idle(parameter)) {
        let name = model.parameters[parameter].name.clone();
        return Err(table.require("solve_for")?.fault(SceneProblem::IdleUnknown { name }));
    }
    let names = model.parameters.iter().enumerate().filter(|(parameter, _)| idle(*parameter));
    Ok(names
        .map(|(_, parameter)| format!("nothing depends on parameter `{}`", parameter.name))
        .collect())
}

/// Every input that the flow or a surface depends on.
fn used_inputs(model: &Model) -> BTreeSet<usize> {
    let mut nodes = model.flow.clone();
    for surface in &model.surfaces {
        nodes.push(surface.event);
        match &surface.response {
            Response::Impact { reset } => nodes.extend(reset),
            Response::Contact { field, release } => {
                nodes.extend(field);
                nodes.push(*release);
            }
        }
    }
    nodes.into_iter().flat_map(|node| model.graph.dependencies(node)).collect()
}

/// Number of the parameter that an entry names.
pub(super) fn parameter(entry: &Entry<'_>, model: &Model) -> Checked<usize> {
    let name = entry.text("a parameter's name")?;
    position("parameter", name, &model.parameter_names()).map_err(|problem| entry.fault(problem))
}

/// Index of a key among the names of a kind.
pub(super) fn key_position(
    kind: &'static str,
    field: &Field<'_>,
    known: &[&str],
) -> Checked<usize> {
    position(kind, field.key, known).map_err(|problem| field.key_fault(problem))
}

/// Index of a name among the known names of a kind.
pub(super) fn position(
    kind: &'static str,
    name: &str,
    known: &[&str],
) -> Result<usize, SceneProblem> {
    let found = known.iter().position(|known| *known == name);
    found.ok_or_else(|| SceneProblem::UnknownName {
        name: shown(name),
        kind,
        nearest: names::nearest(name, known.iter().copied()),
    })
}

/// Values of a list; an error if one is repeated.
pub(super) fn distinct<T: PartialEq>(
    entries: &[Entry<'_>],
    read: impl Fn(&Entry<'_>) -> Checked<T>,
) -> Checked<Vec<T>> {
    let mut values = Vec::new();
    for entry in entries {
        let value = read(entry)?;
        if values.contains(&value) {
            let name = shown(entry.value.as_str().unwrap_or_default());
            return Err(entry.fault(SceneProblem::Repeated { name, key: entry.path.clone() }));
        }
        values.push(value);
    }
    Ok(values)
}
