//! The speed at which a surface is met.

use super::ExpansionError;
use super::approach::{Approach, DepthVariable};
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{Variables, fold_depth_powers};
use crate::jet::Jet;

/// Speed at which the surface is met, `−h'` at the entry, as `y · linear + y² · quadratic`.
#[derive(Clone, Debug)]
pub struct ImpactSpeed {
    /// Coefficient of `y`.
    pub linear: Jet<f64>,
    /// Coefficient of `y²`.
    pub quadratic: Jet<f64>,
}

impl ImpactSpeed {
    /// The speed of a contact of depth variable `y` that is reached at a point (coordinates;
    /// parameters).
    pub fn at(&self, y: f64, point: &[f64]) -> f64 {
        y * (self.linear.evaluate(point) + y * self.quadratic.evaluate(point))
    }
}

/// Expands the speed at which the surface is met to the weighted degree `weight`:
///
/// ```text
/// −h'(t_e) = −Σ_{k≥2} k H_k (−yσ)^{k−1} = √(2h'') y + …
/// ```
///
/// # Errors
///
/// As [`discontinuity`](super::discontinuity()).
pub fn impact_speed(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    weight: u32,
) -> Result<ImpactSpeed, ExpansionError> {
    let kind = DepthVariable::Replacing;
    let approach = Approach::<f64>::new(passage, chart, variables, weight, kind)?;
    let y = approach.depth_variable();
    let since_minimum = -&(&y * &approach.entry_time_over_depth(&y)?);
    let falling = approach.gap.iter().enumerate().skip(1).rev();
    let speed = falling.fold(Jet::zero(&approach.space), |sum, (power, coefficient)| {
        &(&sum * &since_minimum) - &coefficient.scale(power as f64)
    });
    let fold = |first: u8, weight_left: u32| {
        let space = variables.smooth_space(weight_left)?;
        Ok::<_, ExpansionError>(fold_depth_powers(
            &speed,
            first,
            weight,
            &approach.depth,
            &space,
        ))
    };
    Ok(ImpactSpeed {
        linear: fold(1, weight.saturating_sub(1))?,
        quadratic: fold(2, weight.saturating_sub(2))?,
    })
}
