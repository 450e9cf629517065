//! The time of a return of direct simulation, measured on the first returns of a section point.

use std::time::Instant;

use super::direct_map::DirectMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{MapOrbit, OrbitRequest};
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// Returns of the first measurement, largest number of them, and time that is enough in seconds.
const FIRST: usize = 8;
const MOST: usize = 512;
const ENOUGH: f64 = 0.02;
/// Number of lanes of a sweep.
const LANES: usize = 8;

/// Time of a return of direct simulation on one thread, in seconds, from the first returns of the
/// grazing orbit's section point at offsets of the active parameters; `in_lanes` if a sweep would
/// use lanes. `None` if there is no return.
pub fn seconds_per_return(
    scene: &Scene,
    orbit: &GrazingOrbit,
    parameters: &[f64],
    in_lanes: bool,
) -> Option<f64> {
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit).ok()?;
    let state = vec![0.0; orbit.section.coordinates.len()];
    let mut lanes = match in_lanes {
        true => direct.in_lanes::<LANES>(&[parameters; LANES]),
        false => None,
    };
    let starts: [&[f64]; LANES] = [&state; LANES];
    let bounds = vec![f64::INFINITY; state.len()];
    let mut returns = FIRST;
    loop {
        let request = OrbitRequest::new(0, returns, &bounds).escaping_at(&bounds);
        let clock = Instant::now();
        let orbits = match &mut lanes {
            Some(lanes) => lanes.orbits(&starts, &request),
            None => vec![MapOrbit::of(&direct, &state, parameters, &request)],
        };
        let seconds = clock.elapsed().as_secs_f64();
        let made: usize = orbits.iter().map(|orbit| orbit.steps.len()).sum();
        if made == 0 || seconds >= ENOUGH || returns >= MOST {
            return (made > 0).then(|| seconds / made as f64);
        }
        returns *= 4;
    }
}
