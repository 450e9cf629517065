//! Printing a kernel as Rust statements, one short statement a line.

use super::EmissionError;
use super::names::number_literal;
use crate::jet::kernel::{Kernel, Operation, Value};

/// A kernel as text: statements and the expressions of its outputs.
pub(super) struct PrintedKernel {
    /// One `let` per operation, `r0`, `r1`, ... in order.
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
        statements,
        outputs,
    })
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
    }
}
