//! One step of a local map: interpreted, lowered, frozen, iterated; at several orders (N, W).
//!
//! Two coordinates and two parameters, random coefficients. The operation counts are printed first:
//! at one multiply-add per cycle they are a floor for compiled code that runs one point at a time,
//! and at two vectors of eight lanes per cycle sixteen times less for lanes.

#[path = "../tests/support/synthetic.rs"]
mod synthetic;

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use grazemap::expansion::SectionKind;
use grazemap::iteration::{DiscreteMap, HornerMap, InterpretedMap, OrbitRequest};

const ORDERS: [(u32, u32); 4] = [(1, 1), (3, 4), (5, 6), (8, 10)];

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("map_step");
    let (state, parameters) = synthetic::point(&mut synthetic::Numbers::new(1));
    for (smooth, weight) in ORDERS {
        let map = synthetic::map(smooth, weight, SectionKind::Tangency);
        let (interpreted, lowered) = (InterpretedMap::new(&map), HornerMap::new(&map));
        let frozen = lowered.freeze(&parameters);
        let (all, few) = (lowered.count(), lowered.frozen_count());
        println!("orders ({smooth}, {weight}): step {all:?}, frozen {few:?}");
        let mut image = [0.0; 2];
        let mut bench = |name: &str, map: &dyn DiscreteMap, parameters: &[f64]| {
            group.bench_function(BenchmarkId::new(name, format!("{smooth}_{weight}")), |bencher| {
                bencher.iter(|| map.step(black_box(&state), black_box(parameters), &mut image));
            });
        };
        bench("interpreted", &interpreted, &parameters);
        bench("horner", &lowered, &parameters);
        bench("frozen", &frozen, &[]);
        bench(
            "composed",
            &HornerMap::composed(&map, &synthetic::composed(weight.max(2) as usize)),
            &parameters,
        );
        group.bench_function(BenchmarkId::new("freeze", format!("{smooth}_{weight}")), |bencher| {
            bencher.iter(|| lowered.freeze(black_box(&parameters)));
        });
    }
    group.finish();
}

#[cfg(feature = "compiled-maps")]
fn compiled(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("map_step_compiled");
    for map in grazemap::iteration::CompiledMap::all() {
        let (state, parameters) = (vec![1e-4; map.dimension()], vec![1e-5; map.parameters()]);
        let mut image = vec![0.0; map.dimension()];
        group.bench_function(map.identifier(), |bencher| {
            bencher.iter(|| map.step(black_box(&state), black_box(&parameters), &mut image));
        });
    }
    group.finish();
}

#[cfg(not(feature = "compiled-maps"))]
fn compiled(_: &mut Criterion) {}

/// Times orbits in lanes, as in a diagram: the time of an iterate of each.
fn lanes(criterion: &mut Criterion) {
    const ITERATES: usize = 1000;
    let mut group = criterion.benchmark_group("map_lanes");
    let (state, parameters) = synthetic::point(&mut synthetic::Numbers::new(1));
    for (smooth, weight) in ORDERS {
        let lowered = HornerMap::new(&synthetic::map(smooth, weight, SectionKind::Tangency));
        let request = OrbitRequest::new(ITERATES, 0, &[1.0; 2]);
        let request = request.escaping_at(&[f64::INFINITY; 2]);
        let point: [&[f64]; 2] = [&state, &parameters];
        lanes_of::<8>(&mut group, &lowered, point, &request, smooth);
        lanes_of::<16>(&mut group, &lowered, point, &request, smooth);
        lanes_of::<32>(&mut group, &lowered, point, &request, smooth);
    }
    group.finish();
}

fn lanes_of<const N: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    map: &HornerMap,
    [state, parameters]: [&[f64]; 2],
    request: &OrbitRequest,
    smooth: u32,
) {
    group.throughput(Throughput::Elements((N * request.transient) as u64));
    let mut frozen = map.freeze_lanes::<N>(&[parameters; N]);
    group.bench_function(BenchmarkId::new(format!("{N} orbits"), smooth), |bencher| {
        bencher.iter(|| frozen.orbits(&[state; N], request));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().without_plots();
    targets = steps, lanes, compiled
}
criterion_main!(benches);
