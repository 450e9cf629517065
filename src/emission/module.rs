//! Emitted module: a map's kernel, constants and provenance.

use std::borrow::Cow;

use super::error::EmissionError;
use super::layout;
use super::layout::arrange;
use super::names::checked_identifier;
use super::options::{EmitOptions, EmittedShape, Target};
use super::wasm;
use crate::expansion::{
    ComposedMap, LocalMap, MapKernel, PruneReport, Stage, prune, prune_composed,
};
use crate::jet::kernel::{Kernel, OperationCount, SplitKernel, Value};
use crate::numeric::FloatFormat;

/// Emitted module without dependencies: source text, or WebAssembly bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct EmittedModule {
    /// Language of the module.
    pub target: Target,
    /// Number format of the computation.
    pub precision: FloatFormat,
    /// Name of the module: the scene's identifier.
    pub identifier: String,
    /// Content of the module's file.
    pub content: Vec<u8>,
    /// Operation count of a step, freezing included.
    pub step_operations: OperationCount,
    /// Operation count of a step of the frozen map.
    pub frozen_operations: OperationCount,
    /// Operation count of a step of the frozen map with its Jacobian.
    pub jacobian_operations: OperationCount,
    /// Monomials dropped within the tolerance.
    pub pruned: Option<PruneReport>,
    /// Measured error on the window.
    pub measured_error: Option<f64>,
}

impl EmittedModule {
    /// Source text; for WebAssembly, its readable part.
    pub fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.content)
    }
}

/// Emits a map as a module.
///
/// `composed` is the map's composed form, needed only for the composed shape.
///
/// # Errors
///
/// [`EmissionError`] for a scene identifier that cannot name a module, numbers that are not finite
/// in the precision asked for, single precision in a language of doubles, a number of lanes outside
/// 1 to 64, and a composed shape without a composed form.
pub fn emitted_module(
    map: &LocalMap,
    composed: Option<&ComposedMap>,
    options: &EmitOptions,
) -> Result<EmittedModule, EmissionError> {
    let identifier = checked_identifier(&map.scene)?.to_owned();
    if !(1..=64).contains(&options.lanes) {
        return Err(EmissionError::Lanes { lanes: options.lanes });
    }
    if options.target.is_double_only() && options.precision != FloatFormat::F64 {
        return Err(EmissionError::SingleInDouble { target: options.target.word() });
    }
    check_shapes(map)?;
    let (lowered, pruned) = lower(map, composed, options)?;
    let (split, tangent) = match options.target {
        Target::Cuda => split_with_tangent(&lowered),
        _ => (lowered.with_jacobian().split(lowered.dimension), None),
    };
    let step = step_kernel(&split, &lowered);
    let content = match options.target {
        Target::Wasm => wasm::module(map, options, &lowered, &split, &step, pruned)?,
        target => {
            let tangent = tangent.as_ref();
            let layout = arrange(map, options, &lowered, (&split, &step, tangent), pruned)?;
            layout::map(target, &layout)?.into_bytes()
        }
    };
    Ok(EmittedModule {
        target: options.target,
        precision: options.precision,
        identifier,
        content,
        step_operations: lowered.kernel.count(),
        frozen_operations: step.count(),
        jacobian_operations: split.run.count(),
        pruned,
        measured_error: options.measured_error,
    })
}

fn check_shapes(map: &LocalMap) -> Result<(), EmissionError> {
    let dimension = map.dimension();
    let check = |what, expected, found| {
        if expected == found { Ok(()) } else { Err(EmissionError::Shape { what, expected, found }) }
    };
    check("point of the section", dimension, map.section.point.len())?;
    check("half-widths of the state", dimension, map.window.state.len())?;
    check("half-widths of the parameters", map.parameters.len(), map.window.parameter.len())?;
    for stage in &map.stages {
        match stage {
            Stage::Leg(leg) => check("polynomials of a leg", dimension, leg.image.len())?,
            Stage::Flown(flown) => {
                check("corrections of a flown contact", dimension, flown.dimension())?;
            }
            Stage::Contact(contact) => {
                check("linear polynomials of a contact", dimension, contact.linear.len())?;
                check("quadratic polynomials of a contact", dimension, contact.quadratic.len())?;
                for term in &contact.powers.terms {
                    let [linear, quadratic] = [term.linear.len(), term.quadratic.len()];
                    check("polynomials of a power", 2 * dimension, linear + quadratic)?;
                }
            }
        }
    }
    Ok(())
}

/// Lowers a map to a kernel in the shape asked for. Also returns the monomials dropped.
fn lower(
    map: &LocalMap,
    composed: Option<&ComposedMap>,
    options: &EmitOptions,
) -> Result<(MapKernel, Option<PruneReport>), EmissionError> {
    match (options.shape, composed, options.drop_within) {
        (EmittedShape::Composed, None, _) => Err(EmissionError::NoComposedForm),
        (EmittedShape::Composed, Some(form), None) => Ok((MapKernel::composed(map, form), None)),
        (EmittedShape::Composed, Some(form), Some(tolerance)) => {
            let (form, report) = prune_composed(map, form, tolerance);
            Ok((MapKernel::composed(map, &form), Some(report)))
        }
        (EmittedShape::Factored, _, None) => Ok((MapKernel::factored(map), None)),
        (EmittedShape::Factored, _, Some(tolerance)) => {
            let (map, report) = prune(map, tolerance);
            Ok((MapKernel::factored(&map), Some(report)))
        }
    }
}

/// Splits off two frozen steps: one with the Jacobian, one that propagates a tangent vector. They
/// share their coefficients, which stand after the coordinates and the vector.
fn split_with_tangent(map: &MapKernel) -> (SplitKernel, Option<Kernel>) {
    let (dimension, first) = (map.dimension, map.dimension + map.passages);
    let mut split = map.with_tangent().split(2 * dimension);
    let outputs = split.run.outputs.clone();
    let (values, rows) = outputs.split_at(first);
    let rows = || rows.chunks_exact(dimension + 1);
    let choose = |derivatives: Vec<Value>| {
        let outputs = [values, &derivatives].concat();
        Kernel { outputs, ..split.run.clone() }.without_dead_operations()
    };
    let jacobian = choose(rows().flat_map(|row| &row[..dimension]).copied().collect());
    let tangent = choose(rows().map(|row| row[dimension]).collect());
    split.run = jacobian;
    (split, Some(tangent))
}

/// Frozen step alone, extracted from the frozen step with Jacobian: they share coefficients.
fn step_kernel(split: &SplitKernel, map: &MapKernel) -> Kernel {
    let mut kernel = split.run.clone();
    kernel.outputs.truncate(map.dimension + map.passages);
    kernel.without_dead_operations()
}
