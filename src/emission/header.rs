//! The provenance that heads an emitted module.

use super::EmissionError;
use super::module::{EmitOptions, EmittedShape};
use super::names::{comment, number_literal};
use super::pruning::PruneReport;
use super::target::Target;
use crate::expansion::{LocalMap, MapKernel, SectionKind};
use crate::jet::kernel::{Kernel, OperationCount};
use crate::numeric::FloatFormat;

/// The lines of the provenance header, after the first.
pub(super) fn header(
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
        format!("Scene {}, digest {}.", comment(&map.scene), map.digest),
        format!(
            "Section: {}{}.",
            section_word(map.section.kind),
            phase(map)?
        ),
        format!("Coordinates: {coordinates}."),
        format!("Parameters: {parameters}."),
        format!("Passages: {passages}."),
        format!(
            "Orders: smooth_order {}, contact_weight {}.",
            map.orders.smooth_order, map.orders.contact_weight
        ),
        match options.target {
            Target::Rust => format!("Shape: {shape}, {} lanes.", options.lanes),
            Target::C | Target::Cuda => format!("Shape: {shape}."),
        },
        format!("Window: depth {}.", depth(map.window.depth)?),
        format!(
            "Tolerance asked {}, error measured {}.",
            stated(options.tolerance),
            stated(options.measured_error)
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

/// The phase of a stroboscopic section; nothing on another.
fn phase(map: &LocalMap) -> Result<String, EmissionError> {
    let Some(phase) = map.section.phase else {
        return Ok(String::new());
    };
    let phase = number_literal("the phase of the section", phase.to_f64())?;
    Ok(format!(" at the phase {phase}"))
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

/// The depth of the window, which may be unbounded.
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
