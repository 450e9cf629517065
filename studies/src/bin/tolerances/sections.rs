//! Cost of a step on other sections for the same orbits, and the section chosen by a scene that
//! allows any.

use grazemap::analysis::NoProgress;
use grazemap::convergence::{Choice, ChoiceOptions, SectionChoice, choose, choose_sections};
use grazemap::model::Scene;
use grazemap::orbit::locate;
use grazemap::report::{Cell, Column, ReportError, Table};
use rayon::prelude::*;

/// Scenes whose maps are chosen on other sections; the section of each is its tangency section.
const SCENES: [&str; 9] = [
    "linear",
    "linear_codim2",
    "foale",
    "mems",
    "mems_codim2",
    "soft_b",
    "soft_c",
    "two_stops_t1",
    "moving_stop",
];
/// Tolerances of these choices.
const TOLERANCES: [f64; 2] = [1e-6, 1e-9];
/// Sections, by time before the graze over the period, in the order of preference among equals.
const AHEAD: [(f64, &str); 4] =
    [(0.0, "at the graze"), (0.125, "1/8 before"), (0.25, "1/4 before"), (0.5, "1/2 before")];

/// Sections of a scene for a tolerance.
pub(crate) struct Sections {
    scene: &'static str,
    own: Choice,
    others: Vec<SectionChoice>,
}

/// Sections of all scenes at all tolerances.
pub(crate) fn all() -> Result<Vec<Sections>, String> {
    let of_scenes: Result<Vec<_>, String> = SCENES
        .par_iter()
        .map(|&name| of_scene(name).map_err(|error| format!("{name}: {error}")))
        .collect();
    Ok(of_scenes?.into_iter().flatten().collect())
}

fn of_scene(name: &'static str) -> Result<Vec<Sections>, String> {
    let said = |error: &dyn std::error::Error| error.to_string();
    let scene = Scene::of_catalogue(name).map_err(|error| said(&error))?;
    let location = locate(&scene).map_err(|error| said(&error))?;
    let orbit = location.into_result().map_err(|error| said(&error))?;
    let choices = TOLERANCES.map(|tolerance| {
        let options = ChoiceOptions::new(tolerance);
        let own = choose(&scene, &orbit, &options).map_err(|error| said(&error))?;
        let others = choose_sections(&scene, &orbit, &options, &own, &NoProgress);
        Ok(Sections { scene: name, own, others: others.map_err(|error| said(&error))? })
    });
    choices.into_iter().collect()
}

/// Table of the operations of a step on every section, reasons for failure, and the chosen section.
pub(crate) fn table(sections: &[Sections]) -> Result<Table, ReportError> {
    let mut columns =
        vec![Column::number("tolerance"), Column::text("scene"), Column::text("tangency")];
    columns.extend(AHEAD.map(|(_, name)| Column::text(name)));
    columns.push(Column::text("any takes"));
    let mut table = Table::new(columns);
    for tolerance in TOLERANCES {
        let of = |sections: &&Sections| sections.own.tolerance == tolerance;
        for sections in sections.iter().filter(of) {
            let mut line = vec![
                Cell::number(tolerance, 1),
                Cell::text(sections.scene),
                cost(Some(&sections.own)),
            ];
            line.extend(AHEAD.map(|(ahead, _)| match sections.at(ahead) {
                None => Cell::Missing,
                Some(section) => cost(section.choice.as_ref()),
            }));
            line.push(Cell::text(sections.taken()));
            table.push(line);
        }
    }
    Ok(table)
}

fn cost(choice: Option<&Choice>) -> Cell {
    match choice {
        None => Cell::text("no map"),
        Some(choice) if choice.met => Cell::text(choice.operations.to_string()),
        Some(choice) => {
            let error = choice.fresh_error.or(choice.error);
            Cell::text(error.map_or("not met".to_owned(), |error| format!("not met, {error:.0e}")))
        }
    }
}

impl Sections {
    fn at(&self, ahead: f64) -> Option<&SectionChoice> {
        let mut others = self.others.iter();
        others.find(|section| section.ahead == Some(ahead))
    }

    /// Section with the fewest operations, the first one among equals.
    fn taken(&self) -> &'static str {
        let own = Some(self.own.operations).filter(|_| self.own.met);
        let others =
            AHEAD.map(|(ahead, name)| (self.at(ahead).and_then(SectionChoice::operations), name));
        let all = [(own, "tangency")].into_iter().chain(others);
        let met = all.filter_map(|(operations, name)| Some((operations?, name)));
        met.min_by_key(|&(operations, _)| operations).map_or("-", |(_, name)| name)
    }
}
