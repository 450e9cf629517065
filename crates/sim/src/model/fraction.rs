//! Fractions near a number, and numbers as multiples of pi.

use std::f64::consts::PI;

/// A positive fraction in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fraction {
    /// Numerator.
    pub(super) over: u64,
    /// Denominator.
    pub(super) under: u64,
}

impl Fraction {
    /// One.
    pub(super) const ONE: Self = Self { over: 1, under: 1 };
    /// Largest denominator of a simple fraction.
    pub(super) const LARGEST: u64 = 1000;

    /// First convergent within a relative distance of a positive number; `None` if its denominator
    /// exceeds `largest`.
    pub(super) fn near(number: f64, distance: f64, largest: u64) -> Option<Self> {
        let (mut last, mut now) = ([1.0_f64, 0.0], [number.floor(), 1.0]);
        let mut rest = number - number.floor();
        while (now[0] / now[1] - number).abs() > distance * number {
            let next = (1.0 / rest).floor();
            rest = 1.0 / rest - next;
            (last, now) = (now, [next * now[0] + last[0], next * now[1] + last[1]]);
            if now[1].is_nan() || now[1] > largest as f64 {
                return None;
            }
        }
        let inside = (1.0..=1e9).contains(&now[0]);
        inside.then_some(Self { over: now[0] as u64, under: now[1] as u64 })
    }

    /// Largest fraction of which both fractions are whole multiples; `None` if its terms are too
    /// large.
    pub(super) fn common(self, other: Self) -> Option<Self> {
        let left = self.over.checked_mul(other.under)?;
        let right = other.over.checked_mul(self.under)?;
        let (over, under) = (divisor(left, right), self.under.checked_mul(other.under)?);
        let shared = divisor(over, under);
        Some(Self { over: over / shared, under: under / shared })
    }

    /// Value of the fraction.
    pub(super) fn value(self) -> f64 {
        self.over as f64 / self.under as f64
    }
}

/// The greatest common divisor.
fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// A number in the notation of scenes: a multiple of pi if it is a simple one.
pub(super) fn in_pi(number: f64) -> String {
    let Some(Fraction { over, under }) = Fraction::near(number / PI, 1e-13, Fraction::LARGEST)
    else {
        return format!("{number}");
    };
    let over = if over == 1 { "pi".to_owned() } else { format!("{over}*pi") };
    if under == 1 { over } else { format!("{over}/{under}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_multiple_of_pi_where_it_is_a_simple_one() {
        for (number, expected) in [
            (PI, "pi"),
            (2.0 * PI, "2*pi"),
            (2.5 * PI, "5*pi/2"),
            (PI / 3.0, "pi/3"),
            (1.0, "1"),
            (7.687735970363125, "7.687735970363125"),
        ] {
            assert_eq!(in_pi(number), expected);
        }
    }

    #[test]
    fn the_common_part_of_two_fractions_divides_both() {
        let fraction = |over, under| Fraction { over, under };
        assert_eq!(fraction(1, 1).common(fraction(3, 2)), Some(fraction(1, 2)));
        assert_eq!(fraction(2, 3).common(fraction(4, 5)), Some(fraction(2, 15)));
        assert_eq!(fraction(1, u64::MAX).common(fraction(1, 3)), None);
    }

    #[test]
    fn a_fraction_is_found_near_a_number_and_none_near_an_irrational_one() {
        let found = |number| Fraction::near(number, 1e-11, Fraction::LARGEST);
        assert_eq!(found(1.25), Some(Fraction { over: 5, under: 4 }));
        assert_eq!(found(2.0_f64.sqrt()), None);
        assert_eq!(found(f64::NAN), None);
        let rough = Fraction::near(2.0_f64.sqrt(), 1e-2, 100);
        assert_eq!(rough, Some(Fraction { over: 17, under: 12 }));
    }
}
