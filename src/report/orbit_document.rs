//! The grazing orbit as data: the fields of `locate --json`.

use serde::Serialize;

use super::{Cell, Column, Named, ReportError, Table};
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{GrazingOrbit, GrazingPoint, PoincareSectionKind};

/// The digits of a double-double.
const ALL_DIGITS: usize = 32;

/// A grazing orbit, ready to be written as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct OrbitDocument {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: String,
    /// Version of the program.
    pub version: &'static str,
    /// The surface that is grazed.
    pub surface: String,
    /// All parameters at which the orbit grazes.
    pub parameters: Named<f64>,
    /// Full state at the grazing point.
    pub state: Named<f64>,
    /// Duration of one period of the orbit, in time.
    pub period: f64,
    /// `h''` at the grazing point.
    pub normal_acceleration: f64,
    /// The section.
    pub section: SectionDocument,
    /// Jacobian of `P_smooth` on the section's coordinates, by rows.
    pub monodromy: Vec<Vec<f64>>,
    /// Its eigenvalues, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, ...`
    pub xi: Vec<f64>,
    /// Largest residual of the equations of the orbit.
    pub residual: f64,
    /// Lowest minimum of any event function elsewhere on the orbit; negative where it penetrates a surface.
    pub clearance: Option<f64>,
    /// Parameters and state to 32 digits.
    pub digits32: ExactPoint,
}

/// A grazing point to 32 digits.
#[derive(Clone, Debug, Serialize)]
pub struct ExactPoint {
    /// All parameters.
    pub parameters: Named<String>,
    /// Full state.
    pub state: Named<String>,
}

/// A section, its coordinates, and where the orbit meets it.
#[derive(Clone, Debug, Serialize)]
pub struct SectionDocument {
    /// `tangency` or `stroboscopic`.
    pub kind: &'static str,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Where the orbit meets the section, one value per coordinate.
    pub point: Vec<f64>,
}

impl SectionDocument {
    /// The section of an orbit.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let (kind, phase) = match orbit.section.kind {
            PoincareSectionKind::Tangency => ("tangency", None),
            PoincareSectionKind::Stroboscopic { phase } => ("stroboscopic", Some(phase.to_f64())),
        };
        let coordinates = orbit.section_coordinates(scene);
        Self {
            kind,
            phase,
            coordinates: coordinates
                .iter()
                .map(|&(name, _)| name.to_owned())
                .collect(),
            point: coordinates
                .iter()
                .map(|(_, value)| value.to_f64())
                .collect(),
        }
    }

    /// Section and phase in words.
    pub fn words(&self) -> String {
        let coordinates = self.coordinates.join(", ");
        match self.phase {
            None => format!("tangency section h' = 0 at the graze; coordinates {coordinates}"),
            Some(phase) => {
                format!("stroboscopic section at the phase {phase:.6}; coordinates {coordinates}")
            }
        }
    }
}

impl OrbitDocument {
    /// The orbit of a scene.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let graze = orbit.grazing_point();
        let round = |values: &[Dd]| {
            values
                .iter()
                .map(|value| value.to_f64())
                .collect::<Vec<f64>>()
        };
        Self {
            scene: scene.identifier.clone(),
            digest: format!("{:016x}", scene.digest),
            version: env!("CARGO_PKG_VERSION"),
            surface: scene.model.surfaces[graze.surface].name.clone(),
            parameters: parameters(scene, graze, |value| value.to_f64()),
            state: state(scene, graze, |value| value.to_f64()),
            period: orbit.period.to_f64(),
            normal_acceleration: graze.normal_acceleration.to_f64(),
            section: SectionDocument::new(scene, orbit),
            monodromy: orbit.monodromy.iter().map(|row| round(row)).collect(),
            multipliers: orbit.multipliers.clone(),
            xi: round(&orbit.xi),
            residual: orbit.residual,
            clearance: orbit.clearance,
            digits32: ExactPoint {
                parameters: parameters(scene, graze, |value| value.to_decimal(ALL_DIGITS)),
                state: state(scene, graze, |value| value.to_decimal(ALL_DIGITS)),
            },
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
}

fn parameters<T>(scene: &Scene, graze: &GrazingPoint, form: impl Fn(Dd) -> T) -> Named<T> {
    let names = scene
        .model
        .parameters
        .iter()
        .map(|parameter| parameter.name.as_str());
    Named::new(names.zip(graze.parameters.iter().map(|&value| form(value))))
}

fn state<T>(scene: &Scene, graze: &GrazingPoint, form: impl Fn(Dd) -> T) -> Named<T> {
    let names = scene.model.full_state_names();
    Named::new(
        names
            .into_iter()
            .zip(graze.state.iter().map(|&value| form(value))),
    )
}
