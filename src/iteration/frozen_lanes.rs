//! The map at fixed parameters, other ones in every lane.

use std::sync::Arc;

use super::discrete_map::StepInfo;
use super::forms::Forms;
use super::orbit::{MapOrbit, OrbitEnd, OrbitRequest};
use crate::jet::kernel::{Dual, LaneInterpreter};
use crate::numeric::{self, Lanes, widest};

/// A local map with other parameters folded in in every lane, made by
/// [`HornerMap::freeze_lanes`](super::HornerMap::freeze_lanes).
///
/// Orbits of independent states run in step, with the widest registers of the machine, and each is
/// that of the [`FrozenMap`](super::FrozenMap) at its parameters to the last bit.
#[derive(Clone, Debug)]
pub struct FrozenLanes<const N: usize> {
    forms: Arc<Forms>,
    /// Of every lane in use.
    coefficients: Vec<Vec<f64>>,
    step: LaneInterpreter<Lanes<N>>,
}

impl<const N: usize> FrozenLanes<N> {
    pub(super) fn new(forms: Arc<Forms>, parameters: &[&[f64]]) -> Self {
        let lanes = parameters.len();
        assert!((1..=N).contains(&lanes), "{lanes} lanes of {N}");
        let freezer = &forms.frozen_step;
        let coefficients = parameters.iter().map(|own| freezer.coefficients(own));
        let coefficients: Vec<Vec<f64>> = coefficients.collect();
        Self { step: freezer.in_lanes(&coefficients), coefficients, forms }
    }

    /// Iterates a state in every lane, as [`MapOrbit::of`] does one.
    ///
    /// # Panics
    ///
    /// If there is not one state for every lane, or states and scales have not the map's lengths.
    pub fn orbits(&mut self, initial: &[&[f64]], request: &OrbitRequest) -> Vec<MapOrbit> {
        let scales = request.scales.len();
        let dimension = self.forms.lowered.dimension;
        assert_eq!(scales, dimension, "lengths of state and scales");
        let orbits = initial.iter();
        let mut orbits: Vec<MapOrbit> =
            orbits.map(|state| MapOrbit::begin(state, request.keep)).collect();
        let state = self.gather(initial);
        self.step.inputs_mut().copy_from_slice(&state);
        let limits = request.scales.iter();
        widest(Iterating {
            map: &mut self.step,
            request,
            limits: limits.map(|scale| Lanes::splat(request.escape_factor * scale)).collect(),
            image: vec![0.0; dimension],
            orbits: &mut orbits,
        });
        orbits.iter_mut().for_each(|orbit| orbit.settle(request));
        orbits
    }

    /// Largest Lyapunov exponent of every lane, as
    /// [`largest_lyapunov_exponent`](super::largest_lyapunov_exponent) gives that of one map.
    ///
    /// # Panics
    ///
    /// If there is not one state of the map's length for every lane.
    pub fn largest_lyapunov_exponents(
        &self,
        initial: &[&[f64]],
        transient: usize,
        iterates: usize,
    ) -> Vec<Option<f64>> {
        let mut map: LaneInterpreter<Dual<Lanes<N>>> =
            self.forms.frozen_step.in_lanes(&self.coefficients);
        let unit = Lanes::splat(1.0 / (self.forms.lowered.dimension as f64).sqrt());
        for (input, value) in map.inputs_mut().iter_mut().zip(self.gather(initial)) {
            *input = Dual { value, slope: unit };
        }
        let exponents = widest(Stretching { map, transient, iterates });
        exponents[..self.coefficients.len()].to_vec()
    }

    /// Lanes beyond those in use repeat the first.
    fn gather(&self, states: &[&[f64]]) -> Vec<Lanes<N>> {
        let lanes = self.coefficients.len();
        assert_eq!(states.len(), lanes, "one state for every lane");
        let own = |lane: usize| states.get(lane).unwrap_or(&states[0]);
        (0..self.forms.lowered.dimension)
            .map(|coordinate| Lanes::from_fn(|lane| own(lane)[coordinate]))
            .collect()
    }
}

/// Orbits in step.
struct Iterating<'a, const N: usize> {
    map: &'a mut LaneInterpreter<Lanes<N>>,
    request: &'a OrbitRequest,
    /// Sizes at which a coordinate has escaped; infinite once it has.
    limits: Vec<Lanes<N>>,
    /// Room for the image of a lane.
    image: Vec<f64>,
    orbits: &'a mut [MapOrbit],
}

impl<const N: usize> numeric::Kernel for Iterating<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let all = self.request.transient + self.request.keep;
        for iterate in 1..=all {
            self.map.run();
            let stays = self.stays();
            if !stays || iterate == all {
                self.arrive(iterate);
            } else if iterate > self.request.transient {
                self.keep();
            }
            self.map.feed_back(self.limits.len());
            if !stays {
                self.retire();
                if self.orbits.iter().all(|orbit| orbit.end != OrbitEnd::Completed) {
                    break;
                }
            }
        }
    }
}

impl<const N: usize> Iterating<'_, N> {
    /// Whether the images of all lanes are finite and within their limits.
    #[inline(always)]
    fn stays(&self) -> bool {
        let mut stays = true;
        for (coordinate, limit) in self.limits.iter().enumerate() {
            let image = self.map.output(coordinate);
            for lane in 0..N {
                stays &= image[lane].abs() <= limit[lane];
            }
        }
        stays
    }

    /// Tells the orbits that go on where they are, all of them within their limits.
    fn keep(&mut self) {
        let dimension = self.limits.len();
        for (lane, orbit) in self.orbits.iter_mut().enumerate() {
            if orbit.end == OrbitEnd::Completed {
                let image = (0..dimension).map(|coordinate| self.map.output(coordinate)[lane]);
                orbit.keep(image, info(self.map, dimension, lane));
            }
        }
    }

    /// Tells the orbits that go on where they came from and where they are, which may end them.
    fn arrive(&mut self, iterate: usize) {
        let dimension = self.limits.len();
        let image = &mut self.image;
        for (lane, orbit) in self.orbits.iter_mut().enumerate() {
            if orbit.end != OrbitEnd::Completed {
                continue;
            }
            for (coordinate, value) in image.iter_mut().enumerate() {
                *value = self.map.output(coordinate)[lane];
                orbit.last[coordinate] = self.map.inputs()[coordinate][lane];
            }
            let info = info(self.map, dimension, lane).checked(image);
            orbit.arrive(image, info, self.request, iterate);
        }
    }

    /// Lets the lanes whose orbits have ended, and those in no use, rest at the origin.
    fn retire(&mut self) {
        for lane in 0..N {
            let ended = |orbit: &MapOrbit| orbit.end != OrbitEnd::Completed;
            if self.orbits.get(lane).is_none_or(ended) {
                let state = self.map.inputs_mut().iter_mut();
                state.for_each(|state| state[lane] = 0.0);
                let limits = self.limits.iter_mut();
                limits.for_each(|limit| limit[lane] = f64::INFINITY);
            }
        }
    }
}

/// What happened in the last step of a lane, to a finite image.
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

/// Tangent vectors carried along orbits in step.
struct Stretching<const N: usize> {
    map: LaneInterpreter<Dual<Lanes<N>>>,
    transient: usize,
    iterates: usize,
}

impl<const N: usize> numeric::Kernel for Stretching<N> {
    type Output = [Option<f64>; N];

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        let dimension = self.map.inputs().len();
        let mut sum = Lanes::splat(0.0);
        // Lanes whose tangent vector was annihilated.
        let mut annihilated = [false; N];
        let mut finite = [true; N];
        for iterate in 0..self.transient + self.iterates {
            self.map.run();
            self.map.feed_back(dimension);
            let point = self.map.inputs_mut();
            let mut square = Lanes::splat(0.0);
            for coordinate in &*point {
                for lane in 0..N {
                    // What follows an annihilation does not count.
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
                sum += growth.map(f64::ln);
            }
        }
        std::array::from_fn(|lane| {
            if annihilated[lane] {
                return Some(f64::NEG_INFINITY);
            }
            let mean = sum[lane] / self.iterates as f64;
            (finite[lane] && mean.is_finite()).then_some(mean)
        })
    }
}
