//! Where a map is more accurate than direct simulation in double precision.
//!
//! One idea: the window shrinks. A map's error falls with it until only rounding is left, while a
//! root of the gap's minimum taken in double precision loses digits as the contact becomes shallow.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::ConvergenceError;
use super::errors::error;
use super::sample::{SamplePoint, WindowSample};
use super::truth::{distance, image};
use crate::analysis::DirectImage;
use crate::hybrid::HybridSystem;
use crate::iteration::DiscreteMap;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::GrazingOrbit;

/// Points in each window.
const POINTS: usize = 24;

/// Number in the sequence of the first of them.
const FIRST: usize = 30_000;

/// Windows, each a quarter of the one before.
const WINDOWS: i32 = 14;

/// Errors of a map and of direct simulation in double precision as the window shrinks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthAccuracy {
    /// Depth below which the map is the more accurate of the two at every depth measured; `None`
    /// where it is not even in the smallest window.
    pub crossing: Option<f64>,
    /// One entry per window, the scene's own first.
    pub windows: Vec<WindowAccuracy>,
}

/// Largest errors in one window, whose half-widths are scaled as its depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowAccuracy {
    /// Depth of the window.
    pub depth: f64,
    /// Of the map, in double precision.
    pub map: f64,
    /// Of direct simulation in double precision.
    pub direct: f64,
}

/// Measures both on windows that shrink by factors of four.
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
            let direct: Vec<Dd> = direct.into_iter().map(Dd::from).collect();
            Some((error(map, point, &truth), distance(&direct, &truth)))
        };
        let points = window.points(FIRST, POINTS);
        let errors: Vec<(f64, f64)> = points
            .par_iter()
            .map_init(|| (exact.clone(), double.clone()), errors)
            .flatten()
            .collect();
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
    Ok(DepthAccuracy {
        crossing: crossing(&windows),
        windows,
    })
}

/// Where the errors cross, both taken as powers of the depth between two windows.
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
    Some(if depth.is_finite() {
        depth
    } else {
        below.depth
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_that_are_powers_of_the_depth_cross_where_they_are_equal() {
        let window = |number: i32| {
            let depth = 4f64.powi(-number);
            WindowAccuracy {
                depth,
                map: depth * depth,
                direct: 1e-3 / depth.sqrt(),
            }
        };
        let windows: Vec<_> = (0..8).map(window).collect();
        let expected = 1e-3f64.powf(0.4);
        let found = crossing(&windows).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-12, "{found}");
        assert_eq!(crossing(&windows[..1]), None);
        assert_eq!(crossing(&windows[4..]), Some(windows[4].depth));
    }
}
