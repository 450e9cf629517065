//! What can be wrong with an expression.

use std::ops::Range;

use thiserror::Error;

/// A fault and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::model) struct Spanned<T> {
    /// The fault.
    pub(in crate::model) value: T,
    /// Bytes of the text it stands at.
    pub(in crate::model) span: Range<usize>,
}

impl<T> Spanned<T> {
    /// A fault at `span`.
    pub(in crate::model) fn new(value: T, span: Range<usize>) -> Self {
        Self { value, span }
    }
}

/// A fault in the text of an expression.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// No expression at all.
    #[error("empty expression")]
    Empty,
    /// Longer than any model needs.
    #[error("expression of {length} bytes, at most {limit} are read")]
    TooLong {
        /// Length found.
        length: usize,
        /// Longest accepted.
        limit: usize,
    },
    /// Nested deeper than any model needs.
    #[error("expression nested deeper than {limit} levels")]
    TooDeep {
        /// Deepest accepted.
        limit: usize,
    },
    /// A character the language does not have.
    #[error("unexpected character `{found}` in an expression")]
    Character {
        /// The character, escaped where it cannot be printed.
        found: String,
    },
    /// A malformed number.
    #[error("malformed number `{text}`")]
    Number {
        /// As written.
        text: String,
    },
    /// A number or a constant operation that is not finite.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// As written.
        text: String,
    },
    /// Something else stood where an operand belongs.
    #[error("expected a number, a name or `(`, found {found}")]
    ExpectedOperand {
        /// What stood there.
        found: String,
    },
    /// Something else stood where an operator belongs.
    #[error("expected an operator, found {found}")]
    ExpectedOperator {
        /// What stood there.
        found: String,
    },
    /// A parenthesis that is not closed.
    #[error("`(` is not closed")]
    Unclosed,
    /// A function without its arguments.
    #[error("function `{name}` needs its arguments in parentheses")]
    FunctionWithoutArguments {
        /// The function.
        name: String,
    },
    /// A wrong number of arguments.
    #[error("function `{name}` takes {expected} argument(s), found {found}")]
    ArgumentCount {
        /// The function.
        name: String,
        /// Arguments it takes.
        expected: usize,
        /// Arguments found.
        found: usize,
    },
    /// A call of something that is no function.
    #[error("unknown function `{name}`")]
    UnknownFunction {
        /// As written.
        name: String,
        /// The nearest known name.
        nearest: Option<String>,
    },
    /// A name that means nothing here.
    #[error("unknown variable `{name}`")]
    UnknownVariable {
        /// As written.
        name: String,
        /// The nearest known name.
        nearest: Option<String>,
    },
    /// `free` outside a contact law.
    #[error("`free` has a meaning only in the contact law of a surface")]
    FreeOutsideContact,
}

impl ExpressionError {
    /// A few words for the place in the text, where there is something to add.
    pub(in crate::model) fn label(&self) -> Option<String> {
        let meant = |nearest: &Option<String>, otherwise: &str| match nearest {
            Some(name) => format!("did you mean `{name}`?"),
            None => otherwise.to_owned(),
        };
        match self {
            Self::UnknownVariable { nearest, .. } => Some(meant(
                nearest,
                "not a state, the phase, a parameter or a `let`",
            )),
            Self::UnknownFunction { nearest, .. } => {
                Some(meant(nearest, "not a function; a product needs `*`"))
            }
            Self::FunctionWithoutArguments { name } => Some(format!("write `{name}(...)`")),
            Self::TooDeep { .. } | Self::TooLong { .. } => Some("split it with `let`".to_owned()),
            _ => None,
        }
    }
}
