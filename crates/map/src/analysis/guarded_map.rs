//! The local map inside its window and direct simulation outside, under the contract of every map,
//! for one orbit and for several in lanes.
//!
//! One idea: where a map has been measured it is trusted, and nowhere else. The window is asked at
//! every step: a point whose state, parameters and depths it holds is mapped; any other is flown to
//! the same section, so that an orbit may leave the window and return to it.

use std::sync::OnceLock;

use super::direct_map::{DirectLanes, DirectMap};
use super::error::AnalysisError;
use crate::expansion::MapWindow;
use crate::hybrid::HybridSystem;
use crate::iteration::{DifferentiableMap, DiscreteMap, StepInfo};
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// A local map, guarded by direct simulation of the same section.
///
/// [`StepInfo::simulated`] says which of them made a step. The step of a point inside the window is
/// the map's to the last bit, any other that of [`DirectMap`].
///
/// Jacobians are the map's inside and the differences of [`DirectMap`] outside.
#[derive(Clone, Debug)]
pub struct GuardedMap<'d, 'a, M> {
    map: M,
    /// What was folded into the map; none where its parameters are given at every step.
    folded: Vec<f64>,
    window: &'d MapWindow,
    /// What direct simulation is cloned from.
    source: &'d DirectMap<'a>,
    /// A simulator of this map alone, made by its first step outside the window.
    direct: OnceLock<DirectMap<'a>>,
}

impl<'d, 'a, M: DiscreteMap> GuardedMap<'d, 'a, M> {
    /// A map that is given its parameters at every step, trusted inside a window.
    pub fn new(map: M, window: &'d MapWindow, direct: &'d DirectMap<'a>) -> Self {
        Self::frozen(map, &[], window, direct)
    }

    /// A map into which its parameters were folded.
    pub fn frozen(
        map: M,
        parameters: &[f64],
        window: &'d MapWindow,
        direct: &'d DirectMap<'a>,
    ) -> Self {
        let folded = parameters.to_vec();
        Self { map, folded, window, source: direct, direct: OnceLock::new() }
    }

    /// The parameters of direct simulation where the map is given these.
    fn all<'p>(&'p self, parameters: &'p [f64]) -> &'p [f64] {
        if self.map.parameters() == self.source.parameters() { parameters } else { &self.folded }
    }

    fn direct(&self) -> &DirectMap<'a> {
        self.direct.get_or_init(|| self.source.clone())
    }

    /// Whether a step that the map made began inside the window.
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

/// What some work finds with a map guarded by direct simulation of its scene.
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

/// Fewest orbits that are worth lanes of direct simulation: all lanes together take as long as two
/// single orbits.
const FEWEST_LANES: usize = 3;

/// Direct returns of many points at once, each at its own parameters: in lanes where enough of
/// neighbouring points are asked for, and one by one. No result depends on which.
///
/// What a point needs is made when it is first asked for.
#[derive(Debug)]
pub(super) struct DirectPoints<'m, 'a> {
    map: &'m DirectMap<'a>,
    groups: Vec<Group<'m, 'a>>,
}

/// As many points as there are lanes.
#[derive(Debug)]
struct Group<'m, 'a> {
    parameters: Vec<&'m [f64]>,
    /// `None` inside where the system is not flown in lanes.
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

    /// What makes returns of the points, for orbits in step and in the place of a map.
    pub(super) fn returns(
        &mut self,
    ) -> impl FnMut(&[bool], &[f64], &mut [f64], &mut [StepInfo]) + use<'_, 'm, 'a> {
        |wanted, states, images, steps| self.step(wanted, states, images, steps)
    }

    /// One return of the points that are wanted, their states one after another; the images of the
    /// others are not to be used.
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
