//! One emitted module: a map's kernel, its constants and its provenance.

use super::EmissionError;
use super::layout::{self, MapLayout};
use super::names::{checked_identifier, comment, number_literal, string_literal};
use super::printing::{PrintedKernel, print};
use super::pruning::{PruneReport, prune, prune_composed};
use crate::expansion::{ComposedMap, LocalMap, MapKernel, SectionKind, Stage};
use crate::jet::kernel::{Kernel, OperationCount, SplitKernel};

/// Number of the format of emitted modules; it changes with the templates and with the printing.
pub const FORMAT: u32 = 1;

/// Shape of an emitted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmittedShape {
    /// Stage after stage: `P_smooth ∘ D`; of a map with flown contacts, the flown shape.
    Factored,
    /// One polynomial pass.
    Composed,
}

/// What is asked of an emission.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitOptions {
    /// Shape of the step.
    pub shape: EmittedShape,
    /// Points per call of the lane kernels, 1 to 64.
    pub lanes: usize,
    /// Error that is asked for, absolute and per coordinate, for the header.
    pub tolerance: Option<f64>,
    /// Error of which dropped monomials may use a tenth, absolute and per coordinate; `None` keeps every monomial.
    pub drop_within: Option<f64>,
    /// Error that was measured on the window, for the header.
    pub measured_error: Option<f64>,
}

impl Default for EmitOptions {
    fn default() -> Self {
        Self {
            shape: EmittedShape::Factored,
            lanes: 8,
            tolerance: None,
            drop_within: None,
            measured_error: None,
        }
    }
}

/// An emitted module: a Rust source text without dependencies.
#[derive(Clone, Debug, PartialEq)]
pub struct EmittedModule {
    /// Name of the module: the scene's identifier.
    pub identifier: String,
    /// The source text.
    pub text: String,
    /// Operations of a step, freezing included.
    pub step_operations: OperationCount,
    /// Operations of a step of the frozen map.
    pub frozen_operations: OperationCount,
    /// Operations of a step of the frozen map with its Jacobian.
    pub jacobian_operations: OperationCount,
    /// What the tolerance dropped.
    pub pruned: Option<PruneReport>,
    /// Error that was measured on the window.
    pub measured_error: Option<f64>,
}

/// Emits a map.
///
/// `composed` is the map's composed form; it is needed for the composed shape only.
///
/// # Errors
///
/// [`EmissionError`] for a scene whose identifier cannot name a module, numbers that are not finite, a
/// number of lanes outside 1 to 64, and a composed shape without a composed form.
pub fn emitted_module(
    map: &LocalMap,
    composed: Option<&ComposedMap>,
    options: &EmitOptions,
) -> Result<EmittedModule, EmissionError> {
    let identifier = checked_identifier(&map.scene)?.to_owned();
    if !(1..=64).contains(&options.lanes) {
        return Err(EmissionError::Lanes {
            lanes: options.lanes,
        });
    }
    check_shapes(map)?;
    let (lowered, pruned) = lower(map, composed, options)?;
    let split = lowered.with_jacobian().split(lowered.dimension);
    let step = step_kernel(&split, &lowered);
    let layout = layout_of(map, options, &lowered, &split, &step, pruned)?;
    Ok(EmittedModule {
        identifier,
        text: layout::map(&layout)?,
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
        if expected == found {
            Ok(())
        } else {
            Err(EmissionError::Shape {
                what,
                expected,
                found,
            })
        }
    };
    check("point of the section", dimension, map.section.point.len())?;
    check(
        "half-widths of the state",
        dimension,
        map.window.state.len(),
    )?;
    check(
        "half-widths of the parameters",
        map.parameters.len(),
        map.window.parameter.len(),
    )?;
    for stage in &map.stages {
        match stage {
            Stage::Leg(leg) => check("polynomials of a leg", dimension, leg.image.len())?,
            Stage::Flown(flown) => {
                check(
                    "corrections of a flown contact",
                    dimension,
                    flown.dimension(),
                )?;
            }
            Stage::Contact(contact) => {
                check(
                    "linear polynomials of a contact",
                    dimension,
                    contact.linear.len(),
                )?;
                check(
                    "quadratic polynomials of a contact",
                    dimension,
                    contact.quadratic.len(),
                )?;
            }
        }
    }
    Ok(())
}

/// The map's kernel in the shape asked for, and what the tolerance dropped.
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

/// The frozen step alone, out of the frozen step with its Jacobian: the same coefficients serve both.
fn step_kernel(split: &SplitKernel, map: &MapKernel) -> Kernel {
    let mut kernel = split.run.clone();
    kernel.outputs.truncate(map.dimension + map.passages);
    kernel.without_dead_operations()
}

fn layout_of(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    split: &SplitKernel,
    step: &Kernel,
    pruned: Option<PruneReport>,
) -> Result<MapLayout, EmissionError> {
    let prepare = print(&split.prepare, |number| format!("parameters[{number}]"))?;
    let free = lowered.dimension;
    let input = |number: usize| {
        if number < free {
            format!("x{number}")
        } else {
            format!("c({})", number - free)
        }
    };
    let (step_text, jacobian) = (print(step, input)?, print(&split.run, input)?);
    let passages = lowered.passages;
    let (image, depths) = step_text.outputs.split_at(free);
    let rows = |printed: &PrintedKernel| -> Vec<String> {
        printed.outputs[free + passages..]
            .chunks(free.max(1))
            .map(|row| row.join(", "))
            .collect()
    };
    Ok(MapLayout {
        header: header(map, options, lowered, step, pruned)?,
        identifier: map.scene.clone(),
        dimension: free,
        parameters: lowered.parameters,
        passages,
        coefficients: split.coefficients,
        lanes: options.lanes,
        smooth_order: map.orders.smooth_order,
        contact_weight: map.orders.contact_weight,
        scene: string_literal(&map.scene),
        digest: format!("0x{:016x}", map.digest),
        section: string_literal(section_word(map.section.kind)),
        coordinate_names: map
            .section
            .coordinates
            .iter()
            .map(|name| string_literal(name))
            .collect(),
        parameter_names: map
            .parameters
            .iter()
            .map(|parameter| string_literal(&parameter.name))
            .collect(),
        point: finite(
            "a coordinate of the section's point",
            map.section.point.iter().map(|value| value.to_f64()),
        )?,
        grazing: finite(
            "a grazing parameter",
            map.parameters
                .iter()
                .map(|parameter| parameter.value.to_f64()),
        )?,
        window_depth: half_width(map.window.depth)?,
        window_state: half_widths(&map.window.state)?,
        window_parameters: half_widths(&map.window.parameter)?,
        tolerance: optional("the tolerance", options.tolerance)?,
        measured_error: optional("the measured error", options.measured_error)?,
        prepare_outputs: prepare.outputs,
        prepare_statements: prepare.statements,
        image: image.to_vec(),
        depths: depths.to_vec(),
        step_statements: step_text.statements,
        jacobian_image: jacobian.outputs[..free].to_vec(),
        jacobian_depths: jacobian.outputs[free..free + passages].to_vec(),
        jacobian_rows: rows(&jacobian),
        jacobian_statements: jacobian.statements,
    })
}

fn section_word(kind: SectionKind) -> &'static str {
    match kind {
        SectionKind::Tangency => "tangency",
        SectionKind::Stroboscopic => "stroboscopic",
    }
}

fn finite(
    what: &'static str,
    values: impl Iterator<Item = f64>,
) -> Result<Vec<String>, EmissionError> {
    values.map(|value| number_literal(what, value)).collect()
}

/// A half-width, which may be unbounded but not NaN.
fn half_width(value: f64) -> Result<String, EmissionError> {
    if value == f64::INFINITY {
        Ok("f64::INFINITY".into())
    } else {
        number_literal("a half-width of the window", value)
    }
}

fn half_widths(values: &[f64]) -> Result<Vec<String>, EmissionError> {
    values.iter().map(|&value| half_width(value)).collect()
}

fn optional(what: &'static str, value: Option<f64>) -> Result<String, EmissionError> {
    value.map_or(Ok("None".into()), |value| {
        Ok(format!("Some({})", number_literal(what, value)?))
    })
}

/// The lines of the provenance header, after the first.
fn header(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    step: &Kernel,
    pruned: Option<PruneReport>,
) -> Result<Vec<String>, EmissionError> {
    let names = |names: Vec<&str>| comment(&names.join(", "));
    let coordinates = names(map.section.coordinates.iter().map(String::as_str).collect());
    let parameters = names(
        map.parameters
            .iter()
            .map(|parameter| parameter.name.as_str())
            .collect(),
    );
    let passages = names(map.surfaces.iter().map(String::as_str).collect());
    let shape = match options.shape {
        EmittedShape::Factored if map.is_flown() => "flown",
        EmittedShape::Factored => "factored",
        EmittedShape::Composed => "composed",
    };
    let (all, frozen) = (lowered.kernel.count(), step.count());
    let mut lines = vec![
        format!("Scene {}, digest {:016x}.", comment(&map.scene), map.digest),
        format!("Section: {}.", section_word(map.section.kind)),
        format!("Coordinates: {coordinates}."),
        format!("Parameters: {parameters}."),
        format!("Passages: {passages}."),
        format!(
            "Orders: smooth_order {}, contact_weight {}.",
            map.orders.smooth_order, map.orders.contact_weight
        ),
        format!("Shape: {shape}, {} lanes.", options.lanes),
        format!("Window: depth {}.", half_width(map.window.depth)?),
        format!(
            "Tolerance asked {}, error measured {}.",
            stated(options.tolerance),
            stated(options.measured_error)
        ),
    ];
    if let Some(orders) = map.fitted_to {
        lines.push(format!(
            "Coefficients: economised, fitted on the window to smooth_order {}, contact_weight {}.",
            orders.smooth_order, orders.contact_weight
        ));
    }
    if let Some(report) = pruned {
        let bound = number_literal("the bound of the dropped monomials", report.bound)?;
        lines.push(format!(
            "Monomials: {} kept, {} dropped, which adds at most {bound}.",
            report.kept, report.dropped
        ));
    }
    lines.push(format!("A step: {}.", counted(all)));
    lines.push(format!("A frozen step: {}.", counted(frozen)));
    Ok(lines.into_iter().flat_map(|line| wrapped(&line)).collect())
}

/// A line of at most 112 characters, continued on further ones.
fn wrapped(line: &str) -> Vec<String> {
    let characters: Vec<char> = line.chars().collect();
    characters
        .chunks(112)
        .map(|part| part.iter().collect())
        .collect()
}

fn counted(count: OperationCount) -> String {
    let OperationCount {
        multiply_adds,
        products,
        sums,
        roots,
    } = count;
    format!("{multiply_adds} multiply-adds, {products} products, {sums} sums, {roots} roots")
}

fn stated(value: Option<f64>) -> String {
    value.map_or("none".into(), |value| format!("{value:?}"))
}
