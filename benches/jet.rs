//! One dense product of two full jets: nanoseconds per coefficient product (the inverse of the
//! throughput that criterion prints), one jet and eight jets in lanes.
//!
//! The floor is a loop of independent multiply-adds over registers, measured in the same run. Compile with
//! `RUSTFLAGS="-C target-cpu=native"` to let the machine fuse and use its widest registers.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use grazemap::jet::{Jet, JetMap, JetSpace, substitute_all};
use grazemap::numeric::{Dd, Lanes, Scalar};

/// Variables and order.
const SIZES: [(usize, usize); 4] = [(3, 6), (4, 8), (5, 6), (5, 10)];

fn filled<S: Scalar>(space: &std::sync::Arc<JetSpace>, seed: f64) -> Jet<S> {
    let value = |m: usize| S::from_f64(((m as f64 + seed) * 0.618).sin());
    Jet::from_coefficients(space, (0..space.len()).map(value).collect())
}

fn products<S: Scalar>(criterion: &mut Criterion, name: &str) {
    let mut group = criterion.benchmark_group(format!("jet_product/{name}"));
    for (variables, order) in SIZES {
        let space = JetSpace::uniform(variables, order).expect("a small space");
        let (a, b) = (filled::<S>(&space, 0.3), filled::<S>(&space, 0.7));
        let mut out = Jet::zero(&space);
        group.throughput(Throughput::Elements(space.products() as u64));
        group.bench_function(
            BenchmarkId::from_parameter(format!("{variables},{order}")),
            |bencher| {
                bencher.iter(|| {
                    black_box(&a).multiply_into(black_box(&b), &mut out);
                    black_box(&mut out);
                });
            },
        );
    }
    group.finish();
}

/// Multiply-adds in registers, in a number of independent sums: enough to hide the latency, few enough
/// to stay in registers. The best of a type's floors is its floor.
fn floor<S: Scalar, const SUMS: usize>(criterion: &mut Criterion, name: &str) {
    const ROUNDS: usize = 1000;
    let mut group = criterion.benchmark_group(format!("multiply_add_floor/{name}"));
    group.throughput(Throughput::Elements((SUMS * ROUNDS) as u64));
    group.bench_function(
        BenchmarkId::from_parameter(format!("{SUMS} sums")),
        |bencher| {
            bencher.iter(|| {
                let factor = black_box(S::from_f64(0.999));
                let mut sums = [S::from_f64(0.1); SUMS];
                for _ in 0..ROUNDS {
                    sums.iter_mut()
                        .for_each(|sum| *sum = sum.mul_add(factor, factor));
                }
                black_box(sums)
            });
        },
    );
    group.finish();
}

fn compositions(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("jet_composition");
    for (variables, order) in [(3, 6), (5, 6)] {
        let space = JetSpace::uniform(variables, order).expect("a small space");
        let component = |variable: usize| {
            let mut jet = filled::<f64>(&space, variable as f64);
            jet.coefficients_mut()[0] = 0.0;
            jet
        };
        let components: Vec<_> = (0..variables).map(component).collect();
        group.bench_function(
            BenchmarkId::new("compose", format!("{variables},{order}")),
            |bencher| {
                bencher.iter(|| substitute_all(black_box(&components), black_box(&components)));
            },
        );
        let map = JetMap::new(components.clone()).expect("components of one space");
        group.bench_function(
            BenchmarkId::new("invert", format!("{variables},{order}")),
            |bencher| {
                bencher.iter(|| black_box(&map).invert());
            },
        );
    }
    group.finish();
}

fn all(criterion: &mut Criterion) {
    floor::<f64, 16>(criterion, "f64");
    floor::<Lanes<8>, 1>(criterion, "lanes8");
    floor::<Lanes<8>, 2>(criterion, "lanes8");
    floor::<Lanes<8>, 8>(criterion, "lanes8");
    products::<f64>(criterion, "f64");
    products::<Lanes<8>>(criterion, "lanes8");
    products::<Dd>(criterion, "dd");
    compositions(criterion);
}

criterion_group! {
    name = benches;
    // NOTE: criterion's own plots need a font that the plotters features of this package do not supply.
    config = Criterion::default()
        .without_plots()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_millis(600));
    targets = all
}
criterion_main!(benches);
