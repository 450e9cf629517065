//! The composed form: the whole map as one polynomial pass in `(y_1 … y_K; coordinates;
//! parameters)`.
//!
//! If passage `k` makes contact, `y_k² = depth_k(y_1 … y_{k−1}; x, p)`. The relation removes powers
//! of `y_k` above the second or, with one depth variable, all powers of one coordinate. A
//! polynomial in all depth variables is then a list of polynomials in (coordinates; parameters),
//! one for each choice of powers of the `y_k`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::approach::DepthChart;
use super::error::ExpansionError;
use super::local_map::{Contact, Leg, LocalMap, Stage};
use super::variables::{DEVIATION_WEIGHT, Variables, coefficient_of_depth_power, respace};
use crate::jet::{Jet, JetSpace, power_series_at, substitute_all};
use crate::model::MapOrders;
use crate::numeric::{Real, Scalar};

/// The composed form of a map with passages `1 … K`: one polynomial pass in the coordinates, the
/// parameters and the depth variables `y_k = √max(0, depth_k(y_1 … y_{k−1}; x, p))`.
///
/// With one passage, `P_i = smooth_i(x, p) + y linear_i(x, p) + y² quadratic_i(x, p)`. If the
/// return begins with the passage, `P_i = smooth_i(x, p) + Σ_k y^k P_{i,k}(x', p)`; `x'` omits the
/// coordinate along which the depth is steepest.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ComposedMap<S: Scalar = f64> {
    /// Depth `−h_min` of each passage as a function on the section; it depends on the passages
    /// before.
    pub depths: Vec<DepthPolynomial<S>>,
    /// Image: one polynomial per coordinate.
    pub image: Vec<DepthPolynomial<S>>,
}

impl ComposedMap {
    /// Number of coefficients that are not zero.
    pub fn coefficients(&self) -> usize {
        let polynomials = self.depths.iter().chain(&self.image);
        polynomials.map(DepthPolynomial::coefficients).sum()
    }
}

/// Composes a local map.
///
/// With one passage and `P = L₂ ∘ D ∘ L₁` the result is `P_smooth + y B̂ + y² Ĉ`, with
/// `P_smooth = L₂ ∘ L₁`. If the return begins with the contact, `P = L ∘ D`, the result is
/// `P_smooth + Σ_k y^k P_k`, and the `P_k` are free of the coordinate along which the depth is
/// steepest. Terms without a depth variable are kept to the legs' order, terms with one to the
/// larger of the contacts' weight and the legs' order (after a contact a state deviation is `O(y)`,
/// so order `N` of a leg acts at weight `N`).
///
/// # Errors
///
/// [`ExpansionError::Jet`] if the space would be too large, [`ExpansionError::FlownIsNoPolynomial`]
/// for a map with a flown contact.
pub fn compose(map: &LocalMap, variables: &Variables) -> Result<ComposedMap, ExpansionError> {
    let weight = map.orders.contact_weight.max(map.orders.smooth_order);
    let smooth_space = variables.smooth_space(DEVIATION_WEIGHT * map.orders.smooth_order)?;
    let start =
        (0..variables.len()).map(|variable| Jet::variable(&smooth_space, variable, 0.0)).collect();
    let smooth = Composition::of(map, start, |state, _, _| state)?;
    if let Some((Stage::Contact(contact), rest)) = map.stages.split_first()
        && let Some(legs) = only_legs(rest)
    {
        return after_contact(contact, &legs, variables, (weight, map.orders), smooth);
    }
    of_any(map, variables, weight, smooth)
}

/// The stages as legs; `None` if one of them is a contact.
fn only_legs(stages: &[Stage]) -> Option<Vec<&Leg>> {
    let legs = stages.iter().map(|stage| match stage {
        Stage::Leg(leg) => Some(leg),
        Stage::Contact(_) | Stage::Flown(_) => None,
    });
    legs.collect()
}

/// Composes a map that begins with its only contact. In `(y; c', p)`, with the depth variable in
/// place of a coordinate, the contact is one substitution for that coordinate; the corrections
/// remain in these variables.
///
/// NOTE: in all coordinates, by `y² = −h_min`, the correction would be a sum of large terms that
/// cancel if coordinates and parameters are larger than the depth, their difference: `(Q − q)^k`
/// for `y^{2k}`.
fn after_contact(
    contact: &Contact,
    legs: &[&Leg],
    variables: &Variables,
    (weight, orders): (u32, MapOrders),
    smooth: Composition,
) -> Result<ComposedMap, ExpansionError> {
    let chart = DepthChart::new(&contact.depth, variables, weight)?;
    let before = chart.variables();
    let mut after = before.clone();
    let corrections = corrections(contact, &chart, orders.contact_weight);
    after.iter_mut().zip(&corrections).for_each(|(value, correction)| *value += correction);
    let fly_all = |state: Vec<Jet<f64>>| legs.iter().fold(state, |state, leg| fly(leg, &state));
    let pairs = fly_all(after).into_iter().zip(fly_all(before));
    let image = smooth.image.into_iter().zip(pairs);
    let spaces = (1..=weight).map(|power| variables.smooth_space(weight - power));
    let spaces: Vec<_> = spaces.collect::<Result<_, _>>()?;
    let image = image.map(|(smooth, (with, without))| {
        let correction = &with - &without;
        let corrections = (1u8..).zip(&spaces).map(|(power, space)| {
            let coefficient = coefficient_of_depth_power(&correction, power, space);
            (vec![power], coefficient)
        });
        DepthPolynomial::of(std::iter::once((vec![0], smooth)).chain(corrections))
    });
    let depths = smooth.depths.into_iter();
    Ok(ComposedMap {
        image: image.collect(),
        depths: depths.map(|depth| DepthPolynomial::of([(vec![0], depth)])).collect(),
    })
}

/// Correction of each coordinate by a contact, in the variables of a chart and up to a weight: the
/// depth form if it is known, otherwise from the canonical form.
fn corrections(contact: &Contact, chart: &DepthChart<f64>, weight: u32) -> Vec<Jet<f64>> {
    let found = contact.depth_form.as_ref();
    if let Some(form) = found.filter(|form| form.replaced == chart.replaced) {
        let cut = |jet: &Jet<f64>| respace(jet, &chart.space).truncate(weight as usize);
        return form.corrections.iter().map(cut).collect();
    }
    let y = Jet::variable(&chart.space, 0, 0.0);
    let (linear, quadratic) = (chart.raise(&contact.linear), chart.raise(&contact.quadratic));
    let parts = linear.iter().zip(&quadratic);
    parts.map(|(linear, quadratic)| &y * &(linear + &(&y * quadratic))).collect()
}

/// Composes any map, in `(y_1 … y_K; coordinates; parameters)`.
fn of_any(
    map: &LocalMap,
    variables: &Variables,
    weight: u32,
    smooth: Composition,
) -> Result<ComposedMap, ExpansionError> {
    let spaces = DepthSpace::new(map.passages(), variables, weight)?;
    let whole = Composition::of(map, spaces.identity(), |state, contact, passage| {
        act(contact, state, &spaces.depth_variable(passage))
    })?;
    let mut reduced = Vec::new();
    for depth in &whole.depths {
        reduced.push(spaces.reduced(depth, &reduced));
    }
    let image = whole.image.iter().map(|jet| spaces.reduced(jet, &reduced));
    let polynomials = |smooth: Vec<Jet<f64>>, jets: Vec<Jet<f64>>| {
        let pairs = smooth.into_iter().zip(&jets);
        pairs.map(|(smooth, jet)| spaces.polynomial(smooth, jet)).collect::<Result<_, _>>()
    };
    Ok(ComposedMap {
        image: polynomials(smooth.image, image.collect())?,
        depths: polynomials(smooth.depths, reduced)?,
    })
}

/// Result of substituting each stage of a map into the next.
struct Composition {
    /// Depth `−h_min` of each passage.
    depths: Vec<Jet<f64>>,
    /// Image of each coordinate.
    image: Vec<Jet<f64>>,
}

impl Composition {
    /// Substitutes all stages, beginning with `start`, (coordinates; parameters) as jets. `act`
    /// applies a contact, given with its number, to a state.
    fn of(
        map: &LocalMap,
        start: Vec<Jet<f64>>,
        act: impl Fn(Vec<Jet<f64>>, &Contact, usize) -> Vec<Jet<f64>>,
    ) -> Result<Self, ExpansionError> {
        let (mut state, mut depths) = (start, Vec::new());
        for stage in &map.stages {
            state = match stage {
                Stage::Leg(leg) => fly(leg, &state),
                Stage::Flown(_) => return Err(ExpansionError::FlownIsNoPolynomial),
                Stage::Contact(contact) => {
                    let depth = substitute_all(std::slice::from_ref(&contact.depth), &state);
                    depths.extend(depth);
                    act(state, contact, depths.len() - 1)
                }
            };
        }
        state.truncate(map.dimension());
        Ok(Self { depths, image: state })
    }
}

/// State (coordinates; parameters) after a leg; parameters are unchanged.
fn fly(leg: &Leg, state: &[Jet<f64>]) -> Vec<Jet<f64>> {
    let mut image = substitute_all(&leg.image, state);
    image.extend_from_slice(&state[leg.image.len()..]);
    image
}

/// Applies a contact: `x ↦ x + y (linear + y quadratic)`.
fn act(contact: &Contact, mut state: Vec<Jet<f64>>, y: &Jet<f64>) -> Vec<Jet<f64>> {
    let linear = substitute_all(&contact.linear, &state);
    let quadratic = substitute_all(&contact.quadratic, &state);
    for (value, (linear, quadratic)) in state.iter_mut().zip(linear.iter().zip(&quadratic)) {
        *value += &(y * &(linear + &(y * quadratic)));
    }
    state
}

/// A polynomial in `(y_1 … y_K; coordinates; parameters)`; with several passages, at most quadratic
/// in each `y_k`.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct DepthPolynomial<S: Scalar = f64> {
    /// Terms by increasing powers of the depth variables; the first term has none.
    pub terms: Vec<DepthTerm<S>>,
}

/// The part of a polynomial with given powers of the depth variables.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct DepthTerm<S: Scalar = f64> {
    /// Power of each depth variable.
    pub powers: Vec<u8>,
    /// Coefficient of these powers, a polynomial in (coordinates; parameters).
    pub coefficient: Jet<S>,
}

impl<S: Real> DepthPolynomial<S> {
    /// Value at given depth variables and at a point (coordinates; parameters).
    pub fn evaluate(&self, depths: &[S], point: &[S]) -> S {
        let value = |term: &DepthTerm<S>| {
            let powers = term.powers.iter().zip(depths);
            powers.fold(term.coefficient.evaluate(point), |product, (&power, &y)| {
                (0..power).fold(product, |product, _| product * y)
            })
        };
        self.terms.iter().fold(S::zero(), |sum, term| sum + value(term))
    }
}

impl DepthPolynomial {
    /// A polynomial from coefficients, each with its powers of the depth variables.
    pub(super) fn of(terms: impl IntoIterator<Item = (Vec<u8>, Jet<f64>)>) -> Self {
        let terms =
            terms.into_iter().map(|(powers, coefficient)| DepthTerm { powers, coefficient });
        Self { terms: terms.collect() }
    }

    /// Converts the coefficients to another scalar.
    pub fn map_scalars<T: Real>(&self, convert: impl Fn(f64) -> T + Copy) -> DepthPolynomial<T> {
        let terms = self.terms.iter().map(|term| DepthTerm {
            powers: term.powers.clone(),
            coefficient: term.coefficient.map_scalars(convert),
        });
        DepthPolynomial { terms: terms.collect() }
    }

    /// Number of coefficients that are not zero.
    pub fn coefficients(&self) -> usize {
        let terms = self.terms.iter();
        terms.map(|term| term.coefficient.nonzero()).sum()
    }
}

/// Space of `(y_1 … y_K; coordinates; parameters)` up to a weight; every `y_k` has weight 1.
struct DepthSpace<'a> {
    space: Arc<JetSpace>,
    passages: usize,
    variables: &'a Variables,
    weight: u32,
}

impl<'a> DepthSpace<'a> {
    fn new(passages: usize, variables: &'a Variables, weight: u32) -> Result<Self, ExpansionError> {
        let weights = [vec![1; passages], variables.weights.clone()].concat();
        Ok(Self { space: JetSpace::new(&weights, weight as usize)?, passages, variables, weight })
    }

    /// Jets of the variables (coordinates; parameters).
    fn identity(&self) -> Vec<Jet<f64>> {
        (0..self.variables.len())
            .map(|variable| Jet::variable(&self.space, self.passages + variable, 0.0))
            .collect()
    }

    /// Jet of the depth variable of a passage.
    fn depth_variable(&self, passage: usize) -> Jet<f64> {
        Jet::variable(&self.space, passage, 0.0)
    }

    /// Removes powers of `y_k` above the second by `y_k² = depths[k]`, the last passage first.
    fn reduced(&self, jet: &Jet<f64>, depths: &[Jet<f64>]) -> Jet<f64> {
        let passages = depths.iter().enumerate().rev();
        passages.fold(jet.clone(), |jet, (passage, depth)| self.reduced_in(passage, &jet, depth))
    }

    /// `f_0 + y Σ_j f_{1+2j} depth^j + y² Σ_j f_{2+2j} depth^j`, with `f_j` the coefficient of
    /// `y^j`.
    fn reduced_in(&self, passage: usize, jet: &Jet<f64>, depth: &Jet<f64>) -> Jet<f64> {
        let fold = |first: u8| {
            let powers = (first..=self.weight.min(255) as u8).step_by(2);
            let coefficients: Vec<_> =
                powers.map(|power| self.without_power(jet, passage, power)).collect();
            power_series_at(&coefficients, depth)
        };
        let y = self.depth_variable(passage);
        let corrections = &fold(1) + &(&y * &fold(2));
        &self.without_power(jet, passage, 0) + &(&y * &corrections)
    }

    /// Coefficient of `y_k^power`.
    fn without_power(&self, jet: &Jet<f64>, passage: usize, power: u8) -> Jet<f64> {
        let mut result = Jet::zero(&self.space);
        let mut lowered = vec![0; self.space.variables()];
        for (exponents, value) in jet.terms() {
            if exponents[passage] == power {
                lowered.copy_from_slice(exponents);
                lowered[passage] = 0;
                if let Some(monomial) = self.space.monomial(&lowered) {
                    result.coefficients_mut()[monomial] = value;
                }
            }
        }
        result
    }

    /// A reduced jet as a polynomial; its terms without a depth variable are replaced by `smooth`.
    fn polynomial(
        &self,
        smooth: Jet<f64>,
        jet: &Jet<f64>,
    ) -> Result<DepthPolynomial, ExpansionError> {
        let mut terms = BTreeMap::from([(vec![0; self.passages], smooth)]);
        for (exponents, value) in jet.terms().filter(|(_, value)| *value != 0.0) {
            let (powers, rest) = exponents.split_at(self.passages);
            let weight: u32 = powers.iter().map(|&power| u32::from(power)).sum();
            if weight == 0 {
                continue;
            }
            if !terms.contains_key(powers) {
                let space = self.variables.smooth_space(self.weight - weight)?;
                terms.insert(powers.to_vec(), Jet::zero(&space));
            }
            if let Some(coefficient) = terms.get_mut(powers)
                && let Some(monomial) = coefficient.space().monomial(rest)
            {
                coefficient.coefficients_mut()[monomial] = value;
            }
        }
        Ok(DepthPolynomial::of(terms))
    }
}
