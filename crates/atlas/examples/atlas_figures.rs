//! Atlases of two regions of the linear oscillator beside direct simulation: leaves by kind, bytes,
//! share of direct images, error, and times.
//!
//! ```text
//! cargo run --release -p grazemap-atlas --example atlas_figures [POINTS]
//! ```

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use grazemap_atlas::atlas::{Atlas, AtlasOptions, Region, StroboscopicReturn, Tabulated};
use grazemap_atlas::hybrid::HybridSystem;
use grazemap_atlas::model::Scene;
use grazemap_atlas::numeric::low_discrepancy;

/// A scene of the catalogue, a phase and ranges.
struct Figure {
    title: &'static str,
    scene: &'static str,
    phase: f64,
    ranges: &'static [(&'static str, [f64; 2])],
}

const FIGURES: [Figure; 2] = [
    Figure {
        title: "linear, next to the graze",
        scene: "linear",
        phase: 0.0,
        ranges: &[("x", [-1.1, -0.9]), ("v", [0.0, 0.3])],
    },
    Figure {
        title: "linear, far, with a parameter",
        scene: "linear",
        phase: 0.0,
        ranges: &[("x", [-1.6, -0.4]), ("v", [-0.8, 1.2]), ("alpha", [2.2, 2.4])],
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let points = std::env::args().nth(1).map_or(Ok(100_000), |text| text.parse())?;
    for figure in &FIGURES {
        measure(figure, points)?;
    }
    Ok(())
}

fn measure(figure: &Figure, points: usize) -> Result<(), Box<dyn Error>> {
    let scene = Scene::of_catalogue(figure.scene)?;
    let system = HybridSystem::new(&scene.model);
    let region = Region::new(&scene.model, figure.phase, 1, figure.ranges)?;
    let map = StroboscopicReturn::new(&system, &scene.model, region)?;
    let mut direct = map.clone();
    let mut atlas = Atlas::new(map, AtlasOptions::default())?;

    let begin = Instant::now();
    let found = atlas.measure(points, || ());
    let making = begin.elapsed().as_secs_f64();
    let spread: Vec<Vec<f64>> = (0..points).map(|index| point(figure.ranges, index)).collect();
    let mut image = vec![0.0; scene.model.states.len()];
    let begin = Instant::now();
    for point in &spread {
        black_box(direct.image(black_box(point), &mut image));
    }
    let each_direct = begin.elapsed().as_secs_f64() / points as f64;
    let begin = Instant::now();
    for point in &spread {
        black_box(atlas.image(black_box(point), &mut image));
    }
    let each = begin.elapsed().as_secs_f64() / points as f64;

    let counts = atlas.counts();
    let leaves = counts.smooth + counts.grazed + counts.direct;
    let compared = each_direct * points as f64;
    println!("{}: {:?}", figure.title, figure.ranges);
    println!(
        "  leaves {leaves}: {} smooth, {} grazed, {} direct; {} kB",
        counts.smooth,
        counts.grazed,
        counts.direct,
        atlas.bytes() / 1000
    );
    println!(
        "  {points} points: {} tabulated, {} direct, {} without image",
        found.tabulated, found.direct, found.without_image
    );
    println!(
        "  largest error {:.2e}, {} beyond the tolerance",
        found.largest_error,
        found.violations.len()
    );
    for point in found.violations.iter().take(3) {
        println!("    {point:?}");
    }
    println!(
        "  image {:.0} ns, direct {:.0} ns, making a leaf {:.2} ms",
        1e9 * each,
        1e9 * each_direct,
        1e3 * (making - compared).max(0.0) / leaves as f64
    );
    Ok(())
}

/// Point of a sequence that covers the ranges evenly.
fn point(ranges: &[(&str, [f64; 2])], index: usize) -> Vec<f64> {
    let unit = low_discrepancy(index, ranges.len());
    let values = ranges.iter().zip(unit);
    values.map(|((_, [low, high]), share)| low + (high - low) * share).collect()
}
