//! `[[model.surface]]`: the stops, their event functions and what happens at them.

use std::ops::Range;

use super::document::{Table, shown};
use super::oscillator::Draft;
use crate::model::error::{Checked, Fault};
use crate::model::graph::NodeId;
use crate::model::names;
use crate::model::oscillator::{Response, Surface};
use crate::model::problem::SceneProblem;
use crate::numeric::Dd;

/// Keys of a surface.
const KEYS: [&str; 5] = ["name", "event", "impact", "contact", "release"];

/// Most surfaces of a model.
const MOST: usize = 64;

/// Reads every surface of the model; `flow` is its free flow.
pub(super) fn read(model: &Table<'_>, flow: &[NodeId], draft: &mut Draft) -> Checked<Vec<Surface>> {
    let field = model.require("surface")?;
    let tables = field.tables()?;
    if tables.is_empty() {
        return Err(Fault::at(
            field.span(),
            SceneProblem::Empty {
                key: field.path.clone(),
            },
        ));
    }
    if tables.len() > MOST {
        let problem = SceneProblem::TooMany {
            key: field.path.clone(),
            most: MOST,
            found: tables.len(),
        };
        return Err(Fault::at(field.key_span.clone(), problem));
    }
    let mut surfaces: Vec<Surface> = Vec::new();
    for table in &tables {
        table.only(&KEYS)?;
        let name = name(table, &surfaces)?;
        surfaces.push(surface(table, name, flow, draft)?);
    }
    Ok(surfaces)
}

/// The name of a surface, which no other has.
fn name(table: &Table<'_>, others: &[Surface]) -> Checked<String> {
    let entry = table.require("name")?.entry("a name")?;
    let name = entry.text("a name")?;
    if !names::is_name(name) {
        return Err(entry.fault(SceneProblem::NotAName { name: shown(name) }));
    }
    if others.iter().any(|other| other.name == name) {
        let problem = SceneProblem::SameName {
            name: name.to_owned(),
            kind: "surface",
        };
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
    if draft
        .graph
        .dependencies(event)
        .first()
        .is_none_or(|&input| input >= draft.states.len())
    {
        return Err(entry.fault(SceneProblem::ConstantEvent { surface: name }));
    }
    let normal_velocity = draft.graph.lie_derivative(event, flow);
    let normal_acceleration = draft.graph.lie_derivative(normal_velocity, flow);
    let response = match (table.field("impact"), table.field("contact")) {
        (Some(impact), None) => {
            if let Some(release) = table.field("release") {
                return Err(Fault::at(
                    release.key_span,
                    SceneProblem::ReleaseWithoutContact { surface: name },
                ));
            }
            let reset = impact_law(&impact.table()?, draft)?;
            let span = impact.span();
            check_restitution(&name, normal_velocity, &reset, span, draft)?;
            Response::Impact { reset }
        }
        (None, Some(contact)) => contact_law(table, &contact.table()?, event, flow, draft)?,
        _ => {
            return Err(Fault::at(
                table.span(),
                SceneProblem::Response { surface: name },
            ));
        }
    };
    Ok(Surface {
        name,
        event,
        normal_velocity,
        normal_acceleration,
        response,
    })
}

/// The state after an impact; components without a key are unchanged.
fn impact_law(table: &Table<'_>, draft: &mut Draft) -> Checked<Vec<NodeId>> {
    let named = draft.components(table, None)?;
    if named.iter().all(Option::is_none) {
        return Err(Fault::at(
            table.span(),
            SceneProblem::Empty {
                key: "impact".to_owned(),
            },
        ));
    }
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
    let named = draft.components(contact, Some(flow))?;
    if named.iter().all(Option::is_none) {
        return Err(Fault::at(
            contact.span(),
            SceneProblem::Empty {
                key: "contact".to_owned(),
            },
        ));
    }
    let field = flow
        .iter()
        .enumerate()
        .map(|(component, &free)| named.get(component).copied().flatten().unwrap_or(free));
    let field = field.collect();
    let release = match surface.field("release") {
        Some(release) => draft
            .scope
            .expression(&release.entry("an expression")?, &mut draft.graph)?,
        None => event,
    };
    Ok(Response::Contact { field, release })
}

/// Refuses an impact whose restitution, where it is one number at the scene's parameters, is
/// outside [0, 1].
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
            SceneProblem::Restitution {
                surface: surface.to_owned(),
                value: tidy(value),
            },
        )),
        _ => Ok(()),
    }
}

/// A number without the last digits of its rounding.
fn tidy(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

/// `−h'(g(x)) / h'(x)`, if it is the same at several states.
fn restitution(normal_velocity: NodeId, reset: &[NodeId], draft: &Draft) -> Option<f64> {
    let parameters: Vec<f64> = draft
        .parameters
        .iter()
        .map(|parameter| round(parameter.value))
        .collect();
    let mut values = Vec::new();
    let mut common: Option<f64> = None;
    for sample in 1..=5 {
        let wave = |component: usize| (1.3 * f64::from(sample) + 2.1 * component as f64).sin();
        let before: Vec<f64> = (0..reset.len())
            .map(wave)
            .chain(parameters.iter().copied())
            .collect();
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
