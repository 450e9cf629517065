//! What happens at a graze, in words: what theory says, and beside it what was measured.

use serde::Serialize;

use super::number::significant;
use super::{Cell, Column, ReportError, Table};
use crate::analysis::MeasuredSide;
use crate::iteration::{OrbitEnd, Period};
use crate::orbit::{Expectation, GrazeTheory, OneContactOrbit, Route};

/// What theory says of a graze and what was measured there.
#[derive(Clone, Debug, Serialize)]
pub struct GrazeStudy {
    /// The theory.
    pub theory: GrazeTheory,
    /// What was measured; none without a map.
    pub measured: Vec<MeasuredSide>,
}

impl GrazeStudy {
    /// What is said, a sentence or two each.
    pub fn words(&self) -> Vec<String> {
        let mut words = vec![self.sides(), self.expectation()];
        words.extend(self.measured.iter().map(measured_words));
        words.extend(self.differences());
        words
    }

    /// The one-contact orbits of the theory as a table; `None` where it has none.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn orbits_table(&self) -> Result<Option<Table>, ReportError> {
        if self.theory.orbits.is_empty() {
            return Ok(None);
        }
        let unstable = format!("unstable within ({})", self.theory.parameter);
        let mut table = Table::new(vec![
            Column::number("one contact in n"),
            Column::number("xi_n"),
            Column::text("exists"),
            Column::number(unstable),
        ]);
        for orbit in &self.theory.orbits {
            table.push(vec![
                Cell::Integer(orbit.returns as i64),
                Cell::number(orbit.xi, 6),
                Cell::text(if orbit.sum > 0.0 { "with contact" } else { "before contact" }),
                Cell::number(orbit.unstable_within, 3),
            ])?;
        }
        Ok(Some(table))
    }

    /// On which side contact begins.
    fn sides(&self) -> String {
        let theory = &self.theory;
        let parameter = &theory.parameter;
        if !theory.gap_slope.is_finite() {
            return "several passages graze: which side has contact is not one number".to_owned();
        }
        let side = if theory.gap_slope < 0.0 { "above" } else { "below" };
        format!(
            "contact begins {side} the grazing value of {parameter}: the lowest gap changes by \
             {:.6} per unit of it",
            theory.gap_slope
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
            Expectation::NoContact => {
                "theory: contact and free flight do not differ at the graze: nothing happens"
                    .to_owned()
            }
            Expectation::Finite => match theory.contact_power {
                Some(2) => "theory: the contact begins with y²: the multipliers jump by a finite \
                            amount at the graze, as at a corner"
                    .to_owned(),
                power => format!(
                    "theory: the contact begins with y^{}: the multipliers are continuous at the \
                     graze, and the orbit keeps its stability there",
                    power.unwrap_or(0)
                ),
            },
            Expectation::Jump { n } => format!(
                "theory: xi_{n} is negative: the attractor near the graze is lost, and the motion \
                 jumps to another one (discontinuous grazing bifurcation)"
            ),
            Expectation::Persists { route } => format!(
                "theory: all xi_n are positive: an attractor near the graze persists (continuous \
                 grazing bifurcation){}",
                route.map_or("", |route| match route {
                    Route::PeriodAdding => {
                        "; period adding, windows of neighbouring periods overlap (the largest \
                         multiplier is below 1/4)"
                    }
                    Route::PeriodAddingWithChaos => {
                        "; period adding with chaos between the windows (the largest multiplier is \
                         between 1/4 and 2/3)"
                    }
                    Route::Chaos => {
                        "; chaos at once (the largest multiplier is above 2/3)"
                    }
                })
            ),
        }
    }

    /// Where theory and measurement differ, or where both are past what the theory says of the
    /// graze itself.
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

    /// The shortest one-contact orbit that is stable at an offset on the side of contact.
    fn stable_at(&self, offset: f64) -> Option<&OneContactOrbit> {
        let mut orbits = self.theory.orbits.iter();
        orbits.find(|orbit| orbit.sum > 0.0 && orbit.unstable_within < offset.abs())
    }
}

fn measured_words(side: &MeasuredSide) -> String {
    let offset = significant(side.offset, 4);
    if side.end != OrbitEnd::Completed {
        return format!("measured at the offset {offset}: the orbit escapes");
    }
    let orbit = side.orbit.as_ref().map_or_else(String::new, |name| format!(", orbit {name}"));
    let contact = if side.contact { "with contact" } else { "without contact" };
    let what = match side.period {
        Period::Periodic(period) => format!("period {period} {contact}{orbit}"),
        Period::NotFound => {
            let exponent = side.lyapunov.map_or_else(String::new, |exponent| {
                format!(", largest exponent {exponent:.4} per return")
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

    /// A graze that jumps, whose orbit with one contact in two returns is stable from an offset on.
    fn study(offset: f64) -> GrazeStudy {
        let orbit = OneContactOrbit { returns: 2, xi: 1.0, sum: 1.0, unstable_within: 1e-6 };
        let side = MeasuredSide {
            offset,
            period: Period::Periodic(2),
            contact: true,
            near: true,
            size: 1e-3,
            lyapunov: None,
            orbit: None,
            end: OrbitEnd::Completed,
        };
        GrazeStudy {
            theory: GrazeTheory {
                contact_power: Some(1),
                largest_multiplier: 0.1,
                xi: vec![1.0, 1.0, -1e-5],
                parameter: "p".to_owned(),
                gap_slope: -1.0,
                orbits: vec![orbit],
                expectation: Expectation::Jump { n: 3 },
            },
            measured: vec![side],
        }
    }

    #[test]
    fn an_orbit_that_theory_has_stable_at_an_offset_is_no_difference() {
        let words = study(1e-5).differences().join("");
        assert!(words.contains("one contact in 2 is stable"), "{words}");
        let words = study(1e-7).differences().join("");
        assert!(words.contains("theory and measurement differ"), "{words}");
    }
}
