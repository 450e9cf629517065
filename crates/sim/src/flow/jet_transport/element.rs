//! Collocation of all degrees on one element.

use std::ops::Range;

use super::coefficients::{Part, Sizes};
use super::first_order::FirstOrderTape;
use super::gauss::{GAUSS, NodeValues, ZERO};
use super::plan::CacheKey;
use super::remainders::Remainders;
use super::solver::{ElementSolver, LEAST_SIZE, Resolution, Tail};
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
    /// Rates of the components on the nominal orbit; corrections of the orbit and of the rates.
    rates: Vec<NodeValues>,
    corrections: [Vec<NodeValues>; 2],
    /// Remainders of the components with the contributions of driven ones, one component after
    /// another.
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
        let mut resolution = widest(Nominal { element: self, nominal, length, jets, image })?;
        for degree in 1..=self.key.space.order() {
            if !resolution.meets(tolerance) {
                break;
            }
            if !self.key.space.degree_range(degree).is_empty() {
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

/// Vectorised work for all coefficients of one degree on an element.
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
        element.remainders.compute(degree);
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

/// Largest number of Newton steps towards a nominal orbit.
const MAX_CORRECTIONS: usize = 20;

/// Ratio of a correction to the one before above which the equations are solved anew.
const POOR_GAIN: f64 = 0.03;

/// Size of a correction that ends Newton's method: rounding. If the next correction is expected to
/// be as small, the equations are solved anew for it.
const CORRECTED: f64 = 4e-15;

/// Size below which corrections may stop shrinking.
const STAGNANT: f64 = 1e-11;

/// Vectorised work for the nominal orbit of an element: its nodes, its end, the equations of all
/// degrees.
struct Nominal<'e> {
    element: &'e mut Element,
    nominal: &'e mut [NodeValues],
    length: f64,
    jets: &'e [f64],
    image: &'e mut [f64],
}

impl Vectorised for Nominal<'_> {
    type Output = Option<Resolution>;

    #[inline(always)]
    fn run(self) -> Option<Resolution> {
        let element = self.element;
        let len = element.key.space.len();
        let mut start = Vec::with_capacity(element.rates.len());
        start.extend(self.jets.iter().step_by(len));
        if !element.correct(self.nominal, self.length, &start) {
            return None;
        }
        element.prepare_slots();
        let is_last = element.key.space.order() <= 1;
        let reads_nodes = |state: usize| !is_last && element.reads_nodes[state];
        element.solver.expand(reads_nodes);
        let mut resolution = Resolution::new(element.solver.fundamental_tail());
        for state in 0..start.len() {
            let root = element.solver.root(state);
            let rate = element.rates[root] + element.corrections[1][root];
            let functionals = GAUSS.functionals_of(rate);
            let [once, twice] = [functionals.0[0], functionals.0[1]];
            let rate = if root == state { once } else { start[root] + self.length * twice };
            self.image[state * len] = start[state] + self.length * rate;
            let largest = self.nominal[state].magnitude();
            if root == state {
                let change = functionals * Lanes::splat(self.length);
                resolution.include(0, Tail::new(change, largest));
            }
        }
        Some(resolution)
    }
}

impl Element {
    /// Newton's method for the orbit; the solver is left with the equations of the last step.
    ///
    /// The equations are solved anew at the first step, at the last, and after steps with earlier
    /// equations that gain too little.
    #[inline(always)]
    fn correct(&mut self, nominal: &mut [NodeValues], length: f64, start: &[f64]) -> bool {
        self.first_order.fix(&self.key.program, nominal);
        let (mut last, mut is_new) = (f64::INFINITY, true);
        for _ in 0..MAX_CORRECTIONS {
            self.evaluate(nominal);
            if is_new && !self.factor(length) {
                return false;
            }
            let size = self.step(nominal, start);
            let is_stagnant = last <= STAGNANT && size > 0.5 * last;
            if !size.is_finite() {
                return false;
            }
            if is_new && (size <= CORRECTED || is_stagnant) {
                return true;
            }
            let gain = if is_new { size } else { size / last };
            is_new = is_stagnant || gain > POOR_GAIN || size * gain <= CORRECTED;
            last = size;
        }
        false
    }

    /// Computes the rates of the components from node values.
    #[inline(always)]
    fn evaluate(&mut self, nominal: &[NodeValues]) {
        let program = &self.key.program;
        self.first_order.evaluate(program, nominal);
        for (component, rate) in self.rates.iter_mut().enumerate() {
            *rate = self.first_order.value(program.output(component));
        }
    }

    /// Solves the linear equations about the current orbit; `false` if they are singular.
    #[inline(always)]
    fn factor(&mut self, length: f64) -> bool {
        let program = &self.key.program;
        self.first_order.differentiate(program);
        let slopes = &self.first_order;
        let slope = |row: usize, state: usize| slopes.slope(program.output(row), state);
        self.solver.factor(length, slope)
    }

    /// Makes one Newton step; returns its relative size.
    #[inline(always)]
    fn step(&mut self, nominal: &mut [NodeValues], start: &[f64]) -> f64 {
        let [corrections, rate_corrections] = &mut self.corrections;
        let solver = &self.solver;
        solver.correct(start, nominal, &self.rates, corrections, rate_corrections);
        let size = relative_size(corrections, nominal, &self.rates, solver.length);
        for (values, &correction) in nominal.iter_mut().zip(&*corrections) {
            *values += correction;
        }
        size
    }

    /// Sets the heads of the stored slots, and the slopes of slots that are read again.
    #[inline(always)]
    fn prepare_slots(&mut self) {
        let dimension = self.key.dimension;
        self.gradients.clear();
        for state in 0..dimension {
            self.reads_nodes[state] = self.remainders.is_read_again(state);
        }
        for place in 0..self.remainders.places() {
            let slot = self.remainders.slot(place);
            let head = self.first_order.value(slot);
            self.remainders.set_head(place, head);
            if place < dimension || !self.remainders.is_read_again(place) {
                continue;
            }
            for state in 0..dimension {
                let slope = self.first_order.slope(slot, state);
                if slope != ZERO {
                    self.reads_nodes[state] = true;
                    self.gradients.push(Gradient { place, state, slope });
                }
            }
        }
    }
}

/// Largest correction of a component, relative to the largest value of the component or change of
/// it in the element.
#[inline(always)]
fn relative_size(
    corrections: &[NodeValues],
    nominal: &[NodeValues],
    rates: &[NodeValues],
    length: f64,
) -> f64 {
    let mut worst = 0.0_f64;
    for ((correction, values), rate) in corrections.iter().zip(nominal).zip(rates) {
        let scale = values.magnitude() + length.abs() * rate.magnitude();
        let size = correction.magnitude();
        if size.is_nan() {
            return f64::INFINITY;
        }
        worst = worst.max(size / scale.max(LEAST_SIZE));
    }
    worst
}
