//! The window of a map in what commands say and write: the warning where it is deeper than the
//! series reach, its edges in JSON.

use serde::Serialize;

use super::error::CliError;
use super::output::note;
use super::prepare::plan;
use grazemap::convergence::SettledScene;
use grazemap::expansion::{Expander, ExpansionError, LocalMap, WindowEdge};
use grazemap::model::{Scene, Shape};
use grazemap::report::{SectionDocument, edge_words};

/// Says on standard error where a truncation leaves out too much at the edge of the scene's window,
/// of the passage whose contact loses most. Contacts that are flown are not truncated.
pub(super) fn warn_of_edges(
    scene: &Scene,
    edges: impl IntoIterator<Item = WindowEdge>,
    quiet: bool,
) {
    let series = scene.emit.shape != Shape::Flown;
    if let Some(edge) = beyond(edges).filter(|_| series && !quiet) {
        note(&format!(
            "warning: `{}`: at the edge of the window {}",
            scene.identifier,
            edge_words(&edge)
        ));
    }
}

/// The edge of the passage whose contact loses most, where that is too much.
pub(super) fn beyond(edges: impl IntoIterator<Item = WindowEdge>) -> Option<WindowEdge> {
    let share = |edge: &WindowEdge| edge.omitted_share;
    let beyond = edges.into_iter().filter(|edge| !edge.is_within());
    beyond.max_by(|a, b| share(a).total_cmp(&share(b)))
}

/// The map of a scene at its orders, in the shape it asks for; with the edges of its contacts, and
/// the warning, where they are series.
pub(super) fn local_map(
    settled: &SettledScene,
    quiet: bool,
) -> Result<(LocalMap, Vec<WindowEdge>), CliError> {
    let (plan, orbit) = (plan(settled)?, &settled.orbit);
    let mut edges = Vec::new();
    if plan.scene.emit.shape != Shape::Flown {
        let expander = Expander::new(&plan.scene, orbit)?;
        edges = window_edges(&expander, plan.orders.contact_weight)?;
        warn_of_edges(&plan.scene, edges.iter().copied(), quiet);
    }
    Ok((plan.map(orbit)?, edges))
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

/// What a map was used for, as it is written to JSON.
#[derive(Serialize)]
pub(super) struct ByMap<'a, T> {
    #[serde(flatten)]
    content: &'a T,
    /// What the contacts of the map leave out at the edge of the window, by passage.
    window_edges: &'a [WindowEdge],
    /// The section that it is on.
    section: &'a SectionDocument,
}

impl<'a, T> ByMap<'a, T> {
    /// All that one map was used for.
    pub(super) fn each(
        contents: &'a [T],
        window_edges: &'a [WindowEdge],
        section: &'a SectionDocument,
    ) -> Vec<Self> {
        let by_map = |content| Self {
            content,
            window_edges,
            section,
        };
        contents.iter().map(by_map).collect()
    }
}
