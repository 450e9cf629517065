//! Equations whose unknowns are jets: implicit functions and linear systems.
//!
//! One idea: a Newton step in a ring of jets doubles the number of correct degrees, as it doubles
//! the number of correct digits of a number. Starting from a root of the heads, `⌈log₂(order + 1)⌉`
//! steps give all degrees. Its linear systems are solved by elimination, with pivots chosen by
//! their heads.
//!
//! A power series in a jet, `Σ_k c_k t^k`, is summed by Horner's rule. The partial sum that is
//! still to be multiplied by `t^k` is needed only up to the order minus `k` times the lowest degree
//! of `t`, and vanishes below a degree of its own. Most of the products are therefore short: for
//! `t` of degree 1 they cost a fraction of full products, about one over the number of variables.

use super::{Jet, JetError};
use crate::numeric::Scalar;

/// Steps beyond the doublings of degree: for a start whose head is not yet a root, and for
/// rounding.
const EXTRA_STEPS: usize = 24;

/// Root `t` of `f(t) = 0` near `start`, a jet; `f` gives the value and the derivative by `t`.
///
/// The head of `start` should be a root of the equation of heads. The same steps improve a head
/// that is only near a root.
///
/// # Errors
///
/// [`JetError::Singular`] if the head of the derivative is 0 (in some lane),
/// [`JetError::NotFinite`] if a value is not finite, and [`JetError::NoConvergence`] if the steps
/// do not become small.
///
/// ```
/// use grazemap_jet::jet::{implicit_root, Jet, JetSpace};
/// let x = Jet::variable(&JetSpace::uniform(1, 4)?, 0, 0.0_f64);
/// // Lambert's function: w exp(w) = x.
/// let w = implicit_root(&x, |w| {
///     let exp = w.exp();
///     (&(w * &exp) - &x, &w.add_constant(1.0) * &exp)
/// })?;
/// let known = [0.0, 1.0, -1.0, 1.5, -8.0 / 3.0];
/// assert!(w.coefficients().iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-14));
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
pub fn implicit_root<S: Scalar>(
    start: &Jet<S>,
    mut f: impl FnMut(&Jet<S>) -> (Jet<S>, Jet<S>),
) -> Result<Jet<S>, JetError> {
    let roots = implicit_roots(std::slice::from_ref(start), |roots| {
        let (value, derivative) = f(&roots[0]);
        (vec![value], vec![vec![derivative]])
    })?;
    Ok(roots.into_iter().next().expect("one start gives one root"))
}

/// Roots `t` of `f(t) = 0` near `start`, several jets; `f` gives the values and the rows of the
/// Jacobian matrix.
///
/// # Errors
///
/// The errors of [`implicit_root`], and [`JetError::DimensionMismatch`] if the numbers of values
/// and unknowns differ.
pub fn implicit_roots<S: Scalar>(
    start: &[Jet<S>],
    mut f: impl FnMut(&[Jet<S>]) -> (Vec<Jet<S>>, Vec<Vec<Jet<S>>>),
) -> Result<Vec<Jet<S>>, JetError> {
    let mut roots = start.to_vec();
    let Some(first) = start.first() else {
        return Ok(roots);
    };
    let doublings = (first.space().order() + 1).next_power_of_two().ilog2() as usize;
    let mut last_change = f64::INFINITY;
    for step in 0..doublings + EXTRA_STEPS {
        let (values, jacobian) = f(&roots);
        if values.len() != roots.len() {
            return Err(JetError::DimensionMismatch { expected: roots.len(), found: values.len() });
        }
        let changes = solve_linear(jacobian, values)?;
        roots.iter_mut().zip(&changes).for_each(|(root, change)| *root -= change);
        if !roots.iter().all(Jet::is_finite) {
            return Err(JetError::NotFinite { step });
        }
        let change = largest_change(&changes, &roots);
        // NOTE: rounding keeps the change above 0; the steps end when it is small and no longer
        // falls.
        let settled = change <= 4.0 * S::ROUNDOFF
            || (change < S::ROUNDOFF.sqrt() && change > 0.5 * last_change);
        if step + 1 >= doublings && settled {
            return Ok(roots);
        }
        last_change = change;
    }
    Err(JetError::NoConvergence { steps: doublings + EXTRA_STEPS, change: last_change })
}

/// Largest change of a degree relative to that degree's largest coefficient so far, over all
/// unknowns.
fn largest_change<S: Scalar>(changes: &[Jet<S>], roots: &[Jet<S>]) -> f64 {
    let relative = |(change, root): (&Jet<S>, &Jet<S>)| {
        let mut scale = 0.0_f64;
        let degrees = 0..=change.space().order();
        let of_degree = degrees.map(|degree| {
            scale = scale.max(root.max_abs_of_degree(degree));
            let change = change.max_abs_of_degree(degree);
            if change == 0.0 { 0.0 } else { change / scale }
        });
        of_degree.fold(0.0, f64::max)
    };
    changes.iter().zip(roots).map(relative).fold(0.0, f64::max)
}

/// Solves `matrix · solution = right` for jets of one space; `matrix` is a list of rows.
///
/// A jet is invertible if its head is, so that the elimination is that of a matrix of numbers.
///
/// # Errors
///
/// [`JetError::DimensionMismatch`] if the matrix is not square of the right side's size, and
/// [`JetError::Singular`] if no pivot of a column has a head that is finite and other than 0 (in
/// every lane).
pub fn solve_linear<S: Scalar>(
    mut matrix: Vec<Vec<Jet<S>>>,
    mut right: Vec<Jet<S>>,
) -> Result<Vec<Jet<S>>, JetError> {
    let size = right.len();
    check_square(&matrix, size)?;
    for column in 0..size {
        let pivot = pivot_row(&matrix, column)?;
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let (above, below) = matrix.split_at_mut(column + 1);
        let (right_above, right_below) = right.split_at_mut(column + 1);
        for (row, value) in below.iter_mut().zip(right_below) {
            let factor = &row[column] / &above[column][column];
            for (entry, pivot_entry) in row.iter_mut().zip(&above[column]).skip(column + 1) {
                *entry -= &(&factor * pivot_entry);
            }
            *value -= &(&factor * &right_above[column]);
        }
    }
    for row in (0..size).rev() {
        let (solved, known) = right.split_at_mut(row + 1);
        for (entry, value) in matrix[row][row + 1..].iter().zip(known) {
            solved[row] -= &(entry * value);
        }
        solved[row] = &solved[row] / &matrix[row][row];
    }
    Ok(right)
}

fn check_square<S: Scalar>(matrix: &[Vec<Jet<S>>], size: usize) -> Result<(), JetError> {
    let lengths = std::iter::once(matrix.len()).chain(matrix.iter().map(Vec::len));
    match lengths.into_iter().find(|&length| length != size) {
        Some(found) => Err(JetError::DimensionMismatch { expected: size, found }),
        None => Ok(()),
    }
}

/// The row whose entry in a column has the largest head; heads that are 0 in any lane are excluded.
fn pivot_row<S: Scalar>(matrix: &[Vec<Jet<S>>], column: usize) -> Result<usize, JetError> {
    let size_of = |row: usize| {
        let head = matrix[row][column].head();
        if (S::one() / head).is_finite() && head.is_finite() { head.magnitude() } else { 0.0 }
    };
    let best = (column..matrix.len()).max_by(|&a, &b| size_of(a).total_cmp(&size_of(b)));
    best.filter(|&row| size_of(row) > 0.0).ok_or(JetError::Singular { column })
}

/// `Σ_k c_k t^k`, to the order of the space.
///
/// Coefficients of `c_k` that `t^k` lifts above the order are not read. The sum is that of an
/// infinite series if `t` has no constant term and the coefficients reach the power at which `t^k`
/// vanishes: the order divided by the lowest degree of `t`.
///
/// # Panics
///
/// If the jets' spaces differ.
///
/// ```
/// use grazemap_jet::jet::{Jet, JetSpace, power_series_at};
/// let space = JetSpace::uniform(2, 4)?;
/// let (x, y) = (Jet::variable(&space, 0, 0.0), Jet::variable(&space, 1, 0.0));
/// let t = &x + &(&x * &y);
/// let geometric = power_series_at(&vec![Jet::constant(&space, 1.0); 5], &t); // 1/(1 − t)
/// assert_eq!(&geometric * &(-&t).add_constant(1.0), Jet::constant(&space, 1.0));
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
pub fn power_series_at<S: Scalar>(coefficients: &[Jet<S>], t: &Jet<S>) -> Jet<S> {
    let (factor, order) = (HornerFactor::of(t), t.space().order());
    let mut value = Sum::zero(t);
    for (power, coefficient) in coefficients.iter().enumerate().rev() {
        if let Some(kept) = order.checked_sub(factor.reach(power)) {
            value = value.times(&factor, kept).plus(coefficient, kept);
        }
    }
    value.jet
}

/// [`power_series_at`] with its derivative `Σ_k k c_k t^{k−1}`.
///
/// # Panics
///
/// Under the conditions of [`power_series_at`].
pub fn power_series_with_slope_at<S: Scalar>(
    coefficients: &[Jet<S>],
    t: &Jet<S>,
) -> (Jet<S>, Jet<S>) {
    let (factor, order) = (HornerFactor::of(t), t.space().order());
    let (mut value, mut slope) = (Sum::zero(t), Sum::zero(t));
    for (power, coefficient) in coefficients.iter().enumerate().rev() {
        if let Some(kept) = order.checked_sub(factor.reach(power)) {
            slope = slope.times(&factor, kept).plus(&value.jet, kept);
        }
        // The slope adds this sum at the next lower power, and therefore needs it to a higher
        // degree.
        if let Some(kept) = order.checked_sub(factor.reach(power.saturating_sub(1))) {
            value = value.times(&factor, kept).plus(coefficient, kept);
        }
    }
    (value.jet, slope.jet)
}

/// The factor by which Horner's rule multiplies a sum.
struct HornerFactor<'a, S: Scalar> {
    jet: &'a Jet<S>,
    low: usize,
}

impl<'a, S: Scalar> HornerFactor<'a, S> {
    fn of(jet: &'a Jet<S>) -> Self {
        Self { jet, low: lowest(jet) }
    }

    /// Lowest degree of a power of the factor.
    fn reach(&self, power: usize) -> usize {
        self.low.saturating_mul(power)
    }
}

/// A partial sum that vanishes below a degree.
struct Sum<S: Scalar> {
    jet: Jet<S>,
    low: usize,
}

impl<S: Scalar> Sum<S> {
    fn zero(like: &Jet<S>) -> Self {
        Self { jet: Jet::zero(like.space()), low: above(like) }
    }

    /// Product of the sum with a factor, up to a degree.
    fn times(&self, factor: &HornerFactor<'_, S>, order: usize) -> Self {
        let space = self.jet.space();
        let mut jet = Jet::zero(space);
        let (left, right) = (self.jet.coefficients(), factor.jet.coefficients());
        let (left, right) = ((left, self.low), (right, factor.low));
        space.multiply_between(left, right, order, jet.coefficients_mut());
        Self { jet, low: self.low.saturating_add(factor.low) }
    }

    /// Sum with a jet that is cut at a degree.
    fn plus(mut self, addend: &Jet<S>, order: usize) -> Self {
        addend.assert_same_space(&self.jet);
        let kept = ..self.jet.space().degree_start(order + 1);
        let values = self.jet.coefficients_mut()[kept].iter_mut();
        let addends = &addend.coefficients()[kept];
        values.zip(addends).for_each(|(value, &addend)| *value += addend);
        self.low = self.low.min(lowest(addend));
        self
    }
}

/// Lowest degree with a coefficient other than zero; above the order for the zero jet.
fn lowest<S: Scalar>(jet: &Jet<S>) -> usize {
    jet.lowest_degree().unwrap_or(above(jet))
}

fn above<S: Scalar>(jet: &Jet<S>) -> usize {
    jet.space().order() + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    #[test]
    fn solution_satisfies_a_system_that_needs_row_exchanges() {
        let space = JetSpace::uniform(2, 4).unwrap();
        let (x, y) = (Jet::variable(&space, 0, 0.0), Jet::variable(&space, 1, 0.0));
        let matrix = vec![vec![x.clone(), y.add_constant(2.0)], vec![x.exp(), y.sin()]];
        let right = vec![y.cos(), &x * &y];
        let solution = solve_linear(matrix.clone(), right.clone()).unwrap();
        for (row, value) in matrix.iter().zip(&right) {
            let residual = &(&(&row[0] * &solution[0]) + &(&row[1] * &solution[1])) - value;
            assert!(residual.max_abs() < 1e-15, "{residual:?}");
        }
    }

    #[test]
    fn a_matrix_of_nilpotent_jets_is_singular() {
        let x = Jet::variable(&JetSpace::uniform(1, 3).unwrap(), 0, 0.0);
        assert_eq!(
            solve_linear(vec![vec![x.clone()]], vec![x]),
            Err(JetError::Singular { column: 0 })
        );
    }

    /// A jet of given lowest degree with small whole coefficients, so that sums are exact.
    fn jet(space: &std::sync::Arc<JetSpace>, seed: usize, low: usize) -> Jet<f64> {
        let coefficient = |m: usize| match space.degree(m) < low {
            true => 0.0,
            false => ((m * 7 + seed * 5) % 11) as f64 - 5.0,
        };
        Jet::from_coefficients(space, (0..space.len()).map(coefficient).collect())
    }

    #[test]
    fn short_products_sum_to_what_full_ones_do() {
        let space = JetSpace::new(&[1, 2, 2], 9).unwrap();
        for low in 0..4 {
            let t = jet(&space, 3, low);
            for first in [0, 2] {
                let coefficients: Vec<_> = (0..5).map(|k| jet(&space, k, first + k)).collect();
                let (mut value, mut slope) = (Jet::zero(&space), Jet::zero(&space));
                for coefficient in coefficients.iter().rev() {
                    slope = &(&slope * &t) + &value;
                    value = &(&value * &t) + coefficient;
                }
                assert_eq!(power_series_at(&coefficients, &t), value, "{low} {first}");
                let both = power_series_with_slope_at(&coefficients, &t);
                assert_eq!(both, (value, slope), "{low} {first}");
            }
        }
    }

    #[test]
    fn at_zero_the_constant_and_the_linear_coefficient_are_left() {
        let space = JetSpace::uniform(2, 3).unwrap();
        let coefficients = [1, 2, 3].map(|seed| jet(&space, seed, 0));
        let (value, slope) = power_series_with_slope_at(&coefficients, &Jet::zero(&space));
        assert_eq!([value, slope], [coefficients[0].clone(), coefficients[1].clone()]);
    }
}
