//! The largest Lyapunov exponent of an orbit of a map.

use super::DiscreteMap;

/// Largest Lyapunov exponent per iterate, from the Jacobian along the orbit.
///
/// A tangent vector is carried along and renormalised at every iterate; the exponent is the mean of the
/// logarithms of its growth over `iterates` steps after `transient` steps (Benettin et al. 1980). Near grazing the
/// Jacobian is unbounded, `O(1/y)`, but integrably so.
///
/// `None` if the orbit leaves the finite numbers; minus infinity if the tangent vector is annihilated.
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
    let mut jacobian = vec![0.0; dimension * dimension];
    let mut tangent = vec![1.0 / (dimension as f64).sqrt(); dimension];
    let mut sum = 0.0;
    for iterate in 0..transient + iterates {
        let info = map.step_jacobian(&state, parameters, &mut image, &mut jacobian);
        if !info.valid {
            return None;
        }
        std::mem::swap(&mut state, &mut image);
        let growth = carry(&jacobian, &mut tangent);
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

/// Replaces a unit vector by its normalised image; the growth.
fn carry(jacobian: &[f64], tangent: &mut [f64]) -> f64 {
    let rows = jacobian.chunks_exact(tangent.len());
    let image: Vec<f64> = rows
        .map(|row| row.iter().zip(tangent.iter()).map(|(a, b)| a * b).sum())
        .collect();
    let growth = image
        .iter()
        .map(|value: &f64| value * value)
        .sum::<f64>()
        .sqrt();
    for (target, value) in tangent.iter_mut().zip(image) {
        *target = if growth > 0.0 { value / growth } else { 0.0 };
    }
    growth
}
