//! Direct simulation under the contract of every map, for one orbit and for several in lanes, each
//! at its own parameters.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::direct_image::{DirectEnd, DirectImage, SectionImage};
use super::error::AnalysisError;
use super::periodic::{derivatives, finite_or_one};
use super::section_frame::SectionFrame;
use crate::hybrid::{DirectReturn, HybridSystem, LaneReturns};
use crate::iteration::{
    DifferentiableMap, DiscreteMap, MapOrbit, OrbitRequest, PassageSet, StepInfo,
};
use crate::model::Scene;
use crate::numeric::Lanes;
use crate::orbit::GrazingOrbit;

/// A step by direct simulation, before anything is known of it.
const SIMULATED: StepInfo =
    StepInfo { passages: PassageSet::NONE, depth: 0.0, valid: false, simulated: true };

/// The section map by direct simulation in double precision, as a [`DiscreteMap`] in offsets.
///
/// [`StepInfo::passages`] numbers the passages in the order in which they follow the section;
/// [`StepInfo::depth`] is the largest `v²/(2 h'')` of their impact speeds `v`, which is `y²` to
/// leading order.
///
/// Jacobians are central differences of fourth order whose steps shrink with the depth
/// ([`linearise`](super::periodic::linearise)): good to about `1e-12` of an entry away from `y =
/// 0`, where the map has no derivative, and to the digits that double precision leaves the kick
/// near it.
#[derive(Debug)]
pub struct DirectMap<'a> {
    image: Mutex<DirectImage<'a, f64>>,
    dimension: usize,
    parameters: usize,
    normal_accelerations: Vec<f64>,
    grazing_surfaces: BTreeSet<usize>,
    scales: Vec<f64>,
    fits_lanes: bool,
}

impl<'a> DirectMap<'a> {
    /// The map of a scene about its grazing orbit; `system` is the scene's model, lowered.
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
            fits_lanes: image.fits_lanes(),
            image: Mutex::new(image),
        })
    }

    /// The map at other parameters in every lane, on any section; `None` unless the system has one
    /// rigid surface, and on machines without wide registers
    /// ([`is_wide`](crate::numeric::is_wide)).
    ///
    /// # Panics
    ///
    /// If there are no parameters, or more than lanes.
    pub fn in_lanes<const N: usize>(&self, parameters: &[&[f64]]) -> Option<DirectLanes<'a, N>> {
        if !self.fits_lanes {
            return None;
        }
        let image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        DirectLanes::new(&image, &self.normal_accelerations, parameters)
    }

    /// Speed of the first contact that follows a section point; 0 without one, NaN without an
    /// image.
    pub fn impact_speed(&self, state: &[f64], parameters: &[f64]) -> f64 {
        self.simulate(state, parameters).map_or(f64::NAN, |image| image.impact_speed)
    }

    /// All contacts at each surface that grazes, in the model's order, on the way from a section
    /// point to its image.
    pub fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32> {
        let image = self.simulate(state, parameters);
        let hits = |&surface: &usize| {
            let image = image.as_ref();
            image.map_or(0, |image| image.hits[surface] as u32)
        };
        self.grazing_surfaces.iter().map(hits).collect()
    }

    /// Derivatives by the first of the coordinates and parameters, row by row; NaN where there are
    /// none.
    fn differences(&self, state: &[f64], parameters: &[f64], by: usize, rows: &mut [f64]) {
        rows.fill(f64::NAN);
        let mut direct = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        let found = derivatives(&mut *direct, state, parameters, &self.scales[..by]);
        let Some((_, found)) = found else { return };
        for (place, entry) in rows.iter_mut().enumerate() {
            *entry = found[(place / by, place % by)];
        }
    }

    /// The image with all that is known of it; `None` where the input is not finite.
    pub fn simulate(&self, state: &[f64], parameters: &[f64]) -> Option<SectionImage<f64>> {
        // A panic while the lock was held leaves nothing half-done: every image starts afresh.
        let mut image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        image.image(state, parameters).ok()
    }
}

impl Clone for DirectMap<'_> {
    fn clone(&self) -> Self {
        let image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        Self {
            image: Mutex::new(image.clone()),
            dimension: self.dimension,
            parameters: self.parameters,
            normal_accelerations: self.normal_accelerations.clone(),
            grazing_surfaces: self.grazing_surfaces.clone(),
            scales: self.scales.clone(),
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

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let simulated = self
            .simulate(state, parameters)
            .filter(|simulated| simulated.end == DirectEnd::Returned);
        let Some(simulated) = simulated else {
            image.fill(f64::NAN);
            return SIMULATED;
        };
        image.copy_from_slice(&simulated.offsets);
        let mut info = SIMULATED;
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
        self.differences(state, parameters, self.dimension, jacobian);
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
        self.differences(state, parameters, self.scales.len(), derivatives);
        self.step(state, parameters, image)
    }
}

/// Half-widths of the window, one per coordinate and then one per active parameter; 1 where it is
/// unbounded.
fn scales(scene: &Scene, orbit: &GrazingOrbit) -> Vec<f64> {
    let coordinates = orbit.section.coordinates.iter();
    let widths = coordinates.map(|&component| scene.window.state[component]);
    let active = scene.expansion.active.iter();
    let widths = widths.chain(active.map(|&parameter| scene.window.parameter[parameter]));
    widths.map(finite_or_one).collect()
}

/// The section map by direct simulation with other parameters in every lane, made by
/// [`DirectMap::in_lanes`](super::DirectMap::in_lanes).
///
/// Every image is that of [`DirectMap`](super::DirectMap) to the last bit.
#[derive(Clone, Debug)]
pub struct DirectLanes<'a, const N: usize> {
    frames: Vec<SectionFrame<f64>>,
    parameters: Vec<Vec<f64>>,
    returns: LaneReturns<'a, N>,
    /// Of every passage.
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
            parameters: parameters.iter().map(|own| own.to_vec()).collect(),
            returns: LaneReturns::new(alone)?,
            normal_accelerations: normal_accelerations.to_vec(),
            starts: vec![Lanes::splat(0.0); dimension],
        })
    }

    /// Iterates a state in every lane, as [`MapOrbit::of`] does one.
    ///
    /// # Panics
    ///
    /// If there is not one state of the map's length for every lane.
    pub fn orbits(&mut self, initial: &[&[f64]], request: &OrbitRequest) -> Vec<MapOrbit> {
        assert_eq!(initial.len(), self.frames.len(), "one state for every lane");
        MapOrbit::in_step(initial, request, |going, states, images, infos| {
            self.step(going, states, images, infos);
        })
    }

    /// One step of the lanes that go on, their states one after another.
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
