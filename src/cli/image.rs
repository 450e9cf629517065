//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use std::fmt::Write as _;

use serde::Serialize;

use super::arguments::ImageOptions;
use super::error::CliError;
use super::offsets;
use super::output::{Destination, Results, note};
use super::prepare::{grazing_orbit, prepare, settle};
use super::window_edge::{beyond, local_map};
use grazemap::analysis::{DirectEnd, ImageRecord, ImageRequest, Precision, Using, images};
use grazemap::expansion::{LocalMap, WindowEdge};
use grazemap::numeric::Dd;
use grazemap::report::{Named, SectionDocument, to_dense_json};

/// Significant digits of a single, of a double and of a double-double.
const DIGITS: [usize; 3] = [9, 17, 32];

/// One image as it is written to JSON; offsets as decimal text in double-double.
#[derive(Debug, Serialize)]
struct Image {
    row: usize,
    iteration: usize,
    offsets: Named<Option<Offset>>,
    contacts: usize,
    inside: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    extra_contacts: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<DirectEnd>,
    /// Of the passage whose contact loses most, where that is too much.
    #[serde(skip_serializing_if = "Option::is_none")]
    window_edge: Option<WindowEdge>,
    /// The section of the offsets, where the scene takes any.
    #[serde(skip_serializing_if = "Option::is_none")]
    section: Option<ImageSection>,
}

/// A section, in few words.
#[derive(Clone, Copy, Debug, Serialize)]
struct ImageSection {
    kind: &'static str,
    phase: Option<f64>,
}

/// An offset as a number, or as text where a number would lose digits.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Offset {
    Number(f64),
    Digits(String),
}

pub(super) fn run(options: &ImageOptions) -> Result<(), CliError> {
    let scene = prepare(&options.scene)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let settled = settle(&scene, &orbit, options.scene.common.quiet)?;
    let (map, edges) = local_map(&settled, options.scene.common.quiet)?;
    let edge = beyond(edges);
    let request = ImageRequest {
        rows: offsets::read(&options.states, &map)?,
        iterations: options.iterations as usize,
        using: options.using.into(),
        precision: options.precision.into(),
    };
    let records = images(&settled.scene, &settled.orbit, &map, &request)?;
    let csv = table(&map, &request, &records)?;
    let document = SectionDocument::settled(&settled);
    let section = document.decided.as_ref().map(|_| ImageSection {
        kind: document.kind,
        phase: document.phase,
    });
    let list: Vec<Image> = records
        .iter()
        .map(|record| Image {
            section,
            ..image(&map, &request, record, edge)
        })
        .collect();
    let results = Results::named("images", csv.clone(), to_dense_json(&list)?, Some(csv));
    let mut common = options.scene.common.clone();
    if common.json.is_none() && common.csv.is_none() && common.output.is_none() {
        common.csv = Some(Destination::Standard);
    }
    results.deliver("image", &common)?;
    judge(&request, &records, common.quiet)
}

/// One row per input row and iteration.
fn table(
    map: &LocalMap,
    request: &ImageRequest,
    records: &[ImageRecord],
) -> Result<String, CliError> {
    let direct = request.using == Using::Direct;
    let mut text = format!(
        "row,iteration,{},contacts,inside",
        map.section.coordinates.join(",")
    );
    text.push_str(if direct { ",extra_contacts\n" } else { "\n" });
    for record in records {
        let offsets: Vec<String> = record
            .offsets
            .iter()
            .map(|&value| digits(value, request.precision))
            .collect();
        let (row, iteration, inside) = (record.row, record.iteration, u8::from(record.inside));
        let _infallible = write!(
            text,
            "{row},{iteration},{},{},{inside}",
            offsets.join(","),
            record.contacts
        );
        if let Some(extra) = record.extra_contacts.filter(|_| direct) {
            let _infallible = write!(text, ",{extra}");
        }
        text.push('\n');
    }
    Ok(text)
}

/// A number to all its digits; `nan` where there is none.
fn digits(value: Dd, precision: Precision) -> String {
    match precision {
        _ if !value.is_finite() => "nan".to_owned(),
        Precision::F32 => format!("{:.*e}", DIGITS[0] - 1, value.to_f64()),
        Precision::F64 => format!("{:.*e}", DIGITS[1] - 1, value.to_f64()),
        Precision::Dd => value.to_decimal(DIGITS[2]),
    }
}

fn image(
    map: &LocalMap,
    request: &ImageRequest,
    record: &ImageRecord,
    edge: Option<WindowEdge>,
) -> Image {
    let offset = |value: &Dd| match request.precision {
        _ if !value.is_finite() => None,
        Precision::F32 | Precision::F64 => Some(Offset::Number(value.to_f64())),
        Precision::Dd => Some(Offset::Digits(value.to_decimal(DIGITS[2]))),
    };
    Image {
        row: record.row,
        iteration: record.iteration,
        offsets: Named::new(
            map.section
                .coordinates
                .iter()
                .cloned()
                .zip(record.offsets.iter().map(offset)),
        ),
        contacts: record.contacts,
        inside: u8::from(record.inside),
        extra_contacts: record.extra_contacts,
        end: record.end,
        window_edge: edge.filter(|_| matches!(request.using, Using::Map | Using::Discontinuity)),
        section: None,
    }
}

/// Says which points were outside the window, and fails where a point had no image.
fn judge(request: &ImageRequest, records: &[ImageRecord], quiet: bool) -> Result<(), CliError> {
    let missing = records
        .iter()
        .find(|record| record.offsets.iter().any(|value| !value.is_finite()));
    if let Some(record) = missing {
        return Err(CliError::NoImage {
            row: record.row,
            iteration: record.iteration,
            end: record.end,
        });
    }
    let outside = records.iter().filter(|record| !record.inside).count();
    if outside > 0 && request.using != Using::Direct && !quiet {
        note(&format!(
            "warning: {outside} of {} points are outside the window, where the map has not been measured",
            records.len()
        ));
    }
    Ok(())
}
