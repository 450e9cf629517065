//! Branches of direct simulation where derivatives decide: next to grazes, on orbits that shrink, and
//! where the only start is a mirror image.

use std::f64::consts::TAU;

use grazemap::analysis::NoProgress;
use grazemap::analysis::branches::{BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches};
use grazemap::analysis::periodic::{ContactItinerary, FoundOrbit};
use grazemap::prelude::{FindGraze, Map, Scene};

use crate::support::scenes::{parsed, scene_with};

/// A scene that came from outside.
fn outside(name: &str, set: &[(&str, &str)]) -> Scene {
    let path = format!("tests/data/outside/{name}.toml");
    let text = std::fs::read_to_string(path).expect("a scene");
    parsed(&text, name, set)
}

fn map_of(scene: Scene) -> Map {
    scene.graze().and_then(|graze| graze.map()).expect("a map")
}

/// The branches of some itineraries in the first active parameter.
fn branches(map: &Map, itineraries: &[&str], range: [f64; 2], direct: bool) -> Branches {
    let passages = map.local().passages();
    let parse = |digits: &&str| ContactItinerary::parse(digits, passages).expect("digits");
    let itineraries: Vec<ContactItinerary> = itineraries.iter().map(parse).collect();
    let request = BranchRequest {
        longest: itineraries.iter().map(ContactItinerary::period).max().unwrap_or(1),
        itineraries,
        along: 0,
        range,
        at: vec![0.0; map.local().parameters.len()],
        direct,
        starts: Vec::new(),
    };
    map.branches(&request, &NoProgress).expect("branches")
}

fn points(found: &Branches) -> impl Iterator<Item = &BranchPoint> {
    found.branches.iter().flat_map(|branch| &branch.points)
}

fn labelled(found: &Branches, label: BranchLabel) -> Vec<&FoundOrbit> {
    let has =
        |point: &&BranchPoint| point.special.as_ref().is_some_and(|special| special.label == label);
    points(found).filter(has).map(|point| &point.orbit).collect()
}

/// The product of all multipliers.
fn determinant(orbit: &FoundOrbit) -> f64 {
    let product = orbit
        .multipliers
        .iter()
        .fold([1.0, 0.0], |[a, b], [re, im]| [a * re - b * im, a * im + b * re]);
    product[0]
}

/// A linear oscillator contracts volumes by `2 zeta`, and a hit at the surface `v dv dtheta` by
/// `r^2`: the determinant is `exp(-2 zeta T) r^(2 hits)` for an orbit of the time `T`.
#[test]
fn determinants_of_random_oscillators_are_the_product_of_contractions() {
    let mut seed = 20_u64;
    let mut random = |[from, to]: [f64; 2]| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut cases = vec![(0.01, 0.9, 2.7, "10")];
    for itinerary in ["1", "10", "1"] {
        let omega = random([1.3, 3.0]);
        cases.push((random([0.01, 0.1]), random([0.6, 0.95]), omega, itinerary));
    }
    for (zeta, restitution, omega, itinerary) in cases {
        let [z, r, w] = [zeta, restitution, omega].map(|value| format!("{value:?}"));
        let guess = "{ x = 1.0, v = 0.0, theta = 3.1 }";
        let set = [("zeta", &*z), ("r", &*r), ("omega", &*w), ("grazing.guess", guess)];
        let map = map_of(scene_with("linear", &set));
        let found = branches(&map, &[itinerary], [-0.3, 0.3], true);
        let mut count = 0;
        for BranchPoint { orbit, .. } in points(&found) {
            // A multiplier that is infinite at the graze takes digits from the other.
            let Some([re, im]) = orbit.multipliers.first() else { continue };
            if re.hypot(*im) > 1e3 {
                continue;
            }
            let hits = orbit.contacts.len() + orbit.extra_contacts;
            let time = TAU / omega * orbit.itinerary.period() as f64;
            let expected = (-2.0 * zeta * time).exp() * restitution.powi(2 * hits as i32);
            let error = (determinant(orbit) / expected - 1.0).abs();
            assert!(error < 1e-6, "{zeta} {restitution} {omega} {itinerary}: {error:e} {orbit:?}");
            count += 1;
        }
        let is_there = itinerary == "1" || restitution == 0.9;
        assert!(count > 20 || !is_there, "{zeta} {restitution} {omega} {itinerary}: {count}");
    }
}

/// A spring alone is met without a jump of the field: multipliers go on through the graze, by exact
/// matrix exponentials (the head of the scene), and no special point is there.
#[test]
fn a_spring_has_its_flips_alone_and_multipliers_at_its_grazes() {
    let map = map_of(outside("f05_soft_graze_labels", &[]));
    let found = branches(&map, &["1", "10"], [-0.01, 0.15], true);
    assert_eq!(labelled(&found, BranchLabel::SaddleNode).len(), 0);
    let of_one = |orbit: &&&FoundOrbit| orbit.itinerary.period() == 1;
    let flips = labelled(&found, BranchLabel::PeriodDoubling);
    let mut flips: Vec<f64> = flips.iter().filter(of_one).map(|o| o.parameters[0]).collect();
    flips.sort_by(f64::total_cmp);
    // To the digits of the head of the scene.
    assert_eq!(flips.len(), 2, "{flips:?}");
    assert!((flips[0] - 1.05633e-4).abs() < 1e-9 && (flips[1] - 0.1139129).abs() < 1e-7);
    let grazes = labelled(&found, BranchLabel::Graze);
    let at = |orbit: &&&FoundOrbit| (orbit.parameters[0] - 1.463_400_386_82e-4).abs() < 1e-12;
    let mut grazes = grazes.iter().filter(at).peekable();
    assert!(grazes.peek().is_some());
    for orbit in grazes {
        let fastest = orbit.contacts.iter().fold(0.0_f64, |most, c| most.max(c.speed));
        assert!((fastest - 0.045_238_194_566_3).abs() < 1e-11, "{orbit:?}");
        for ([re, _], expected) in orbit.multipliers.iter().zip([-1.192_481_401, -0.613_004_448_3])
        {
            assert!((re - expected).abs() < 1e-8, "{orbit:?}");
        }
    }
}

/// The cycle of the relief valve shrinks to its equilibrium at the Hopf point of the closed form.
#[test]
fn a_branch_of_an_autonomous_system_ends_at_its_hopf_point() {
    let map = map_of(outside("f06_relief_valve_branches", &[]));
    let found = branches(&map, &["0"], [-1.2, 1.2], true);
    let free = found.branches.iter().filter(|branch| branch.itinerary.to_string() == "0");
    let [branch] = free.collect::<Vec<_>>()[..] else { panic!("one branch without contact") };
    assert!(branch.ends.contains(&BranchEnd::Hopf), "{:?}", branch.ends);
    let [hopf] = labelled(&found, BranchLabel::Hopf)[..] else { panic!("one Hopf point") };
    let value = map.parameter("q").expect("a parameter") + hopf.parameters[0];
    assert!((value - 8.491_117_635_183_34).abs() < 1e-13, "{value}");
    let special = points(&found).filter_map(|point| point.special.as_ref());
    let frequency = special.filter(|s| s.label == BranchLabel::Hopf).find_map(|s| s.coefficient);
    assert!((frequency.expect("a frequency") - 3.090_708_847_974_34).abs() < 1e-12);
    // Of a supercritical Hopf point the multiplier grows to 1 from below, and nothing turns.
    for point in &branch.points {
        let label = point.special.as_ref().map(|special| special.label);
        assert!(label.is_none_or(|l| [BranchLabel::Graze, BranchLabel::Hopf].contains(&l)));
        if label.is_some() {
            continue;
        }
        assert!(point.orbit.multipliers[0][0] < 1.0, "{:?}", point.orbit);
    }
}

/// The fold of COCO's example 15.2 (Recipes for Continuation), `x'' + 0.1 x' + x = A cos t` with the
/// restitution 0.8, by the closed form of an orbit with one impact.
#[test]
fn the_fold_of_an_oscillator_at_its_resonance_is_that_of_the_closed_form() {
    let guess = "{ x = 1.0, v = 0.0, theta = 1.57 }";
    let set = [("alpha", "0.1"), ("omega", "1.0"), ("grazing.guess", guess)];
    let map = map_of(scene_with("linear", &set));
    let found = branches(&map, &["1"], [-1e-4, 1e-4], true);
    let [fold] = labelled(&found, BranchLabel::SaddleNode)[..] else { panic!("one fold") };
    let value = map.parameter("alpha").expect("a parameter") + fold.parameters[0];
    // To the digits given.
    assert!((value - 0.099_970_753_628_313_3).abs() < 1e-15, "{value}");
    assert!((fold.contacts[0].speed - 0.004_111_530_643_95).abs() < 1e-13, "{fold:?}");
    assert!((determinant(fold) - 0.341_432_378_3).abs() < 1e-9, "{fold:?}");
}

/// Both walls of a symmetric rattler are alike: 01 is the mirror image of 10.
#[test]
fn the_mirror_image_of_an_orbit_has_its_branch() {
    let set = [("expansion.smooth_order", "3"), ("expansion.contact_weight", "4")];
    let map = map_of(outside("n02_two_mass_rattler", &set));
    let found = branches(&map, &["10", "01"], [-1e-4, 1e-4], true);
    let of = |digits: &str| {
        let branches = found.branches.iter();
        let mine = branches.filter(|branch| branch.itinerary.to_string() == digits);
        mine.flat_map(|branch| &branch.points).find(|point| point.special.is_none())
    };
    assert!(of("10").is_some() && of("01").is_some(), "{:?}", found.branches.len());
}

/// The window is a thousandth of this range: what the map has there is found.
#[test]
fn a_branch_of_the_map_is_found_where_the_range_is_wide() {
    let map = map_of(scene_with::<&str, &str>("linear", &[]));
    let found = branches(&map, &["1"], [-2.0, 2.0], false);
    let narrow = branches(&map, &["1"], [-1e-3, 1e-3], false);
    let grazes = labelled(&found, BranchLabel::Graze);
    assert!(grazes.iter().any(|orbit| orbit.parameters[0].abs() < 1e-14), "{grazes:?}");
    assert!(!narrow.branches.is_empty());
}
