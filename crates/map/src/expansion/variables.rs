//! The variables of an expansion and the jet spaces made of them.

use std::sync::Arc;

use super::error::ExpansionError;
use crate::jet::{Jet, JetSpace, power_series_at};
use crate::model::{MapOrders, Orders, Scene};
use crate::numeric::Scalar;
use crate::orbit::PoincareSection;

/// Weight of a state or parameter deviation if the scene names none; `y` has weight 1.
pub const DEVIATION_WEIGHT: u32 = 2;

/// The variables (coordinates; active parameters) of an expansion, with their weights.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variables {
    /// Names, coordinates first.
    pub names: Vec<String>,
    /// Weights, in the same order.
    pub weights: Vec<u32>,
    /// Number of variables that are coordinates.
    pub coordinates: usize,
}

impl Variables {
    /// Number of variables.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// Whether there are no variables (a section of dimension 0).
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// Space of the monomials in (coordinates; parameters) up to a weight.
    ///
    /// All weights are divided by their common divisor: if every variable has weight 2, the space
    /// up to weight `2N` is that of total degree `N`.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if the space would be too large.
    pub fn smooth_space(&self, weight: u32) -> Result<Arc<JetSpace>, ExpansionError> {
        let divisor = self.divisor();
        let weights: Vec<u32> = self.weights.iter().map(|own| own / divisor).collect();
        Ok(JetSpace::new(&weights, (weight / divisor) as usize)?)
    }

    /// Common divisor of the weights: the unit of weights in a
    /// [`smooth_space`](Self::smooth_space).
    pub(super) fn divisor(&self) -> u32 {
        self.weights.iter().fold(0, |a, &b| gcd(a, b)).max(1)
    }

    /// Space of the monomials in `(y; coordinates; parameters)` up to a weight.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if the space would be too large.
    pub fn contact_space(&self, weight: u32) -> Result<Arc<JetSpace>, ExpansionError> {
        Ok(JetSpace::new(&self.contact_weights(), weight as usize)?)
    }

    /// Checks that [`contact_space`](Self::contact_space) can be built; nothing is allocated.
    ///
    /// # Errors
    ///
    /// As [`contact_space`](Self::contact_space).
    pub fn check_contact_space(&self, weight: u32) -> Result<(), ExpansionError> {
        JetSpace::check(&self.contact_weights(), weight as usize)?;
        Ok(())
    }

    fn contact_weights(&self) -> Vec<u32> {
        std::iter::once(1).chain(self.weights.iter().copied()).collect()
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Largest number of coefficient products in one product of two series at the orders that a scene
/// states: a map of a forced oscillator then takes seconds.
const MOST_PRODUCTS: u128 = 10_000_000;

/// Refuses the orders that a scene states if its map would take minutes, before anything is
/// computed.
///
/// # Errors
///
/// [`ExpansionError::TooMuchWork`] with the highest order that is allowed.
pub fn check_orders(scene: &Scene) -> Result<(), ExpansionError> {
    let Orders::Fixed(orders) = scene.expansion.orders else {
        return Ok(());
    };
    let names = scene.model.full_state_names();
    // The component that the section eliminates is known only with the orbit; weights may differ.
    let sections = (0..names.len()).map(|eliminated| {
        let mut coordinates = names.clone();
        coordinates.remove(eliminated);
        named(scene, &coordinates).check_orders(orders)
    });
    let mut refused = Ok(());
    for section in sections {
        match section {
            Ok(()) => return Ok(()),
            Err(error) => refused = refused.and(Err(error)),
        }
    }
    refused
}

impl Variables {
    fn check_orders(&self, orders: MapOrders) -> Result<(), ExpansionError> {
        let highest = self.within(orders, MOST_PRODUCTS);
        let [smooth, contact] = self.products(orders);
        let contacts = self.contact_weights().len();
        let series = [
            ("smooth_order", orders.smooth_order, self.weights.len(), smooth, highest.smooth_order),
            ("contact_weight", orders.contact_weight, contacts, contact, highest.contact_weight),
        ];
        for (key, order, variables, products, highest) in series {
            if products > MOST_PRODUCTS {
                let most = MOST_PRODUCTS;
                let work =
                    ExpansionError::TooMuchWork { key, order, variables, products, most, highest };
                return Err(work);
            }
        }
        Ok(())
    }

    /// Products of coefficients in a product of two series, of the smooth and of the contact order.
    fn products(&self, orders: MapOrders) -> [u128; 2] {
        let divisor = self.divisor();
        let smooth: Vec<u32> = self.weights.iter().map(|own| own / divisor).collect();
        let order = (DEVIATION_WEIGHT * orders.smooth_order / divisor) as usize;
        let weight = orders.contact_weight as usize;
        [JetSpace::size(&smooth, order).1, JetSpace::size(&self.contact_weights(), weight).1]
    }

    /// Highest orders, none above the given ones, with at most `most` products; at least 1.
    pub(super) fn within(&self, orders: MapOrders, most: u128) -> MapOrders {
        let highest = |order: u32, place: usize| {
            let products = |order: u32| self.products(MapOrders::new(order, order))[place];
            (1..=order).rev().find(|&lower| products(lower) <= most).unwrap_or(1)
        };
        MapOrders::new(highest(orders.smooth_order, 0), highest(orders.contact_weight, 1))
    }
}

/// Variables (coordinates of a section; active parameters) with the scene's weights.
pub(super) fn variables(scene: &Scene, section: &PoincareSection) -> Variables {
    named(scene, &section.coordinate_names(&scene.model))
}

/// Variables (given coordinates; active parameters) with the scene's weights.
fn named(scene: &Scene, coordinates: &[&str]) -> Variables {
    let active = scene.expansion.active.iter();
    let parameters = active.map(|&parameter| scene.model.parameters[parameter].name.as_str());
    let names: Vec<_> = coordinates.iter().copied().chain(parameters).map(str::to_owned).collect();
    let weight = |name: &String| {
        let given = scene.expansion.weights.iter().find(|(other, _)| other == name);
        given.map_or(DEVIATION_WEIGHT, |(_, weight)| *weight)
    };
    Variables { weights: names.iter().map(weight).collect(), coordinates: coordinates.len(), names }
}

/// Lifts a jet in (coordinates; parameters) to a space that has `y` as its first variable.
pub(super) fn lift<S: Scalar>(jet: &Jet<S>, contact_space: &Arc<JetSpace>) -> Jet<S> {
    rebase(jet, contact_space, |exponents, target| target[1..].copy_from_slice(exponents))
}

/// Converts a jet to another space of the same variables, cut at that space's order.
pub(super) fn respace<S: Scalar>(jet: &Jet<S>, space: &Arc<JetSpace>) -> Jet<S> {
    rebase(jet, space, |exponents, target| target.copy_from_slice(exponents))
}

/// Coefficient of `y^power` of a jet in `(y; coordinates; parameters)`.
pub(super) fn coefficient_of_depth_power<S: Scalar>(
    jet: &Jet<S>,
    power: u8,
    space: &Arc<JetSpace>,
) -> Jet<S> {
    let mut result = Jet::zero(space);
    for (exponents, value) in jet.terms().filter(|(exponents, _)| exponents[0] == power) {
        add_at(&mut result, &exponents[1..], value);
    }
    result
}

/// Factor of `y^first` after the substitution `y² = depth`: `Σ_k d_{first+2k} depth^k`, with `d_j`
/// the coefficient of `y^j`.
pub(super) fn fold_depth_powers<S: Scalar>(
    correction: &Jet<S>,
    first: u8,
    weight: u32,
    depth: &Jet<S>,
    space: &Arc<JetSpace>,
) -> Jet<S> {
    let depth = respace(depth, space);
    let powers = (first..=weight.min(255) as u8).step_by(2);
    let coefficients: Vec<_> =
        powers.map(|power| coefficient_of_depth_power(correction, power, space)).collect();
    power_series_at(&coefficients, &depth)
}

/// Multiplies a jet by `y^power`; for a negative power, terms in lower powers of `y` are dropped.
pub(super) fn shift_depth_power<S: Scalar>(jet: &Jet<S>, power: i32) -> Jet<S> {
    let mut result = Jet::zero(jet.space());
    let mut target = vec![0; jet.space().variables()];
    for (exponents, value) in jet.terms() {
        target.copy_from_slice(exponents);
        if let Ok(shifted) = u8::try_from(i32::from(exponents[0]) + power) {
            target[0] = shifted;
            add_at(&mut result, &target, value);
        }
    }
    result
}

fn rebase<S: Scalar>(
    jet: &Jet<S>,
    space: &Arc<JetSpace>,
    map: impl Fn(&[u8], &mut [u8]),
) -> Jet<S> {
    let mut result = Jet::zero(space);
    let mut target = vec![0; space.variables()];
    for (exponents, value) in jet.terms() {
        map(exponents, &mut target);
        add_at(&mut result, &target, value);
    }
    result
}

fn add_at<S: Scalar>(jet: &mut Jet<S>, exponents: &[u8], value: S) {
    if let Some(monomial) = jet.space().monomial(exponents) {
        jet.coefficients_mut()[monomial] += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(weights: &[u32]) -> Variables {
        let names = weights.iter().map(|weight| format!("w{weight}")).collect();
        Variables { names, weights: weights.to_vec(), coordinates: 1 }
    }

    #[test]
    fn equal_weights_give_total_degree() {
        let space = variables(&[2, 2, 2]).smooth_space(10).unwrap();
        assert_eq!((space.weights(), space.order()), (&[1, 1, 1][..], 5));
    }

    #[test]
    fn coprime_weights_are_kept() {
        let space = variables(&[2, 3]).smooth_space(10).unwrap();
        assert_eq!((space.weights(), space.order()), (&[2, 3][..], 10));
    }

    #[test]
    fn orders_are_refused_where_one_product_takes_too_long_and_the_highest_is_named() {
        let variables = variables(&[2; 4]);
        assert_eq!(variables.check_orders(MapOrders::new(23, 6)), Ok(()));
        let refused = variables.check_orders(MapOrders::new(30, 6));
        let Err(ExpansionError::TooMuchWork { key, products, highest, .. }) = refused else {
            panic!("{refused:?}");
        };
        // Number of pairs of monomials in 4 variables of at most 30 factors together: 38 over 8.
        assert_eq!((key, products, highest), ("smooth_order", 48_903_492, 23));
        assert!(variables.check_orders(MapOrders::new(5, 64)).is_err());
    }

    #[test]
    fn a_depth_power_is_taken_out_of_what_was_lifted() {
        let variables = variables(&[2, 2]);
        let small = variables.smooth_space(4).unwrap();
        let large = variables.contact_space(6).unwrap();
        let jet = &Jet::variable(&small, 0, 2.0) * &Jet::variable(&small, 1, 3.0);
        let y = Jet::variable(&large, 0, 0.0);
        let product = &(&y * &y) * &lift(&jet, &large);
        let back = coefficient_of_depth_power(&product, 2, &small);
        assert_eq!(back.coefficients(), jet.coefficients());
    }
}
