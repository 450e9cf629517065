//! The section of a map as data, and what decided it where any section would do.

use serde::{Deserialize, Serialize};

use super::Named;
use crate::convergence::{SectionChoice, SectionVerdict};
use crate::expansion::SectionKind;
use crate::model::{Scene, SectionRule};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// A section, its coordinates, and where the orbit meets it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SectionDocument {
    /// `tangency` or `stroboscopic`.
    pub kind: SectionKind,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Where the orbit meets the section, one value per coordinate.
    pub point: Vec<f64>,
    /// Whether it is the scene's own or, until one is taken, any.
    #[serde(default, skip_serializing_if = "is_named")]
    pub rule: SectionRule,
    /// What decided it, where the scene takes any section.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decided: Option<SectionDecision>,
}

/// What decided a section where any would do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionDecision {
    /// The tolerance that maps were chosen for.
    pub tolerance: f64,
    /// Half-widths of its coordinates on the section taken: what the free flow makes of the
    /// scene's window.
    pub window: Named<Option<f64>>,
    /// The section taken.
    pub taken: SectionCost,
    /// The others.
    pub others: Vec<SectionCost>,
}

/// What the cheapest map of a section costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionCost {
    /// How long before the first passage a stroboscopic section is, over the period; `None` for
    /// the tangency section.
    pub ahead: Option<f64>,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Degree of `P_smooth` and weighted degree of `D`.
    pub orders: Option<[u32; 2]>,
    /// Operations of a step, where the map meets the tolerance.
    pub operations: Option<usize>,
    /// Its largest error.
    pub error: Option<f64>,
    /// Why there is no map.
    pub problem: Option<String>,
}

impl SectionDocument {
    /// The section of an orbit, with what decided it.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit, verdict: Option<&SectionVerdict>) -> Self {
        let (kind, phase) = match orbit.section.kind {
            PoincareSectionKind::Tangency => (SectionKind::Tangency, None),
            PoincareSectionKind::Stroboscopic { phase } => {
                (SectionKind::Stroboscopic, Some(phase.to_f64()))
            }
        };
        let (coordinates, point) = orbit
            .section_coordinates(scene)
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value.to_f64()))
            .unzip();
        Self {
            kind,
            phase,
            coordinates,
            point,
            rule: scene.section_rule,
            decided: verdict.and_then(|verdict| SectionDecision::of(scene, orbit, verdict)),
        }
    }

    /// What decided the section, as a line of words; nothing where the scene names it.
    pub fn decision_line(&self) -> String {
        let decided = self.decided.as_ref();
        decided.map_or_else(String::new, |decided| decided.words() + "\n")
    }

    /// Section and phase in words.
    pub fn words(&self) -> String {
        let coordinates = self.coordinates.join(", ");
        let open = match self.rule {
            SectionRule::Named => "",
            SectionRule::Any => "; that of a map, which may be any, is decided when one is made",
        };
        match self.phase {
            None => {
                format!("tangency section h' = 0 at the graze; coordinates {coordinates}{open}")
            }
            Some(phase) => {
                format!(
                    "stroboscopic section at the phase {phase:.6}; coordinates {coordinates}{open}"
                )
            }
        }
    }
}

fn is_named(rule: &SectionRule) -> bool {
    *rule == SectionRule::Named
}

impl SectionDecision {
    /// Of a scene that takes any section.
    fn of(scene: &Scene, orbit: &GrazingOrbit, verdict: &SectionVerdict) -> Option<Self> {
        let tolerance = verdict.taken.choice.as_ref()?.tolerance;
        let section = &orbit.section;
        let names = section.coordinate_names(&scene.model).into_iter();
        let widths = section.coordinates.iter();
        let widths = widths.map(|&component| scene.window.state[component]);
        let finite = widths.map(|width| Some(width).filter(|width| width.is_finite()));
        Some(Self {
            tolerance,
            window: Named::new(names.zip(finite)),
            taken: SectionCost::of(&verdict.taken),
            others: verdict.others.iter().map(SectionCost::of).collect(),
        })
    }

    /// Which section was taken, and why, in words.
    pub fn words(&self) -> String {
        let (taken, tolerance) = (self.taken.words(), self.tolerance);
        let others: Vec<String> = self.others.iter().map(SectionCost::words).collect();
        let others = match others.is_empty() {
            true => "an autonomous system has no other".to_owned(),
            false => format!("others: {}", others.join("; ")),
        };
        let phase = self.taken.phase;
        let phase = phase.map_or_else(String::new, |phase| format!(", at the phase {phase:.6}"));
        match self.taken.operations {
            Some(_) => format!(
                "section with the fewest operations of a step within {tolerance:.0e}: \
                    {taken}{phase}; {others}"
            ),
            None => {
                format!("no section has a map within {tolerance:.0e}: {taken}{phase}; {others}")
            }
        }
    }
}

impl SectionCost {
    /// Of a choice.
    pub(super) fn of(section: &SectionChoice) -> Self {
        let choice = section.choice.as_ref();
        Self {
            ahead: section.ahead,
            phase: section.phase,
            orders: choice.map(|choice| [choice.orders.smooth_order, choice.orders.contact_weight]),
            operations: section.operations(),
            error: choice.and_then(|choice| choice.fresh_error.or(choice.error)),
            problem: section.problem.clone(),
        }
    }

    /// A section by name, and its cheapest map.
    pub(super) fn words(&self) -> String {
        let name = match self.ahead {
            None => "tangency".to_owned(),
            Some(0.0) => "stroboscopic at the graze".to_owned(),
            Some(ahead) => format!("stroboscopic {ahead} of a period before it"),
        };
        match (self.orders, self.operations) {
            (Some([n, w]), Some(operations)) => format!("{name} {operations} with ({n}, {w})"),
            (Some(_), None) => {
                let error = self.error.map(|error| format!("{error:.1e}"));
                let error = error.unwrap_or_else(|| "no finite error".to_owned());
                format!("{name} not met ({error})")
            }
            (None, _) => format!("{name} none ({})", self.problem.as_deref().unwrap_or("no map")),
        }
    }
}
