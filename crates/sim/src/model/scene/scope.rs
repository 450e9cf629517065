//! Names of a model and the expressions they stand for; `model.let`: named expressions, in any
//! order, none of which may need itself.

use std::ops::Range;

use super::document::{Entry, Field, shown};
use crate::model::error::{Checked, Fault, SceneProblem};
use crate::model::expression::Resolved;
use crate::model::graph::{ExpressionGraph, NodeId};
use crate::model::{expression, names};

/// Kind of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A state.
    State,
    /// The forcing phase.
    Phase,
    /// A parameter.
    Parameter,
    /// A named expression.
    Let,
}

impl Kind {
    /// The kind in words.
    pub(super) fn word(self) -> &'static str {
        match self {
            Kind::State => "state",
            Kind::Phase => "phase",
            Kind::Parameter => "parameter",
            Kind::Let => "named expression",
        }
    }
}

/// The names of a model, in the order they were declared.
#[derive(Default)]
pub(super) struct Scope {
    entries: Vec<(String, Kind)>,
    nodes: Vec<Option<NodeId>>,
}

impl Scope {
    /// Declares a name; it must have the form of one, be free, and not be a word of the language.
    pub(super) fn declare(&mut self, name: &str, kind: Kind, span: Range<usize>) -> Checked<()> {
        if !names::is_name(name) {
            return Err(Fault::at(span, SceneProblem::NotAName { name: shown(name) }));
        }
        if names::is_reserved(name) {
            let problem = SceneProblem::Reserved { name: name.to_owned(), kind: kind.word() };
            return Err(Fault::at(span, problem));
        }
        if names::is_rust_word(name) {
            let problem = SceneProblem::RustWord { name: name.to_owned(), kind: kind.word() };
            return Err(Fault::at(span, problem));
        }
        if let Some((_, first)) = self.entries.iter().find(|(known, _)| known == name) {
            if *first == kind {
                let problem = SceneProblem::SameName { name: name.to_owned(), kind: kind.word() };
                return Err(Fault::at(span, problem));
            }
            let (first, second) = (first.word(), kind.word());
            let problem = SceneProblem::DuplicateName { name: name.to_owned(), first, second };
            return Err(Fault::at(span, problem));
        }
        self.entries.push((name.to_owned(), kind));
        self.nodes.push(None);
        Ok(())
    }

    /// Gives a declared name its node.
    pub(super) fn define(&mut self, name: &str, node: NodeId) {
        if let Some(index) = self.entries.iter().position(|(known, _)| known == name) {
            self.nodes[index] = Some(node);
        }
    }

    /// The node of a name, or the nearest name.
    fn resolve(&self, name: &str) -> Resolved {
        let index = self.entries.iter().position(|(known, _)| known == name);
        match index.and_then(|index| self.nodes[index]) {
            Some(node) => Resolved::Node(node),
            None => {
                let known = self.entries.iter().map(|(known, _)| known.as_str());
                Resolved::Unknown(names::nearest(name, known.filter(|known| *known != name)))
            }
        }
    }

    /// Reads the expression of an entry: a text, or a number.
    pub(super) fn expression(
        &self,
        entry: &Entry<'_>,
        graph: &mut ExpressionGraph,
    ) -> Checked<NodeId> {
        self.expression_with_free(entry, graph, None)
    }

    /// Reads an expression in which `free`, where given, stands for a node.
    pub(super) fn expression_with_free(
        &self,
        entry: &Entry<'_>,
        graph: &mut ExpressionGraph,
        free: Option<NodeId>,
    ) -> Checked<NodeId> {
        let Some(text) = entry.value.as_str() else {
            if !entry.value.is_integer() && !entry.value.is_float() {
                return Err(entry.wrong_type("an expression"));
            }
            let value = entry.number()?;
            return Ok(graph.constant(value));
        };
        let resolve = |name: &str| match free {
            Some(node) if name == names::FREE => Resolved::Node(node),
            _ => self.resolve(name),
        };
        expression::parse(text, graph, &resolve).map_err(|fault| {
            Fault::at(entry.inside(fault.span), SceneProblem::Expression(fault.value))
        })
    }

    /// The full state and the parameters, by input number.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().filter(|(_, kind)| *kind != Kind::Let).map(|(name, _)| name.as_str())
    }
}

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
    let text = field.entry("an expression").ok().and_then(|entry| entry.value.as_str());
    let names = expression::names_in(text.unwrap_or_default());
    names.iter().filter_map(|name| fields.iter().position(|other| other.key == *name)).collect()
}

/// The fault of a circle that closes at `needed`.
fn circle(fields: &[Field<'_>], path: &[(usize, usize)], needed: usize) -> Fault {
    let circle = path.iter().map(|&(index, _)| index).skip_while(|&index| index != needed);
    let mut names: Vec<String> = circle.map(|index| fields[index].key.to_owned()).collect();
    names.push(fields[needed].key.to_owned());
    Fault::at(fields[needed].span(), SceneProblem::Circular { names })
}
