//! Grazing orbit by names: the fields of `locate --json`. Also the bifurcation at the graze as
//! text: predicted by theory and, if measured, by simulation.

use serde::Serialize;

use super::table::{digits_needed, significant};
use super::{Cell, Column, Named, SectionDocument, Table};
use crate::analysis::MeasuredSide;
use crate::iteration::{OrbitEnd, Period};
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{
    AttractorRoute, Expectation, GrazeTheory, GrazingConditions, GrazingOrbit, GrazingPoint,
    OneContactOrbit, Unfolding,
};

/// Grazing orbit by the names of parameters and states, rounded to doubles.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitListing {
    /// Surface of the first grazing passage.
    pub surface: String,
    /// All parameters of the grazing orbit.
    pub parameters: Named<f64>,
    /// Full state at the first grazing point.
    pub state: Named<f64>,
    /// Period of the orbit, in time.
    pub period: f64,
    /// `h''` at the first grazing point.
    pub normal_acceleration: f64,
    /// The section.
    pub section: SectionDocument,
    /// Jacobian of `P_smooth` on the section's coordinates, by rows.
    pub monodromy: Vec<Vec<f64>>,
    /// Eigenvalues of the monodromy, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, ...` from the first passage to itself.
    pub xi: Vec<f64>,
    /// Grazing passages of a period, in order.
    pub passages: Vec<PassageListing>,
    /// Hits of a period, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hits: Vec<HitListing>,
    /// `xi_n` from every passage to every passage.
    pub conditions: Vec<ConditionsListing>,
    /// Largest residual of the equations of the orbit.
    pub residual: f64,
    /// Smallest other minimum of any event function on the orbit; negative if the orbit penetrates
    /// a surface.
    pub clearance: Option<f64>,
    /// First adjusted parameter at the other grazes found by the search.
    pub other_grazes: Vec<f64>,
}

/// Grazing passage.
#[derive(Clone, Debug, Serialize)]
pub struct PassageListing {
    /// Name of the surface.
    pub surface: String,
    /// Time since the first passage.
    pub time: f64,
    /// Full state.
    pub state: Named<f64>,
    /// `h''`.
    pub normal_acceleration: f64,
}

/// Hit of a grazing orbit.
#[derive(Clone, Debug, Serialize)]
pub struct HitListing {
    /// Name of the surface.
    pub surface: String,
    /// Time since the first grazing passage.
    pub time: f64,
    /// Full state just before the hit.
    pub state: Named<f64>,
    /// Normal velocity `|h'|`.
    pub speed: f64,
    /// Whether the orbit comes to rest against the surface.
    pub rests: bool,
}

/// Conditions from one passage to another.
#[derive(Clone, Debug, Serialize)]
pub struct ConditionsListing {
    /// Index of the passage that stretches, from 0.
    pub from: usize,
    /// Index of the passage whose gap is affected, from 0.
    pub to: usize,
    /// Names of their surfaces.
    pub surfaces: [String; 2],
    /// `xi_1, xi_2, ...`; empty if the contact does not differ from free flight.
    pub values: Vec<f64>,
}

impl ConditionsListing {
    /// Conditions between two passages of a scene's orbit.
    pub(super) fn new(scene: &Scene, from: usize, to: usize, values: Vec<f64>) -> Self {
        let surfaces = [from, to].map(|passage| surface_of(scene, passage));
        Self { from, to, surfaces, values }
    }
}

impl OrbitListing {
    /// Listing of a scene's orbit.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let graze = orbit.grazing_point();
        let round = |values: &[Dd]| values.iter().map(|value| value.to_f64()).collect::<Vec<f64>>();
        Self {
            surface: scene.model.surfaces[graze.surface].name.clone(),
            parameters: parameters(scene, graze),
            state: state(scene, &graze.state),
            period: orbit.period.to_f64(),
            normal_acceleration: graze.normal_acceleration.to_f64(),
            section: SectionDocument::new(scene, orbit, None),
            monodromy: orbit.monodromy.iter().map(|row| round(row)).collect(),
            multipliers: orbit.multipliers.clone(),
            xi: round(&orbit.xi),
            passages: orbit
                .passages
                .iter()
                .map(|graze| PassageListing {
                    surface: scene.model.surfaces[graze.surface].name.clone(),
                    time: graze.time.to_f64(),
                    state: state(scene, &graze.state),
                    normal_acceleration: graze.normal_acceleration.to_f64(),
                })
                .collect(),
            hits: orbit
                .hits
                .iter()
                .map(|hit| HitListing {
                    surface: scene.model.surfaces[hit.surface].name.clone(),
                    time: hit.time.to_f64(),
                    state: state(scene, &hit.state),
                    speed: hit.speed.to_f64(),
                    rests: hit.rests,
                })
                .collect(),
            conditions: orbit
                .conditions
                .iter()
                .map(|GrazingConditions { from, to, values }| {
                    ConditionsListing::new(scene, *from, *to, round(values))
                })
                .collect(),
            residual: orbit.residual,
            clearance: orbit.clearance,
            other_grazes: orbit.other_grazes.clone(),
        }
    }

    /// Largest value that is zero to rounding.
    fn zero(&self) -> f64 {
        let scale = self.state.0.iter().fold(1.0, |scale: f64, (_, value)| scale.max(value.abs()));
        scale * (1e3 * self.residual).max(1e-28)
    }

    /// Table of parameters and grazing point, in up to 16 digits; zeros to rounding are 0.
    pub fn point_table(&self) -> Table {
        let zero = self.zero();
        let mut quantities: Vec<(String, f64)> =
            self.parameters.0.iter().chain(&self.state.0).cloned().collect();
        quantities.push(("period".to_owned(), self.period));
        quantities.push(("h''".to_owned(), self.normal_acceleration));
        for (number, [re, im]) in self.multipliers.iter().enumerate() {
            quantities.push((format!("multiplier {}", number + 1), *re));
            if *im != 0.0 {
                quantities.push(("  imaginary part".to_owned(), *im));
            }
        }
        let xi = self.xi.iter().enumerate();
        quantities.extend(xi.map(|(number, xi)| (format!("xi_{}", number + 1), *xi)));
        let shown = |value: f64| {
            let value = if value.abs() <= zero { 0.0 } else { value };
            Cell::number(value, digits_needed(value, 16))
        };
        let residual = ("residual", Cell::number(self.residual, 3));
        let rows: Vec<(&str, Cell)> = (quantities.iter())
            .map(|(name, value)| (name.as_str(), shown(*value)))
            .chain([residual])
            .collect();
        Table::of(&rows)
            .text("quantity", |(name, _)| *name)
            .column(Column::number("value"), |(_, value)| value.clone())
            .made()
    }

    /// Grazing point, period, multipliers and first conditions as a table, in ten digits; zeros to
    /// rounding are 0.
    pub fn summary_table(&self) -> Table {
        /// Conditions listed.
        const FIRST: usize = 3;
        const DIGITS: usize = 10;
        let zero = self.zero();
        let shown = |value: f64| {
            let value = if value.abs() <= zero { 0.0 } else { value };
            significant(value, DIGITS)
        };
        let state = self.state.0.iter();
        let mut rows: Vec<(String, String)> =
            state.map(|(name, value)| (name.clone(), shown(*value))).collect();
        rows.push(("period".to_owned(), shown(self.period)));
        rows.push(("h''".to_owned(), shown(self.normal_acceleration)));
        for (number, &[re, im]) in self.multipliers.iter().enumerate() {
            let sign = if im < 0.0 { "-" } else { "+" };
            let imaginary = match im == 0.0 {
                true => String::new(),
                false => format!(" {sign} {}i", shown(im.abs())),
            };
            rows.push((format!("multiplier {}", number + 1), shown(re) + &imaginary));
        }
        let xi = self.xi.iter().take(FIRST).enumerate();
        rows.extend(xi.map(|(number, xi)| (format!("xi_{}", number + 1), shown(*xi))));
        Table::of(&rows).text("quantity", |(name, _)| name).text("value", |(_, value)| value).made()
    }

    /// Surfaces of the grazing passages, in order.
    pub fn surfaces(&self) -> Vec<&str> {
        let passages = self.passages.iter();
        passages.map(|passage| passage.surface.as_str()).collect()
    }

    /// Table of the passages, one row each.
    pub fn passages_table(&self) -> Table {
        let names = self.state.0.iter().map(|(name, _)| name);
        Table::of(self.passages.iter().enumerate())
            .text("passage", |(number, _)| (number + 1).to_string())
            .text("surface", |(_, passage)| &passage.surface)
            .number("time", 12, |(_, passage)| passage.time)
            .numbers(names, 12, |(_, passage), place| passage.state.0[place].1)
            .number("h''", 12, |(_, passage)| passage.normal_acceleration)
            .made()
    }

    /// Table of the hits, one row each; `None` if the orbit does not hit.
    pub fn hits_table(&self) -> Option<Table> {
        if self.hits.is_empty() {
            return None;
        }
        let mut table = Table::of(&self.hits).text("hit", |hit| hit.surface.clone()).number(
            "time",
            10,
            |hit| hit.time,
        );
        for (place, (name, _)) in self.state.0.iter().enumerate() {
            table = table.number(name, 10, move |hit| hit.state.0[place].1);
        }
        table = table.number("speed", 10, |hit| hit.speed);
        if self.hits.iter().any(|hit| hit.rests) {
            table = table.text("rests", |hit| if hit.rests { "yes" } else { "no" });
        }
        Some(table.made())
    }

    /// Table of the conditions: one row per pair of passages, one column per `n`.
    pub fn conditions_table(&self) -> Table {
        let felt = || self.conditions.iter().filter(|pair| !pair.values.is_empty());
        let count = felt().map(|pair| pair.values.len()).max().unwrap_or(0);
        let end = |passage: usize, surface: &str| format!("{} {surface}", passage + 1);
        Table::of(felt())
            .text("from", |pair| end(pair.from, &pair.surfaces[0]))
            .text("to", |pair| end(pair.to, &pair.surfaces[1]))
            .numbers((1..=count).map(|n| format!("xi_{n}")), 9, |pair, place| pair.values[place])
            .made()
    }
}

/// Name of the surface of a passage of a scene's orbit.
pub(super) fn surface_of(scene: &Scene, passage: usize) -> String {
    let surface = scene.grazing.passages[passage];
    scene.model.surfaces[surface].name.clone()
}

fn parameters(scene: &Scene, graze: &GrazingPoint) -> Named<f64> {
    let names = scene.model.parameters.iter();
    let names = names.map(|parameter| parameter.name.as_str());
    Named::new(names.zip(graze.parameters.iter().map(|value| value.to_f64())))
}

fn state(scene: &Scene, state: &[Dd]) -> Named<f64> {
    let names = scene.model.full_state_names().into_iter();
    Named::new(names.zip(state.iter().map(|value| value.to_f64())))
}

/// Prediction of theory for a graze, with measurements.
#[derive(Clone, Debug, Serialize)]
pub struct GrazeStudy {
    /// Theory.
    pub theory: GrazeTheory,
    /// Measurements; empty without a map.
    pub measured: Vec<MeasuredSide>,
}

/// Digits of the slope of a gap in words; a slope smaller than `SMALL_SLOPE` has so many that are
/// significant, others so many decimals.
const SLOPE_DIGITS: usize = 6;
const SMALL_SLOPE: f64 = 1e-3;

/// Consequence of a discontinuous grazing bifurcation.
const LOST: &str = "the attractor near the graze is lost, and the motion jumps to another one";
/// Consequence of a continuous grazing bifurcation.
const PERSISTS: &str = "an attractor near the graze persists";

impl GrazeStudy {
    /// Prediction and measurements as text, one or two sentences per item.
    pub fn words(&self) -> Vec<String> {
        let mut words = vec![self.sides(), self.expectation()];
        words.extend(self.measured.iter().map(measured_words));
        words.extend(self.differences());
        words
    }

    /// Prediction, and where measurements differ from it, as text.
    pub fn theory_words(&self) -> Vec<String> {
        [self.sides(), self.expectation()].into_iter().chain(self.differences()).collect()
    }

    /// Prediction as a clause: the side of contact, and what follows there.
    pub fn verdict(&self) -> String {
        let differs = match self.differences().iter().any(|words| words.contains("differ")) {
            true => "; what was measured differs, as said below",
            false => "",
        };
        let consequence = self.consequence();
        match self.side() {
            Some(side) => format!("contact begins {side} it, and {consequence}{differs}"),
            None => format!("{consequence}{differs}"),
        }
    }

    /// Instability of the orbit, in words, where the prediction is not that already.
    pub fn instability(&self) -> Option<String> {
        let theory = &self.theory;
        (theory.is_unstable() && theory.expectation != Expectation::Unstable).then(|| {
            format!(
                "the orbit is unstable even without contact: a multiplier has modulus {:.6}",
                theory.largest_multiplier
            )
        })
    }

    /// Table of the measurements; `None` without any.
    pub fn measured_table(&self) -> Option<Table> {
        let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
        let table = Table::of(&self.measured)
            .number("offset", 4, |side| side.offset)
            .text("settles on", |side| match (left_words(side), side.period) {
                (Some(words), _) => words.to_owned(),
                (None, Period::Periodic(period)) => format!("period {period}"),
                (None, Period::NotFound) => "no period".to_owned(),
            })
            .text("contact", |side| if side.contact { "yes" } else { "no" })
            .column(Column::text("orbit"), |side| {
                side.orbit.as_ref().map_or(Cell::Missing, |name| Cell::text(name.to_string()))
            })
            .number("largest exponent", 4, move |side| finite(side.lyapunov))
            .number("±", 2, move |side| finite(side.lyapunov_error))
            .text("where", |side| match (left_words(side), side.near) {
                (Some(_), _) => "",
                (None, true) => "near the graze",
                (None, false) => "away from it",
            });
        (!self.measured.is_empty()).then(|| table.made())
    }

    /// Table of the one-contact orbits of the theory; `None` if it has none.
    pub fn orbits_table(&self) -> Option<Table> {
        if self.theory.orbits.is_empty() {
            return None;
        }
        let unstable = format!("unstable within ({})", self.theory.parameter);
        let exists = |orbit: &OneContactOrbit| match orbit.sum > 0.0 {
            true => "with contact",
            false => "before contact",
        };
        let table = Table::of(&self.theory.orbits)
            .count("one contact in n", |orbit| orbit.returns)
            .number("xi_n", 6, |orbit| orbit.xi)
            .text("exists", exists)
            .number(&unstable, 3, |orbit| orbit.unstable_within);
        Some(table.made())
    }

    /// Side of the graze on which contact begins; `None` for several passages.
    fn side(&self) -> Option<&'static str> {
        let slope = self.theory.gap_slope;
        slope.is_finite().then_some(if slope < 0.0 { "above" } else { "below" })
    }

    /// Consequence of contact, as a clause.
    fn consequence(&self) -> String {
        let route = |route| match route {
            AttractorRoute::PeriodAdding => ": period adding",
            AttractorRoute::PeriodAddingWithChaos => ": period adding with chaos in between",
            AttractorRoute::Chaos => ": chaos at once",
        };
        let words = match self.theory.expectation {
            Expectation::SeveralPassages => {
                "the conditions between the passages that graze decide what follows"
            }
            Expectation::Unstable => {
                "no attractor is born near it, since the orbit is unstable without contact"
            }
            Expectation::Neutral => {
                "theory says nothing of an orbit that is neutral without contact"
            }
            Expectation::Undecided => "to leading order no sign decides what follows",
            Expectation::Displaced { .. } => {
                "an orbit that grazes jumps, since the impact moves a state that only touches"
            }
            Expectation::NoRelease => {
                "theory says nothing of it, since the contact has no release near the graze"
            }
            Expectation::CodimensionTwo { n } => {
                return format!("no sign decides what follows: xi_{n} is zero, codimension two");
            }
            Expectation::Forgotten => {
                "the orbit with contact takes the place of the other: the rest forgets the contact"
            }
            Expectation::NoContact => "nothing happens: contact does not differ from free flight",
            Expectation::Unbounded => {
                "multipliers grow without bound next to the graze, and the orbit with contact is \
                 unstable there"
            }
            Expectation::Finite if self.theory.contact_power == Some(2.0) => {
                "the multipliers of the orbit jump by a finite amount"
            }
            Expectation::Finite => "the orbit keeps its stability",
            Expectation::Jump { .. } => LOST,
            Expectation::Persists { route: own } => {
                return format!("{PERSISTS}{}", own.map_or("", route));
            }
        };
        words.to_owned()
    }

    /// Side of the graze on which contact begins, as text.
    fn sides(&self) -> String {
        let theory = &self.theory;
        let parameter = &theory.parameter;
        let Some(side) = self.side() else {
            return "several passages graze: which side has contact is not one number".to_owned();
        };
        let slope = match theory.gap_slope {
            slope if slope.abs() < SMALL_SLOPE => significant(slope, SLOPE_DIGITS),
            slope => format!("{slope:.SLOPE_DIGITS$}"),
        };
        format!(
            "contact begins {side} the grazing value of {parameter}: the lowest gap changes by \
             {slope} per unit of it"
        )
    }

    fn expectation(&self) -> String {
        let theory = &self.theory;
        let largest = theory.largest_multiplier;
        match theory.expectation {
            Expectation::SeveralPassages => {
                "theory: several passages graze in one return; the conditions between them decide, \
                 and nothing is said here"
                    .to_owned()
            }
            Expectation::Unstable => format!(
                "theory: the orbit is unstable without contact (a multiplier of modulus \
                 {largest:.6}): no attractor is born near it"
            ),
            Expectation::Neutral => format!(
                "theory: the orbit is neutral without contact (a multiplier of modulus \
                 {largest:.6}, 1 to rounding): nothing is said of it"
            ),
            Expectation::Undecided => {
                "theory: every xi_n is zero to rounding, whatever the parameters: to leading order \
                 contact moves the state along the orbit alone, and no sign decides"
                    .to_owned()
            }
            Expectation::CodimensionTwo { n } => self.codimension_two(n),
            Expectation::Forgotten => {
                "theory: the orbit comes to rest against a stop and forgets the contact: the orbit \
                 with contact takes its place, and is as stable"
                    .to_owned()
            }
            Expectation::NoContact => {
                "theory: contact and free flight do not differ at the graze: nothing happens"
                    .to_owned()
            }
            Expectation::Displaced { displacement } => format!(
                "theory: the impact moves a state that touches with zero normal velocity (by \
                 {displacement:.3e}): an orbit that grazes jumps, and there is no map near it"
            ),
            Expectation::NoRelease => {
                "theory: nothing is said, since the contact has no release near the graze: it does \
                 not push back, or it lasts; `expand` says which"
                    .to_owned()
            }
            Expectation::Unbounded => format!(
                "theory: the contact begins with y^{}: multipliers of the orbit with contact grow \
                 without bound next to the graze, more slowly than at a rigid stop, and it is \
                 unstable there",
                theory.contact_power.unwrap_or(0.0)
            ),
            Expectation::Finite => match theory.contact_power {
                Some(2.0) => {
                    "theory: the contact begins with y²: the multipliers jump by a finite \
                            amount at the graze, as at a corner"
                        .to_owned()
                }
                _ => format!(
                    "theory: the contact begins with y^{}: the multipliers are continuous at the \
                     graze, and the orbit keeps its stability there",
                    theory.contact_power.unwrap_or(0.0)
                ),
            },
            Expectation::Jump { n } => {
                format!("theory: xi_{n} is negative: {LOST} (discontinuous grazing bifurcation)")
            }
            Expectation::Persists { route } => format!(
                "theory: all xi_n are positive: {PERSISTS} (continuous grazing bifurcation){}",
                route.map_or("", |route| match route {
                    AttractorRoute::PeriodAdding => {
                        "; period adding, windows of neighbouring periods overlap (the largest \
                         multiplier is below 1/4)"
                    }
                    AttractorRoute::PeriodAddingWithChaos => {
                        "; period adding with chaos between the windows (the largest multiplier is \
                         between 1/4 and 2/3)"
                    }
                    AttractorRoute::Chaos => {
                        "; chaos at once (the largest multiplier is above 2/3)"
                    }
                })
            ),
        }
    }

    /// Condition `xi_n` that is zero, and the parameters that change its sign, as text.
    fn codimension_two(&self, n: usize) -> String {
        let slopes = self.theory.unfolding.iter();
        let slopes =
            slopes.map(|Unfolding { parameter, slope }| format!("{parameter} ({slope:.6})"));
        let slopes: Vec<String> = slopes.collect();
        let unfolded = match slopes.is_empty() {
            true => format!("no other parameter of the model changes xi_{n}"),
            false => format!(
                "it is unfolded by {}: in brackets, how xi_{n} changes per unit along the grazing \
                 curve",
                slopes.join(", ")
            ),
        };
        format!(
            "theory: xi_{n} is zero to rounding ({:.1e} of at most {:.1e}): a grazing bifurcation \
             of codimension two, whose kind no sign decides; {unfolded}",
            self.theory.xi[n - 1],
            self.theory.noise[n - 1]
        )
    }

    /// Differences between theory and measurement, and offsets beyond the range of the theory, as
    /// text.
    fn differences(&self) -> Vec<String> {
        let persists = match self.theory.expectation {
            Expectation::Jump { .. } => false,
            Expectation::Persists { .. } => true,
            _ => return Vec::new(),
        };
        let words = |side: &MeasuredSide| {
            let with_contact = side.offset * self.theory.gap_slope < 0.0;
            let offset = significant(side.offset, 4);
            let differ = format!("theory and measurement differ at the offset {offset}:");
            match (side.near, !with_contact || persists) {
                (true, true) | (false, false) => None,
                (false, true) => Some(format!(
                    "{differ} no attractor near the graze was found where theory has one"
                )),
                (true, false) => Some(match self.stable_at(side.offset) {
                    Some(orbit) => format!(
                        "theory at the offset {offset}: the orbit with one contact in {} is stable \
                         there to leading order; the jump is that of its loss nearer to the graze",
                        orbit.returns
                    ),
                    None => format!(
                        "{differ} an attractor near the graze was found where theory has none"
                    ),
                }),
            }
        };
        self.measured.iter().filter_map(words).collect()
    }

    /// Shortest one-contact orbit that is stable at an offset on the side of contact.
    fn stable_at(&self, offset: f64) -> Option<&OneContactOrbit> {
        let mut orbits = self.theory.orbits.iter();
        orbits.find(|orbit| orbit.sum > 0.0 && orbit.unstable_within < offset.abs())
    }
}

/// Reason why an orbit did not settle, as text.
fn left_words(side: &MeasuredSide) -> Option<&'static str> {
    match side.end {
        OrbitEnd::Completed => None,
        OrbitEnd::Escaped { .. } => Some("the orbit escapes"),
        OrbitEnd::NoImage { .. } => Some("the orbit comes to where there is no image"),
    }
}

fn measured_words(side: &MeasuredSide) -> String {
    let offset = significant(side.offset, 4);
    if let Some(left) = left_words(side) {
        return format!("measured at the offset {offset}: {left}");
    }
    let orbit = side.orbit.as_ref().map_or_else(String::new, |name| format!(", orbit {name}"));
    let contact = if side.contact { "with contact" } else { "without contact" };
    let what = match side.period {
        Period::Periodic(period) => format!("period {period} {contact}{orbit}"),
        Period::NotFound => {
            let exponent = side.lyapunov.map_or_else(String::new, |exponent| {
                let error = side.lyapunov_error.map(|error| format!(" ± {error:.4}"));
                format!(", largest exponent {exponent:.4}{} per return", error.unwrap_or_default())
            });
            format!("no period {contact}{exponent}")
        }
    };
    let near = if side.near { "near the graze" } else { "away from it" };
    format!("measured at the offset {offset}: {what}, {near}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Graze that jumps; its orbit with one contact in two returns is stable from an offset on.
    fn study(offset: f64) -> GrazeStudy {
        let orbit = OneContactOrbit { returns: 2, xi: 1.0, sum: 1.0, unstable_within: 1e-6 };
        let side = MeasuredSide {
            offset,
            period: Period::Periodic(2),
            contact: true,
            near: true,
            size: 1e-3,
            lyapunov: None,
            lyapunov_error: None,
            orbit: None,
            end: OrbitEnd::Completed,
        };
        GrazeStudy {
            theory: GrazeTheory {
                contact_power: Some(1.0),
                largest_multiplier: 0.1,
                xi: vec![1.0, 1.0, -1e-5],
                parameter: "p".to_owned(),
                gap_slope: -1.0,
                orbits: vec![orbit],
                noise: Vec::new(),
                unfolding: Vec::new(),
                expectation: Expectation::Jump { n: 3 },
            },
            measured: vec![side],
        }
    }

    #[test]
    fn a_verdict_is_a_clause_and_says_where_measurement_differs() {
        let lost = "contact begins above it, and the attractor near the graze is lost, and the \
            motion jumps to another one";
        assert_eq!(study(1e-5).verdict(), lost);
        assert_eq!(
            study(1e-7).verdict(),
            format!("{lost}; what was measured differs, as said below")
        );
        let table = study(1e-5).measured_table().expect("one side was measured");
        let line = table.to_text().lines().last().map(str::to_owned);
        let line = line.expect("a row");
        assert!(line.contains("period 2") && line.ends_with("near the graze"), "{line}");
    }

    #[test]
    fn an_orbit_that_theory_has_stable_at_an_offset_is_no_difference() {
        let words = study(1e-5).differences().join("");
        assert!(words.contains("one contact in 2 is stable"), "{words}");
        let words = study(1e-7).differences().join("");
        assert!(words.contains("theory and measurement differ"), "{words}");
    }
}
