//! Data of an interactive page: the map as WebAssembly, and the data for the page's script.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as BASE64;
use serde::Serialize;

use super::branch_listing::stretches;
use super::diagram_figure::extent;
use super::figure::symbol;
use super::{BranchListing, BranchRecord, ReportError};
use crate::analysis::chart::Chart;
use crate::analysis::diagram::{Diagram, SweepHeading};
use crate::expansion::{LocalMap, MapOrders, SectionKind};
use crate::model::Method;

/// Limit of the total size of modules of lower orders, in bytes.
const MOST_BYTES: usize = 100_000;
/// Limit of the total size of branches, in bytes; branches of longer periods are left out beyond
/// it.
const MOST_BRANCH_BYTES: usize = 60_000;
/// Largest number of iterates of direct simulation at a parameter value.
const MOST_DIRECT: usize = 8;

/// Map with the diagrams and charts that a page recomputes when a reader zooms in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveMap {
    /// Modules in base64, the map's first, separated by spaces.
    pub(super) modules: String,
    /// JSON that is safe inside a page.
    pub(super) data: String,
}

/// Data for the script. Numbers that are not finite are null: unbounded.
#[derive(Serialize)]
struct Data<'a> {
    scene: &'a str,
    digest: String,
    coordinates: Vec<Coordinate<'a>>,
    parameters: Vec<Parameter<'a>>,
    window: Window<'a>,
    passages: &'a [String],
    /// Orders of the modules.
    orders: Vec<[u32; 2]>,
    /// Bounds of orbits, in offsets; an orbit beyond them has escaped.
    escape: Vec<f64>,
    diagrams: Vec<Option<LiveDiagram>>,
    charts: Vec<Option<LiveChart>>,
    /// Branches, shorter periods first.
    branches: Vec<LiveBranch<'a>>,
    /// Number of branches left out for their size.
    branches_left_out: usize,
    /// Iterates of direct simulation in diagrams.
    direct: Vec<LiveDirect>,
}

/// Branch of periodic orbits of the map, in offsets.
#[derive(Serialize)]
struct LiveBranch<'a> {
    /// Index of the parameter that varies.
    axis: usize,
    itinerary: &'a str,
    period: usize,
    lines: Vec<LiveLine>,
    special: Vec<LiveSpecial<'a>>,
}

/// Part of a branch that is physical and of one stability.
#[derive(Serialize)]
struct LiveLine {
    stable: bool,
    /// Parameter of each point followed by the states of its returns, in base64.
    points: String,
}

#[derive(Serialize)]
struct LiveSpecial<'a> {
    label: &'static str,
    offset: f64,
    state: &'a [f64],
}

/// Iterates of direct simulation over a parameter.
#[derive(Serialize)]
struct LiveDirect {
    axis: usize,
    observe: usize,
    /// Pairs of parameter and drawn value, in base64.
    points: String,
}

#[derive(Serialize)]
struct LiveChart {
    /// Indices of the parameters, the horizontal one first.
    axes: [usize; 2],
    x: [f64; 2],
    y: [f64; 2],
    transient: usize,
    longest: usize,
    start: Vec<f64>,
}

#[derive(Serialize)]
struct Coordinate<'a> {
    name: &'a str,
    symbol: String,
    value: f64,
}

#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    symbol: String,
    grazing: f64,
    width: f64,
}

#[derive(Serialize)]
struct Window<'a> {
    state: &'a [f64],
    parameter: &'a [f64],
    depth: f64,
}

#[derive(Serialize)]
struct LiveDiagram {
    /// Index of the parameter that is swept.
    axis: usize,
    from: f64,
    to: f64,
    transient: usize,
    keep: usize,
    headings: Vec<SweepHeading>,
    /// Offsets of a sweep's start.
    start: Vec<f64>,
    /// Index of the drawn quantity: minus the depth of a passage; after the passages, a coordinate.
    observe: usize,
}

impl LiveMap {
    /// Interactive data of a map: WebAssembly modules (the map's, then those of lower orders while
    /// they fit the size limit), diagrams and charts, and branches of periodic orbits. A diagram or
    /// chart over a parameter that the map does not keep stays as drawn.
    pub fn new(
        map: &LocalMap,
        modules: &[(MapOrders, Vec<u8>)],
        diagrams: &[Diagram],
        charts: &[Chart],
        branches: &[BranchListing],
    ) -> Result<Self, ReportError> {
        let small = modules.iter().skip(1).scan(0, |bytes, (_, module)| {
            *bytes += module.len();
            Some(*bytes)
        });
        let small = small.take_while(|&bytes| bytes <= MOST_BYTES).count();
        let modules = &modules[..modules.len().min(1 + small)];
        let section = &map.section;
        let values = section.point.iter().map(|value| value.to_f64());
        let coordinates = section.coordinates.iter().zip(values);
        let widths = map.parameters.iter().zip(&map.window.parameter);
        let bounds = diagrams.first().map(|diagram| &diagram.escape);
        let bounds = bounds.or(charts.first().map(|chart| &chart.escape));
        let escape = bounds.map_or(&[][..], Vec::as_slice);
        let all = branches.iter().flat_map(|listing| live_branches(map, listing));
        let mut all: Vec<_> = all.collect();
        let mut bytes = 0;
        let kept = all.iter().take_while(|branch| {
            bytes += branch.lines.iter().map(|line| line.points.len()).sum::<usize>();
            bytes <= MOST_BRANCH_BYTES
        });
        let kept = kept.count();
        let branches_left_out = all.drain(kept..).count();
        let data = Data {
            scene: &map.scene,
            digest: map.digest.to_string(),
            coordinates: coordinates
                .map(|(name, value)| Coordinate { name, symbol: plain_symbol(name), value })
                .collect(),
            parameters: widths
                .map(|(parameter, &width)| Parameter {
                    name: &parameter.name,
                    symbol: plain_symbol(&parameter.name),
                    grazing: parameter.value.to_f64(),
                    width,
                })
                .collect(),
            window: Window {
                state: &map.window.state,
                parameter: &map.window.parameter,
                depth: map.window.depth,
            },
            passages: &map.surfaces,
            orders: modules.iter().map(|(own, _)| [own.smooth_order, own.contact_weight]).collect(),
            escape: escape.iter().map(|bound| bound.offset).collect(),
            diagrams: diagrams.iter().map(|diagram| live(map, diagram)).collect(),
            charts: live_charts(map, charts),
            branches: all,
            branches_left_out,
            direct: diagrams.iter().filter_map(|diagram| live_direct(map, diagram)).collect(),
        };
        // NOTE: in a page `<` could end the element that holds the data.
        let data = serde_json::to_string(&data)?.replace('<', "\\u003c");
        let modules: Vec<_> = modules.iter().map(|(_, module)| BASE64.encode(module)).collect();
        Ok(Self { modules: modules.join(" "), data })
    }
}

/// Symbol of a name, without the marks of a subscript.
fn plain_symbol(name: &str) -> String {
    symbol(name).replace(['{', '}'], "")
}

/// Data of a diagram; `None` if the map does not keep its parameter.
fn live(map: &LocalMap, diagram: &Diagram) -> Option<LiveDiagram> {
    let axis = axis(map, &diagram.parameter)?;
    let offsets = diagram.sweeps.iter().flat_map(|sweep| &sweep.points).map(|point| point.offset);
    let ends = extent(offsets);
    if ends.0 >= ends.1 {
        return None;
    }
    let mut headings: Vec<_> = diagram.sweeps.iter().map(|sweep| sweep.heading).collect();
    headings.sort_by_key(|&heading| heading == SweepHeading::Down);
    headings.dedup();
    let start = diagram.sweeps.iter().find_map(|sweep| sweep.start.clone());
    Some(LiveDiagram {
        axis,
        from: ends.0,
        to: ends.1,
        transient: diagram.transient,
        keep: diagram.keep,
        headings,
        start: start.unwrap_or_else(|| vec![0.0; map.dimension()]),
        observe: observed(map, diagram).unwrap_or(0),
    })
}

/// Index of a parameter in the map.
fn axis(map: &LocalMap, name: &str) -> Option<usize> {
    map.parameters.iter().position(|own| own.name == name)
}

/// Index of the quantity that a diagram draws; `None` if a page cannot draw it.
fn observed(map: &LocalMap, diagram: &Diagram) -> Option<usize> {
    if diagram.observable == "h" && map.section.kind == SectionKind::Tangency {
        return Some(0);
    }
    let coordinate = map.section.coordinates.iter().position(|name| *name == diagram.observable);
    coordinate.map(|coordinate| map.surfaces.len() + coordinate)
}

/// Numbers for the script: eight bytes each, in base64.
fn packed(numbers: impl IntoIterator<Item = f64>) -> String {
    BASE64.encode(numbers.into_iter().flat_map(f64::to_le_bytes).collect::<Vec<_>>())
}

fn live_branches<'a>(map: &LocalMap, listing: &'a BranchListing) -> Vec<LiveBranch<'a>> {
    let Some(axis) = axis(map, &listing.along) else { return Vec::new() };
    let live = |branch: &'a BranchRecord| {
        let offset = |place: usize| listing.along(&branch.points[place].orbit).0;
        let line = |stable| {
            let stretches = stretches(&branch.points, stable).into_iter();
            stretches.map(move |places| LiveLine {
                stable,
                points: packed(places.flat_map(|place| {
                    let states = branch.points[place].orbit.states.iter().flatten().copied();
                    std::iter::once(offset(place)).chain(states)
                })),
            })
        };
        let special = branch.points.iter().enumerate().filter_map(|(place, point)| {
            Some(LiveSpecial {
                label: point.special.as_ref()?.label.letters(),
                offset: offset(place),
                state: point.orbit.states.first()?,
            })
        });
        LiveBranch {
            axis,
            itinerary: &branch.itinerary,
            period: branch.period,
            lines: [true, false].into_iter().flat_map(line).collect(),
            special: special.collect(),
        }
    };
    listing.branches.iter().map(live).collect()
}

/// Iterates of direct simulation at each parameter value: a whole period, up to the limit.
fn live_direct(map: &LocalMap, diagram: &Diagram) -> Option<LiveDirect> {
    let (axis, observe) = (axis(map, &diagram.parameter)?, observed(map, diagram)?);
    let sweeps = diagram.sweeps.iter().filter(|sweep| sweep.method == Method::Direct);
    let points = sweeps.flat_map(|sweep| &sweep.points).flat_map(|point| {
        let count = point.returns.unwrap_or(MOST_DIRECT).min(MOST_DIRECT);
        point.kept_values().take(count).flat_map(|value| [point.offset, value])
    });
    let points = packed(points);
    (!points.is_empty()).then_some(LiveDirect { axis, observe, points })
}

/// Data of charts. Of several charts over the same parameters only the first is interactive; `None`
/// if the map does not keep both parameters.
fn live_charts(map: &LocalMap, charts: &[Chart]) -> Vec<Option<LiveChart>> {
    let place = |name: &str| axis(map, name);
    let ends = |offsets: &[f64]| match offsets {
        [first, .., last] => Some([*first, *last]),
        _ => None,
    };
    let live = |(number, chart): (usize, &Chart)| {
        let [horizontal, vertical] = &chart.axes;
        if charts[..number].iter().any(|other| other.axes == chart.axes) {
            return None;
        }
        Some(LiveChart {
            axes: [place(&horizontal.parameter)?, place(&vertical.parameter)?],
            x: ends(&horizontal.offsets)?,
            y: ends(&vertical.offsets)?,
            transient: chart.transient,
            longest: chart.longest_period,
            start: chart.start.clone().unwrap_or_else(|| vec![0.0; map.dimension()]),
        })
    };
    charts.iter().enumerate().map(live).collect()
}
