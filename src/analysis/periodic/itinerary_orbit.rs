//! A periodic orbit of an itinerary, and whether the map goes that way.

use super::orbit::PeriodicOrbit;
use crate::expansion::MapWindow;
use crate::numeric::Real;

/// A periodic orbit with prescribed contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct ItineraryOrbit<S> {
    /// The orbit, its itinerary the one prescribed.
    pub orbit: PeriodicOrbit<S>,
    /// `y` of each contact, in order; negative on the other branch of the root.
    pub depth_variables: Vec<S>,
    /// Largest depth of the passages without contact; `None` where all make contact.
    pub free_depth: Option<S>,
    /// Every contact: its return and its passage, from 0, and the point (coordinates; parameters)
    /// with which it is reached.
    pub arrivals: Vec<(usize, usize, Vec<S>)>,
}

impl<S: Real> ItineraryOrbit<S> {
    /// Whether the map goes the way prescribed: contact at positive `y`, none where no depth is
    /// positive. Other orbits are *virtual*: what the branches of the root continue to where
    /// the map takes another.
    pub fn is_physical(&self) -> bool {
        let contact = self.depth_variables.iter().all(|&y| y > S::zero());
        contact && self.free_depth.is_none_or(|depth| depth <= S::zero())
    }

    /// Whether all points, the parameters and the depths lie in a window.
    pub fn is_within(&self, window: &MapWindow) -> bool {
        let depths: Vec<S> = self.depth_variables.iter().map(|&y| y * y).collect();
        let mut states = self.orbit.states.iter();
        states.all(|state| window.holds(state, &self.orbit.parameters, &depths))
    }

    /// Whether it goes through the same points after so many returns, to this share of the scales.
    pub(super) fn repeats_after(&self, returns: usize, scales: &[f64], tolerance: f64) -> bool {
        self.is_same_as(self, returns, scales, tolerance)
    }

    /// Whether its points are those of another orbit that begins so many returns later.
    pub(super) fn is_same_as(
        &self,
        other: &Self,
        later: usize,
        scales: &[f64],
        tolerance: f64,
    ) -> bool {
        let (ours, others) = (&self.orbit.states, &other.orbit.states);
        let near = |(number, state): (usize, &Vec<S>)| {
            let other = &others[(number + later) % others.len()];
            let mut pairs = state.iter().zip(other).zip(scales);
            pairs.all(|((&a, &b), scale)| (a - b).magnitude() <= tolerance * scale)
        };
        ours.len() == others.len() && ours.iter().enumerate().all(near)
    }
}
