//! The discontinuity mapping along the depth only: its leading law, its radius of convergence, and
//! the truncation error at the edge of a window.
//!
//! If all other deviations are zero, the correction is a power series in `y`. Its first nonzero
//! coefficient is the law of the contact (`y` for a rigid or prestressed stop, `y²` or `y³` for
//! softer ones). The growth of its last coefficients gives the radius within which a truncation
//! makes sense. The error of weight `W` at the largest depth of a window is the rest of the series.

use std::ops::Range;

use super::approach::{Approach, DepthVariable, steepest_coordinate};
use super::discontinuity::Through;
use super::error::ExpansionError;
use super::power_law::exponent_of;
use super::routes::Graze;
use super::variables::DEVIATION_WEIGHT;
use crate::jet::Jet;
use crate::numeric::{Bracket, Dd, Scalar};

/// A coefficient below this share of the largest of its power, or of the rounding carried on from
/// lower powers, is rounding.
const VANISHING: f64 = 1e-20;
/// Number of powers in each of the two groups used to estimate the radius.
const LAST_POWERS: usize = 8;

/// Correction `D(x) − x` of each coordinate of the section as a power series in the depth variable
/// `y`.
///
/// All deviations are zero except the coordinate along which the depth is steepest; that coordinate
/// produces the depth `y²`.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthSeries {
    /// Coefficients by coordinate, then by power of `y`; a coefficient that is rounding is 0.
    pub coefficients: Vec<Vec<Dd>>,
    /// Terms with powers of `y` that are not whole, by coordinate: exponent and coefficient.
    pub between: Vec<Vec<(f64, Dd)>>,
}

/// The leading term `coefficient · y^exponent` of a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeadingLaw {
    /// Leading power of `y`; whole unless the contact has a power of the penetration that is not
    /// half a whole number.
    pub exponent: f64,
    /// Coefficient of that power.
    pub coefficient: Dd,
}

impl DepthSeries {
    /// Expands the corrections up to a power of `y`.
    ///
    /// # Errors
    ///
    /// As [`discontinuity`](super::discontinuity()).
    pub fn new(graze: &Graze, order: u32) -> Result<Self, ExpansionError> {
        let through = Through::of(graze)?;
        let kept = order + through.lost_weights();
        let kind = DepthVariable::Replacing;
        let approach = Approach::<Dd>::new(&depth_alone(graze, kept)?, kept, kind)?;
        let image = approach.image(graze, &through)?;
        let scales = scales(&image, order);
        let own = through.own_variables();
        let corrections = approach.corrections(graze, &image);
        let whole = |correction: &Jet<Dd>| {
            (0..=order as usize)
                .map(|power| without_rounding(correction, power, scales[power]))
                .collect()
        };
        let variables = approach.space.variables();
        let between = |correction| terms_between(correction, variables, &own);
        Ok(Self {
            coefficients: corrections.iter().map(whole).collect(),
            between: corrections.iter().map(between).collect(),
        })
    }

    /// Leading law of a coordinate's correction; `None` if the correction vanishes up to the order
    /// of the series.
    pub fn leading_law(&self, coordinate: usize) -> Option<LeadingLaw> {
        let series = self.coefficients[coordinate].iter().enumerate();
        let whole = series.map(|(power, &value)| (power as f64, value));
        let between = self.between.get(coordinate).into_iter().flatten().copied();
        let terms = whole.chain(between).filter(|(_, value)| *value != Dd::ZERO);
        let first = terms.min_by(|a, b| a.0.total_cmp(&b.0));
        first.map(|(exponent, coefficient)| LeadingLaw { exponent, coefficient })
    }

    /// Estimates the radius of convergence in `y`, the smallest over the coordinates.
    ///
    /// The contact time is the root of an analytic equation, so the nearest singularity is usually
    /// a square root, `|c_j| ~ j^{−3/2} R^{−j}`. From the largest `m_j = j^{3/2} |c_j|` among the
    /// last powers and the largest `m_i` among as many before:
    ///
    /// ```text
    /// R = (m_i / m_j)^{1/(j − i)}
    /// ```
    ///
    /// `None` if no coordinate has coefficients among these powers. At order 24 the error of the
    /// estimate is some ten per cent.
    pub fn radius(&self) -> Option<f64> {
        self.coefficients.iter().filter_map(|series| radius_of(series)).reduce(f64::min)
    }
}

/// Radius of one series; see [`DepthSeries::radius`].
fn radius_of(series: &[Dd]) -> Option<f64> {
    let largest = |powers: Range<usize>| {
        let weighted = powers.map(|power| {
            let value = series[power].magnitude() * (power as f64).powf(1.5);
            (power, value)
        });
        weighted.filter(|(_, value)| *value > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let end = series.len();
    let (last, before) = (end.checked_sub(LAST_POWERS)?, end.checked_sub(2 * LAST_POWERS)?);
    let ((late, late_value), (early, early_value)) = (largest(last..end)?, largest(before..last)?);
    let radius = (early_value / late_value).powf(1.0 / (late - early) as f64);
    radius.is_finite().then_some(radius)
}

/// Terms in powers of `y` and of the variables behind the others; `variables` is the number of the
/// latter, `own` are the exponents. What is less than rounding beside the largest is left out.
fn terms_between(correction: &Jet<Dd>, variables: usize, own: &[Dd]) -> Vec<(f64, Dd)> {
    let terms = correction.terms().filter(|(powers, _)| {
        let (others, own) = powers.split_at(variables);
        others[1..].iter().all(|&power| power == 0) && own.iter().any(|&power| power > 0)
    });
    let terms = terms.map(|(powers, value)| {
        (f64::from(powers[0]) + exponent_of(&powers[variables..], own), value)
    });
    let terms: Vec<(f64, Dd)> = terms.collect();
    let largest = terms.iter().map(|(_, value)| value.magnitude()).fold(0.0, f64::max);
    terms.into_iter().filter(|(_, value)| value.magnitude() > VANISHING * largest).collect()
}

/// The graze with weights such that only powers of `y`, and of the coordinate that produces the
/// depth, remain.
fn depth_alone(graze: &Graze, order: u32) -> Result<Graze, ExpansionError> {
    let lowest = Approach::<f64>::new(graze, 2, DepthVariable::Added)?;
    let steepest = steepest_coordinate(&lowest.depth, &graze.variables)?;
    let mut alone = graze.clone();
    alone.variables.weights.fill(order + 2);
    alone.variables.weights[steepest] = DEVIATION_WEIGHT;
    Ok(alone)
}

/// Scale of rounding at each power: the largest coefficient over the components of the image, or
/// that of a lower power if its rounding carried on is larger.
///
/// If the radius of convergence is above 1, coefficients fall from power to power, so that a small
/// one need not be rounding. Rounding carried on from a lower power falls as fast, by
/// `λ = max_k (M_k/M_0)^{1/k}` per power, with `M_k` the largest coefficient of power `k`. The
/// threshold therefore does not depend on the unit of length.
fn scales(image: &[Jet<Dd>], order: u32) -> Vec<f64> {
    let of_power = |power: usize| {
        let values = image.iter().map(|jet| at_power(jet, power).magnitude());
        values.fold(0.0, f64::max)
    };
    let largest: Vec<f64> = (0..=order as usize).map(of_power).collect();
    let rate = decay(&largest);
    let mut carried = 0.0_f64;
    let scales = largest.iter().map(|&value| {
        carried = value.max(rate * carried);
        carried
    });
    scales.collect()
}

/// Decay rate `λ` of a list of sizes, at most 1.
fn decay(sizes: &[f64]) -> f64 {
    let Some(first) = sizes.iter().position(|&size| size > 0.0) else {
        return 1.0;
    };
    let later = sizes.iter().enumerate().skip(first + 1);
    let rates =
        later.map(|(power, &size)| (size / sizes[first]).powf(1.0 / (power - first) as f64));
    let fastest = rates.fold(0.0, f64::max);
    fastest.min(1.0)
}

fn at_power(jet: &Jet<Dd>, power: usize) -> Dd {
    let mut exponents = vec![0; jet.space().variables()];
    exponents[0] = power as u8;
    jet.coefficient(&exponents)
}

fn without_rounding(jet: &Jet<Dd>, power: usize, scale: f64) -> Dd {
    let value = at_power(jet, power);
    if value.magnitude() <= VANISHING * scale { Dd::ZERO } else { value }
}

/// Truncation error of a discontinuity mapping at the largest depth of a window.
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
    /// Upper bound on the share of the correction that truncation omits at the edge:
    /// `Σ_{k>W} |c_k| y^k / |c_n| y^n`. Powers beyond those known are estimated from the radius; 1
    /// if the correction begins above the weight.
    #[serde(with = "crate::numeric::unbounded_number")]
    pub omitted_share: f64,
    /// Depth within the radius at which the share is [`LARGEST_SHARE`](Self::LARGEST_SHARE); 0 if
    /// the correction begins above the weight.
    pub usable_depth: f64,
}

impl WindowEdge {
    /// Largest share for which a window does not count as too deep: above it, fewer than two digits
    /// of the contact's correction are right.
    pub const LARGEST_SHARE: f64 = 1e-2;

    /// Edge of a window that reaches to a depth `y²`, for a truncation weight below the order of
    /// the series.
    ///
    /// Only corrections that begin with the lowest power count. `None` if all of them vanish or
    /// their series end, so that nothing is omitted, and for terms between whole powers, whose
    /// radius is not known. A weight that is not below the order of the
    /// series is replaced by the highest one that is.
    ///
    /// ```
    /// use grazemap_map::expansion::{DepthSeries, WindowEdge};
    /// use grazemap_map::numeric::Dd;
    ///
    /// // y + (4y)² + (4y)³ + …: radius 1/4, and Σ_{k>4} (4y)^k / y = 0.4^5 / 0.6 / 0.1 at y = 0.1.
    /// let coefficients = (0..=24).map(|k| match k {
    ///     0 | 1 => Dd::from(f64::from(k)),
    ///     _ => Dd::from(4f64.powi(k)),
    /// });
    /// let series =
    ///     DepthSeries { coefficients: vec![coefficients.collect()], between: Vec::new() };
    /// let edge = WindowEdge::new(&series, 0.01, 4).expect("an infinite series");
    /// assert!((edge.omitted_share - 0.4_f64.powi(5) / 0.06).abs() < 1e-6 && !edge.is_within());
    /// ```
    pub fn new(series: &DepthSeries, depth: f64, contact_weight: u32) -> Option<Self> {
        let radius = series.radius()?;
        if series.between.iter().any(|terms| !terms.is_empty()) {
            return None;
        }
        let laws = (0..series.coefficients.len()).map(|coordinate| series.leading_law(coordinate));
        let leading_exponent = laws.flatten().map(|law| law.exponent as u32).min()?;
        let (omitted_share, usable_depth) = if contact_weight < leading_exponent {
            (1.0, 0.0)
        } else {
            let share = |y: f64| omitted_share(series, leading_exponent, contact_weight, y, radius);
            let excess = |y: f64| share(y) - Self::LARGEST_SHARE;
            let ends = (excess(0.0), excess(radius));
            let bracket = Bracket::new(0.0, radius, ends.0, ends.1).ok();
            let root = bracket.and_then(|bracket| bracket.itp(ends, 0.0, excess).root());
            let usable = root.unwrap_or(if ends.1 <= 0.0 { radius } else { 0.0 });
            (share(depth.sqrt()), usable * usable)
        };
        Some(Self { depth, radius, contact_weight, leading_exponent, omitted_share, usable_depth })
    }

    /// Whether the window lies within the radius and truncation omits no more than
    /// [`LARGEST_SHARE`](Self::LARGEST_SHARE).
    pub fn is_within(&self) -> bool {
        self.omitted_share <= Self::LARGEST_SHARE && self.depth < self.radius * self.radius
    }
}

/// Share `Σ_{k>W} |c_k| y^k / |c_n| y^n`, the largest over the corrections that begin with `y^n`,
/// with the [tail](tail_factor) beyond the powers known.
fn omitted_share(series: &DepthSeries, leading: u32, weight: u32, y: f64, radius: f64) -> f64 {
    let leading = leading as usize;
    let of = |coefficients: &Vec<_>| {
        let size = |k: usize| Scalar::magnitude(coefficients[k]);
        let order = coefficients.len() - 1;
        let first = (weight as usize + 1).min(order);
        let rest = (first..=order).map(|k| size(k) * y.powi((k - leading) as i32));
        let last = order.saturating_sub(ENVELOPE).max(leading)..=order;
        let envelope = last.map(|k| {
            // Ratio of terms this many powers apart.
            let ratio = (y / radius).powi((order - k) as i32);
            size(k) * y.powi((k - leading) as i32) * ratio
        });
        let tail = envelope.fold(0.0, f64::max) * tail_factor(y / radius, order);
        (size(leading) > 0.0).then(|| (rest.sum::<f64>() + tail) / size(leading))
    };
    let shares = series.coefficients.iter().filter_map(of);
    shares.fold(0.0, f64::max)
}

/// Number of last powers that bound the next ones; several, because some vanish by symmetry.
const ENVELOPE: usize = 4;

/// Upper bound on `Σ_{k>n} |c_k| y^k` over `|c_n| y^n` if `|c_k| ~ k^{−3/2} R^{−k}`: `q/(1 − q)`
/// with `q = y/R`, and `2n` on the circle itself.
fn tail_factor(q: f64, order: usize) -> f64 {
    let on_the_circle = 2.0 * order as f64;
    if q < 1.0 { (q / (1.0 - q)).min(on_the_circle) } else { on_the_circle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Dd;

    /// Geometric series `Σ_{k≥first} (y/R)^k`.
    fn geometric(first: usize, radius: f64) -> DepthSeries {
        let coefficient = |k: usize| {
            if k < first { Dd::ZERO } else { Dd::from(radius.powi(-(k as i32))) }
        };
        let coefficients = vec![(0..=24).map(coefficient).collect()];
        DepthSeries { coefficients, between: Vec::new() }
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
        // The estimate of the radius assumes terms `k^(-3/2) R^-k`, so it is larger than the radius
        // of a geometric series.
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
