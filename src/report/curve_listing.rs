//! A grazing curve as data: the fields of `curve --json`.

use serde::Serialize;

use super::number::counted;
use super::orbit_listing::{ConditionsListing, surface_of};
use super::{Cell, Column, Named, ReportError, Table};
use crate::model::Scene;
use crate::numeric::Shown;
use crate::orbit::{CurvePoint, GrazingCurve, SpecialKind, SpecialPoint};

/// A grazing curve in two parameters, ready to be written as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct CurveListing {
    /// The adjusted parameters, then the one continued in.
    pub free: Vec<String>,
    /// Points in order.
    pub points: Vec<CurvePointListing>,
    /// Points where a `xi_n` vanishes.
    pub codim2: Vec<Codimension2>,
    /// Points where a parameter turns back.
    pub folds: Vec<FoldListing>,
    /// Points where multipliers change between real and complex.
    pub multiplier_switches: Vec<SwitchListing>,
    /// Stretches on which more special points may lie.
    pub unresolved: Vec<UnresolvedListing>,
    /// How the curve ended, in words.
    pub end: String,
}

/// One grazing orbit of a curve.
#[derive(Clone, Debug, Serialize)]
pub struct CurvePointListing {
    /// All parameters.
    pub parameters: Named<f64>,
    /// Full state at the graze.
    pub state: Named<f64>,
    /// `h''`.
    pub normal_acceleration: f64,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, ...` from the first passage to itself.
    pub xi: Vec<f64>,
    /// `xi_n` from every passage to every passage.
    pub conditions: Vec<ConditionsListing>,
    /// Whether the orbit stays on the free side of every surface.
    pub physical: bool,
}

/// A point where `xi_n = 0` between two passages.
#[derive(Clone, Debug, Serialize)]
pub struct Codimension2 {
    /// `n`.
    pub n: usize,
    /// The passage that stretches, from 0.
    pub from: usize,
    /// The passage whose gap neither opens nor closes, from 0.
    pub to: usize,
    /// Names of their surfaces.
    pub surfaces: [String; 2],
    /// All parameters.
    pub parameters: Named<f64>,
}

/// A point where the curve turns back in a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct FoldListing {
    /// The parameter that turns.
    pub parameter: String,
    /// All parameters.
    pub parameters: Named<f64>,
}

/// A point where multipliers change between real and complex.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchListing {
    /// All parameters.
    pub parameters: Named<f64>,
    /// Multipliers there.
    pub multipliers: Vec<[f64; 2]>,
}

/// A stretch on which not all special points of a kind are known.
#[derive(Clone, Debug, Serialize)]
pub struct UnresolvedListing {
    /// What vanishes at the special points, in words.
    pub of: String,
    /// All parameters where the stretch begins.
    pub from: Named<f64>,
    /// All parameters where it ends.
    pub to: Named<f64>,
}

impl CurveListing {
    /// The curve of a scene.
    pub fn new(scene: &Scene, curve: &GrazingCurve) -> Self {
        let name = |parameter: usize| scene.model.parameters[parameter].name.clone();
        let special = |point: &SpecialPoint| {
            named(scene, point.parameters.iter().map(|value| value.to_f64()))
        };
        Self {
            free: curve.free.iter().copied().map(name).collect(),
            points: curve.points.iter().map(|point| CurvePointListing::new(scene, point)).collect(),
            codim2: curve
                .codim2()
                .map(|(n, [from, to], point)| Codimension2 {
                    n,
                    from,
                    to,
                    surfaces: [from, to].map(|passage| surface_of(scene, passage)),
                    parameters: special(point),
                })
                .collect(),
            folds: curve
                .folds()
                .map(|(parameter, point)| FoldListing {
                    parameter: name(parameter),
                    parameters: special(point),
                })
                .collect(),
            multiplier_switches: curve
                .multiplier_switches()
                .map(|point| SwitchListing {
                    parameters: special(point),
                    multipliers: point.point.multipliers.clone(),
                })
                .collect(),
            unresolved: curve
                .unresolved
                .iter()
                .map(|stretch| {
                    let [from, to] =
                        [0, 1].map(|end| named(scene, stretch.ends[end].iter().copied()));
                    UnresolvedListing { of: function(scene, stretch.kind), from, to }
                })
                .collect(),
            end: curve.end.to_string(),
        }
    }

    /// How the curve went, as a person reads it, in the parameters that vary.
    pub fn text(&self) -> String {
        let mut text = format!("{}; {}\n", counted(self.points.len(), "point"), self.end);
        let at = |parameters: &Named<f64>| varying(parameters, &self.free);
        let several = self.points.iter().any(|point| point.conditions.len() > 1);
        for point in &self.codim2 {
            let [from, to] = &point.surfaces;
            let ends = if several {
                let (first, second) = (point.from + 1, point.to + 1);
                format!(" from passage {first} ({from}) to passage {second} ({to})")
            } else {
                String::new()
            };
            text.push_str(&format!("xi_{}{ends} = 0 at {}\n", point.n, at(&point.parameters)));
        }
        for fold in &self.folds {
            text.push_str(&format!("fold in {} at {}\n", fold.parameter, at(&fold.parameters)));
        }
        for switch in &self.multiplier_switches {
            text.push_str(&format!(
                "multipliers switch between real and complex at {}\n",
                at(&switch.parameters)
            ));
        }
        for stretch in &self.unresolved {
            text.push_str(&format!(
                "warning: {} may vanish more often than listed between {} and {}: its zeros there \
                 cannot be told apart\n",
                stretch.of,
                at(&stretch.from),
                at(&stretch.to)
            ));
        }
        text
    }

    /// The points as a table: parameters, state, multipliers, `xi_n`.
    ///
    /// # Errors
    ///
    /// Never in practice: every point has the same columns.
    pub fn table(&self) -> Result<Table, ReportError> {
        let mut table = Table::new(self.columns());
        for point in &self.points {
            let multipliers = point.multipliers.iter().flatten();
            let named = point.parameters.0.iter().chain(&point.state.0).map(|(_, value)| value);
            let others = point.other_conditions().flat_map(|pair| &pair.values);
            let numbers = named
                .chain([&point.normal_acceleration])
                .chain(multipliers)
                .chain(&point.xi)
                .chain(others);
            table.push(numbers.map(|&value| Cell::number(value, 12)).collect())?;
        }
        Ok(table)
    }

    fn columns(&self) -> Vec<Column> {
        let Some(point) = self.points.first() else {
            return Vec::new();
        };
        let named = point.parameters.0.iter().chain(&point.state.0).map(|(name, _)| name.clone());
        let multipliers = (1..=point.multipliers.len())
            .flat_map(|n| [format!("multiplier_{n}_re"), format!("multiplier_{n}_im")]);
        let xi = (1..=point.xi.len()).map(|n| format!("xi_{n}"));
        let others = point.other_conditions().flat_map(|pair| {
            let ends = format!("from_{}_to_{}", pair.from, pair.to);
            (1..=pair.values.len()).map(move |n| format!("xi_{n}_{ends}"))
        });
        named
            .chain(["normal_acceleration".to_owned()])
            .chain(multipliers)
            .chain(xi)
            .chain(others)
            .map(Column::number)
            .collect()
    }
}

impl CurvePointListing {
    fn new(scene: &Scene, point: &CurvePoint) -> Self {
        Self {
            parameters: named(scene, point.parameters.iter().copied()),
            state: Named::new(
                scene.model.full_state_names().into_iter().zip(point.state.iter().copied()),
            ),
            normal_acceleration: point.normal_acceleration,
            multipliers: point.multipliers.clone(),
            xi: point.xi.clone(),
            conditions: point
                .conditions
                .iter()
                .map(|pair| ConditionsListing::new(scene, pair.from, pair.to, pair.values.clone()))
                .collect(),
            physical: point.is_physical(),
        }
    }

    /// The conditions but those from the first passage to itself.
    fn other_conditions(&self) -> impl Iterator<Item = &ConditionsListing> {
        self.conditions.iter().skip(1)
    }
}

/// The function whose zeros are special points of a kind, in words.
fn function(scene: &Scene, kind: SpecialKind) -> String {
    match kind {
        SpecialKind::Codimension2 { n, .. } if scene.grazing.passages.len() == 1 => {
            format!("xi_{n}")
        }
        SpecialKind::Codimension2 { n, from, to } => {
            let (first, second) = (from + 1, to + 1);
            format!("xi_{n} from passage {first} to passage {second}")
        }
        SpecialKind::Fold { parameter } => {
            format!("the slope of {}", scene.model.parameters[parameter].name)
        }
        SpecialKind::MultiplierSwitch => "the discriminant of the multipliers".to_owned(),
        SpecialKind::Nearest => "the slope of the distance".to_owned(),
    }
}

fn named(scene: &Scene, values: impl Iterator<Item = f64>) -> Named<f64> {
    Named::new(scene.model.parameters.iter().map(|parameter| parameter.name.as_str()).zip(values))
}

fn varying(parameters: &Named<f64>, names: &[String]) -> String {
    let varying = parameters.0.iter().filter(|(name, _)| names.contains(name));
    let pairs: Vec<String> =
        varying.map(|(name, value)| format!("{name} = {:.12}", Shown(*value))).collect();
    pairs.join(", ")
}
