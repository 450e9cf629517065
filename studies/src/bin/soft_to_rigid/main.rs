//! Study docs/studies/soft-to-rigid.md: a compliant stop of growing stiffness, compared with the
//! rigid stop.
//!
//! `cargo run --release -p grazemap-studies --bin soft_to_rigid` measures everything anew (some
//! seconds) and writes the tables and figures of the page. The truth is direct simulation in
//! double-double, which `tests/simulation/soft_to_rigid.rs` holds against closed forms.

mod approach;
mod error;
mod reach;

use std::error::Error;

use error::{M, Measured};
use grazemap_studies::soft_to_rigid::family::{Family, Stop};
use grazemap_studies::study::Study;

/// Stiffnesses, as powers of ten.
const DECADES: std::ops::RangeInclusive<i32> = 1..=8;
/// Stiffnesses shown in the page where rows are alike; the others are in the CSV.
const SHOWN: [f64; 3] = [1e1, 1e4, 1e8];
/// Stiffness at which errors are drawn, as a power of ten.
const DRAWN: i32 = 6;

fn main() -> Result<(), Box<dyn Error>> {
    let mut study = Study::open("soft-to-rigid")?;
    let rigid = Stop::rigid(M).direct();
    let of = |family| DECADES.map(move |decade| (family, decade));
    let stops: Vec<_> = Family::ALL
        .into_iter()
        .flat_map(of)
        .map(|(family, decade)| Measured::new(family, decade, &rigid))
        .collect();
    let all: Vec<_> = stops.iter().collect();
    let shown: Vec<_> =
        all.iter().copied().filter(|stop| SHOWN.contains(&stop.stiffness)).collect();
    study.data("radius", &reach::radius_table(&all)?)?;
    study.shown("radius", &reach::radius_table(&shown)?)?;
    study.data("reach", &reach::reach_table(&all)?)?;
    study.shown("reach", &reach::reach_table(&shown)?)?;
    for stops in stops.chunk_by(|a, b| a.family == b.family) {
        family(&mut study, stops)?;
    }
    study.close()
}

/// Figures and tables of one family.
fn family(study: &mut Study, stops: &[Measured<'_>]) -> Result<(), Box<dyn Error>> {
    let family = stops[0].family;
    let named = |stem: &str| format!("{stem}-{}", family.name().to_lowercase());
    let gap = reach::gap_table(stops)?;
    study.data(&named("gap"), &gap)?;
    study.shown(&named("gap"), &gap)?;
    study.figure(&named("gap"), &reach::gap_figure(stops))?;
    let samples = approach::samples(stops);
    study.data(&named("samples"), &approach::sample_table(&samples)?)?;
    let errors = approach::error_figure(family.name(), &samples, DRAWN);
    study.figure(&named("errors"), &errors)?;
    if family == Family::A {
        study.figure("collapse", &approach::collapse_figure(&samples))?;
    }
    Ok(())
}
