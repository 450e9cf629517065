//! The expression language: parses a text into a node of the graph.
//!
//! The Pratt parser builds the graph while reading. There is no syntax tree, whose depth a hostile
//! text could choose. Grammar, loosest first: `+ -`, `* /`, unary `-` `+`, `^` (right-associative,
//! so that `-x^2 = -(x^2)` and `2^-1` is a half), then numbers, names, `pi`, function calls and
//! parentheses.

use std::ops::Range;

use num_traits::Zero;
use thiserror::Error;

use crate::model::graph::{Binary, ExpressionGraph, Node, NodeId};
use crate::model::names::{self, Function};
use crate::numeric::Dd;

/// A fault and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spanned<T> {
    /// The fault.
    pub(super) value: T,
    /// Bytes of the fault in the text.
    pub(super) span: Range<usize>,
}

impl<T> Spanned<T> {
    /// A fault at `span`.
    pub(super) fn new(value: T, span: Range<usize>) -> Self {
        Self { value, span }
    }
}

/// A fault in the text of an expression.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// An empty expression.
    #[error("empty expression")]
    Empty,
    /// An expression longer than the limit.
    #[error("expression of {length} bytes, at most {limit} are read")]
    TooLong {
        /// Length found, in bytes.
        length: usize,
        /// Largest length accepted, in bytes.
        limit: usize,
    },
    /// An expression nested deeper than the limit.
    #[error("expression nested deeper than {limit} levels")]
    TooDeep {
        /// Largest depth accepted.
        limit: usize,
    },
    /// A character that the language does not have.
    #[error("unexpected character `{found}` in an expression")]
    Character {
        /// The character, escaped if it cannot be printed.
        found: String,
    },
    /// The power operator of other languages, `**`.
    #[error("`**` is not an operator")]
    DoubleStar,
    /// A malformed number.
    #[error("malformed number `{text}`")]
    Number {
        /// The number as written.
        text: String,
    },
    /// A number, or an operation on constants, that is not finite.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// The text as written.
        text: String,
    },
    /// Another token where an operand is expected.
    #[error("expected a number, a name or `(`, found {found}")]
    ExpectedOperand {
        /// The token found, in words.
        found: String,
    },
    /// Another token where an operator is expected.
    #[error("expected an operator, found {found}")]
    ExpectedOperator {
        /// The token found, in words.
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
        /// Number of arguments that the function takes.
        expected: usize,
        /// Number of arguments found.
        found: usize,
    },
    /// A call of an unknown function.
    #[error("unknown function `{name}`")]
    UnknownFunction {
        /// The name as written.
        name: String,
        /// The nearest known name.
        nearest: Option<String>,
    },
    /// An unknown name.
    #[error("unknown variable `{name}`")]
    UnknownVariable {
        /// The name as written.
        name: String,
        /// The nearest known name.
        nearest: Option<String>,
    },
    /// `free` outside a contact law.
    #[error("`free` has a meaning only in the contact law of a surface")]
    FreeOutsideContact,
}

impl ExpressionError {
    /// A few words at the place in the text; `None` if there is nothing to add.
    pub(super) fn label(&self) -> Option<String> {
        let meant = |nearest: &Option<String>, otherwise: &str| match nearest {
            Some(name) => format!("did you mean `{name}`?"),
            None => otherwise.to_owned(),
        };
        match self {
            Self::UnknownVariable { name, nearest } => Some(match names::spelling(name) {
                Some(spelling) if nearest.is_none() => spelling.to_owned(),
                _ => meant(nearest, "not a state, the phase, a parameter or a `let`"),
            }),
            Self::UnknownFunction { name, nearest } => Some(match names::spelling(name) {
                Some(spelling) => spelling.to_owned(),
                None => meant(nearest, "not a function; a product needs `*`"),
            }),
            Self::Character { found } => names::spelling(found).map(str::to_owned),
            Self::DoubleStar => Some("a power is `^`, as in `x^2`".to_owned()),
            Self::Number { text } if text.parse::<f64>().is_err() && is_product(text) => {
                Some("a product needs `*`".to_owned())
            }
            Self::FunctionWithoutArguments { name } => Some(format!("write `{name}(...)`")),
            Self::TooDeep { .. } | Self::TooLong { .. } => Some("split it with `let`".to_owned()),
            _ => None,
        }
    }
}

/// Whether a text is a number followed by a name without an operator, such as `2x`.
fn is_product(text: &str) -> bool {
    let end = text.find(|letter: char| letter.is_ascii_alphabetic() || letter == '_');
    end.is_some_and(|end| text[..end].parse::<f64>().is_ok() && names::is_name(&text[end..]))
}

/// Longest expression accepted, in bytes.
const LONGEST: usize = 1 << 16;

/// A token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token {
    /// A decimal number.
    Number,
    /// A name.
    Name,
    /// One of `+ - * / ^ ( ) ,`.
    Symbol(u8),
    /// The end of the text.
    End,
}

/// Tokens of a text; the last is [`Token::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Spanned<ExpressionError>> {
    if text.len() > LONGEST {
        let error = ExpressionError::TooLong { length: text.len(), limit: LONGEST };
        return Err(Spanned::new(error, 0..text.len()));
    }
    let bytes = text.as_bytes();
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        let token = match bytes[at] {
            b' ' | b'\t' | b'\n' | b'\r' => {
                at += 1;
                continue;
            }
            symbol @ (b'+' | b'-' | b'*' | b'/' | b'^' | b'(' | b')' | b',') => {
                at += 1;
                Token::Symbol(symbol)
            }
            b'0'..=b'9' | b'.' => {
                at = number_end(bytes, at);
                check_number(text, start..at)?;
                Token::Number
            }
            letter if letter.is_ascii_alphabetic() || letter == b'_' => {
                at = skip(bytes, at, |byte| byte.is_ascii_alphanumeric() || byte == b'_');
                Token::Name
            }
            _ => return Err(unexpected_character(text, at)),
        };
        tokens.push((token, start..at));
    }
    tokens.push((Token::End, text.len()..text.len()));
    Ok(tokens)
}

/// Names in a text, in order; empty if the text has no valid tokens (its own parse reports why).
pub(super) fn names_in(text: &str) -> Vec<&str> {
    let tokens = tokens(text).unwrap_or_default();
    let names = tokens.into_iter().filter(|(token, _)| *token == Token::Name);
    names.map(|(_, span)| &text[span]).collect()
}

/// Index after the run of bytes from `from` on that satisfy `accept`.
fn skip(bytes: &[u8], from: usize, accept: impl Fn(u8) -> bool) -> usize {
    let rest = bytes[from..].iter().position(|&byte| !accept(byte));
    rest.map_or(bytes.len(), |length| from + length)
}

/// Index after a number: digits and points, an exponent with its sign, and letters attached to it.
fn number_end(bytes: &[u8], from: usize) -> usize {
    let mut at = skip(bytes, from, |byte| byte.is_ascii_digit() || byte == b'.');
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        at += 1;
        if matches!(bytes.get(at), Some(b'+' | b'-')) {
            at += 1;
        }
    }
    skip(bytes, at, |byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'.')
}

/// Refuses numbers that do not have the form `digits[.digits][e[±]digits]`.
fn check_number(text: &str, span: Range<usize>) -> Result<(), Spanned<ExpressionError>> {
    let number = &text[span.clone()];
    let plain = number
        .bytes()
        .all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'E' | b'+' | b'-'));
    if plain && number.parse::<f64>().is_ok() {
        Ok(())
    } else {
        Err(Spanned::new(ExpressionError::Number { text: number.to_owned() }, span))
    }
}

/// Error for a character that begins no token.
fn unexpected_character(text: &str, at: usize) -> Spanned<ExpressionError> {
    let found = text[at..].chars().next().unwrap_or_default();
    let error = ExpressionError::Character { found: found.escape_debug().to_string() };
    Spanned::new(error, at..at + found.len_utf8())
}

/// Deepest nesting accepted.
const DEEPEST: usize = 128;

/// Binding power of unary minus: looser than `^`, tighter than `*`.
const UNARY: u8 = 5;

/// Meaning of a name.
#[derive(Clone, Debug)]
pub(super) enum Resolved {
    /// The name stands for a node.
    Node(NodeId),
    /// The name is unknown; the nearest known name.
    Unknown(Option<String>),
}

type Outcome<T> = Result<T, Spanned<ExpressionError>>;

/// Parses `text` into `graph`; `resolve` gives the meaning of a name.
///
/// # Errors
///
/// The first error, with its bytes in `text`.
pub(super) fn parse(
    text: &str,
    graph: &mut ExpressionGraph,
    resolve: &dyn Fn(&str) -> Resolved,
) -> Outcome<NodeId> {
    let tokens = tokens(text)?;
    if tokens.len() == 1 {
        return Err(Spanned::new(ExpressionError::Empty, 0..text.len()));
    }
    let mut parser = Parser { text, tokens, at: 0, depth: 0, graph, resolve };
    let (node, _) = parser.expression(0)?;
    match parser.peek() {
        (Token::End, _) => Ok(node),
        (_, span) => Err(Spanned::new(
            ExpressionError::ExpectedOperator { found: parser.found(&span) },
            span,
        )),
    }
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(Token, Range<usize>)>,
    at: usize,
    depth: usize,
    graph: &'a mut ExpressionGraph,
    resolve: &'a dyn Fn(&str) -> Resolved,
}

impl Parser<'_> {
    /// Parses an expression whose operators bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Outcome<(NodeId, Range<usize>)> {
        self.depth += 1;
        if self.depth > DEEPEST {
            let (_, span) = self.peek();
            return Err(Spanned::new(ExpressionError::TooDeep { limit: DEEPEST }, span));
        }
        let (mut left, mut span) = self.operand()?;
        while let (Token::Symbol(symbol), _) = self.peek() {
            let Some((binds, right_least)) = binding(symbol) else {
                break;
            };
            if binds < least {
                break;
            }
            self.at += 1;
            let (right, right_span) = self.expression(right_least)?;
            span = span.start..right_span.end;
            left = self.operation(symbol, left, right, &span)?;
        }
        self.depth -= 1;
        Ok((left, span))
    }

    /// Parses a number, a name, a call, a parenthesis, or a sign before an expression.
    fn operand(&mut self) -> Outcome<(NodeId, Range<usize>)> {
        let (token, span) = self.peek();
        self.at += usize::from(token != Token::End);
        match token {
            Token::Number => self.number(span),
            Token::Name => self.name(span),
            Token::Symbol(sign @ (b'-' | b'+')) => {
                let (inner, inner_span) = self.expression(UNARY)?;
                let node = if sign == b'-' { self.graph.neg(inner) } else { inner };
                Ok((node, span.start..inner_span.end))
            }
            Token::Symbol(b'(') => {
                let (inner, _) = self.expression(0)?;
                let end = self.close(span.clone())?;
                Ok((inner, span.start..end))
            }
            Token::Symbol(b'*') if self.text[..span.start].ends_with('*') => {
                Err(Spanned::new(ExpressionError::DoubleStar, span.start - 1..span.end))
            }
            _ => Err(Spanned::new(
                ExpressionError::ExpectedOperand { found: self.found(&span) },
                span,
            )),
        }
    }

    fn number(&mut self, span: Range<usize>) -> Outcome<(NodeId, Range<usize>)> {
        let text = &self.text[span.clone()];
        match decimal(text) {
            Some(value) => Ok((self.graph.constant(value), span)),
            None => Err(Spanned::new(ExpressionError::NotFinite { text: text.to_owned() }, span)),
        }
    }

    fn name(&mut self, span: Range<usize>) -> Outcome<(NodeId, Range<usize>)> {
        let name = &self.text[span.clone()];
        let called = self.peek().0 == Token::Symbol(b'(');
        match (names::function(name), called) {
            (Some(function), true) => return self.call(function, span),
            (Some(_), false) => {
                let error = ExpressionError::FunctionWithoutArguments { name: name.to_owned() };
                return Err(Spanned::new(error, span));
            }
            (None, true) => {
                let nearest = names::nearest(name, names::function_names());
                return Err(Spanned::new(
                    ExpressionError::UnknownFunction { name: name.to_owned(), nearest },
                    span,
                ));
            }
            (None, false) => {}
        }
        if name == names::PI {
            return Ok((self.graph.constant(Dd::PI), span));
        }
        match (self.resolve)(name) {
            Resolved::Node(node) => Ok((node, span)),
            Resolved::Unknown(_) if name == names::FREE => {
                Err(Spanned::new(ExpressionError::FreeOutsideContact, span))
            }
            Resolved::Unknown(nearest) => Err(Spanned::new(
                ExpressionError::UnknownVariable { name: name.to_owned(), nearest },
                span,
            )),
        }
    }

    /// Parses the arguments of a function whose name was already read.
    fn call(&mut self, function: Function, name: Range<usize>) -> Outcome<(NodeId, Range<usize>)> {
        let (_, open) = self.peek();
        self.at += 1;
        let mut arguments = Vec::new();
        if self.peek().0 != Token::Symbol(b')') {
            arguments.push(self.expression(0)?.0);
            while self.peek().0 == Token::Symbol(b',') {
                self.at += 1;
                arguments.push(self.expression(0)?.0);
            }
        }
        let span = name.start..self.close(open)?;
        let node = match (function, arguments.as_slice()) {
            (Function::Unary(function), &[a]) => self.graph.unary(function, a),
            (Function::Binary(function), &[a, b]) => self.graph.binary(function, a, b),
            _ => {
                let error = ExpressionError::ArgumentCount {
                    name: self.text[name].to_owned(),
                    expected: function.arity(),
                    found: arguments.len(),
                };
                return Err(Spanned::new(error, span));
            }
        };
        self.finite(node, &arguments, &span)?;
        Ok((node, span))
    }

    fn operation(
        &mut self,
        symbol: u8,
        a: NodeId,
        b: NodeId,
        span: &Range<usize>,
    ) -> Outcome<NodeId> {
        let node = match symbol {
            b'+' => self.graph.binary(Binary::Add, a, b),
            b'-' => self.graph.binary(Binary::Sub, a, b),
            b'*' => self.graph.binary(Binary::Mul, a, b),
            b'/' => self.graph.binary(Binary::Div, a, b),
            _ => self.graph.power(a, b),
        };
        self.finite(node, &[a, b], span)?;
        Ok(node)
    }

    /// Refuses an operation on constants whose value is not finite, and a division by zero.
    fn finite(&self, node: NodeId, operands: &[NodeId], span: &Range<usize>) -> Outcome<()> {
        let constant = |id: &NodeId| self.graph.constant_value(*id).is_some();
        let by_zero = match self.graph.node(node) {
            Node::Binary(Binary::Div, _, divisor) => {
                self.graph.constant_value(divisor) == Some(Dd::zero())
            }
            _ => false,
        };
        if by_zero || (operands.iter().all(constant) && !constant(&node)) {
            let text = self.text[span.clone()].to_owned();
            return Err(Spanned::new(ExpressionError::NotFinite { text }, span.clone()));
        }
        Ok(())
    }

    /// Reads the parenthesis that closes the one at `open`; returns the index after it.
    fn close(&mut self, open: Range<usize>) -> Outcome<usize> {
        match self.peek() {
            (Token::Symbol(b')'), span) => {
                self.at += 1;
                Ok(span.end)
            }
            (Token::End, _) => Err(Spanned::new(ExpressionError::Unclosed, open)),
            (_, span) => Err(Spanned::new(
                ExpressionError::ExpectedOperator { found: self.found(&span) },
                span,
            )),
        }
    }

    fn peek(&self) -> (Token, Range<usize>) {
        self.tokens[self.at].clone()
    }

    /// Text at `span`, in words.
    fn found(&self, span: &Range<usize>) -> String {
        match &self.text[span.clone()] {
            "" => "the end of the expression".to_owned(),
            text => format!("`{text}`"),
        }
    }
}

/// Binding power of an infix operator, and the least binding power of operators in its right
/// operand.
fn binding(symbol: u8) -> Option<(u8, u8)> {
    match symbol {
        b'+' | b'-' => Some((1, 2)),
        b'*' | b'/' => Some((3, 4)),
        b'^' => Some((7, UNARY)),
        _ => None,
    }
}

/// Finite number of a decimal literal, to the digits of [`Dd`].
pub(super) fn decimal(text: &str) -> Option<Dd> {
    let value = Dd::from_decimal(text).ok()?;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<f64, ExpressionError> {
        let mut graph = ExpressionGraph::new();
        let node =
            parse(text, &mut graph, &|_| Resolved::Unknown(None)).map_err(|fault| fault.value)?;
        Ok(graph.constant_value(node).expect("numbers alone give a number").hi)
    }

    #[test]
    fn operators_bind_as_in_mathematics() {
        for (text, expected) in [
            ("1 + 2*3", 7.0),
            ("(1 + 2)*3", 9.0),
            ("10 - 4 - 3", 3.0),
            ("16/4/2", 2.0),
            ("2^3^2", 512.0),
            ("-2^2", -4.0),
            ("(-2)^2", 4.0),
            ("2^-1", 0.5),
            ("2^-2^2", 0.0625),
            ("-2*-3", 6.0),
            ("2*-3^2", -18.0),
            ("- -5", 5.0),
            ("+5 - +3", 2.0),
            ("1e-3*1E3", 1.0),
            (".5 + 5.", 5.5),
            ("max(1, min(3, 2))", 2.0),
            ("atan2(1, -1)/pi", 0.75),
            ("abs(-3)*sign(-2)", -3.0),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn spellings_of_other_languages_get_the_one_of_this_one() {
        for (text, expected) in [
            ("2**3", "a power is `^`"),
            ("|-2|", "`abs(x)`"),
            ("heaviside(1)", "`contact`"),
            ("H(1)", "`contact`"),
            ("ln(2)", "`log`"),
            ("pow(2, 3)", "`a^b`"),
            ("arctan(2)", "`atan`"),
            ("sgn(2)", "`sign`"),
            ("2*\u{3c0}", "`pi`"),
            ("2*PI", "`pi`"),
            ("2pi", "needs `*`"),
            ("2\u{b7}3", "`*`"),
            ("3\u{b2}", "`^2`"),
            ("1 > 2", "`contact`"),
        ] {
            let label = value(text).expect_err("another language").label();
            assert!(
                label.as_ref().is_some_and(|label| label.contains(expected)),
                "{text}: {label:?}"
            );
        }
    }

    #[test]
    fn a_fault_is_pointed_at_to_the_byte() {
        let mut graph = ExpressionGraph::new();
        let fault = parse("1 + velocty*2", &mut graph, &|_| Resolved::Unknown(None))
            .expect_err("an unknown name");
        assert_eq!(fault.span, 4..11);
    }
}
