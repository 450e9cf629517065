//! All extrema and all real roots of a polynomial on an interval.
//!
//! The one idea: between neighbouring extrema a polynomial is monotone, so the signs of its values
//! at the extrema decide where its roots are, however close together. The extrema are sign changes
//! of the derivative, isolated by subdivision in the Bernstein basis (Descartes' rule of signs;
//! Lane and Riesenfeld 1981, *Bounds on a polynomial*).
//!
//! Coefficients ascend in the power of the time `t`. The interval runs from `0` (excluded) to `end`
//! (included), so that steps laid end to end report each event once. `end` may be negative: then
//! "first", "before" and "after" follow the direction from `0` to `end`. Coefficients or ends that
//! are not finite give no extrema and no roots; callers check theirs.

mod evaluation;

use std::cmp::Ordering;

use super::{Bracket, Real};

pub use evaluation::{TERMS, control_points, lower_bound, size, sizes, value, value_and_slope};

/// A local minimum or maximum of a polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum<S> {
    /// Time of the extremum.
    pub time: S,
    /// Value of the polynomial at the extremum.
    pub value: S,
    /// Minimum or maximum.
    pub kind: ExtremumKind,
}

/// Kind of an extremum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExtremumKind {
    /// Minimum: from falling to rising.
    Minimum,
    /// Maximum: from rising to falling.
    Maximum,
}

/// A root at which a polynomial changes its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<S> {
    /// Time of the root.
    pub time: S,
    /// Direction of the change of sign.
    pub direction: CrossingDirection,
}

/// Direction of a change of sign, on the way from `0` to the end of the interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossingDirection {
    /// Change from positive to negative: into contact, for an event function that is positive in
    /// free flight.
    Entering,
    /// Change from negative to positive.
    Leaving,
}

/// A real root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root<S> {
    /// Time of the root.
    pub time: S,
    /// Behaviour of the polynomial at the root.
    pub kind: RootKind,
}

/// Behaviour of a polynomial at a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RootKind {
    /// The polynomial changes its sign.
    Crossing(CrossingDirection),
    /// The polynomial has an extremum whose value is zero within rounding.
    Tangency(ExtremumKind),
    /// The root is the start of the interval.
    Start,
}

impl<S: Real> Extremum<S> {
    /// Whether the extremum lies beyond zero: a minimum below, a maximum above.
    fn overshoots(&self) -> bool {
        match self.kind {
            ExtremumKind::Minimum => self.value < S::zero(),
            ExtremumKind::Maximum => self.value > S::zero(),
        }
    }
}

/// Value and derivative at `time` of the polynomial with these ascending coefficients.
///
/// ```
/// use grazemap_jet::numeric::polynomial::evaluate;
/// assert_eq!(evaluate(&[1.0, 0.0, 3.0], 2.0), (13.0, 12.0));
/// ```
pub fn evaluate<S: Real>(coefficients: &[S], time: S) -> (S, S) {
    let start = (S::zero(), S::zero());
    coefficients.iter().rev().fold(start, |(value, slope), &coefficient| {
        (value.mul_add(time, coefficient), slope.mul_add(time, value))
    })
}

/// All local minima and maxima in `(0, end]`, in order.
///
/// Each extremum is a sign change of the derivative. Its accuracy is the precision of the type
/// times the condition number of the derivative's root. Inflection points with a level tangent are
/// not included.
///
/// ```
/// use grazemap_jet::numeric::polynomial::{ExtremumKind, extrema};
/// let found = extrema(&[2.0, -2.0, 1.0], 3.0); // (t - 1)^2 + 1
/// assert_eq!((found[0].time, found[0].value, found[0].kind), (1.0, 1.0, ExtremumKind::Minimum));
/// ```
pub fn extrema<S: Real>(coefficients: &[S], end: S) -> Vec<Extremum<S>> {
    if has_one_sign(&derivative(coefficients), end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    extrema_on_unit(&scaled)
        .into_iter()
        .map(|extremum| Extremum { time: extremum.time * end, ..extremum })
        .collect()
}

/// All roots with a change of sign in `(0, end]`, in order, each located inside its monotone piece.
///
/// Two roots on either side of a shallow extremum are separated if the extremum's value is computed
/// with the right sign, that is down to about `Scalar::ROUNDOFF` times the largest term. A start at
/// a root is not a crossing: set the constant coefficient to exactly zero there.
///
/// ```
/// use grazemap_jet::numeric::polynomial::{CrossingDirection, crossings};
/// let found = crossings(&[0.75_f64, -2.0, 1.0], 1.0); // roots 0.5 and 1.5
/// assert_eq!(found.len(), 1);
/// assert!((found[0].time - 0.5).abs() < 1e-15);
/// assert_eq!(found[0].direction, CrossingDirection::Entering);
/// ```
pub fn crossings<S: Real>(coefficients: &[S], end: S) -> Vec<Crossing<S>> {
    if has_one_sign(coefficients, end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    let mut crossings = crossings_on_unit(&scaled, &extrema_on_unit(&scaled));
    for crossing in &mut crossings {
        crossing.time *= end;
    }
    crossings
}

/// All real roots in `[0, end]`, in order: crossings, tangencies, and the start if it is an exact
/// root.
///
/// An extremum counts as a tangency if its value is within `4 n` roundings of the sum of the terms'
/// magnitudes, for `n` coefficients, unless a crossing next to it represents it already. The zero
/// polynomial has no roots here.
pub fn roots_on_interval<S: Real>(coefficients: &[S], end: S) -> Vec<Root<S>> {
    if has_one_sign(coefficients, end) {
        return Vec::new();
    }
    let scaled = scaled_to_unit(coefficients, end);
    if scaled.iter().all(|&coefficient| coefficient == S::zero()) {
        return Vec::new();
    }
    let extrema = extrema_on_unit(&scaled);
    let crossings = crossings_on_unit(&scaled, &extrema);
    let mut roots = tangencies(&scaled, &extrema, &crossings);
    roots.extend(crossings.iter().map(|crossing| Root {
        time: crossing.time,
        kind: RootKind::Crossing(crossing.direction),
    }));
    if scaled.first() == Some(&S::zero()) {
        roots.push(Root { time: S::zero(), kind: RootKind::Start });
    }
    roots.sort_by(|a, b| a.time.partial_cmp(&b.time).unwrap_or(Ordering::Equal));
    for root in &mut roots {
        root.time *= end;
    }
    roots
}

/// Whether `|c_0| > sum_{k>0} |c_k end^k|`, so that there is no root; also true if a term is not
/// finite.
fn has_one_sign<S: Real>(coefficients: &[S], end: S) -> bool {
    let Some((first, rest)) = coefficients.split_first() else {
        return true;
    };
    let end = end.abs();
    let bound =
        rest.iter().rev().fold(S::zero(), |bound, &coefficient| (bound + coefficient.abs()) * end);
    !(first.is_finite() && bound.is_finite()) || first.abs() > bound
}

/// `c_k end^k`: coefficients of the polynomial in `t / end` on `[0, 1]`.
fn scaled_to_unit<S: Real>(coefficients: &[S], end: S) -> Vec<S> {
    let mut power = S::one();
    let scaled = coefficients.iter().map(|&coefficient| {
        let value = coefficient * power;
        power *= end;
        value
    });
    scaled.collect()
}

fn derivative<S: Real>(coefficients: &[S]) -> Vec<S> {
    let terms = coefficients.iter().enumerate().skip(1);
    terms.map(|(power, &coefficient)| coefficient * S::from_f64(power as f64)).collect()
}

fn extrema_on_unit<S: Real>(scaled: &[S]) -> Vec<Extremum<S>> {
    let slope = derivative(scaled);
    let turns = sign_changes(&slope).into_iter().map(|change| Extremum {
        time: change.time,
        value: evaluate(scaled, change.time).0,
        kind: match change.direction {
            CrossingDirection::Leaving => ExtremumKind::Minimum,
            CrossingDirection::Entering => ExtremumKind::Maximum,
        },
    });
    turns.collect()
}

/// The crossings of each monotone piece between `0`, the extrema and `1`.
fn crossings_on_unit<S: Real>(scaled: &[S], extrema: &[Extremum<S>]) -> Vec<Crossing<S>> {
    let start = (S::zero(), scaled.first().copied().unwrap_or(S::zero()));
    let end = (S::one(), evaluate(scaled, S::one()).0);
    let mut crossings = Vec::new();
    let mut before = start;
    let turns = extrema.iter().map(|extremum| (extremum.time, extremum.value));
    for after in turns.chain([end]) {
        if let Some(crossing) = crossing_between(scaled, before, after) {
            crossings.push(crossing);
        }
        before = after;
    }
    crossings.extend(crossing_at_end(scaled, extrema, end.1));
    crossings
}

/// The crossing of a monotone piece, if the signs at its ends differ.
fn crossing_between<S: Real>(scaled: &[S], before: (S, S), after: (S, S)) -> Option<Crossing<S>> {
    let zero = S::zero();
    let direction = if before.1 > zero && after.1 < zero {
        CrossingDirection::Entering
    } else if before.1 < zero && after.1 > zero {
        CrossingDirection::Leaving
    } else {
        return None;
    };
    let bracket = Bracket::new(before.0, after.0, before.1, after.1).ok()?;
    let time = bracket.newton(zero, |time| evaluate(scaled, time)).root()?;
    Some(Crossing { time, direction })
}

/// A root exactly at the end, if the values before it are not zero.
fn crossing_at_end<S: Real>(
    scaled: &[S],
    extrema: &[Extremum<S>],
    value: S,
) -> Option<Crossing<S>> {
    let turns_there = extrema.last().is_some_and(|extremum| extremum.time == S::one());
    if value != S::zero() || turns_there {
        return None;
    }
    let before = extrema.last().map_or(scaled.first().copied()?, |extremum| extremum.value);
    let direction = if before > S::zero() {
        CrossingDirection::Entering
    } else if before < S::zero() {
        CrossingDirection::Leaving
    } else {
        return None;
    };
    Some(Crossing { time: S::one(), direction })
}

/// Extrema whose value is zero within rounding and that have no crossing in the pieces next to them
/// on the far side.
fn tangencies<S: Real>(
    scaled: &[S],
    extrema: &[Extremum<S>],
    crossings: &[Crossing<S>],
) -> Vec<Root<S>> {
    let terms: S = scaled.iter().map(|coefficient| coefficient.abs()).sum();
    let rounding = terms * S::from_f64(4.0 * scaled.len() as f64 * S::ROUNDOFF);
    let crossed = |index: usize| {
        let before = index.checked_sub(1).map_or(S::zero(), |previous| extrema[previous].time);
        let after = extrema.get(index + 1).map_or(S::one(), |next| next.time);
        extrema[index].overshoots()
            && crossings.iter().any(|crossing| before <= crossing.time && crossing.time <= after)
    };
    let touching = extrema
        .iter()
        .enumerate()
        .filter(|(index, extremum)| extremum.value.abs() <= rounding && !crossed(*index));
    touching
        .map(|(_, extremum)| Root { time: extremum.time, kind: RootKind::Tangency(extremum.kind) })
        .collect()
}

/// Halvings after which coefficients of alternating sign count as rounding noise around a multiple
/// root.
const DEPTH_LIMIT: usize = 60;

/// All sign changes on `(0, 1]` of the polynomial with these ascending power coefficients, in
/// order.
fn sign_changes<S: Real>(coefficients: &[S]) -> Vec<Crossing<S>> {
    let mut found = Vec::new();
    let piece =
        Piece { lower: S::zero(), upper: S::one(), coefficients: to_bernstein(coefficients) };
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
    let mut nonzero = piece.coefficients.iter().filter(|&&value| value != S::zero());
    let first = nonzero.next().copied()?;
    let last = nonzero.next_back().copied()?;
    let bracket = Bracket::new(piece.lower, piece.upper, first, last).ok()?;
    let time = bracket.newton(S::zero(), |time| evaluate(power, time)).root()?;
    Some(Crossing { time, direction: direction_from(first) })
}

/// A root exactly at the upper end: a sign change if an odd count of last coefficients is zero.
fn change_at_upper_end<S: Real>(piece: &Piece<S>) -> Option<Crossing<S>> {
    let last = piece.coefficients.iter().rposition(|&value| value != S::zero())?;
    let multiplicity = piece.coefficients.len() - 1 - last;
    (multiplicity % 2 == 1).then(|| Crossing {
        time: piece.upper,
        direction: direction_from(piece.coefficients[last]),
    })
}

fn direction_from<S: Real>(before: S) -> CrossingDirection {
    if before > S::zero() { CrossingDirection::Entering } else { CrossingDirection::Leaving }
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
    /// The two halves of the piece by de Casteljau's algorithm: repeated means of neighbours.
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
            Piece { lower: self.lower, upper: middle, coefficients: left },
            Piece { lower: middle, upper: self.upper, coefficients: right },
        )
    }
}

/// Bernstein coefficients on `[0, 1]` from power coefficients.
///
/// With `d_k = c_k / binomial(n, k)`, repeated sums of neighbours give `b_j = sum_k binomial(j, k)
/// d_k`.
fn to_bernstein<S: Real>(power: &[S]) -> Vec<S> {
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
    use proptest::prelude::*;

    use super::*;
    use crate::numeric::{Dd, fixed_samples};

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

    /// Ascending coefficients of `product (t - root)`.
    fn from_roots(roots: &[Dd]) -> Vec<Dd> {
        roots.iter().fold(vec![Dd::ONE], |product, &root| times(&product, &[-root, Dd::ONE]))
    }

    fn times(a: &[Dd], b: &[Dd]) -> Vec<Dd> {
        let mut product = vec![Dd::ZERO; a.len() + b.len() - 1];
        for (i, &left) in a.iter().enumerate() {
            for (j, &right) in b.iter().enumerate() {
                product[i + j] += left * right;
            }
        }
        product
    }

    fn rounded(coefficients: &[Dd]) -> Vec<f64> {
        coefficients.iter().map(|value| value.hi).collect()
    }

    fn decimal(text: &str) -> Dd {
        Dd::from_decimal(text).unwrap()
    }

    #[test]
    fn taylor_polynomial_of_the_cosine_turns_at_pi_and_crosses_at_half_pi() {
        let mut term = Dd::ONE;
        let coefficients: Vec<Dd> = (0..=42)
            .map(|power| {
                let coefficient = [term, Dd::ZERO, -term, Dd::ZERO][power % 4];
                term /= Dd::from((power + 1) as f64);
                coefficient
            })
            .collect();
        let end = Dd::from(3.2);
        let (extrema, crossings) = (extrema(&coefficients, end), crossings(&coefficients, end));
        // The first omitted term is 3.2^44 / 44! = 1e-32 of the value.
        assert_eq!((extrema.len(), crossings.len()), (1, 1));
        assert!((extrema[0].time - Dd::PI).abs().hi < 1e-29);
        assert!((extrema[0].value + Dd::ONE).abs().hi < 1e-30);
        assert_eq!(extrema[0].kind, ExtremumKind::Minimum);
        assert!((crossings[0].time - Dd::FRAC_PI_2).abs().hi < 1e-31);
        assert_eq!(crossings[0].direction, CrossingDirection::Entering);
    }

    #[test]
    fn two_crossings_of_a_shallow_minimum_are_told_apart_in_double_double() {
        let centre = decimal("0.3");
        let shallow = [centre * centre - decimal("1e-28"), -centre - centre, Dd::ONE];
        let coefficients = times(&shallow, &from_roots(&[Dd::from(-1.0), Dd::from(-2.5)]));
        let found = crossings(&coefficients, Dd::ONE);
        assert_eq!(found.len(), 2);
        // A rounding of 1e-31 over the slope 2e-14 at the roots, with a factor 100 for the
        // conditioning of the product.
        assert!((found[0].time - centre + decimal("1e-14")).abs().hi < 1e-15);
        assert!((found[1].time - centre - decimal("1e-14")).abs().hi < 1e-15);
        assert_eq!(found[0].direction, CrossingDirection::Entering);
        assert_eq!(found[1].direction, CrossingDirection::Leaving);
    }

    #[test]
    fn two_crossings_of_a_shallow_minimum_are_told_apart_in_doubles() {
        let centre = decimal("0.3");
        let shallow = [centre * centre - decimal("1e-14"), -centre - centre, Dd::ONE];
        let found = crossings(&rounded(&shallow), 1.0);
        assert_eq!(found.len(), 2);
        // A rounding of 1e-16 over the slope 2e-7 at the roots.
        assert!((found[0].time - 0.3 + 1e-7).abs() < 2e-9);
        assert!((found[1].time - 0.3 - 1e-7).abs() < 2e-9);
    }

    #[test]
    fn tangency_is_a_root_without_a_crossing() {
        let coefficients = rounded(&from_roots(&[0.5, 0.5, 2.0].map(Dd::from)));
        assert!(crossings(&coefficients, 1.0).is_empty());
        let roots = roots_on_interval(&coefficients, 1.0);
        assert_eq!(roots.len(), 1);
        assert_eq!(roots[0].kind, RootKind::Tangency(ExtremumKind::Maximum));
        assert!((roots[0].time - 0.5).abs() < 1e-15);
    }

    #[test]
    fn ends_of_the_interval_belong_to_the_step_before() {
        let coefficients = [1.0, -1.0];
        let at_end = crossings(&coefficients, 1.0);
        assert_eq!(at_end.len(), 1);
        assert_eq!((at_end[0].time, at_end[0].direction), (1.0, CrossingDirection::Entering));
        assert!(crossings(&[0.0, -1.0], 1.0).is_empty());
        assert_eq!(roots_on_interval(&[0.0, -1.0], 1.0)[0].kind, RootKind::Start);
        assert_eq!(extrema(&[0.0, -2.0, 1.0], 1.0)[0].time, 1.0);
        assert!(extrema(&[0.0, 0.0, 1.0], 1.0).is_empty());
    }

    #[test]
    fn backward_interval_is_searched_in_its_own_direction() {
        let found = crossings(&[1.0, 2.0], -1.0);
        assert_eq!((found[0].time, found[0].direction), (-0.5, CrossingDirection::Entering));
    }

    #[test]
    fn degenerate_input_has_no_events() {
        assert!(crossings::<f64>(&[], 1.0).is_empty());
        assert!(extrema(&[1.0], 1.0).is_empty());
        assert!(roots_on_interval(&[0.0; 5], 1.0).is_empty());
        assert!(crossings(&[f64::NAN, 1.0, 2.0], 1.0).is_empty());
        assert!(extrema(&[0.0, f64::INFINITY, 2.0, 1.0], 1.0).is_empty());
        assert!(crossings(&[1.0, -2.0], f64::NAN).is_empty());
        assert!(crossings(&[1.0, -2.0], 0.0).is_empty());
    }

    /// Event function of a trajectory that nearly comes to rest: an inflection with a level
    /// tangent.
    #[test]
    fn level_inflection_is_crossed_once_and_turns_nowhere() {
        let coefficients = from_roots(&[decimal("0.3"); 3]);
        let found = crossings(&coefficients, Dd::ONE);
        assert_eq!(found.len(), 1);
        // Cube root of the rounding.
        assert!((found[0].time - decimal("0.3")).abs().hi < 1e-10);
        let turns = extrema(&coefficients, Dd::ONE);
        assert!(turns.len().is_multiple_of(2), "{turns:?}");
    }

    /// Roots at least `gap` apart: sorted cells of width `2 gap`, each with at most one root, in
    /// its first half.
    fn spread_roots(cells: usize, gap: f64) -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(proptest::option::of(0.05..1.0_f64), cells).prop_map(
            move |offsets| {
                let placed = offsets.iter().enumerate();
                placed
                    .filter_map(|(cell, offset)| {
                        offset.map(|offset| gap * (2.0 * cell as f64 + offset))
                    })
                    .collect()
            },
        )
    }

    proptest! {
        #![proptest_config(fixed_samples(128))]

        #[test]
        fn separated_roots_are_all_found_in_double_double(
            roots in spread_roots(10, 0.1),
            shift in 0.1..1.0_f64,
        ) {
            let exact: Vec<Dd> = roots.iter().map(|&root| Dd::from(root)).collect();
            // A factor without real roots, ((t - shift)^2 + shift^2), turns the product without
            // crossing zero.
            let offset = Dd::from(shift);
            let positive = [offset * offset * Dd::from(2.0), -offset - offset, Dd::ONE];
            let coefficients = times(&from_roots(&exact), &positive);
            let found = crossings(&coefficients, Dd::from(1.25));
            let expected: Vec<Dd> = exact.into_iter().filter(|root| root.hi < 1.25).collect();
            prop_assert_eq!(found.len(), expected.len());
            for (crossing, root) in found.iter().zip(&expected) {
                // 1e-31 over a slope of at least 0.1^9 times 1e-2.
                prop_assert!((crossing.time - *root).abs().hi < 1e-18);
            }
            for pair in found.windows(2) {
                prop_assert_ne!(pair[0].direction, pair[1].direction);
            }
        }

        #[test]
        fn close_pair_of_roots_is_found_in_doubles(
            centre in 0.1..0.9_f64,
            others in spread_roots(3, 0.3),
        ) {
            let half = centre * 0.5e-6;
            prop_assume!(others.iter().all(|root| (root - centre).abs() > 0.05));
            let pair = [Dd::from(centre - half), Dd::from(centre + half)];
            let mut all: Vec<Dd> = others.iter().map(|&root| Dd::from(root)).chain(pair).collect();
            let coefficients = rounded(&from_roots(&all));
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let found = crossings(&coefficients, 2.0);
            // NOTE: the depth of the pair, above 2.5e-15 * 0.05^3, may drown in the rounding of
            // the coefficients.
            let distances = others.iter().map(|root| (root - centre).abs());
            let depth = half * half * distances.product::<f64>();
            let sum = |sum: f64, value: &f64| sum * centre + value.abs();
            let terms = coefficients.iter().rev().fold(0.0, sum);
            prop_assume!(depth > 40.0 * f64::EPSILON * terms);
            prop_assert_eq!(found.len(), all.len());
            for (crossing, root) in found.iter().zip(&all) {
                prop_assert!((crossing.time - root.hi).abs() < 0.5 * half);
            }
        }

        #[test]
        fn tangencies_are_found_in_double_double(
            touch in 0.1..0.9_f64,
            others in spread_roots(4, 0.2),
        ) {
            prop_assume!(others.iter().all(|root| (root - touch).abs() > 0.02));
            let mut all: Vec<Dd> = others.iter().map(|&root| Dd::from(root)).collect();
            all.extend([Dd::from(touch); 2]);
            let roots = roots_on_interval(&from_roots(&all), Dd::from(1.7));
            // Rounding may split the double root into two, 1e-13 apart at most.
            prop_assert!(roots.iter().any(|root| (root.time.hi - touch).abs() < 1e-12));
            let apart = roots.iter().filter(|root| (root.time.hi - touch).abs() > 1e-3).count();
            prop_assert_eq!(apart, others.len());
        }
    }
}
