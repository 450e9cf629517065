//! Reach of a map: the largest window on which its error stays within a tolerance, and the depth
//! below which it is more accurate than direct simulation in double precision.
//!
//! The sample of the scene's window is scaled until a point of it fails. As the window shrinks, a
//! map's error falls until only rounding remains, whereas a root of the gap's minimum loses digits
//! in double precision.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::analysis::DirectImage;
use crate::convergence::ConvergenceError;
use crate::convergence::sample::{SamplePoint, WindowSample};
use crate::convergence::truth::{distance, error, image, window_sample};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{DiscreteMap, parallel};
use crate::model::Scene;
use crate::numeric::{Dd, converted, last_that_holds};
use crate::orbit::GrazingOrbit;

/// Number of points at which a window is tried, in addition to its corners.
const TRIED: usize = 48;

/// Sequence number of the first of these points, beyond the points that orders are chosen by.
const FIRST_TRIED: usize = 20_000;

/// Largest number of octaves by which the scene's window is scaled down.
const DOWN: i32 = 24;

/// Largest number of octaves by which a window is scaled up.
const UP: i32 = 6;

/// Number of halvings of the last octave: the scale is found to 5 %.
const HALVINGS: usize = 4;

/// Largest window on which a map meets a tolerance.
///
/// A window holds if at every point of a sample direct simulation in double-double returns, makes
/// no contact other than those of the grazing passages, and differs from the map by at most the
/// tolerance. Sizes are found to 5 %.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validity {
    /// The tolerance, in the units of the offsets.
    pub tolerance: f64,
    /// Largest factor of the scene's window (depth and all half-widths alike), between `2^-24` and
    /// 64; `None` if no window holds.
    pub scale: Option<f64>,
    /// Largest depth with the half-widths of the scaled window; at most 64 times the depth of that
    /// window.
    pub depth: Option<f64>,
    /// Largest half-width of each coordinate, with all other bounds those of the scaled window;
    /// `None` for a coordinate that is solved for the depth.
    pub state: BTreeMap<String, Option<f64>>,
    /// Largest half-width of each parameter, with all other bounds those of the scaled window.
    pub parameter: BTreeMap<String, Option<f64>>,
}

/// Measures the largest window on which a map meets a tolerance.
///
/// `local` gives the variables and the window of the scene; `map` is the map to run, in any shape.
///
/// # Errors
///
/// [`ConvergenceError`] if direct simulation cannot be set up for the scene.
pub fn validity(
    scene: &Scene,
    orbit: &GrazingOrbit,
    local: &LocalMap,
    map: &dyn DiscreteMap,
    tolerance: f64,
) -> Result<Validity, ConvergenceError> {
    let system = HybridSystem::new(&scene.model);
    let check = MapCheck { map, direct: DirectImage::new(&system, scene, orbit)?, tolerance };
    let sample = window_sample(scene, orbit, local)?;
    let widths = sample.widths();
    let scaled = |window: &WindowSample, scale| window.scaled(scale, &vec![scale; widths.len()]);
    let scale = largest(DOWN, |scale| check.holds(&scaled(&sample, scale)));
    let window = scale.map(|scale| scaled(&sample, scale));
    let alone = |variable: usize| {
        let window = window.as_ref()?;
        if sample.steepest.contains(&variable) {
            return None;
        }
        let grown = |factor| {
            let mut factors = vec![1.0; widths.len()];
            factors[variable] = factor;
            check.holds(&window.scaled(1.0, &factors))
        };
        largest(0, grown).map(|factor| factor * window.widths()[variable])
    };
    let depth = window.as_ref().and_then(|window| {
        let deeper = |factor| check.holds(&window.scaled(factor, &vec![1.0; widths.len()]));
        largest(0, deeper).map(|factor| factor * window.deepest())
    });
    let coordinates = local.section.coordinates.iter().cloned();
    let parameters = local.parameters.iter().map(|active| active.name.clone());
    Ok(Validity {
        tolerance,
        scale,
        depth,
        state: coordinates.zip((0..).map(&alone)).collect(),
        parameter: parameters.zip((local.dimension()..).map(&alone)).collect(),
    })
}

/// A map compared with direct simulation to a tolerance.
struct MapCheck<'a> {
    map: &'a dyn DiscreteMap,
    direct: DirectImage<'a, Dd>,
    tolerance: f64,
}

impl MapCheck<'_> {
    /// Whether the map meets the tolerance at every point of a sample; stops at the first failure.
    fn holds(&self, sample: &WindowSample) -> bool {
        let points = sample.judging(FIRST_TRIED, TRIED);
        let meets =
            |direct: &mut DirectImage<'_, Dd>, point: &SamplePoint| match image(direct, point) {
                Ok(Some(exact)) if error(self.map, point, &exact) <= self.tolerance => Ok(()),
                _ => Err(()),
            };
        let all = parallel::try_map_with(&points, || self.direct.clone(), meets);
        2 * points.len() >= TRIED && all.is_ok()
    }
}

/// Largest factor that holds, to 5 %, between `2^-down` and `2^6`.
fn largest(down: i32, mut holds: impl FnMut(f64) -> bool) -> Option<f64> {
    let mut low = 0;
    if holds(1.0) {
        while low < UP && holds(2f64.powi(low + 1)) {
            low += 1;
        }
        if low == UP {
            return Some(2f64.powi(UP));
        }
    } else {
        low = (1..=down).map(|octave| -octave).find(|&octave| holds(2f64.powi(octave)))?;
    }
    let (low, high) = (f64::from(low), f64::from(low + 1));
    let octave = last_that_holds(low, high, HALVINGS, |octave| holds(octave.exp2()));
    Some(octave.exp2())
}

/// Number of points in each window.
const POINTS: usize = 24;

/// Sequence number of the first of these points.
const FIRST: usize = 30_000;

/// Number of windows, each a quarter of the one before.
const WINDOWS: i32 = 14;

/// Errors of a map and of direct simulation in double precision as the window shrinks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthAccuracy {
    /// Depth below which the map is more accurate than direct simulation at every depth measured;
    /// `None` if it is not even in the smallest window.
    pub crossing: Option<f64>,
    /// One entry per window, the scene's own first.
    pub windows: Vec<WindowAccuracy>,
}

/// Largest errors in one window, whose half-widths scale with its depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowAccuracy {
    /// Depth of the window.
    pub depth: f64,
    /// Largest error of the map in double precision.
    pub map: f64,
    /// Largest error of direct simulation in double precision.
    pub direct: f64,
}

/// Measures the map and direct simulation on windows that shrink by factors of four.
pub(super) fn depth_accuracy(
    system: &HybridSystem,
    scene: &Scene,
    orbit: &GrazingOrbit,
    sample: &WindowSample,
    map: &dyn DiscreteMap,
) -> Result<DepthAccuracy, ConvergenceError> {
    let exact = DirectImage::<Dd>::new(system, scene, orbit)?;
    let double = DirectImage::<f64>::new(system, scene, orbit)?;
    let variables = sample.widths().len();
    let in_window = |number: i32| {
        let scale = 4f64.powi(-number);
        let window = sample.scaled(scale, &vec![scale; variables]);
        let errors = |(exact, double): &mut (DirectImage<'_, Dd>, DirectImage<'_, f64>),
                      point: &SamplePoint| {
            let truth = image(exact, point).ok()??;
            let direct = image(double, point).ok()??;
            Some((error(map, point, &truth), distance(&converted(&direct), &truth)))
        };
        let points = window.points(FIRST, POINTS);
        let errors = parallel::map_with(&points, || (exact.clone(), double.clone()), errors);
        let errors: Vec<(f64, f64)> = errors.into_iter().flatten().collect();
        let largest = |errors: &mut dyn Iterator<Item = f64>| {
            errors.fold(0.0, |max, value| if value <= max { max } else { value })
        };
        (!errors.is_empty()).then(|| WindowAccuracy {
            depth: window.deepest(),
            map: largest(&mut errors.iter().map(|pair| pair.0)),
            direct: largest(&mut errors.iter().map(|pair| pair.1)),
        })
    };
    let windows: Vec<_> = (0..WINDOWS).filter_map(in_window).collect();
    Ok(DepthAccuracy { crossing: crossing(&windows), windows })
}

/// Depth at which the errors cross, with both interpolated as powers of the depth between two
/// windows.
fn crossing(windows: &[WindowAccuracy]) -> Option<f64> {
    let excess = |window: &WindowAccuracy| (window.map / window.direct).ln();
    let better = |window: &&WindowAccuracy| window.map <= window.direct;
    let count = windows.iter().rev().take_while(better).count();
    let first = windows.len() - count;
    let below = windows.get(first)?;
    let Some(above) = first.checked_sub(1).map(|number| &windows[number]) else {
        return Some(below.depth);
    };
    let share = excess(above) / (excess(above) - excess(below));
    let depth = above.depth * (below.depth / above.depth).powf(share);
    Some(if depth.is_finite() { depth } else { below.depth })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_factor_is_found_to_five_percent_from_both_sides() {
        for edge in [1e-3, 0.3, 1.0, 7.0, 50.0] {
            let found = largest(DOWN, |factor| factor <= edge).unwrap();
            assert!(found <= edge && edge < 1.05 * found, "{edge}: {found}");
        }
        assert_eq!(largest(DOWN, |_| true), Some(64.0));
        assert_eq!(largest(DOWN, |_| false), None);
    }

    #[test]
    fn errors_that_are_powers_of_the_depth_cross_where_they_are_equal() {
        let window = |number: i32| {
            let depth = 4f64.powi(-number);
            WindowAccuracy { depth, map: depth * depth, direct: 1e-3 / depth.sqrt() }
        };
        let windows: Vec<_> = (0..8).map(window).collect();
        let expected = 1e-3f64.powf(0.4);
        let found = crossing(&windows).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}");
        assert_eq!(crossing(&windows[..1]), None);
        assert_eq!(crossing(&windows[4..]), Some(windows[4].depth));
    }
}
