//! Soft stops of a wanted restitution, against closed forms and against numbers that mpmath
//! computed with 20 digits from the equations in the phase plane.

use grazemap::analysis::soft_stop::{SoftStop, StopInScene, StopLaw, StopSize, WantedImpact};

use crate::support::scenes;

/// Stop with these numbers and a unit mass.
fn stop(law: StopLaw, exponent: f64, stiffness: f64, damper: f64) -> SoftStop {
    SoftStop { law, exponent, mass: 1.0, stiffness, damper }
}

fn assert_near(found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{found:.17e}, expected {expected:.17e}: {error:.1e}");
}

/// The impact as `[restitution, time, depth]`.
fn impact(stop: &SoftStop, speed: f64) -> [f64; 3] {
    let impact = stop.impact(speed).expect("the mass comes back");
    [impact.restitution, impact.time, impact.depth]
}

#[test]
fn impacts_with_hertz_springs_agree_with_the_phase_plane() {
    // x'' = −x^(3/2) − 0.3 x' as an equation for the speed over √x away from the turn, and for √x
    // over the speed about it.
    let expected = [
        (StopLaw::HertzToSurface, [0.562_526_645_370_639_7, 3.441_697_575_511_817]),
        (StopLaw::HertzToForce, [0.620_680_970_177_901_8, 2.897_716_787_298_059]),
    ];
    for (law, [restitution, time]) in expected {
        let found = impact(&stop(law, 1.5, 1.0, 0.3), 1.0);
        assert_near(found[0], restitution, 1e-13);
        assert_near(found[1], time, 1e-13);
        assert_near(found[2], 0.893_548_921_097_583_7, 1e-13);
    }
}

#[test]
fn impacts_with_hunt_and_crossley_obey_the_equation_of_their_restitution() {
    // (1 + e) w = log((1 + w)/(1 − e w)) with w = c v, whatever the exponent; the depth is
    // ((p + 1)(w − log(1 + w))/w²)^(1/(p + 1)).
    for exponent in [0.5, 1.0, 1.5, 2.2, 3.0, 10.0] {
        for w in [0.05_f64, 0.3, 1.0, 3.0, 10.0] {
            let [e, _, depth] = impact(&stop(StopLaw::HuntCrossley, exponent, 1.0, w / 2.0), 2.0);
            let lost = (1.0 + e) * w - w.ln_1p() + (-e * w).ln_1p();
            // The slope by e is e w²/(1 − e w).
            assert!(lost.abs() * (1.0 - e * w) <= 1e-13 * (1.0 + w) * w * w, "{w} {e}: {lost:e}");
            let share = (exponent + 1.0) * (w - w.ln_1p()) / (w * w);
            assert_near(depth, (4.0 * share).powf(1.0 / (exponent + 1.0)), 1e-12);
        }
    }
    // By Lambert's function, with 30 digits.
    let found = impact(&stop(StopLaw::HuntCrossley, 1.5, 1.0, 0.3), 1.0);
    let expected = [0.832_869_792_265_601_7, 3.287_517_786_384_939, 1.017_932_927_558_274];
    found.iter().zip(expected).for_each(|(&found, expected)| assert_near(found, expected, 1e-13));
}

#[test]
fn closed_forms_of_linear_stops_are_the_flights_of_the_exponent_one() {
    for damper in [0.0, 0.1, 0.4, 1.0, 1.5, 2.0, 2.1, 5.0] {
        let pairs = [
            (StopLaw::LinearToForce, StopLaw::HertzToForce),
            (StopLaw::LinearToSurface, StopLaw::HertzToSurface),
        ];
        for (linear, flown) in pairs {
            let [closed, flown] =
                [linear, flown].map(|law| stop(law, 1.0, 1.0, damper).impact(1.0));
            assert_eq!(closed.is_some(), flown.is_some(), "{linear:?} {damper}");
            let Some((closed, flown)) = closed.zip(flown) else { continue };
            assert_near(flown.restitution, closed.restitution, 1e-12);
            assert_near(flown.time, closed.time, 1e-12);
            assert_near(flown.depth, closed.depth, 1e-12);
        }
    }
}

#[test]
fn a_spring_alone_has_the_contact_time_of_the_beta_function() {
    // 2 D B(1/2, 1/(p + 1))/((p + 1) v), D^(p + 1) = (p + 1) v²/2k.
    let beta = 2.943_275_184_324_704_7;
    let depth = (2.5_f64 * 9.0 / (2.0 * 40.0)).powf(0.4);
    let [restitution, time, deepest] = impact(&stop(StopLaw::HertzToForce, 1.5, 40.0, 0.0), 3.0);
    assert_near(restitution, 1.0, 1e-14);
    assert_near(deepest, depth, 1e-14);
    assert_near(time, depth / 3.0 * beta, 1e-14);
}

#[test]
fn a_stop_has_the_wanted_restitution_and_size() {
    for law in StopLaw::ALL {
        for restitution in [0.01, 0.1, 0.3, 0.5, 0.8, 0.95, 0.999, 1.0] {
            for exponent in [0.5, 1.5, 3.0] {
                for size in [StopSize::Time(2e-3), StopSize::Stiffness(7e4)] {
                    let wanted =
                        WantedImpact { restitution, speed: 0.3, mass: 2.5, exponent, size };
                    let words = format!("{law:?} {restitution} {exponent} {size:?}");
                    let stop = SoftStop::with_restitution(law, &wanted).expect(&words);
                    let found = stop.impact(0.3).expect(&words);
                    assert_near(found.restitution, restitution, 1e-12);
                    match size {
                        StopSize::Time(time) => assert_near(found.time, time, 1e-12),
                        StopSize::Stiffness(stiffness) => {
                            assert_eq!(stop.stiffness.to_bits(), stiffness.to_bits());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn only_linear_stops_keep_their_restitution_at_other_speeds() {
    let wanted = WantedImpact {
        restitution: 0.8,
        speed: 1.0,
        mass: 1.0,
        exponent: 1.5,
        size: StopSize::Time(1e-2),
    };
    let at_twice = |law| {
        let stop = SoftStop::with_restitution(law, &wanted).expect("a stop");
        stop.impact(2.0).expect("the mass comes back").restitution - 0.8
    };
    assert!(at_twice(StopLaw::LinearToForce).abs() < 1e-14);
    assert!(at_twice(StopLaw::LinearToSurface).abs() < 1e-14);
    // The viscous damper takes a smaller share of a fast impact, Hunt and Crossley's a larger one.
    assert!(at_twice(StopLaw::HuntCrossley) < -0.05);
    assert!(at_twice(StopLaw::HertzToForce) > 0.01);
    assert!(at_twice(StopLaw::HertzToSurface) > 0.01);
}

#[test]
fn the_error_of_a_rigid_stop_falls_with_the_contact_time() {
    let scene = scenes::scene("linear");
    let orbit = scenes::orbit(&scene);
    let stop = StopInScene::new(&scene, &orbit).expect("a stop that pushes");
    assert_eq!(stop.pushes().collect::<Vec<_>>(), [("v", -1.0)]);
    assert_eq!(stop.rate().expect("a velocity").collect::<Vec<_>>(), [("v", 1.0)]);
    // A tenth of the amplitude ω δ of the velocity.
    let speed = stop.usual_speed();
    assert_near(speed, 0.18, 1e-9);
    for law in StopLaw::ALL {
        let error = |time: f64| {
            let wanted = WantedImpact {
                restitution: 0.8,
                speed,
                mass: 1.0,
                exponent: 1.5,
                size: StopSize::Time(time),
            };
            let soft = SoftStop::with_restitution(law, &wanted).expect("a stop");
            let error = stop.error_of_rigid(&soft, 0.8, speed).expect("flights");
            error.expect("a contact that ends")
        };
        let [long, short] = [1e-4, 5e-5].map(error);
        assert!(short > 0.0 && long < 2e-3, "{law:?}: {long:e} {short:e}");
        assert!((long / short - 2.0).abs() < 0.02, "{law:?}: {long:e} {short:e}");
        if law == StopLaw::LinearToSurface {
            // By a program of its own, with the classical method of fourth order.
            assert_near(long, 9.454_155e-4, 1e-5);
        }
    }
}

#[test]
fn a_soft_stop_pushes_as_the_stop_of_the_scene() {
    let cases = [
        ("soft_b", ("v", -1.0), ("v", 1.0)),
        ("cantilever_0_12", ("u", 1.0), ("u", -1.0)),
        ("two_stops_t1_rigid", ("v1", -1.0), ("v1", 1.0)),
    ];
    for (name, push, rate) in cases {
        let scene = scenes::scene(name);
        let orbit = scenes::orbit(&scene);
        let stop = StopInScene::new(&scene, &orbit).expect("a stop that pushes");
        assert_eq!(stop.pushes().collect::<Vec<_>>(), [push], "{name}");
        assert_eq!(stop.rate().expect("a velocity").collect::<Vec<_>>(), [rate], "{name}");
    }
}
