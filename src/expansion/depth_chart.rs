//! `y²` in the place of a coordinate.
//!
//! One idea: `y² = u(c, p)`, `u = −h_min`, makes one of the variables `(y; c, p)` redundant. Where a step of
//! a passage divides by `y` that matters: `y² − u` vanishes, but not as a polynomial. Solving the relation
//! for one coordinate, `c_j = c_j(y²; c', p)`, leaves variables that are independent.

use std::sync::Arc;

use super::ExpansionError;
use super::variables::Variables;
use crate::jet::{Jet, JetSpace, implicit_root, substitute_all};
use crate::numeric::Real;

/// Slopes of the depth below this share of the largest count as none.
const NO_SLOPE: f64 = 1e-9;

/// The variables (coordinates; parameters) as jets in `(y; c', p)`.
#[derive(Clone, Debug)]
pub(super) struct DepthChart<S: Real> {
    /// Space of `(y; coordinates; parameters)`, without a monomial in the replaced coordinate.
    pub(super) space: Arc<JetSpace>,
    inner: Vec<Jet<S>>,
}

impl<S: Real> DepthChart<S> {
    /// Solves `u = y²` for a coordinate, to a weighted degree; `depth` is `u` in (coordinates; parameters).
    ///
    /// # Errors
    ///
    /// [`ExpansionError::DepthWithoutSlope`] if the depth does not depend on any coordinate at first order,
    /// [`ExpansionError::Jet`] if the space would be too large.
    pub(super) fn new(
        depth: &Jet<S>,
        variables: &Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let replaced = steepest_coordinate(depth, variables)?;
        let space = &space_without(replaced, variables, weight)?;
        let mut inner: Vec<_> = (0..variables.len())
            .map(|variable| Jet::variable(space, 1 + variable, S::zero()))
            .collect();
        // The depth vanishes on the grazing orbit: its constant term is rounding.
        let depth = depth.add_constant(-depth.head());
        let relation = [depth.derivative(replaced), depth];
        let y = Jet::variable(space, 0, S::zero());
        let square = &y * &y;
        inner[replaced] = implicit_root(&Jet::zero(space), |coordinate| {
            inner[replaced] = coordinate.clone();
            let mut values = substitute_all(&relation, &inner);
            let depth = values.swap_remove(1);
            (&depth - &square, values.swap_remove(0))
        })?;
        let space = Arc::clone(space);
        Ok(Self { space, inner })
    }

    /// Jets in (coordinates; parameters) as jets in `(y; c', p)`.
    pub(super) fn raise(&self, jets: &[Jet<S>]) -> Vec<Jet<S>> {
        substitute_all(jets, &self.inner)
    }
}

/// The space of `(y; coordinates; parameters)` in which one coordinate is too heavy to have a monomial.
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
