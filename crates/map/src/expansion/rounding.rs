//! Coefficients of a contact that are nothing but rounding.
//!
//! One idea: a coefficient that is zero in exact arithmetic is in double-double some 1e-32 of
//! the terms it is a difference of, and those are seen at the same monomial in the other
//! corrections, or where it has one more factor. Such a coefficient comes and goes with every
//! change of the arithmetic, changes no image, and costs an operation in every step.

use std::iter;
use std::sync::Arc;

use super::local_map::Contact;
use crate::jet::Jet;
use crate::numeric::{Dd, Scalar};

/// Coefficients below this share of what they are compared with are rounding: double-double has
/// 2^-104, 5e-32, and expansions lose a digit or two of it; one of double precision, 1e-16, is far
/// above.
const SHARE: f64 = 1e-28;

/// Sizes of the variables, in which coefficients can be compared.
#[derive(Clone, Debug)]
pub(super) struct Sizes {
    /// Size of the depth variable.
    pub(super) depth: f64,
    /// Sizes of the coordinates, then of the parameters.
    pub(super) variables: Vec<f64>,
}

impl Sizes {
    /// The sizes with that of the depth variable as the first variable's.
    fn with_depth(&self) -> Self {
        let variables = iter::once(&self.depth).chain(&self.variables);
        Self { depth: self.depth, variables: variables.copied().collect() }
    }
}

/// The contact without coefficients that are rounding: those that, in sizes of the variables and of
/// the coordinate that they correct, are less than 1e-28 of the largest of their monomial, or of it
/// times one variable, in any coordinate and power of `y` (of `y` as one of the variables in the
/// depth form).
///
/// NOTE: monomials farther apart are not compared. Where a contact is stiff the coefficients of
/// high powers of one variable exceed those of another by more than double-double has digits.
pub(super) fn without_rounding(mut contact: Contact<Dd>, sizes: &Sizes) -> Contact<Dd> {
    let depth = Part { factor: 1.0, jet: &mut contact.depth };
    clear(&mut [depth], sizes);
    let linear = contact.linear.iter_mut().zip(&sizes.variables);
    let linear = linear.map(|(jet, size)| Part { factor: sizes.depth / size, jet });
    let quadratic = contact.quadratic.iter_mut().zip(&sizes.variables);
    let quadratic =
        quadratic.map(|(jet, size)| Part { factor: sizes.depth * sizes.depth / size, jet });
    // The first has all the monomials that the others have.
    clear(&mut linear.chain(quadratic).collect::<Vec<_>>(), sizes);
    if let Some(form) = contact.depth_form.as_mut().map(Arc::make_mut) {
        let corrections = form.corrections.iter_mut().zip(&sizes.variables);
        let corrections = corrections.map(|(jet, size)| Part { factor: 1.0 / size, jet });
        clear(&mut corrections.collect::<Vec<_>>(), &sizes.with_depth());
    }
    contact
}

/// A polynomial, and what its coefficients are multiplied by to be compared with those of others.
struct Part<'a> {
    factor: f64,
    jet: &'a mut Jet<Dd>,
}

impl Part<'_> {
    /// Powers and size of every term.
    fn terms(&self, sizes: &Sizes) -> Vec<(Vec<u8>, f64)> {
        let term = |(powers, value): (&[u8], Dd)| {
            let pairs = powers.iter().zip(&sizes.variables);
            let monomial: f64 = pairs.map(|(&power, size)| size.powi(i32::from(power))).product();
            (powers.to_vec(), value.magnitude() * monomial * self.factor)
        };
        self.jet.terms().map(term).collect()
    }
}

/// Sets to zero what is rounding in polynomials that are expanded together.
fn clear(parts: &mut [Part<'_>], sizes: &Sizes) {
    let Some(first) = parts.first() else { return };
    let space = first.jet.space().clone();
    let terms: Vec<_> = parts.iter().map(|part| part.terms(sizes)).collect();
    let mut largest = vec![0.0f64; space.len()];
    let mut raise = |powers: &[u8], size: f64| {
        if let Some(monomial) = space.monomial(powers) {
            largest[monomial] = largest[monomial].max(size);
        }
    };
    for (powers, size) in terms.iter().flatten() {
        raise(powers, *size);
        for variable in 0..powers.len() {
            let mut fewer = powers.clone();
            if let Some(power) = fewer[variable].checked_sub(1) {
                fewer[variable] = power;
                raise(&fewer, *size);
            }
        }
    }
    for (part, terms) in parts.iter_mut().zip(&terms) {
        let coefficients = part.jet.coefficients_mut().iter_mut();
        for (coefficient, (powers, size)) in coefficients.zip(terms) {
            let monomial = space.monomial(powers);
            if monomial.is_some_and(|monomial| *size < SHARE * largest[monomial]) {
                *coefficient = Dd::from(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expansion::DepthForm;
    use crate::jet::JetSpace;

    /// One coordinate and one parameter, with sizes of 1e-3 and 10: coefficients of 1, x and p of
    /// what `y` and `y²` are multiplied by, and of a depth.
    fn cleared(linear: [f64; 3], quadratic: [f64; 3], depth: [f64; 3]) -> [Vec<f64>; 3] {
        let space = JetSpace::uniform(2, 1).unwrap();
        let jet = |coefficients: [f64; 3]| {
            Jet::from_coefficients(&space, coefficients.map(Dd::from).to_vec())
        };
        let contact = Contact {
            depth: jet(depth),
            linear: vec![jet(linear)],
            quadratic: vec![jet(quadratic)],
            depth_form: None,
        };
        let sizes = Sizes { depth: 0.1, variables: vec![1e-3, 10.0] };
        let found = without_rounding(contact, &sizes).to_f64();
        [&found.linear[0], &found.quadratic[0], &found.depth].map(|jet| jet.coefficients().to_vec())
    }

    #[test]
    fn what_is_rounding_beside_the_law_is_zero_and_the_rest_is_as_it_was() {
        // In sizes: y 1e-31 of the coordinate, y x and y p are 1; y² 1e-32, y² x 1e-31, y² p 1e-27.
        let found = cleared([1e-33, 10.0, 1e-3], [1e-33, 1e-29, 1e-29], [0.0; 3]);
        assert_eq!(found[0], [0.0, 10.0, 1e-3]);
        assert_eq!(found[1], [0.0, 0.0, 1e-29]);
    }

    #[test]
    fn the_depth_form_loses_its_rounding_too() {
        let space = JetSpace::uniform(3, 2).unwrap();
        let monomials =
            [[1, 0, 0], [1, 1, 0], [1, 0, 1]].map(|powers| space.monomial(&powers).unwrap());
        let correction = |values: [f64; 3]| {
            let mut jet = Jet::zero(&space);
            for (monomial, value) in monomials.into_iter().zip(values) {
                jet.coefficients_mut()[monomial] = Dd::from(value);
            }
            jet
        };
        // In sizes: y 1e-27, y u 1 and y v 1e-27 of the first coordinate; y 1e-29 and y u 1e-30 of
        // the second.
        let corrections = vec![correction([1e-29, 10.0, 1e-30]), correction([1e-27, 1e-25, 0.0])];
        let flat = Jet::zero(&JetSpace::uniform(2, 1).unwrap());
        let contact = Contact {
            depth: flat.clone(),
            linear: vec![flat.clone(), flat.clone()],
            quadratic: vec![flat.clone(), flat],
            depth_form: Some(Arc::new(DepthForm { replaced: 0, corrections })),
        };
        let sizes = Sizes { depth: 0.1, variables: vec![1e-3, 10.0] };
        let form = without_rounding(contact, &sizes).depth_form.unwrap();
        let found = [0, 1].map(|coordinate| {
            let coefficients = form.corrections[coordinate].coefficients();
            monomials.map(|monomial| coefficients[monomial].to_f64())
        });
        assert_eq!(found, [[1e-29, 10.0, 1e-30], [0.0; 3]]);
    }

    #[test]
    fn monomials_of_different_variables_are_not_compared() {
        let found = cleared([0.0, 1e40, 1.0], [0.0; 3], [0.0, 1e40, 1.0]);
        assert_eq!(found[0], [0.0, 1e40, 1.0]);
        assert_eq!(found[2], [0.0, 1e40, 1.0]);
    }

    #[test]
    fn small_laws_of_their_own_stay() {
        let found = cleared([1e-40, 0.0, 0.0], [1e-41, 0.0, 0.0], [0.0, 1e-40, 0.0]);
        assert_eq!(found[0][0], 1e-40);
        assert_eq!(found[1][0], 1e-41);
        assert_eq!(found[2][1], 1e-40);
    }
}
