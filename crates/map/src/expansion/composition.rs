//! The composed form: the whole map as one polynomial pass in `(y_1 … y_K; coordinates;
//! parameters)`.
//!
//! If passage `k` makes contact, `y_k² = depth_k(y_1 … y_{k−1}; x, p)`. The relation removes powers
//! of `y_k` above the second or, with one depth variable, all powers of one coordinate. A
//! polynomial in all depth variables is then a list of polynomials in (coordinates; parameters),
//! one for each choice of powers of the `y_k`. A contact with powers of the penetration that are
//! not half a whole number has further depth variables, `z = y_k^e`, behind its own.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::approach::DepthChart;
use super::error::ExpansionError;
use super::local_map::{Contact, Leg, LocalMap, Stage};
use super::power_law::{WeightScale, exponent_of};
use super::variables::{DEVIATION_WEIGHT, Variables, respace};
use crate::jet::{Jet, JetSpace, power_series_at, substitute_all};
use crate::model::MapOrders;
use crate::numeric::{Dd, Real, Scalar};

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
    /// Powers of depth variables that are variables of their own, in the order of the passages.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub powers: Vec<OwnPower>,
}

/// A depth variable `y_k^e` of a composed map.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OwnPower {
    /// Number of the passage.
    pub passage: usize,
    /// The exponent `e`.
    pub exponent: Dd,
}

impl<S: Scalar> ComposedMap<S> {
    /// Depth variables of the polynomials: for every passage `y_k`, with exponent `None`, then its
    /// powers that are variables of their own.
    pub fn depth_variables(&self) -> impl Iterator<Item = (usize, Option<Dd>)> {
        let of = |passage: usize| {
            let own = self.powers.iter().filter(move |power| power.passage == passage);
            let own = own.map(move |power| (passage, Some(power.exponent)));
            std::iter::once((passage, None)).chain(own)
        };
        (0..self.depths.len()).flat_map(of)
    }
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
    let depths = DepthVariables::of([contact]);
    let spaces = DepthSpace::new(depths, &chart.space.weights()[1..], variables, weight)?;
    let wide = |jet: &Jet<f64>| spaces.lifted(jet);
    let before: Vec<_> = chart.variables().iter().map(wide).collect();
    let mut after = before.clone();
    let corrections = corrections(contact, &chart, orders.contact_weight);
    after.iter_mut().zip(&corrections).for_each(|(value, correction)| *value += &wide(correction));
    for term in &contact.powers.terms {
        let parts = [&term.linear, &term.quadratic]
            .map(|jets| chart.raise(jets).iter().map(wide).collect::<Vec<_>>());
        spaces.add_term(&mut after, 0, &term.powers, &parts);
    }
    let fly_all = |state: Vec<Jet<f64>>| legs.iter().fold(state, |state, leg| fly(leg, &state));
    let pairs = fly_all(after).into_iter().zip(fly_all(before));
    let image = smooth.image.into_iter().zip(pairs);
    let whole = (1..=weight).map(|power| {
        let mut powers = vec![0; spaces.depths.len()];
        powers[0] = power as u8;
        Ok((powers, Jet::zero(&variables.smooth_space(weight - power)?)))
    });
    let whole = whole.collect::<Result<Vec<_>, ExpansionError>>()?;
    let image = image.map(|(smooth, (with, without))| {
        spaces.polynomial(smooth, whole.iter().cloned(), &(&with - &without))
    });
    let image = image.collect::<Result<_, _>>()?;
    let depths = smooth.depths.into_iter();
    Ok(ComposedMap {
        image,
        depths: depths.map(|depth| spaces.without_depths(depth)).collect(),
        powers: spaces.depths.own(),
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
    let contacts = map.stages.iter().filter_map(|stage| match stage {
        Stage::Contact(contact) => Some(contact),
        Stage::Leg(_) | Stage::Flown(_) => None,
    });
    let depths = DepthVariables::of(contacts);
    let spaces = DepthSpace::new(depths, &variables.weights, variables, weight)?;
    let whole = Composition::of(map, spaces.identity(), |state, contact, passage| {
        act(contact, state, passage, &spaces)
    })?;
    let mut reduced = Vec::new();
    for depth in &whole.depths {
        reduced.push(spaces.reduced(depth, &reduced));
    }
    let image = whole.image.iter().map(|jet| spaces.reduced(jet, &reduced));
    let polynomials = |smooth: Vec<Jet<f64>>, jets: Vec<Jet<f64>>| {
        let pairs = smooth.into_iter().zip(&jets);
        let polynomials = pairs.map(|(smooth, jet)| spaces.polynomial(smooth, [], jet));
        polynomials.collect::<Result<_, _>>()
    };
    Ok(ComposedMap {
        image: polynomials(smooth.image, image.collect())?,
        depths: polynomials(smooth.depths, reduced)?,
        powers: spaces.depths.own(),
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

/// Applies a contact: `x ↦ x + y (linear + y quadratic)`, and its terms with powers of `y` that are
/// not whole.
fn act(
    contact: &Contact,
    mut state: Vec<Jet<f64>>,
    passage: usize,
    spaces: &DepthSpace<'_>,
) -> Vec<Jet<f64>> {
    let before = state.clone();
    let at = |jets: &[Jet<f64>]| substitute_all(jets, &before);
    let parts = [at(&contact.linear), at(&contact.quadratic)];
    spaces.add_term(&mut state, passage, &[], &parts);
    for term in &contact.powers.terms {
        let parts = [at(&term.linear), at(&term.quadratic)];
        spaces.add_term(&mut state, passage, &term.powers, &parts);
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

/// The depth variables of a map: `y_k` of every passage, and behind it the powers of it that are
/// variables of their own.
struct DepthVariables {
    /// Exponent of `y_k` in each variable.
    exponents: Vec<Dd>,
    /// Number of the variable `y_k` of each passage.
    first: Vec<usize>,
}

impl DepthVariables {
    fn of<'c>(contacts: impl IntoIterator<Item = &'c Contact>) -> Self {
        let (mut exponents, mut first) = (Vec::new(), Vec::new());
        for contact in contacts {
            first.push(exponents.len());
            exponents.push(Dd::from_f64(1.0));
            exponents.extend(&contact.powers.exponents);
        }
        Self { exponents, first }
    }

    fn len(&self) -> usize {
        self.exponents.len()
    }

    /// Powers that are variables of their own.
    fn own(&self) -> Vec<OwnPower> {
        let of = |(passage, &first): (usize, &usize)| {
            let end = self.first.get(passage + 1).copied().unwrap_or(self.len());
            let own = self.exponents[first + 1..end].iter();
            own.map(move |&exponent| OwnPower { passage, exponent }).collect::<Vec<_>>()
        };
        self.first.iter().enumerate().flat_map(of).collect()
    }
}

/// Space of (depth variables; coordinates; parameters) up to a weight.
struct DepthSpace<'a> {
    space: Arc<JetSpace>,
    depths: DepthVariables,
    variables: &'a Variables,
    weight: u32,
}

impl<'a> DepthSpace<'a> {
    /// A space in which the coordinates and parameters have the weights `others`.
    fn new(
        depths: DepthVariables,
        others: &[u32],
        variables: &'a Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let scale = WeightScale::of(&depths.exponents);
        let own = depths.exponents.iter().map(|&exponent| scale.weight(exponent));
        let weights: Vec<u32> = own.chain(others.iter().map(|other| scale.unit * other)).collect();
        let space = JetSpace::new(&weights, (scale.unit * weight) as usize)?;
        Ok(Self { space, depths, variables, weight })
    }

    /// Jets of the variables (coordinates; parameters).
    fn identity(&self) -> Vec<Jet<f64>> {
        (0..self.variables.len())
            .map(|variable| Jet::variable(&self.space, self.depths.len() + variable, 0.0))
            .collect()
    }

    /// Converts a jet in `(y; coordinates; parameters)` of a map with one passage.
    fn lifted(&self, jet: &Jet<f64>) -> Jet<f64> {
        let others = (0..self.variables.len()).map(|variable| Some(self.depths.len() + variable));
        let places: Vec<_> = std::iter::once(Some(0)).chain(others).collect();
        jet.reinterpret(&self.space, &places)
    }

    /// Jet of the depth variable of a passage.
    fn depth_variable(&self, passage: usize) -> Jet<f64> {
        Jet::variable(&self.space, self.depths.first[passage], 0.0)
    }

    /// Adds `z^m y (linear + y quadratic)` to a state, with the powers `m` of the variables behind
    /// the depth variable `y` of a passage.
    fn add_term(
        &self,
        state: &mut [Jet<f64>],
        passage: usize,
        powers: &[u8],
        [linear, quadratic]: &[Vec<Jet<f64>>; 2],
    ) {
        let y = &self.depth_variable(passage);
        let mut product = y.clone();
        for (place, &power) in powers.iter().enumerate() {
            let z = Jet::variable(&self.space, self.depths.first[passage] + 1 + place, 0.0);
            product = (0..power).fold(product, |product, _| &product * &z);
        }
        for (value, (linear, quadratic)) in state.iter_mut().zip(linear.iter().zip(quadratic)) {
            *value += &(&product * &(linear + &(y * quadratic)));
        }
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
        let place = self.depths.first[passage];
        let mut result = Jet::zero(&self.space);
        let mut lowered = vec![0; self.space.variables()];
        for (exponents, value) in jet.terms() {
            if exponents[place] == power {
                lowered.copy_from_slice(exponents);
                lowered[place] = 0;
                if let Some(monomial) = self.space.monomial(&lowered) {
                    result.coefficients_mut()[monomial] = value;
                }
            }
        }
        result
    }

    /// A polynomial without depth variables.
    fn without_depths(&self, smooth: Jet<f64>) -> DepthPolynomial {
        DepthPolynomial::of([(vec![0; self.depths.len()], smooth)])
    }

    /// A jet as a polynomial with at least the given terms; its terms without a depth variable are
    /// replaced by `smooth`.
    fn polynomial(
        &self,
        smooth: Jet<f64>,
        given: impl IntoIterator<Item = (Vec<u8>, Jet<f64>)>,
        jet: &Jet<f64>,
    ) -> Result<DepthPolynomial, ExpansionError> {
        let mut terms = BTreeMap::from([(vec![0; self.depths.len()], smooth)]);
        terms.extend(given);
        for (exponents, value) in jet.terms().filter(|(_, value)| *value != 0.0) {
            let (powers, rest) = exponents.split_at(self.depths.len());
            let left = f64::from(self.weight) - exponent_of(powers, &self.depths.exponents);
            if powers.iter().all(|&power| power == 0) || left < 0.0 {
                continue;
            }
            if !terms.contains_key(powers) {
                let space = self.variables.smooth_space(left as u32)?;
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
