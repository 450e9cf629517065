//! Points of the section in files: starting points, and series of measured points.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::cli::output::CliError;
use grazemap::analysis::ImageRow;
use grazemap::analysis::fit::MeasuredSeries;
use grazemap::expansion::LocalMap;
use grazemap::numeric::Dd;
use grazemap::pipeline::{bounded, is_standard};

/// Largest number of rows read.
const MOST_ROWS: usize = 10_000_000;

/// Meaning of a column of the file.
#[derive(Clone, Copy, Debug)]
enum Column {
    /// Section coordinate, by index.
    State(usize),
    /// Active parameter, by index.
    Parameter(usize),
    /// Name of the series that a point belongs to.
    Series,
}

/// Meaning of a coordinate without a column, and of an empty cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Missing {
    /// A coordinate without a column is 0; an empty cell is refused.
    Zero,
    /// A coordinate without a column or with an empty cell was not measured.
    Unmeasured,
}

/// A row of the file; NaN where nothing was measured.
struct Row {
    point: ImageRow,
    series: String,
}

/// Reads starting points from a CSV file with a header, or from standard input. Columns are section
/// coordinates and active parameters of the map; missing ones are 0.
pub(super) fn starting_points(path: &Path, map: &LocalMap) -> Result<Vec<ImageRow>, CliError> {
    Ok(read(path, map, Missing::Zero)?.into_iter().map(|row| row.point).collect())
}

/// Reads measured points, in the order of the rows; a series begins where the name of the series or
/// a parameter changes.
pub(super) fn measured_series(
    path: &Path,
    map: &LocalMap,
) -> Result<Vec<MeasuredSeries>, CliError> {
    let numbers = |values: &[Dd]| values.iter().map(|value| value.to_f64()).collect::<Vec<f64>>();
    let rows = read(path, map, Missing::Unmeasured)?;
    let is_same =
        |a: &Row, b: &Row| a.series == b.series && a.point.parameters == b.point.parameters;
    let series = rows.chunk_by(is_same).map(|rows| MeasuredSeries {
        controls: numbers(&rows[0].point.parameters),
        points: rows.iter().map(|row| numbers(&row.point.state)).collect(),
    });
    Ok(series.collect())
}

/// Reads the rows of a CSV file with a header, or of standard input.
fn read(path: &Path, map: &LocalMap, missing: Missing) -> Result<Vec<Row>, CliError> {
    let input: io::Result<Box<dyn Read>> = match is_standard(path) {
        true => Ok(Box::new(io::stdin().lock())),
        false => File::open(path).map(|file| Box::new(file) as Box<dyn Read>),
    };
    let path = if is_standard(path) { Path::new("standard input") } else { path };
    let unreadable = |source| CliError::UnreadableStates { path: path.to_owned(), source };
    let input = input.map_err(|error| unreadable(error.into()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bounded(input));
    let header = reader.headers().map_err(unreadable)?.clone();
    let columns = columns(&header, map, path, missing)?;
    let mut rows = Vec::new();
    for (number, record) in reader.records().enumerate() {
        let record = record.map_err(unreadable)?;
        if number == MOST_ROWS {
            return Err(CliError::TooManyStates { path: path.to_owned(), limit: MOST_ROWS });
        }
        rows.push(row(&record, &columns, map, (path, missing))?);
    }
    if rows.is_empty() {
        return Err(CliError::NoStates { path: path.to_owned() });
    }
    Ok(rows)
}

/// Meanings of the header's columns. Refuses unknown and repeated names.
fn columns(
    header: &csv::StringRecord,
    map: &LocalMap,
    path: &Path,
    missing: Missing,
) -> Result<Vec<Column>, CliError> {
    let mut columns = Vec::with_capacity(header.len());
    for (number, name) in header.iter().enumerate() {
        let name = name.trim_start_matches('\u{feff}');
        let state = map.section.coordinates.iter().position(|known| known == name);
        let parameter = map.parameters.iter().position(|known| known.name == name);
        let is_series = missing == Missing::Unmeasured && name == "series";
        let column = state.map(Column::State).or(parameter.map(Column::Parameter));
        let column = column.or(is_series.then_some(Column::Series));
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
    (path, missing): (&Path, Missing),
) -> Result<Row, CliError> {
    let absent = match missing {
        Missing::Zero => Dd::ZERO,
        Missing::Unmeasured => Dd::from(f64::NAN),
    };
    let mut row = ImageRow {
        state: vec![absent; map.dimension()],
        parameters: vec![Dd::ZERO; map.parameters.len()],
    };
    let mut series = String::new();
    for (text, column) in record.iter().zip(columns) {
        if matches!(column, Column::Series) {
            text.clone_into(&mut series);
            continue;
        }
        if text.is_empty() && missing == Missing::Unmeasured {
            continue;
        }
        let value = Dd::from_decimal(text).ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| CliError::NotANumber {
            path: path.to_owned(),
            line: record.position().map_or(0, csv::Position::line),
            text: text.to_owned(),
        })?;
        match *column {
            Column::State(place) => row.state[place] = value,
            Column::Parameter(place) => row.parameters[place] = value,
            Column::Series => {}
        }
    }
    Ok(Row { point: row, series })
}

/// Name of the section.
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
