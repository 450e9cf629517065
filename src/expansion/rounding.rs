//! Coefficients of a contact that are nothing but rounding.
//!
//! One idea: what vanishes in exact arithmetic stands in a double-double expansion as some 1e-32 of the terms it is a difference of.
//! Such a coefficient comes and goes with every change of the arithmetic, changes no image, and costs an operation in every step.

use super::Contact;
use super::variables::Variables;
use crate::jet::Jet;
use crate::numeric::{Dd, Scalar};

/// Coefficients below this share of the largest of their degree are rounding: double-double has 2^-104, 5e-32, and expansions lose a
/// digit or two of it; one of double precision, 1e-16, is far above.
const SHARE: f64 = 1e-28;

/// Weighted degrees above and below among which the largest is looked for: where all terms of a degree vanish, what they are differences
/// of is seen in those beside it. A soft stop's law begins with `y³`, so that those of `y` and `y²` are such.
const BESIDE: usize = 2;

/// What variables deviate from: sizes in which coefficients of one degree can be compared.
#[derive(Clone, Debug)]
pub(super) struct Sizes {
    /// Of the depth variable.
    pub(super) depth: f64,
    /// Of the coordinates, then of the parameters.
    pub(super) variables: Vec<f64>,
}

/// The contact without coefficients that are rounding: those that, in sizes of the variables and of the coordinate that they
/// correct, are less than 1e-28 of the largest within two weighted degrees of their own.
pub(super) fn without_rounding(
    mut contact: Contact<Dd>,
    variables: &Variables,
    sizes: &Sizes,
) -> Contact<Dd> {
    let depth = Part {
        power: 0,
        size: sizes.depth * sizes.depth,
        jet: &mut contact.depth,
    };
    clear(&mut [depth], variables, sizes);
    let part = |power: u32| move |(jet, &size)| Part { power, size, jet };
    let linear = contact.linear.iter_mut().zip(&sizes.variables);
    let quadratic = contact.quadratic.iter_mut().zip(&sizes.variables);
    let mut corrections: Vec<Part<'_>> = linear.map(part(1)).collect();
    corrections.extend(quadratic.map(part(2)));
    clear(&mut corrections, variables, sizes);
    contact
}

/// A polynomial that is multiplied by a power of the depth variable.
struct Part<'a> {
    power: u32,
    /// Of the quantity that it is part of.
    size: f64,
    jet: &'a mut Jet<Dd>,
}

impl Part<'_> {
    /// Weighted degree and size of every term.
    fn terms(&self, variables: &Variables, sizes: &Sizes) -> Vec<(usize, f64)> {
        let factor = sizes.depth.powi(self.power as i32) / self.size;
        let term = |(exponents, value): (&[u8], Dd)| {
            let pairs = exponents.iter().zip(&variables.weights);
            let degree: u32 = pairs
                .map(|(&power, weight)| u32::from(power) * weight)
                .sum();
            let pairs = exponents.iter().zip(&sizes.variables);
            let monomial: f64 = pairs
                .map(|(&power, size)| size.powi(i32::from(power)))
                .product();
            let size = value.magnitude() * monomial * factor;
            ((degree + self.power) as usize, size)
        };
        self.jet.terms().map(term).collect()
    }
}

/// Sets to zero what is rounding in polynomials that are expanded together.
fn clear(parts: &mut [Part<'_>], variables: &Variables, sizes: &Sizes) {
    let terms: Vec<Vec<(usize, f64)>> = parts
        .iter()
        .map(|part| part.terms(variables, sizes))
        .collect();
    let highest = terms.iter().flatten().map(|term| term.0).max().unwrap_or(0);
    let mut largest = vec![0.0f64; highest + 1];
    for &(degree, size) in terms.iter().flatten() {
        let beside = degree.saturating_sub(BESIDE)..=(degree + BESIDE).min(highest);
        for reached in &mut largest[beside] {
            *reached = reached.max(size);
        }
    }
    for (part, terms) in parts.iter_mut().zip(&terms) {
        let coefficients = part.jet.coefficients_mut().iter_mut();
        for (coefficient, &(degree, size)) in coefficients.zip(terms) {
            if size < SHARE * largest[degree] {
                *coefficient = Dd::from(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One coordinate and one parameter, with sizes of 1e-3 and 10.
    fn contact(linear: [f64; 3], quadratic: [f64; 3]) -> (Contact<Dd>, Variables, Sizes) {
        let variables = Variables {
            names: vec!["x".into(), "p".into()],
            weights: vec![2, 2],
            coordinates: 1,
        };
        let space = variables.smooth_space(2).unwrap();
        let jet = |coefficients: [f64; 3]| {
            Jet::from_coefficients(&space, coefficients.map(Dd::from).to_vec())
        };
        let contact = Contact {
            depth: jet([0.0, 1.0, 1e-31]),
            linear: vec![jet(linear)],
            quadratic: vec![jet(quadratic)],
        };
        let sizes = Sizes {
            depth: 0.1,
            variables: vec![1e-3, 10.0],
        };
        (contact, variables, sizes)
    }

    fn cleared(linear: [f64; 3], quadratic: [f64; 3]) -> Contact {
        let (contact, variables, sizes) = contact(linear, quadratic);
        without_rounding(contact, &variables, &sizes).to_f64()
    }

    #[test]
    fn what_is_rounding_beside_the_law_is_zero_and_the_rest_is_as_it_was() {
        // In sizes y, y x and y p are 1e-31, 1 and 1e-31 of the coordinate's, y² x is 1e-22.
        let found = cleared([1e-33, 10.0, 1e-34], [0.0, 1e-20, 0.0]);
        assert_eq!(found.linear[0].coefficients(), [0.0, 10.0, 0.0]);
        assert_eq!(found.quadratic[0].coefficients(), [0.0, 1e-20, 0.0]);
        // Of the depth's size x is a tenth and p 1e-28.
        assert_eq!(found.depth.coefficients(), [0.0, 1.0, 1e-31]);
    }

    #[test]
    fn coefficients_are_compared_in_sizes() {
        // With the parameter's size a coefficient of 1e-30 is 1e-26 of the other's.
        let found = cleared([0.0, 1.0, 1e-30], [0.0; 3]);
        assert_eq!(found.linear[0].coefficients(), [0.0, 1.0, 1e-30]);
        let found = cleared([0.0, 1.0, 1e-33], [0.0; 3]);
        assert_eq!(found.linear[0].coefficients(), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn small_laws_of_their_own_stay() {
        let found = cleared([1e-40, 0.0, 0.0], [1e-41, 0.0, 0.0]);
        assert_eq!(found.linear[0].coefficients()[0], 1e-40);
        assert_eq!(found.quadratic[0].coefficients()[0], 1e-41);
    }
}
