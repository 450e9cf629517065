//! The discontinuity mapping of a rigid stop, as jets in `(y; coordinates; parameters)`.
//!
//! One idea: with the depth variable `y² = −h_min` every step of a grazing passage is analytic. The
//! passage is followed as it happens, each step a jet: down to the minimum of the gap, back by `y σ` to
//! the surface, through the reset, and on to the section. No formula of a paper is coded.
//! Derivation: docs/mathematics/discontinuity.md (after Nordmark 1991 and di Bernardo et al. 2008).

use std::sync::Arc;

use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{Variables, coefficient_of_depth_power, fold_depth_powers, lift};
use super::{Contact, ExpansionError};
use crate::flow::{LocalSeries, at_series_time, evaluate, local_series};
use crate::jet::{Jet, JetSpace, implicit_root};
use crate::numeric::Real;
use crate::orbit::PoincareSectionKind;

/// Expands the discontinuity mapping on a section to the weighted degree `weight`.
///
/// The result is canonical: image = coordinates + `y · linear` + `y² · quadratic`, with `linear` to
/// weight `weight − 1`, `quadratic` to `weight − 2` and `depth = −h_min` to `weight + 1`, so that each
/// contributes an error of weight `weight + 1`.
///
/// # Errors
///
/// [`ExpansionError`] if the graze is not simple, the reset is no identity at zero normal velocity, or
/// a jet space would be too large.
pub fn discontinuity<S: Real>(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    weight: u32,
) -> Result<Contact<S>, ExpansionError> {
    let approach = Approach::<S>::new(passage, chart, variables, weight)?;
    let impact = approach.impact(passage)?;
    let image = match chart.section.kind {
        PoincareSectionKind::Tangency => impact.project_to_tangency(passage)?,
        PoincareSectionKind::Stroboscopic { .. } => impact.back_to_zero_time(passage)?,
    };
    approach.canonical(passage, chart, variables, weight, &image)
}

/// Speed at which the surface is met, `−h'` at the entry, as `y · linear + y² · quadratic`.
#[derive(Clone, Debug)]
pub struct ImpactSpeed {
    /// Coefficient of `y`.
    pub linear: Jet<f64>,
    /// Coefficient of `y²`.
    pub quadratic: Jet<f64>,
}

/// Expands the speed at which the surface is met to the weighted degree `weight`:
///
/// ```text
/// −h'(t_e) = −Σ_{k≥2} k H_k (−yσ)^{k−1} = √(2h'') y + …
/// ```
///
/// # Errors
///
/// As [`discontinuity`].
pub fn impact_speed(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    weight: u32,
) -> Result<ImpactSpeed, ExpansionError> {
    let approach = Approach::<f64>::new(passage, chart, variables, weight)?;
    let y = Jet::variable(&approach.space, 0, 0.0);
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

/// The free flow about its minimum of the gap, as series in the time from the minimum.
struct Approach<S: Real> {
    /// Space of `(y; coordinates; parameters)`.
    space: Arc<JetSpace>,
    /// First variable of the parameters in `space`.
    first_parameter: usize,
    /// Time from the section point to the minimum, in `space`.
    minimum_time: Jet<S>,
    /// `−h_min`, without `y`.
    depth: Jet<S>,
    /// The section point itself, in `space`.
    start: Vec<Jet<S>>,
    /// Taylor coefficients, in the time from the minimum, of each state component, in `space`.
    states: Vec<Vec<Jet<S>>>,
    /// Taylor coefficients `H_k` of the gap, in `space`.
    gap: Vec<Jet<S>>,
}

/// The state just after the reset, as jets in `(y; coordinates; parameters)`.
struct Impact<S: Real> {
    space: Arc<JetSpace>,
    first_parameter: usize,
    state: Vec<Jet<S>>,
    /// Time from the section point to the impact.
    time: Jet<S>,
}

impl<S: Real> Approach<S> {
    fn new(
        passage: &Passage,
        chart: &SectionChart,
        variables: &Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let base = variables.smooth_space(weight + 1)?;
        let space = variables.contact_space(weight)?;
        let parameters = passage.parameter_jets(&base, variables.coordinates);
        let start = chart.embed(passage, &base, 0)?;
        let order = weight as usize;
        let (minimum_time, series) = series_about_minimum(passage, &start, &parameters, order)?;
        let raise = |jet: &Jet<S>| lift(jet, &space);
        Ok(Self {
            first_parameter: 1 + variables.coordinates,
            minimum_time: raise(&minimum_time),
            depth: -&series.watched(0)[0],
            start: start.iter().map(raise).collect(),
            states: (0..passage.dimension())
                .map(|i| series.state(i).iter().map(raise).collect())
                .collect(),
            gap: series.watched(0).iter().map(raise).collect(),
            space,
        })
    }

    /// Back from the minimum by `y σ` to the surface, and through the reset.
    fn impact(&self, passage: &Passage) -> Result<Impact<S>, ExpansionError> {
        let y = Jet::variable(&self.space, 0, S::zero());
        let since_minimum = -&(&y * &self.entry_time_over_depth(&y)?);
        let entry: Vec<_> = self
            .states
            .iter()
            .map(|coefficients| at_series_time(coefficients, &since_minimum))
            .collect();
        let parameters = passage.parameter_jets(&self.space, self.first_parameter);
        let inputs: Vec<_> = entry.iter().chain(&parameters).cloned().collect();
        Ok(Impact {
            space: Arc::clone(&self.space),
            first_parameter: self.first_parameter,
            state: evaluate(&passage.reset, &self.space, &inputs),
            time: &self.minimum_time + &since_minimum,
        })
    }

    /// `σ` of the entry time `t_min − y σ`, from the gap at the entry divided by `y²`:
    ///
    /// ```text
    /// 0 = −1 + H_2 σ² − y H_3 σ³ + y² H_4 σ⁴ − …,   σ_0 = √(2 / h'')
    /// ```
    fn entry_time_over_depth(&self, y: &Jet<S>) -> Result<Jet<S>, ExpansionError> {
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

    /// Takes the identity off, orders by powers of `y`, and replaces `y²` beyond the first by the depth.
    fn canonical(
        &self,
        passage: &Passage,
        chart: &SectionChart,
        variables: &Variables,
        weight: u32,
        image: &[Jet<S>],
    ) -> Result<Contact<S>, ExpansionError> {
        let linear_space = variables.smooth_space(weight.saturating_sub(1))?;
        let quadratic_space = variables.smooth_space(weight.saturating_sub(2))?;
        let (mut linear, mut quadratic) = (Vec::new(), Vec::new());
        for &component in &chart.section.coordinates {
            let correction = &image[component] - &self.start[component];
            self.check_identity_at_zero_depth(passage, &correction)?;
            linear.push(fold_depth_powers(
                &correction,
                1,
                weight,
                &self.depth,
                &linear_space,
            ));
            quadratic.push(fold_depth_powers(
                &correction,
                2,
                weight,
                &self.depth,
                &quadratic_space,
            ));
        }
        Ok(Contact {
            depth: self.depth.clone(),
            linear,
            quadratic,
        })
    }

    fn check_identity_at_zero_depth(
        &self,
        passage: &Passage,
        correction: &Jet<S>,
    ) -> Result<(), ExpansionError> {
        let at_zero_depth = coefficient_of_depth_power(correction, 0, self.depth.space());
        let displacement = largest(&at_zero_depth);
        let scale = largest(correction).max(1.0);
        if displacement.is_nan() || displacement > 1e6 * S::ROUNDOFF * scale {
            let surface = passage.surface.clone();
            return Err(ExpansionError::ResetNotIdentityAtTangency {
                surface,
                displacement,
            });
        }
        Ok(())
    }
}

impl<S: Real> Impact<S> {
    /// Along the free flow to `h' = 0`: the image on a tangency section.
    fn project_to_tangency(&self, passage: &Passage) -> Result<Vec<Jet<S>>, ExpansionError> {
        let series = self.series(passage);
        let time = time_of_minimum(series.watched(0), &Jet::zero(&self.space))?;
        Ok(self.states_at(&series, &time))
    }

    /// Back along the free flow by the time since the section point: the image at zero net time.
    fn back_to_zero_time(&self, passage: &Passage) -> Result<Vec<Jet<S>>, ExpansionError> {
        Ok(self.states_at(&self.series(passage), &-&self.time))
    }

    fn series(&self, passage: &Passage) -> LocalSeries<S> {
        let parameters = passage.parameter_jets(&self.space, self.first_parameter);
        local_series(
            &passage.field,
            &self.state,
            &parameters,
            self.space.order().max(2),
        )
    }

    fn states_at(&self, series: &LocalSeries<S>, time: &Jet<S>) -> Vec<Jet<S>> {
        (0..self.state.len())
            .map(|component| at_series_time(series.state(component), time))
            .collect()
    }
}

/// Time from a state to its minimum of the gap, and the series of the free flow about that minimum.
fn series_about_minimum<S: Real>(
    passage: &Passage,
    start: &[Jet<S>],
    parameters: &[Jet<S>],
    order: usize,
) -> Result<(Jet<S>, LocalSeries<S>), ExpansionError> {
    let order = order.max(2);
    let series = local_series(&passage.field, start, parameters, order);
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
    Ok((
        time,
        local_series(&passage.field, &minimum, parameters, order),
    ))
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

fn largest<S: Real>(jet: &Jet<S>) -> f64 {
    jet.coefficients()
        .iter()
        .map(|value| value.magnitude())
        .fold(0.0, f64::max)
}
