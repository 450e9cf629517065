//! Maps at extreme values: the claims of the study, checked on a few of its rows.
//!
//! The reference is a closed form of the linear oscillator, or direct simulation in double-double;
//! the estimates are the expansion's own. Cases and measurement are those of the study `extremes`.

use grazemap::expansion::{Expander, MapOrders};
use grazemap_studies::extremes::cases::{ExtremeCase, extreme_cases};
use grazemap_studies::extremes::data::{Coefficients, ExtremeAxis, ExtremeOutcome, Measured};
use grazemap_studies::extremes::measure::measure_extreme;

use crate::support::scenes::{orbit, scene_with};

fn cases(axis: ExtremeAxis, scene: &str) -> impl Iterator<Item = ExtremeCase> {
    let cases = extreme_cases().into_iter();
    cases.filter(move |case| case.axis == axis && case.scene == scene)
}

fn measured(case: &ExtremeCase) -> Measured {
    match measure_extreme(case).outcome {
        ExtremeOutcome::Measured(measured) => measured,
        ExtremeOutcome::Refused { stage, message } => panic!("{case:?}: {stage}: {message}"),
    }
}

fn refused(case: &ExtremeCase) -> String {
    match measure_extreme(case).outcome {
        ExtremeOutcome::Refused { message, .. } => message,
        ExtremeOutcome::Measured(measured) => panic!("{case:?}: {measured:?}"),
    }
}

#[test]
fn a_contact_keeps_the_digits_it_promises_at_depths_of_thirty_decades() {
    for case in cases(ExtremeAxis::Depth, "linear") {
        let measured = measured(&case);
        assert!(!measured.is_silent_loss(), "{case:?}: {measured:?}");
        // Offsets carry 16 digits at any depth; the coefficients lose one.
        assert!(case.depth > 1e-5 || measured.contact > 14.5, "{measured:?}");
    }
}

#[test]
fn a_stop_stiffer_by_1e8_has_a_simulation_that_is_true_to_the_map() {
    let case = cases(ExtremeAxis::Stiffness, "soft_c").last();
    let measured = measured(&case.expect("stiffnesses"));
    assert!(!measured.is_silent_loss(), "{measured:?}");
    // 3e-33 beside the stop the simulation would leave 12.6 digits; 14.6 are promised.
    assert!(measured.map.is_some_and(|digits| digits > 14.0), "{measured:?}");
}

#[test]
fn a_restitution_of_zero_loses_no_digits_and_is_not_said_to() {
    let case = cases(ExtremeAxis::Restitution, "linear").next().expect("r = 0");
    let measured = measured(&case);
    assert!(measured.contact > 14.5 && measured.rounding > 14.0, "{measured:?}");
}

#[test]
fn lengths_of_thirty_decades_give_the_same_map() {
    for case in cases(ExtremeAxis::Scale, "linear") {
        let measured = measured(&case);
        assert!(!measured.is_silent_loss(), "{case:?}: {measured:?}");
        // The series is the one of length 1 in other units: 23.4 digits are predicted there.
        assert!((measured.truncation - 23.4).abs() < 0.1, "{case:?}: {measured:?}");
        assert!(measured.contact > 14.5, "{case:?}: {measured:?}");
        assert!(measured.grazing.is_some_and(|digits| digits > 25.0), "{measured:?}");
    }
}

#[test]
fn double_multipliers_of_one_and_flat_grazes_are_refused_by_name() {
    let last = cases(ExtremeAxis::Multiplier, "linear").last().expect("omega = 1/2");
    let message = refused(&last);
    assert!(message.contains("the multiplier nearest 1 is 1.0"), "{message}");
    let flat = cases(ExtremeAxis::NormalAcceleration, "flat_top").find(|case| case.value == 0.0);
    let message = refused(&flat.expect("h'' = 0"));
    assert!(message.contains("degenerate graze"), "{message}");
}

#[test]
fn coefficients_in_single_precision_give_seven_digits_and_in_double_double_thirty() {
    let least = |coefficients| match coefficients {
        Coefficients::Single => 6.5,
        Coefficients::Double => 14.5,
        Coefficients::DoubleDouble => 29.0,
    };
    for case in cases(ExtremeAxis::Coefficients, "linear") {
        let measured = measured(&case);
        assert!(measured.contact > least(case.coefficients), "{measured:?}");
    }
}

#[test]
fn orders_of_thirty_lose_nothing_that_is_not_said() {
    for scene in ["linear", "soft_a", "soft_c"] {
        let case = cases(ExtremeAxis::Orders, scene).last().expect("N = W = 30");
        let measured = measured(&case);
        assert!(!measured.is_silent_loss(), "{scene}: {measured:?}");
    }
}

/// The estimate is cut off at the sixteen digits of a double: only bounds within them can fail.
/// Next to an elastic stop the section's coordinate changes by a share of `1 - r`, of which
/// rounding leaves four digits.
#[test]
fn lost_digits_stay_between_none_and_all_of_a_double() {
    for (restitution, [least, most]) in [
        ("0", [0.5, 2.0]),
        ("1e-12", [0.5, 2.0]),
        ("0.999999999999", [10.0, 12.0]),
        ("1", [0.5, 2.0]),
    ] {
        let scene = scene_with("linear", &[("r", restitution)]);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("a simple graze");
        let orders = MapOrders { smooth_order: 3, contact_weight: 8 };
        let lost = expander.lost_digits(orders).expect("expanded");
        let digits = lost.smooth.iter().chain(&lost.discontinuity);
        let worst = digits.copied().fold(0.0, f64::max);
        assert!((least..most).contains(&worst), "r = {restitution}: {lost:?}");
    }
}
