//! Grazing orbits and curves as records: what `locate` and `curve` write, every quantity by name.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::model::{Model, Scene};
use crate::numeric::Dd;

use super::curve::{CurvePoint, GrazingCurve, SpecialPoint};
use super::point::{GrazingOrbit, GrazingPoint};
use super::section::{PoincareSection, PoincareSectionKind};

/// Values by name.
type Named = BTreeMap<String, f64>;

/// A grazing orbit, named and rounded to `f64` (17 significant digits in JSON).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrbitRecord {
    /// Identifier of the scene.
    pub scene: String,
    /// All parameters at which the orbit grazes.
    pub parameters: Named,
    /// Full state at the first grazing point.
    pub state: Named,
    /// One entry per grazing passage.
    pub points: Vec<PointRecord>,
    /// Duration of one period of the orbit.
    pub period: f64,
    /// `h''` at the first grazing point.
    pub normal_acceleration: f64,
    /// The section.
    pub section: SectionRecord,
    /// Jacobian of `P_smooth` on the section's coordinates, by rows.
    pub monodromy: Vec<Vec<f64>>,
    /// Multipliers `[re, im]`.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, …`
    pub xi: Vec<f64>,
    /// Largest residual, computed in double-double.
    pub residual: f64,
    /// Whether the orbit stays on the free side of every surface.
    pub physical: bool,
    /// Lowest other minimum of any event function.
    pub clearance: Option<f64>,
    /// Distance from the scene's guess.
    pub guess_distance: Option<f64>,
    /// Parameters and state at the graze with all digits, as decimal strings.
    pub exact: BTreeMap<String, Dd>,
}

/// A grazing passage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointRecord {
    /// Name of the surface.
    pub surface: String,
    /// Full state.
    pub state: Named,
    /// `h''`.
    pub normal_acceleration: f64,
}

/// A section.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SectionRecord {
    /// `tangency` or `stroboscopic`.
    pub kind: &'static str,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Names of the coordinates, in order.
    pub coordinates: Vec<String>,
    /// Where the orbit meets the section, by coordinate.
    pub point: Vec<f64>,
}

/// A grazing curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveRecord {
    /// Orbits in order.
    pub points: Vec<CurvePointRecord>,
    /// Points where some `xi_n` vanishes.
    pub codim2: Vec<Codim2Record>,
    /// Points where a parameter turns back.
    pub folds: Vec<FoldRecord>,
    /// Points where multipliers change between real and complex.
    pub multiplier_switches: Vec<SwitchRecord>,
    /// How the curve ended.
    pub end: String,
}

/// An orbit of a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurvePointRecord {
    /// All parameters.
    pub parameters: Named,
    /// Full state at the graze.
    pub state: Named,
    /// Multipliers `[re, im]`.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, …`
    pub xi: Vec<f64>,
    /// Whether the orbit stays on the free side of every surface.
    pub physical: bool,
}

/// A point of codimension two.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Codim2Record {
    /// Which `xi_n` vanishes.
    pub n: usize,
    /// All parameters.
    pub parameters: Named,
    /// Whether the orbit stays on the free side of every surface.
    pub physical: bool,
}

/// A fold of a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoldRecord {
    /// Name of the parameter that turns.
    pub parameter: String,
    /// All parameters.
    pub parameters: Named,
}

/// A change of multipliers between real and complex.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SwitchRecord {
    /// All parameters.
    pub parameters: Named,
    /// Multipliers `[re, im]`.
    pub multipliers: Vec<[f64; 2]>,
}

impl OrbitRecord {
    /// The record of an orbit of a scene.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let (model, graze) = (&scene.model, orbit.grazing_point());
        let round = |values: &[Dd]| {
            values
                .iter()
                .map(|value| value.to_f64())
                .collect::<Vec<_>>()
        };
        let values = graze.parameters.iter().chain(&graze.state).copied();
        Self {
            scene: orbit.scene.clone(),
            parameters: named(parameter_names(model), &round(&graze.parameters)),
            state: named(model.full_state_names(), &round(&graze.state)),
            points: orbit
                .passages
                .iter()
                .map(|point| PointRecord::new(model, point))
                .collect(),
            period: orbit.period.to_f64(),
            normal_acceleration: graze.normal_acceleration.to_f64(),
            section: SectionRecord::new(model, &orbit.section, &orbit.section_point),
            monodromy: orbit.monodromy.iter().map(|row| round(row)).collect(),
            multipliers: orbit.multipliers.clone(),
            xi: round(&orbit.xi),
            residual: orbit.residual,
            physical: orbit.is_physical(),
            clearance: orbit.clearance,
            guess_distance: orbit.guess_distance,
            exact: parameter_names(model)
                .chain(model.full_state_names())
                .map(str::to_owned)
                .zip(values)
                .collect(),
        }
    }
}

impl PointRecord {
    fn new(model: &Model, point: &GrazingPoint) -> Self {
        let state: Vec<f64> = point.state.iter().map(|value| value.to_f64()).collect();
        Self {
            surface: model.surfaces[point.surface].name.clone(),
            state: named(model.full_state_names(), &state),
            normal_acceleration: point.normal_acceleration.to_f64(),
        }
    }
}

impl SectionRecord {
    fn new(model: &Model, section: &PoincareSection, point: &[Dd]) -> Self {
        let (kind, phase) = match section.kind {
            PoincareSectionKind::Tangency => ("tangency", None),
            PoincareSectionKind::Stroboscopic { phase } => ("stroboscopic", Some(phase.to_f64())),
        };
        let coordinates = section
            .coordinate_names(model)
            .into_iter()
            .map(str::to_owned)
            .collect();
        let point = section
            .coordinates
            .iter()
            .map(|&component| point[component].to_f64())
            .collect();
        Self {
            kind,
            phase,
            coordinates,
            point,
        }
    }
}

impl CurveRecord {
    /// The record of a curve of a scene.
    pub fn new(scene: &Scene, curve: &GrazingCurve) -> Self {
        let model = &scene.model;
        let at = |special: &SpecialPoint| named(parameter_names(model), &special.point.parameters);
        Self {
            points: curve
                .points
                .iter()
                .map(|point| CurvePointRecord::new(model, point))
                .collect(),
            codim2: curve
                .codim2()
                .map(|(n, at_zero)| Codim2Record {
                    n,
                    parameters: at(at_zero),
                    physical: at_zero.point.is_physical(),
                })
                .collect(),
            folds: curve
                .folds()
                .map(|(parameter, fold)| FoldRecord {
                    parameter: model.parameters[parameter].name.clone(),
                    parameters: at(fold),
                })
                .collect(),
            multiplier_switches: curve
                .multiplier_switches()
                .map(|switch| SwitchRecord {
                    parameters: at(switch),
                    multipliers: switch.point.multipliers.clone(),
                })
                .collect(),
            end: curve.end.to_string(),
        }
    }
}

impl CurvePointRecord {
    fn new(model: &Model, point: &CurvePoint) -> Self {
        Self {
            parameters: named(parameter_names(model), &point.parameters),
            state: named(model.full_state_names(), &point.state),
            multipliers: point.multipliers.clone(),
            xi: point.xi.clone(),
            physical: point.is_physical(),
        }
    }
}

fn parameter_names(model: &Model) -> impl Iterator<Item = &str> {
    model
        .parameters
        .iter()
        .map(|parameter| parameter.name.as_str())
}

fn named<'a>(names: impl IntoIterator<Item = &'a str>, values: &[f64]) -> Named {
    names
        .into_iter()
        .map(str::to_owned)
        .zip(values.iter().copied())
        .collect()
}
