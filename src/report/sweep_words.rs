//! What the map's window means for diagrams and charts, in words: what lies outside, what the map
//! made, and when an orbit has escaped.

use crate::analysis::EscapeBound;
use crate::analysis::chart::Chart;
use crate::analysis::diagram::Diagram;
use crate::iteration::OrbitEnd;
use crate::model::Method;

/// The remedy where the map alone was used beyond its window.
const REMEDY: &str = "in grey: the map's error was not measured there, and `with = [\"guarded\"]` \
                      simulates what lies outside";

/// At how many values of a diagram the map alone was used beyond its window, if at any.
pub fn diagram_outside_words(diagram: &Diagram) -> Option<String> {
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

/// In how many cells of a chart the map alone was used beyond its window, if in any.
pub fn chart_outside_words(chart: &Chart) -> Option<String> {
    let (outside, all) = (chart.outside(), chart.cells.len());
    let [first, second] = &chart.axes;
    (outside > 0).then(|| {
        format!(
            "in {outside} of {all} cells of {} and {} the map alone leaves its window ({REMEDY})",
            first.parameter, second.parameter
        )
    })
}

/// Which share of the iterates of a guarded diagram the map made.
pub(super) fn diagram_share_words(diagram: &Diagram) -> Option<String> {
    let guarded = || diagram.sweeps.iter().filter(|sweep| sweep.method == Method::Guarded);
    let kept = guarded().flat_map(|sweep| &sweep.points).map(|point| point.kept as f64);
    let parts = guarded().flat_map(|sweep| &sweep.points);
    let by_map: f64 = parts.map(|point| point.by_map * point.kept as f64).sum();
    let all: f64 = kept.sum();
    (all > 0.0).then(|| share_words(by_map / all))
}

/// Which share of the iterates of a guarded chart the map made.
pub(super) fn chart_share_words(chart: &Chart) -> Option<String> {
    (chart.method == Method::Guarded).then(|| share_words(chart.by_map))
}

fn share_words(by_map: f64) -> String {
    format!(
        "The map made {:.4} % of the iterates kept; the others, which begin outside its window, \
         are direct simulation.",
        crate::numeric::Shown((1e6 * by_map).round() / 1e4)
    )
}

/// Orbits of a diagram that ended early, and by which bound.
pub(super) fn diagram_escape_words(diagram: &Diagram) -> Option<String> {
    let points = || diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
    let ended = points().filter(|point| point.end != OrbitEnd::Completed).count();
    let all = points().count();
    (ended > 0).then(|| format!("At {ended} of {all} values {}.", escape_words(&diagram.escape)))
}

/// The same of a chart.
pub(super) fn chart_escape_words(chart: &Chart) -> Option<String> {
    let ended = |cell: &&_| chart.is_escaped(cell);
    let count = chart.cells.iter().filter(ended).count();
    let words = || format!("White, {count} cells: {}.", escape_words(&chart.escape));
    (count > 0).then(words)
}

/// When an orbit has escaped.
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
