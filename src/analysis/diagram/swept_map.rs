//! What a sweep asks of a map: to be fixed at a parameter value, and to be observed.

use super::observe::Observer;
use super::start::SmoothFixedPoint;
use crate::analysis::DirectMap;
use crate::iteration::{DiscreteMap, HornerMap, Itinerary, StepInfo};
use crate::model::Method;

/// A map that can be swept along a parameter.
pub trait SweptMap: Sync {
    /// What it is.
    fn method(&self) -> Method;

    /// Number of coordinates of a state.
    fn dimension(&self) -> usize;

    /// Number of parameters.
    fn parameters(&self) -> usize;

    /// The map at fixed parameters, a map without parameters: prepared once per parameter value.
    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + '_>;

    /// Where a sweep starts, and starts again after an escape.
    fn start(&self, parameters: &[f64]) -> Vec<f64>;

    /// The observable at a state.
    fn observe(&self, state: &[f64], parameters: &[f64]) -> f64;

    /// The surfaces that graze and the passages of one return.
    fn itinerary(&self) -> &Itinerary;

    /// Contacts per surface of the itinerary on the way from a state to its image.
    fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32>;

    /// Whether the map's Jacobian is cheap and exact, so that Lyapunov exponents are computed.
    fn has_jacobian(&self) -> bool;
}

/// Any map with its parameters given at every step.
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
        self.map
            .step_jacobian(state, &self.parameters, image, jacobian)
    }
}

fn fixed<'m, M: DiscreteMap + 'm>(map: M, parameters: &[f64]) -> Box<dyn DiscreteMap + 'm> {
    Box::new(Fixed {
        map,
        parameters: parameters.to_vec(),
    })
}

/// The hits of one step of a map by its passages.
fn hits_of_step(
    map: &impl DiscreteMap,
    itinerary: &Itinerary,
    state: &[f64],
    parameters: &[f64],
) -> Vec<u32> {
    let mut image = vec![0.0; map.dimension()];
    itinerary.hits(map.step(state, parameters, &mut image).passages)
}

/// A map written by hand: it starts at 0, and its first coordinate is drawn.
#[derive(Clone, Debug)]
pub struct UnobservedSweep<M> {
    /// The map.
    pub map: M,
    /// Which surface each of its passages meets.
    pub itinerary: Itinerary,
}

impl<M: DiscreteMap> SweptMap for UnobservedSweep<M> {
    fn method(&self) -> Method {
        Method::Map
    }

    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + '_> {
        fixed(&self.map, parameters)
    }

    fn start(&self, _: &[f64]) -> Vec<f64> {
        vec![0.0; self.map.dimension()]
    }

    fn observe(&self, state: &[f64], _: &[f64]) -> f64 {
        state[0]
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32> {
        hits_of_step(&self.map, &self.itinerary, state, parameters)
    }

    fn has_jacobian(&self) -> bool {
        true
    }
}

/// The local map, frozen at each parameter value.
#[derive(Debug)]
pub struct FrozenSweep {
    /// The map.
    pub map: HornerMap,
    /// Where it starts.
    pub start: SmoothFixedPoint,
    /// What is drawn.
    pub observer: Observer,
    /// Which surface each passage meets.
    pub itinerary: Itinerary,
}

impl SweptMap for FrozenSweep {
    fn method(&self) -> Method {
        Method::Map
    }

    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + '_> {
        Box::new(self.map.freeze(parameters))
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.start.at(parameters)
    }

    fn observe(&self, state: &[f64], parameters: &[f64]) -> f64 {
        self.observer.by_map(state, parameters)
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32> {
        hits_of_step(&self.map, &self.itinerary, state, parameters)
    }

    fn has_jacobian(&self) -> bool {
        true
    }
}

/// Direct simulation.
#[derive(Debug)]
pub struct DirectSweep<'a> {
    /// The map.
    pub map: DirectMap<'a>,
    /// Where it starts.
    pub start: SmoothFixedPoint,
    /// What is drawn.
    pub observer: Observer,
    /// Which surface each passage meets.
    pub itinerary: Itinerary,
}

impl SweptMap for DirectSweep<'_> {
    fn method(&self) -> Method {
        Method::Direct
    }

    fn dimension(&self) -> usize {
        self.map.dimension()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + '_> {
        // A simulator of its own, so that sweeps side by side do not wait for each other.
        fixed(self.map.clone(), parameters)
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.start.at(parameters)
    }

    fn observe(&self, state: &[f64], parameters: &[f64]) -> f64 {
        self.observer.by_simulation(&self.map, state, parameters)
    }

    fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    fn hits(&self, state: &[f64], parameters: &[f64]) -> Vec<u32> {
        self.map.hits(state, parameters)
    }

    fn has_jacobian(&self) -> bool {
        false
    }
}
