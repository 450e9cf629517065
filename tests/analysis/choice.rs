//! Map chosen for a tolerance, its range of validity, and the depths at which it is more accurate
//! than direct simulation in double precision.

use std::collections::BTreeMap;

use grazemap::FindGraze;
use grazemap::analysis::{DirectEnd, DirectImage};
use grazemap::convergence::{
    Choice, ChoiceOptions, Chooser, ExactImages, Limit, MapFamily, Monomials, Polynomials,
    SamplePoint, WindowSample, choose, choose_orders, chosen_map, validity,
};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::{Scene, Shape};
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

use crate::support::scenes::{grazing, grazing_by, orbit, parsed, scene, scene_with, text};
use crate::{UNUSED, exact};

/// Largest error of a map over points whose only contacts are those of grazing passages, against
/// direct simulation in double-double; infinite if a point makes other contacts.
fn error(scene: &Scene, orbit: &GrazingOrbit, map: &HornerMap, points: &[SamplePoint]) -> f64 {
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::<Dd>::new(&system, scene, orbit).expect("good input");
    points.iter().fold(0.0, |worst: f64, point| {
        let truth = direct.image(&exact(&point.state), &exact(&point.parameters));
        let truth = truth.expect("good input");
        if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
            return f64::INFINITY;
        }
        let mut image = vec![0.0; map.dimension()];
        map.step(&point.state, &point.parameters, &mut image);
        let differences = image.iter().zip(&truth.offsets);
        differences.fold(worst, |worst, (&image, &truth)| {
            worst.max((Dd::from(image) - truth).to_f64().abs())
        })
    })
}

fn assert_holds(name: &str, set: &[(&str, &str)], tolerance: f64) -> Choice {
    let (scene, orbit) = grazing_by(text(name), name, set);
    let choice = choose_orders(&scene, &orbit, tolerance).expect("a choice");
    assert!(choice.met && choice.fresh_points >= 600, "{choice:?}");
    let (_, map) = chosen_map(&choice, &scene, &orbit).expect("a simple graze");
    // The depths of a coarse map are as coarse: the window's points are those of a finer one.
    let (fine, _) = expanded(&scene, &orbit, 6, 8);
    let points = WindowSample::new(&fine).points(UNUSED, 1000);
    // The largest of one sample of a thousand points exceeds that of another by a little.
    let found = error(&scene, &orbit, &map, &points);
    assert!(found <= 1.1 * tolerance, "{name}, {tolerance:e}: {found:e}");
    choice
}

#[test]
fn chosen_maps_exceed_the_tolerance_by_less_than_a_tenth_at_points_never_used() {
    for (name, tolerances) in
        [("linear", [1e-4, 1e-6, 1e-8]), ("cantilever_3_5_soft", [1e-4, 1e-5, 3e-6])]
    {
        let choices = tolerances.map(|tolerance| assert_holds(name, &[], tolerance));
        let operations = choices.map(|choice| choice.operations);
        assert!(operations.is_sorted(), "{name}: {operations:?}");
    }
}

/// Scene with two passages, symmetric between two stops: the sample covers each.
#[test]
fn a_map_of_two_passages_is_chosen_too() {
    assert_holds("two_stops_t1", &[], 1e-6);
}

#[test]
fn a_choice_is_cheaper_than_the_best_pair_with_every_monomial() {
    let (scene, orbit) = grazing("linear");
    let tolerance = 1e-6;
    let choice = choose_orders(&scene, &orbit, tolerance).expect("a choice");
    assert_eq!(choice.monomials, Monomials::Needed);
    let family = MapFamily::new(&scene, &orbit, choice.orders).expect("a simple graze");
    let all = family.map(choice.orders).expect("smaller spaces");
    let full = all.coefficients();
    assert!(choice.coefficients < full, "{} of {full}", choice.coefficients);
}

#[test]
fn an_economised_choice_is_made_again_with_the_very_errors_it_was_chosen_by() {
    let (scene, orbit) = grazing("linear");
    let mut chooser = Chooser::new(&scene, &orbit, 200).expect("points");
    let choice = chooser.choose(1e-6).expect("a choice");
    assert_eq!(choice.polynomials, Polynomials::Economised, "{choice:?}");
    let (local, map) = chosen_map(&choice, &scene, &orbit).expect("a simple graze");
    assert_eq!(local.fitted_to, choice.fitted_to);
    assert_eq!(map.frozen_count().total(), choice.operations);
    // The fresh points follow the 128 of the sample.
    let fresh = ExactImages::new(&scene, &orbit, chooser.points(128, 200)).expect("points");
    let worst = fresh.errors(&map).into_iter().fold(0.0, f64::max);
    assert_eq!(Some(worst), choice.fresh_error);
}

/// The series of this stop end at a thirtieth of the largest depth variable of its window.
#[test]
fn contacts_are_flown_where_no_series_serves_and_the_shape_is_left_open() {
    let mut scene = scene("soft_a_stiff");
    scene.emit.shape = Shape::Auto;
    let orbit = orbit(&scene);
    let options = ChoiceOptions { fresh: 100, ..ChoiceOptions::new(1e-3) };
    let choice = choose(&scene, &orbit, &options).expect("a choice");
    assert!(choice.met && choice.shape == Shape::Flown, "{choice:?}");
    let (local, _) = chosen_map(&choice, &scene, &orbit).expect("a law that can be flown");
    assert!(local.is_flown());
}

#[test]
fn where_the_highest_orders_of_a_first_search_do_not_serve_higher_ones_are_expanded() {
    // Terms of the contact fall by a factor of 1.5 a weight on this window: weight 20 leaves out
    // 4e-12.
    let choice = assert_holds("cantilever_2_5", &[("window.state.theta", "0.05")], 1e-12);
    assert!(choice.orders.contact_weight > 20, "{choice:?}");
    assert_eq!(choice.shape, Shape::Composed);
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn a_composed_map_keeps_its_digits_where_a_parameter_moves_the_stop_by_ten_depths() {
    // Q reaches over ten times the window's depth: (Q − q)^k in powers of q and Q loses thirteen
    // digits by k = 10.
    let wide = [("window.state.theta", "0.05")];
    let (scene, orbit) = grazing_by(text("cantilever_4_5"), "cantilever_4_5", &wide);
    let choice = choose_orders(&scene, &orbit, 1e-12).expect("a choice");
    assert!(choice.met && choice.shape == Shape::Composed, "{choice:?}");
}

#[test]
fn a_tolerance_out_of_reach_is_said_to_be_and_how_close_maps_came() {
    let scene = scene("linear");
    let options = ChoiceOptions { fresh: 100, ..ChoiceOptions::new(1e-30) };
    let choice = choose(&scene, &orbit(&scene), &options).expect("a choice");
    assert!(!choice.met, "{choice:?}");
    // Limit of double precision on this window.
    assert!(choice.error.is_some_and(|error| error < 1e-13), "{choice:?}");
    assert_eq!(choice.limit, Some(Limit::Rounding));
}

/// A heavier parameter is a coarser cut of the same series: the expansion of a scene that names the
/// weight.
#[test]
fn where_coefficients_overflow_a_search_ends_with_what_was_found_before() {
    // A unit of 1e60 volts: the coefficient of the sixth power of the voltage is no number in
    // double precision.
    let changes = [
        ("V", "0.212e-60"),
        ("model.flow.v", "(1e60*V)^2*sin(theta)^2/(1 - x)^2 - 2*zeta*v - x"),
        ("window.parameter.V", "1e-64"),
    ];
    let scene = scene_with("mems", &changes);
    let choice = choose_orders(&scene, &orbit(&scene), 1e-10).expect("a choice");
    assert!(!choice.met && choice.orders.smooth_order < 6, "{choice:?}");
    assert_eq!(choice.limit, Some(Limit::Orders));
}

#[test]
fn a_family_cut_with_heavier_parameters_is_the_expansion_with_those_weights() {
    let (scene, orbit) = grazing("linear");
    let highest = MapOrders { smooth_order: 5, contact_weight: 7 };
    let orders = MapOrders { smooth_order: 4, contact_weight: 6 };
    let family = MapFamily::new(&scene, &orbit, highest).expect("a simple graze");
    let cut = family.weighted_map(orders, &[4, 6]).expect("smaller spaces");
    let weights = [("alpha", 4), ("omega", 6)].map(|(name, weight)| (name.to_owned(), weight));
    let mut weighted = scene.clone();
    weighted.expansion.weights.extend(weights);
    let expander = Expander::new(&weighted, &orbit).expect("rigid");
    let expanded = expander.expand(orders).expect("a simple graze");
    let stages = cut.stages.iter().zip(&expanded.stages);
    for (cut, expanded) in
        stages.flat_map(|(a, b)| a.polynomials().into_iter().zip(b.polynomials()))
    {
        assert_eq!(cut.nonzero(), expanded.nonzero());
        let scale = expanded.coefficients().iter().fold(1.0, |max: f64, c| max.max(c.abs()));
        for (powers, value) in expanded.terms() {
            // Both are computed to a relative 1e-15 of their largest terms.
            let difference = (cut.coefficient(powers) - value).abs();
            assert!(difference <= 1e-11 * scale, "{powers:?}: {difference:e}");
        }
    }
}

/// The map of a scene at orders, with its interpreter.
fn expanded(scene: &Scene, orbit: &GrazingOrbit, n: u32, w: u32) -> (LocalMap, HornerMap) {
    let orders = MapOrders { smooth_order: n, contact_weight: w };
    let expander = Expander::new(scene, orbit).expect("a simple graze");
    let map = expander.expand(orders).expect("a simple graze");
    let run = HornerMap::new(&map);
    (map, run)
}

#[test]
fn the_largest_window_holds_and_one_a_third_larger_does_not() {
    let (scene, orbit) = grazing("linear");
    let (local, map) = expanded(&scene, &orbit, 3, 5);
    let sample = WindowSample::new(&local);
    let variables = sample.widths().len();
    let mut scales = Vec::new();
    for tolerance in [1e-6, 1e-8] {
        let found = validity(&scene, &orbit, &local, &map, tolerance).expect("good input");
        let scale = found.scale.expect("a small window holds");
        let at = |factor: f64| {
            let factors = vec![scale * factor; variables];
            let window = sample.scaled(scale * factor, &factors);
            let points = [window.corners(), window.points(UNUSED, 200)].concat();
            error(&scene, &orbit, &map, &points)
        };
        // The trial's own points are fewer: the largest error of more of them may be a little
        // larger.
        assert!(at(0.9) <= 1.1 * tolerance, "{tolerance:e}: {found:?}");
        assert!(at(1.35) > tolerance, "{tolerance:e}: {found:?}");
        let names: Vec<_> = found.parameter.keys().cloned().collect();
        assert_eq!(names, ["alpha", "omega"]);
        assert!(found.depth.is_some_and(|depth| depth >= scale * scene.window.depth));
        let widths: BTreeMap<_, _> = found.parameter.clone();
        assert!(widths["alpha"].is_some_and(|width| width >= scale * 1e-3));
        scales.push(scale);
    }
    assert!(scales[1] < scales[0], "{scales:?}");
}

#[test]
fn the_stated_error_of_a_map_bounds_its_error_at_other_points_of_the_window() {
    let map = parsed(text("linear"), "linear", &[("expansion.smooth_order", "4")]);
    let map = map.graze().and_then(|graze| graze.map()).expect("a map");
    let (scene, orbit, local) = (map.scene(), map.orbit(), map.local());
    let stated = map.window().largest_error().expect("finite");
    let inside = |points: Vec<SamplePoint>| -> Vec<SamplePoint> {
        let holds = |point: &SamplePoint| {
            local.window.holds(&point.state, &point.parameters, &[0.999 * point.depth])
        };
        points.into_iter().filter(holds).collect()
    };
    let sample = WindowSample::new(local);
    let points = inside(sample.points(UNUSED, 1000));
    assert!(points.len() > 200, "{}", points.len());
    let found = error(scene, orbit, map.discrete(), &points);
    assert!(found <= stated, "{found:e}, {stated:e}");
    // Where the corners are the worst points, the stated error is theirs, rounded up by a tenth at
    // most.
    let worst = found.max(error(scene, orbit, map.discrete(), &inside(sample.corners())));
    assert!(stated <= 1.2 * worst, "{worst:e}, {stated:e}");
}
