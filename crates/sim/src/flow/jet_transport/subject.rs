//! What an element is prepared for: all that its memory and its plan depend on.

use std::sync::Arc;

use super::sparse::Reach;
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
    variables: Vec<VariableSet>,
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
            for monomials in (0..degrees).map(|degree| space.degree_range(degree)) {
                // NOTE: most parts vanish, which all at once is seen faster than one by one.
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

    /// The monomials in which an input can differ from zero.
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
