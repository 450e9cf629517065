//! Collocation of all degrees on one element.

use std::ops::Range;

use super::coefficients::{Part, Sizes};
use super::first_order::FirstOrderTape;
use super::gauss::{NODES, NodeValues};
use super::orbit::Nominal;
use super::remainders::Remainders;
use super::resolution::{Resolution, Tail};
use super::solver::ElementSolver;
use super::subject::Subject;
use crate::flow::Program;
use crate::numeric::{Kernel, Lanes, Scalar, widest};

/// The tape of a field over jets whose coefficients are node values, and the gradients of its
/// slots.
pub(super) struct Element {
    pub(super) subject: Subject,
    pub(super) solver: ElementSolver,
    pub(super) remainders: Remainders,
    pub(super) first_order: FirstOrderTape,
    /// Non-zero derivatives by states of the slots whose lower parts recurrences read.
    pub(super) gradients: Vec<Gradient>,
    /// Whether higher degrees read a state at the nodes.
    pub(super) reads_nodes: Vec<bool>,
    /// Rates of the components on the nominal orbit, and corrections of the orbit and of them.
    pub(super) rates: Vec<NodeValues>,
    pub(super) corrections: [Vec<NodeValues>; 2],
    /// Remainders of components that owe something to driven ones, one part after another.
    owed: Vec<NodeValues>,
    owed_starts: Vec<Option<usize>>,
}

/// A derivative of a stored slot by a state at the nodes.
pub(super) struct Gradient {
    pub(super) place: usize,
    pub(super) state: usize,
    pub(super) slope: NodeValues,
}

const ZERO: NodeValues = Lanes([0.0; NODES]);

impl Element {
    /// An element of a subject, in the memory of another one if there is one.
    pub(super) fn new(subject: Subject, other: Option<Box<Self>>) -> Self {
        let tape = other.map(|element| element.remainders.into_tape());
        let (program, dimension) = (&subject.program, subject.dimension);
        Self {
            solver: ElementSolver::new(chains(program, dimension)),
            remainders: Remainders::new(&subject, tape.unwrap_or_default()),
            first_order: FirstOrderTape::new(program, dimension),
            gradients: Vec::new(),
            reads_nodes: vec![true; dimension],
            rates: vec![ZERO; dimension],
            corrections: [vec![ZERO; dimension], vec![ZERO; dimension]],
            owed: Vec::new(),
            owed_starts: Vec::new(),
            subject,
        }
    }

    /// Sets the parameters, constant along the orbit, given as coefficients.
    pub(super) fn set_parameters(&mut self, parameters: &[&[f64]]) {
        self.remainders.set_parameters(parameters);
        let heads = parameters.iter().map(|coefficients| coefficients[0]);
        self.first_order.set_parameters(heads);
    }

    /// Moves jets over an element of a length, from a guess of the nominal orbit at its nodes.
    ///
    /// `jets` and `image` hold the coefficients of every component, one after another; of the image
    /// those that vanish with all that the jets hold are left alone. Stops at the first degree
    /// that misses the tolerance. `None`: the equations are singular or have no solution near
    /// the guess, the element is too long.
    pub(super) fn transport(
        &mut self,
        nominal: &mut [NodeValues],
        length: f64,
        tolerance: f64,
        jets: &[f64],
        image: &mut [f64],
    ) -> Option<Resolution> {
        let mut resolution = widest(Nominal { element: self, nominal, length, jets, image })?;
        for degree in 1..=self.subject.space.order() {
            if !resolution.meets(tolerance) {
                break;
            }
            if !self.subject.space.degree_range(degree).is_empty() {
                let tail = widest(Degree { element: self, degree, jets, image });
                resolution.include(self.subject.factors(degree), tail);
            }
        }
        Some(resolution)
    }

    /// Remainders of the components in one degree with what they owe to those of driven components;
    /// `false` if these have none.
    #[inline(always)]
    fn pass_on(&mut self, degree: usize) -> bool {
        let dimension = self.subject.dimension;
        let range = self.subject.space.degree_range(degree);
        let is_driving = |component: &usize| {
            self.solver.is_driven(*component)
                && self.remainders.remainder(*component, degree).is_some()
        };
        let driving: Vec<_> = (0..dimension).filter(is_driving).collect();
        if driving.is_empty() {
            return false;
        }
        self.owed.resize(dimension * range.len(), ZERO);
        self.owed_starts.clear();
        for (component, owed) in self.owed.chunks_exact_mut(range.len()).enumerate() {
            self.owed_starts.push(Some(component * range.len()));
            match self.remainders.remainder(component, degree) {
                Some(remainder) => owed.copy_from_slice(remainder),
                None => owed.fill(ZERO),
            }
            for &driven in &driving {
                let sources = self.remainders.remainder(driven, degree);
                if let Some(sources) = sources.filter(|_| !self.solver.is_driven(component)) {
                    self.solver.pass_on(driven, sources, component, owed);
                }
            }
        }
        true
    }

    /// Node values of the states, but for the last degree, and their coefficients at the end; the
    /// modes of their changes over the largest of them.
    #[inline(always)]
    fn solve(&mut self, degree: usize, jets: &[f64], image: &mut [f64]) -> Tail {
        let has_owed = self.pass_on(degree);
        let (first, len) =
            (self.subject.space.degree_range(degree).start, self.subject.space.len());
        let is_last = degree == self.subject.space.order();
        let tape = self.remainders.degree(degree);
        let part = Part {
            initial: jets,
            stride: len,
            first,
            starts: if has_owed { &self.owed_starts } else { tape.starts },
            remainders: if has_owed { &self.owed } else { tape.others },
        };
        let mut sizes = Sizes::NONE;
        for (state, support) in tape.supports.iter().enumerate() {
            let monomials = support.part(degree);
            if !is_last && self.reads_nodes[state] {
                let out = &mut tape.states[state * len..][monomials.clone()];
                self.solver.states(state, part, monomials.clone(), out);
            }
            if self.solver.root(state) == state {
                // NOTE: an integral of the component has at least its monomials.
                let integrals = (0..tape.supports.len()).filter(|&s| self.solver.root(s) == state);
                let parts = integrals.map(|state| tape.supports[state].part(degree));
                let monomials = parts.max_by_key(Range::len).unwrap_or(monomials);
                sizes = self.solver.advance(state, part, monomials, image, sizes);
            }
        }
        Tail::new(sizes.rates * Lanes::splat(self.solver.length), sizes.largest.magnitude())
    }
}

/// All coefficients of one degree on an element.
struct Degree<'e> {
    element: &'e mut Element,
    degree: usize,
    jets: &'e [f64],
    image: &'e mut [f64],
}

impl Kernel for Degree<'_> {
    type Output = Tail;

    #[inline(always)]
    fn run(self) -> Tail {
        let (element, degree) = (self.element, self.degree);
        element.remainders.compute(degree);
        let tail = element.solve(degree, self.jets, self.image);
        if degree < element.subject.space.order() {
            for gradient in &element.gradients {
                element.remainders.add_share(
                    degree,
                    gradient.place,
                    gradient.slope,
                    gradient.state,
                );
            }
        }
        tail
    }
}

/// Of each component: the one of which it is the integral, if it is nothing else and that one is
/// not an integral itself.
fn chains(program: &Program, dimension: usize) -> Vec<Option<usize>> {
    let rate = |component: usize| program.output(component);
    (0..dimension)
        .map(|component| {
            let root = rate(component);
            (root < dimension && rate(root) >= dimension).then_some(root)
        })
        .collect()
}
