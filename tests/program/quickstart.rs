//! From a scene to a local map, and one step of it beside direct simulation.

use grazemap::prelude::*;

#[test]
fn a_step_of_the_map_is_a_period_of_the_oscillator() -> Result<(), Error> {
    // A scene file: equations, stop, parameters, which orbit grazes.
    let scene = Scene::of_catalogue("linear")?;

    // The grazing orbit: `alpha` is adjusted until the periodic orbit just touches the stop.
    let graze = scene.graze()?;
    let (zeta, omega): (f64, f64) = (0.05, 1.8);
    let alpha = (1.0 - omega * omega).hypot(2.0 * zeta * omega);
    assert!((graze.parameter("alpha")? - alpha).abs() < 1e-15);

    // Its local map: P_smooth to degree 5, the discontinuity mapping to weight 6, as the scene says.
    let map = graze.map()?;

    // One step, in offsets from the grazing orbit: a point 1e-6 beyond the stop.
    let (state, parameters) = ([1e-6, 2e-5], [1e-6, 0.0]);
    let image = map.step(&state, &parameters)?;
    assert_eq!(image.step.contacts(), 1);

    // The same by event-driven simulation, which knows nothing of the expansion.
    let truth = map.simulate(&state, &parameters)?;
    for (by_map, by_simulation) in image.offsets.iter().zip(&truth.offsets) {
        // Depth y = 1e-3: truncation leaves far less than the rounding of a simulated period.
        assert!((by_map - by_simulation).abs() < 1e-12);
    }

    // What is saved is read back with the same bits.
    let read = Map::from_json(&map.to_json()?)?;
    assert_eq!(read.step(&state, &parameters)?, image);
    Ok(())
}
