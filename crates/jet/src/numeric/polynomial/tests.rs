//! Polynomials built from known roots, multiplied out in double-double.

use super::*;
use crate::numeric::Dd;
use crate::numeric::sampling::fixed_samples;
use proptest::prelude::*;

/// Ascending coefficients of `product (t - root)`.
fn from_roots(roots: &[Dd]) -> Vec<Dd> {
    roots.iter().fold(vec![Dd::ONE], |product, &root| {
        times(&product, &[-root, Dd::ONE])
    })
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
    // The first term left out is 3.2^44 / 44! = 1e-32 of the value.
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
    let shallow = [
        centre * centre - decimal("1e-28"),
        -centre - centre,
        Dd::ONE,
    ];
    let coefficients = times(&shallow, &from_roots(&[Dd::from(-1.0), Dd::from(-2.5)]));
    let found = crossings(&coefficients, Dd::ONE);
    assert_eq!(found.len(), 2);
    // A rounding of 1e-31 over the slope 2e-14 at the roots, with a factor 100 for the conditioning
    // of the product.
    assert!((found[0].time - centre + decimal("1e-14")).abs().hi < 1e-15);
    assert!((found[1].time - centre - decimal("1e-14")).abs().hi < 1e-15);
    assert_eq!(found[0].direction, CrossingDirection::Entering);
    assert_eq!(found[1].direction, CrossingDirection::Leaving);
}

#[test]
fn two_crossings_of_a_shallow_minimum_are_told_apart_in_doubles() {
    let centre = decimal("0.3");
    let shallow = [
        centre * centre - decimal("1e-14"),
        -centre - centre,
        Dd::ONE,
    ];
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
    assert_eq!(
        (at_end[0].time, at_end[0].direction),
        (1.0, CrossingDirection::Entering)
    );
    assert!(crossings(&[0.0, -1.0], 1.0).is_empty());
    assert_eq!(
        roots_on_interval(&[0.0, -1.0], 1.0)[0].kind,
        RootKind::Start
    );
    assert_eq!(extrema(&[0.0, -2.0, 1.0], 1.0)[0].time, 1.0);
    assert!(extrema(&[0.0, 0.0, 1.0], 1.0).is_empty());
}

#[test]
fn backward_interval_is_searched_in_its_own_direction() {
    let found = crossings(&[1.0, 2.0], -1.0);
    assert_eq!(
        (found[0].time, found[0].direction),
        (-0.5, CrossingDirection::Entering)
    );
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

/// The event function of a closely observed rest: an inflection with a level tangent.
#[test]
fn level_inflection_is_crossed_once_and_turns_nowhere() {
    let coefficients = from_roots(&[decimal("0.3"); 3]);
    let found = crossings(&coefficients, Dd::ONE);
    assert_eq!(found.len(), 1);
    // The cube root of the rounding.
    assert!((found[0].time - decimal("0.3")).abs().hi < 1e-10);
    let turns = extrema(&coefficients, Dd::ONE);
    assert!(turns.len().is_multiple_of(2), "{turns:?}");
}

/// Roots at least `gap` apart: sorted cells of width `2 gap`, each holding a root at most in its
/// first half.
fn spread_roots(cells: usize, gap: f64) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(proptest::option::of(0.05..1.0_f64), cells).prop_map(move |offsets| {
        let placed = offsets.iter().enumerate();
        placed
            .filter_map(|(cell, offset)| offset.map(|offset| gap * (2.0 * cell as f64 + offset)))
            .collect()
    })
}

proptest! {
    #![proptest_config(fixed_samples(128))]

    #[test]
    fn separated_roots_are_all_found_in_double_double(roots in spread_roots(10, 0.1), shift in 0.1..1.0_f64) {
        let exact: Vec<Dd> = roots.iter().map(|&root| Dd::from(root)).collect();
        // A factor without real roots, ((t - shift)^2 + shift^2), turns the product without crossing zero.
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
    fn close_pair_of_roots_is_found_in_doubles(centre in 0.1..0.9_f64, others in spread_roots(3, 0.3)) {
        let half = centre * 0.5e-6;
        prop_assume!(others.iter().all(|root| (root - centre).abs() > 0.05));
        let pair = [Dd::from(centre - half), Dd::from(centre + half)];
        let mut all: Vec<Dd> = others.iter().map(|&root| Dd::from(root)).chain(pair).collect();
        let coefficients = rounded(&from_roots(&all));
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let found = crossings(&coefficients, 2.0);
        // NOTE: the depth of the pair, above 2.5e-15 * 0.05^3, may drown in the rounding of the coefficients.
        let depth = half * half * others.iter().map(|root| (root - centre).abs()).product::<f64>();
        let terms: f64 = coefficients.iter().rev().fold(0.0, |sum, value| sum * centre + value.abs());
        prop_assume!(depth > 40.0 * f64::EPSILON * terms);
        prop_assert_eq!(found.len(), all.len());
        for (crossing, root) in found.iter().zip(&all) {
            prop_assert!((crossing.time - root.hi).abs() < 0.5 * half);
        }
    }

    #[test]
    fn tangencies_are_found_in_double_double(touch in 0.1..0.9_f64, others in spread_roots(4, 0.2)) {
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
