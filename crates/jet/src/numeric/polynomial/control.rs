//! Control points of the first terms of a power series.

use crate::numeric::Scalar;

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

/// The Bernstein coefficients on `[0, 1]` of a polynomial of degree 15 with these ascending
/// coefficients.
///
/// ```text
/// b_i = Σ_{k ≤ i} C(i, k)/C(15, k) c_k
/// ```
///
/// ```
/// use grazemap_jet::numeric::polynomial::{TERMS, control_points};
/// let mut line = [0.0; TERMS];
/// line[1] = 15.0;
/// assert!(control_points(&line).iter().zip(0u8..).all(|(&b, i)| (b - f64::from(i)).abs() < 1e-14));
/// ```
#[inline(always)]
pub fn control_points<S: Scalar>(coefficients: &[S; TERMS]) -> [S; TERMS] {
    let mut points = [S::zero(); TERMS];
    if size_of::<S>() > size_of::<f64>() {
        // NOTE: lanes fill the registers by themselves; a point's sum then stays in one.
        for (i, point) in points.iter_mut().enumerate() {
            for (&coefficient, column) in coefficients[..=i].iter().zip(&COLUMNS) {
                *point += coefficient * S::from_f64(column[i]);
            }
        }
        return points;
    }
    for (&coefficient, column) in coefficients.iter().zip(&COLUMNS) {
        for (point, &share) in points.iter_mut().zip(column) {
            *point += coefficient * S::from_f64(share);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::super::bernstein::to_bernstein;
    use super::*;
    use crate::numeric::Dd;

    #[test]
    fn powers_have_the_control_points_of_repeated_sums_in_double_double() {
        for power in 0..TERMS {
            let coefficients: [f64; TERMS] = std::array::from_fn(|k| f64::from(k == power));
            let exact = to_bernstein(&coefficients.map(Dd::from));
            for (point, exact) in control_points(&coefficients).into_iter().zip(exact) {
                let exact = exact.to_f64();
                // A share is a chain of at most 15 quotients and products, each rounded.
                assert!(
                    (point - exact).abs() <= 30.0 * f64::ROUNDOFF * exact,
                    "{power}"
                );
            }
        }
    }
}
