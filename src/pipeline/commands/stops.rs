//! Stops that a motion without contact is to be clear of, for `safe` and `curve --nearest`.

use crate::model::{Scene, Symmetry};

/// Difference of the distances of two grazes, relative, within which they are equally near, as by
/// symmetry.
pub(super) const SAME: f64 = 1e-9;

/// Stops of a scene, as indices of surfaces: the one that its orbit grazes first, then all others
/// that the orbit is not said to hit.
pub(super) fn stops(scene: &Scene) -> Vec<usize> {
    let grazed = scene.grazing.passages[0];
    let is_other = |at: &usize| *at != grazed && !scene.grazing.hits.surfaces.contains(at);
    let others = (0..scene.model.surfaces.len()).filter(is_other);
    std::iter::once(grazed).chain(others).collect()
}

/// Scene whose orbit is to graze one stop.
pub(super) fn grazing(scene: &Scene, stop: usize) -> Scene {
    let mut scene = scene.clone();
    scene.grazing.passages = vec![stop];
    scene.grazing.symmetry = Symmetry::None;
    scene.grazing.hits.order = None;
    scene
}
