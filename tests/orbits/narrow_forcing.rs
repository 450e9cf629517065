//! Grazing orbits of linear oscillators under pulses and smoothed square waves, against the Fourier
//! series of their response, which shares nothing with the integrators.

use std::f64::consts::TAU;

use crate::support::scenes::{grazing_by, parameter};

const KICK: &str = include_str!("../data/outside/f03_short_kick_lost.toml");
const PULSE: &str = include_str!("../data/outside/f03b_pulse_alone.toml");
const SQUARE_WAVE: &str = include_str!("../data/outside/f03c_square_wave.toml");
const CONSTANT_TANGENT: &str = include_str!("../data/outside/f04_tanh_overflows.toml");

/// The value of a parameter at which a scene grazes.
fn located(text: &str, adjusted: &str, set: &[(&str, &str)]) -> f64 {
    let (scene, orbit) = grazing_by(text, "forcing.toml", set);
    parameter(&scene, &orbit, adjusted).to_f64()
}

/// The values of the scenes' heads: as many digits as were printed.
fn assert_is(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{found}, not {expected}");
}

#[test]
fn a_short_kick_beside_a_harmonic_drive_is_felt() {
    assert_is(located(KICK, "A", &[]), 0.485_611_441_523_984_4, 1e-13);
    assert_is(located(KICK, "A", &[("K", "1000")]), 0.353_528_672_23, 1e-10);
}

#[test]
fn a_pulse_alone_makes_the_orbit_graze_however_narrow_it_is() {
    for (sharpness, expected, digits) in [
        ("100", 4.814_034_455_834_232, 1e-13),
        ("200", 6.777_431_459_976_53, 1e-13),
        ("1000", 15.100_452_779_892_2, 1e-13),
        ("1e4", 47.713_337_186_6, 1e-11),
    ] {
        assert_is(located(PULSE, "P", &[("K", sharpness)]), expected, digits);
    }
}

#[test]
fn smoothed_square_waves_make_the_orbit_graze_however_steep_they_are() {
    for (sharpness, expected, digits) in [
        ("20", 0.389_187_657_879_24, 1e-13),
        ("50", 0.388_767_568_561_1, 1e-12),
        ("100", 0.388_707_711_956_48, 1e-13),
        ("200", 0.388_692_753_863_85, 1e-13),
        ("1000", 0.388_687_967_785, 1e-11),
    ] {
        assert_is(located(SQUARE_WAVE, "A", &[("K", sharpness)]), expected, digits);
    }
}

#[test]
fn a_hyperbolic_tangent_of_a_large_constant_is_one() {
    for value in ["100", "800", "1e4"] {
        let found = located(CONSTANT_TANGENT, "A", &[("K", value)]);
        assert_is(found, 0.463_303_356_344_415, 1e-15);
    }
}

/// A linear oscillator under a forcing of height `P`.
fn oscillator(forcing: &str) -> String {
    let rate = format!("P*({forcing}) - 2*zeta*v - x");
    PULSE.replace("P*exp(K*(cos(theta) - 1)) - 2*zeta*v - x", &rate)
}

/// Largest value over a period of the response to a forcing of height 1 with these values.
fn largest_response(forcing: impl Fn(f64) -> f64, damping: f64, frequency: f64) -> f64 {
    const SAMPLES: usize = 1 << 12;
    const HARMONICS: usize = 1500;
    let angle = |sample: usize| TAU * sample as f64 / SAMPLES as f64;
    let values: Vec<f64> = (0..SAMPLES).map(|sample| forcing(angle(sample))).collect();
    let circle: Vec<(f64, f64)> = (0..SAMPLES).map(|sample| angle(sample).sin_cos()).collect();
    // x = Σ (a_n cos nθ + b_n sin nθ).
    let response: Vec<(f64, f64)> = (0..HARMONICS)
        .map(|n| {
            let at = |sample: usize| circle[n * sample % SAMPLES];
            let sum = |part: &dyn Fn((f64, f64)) -> f64| -> f64 {
                (0..SAMPLES).map(|sample| values[sample] * part(at(sample))).sum()
            };
            let share = if n == 0 { 1.0 } else { 2.0 } / SAMPLES as f64;
            let (a, b) = (share * sum(&|(_, cosine)| cosine), share * sum(&|(sine, _)| sine));
            let rate = n as f64 * frequency;
            let (spring, damper) = (1.0 - rate * rate, 2.0 * damping * rate);
            let size = spring * spring + damper * damper;
            ((a * spring - b * damper) / size, (b * spring + a * damper) / size)
        })
        .collect();
    let x = |theta: f64| -> f64 {
        let terms = response.iter().enumerate();
        terms
            .map(|(n, (a, b))| {
                let (sine, cosine) = (n as f64 * theta).sin_cos();
                a * cosine + b * sine
            })
            .sum()
    };
    let best = (0..256).map(|k| TAU * f64::from(k) / 256.0).max_by(|a, b| x(*a).total_cmp(&x(*b)));
    let (mut at, mut step) = (best.unwrap_or(0.0), TAU / 256.0);
    while step > 1e-8 {
        let moved = [at - step, at + step].into_iter().max_by(|a, b| x(*a).total_cmp(&x(*b)));
        match moved {
            Some(moved) if x(moved) > x(at) => at = moved,
            _ => step *= 0.5,
        }
    }
    x(at)
}

/// A pulse's name, its text and its values.
type Pulse = (&'static str, fn(f64) -> f64);

#[test]
fn pulses_of_other_shapes_make_the_orbit_graze_at_the_height_of_the_fourier_series() {
    let pulses: [Pulse; 6] = [
        ("exp(-(sin((theta - 1)/2)/0.02)^2)", |t| {
            (-((0.5 * (t - 1.0)).sin() / 0.02).powi(2)).exp()
        }),
        ("1/cosh(60*sin((theta - 4)/2))^2", |t| (60.0 * (0.5 * (t - 4.0)).sin()).cosh().powi(-2)),
        ("1/(1 + 1e3*(1 - cos(theta - 2)))", |t| 1.0 / (1.0 + 1e3 * (1.0 - (t - 2.0).cos()))),
        ("((1 + cos(theta))/2)^400", |t| (0.5 * (1.0 + t.cos())).powi(400)),
        ("1 + tanh(40*(cos(theta) - 0.9))", |t| 1.0 + (40.0 * (t.cos() - 0.9)).tanh()),
        ("sqrt(sin(theta)^2 + 1e-4) + cos(theta)", |t| (t.sin().powi(2) + 1e-4).sqrt() + t.cos()),
    ];
    for (text, values) in pulses {
        let found = located(&oscillator(text), "P", &[]);
        let largest = largest_response(values, 0.05, 0.7);
        // The series end where their terms are below 1e-12 of the first.
        assert!((found * largest - 1.0).abs() < 1e-10, "{text}: {found}, 1/{largest}");
    }
}
