//! Study docs/studies/dynamics.md: effect of the truncation of one step on orbits, their stability,
//! their bifurcations and attractors.
//!
//! `cargo run --release -p grazemap-studies --bin dynamics` measures everything anew (a few
//! minutes) and writes the tables and figures of the page. The truth is direct simulation, in
//! double-double but for attractors; `tests/analysis/dynamics.rs` holds it to closed forms.

mod adding;
mod attractor;
mod born;
mod chosen;
mod conclusions;
mod loci;
mod subject;

use std::error::Error;

use grazemap::analysis::orbits::BifurcationKind;
use grazemap_studies::study::Study;

use attractor::Site;
use born::{Born, Graze};
use subject::Subject;

/// Scenes at a generic graze, and at points with `ξ₁ = 0`.
const GENERIC: [&str; 3] = ["linear", "foale_omega_2_2", "mems"];
const CODIMENSION_TWO: [&str; 3] = ["linear_codim2", "mems_codim2", "mems_scenario3"];
/// Orders of tables and figures without room for all.
const SHOWN: [(u32, u32); 7] = [(1, 2), (2, 1), (2, 2), (2, 3), (3, 4), (4, 6), (5, 8)];

fn main() -> Result<(), Box<dyn Error>> {
    let mut study = Study::open("dynamics")?;
    let generic = GENERIC.map(Subject::new);
    let special = CODIMENSION_TWO.map(Subject::new);
    orbits_born(&mut study, &generic, &special)?;
    bifurcations(&mut study, &special)?;
    attractors(&mut study)?;
    let adding = adding::table()?;
    study.data("adding", &adding)?;
    study.shown("adding", &adding)?;
    let chosen = chosen::table(&[
        (Subject::new("linear"), None),
        (Subject::new("linear_codim2"), Some((BifurcationKind::Fold, -0.1))),
        (Subject::new("mems_codim2"), Some((BifurcationKind::Flip, -1.0))),
        (Subject::new("mems_scenario3"), Some((BifurcationKind::Flip, 1.0))),
    ])?;
    study.data("chosen", &chosen)?;
    study.shown("chosen", &chosen)?;
    study.close()
}

/// Tables of position and multipliers of the orbit born at a graze.
fn orbits_born(
    study: &mut Study,
    generic: &[Subject],
    special: &[Subject],
) -> Result<(), Box<dyn Error>> {
    let generic: Vec<_> = generic.iter().map(Born::new).collect();
    let special: Vec<_> = special.iter().map(Born::new).collect();
    let all: Vec<_> = generic.iter().chain(&special).collect();
    study.data("born", &born::data_table(&all)?)?;
    for (stem, graze, scenes) in
        [("generic", Graze::Generic, &generic), ("codim2", Graze::CodimensionTwo, &special)]
    {
        let slopes = born::slope_table(graze, scenes)?;
        study.data(&format!("slopes-{stem}"), &slopes)?;
        study.shown(&format!("slopes-{stem}"), &slopes)?;
        let errors = born::error_table(scenes, 1)?;
        study.data(&format!("errors-{stem}"), &errors)?;
        study.shown(&format!("errors-{stem}"), &errors)?;
    }
    study.figure("trace-generic", &born::trace_figure(&generic[0], "A generic graze"))?;
    study.figure("trace-codim2", &born::trace_figure(&special[2], "Codimension two"))?;
    let conclusions = conclusions::table(&special)?;
    study.data("conclusions", &conclusions)?;
    study.shown("conclusions", &conclusions)
}

/// Tables of folds and flips near codimension-two points.
fn bifurcations(study: &mut Study, special: &[Subject]) -> Result<(), Box<dyn Error>> {
    let loci: Vec<_> = special.iter().flat_map(loci::loci).collect();
    let all: Vec<_> = loci.iter().collect();
    let mut families = loci::families(&loci);
    study.data("loci", &loci::table(&all, &born::ORDERS)?)?;
    let edges: Vec<_> = families.iter().flat_map(|family| [family[0], family[2]]).collect();
    study.shown("loci", &loci::table(&edges, &SHOWN)?)?;
    let slopes = loci::slope_table(&families)?;
    study.data("slopes-loci", &slopes)?;
    study.shown("slopes-loci", &slopes)?;
    families.retain(|family| {
        family[0].scene == "linear_codim2" && family[0].kind == BifurcationKind::Fold
    });
    for family in &families {
        study.figure("fold", &loci::figure(family, &SHOWN))?;
    }
    Ok(())
}

/// Tables of attractors near a codimension-two point, and in chaos that begins at a graze.
fn attractors(study: &mut Study) -> Result<(), Box<dyn Error>> {
    let orders = [(1, 1), (1, 2), (2, 1), (2, 2), (2, 3), (3, 4), (5, 8)];
    let sites = [
        Site {
            subject: Subject::new("linear_codim2"),
            parameters: [3.997e-3, 1e-3],
            label: "linear_codim2",
        },
        Site {
            subject: Subject::new("cantilever_3_5_soft"),
            parameters: [2.9e-4, 0.0],
            label: "cantilever_3_5_soft",
        },
    ];
    let compared: Vec<_> =
        sites.iter().map(|site| attractor::compared(site, &site.subject.maps(), &orders)).collect();
    let pairs: Vec<_> = sites.iter().zip(&compared).collect();
    let table = attractor::table(&pairs)?;
    study.data("attractors", &table)?;
    study.shown("attractors", &table)?;
    study.figure(
        "density",
        &attractor::density_figure(&sites[0], &compared[0], &[(2, 2), (5, 8)]),
    )?;
    let maps = sites[0].subject.maps();
    let range = [3.9934e-3, 4.004e-3];
    study.figure("sweep", &attractor::sweep_figure(&sites[0], &maps, range, (1, 2)))
}
