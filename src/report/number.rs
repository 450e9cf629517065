//! Numbers as text: short for people, exact for programs.

/// A number to `digits` significant digits, for a person.
///
/// Fixed notation where the exponent of ten lies between -4 and 5, scientific outside; never
/// more digits than asked for, a true minus sign nowhere, so that the text can be parsed back.
/// `digits` is taken between 1 and 17.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return non_finite(value).to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{:.*e}", digits - 1, value);
    let exponent = exponent_of(&scientific);
    if (-4..=5).contains(&exponent) {
        let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
        format!("{value:.decimals$}")
    } else {
        scientific
    }
}

/// A number to 17 significant digits, which any reader turns back into the same double.
pub(super) fn exact(value: f64) -> String {
    if value.is_finite() { format!("{value:.16e}") } else { non_finite(value).to_owned() }
}

fn non_finite(value: f64) -> &'static str {
    match (value.is_nan(), value > 0.0) {
        (true, _) => "nan",
        (false, true) => "inf",
        (false, false) => "-inf",
    }
}

fn exponent_of(scientific: &str) -> i32 {
    scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A number of things, in words: `1 file`, `2 files`, `2 branches`.
pub fn counted(count: usize, thing: &str) -> String {
    let hisses = ["s", "x", "z", "ch", "sh"].iter().any(|end| thing.ends_with(end));
    let plural = match (count, hisses) {
        (1, _) => "",
        (_, true) => "es",
        (_, false) => "s",
    };
    format!("{count} {thing}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_counted_in_words() {
        assert_eq!(counted(1, "branch"), "1 branch");
        assert_eq!(counted(4, "branch"), "4 branches");
        assert_eq!(counted(0, "file"), "0 files");
    }

    #[test]
    fn numbers_for_people_keep_the_digits_asked_for() {
        assert_eq!(significant(0.1 + 0.2, 4), "0.3000");
        assert_eq!(significant(-1234.5678, 6), "-1234.57");
        assert_eq!(significant(9.9996e-5, 4), "0.0001000");
        assert_eq!(significant(1.25e-7, 3), "1.25e-7");
        assert_eq!(significant(999_999.9, 3), "1.00e6");
        assert_eq!(significant(123_456.0, 3), "123456");
        assert_eq!(significant(f64::NAN, 3), "nan");
    }

    #[test]
    fn exact_text_reads_back_as_the_same_double() {
        for value in [0.1, 1.0 / 3.0, -2.5e-308, f64::MAX, 5e-324, 0.0] {
            assert_eq!(exact(value).parse::<f64>(), Ok(value));
        }
    }
}
