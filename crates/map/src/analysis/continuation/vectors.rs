//! Vectors of unknowns.

use crate::numeric::Real;

/// The unit vector along an unknown.
pub(in crate::analysis) fn unit_vector<S: Real>(size: usize, place: usize) -> Vec<S> {
    (0..size).map(|other| if other == place { S::one() } else { S::zero() }).collect()
}

/// The point at this share of the way from one to another.
pub(in crate::analysis) fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
}

/// The point so far from another in a direction.
pub(in crate::analysis) fn moved<S: Real>(from: &[S], along: &[S], by: S) -> Vec<S> {
    from.iter().zip(along).map(|(&value, &along)| value + by * along).collect()
}

/// The same direction, with unit length.
pub(in crate::analysis) fn normalised(vector: &[f64]) -> Vec<f64> {
    let length = norm(vector);
    vector.iter().map(|value| value / length).collect()
}

/// The largest magnitude.
pub(in crate::analysis) fn largest<'v, S: Real>(values: impl IntoIterator<Item = &'v S>) -> f64 {
    values.into_iter().fold(0.0, |most, value| f64::max(most, value.magnitude()))
}

/// The largest difference of two components.
pub(in crate::analysis) fn farthest<S: Real>(a: &[S], b: &[S]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (&a, &b)| f64::max(most, (a - b).magnitude()))
}

/// The Euclidean distance.
pub(in crate::analysis) fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The Euclidean length.
pub(in crate::analysis) fn norm<S: Real>(values: &[S]) -> S {
    values.iter().map(|&value| value * value).sum::<S>().sqrt()
}

/// The scalar product.
pub(in crate::analysis) fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}
