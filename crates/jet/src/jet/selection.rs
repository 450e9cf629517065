//! Which runs of a space can differ from zero: those with a monomial of some variables only.

use std::ops::Range;

use super::JetSpace;

/// Set of variables of a jet: bit `min(i, 63)` for variable `i`.
pub type VariableSet = u64;

/// The runs that some variables can reach.
#[derive(Clone, Copy, Debug)]
pub struct Selection<'a> {
    /// Variables of every monomial of the space.
    pub monomials: &'a [VariableSet],
    /// Those that may occur.
    pub variables: VariableSet,
}

impl Selection<'_> {
    /// Whether a run has a monomial of these variables only: its first and last are powers of one
    /// of its two.
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
