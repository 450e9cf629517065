//! Choice of a section as data, with its reason; choice of a map as text, with its validity and
//! accuracy.

use serde::{Deserialize, Serialize};

use super::Named;
use super::table::significant;
use crate::convergence::{
    Choice, ConvergenceStudy, DepthAccuracy, LeastOrders, Limit, Monomials, Polynomials,
    SectionChoice, SectionVerdict, Validity,
};
use crate::expansion::SectionKind;
use crate::model::{Scene, SectionRule, Shape};
use crate::numeric::FloatFormat;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Section, its coordinates, and the point of the orbit on it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SectionDocument {
    /// `tangency` or `stroboscopic`.
    pub kind: SectionKind,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Section point of the orbit, one value per coordinate.
    pub point: Vec<f64>,
    /// Rule of the section: named by the scene, or any section (not chosen yet).
    #[serde(default, skip_serializing_if = "is_named")]
    pub rule: SectionRule,
    /// Reason for the section, if the scene allows any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decided: Option<SectionDecision>,
}

/// Reason for a section where the scene allows any.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionDecision {
    /// Tolerance that maps were chosen for.
    pub tolerance: f64,
    /// Half-widths of the coordinates on the chosen section, transported there by the free flow
    /// from the scene's window.
    pub window: Named<Option<f64>>,
    /// Chosen section.
    pub taken: SectionCost,
    /// Other sections.
    pub others: Vec<SectionCost>,
}

/// Cost of the cheapest map on a section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionCost {
    /// Time of a stroboscopic section before the first passage, as a share of the period; `None`
    /// for the tangency section.
    pub ahead: Option<f64>,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Degree of `P_smooth` and weighted degree of `D`.
    pub orders: Option<[u32; 2]>,
    /// Operations of a step, if the map meets the tolerance.
    pub operations: Option<usize>,
    /// Largest error of the map.
    pub error: Option<f64>,
    /// Reason why there is no map.
    pub problem: Option<String>,
}

impl SectionDocument {
    /// Section of an orbit, with the reason for its choice.
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

    /// Reason for the section, as a line of text; empty if the scene names the section.
    pub fn decision_line(&self) -> String {
        let decided = self.decided.as_ref();
        decided.map_or_else(String::new, |decided| decided.words() + "\n")
    }

    /// Section and phase, as text.
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
    /// Decision for a scene that allows any section.
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

    /// Chosen section and reason, as text.
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
    /// Cost of a section's chosen map.
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

    /// Name of a section and its cheapest map, as text.
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

/// Name of a shape.
pub(super) fn shape_word(shape: Shape) -> &'static str {
    match shape {
        Shape::Auto => "auto",
        Shape::Factored => "factored",
        Shape::Composed => "composed",
        Shape::Flown => "flown",
    }
}

/// Chosen map, as text.
pub fn chosen_words(study: &ConvergenceStudy) -> String {
    let chosen = &study.chosen;
    let orders = format!("{}, {}", chosen.orders, shape_word(chosen.shape));
    let weights = chosen.weights.iter();
    let weights: String =
        weights.map(|(name, weight)| format!(", weight {weight} of {name}")).collect();
    let dropped = match chosen.monomials {
        Monomials::All => "",
        Monomials::Needed => ", without the monomials the tolerance does not need",
    };
    let fitted = match chosen.polynomials {
        Polynomials::Taylor => "",
        Polynomials::Economised => ", its coefficients fitted to a map of higher orders",
    };
    let numbers = match chosen.precision {
        FloatFormat::F32 => ", in single precision",
        FloatFormat::F64 => "",
    };
    let map = format!(
        "(N, W) = {orders}{weights}{fitted}{dropped}{numbers} ({} coefficients)",
        chosen.coefficients
    );
    let error = |value: Option<f64>| {
        value.map_or("no finite error".to_owned(), |value| format!("{value:.2e}"))
    };
    let sample = error(chosen.error);
    let fresh = match chosen.fresh_points {
        0 => String::new(),
        points => format!(", {} on {points} fresh points", error(chosen.fresh_error)),
    };
    let tolerance = chosen.tolerance;
    if chosen.met {
        format!(
            "The cheapest map within {tolerance:.0e} has the orders {map}: largest error {sample} \
                on the sample{fresh}.{}{}",
            least_orders_words(chosen),
            single_precision_words(chosen)
        )
    } else {
        format!(
            "No map tried stays within {tolerance:.0e} of direct simulation on the window{}; the \
                most accurate has the orders {map}: largest error {sample} on the sample{fresh}.",
            chosen.limit.map_or(String::new(), |limit| format!(
                " ({})",
                limit_words(limit, chosen.precision)
            ))
        )
    }
}

/// Costs of maps on other sections for the same tolerance, as text; empty if none were chosen.
pub fn sections_words(study: &ConvergenceStudy) -> String {
    if study.sections.is_empty() {
        return String::new();
    }
    let others = study.sections.iter();
    let others: Vec<String> = others.map(|other| SectionCost::of(other).words()).collect();
    let own = Some(&study.chosen).filter(|chosen| chosen.met);
    let own = own.map_or(usize::MAX, |chosen| chosen.operations);
    let cheapest = study.sections.iter().filter_map(SectionChoice::operations);
    let verdict = match cheapest.min() {
        Some(least) if least < own => "another section is cheaper",
        _ => "no other section is cheaper",
    };
    format!(
        "Operations of a step on other sections for the same tolerance on the same orbits, beside \
            {}: {}; {verdict}.",
        study.chosen.operations,
        others.join("; ")
    )
}

/// Least orders of a choice and the reason for them, as text; empty if there are none.
pub fn least_orders_words(chosen: &Choice) -> String {
    let because = |least: LeastOrders| {
        format!(
            " The least orders are {} because xi_1 is near 0 on the window: a contact of depth \
                y^2 moves the next depth by {:.1e} y (to within {:.1e} over the parameters) and \
                {:.1e} y^2, y being at most {:.1e}; a choice has that to a hundredth near the \
                graze, to a tenth at the window's edge.",
            least.orders, least.linear, least.spread, least.quadratic, least.largest
        )
    };
    chosen.least_orders.map_or(String::new(), because)
}

/// Whether single precision suffices, as text; empty if that was not measured.
fn single_precision_words(chosen: &Choice) -> String {
    let Some(error) = chosen.single_precision_error else {
        return String::new();
    };
    let would = if error <= chosen.tolerance { "would" } else { "would not" };
    format!(" In single precision its largest error is {error:.2e}: f32 {would} do.")
}

/// Cause that keeps maps from meeting a tolerance, as text.
pub fn limit_words(limit: Limit, precision: FloatFormat) -> &'static str {
    match (limit, precision) {
        (Limit::Orders, _) => "the highest orders expanded leave out more",
        (Limit::Radius, _) => "the window reaches to where the series cease to converge",
        (Limit::Rounding, FloatFormat::F64) => "rounding in double precision is more",
        (Limit::Rounding, FloatFormat::F32) => "rounding in single precision is more",
    }
}

/// Range of validity of the chosen map, as text.
pub fn validity_words(validity: &Validity) -> String {
    let tolerance = validity.tolerance;
    match (validity.scale, validity.depth) {
        (Some(scale), Some(depth)) => format!(
            "It stays within {tolerance:.0e} on {} times the scene's window; with the half-widths \
                of that, to the depth {depth:.2e}.",
            significant(scale, 3)
        ),
        _ => format!("It stays within {tolerance:.0e} on no window, however small."),
    }
}

/// Depths at which the chosen map is more accurate than direct simulation in double precision, as
/// text.
pub fn accuracy_words(accuracy: &DepthAccuracy) -> String {
    match accuracy.crossing {
        Some(depth) => format!(
            "In windows of a depth below {depth:.1e} it is more accurate than direct simulation \
                in double precision."
        ),
        None => {
            "In no window measured is it more accurate than direct simulation in double precision."
                .to_owned()
        }
    }
}
