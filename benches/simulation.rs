//! Direct simulation: one forcing period near grazing, and one image of the return map.
//!
//! The linear oscillator at `alpha = 1.002 alpha_g`, r = 0.8 (Foale 1994; Thota, Zhao, Dankowicz
//! 2006), and the electrostatic one at `omega = 0.46`, 5 % beyond grazing, both on their
//! attractors; the number of impacts is printed. `linear-taylor` is the linear one by the general
//! integrator; `new-parameters` is a return at other parameters than the one before, so that all
//! tables are computed anew; `in-lanes` are returns of eight oscillators in lanes to a tangency
//! section, to the forcing phase of the graze (`at-grazing-phase`) and to a phase a quarter of a
//! period before it (`at-other-phase`). `derivatives` are a return with its gradient, and with its
//! Hessian, by two states, the phase and two parameters, beside the plain return by the same
//! integrator, in double-double. The floor is a loop of independent multiply-adds.

#[path = "support/floor.rs"]
mod floor;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use grazemap::hybrid::{
    DirectReturn, HybridSystem, LaneReturns, NominalPassage, ReturnSection, Simulator,
};
use grazemap::model::{Hits, Model, Scene, catalogue};
use grazemap::numeric::{Dd, Lanes, Real, is_wide};
use grazemap::orbit::{PiecewiseFlow, jets_along};
use pulp::Simd;

use floor::{CHAINS, Floor, ROUNDS};

/// Number of orbits in lanes.
const LANES: usize = 8;

/// A scene of the catalogue with one parameter at another value.
fn model(scene: &str, parameter: &str, value: f64) -> Model {
    let source = catalogue::text(scene).expect("a scene of the catalogue");
    let overrides = [(parameter.to_owned(), value.to_string())];
    Scene::parse_with(source, scene, &overrides).expect("a scene of the catalogue").model
}

fn values<S: Real>(model: &Model) -> Vec<S> {
    model.parameter_values().into_iter().map(S::from_dd).collect()
}

/// A simulator on the attractor, and its forcing period.
fn settled<'a, S: Real>(system: &'a HybridSystem, model: &Model) -> (Simulator<'a, S>, S) {
    let mut simulator = Simulator::new(system, &values::<S>(model)).expect("finite parameters");
    simulator.set_near_miss_limit(S::zero());
    simulator.set_state(&[S::from_f64(0.1), S::zero(), S::zero()]).expect("a finite state");
    let period = simulator.forcing_period().expect("a phase");
    let transient = if S::ROUNDOFF > 1e-20 { 2000 } else { 50 };
    for _ in 0..transient {
        simulator.advance_period(period, &mut |_| {}).expect("a phase");
    }
    (simulator, period)
}

fn periods<S: Real>(criterion: &mut Criterion, scalar: &str) {
    let linear = model("linear", "alpha", 2.247_220_505_424_423 * 1.002);
    let electrostatic = model("mems", "V", 0.211_927_585_7 * 1.05);
    let systems = [
        ("linear", HybridSystem::new(&linear), &linear),
        ("linear-taylor", HybridSystem::without_exact_flow(&linear), &linear),
        ("electrostatic", HybridSystem::new(&electrostatic), &electrostatic),
    ];
    for (name, system, model) in systems {
        let (mut simulator, period) = settled::<S>(&system, model);
        let (mut contacts, mut total) = (0u64, 0u64);
        criterion.bench_function(&format!("simulation/period/{name}/{scalar}"), |bencher| {
            bencher.iter(|| {
                total += 1;
                simulator.advance_period(black_box(period), &mut |event| {
                    contacts += u64::from(event.kind.is_contact())
                })
            });
        });
        println!("{name}: {:.3} impacts a period", contacts as f64 / total as f64);
    }
}

fn returns<S: Real>(criterion: &mut Criterion, scalar: &str) {
    let linear = model("linear", "alpha", 2.247_220_505_424_423);
    let electrostatic = model("mems", "V", 0.211_927_585_7);
    let systems = [
        ("linear", HybridSystem::new(&linear), &linear, [1.0, 0.0, 3.061_407_806_288_477]),
        (
            "linear-taylor",
            HybridSystem::without_exact_flow(&linear),
            &linear,
            [1.0, 0.0, 3.061_407_806_288_477],
        ),
        (
            "electrostatic",
            HybridSystem::new(&electrostatic),
            &electrostatic,
            [0.5, 0.0, -1.259_144_946_960_576],
        ),
    ];
    for (name, system, model, mut graze) in systems {
        graze[0] += 1e-5;
        let state = graze.map(S::from_f64);
        let section = ReturnSection::Tangency { surface: 0 };
        let mut map =
            DirectReturn::over_periods(&system, &values::<S>(model), section, 1).expect("a phase");
        criterion.bench_function(&format!("simulation/return/{name}/{scalar}"), |bencher| {
            bencher.iter(|| map.image(black_box(&state)));
        });
    }
}

/// Times returns of the linear oscillator, each at another forcing amplitude than the one before.
fn returns_at_new_parameters<S: Real>(criterion: &mut Criterion, scalar: &str) {
    let graze = 2.247_220_505_424_423;
    let models = [0.0, 1e-9].map(|offset| model("linear", "alpha", graze + offset));
    let system = HybridSystem::new(&models[0]);
    let parameters = models.each_ref().map(values::<S>);
    let state = [1.0 + 1e-5, 0.0, 3.061_407_806_288_477].map(S::from_f64);
    let section = ReturnSection::Tangency { surface: 0 };
    let mut map = DirectReturn::over_periods(&system, &parameters[0], section, 1).expect("a phase");
    let period = Simulator::new(&system, &parameters[0]).and_then(|s| s.forcing_period());
    let period = period.expect("a phase");
    let mut turn = 0;
    let name = format!("simulation/return/linear-new-parameters/{scalar}");
    criterion.bench_function(&name, |bencher| {
        bencher.iter(|| {
            turn = 1 - turn;
            map.set_parameters(black_box(&parameters[turn]), period).expect("finite parameters");
            map.image(black_box(&state))
        });
    });
}

/// Times returns of oscillators in lanes, each with its own force, and the same returns one after
/// another: from beyond the stop, and from before it.
fn returns_in_lanes(criterion: &mut Criterion) {
    let linear = |lane: usize| model("linear", "alpha", 2.247_220_505_424_423 + 1e-7 * lane as f64);
    let electrostatic = |lane: usize| model("mems", "V", 0.211_927_585_7 + 1e-8 * lane as f64);
    let (linear, electrostatic) = (std::array::from_fn(linear), std::array::from_fn(electrostatic));
    let systems = [
        ("linear", HybridSystem::new(&linear[0]), &linear, [1.0, 0.0, 3.061_407_806_288_477]),
        (
            "linear-taylor",
            HybridSystem::without_exact_flow(&linear[0]),
            &linear,
            [1.0, 0.0, 3.061_407_806_288_477],
        ),
        (
            "electrostatic",
            HybridSystem::new(&electrostatic[0]),
            &electrostatic,
            [0.5, 0.0, -1.259_144_946_960_576],
        ),
    ];
    let surface = 0;
    for (name, system, models, graze) in systems {
        let before = a_quarter_before(&system, &models[0], graze);
        let at_phase = ReturnSection::GrazingPhase { surface };
        let rows = [
            ("", ReturnSection::Tangency { surface }, graze, 0.0),
            ("-at-grazing-phase", at_phase, graze, 1e-4),
            ("-at-other-phase", ReturnSection::OtherPhase, before, 0.0),
        ];
        for (suffix, section, point, rate) in rows {
            let maps = models.each_ref().map(|model| return_map(&system, model, section));
            time_returns_in_lanes(criterion, &format!("{name}{suffix}"), maps, point, rate);
        }
    }
}

/// Point of the grazing orbit a quarter of a period before the graze.
fn a_quarter_before(system: &HybridSystem, model: &Model, graze: [f64; 3]) -> [f64; 3] {
    let mut simulator = Simulator::new(system, &values::<f64>(model)).expect("finite parameters");
    let period = simulator.forcing_period().expect("a phase");
    let [place, rate, phase] = graze;
    simulator.set_state(&[place - 1e-9, rate, phase]).expect("a finite state");
    simulator.run(0.75 * period).expect("a finite duration");
    let state = simulator.state();
    [state[0], state[1], state[2]]
}

/// Return map of a section, with its passage.
fn return_map<'a>(
    system: &'a HybridSystem,
    model: &Model,
    section: ReturnSection,
) -> DirectReturn<'a, f64> {
    let parameters = values::<f64>(model);
    let map = DirectReturn::over_periods(system, &parameters, section, 1).expect("a phase");
    if section != ReturnSection::OtherPhase {
        return map;
    }
    let simulator = Simulator::new(system, &parameters).expect("finite parameters");
    let passage = NominalPassage {
        surface: 0,
        time: 0.25 * simulator.forcing_period().expect("a phase"),
        hit: false,
        rests: false,
    };
    map.with_passages(&[passage]).expect("within the return")
}

/// `rate` is added to the velocity of every other orbit, and subtracted from that of its
/// neighbours.
fn time_returns_in_lanes(
    criterion: &mut Criterion,
    name: &str,
    mut alone: [DirectReturn<'_, f64>; LANES],
    point: [f64; 3],
    rate: f64,
) {
    let mut lanes = LaneReturns::<LANES>::new(alone.to_vec()).expect("one rigid stop");
    let mut group = criterion.benchmark_group(format!("simulation/return/{name}-in-lanes"));
    group.throughput(Throughput::Elements(LANES as u64));
    for offset in [1e-5, -1e-5] {
        let state = |lane: usize| {
            let ([place, velocity, phase], share) = (point, 1.0 + 0.1 * lane as f64);
            let rate = if lane.is_multiple_of(2) { rate } else { -rate };
            [place + offset * share, velocity + rate * share, phase]
        };
        let states: [[f64; 3]; LANES] = std::array::from_fn(state);
        let together: [Lanes<LANES>; 3] =
            std::array::from_fn(|place| Lanes::from_fn(|lane| states[lane][place]));
        let images = lanes.images(&together, [true; LANES]);
        assert_eq!(images.together, [true; LANES]);
        let meets = images.speeds[0].map(|speed| speed.is_some());
        assert!(meets == [meets[0]; LANES]);
        let name = if meets[0] { "with impact" } else { "without" };
        group.bench_function(format!("{name}/one by one"), |bencher| {
            bencher.iter(|| {
                for (map, state) in alone.iter_mut().zip(&states) {
                    black_box(map.image(black_box(state)).expect("a finite state"));
                }
            });
        });
        group.bench_function(format!("{name}/in lanes"), |bencher| {
            bencher.iter(|| lanes.images(black_box(&together), [true; LANES]).returned);
        });
    }
    group.finish();
}

/// Times a return with an impact, plain and with its derivatives, in double-double.
fn derivatives(criterion: &mut Criterion) {
    let systems = [
        ("linear", "alpha", 2.247_220_505_424_423 * 1.1, [0.9, 2.0, 2.0], ["alpha", "omega"]),
        ("mems", "V", 0.211_927_585_7 * 1.05, [0.3, 0.5, 2.0], ["V", "omega"]),
    ];
    for (name, parameter, value, start, free) in systems {
        let source = catalogue::text(name).expect("a scene of the catalogue");
        let overrides = [(parameter.to_owned(), value.to_string())];
        let mut scene = Scene::parse_with(source, name, &overrides).expect("a good scene");
        let start = start.map(Dd::from);
        let free = free.map(|name| {
            let mut all = scene.model.parameters.iter();
            all.position(|parameter| parameter.name == name).expect("a parameter")
        });
        scene.grazing.hits = Hits { surfaces: vec![0], order: None };
        scene.grazing.passages.clear();
        let parameters = scene.model.parameter_values();
        let flow = PiecewiseFlow::free(&scene, &[]);
        let jets = |order| jets_along(&scene, &start, &free, (None, 1), order).expect("jets");
        let (duration, impacts) = (jets(1).duration, jets(1).events.len());
        println!("{name}: {impacts} impacts");
        let mut group = criterion.benchmark_group(format!("simulation/derivatives/{name}"));
        group.bench_function("plain return", |bencher| {
            bencher.iter(|| flow.flow(black_box(&start), &parameters, duration).expect("a flow"));
        });
        for (order, what) in [(1, "gradient"), (2, "hessian")] {
            group.bench_function(what, |bencher| bencher.iter(|| jets(black_box(order))));
        }
        group.finish();
    }
}

/// A thousand rounds of multiply-adds in registers, in independent sums.
fn time_floor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulation/multiply_add_floor");
    group.throughput(Throughput::Elements((CHAINS * ROUNDS) as u64));
    group.bench_function("f64", |bencher| {
        bencher.iter(|| pulp::Scalar::new().vectorize(Floor { is_fused: false }));
    });
    group.finish();
}

fn simulation(criterion: &mut Criterion) {
    time_floor(criterion);
    periods::<f64>(criterion, "f64");
    periods::<Dd>(criterion, "double-double");
    returns::<f64>(criterion, "f64");
    returns::<Dd>(criterion, "double-double");
    returns_at_new_parameters::<f64>(criterion, "f64");
    returns_at_new_parameters::<Dd>(criterion, "double-double");
    derivatives(criterion);
    if is_wide() {
        returns_in_lanes(criterion);
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().without_plots();
    targets = simulation
}
criterion_main!(benches);
