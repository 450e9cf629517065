//! Sign changes of a polynomial on `(0, 1]`, isolated in the Bernstein basis.
//!
//! The number of sign changes of a polynomial in an interval is at most that of its Bernstein
//! coefficients there, and of the same parity: none and one are certain, and more than one is
//! halved by de Casteljau's algorithm.

use super::{Crossing, CrossingDirection, evaluate};
use crate::numeric::{Bracket, Real};

/// Halvings after which coefficients of alternating sign are taken for rounding noise around a
/// multiple root.
const DEPTH_LIMIT: usize = 60;

/// All sign changes on `(0, 1]` of the polynomial with these ascending power coefficients, in
/// order.
pub(super) fn sign_changes<S: Real>(coefficients: &[S]) -> Vec<Crossing<S>> {
    let mut found = Vec::new();
    let piece = Piece {
        lower: S::zero(),
        upper: S::one(),
        coefficients: to_bernstein(coefficients),
    };
    collect(coefficients, piece, 0, &mut found);
    found
}

/// A polynomial on `[lower, upper]` by its Bernstein coefficients there.
struct Piece<S> {
    lower: S,
    upper: S,
    coefficients: Vec<S>,
}

/// The sign changes of a piece, in order: those inside, and one exactly at its upper end.
fn collect<S: Real>(power: &[S], piece: Piece<S>, depth: usize, found: &mut Vec<Crossing<S>>) {
    let changes = variations(&piece.coefficients);
    if changes > 1 && depth < DEPTH_LIMIT {
        let (left, right) = piece.halved();
        collect(power, left, depth + 1, found);
        collect(power, right, depth + 1, found);
        return;
    }
    if changes % 2 == 1 {
        found.extend(isolated(power, &piece));
    }
    found.extend(change_at_upper_end(&piece));
}

/// The sign change of a piece whose first and last nonzero coefficients differ in sign.
fn isolated<S: Real>(power: &[S], piece: &Piece<S>) -> Option<Crossing<S>> {
    let mut nonzero = piece
        .coefficients
        .iter()
        .filter(|&&value| value != S::zero());
    let first = nonzero.next().copied()?;
    let last = nonzero.next_back().copied()?;
    let bracket = Bracket::new(piece.lower, piece.upper, first, last).ok()?;
    let time = bracket
        .newton(S::zero(), |time| evaluate(power, time))
        .root()?;
    Some(Crossing {
        time,
        direction: direction_from(first),
    })
}

/// A root exactly at the upper end: a sign change if an odd count of last coefficients is zero.
fn change_at_upper_end<S: Real>(piece: &Piece<S>) -> Option<Crossing<S>> {
    let last = piece
        .coefficients
        .iter()
        .rposition(|&value| value != S::zero())?;
    let multiplicity = piece.coefficients.len() - 1 - last;
    (multiplicity % 2 == 1).then(|| Crossing {
        time: piece.upper,
        direction: direction_from(piece.coefficients[last]),
    })
}

fn direction_from<S: Real>(before: S) -> CrossingDirection {
    if before > S::zero() {
        CrossingDirection::Entering
    } else {
        CrossingDirection::Leaving
    }
}

/// Sign changes in the sequence of coefficients, zeros skipped.
fn variations<S: Real>(coefficients: &[S]) -> usize {
    let mut sign = S::zero();
    let mut count = 0;
    for coefficient in coefficients {
        let next = coefficient.signum();
        if next == S::zero() {
            continue;
        }
        count += usize::from(sign == -next);
        sign = next;
    }
    count
}

impl<S: Real> Piece<S> {
    /// The two halves by de Casteljau's algorithm: repeated means of neighbours.
    fn halved(self) -> (Self, Self) {
        let half = S::from_f64(0.5);
        let middle = (self.lower + self.upper) * half;
        let mut right = self.coefficients;
        let mut left = Vec::with_capacity(right.len());
        for remaining in (1..=right.len()).rev() {
            left.push(right[0]);
            for index in 1..remaining {
                right[index - 1] = (right[index - 1] + right[index]) * half;
            }
        }
        (
            Piece {
                lower: self.lower,
                upper: middle,
                coefficients: left,
            },
            Piece {
                lower: middle,
                upper: self.upper,
                coefficients: right,
            },
        )
    }
}

/// Bernstein coefficients on `[0, 1]` from power coefficients.
///
/// With `d_k = c_k / binomial(n, k)`, repeated sums of neighbours give `b_j = sum_k binomial(j, k)
/// d_k`.
pub(super) fn to_bernstein<S: Real>(power: &[S]) -> Vec<S> {
    let degree = power.len().saturating_sub(1);
    let mut binomial = S::one();
    let mut coefficients = Vec::with_capacity(power.len());
    for (k, &coefficient) in power.iter().enumerate() {
        coefficients.push(coefficient / binomial);
        binomial = binomial * S::from_f64((degree - k) as f64) / S::from_f64((k + 1) as f64);
    }
    for lowest in (1..=degree).map(|step| degree - step) {
        for index in lowest..degree {
            coefficients[index + 1] = coefficients[index] + coefficients[index + 1];
        }
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_have_the_bernstein_coefficients_of_the_binomial_theorem() {
        // t^2 on degree 3: 0, 0, 1/3, 1; and 1 + t: 1, 4/3, 5/3, 2.
        assert_eq!(to_bernstein(&[0.0, 0.0, 3.0, 0.0]), [0.0, 0.0, 1.0, 3.0]);
        assert_eq!(to_bernstein(&[3.0, 3.0, 0.0, 0.0]), [3.0, 4.0, 5.0, 6.0]);
        assert_eq!(to_bernstein(&[0.0, 0.0, 0.0, 2.0]), [0.0, 0.0, 0.0, 2.0]);
    }

    #[test]
    fn root_on_a_point_of_division_is_found_once() {
        // (t - 1/2) ((t - 1/2)^2 - 1/16): roots 1/4, 1/2, 3/4.
        let found = sign_changes(&[-0.09375_f64, 0.6875, -1.5, 1.0]);
        assert_eq!(found.len(), 3);
        for (change, root) in found.iter().zip([0.25, 0.5, 0.75]) {
            // Rounding of the terms, at most 0.7, over the slope, at least 0.06.
            assert!((change.time - root).abs() < 2e-15, "{found:?}");
        }
    }

    #[test]
    fn double_root_is_no_sign_change() {
        assert!(sign_changes(&[0.25, -1.0, 1.0]).is_empty());
        assert!(sign_changes(&[0.09, -0.6, 1.0]).is_empty());
        assert_eq!(sign_changes(&[0.0, -1.0, 1.0]).len(), 1);
    }
}
