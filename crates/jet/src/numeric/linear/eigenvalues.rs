//! Eigenvalues of small real matrices.

use nalgebra::linalg::{Schur, balancing};
use nalgebra::{Complex, DMatrix, Matrix2};

use super::{check_finite, check_square};
use crate::numeric::{Dd, NumericError, Real};

/// Iterations allowed for each row of a matrix in its reduction to Schur form.
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
/// The smaller real one is the determinant over the larger, so it keeps its relative accuracy
/// however small it is when the determinant is known independently, as that of a monodromy matrix
/// is from the damping. Without one, the determinant of the entries is computed in double-double.
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
        return [
            Complex::new(real, imaginary),
            Complex::new(real, -imaginary),
        ];
    }
    let root = discriminant.sqrt();
    let larger = if half_trace < Dd::ZERO {
        half_trace - root
    } else {
        half_trace + root
    };
    let smaller = if larger == Dd::ZERO {
        Dd::ZERO
    } else {
        determinant / larger
    };
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

    #[test]
    fn companion_matrix_has_the_roots_of_its_polynomial() {
        // (x - 3)(x^2 + 2x + 5) = x^3 - x^2 - x - 15: roots 3 and -1 +- 2i.
        let companion =
            DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 15.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let values = eigenvalues(&companion).unwrap();
        let exact = [
            Complex::new(3.0, 0.0),
            Complex::new(-1.0, 2.0),
            Complex::new(-1.0, -2.0),
        ];
        for (value, exact) in values.iter().zip(exact) {
            assert!((value - exact).norm() < 1e-13, "{values:?}");
        }
    }

    #[test]
    fn tiny_eigenvalue_keeps_its_digits_when_the_determinant_is_given() {
        // Eigenvalues 1 and 1e-20, whose product the entries alone have lost.
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
        assert!(matches!(
            eigenvalues(&nan),
            Err(NumericError::NotFinite { .. })
        ));
        assert!(matches!(
            eigenvalues(&DMatrix::<f64>::zeros(2, 3)),
            Err(NumericError::Shape { .. })
        ));
    }
}
