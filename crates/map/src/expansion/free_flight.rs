//! The free flight about a grazing orbit as a local map whose contacts are not expanded, for direct
//! simulation; it exists even if the contacts have no expansion.
//!
//! A scene whose stops let everything pass has the legs and depths of the original scene, and
//! contacts that are the identity.

use super::error::ExpansionError;
use super::expand::Expander;
use super::local_map::{LocalMap, MapWindow, Stage};
use super::power_law::PowerCorrections;
use crate::jet::Jet;
use crate::model::{MapOrders, Orders, Response, Scene};
use crate::numeric::decimal_below;
use crate::orbit::GrazingOrbit;

/// Orders used if the scene states a tolerance.
const ORDERS: MapOrders = MapOrders::new(5, 6);
/// Largest number of products of coefficients in a product of two series: legs and depths then take
/// less than a second.
const MOST_PRODUCTS: u128 = 50_000;
/// Bound used if a scene leaves it open, relative to its natural size.
const OPEN: f64 = 0.1;
/// Number of decimal digits of a bound that a scene leaves open.
const DIGITS: u32 = 2;

/// Legs and depths of a scene as a map without [contacts](LocalMap::has_contacts).
///
/// Orders are those of the scene, or lower if such series are long. Bounds of the window that the
/// scene leaves open are a tenth of the [natural sizes](super::NaturalWindow).
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
            contact.powers = PowerCorrections::default();
            let corrections = contact.linear.iter_mut().chain(&mut contact.quadratic);
            corrections.for_each(|jet| *jet = Jet::constant(jet.space(), f64::NAN));
        }
    }
    Ok(map)
}

/// Scene whose stops have no effect, except those that its orbit hits.
fn with_passing_stops(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let hit = scene.grazing.hits.surfaces.clone();
    let dimension = scene.model.dimension();
    let graph = &mut scene.model.graph;
    let reset: Vec<_> = (0..dimension).map(|component| graph.input(component)).collect();
    let surfaces = scene.model.surfaces.iter_mut().enumerate();
    for (_, surface) in surfaces.filter(|(number, _)| !hit.contains(number)) {
        surface.response = Response::Impact { reset: reset.clone() };
    }
    scene
}
