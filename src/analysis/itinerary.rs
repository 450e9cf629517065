//! Which surfaces the passages of a map meet.

use crate::iteration::Itinerary;
use crate::model::Scene;
use crate::orbit::{FollowingPassage, GrazingOrbit};

/// Which surface each passage of one return meets, the passages in the order in which they follow
/// the section.
pub fn itinerary(scene: &Scene, orbit: &GrazingOrbit) -> Itinerary {
    let following = orbit.passages_after_section(scene);
    let grazes = |&surface: &usize| following.iter().any(|passage| passage.surface == surface);
    let surfaces: Vec<usize> = (0..scene.model.surfaces.len()).filter(grazes).collect();
    let name = |&surface: &usize| scene.model.surfaces[surface].name.clone();
    let position = |passage: &FollowingPassage| {
        let place = surfaces.iter().position(|&known| known == passage.surface);
        place.unwrap_or(0)
    };
    Itinerary {
        surfaces: surfaces.iter().map(name).collect(),
        passages: following.iter().map(position).collect(),
        periods: scene.grazing.periods,
    }
}
