//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;

use super::{beyond, map, open, remark_on_window};
use crate::cli::arguments::ImageOptions;
use crate::cli::output::{CliError, Destination, Results, note};
use grazemap::analysis::{DirectEnd, ImageRecord, ImageRequest, ImageRow, Precision, Using};
use grazemap::expansion::{LocalMap, SectionKind, WindowEdge};
use grazemap::numeric::Dd;
use grazemap::report::{Named, to_json};

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
    kind: SectionKind,
    phase: Option<f64>,
}

/// An offset as a number, or as text where a number would lose digits.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Offset {
    Number(f64),
    Digits(String),
}

pub(in crate::cli) fn run(options: &ImageOptions) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let edge = beyond(map.window_edges());
    let request = ImageRequest {
        rows: read(&options.states, map.local())?,
        iterations: options.iterations as usize,
        using: options.using.into(),
        precision: options.precision.into(),
    };
    let records = map.images(&request)?;
    remark_on_window(&map, outlets.quiet);
    let csv = table(map.local(), &request, &records);
    let section = map.section();
    let decided =
        section.decided.as_ref().map(|_| ImageSection { kind: section.kind, phase: section.phase });
    let list: Vec<Image> = records
        .iter()
        .map(|record| Image { section: decided, ..image(map.local(), &request, record, edge) })
        .collect();
    let results = Results::named("images", csv.clone(), to_json(&list)?, Some(csv));
    let mut outlets = outlets.clone();
    if outlets.json.is_none() && outlets.csv.is_none() && outlets.output.is_none() {
        outlets.csv = Some(Destination::Standard);
    }
    results.deliver("image", &outlets)?;
    judge(&request, &records, outlets.quiet)
}

/// One row per input row and iteration.
fn table(map: &LocalMap, request: &ImageRequest, records: &[ImageRecord]) -> String {
    let direct = request.using == Using::Direct;
    let mut text = format!("row,iteration,{},contacts,inside", map.section.coordinates.join(","));
    text.push_str(if direct { ",extra_contacts\n" } else { "\n" });
    for record in records {
        let offsets: Vec<String> =
            record.offsets.iter().map(|&value| digits(value, request.precision)).collect();
        let (row, iteration, inside) = (record.row, record.iteration, u8::from(record.inside));
        let _infallible =
            write!(text, "{row},{iteration},{},{},{inside}", offsets.join(","), record.contacts);
        if let Some(extra) = record.extra_contacts.filter(|_| direct) {
            let _infallible = write!(text, ",{extra}");
        }
        text.push('\n');
    }
    text
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
            map.section.coordinates.iter().cloned().zip(record.offsets.iter().map(offset)),
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
    let missing =
        records.iter().find(|record| record.offsets.iter().any(|value| !value.is_finite()));
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
            "warning: {outside} of {} points are outside the window, where the map has not been \
                measured",
            records.len()
        ));
    }
    Ok(())
}

/// Most rows read.
const MOST_ROWS: usize = 10_000_000;

/// What a column of the file gives.
#[derive(Clone, Copy, Debug)]
enum Column {
    /// A coordinate of the section.
    State(usize),
    /// An active parameter.
    Parameter(usize),
}

/// Reads the rows of a CSV file with a header; columns are coordinates and active parameters of the
/// map, missing ones are 0.
fn read(path: &Path, map: &LocalMap) -> Result<Vec<ImageRow>, CliError> {
    let unreadable = |source| CliError::UnreadableStates { path: path.to_owned(), source };
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(unreadable)?;
    let header = reader.headers().map_err(unreadable)?.clone();
    let columns = columns(&header, map, path)?;
    let mut rows = Vec::new();
    for (number, record) in reader.records().enumerate() {
        let record = record.map_err(unreadable)?;
        if number == MOST_ROWS {
            return Err(CliError::TooManyStates { path: path.to_owned(), limit: MOST_ROWS });
        }
        rows.push(row(&record, &columns, map, path)?);
    }
    if rows.is_empty() {
        return Err(CliError::NoStates { path: path.to_owned() });
    }
    Ok(rows)
}

/// What each column of the header gives; every name known, none twice.
fn columns(
    header: &csv::StringRecord,
    map: &LocalMap,
    path: &Path,
) -> Result<Vec<Column>, CliError> {
    let mut columns = Vec::with_capacity(header.len());
    for (number, name) in header.iter().enumerate() {
        let name = name.trim_start_matches('\u{feff}');
        let state = map.section.coordinates.iter().position(|known| known == name);
        let parameter = map.parameters.iter().position(|known| known.name == name);
        let column = state.map(Column::State).or(parameter.map(Column::Parameter));
        columns.push(column.ok_or_else(|| CliError::UnknownColumn {
            path: path.to_owned(),
            name: name.to_owned(),
            known: known_names(map),
            section: section_words(map),
        })?);
        if header.iter().take(number).any(|earlier| earlier == name) {
            return Err(CliError::ColumnTwice { path: path.to_owned(), name: name.to_owned() });
        }
    }
    Ok(columns)
}

fn row(
    record: &csv::StringRecord,
    columns: &[Column],
    map: &LocalMap,
    path: &Path,
) -> Result<ImageRow, CliError> {
    let mut row = ImageRow {
        state: vec![Dd::ZERO; map.dimension()],
        parameters: vec![Dd::ZERO; map.parameters.len()],
    };
    for (text, column) in record.iter().zip(columns) {
        let value = Dd::from_decimal(text).ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| CliError::NotANumber {
            path: path.to_owned(),
            line: record.position().map_or(0, csv::Position::line),
            text: text.to_owned(),
        })?;
        match *column {
            Column::State(place) => row.state[place] = value,
            Column::Parameter(place) => row.parameters[place] = value,
        }
    }
    Ok(row)
}

/// The section by name.
fn section_words(map: &LocalMap) -> String {
    match map.section.phase {
        None => "the tangency section".to_owned(),
        Some(phase) => format!("the stroboscopic section at the phase {:.6}", phase.to_f64()),
    }
}

fn known_names(map: &LocalMap) -> String {
    let parameters = map.parameters.iter().map(|parameter| &parameter.name);
    let names: Vec<&str> =
        map.section.coordinates.iter().chain(parameters).map(String::as_str).collect();
    names.join(", ")
}
