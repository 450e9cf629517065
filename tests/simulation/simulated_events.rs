//! Impacts, near misses, chattering, sticking and compliant contact of systems solved in closed
//! form.

use grazemap::hybrid::{
    DirectReturn, Event, EventKind, HybridError, HybridSystem, MomentEvent, Outcome, Regime,
    ReturnSection, Simulator, Trajectory,
};
use grazemap::model::{Model, Scene};
use grazemap::numeric::{Dd, Real};

use crate::support::synthetic::Numbers;

fn model(body: &str) -> Model {
    let text = format!(
        "[model]\nname = \"test\"\nstates = [\"x\", \"v\"]\n{body}\n\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
    );
    match Scene::parse(&text, "test") {
        Ok(scene) => scene.model,
        Err(error) => panic!("{error}"),
    }
}

const SURFACE: &str = "[[model.surface]]\nname = \"stop\"";

/// A ball under gravity `p` on a floor, restitution `r`.
fn ball() -> Model {
    model(&format!(
        "parameters = {{ p = 1.0, r = 0.8 }}\n[model.flow]\nx = \"v\"\nv = \"-p\"\n\
         {SURFACE}\nevent = \"x\"\nimpact = {{ v = \"-r*v\" }}"
    ))
}

/// `x'' = -x`, a stop at `x = p`.
fn pendulum() -> Model {
    model(&format!(
        "parameters = {{ p = 1.0, r = 0.8 }}\n[model.flow]\nx = \"v\"\nv = \"-x\"\n\
         {SURFACE}\nevent = \"p - x\"\nimpact = {{ v = \"-r*v\" }}"
    ))
}

/// A free mass pushed by `p cos theta`, a stop at `x = 0`.
fn pushed() -> Model {
    model(&format!(
        "parameters = {{ p = 1.0, r = 0.0 }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"1\"\nperiod = \"2*pi\"\n\
         [model.flow]\nx = \"v\"\nv = \"p*cos(theta)\"\n\
         {SURFACE}\nevent = \"-x\"\nimpact = {{ v = \"-r*v\" }}"
    ))
}

/// A free mass that meets a spring `k` and a damper `p` at `x = 0`.
fn cushioned(release: &str) -> Model {
    model(&format!(
        "parameters = {{ p = 0.6, k = 4.0 }}\n[model.flow]\nx = \"v\"\nv = \"0*x\"\n\
         {SURFACE}\nevent = \"-x\"\ncontact = {{ v = \"free - k*x - p*v\" }}\n{release}"
    ))
}

fn run<S: Real>(model: &Model, parameters: &[f64], state: &[f64], duration: f64) -> Trajectory<S> {
    let system = HybridSystem::new(model);
    let parameters: Vec<S> = parameters.iter().copied().map(S::from_f64).collect();
    let state: Vec<S> = state.iter().copied().map(S::from_f64).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    simulator.set_state(&state).expect("a finite state");
    simulator.run(S::from_f64(duration)).expect("a finite duration")
}

fn time_of<S: Real>(trajectory: &Trajectory<S>, wanted: impl Fn(&EventKind<S>) -> bool) -> S {
    let event = trajectory.events.iter().find(|event| wanted(&event.kind));
    event.unwrap_or_else(|| panic!("no such event in {:?}", trajectory.events)).time
}

fn chatter_error<S: Real>(r: f64) -> f64 {
    let found = run::<S>(&ball(), &[1.0, r], &[0.5, 0.0], 30.0);
    assert_eq!(found.outcome, Outcome::Completed);
    assert!(found.state.iter().all(|value| value.abs().to_f64() < 1e-15), "{:?}", found.state);
    // The fall takes 1 and ends at speed 1; flights take 2 r, 2 r², ...
    let r = S::from_f64(r);
    let expected = S::one() + S::from_f64(2.0) * r / (S::one() - r);
    (time_of(&found, |kind| *kind == EventKind::Stick) - expected).abs().to_f64()
}

#[test]
fn a_bouncing_ball_comes_to_rest_after_the_sum_of_its_flights() {
    for r in [0.0, 0.25, 0.5, 0.8, 0.9] {
        assert!(chatter_error::<f64>(r) < 1e-11, "{r}: {:e}", chatter_error::<f64>(r));
        assert!(chatter_error::<Dd>(r) < 1e-21, "{r}: {:e}", chatter_error::<Dd>(r));
    }
}

#[test]
fn an_elastic_ball_never_rests() {
    let found = run::<f64>(&ball(), &[1.0, 1.0], &[0.5, 0.0], 100.5);
    assert_eq!((found.contacts(), found.outcome), (50, Outcome::Completed));
    assert!((found.contact_speeds().last().expect("impacts") - 1.0).abs() < 1e-12);
}

#[test]
fn a_near_miss_is_reported_with_its_gap_and_is_no_contact() {
    let found = run::<f64>(&pendulum(), &[1.0 + 1e-12, 0.8], &[0.0, 1.0], 3.0);
    let [Event { time, kind: EventKind::NearMiss { gap }, .. }] = found.events[..] else {
        panic!("{found:?}")
    };
    assert!((gap - 1e-12).abs() < 2e-15 && (time - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
}

/// Flies `sin` from many starting times into a stop at `1 - y²`; the impact speed is `y sqrt(2 -
/// y²)`.
/// Where the gap of one of two stops that face each other is least, the other one is largest.
#[test]
fn near_misses_of_facing_stops_are_minima_of_their_own_gaps() {
    let stop = |name: &str, gap: &str| {
        format!(
            "[[model.surface]]\nname = \"{name}\"\nevent = \"{gap}\"\nimpact = {{ v = \"-p*v\" }}\n"
        )
    };
    let model = model(&format!(
        "parameters = {{ p = 0.8, F = 0.3, w = 0.9 }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"w\"\nperiod = \"2*pi\"\n\
         [model.flow]\nx = \"v\"\nv = \"F*cos(theta) - 0.04*v - x\"\n{}{}",
        stop("stop", "1 - x"),
        stop("other", "1 + x")
    ));
    let system = HybridSystem::new(&model);
    let section = ReturnSection::Tangency { surface: 0 };
    let parameters: Vec<f64> =
        model.parameter_values().iter().map(|value| value.to_f64()).collect();
    let mut returns =
        DirectReturn::<f64>::over_periods(&system, &parameters, section, 3).expect("a section");
    let mut numbers = Numbers::new(7);
    let mut misses = 0;
    for _ in 0..500 {
        let state = [0.5 + 0.5 * numbers.next(), 0.0, 3.0 * numbers.next()];
        let image = returns.image(&state).expect("a finite state");
        misses += image.near_misses.len();
        for (place, gap) in image.near_misses.iter().enumerate() {
            let faces = |other: &&f64| (gap + *other - 2.0).abs() < 1e-9;
            let other = image.near_misses[place + 1..].iter().find(faces);
            assert!(other.is_none(), "{state:?}: {:?}", image.near_misses);
        }
    }
    assert!(misses > 500, "{misses}");
}

fn sweep<S: Real>(y: f64, tolerance: f64) {
    let system = HybridSystem::new(&pendulum());
    let wall = S::one() - S::from_f64(y) * S::from_f64(y);
    let depth = S::one() - wall;
    let mut simulator =
        Simulator::new(&system, &[wall, S::from_f64(0.8)]).expect("finite parameters");
    for start in 0..60 {
        let (sine, cosine) = S::from_f64(-0.05 * f64::from(start)).sin_cos();
        simulator.set_state(&[sine, cosine]).expect("finite");
        let found = simulator.run(S::from_f64(5.0)).expect("finite");
        assert_eq!(found.contacts(), 1, "y = {y:e}, start {start}: {:?}", found.events);
        let speed = found.contact_speeds().next().expect("one contact");
        let expected = (depth * (S::one() + wall)).sqrt();
        let error = ((speed - expected) / expected).abs().to_f64();
        assert!(error < tolerance, "y = {y:e}, start {start}: {error:e}");
    }
}

#[test]
fn no_low_velocity_impact_is_missed() {
    for y in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 5e-8] {
        // Rounding of the position moves y² by a few 1e-16.
        sweep::<f64>(y, 1e-14 + 2e-15 / (y * y));
    }
    for exponent in 1..=15 {
        let y = 10f64.powi(-exponent);
        sweep::<Dd>(y, 1e-29 + 1e-30 / (y * y));
    }
}

/// `x'' = p cos θ` from the stop at `θ = π/2`: `x = −cos θ − (θ − π/2)`, `v = sin θ − 1`.
fn release_error<S: Real>(r: f64) -> [f64; 2] {
    let duration = 4.0;
    let found = run::<S>(&pushed(), &[1.0, r], &[-0.125, 0.75, -1.0], duration);
    assert_eq!(found.outcome, Outcome::Completed);
    let quarter = S::from_dd(Dd::FRAC_PI_2);
    let released = time_of(&found, |kind| *kind == EventKind::Release) - S::one();
    let theta = S::from_f64(duration - 1.0);
    let (sine, cosine) = theta.sin_cos();
    let expected = [-cosine - (theta - quarter), sine - S::one()];
    let state = (0..2).map(|i| (found.state[i] - expected[i]).abs().to_f64()).fold(0.0, f64::max);
    [(released - quarter).abs().to_f64(), state]
}

#[test]
fn a_stuck_mass_is_released_where_the_push_changes_sign() {
    for r in [0.0, 0.3, 0.5] {
        let (double, double_double) = (release_error::<f64>(r), release_error::<Dd>(r));
        assert!(double.iter().all(|&error| error < 1e-14), "{r}: {double:?}");
        assert!(double_double.iter().all(|&error| error < 1e-28), "{r}: {double_double:?}");
    }
}

#[test]
fn a_stuck_mass_stays_on_the_surface() {
    let found = run::<f64>(&pushed(), &[1.0, 0.0], &[-0.125, 0.75, -1.0], 2.0);
    assert!(found.state[0].abs() < 1e-16 && found.state[1].abs() < 1e-16, "{:?}", found.state);
    let system = HybridSystem::new(&pushed());
    let mut simulator = Simulator::new(&system, &[1.0, 0.0]).expect("finite");
    simulator.set_state(&[-0.125, 0.75, -1.0]).expect("finite");
    simulator.advance(2.0, &mut |_| {}).expect("finite");
    assert_eq!(simulator.regime(), Regime::Stick { surface: 0 });
}

#[test]
fn a_state_beyond_a_rigid_stop_is_said() {
    let found = run::<f64>(&pendulum(), &[1.0, 0.8], &[1.5, 0.0], 1.0);
    assert_eq!(found.outcome, Outcome::Penetrating { surface: 0, time: 0.0, gap: -0.5 });
}

#[test]
fn a_spring_returns_the_mass_after_half_its_period() {
    let found = run::<Dd>(&cushioned(""), &[0.0, 4.0], &[-0.5, 1.0], 4.0);
    let begin = time_of(&found, |kind| matches!(kind, EventKind::ContactBegin { .. }));
    let end = time_of(&found, |kind| matches!(kind, EventKind::ContactEnd { .. }));
    assert!((begin - Dd::from(0.5)).abs().to_f64() < 1e-30);
    assert!((end - begin - Dd::FRAC_PI_2).abs().to_f64() < 1e-29);
    assert!((found.state[1] + Dd::ONE).abs().to_f64() < 1e-29);
}

/// A free mass that meets a stiff spring `k` at `x = p`, far from the origin: the gap there is
/// rounding.
fn stiff() -> Model {
    model(&format!(
        "parameters = {{ p = 1.0, k = 1e4 }}\n[model.flow]\nx = \"v\"\nv = \"0*x\"\n\
         {SURFACE}\nevent = \"p - x\"\ncontact = {{ v = \"free - k*(x - p)\" }}"
    ))
}

/// Contacts begun and ended by masses that meet the stiff spring once, for many start states.
fn stiff_contacts<S: Real>(system: &HybridSystem, stiffness: f64) {
    let wall = S::from_dd(Dd::from(7.0) / Dd::from(3.0));
    let mut simulator =
        Simulator::new(system, &[wall, S::from_f64(stiffness)]).expect("finite parameters");
    for start in 1..200 {
        let speed = S::from_f64(100.0) / S::from_f64(f64::from(start) + 0.3);
        let state = [wall - speed * S::from_f64(0.7), speed];
        simulator.set_state(&state).expect("finite");
        let found = simulator.run(S::from_f64(2.0)).expect("finite");
        let kinds = found.events.iter().map(|event| match event.kind {
            EventKind::ContactBegin { .. } => "begin",
            EventKind::ContactEnd { .. } => "end",
            _ => "other",
        });
        let kinds: Vec<_> = kinds.collect();
        assert_eq!(kinds, ["begin", "end"], "k = {stiffness:e}, start {start}");
        // The spring turns the velocity round; rounding of the position, of size 0.7 speed, moves
        // it by ε √k of that.
        let error = ((found.state[1] + speed) / speed.max(S::one())).abs().to_f64();
        assert!(error < 64.0 * S::ROUNDOFF * stiffness.sqrt(), "{error:e}");
    }
}

#[test]
fn a_stiff_contact_is_one_contact() {
    let (exact, general) =
        (HybridSystem::new(&stiff()), HybridSystem::without_exact_flow(&stiff()));
    for system in [&exact, &general] {
        for stiffness in [1e2, 1e4, 1e6, 1e8] {
            stiff_contacts::<f64>(system, stiffness);
        }
        for stiffness in [1e5, 1e8] {
            stiff_contacts::<Dd>(system, stiffness);
        }
    }
}

/// A free mass that meets a constant force of 1e8 at `x = p`.
fn prestressed() -> Model {
    model(&format!(
        "parameters = {{ p = 0.7, k = 1e8 }}\n[model.flow]\nx = \"v\"\nv = \"0*x\"\n\
         {SURFACE}\nevent = \"p - x\"\ncontact = {{ v = \"free - k\" }}"
    ))
}

/// Largest relative change of speed by a contact that returns the speed as it was.
fn energy_error<S: Real>(system: &HybridSystem, speed: f64) -> f64 {
    let parameters = [0.7, 1e8].map(S::from_f64);
    let mut simulator = Simulator::new(system, &parameters).expect("finite parameters");
    let speed = S::from_f64(speed);
    let change = |start: i32| {
        let distance = S::from_f64(f64::from(start)) / S::from_f64(7.0);
        let state = [parameters[0] - distance * speed, speed];
        simulator.set_state(&state).expect("a finite state");
        let found = simulator.run(S::from_f64(20.0)).expect("a finite duration");
        assert_eq!(found.contacts(), 1, "{:?}", found.events);
        ((found.state[1] + speed) / speed).to_f64().abs()
    };
    (1..100).map(change).fold(0.0, f64::max)
}

/// The work `k h` of the contact on the distance `h` beside the stop would be 1e-2 of the energy in
/// `f64`, 1e-13 in double-double; what is left is a few roundings of the speed.
#[test]
fn a_stiff_contact_begins_and_ends_on_its_surface() {
    for system in
        [HybridSystem::new(&prestressed()), HybridSystem::without_exact_flow(&prestressed())]
    {
        let method = system.method();
        let (double, quad) =
            (energy_error::<f64>(&system, 1e-3), energy_error::<Dd>(&system, 1e-6));
        assert!(double < 1e-14, "{method:?}: {double:e}");
        assert!(quad < 1e-29, "{method:?}: {quad:e}");
    }
}

/// Number of minima of the gap that are reported where one lies, to rounding, at the end of a
/// flight that continues.
fn minima_at_seams<S: Real>(system: &HybridSystem, seam: f64) -> usize {
    let mut simulator =
        Simulator::new(system, &[1.0, 0.8].map(S::from_f64)).expect("finite parameters");
    let time = S::from_f64(seam);
    let (sine, cosine) = time.sin_cos();
    let amplitude = S::from_f64(0.9);
    let state = [amplitude * cosine, amplitude * sine];
    simulator.set_state(&state).expect("a finite state");
    let mut minima = 0;
    for duration in [time, S::one()] {
        let found = simulator.run(duration).expect("a finite duration");
        minima += found.events.len();
    }
    minima
}

#[test]
fn a_minimum_between_two_flights_is_reported_once() {
    for system in [HybridSystem::new(&pendulum()), HybridSystem::without_exact_flow(&pendulum())] {
        for sample in 1..200 {
            let seam = 0.01 * f64::from(sample);
            let method = system.method();
            assert_eq!(minima_at_seams::<f64>(&system, seam), 1, "{method:?} {seam}");
            assert_eq!(minima_at_seams::<Dd>(&system, seam), 1, "{method:?} {seam}");
        }
    }
}

#[test]
fn a_damped_stop_releases_at_zero_force() {
    for release in ["release = \"k*x + p*v\"", "release = \"-k*x - p*v\""] {
        let found = run::<Dd>(&cushioned(release), &[0.5, 4.0], &[-0.5, 1.0], 4.0);
        let begin = time_of(&found, |kind| matches!(kind, EventKind::ContactBegin { .. }));
        let end = time_of(&found, |kind| matches!(kind, EventKind::ContactEnd { .. }));
        // x'' = 0 at tan(w t) = 2 c w/(c² - w²), c = p/2, w² = k - c².
        let c = Dd::from(0.25);
        let w = (Dd::from(4.0) - c * c).sqrt();
        let expected = (Dd::from(2.0) * c * w).atan2(c * c - w * w) / w;
        assert!((end - begin - expected).abs().to_f64() < 1e-28, "{release}");
    }
}

#[test]
fn a_period_returns_the_phase_exactly_and_does_not_drift() {
    let model = model(&format!(
        "parameters = {{ p = 0.7, w = 1.8 }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"w\"\nperiod = \"2*pi\"\n\
         [model.flow]\nx = \"v\"\nv = \"p*cos(theta) - 0.1*v - x\"\n\
         {SURFACE}\nevent = \"2 - x\"\nimpact = {{ v = \"-v\" }}"
    ));
    let system = HybridSystem::new(&model);
    let mut simulator = Simulator::new(&system, &[0.7, 1.8]).expect("finite");
    let period = simulator.forcing_period().expect("a phase");
    // Steady state at theta = 0: x = p Re(1/z), v = p Re(i w/z), z = 1 - w² + 0.1 i w.
    let (re, im) = (1.0 - 1.8f64 * 1.8, 0.18);
    let size = re * re + im * im;
    let start = [0.7 * re / size, 0.7 * 1.8 * im / size, 0.0];
    simulator.set_state(&start).expect("finite");
    for _ in 0..1000 {
        assert_eq!(simulator.advance_period(period, &mut |_| {}), Ok(Outcome::Completed));
    }
    assert_eq!(simulator.state()[2], 0.0);
    assert!(
        (0..2).all(|i| (simulator.state()[i] - start[i]).abs() < 1e-14),
        "{:?}",
        simulator.state()
    );
}

#[test]
fn wrong_input_is_an_error() {
    let system = HybridSystem::new(&pendulum());
    assert_eq!(
        Simulator::new(&system, &[1.0]).err(),
        Some(HybridError::ParameterLength { expected: 2, found: 1 })
    );
    let mut simulator = Simulator::new(&system, &[1.0, 0.8]).expect("finite");
    assert_eq!(
        simulator.set_state(&[0.0]),
        Err(HybridError::StateLength { expected: 2, found: 1 })
    );
    assert_eq!(simulator.set_state(&[0.0, f64::NAN]), Err(HybridError::NotFinite { component: 1 }));
    assert_eq!(simulator.forcing_period(), Err(HybridError::NoPhase));
}

#[test]
fn a_singularity_is_said_in_finite_time() {
    let model = model(&format!(
        "parameters = {{ p = 1.0 }}\n[model.flow]\nx = \"v\"\nv = \"p*x^3\"\n\
         {SURFACE}\nevent = \"x + 10\"\nimpact = {{ v = \"-v\" }}"
    ));
    let found = run::<f64>(&model, &[1.0], &[1.0, 1.0], 10.0);
    assert!(
        matches!(found.outcome, Outcome::Diverged { time } if time < 2.0),
        "{:?}",
        found.outcome
    );
}

#[test]
fn a_sampled_trajectory_comes_to_rest_where_the_chatter_ends() {
    let model = ball();
    let system = HybridSystem::new(&model);
    let mut simulator = Simulator::new(&system, &[1.0, 0.5]).expect("finite parameters");
    simulator.set_state(&[0.5, 0.0]).expect("a finite state");
    let (mut rests, mut last) = (Vec::new(), f64::NEG_INFINITY);
    let outcome = simulator.sample(6.0, 60_000, &mut |moment| {
        assert!(moment.time >= last, "{} after {last}", moment.time);
        last = moment.time;
        if matches!(moment.event, Some((MomentEvent::Contact, _))) {
            rests.push(moment.time);
        }
    });
    assert_eq!(outcome.expect("a finite duration"), Outcome::Completed);
    // The fall takes 1, flights 1, 1/2, ...
    assert!(matches!(rests[..], [rest] if (rest - 3.0_f64).abs() < 1e-11), "{rests:?}");
}

#[test]
fn a_completed_chatter_is_said_with_its_duration() {
    let found = run::<f64>(&ball(), &[1.0, 0.5], &[0.5, 0.0], 30.0);
    let last = found.events.iter().rev().find_map(|event| match event.kind {
        EventKind::Impact { rebound, .. } => Some((event.time, rebound)),
        _ => None,
    });
    let (time, rebound) = last.expect("impacts before");
    let ended = found.events.iter().find_map(|event| match event.kind {
        EventKind::ChatterEnd { duration } => Some((event.time, duration)),
        _ => None,
    });
    // Under constant gravity the rest takes 2 v / (1 - r).
    let (end, duration) = ended.expect("a completed chatter");
    assert!((duration - 4.0 * rebound).abs() < 1e-14 && (end - time - duration).abs() < 1e-14);
}
