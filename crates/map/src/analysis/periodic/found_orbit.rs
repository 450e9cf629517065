//! A periodic orbit as it is given out, whatever it was found by.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::contact_itinerary::ContactItinerary;
use super::itinerary_search::ItineraryOrbit;
use super::orbit::PeriodicOrbit;
use crate::analysis::continuation::largest;
use crate::analysis::error::AnalysisError;
use crate::expansion::{Expander, ImpactSpeed, LocalMap, MapWindow};
use crate::iteration::PhaseCircle;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Real, converted};
use crate::orbit::GrazingOrbit;

/// A periodic orbit that was found; everything in offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundOrbit {
    /// Its itinerary.
    pub itinerary: ContactItinerary,
    /// All active parameters.
    pub parameters: Vec<f64>,
    /// Its points, in order.
    pub states: Vec<Vec<f64>>,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all of them lie inside the unit circle.
    pub stable: bool,
    /// Its contacts, in order.
    pub contacts: Vec<OrbitContact>,
    /// Whether map or simulation make the contacts of the itinerary and no other; on branches of
    /// direct simulation always, where further contacts are counted in `hits`.
    pub physical: bool,
    /// Whether its points, depths and parameters lie in the window.
    pub inside: bool,
    /// Contacts that no passage accounts for, by direct simulation.
    pub extra_contacts: usize,
    /// All contacts at each surface that grazes, in the model's order, on branches of direct
    /// simulation.
    pub hits: Option<Vec<u32>>,
    /// Whole periods of the phase that it takes beyond the nominal ones of its returns.
    #[serde(default)]
    pub turns: i32,
    /// Largest difference of a coordinate of the last image and the first point, in half-widths of
    /// the window.
    pub residual: f64,
}

/// A contact of a periodic orbit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitContact {
    /// The return that it belongs to, from 0.
    #[serde(rename = "return")]
    pub number: usize,
    /// The passage, from 0.
    pub passage: usize,
    /// Speed at which the surface is met; negative on the other branch of the root.
    pub speed: f64,
}

/// Part of their size to which coordinates of one orbit agree.
const SAME: f64 = 1e-9;

impl FoundOrbit {
    /// Whether another orbit of the same itinerary and parameters is this one, begun at any of its
    /// points on a section with this phase.
    pub(in crate::analysis) fn is_same_as(&self, other: &Self, circle: PhaseCircle) -> bool {
        let near = |a: &[f64], b: &[f64], circle: PhaseCircle| {
            let mut pairs = a.iter().zip(b).enumerate();
            pairs.all(|(place, (a, b))| {
                let apart = circle.shortest(place, a - b).abs();
                apart <= SAME * a.abs().max(b.abs()) + f64::EPSILON
            })
        };
        near(&self.parameters, &other.parameters, PhaseCircle::none())
            && self.states.iter().any(|state| near(state, &other.states[0], circle))
    }

    /// An orbit of a branch, of these section points and all parameters; its contacts and whether
    /// it lies in the window are left to tell. It has no multipliers without a Jacobian.
    pub(in crate::analysis) fn on_branch<S: Real>(
        itinerary: &ContactItinerary,
        (states, parameters): (&[Vec<S>], &[S]),
        jacobian: Option<DMatrix<S>>,
        residual: &DVector<S>,
    ) -> Self {
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        Self {
            itinerary: itinerary.clone(),
            parameters: converted(parameters),
            states: states.iter().map(|state| converted(state)).collect(),
            stable: !multipliers.is_empty() && multipliers.iter().all(|value| value.norm() < 1.0),
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            contacts: Vec::new(),
            physical: true,
            inside: false,
            extra_contacts: 0,
            hits: None,
            turns: 0,
            residual: largest(residual),
        }
    }

    /// An orbit with its contacts; `None` where its multipliers are not numbers.
    pub(in crate::analysis) fn of<S: Real>(
        itinerary: &ContactItinerary,
        orbit: &PeriodicOrbit<S>,
        contacts: Vec<OrbitContact>,
        (physical, inside): (bool, bool),
    ) -> Option<Self> {
        let multipliers = orbit.multipliers().ok()?;
        Some(Self {
            itinerary: itinerary.clone(),
            parameters: converted(&orbit.parameters),
            states: orbit.states.iter().map(|state| converted(state)).collect(),
            stable: orbit.is_stable().ok()?,
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            contacts,
            physical,
            inside,
            extra_contacts: orbit.extra_contacts,
            hits: None,
            turns: orbit.turns,
            residual: orbit.residual,
        })
    }
}

/// Impact speeds of a map's contacts.
#[derive(Debug)]
pub(in crate::analysis) struct ByMap<'a> {
    speeds: Vec<ImpactSpeed>,
    window: &'a MapWindow,
}

impl<'a> ByMap<'a> {
    /// The expansions of all passages, to the weight of the map's contacts.
    pub(in crate::analysis) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
    ) -> Result<Self, AnalysisError> {
        let expander = Expander::new(scene, orbit)?;
        let speed = |passage| expander.impact_speed(passage, map.orders.contact_weight);
        let speeds = (0..expander.passages()).map(speed);
        Ok(Self { speeds: speeds.collect::<Result<_, _>>()?, window: &map.window })
    }

    /// The speed of a contact of a passage of depth variable `y`, reached at a point (coordinates;
    /// parameters).
    pub(in crate::analysis) fn speed(&self, passage: usize, y: f64, point: &[f64]) -> f64 {
        self.speeds[passage].at(y, point)
    }

    /// An orbit of the map as it is given out.
    pub(in crate::analysis) fn found<S: Real>(
        &self,
        itinerary: &ContactItinerary,
        orbit: &ItineraryOrbit<S>,
    ) -> Option<FoundOrbit> {
        let contacts = orbit.arrivals.iter().zip(&orbit.depth_variables);
        let contact = |((number, passage, point), y): (&(usize, usize, Vec<S>), &S)| {
            let speed = self.speed(*passage, y.to_f64(), &converted(point));
            OrbitContact { number: *number, passage: *passage, speed }
        };
        let contacts = contacts.map(contact).collect();
        let kind = (orbit.is_physical(), orbit.is_within(self.window));
        FoundOrbit::of(itinerary, &orbit.orbit, contacts, kind)
    }
}
