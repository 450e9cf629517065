//! Decomposition of expressions into affine forms: linear in the states, trigonometric in the
//! phase.
//!
//! One idea: the terms of such an expression are carried symbolically through sums, products with
//! constants and products of trigonometric terms. Coefficients remain expressions of the
//! parameters.

use std::collections::{BTreeMap, BTreeSet};

use crate::flow::{InputKind, Program};
use crate::model::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::{Dd, Scalar};

/// Factor of a coefficient in a form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Term {
    /// A state, not the phase.
    State(usize),
    /// The phase itself: only inside a sine or cosine.
    Phase,
    /// `cos(k θ)`, with `k` an expression of the parameters.
    Cosine(NodeId),
    /// `sin(k θ)`, with `k` an expression of the parameters.
    Sine(NodeId),
    /// The constant 1.
    One,
}

/// `Σ coefficient · term`, without zero terms; coefficients are expressions of the parameters.
type Form = BTreeMap<Term, NodeId>;

/// Largest power of a trigonometric expression that is expanded.
const LARGEST_POWER: i32 = 16;

/// Largest number of terms of a product that is expanded.
///
/// NOTE: products of products with other multiples of the phase have as many harmonics as the
/// product of their degrees. An exact step is as short as the fastest of them asks, and its table
/// as wide as there are terms.
const MOST_TERMS: usize = 96;

/// Decomposes expressions of a graph; new coefficients are added to the graph.
struct Former<'g> {
    graph: &'g mut ExpressionGraph,
    dimension: usize,
    phase: Option<usize>,
}

impl<'g> Former<'g> {
    /// Inputs `0..dimension` of the graph are the full state; `phase` is the number of the phase.
    fn new(graph: &'g mut ExpressionGraph, dimension: usize, phase: Option<usize>) -> Self {
        Self { graph, dimension, phase }
    }

    /// Form of each node up to the last of `nodes`; `None` if the node is not affine or not needed.
    fn forms(&mut self, nodes: &[NodeId]) -> Vec<Option<Form>> {
        let needed = self.graph.needed_by(nodes);
        let mut forms: Vec<Option<Form>> = Vec::with_capacity(needed.len());
        for (index, needed) in needed.into_iter().enumerate() {
            let form = if needed { self.form(index, &forms) } else { None };
            forms.push(form);
        }
        forms
    }

    fn form(&mut self, index: usize, forms: &[Option<Form>]) -> Option<Form> {
        let node = self.graph.nodes()[index];
        let id = NodeId(u32::try_from(index).ok()?);
        let operands: Option<Vec<&Form>> =
            node.operands().map(|operand| forms[operand.index()].as_ref()).collect();
        let operands = operands?;
        let one = self.graph.number(1.0);
        match node {
            Node::Input(input) if Some(input) == self.phase => {
                return Some(Form::from([(Term::Phase, one)]));
            }
            Node::Input(input) if input < self.dimension => {
                return Some(Form::from([(Term::State(input), one)]));
            }
            _ if operands.iter().all(|form| is_constant(form)) => {
                return Some(self.single(Term::One, id));
            }
            _ => {}
        }
        match (node, &operands[..]) {
            (Node::Neg(_), [a]) => {
                let minus = self.graph.number(-1.0);
                Some(self.scaled(a, minus))
            }
            (Node::Binary(Binary::Add, _, _), [a, b]) => Some(self.sum(a, b)),
            (Node::Binary(Binary::Sub, _, _), [a, b]) => {
                let minus = self.graph.number(-1.0);
                let b = self.scaled(b, minus);
                Some(self.sum(a, &b))
            }
            (Node::Binary(Binary::Mul, _, _), [a, b]) => self.product(a, b),
            (Node::Binary(Binary::Div, _, b), [a, divisor]) if is_constant(divisor) => {
                let quotients = a.iter().map(|(&term, &value)| (term, self.graph.div(value, b)));
                Some(quotients.collect())
            }
            (Node::PowerInteger(_, exponent @ 2..=LARGEST_POWER), [a]) => {
                let mut power = (*a).clone();
                for _ in 1..exponent {
                    power = self.product(&power, a)?;
                }
                Some(power)
            }
            (Node::Unary(Unary::Cos, _), [a]) => self.circular(a, Circular::Cosine),
            (Node::Unary(Unary::Sin, _), [a]) => self.circular(a, Circular::Sine),
            _ => None,
        }
    }

    fn single(&mut self, term: Term, coefficient: NodeId) -> Form {
        let mut form = Form::new();
        self.add_term(&mut form, term, coefficient);
        form
    }

    fn add_term(&mut self, form: &mut Form, term: Term, coefficient: NodeId) {
        let sum = match form.get(&term) {
            Some(&before) => self.graph.add(before, coefficient),
            None => coefficient,
        };
        if self.graph.constant_value(sum) == Some(Dd::ZERO) {
            form.remove(&term);
        } else {
            form.insert(term, sum);
        }
    }

    fn scaled(&mut self, form: &Form, factor: NodeId) -> Form {
        let mut scaled = Form::new();
        for (&term, &coefficient) in form {
            let product = self.graph.mul(coefficient, factor);
            self.add_term(&mut scaled, term, product);
        }
        scaled
    }

    fn sum(&mut self, a: &Form, b: &Form) -> Form {
        let mut sum = a.clone();
        for (&term, &coefficient) in b {
            self.add_term(&mut sum, term, coefficient);
        }
        sum
    }

    /// Product of two forms, if one is constant or both are trigonometric and the product has at
    /// most [`MOST_TERMS`].
    fn product(&mut self, a: &Form, b: &Form) -> Option<Form> {
        for (constant, other) in [(a, b), (b, a)] {
            if is_constant(constant) {
                let Some(&factor) = constant.get(&Term::One) else {
                    return Some(Form::new());
                };
                return Some(self.scaled(other, factor));
            }
        }
        let mut product = Form::new();
        for (&left, &a) in a {
            for (&right, &b) in b {
                let coefficient = self.graph.mul(a, b);
                self.add_product(&mut product, left, right, coefficient)?;
            }
            if product.len() > MOST_TERMS {
                return None;
            }
        }
        Some(product)
    }

    /// Adds `coefficient · left · right`, by `2 cos a cos b = cos(a − b) + cos(a + b)` and similar
    /// formulas.
    fn add_product(
        &mut self,
        form: &mut Form,
        left: Term,
        right: Term,
        coefficient: NodeId,
    ) -> Option<()> {
        let half = self.graph.number(0.5);
        let half = self.graph.mul(half, coefficient);
        let minus = self.graph.neg(half);
        let (a, b, function, signs) = match (left, right) {
            (Term::One, term) | (term, Term::One) if is_trigonometric(term) => {
                self.add_term(form, term, coefficient);
                return Some(());
            }
            (Term::Cosine(a), Term::Cosine(b)) => (a, b, Circular::Cosine, [half, half]),
            (Term::Sine(a), Term::Sine(b)) => (a, b, Circular::Cosine, [half, minus]),
            (Term::Sine(a), Term::Cosine(b)) | (Term::Cosine(b), Term::Sine(a)) => {
                (a, b, Circular::Sine, [half, half])
            }
            _ => return None,
        };
        let multiples = [self.graph.sub(a, b), self.graph.add(a, b)];
        for (multiple, factor) in multiples.into_iter().zip(signs) {
            let harmonic = self.harmonic(multiple, function);
            for (term, value) in self.scaled(&harmonic, factor) {
                self.add_term(form, term, value);
            }
        }
        Some(())
    }

    /// `cos` or `sin` of `k θ + φ`.
    fn circular(&mut self, argument: &Form, function: Circular) -> Option<Form> {
        let only_phase = |term: &Term| matches!(term, Term::Phase | Term::One);
        if !argument.keys().all(only_phase) {
            return None;
        }
        let multiple = *argument.get(&Term::Phase)?;
        let Some(&shift) = argument.get(&Term::One) else {
            return Some(self.harmonic(multiple, function));
        };
        // cos(a + φ) = cos φ cos a − sin φ sin a,  sin(a + φ) = cos φ sin a + sin φ cos a
        let cosine = self.graph.unary(Unary::Cos, shift);
        let sine = self.graph.unary(Unary::Sin, shift);
        let (other, sine) = match function {
            Circular::Cosine => (Circular::Sine, self.graph.neg(sine)),
            Circular::Sine => (Circular::Cosine, sine),
        };
        let (same, other) = (self.harmonic(multiple, function), self.harmonic(multiple, other));
        let (same, other) = (self.scaled(&same, cosine), self.scaled(&other, sine));
        Some(self.sum(&same, &other))
    }

    /// `cos(k θ)` or `sin(k θ)`; a constant `k` is made positive.
    fn harmonic(&mut self, multiple: NodeId, function: Circular) -> Form {
        let one = self.graph.number(1.0);
        let value = self.graph.constant_value(multiple);
        if value == Some(Dd::ZERO) {
            return match function {
                Circular::Cosine => self.single(Term::One, one),
                Circular::Sine => Form::new(),
            };
        }
        let negative = value.is_some_and(|value| value < Dd::ZERO);
        let multiple = if negative { self.graph.neg(multiple) } else { multiple };
        match function {
            Circular::Cosine => self.single(Term::Cosine(multiple), one),
            Circular::Sine => {
                let sign = self.graph.number(if negative { -1.0 } else { 1.0 });
                self.single(Term::Sine(multiple), sign)
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Circular {
    Cosine,
    Sine,
}

fn is_constant(form: &Form) -> bool {
    form.keys().all(|term| *term == Term::One)
}

fn is_trigonometric(term: Term) -> bool {
    matches!(term, Term::Cosine(_) | Term::Sine(_) | Term::One)
}

/// Expressions of a graph that are affine in the states and trigonometric in the phase.
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
    /// Outputs: the multiples `k` of the harmonics, then all entries of all rows.
    program: Program,
    rows: Vec<Option<Vec<RowEntry>>>,
}

/// A column of a row and the number of the program's output for its value.
#[derive(Clone, Copy, Debug)]
struct RowEntry {
    column: usize,
    output: usize,
}

impl AffineExpressions {
    /// Decomposes expressions of a graph. Inputs `0..dimension` are the full state, with the phase,
    /// if there is one, as the last; `parameters` inputs follow.
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
                RowEntry { column: column(term), output: outputs.len() - 1 }
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

    /// Whether an expression, by its number in the given list, is affine.
    pub fn is_affine(&self, expression: usize) -> bool {
        self.rows[expression].is_some()
    }

    /// Number of states without the phase.
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

    /// Rows at a parameter vector.
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
    /// Multiples `k` of the phase.
    pub multiples: Vec<S>,
    columns: usize,
    rows: Vec<S>,
}

impl<S> AffineRows<S> {
    /// Row of an expression, by its number in the given list; zeros if the expression is not
    /// affine.
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
