//! The discontinuity mapping along the depth alone: its leading law and where its series ends.
//!
//! One idea: with every other deviation at zero the correction is an ordinary power series in `y`.
//! Its first coefficient that does not vanish is the law of the contact (`y` for a rigid or
//! prestressed stop, `y²` or `y³` for softer ones); the growth of its last ones is the radius
//! within which any truncation makes sense.

use std::ops::Range;

use super::ExpansionError;
use super::approach::{Approach, DepthVariable};
use super::departure::Through;
use super::depth_chart::steepest_coordinate;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{DEVIATION_WEIGHT, Variables};
use crate::jet::Jet;
use crate::numeric::{Dd, Scalar};

/// Coefficients below this share of the largest of this power, or of what lower ones carry on, are
/// rounding.
const VANISHING: f64 = 1e-20;
/// How many powers make one of the two groups that the radius is estimated from.
const LAST_POWERS: usize = 8;

/// The correction `D(x) − x` of each coordinate of the section as a power series in the depth
/// variable `y`.
///
/// All deviations are zero but that of the coordinate along which the depth is steepest, which is
/// the one that makes the depth `y²`.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthSeries {
    /// Coefficients by coordinate, then by power of `y`; those that vanish but for rounding are 0.
    pub coefficients: Vec<Vec<Dd>>,
}

/// The leading term `coefficient · y^exponent` of a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeadingLaw {
    /// Power of `y`.
    pub exponent: u32,
    /// Its coefficient.
    pub coefficient: Dd,
}

impl DepthSeries {
    /// Expands the corrections up to a power of `y`.
    ///
    /// # Errors
    ///
    /// As [`discontinuity`](super::discontinuity()).
    pub fn new(
        passage: &Passage,
        chart: &SectionChart,
        variables: &Variables,
        order: u32,
    ) -> Result<Self, ExpansionError> {
        let through = Through::of(passage, chart, variables)?;
        let kept = order + through.lost_weights();
        let alone = depth_alone(passage, chart, variables, kept)?;
        let kind = DepthVariable::Replacing;
        let approach = Approach::<Dd>::new(passage, chart, &alone, kept, kind)?;
        let image = approach.image(passage, chart, &through)?;
        let scales = scales(&image, order);
        let correction = |&component: &usize| {
            let correction = &image[component] - &approach.start[component];
            (0..=order as usize)
                .map(|power| without_rounding(&correction, power, scales[power]))
                .collect()
        };
        Ok(Self {
            coefficients: chart.section.coordinates.iter().map(correction).collect(),
        })
    }

    /// The leading law of a coordinate's correction; `None` if it vanishes up to the order of the
    /// series.
    pub fn leading_law(&self, coordinate: usize) -> Option<LeadingLaw> {
        let series = &self.coefficients[coordinate];
        let exponent = series.iter().position(|&value| value != Dd::ZERO)?;
        Some(LeadingLaw {
            exponent: exponent as u32,
            coefficient: series[exponent],
        })
    }

    /// Estimates the radius of convergence in `y`, the smallest over the coordinates.
    ///
    /// The contact time is the root of an analytic equation, so that the nearest singularity is, as
    /// a rule, a square root, `|c_j| ~ j^{−3/2} R^{−j}`. Of the largest `m_j = j^{3/2} |c_j|`
    /// among the last powers and that among as many before:
    ///
    /// ```text
    /// R = (m_i / m_j)^{1/(j − i)}
    /// ```
    ///
    /// `None` if no coordinate has coefficients there. At order 24 the estimate is right to some
    /// ten per cent.
    pub fn radius(&self) -> Option<f64> {
        self.coefficients
            .iter()
            .filter_map(|series| radius_of(series))
            .reduce(f64::min)
    }
}

/// See [`DepthSeries::radius`].
fn radius_of(series: &[Dd]) -> Option<f64> {
    let largest = |powers: Range<usize>| {
        let weighted = powers.map(|power| {
            let value = series[power].magnitude() * (power as f64).powf(1.5);
            (power, value)
        });
        weighted
            .filter(|(_, value)| *value > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let end = series.len();
    let (last, before) = (
        end.checked_sub(LAST_POWERS)?,
        end.checked_sub(2 * LAST_POWERS)?,
    );
    let ((late, late_value), (early, early_value)) = (largest(last..end)?, largest(before..last)?);
    let radius = (early_value / late_value).powf(1.0 / (late - early) as f64);
    radius.is_finite().then_some(radius)
}

/// The variables with weights that leave the powers of `y` alone, and of the coordinate that makes
/// the depth.
fn depth_alone(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    order: u32,
) -> Result<Variables, ExpansionError> {
    let kind = DepthVariable::Added;
    let lowest = Approach::<f64>::new(passage, chart, variables, 2, kind)?;
    let steepest = steepest_coordinate(&lowest.depth, variables)?;
    let mut weights = vec![order + 2; variables.len()];
    weights[steepest] = DEVIATION_WEIGHT;
    Ok(Variables {
        weights,
        ..variables.clone()
    })
}

/// The largest coefficient of each power over the components of the image, or of a lower one where
/// rounding carries it on.
///
/// Coefficients of a series whose radius exceeds 1 fall from power to power without being rounding:
/// what a lower power leaves at a higher one falls as fast, by `λ = max_k (M_k/M_0)^{1/k}` a power,
/// `M_k` being the largest of power `k`. The threshold therefore does not depend on the units of
/// length.
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

/// `λ` of a list of sizes, at most 1.
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
    if value.magnitude() <= VANISHING * scale {
        Dd::ZERO
    } else {
        value
    }
}
