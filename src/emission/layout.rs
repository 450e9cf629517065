//! Layout of a module: the values that templates insert, the provenance header, and the templates,
//! which hold only layout.

use super::error::EmissionError;
use super::language::{Language, PrintedKernel, print};
use super::names::{comment, number_literal};
use super::options::{EmitOptions, EmittedShape, FORMAT, Target};
use crate::expansion::{LocalMap, MapKernel, MapOrders, PruneReport, SectionKind};
use crate::jet::kernel::{Kernel, OperationCount, SplitKernel};
use crate::numeric::FloatFormat;

/// Values for the templates: a map, its kernels and its constants, as text in the target language.
pub(super) fn arrange(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    (split, step, tangent): (&SplitKernel, &Kernel, Option<&Kernel>),
    pruned: Option<PruneReport>,
) -> Result<MapLayout, EmissionError> {
    let language = Language { target: options.target, precision: options.precision };
    let prepare = print(language, &split.prepare, |number| language.element("parameters", number))?;
    let free = lowered.dimension;
    // NOTE: a tangent vector stands between coordinates and coefficients.
    let known = if tangent.is_some() { 2 * free } else { free };
    let input = |number: usize| match number {
        number if number < free => format!("x{number}"),
        number if number < known => language.element("tangent", number - free),
        number => language.coefficient(number - known),
    };
    let (step_text, jacobian) =
        (print(language, step, input)?, print(language, &split.run, input)?);
    let tangent = match tangent {
        Some(tangent) => print(language, tangent, input)?,
        None => PrintedKernel { statements: Vec::new(), outputs: Vec::new() },
    };
    let variable = |number: usize| match number.checked_sub(free) {
        None => format!("x{number}"),
        Some(parameter) => language.element("parameters", parameter),
    };
    let derivatives = match options.derivatives {
        true => print(language, &lowered.with_derivatives(), variable)?,
        false => PrintedKernel { statements: Vec::new(), outputs: Vec::new() },
    };
    let passages = lowered.passages;
    let (image, depths) = step_text.outputs.split_at(free);
    let rows = |printed: &PrintedKernel, width: usize| -> Vec<String> {
        let rows = printed.outputs.get(free + passages..).unwrap_or_default();
        rows.chunks(width.max(1)).map(|row| row.join(", ")).collect()
    };
    let part = |printed: &PrintedKernel, place: std::ops::Range<usize>| -> Vec<String> {
        printed.outputs.get(place).unwrap_or_default().to_vec()
    };
    Ok(MapLayout {
        header: header(map, options, lowered, step, pruned)?,
        target: options.target.word(),
        real: language.real(),
        suffix: language.suffix(),
        capital: language.suffix().to_uppercase(),
        largest: language.largest(),
        identifier: map.scene.clone(),
        upper: map.scene.to_ascii_uppercase(),
        dimension: free,
        parameters: lowered.parameters,
        passages,
        coefficients: split.coefficients,
        lanes: options.lanes,
        orders: map.orders,
        scene: language.string(&map.scene),
        digest: format!("0x{}", map.digest),
        section: language.string(section_word(map.section.kind)),
        coordinate_names: map
            .section
            .coordinates
            .iter()
            .map(|name| language.string(name))
            .collect(),
        parameter_names: map
            .parameters
            .iter()
            .map(|parameter| language.string(&parameter.name))
            .collect(),
        point: finite(
            "a coordinate of the section's point",
            map.section.point.iter().map(|value| value.to_f64()),
        )?,
        grazing: finite(
            "a grazing parameter",
            map.parameters.iter().map(|parameter| parameter.value.to_f64()),
        )?,
        window_depth: language.half_width(map.window.depth)?,
        window_state: half_widths(language, &map.window.state)?,
        window_parameters: half_widths(language, &map.window.parameter)?,
        inside_state: inside(language, "state", &map.window.state)?,
        inside_parameters: inside(language, "parameters", &map.window.parameter)?,
        tolerance: language.optional("the tolerance", options.tolerance)?,
        measured_error: language.optional("the measured error", options.measured_error)?,
        prepare_outputs: prepare.outputs,
        prepare_statements: prepare.statements,
        image: image.to_vec(),
        depths: depths.to_vec(),
        step_statements: step_text.statements,
        jacobian_image: jacobian.outputs[..free].to_vec(),
        jacobian_depths: jacobian.outputs[free..free + passages].to_vec(),
        jacobian_rows: rows(&jacobian, free),
        jacobian_entries: jacobian.outputs[free + passages..].to_vec(),
        tangent_image: part(&tangent, 0..free),
        tangent_depths: part(&tangent, free..free + passages),
        tangent_carried: part(&tangent, free + passages..tangent.outputs.len()),
        tangent_statements: tangent.statements,
        derivatives: options.derivatives,
        derivatives_image: part(&derivatives, 0..free),
        derivatives_depths: part(&derivatives, free..free + passages),
        derivatives_rows: rows(&derivatives, free + lowered.parameters),
        derivatives_entries: part(&derivatives, free + passages..derivatives.outputs.len()),
        derivatives_statements: derivatives.statements,
        jacobian_statements: jacobian.statements,
    })
}

fn finite(
    what: &'static str,
    values: impl Iterator<Item = f64>,
) -> Result<Vec<String>, EmissionError> {
    values.map(|value| number_literal(what, value)).collect()
}

fn half_widths(language: Language, values: &[f64]) -> Result<Vec<String>, EmissionError> {
    values.iter().map(|&value| language.half_width(value)).collect()
}

/// C conditions that the numbers of an array lie within half-widths. NaN violates every condition;
/// an infinite half-width requires only that the number is not NaN.
fn inside(
    language: Language,
    array: &str,
    half_widths: &[f64],
) -> Result<Vec<String>, EmissionError> {
    let condition = |(number, &width): (usize, &f64)| {
        if width == f64::INFINITY {
            return Ok(format!("{array}[{number}] == {array}[{number}]"));
        }
        let literal = language.half_width(width)?;
        let suffix = language.suffix();
        Ok(format!("fabs{suffix}({array}[{number}]) <= {literal}"))
    };
    half_widths.iter().enumerate().map(condition).collect()
}

/// Lines of the provenance header after the first.
pub(super) fn header(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    step: &Kernel,
    pruned: Option<PruneReport>,
) -> Result<Vec<String>, EmissionError> {
    let names = |names: Vec<&str>| comment(&names.join(", "));
    let coordinates = names(map.section.coordinates.iter().map(String::as_str).collect());
    let parameters =
        names(map.parameters.iter().map(|parameter| parameter.name.as_str()).collect());
    let passages = names(map.surfaces.iter().map(String::as_str).collect());
    let shape = match options.shape {
        EmittedShape::Factored if map.is_flown() => "flown",
        EmittedShape::Factored => "factored",
        EmittedShape::Composed => "composed",
    };
    let (all, frozen) = (lowered.kernel.count(), step.count());
    let mut lines = vec![
        format!("Scene {}, digest {}.", comment(&map.scene), map.digest),
        format!("Section: {}{}.", section_word(map.section.kind), phase(map)?),
        format!("Coordinates: {coordinates}."),
        format!("Parameters: {parameters}."),
        format!("Passages: {passages}."),
        format!(
            "Orders: smooth_order {}, contact_weight {}.",
            map.orders.smooth_order, map.orders.contact_weight
        ),
        match options.target {
            Target::Rust => format!("Shape: {shape}, {} lanes.", options.lanes),
            _ => format!("Shape: {shape}."),
        },
        format!("Window: depth {}.", depth(map.window.depth)?),
        format!(
            "Tolerance asked {}, error on the window {}.",
            stated(options.tolerance, "none"),
            stated(options.measured_error, "not measured")
        ),
    ];
    if options.precision == FloatFormat::F32 {
        lines.push("Precision: f32, coefficients, states, parameters and every operation.".into());
    }
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
    let mut lines: Vec<String> = lines.iter().flat_map(|line| wrapped(line)).collect();
    // NOTE: a command broken into two lines could not be run.
    let command = options.command();
    lines.push(format!("Regenerate: {command}"));
    lines.push(format!("Verify: {command} --check"));
    Ok(lines)
}

/// Splits a line into pieces of at most 112 characters.
fn wrapped(line: &str) -> Vec<String> {
    let characters: Vec<char> = line.chars().collect();
    characters.chunks(112).map(|part| part.iter().collect()).collect()
}

/// Phase of a stroboscopic section as text; empty for a tangency section.
fn phase(map: &LocalMap) -> Result<String, EmissionError> {
    let Some(phase) = map.section.phase else {
        return Ok(String::new());
    };
    let phase = number_literal("the phase of the section", phase.to_f64())?;
    Ok(format!(" at the phase {phase}"))
}

fn counted(count: OperationCount) -> String {
    let OperationCount { multiply_adds, products, sums, roots } = count;
    format!("{multiply_adds} multiply-adds, {products} products, {sums} sums, {roots} roots")
}

fn stated(value: Option<f64>, otherwise: &str) -> String {
    value.map_or(otherwise.into(), |value| format!("{value:?}"))
}

/// Depth of the window as text; it may be unbounded.
fn depth(value: f64) -> Result<String, EmissionError> {
    if value == f64::INFINITY {
        Ok("unbounded".into())
    } else {
        number_literal("the depth of the window", value)
    }
}

pub(super) fn section_word(kind: SectionKind) -> &'static str {
    match kind {
        SectionKind::Tangency => "tangency",
        SectionKind::Stroboscopic => "stroboscopic",
    }
}

/// Values inserted by the map templates, templates/map.*.tera.
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct MapLayout {
    pub(super) header: Vec<String>,
    /// Word of the target.
    pub(super) target: &'static str,
    /// Type of states, parameters and coefficients.
    pub(super) real: &'static str,
    /// Suffix in C of single-precision literals and names, lower case and capital; empty in double
    /// precision.
    pub(super) suffix: &'static str,
    pub(super) capital: String,
    /// Largest finite number of that type.
    pub(super) largest: String,
    pub(super) identifier: String,
    /// The identifier in capitals, for the names of macros.
    pub(super) upper: String,
    pub(super) dimension: usize,
    pub(super) parameters: usize,
    pub(super) passages: usize,
    pub(super) coefficients: usize,
    pub(super) lanes: usize,
    #[serde(flatten)]
    pub(super) orders: MapOrders,
    pub(super) scene: String,
    pub(super) digest: String,
    pub(super) section: String,
    pub(super) coordinate_names: Vec<String>,
    pub(super) parameter_names: Vec<String>,
    pub(super) point: Vec<String>,
    pub(super) grazing: Vec<String>,
    pub(super) window_depth: String,
    pub(super) window_state: Vec<String>,
    pub(super) window_parameters: Vec<String>,
    /// Conditions in C that a state lies in the window.
    pub(super) inside_state: Vec<String>,
    /// Conditions in C that parameters lie in the window.
    pub(super) inside_parameters: Vec<String>,
    pub(super) tolerance: String,
    pub(super) measured_error: String,
    pub(super) prepare_statements: Vec<String>,
    pub(super) prepare_outputs: Vec<String>,
    pub(super) step_statements: Vec<String>,
    pub(super) image: Vec<String>,
    pub(super) depths: Vec<String>,
    pub(super) jacobian_statements: Vec<String>,
    pub(super) jacobian_image: Vec<String>,
    pub(super) jacobian_depths: Vec<String>,
    pub(super) jacobian_rows: Vec<String>,
    pub(super) jacobian_entries: Vec<String>,
    /// Kernel of a step that propagates a tangent vector, in CUDA.
    pub(super) tangent_statements: Vec<String>,
    pub(super) tangent_image: Vec<String>,
    pub(super) tangent_depths: Vec<String>,
    pub(super) tangent_carried: Vec<String>,
    /// Whether there is a step with derivatives by the coordinates, then the parameters.
    pub(super) derivatives: bool,
    pub(super) derivatives_statements: Vec<String>,
    pub(super) derivatives_image: Vec<String>,
    pub(super) derivatives_depths: Vec<String>,
    pub(super) derivatives_rows: Vec<String>,
    pub(super) derivatives_entries: Vec<String>,
}

/// Text of a map's module.
pub(super) fn map(target: Target, layout: &MapLayout) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("map", layout);
    let (name, text) = target.syntax().template;
    render(name, text, context)
}

/// Manifest of a standalone crate.
pub(super) fn manifest(package: &str) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("package", package);
    render("crate_cargo.toml.tera", include_str!("../../templates/crate_cargo.toml.tera"), context)
}

/// Root of a standalone crate.
pub(super) fn standalone_root(module: &str) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("module", module);
    render("crate_lib.rs.tera", include_str!("../../templates/crate_lib.rs.tera"), context)
}

/// Root of the catalogue's crate.
pub(super) fn catalogue_root(modules: &[&str]) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("modules", modules);
    render("catalogue_lib.rs.tera", include_str!("../../templates/catalogue_lib.rs.tera"), context)
}

fn render(name: &str, template: &str, mut context: tera::Context) -> Result<String, EmissionError> {
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("format", &FORMAT);
    let mut templates = tera::Tera::default();
    templates.autoescape_on(Vec::<&str>::new());
    templates.add_raw_template(name, template)?;
    Ok(templates.render(name, &context)?)
}
