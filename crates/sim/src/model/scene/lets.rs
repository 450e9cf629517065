//! `model.let`: named expressions, in any order, none of which may need itself.

use super::document::Field;
use super::scope::Scope;
use crate::model::error::{Checked, Fault};
use crate::model::expression;
use crate::model::graph::ExpressionGraph;
use crate::model::problem::SceneProblem;

/// How far a named expression has been followed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mark {
    Untouched,
    Open,
    Done,
}

/// Reads the named expressions and defines their names.
pub(super) fn define(
    fields: &[Field<'_>],
    scope: &mut Scope,
    graph: &mut ExpressionGraph,
) -> Checked<()> {
    for index in in_order_of_need(fields)? {
        let field = &fields[index];
        let node = scope.expression(&field.entry("an expression")?, graph)?;
        scope.define(field.key, node);
    }
    Ok(())
}

/// The named expressions, those needed before those that need them.
fn in_order_of_need(fields: &[Field<'_>]) -> Checked<Vec<usize>> {
    let needs: Vec<Vec<usize>> = fields.iter().map(|field| needs(field, fields)).collect();
    let mut marks = vec![Mark::Untouched; fields.len()];
    let mut order = Vec::new();
    for start in 0..fields.len() {
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        while let Some(&(index, next)) = path.last() {
            if next == 0 && marks[index] == Mark::Done {
                path.pop();
                continue;
            }
            marks[index] = Mark::Open;
            let Some(&needed) = needs[index].get(next) else {
                marks[index] = Mark::Done;
                order.push(index);
                path.pop();
                continue;
            };
            if let Some(last) = path.last_mut() {
                last.1 += 1;
            }
            match marks[needed] {
                Mark::Open => return Err(circle(fields, &path, needed)),
                Mark::Untouched => path.push((needed, 0)),
                Mark::Done => {}
            }
        }
    }
    Ok(order)
}

/// The named expressions that the text of one names.
fn needs(field: &Field<'_>, fields: &[Field<'_>]) -> Vec<usize> {
    let text = field
        .entry("an expression")
        .ok()
        .and_then(|entry| entry.value.as_str());
    let names = expression::names_in(text.unwrap_or_default());
    names
        .iter()
        .filter_map(|name| fields.iter().position(|other| other.key == *name))
        .collect()
}

/// The fault of a circle that closes at `needed`.
fn circle(fields: &[Field<'_>], path: &[(usize, usize)], needed: usize) -> Fault {
    let circle = path
        .iter()
        .map(|&(index, _)| index)
        .skip_while(|&index| index != needed);
    let mut names: Vec<String> = circle.map(|index| fields[index].key.to_owned()).collect();
    names.push(fields[needed].key.to_owned());
    Fault::at(fields[needed].span(), SceneProblem::Circular { names })
}
