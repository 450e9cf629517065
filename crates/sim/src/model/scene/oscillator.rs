//! `[model]`: names, parameters, phase, named expressions, the free flow, and the stops with their
//! event functions and responses.

use std::ops::Range;

use super::document::{Field, NameKind, Scope, Table, define, shown};
use super::tables::key_position;
use crate::model::error::{Checked, Fault, SceneProblem};
use crate::model::graph::{ExpressionGraph, NodeId};
use crate::model::names;
use crate::model::oscillator::{Model, Parameter, Phase, Response, Surface};
use crate::numeric::Dd;

/// Keys of `[model]`.
const KEYS: [&str; 8] =
    ["name", "source", "states", "parameters", "let", "phase", "flow", "surface"];

/// Most states, parameters or named expressions of a model.
const MOST_NAMES: usize = 256;

/// A model that is being read.
struct Draft {
    scope: Scope,
    graph: ExpressionGraph,
    states: Vec<String>,
    parameters: Vec<Parameter>,
    phase: Option<String>,
}

/// Reads `[model]`; `default_name` is used if the model has no name.
pub(super) fn read(table: &Table<'_>, default_name: &str) -> Checked<(Model, Scope)> {
    table.only(&KEYS)?;
    let phase_table = table.field("phase").map(|field| field.table()).transpose()?;
    let mut draft = declare(table, phase_table.as_ref())?;
    let phase = match (phase_table, draft.phase.clone()) {
        (Some(phase), Some(name)) => Some(read_phase(&phase, name, &mut draft)?),
        _ => None,
    };
    let flow = read_flow(&table.require("flow")?.table()?, phase.as_ref(), &mut draft)?;
    let surfaces = read_surfaces(table, &flow, &mut draft)?;
    let text = |key: &str| table.field(key).map(|field| field.text()).transpose();
    let model = Model {
        name: text("name")?.unwrap_or_else(|| default_name.to_owned()),
        source: text("source")?,
        states: draft.states,
        phase,
        parameters: draft.parameters,
        graph: draft.graph,
        flow,
        surfaces,
    };
    Ok((model, draft.scope))
}

/// Declares every name and defines the inputs and named expressions.
fn declare(table: &Table<'_>, phase: Option<&Table<'_>>) -> Checked<Draft> {
    let mut scope = Scope::default();
    let states = declare_states(table, &mut scope)?;
    let phase = phase.map(|phase| declare_phase(phase, &mut scope)).transpose()?;
    let parameters = declare_parameters(table, &mut scope)?;
    let lets = named_fields(table, "let")?;
    for field in &lets {
        scope.declare(field.key, NameKind::Let, field.key_span.clone())?;
    }
    let mut graph = ExpressionGraph::new();
    let inputs: Vec<String> = scope.inputs().map(str::to_owned).collect();
    for (input, name) in inputs.iter().enumerate() {
        let node = graph.input(input);
        scope.define(name, node);
    }
    define(&lets, &mut scope, &mut graph)?;
    Ok(Draft { scope, graph, states, parameters, phase })
}

fn declare_states(table: &Table<'_>, scope: &mut Scope) -> Checked<Vec<String>> {
    let field = table.require("states")?;
    let entries = field.list("a list of names")?;
    field.check_length(entries.len(), MOST_NAMES)?;
    let mut states = Vec::new();
    for entry in entries {
        let name = entry.text("a list of names")?;
        scope.declare(name, NameKind::State, entry.span.clone())?;
        states.push(name.to_owned());
    }
    Ok(states)
}

fn declare_phase(table: &Table<'_>, scope: &mut Scope) -> Checked<String> {
    table.only(&["name", "rate", "period"])?;
    let entry = table.require("name")?.entry("a name")?;
    let name = entry.text("a name")?;
    scope.declare(name, NameKind::Phase, entry.span.clone())?;
    Ok(name.to_owned())
}

fn declare_parameters(table: &Table<'_>, scope: &mut Scope) -> Checked<Vec<Parameter>> {
    let mut parameters = Vec::new();
    for field in named_fields(table, "parameters")? {
        scope.declare(field.key, NameKind::Parameter, field.key_span.clone())?;
        parameters.push(Parameter { name: field.key.to_owned(), value: field.number()? });
    }
    Ok(parameters)
}

/// Fields of an optional table of the model.
fn named_fields<'a>(table: &Table<'a>, key: &str) -> Checked<Vec<Field<'a>>> {
    let Some(field) = table.field(key) else {
        return Ok(Vec::new());
    };
    let fields = field.table()?.fields();
    if !fields.is_empty() {
        field.check_length(fields.len(), MOST_NAMES)?;
    }
    Ok(fields)
}

/// Reads `[model.phase]`, whose name is already declared.
fn read_phase(table: &Table<'_>, name: String, draft: &mut Draft) -> Checked<Phase> {
    let entry = table.require("rate")?.entry("an expression")?;
    let rate = draft.scope.expression(&entry, &mut draft.graph)?;
    let dimension = draft.states.len() + 1;
    if let Some(&input) = draft.graph.dependencies(rate).iter().find(|&&input| input < dimension) {
        let name = draft.states.get(input).cloned().unwrap_or(name);
        return Err(entry.fault(SceneProblem::Dependence { key: entry.path.clone(), name }));
    }
    let period = table.require("period")?.positive().map_err(|fault| match *fault.problem {
        SceneProblem::NotConstant { name: ref used, .. }
            if draft.parameters.iter().any(|known| known.name == *used) =>
        {
            let problem =
                SceneProblem::PeriodOfParameters { name: used.clone(), phase: name.clone() };
            Fault { problem: Box::new(problem), span: fault.span }
        }
        _ => fault,
    })?;
    Ok(Phase { name, rate, period })
}

/// Reads `[model.flow]`; the phase's rate comes last.
fn read_flow(table: &Table<'_>, phase: Option<&Phase>, draft: &mut Draft) -> Checked<Vec<NodeId>> {
    let mut flow = Vec::new();
    for (component, state) in draft.components(table, None)?.into_iter().zip(&draft.states) {
        let missing = || table.fault(SceneProblem::MissingFlow { state: state.clone() });
        flow.push(component.ok_or_else(missing)?);
    }
    flow.extend(phase.map(|phase| phase.rate));
    Ok(flow)
}

/// Names that a contact law knows beside those of the scene.
#[derive(Clone, Copy)]
struct Pressed<'a> {
    /// Free flow, one node per component.
    flow: &'a [NodeId],
    /// Penetration, `−h`.
    penetration: NodeId,
}

impl Pressed<'_> {
    /// Names in the expression of a component, with their nodes.
    fn names(&self, component: usize) -> Vec<(&'static str, NodeId)> {
        let free = self.flow.get(component).map(|&node| (names::FREE, node));
        free.into_iter().chain([(names::PENETRATION, self.penetration)]).collect()
    }
}

impl Draft {
    /// Expressions of a table whose keys are states: one per state, `None` for a state without a
    /// key.
    ///
    /// `contact`, if given, holds what is known in a contact law.
    fn components(
        &mut self,
        table: &Table<'_>,
        contact: Option<Pressed<'_>>,
    ) -> Checked<Vec<Option<NodeId>>> {
        let mut nodes = vec![None; self.states.len()];
        for field in table.fields() {
            let state = self.state_of(&field, table)?;
            let local = contact.map_or_else(Vec::new, |contact| contact.names(state));
            let entry = field.entry("an expression")?;
            nodes[state] = Some(self.scope.expression_with(&entry, &mut self.graph, &local)?);
        }
        Ok(nodes)
    }

    /// Number of the state that a key names.
    fn state_of(&self, field: &Field<'_>, table: &Table<'_>) -> Checked<usize> {
        if self.phase.as_deref() == Some(field.key) {
            return Err(field.key_fault(SceneProblem::PhaseInLaw {
                name: field.key.to_owned(),
                table: table.title(),
            }));
        }
        let states: Vec<&str> = self.states.iter().map(String::as_str).collect();
        key_position("state", field, &states)
    }
}

/// Keys of a surface.
const SURFACE_KEYS: [&str; 5] = ["name", "event", "impact", "contact", "release"];

/// Most surfaces of a model.
const MOST_SURFACES: usize = 64;

/// Reads every surface of the model; `flow` is its free flow.
fn read_surfaces(model: &Table<'_>, flow: &[NodeId], draft: &mut Draft) -> Checked<Vec<Surface>> {
    let field = model.require("surface")?;
    let tables = field.tables()?;
    field.check_length(tables.len(), MOST_SURFACES)?;
    let mut surfaces: Vec<Surface> = Vec::new();
    for table in &tables {
        table.only(&SURFACE_KEYS)?;
        let name = name(table, &surfaces)?;
        surfaces.push(surface(table, name, flow, draft)?);
    }
    Ok(surfaces)
}

/// Name of a surface, different from all others.
fn name(table: &Table<'_>, others: &[Surface]) -> Checked<String> {
    let entry = table.require("name")?.entry("a name")?;
    let name = entry.text("a name")?;
    if !names::is_name(name) {
        return Err(entry.fault(SceneProblem::NotAName { name: shown(name) }));
    }
    if others.iter().any(|other| other.name == name) {
        let problem = SceneProblem::SameName { name: name.to_owned(), kind: "surface" };
        return Err(entry.fault(problem));
    }
    Ok(name.to_owned())
}

fn surface(
    table: &Table<'_>,
    name: String,
    flow: &[NodeId],
    draft: &mut Draft,
) -> Checked<Surface> {
    let entry = table.require("event")?.entry("an expression")?;
    let event = draft.scope.expression(&entry, &mut draft.graph)?;
    if draft.graph.dependencies(event).first().is_none_or(|&input| input >= draft.states.len()) {
        return Err(entry.fault(SceneProblem::ConstantEvent { surface: name }));
    }
    let normal_velocity = draft.graph.lie_derivative(event, flow);
    let normal_acceleration = draft.graph.lie_derivative(normal_velocity, flow);
    let response = match (table.field("impact"), table.field("contact")) {
        (Some(impact), None) => {
            if let Some(release) = table.field("release") {
                return Err(
                    release.key_fault(SceneProblem::ReleaseWithoutContact { surface: name })
                );
            }
            let reset = impact_law(&impact.table()?, draft)?;
            let span = impact.span();
            check_restitution(&name, normal_velocity, &reset, span, draft)?;
            Response::Impact { reset }
        }
        (None, Some(contact)) => contact_law(table, &contact.table()?, event, flow, draft)?,
        (Some(_), Some(contact)) => {
            return Err(contact.key_fault(SceneProblem::TwoResponses { surface: name }));
        }
        (None, None) => {
            return Err(table.fault(SceneProblem::Response { surface: name }));
        }
    };
    Ok(Surface { name, event, normal_velocity, normal_acceleration, response })
}

/// Expressions of a contact law; there must be at least one.
fn named_components(
    law: &str,
    table: &Table<'_>,
    contact: Option<Pressed<'_>>,
    draft: &mut Draft,
) -> Checked<Vec<Option<NodeId>>> {
    let named = draft.components(table, contact)?;
    if named.iter().all(Option::is_none) {
        let key = law.to_owned();
        return Err(table.fault(SceneProblem::Empty { key }));
    }
    Ok(named)
}

/// State after an impact; components without a key are unchanged.
fn impact_law(table: &Table<'_>, draft: &mut Draft) -> Checked<Vec<NodeId>> {
    let named = named_components("impact", table, None, draft)?;
    let dimension = draft.states.len() + usize::from(draft.phase.is_some());
    let reset = (0..dimension).map(|component| {
        let unchanged = draft.graph.input(component);
        named.get(component).copied().flatten().unwrap_or(unchanged)
    });
    Ok(reset.collect())
}

/// The field in contact and the release function; components without a key move freely.
fn contact_law(
    surface: &Table<'_>,
    contact: &Table<'_>,
    event: NodeId,
    flow: &[NodeId],
    draft: &mut Draft,
) -> Checked<Response> {
    let penetration = draft.graph.neg(event);
    let pressed = Pressed { flow, penetration };
    let named = named_components("contact", contact, Some(pressed), draft)?;
    let field = flow
        .iter()
        .enumerate()
        .map(|(component, &free)| named.get(component).copied().flatten().unwrap_or(free));
    let field = field.collect();
    let release = match surface.field("release") {
        Some(release) => {
            let known = [(names::PENETRATION, penetration)];
            let entry = release.entry("an expression")?;
            draft.scope.expression_with(&entry, &mut draft.graph, &known)?
        }
        None => event,
    };
    Ok(Response::Contact { field, release })
}

/// Refuses an impact whose coefficient of restitution is outside `[0, 1]`, if it is a single number
/// at the scene's parameters.
fn check_restitution(
    surface: &str,
    normal_velocity: NodeId,
    reset: &[NodeId],
    span: Range<usize>,
    draft: &Draft,
) -> Checked<()> {
    let tolerance = 1e-9;
    match restitution(normal_velocity, reset, draft) {
        Some(value) if !(-tolerance..=1.0 + tolerance).contains(&value) => Err(Fault::at(
            span,
            SceneProblem::Restitution { surface: surface.to_owned(), value: tidy(value) },
        )),
        _ => Ok(()),
    }
}

/// Rounds a number to 13 significant digits.
fn tidy(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

/// Coefficient of restitution `−h'(g(x)) / h'(x)`, if it is the same at several states.
fn restitution(normal_velocity: NodeId, reset: &[NodeId], draft: &Draft) -> Option<f64> {
    let parameters: Vec<f64> =
        draft.parameters.iter().map(|parameter| round(parameter.value)).collect();
    let mut values = Vec::new();
    let mut common: Option<f64> = None;
    for sample in 1..=5 {
        let wave = |component: usize| (1.3 * f64::from(sample) + 2.1 * component as f64).sin();
        let before: Vec<f64> =
            (0..reset.len()).map(wave).chain(parameters.iter().copied()).collect();
        draft.graph.evaluate(&before, &mut values);
        let speed_before = values[normal_velocity.index()];
        let image = reset.iter().map(|node| values[node.index()]);
        let after: Vec<f64> = image.chain(parameters.iter().copied()).collect();
        draft.graph.evaluate(&after, &mut values);
        let ratio = -values[normal_velocity.index()] / speed_before;
        let same = common.is_none_or(|known| (ratio - known).abs() <= 1e-9 * known.abs().max(1.0));
        if !ratio.is_finite() || !same {
            return None;
        }
        common = Some(ratio);
    }
    common
}

fn round(value: Dd) -> f64 {
    value.hi
}
