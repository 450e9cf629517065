//! What the names of a scene mean: states, phase, parameters and `let` expressions.

use super::document::{Entry, shown};
use std::ops::Range;

use crate::model::error::{Checked, Fault};
use crate::model::expression::{self, Resolved};
use crate::model::graph::{ExpressionGraph, NodeId};
use crate::model::names;
use crate::model::problem::SceneProblem;

/// What a name stands for.
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
            return Err(Fault::at(
                span,
                SceneProblem::NotAName { name: shown(name) },
            ));
        }
        if names::is_reserved(name) {
            let problem = SceneProblem::Reserved {
                name: name.to_owned(),
                kind: kind.word(),
            };
            return Err(Fault::at(span, problem));
        }
        if names::is_rust_word(name) {
            let problem = SceneProblem::RustWord {
                name: name.to_owned(),
                kind: kind.word(),
            };
            return Err(Fault::at(span, problem));
        }
        if let Some((_, first)) = self.entries.iter().find(|(known, _)| known == name) {
            if *first == kind {
                let problem = SceneProblem::SameName {
                    name: name.to_owned(),
                    kind: kind.word(),
                };
                return Err(Fault::at(span, problem));
            }
            let (first, second) = (first.word(), kind.word());
            let problem = SceneProblem::DuplicateName {
                name: name.to_owned(),
                first,
                second,
            };
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
            Fault::at(
                entry.inside(fault.span),
                SceneProblem::Expression(fault.value),
            )
        })
    }

    /// The full state and the parameters, by input number.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &str> {
        self.entries
            .iter()
            .filter(|(_, kind)| *kind != Kind::Let)
            .map(|(name, _)| name.as_str())
    }
}
