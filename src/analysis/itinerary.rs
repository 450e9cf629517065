//! The grazing passages of an orbit in the order in which they follow its section.

use crate::iteration::Itinerary;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// A grazing passage as a section sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FollowingPassage {
    /// Its place in [`GrazingOrbit::passages`].
    pub(super) place: usize,
    /// Its surface.
    pub(super) surface: usize,
    /// Time after the section point as a share of the orbit's period, in `[0, 1)`.
    pub(super) share: f64,
}

/// The passages of one return, in the order in which they follow a section point.
///
/// A section between passages is first followed by the next one, whichever the scene names first.
pub(super) fn passages_after_section(scene: &Scene, orbit: &GrazingOrbit) -> Vec<FollowingPassage> {
    let section = section_share(scene, orbit);
    let passages = orbit.passages.iter().enumerate();
    let mut following: Vec<_> = passages
        .map(|(place, passage)| FollowingPassage {
            place,
            surface: passage.surface,
            share: fraction(passage.time / orbit.period - section),
        })
        .collect();
    following.sort_by(|a, b| a.share.total_cmp(&b.share));
    following
}

/// Time from the first graze on to the section point, as a share of the orbit's period.
fn section_share(scene: &Scene, orbit: &GrazingOrbit) -> Dd {
    let graze = orbit.grazing_point().state.last();
    match (orbit.section.kind, &scene.model.phase, graze) {
        (PoincareSectionKind::Stroboscopic { phase }, Some(clock), Some(&graze)) => {
            let turns = (phase - graze) / clock.period;
            (turns - turns.floor()) / Dd::from(scene.grazing.periods as f64)
        }
        _ => Dd::ZERO,
    }
}

/// What is left above a whole number, in `[0, 1)`; 0 for whole numbers alone.
fn fraction(value: Dd) -> f64 {
    const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
    (value - value.floor()).to_f64().min(BELOW_ONE)
}

/// Which surface each passage of one return meets, the passages in the order in which they follow the section.
pub fn itinerary(scene: &Scene, orbit: &GrazingOrbit) -> Itinerary {
    let following = passages_after_section(scene, orbit);
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
