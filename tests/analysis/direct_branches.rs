//! Branches of direct simulation in cases that depend on derivatives: near grazes, on orbits that
//! shrink, and with a mirror image as the only start.

use std::f64::consts::TAU;

use grazemap::analysis::basin::BasinRequest;
use grazemap::analysis::branches::{
    Branch, BranchEnd, BranchLabel, BranchObservable, BranchPoint, BranchRequest, Branches,
    observed,
};
use grazemap::analysis::periodic::{ContactItinerary, FoundOrbit};
use grazemap::analysis::{MotionEvents, NoProgress, TimeSeriesRequest, escape_bounds};
use grazemap::numeric::Dd;
use grazemap::pipeline::{SafeKeys, Source};
use grazemap::prelude::{FindGraze, Map, Scene};
use grazemap::report::PictureForm;
use xtask::independent::{self, Simulator};

use crate::support::exact_flight::Oscillator;
use crate::support::foale::Foale;
use crate::support::scenes::{NONE, outside_text, parsed, scene_with};

/// A scene that came from outside.
fn outside(name: &str, set: &[(&str, &str)]) -> Scene {
    parsed(&outside_text(name), name, set)
}

/// A scene of a test.
fn scene_of(text: &str) -> Scene {
    parsed::<&str, &str>(text, "test", &[])
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
            let time = TAU / omega * f64::from(orbit.itinerary.period() as i32 + orbit.turns);
            let expected = (-2.0 * zeta * time).exp() * restitution.powi(2 * hits as i32);
            let error = (determinant(orbit) / expected - 1.0).abs();
            assert!(error < 1e-6, "{zeta} {restitution} {omega} {itinerary}: {error:e} {orbit:?}");
            count += usize::from(orbit.itinerary.to_string() == itinerary);
        }
        // Orbits of the closed form that pass the stop in between are none.
        let alpha = map.parameter("alpha").expect("a parameter");
        let oscillator = Oscillator { zeta, alpha, omega, stop: 1.0, r: restitution };
        let is_there = (1..=400).any(|number| {
            let (speed, time) = (5e-3 * f64::from(number), TAU / omega * itinerary.len() as f64);
            let [amplitude, theta] = oscillator.one_impact(speed, time);
            let here = Oscillator { alpha: amplitude, ..oscillator };
            let (_, apart, impacts) = here.periodic([theta, speed], time);
            let returns = 1 + here.maxima([1.0, -restitution * speed, theta], time);
            (amplitude - alpha).abs() < 0.3
                && apart < 1e-9
                && (impacts.len(), returns) == (1, itinerary.len())
        });
        assert_eq!(count > 20, is_there, "{zeta} {restitution} {omega} {itinerary}: {count}");
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
    // At a supercritical Hopf point the multiplier grows to 1 from below, and the branch does not
    // turn.
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

/// The undamped oscillator `x'' + x = cos(2.8 t)` with a hard obstacle: numbers of the closed form in
/// the head of the scene. Its orbit with one impact in two periods has them far from the graze.
#[test]
fn the_undamped_oscillator_has_the_fold_and_the_flip_of_its_closed_form() {
    let map = map_of(outside("undamped", &[]));
    let found = branches(&map, &["1"], [0.1, 3.0], true);
    let grazing = map.parameter("sigma").expect("a parameter");
    for (label, sigma, share) in [
        (BranchLabel::SaddleNode, 2.941_695_055_982_3, None),
        (BranchLabel::PeriodDoubling, 0.293_916_874_111_08, Some(2.078_571_562_6)),
    ] {
        let all = labelled(&found, label);
        let is_there = all.iter().find(|orbit| {
            let near = (grazing + orbit.parameters[0] - sigma).abs() < 1e-12;
            near && orbit.contacts.len() == 1 && orbit.itinerary.period() as i32 + orbit.turns == 2
        });
        let at = || all.iter().map(|orbit| grazing + orbit.parameters[0]).collect::<Vec<_>>();
        let orbit = is_there.unwrap_or_else(|| panic!("{label:?} {sigma}: {:?}", at()));
        let speed = orbit.contacts[0].speed / sigma;
        // To the digits given.
        assert!(share.is_none_or(|share| (speed - share).abs() < 1e-9), "{orbit:?}");
    }
}

/// Next to a resonance of a linear oscillator the fold and the flip of its orbit with one impact lie
/// at squares of the distance from it (arXiv 2602.22797): their coefficients by closed form.
#[test]
fn folds_and_flips_next_to_a_resonance_lie_at_the_squares_of_the_closed_form() {
    let resonance = 1.997_498_435_543_8;
    for (r, fold, flip) in [("0.8", 33.98688, 2.443565), ("0.9", 71.06771, 2.443808)] {
        let cases =
            [(BranchLabel::SaddleNode, -1.0, -fold), (BranchLabel::PeriodDoubling, 1.0, flip)];
        for (label, side, expected) in cases {
            let coefficient = |distance: f64| {
                let omega = format!("{:?}", resonance + side * distance);
                let map = map_of(outside("resonant_graze", &[("omega", &*omega), ("r", r)]));
                let reach = 6.0 * f64::abs(expected) * distance * distance;
                let found = branches(&map, &["1"], [-reach, reach], true);
                let [orbit] = labelled(&found, label)[..] else { panic!("{label:?} {omega} {r}") };
                let grazing = map.parameter("F").expect("a parameter");
                orbit.parameters[0] / grazing / (distance * distance)
            };
            // The next term goes with the distance itself: of the one after it 2e-6 is left.
            let found = 2.0 * coefficient(1e-4) - coefficient(2e-4);
            assert!((found / expected - 1.0).abs() < 1e-5, "{label:?} {r}: {found} {expected}");
        }
    }
}

/// `x'' = -k x - g x' + F cos t`, `k = (n/2)^2 + g^2/4`, stop at 1, without loss at impacts: the flip of
/// the orbit with one impact a period by its closed form.
#[test]
fn an_elastic_hard_stop_has_the_flip_of_its_closed_form() {
    let text = "[model]\nstates = [\"x\", \"v\"]\n\
                parameters = { n = 2.3556, g = 0.062, F = 0.4, r = 1.0 }\n\
                [model.phase]\nname = \"theta\"\nrate = \"1\"\nperiod = \"2*pi\"\n\
                [model.flow]\nx = \"v\"\nv = \"F*cos(theta) - g*v - ((n/2)^2 + g^2/4)*x\"\n\
                [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\nimpact = { v = \"-r*v\" }\n\
                [grazing]\nsurface = \"stop\"\nsolve_for = \"F\"\n\
                [expansion]\nactive = [\"F\"]\n";
    let map = map_of(parsed(text, "elastic", &[("F", "0.4")]));
    let grazing = map.parameter("F").expect("a parameter");
    assert!((grazing - 0.393_094_047_347_891).abs() < 1e-14, "{grazing}");
    let found = branches(&map, &["1"], [-0.2, 0.6], true);
    let flips = labelled(&found, BranchLabel::PeriodDoubling);
    let at = |orbit: &&&FoundOrbit| {
        ((grazing + orbit.parameters[0]) / grazing - 2.032_101_146_714_26).abs() < 1e-13
    };
    let orbit = flips.iter().find(at).unwrap_or_else(|| panic!("{flips:?}"));
    assert!((orbit.contacts[0].speed - 0.775_500_482_484).abs() < 1e-11, "{orbit:?}");
}

/// An oscillator with little damping: traces of its orbits with one impact by Foale's closed form,
/// those without a free maximum in between among them.
#[test]
fn orbits_with_one_impact_have_the_traces_of_the_closed_form_far_from_their_graze_and_next_to_it() {
    let set = [("zeta", "0.01"), ("r", "0.9"), ("omega", "2.7")];
    let map = map_of(scene_with("linear", &set));
    let found = branches(&map, &["1", "10"], [-0.3, 1.2], true);
    let [omega, zeta, r] = ["2.7", "0.01", "0.9"].map(|d| Dd::from_decimal(d).expect("a number"));
    let (mut count, mut deep) = (0, 0);
    for BranchPoint { orbit, .. } in points(&found) {
        let ([contact], false) = (&orbit.contacts[..], orbit.multipliers.is_empty()) else {
            continue;
        };
        let periods = orbit.itinerary.period() as i32 + orbit.turns;
        if orbit.extra_contacts > 0 {
            continue;
        }
        let form = Foale::new(omega, zeta, r, periods as usize);
        let expected = form.trace(Dd::from(contact.speed)).to_f64();
        let trace: f64 = orbit.multipliers.iter().map(|[re, _]| re).sum();
        // The trace grows with the reciprocal of the speed, whose rounding is a share of its own.
        let error = (trace - expected).abs() / expected.abs().max(1.0);
        let least = 1e-6 + 1e-11 / contact.speed;
        assert!(error < least, "{error:e} {trace} {expected}: {orbit:?}");
        count += 1;
        // Multipliers -4.41 and -0.167.
        deep += usize::from(periods == 2 && (-4.7..-4.4).contains(&trace));
    }
    assert!(count > 50 && deep > 0, "{count} {deep}");
}

/// Differences of the trace and of the determinant of an orbit's multipliers from those of a matrix
/// whose columns are derivatives in a direction.
fn multiplier_errors(orbit: &FoundOrbit, column: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let ([a, c], [b, d]) = (column([1.0, 0.0]), column([0.0, 1.0]));
    let trace: f64 = orbit.multipliers.iter().map(|[re, _]| re).sum();
    [trace - (a + d), determinant(orbit) - (a * d - b * c)]
}

/// The state of `x'' = A cos θ − 2 ζ x' − x − κ x³` before a time, by Runge and Kutta's method.
fn flown_back(
    [x, v, theta]: [f64; 3],
    [zeta, kappa, force, omega]: [f64; 4],
    time: f64,
) -> [f64; 3] {
    let steps = 4000;
    let h = -time / f64::from(steps);
    let rates = |[x, v, theta]: [f64; 3]| {
        [v, force * theta.cos() - 2.0 * zeta * v - x - kappa * x.powi(3), omega]
    };
    let add = |a: [f64; 3], b: [f64; 3], by: f64| std::array::from_fn(|n| a[n] + by * b[n]);
    (0..steps).fold([x, v, theta], |at, _| {
        let first = rates(at);
        let second = rates(add(at, first, 0.5 * h));
        let third = rates(add(at, second, 0.5 * h));
        let fourth = rates(add(at, third, h));
        let sum = |n: usize| first[n] + 2.0 * (second[n] + third[n]) + fourth[n];
        std::array::from_fn(|n| at[n] + h / 6.0 * sum(n))
    })
}

/// A stop with a spring and a damper: multipliers next to impacts of no speed and far from them.
#[test]
fn orbits_at_a_stop_with_a_damper_have_the_multipliers_of_an_independent_integration() {
    let name = "n01_duffing_spring_damper";
    let map = map_of(outside(name, &[]));
    let grazing = map.parameter("A").expect("a parameter");
    let point: Vec<f64> = map.orbit().section_point.iter().map(|x| x.to_f64()).collect();
    let found = branches(&map, &["1"], [-0.05, 0.3], true);
    let text = outside_text(name);
    for label in [BranchLabel::SaddleNode, BranchLabel::PeriodDoubling] {
        assert_eq!(labelled(&found, label).len(), 0, "{label:?} at a graze");
    }
    let with_contact = |point: &&BranchPoint| {
        let contacts = &point.orbit.contacts;
        contacts.len() == 1 && contacts[0].speed > 1e-4
    };
    let all: Vec<_> = points(&found).filter(with_contact).collect();
    let slowest = all.iter().map(|point| point.orbit.contacts[0].speed).fold(1.0, f64::min);
    assert!(all.len() > 20 && slowest < 0.01, "{} {slowest}", all.len());
    for BranchPoint { orbit, .. } in all.iter().step_by(all.len() / 6) {
        let force = grazing + orbit.parameters[0];
        let oscillator = independent::Oscillator::read(&text, &[("A", force)]).expect("a scene");
        let section = [point[0] + orbit.states[0][0], 0.0, point[2] + orbit.states[0][1]];
        // A quarter of a period before the section nothing is in contact.
        let start = flown_back(section, [0.05, 0.5, force, 1.2], 0.25 * TAU / 1.2);
        let time = (Dd::PI + Dd::PI) / Dd::from_decimal("1.2").expect("a number");
        let after = |moved: [f64; 2]| {
            let mut simulator = Simulator::<Dd>::new(&oscillator, &oscillator.values(), 0.05);
            let at = [start[0] + moved[0], start[1] + moved[1], start[2]].map(Dd::from);
            simulator.place(&at);
            simulator.advance(time).expect("a period");
            [simulator.state[0], simulator.state[1]]
        };
        let step = 2.0_f64.powi(-30);
        // The start is known to 1e-12; second derivatives are of the order of the reciprocal speed.
        let errors = multiplier_errors(orbit, |direction| {
            let [up, down] = [step, -step].map(|by| after(direction.map(|part| part * by)));
            [0, 1].map(|n| (up[n] - down[n]).to_f64() / (2.0 * step))
        });
        assert!(errors.iter().all(|error| error.abs() < 1e-6), "{errors:?} {orbit:?}");
    }
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
    // Both end at the same graze, whichever passage makes the contact.
    let ends = found.branches.iter().filter(|branch| branch.ends.contains(&BranchEnd::Graze));
    let ends = ends.flat_map(|branch| [branch.points.first(), branch.points.last()]).flatten();
    let grazes = ends.filter(|point| {
        point.orbit.contacts.len() == 1 && point.orbit.contacts[0].speed.abs() < 1e-6
    });
    let offsets: Vec<f64> = grazes.map(|point| point.orbit.parameters[0]).collect();
    assert!(offsets.len() >= 2 && offsets.iter().all(|at| at.abs() < 1e-15), "{offsets:?}");
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

/// Hardening stops: on the tangency section one coordinate of the orbit with one contact stays
/// within `1e-10` of the graze, less than the accuracy of a section point that simulation settles
/// on. That orbit traversed twice or thrice is no orbit of its own.
#[test]
fn an_orbit_traversed_several_times_is_listed_once() {
    for (scene, contact) in [("soft_b", "free - k2*d^2"), ("soft_a", "free - k2*d^3")] {
        let set =
            [("model.surface.0.contact.v", contact), ("model.surface.0.release", "sigma - u")];
        let map = Source::Scene(Box::new(scene_with(scene, &set)));
        let map = map.free_flight().expect("a free flight");
        let found = branches(&map, &["1", "11", "111"], [-1e-5, 4e-5], true);
        let mut listed: Vec<String> =
            found.branches.iter().map(|branch| branch.itinerary.to_string()).collect();
        listed.sort_unstable();
        assert_eq!(listed, ["0", "1"], "{scene}");
    }
}

/// The attractor with an impact beside a motion that is clear of the stop begins at the fold of the
/// closed form; the motion without impacts ends at the graze.
#[test]
fn safety_tells_from_which_fold_an_attractor_exists() {
    let scene = scene_with("linear", &[("alpha", "2.0")]);
    let value = |name: &str| {
        let mut parameters = scene.model.parameters.iter();
        parameters.find(|parameter| parameter.name == name).expect("a parameter").value
    };
    let fold = Foale::unfolded(value, 0.0, 1).fold().to_f64();
    let keys = SafeKeys { points: 6, ..SafeKeys::default() };
    let mut answer = keys.answer(&scene, &NoProgress).expect("an answer");
    let document: serde_json::Value = serde_json::from_str(&answer.document).expect("a document");
    let attractors = document["attractors"].as_array().expect("a list");
    let hits = attractors.iter().find(|attractor| attractor["orbit"] == "(1,1)");
    let hits = hits.expect("an attractor with an impact");
    assert!(hits["from"]["label"] == "SN" && hits["to"]["label"].is_null(), "{hits}");
    let from = hits["from"]["value"].as_f64().expect("a number");
    assert!((from / fold - 1.0).abs() < 1e-9, "{from} {fold}");
    let names: Vec<String> = answer
        .files(&PictureForm::default())
        .expect("drawn")
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    for name in ["safe.svg", "safe.html", "safe_attractors.csv"] {
        assert!(names.iter().any(|found| found == name), "{names:?}");
    }
    let many = SafeKeys { points: 1001, ..SafeKeys::default() }.answer(&scene, &NoProgress);
    let message = many.expect_err("refused").to_string();
    assert_eq!(message, "points must be from 0 to 1000, found 1001");
}

/// Both maxima of a period lie on the tangency section, and each is a point of its own there: they
/// are one motion, whose hits have the speeds 0.915020 and 1.884269.
#[test]
fn a_motion_with_two_section_points_is_one_attractor() {
    let scene = scene_with("two_sided", &[("dr", "2.2")]);
    let keys = SafeKeys { points: 6, ..SafeKeys::default() };
    let answer = keys.answer(&scene, &NoProgress).expect("an answer");
    let document: serde_json::Value = serde_json::from_str(&answer.document).expect("a document");
    let attractors = document["attractors"].as_array().expect("a list");
    assert_eq!(attractors.len(), 1, "{attractors:?}");
    let number = |name: &str| attractors[0][name].as_f64().expect("a number");
    assert!((number("fraction") - 1.0).abs() < 1e-12);
    assert!((number("impact_speed") - 1.884_269).abs() < 1e-6, "{}", number("impact_speed"));
}

/// Four contacts are made all along the stable branch of two periods, and the left hits change the
/// nominal ones by which they are told; each motion is listed once, though both of its maxima lie
/// on the section. By simulation there is no graze from 1.5382 to 1.5835.
#[test]
fn a_motion_with_two_section_points_has_one_branch_and_no_graze_where_hits_are_renamed() {
    let map = map_of(scene_with("two_sided", &NONE));
    let found = branches(&map, &["1", "0", "11", "10", "00"], [-0.3, 0.3], true).branches;
    let graze = 1.805_712_936_554_821;
    let value = |point: &BranchPoint| graze + point.orbit.parameters[0];
    let special = |branch: &Branch, label: BranchLabel| -> Vec<f64> {
        let points = branch.points.iter();
        let there =
            points.filter(|point| point.special.as_ref().is_some_and(|at| at.label == label));
        there.map(value).collect()
    };
    let names: Vec<String> = found.iter().map(|branch| branch.itinerary.to_string()).collect();
    // The second ones of `1` and `0` hit the left stop once.
    assert_eq!(names, ["1", "1", "0", "0", "11", "10"], "{names:?}");
    for branch in &found {
        let grazes = special(branch, BranchLabel::Graze);
        assert!(!grazes.iter().any(|at| (1.5382..1.5835).contains(at)), "{names:?} {grazes:?}");
    }
    let flips = special(&found[0], BranchLabel::PeriodDoubling);
    assert!(flips.iter().any(|at| (at - 1.538_113_967).abs() < 1e-8), "{flips:?}");
}

/// A stroboscopic section anywhere in the period: the left hits lie between it and the graze, or it
/// lies behind the graze, or before it.
#[test]
fn a_branch_has_its_graze_wherever_the_section_lies_among_the_hits() {
    for phase in ["0.5", "1.5", "2.5", "4", "5.5"] {
        let section = [("section.kind", "\"stroboscopic\""), ("section.phase", phase)];
        let map = map_of(scene_with("two_sided", &section));
        let found = branches(&map, &["1", "0"], [-0.05, 0.05], true).branches;
        let grazes = found.iter().map(|branch| {
            let label = |point: &&BranchPoint| {
                point.special.as_ref().is_some_and(|at| at.label == BranchLabel::Graze)
            };
            let grazes = branch.points.iter().filter(label);
            let offsets = grazes.map(|point| point.orbit.parameters[0]).collect::<Vec<_>>();
            (branch.itinerary.to_string(), offsets)
        });
        let grazes: Vec<(String, Vec<f64>)> = grazes.collect();
        assert_eq!(grazes.len(), 2, "{phase}: {grazes:?}");
        for (itinerary, offsets) in &grazes {
            let is_one = matches!(offsets[..], [offset] if offset.abs() < 1e-13);
            assert!(is_one, "{phase}, {itinerary}: {offsets:?}");
        }
    }
}

/// Without contact the orbit is proportional to the amplitude, and its branch is one piece.
#[test]
fn a_branch_without_contact_is_one_piece_far_from_the_graze() {
    for phase in ["1", "3", "5"] {
        let settings = [
            ("omega", "0.7"),
            ("zeta", "0.2"),
            ("section.kind", "\"stroboscopic\""),
            ("section.phase", phase),
        ];
        let map = map_of(scene_with("linear", &settings));
        let graze = 0.581_807_528_311_554_2;
        let range = [0.01 - graze, 0.6 - graze];
        let found = branches(&map, &["0"], range, true).branches;
        let free: Vec<&Branch> =
            found.iter().filter(|branch| branch.itinerary.to_string() == "0").collect();
        assert_eq!(free.len(), 1, "{phase}");
        let offsets = free[0].points.iter().map(|point| point.orbit.parameters[0]);
        let ends = offsets.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
        assert!((ends[0] - range[0]).abs() < 1e-12 && ends[1].abs() < 1e-12, "{phase}: {ends:?}");
    }
}

/// A Hopf normal form with a wall: its cycle has the radius `sqrt(mu) = 0.6`, and its section one
/// coordinate.
const HOPF: &str = r#"
[model]
name = "Hopf normal form with a wall"
states = ["u", "q"]
parameters = { mu = 0.36, om = 1.3, r = 0.7, delta = 0.7 }
[model.let]
s = "u^2 + q^2"
du = "mu*u - om*q - u*s"
[model.flow]
u = "du"
q = "om*u + mu*q - q*s"
[[model.surface]]
name = "wall"
event = "delta - u"
impact = { q = "q + (1 + r)*du/om" }
[grazing]
solve_for = "delta"
guess = { u = 0.59, q = 0.01 }
"#;

/// Nine starts, `u = -0.2, 0, ..., 1.4`: one is at rest, and four lie beyond the wall at 0.7.
#[test]
fn starts_that_come_to_no_attractor_are_counted() {
    let keys = SafeKeys { points: 9, ..SafeKeys::default() };
    let answer = keys.answer(&scene_of(HOPF), &NoProgress).expect("an answer");
    let document: serde_json::Value = serde_json::from_str(&answer.document).expect("a document");
    let ninths = |value: &serde_json::Value| 9.0 * value.as_f64().expect("a number");
    assert_eq!(document["starts"], 9);
    assert!((ninths(&document["no_image"]) - 5.0).abs() < 1e-12, "{}", document["no_image"]);
    assert!((ninths(&document["attractors"][0]["fraction"]) - 4.0).abs() < 1e-12);
}

#[test]
fn a_section_of_one_coordinate_has_no_basin() {
    let map = map_of(scene_of(HOPF));
    let request = BasinRequest::over_the_window(map.local());
    assert!(map.basin_time_remark(&[request]).is_none());
}

/// A harvester with a stopper: along the branch its impact passes the phase of the section, at
/// `f = 0.350566`. Speeds at 0.36 and 0.41 by another simulator, started on the attractor.
#[test]
fn a_stable_branch_goes_on_where_its_impact_passes_the_section() {
    let text = r#"
[model]
name = "piezo harvester with a stopper"
states = ["x", "v", "u"]
parameters = { z = 0.02, chi = 0.05, ka = 0.5, la = 0.3, f = 0.1, w = 0.9, r = 0.7, D = 1.0 }
phase = { name = "th", rate = "w", period = "2*pi" }
[model.flow]
x = "v"
v = "f*cos(th) - 2*z*v - x + chi*u"
u = "-la*u - ka*v"
[[model.surface]]
name = "stop"
event = "D - x"
impact = { v = "-r*v" }
[grazing]
solve_for = "f"
[section]
kind = "stroboscopic"
phase = 0.0
[expansion]
active = ["f"]
smooth_order = 3
contact_weight = 4
"#;
    let map = map_of(scene_of(text));
    let grazing = map.parameter("f").expect("a parameter");
    let found = branches(&map, &["0", "1", "10"], [0.1, 0.2], true);
    for (f, speed) in [(0.36, 0.764_231), (0.41, 1.021_191)] {
        let apart = |point: &&BranchPoint| (grazing + point.orbit.parameters[0] - f).abs();
        let stable = points(&found).filter(|point| point.orbit.stable);
        let nearest = stable.min_by(|a, b| apart(a).total_cmp(&apart(b))).expect("a stable orbit");
        let request = TimeSeriesRequest {
            start: nearest.orbit.states[0].clone(),
            parameters: vec![f - grazing],
            settle: 200,
            returns: 4,
            samples: 1,
        };
        let motion = MotionEvents::of(map.scene(), map.orbit(), &request).expect("a flight");
        let found = motion.expect("a whole flight").impact_speed();
        assert!(apart(&nearest) < 0.01, "{f}: {}", apart(&nearest));
        assert!((found - speed).abs() < 2e-6, "{f}: {found}");
    }
}

/// Without forcing a motion that impacts shorten comes back sooner than the grazing orbit does: its
/// return is still one turn. Multipliers and speeds by another simulator, over one turn.
#[test]
fn an_orbit_that_impacts_shorten_is_traversed_once() {
    let rayleigh = r#"
[model]
name = "Rayleigh oscillator between two stops"
states = ["x", "v"]
parameters = { e = 0.3, r1 = 0.8, r2 = 0.4, D = 1.2, g = 1.25 }
[model.flow]
x = "v"
v = "e*(1 - v^2)*v - x"
[[model.surface]]
name = "right"
event = "D - x"
impact = { v = "-r1*v" }
[[model.surface]]
name = "left"
event = "g*D + x"
impact = { v = "-r2*v" }
[grazing]
surface = "right"
solve_for = "D"
guess = { x = 1.2, v = 0.0 }
[expansion]
active = ["D"]
smooth_order = 3
contact_weight = 4
"#;
    let roessler = r#"
[model]
name = "Roessler cycle with a stop"
states = ["x", "y", "z"]
parameters = { a = 0.2, b = 0.2, c = 2.5, D = 4.0, r = 0.6 }
[model.flow]
x = "-y - z"
y = "x + a*y"
z = "b + z*(x - c)"
[[model.surface]]
name = "stop"
event = "D - x"
impact = { y = "y - (1 + r)*(y + z)" }
[grazing]
solve_for = "D"
guess = { x = 4.0, y = -1.0, z = 1.0 }
[expansion]
active = ["D"]
smooth_order = 3
contact_weight = 4
"#;
    let cases = [
        (rayleigh, -1.1, 0.6, 0.0476),
        (rayleigh, -1.1, 0.4, 0.0983),
        (roessler, -1.5, 4.5, 0.786_81),
    ];
    for (text, to, value, multiplier) in cases {
        let map = map_of(scene_of(text));
        let grazing = map.parameter("D").expect("a parameter");
        let found = branches(&map, &["1"], [0.0, to], true);
        let pairs = found.branches.iter().flat_map(|branch| branch.points.windows(2));
        let values = pairs.filter_map(|pair| {
            let [a, b] = [0, 1].map(|place| &pair[place].orbit);
            let share = (value - grazing - a.parameters[0]) / (b.parameters[0] - a.parameters[0]);
            let holds = (0.0..1.0).contains(&share) && a.stable && b.stable;
            holds.then(|| {
                assert!(a.hits == Some(vec![1]) && b.hits == Some(vec![1]), "{value}: {a:?}");
                a.multipliers[0][0] + share * (b.multipliers[0][0] - a.multipliers[0][0])
            })
        });
        let values: Vec<f64> = values.collect();
        assert_eq!(values.len(), 1, "{value}: {values:?}");
        // The branch is a polygon here.
        assert!((values[0] / multiplier - 1.0).abs() < 2e-2, "{value}: {values:?}");
    }
}

/// A cantilever that is drawn to the sample it taps: behind the sample the free flight is drawn
/// further, so that no gap has a minimum there.
const TAPPING: &str = r#"
[model]
name = "tapping cantilever"
states = ["x", "v"]
parameters = { c = 0.05, d = 1.0, r = 0.8, A = 0.5, w = 1.2, H = 0.002, a = 0.1 }

[model.phase]
name = "theta"
rate = "w"
period = "2*pi"

[model.flow]
x = "v"
v = "-(x - d) - c*v + A*cos(theta) - H/(x + a)^2"

[[model.surface]]
name = "sample"
event = "x"
impact = { v = "-r*v" }

[grazing]
surface = "sample"
solve_for = "A"

[section]
kind = "stroboscopic"
phase = "0"

[expansion]
active = ["A"]
smooth_order = 3
contact_weight = 4
"#;

/// Orbits whose contact is so deep that they have no variable of the passage.
#[test]
fn a_branch_goes_on_where_the_flight_behind_the_stop_does_not_turn() {
    let map = map_of(scene_of(TAPPING));
    let (grazing, range) = (map.parameter("A").expect("a parameter"), [-0.02, 0.1]);
    let found = branches(&map, &["1"], range, true);
    let is_stable = |point: &&BranchPoint| point.orbit.stable && point.orbit.contacts.len() == 1;
    let stable: Vec<&FoundOrbit> =
        points(&found).filter(is_stable).map(|point| &point.orbit).collect();
    let offsets = stable.iter().map(|orbit| orbit.parameters[0]);
    let reached = offsets.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], offset| {
        [low.min(offset), high.max(offset)]
    });
    assert_eq!(reached, range);
    let point: Vec<f64> = map.orbit().section_point.iter().map(|x| x.to_f64()).collect();
    for orbit in stable.iter().step_by(stable.len() / 3) {
        let force = grazing + orbit.parameters[0];
        let oscillator = independent::Oscillator::read(TAPPING, &[("A", force)]).expect("a scene");
        let after = |moved: [f64; 2]| {
            let mut simulator = Simulator::<f64>::new(&oscillator, &oscillator.values(), 0.05);
            let start = [0, 1].map(|n| point[n] + orbit.states[0][n] + moved[n]);
            simulator.place(&[start[0], start[1], 0.0]);
            let happened = simulator.advance(TAU / 1.2).expect("a period");
            let speeds: Vec<f64> = happened.iter().filter_map(|event| event.kind.speed()).collect();
            (start, [simulator.state[0], simulator.state[1]], speeds)
        };
        let (start, end, speeds) = after([0.0; 2]);
        assert_eq!(speeds.len(), 1);
        let errors = [speeds[0] - orbit.contacts[0].speed, end[0] - start[0], end[1] - start[1]];
        assert!(errors.iter().all(|error| error.abs() < 1e-9), "{errors:?}");
        let step = 1e-5;
        let errors = multiplier_errors(orbit, |direction| {
            let [up, down] = [step, -step].map(|by| after(direction.map(|part| part * by)).1);
            [0, 1].map(|n| (up[n] - down[n]) / (2.0 * step))
        });
        assert!(errors.iter().all(|error| error.abs() < 1e-6), "{errors:?} {orbit:?}");
    }
}

/// The branch from a graze to contacts of that depth has two pieces: with the variable of the
/// passage, and without it.
#[test]
fn branches_with_and_without_the_variable_of_a_passage_overlap() {
    let map = map_of(scene_of(TAPPING));
    let found = branches(&map, &["1"], [-0.4, 0.1], true);
    assert_eq!(labelled(&found, BranchLabel::SaddleNode).len(), 1);
    let [with, without]: [&Branch; 2] = [&found.branches[0], &found.branches[1]];
    let speed = |point: &BranchPoint| point.orbit.contacts[0].speed.abs();
    let slowest = |branch: &Branch| branch.points.iter().map(speed).fold(f64::INFINITY, f64::min);
    let fastest = |branch: &Branch| branch.points.iter().map(speed).fold(0.0, f64::max);
    assert!(slowest(with) < 1e-12 && fastest(without) > 1.0);
    assert!(slowest(without) < fastest(with) && slowest(without) > 0.5 * fastest(with));
    assert!(without.ends.contains(&BranchEnd::Continued), "{:?}", without.ends);
}

/// An oscillator so slow that an orbit forgets its past in every period: contacts that begin on the
/// way hardly move its section point, and each is a graze.
#[test]
fn grazes_of_contacts_that_begin_one_by_one_are_labelled() {
    let text = r#"
[model]
name = "slow oscillator"
states = ["x", "v"]
parameters = { z = 0.1, r = 0.8, f = 1.0, omega = 0.05 }
phase = { name = "theta", rate = "omega", period = "2*pi" }
[model.flow]
x = "v"
v = "f*cos(theta) - 2*z*v - x"
[[model.surface]]
name = "stop"
event = "1 - x"
impact = { v = "-r*v" }
[grazing]
solve_for = "f"
[section]
kind = "stroboscopic"
phase = "3"
[expansion]
active = ["f"]
smooth_order = 3
contact_weight = 4
"#;
    let map = map_of(scene_of(text));
    let found = branches(&map, &["1"], [0.0, 0.0101], true);
    let grazing = map.parameter("f").expect("a parameter");
    let values = labelled(&found, BranchLabel::Graze);
    let values: Vec<f64> = values.iter().map(|orbit| grazing + orbit.parameters[0]).collect();
    // Of the closed form of the free flight, hit by hit: where the second, third and fourth contact
    // begin.
    for exact in [1.0005871956, 1.0039210963, 1.0066907586] {
        let nearest = values.iter().map(|value| (value - exact).abs()).fold(1.0, f64::min);
        assert!(nearest < 2e-10, "{exact}: {values:?}");
    }
}

/// An orbit that hits one rigid stop grazes another one: with that contact or without, it exists on
/// one side of the graze alone.
#[test]
fn branches_end_at_the_graze_of_another_rigid_stop() {
    let text = r#"
[model]
name = "one stop grazed, another rigid one behind"
states = ["x", "v"]
parameters = { zeta = 0.1, a = 1.0, w = 0.8, dl = 1.6, dr = 1.0, r = 0.7 }
phase = { name = "theta", rate = "w", period = "2*pi" }
[model.flow]
x = "v"
v = "a*cos(theta) - 2*zeta*v - x"
[[model.surface]]
name = "left"
event = "x + dl"
impact = { v = "-r*v" }
[[model.surface]]
name = "right"
event = "dr - x"
impact = { v = "-r*v" }
[grazing]
surface = "right"
solve_for = "a"
[expansion]
active = ["a"]
smooth_order = 3
contact_weight = 4
"#;
    let map = map_of(scene_of(text));
    let found = branches(&map, &["1"], [0.4, 1.0], true);
    let grazing = map.parameter("a").expect("a parameter");
    // Of the closed form, in 30 digits: x(T) = dr, -r v(T) = v(0), x'(t) = 0, x(t) = -dl.
    let exact = 1.087_035_317_885_122_7;
    let mut contacts = Vec::new();
    for branch in &found.branches {
        let ends = [branch.points.first(), branch.points.last()];
        for (point, end) in ends.into_iter().zip(branch.ends) {
            let Some(BranchPoint { orbit, special: Some(special) }) = point else { continue };
            if end == BranchEnd::Graze && special.grazing.is_empty() {
                assert_eq!(special.label, BranchLabel::Graze);
                assert!((grazing + orbit.parameters[0] - exact).abs() < 1e-9, "{orbit:?}");
                contacts.push(branch.points[branch.points.len() / 2].orbit.extra_contacts);
            }
        }
    }
    contacts.sort_unstable();
    assert_eq!(contacts, [0, 1], "{:?}", found.branches.iter().map(|b| b.ends).collect::<Vec<_>>());
}

/// A mass at rest on a spring above a table: the grazing orbit has no extent.
#[test]
fn an_orbit_at_rest_has_branches_and_no_bound_of_escape() {
    let text = r#"
[model]
name = "mass at rest above a shaken table"
states = ["x", "v"]
parameters = { g = 1.0, r = 0.5, A = 1.2, k = 0.02, c = 0.05, h0 = 40.0 }
phase = { name = "theta", rate = "1", period = "2*pi" }
[model.flow]
x = "v"
v = "-g - c*v - k*(x - h0)"
[[model.surface]]
name = "table"
event = "x - h0 + g/k + 3 - A*sin(theta)"
impact = { v = "A*cos(theta) - r*(v - A*cos(theta))" }
[grazing]
solve_for = "A"
[expansion]
active = ["A"]
smooth_order = 3
contact_weight = 4
"#;
    let map = map_of(scene_of(text));
    assert!((map.parameter("A").expect("a parameter") - 3.0).abs() < 1e-12);
    let bounds = escape_bounds(map.scene(), map.orbit());
    assert!(bounds.iter().all(|bound| bound.offset == f64::INFINITY), "{bounds:?}");
    let found = branches(&map, &["0"], [-2.0, 0.0], true);
    let free: Vec<&FoundOrbit> =
        points(&found).map(|point| &point.orbit).filter(|orbit| orbit.stable).collect();
    let lowest = free.iter().map(|orbit| orbit.parameters[0]).fold(0.0, f64::min);
    assert_eq!(lowest, -2.0);
    // The flow of the free mass over one period of the table.
    let decay = (-0.05 * TAU).exp();
    for orbit in free {
        assert!((determinant(orbit) - decay).abs() < 1e-9, "{orbit:?}");
    }
}

#[test]
fn flights_are_made_in_a_range_far_from_the_graze() {
    // The range begins at four and a half times the grazing value of alpha.
    let map = map_of(scene_with("linear", &NONE));
    let found = branches(&map, &["1"], [10.0, 12.0], true);
    let stable = |branch: &Branch| branch.points.iter().all(|point| point.orbit.stable);
    assert!(found.branches.iter().any(stable), "{found:?}");
}

/// The oscillator `x'' = A cos(omega t) - 0.1 x' - x - 0.4 x^3` with a stop at 1 of some response.
fn duffing(response: &str) -> Scene {
    let text = format!(
        r#"
[model]
states = ["x", "v"]
parameters = {{ A = 0.14, omega = 1.1 }}
phase = {{ name = "theta", rate = "omega", period = "2*pi" }}
flow = {{ x = "v", v = "A*cos(theta) - 0.1*v - x - 0.4*x^3" }}
[[model.surface]]
name = "stop"
event = "1 - x"
{response}
[grazing]
solve_for = "A"
[window]
depth = 1e-3
state = {{ x = 2e-3, theta = 0.02 }}
parameter = {{ A = 2e-3 }}
"#
    );
    scene_of(&text)
}

/// A stiff stop, `x'' = ... - 2000 d - 6 x'` at the depth `d`, lets go within half a period of its
/// own motion, `pi / sqrt(2000 - 9)`, as the free motion is slow and leads away from it.
#[test]
fn a_contact_is_counted_once_in_the_time_of_contact() {
    let map = map_of(duffing(r#"contact = { v = "free - 2000*d - 6*v" }"#));
    let found = branches(&map, &["1"], [0.01, 0.15], true);
    let times = observed(map.scene(), map.orbit(), &found, BranchObservable::ContactTime);
    let times = times.expect("a simulation").concat();
    let longest = std::f64::consts::PI / (2000.0_f64 - 9.0).sqrt();
    assert!(times.len() > 10);
    for (point, time) in points(&found).zip(times) {
        let speed = point.orbit.contacts.iter().map(|contact| contact.speed).fold(0.0, f64::max);
        let shortest = if speed > 0.1 { 0.6 * longest } else { 0.0 };
        assert!((shortest..longest).contains(&time), "{speed}: {time} of {longest}");
    }
}

#[test]
fn hits_between_grazes_count_in_the_impact_speed_of_a_branch_and_not_of_a_diagram() {
    let map = map_of(scene_with("two_sided", &NONE));
    let found = branches(&map, &["0"], [-1e-4, 1e-3], true);
    let speeds = observed(map.scene(), map.orbit(), &found, BranchObservable::ImpactSpeed);
    let speeds = speeds.expect("a simulation").concat();
    assert!(!speeds.is_empty());
    // The largest hit of the grazing orbit, and of the orbits that contact changes.
    for (point, speed) in points(&found).zip(speeds) {
        assert!((speed - 1.884_269).abs() < 1e-3, "{:?}: {speed}", point.orbit);
    }
    let tables = "[[diagram]]\nparameter = \"dr\"\nrange = [1e-4, 2e-4]\npoints = 2\n\
                  transient = 100\nkeep = 4\nobserve = \"impact_speed\"\n\
                  with = [\"direct\", \"guarded\"]\n";
    let map = map.asking(tables).expect("a diagram");
    let diagram = map.diagram(&map.scene().diagrams[0]).expect("an attractor");
    assert!(!diagram.sweeps.is_empty());
    for point in diagram.sweeps.iter().flat_map(|sweep| &sweep.points) {
        assert!(point.kept_values().all(|speed| speed == 0.0), "{point:?}");
    }
}

#[test]
fn a_branch_point_has_the_orbit_of_its_flip() {
    let scene = duffing(r#"impact = { v = "-0.8*v" }"#);
    let found = branches(&map_of(scene), &["1", "11"], [0.05, 0.5], true);
    let flips = labelled(&found, BranchLabel::PeriodDoubling);
    let doubled = labelled(&found, BranchLabel::BranchPoint);
    let [flip, doubled] = [&flips, &doubled].map(|found| found.first().expect("a point"));
    assert_eq!(doubled.states.len(), 2);
    for (state, exact) in doubled.states.iter().flat_map(|state| state.iter().zip(&flip.states[0]))
    {
        assert!((state - exact).abs() < 1e-12, "{doubled:?} {flip:?}");
    }
}

/// The cycle `x = sqrt(mu) cos t`, `v = -sqrt(mu) sin t`, whatever the rate `c` of its approach: a
/// period of the branch is not that of the graze where `w` changes it.
#[test]
fn amplitudes_of_cycles_are_those_of_the_closed_form() {
    let text = r#"
[model]
states = ["x", "v"]
parameters = { mu = 0.3, w = 1.0, s = 1.0, r = 0.8 }
flow = { x = "v", v = "-w^2*x + 5*(mu - x^2 - v^2/w^2)*v" }
[[model.surface]]
name = "stop"
event = "s - x - 0.05*w"
impact = { v = "-r*v" }
[grazing]
solve_for = "s"
guess = { x = 0.5, v = 0.0 }
[expansion]
active = ["w", "s"]
[window]
depth = 1e-3
state = { x = 1e-2 }
parameter = { w = 1e-2, s = 1e-2 }
"#;
    let map = map_of(scene_of(text));
    let found = branches(&map, &["0"], [-0.4, 0.1], true);
    let amplitudes = observed(map.scene(), map.orbit(), &found, BranchObservable::Amplitude);
    let amplitudes = amplitudes.expect("a simulation").concat();
    let free = points(&found).zip(amplitudes).filter(|(at, _)| at.orbit.contacts.is_empty());
    let free: Vec<_> = free.collect();
    assert!(free.len() > 5);
    for (point, amplitude) in free {
        let exact = 0.3_f64.sqrt();
        assert!((amplitude - exact).abs() < 1e-9, "{amplitude} {:?}", point.orbit);
    }
}
