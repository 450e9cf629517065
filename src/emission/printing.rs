//! Printing a kernel as statements of the target's language, one short statement a line.
//!
//! In Rust every `let` opens a scope within the last one, and the compiler walks them recursively:
//! thousands of them end in its stack. A long kernel is printed in blocks, each handing on the
//! results that are used after it.

use super::EmissionError;
use super::language::Language;
use crate::jet::kernel::{Kernel, Value};

/// Most statements in one scope.
const BLOCK: usize = 512;

/// A kernel as text: statements and the expressions of its outputs.
pub(super) struct PrintedKernel {
    /// One binding per operation, `r0`, `r1`, ... in order, in blocks where there are many.
    pub(super) statements: Vec<String>,
    /// One expression per output.
    pub(super) outputs: Vec<String>,
}

/// Prints a kernel; `input` names its inputs.
pub(super) fn print(
    language: Language,
    kernel: &Kernel,
    input: impl Fn(usize) -> String,
) -> Result<PrintedKernel, EmissionError> {
    let operand = |value: Value| match value {
        Value::Input(number) => Ok(input(number as usize)),
        Value::Constant(number) => {
            language.number("a coefficient", kernel.constants[number as usize])
        }
        Value::Result(number) => Ok(format!("r{number}")),
    };
    let mut statements = Vec::with_capacity(kernel.operations.len());
    for (number, operation) in kernel.operations.iter().enumerate() {
        let operands = operation
            .operands()
            .map(operand)
            .collect::<Result<Vec<_>, _>>()?;
        let expression = language.expression(operation, &operands);
        statements.push(language.binding(number, &expression));
    }
    let outputs = kernel
        .outputs
        .iter()
        .map(|&output| operand(output))
        .collect::<Result<_, _>>()?;
    if language.nests_statements() {
        statements = in_blocks(kernel, statements);
    }
    Ok(PrintedKernel {
        statements,
        outputs,
    })
}

/// The statements, in blocks if they are more than one block's.
fn in_blocks(kernel: &Kernel, statements: Vec<String>) -> Vec<String> {
    if statements.len() <= BLOCK {
        return statements;
    }
    let last_use = last_uses(kernel);
    let mut lines = Vec::with_capacity(statements.len() + statements.len() / BLOCK * 3);
    for (number, block) in statements.chunks(BLOCK).enumerate() {
        let end = number * BLOCK + block.len();
        let handed_on: Vec<_> = (number * BLOCK..end)
            .filter(|&result| last_use[result] >= end)
            .map(|result| format!("r{result}"))
            .collect();
        let names = || {
            handed_on
                .chunks(12)
                .map(|names| format!("    {},", names.join(", ")))
        };
        lines.push("let [".to_owned());
        lines.extend(names());
        lines.push("] = {".to_owned());
        lines.extend(block.iter().map(|statement| format!("    {statement}")));
        lines.push("    [".to_owned());
        lines.extend(names());
        lines.push("    ]".to_owned());
        lines.push("};".to_owned());
    }
    lines
}

/// The last operation that uses each result; beyond all operations for an output.
fn last_uses(kernel: &Kernel) -> Vec<usize> {
    let mut last = vec![0; kernel.operations.len()];
    let mut used = |value: Value, by: usize| {
        if let Value::Result(result) = value {
            last[result as usize] = by;
        }
    };
    for (number, operation) in kernel.operations.iter().enumerate() {
        operation.operands().for_each(|value| used(value, number));
    }
    let end = kernel.operations.len();
    kernel.outputs.iter().for_each(|&output| used(output, end));
    last
}
