//! The approach to a surface: the free flow about the minimum of the gap, as series in the time
//! from it, in variables in which `y²` replaces a coordinate.
//!
//! The gap at the minimum is `−y²`, so the surface was met at `t_e = t_min − y σ` with an analytic
//! `σ`. Derivation: docs/mathematics/discontinuity.md.
//!
//! The relation `y² = u(c, p)`, `u = −h_min`, makes one of the variables `(y; c, p)` redundant, and
//! every product more expensive. It matters more where a step of a passage divides by `y`: `y² − u`
//! vanishes, but not as a polynomial. Solving the relation for one coordinate,
//! `c_j = c_j(y²; c', p)`, leaves independent variables.

use std::sync::Arc;

use super::error::ExpansionError;
use super::routes::Graze;
use super::variables::{Variables, lift};
use crate::flow::{Field, LocalSeries, at_series_time, local_series_kept_to};
use crate::jet::{Jet, JetSpace, implicit_root, power_series_at, power_series_with_slope_at};
use crate::numeric::Real;

/// Role of the depth variable `y` among the variables of an expansion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthVariable {
    /// Variable `y` is added: for expansions that do not use its relation to the others.
    Added,
    /// Variable `y` replaces a coordinate, which becomes the jet that makes `−h_min` equal to `y²`.
    /// Variables are fewer and independent, so that a contact time can be found by dividing by `y`.
    Replacing,
}

/// The free flow about the minimum of the gap, as series in the time from the minimum.
pub(super) struct Approach<S: Real> {
    /// Space of `(y; coordinates; parameters)`.
    pub(super) space: Arc<JetSpace>,
    /// First variable of the parameters in `space`.
    pub(super) first_parameter: usize,
    /// Time from the section point to the minimum, in `space`.
    minimum_time: Jet<S>,
    /// Depth `−h_min`, without `y`.
    pub(super) depth: Jet<S>,
    /// Number of the coordinate that `y` replaces.
    pub(super) replaced: Option<usize>,
    /// State at the section point, in `space`.
    pub(super) start: Vec<Jet<S>>,
    /// Taylor coefficients, in the time from the minimum, of each state component, in `space`.
    states: Vec<Vec<Jet<S>>>,
    /// Taylor coefficients `H_k` of the gap, in `space`.
    pub(super) gap: Vec<Jet<S>>,
}

/// State on the surface, as jets in `(y; coordinates; parameters)`.
pub(super) struct SurfaceEntry<S: Real> {
    /// Full state.
    pub(super) state: Vec<Jet<S>>,
    /// Time from the section point.
    pub(super) time: Jet<S>,
}

impl<S: Real> Approach<S> {
    pub(super) fn new(
        graze: &Graze,
        weight: u32,
        kind: DepthVariable,
    ) -> Result<Self, ExpansionError> {
        let Graze { passage, chart, variables } = graze;
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

    /// Goes back from the minimum by `y σ` to the surface.
    pub(super) fn entry(&self) -> Result<SurfaceEntry<S>, ExpansionError> {
        let y = self.depth_variable();
        let since_minimum = -&(&y * &self.entry_time_over_depth(&y)?);
        let state = self
            .states
            .iter()
            .map(|coefficients| at_series_time(coefficients, &since_minimum))
            .collect();
        Ok(SurfaceEntry { state, time: &self.minimum_time + &since_minimum })
    }

    /// Solves for `σ` of the entry time `t_min − y σ`, from the gap at the entry divided by `y²`:
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

/// Order, in units of the weights' divisor, to which the coefficient of each power of the time from
/// the minimum is needed.
///
/// That time is of weight 1, and the gap is divided by its square: a coefficient of power `k` acts
/// from weight `k − 2` on, so power `weight + 1` still matters.
fn kept_about_minimum(weight: u32, divisor: u32, order: usize) -> Vec<usize> {
    let powers = 0..=(weight + 1).max(2);
    let needed = |power: u32| ((weight + 2).saturating_sub(power) / divisor) as usize;
    powers.map(|power| needed(power).min(order)).collect()
}

/// Order to which each coefficient of a series is needed if the series is summed at a root of its
/// derivative, a time of at least a given weight.
pub(super) fn kept_to_minimum(order: usize, weight: usize) -> Vec<usize> {
    let powers = 0..=(order / weight + 1).max(2);
    powers.map(|power| (order + weight).saturating_sub(power * weight).min(order)).collect()
}

/// Time from a state to the minimum of the gap, and the series of the free flow about that minimum,
/// with coefficients to given orders; the gap is the first function watched.
pub(super) fn series_about_minimum<S: Real>(
    field: &Field,
    start: &[Jet<S>],
    parameters: &[Jet<S>],
    kept: Vec<usize>,
) -> Result<(Jet<S>, LocalSeries<S>), ExpansionError> {
    let to_minimum = kept_to_minimum(start[0].space().order(), 1);
    let series = local_series_kept_to(field, start, parameters, to_minimum);
    let normal_acceleration = 2.0 * series.watched(0)[2].head().to_f64();
    if !(normal_acceleration > 0.0 && normal_acceleration.is_finite()) {
        return Err(ExpansionError::DegenerateGraze { normal_acceleration });
    }
    let time = time_of_minimum(series.watched(0), &Jet::zero(start[0].space()))?;
    let about = local_series_kept_to(field, &series.state_at(&time), parameters, kept);
    Ok((time, about))
}

/// Solves `h'(t) = Σ k h_k t^{k−1} = 0` for the time as a jet.
pub(super) fn time_of_minimum<S: Real>(
    gap: &[Jet<S>],
    start: &Jet<S>,
) -> Result<Jet<S>, ExpansionError> {
    let powers = gap.iter().enumerate().skip(1);
    let velocity: Vec<_> =
        powers.map(|(power, coefficient)| coefficient.scale(S::from_f64(power as f64))).collect();
    let root = implicit_root(start, |time| power_series_with_slope_at(&velocity, time))?;
    Ok(root)
}

/// Slopes of the depth along coordinates below this share of the largest count as zero, and below
/// this share of the largest along a parameter as rounding.
const NO_SLOPE: f64 = 1e-9;
const ROUNDED_SLOPE: f64 = 1e-20;

/// The variables (coordinates; parameters) as jets in `(y; c', p)`.
#[derive(Clone, Debug)]
pub(super) struct DepthChart<S: Real> {
    /// Space of `(y; coordinates; parameters)`, without a monomial in the replaced coordinate.
    pub(super) space: Arc<JetSpace>,
    /// Number of the replaced coordinate.
    pub(super) replaced: usize,
    /// Jet of the replaced coordinate.
    coordinate: Jet<S>,
}

impl<S: Real> DepthChart<S> {
    /// Solves `u = y²` for a coordinate, to a weight; `depth` is `u` in (coordinates; parameters).
    ///
    /// # Errors
    ///
    /// [`ExpansionError::DepthWithoutSlope`] if the depth does not depend on any coordinate at
    /// first order, [`ExpansionError::Jet`] if the space would be too large.
    pub(super) fn new(
        depth: &Jet<S>,
        variables: &Variables,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let replaced = steepest_coordinate(depth, variables)?;
        let mut others = variables.clone();
        // The replaced coordinate is made too heavy to have a monomial.
        others.weights[replaced] = weight + 1;
        let space = others.contact_space(weight)?;
        let powers = powers_of(replaced, depth, &space);
        let y = Jet::variable(&space, 0, S::zero());
        let square = &y * &y;
        let coordinate = implicit_root(&Jet::zero(&space), |coordinate| {
            let (depth, slope) = power_series_with_slope_at(&powers, coordinate);
            (&depth - &square, slope)
        })?;
        Ok(Self { space, replaced, coordinate })
    }

    /// Converts jets in (coordinates; parameters) to jets in `(y; c', p)`.
    pub(super) fn raise(&self, jets: &[Jet<S>]) -> Vec<Jet<S>> {
        let raised = |jet: &Jet<S>| {
            let powers = powers_of(self.replaced, jet, &self.space);
            power_series_at(&powers, &self.coordinate)
        };
        jets.iter().map(raised).collect()
    }

    /// Jets of the variables (coordinates; parameters).
    pub(super) fn variables(&self) -> Vec<Jet<S>> {
        let variable = |number: usize| match number == self.replaced {
            true => self.coordinate.clone(),
            false => Jet::variable(&self.space, 1 + number, S::zero()),
        };
        (0..self.space.variables() - 1).map(variable).collect()
    }
}

/// Coefficient of each power of a variable of a jet in (coordinates; parameters), in a space of
/// `(y; coordinates; parameters)`.
fn powers_of<S: Real>(variable: usize, jet: &Jet<S>, space: &Arc<JetSpace>) -> Vec<Jet<S>> {
    let mut powers = vec![Jet::zero(space)];
    let mut others = vec![0; space.variables()];
    for (exponents, value) in jet.terms().filter(|(_, value)| *value != S::zero()) {
        others[1..].copy_from_slice(exponents);
        let power = usize::from(std::mem::take(&mut others[1 + variable]));
        if powers.len() <= power {
            powers.resize_with(power + 1, || Jet::zero(space));
        }
        if let Some(monomial) = space.monomial(&others) {
            powers[power].coefficients_mut()[monomial] = value;
        }
    }
    powers
}

/// The coordinate to replace: among those of the lowest weight that the depth depends on, the
/// steepest.
///
/// # Errors
///
/// [`ExpansionError::DepthWithoutSlope`] if the depth depends on no coordinate.
pub(super) fn steepest_coordinate<S: Real>(
    depth: &Jet<S>,
    variables: &Variables,
) -> Result<usize, ExpansionError> {
    let slope = |coordinate: usize| {
        let monomial = depth.space().linear_monomial(coordinate);
        monomial.map_or(0.0, |monomial| depth.coefficients()[monomial].magnitude())
    };
    let largest = (0..variables.coordinates).map(slope).fold(0.0, f64::max);
    let by_parameters = (variables.coordinates..variables.weights.len()).map(slope);
    let rounding = ROUNDED_SLOPE * by_parameters.fold(0.0, f64::max);
    (0..variables.coordinates)
        .filter(|&coordinate| slope(coordinate) > (NO_SLOPE * largest).max(rounding))
        .min_by(|&a, &b| {
            let lighter = variables.weights[a].cmp(&variables.weights[b]);
            lighter.then(slope(b).total_cmp(&slope(a)))
        })
        .ok_or(ExpansionError::DepthWithoutSlope)
}
