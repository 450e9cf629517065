//! Times of a map step, of a multiply-add, of a direct return.

use std::hint::black_box;
use std::time::Instant;

use super::sample::SamplePoint;
use crate::iteration::{DiscreteMap, HornerMap};
use crate::numeric::Scalar;

/// Runs of which the median counts.
const RUNS: usize = 5;

/// Steps of one run.
const STEPS: usize = 500;

/// Multiply-adds of one run.
const MULTIPLY_ADDS: usize = 400_000;

/// Independent chains of multiply-adds: enough to fill the units.
const CHAINS: usize = 16;

/// Median time of `work` over a few runs, in nanoseconds per unit.
fn median_ns(units: usize, mut work: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            work();
            1e9 * start.elapsed().as_secs_f64() / units as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

/// Nanoseconds of one step of a map with its parameters frozen, at a point: the median of five
/// runs.
pub fn step_ns(map: &HornerMap, point: &SamplePoint) -> f64 {
    let frozen = map.freeze(&point.parameters);
    let mut image = vec![0.0; frozen.dimension()];
    median_ns(STEPS, || {
        for _ in 0..STEPS {
            frozen.step(black_box(&point.state), &[], &mut image);
            black_box(&mut image);
        }
    })
}

/// Nanoseconds of one multiply-add in double precision, sixteen chains of them in flight: the
/// median of five runs.
pub fn multiply_add_ns() -> f64 {
    let factor = black_box(0.999_999);
    median_ns(MULTIPLY_ADDS, || {
        let mut sums = [1.0f64; CHAINS];
        for _ in 0..MULTIPLY_ADDS / CHAINS {
            for sum in &mut sums {
                *sum = Scalar::mul_add(*sum, factor, 1e-6);
            }
        }
        black_box(sums);
    })
}
