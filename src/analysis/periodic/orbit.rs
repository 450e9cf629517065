//! A periodic orbit of a section map and what its Jacobian says.

use nalgebra::{Complex, DMatrix};

use super::problem::Guess;
use crate::iteration::PassageSet;
use crate::numeric::linear::{determinant, eigenvalues};
use crate::numeric::{NumericError, Real};

/// A periodic orbit, its first point held or solved for.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicOrbit<S> {
    /// The points, in order, in offsets.
    pub states: Vec<Vec<S>>,
    /// All active parameters, in offsets.
    pub parameters: Vec<S>,
    /// Passages that made contact, return by return.
    pub itinerary: Vec<PassageSet>,
    /// Contacts of the whole period that no passage accounts for; an orbit with some is not the
    /// one that a local map has.
    pub extra_contacts: usize,
    /// Jacobian of the period's map at the first point.
    pub jacobian: DMatrix<S>,
    /// Largest difference of a coordinate of the image of the last point and the first, in the
    /// scales.
    pub residual: f64,
}

impl<S: Real> PeriodicOrbit<S> {
    /// Characteristic multipliers, largest magnitude first.
    ///
    /// # Errors
    ///
    /// As [`eigenvalues`].
    pub fn multipliers(&self) -> Result<Vec<Complex<f64>>, NumericError> {
        eigenvalues(&self.jacobian)
    }

    /// Whether all multipliers are inside the unit circle.
    ///
    /// # Errors
    ///
    /// As [`eigenvalues`].
    pub fn is_stable(&self) -> Result<bool, NumericError> {
        let multipliers = self.multipliers()?;
        Ok(multipliers.iter().all(|multiplier| multiplier.norm() < 1.0))
    }

    /// `tr J`.
    pub fn trace(&self) -> S {
        self.jacobian.trace()
    }

    /// `det J`.
    ///
    /// # Errors
    ///
    /// As [`determinant`].
    pub fn determinant(&self) -> Result<S, NumericError> {
        determinant(&self.jacobian)
    }

    /// `det(J − s I)`, which vanishes where `s` is a multiplier.
    ///
    /// # Errors
    ///
    /// As [`determinant`].
    pub fn characteristic(&self, multiplier: f64) -> Result<S, NumericError> {
        let mut shifted = self.jacobian.clone();
        for place in 0..shifted.nrows() {
            shifted[(place, place)] -= S::from_f64(multiplier);
        }
        determinant(&shifted)
    }

    /// Largest multiplier's logarithm over the returns of a period: the Lyapunov exponent of the
    /// orbit.
    ///
    /// # Errors
    ///
    /// As [`eigenvalues`].
    pub fn lyapunov_exponent(&self) -> Result<f64, NumericError> {
        let multipliers = self.multipliers()?;
        let largest = multipliers.first().map_or(f64::NAN, |first| first.norm());
        Ok(largest.ln() / self.states.len() as f64)
    }

    /// Where a neighbouring orbit is looked for: here.
    pub fn guess(&self) -> Guess<S> {
        Guess {
            state: self.states[0].clone(),
            parameters: self.parameters.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    #[test]
    fn a_small_multiplier_has_the_digits_of_a_jacobian_in_double_double() {
        let entries = [Dd::ONE, Dd::ONE, Dd::ONE, Dd::new(1.0, 1e-20)];
        let orbit = PeriodicOrbit {
            states: vec![vec![Dd::ZERO; 2]],
            parameters: Vec::new(),
            itinerary: vec![PassageSet::default()],
            extra_contacts: 0,
            jacobian: DMatrix::from_row_slice(2, 2, &entries),
            residual: 0.0,
        };
        let multipliers = orbit.multipliers().expect("finite entries");
        // The determinant is 1e-20 and the trace 2.
        assert!(
            (multipliers[1].re - 0.5e-20).abs() < 1e-35,
            "{multipliers:?}"
        );
    }
}
