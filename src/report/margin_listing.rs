//! The smallest change of parameters that grazes as data: the fields of `curve --nearest --json`.

use serde::Serialize;

use super::{Cell, Column, Named, ReportError, Table};
use crate::model::Scene;
use crate::numeric::Shown;
use crate::orbit::{CurveEnd, Margin};

/// The nearest graze of a scene, ready to be written as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct MarginListing {
    /// Euclidean length of the changes in their scales.
    pub margin: f64,
    /// The parameters that change.
    pub changes: Vec<MarginParameter>,
    /// All parameters at the nearest graze.
    pub parameters: Named<f64>,
    /// Full state at the graze.
    pub state: Named<f64>,
    /// Derivative of the margin in every parameter of the model.
    pub sensitivities: Named<f64>,
    /// Whether the free orbit stays clear of the surface at the scene's values.
    pub clears: bool,
    /// Whether the distance is stationary there; otherwise it is an end of the curve.
    pub stationary: bool,
    /// Ends of the curve that was searched; none of one parameter.
    pub searched: Vec<MarginEnd>,
}

/// One parameter that changes.
#[derive(Clone, Debug, Serialize)]
pub struct MarginParameter {
    /// Its name.
    pub parameter: String,
    /// The scene's value.
    pub value: f64,
    /// The value at the nearest graze.
    pub nearest: f64,
    /// Their difference.
    pub change: f64,
    /// What changes are counted in.
    pub scale: f64,
}

/// An end of the curve that was searched.
#[derive(Clone, Debug, Serialize)]
pub struct MarginEnd {
    /// The parameter that the curve was followed in.
    pub parameter: String,
    /// Its value there.
    pub to: f64,
    /// How it ended, in words.
    pub end: String,
    /// Whether nothing beyond can be nearer.
    pub reached: bool,
}

impl MarginListing {
    /// The margin of a scene.
    pub fn new(scene: &Scene, margin: &Margin) -> Self {
        let names = scene.model.parameter_names();
        let change = |(number, &parameter): (usize, &usize)| MarginParameter {
            parameter: names[parameter].to_owned(),
            value: scene.model.parameters[parameter].value.to_f64(),
            nearest: margin.nearest[parameter].to_f64(),
            change: margin.changes[number],
            scale: margin.scales[number],
        };
        let with = margin.parameters.get(1).map_or("", |&parameter| names[parameter]);
        let end = |(to, end): &(f64, CurveEnd)| MarginEnd {
            parameter: with.to_owned(),
            to: *to,
            end: end.to_string(),
            reached: matches!(end, CurveEnd::Reached | CurveEnd::LeftRange),
        };
        let states = scene.model.full_state_names().into_iter();
        Self {
            margin: margin.distance,
            changes: margin.parameters.iter().enumerate().map(change).collect(),
            parameters: Named::new(
                names.iter().copied().zip(margin.nearest.iter().map(|value| value.to_f64())),
            ),
            state: Named::new(states.zip(margin.state.iter().copied())),
            sensitivities: Named::new(
                names.iter().copied().zip(margin.sensitivities.iter().copied()),
            ),
            clears: margin.clears,
            stationary: margin.stationary,
            searched: margin.range.iter().flatten().map(end).collect(),
        }
    }

    /// The changes as a table, one row a parameter of the model that changes.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has one cell for every column.
    pub fn table(&self) -> Result<Table, ReportError> {
        let columns = ["value", "nearest", "change", "scale", "change/scale", "sensitivity"];
        let columns = columns.map(Column::number).into_iter();
        let mut table =
            Table::new([Column::text("parameter")].into_iter().chain(columns).collect());
        for at in &self.changes {
            let sensitivity = self.sensitivities.get(&at.parameter).copied();
            table.push(vec![
                Cell::text(at.parameter.clone()),
                Cell::number(at.value, 15),
                Cell::number(at.nearest, 15),
                Cell::number(at.change, 12),
                Cell::number(at.scale, 6),
                Cell::number(at.change / at.scale, 12),
                sensitivity.map_or(Cell::Missing, |value| Cell::number(value, 6)),
            ])?;
        }
        Ok(table)
    }

    /// The margin as a person reads it.
    ///
    /// # Errors
    ///
    /// As [`table`](Self::table).
    pub fn text(&self) -> Result<String, ReportError> {
        let pairs = |named: &Named<f64>, digits: usize| -> String {
            let pairs = named.0.iter();
            let pairs = pairs.map(|(name, value)| format!("{name} = {value:.digits$e}"));
            pairs.collect::<Vec<_>>().join(", ")
        };
        let mut text = format!(
            "margin {:.12e}: the smallest change that grazes, in the scales below\n\n{}\n",
            self.margin,
            self.table()?.to_text()
        );
        text.push_str(match self.clears {
            true => "at the scene's values the free orbit stays clear of the stop\n",
            false => "at the scene's values the free orbit would go beyond the stop\n",
        });
        text.push_str(&format!("graze at {}\n", pairs(&self.state, 9)));
        text.push_str(&format!("margin per change of a parameter: {}\n", {
            pairs(&self.sensitivities, 5)
        }));
        if !self.stationary {
            text.push_str("note: the nearest point is an end of the curve found, not a minimum\n");
        }
        for end in &self.searched {
            let (name, to) = (&end.parameter, Shown(end.to));
            text.push_str(&match end.reached {
                true => format!("searched along the curve to {name} = {to}\n"),
                false => format!(
                    "warning: the curve may come nearer beyond {name} = {to}, where it was lost: \
                     {}\n",
                    end.end
                ),
            });
        }
        Ok(text)
    }
}
