//! `y²` in the place of a coordinate.
//!
//! One idea: `y² = u(c, p)`, `u = −h_min`, makes one of the variables `(y; c, p)` redundant, and
//! every product dearer. Where a step of a passage divides by `y` it matters more: `y² − u`
//! vanishes, but not as a polynomial. Solving the relation for one coordinate, `c_j = c_j(y²; c',
//! p)`, leaves variables that are independent.

use std::sync::Arc;

use super::ExpansionError;
use super::variables::Variables;
use crate::jet::{Jet, JetSpace, implicit_root, power_series_at, power_series_with_slope_at};
use crate::numeric::Real;

/// Slopes of the depth below this share of the largest count as none.
const NO_SLOPE: f64 = 1e-9;

/// The variables (coordinates; parameters) as jets in `(y; c', p)`.
#[derive(Clone, Debug)]
pub(super) struct DepthChart<S: Real> {
    /// Space of `(y; coordinates; parameters)`, without a monomial in the replaced coordinate.
    pub(super) space: Arc<JetSpace>,
    /// The coordinate.
    pub(super) replaced: usize,
    /// The replaced coordinate.
    coordinate: Jet<S>,
}

impl<S: Real> DepthChart<S> {
    /// Solves `u = y²` for a coordinate, to a weighted degree; `depth` is `u` in (coordinates;
    /// parameters).
    ///
    /// # Errors
    ///
    /// [`ExpansionError::DepthWithoutSlope`] if the depth does not depend on any coordinate at
    /// first order, [`ExpansionError::Jet`] if the space would be too large.
    pub(super) fn new(
        depth: &Jet<S>,
        variables: &Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let replaced = steepest_coordinate(depth, variables)?;
        let space = space_without(replaced, variables, weight)?;
        let powers = powers_of(replaced, depth, &space);
        let y = Jet::variable(&space, 0, S::zero());
        let square = &y * &y;
        let coordinate = implicit_root(&Jet::zero(&space), |coordinate| {
            let (depth, slope) = power_series_with_slope_at(&powers, coordinate);
            (&depth - &square, slope)
        })?;
        Ok(Self {
            space,
            replaced,
            coordinate,
        })
    }

    /// Jets in (coordinates; parameters) as jets in `(y; c', p)`.
    pub(super) fn raise(&self, jets: &[Jet<S>]) -> Vec<Jet<S>> {
        let raised = |jet: &Jet<S>| {
            let powers = powers_of(self.replaced, jet, &self.space);
            power_series_at(&powers, &self.coordinate)
        };
        jets.iter().map(raised).collect()
    }

    /// The variables (coordinates; parameters) themselves.
    pub(super) fn variables(&self) -> Vec<Jet<S>> {
        let variable = |number: usize| match number == self.replaced {
            true => self.coordinate.clone(),
            false => Jet::variable(&self.space, 1 + number, S::zero()),
        };
        (0..self.space.variables() - 1).map(variable).collect()
    }
}

/// What multiplies each power of a variable of a jet in (coordinates; parameters), in a space of
/// `(y; coordinates; parameters)`.
fn powers_of<S: Real>(variable: usize, jet: &Jet<S>, space: &Arc<JetSpace>) -> Vec<Jet<S>> {
    let mut powers = vec![Jet::zero(space)];
    let mut others = vec![0; space.variables()];
    for (exponents, value) in jet.terms().filter(|(_, value)| *value != S::zero()) {
        others[1..].copy_from_slice(exponents);
        let power = usize::from(std::mem::take(&mut others[1 + variable]));
        if powers.len() <= power {
            powers.resize_with(power + 1, || Jet::zero(space));
        }
        if let Some(monomial) = space.monomial(&others) {
            powers[power].coefficients_mut()[monomial] = value;
        }
    }
    powers
}

/// The space of `(y; coordinates; parameters)` in which one coordinate is too heavy to have a
/// monomial.
fn space_without(
    replaced: usize,
    variables: &Variables,
    weight: u32,
) -> Result<Arc<JetSpace>, ExpansionError> {
    let mut others = variables.clone();
    others.weights[replaced] = weight + 1;
    others.contact_space(weight)
}

/// The coordinate to replace: of those the depth depends on, the lightest, of these the steepest.
///
/// # Errors
///
/// [`ExpansionError::DepthWithoutSlope`].
pub(super) fn steepest_coordinate<S: Real>(
    depth: &Jet<S>,
    variables: &Variables,
) -> Result<usize, ExpansionError> {
    let slope = |coordinate: usize| {
        let monomial = depth.space().linear_monomial(coordinate);
        monomial.map_or(0.0, |monomial| depth.coefficients()[monomial].magnitude())
    };
    let largest = (0..variables.coordinates).map(slope).fold(0.0, f64::max);
    (0..variables.coordinates)
        .filter(|&coordinate| slope(coordinate) > NO_SLOPE * largest)
        .min_by(|&a, &b| {
            let lighter = variables.weights[a].cmp(&variables.weights[b]);
            lighter.then(slope(b).total_cmp(&slope(a)))
        })
        .ok_or(ExpansionError::DepthWithoutSlope)
}
