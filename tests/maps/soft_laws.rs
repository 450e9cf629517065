//! Leading laws of soft impacts, their radius in y, and laws that have no expansion.

use grazemap::expansion::{
    Contact, ContactLawError, Expander, ExpansionError, LeadingLaw, PowerProblem,
};
use grazemap::model::Scene;

use crate::support::scenes::{orbit, parsed, text};

fn scene_of(name: &str, edits: &[(&str, &str)], overrides: &[(&str, &str)]) -> Scene {
    let text = edits.iter().fold(text(name).to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "nothing to edit: {from}");
        text.replace(from, to)
    });
    parsed(&text, name, overrides)
}

const ZERO_TIME: [(&str, &str); 1] = [("section.kind", "stroboscopic")];

/// Leading laws at zero net time, of u and of v.
fn zero_time_laws(name: &str) -> (Vec<LeadingLaw>, f64) {
    let scene = scene_of(name, &[], &ZERO_TIME);
    let orbit = orbit(&scene);
    let laws = Expander::new(&scene, &orbit)
        .expect("an analytic law")
        .leading_laws(0)
        .expect("a simple release");
    let laws = laws.into_iter().map(|law| law.expect("within y^8")).collect();
    (laws, orbit.grazing_point().normal_acceleration.to_f64())
}

fn check(name: &str, laws: &[LeadingLaw], expected: [(u32, f64); 2]) {
    for (law, (exponent, coefficient)) in laws.iter().zip(expected) {
        let error = (law.coefficient.to_f64() / coefficient - 1.0).abs();
        assert_eq!(law.exponent, f64::from(exponent), "{name}");
        assert!(error < 1e-14, "{name}: {} for {coefficient}", law.coefficient.to_f64());
    }
}

/// Closed forms: tests/data/soft/symbolic_leading_terms.json, with a = h'' and the forcing's rate
/// J.
#[test]
fn leading_laws_of_the_four_systems_have_the_exponents_and_coefficients_of_the_closed_forms() {
    let r1 = 0.03;
    let two = 2.0_f64.sqrt();
    let (laws, a) = zero_time_laws("soft_a");
    let k2 = 33.0;
    // J = d/dt (A cos) at the top: u''' = J − R1 u'' − k1 u' = 0 and u'' = −a give J = −R1 a.
    let jerk = -r1 * a;
    check(
        "soft_a",
        &laws,
        [
            (5, 4.0 * two * k2 * (jerk + 2.0 * a * r1) / (15.0 * a.powf(2.5))),
            (3, -4.0 * two * k2 / (3.0 * a.sqrt())),
        ],
    );
    let (laws, a) = zero_time_laws("soft_b");
    check("soft_b", &laws, [(3, -2.0 * two * 0.5 / (3.0 * a.sqrt())), (2, -0.5)]);
    let (laws, a) = zero_time_laws("soft_c");
    let b = 3.64 * 1.2;
    check(
        "soft_c",
        &laws,
        [(2, -4.0 * (b / (a + b)).powi(2)), (1, -2.0 * (2.0 * a).sqrt() * b / (a + b))],
    );
    let (laws, a) = zero_time_laws("soft_d");
    let b = 10.0 * 0.05;
    check(
        "soft_d",
        &laws,
        [(2, -4.0 * (b / (a + b)).powi(2)), (1, -2.0 * (2.0 * a).sqrt() * b / (a + b))],
    );
}

/// Released at the surface the damper gives back what it took, at order y²: with contact time
/// t = 2 √(2/a) y and v = −a (s − t/2), the spring and the damper contribute at order y³.
#[test]
fn release_at_the_surface_moves_the_law_of_the_damper_to_the_third_power() {
    let (laws, _) = zero_time_laws("soft_b_surface");
    assert_eq!(laws[1].exponent, 3.0);
    let (zero_force, _) = zero_time_laws("soft_b");
    assert_eq!(zero_force[1].exponent, 2.0);
}

#[test]
fn leading_law_of_a_rigid_stop_is_its_kick() {
    let scene = scene_of("linear", &[], &ZERO_TIME);
    let orbit = orbit(&scene);
    let laws = Expander::new(&scene, &orbit).expect("rigid").leading_laws(0).expect("laws");
    let law = laws[1].expect("a kick");
    let kick = -1.8 * (2.0 * orbit.grazing_point().normal_acceleration.to_f64()).sqrt();
    assert_eq!(law.exponent, 1.0);
    assert!((law.coefficient.to_f64() / kick - 1.0).abs() < 1e-14);
}

/// `xi_n = −∂h/∂u [Mⁿ]_12 β`, `β = sqrt(h''/2)` times the leading coefficient of D.
#[test]
fn xi_of_a_prestressed_stop_is_that_of_its_leading_law() {
    let scene = scene_of("soft_c", &[], &ZERO_TIME);
    let orbit = orbit(&scene);
    let (a, pressed) = (orbit.grazing_point().normal_acceleration.hi, 3.64 * 1.2);
    let natural = (1.0_f64 - 0.015 * 0.015).sqrt();
    assert_eq!(orbit.xi.len(), 6);
    for (periods, xi) in (1..).zip(&orbit.xi) {
        let time = f64::from(periods) * orbit.period.hi;
        let coupling = (-0.015 * time).exp() * (natural * time).sin() / natural;
        let expected = 2.0 * a * (pressed / (a + pressed)) * coupling;
        assert!((xi.hi - expected).abs() < 1e-14, "{periods}: {} {expected}", xi.hi);
    }
}

/// If D begins with y² or y³, β is the direction of that law, scaled so that ∇h'·β = h'': `xi_n =
/// h'' [Mⁿ]_12`.
#[test]
fn xi_of_softer_stops_follows_the_direction_of_their_leading_law() {
    let natural = (1.0_f64 - 0.015 * 0.015).sqrt();
    for name in ["soft_a", "soft_b", "soft_b_surface"] {
        let orbit = orbit(&scene_of(name, &[], &[]));
        let a = orbit.grazing_point().normal_acceleration.hi;
        assert_eq!(orbit.xi.len(), 6, "{name}");
        for (periods, xi) in (1..).zip(&orbit.xi) {
            let time = f64::from(periods) * orbit.period.hi;
            let expected = a * (-0.015 * time).exp() * (natural * time).sin() / natural;
            assert!((xi.hi - expected).abs() < 1e-14, "{name}, {periods}");
        }
    }
}

/// Two masses whose stop is carried by the second, of a third of the first one's: the contact
/// pushes both.
const CARRIED_STOP: &str = r#"
[model]
name = "a stop carried by the second mass"
states = ["x1", "v1", "x2", "v2"]
parameters = { k0 = 20.0, e = 0.0, omega = 1.1, d = 1.0 }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x1 = "v1"
v1 = "cos(theta) - 0.05*v1 - x1 + x2"
x2 = "v2"
v2 = "3*(0.5*cos(theta) - 0.02*v2 - 3*x2 + x1)"
[[model.surface]]
name = "stop"
event = "d - x1 + x2"
contact = { v1 = "free - k0*(x1 - x2 - d + e)", v2 = "free + 3*k0*(x1 - x2 - d + e)" }
[grazing]
surface = "stop"
solve_for = "d"
[section]
kind = "stroboscopic"
"#;

/// The leading coefficients `c` of D at zero net time span β: `xi_n / xi_1 = ∇h Mⁿ c / ∇h M c`.
#[test]
fn xi_follows_the_leading_coefficients_of_a_contact_that_pushes_two_masses() {
    for e in ["0", "0.1"] {
        let scene = parsed(CARRIED_STOP, "carried", &[("e", e)]);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        let laws = expander.leading_laws(0).expect("a simple release");
        let laws: Vec<_> = laws.into_iter().map(|law| law.expect("a law")).collect();
        let first = laws.iter().map(|law| law.exponent).reduce(f64::min).expect("four laws");
        assert_eq!(first, if e == "0" { 3.0 } else { 1.0 });
        let leading = |law: &LeadingLaw| {
            if law.exponent == first { law.coefficient.to_f64() } else { 0.0 }
        };
        let mut vector: Vec<f64> = laws.iter().map(leading).collect();
        assert!(vector[1] != 0.0 && (vector[3] / vector[1] + 3.0).abs() < 1e-12);
        let images: Vec<f64> = (0..6)
            .map(|_| {
                let rows = orbit.monodromy.iter();
                let row = |row: &Vec<grazemap::numeric::Dd>| {
                    row.iter().zip(&vector).map(|(m, v)| m.hi * v).sum()
                };
                vector = rows.map(row).collect();
                vector[2] - vector[0]
            })
            .collect();
        for (xi, image) in orbit.xi.iter().zip(&images) {
            let error = xi.hi / orbit.xi[0].hi - image / images[0];
            assert!(error.abs() < 1e-12, "e = {e}: {error:e}");
        }
    }
}

/// Scene, overrides, `k2` and `R2`.
type RadiusCase = (&'static str, &'static [(&'static str, &'static str)], f64, f64);

/// The radii are those of the uniform laws in the stiffness, where their square roots or arc
/// tangents end.
#[test]
fn radius_in_depth_follows_the_stiffness() {
    let cases: [RadiusCase; 4] = [
        ("soft_a", &[], 33.0, 0.0),
        ("soft_a", &[("k2", "3300")], 3300.0, 0.0),
        ("soft_b", &[], 2.0, 0.5),
        ("soft_b", &[("k2", "100"), ("R2", "0.05")], 100.0, 0.05),
    ];
    for (name, overrides, k2, r2) in cases {
        let scene = scene_of(name, &[], overrides);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        let radius = expander.depth_radius(0).expect("a series").expect("an infinite series");
        let a = orbit.grazing_point().normal_acceleration.to_f64();
        let expected =
            if name == "soft_a" { (a / (2.0 * k2)).sqrt() } else { r2 * (a / 2.0).sqrt() / k2 };
        println!("{name} {overrides:?}: {radius:.4e}, law {expected:.4e}");
        assert!((0.6..1.6).contains(&(radius / expected)), "{name}: {radius:e} for {expected:e}");
    }
}

fn error_of(edits: &[(&str, &str)]) -> ExpansionError {
    let scene = scene_of("soft_a", edits, &[]);
    let orbit = orbit(&scene);
    let expander = match Expander::new(&scene, &orbit) {
        Ok(expander) => expander,
        Err(error) => return error,
    };
    expander.contact(0, 4).expect_err("a law without expansion")
}

const SPRING: &str = "free - k2*(u - sigma)";
const RELEASE: &str = "contact = { v = \"free - k2*(u - sigma)\" }";

#[test]
fn a_contact_that_pulls_inward_is_refused_with_its_acceleration() {
    let error = error_of(&[(SPRING, "free + 2")]);
    let ExpansionError::ContactLaw(ContactLawError::Acceleration {
        contact_acceleration,
        free_acceleration,
        ..
    }) = error
    else {
        panic!("{error}")
    };
    assert!((contact_acceleration - (free_acceleration - 2.0)).abs() < 1e-14);
}

#[test]
fn a_contact_without_release_near_the_graze_is_refused() {
    let error = error_of(&[(
        RELEASE,
        "contact = { v = \"free - k2*(u - sigma)\" }\nrelease = \"1 + k2*(u - sigma)\"",
    )]);
    assert!(
        matches!(error, ExpansionError::ContactLaw(ContactLawError::NoRelease { release, .. }) if (release - 1.0).abs() < 1e-14),
        "{error}"
    );
}

#[test]
fn laws_that_are_not_analytic_on_the_surface_are_refused_by_the_function_that_is_not() {
    let cases =
        [("free - k2*max(u - sigma, 0)", "max"), ("free - k2*(u - sigma) - abs(v)*v", "abs")];
    for (law, name) in cases {
        let error = error_of(&[(SPRING, law)]);
        let ExpansionError::ContactLaw(ContactLawError::NotAnalytic { function, .. }) = &error
        else {
            panic!("{law}: {error}")
        };
        assert_eq!(function, name);
    }
}

#[test]
fn powers_of_the_penetration_without_an_expansion_are_refused_with_the_reason() {
    let power = "parameters = { R1";
    let exponent = "parameters = { p = 1.5, R1";
    let cases = [
        ("free - k2*d^0.04", 0.04, PowerProblem::OutOfRange),
        ("free - k2*(u^2 - sigma^2)^1.5", 1.5, PowerProblem::OtherBase),
        ("free - k2*(d + v)^1.5", 1.5, PowerProblem::OtherBase),
    ];
    for (law, expected, reason) in cases {
        let error = error_of(&[(SPRING, law)]);
        let ExpansionError::ContactLaw(ContactLawError::Power { exponent, problem, .. }) = &error
        else {
            panic!("{law}: {error}")
        };
        assert_eq!((*exponent, *problem), (expected, reason), "{law}");
    }
    let active = ("active = [\"A\"", "active = [\"A\", \"p\"");
    let error = error_of(&[(SPRING, "free - k2*d^p"), (power, exponent), active]);
    let problem = PowerProblem::ActiveExponent;
    assert!(
        matches!(error, ExpansionError::ContactLaw(ContactLawError::Power { problem: found, .. }) if found == problem),
        "{error}"
    );
    let on_rate = ("free - k2*(u - sigma)\" }", "free\", u = \"v + d^1.5\" }");
    let error = error_of(&[on_rate]);
    assert!(error.to_string().contains("acts on the rate of the gap"), "{error}");
}

#[test]
fn whole_powers_of_the_depth_are_expanded() {
    // The cube of the depth acts at the power 2·3 + 1 of y.
    let scene = scene_of("soft_a", &[(SPRING, "free - k2*(u - sigma)^3")], &ZERO_TIME);
    let orbit = orbit(&scene);
    let laws = Expander::new(&scene, &orbit).expect("analytic").leading_laws(0).expect("laws");
    assert_eq!(laws[1].map(|law| law.exponent), Some(7.0));
}

/// The release function `(sigma − u) v` vanishes first where `v` does, but with two powers of y to
/// divide by and a trivial root: the same contact, found with other balances.
#[test]
fn equal_releases_give_equal_mappings_whatever_is_divided_out() {
    let contact = |release: &str| {
        let contact = "contact = { v = \"free - k2*(u - sigma + d)\" }";
        let law = format!("{contact}\nrelease = \"{release}\"");
        let scene = scene_of("soft_c", &[(contact, &law)], &[]);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        expander.contact(0, 8).expect("a release")
    };
    let (plain, product) = (contact("v"), contact("(sigma - u)*v"));
    assert_eq!(plain.depth.space().order(), product.depth.space().order());
    let of = |contact: &Contact| [contact.linear.clone(), contact.quadratic.clone()].concat();
    for (a, b) in of(&plain).iter().zip(&of(&product)) {
        let error =
            (a - &b.reinterpret(a.space(), &[Some(0), Some(1), Some(2), Some(3)])).max_abs();
        assert!(error < 1e-13 * a.max_abs(), "{error:e} of {:e}", a.max_abs());
    }
}

#[test]
fn a_release_that_only_touches_zero_is_refused() {
    let law = format!("{RELEASE}\nrelease = \"v^2\"");
    let error = error_of(&[(RELEASE, &law)]);
    assert!(
        matches!(error, ExpansionError::ContactLaw(ContactLawError::NotSimple { power: 1, .. })),
        "{error}"
    );
}

/// The free acceleration plus `omega² sigma` is 0 at the grazing point, and not beside it.
#[test]
fn a_release_that_vanishes_at_the_grazing_point_alone_is_refused() {
    let law = format!("{RELEASE}\nrelease = \"v + 0.1*(A*cos(theta) - k1*u + omega^2*sigma)\"");
    let error = error_of(&[(RELEASE, &law)]);
    assert!(
        matches!(error, ExpansionError::ContactLaw(ContactLawError::NotUniform { .. })),
        "{error}"
    );
}
