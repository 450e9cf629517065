//! Text to tokens with byte spans.

use std::ops::Range;

use super::{ExpressionError, Spanned};

/// Longest expression read, in bytes.
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

/// The tokens of a text, the last being [`Token::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Spanned<ExpressionError>> {
    if text.len() > LONGEST {
        let error = ExpressionError::TooLong {
            length: text.len(),
            limit: LONGEST,
        };
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
                at = skip(bytes, at, |byte| {
                    byte.is_ascii_alphanumeric() || byte == b'_'
                });
                Token::Name
            }
            _ => return Err(unexpected_character(text, at)),
        };
        tokens.push((token, start..at));
    }
    tokens.push((Token::End, text.len()..text.len()));
    Ok(tokens)
}

/// The names a text uses, in order; nothing where it cannot be read (its own parse says why).
pub(in crate::model) fn names_in(text: &str) -> Vec<&str> {
    let tokens = tokens(text).unwrap_or_default();
    let names = tokens
        .into_iter()
        .filter(|(token, _)| *token == Token::Name);
    names.map(|(_, span)| &text[span]).collect()
}

/// Where the bytes that satisfy `accept` end.
fn skip(bytes: &[u8], from: usize, accept: impl Fn(u8) -> bool) -> usize {
    let rest = bytes[from..].iter().position(|&byte| !accept(byte));
    rest.map_or(bytes.len(), |length| from + length)
}

/// Where a number ends: digits and points, an exponent with its sign, and anything glued to it.
fn number_end(bytes: &[u8], from: usize) -> usize {
    let mut at = skip(bytes, from, |byte| byte.is_ascii_digit() || byte == b'.');
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        at += 1;
        if matches!(bytes.get(at), Some(b'+' | b'-')) {
            at += 1;
        }
    }
    skip(bytes, at, |byte| {
        byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'.'
    })
}

/// Refuses what is not `digits[.digits][e[±]digits]`.
fn check_number(text: &str, span: Range<usize>) -> Result<(), Spanned<ExpressionError>> {
    let number = &text[span.clone()];
    let plain = number
        .bytes()
        .all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'E' | b'+' | b'-'));
    if plain && number.parse::<f64>().is_ok() {
        Ok(())
    } else {
        Err(Spanned::new(
            ExpressionError::Number {
                text: number.to_owned(),
            },
            span,
        ))
    }
}

/// The fault of a character that begins no token.
fn unexpected_character(text: &str, at: usize) -> Spanned<ExpressionError> {
    let found = text[at..].chars().next().unwrap_or_default();
    let error = ExpressionError::Character {
        found: found.escape_debug().to_string(),
    };
    Spanned::new(error, at..at + found.len_utf8())
}
