//! Periodic orbits of an itinerary as fixed points of a map without a root.
//!
//! One idea: with the contacts of a period prescribed and their depth variables as further
//! coordinates, a local map is a polynomial, `y² = depth` one more equation for each contact, and
//! Newton's method meets neither the root nor the graze. Whether the map itself makes these
//! contacts is checked on the orbit found. See docs/mathematics/dynamics.md.

use nalgebra::DMatrix;

use super::contact_itinerary::ContactItinerary;
use super::orbit::{Guess, PeriodicOrbit, PeriodicProblem, window_scales};
use super::section_map::{SectionMap, SectionStep};
use crate::analysis::evaluation::{Arrival, MapEvaluation, MapImage};
use crate::expansion::MapWindow;
use crate::iteration::PassageSet;
use crate::numeric::Real;
use crate::numeric::linear::inverse;

/// A whole period of a map with given contacts, in the coordinates of the section and the depth
/// variables of the contacts:
///
/// ```text
/// x   ↦ P_n(… P_1(x; y) …; y),        P_k with its contacts, at these y, whatever the depths
/// y_j ↦ y_j + (depth_j(x; y) − y_j²)/Y,   Y² the depth of the window
/// ```
///
/// Its fixed points are the periodic orbits of the itinerary, each contact on either branch of its
/// root.
#[derive(Clone, Debug)]
pub struct DepthVariableMap<'a, S: Real> {
    map: &'a MapEvaluation<S>,
    itinerary: &'a ContactItinerary,
    dimension: usize,
    /// `Y`.
    unit: S,
}

impl<'a, S: Real> DepthVariableMap<'a, S> {
    /// The map of an itinerary; `dimension` coordinates, depth variables of the size `unit`.
    pub fn new(
        map: &'a MapEvaluation<S>,
        itinerary: &'a ContactItinerary,
        dimension: usize,
        unit: f64,
    ) -> Self {
        Self { map, itinerary, dimension, unit: S::from_f64(unit) }
    }

    /// The first depth variable among the coordinates.
    pub fn first_depth_variable(&self) -> usize {
        self.dimension
    }

    /// The search for its fixed points with one parameter free.
    pub fn problem(&self, window: &MapWindow, free: usize) -> PeriodicProblem {
        let mut scales = window_scales(window);
        let depths = std::iter::repeat_n(self.unit.to_f64(), self.itinerary.contacts());
        scales.splice(self.dimension..self.dimension, depths);
        PeriodicProblem { returns: 1, free, itinerary: None, scales }
    }

    /// The orbit of the map that a fixed point is; `None` where a depth variable vanishes, and
    /// multipliers with it.
    pub fn orbit(&self, fixed: &PeriodicOrbit<S>) -> Option<ItineraryOrbit<S>> {
        let Guess { state, parameters } = fixed.guess();
        let (start, roots) = state.split_at(self.dimension);
        let mut states = vec![start.to_vec()];
        let (mut free_depth, mut arrivals) = (None, Vec::new());
        self.period(
            &state,
            &parameters,
            |number, arrival, root| match root {
                Some(_) => arrivals.push((number, arrival.passage, arrival.point.to_vec())),
                None => {
                    let deepest: S = free_depth.unwrap_or(arrival.depth);
                    free_depth = Some(deepest.max(arrival.depth));
                }
            },
            |image| states.push(image.offsets.clone()),
        );
        states.pop();
        Some(ItineraryOrbit {
            orbit: PeriodicOrbit {
                states,
                parameters,
                itinerary: self.itinerary.returns().to_vec(),
                extra_contacts: 0,
                jacobian: self.without_depth_variables(&fixed.jacobian)?,
                residual: fixed.residual,
            },
            depth_variables: roots.to_vec(),
            free_depth,
            arrivals,
        })
    }

    /// Derivative of the period's map by the section's coordinates, the depth variables following
    /// them:
    ///
    /// ```text
    /// dx⁺ = A dx + B dy,   0 = C dx + E dy:   J = A − B E⁻¹ C
    /// ```
    fn without_depth_variables(&self, jacobian: &DMatrix<S>) -> Option<DMatrix<S>> {
        let (dimension, contacts) = (self.dimension, self.itinerary.contacts());
        let block =
            |row, column, rows, columns| jacobian.view((row, column), (rows, columns)).into_owned();
        let by_state = block(0, 0, dimension, dimension);
        if contacts == 0 {
            return Some(by_state);
        }
        let mut equations = block(dimension, dimension, contacts, contacts);
        for place in 0..contacts {
            equations[(place, place)] -= S::one();
        }
        let followed = inverse(&equations).ok()? * block(dimension, 0, contacts, dimension);
        let jacobian = by_state - block(0, dimension, dimension, contacts) * followed;
        jacobian.iter().all(|entry| entry.is_finite()).then_some(jacobian)
    }

    /// The end of a period and the difference of each depth and its `y²`; `arrive` is called at
    /// every passage with its depth variable, `returned` with every image.
    fn period(
        &self,
        state: &[S],
        parameters: &[S],
        mut arrive: impl FnMut(usize, &Arrival<'_, S>, Option<S>),
        mut returned: impl FnMut(&MapImage<S>),
    ) -> (Vec<S>, Vec<S>) {
        let (start, roots) = state.split_at(self.dimension);
        let mut roots = roots.iter().copied();
        let (mut point, mut lacking) = (start.to_vec(), Vec::new());
        for (number, made) in self.itinerary.returns().iter().enumerate() {
            let image = self.map.image_with(&point, parameters, |arrival| {
                let root = made.contains(arrival.passage).then(|| roots.next()).flatten();
                lacking.extend(root.map(|y| arrival.depth - y * y));
                arrive(number, &arrival, root);
                root
            });
            returned(&image);
            point = image.offsets;
        }
        (point, lacking)
    }
}

impl<S: Real> SectionMap<S> for DepthVariableMap<'_, S> {
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        let (mut offsets, lacking) = self.period(state, parameters, |_, _, _| (), |_| ());
        let roots = state[self.dimension..].iter().zip(lacking);
        offsets.extend(roots.map(|(&y, lacking)| y + lacking / self.unit));
        let finite = offsets.iter().all(|value| value.is_finite());
        finite.then(|| SectionStep {
            offsets,
            contacts: PassageSet::default(),
            depth: S::zero(),
            extra_contacts: 0,
        })
    }
}

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
    /// Whether the map makes the contacts prescribed: contact at positive `y`, none where no depth
    /// is positive. Other orbits are *virtual*: what the branches of the root continue to where the
    /// map takes another.
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
