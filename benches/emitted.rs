//! Emitted steps of the linear scene, and of a spring whose contact is a series or flown, compiled
//! for this machine and for any x86-64 or aarch64.
//!
//! `cargo bench --bench emitted` emits the scenes at several orders, compiles each map with a small
//! timing program by `rustc`, and prints nanoseconds per step: one point at a time (independent
//! points), chained (each image is the next state), and in lanes; with parameters as variables and
//! frozen. Beside each is its floor: the step's multiply-adds over the rate of a loop of nothing
//! else, measured in the same run. The first rows are two bare polynomials of order 5 in three
//! variables, on which other programs were measured; rows marked `f32` are the same map in single
//! precision, in sixteen lanes instead of eight.

#[path = "../tests/support/synthetic.rs"]
mod synthetic;

use std::path::Path;
use std::process::Command;

use grazemap::emission::{EmitOptions, EmittedModule, emitted_module};
use grazemap::expansion::{Expander, MapOrders};
use grazemap::model::{Scene, Shape};
use grazemap::numeric::FloatFormat;
use grazemap::orbit::locate;

/// Scenes with their orders; `flown` is a scene of the flown shape.
const MAPS: [(&str, u32, u32); 8] = [
    ("linear", 1, 1),
    ("linear", 3, 4),
    ("linear", 5, 6),
    ("linear", 8, 10),
    ("soft_a", 6, 8),
    ("soft_b", 6, 8),
    ("soft_a_stiff", 6, 8),
    ("soft_b_stiff", 6, 8),
];

/// Scene and orders that are measured in single precision too.
const SINGLE: (&str, (u32, u32)) = ("linear", (5, 6));

/// Program that times an emitted module `map` in the number type `REAL`, and prints one figure a
/// line.
const PROGRAM: &str = r#"
use std::{hint::black_box, time::Instant};
mod map;
use map::*;
type Real = REAL;
const POINTS: usize = 1024;
fn median(mut run: impl FnMut() -> Real, steps: usize) -> f64 {
    let mut times: Vec<f64> = (0..101)
        .map(|_| {
            let start = Instant::now();
            black_box(run());
            start.elapsed().as_nanos() as f64 / steps as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[50]
}
fn fma(a: Real, b: Real, c: Real) -> Real {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}
fn rate_of<const N: usize>() -> f64 {
    let (factor, term) = (black_box(0.999), black_box(1e-3));
    median(
        || {
            let mut sums = black_box([1.0 as Real; N]);
            for _ in 0..POINTS {
                for i in 0..N {
                    sums[i] = fma(sums[i], factor, term);
                }
            }
            black_box(sums).iter().sum()
        },
        POINTS * N,
    )
}
fn main() {
    let offset = |i: usize, scale: Real| scale * ((i * 7919 % 1009) as Real / 504.5 - 1.0);
    let points: Vec<[Real; 2]> = (0..POINTS).map(|i| [offset(i, 1e-4), offset(i + 3, 1e-2)]).collect();
    let lanes: Vec<[[Real; LANES]; 2]> = points
        .chunks_exact(LANES)
        .map(|c| [0, 1].map(|k| std::array::from_fn(|lane| c[lane][k])))
        .collect();
    let parameters = black_box([-1e-4, 1e-5]);
    let lane_parameters = black_box([[-1e-4; LANES], [1e-5; LANES]]);
    let frozen = freeze(parameters);
    let sum = |step: Step| black_box(step).image[0];
    let lane_sum = |step: LaneStep| black_box(step).image[0][0];
    println!("{}", median(|| points.iter().map(|&p| sum(step(p, parameters))).sum(), POINTS));
    println!("{}", median(|| points.iter().map(|&p| sum(frozen.step(p))).sum(), POINTS));
    println!("{}", median(|| (0..POINTS).fold(points[1], |p, _| frozen.step(p).image)[0], POINTS));
    println!("{}", median(|| lanes.iter().map(|p| lane_sum(step_lanes(p, &lane_parameters))).sum(), POINTS));
    println!("{}", median(|| lanes.iter().map(|p| lane_sum(frozen.step_lanes(p))).sum(), POINTS));
    let rates = [rate_of::<8>(), rate_of::<16>(), rate_of::<32>(), rate_of::<64>(), rate_of::<128>()];
    println!("{}", rates.into_iter().fold(f64::INFINITY, f64::min));
}
"#;

/// Figures printed by a compiled program, in order.
fn measure(folder: &Path, native: bool) -> Vec<f64> {
    let mut compiler = Command::new("rustc");
    compiler.args([
        "--edition",
        "2024",
        "-Copt-level=3",
        "--cap-lints=allow",
        "--cfg",
        "feature=\"std\"",
        "main.rs",
    ]);
    if native {
        compiler.arg("-Ctarget-cpu=native");
    }
    let compiled = compiler.current_dir(folder).status().expect("rustc is there").success();
    assert!(compiled, "the emitted map compiles");
    let output = Command::new(folder.join("main")).output().expect("the program runs");
    let text = String::from_utf8(output.stdout).expect("numbers");
    text.lines().map(|line| line.parse().expect("a number")).collect()
}

/// Module of a scene at these orders, with 64 bytes of lanes.
fn module(name: &str, orders: MapOrders, precision: FloatFormat) -> EmittedModule {
    let scene = Scene::of_catalogue(name).expect("a good scene");
    let orbit = locate(&scene).expect("no wrong input").into_result().expect("it grazes");
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let map = match scene.emit.shape {
        Shape::Flown => expander.flown(orders),
        _ => expander.expand(orders),
    };
    let map = map.expect("an expansion");
    let options = EmitOptions {
        precision,
        lanes: match precision {
            FloatFormat::F32 => 16,
            FloatFormat::F64 => 8,
        },
        ..EmitOptions::default()
    };
    emitted_module(&map, None, &options).expect("an emission")
}

fn main() {
    println!("ns per step; floor = multiply-adds x time of one in a loop of nothing else");
    println!(
        "scene         orders    target        step  frozen  chained  lanes  frozen lanes | floor  frozen | madds  frozen"
    );
    let options = EmitOptions::default();
    let bare = emitted_module(&synthetic::two_polynomials(5), None, &options);
    measure_both("polynomials", (5, 0), &bare.expect("an emission"));
    for (name, smooth_order, contact_weight) in MAPS {
        let orders = MapOrders { smooth_order, contact_weight };
        let shown = (smooth_order, contact_weight);
        let double = module(name, orders, FloatFormat::F64);
        measure_both(name, shown, &double);
        if (name, shown) == SINGLE {
            measure_both(name, shown, &module(name, orders, FloatFormat::F32));
        }
    }
}

/// Times a module compiled for any machine and for this one, and prints a line for each.
fn measure_both(name: &str, (smooth_order, contact_weight): (u32, u32), module: &EmittedModule) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("map.rs"), &module.content).expect("a file");
    let program = PROGRAM.replace("REAL", &module.precision.to_string());
    std::fs::write(folder.path().join("main.rs"), program).expect("a file");
    for native in [false, true] {
        let t = measure(folder.path(), native);
        let (all, few) =
            (module.step_operations.multiply_adds, module.frozen_operations.multiply_adds);
        println!(
            "{name:12} ({smooth_order}, {contact_weight:2})   {} {} {:6.1}  {:6.1}  {:7.1}  {:5.2}  {:12.2} | {:5.2}  {:6.2} | {all:5}  {few:6}",
            if native { "native  " } else { "baseline" },
            module.precision,
            t[0],
            t[1],
            t[2],
            t[3],
            t[4],
            all as f64 * t[5],
            few as f64 * t[5],
        );
    }
}
