//! The approach to a surface: the free flow about its minimum of the gap, as series in the time
//! from it.
//!
//! The gap at the minimum is `−y²`, so the surface was met at `t_e = t_min − y σ` with an analytic
//! `σ`. Derivation: docs/mathematics/discontinuity.md.

use std::sync::Arc;

use super::ExpansionError;
use super::depth_chart::DepthChart;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{Variables, lift};
use crate::flow::{Field, LocalSeries, at_series_time, local_series_kept_to};
use crate::jet::{Jet, JetSpace, implicit_root, power_series_with_slope_at};
use crate::numeric::Real;

/// How `y` stands beside the other variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthVariable {
    /// One more variable, beside all others: what needs no relation between them.
    Added,
    /// In the place of a coordinate, which is the jet that makes `−h_min` equal to `y²`: variables
    /// are fewer and independent, so that a contact time can be found by dividing by `y`.
    Replacing,
}

/// The free flow about its minimum of the gap, as series in the time from the minimum.
pub(super) struct Approach<S: Real> {
    /// Space of `(y; coordinates; parameters)`.
    pub(super) space: Arc<JetSpace>,
    /// First variable of the parameters in `space`.
    pub(super) first_parameter: usize,
    /// Time from the section point to the minimum, in `space`.
    minimum_time: Jet<S>,
    /// `−h_min`, without `y`.
    pub(super) depth: Jet<S>,
    /// The coordinate in whose place `y` stands.
    pub(super) replaced: Option<usize>,
    /// The section point itself, in `space`.
    pub(super) start: Vec<Jet<S>>,
    /// Taylor coefficients, in the time from the minimum, of each state component, in `space`.
    states: Vec<Vec<Jet<S>>>,
    /// Taylor coefficients `H_k` of the gap, in `space`.
    pub(super) gap: Vec<Jet<S>>,
}

/// The state on the surface, as jets in `(y; coordinates; parameters)`.
pub(super) struct Entry<S: Real> {
    /// The state.
    pub(super) state: Vec<Jet<S>>,
    /// Time from the section point.
    pub(super) time: Jet<S>,
}

impl<S: Real> Approach<S> {
    pub(super) fn new(
        passage: &Passage,
        chart: &SectionChart,
        variables: &Variables,
        weight: u32,
        kind: DepthVariable,
    ) -> Result<Self, ExpansionError> {
        variables.check_contact_space(weight)?;
        let base = variables.smooth_space(weight + 1)?;
        let parameters = passage.parameter_jets(&base, variables.coordinates);
        let start = chart.embed(passage, &base, 0)?;
        let kept = kept_about_minimum(weight, variables.divisor(), base.order());
        let (minimum_time, series) =
            series_about_minimum(&passage.field, &start, &parameters, kept)?;
        // The depth vanishes on the grazing orbit: its constant term is rounding.
        let mut depth = -&series.watched(0)[0];
        depth.coefficients_mut()[0] = S::zero();
        let (space, chart) = match kind {
            DepthVariable::Added => (variables.contact_space(weight)?, None),
            DepthVariable::Replacing => {
                let chart = DepthChart::new(&depth, variables, weight)?;
                (Arc::clone(&chart.space), Some(chart))
            }
        };
        let raise = |jets: &[Jet<S>]| -> Vec<Jet<S>> {
            match &chart {
                None => jets.iter().map(|jet| lift(jet, &space)).collect(),
                Some(chart) => chart.raise(jets),
            }
        };
        Ok(Self {
            first_parameter: 1 + variables.coordinates,
            minimum_time: raise(&[minimum_time]).swap_remove(0),
            replaced: chart.as_ref().map(|chart| chart.replaced),
            depth,
            start: raise(&start),
            states: (0..passage.dimension())
                .map(|component| raise(series.state(component)))
                .collect(),
            gap: raise(series.watched(0)),
            space,
        })
    }

    /// The depth variable as a jet.
    pub(super) fn depth_variable(&self) -> Jet<S> {
        Jet::variable(&self.space, 0, S::zero())
    }

    /// Back from the minimum by `y σ` to the surface.
    pub(super) fn entry(&self) -> Result<Entry<S>, ExpansionError> {
        let y = self.depth_variable();
        let since_minimum = -&(&y * &self.entry_time_over_depth(&y)?);
        let state = self
            .states
            .iter()
            .map(|coefficients| at_series_time(coefficients, &since_minimum))
            .collect();
        Ok(Entry {
            state,
            time: &self.minimum_time + &since_minimum,
        })
    }

    /// `σ` of the entry time `t_min − y σ`, from the gap at the entry divided by `y²`:
    ///
    /// ```text
    /// 0 = −1 + H_2 σ² − y H_3 σ³ + y² H_4 σ⁴ − …,   σ_0 = √(2 / h'')
    /// ```
    pub(super) fn entry_time_over_depth(&self, y: &Jet<S>) -> Result<Jet<S>, ExpansionError> {
        let start = Jet::constant(&self.space, S::one() / self.gap[2].head().sqrt());
        let minus_y = -y;
        let root = implicit_root(&start, |sigma| {
            let step = &minus_y * sigma;
            // Q(s) = Σ_{k≥2} H_k s^{k−2} and its derivative, at s = −y σ
            let (q, slope) = power_series_with_slope_at(&self.gap[2..], &step);
            let square = sigma * sigma;
            let value = (&q * &square).add_constant(-S::one());
            let derivative =
                &(&q * sigma).scale(S::from_f64(2.0)) + &(&(&slope * &minus_y) * &square);
            (value, derivative)
        })?;
        Ok(root)
    }
}

/// The degree, in units of the weights' divisor, to which the coefficient of each power of the time
/// from the minimum is needed.
///
/// That time is of weight 1, and the gap is divided by its square: its coefficient of power `k`
/// acts from the weight `k − 2` on, the power `weight + 1` still at the weight.
fn kept_about_minimum(weight: u32, divisor: u32, order: usize) -> Vec<usize> {
    let powers = 0..=(weight + 1).max(2);
    let degree = |power: u32| ((weight + 2).saturating_sub(power) / divisor) as usize;
    powers.map(|power| degree(power).min(order)).collect()
}

/// The degree to which the coefficients of a series are needed of which a root of the derivative is
/// sought, and which is summed there.
pub(super) fn kept_to_minimum(order: usize) -> Vec<usize> {
    let powers = 0..=(order + 1).max(2);
    powers
        .map(|power| (order + 1).saturating_sub(power).min(order))
        .collect()
}

/// Time from a state to its minimum of the gap, and the series of the free flow about that minimum,
/// its coefficients to given degrees; the gap is the first function watched.
pub(super) fn series_about_minimum<S: Real>(
    field: &Field,
    start: &[Jet<S>],
    parameters: &[Jet<S>],
    kept: Vec<usize>,
) -> Result<(Jet<S>, LocalSeries<S>), ExpansionError> {
    let to_minimum = kept_to_minimum(start[0].space().order());
    let series = local_series_kept_to(field, start, parameters, to_minimum);
    let normal_acceleration = 2.0 * series.watched(0)[2].head().to_f64();
    if !(normal_acceleration > 0.0 && normal_acceleration.is_finite()) {
        return Err(ExpansionError::DegenerateGraze {
            normal_acceleration,
        });
    }
    let time = time_of_minimum(series.watched(0), &Jet::zero(start[0].space()))?;
    let minimum: Vec<_> = (0..start.len())
        .map(|component| at_series_time(series.state(component), &time))
        .collect();
    let about = local_series_kept_to(field, &minimum, parameters, kept);
    Ok((time, about))
}

/// Solves `h'(t) = Σ k h_k t^{k−1} = 0` for the time as a jet.
pub(super) fn time_of_minimum<S: Real>(
    gap: &[Jet<S>],
    start: &Jet<S>,
) -> Result<Jet<S>, ExpansionError> {
    let powers = gap.iter().enumerate().skip(1);
    let velocity: Vec<_> = powers
        .map(|(power, coefficient)| coefficient.scale(S::from_f64(power as f64)))
        .collect();
    let root = implicit_root(start, |time| power_series_with_slope_at(&velocity, time))?;
    Ok(root)
}
