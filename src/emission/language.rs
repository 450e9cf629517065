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
use super::names::{c_string_literal, number_literal, single_literal, string_literal};
use super::options::Target;
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
    /// Type of a state.
    pub(super) fn real(self) -> &'static str {
        match (self.target, self.precision) {
            (Target::Rust, FloatFormat::F64) => "f64",
            (Target::Rust, FloatFormat::F32) => "f32",
            (_, FloatFormat::F64) => "double",
            (_, FloatFormat::F32) => "float",
        }
    }

    /// Suffix in C of single-precision literals and function names.
    pub(super) fn suffix(self) -> &'static str {
        match (self.target, self.precision) {
            (Target::Rust, _) | (_, FloatFormat::F64) => "",
            (_, FloatFormat::F32) => "f",
        }
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
        match self.target {
            Target::Rust => format!("let r{number} = {expression};"),
            Target::C | Target::Cuda => format!("const {} r{number} = {expression};", self.real()),
            Target::JavaScript | Target::Wasm => format!("const r{number} = {expression};"),
            Target::Python | Target::Julia => format!("r{number} = {expression}"),
            Target::Matlab => format!("r{number} = {expression};"),
        }
    }

    /// Expression of an operation on printed operands.
    pub(super) fn expression(self, operation: &Operation, operands: &[String]) -> String {
        let suffix = self.suffix();
        let call = |rust: &str, c: &str, suffix: &str| {
            let name = match self.target {
                Target::C | Target::Cuda => format!("{c}{suffix}"),
                Target::JavaScript => camel_case(rust),
                _ => rust.to_owned(),
            };
            format!("{name}({})", operands.join(", "))
        };
        // NOTE: MATLAB multiplies arrays element by element with `.*`.
        let times = if self.target == Target::Matlab { ".*" } else { "*" };
        match operation {
            Operation::Add(..) => format!("{} + {}", operands[0], operands[1]),
            Operation::Multiply(..) => format!("{} {times} {}", operands[0], operands[1]),
            // NOTE: these languages round the product, then the sum.
            Operation::MultiplyAdd(..) if self.target.is_double_only() => {
                format!("{} {times} {} + {}", operands[0], operands[1], operands[2])
            }
            Operation::MultiplyAdd(..) => call("fma", "GRAZEMAP_FMA", &suffix.to_uppercase()),
            Operation::RootOfPositivePart(_) if self.target == Target::Rust => {
                format!("sqrt(positive_part({}))", operands[0])
            }
            Operation::RootOfPositivePart(_) => {
                call("root_of_positive_part", "grazemap_root_of_positive_part", suffix)
            }
            Operation::HalfReciprocal(_) => {
                call("half_reciprocal", "grazemap_half_reciprocal", suffix)
            }
            Operation::Held(_) => operands[0].clone(),
        }
    }

    /// Whether a compiler of this language walks statements recursively, so that long kernels are
    /// printed in blocks.
    pub(super) fn nests_statements(self) -> bool {
        self.target == Target::Rust
    }

    /// Coefficient of the frozen map, by index.
    pub(super) fn coefficient(self, number: usize) -> String {
        match self.target {
            Target::Rust => format!("c({number})"),
            Target::C | Target::Cuda => self.element("coefficients", number),
            _ => self.element("c", number),
        }
    }

    /// Element of an array by index from 0; in MATLAB a row.
    pub(super) fn element(self, array: &str, number: usize) -> String {
        match self.target {
            Target::Julia => format!("{array}[{}]", number + 1),
            Target::Matlab => format!("{array}({}, :)", number + 1),
            _ => format!("{array}[{number}]"),
        }
    }

    /// String literal.
    pub(super) fn string(self, text: &str) -> String {
        match self.target {
            Target::Rust => string_literal(text),
            Target::C | Target::Cuda => c_string_literal(text),
            Target::Matlab => format!("'{}'", plain(text).replace('\'', "''")),
            _ => format!("{:?}", plain(text)),
        }
    }

    /// Half-width of the window, which may be infinite but not NaN.
    pub(super) fn half_width(self, value: f64) -> Result<String, EmissionError> {
        match self.target {
            _ if value != f64::INFINITY => self.number("a half-width of the window", value),
            Target::Rust => Ok(format!("{}::INFINITY", self.real())),
            Target::C | Target::Cuda => Ok("INFINITY".into()),
            Target::JavaScript | Target::Wasm => Ok("Infinity".into()),
            Target::Python => Ok("np.inf".into()),
            Target::Julia | Target::Matlab => Ok("Inf".into()),
        }
    }

    /// Optional error, always in double precision. C has no optional numbers: there a negative
    /// number stands for none.
    pub(super) fn optional(
        self,
        what: &'static str,
        value: Option<f64>,
    ) -> Result<String, EmissionError> {
        let literal = value.map(|value| number_literal(what, value)).transpose()?;
        Ok(match (self.target, literal) {
            (Target::Rust, None) => "None".into(),
            (Target::Rust, Some(literal)) => format!("Some({literal})"),
            (Target::C | Target::Cuda, None) => "-1.0".into(),
            (Target::JavaScript | Target::Wasm, None) => "null".into(),
            (Target::Python, None) => "None".into(),
            (Target::Julia, None) => "nothing".into(),
            (Target::Matlab, None) => "[]".into(),
            (_, Some(literal)) => literal,
        })
    }
}

/// `half_reciprocal` as `halfReciprocal`.
fn camel_case(name: &str) -> String {
    let mut words = name.split('_');
    let first = words.next().unwrap_or_default().to_owned();
    words.fold(first, |name, word| {
        let (initial, rest) = word.split_at(1);
        name + &initial.to_uppercase() + rest
    })
}

/// Text with every character that a language could interpret replaced by `?`.
fn plain(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_graphic() && !matches!(c, '\\' | '"' | '$') || c == ' ';
    text.chars().map(|c| if is_plain(c) { c } else { '?' }).collect()
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
