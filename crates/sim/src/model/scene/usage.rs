//! Which parameters a model uses at all.

use std::collections::BTreeSet;

use super::Grazing;
use super::document::Table;
use crate::model::error::{Checked, Fault};
use crate::model::oscillator::{Model, Response};
use crate::model::problem::SceneProblem;

/// Refuses a parameter to be solved for that nothing depends on; a warning for every other idle
/// parameter.
pub(super) fn check(table: &Table<'_>, model: &Model, grazing: &Grazing) -> Checked<Vec<String>> {
    let used = used_inputs(model);
    let idle = |parameter: usize| !used.contains(&model.parameter_input(parameter));
    if let Some(&parameter) = grazing.solve_for.iter().find(|&&parameter| idle(parameter)) {
        let name = model.parameters[parameter].name.clone();
        return Err(Fault::at(
            table.require("solve_for")?.span(),
            SceneProblem::IdleUnknown { name },
        ));
    }
    let names = model
        .parameters
        .iter()
        .enumerate()
        .filter(|(parameter, _)| idle(*parameter));
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
    nodes
        .into_iter()
        .flat_map(|node| model.graph.dependencies(node))
        .collect()
}
