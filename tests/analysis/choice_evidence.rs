//! Requirements on a choice beyond a small error at most points: accuracy with two contacts in one
//! return, and the sign of the next depth.

use grazemap::analysis::{DirectEnd, DirectImage, FreeFlight, NoProgress, SectionChange};
use grazemap::convergence::{
    Choice, ChoiceOptions, Chooser, ExactImages, Limit, SamplePoint, choose, choose_sections,
    chosen_map,
};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::{EmitPrecision, Scene, Section, StroboscopicPhase};
use grazemap::numeric::{Dd, FloatFormat};
use grazemap::orbit::GrazingOrbit;

use crate::support::scenes::{self, grazing};
use crate::{UNUSED, exact};

fn stepped(map: &HornerMap, state: &[f64], parameters: &[f64]) -> Vec<f64> {
    let mut image = vec![0.0; map.dimension()];
    map.step(state, parameters, &mut image);
    image
}

/// Errors of a map, with the number of contacts that direct simulation in double-double finds.
fn errors(
    (scene, orbit): &(Scene, GrazingOrbit),
    map: &HornerMap,
    points: &[SamplePoint],
) -> Vec<(usize, f64)> {
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::<Dd>::new(&system, scene, orbit).expect("good input");
    let of = |point: &SamplePoint| {
        let truth = direct.image(&exact(&point.state), &exact(&point.parameters));
        let truth = truth.expect("good input");
        if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
            return None;
        }
        let image = stepped(map, &point.state, &point.parameters);
        let differences = image.iter().zip(&truth.offsets);
        let sizes = differences.map(|(&image, &truth)| (Dd::from(image) - truth).to_f64().abs());
        Some((truth.contacts, sizes.fold(0.0, f64::max)))
    };
    points.iter().filter_map(of).collect()
}

/// A uniform sample has hardly a point with both contacts, and there the second depth is least
/// accurate.
#[test]
fn a_choice_holds_where_two_passages_make_contact() {
    let scene = grazing("two_stops_t2_prestressed");
    let mut chooser = Chooser::new(&scene.0, &scene.1, 100).expect("points");
    let points = chooser.joint_points(UNUSED, 400);
    for tolerance in [1e-3, 1e-6] {
        let choice = chooser.choose(tolerance).expect("a choice");
        let (_, map) = chosen_map(&choice, &scene.0, &scene.1).expect("a simple graze");
        let found = errors(&scene, &map, &points);
        assert!(choice.met && found.len() >= 100, "{}", found.len());
        // A depth is placed by a map, to far less than the shallowest.
        assert!(found.iter().all(|&(contacts, _)| contacts == 2));
        let largest = found.iter().fold(0.0, |max: f64, point| max.max(point.1));
        // The largest of one sample exceeds that of another by a little.
        assert!(largest <= 1.1 * tolerance, "{tolerance:e}: {largest:e}");
    }
}

#[test]
fn points_with_two_contacts_are_asked_of_scenes_with_two_passages_alone() {
    let (scene, orbit) = grazing("linear");
    let chooser = Chooser::new(&scene, &orbit, 10).expect("points");
    assert!(chooser.joint_points(0, 100).is_empty());
}

/// Map chosen for a tolerance of a tenth of the window's depth: far too coarse for its dynamics to
/// be right by its error alone.
fn coarse(scene: &(Scene, GrazingOrbit)) -> (Choice, HornerMap) {
    let mut chooser = Chooser::new(&scene.0, &scene.1, 100).expect("points");
    let choice = chooser.choose(0.1 * scene.0.window.depth);
    let choice = choice.expect("a choice");
    let (_, map) = chosen_map(&choice, &scene.0, &scene.1).expect("a simple graze");
    (choice, map)
}

/// On these sections the depth of a point is its first offset, `h = delta − x`.
#[test]
fn near_a_codimension_two_point_a_coarse_choice_has_the_slope_of_the_next_depth() {
    for name in ["linear_codim2", "mems_codim2"] {
        let scene = grazing(name);
        let (choice, map) = coarse(&scene);
        let least = choice.least_orders.expect("xi_1 is 0 at the graze");
        assert!(choice.met && choice.orders.smooth_order >= 2 && choice.orders.contact_weight >= 3);
        assert!(least.linear.abs() < 1e-3 * least.quadratic.abs(), "{least:?}");
        let system = HybridSystem::new(&scene.0.model);
        let mut direct = DirectImage::<Dd>::new(&system, &scene.0, &scene.1).expect("good input");
        let zero = vec![0.0; scene.0.expansion.active.len()];
        for y in [0.3, 0.03].map(|share: f64| share * scene.0.window.depth.sqrt()) {
            let point = [y * y, 0.0];
            let truth = direct.image(&exact(&point), &exact(&zero)).expect("good input");
            let truth = truth.offsets[0].to_f64() / (y * y);
            let mapped = stepped(&map, &point, &zero)[0] / (y * y);
            // A choice must be within a tenth of the effect of the contact.
            assert!((mapped / truth - 1.0).abs() < 0.15, "{name}: {mapped}, {truth}");
        }
    }
}

#[test]
fn at_a_generic_graze_there_are_no_least_orders() {
    let (choice, _) = coarse(&grazing("linear"));
    assert_eq!(choice.least_orders, None);
}

#[test]
fn single_precision_would_do_for_a_coarse_map_and_not_for_a_fine_one() {
    let (scene, orbit) = grazing("linear");
    let mut chooser = Chooser::new(&scene, &orbit, 100).expect("points");
    let [coarse, fine] = [1e-4, 1e-9].map(|tolerance| {
        let choice = chooser.choose(tolerance).expect("a choice");
        choice.single_precision_error.expect("measured") / tolerance
    });
    // Offsets of a tenth have a rounding of 6e-9.
    assert!(coarse < 1.1 && fine > 3.0, "{coarse}, {fine}");
}

/// Errors of a map in single precision, at points that were not used for its choice.
fn single_error(scene: &(Scene, GrazingOrbit), map: &HornerMap, points: &[SamplePoint]) -> f64 {
    let exact = ExactImages::new(&scene.0, &scene.1, points.to_vec()).expect("points");
    let errors = exact.errors(&map.in_single());
    errors.into_iter().fold(0.0, f64::max)
}

#[test]
fn any_precision_is_single_for_a_coarse_tolerance_and_double_for_a_fine_one() {
    let (mut scene, orbit) = grazing("linear");
    scene.emit.precision = EmitPrecision::Any;
    let mut chooser = Chooser::new(&scene, &orbit, 200).expect("points");
    let points = chooser.points(UNUSED, 400);
    for (tolerance, precision) in [
        (1e-3, FloatFormat::F32),
        (1e-6, FloatFormat::F32),
        (5e-9, FloatFormat::F64),
        (1e-12, FloatFormat::F64),
    ] {
        let choice = chooser.choose(tolerance).expect("a choice");
        assert!(choice.met && choice.precision == precision, "{choice:?}");
        if precision == FloatFormat::F32 {
            let (_, map) = chosen_map(&choice, &scene, &orbit).expect("a simple graze");
            let found = single_error(&(scene.clone(), orbit.clone()), &map, &points);
            // The largest error of one sample exceeds that of another by a little.
            assert!(found <= 1.1 * tolerance, "{tolerance:e}: {found:e}");
        }
    }
}

/// Offsets of a twentieth are rounded by 2e-9 at input and at output.
#[test]
fn single_precision_is_refused_where_rounding_prevents_it_and_says_how_near_it_came() {
    let (mut scene, orbit) = grazing("linear");
    scene.emit.precision = EmitPrecision::Given(FloatFormat::F32);
    let mut chooser = Chooser::new(&scene, &orbit, 100).expect("points");
    let choice = chooser.choose(1e-12).expect("a choice");
    assert!(!choice.met && choice.precision == FloatFormat::F32);
    assert_eq!(choice.limit, Some(Limit::Rounding));
    let nearest = choice.error.expect("finite");
    assert!((2e-9..5e-8).contains(&nearest), "{nearest:e}");
    // Just above that it is met, by orders that are judged in single precision.
    let met = chooser.choose(3.0 * nearest).expect("a choice");
    assert!(met.met && met.precision == FloatFormat::F32, "{met:?}");
    let (_, map) = chosen_map(&met, &scene, &orbit).expect("a simple graze");
    let fresh = chooser.points(128, 100);
    assert_eq!(Some(single_error(&(scene.clone(), orbit.clone()), &map, &fresh)), met.fresh_error);
}

/// Both windows contain the same orbits: the free flow carries a point from one section to the
/// other.
#[test]
fn a_point_carried_to_another_section_has_the_image_carried_along() {
    let (scene, orbit) = grazing("linear");
    let mut other = scene.clone();
    other.section = Section::Stroboscopic(StroboscopicPhase::At(Dd::from(5.0)));
    let moved = scenes::orbit(&other);
    let system = HybridSystem::new(&scene.model);
    let (here, there) = ((&scene, &orbit), (&other, &moved));
    let mut change = SectionChange::<Dd>::new(&system, here, there).expect("good input");
    let mut back = SectionChange::<Dd>::new(&system, there, here).expect("good input");
    let flight = |scene, orbit| FreeFlight::<Dd>::new(&system, scene, orbit).expect("good input");
    let (mut at_own, mut at_other) = (flight(&scene, &orbit), flight(&other, &moved));
    let parameters = exact(&[1e-3, -1e-3]);
    for state in [[1e-3, 0.02], [-1e-3, -0.03]].map(|state| exact(&state)) {
        let carry = |change: &mut SectionChange<'_, Dd>, state: &[Dd]| {
            let carried = change.carry(state, &parameters).expect("good input");
            carried.expect("a section point")
        };
        let carried = carry(&mut change, &state);
        let mapped = at_own.smooth(&state, &parameters).expect("good input");
        let expected = carry(&mut change, &mapped.expect("a return"));
        let found = at_other.smooth(&carried, &parameters).expect("good input");
        let returned = carry(&mut back, &carried);
        let found = found.expect("a return");
        // Flights in double-double are good to some 28 digits.
        for (found, expected) in found.iter().chain(&returned).zip(expected.iter().chain(&state)) {
            assert!((*found - *expected).to_f64().abs() < 1e-24, "{found:?} {expected:?}");
        }
    }
}

#[test]
fn maps_of_other_sections_are_chosen_for_the_same_tolerance() {
    let (scene, orbit) = grazing("linear");
    let options = ChoiceOptions { tolerance: 1e-5, fresh: 100 };
    let own = choose(&scene, &orbit, &options).expect("a choice");
    let sections = choose_sections(&scene, &orbit, &options, &own, &NoProgress).expect("points");
    // The tangency section is the scene's own.
    let ahead: Vec<_> = sections.iter().map(|section| section.ahead).collect();
    assert_eq!(ahead, [0.0, 0.125, 0.25, 0.5].map(Some));
    for section in &sections {
        let choice = section.choice.as_ref().expect("a map");
        assert!(choice.met && choice.fresh_points > 50, "{section:?}");
    }
}
