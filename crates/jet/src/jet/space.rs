//! The space of jets: variables, weights, truncation order and the product table.
//!
//! One idea: everything that depends only on *which monomials exist* is computed once and shared;
//! a jet is then a plain vector of coefficients.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::product::table::{Monomials, ProductTable, SmallSpace};

/// Error of an operation on jets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JetError {
    /// A weight of a variable is zero.
    #[error("variable {variable} has weight 0; weights are at least 1")]
    ZeroWeight {
        /// Number of the variable.
        variable: usize,
    },
    /// The order exceeds the largest exponent that can be stored.
    #[error("order {order} exceeds 255")]
    OrderTooHigh {
        /// Requested order.
        order: usize,
    },
    /// The space would not fit in memory.
    #[error(
        "{variables} variables at order {order} need {coefficients} coefficients and {products} \
            coefficient products; at most {limit} products are allowed"
    )]
    TooLarge {
        /// Number of variables.
        variables: usize,
        /// Weighted order.
        order: usize,
        /// Coefficients of one jet.
        coefficients: u128,
        /// Coefficient products in one product of two jets.
        products: u128,
        /// Largest number of products allowed.
        limit: u128,
    },
    /// A map without components.
    #[error("a map needs at least one component")]
    Empty,
    /// Jets of different spaces in one map.
    #[error("component {component} lies in another space than component 0")]
    SpaceMismatch {
        /// Number of the component.
        component: usize,
    },
    /// Numbers of components, variables or equations that do not match.
    #[error("expected {expected} components, found {found}")]
    DimensionMismatch {
        /// Required number.
        expected: usize,
        /// Given number.
        found: usize,
    },
    /// A component of a map to be inverted begins below its variable's weight.
    #[error(
        "component {component} has a term of degree {degree}; at least its weight {weight} is \
            needed"
    )]
    DegreeTooLow {
        /// Number of the component.
        component: usize,
        /// Lowest degree of the component.
        degree: usize,
        /// Weight of its variable.
        weight: u32,
    },
    /// A matrix of jets that is singular at the expansion point.
    #[error("singular at the expansion point: no pivot in column {column}")]
    Singular {
        /// Column without a pivot.
        column: usize,
    },
    /// Newton's method met a value that is not finite.
    #[error("a coefficient is not finite after Newton step {step}")]
    NotFinite {
        /// Number of the step, from 0.
        step: usize,
    },
    /// Newton's method did not settle.
    #[error("no convergence in {steps} Newton steps; the last relative change is {change:e}")]
    NoConvergence {
        /// Number of steps.
        steps: usize,
        /// Relative change in the last step.
        change: f64,
    },
}

/// Largest number of coefficient products of a space: at most 0.8 GB of product table, in which 8
/// bytes cover one product or several.
///
/// Five variables reach order 23, eight reach order 13, twelve reach order 9.
pub const MAX_PRODUCTS: u128 = 100_000_000;

/// Monomials in `n` variables up to a weighted degree, ordered by degree, with their product table.
///
/// The weighted degree of `x^e` is `Σ w_i e_i`; a space keeps every monomial of degree at most
/// [`order`](JetSpace::order). Monomials of one degree are neighbours, in descending lexicographic
/// order of their exponents; number 0 is the constant.
///
/// ```
/// use grazemap_jet::jet::JetSpace;
/// let space = JetSpace::new(&[1, 2], 3)?; // y has weight 1, x has weight 2
/// let monomials: Vec<_> = (0..space.len()).map(|m| space.exponents(m).to_vec()).collect();
/// assert_eq!(monomials, [[0, 0], [1, 0], [2, 0], [0, 1], [3, 0], [1, 1]]);
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
#[derive(Debug)]
pub struct JetSpace {
    weights: Vec<u32>,
    order: usize,
    exponents: Vec<u8>,
    degree_starts: Vec<usize>,
    table: OnceLock<ProductTable>,
    small: Option<SmallSpace>,
    products: usize,
    ranks: RankTable,
    parents: Vec<(u32, u32)>,
}

impl JetSpace {
    /// The space of jets in `weights.len()` variables with these weights, cut at a weighted degree.
    ///
    /// # Errors
    ///
    /// [`JetError::ZeroWeight`] if a weight is 0, [`JetError::OrderTooHigh`] above order 255, and
    /// [`JetError::TooLarge`], before anything is allocated, if the product table would have more
    /// than [`MAX_PRODUCTS`] entries.
    pub fn new(weights: &[u32], order: usize) -> Result<Arc<Self>, JetError> {
        let products = Self::check(weights, order)?;
        let (exponents, degree_starts) = list_monomials(weights, order);
        let ranks = RankTable::new(weights, order, &exponents);
        let parents = list_parents(weights.len(), &exponents, &ranks);
        Ok(Arc::new(Self {
            parents,
            weights: weights.to_vec(),
            order,
            exponents,
            degree_starts,
            table: OnceLock::new(),
            small: SmallSpace::of(weights, order),
            products,
            ranks,
        }))
    }

    /// Checks whether [`new`](Self::new) would build this space; returns its number of coefficient
    /// products.
    ///
    /// # Errors
    ///
    /// The errors of [`JetSpace::new`]; nothing is allocated.
    pub fn check(weights: &[u32], order: usize) -> Result<usize, JetError> {
        if let Some(variable) = weights.iter().position(|&weight| weight == 0) {
            return Err(JetError::ZeroWeight { variable });
        }
        if order > usize::from(u8::MAX) {
            return Err(JetError::OrderTooHigh { order });
        }
        let (coefficients, products) = Self::size(weights, order);
        if products > MAX_PRODUCTS {
            return Err(JetError::TooLarge {
                variables: weights.len(),
                order,
                coefficients,
                products,
                limit: MAX_PRODUCTS,
            });
        }
        Ok(products as usize)
    }

    /// Numbers of coefficients of a jet and of coefficient products of one product, without
    /// building the space.
    ///
    /// Saturates at [`u128::MAX`]. A weight of 0 counts as 1.
    pub fn size(weights: &[u32], order: usize) -> (u128, u128) {
        (count_monomials(weights, order, 1), count_monomials(weights, order, 2))
    }

    /// Number of monomials in variables of these weights up to a weighted degree, without listing
    /// them.
    ///
    /// ```
    /// use grazemap_jet::jet::JetSpace;
    /// assert_eq!(JetSpace::count(&[1, 2], 3), 6);
    /// ```
    pub fn count(weights: &[u32], order: u32) -> u128 {
        count_monomials(weights, order as usize, 1)
    }

    /// The space with all weights 1: ordinary total degree.
    ///
    /// # Errors
    ///
    /// The errors of [`JetSpace::new`].
    pub fn uniform(variables: usize, order: usize) -> Result<Arc<Self>, JetError> {
        Self::new(&vec![1; variables], order)
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.weights.len()
    }

    /// Weight of each variable.
    pub fn weights(&self) -> &[u32] {
        &self.weights
    }

    /// Highest weighted degree kept.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Number of monomials: the length of a jet.
    #[allow(clippy::len_without_is_empty, reason = "a space always has its constant")]
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// Whether two spaces keep the same monomials with the same weights.
    pub fn keeps_the_same(&self, other: &Self) -> bool {
        self.order == other.order && self.weights == other.weights
    }

    /// Number of coefficient products in one product of two full jets.
    pub fn products(&self) -> usize {
        self.products
    }

    /// Exponents of a monomial, one per variable.
    pub fn exponents(&self, monomial: usize) -> &[u8] {
        let variables = self.variables();
        &self.exponents[monomial * variables..(monomial + 1) * variables]
    }

    /// Weighted degree of a monomial.
    pub fn degree(&self, monomial: usize) -> usize {
        self.degree_starts.partition_point(|&start| start <= monomial) - 1
    }

    /// Numbers of the monomials of one weighted degree.
    pub fn degree_range(&self, degree: usize) -> Range<usize> {
        self.degree_starts[degree]..self.degree_starts[degree + 1]
    }

    /// Number of the monomial with these exponents, if the space keeps it.
    pub fn monomial(&self, exponents: &[u8]) -> Option<usize> {
        (exponents.len() == self.variables()).then(|| self.ranks.find(exponents)).flatten()
    }

    /// Number of the monomial `x_variable`, if the space keeps it.
    pub fn linear_monomial(&self, variable: usize) -> Option<usize> {
        let mut exponents = vec![0; self.variables()];
        *exponents.get_mut(variable)? = 1;
        self.monomial(&exponents)
    }

    /// The parent of a monomial in the tree of monomials: `(parent, variable)` with
    /// `monomial = parent · x_variable`, where `variable` is the last variable that occurs; the
    /// constant is its own parent.
    ///
    /// A parent has a smaller number than its children, so a pass by ascending number meets parents
    /// first.
    #[inline]
    pub fn parent(&self, monomial: usize) -> (usize, usize) {
        let (parent, variable) = self.parents[monomial];
        (parent as usize, variable as usize)
    }

    /// First monomial of a degree; the length of the space for a degree above the order.
    #[inline]
    pub(crate) fn degree_start(&self, degree: usize) -> usize {
        self.degree_starts[degree.min(self.order + 1)]
    }

    /// The pairs `(i, j)` with `monomial_i · monomial_j = monomial`, in the order in which a
    /// product of jets sums them: the first is `(0, monomial)`, the last `(monomial, 0)`.
    pub fn pairs(&self, monomial: usize) -> Vec<(usize, usize)> {
        self.table().pairs(monomial)
    }

    /// Kind of the space if its products need no table; `None` otherwise.
    #[inline(always)]
    pub(super) fn small(&self) -> Option<SmallSpace> {
        self.small
    }

    /// The product table, built for the first product: polynomials that are only evaluated need
    /// none.
    #[inline(always)]
    pub(super) fn table(&self) -> &ProductTable {
        self.table.get_or_init(|| {
            ProductTable::new(&Monomials {
                weights: &self.weights,
                exponents: &self.exponents,
                degree_starts: &self.degree_starts,
                ranks: &self.ranks,
            })
        })
    }
}

/// Set of variables of a jet: bit `min(i, 63)` for variable `i`.
pub type VariableSet = u64;

/// The runs that given variables can reach.
#[derive(Clone, Copy, Debug)]
pub struct Selection<'a> {
    /// Variables of every monomial of the space.
    pub monomials: &'a [VariableSet],
    /// Set of the variables that may occur.
    pub variables: VariableSet,
}

impl Selection<'_> {
    /// Whether a run has a monomial of these variables only. The first and last monomials of a run
    /// are powers of one of its two variables, so that testing these two is enough.
    #[inline(always)]
    pub fn reaches(&self, run: &Range<usize>) -> bool {
        let present = |monomial: usize| self.monomials[monomial] & !self.variables == 0;
        present(run.start) || present(run.end - 1)
    }
}

/// Variables of every monomial of a space.
pub fn variables_of_monomials(space: &JetSpace) -> Vec<VariableSet> {
    let set = |monomial| variables_of_monomial(space, monomial);
    (0..space.len()).map(set).collect()
}

/// Variables of a monomial.
pub fn variables_of_monomial(space: &JetSpace, monomial: usize) -> VariableSet {
    let bit = |(variable, &exponent): (usize, &u8)| u64::from(exponent > 0) << variable.min(63);
    let bits = space.exponents(monomial).iter().enumerate().map(bit);
    bits.fold(0, |a, b| a | b)
}

/// Number of exponent vectors of `copies` jets whose degrees sum to at most `order`.
fn count_monomials(weights: &[u32], order: usize, copies: usize) -> u128 {
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
    counts.iter().fold(0, |sum, &count| sum.saturating_add(count))
}

/// All exponents by ascending degree, flattened, and the first monomial of each degree.
fn list_monomials(weights: &[u32], order: usize) -> (Vec<u8>, Vec<usize>) {
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
        push_degree(weights, remaining - exponent * weight, variable + 1, current, out, count);
    }
    current[variable] = 0;
}

/// Parent of every monomial, and the variable between them.
fn list_parents(variables: usize, exponents: &[u8], ranks: &RankTable) -> Vec<(u32, u32)> {
    let mut parents = vec![(0, 0)];
    let mut divisor = vec![0u8; variables];
    for monomial in exponents.chunks_exact(variables.max(1)).skip(1) {
        divisor.copy_from_slice(monomial);
        let last = monomial
            .iter()
            .rposition(|&exponent| exponent > 0)
            .expect("only the constant has no factor");
        divisor[last] -= 1;
        let parent = ranks.find(&divisor).expect("a divisor of a kept monomial is kept");
        parents.push((parent as u32, last as u32));
    }
    parents
}

/// Moves to the next exponent vector below `bound`; returns `false` after the last.
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

/// Lookup from exponents to the number of the monomial.
#[derive(Debug)]
pub(super) enum RankTable {
    /// Mixed-radix table, for small spaces.
    Dense { radices: Vec<usize>, ranks: Vec<u32> },
    /// Hash table, for the others.
    Sparse(std::collections::HashMap<Box<[u8]>, u32>),
}

/// Largest dense rank table, in entries.
const DENSE_RANKS: usize = 1 << 20;

impl RankTable {
    pub(super) fn new(weights: &[u32], order: usize, exponents: &[u8]) -> Self {
        let radices: Vec<usize> =
            weights.iter().map(|&weight| order / weight as usize + 1).collect();
        let size = radices.iter().try_fold(1usize, |product, &radix| product.checked_mul(radix));
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
    radices.iter().zip(exponents).try_fold(0, |index, (&radix, &exponent)| {
        (usize::from(exponent) < radix).then(|| index * radix + usize::from(exponent))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_binomial_formula() {
        let space = JetSpace::uniform(5, 6).unwrap();
        assert_eq!(space.len(), 462); // C(11, 5)
        assert_eq!(space.products(), 8008); // C(16, 10)
    }

    #[test]
    fn pairs_begin_and_end_with_the_constant() {
        let space = JetSpace::new(&[1, 2, 2], 6).unwrap();
        for monomial in 0..space.len() {
            let pairs = space.pairs(monomial);
            assert_eq!(pairs[0], (0, monomial));
            assert_eq!(pairs[pairs.len() - 1], (monomial, 0));
        }
    }

    #[test]
    fn too_large_a_space_is_refused_before_allocating() {
        let error = JetSpace::uniform(12, 40).unwrap_err();
        assert!(matches!(error, JetError::TooLarge { .. }), "{error}");
    }
}
