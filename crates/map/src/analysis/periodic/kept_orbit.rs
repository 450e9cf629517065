//! Comparison of orbits read from files, which are not trusted, with computed ones.

use super::contact_itinerary::ContactItinerary;

/// Data of an orbit that a file may hold.
pub(in crate::analysis) trait KeptOrbit {
    /// Section points.
    fn states(&self) -> &[Vec<f64>];

    /// Whether all sizes are those of a computed orbit of the itinerary, and all indices have
    /// something to point to.
    fn is_like(&self, computed: &Self, itinerary: &ContactItinerary) -> bool;
}

/// Lengths of rows.
pub(super) fn lengths<T>(rows: &[Vec<T>]) -> Vec<usize> {
    rows.iter().map(Vec::len).collect()
}
