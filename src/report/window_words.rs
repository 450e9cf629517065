//! Window of a map as text: bounds stated by the scene, measured bounds, errors inside, and
//! warnings. Also warnings about diagrams and charts: points outside the window, share of the map,
//! escaped orbits.

use super::basin_figure::basin_outside_words;
use super::map_listing::edge_words;
use super::table::significant;
use crate::analysis::EscapeBound;
use crate::analysis::basin::{BLOCK, Basin, BlockProbes};
use crate::analysis::chart::{Chart, ChartClass, Overlay};
use crate::analysis::diagram::Diagram;
use crate::convergence::{
    BoundKind, BoundOrigin, CoordinateError, MeasuredWindow, SampleSummary, WindowBound,
    WindowTolerance,
};
use crate::expansion::{MapOrders, WindowEdge};
use crate::iteration::OrbitEnd;
use crate::model::{ChartOverlay, Method};
use crate::numeric::Shown;

/// Window and errors, as text: one line each.
pub fn window_words(window: &MeasuredWindow) -> String {
    format!("window: {}\n{}\n", bounds_words(window), error_words(window))
}

/// Bounds as text, those stated by the scene first.
pub fn bounds_words(window: &MeasuredWindow) -> String {
    let of = |origin: BoundOrigin| {
        let bounds = window.bounds.iter().filter(move |bound| bound.origin == origin);
        bounds.map(bound_words).collect::<Vec<_>>().join(", ")
    };
    let groups = [
        (of(BoundOrigin::Scene), "as the scene states"),
        (of(BoundOrigin::Radius), "within the radius of the series in y"),
        (of(BoundOrigin::Depth), "as wide as that depth needs"),
        (of(BoundOrigin::Measured), "measured"),
        (of(BoundOrigin::Assumed), "assumed"),
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

/// Errors inside the window, and the tolerance, as text.
pub fn error_words(window: &MeasuredWindow) -> String {
    let points = window.sample.points;
    let errors: Vec<String> = window
        .errors
        .iter()
        .map(|CoordinateError { coordinate, error, verge, .. }| match error {
            Some(error) => format!("{coordinate} {error:.1e}{}", verge_words(*verge)),
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

/// Place of an error, if it occurs only on the verge of contact, as text.
fn verge_words(verge: bool) -> &'static str {
    if verge { " on the verge of contact" } else { "" }
}

fn tolerance_words(tolerance: WindowTolerance) -> String {
    match tolerance {
        WindowTolerance::Error(error) => format!("{}, as the scene states", Shown(error)),
        WindowTolerance::Share(share) => format!("{share:e} of each half-width"),
    }
}

/// Warning or note about a map on its window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WindowRemark {
    /// Whether this is a warning: the error exceeds the scene's tolerance, or reaches a hundredth
    /// of a half-width, or some points have no image, or the window is deeper than the series
    /// reach. Otherwise it is a note: the bounds contradict each other.
    pub is_warning: bool,
    /// Text.
    pub words: String,
}

impl WindowRemark {
    /// Line of text with the name of the scene.
    pub fn of(&self, scene: &str) -> String {
        format!("{}: `{scene}`: {}", self.kind(), self.words)
    }

    /// `warning` or `note`.
    pub fn kind(&self) -> &'static str {
        if self.is_warning { "warning" } else { "note" }
    }
}

/// Error, as a share of the half-width, from which a map without a stated tolerance is warned of.
const LARGE_SHARE: f64 = 1e-2;

/// Warning or note about a window: the map's error is too large, points have no image, no point
/// reaches the stated depth, or the window is deeper than the series in `y` reach. `None` if there
/// is nothing to mend: the map keeps the scene's tolerance or, if the scene states none, errs by
/// less than a hundredth of each half-width.
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
///         verge: false,
///     }],
///     sample: SampleSummary { points: 400, excluded: 0 },
///     reached: None,
/// };
/// let orders = MapOrders::new(3, 8);
/// assert_eq!(window_remark(&window(1e-7), orders, None), None);
/// assert_eq!(
///     window_remark(&window(6e-3), orders, None).expect("above the tolerance").of("mine"),
///     "warning: `mine`: on its window the map of orders (3, 8) errs by up to 6.0e-3 in x (6e-1 \
///      of its half-width), more than 1e-6, as the scene states: ask for a smaller tolerance, \
///      raise the orders, or narrow the window",
/// );
/// ```
pub fn window_remark(
    window: &MeasuredWindow,
    orders: MapOrders,
    edge: Option<&WindowEdge>,
) -> Option<WindowRemark> {
    let edge = edge.filter(|edge| !edge.is_within());
    let edge = edge.map(|edge| format!("at the edge of the window {}", edge_words(edge)));
    let share = |error: &CoordinateError| error.error.map(|value| value / error.half_width);
    let is_large = |share: Option<f64>| share.is_none_or(|share| share >= LARGE_SHARE);
    let asked = matches!(window.tolerance, WindowTolerance::Error(_));
    let matters = asked || window.errors.iter().map(share).any(is_large);
    let errors = excess_words(window, orders).filter(|_| matters);
    let excluded = excluded_words(window);
    let is_warning = errors.is_some() || excluded.is_some() || edge.is_some();
    let parts = [errors, excluded, reached_words(window), edge];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| WindowRemark { is_warning, words: parts.join("; ") })
}

/// Largest error that exceeds its limit, as text, if there is one.
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
            "on its window the map of orders {orders} errs by up to {error:.1e} in {}{} ({:.0e} of \
                its half-width), more than {}: {}raise the orders, or narrow the window",
            worst.coordinate,
            verge_words(worst.verge),
            error / worst.half_width,
            tolerance_words(window.tolerance),
            // The orders that a tolerance chooses are those of its own sample.
            match window.tolerance {
                WindowTolerance::Error(_) => "ask for a smaller tolerance, ",
                _ => "",
            }
        ),
    })
}

/// Note that no point within the half-widths reaches the window's depth, if so.
fn reached_words(window: &MeasuredWindow) -> Option<String> {
    let depth = window.bounds.iter().find(|bound| bound.kind == BoundKind::Depth)?.value;
    window.reached.map(|reached| {
        format!(
            "its bounds contradict each other: no point of the half-widths is deeper than {:.1e}, \
                the depth is {depth:e}",
            reached
        )
    })
}

/// Warning with the number of points of the window without an image, if any.
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

/// Remedy for the use of the map alone outside its window.
const REMEDY: &str = "in grey: the map's error was not measured there, and `with = [\"guarded\"]` \
                      simulates what lies outside";

/// Warnings about diagrams: lost values, and points outside the window.
pub fn diagram_warnings(diagrams: &[Diagram]) -> Vec<String> {
    let lost = diagrams.iter().filter_map(diagram_lost_words);
    let outside = diagrams.iter().filter_map(diagram_outside_words);
    let ended = diagrams.iter().filter_map(|diagram| {
        let points = || diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
        let ends = points().filter(|point| is_without_image(point.end)).count();
        no_image_words(ends, format!("{} values of {}", points().count(), diagram.parameter))
    });
    lost.chain(outside).chain(ended).map(warning).collect()
}

/// Warnings about charts.
pub fn chart_warnings(charts: &[Chart]) -> Vec<String> {
    let ended = charts.iter().filter_map(|chart| {
        let ends = chart.cells.iter().filter(|cell| is_without_image(cell.attractor.end)).count();
        no_image_words(ends, format!("{} cells", chart.cells.len()))
    });
    charts.iter().filter_map(chart_outside_words).chain(ended).map(warning).collect()
}

/// Warnings about basins.
pub fn basin_warnings(basins: &[Basin]) -> Vec<String> {
    let ended = basins.iter().filter_map(|basin| {
        no_image_words(basin.no_image.count, format!("{} states", basin.cells.len()))
    });
    basins.iter().filter_map(basin_outside_words).chain(ended).map(warning).collect()
}

fn is_without_image(end: OrbitEnd) -> bool {
    matches!(end, OrbitEnd::NoImage { .. })
}

/// Warning that orbits end at points without an image, with the commonest reasons.
fn no_image_words(ends: usize, all: String) -> Option<String> {
    (ends > 0).then(|| {
        format!(
            "{ends} of {all} end at a point without an image, as beyond a rigid stop, or on a \
             tangency section where the free flight does not turn behind the stop: a section of \
             `kind = \"stroboscopic\"` needs no turn"
        )
    })
}

fn warning(words: String) -> String {
    format!("warning: {words}")
}

/// Warning with the number of values that are not finite.
fn diagram_lost_words(diagram: &Diagram) -> Option<String> {
    let points = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
    let values = points.flat_map(|point| point.kept_values());
    let lost = values.clone().filter(|value| !value.is_finite()).count();
    (lost > 0).then(|| {
        format!(
            "`{}` over {} is not finite at {lost} of {} iterates; nothing is drawn there",
            diagram.observable,
            diagram.parameter,
            values.count()
        )
    })
}

/// Warning with the number of parameter values at which the map alone was used outside its window.
pub(super) fn diagram_outside_words(diagram: &Diagram) -> Option<String> {
    let by_map = || diagram.sweeps.iter().filter(|sweep| sweep.method == Method::Map);
    let outside: usize = by_map().map(|sweep| sweep.outside()).sum();
    let all: usize = by_map().map(|sweep| sweep.points.len()).sum();
    (outside > 0).then(|| {
        format!(
            "at {outside} of {all} values of {} the map alone leaves its window ({REMEDY})",
            diagram.parameter
        )
    })
}

/// Warning with the number of cells in which the map alone was used outside its window.
pub(super) fn chart_outside_words(chart: &Chart) -> Option<String> {
    let (outside, all) = (chart.count(ChartClass::Outside), chart.cells.len());
    let [first, second] = &chart.axes;
    (outside > 0).then(|| {
        format!(
            "in {outside} of {all} cells of {} and {} the map alone leaves its window ({REMEDY})",
            first.parameter, second.parameter
        )
    })
}

/// Share of the iterates of a guarded diagram computed by the map, as text.
pub(super) fn diagram_share_words(diagram: &Diagram) -> Option<String> {
    let guarded = || diagram.sweeps.iter().filter(|sweep| sweep.method == Method::Guarded);
    let kept = guarded().flat_map(|sweep| &sweep.points).map(|point| point.kept as f64);
    let parts = guarded().flat_map(|sweep| &sweep.points);
    let by_map: f64 = parts.map(|point| point.by_map * point.kept as f64).sum();
    let all: f64 = kept.sum();
    (all > 0.0).then(|| share_words(by_map / all))
}

/// Share of the iterates of a guarded chart computed by the map, as text.
pub(super) fn chart_share_words(chart: &Chart) -> Option<String> {
    (chart.method == Method::Guarded).then(|| share_words(chart.by_map))
}

/// Share of the cells of a chart that was computed, if not all, as text.
pub fn chart_computed_words(chart: &Chart) -> Option<String> {
    let (computed, all) = (chart.computed, chart.cells.len());
    (computed < all).then(|| {
        format!(
            "{computed} of {all} cells were computed ({:.1} %), every {BLOCK}th column and row and \
             along borders; the others lie among computed cells that are alike, and have what \
             these have. {}.",
            100.0 * computed as f64 / all as f64,
            filled_words(&chart.probes)
        )
    })
}

/// Accuracy of the cells that were filled without being computed, as text.
pub(super) fn filled_words(probes: &BlockProbes) -> String {
    let exact = "`cells = \"all\"` computes every cell";
    match probes.count {
        0 => format!("No filled cell was checked; {exact}"),
        count => format!(
            "This is sampled and not proved: {} of {count} probes inside filled blocks found \
             another class, so that at most {} % of the filled cells are of another class (95 % \
             confidence); {exact}",
            probes.differing,
            significant(100.0 * probes.missed_at_most(), 2)
        ),
    }
}

/// Overlay of a chart, and the parts of it that were not found, as text.
pub fn chart_overlay_words(chart: &Chart) -> Option<String> {
    let words = |overlay: &Overlay| {
        let what = match overlay.what {
            ChartOverlay::Graze => "the grazing curve of the scene's orbit",
            ChartOverlay::Loci if chart.method == Method::Direct => {
                "loci of periodic orbits by direct simulation"
            }
            ChartOverlay::Loci => "loci of periodic orbits by the map, inside its window",
        };
        let short = overlay.curves.iter().filter(|curve| !curve.whole).count();
        match (overlay.curves.len(), short) {
            (0, _) => format!("{what}: none was found"),
            (_, 0) => what.to_owned(),
            (1, _) => format!("{what}, which could not be followed over the whole chart"),
            (all, _) => format!("{what}, {short} of {all} not followed to their ends"),
        }
    };
    let all: Vec<String> = chart.overlay.iter().map(words).collect();
    (!all.is_empty()).then(|| format!("Lines: {}.", all.join("; ")))
}

fn share_words(by_map: f64) -> String {
    format!(
        "The map made {:.4} % of the iterates kept; the others, which begin outside its window, \
         are direct simulation.",
        crate::numeric::Shown((1e6 * by_map).round() / 1e4)
    )
}

/// Number of orbits of a diagram that ended early, and the bound that ended them, as text.
pub(super) fn diagram_escape_words(diagram: &Diagram) -> Option<String> {
    let points = || diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
    let ended = points().filter(|point| point.end != OrbitEnd::Completed).count();
    let all = points().count();
    (ended > 0).then(|| format!("At {ended} of {all} values {}.", escape_words(&diagram.escape)))
}

/// Number of cells of a chart whose orbits escaped, and the bound that ended them, as text.
pub(super) fn chart_escape_words(chart: &Chart) -> Option<String> {
    let count = chart.count(ChartClass::Escaped);
    let words = || format!("White, {count} cells: {}.", escape_words(&chart.escape));
    (count > 0).then(words)
}

/// Bounds beyond which an orbit has escaped, as text.
pub(super) fn escape_words(escape: &[EscapeBound]) -> String {
    let finite = escape.iter().filter(|bound| bound.offset.is_finite());
    let bounds = finite.map(|bound| format!("{} by {:.3}", bound.coordinate, bound.offset));
    let bounds: Vec<String> = bounds.collect();
    let extents = escape.first().map_or(f64::NAN, |bound| bound.extents);
    format!(
        "the orbit escaped, farther from the section point than {extents} times (`direct.escape`) \
         the extent of the grazing orbit ({}), or has no image",
        bounds.join(", ")
    )
}
