//! A branch of periodic orbits, followed through its graze: `cargo run --example branch`.

use grazemap::analysis::NoProgress;
use grazemap::pipeline::{BranchKeys, OrbitsOf, Position};
use grazemap::prelude::*;

fn main() -> Result<(), Error> {
    let map = Scene::of_catalogue("linear")?.graze()?.map()?;
    let keys = BranchKeys {
        along: "alpha".to_owned(),
        from: Some(Position::Offset(-1e-3)),
        to: Some(Position::Offset(5e-3)),
        itineraries: vec!["1".to_owned()],
        method: OrbitsOf::Map,
        ..BranchKeys::default()
    };
    let branches = map.branches(&keys.request(&map)?, &NoProgress)?;
    println!("{} branches", branches.branches.len());
    print!("{}", keys.answer(&map, &NoProgress)?.text);
    Ok(())
}
