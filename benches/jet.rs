//! One dense product of two full jets: nanoseconds per coefficient product (the inverse of the
//! throughput that criterion prints), one jet and eight jets in lanes.
//!
//! The floors are loops of independent products and sums over registers, measured in the same run
//! for one number and for the registers of AVX2 and AVX-512, rounded twice, as the library does,
//! and once.

#[path = "support/floor.rs"]
mod floor;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use grazemap::jet::{Jet, JetMap, JetSpace, substitute_all};
use grazemap::numeric::{Dd, Lanes, Scalar};
use pulp::Simd;

use floor::{CHAINS, Floor, ROUNDS};

/// Variables and order.
const SIZES: [(usize, usize); 9] =
    [(1, 3), (5, 1), (5, 2), (3, 6), (4, 4), (4, 8), (5, 6), (5, 10), (6, 6)];

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

fn time_floor<S: Simd>(criterion: &mut Criterion, name: &str, simd: S, is_fused: bool) {
    let kind = if is_fused { "fused" } else { "two_roundings" };
    let mut group = criterion.benchmark_group(format!("multiply_add_floor/{kind}"));
    group.throughput(Throughput::Elements((CHAINS * ROUNDS * S::F64_LANES) as u64));
    group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
        bencher.iter(|| simd.vectorize(Floor { is_fused }));
    });
    group.finish();
}

/// The floors of every instruction set of this machine.
#[cfg(target_arch = "x86_64")]
fn floors(criterion: &mut Criterion) {
    use pulp::x86::{V3, V4};
    time_floor(criterion, "one number", pulp::Scalar::new(), false);
    for is_fused in [false, true] {
        if let Some(simd) = V3::try_new() {
            time_floor(criterion, "avx2", simd, is_fused);
        }
        if let Some(simd) = V4::try_new() {
            time_floor(criterion, "avx512", simd, is_fused);
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn floors(criterion: &mut Criterion) {
    time_floor(criterion, "one number", pulp::Scalar::new(), false);
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
    floors(criterion);
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
