//! Names and texts in emitted code: checked identifiers, escaped literals, harmless comments.

use super::error::EmissionError;

/// Keywords of Rust, strict and reserved, of all editions, and names of a crate's own files.
const TAKEN: [&str; 54] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "unsafe", "unsized", "use", "virtual", "where", "while", "yield", "_", "lib", "main",
];

/// Returns the name if it can name a module: `[a-z_][a-z0-9_]*`, at most 64 characters, no keyword,
/// and not `lib` or `main`, which are files of the crate itself.
///
/// # Errors
///
/// [`EmissionError::NotAnIdentifier`] otherwise.
pub fn checked_identifier(name: &str) -> Result<&str, EmissionError> {
    let starts_well = name.starts_with(|first: char| first.is_ascii_lowercase() || first == '_');
    let continues_well =
        name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
    if starts_well && continues_well && name.len() <= 64 && !TAKEN.contains(&name) {
        Ok(name)
    } else {
        Err(EmissionError::NotAnIdentifier { name: name.to_owned() })
    }
}

/// Rust string literal of ASCII characters.
pub fn string_literal(text: &str) -> String {
    format!("\"{}\"", text.escape_default())
}

/// C string literal: printable ASCII, other bytes in octal, without trigraphs.
pub(super) fn c_string_literal(text: &str) -> String {
    let mut literal = String::from("\"");
    for byte in text.bytes() {
        match byte {
            b'"' | b'\\' | b'?' => {
                literal.push('\\');
                literal.push(char::from(byte));
            }
            b' '..=b'~' => literal.push(char::from(byte)),
            _ => literal.push_str(&format!("\\{byte:03o}")),
        }
    }
    literal.push('"');
    literal
}

/// Text of a comment: one line of printable ASCII that cannot end the comment.
pub fn comment(text: &str) -> String {
    text.escape_default().to_string().replace("*/", "* /").replace("/*", "/ *")
}

/// Shell word, safe inside a comment: unquoted if plain, in single quotes if printable, else in
/// `$'...'` with octal bytes.
pub fn shell_word(bytes: &[u8]) -> String {
    let is_plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"_-+=.,:/@%".contains(byte);
    let is_printable = |byte: &u8| matches!(byte, b' '..=b'~');
    let ends_comment = bytes.windows(2).any(|pair| matches!(pair, b"*/" | b"/*"));
    if !bytes.is_empty() && bytes.iter().all(is_plain) {
        return String::from_utf8_lossy(bytes).into_owned();
    }
    if bytes.iter().all(is_printable) && !ends_comment {
        return format!("'{}'", String::from_utf8_lossy(bytes).replace('\'', "'\\''"));
    }
    let escaped = bytes.iter().map(|&byte| match byte {
        b' '..=b'~' if !b"'\\*".contains(&byte) => char::from(byte).to_string(),
        _ => format!("\\{byte:03o}"),
    });
    format!("$'{}'", escaped.collect::<String>())
}

/// Shortest literal that reads back to the same bits.
///
/// # Errors
///
/// [`EmissionError::NonFinite`] for infinities and NaN.
pub(super) fn number_literal(what: &'static str, value: f64) -> Result<String, EmissionError> {
    if value.is_finite() {
        Ok(format!("{value:?}"))
    } else {
        Err(EmissionError::NonFinite { what, value })
    }
}

/// Shortest literal that reads back to the nearest single-precision number.
///
/// # Errors
///
/// [`EmissionError::NonFinite`] for infinities and NaN, [`EmissionError::TooLarge`] for numbers
/// that overflow single precision.
pub(super) fn single_literal(what: &'static str, value: f64) -> Result<String, EmissionError> {
    if !value.is_finite() {
        return Err(EmissionError::NonFinite { what, value });
    }
    let single = value as f32;
    if single.is_finite() {
        Ok(format!("{single:?}"))
    } else {
        Err(EmissionError::TooLarge { what, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_identifiers_pass() {
        for name in ["linear", "mems_0_46", "_x"] {
            assert!(checked_identifier(name).is_ok(), "{name}");
        }
        let hostile = [
            "",
            "fn",
            "self",
            "lib",
            "main",
            "_",
            "9x",
            "A",
            "a-b",
            "a b",
            "a;b",
            "a\n",
            "../a",
            "ä",
            "a\u{202e}",
        ];
        for name in hostile {
            assert!(checked_identifier(name).is_err(), "{name:?}");
        }
        assert!(checked_identifier(&"a".repeat(65)).is_err());
    }

    #[test]
    fn strings_cannot_leave_their_literal() {
        assert_eq!(string_literal("a\"; loop {} //\n\\"), r#""a\"; loop {} //\n\\""#);
        assert_eq!(c_string_literal("a\"??/ä\n\\"), r#""a\"\?\?/\303\244\012\\""#);
        assert_eq!(comment("x\n*/ fn f() /*"), "x\\n* / fn f() / *");
    }

    #[test]
    fn words_of_a_command_are_read_back_by_a_shell() {
        let words: [&[u8]; 7] =
            [b"x=1.5", b"", b"a b", b"it's", b"*/ /*", b"a\n\\\x01", "\u{e9}'".as_bytes()];
        assert_eq!(words.map(shell_word)[..3], ["x=1.5", "''", "'a b'"]);
        for word in words {
            let shown = shell_word(word);
            assert!(shown.bytes().all(|byte| matches!(byte, b' '..=b'~')), "{shown}");
            assert!(!shown.contains("*/") && !shown.contains("/*"), "{shown}");
            let script = format!("printf %s {shown}");
            let read = std::process::Command::new("bash").args(["-c", &script]).output();
            assert_eq!(read.expect("bash is there").stdout, word, "{shown}");
        }
    }

    #[test]
    fn literals_read_back_to_the_same_bits() {
        for value in [0.1, -1.0 / 3.0, 5e-324, f64::MAX, 1e16, -0.0] {
            let literal = number_literal("value", value).unwrap();
            assert_eq!(literal.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{literal}");
            assert!(literal.contains(['.', 'e']), "{literal} would be an integer");
        }
        assert!(number_literal("value", f64::NAN).is_err());
    }

    #[test]
    fn single_literals_read_back_to_the_nearest_single_number() {
        for value in [0.1, -1.0 / 3.0, 1e-45, 1e-60, 3.4e38, 1e16, -0.0] {
            let literal = single_literal("value", value).unwrap();
            let read = literal.parse::<f32>().unwrap();
            assert_eq!(read.to_bits(), (value as f32).to_bits(), "{literal}");
            assert!(literal.contains(['.', 'e']), "{literal} would be an integer");
        }
        assert_eq!(single_literal("value", 1.0 / 3.0).unwrap(), "0.33333334");
        let beyond = single_literal("value", 1e39);
        assert!(matches!(beyond, Err(EmissionError::TooLarge { .. })));
        assert!(single_literal("value", f64::NAN).is_err());
    }
}
