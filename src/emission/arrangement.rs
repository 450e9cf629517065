//! From a map and its kernels to what a template lays out.

use super::EmissionError;
use super::header::{header, section_word};
use super::layout::MapLayout;
use super::module::EmitOptions;
use super::names::number_literal;
use super::printing::{PrintedKernel, print};
use super::pruning::PruneReport;
use super::target::Target;
use crate::expansion::{LocalMap, MapKernel, MapWindow};
use crate::jet::kernel::{Kernel, SplitKernel};

/// What the templates lay out: a map, its kernels and its constants, as text of the target's language.
pub(super) fn arrange(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    split: &SplitKernel,
    step: &Kernel,
    pruned: Option<PruneReport>,
) -> Result<MapLayout, EmissionError> {
    let target = options.target;
    let prepare = print(target, &split.prepare, |number| {
        format!("parameters[{number}]")
    })?;
    let free = lowered.dimension;
    let input = |number: usize| {
        if number < free {
            format!("x{number}")
        } else {
            target.coefficient(number - free)
        }
    };
    let (step_text, jacobian) = (
        print(target, step, input)?,
        print(target, &split.run, input)?,
    );
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
        target: target.word(),
        identifier: map.scene.clone(),
        upper: map.scene.to_ascii_uppercase(),
        dimension: free,
        parameters: lowered.parameters,
        passages,
        coefficients: split.coefficients,
        lanes: options.lanes,
        smooth_order: map.orders.smooth_order,
        contact_weight: map.orders.contact_weight,
        scene: target.string(&map.scene),
        digest: format!("0x{:016x}", map.digest),
        section: target.string(section_word(map.section.kind)),
        coordinate_names: map
            .section
            .coordinates
            .iter()
            .map(|name| target.string(name))
            .collect(),
        parameter_names: map
            .parameters
            .iter()
            .map(|parameter| target.string(&parameter.name))
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
        window_depth: target.half_width(map.window.depth)?,
        window_state: half_widths(target, &map.window.state)?,
        window_parameters: half_widths(target, &map.window.parameter)?,
        inside: inside(&map.window)?,
        tolerance: target.optional("the tolerance", options.tolerance)?,
        measured_error: target.optional("the measured error", options.measured_error)?,
        prepare_outputs: prepare.outputs,
        prepare_statements: prepare.statements,
        image: image.to_vec(),
        depths: depths.to_vec(),
        step_statements: step_text.statements,
        jacobian_image: jacobian.outputs[..free].to_vec(),
        jacobian_depths: jacobian.outputs[free..free + passages].to_vec(),
        jacobian_rows: rows(&jacobian),
        jacobian_entries: jacobian.outputs[free + passages..].to_vec(),
        jacobian_statements: jacobian.statements,
    })
}

fn finite(
    what: &'static str,
    values: impl Iterator<Item = f64>,
) -> Result<Vec<String>, EmissionError> {
    values.map(|value| number_literal(what, value)).collect()
}

fn half_widths(target: Target, values: &[f64]) -> Result<Vec<String>, EmissionError> {
    values
        .iter()
        .map(|&value| target.half_width(value))
        .collect()
}

/// Conditions in C that state and parameters lie in the window, false for a NaN; unbounded widths have none but that.
fn inside(window: &MapWindow) -> Result<Vec<String>, EmissionError> {
    let named = |name: &'static str, widths: &[f64]| {
        let condition = |(number, &width): (usize, &f64)| {
            if width == f64::INFINITY {
                return Ok(format!("{name}[{number}] == {name}[{number}]"));
            }
            let literal = number_literal("a half-width of the window", width)?;
            Ok(format!("fabs({name}[{number}]) <= {literal}"))
        };
        widths
            .iter()
            .enumerate()
            .map(condition)
            .collect::<Result<Vec<_>, EmissionError>>()
    };
    let mut conditions = named("state", &window.state)?;
    conditions.extend(named("parameters", &window.parameter)?);
    Ok(conditions)
}
