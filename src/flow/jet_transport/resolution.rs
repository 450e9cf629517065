//! How well an element resolves its jets.

/// An estimate of the error of an element: the product of two tails of Legendre modes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Last modes of the fundamental matrix, relative to its entries.
    fundamental: f64,
    /// Estimated error at the end, over the largest coefficient of the same degree: the worst degree.
    pub(super) error: f64,
    /// Largest last Legendre mode over the largest coefficient of the same degree.
    tail: f64,
}

/// Largest last Legendre mode for which the error estimate, a product of two of them, is believed.
const RESOLVED: f64 = 1e-4;

impl Resolution {
    /// That of the fundamental matrix alone.
    pub(super) fn new(fundamental: f64) -> Self {
        Self {
            fundamental,
            error: 0.0,
            tail: fundamental,
        }
    }

    /// Includes a degree with these last modes.
    pub(super) fn include(&mut self, tail: f64) {
        self.tail = self.tail.max(tail);
        self.error = self.error.max(tail * self.fundamental.max(f64::EPSILON));
    }

    /// Whether the estimate is below a tolerance and believed.
    pub(super) fn meets(self, tolerance: f64) -> bool {
        self.error <= tolerance && self.tail <= RESOLVED
    }
}
