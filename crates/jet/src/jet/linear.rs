//! Linear systems whose entries are jets: Gaussian elimination, pivots chosen by their heads.

use super::{Jet, JetError};
use crate::numeric::Scalar;

/// Solves `matrix · solution = right` for jets of one space; `matrix` is a list of rows.
///
/// A jet is invertible where its head is, so the elimination is that of a matrix of numbers.
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
        Some(found) => Err(JetError::DimensionMismatch {
            expected: size,
            found,
        }),
        None => Ok(()),
    }
}

/// The row whose entry in a column has the largest head, zeros in any lane excluded.
fn pivot_row<S: Scalar>(matrix: &[Vec<Jet<S>>], column: usize) -> Result<usize, JetError> {
    let size_of = |row: usize| {
        let head = matrix[row][column].head();
        if (S::one() / head).is_finite() && head.is_finite() {
            head.magnitude()
        } else {
            0.0
        }
    };
    let best = (column..matrix.len()).max_by(|&a, &b| size_of(a).total_cmp(&size_of(b)));
    best.filter(|&row| size_of(row) > 0.0)
        .ok_or(JetError::Singular { column })
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
}
