//! `grazemap locate`: the grazing orbit.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{grazing_orbit, prepare};
use grazemap::report::{OrbitDocument, ReportError, to_dense_json};

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let loaded = prepare(options)?;
    let orbit = grazing_orbit(&loaded.scene)?;
    let document = OrbitDocument::new(&loaded.scene, &orbit);
    let results = Results::named("orbit", text(&document)?, to_dense_json(&document)?, None);
    results.deliver("locate", &options.common)
}

/// The orbit as a person reads it.
fn text(document: &OrbitDocument) -> Result<String, ReportError> {
    let table = document.point_table()?.to_text();
    let surfaces: Vec<String> = document
        .surfaces()
        .iter()
        .map(|surface| format!("`{surface}`"))
        .collect();
    let mut text = format!(
        "grazing orbit of `{}` at {}\nsection: {}\n\n{table}",
        document.scene,
        surfaces.join(", then "),
        document.section.words()
    );
    if document.passages.len() > 1 {
        let passages = document.passages_table()?.to_text();
        let conditions = document.conditions_table()?.to_text();
        text.push_str(&format!(
            "\npassages of a period\n\n{passages}\nxi_n from passage to passage\n\n{conditions}"
        ));
    }
    if let Some(clearance) = document.clearance.filter(|clearance| *clearance < 0.0) {
        text.push_str(&format!(
            "\nwarning: the orbit penetrates a surface elsewhere: h = {clearance:.6e}\n"
        ));
    }
    Ok(text)
}
