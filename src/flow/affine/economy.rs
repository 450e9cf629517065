//! Polynomials of a low degree in place of series: Lanczos's economisation.
//!
//! One idea: on `[0, 1]` the polynomial of degree `n` with leading coefficient 1 that stays nearest to zero is the shifted
//! Chebyshev polynomial `2^{1−2n} T_n(2x − 1)`, at most `2^{1−2n}` in size. A multiple of it takes the highest term away,
//! and so on while all that was taken is small.

use std::sync::LazyLock;

use super::matrix::MAX_TERMS;

/// The rows of the coefficients of powers on `[0, 1]`, as few as leave an error of at most a share of the largest of each
/// column.
pub(super) fn economised(mut rows: Vec<Vec<f64>>, largest: &[f64], share: f64) -> Vec<Vec<f64>> {
    let mut error = vec![0.0; largest.len()];
    while rows.len() > 2 {
        let degree = rows.len() - 1;
        let bound = 2f64.powi(1 - 2 * degree as i32);
        let terms = || error.iter().zip(&rows[degree]);
        let taken: Vec<f64> = terms().map(|(sum, c)| sum + c.abs() * bound).collect();
        if taken.iter().zip(largest).any(|(e, size)| *e > share * size) {
            break;
        }
        error = taken;
        let top = rows.pop().expect("there are more than two rows");
        for (row, factor) in rows.iter_mut().zip(&NEAREST_TO_ZERO[degree]) {
            for (value, top) in row.iter_mut().zip(&top) {
                *value -= factor * top;
            }
        }
    }
    rows
}

/// Per degree `n` the coefficients of `2^{1−2n} T_n(2x − 1)`, ascending.
///
/// With `C_n` for them, `C_{n+1} = (x − 1/2) C_n − C_{n−1}/16`, but for the first, `C_2 = (x − 1/2) C_1 − 1/8`.
static NEAREST_TO_ZERO: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let mut all = vec![vec![1.0], vec![-0.5, 1.0]];
    for n in 1..MAX_TERMS {
        let share = if n == 1 { 0.125 } else { 0.0625 };
        let mut next = vec![0.0; n + 2];
        for (k, &value) in all[n].iter().enumerate() {
            next[k + 1] += value;
            next[k] -= 0.5 * value;
        }
        for (next, &value) in next.iter_mut().zip(&all[n - 1]) {
            *next -= share * value;
        }
        all.push(next);
    }
    all
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::polynomial;

    #[test]
    fn an_exponential_keeps_its_values_within_the_share_with_fewer_terms() {
        let term = |k: u32| (1..=k).map(f64::from).product::<f64>().recip();
        let rows: Vec<Vec<f64>> = (0..20).map(|k| vec![term(k)]).collect();
        let few = economised(rows, &[1.0], 1e-9);
        assert!(few.len() <= 9, "{}", few.len());
        let coefficients: Vec<f64> = few.iter().map(|row| row[0]).collect();
        for step in 0..=100 {
            let x = f64::from(step) / 100.0;
            let error = polynomial::value(&coefficients, x) - x.exp();
            assert!(error.abs() <= 1e-9 + 4.0 * f64::EPSILON, "{x} {error:e}");
        }
    }

    #[test]
    fn the_polynomials_nearest_to_zero_turn_between_their_bounds() {
        for degree in 1..9 {
            let coefficients = &NEAREST_TO_ZERO[degree];
            let bound = 2f64.powi(1 - 2 * degree as i32);
            for turn in 0..=degree {
                let x = 0.5 + 0.5 * (std::f64::consts::PI * turn as f64 / degree as f64).cos();
                let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
                let value = polynomial::value(coefficients, x);
                assert!((value - sign * bound).abs() < 1e-14, "{degree} {turn}");
            }
        }
    }
}
