//! Direct simulation as a [`DiscreteMap`], for one orbit and for several in lanes, each at its own
//! parameters; and the local map guarded by direct simulation outside its window.
//!
//! One idea: a map is trusted only in the window where it was measured. The window is checked at
//! every step: a point whose state, parameters and depths lie inside is mapped; any other is
//! simulated to the same section, so that an orbit may leave the window and return to it.

use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock};

use super::direct_image::{DirectEnd, DirectImage, SectionImage};
use super::error::AnalysisError;
use super::periodic::{derivatives, finite_or_one};
use super::section_frame::SectionFrame;
use crate::expansion::MapWindow;
use crate::hybrid::{DirectReturn, HybridSystem, LaneReturns};
use crate::iteration::parallel::locked;
use crate::iteration::{
    DifferentiableMap, DiscreteMap, MapOrbit, OrbitRequest, PassageSet, PhaseCircle, StepInfo,
};
use crate::model::Scene;
use crate::numeric::Lanes;
use crate::orbit::GrazingOrbit;

/// A direct step without image, contacts or turns yet.
const SIMULATED: StepInfo =
    StepInfo { passages: PassageSet::NONE, depth: 0.0, valid: false, simulated: true, turns: 0 };

/// The section map by direct simulation in double precision, as a [`DiscreteMap`] in offsets.
///
/// [`StepInfo::passages`] numbers the passages in the order in which they follow the section;
/// [`StepInfo::depth`] is the largest `v²/(2 h'')` of their impact speeds `v`, which is `y²` to
/// leading order.
///
/// Jacobians are first variations of the return. They are as accurate as the return away from `y =
/// 0`, where the map has no derivative. For a return that rests on a rigid surface they are
/// differences ([`linearise`](super::periodic::linearise)).
#[derive(Debug)]
pub struct DirectMap<'a> {
    image: Mutex<DirectImage<'a, f64>>,
    dimension: usize,
    parameters: usize,
    normal_accelerations: Vec<f64>,
    grazing_surfaces: BTreeSet<usize>,
    scales: Vec<f64>,
    circle: PhaseCircle,
    fits_lanes: bool,
}

impl<'a> DirectMap<'a> {
    /// Map of a scene about its grazing orbit; `system` is the scene's model, lowered.
    ///
    /// # Errors
    ///
    /// As [`DirectImage::new`].
    pub fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, AnalysisError> {
        let image = DirectImage::new(system, scene, orbit)?;
        let accelerations = image.passage_places().into_iter();
        Ok(Self {
            dimension: image.dimension(),
            parameters: image.parameters(),
            normal_accelerations: accelerations
                .map(|place| orbit.passages[place].normal_acceleration.to_f64())
                .collect(),
            grazing_surfaces: orbit.passages.iter().map(|graze| graze.surface).collect(),
            scales: scales(scene, orbit),
            circle: image.circle(),
            fits_lanes: image.fits_lanes(),
            image: Mutex::new(image),
        })
    }

    /// The map at one row of parameters per lane, on any section; `None` unless the system has one
    /// rigid surface, and on machines without wide registers
    /// ([`is_wide`](crate::numeric::is_wide)).
    ///
    /// # Panics
    ///
    /// If there are no parameters, or more rows than lanes.
    pub fn in_lanes<const N: usize>(&self, parameters: &[&[f64]]) -> Option<DirectLanes<'a, N>> {
        if !self.fits_lanes {
            return None;
        }
        let image = locked(&self.image);
        DirectLanes::new(&image, &self.normal_accelerations, parameters)
    }

    /// Speed of the first contact after a section point that is none of the hits of the grazing
    /// orbit; 0 without such a contact, NaN without an image.
    pub fn impact_speed(&self, state: &[f64], parameters: &[f64]) -> f64 {
        self.simulate(state, parameters).map_or(f64::NAN, |image| image.impact_speed)
    }

    /// Number of contacts at each grazing surface, in the model's order, between a section point
    /// and its image.
    pub fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32> {
        let image = self.simulate(state, parameters);
        let hits = |&surface: &usize| {
            let image = image.as_ref();
            image.map_or(0, |image| image.hits[surface] as u32)
        };
        self.grazing_surfaces.iter().map(hits).collect()
    }

    /// Derivatives by the coordinates and then by the parameters in `free`, row by row; NaN if
    /// there are none.
    fn slopes(&self, state: &[f64], parameters: &[f64], free: &[usize], rows: &mut [f64]) {
        rows.fill(f64::NAN);
        let mut direct = locked(&self.image);
        let found = derivatives(&mut *direct, state, parameters, free, &self.scales);
        let Some((_, found)) = found else { return };
        for (row, entries) in found.row_iter().zip(rows.chunks_exact_mut(found.ncols())) {
            entries.iter_mut().zip(row.iter()).for_each(|(entry, &value)| *entry = value);
        }
    }

    /// Gap at the first passage after a section point along the free flow, on a tangency section at
    /// the point itself; NaN if there is none.
    pub(super) fn gap(&self, state: &[f64], parameters: &[f64]) -> f64 {
        locked(&self.image).gap(state, parameters).unwrap_or(f64::NAN)
    }

    /// Whether the section is one of tangency.
    pub(super) fn is_on_tangency(&self) -> bool {
        locked(&self.image).is_on_tangency()
    }

    /// Image with all its data; `None` if the input is not finite.
    pub fn simulate(&self, state: &[f64], parameters: &[f64]) -> Option<SectionImage<f64>> {
        // A panic while the lock was held leaves no partial state: every image starts afresh.
        let mut image = locked(&self.image);
        image.image(state, parameters).ok()
    }
}

impl Clone for DirectMap<'_> {
    fn clone(&self) -> Self {
        let image = locked(&self.image);
        Self {
            image: Mutex::new(image.clone()),
            dimension: self.dimension,
            parameters: self.parameters,
            normal_accelerations: self.normal_accelerations.clone(),
            grazing_surfaces: self.grazing_surfaces.clone(),
            scales: self.scales.clone(),
            circle: self.circle,
            fits_lanes: self.fits_lanes,
        }
    }
}

impl DiscreteMap for DirectMap<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> usize {
        self.parameters
    }

    fn circle(&self) -> PhaseCircle {
        self.circle
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let simulated = self
            .simulate(state, parameters)
            .filter(|simulated| simulated.end == DirectEnd::Returned);
        let Some(simulated) = simulated else {
            image.fill(f64::NAN);
            return SIMULATED;
        };
        image.copy_from_slice(&simulated.offsets);
        let mut info = StepInfo { turns: simulated.turns, ..SIMULATED };
        let passages = simulated.passages.iter().zip(&self.normal_accelerations);
        for (passage, (speed, acceleration)) in passages.enumerate() {
            if let Some(speed) = speed {
                info.add_passage(passage, 0.5 * speed * speed / acceleration);
            }
        }
        info.checked(image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        self.slopes(state, parameters, &[], jacobian);
        self.step(state, parameters, image)
    }
}

impl DifferentiableMap for DirectMap<'_> {
    fn step_derivatives(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        derivatives: &mut [f64],
    ) -> StepInfo {
        let free: Vec<usize> = (0..self.parameters).collect();
        self.slopes(state, parameters, &free, derivatives);
        self.step(state, parameters, image)
    }
}

/// Half-widths of the window, one per coordinate and then one per active parameter; 1 if unbounded.
fn scales(scene: &Scene, orbit: &GrazingOrbit) -> Vec<f64> {
    let coordinates = orbit.section.coordinates.iter();
    let widths = coordinates.map(|&component| scene.window.state[component]);
    let active = scene.expansion.active.iter();
    let widths = widths.chain(active.map(|&parameter| scene.window.parameter[parameter]));
    widths.map(finite_or_one).collect()
}

/// Section map by direct simulation with its own parameters in each lane, made by
/// [`DirectMap::in_lanes`](super::DirectMap::in_lanes).
///
/// Every image equals that of [`DirectMap`](super::DirectMap) to the last bit.
#[derive(Clone, Debug)]
pub struct DirectLanes<'a, const N: usize> {
    frames: Vec<SectionFrame<f64>>,
    circle: PhaseCircle,
    parameters: Vec<Vec<f64>>,
    returns: LaneReturns<'a, N>,
    /// Normal acceleration at the graze, one per passage.
    normal_accelerations: Vec<f64>,
    starts: Vec<Lanes<N>>,
}

impl<'a, const N: usize> DirectLanes<'a, N> {
    pub(super) fn new(
        image: &DirectImage<'a, f64>,
        normal_accelerations: &[f64],
        parameters: &[&[f64]],
    ) -> Option<Self> {
        let mut frames = Vec::with_capacity(parameters.len());
        let mut alone: Vec<DirectReturn<'a, f64>> = Vec::with_capacity(parameters.len());
        for own in parameters {
            let (frame, returns) = image.at(own).ok()?;
            frames.push(frame);
            alone.push(returns);
        }
        let dimension = frames.first()?.state().len();
        Some(Self {
            frames,
            circle: image.circle(),
            parameters: parameters.iter().map(|own| own.to_vec()).collect(),
            returns: LaneReturns::new(alone)?,
            normal_accelerations: normal_accelerations.to_vec(),
            starts: vec![Lanes::splat(0.0); dimension],
        })
    }

    /// Iterates one state per lane, as [`MapOrbit::of`] does for one state.
    ///
    /// # Panics
    ///
    /// If the number of states is not the number of lanes, or a state has the wrong length.
    pub fn orbits(&mut self, initial: &[&[f64]], request: &OrbitRequest) -> Vec<MapOrbit> {
        assert_eq!(initial.len(), self.frames.len(), "one state for every lane");
        MapOrbit::in_step(initial, request, |going, states, images, infos| {
            self.step(going, states, images, infos);
        })
    }

    /// Makes one step of the lanes in `going`; states are stored one after another.
    pub fn step(
        &mut self,
        going: &[bool],
        states: &[f64],
        images: &mut [f64],
        infos: &mut [StepInfo],
    ) {
        let dimension = states.len() / self.frames.len();
        let mut wanted = [false; N];
        for (lane, state) in states.chunks_exact(dimension).enumerate() {
            let frame = &mut self.frames[lane];
            wanted[lane] = going[lane] && frame.place(state, &self.parameters[lane]).is_ok();
            for (start, &value) in self.starts.iter_mut().zip(frame.state()) {
                start[lane] = value;
            }
        }
        let returned = self.returns.images(&self.starts, wanted);
        for (lane, image) in images.chunks_exact_mut(dimension).enumerate() {
            infos[lane] = SIMULATED;
            if !wanted[lane] || !returned.returned[lane] {
                image.fill(f64::NAN);
                continue;
            }
            let offsets =
                self.frames[lane].offset_values(|component| returned.state[component][lane]);
            for (image, offset) in image.iter_mut().zip(offsets) {
                *image = offset;
            }
            infos[lane].turns = self.circle.reduce(image);
            let passages = returned.speeds.iter().zip(&self.normal_accelerations);
            for (passage, (speeds, acceleration)) in passages.enumerate() {
                if let Some(speed) = speeds[lane] {
                    infos[lane].add_passage(passage, 0.5 * speed * speed / acceleration);
                }
            }
            infos[lane] = infos[lane].checked(image);
        }
    }
}

/// A local map, guarded by direct simulation of the same section.
///
/// [`StepInfo::simulated`] tells whether direct simulation made a step. Inside the window a step
/// equals the map's to the last bit, outside that of [`DirectMap`].
///
/// Jacobians are the map's inside and those of [`DirectMap`] outside.
#[derive(Clone, Debug)]
pub struct GuardedMap<'d, 'a, M> {
    map: M,
    /// Parameters folded into the map; empty if the map takes parameters at every step.
    folded: Vec<f64>,
    window: &'d MapWindow,
    /// Simulator that `direct` is cloned from.
    source: &'d DirectMap<'a>,
    /// Simulator of this map alone, cloned at its first step outside the window.
    direct: OnceLock<DirectMap<'a>>,
}

impl<'d, 'a, M: DiscreteMap> GuardedMap<'d, 'a, M> {
    /// A map that takes its parameters at every step, trusted inside a window.
    pub fn new(map: M, window: &'d MapWindow, direct: &'d DirectMap<'a>) -> Self {
        Self::frozen(map, &[], window, direct)
    }

    /// A map with folded-in parameters.
    pub fn frozen(
        map: M,
        parameters: &[f64],
        window: &'d MapWindow,
        direct: &'d DirectMap<'a>,
    ) -> Self {
        let folded = parameters.to_vec();
        Self { map, folded, window, source: direct, direct: OnceLock::new() }
    }

    /// Parameters for direct simulation in a step that is given `parameters`.
    fn all<'p>(&'p self, parameters: &'p [f64]) -> &'p [f64] {
        if self.map.parameters() == self.source.parameters() { parameters } else { &self.folded }
    }

    fn direct(&self) -> &DirectMap<'a> {
        self.direct.get_or_init(|| self.source.clone())
    }

    /// Whether a step of the map started inside the window.
    fn holds(&self, state: &[f64], parameters: &[f64], step: StepInfo) -> bool {
        self.window.holds(state, self.all(parameters), &[step.depth])
    }
}

impl<M: DiscreteMap> DiscreteMap for GuardedMap<'_, '_, M> {
    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn circle(&self) -> PhaseCircle {
        self.source.circle
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let step = self.map.step(state, parameters, image);
        if self.holds(state, parameters, step) {
            return step;
        }
        self.direct().step(state, self.all(parameters), image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let step = self.map.step(state, parameters, image);
        if self.holds(state, parameters, step) {
            return self.map.step_jacobian(state, parameters, image, jacobian);
        }
        self.direct().step_jacobian(state, self.all(parameters), image, jacobian)
    }
}

impl<M: DifferentiableMap> DifferentiableMap for GuardedMap<'_, '_, M> {
    fn step_derivatives(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        derivatives: &mut [f64],
    ) -> StepInfo {
        let step = self.map.step_derivatives(state, parameters, image, derivatives);
        if self.holds(state, parameters, step) {
            return step;
        }
        self.direct().step_derivatives(state, self.all(parameters), image, derivatives)
    }
}

/// Runs `work` with a map that is guarded by direct simulation of its scene.
///
/// # Errors
///
/// As [`DirectMap::new`].
pub fn guarded<M: DiscreteMap, R>(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: M,
    window: &MapWindow,
    work: impl FnOnce(&GuardedMap<'_, '_, M>) -> R,
) -> Result<R, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    Ok(work(&GuardedMap::new(map, window, &direct)))
}

/// Lanes of direct simulation.
pub(super) const DIRECT_LANES: usize = 8;

/// Fewest orbits for which lanes are used: all lanes together take as long as two single orbits.
const FEWEST_LANES: usize = 3;

/// Direct returns of many points at once, each at its own parameters: in lanes if enough
/// neighbouring points are wanted, otherwise one by one. Results do not depend on the choice.
///
/// Simulators are created when first needed.
#[derive(Debug)]
pub(super) struct DirectPoints<'m, 'a> {
    map: &'m DirectMap<'a>,
    groups: Vec<Group<'m, 'a>>,
}

/// Points that share lanes, at most as many as there are lanes.
#[derive(Debug)]
struct Group<'m, 'a> {
    parameters: Vec<&'m [f64]>,
    /// Lanes, made when first needed; `Some(None)` if the system cannot be simulated in lanes.
    lanes: Option<Option<Box<DirectLanes<'a, DIRECT_LANES>>>>,
    single: Vec<Option<Box<DirectMap<'a>>>>,
}

impl<'m, 'a> DirectPoints<'m, 'a> {
    /// Points at these parameters.
    pub(super) fn new(map: &'m DirectMap<'a>, parameters: &[&'m [f64]]) -> Self {
        let group = |parameters: &[&'m [f64]]| Group {
            parameters: parameters.to_vec(),
            lanes: None,
            single: vec![None; parameters.len()],
        };
        Self { map, groups: parameters.chunks(DIRECT_LANES).map(group).collect() }
    }

    /// Step function of these points, for iterating orbits in step; `watch` is told of every step.
    pub(super) fn returns<'w>(
        &'w mut self,
        watch: &'w dyn Fn(),
    ) -> impl FnMut(&[bool], &[f64], &mut [f64], &mut [StepInfo]) + use<'w, 'm, 'a> {
        |wanted, states, images, steps| {
            self.step(wanted, states, images, steps);
            watch();
        }
    }

    /// Makes one return of the wanted points, whose states are stored one after another; the images
    /// of the others are undefined.
    fn step(
        &mut self,
        wanted: &[bool],
        states: &[f64],
        images: &mut [f64],
        steps: &mut [StepInfo],
    ) {
        let size = DIRECT_LANES * self.map.dimension();
        let parts = wanted.chunks(DIRECT_LANES).zip(states.chunks(size));
        let ends = images.chunks_mut(size).zip(steps.chunks_mut(DIRECT_LANES));
        for ((group, starts), ends) in self.groups.iter_mut().zip(parts).zip(ends) {
            group.step(self.map, starts, ends);
        }
    }
}

impl<'a> Group<'_, 'a> {
    fn step(
        &mut self,
        map: &DirectMap<'a>,
        (wanted, states): (&[bool], &[f64]),
        (images, steps): (&mut [f64], &mut [StepInfo]),
    ) {
        let count = wanted.iter().filter(|wanted| **wanted).count();
        if count >= FEWEST_LANES {
            let make = || map.in_lanes(&self.parameters).map(Box::new);
            if let Some(lanes) = self.lanes.get_or_insert_with(make) {
                return lanes.step(wanted, states, images, steps);
            }
        }
        let dimension = map.dimension();
        for point in (0..wanted.len()).filter(|&point| wanted[point]) {
            let single = self.single[point].get_or_insert_with(|| Box::new(map.clone()));
            let place = point * dimension..(point + 1) * dimension;
            let (state, image) = (&states[place.clone()], &mut images[place]);
            steps[point] = single.step(state, self.parameters[point], image);
        }
    }
}
