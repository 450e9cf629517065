//! The window of a map in words: which bounds are the scene's, which were measured, what the map
//! errs inside, and whether that is more than it should.

use super::map_listing::edge_words;
use crate::convergence::{
    BoundKind, BoundOrigin, CoordinateError, MeasuredWindow, SampleSummary, WindowBound,
    WindowTolerance,
};
use crate::expansion::{MapOrders, WindowEdge};
use crate::numeric::Shown;

/// The window and its errors, one line each.
pub fn window_words(window: &MeasuredWindow) -> String {
    format!("window: {}\n{}\n", bounds_words(window), error_words(window))
}

/// The bounds, those that the scene states first.
pub fn bounds_words(window: &MeasuredWindow) -> String {
    let of = |origin: BoundOrigin| {
        let bounds = window.bounds.iter().filter(move |bound| bound.origin == origin);
        bounds.map(bound_words).collect::<Vec<_>>().join(", ")
    };
    let groups = [
        (of(BoundOrigin::Scene), "as the scene states"),
        (of(BoundOrigin::Radius), "within the radius of the series in y"),
        (of(BoundOrigin::Measured), "measured"),
    ];
    let groups = groups.iter().filter(|(bounds, _)| !bounds.is_empty());
    let groups: Vec<_> = groups.map(|(bounds, origin)| format!("{bounds} ({origin})")).collect();
    groups.join("; ")
}

fn bound_words(bound: &WindowBound) -> String {
    let WindowBound { kind, name, value, .. } = bound;
    match kind {
        BoundKind::Depth => format!("y^2 <= {value:e}"),
        BoundKind::State | BoundKind::Parameter => format!("{name} ± {value:e}"),
    }
}

/// The errors inside, and what was asked.
pub fn error_words(window: &MeasuredWindow) -> String {
    let points = window.sample.points;
    let errors: Vec<String> = window
        .errors
        .iter()
        .map(|CoordinateError { coordinate, error, .. }| match error {
            Some(error) => format!("{coordinate} {error:.1e}"),
            None => format!("{coordinate} not finite"),
        })
        .collect();
    let (errors, asked) = (errors.join(", "), tolerance_words(window.tolerance));
    if points == 0 {
        return format!(
            "errors on the window: not measured, for none of {} points returns with no contact but \
                those of the grazing passages (asked: {asked})",
            window.sample.excluded
        );
    }
    format!(
        "errors on the window at {points} points, against direct simulation: {errors} (asked: \
            {asked})"
    )
}

fn tolerance_words(tolerance: WindowTolerance) -> String {
    match tolerance {
        WindowTolerance::Error(error) => format!("{}, as the scene states", Shown(error)),
        WindowTolerance::Share(share) => format!("{share:e} of each half-width"),
    }
}

/// What is to be said of a map on its window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WindowRemark {
    /// Whether it is a warning: the map errs more than its scene states, by a hundredth of a
    /// half-width or more, has no image of some points, or its window is deeper than the series
    /// reach. Otherwise it errs more than 1e-6 of a half-width, which no scene asked for.
    pub is_warning: bool,
    /// The remark.
    pub words: String,
}

impl WindowRemark {
    /// The remark of a scene, as a line of its own.
    pub fn of(&self, scene: &str) -> String {
        format!("{}: `{scene}`: {}", self.kind(), self.words)
    }

    /// `warning` or `note`.
    pub fn kind(&self) -> &'static str {
        if self.is_warning { "warning" } else { "note" }
    }
}

/// Error over the half-width above which a remark is a warning.
const LARGE_SHARE: f64 = 1e-2;

/// What is to be said of a map that errs more in its window than it should, of a window with points
/// that have no image, and of one deeper than the series in `y` reach; `None` where the map keeps
/// its tolerance.
///
/// ```
/// use grazemap::convergence::{CoordinateError, MeasuredWindow, SampleSummary, WindowTolerance};
/// use grazemap::expansion::MapOrders;
/// use grazemap::report::window_remark;
///
/// let window = |error| MeasuredWindow {
///     tolerance: WindowTolerance::Error(1e-6),
///     bounds: Vec::new(),
///     errors: vec![CoordinateError {
///         coordinate: "x".to_owned(),
///         error: Some(error),
///         limit: 1e-6,
///         half_width: 1e-2,
///     }],
///     sample: SampleSummary { points: 400, excluded: 0 },
/// };
/// let orders = MapOrders::new(3, 8);
/// assert_eq!(window_remark(&window(1e-7), orders, None), None);
/// assert_eq!(
///     window_remark(&window(6e-3), orders, None).expect("above the tolerance").of("mine"),
///     "warning: `mine`: on its window the map of orders (3, 8) errs by up to 6.0e-3 in x (6e-1 \
///      of its half-width), more than 1e-6, as the scene states",
/// );
/// ```
pub fn window_remark(
    window: &MeasuredWindow,
    orders: MapOrders,
    edge: Option<&WindowEdge>,
) -> Option<WindowRemark> {
    let edge = edge.filter(|edge| !edge.is_within());
    let edge = edge.map(|edge| format!("at the edge of the window {}", edge_words(edge)));
    let errors = excess_words(window, orders);
    let excluded = excluded_words(window);
    let share = |error: &CoordinateError| error.error.map(|value| value / error.half_width);
    let is_large = |share: Option<f64>| share.is_none_or(|share| share >= LARGE_SHARE);
    let is_warning = excluded.is_some()
        || edge.is_some()
        || matches!(window.tolerance, WindowTolerance::Error(_))
        || window.errors.iter().map(share).any(is_large);
    let parts: Vec<String> = [errors, excluded, edge].into_iter().flatten().collect();
    (!parts.is_empty()).then(|| WindowRemark { is_warning, words: parts.join("; ") })
}

/// By how much a map errs more than it should, where it does.
fn excess_words(window: &MeasuredWindow, orders: MapOrders) -> Option<String> {
    let worse = |a: &&CoordinateError, b: &&CoordinateError| a.excess().total_cmp(&b.excess());
    let worst = window.errors.iter().max_by(worse)?;
    if worst.is_within() {
        return None;
    }
    if window.sample.points == 0 {
        return Some(error_words(window));
    }
    Some(match worst.error {
        None => format!("on its window the map of orders {orders} has images without a value"),
        Some(error) => format!(
            "on its window the map of orders {orders} errs by up to {error:.1e} in {} ({:.0e} of \
                its half-width), more than {}",
            worst.coordinate,
            error / worst.half_width,
            tolerance_words(window.tolerance)
        ),
    })
}

/// Of how many points of the window a map says nothing, if any.
fn excluded_words(window: &MeasuredWindow) -> Option<String> {
    let SampleSummary { points, excluded } = window.sample;
    (points > 0 && excluded > 0).then(|| {
        format!(
            "at {excluded} of {} points of the window the orbit does not return, or makes contacts \
                other than those of the grazing passages: the map says nothing of them",
            excluded + points
        )
    })
}
