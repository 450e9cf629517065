//! Published systems whose orbits all impact, by direct simulation. The head of each scene says how
//! its numbers are known.

use std::f64::consts::{PI, TAU};

use grazemap::hybrid::{
    DirectReturn, HybridSystem, Return, ReturnOutcome, ReturnSection, Variation,
};
use grazemap::model::Scene;

use crate::support::scenes::parsed;

const IMPACT_PAIR: &str = include_str!("../data/outside/o04_impact_pair.toml");
const INVERTED_PENDULUM: &str = include_str!("../../gallery/outside/scenes/inverted_pendulum.toml");

/// Work with returns of one period to the phase that they start at.
fn with_returns<R>(scene: &Scene, work: impl FnOnce(&mut DirectReturn<'_, f64>) -> R) -> R {
    let system = HybridSystem::new(&scene.model);
    let values = scene.model.parameter_values();
    let parameters: Vec<f64> = values.iter().map(|value| value.to_f64()).collect();
    let section = ReturnSection::OtherPhase;
    work(&mut DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase"))
}

/// The 300th image of a position, velocity and phase, one period apart, and the return from there.
fn settled(pair: &Scene, start: [f64; 3]) -> (Vec<f64>, Return<f64>) {
    with_returns(pair, |returns| {
        let mut state = start.to_vec();
        for _ in 0..300 {
            state = returns.image(&state).expect("a finite state").state;
        }
        let image = returns.image(&state).expect("a finite state");
        (state, image)
    })
}

/// Speed of the symmetric orbit between walls this far apart, in units of their amplitude and
/// rate: `d = π cos(th) (1 + r)/(1 − r) + 2 sin(th)`, the speed is `2 cos(th)/(1 − r)`.
fn symmetric_speed(d: f64) -> f64 {
    let (r, along) = (0.5, 2.0);
    let across = PI * (1.0 + r) / (1.0 - r);
    let phase = f64::atan2(along, across) - (d / across.hypot(along)).acos();
    2.0 * phase.cos() / (1.0 - r)
}

#[test]
fn a_ball_between_moving_walls_settles_on_the_symmetric_orbit_of_its_closed_form() {
    for (d, printed) in [(6.0, 3.086_419), (3.0, 2.007_432)] {
        let pair = parsed(IMPACT_PAIR, "impact_pair", &[("d", format!("{d:?}"))]);
        let (start, image) = settled(&pair, [0.3, 0.2, 0.0]);
        let speed = symmetric_speed(d);
        assert!((speed - printed).abs() < 5e-7, "{speed}");
        assert_eq!((image.outcome, &image.hits[..]), (ReturnOutcome::Returned, &[1, 1][..]));
        // Rounding, over a restitution that attracts.
        assert!(image.impact_speeds.iter().all(|own| (own - speed).abs() < 1e-12), "{image:?}");
        assert!((image.state[0] - start[0]).abs() < 1e-12, "{start:?} {image:?}");
    }
}

/// The symmetric orbit is lost at `d = 2.59996552359838`. On an orbit of period one the speeds at
/// both walls are equal: what one impact takes from the ball the other gives back.
#[test]
fn below_the_loss_of_symmetry_a_ball_settles_on_either_of_two_mirror_images() {
    let pair = parsed(IMPACT_PAIR, "impact_pair", &[("d", "2.5")]);
    let (state, image) = settled(&pair, [0.3, 0.2, 0.0]);
    let (mirrored, other) = settled(&pair, [-0.3, -0.2, PI]);
    for image in [&image, &other] {
        assert_eq!((image.outcome, &image.hits[..]), (ReturnOutcome::Returned, &[1, 1][..]));
        let [one, two] = image.impact_speeds[..] else { panic!("{image:?}") };
        assert!((one - two).abs() < 1e-12 && (one - symmetric_speed(2.5)).abs() > 1e-2, "{one}");
    }
    for (own, mirrored) in state.iter().zip(&mirrored).take(2) {
        assert!((own + mirrored).abs() < 1e-12, "{state:?} {mirrored:?}");
    }
}

#[test]
fn the_saddle_of_an_inverted_pendulum_between_stops_has_its_printed_multipliers() {
    let set = [("wall", format!("{}", 0.25 * PI))];
    let pendulum = parsed(INVERTED_PENDULUM, "inverted_pendulum", &set);
    let saddle = [0.331_057_12, -0.279_586_39, 0.0];
    let along = |component: usize| Variation {
        state: (0..3).map(|other| f64::from(u8::from(other == component))).collect(),
        parameters: vec![0.0; pendulum.model.parameters.len()],
    };
    let directions = [along(0), along(1)];
    let (image, changes) = with_returns(&pendulum, |returns| returns.varied(&saddle, &directions))
        .expect("a finite state");
    let changes = changes.expect("derivatives");
    // Printed to eight digits, which one period makes ten times as large.
    for (image, saddle) in image.state.iter().zip(saddle) {
        assert!((image - saddle).abs() < 5e-8, "{image} for {saddle}");
    }
    assert_eq!(image.hits, [1, 0]);
    // Leaves with 0.6677305969 after a restitution of 0.9.
    assert!((0.9 * image.impact_speeds[0] - 0.667_730_596_9).abs() < 5e-8, "{image:?}");
    let [[a, c], [b, d]] =
        [0, 1].map(|number| [changes[number].state[0], changes[number].state[1]]);
    let (half, product) = (0.5 * (a + d), a * d - b * c);
    let root = (half * half - product).sqrt();
    // Their change over the rounding of the saddle.
    for (found, printed) in [(half - root, -2.143_625_27), (half + root, -0.554_272_73)] {
        assert!((found - printed).abs() < 1e-6, "{found} for {printed}");
    }
    // By Liouville's formula.
    let exact = 0.81 * (0.1 * TAU / 1.64).exp();
    assert!((product - exact).abs() < 1e-12, "{product} for {exact}");
}
