//! What a contact does along the depth alone, as data: leading laws and the radius of the series in
//! `y`.

use serde::Serialize;

use super::Named;
use super::number::significant;
use crate::expansion::{DepthSeries, LeadingLaw, Variables, WindowEdge};

/// The leading laws of `D` and the radius of its series in `y`.
#[derive(Clone, Debug, Serialize)]
pub struct DepthDocument {
    /// Leading term of each coordinate's correction; `null` where none was found.
    pub leading: Named<Option<LeadingTerm>>,
    /// Estimated radius of convergence in `y`; `null` where the series ends.
    pub radius: Option<f64>,
    /// What the truncation leaves out at the edge of the window; `null` where the series ends.
    pub window_edge: Option<WindowEdge>,
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
    /// The laws of a series, by the names of its coordinates, and the window's edge for a map of
    /// some orders.
    pub fn new(
        variables: &Variables,
        series: &DepthSeries,
        window_edge: Option<WindowEdge>,
    ) -> Self {
        let names = variables.names[..variables.coordinates].iter().enumerate();
        let leading = names.map(|(coordinate, name)| {
            let law = series.leading_law(coordinate);
            (name.as_str(), law.map(LeadingTerm::from))
        });
        Self {
            leading: Named::new(leading),
            radius: series.radius(),
            window_edge,
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
        if let Some(edge) = &self.window_edge {
            text += &format!("at the edge of the window {}\n", edge_words(edge));
        }
        text
    }
}

/// What a truncation leaves out at the edge of a window, as the end of a sentence that begins
/// there.
///
/// ```
/// use grazemap::expansion::WindowEdge;
/// use grazemap::report::edge_words;
///
/// let edge = WindowEdge {
///     depth: 1e-4,
///     radius: 3.1e-7,
///     contact_weight: 8,
///     leading_exponent: 2,
///     omitted_share: 3.6e31,
///     usable_depth: 2.6e-14,
/// };
/// assert_eq!(
///     edge_words(&edge),
///     "(y = 1.0e-2) the series in y of the contact, whose radius is about 3.1e-7, diverge: \
///      weight 8 holds to two digits for y^2 <= 2.6e-14",
/// );
/// ```
pub fn edge_words(edge: &WindowEdge) -> String {
    let (depth_variable, weight) = (edge.depth.sqrt(), edge.contact_weight);
    let WindowEdge {
        radius,
        leading_exponent,
        omitted_share,
        usable_depth,
        ..
    } = edge;
    let holds = format!("weight {weight} holds to two digits for y^2 <= {usable_depth:.1e}");
    if *usable_depth == 0.0 {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out the whole correction of the contact, which begins with y^{leading_exponent}"
        )
    } else if depth_variable >= *radius {
        format!(
            "(y = {depth_variable:.1e}) the series in y of the contact, whose radius is about {radius:.1e}, diverge: {holds}"
        )
    } else if edge.is_within() {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out about {omitted_share:.0e} of the contact's correction"
        )
    } else {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out about {:.0} % of the contact's correction (radius in y about {radius:.1e}): {holds}",
            100.0 * omitted_share
        )
    }
}
