//! Printing a kernel as Rust statements, one short statement a line.
//!
//! Every `let` opens a scope inside the one before it, and a compiler that writes debug information follows them
//! down: long kernels are printed in blocks, which hand on what later ones use.

use super::EmissionError;
use super::names::number_literal;
use crate::jet::kernel::{Kernel, Operation, Value};

/// Statements of a block, and most of a kernel that has none.
const BLOCK: usize = 512;
/// Names on a line.
const NAMES: usize = 12;

/// A kernel as text: statements and the expressions of its outputs.
pub(super) struct PrintedKernel {
    /// One `let` per operation, `r0`, `r1`, ... in order, and the lines around blocks of them.
    pub(super) statements: Vec<String>,
    /// One expression per output.
    pub(super) outputs: Vec<String>,
}

/// Prints a kernel; `input` names its inputs.
pub(super) fn print(
    kernel: &Kernel,
    input: impl Fn(usize) -> String,
) -> Result<PrintedKernel, EmissionError> {
    let operand = |value: Value| match value {
        Value::Input(number) => Ok(input(number as usize)),
        Value::Constant(number) => {
            number_literal("a coefficient", kernel.constants[number as usize])
        }
        Value::Result(number) => Ok(format!("r{number}")),
    };
    let mut statements = Vec::with_capacity(kernel.operations.len());
    for (number, operation) in kernel.operations.iter().enumerate() {
        let operands = operation
            .operands()
            .map(operand)
            .collect::<Result<Vec<_>, _>>()?;
        statements.push(format!(
            "let r{number} = {};",
            expression(operation, &operands)
        ));
    }
    let outputs = kernel
        .outputs
        .iter()
        .map(|&output| operand(output))
        .collect::<Result<_, _>>()?;
    Ok(PrintedKernel {
        statements: in_blocks(kernel, statements),
        outputs,
    })
}

/// The statements of a long kernel in blocks.
fn in_blocks(kernel: &Kernel, statements: Vec<String>) -> Vec<String> {
    if statements.len() <= BLOCK {
        return statements;
    }
    let last_use = last_uses(kernel);
    let mut lines = Vec::with_capacity(statements.len());
    for (number, block) in statements.chunks(BLOCK).enumerate() {
        let (first, end) = (number * BLOCK, number * BLOCK + block.len());
        let live: Vec<String> = (first..end)
            .filter(|&result| last_use[result] >= end)
            .map(|result| format!("r{result},"))
            .collect();
        let names: Vec<String> = live.chunks(NAMES).map(|names| names.join(" ")).collect();
        lines.push("let (".to_owned());
        lines.extend(names.iter().map(|names| format!("    {names}")));
        lines.push(") = {".to_owned());
        lines.extend(block.iter().map(|statement| format!("    {statement}")));
        lines.push("    (".to_owned());
        lines.extend(names.iter().map(|names| format!("        {names}")));
        lines.push("    )".to_owned());
        lines.push("};".to_owned());
    }
    lines
}

/// Number of the last operation that uses each result; beyond all of them for an output.
fn last_uses(kernel: &Kernel) -> Vec<usize> {
    let mut last_use = vec![0; kernel.operations.len()];
    let mut mark = |value: Value, user: usize| {
        if let Value::Result(number) = value {
            last_use[number as usize] = user;
        }
    };
    for (number, operation) in kernel.operations.iter().enumerate() {
        operation
            .operands()
            .for_each(|operand| mark(operand, number));
    }
    let after = kernel.operations.len();
    kernel
        .outputs
        .iter()
        .for_each(|&output| mark(output, after));
    last_use
}

fn expression(operation: &Operation, operands: &[String]) -> String {
    match operation {
        Operation::Add(..) => format!("{} + {}", operands[0], operands[1]),
        Operation::Multiply(..) => format!("{} * {}", operands[0], operands[1]),
        Operation::MultiplyAdd(..) => {
            format!("fma({}, {}, {})", operands[0], operands[1], operands[2])
        }
        Operation::RootOfPositivePart(_) => format!("sqrt(positive_part({}))", operands[0]),
        Operation::HalfReciprocal(_) => format!("half_reciprocal({})", operands[0]),
        Operation::Held(_) => operands[0].clone(),
    }
}
