//! The exact flow of an affine field at one parameter vector, as tables.
//!
//! One idea: with the harmonics of the phase and the number 1 as further states the field is
//! linear, `y' = M y`, and so everything along its flow is linear in the start:
//!
//! ```text
//! y(t) = exp(M t) y(0),     r(t) = Σ_k t^k (r M^k / k!) y(0)     for any row r.
//! ```
//!
//! Resonance, vanishing damping and defective matrices need no case of their own. The rows `r M^k /
//! k!` are computed once; a step is a product with the start. See docs/mathematics/affine-flow.md.

use super::matrix::{AffineFieldRows, Matrix, control_rows, largest, leading_states, sum_at, unit};
use super::rows::{RowTable, Rows, padded};
use crate::numeric::{Real, polynomial};

/// Longest step in units of the fastest rate of the field: the largest term of a series on it is
/// about 1.5 times its first ones.
const REACH: f64 = 2.4;
/// Longest step where nothing else limits it: the solution is a polynomial in time.
const MAX_STEP: f64 = 1e3;

/// Tables of one affine field and of the functions watched along it.
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
    /// Cosine and sine of the turn of each harmonic in a step.
    turns: Vec<(S, S)>,
    /// Series of the states that are no other state's derivative, and the state that is theirs.
    state_series: Vec<(usize, RowTable<S>, Option<usize>)>,
    watched_series: Vec<RowTable<S>>,
    /// Bernstein coefficients of the watched functions on the step, in `f64`.
    control: Vec<RowTable<f64>>,
    /// Per watched function the largest Bernstein coefficient of each component.
    sizes: Vec<Vec<f64>>,
}

impl<S: Real> AffineFlow<S> {
    /// Computes the tables; `None` where a series does not end within the numbers of the type.
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

    /// The time in which the field changes: the inverse of its fastest rate, at most the length of
    /// a step.
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

    /// The states at a time within `[−length, length]`; `series` holds one series.
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

    /// Taylor coefficients of a watched function along the flow, good on `[−length, length]`.
    pub fn watched_series(&self, watched: usize, extended: &[S], out: &mut [S]) {
        self.watched_series[watched].combine(extended, out);
    }

    /// Bernstein coefficients of a watched function on `[0, length]`, in `f64`: the function lies
    /// within their range, and has no more extrema than they have.
    pub fn control_points(&self, watched: usize, extended: &[f64], out: &mut [f64]) {
        self.control[watched].combine(extended, out);
    }

    /// A bound of the size of the terms of which the control points are sums.
    pub fn size(&self, watched: usize, extended: &[f64]) -> f64 {
        let terms = self.sizes[watched].iter().zip(extended);
        terms.fold(0.0, |sum, (size, y)| sum + size * y.abs())
    }

    /// The extended state a whole step later, but for the last component, which is 1.
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
