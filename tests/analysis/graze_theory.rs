//! Theory of a graze, compared with guarded iteration nearby.

use grazemap::analysis::{AnalysisError, MeasuredSide, measure_graze};
use grazemap::iteration::Period;
use grazemap::orbit::{AttractorRoute, Expectation, GrazeTheory, graze_theory};

use crate::Case;

fn both(name: &str) -> (GrazeTheory, Vec<MeasuredSide>) {
    let case = Case::new(name);
    let theory = graze_theory(&case.scene, &case.orbit).expect("an orbit");
    let measured = measure_graze(&case.scene, &case.orbit, &case.map, &theory.parameter);
    (theory, measured.expect("the adjusted parameter is active"))
}

/// The gap of the linear oscillator's steady state is `δ − α/√((1 − ω²)² + (2ζω)²)`.
#[test]
fn the_linear_oscillator_jumps_where_its_first_condition_is_negative() {
    let (theory, measured) = both("linear");
    let slope = -1.0 / (1.0_f64 - 1.8 * 1.8).hypot(2.0 * 0.05 * 1.8);
    assert!((theory.gap_slope - slope).abs() < 1e-12);
    // xi_1 = (2/Ω)(1 + r) δ ω² exp(−2πζ/ω) sin(πΩ/ω), Ω = 2 sqrt(1 − ζ²).
    let rate = 2.0 * (1.0_f64 - 0.05 * 0.05).sqrt();
    let pi = std::f64::consts::PI;
    let xi = |n: f64| {
        (2.0 / rate)
            * 1.8
            * 1.8
            * 1.8
            * (-2.0 * n * pi * 0.05 / 1.8).exp()
            * (n * pi * rate / 1.8).sin()
    };
    for (n, value) in (1..=8).zip(&theory.xi) {
        assert!((value - xi(f64::from(n))).abs() < 1e-12, "xi_{n}");
    }
    assert_eq!(theory.expectation, Expectation::Jump { n: 1 });
    let near: Vec<bool> = measured.iter().map(|side| side.near).collect();
    assert_eq!(near, [true, true, false, false]);
    assert!(measured[..2].iter().all(|side| !side.contact && side.period == Period::Periodic(1)));
    // The orbit of one contact a period stands before the graze, as T_1(1) is negative.
    let first = theory.orbits.iter().find(|orbit| orbit.returns == 1).expect("one contact");
    let sum: f64 = (1..400).map(|n| xi(f64::from(n))).sum();
    assert!((first.sum - sum).abs() < 1e-11 && sum < 0.0);
}

#[test]
fn the_cantilever_adds_periods_as_its_one_contact_orbits_gain_stability() {
    let (theory, measured) = both("cantilever_3_5");
    let route = Some(AttractorRoute::PeriodAddingWithChaos);
    assert_eq!(theory.expectation, Expectation::Persists { route });
    assert!(measured.iter().all(|side| side.near), "{measured:?}");
    let unstable_within = |returns: usize| {
        let orbit = theory.orbits.iter().find(|orbit| orbit.returns == returns);
        orbit.expect("every one of them exists").unstable_within
    };
    for side in measured.iter().filter(|side| side.offset > 0.0) {
        let Period::Periodic(period) = side.period else { panic!("{side:?}") };
        assert!(unstable_within(period) < side.offset, "{side:?}");
    }
    assert_eq!(measured[2].period, Period::Periodic(4));
    assert!(measured[2].offset < unstable_within(3));
}

#[test]
fn soft_stops_have_no_square_root_and_their_orbit_stays() {
    let (theory, measured) = both("soft_a");
    assert_eq!((theory.contact_power, theory.expectation), (Some(3.0), Expectation::Finite));
    assert!(theory.orbits.is_empty());
    assert!(measured.iter().all(|side| side.near && side.period == Period::Periodic(1)));
}

#[test]
fn nothing_is_said_of_what_is_not_known() {
    let case = Case::new("two_stops_t1");
    let theory = graze_theory(&case.scene, &case.orbit).expect("an orbit");
    assert_eq!(theory.expectation, Expectation::SeveralPassages);
    assert!(theory.gap_slope.is_nan() && theory.orbits.is_empty());
    let (theory, _) = both("mems");
    assert_eq!(theory.expectation, Expectation::Unstable);
    let case = Case::new("linear");
    let measured = measure_graze(&case.scene, &case.orbit, &case.map, "zeta");
    assert!(matches!(measured, Err(AnalysisError::NotActive { .. })));
}
