//! What a map says of itself: its section, parameters, window and variables.

use super::variables::{DEVIATION_WEIGHT, Variables};
use super::{ActiveParameter, MapSection, MapWindow, SectionKind};
use crate::model::Scene;
use crate::orbit::{GrazingOrbit, PoincareSection, PoincareSectionKind};

/// The section with its coordinates and their values on the grazing orbit.
pub(super) fn map_section(scene: &Scene, orbit: &GrazingOrbit) -> MapSection {
    let (kind, phase) = match orbit.section.kind {
        PoincareSectionKind::Tangency => (SectionKind::Tangency, None),
        PoincareSectionKind::Stroboscopic { phase } => (SectionKind::Stroboscopic, Some(phase)),
    };
    let (coordinates, point) = orbit
        .section_coordinates(scene)
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .unzip();
    MapSection {
        kind,
        coordinates,
        point,
        phase,
    }
}

/// The active parameters with their grazing values.
pub(super) fn active_parameters(scene: &Scene, orbit: &GrazingOrbit) -> Vec<ActiveParameter> {
    let active = |&parameter: &usize| ActiveParameter {
        name: scene.model.parameters[parameter].name.clone(),
        value: orbit.parameters()[parameter],
    };
    scene.expansion.active.iter().map(active).collect()
}

/// The scene's window on the section's coordinates and the active parameters.
pub(super) fn map_window(scene: &Scene, orbit: &GrazingOrbit) -> MapWindow {
    let window = &scene.window;
    let coordinates = orbit.section.coordinates.iter();
    let active = scene.expansion.active.iter();
    MapWindow {
        depth: window.depth,
        state: coordinates
            .map(|&component| window.state[component])
            .collect(),
        parameter: active
            .map(|&parameter| window.parameter[parameter])
            .collect(),
    }
}

/// The variables (coordinates of a section; active parameters) with the scene's weights.
pub(super) fn variables(scene: &Scene, section: &PoincareSection) -> Variables {
    let coordinates = section.coordinate_names(&scene.model);
    let active = scene.expansion.active.iter();
    let parameters = active.map(|&parameter| scene.model.parameters[parameter].name.as_str());
    let names: Vec<_> = coordinates
        .iter()
        .copied()
        .chain(parameters)
        .map(str::to_owned)
        .collect();
    let weight = |name: &String| {
        let given = scene
            .expansion
            .weights
            .iter()
            .find(|(other, _)| other == name);
        given.map_or(DEVIATION_WEIGHT, |(_, weight)| *weight)
    };
    Variables {
        weights: names.iter().map(weight).collect(),
        coordinates: coordinates.len(),
        names,
    }
}
