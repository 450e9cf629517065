//! The matrix of a linear field over the extended state, and series of rows along its flow.

use super::flow::AffineFieldRows;
use crate::numeric::Real;

/// Most terms of a series.
pub(super) const MAX_TERMS: usize = 96;

/// `M`, by rows, each with the columns of its entries that are not zero.
pub(super) struct Matrix<S> {
    pub(super) states: usize,
    pub(super) columns: usize,
    rows: Vec<Vec<(usize, S)>>,
}

impl<S: Real> Matrix<S> {
    pub(super) fn new(field: &AffineFieldRows<'_, S>) -> Self {
        let states = field.derivatives.len();
        let columns = states + 2 * field.multiples.len() + 1;
        let entries = |row: &&[S]| {
            let row = row.iter().copied().enumerate();
            row.filter(|(_, entry)| *entry != S::zero()).collect()
        };
        let mut rows: Vec<Vec<_>> = field.derivatives.iter().map(entries).collect();
        for (harmonic, &multiple) in field.multiples.iter().enumerate() {
            let (cosine, sine) = (states + 2 * harmonic, states + 2 * harmonic + 1);
            let rate = multiple * field.phase_rate;
            rows.push(vec![(sine, -rate)]);
            rows.push(vec![(cosine, rate)]);
        }
        rows.push(Vec::new());
        Self {
            states,
            columns,
            rows,
        }
    }

    /// The same in `f64`.
    pub(super) fn rounded(&self) -> Matrix<f64> {
        let entry = |&(column, value): &(usize, S)| (column, value.to_f64());
        let row = |row: &Vec<(usize, S)>| row.iter().map(entry).collect();
        Matrix {
            states: self.states,
            columns: self.columns,
            rows: self.rows.iter().map(row).collect(),
        }
    }

    /// `r M`.
    pub(super) fn apply(&self, row: &[S]) -> Vec<S> {
        let mut image = vec![S::zero(); self.columns];
        for (&factor, line) in row.iter().zip(&self.rows) {
            if factor != S::zero() {
                for &(column, entry) in line {
                    image[column] = factor.mul_add(entry, image[column]);
                }
            }
        }
        image
    }

    /// `r M^k / k!` for as many `k` as the step needs: entry by entry until its terms are below the rounding of
    /// its largest, so that units do not matter.
    pub(super) fn series(&self, row: Vec<S>, length: f64) -> Option<Vec<Vec<S>>> {
        let mut largest = vec![0.0f64; self.columns];
        let (mut rows, mut power, mut small) = (Vec::new(), 1.0, 0);
        let mut row = row;
        while small < 2 {
            if rows.len() == MAX_TERMS || !row.iter().all(|value| value.is_finite()) {
                return None;
            }
            let mut all_small = true;
            for (largest, value) in largest.iter_mut().zip(&row) {
                let term = value.magnitude() * power;
                all_small &= term <= *largest * S::ROUNDOFF * 0.0625;
                *largest = largest.max(term);
            }
            small = if all_small { small + 1 } else { 0 };
            let next = self.apply(&row);
            rows.push(row);
            let divisor = S::one() / S::from_f64(rows.len() as f64);
            row = next.into_iter().map(|value| value * divisor).collect();
            power *= length;
        }
        Some(rows)
    }

    /// Estimate from above of the largest magnitude of an eigenvalue: `‖M^64‖^(1/64)`.
    pub(super) fn rate(&self) -> f64 {
        let columns = self.columns;
        let mut power = vec![0.0; columns * columns];
        for (row, entries) in power.chunks_mut(columns).zip(&self.rows) {
            for &(column, entry) in entries {
                row[column] = entry.to_f64();
            }
        }
        let mut logarithm = 0.0;
        for squaring in 0..7 {
            let norm = power
                .iter()
                .fold(0.0f64, |norm, value| norm.max(value.abs()));
            if norm == 0.0 {
                return 0.0;
            }
            power.iter_mut().for_each(|value| *value /= norm);
            logarithm = 2.0 * logarithm + norm.ln();
            if squaring == 6 {
                return (logarithm / 64.0).exp();
            }
            let mut square = vec![0.0; power.len()];
            for (row, out) in power.chunks(columns).zip(square.chunks_mut(columns)) {
                for (&factor, line) in row.iter().zip(power.chunks(columns)) {
                    for (value, entry) in out.iter_mut().zip(line) {
                        *value += factor * entry;
                    }
                }
            }
            power = square;
        }
        0.0
    }
}

/// The first rows of a series that a shorter time needs, by the measure of [`Matrix::series`].
pub(super) fn trimmed<S: Real>(series: &[Vec<S>], length: f64) -> &[Vec<S>] {
    let powers = || std::iter::successors(Some(1.0), |power| Some(power * length));
    let mut largest = vec![0.0f64; series[0].len()];
    for (row, power) in series.iter().zip(powers()) {
        for (largest, value) in largest.iter_mut().zip(row) {
            *largest = largest.max(value.magnitude() * power);
        }
    }
    let matters = |(row, power): (&Vec<S>, f64)| {
        let mut terms = row.iter().zip(&largest);
        terms.any(|(c, largest)| c.magnitude() * power > largest * S::ROUNDOFF * 0.0625)
    };
    let terms = series.iter().zip(powers()).map(matters);
    let last = terms.enumerate().filter(|(_, matters)| *matters).last();
    &series[..last.map_or(1, |(place, _)| place + 1)]
}

/// `Σ_k rows_k t^k`.
pub(super) fn sum_at<S: Real>(rows: &[Vec<S>], time: S) -> Vec<S> {
    let mut sum = vec![S::zero(); rows[0].len()];
    for row in rows.iter().rev() {
        for (value, &coefficient) in sum.iter_mut().zip(row) {
            *value = value.mul_add(time, coefficient);
        }
    }
    sum
}

/// The largest magnitude in each column.
pub(super) fn largest(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut largest = vec![0.0f64; rows[0].len()];
    for row in rows {
        for (largest, value) in largest.iter_mut().zip(row) {
            *largest = largest.max(value.abs());
        }
    }
    largest
}

/// Rows of Bernstein coefficients of degree `len − 1` on `[0, length]`:
/// `b_i = Σ_{k ≤ i} C(i, k) / C(n, k) c_k length^k`.
pub(super) fn control_rows<S: Real>(rows: &[Vec<S>], length: f64, len: usize) -> Vec<Vec<f64>> {
    let columns = rows[0].len();
    let degree = (len - 1) as f64;
    let mut points = vec![vec![0.0; columns]; len];
    for (i, point) in points.iter_mut().enumerate() {
        let (mut factor, mut power) = (1.0, 1.0);
        for (k, row) in rows.iter().enumerate().take(i + 1) {
            for (value, &coefficient) in point.iter_mut().zip(row) {
                *value += factor * power * coefficient.to_f64();
            }
            factor *= (i - k) as f64 / (degree - k as f64).max(1.0);
            power *= length;
        }
    }
    points
}

/// The row of one component.
pub(super) fn unit<S: Real>(component: usize, columns: usize) -> Vec<S> {
    let mut row = vec![S::zero(); columns];
    row[component] = S::one();
    row
}
