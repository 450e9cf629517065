//! The languages in which a map is emitted, and how each writes a kernel.

use super::EmissionError;
use super::names::{c_string_literal, number_literal, string_literal};
use crate::jet::kernel::Operation;

/// Language of an emitted map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// A crate of Rust without dependencies.
    #[default]
    Rust,
    /// A header that is C99, C++ and CUDA alike.
    C,
    /// The same functions with kernels for one thread a point.
    Cuda,
}

impl Target {
    /// The word for it in commands and templates.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cuda => "cuda",
        }
    }

    /// A statement that names a result.
    pub(super) fn binding(self, number: usize, expression: &str) -> String {
        match self {
            Self::Rust => format!("let r{number} = {expression};"),
            Self::C | Self::Cuda => format!("const double r{number} = {expression};"),
        }
    }

    /// An operation on operands that are written already.
    pub(super) fn expression(self, operation: &Operation, operands: &[String]) -> String {
        let call = |rust: &str, c: &str| {
            let name = if self == Self::Rust { rust } else { c };
            format!("{name}({})", operands.join(", "))
        };
        match operation {
            Operation::Add(..) => format!("{} + {}", operands[0], operands[1]),
            Operation::Multiply(..) => format!("{} * {}", operands[0], operands[1]),
            Operation::MultiplyAdd(..) => call("fma", "GRAZEMAP_FMA"),
            Operation::RootOfPositivePart(_) => {
                format!("sqrt({})", call("positive_part", "grazemap_positive_part"))
            }
            Operation::HalfReciprocal(_) => call("half_reciprocal", "grazemap_half_reciprocal"),
            Operation::Held(_) => operands[0].clone(),
        }
    }

    /// Whether a compiler of this language walks statements recursively, so that long kernels are printed in blocks.
    pub(super) fn nests_statements(self) -> bool {
        self == Self::Rust
    }

    /// A number handed on by freezing.
    pub(super) fn coefficient(self, number: usize) -> String {
        match self {
            Self::Rust => format!("c({number})"),
            Self::C | Self::Cuda => format!("coefficients[{number}]"),
        }
    }

    /// A text as a literal.
    pub(super) fn string(self, text: &str) -> String {
        match self {
            Self::Rust => string_literal(text),
            Self::C | Self::Cuda => c_string_literal(text),
        }
    }

    /// A half-width of the window, which may be unbounded but not NaN.
    pub(super) fn half_width(self, value: f64) -> Result<String, EmissionError> {
        let infinity = match self {
            Self::Rust => "f64::INFINITY",
            Self::C | Self::Cuda => "INFINITY",
        };
        if value == f64::INFINITY {
            Ok(infinity.into())
        } else {
            number_literal("a half-width of the window", value)
        }
    }

    /// A number that may be absent; C, which has no such thing, says so by a negative one.
    pub(super) fn optional(
        self,
        what: &'static str,
        value: Option<f64>,
    ) -> Result<String, EmissionError> {
        let literal = value.map(|value| number_literal(what, value)).transpose()?;
        Ok(match (self, literal) {
            (Self::Rust, None) => "None".into(),
            (Self::Rust, Some(literal)) => format!("Some({literal})"),
            (Self::C | Self::Cuda, None) => "-1.0".into(),
            (Self::C | Self::Cuda, Some(literal)) => literal,
        })
    }
}
