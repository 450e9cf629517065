//! The approach to a surface: the free flow about its minimum of the gap, as series in the time from it.
//!
//! The gap at the minimum is `−y²`, so the surface was met at `t_e = t_min − y σ` with an analytic `σ`.
//! Derivation: docs/mathematics/discontinuity.md.

use std::sync::Arc;

use super::ExpansionError;
use super::contact_law::ContactLaw;
use super::depth_chart::DepthChart;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{Variables, lift};
use crate::flow::{Field, LocalSeries, at_series_time, local_series};
use crate::jet::{Jet, JetSpace, implicit_root};
use crate::numeric::Real;

/// How `y` stands beside the other variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthVariable {
    /// One more variable; `y² = −h_min` is used at the end.
    Added,
    /// In the place of a coordinate, which is the jet that makes `−h_min` equal to `y²`.
    Replacing,
}

impl DepthVariable {
    /// What a contact law needs: a contact time is found by dividing by `y`, which needs variables without a
    /// relation between them.
    pub(super) fn of(law: &ContactLaw) -> Self {
        match law {
            ContactLaw::Rigid { .. } => Self::Added,
            ContactLaw::Compliant { .. } => Self::Replacing,
        }
    }
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
        // The gap is divided by the square of the time, so that its power `weight + 1` acts at the weight.
        let order = weight as usize + 1;
        let (minimum_time, series) =
            series_about_minimum(&passage.field, &start, &parameters, order)?;
        let depth = -&series.watched(0)[0];
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
            let (mut q, mut slope) = (Jet::zero(&self.space), Jet::zero(&self.space));
            for coefficient in self.gap[2..].iter().rev() {
                slope = &(&slope * &step) + &q;
                q = &(&q * &step) + coefficient;
            }
            let square = sigma * sigma;
            let value = (&q * &square).add_constant(-S::one());
            let derivative =
                &(&q * sigma).scale(S::from_f64(2.0)) + &(&(&slope * &minus_y) * &square);
            (value, derivative)
        })?;
        Ok(root)
    }
}

/// Time from a state to its minimum of the gap, and the series of the free flow about that minimum; the gap is the
/// first function watched.
pub(super) fn series_about_minimum<S: Real>(
    field: &Field,
    start: &[Jet<S>],
    parameters: &[Jet<S>],
    order: usize,
) -> Result<(Jet<S>, LocalSeries<S>), ExpansionError> {
    let order = order.max(2);
    let series = local_series(field, start, parameters, order);
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
    Ok((time, local_series(field, &minimum, parameters, order)))
}

/// Solves `h'(t) = Σ k h_k t^{k−1} = 0` for the time as a jet.
pub(super) fn time_of_minimum<S: Real>(
    gap: &[Jet<S>],
    start: &Jet<S>,
) -> Result<Jet<S>, ExpansionError> {
    let root = implicit_root(start, |time| {
        let (mut velocity, mut acceleration) = (Jet::zero(time.space()), Jet::zero(time.space()));
        for (power, coefficient) in gap.iter().enumerate().skip(1).rev() {
            acceleration = &(&acceleration * time) + &velocity;
            velocity = &(&velocity * time) + &coefficient.scale(S::from_f64(power as f64));
        }
        (velocity, acceleration)
    })?;
    Ok(root)
}
