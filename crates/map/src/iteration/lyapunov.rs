//! The largest Lyapunov exponent of an orbit: from the multipliers if it is periodic, otherwise the
//! mean growth of a tangent vector, with its standard error.

use std::ops::AddAssign;

use nalgebra::DMatrix;

use super::discrete_map::DiscreteMap;
use super::orbit::{MapOrbit, Period};
use crate::interruption::check_at;
use crate::numeric::linear::eigenvalues;

/// The largest Lyapunov exponent of an orbit, per iterate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyapunovExponent {
    /// The exponent; minus infinity if a tangent vector becomes zero.
    pub value: f64,
    /// Standard error of a mean over iterates, infinite below four iterates; `None` for a periodic
    /// orbit, whose exponent follows from its multipliers.
    pub error: Option<f64>,
}

/// Largest Lyapunov exponent per iterate, from the derivative along the orbit.
///
/// A tangent vector is carried along and normalised at every iterate. The exponent is the mean of
/// the logarithms of its growth over `iterates` steps after `transient` steps (Benettin et al.
/// 1980); the error is that of the mean of eight stretches. Near grazing the Jacobian is unbounded,
/// `O(1/y)`, but its logarithm is integrable.
///
/// `None` if the orbit leaves the finite numbers; minus infinity if the tangent vector becomes
/// zero.
///
/// # Panics
///
/// If the length of the state or of the parameters is not the map's.
pub fn largest_lyapunov_exponent(
    map: &(impl DiscreteMap + ?Sized),
    initial: &[f64],
    parameters: &[f64],
    transient: usize,
    iterates: usize,
) -> Option<LyapunovExponent> {
    let dimension = map.dimension();
    let (mut state, mut image) = (initial.to_vec(), vec![0.0; dimension]);
    let mut tangent = vec![1.0 / (dimension as f64).sqrt(); dimension];
    let mut carried = tangent.clone();
    let mut growth = Growth::new(0.0, iterates);
    for iterate in 0..transient + iterates {
        check_at(iterate);
        let info = map.step_tangent([&state, &tangent], parameters, [&mut image, &mut carried]);
        if !info.valid {
            return None;
        }
        std::mem::swap(&mut state, &mut image);
        let factor = normalise(&carried, &mut tangent);
        if factor == 0.0 {
            return Some(LyapunovExponent::ANNIHILATED);
        }
        if iterate >= transient {
            growth.add(factor.ln());
        }
    }
    growth.exponent(|sum| sum)
}

/// Largest Lyapunov exponent per iterate of a periodic orbit: logarithm of the modulus of its
/// largest multiplier, divided by its period.
///
/// `None` without a period, or if the map has no finite derivative at one of its points.
///
/// # Panics
///
/// If the length of the parameters is not the map's.
pub fn periodic_lyapunov_exponent(
    map: &(impl DiscreteMap + ?Sized),
    orbit: &MapOrbit,
    parameters: &[f64],
) -> Option<LyapunovExponent> {
    let Period::Periodic(period) = orbit.period else { return None };
    let dimension = orbit.last.len();
    let mut product = DMatrix::identity(dimension, dimension);
    let (mut image, mut rows) = (vec![0.0; dimension], vec![0.0; dimension * dimension]);
    for state in orbit.states().take(period) {
        map.step_jacobian(state, parameters, &mut image, &mut rows);
        product = DMatrix::from_row_slice(dimension, dimension, &rows) * product;
    }
    let largest = eigenvalues(&product).ok()?.first()?.norm();
    Some(LyapunovExponent { value: largest.ln() / period as f64, error: None })
}

impl LyapunovExponent {
    /// Exponent of a tangent vector that becomes zero.
    pub(super) const ANNIHILATED: Self = Self { value: f64::NEG_INFINITY, error: Some(0.0) };
}

/// Number of stretches of iterates, whose means give the error of the overall mean.
const STRETCHES: usize = 8;

/// Logarithms of the growth of a tangent vector, one for every iterate, summed.
#[derive(Clone, Debug)]
pub(super) struct Growth<T> {
    iterates: usize,
    made: usize,
    sum: T,
    /// Sums at the ends of the stretches.
    ends: Vec<T>,
}

impl<T: Copy + AddAssign> Growth<T> {
    /// An empty sum over `iterates` iterates.
    pub(super) fn new(zero: T, iterates: usize) -> Self {
        Self { iterates, made: 0, sum: zero, ends: Vec::with_capacity(STRETCHES) }
    }

    /// Number of stretches, each of at least two iterates.
    fn stretches(&self) -> usize {
        (self.iterates / 2).min(STRETCHES)
    }

    /// Adds the logarithm of the growth at the next iterate.
    #[inline(always)]
    pub(super) fn add(&mut self, logarithm: T) {
        self.sum += logarithm;
        self.made += 1;
        if self.made * self.stretches() / self.iterates > self.ends.len() {
            self.ends.push(self.sum);
        }
    }

    /// Exponent of the component that `of` selects; `None` if it is not finite.
    pub(super) fn exponent(&self, of: impl Fn(T) -> f64) -> Option<LyapunovExponent> {
        let mean = of(self.sum) / self.iterates as f64;
        let count = self.ends.len();
        let end = |stretch: usize| (stretch * self.iterates).div_ceil(count);
        let (mut before, mut squares) = (0.0, 0.0);
        for (stretch, &sum) in self.ends.iter().enumerate() {
            let length = (end(stretch + 1) - end(stretch)) as f64;
            squares += ((of(sum) - before) / length - mean).powi(2);
            before = of(sum);
        }
        let error = match count {
            0 | 1 => f64::INFINITY,
            _ => (squares / (count * (count - 1)) as f64).sqrt(),
        };
        mean.is_finite().then_some(LyapunovExponent { value: mean, error: Some(error) })
    }
}

/// Writes the direction of a vector and returns its length.
fn normalise(vector: &[f64], direction: &mut [f64]) -> f64 {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    for (target, part) in direction.iter_mut().zip(vector) {
        *target = if length > 0.0 { part / length } else { 0.0 };
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iteration::{OrbitRequest, StepInfo};

    /// `x ↦ p x (1 − x)`.
    struct Logistic;

    impl DiscreteMap for Logistic {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            1
        }
        fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
            image[0] = parameters[0] * state[0] * (1.0 - state[0]);
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            jacobian[0] = parameters[0] * (1.0 - 2.0 * state[0]);
            self.step(state, parameters, image)
        }
    }

    /// `x ↦ x/p` below `p`, `(1 − x)/(1 − p)` above: slopes are independent, and `1/p` has the
    /// probability `p`.
    struct SkewTent;

    impl DiscreteMap for SkewTent {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            1
        }
        fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
            let (x, p) = (state[0], parameters[0]);
            image[0] = if x < p { x / p } else { (1.0 - x) / (1.0 - p) };
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            let (x, p) = (state[0], parameters[0]);
            jacobian[0] = if x < p { 1.0 / p } else { -1.0 / (1.0 - p) };
            self.step(state, parameters, image)
        }
    }

    #[test]
    fn the_exponent_of_a_skew_tent_map_is_its_entropy_within_the_standard_error() {
        let p = 0.3f64;
        let exact = -p * p.ln() - (1.0 - p) * (1.0 - p).ln();
        let deviations = (1..=200).map(|number| {
            let start = f64::from(number) / 201.0 + 1e-3;
            let found = largest_lyapunov_exponent(&SkewTent, &[start], &[p], 20, 1001);
            let found = found.expect("a finite orbit");
            (found.value - exact) / found.error.expect("a mean")
        });
        let squares: Vec<f64> = deviations.map(|deviation| deviation * deviation).collect();
        let variance = squares.iter().sum::<f64>() / squares.len() as f64;
        // Student's distribution of seven degrees of freedom has the variance 7/5, and the mean of
        // two hundred squares of it scatters by 0.25.
        assert!((variance - 1.4).abs() < 0.75, "{variance}");
    }

    #[test]
    fn the_exponent_of_a_periodic_orbit_is_that_of_its_multiplier_for_any_number_of_iterates() {
        // The points of period 2 have the sum (p + 1)/p and the product (p + 1)/p²; the multiplier
        // is 4 + 2p − p².
        let p = 3.3;
        let exact = (4.0f64 + 2.0 * p - p * p).abs().ln() / 2.0;
        for keep in [5, 8, 13] {
            let request = OrbitRequest::new(2000, keep, &[1.0]);
            let orbit = MapOrbit::of(&Logistic, &[0.3], &[p], &request);
            let found = periodic_lyapunov_exponent(&Logistic, &orbit, &[p]);
            let found = found.expect("a period");
            assert!((found.value - exact).abs() < 1e-12 && found.error.is_none(), "{found:?}");
        }
        let chaotic = MapOrbit::of(&Logistic, &[0.3], &[3.9], &OrbitRequest::new(99, 9, &[1.0]));
        assert_eq!(periodic_lyapunov_exponent(&Logistic, &chaotic, &[3.9]), None);
    }

    #[test]
    fn the_error_of_growth_that_is_the_same_at_every_iterate_is_zero() {
        for iterates in [1, 4, 7, 16, 29, 100] {
            let mut growth = Growth::new(0.0, iterates);
            (0..iterates).for_each(|_| growth.add(-0.25));
            let found = growth.exponent(|sum| sum).expect("a finite mean");
            let error = if iterates < 4 { f64::INFINITY } else { 0.0 };
            assert_eq!((found.value, found.error), (-0.25, Some(error)), "{iterates}");
        }
    }
}
