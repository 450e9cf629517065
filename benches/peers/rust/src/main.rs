//! One product of two full jets by other crates and by grazemap, in one run, as rows of a table.
//!
//! dace-rs: dense jets of any order. num-dual: types of a fixed order, here first and second derivatives in five
//! variables and the third in one. Medians of wall times on one thread; take the ratios.

use std::hint::black_box;
use std::ops::Mul;
use std::sync::Arc;
use std::time::Instant;

use grazemap::jet::{Jet, JetSpace};
use grazemap::numeric::Lanes;
use num_dual::{Derivative, Dual2SVec64, Dual3_64, DualSVec64};

/// Seconds of one call: the median over batches of about a millisecond.
fn seconds(mut work: impl FnMut()) -> f64 {
    const BATCHES: usize = 101;
    let mut calls = 1;
    let mut batch = |calls: usize| {
        let start = Instant::now();
        (0..calls).for_each(|_| work());
        start.elapsed().as_secs_f64()
    };
    while batch(calls) < 1e-3 {
        calls *= 2;
    }
    let mut times: Vec<f64> = (0..BATCHES).map(|_| batch(calls)).collect();
    times.sort_by(f64::total_cmp);
    times[BATCHES / 2] / calls as f64
}

/// Seconds of a product by the operator, which takes its operands for good: both are kept, as whoever multiplies them twice must.
fn product<T: Clone + Mul<Output = T>>(a: T, b: T) -> f64 {
    seconds(|| {
        black_box(black_box(&a).clone() * black_box(&b).clone());
    })
}

fn coefficient(number: usize, seed: f64) -> f64 {
    ((number as f64 + seed) * 0.618).sin()
}

/// Seconds of one product by grazemap: of two jets, and of eight pairs in lanes for one pair.
fn by_grazemap(space: &Arc<JetSpace>) -> [f64; 2] {
    let jet = |seed: f64| {
        let numbers = (0..space.len()).map(|number| coefficient(number, seed));
        Jet::from_coefficients(space, numbers.collect())
    };
    let (a, b, mut out) = (jet(0.3), jet(0.7), Jet::zero(space));
    let alone = seconds(|| black_box(&a).multiply_into(black_box(&b), black_box(&mut out)));
    let lanes = |seed: f64| {
        let numbers = (0..space.len()).map(|number| Lanes::<8>::splat(coefficient(number, seed)));
        Jet::from_coefficients(space, numbers.collect())
    };
    let (a, b, mut out) = (lanes(0.3), lanes(0.7), Jet::zero(space));
    let eight = seconds(|| black_box(&a).multiply_into(black_box(&b), black_box(&mut out)));
    [alone, eight / 8.0]
}

fn by_dace(variables: usize, order: usize) -> f64 {
    dace_rs::init(order as u32, variables as u32).expect("a small space");
    let full = |seed: f64| {
        let space = JetSpace::uniform(variables, order).expect("a small space");
        let mut jet = dace_rs::Da::new();
        let ones = Jet::from_coefficients(&space, vec![1.0; space.len()]);
        for (number, (exponents, _)) in ones.terms().enumerate() {
            let exponents: Vec<u32> = exponents.iter().map(|&power| power.into()).collect();
            jet.set_coefficient(&exponents, coefficient(number, seed));
        }
        jet
    };
    product(full(0.3), full(0.7))
}

/// Three significant digits.
fn digits(value: f64) -> String {
    let after_point = (2.0 - value.log10().floor()).max(0.0) as usize;
    format!("{value:.after_point$}")
}

fn row(peer: &str, variables: usize, order: usize, theirs: f64) {
    let space = JetSpace::uniform(variables, order).expect("a small space");
    let [alone, in_lanes] = by_grazemap(&space);
    let times = [
        theirs * 1e9,
        alone * 1e9,
        theirs / alone,
        in_lanes * 1e9,
        theirs / in_lanes,
    ];
    let cells = times.map(digits).join(" | ");
    println!(
        "| {variables}, {order} | {} | {peer} | {cells} |",
        space.products()
    );
}

fn main() {
    println!(
        "| variables, order | coefficient products | peer | peer, ns | grazemap, ns | ratio | in lanes, ns | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (variables, order) in [(3, 6), (4, 4), (4, 8), (5, 6), (5, 10), (6, 6)] {
        row("dace-rs 0.2.1", variables, order, by_dace(variables, order));
    }
    let gradient = || Derivative::some([0.1, 0.2, 0.3, 0.4, 0.5].into());
    let first = |value: f64| DualSVec64::<5>::new(value, gradient());
    row("num-dual 0.15.1", 5, 1, product(first(0.3), first(0.7)));
    let row_vector = || Derivative::some([[0.1], [0.2], [0.3], [0.4], [0.5]].into());
    let hessian = || Derivative::some([[0.3; 5]; 5].into());
    let second = |value: f64| Dual2SVec64::<5>::new(value, row_vector(), hessian());
    row("num-dual 0.15.1", 5, 2, product(second(0.3), second(0.7)));
    let third = |value: f64| Dual3_64::new(value, 0.2, 0.4, 0.6);
    row("num-dual 0.15.1", 1, 3, product(third(0.3), third(0.7)));
}
