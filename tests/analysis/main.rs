//! Analyses that use maps: diagrams, charts, orbits by itinerary, convergence, choice of a map.

#[path = "../support/mod.rs"]
mod support;

mod any_section;
mod atlases;
mod attractors;
mod basins;
mod branches;
mod charts;
mod choice;
mod choice_evidence;
mod convergence;
mod crises;
mod diagrams;
mod direct_alone;
mod direct_branches;
mod dynamics;
mod fits;
mod graze_theory;
mod guarded;
mod itineraries;
mod loci;
mod noises;
mod orbit_search;
mod progress;
mod record;
mod resuming;
mod soft_stops;
mod special_points;
mod trajectories;
mod two_sided;
mod windows;

use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

use support::scenes;

/// Index in the sequence of the first point of the checks, beyond all points used for choices or
/// measurements.
const UNUSED: usize = 100_000;

fn exact(values: &[f64]) -> Vec<Dd> {
    values.iter().map(|&value| Dd::from(value)).collect()
}

/// Scene of the catalogue with its orbit and its map at orders (5, 8).
struct Case {
    scene: Scene,
    orbit: GrazingOrbit,
    map: LocalMap,
}

impl Case {
    fn new(name: &str) -> Self {
        Self::of(scenes::scene(name))
    }

    fn of(scene: Scene) -> Self {
        let orbit = scenes::orbit(&scene);
        let orders = MapOrders { smooth_order: 5, contact_weight: 8 };
        let expander = Expander::new(&scene, &orbit).expect("a good scene");
        let map = expander.expand(orders).expect("a simple graze");
        Self { scene, orbit, map }
    }
}
