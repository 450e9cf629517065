//! The nominal orbit of an element, by Newton's method, and the equations about it.

use super::super::gauss::{GAUSS, NodeValues, ZERO};
use super::super::solver::{LEAST_SIZE, Resolution, Tail};
use super::{Element, Gradient};
use crate::numeric::{Lanes, Scalar, Vectorised, widest};

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
    /// Finds the nominal orbit from a guess at the nodes, and prepares the equations of all
    /// degrees; `None` if the element is too long.
    ///
    /// NOTE: never inlined, and in a file of its own: it is compiled beside the degrees.
    #[inline(never)]
    pub(super) fn find_orbit(
        &mut self,
        nominal: &mut [NodeValues],
        length: f64,
        jets: &[f64],
        image: &mut [f64],
    ) -> Option<Resolution> {
        widest(Nominal { element: self, nominal, length, jets, image })
    }

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
