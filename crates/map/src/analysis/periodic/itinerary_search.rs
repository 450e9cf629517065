//! Search for the periodic orbits of an itinerary at given parameters, as fixed points of a map
//! without a root, from many starts.
//!
//! One idea: with the contacts of a period prescribed and their depth variables as additional
//! coordinates, a local map is a polynomial, with one more equation `y² = depth` for each contact.
//! Newton's method then meets neither the root nor the graze. Whether the map itself makes these
//! contacts is checked on the orbit found. See docs/mathematics/dynamics.md.
//!
//! Near a graze these equations are quadratic in each depth variable, so that for each choice of
//! signs a start far out leads Newton's method to the solution on that side. Smaller starts, starts
//! scattered over positive depth variables, and orbits that the map settles on find solutions due
//! to higher orders. The search does not prove that there are no others.

use nalgebra::DMatrix;

use super::contact_itinerary::ContactItinerary;
use super::orbit::{
    Guess, Held, PeriodicOrbit, PeriodicProblem, finite_or_one, periodic_orbit, window_scales,
};
use super::section_map::{SectionMap, SectionStep};
use crate::analysis::diagram::SmoothFixedPoint;
use crate::analysis::evaluation::{Arrival, MapEvaluation, MapImage};
use crate::expansion::{LocalMap, MapWindow};
use crate::iteration::{InterpretedMap, MapOrbit, OrbitRequest, PassageSet, Period};
use crate::numeric::linear::inverse;
use crate::numeric::{Dd, Real, converted};

/// Largest depth variables searched, relative to the window's edge.
const REACH: f64 = 2.0;
/// Largest offsets of states and parameters, in half-widths of the window.
const FARTHEST: f64 = 100.0;
/// Sizes of starts, relative to the window's depth variable.
const SIZES: [f64; 2] = [1.0, 0.1];
/// Most contacts for which every choice of signs is tried; with more, only equal signs.
const ALL_SIGNS: usize = 4;
/// Number of starts scattered over positive depth variables.
const SCATTERED: usize = 8;
/// Iterates before a map counts as settled, and starts of these orbits as distances from the fixed
/// point of `P_smooth` in half-widths.
const TRANSIENT: usize = 1000;
const SETTLE_FROM: [f64; 3] = [0.0, 0.3, -0.3];
/// Difference, in scales, up to which coordinates of orbits count as equal.
pub(super) const SAME: f64 = 1e-7;

/// Search for periodic orbits of a local map by itinerary.
///
/// Finds orbits with depth variables up to twice that of the window's edge. With flown contacts,
/// which are defined for positive depth variables only, these must be positive.
#[derive(Clone, Debug)]
pub struct ItinerarySearch<'a> {
    pub(in crate::analysis) map: MapEvaluation<f64>,
    pub(in crate::analysis) fine: MapEvaluation<Dd>,
    pub(in crate::analysis) smooth: SmoothFixedPoint,
    iterated: InterpretedMap,
    pub(super) window: &'a MapWindow,
    pub(super) dimension: usize,
    passages: usize,
    pub(in crate::analysis) positive: bool,
}

/// Start of a search: the first point, and the depth variable of each contact.
pub(in crate::analysis) struct SearchStart {
    pub(in crate::analysis) state: Vec<f64>,
    pub(in crate::analysis) depth_variables: Vec<f64>,
}

/// A periodic orbit that a map settled on.
pub(in crate::analysis) struct SettledCycle {
    itinerary: ContactItinerary,
    /// Points of the period, each with the depth variables of the contacts that follow it.
    points: Vec<(Vec<f64>, Vec<f64>)>,
}

impl<'a> ItinerarySearch<'a> {
    /// Search in a map.
    pub fn new(map: &'a LocalMap) -> Self {
        Self {
            map: MapEvaluation::new(map),
            fine: MapEvaluation::new(map),
            smooth: SmoothFixedPoint::new(map),
            iterated: InterpretedMap::new(map),
            window: &map.window,
            dimension: map.dimension(),
            passages: map.passages(),
            positive: !map.is_polynomial(),
        }
    }

    /// Orbits of an itinerary at these parameters, each once, physical ones first. Orbits that
    /// repeat a shorter one are left out.
    ///
    /// Orbits are solved for in double precision, then in double-double.
    pub fn orbits(
        &self,
        itinerary: &ContactItinerary,
        parameters: &[f64],
    ) -> Vec<ItineraryOrbit<Dd>> {
        let mut found: Vec<ItineraryOrbit<f64>> = Vec::new();
        for start in self.starts(itinerary, parameters) {
            let guess = Guess {
                state: [start.state, start.depth_variables].concat(),
                parameters: parameters.to_vec(),
            };
            let orbit = self.solved(&self.map, itinerary, &guess);
            found.extend(orbit.filter(|orbit| self.is_new(itinerary, orbit, &found)));
        }
        let fine = |orbit: &ItineraryOrbit<f64>| {
            let state = [&orbit.orbit.states[0][..], &orbit.depth_variables].concat();
            let guess = Guess { state: converted(&state), parameters: converted(parameters) };
            self.solved(&self.fine, itinerary, &guess)
        };
        let mut orbits: Vec<_> = found.iter().filter_map(fine).collect();
        let first = |orbit: &ItineraryOrbit<Dd>| orbit.depth_variables.first().map(|y| y.to_f64());
        orbits.sort_by(|a, b| {
            let physical = b.is_physical().cmp(&a.is_physical());
            physical.then(first(a).partial_cmp(&first(b)).unwrap_or(std::cmp::Ordering::Equal))
        });
        orbits
    }

    /// Orbit near a guess, at its parameters.
    fn solved<S: Real>(
        &self,
        map: &MapEvaluation<S>,
        itinerary: &ContactItinerary,
        guess: &Guess<S>,
    ) -> Option<ItineraryOrbit<S>> {
        let mut map = DepthVariableMap::new(map, itinerary, self.dimension, self.unit());
        let problem = map.problem(self.window, 0);
        let fixed = periodic_orbit(&mut map, &problem, Held::Parameter, guess).found()?;
        map.orbit(&fixed)
    }

    /// Whether an orbit is near enough, of no shorter period, and not among those found.
    pub(super) fn is_new(
        &self,
        itinerary: &ContactItinerary,
        orbit: &ItineraryOrbit<f64>,
        found: &[ItineraryOrbit<f64>],
    ) -> bool {
        let scales = &self.scales();
        let mut later = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        let shorter = later.any(|later| orbit.repeats_after(later, scales, SAME));
        let same = |other: &ItineraryOrbit<f64>| {
            let mut later = (0..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
            later.any(|later| orbit.is_same_as(other, later, scales, SAME))
        };
        self.is_near(orbit) && !shorter && !found.iter().any(same)
    }

    /// Whether an orbit is within the range of the search.
    fn is_near(&self, orbit: &ItineraryOrbit<f64>) -> bool {
        let within = |values: &[f64], widths: &[f64]| {
            let mut pairs = values.iter().zip(widths);
            pairs.all(|(value, width)| value.abs() <= FARTHEST * width)
        };
        let least = if self.positive { 0.0 } else { -REACH * self.unit() };
        let mut depths = orbit.depth_variables.iter();
        let mut states = orbit.orbit.states.iter();
        depths.all(|&y| least <= y && y <= REACH * self.unit())
            && states.all(|state| within(state, &self.window.state))
            && within(&orbit.orbit.parameters, &self.window.parameter)
    }

    /// Depth variable `y` at the window's edge; 1 if it is unbounded.
    pub(super) fn unit(&self) -> f64 {
        finite_or_one(self.window.depth.sqrt())
    }

    /// Half-widths of the window; 1 if unbounded.
    pub(super) fn scales(&self) -> Vec<f64> {
        let widths = self.window.state.iter();
        widths.map(|&width| finite_or_one(width)).collect()
    }

    /// Starts of Newton's method.
    fn starts(&self, itinerary: &ContactItinerary, parameters: &[f64]) -> Vec<SearchStart> {
        let settled = self.settled(parameters, itinerary.period());
        let settled = settled.iter().filter_map(|settled| settled.begun_as(itinerary));
        self.starts_about(itinerary, parameters).into_iter().chain(settled).collect()
    }

    /// Starts at the fixed point of `P_smooth`, with depth variables on both sides of zero and
    /// scattered ones.
    pub(in crate::analysis) fn starts_about(
        &self,
        itinerary: &ContactItinerary,
        parameters: &[f64],
    ) -> Vec<SearchStart> {
        let state = self.smooth.at(parameters);
        let contacts = itinerary.contacts();
        let about = self.sides(contacts).into_iter().chain(self.scattered(contacts));
        about.map(|depth_variables| SearchStart { state: state.clone(), depth_variables }).collect()
    }

    /// Depth variables beyond the solutions, for the choices of signs.
    pub(super) fn sides(&self, contacts: usize) -> Vec<Vec<f64>> {
        let of = |signs: usize, size: f64| {
            let sign = |place: usize| if (signs >> place) & 1 == 0 { 1.0 } else { -1.0 };
            (0..contacts).map(|place| sign(place) * size).collect()
        };
        let every = (1_usize << contacts.min(ALL_SIGNS)) - 1;
        let signs: Vec<usize> = match contacts {
            _ if self.positive => vec![0],
            0..=ALL_SIGNS => (0..=every).collect(),
            _ => vec![0, usize::MAX],
        };
        let sizes = SIZES.map(|size| REACH * size * self.unit());
        let sides = sizes.iter().flat_map(|&size| signs.iter().map(move |&signs| (signs, size)));
        sides.map(|(signs, size)| of(signs, size)).collect()
    }

    /// Positive depth variables from a Kronecker sequence, denser towards zero.
    fn scattered(&self, contacts: usize) -> Vec<Vec<f64>> {
        let count = if contacts > 1 { SCATTERED } else { 0 };
        // The steps of the generalised golden ratio: x^(m+1) = x + 1.
        let golden = (0..40).fold(2.0_f64, |x, _| (1.0 + x).powf(1.0 / (contacts as f64 + 1.0)));
        let point = |number: usize| {
            let share = |place: i32| (0.5 + number as f64 * golden.powi(-place)).fract();
            let places = 1..=contacts as i32;
            places.map(|place| self.unit() * share(place).powi(2)).collect()
        };
        (1..=count).map(point).collect()
    }

    /// Periodic orbits that the map settles on, with periods up to the longest.
    pub(in crate::analysis) fn settled(
        &self,
        parameters: &[f64],
        longest: usize,
    ) -> Vec<SettledCycle> {
        let (fixed, scales) = (self.smooth.at(parameters), self.scales());
        let request = OrbitRequest::new(TRANSIENT, 2 * longest, &scales);
        let from = SETTLE_FROM.iter().filter_map(|share| {
            let start = fixed.iter().zip(&scales);
            let start: Vec<f64> = start.map(|(x, scale)| x + share * scale).collect();
            let orbit = MapOrbit::of(&self.iterated, &start, parameters, &request);
            match orbit.period {
                Period::Periodic(period) if period <= longest => {
                    Some(self.followed(orbit.last, parameters, period))
                }
                _ => None,
            }
        });
        from.collect()
    }

    /// One period of the map from a point.
    fn followed(&self, start: Vec<f64>, parameters: &[f64], period: usize) -> SettledCycle {
        let (mut state, mut points, mut returns) = (start, Vec::new(), Vec::new());
        for _ in 0..period {
            let image = self.map.image(&state, parameters);
            let made = image.depths.iter().enumerate().filter(|(_, depth)| **depth > 0.0);
            returns.push(made.clone().map(|(passage, _)| passage).collect::<PassageSet>());
            let depth_variables = made.map(|(_, depth)| depth.sqrt()).collect();
            points.push((std::mem::replace(&mut state, image.offsets), depth_variables));
        }
        SettledCycle { itinerary: ContactItinerary::new(self.passages, returns), points }
    }
}

impl SettledCycle {
    /// Start on this orbit from which it has the given itinerary; `None` if it has another.
    pub(in crate::analysis) fn begun_as(
        &self,
        itinerary: &ContactItinerary,
    ) -> Option<SearchStart> {
        let by = self.itinerary.rotation_to(itinerary)?;
        let points = self.points.iter().cycle().skip(by).take(self.points.len());
        let depth_variables = points.flat_map(|(_, depths)| depths).copied().collect();
        Some(SearchStart { state: self.points[by].0.clone(), depth_variables })
    }
}

/// Map of a whole period with given contacts, in the coordinates of the section and the depth
/// variables of the contacts:
///
/// ```text
/// x   ↦ P_n(… P_1(x; y) …; y),        P_k with its contacts, at these y, whatever the depths
/// y_j ↦ y_j + (depth_j(x; y) − y_j²)/Y,   Y² the depth of the window
/// ```
///
/// Its fixed points are the periodic orbits of the itinerary, with each contact on either branch of
/// its root.
#[derive(Clone, Debug)]
pub struct DepthVariableMap<'a, S: Real> {
    map: &'a MapEvaluation<S>,
    itinerary: &'a ContactItinerary,
    dimension: usize,
    /// Depth variable `Y` of the window.
    unit: S,
}

impl<'a, S: Real> DepthVariableMap<'a, S> {
    /// Map of an itinerary; `dimension` is the number of coordinates, `unit` the size of depth
    /// variables.
    pub fn new(
        map: &'a MapEvaluation<S>,
        itinerary: &'a ContactItinerary,
        dimension: usize,
        unit: f64,
    ) -> Self {
        Self { map, itinerary, dimension, unit: S::from_f64(unit) }
    }

    /// Index of the first depth variable among the coordinates.
    pub fn first_depth_variable(&self) -> usize {
        self.dimension
    }

    /// Search problem for fixed points with one free parameter.
    pub fn problem(&self, window: &MapWindow, free: usize) -> PeriodicProblem {
        let mut scales = window_scales(window);
        let depths = std::iter::repeat_n(self.unit.to_f64(), self.itinerary.contacts());
        scales.splice(self.dimension..self.dimension, depths);
        PeriodicProblem { returns: 1, free, itinerary: None, scales }
    }

    /// Orbit of the map for a fixed point; `None` if a depth variable vanishes, where multipliers
    /// are undefined.
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
                turns: 0,
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

    /// Derivative of the map of the period by the section's coordinates, with the depth variables
    /// eliminated:
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

    /// End of a period, and the differences of each depth and its `y²`. Calls `arrive` at every
    /// passage with its depth variable, and `returned` with every image.
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
    /// Orbit with the prescribed itinerary.
    pub orbit: PeriodicOrbit<S>,
    /// Depth variable `y` of each contact, in order; negative on the other branch of the root.
    pub depth_variables: Vec<S>,
    /// Largest depth of the passages without contact; `None` if all make contact.
    pub free_depth: Option<S>,
    /// Return, passage (from 0) and point of arrival (coordinates; parameters) of each contact.
    pub arrivals: Vec<(usize, usize, Vec<S>)>,
}

impl<S: Real> ItineraryOrbit<S> {
    /// Whether the map makes the prescribed contacts: positive `y` at each contact, no positive
    /// depth at other passages. Other orbits are *virtual*: they lie on branches of the root that
    /// the map does not take there.
    pub fn is_physical(&self) -> bool {
        let contact = self.depth_variables.iter().all(|&y| y > S::zero());
        contact && self.free_depth.is_none_or(|depth| depth <= S::zero())
    }

    /// Whether all points, parameters and depths lie in a window.
    pub fn is_within(&self, window: &MapWindow) -> bool {
        let depths: Vec<S> = self.depth_variables.iter().map(|&y| y * y).collect();
        let mut states = self.orbit.states.iter();
        states.all(|state| window.holds(state, &self.orbit.parameters, &depths))
    }

    /// Whether the orbit repeats after `returns` returns, to a tolerance in the scales.
    pub(super) fn repeats_after(&self, returns: usize, scales: &[f64], tolerance: f64) -> bool {
        self.is_same_as(self, returns, scales, tolerance)
    }

    /// Whether another orbit, started `later` returns later, has the same points.
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
