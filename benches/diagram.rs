//! A bifurcation diagram of the linear oscillator: 1000 parameter values times 1200 and 10 000 iterates by the map, and
//! fewer by direct simulation.
//!
//! The problem is the one of Thota, Zhao and Dankowicz (2006), `omega = 1.8`, about its grazing orbit. Printed first, of one run by
//! both methods each: the time of an iterate by direct simulation over that by the map, for the linear oscillator with its exact flow and
//! for the electrostatic one with Taylor's method.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use grazemap::analysis::NoProgress;
use grazemap::analysis::diagram::{Diagram, diagram};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::{DiagramRequest, Method, Scene, SweepDirection, catalogue};
use grazemap::orbit::{GrazingOrbit, locate};

/// The free orbit before grazing: every iterate of every value is made, by both methods.
const RANGE: [f64; 2] = [-1e-3, -1e-4];

struct Problem {
    scene: Scene,
    orbit: GrazingOrbit,
    map: LocalMap,
}

fn problem(name: &str) -> Problem {
    let text = catalogue::text(name).expect("in the catalogue");
    let scene = Scene::parse(text, name).expect("a good scene");
    let located = locate(&scene).expect("no wrong input");
    let orbit = located.into_result().expect("it grazes");
    let orders = MapOrders {
        smooth_order: 5,
        contact_weight: 6,
    };
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

fn diagrams(criterion: &mut Criterion) {
    let problem = self::problem("linear");
    print_ratio("linear", &problem, RANGE);
    let electrostatic = self::problem("mems");
    let range = electrostatic.scene.diagrams[0].range;
    print_ratio("mems", &electrostatic, range);
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
    group.throughput(Throughput::Elements(20 * 60));
    group.bench_function("direct simulation, 20 values x 60 iterates", |bencher| {
        bencher.iter(|| run(&problem, RANGE, 20, [50, 10], &[Method::Direct]));
    });
    group.finish();
}

/// The map makes as many iterates at each of 200 values as in the bench, direct simulation fewer at fewer.
fn print_ratio(name: &str, problem: &Problem, range: [f64; 2]) {
    let seconds = |points, iterates, method| {
        let diagram = run(problem, range, points, iterates, &[method]);
        let sweeps = diagram.sweeps.iter().map(|sweep| &sweep.timing);
        let [seconds, iterates] = sweeps.fold([0.0, 0.0], |[seconds, iterates], timing| {
            [seconds + timing.seconds, iterates + timing.iterates as f64]
        });
        seconds / iterates
    };
    let direct = seconds(20, [100, 20], Method::Direct);
    for iterates in [[1000, 200], [9800, 200]] {
        let [transient, keep] = iterates;
        let ratio = direct / seconds(200, iterates, Method::Map);
        let all = transient + keep;
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
