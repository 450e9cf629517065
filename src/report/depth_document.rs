//! What a contact does along the depth alone, as data: leading laws and the radius of the series in `y`.

use serde::Serialize;

use super::Named;
use super::number::significant;
use crate::expansion::{DepthSeries, LeadingLaw, Variables};

/// The leading laws of `D` and the radius of its series in `y`.
#[derive(Clone, Debug, Serialize)]
pub struct DepthDocument {
    /// Leading term of each coordinate's correction; `null` where none was found.
    pub leading: Named<Option<LeadingTerm>>,
    /// Estimated radius of convergence in `y`; `null` where the series ends.
    pub radius: Option<f64>,
}

/// The leading term `coefficient · y^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LeadingTerm {
    /// Power of `y`.
    pub exponent: u32,
    /// Its coefficient.
    pub coefficient: f64,
}

impl From<LeadingLaw> for LeadingTerm {
    fn from(law: LeadingLaw) -> Self {
        Self {
            exponent: law.exponent,
            coefficient: law.coefficient.hi,
        }
    }
}

impl DepthDocument {
    /// The laws of a series, by the names of its coordinates.
    pub fn new(variables: &Variables, series: &DepthSeries) -> Self {
        let names = variables.names[..variables.coordinates].iter().enumerate();
        let leading = names.map(|(coordinate, name)| {
            let law = series.leading_law(coordinate);
            (name.as_str(), law.map(LeadingTerm::from))
        });
        Self {
            leading: Named::new(leading),
            radius: series.radius(),
        }
    }

    /// One line per coordinate, and one for the radius.
    pub fn words(&self) -> String {
        let mut text = String::new();
        for (name, law) in &self.leading.0 {
            let law = law.map_or("none found".to_owned(), |law| {
                let coefficient = significant(law.coefficient, 7);
                format!("{coefficient} y^{}", law.exponent)
            });
            text += &format!("leading correction of {name}: {law}\n");
        }
        if let Some(radius) = self.radius {
            text += &format!("series in y converge to about y = {radius:.2e}\n");
        }
        text
    }
}
