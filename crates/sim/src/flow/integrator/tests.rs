//! Taylor's method against closed forms and conserved quantities.

use super::*;
use crate::flow::{InputKind, samples};
use crate::numeric::Dd;

/// Undamped linear oscillator off resonance: `x = A cos ωt + B cos t + C sin t`.
fn linear_error<S: Real>(periods: f64) -> f64 {
    let field = samples::linear(&[InputKind::HeadOnly; 3]);
    let (omega, amplitude) = (S::from_f64(1.5), S::from_f64(0.7));
    let state = [S::from_f64(0.3), S::from_f64(-0.2), S::zero()];
    let duration = S::from_dd(Dd::TWO_PI) * S::from_f64(periods) / omega;
    let end =
        Integrator::new(&field).flow(&state, &[S::zero(), amplitude, omega], duration).unwrap();
    let forced = amplitude / (S::one() - omega * omega);
    let (sine, cosine) = duration.sin_cos();
    let (b, c) = (state[0] - forced, state[1]);
    let expected = [forced + b * cosine + c * sine, c * cosine - b * sine];
    (0..2).map(|i| (end[i] - expected[i]).magnitude()).fold(0.0, f64::max)
}

#[test]
fn linear_oscillator_returns_to_roundoff_after_one_period() {
    assert!(linear_error::<f64>(1.0) < 4e-15, "{:e}", linear_error::<f64>(1.0));
    assert!(linear_error::<Dd>(1.0) < 1e-30, "{:e}", linear_error::<Dd>(1.0));
}

#[test]
fn backward_time_is_as_accurate() {
    assert!(linear_error::<f64>(-1.0) < 4e-15);
    assert!(linear_error::<Dd>(-1.0) < 1e-30);
}

/// Relative error of `x = 1/(1 − t)` at `t = 1 − 2^{−10}`.
fn pole_error<S: Real>() -> f64 {
    let field = samples::quadratic();
    let end =
        Integrator::new(&field).flow(&[S::one()], &[], S::from_f64(1.0 - 1.0 / 1024.0)).unwrap();
    (end[0] / S::from_f64(1024.0) - S::one()).magnitude()
}

#[test]
fn solution_of_the_square_is_followed_to_its_pole() {
    // The flow multiplies relative errors by 1024; about fifty steps of an ulp each.
    assert!(pole_error::<f64>() < 50.0 * 1024.0 * 1.2e-16, "{:e}", pole_error::<f64>());
    assert!(pole_error::<Dd>() < 100.0 * 1024.0 * 2e-32, "{:e}", pole_error::<Dd>());
}

/// Change of the pendulum's energy over a time.
fn energy_change<S: Real>(duration: f64) -> f64 {
    let field = samples::pendulum();
    let mut integrator = Integrator::new(&field);
    let start = [S::from_f64(2.5), S::from_f64(0.3)];
    let before = integrator.step(&start, &[]).unwrap().watched_coefficients(0)[0];
    let end = integrator.flow(&start, &[], S::from_f64(duration)).unwrap();
    let after = integrator.step(&end, &[]).unwrap().watched_coefficients(0)[0];
    (after - before).magnitude()
}

#[test]
fn pendulum_keeps_its_energy() {
    assert!(energy_change::<f64>(100.0) < 3e-14, "{:e}", energy_change::<f64>(100.0));
    assert!(energy_change::<Dd>(100.0) < 1e-29, "{:e}", energy_change::<Dd>(100.0));
}

/// Distance from the start after one revolution of eccentricity one half.
fn kepler_error<S: Real>() -> f64 {
    let start = [S::from_f64(0.5), S::zero(), S::zero(), S::from_f64(3.0).sqrt()];
    let end =
        Integrator::new(&samples::kepler()).flow(&start, &[], S::from_dd(Dd::TWO_PI)).unwrap();
    (0..4).map(|i| (end[i] - start[i]).magnitude()).fold(0.0, f64::max)
}

#[test]
fn kepler_orbit_closes() {
    assert!(kepler_error::<f64>() < 1e-13, "{:e}", kepler_error::<f64>());
    assert!(kepler_error::<Dd>() < 1e-28, "{:e}", kepler_error::<Dd>());
}

#[test]
fn polynomial_solutions_take_the_longest_step() {
    let field = samples::linear(&[InputKind::HeadOnly; 3]);
    let mut integrator = Integrator::new(&field).with_max_step(7.0);
    let step = integrator.step(&[0.0, 0.0, 1.0], &[0.1, 0.0, 2.0]).unwrap();
    assert_eq!(step.length, 7.0);
    assert_eq!(integrator.flow(&[0.0; 3], &[0.1, 0.0, 2.0], 30.0).unwrap(), [0.0, 0.0, 60.0]);
}

#[test]
fn a_large_phase_does_not_change_the_step() {
    let field = samples::linear(&[InputKind::HeadOnly; 3]);
    let mut integrator = Integrator::new(&field);
    let mut length =
        |theta: f64| integrator.step(&[0.3, 0.1, theta], &[0.1, 2.0, 2.0]).unwrap().length;
    assert!((length(1e6 * std::f64::consts::TAU) / length(0.0) - 1.0).abs() < 0.01);
}

#[test]
fn leaving_the_domain_is_an_error() {
    let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
    let result = Integrator::new(&field).flow(&[1.0, 0.0, 0.5], &[0.02, 0.3, 0.6], 1.0);
    assert!(matches!(result, Err(FlowError::NotFinite { .. })), "{result:?}");
    let blow_up = Integrator::new(&samples::quadratic()).flow(&[1.0], &[], 2.0);
    assert!(blow_up.is_err(), "{blow_up:?}");
}

#[test]
fn bound_parameters_give_the_same_orbit() {
    let values = [0.05, 0.7, 1.5];
    let bound = values.map(|value| InputKind::Bound(Dd::from(value)));
    let (given, folded) = (samples::linear(&[InputKind::HeadOnly; 3]), samples::linear(&bound));
    let state = [0.3, -0.2, 0.1];
    let end = Integrator::new(&given).flow(&state, &values, 3.0).unwrap();
    let other = Integrator::new(&folded).flow(&state, &[0.0; 3], 3.0).unwrap();
    assert!(end.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-14), "{end:?} {other:?}");
}

const STARTS: [[f64; 3]; 8] = [
    [0.3, 0.1, 0.4],
    [0.0, 0.0, 0.0],
    [-0.2, 0.05, 1.3],
    [0.1, -0.3, 2.9],
    [0.25, 0.0, -0.7],
    [0.05, 0.2, 0.1],
    [0.31, -0.1, 0.9],
    [0.2, 0.2, -2.0],
];

/// Parameters, state and duration of a lane.
fn lane(lane: usize) -> ([f64; 3], [f64; 3], f64) {
    let shift = lane as f64 / 64.0;
    let duration = [5.0, -3.0, 0.0, 1e-3, 4.0, 9.0, 2.0, 7.0][lane];
    ([0.02 + shift, 0.2 - shift, 0.6 + shift], STARTS[lane], duration)
}

fn in_lanes(value: impl Fn(usize, usize) -> f64) -> [Lanes<8>; 3] {
    std::array::from_fn(|input| Lanes::from_fn(|lane| value(lane, input)))
}

#[test]
fn every_lane_has_the_bits_of_the_integrator_alone() {
    let kinds = [InputKind::HeadOnly; 3];
    for field in [samples::electrostatic(&kinds), samples::linear(&kinds)] {
        let parameters = in_lanes(|at, input| lane(at).0[input]);
        let mut state = in_lanes(|at, input| lane(at).1[input]);
        let durations = Lanes::from_fn(|at| lane(at).2);
        let carried = LaneIntegrator::new(&field).carry(&mut state, &parameters, durations);
        assert_eq!(carried.remaining, Lanes::splat(0.0));
        for at in 0..8 {
            let (parameters, start, duration) = lane(at);
            let alone = Integrator::new(&field).flow(&start, &parameters, duration);
            let found: Vec<_> = state.iter().map(|value| value[at].to_bits()).collect();
            let expected: Vec<_> = alone.unwrap().iter().map(|v| v.to_bits()).collect();
            assert_eq!(found, expected, "lane {at}");
        }
    }
}

#[test]
fn functions_of_states_have_the_bits_of_the_integrator_too() {
    let field = samples::pendulum();
    let mut lanes = LaneIntegrator::<4>::new(&field);
    let state = [Lanes([0.7, -2.0, 0.0, 3.1]), Lanes([0.4, 0.0, 0.0, -1.0])];
    let step = lanes.expand(&state, &[]);
    let mut alone = Integrator::new(&field);
    for lane in 0..4 {
        let single = alone.step(&state.map(|value| value[lane]), &[]).unwrap();
        assert_eq!(step.length[lane], single.length, "lane {lane}");
        let energy = step.watched_coefficients(0).iter().map(|c| c[lane].to_bits());
        let expected = single.watched_coefficients(0).iter().map(|c| c.to_bits());
        assert!(energy.eq(expected), "lane {lane}");
    }
}

#[test]
fn a_lane_that_leaves_the_domain_fails_alone() {
    let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
    let mut state = [Lanes([0.3, 1.0]), Lanes([0.1, 0.0]), Lanes([0.4, 0.5])];
    let parameters = [0.02, 0.3, 0.6].map(Lanes::splat);
    let duration = Lanes::splat(1.0);
    let carried = LaneIntegrator::new(&field).carry(&mut state, &parameters, duration);
    assert_eq!(carried.remaining[0], 0.0);
    assert!(!carried.not_finite.holds(0) && carried.not_finite.holds(1));
    let alone = Integrator::new(&field).flow(&[0.3, 0.1, 0.4], &[0.02, 0.3, 0.6], 1.0);
    assert_eq!(alone.unwrap()[0], state[0][0]);
}
