//! An expansion as data: the fields of `expand --json`.

use serde::Serialize;

use super::{Cell, Column, DepthDocument, Named, ReportError, SectionDocument, Table};
use crate::expansion::{
    ComposedMap, Contact, DepthSeries, Leg, LostDigits, MapOrders, Variables, WindowEdge,
};
use crate::jet::Jet;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// Name of the depth variable.
pub const DEPTH_VARIABLE: &str = "y";

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
    /// Weights of the variables; `y` has weight 1.
    pub weights: Named<u32>,
    /// `P_smooth`.
    pub smooth: PolynomialMap,
    /// `D`, with `y² = -h_min`.
    pub discontinuity: PolynomialMap,
    /// `P_smooth ∘ D`, with `y² = -h_min`.
    pub composed: PolynomialMap,
    /// Leading laws of `D` and where its series in `y` end.
    pub depth: DepthDocument,
    /// Decimal digits lost to cancellation, an estimate per output.
    pub lost_digits: Named<f64>,
}

/// Polynomials of named variables, one per coordinate of the section.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolynomialMap {
    /// Names of the variables.
    pub variables: Vec<String>,
    /// Terms of each coordinate's image.
    pub outputs: Named<Vec<Term>>,
    /// Terms of `y² = -h_min` in the same variables, where `y` is one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<Vec<Term>>,
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
    /// `D`.
    pub contact: &'a Contact,
    /// Their composition.
    pub composed: &'a ComposedMap,
    /// `D` along the depth alone.
    pub depth_series: &'a DepthSeries,
    /// What its truncation leaves out at the edge of the window.
    pub window_edge: Option<WindowEdge>,
    /// Digits lost in them.
    pub lost_digits: &'a LostDigits,
}

impl MapDocument {
    /// The expansion of a scene.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit, parts: ExpansionParts<'_>) -> Self {
        let ExpansionParts {
            variables,
            orders,
            smooth,
            contact,
            composed,
            depth_series,
            window_edge,
            lost_digits,
        } = parts;
        let active = scene.expansion.active.iter().map(|&parameter| {
            let name = scene.model.parameters[parameter].name.as_str();
            (name, orbit.parameters()[parameter].to_f64())
        });
        let names =
            std::iter::once(DEPTH_VARIABLE).chain(variables.names.iter().map(String::as_str));
        Self {
            scene: scene.identifier.clone(),
            digest: format!("{:016x}", scene.digest),
            version: env!("CARGO_PKG_VERSION"),
            section: SectionDocument::new(scene, orbit),
            parameters: Named::new(active),
            orders,
            weights: Named::new(
                names.zip(std::iter::once(1).chain(variables.weights.iter().copied())),
            ),
            smooth: smooth_map(variables, smooth),
            discontinuity: discontinuity_map(variables, contact),
            composed: composed_map(variables, composed),
            depth: DepthDocument::new(variables, depth_series, window_edge),
            lost_digits: Named::new(coordinates(variables).zip(worst_digits(lost_digits))),
        }
    }

    /// Number of terms of each part, coordinate by coordinate.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn size_table(&self) -> Result<Table, ReportError> {
        let columns = ["coordinate", "P_smooth", "D", "P_smooth after D"];
        let mut table = Table::new(
            columns
                .iter()
                .enumerate()
                .map(|(k, name)| {
                    if k == 0 {
                        Column::text(*name)
                    } else {
                        Column::number(*name)
                    }
                })
                .collect(),
        );
        for (coordinate, smooth) in &self.smooth.outputs.0 {
            let count = |map: &PolynomialMap| {
                Cell::Integer(map.outputs.get(coordinate).map_or(0, Vec::len) as i64)
            };
            table.push(vec![
                Cell::text(coordinate.clone()),
                Cell::Integer(smooth.len() as i64),
                count(&self.discontinuity),
                count(&self.composed),
            ])?;
        }
        Ok(table)
    }

    /// Every coefficient: part, coordinate, powers by variable, value.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn coefficient_table(&self) -> Result<Table, ReportError> {
        let mut columns = vec![Column::text("part"), Column::text("coordinate")];
        columns.extend(
            self.composed
                .variables
                .iter()
                .map(|name| Column::number(name.clone())),
        );
        columns.push(Column::number("value"));
        let mut table = Table::new(columns);
        for (part, map) in [
            ("smooth", &self.smooth),
            ("discontinuity", &self.discontinuity),
            ("composed", &self.composed),
        ] {
            for (coordinate, terms) in &map.outputs.0 {
                for term in terms {
                    let mut row = vec![Cell::text(part), Cell::text(coordinate.clone())];
                    row.extend(
                        (term.powers.len()..self.composed.variables.len())
                            .map(|_| Cell::Integer(0)),
                    );
                    row.extend(term.powers.iter().map(|&power| Cell::Integer(power.into())));
                    row.push(Cell::number(term.value, 17));
                    table.push(row)?;
                }
            }
        }
        Ok(table)
    }
}

fn smooth_map(variables: &Variables, leg: &Leg) -> PolynomialMap {
    let outputs = coordinates(variables)
        .zip(&leg.image)
        .map(|(name, jet)| (name, terms(jet, None)));
    PolynomialMap {
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
fn discontinuity_map(variables: &Variables, contact: &Contact) -> PolynomialMap {
    let outputs = coordinates(variables)
        .enumerate()
        .map(|(coordinate, name)| {
            let mut powers = vec![0; variables.len() + 1];
            powers[coordinate + 1] = 1;
            let mut all = vec![Term { powers, value: 1.0 }];
            all.extend(terms(&contact.linear[coordinate], Some(1)));
            all.extend(terms(&contact.quadratic[coordinate], Some(2)));
            (name, all)
        });
    PolynomialMap {
        variables: with_depth(variables),
        outputs: Named::new(outputs),
        depth: Some(terms(&contact.depth, Some(0))),
    }
}

fn composed_map(variables: &Variables, map: &ComposedMap) -> PolynomialMap {
    let outputs = coordinates(variables)
        .enumerate()
        .map(|(coordinate, name)| {
            let mut all = terms(&map.smooth[coordinate], Some(0));
            all.extend(terms(&map.linear[coordinate], Some(1)));
            all.extend(terms(&map.quadratic[coordinate], Some(2)));
            (name, all)
        });
    PolynomialMap {
        variables: with_depth(variables),
        outputs: Named::new(outputs),
        depth: Some(terms(&map.depth, Some(0))),
    }
}

fn coordinates(variables: &Variables) -> impl Iterator<Item = &str> {
    variables.names[..variables.coordinates]
        .iter()
        .map(String::as_str)
}

fn with_depth(variables: &Variables) -> Vec<String> {
    std::iter::once(DEPTH_VARIABLE.to_owned())
        .chain(variables.names.iter().cloned())
        .collect()
}

/// The terms of a jet that are not zero, times this power of `y` where `y` is a variable.
fn terms(jet: &Jet<f64>, depth_power: Option<u8>) -> Vec<Term> {
    jet.terms()
        .filter(|(_, value)| *value != 0.0)
        .map(|(exponents, value)| Term {
            powers: depth_power
                .into_iter()
                .chain(exponents.iter().copied())
                .collect(),
            value,
        })
        .collect()
}
