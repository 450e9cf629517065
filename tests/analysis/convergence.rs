//! Maps of every order against direct simulation: rates, errors, the choice of orders.

use grazemap::analysis::NoProgress;
use grazemap::convergence::{
    ConvergenceOptions, ConvergenceStudy, FactorRate, MapFamily, choose_orders, converge,
};
use grazemap::expansion::{Expander, LocalMap, MapOrders, Stage};
use grazemap::jet::Jet;
use grazemap::model::Shape;

use crate::support::scenes::{grazing, orbit, scene};

fn study(name: &str, smooth_order: u32, contact_weight: u32) -> ConvergenceStudy {
    let scene = scene(name);
    let options = ConvergenceOptions {
        highest: Some(MapOrders { smooth_order, contact_weight }),
        shapes: vec![Shape::Factored],
        points: 32,
        discontinuity_rates: contact_weight,
        smooth_rates: smooth_order,
        ..ConvergenceOptions::of(&scene)
    };
    converge(&scene, &orbit(&scene), &options, &NoProgress).expect("a study")
}

fn assert_rates(what: &str, rates: &[FactorRate]) {
    for FactorRate { order, rate, .. } in rates {
        let measured = rate.measured.expect("a range above rounding");
        // The next term of the series bends the line: 0.1 is what the issue of orders needs to
        // know.
        assert!((measured - rate.expected).abs() < 0.1, "{what} at {order}: {rate:?}");
    }
}

#[test]
fn errors_of_the_factors_fall_with_the_expected_exponents() {
    let study = study("linear", 3, 4);
    assert_rates("D", &study.discontinuity_rates);
    assert_rates("P_smooth", &study.smooth_rates);
}

#[test]
fn errors_of_the_map_fall_with_the_lower_of_both_exponents() {
    for result in study("linear", 3, 4).orders {
        let measured = result.rate.measured.expect("a range above rounding");
        assert!((measured - result.rate.expected).abs() < 0.1, "{result:?}");
    }
}

/// Six states, a stroboscopic section and a compliant stop: directions that only the quadratic
/// terms of the depth take into contact are left out, or no rate would be that of the orders.
#[test]
fn errors_fall_with_the_expected_exponents_for_three_masses_and_a_compliant_stop() {
    let study = study("three_masses", 3, 4);
    assert_rates("D", &study.discontinuity_rates);
    assert_rates("P_smooth", &study.smooth_rates);
    for result in study.orders {
        let measured = result.rate.measured.expect("a range above rounding");
        // The legs are linear in the states, so that a low degree may cost nothing.
        assert!(measured > result.rate.expected - 0.1, "{result:?}");
    }
}

#[test]
fn the_cheapest_orders_meet_the_tolerance_on_fresh_points() {
    let scene = scene("linear");
    let choice = choose_orders(&scene, &orbit(&scene), 1e-5).expect("a choice");
    assert!(choice.met && choice.fresh_error.is_some_and(|error| error <= 1e-5), "{choice:?}");
    assert!(choice.orders.smooth_order >= 2 && choice.orders.contact_weight <= 8, "{choice:?}");
    let hopeless = choose_orders(&scene, &orbit(&scene), 1e-30).expect("a choice");
    assert!(!hopeless.met, "{hopeless:?}");
}

fn jets_of(stage: &Stage) -> Vec<&Jet<f64>> {
    match stage {
        Stage::Leg(leg) => leg.image.iter().collect(),
        Stage::Flown(flown) => flown.polynomials().collect(),
        Stage::Contact(contact) => {
            let parts = contact.linear.iter().chain(&contact.quadratic);
            parts.chain([&contact.depth]).collect()
        }
    }
}

fn jets(map: &LocalMap) -> Vec<&Jet<f64>> {
    map.stages.iter().flat_map(jets_of).collect()
}

#[test]
fn a_truncated_expansion_is_the_expansion_at_the_lower_orders() {
    let (scene, orbit) = grazing("mems");
    let high = MapOrders { smooth_order: 5, contact_weight: 7 };
    let low = MapOrders { smooth_order: 3, contact_weight: 4 };
    let family = MapFamily::new(&scene, &orbit, high).expect("a simple graze");
    let cut = family.map(low).expect("smaller spaces");
    let direct = Expander::new(&scene, &orbit).expect("rigid").expand(low).expect("a simple graze");
    for (cut, direct) in jets(&cut).into_iter().zip(jets(&direct)) {
        assert_eq!(cut.coefficients().len(), direct.coefficients().len());
        for (powers, value) in direct.terms() {
            let degree: i32 = powers.iter().map(|&power| i32::from(power)).sum();
            let scale = direct.max_abs_of_degree(degree as usize).max(1.0);
            // Both jets of the flow are computed to a relative 1e-15 of their largest terms.
            assert!((cut.coefficient(powers) - value).abs() <= 1e-11 * scale, "{powers:?}");
        }
    }
}
