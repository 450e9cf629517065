//! Operations on vectors of unknowns.

use crate::numeric::Real;

/// Unit vector along an unknown.
pub(crate) fn unit_vector<S: Real>(size: usize, place: usize) -> Vec<S> {
    (0..size).map(|other| if other == place { S::one() } else { S::zero() }).collect()
}

/// Point at a fraction of the way from `a` to `b`.
pub(crate) fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
}

/// Point at a distance from another, along a direction.
pub(crate) fn moved<S: Real>(from: &[S], along: &[S], by: S) -> Vec<S> {
    from.iter().zip(along).map(|(&value, &along)| value + by * along).collect()
}

/// Vector of unit length in the same direction.
pub(crate) fn normalised(vector: &[f64]) -> Vec<f64> {
    let length = norm(vector);
    vector.iter().map(|value| value / length).collect()
}

/// Largest magnitude of the values.
pub(crate) fn largest<'v, S: Real>(values: impl IntoIterator<Item = &'v S>) -> f64 {
    values.into_iter().fold(0.0, |most, value| f64::max(most, value.magnitude()))
}

/// Largest difference of two components.
pub(crate) fn farthest<S: Real>(a: &[S], b: &[S]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (&a, &b)| f64::max(most, (a - b).magnitude()))
}

/// Euclidean distance.
pub(crate) fn apart<S: Real>(a: &[S], b: &[S]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| (a - b) * (a - b)).sum::<S>().sqrt().to_f64()
}

/// Euclidean length.
pub(crate) fn norm<S: Real>(values: &[S]) -> S {
    values.iter().map(|&value| value * value).sum::<S>().sqrt()
}

/// Scalar product.
pub(crate) fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}
