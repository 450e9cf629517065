//! Maps given by jets: composition and inversion.
//!
//! One idea: a vector of jets of one space is a truncated Taylor map of its variables; such maps
//! compose by substitution, and those with an invertible linear part form a group.
//!
//! Composition substitutes jets for the variables of jets. One idea: the monomials of the outer
//! space form a tree (each is its parent times one variable). A depth-first walk needs one product
//! of inner jets per monomial and one jet of storage per level, serves every outer jet at once, and
//! prunes branches that vanish by truncation or zero coefficients. Multiplication by an inner jet
//! that is a variable of its space, such as a parameter that a map carries along, only renumbers
//! monomials.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{Jet, JetError, JetSpace, solve_linear};
use crate::numeric::Scalar;

/// `outer(inner_1, …, inner_m)`, to the order of the inner jets' space.
///
/// The outer jet is read as a polynomial in its `m` variables; the result lies in the space of the
/// inner jets. It is the truncated series of the composition of the functions behind the jets only
/// if every inner jet begins at the weight of its variable or above (no constant term, where
/// weights are 1).
///
/// # Panics
///
/// If the number of inner jets is not the number of outer variables or is zero, or if the inner
/// jets are not of one space.
///
/// ```
/// use grazemap_jet::jet::{substitute, Jet, JetSpace};
/// let line = JetSpace::uniform(1, 6)?;
/// let x = Jet::variable(&line, 0, 0.0);
/// let composed = substitute(&x.exp(), &[x.add_constant(1.0).ln()]); // exp(log(1 + x))
/// assert!((&composed - &x.add_constant(1.0)).max_abs() < 1e-15);
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
pub fn substitute<S: Scalar>(outer: &Jet<S>, inner: &[Jet<S>]) -> Jet<S> {
    substitute_all(std::slice::from_ref(outer), inner)
        .pop()
        .expect("one outer jet gives one result")
}

/// [`substitute`] for several outer jets of one space, which share the powers of the inner jets.
///
/// # Panics
///
/// Under the conditions of [`substitute`], and if the outer jets are not of one space.
pub fn substitute_all<S: Scalar>(outer: &[Jet<S>], inner: &[Jet<S>]) -> Vec<Jet<S>> {
    let Some(first) = inner.first() else { panic!("composition needs at least one inner jet") };
    Substitution::new().run(outer, inner, first.space().order())
}

/// Scratch memory of compositions, for reuse.
#[derive(Clone, Debug)]
pub struct Substitution<S: Scalar> {
    /// One product of inner jets per level of the walk.
    levels: Vec<Vec<S>>,
    /// Whether an outer monomial or a descendant has a nonzero coefficient, one flag per monomial.
    needed: Vec<bool>,
}

impl<S: Scalar> Default for Substitution<S> {
    fn default() -> Self {
        Self::new()
    }
}

/// The operands of a walk.
struct Walk<'a, S: Scalar> {
    outer_space: &'a JetSpace,
    inner_space: &'a JetSpace,
    outer: &'a [Jet<S>],
    inner: &'a [Jet<S>],
    /// Lowest degree of every inner jet; above the order for the zero jet.
    lowest: Vec<usize>,
    /// For every inner jet that is a variable: the numbers of the products of monomials and
    /// variable.
    shifts: Vec<Option<Vec<Option<usize>>>>,
    needed: &'a [bool],
    order: usize,
}

/// A node of the tree: an outer monomial and the corresponding product of inner jets.
struct Place {
    monomial: usize,
    last_variable: usize,
    level: usize,
    /// Degree below which the product is known to vanish.
    low: usize,
}

impl<S: Scalar> Substitution<S> {
    /// Empty scratch.
    pub fn new() -> Self {
        Self { levels: Vec::new(), needed: Vec::new() }
    }

    /// [`substitute_all`] with this scratch, cut at a degree of the inner space (at most its
    /// order).
    ///
    /// # Panics
    ///
    /// Under the conditions of [`substitute_all`].
    pub fn run(&mut self, outer: &[Jet<S>], inner: &[Jet<S>], order: usize) -> Vec<Jet<S>> {
        let Some(first) = outer.first() else {
            return Vec::new();
        };
        let (outer_space, inner_space) = (first.space(), inner[0].space());
        assert_eq!(
            inner.len(),
            outer_space.variables(),
            "composition needs one inner jet per outer variable"
        );
        outer.iter().for_each(|jet| jet.assert_same_space(first));
        inner.iter().for_each(|jet| jet.assert_same_space(&inner[0]));
        self.mark_needed(outer_space, outer);
        let mut results = vec![Jet::zero(inner_space); outer.len()];
        for (result, jet) in results.iter_mut().zip(outer) {
            result.coefficients[0] = jet.head();
        }
        let lowest = inner.iter().map(|jet| jet.lowest_degree().unwrap_or(usize::MAX)).collect();
        let order = order.min(inner_space.order());
        let walk = Walk {
            outer_space,
            inner_space,
            outer,
            inner,
            lowest,
            shifts: inner.iter().map(shift).collect(),
            needed: &self.needed,
            order,
        };
        let root = Place { monomial: 0, last_variable: 0, level: 0, low: 0 };
        walk.visit(&root, &mut vec![0; outer_space.variables()], &mut self.levels, &mut results);
        results
    }

    fn mark_needed(&mut self, space: &JetSpace, outer: &[Jet<S>]) {
        self.needed.clear();
        self.needed.extend(
            (0..space.len()).map(|m| outer.iter().any(|jet| jet.coefficients[m] != S::zero())),
        );
        for monomial in (1..space.len()).rev() {
            let (parent, _) = space.parent(monomial);
            self.needed[parent] |= self.needed[monomial];
        }
    }
}

/// For a jet that is a variable of its space: for each monomial the number of its product with that
/// variable; `None` if the space does not keep the product.
fn shift<S: Scalar>(jet: &Jet<S>) -> Option<Vec<Option<usize>>> {
    let space = jet.space();
    let mut terms = jet.terms().filter(|(_, value)| *value != S::zero());
    let (variable, value) = terms.next()?;
    let degree: u32 = variable.iter().map(|&exponent| u32::from(exponent)).sum();
    if terms.next().is_some() || degree != 1 || value != S::one() {
        return None;
    }
    let mut product = vec![0u8; space.variables()];
    let shifted = |monomial: usize| {
        let factors = space.exponents(monomial).iter().zip(variable);
        for (exponent, (a, b)) in product.iter_mut().zip(factors) {
            *exponent = a.checked_add(*b)?;
        }
        space.monomial(&product)
    };
    Some((0..space.len()).map(shifted).collect())
}

impl<S: Scalar> Walk<'_, S> {
    /// Visits the children of a node: the products with its last variable and every later one.
    fn visit(
        &self,
        place: &Place,
        powers: &mut [u8],
        levels: &mut Vec<Vec<S>>,
        results: &mut [Jet<S>],
    ) {
        for variable in place.last_variable..self.inner.len() {
            let low = place.low.saturating_add(self.lowest[variable]);
            if low > self.order {
                continue;
            }
            let Some(exponent) = powers[variable].checked_add(1) else {
                continue;
            };
            powers[variable] = exponent;
            if let Some(monomial) =
                self.outer_space.monomial(powers).filter(|&monomial| self.needed[monomial])
            {
                let child =
                    Place { monomial, last_variable: variable, level: place.level + 1, low };
                self.multiply(place, variable, low, levels);
                self.collect(&child, &levels[place.level], results);
                self.visit(&child, powers, levels, results);
            }
            powers[variable] -= 1;
        }
    }

    /// Writes the product of the node with one inner jet to the node's level.
    fn multiply(&self, place: &Place, variable: usize, low: usize, levels: &mut Vec<Vec<S>>) {
        if levels.len() <= place.level {
            levels.resize_with(place.level + 1, Vec::new);
        }
        let (before, target) = levels.split_at_mut(place.level);
        let target = &mut target[0];
        target.resize(self.inner_space.len(), S::zero());
        let factor = self.inner[variable].coefficients();
        match (before.last(), &self.shifts[variable]) {
            (None, _) => target.copy_from_slice(factor),
            (Some(product), Some(shift)) => {
                let within = |degree| self.inner_space.degree_start(degree);
                target[within(low)..within(self.order + 1)].fill(S::zero());
                for monomial in within(place.low)..within(self.order + 1) {
                    if let Some(shifted) = shift[monomial] {
                        target[shifted] = product[monomial];
                    }
                }
            }
            (Some(product), None) => {
                let right = (factor, self.lowest[variable]);
                self.inner_space.multiply_between((product, place.low), right, self.order, target);
            }
        }
        debug_assert!(low <= self.order);
    }

    /// Adds the node's product, times its coefficients, to the results.
    fn collect(&self, place: &Place, product: &[S], results: &mut [Jet<S>]) {
        let kept =
            self.inner_space.degree_start(place.low)..self.inner_space.degree_start(self.order + 1);
        for (result, jet) in results.iter_mut().zip(self.outer) {
            let coefficient = jet.coefficients[place.monomial];
            if coefficient != S::zero() {
                for (value, &term) in
                    result.coefficients[kept.clone()].iter_mut().zip(&product[kept.clone()])
                {
                    *value = coefficient.mul_add(term, *value);
                }
            }
        }
    }
}

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
    /// The result is the truncation of the composed functions under the condition of
    /// [`substitute`]: each component of `inner` begins at the weight of its variable or above.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_of_the_inner_space_multiply_as_any_jet_does() {
        let outer_space = JetSpace::uniform(3, 4).unwrap();
        let whole = |m: usize| ((m * 7) % 11) as f64 - 5.0;
        let coefficients = (0..outer_space.len()).map(whole).collect();
        let outer = Jet::from_coefficients(&outer_space, coefficients);
        let space = JetSpace::new(&[1, 2], 5).unwrap();
        let [y, x] = [0, 1].map(|variable| Jet::variable(&space, variable, 0.0));
        let inner = [&y + &(&y * &x).scale(3.0), x, y];
        let expected = outer.terms().fold(Jet::zero(&space), |sum, (powers, value)| {
            let factors = inner.iter().zip(powers);
            let product = factors.fold(Jet::constant(&space, value), |product, (jet, &power)| {
                (0..power).fold(product, |product, _| &product * jet)
            });
            &sum + &product
        });
        assert_eq!(substitute(&outer, &inner), expected);
    }
}
