//! Collocation of all degrees on one element.

use std::sync::Arc;

use super::coefficients::Part;
use super::first_order::FirstOrderTape;
use super::gauss::{Functionals, GAUSS, NODES, NodeValues};
use super::remainders::Remainders;
use super::resolution::{Resolution, Tail};
use super::solver::ElementSolver;
use crate::flow::{Field, Program};
use crate::jet::JetSpace;
use crate::numeric::{Kernel, Lanes, Scalar, widest};

/// The tape of a field over jets whose coefficients are node values, and the gradients of its slots.
pub(super) struct Element<'a> {
    field: &'a Field,
    space: Arc<JetSpace>,
    solver: ElementSolver,
    remainders: Remainders,
    first_order: FirstOrderTape,
    /// Non-zero derivatives by states of the slots whose lower parts recurrences read.
    gradients: Vec<Gradient>,
    /// Rates of the components on the nominal orbit, and corrections of the orbit and of them.
    rates: Vec<NodeValues>,
    corrections: [Vec<NodeValues>; 2],
    /// Remainders of components that owe something to driven ones, one part after another.
    owed: Vec<NodeValues>,
    /// Functionals of the rates of every component, one part after another.
    functionals: Vec<Functionals>,
}

/// A derivative of a stored slot by a state at the nodes.
struct Gradient {
    place: usize,
    state: usize,
    slope: NodeValues,
}

const ZERO: NodeValues = Lanes([0.0; NODES]);

/// Most of Newton's steps towards a nominal orbit.
const MAX_CORRECTIONS: usize = 20;

/// Gain of a step with the equations of an earlier one that is not worth another such step.
const POOR_GAIN: f64 = 0.03;

/// Corrections that end Newton's method: rounding, and what quadratic convergence turns into rounding.
const CORRECTED: f64 = 4e-15;

/// Corrections that may no longer shrink.
const STAGNANT: f64 = 1e-11;

impl<'a> Element<'a> {
    /// Memory for one element; parameters, constant along the orbit, are given as coefficients.
    pub(super) fn new(
        field: &'a Field,
        space: &Arc<JetSpace>,
        initial: &[&[f64]],
        parameters: &[&[f64]],
    ) -> Self {
        let (program, dimension) = (field.program(), field.dimension());
        let heads = parameters.iter().map(|coefficients| coefficients[0]);
        let inputs: Vec<_> = initial.iter().chain(parameters).copied().collect();
        Self {
            field,
            solver: ElementSolver::new(chains(program, dimension)),
            remainders: Remainders::new(program, space, &inputs, dimension),
            first_order: FirstOrderTape::new(program, dimension, heads),
            gradients: Vec::new(),
            rates: vec![ZERO; dimension],
            corrections: [vec![ZERO; dimension], vec![ZERO; dimension]],
            owed: Vec::new(),
            functionals: vec![Lanes([0.0; 8]); dimension * space.len()],
            space: Arc::clone(space),
        }
    }

    /// Moves jets over an element of a length, from a guess of the nominal orbit at its nodes.
    ///
    /// `jets` holds the coefficients of every component, one after another. Stops at the first degree that
    /// misses the tolerance. `None`: the equations are singular or have no solution near the guess, the element
    /// is too long.
    pub(super) fn transport(
        &mut self,
        nominal: &mut [NodeValues],
        length: f64,
        tolerance: f64,
        jets: &mut [f64],
    ) -> Option<Resolution> {
        let mut resolution = widest(Nominal {
            element: self,
            nominal,
            length,
            jets,
        })?;
        for degree in 1..=self.space.order() {
            if !resolution.meets(tolerance) {
                break;
            }
            if !self.space.degree_range(degree).is_empty() {
                let tail = widest(Degree {
                    element: self,
                    degree,
                    jets,
                });
                resolution.include(degree, tail);
            }
        }
        Some(resolution)
    }

    /// Newton's method for the orbit; the solver is that of the last step.
    ///
    /// The equations are solved anew at the first step, at the last, and where steps with those of an earlier one
    /// gain too little.
    #[inline(always)]
    fn correct(&mut self, nominal: &mut [NodeValues], length: f64, start: &[f64]) -> bool {
        let program = self.field.program();
        self.first_order.fix(program, nominal);
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

    /// Rates of the components at node values.
    #[inline(always)]
    fn evaluate(&mut self, nominal: &[NodeValues]) {
        let program = self.field.program();
        self.first_order.evaluate(program, nominal);
        for (component, rate) in self.rates.iter_mut().enumerate() {
            *rate = self.first_order.value(program.output(component));
        }
    }

    /// Solves the linear equations about the orbit at hand; `false` if they are singular.
    #[inline(always)]
    fn factor(&mut self, length: f64) -> bool {
        let program = self.field.program();
        self.first_order.differentiate(program);
        let slopes = &self.first_order;
        let slope = |row: usize, state: usize| slopes.slope(program.output(row), state);
        self.solver.factor(length, slope)
    }

    /// One step of Newton's method; its relative size.
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

    /// Heads of the stored slots, and the slopes of those that are read again.
    #[inline(always)]
    fn prepare_slots(&mut self) {
        let dimension = self.field.dimension();
        self.gradients.clear();
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
                    self.gradients.push(Gradient {
                        place,
                        state,
                        slope,
                    });
                }
            }
        }
    }

    /// Remainders of the components in one degree with what they owe to those of driven components; `false` if
    /// these have none.
    #[inline(always)]
    fn pass_on(&mut self, degree: usize) -> bool {
        let dimension = self.field.dimension();
        let range = self.space.degree_range(degree);
        let is_driving = |component: &usize| {
            self.solver.is_driven(*component)
                && self.remainders.remainder(*component, degree).is_some()
        };
        let driving: Vec<_> = (0..dimension).filter(is_driving).collect();
        if driving.is_empty() {
            return false;
        }
        self.owed.resize(dimension * range.len(), ZERO);
        for component in 0..dimension {
            let owed = &mut self.owed[component * range.len()..(component + 1) * range.len()];
            match self.remainders.remainder(component, degree) {
                Some(start) => {
                    owed.copy_from_slice(&self.remainders.others()[start..][range.clone()])
                }
                None => owed.fill(ZERO),
            }
            for &driven in &driving {
                let start = self.remainders.remainder(driven, degree);
                if let Some(start) = start.filter(|_| !self.solver.is_driven(component)) {
                    let sources = &self.remainders.others()[start..][range.clone()];
                    self.solver.pass_on(driven, sources, component, owed);
                }
            }
        }
        true
    }

    /// Node values of the states, but for the last degree, and functionals of their rates.
    #[inline(always)]
    fn solve(&mut self, degree: usize, jets: &[f64]) {
        let has_owed = self.pass_on(degree);
        let dimension = self.field.dimension();
        let (range, len) = (self.space.degree_range(degree), self.space.len());
        let mut starts = Vec::with_capacity(dimension);
        for component in 0..dimension {
            starts.push((
                self.remainders.remainder(component, degree),
                self.remainders.part(component, degree),
            ));
        }
        let (states, others) = self.remainders.split();
        let mut sources = Vec::with_capacity(dimension);
        for (component, (start, _)) in starts.iter().enumerate() {
            sources.push(if has_owed {
                Some(&self.owed[component * range.len()..(component + 1) * range.len()])
            } else {
                start.map(|start| &others[start..][range.clone()])
            });
        }
        let part = Part {
            initial: jets,
            stride: len,
            first: range.start,
            remainders: &sources,
        };
        for (state, (_, monomials)) in starts.iter().enumerate() {
            if degree < self.space.order() {
                let out = &mut states[state * len..][monomials.clone()];
                self.solver.states(state, part, monomials.clone(), out);
            }
            if self.solver.root(state) == state {
                let out = &mut self.functionals[state * len..][monomials.clone()];
                self.solver.functionals(state, part, monomials.clone(), out);
            }
        }
    }

    /// Moves the coefficients of one degree to the end; the modes of their changes over the largest of them.
    #[inline(always)]
    fn advance(&self, degree: usize, jets: &mut [f64]) -> Tail {
        let (len, dimension) = (self.space.len(), self.field.dimension());
        let (mut rates, mut largest) = (Lanes([0.0; 8]), 0.0);
        // NOTE: integrals of other components first, for they need the initial values of these.
        for integrals in [true, false] {
            for state in 0..dimension {
                let root = self.solver.root(state);
                if (root != state) != integrals {
                    continue;
                }
                for monomial in self.remainders.part(state, degree) {
                    let functionals = self.functionals[root * len + monomial];
                    let initial = |state: usize| jets[state * len + monomial];
                    let change = self.solver.advance(state, functionals, initial);
                    let value = &mut jets[state * len + monomial];
                    largest = larger(largest, value.abs());
                    *value += change;
                    largest = larger(largest, value.abs());
                    rates = rates.zip_map(functionals, |rate, value| larger(rate, value.abs()));
                }
            }
        }
        Tail::new(rates * Lanes::splat(self.solver.length), largest)
    }
}

/// The nominal orbit of an element: its nodes, its end, the equations of all degrees.
struct Nominal<'e, 'a> {
    element: &'e mut Element<'a>,
    nominal: &'e mut [NodeValues],
    length: f64,
    jets: &'e mut [f64],
}

impl Kernel for Nominal<'_, '_> {
    type Output = Option<Resolution>;

    #[inline(always)]
    fn run(self) -> Option<Resolution> {
        let element = self.element;
        let len = element.space.len();
        let mut start = Vec::with_capacity(element.rates.len());
        start.extend(self.jets.iter().step_by(len));
        if !element.correct(self.nominal, self.length, &start) {
            return None;
        }
        element.prepare_slots();
        element.solver.expand(element.space.order() > 1);
        let mut resolution = Resolution::new(element.solver.fundamental_tail());
        for state in 0..start.len() {
            let root = element.solver.root(state);
            let rate = element.rates[root] + element.corrections[1][root];
            let functionals = GAUSS.functionals_of(rate);
            let initial = |state: usize| start[state];
            self.jets[state * len] += element.solver.advance(state, functionals, initial);
            let largest = self.nominal[state].magnitude();
            if root == state {
                let change = functionals * Lanes::splat(self.length);
                resolution.include(0, Tail::new(change, largest));
            }
        }
        Some(resolution)
    }
}

/// All coefficients of one degree on an element.
struct Degree<'e, 'a> {
    element: &'e mut Element<'a>,
    degree: usize,
    jets: &'e mut [f64],
}

impl Kernel for Degree<'_, '_> {
    type Output = Tail;

    #[inline(always)]
    fn run(self) -> Tail {
        let (element, degree) = (self.element, self.degree);
        element.remainders.compute(degree);
        element.solve(degree, self.jets);
        if degree < element.space.order() {
            for gradient in &element.gradients {
                element.remainders.add_share(
                    degree,
                    gradient.place,
                    gradient.slope,
                    gradient.state,
                );
            }
        }
        element.advance(degree, self.jets)
    }
}

/// Of each component: the one of which it is the integral, if it is nothing else and that one is not an integral itself.
fn chains(program: &Program, dimension: usize) -> Vec<Option<usize>> {
    let rate = |component: usize| program.output(component);
    (0..dimension)
        .map(|component| {
            let root = rate(component);
            (root < dimension && rate(root) >= dimension).then_some(root)
        })
        .collect()
}

/// Largest correction of a component, over the largest value of the component or change of it in the element.
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
        worst = worst.max(size / scale.max(f64::MIN_POSITIVE));
    }
    worst
}

/// The larger of two numbers, the first if the second is not a number.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
