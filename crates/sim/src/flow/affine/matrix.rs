//! The exact flow of an affine field at one parameter vector, as tables: the matrix of the linear
//! field over the extended state, and series of rows along its flow.
//!
//! One idea: with the harmonics of the phase and the number 1 as additional states the field is
//! linear, `y' = M y`, so that every function along its flow is linear in the start:
//!
//! ```text
//! y(t) = exp(M t) y(0),     r(t) = Σ_k t^k (r M^k / k!) y(0)     for any row r.
//! ```
//!
//! Resonance, vanishing damping and defective matrices are not special cases. The rows `r M^k / k!`
//! are computed once; a step is a product with the start. See docs/mathematics/affine-flow.md.

use super::rows::{RowTable, Rows, padded};
use crate::numeric::{Real, polynomial};

/// Largest number of terms of a series.
pub(super) const MAX_TERMS: usize = 96;
/// Number of terms for which memory is reserved at first.
const USUAL_TERMS: usize = 32;
/// Number of squarings of a matrix to estimate its rate.
const SQUARINGS: u32 = 6;

/// An affine field at one parameter vector: rows over the extended state.
#[derive(Clone, Copy, Debug)]
pub struct AffineFieldRows<'r, S> {
    /// Derivative of each state.
    pub derivatives: &'r [&'r [S]],
    /// Functions evaluated along the flow.
    pub watched: &'r [&'r [S]],
    /// Rate of the phase; 0 if there is none.
    pub phase_rate: S,
    /// Multiples of the phase in the extended state.
    pub multiples: &'r [S],
}

impl<S: Real> AffineFieldRows<'_, S> {
    /// Rows of a function and of its Lie derivatives along the field, `count` in all.
    pub fn lie_derivatives(&self, row: &[S], count: usize) -> RowTable<S> {
        RowTable::first(&Matrix::new(self).images(row, count), count)
    }
}

/// The nonzero entries of `M`.
pub(super) struct Matrix<S> {
    pub(super) states: usize,
    pub(super) columns: usize,
    entries: Vec<MatrixEntry<S>>,
    /// Angular frequency of the fastest harmonic.
    fastest: f64,
}

#[derive(Clone, Copy)]
struct MatrixEntry<S> {
    row: usize,
    column: usize,
    value: S,
}

impl<S: Real> Matrix<S> {
    pub(super) fn new(field: &AffineFieldRows<'_, S>) -> Self {
        let states = field.derivatives.len();
        let columns = states + 2 * field.multiples.len() + 1;
        let mut matrix =
            Self { states, columns, entries: Vec::with_capacity(columns * columns), fastest: 0.0 };
        for (state, row) in field.derivatives.iter().enumerate() {
            for (column, &value) in row.iter().enumerate() {
                matrix.push(state, column, value);
            }
        }
        for (harmonic, &multiple) in field.multiples.iter().enumerate() {
            let (cosine, sine) = (states + 2 * harmonic, states + 2 * harmonic + 1);
            let rate = multiple * field.phase_rate;
            matrix.push(cosine, sine, -rate);
            matrix.push(sine, cosine, rate);
            matrix.fastest = matrix.fastest.max(rate.magnitude());
        }
        matrix
    }

    fn push(&mut self, row: usize, column: usize, value: S) {
        if value != S::zero() {
            self.entries.push(MatrixEntry { row, column, value });
        }
    }

    /// The matrix in `f64`.
    pub(super) fn rounded(&self) -> Matrix<f64> {
        let entry = |entry: &MatrixEntry<S>| MatrixEntry {
            row: entry.row,
            column: entry.column,
            value: entry.value.to_f64(),
        };
        Matrix {
            states: self.states,
            columns: self.columns,
            entries: self.entries.iter().map(entry).collect(),
            fastest: self.fastest,
        }
    }

    /// Adds `r M` to `image`.
    fn apply(&self, row: &[S], image: &mut [S]) {
        for entry in &self.entries {
            let factor = row[entry.row];
            if factor != S::zero() {
                image[entry.column] = factor.mul_add(entry.value, image[entry.column]);
            }
        }
    }

    /// Appends the image of the last row.
    fn push_image(&self, rows: &mut Vec<S>) {
        let end = rows.len();
        rows.resize(end + self.columns, S::zero());
        let (known, image) = rows.split_at_mut(end);
        self.apply(&known[end - self.columns..], image);
    }

    /// The rows `r, r M, r M², …`, `count` in all.
    pub(super) fn images(&self, row: &[S], count: usize) -> Rows<S> {
        let mut rows = Vec::with_capacity(count * self.columns);
        rows.extend_from_slice(row);
        for _ in 1..count {
            self.push_image(&mut rows);
        }
        Rows::new(self.columns, rows)
    }

    /// Rows `r M^k / k!` for all `k` that the step needs: each entry until its terms are below the
    /// rounding of its largest term, so that units do not matter.
    pub(super) fn series(&self, row: &[S], length: f64) -> Option<Rows<S>> {
        let columns = self.columns;
        let mut largest = vec![0.0f64; columns];
        let mut rows = Vec::with_capacity(USUAL_TERMS * columns);
        rows.extend_from_slice(row);
        let (mut power, mut small) = (1.0, 0);
        for terms in 1..=MAX_TERMS {
            let mut all_small = true;
            for (largest, value) in largest.iter_mut().zip(&rows[(terms - 1) * columns..]) {
                let term = value.magnitude() * power;
                if !term.is_finite() {
                    return None;
                }
                all_small &= term <= *largest * S::ROUNDOFF * 0.0625;
                *largest = largest.max(term);
            }
            small = if all_small { small + 1 } else { 0 };
            if small == 2 {
                return Some(Rows::new(columns, rows));
            }
            self.push_image(&mut rows);
            let divisor = S::one() / S::from_f64(terms as f64);
            for value in &mut rows[terms * columns..] {
                *value *= divisor;
            }
            power *= length;
        }
        None
    }

    /// Series of a row as a sum of the series of the states, if the row has no harmonics.
    pub(super) fn series_from_states(
        &self,
        row: &[S],
        states: &[Rows<S>],
        length: f64,
    ) -> Option<Rows<S>> {
        let (factors, others) = row.split_at(self.states);
        let (&constant, harmonics) = others.split_last()?;
        if harmonics.iter().any(|&factor| factor != S::zero()) {
            return self.series(row, length);
        }
        let terms = states.iter().map(Rows::len).max()?;
        let mut sum = vec![S::zero(); terms * self.columns];
        for (&factor, rows) in factors.iter().zip(states) {
            if factor != S::zero() {
                for (sum, &value) in sum.iter_mut().zip(rows.iter().flatten()) {
                    *sum = factor.mul_add(value, *sum);
                }
            }
        }
        sum[self.columns - 1] += constant;
        Some(Rows::new(self.columns, sum))
    }

    /// Upper estimate of the largest magnitude of an eigenvalue: `‖A^64‖^(1/64)` for the states
    /// alone, or the fastest harmonic.
    pub(super) fn rate(&self) -> f64 {
        let states = self.states;
        let mut power = vec![0.0; states * states];
        let within = |entry: &&MatrixEntry<S>| entry.row < states && entry.column < states;
        for entry in self.entries.iter().filter(within) {
            power[entry.row * states + entry.column] = entry.value.to_f64();
        }
        let mut square = power.clone();
        let mut logarithm = 0.0;
        for squaring in 0..=SQUARINGS {
            if squaring > 0 {
                write_square(&power, states, &mut square);
                std::mem::swap(&mut power, &mut square);
            }
            let norm = power.iter().fold(0.0f64, |norm, entry| norm.max(entry.abs()));
            if norm == 0.0 {
                return self.fastest;
            }
            power.iter_mut().for_each(|entry| *entry /= norm);
            logarithm = 2.0 * logarithm + norm.ln();
        }
        let rate = (logarithm / f64::from(1 << SQUARINGS)).exp();
        rate.max(self.fastest)
    }
}

/// Writes the square of a matrix, row by row.
fn write_square(matrix: &[f64], columns: usize, square: &mut [f64]) {
    for (row, out) in matrix.chunks(columns).zip(square.chunks_mut(columns)) {
        out.fill(0.0);
        for (&factor, line) in row.iter().zip(matrix.chunks(columns)) {
            for (value, entry) in out.iter_mut().zip(line) {
                *value += factor * entry;
            }
        }
    }
}

/// Number of the first terms of a series that a shorter time needs, by the criterion of
/// [`Matrix::series`].
pub(super) fn terms_within<S: Real>(series: &Rows<S>, length: f64) -> usize {
    let powers = std::iter::successors(Some(1.0), |power| Some(power * length));
    let mut largest = vec![0.0f64; series.columns()];
    let mut needed = 1;
    for (place, (row, power)) in series.iter().zip(powers).enumerate() {
        for (largest, value) in largest.iter_mut().zip(row) {
            let term = value.magnitude() * power;
            if term > *largest * S::ROUNDOFF * 0.0625 {
                needed = place + 1;
            }
            *largest = largest.max(term);
        }
    }
    needed
}

/// `Σ_k rows_k t^k`.
pub(super) fn sum_at<S: Real>(rows: &Rows<S>, time: S) -> Vec<S> {
    let mut sum = vec![S::zero(); rows.columns()];
    for row in rows.iter().rev() {
        for (value, &coefficient) in sum.iter_mut().zip(row) {
            *value = value.mul_add(time, coefficient);
        }
    }
    sum
}

/// Largest magnitude in each column.
pub(super) fn largest(rows: &Rows<f64>) -> Vec<f64> {
    let mut largest = vec![0.0f64; rows.columns()];
    for row in rows.iter() {
        for (largest, value) in largest.iter_mut().zip(row) {
            *largest = largest.max(value.abs());
        }
    }
    largest
}

/// Rows of Bernstein coefficients of degree `len − 1` on `[0, length]`:
/// `b_i = Σ_{k ≤ i} C(i, k) / C(n, k) c_k length^k`.
fn control_rows<S: Real>(rows: &Rows<S>, length: f64, len: usize) -> Rows<f64> {
    let columns = rows.columns();
    let degree = (len - 1) as f64;
    let mut points = vec![0.0; len * columns];
    for (i, point) in points.chunks_exact_mut(columns).enumerate() {
        let (mut factor, mut power) = (1.0, 1.0);
        for (k, row) in rows.iter().enumerate().take(i + 1) {
            for (value, &coefficient) in point.iter_mut().zip(row) {
                *value += factor * power * coefficient.to_f64();
            }
            factor *= (i - k) as f64 / (degree - k as f64).max(1.0);
            power *= length;
        }
    }
    Rows::new(columns, points)
}

/// Row of one component.
pub(super) fn unit<S: Real>(component: usize, columns: usize) -> Vec<S> {
    let mut row = vec![S::zero(); columns];
    row[component] = S::one();
    row
}

/// States whose series are needed: `(i, Some(j))` if `x_i' = x_j`, so that the series of `x_i`
/// gives both.
pub(super) fn leading_states<S: Real>(
    derivatives: &[&[S]],
) -> impl Iterator<Item = (usize, Option<usize>)> {
    let count = derivatives.len();
    let slope_of = |state: usize| {
        let row = derivatives[state];
        let only = |&other: &usize| {
            let unit = |(column, &entry): (usize, &S)| {
                entry == if column == other { S::one() } else { S::zero() }
            };
            other != state && row.iter().enumerate().all(unit)
        };
        (0..count).find(only)
    };
    let mut slopes: Vec<Option<usize>> = (0..count).map(slope_of).collect();
    let mut given = vec![false; count];
    for state in 0..count {
        match slopes[state] {
            Some(slope) if !given[state] && !given[slope] => given[slope] = true,
            _ => slopes[state] = None,
        }
    }
    let leading: Vec<_> =
        (0..count).filter(|&state| !given[state]).map(|state| (state, slopes[state])).collect();
    leading.into_iter()
}

/// Longest step in units of the fastest rate of the field: the largest term of a series on it is
/// about 1.5 times its first terms.
const REACH: f64 = 2.4;
/// Longest step if nothing else limits it: the solution is a polynomial in time.
const MAX_STEP: f64 = 1e3;

/// Tables of one affine field and of the functions evaluated along it.
#[derive(Clone, Debug)]
pub struct AffineFlow<S: Real> {
    states: usize,
    columns: usize,
    len: usize,
    length: S,
    time_scale: f64,
    phase_rate: S,
    /// `exp(M L)` for the states.
    transition: RowTable<S>,
    /// Cosine and sine of the angle through which each harmonic turns in a step.
    turns: Vec<(S, S)>,
    /// State that is not a derivative of another state, its series, and the state that is its
    /// derivative.
    state_series: Vec<(usize, RowTable<S>, Option<usize>)>,
    watched_series: Vec<RowTable<S>>,
    /// Bernstein coefficients of the watched functions on the step, in `f64`.
    control: Vec<RowTable<f64>>,
    /// For each watched function the largest Bernstein coefficient of each component.
    sizes: Vec<Vec<f64>>,
}

impl<S: Real> AffineFlow<S> {
    /// Computes the tables; `None` if a series needs too many terms or overflows.
    pub fn new(field: &AffineFieldRows<'_, S>) -> Option<Self> {
        let matrix = Matrix::new(field);
        let rate = matrix.rate();
        let length = S::from_f64((REACH / rate).min(MAX_STEP));
        let limit = length.to_f64();
        let series = |row: &[S]| matrix.series(row, limit);
        let units = (0..matrix.states).map(|state| unit(state, matrix.columns));
        let states: Option<Vec<_>> = units.map(|row| series(&row)).collect();
        let watched: Option<Vec<_>> = field.watched.iter().map(|row| series(row)).collect();
        let (states, watched) = (states?, watched?);
        let longest = states.iter().chain(&watched).map(Rows::len).max()?;
        let len = padded(longest);
        let table = |rows: &Rows<S>| RowTable::first(rows, len);
        let control = |rows: &Rows<S>| control_rows(rows, limit, len);
        let control: Vec<Rows<f64>> = watched.iter().map(control).collect();
        let transition: Vec<_> = states.iter().map(|rows| sum_at(rows, length)).collect();
        Some(Self {
            states: matrix.states,
            columns: matrix.columns,
            len,
            length,
            time_scale: if rate > 0.0 { 1.0 / rate } else { limit },
            phase_rate: field.phase_rate,
            transition: RowTable::new(transition.iter().map(Vec::as_slice), matrix.columns),
            turns: field
                .multiples
                .iter()
                .map(|&k| (k * field.phase_rate * length).sin_cos())
                .map(|(sine, cosine)| (cosine, sine))
                .collect(),
            state_series: leading_states(field.derivatives)
                .map(|(state, slope)| (state, table(&states[state]), slope))
                .collect(),
            sizes: control.iter().map(largest).collect(),
            control: control.iter().map(|rows| RowTable::first(rows, len)).collect(),
            watched_series: watched.iter().map(table).collect(),
        })
    }

    /// Length of a step.
    pub fn length(&self) -> S {
        self.length
    }

    /// Time scale of the field: the inverse of its fastest rate, at most the length of a step.
    pub fn time_scale(&self) -> f64 {
        self.time_scale.min(self.length.to_f64())
    }

    /// Number of coefficients of every series.
    pub fn coefficients(&self) -> usize {
        self.len
    }

    /// Rate of the phase.
    pub fn phase_rate(&self) -> S {
        self.phase_rate
    }

    /// The states at a time within `[−length, length]`; `series` is memory for one series.
    #[inline(never)]
    pub fn states_at(&self, time: S, extended: &[S], series: &mut [S], states: &mut [S]) {
        for (state, row, slope) in &self.state_series {
            row.combine(extended, series);
            match slope {
                Some(slope) => {
                    (states[*state], states[*slope]) = polynomial::value_and_slope(series, time);
                }
                None => states[*state] = polynomial::value(series, time),
            }
        }
    }

    /// Taylor coefficients of a watched function along the flow, valid on `[−length, length]`.
    pub fn watched_series(&self, watched: usize, extended: &[S], out: &mut [S]) {
        self.watched_series[watched].combine(extended, out);
    }

    /// Bernstein coefficients of a watched function on `[0, length]`, in `f64`. The function lies
    /// within their range, and has no more extrema than they have.
    pub fn control_points(&self, watched: usize, extended: &[f64], out: &mut [f64]) {
        self.control[watched].combine(extended, out);
    }

    /// Bound on the terms whose sums are the control points.
    pub fn size(&self, watched: usize, extended: &[f64]) -> f64 {
        let terms = self.sizes[watched].iter().zip(extended);
        terms.fold(0.0, |sum, (size, y)| sum + size * y.abs())
    }

    /// Extended state one step later, without the last component, which is 1.
    pub fn advance(&self, extended: &[S], out: &mut [S]) {
        let extended = &extended[..self.columns];
        self.transition.multiply(extended, &mut out[..self.states]);
        for (harmonic, &(cosine, sine)) in self.turns.iter().enumerate() {
            let place = self.states + 2 * harmonic;
            let (c, s) = (extended[place], extended[place + 1]);
            out[place] = c * cosine - s * sine;
            out[place + 1] = c * sine + s * cosine;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_of_a_row_without_harmonics_is_the_sum_of_those_of_the_states() {
        // x'' = −x − x'/10 + cos 2t, the gap 3 − 2x + x'/2.
        let (position, speed) = ([0.0, 1.0, 0.0, 0.0, 0.0], [-1.0, -0.1, 1.0, 0.0, 0.0]);
        let field = AffineFieldRows {
            derivatives: &[&position, &speed],
            watched: &[],
            phase_rate: 2.0,
            multiples: &[1.0],
        };
        let matrix = Matrix::new(&field);
        let series = |row: &[f64]| matrix.series(row, 0.3).expect("a short time");
        let states = [0, 1].map(|state| series(&unit(state, 5)));
        let gap = [-2.0, 0.5, 0.0, 0.0, 3.0];
        let sum = matrix.series_from_states(&gap, &states, 0.3).expect("a series");
        // Each series ends by its own criterion; the rows of power k come from k products with the
        // matrix, of at most three terms, in either way.
        let whole = states.each_ref().map(Rows::len).into_iter().min();
        let direct = series(&gap);
        let rows = sum.iter().zip(direct.iter()).enumerate();
        for (k, (row, expected)) in rows.take(whole.expect("two states")) {
            let largest = expected.iter().fold(0.0_f64, |size, c| size.max(c.abs()));
            for (value, expected) in row.iter().zip(expected) {
                let error = (value - expected).abs();
                let rounding = 3.0 * k as f64 * f64::EPSILON * largest;
                assert!(error <= rounding, "power {k}: {value} for {expected}");
            }
        }
    }
}
