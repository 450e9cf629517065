//! What a truncated `D` can be expected to give at the edge of its window.
//!
//! One idea: along the depth alone the correction is a known series in `y`, and what weight `W`
//! leaves out of it at the largest depth of the window is the rest of that series, before anything
//! is compared with direct simulation.

use super::{DepthSeries, ExpansionError};
use crate::numeric::{Scalar, last_that_holds};

/// Halvings of the bracket of the usable depth variable: all bits of a double.
const HALVINGS: usize = 60;

/// What a discontinuity mapping of some weight leaves out at the largest depth of a window.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WindowEdge {
    /// Largest `y²` of the window.
    pub depth: f64,
    /// Estimated radius of convergence in `y`; see [`DepthSeries::radius`].
    pub radius: f64,
    /// Truncation weight of the contact.
    pub contact_weight: u32,
    /// Lowest power of `y` in a correction.
    pub leading_exponent: u32,
    /// Share of the correction that the truncation leaves out at the edge, at most:
    /// `Σ_{k>W} |c_k| y^k / |c_n| y^n`, the powers beyond those known estimated from the radius; 1
    /// where the correction begins above the weight.
    pub omitted_share: f64,
    /// The depth at which the share is [`LARGEST_SHARE`](Self::LARGEST_SHARE), within the radius;
    /// 0 where the correction begins above the weight.
    pub usable_depth: f64,
}

impl WindowEdge {
    /// The share above which a window is said to be too deep: fewer than two digits of the
    /// contact's correction.
    pub const LARGEST_SHARE: f64 = 1e-2;

    /// The edge of a window that reaches to a depth `y²`, for a truncation weight below the order
    /// of the series.
    ///
    /// The corrections asked are those that begin with the lowest power. `None` where all of them
    /// vanish or their series end, and there is nothing to leave out. A weight that is not
    /// below the order of the series is taken as the highest one that is.
    ///
    /// ```
    /// use grazemap::expansion::{DepthSeries, WindowEdge};
    /// use grazemap::numeric::Dd;
    ///
    /// // y + (4y)² + (4y)³ + …: radius 1/4, and Σ_{k>4} (4y)^k / y = 0.4^5 / 0.6 / 0.1 at y = 0.1.
    /// let coefficients = (0..=24).map(|k| match k {
    ///     0 | 1 => Dd::from(f64::from(k)),
    ///     _ => Dd::from(4f64.powi(k)),
    /// });
    /// let series = DepthSeries { coefficients: vec![coefficients.collect()] };
    /// let edge = WindowEdge::new(&series, 0.01, 4).expect("an infinite series");
    /// assert!((edge.omitted_share - 0.4_f64.powi(5) / 0.06).abs() < 1e-6 && !edge.is_within());
    /// ```
    pub fn new(series: &DepthSeries, depth: f64, contact_weight: u32) -> Option<Self> {
        let radius = series.radius()?;
        let laws = (0..series.coefficients.len()).map(|coordinate| series.leading_law(coordinate));
        let leading_exponent = laws.flatten().map(|law| law.exponent).min()?;
        let (omitted_share, usable_depth) = if contact_weight < leading_exponent {
            (1.0, 0.0)
        } else {
            let share = |y: f64| omitted_share(series, leading_exponent, contact_weight, y, radius);
            let usable = largest_within(radius, |y| share(y) <= Self::LARGEST_SHARE);
            (share(depth.sqrt()), usable * usable)
        };
        Some(Self {
            depth,
            radius,
            contact_weight,
            leading_exponent,
            omitted_share,
            usable_depth,
        })
    }

    /// Whether the window lies within the radius and the truncation leaves out no more than
    /// [`LARGEST_SHARE`](Self::LARGEST_SHARE).
    pub fn is_within(&self) -> bool {
        self.omitted_share <= Self::LARGEST_SHARE && self.depth < self.radius * self.radius
    }
}

/// `Σ_{k>W} |c_k| y^k / |c_n| y^n`, the largest over the corrections that begin with `y^n`, with
/// the [tail](tail_factor) beyond the powers known.
fn omitted_share(series: &DepthSeries, leading: u32, weight: u32, y: f64, radius: f64) -> f64 {
    let leading = leading as usize;
    let of = |coefficients: &Vec<_>| {
        let size = |k: usize| Scalar::magnitude(coefficients[k]);
        let order = coefficients.len() - 1;
        let first = (weight as usize + 1).min(order);
        let rest = (first..=order).map(|k| size(k) * y.powi((k - leading) as i32));
        let last = order.saturating_sub(ENVELOPE).max(leading)..=order;
        let envelope =
            last.map(|k| size(k) * y.powi((k - leading) as i32) * share_of(y, radius, order - k));
        let tail = envelope.fold(0.0, f64::max) * tail_factor(y / radius, order);
        (size(leading) > 0.0).then(|| (rest.sum::<f64>() + tail) / size(leading))
    };
    let shares = series.coefficients.iter().filter_map(of);
    shares.fold(0.0, f64::max)
}

/// How many of the last powers tell how large the next ones are: some vanish by symmetry.
const ENVELOPE: usize = 4;

/// What is left of a power after so many further ones, `(y/R)^j`.
fn share_of(y: f64, radius: f64, powers: usize) -> f64 {
    (y / radius).powi(powers as i32)
}

/// `Σ_{k>n} |c_k| y^k` over `|c_n| y^n` where `|c_k| ~ k^{−3/2} R^{−k}`, at most: `q/(1 − q)` with
/// `q = y/R`, and on the circle itself `2n`.
fn tail_factor(q: f64, order: usize) -> f64 {
    let on_the_circle = 2.0 * order as f64;
    if q < 1.0 {
        (q / (1.0 - q)).min(on_the_circle)
    } else {
        on_the_circle
    }
}

/// The largest number up to `end` that meets a condition which holds near 0 and ends once.
fn largest_within(end: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if holds(end) {
        return end;
    }
    last_that_holds(0.0, end, HALVINGS, holds)
}

impl super::Expander<'_> {
    /// What the contact of a passage, cut at a weight, leaves out at the edge of the scene's
    /// window; see [`WindowEdge::new`].
    ///
    /// # Errors
    ///
    /// As [`depth_series`](Self::depth_series), from which it is estimated.
    pub fn window_edge(
        &self,
        passage: usize,
        contact_weight: u32,
    ) -> Result<Option<WindowEdge>, ExpansionError> {
        let series = self.depth_series(passage, super::RADIUS_ORDER)?;
        Ok(WindowEdge::new(&series, self.depth_limit(), contact_weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    /// `Σ_{k≥first} (y/R)^k`.
    fn geometric(first: usize, radius: f64) -> DepthSeries {
        let coefficient = |k: usize| {
            if k < first {
                Dd::ZERO
            } else {
                Dd::from(radius.powi(-(k as i32)))
            }
        };
        DepthSeries {
            coefficients: vec![(0..=24).map(coefficient).collect()],
        }
    }

    #[test]
    fn a_correction_above_the_weight_is_left_out_whole() {
        let edge = WindowEdge::new(&geometric(3, 0.1), 1e-12, 2).expect("an infinite series");
        assert_eq!((edge.omitted_share, edge.usable_depth), (1.0, 0.0));
        assert!(!edge.is_within());
    }

    #[test]
    fn the_share_at_the_usable_depth_is_the_largest_one() {
        let series = geometric(3, 0.1);
        let depth = WindowEdge::new(&series, 1.0, 8).map_or(f64::NAN, |edge| edge.usable_depth);
        let edge = WindowEdge::new(&series, depth, 8).expect("an infinite series");
        // Sixteen powers of a square root of a square: some tens of roundings.
        assert!((edge.omitted_share / WindowEdge::LARGEST_SHARE - 1.0).abs() < 1e-13);
    }

    #[test]
    fn what_lies_beyond_the_powers_known_is_counted() {
        // The estimate of the radius takes the terms for k^(-3/2) R^-k, so that it is larger than
        // that of a geometric series.
        let series = geometric(1, 0.1);
        let exact = 0.5_f64.powi(23) / 0.5;
        let edge = WindowEdge::new(&series, 0.05 * 0.05, 23).expect("an infinite series");
        let ratio = edge.omitted_share / exact;
        assert!((0.9..3.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_series_that_ends_leaves_nothing_out() {
        let mut series = geometric(1, 0.1);
        series.coefficients[0][3..].fill(Dd::ZERO);
        assert_eq!(WindowEdge::new(&series, 1.0, 4), None);
    }
}
