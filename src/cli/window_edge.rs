//! The warning of a window that is deeper than the series of its contact reach.

use super::error::CliError;
use super::output::note;
use super::prepare::plan;
use crate::expansion::{Expander, ExpansionError, LocalMap, WindowEdge};
use crate::model::{Scene, Shape};
use crate::orbit::GrazingOrbit;
use crate::report::edge_words;

/// Says on standard error where a truncation leaves out too much at the edge of the scene's window, of the passage
/// whose contact loses most. Contacts that are flown are not truncated.
pub(super) fn warn_of_edges(
    scene: &Scene,
    edges: impl IntoIterator<Item = WindowEdge>,
    quiet: bool,
) {
    let share = |edge: &WindowEdge| edge.omitted_share;
    let beyond = edges.into_iter().filter(|edge| !edge.is_within());
    let worst = beyond.max_by(|a, b| share(a).total_cmp(&share(b)));
    let series = scene.emit.shape != Shape::Flown;
    if let Some(edge) = worst.filter(|_| series && !quiet) {
        note(&format!(
            "warning: `{}`: at the edge of the window {}",
            scene.identifier,
            edge_words(&edge)
        ));
    }
}

/// The map of a scene at its orders, in the shape it asks for; with the warning where its contacts are series.
pub(super) fn local_map(
    scene: &Scene,
    orbit: &GrazingOrbit,
    quiet: bool,
) -> Result<LocalMap, CliError> {
    let plan = plan(scene, orbit)?;
    if plan.scene.emit.shape != Shape::Flown {
        let expander = Expander::new(&plan.scene, orbit)?;
        let edges = window_edges(&expander, plan.orders.contact_weight)?;
        warn_of_edges(scene, edges, quiet);
    }
    plan.map(orbit)
}

/// The edges of the passages of a scene whose series do not end.
pub(super) fn window_edges(
    expander: &Expander<'_>,
    contact_weight: u32,
) -> Result<Vec<WindowEdge>, ExpansionError> {
    let edges = (0..expander.passages())
        .map(|passage| expander.window_edge(passage, contact_weight))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(edges.into_iter().flatten().collect())
}
