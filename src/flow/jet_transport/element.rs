//! Collocation of all degrees on one element.

use std::sync::Arc;

use super::gauss::{GAUSS, NODES, NodeValues};
use super::solver::ElementSolver;
use super::sparse::{SparseSpace, VariableSet, variables_of_monomials, variables_of_slots};
use crate::flow::Field;
use crate::jet::{JetError, JetSpace};
use crate::numeric::{Lanes, Scalar};

/// The tape of a field over jets whose coefficients are node values, and the gradients of its slots.
pub(super) struct Element<'a> {
    field: &'a Field,
    space: Arc<JetSpace>,
    tape: Vec<NodeValues>,
    scratch: Vec<NodeValues>,
    /// Variables of each monomial, and those on which each slot depends.
    monomials: Vec<VariableSet>,
    variables: Vec<VariableSet>,
    first_order: Arc<JetSpace>,
    first_order_tape: Vec<NodeValues>,
    /// Non-zero derivatives of slots by states.
    gradients: Vec<Gradient>,
    /// One coefficient of every component: initial value, remainder, node values.
    initial: Vec<f64>,
    remainders: Vec<NodeValues>,
    states: Vec<NodeValues>,
}

/// A derivative of a slot by a state at the nodes.
struct Gradient {
    slot: usize,
    state: usize,
    slope: NodeValues,
    is_euler: bool,
    is_output: bool,
}

/// How well an element resolves its jets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Estimated error at the end, over the largest coefficient of the same degree: the worst degree.
    pub(super) error: f64,
    /// Largest last Legendre mode over the largest coefficient of the same degree.
    pub(super) tail: f64,
}

/// Largest last Legendre mode for which the error estimate, a product of two of them, is believed.
const RESOLVED: f64 = 1e-4;

impl Resolution {
    /// Whether the estimate is below a tolerance and believed.
    pub(super) fn meets(self, tolerance: f64) -> bool {
        self.error <= tolerance && self.tail <= RESOLVED
    }
}

const ZERO: NodeValues = Lanes([0.0; NODES]);

impl<'a> Element<'a> {
    /// Memory for one element; parameters, constant along the orbit, are given as coefficients.
    pub(super) fn new(
        field: &'a Field,
        space: &Arc<JetSpace>,
        initial: &[&[f64]],
        parameters: &[&[f64]],
    ) -> Result<Self, JetError> {
        let (program, dimension) = (field.program(), field.dimension());
        let first_order = JetSpace::uniform(dimension, 1)?;
        let mut tape = vec![ZERO; program.slots() * space.len()];
        let mut first_order_tape = vec![ZERO; program.slots() * first_order.len()];
        for (parameter, coefficients) in parameters.iter().enumerate() {
            let input = dimension + parameter;
            let element = &mut tape[input * space.len()..(input + 1) * space.len()];
            for (values, &coefficient) in element.iter_mut().zip(*coefficients) {
                *values = Lanes::splat(coefficient);
            }
            first_order_tape[input * first_order.len()] = Lanes::splat(coefficients[0]);
        }
        for state in 0..dimension {
            let monomial = first_order
                .linear_monomial(state)
                .expect("order 1 keeps linear terms");
            first_order_tape[state * first_order.len() + monomial] = Lanes::splat(1.0);
        }
        let monomials = variables_of_monomials(space);
        let set = |coefficients: &&[f64]| {
            let present = coefficients
                .iter()
                .zip(&monomials)
                .filter(|(value, _)| **value != 0.0);
            present.fold(0, |set, (_, monomial)| set | monomial)
        };
        let inputs: Vec<_> = initial.iter().chain(parameters).map(set).collect();
        let variables = variables_of_slots(program, &inputs, dimension);
        let scratch = vec![ZERO; space.len().max(first_order.len())];
        let space = Arc::clone(space);
        Ok(Self {
            field,
            space,
            tape,
            scratch,
            monomials,
            variables,
            first_order,
            first_order_tape,
            gradients: Vec::new(),
            initial: vec![0.0; dimension],
            remainders: vec![ZERO; dimension],
            states: vec![ZERO; dimension],
        })
    }

    /// Moves jets over the element, from the nominal orbit at its nodes.
    ///
    /// `jets` holds the coefficients of every component, one after another; all but the heads are
    /// replaced. Stops at the first degree that misses the tolerance. `None`: the equations are
    /// singular, the element is too long.
    pub(super) fn transport(
        &mut self,
        nominal: &[NodeValues],
        length: f64,
        tolerance: f64,
        jets: &mut [f64],
    ) -> Option<Resolution> {
        self.evaluate_nominal(nominal);
        let solver = self.solver(length)?;
        let fundamental = solver.fundamental_tail();
        let mut resolution = Resolution {
            error: 0.0,
            tail: fundamental,
        };
        for degree in 1..=self.space.order() {
            if !self.space.degree_range(degree).is_empty() {
                let tail = self.transport_degree(&solver, degree, length, jets);
                resolution.tail = resolution.tail.max(tail);
                resolution.error = resolution.error.max(tail * fundamental.max(f64::EPSILON));
                if !resolution.meets(tolerance) {
                    break;
                }
            }
        }
        Some(resolution)
    }

    /// Heads of all slots and their gradients by the state.
    fn evaluate_nominal(&mut self, nominal: &[NodeValues]) {
        let program = self.field.program();
        for (state, &values) in nominal.iter().enumerate() {
            self.tape[state * self.space.len()] = values;
            self.first_order_tape[state * self.first_order.len()] = values;
        }
        program.advance(&*self.space, 0, &mut self.tape, &mut self.scratch);
        for degree in 0..=1 {
            program.advance(
                &*self.first_order,
                degree,
                &mut self.first_order_tape,
                &mut self.scratch,
            );
        }
        self.gradients.clear();
        let dimension = self.field.dimension();
        for slot in program.inputs()..program.slots() {
            for state in 0..dimension {
                let slope = self.slope(slot, state);
                if slope != ZERO {
                    let is_output =
                        (0..dimension).any(|component| program.output(component) == slot);
                    let is_euler = program.is_euler(slot);
                    self.gradients.push(Gradient {
                        slot,
                        state,
                        slope,
                        is_euler,
                        is_output,
                    });
                }
            }
        }
    }

    fn slope(&self, slot: usize, state: usize) -> NodeValues {
        let monomial = self
            .first_order
            .linear_monomial(state)
            .expect("order 1 keeps linear terms");
        self.first_order_tape[slot * self.first_order.len() + monomial]
    }

    fn solver(&self, length: f64) -> Option<ElementSolver> {
        let (program, dimension) = (self.field.program(), self.field.dimension());
        let jacobian: Vec<_> = (0..dimension * dimension)
            .map(|entry| self.slope(program.output(entry / dimension), entry % dimension))
            .collect();
        let has_remainder: Vec<_> = (0..dimension)
            .map(|component| program.output(component) >= dimension)
            .collect();
        ElementSolver::new(&jacobian, length, &has_remainder)
    }

    /// One degree: remainders, the linear equations, the state's share in every slot, the end.
    ///
    /// Returns the last Legendre modes of the derivatives, over the largest coefficient of the degree.
    fn transport_degree(
        &mut self,
        solver: &ElementSolver,
        degree: usize,
        length: f64,
        jets: &mut [f64],
    ) -> f64 {
        let (program, len) = (self.field.program(), self.space.len());
        let range = self.space.degree_range(degree);
        for state in 0..self.field.dimension() {
            self.tape[state * len + range.start..state * len + range.end].fill(ZERO);
        }
        let sparse = |slot: usize| SparseSpace {
            space: &self.space,
            monomials: &self.monomials,
            variables: self.variables[slot],
        };
        program.advance_with::<_, SparseSpace, _>(
            sparse,
            degree,
            &mut self.tape,
            &mut self.scratch,
        );
        for monomial in range.clone() {
            self.solve_monomial(solver, monomial, jets);
        }
        self.add_linear_part(degree);
        let (mut tail, mut largest) = (0.0_f64, f64::MIN_POSITIVE);
        for component in 0..self.field.dimension() {
            for monomial in range.clone() {
                let rates = self.tape[program.output(component) * len + monomial];
                let value = &mut jets[component * len + monomial];
                largest = largest.max(value.abs());
                *value += length * GAUSS.integral(rates);
                largest = largest.max(value.abs());
                tail = tail.max(GAUSS.tail(rates));
            }
        }
        tail * length.abs() / largest
    }

    /// Node values of one coefficient of the state, into the tape.
    #[inline]
    fn solve_monomial(&mut self, solver: &ElementSolver, monomial: usize, jets: &[f64]) {
        let (program, len) = (self.field.program(), self.space.len());
        for component in 0..self.states.len() {
            self.initial[component] = jets[component * len + monomial];
            self.remainders[component] = self.tape[program.output(component) * len + monomial];
        }
        solver.solve(&self.initial, &self.remainders, &mut self.states);
        for (component, &values) in self.states.iter().enumerate() {
            self.tape[component * len + monomial] = values;
        }
    }

    /// Adds the share of the state's part of a degree to the part of every slot.
    fn add_linear_part(&mut self, degree: usize) {
        let (len, range) = (self.space.len(), self.space.degree_range(degree));
        let last = degree == self.space.order();
        for gradient in self
            .gradients
            .iter()
            .filter(|gradient| gradient.is_output || !last)
        {
            let factor = if gradient.is_euler {
                degree as f64
            } else {
                1.0
            };
            let slope = gradient.slope * Lanes::splat(factor);
            let (states, slots) = self.tape.split_at_mut(self.field.dimension() * len);
            let states =
                &states[gradient.state * len + range.start..gradient.state * len + range.end];
            let first = (gradient.slot - self.field.dimension()) * len;
            for (value, &state) in slots[first + range.start..first + range.end]
                .iter_mut()
                .zip(states)
            {
                *value = slope.mul_add(state, *value);
            }
        }
    }
}
