//! Periodic orbits in their final form, for any method.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::contact_itinerary::ContactItinerary;
use super::itinerary_search::ItineraryOrbit;
use super::orbit::PeriodicOrbit;
use crate::analysis::error::AnalysisError;
use crate::continuation::largest;
use crate::expansion::{Expander, ImpactSpeed, LocalMap, MapWindow};
use crate::iteration::PhaseCircle;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Real, converted};
use crate::orbit::GrazingOrbit;

/// A periodic orbit that was found; all values are offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundOrbit {
    /// Itinerary.
    pub itinerary: ContactItinerary,
    /// All active parameters.
    pub parameters: Vec<f64>,
    /// Points in order.
    pub states: Vec<Vec<f64>>,
    /// Multipliers as `[re, im]`, largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers lie inside the unit circle.
    pub stable: bool,
    /// Contacts in order.
    pub contacts: Vec<OrbitContact>,
    /// Whether the map or simulation makes exactly the contacts of the itinerary. Always true on
    /// branches of direct simulation, where `hits` counts further contacts.
    pub physical: bool,
    /// Whether points, depths and parameters lie in the window.
    pub inside: bool,
    /// Contacts beyond one per passage, or at other surfaces, by direct simulation.
    pub extra_contacts: usize,
    /// Contacts at each grazing surface, in the model's order; only on branches of direct
    /// simulation.
    pub hits: Option<Vec<u32>>,
    /// Whole periods of the phase beyond the nominal ones of the returns.
    #[serde(default)]
    pub turns: i32,
    /// Largest difference of a coordinate between the last image and the first point, in
    /// half-widths of the window.
    pub residual: f64,
}

/// A contact of a periodic orbit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitContact {
    /// Index of the return, from 0.
    #[serde(rename = "return")]
    pub number: usize,
    /// Index of the passage, from 0.
    pub passage: usize,
    /// Impact speed; negative on the other branch of the root.
    pub speed: f64,
}

/// Relative difference up to which coordinates count as equal.
const SAME: f64 = 1e-9;

impl FoundOrbit {
    /// Nominal return times that a period of the orbit takes, rounded up, for returns of so many
    /// periods of the phase; the returns themselves of an autonomous system.
    pub fn nominal_returns(&self, periods: usize) -> usize {
        let all = self.itinerary.period() * periods;
        match all.saturating_add_signed(self.turns as isize) {
            0 => self.itinerary.period(),
            all => all.div_ceil(periods.max(1)),
        }
    }

    /// Whether another orbit of the same itinerary is this one, at the same parameters and from any
    /// of its points; `circle` is the phase of the section.
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

    /// Orbit of a branch with the given section points and parameters. Contacts and `inside` are
    /// set by the caller; there are no multipliers without a Jacobian.
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

    /// Orbit with its contacts; `None` if its multipliers are not numbers.
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
    /// Speeds from the expansions of all passages, to the weight of the map's contacts.
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

    /// Speed of a contact of a passage with depth variable `y`, reached at a point (coordinates;
    /// parameters).
    pub(in crate::analysis) fn speed(&self, passage: usize, y: f64, point: &[f64]) -> f64 {
        self.speeds[passage].at(y, point)
    }

    /// Orbit of the map in its final form; `None` if its multipliers are not numbers.
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
