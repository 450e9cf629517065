//! The files of an emission, and whether a folder holds them but for rounding.
//!
//! The same program on the same machine emits the same bytes. Another mathematical library or
//! processor may round a coefficient differently, so numbers may differ in their last digits;
//! nothing else may.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use super::error::EmissionError;
use super::layout::{catalogue_root, manifest, standalone_root};
use super::module::EmittedModule;
use super::options::Target;
use crate::numeric::FloatFormat;

/// The files of an emission: relative path (with `/`) to text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmittedCrate {
    /// The files, sorted by path.
    pub files: BTreeMap<String, String>,
}

/// How a folder differs from an emission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// A file is not there.
    Missing {
        /// Its path in the crate.
        path: String,
    },
    /// A file cannot be read.
    Unreadable {
        /// Its path in the crate.
        path: String,
    },
    /// A file has another text, beyond the rounding of coefficients.
    Changed {
        /// Its path in the crate.
        path: String,
        /// The first line that differs by more than rounding, counted from 1.
        line: usize,
    },
}

impl std::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing { path } => write!(formatter, "{path} is missing"),
            Self::Unreadable { path } => write!(formatter, "{path} cannot be read"),
            Self::Changed { path, line } => write!(formatter, "{path} differs from line {line} on"),
        }
    }
}

impl EmittedCrate {
    /// A map that stands alone: in Rust a crate of manifest, root and one module, package
    /// `IDENTIFIER_map`; in C a header `IDENTIFIER.h`; in CUDA `IDENTIFIER.cu`.
    ///
    /// # Errors
    ///
    /// [`EmissionError::Layout`] if a template fails.
    pub fn standalone(module: &EmittedModule) -> Result<Self, EmissionError> {
        let name = &module.identifier;
        let text = module.text.clone();
        let files = match module.target {
            Target::Rust => BTreeMap::from([
                ("Cargo.toml".to_owned(), manifest(&format!("{name}_map"))?),
                ("src/lib.rs".to_owned(), standalone_root(name)?),
                (format!("src/{name}.rs"), text),
            ]),
            Target::C => BTreeMap::from([(format!("{name}.h"), text)]),
            Target::Cuda => BTreeMap::from([(format!("{name}.cu"), text)]),
        };
        Ok(Self { files })
    }

    /// The sources of the catalogue's crate: one module per map, sorted by name, and a registry of
    /// them.
    ///
    /// # Errors
    ///
    /// [`EmissionError::DuplicateModule`] for two maps of one name;
    /// [`EmissionError::SingleInCatalogue`] for one that is not in double precision;
    /// [`EmissionError::Layout`] if a template fails.
    pub fn catalogue(modules: &[EmittedModule]) -> Result<Self, EmissionError> {
        let mut files = BTreeMap::new();
        for module in modules {
            if module.precision != FloatFormat::F64 {
                return Err(EmissionError::SingleInCatalogue { name: module.identifier.clone() });
            }
            let path = format!("src/{}.rs", module.identifier);
            if files.insert(path, module.text.clone()).is_some() {
                return Err(EmissionError::DuplicateModule { name: module.identifier.clone() });
            }
        }
        let mut names: Vec<&str> =
            modules.iter().map(|module| module.identifier.as_str()).collect();
        names.sort_unstable();
        files.insert("src/lib.rs".to_owned(), catalogue_root(&names)?);
        Ok(Self { files })
    }

    /// How a folder differs from this emission by more than the rounding of coefficients; other
    /// files in the folder do not count.
    pub fn check(&self, folder: &Path) -> Vec<Difference> {
        self.files
            .iter()
            .filter_map(|(path, text)| difference(path, text, &folder.join(path)))
            .collect()
    }
}

fn difference(path: &str, text: &str, file: &Path) -> Option<Difference> {
    let path = path.to_owned();
    match std::fs::read_to_string(file) {
        Err(failure) if failure.kind() == io::ErrorKind::NotFound => {
            Some(Difference::Missing { path })
        }
        Err(_) => Some(Difference::Unreadable { path }),
        Ok(found) => first_difference(&found, text).map(|line| Difference::Changed { path, line }),
    }
}

/// Relative difference of two literals that still counts as rounding.
const RELATIVE: f64 = 1e-9;
/// The same, relative to the largest literal of the text: for coefficients that are rounding
/// themselves.
const OF_LARGEST: f64 = 1e-12;

/// First line, counted from 1, in which two texts differ by more than rounding.
pub(super) fn first_difference(found: &str, expected: &str) -> Option<usize> {
    if found == expected {
        return None;
    }
    let literals = expected.lines().flat_map(tokens).filter_map(float_literal);
    let largest = literals.map(f64::abs).fold(0.0, f64::max);
    let (found, expected) = (found.split('\n'), expected.split('\n'));
    let lines = found.clone().count().max(expected.clone().count());
    let (mut found, mut expected) = (found, expected);
    (1..=lines).find(|_| match (found.next(), expected.next()) {
        (Some(found), Some(expected)) => !same_line(found, expected, largest),
        _ => true,
    })
}

fn same_line(found: &str, expected: &str, largest: f64) -> bool {
    found == expected
        || (tokens(found).count() == tokens(expected).count()
            && tokens(found).zip(tokens(expected)).all(|(a, b)| same_token(a, b, largest)))
}

fn same_token(found: &str, expected: &str, largest: f64) -> bool {
    match (float_literal(found), float_literal(expected)) {
        (Some(a), Some(b)) => {
            let difference = (a - b).abs();
            difference <= RELATIVE * a.abs().max(b.abs()) || difference <= OF_LARGEST * largest
        }
        _ => found == expected,
    }
}

/// Words and the runs between them; a number with its point, exponent and exponent's sign is one
/// word.
fn tokens(line: &str) -> impl Iterator<Item = &str> {
    let mut rest = line;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let number = first.is_ascii_digit();
        let mut previous = first;
        let end = rest
            .char_indices()
            .skip(1)
            .find(|&(_, character)| {
                let signed_exponent = number && character == '-' && previous == 'e';
                let ends =
                    !(signed_exponent || is_word(character, number)) || !is_word(first, true);
                previous = character;
                ends
            })
            .map_or(rest.len(), |(index, _)| index);
        let (token, tail) = rest.split_at(end);
        rest = tail;
        Some(token)
    })
}

fn is_word(character: char, number: bool) -> bool {
    character.is_ascii_alphanumeric() || character == '_' || (number && character == '.')
}

/// The value of a token that is a decimal literal with a point or an exponent.
fn float_literal(token: &str) -> Option<f64> {
    let first = token.chars().next()?;
    (first.is_ascii_digit() && token.contains(['.', 'e'])).then(|| token.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "let a = fma(b, 1.25, -3.5e-7);\nlet c = x_1 * 0.1;";

    #[test]
    fn last_digits_are_rounding() {
        let other =
            TEXT.replace("3.5e-7", "3.5000000000000003e-7").replace("0.1", "0.10000000000000002");
        assert_eq!(first_difference(&other, TEXT), None);
    }

    #[test]
    fn another_coefficient_is_a_difference() {
        assert_eq!(first_difference(&TEXT.replace("0.1", "0.1001"), TEXT), Some(2));
        assert_eq!(first_difference(&TEXT.replace("1.25", "1.2500001"), TEXT), Some(1));
    }

    #[test]
    fn names_signs_and_lines_must_agree() {
        assert_eq!(first_difference(&TEXT.replace("x_1", "x_2"), TEXT), Some(2));
        assert_eq!(first_difference(&TEXT.replace("-3.5", "3.5"), TEXT), Some(1));
        assert_eq!(first_difference("let a = fma(b, 1.25, -3.5e-7);", TEXT), Some(2));
    }
}
