//! `[window]` and `[emit]`: where the map is to be trusted, and the shape of its code.

use super::document::Table;
use super::lookup::{component, parameter_key};
use super::{Emit, Shape, Window};
use crate::model::error::Checked;
use crate::model::oscillator::Model;

/// Largest `y²` where the scene names none.
const DEPTH: f64 = 1e-3;

/// Points per call of the lane kernel where the scene names none.
const LANES: u64 = 8;

/// Most points per call of the lane kernel.
const MOST_LANES: u64 = 64;

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

/// Reads `[emit]`.
pub(super) fn read_emit(table: Option<&Table<'_>>) -> Checked<Emit> {
    let mut emit = Emit {
        shape: Shape::Auto,
        lanes: LANES as usize,
    };
    let Some(table) = table else { return Ok(emit) };
    table.only(&["shape", "lanes"])?;
    if let Some(shape) = table.field("shape") {
        let options = [
            ("auto", Shape::Auto),
            ("factored", Shape::Factored),
            ("composed", Shape::Composed),
            ("flown", Shape::Flown),
        ];
        emit.shape = shape.choice(&options, "\"factored\", \"composed\", \"flown\", \"auto\"")?;
    }
    if let Some(lanes) = table.field("lanes") {
        emit.lanes = lanes.count(1, MOST_LANES)? as usize;
    }
    Ok(emit)
}
