//! Small dense linear algebra on nalgebra's containers: elimination for any [`Real`], eigenvalues
//! for `f64`.
//!
//! nalgebra's own solvers ask for traits that [`Dd`] does not have; elimination with
//! partial pivoting on equilibrated rows is all that shooting and continuation need.

use nalgebra::linalg::{Schur, balancing};
use nalgebra::{Complex, DMatrix, DVector, Matrix2};

use super::{Dd, Real};

/// Invalid input of a numerical algorithm, or its failure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NumericError {
    /// Elimination met a pivot too small to divide by.
    #[error(
        "expected a regular matrix, found pivot {pivot:e} in column {column} of equilibrated rows"
    )]
    Singular {
        /// Magnitude of the pivot, with rows scaled to a largest entry of about one.
        pivot: f64,
        /// Column of the pivot, counted from 0.
        column: usize,
    },
    /// A matrix or vector has the wrong shape.
    #[error(
        "expected {expected_rows} rows and {expected_columns} columns, found {rows} and {columns}"
    )]
    Shape {
        /// Rows required.
        expected_rows: usize,
        /// Columns required.
        expected_columns: usize,
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
    },
    /// A matrix holds an infinite entry or NaN.
    #[error("expected finite entries, found {value} in row {row}, column {column}")]
    NotFinite {
        /// The entry.
        value: f64,
        /// Row of the entry, counted from 0.
        row: usize,
        /// Column of the entry, counted from 0.
        column: usize,
    },
    /// The reduction to Schur form did not converge.
    #[error(
        "the eigenvalues of a matrix of {rows} rows did not converge in {iterations} iterations"
    )]
    NoSchurForm {
        /// Rows of the matrix.
        rows: usize,
        /// Iterations spent.
        iterations: usize,
    },
    /// The values at the ends of a bracket do not have opposite signs.
    #[error(
        "expected values of opposite signs, found {value_lower:e} at {lower} and \
            {value_upper:e} at {upper}"
    )]
    NoSignChange {
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
        /// Value at the lower end.
        value_lower: f64,
        /// Value at the upper end.
        value_upper: f64,
    },
}

/// Pivots below this many units of rounding times the dimension count as zero.
const SINGULAR_ROUNDINGS: f64 = 4.0;

/// A factorised square matrix: `L U` of its equilibrated rows in the order of the pivots.
#[derive(Clone, Debug, PartialEq)]
pub struct Factorization<S> {
    factors: DMatrix<S>,
    row_scale: Vec<S>,
    order: Vec<usize>,
    reciprocal_pivot: f64,
}

/// Factorises a square matrix by Gaussian elimination with partial pivoting, rows first scaled to a
/// largest entry of one.
///
/// # Errors
///
/// [`NumericError::Shape`] if the matrix is not square, [`NumericError::NotFinite`] if an entry is
/// not, [`NumericError::Singular`] if a pivot is zero within rounding.
pub fn factorize<S: Real>(matrix: &DMatrix<S>) -> Result<Factorization<S>, NumericError> {
    check_square(matrix)?;
    check_finite(matrix)?;
    let size = matrix.nrows();
    let mut factors = matrix.clone();
    let row_scale = equilibrate(&mut factors)?;
    let mut order: Vec<usize> = (0..size).collect();
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for column in 0..size {
        let pivot_row = largest_below(&factors, column);
        factors.swap_rows(column, pivot_row);
        order.swap(column, pivot_row);
        let pivot = factors[(column, column)].magnitude();
        if pivot <= SINGULAR_ROUNDINGS * size as f64 * S::ROUNDOFF {
            return Err(NumericError::Singular { pivot, column });
        }
        (smallest, largest) = (smallest.min(pivot), largest.max(pivot));
        eliminate(&mut factors, column);
    }
    let reciprocal_pivot = if size == 0 { 1.0 } else { smallest / largest };
    Ok(Factorization { factors, row_scale, order, reciprocal_pivot })
}

/// The solution `x` of `matrix x = right`.
///
/// # Errors
///
/// The errors of [`factorize`], and [`NumericError::Shape`] if the lengths differ.
///
/// ```
/// use grazemap_jet::numeric::linear::solve;
/// use nalgebra::{DMatrix, DVector};
/// let matrix = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 0.0, 4.0]);
/// let x = solve(&matrix, &DVector::from_vec(vec![4.0, 8.0]))?;
/// assert_eq!(x.as_slice(), &[1.0, 2.0]);
/// # Ok::<(), grazemap_jet::numeric::NumericError>(())
/// ```
pub fn solve<S: Real>(matrix: &DMatrix<S>, right: &DVector<S>) -> Result<DVector<S>, NumericError> {
    factorize(matrix)?.solve(right)
}

/// The inverse of a square matrix.
///
/// # Errors
///
/// The errors of [`factorize`].
pub fn inverse<S: Real>(matrix: &DMatrix<S>) -> Result<DMatrix<S>, NumericError> {
    let factorization = factorize(matrix)?;
    let size = matrix.nrows();
    let mut inverse = DMatrix::from_element(size, size, S::zero());
    for column in 0..size {
        let unit =
            DVector::from_fn(size, |row, _| if row == column { S::one() } else { S::zero() });
        inverse.set_column(column, &factorization.solve(&unit)?);
    }
    Ok(inverse)
}

/// The determinant of a square matrix; zero if a pivot is zero within rounding.
///
/// # Errors
///
/// [`NumericError::Shape`] if the matrix is not square, [`NumericError::NotFinite`] if an entry is
/// not.
///
/// ```
/// use grazemap_jet::numeric::linear::determinant;
/// use nalgebra::DMatrix;
/// assert_eq!(determinant(&DMatrix::from_row_slice(2, 2, &[0.0, 2.0, 3.0, 5.0]))?, -6.0);
/// # Ok::<(), grazemap_jet::numeric::NumericError>(())
/// ```
pub fn determinant<S: Real>(matrix: &DMatrix<S>) -> Result<S, NumericError> {
    match factorize(matrix) {
        Ok(factorization) => Ok(factorization.determinant()),
        Err(NumericError::Singular { .. }) => Ok(S::zero()),
        Err(error) => Err(error),
    }
}

impl<S: Real> Factorization<S> {
    /// The determinant of the matrix: the product of the pivots over the product of the rows'
    /// scales, with the sign of the permutation of the rows.
    pub fn determinant(&self) -> S {
        let pivots = (0..self.size()).map(|place| self.factors[(place, place)]);
        let unscaled = pivots
            .zip(&self.row_scale)
            .fold(S::one(), |product, (pivot, &scale)| product * pivot / scale);
        if is_even(&self.order) { unscaled } else { -unscaled }
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// The solution `x` of `matrix x = right`.
    ///
    /// # Errors
    ///
    /// [`NumericError::Shape`] if the right-hand side has another length than the matrix has rows.
    pub fn solve(&self, right: &DVector<S>) -> Result<DVector<S>, NumericError> {
        let size = self.size();
        if right.len() != size {
            return Err(shape_error((size, 1), (right.len(), 1)));
        }
        let mut x = DVector::from_fn(size, |row, _| {
            right[self.order[row]] * self.row_scale[self.order[row]]
        });
        for row in 0..size {
            for column in 0..row {
                let known = self.factors[(row, column)] * x[column];
                x[row] -= known;
            }
        }
        for row in (0..size).rev() {
            for column in row + 1..size {
                let known = self.factors[(row, column)] * x[column];
                x[row] -= known;
            }
            x[row] /= self.factors[(row, row)];
        }
        Ok(x)
    }

    /// The smallest pivot divided by the largest: a rough upper estimate of the reciprocal
    /// condition number, in `(0, 1]`.
    pub fn reciprocal_pivot(&self) -> f64 {
        self.reciprocal_pivot
    }
}

/// Whether a permutation is a product of an even number of exchanges.
fn is_even(order: &[usize]) -> bool {
    let places = order.iter().enumerate();
    let inversions = places.map(|(place, &number)| {
        let after = order[place + 1..].iter();
        after.filter(|&&later| later < number).count()
    });
    inversions.sum::<usize>() % 2 == 0
}

/// Scales each row by a power of two so that its largest entry lies in `[1, 2)`, and returns the
/// scales.
fn equilibrate<S: Real>(matrix: &mut DMatrix<S>) -> Result<Vec<S>, NumericError> {
    let mut scales = Vec::with_capacity(matrix.nrows());
    for mut row in matrix.row_iter_mut() {
        let largest = row.iter().map(|entry| entry.magnitude()).fold(0.0, f64::max);
        if largest == 0.0 {
            return Err(NumericError::Singular { pivot: 0.0, column: 0 });
        }
        let exponent = largest.log2().floor().clamp(-1000.0, 1000.0);
        let scale = S::from_f64((-exponent).exp2());
        row.iter_mut().for_each(|entry| *entry *= scale);
        scales.push(scale);
    }
    Ok(scales)
}

fn largest_below<S: Real>(factors: &DMatrix<S>, column: usize) -> usize {
    (column + 1..factors.nrows()).fold(column, |best, row| {
        if factors[(row, column)].magnitude() > factors[(best, column)].magnitude() {
            row
        } else {
            best
        }
    })
}

/// Subtracts the pivot row from those below, leaving the multipliers in its column.
fn eliminate<S: Real>(factors: &mut DMatrix<S>, column: usize) {
    let size = factors.nrows();
    for row in column + 1..size {
        let multiplier = factors[(row, column)] / factors[(column, column)];
        factors[(row, column)] = multiplier;
        for right in column + 1..size {
            let known = multiplier * factors[(column, right)];
            factors[(row, right)] -= known;
        }
    }
}

fn check_square<S: Real>(matrix: &DMatrix<S>) -> Result<(), NumericError> {
    let (rows, columns) = matrix.shape();
    if rows == columns { Ok(()) } else { Err(shape_error((rows, rows), (rows, columns))) }
}

fn check_finite<S: Real>(matrix: &DMatrix<S>) -> Result<(), NumericError> {
    for column in 0..matrix.ncols() {
        for row in 0..matrix.nrows() {
            let entry = matrix[(row, column)];
            if !entry.is_finite() {
                let value = entry.to_f64();
                return Err(NumericError::NotFinite { value, row, column });
            }
        }
    }
    Ok(())
}

fn shape_error(expected: (usize, usize), found: (usize, usize)) -> NumericError {
    NumericError::Shape {
        expected_rows: expected.0,
        expected_columns: expected.1,
        rows: found.0,
        columns: found.1,
    }
}

/// Iterations allowed for each row of a matrix in the reduction to Schur form.
const ITERATIONS_PER_ROW: usize = 100;

/// The eigenvalues of a square matrix, largest magnitude first; a complex pair has its positive
/// imaginary part first.
///
/// 2x2 matrices go through [`eigenvalues_2x2`]. A larger one is rounded to `f64` and balanced
/// (Parlett and Reinsch), then reduced to Schur form.
///
/// # Errors
///
/// [`NumericError::Shape`] if the matrix is not square, [`NumericError::NotFinite`] if an entry is
/// not, [`NumericError::NoSchurForm`] if the reduction does not converge.
///
/// ```
/// use grazemap_jet::numeric::linear::eigenvalues;
/// use nalgebra::{Complex, DMatrix};
/// let rotation = DMatrix::from_row_slice(2, 2, &[0.0, -1.0, 1.0, 0.0]);
/// assert_eq!(eigenvalues(&rotation)?, [Complex::new(0.0, 1.0), Complex::new(0.0, -1.0)]);
/// # Ok::<(), grazemap_jet::numeric::NumericError>(())
/// ```
pub fn eigenvalues<S: Real>(matrix: &DMatrix<S>) -> Result<Vec<Complex<f64>>, NumericError> {
    check_square(matrix)?;
    check_finite(matrix)?;
    let size = matrix.nrows();
    let mut values = match size {
        0 => Vec::new(),
        1 => vec![Complex::new(matrix[(0, 0)].to_f64(), 0.0)],
        2 => eigenvalues_2x2(&matrix.fixed_view::<2, 2>(0, 0).into_owned(), None).to_vec(),
        _ => by_schur_form(matrix.map(Real::to_f64))?,
    };
    values.sort_by(|a, b| {
        let by_magnitude = b.norm().total_cmp(&a.norm());
        by_magnitude.then(b.im.total_cmp(&a.im))
    });
    Ok(values)
}

/// The two eigenvalues of a 2x2 matrix, largest magnitude first, by the quadratic formula without
/// cancellation.
///
/// The smaller real eigenvalue is the determinant over the larger. It keeps its relative accuracy,
/// however small it is, if the determinant is known independently: that of a monodromy matrix
/// follows from the damping. Otherwise the determinant of the entries is computed in double-double.
///
/// ```
/// use grazemap_jet::numeric::linear::eigenvalues_2x2;
/// use nalgebra::Matrix2;
/// let values = eigenvalues_2x2(&Matrix2::new(2.0, 3.0, 1e-25, 1e-25), Some(-1e-25));
/// assert!((values[1].re + 0.5e-25).abs() < 1e-40);
/// ```
pub fn eigenvalues_2x2<S: Real>(matrix: &Matrix2<S>, determinant: Option<S>) -> [Complex<f64>; 2] {
    let [a, c, b, d] = [matrix[0], matrix[1], matrix[2], matrix[3]].map(Real::to_dd);
    let determinant = determinant.map_or(a * d - b * c, Real::to_dd);
    let half = Dd::from(0.5);
    let half_trace = (a + d) * half;
    let half_difference = (a - d) * half;
    let discriminant = half_difference * half_difference + b * c;
    if discriminant < Dd::ZERO {
        let imaginary = (-discriminant).sqrt().to_f64();
        let real = half_trace.to_f64();
        return [Complex::new(real, imaginary), Complex::new(real, -imaginary)];
    }
    let root = discriminant.sqrt();
    let larger = if half_trace < Dd::ZERO { half_trace - root } else { half_trace + root };
    let smaller = if larger == Dd::ZERO { Dd::ZERO } else { determinant / larger };
    [larger, smaller].map(|value| Complex::new(value.to_f64(), 0.0))
}

fn by_schur_form(mut matrix: DMatrix<f64>) -> Result<Vec<Complex<f64>>, NumericError> {
    balancing::balance_parlett_reinsch(&mut matrix);
    let rows = matrix.nrows();
    let iterations = ITERATIONS_PER_ROW * rows;
    let schur = Schur::try_new(matrix, f64::EPSILON, iterations)
        .ok_or(NumericError::NoSchurForm { rows, iterations })?;
    Ok(schur.complex_eigenvalues().iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    /// The Hilbert matrix of a size; its condition number is 5e5 at size 5.
    fn hilbert<S: Real>(size: usize) -> DMatrix<S> {
        DMatrix::from_fn(size, size, |row, column| {
            S::one() / S::from_f64((row + column + 1) as f64)
        })
    }

    #[test]
    fn inverse_of_the_hilbert_matrix_has_its_integer_entries() {
        let inverse = inverse::<Dd>(&hilbert(5)).unwrap();
        assert!((inverse[(0, 0)] - Dd::from(25.0)).abs().hi < 1e-24);
        assert!((inverse[(2, 3)] - Dd::from(-117_600.0)).abs().hi < 1e-20);
        assert!((inverse[(4, 4)] - Dd::from(44_100.0)).abs().hi < 1e-20);
    }

    #[test]
    fn solution_does_not_depend_on_the_units_of_the_rows() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1e-150_f64, 2e-150, 3e120, 4e120]);
        let x = solve(&matrix, &DVector::from_vec(vec![5e-150, 11e120])).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14, "{x}");
    }

    #[test]
    fn determinants_know_the_order_and_the_units_of_the_rows() {
        // det of the Hilbert matrix of size 3 is 1/2160 (Sloane A005249).
        let third = determinant::<Dd>(&hilbert(3)).unwrap();
        assert!((third * Dd::from(2160.0) - Dd::ONE).abs().hi < 1e-28);
        let cycle =
            DMatrix::from_row_slice(3, 3, &[0.0_f64, 2e-90, 0.0, 0.0, 0.0, 4.0, 8e90, 0.0, 0.0]);
        assert!((determinant(&cycle).unwrap() / 64.0 - 1.0).abs() < 1e-14);
        let exchange = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]);
        assert_eq!(determinant(&exchange), Ok(-1.0));
        let singular = DMatrix::from_row_slice(2, 2, &[0.1, 0.3, 0.2, 0.6]);
        assert_eq!(determinant(&singular), Ok(0.0));
    }

    #[test]
    fn pivots_are_chosen_where_the_diagonal_is_zero() {
        let matrix = DMatrix::from_row_slice(3, 3, &[0.0, 2.0, 0.0, 0.0, 0.0, 4.0, 8.0, 0.0, 0.0]);
        let factorization = factorize(&matrix).unwrap();
        let x = factorization.solve(&DVector::from_vec(vec![2.0, 8.0, 24.0])).unwrap();
        assert_eq!(x.as_slice(), &[3.0, 1.0, 2.0]);
        assert_eq!(factorization.reciprocal_pivot(), 1.0);
    }

    #[test]
    fn singular_and_misshapen_matrices_are_refused() {
        let singular = DMatrix::from_row_slice(2, 2, &[0.1, 0.3, 0.2, 0.6]);
        assert!(matches!(inverse(&singular), Err(NumericError::Singular { column: 1, .. })));
        assert!(matches!(
            factorize(&DMatrix::from_element(2, 3, 1.0)),
            Err(NumericError::Shape { .. })
        ));
        assert!(matches!(
            solve(&hilbert(3), &DVector::from_element(2, 1.0)),
            Err(NumericError::Shape { .. })
        ));
        let nan = DMatrix::from_element(1, 1, f64::NAN);
        assert!(matches!(factorize(&nan), Err(NumericError::NotFinite { .. })));
    }

    #[test]
    fn companion_matrix_has_the_roots_of_its_polynomial() {
        // (x - 3)(x^2 + 2x + 5) = x^3 - x^2 - x - 15: roots 3 and -1 +- 2i.
        let companion =
            DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 15.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let values = eigenvalues(&companion).unwrap();
        let exact = [Complex::new(3.0, 0.0), Complex::new(-1.0, 2.0), Complex::new(-1.0, -2.0)];
        for (value, exact) in values.iter().zip(exact) {
            assert!((value - exact).norm() < 1e-13, "{values:?}");
        }
    }

    #[test]
    fn tiny_eigenvalue_keeps_its_digits_when_the_determinant_is_given() {
        // Eigenvalues 1 and 1e-20; the entries alone do not determine their product.
        let matrix = Matrix2::new(0.5, 0.25, 1.0, 0.5);
        let values = eigenvalues_2x2(&matrix, Some(1e-20));
        assert_eq!(values.map(|value| value.re), [1.0, 1e-20]);
        assert_eq!(eigenvalues_2x2(&matrix, None)[1].re, 0.0);
    }

    #[test]
    fn eigenvalues_of_special_matrices_are_exact() {
        let zero = eigenvalues_2x2(&Matrix2::<f64>::zeros(), None);
        assert_eq!(zero.map(|value| value.norm()), [0.0, 0.0]);
        let saddle = eigenvalues_2x2(&Matrix2::new(0.0, 1.0, 4.0, 0.0), None);
        assert_eq!(saddle.map(|value| value.re), [2.0, -2.0]);
        let spiral = eigenvalues_2x2(&Matrix2::new(1.0, -2.0, 2.0, 1.0), None);
        assert_eq!(spiral[0], Complex::new(1.0, 2.0));
    }

    #[test]
    fn matrices_that_are_not_finite_or_not_square_are_refused() {
        let nan = DMatrix::from_element(3, 3, f64::NAN);
        assert!(matches!(eigenvalues(&nan), Err(NumericError::NotFinite { .. })));
        assert!(matches!(
            eigenvalues(&DMatrix::<f64>::zeros(2, 3)),
            Err(NumericError::Shape { .. })
        ));
    }
}
