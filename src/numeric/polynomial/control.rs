//! Control points of the first terms of a power series.

/// Number of terms and of control points.
pub const TERMS: usize = 16;

/// `C(i, k)/C(15, k)` in row `k` and column `i`.
static COLUMNS: [[f64; TERMS]; TERMS] = {
    let mut columns = [[0.0; TERMS]; TERMS];
    let mut i = 0;
    while i < TERMS {
        let (mut k, mut share) = (0, 1.0);
        while k <= i {
            columns[k][i] = share;
            share *= (i - k) as f64 / (TERMS - 1 - k) as f64;
            k += 1;
        }
        i += 1;
    }
    columns
};

/// The Bernstein coefficients on `[0, 1]` of a polynomial of degree 15 with these ascending coefficients.
///
/// ```text
/// b_i = Σ_{k ≤ i} C(i, k)/C(15, k) c_k
/// ```
///
/// ```
/// use grazemap::numeric::polynomial::{TERMS, control_points};
/// let mut line = [0.0; TERMS];
/// line[1] = 15.0;
/// assert!(control_points(&line).iter().zip(0u8..).all(|(&b, i)| (b - f64::from(i)).abs() < 1e-14));
/// ```
#[inline]
pub fn control_points(coefficients: &[f64; TERMS]) -> [f64; TERMS] {
    let mut points = [0.0; TERMS];
    for (&coefficient, column) in coefficients.iter().zip(&COLUMNS) {
        for (point, share) in points.iter_mut().zip(column) {
            *point += coefficient * share;
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_have_the_control_points_of_the_binomial_theorem() {
        // (1 − t)^j t^(15−j) has the one control point 1/C(15, j), in the place 15 − j.
        let binomial =
            |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
        for j in 0..TERMS {
            let mut coefficients = [0.0; TERMS];
            for k in 0..=j {
                let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
                coefficients[TERMS - 1 - j + k] = sign * binomial(j, k);
            }
            for (i, point) in control_points(&coefficients).into_iter().enumerate() {
                let expected = f64::from(i == TERMS - 1 - j) / binomial(TERMS - 1, j);
                assert!(
                    (point - expected).abs() < 1e-12,
                    "{j} {i}: {point} {expected}"
                );
            }
        }
    }
}
