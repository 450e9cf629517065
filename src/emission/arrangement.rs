//! From a map and its kernels to what a template lays out.

use super::EmissionError;
use super::header::{header, section_word};
use super::language::Language;
use super::layout::MapLayout;
use super::module::EmitOptions;
use super::names::number_literal;
use super::printing::{PrintedKernel, print};
use super::pruning::PruneReport;
use crate::expansion::{LocalMap, MapKernel};
use crate::jet::kernel::{Kernel, SplitKernel};

/// What the templates lay out: a map, its kernels and its constants, as text of the target's
/// language.
pub(super) fn arrange(
    map: &LocalMap,
    options: &EmitOptions,
    lowered: &MapKernel,
    split: &SplitKernel,
    step: &Kernel,
    pruned: Option<PruneReport>,
) -> Result<MapLayout, EmissionError> {
    let language = Language {
        target: options.target,
        precision: options.precision,
    };
    let prepare = print(language, &split.prepare, |number| {
        format!("parameters[{number}]")
    })?;
    let free = lowered.dimension;
    let input = |number: usize| {
        if number < free {
            format!("x{number}")
        } else {
            language.coefficient(number - free)
        }
    };
    let (step_text, jacobian) = (
        print(language, step, input)?,
        print(language, &split.run, input)?,
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
            map.parameters
                .iter()
                .map(|parameter| parameter.value.to_f64()),
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

fn half_widths(language: Language, values: &[f64]) -> Result<Vec<String>, EmissionError> {
    values
        .iter()
        .map(|&value| language.half_width(value))
        .collect()
}

/// Conditions in C that the numbers of an array lie within these half-widths, false for a NaN;
/// unbounded widths have none but that.
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
