//! `[grazing]`: which orbit grazes, and what is adjusted so that it does.

use super::document::{Entry, Table};
use super::lookup::{component, distinct, parameter};
use super::{Grazing, Symmetry};
use crate::model::error::{Checked, Fault};
use crate::model::names;
use crate::model::oscillator::Model;
use crate::model::problem::SceneProblem;

/// Keys of `[grazing]`.
const KEYS: [&str; 6] = [
    "surface",
    "passages",
    "solve_for",
    "periods",
    "guess",
    "symmetry",
];

/// Most forcing periods of an orbit.
const MOST_PERIODS: u64 = 1000;

/// Most grazing passages of an orbit.
const MOST_PASSAGES: usize = 64;

/// Reads `[grazing]`.
pub(super) fn read(table: &Table<'_>, model: &Model) -> Checked<Grazing> {
    table.only(&KEYS)?;
    let passages = passages(table, model)?;
    let solve_for = solve_for(table, model, passages.len())?;
    let periods = table
        .field("periods")
        .map_or(Ok(1), |field| field.count(1, MOST_PERIODS))?;
    let guess = table
        .field("guess")
        .map(|field| guess(&field.table()?, model))
        .transpose()?;
    let symmetry = symmetry(table, model)?;
    Ok(Grazing {
        passages,
        solve_for,
        periods: periods as usize,
        guess,
        symmetry,
    })
}

/// `surface` or `passages`; neither where the model has one surface only.
fn passages(table: &Table<'_>, model: &Model) -> Checked<Vec<usize>> {
    let entries = match (table.field("surface"), table.field("passages")) {
        (Some(_), Some(passages)) => {
            let problem = SceneProblem::Exclusive {
                first: "surface",
                second: "passages",
            };
            return Err(Fault::at(passages.key_span, problem));
        }
        (Some(surface), None) => vec![surface.entry("a surface's name")?],
        (None, Some(passages)) => {
            let list = passages.list("a list of surfaces")?;
            if list.is_empty() {
                return Err(Fault::at(
                    passages.span(),
                    SceneProblem::Empty { key: passages.path },
                ));
            }
            if list.len() > MOST_PASSAGES {
                let problem = SceneProblem::TooMany {
                    key: passages.path.clone(),
                    most: MOST_PASSAGES,
                    found: list.len(),
                };
                return Err(Fault::at(passages.span(), problem));
            }
            list
        }
        (None, None) if model.surfaces.len() == 1 => return Ok(vec![0]),
        (None, None) => vec![table.require("surface")?.entry("a surface's name")?],
    };
    entries.iter().map(|entry| surface(entry, model)).collect()
}

/// The surface an entry names.
fn surface(entry: &Entry<'_>, model: &Model) -> Checked<usize> {
    let name = entry.text("a surface's name")?;
    let known = || model.surfaces.iter().map(|surface| surface.name.as_str());
    known().position(|known| known == name).ok_or_else(|| {
        entry.fault(SceneProblem::UnknownName {
            name: super::document::shown(name),
            kind: "surface",
            nearest: names::nearest(name, known()),
        })
    })
}

fn solve_for(table: &Table<'_>, model: &Model, passages: usize) -> Checked<Vec<usize>> {
    let field = table.require("solve_for")?;
    let entries = field.one_or_list("a parameter's name")?;
    if entries.is_empty() {
        return Err(Fault::at(
            field.span(),
            SceneProblem::Empty { key: field.path },
        ));
    }
    let parameters = distinct(&entries, |entry| parameter(entry, model))?;
    if parameters.len() > passages {
        let problem = SceneProblem::TooManyUnknowns {
            parameters: parameters.len(),
            passages,
        };
        return Err(Fault::at(field.span(), problem));
    }
    Ok(parameters)
}

/// A value for every component of the full state.
fn guess(table: &Table<'_>, model: &Model) -> Checked<Vec<f64>> {
    let names = model.full_state_names();
    let mut guess = vec![None; names.len()];
    for field in table.fields() {
        guess[component(&field, model)?] = Some(field.double()?);
    }
    let values = guess.into_iter().zip(&names).map(|(value, name)| {
        let missing = || SceneProblem::IncompleteGuess {
            component: (*name).to_owned(),
        };
        value.ok_or_else(|| Fault::at(table.span(), missing()))
    });
    values.collect()
}

fn symmetry(table: &Table<'_>, model: &Model) -> Checked<Symmetry> {
    let Some(field) = table.field("symmetry") else {
        return Ok(Symmetry::None);
    };
    let options = [
        ("none", Symmetry::None),
        ("half-period", Symmetry::HalfPeriod),
    ];
    let symmetry = field.choice(&options, "\"none\", \"half-period\"")?;
    if symmetry == Symmetry::HalfPeriod && model.phase.is_none() {
        return Err(Fault::at(
            field.span(),
            SceneProblem::NeedsPhase {
                what: "a half-period symmetry",
            },
        ));
    }
    Ok(symmetry)
}
