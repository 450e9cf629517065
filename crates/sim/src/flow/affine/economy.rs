//! Control points of few numbers in place of long series: Lanczos's economisation.
//!
//! One idea: a power series on `[0, 1]` is a sum of shifted Chebyshev polynomials `T_m(2x − 1)`,
//! none of them larger than 1, so that those whose coefficients are small are left out for an error
//! of the sum of these. With
//!
//! ```text
//! x^k = 2^{1−2k} Σ_m C(2k, k−m) T_m(2x − 1),     half of that for m = 0,
//! ```
//!
//! all is sums with fixed numbers. The control points of `T_m(2x − 1)` of degree `m` are
//! `(−1)^{m−i} C(2m, 2i)/C(m, i)`; those of a higher degree are means of neighbours.

use std::sync::{LazyLock, OnceLock};

use super::matrix::MAX_TERMS;
use super::rows::{RowTable, Rows, accumulate};

/// Control points that are formed together.
pub(super) const CONTROL_BLOCK: usize = 8;
/// Most control points of a piece.
pub(super) const MAX_POINTS: usize = 64;

/// Coefficients of shifted Chebyshev polynomials, column by column.
pub(super) struct ChebyshevSeries {
    columns: usize,
    terms: usize,
    values: Vec<f64>,
}

impl ChebyshevSeries {
    /// From the coefficients of powers on `[0, 1]`.
    pub(super) fn new(rows: &Rows<f64>) -> Self {
        let (columns, terms) = (rows.columns(), rows.len());
        let mut values = vec![0.0; columns * terms];
        for (row, shares) in rows.iter().zip(&*POWERS) {
            for (column, &coefficient) in row.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                let values = &mut values[column * terms..][..terms];
                for (value, &share) in values.iter_mut().zip(shares) {
                    *value += share * coefficient;
                }
            }
        }
        Self { columns, terms, values }
    }

    fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.terms..][..self.terms]
    }

    /// How many terms leave an error of at most a share of a size of each column.
    pub(super) fn needed(&self, sizes: &[f64], share: f64) -> usize {
        let columns = sizes.iter().enumerate().map(|(column, size)| {
            let mut error = 0.0;
            let is_small = |value: &&f64| {
                error += value.abs();
                error <= share * size
            };
            self.terms - self.column(column).iter().rev().take_while(is_small).count()
        });
        columns.max().unwrap_or(0)
    }

    /// The control points on `[0, 1]` of its first terms, as many.
    pub(super) fn control_points(&self, points: usize) -> RowTable<f64, CONTROL_BLOCK> {
        let polynomials = control_points_of_polynomials(points);
        RowTable::from_blocks(points, self.columns, |block, column| {
            let mut sum = [0.0; CONTROL_BLOCK];
            for (&value, points) in self.column(column).iter().zip(polynomials) {
                accumulate(&mut sum, value, &points[block]);
            }
            sum
        })
    }
}

/// Per power the shares of the polynomials.
static POWERS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let of_power = |power: usize| {
        let mut binomial = (1..=power).fold(2.0, |value, k| {
            // C(2k, k) from C(2k − 2, k − 1), over 4.
            value * (2 * k - 1) as f64 / (2 * k) as f64
        });
        let mut shares = vec![0.5 * binomial];
        for term in 1..=power {
            binomial *= (power + 1 - term) as f64 / (power + term) as f64;
            shares.push(binomial);
        }
        shares
    };
    (0..MAX_TERMS).map(of_power).collect()
});

/// Per polynomial its control points in blocks, as many as there are polynomials.
fn control_points_of_polynomials(points: usize) -> &'static [Vec<[f64; CONTROL_BLOCK]>] {
    static TABLES: [OnceLock<Vec<Vec<[f64; CONTROL_BLOCK]>>>; MAX_POINTS / CONTROL_BLOCK] =
        [const { OnceLock::new() }; MAX_POINTS / CONTROL_BLOCK];
    TABLES[points / CONTROL_BLOCK - 1].get_or_init(|| {
        let polynomials = (0..points).map(|term| elevated(polynomial(term), points));
        polynomials.map(|points| points.as_chunks().0.to_vec()).collect()
    })
}

/// The control points of one polynomial, of its own degree.
fn polynomial(degree: usize) -> Vec<f64> {
    let last = degree as f64;
    let mut points = vec![if degree.is_multiple_of(2) { 1.0 } else { -1.0 }];
    for i in 0..degree {
        let i = i as f64;
        // C(2m, 2i + 2)/C(m, i + 1) from C(2m, 2i)/C(m, i).
        let ratio = (2.0 * (last - i) - 1.0) / (2.0 * i + 1.0);
        points.extend(points.last().map(|point| -point * ratio));
    }
    points
}

/// The same polynomial by more control points.
fn elevated(mut points: Vec<f64>, count: usize) -> Vec<f64> {
    while points.len() < count {
        let degree = points.len() as f64;
        let before = [&points[..1], &points].concat();
        let after = [&points[..], &points[points.len() - 1..]].concat();
        let mean = |(i, (before, after)): (usize, (&f64, &f64))| {
            let share = i as f64 / degree;
            share * before + (1.0 - share) * after
        };
        points = before.iter().zip(&after).enumerate().map(mean).collect();
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial from its control points, by de Casteljau's repeated means.
    fn value(points: &[f64], x: f64) -> f64 {
        let mut points = points.to_vec();
        while points.len() > 1 {
            let mean = |pair: &[f64]| (1.0 - x) * pair[0] + x * pair[1];
            points = points.windows(2).map(mean).collect();
        }
        points[0]
    }

    /// `e^{-x}` on `[0, 1]`; at 0 all its terms are positive.
    fn decay() -> ChebyshevSeries {
        let term = |k: i32| (-1f64).powi(k) / (1..=k).map(f64::from).product::<f64>();
        ChebyshevSeries::new(&Rows::new(1, (0..20).map(term).collect()))
    }

    #[test]
    fn an_exponential_is_within_the_share_by_the_terms_needed_and_by_no_fewer() {
        let series = decay();
        for share in [1e-2, 1e-4, 1e-7, 1e-10] {
            let needed = series.needed(&[1.0], share);
            let error = |terms: usize, x: f64| {
                let angle = (2.0 * x - 1.0).acos();
                let terms = series.column(0)[..terms].iter().enumerate();
                let sum: f64 = terms.map(|(m, value)| value * (m as f64 * angle).cos()).sum();
                (sum - (-x).exp()).abs()
            };
            for step in 0..=100 {
                let x = f64::from(step) / 100.0;
                assert!(error(needed, x) <= share, "{share} {x}");
            }
            assert!(error(needed - 1, 0.0) > share, "{share} {needed}");
        }
    }

    #[test]
    fn control_points_of_an_exponential_give_its_values() {
        let series = decay();
        // Eight terms leave out 1e-9.
        assert!(series.needed(&[1.0], 1e-8) <= CONTROL_BLOCK);
        let table = series.control_points(CONTROL_BLOCK);
        let points: Vec<f64> = table.column(0).collect();
        for step in 0..=100 {
            let x = f64::from(step) / 100.0;
            let error = value(&points, x) - (-x).exp();
            assert!(error.abs() <= 1e-8, "{x} {error:e}");
        }
    }

    #[test]
    fn control_points_of_a_polynomial_give_its_values_whatever_their_number() {
        for degree in 0..16 {
            for count in [degree + 1, degree + 2, 24] {
                let points = elevated(polynomial(degree), count);
                for step in 0..=40 {
                    let angle = std::f64::consts::PI * f64::from(step) / 40.0;
                    let error =
                        value(&points, 0.5 + 0.5 * angle.cos()) - (degree as f64 * angle).cos();
                    // Control points of degree 15 are up to 2e4 in size.
                    assert!(error.abs() < 1e-11, "{degree} {count} {error:e}");
                }
            }
        }
    }

    #[test]
    fn powers_are_the_sums_of_their_polynomials() {
        for (power, shares) in POWERS.iter().enumerate().take(40) {
            for step in 0..=20 {
                let angle = std::f64::consts::PI * f64::from(step) / 20.0;
                let terms = shares.iter().enumerate();
                let sum: f64 = terms.map(|(m, share)| share * (m as f64 * angle).cos()).sum();
                let x = 0.5 + 0.5 * angle.cos();
                assert!((sum - x.powi(power as i32)).abs() < 1e-14, "{power}");
            }
        }
    }
}
