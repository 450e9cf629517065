//! Nested Horner schedules of sparse multivariate polynomials.

use super::{KernelBuilder, Value};
use crate::jet::Jet;

/// A polynomial as nested Horner schemes: in the first variable, with coefficients that are Horner
/// schemes in the second, and so on.
///
/// A polynomial with `M` terms that fill a simplex costs `M − 1` multiply-adds; gaps between powers
/// are bridged by powers of the variable, which all polynomials of a kernel share. Variables that
/// are to be frozen stand last: then everything that depends on them alone is a coefficient of the
/// others.
#[derive(Clone, Debug, PartialEq)]
pub struct HornerPlan {
    variables: usize,
    root: Scheme,
}

#[derive(Clone, Debug, PartialEq)]
enum Scheme {
    Constant(f64),
    /// Coefficients of powers of one variable, highest power first.
    Powers {
        variable: usize,
        coefficients: Vec<(u8, Scheme)>,
    },
}

impl HornerPlan {
    /// Plans a polynomial given by its non-zero terms, exponents and coefficient, in any order.
    pub fn new<'a>(variables: usize, terms: impl IntoIterator<Item = (&'a [u8], f64)>) -> Self {
        let mut terms: Vec<(&[u8], f64)> =
            terms.into_iter().filter(|&(_, coefficient)| coefficient != 0.0).collect();
        terms.sort_by(|(left, _), (right, _)| right.cmp(left));
        Self { variables, root: scheme(&terms, 0, variables) }
    }

    /// Plans a jet, read as a polynomial.
    pub fn of_jet(jet: &Jet<f64>) -> Self {
        Self::new(jet.space().variables(), jet.terms())
    }

    /// Appends the evaluation at `point` (one value per variable) to a kernel.
    pub fn lower(&self, builder: &mut KernelBuilder, point: &[Value]) -> Value {
        assert_eq!(point.len(), self.variables, "a point has one value per variable");
        lower(&self.root, builder, point)
    }
}

/// The scheme of terms that agree in the exponents before `variable`, sorted by descending
/// exponents.
fn scheme(terms: &[(&[u8], f64)], variable: usize, variables: usize) -> Scheme {
    if variable == variables || terms.is_empty() {
        return Scheme::Constant(terms.iter().map(|&(_, coefficient)| coefficient).sum());
    }
    let groups = terms.chunk_by(|(left, _), (right, _)| left[variable] == right[variable]);
    let coefficients: Vec<(u8, Scheme)> = groups
        .map(|group| (group[0].0[variable], scheme(group, variable + 1, variables)))
        .collect();
    match <[(u8, Scheme); 1]>::try_from(coefficients) {
        Ok([(0, only)]) => only,
        Ok(single) => Scheme::Powers { variable, coefficients: single.into() },
        Err(coefficients) => Scheme::Powers { variable, coefficients },
    }
}

fn lower(scheme: &Scheme, builder: &mut KernelBuilder, point: &[Value]) -> Value {
    let (variable, coefficients) = match scheme {
        Scheme::Constant(value) => return builder.constant(*value),
        Scheme::Powers { variable, coefficients } => (*variable, coefficients),
    };
    let (mut power, first) = (coefficients[0].0, &coefficients[0].1);
    let mut sum = lower(first, builder, point);
    for (lower_power, coefficient) in &coefficients[1..] {
        let coefficient = lower(coefficient, builder, point);
        let gap = lower_gap(builder, point[variable], power - lower_power);
        sum = builder.multiply_add(sum, gap, coefficient);
        power = *lower_power;
    }
    let rest = lower_gap(builder, point[variable], power);
    builder.multiply(sum, rest)
}

/// `base^exponent` by repeated squaring: at most `2 log₂ exponent` products.
fn lower_gap(builder: &mut KernelBuilder, base: Value, exponent: u8) -> Value {
    match exponent {
        0 => builder.constant(1.0),
        1 => base,
        even if even % 2 == 0 => {
            let root = lower_gap(builder, base, even / 2);
            builder.multiply(root, root)
        }
        odd => {
            let rest = lower_gap(builder, base, odd - 1);
            builder.multiply(rest, base)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;
    use crate::jet::kernel::Interpreter;

    fn kernel_of(plan: &HornerPlan) -> super::super::Kernel {
        let mut builder = KernelBuilder::new(plan.variables);
        let point: Vec<Value> =
            (0..plan.variables).map(|position| builder.input(position)).collect();
        let value = plan.lower(&mut builder, &point);
        builder.finish(vec![value])
    }

    #[test]
    fn integer_polynomials_are_exact() {
        let terms: [(&[u8], f64); 4] =
            [(&[3, 1], 2.0), (&[1, 0], -1.0), (&[0, 4], 5.0), (&[0, 0], 7.0)];
        let kernel = kernel_of(&HornerPlan::new(2, terms));
        let (x, y) = (3.0f64, -2.0f64);
        let expected = 2.0 * x.powi(3) * y - x + 5.0 * y.powi(4) + 7.0;
        assert_eq!(Interpreter::new(&kernel).evaluate(&[x, y]), [expected]);
    }

    #[test]
    fn a_full_polynomial_costs_a_multiply_add_per_term_but_one() {
        let space = JetSpace::uniform(3, 5).unwrap();
        let coefficients = (0..space.len()).map(|number| 2.0 + number as f64).collect();
        let kernel = kernel_of(&HornerPlan::of_jet(&Jet::from_coefficients(&space, coefficients)));
        assert_eq!(kernel.count().multiply_adds, space.len() - 1);
        assert_eq!(kernel.count().total(), space.len() - 1);
    }

    #[test]
    fn the_empty_polynomial_is_zero() {
        let kernel = kernel_of(&HornerPlan::new(2, []));
        assert_eq!(Interpreter::new(&kernel).evaluate(&[1.0, 1.0]), [0.0]);
    }
}
