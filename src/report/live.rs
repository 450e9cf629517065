//! What makes a page alive: the map as WebAssembly and what the page's script is told of it.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as BASE64;
use serde::Serialize;

use super::ReportError;
use super::figure::symbol;
use crate::analysis::chart::Chart;
use crate::analysis::diagram::{Diagram, SweepHeading};
use crate::expansion::{LocalMap, SectionKind};

/// A map and the diagrams that a page computes anew where a reader looks closer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveMap {
    /// The module, in base64.
    pub(super) module: String,
    /// JSON that may stand in a page.
    pub(super) data: String,
}

/// What the script is told. Numbers that are not finite are null: no bound.
#[derive(Serialize)]
struct Data<'a> {
    scene: &'a str,
    digest: String,
    coordinates: Vec<Coordinate<'a>>,
    parameters: Vec<Parameter<'a>>,
    window: Window<'a>,
    passages: &'a [String],
    /// How far orbits may go, in offsets.
    escape: Vec<f64>,
    diagrams: Vec<Option<LiveDiagram>>,
    charts: Vec<Option<LiveChart>>,
}

#[derive(Serialize)]
struct LiveChart {
    /// Which of the map's parameters, the horizontal one first.
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
    /// Which of the map's parameters is swept.
    axis: usize,
    from: f64,
    to: f64,
    transient: usize,
    keep: usize,
    headings: Vec<SweepHeading>,
    /// Offsets at which a sweep starts.
    start: Vec<f64>,
    /// What is drawn: −depth of a passage or, after those, a coordinate.
    observe: usize,
}

impl LiveMap {
    /// A map, its module of WebAssembly, and diagrams and charts of it. One over a parameter that is no
    /// variable of the map is left as it was drawn.
    ///
    /// # Errors
    ///
    /// Never in practice: everything is numbers and names.
    pub fn new(
        map: &LocalMap,
        module: &[u8],
        diagrams: &[Diagram],
        charts: &[Chart],
    ) -> Result<Self, ReportError> {
        let section = &map.section;
        let values = section.point.iter().map(|value| value.to_f64());
        let coordinates = section.coordinates.iter().zip(values);
        let widths = map.parameters.iter().zip(&map.window.parameter);
        let bounds = diagrams.first().map(|diagram| &diagram.escape);
        let bounds = bounds.or(charts.first().map(|chart| &chart.escape));
        let escape = bounds.map_or(&[][..], Vec::as_slice);
        let data = Data {
            scene: &map.scene,
            digest: map.digest.to_string(),
            coordinates: coordinates.map(|(name, value)| Coordinate { name, value }).collect(),
            parameters: widths
                .map(|(parameter, &width)| Parameter {
                    name: &parameter.name,
                    symbol: symbol(&parameter.name).replace(['{', '}'], ""),
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
            escape: escape.iter().map(|bound| bound.offset).collect(),
            diagrams: diagrams.iter().map(|diagram| live(map, diagram)).collect(),
            charts: live_charts(map, charts),
        };
        // NOTE: in a page `<` could end the element that holds the data.
        let data = serde_json::to_string(&data)?.replace('<', "\\u003c");
        Ok(Self { module: BASE64.encode(module), data })
    }
}

/// What the script is told of a diagram; `None` where the map does not keep its parameter.
fn live(map: &LocalMap, diagram: &Diagram) -> Option<LiveDiagram> {
    let axis = map.parameters.iter().position(|own| own.name == diagram.parameter)?;
    let offsets = diagram.sweeps.iter().flat_map(|sweep| &sweep.points).map(|point| point.offset);
    let ends = offsets.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), offset| {
        (low.min(offset), high.max(offset))
    });
    if ends.0 >= ends.1 {
        return None;
    }
    let mut headings: Vec<_> = diagram.sweeps.iter().map(|sweep| sweep.heading).collect();
    headings.sort_by_key(|&heading| heading == SweepHeading::Down);
    headings.dedup();
    let start = diagram.sweeps.iter().find_map(|sweep| sweep.start.clone());
    let coordinate = map.section.coordinates.iter().position(|name| *name == diagram.observable);
    let is_depth = diagram.observable == "h" && map.section.kind == SectionKind::Tangency;
    Some(LiveDiagram {
        axis,
        from: ends.0,
        to: ends.1,
        transient: diagram.transient,
        keep: diagram.keep,
        headings,
        start: start.unwrap_or_else(|| vec![0.0; map.dimension()]),
        observe: match coordinate {
            Some(coordinate) if !is_depth => map.surfaces.len() + coordinate,
            _ => 0,
        },
    })
}

/// What the script is told of charts: of those over the same parameters the first is alive, `None`
/// where the map does not keep both.
fn live_charts(map: &LocalMap, charts: &[Chart]) -> Vec<Option<LiveChart>> {
    let place = |name: &str| map.parameters.iter().position(|own| own.name == name);
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
