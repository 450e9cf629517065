//! Exact flow of affine fields, compared with Taylor's method, an independent integrator: every
//! affine scene of the catalogue, impacts and contacts included.

use grazemap::hybrid::{
    DirectReturn, Event, EventKind, FlowMethod, HybridSystem, Return, ReturnSection, Simulator,
    Trajectory,
};
use grazemap::model::{Model, Scene};
use grazemap::numeric::{Dd, Real};

use crate::support::scenes::{scene, scene_with};

/// Prefixes of the names of scenes whose force is not linear in the states.
const NOT_AFFINE: [&str; 3] = ["mems", "cantilever", "self_excited"];

fn is_affine(name: &str) -> bool {
    !NOT_AFFINE.iter().any(|start| name.starts_with(start))
}

fn catalogue() -> Vec<(String, Model)> {
    let names = grazemap::model::catalogue::names();
    names.map(|name| (name.to_owned(), scene(name).model)).collect()
}

/// Simulates a quarter more than a period; `near` is the largest gap of near misses to report.
fn run<S: Real>(system: &HybridSystem, model: &Model, state: &[f64], near: f64) -> Trajectory<S> {
    let parameters: Vec<S> = model.parameter_values().into_iter().map(S::from_dd).collect();
    let state: Vec<S> = state.iter().copied().map(S::from_f64).collect();
    let mut simulator = Simulator::new(system, &parameters).expect("finite parameters");
    simulator.set_near_miss_limit(S::from_f64(near));
    simulator.set_state(&state).expect("a finite state");
    let period = simulator.forcing_period().unwrap_or(S::from_f64(6.0));
    let duration = period * S::from_f64(1.25);
    simulator.run(duration).expect("a finite duration")
}

/// Full states that fill a box around the origin.
fn states(model: &Model, count: usize) -> Vec<Vec<f64>> {
    let share = |number: usize, component: usize| {
        let step = [0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122, 0.185_037, 0.139_681];
        (0.31 + (number + 1) as f64 * step[component % step.len()]).fract()
    };
    let component = |number, component| 3.0 * (share(number, component) - 0.5);
    (0..count)
        .map(|number| (0..model.dimension()).map(|i| component(number, i)).collect())
        .collect()
}

/// Speed of a contact, or the gap of a near miss.
fn measure<S: Real>(kind: &EventKind<S>) -> S {
    match *kind {
        EventKind::Impact { speed, .. }
        | EventKind::ContactBegin { speed }
        | EventKind::ContactEnd { speed } => speed,
        EventKind::NearMiss { gap } => gap,
        EventKind::ChatterEnd { .. } | EventKind::Stick | EventKind::Release => S::zero(),
    }
}

/// Largest difference of two trajectories with the same events; `None` if the events differ.
fn difference<S: Real>(a: &Trajectory<S>, b: &Trajectory<S>) -> Option<f64> {
    let same = |(a, b): (&Event<S>, &Event<S>)| {
        a.surface == b.surface && std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind)
    };
    // A chatter is completed where its series is good to the 3/4th power of the roundoff, which may
    // be an impact earlier or later.
    let completed = |event: &Event<S>| matches!(event.kind, EventKind::ChatterEnd { .. });
    let [of_a, of_b] = [a, b].map(|one| one.events.iter().position(completed));
    let compared = match (of_a, of_b) {
        (Some(of_a), Some(of_b)) => of_a.min(of_b),
        _ => a.events.len().max(b.events.len()),
    };
    let events = || a.events.iter().zip(&b.events).take(compared);
    if events().count() != compared
        || !events().all(same)
        || std::mem::discriminant(&a.outcome) != std::mem::discriminant(&b.outcome)
    {
        return None;
    }
    let states = a.state.iter().zip(&b.state).map(|(&a, &b)| a - b);
    // If two events are close together, their times are uncertain by rounding over the speed.
    let in_events = events().map(|(a, b)| (a.time - b.time) * measure(&a.kind).min(S::one()));
    let speeds = events().map(|(a, b)| measure(&a.kind) - measure(&b.kind));
    let all = states.chain(in_events).chain(speeds);
    let largest = all.map(|value| value.abs().to_f64()).fold(0.0, f64::max);
    let by_series = of_a.is_some();
    Some(if by_series { largest * S::ROUNDOFF.powf(0.25) } else { largest })
}

/// Largest difference over the start states, and the number of contacts.
fn worst<S: Real>(name: &str, model: &Model, count: usize) -> (f64, usize) {
    let (exact, general) = (HybridSystem::new(model), HybridSystem::without_exact_flow(model));
    let (mut worst, mut contacts) = (0.0f64, 0);
    for state in states(model, count) {
        // All minima asked for, then contacts alone, which are flown to in leaps.
        for near in [f64::INFINITY, 0.0] {
            let a = run::<S>(&exact, model, &state, near);
            let b = run::<S>(&general, model, &state, near);
            let found = difference(&a, &b);
            let found = found.unwrap_or_else(|| panic!("{name} {state:?}:\n{a:?}\n{b:?}"));
            worst = worst.max(found);
            contacts += a.contacts();
        }
    }
    (worst, contacts)
}

/// The state after 5 units of time, in double-double, of `x'' = force` with a wall that is never
/// met.
fn flown(force: &str, state: [f64; 3]) -> [Dd; 2] {
    let text = format!(
        "[model]\nname = \"test\"\nstates = [\"x\", \"v\"]\nparameters = {{ p = 1.0 }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"p\"\nperiod = \"2*pi\"\n\
         [model.flow]\nx = \"v\"\nv = \"{force}\"\n\
         [[model.surface]]\nname = \"stop\"\nevent = \"100*p - x\"\nimpact = {{ v = \"-v\" }}\n\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
    );
    let model = Scene::parse(&text, "test").expect("a scene").model;
    let system = HybridSystem::new(&model);
    assert_eq!(system.method(), FlowMethod::ExactAffine, "{force}");
    let mut simulator = Simulator::new(&system, &[Dd::ONE]).expect("finite");
    simulator.set_state(&state.map(Dd::from)).expect("finite");
    let found = simulator.run(Dd::from(5.0)).expect("finite");
    [found.state[0], found.state[1]]
}

#[test]
fn resonance_critical_damping_and_powers_of_the_force_follow_their_closed_forms() {
    let t = Dd::from(5.0);
    let (sine, cosine) = t.sin_cos();
    let decay = (-t).exp();
    let half = Dd::from(0.5);
    let twice = Dd::from(2.0);
    let (sine_2, cosine_2) = (t + t).sin_cos();
    let cases = [
        // Forced at its own frequency, from rest: x = t sin t / 2.
        ("p*cos(theta) - x", [0.0, 0.0, 0.0], [half * t * sine, half * (sine + t * cosine)]),
        // Critically damped, a defective matrix: x = (1 + t) e^−t.
        ("-2*p*v - x", [1.0, 0.0, 0.0], [(Dd::ONE + t) * decay, -t * decay]),
        // A free mass under sin² θ = (1 − cos 2θ)/2: v = t/2 − sin 2t / 4.
        (
            "p*sin(theta)^2",
            [0.0, 0.0, 0.0],
            [
                t * t / Dd::from(4.0) + (cosine_2 - Dd::ONE) / Dd::from(8.0),
                half * t - sine_2 / Dd::from(4.0),
            ],
        ),
        // sin θ cos(θ + 1) as a force alone, split by the sum of angles: (sin(2θ + 1) − sin 1)/2.
        ("sin(theta)*cos(theta + p)", [0.0, 0.0, 0.0], {
            let (sine_1, cosine_1) = Dd::ONE.sin_cos();
            let (sine_3, cosine_3) = (t + t + Dd::ONE).sin_cos();
            let speed = (cosine_1 - cosine_3) / Dd::from(4.0) - half * sine_1 * t;
            let place = cosine_1 * t / Dd::from(4.0)
                - (sine_3 - sine_1) / Dd::from(8.0)
                - sine_1 * t * t / Dd::from(4.0);
            [place, speed]
        }),
        // No spring, strong damping: v = e^−2t.
        ("-2*p*v", [0.0, 1.0, 0.0], [half * (Dd::ONE - decay * decay), decay.powf(twice)]),
    ];
    for (force, state, expected) in cases {
        let found = flown(force, state);
        for (found, expected) in found.into_iter().zip(expected) {
            let error = (found - expected).abs().to_f64();
            // A few units in the last place of terms of size up to 10.
            assert!(error < 1e-29, "{force}: {error:e}");
        }
    }
}

#[test]
fn forces_that_are_not_linear_are_not_taken_for_affine() {
    let with = |force: &str| {
        let text = format!(
            "[model]\nname = \"test\"\nstates = [\"x\", \"v\"]\nparameters = {{ p = 1.0 }}\n\
             [model.phase]\nname = \"theta\"\nrate = \"p\"\nperiod = \"2*pi\"\n\
             [model.flow]\nx = \"v\"\nv = \"{force}\"\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"p - x\"\nimpact = {{ v = \"-v\" }}\n\
             [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
        );
        let model = Scene::parse(&text, "test").expect("a scene").model;
        HybridSystem::new(&model).method()
    };
    let sawtooth = "atan2(sin(theta), cos(theta)) - x";
    for force in
        ["-x^3", "-x*v", "cos(theta)*x", "-abs(x)", "p/(2 + x)", sawtooth, "exp(cos(theta))"]
    {
        assert_eq!(with(force), FlowMethod::Taylor, "{force}");
    }
    for force in ["-p^2*x", "exp(p)*cos(2*theta)^3 - x/p", "-(x - sin(p))*2"] {
        assert_eq!(with(force), FlowMethod::ExactAffine, "{force}");
    }
}

#[test]
fn scenes_with_a_linear_force_are_found_affine_and_no_others() {
    for (name, model) in catalogue() {
        let expected = if is_affine(&name) { FlowMethod::ExactAffine } else { FlowMethod::Taylor };
        assert_eq!(HybridSystem::new(&model).method(), expected, "{name}");
        let general = HybridSystem::without_exact_flow(&model);
        assert_eq!(general.method(), FlowMethod::Taylor);
    }
}

#[test]
fn exact_flow_and_taylors_method_agree_on_every_affine_scene() {
    for (name, model) in catalogue() {
        if !is_affine(&name) {
            continue;
        }
        let (double, contacts) = worst::<f64>(&name, &model, 40);
        let (fine, _) = worst::<Dd>(&name, &model, 6);
        println!("{name:28} {contacts:4} contacts, f64 {double:.1e}, double-double {fine:.1e}");
        assert!(contacts > 0, "{name}");
        assert!(double < 1e-10, "{name}: {double:e}");
        assert!(fine < 1e-26, "{name}: {fine:e}");
    }
}

/// Images of points on both sides of the stop by one method.
fn images<S: Real>(system: &HybridSystem, model: &Model, gaps: &[f64]) -> Vec<Return<S>> {
    let parameters: Vec<S> = model.parameter_values().into_iter().map(S::from_dd).collect();
    let section = ReturnSection::Tangency { surface: 0 };
    let mut map = DirectReturn::over_periods(system, &parameters, section, 1).expect("a phase");
    let image = |&gap: &f64| {
        let state = [S::from_f64(1.0 - gap), S::zero(), S::from_f64(3.0614)];
        map.image(&state).expect("a finite state")
    };
    gaps.iter().map(image).collect()
}

/// Number of contacts and near misses, after the two methods' returns have been compared.
fn compare_returns<S: Real>(model: &Model, gaps: &[f64]) -> usize {
    let exact = images::<S>(&HybridSystem::new(model), model, gaps);
    let general = images::<S>(&HybridSystem::without_exact_flow(model), model, gaps);
    let mut met = 0;
    for ((a, b), gap) in exact.iter().zip(&general).zip(gaps) {
        let ends = [a, b].map(|image| std::mem::discriminant(&image.outcome));
        assert_eq!((ends[0], &a.hits), (ends[1], &b.hits), "{gap:e}");
        assert_eq!(a.near_misses.len(), b.near_misses.len(), "{gap:e}");
        met += a.impact_speeds.len() + a.near_misses.len();
        let pairs = a.state.iter().zip(&b.state);
        let speeds = a.impact_speeds.iter().zip(&b.impact_speeds);
        let misses = a.near_misses.iter().zip(&b.near_misses);
        // A speed is the root of a gap, so that rounding is multiplied by its inverse; the flow
        // multiplies it by tens.
        let limit = 1e3 * S::ROUNDOFF * (1.0 + 1.0 / gap.abs().sqrt());
        for (&a, &b) in pairs.chain(speeds).chain(misses).chain([(&a.elapsed, &b.elapsed)]) {
            let error = (a - b).abs().to_f64();
            assert!(error < limit, "{gap:e}: {error:e}");
        }
    }
    met
}

#[test]
fn returns_from_both_sides_of_a_stop_agree_with_those_by_taylors_method() {
    let depths = (2..24).map(|step| 10f64.powf(-0.5 * f64::from(step)));
    let gaps: Vec<f64> = depths.flat_map(|depth| [depth, -depth]).collect();
    for alpha in ["2.2", "2.247220505424423", "2.3"] {
        let scene = scene_with("linear", &[("alpha", alpha)]);
        let met = compare_returns::<f64>(&scene.model, &gaps);
        assert_eq!(met, compare_returns::<Dd>(&scene.model, &gaps));
        assert!(met >= gaps.len() / 2, "{met}");
    }
}
