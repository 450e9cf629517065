//! Search by itinerary, compared with a plain search: Newton's method on the map itself, including
//! its root, from random points, without a prescribed itinerary.

use grazemap::analysis::MapEvaluation;
use grazemap::analysis::periodic::{
    ContactItinerary, Guess, Held, ItinerarySearch, PeriodicOrbit, PeriodicProblem, periodic_orbit,
    window_scales,
};
use grazemap::expansion::{Expander, LocalMap, MapOrders};

use crate::support::scenes::grazing;
use crate::support::synthetic::Numbers;
use crate::support::tiers;

/// Random starts of each period.
const STARTS: usize = 300;

fn map(name: &str, (smooth_order, contact_weight): (u32, u32)) -> LocalMap {
    let (scene, orbit) = grazing(name);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let orders = MapOrders { smooth_order, contact_weight };
    expander.expand(orders).expect("small spaces")
}

/// Orbits of a period found by a plain search, no deeper than the window.
fn plain(
    map: &LocalMap,
    period: usize,
    at: &[f64],
    numbers: &mut Numbers,
) -> Vec<PeriodicOrbit<f64>> {
    let mut evaluation = MapEvaluation::<f64>::new(map);
    let depths = MapEvaluation::<f64>::depths(map);
    let problem = PeriodicProblem {
        returns: period,
        free: 0,
        itinerary: None,
        scales: window_scales(&map.window),
    };
    let mut start = || {
        let widths = map.window.state.iter();
        let state = widths.map(|width| width * numbers.next());
        let guess = Guess { state: state.collect(), parameters: at.to_vec() };
        periodic_orbit(&mut evaluation, &problem, Held::Parameter, &guess).found()
    };
    let found: Vec<_> = (0..STARTS).filter_map(|_| start()).collect();
    let shallow = |orbit: &PeriodicOrbit<f64>| {
        let mut states = orbit.states.iter();
        states.all(|state| depths.at(state, at).iter().all(|&depth| depth < map.window.depth))
    };
    let near = |orbit: &PeriodicOrbit<f64>| {
        let pairs = |state: &Vec<f64>| {
            let mut pairs = state.iter().zip(&map.window.state);
            pairs.all(|(x, width)| x.abs() < 50.0 * width)
        };
        orbit.states.iter().all(pairs)
    };
    found.into_iter().filter(|orbit| shallow(orbit) && near(orbit)).collect()
}

#[test]
fn no_orbit_that_a_plain_search_finds_is_missed() {
    let cases = [
        ("linear_codim2", (5, 6), [[4.05e-3, 1e-3], [2e-4, -1e-4]]),
        ("moving_stop", (5, 6), [[1e-4, 0.0], [-1e-4, 0.0]]),
        ("two_stops_t1_prestressed", (3, 6), [[1e-5, 0.0], [-1e-5, 0.0]]),
    ];
    let (mut numbers, mut compared) = (Numbers::new(5), Vec::new());
    for &(name, orders, parameters) in tiers::part(&cases, 1) {
        let map = map(name, orders);
        let search = ItinerarySearch::new(&map);
        let longest = 3 / map.passages();
        let listed = ContactItinerary::all(map.passages(), longest).expect("short");
        for at in &parameters {
            let orbits = listed.iter().flat_map(|itinerary| search.orbits(itinerary, at));
            let points: Vec<Vec<f64>> = orbits
                .filter(|orbit| orbit.is_physical())
                .flat_map(|orbit| orbit.orbit.states)
                .map(|state| state.iter().map(|value| value.to_f64()).collect())
                .collect();
            for period in 1..=longest {
                for orbit in plain(&map, period, at, &mut numbers) {
                    let apart = |point: &Vec<f64>| {
                        let pairs = point.iter().zip(&orbit.states[0]).zip(&map.window.state);
                        pairs.map(|((a, b), width)| ((a - b) / width).abs()).fold(0.0, f64::max)
                    };
                    let nearest = points.iter().map(apart).fold(f64::INFINITY, f64::min);
                    let contacts = ContactItinerary::new(map.passages(), orbit.itinerary.clone());
                    assert!(nearest < 1e-5, "{name} at {at:?}: {contacts} at {:?}", orbit.states);
                    compared.push((name, contacts.to_string()));
                }
            }
        }
    }
    compared.sort();
    compared.dedup();
    assert!(compared.len() >= tiers::count(3, 12), "{compared:?}");
}
