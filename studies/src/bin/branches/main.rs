//! Study docs/studies/branches.md: results of branches against closed forms and brute force, and
//! their costs.
//!
//! `cargo run --release -p grazemap-studies --bin branches -- foale` looks for the published
//! saddle-nodes and flips of Foale's oscillator by direct simulation; `-- complete [LONGEST [VALUES
//! [SCENE...]]]` sweeps the catalogue's scenes of one passage by guarded iteration and looks for
//! every attractor on a stable branch; `-- speed` times branches. Each prints its table and writes
//! it into the page.

mod complete;
mod foale;
mod speed;

use std::error::Error;

use complete::Completeness;
use grazemap::Map;
use grazemap::model::catalogue;
use grazemap::prelude::{FindGraze, Scene};
use grazemap::report::{Cell, Column, Table};
use grazemap_studies::study::Study;

/// Default for the longest period followed, in returns, and for the number of values of a sweep.
const LONGEST: usize = 8;
const VALUES: usize = 200;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_default();
    let table = match command.as_str() {
        "foale" => {
            let points = foale::points()?;
            let errors = foale::errors(&points)?;
            Study::open("branches")?.figure("foale", &foale::figure(&errors))?;
            foale::table(&errors)?
        }
        "complete" => {
            let longest = arguments.next().map_or(Ok(LONGEST), |text| text.parse())?;
            let values = arguments.next().map_or(Ok(VALUES), |text| text.parse())?;
            completeness(longest, values, arguments.collect())?
        }
        "speed" => speed::table()?,
        _ => return Err("say `foale`, `complete` or `speed`".into()),
    };
    println!("{}", table.to_text());
    let mut study = Study::open("branches")?;
    study.data(&command, &table)?;
    study.shown(&command, &table)?;
    study.close()
}

/// Map of a scene of the catalogue.
fn map_of(name: &str) -> Result<Map, Box<dyn Error>> {
    let scene = Scene::of_catalogue(name)?;
    Ok(scene.graze()?.map()?)
}

/// Comparison of branches with the attractors of guarded iteration over the window, by scene.
fn completeness(
    longest: usize,
    values: usize,
    names: Vec<String>,
) -> Result<Table, Box<dyn Error>> {
    let mut columns = vec![Column::text("scene"), Column::text("parameter")];
    columns.extend(
        ["branches", "points", "periodic", "by map", "direct", "missed", "others"]
            .map(Column::number),
    );
    let mut table = Table::new(columns);
    let all = catalogue::names().map(str::to_owned);
    let names: Vec<String> = if names.is_empty() { all.collect() } else { names };
    for name in names {
        let map = map_of(&name)?;
        let width = map.local().window.parameter.first().copied().unwrap_or(f64::INFINITY);
        if map.local().passages() != 1 || !width.is_finite() {
            continue;
        }
        let found = complete::of_map(&map, (0, [-width, width]), longest, values)?;
        let Completeness { periodic, found: [by_map, direct], others, branches, missed } = &found;
        eprintln!("{name}: {found:?}");
        let mut row = vec![
            Cell::text(format!("`{name}`")),
            Cell::text(map.local().parameters[0].name.as_str()),
        ];
        let counts = [branches[0], branches[1], *periodic, *by_map, *direct, missed.len(), *others];
        row.extend(counts.map(|count| Cell::Integer(count as i64)));
        table.push(row);
    }
    Ok(table)
}
