//! The grazing orbit by name: the fields of `locate --json` that people and other programs read.

use serde::Serialize;

use super::{Cell, Column, Named, ReportError, SectionDocument, Table};
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{GrazingConditions, GrazingOrbit, GrazingPoint};

/// A grazing orbit by the names of its parameters and states, rounded to doubles.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitListing {
    /// The surface that is grazed first.
    pub surface: String,
    /// All parameters at which the orbit grazes.
    pub parameters: Named<f64>,
    /// Full state at the first grazing point.
    pub state: Named<f64>,
    /// Duration of one period of the orbit, in time.
    pub period: f64,
    /// `h''` at the first grazing point.
    pub normal_acceleration: f64,
    /// The section.
    pub section: SectionDocument,
    /// Jacobian of `P_smooth` on the section's coordinates, by rows.
    pub monodromy: Vec<Vec<f64>>,
    /// Its eigenvalues, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, ...` from the first passage to itself.
    pub xi: Vec<f64>,
    /// Grazing passages of a period, in order.
    pub passages: Vec<PassageListing>,
    /// `xi_n` from every passage to every passage.
    pub conditions: Vec<ConditionsListing>,
    /// Largest residual of the equations of the orbit.
    pub residual: f64,
    /// Lowest minimum of any event function elsewhere on the orbit; negative where it penetrates a
    /// surface.
    pub clearance: Option<f64>,
}

/// A grazing passage.
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

/// The conditions from one passage to another.
#[derive(Clone, Debug, Serialize)]
pub struct ConditionsListing {
    /// The passage that stretches, from 0.
    pub from: usize,
    /// The passage whose gap is looked at, from 0.
    pub to: usize,
    /// Names of their surfaces.
    pub surfaces: [String; 2],
    /// `xi_1, xi_2, ...`; empty where the contact does not differ from free flight.
    pub values: Vec<f64>,
}

impl ConditionsListing {
    /// Conditions of an orbit of a scene.
    pub(super) fn new(scene: &Scene, from: usize, to: usize, values: Vec<f64>) -> Self {
        let surfaces = [from, to].map(|passage| surface_of(scene, passage));
        Self { from, to, surfaces, values }
    }
}

impl OrbitListing {
    /// The orbit of a scene.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let graze = orbit.grazing_point();
        let round = |values: &[Dd]| values.iter().map(|value| value.to_f64()).collect::<Vec<f64>>();
        Self {
            surface: scene.model.surfaces[graze.surface].name.clone(),
            parameters: parameters(scene, graze),
            state: state(scene, graze),
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
                    state: state(scene, graze),
                    normal_acceleration: graze.normal_acceleration.to_f64(),
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
        }
    }

    /// Parameters and the grazing point as a table.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has two cells.
    pub fn point_table(&self) -> Result<Table, ReportError> {
        let mut table = Table::new(vec![Column::text("quantity"), Column::number("value")]);
        let mut row =
            |name: String, value: f64| table.push(vec![Cell::text(name), Cell::number(value, 16)]);
        for (name, value) in self.parameters.0.iter().chain(&self.state.0) {
            row(name.clone(), *value)?;
        }
        row("period".to_owned(), self.period)?;
        row("h''".to_owned(), self.normal_acceleration)?;
        for (number, [re, im]) in self.multipliers.iter().enumerate() {
            row(format!("multiplier {}", number + 1), *re)?;
            if *im != 0.0 {
                row("  imaginary part".to_owned(), *im)?;
            }
        }
        for (number, xi) in self.xi.iter().enumerate() {
            row(format!("xi_{}", number + 1), *xi)?;
        }
        table.push(vec![Cell::text("residual"), Cell::number(self.residual, 3)])?;
        Ok(table)
    }

    /// The surfaces grazed, in order.
    pub fn surfaces(&self) -> Vec<&str> {
        let passages = self.passages.iter();
        passages.map(|passage| passage.surface.as_str()).collect()
    }

    /// The passages as a table: one row each.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn passages_table(&self) -> Result<Table, ReportError> {
        let names = self.state.0.iter().map(|(name, _)| name.clone());
        let numbers = ["time".to_owned()].into_iter().chain(names);
        let mut columns = vec![Column::text("passage"), Column::text("surface")];
        columns.extend(numbers.chain(["h''".to_owned()]).map(Column::number));
        let mut table = Table::new(columns);
        for (number, passage) in self.passages.iter().enumerate() {
            let state = passage.state.0.iter().map(|(_, value)| *value);
            let numbers = [passage.time].into_iter().chain(state);
            let mut row =
                vec![Cell::text(format!("{}", number + 1)), Cell::text(passage.surface.clone())];
            row.extend(
                numbers.chain([passage.normal_acceleration]).map(|value| Cell::number(value, 12)),
            );
            table.push(row)?;
        }
        Ok(table)
    }

    /// The conditions as a table: one row per pair of passages, one column per `n`.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn conditions_table(&self) -> Result<Table, ReportError> {
        let felt = || self.conditions.iter().filter(|pair| !pair.values.is_empty());
        let count = felt().map(|pair| pair.values.len()).max().unwrap_or(0);
        let mut columns = vec![Column::text("from"), Column::text("to")];
        columns.extend((1..=count).map(|n| Column::number(format!("xi_{n}"))));
        let mut table = Table::new(columns);
        for pair in felt() {
            let ends = [(pair.from, 0), (pair.to, 1)];
            let name = |(passage, end): (usize, usize)| {
                Cell::text(format!("{} {}", passage + 1, pair.surfaces[end]))
            };
            let values = pair.values.iter().map(|&value| Cell::number(value, 9));
            table.push(ends.map(name).into_iter().chain(values).collect())?;
        }
        Ok(table)
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

fn state(scene: &Scene, graze: &GrazingPoint) -> Named<f64> {
    let names = scene.model.full_state_names().into_iter();
    Named::new(names.zip(graze.state.iter().map(|value| value.to_f64())))
}
