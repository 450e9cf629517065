//! Products of series, four degrees at a time.
//!
//! One idea: a series in `t` is a series in `t⁴` whose coefficients are polynomials of four terms,
//! its *blocks*. With `a_q b_r = low + t⁴ high`, block `m` of a product is
//!
//! ```text
//! (ab)_m = Σ_{q+r=m} low(a_q, b_r) + Σ_{q+r=m−1} high(a_q, b_r).
//! ```
//!
//! Once all blocks before `m` are known, only `low(a_0, b_m) + low(a_m, b_0)` is left to be added
//! degree by degree: the rest is done at once for four degrees, in loops of fixed length (relaxed
//! multiplication: van der Hoeven 2002). Sums have one order, whatever the registers: in 16 chains
//! over the blocks, then the chains.

use crate::numeric::Scalar;

/// Degrees in a block.
pub(super) const BLOCK: usize = 4;

/// Four neighbouring coefficients.
pub(super) type Block<S> = [S; BLOCK];

/// What the blocks before the present one, `a` and `b` (equally many, at least one), add to the
/// present block of the product.
#[inline(always)]
pub(super) fn earlier_product<S: Scalar>(a: &[Block<S>], b: &[Block<S>]) -> Block<S> {
    let last = a.len() - 1;
    let mut sum = high([S::zero(); BLOCK], &a[0], &b[last]);
    add(&mut sum, both(&a[1..], b));
    sum
}

/// The same for the square of `a`, each pair of factors once.
#[inline(always)]
pub(super) fn earlier_square<S: Scalar>(a: &[Block<S>]) -> Block<S> {
    let (last, middle) = (a.len() - 1, a.len() / 2);
    let zero = [S::zero(); BLOCK];
    if last == 0 {
        return high(zero, &a[0], &a[0]);
    }
    let mut sum = high(zero, &a[0], &a[last]);
    add(&mut sum, both(&a[1..middle], a));
    let alone = if a.len().is_multiple_of(2) {
        low(zero, &a[middle], &a[middle])
    } else {
        sum = low(sum, &a[middle], &a[middle + 1]);
        high(zero, &a[middle], &a[middle])
    };
    let twice = sum;
    add(&mut sum, twice);
    add(&mut sum, alone);
    sum
}

/// `Σ_q low(a_q, b_{n−q}) + high(a_q, b_{n−1−q})` over the blocks of `a`, the first of which goes
/// with the last two of the `b`.
#[inline(always)]
fn both<S: Scalar>(a: &[Block<S>], b: &[Block<S>]) -> Block<S> {
    let mut chains = [[S::zero(); BLOCK]; BLOCK];
    for (a, pair) in a.iter().zip(b.windows(2).rev()) {
        if let Ok(pair) = <&[S; 2 * BLOCK]>::try_from(pair.as_flattened()) {
            for (degree, chain) in chains.iter_mut().enumerate() {
                for (offset, sum) in chain.iter_mut().enumerate() {
                    *sum = a[degree].mul_add(pair[BLOCK - degree + offset], *sum);
                }
            }
        }
    }
    let [mut sum, second, mut third, fourth] = chains;
    add(&mut sum, second);
    add(&mut third, fourth);
    add(&mut sum, third);
    sum
}

#[inline(always)]
fn add<S: Scalar>(sum: &mut Block<S>, other: Block<S>) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += other;
    }
}

/// `sum + low(a, b)`: `Σ_{j ≤ i} a_j b_{i−j}`.
#[inline(always)]
fn low<S: Scalar>(mut sum: Block<S>, a: &Block<S>, b: &Block<S>) -> Block<S> {
    for (i, sum) in sum.iter_mut().enumerate() {
        for j in 0..=i {
            *sum = a[j].mul_add(b[i - j], *sum);
        }
    }
    sum
}

/// `sum + high(a, b)`: `Σ_{j > i} a_j b_{4+i−j}`.
#[inline(always)]
fn high<S: Scalar>(mut sum: Block<S>, a: &Block<S>, b: &Block<S>) -> Block<S> {
    for (i, sum) in sum.iter_mut().enumerate() {
        for j in i + 1..BLOCK {
            *sum = a[j].mul_add(b[BLOCK + i - j], *sum);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Σ_j a_j b_{k−j}` over the terms whose factors both lie before degree `known`.
    fn terms_before(a: &[f64], b: &[f64], k: usize, known: usize) -> f64 {
        let both_known = |&j: &usize| j < known && k - j < known;
        (0..=k).filter(both_known).map(|j| a[j] * b[k - j]).sum()
    }

    #[test]
    fn earlier_parts_of_products_and_squares_are_exact_on_integers() {
        let series = |factor: u32| -> Vec<Block<f64>> {
            let coefficient = |k: u32| f64::from((k * factor + 3) % 17) - 8.0;
            (0..8).map(|block| std::array::from_fn(|i| coefficient(4 * block + i as u32))).collect()
        };
        let (a, b) = (series(5), series(11));
        for block in 1..8 {
            let product = earlier_product(&a[..block], &b[..block]);
            let square = earlier_square(&a[..block]);
            for i in 0..BLOCK {
                let (k, known) = (BLOCK * block + i, BLOCK * block);
                let (a, b) = (a.as_flattened(), b.as_flattened());
                assert_eq!(product[i], terms_before(a, b, k, known), "{block} {i}");
                assert_eq!(square[i], terms_before(a, a, k, known), "{block} {i}");
            }
        }
    }
}
