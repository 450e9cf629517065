//! From a scene to a local map, and one step of it beside direct simulation.

use grazemap::analysis::direct_image;
use grazemap::expansion::{Expander, MapOrders};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::{Scene, catalogue};
use grazemap::orbit::locate;

#[test]
fn a_step_of_the_map_is_a_period_of_the_oscillator() -> Result<(), Box<dyn std::error::Error>> {
    // A scene file, here one of the catalogue: equations, stop, parameters, which orbit grazes.
    let text = catalogue::text("linear").ok_or("not in the catalogue")?;
    let scene = Scene::parse(text, "linear.toml")?;

    // The grazing orbit: `alpha` is adjusted until the periodic orbit just touches the stop.
    let orbit = locate(&scene)?.into_result()?;
    let (zeta, omega): (f64, f64) = (0.05, 1.8);
    let alpha = (1.0 - omega * omega).hypot(2.0 * zeta * omega);
    assert!((orbit.parameters()[3].to_f64() - alpha).abs() < 1e-15);

    // Its local map: P_smooth to degree 5, the discontinuity mapping to weight 6.
    let orders = MapOrders {
        smooth_order: 5,
        contact_weight: 6,
    };
    let map = HornerMap::new(&Expander::new(&scene, &orbit)?.expand(orders)?);

    // One step, in offsets from the grazing orbit: a point 1e-6 beyond the stop.
    let (state, parameters) = ([1e-6, 2e-5], [1e-6, 0.0]);
    let mut image = [0.0; 2];
    let step = map.step(&state, &parameters, &mut image);
    assert_eq!(step.contacts(), 1);

    // The same by event-driven simulation, which knows nothing of the expansion.
    let truth = direct_image(&scene, &orbit, &state, &parameters)?;
    for (by_map, by_simulation) in image.iter().zip(&truth.offsets) {
        // Depth y = 1e-3: truncation leaves far less than the rounding of a simulated period.
        assert!((by_map - by_simulation).abs() < 1e-12);
    }
    Ok(())
}
