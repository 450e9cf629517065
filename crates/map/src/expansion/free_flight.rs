//! The free flight about a grazing orbit as a local map whose contacts are not expanded: what
//! direct simulation uses of an expansion, whether its contacts have one or not.
//!
//! One idea: a scene whose stops let everything pass has the legs and depths of the scene itself,
//! and contacts that are the identity.

use super::error::ExpansionError;
use super::expand::Expander;
use super::local_map::{LocalMap, MapWindow, Stage};
use crate::jet::Jet;
use crate::model::{MapOrders, Orders, Response, Scene};
use crate::numeric::decimal_below;
use crate::orbit::GrazingOrbit;

/// Orders where the scene names a tolerance.
const ORDERS: MapOrders = MapOrders::new(5, 6);
/// Most products of coefficients of a product of two series: legs and depths are found in less
/// than a second.
const MOST_PRODUCTS: u128 = 50_000;
/// Bounds that a scene leaves open, over their natural sizes.
const OPEN: f64 = 0.1;
/// Decimal digits of such a bound.
const DIGITS: u32 = 2;

/// The legs and depths of a scene as a map without [contacts](LocalMap::has_contacts).
///
/// Its orders are those of the scene, or lower where such series are long. What the scene leaves
/// open of the window is a tenth of the [natural sizes](super::NaturalWindow).
///
/// # Errors
///
/// [`ExpansionError`] if the flow fails, the graze is not simple, or the orbit misses its section
/// point.
pub fn free_flight(scene: &Scene, orbit: &GrazingOrbit) -> Result<LocalMap, ExpansionError> {
    let passing = with_passing_stops(scene);
    let expander = Expander::of_free_flow(&passing, orbit)?;
    let asked = match scene.expansion.orders {
        Orders::Fixed(orders) => orders,
        Orders::Tolerance(_) => ORDERS,
    };
    let mut map = expander.expand(expander.variables().within(asked, MOST_PRODUCTS))?;
    map.window = MapWindow::stated(scene, orbit);
    let natural = expander.natural_window(&map, None).scaled(OPEN);
    for (bound, size) in map.window.bounds_mut().zip(natural.bounds()) {
        if !bound.is_finite() {
            *bound = decimal_below(size, DIGITS);
        }
    }
    map.orders.contact_weight = 0;
    for stage in &mut map.stages {
        if let Stage::Contact(contact) = stage {
            contact.depth_form = None;
            let corrections = contact.linear.iter_mut().chain(&mut contact.quadratic);
            corrections.for_each(|jet| *jet = Jet::constant(jet.space(), f64::NAN));
        }
    }
    Ok(map)
}

/// A scene whose stops change nothing.
fn with_passing_stops(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let dimension = scene.model.dimension();
    let graph = &mut scene.model.graph;
    let reset: Vec<_> = (0..dimension).map(|component| graph.input(component)).collect();
    for surface in &mut scene.model.surfaces {
        surface.response = Response::Impact { reset: reset.clone() };
    }
    scene
}
