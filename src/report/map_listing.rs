//! Expansion by names of variables: the fields of `expand --json`.

use serde::{Deserialize, Serialize, Serializer};

use super::table::significant;
use super::{Named, SectionDocument, Table};
use crate::convergence::{Choice, MeasuredWindow, Polynomials};
use crate::expansion::{
    ComposedMap, Contact, DepthPolynomial, DepthSeries, LeadingLaw, Leg, LostDigits, MapOrders,
    Variables, WindowEdge,
};
use crate::jet::Jet;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::GrazingOrbit;

/// Names of the depth variables of a map: `y`, or `y1, y2, …` if there are several passages.
pub fn depth_variables(passages: usize) -> Vec<String> {
    match passages {
        1 => vec!["y".to_owned()],
        _ => (1..=passages).map(|number| format!("y{number}")).collect(),
    }
}

/// `P_smooth`, `D` and their composition in named variables, all in offsets.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MapListing {
    /// The section.
    pub section: SectionDocument,
    /// Active parameters at the graze.
    pub parameters: Named<f64>,
    /// Truncation orders.
    pub orders: MapOrders,
    /// Weights of the variables; depth variables have weight 1.
    pub weights: Named<u32>,
    /// `P_smooth`.
    pub smooth: PolynomialMap,
    /// `D` of each passage, in order of passage, with `y² = -h_min`.
    pub discontinuity: Vec<PolynomialMap>,
    /// Composed map, with `y² = -h_min` of each passage.
    pub composed: PolynomialMap,
    /// Leading laws of each `D`, and radius of its series in `y`.
    pub depth: Vec<DepthListing>,
    /// Estimated decimal digits lost to cancellation, per output.
    pub lost_digits: Named<f64>,
    /// Window, with the map's errors.
    pub window: MeasuredWindow,
    /// Difference between the coefficients that are run and those listed, if the map was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<ChosenCoefficients>,
}

/// Difference between the coefficients of a chosen map and those listed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChosenCoefficients {
    /// Kind of the listed coefficients: all those of the Taylor series.
    pub listed: Polynomials,
    /// Kind of the coefficients that are run.
    pub run: Polynomials,
    /// Orders of the map to which economised coefficients were fitted.
    pub fitted_to: Option<MapOrders>,
    /// Number of coefficients that are run; a tolerance does not need all of them.
    pub coefficients: usize,
}

impl ChosenCoefficients {
    /// Difference for a choice.
    pub fn of(choice: &Choice) -> Self {
        Self {
            listed: Polynomials::Taylor,
            run: choice.polynomials,
            fitted_to: choice.fitted_to,
            coefficients: choice.coefficients,
        }
    }

    /// Difference as text.
    pub fn words(&self) -> String {
        let run = match (self.run, self.fitted_to) {
            (Polynomials::Economised, Some(orders)) => {
                format!(", fitted on the window to the map at {orders}")
            }
            _ => " of them".to_owned(),
        };
        format!(
            "listed are all coefficients of the Taylor series; the map that is run has {}{run}",
            self.coefficients
        )
    }
}

/// Polynomials in named variables, one per section coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolynomialMap {
    /// Surface of the passage, if there are several passages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Names of the variables.
    pub variables: Vec<String>,
    /// Terms of the image of each coordinate.
    pub outputs: Named<Vec<Term>>,
    /// Terms of `y² = -h_min` in the same variables, one list per depth variable.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub depth: Vec<Vec<Term>>,
}

/// Term of a polynomial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// Exponents of the variables.
    pub powers: Vec<u8>,
    /// Coefficient.
    pub value: f64,
}

/// Parts of an expansion.
#[derive(Clone, Copy, Debug)]
pub struct ExpansionParts<'a> {
    /// The variables and their weights.
    pub variables: &'a Variables,
    /// Truncation orders.
    pub orders: MapOrders,
    /// `P_smooth`.
    pub smooth: &'a Leg,
    /// Passages, in order.
    pub passages: &'a [PassageParts<'a>],
    /// Composition of the parts.
    pub composed: &'a ComposedMap,
    /// Digits lost to cancellation in the parts.
    pub lost_digits: &'a LostDigits,
    /// Choice of orders, if the scene names a tolerance.
    pub choice: Option<&'a Choice>,
    /// Section, with the reason for its choice.
    pub section: &'a SectionDocument,
    /// Measured window.
    pub window: &'a MeasuredWindow,
}

/// Parts of the expansion of a passage.
#[derive(Clone, Debug)]
pub struct PassageParts<'a> {
    /// Name of the surface.
    pub surface: &'a str,
    /// Variables of the expansion.
    pub variables: &'a Variables,
    /// `D`.
    pub contact: &'a Contact,
    /// Series of `D` in the depth alone.
    pub depth_series: DepthSeries,
    /// Truncation of the series at the edge of the window.
    pub window_edge: Option<WindowEdge>,
}

impl MapListing {
    /// Listing of a scene's expansion.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit, parts: ExpansionParts<'_>) -> Self {
        let variables = parts.variables;
        let active = scene.expansion.active.iter().map(|&parameter| {
            let name = scene.model.parameters[parameter].name.as_str();
            (name, orbit.parameters()[parameter].to_f64())
        });
        let depths = depth_variables(parts.passages.len());
        let weights = variables.names.iter().cloned().zip(variables.weights.iter().copied());
        let discontinuities = parts.passages.iter().zip(&depths);
        let discontinuities = discontinuities.map(|(passage, depth)| PolynomialMap {
            surface: (depths.len() > 1).then(|| passage.surface.to_owned()),
            ..discontinuity_map(passage.variables, depth, passage.contact)
        });
        let laws = parts.passages.iter();
        let laws = laws.map(|passage| {
            DepthListing::new(passage.variables, &passage.depth_series, passage.window_edge)
        });
        Self {
            section: parts.section.clone(),
            parameters: Named::new(active),
            orders: parts.orders,
            weights: Named::new(depths.iter().map(|name| (name.clone(), 1)).chain(weights)),
            smooth: smooth_map(variables, parts.smooth),
            discontinuity: discontinuities.collect(),
            composed: composed_map(variables, &depths, parts.composed),
            depth: laws.collect(),
            lost_digits: Named::new(coordinates(variables).zip(worst_digits(parts.lost_digits))),
            window: parts.window.clone(),
            chosen: parts.choice.map(ChosenCoefficients::of),
        }
    }

    /// Table of the numbers of terms of each part, by coordinate; a passage may have coordinates of
    /// its own.
    pub fn size_table(&self) -> Table {
        let coordinates = self.smooth.outputs.0.iter().map(|(coordinate, _)| coordinate);
        let mut table = Table::of(coordinates.enumerate()).text("coordinate", |(_, name)| name);
        for Part { title, map, .. } in self.parts() {
            table = table.count(&title, |(number, _)| {
                map.outputs.0.get(number).map_or(0, |(_, terms)| terms.len())
            });
        }
        table.made()
    }

    /// Table of all coefficients: part, coordinate, powers by variable, value.
    pub fn coefficient_table(&self) -> Table {
        let parts = self.parts();
        let mut variables = self.composed.variables.clone();
        for name in parts.iter().flat_map(|part| &part.map.variables) {
            if !variables.contains(name) {
                variables.push(name.clone());
            }
        }
        let terms = parts.iter().flat_map(|part| {
            let outputs = part.map.outputs.0.iter();
            outputs.flat_map(move |(coordinate, terms)| {
                terms.iter().map(move |term| (part, coordinate, term))
            })
        });
        let mut table = Table::of(terms)
            .text("part", |(part, ..)| &part.name)
            .text("coordinate", |(_, coordinate, _)| coordinate);
        for name in &variables {
            table = table.count(name, |(part, _, term)| part.map.power(term, name));
        }
        table.number("value", 17, |(.., term)| term.value).made()
    }

    /// Parts with their names.
    fn parts(&self) -> Vec<Part<'_>> {
        let contacts = &self.discontinuity;
        let number = |passage: usize| match contacts.len() {
            1 => String::new(),
            _ => (passage + 1).to_string(),
        };
        let contacts = contacts.iter().enumerate().map(|(passage, map)| Part {
            name: format!("discontinuity{}", number(passage)),
            title: format!("D{}", number(passage)),
            map,
        });
        let whole = |name: &str, title: &str, map| Part {
            name: name.to_owned(),
            title: title.to_owned(),
            map,
        };
        [whole("smooth", "P_smooth", &self.smooth)]
            .into_iter()
            .chain(contacts)
            .chain([whole("composed", "P_smooth after D", &self.composed)])
            .collect()
    }
}

/// Part of a map, with its name in files and its title for people.
struct Part<'a> {
    name: String,
    title: String,
    map: &'a PolynomialMap,
}

impl PolynomialMap {
    /// Power of a variable in a term; 0 for a variable that these polynomials do not have.
    fn power(&self, term: &Term, variable: &str) -> u8 {
        let place = self.variables.iter().position(|name| name == variable);
        place.and_then(|place| term.powers.get(place).copied()).unwrap_or(0)
    }
}

fn smooth_map(variables: &Variables, leg: &Leg) -> PolynomialMap {
    let outputs = coordinates(variables).zip(&leg.image).map(|(name, jet)| (name, terms(&[], jet)));
    PolynomialMap {
        surface: None,
        variables: variables.names.clone(),
        outputs: Named::new(outputs),
        depth: Vec::new(),
    }
}

/// Larger loss of digits of the two parts, per coordinate.
fn worst_digits(lost: &LostDigits) -> impl Iterator<Item = f64> {
    lost.smooth.iter().zip(&lost.discontinuity).map(|(smooth, contact)| smooth.max(*contact))
}

/// `x_i + y B_i + y² C_i`, and the terms with powers of `y` that are not whole.
fn discontinuity_map(variables: &Variables, depth: &str, contact: &Contact) -> PolynomialMap {
    let outputs = coordinates(variables).enumerate().map(|(coordinate, name)| {
        let own = vec![0; contact.powers.exponents.len()];
        let mut powers = vec![0; 1 + own.len() + variables.len()];
        powers[1 + own.len() + coordinate] = 1;
        let mut all = vec![Term { powers, value: 1.0 }];
        let mut add = |power: u8, own: &[u8], jets: &[Jet<f64>]| {
            all.extend(terms(&[&[power], own].concat(), &jets[coordinate]));
        };
        add(1, &own, &contact.linear);
        add(2, &own, &contact.quadratic);
        for term in &contact.powers.terms {
            add(1, &term.powers, &term.linear);
            add(2, &term.powers, &term.quadratic);
        }
        (name, all)
    });
    let own = contact.powers.exponents.iter().map(|&exponent| own_name(depth, exponent));
    let depths: Vec<String> = std::iter::once(depth.to_owned()).chain(own).collect();
    let none = vec![0; depths.len()];
    PolynomialMap {
        surface: None,
        variables: after(&depths, variables),
        outputs: Named::new(outputs),
        depth: vec![terms(&none, &contact.depth)],
    }
}

/// Name of a power of a depth variable that is a variable of its own.
fn own_name(depth: &str, exponent: Dd) -> String {
    format!("({depth}^{})", exponent.to_f64())
}

fn composed_map(variables: &Variables, depths: &[String], map: &ComposedMap) -> PolynomialMap {
    let depths = map.depth_variables().map(|(passage, exponent)| match exponent {
        None => depths[passage].clone(),
        Some(exponent) => own_name(&depths[passage], exponent),
    });
    let depths: Vec<String> = depths.collect();
    let all = |polynomial: &DepthPolynomial| {
        let parts = polynomial.terms.iter();
        parts.flat_map(|part| terms(&part.powers, &part.coefficient)).collect::<Vec<_>>()
    };
    PolynomialMap {
        surface: None,
        variables: after(&depths, variables),
        outputs: Named::new(coordinates(variables).zip(map.image.iter().map(all))),
        depth: map.depths.iter().map(all).collect(),
    }
}

fn coordinates(variables: &Variables) -> impl Iterator<Item = &str> {
    variables.names[..variables.coordinates].iter().map(String::as_str)
}

/// Names of the depth variables, then of the other variables.
fn after(depths: &[String], variables: &Variables) -> Vec<String> {
    depths.iter().chain(&variables.names).cloned().collect()
}

/// Nonzero terms of a jet, each multiplied by these powers of the depth variables.
fn terms(depths: &[u8], jet: &Jet<f64>) -> Vec<Term> {
    jet.terms()
        .filter(|(_, value)| *value != 0.0)
        .map(|(exponents, value)| Term {
            powers: depths.iter().chain(exponents).copied().collect(),
            value,
        })
        .collect()
}

/// Leading laws of `D` and radius of its series in `y`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DepthListing {
    /// Leading term of each coordinate's correction; `null` if none was found.
    pub leading: Named<Option<LeadingTerm>>,
    /// Estimated radius of convergence in `y`; `null` if the series terminates.
    pub radius: Option<f64>,
    /// Truncation at the edge of the window; `null` if the series terminates.
    pub window_edge: Option<WindowEdge>,
}

/// Leading term `coefficient · y^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeadingTerm {
    /// Power of `y`.
    #[serde(serialize_with = "whole_or_not")]
    pub exponent: f64,
    /// Coefficient.
    pub coefficient: f64,
}

/// A number without a point where it is whole.
fn whole_or_not<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match value.fract() == 0.0 {
        true => serializer.serialize_u32(*value as u32),
        false => serializer.serialize_f64(*value),
    }
}

impl From<LeadingLaw> for LeadingTerm {
    fn from(law: LeadingLaw) -> Self {
        Self { exponent: law.exponent, coefficient: law.coefficient.hi }
    }
}

impl DepthListing {
    /// Laws of a series by coordinate names, with the truncation at the window's edge.
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
        Self { leading: Named::new(leading), radius: series.radius(), window_edge }
    }

    /// Text with one line per coordinate, and one for the radius.
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

/// Share that truncation omits at the edge of a window, as the end of a sentence.
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
    let WindowEdge { radius, leading_exponent, omitted_share, usable_depth, .. } = edge;
    let holds = format!("weight {weight} holds to two digits for y^2 <= {usable_depth:.1e}");
    if *usable_depth == 0.0 {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out the whole correction of the \
                contact, which begins with y^{leading_exponent}"
        )
    } else if depth_variable >= *radius {
        format!(
            "(y = {depth_variable:.1e}) the series in y of the contact, whose radius is about \
                {radius:.1e}, diverge: {holds}"
        )
    } else if edge.is_within() {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out about {omitted_share:.0e} of \
                the contact's correction"
        )
    } else {
        format!(
            "(y = {depth_variable:.1e}) weight {weight} leaves out about {:.0} % of the contact's \
                correction (radius in y about {radius:.1e}): {holds}",
            100.0 * omitted_share
        )
    }
}
