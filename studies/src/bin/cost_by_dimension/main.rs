//! Study docs/studies/cost-by-dimension.md: cost of maps by states, parameters and order.
//!
//! `cargo run --release -p grazemap-studies --bin cost_by_dimension` measures everything anew (some
//! minutes, most of them in the compiler) and writes the tables and figures of the page. Floors are
//! operations at the rate of multiply-adds of the same run.

mod chain;
mod chains;
mod compiled;
mod measure;
mod scenes;

use std::error::Error;

use chain::Law;
use chains::Chain;
use grazemap_studies::study::Study;

/// Numbers of masses; each has two states.
const MASSES: [usize; 3] = [1, 2, 3];
/// Numbers of active parameters.
const ACTIVE: [usize; 2] = [1, 2];

fn main() -> Result<(), Box<dyn Error>> {
    let mut study = Study::open("cost-by-dimension")?;
    let rates = measure::multiply_add_ns();
    let mut found = Vec::new();
    for masses in MASSES {
        for law in Law::ALL {
            for active in ACTIVE {
                found.push(Chain::measure(masses, law, active)?);
            }
        }
    }
    let table = chains::table(&found, rates[0])?;
    study.data("chains", &table)?;
    study.shown("jets", &chains::jet_table(&found, rates[0])?)?;
    study.shown("steps", &chains::step_table(&found, rates[0])?)?;
    study.figure("jets", &chains::jet_figure(&found))?;
    study.figure("steps", &chains::step_figure(&found, rates[0]))?;
    let scenes = scenes::table(rates[0])?;
    study.data("scenes", &scenes)?;
    study.shown("scenes", &scenes)?;
    study.shown("rates", &scenes::rate_table(rates)?)?;
    study.close()
}
