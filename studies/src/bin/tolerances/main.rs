//! Study docs/studies/tolerances.md: maps chosen for every scene of the catalogue at four
//! tolerances.
//!
//! `cargo run --release -p grazemap-studies --bin tolerances` chooses and measures everything anew
//! (some minutes) and writes the tables and figures of the page; with `-- sections`, only the table
//! of other sections. The reference is direct simulation in double-double, at points that were not
//! used for the choice.

mod figures;
mod measure;
mod sections;
mod tables;

use std::error::Error;
use std::time::Instant;

use grazemap::convergence::multiply_add_ns;
use grazemap::model::catalogue;
use grazemap_studies::study::Study;
use rayon::prelude::*;

use measure::{Case, Row};

/// Tolerances, in the units of the offsets.
const TOLERANCES: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

fn main() -> Result<(), Box<dyn Error>> {
    let mut study = Study::open("tolerances")?;
    let sections = sections::table(&sections::all()?)?;
    study.shown("sections", &sections)?;
    if std::env::args().nth(1).as_deref() == Some("sections") {
        return study.close();
    }
    let names: Vec<&str> = catalogue::names().collect();
    let chosen = |name: &&str| {
        let clock = Instant::now();
        let case = Case::new(name);
        eprintln!("{name}: {:.1} s", clock.elapsed().as_secs_f64());
        case
    };
    let made: Vec<_> = names.par_iter().map(chosen).collect();
    let mut cases = Vec::new();
    for (name, case) in names.iter().zip(made) {
        cases.push(case.map_err(|error| format!("{name}: {error}"))?);
    }
    // NOTE: times are measured one after another, since parallel runs would disturb each other.
    let multiply_add = multiply_add_ns();
    let timed: Result<Vec<Vec<Row>>, _> =
        cases.iter().map(|case| case.rows(multiply_add)).collect();
    let rows: Vec<Row> = timed?.into_iter().flatten().collect();
    study.data("choices", &tables::choices(&rows)?)?;
    study.shown("choices", &tables::choices(&rows)?)?;
    study.shown("summary", &tables::summary(&rows)?)?;
    study.shown("refusals", &tables::refusals(&rows)?)?;
    study.shown("joint", &tables::joint(&rows)?)?;
    study.shown("least", &tables::least(&rows)?)?;
    study.shown("rule", &tables::rule(&rows)?)?;
    study.figure("cost", &figures::cost(&rows))?;
    study.figure("speed", &figures::speed(&rows))?;
    study.figure("orders", &figures::orders(&rows))?;
    study.figure("degrees", &figures::predicted_degrees(&rows))?;
    study.figure("weights", &figures::predicted_weights(&rows))?;
    study.close()
}
