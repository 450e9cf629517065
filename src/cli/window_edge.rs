//! The warning of a window that is deeper than the series of its contact reach.

use super::error::CliError;
use super::output::note;
use super::prepare::map_orders;
use crate::expansion::{Expander, LocalMap, WindowEdge};
use crate::model::Scene;
use crate::orbit::GrazingOrbit;
use crate::report::edge_words;

/// Says on standard error where a truncation leaves out too much at the edge of the scene's window.
pub(super) fn warn_of_edge(scene: &Scene, edge: Option<&WindowEdge>, quiet: bool) {
    if let Some(edge) = edge.filter(|edge| !edge.is_within() && !quiet) {
        note(&format!(
            "warning: `{}`: at the edge of the window {}",
            scene.identifier,
            edge_words(edge)
        ));
    }
}

/// The map of a scene at its orders, with the warning.
pub(super) fn local_map(
    scene: &Scene,
    orbit: &GrazingOrbit,
    quiet: bool,
) -> Result<LocalMap, CliError> {
    let orders = map_orders(scene, orbit)?;
    let expander = Expander::new(scene, orbit)?;
    let edge = expander.window_edge(orders.contact_weight)?;
    warn_of_edge(scene, edge.as_ref(), quiet);
    Ok(expander.expand(orders)?)
}
