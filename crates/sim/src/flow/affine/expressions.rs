//! Expressions as rows over one basis: the states, the harmonics of the phase, and one.

use std::collections::BTreeSet;

use super::form::{Form, Former, Term};
use crate::flow::{InputKind, Program};
use crate::model::{ExpressionGraph, NodeId};
use crate::numeric::Scalar;

/// Expressions that are affine in the states and trigonometric in the phase, found from a graph.
///
/// Such an expression is a row over the *extended state*
///
/// ```text
/// y = (x_1 … x_n, cos k_1 θ, sin k_1 θ, …, 1)
/// ```
///
/// whose entries are functions of the parameters. All expressions share the harmonics `k`.
#[derive(Clone, Debug)]
pub struct AffineExpressions {
    states: usize,
    phase: Option<usize>,
    harmonics: usize,
    /// First the multiples `k` of the harmonics, then every entry of every row.
    program: Program,
    rows: Vec<Option<Vec<Entry>>>,
}

/// A column of a row and the program's output that stands there.
#[derive(Clone, Copy, Debug)]
struct Entry {
    column: usize,
    output: usize,
}

impl AffineExpressions {
    /// Takes expressions of a graph apart. Inputs `0..dimension` are the full state, the phase,
    /// where there is one, the last of them; `parameters` inputs follow.
    pub fn new(
        graph: &ExpressionGraph,
        nodes: &[NodeId],
        dimension: usize,
        phase: Option<usize>,
        parameters: usize,
    ) -> Self {
        let mut graph = graph.clone();
        let mut former = Former::new(&mut graph, dimension, phase);
        let forms = former.forms(nodes);
        let forms: Vec<Option<&Form>> = nodes
            .iter()
            .map(|node| forms[node.index()].as_ref())
            .map(|form| form.filter(|form| !form.contains_key(&Term::Phase)))
            .collect();
        let harmonics = multiples(&forms);
        let states = dimension - usize::from(phase.is_some());
        let column = |term: Term| column(term, states, &harmonics);
        let mut outputs: Vec<NodeId> = harmonics.clone();
        let mut row = |form: &Form| {
            let entry = |(&term, &node): (&Term, &NodeId)| {
                outputs.push(node);
                Entry { column: column(term), output: outputs.len() - 1 }
            };
            form.iter().map(entry).collect()
        };
        let rows = forms.iter().map(|form| form.map(&mut row)).collect();
        let inputs = vec![InputKind::Variable; dimension + parameters];
        Self {
            states,
            phase,
            harmonics: harmonics.len(),
            program: Program::new(&graph, &outputs, &inputs),
            rows,
        }
    }

    /// Whether an expression, by its number in the list given, is affine.
    pub fn is_affine(&self, expression: usize) -> bool {
        self.rows[expression].is_some()
    }

    /// States without the phase.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Position of the phase in the full state.
    pub fn phase(&self) -> Option<usize> {
        self.phase
    }

    /// Number of harmonics.
    pub fn harmonics(&self) -> usize {
        self.harmonics
    }

    /// Length of the extended state.
    pub fn columns(&self) -> usize {
        self.states + 2 * self.harmonics + 1
    }

    /// The rows at a parameter vector.
    pub fn at<S: Scalar>(&self, parameters: &[S]) -> AffineRows<S> {
        let mut tape = vec![S::zero(); self.program.slots()];
        let first = self.program.inputs() - parameters.len();
        tape[first..first + parameters.len()].copy_from_slice(parameters);
        self.program.evaluate_values(&mut tape);
        let value = |output: usize| tape[self.program.output(output)];
        let columns = self.columns();
        let mut rows = vec![S::zero(); self.rows.len() * columns];
        for (row, entries) in rows.chunks_exact_mut(columns).zip(&self.rows) {
            for entry in entries.iter().flatten() {
                row[entry.column] = value(entry.output);
            }
        }
        AffineRows { multiples: (0..self.harmonics).map(value).collect(), columns, rows }
    }
}

/// Values of [`AffineExpressions`] at a parameter vector.
#[derive(Clone, Debug)]
pub struct AffineRows<S> {
    /// The multiples `k` of the phase.
    pub multiples: Vec<S>,
    columns: usize,
    rows: Vec<S>,
}

impl<S> AffineRows<S> {
    /// The row of an expression, by its number in the list given; zeros where it is not affine.
    pub fn row(&self, expression: usize) -> &[S] {
        &self.rows[expression * self.columns..][..self.columns]
    }
}

fn multiples(forms: &[Option<&Form>]) -> Vec<NodeId> {
    let of_term = |term: &Term| match *term {
        Term::Cosine(multiple) | Term::Sine(multiple) => Some(multiple),
        _ => None,
    };
    let found: BTreeSet<NodeId> =
        forms.iter().flatten().flat_map(|form| form.keys().filter_map(of_term)).collect();
    found.into_iter().collect()
}

fn column(term: Term, states: usize, harmonics: &[NodeId]) -> usize {
    let place = |multiple: NodeId| {
        let found = harmonics.binary_search(&multiple);
        found.expect("the harmonics were collected from these terms")
    };
    match term {
        Term::State(state) => state,
        Term::Cosine(multiple) => states + 2 * place(multiple),
        Term::Sine(multiple) => states + 2 * place(multiple) + 1,
        Term::Phase | Term::One => states + 2 * harmonics.len(),
    }
}
