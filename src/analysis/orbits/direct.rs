//! Orbits of direct simulation next to those of a map.

use super::data::{FoundOrbit, LostReason, OrbitContact};
use crate::analysis::periodic::{
    BifurcationKind, ContactItinerary, Guess, Held, ItineraryBifurcation, ItineraryOrbit,
    PeriodicOrbit, PeriodicOutcome, PeriodicProblem, bifurcation, periodic_orbit, window_scales,
};
use crate::analysis::{AnalysisError, DepthEvaluation, DirectImage, MapEvaluation};
use crate::expansion::{LocalMap, MapWindow};
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// Direct simulation in double-double, with what places its orbits in the window of a map.
#[derive(Clone, Debug)]
pub(super) struct Direct<'a> {
    image: DirectImage<'a, Dd>,
    window: &'a MapWindow,
    depths: DepthEvaluation<f64>,
    scales: Vec<f64>,
}

impl<'a> Direct<'a> {
    /// Of a scene about its grazing orbit.
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            image: DirectImage::new(system, scene, orbit)?,
            window: &map.window,
            depths: MapEvaluation::depths(map),
            scales: window_scales(&map.window),
        })
    }

    /// The orbit next to one of the map, at its parameters.
    pub(super) fn orbit<S: Real>(
        &mut self,
        itinerary: &ContactItinerary,
        near: &ItineraryOrbit<S>,
    ) -> Result<FoundOrbit, LostReason> {
        let problem = self.problem(itinerary, 0);
        let orbit = self.solved(itinerary, &problem, Held::Parameter, &exact(near))?;
        self.found(itinerary, &orbit)
    }

    /// The bifurcation between the neighbours that the map has of one.
    pub(super) fn bifurcation(
        &mut self,
        itinerary: &ContactItinerary,
        near: &ItineraryBifurcation,
        free: usize,
    ) -> Result<FoundOrbit, LostReason> {
        let problem = self.problem(itinerary, free);
        let [before, after] = &near.beside;
        let coordinate = self.steepest(before, after);
        let held = Held::Coordinate(coordinate);
        let before = self.solved(itinerary, &problem, held, &exact(before))?;
        let after = self.solved(itinerary, &problem, held, &exact(after))?;
        let kind: BifurcationKind = near.kind;
        let ends = [&before, &after];
        let found = bifurcation(&mut self.image, &problem, kind, coordinate, ends);
        self.found(itinerary, &found.ok_or(LostReason::NotBracketed)?.orbit)
    }

    fn problem(&self, itinerary: &ContactItinerary, free: usize) -> PeriodicProblem {
        PeriodicProblem {
            returns: itinerary.period(),
            free,
            itinerary: Some(itinerary.returns().to_vec()),
            scales: self.scales.clone(),
        }
    }

    fn solved(
        &mut self,
        itinerary: &ContactItinerary,
        problem: &PeriodicProblem,
        held: Held,
        guess: &Guess<Dd>,
    ) -> Result<PeriodicOrbit<Dd>, LostReason> {
        match periodic_orbit(&mut self.image, problem, held, guess) {
            PeriodicOutcome::Found(orbit) => Ok(orbit),
            PeriodicOutcome::OtherItinerary(orbit) => {
                let passages = itinerary.passages();
                let other = ContactItinerary::new(passages, orbit.itinerary);
                Err(LostReason::OtherItinerary(other))
            }
            _ => Err(LostReason::NotConverged),
        }
    }

    /// The coordinate of the first point that differs most between two orbits.
    fn steepest(&self, before: &ItineraryOrbit<f64>, after: &ItineraryOrbit<f64>) -> usize {
        let pairs = before.orbit.states[0].iter().zip(&after.orbit.states[0]);
        let changes = pairs.zip(&self.scales);
        let changes = changes.map(|((a, b), scale)| ((a - b) / scale).abs());
        let largest = changes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        largest.map_or(0, |(coordinate, _)| coordinate)
    }

    /// The orbit with its speeds, flown once more.
    fn found(
        &mut self,
        itinerary: &ContactItinerary,
        orbit: &PeriodicOrbit<Dd>,
    ) -> Result<FoundOrbit, LostReason> {
        let (mut contacts, mut inside) = (Vec::new(), true);
        let parameters: Vec<f64> = orbit
            .parameters
            .iter()
            .map(|value| value.to_f64())
            .collect();
        for (number, state) in orbit.states.iter().enumerate() {
            let image = self.image.image(state, &orbit.parameters);
            let image = image.map_err(|_| LostReason::NotConverged)?;
            let speeds = image.passages.iter().enumerate();
            contacts.extend(speeds.filter_map(|(passage, speed)| {
                Some(OrbitContact {
                    number,
                    passage,
                    speed: (*speed)?.to_f64(),
                })
            }));
            let state: Vec<f64> = state.iter().map(|value| value.to_f64()).collect();
            let depths = self.depths.at(&state, &parameters);
            inside &= self.window.holds(&state, &parameters, &depths);
        }
        let kind = (orbit.extra_contacts == 0, inside);
        FoundOrbit::of(itinerary, orbit, contacts, kind).ok_or(LostReason::NotConverged)
    }
}

/// The first point of an orbit, as a guess.
fn exact<S: Real>(orbit: &ItineraryOrbit<S>) -> Guess<Dd> {
    let convert = |values: &[S]| values.iter().map(|value| value.to_dd()).collect();
    Guess {
        state: convert(&orbit.orbit.states[0]),
        parameters: convert(&orbit.orbit.parameters),
    }
}
