//! How well an element resolves its jets.

use super::gauss::Functionals;

/// Largest Legendre modes of some functions over their size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tail {
    /// Those of degree 10 and 11.
    before: f64,
    /// Those of degree 14 and 15, the last that the nodes tell apart.
    last: f64,
}

impl Tail {
    /// That of no function.
    pub(super) const NONE: Self = Self { before: 0.0, last: 0.0 };

    /// That of functions of a size.
    #[inline(always)]
    pub(super) fn new(functionals: Functionals, size: f64) -> Self {
        let largest = |first: usize| {
            let [a, b] = [functionals.0[first].abs(), functionals.0[first + 1].abs()];
            a.max(b) / size.max(f64::MIN_POSITIVE)
        };
        Self { before: largest(2), last: largest(4) }
    }

    /// The larger of both.
    #[inline(always)]
    pub(super) fn larger(self, other: Self) -> Self {
        Self { before: self.before.max(other.before), last: self.last.max(other.last) }
    }

    /// What the first modes that the nodes do not tell apart are expected to be: they fall on as
    /// those before.
    fn next(self) -> f64 {
        self.last * (self.last / self.before).sqrt().min(1.0)
    }
}

/// An estimate of the error of an element: the product of two tails of Legendre modes. See
/// docs/mathematics/flow.md.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Next modes of the fundamental matrix, relative to its entries.
    fundamental: f64,
    /// Estimated error at the end, over the largest coefficient of the same degree: the worst
    /// degree.
    pub(super) error: f64,
    /// Largest last Legendre mode over the largest coefficient of the same degree.
    tail: f64,
}

/// Largest last Legendre mode for which the error estimate, a product of two of them, is believed.
const RESOLVED: f64 = 1e-4;

/// Share of a product of two modes in the error: one over its norm, 33, times the neighbours that
/// count as much.
const SHARE: f64 = 0.25;

impl Resolution {
    /// That of the fundamental matrix alone.
    pub(super) fn new(fundamental: Tail) -> Self {
        Self {
            fundamental: fundamental.next().max(f64::EPSILON),
            error: 0.0,
            tail: fundamental.last,
        }
    }

    /// Includes a degree with these modes, whose monomials have up to some factors, each of the
    /// flow or of the defect.
    pub(super) fn include(&mut self, factors: usize, tail: Tail) {
        let ways = 2.0_f64.powi(factors as i32);
        self.tail = self.tail.max(tail.last);
        self.error = self.error.max(SHARE * ways * tail.next() * self.fundamental);
    }

    /// Whether the estimate is below a tolerance and believed.
    pub(super) fn meets(self, tolerance: f64) -> bool {
        self.error <= tolerance && self.tail <= RESOLVED
    }
}
