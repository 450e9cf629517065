//! `[window]`: where the map is to be trusted.

use super::Window;
use super::document::Table;
use super::lookup::{component, parameter_key};
use crate::model::error::Checked;
use crate::model::oscillator::Model;

/// Largest `y²` where the scene names none.
const DEPTH: f64 = 1e-3;

/// Reads `[window]`; what it does not name is unbounded, but for the depth.
pub(super) fn read(table: Option<&Table<'_>>, model: &Model) -> Checked<Window> {
    let mut window = Window {
        depth: DEPTH,
        state: vec![f64::INFINITY; model.dimension()],
        parameter: vec![f64::INFINITY; model.parameters.len()],
    };
    let Some(table) = table else {
        return Ok(window);
    };
    table.only(&["depth", "state", "parameter"])?;
    if let Some(depth) = table.field("depth") {
        window.depth = depth.positive()?.hi;
    }
    if let Some(states) = table.field("state") {
        for field in states.table()?.fields() {
            window.state[component(&field, model)?] = field.positive()?.hi;
        }
    }
    if let Some(parameters) = table.field("parameter") {
        for field in parameters.table()?.fields() {
            window.parameter[parameter_key(&field, model)?] = field.positive()?.hi;
        }
    }
    Ok(window)
}
