//! Syntax of each language for a kernel, in double and in single precision.
//!
//! Numbers are printed as they are rounded. A coefficient of a map in single precision is the
//! nearest single to the double, in the shortest digits that read back to it; the same holds for
//! every constant that states and parameters are compared with.
//!
//! Kernels are printed as one short statement a line. In Rust every `let` opens a scope within the
//! last one, and the compiler walks these recursively: thousands of them overflow its stack. A long
//! kernel is printed in blocks; each block returns the results that are used after it.

use super::error::EmissionError;
use super::names::{number_literal, single_literal};
use super::options::Target;
use super::syntax::Syntax;
use crate::jet::kernel::{Kernel, Operation, Value};
use crate::numeric::FloatFormat;

/// Target and number format of states, parameters and coefficients. WebAssembly kernels are not
/// text; its header uses the syntax of JavaScript.
#[derive(Clone, Copy, Debug)]
pub(super) struct Language {
    pub(super) target: Target,
    pub(super) precision: FloatFormat,
}

impl Language {
    fn syntax(self) -> &'static Syntax {
        self.target.syntax()
    }

    /// Word for the precision, of one for each.
    fn of<T: Copy>(self, [double, single]: [T; 2]) -> T {
        match self.precision {
            FloatFormat::F64 => double,
            FloatFormat::F32 => single,
        }
    }

    /// Type of a state.
    pub(super) fn real(self) -> &'static str {
        self.of(self.syntax().real)
    }

    /// Suffix of single-precision literals and function names.
    pub(super) fn suffix(self) -> &'static str {
        self.of(self.syntax().suffix)
    }

    /// Largest finite number.
    pub(super) fn largest(self) -> String {
        match self.precision {
            FloatFormat::F64 => format!("{:?}", f64::MAX),
            FloatFormat::F32 => format!("{:?}{}", f32::MAX, self.suffix()),
        }
    }

    /// Literal of a number, rounded to the precision.
    pub(super) fn number(self, what: &'static str, value: f64) -> Result<String, EmissionError> {
        match self.precision {
            FloatFormat::F64 => number_literal(what, value),
            FloatFormat::F32 => Ok(single_literal(what, value)? + self.suffix()),
        }
    }

    /// Statement that binds a result to a name.
    pub(super) fn binding(self, number: usize, expression: &str) -> String {
        let (before, after) = self.of(self.syntax().binding);
        format!("{before}r{number} = {expression}{after}")
    }

    /// Expression of an operation on printed operands.
    pub(super) fn expression(self, operation: &Operation, operands: &[String]) -> String {
        let (Syntax { times, functions, .. }, suffix) = (self.syntax(), self.suffix());
        match operation {
            Operation::Add(..) => format!("{} + {}", operands[0], operands[1]),
            Operation::Multiply(..) => format!("{} {times} {}", operands[0], operands[1]),
            Operation::MultiplyAdd(..) => match functions.multiply_add {
                Some(name) => format!("{name}{}({})", suffix.to_uppercase(), operands.join(", ")),
                None => format!("{} {times} {} + {}", operands[0], operands[1], operands[2]),
            },
            Operation::RootOfPositivePart(_) => {
                let (name, before, after) = functions.root;
                format!("{name}{suffix}{before}{}{after}", operands[0])
            }
            Operation::HalfReciprocal(_) => {
                format!("{}{suffix}({})", functions.half_reciprocal, operands[0])
            }
            Operation::Held(_) => operands[0].clone(),
        }
    }

    /// Whether a compiler of this language walks statements recursively, so that long kernels are
    /// printed in blocks.
    pub(super) fn nests_statements(self) -> bool {
        self.syntax().nests_statements
    }

    /// Coefficient of the frozen map, by index.
    pub(super) fn coefficient(self, number: usize) -> String {
        let (first, ..) = self.syntax().index;
        let (before, after) = self.syntax().coefficient;
        format!("{before}{}{after}", first + number)
    }

    /// Element of an array by index from 0; in MATLAB a row.
    pub(super) fn element(self, array: &str, number: usize) -> String {
        let (first, before, after) = self.syntax().index;
        format!("{array}{before}{}{after}", first + number)
    }

    /// String literal.
    pub(super) fn string(self, text: &str) -> String {
        (self.syntax().string)(text)
    }

    /// Half-width of the window, which may be infinite but not NaN.
    pub(super) fn half_width(self, value: f64) -> Result<String, EmissionError> {
        match value == f64::INFINITY {
            true => Ok(self.of(self.syntax().infinity).to_owned()),
            false => self.number("a half-width of the window", value),
        }
    }

    /// Optional error, always in double precision.
    pub(super) fn optional(
        self,
        what: &'static str,
        value: Option<f64>,
    ) -> Result<String, EmissionError> {
        let (none, (before, after)) = self.syntax().optional;
        match value {
            Some(value) => Ok(format!("{before}{}{after}", number_literal(what, value)?)),
            None => Ok(none.to_owned()),
        }
    }
}

/// Largest number of statements in a block.
const BLOCK: usize = 512;

/// Kernel as text: statements, and expressions of the outputs.
pub(super) struct PrintedKernel {
    /// One binding per operation, `r0`, `r1`, ... in order; in blocks if there are many.
    pub(super) statements: Vec<String>,
    /// One expression per output.
    pub(super) outputs: Vec<String>,
}

/// Prints a kernel. `input` returns the text of an input.
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
        let operands = operation.operands().map(operand).collect::<Result<Vec<_>, _>>()?;
        let expression = language.expression(operation, &operands);
        statements.push(language.binding(number, &expression));
    }
    let outputs = kernel.outputs.iter().map(|&output| operand(output)).collect::<Result<_, _>>()?;
    if language.nests_statements() {
        statements = in_blocks(kernel, statements);
    }
    Ok(PrintedKernel { statements, outputs })
}

/// Groups statements into blocks if there are more than [`BLOCK`].
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
        let names = || handed_on.chunks(12).map(|names| format!("    {},", names.join(", ")));
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

/// Index of the last operation that uses each result; for an output, an index beyond all
/// operations.
pub(super) fn last_uses(kernel: &Kernel) -> Vec<usize> {
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
