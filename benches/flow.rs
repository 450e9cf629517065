//! One forcing period of two oscillators: the orbit itself, and its jets.
//!
//! The actuator with its jets in (x, v, θ, ω, V) over one period at 1e-15 is the problem on which
//! other programs were measured; the floor printed first is the time of all coefficient products of
//! dense jets alone, at the measured rate of the widest registers; squares and monomials that
//! vanish cost less.

#[path = "support/actuator.rs"]
mod actuator;
#[path = "support/floor.rs"]
mod floor;

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use grazemap::flow::{
    Field, InputKind, Integrator, LaneIntegrator, jet_transport, jet_transport_taylor,
};
use grazemap::jet::JetSpace;
use grazemap::model::{ExpressionGraph, Unary};
use grazemap::numeric::{Dd, Lanes, Real};
use pulp::Arch;

use actuator::{POINT, electrostatic, jets};
use floor::{CHAINS, Floor, ROUNDS};

/// `x' = v, v' = α cos θ − 2 ζ v − x, θ' = ω`.
fn linear() -> Field {
    let mut g = ExpressionGraph::new();
    let [x, v, theta, zeta, alpha, omega] = std::array::from_fn(|input| g.input(input));
    let cosine = g.unary(Unary::Cos, theta);
    let force = g.mul(alpha, cosine);
    let two = g.number(2.0);
    let damping = g.mul(two, zeta);
    let damping = g.mul(damping, v);
    let force = g.sub(force, damping);
    let acceleration = g.sub(force, x);
    Field::new(&g, &[v, acceleration, omega], &[], &[InputKind::HeadOnly; 3])
}

/// Time per product and sum of one lane, each rounded, in seconds, with the machine's widest
/// registers.
fn seconds_per_product() -> f64 {
    let time = |_| {
        let start = Instant::now();
        let lanes = Arch::new().dispatch(Floor { is_fused: false });
        start.elapsed().as_secs_f64() / (ROUNDS * CHAINS * lanes) as f64
    };
    (0..100).map(time).fold(f64::INFINITY, f64::min)
}

fn orbit<S: Real>(c: &mut Criterion, name: &str, field: &Field, point: &[f64], duration: f64) {
    let values: Vec<S> = point.iter().map(|&value| S::from_f64(value)).collect();
    let mut integrator = Integrator::new(field);
    let duration = S::from_f64(duration);
    c.bench_function(name, |b| {
        b.iter(|| {
            integrator
                .flow(black_box(&values[..3]), &values[3..], duration)
                .expect("the orbit is smooth")
        });
    });
}

/// Times eight orbits in lanes, from neighbouring states and parameters; the rate counts single
/// orbits.
fn orbits_in_lanes(c: &mut Criterion, name: &str, field: &Field, point: &[f64], duration: f64) {
    let spread = |&value: &f64| Lanes::<8>::from_fn(|lane| value * (1.0 + 0.01 * lane as f64));
    let values: Vec<_> = point.iter().map(spread).collect();
    let mut integrator = LaneIntegrator::new(field);
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(8));
    group.bench_function("8", |b| {
        b.iter(|| {
            let mut state = [values[0], values[1], values[2]];
            integrator.carry(black_box(&mut state), &values[3..], Lanes::splat(duration))
        });
    });
    group.finish();
}

fn orbits(c: &mut Criterion) {
    let (linear, actuator) = (linear(), electrostatic());
    let point = [0.3, 0.1, 0.4, 0.05, 2.9, 1.8];
    let period = std::f64::consts::TAU / 1.8;
    orbit::<f64>(c, "orbit/linear/f64", &linear, &point, period);
    orbit::<Dd>(c, "orbit/linear/double-double", &linear, &point, period);
    orbits_in_lanes(c, "orbit/linear/lanes", &linear, &point, period);
    let period = std::f64::consts::PI / 0.6;
    orbits_in_lanes(c, "orbit/actuator/lanes", &actuator, &POINT, period);
    orbit::<f64>(c, "orbit/actuator/f64", &actuator, &POINT, period);
    orbit::<Dd>(c, "orbit/actuator/double-double", &actuator, &POINT, period);
}

fn jets_of_the_period(c: &mut Criterion) {
    let field = electrostatic();
    let period = std::f64::consts::PI / 0.6;
    let product = seconds_per_product();
    for order in 1..=8 {
        let space = JetSpace::uniform(5, order).expect("a small space");
        let (states, parameters) = jets(&space);
        let flow = jet_transport(&field, &states, &parameters, period, 1e-15)
            .expect("the orbit is smooth");
        let products = space.products() * field.program().products() * flow.elements * 16;
        println!(
            "order {order}: {} elements, dense products alone {:.1} us",
            flow.elements,
            1e6 * product * products as f64
        );
        c.bench_function(&format!("jets/collocation/{order}"), |b| {
            b.iter(|| jet_transport(&field, black_box(&states), &parameters, period, 1e-15));
        });
        if order <= 4 {
            c.bench_function(&format!("jets/taylor/{order}"), |b| {
                b.iter(|| jet_transport_taylor(&field, black_box(&states), &parameters, period));
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().without_plots().sample_size(10).warm_up_time(std::time::Duration::from_millis(300)).measurement_time(std::time::Duration::from_millis(700));
    targets = orbits, jets_of_the_period
}
criterion_main!(benches);
