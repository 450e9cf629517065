//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::Serialize;

use super::{beyond, map, open, remark_on_window};
use crate::cli::arguments::ImageOptions;
use crate::cli::output::{CliError, Destination, Results, note};
use grazemap::Map;
use grazemap::analysis::{DirectEnd, ImageRecord, ImageRequest, ImageRow, Precision, Using};
use grazemap::convergence::MeasuredWindow;
use grazemap::expansion::{LocalMap, SectionKind, WindowBound, WindowEdge};
use grazemap::numeric::Dd;
use grazemap::pipeline::is_standard;
use grazemap::report::{Named, to_json};

/// Significant digits of a single, of a double and of a double-double.
const DIGITS: [usize; 3] = [9, 17, 32];

/// One image as it is written to JSON; offsets as decimal text in double-double.
#[derive(Debug, Serialize)]
struct Image<'a> {
    row: usize,
    iteration: usize,
    offsets: Named<Option<Offset>>,
    contacts: usize,
    inside: u8,
    /// What `inside` is told by, and what the map errs there.
    window: &'a MeasuredWindow,
    /// The bounds of the window that the point that was mapped is outside of.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outside: Vec<String>,
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
    if is_standard(&options.scene.scene) && is_standard(&options.states) {
        return Err(CliError::StandardInputTwice);
    }
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
        .map(|record| Image { section: decided, ..image(&map, &request, record, edge) })
        .collect();
    let results = Results::named("images", csv.clone(), to_json(&list)?, Some(csv));
    let mut outlets = outlets.clone();
    if outlets.json.is_none() && outlets.csv.is_none() && outlets.output.is_none() {
        outlets.csv = Some(Destination::Standard);
    }
    results.deliver("image", &outlets)?;
    judge(map.local(), &request, &records, outlets.quiet)
}

/// One row per input row and iteration.
fn table(map: &LocalMap, request: &ImageRequest, records: &[ImageRecord]) -> String {
    let direct = matches!(request.using, Using::Direct | Using::Guarded);
    let mut text = format!("row,iteration,{},contacts,inside", map.section.coordinates.join(","));
    text.push_str(if direct { ",extra_contacts\n" } else { "\n" });
    for record in records {
        let offsets: Vec<String> =
            record.offsets.iter().map(|&value| digits(value, request.precision)).collect();
        let (row, iteration, inside) = (record.row, record.iteration, u8::from(record.inside()));
        let _infallible =
            write!(text, "{row},{iteration},{},{},{inside}", offsets.join(","), record.contacts);
        if direct {
            let extra = record.extra_contacts.map(|extra| extra.to_string());
            let _infallible = write!(text, ",{}", extra.unwrap_or_default());
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

fn image<'a>(
    map: &'a Map,
    request: &ImageRequest,
    record: &ImageRecord,
    edge: Option<WindowEdge>,
) -> Image<'a> {
    let (window, map) = (map.window(), map.local());
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
        inside: u8::from(record.inside()),
        window,
        outside: record.exceeded.iter().map(|&bound| bound_name(map, bound)).collect(),
        extra_contacts: record.extra_contacts,
        end: record.end,
        window_edge: edge.filter(|_| matches!(request.using, Using::Map | Using::Discontinuity)),
        section: None,
    }
}

/// Says which points were outside the window, and fails where a point had no image.
fn judge(
    map: &LocalMap,
    request: &ImageRequest,
    records: &[ImageRecord],
    quiet: bool,
) -> Result<(), CliError> {
    let missing =
        records.iter().find(|record| record.offsets.iter().any(|value| !value.is_finite()));
    if let Some(record) = missing {
        return Err(CliError::NoImage {
            row: record.row,
            iteration: record.iteration,
            end: record.end,
        });
    }
    let outside = records.iter().filter(|record| !record.inside()).count();
    let mapped = !matches!(request.using, Using::Direct | Using::Guarded);
    if outside > 0 && mapped && !quiet {
        note(&format!(
            "warning: {outside} of {} points are outside the window, where the map has not been \
                measured: beyond {}; `--using guarded` simulates them",
            records.len(),
            exceeded(map, records)
        ));
    }
    Ok(())
}

/// The bounds of the window that points are outside of, and how many points each.
fn exceeded(map: &LocalMap, records: &[ImageRecord]) -> String {
    let mut counts: Vec<(WindowBound, usize)> = Vec::new();
    for &bound in records.iter().flat_map(|record| &record.exceeded) {
        match counts.iter_mut().find(|(known, _)| *known == bound) {
            Some((_, count)) => *count += 1,
            None => counts.push((bound, 1)),
        }
    }
    let words = counts.into_iter().map(|(bound, count)| {
        let (name, window) = (bound_name(map, bound), &map.window);
        let (what, limit) = match bound {
            WindowBound::State(number) => ("the half-width", window.state[number]),
            WindowBound::Parameter(number) => ("the half-width", window.parameter[number]),
            WindowBound::Depth(_) => ("the largest", window.depth),
        };
        format!("{what} {limit:e} of `{name}` ({count})")
    });
    words.collect::<Vec<_>>().join(", ")
}

/// The name of what a window bounds: a coordinate, a parameter, or `depth`, numbered where there
/// are several passages.
fn bound_name(map: &LocalMap, bound: WindowBound) -> String {
    match bound {
        WindowBound::State(number) => map.section.coordinates[number].clone(),
        WindowBound::Parameter(number) => map.parameters[number].name.clone(),
        WindowBound::Depth(_) if map.passages() == 1 => "depth".to_owned(),
        WindowBound::Depth(passage) => format!("depth{}", passage + 1),
    }
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

/// Reads the rows of a CSV file, or of standard input, with a header; columns are coordinates and
/// active parameters of the map, missing ones are 0.
fn read(path: &Path, map: &LocalMap) -> Result<Vec<ImageRow>, CliError> {
    let input: io::Result<Box<dyn Read>> = match is_standard(path) {
        true => Ok(Box::new(io::stdin().lock())),
        false => File::open(path).map(|file| Box::new(file) as Box<dyn Read>),
    };
    let path = if is_standard(path) { Path::new("standard input") } else { path };
    let unreadable = |source| CliError::UnreadableStates { path: path.to_owned(), source };
    let input = input.map_err(|error| unreadable(error.into()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(input);
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
