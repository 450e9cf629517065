//! The discontinuity mapping along the depth alone: its leading law and where its series ends.
//!
//! One idea: with every other deviation at zero the correction is an ordinary power series in `y`. Its first
//! coefficient that does not vanish is the law of the contact (`y` for a rigid or prestressed stop, `y²` or `y³`
//! for softer ones); the growth of its last ones is the radius within which any truncation makes sense.

use super::ExpansionError;
use super::approach::{Approach, DepthVariable};
use super::departure::Through;
use super::depth_chart::steepest_coordinate;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{DEVIATION_WEIGHT, Variables};
use crate::jet::Jet;
use crate::numeric::{Dd, Scalar};

/// Coefficients below this share of the largest of this power or lower are rounding.
const VANISHING: f64 = 1e-20;
/// How many of the last powers the radius is estimated from.
const LAST_POWERS: usize = 6;

/// The correction `D(x) − x` of each coordinate of the section as a power series in the depth variable `y`.
///
/// All deviations are zero but that of the coordinate along which the depth is steepest, which is the one
/// that makes the depth `y²`.
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

    /// The leading law of a coordinate's correction; `None` if it vanishes up to the order of the series.
    pub fn leading_law(&self, coordinate: usize) -> Option<LeadingLaw> {
        let series = &self.coefficients[coordinate];
        let exponent = series.iter().position(|&value| value != Dd::ZERO)?;
        Some(LeadingLaw {
            exponent: exponent as u32,
            coefficient: series[exponent],
        })
    }

    /// Estimates the radius of convergence in `y`: of the last powers `j` of each coordinate the smallest
    ///
    /// ```text
    /// |c_j / c_l|^{−1/(j − l)},     l the power of the leading law.
    /// ```
    ///
    /// `None` if no coordinate has a power beyond its leading one. At order 24 the estimate is right to some
    /// ten per cent, on the large side for a singularity weaker than a pole.
    pub fn radius(&self) -> Option<f64> {
        let coordinates = 0..self.coefficients.len();
        coordinates
            .filter_map(|coordinate| self.radius_of(coordinate))
            .reduce(f64::min)
    }

    fn radius_of(&self, coordinate: usize) -> Option<f64> {
        let series = &self.coefficients[coordinate];
        let leading = self.leading_law(coordinate)?;
        let first = leading.exponent as usize;
        let last = series.len().saturating_sub(LAST_POWERS).max(first + 1);
        let scale = leading.coefficient.magnitude();
        let radius = |power: usize| {
            let ratio = series[power].magnitude() / scale;
            ratio.powf(-1.0 / (power - first) as f64)
        };
        (last..series.len())
            .map(radius)
            .filter(|radius| radius.is_finite())
            .reduce(f64::min)
    }
}

/// The variables with weights that leave the powers of `y` alone, and of the coordinate that makes the depth.
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

/// The largest coefficient of each power or a lower one over the components of the image.
fn scales(image: &[Jet<Dd>], order: u32) -> Vec<f64> {
    let mut largest = 0.0_f64;
    let powers = 0..=order as usize;
    let scales = powers.map(|power| {
        let of_power = image
            .iter()
            .map(|jet| at_power(jet, power).magnitude())
            .fold(0.0, f64::max);
        largest = largest.max(of_power);
        largest
    });
    scales.collect()
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
