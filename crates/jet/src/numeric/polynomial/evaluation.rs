//! Values of polynomials in four interleaved chains.
//!
//! One idea: `p(t) = P_0(q) + t P_1(q) + t² P_2(q) + t³ P_3(q)` with `q = t⁴`: four short chains of
//! dependent operations run side by side, in place of one long chain. Polynomials of twelve
//! coefficients, the series of exact flight in `f64`, have code without loops, whose sums stay in
//! registers.

use num_traits::Zero;

use crate::numeric::{Branched, Real, Scalar};

const CHAINS: usize = 4;

/// The value at `time` of the polynomial with these ascending coefficients.
#[inline(always)]
pub fn value<S: Scalar>(coefficients: &[S], time: S) -> S {
    let square = time * time;
    let quartic = square * square;
    let (chunks, rest) = coefficients.as_chunks::<CHAINS>();
    let chains = match (chunks, rest) {
        ([low, middle, high], []) => {
            let chains = continued(high, quartic, middle);
            continued(&chains, quartic, low)
        }
        _ => {
            let mut chains = start(rest);
            for chunk in chunks.iter().rev() {
                chains = continued(&chains, quartic, chunk);
            }
            chains
        }
    };
    join(&chains, time, square)
}

/// The value and the derivative at `time` of the polynomial with these ascending coefficients.
#[inline(always)]
pub fn value_and_slope<S: Scalar>(coefficients: &[S], time: S) -> (S, S) {
    let square = time * time;
    let quartic = square * square;
    let (chunks, rest) = coefficients.as_chunks::<CHAINS>();
    let (chains, slopes) = match (chunks, rest) {
        ([low, middle, high], []) => {
            let chains = continued(high, quartic, middle);
            let slopes = continued(high, quartic, &chains);
            (continued(&chains, quartic, low), slopes)
        }
        _ => {
            let (mut chains, mut slopes) = (start(rest), [S::zero(); CHAINS]);
            for chunk in chunks.iter().rev() {
                slopes = continued(&slopes, quartic, &chains);
                chains = continued(&chains, quartic, chunk);
                S::carried(&mut slopes);
                S::carried(&mut chains);
            }
            (chains, slopes)
        }
    };
    let [_, first, second, third] = chains;
    let (two, three, four) = (S::from_f64(2.0), S::from_f64(3.0), S::from_f64(4.0));
    let within = (three * third * time + two * second).mul_add(time, first);
    let along = join(&slopes, time, square) * (four * square * time);
    (join(&chains, time, square), within + along)
}

/// `Σ_k |c_k| end^k`: a bound on the polynomial with these ascending coefficients on `[−end, end]`.
#[inline]
pub fn size<S: Real>(coefficients: &[S], end: f64) -> f64 {
    sizes(coefficients, end)
}

/// [`size`] lane by lane.
#[inline(always)]
pub fn sizes<S: Branched>(coefficients: &[S], end: S::Rounded) -> S::Rounded {
    let square = end * end;
    let quartic = square * square;
    let (chunks, rest) = coefficients.as_chunks::<CHAINS>();
    let mut chains = start(rest).map(|coefficient: S| coefficient.abs().rounded());
    for chunk in chunks.iter().rev() {
        for lane in 0..CHAINS {
            chains[lane] = chains[lane] * quartic + chunk[lane].abs().rounded();
        }
        S::carried(&mut chains);
    }
    join(&chains, end, square)
}

/// A lower bound on `[0, end]`: the least value of the first three terms, minus the sizes of the
/// others.
#[inline(always)]
pub fn lower_bound<S: Branched>(coefficients: &[S], end: S::Rounded) -> S::Rounded {
    let zero = S::Rounded::zero();
    let [first, second, third, rest @ ..] = coefficients else {
        return S::Rounded::from_f64(f64::NEG_INFINITY);
    };
    let [a, b, c] = [first, second, third].map(|value| value.rounded());
    let at = |time: S::Rounded| (c * time + b) * time + a;
    let turn = (S::Rounded::from_f64(-0.5) * b / c).max(zero).min(end);
    let at_turn = S::Rounded::select(zero.is_below(c), at(turn), a);
    a.min(at(end)).min(at_turn) - sizes(rest, end) * end * end * end
}

/// One Horner step of all chains.
#[inline(always)]
fn continued<S: Scalar>(chains: &[S; CHAINS], quartic: S, next: &[S; CHAINS]) -> [S; CHAINS] {
    let mut sums = *next;
    for lane in 0..CHAINS {
        sums[lane] = chains[lane].mul_add(quartic, next[lane]);
    }
    sums
}

/// Starts of the chains: the coefficients above the whole chunks.
#[inline(always)]
fn start<S: Scalar>(rest: &[S]) -> [S; CHAINS] {
    std::array::from_fn(|lane| rest.get(lane).copied().unwrap_or(S::zero()))
}

#[inline(always)]
fn join<S: Scalar>(chains: &[S; CHAINS], time: S, square: S) -> S {
    let low = chains[1].mul_add(time, chains[0]);
    let high = chains[3].mul_add(time, chains[2]);
    high.mul_add(square, low)
}

/// Number of coefficients, and of control points.
pub const TERMS: usize = 16;

/// `C(i, k)/C(15, k)` in row `k` and column `i`.
static COLUMNS: [[f64; TERMS]; TERMS] = {
    let mut columns = [[0.0; TERMS]; TERMS];
    let mut i = 0;
    while i < TERMS {
        let (mut k, mut share) = (0, 1.0);
        while k <= i {
            columns[k][i] = share;
            share *= (i - k) as f64 / (TERMS - 1 - k) as f64;
            k += 1;
        }
        i += 1;
    }
    columns
};

/// The Bernstein coefficients on `[0, 1]` of a polynomial of degree 15 with these ascending
/// coefficients.
///
/// ```text
/// b_i = Σ_{k ≤ i} C(i, k)/C(15, k) c_k
/// ```
///
/// ```
/// use grazemap_jet::numeric::polynomial::{TERMS, control_points};
/// let mut line = [0.0; TERMS];
/// line[1] = 15.0;
/// for (point, number) in control_points(&line).into_iter().zip(0u8..) {
///     assert!((point - f64::from(number)).abs() < 1e-14);
/// }
/// ```
#[inline(always)]
pub fn control_points<S: Scalar>(coefficients: &[S; TERMS]) -> [S; TERMS] {
    let mut points = [S::zero(); TERMS];
    if size_of::<S>() > size_of::<f64>() {
        // NOTE: lanes fill the registers by themselves; the sum of a point then stays in one
        // register.
        for (i, point) in points.iter_mut().enumerate() {
            for (&coefficient, column) in coefficients[..=i].iter().zip(&COLUMNS) {
                *point += coefficient * S::from_f64(column[i]);
            }
        }
        return points;
    }
    for (&coefficient, column) in coefficients.iter().zip(&COLUMNS) {
        for (point, &share) in points.iter_mut().zip(column) {
            *point += coefficient * S::from_f64(share);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;
    use crate::numeric::polynomial::to_bernstein;

    #[test]
    fn chains_give_the_value_and_the_slope_of_integer_polynomials_exactly() {
        for len in 0..12usize {
            let coefficients: Vec<f64> = (0..len).map(|k| (k * k) as f64 - 3.0).collect();
            let powers = |time: f64, shift: usize| -> f64 {
                let term = |(k, c): (usize, &f64)| match shift {
                    0 => c * time.powi(k as i32),
                    _ => k as f64 * c * time.powi(k as i32 - 1),
                };
                coefficients.iter().enumerate().map(term).sum()
            };
            for time in [-2.0, 1.0, 3.0] {
                let expected = (powers(time, 0), powers(time, 1));
                assert_eq!(value_and_slope(&coefficients, time), expected, "{len} {time}");
                assert_eq!(value(&coefficients, time), expected.0);
                let sizes = coefficients.iter().map(|c| c.abs()).collect::<Vec<_>>();
                assert_eq!(size(&coefficients, time.abs()), value(&sizes, time.abs()));
            }
        }
    }

    #[test]
    fn powers_have_the_control_points_of_repeated_sums_in_double_double() {
        for power in 0..TERMS {
            let coefficients: [f64; TERMS] = std::array::from_fn(|k| f64::from(k == power));
            let exact = to_bernstein(&coefficients.map(Dd::from));
            for (point, exact) in control_points(&coefficients).into_iter().zip(exact) {
                let exact = exact.to_f64();
                // A share is a chain of at most 15 quotients and products, each rounded.
                assert!((point - exact).abs() <= 30.0 * f64::ROUNDOFF * exact, "{power}");
            }
        }
    }
}
