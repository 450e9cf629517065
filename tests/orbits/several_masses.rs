//! A moving stop, two masses that hit each other, an oblique surface, a chain of three masses, and
//! an oscillator without forcing: where they graze and how `D` begins.
//!
//! Oracles: complex amplitudes of the linear systems, and kicks derived by hand.

use grazemap::expansion::Expander;
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{GrazingOrbit, OrbitError, locate};

use crate::support::complex::{Complex, solve};
use crate::support::scenes::{orbit, parameter};
use crate::support::systems::{STROBOSCOPIC, TANGENCY, scene};

fn dd(value: f64) -> Dd {
    Dd::from(value)
}

/// `1/(s² − ω² + 2 i ζ s ω)`: the response of an oscillator of frequency `s` and damping ratio `ζ`.
fn response(frequency: Dd, damping: Dd, omega: Dd) -> Complex {
    let imaginary = dd(2.0) * damping * frequency * omega;
    Complex::new(frequency * frequency - omega * omega, imaginary).inverse()
}

/// Largest distance of the located graze from a closed form: complex amplitudes of the positions
/// and of the distance travelled towards the stop, and the exact value of the adjusted parameter.
fn distance_from_closed_form(
    scene: &Scene,
    orbit: &GrazingOrbit,
    amplitudes: &[Complex],
    towards: Complex,
    adjusted: (&str, Dd),
) -> f64 {
    let omega = parameter(scene, orbit, "omega");
    let graze = orbit.grazing_point();
    // cos and sin of the grazing phase: exp(i theta) turns `towards` onto the real axis.
    let turn = towards.conjugate() * (dd(1.0) / towards.magnitude());
    let (sine, cosine) = graze.state[amplitudes.len() * 2].sin_cos();
    let mut errors = vec![
        parameter(scene, orbit, adjusted.0) - adjusted.1,
        cosine - turn.re,
        sine - turn.im,
        graze.normal_acceleration - omega * omega * towards.magnitude(),
    ];
    for (mass, &amplitude) in amplitudes.iter().enumerate() {
        let position = amplitude * turn;
        errors.push(graze.state[2 * mass] - position.re);
        errors.push(graze.state[2 * mass + 1] + omega * position.im);
    }
    errors.iter().map(Dd::magnitude_of).fold(0.0, f64::max)
}

/// Size of a number, by reference.
trait Magnitude {
    fn magnitude_of(&self) -> f64;
}

impl Magnitude for Dd {
    fn magnitude_of(&self) -> f64 {
        self.magnitude()
    }
}

#[test]
fn moving_stop_grazes_where_the_relative_amplitude_is_the_gap() {
    let scene = scene("moving_stop", TANGENCY);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let unit = response(dd(1.0), value("zeta"), value("omega"));
    let (sine, cosine) = value("psi").sin_cos();
    let wall = Complex::new(cosine, sine) * value("b");
    // |alpha unit − wall|² = delta², the positive root.
    let square = unit.magnitude() * unit.magnitude();
    let mixed = (unit * wall.conjugate()).re;
    let rest = value("b") * value("b") - value("delta") * value("delta");
    let alpha = (mixed + (mixed * mixed - square * rest).sqrt()) / square;
    let motion = unit * alpha;
    let error =
        distance_from_closed_form(&scene, &orbit, &[motion], motion - wall, ("alpha", alpha));
    // Rounding of double-double grown by conditions of up to 1e4.
    assert!(error < 1e-27, "{error:e}");
}

#[test]
fn two_masses_graze_where_their_relative_amplitude_is_the_gap() {
    let scene = scene("impact_pair", STROBOSCOPIC);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let first = response(dd(1.0), value("zeta"), value("omega"));
    let second = response(value("s"), value("zeta"), value("omega"));
    let force = value("delta") / (first - second).magnitude();
    let error = distance_from_closed_form(
        &scene,
        &orbit,
        &[first * force, second * force],
        (first - second) * force,
        ("A", force),
    );
    assert!(error < 1e-27, "{error:e}");
}

#[test]
fn an_oblique_stop_is_grazed_where_the_normal_amplitude_is_its_distance() {
    let scene = scene("oblique", TANGENCY);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let first = response(dd(1.0), value("zeta"), value("omega"));
    // The damping 2 zeta is the same for both, so the ratio of the second is zeta/s; sin is −i in
    // the phase of cos.
    let second = response(value("s"), value("zeta") / value("s"), value("omega"))
        * Complex::new(dd(0.0), dd(-1.0));
    let normal = first * value("a") + second * value("b");
    let force = value("c") / normal.magnitude();
    let error = distance_from_closed_form(
        &scene,
        &orbit,
        &[first * force, second * force],
        normal * force,
        ("F", force),
    );
    assert!(error < 1e-27, "{error:e}");
}

#[test]
fn the_last_of_three_masses_grazes_where_its_amplitude_is_the_gap() {
    let scene = scene("three_masses", STROBOSCOPIC);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let omega = value("omega");
    let stiffness = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]];
    let rows = (0..3).map(|row| {
        let entry = |column: usize| {
            let k = dd(stiffness[row][column]);
            let inertia = if row == column { dd(1.0) } else { dd(0.0) };
            let damping = value("a") * inertia + value("b") * k;
            Complex::new(k - omega * omega * inertia, omega * damping)
        };
        (0..3).map(entry).collect()
    });
    let force = [1.0, 0.0, 0.0].map(|entry| Complex::new(dd(entry), dd(0.0)));
    let unit = solve(rows.collect(), force.to_vec());
    let force = value("delta") / unit[2].magnitude();
    let amplitudes: Vec<_> = unit.iter().map(|&amplitude| amplitude * force).collect();
    let error = distance_from_closed_form(&scene, &orbit, &amplitudes, amplitudes[2], ("f", force));
    assert!(error < 1e-27, "{error:e}");
}

/// Coefficients of `y` in the image of `D` at the graze, one per coordinate.
fn kicks(scene: &Scene, orbit: &GrazingOrbit) -> Vec<(String, Dd)> {
    let expander = Expander::new(scene, orbit).expect("one passage");
    let contact = expander.contact_in::<Dd>(0, 4).expect("a simple graze");
    let names = expander.variables().names.iter().cloned();
    names.zip(contact.linear.iter().map(|jet| jet.head())).collect()
}

fn assert_kicks(found: &[(String, Dd)], expected: &[(&str, Dd)]) {
    assert_eq!(found.len(), expected.len());
    for ((name, found), (expected_name, expected)) in found.iter().zip(expected) {
        assert_eq!(name, expected_name);
        // Rounding of the grazing point in double-double, through a few operations.
        let error = (*found - *expected).magnitude();
        assert!(error < 1e-25, "{name}: off by {error:e} of {expected}");
    }
}

/// On a tangency section a kick that changes the normal velocity by `w = (1 + r) sqrt(2 h'') y` is
/// followed by the free flow for the time `−w/h''`.
#[test]
fn a_moving_stop_kicks_by_the_relative_velocity() {
    for section in [STROBOSCOPIC, TANGENCY] {
        let scene = scene("moving_stop", section);
        let orbit = orbit(&scene);
        let value = |name| parameter(&scene, &orbit, name);
        let graze = orbit.grazing_point();
        let kick = (dd(1.0) + value("r")) * (dd(2.0) * graze.normal_acceleration).sqrt();
        let back = -kick / graze.normal_acceleration;
        let expected = if section == STROBOSCOPIC {
            [("x", dd(0.0)), ("v", -kick)]
        } else {
            [("x", graze.state[1] * back), ("theta", value("omega") * back)]
        };
        assert_kicks(&kicks(&scene, &orbit), &expected);
    }
}

#[test]
fn a_collision_kicks_both_masses_and_keeps_their_momentum() {
    for section in [STROBOSCOPIC, TANGENCY] {
        let scene = scene("impact_pair", section);
        let orbit = orbit(&scene);
        let value = |name| parameter(&scene, &orbit, name);
        let graze = orbit.grazing_point();
        let kick = (dd(1.0) + value("r")) * (dd(2.0) * graze.normal_acceleration).sqrt();
        let back = -kick / graze.normal_acceleration;
        let total = dd(1.0) + value("mu");
        let [first, second] = [-value("mu") * kick / total, kick / total];
        let expected = if section == STROBOSCOPIC {
            [("x1", dd(0.0)), ("v1", first), ("x2", dd(0.0)), ("v2", second)]
        } else {
            let (s, velocity) = (value("s"), graze.state[3]);
            let driven = value("A") * graze.state[4].sin_cos().1;
            let damped = dd(2.0) * value("zeta") * s * velocity;
            let acceleration = driven - damped - s * s * graze.state[2];
            [
                ("x1", graze.state[1] * back),
                ("x2", velocity * back),
                ("v2", second + acceleration * back),
                ("theta", value("omega") * back),
            ]
        };
        assert_kicks(&kicks(&scene, &orbit), &expected);
    }
}

#[test]
fn an_oblique_stop_kicks_along_its_normal() {
    let scene = scene("oblique", STROBOSCOPIC);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let graze = orbit.grazing_point();
    let kick = (dd(1.0) + value("r")) * (dd(2.0) * graze.normal_acceleration).sqrt();
    let expected =
        [("x", dd(0.0)), ("vx", -value("a") * kick), ("z", dd(0.0)), ("vz", -value("b") * kick)];
    assert_kicks(&kicks(&scene, &orbit), &expected);
}

/// A prestressed stop reverses the normal velocity `w = sqrt(2 h'') y` in the time `2 w/a`, `a =
/// h'' + k0 e`.
#[test]
fn a_prestressed_stop_kicks_the_last_of_three_masses_only() {
    let scene = scene("three_masses", STROBOSCOPIC);
    let orbit = orbit(&scene);
    let value = |name| parameter(&scene, &orbit, name);
    let acceleration = orbit.grazing_point().normal_acceleration;
    let prestress = value("k0") * value("e");
    let speed = (dd(2.0) * acceleration).sqrt();
    let kick = -dd(2.0) * prestress * speed / (acceleration + prestress);
    let expected = ["x1", "v1", "x2", "v2", "x3"].map(|name| (name, dd(0.0)));
    let expected = [expected.as_slice(), &[("v3", kick)]].concat();
    assert_kicks(&kicks(&scene, &orbit), &expected);
}

#[test]
fn an_orbit_without_forcing_is_found_from_a_guess_only() {
    let mut scene = scene("self_excited", TANGENCY);
    scene.grazing.guess = None;
    assert_eq!(locate(&scene), Err(OrbitError::AutonomousWithoutGuess));
}

/// Without forcing and with two states, a grazing impact only moves the state along the orbit: `D`
/// begins with `y²`, where the kick `−(1 + r) v` leaves `x` lower by `(1 − r²)` of the depth.
#[test]
fn a_planar_oscillator_without_forcing_has_no_square_root() {
    let scene = scene("planar", TANGENCY);
    let orbit = orbit(&scene);
    assert!(orbit.xi.iter().all(|xi| xi.magnitude() < 1e-28));
    let expander = Expander::new(&scene, &orbit).expect("one passage");
    let contact = expander.contact_in::<Dd>(0, 4).expect("a simple graze");
    assert!(contact.linear[0].head().magnitude() < 1e-28);
    let r = parameter(&scene, &orbit, "r");
    let error = contact.quadratic[0].head() - (r * r - dd(1.0));
    assert!(error.magnitude() < 1e-28, "{error}");
}
