//! Products against sums over exponents, in exact integers; lanes against single numbers, bit for
//! bit.

use std::sync::Arc;

use grazemap::jet::{Jet, JetSpace};
use grazemap::numeric::{Lanes, Scalar};

/// Spaces with short and long runs of neighbours, and with runs of one monomial.
fn spaces() -> Vec<Arc<JetSpace>> {
    let space = |weights: &[u32], order| JetSpace::new(weights, order).expect("a small space");
    vec![
        space(&[1; 4], 5),
        space(&[1; 2], 14),
        space(&[1, 2, 2], 9),
        space(&[2, 3], 12),
        space(&[3], 9),
        space(&[], 2),
    ]
}

/// Integers below ten, of either sign.
fn integers(space: &Arc<JetSpace>, seed: usize) -> Jet<f64> {
    let value = |m: usize| ((m * m + 7 * seed * m + seed) % 19) as f64 - 9.0;
    Jet::from_coefficients(space, (0..space.len()).map(value).collect())
}

/// The product by its definition.
fn product_by_exponents(a: &Jet<f64>, b: &Jet<f64>) -> Vec<f64> {
    let space = a.space();
    let mut product = vec![0.0; space.len()];
    for (left, x) in a.terms() {
        for (right, y) in b.terms() {
            let sum: Vec<u8> = left.iter().zip(right).map(|(i, j)| i + j).collect();
            if let Some(monomial) = space.monomial(&sum) {
                product[monomial] += x * y;
            }
        }
    }
    product
}

#[test]
fn products_and_squares_of_integers_are_exact_in_every_space() {
    for space in spaces() {
        let (a, b) = (integers(&space, 1), integers(&space, 2));
        assert_eq!((&a * &b).coefficients(), product_by_exponents(&a, &b));
        assert_eq!((&a * &a).coefficients(), product_by_exponents(&a, &a));
        let mut sum = b.clone();
        a.multiply_add_into(&a, &mut sum);
        assert_eq!(sum.coefficients(), (&b + &(&a * &a)).coefficients());
    }
}

#[test]
fn lanes_have_the_bits_of_single_numbers() {
    for space in spaces() {
        let single = |lane: usize, seed: f64| {
            let value = |m: usize| ((m + 11 * lane) as f64 * seed).sin() + 0.1;
            let mut jet = Jet::from_coefficients(&space, (0..space.len()).map(value).collect());
            jet.coefficients_mut()[0] = 1.0 + seed + lane as f64;
            jet
        };
        let lanes = |seed: f64| {
            let jets: [Jet<f64>; 8] = std::array::from_fn(|lane| single(lane, seed));
            let value = |m: usize| Lanes::from_fn(|lane| jets[lane].coefficients()[m]);
            Jet::from_coefficients(&space, (0..space.len()).map(value).collect())
        };
        assert_same_bits(&formulas(&lanes(0.37), &lanes(0.61)), |lane| {
            formulas(&single(lane, 0.37), &single(lane, 0.61))
        });
    }
}

/// Products, quotients, roots and functions without calls of the platform.
fn formulas<S: Scalar>(a: &Jet<S>, b: &Jet<S>) -> Vec<Jet<S>> {
    vec![a * b, a * a, a / b, a.sqrt(), (a * a).power_integer(3)]
}

fn assert_same_bits(lanes: &[Jet<Lanes<8>>], single: impl Fn(usize) -> Vec<Jet<f64>>) {
    for lane in 0..8 {
        for (formula, (lanes, single)) in lanes.iter().zip(single(lane)).enumerate() {
            for (a, b) in lanes.coefficients().iter().zip(single.coefficients()) {
                assert_eq!(a[lane].to_bits(), b.to_bits(), "formula {formula}");
            }
        }
    }
}
