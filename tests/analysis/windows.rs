//! Window of a map, measured if a scene leaves it open, compared with direct simulation at points
//! that were not used for the measurement.

use grazemap::analysis::{
    DirectEnd, DirectImage, ImageRecord, ImageRequest, ImageRow, MapEvaluation, Precision, Using,
};
use grazemap::convergence::{BoundKind, BoundOrigin, MeasuredWindow, WindowTolerance};
use grazemap::expansion::{ExceededBound, MapWindow};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::numeric::{Dd, decimal_below};
use grazemap::pipeline::EmitRequest;
use grazemap::{FindGraze, Map};
use grazemap_studies::adversary::attack;

use crate::exact;
use crate::support::scenes::{NONE, parsed, text};

/// A pendulum driven against a wall: the flow is not affine, and the scene has no window.
const PENDULUM: &str = r#"
[model]
name = "driven pendulum with a wall"
states = ["phi", "om"]
parameters = { c = 0.1, wall = 0.6, r = 0.7, A = 0.2, w = 0.8 }
[model.phase]
name = "theta"
rate = "w"
period = "2*pi"
[model.flow]
phi = "om"
om = "A*cos(theta) - c*om - sin(phi)"
[[model.surface]]
name = "wall"
event = "wall - phi"
impact = { om = "-r*om" }
[grazing]
solve_for = "A"
[expansion]
active = ["A", "w"]
"#;

/// The text of a scene of the catalogue with another `[window]`, or none.
fn with_window(name: &str, window: &str) -> String {
    let text = text(name);
    let (before, after) = text.split_once("[window]").expect("every scene has one");
    let rest = after.find("\n[").map_or("", |next| &after[next..]);
    format!("{before}{window}{rest}")
}

fn map(text: &str, name: &str, set: &[(&str, &str)]) -> Map {
    let graze = parsed(text, name, set).graze().expect("a grazing orbit");
    graze.map().expect("a map")
}

/// Numbers between 0 and 1, the same in every run (Knuth's linear congruence).
fn numbers() -> impl FnMut() -> f64 {
    let mut state: u64 = 20;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005);
        state = state.wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Largest ratio of error to tolerance at random points of a window, and the number of points that
/// have no image or contacts elsewhere; points beyond the depth are skipped. Offsets are uniform
/// or, every other time, spread over three decades, which finds the thin layer in which a wide
/// parameter makes contact.
fn excess(map: &Map, window: &MapWindow, points: usize) -> (f64, usize) {
    let system = HybridSystem::new(&map.scene().model);
    let mut direct = DirectImage::<Dd>::new(&system, map.scene(), map.orbit()).expect("a scene");
    let depths = MapEvaluation::<f64>::depths(map.local());
    let limits: Vec<f64> = map.window().errors.iter().map(|error| error.limit).collect();
    let mut next = numbers();
    let (mut worst, mut lost, mut found) = (0.0_f64, 0, 0);
    while found < points {
        let decades = if next() < 0.5 { 0.0 } else { 3.0 };
        let mut spread = |widths: &[f64]| -> Vec<f64> {
            let mut offset = || (2.0 * next() - 1.0) * 10_f64.powf(-decades * next());
            widths.iter().map(|width| width * offset()).collect()
        };
        let (state, parameters) = (spread(&window.state), spread(&window.parameter));
        if !window.holds(&state, &parameters, &depths.at(&state, &parameters)) {
            continue;
        }
        found += 1;
        let truth = direct.image(&exact(&state), &exact(&parameters)).expect("finite offsets");
        if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
            lost += 1;
            continue;
        }
        let mut image = vec![0.0; state.len()];
        map.discrete().step(&state, &parameters, &mut image);
        for ((image, &truth), limit) in image.iter().zip(&truth.offsets).zip(&limits) {
            worst = worst.max((Dd::from(*image) - truth).to_f64().abs() / limit);
        }
    }
    (worst, lost)
}

/// A window with all bounds times a factor.
fn scaled(window: &MapWindow, factor: f64) -> MapWindow {
    let mut scaled = window.clone();
    scaled.bounds_mut().for_each(|bound| *bound *= factor);
    scaled
}

#[test]
fn on_an_open_window_the_map_keeps_its_tolerance_and_on_a_larger_one_it_does_not() {
    let linear = with_window("linear", "");
    for (text, name) in [(PENDULUM, "pendulum"), (&linear, "linear")] {
        for set in [&[][..], &[("emit.tolerance", "1e-9")]] {
            let map = map(text, name, set);
            let (window, local) = (map.window(), &map.local().window);
            assert!(window.is_kept(), "{name}: {window:?}");
            let share = matches!(window.tolerance, WindowTolerance::Share(1e-6));
            assert_eq!(share, set.is_empty(), "{name}: {window:?}");
            for (bound, value) in window.bounds.iter().zip(local.bounds()) {
                assert_eq!((bound.origin, bound.value), (BoundOrigin::Measured, value));
                assert!(value > 0.0 && value == decimal_below(value, 2), "{name}: {bound:?}");
            }
            // Points on the verge of contact aside, of which a sample of this size has none.
            let (inside, lost) = excess(&map, local, 300);
            assert!(inside <= 1.05 && lost == 0, "{name}: {inside}, {lost}: {window:?}");
            let (outside, lost) = excess(&map, &scaled(local, 3.0), 300);
            assert!(outside > 1.0 || lost > 0, "{name}: {outside}: {window:?}");
        }
    }
}

#[test]
fn what_a_scene_states_stays_and_what_it_leaves_open_is_measured() {
    let stated = "[window]\ndepth = 1e-5\nparameter = { alpha = 1e-5 }\n";
    let map = map(&with_window("linear", stated), "linear", &[("emit.tolerance", "1e-9")]);
    let window = map.window();
    let origins: Vec<_> = window.bounds.iter().map(|bound| bound.origin).collect();
    let (scene, measured) = (BoundOrigin::Scene, BoundOrigin::Measured);
    // `x` is the depth of the stop, to first order, and as wide as the stated depth needs.
    assert_eq!(origins, [scene, BoundOrigin::Depth, measured, scene, measured], "{window:?}");
    let local = &map.local().window;
    assert_eq!((local.depth, local.parameter[0]), (1e-5, 1e-5));
    let (inside, lost) = excess(&map, local, 300);
    assert!(window.is_kept() && inside <= 1.05 && lost == 0, "{inside}: {window:?}");
}

#[test]
fn stated_bounds_that_prevent_the_tolerance_are_said_and_no_others_make_it_much_worse() {
    let window = "[window]\ndepth = 1e-3\nstate = { x = 1e-3 }\n";
    let tolerance = 1e-11;
    let set = [("emit.tolerance", "1e-11")];
    let map = map(&with_window("linear", window), "linear", &set);
    let window = map.window();
    assert!(!window.is_kept(), "{window:?}");
    let error = window.largest_error().expect("measured");
    let mut narrow = map.local().window.clone();
    narrow.state[1] = 1e-9;
    narrow.parameter.fill(1e-9);
    let (alone, _) = excess(&map, &narrow, 300);
    // Twice what the stated bounds make alone, found to a tenth at random points.
    assert!(alone > 1.0 && error < 2.5 * alone * tolerance, "{alone}: {window:?}");
    let open = window.bounds.iter().filter(|bound| bound.origin == BoundOrigin::Measured);
    assert!(open.clone().count() == 3 && open.clone().all(|it| it.value > 1e-6), "{window:?}");
}

#[test]
fn a_depth_beyond_the_radius_of_the_series_ends_there() {
    let map = map(text("soft_b"), "soft_b", &[("k2", "1e6")]);
    let depth = &map.window().bounds[0];
    assert_eq!((depth.kind, depth.origin), (BoundKind::Depth, BoundOrigin::Radius));
    let radius = map.window_edges()[0].radius;
    assert_eq!(map.local().window.depth, decimal_below(radius * radius, 2));
    // The edge is evaluated at the depth that the scene states.
    assert_eq!(map.window_edges()[0].depth, 1e-4);
}

#[test]
fn points_beyond_the_radius_of_the_series_of_a_stiff_stop_are_outside() {
    let map = map(text("soft_b"), "soft_b", &[("k2", "1e6")]);
    let radius = map.window_edges()[0].radius;
    // On the tangency section the depth is the offset of the displacement.
    let row = |radii: f64| ImageRow {
        state: vec![Dd::from((radii * radius).powi(2)), Dd::ZERO],
        parameters: vec![Dd::ZERO; map.local().parameters.len()],
    };
    let request = ImageRequest {
        rows: [0.3, 13.0, 100.0, 300.0].map(row).to_vec(),
        iterations: 1,
        using: Using::Map,
        precision: Precision::F64,
    };
    let images = map.images(&request).expect("images");
    let beyond = |record: &ImageRecord| record.exceeded.contains(&ExceededBound::Depth(0));
    let found: Vec<bool> = images.iter().map(beyond).collect();
    assert_eq!(found, [false, true, true, true], "radius {radius}");
    assert!(images[1..].iter().all(|record| !record.inside()));
}

/// Claimed errors of a map, by coordinate.
fn claims(window: &MeasuredWindow) -> Vec<f64> {
    window.errors.iter().map(|error| error.error.expect("measured")).collect()
}

/// An adversary with other means than the measurement: random points, points on faces and on the
/// verge of contact, and ascents by mutations. The longer attack is `guarded -- bound` of the
/// studies.
#[test]
fn an_adversary_finds_no_point_of_a_window_that_errs_more_than_is_claimed() {
    // Moving stops and second contacts have depths that the map errs in, the flight of the fourth
    // has its largest error inside the window.
    for name in ["moving_stop", "two_stops_t1_rigid", "impact_pair", "foale_omega_2_2"] {
        let map = map(text(name), name, &NONE);
        let claims = claims(map.window());
        let found = attack(&map, map.discrete(), &claims, (1500, 1)).expect("a simulation");
        let (coordinate, excess, worst) = found.largest();
        assert!(found.points > 1000 && found.lost == 0, "{name}: {found:?}");
        assert!(excess <= 1.0, "{name}: {excess} in {coordinate} at {worst:?}");
        // The claim is of the order of what so few points find.
        assert!(excess > 0.3, "{name}: {excess}");
    }
}

#[test]
fn a_module_claims_the_error_of_the_form_that_is_emitted() {
    let map = map(text("impact_pair"), "impact_pair", &[("emit.shape", "composed")]);
    let (module, window) = map.emitted(EmitRequest::default()).expect("a module");
    assert_eq!(module.measured_error, window.largest_error());
    let form = HornerMap::composed(map.local(), map.composed().expect("a composed map"));
    let found = attack(&map, &form, &claims(&window), (1500, 1)).expect("a simulation");
    assert!(found.largest().1 <= 1.0, "{found:?}");
    // The factored map errs otherwise.
    let other = attack(&map, &form, &claims(map.window()), (1500, 1)).expect("a simulation");
    let excess = other.largest().1;
    assert!(!(0.9..=1.0).contains(&excess), "{excess}");
}

#[test]
fn a_coordinate_that_is_the_stated_depth_is_as_wide_as_that_depth() {
    // On the tangency section x is the depth.
    let stated = map(&with_window("linear", "[window]\ndepth = 1e-2\n"), "linear", &NONE);
    let x = &stated.window().bounds[1];
    assert_eq!((x.value, x.origin), (1e-2, BoundOrigin::Depth), "{:?}", stated.window());
    assert_eq!(stated.window().reached, None);
    let depths = MapEvaluation::<f64>::depths(stated.local());
    let deep = [0.99e-2, 0.0];
    let (depth, window) = (depths.at(&deep, &[0.0; 2]), &stated.local().window);
    assert!(depth[0] > 0.98e-2 && window.holds(&deep, &[0.0; 2], &depth), "{depth:?}");

    let both = "[window]\ndepth = 1e-2\nstate = { x = 1e-4 }\n";
    let narrow = map(&with_window("linear", both), "linear", &NONE);
    let reached = narrow.window().reached.expect("a contradiction");
    assert!((reached / 1e-4 - 1.0).abs() < 1e-6, "{reached}");
    let said: String = narrow.remarks().collect();
    assert!(said.contains("no point of the half-widths is deeper than 1.0e-4"), "{said}");
}

#[test]
fn points_with_contacts_elsewhere_are_no_part_of_a_measured_window() {
    // A stop on the other side, just beyond the orbit, that does not graze: offsets of some 1e-3
    // or 1e-9 reach it, and contacts as fast, of a depth of 1e-18.
    let wall = r#"[[model.surface]]
name = "far"
event = "x + GAP"
impact = { v = "-r*v" }

[grazing]"#;
    for gap in ["1.002", "1.000000001"] {
        let text = with_window("linear", "").replacen("[grazing]", &wall.replace("GAP", gap), 1);
        let map = map(&text, "linear", &[("emit.tolerance", "1e-3")]);
        let (_, lost) = excess(&map, &map.local().window, 300);
        assert_eq!((lost, map.window().sample.excluded), (0, 0), "{gap}: {:?}", map.window());
    }
}

/// A mass with an absorber in two equal gaps: both are grazed in one period, each half of which
/// mirrors the other.
const ABSORBER: &str = r#"
[model]
name = "absorber in two equal gaps"
states = ["x1", "v1", "x2", "v2"]
parameters = { w = 1.5, d = 1.0, mu = 0.05, r = 0.9 }
[model.let]
g = "0.906304*(x1 - x2) + 0.254*(v1 - v2) + 0.1*(x1 - x2)^3"
vs = "(v1 + mu*v2)/(1 + mu)"
[model.phase]
name = "theta"
rate = "w"
period = "2*pi"
[model.flow]
x1 = "v1"
v1 = "-x1 - 0.04*v1 - 0.1*x1^3 - mu*g + cos(theta)"
x2 = "v2"
v2 = "g"
[[model.surface]]
name = "up"
event = "d + x1 - x2"
impact = { v1 = "(1 + r)*vs - r*v1", v2 = "(1 + r)*vs - r*v2" }
[[model.surface]]
name = "down"
event = "d + x2 - x1"
impact = { v1 = "(1 + r)*vs - r*v1", v2 = "(1 + r)*vs - r*v2" }
[grazing]
passages = ["up", "down"]
solve_for = "d"
symmetry = "half-period"
[expansion]
active = ["d", "w"]
"#;

#[test]
fn the_rounding_of_a_depth_in_the_wake_of_a_contact_does_not_narrow_a_window() {
    // The depth of the second contact has the rounding of the first one's kick, and its root moves
    // by 1e-8: no window would keep a millionth of its half-widths.
    let orders = [("expansion.smooth_order", "3"), ("expansion.contact_weight", "4")];
    let map = map(ABSORBER, "absorber", &orders);
    let window = map.window();
    let least = window.bounds.iter().map(|bound| bound.value).fold(f64::INFINITY, f64::min);
    assert!(least > 1e-7 && window.sample.excluded == 0, "{window:?}");
}

#[test]
fn a_window_with_a_parameter_far_wider_than_its_depth_holds_where_it_makes_contact() {
    let map = map(&with_window("cantilever_0_107", ""), "cantilever_0_107", &NONE);
    let (inside, lost) = excess(&map, &map.local().window, 1000);
    assert!(map.window().is_kept() && inside <= 1.05 && lost == 0, "{inside}, {lost}");
}

#[test]
fn a_saved_map_has_the_window_that_was_measured() {
    let map = map(PENDULUM, "pendulum", &NONE);
    let read = Map::from_json(&map.to_json().expect("text")).expect("the same map");
    assert_eq!(read.window(), map.window());
    assert_eq!(read.local().window, map.local().window);
}

#[test]
fn a_restitution_of_zero_has_as_deep_a_window_as_a_small_one() {
    let scene = with_window("linear", "");
    let active = [("expansion.active", "[\"r\", \"alpha\"]")];
    let depths = ["0.0", "0.05"].map(|r| {
        let set = [("model.parameters.r", r), active[0]];
        let map = map(&scene, "linear", &set);
        let measured = map.window();
        assert_eq!(measured.sample.excluded, 0, "{r}");
        let depth = measured.bounds.iter().find(|bound| bound.kind == BoundKind::Depth);
        depth.expect("a depth").value
    });
    assert!(depths[0] > 0.3 * depths[1] && depths[0] > 1e-4, "{depths:?}");
}
