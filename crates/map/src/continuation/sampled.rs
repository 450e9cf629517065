//! Zeros of a function that is known at the Chebyshev points of a step.
//!
//! The decay of the Chebyshev coefficients of the polynomial through the samples bounds its
//! distance from the function (Trefethen 2013, *Approximation Theory and Approximation Practice*,
//! chapters 3 and 8). If every extremum of the polynomial is farther from zero than that bound, the
//! function has a zero wherever the polynomial changes its sign, and no other.

use std::array::from_fn;
use std::f64::consts::PI;

use crate::numeric::polynomial::extrema;

/// Degree of the interpolating polynomial.
const DEGREE: usize = 8;

/// Number of sample places in a step, its ends included.
pub(crate) const SAMPLES: usize = DEGREE + 1;

/// Sample places, in order: the Chebyshev points of `[0, 1]`.
pub(crate) fn places() -> [f64; SAMPLES] {
    from_fn(|place| 0.5 * (1.0 - (PI * place as f64 / DEGREE as f64).cos()))
}

/// Information on the zeros of a function, from its samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Zeros {
    /// Every zero is known. These additional places, together with the sample places, separate the
    /// zeros: at most one lies between neighbours.
    Parted(Vec<f64>),
    /// The step is too long to be resolved by this number of samples.
    TooLong,
    /// The function is zero to rounding at these places; everywhere if there are none.
    Rounding(Vec<f64>),
}

/// Largest share of the last coefficients in the largest one. The omitted terms are then smaller
/// than the last ones together.
const DECAYED: f64 = 1e-2;

/// An extremum counts as nonzero if it is this many times as large as the error.
const MARGIN: f64 = 4.0;

/// Zeros of a function with these samples, which are known up to `noise`.
pub(crate) fn zeros(samples: &[f64; SAMPLES], noise: f64) -> Zeros {
    let coefficients = chebyshev_coefficients(samples);
    let largest = coefficients.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let last = coefficients[DEGREE].abs().max(coefficients[DEGREE - 1].abs());
    if largest <= noise {
        return Zeros::Rounding(Vec::new());
    }
    if last > DECAYED * largest {
        return Zeros::TooLong;
    }
    let turns = turns(&powers(&coefficients));
    let nearest = turns.iter().fold(f64::INFINITY, |least, (_, value)| least.min(value.abs()));
    if nearest > MARGIN * (last + noise) {
        Zeros::Parted(parting(samples, &turns))
    } else if nearest > MARGIN * noise {
        Zeros::TooLong
    } else {
        let rounding = turns.iter().filter(|(_, value)| value.abs() <= MARGIN * noise);
        Zeros::Rounding(rounding.map(|(place, _)| *place).collect())
    }
}

/// Coefficients `c_k` of the polynomial `Σ c_k T_k(2 t - 1)` through samples at [`places`].
fn chebyshev_coefficients(samples: &[f64; SAMPLES]) -> [f64; SAMPLES] {
    let halved = |index: usize| if index == 0 || index == DEGREE { 0.5 } else { 1.0 };
    from_fn(|k| {
        let terms = samples.iter().rev().enumerate().map(|(at, &sample)| {
            halved(at) * sample * (PI * (k * at % (2 * DEGREE)) as f64 / DEGREE as f64).cos()
        });
        2.0 / DEGREE as f64 * halved(k) * terms.sum::<f64>()
    })
}

/// Coefficients of the polynomial in powers of `2 t - 1`, from its Chebyshev coefficients.
fn powers(coefficients: &[f64; SAMPLES]) -> [f64; SAMPLES] {
    let mut sum = [0.0; SAMPLES];
    let (mut before, mut term) = ([0.0; SAMPLES], [0.0; SAMPLES]);
    term[0] = 1.0;
    for (k, &coefficient) in coefficients.iter().enumerate() {
        for (sum, &value) in sum.iter_mut().zip(&term) {
            *sum += coefficient * value;
        }
        // T_1 = x T_0, and T_{k+1} = 2 x T_k - T_{k-1}.
        let factor = if k == 0 { 1.0 } else { 2.0 };
        let shifted = |power: usize| power.checked_sub(1).map_or(0.0, |lower| term[lower]);
        let next = from_fn(|power| factor * shifted(power) - before[power]);
        (before, term) = (term, next);
    }
    sum
}

/// Extrema inside the step, in order: places and values.
fn turns(powers: &[f64; SAMPLES]) -> Vec<(f64, f64)> {
    let halves = [-1.0, 1.0].into_iter().flat_map(|end| extrema(powers, end));
    let mut turns: Vec<(f64, f64)> =
        halves.map(|turn| (0.5 * (1.0 + turn.time), turn.value)).collect();
    turns.sort_by(|a, b| a.0.total_cmp(&b.0));
    turns
}

/// Extrema in intervals between neighbouring sample places in which the sign changes more than
/// once.
fn parting(samples: &[f64; SAMPLES], turns: &[(f64, f64)]) -> Vec<f64> {
    let places = places();
    let mut parting = Vec::new();
    for (ends, values) in places.windows(2).zip(samples.windows(2)) {
        let inside = turns.iter().filter(|(place, _)| ends[0] < *place && *place < ends[1]);
        let signs = inside.clone().map(|(_, value)| *value).chain([values[1]]);
        let changes = signs
            .scan(values[0], |before, value| Some(std::mem::replace(before, value) * value < 0.0));
        if changes.filter(|&changed| changed).count() > 1 {
            parting.extend(inside.map(|(place, _)| *place));
        }
    }
    parting
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zeros_of(function: impl Fn(f64) -> f64, noise: f64) -> Zeros {
        zeros(&places().map(function), noise)
    }

    /// Number of sign changes between neighbours among the sample places and the separating places.
    fn counted(function: impl Fn(f64) -> f64) -> Option<usize> {
        let Zeros::Parted(parting) = zeros_of(&function, 1e-15) else { return None };
        let mut all: Vec<f64> = places().into_iter().chain(parting).collect();
        all.sort_by(f64::total_cmp);
        let values: Vec<f64> = all.into_iter().map(function).collect();
        Some(values.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count())
    }

    #[test]
    fn polynomials_of_the_degree_are_known_with_all_their_zeros() {
        let near = [0.31, 0.310_01, 0.6, 0.600_1];
        let product = |t: f64| near.iter().map(|zero| t - zero).product::<f64>();
        assert_eq!(counted(product), Some(4));
    }

    #[test]
    fn sinusoids_are_known_with_all_their_zeros_or_not_at_all() {
        let mut known = 0;
        for number in 0..4000 {
            let (rate, phase) = (0.01 * f64::from(number), 0.7 * f64::from(number));
            if let Some(found) = counted(|t| (rate * t + phase).sin()) {
                let passed = |angle: f64| (angle / PI).floor();
                let expected = (passed(rate + phase) - passed(phase)).abs() as usize;
                assert_eq!(found, expected, "{rate} {phase}");
                known += 1;
            }
        }
        // Rates up to 2 π have coefficients that decay far enough, rates of 9 do not.
        assert!((628..900).contains(&known), "{known}");
    }

    #[test]
    fn a_touch_within_the_noise_is_rounding_and_one_beyond_is_not() {
        let touch = |gap: f64| move |t: f64| (t - 0.4).powi(2) + gap;
        let Zeros::Rounding(places) = zeros_of(touch(1e-12), 1e-11) else {
            panic!("beyond the noise")
        };
        assert!(places.len() == 1 && (places[0] - 0.4).abs() < 1e-12, "{places:?}");
        assert_eq!(zeros_of(touch(1e-9), 1e-11), Zeros::Parted(Vec::new()));
        assert_eq!(zeros_of(|_| 1e-12, 1e-11), Zeros::Rounding(Vec::new()));
    }
}
