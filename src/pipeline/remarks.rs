//! What is to be said of the windows of maps.

use super::Map;
use crate::expansion::WindowEdge;
use crate::report::{edge_words, window_remark};

impl Map {
    /// What is to be said of the map: where it errs on its window more than it should, and where
    /// the window is deeper than the series of the passage whose contact loses most.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let edge = worst_edge(self.window_edges());
        let remark = window_remark(self.window(), self.orders(), edge.as_ref());
        remark.map(|remark| remark.of(&self.scene().identifier)).into_iter()
    }

    /// The edge of the passage whose contact loses most, where that is too much.
    pub fn worst_edge(&self) -> Option<WindowEdge> {
        worst_edge(self.window_edges())
    }
}

/// What a truncation leaves out at the edge of a window, of the passage whose contact loses most,
/// where that is too much.
pub(super) fn edge_remark(edges: &[WindowEdge]) -> Option<String> {
    let words = |edge| format!("at the edge of the window {}", edge_words(&edge));
    worst_edge(edges).map(words)
}

fn worst_edge(edges: &[WindowEdge]) -> Option<WindowEdge> {
    let share = |edge: &WindowEdge| edge.omitted_share;
    let beyond = edges.iter().filter(|edge| !edge.is_within()).copied();
    beyond.max_by(|a, b| share(a).total_cmp(&share(b)))
}
