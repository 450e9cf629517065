//! Resets of several components, moving and oblique surfaces, against closed forms.
//!
//! Each system splits into a normal motion that a stop makes bounce and motions that no impact
//! touches.

use grazemap::hybrid::{EventKind, HybridSystem, Outcome, Simulator, Trajectory};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real};

/// Two masses 1 and 2 whose springs have one frequency, the first behind the second; `force` acts
/// on the first.
///
/// The centre of mass moves as if there were no impacts, the distance `x2 − x1` as a single mass
/// does at a stop.
fn pair(spring: f64, force: &str) -> String {
    format!(
        r#"
[model]
name = "two masses that collide"
states = ["x1", "v1", "x2", "v2"]
parameters = {{ r = 0.8, p = 1.0, gap = 0.0, k = {spring} }}
[model.let]
closing = "v1 - v2"
[model.phase]
name = "theta"
rate = "1"
period = "2*pi"
[model.flow]
x1 = "v1"
v1 = "{force} - k*x1"
x2 = "v2"
v2 = "-k*x2"
[[model.surface]]
name = "other"
event = "gap + x2 - x1"
impact = {{ v1 = "v1 - (1 + r)*2/3*closing", v2 = "v2 + (1 + r)/3*closing" }}
[grazing]
solve_for = "p"
"#
    )
}

/// A mass pushed with `p` against a stop at `delta + b cos θ`, met with its velocity relative to
/// the stop.
const MOVING_STOP: &str = r#"
[model]
name = "a moving stop"
states = ["x", "v"]
parameters = { r = 0.8, p = 0.1, delta = 0.25, b = 0.1 }
[model.let]
w = "-b*sin(theta)"
[model.phase]
name = "theta"
rate = "1"
period = "2*pi"
[model.flow]
x = "v"
v = "p"
[[model.surface]]
name = "stop"
event = "delta + b*cos(theta) - x"
impact = { v = "-r*v + (1 + r)*w" }
[grazing]
solve_for = "p"
"#;

/// A mass in the plane before a straight wall with the normal (3, 4)/5; `slide` of its tangential
/// velocity is kept.
fn incline(spring: f64, slide: &str) -> String {
    format!(
        r#"
[model]
name = "an oblique wall"
states = ["x", "vx", "z", "vz"]
parameters = {{ r = 0.8, p = 1.0, c = 0.0, k = {spring}, slide = {slide} }}
[model.let]
normal = "(3*vx + 4*vz)/5"
along = "(4*vx - 3*vz)/5"
[model.flow]
x = "vx"
vx = "-k*x"
z = "vz"
vz = "p - k*z"
[[model.surface]]
name = "wall"
event = "c - 3*x - 4*z"
impact = {{ vx = "-r*normal*3/5 + slide*along*4/5", vz = "-r*normal*4/5 - slide*along*3/5" }}
[grazing]
solve_for = "p"
"#
    )
}

fn run<S: Real>(text: &str, parameters: &[S], state: &[S], duration: S) -> Trajectory<S> {
    let scene = Scene::parse(text, "test").unwrap_or_else(|error| panic!("{error}"));
    let system = HybridSystem::new(&scene.model);
    let mut simulator = Simulator::new(&system, parameters).expect("finite parameters");
    simulator.set_state(state).expect("a finite state");
    simulator.run(duration).expect("a finite duration")
}

fn dd(value: f64) -> Dd {
    Dd::from(value)
}

/// The decimal 0.8, exact to a double-double.
fn restitution() -> Dd {
    dd(4.0) / dd(5.0)
}

fn impacts<S: Real>(found: &Trajectory<S>) -> Vec<(S, S)> {
    let events = found.events.iter();
    events
        .filter_map(|event| match event.kind {
            EventKind::Impact { speed, .. } => Some((event.time, speed)),
            _ => None,
        })
        .collect()
}

fn time_of<S: Real>(found: &Trajectory<S>, wanted: EventKind<S>) -> S {
    let event = found.events.iter().find(|event| event.kind == wanted);
    event.unwrap_or_else(|| panic!("no {wanted:?} in {found:?}")).time
}

fn close<S: Real>(found: S, expected: S, tolerance: f64, what: &str) {
    let error = (found - expected).abs().to_f64();
    assert!(error < tolerance, "{what}: {error:e}");
}

/// Asserts that impacts follow half a period of `x'' = −x` apart, each slower by the restitution.
fn check_bounces(found: &Trajectory<Dd>, first: f64, count: usize) {
    let impacts = impacts(found);
    assert_eq!(impacts.len(), count);
    let mut speed = dd(first);
    for (number, (time, met)) in impacts.into_iter().enumerate() {
        close(time, Dd::PI * dd((number + 1) as f64), 1e-28, "time");
        close(met, speed, 1e-28, "speed");
        speed *= restitution();
    }
}

#[test]
fn colliding_masses_keep_their_momentum_and_lose_their_relative_speed() {
    // x2 − x1 = sin t at first; the stop at its middle makes every half period a bounce.
    let duration = dd(20.0);
    let parameters = [restitution(), dd(0.0), dd(0.0), dd(1.0)];
    let start = [0.125, 0.75, 0.125, 1.75, 0.0].map(dd);
    let found = run(&pair(1.0, "p*cos(theta)"), &parameters, &start, duration);
    assert_eq!(found.outcome, Outcome::Completed);
    check_bounces(&found, 1.0, 6);
    let (sine, cosine) = duration.sin_cos();
    // Mass 3 in all: position and momentum of the centre of mass, times 3.
    let (position, momentum) = (dd(0.375), dd(0.75 + 3.5));
    let two = dd(2.0);
    let centre = found.state[0] + two * found.state[2];
    close(centre, position * cosine + momentum * sine, 1e-29, "centre");
    let moved = found.state[1] + two * found.state[3];
    close(moved, momentum * cosine - position * sine, 1e-29, "momentum");
    let amplitude = restitution().powi(6);
    let distance = found.state[2] - found.state[0];
    close(distance, amplitude * sine.abs(), 1e-29, "distance");
}

#[test]
fn a_pushed_mass_chatters_against_another_and_they_go_on_as_one() {
    // The first mass approaches the second with the acceleration 1 from rest at the distance 1/2.
    let duration = dd(12.0);
    let parameters = [restitution(), dd(1.0), dd(0.0), dd(0.0)];
    let start = [-0.5, 0.25, 0.0, 0.25, 0.0].map(dd);
    let found = run(&pair(0.0, "p"), &parameters, &start, duration);
    assert_eq!(found.outcome, Outcome::Completed);
    // The fall takes 1; the flights 2 r, 2 r², ... sum to 8.
    close(time_of(&found, EventKind::Stick), dd(9.0), 1e-21, "rest");
    // The centre of mass starts at −1/6 with the velocity 1/4, and the force 1 accelerates the mass
    // 3.
    let sixth = dd(1.0) / dd(6.0);
    let centre = -sixth + dd(0.25) * duration + sixth * duration * duration;
    let velocity = dd(0.25) + duration / dd(3.0);
    for (component, expected) in [(0, centre), (1, velocity), (2, centre), (3, velocity)] {
        close(found.state[component], expected, 1e-28, "as one");
    }
}

#[test]
fn masses_stuck_together_part_where_the_push_changes_sign() {
    // Without restitution the masses stay together from their meeting at θ < π/2 to θ = π/2.
    let duration = dd(3.0);
    let parameters = [dd(0.0), dd(1.0), dd(0.0), dd(0.0)];
    let start = [-0.125, 0.75, 0.0, 0.25, 0.0].map(dd);
    let found = run(&pair(0.0, "p*cos(theta)"), &parameters, &start, duration);
    assert_eq!(found.outcome, Outcome::Completed);
    close(time_of(&found, EventKind::Release), Dd::FRAC_PI_2, 1e-28, "release");
    // Momentum: 3/4 + 2/4 + sin t; at π/2 all of it is shared by the mass 3, then the second keeps
    // its velocity.
    let together = (dd(1.25) + dd(1.0)) / dd(3.0);
    close(found.state[3], together, 1e-28, "the second mass");
    let (sine, _) = duration.sin_cos();
    close(found.state[1], together + sine - dd(1.0), 1e-28, "the first mass");
}

/// `(φ, V)` of the motion that meets the moving stop once a period at its phase φ with the speed V
/// = p π.
///
/// The flight from −V to V takes 2V/p = 2π; the impact demands −V = −r V + (1 + r) w, `w = −b sin
/// φ`.
fn locked(p: Dd, b: Dd) -> (Dd, Dd) {
    let (r, one) = (restitution(), dd(1.0));
    let speed = p * Dd::PI;
    let sine = speed * (one - r) / ((one + r) * b);
    (sine.atan2((one - sine * sine).sqrt()), speed)
}

#[test]
fn a_moving_stop_is_met_once_a_period_with_its_velocity() {
    let (p, b, delta) = (dd(0.125), dd(0.125), dd(0.25));
    let (phase, speed) = locked(p, b);
    let (sine, cosine) = phase.sin_cos();
    // A quarter of a period before the impact.
    let ahead = Dd::FRAC_PI_2;
    let half = dd(0.5);
    let x = delta + b * cosine - speed * ahead + half * p * ahead * ahead;
    let start = [x, speed - p * ahead, phase - ahead];
    let parameters = [restitution(), p, delta, b];
    let found = run(MOVING_STOP, &parameters, &start, dd(4.0) * Dd::PI * dd(2.0));
    let impacts = impacts(&found);
    assert_eq!((impacts.len(), found.outcome), (4, Outcome::Completed));
    for (number, (time, met)) in impacts.into_iter().enumerate() {
        // An error grows at an impact, by less than 10 here.
        let tolerance = 1e-29 * 10f64.powi(number as i32);
        let expected = ahead + dd(2.0 * number as f64) * Dd::PI;
        close(time, expected, tolerance, "time");
        close(met, speed + b * sine, tolerance, "relative speed");
    }
    close(found.state[0], x, 1e-25, "position after four periods");
}

#[test]
fn a_mass_rests_on_a_moving_stop_until_the_stop_falls_back_faster() {
    // h'' = −b cos θ − p: with p = b/2 the stop lets go at θ = 2π/3, at the velocity −b sin θ.
    let (p, b, delta) = (dd(0.125), dd(0.25), dd(0.5));
    let release = dd(2.0) * Dd::PI / dd(3.0);
    let start_phase = dd(-1.5);
    let duration = dd(4.5);
    for r in [0.0, 0.25] {
        let parameters = [dd(r), p, delta, b];
        let start = [delta, dd(0.125), start_phase];
        let found = run(MOVING_STOP, &parameters, &start, duration);
        assert_eq!(found.outcome, Outcome::Completed);
        let released = time_of(&found, EventKind::Release) + start_phase;
        close(released, release, 1e-28, "release");
        let (sine, cosine) = release.sin_cos();
        let after = duration + start_phase - release;
        let velocity = -b * sine + p * after;
        let position = delta + b * cosine - b * sine * after + dd(0.5) * p * after * after;
        close(found.state[0], position, 1e-28, "position");
        close(found.state[1], velocity, 1e-28, "velocity");
    }
}

#[test]
fn an_oblique_wall_reverses_the_normal_velocity_alone() {
    // (3x + 4z)/5 = −sin t at first, and every half period a bounce; (4x − 3z)/5 = cos t + sin t/2
    // throughout.
    let duration = dd(20.0);
    let parameters = [restitution(), dd(0.0), dd(0.0), dd(1.0), dd(1.0)];
    let rotate = |normal: f64, along: f64| {
        [3.0 * normal + 4.0 * along, 4.0 * normal - 3.0 * along].map(|value| dd(value) / dd(5.0))
    };
    let ([x, z], [vx, vz]) = (rotate(0.0, 1.0), rotate(-1.0, 0.5));
    let found = run(&incline(1.0, "1"), &parameters, &[x, vx, z, vz], duration);
    assert_eq!(found.outcome, Outcome::Completed);
    // The event function is 5 times the distance, and so are its speeds.
    check_bounces(&found, 5.0, 6);
    let (sine, cosine) = duration.sin_cos();
    let [x, _, z, _] = found.state[..] else { panic!("four components") };
    let (three, four, five) = (dd(3.0), dd(4.0), dd(5.0));
    let along = (four * x - three * z) / five;
    close(along, cosine + dd(0.5) * sine, 1e-29, "along the wall");
    let normal = (three * x + four * z) / five;
    close(normal, -restitution().powi(6) * sine.abs(), 1e-29, "distance");
}

#[test]
fn a_mass_comes_to_rest_on_an_incline_and_slides_on() {
    // The push 1 along z: 4/5 against the wall, −3/5 along it.
    let duration = dd(25.0);
    let parameters = [restitution(), dd(1.0), dd(0.0), dd(0.0), dd(1.0)];
    // At the distance 2/5 from the wall at rest, with the velocity 1 along it.
    let start =
        [-0.24, 0.8, -0.32, -0.6].map(|v| Dd::from_decimal(&v.to_string()).expect("digits"));
    let found = run(&incline(0.0, "1"), &parameters, &start, duration);
    assert_eq!(found.outcome, Outcome::Completed);
    // The fall takes 1; the flights 2 r, 2 r², ... sum to 8.
    close(time_of(&found, EventKind::Stick), dd(9.0), 1e-21, "rest");
    let [x, vx, z, vz] = found.state[..] else { panic!("four components") };
    let (three, four, five) = (dd(3.0), dd(4.0), dd(5.0));
    let along = (four * x - three * z) / five;
    let fifth = dd(3.0) / five;
    close(along, duration - dd(0.5) * fifth * duration * duration, 1e-27, "along");
    let sliding = (four * vx - three * vz) / five;
    close(sliding, dd(1.0) - fifth * duration, 1e-27, "sliding");
    close(three * x + four * z, dd(0.0), 1e-28, "on the wall");
    close(three * vx + four * vz, dd(0.0), 1e-28, "at rest against it");
}

#[test]
fn a_rough_wall_on_which_a_mass_slides_to_rest_has_no_sticking_field() {
    // Every impact takes 1 % of the velocity along the wall: infinitely many would take all of it.
    let parameters = [0.5, 1.0, 0.0, 0.0, 0.99];
    let found = run(&incline(0.0, "0.99"), &parameters, &[-0.24, 0.8, -0.32, -0.6], 25.0);
    let Outcome::NoStickingField { surface: 0, time } = found.outcome else {
        panic!("{:?}", found.outcome)
    };
    // The flights of a ball with restitution 1/2 sum to 3; the last of them are not flown.
    assert!(time > 2.5 && time < 3.0, "{time}");
}
