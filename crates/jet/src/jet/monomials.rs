//! Which monomials a space keeps: counted, listed, numbered, multiplied.

/// Number of exponent vectors of `copies` jets whose degrees sum to at most `order`.
pub(super) fn count_monomials(weights: &[u32], order: usize, copies: usize) -> u128 {
    let mut counts = vec![0u128; order + 1];
    counts[0] = 1;
    for _ in 0..copies {
        for &weight in weights {
            let weight = weight.max(1) as usize;
            for degree in weight..=order {
                counts[degree] = counts[degree].saturating_add(counts[degree - weight]);
            }
        }
    }
    counts
        .iter()
        .fold(0, |sum, &count| sum.saturating_add(count))
}

/// All exponents by ascending degree, flattened, and the first monomial of each degree.
pub(super) fn list_monomials(weights: &[u32], order: usize) -> (Vec<u8>, Vec<usize>) {
    let mut exponents = Vec::new();
    let mut starts = Vec::with_capacity(order + 2);
    let mut current = vec![0u8; weights.len()];
    let mut count = 0;
    for degree in 0..=order {
        starts.push(count);
        push_degree(weights, degree, 0, &mut current, &mut exponents, &mut count);
    }
    starts.push(count);
    (exponents, starts)
}

/// Appends the exponents with the given remaining degree in the variables from `variable` on.
fn push_degree(
    weights: &[u32],
    remaining: usize,
    variable: usize,
    current: &mut [u8],
    out: &mut Vec<u8>,
    count: &mut usize,
) {
    if variable == weights.len() {
        if remaining == 0 {
            out.extend_from_slice(current);
            *count += 1;
        }
        return;
    }
    let weight = weights[variable] as usize;
    for exponent in (0..=remaining / weight).rev() {
        current[variable] = exponent as u8;
        push_degree(
            weights,
            remaining - exponent * weight,
            variable + 1,
            current,
            out,
            count,
        );
    }
    current[variable] = 0;
}

/// For every monomial, its parent and the variable between them.
pub(super) fn list_parents(
    variables: usize,
    exponents: &[u8],
    ranks: &RankTable,
) -> Vec<(u32, u32)> {
    let mut parents = vec![(0, 0)];
    let mut divisor = vec![0u8; variables];
    for monomial in exponents.chunks_exact(variables.max(1)).skip(1) {
        divisor.copy_from_slice(monomial);
        let last = monomial
            .iter()
            .rposition(|&exponent| exponent > 0)
            .expect("only the constant has no factor");
        divisor[last] -= 1;
        let parent = ranks
            .find(&divisor)
            .expect("a divisor of a kept monomial is kept");
        parents.push((parent as u32, last as u32));
    }
    parents
}

/// Steps to the next exponent vector below `bound`; `false` after the last.
pub(super) fn next_divisor(current: &mut [u8], bound: &[u8]) -> bool {
    for (exponent, &limit) in current.iter_mut().zip(bound) {
        if *exponent < limit {
            *exponent += 1;
            return true;
        }
        *exponent = 0;
    }
    false
}

/// From exponents to the monomial's number.
#[derive(Debug)]
pub(super) enum RankTable {
    /// Mixed-radix table, where it is small.
    Dense {
        radices: Vec<usize>,
        ranks: Vec<u32>,
    },
    /// Hash table otherwise.
    Sparse(std::collections::HashMap<Box<[u8]>, u32>),
}

/// Largest dense rank table, in entries.
const DENSE_RANKS: usize = 1 << 20;

impl RankTable {
    pub(super) fn new(weights: &[u32], order: usize, exponents: &[u8]) -> Self {
        let radices: Vec<usize> = weights
            .iter()
            .map(|&weight| order / weight as usize + 1)
            .collect();
        let size = radices
            .iter()
            .try_fold(1usize, |product, &radix| product.checked_mul(radix));
        let monomials = exponents.chunks_exact(weights.len().max(1));
        match size {
            Some(size) if size <= DENSE_RANKS => {
                let mut ranks = vec![u32::MAX; size];
                ranks[0] = 0;
                for (number, monomial) in monomials.enumerate() {
                    ranks[dense_index(&radices, monomial).expect("a kept monomial is in range")] =
                        number as u32;
                }
                Self::Dense { radices, ranks }
            }
            _ => Self::Sparse(
                monomials
                    .enumerate()
                    .map(|(number, monomial)| (monomial.into(), number as u32))
                    .collect(),
            ),
        }
    }

    pub(super) fn find(&self, exponents: &[u8]) -> Option<usize> {
        match self {
            Self::Dense { radices, ranks } => {
                let rank = ranks[dense_index(radices, exponents)?];
                (rank != u32::MAX).then_some(rank as usize)
            }
            Self::Sparse(ranks) => ranks.get(exponents).map(|&rank| rank as usize),
        }
    }
}

/// Position in the mixed-radix table; `None` if an exponent exceeds its radix.
fn dense_index(radices: &[usize], exponents: &[u8]) -> Option<usize> {
    radices
        .iter()
        .zip(exponents)
        .try_fold(0, |index, (&radix, &exponent)| {
            (usize::from(exponent) < radix).then(|| index * radix + usize::from(exponent))
        })
}
