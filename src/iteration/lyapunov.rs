//! The largest Lyapunov exponent of an orbit of a map.

use super::DiscreteMap;

/// Largest Lyapunov exponent per iterate, from the derivative along the orbit.
///
/// A tangent vector is carried along and renormalised at every iterate; the exponent is the mean of
/// the logarithms of its growth over `iterates` steps after `transient` steps (Benettin et al.
/// 1980). Near grazing the Jacobian is unbounded, `O(1/y)`, but integrably so.
///
/// `None` if the orbit leaves the finite numbers; minus infinity if the tangent vector is
/// annihilated.
///
/// # Panics
///
/// If the state or the parameters have not the map's lengths.
pub fn largest_lyapunov_exponent(
    map: &(impl DiscreteMap + ?Sized),
    initial: &[f64],
    parameters: &[f64],
    transient: usize,
    iterates: usize,
) -> Option<f64> {
    let dimension = map.dimension();
    let (mut state, mut image) = (initial.to_vec(), vec![0.0; dimension]);
    let mut tangent = vec![1.0 / (dimension as f64).sqrt(); dimension];
    let mut carried = tangent.clone();
    let mut sum = 0.0;
    for iterate in 0..transient + iterates {
        let info = map.step_tangent([&state, &tangent], parameters, [&mut image, &mut carried]);
        if !info.valid {
            return None;
        }
        std::mem::swap(&mut state, &mut image);
        let growth = normalise(&carried, &mut tangent);
        if growth == 0.0 {
            return Some(f64::NEG_INFINITY);
        }
        if iterate >= transient {
            sum += growth.ln();
        }
    }
    let mean = sum / iterates as f64;
    mean.is_finite().then_some(mean)
}

/// Writes the direction of a vector; its length.
fn normalise(vector: &[f64], direction: &mut [f64]) -> f64 {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    for (target, part) in direction.iter_mut().zip(vector) {
        *target = if length > 0.0 { part / length } else { 0.0 };
    }
    length
}
