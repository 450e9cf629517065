//! Images of section points: rows of `image --csv`, fields of `image --json`, warnings.

use serde::Serialize;

use super::{Cell, Column, Named, Rows, SectionDocument};
use crate::analysis::{DirectEnd, ImageRecord, ImageRequest, Precision, Using};
use crate::convergence::MeasuredWindow;
use crate::expansion::{ExceededBound, LocalMap, SectionKind, WindowEdge};
use crate::numeric::Dd;

/// Significant digits of single, double and double-double precision.
const DIGITS: [usize; 3] = [9, 17, 32];

/// Image of a point for the JSON document; offsets in double-double are decimal text.
#[derive(Debug, Serialize)]
pub struct ImageListing<'a> {
    row: usize,
    iteration: usize,
    offsets: Named<Option<Offset>>,
    contacts: usize,
    inside: u8,
    /// Window to which `inside` refers, with the map's errors.
    window: &'a MeasuredWindow,
    /// Bounds of the window that the starting point exceeds.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outside: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    extra_contacts: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<DirectEnd>,
    /// Edge of the passage with the largest omitted share, if that share is too large.
    #[serde(skip_serializing_if = "Option::is_none")]
    window_edge: Option<WindowEdge>,
    /// Section of the offsets, if the scene allows any.
    #[serde(skip_serializing_if = "Option::is_none")]
    section: Option<ImageSection>,
}

/// Kind and phase of a section.
#[derive(Clone, Copy, Debug, Serialize)]
struct ImageSection {
    kind: SectionKind,
    phase: Option<f64>,
}

/// Offset as a number, or as text if a number would lose digits.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Offset {
    Number(f64),
    Digits(String),
}

impl<'a> ImageListing<'a> {
    /// Listing of images. `edge` is that of the passage with the largest omitted share, if that
    /// share is too large.
    pub fn list(
        (map, window): (&LocalMap, &'a MeasuredWindow),
        section: &SectionDocument,
        request: &ImageRequest,
        records: &[ImageRecord],
        edge: Option<WindowEdge>,
    ) -> Vec<Self> {
        let (kind, phase) = (section.kind, section.phase);
        let section = section.decided.as_ref().map(|_| ImageSection { kind, phase });
        let edge = edge.filter(|_| matches!(request.using, Using::Map | Using::Discontinuity));
        let offset = |value: &Dd| match request.precision {
            _ if !value.is_finite() => None,
            Precision::F32 | Precision::F64 => Some(Offset::Number(value.to_f64())),
            Precision::Dd => Some(Offset::Digits(value.to_decimal(DIGITS[2]))),
        };
        let names = || map.section.coordinates.iter().cloned();
        let image = |record: &ImageRecord| Self {
            row: record.row,
            iteration: record.iteration,
            offsets: Named::new(names().zip(record.offsets.iter().map(offset))),
            contacts: record.contacts,
            inside: u8::from(record.inside()),
            window,
            outside: record.exceeded.iter().map(|&bound| bound_name(map, bound)).collect(),
            extra_contacts: record.extra_contacts,
            end: record.end,
            window_edge: edge,
            section,
        };
        records.iter().map(image).collect()
    }
}

/// One row per starting point and iteration.
pub fn image_rows<'a>(
    map: &LocalMap,
    request: &ImageRequest,
    records: &'a [ImageRecord],
) -> Rows<'a> {
    let (direct, precision) = (is_simulated(request), request.precision);
    let names = map.section.coordinates.iter().map(String::as_str);
    let names = ["row", "iteration"].into_iter().chain(names).chain(["contacts", "inside"]);
    let columns = names.chain(direct.then_some("extra_contacts")).map(Column::number);
    let row = move |record: &ImageRecord| {
        let whole = |number: usize| Cell::Integer(number as i64);
        let mut row = vec![whole(record.row), whole(record.iteration)];
        row.extend(record.offsets.iter().map(|&value| Cell::text(digits(value, precision))));
        row.extend([whole(record.contacts), Cell::Integer(record.inside().into())]);
        if direct {
            row.push(record.extra_contacts.map_or(Cell::Missing, whole));
        }
        row
    };
    Rows::new(columns.collect(), records.iter().map(row))
}

/// Whether direct simulation is used.
fn is_simulated(request: &ImageRequest) -> bool {
    matches!(request.using, Using::Direct | Using::Guarded)
}

/// Number with all digits of its precision; `nan` if not finite.
fn digits(value: Dd, precision: Precision) -> String {
    match precision {
        _ if !value.is_finite() => "nan".to_owned(),
        Precision::F32 => format!("{:.*e}", DIGITS[0] - 1, value.to_f64()),
        Precision::F64 => format!("{:.*e}", DIGITS[1] - 1, value.to_f64()),
        Precision::Dd => value.to_decimal(DIGITS[2]),
    }
}

/// Warning with the number of points outside the window, unless these are simulated.
pub fn image_outside_words(
    map: &LocalMap,
    request: &ImageRequest,
    records: &[ImageRecord],
) -> Option<String> {
    let outside = records.iter().filter(|record| !record.inside()).count();
    let told = outside > 0 && !is_simulated(request);
    told.then(|| {
        format!(
            "{outside} of {} points are outside the window, where the map has not been measured: \
             beyond {}; the method `guarded` simulates them",
            records.len(),
            exceeded(map, records)
        )
    })
}

/// Bounds that points exceed, with the number of points for each, as text.
fn exceeded(map: &LocalMap, records: &[ImageRecord]) -> String {
    let mut counts: Vec<(ExceededBound, usize)> = Vec::new();
    for &bound in records.iter().flat_map(|record| &record.exceeded) {
        match counts.iter_mut().find(|(known, _)| *known == bound) {
            Some((_, count)) => *count += 1,
            None => counts.push((bound, 1)),
        }
    }
    let words = counts.into_iter().map(|(bound, count)| {
        let (name, window) = (bound_name(map, bound), &map.window);
        let (what, limit) = match bound {
            ExceededBound::State(number) => ("the half-width", window.state[number]),
            ExceededBound::Parameter(number) => ("the half-width", window.parameter[number]),
            ExceededBound::Depth(_) => ("the largest", window.depth),
        };
        format!("{what} {limit:e} of `{name}` ({count})")
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Name of a bound: a coordinate, a parameter, or `depth`, with a number if there are several
/// passages.
fn bound_name(map: &LocalMap, bound: ExceededBound) -> String {
    match bound {
        ExceededBound::State(number) => map.section.coordinates[number].clone(),
        ExceededBound::Parameter(number) => map.parameters[number].name.clone(),
        ExceededBound::Depth(_) if map.passages() == 1 => "depth".to_owned(),
        ExceededBound::Depth(passage) => format!("depth{}", passage + 1),
    }
}
