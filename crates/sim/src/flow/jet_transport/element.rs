//! Collocation of all degrees on one element.

mod nominal;

use std::ops::Range;

use super::coefficients::{Part, Sizes};
use super::first_order::FirstOrderTape;
use super::gauss::{NodeValues, ZERO};
use super::plan::CacheKey;
use super::remainders::Remainders;
use super::solver::{ElementSolver, Resolution, Tail};
use crate::flow::Program;
use crate::numeric::{Lanes, Scalar, Vectorised, widest};

/// Tape of a field over jets whose coefficients are node values, and gradients of its slots.
pub(super) struct Element {
    pub(super) key: CacheKey,
    solver: ElementSolver,
    pub(super) remainders: Remainders,
    first_order: FirstOrderTape,
    /// Nonzero derivatives with respect to states, for the slots whose lower parts recurrences
    /// read.
    gradients: Vec<Gradient>,
    /// Whether higher degrees read each state at the nodes.
    reads_nodes: Vec<bool>,
    /// Rates on the nominal orbit at the nodes, by component.
    rates: Vec<NodeValues>,
    /// Newton's corrections of the nominal orbit and of its rates at the nodes, by component.
    corrections: [Vec<NodeValues>; 2],
    /// Remainders of the rates, one component after another. Those of driven components, whose
    /// rates depend on no state, are added to the remainders that they contribute to.
    owed: Vec<NodeValues>,
    owed_starts: Vec<Option<usize>>,
}

/// Derivative of a stored slot with respect to a state, at the nodes.
struct Gradient {
    place: usize,
    state: usize,
    slope: NodeValues,
}

impl Element {
    /// An element for a key, in the memory of `other` if there is one.
    pub(super) fn new(key: CacheKey, other: Option<Box<Self>>) -> Self {
        let tape = other.map(|element| element.remainders.into_tape());
        let (program, dimension) = (&key.program, key.dimension);
        Self {
            solver: ElementSolver::new(chains(program, dimension)),
            remainders: Remainders::new(&key, tape.unwrap_or_default()),
            first_order: FirstOrderTape::new(program, dimension),
            gradients: Vec::new(),
            reads_nodes: vec![true; dimension],
            rates: vec![ZERO; dimension],
            corrections: [vec![ZERO; dimension], vec![ZERO; dimension]],
            owed: Vec::new(),
            owed_starts: Vec::new(),
            key,
        }
    }

    /// Sets the parameters, constant along the orbit, from their coefficients.
    pub(super) fn set_parameters(&mut self, parameters: &[&[f64]]) {
        self.remainders.set_parameters(parameters);
        let heads = parameters.iter().map(|coefficients| coefficients[0]);
        self.first_order.set_parameters(heads);
    }

    /// Carries jets over an element of a length, from a guess of the nominal orbit at its nodes.
    ///
    /// `jets` and `image` hold the coefficients of every component, one after another. Coefficients
    /// of the image that vanish for the monomials in these jets are not changed. The function stops
    /// at the first degree that misses the tolerance. `None`: the element is too long, because the
    /// equations are singular or have no solution near the guess.
    pub(super) fn transport(
        &mut self,
        nominal: &mut [NodeValues],
        length: f64,
        tolerance: f64,
        jets: &[f64],
        image: &mut [f64],
    ) -> Option<Resolution> {
        let mut resolution = self.find_orbit(nominal, length, jets, image)?;
        for degree in 1..=self.key.space.order() {
            if !resolution.meets(tolerance) {
                break;
            }
            if !self.key.space.degree_range(degree).is_empty() {
                self.remainders.compute(degree);
                let tail = widest(Degree { element: self, degree, jets, image });
                resolution.include(self.key.factors(degree), tail);
            }
        }
        Some(resolution)
    }

    /// Computes the remainders of the components in one degree with the contributions of driven
    /// components; `false` if those have no remainders.
    #[inline(always)]
    fn pass_on(&mut self, degree: usize) -> bool {
        let dimension = self.key.dimension;
        let range = self.key.space.degree_range(degree);
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

    /// Computes the node values of the states, except in the last degree, and their coefficients at
    /// the end. Returns the modes of the changes, relative to the largest coefficient.
    #[inline(always)]
    fn solve(&mut self, degree: usize, jets: &[f64], image: &mut [f64]) -> Tail {
        let has_owed = self.pass_on(degree);
        let (first, len) = (self.key.space.degree_range(degree).start, self.key.space.len());
        let is_last = degree == self.key.space.order();
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
                // NOTE: an integral of the component has all of its monomials, or more.
                let integrals = (0..tape.supports.len()).filter(|&s| self.solver.root(s) == state);
                let parts = integrals.map(|state| tape.supports[state].part(degree));
                let monomials = parts.max_by_key(Range::len).unwrap_or(monomials);
                sizes = self.solver.advance(state, part, monomials, image, sizes);
            }
        }
        Tail::new(sizes.rates * Lanes::splat(self.solver.length), sizes.largest.magnitude())
    }
}

/// Vectorised work for all coefficients of one degree on an element, from their remainders.
struct Degree<'e> {
    element: &'e mut Element,
    degree: usize,
    jets: &'e [f64],
    image: &'e mut [f64],
}

impl Vectorised for Degree<'_> {
    type Output = Tail;

    #[inline(always)]
    fn run(self) -> Tail {
        let (element, degree) = (self.element, self.degree);
        let tail = element.solve(degree, self.jets, self.image);
        if degree < element.key.space.order() {
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

/// For each component the component that it integrates, if its rate is that component alone and
/// that one is not an integral itself.
fn chains(program: &Program, dimension: usize) -> Vec<Option<usize>> {
    let rate = |component: usize| program.output(component);
    (0..dimension)
        .map(|component| {
            let root = rate(component);
            (root < dimension && rate(root) >= dimension).then_some(root)
        })
        .collect()
}
