//! Where Newton's steps for the release begin: the contact time as a rational function of `y`.
//!
//! The contact time over `y` falls from one power law to the next where a force takes over from
//! another, on scales of `y` that may lie decades apart. A sum of `c_j/(1 + y/y_j)` follows it; the
//! scales `y_j` are picked one by one.

use nalgebra::{DMatrix, DVector};

use super::contact::ContactTime;

/// Scales to choose from, per decade of `y`.
const SCALES_PER_DECADE: f64 = 4.0;
/// Scales are looked for this far beyond the depths sampled.
const BEYOND: f64 = 100.0;
/// Most scales picked.
const MOST_SCALES: usize = 10;
/// Relative error at which no further scale is picked.
const CLOSE: f64 = 3e-3;

/// Fits `κ` to pairs `(y, κ)`, in relative error.
pub(super) fn fit(samples: &[(f64, f64)]) -> ContactTime<f64> {
    let candidates = candidates(samples);
    let mut scales: Vec<f64> = Vec::new();
    let mut best = solve(samples, &scales);
    while best.error > CLOSE && scales.len() < MOST_SCALES {
        let tried = candidates.iter().filter(|scale| !scales.contains(scale));
        let fits = tried.map(|&scale| solve(samples, &[&scales[..], &[scale]].concat()));
        match fits.min_by(|a, b| a.error.total_cmp(&b.error)) {
            Some(next) if next.error < best.error => best = next,
            _ => break,
        }
        scales.clone_from(&best.scales);
    }
    best.rational()
}

fn candidates(samples: &[(f64, f64)]) -> Vec<f64> {
    let depths = || samples.iter().map(|&(y, _)| y);
    let lowest = depths().fold(f64::INFINITY, f64::min) / BEYOND;
    let highest = depths().fold(0.0, f64::max) * BEYOND;
    let count = ((highest / lowest).log10() * SCALES_PER_DECADE).ceil();
    let place = |number: u32| lowest * (highest / lowest).powf(f64::from(number) / count);
    (0..=count as u32).map(place).collect()
}

/// `κ ≈ c_0 + Σ c_j/(1 + y/y_j)`.
struct Fit {
    scales: Vec<f64>,
    factors: Vec<f64>,
    error: f64,
}

/// Least squares of the relative error.
fn solve(samples: &[(f64, f64)], scales: &[f64]) -> Fit {
    let term = |y: f64, column: usize| match column {
        0 => 1.0,
        _ => 1.0 / (1.0 + y / scales[column - 1]),
    };
    let matrix = DMatrix::from_fn(samples.len(), scales.len() + 1, |row, column| {
        let (y, factor) = samples[row];
        term(y, column) / factor
    });
    let ones = DVector::from_element(samples.len(), 1.0);
    let svd = matrix.clone().svd(true, true);
    let factors = svd.solve(&ones, 1e-12);
    let factors = factors.unwrap_or_else(|_| DVector::zeros(scales.len() + 1));
    let error = (&matrix * &factors - ones).amax();
    Fit {
        scales: scales.to_vec(),
        factors: factors.iter().copied().collect(),
        error: if error.is_nan() { f64::INFINITY } else { error },
    }
}

impl Fit {
    /// The sum over one denominator `Π (1 + y/y_j)`.
    fn rational(&self) -> ContactTime<f64> {
        let denominator = product(&self.scales);
        let mut numerator = denominator
            .iter()
            .map(|d| self.factors[0] * d)
            .collect::<Vec<_>>();
        for (number, factor) in self.factors[1..].iter().enumerate() {
            let mut others = self.scales.clone();
            others.remove(number);
            for (sum, term) in numerator.iter_mut().zip(product(&others)) {
                *sum += factor * term;
            }
        }
        ContactTime {
            numerator,
            denominator,
        }
    }
}

/// `Π (1 + y/y_j)`, lowest power first.
fn product(scales: &[f64]) -> Vec<f64> {
    scales.iter().fold(vec![1.0], |product, scale| {
        let mut next = product.clone();
        next.push(0.0);
        for (power, value) in product.iter().enumerate() {
            next[power + 1] += value / scale;
        }
        next
    })
}
