//! Maps given by jets: composition and inversion.
//!
//! One idea: a vector of jets of one space is a truncated Taylor map of its variables; such maps
//! compose by substitution, and those with an invertible linear part form a group.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{Jet, JetError, JetSpace, Substitution, solve_linear, substitute_all};
use crate::numeric::Scalar;

/// A Taylor map: one jet per component of the image, all of one space.
///
/// ```
/// use grazemap_jet::jet::{Jet, JetMap, JetSpace};
/// let space = JetSpace::uniform(2, 5)?;
/// let (x, y) = (Jet::variable(&space, 0, 0.0), Jet::variable(&space, 1, 0.0));
/// let map = JetMap::new(vec![&x + &(&y * &y), &y - &(&x * &x)])?;
/// let identity = map.compose(&map.invert()?)?;
/// assert_eq!(identity, JetMap::identity(&space));
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct JetMap<S: Scalar> {
    components: Vec<Jet<S>>,
}

impl<S: Scalar> JetMap<S> {
    /// A map from its components.
    ///
    /// # Errors
    ///
    /// [`JetError::Empty`] without components, [`JetError::SpaceMismatch`] if they are not of one
    /// space.
    pub fn new(components: Vec<Jet<S>>) -> Result<Self, JetError> {
        let first = components.first().ok_or(JetError::Empty)?;
        match components.iter().position(|jet| !jet.is_in(first.space())) {
            Some(component) => Err(JetError::SpaceMismatch { component }),
            None => Ok(Self { components }),
        }
    }

    /// The identity of a space with at least one variable.
    ///
    /// # Panics
    ///
    /// If the space has no variables.
    pub fn identity(space: &Arc<JetSpace>) -> Self {
        assert!(space.variables() > 0, "a map needs a variable");
        let variable = |variable| Jet::variable(space, variable, S::zero());
        Self { components: (0..space.variables()).map(variable).collect() }
    }

    /// The space of the components.
    pub fn space(&self) -> &Arc<JetSpace> {
        self.components[0].space()
    }

    /// Number of components.
    pub fn dimension(&self) -> usize {
        self.components.len()
    }

    /// The components.
    pub fn components(&self) -> &[Jet<S>] {
        &self.components
    }

    /// The components, by value.
    pub fn into_components(self) -> Vec<Jet<S>> {
        self.components
    }

    /// The linear part: entry `(i, j)` is the derivative of component `i` by variable `j` at 0.
    pub fn linear_part(&self) -> DMatrix<S> {
        let space = self.space();
        DMatrix::from_fn(self.dimension(), space.variables(), |row, column| {
            let monomial = space.linear_monomial(column);
            monomial.map_or(S::zero(), |monomial| self.components[row].coefficients()[monomial])
        })
    }

    /// Image of a point, one coordinate per variable.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per variable.
    pub fn evaluate(&self, point: &[S]) -> Vec<S> {
        let mut monomials = Vec::with_capacity(self.space().len());
        self.space().monomials_at(point, &mut monomials);
        self.components.iter().map(|jet| jet.evaluate_on(&monomials)).collect()
    }

    /// `self ∘ inner`, to the order of the inner map's space; the two spaces may differ.
    ///
    /// The result is the truncation of the composed functions, where constants are carried exactly
    /// as [`substitute`](super::substitute) says.
    ///
    /// # Errors
    ///
    /// [`JetError::DimensionMismatch`] if `inner` has not one component per variable of `self`.
    pub fn compose(&self, inner: &Self) -> Result<Self, JetError> {
        let (expected, found) = (self.space().variables(), inner.dimension());
        if expected != found {
            return Err(JetError::DimensionMismatch { expected, found });
        }
        Ok(Self { components: substitute_all(&self.components, &inner.components) })
    }

    /// The inverse map `G` with `M ∘ G = G ∘ M = id`, to the order.
    ///
    /// With `M = L + N`, `L` linear and `N` without linear terms, `G` is the fixed point of
    ///
    /// ```text
    /// G ← L⁻¹ (id − N ∘ G)
    /// ```
    ///
    /// where every pass makes one more total degree exact.
    ///
    /// # Errors
    ///
    /// [`JetError::DimensionMismatch`] if the map has not one component per variable,
    /// [`JetError::DegreeTooLow`] if a component has a term below its variable's weight (where
    /// weights are 1: a constant), [`JetError::Singular`] if the linear part is not invertible.
    pub fn invert(&self) -> Result<Self, JetError> {
        self.check_invertible()?;
        let space = self.space();
        let inverse = self.inverse_linear()?;
        let identity = Self::identity(space).components;
        let mut nonlinear = self.components.clone();
        for jet in &mut nonlinear {
            for monomial in
                (0..space.variables()).filter_map(|variable| space.linear_monomial(variable))
            {
                jet.coefficients_mut()[monomial] = S::zero();
            }
        }
        let uniform = space.weights().iter().all(|&weight| weight == 1);
        let passes =
            space.order() / space.weights().iter().min().map_or(1, |&weight| weight as usize);
        let (mut scratch, mut result) = (Substitution::new(), combine(&inverse, &identity));
        for pass in 2..=passes {
            let order = if uniform { pass } else { space.order() };
            let mut rest = scratch.run(&nonlinear, &result, order);
            for (rest, variable) in rest.iter_mut().zip(&identity) {
                *rest = variable - rest;
            }
            result = combine(&inverse, &rest);
        }
        Ok(Self { components: result })
    }

    fn check_invertible(&self) -> Result<(), JetError> {
        let (expected, found) = (self.space().variables(), self.dimension());
        if expected != found {
            return Err(JetError::DimensionMismatch { expected, found });
        }
        for (component, (jet, &weight)) in
            self.components.iter().zip(self.space().weights()).enumerate()
        {
            match jet.lowest_degree() {
                Some(degree) if degree < weight as usize => {
                    return Err(JetError::DegreeTooLow { component, degree, weight });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Inverse of the linear part.
    fn inverse_linear(&self) -> Result<DMatrix<S>, JetError> {
        let (size, linear) = (self.dimension(), self.linear_part());
        let numbers = JetSpace::uniform(0, 0)?;
        let number = |value: S| Jet::constant(&numbers, value);
        let rows =
            || (0..size).map(|i| (0..size).map(|j| number(linear[(i, j)])).collect()).collect();
        let mut inverse = DMatrix::from_element(size, size, S::zero());
        for column in 0..size {
            let unit = |row| number(if row == column { S::one() } else { S::zero() });
            for (row, value) in
                solve_linear(rows(), (0..size).map(unit).collect())?.iter().enumerate()
            {
                inverse[(row, column)] = value.head();
            }
        }
        Ok(inverse)
    }
}

/// Linear combinations of jets, one per row.
fn combine<S: Scalar>(matrix: &DMatrix<S>, jets: &[Jet<S>]) -> Vec<Jet<S>> {
    let combination = |row: usize| {
        let mut sum = Jet::zero(jets[0].space());
        for (column, jet) in jets.iter().enumerate() {
            sum.add_scaled(matrix[(row, column)], jet);
        }
        sum
    };
    (0..matrix.nrows()).map(combination).collect()
}
