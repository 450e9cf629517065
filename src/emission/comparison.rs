//! Whether a text is today's emission but for rounding.
//!
//! The same program on the same machine emits the same bytes. Another mathematical library or
//! processor may round a coefficient differently, so numbers may differ in their last digits;
//! nothing else may.

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
            && tokens(found)
                .zip(tokens(expected))
                .all(|(a, b)| same_token(a, b, largest)))
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
    (first.is_ascii_digit() && token.contains(['.', 'e']))
        .then(|| token.parse().ok())
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "let a = fma(b, 1.25, -3.5e-7);\nlet c = x_1 * 0.1;";

    #[test]
    fn last_digits_are_rounding() {
        let other = TEXT
            .replace("3.5e-7", "3.5000000000000003e-7")
            .replace("0.1", "0.10000000000000002");
        assert_eq!(first_difference(&other, TEXT), None);
    }

    #[test]
    fn another_coefficient_is_a_difference() {
        assert_eq!(
            first_difference(&TEXT.replace("0.1", "0.1001"), TEXT),
            Some(2)
        );
        assert_eq!(
            first_difference(&TEXT.replace("1.25", "1.2500001"), TEXT),
            Some(1)
        );
    }

    #[test]
    fn names_signs_and_lines_must_agree() {
        assert_eq!(first_difference(&TEXT.replace("x_1", "x_2"), TEXT), Some(2));
        assert_eq!(
            first_difference(&TEXT.replace("-3.5", "3.5"), TEXT),
            Some(1)
        );
        assert_eq!(
            first_difference("let a = fma(b, 1.25, -3.5e-7);", TEXT),
            Some(2)
        );
    }
}
