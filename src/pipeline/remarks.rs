//! What is to be said of the windows of maps, and of the device that made orbits.

use super::Map;
use crate::expansion::WindowEdge;
use crate::iteration::DeviceReport;
use crate::report::{edge_words, window_remark};

impl Map {
    /// What is to be said of the map: where it errs on its window more than it should, and where
    /// the window is deeper than the series of the passage whose contact loses most; and what
    /// another device than this processor did so far.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let edge = worst_edge(self.window_edges());
        let remark = window_remark(self.window(), self.orders(), edge.as_ref());
        let device = self.device().map(|device| device_words(&device.report()));
        let remark = remark.map(|remark| remark.of(&self.scene().identifier));
        remark.into_iter().chain(device.into_iter().flatten())
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

/// What a device did, what is left to this processor, and how it failed.
fn device_words(report: &DeviceReport) -> Vec<String> {
    let DeviceReport { name, made, handed_back, .. } = report;
    let did = format!(
        "{name}: {made} orbits, and {handed_back} handed back to this processor, which left the \
         window of the map"
    );
    let direct = report
        .left_direct
        .then(|| format!("{name}: direct simulation is not there; this processor made its charts"));
    let failed = report.failure.as_ref().map(|failure| {
        format!("warning: {name} failed, and this processor made the other orbits: {failure}")
    });
    [(made + handed_back > 0).then_some(did), direct, failed].into_iter().flatten().collect()
}

fn worst_edge(edges: &[WindowEdge]) -> Option<WindowEdge> {
    let share = |edge: &WindowEdge| edge.omitted_share;
    let beyond = edges.iter().filter(|edge| !edge.is_within()).copied();
    beyond.max_by(|a, b| share(a).total_cmp(&share(b)))
}
