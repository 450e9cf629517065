//! `[emit]`: the shape of the code, and the numbers it computes with.

use super::document::Table;
use super::{Emit, EmitPrecision, Orders, Shape};
use crate::model::error::{Checked, Fault};
use crate::model::problem::SceneProblem;
use crate::numeric::FloatFormat;

/// Keys of `[emit]`.
const KEYS: [&str; 3] = ["shape", "precision", "lanes"];

/// Most points per call of the lane kernel.
const MOST_LANES: u64 = 64;

/// Reads `[emit]`; without it, the shape is left open and the precision is double.
pub(super) fn read(table: Option<&Table<'_>>, orders: Orders) -> Checked<Emit> {
    let mut emit = Emit {
        shape: Shape::Auto,
        precision: EmitPrecision::Given(FloatFormat::F64),
        lanes: None,
    };
    let Some(table) = table else { return Ok(emit) };
    table.only(&KEYS)?;
    if let Some(shape) = table.field("shape") {
        let options = [
            ("auto", Shape::Auto),
            ("factored", Shape::Factored),
            ("composed", Shape::Composed),
            ("flown", Shape::Flown),
        ];
        emit.shape = shape.choice(&options, "\"factored\", \"composed\", \"flown\", \"auto\"")?;
    }
    if let Some(precision) = table.field("precision") {
        let options = [
            ("f64", EmitPrecision::Given(FloatFormat::F64)),
            ("f32", EmitPrecision::Given(FloatFormat::F32)),
            ("any", EmitPrecision::Any),
        ];
        emit.precision = precision.choice(&options, "\"f64\", \"f32\", \"any\"")?;
        if emit.precision == EmitPrecision::Any && !matches!(orders, Orders::Tolerance(_)) {
            return Err(Fault::at(precision.span(), SceneProblem::NeedsTolerance));
        }
    }
    if let Some(lanes) = table.field("lanes") {
        emit.lanes = Some(lanes.count(1, MOST_LANES)? as usize);
    }
    Ok(emit)
}
