//! Estimates, before anything is computed, of the bytes that results take in memory.
//!
//! One idea: every number that a user gives enters a saturating product of sizes.

use super::basin::BasinRequest;
use super::image::ImageRequest;
use super::noise::{CHUNK, NoiseRequest};
use super::time_series::TimeSeriesRequest;
use crate::atlas::AtlasOptions;
use crate::expansion::LocalMap;
use crate::iteration::{StepInfo, parallel};
use crate::model::{ChartRequest, DiagramRequest, Scene, SweepDirection};

/// Bytes of a number.
const NUMBER: u64 = size_of::<f64>() as u64;

/// Most orbits that one thread iterates in step.
const ORBITS: u64 = 32;

/// Product of sizes, saturating at the largest `u64`.
fn product<const N: usize>(sizes: [u64; N]) -> u64 {
    sizes.into_iter().fold(1, u64::saturating_mul)
}

/// Bytes of the orbits that all threads iterate at once, each with `iterates` iterates.
fn orbits_at_once(scene: &Scene, iterates: usize) -> u64 {
    let iterate = NUMBER * scene.model.dimension() as u64 + size_of::<StepInfo>() as u64;
    product([parallel::threads() as u64, ORBITS, iterates as u64, iterate])
}

/// Bytes that all diagrams of a scene take in memory.
pub fn diagrams_bytes(scene: &Scene) -> u64 {
    let bytes = scene.diagrams.iter().map(|request| diagram_bytes(scene, request));
    bytes.fold(0, u64::saturating_add)
}

/// Bytes that all charts of a scene take in memory.
pub fn charts_bytes(scene: &Scene) -> u64 {
    let bytes = scene.charts.iter().map(|request| chart_bytes(scene, request));
    bytes.fold(0, u64::saturating_add)
}

/// Bytes that a diagram takes in memory if all its values are kept.
pub fn diagram_bytes(scene: &Scene, request: &DiagramRequest) -> u64 {
    /// Bytes of a parameter value, the kept values excluded.
    const POINT: u64 = 400;
    let headings = if request.direction == SweepDirection::Both { 2 } else { 1 };
    let sweeps = product([request.with.len() as u64, request.starts.count() as u64, headings]);
    let point = POINT.saturating_add(product([NUMBER, request.keep as u64]));
    let kept = product([sweeps, request.points as u64, point]);
    kept.saturating_add(orbits_at_once(scene, request.keep))
}

/// Bytes that the charts of a request take in memory.
pub fn chart_bytes(scene: &Scene, request: &ChartRequest) -> u64 {
    /// Bytes of a cell, with the names of its orbit, while it is refined and drawn; then bytes of
    /// each further attractor.
    const CELL: u64 = 400;
    const ATTRACTOR: u64 = 200;
    let [width, height] = request.points.map(|points| points as u64);
    let cell = CELL + product([ATTRACTOR, request.attractors as u64 - 1]);
    let cells = product([width, height, request.count() as u64, cell]);
    cells.saturating_add(orbits_at_once(scene, request.keep.saturating_mul(2)))
}

/// Bytes that a basin takes in memory.
pub fn basin_bytes(request: &BasinRequest) -> u64 {
    /// Bytes of a cell while it is refined, ranked and drawn.
    const CELL: u64 = 150;
    let [width, height] = request.points.map(|points| points as u64);
    product([CELL, width, height])
}

/// Bytes that the images of rows take in memory, with the text of their table.
pub fn image_bytes(scene: &Scene, request: &ImageRequest) -> u64 {
    /// Bytes of an image without its offsets; bytes of an offset, which is a double-double and a
    /// text.
    const IMAGE: u64 = 150;
    const OFFSET: u64 = 16;
    let image = IMAGE + product([OFFSET, scene.model.dimension() as u64]);
    product([request.rows.len() as u64, request.iterations as u64, image])
}

/// Bytes of the states of `orbits` orbits with `iterations` iterates each.
pub fn orbit_bytes(scene: &Scene, orbits: usize, iterations: usize) -> u64 {
    product([NUMBER, scene.model.dimension() as u64, orbits as u64, iterations as u64])
}

/// Bytes of the images and depths of points, with derivatives if asked for, and of a copy of them
/// in the form of a caller.
pub fn batch_bytes(map: &LocalMap, points: usize, derivatives: bool) -> u64 {
    const COPIES: u64 = 2;
    let (dimension, passages) = (map.dimension() as u64, map.passages() as u64);
    let gradient = if derivatives { dimension + map.parameters.len() as u64 } else { 0 };
    let row = dimension.saturating_mul(1 + gradient) + passages;
    product([COPIES, NUMBER, points as u64, row])
}

/// Bytes that a time series takes in memory, with its table and figures.
pub fn series_bytes(scene: &Scene, request: &TimeSeriesRequest) -> u64 {
    /// Bytes of a row without its numbers; bytes of a number in table and document.
    const ROW: u64 = 200;
    const CELL: u64 = 60;
    let columns = 2 + scene.model.dimension() + scene.model.surfaces.len();
    let row = ROW + product([CELL, columns as u64]);
    product([request.returns as u64, request.samples as u64, row])
}

/// Bytes that orbits under noise take in memory: the counts of every chunk of orbits.
pub fn noise_bytes(scene: &Scene, request: &NoiseRequest) -> u64 {
    let cells = request.cells as u64;
    let marginals = product([scene.model.dimension() as u64, cells]);
    let counts = product([cells, cells]).saturating_add(marginals);
    product([request.orbits.div_ceil(CHUNK) as u64 + 1, counts, NUMBER])
}

/// Bytes that an atlas of all the boxes that may be expanded takes in memory, with the points at
/// which it is measured; a box without a graze is counted.
pub fn atlas_bytes(scene: &Scene, axes: usize, options: &AtlasOptions, points: usize) -> u64 {
    /// Bytes of a box without its numbers, and of a point.
    const CELL: u64 = 200;
    const POINT: u64 = 48;
    // Number of monomials up to the order: the binomial coefficient `order + axes` over `axes`.
    let terms = (1..=axes as u64)
        .fold(1_u64, |terms, axis| terms.saturating_mul(options.order as u64 + axis) / axis);
    let cell = CELL.saturating_add(product([NUMBER, terms, scene.model.states.len() as u64]));
    let point = POINT + product([NUMBER, axes as u64]);
    let measured = product([points as u64, point]);
    product([options.boxes as u64, cell]).saturating_add(measured)
}
