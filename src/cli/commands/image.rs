//! `grazemap image`: images of section points, by the map, its parts, or direct simulation.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::{Contacts, open, remark_on_window};
use crate::cli::arguments::ImageOptions;
use crate::cli::output::{CliError, Destination, note_all};
use grazemap::Error;
use grazemap::analysis::{ImageRequest, ImageRow, Using};
use grazemap::expansion::LocalMap;
use grazemap::numeric::Dd;
use grazemap::pipeline::{bounded, is_standard};
use grazemap::report::OutputFolder;

pub(in crate::cli) fn run(options: &ImageOptions) -> Result<(), CliError> {
    let mut outlets = options.scene.common.outlets.clone();
    if is_standard(&options.scene.scene) && is_standard(&options.states) {
        return Err(CliError::StandardInputTwice);
    }
    let contacts = Contacts::unless(options.using == Using::Direct, Contacts::Unused);
    let map = contacts.map(open(&options.scene)?, outlets.quiet)?;
    let images = map.image_answer(ImageRequest {
        rows: read(&options.states, map.local())?,
        iterations: options.iterations as usize,
        using: options.using,
        precision: options.precision,
    })?;
    remark_on_window(&map, outlets.quiet);
    if outlets.json.is_none() && outlets.csv.is_none() && outlets.output.is_none() {
        outlets.csv = Some(Destination::Standard);
    }
    if let Some(folder) = &outlets.output {
        let folder = OutputFolder::create(folder)?;
        folder.write("images.json", images.document()?)?;
        folder.write_streamed("images.csv", |out| images.rows().write_csv(out))?;
    }
    if let Some(place) = &outlets.json {
        place.write(&images.document()?)?;
    }
    outlets.write_csv(&|out| images.rows().write_csv(out))?;
    if outlets.shows() {
        Destination::Standard.write_streamed(&|out| images.rows().write_csv(out))?;
    }
    note_all(&images.remarks().collect::<Vec<_>>(), outlets.quiet);
    images.ended().map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}

/// Largest number of rows read.
const MOST_ROWS: usize = 10_000_000;

/// Meaning of a column of the file.
#[derive(Clone, Copy, Debug)]
enum Column {
    /// Section coordinate, by index.
    State(usize),
    /// Active parameter, by index.
    Parameter(usize),
}

/// Reads rows from a CSV file with a header, or from standard input. Columns are section
/// coordinates and active parameters of the map; missing ones are 0.
fn read(path: &Path, map: &LocalMap) -> Result<Vec<ImageRow>, CliError> {
    let input: io::Result<Box<dyn Read>> = match is_standard(path) {
        true => Ok(Box::new(io::stdin().lock())),
        false => File::open(path).map(|file| Box::new(file) as Box<dyn Read>),
    };
    let path = if is_standard(path) { Path::new("standard input") } else { path };
    let unreadable = |source| CliError::UnreadableStates { path: path.to_owned(), source };
    let input = input.map_err(|error| unreadable(error.into()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bounded(input));
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

/// Meanings of the header's columns. Refuses unknown and repeated names.
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
