//! Jets at work: exact products, the recurrences in three rings, identities, maps.

mod coefficients;
mod ends_of_range;
mod identities;
mod maps;
mod products;
mod rings;

use grazemap::jet::{Jet, JetError, JetSpace};
use grazemap::numeric::{Dd, Real};

fn binomial(n: u128, k: u128) -> u128 {
    (0..k).fold(1, |product, i| product * (n - i) / (i + 1))
}

/// Coefficient of a monomial in `(1 + x_1 + … + x_v)^power`, in integers.
fn multinomial(power: u128, exponents: &[u8]) -> u128 {
    let mut rest = power;
    exponents.iter().fold(1, |product, &exponent| {
        if u128::from(exponent) > rest {
            return 0;
        }
        rest -= u128::from(exponent);
        product * binomial(rest + u128::from(exponent), u128::from(exponent))
    })
}

/// Fateman's product `s^n (s^n + 1)` with `s = 1 + x_1 + … + x_v`: every coefficient, exactly.
fn fateman<S: Real>(variables: usize, power: u128) {
    let space = JetSpace::uniform(variables, 2 * power as usize).expect("a small space");
    let mut sum = Jet::constant(&space, S::one());
    (0..variables).for_each(|variable| sum += &Jet::variable(&space, variable, S::zero()));
    let factor = sum.power_integer(power as i32);
    let product = &factor * &factor.add_constant(S::one());
    for (exponents, value) in product.terms() {
        let exact = multinomial(2 * power, exponents) + multinomial(power, exponents);
        let value = value.to_dd();
        assert_eq!(value.hi as i128 + value.lo as i128, exact as i128, "{exponents:?}");
    }
}

#[test]
fn fateman_product_in_four_variables_is_exact_in_doubles() {
    fateman::<f64>(4, 6);
}

#[test]
fn fateman_product_of_degree_forty_is_exact_in_double_doubles() {
    fateman::<Dd>(2, 20); // NOTE: the largest coefficient, 4e17, exceeds 2^53.
}

#[test]
fn number_of_products_is_known_without_listing_them() {
    for (weights, order) in
        [(vec![1, 1, 1], 6), (vec![1, 2, 2], 9), (vec![3, 1, 2, 5], 11), (vec![7], 5), (vec![], 4)]
    {
        let counted = JetSpace::size(&weights, order);
        let space = JetSpace::new(&weights, order).unwrap();
        assert_eq!(
            counted,
            (space.len() as u128, space.products() as u128),
            "{weights:?} at order {order}"
        );
    }
}

#[test]
fn a_space_beyond_memory_is_refused_with_its_numbers() {
    let error = JetSpace::uniform(8, 20).unwrap_err();
    let expected = (binomial(28, 8), binomial(36, 16));
    match error {
        JetError::TooLarge { coefficients, products, .. } => {
            assert_eq!((coefficients, products), expected)
        }
        other => panic!("{other}"),
    }
}

#[test]
fn the_pairs_of_a_weighted_space_are_all_products_of_two_monomials() {
    let space = JetSpace::new(&[1, 2, 3], 8).unwrap();
    let mut pairs = 0;
    for i in 0..space.len() {
        for j in 0..space.len() {
            let sum: Vec<u8> =
                space.exponents(i).iter().zip(space.exponents(j)).map(|(a, b)| a + b).collect();
            if let Some(monomial) = space.monomial(&sum) {
                assert!(space.pairs(monomial).contains(&(i, j)));
                pairs += 1;
            }
        }
    }
    assert_eq!(pairs, space.products());
}
