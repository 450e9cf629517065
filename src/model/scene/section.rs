//! `[section]`: where the map is taken.

use super::document::Table;
use super::{Section, StroboscopicPhase};
use crate::model::error::{Checked, Fault};
use crate::model::oscillator::Model;
use crate::model::problem::SceneProblem;

/// The kinds of section.
#[derive(Clone, Copy)]
enum Kind {
    Tangency,
    Stroboscopic,
}

/// Reads `[section]`; without it, the tangency section.
pub(super) fn read(table: Option<&Table<'_>>, model: &Model) -> Checked<Section> {
    let Some(table) = table else {
        return Ok(Section::Tangency);
    };
    table.only(&["kind", "phase"])?;
    let options = [
        ("tangency", Kind::Tangency),
        ("stroboscopic", Kind::Stroboscopic),
    ];
    let kind = table
        .require("kind")?
        .choice(&options, "\"tangency\", \"stroboscopic\"")?;
    match (kind, table.field("phase")) {
        (Kind::Stroboscopic, _) if model.phase.is_none() => Err(Fault::at(
            table.require("kind")?.span(),
            SceneProblem::NeedsPhase {
                what: "a stroboscopic section",
            },
        )),
        (Kind::Tangency, _) => Ok(Section::Tangency),
        (Kind::Stroboscopic, None) => Ok(Section::Stroboscopic(StroboscopicPhase::Grazing)),
        (Kind::Stroboscopic, Some(field)) => {
            let entry = field.entry("\"grazing\" or an expression of numbers")?;
            if entry.value.as_str() == Some("grazing") {
                return Ok(Section::Stroboscopic(StroboscopicPhase::Grazing));
            }
            Ok(Section::Stroboscopic(StroboscopicPhase::At(
                entry.number()?,
            )))
        }
    }
}
