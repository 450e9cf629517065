//! The discontinuity mapping, as jets in `(y; coordinates; parameters)`.
//!
//! With the depth variable `y² = −h_min` every step of a grazing passage is analytic. The passage
//! is followed in the order of events, each step a jet: to the minimum of the gap, back by `y σ` to
//! the surface, through the reset or the contact, and along the free flow to the section. No
//! formula of a paper is coded. Derivation: docs/mathematics/discontinuity.md and
//! docs/mathematics/contact-laws.md (after Nordmark 1991 and di Bernardo et al. 2008).
//!
//! The speed at which the surface is met follows from the same series.

use std::sync::Arc;

use super::approach::{Approach, DepthVariable, kept_to_minimum, time_of_minimum};
use super::error::ExpansionError;
use super::local_map::{Contact, DepthForm};
use super::passage::{ContactLaw, Passage};
use super::power_law::PowerFlight;
use super::release::ReleaseBalance;
use super::routes::Graze;
use super::variables::{Variables, coefficient_of_depth_power, fold_depth_powers, respace};
use crate::flow::{Field, Program, evaluate, local_series_kept_to};
use crate::jet::{Jet, JetSpace};
use crate::numeric::Real;
use crate::orbit::PoincareSectionKind;

/// Expands the discontinuity mapping on a section to the weight `weight`.
///
/// The result is canonical: image = coordinates + `y · linear` + `y² · quadratic`, with `linear` to
/// weight `weight − 1`, `quadratic` to `weight − 2` and `depth = −h_min` to `weight + 1`. Each
/// contributes an error of weight `weight + 1`.
///
/// # Errors
///
/// [`ExpansionError`] if the graze is not simple, the reset is not the identity at zero normal
/// velocity, the contact law has no expansion in powers of `y`
/// ([`ContactLawError`](super::ContactLawError)), or a jet space would be too large.
pub fn discontinuity<S: Real>(graze: &Graze, weight: u32) -> Result<Contact<S>, ExpansionError> {
    let through = Through::of(graze)?;
    let kept = weight + through.lost_weights();
    let approach = Approach::<S>::new(graze, kept, DepthVariable::Replacing)?;
    let image = approach.image(graze, &through)?;
    approach.canonical(graze, weight, &image)
}

impl<S: Real> Approach<S> {
    /// Image of the section point, at zero net time or on the tangency section.
    pub(super) fn image(
        &self,
        graze: &Graze,
        through: &Through<'_>,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let Graze { passage, chart, .. } = graze;
        let parameters = passage.parameter_jets(&self.space, self.first_parameter);
        let (state, time) = self.departure(&parameters, through)?;
        let kept = kept_to_minimum(self.space.order());
        let series = local_series_kept_to(&passage.field, &state, &parameters, kept);
        let to_section = match chart.section.kind {
            PoincareSectionKind::Tangency => {
                time_of_minimum(series.watched(0), &Jet::zero(&self.space))?
            }
            PoincareSectionKind::Stroboscopic { .. } => -&time,
        };
        Ok(series.state_at(&to_section))
    }

    /// State just after the contact (the reset of a rigid stop, or the contact field up to the
    /// release) and the time from the section point, as jets in `(y; coordinates; parameters)`.
    fn departure(
        &self,
        parameters: &[Jet<S>],
        through: &Through<'_>,
    ) -> Result<(Vec<Jet<S>>, Jet<S>), ExpansionError> {
        let entry = self.entry()?;
        Ok(match through {
            Through::Contact { field, release } => {
                let (state, contact_time) = release.exit(field, &entry.state, parameters)?;
                (state, &entry.time + &contact_time)
            }
            Through::Powers(flight) => {
                let (state, contact_time) = flight.exit(&entry.state, parameters)?;
                (state, &entry.time + &contact_time)
            }
            Through::Reset(reset) => {
                let inputs: Vec<_> = entry.state.iter().chain(parameters).cloned().collect();
                (evaluate(reset, &self.space, &inputs), entry.time)
            }
        })
    }

    /// Canonical form: subtracts the identity, orders by powers of `y`, and replaces powers of `y`
    /// above the second by `y² = depth`.
    fn canonical(
        &self,
        graze: &Graze,
        weight: u32,
        image: &[Jet<S>],
    ) -> Result<Contact<S>, ExpansionError> {
        let variables = &graze.variables;
        let linear_space = variables.smooth_space(weight.saturating_sub(1))?;
        let quadratic_space = variables.smooth_space(weight.saturating_sub(2))?;
        let (mut linear, mut quadratic) = (Vec::new(), Vec::new());
        let mut corrections = Vec::new();
        for &component in &graze.chart.section.coordinates {
            let correction = &image[component] - &self.start[component];
            self.check_identity_at_zero_depth(&graze.passage, &image[component], &correction)?;
            let fold = |first: u8, space: &Arc<JetSpace>| {
                fold_depth_powers(&correction, first, weight, &self.depth, space)
            };
            linear.push(fold(1, &linear_space));
            quadratic.push(fold(2, &quadratic_space));
            corrections.push(correction.truncate(weight as usize));
        }
        let form = |replaced| Arc::new(DepthForm { replaced, corrections });
        Ok(Contact {
            depth: self.depth_to(variables, weight)?,
            linear,
            quadratic,
            depth_form: self.replaced.map(form),
        })
    }

    /// Depth `−h_min` to the weight `weight + 1`.
    fn depth_to(&self, variables: &Variables, weight: u32) -> Result<Jet<S>, ExpansionError> {
        if self.space.order() == weight as usize {
            return Ok(self.depth.clone());
        }
        Ok(respace(&self.depth, &variables.smooth_space(weight + 1)?))
    }

    fn check_identity_at_zero_depth(
        &self,
        passage: &Passage,
        image: &Jet<S>,
        correction: &Jet<S>,
    ) -> Result<(), ExpansionError> {
        let at_zero_depth = coefficient_of_depth_power(correction, 0, self.depth.space());
        let displacement = largest(&at_zero_depth);
        // The image contains the state itself, whose size determines the rounding.
        let scale = largest(image).max(1.0);
        if displacement.is_nan() || displacement > 1e6 * S::ROUNDOFF * scale {
            let surface = passage.surface.clone();
            return Err(ExpansionError::ResetNotIdentityAtTangency { surface, displacement });
        }
        Ok(())
    }
}

fn largest<S: Real>(jet: &Jet<S>) -> f64 {
    jet.coefficients().iter().map(|value| value.magnitude()).fold(0.0, f64::max)
}

/// Contact of a passage with its surface.
pub(super) enum Through<'a> {
    /// A rigid stop, with its reset.
    Reset(&'a Program),
    /// A compliant stop: the contact field, and its release.
    Contact { field: &'a Field, release: ReleaseBalance },
    /// A compliant stop with powers of the penetration.
    Powers(PowerFlight<'a>),
}

impl<'a> Through<'a> {
    /// Contact of a passage with its surface, by the surface's law.
    ///
    /// # Errors
    ///
    /// [`ContactLawError`](super::ContactLawError) if a contact has no release near the graze.
    pub(super) fn of(graze: &'a Graze) -> Result<Self, ExpansionError> {
        Ok(match &graze.passage.law {
            ContactLaw::Rigid { reset } => Self::Reset(reset),
            ContactLaw::Compliant { field, .. } => {
                Self::Contact { field, release: ReleaseBalance::new(graze, field)? }
            }
            ContactLaw::Powers(law) => Self::Powers(PowerFlight::new(graze, law)?),
        })
    }

    /// Number of weights by which the image is less exact than the state on the surface.
    pub(super) fn lost_weights(&self) -> u32 {
        match self {
            Self::Reset(_) | Self::Powers(_) => 0,
            Self::Contact { release, .. } => release.lost_weights(),
        }
    }
}

/// Speed at which the surface is met, `−h'` at the entry, as `y · linear + y² · quadratic`.
#[derive(Clone, Debug)]
pub struct ImpactSpeed {
    /// Coefficient of `y`.
    pub linear: Jet<f64>,
    /// Coefficient of `y²`.
    pub quadratic: Jet<f64>,
}

impl ImpactSpeed {
    /// Speed of a contact with depth variable `y` at a point (coordinates; parameters).
    pub fn at(&self, y: f64, point: &[f64]) -> f64 {
        y * (self.linear.evaluate(point) + y * self.quadratic.evaluate(point))
    }
}

/// Expands the speed at which the surface is met to the weight `weight`:
///
/// ```text
/// −h'(t_e) = −Σ_{k≥2} k H_k (−yσ)^{k−1} = √(2h'') y + …
/// ```
///
/// # Errors
///
/// As [`discontinuity`](discontinuity()).
pub fn impact_speed(graze: &Graze, weight: u32) -> Result<ImpactSpeed, ExpansionError> {
    let approach = Approach::<f64>::new(graze, weight, DepthVariable::Replacing)?;
    let y = approach.depth_variable();
    let since_minimum = -&(&y * &approach.entry_time_over_depth(&y)?);
    let falling = approach.gap.iter().enumerate().skip(1).rev();
    let speed = falling.fold(Jet::zero(&approach.space), |sum, (power, coefficient)| {
        &(&sum * &since_minimum) - &coefficient.scale(power as f64)
    });
    let fold = |first: u8, weight_left: u32| {
        let space = graze.variables.smooth_space(weight_left)?;
        Ok::<_, ExpansionError>(fold_depth_powers(&speed, first, weight, &approach.depth, &space))
    };
    Ok(ImpactSpeed {
        linear: fold(1, weight.saturating_sub(1))?,
        quadratic: fold(2, weight.saturating_sub(2))?,
    })
}
