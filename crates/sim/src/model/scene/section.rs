//! `[section]`: where the map is taken.

use super::document::Table;
use super::{Orders, Section, SectionRule, StroboscopicPhase};
use crate::model::error::{Checked, Fault};
use crate::model::oscillator::Model;
use crate::model::problem::SceneProblem;

/// The kinds of section.
#[derive(Clone, Copy)]
enum Kind {
    Tangency,
    Stroboscopic,
    Any,
}

/// Reads `[section]`; without it, the tangency section.
pub(super) fn read(
    table: Option<&Table<'_>>,
    model: &Model,
    orders: Orders,
) -> Checked<(Section, SectionRule)> {
    let Some(table) = table else {
        return Ok((Section::Tangency, SectionRule::Named));
    };
    table.only(&["kind", "phase"])?;
    let options = [
        ("tangency", Kind::Tangency),
        ("stroboscopic", Kind::Stroboscopic),
        ("any", Kind::Any),
    ];
    let kind = table.require("kind")?;
    let fault = |problem| Err(Fault::at(kind.span(), problem));
    match kind.choice(&options, "\"tangency\", \"stroboscopic\", \"any\"")? {
        Kind::Tangency => Ok((Section::Tangency, SectionRule::Named)),
        Kind::Any => match orders {
            Orders::Tolerance(_) => Ok((Section::Tangency, SectionRule::Any)),
            Orders::Fixed(_) => fault(SceneProblem::AnySectionWithoutTolerance),
        },
        Kind::Stroboscopic if model.phase.is_none() => fault(SceneProblem::NeedsPhase {
            what: "a stroboscopic section",
        }),
        Kind::Stroboscopic => Ok((Section::Stroboscopic(phase(table)?), SectionRule::Named)),
    }
}

/// The phase of a stroboscopic section; that of the graze where none is named.
fn phase(table: &Table<'_>) -> Checked<StroboscopicPhase> {
    let Some(field) = table.field("phase") else {
        return Ok(StroboscopicPhase::Grazing);
    };
    let entry = field.entry("\"grazing\" or an expression of numbers")?;
    if entry.value.as_str() == Some("grazing") {
        return Ok(StroboscopicPhase::Grazing);
    }
    Ok(StroboscopicPhase::At(entry.number()?))
}
