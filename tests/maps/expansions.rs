//! Expansions on several sections, compared with each other by independent routes and with closed
//! forms.

use std::collections::HashSet;

use grazemap::analysis::MapEvaluation;
use grazemap::expansion::{Expander, ExpansionError, LocalMap, MapOrders, Stage};
use grazemap::model::Scene;
use grazemap::numeric::Dd;

use crate::support::scenes::{NONE, grazing, orbit, parsed, scene_with, text};
use crate::support::stages::{fly, image};

fn expand(scene: &Scene, smooth_order: u32, contact_weight: u32) -> LocalMap {
    let orbit = orbit(scene);
    let orders = MapOrders { smooth_order, contact_weight };
    Expander::new(scene, &orbit).expect("rigid").expand(orders).expect("an expansion")
}

/// The section a quarter period from the graze sees the same dynamics as the one at the graze:
/// flying to the other section and mapping there commutes with mapping here and flying after.
#[test]
fn maps_on_two_stroboscopic_sections_are_conjugate() {
    let phases = [("section.kind", "stroboscopic")];
    let at_graze = expand(&scene_with("linear", &phases), 9, 12);
    let elsewhere = [phases[0], ("section.phase", "1.5")];
    let far = expand(&scene_with("linear", &elsewhere), 9, 12);
    let Stage::Leg(to_graze) = &far.stages[0] else { panic!("a leg leads to the graze") };
    let parameters = [2e-3, -1e-3];
    let start = [4e-3, 3e-3];
    let mut here = start.to_vec();
    fly(to_graze, &mut here, &parameters);
    let (mapped_here, depth) = image(&at_graze, &here, &parameters);
    let (mut mapped_far, _) = image(&far, &start, &parameters);
    fly(to_graze, &mut mapped_far, &parameters);
    assert!(depth > 0.03, "the point makes contact: {depth}");
    for (a, b) in mapped_here.iter().zip(&mapped_far) {
        // Both maps are cut at weights above 12; depths of 0.06 leave 1e-15.
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
fn composed_form_agrees_with_the_stages_to_its_order() {
    let (scene, orbit) = grazing("mems");
    let expander = Expander::new(&scene, &orbit).expect("rigid");
    let map = expander.expand(MapOrders { smooth_order: 8, contact_weight: 9 }).expect("expansion");
    let composed = expander.compose(&map).expect("a small space");
    let errors = [0.04_f64, 0.02].map(|y| {
        let (state, parameters) = ([y * y, 3.0 * y * y], [0.5 * y * y, -y * y]);
        let (truth, depth) = image(&map, &state, &parameters);
        let point = [state, parameters].concat();
        let value = |i: usize| composed.image[i].evaluate(&[depth], &point);
        (0..2).map(|i| (value(i) - truth[i]).abs()).fold(0.0, f64::max)
    });
    // The composed form is cut at weight 9: its error falls as the tenth power of y.
    let rate = (errors[0] / errors[1]).log2();
    assert!((rate - 10.0).abs() < 0.5, "rate {rate} of {errors:?}");
}

#[test]
fn composed_form_of_two_passages_agrees_with_the_stages_to_its_order() {
    let (scene, orbit) = grazing("two_stops_t1");
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let orders = MapOrders { smooth_order: 6, contact_weight: 7 };
    let map = expander.expand(orders).expect("an expansion");
    let composed = expander.compose(&map).expect("a small space");
    assert_eq!(map.surfaces, ["right", "left"]);
    let (mut patterns, mut sums) = (HashSet::new(), [0.0_f64; 2]);
    for number in 1..=60 {
        let share = |k: i32| (f64::from(number) * 0.754_877_67_f64.powi(k)).fract() - 0.5;
        for (sum, y) in sums.iter_mut().zip([0.04_f64, 0.02]) {
            let offset = |k: i32| Dd::from(share(k) * y * y);
            let (state, parameters) = ([1, 2, 3, 4].map(offset), [5, 6].map(offset));
            let stages = MapEvaluation::<Dd>::new(&map).image(&state, &parameters);
            let one_pass = MapEvaluation::<Dd>::composed(&composed).image(&state, &parameters);
            let made =
                |depths: &[Dd]| -> Vec<bool> { depths.iter().map(|u| *u > Dd::ZERO).collect() };
            assert_eq!(made(&stages.depths), made(&one_pass.depths));
            patterns.insert(made(&stages.depths));
            let pairs = stages.offsets.iter().zip(&one_pass.offsets);
            *sum += pairs.map(|(&a, &b)| (a - b).to_f64().powi(2)).sum::<f64>();
        }
    }
    // Contact at neither stop, at one of them, at both.
    assert_eq!(patterns.len(), 4);
    // Kicks of a relaxed spring are O(y³): every depth stays O(y²), and what is cut is O(y⁸).
    let rate = 0.5 * (sums[0] / sums[1]).log2();
    assert!((rate - 8.0).abs() < 0.5, "rate {rate} of {sums:?}");
}

#[test]
fn few_digits_are_lost_in_the_catalogue() {
    for name in ["linear", "mems", "mems_scenario3", "cantilever_1_7"] {
        let (scene, orbit) = grazing(name);
        let orders = MapOrders { smooth_order: 3, contact_weight: 6 };
        let lost =
            Expander::new(&scene, &orbit).expect("rigid").lost_digits(orders).expect("both ways");
        for digits in lost.smooth.iter().chain(&lost.discontinuity) {
            assert!(*digits < 4.0, "{name}: {lost:?}");
        }
    }
}

#[test]
fn a_reset_that_moves_a_touching_state_is_refused() {
    let text = text("linear").replace("v = \"-r*v\"", "v = \"0.01 - r*v\"");
    let scene = parsed(&text, "linear", &NONE);
    let orbit = orbit(&scene);
    let error =
        Expander::new(&scene, &orbit).expect("rigid").contact(0, 3).expect_err("not an identity");
    assert!(matches!(error, ExpansionError::ResetNotIdentityAtTangency { .. }), "{error}");
}

#[test]
fn orders_too_large_for_memory_are_refused_before_allocating() {
    let (scene, orbit) = grazing("mems");
    let expander = Expander::new(&scene, &orbit).expect("rigid");
    let error = expander.legs(60).expect_err("too large");
    assert!(error.to_string().contains("coefficient products"), "{error}");
}
