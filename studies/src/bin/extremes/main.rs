//! Study docs/studies/extremes.md: one number at a time is taken to its extreme, and the promised
//! accuracy of an expansion is compared with the measured one.
//!
//! `cargo run --release -p grazemap-studies --bin extremes` measures everything anew (a second or
//! two) and writes the table, the data and the figures of the page.

mod page;

use std::error::Error;
use std::fs;

use grazemap::report::to_json;
use grazemap_studies::extremes::cases::extreme_cases;
use grazemap_studies::extremes::data::ExtremeRow;
use grazemap_studies::extremes::measure::measure_extreme;
use grazemap_studies::root;
use rayon::prelude::*;
use serde::Serialize;

/// Rows, for the JSON document.
#[derive(Serialize)]
struct Rows {
    rows: Vec<ExtremeRow>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = root().join("docs/studies/extremes");
    let rows = extreme_cases().par_iter().map(measure_extreme).collect();
    let study = Rows { rows };
    let table = page::table(&study.rows)?;
    fs::write(folder.join("extremes.json"), to_json(&study)?)?;
    fs::write(folder.join("table.csv"), table.to_csv()?)?;
    fs::write(folder.join("table.md"), table.to_markdown())?;
    for (stem, figure) in page::figures(&study.rows) {
        fs::write(folder.join(format!("{stem}.svg")), figure.to_svg()?)?;
    }
    println!("{}", page::summary(&study.rows));
    Ok(())
}
