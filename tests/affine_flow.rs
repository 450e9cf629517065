//! The exact flow of affine fields against Taylor's method, an independent integrator of the same scenes: every affine
//! scene of the catalogue, impacts and contacts included.

use grazemap::hybrid::{Event, EventKind, FlowMethod, HybridSystem, Simulator, Trajectory};
use grazemap::model::{Model, Scene};
use grazemap::numeric::{Dd, Real};

/// Beginnings of the names of the catalogue's scenes whose force is not linear in the states.
const NOT_AFFINE: [&str; 3] = ["mems", "cantilever", "self_excited"];

fn is_affine(name: &str) -> bool {
    !NOT_AFFINE.iter().any(|start| name.starts_with(start))
}

fn catalogue() -> Vec<(String, Model)> {
    let folder = format!("{}/scenes", env!("CARGO_MANIFEST_DIR"));
    let mut scenes: Vec<_> = std::fs::read_dir(folder)
        .expect("the catalogue")
        .map(|entry| entry.expect("a file").path())
        .map(|path| {
            let name = path.file_stem().and_then(|stem| stem.to_str());
            let name = name.expect("a name").to_owned();
            let source = std::fs::read_to_string(&path).expect("a scene");
            let scene = Scene::parse(&source, &name).expect("a scene of the catalogue");
            (name, scene.model)
        })
        .collect();
    scenes.sort_by(|a, b| a.0.cmp(&b.0));
    scenes
}

fn run<S: Real>(system: &HybridSystem, model: &Model, state: &[f64]) -> (Trajectory<S>, S) {
    let parameters: Vec<S> = model
        .parameter_values()
        .into_iter()
        .map(S::from_dd)
        .collect();
    let state: Vec<S> = state.iter().copied().map(S::from_f64).collect();
    let mut simulator = Simulator::new(system, &parameters).expect("finite parameters");
    simulator.set_state(&state).expect("a finite state");
    let period = simulator.forcing_period().unwrap_or(S::from_f64(6.0));
    let duration = period * S::from_f64(1.25);
    (simulator.run(duration).expect("a finite duration"), period)
}

/// Full states that fill a box about the origin.
fn states(model: &Model, count: usize) -> Vec<Vec<f64>> {
    let share = |number: usize, component: usize| {
        let step = [
            0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122, 0.185_037, 0.139_681,
        ];
        (0.31 + (number + 1) as f64 * step[component % step.len()]).fract()
    };
    let component = |number, component| 3.0 * (share(number, component) - 0.5);
    (0..count)
        .map(|number| {
            (0..model.dimension())
                .map(|i| component(number, i))
                .collect()
        })
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

/// Largest difference of two trajectories with the same events; `None` where the events differ.
fn difference<S: Real>(a: &Trajectory<S>, b: &Trajectory<S>) -> Option<f64> {
    let same = |(a, b): (&Event<S>, &Event<S>)| {
        a.surface == b.surface && std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind)
    };
    let events = || a.events.iter().zip(&b.events);
    if a.events.len() != b.events.len()
        || !events().all(same)
        || std::mem::discriminant(&a.outcome) != std::mem::discriminant(&b.outcome)
    {
        return None;
    }
    let states = a.state.iter().zip(&b.state).map(|(&a, &b)| a - b);
    // Where two events are near each other, times are as uncertain as rounding over the speed.
    let in_events = events().map(|(a, b)| (a.time - b.time) * measure(&a.kind).min(S::one()));
    let speeds = events().map(|(a, b)| measure(&a.kind) - measure(&b.kind));
    let all = states.chain(in_events).chain(speeds);
    let largest = all.map(|value| value.abs().to_f64()).fold(0.0, f64::max);
    // A chatter is completed where its series is good to the 3/4th power of the roundoff.
    let completed = |event: &Event<S>| matches!(event.kind, EventKind::ChatterEnd { .. });
    let by_series = a.events.iter().any(completed);
    Some(if by_series {
        largest * S::ROUNDOFF.powf(0.25)
    } else {
        largest
    })
}

/// Largest difference over the start states, and the number of contacts met.
fn worst<S: Real>(name: &str, model: &Model, count: usize) -> (f64, usize) {
    let (exact, general) = (
        HybridSystem::new(model),
        HybridSystem::without_exact_flow(model),
    );
    let (mut worst, mut contacts) = (0.0f64, 0);
    for state in states(model, count) {
        let (a, _) = run::<S>(&exact, model, &state);
        let (b, _) = run::<S>(&general, model, &state);
        let found = difference(&a, &b);
        let found = found.unwrap_or_else(|| panic!("{name} {state:?}:\n{a:?}\n{b:?}"));
        worst = worst.max(found);
        contacts += a.contacts();
    }
    (worst, contacts)
}

#[test]
fn scenes_with_a_linear_force_are_found_affine_and_no_others() {
    for (name, model) in catalogue() {
        let expected = if is_affine(&name) {
            FlowMethod::ExactAffine
        } else {
            FlowMethod::Taylor
        };
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
