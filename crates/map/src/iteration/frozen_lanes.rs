//! The kernels of one map, whole and split for freezing, and the map frozen at different parameters
//! in every lane.

use std::sync::{Arc, OnceLock};

use super::discrete_map::StepInfo;
use super::lyapunov::{Growth, LyapunovExponent};
use super::orbit::{MapOrbit, OrbitEnd, OrbitRequest};
use crate::expansion::{MapKernel, MapWindow};
use crate::interruption::check_at;
use crate::jet::kernel::{
    Dual, Interpreter, Kernel, LaneInterpreter, Number, OperationCount, Unset,
};
use crate::numeric::{Lanes, Vectorised, widest};

/// A local map with the parameters of each lane folded in, made by
/// [`HornerMap::freeze_lanes`](super::HornerMap::freeze_lanes).
///
/// Independent orbits run in lockstep, in the widest registers of the machine. Each equals that of
/// the [`FrozenMap`](super::FrozenMap) at its parameters to the last bit.
#[derive(Clone, Debug)]
pub struct FrozenLanes<const N: usize> {
    forms: Arc<Forms>,
    /// Parameters of every lane in use.
    parameters: Vec<Vec<f64>>,
    /// Coefficients of every lane in use.
    coefficients: Vec<Vec<f64>>,
    step: LaneInterpreter<Lanes<N>>,
}

/// A replacement of a map outside its window: given the flags of the lanes to step and the states
/// of all lanes, one after another, it writes the images of the flagged lanes and their step data.
pub type Substitute<'a> = dyn FnMut(&[bool], &[f64], &mut [f64], &mut [StepInfo]) + 'a;

impl<const N: usize> FrozenLanes<N> {
    pub(super) fn new(forms: Arc<Forms>, parameters: &[&[f64]]) -> Self {
        let lanes = parameters.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let freezer = &forms.frozen_step;
        let coefficients = parameters.iter().map(|own| freezer.coefficients(own));
        let coefficients: Vec<Vec<f64>> = coefficients.collect();
        let parameters = parameters.iter().map(|own| own.to_vec()).collect();
        Self { step: freezer.in_lanes(&coefficients), parameters, coefficients, forms }
    }

    /// Iterates one state in every lane, as [`MapOrbit::of`] does for one map.
    ///
    /// # Panics
    ///
    /// If there is not one state for every lane, or the lengths of states or scales are not the
    /// map's.
    pub fn orbits(&mut self, initial: &[&[f64]], request: &OrbitRequest) -> Vec<MapOrbit> {
        self.iterate(initial, request, None)
    }

    /// Iterates as [`orbits`](Self::orbits) does; a step is taken by the substitute if its state,
    /// its parameters or its depths lie outside the window.
    ///
    /// # Panics
    ///
    /// As [`orbits`](Self::orbits).
    pub fn guarded_orbits(
        &mut self,
        initial: &[&[f64]],
        request: &OrbitRequest,
        window: &MapWindow,
        substitute: &mut Substitute<'_>,
    ) -> Vec<MapOrbit> {
        let bounded = !window.is_unbounded();
        self.iterate(initial, request, bounded.then_some((window, substitute)))
    }

    fn iterate(
        &mut self,
        initial: &[&[f64]],
        request: &OrbitRequest,
        window: Option<(&MapWindow, &mut Substitute<'_>)>,
    ) -> Vec<MapOrbit> {
        let scales = request.scales.len();
        let dimension = self.forms.lowered.dimension;
        assert_eq!(scales, dimension, "lengths of state and scales");
        let orbits = initial.iter();
        let mut orbits: Vec<MapOrbit> =
            orbits.map(|state| MapOrbit::begin(state, request)).collect();
        let state = self.gather(initial);
        self.step.inputs_mut().copy_from_slice(&state);
        let limits = request.escape.iter();
        let limits: Vec<Lanes<N>> = limits.map(|&bound| Lanes::splat(bound)).collect();
        let guard =
            window.map(|(window, substitute)| Guard::new(self.bounds(window), &limits, substitute));
        widest(Iterating {
            map: &mut self.step,
            request,
            limits,
            images: state,
            guard,
            image: vec![0.0; dimension],
            orbits: &mut orbits,
        });
        orbits.iter_mut().for_each(|orbit| orbit.settle(request));
        orbits
    }

    /// Largest Lyapunov exponent of every lane, computed as in
    /// [`largest_lyapunov_exponent`](super::largest_lyapunov_exponent).
    ///
    /// # Panics
    ///
    /// If there is not one state of the map's length for every lane.
    pub fn largest_lyapunov_exponents(
        &self,
        initial: &[&[f64]],
        transient: usize,
        iterates: usize,
    ) -> Vec<Option<LyapunovExponent>> {
        self.exponents(initial, transient, iterates, None)
    }

    /// Largest Lyapunov exponent of every lane; `None` also in lanes whose orbits leave the window.
    ///
    /// # Panics
    ///
    /// As [`largest_lyapunov_exponents`](Self::largest_lyapunov_exponents).
    pub fn guarded_lyapunov_exponents(
        &self,
        initial: &[&[f64]],
        transient: usize,
        iterates: usize,
        window: &MapWindow,
    ) -> Vec<Option<LyapunovExponent>> {
        let bounds = (!window.is_unbounded()).then(|| self.bounds(window));
        self.exponents(initial, transient, iterates, bounds)
    }

    fn exponents(
        &self,
        initial: &[&[f64]],
        transient: usize,
        iterates: usize,
        bounds: Option<LaneWindow<N>>,
    ) -> Vec<Option<LyapunovExponent>> {
        let mut map: LaneInterpreter<Dual<Lanes<N>>> =
            self.forms.frozen_step.in_lanes(&self.coefficients);
        let unit = Lanes::splat(1.0 / (self.forms.lowered.dimension as f64).sqrt());
        for (input, value) in map.inputs_mut().iter_mut().zip(self.gather(initial)) {
            *input = Dual { value, slope: unit };
        }
        let exponents = widest(Stretching { map, bounds, transient, iterates });
        exponents[..self.coefficients.len()].to_vec()
    }

    /// Window of every lane: empty if the parameters of the lane lie outside, unbounded in lanes
    /// that are not in use.
    fn bounds(&self, window: &MapWindow) -> LaneWindow<N> {
        let bound = |bound: f64| {
            Lanes::from_fn(|lane| match self.parameters.get(lane) {
                None => f64::INFINITY,
                Some(own) if window.holds(&[], own, &[]) => bound,
                Some(_) => f64::NEG_INFINITY,
            })
        };
        LaneWindow {
            state: window.state.iter().map(|&width| bound(width)).collect(),
            depth: bound(window.depth),
        }
    }

    /// Gathers one state per lane; lanes not in use repeat the first.
    fn gather(&self, states: &[&[f64]]) -> Vec<Lanes<N>> {
        let lanes = self.coefficients.len();
        assert_eq!(states.len(), lanes, "one state for every lane");
        let own = |lane: usize| states.get(lane).unwrap_or(&states[0]);
        (0..self.forms.lowered.dimension)
            .map(|coordinate| Lanes::from_fn(|lane| own(lane)[coordinate]))
            .collect()
    }
}

/// Window of a map, in lanes.
#[derive(Clone, Debug)]
struct LaneWindow<const N: usize> {
    /// Half-width of every coordinate.
    state: Vec<Lanes<N>>,
    /// Largest depth.
    depth: Lanes<N>,
}

impl<const N: usize> LaneWindow<N> {
    /// Largest amount by which states, or the depths of their steps, exceed the window, but at
    /// least `least`; positive if any lies outside.
    #[inline(always)]
    fn excess<'l>(
        &self,
        least: Lanes<N>,
        states: impl Iterator<Item = &'l Lanes<N>>,
        depths: impl Iterator<Item = &'l Lanes<N>>,
    ) -> Lanes<N> {
        let mut excess = least;
        for (state, width) in states.zip(&self.state) {
            for lane in 0..N {
                excess[lane] = larger(excess[lane], state[lane].abs() - width[lane]);
            }
        }
        for depth in depths {
            for lane in 0..N {
                excess[lane] = larger(excess[lane], depth[lane] - self.depth[lane]);
            }
        }
        excess
    }

    /// Whether the depths of all lanes lie inside.
    #[inline(always)]
    fn holds_depths<'l>(&self, depths: impl Iterator<Item = &'l Lanes<N>>) -> bool {
        let mut holds = true;
        for depth in depths {
            for lane in 0..N {
                holds &= depth[lane] <= self.depth[lane];
            }
        }
        holds
    }

    /// Removes all bounds of a lane.
    fn open(&mut self, lane: usize) {
        self.state.iter_mut().for_each(|width| width[lane] = f64::INFINITY);
        self.depth[lane] = f64::INFINITY;
    }
}

/// Whether all numbers are within their bounds in absolute value, in every lane.
#[inline(always)]
fn within<const N: usize>(values: &[Lanes<N>], bounds: &[Lanes<N>]) -> bool {
    let mut within = true;
    for (value, bound) in values.iter().zip(bounds) {
        for lane in 0..N {
            within &= value[lane].abs() <= bound[lane];
        }
    }
    within
}

/// Larger of two numbers in one instruction; the first if the second is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Whether a number is positive in any lane.
#[inline(always)]
fn any_positive<const N: usize>(values: &Lanes<N>) -> bool {
    let mut any = false;
    for lane in 0..N {
        any |= values[lane] > 0.0;
    }
    any
}

/// The window of a map and the substitute used outside it.
///
/// One comparison of an image with the smaller of two bounds shows that its orbit goes on and that
/// its next step begins inside the window. The two bounds are told apart only if the comparison
/// fails.
struct Guard<'a, const N: usize> {
    window: LaneWindow<N>,
    /// Smaller of the window's half-width and the bound of an escape, for every coordinate.
    near: Vec<Lanes<N>>,
    /// Whether the states of all lanes are known to lie inside the window.
    begins_inside: bool,
    substitute: &'a mut Substitute<'a>,
    /// Lanes whose last step was taken by the substitute.
    outside: Vec<bool>,
    /// States of all lanes; below, their images and step data.
    states: Vec<f64>,
    images: Vec<f64>,
    steps: Vec<StepInfo>,
}

impl<'a, const N: usize> Guard<'a, N> {
    fn new(window: LaneWindow<N>, limits: &[Lanes<N>], substitute: &'a mut Substitute<'a>) -> Self {
        let pairs = window.state.iter().zip(limits);
        let smaller = |(a, b): (&Lanes<N>, &Lanes<N>)| Lanes::from_fn(|lane| a[lane].min(b[lane]));
        Self {
            near: pairs.map(smaller).collect(),
            begins_inside: false,
            window,
            substitute,
            outside: vec![false; N],
            states: Vec::new(),
            images: Vec::new(),
            steps: vec![StepInfo::default(); N],
        }
    }
}

/// Iteration of the orbits of all lanes in lockstep.
struct Iterating<'a, 'g, const N: usize> {
    map: &'a mut LaneInterpreter<Lanes<N>>,
    request: &'a OrbitRequest,
    /// Largest allowed size of each coordinate; infinite once the orbit has ended.
    limits: Vec<Lanes<N>>,
    /// Images of all lanes.
    images: Vec<Lanes<N>>,
    guard: Option<Guard<'g, N>>,
    /// Buffer for the image of a lane.
    image: Vec<f64>,
    orbits: &'a mut [MapOrbit],
}

impl<const N: usize> Vectorised for Iterating<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let all = self.request.transient + self.request.keep;
        for iterate in 1..=all {
            check_at(iterate);
            self.map.run();
            for (number, image) in self.images.iter_mut().enumerate() {
                *image = *self.map.output(number);
            }
            self.guard();
            let stays = self.stays();
            if !stays || iterate == all {
                self.arrive(iterate);
            } else if iterate > self.request.transient {
                self.keep(iterate);
            }
            self.map.inputs_mut().copy_from_slice(&self.images);
            if !stays {
                self.retire();
                if self.orbits.iter().all(|orbit| orbit.end != OrbitEnd::Completed) {
                    break;
                }
            }
        }
    }
}

impl<const N: usize> Iterating<'_, '_, N> {
    /// Replaces the images of the lanes outside the window by the substitute's.
    #[inline(always)]
    fn guard(&mut self) {
        let Some(guard) = &mut self.guard else { return };
        let passages = self.images.len()..self.map.outputs();
        let depths = passages.map(|number| self.map.output(number));
        if guard.begins_inside && guard.window.holds_depths(depths.clone()) {
            guard.outside.fill(false);
            return;
        }
        let nothing = Lanes::splat(f64::NEG_INFINITY);
        let excess = guard.window.excess(nothing, self.map.inputs().iter(), depths);
        if any_positive(&excess) {
            self.substitute(&excess);
        } else {
            guard.outside.fill(false);
        }
    }

    #[inline(never)]
    fn substitute(&mut self, excess: &Lanes<N>) {
        let Some(guard) = &mut self.guard else { return };
        let (dimension, lanes) = (self.images.len(), self.orbits.len());
        for (lane, orbit) in self.orbits.iter().enumerate() {
            guard.outside[lane] = excess[lane] > 0.0 && orbit.end == OrbitEnd::Completed;
        }
        guard.states.clear();
        for lane in 0..lanes {
            guard.states.extend(self.map.inputs().iter().map(|state| state[lane]));
        }
        guard.images.resize(guard.states.len(), 0.0);
        let steps = &mut guard.steps[..lanes];
        (guard.substitute)(&guard.outside[..lanes], &guard.states, &mut guard.images, steps);
        let found = guard.images.chunks_exact(dimension).zip(&guard.outside);
        for (lane, (image, _)) in found.enumerate().filter(|(_, (_, outside))| **outside) {
            for (target, &value) in self.images.iter_mut().zip(image) {
                target[lane] = value;
            }
        }
    }

    /// Contacts and depth of the last step of a lane, by the map or by the substitute.
    fn step(&self, lane: usize) -> StepInfo {
        match &self.guard {
            Some(guard) if guard.outside[lane] => guard.steps[lane],
            _ => info(self.map, self.images.len(), lane),
        }
    }

    /// Whether the images of all lanes are finite and within their limits.
    #[inline(always)]
    fn stays(&mut self) -> bool {
        if let Some(guard) = &mut self.guard {
            guard.begins_inside = within(&self.images, &guard.near);
            if guard.begins_inside {
                return true;
            }
        }
        within(&self.images, &self.limits)
    }

    /// Appends the images to the kept states of the orbits that go on; all images are within their
    /// limits.
    fn keep(&mut self, iterate: usize) {
        for lane in 0..self.orbits.len() {
            if self.orbits[lane].end != OrbitEnd::Completed {
                continue;
            }
            let step = self.step(lane);
            let orbit = &mut self.orbits[lane];
            if iterate == self.request.transient + 1 {
                orbit.enter(self.map.inputs().iter().map(|state| state[lane]));
            }
            orbit.keep(self.images.iter().map(|image| image[lane]), step);
        }
    }

    /// Passes states and images to the orbits that go on; an image may end its orbit.
    fn arrive(&mut self, iterate: usize) {
        for lane in 0..self.orbits.len() {
            if self.orbits[lane].end != OrbitEnd::Completed {
                continue;
            }
            let step = self.step(lane);
            let (orbit, image) = (&mut self.orbits[lane], &mut self.image);
            for (coordinate, value) in image.iter_mut().enumerate() {
                *value = self.images[coordinate][lane];
                orbit.last[coordinate] = self.map.inputs()[coordinate][lane];
            }
            orbit.arrive(image, step.checked(image), self.request, iterate);
        }
    }

    /// Sets the lanes whose orbits have ended, and those not in use, to the origin without bounds.
    fn retire(&mut self) {
        for lane in 0..N {
            let ended = |orbit: &MapOrbit| orbit.end != OrbitEnd::Completed;
            if self.orbits.get(lane).is_none_or(ended) {
                let state = self.map.inputs_mut().iter_mut();
                state.for_each(|state| state[lane] = 0.0);
                let limits = self.limits.iter_mut();
                limits.for_each(|limit| limit[lane] = f64::INFINITY);
                if let Some(guard) = &mut self.guard {
                    guard.window.open(lane);
                    guard.near.iter_mut().for_each(|bound| bound[lane] = f64::INFINITY);
                }
            }
        }
    }
}

/// Contacts and depth of the last step of a lane by the map; the image is taken to be finite.
fn info<const N: usize>(
    map: &LaneInterpreter<Lanes<N>>,
    dimension: usize,
    lane: usize,
) -> StepInfo {
    let mut info = StepInfo { valid: true, ..StepInfo::default() };
    for (passage, number) in (dimension..map.outputs()).enumerate() {
        info.add_passage(passage, map.output(number)[lane]);
    }
    info
}

/// Iteration of tangent vectors along the orbits of all lanes in lockstep.
struct Stretching<const N: usize> {
    map: LaneInterpreter<Dual<Lanes<N>>>,
    /// Window that the orbits must not leave.
    bounds: Option<LaneWindow<N>>,
    transient: usize,
    iterates: usize,
}

impl<const N: usize> Vectorised for Stretching<N> {
    type Output = [Option<LyapunovExponent>; N];

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        let dimension = self.map.inputs().len();
        let mut sum = Growth::new(Lanes::splat(0.0), self.iterates);
        // Lanes whose tangent vector became zero.
        let mut annihilated = [false; N];
        let mut finite = [true; N];
        // Largest excess of each lane over the window so far.
        let mut furthest = Lanes::splat(f64::NEG_INFINITY);
        for iterate in 0..self.transient + self.iterates {
            check_at(iterate);
            self.map.run();
            if let Some(bounds) = &self.bounds {
                let states = self.map.inputs().iter().map(|input| &input.value);
                let passages = dimension..self.map.outputs();
                let depths = passages.map(|number| &self.map.output(number).value);
                furthest = bounds.excess(furthest, states, depths);
            }
            self.map.feed_back(dimension);
            let point = self.map.inputs_mut();
            let mut square = Lanes::splat(0.0);
            for coordinate in &*point {
                for lane in 0..N {
                    // Values after a zero tangent vector do not count.
                    finite[lane] &= coordinate.value[lane].is_finite() | annihilated[lane];
                }
                square += coordinate.slope * coordinate.slope;
            }
            let growth = square.map(f64::sqrt);
            for lane in 0..N {
                annihilated[lane] |= finite[lane] & (growth[lane] == 0.0);
            }
            for coordinate in point {
                coordinate.slope /= growth;
            }
            if iterate >= self.transient {
                sum.add(growth.map(f64::ln));
            }
        }
        std::array::from_fn(|lane| {
            if furthest[lane] > 0.0 {
                return None;
            }
            if annihilated[lane] {
                return Some(LyapunovExponent::ANNIHILATED);
            }
            sum.exponent(|sum| sum[lane]).filter(|_| finite[lane])
        })
    }
}

/// All forms of a map's kernel, shared by the map and by the maps frozen from it.
///
/// Forms that not every user needs are made at their first use.
#[derive(Debug)]
pub(super) struct Forms {
    pub(super) lowered: MapKernel,
    pub(super) frozen_step: Freezer,
    step: OnceLock<Interpreter>,
    jacobian: OnceLock<Interpreter>,
    derivatives: OnceLock<Interpreter>,
    frozen_jacobian: OnceLock<Freezer>,
    frozen_depth: OnceLock<Freezer>,
    batch: [OnceLock<Freezer>; 4],
}

impl Forms {
    pub(super) fn new(lowered: MapKernel) -> Self {
        Self {
            frozen_step: Freezer::new(&lowered.kernel, lowered.dimension),
            step: OnceLock::new(),
            jacobian: OnceLock::new(),
            derivatives: OnceLock::new(),
            frozen_jacobian: OnceLock::new(),
            frozen_depth: OnceLock::new(),
            batch: Default::default(),
            lowered,
        }
    }

    /// Kernel with the outputs image, depths.
    pub(super) fn step(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.kernel);
        self.step.get_or_init(make)
    }

    /// Kernel with the outputs image, depths, Jacobian.
    pub(super) fn jacobian(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.with_jacobian());
        self.jacobian.get_or_init(make)
    }

    /// Kernel with the outputs image, depths, derivatives of the image by coordinates and
    /// parameters.
    pub(super) fn derivatives(&self) -> &Interpreter {
        let make = || Interpreter::new(&self.lowered.with_derivatives());
        self.derivatives.get_or_init(make)
    }

    /// Kernel with the outputs image, depths, Jacobian, split for freezing.
    pub(super) fn frozen_jacobian(&self) -> &Freezer {
        let make = || Freezer::new(&self.lowered.with_jacobian(), self.lowered.dimension);
        self.frozen_jacobian.get_or_init(make)
    }

    /// Kernel with the outputs image, depths and, if `derivatives`, the derivatives of the image by
    /// coordinates and parameters. Parameters are frozen, or inputs of each point if `each`.
    pub(super) fn batch(&self, derivatives: bool, each: bool) -> &Freezer {
        let MapKernel { dimension, parameters, kernel, .. } = &self.lowered;
        let free = if each { dimension + parameters } else { *dimension };
        let make = || match derivatives {
            true => Freezer::new(&self.lowered.with_derivatives(), free),
            false => Freezer::new(kernel, free),
        };
        self.batch[2 * usize::from(derivatives) + usize::from(each)].get_or_init(make)
    }

    /// Kernel with the depth of the first passage as its output, split for freezing.
    pub(super) fn frozen_depth(&self) -> &Freezer {
        let make = || Freezer::new(&first_depth(&self.lowered), self.lowered.dimension);
        self.frozen_depth.get_or_init(make)
    }
}

fn first_depth(map: &MapKernel) -> Kernel {
    let mut kernel = map.kernel.clone();
    kernel.outputs = kernel.outputs[map.dimension..].to_vec();
    kernel.outputs.truncate(1);
    kernel.without_dead_operations()
}

/// A kernel split into a part computed when freezing and a part computed in each step.
#[derive(Debug)]
pub(super) struct Freezer {
    prepare: Interpreter,
    run: Unset,
    pub(super) count: OperationCount,
}

impl Freezer {
    fn new(kernel: &Kernel, free: usize) -> Self {
        let split = kernel.split(free);
        Self {
            prepare: Interpreter::new(&split.prepare),
            run: Unset::new(&split.run, free),
            count: split.run.count(),
        }
    }

    /// Number of outputs.
    pub(super) fn outputs(&self) -> usize {
        self.run.outputs()
    }

    /// Coefficients at given parameters.
    pub(super) fn coefficients(&self, parameters: &[f64]) -> Vec<f64> {
        self.prepare.evaluate(parameters)
    }

    pub(super) fn freeze(&self, parameters: &[f64]) -> Interpreter {
        self.run.set(&self.coefficients(parameters))
    }

    /// Kernel with the coefficients of every lane; further lanes repeat those of the first.
    pub(super) fn in_lanes<const N: usize, T: Number<Known = Lanes<N>>>(
        &self,
        coefficients: &[Vec<f64>],
    ) -> LaneInterpreter<T> {
        self.run.set_lanes(coefficients)
    }
}
