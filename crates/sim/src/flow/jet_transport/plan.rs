//! Plan of the operations of each degree with the state's own part left out, made once.
//!
//! One idea: sums and multiples of zero parts are zero, and a sum with a zero part is its other
//! term, so that most linear operations need not be run. The part of a slot is zero, that of
//! another slot, or its own. Only slots that own a part, or whose lower parts a recurrence reads,
//! are stored.

use std::sync::Arc;

use crate::flow::program::Operation;
use crate::flow::{Field, Program};
use crate::jet::{JetSpace, VariableSet, variables_of_monomial};

/// One action of a degree; slots are given by their places among the stored ones.
#[derive(Clone, Debug)]
pub(super) enum Action {
    /// Run an operation whose result is stored in a place.
    Run {
        operation: Operation,
        place: usize,
        /// Whether all operands are in places before its own, or are its own part of a lower
        /// degree.
        reads_before: bool,
    },
    /// Copy a part from a place to one where recurrences of higher degrees read it.
    Copy { from: usize, place: usize },
    /// Set a part to zero for the recurrences of higher degrees.
    Clear { place: usize },
}

/// The actions of all degrees.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// Stored slots, in the order of their places.
    pub(super) stored: Vec<usize>,
    /// Whether a recurrence reads lower parts of each place.
    pub(super) history: Vec<bool>,
    /// Actions, by degree.
    pub(super) actions: Vec<Vec<Action>>,
    /// By degree and component: place of the remainder of its rate; `None` if it vanishes.
    pub(super) remainders: Vec<Vec<Option<usize>>>,
}

impl Plan {
    /// Plans all degrees up to an order. `reaches(slot, degree)` tells whether a slot can have a
    /// part of the degree; for an input that is a parameter, whether it has one.
    pub(super) fn new(
        program: &Program,
        dimension: usize,
        order: usize,
        reaches: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let mut history = vec![false; program.slots()];
        for slot in program.inputs()..program.slots() {
            for read in program.operation(slot).history(slot) {
                history[read] = true;
            }
        }
        let degree = |degree| DegreePlan::new(program, dimension, &history, |s| reaches(s, degree));
        let degrees: Vec<_> = (0..=order).map(degree).collect();
        let owned = |slot: usize| degrees.iter().any(|plan| plan.owned[slot]);
        let is_stored = |&slot: &usize| slot < program.inputs() || history[slot] || owned(slot);
        let stored: Vec<_> = (0..program.slots()).filter(is_stored).collect();
        let place =
            |slot: usize| stored.binary_search(&slot).expect("what is read in place is stored");
        let remainder = |plan: &DegreePlan, component: usize| {
            plan.sources[program.output(component)].map(place)
        };
        Self {
            history: stored.iter().map(|&slot| history[slot]).collect(),
            actions: degrees.iter().map(|plan| plan.actions(place)).collect(),
            remainders: degrees
                .iter()
                .map(|plan| (0..dimension).map(|c| remainder(plan, c)).collect())
                .collect(),
            stored,
        }
    }
}

/// Actions of one degree, on slots.
struct DegreePlan {
    actions: Vec<Action>,
    /// Slot that holds each slot's part; `None` if the part vanishes.
    sources: Vec<Option<usize>>,
    owned: Vec<bool>,
}

impl DegreePlan {
    fn new(
        program: &Program,
        dimension: usize,
        history: &[bool],
        reaches: impl Fn(usize) -> bool,
    ) -> Self {
        let mut plan = Self {
            actions: Vec::new(),
            sources: vec![None; program.slots()],
            owned: vec![false; program.slots()],
        };
        for slot in (0..program.slots()).filter(|&slot| reaches(slot)) {
            if slot >= dimension && slot < program.inputs() {
                plan.sources[slot] = Some(slot);
            } else if slot >= program.inputs() {
                plan.sources[slot] = plan.source(*program.operation(slot), slot);
            }
            let action = match plan.sources[slot] {
                Some(source) if source == slot => continue,
                Some(from) => Action::Copy { from, place: slot },
                None => Action::Clear { place: slot },
            };
            if history[slot] {
                plan.actions.push(action);
            }
        }
        plan
    }

    /// Slot that holds the part of `slot`; its operation is added to the actions if it must be run.
    fn source(&mut self, operation: Operation, slot: usize) -> Option<usize> {
        let operation = match operation {
            Operation::Constant(_) | Operation::Sign(_) | Operation::Balance(..) => return None,
            Operation::AddConstant(a, _) => return self.sources[a],
            Operation::Add(a, b) => match (self.sources[a], self.sources[b]) {
                (None, source) | (source, None) => return source,
                (Some(a), Some(b)) => Operation::Add(a, b),
            },
            Operation::Sub(a, b) => match (self.sources[a], self.sources[b]) {
                (source, None) => return source,
                (None, Some(b)) => Operation::Neg(b),
                (Some(a), Some(b)) => Operation::Sub(a, b),
            },
            Operation::Neg(a) => Operation::Neg(self.sources[a]?),
            Operation::Scale(a, factor) => Operation::Scale(self.sources[a]?, factor),
            Operation::Euler(a) => Operation::Euler(self.sources[a]?),
            Operation::SignTimes { a, b } => Operation::SignTimes { a, b: self.sources[b]? },
            nonlinear => nonlinear,
        };
        self.owned[slot] = true;
        let mut read = operation.history(slot);
        read.extend(operation.operands());
        self.actions.push(Action::Run {
            operation,
            place: slot,
            reads_before: read.iter().all(|&read| read <= slot),
        });
        Some(slot)
    }

    /// Actions with slots renamed to places.
    fn actions(&self, place_of: impl Fn(usize) -> usize + Copy) -> Vec<Action> {
        let renamed = |action: &Action| match *action {
            Action::Run { operation, place, reads_before } => Action::Run {
                operation: operation.renamed(place_of),
                place: place_of(place),
                reads_before,
            },
            Action::Copy { from, place } => {
                Action::Copy { from: place_of(from), place: place_of(place) }
            }
            Action::Clear { place } => Action::Clear { place: place_of(place) },
        };
        self.actions.iter().map(renamed).collect()
    }
}

/// Set of monomials in which an element can differ from zero: those of some variables, up to a
/// degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) variables: VariableSet,
    pub(super) degree: usize,
}

impl Reach {
    /// Smallest reach that includes both.
    pub(super) fn or(self, other: Self) -> Self {
        Self { variables: self.variables | other.variables, degree: self.degree.max(other.degree) }
    }
}

/// Key of an element: a field, a space of jets, and the parts that the inputs have.
pub(super) struct CacheKey {
    pub(super) program: Program,
    pub(super) dimension: usize,
    pub(super) space: Arc<JetSpace>,
    pub(super) inputs: Inputs,
}

/// Coefficients of the inputs, states and parameters that differ from zero.
#[derive(PartialEq)]
pub(super) struct Inputs {
    /// Variables that occur in each input.
    variables: Vec<VariableSet>,
    /// Whether each input has a part of each degree, input by input.
    parts: Vec<bool>,
    degrees: usize,
}

impl Inputs {
    /// Nonzero coefficients of inputs that are given as coefficients.
    pub(super) fn new<'a>(space: &JetSpace, inputs: impl Iterator<Item = &'a [f64]>) -> Self {
        let degrees = space.order() + 1;
        let (mut variables, mut parts) = (Vec::new(), Vec::new());
        for coefficients in inputs {
            let mut set = 0;
            for monomials in (0..degrees).map(|degree| space.degree_range(degree)) {
                // NOTE: most parts vanish, which one test of a whole part finds faster than tests
                // one by one.
                let is_present = |value: &f64| *value != 0.0;
                let part = coefficients[monomials.clone()].iter();
                let has_part = part.fold(false, |any, value| any | is_present(value));
                parts.push(has_part);
                if has_part {
                    let present = monomials.filter(|&m| is_present(&coefficients[m]));
                    let sets = present.map(|monomial| variables_of_monomial(space, monomial));
                    set |= sets.fold(0, |a, b| a | b);
                }
            }
            variables.push(set);
        }
        Self { variables, parts, degrees }
    }

    /// Monomials in which an input can differ from zero.
    pub(super) fn reach(&self, input: usize) -> Reach {
        let degrees = 0..self.degrees;
        let last = degrees.rev().find(|&degree| self.has_part(input, degree));
        Reach { variables: self.variables[input], degree: last.unwrap_or(0) }
    }

    /// Whether an input has a part of a degree.
    pub(super) fn has_part(&self, input: usize, degree: usize) -> bool {
        self.parts[input * self.degrees + degree]
    }
}

impl CacheKey {
    /// Key of a field and inputs.
    pub(super) fn new(field: &Field, space: &Arc<JetSpace>, inputs: Inputs) -> Self {
        Self {
            program: field.program().clone(),
            dimension: field.dimension(),
            space: Arc::clone(space),
            inputs,
        }
    }

    /// Largest number of factors of a monomial of a degree.
    pub(super) fn factors(&self, degree: usize) -> usize {
        let weights = self.space.weights().iter();
        degree / weights.min().map_or(1, |&weight| weight as usize)
    }

    /// Whether the key is that of a field and inputs.
    pub(super) fn is(&self, field: &Field, space: &Arc<JetSpace>, inputs: &Inputs) -> bool {
        self.space.keeps_the_same(space)
            && self.dimension == field.dimension()
            && self.inputs == *inputs
            && self.program == *field.program()
    }
}
