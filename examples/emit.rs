//! A map as a crate of Rust without dependencies, written into a folder:
//! `cargo run --example emit`.
//!
//! A program that depends on the crate steps the map with
//! `linear::step(&state, &parameters, &mut image)`; the header of `src/linear.rs` states its window
//! and its measured error.

use grazemap::prelude::*;

fn main() -> Result<(), Error> {
    let folder = std::env::temp_dir().join("grazemap-linear");
    Scene::of_catalogue("linear")?.graze()?.map()?.emit(&folder)?;
    println!("written into {}", folder.display());
    Ok(())
}
