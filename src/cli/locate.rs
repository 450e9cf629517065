//! `grazemap locate`: the grazing orbit.

use super::arguments::SceneOptions;
use super::document::OrbitDocument;
use super::error::CliError;
use super::output::Results;
use super::prepare::{grazing_orbit, prepare};
use crate::report::to_json;

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let loaded = prepare(options)?;
    let orbit = grazing_orbit(&loaded.scene)?;
    let document = OrbitDocument::new(&loaded.scene, &orbit);
    let results = Results::named("orbit", document.text(), to_json(&document)?, None);
    results.deliver("locate", &options.common)
}
