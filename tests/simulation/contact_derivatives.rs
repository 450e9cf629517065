//! First variations of a return through a contact whose force is a power of the depth, compared
//! with differences in double-double and, next to the graze, with the return without contact.

use grazemap::hybrid::{DirectReturn, HybridSystem, ReturnOutcome, ReturnSection, Variation};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real, converted};

use crate::support::scenes::{NONE, parsed, text};

const POWERS: [&str; 7] = ["0.8", "1.1", "1.25", "1.5", "2", "2.5", "3.7"];

/// The soft oscillator of the scene `soft_a` with another force.
fn soft(force: &str) -> Scene {
    let text = text("soft_a").replace("free - k2*(u - sigma)", &format!("free - ({force})"));
    parsed(&text, "soft", &NONE)
}

/// Works with returns to the tangency of the stop, one period apart.
fn with_returns<S: Real, R>(scene: &Scene, work: impl FnOnce(&mut DirectReturn<'_, S>) -> R) -> R {
    let system = HybridSystem::new(&scene.model);
    let parameters: Vec<S> = converted(&scene.model.parameter_values());
    let section = ReturnSection::Tangency { surface: 0 };
    work(&mut DirectReturn::over_periods(&system, &parameters, section, 1).expect("a section"))
}

/// Displacement and phase of the image of a tangency at a depth, by the depth.
fn slopes<S: Real>(scene: &Scene, depth: f64) -> [f64; 2] {
    let start = [S::one() + S::from_f64(depth), S::zero(), S::from_f64(0.08)];
    let mut directions = [Variation {
        state: vec![S::one(), S::zero(), S::zero()],
        parameters: vec![S::zero(); scene.model.parameters.len()],
    }];
    let (image, changes) = with_returns::<S, _>(scene, |returns| {
        returns.onto_section(&start, 1, &mut directions);
        returns.varied(&start, &directions).expect("a finite state")
    });
    assert_eq!(image.outcome, ReturnOutcome::Returned, "{depth}");
    let changes = changes.unwrap_or_else(|| panic!("no derivatives at {depth:e}"));
    [0, 2].map(|component: usize| changes[0].state[component].to_f64())
}

/// Slopes by differences in double-double.
fn differences(scene: &Scene, depth: f64) -> [f64; 2] {
    let step = Dd::from(depth * 1e-6);
    let sides = [Dd::ONE, -Dd::ONE].map(|side| {
        let start = [Dd::ONE + Dd::from(depth) + side * step, Dd::ZERO, Dd::from(0.08)];
        with_returns::<Dd, _>(scene, |returns| returns.image(&start).expect("a finite state"))
    });
    let change = |at: usize| (sides[0].state[at] - sides[1].state[at]) / (step + step);
    [0, 2].map(|component: usize| change(component).to_f64())
}

#[test]
fn derivatives_through_a_contact_of_any_power_are_those_of_differences() {
    for power in POWERS {
        let exponent: f64 = power.parse().expect("a number");
        for force in [format!("k2*d^{power}"), format!("k2*d^{power}*(1 + 0.3*v)")] {
            let scene = soft(&force);
            for depth in [1e-2, 1e-4, 1e-6, 1e-8] {
                let exact = differences(&scene, depth);
                let size = exact[0].abs().max(exact[1].abs());
                // A stretch of a thousand roundings passes at constant rates: of a force `k d^p` met
                // at a speed of about the root of the depth, the share `k d^p/v` is left out.
                let stretch = 1e3 * f64::EPSILON;
                let left_out = 100.0 * stretch.powf(exponent) / depth.sqrt();
                let doubles = (slopes::<f64>(&scene, depth), 1e-12 + left_out);
                for (found, most) in [(slopes::<Dd>(&scene, depth), 1e-12), doubles] {
                    let error = found.iter().zip(exact).map(|(a, b)| (a - b).abs() / size);
                    let error = error.fold(0.0, f64::max);
                    assert!(error <= most, "{force} at {depth:e}: {error:e} of {most:e}");
                }
            }
        }
    }
}

#[test]
fn next_to_the_graze_derivatives_tend_to_those_of_the_return_without_contact() {
    for power in POWERS {
        let scene = soft(&format!("k2*d^{power}"));
        let exponent: f64 = power.parse().expect("a number");
        for depth in [1e-10, 1e-13, 1e-16, 1e-20, 1e-24, 1e-28] {
            let free = slopes::<Dd>(&scene, -depth);
            // The change of the velocity by the depth, in a return that amplifies by two.
            let most = 300.0 * exponent * f64::powf(depth, exponent - 0.5) + 1e-6;
            for found in [slopes::<Dd>(&scene, depth), slopes::<f64>(&scene, depth)] {
                let error = (found[0] - free[0]).abs().max((found[1] - free[1]).abs());
                assert!(error <= most, "{power} at {depth:e}: {error:e} {found:?} {free:?}");
            }
        }
    }
}
