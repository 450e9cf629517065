//! Double-double numbers.

/// An unevaluated sum `hi + lo` of two doubles: about 32 decimal digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dd {
    /// Leading part: the sum rounded to `f64`.
    pub hi: f64,
    /// Trailing part, at most half a unit in the last place of `hi`.
    pub lo: f64,
}
