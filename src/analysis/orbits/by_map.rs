//! Orbits of a local map, with the speeds at which they meet the surfaces.

use super::data::{FoundOrbit, OrbitContact};
use crate::analysis::AnalysisError;
use crate::analysis::periodic::{ContactItinerary, ItineraryOrbit};
use crate::expansion::{Expander, ImpactSpeed, LocalMap, MapWindow};
use crate::model::Scene;
use crate::numeric::Real;
use crate::orbit::GrazingOrbit;

/// What tells the speeds of a map's contacts.
#[derive(Debug)]
pub(super) struct ByMap<'a> {
    speeds: Vec<ImpactSpeed>,
    window: &'a MapWindow,
}

impl<'a> ByMap<'a> {
    /// The expansions of all passages, to the weight of the map's contacts.
    pub(super) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
    ) -> Result<Self, AnalysisError> {
        let expander = Expander::new(scene, orbit)?;
        let speed = |passage| expander.impact_speed(passage, map.orders.contact_weight);
        let speeds = (0..expander.passages()).map(speed);
        Ok(Self {
            speeds: speeds.collect::<Result<_, _>>()?,
            window: &map.window,
        })
    }

    /// An orbit of the map as it is given out.
    pub(super) fn found<S: Real>(
        &self,
        itinerary: &ContactItinerary,
        orbit: &ItineraryOrbit<S>,
    ) -> Option<FoundOrbit> {
        let contacts = orbit.arrivals.iter().zip(&orbit.depth_variables);
        let contact = |((number, passage, point), y): (&(usize, usize, Vec<S>), &S)| {
            let point: Vec<f64> = point.iter().map(|value| value.to_f64()).collect();
            OrbitContact {
                number: *number,
                passage: *passage,
                speed: self.speeds[*passage].at(y.to_f64(), &point),
            }
        };
        let contacts = contacts.map(contact).collect();
        let kind = (orbit.is_physical(), orbit.is_within(self.window));
        FoundOrbit::of(itinerary, &orbit.orbit, contacts, kind)
    }
}
