//! A bifurcation diagram of the linear oscillator: 1000 parameter values times 1200 and 10 000
//! iterates by the map, and fewer by direct simulation.
//!
//! The problem is that of Thota, Zhao and Dankowicz (2006), `omega = 1.8`, about its grazing orbit.
//! Printed first, from one run by each method: the ratio of the times of an iterate, direct
//! simulation over map. It is given for the linear oscillator with its exact flow and with the
//! general integrator, and for the electrostatic one, which has only the latter.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use grazemap::analysis::diagram::{
    Diagram, DiagramPlan, DirectSweep, Observer, SmoothFixedPoint, Sweep, SweepRequest, diagram,
    run_plan,
};
use grazemap::analysis::{DirectMap, NoProgress, itinerary};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::OrbitRequest;
use grazemap::model::{DiagramRequest, Method, Scene, SweepDirection, even_offsets};
use grazemap::orbit::{GrazingOrbit, locate};

/// Range of the free orbit before grazing, in which every iterate of every value is computed by
/// both methods.
const RANGE: [f64; 2] = [-1e-3, -1e-4];

/// Numbers of iterates by direct simulation at each value, dropped and kept: at 200 values by the
/// exact flow, so that all lanes are used, else at 20.
const DIRECT: [usize; 2] = [100, 20];

struct Problem {
    scene: Scene,
    orbit: GrazingOrbit,
    map: LocalMap,
}

fn problem(name: &str) -> Problem {
    let scene = Scene::of_catalogue(name).expect("a good scene");
    let located = locate(&scene).expect("no wrong input");
    let orbit = located.into_result().expect("it grazes");
    let orders = MapOrders { smooth_order: 5, contact_weight: 6 };
    let expander = Expander::new(&scene, &orbit).expect("a rigid stop");
    let map = expander.expand(orders).expect("a simple graze");
    Problem { scene, orbit, map }
}

fn run(
    problem: &Problem,
    range: [f64; 2],
    points: usize,
    iterates: [usize; 2],
    with: &[Method],
) -> Diagram {
    let [transient, keep] = iterates;
    let request = DiagramRequest {
        range,
        points,
        transient,
        keep,
        direction: SweepDirection::Up,
        with: with.to_vec(),
        ..problem.scene.diagrams[0].clone()
    };
    let Problem { scene, orbit, map } = problem;
    diagram(scene, orbit, map, &request, &NoProgress).expect("alpha is active")
}

/// Direct simulation of the linear oscillator by the general integrator.
fn run_by_taylor(
    problem: &Problem,
    range: [f64; 2],
    points: usize,
    [transient, keep]: [usize; 2],
) -> Vec<Sweep> {
    let Problem { scene, orbit, map } = problem;
    let system = HybridSystem::without_exact_flow(&scene.model);
    let direct = DirectSweep {
        map: DirectMap::new(&system, scene, orbit).expect("finite parameters"),
        start: SmoothFixedPoint::new(map),
        observer: Observer::new(scene, orbit, map, &scene.diagrams[0].observe).expect("the gap"),
        itinerary: itinerary(scene, orbit),
    };
    let plan = DiagramPlan {
        maps: vec![Box::new(direct)],
        direction: SweepDirection::Up,
        request: SweepRequest {
            parameter: 0,
            offsets: even_offsets(range, points),
            starts: Vec::new(),
            orbit: OrbitRequest::new(transient, keep, &map.window.state),
            window: map.window.clone(),
        },
    };
    run_plan(&plan, &NoProgress)
}

fn diagrams(criterion: &mut Criterion) {
    let problem = self::problem("linear");
    let exact = run(&problem, RANGE, 200, DIRECT, &[Method::Direct]).sweeps;
    print_ratios("linear, exact flow", &exact, &problem, RANGE);
    let general = run_by_taylor(&problem, RANGE, 20, DIRECT);
    print_ratios("linear, Taylor", &general, &problem, RANGE);
    let electrostatic = self::problem("mems");
    let range = electrostatic.scene.diagrams[0].range;
    let direct = run(&electrostatic, range, 20, DIRECT, &[Method::Direct]).sweeps;
    print_ratios("mems", &direct, &electrostatic, range);
    let mut group = criterion.benchmark_group("diagram");
    group.sample_size(10);
    group.throughput(Throughput::Elements(1000 * 1200));
    group.bench_function("map, 1000 values x 1200 iterates", |bencher| {
        bencher.iter(|| run(&problem, RANGE, 1000, [1000, 200], &[Method::Map]));
    });
    group.throughput(Throughput::Elements(1000 * 10_000));
    group.bench_function("map, 1000 values x 10 000 iterates", |bencher| {
        bencher.iter(|| run(&problem, RANGE, 1000, [9800, 200], &[Method::Map]));
    });
    group.throughput(Throughput::Elements(200 * 60));
    group.bench_function("direct simulation, 200 values x 60 iterates", |bencher| {
        bencher.iter(|| run(&problem, RANGE, 200, [50, 10], &[Method::Direct]));
    });
    group.finish();
}

/// Time per iterate, in seconds.
fn seconds(sweeps: &[Sweep]) -> f64 {
    let sum = |value: fn(&Sweep) -> f64| sweeps.iter().map(value).sum::<f64>();
    sum(|sweep| sweep.timing.seconds) / sum(|sweep| sweep.timing.iterates as f64)
}

/// Prints the ratios. The map computes as many iterates at each of 200 values as in the bench;
/// direct simulation computes fewer, at fewer values.
fn print_ratios(name: &str, direct: &[Sweep], problem: &Problem, range: [f64; 2]) {
    for iterates in [[1000, 200], [9800, 200]] {
        let by_map = run(problem, range, 200, iterates, &[Method::Map]).sweeps;
        let ratio = seconds(direct) / seconds(&by_map);
        let all: usize = iterates.iter().sum();
        println!(
            "{name}: an iterate by direct simulation over one of {all} by the map: {ratio:.0}"
        );
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().without_plots();
    targets = diagrams
}
criterion_main!(benches);
