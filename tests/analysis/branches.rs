//! Branches of periodic orbits: the equations that are continued, and what is found along them.

use grazemap::analysis::MapEvaluation;
use grazemap::analysis::periodic::{ContactItinerary, ItinerarySearch, MapOrbitEquations};
use grazemap::numeric::{Dd, Scalar};
use grazemap::prelude::{FindGraze, Scene};

/// The exact derivatives against differences in double-double, at any point.
#[test]
fn derivatives_are_those_of_the_residuals() {
    let scene = Scene::load("scenes/foale.toml").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let evaluation = MapEvaluation::<Dd>::new(map.local());
    let itinerary = ContactItinerary::parse("110", 1).expect("digits");
    let window = &map.local().window;
    let equations =
        MapOrbitEquations::new(&evaluation, &itinerary, window, &[0, 1], &[0.0; 2], [2.0; 2]);
    let at: Vec<Dd> = [0.3, -0.2, 0.7, -0.4, 0.1, 0.6].into_iter().map(Dd::from).collect();
    let there = equations.at(&at).expect("residuals");
    assert_eq!(there.jacobian.shape(), (4, 6));
    let step = 1e-7;
    for column in 0..at.len() {
        let side = |sign: f64| {
            let mut moved = at.clone();
            moved[column] += Dd::from(sign * step);
            equations.at(&moved).expect("residuals").residual
        };
        let (up, down) = (side(1.0), side(-1.0));
        for row in 0..there.residual.len() {
            let difference = ((up[row] - down[row]) / Dd::from(2.0 * step)).to_f64();
            let exact = there.jacobian[(row, column)].to_f64();
            let error = (difference - exact).abs();
            assert!(error < 1e-10 * exact.abs().max(1.0), "{row} {column}: {error:e}");
        }
    }
}

/// The Jacobian of the period's map and its multipliers are those of the search by itinerary,
/// which takes differences.
#[test]
fn multipliers_are_those_of_the_search() {
    let scene = Scene::load("scenes/foale_omega_2_2.toml").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let itinerary = ContactItinerary::parse("1", 1).expect("digits");
    let parameters = [2e-4, 0.0];
    let found = ItinerarySearch::new(map.local()).orbits(&itinerary, &parameters);
    let orbit = found.first().expect("an orbit with one impact");
    let evaluation = MapEvaluation::<Dd>::new(map.local());
    let window = &map.local().window;
    let equations =
        MapOrbitEquations::new(&evaluation, &itinerary, window, &[0], &parameters, [2.0; 2]);
    let free = parameters.map(Dd::from);
    let at = equations.unknowns(&orbit.orbit.states[0], &orbit.depth_variables, &free);
    let there = equations.at(&at).expect("residuals");
    assert!(there.residual.iter().all(|value| value.magnitude() < 1e-20));
    let jacobian = equations.jacobian(&there).expect("a contact");
    for (ours, searched) in jacobian.iter().zip(orbit.orbit.jacobian.iter()) {
        let error = (*ours - *searched).magnitude();
        assert!(error < 1e-15 * searched.magnitude().max(1.0), "{ours:?} {searched:?}");
    }
}
