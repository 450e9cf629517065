//! Systems that others published: grazes at their printed numbers or closed forms. The head of each
//! scene in `gallery/outside/scenes` and in `tests/data/outside` says how its numbers are known.

use grazemap::Scene;
use grazemap::model::catalogue;
use grazemap::orbit::{
    CurveEnd, CurveOptions, CurveOutcome, Expectation, GrazingOrbit, MarginOutcome, NotLocated,
    curve, graze_theory, locate, margin,
};
use grazemap::pipeline::{CurveKeys, FindGraze as _, NearestKeys};
use grazemap::{Error, analysis::NoProgress};

use crate::support::scenes::{NONE, index, orbit, outside_text, parsed, scene_with};

fn outside<K: AsRef<str>, V: AsRef<str>>(name: &str, set: &[(K, V)]) -> Scene {
    parsed(&outside_text(name), name, set)
}

fn located(name: &str) -> (Scene, GrazingOrbit) {
    let scene = outside(name, &NONE);
    let orbit = orbit(&scene);
    (scene, orbit)
}

/// The frequencies at which `x'' + 2 c x' + x = F cos(omega t)` has the amplitude `F/ratio`.
fn frequencies(c: f64, ratio: f64) -> [f64; 2] {
    let middle = 1.0 - 2.0 * c * c;
    let root = (middle * middle - 1.0 + ratio * ratio).sqrt();
    [(middle - root).sqrt(), (middle + root).sqrt()]
}

#[test]
fn published_systems_graze_at_their_numbers() {
    // Name, parameter, its value at the graze, digits printed.
    let cases = [
        ("bilinear_rig", "w", 0.801_928_106_593_2, 1e-13),
        ("gear_backlash", "w", 0.820_631_087_712_087, 1e-15),
        ("relief_valve", "q", 7.557_210_971_876_68, 1e-14),
        ("impacting_absorber", "d", 1.724_634_935_785_849, 1e-14),
        ("undamped", "sigma", 1.0 / 6.84, 2e-16),
        ("impact_at_resonance", "A", 0.1, 2e-16),
        ("elastic_stop", "F", 0.393_094_047_347_891, 2e-15),
        // By Runge and Kutta's method of order 4 and half a period's symmetry.
        ("inverted_pendulum", "wall", 0.027_077_178_252_409_6, 2e-15),
        ("soft_impact", "omega", 0.454_485_911_300_73, 2e-14),
        ("van_der_pol_wall", "d", 2.008_619_860_874_843, 1e-15),
        ("pendulum_below_a_fold", "A", 0.130_620_735_177_659_2, 1e-15),
    ];
    for (name, parameter, value, digits) in cases {
        let (scene, orbit) = located(name);
        let found = orbit.parameters()[index(&scene, parameter)].to_f64();
        // One unit of the last digit printed, and of a double.
        let most = (digits + 2e-16) * value;
        assert!((found - value).abs() <= most, "{name}: {parameter} = {found} for {value}");
        assert!(orbit.is_physical() && orbit.residual < 1e-28, "{name}: {:e}", orbit.residual);
    }
}

#[test]
fn autonomous_systems_have_their_printed_periods_and_multipliers() {
    let (_, valve) = located("relief_valve");
    assert!((valve.period.to_f64() - 2.656_012_147_475).abs() < 1e-12);
    assert!((valve.multipliers[0][0] - 0.853_395_334).abs() < 1e-9);
    let (_, cycle) = located("van_der_pol_wall");
    assert!((cycle.period.to_f64() - 6.663_286_859_323_13).abs() < 1e-14);
}

/// A ball between walls moves at a steady speed without them, unless it is at rest.
#[test]
fn a_ball_that_nothing_holds_has_no_grazing_orbit() {
    let found = locate(&outside("o04_impact_pair", &NONE)).expect("no wrong input");
    let reason = found.into_result().expect_err("it flies away");
    assert!(matches!(reason, NotLocated::NoPeriodicOrbit { .. }), "{reason}");
}

/// One graze lies below resonance, one above: the nearest to the scene's own value is found.
#[test]
fn a_resonance_is_grazed_on_both_sides() {
    let expected = frequencies(0.02, 0.5 / 0.63);
    for (start, expected) in [("0.4", expected[0]), ("1.5", expected[1])] {
        let scene = outside("soft_impact", &[("omega", start)]);
        let found = orbit(&scene).parameters()[index(&scene, "omega")].to_f64();
        assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
    }
}

/// On the upper branch the pendulum goes beyond the wall: the graze is below a fold.
#[test]
fn a_graze_below_folds_is_found_from_every_branch() {
    for start in ["0.2", "0.3", "0.15", "0.1"] {
        let scene = outside("pendulum_below_a_fold", &[("A", start)]);
        let orbit = orbit(&scene);
        let found = orbit.parameters()[index(&scene, "A")].to_f64();
        assert!((found - 0.130_620_735_177_659_2).abs() < 1e-15, "from A = {start}: {found}");
    }
}

/// `xi_1` of the linear oscillator vanishes at `omega = 2 sqrt(1 − c²)`.
#[test]
fn the_first_condition_vanishes_along_the_curve_where_theory_has_it() {
    let scene = outside("resonant_graze", &[("omega", "1.9")]);
    let with = index(&scene, "omega");
    let traced = curve(&scene, with, 1.9, 2.1, &CurveOptions::default()).expect("a curve");
    let CurveOutcome::Traced(traced) = traced else { panic!("{traced:?}") };
    let at: Vec<f64> =
        traced.codim2().map(|(_, _, point)| point.parameters[with].to_f64()).collect();
    assert!(at.len() == 1 && (at[0] - 1.997_498_435_543_8).abs() < 5e-14, "{at:?}");
}

/// The verdict of a graze whose first condition is rounding, its parameter given to 14 digits.
#[test]
fn a_vanishing_condition_is_codimension_two_and_says_what_unfolds_it() {
    let (scene, orbit) = located("resonant_graze");
    let theory = graze_theory(&scene, &orbit).expect("an orbit");
    assert_eq!(theory.expectation, Expectation::CodimensionTwo { n: 1 });
    assert!(theory.xi[0].abs() <= theory.noise[0], "{:e}", theory.xi[0]);
    // xi_1 = (1 + r) h'' e^{−cT} sin(wT)/w with w T = π here: its slope comes from T = 2π/omega.
    let (omega, c, r) = (1.997_498_435_543_8_f64, 0.05_f64, 0.8);
    let period = std::f64::consts::TAU / omega;
    let slope = (1.0 + r) * omega * omega * (-c * period).exp() * period / omega;
    let unfolding = &theory.unfolding;
    assert_eq!(unfolding[0].parameter, "omega");
    // A central difference over 1e-4 of the parameter.
    assert!((unfolding[0].slope / slope - 1.0).abs() < 1e-6, "{unfolding:?} for {slope}");
    assert!(unfolding.iter().any(|at| at.parameter == "c"), "{unfolding:?}");
    // Restitution scales the condition and does not move its zero.
    assert!(unfolding.iter().all(|at| at.parameter != "r"), "{unfolding:?}");
    // On either side of a zero the sign of the condition is stated.
    for (omega, n) in [("1.99", Some(1)), ("2.01", None)] {
        let scene = outside("resonant_graze", &[("omega", omega)]);
        let theory = graze_theory(&scene, &crate::support::scenes::orbit(&scene));
        let expectation = theory.expect("an orbit").expectation;
        let jumps = matches!(expectation, Expectation::Jump { n: first } if Some(first) == n);
        assert!(jumps || n.is_none(), "{omega}: {expectation:?}");
        assert!(!matches!(expectation, Expectation::CodimensionTwo { .. }), "{expectation:?}");
    }
}

#[test]
fn signs_of_rounding_are_not_stated() {
    // To 32 digits, where xi_1 is the rounding of double-double.
    let scene = scene_with("linear_codim2", &NONE);
    let theory = graze_theory(&scene, &orbit(&scene)).expect("an orbit");
    assert_eq!(theory.expectation, Expectation::CodimensionTwo { n: 1 });
    assert!(theory.orbits.iter().all(|orbit| orbit.returns != 1), "{:?}", theory.orbits);
    // The reset of a planar cycle acts along the flow.
    let (scene, orbit) = located("van_der_pol_wall");
    let theory = graze_theory(&scene, &orbit).expect("an orbit");
    assert_eq!(theory.expectation, Expectation::Undecided);
    assert!(theory.orbits.is_empty() && theory.unfolding.is_empty());
}

/// A linear oscillator whose stop pushes with powers of the penetration.
const POWERS: &str = r#"
[model]
name = "a stop with a power law"
states = ["x", "v"]
parameters = { z = 0.02, k = 1.0, c = 0.3, f = 0.3, w = 0.8 }
phase = { name = "th", rate = "w", period = "2*pi" }
[model.flow]
x = "v"
v = "f*cos(th) - 2*z*v - x"
[[model.surface]]
name = "stop"
event = "1 - x"
contact = { v = "free - FORCE" }
[grazing]
solve_for = "f"
"#;

/// A force `k d^p` acts for a time as `y`, at a penetration as `y^2`: its kick begins with
/// `y^(2p + 1)`, whatever the sign of rounding of the penetration at the graze.
#[test]
fn the_verdict_of_a_power_law_knows_its_power() {
    let cases = [
        ("k*d^0.3", 1.6, Expectation::Unbounded),
        ("k*d^0.5", 2.0, Expectation::Finite),
        ("k*sqrt(d)", 2.0, Expectation::Finite),
        ("k*d^0.75", 2.5, Expectation::Finite),
        ("k*d^1.1 + k*d", 3.0, Expectation::Finite),
        ("k*d^1.5*(1 + c*v)", 4.0, Expectation::Finite),
        ("k*d^2.5", 6.0, Expectation::Finite),
        ("k*d^3.7", 8.4, Expectation::Finite),
        ("k*d^1.5 + c*v", 2.0, Expectation::Finite),
        ("k*d^1.5*v", 5.0, Expectation::Finite),
    ];
    for (force, power, expectation) in cases {
        for w in ["0.5", "0.6", "0.8", "0.9", "1.3"] {
            let scene = parsed(&POWERS.replace("FORCE", force), "power", &[("w", w)]);
            let theory = graze_theory(&scene, &orbit(&scene)).expect("an orbit");
            let found = theory.contact_power.expect("a power");
            assert!((found - power).abs() < 1e-12, "{force}, w = {w}: {found}");
            assert_eq!(theory.expectation, expectation, "{force}, w = {w}");
        }
    }
}

/// A follower at rest, which a cam of the lift `b` just touches: `b = D`, `h'' = b w^2`.
#[test]
fn a_follower_at_rest_grazes_its_cam() {
    let text = r#"
[model]
name = "cam and follower"
states = ["x", "v"]
parameters = { z = 0.1, b = 0.9, w = 1.3, r = 0.5, D = 1.0 }
phase = { name = "th", rate = "w", period = "2*pi" }
[model.flow]
x = "v"
v = "-2*z*v - x"
[[model.surface]]
name = "cam"
event = "x + D - b*cos(th)"
impact = { v = "-r*v - (1 + r)*b*w*sin(th)" }
[grazing]
solve_for = "b"
"#;
    for (lift, of) in [("1.0", 1.0), ("1e-5", 1e-5), ("3e4", 3e4)] {
        let start = (0.9 * of).to_string();
        let scene = parsed(text, "cam", &[("D", lift), ("b", &start)]);
        let orbit = orbit(&scene);
        let found = orbit.parameters()[index(&scene, "b")].to_f64();
        let bent = orbit.grazing_point().normal_acceleration.to_f64();
        assert!((found / of - 1.0).abs() < 1e-14, "{found:e}");
        assert!((bent / (of * 1.69) - 1.0).abs() < 1e-12, "{bent:e}");
        // Of the free oscillator: exp(-z T ± i sqrt(1 - z²) T).
        let [re, im] = orbit.multipliers[0];
        assert!((re.hypot(im) - (-0.2 * std::f64::consts::PI / 1.3).exp()).abs() < 1e-12);
    }
}

#[test]
fn an_orbit_without_damping_is_neutral() {
    let scene = outside("resonant_graze", &[("c", "0"), ("omega", "2.8"), ("F", "6.0")]);
    let theory = graze_theory(&scene, &orbit(&scene)).expect("an orbit");
    assert_eq!(theory.expectation, Expectation::Neutral);
}

/// An impact that depends on the acceleration moves a state that only touches: no theory holds.
#[test]
fn theory_is_silent_where_an_impact_moves_a_touching_state() {
    let moved = [("model.surface.0.impact.v", "-r*v + 0.1")];
    let scene = scene_with("linear", &moved);
    let theory = graze_theory(&scene, &orbit(&scene)).expect("an orbit");
    let Expectation::Displaced { displacement } = theory.expectation else {
        panic!("{:?}", theory.expectation)
    };
    assert!((displacement - 0.1).abs() < 1e-12, "{displacement}");
}

#[test]
fn theory_is_silent_where_a_contact_has_no_release_near_the_graze() {
    // A contact that does not push back, one that is never left, and a prestress that holds the
    // stop back; and beside each one that is left at the graze.
    let cases = [
        ("20*(x - delta)", "v", Expectation::NoRelease),
        ("free - 20*(x - delta)", "1", Expectation::NoRelease),
        ("free - 0.5 - 20*(x - delta)", "0.5 + 20*(x - delta)", Expectation::NoRelease),
        ("free - 20*(x - delta)", "20*(x - delta)", Expectation::Finite),
    ];
    let text = catalogue::text("linear").expect("a scene of the catalogue");
    for (contact, release, expected) in cases {
        let law = format!("contact = {{ v = \"{contact}\" }}\nrelease = \"{release}\"\n");
        let scene = parsed(&text.replace("impact = { v = \"-r*v\" }\n", &law), "linear", &NONE);
        let found = scene.graze().expect("an orbit").theory().expect("an orbit").expectation;
        assert_eq!(found, expected, "{contact}, released at {release}");
    }
}

/// A curve to frequencies at which a period lasts for ever ends with what it has, and says why.
#[test]
fn a_curve_does_a_bounded_amount_of_work() {
    let scene = scene_with("linear", &NONE);
    let (alpha, omega, zeta) =
        (index(&scene, "alpha"), index(&scene, "omega"), index(&scene, "zeta"));
    let options = CurveOptions { most_products: 10_000_000, ..CurveOptions::default() };
    let traced = curve(&scene, omega, 1.8, -1.0, &options).expect("a curve");
    let CurveOutcome::Traced(traced) = traced else { panic!("{traced:?}") };
    let CurveEnd::WorkLimit { period, steps } = traced.end else { panic!("{:?}", traced.end) };
    let last = traced.points.last().expect("points");
    assert!(period == last.period && steps > 0 && traced.points.len() > 20);
    for point in &traced.points {
        let at = |parameter: usize| point.parameters[parameter];
        let closed = (1.0 - at(omega).powi(2)).hypot(2.0 * at(zeta) * at(omega));
        assert!((at(alpha) - closed).abs() < 1e-12, "{}", at(omega));
    }
}

const F07: &str = "f07_orbit_through_another_wall";

/// Amplitude of the free flow of the oscillator between two stops.
fn amplitude(w: f64) -> f64 {
    1.0 / (1.0 - w * w).hypot(2.0 * 0.05 * w)
}

#[test]
fn an_orbit_through_another_stop_is_refused_with_surface_depth_and_phase() {
    let compliant = "contact = { v = \"free - 50*(x + dl)\" }";
    let soft = outside_text(F07).replacen("impact = { v = \"-r*v\" }", compliant, 1);
    for text in [outside_text(F07), soft] {
        let scene = parsed(&text, F07, &NONE);
        let orbit = orbit(&scene);
        let reason = orbit.physical(&scene).expect_err("it passes through `left`");
        let NotLocated::PassesThrough { surface, depth, place, grazed, at } = &reason else {
            panic!("{reason}")
        };
        assert!(surface == "left" && grazed == &["right"], "{reason}");
        assert!((depth - (amplitude(0.8) - 0.5)).abs() < 1e-12, "{reason}");
        assert!((at.0[0].1 - amplitude(0.8)).abs() < 1e-12, "{reason}");
        // Half a period after the graze.
        let phase = orbit.grazing_point().state[2].to_f64() + std::f64::consts::PI;
        assert!(place.0[0].0 == "theta" && (place.0[0].1 - phase).abs() < 1e-9, "{reason}");
        let words = reason.to_string();
        assert!(words.contains("passes through `left` by 2.211631"), "{words}");
        assert!(words.contains("`hits = [\"left\"]`"), "{words}");
    }
}

#[test]
fn an_orbit_through_another_stop_has_no_theory_and_no_map() {
    let graze = outside(F07, &NONE).graze().expect("the orbit of the free flow");
    let is_refused = |error: Error| {
        assert!(error.ended_otherwise(), "{error}");
        assert!(error.to_string().contains("passes through `left`"), "{error}");
    };
    is_refused(graze.theory().expect_err("no theory"));
    is_refused(graze.map().expect_err("no map"));
    // Read back it is refused too.
    let read = grazemap::Graze::from_json(&graze.to_json().expect("a document"));
    let read = read.expect("the document of an orbit");
    assert_eq!(read.orbit(), graze.orbit());
    is_refused(read.map().expect_err("no map"));
    // Direct simulation starts from it.
    let keys = grazemap::pipeline::TrajectoryKeys { periods: 3, samples: 50, ..Default::default() };
    let answer = keys.answer(&graze.settle().expect("a section"), &NoProgress);
    let answer = answer.expect("a trajectory");
    assert!(answer.table().expect("a table").to_csv().expect("rows").contains("impact"));
}

/// `x = cos(theta) + 0.6 cos(2 theta)` has its maxima at 1.6 and, at the phase π, at −0.4.
#[test]
fn an_orbit_through_its_own_stop_elsewhere_is_refused() {
    let flow = "(1 - w^2)*cos(theta) - 2*zeta*w*sin(theta) + 0.6*(1 - 4*w^2)*cos(2*theta) \
                - 2.4*zeta*w*sin(2*theta) - 2*zeta*v - x";
    let guess = "solve_for = \"dr\"\nguess = { x = -0.4, v = 0.0, theta = 3.1 }";
    let text = outside_text(F07).replace("solve_for = \"dr\"", guess);
    let scene = parsed(&text, F07, &[("model.flow.v", flow), ("dl", "3"), ("dr", "-0.38")]);
    let orbit = orbit(&scene);
    let reason = orbit.physical(&scene).expect_err("it passes through `right`");
    let NotLocated::PassesThrough { surface, depth, .. } = &reason else { panic!("{reason}") };
    assert!(surface == "right" && (depth - 2.0).abs() < 1e-12, "{reason}");
    assert!(reason.to_string().contains("a `guess` at the lowest one"), "{reason}");
}

/// Along the curve in `w` the orbit passes through `left` where its amplitude is above `dl`.
#[test]
fn points_of_a_curve_that_pass_through_another_stop_are_told() {
    let scene = outside(F07, &[("dl", "3"), ("w", "0.7")]);
    let with = index(&scene, "w");
    let traced = curve(&scene, with, 0.7, 0.9, &CurveOptions::default()).expect("a curve");
    let CurveOutcome::Traced(traced) = traced else { panic!("{traced:?}") };
    let mut counts = [0, 0];
    for point in &traced.points {
        let through = amplitude(point.parameters[with]) - 3.0;
        assert_eq!(point.is_physical(), through < 0.0, "{through}");
        counts[usize::from(through > 0.0)] += 1;
        let depth = point.penetration.as_ref().map_or(0.0, |at| at.depth);
        assert!((depth - through.max(0.0)).abs() < 1e-11, "{depth} for {through}");
    }
    assert!(counts[0] > 2 && counts[1] > 2, "{counts:?}");
    let keys = CurveKeys { along: "w".to_owned(), from: 0.7, to: 0.9, xi: 1 };
    let answer = keys.answer(&scene, &NoProgress).expect("a curve");
    assert!(answer.ended.is_none() && answer.text.contains("passes through `left` by up to"));
}

#[test]
fn curves_and_margins_all_of_whose_orbits_pass_through_a_stop_are_refused() {
    let scene = outside(F07, &NONE);
    let keys = CurveKeys { along: "w".to_owned(), from: 0.8, to: 0.81, xi: 1 };
    let answer = keys.answer(&scene, &NoProgress).expect("points");
    let ended = answer.ended.expect("no orbit of the oscillator").to_string();
    assert!(ended.contains("passes through `left` by up to"), "{ended}");
    for parameters in [vec!["dr"], vec!["dr", "zeta"]] {
        let numbers: Vec<usize> = parameters.iter().map(|name| index(&scene, name)).collect();
        let scales = vec![1e-3; numbers.len()];
        let found = margin(&scene, &numbers, &scales).expect("parameters of the scene");
        let MarginOutcome::NotLocated(reason) = found else { panic!("{found:?}") };
        assert!(matches!(reason, NotLocated::PassesThrough { .. }), "{reason}");
    }
}

/// `x = sin(theta) + sin(3 theta)` has two equal maxima in a period.
#[test]
fn two_equal_maxima_in_a_period_are_to_be_named_as_two_passages() {
    let flow = "(1 - omega^2)*sin(theta) + 2*c*omega*cos(theta) + (1 - 9*omega^2)*sin(3*theta) \
                + 6*c*omega*cos(3*theta) - 2*c*v - x";
    // The maxima are at cos(theta) + 3 cos(3 theta) = 0, that is cos²(theta) = 2/3.
    for theta in ["0.65", "2.48"] {
        let keys = [("model.flow.v", flow), ("omega", "1.3")];
        let guess = format!("solve_for = \"d\"\nguess = {{ x = 1.5, v = 0.0, theta = {theta} }}");
        let text = outside_text("resonant_graze")
            .replace("solve_for = \"F\"", &guess)
            .replace("event = \"1 - x\"", "event = \"d - x\"")
            .replace("r = 0.8 }", "r = 0.8, d = 1.5 }")
            .replace("active = [\"F\", \"omega\"]", "active = [\"d\", \"omega\"]");
        let one = locate(&parsed(&text, "two_maxima", &keys)).expect("no wrong input");
        let reason = one.into_result().expect_err("it grazes twice");
        assert!(matches!(reason, NotLocated::TouchesElsewhere { .. }), "{reason}");
        assert!(reason.to_string().contains("`passages = [\"stop\", \"stop\"]`"), "{reason}");
        let both = text.replace("surface = \"stop\"", "passages = [\"stop\", \"stop\"]");
        let scene = parsed(&both, "two_maxima", &keys);
        let orbit = orbit(&scene);
        assert!(orbit.passages.len() == 2 && orbit.is_physical());
    }
}

#[test]
fn margins_have_a_sign_and_say_what_they_do_not_look_for() {
    for (alpha, sign) in [("2.2465", 1.0), ("2.25", -1.0)] {
        let scene = scene_with("linear", &[("alpha", alpha)]);
        let keys = NearestKeys { nearest: vec!["alpha".to_owned()], ..NearestKeys::default() };
        let answer = keys.answer(&scene, &NoProgress).expect("a margin");
        let document: serde_json::Value = serde_json::from_str(&answer.document).expect("JSON");
        // The graze is at alpha = sqrt((1 − 1.8²)² + 0.18²), changes are counted in alpha.
        let own: f64 = alpha.parse().expect("a number");
        let expected = ((1.0_f64 - 3.24).hypot(0.18) - own) / own;
        let margin = document["margin"].as_f64().expect("a number");
        assert!((margin - expected).abs() < 1e-14 && margin * sign > 0.0, "{margin}");
        // A smaller amplitude of the force is a larger margin on both sides.
        let slope = document["sensitivities"]["alpha"].as_f64().expect("a number");
        assert!((slope * own + 1.0).abs() < 1e-12, "{slope}");
        assert!(answer.text.contains("other attractors are not looked for"), "{}", answer.text);
    }
}
