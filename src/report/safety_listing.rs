//! Safety of a scene: whether its orbit is clear of the stop, and by how much.

use serde::Serialize;

use super::table::significant;
use super::{Named, Table};

/// Digits of values in words.
const DIGITS: usize = 8;

/// Answer of `safe`.
#[derive(Clone, Debug, Serialize)]
pub struct SafetyListing {
    /// Name of the stop.
    pub surface: String,
    /// Whether the orbit of the free flight is clear of the stop at the scene's values.
    pub clears: bool,
    /// Intervals without contact, one per parameter.
    pub intervals: Vec<SafeInterval>,
    /// Box of tolerances; `None` if none was asked for.
    pub tolerance: Option<ToleranceBox>,
    /// Attractors found by direct simulation at the scene's values, the one with the largest share
    /// first.
    pub attractors: Vec<OtherAttractor>,
    /// Number of starts of direct simulation.
    pub starts: u32,
}

/// Interval of a parameter, about the scene's value, in which no graze was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SafeInterval {
    /// Name of the parameter.
    pub parameter: String,
    /// Value in the scene.
    pub value: f64,
    /// Nearest graze below; `None` if none was found.
    pub below: Option<f64>,
    /// Nearest graze above; `None` if none was found.
    pub above: Option<f64>,
}

/// Box of tolerances.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToleranceBox {
    /// Tolerances relative to the scene's values.
    pub tolerances: Named<f64>,
    /// Number of edges along the first parameter that were looked at: at the corners of the other
    /// parameters, and through the middle.
    pub edges: usize,
    /// Values at which the orbit touches the stop or lies beyond it, one per edge where it does.
    pub touched: Vec<Named<f64>>,
}

/// Attractor at the scene's values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherAttractor {
    /// Name of the orbit, hits and periods; `None` without a period.
    pub orbit: Option<String>,
    /// Share of the starts that come to it.
    pub fraction: f64,
    /// Largest impact speed; `None` without an impact.
    pub impact_speed: Option<f64>,
    /// First start found that comes to it, as offsets from the graze.
    pub start: Named<f64>,
}

impl SafetyListing {
    /// Table of the intervals.
    pub fn table(&self) -> Table {
        Table::of(&self.intervals)
            .text("parameter", |interval| &interval.parameter)
            .number("value", 15, |interval| interval.value)
            .number("graze below", 15, |interval| interval.below)
            .number("graze above", 15, |interval| interval.above)
            .made()
    }

    /// Answer as text.
    pub fn text(&self, scene: &str) -> String {
        let surface = &self.surface;
        let mut text = match self.clears {
            true => {
                format!("`{scene}` is clear of `{surface}`: its periodic orbit does not touch\n")
            }
            false => format!(
                "`{scene}` is not clear of `{surface}`: without the stop its periodic orbit would \
                 go beyond it\n"
            ),
        };
        if let Some(tolerance) = &self.tolerance {
            text.push_str(&tolerance.words(surface));
        }
        let heading = if self.clears { "without contact" } else { "between grazes" };
        text.push_str(&format!(
            "\n{heading}, one parameter at a time:\n\n{}",
            self.table().to_text()
        ));
        text.push_str(
            "an empty cell: no graze was found on that side, along the branch of this orbit\n",
        );
        if !self.attractors.is_empty() {
            text.push_str(&format!(
                "\nattractors at these values, by direct simulation from {} states:\n\n{}",
                self.starts,
                self.attractor_table().to_text()
            ));
        }
        text
    }

    fn attractor_table(&self) -> Table {
        let orbit = |attractor: &OtherAttractor| {
            attractor.orbit.clone().unwrap_or_else(|| "no period".to_owned())
        };
        Table::of(&self.attractors)
            .text(&format!("orbit ({},periods)", self.surface), orbit)
            .number("share of starts", 4, |attractor| attractor.fraction)
            .number("largest impact speed", 6, |attractor| attractor.impact_speed)
            .made()
    }
}

impl ToleranceBox {
    /// Verdict on the box.
    fn words(&self, surface: &str) -> String {
        let pair =
            |(name, share): &(String, f64)| format!("{name} ± {} %", significant(100.0 * share, 3));
        let sizes: Vec<String> = self.tolerances.0.iter().map(pair).collect();
        let sizes = sizes.join(", ");
        let Some(first) = self.touched.first() else {
            return format!(
                "clear in all of {sizes}: no graze on {} edges of the box\n",
                self.edges
            );
        };
        let values = first.0.iter();
        let values =
            values.map(|(name, value)| format!("{name} = {}", significant(*value, DIGITS)));
        format!(
            "not clear in all of {sizes}: it touches `{surface}` at {}; on {} of {} edges of the \
             box\n",
            values.collect::<Vec<_>>().join(", "),
            self.touched.len(),
            self.edges
        )
    }
}
