//! What an element is prepared for: all that its memory and its plan depend on.

use std::sync::Arc;

use crate::flow::{Field, Program};
use crate::jet::{JetSpace, VariableSet, variables_of_monomial};

/// A field, a space of jets, and which parts the inputs have.
pub(super) struct Subject {
    pub(super) program: Program,
    pub(super) dimension: usize,
    pub(super) space: Arc<JetSpace>,
    pub(super) inputs: Inputs,
}

/// Which coefficients of the inputs, states and parameters, differ from zero.
#[derive(PartialEq)]
pub(super) struct Inputs {
    /// Variables that occur in each input.
    pub(super) variables: Vec<VariableSet>,
    /// Whether there is a part of each degree, input by input.
    parts: Vec<bool>,
    degrees: usize,
}

impl Inputs {
    /// Those of inputs given as coefficients.
    pub(super) fn new<'a>(space: &JetSpace, inputs: impl Iterator<Item = &'a [f64]>) -> Self {
        let degrees = space.order() + 1;
        let (mut variables, mut parts) = (Vec::new(), Vec::new());
        for coefficients in inputs {
            let mut set = 0;
            for degree in 0..degrees {
                let monomials = space.degree_range(degree);
                let present = monomials.filter(|&monomial| coefficients[monomial] != 0.0);
                let mut sets = present.map(|monomial| variables_of_monomial(space, monomial));
                let first = sets.next();
                parts.push(first.is_some());
                set |= sets.fold(first.unwrap_or(0), |a, b| a | b);
            }
            variables.push(set);
        }
        Self {
            variables,
            parts,
            degrees,
        }
    }

    /// Whether an input has a part of a degree.
    pub(super) fn has_part(&self, input: usize, degree: usize) -> bool {
        self.parts[input * self.degrees + degree]
    }
}

impl Subject {
    /// That of a field and inputs.
    pub(super) fn new(field: &Field, space: &Arc<JetSpace>, inputs: Inputs) -> Self {
        Self {
            program: field.program().clone(),
            dimension: field.dimension(),
            space: Arc::clone(space),
            inputs,
        }
    }

    /// Most factors of a monomial of a degree.
    pub(super) fn factors(&self, degree: usize) -> usize {
        let weights = self.space.weights().iter();
        degree / weights.min().map_or(1, |&weight| weight as usize)
    }

    /// Whether it is that of a field and inputs.
    pub(super) fn is(&self, field: &Field, space: &Arc<JetSpace>, inputs: &Inputs) -> bool {
        self.space.keeps_the_same(space)
            && self.dimension == field.dimension()
            && self.inputs == *inputs
            && self.program == *field.program()
    }
}
