//! Interface of maps that can be swept along a parameter, and its implementations: fixing
//! parameters, settling, observing, and starting at the periodic orbit without contact.

use std::cell::OnceCell;
use std::sync::Mutex;

use nalgebra::{DMatrix, DVector};

use super::observe::Observer;
use crate::analysis::direct_map::{DIRECT_LANES, DirectMap, DirectPoints, GuardedMap};
use crate::analysis::error::{AnalysisError, check_contacts};
use crate::analysis::section_frame::{escape_bounds, itinerary, phase_circle, resolved_widths};
use crate::analysis::section_table::{AtlasMap, SectionTable, TabulatedUse};
use crate::atlas::Atlas;
use crate::expansion::{LocalMap, MapWindow, Stage};
use crate::hybrid::HybridSystem;
use crate::iteration::parallel::locked;
use crate::iteration::{
    DiscreteMap, HornerMap, InterpretedMap, Itinerary, LyapunovExponent, MapOrbit, OrbitEnd,
    OrbitRequest, Period, PhaseCircle, StepInfo, largest_lyapunov_exponent, parallel,
    periodic_lyapunov_exponent,
};
use crate::model::{Method, Observable, Scene};
use crate::orbit::GrazingOrbit;

/// Iterates in which the tangent vector of a Lyapunov exponent aligns.
pub(super) const TANGENT_TRANSIENT: usize = 20;

/// Number of lanes of a map: a step is a long chain of dependent operations, so that only other
/// orbits keep the processor busy, and the memory of its kernel must stay in cache.
const LANES: usize = 32;

/// Fewest orbits for which the lanes of a map are used: a step of all lanes costs as much as
/// several single ones.
const FEWEST_MAP_LANES: usize = 5;

/// Number of segments of a sweep by a map.
const MAP_SEGMENTS: usize = 64;

/// Number of segments of a sweep by direct simulation, where correcting a start costs more.
const DIRECT_SEGMENTS: usize = 16;

/// A map that can be swept along a parameter.
pub trait SweptMap: Sync {
    /// Method.
    fn method(&self) -> Method;

    /// Number of parameters.
    fn parameters(&self) -> usize;

    /// Number of segments of a sweep that run in parallel, given enough values.
    fn segments(&self) -> usize;

    /// Number of orbits that run in step; results do not depend on it.
    fn lanes(&self) -> usize {
        1
    }

    /// Attractors of the map from `starts`, at most as many as the map has lanes; `watch` is told
    /// of every step in which an orbit is simulated.
    fn settle(&self, starts: &[Start], request: &OrbitRequest, _watch: &dyn Fn()) -> Vec<Settled> {
        let single = |start: &Start| settle_single(self, start, request);
        starts.iter().map(single).collect()
    }

    /// The map at fixed parameters, without parameters of its own, prepared once per parameter
    /// value.
    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_>;

    /// Runs `work` with a function that iterates states side by side at fixed parameters, at most
    /// as many as the map has lanes; it is prepared once.
    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        let fixed = self.at(parameters);
        work(&mut |states, request| {
            let orbit = |state: &&[f64]| MapOrbit::of(&*fixed, state, &[], request);
            states.iter().map(orbit).collect()
        });
    }

    /// Start state of a sweep, also after an escape.
    fn start(&self, parameters: &[f64]) -> Vec<f64>;

    /// Observable at every kept state of an orbit.
    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64>;

    /// Grazing surfaces and the passages of one return.
    fn itinerary(&self) -> &Itinerary;

    /// Contacts per surface of the itinerary between a kept state of an orbit (not the last) and
    /// the next.
    fn hits(&self, orbit: &MapOrbit, number: usize, _parameters: &[f64]) -> Vec<u32> {
        self.itinerary().hits(orbit.steps[number + 1].passages)
    }

    /// Whether the map's Jacobian is cheap and exact, so that Lyapunov exponents are computed.
    fn has_jacobian(&self) -> bool {
        true
    }
}

/// Function that returns the orbits of states.
pub type SideBySide<'a> = dyn FnMut(&[&[f64]], &OrbitRequest) -> Vec<MapOrbit> + 'a;

/// Orbits of states in `N` lanes that must all be used: unused ones start at the section's origin.
fn padded<const N: usize>(
    states: &[&[f64]],
    orbits: impl FnOnce(&[&[f64]]) -> Vec<MapOrbit>,
) -> Vec<MapOrbit> {
    let origin = vec![0.0; states.first().map_or(0, |state| state.len())];
    let mut all = states.to_vec();
    all.resize(N, &origin);
    let mut found = orbits(&all);
    found.truncate(states.len());
    found
}

/// Start of an orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Start state.
    pub state: Vec<f64>,
    /// All parameters of the map.
    pub parameters: Vec<f64>,
}

/// Parameters and states of starts.
fn parts(starts: &[Start]) -> (Vec<&[f64]>, Vec<&[f64]>) {
    starts.iter().map(|start| (&start.parameters[..], &start.state[..])).unzip()
}

/// An orbit and its largest Lyapunov exponent: from the multipliers of a periodic orbit, otherwise
/// the mean over as many further iterates as were kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The orbit.
    pub orbit: MapOrbit,
    /// Exponent; `None` without a Jacobian or after an early end.
    pub lyapunov: Option<LyapunovExponent>,
}

fn settle_single<M: SweptMap + ?Sized>(map: &M, start: &Start, request: &OrbitRequest) -> Settled {
    let fixed = map.at(&start.parameters);
    let orbit = MapOrbit::of(&*fixed, &start.state, &[], request);
    let complete = map.has_jacobian() && orbit.end == OrbitEnd::Completed;
    let exponent = || exponent(&*fixed, &orbit, request);
    Settled { lyapunov: complete.then(exponent).flatten(), orbit }
}

/// Largest Lyapunov exponent of an orbit of a map at fixed parameters: from the multipliers of a
/// periodic orbit, otherwise over as many further iterates as were kept.
pub(in crate::analysis) fn exponent(
    fixed: &dyn DiscreteMap,
    orbit: &MapOrbit,
    request: &OrbitRequest,
) -> Option<LyapunovExponent> {
    match orbit.period {
        Period::Periodic(_) => periodic_lyapunov_exponent(fixed, orbit, &[]),
        Period::NotFound => {
            largest_lyapunov_exponent(fixed, &orbit.last, &[], TANGENT_TRANSIENT, request.keep)
        }
    }
}

/// Whether an orbit was completed without a period.
fn wanders(orbit: &MapOrbit) -> bool {
    orbit.end == OrbitEnd::Completed && orbit.period == Period::NotFound
}

/// Adds exponents to completed orbits: from the multipliers of a periodic one, otherwise from
/// `means`, which computes those of all orbits and is called only if needed.
fn settled(
    map: &(impl SweptMap + ?Sized),
    orbits: Vec<MapOrbit>,
    starts: &[Start],
    means: impl FnOnce(&[MapOrbit]) -> Vec<Option<LyapunovExponent>>,
) -> Vec<Settled> {
    let means = if orbits.iter().any(wanders) { means(&orbits) } else { Vec::new() };
    let settled = orbits.into_iter().zip(starts).enumerate().map(|(place, (orbit, start))| {
        let mean = || means.get(place).copied().flatten();
        let lyapunov = if wanders(&orbit) { mean() } else { by_multipliers(map, &orbit, start) };
        Settled { lyapunov, orbit }
    });
    settled.collect()
}

/// Exponent of a periodic orbit from its multipliers; `None` if direct simulation made an iterate.
pub(super) fn by_multipliers(
    map: &(impl SweptMap + ?Sized),
    orbit: &MapOrbit,
    start: &Start,
) -> Option<LyapunovExponent> {
    let mapped = orbit.steps.iter().all(|step| !step.simulated);
    let periodic = mapped && orbit.period != Period::NotFound;
    periodic.then(|| periodic_lyapunov_exponent(&*map.at(&start.parameters), orbit, &[])).flatten()
}

/// A map with fixed parameters, passed to it at every step.
struct Fixed<M> {
    map: M,
    parameters: Vec<f64>,
}

impl<M: DiscreteMap> DiscreteMap for Fixed<M> {
    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        0
    }

    fn circle(&self) -> PhaseCircle {
        self.map.circle()
    }

    fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
        self.map.step(state, &self.parameters, image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        _: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        self.map.step_jacobian(state, &self.parameters, image, jacobian)
    }
}

fn fixed<'m, M: DiscreteMap + Send + 'm>(
    map: M,
    parameters: &[f64],
) -> Box<dyn DiscreteMap + Send + 'm> {
    Box::new(Fixed { map, parameters: parameters.to_vec() })
}

/// A map written by hand: starts at 0; its first coordinate is drawn.
#[derive(Clone, Debug)]
pub struct UnobservedSweep<M> {
    /// The map.
    pub map: M,
    /// Surface that each of its passages meets.
    pub itinerary: Itinerary,
}

impl<M: DiscreteMap> SweptMap for UnobservedSweep<M> {
    fn method(&self) -> Method {
        Method::Map
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn segments(&self) -> usize {
        MAP_SEGMENTS
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        fixed(&self.map, parameters)
    }

    fn start(&self, _: &[f64]) -> Vec<f64> {
        vec![0.0; self.map.dimension()]
    }

    fn observe_all(&self, orbit: &MapOrbit, _: &[f64]) -> Vec<f64> {
        orbit.states().map(|state| state[0]).collect()
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }
}

/// The local map, frozen at each parameter value.
#[derive(Debug)]
pub struct FrozenSweep {
    /// The map.
    pub map: HornerMap,
    /// Start states.
    pub start: SmoothFixedPoint,
    /// Observable that is drawn.
    pub observer: Observer,
    /// Surface that each passage meets.
    pub itinerary: Itinerary,
}

impl SweptMap for FrozenSweep {
    fn method(&self) -> Method {
        Method::Map
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn segments(&self) -> usize {
        MAP_SEGMENTS
    }

    fn lanes(&self) -> usize {
        LANES
    }

    fn settle(&self, starts: &[Start], request: &OrbitRequest, _: &dyn Fn()) -> Vec<Settled> {
        // Far from its window a polynomial is meaningless, whatever it settles on.
        let request = &request.near_the_window();
        if starts.len() < FEWEST_MAP_LANES {
            let single = |start: &Start| settle_single(self, start, request);
            return starts.iter().map(single).collect();
        }
        let (parameters, states) = parts(starts);
        let mut map = self.map.freeze_lanes::<LANES>(&parameters);
        let orbits = map.orbits(&states, request);
        settled(self, orbits, starts, |orbits| {
            let last: Vec<&[f64]> = orbits.iter().map(|orbit| &orbit.last[..]).collect();
            map.largest_lyapunov_exponents(&last, TANGENT_TRANSIENT, request.keep)
        })
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        Box::new(self.map.freeze(parameters))
    }

    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        let mut map = self.map.freeze_lanes::<LANES>(&[parameters; LANES]);
        work(&mut |states, request| padded::<LANES>(states, |states| map.orbits(states, request)));
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.start.at(parameters)
    }

    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64> {
        if self.observer.is_depth_of_map() {
            let depths = self.map.first_depths(orbit.states(), parameters);
            return depths.into_iter().map(|depth| -depth).collect();
        }
        orbit.states().map(|state| self.observer.by_map(state, parameters)).collect()
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }
}

/// Sweep by direct simulation.
#[derive(Debug)]
pub struct DirectSweep<'a> {
    /// The map.
    pub map: DirectMap<'a>,
    /// Start states.
    pub start: SmoothFixedPoint,
    /// Observable that is drawn.
    pub observer: Observer,
    /// Surface that each passage meets.
    pub itinerary: Itinerary,
}

impl SweptMap for DirectSweep<'_> {
    fn method(&self) -> Method {
        Method::Direct
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn segments(&self) -> usize {
        DIRECT_SEGMENTS
    }

    fn lanes(&self) -> usize {
        DIRECT_LANES
    }

    fn settle(&self, starts: &[Start], request: &OrbitRequest, watch: &dyn Fn()) -> Vec<Settled> {
        let (parameters, states) = parts(starts);
        let mut points = DirectPoints::new(&self.map, &parameters);
        let orbits = MapOrbit::in_step(&states, request, points.returns(watch));
        orbits.into_iter().map(|orbit| Settled { orbit, lyapunov: None }).collect()
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        // Each gets a simulator of its own, so that parallel sweeps do not wait for each other.
        fixed(self.map.clone(), parameters)
    }

    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        let mut points = DirectPoints::new(&self.map, &[parameters; DIRECT_LANES]);
        work(&mut |states, request| {
            padded::<DIRECT_LANES>(states, |states| {
                MapOrbit::in_step(states, request, points.returns(&|| ()))
            })
        });
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.start.at(parameters)
    }

    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64> {
        let observe = |state| self.observer.by_simulation(&self.map, state, parameters);
        orbit.states().map(observe).collect()
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    fn hits(&self, orbit: &MapOrbit, number: usize, parameters: &[f64]) -> Vec<u32> {
        let state = orbit.states().nth(number);
        state.map_or_else(Vec::new, |state| self.map.hits(state, parameters))
    }

    fn has_jacobian(&self) -> bool {
        false
    }
}

/// The local map, frozen at each parameter value, in its window, and direct simulation outside.
///
/// Lyapunov exponents exist for orbits that stay inside the window after the kept iterates.
#[derive(Debug)]
pub struct GuardedSweep<'a> {
    /// The map with its observer.
    pub map: FrozenSweep,
    /// Window in which the map is trusted.
    pub window: MapWindow,
    /// Direct simulation outside the window.
    pub direct: DirectMap<'a>,
}

impl GuardedSweep<'_> {
    /// Whether the map makes the step from a state; `drawn` is its observable there.
    fn is_mapped(&self, state: &[f64], parameters: &[f64], drawn: f64) -> bool {
        let FrozenSweep { map, observer, itinerary, .. } = &self.map;
        let depth = if observer.is_depth_of_map() && itinerary.passages.len() == 1 {
            (-drawn).max(0.0)
        } else {
            map.step(state, parameters, &mut vec![0.0; state.len()]).depth
        };
        self.window.holds(state, parameters, &[depth])
    }
}

impl SweptMap for GuardedSweep<'_> {
    fn method(&self) -> Method {
        Method::Guarded
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn segments(&self) -> usize {
        self.map.segments()
    }

    fn lanes(&self) -> usize {
        self.map.lanes()
    }

    fn settle(&self, starts: &[Start], request: &OrbitRequest, watch: &dyn Fn()) -> Vec<Settled> {
        let (parameters, states) = parts(starts);
        let mut map = self.map.map.freeze_lanes::<LANES>(&parameters);
        let mut points = DirectPoints::new(&self.direct, &parameters);
        let returns = &mut points.returns(watch);
        let orbits = map.guarded_orbits(&states, request, &self.window, returns);
        settled(self, orbits, starts, |orbits| {
            let last: Vec<&[f64]> = orbits.iter().map(|orbit| &orbit.last[..]).collect();
            map.guarded_lyapunov_exponents(&last, TANGENT_TRANSIENT, request.keep, &self.window)
        })
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        let map = self.map.map.freeze(parameters);
        Box::new(GuardedMap::frozen(map, parameters, &self.window, &self.direct))
    }

    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        let mut map = self.map.map.freeze_lanes::<LANES>(&[parameters; LANES]);
        let mut points = DirectPoints::new(&self.direct, &[parameters; LANES]);
        work(&mut |states, request| {
            padded::<LANES>(states, |states| {
                map.guarded_orbits(states, request, &self.window, &mut points.returns(&|| ()))
            })
        });
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.map.start(parameters)
    }

    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64> {
        let mut values = self.map.observe_all(orbit, parameters);
        for (number, (value, state)) in values.iter_mut().zip(orbit.states()).enumerate() {
            let mapped = match orbit.steps.get(number + 1) {
                Some(next) => !next.simulated,
                None => self.is_mapped(state, parameters, *value),
            };
            if !mapped {
                *value = self.map.observer.by_simulation(&self.direct, state, parameters);
            }
        }
        values
    }

    fn itinerary(&self) -> &Itinerary {
        self.map.itinerary()
    }

    fn hits(&self, orbit: &MapOrbit, number: usize, parameters: &[f64]) -> Vec<u32> {
        if !orbit.steps[number + 1].simulated {
            return self.map.hits(orbit, number, parameters);
        }
        let state = orbit.states().nth(number);
        state.map_or_else(Vec::new, |state| self.direct.hits(state, parameters))
    }
}

/// Sweep by an atlas of direct returns.
///
/// Observables and hits are those of direct simulation.
struct AtlasSweep<'a> {
    direct: DirectSweep<'a>,
    /// Atlas; `None` if direct simulation is as fast.
    atlas: Option<Atlas<SectionTable<'a>>>,
    /// Maps at the last parameters, with the leaves that they know.
    kept: Mutex<Vec<AtlasMap<'a>>>,
}

impl SweptMap for AtlasSweep<'_> {
    fn method(&self) -> Method {
        Method::Atlas
    }

    fn parameters(&self) -> usize {
        self.direct.parameters()
    }

    fn segments(&self) -> usize {
        self.direct.segments()
    }

    fn lanes(&self) -> usize {
        if self.atlas.is_none() { self.direct.lanes() } else { LANES }
    }

    fn settle(&self, starts: &[Start], request: &OrbitRequest, watch: &dyn Fn()) -> Vec<Settled> {
        match self.atlas {
            None => self.direct.settle(starts, request, watch),
            Some(_) => starts.iter().map(|start| settle_single(self, start, request)).collect(),
        }
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        match &self.atlas {
            None => self.direct.at(parameters),
            Some(atlas) => Box::new(AtlasMap::new(atlas, parameters)),
        }
    }

    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        let Some(atlas) = &self.atlas else {
            return self.direct.side_by_side(parameters, work);
        };
        let kept = locked(&self.kept).pop().filter(|map| map.is_at(parameters));
        let map = kept.unwrap_or_else(|| AtlasMap::new(atlas, parameters));
        work(&mut |states, request| {
            let orbit = |state: &&[f64]| MapOrbit::of(&map, state, &[], request);
            states.iter().map(orbit).collect()
        });
        locked(&self.kept).push(map);
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.direct.start(parameters)
    }

    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64> {
        self.direct.observe_all(orbit, parameters)
    }

    fn itinerary(&self) -> &Itinerary {
        self.direct.itinerary()
    }

    fn hits(&self, orbit: &MapOrbit, number: usize, parameters: &[f64]) -> Vec<u32> {
        self.direct.hits(orbit, number, parameters)
    }

    fn has_jacobian(&self) -> bool {
        false
    }
}

/// Scene, orbit and map that the sweeps of a scene share.
pub(in crate::analysis) struct SweepSubject<'a> {
    pub(in crate::analysis) scene: &'a Scene,
    pub(in crate::analysis) orbit: &'a GrazingOrbit,
    pub(in crate::analysis) map: &'a LocalMap,
    pub(in crate::analysis) observe: &'a Observable,
    /// Use for which an atlas is made.
    pub(in crate::analysis) tabulated: TabulatedUse,
    /// The scene's model, lowered when direct simulation is first needed.
    pub(in crate::analysis) system: OnceCell<HybridSystem>,
}

impl<'a> SweepSubject<'a> {
    /// Sweeps of a scene about its grazing orbit; the event function is observed.
    pub(in crate::analysis) fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &'a LocalMap,
    ) -> Self {
        Self {
            scene,
            orbit,
            map,
            observe: &Observable::EventFunction,
            tabulated: TabulatedUse::default(),
            system: OnceCell::new(),
        }
    }

    /// Request for orbits, with the escape bounds of the oscillator.
    pub(in crate::analysis) fn orbits(&self, transient: usize, keep: usize) -> OrbitRequest {
        let escape = escape_bounds(self.scene, self.orbit);
        let bounds: Vec<f64> = escape.iter().map(|bound| bound.offset).collect();
        let scales = resolved_widths(self.scene, self.orbit, self.map);
        let request = OrbitRequest::new(transient, keep, &scales);
        request.escaping_at(&bounds).on_circle(phase_circle(self.scene, self.orbit))
    }

    /// Map of a method.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Hybrid`] if the simulator refuses the model; [`AnalysisError::Expansion`]
    /// if the impact speed is observed and cannot be expanded; [`AnalysisError::NoContacts`] if the
    /// method needs contacts that are not expanded; [`AnalysisError::TooManyAxes`].
    pub(in crate::analysis) fn swept(
        &self,
        method: Method,
    ) -> Result<Box<dyn SweptMap + '_>, AnalysisError> {
        let (scene, orbit, map) = (self.scene, self.orbit, self.map);
        if !method.is_direct() {
            check_contacts(map)?;
        }
        let start = || SmoothFixedPoint::new(map);
        let observer = || Observer::new(scene, orbit, map, self.observe);
        let frozen = || {
            let others = || (start(), observer());
            let (map, (start, observer)) = parallel::join(|| HornerMap::new(map), others);
            let itinerary = itinerary(scene, orbit);
            Ok::<_, AnalysisError>(FrozenSweep { map, start, observer: observer?, itinerary })
        };
        let direct = || {
            let system = self.system.get_or_init(|| HybridSystem::new(&scene.model));
            DirectMap::new(system, scene, orbit)
        };
        let simulated = || {
            Ok::<_, AnalysisError>(DirectSweep {
                map: direct()?,
                start: start(),
                observer: observer()?,
                itinerary: itinerary(scene, orbit),
            })
        };
        Ok(match method {
            Method::Map => Box::new(frozen()?),
            Method::Guarded => Box::new(GuardedSweep {
                map: frozen()?,
                window: map.window.clone(),
                direct: direct()?,
            }),
            Method::Direct => Box::new(simulated()?),
            Method::Atlas => {
                let direct = simulated()?;
                let (map, planned) = (direct.map.clone(), self.tabulated.clone());
                let start = |parameters: &[f64]| direct.start.at(parameters);
                let atlas = SectionTable::atlas(map, planned, &self.orbits(0, 0), start)?;
                Box::new(AtlasSweep { direct, atlas, kept: Mutex::default() })
            }
        })
    }
}

/// Most Newton steps.
const NEWTON_STEPS: usize = 30;

/// Fixed point of `P_smooth` as a function of the parameters.
#[derive(Clone, Debug)]
pub struct SmoothFixedPoint {
    smooth: InterpretedMap,
}

impl SmoothFixedPoint {
    /// Fixed points of the legs of a map.
    pub fn new(map: &LocalMap) -> Self {
        let mut legs = map.clone();
        legs.stages.retain(|stage| matches!(stage, Stage::Leg(_)));
        Self { smooth: InterpretedMap::new(&legs) }
    }

    /// Fixed point near the section's origin, by Newton's method from there; the origin itself if
    /// that does not converge.
    pub fn at(&self, parameters: &[f64]) -> Vec<f64> {
        let dimension = self.smooth.dimension();
        let mut point = DVector::zeros(dimension);
        for _ in 0..NEWTON_STEPS {
            let Some(step) = self.newton_step(&point, parameters) else {
                return vec![0.0; dimension];
            };
            let size = step.amax();
            point -= step;
            // The error after a step this small is its square.
            if size <= 1e-9 * point.amax() || size == 0.0 {
                return point.as_slice().to_vec();
            }
        }
        vec![0.0; dimension]
    }

    /// `(∂P/∂x − 1)⁻¹ (P(x) − x)`.
    fn newton_step(&self, point: &DVector<f64>, parameters: &[f64]) -> Option<DVector<f64>> {
        let dimension = point.len();
        let mut image = vec![0.0; dimension];
        let mut rows = vec![0.0; dimension * dimension];
        let info = self.smooth.step_jacobian(point.as_slice(), parameters, &mut image, &mut rows);
        if !info.valid {
            return None;
        }
        let jacobian = DMatrix::from_row_slice(dimension, dimension, &rows);
        let defect = DVector::from_vec(image) - point;
        let step = (jacobian - DMatrix::identity(dimension, dimension)).lu().solve(&defect)?;
        step.iter().all(|value| value.is_finite()).then_some(step)
    }
}
