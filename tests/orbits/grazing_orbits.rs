//! Grazing orbits of the catalogue against independent reference values.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first thing that is not there")]

use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{GrazingOrbit, Location, NotLocated, OrbitError, locate};
use serde_json::Value;

use crate::support::reference::{exact, read, text};
use crate::support::scenes::{self, NONE, orbit, parameter, parsed, scene, scene_with};

fn relative(found: Dd, expected: Dd) -> f64 {
    ((found - expected) / expected).magnitude()
}

/// Distance of two phases modulo a period.
fn phase_distance(a: Dd, b: Dd, period: Dd) -> f64 {
    let difference = a - b;
    (difference - (difference / period + Dd::from(0.5)).floor() * period).magnitude()
}

/// Largest errors of one orbit, all but the multipliers relative.
#[derive(Debug, Default)]
struct Errors {
    parameter: f64,
    phase: f64,
    acceleration: f64,
    multipliers: f64,
    monodromy: f64,
    xi: f64,
}

impl Errors {
    /// Rounding of double-double (1.2e-32) grown by conditions of up to 1e4; references have 30
    /// digits, `xi/(1 + r)` 24.
    fn check(&self) {
        assert!(
            self.parameter < 1e-28 && self.phase < 1e-28 && self.acceleration < 1e-26,
            "{self:?}"
        );
        assert!(self.monodromy < 1e-26 && self.multipliers < 1e-13 && self.xi < 1e-20, "{self:?}");
    }

    fn largest(self, other: Errors) -> Errors {
        Errors {
            parameter: self.parameter.max(other.parameter),
            phase: self.phase.max(other.phase),
            acceleration: self.acceleration.max(other.acceleration),
            multipliers: self.multipliers.max(other.multipliers),
            monodromy: self.monodromy.max(other.monodromy),
            xi: self.xi.max(other.xi),
        }
    }
}

fn phase_period(scene: &Scene) -> Dd {
    scene.model.phase.as_ref().unwrap().period
}

/// Largest error of the monodromy's entries against rows of strings, relative to its largest entry.
fn monodromy_error(orbit: &GrazingOrbit, expected: &Value) -> f64 {
    let rows = expected.as_array().unwrap();
    let entries = |row: &Value| row.as_array().unwrap().iter().map(exact).collect::<Vec<_>>();
    let expected: Vec<Dd> = rows.iter().flat_map(entries).collect();
    let found: Vec<Dd> = orbit.monodromy.iter().flatten().copied().collect();
    let size = expected.iter().map(|value| value.magnitude()).fold(0.0, f64::max);
    found.iter().zip(&expected).map(|(a, b)| (*a - *b).magnitude()).fold(0.0, f64::max) / size
}

/// Largest distance of the multipliers from the roots of `z² − trace z + det`.
fn multiplier_error(orbit: &GrazingOrbit, trace: Dd, determinant: Dd) -> f64 {
    let half = trace * Dd::from(0.5);
    let discriminant = half * half - determinant;
    let root = discriminant.abs().sqrt();
    let expected = if discriminant.to_f64() < 0.0 {
        [[half.to_f64(), root.to_f64()], [half.to_f64(), -root.to_f64()]]
    } else {
        [[(half + root).to_f64(), 0.0], [(half - root).to_f64(), 0.0]]
    };
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let nearest = |value: &[f64; 2]| {
        expected.iter().map(|root| distance(value, root)).fold(f64::INFINITY, f64::min)
    };
    orbit.multipliers.iter().map(nearest).fold(0.0, f64::max)
}

/// Largest error of `xi_n`, relative to `xi_n`, from monodromy `rows` as `scale [Mⁿ]₁₂`.
fn xi_error(orbit: &GrazingOrbit, expected: &[Dd]) -> f64 {
    orbit.xi.iter().zip(expected).map(|(&xi, &expected)| relative(xi, expected)).fold(0.0, f64::max)
}

/// The larger multiplier of a reference orbit, in modulus.
fn orbit_multiplier(point: &Value) -> f64 {
    let (trace, determinant) = (exact(&point["trace"]).to_f64(), exact(&point["det"]).to_f64());
    let discriminant = 0.25 * trace * trace - determinant;
    if discriminant < 0.0 { determinant.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
}

#[test]
fn linear_oscillator_grazes_at_its_closed_form() {
    let mut worst = Errors::default();
    for case in read("rigid/linear_abc.json")["a_b_grazing_and_xi"].as_array().unwrap() {
        let start = format!("{}", exact(&case["alpha_g"]).to_f64() * 0.9);
        let mut overrides =
            vec![("section.kind", "stroboscopic"), ("section.phase", "grazing"), ("alpha", &start)];
        let keys = ["omega", "zeta", "r", "delta"];
        overrides.extend(keys.map(|key| (key, text(&case[key]))));
        let scene = scene_with("linear", &overrides);
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let codim2 = case["xi"][0].as_str().unwrap().contains("e-");
        let xi: Vec<Dd> = case["xi"].as_array().unwrap().iter().map(exact).collect();
        worst = worst.largest(Errors {
            parameter: relative(parameter(&scene, &orbit, "alpha"), exact(&case["alpha_g"])),
            phase: phase_distance(graze.state[2], exact(&case["theta_g"]), phase_period(&scene)),
            acceleration: relative(-graze.normal_acceleration, exact(&case["a_star"])),
            multipliers: 0.0,
            monodromy: monodromy_error(&orbit, &case["M"]),
            xi: if codim2 { orbit.xi[0].magnitude() } else { xi_error(&orbit, &xi) },
        });
    }
    worst.check();
}

#[test]
fn electrostatic_oscillator_grazes_at_the_reference_orbits() {
    for (name, file) in [
        ("mems", "public_mems_w0.46.json"),
        ("mems_codim2", "public_mems_w0.4878_codim2.json"),
        ("mems_scenario3", "public_mems_scenario3_codim2.json"),
    ] {
        let base = &read(&format!("rigid/{file}"))["base"];
        let scene = scene_with(name, &[("omega", base["omega_star"].as_str().unwrap().to_owned())]);
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let parameter = relative(parameter(&scene, &orbit, "V"), exact(&base["V_star"]));
        let phase =
            phase_distance(graze.state[2], exact(&base["theta_star"]), phase_period(&scene));
        Errors { parameter, phase, ..Errors::default() }.check();
        assert!(
            (graze.state[0] - Dd::from(0.5)).magnitude() < 1e-28
                && graze.state[1].magnitude() < 1e-28
        );
        assert!(
            orbit.residual < 1e-28 && orbit.is_physical() && orbit.guess_distance.unwrap() < 1e-3
        );
    }
}

#[test]
fn electrostatic_grazing_curve_is_met_on_every_sheet() {
    let points = read("rigid/mems_curve.json");
    let mut worst = Errors::default();
    for point in points.as_array().unwrap().iter().step_by(6) {
        // NOTE: near its folds and where a multiplier is of the order of 100, sheets are closer
        // than 1e-3 or the flow from a guess 1e-3 away is drawn to x = 1 within a period.
        let multiplier = orbit_multiplier(point);
        let off = if multiplier > 50.0 || point["branch"] == 2 { 1e-5 } else { 1e-3 };
        let near = |key: &str| format!("{:?}", exact(&point[key]).to_f64() + off);
        let scene = scene_with(
            "mems",
            &[
                ("omega", point["omega"].as_str().unwrap().to_owned()),
                ("V", near("V")),
                ("grazing.guess.x", format!("{:?}", 0.5 + off)),
                ("grazing.guess.v", format!("{:?}", -off)),
                ("grazing.guess.theta", near("theta_star")),
                ("section.kind", "stroboscopic".to_owned()),
                ("section.phase", "grazing".to_owned()),
            ],
        );
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let factor: Dd = "1.8".parse().unwrap();
        let xi: Vec<Dd> = point["xi_over_1plusr"]
            .as_array()
            .unwrap()
            .iter()
            .map(|xi| exact(xi) * factor)
            .collect();
        let errors = Errors {
            parameter: relative(parameter(&scene, &orbit, "V"), exact(&point["V"])),
            phase: phase_distance(
                graze.state[2],
                exact(&point["theta_star"]),
                phase_period(&scene),
            ),
            acceleration: relative(-graze.normal_acceleration, exact(&point["a_star"])),
            multipliers: multiplier_error(&orbit, exact(&point["trace"]), exact(&point["det"])),
            monodromy: monodromy_error(&orbit, &point["M"]),
            xi: xi_error(&orbit, &xi),
        };
        worst = worst.largest(errors);
    }
    worst.check();
}

#[test]
fn cantilever_grazes_at_every_row_of_the_tables() {
    let rows = read("rigid/beam_tables.json");
    let mut worst = Errors::default();
    for row in rows.as_array().unwrap() {
        let value = |key: &str| row[key].as_str().unwrap().to_owned();
        let near = |key: &str, by: f64| format!("{:?}", exact(&row[key]).to_f64() + by);
        let scene = scene_with(
            "cantilever_1_7",
            &[
                ("zeta", value("zeta")),
                ("alpha", value("alpha")),
                ("beta", value("beta")),
                ("Q", near("Q_G_qmin", 1e-3)),
                ("grazing.guess.q", near("Q_G_qmin", -1e-3)),
                ("grazing.guess.theta", near("t_G", 1e-3)),
                ("section.kind", "stroboscopic".to_owned()),
                ("section.phase", "grazing".to_owned()),
            ],
        );
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let errors = Errors {
            parameter: relative(parameter(&scene, &orbit, "Q"), exact(&row["Q_G_qmin"])),
            phase: phase_distance(graze.state[2], exact(&row["t_G"]), phase_period(&scene)),
            acceleration: relative(graze.normal_acceleration, exact(&row["a_G"])),
            multipliers: multiplier_error(&orbit, exact(&row["trace"]), exact(&row["det"])),
            monodromy: monodromy_error(&orbit, &row["A"]),
            xi: 0.0,
        };
        worst = worst.largest(errors);
    }
    worst.check();
}

/// Scene without its guess.
fn without_guess(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let kept: Vec<&str> =
        scenes::text(name).lines().filter(|line| !line.starts_with("guess")).collect();
    parsed(&kept.join("\n"), "scene", overrides)
}

fn reason(scene: &Scene) -> NotLocated {
    match locate(scene).unwrap() {
        Location::Located(orbit) => panic!("located at {:?}", orbit.parameters()),
        Location::NotLocated(reason) => reason,
    }
}

#[test]
fn steady_state_leads_to_the_graze_where_there_is_no_guess() {
    for (name, adjusted) in [("linear", "alpha"), ("cantilever_0_107", "Q"), ("mems", "V")] {
        let guessed = scene(name);
        let searched = without_guess(name, &[]);
        let expected = parameter(&guessed, &orbit(&guessed), adjusted);
        let found = parameter(&searched, &orbit(&searched), adjusted);
        assert!(relative(found, expected) < 1e-28, "{name}: {found} for {expected}");
    }
}

#[test]
fn guess_a_tenth_off_still_leads_to_the_graze() {
    for (name, adjusted, first) in
        [("linear", "alpha", "x"), ("cantilever_0_12", "Q", "q"), ("mems", "V", "x")]
    {
        let near = scene(name);
        let guess = near.grazing.guess.clone().unwrap();
        let second = near.model.states[1].clone();
        let keys = [
            format!("grazing.guess.{first}"),
            format!("grazing.guess.{second}"),
            "grazing.guess.theta".into(),
        ];
        let offsets = [-0.1, 0.1, 0.1];
        let values: Vec<_> = guess
            .iter()
            .zip(offsets)
            .map(|(value, offset)| format!("{:?}", value + offset))
            .collect();
        let overrides: Vec<_> = keys.iter().map(String::as_str).zip(values).collect();
        let far = scene_with(name, &overrides);
        let expected = parameter(&near, &orbit(&near), adjusted);
        let orbit = orbit(&far);
        assert!(relative(parameter(&far, &orbit, adjusted), expected) < 1e-28, "{name}");
        assert!(
            (orbit.guess_distance.unwrap() - 0.03_f64.sqrt()).abs() < 0.01,
            "{name} {:?}",
            orbit.guess_distance
        );
    }
}

#[test]
fn multipliers_and_xi_do_not_depend_on_the_section() {
    let kinds: [&[(&str, &str)]; 3] = [
        &[("section.kind", "tangency")],
        &[("section.kind", "stroboscopic"), ("section.phase", "grazing")],
        &[("section.kind", "stroboscopic"), ("section.phase", "1")],
    ];
    let orbits: Vec<_> = kinds.iter().map(|kind| orbit(&scene_with("mems", kind))).collect();
    assert_eq!(orbits[0].section.coordinates, [0, 2]);
    assert_eq!(orbits[1].section.coordinates, [0, 1]);
    for orbit in &orbits[1..] {
        for (a, b) in orbit.multipliers.iter().zip(&orbits[0].multipliers) {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-14);
        }
        assert!(orbit.xi.iter().zip(&orbits[0].xi).all(|(a, b)| relative(*a, *b) < 1e-25));
    }
}

#[test]
fn van_der_pol_cycle_grazes_at_its_amplitude() {
    // Amplitude and period at mu = 1 from high-precision integrations in the literature of the van
    // der Pol equation.
    let text = r#"
        [model]
        name = "van der Pol"
        states = ["x", "v"]
        parameters = { delta = 1.9, r = 0.8 }
        [model.flow]
        x = "v"
        v = "(1 - x^2)*v - x"
        [[model.surface]]
        name = "stop"
        event = "delta - x"
        impact = { v = "-r*v" }
        [grazing]
        surface = "stop"
        solve_for = "delta"
        periods = 1
        guess = { x = 1.9, v = 0.0 }
        [section]
        kind = "tangency"
        [expansion]
        active = ["delta"]
        smooth_order = 2
        contact_weight = 3
        [window]
        depth = 1e-3
    "#;
    let orbit = orbit(&parsed(text, "van_der_pol", &NONE));
    assert!((orbit.parameters()[0].to_f64() - 2.008_619_860_874_843).abs() < 1e-14);
    assert!((orbit.period.to_f64() - 6.663_286_859_323_13).abs() < 1e-13);
    assert_eq!(orbit.multipliers.len(), 1);
}

#[test]
fn voltage_beyond_pull_in_has_no_periodic_orbit() {
    let reason = reason(&without_guess("mems", &[("V", "2.0")]));
    assert!(matches!(reason, NotLocated::NoPeriodicOrbit { value: 2.0, .. }), "{reason}");
}

#[test]
fn forcing_too_weak_for_any_damping_never_touches() {
    // The amplitude alpha/sqrt((1 - omega²)² + (2 zeta omega)²) is at most 1/2.24 here.
    let reason =
        reason(&without_guess("linear", &[("alpha", "1.0"), ("grazing.solve_for", "zeta")]));
    let NotLocated::NeverTouches { clearance, .. } = reason else { panic!("{reason}") };
    assert!((clearance - (1.0 - 1.0 / 2.24)).abs() < 1e-3, "{clearance}");
}

#[test]
fn a_parameter_without_effect_on_the_orbit_is_named() {
    // The restitution changes no orbit without contact, whose amplitude is 1/hypot(1 - w², 2 z w).
    let reason = reason(&without_guess("linear", &[("alpha", "1.0"), ("grazing.solve_for", "r")]));
    let NotLocated::Unmoved { parameter, clearance, .. } = &reason else { panic!("{reason}") };
    let amplitude = 1.0 / (1.0 - 1.8_f64.powi(2)).hypot(2.0 * 0.05 * 1.8);
    assert!(parameter == "r" && (clearance - (1.0 - amplitude)).abs() < 1e-9, "{reason}");
}

#[test]
fn an_event_function_of_the_wrong_sign_is_recognised() {
    // From the guess, and where the search finds orbits that stay below the stop or reach past it.
    let wrong = ("model.surface.0.event", "x - delta");
    let scenes = [
        scene_with("linear", &[wrong]),
        scene_with("linear", &[wrong, ("alpha", "2.0")]),
        without_guess("linear", &[wrong, ("alpha", "4.5")]),
        without_guess("linear", &[wrong, ("alpha", "1.0")]),
    ];
    for scene in scenes {
        let reason = reason(&scene);
        let NotLocated::WrongSide { surface, largest, .. } = &reason else { panic!("{reason}") };
        assert!(surface == "stop" && *largest < 1e-12, "{surface} {largest:e}");
        assert!(reason.to_string().ends_with(r#"change the sign: `event = "-(...)"`"#), "{reason}");
    }
}

#[test]
fn free_flow_that_is_too_slow_is_said_to_be() {
    let rate = reason(&scene_with("mems", &[("model.phase.rate", "1e-30")]));
    assert!(matches!(rate, NotLocated::TooSlow { steps: 1_000_000.., .. }), "{rate}");
    assert!(rate.to_string().contains("takes more than 1000000000 Taylor steps"), "{rate}");
    // A relaxation 30000 times as fast as the forcing, far from its graze.
    let stiff = [("zeta", "15000.0"), ("alpha", "0.1"), ("omega", "0.8")];
    let stiff = reason(&without_guess("linear", &stiff));
    assert!(matches!(stiff, NotLocated::TooSlow { steps: 10_000..1_000_000, .. }), "{stiff}");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn free_flow_whose_expressions_are_too_long_is_said_to_be_too_slow() {
    // Each name is a series of its own: a step of the flow takes 340 products more.
    let names = (1..=170).map(|n| format!("l{n} = \"sin(l{})\"\n", n - 1)).collect::<String>();
    let text = scenes::text("mems").replace("- 2*zeta*v - x", "- 2*zeta*v - x + 0.001*l170");
    let text = format!("{text}\n[model.let]\nl0 = \"x\"\n{names}");
    let reason = reason(&parsed(&text, "scene", &[("omega", "0.01")]));
    assert!(matches!(reason, NotLocated::TooSlow { products: 340.., .. }), "{reason}");
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn free_flow_whose_derivatives_need_far_shorter_steps_than_its_state_is_said_to_be_too_slow() {
    // x to the power 2^73, whose derivative is 2^73 times as steep: the state flies in a few steps.
    let names = (1..=73).map(|n| format!("l{n} = \"l{0}*l{0}\"\n", n - 1)).collect::<String>();
    let text = scenes::text("linear").replace("- 2*zeta*v - x", "- 2*zeta*v - x + 0.001*l73");
    let text = format!("{text}\n[model.let]\nl0 = \"x\"\n{names}");
    let reason = reason(&parsed(&text, "scene", &[] as &[(&str, &str); 0]));
    assert!(matches!(reason, NotLocated::TooSlow { steps: 1_000_000.., .. }), "{reason}");
}

#[test]
fn a_section_at_a_phase_without_digits_is_wrong_input() {
    let section = [("section.kind", "stroboscopic"), ("section.phase", "-1e300")];
    let error = locate(&scene_with("linear", &section)).unwrap_err();
    assert!(matches!(error, OrbitError::SectionPhase { .. }), "{error}");
}

#[test]
fn flat_top_is_a_degenerate_graze() {
    // The forcing makes x = cos(theta) − cos(2 theta)/4, whose second derivative vanishes at its
    // maximum 3/4.
    let text = scenes::text("linear").replace(
        "alpha*cos(theta) - 2*zeta*v - x",
        "0.75*cos(2*theta) + 2*zeta*(0.5*sin(2*theta) - sin(theta)) - 2*zeta*v - x",
    );
    let overrides = [
        ("omega", "1.0"),
        ("delta", "0.74"),
        ("grazing.solve_for", "delta"),
        ("grazing.guess.x", "0.74"),
        ("grazing.guess.theta", "0.02"),
    ];
    let reason = reason(&parsed(&text, "flat", &overrides));
    assert!(matches!(reason, NotLocated::DegenerateGraze { .. }), "{reason}");
}

#[test]
fn resonance_without_damping_is_singular() {
    // At zeta = 0, omega = 1/2 the monodromy is the identity: every start closes.
    let overrides =
        [("zeta", "0.0"), ("omega", "0.5"), ("alpha", "0.7"), ("grazing.guess.theta", "0.1")];
    let reason = reason(&scene_with("linear", &overrides));
    let NotLocated::Singular { re, im, .. } = reason else { panic!("{reason}") };
    assert!((re - 1.0).hypot(im) < 1e-6, "{re} {im}");
}

#[test]
fn functions_away_from_their_corners_leave_the_orbit_as_it_is() {
    let flow = |rest: &str| format!("alpha*cos(theta) - 2*zeta*v - {rest}");
    // The orbit stays between -1.01 and 1; a reset may have its corners away from the grazes.
    let same = [
        ("model.surface.0.event", "delta - x*abs(x + 5)/(x + 5)".to_owned()),
        ("model.surface.0.impact.v", "-r*v*sign(x)".to_owned()),
        ("model.flow.v", flow("max(x, -30)")),
        ("model.flow.v", flow("x*abs(x + 5)/(x + 5)")),
    ];
    let plain = orbit(&scene("linear"));
    for change in same {
        let orbit = orbit(&scene_with("linear", std::slice::from_ref(&change)));
        let pairs = orbit.parameters().iter().zip(plain.parameters());
        let moved = pairs.map(|(a, b)| (*a - *b).magnitude());
        let moved = moved.fold(0.0, f64::max);
        assert!(moved < 1e-25, "{change:?}: {moved:e}");
    }
}

#[test]
fn a_corner_at_the_graze_or_along_the_orbit_is_named_with_its_expression() {
    let flow = |rest: &str| format!("alpha*cos(theta) - 2*zeta*v - x - 0.1*{rest}");
    let corners = [
        ("model.flow.v", flow("abs(x - delta)"), "abs"),
        ("model.flow.v", flow("sign(v)"), "sign"),
        ("model.flow.v", flow("max(x, 0.3)"), "max"),
        ("model.flow.v", flow("min(cos(theta), 0.5)"), "min"),
        ("model.surface.0.event", "delta - x + abs(v)".to_owned(), "abs"),
        // Away from the graze the minima of the other branch would be overlooked.
        ("model.surface.0.event", "delta - abs(x)".to_owned(), "abs"),
        ("model.surface.0.event", "min(delta - x, 3*delta + 2.5*x)".to_owned(), "min"),
        ("model.surface.0.impact.v", "-r*abs(v)".to_owned(), "abs"),
    ];
    for (place, expression, name) in corners {
        let scene = scene_with("linear", &[(place, expression)]);
        let reason = locate(&scene).unwrap().into_result().unwrap_err();
        assert!(
            matches!(&reason, NotLocated::Corner { function, key, .. } if *function == name && key == place),
            "{place}, {name}: {reason}"
        );
    }
}

#[test]
fn a_function_without_a_series_at_0_is_named_where_the_flow_stops() {
    let without_series = [
        ("sqrt(1 - cos(theta - 1))", "sqrt"),
        // A power whose exponent is no number is kept in this form.
        ("exp(0.5*log(1 - cos(theta - 1)))", "^"),
        ("(1 - cos(theta - 1))^(0.4 + 2*zeta)", "^"),
        ("(1 - cos(theta - 1))*log(1 - cos(theta - 1))", "log"),
        ("(1 - cos(theta))^1.5", "^"),
        ("(0.4 - 0.4*cos(theta))^200.5*1.25^200.5", "^"),
    ];
    for (force, name) in without_series {
        let flow = format!("alpha*{force} - 2*zeta*v - x");
        let guess = "{ x = 1.0, v = 0.0, theta = 0.0 }";
        let scene = scene_with("linear", &[("model.flow.v", &*flow), ("grazing.guess", guess)]);
        let reason = locate(&scene).unwrap().into_result().unwrap_err();
        let NotLocated::NoSeries { function, key, at } = &reason else {
            panic!("{force}: {reason}");
        };
        assert_eq!((*function, &**key), (name, "model.flow.v"), "{force}");
        let phase = at.0.last().map_or(f64::NAN, |(_, phase)| *phase);
        let expected: f64 = if force.contains("- 1)") { 1.0 } else { 0.0 };
        // Both phases are zeros of the cosine's distance from 1.
        assert!((phase - expected).cos() > 1.0 - 1e-6, "{force}: {at}");
    }
    // A phase that no step begins at is flown over, rightly: the force has 401 derivatives there.
    let flow = "alpha*(0.5 - 0.5*cos(theta))^200.5 - 2*zeta*v - x".to_owned();
    let guess = "{ x = 1.0, v = 0.0, theta = 4.1 }";
    let changes =
        [("model.flow.v", &*flow), ("grazing.guess", guess), ("model.parameters.omega", "0.7")];
    let found = orbit(&scene_with("linear", &changes));
    // Sum of the Fourier series of the response.
    let alpha = found.parameters()[3].to_f64();
    assert!((alpha - 4.828_624_216_113_812).abs() < 1e-11, "{alpha}");
}

#[test]
fn an_orbit_of_one_period_is_not_taken_for_one_of_several() {
    for (name, periods) in [("linear", 2), ("mems", 3)] {
        let periods_named = periods.to_string();
        let scene = scene_with(name, &[("grazing.periods", &periods_named)]);
        let location = locate(&scene).expect("no wrong input");
        let Location::NotLocated(reason) = location else {
            panic!("{name}: located an orbit that repeats");
        };
        assert!(
            matches!(reason, NotLocated::Repeats { times, .. } if times == periods),
            "{reason:?}"
        );
        let words = reason.to_string();
        assert!(words.contains(&format!("run {periods} times")), "{words}");
        assert!(words.contains("`periods = 1` is that orbit"), "{words}");
    }
}

#[test]
fn an_orbit_that_touches_another_surface_is_asked_to_name_that_passage() {
    let keys = [("grazing.passages", "[\"right\"]"), ("grazing.symmetry", "\"none\"")];
    let scene = scene_with("two_stops_t1", &keys);
    let Location::NotLocated(reason) = locate(&scene).expect("no wrong input") else {
        panic!("located an orbit with a graze that no passage stands for");
    };
    let NotLocated::TouchesElsewhere { surface, time, .. } = &reason else {
        panic!("{reason:?}");
    };
    assert_eq!(surface, "left");
    // Half a period of omega = 1.1 later.
    assert!((time - std::f64::consts::PI / 1.1).abs() < 1e-6, "{time}");
}
