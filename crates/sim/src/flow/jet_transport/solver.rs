//! The linear equations of collocation on one element, solved once for every coefficient.
//!
//! One idea: the part of degree `k` of the state enters its own equation linearly, with the same
//! matrix for every degree and monomial. The unknowns are the rates `y_c` at the nodes, for the
//! components that are not merely the integral of another one. With `x = x(0) + h A y`, or `h² A²`
//! for such an integral,
//!
//! ```text
//! y_c = r_c + Σ_s J_cs x_s,      x_s = i_s + W_s y_root(s)
//! ```
//!
//! so that `(I − Σ_s diag(J_cs) W_s) y = r + J i`: entries of the matrix are products of two
//! numbers, and a forced oscillator of one degree of freedom leaves a single block to invert. See
//! docs/mathematics/flow.md.

use super::gauss::{Functionals, GAUSS, Gauss, NODES, NodeMatrix, NodeValues, ZERO};
use crate::numeric::{Lanes, Scalar};

/// The equations of one element, ready for any coefficient.
pub(super) struct ElementSolver {
    gauss: &'static Gauss,
    /// For each component the component that it integrates, if its rate is nothing else.
    pub(super) chains: Vec<Option<usize>>,
    pub(super) length: f64,
    /// `h A` and `h² A²`.
    integration: [NodeMatrix; 2],
    /// `∂f_c/∂x_s` at the nodes, by rows.
    jacobian: Vec<NodeValues>,
    /// Components whose rates are unknown, and the inverse of their matrix.
    coupled: Vec<usize>,
    rates: BlockMatrix,
    spare: BlockMatrix,
    /// Responses of states at the nodes to initial values and to remainders, row by row.
    pub(super) to_initial: Vec<Option<NodeValues>>,
    pub(super) to_remainder: Vec<Option<NodeMatrix>>,
    /// Responses of the functionals of rates to initial values and to remainders, row by row.
    pub(super) functionals_to_initial: Vec<Functionals>,
    pub(super) functionals_to_remainder: Vec<Option<[Functionals; NODES]>>,
}

impl ElementSolver {
    /// Solver with memory for elements of a field.
    pub(super) fn new(chains: Vec<Option<usize>>) -> Self {
        let entries = chains.len() * chains.len();
        Self {
            gauss: &GAUSS,
            length: 0.0,
            integration: [NodeMatrix::ZERO; 2],
            jacobian: vec![ZERO; entries],
            coupled: Vec::new(),
            rates: BlockMatrix::default(),
            spare: BlockMatrix::default(),
            to_initial: vec![None; entries],
            to_remainder: absent(entries),
            functionals_to_initial: vec![Lanes([0.0; 8]); entries],
            functionals_to_remainder: absent(entries),
            chains,
        }
    }

    /// Inverts the matrix of the rates on an element of a length, from the Jacobian at the nodes,
    /// given row by row.
    ///
    /// `false` if a block pivot is singular: the element is too long.
    #[inline(always)]
    pub(super) fn factor(
        &mut self,
        length: f64,
        jacobian: impl Fn(usize, usize) -> NodeValues,
    ) -> bool {
        if self.length != length {
            self.length = length;
            let [once, twice] = &self.gauss.integration;
            self.integration = [once.scaled(length), twice.scaled(length * length)];
        }
        let dimension = self.chains.len();
        for entry in 0..dimension * dimension {
            self.jacobian[entry] = jacobian(entry / dimension, entry % dimension);
        }
        self.coupled.clear();
        for component in 0..dimension {
            let row = &self.jacobian[component * dimension..(component + 1) * dimension];
            let is_coupled = row.iter().any(|entry| *entry != ZERO);
            if is_coupled && self.chains[component].is_none() {
                self.coupled.push(component);
            }
        }
        self.set_matrix();
        self.rates.invert(&mut self.spare)
    }

    /// Sets the matrix of the rates to `I − Σ_s diag(J_cs) W_s`.
    #[inline(always)]
    fn set_matrix(&mut self) {
        self.rates.clear(self.coupled.len());
        for (row, &component) in self.coupled.iter().enumerate() {
            for (column, &root) in self.coupled.iter().enumerate() {
                let unit = if row == column { &NodeMatrix::IDENTITY } else { &NodeMatrix::ZERO };
                let mut is_there = false;
                for state in 0..self.chains.len() {
                    let slopes = self.slopes(component, state);
                    if self.root(state) != root || slopes == ZERO {
                        continue;
                    }
                    let weight = &self.integration[usize::from(self.chains[state].is_some())];
                    let block = self.rates.place(row, column);
                    if is_there {
                        block.subtract_scaled_rows(slopes, weight);
                    } else {
                        block.set_difference(unit, slopes, weight);
                    }
                    is_there = true;
                }
                if row == column && !is_there {
                    *self.rates.place(row, row) = NodeMatrix::IDENTITY;
                }
            }
        }
    }

    /// Prepares [`advance`](Self::advance), and [`states`](Self::states) for the states whose node
    /// values are needed.
    #[inline(always)]
    pub(super) fn expand(&mut self, is_asked_for: impl Fn(usize) -> bool + Copy) {
        let dimension = self.chains.len();
        self.to_initial.fill(None);
        clear(&mut self.to_remainder);
        self.functionals_to_initial.fill(Lanes([0.0; 8]));
        clear(&mut self.functionals_to_remainder);
        for state in 0..dimension {
            self.to_initial[state * dimension + state] = Some(Lanes([1.0; NODES]));
            if let Some(root) = self.chains[state] {
                self.to_initial[state * dimension + root] = Some(self.nodes_in_time());
            }
        }
        for component in 0..dimension {
            if self.chains[component].is_none() && !self.coupled.contains(&component) {
                let entry = component * dimension + component;
                self.functionals_to_remainder[entry] = Some(self.gauss.functionals);
            }
        }
        for row in 0..self.coupled.len() {
            self.expand_rate(row, is_asked_for);
        }
    }

    /// Adds the responses that go through the rate of one coupled component.
    #[inline(always)]
    fn expand_rate(&mut self, row: usize, is_asked_for: impl Fn(usize) -> bool) {
        let (dimension, component) = (self.chains.len(), self.coupled[row]);
        for initial in 0..dimension {
            let Some(rate) = self.rate_to_initial(row, initial) else {
                continue;
            };
            let entry = component * dimension + initial;
            self.functionals_to_initial[entry] = self.gauss.functionals_of(rate);
            for state in 0..dimension {
                if self.root(state) == component {
                    let share = self.weight(state).apply(rate);
                    let response = &mut self.to_initial[state * dimension + initial];
                    *response = Some(response.unwrap_or(ZERO) + share);
                }
            }
        }
        for (column, &source) in self.coupled.iter().enumerate() {
            let Some(rate) = self.rates.get(row, column) else {
                continue;
            };
            let functionals = self.functionals_to_remainder[component * dimension + source]
                .get_or_insert([Lanes([0.0; 8]); NODES]);
            self.gauss.functionals_of_columns(rate, functionals);
            for state in 0..dimension {
                if self.root(state) == component && is_asked_for(state) {
                    let weight = &self.integration[usize::from(self.chains[state].is_some())];
                    let response = &mut self.to_remainder[state * dimension + source];
                    weight.add_times(rate, response.get_or_insert(NodeMatrix::ZERO));
                }
            }
        }
    }

    /// Rate of a coupled component at the nodes in response to an initial value.
    #[inline(always)]
    fn rate_to_initial(&self, row: usize, initial: usize) -> Option<NodeValues> {
        let mut rate = None;
        for (column, &component) in self.coupled.iter().enumerate() {
            let mut slopes = self.slopes(component, initial);
            for state in 0..self.chains.len() {
                if self.chains[state] == Some(initial) {
                    slopes += self.slopes(component, state) * self.nodes_in_time();
                }
            }
            if let Some(block) = self.rates.get(row, column)
                && slopes != ZERO
            {
                rate = Some(rate.unwrap_or(ZERO) + block.apply(slopes));
            }
        }
        rate
    }

    /// One Newton step for the nominal orbit: corrections of the node values and of the rates, from
    /// the node values and the rates `f` there.
    #[inline(always)]
    pub(super) fn correct(
        &self,
        start: &[f64],
        nominal: &[NodeValues],
        rates: &[NodeValues],
        corrections: &mut [NodeValues],
        rate_corrections: &mut [NodeValues],
    ) {
        let dimension = self.chains.len();
        for state in 0..dimension {
            let initial = match self.chains[state] {
                Some(root) => self.nodes_in_time() * Lanes::splat(start[root]),
                None => ZERO,
            };
            let integral = self.weight(state).apply(rates[self.root(state)]);
            corrections[state] = Lanes::splat(start[state]) - nominal[state] + (initial + integral);
        }
        rate_corrections.fill(ZERO);
        for (column, &component) in self.coupled.iter().enumerate() {
            let mut defect = ZERO;
            for (state, correction) in corrections.iter().enumerate() {
                defect = self.slopes(component, state).mul_add(*correction, defect);
            }
            for (row, &target) in self.coupled.iter().enumerate() {
                if let Some(block) = self.rates.get(row, column) {
                    rate_corrections[target] += block.apply(defect);
                }
            }
        }
        for state in 0..dimension {
            let share = rate_corrections[self.root(state)];
            if share != ZERO {
                corrections[state] += self.weight(state).apply(share);
            }
        }
    }

    /// Whether the rate of a component depends on no state.
    pub(super) fn is_driven(&self, component: usize) -> bool {
        self.chains[component].is_none() && !self.coupled.contains(&component)
    }

    /// Largest modes of the fundamental matrix, relative to each entry.
    #[inline(always)]
    pub(super) fn fundamental_tail(&self) -> Tail {
        let mut tail = Tail::NONE;
        for response in self.to_initial.iter().flatten() {
            tail =
                tail.larger(Tail::new(self.gauss.functionals_of(*response), response.magnitude()));
        }
        tail
    }

    /// Component whose rate a state integrates, once or twice.
    #[inline(always)]
    pub(super) fn root(&self, state: usize) -> usize {
        self.chains[state].unwrap_or(state)
    }

    /// `W_s`: the matrix from the rate of a state's root to the state at the nodes.
    #[inline(always)]
    pub(super) fn weight(&self, state: usize) -> &NodeMatrix {
        &self.integration[usize::from(self.chains[state].is_some())]
    }

    #[inline(always)]
    pub(super) fn slopes(&self, component: usize, state: usize) -> NodeValues {
        self.jacobian[component * self.chains.len() + state]
    }

    /// Times of the nodes since the start of the element.
    #[inline(always)]
    fn nodes_in_time(&self) -> NodeValues {
        Lanes(self.gauss.nodes) * Lanes::splat(self.length)
    }
}

/// A list of `None`.
fn absent<T>(count: usize) -> Vec<Option<T>> {
    std::iter::repeat_with(|| None).take(count).collect()
}

/// Sets all entries to `None`.
///
/// NOTE: filling them with a copy of an empty entry would copy all of its bytes.
#[inline(always)]
fn clear<T>(places: &mut [Option<T>]) {
    for place in places {
        *place = None;
    }
}

/// Least size to which functions are compared. Smaller numbers are close to subnormal numbers,
/// which have fewer digits, such as the values of a pulse far from its centre.
pub(super) const LEAST_SIZE: f64 = f64::MIN_POSITIVE / (f64::EPSILON * f64::EPSILON);

/// Largest Legendre modes of some functions relative to their size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tail {
    /// Modes of degree 10 and 11.
    before: f64,
    /// Modes of degree 14 and 15, the last that the nodes resolve.
    last: f64,
}

impl Tail {
    /// Tail of the function zero.
    pub(super) const NONE: Self = Self { before: 0.0, last: 0.0 };

    /// Tail of functions, relative to their size.
    #[inline(always)]
    pub(super) fn new(functionals: Functionals, size: f64) -> Self {
        let largest = |first: usize| {
            let [a, b] = [functionals.0[first].abs(), functionals.0[first + 1].abs()];
            a.max(b) / size.max(LEAST_SIZE)
        };
        Self { before: largest(2), last: largest(4) }
    }

    /// Componentwise maximum.
    #[inline(always)]
    pub(super) fn larger(self, other: Self) -> Self {
        Self { before: self.before.max(other.before), last: self.last.max(other.last) }
    }

    /// Expected size of the first modes that the nodes do not resolve, if the modes fall on as
    /// before.
    fn next(self) -> f64 {
        self.last * (self.last / self.before).sqrt().min(1.0)
    }
}

/// Error estimate of an element: the product of two tails of Legendre modes. See
/// docs/mathematics/flow.md.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Expected next modes of the fundamental matrix, relative to its entries.
    fundamental: f64,
    /// Estimated error at the end, relative to the largest coefficient of the same degree; the
    /// maximum over all degrees.
    pub(super) error: f64,
    /// Largest last Legendre mode relative to the largest coefficient of the same degree.
    tail: f64,
}

/// Largest last Legendre mode for which the error estimate, a product of two modes, is valid.
const RESOLVED: f64 = 1e-4;

/// Factor of a product of two modes in the error: one over the norm of the mode, 33, times the
/// number of neighbours that count as much.
const SHARE: f64 = 0.25;

impl Resolution {
    /// Estimate of the error from the last modes of the fundamental matrix, before any degree of
    /// the jets is [included](Self::include).
    pub(super) fn new(fundamental: Tail) -> Self {
        Self {
            fundamental: fundamental.next().max(f64::EPSILON),
            error: 0.0,
            tail: fundamental.last,
        }
    }

    /// Includes a degree with these modes, whose monomials have up to `factors` factors, each from
    /// the flow or the defect.
    pub(super) fn include(&mut self, factors: usize, tail: Tail) {
        let ways = 2.0_f64.powi(factors as i32);
        self.tail = self.tail.max(tail.last);
        self.error = self.error.max(SHARE * ways * tail.next() * self.fundamental);
    }

    /// Whether the estimate is valid and below a tolerance.
    pub(super) fn meets(self, tolerance: f64) -> bool {
        self.error <= tolerance && self.tail <= RESOLVED
    }
}

/// A square matrix of blocks, row by row; zero blocks are absent.
#[derive(Default)]
struct BlockMatrix {
    dimension: usize,
    blocks: Vec<NodeMatrix>,
    /// Whether each block is present; the content of absent blocks is undefined.
    present: Vec<bool>,
}

impl BlockMatrix {
    /// Makes the matrix zero and keeps its memory.
    pub(super) fn clear(&mut self, dimension: usize) {
        self.dimension = dimension;
        self.blocks.resize(dimension * dimension, NodeMatrix::ZERO);
        self.present.clear();
        self.present.resize(dimension * dimension, false);
    }

    /// A block; `None` if it is zero.
    #[inline(always)]
    pub(super) fn get(&self, row: usize, column: usize) -> Option<&NodeMatrix> {
        let place = row * self.dimension + column;
        self.present[place].then(|| &self.blocks[place])
    }

    /// Makes a block present and returns it, with undefined content.
    #[inline(always)]
    pub(super) fn place(&mut self, row: usize, column: usize) -> &mut NodeMatrix {
        let place = row * self.dimension + column;
        self.present[place] = true;
        &mut self.blocks[place]
    }

    /// Inverts the matrix by block elimination along the diagonal, in the memory of both; `false`
    /// if a pivot is singular.
    #[inline(always)]
    pub(super) fn invert(&mut self, spare: &mut Self) -> bool {
        if let ([block], [true]) = (self.blocks.as_mut_slice(), self.present.as_slice()) {
            return block.invert();
        }
        spare.clear(self.dimension);
        for row in 0..self.dimension {
            *spare.place(row, row) = NodeMatrix::IDENTITY;
        }
        let is_regular = self.eliminate(spare);
        std::mem::swap(self, spare);
        is_regular
    }

    /// Turns this matrix `A` into the identity and the other matrix `B` into `A⁻¹ B`.
    #[inline(always)]
    fn eliminate(&mut self, other: &mut Self) -> bool {
        for pivot in 0..self.dimension {
            let Some(mut scale) = self.get(pivot, pivot).copied() else {
                return false;
            };
            if !scale.invert() {
                return false;
            }
            self.scale_row(pivot, &scale, pivot + 1);
            other.scale_row(pivot, &scale, 0);
            for row in (0..self.dimension).filter(|&row| row != pivot) {
                if let Some(factor) = self.get(row, pivot).copied() {
                    self.subtract_row(row, pivot, &factor, pivot + 1);
                    other.subtract_row(row, pivot, &factor, 0);
                }
            }
        }
        true
    }

    /// `row = factor · row` in the columns from `first` on.
    #[inline(always)]
    fn scale_row(&mut self, row: usize, factor: &NodeMatrix, first: usize) {
        for column in first..self.dimension {
            if let Some(product) = self.get(row, column).map(|block| factor.times(block)) {
                *self.place(row, column) = product;
            }
        }
    }

    /// `row −= factor · pivot` in the columns from `first` on.
    #[inline(always)]
    fn subtract_row(&mut self, row: usize, pivot: usize, factor: &NodeMatrix, first: usize) {
        for column in first..self.dimension {
            if let Some(block) = self.get(pivot, column) {
                let product = factor.times(block);
                if self.get(row, column).is_none() {
                    *self.place(row, column) = NodeMatrix::ZERO;
                }
                self.place(row, column).subtract(&product);
            }
        }
    }
}
