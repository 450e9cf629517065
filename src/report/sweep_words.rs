//! What the map's window means for diagrams and charts, in words: what lies outside, what the map
//! made, and when an orbit has escaped.

use super::basin_figure::basin_outside_words;
use crate::analysis::EscapeBound;
use crate::analysis::basin::{BLOCK, Basin};
use crate::analysis::chart::{Chart, ChartClass, Overlay};
use crate::analysis::diagram::Diagram;
use crate::iteration::OrbitEnd;
use crate::model::{ChartOverlay, Method};

/// The remedy where the map alone was used beyond its window.
const REMEDY: &str = "in grey: the map's error was not measured there, and `with = [\"guarded\"]` \
                      simulates what lies outside";

/// What may not be trusted of diagrams, or is not drawn.
pub fn diagram_warnings(diagrams: &[Diagram]) -> Vec<String> {
    let lost = diagrams.iter().filter_map(diagram_lost_words);
    let outside = diagrams.iter().filter_map(diagram_outside_words);
    lost.chain(outside).map(warning).collect()
}

/// What may not be trusted of charts.
pub fn chart_warnings(charts: &[Chart]) -> Vec<String> {
    charts.iter().filter_map(chart_outside_words).map(warning).collect()
}

/// What may not be trusted of basins.
pub fn basin_warnings(basins: &[Basin]) -> Vec<String> {
    basins.iter().filter_map(basin_outside_words).map(warning).collect()
}

fn warning(words: String) -> String {
    format!("warning: {words}")
}

/// Where an observable was no finite number.
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

/// At how many values of a diagram the map alone was used beyond its window, if at any.
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

/// In how many cells of a chart the map alone was used beyond its window, if in any.
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

/// Which share of the cells of a chart was computed, if not all.
pub(super) fn chart_computed_words(chart: &Chart) -> Option<String> {
    let (computed, all) = (chart.computed, chart.cells.len());
    (computed < all).then(|| {
        format!(
            "{computed} of {all} cells were computed ({:.1} %), every {BLOCK}th column and row and \
             along borders; the others lie among computed cells that are alike, and have what \
             these have (`cells = \"all\"` computes every cell).",
            100.0 * computed as f64 / all as f64
        )
    })
}

/// What is laid over a chart, and what of it was not found.
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

/// Orbits of a diagram that ended early, and by which bound.
pub(super) fn diagram_escape_words(diagram: &Diagram) -> Option<String> {
    let points = || diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
    let ended = points().filter(|point| point.end != OrbitEnd::Completed).count();
    let all = points().count();
    (ended > 0).then(|| format!("At {ended} of {all} values {}.", escape_words(&diagram.escape)))
}

/// The same of a chart.
pub(super) fn chart_escape_words(chart: &Chart) -> Option<String> {
    let count = chart.count(ChartClass::Escaped);
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
