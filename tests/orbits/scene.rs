//! Meaning of scenes: a model that uses everything in the scene language.

use grazemap::model::{
    EmitPrecision, MapOrders, Method, Model, NodeId, Observable, Orders, Response, Scene, Section,
    Shape, Starts, StroboscopicPhase, SweepDirection, Symmetry, catalogue,
};
use grazemap::numeric::{Dd, FloatFormat};

/// A compliant, two-sided oscillator that uses every table.
const COMPLIANT: &str = r#"
[model]
name = "two stops"
states = ["x", "v"]
let = { a = "b - x", b = "F*cos(theta) - 2*zeta*v" }
[model.parameters]
zeta = 0.05
F = "2*sqrt(1 - 0.05^2)"
k = 29
R = 0.4
delta = 1_0.5e-1
[model.phase]
name = "theta"
rate = "1"
period = "2*pi"
[model.flow]
x = "v"
v = "a"
[[model.surface]]
name = "right"
event = "delta - x"
contact = { v = "free - k*(x - delta) - R*v" }
release = "k*(x - delta) + R*v"
[[model.surface]]
name = "left"
event = "delta + x"
contact = { v = "free - k*(x + delta)" }
[grazing]
passages = ["right", "left"]
solve_for = ["F"]
periods = 2
guess = { x = 1, v = 0, theta = "pi/2" }
symmetry = "half-period"
[section]
kind = "stroboscopic"
phase = "pi/3"
[expansion]
active = ["F", "zeta"]
tolerance = 1e-8
weights = { zeta = 4 }
[window]
depth = 1e-2
state = { theta = 0.05 }
parameter = { F = 1e-3 }
[emit]
shape = "composed"
lanes = 4
[[diagram]]
parameter = "F"
range = [-1e-3, 2e-3]
points = 10
transient = 0
keep = 5
observe = "x + theta"
direction = "down"
with = ["map", "direct"]
[[chart]]
parameters = ["F", "zeta"]
ranges = [[-1, 1], [-0.5, 2]]
points = [20, 30]
[[basin]]
at = { F = 1e-4 }
axes = ["theta", "x"]
points = 40
manifolds = 3
"#;

fn parse(source: &str) -> Scene {
    Scene::parse(source, "test.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// The value of a node at a full state, parameters as in the scene.
fn value(model: &Model, node: NodeId, state: &[f64]) -> f64 {
    let parameters = model.parameters.iter().map(|parameter| parameter.value.hi);
    let inputs: Vec<f64> = state.iter().copied().chain(parameters).collect();
    let mut values = Vec::new();
    model.graph.evaluate(&inputs, &mut values);
    values[node.index()]
}

fn dd(text: &str) -> Dd {
    Dd::from_decimal(text).expect("a decimal number")
}

#[test]
fn decimal_literals_keep_the_digits_of_their_text() {
    let scene = parse(catalogue::text("linear_codim2").expect("in the catalogue"));
    let value = |name: &str| {
        scene.model.parameters.iter().find(|parameter| parameter.name == name).map(|p| p.value)
    };
    assert_eq!(value("zeta"), Some(dd("0.05")));
    assert_ne!(value("zeta"), Some(Dd { hi: 0.05, lo: 0.0 }));
    assert_eq!(value("omega"), Some(dd("1.9974984355438178915780382328058")));
}

#[test]
fn a_parameter_may_be_an_expression_of_numbers_to_thirty_digits() {
    let scene = parse(COMPLIANT);
    let error = scene.model.parameters[1].value - dd("1.9974984355438178915780382328058");
    assert!(error.hi.abs() < 1e-30, "{error:?}");
    assert_eq!(scene.model.parameters[4].value, dd("1.05"));
}

#[test]
fn every_table_of_a_scene_is_read() {
    let scene = parse(COMPLIANT);
    assert_eq!(scene.identifier, "test");
    assert_eq!(scene.model.full_state_names(), ["x", "v", "theta"]);
    assert_eq!(
        (scene.grazing.passages.as_slice(), scene.grazing.solve_for.as_slice()),
        (&[0, 1][..], &[1][..])
    );
    assert_eq!((scene.grazing.periods, scene.grazing.symmetry), (2, Symmetry::HalfPeriod));
    assert_eq!(scene.grazing.guess, Some(vec![1.0, 0.0, std::f64::consts::FRAC_PI_2]));
    assert!(
        matches!(scene.section, Section::Stroboscopic(StroboscopicPhase::At(phase)) if phase.hi > 1.04)
    );
    assert_eq!(
        (scene.expansion.active.as_slice(), scene.expansion.orders),
        (&[1, 0][..], Orders::Tolerance(1e-8))
    );
    assert_eq!(scene.expansion.weights, [("zeta".to_owned(), 4)]);
    assert_eq!(scene.window.state, [f64::INFINITY, f64::INFINITY, 0.05]);
    assert_eq!((scene.window.depth, scene.window.parameter[1]), (1e-2, 1e-3));
    assert_eq!((scene.emit.shape, scene.emit.lanes), (Shape::Composed, Some(4)));
    let diagram = &scene.diagrams[0];
    assert_eq!((diagram.parameter, diagram.points, diagram.transient, diagram.keep), (1, 10, 0, 5));
    assert_eq!((diagram.range, diagram.direction), ([-1e-3, 2e-3], SweepDirection::Down));
    assert_eq!(diagram.with, [Method::Map, Method::Direct]);
    assert!(matches!(&diagram.observe, Observable::Expression { text, .. } if text == "x + theta"));
    let [basin] = &scene.basins[..] else { panic!("{:?}", scene.basins) };
    assert_eq!(basin.axes, Some(["theta".to_owned(), "x".to_owned()]));
    let place = scene.model.parameters.iter().position(|parameter| parameter.name == "F");
    assert_eq!(basin.at, [(place.expect("a parameter"), 1e-4)]);
    assert_eq!((basin.points, basin.manifolds), (Some([40, 40]), Some(3)));
    assert_eq!((basin.ranges, &basin.with[..]), (None, &[Method::Guarded][..]));
    let chart = &scene.charts[0];
    assert_eq!(
        (chart.parameters, chart.points, chart.ranges),
        ([1, 0], [20, 30], [[-1.0, 1.0], [-0.5, 2.0]])
    );
}

#[test]
fn values_scales_and_starts_of_diagrams_and_charts_are_read() {
    let with = |keys: &str| {
        let source = catalogue::text("linear").expect("in the catalogue");
        let (before, _) = source.split_once("[[diagram]]").expect("it has a diagram");
        Scene::parse(&format!("{before}[[diagram]]\nparameter = \"alpha\"\n{keys}\n"), "linear")
    };
    let diagram = |keys: &str| {
        let scene = with(keys).unwrap_or_else(|error| panic!("{error}"));
        scene.diagrams[0].clone()
    };
    assert_eq!(diagram("values = [1e-6, -1e-8, 1e-6]").offsets(), [-1e-8, 1e-6]);
    let log = diagram("range = [1e-8, 1e-2]\npoints = 7\nscale = \"log\"").offsets();
    for (offset, exponent) in log.iter().zip(-8..) {
        assert!((offset / 10f64.powi(exponent) - 1.0).abs() < 1e-14, "{log:?}");
    }
    assert_eq!((log[0], log[6]), (1e-8, 1e-2));
    let range = "range = [-1e-3, 1e-3]\n";
    for name in ["method", "with"] {
        let methods = diagram(&format!("{range}{name} = [\"direct\", \"map\"]")).with;
        assert_eq!(methods, [Method::Direct, Method::Map]);
    }
    assert_eq!(diagram(&format!("{range}starts = 16")).starts, Starts::Spread(16));
    let start =
        diagram(&format!("{range}start = [{{ x = 0.1, theta = 0.2 }}, {{ x = 1 }}]")).starts;
    let expected = [vec![Some(0.1), None, Some(0.2)], vec![Some(1.0), None, None]];
    assert_eq!(start, Starts::Given(expected.to_vec()));
    for (keys, said) in [
        ("values = [1]\npoints = 3", "`points` and `values` exclude each other"),
        ("values = []", "empty"),
        ("range = [-1, 1]\nscale = \"log\"", "on one side of 0"),
        ("range = [0, 1]\nscale = \"log\"", "on one side of 0"),
        ("range = [0, 1]\nscale = \"octaves\"", "one of"),
        ("range = [0, 1]\nstart = [{ x = 1 }]\nstarts = 2", "exclude each other"),
        ("range = [0, 1]\nstart = [{ y = 1 }]", "`y`"),
        ("range = [0, 1]\nstarts = 0", "from 1 to 1000"),
        ("range = [0, 1]\nmethod = \"map\"\nwith = \"map\"", "exclude each other"),
        ("range = [0, 1]\nmethod = \"lucky\"", "one of"),
    ] {
        let error = with(keys).expect_err(keys).to_string();
        assert!(error.contains(said), "{keys}: {error}");
    }
}

#[test]
fn a_set_key_of_a_diagram_takes_the_place_of_those_it_excludes() {
    let with = |set: &[(&str, &str)]| {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        let set: Vec<_> = set.iter().map(owned).collect();
        let source = catalogue::text("linear").expect("in the catalogue");
        Scene::parse_with(source, "linear", &set).map(|scene| scene.diagrams[0].clone())
    };
    let values = ("diagram.0.values", "[1e-6, 2e-6]");
    assert_eq!(with(&[values]).expect("the range gives way").offsets(), [1e-6, 2e-6]);
    let both = with(&[values, ("diagram.0.range", "[0, 1e-3]")]).expect_err("both are set");
    assert!(both.to_string().contains("exclude each other"), "{both}");
    let starts = [("diagram.0.start", "[{ x = 1e-3 }]"), ("diagram.0.points", "3")];
    assert_eq!(with(&starts).expect("one start").offsets().len(), 3);
}

#[test]
fn orbits_escape_at_a_hundred_extents_unless_a_scene_says_otherwise() {
    let with = |keys: &str| {
        let source = catalogue::text("linear").expect("in the catalogue");
        Scene::parse(&format!("{source}\n{keys}\n"), "linear")
    };
    assert_eq!(with("").expect("a scene").direct.escape, 100.0);
    assert_eq!(with("[direct]\nescape = 3").expect("a scene").direct.escape, 3.0);
    for (keys, said) in [
        ("[direct]\nescape = 0", "must be positive"),
        ("[direct]\nescape = \"far\"", "`direct.escape` is an expression of numbers alone"),
        ("[direct]\nescapes = 3", "`escape`"),
    ] {
        let error = with(keys).expect_err(keys).to_string();
        assert!(error.contains(said), "{keys}: {error}");
    }
}

#[test]
fn named_expressions_and_free_mean_what_they_stand_for() {
    let model = parse(COMPLIANT).model;
    let state = [1.2, 0.7, 0.3];
    let forcing = 2.0 * (1.0_f64 - 0.0025).sqrt() * 0.3_f64.cos();
    let free = forcing - 0.1 * 0.7 - 1.2;
    assert!((value(&model, model.flow[1], &state) - free).abs() < 1e-14);
    let Response::Contact { field, release } = &model.surfaces[0].response else {
        panic!("a compliant stop")
    };
    let law = free - 29.0 * (1.2 - 1.05) - 0.4 * 0.7;
    assert!((value(&model, field[1], &state) - law).abs() < 1e-13);
    assert!((value(&model, *release, &state) - (29.0 * 0.15 + 0.28)).abs() < 1e-13);
    let Response::Contact { release, .. } = model.surfaces[1].response else {
        panic!("a compliant stop")
    };
    assert_eq!(release, model.surfaces[1].event);
}

/// `h = δ − x` has `h' = −v` and `h'' = −a`, by hand.
#[test]
fn normal_velocity_and_acceleration_follow_the_free_flow() {
    let model = parse(catalogue::text("linear").expect("in the catalogue")).model;
    let stop = &model.surfaces[0];
    let state = [0.9, 0.25, 1.1];
    let acceleration = 2.25 * 1.1_f64.cos() - 0.1 * 0.25 - 0.9;
    assert_eq!(value(&model, stop.normal_velocity, &state), -0.25);
    assert!((value(&model, stop.normal_acceleration, &state) + acceleration).abs() < 1e-14);
}

#[test]
fn overrides_set_parameters_and_keys_and_change_the_digest() {
    let source = catalogue::text("linear").expect("in the catalogue");
    let set = |pairs: &[(&str, &str)]| {
        let overrides: Vec<(String, String)> =
            pairs.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        Scene::parse_with(source, "linear.toml", &overrides)
    };
    let scene = set(&[
        ("omega", "2*sqrt(1 - 0.05^2)"),
        ("zeta", "0.07"),
        ("expansion.smooth_order", "7"),
        ("diagram.0.points", "50"),
        ("expansion.weights.omega", "4"),
        ("section.kind", "stroboscopic"),
        ("grazing.guess.x", "0.99"),
    ]);
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.model.parameters[0].value, dd("0.07"));
    assert!((scene.model.parameters[4].value.hi - 1.997_498_435_543_818).abs() < 1e-15);
    assert_eq!(scene.expansion.orders, Orders::Fixed(MapOrders::new(7, 6)));
    assert_eq!(scene.expansion.weights, [("omega".to_owned(), 4)]);
    assert_eq!(scene.diagrams[0].points, 50);
    assert_eq!(scene.section, Section::Stroboscopic(StroboscopicPhase::Grazing));
    assert_eq!(scene.grazing.guess.as_ref().map(|guess| guess[0]), Some(0.99));
    assert_ne!(scene.digest, parse(source).digest);
    for (key, value) in [
        ("omga", "1"),
        ("zeta", "x"),
        ("expansion.order", "5"),
        ("diagram.7.points", "5"),
        ("model.name.x", "1"),
        ("", "1"),
        (".", "1"),
        ("grazing..x", "1"),
        ("diagram.0", "3"),
        ("model", "3"),
        ("emit.lanes", "\"\n\u{7}"),
    ] {
        let error =
            set(&[(key, value)]).err().unwrap_or_else(|| panic!("`{key}={value}` was accepted"));
        assert!(error.to_string().starts_with("linear.toml:"), "{error}");
    }
}

#[test]
fn the_precision_is_double_and_lanes_fill_64_bytes_unless_a_scene_says_otherwise() {
    let linear = catalogue::text("linear").expect("in the catalogue");
    let emit = |lines: &str| {
        let source = linear.replace("shape = \"auto\"\nlanes = 8\n", lines);
        assert!(!source.contains("lanes = 8"));
        parse(&source).emit
    };
    let (double, single) = (FloatFormat::F64, FloatFormat::F32);
    let default = emit("");
    assert_eq!(default.precision, EmitPrecision::Given(double));
    assert_eq!([double, single].map(|format| default.lanes(format)), [8, 16]);
    let named = emit("precision = \"f32\"\nlanes = 4\n");
    assert_eq!(named.precision, EmitPrecision::Given(single));
    assert_eq!(named.lanes(single), 4);
}

#[test]
fn a_parameter_nothing_depends_on_is_a_warning() {
    assert_eq!(parse(COMPLIANT).warnings, Vec::<String>::new());
    let source = COMPLIANT.replace("R = 0.4", "R = 0.4\nspare = 1");
    assert_eq!(parse(&source).warnings, ["nothing depends on parameter `spare`"]);
}

#[test]
fn digests_are_fnv_1a_of_the_text() {
    let scene = parse(catalogue::text("linear").expect("in the catalogue"));
    let by_hand = catalogue::text("linear")
        .expect("in the catalogue")
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(1_099_511_628_211)
        });
    assert_eq!(scene.digest.0, by_hand);
}

/// A moving, curved stop: the restitution is that of the normal velocity, whatever the event
/// function.
#[test]
fn restitution_is_checked_on_the_normal_velocity_where_it_is_one_number() {
    let accepted = |event: &str, impact: &str| {
        let linear = catalogue::text("linear").expect("in the catalogue");
        let source = linear.replace("\"delta - x\"", event).replace("\"-r*v\"", impact);
        Scene::parse(&source, "test.toml").is_ok()
    };
    assert!(accepted("\"delta^2 - x^2\"", "\"-r*v\""));
    assert!(!accepted("\"delta^2 - x^2\"", "\"-(r + 0.3)*v\""));
    let moving = "\"delta + 0.1*sin(theta) - x\"";
    assert!(accepted(moving, "\"-v + 2*0.1*omega*cos(theta)\""));
    assert!(!accepted(moving, "\"-1.5*v + 2.5*0.1*omega*cos(theta)\""));
    assert!(
        accepted("\"delta - x\"", "\"-3*v*exp(-v^2)\""),
        "a restitution that depends on the speed is the user's"
    );
}
