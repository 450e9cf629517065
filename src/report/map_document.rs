//! An expansion as data: the fields of `expand --json`.

use serde::Serialize;

use super::{Cell, Column, DepthDocument, Named, OneOrMany, ReportError, SectionDocument, Table};
use crate::convergence::{Choice, Polynomials};
use crate::expansion::{
    ComposedMap, Contact, DepthPolynomial, DepthSeries, Leg, LostDigits, MapOrders, Variables,
    WindowEdge,
};
use crate::jet::Jet;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// Names of the depth variables of a map: `y`, and `y1, y2, …` where there are several passages.
pub fn depth_variables(passages: usize) -> Vec<String> {
    match passages {
        1 => vec!["y".to_owned()],
        _ => (1..=passages).map(|number| format!("y{number}")).collect(),
    }
}

/// `P_smooth`, `D` and their composition, ready to be written as JSON; everything in offsets.
#[derive(Clone, Debug, Serialize)]
pub struct MapDocument {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: String,
    /// Version of the program.
    pub version: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Active parameters at `p*`.
    pub parameters: Named<f64>,
    /// Truncation orders.
    pub orders: MapOrders,
    /// Weights of the variables; depth variables have weight 1.
    pub weights: Named<u32>,
    /// `P_smooth`.
    pub smooth: PolynomialMap,
    /// `D`, with `y² = -h_min`; with several passages a list, in the order in which they are met.
    pub discontinuity: OneOrMany<PolynomialMap>,
    /// The whole map, with `y² = -h_min` of each passage.
    pub composed: PolynomialMap,
    /// Leading laws of `D` and where its series in `y` end; with several passages a list.
    pub depth: OneOrMany<DepthDocument>,
    /// Decimal digits lost to cancellation, an estimate per output.
    pub lost_digits: Named<f64>,
    /// How the map that is run differs from what is listed, where a choice was made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<ChosenCoefficients>,
}

/// How the map that was chosen for a tolerance differs from the coefficients listed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenCoefficients {
    /// Whose coefficients are listed: those of the Taylor series, all of them.
    pub listed: Polynomials,
    /// Whose coefficients are run.
    pub run: Polynomials,
    /// Orders of the map that economised coefficients were fitted to.
    pub fitted_to: Option<MapOrders>,
    /// How many coefficients are run: a tolerance does not need all of them.
    pub coefficients: usize,
}

impl ChosenCoefficients {
    /// Of a choice.
    pub fn of(choice: &Choice) -> Self {
        Self {
            listed: Polynomials::Taylor,
            run: choice.polynomials,
            fitted_to: choice.fitted_to,
            coefficients: choice.coefficients,
        }
    }

    /// The same in words.
    pub fn words(&self) -> String {
        let run = match (self.run, self.fitted_to) {
            (Polynomials::Economised, Some(orders)) => format!(
                ", fitted on the window to the map at ({}, {})",
                orders.smooth_order, orders.contact_weight
            ),
            _ => " of them".to_owned(),
        };
        format!(
            "listed are all coefficients of the Taylor series; the map that is run has {}{run}",
            self.coefficients
        )
    }
}

/// Polynomials of named variables, one per coordinate of the section.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolynomialMap {
    /// Surface of the passage, for the `D` of one of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Names of the variables.
    pub variables: Vec<String>,
    /// Terms of each coordinate's image.
    pub outputs: Named<Vec<Term>>,
    /// Terms of `y² = -h_min` in the same variables, where `y` is one of them; with several depth
    /// variables a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<OneOrMany<Vec<Term>>>,
}

/// One term of a polynomial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Term {
    /// Exponents of the variables.
    pub powers: Vec<u8>,
    /// The coefficient.
    pub value: f64,
}

/// The parts of an expansion.
#[derive(Clone, Copy, Debug)]
pub struct ExpansionParts<'a> {
    /// The variables and their weights.
    pub variables: &'a Variables,
    /// Truncation orders.
    pub orders: MapOrders,
    /// `P_smooth`.
    pub smooth: &'a Leg,
    /// The passages, in the order in which they are met.
    pub passages: &'a [PassageParts<'a>],
    /// Their composition.
    pub composed: &'a ComposedMap,
    /// Digits lost in them.
    pub lost_digits: &'a LostDigits,
    /// The choice, where the scene names a tolerance.
    pub choice: Option<&'a Choice>,
    /// The section, with what decided it.
    pub section: &'a SectionDocument,
}

/// The parts of the expansion of one passage.
#[derive(Clone, Debug)]
pub struct PassageParts<'a> {
    /// Name of its surface.
    pub surface: &'a str,
    /// The variables in which it is expanded.
    pub variables: &'a Variables,
    /// `D`.
    pub contact: &'a Contact,
    /// `D` along the depth alone.
    pub depth_series: DepthSeries,
    /// What its truncation leaves out at the edge of the window.
    pub window_edge: Option<WindowEdge>,
}

impl MapDocument {
    /// The expansion of a scene.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit, parts: ExpansionParts<'_>) -> Self {
        let variables = parts.variables;
        let active = scene.expansion.active.iter().map(|&parameter| {
            let name = scene.model.parameters[parameter].name.as_str();
            (name, orbit.parameters()[parameter].to_f64())
        });
        let depths = depth_variables(parts.passages.len());
        let weights = variables
            .names
            .iter()
            .cloned()
            .zip(variables.weights.iter().copied());
        let discontinuities = parts.passages.iter().zip(&depths);
        let discontinuities = discontinuities.map(|(passage, depth)| PolynomialMap {
            surface: (depths.len() > 1).then(|| passage.surface.to_owned()),
            ..discontinuity_map(passage.variables, depth, passage.contact)
        });
        let laws = parts.passages.iter();
        let laws = laws.map(|passage| {
            DepthDocument::new(
                passage.variables,
                &passage.depth_series,
                passage.window_edge,
            )
        });
        Self {
            scene: scene.identifier.clone(),
            digest: scene.digest.to_string(),
            version: env!("CARGO_PKG_VERSION"),
            section: parts.section.clone(),
            parameters: Named::new(active),
            orders: parts.orders,
            weights: Named::new(depths.iter().map(|name| (name.clone(), 1)).chain(weights)),
            smooth: smooth_map(variables, parts.smooth),
            discontinuity: OneOrMany::of(discontinuities),
            composed: composed_map(variables, &depths, parts.composed),
            depth: OneOrMany::of(laws),
            lost_digits: Named::new(coordinates(variables).zip(worst_digits(parts.lost_digits))),
            chosen: parts.choice.map(ChosenCoefficients::of),
        }
    }

    /// Number of terms of each part, coordinate by coordinate; a passage may have coordinates of
    /// its own.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn size_table(&self) -> Result<Table, ReportError> {
        let parts = self.parts();
        let names = parts.iter().map(|part| Column::number(part.title.clone()));
        let mut table = Table::new(
            [Column::text("coordinate")]
                .into_iter()
                .chain(names)
                .collect(),
        );
        for (number, (coordinate, _)) in self.smooth.outputs.0.iter().enumerate() {
            let counts = parts.iter().map(|part| {
                let terms = part.map.outputs.0.get(number);
                Cell::Integer(terms.map_or(0, |(_, terms)| terms.len()) as i64)
            });
            table.push(
                [Cell::text(coordinate.clone())]
                    .into_iter()
                    .chain(counts)
                    .collect(),
            )?;
        }
        Ok(table)
    }

    /// Every coefficient: part, coordinate, powers by variable, value.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn coefficient_table(&self) -> Result<Table, ReportError> {
        let parts = self.parts();
        let mut variables = self.composed.variables.clone();
        for name in parts.iter().flat_map(|part| &part.map.variables) {
            if !variables.contains(name) {
                variables.push(name.clone());
            }
        }
        let mut columns = vec![Column::text("part"), Column::text("coordinate")];
        columns.extend(variables.iter().map(|name| Column::number(name.clone())));
        columns.push(Column::number("value"));
        let mut table = Table::new(columns);
        for Part { name, map, .. } in &parts {
            for (coordinate, terms) in &map.outputs.0 {
                for term in terms {
                    let mut row = vec![Cell::text(name.clone()), Cell::text(coordinate.clone())];
                    let power = |name: &String| Cell::Integer(map.power(term, name).into());
                    row.extend(variables.iter().map(power));
                    row.push(Cell::number(term.value, 17));
                    table.push(row)?;
                }
            }
        }
        Ok(table)
    }

    /// The parts with their names.
    fn parts(&self) -> Vec<Part<'_>> {
        let contacts = self.discontinuity.as_slice();
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

/// One part of a map, as files and as people name it.
struct Part<'a> {
    name: String,
    title: String,
    map: &'a PolynomialMap,
}

impl PolynomialMap {
    /// Power of a variable in a term; 0 for one that is no variable of these polynomials.
    fn power(&self, term: &Term, variable: &str) -> u8 {
        let place = self.variables.iter().position(|name| name == variable);
        place.map_or(0, |place| term.powers[place])
    }
}

fn smooth_map(variables: &Variables, leg: &Leg) -> PolynomialMap {
    let outputs = coordinates(variables)
        .zip(&leg.image)
        .map(|(name, jet)| (name, terms(&[], jet)));
    PolynomialMap {
        surface: None,
        variables: variables.names.clone(),
        outputs: Named::new(outputs),
        depth: None,
    }
}

/// The worst of each coordinate's parts.
fn worst_digits(lost: &LostDigits) -> impl Iterator<Item = f64> {
    lost.smooth
        .iter()
        .zip(&lost.discontinuity)
        .map(|(smooth, contact)| smooth.max(*contact))
}

/// `x_i + y B_i + y² C_i`.
fn discontinuity_map(variables: &Variables, depth: &str, contact: &Contact) -> PolynomialMap {
    let outputs = coordinates(variables)
        .enumerate()
        .map(|(coordinate, name)| {
            let mut powers = vec![0; variables.len() + 1];
            powers[coordinate + 1] = 1;
            let mut all = vec![Term { powers, value: 1.0 }];
            all.extend(terms(&[1], &contact.linear[coordinate]));
            all.extend(terms(&[2], &contact.quadratic[coordinate]));
            (name, all)
        });
    PolynomialMap {
        surface: None,
        variables: after(&[depth.to_owned()], variables),
        outputs: Named::new(outputs),
        depth: Some(OneOrMany::One(terms(&[0], &contact.depth))),
    }
}

fn composed_map(variables: &Variables, depths: &[String], map: &ComposedMap) -> PolynomialMap {
    let all = |polynomial: &DepthPolynomial| {
        let parts = polynomial.terms.iter();
        parts
            .flat_map(|part| terms(&part.powers, &part.coefficient))
            .collect::<Vec<_>>()
    };
    PolynomialMap {
        surface: None,
        variables: after(depths, variables),
        outputs: Named::new(coordinates(variables).zip(map.image.iter().map(all))),
        depth: Some(OneOrMany::of(map.depths.iter().map(all))),
    }
}

fn coordinates(variables: &Variables) -> impl Iterator<Item = &str> {
    variables.names[..variables.coordinates]
        .iter()
        .map(String::as_str)
}

/// Depth variables, then the others.
fn after(depths: &[String], variables: &Variables) -> Vec<String> {
    depths.iter().chain(&variables.names).cloned().collect()
}

/// The terms of a jet that are not zero, each times these powers of the depth variables.
fn terms(depths: &[u8], jet: &Jet<f64>) -> Vec<Term> {
    jet.terms()
        .filter(|(_, value)| *value != 0.0)
        .map(|(exponents, value)| Term {
            powers: depths.iter().chain(exponents).copied().collect(),
            value,
        })
        .collect()
}
