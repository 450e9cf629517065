//! The jet itself, a truncated power series in a [`JetSpace`]: its arithmetic, its derivative and
//! integral, its values as a polynomial.
//!
//! Files hold the weights and the order of a jet's space, and all coefficients in the order of its
//! monomials. Jets that were read share one space if their spaces are equal, because operators
//! require one space.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::graded::Graded;
use super::{JetError, JetSpace};
use crate::numeric::{Dd, Real, Scalar};

/// A truncated power series: one coefficient per monomial of its space.
///
/// ```
/// use grazemap_jet::jet::{Jet, JetSpace};
/// let space = JetSpace::uniform(2, 3)?;
/// let (x, y) = (Jet::variable(&space, 0, 0.0_f64), Jet::variable(&space, 1, 0.0));
/// let product = &(&x + &y).exp() * &(&x - &y).exp(); // exp(2x)
/// let cube = space.monomial(&[3, 0]).expect("x³ is kept at order 3");
/// assert!((product.coefficients()[cube] - 8.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
///
/// Operators combine jets of the *same* space (the same `Arc`); mixing spaces is a programming
/// error and panics. Elementary functions whose head lies outside their domain give NaN
/// coefficients, as `f64` does: check with [`is_finite`](Jet::is_finite).
#[derive(Clone, Debug)]
pub struct Jet<S: Scalar> {
    pub(super) space: Arc<JetSpace>,
    pub(super) coefficients: Vec<S>,
}

impl<S: Scalar> Jet<S> {
    /// The zero jet.
    pub fn zero(space: &Arc<JetSpace>) -> Self {
        Self { space: Arc::clone(space), coefficients: vec![S::zero(); space.len()] }
    }

    /// A constant.
    pub fn constant(space: &Arc<JetSpace>, value: S) -> Self {
        let mut jet = Self::zero(space);
        jet.coefficients[0] = value;
        jet
    }

    /// `value + x_variable` (the constant alone if the space keeps no linear term of that weight).
    pub fn variable(space: &Arc<JetSpace>, variable: usize, value: S) -> Self {
        let mut jet = Self::constant(space, value);
        if let Some(monomial) = space.linear_monomial(variable) {
            jet.coefficients[monomial] = S::one();
        }
        jet
    }

    /// A jet from its coefficients, in the space's order of monomials.
    ///
    /// # Panics
    ///
    /// If the number of coefficients is not [`JetSpace::len`].
    pub fn from_coefficients(space: &Arc<JetSpace>, coefficients: Vec<S>) -> Self {
        assert_eq!(
            coefficients.len(),
            space.len(),
            "a jet has one coefficient per monomial of its space"
        );
        Self { space: Arc::clone(space), coefficients }
    }

    /// The space.
    pub fn space(&self) -> &Arc<JetSpace> {
        &self.space
    }

    /// All coefficients, by number of the monomial.
    pub fn coefficients(&self) -> &[S] {
        &self.coefficients
    }

    /// All coefficients, mutable.
    pub fn coefficients_mut(&mut self) -> &mut [S] {
        &mut self.coefficients
    }

    /// The constant term.
    pub fn head(&self) -> S {
        self.coefficients[0]
    }

    /// The exponents and the coefficient of every monomial, zeros included, by ascending degree.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let jet = Jet::variable(&JetSpace::uniform(2, 1)?, 1, 3.0);
    /// let terms: Vec<_> = jet.terms().map(|(powers, value)| (powers.to_vec(), value)).collect();
    /// assert_eq!(terms, [(vec![0, 0], 3.0), (vec![1, 0], 0.0), (vec![0, 1], 1.0)]);
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn terms(&self) -> impl Iterator<Item = (&[u8], S)> {
        self.coefficients
            .iter()
            .enumerate()
            .map(|(monomial, &value)| (self.space.exponents(monomial), value))
    }

    /// The coefficient of the monomial with these exponents; zero if the space does not keep it.
    pub fn coefficient(&self, exponents: &[u8]) -> S {
        self.space.monomial(exponents).map_or(S::zero(), |monomial| self.coefficients[monomial])
    }

    /// The coefficients of one weighted degree.
    ///
    /// # Panics
    ///
    /// If the degree exceeds the order.
    pub fn part(&self, degree: usize) -> &[S] {
        &self.coefficients[self.space.degree_range(degree)]
    }

    /// Lowest degree with a coefficient other than zero; `None` for the zero jet.
    pub fn lowest_degree(&self) -> Option<usize> {
        self.coefficients
            .iter()
            .position(|&value| value != S::zero())
            .map(|monomial| self.space.degree(monomial))
    }

    /// Largest absolute coefficient of one degree (over all lanes); 0 above the order.
    ///
    /// NaN if a coefficient of the degree is NaN.
    pub fn max_abs_of_degree(&self, degree: usize) -> f64 {
        if degree > self.space.order() {
            return 0.0;
        }
        largest(self.part(degree))
    }

    /// Largest absolute coefficient (over all lanes); NaN if a coefficient is NaN.
    pub fn max_abs(&self) -> f64 {
        largest(&self.coefficients)
    }

    /// The jet with every term above a degree set to zero, in the same space.
    pub fn truncate(&self, order: usize) -> Self {
        let mut truncated = self.clone();
        truncated.coefficients[self.space.degree_start(order.saturating_add(1))..].fill(S::zero());
        truncated
    }

    /// The jet in another space: variable `v` becomes variable `variable_map[v]` of `target`, or
    /// zero where that is `None`. Terms that `target` does not keep are dropped.
    ///
    /// # Panics
    ///
    /// If `variable_map` has not one entry per variable, or names a variable that `target` lacks.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let (line, plane) = (JetSpace::uniform(1, 2)?, JetSpace::uniform(2, 2)?);
    /// let x = Jet::variable(&line, 0, 1.0);
    /// assert_eq!(x.reinterpret(&plane, &[Some(1)]), Jet::variable(&plane, 1, 1.0));
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn reinterpret(&self, target: &Arc<JetSpace>, variable_map: &[Option<usize>]) -> Self {
        assert_eq!(variable_map.len(), self.space.variables(), "one entry per variable");
        let mut image = Self::zero(target);
        let mut powers = vec![0u8; target.variables()];
        for (exponents, value) in self.terms() {
            if rename(exponents, variable_map, &mut powers)
                && let Some(monomial) = target.monomial(&powers)
            {
                image.coefficients[monomial] += value;
            }
        }
        image
    }

    /// The jet with every coefficient converted to another type of scalar.
    pub fn map_scalars<T: Scalar>(&self, f: impl FnMut(S) -> T) -> Jet<T> {
        Jet {
            space: Arc::clone(&self.space),
            coefficients: self.coefficients.iter().copied().map(f).collect(),
        }
    }

    /// Whether the jet lies in this space (the same `Arc`).
    pub fn is_in(&self, space: &Arc<JetSpace>) -> bool {
        Arc::ptr_eq(&self.space, space)
    }

    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        self.coefficients.iter().all(|value| value.is_finite())
    }

    /// The jet times a number.
    pub fn scale(&self, factor: S) -> Self {
        self.map(|value| value * factor)
    }

    /// The jet plus a number.
    pub fn add_constant(&self, value: S) -> Self {
        let mut sum = self.clone();
        sum.coefficients[0] += value;
        sum
    }

    pub(super) fn map(&self, f: impl Fn(S) -> S) -> Self {
        Self {
            space: Arc::clone(&self.space),
            coefficients: self.coefficients.iter().map(|&value| f(value)).collect(),
        }
    }

    pub(super) fn assert_same_space(&self, other: &Self) {
        assert!(
            Arc::ptr_eq(&self.space, &other.space),
            "jets of different spaces cannot be combined"
        );
    }
}

impl<S: Real> Jet<S> {
    /// The jet with its coefficients rounded to `f64`.
    pub fn to_f64(&self) -> Jet<f64> {
        self.map_scalars(S::to_f64)
    }

    /// The jet with its coefficients as double-doubles (exact).
    pub fn to_dd(&self) -> Jet<Dd> {
        self.map_scalars(S::to_dd)
    }
}

/// Equal when the spaces keep the same monomials and all coefficients are equal.
impl<S: Scalar> PartialEq for Jet<S> {
    fn eq(&self, other: &Self) -> bool {
        self.space.keeps_the_same(&other.space) && self.coefficients == other.coefficients
    }
}

/// Largest magnitude; NaN if a value is NaN.
fn largest<S: Scalar>(values: &[S]) -> f64 {
    let larger = |max: f64, value: f64| if value <= max { max } else { value };
    values.iter().map(|value| value.magnitude()).fold(0.0, larger)
}

/// Exponents under renamed variables; `false` if the monomial vanishes or has an exponent above
/// 255.
fn rename(exponents: &[u8], variable_map: &[Option<usize>], powers: &mut [u8]) -> bool {
    powers.fill(0);
    exponents.iter().zip(variable_map).filter(|(exponent, _)| **exponent > 0).all(
        |(&exponent, &variable)| {
            let sum = variable.and_then(|variable| powers[variable].checked_add(exponent));
            if let (Some(variable), Some(sum)) = (variable, sum) {
                powers[variable] = sum;
            }
            sum.is_some()
        },
    )
}

impl<S: Scalar> Jet<S> {
    /// `out = self · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the three jets are not of one space.
    pub fn multiply_into(&self, other: &Self, out: &mut Self) {
        self.assert_same_space(other);
        self.assert_same_space(out);
        let space = self.space();
        space.multiply(self.coefficients(), other.coefficients(), out.coefficients_mut());
    }

    /// `out += self · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the three jets are not of one space.
    pub fn multiply_add_into(&self, other: &Self, out: &mut Self) {
        self.assert_same_space(other);
        self.assert_same_space(out);
        let space = self.space();
        space.multiply_add(self.coefficients(), other.coefficients(), out.coefficients_mut());
    }

    /// `self += factor · other`, without allocating.
    ///
    /// # Panics
    ///
    /// If the jets are not of one space.
    pub fn add_scaled(&mut self, factor: S, other: &Self) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value = factor.mul_add(term, *value);
        }
    }

    /// `self *= factor`, without allocating.
    pub fn scale_in_place(&mut self, factor: S) {
        for value in self.coefficients_mut() {
            *value *= factor;
        }
    }
}

impl<S: Scalar> AddAssign<&Jet<S>> for Jet<S> {
    fn add_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value += term;
        }
    }
}

impl<S: Scalar> SubAssign<&Jet<S>> for Jet<S> {
    fn sub_assign(&mut self, other: &Jet<S>) {
        self.assert_same_space(other);
        for (value, &term) in self.coefficients_mut().iter_mut().zip(other.coefficients()) {
            *value -= term;
        }
    }
}

impl<S: Scalar> Add for &Jet<S> {
    type Output = Jet<S>;
    fn add(self, other: Self) -> Jet<S> {
        let mut sum = self.clone();
        sum += other;
        sum
    }
}

impl<S: Scalar> Sub for &Jet<S> {
    type Output = Jet<S>;
    fn sub(self, other: Self) -> Jet<S> {
        let mut difference = self.clone();
        difference -= other;
        difference
    }
}

impl<S: Scalar> Neg for &Jet<S> {
    type Output = Jet<S>;
    fn neg(self) -> Jet<S> {
        self.map(|value| -value)
    }
}

impl<S: Scalar> Mul for &Jet<S> {
    type Output = Jet<S>;
    fn mul(self, other: Self) -> Jet<S> {
        self.assert_same_space(other);
        let mut product = Jet::zero(self.space());
        self.multiply_add_into(other, &mut product);
        product
    }
}

impl<S: Scalar> Div for &Jet<S> {
    type Output = Jet<S>;
    fn div(self, other: Self) -> Jet<S> {
        self.assert_same_space(other);
        Jet::build(self.space(), |k, u, out| {
            let operands = (self.coefficients(), other.coefficients());
            self.space().quotient_part(k, operands, u, out);
        })
    }
}

impl<S: Scalar> Jet<S> {
    /// Derivative by a variable, in the same space.
    ///
    /// ```text
    /// (∂a/∂x_v)_e = (e_v + 1) a_{e + 1_v}
    /// ```
    ///
    /// NOTE: the derivative of a series known to the order is known only to the order less the
    /// variable's weight; the coefficients above are zero, not those of the true derivative.
    ///
    /// # Panics
    ///
    /// If the space has no such variable.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let x = Jet::variable(&JetSpace::uniform(1, 4)?, 0, 0.0);
    /// assert_eq!(x.power_integer(3).derivative(0), (&x * &x).scale(3.0));
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn derivative(&self, variable: usize) -> Self {
        let mut derivative = Self::zero(&self.space);
        self.for_each_neighbour(variable, |lower, upper, exponent| {
            derivative.coefficients[lower] =
                self.coefficients[upper] * S::from_f64(f64::from(exponent));
        });
        derivative
    }

    /// Integral by a variable from 0, to the order of the space.
    ///
    /// ```text
    /// (∫a dx_v)_{e + 1_v} = a_e / (e_v + 1)
    /// ```
    ///
    /// # Panics
    ///
    /// If the space has no such variable.
    pub fn integral(&self, variable: usize) -> Self {
        let mut integral = Self::zero(&self.space);
        self.for_each_neighbour(variable, |lower, upper, exponent| {
            integral.coefficients[upper] =
                self.coefficients[lower] / S::from_f64(f64::from(exponent));
        });
        integral
    }

    /// Calls `visit` for every pair `upper = lower · x_variable` of kept monomials, with the
    /// exponent of the variable in `upper`.
    fn for_each_neighbour(&self, variable: usize, mut visit: impl FnMut(usize, usize, u8)) {
        assert!(variable < self.space.variables(), "no variable {variable} in this space");
        let mut divisor = vec![0u8; self.space.variables()];
        for upper in 1..self.space.len() {
            let exponents = self.space.exponents(upper);
            if exponents[variable] > 0 {
                divisor.copy_from_slice(exponents);
                divisor[variable] -= 1;
                let lower =
                    self.space.monomial(&divisor).expect("a divisor of a kept monomial is kept");
                visit(lower, upper, exponents[variable]);
            }
        }
    }
}

impl JetSpace {
    /// Values of all monomials at a point, written to `values` (resized to the space's length).
    ///
    /// Several jets of one space at one point share the monomials: the value of each jet is then
    /// [`Jet::evaluate_on`] these monomials.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per variable.
    pub fn monomials_at<S: Scalar>(&self, point: &[S], values: &mut Vec<S>) {
        assert_eq!(point.len(), self.variables(), "a point has one coordinate per variable");
        values.clear();
        values.push(S::one());
        for monomial in 1..self.len() {
            let (parent, variable) = self.parent(monomial);
            values.push(values[parent] * point[variable]);
        }
    }
}

impl<S: Scalar> Jet<S> {
    /// Number of coefficients that are not zero.
    pub fn nonzero(&self) -> usize {
        let values = self.coefficients.iter();
        values.filter(|&&value| value != S::zero()).count()
    }

    /// Value at a point, one coordinate per variable.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per variable.
    ///
    /// ```
    /// use grazemap_jet::jet::{Jet, JetSpace};
    /// let space = JetSpace::uniform(2, 2)?;
    /// let (x, y) = (Jet::variable(&space, 0, 1.0), Jet::variable(&space, 1, 0.0));
    /// assert_eq!((&x * &y).evaluate(&[2.0, 5.0]), 15.0); // (1 + 2) · 5
    /// # Ok::<(), grazemap_jet::jet::JetError>(())
    /// ```
    pub fn evaluate(&self, point: &[S]) -> S {
        let mut monomials = Vec::with_capacity(self.space.len());
        self.space.monomials_at(point, &mut monomials);
        self.evaluate_on(&monomials)
    }

    /// Value at the point for which [`JetSpace::monomials_at`] gave the monomials.
    ///
    /// Small terms are added first.
    pub fn evaluate_on(&self, monomials: &[S]) -> S {
        let terms = self.coefficients.iter().zip(monomials).rev();
        terms.fold(S::zero(), |sum, (&coefficient, &monomial)| coefficient.mul_add(monomial, sum))
    }

    /// Value at a point; the derivatives by each variable are written to `gradient`.
    ///
    /// # Panics
    ///
    /// If the point or the gradient has not one entry per variable.
    pub fn evaluate_with_gradient(&self, point: &[S], gradient: &mut [S]) -> S {
        assert_eq!(gradient.len(), self.space.variables(), "a gradient has one entry per variable");
        let mut monomials = Vec::with_capacity(self.space.len());
        self.space.monomials_at(point, &mut monomials);
        gradient.fill(S::zero());
        let mut adjoints = self.coefficients.clone();
        for monomial in (1..self.space.len()).rev() {
            let (parent, variable) = self.space.parent(monomial);
            let adjoint = adjoints[monomial];
            gradient[variable] = adjoint.mul_add(monomials[parent], gradient[variable]);
            adjoints[parent] = adjoint.mul_add(point[variable], adjoints[parent]);
        }
        self.evaluate_on(&monomials)
    }
}

/// Spaces of jets that were read and are still in use.
static READ: Mutex<Vec<Weak<JetSpace>>> = Mutex::new(Vec::new());

/// The space with these weights and this order; equal spaces of earlier jets are reused while they
/// are in use.
fn shared_space(weights: &[u32], order: usize) -> Result<Arc<JetSpace>, JetError> {
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    read.retain(|space| space.strong_count() > 0);
    let mut living = read.iter().filter_map(Weak::upgrade);
    if let Some(space) = living.find(|space| space.order() == order && space.weights() == weights) {
        return Ok(space);
    }
    let space = JetSpace::new(weights, order)?;
    read.push(Arc::downgrade(&space));
    Ok(space)
}

/// A jet as it is stored in files.
#[derive(Serialize, Deserialize)]
struct Saved<W, C> {
    weights: W,
    order: usize,
    coefficients: C,
}

impl<S: Scalar + Serialize> Serialize for Jet<S> {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        let saved = Saved {
            weights: self.space().weights(),
            order: self.space().order(),
            coefficients: self.coefficients(),
        };
        saved.serialize(serializer)
    }
}

impl<'de, S: Scalar + Deserialize<'de>> Deserialize<'de> for Jet<S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved: Saved<Vec<u32>, Vec<S>> = Deserialize::deserialize(deserializer)?;
        let space = shared_space(&saved.weights, saved.order).map_err(D::Error::custom)?;
        let (expected, found) = (space.len(), saved.coefficients.len());
        if expected != found {
            let message = format!("a jet has {found} coefficients where its space has {expected}");
            return Err(D::Error::custom(message));
        }
        Ok(Self::from_coefficients(&space, saved.coefficients))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1 + 2x + 3y + 4x² + 5xy + 6y²`.
    fn quadratic() -> Jet<f64> {
        let space = JetSpace::uniform(2, 2).unwrap();
        Jet::from_coefficients(&space, (1..=6).map(f64::from).collect())
    }

    #[test]
    fn reinterpretation_swaps_merges_and_drops_variables() {
        let jet = quadratic();
        let swapped = jet.reinterpret(jet.space(), &[Some(1), Some(0)]);
        assert_eq!(swapped.coefficients(), [1.0, 3.0, 2.0, 6.0, 5.0, 4.0]);
        let line = JetSpace::uniform(1, 3).unwrap();
        assert_eq!(
            jet.reinterpret(&line, &[Some(0), Some(0)]).coefficients(),
            [1.0, 5.0, 15.0, 0.0]
        );
        assert_eq!(jet.reinterpret(&line, &[None, Some(0)]).coefficients(), [1.0, 3.0, 6.0, 0.0]);
    }

    #[test]
    fn reinterpretation_drops_what_a_weighted_space_does_not_keep() {
        let target = JetSpace::new(&[1, 2], 2).unwrap(); // 1, x, x², y
        let image = quadratic().reinterpret(&target, &[Some(0), Some(1)]);
        assert_eq!(image.coefficients(), [1.0, 2.0, 4.0, 3.0]);
    }

    #[test]
    fn truncation_keeps_terms_up_to_its_degree() {
        assert_eq!(quadratic().truncate(1).coefficients(), [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!(quadratic().truncate(usize::MAX), quadratic());
    }

    #[test]
    fn degrees_are_measured_one_by_one() {
        let jet = quadratic();
        assert_eq!([0, 1, 2, 3].map(|degree| jet.max_abs_of_degree(degree)), [1.0, 3.0, 6.0, 0.0]);
        assert_eq!(jet.lowest_degree(), Some(0));
        assert_eq!((&jet - &jet.truncate(1)).lowest_degree(), Some(2));
        assert_eq!(Jet::<f64>::zero(jet.space()).lowest_degree(), None);
        assert!(jet.scale(f64::NAN).max_abs_of_degree(1).is_nan());
    }

    #[test]
    fn roots_and_logarithms_outside_their_domain_are_not_finite() {
        let x = Jet::variable(&JetSpace::uniform(1, 3).unwrap(), 0, 0.0);
        assert!(!x.sqrt().is_finite());
        assert!(!x.ln().is_finite());
        assert!(!x.power_real(1.5).is_finite());
        assert!(!x.add_constant(-1.0).sqrt().is_finite());
        assert!(!x.add_constant(1.0).asin().is_finite());
        assert!(!x.atan2(&x).is_finite());
        assert!(!x.power_integer(-1).is_finite());
    }

    #[test]
    fn jets_that_were_read_have_their_bits_and_share_their_space() {
        let space = JetSpace::new(&[1, 2], 3).expect("small");
        let jet = Jet::variable(&space, 0, 0.1_f64).exp();
        let text = serde_json::to_string(&[&jet, &jet]).expect("numbers");
        let [a, b]: [Jet<f64>; 2] = serde_json::from_str(&text).expect("two jets");
        let bits = |jet: &Jet<f64>| -> Vec<u64> {
            jet.coefficients().iter().map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&a), bits(&jet));
        assert!(a.is_in(b.space()) && a.space().weights() == [1, 2]);
        let short = r#"{"weights": [1], "order": 1, "coefficients": [1.0]}"#;
        assert!(serde_json::from_str::<Jet<f64>>(short).is_err());
        let zero = r#"{"weights": [0], "order": 1, "coefficients": [1.0]}"#;
        assert!(serde_json::from_str::<Jet<f64>>(zero).is_err());
    }
}
