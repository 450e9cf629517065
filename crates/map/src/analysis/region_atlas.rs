//! Atlases about a grazing orbit: their region, and their measurement against direct simulation.
//!
//! The section is stroboscopic, whatever the section of the scene: at the phase that the scene
//! names, or else at the phase at which the orbit is farthest from all stops, so that
//! contacts do not coincide with the section.

use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::atlas_plane::{AtlasPlane, CELLS};
use super::error::AnalysisError;
use super::progress::{NoProgress, Progress};
use super::time_series::{SeriesPoint, TimeSeriesRequest, time_series};
use crate::atlas::{
    Answer, Atlas, AtlasOptions, Cell, Expansion, FrozenLeaves, LeafCounts, LeafShares,
    Measurement, Region, RegionError, SavedAtlas, StroboscopicReturn, Tabulated,
};
use crate::hybrid::HybridSystem;
use crate::model::{Response, Scene, Section, StroboscopicPhase};
use crate::numeric::{Dd, converted};
use crate::orbit::{GrazingOrbit, PiecewiseFlow};

/// Rows of the grazing orbit among which the phase is chosen.
const SAMPLES: usize = 256;
/// Half-width of a region, as a share of the extent of a state along the grazing orbit.
const HALF_WIDTH: f64 = 0.05;
/// Points at which the time of a step is measured.
const TIMED: usize = 200;
/// Passes over these points: each point is timed this many times.
const PASSES: usize = 20;
/// Points at fixed parameters, which may need leaves of their own.
const FROZEN: usize = 50;

/// Grazing orbit at a phase of the forcing.
#[derive(Clone, Debug, PartialEq)]
pub struct StroboscopicPoint {
    /// Phase, in `[0, period)` unless it was given.
    pub phase: f64,
    /// States of the orbit there, in the model's order.
    pub states: Vec<f64>,
    /// Half-widths of the default region, one per state.
    pub half_widths: Vec<f64>,
}

impl StroboscopicPoint {
    /// Point of an orbit at a phase; at the section's own, or the one farthest from all stops, if
    /// none is given.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Region`] for a model without a phase; [`AnalysisError::Orbit`] if the orbit
    /// cannot be flown.
    pub fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        phase: Option<f64>,
    ) -> Result<Self, AnalysisError> {
        let model = &scene.model;
        let forcing = model.phase.as_ref().ok_or(RegionError::NoPhase)?;
        let request = TimeSeriesRequest {
            start: vec![0.0; orbit.section.coordinates.len()],
            parameters: vec![0.0; scene.expansion.active.len()],
            settle: 0,
            returns: 1,
            samples: SAMPLES,
        };
        let series = time_series(scene, orbit, &request, &NoProgress)?;
        let rows: Vec<&SeriesPoint> =
            series.points.iter().filter(|row| row.event.is_none()).collect();
        let states = model.states.len();
        let half_widths = (0..states).map(|state| {
            let values = series.points.iter().map(|row| row.state[state]);
            let [low, high] = [
                values.clone().fold(f64::INFINITY, f64::min),
                values.fold(f64::NEG_INFINITY, f64::max),
            ];
            HALF_WIDTH * (high - low)
        });
        let half_widths = half_widths.collect();
        // NOTE: at the phase of the graze itself the section would cut the contact.
        let own = matches!(scene.section, Section::Stroboscopic(StroboscopicPhase::At(_)))
            .then(|| orbit.section_point[states].to_f64());
        let period = forcing.period.to_f64();
        let clearance = |row: &SeriesPoint| row.gaps.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = rows.iter().max_by(|a, b| clearance(a).total_cmp(&clearance(b)));
        let farthest = farthest.ok_or(AnalysisError::NoMoment)?;
        let phase = phase.or(own).unwrap_or(farthest.state[states]);
        let behind = |row: &SeriesPoint| (phase - row.state[states]).rem_euclid(period);
        let nearest = rows.iter().min_by(|a, b| behind(a).total_cmp(&behind(b)));
        let nearest = nearest.ok_or(AnalysisError::NoMoment)?;
        let time =
            behind(nearest) * orbit.period.to_f64() / (scene.grazing.periods as f64 * period);
        let parameters: Vec<f64> = converted(orbit.parameters());
        let mut there = PiecewiseFlow::free(scene, &[]).flow(&nearest.state, &parameters, time)?;
        there.truncate(states);
        Ok(Self { phase, states: there, half_widths })
    }
}

/// Region of an atlas, with the parameters of the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtlasRegion {
    /// Phase of the section.
    pub phase: f64,
    /// Forcing periods of one return.
    pub periods: usize,
    /// Ranges by name: all states, and parameters that become coordinates.
    pub ranges: Vec<(String, [f64; 2])>,
    /// All parameters of the model.
    pub parameters: Vec<Dd>,
}

/// An atlas and its measurement.
#[derive(Clone, Debug)]
pub struct AtlasStudy {
    /// Region, in the order of the axes.
    pub region: AtlasRegion,
    /// Settings.
    pub options: AtlasOptions,
    /// Boxes expanded, those of a saved atlas included.
    pub expanded: usize,
    /// Whether the most boxes were expanded.
    pub is_exhausted: bool,
    /// Leaves by kind.
    pub counts: LeafCounts,
    /// Shares of the region by kind of leaf.
    pub shares: LeafShares,
    /// Memory of the atlas.
    pub bytes: usize,
    /// Errors against direct simulation.
    pub measurement: Measurement,
    /// Time of a step by the atlas, in seconds; `None` if no point is in a leaf.
    pub step: Option<f64>,
    /// Time of such a step with the parameters fixed; `None` without parameters in the region.
    pub frozen_step: Option<f64>,
    /// Time of a direct return at the same points.
    pub direct: Option<f64>,
    /// Compliant stops, whose grazes have no leaves.
    pub compliant: Vec<String>,
    /// Plane of the first two axes; `None` for a region of one axis, or if it was not asked for.
    pub plane: Option<AtlasPlane>,
    /// The atlas as data.
    pub saved: SavedAtlas,
}

/// Work of a study.
#[derive(Clone, Copy, Debug)]
pub struct AtlasWork<'a> {
    /// Atlas to go on with.
    pub saved: Option<&'a SavedAtlas>,
    /// Points at which leaves are made and compared with direct simulation.
    pub points: usize,
    /// Whether the plane of the first two axes is computed.
    pub drawn: bool,
}

/// Units of progress of a box, of a point that is used, and of a row of the plane.
const UNITS: u64 = 100;

/// Return map of an atlas that reports the expansion of every box.
#[derive(Debug)]
pub(super) struct ReportedReturn<'a> {
    pub(super) map: StroboscopicReturn<'a>,
    boxes: &'a BoxReports<'a>,
}

/// Progress of boxes, one after another.
#[derive(Debug)]
struct BoxReports<'a> {
    progress: &'a dyn Progress,
    /// Units of the present box that are told.
    told: AtomicU64,
}

impl BoxReports<'_> {
    /// Reports the share of the present box that is done, if it is the largest so far.
    fn reach(&self, share: f64) {
        let reached = ((UNITS as f64 * share) as u64).min(UNITS);
        let told = self.told.fetch_max(reached, Ordering::Relaxed);
        self.progress.advance(reached.saturating_sub(told));
    }

    /// Reports the end of the present box.
    fn end(&self) {
        self.reach(1.0);
        self.told.store(0, Ordering::Relaxed);
    }
}

impl Tabulated for ReportedReturn<'_> {
    fn ranges(&self) -> Vec<[f64; 2]> {
        self.map.ranges()
    }

    fn scales(&self) -> Vec<f64> {
        self.map.scales()
    }

    fn image(&mut self, point: &[f64], image: &mut [f64]) -> bool {
        self.map.image(point, image)
    }

    fn expand(&mut self, cell: &Cell, order: usize) -> Expansion {
        let expansion = self.map.expand(cell, order);
        self.boxes.end();
        expansion
    }
}

/// Makes an atlas where low-discrepancy points come, measures it there, and times it. Goes on with
/// a saved atlas, if there is one: then `options` counts for the most boxes only.
///
/// Progress counts the boxes, up to the most boxes, the points as often as they are used, and the
/// rows of the plane, each in hundredths.
///
/// # Errors
///
/// [`AnalysisError::Region`], [`AnalysisError::AtlasOptions`], [`AnalysisError::Restore`] for what
/// cannot be tabulated, [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn atlas_study(
    scene: &Scene,
    region: &AtlasRegion,
    options: &AtlasOptions,
    AtlasWork { saved, points, drawn }: AtlasWork<'_>,
    progress: &dyn Progress,
) -> Result<AtlasStudy, AnalysisError> {
    let mut model = scene.model.clone();
    for (parameter, &value) in model.parameters.iter_mut().zip(&region.parameters) {
        parameter.value = value;
    }
    let ranges: Vec<_> =
        region.ranges.iter().map(|(name, range)| (name.as_str(), *range)).collect();
    let axes = Region::new(&model, region.phase, region.periods, &ranges)?;
    let ranges = axes.axes.iter().map(|axis| (axis.name.clone(), axis.range)).collect();
    let system = HybridSystem::new(&model);
    let boxes = BoxReports { progress, told: AtomicU64::new(0) };
    let watch = |share| boxes.reach(share);
    let map = StroboscopicReturn::new(&system, &model, axes)?.watched(&watch);
    let map = ReportedReturn { map, boxes: &boxes };
    let mut atlas = match saved {
        Some(saved) => Atlas::restore(map, saved, options.boxes)?,
        None => Atlas::new(map, options.clone())?,
    };
    let boxes_left = |atlas: &Atlas<ReportedReturn<'_>>| {
        atlas.options().boxes.saturating_sub(atlas.expanded()) as u64
    };
    let has_parameters = atlas.map().ranges().len() > atlas.map().scales().len();
    let frozen = if has_parameters { points.min(FROZEN) } else { 0 };
    let used = points + points.min(TIMED) + frozen;
    let rows = if drawn { CELLS } else { 0 };
    progress.expect(UNITS * (boxes_left(&atlas) + (used + rows) as u64));
    let look = || progress.advance(UNITS);
    let measurement = atlas.measure(points, look);
    let [step, direct] = step_times(&mut atlas, points, look);
    let frozen_step = frozen_step_time(&mut atlas, points, look);
    let plane = drawn.then(|| AtlasPlane::new(&mut atlas, look)).flatten();
    progress.advance(UNITS * boxes_left(&atlas));
    let compliant = model.surfaces.iter();
    let compliant =
        compliant.filter(|surface| matches!(surface.response, Response::Contact { .. }));
    Ok(AtlasStudy {
        region: AtlasRegion { ranges, ..region.clone() },
        options: atlas.options().clone(),
        expanded: atlas.expanded(),
        is_exhausted: atlas.is_exhausted(),
        counts: atlas.counts(),
        shares: atlas.shares(),
        bytes: atlas.bytes(),
        measurement,
        step,
        frozen_step,
        direct,
        compliant: compliant.map(|surface| surface.name.clone()).collect(),
        plane,
        saved: atlas.saved(),
    })
}

/// Mean times of a step by the leaves, and of a direct return, at points that have a leaf; calls
/// `look` after each point.
fn step_times(
    atlas: &mut Atlas<ReportedReturn<'_>>,
    points: usize,
    look: impl Fn(),
) -> [Option<f64>; 2] {
    let mut image = vec![0.0; atlas.map().scales().len()];
    let all = (0..points.min(TIMED)).map(|index| atlas.spread(index)).collect::<Vec<_>>();
    let mut kept = Vec::new();
    for point in all {
        if is_tabulated(atlas.image(&point, &mut image)) {
            kept.push(point);
        }
        look();
    }
    let step = mean_time(&kept, PASSES, |point| {
        black_box(atlas.image(black_box(point), &mut image));
    });
    let direct = mean_time(&kept, 1, |point| {
        black_box(atlas.map().image(black_box(point), &mut image));
    });
    [step, direct]
}

/// Mean time of a step with the parameters in the middle of their ranges, reduced before; calls
/// `look` after each point.
fn frozen_step_time(
    atlas: &mut Atlas<ReportedReturn<'_>>,
    points: usize,
    look: impl Fn(),
) -> Option<f64> {
    let states = atlas.map().scales().len();
    let middle = atlas.map().ranges().into_iter().skip(states);
    let middle: Vec<f64> = middle.map(|[low, high]| 0.5 * (low + high)).collect();
    if middle.is_empty() {
        return None;
    }
    let mut image = vec![0.0; states];
    let mut frozen = FrozenLeaves::new(&middle);
    let mut kept = Vec::new();
    for index in 0..points.min(FROZEN) {
        let point = atlas.spread(index)[..states].to_vec();
        if is_tabulated(frozen.image(atlas, &point, &mut image)) {
            kept.push(point);
        }
        look();
    }
    mean_time(&kept, PASSES, |point| {
        black_box(frozen.image(atlas, black_box(point), &mut image));
    })
}

fn is_tabulated(answer: Answer) -> bool {
    matches!(answer, Answer::Tabulated(_))
}

/// Mean time of work on one point, in seconds; `None` without points.
fn mean_time(points: &[Vec<f64>], passes: usize, mut work: impl FnMut(&[f64])) -> Option<f64> {
    let begin = Instant::now();
    for _ in 0..passes {
        points.iter().for_each(|point| work(point));
    }
    let each = begin.elapsed().as_secs_f64() / (passes * points.len()) as f64;
    (!points.is_empty()).then_some(each)
}
