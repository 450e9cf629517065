//! Crate of emitted maps in `generated/`: one map of the catalogue for each shape of emitted code.
//!
//! ```text
//! cargo run --release -p xtask -- generated            # writes the crate
//! cargo run --release -p xtask -- generated --check    # compares it with the emission of today
//! ```

use std::error::Error;

use grazemap::Map;
use grazemap::emission::EmittedCrate;
use grazemap::model::{Scene, catalogue};
use grazemap::pipeline::{EmitRequest, write_emitted};
use grazemap::prelude::*;

use crate::{Outcome, Verdict, root};

/// Scenes of the maps: a series in factored form, for an affine flow and for another; a flown
/// contact; two passages in composed form.
pub const SCENES: [&str; 4] = ["linear", "mems", "soft_b_stiff", "two_stops_t1_rigid"];

/// Command that the headers of the files state.
const COMMAND: &str = "cargo run --release -p xtask -- generated";

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct Generated {
    /// Compare the files with what would be emitted now, and write none
    #[arg(long)]
    check: bool,
}

impl Generated {
    /// Writes the crate, or compares it.
    ///
    /// # Errors
    ///
    /// A scene that cannot be emitted, or a folder that cannot be written.
    pub fn run(&self) -> Outcome {
        let (emitted, folder) = (emitted()?, root().join("generated"));
        if !self.check {
            write_emitted(&emitted, &folder)?;
            println!("{} files in {}", emitted.files.len(), folder.display());
            return Ok(Verdict::Good);
        }
        let differences = emitted.check(&folder);
        differences.iter().for_each(|difference| println!("{difference}"));
        println!("{} files compared, {} differ", emitted.files.len(), differences.len());
        Ok(Verdict::of(differences.len()))
    }
}

/// Map of a scene of the catalogue.
///
/// # Errors
///
/// A name that is not of the catalogue, or a scene without a map.
pub fn map_of(name: &str) -> Result<Map, Box<dyn Error>> {
    let text = catalogue::text(name).ok_or_else(|| format!("no scene `{name}`"))?;
    Ok(Scene::parse(text, name)?.graze()?.map()?)
}

/// Files of the crate, as they are emitted now.
///
/// # Errors
///
/// A scene that cannot be emitted.
pub fn emitted() -> Result<EmittedCrate, Box<dyn Error>> {
    let module = |name: &str| {
        let command = Some(COMMAND.to_owned());
        let request = EmitRequest { derivatives: false, command, ..EmitRequest::default() };
        Ok::<_, Box<dyn Error>>(map_of(name)?.module(request)?)
    };
    let modules = SCENES.iter().copied().map(module).collect::<Result<Vec<_>, _>>()?;
    Ok(EmittedCrate::catalogue(&modules)?)
}
