//! The discontinuity mapping, as jets in `(y; coordinates; parameters)`.
//!
//! With the depth variable `y² = −h_min` every step of a grazing passage is analytic. The passage
//! is followed in the order of events, each step a jet: to the minimum of the gap, back by `y σ` to
//! the surface, through the reset or the contact, and along the free flow to the section. No
//! formula of a paper is coded. Derivation: docs/mathematics/discontinuity.md and
//! docs/mathematics/contact-laws.md (after Nordmark 1991 and di Bernardo et al. 2008).
//!
//! The speed at which the surface is met follows from the same series.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::approach::{Approach, DepthVariable, kept_to_minimum, time_of_minimum};
use super::error::{ContactLawError, ExpansionError};
use super::local_map::{Contact, DepthForm};
use super::passage::{ContactLaw, Passage};
use super::power_law::{PowerCorrections, PowerFlight, PowerTerm, exponent_of};
use super::release::ReleaseBalance;
use super::routes::Graze;
use super::variables::{Variables, fold_depth_powers, respace};
use crate::flow::{Field, Program, evaluate, local_series_kept_to};
use crate::jet::{Jet, JetSpace};
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

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
    approach.canonical(graze, weight, &image, through.own_variables())
}

impl<S: Real> Approach<S> {
    /// Image of the section point, at zero net time or on the tangency section: jets in
    /// `(y; coordinates; parameters)`, and after them the powers of `y` that are variables of their
    /// own.
    pub(super) fn image(
        &self,
        graze: &Graze,
        through: &Through<'_>,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let Graze { passage, chart, .. } = graze;
        let (state, time) = self.departure(passage, through)?;
        let space = time.space();
        let parameters = passage.parameter_jets(space, self.first_parameter);
        let kept = kept_to_minimum(space.order(), space.weights()[0] as usize);
        let series = local_series_kept_to(&passage.field, &state, &parameters, kept);
        let to_section = match chart.section.kind {
            PoincareSectionKind::Tangency => time_of_minimum(series.watched(0), &Jet::zero(space))?,
            PoincareSectionKind::Stroboscopic { .. } => -&time,
        };
        Ok(series.state_at(&to_section))
    }

    /// State just after the contact (the reset of a rigid stop, or the contact field up to the
    /// release) and the time from the section point, as jets in `(y; coordinates; parameters)` and
    /// the variables of the contact.
    fn departure(
        &self,
        passage: &Passage,
        through: &Through<'_>,
    ) -> Result<(Vec<Jet<S>>, Jet<S>), ExpansionError> {
        let entry = self.entry()?;
        let parameters = &passage.parameter_jets(&self.space, self.first_parameter);
        Ok(match through {
            Through::Contact { field, release } => {
                let (state, contact_time) = release.exit(field, &entry.state, parameters)?;
                (state, &entry.time + &contact_time)
            }
            Through::Powers(flight) => {
                let space = flight.space(&self.space)?;
                let state: Vec<_> = entry.state.iter().map(|jet| widened(jet, &space)).collect();
                let parameters = passage.parameter_jets(&space, self.first_parameter);
                let (state, contact_time) = flight.exit(&state, &parameters)?;
                (state, &widened(&entry.time, &space) + &contact_time)
            }
            Through::Reset(reset) => {
                let inputs: Vec<_> = entry.state.iter().chain(parameters).cloned().collect();
                (evaluate(reset, &self.space, &inputs), entry.time)
            }
        })
    }

    /// Correction of every coordinate of the section, in the space of the image.
    pub(super) fn corrections(&self, graze: &Graze, image: &[Jet<S>]) -> Vec<Jet<S>> {
        let correction = |&component: &usize| {
            let image = &image[component];
            image - &widened(&self.start[component], image.space())
        };
        graze.chart.section.coordinates.iter().map(correction).collect()
    }

    /// Canonical form: subtracts the identity, orders by powers of `y`, and replaces powers of `y`
    /// above the second by `y² = depth`; `exponents` are those of the variables of the contact.
    fn canonical(
        &self,
        graze: &Graze,
        weight: u32,
        image: &[Jet<S>],
        exponents: Vec<Dd>,
    ) -> Result<Contact<S>, ExpansionError> {
        let variables = &graze.variables;
        let linear_space = variables.smooth_space(weight.saturating_sub(1))?;
        let quadratic_space = variables.smooth_space(weight.saturating_sub(2))?;
        let (mut linear, mut quadratic) = (Vec::new(), Vec::new());
        let (whole, mut corrections) = (self.corrections(graze, image), Vec::new());
        for (&component, correction) in graze.chart.section.coordinates.iter().zip(&whole) {
            self.check_identity_at_zero_depth(&graze.passage, &image[component], correction)?;
            let correction = narrowed(correction, &self.space, &[]);
            let fold = |first: u8, space: &Arc<JetSpace>| {
                fold_depth_powers(&correction, first, weight, &self.depth, space)
            };
            linear.push(fold(1, &linear_space));
            quadratic.push(fold(2, &quadratic_space));
            corrections.push(correction.truncate(weight as usize));
        }
        let powers = self.powers(&graze.variables, weight, &whole, exponents)?;
        let replaced = self.replaced.filter(|_| powers.is_empty());
        let form = |replaced| Arc::new(DepthForm { replaced, corrections });
        Ok(Contact {
            depth: self.depth_to(variables, weight)?,
            linear,
            quadratic,
            powers,
            depth_form: replaced.map(form),
        })
    }

    /// Terms of the canonical form with powers of the variables of the contact.
    fn powers(
        &self,
        variables: &Variables,
        weight: u32,
        corrections: &[Jet<S>],
        exponents: Vec<Dd>,
    ) -> Result<PowerCorrections<S>, ExpansionError> {
        let mut found = BTreeSet::new();
        for correction in corrections {
            let terms = correction.terms().filter(|(_, value)| *value != S::zero());
            found.extend(terms.map(|(powers, _)| powers[self.space.variables()..].to_vec()));
        }
        let mut terms = Vec::new();
        for powers in found.into_iter().filter(|powers| powers.iter().any(|&power| power > 0)) {
            let mut term = PowerTerm { powers, linear: Vec::new(), quadratic: Vec::new() };
            let left = f64::from(weight) - exponent_of(&term.powers, &exponents);
            for (first, jets) in [(1, &mut term.linear), (2, &mut term.quadratic)] {
                let left = left - f64::from(first);
                let space = variables.smooth_space(left.max(0.0) as u32)?;
                jets.extend(corrections.iter().map(|correction| match left >= 0.0 {
                    true => {
                        let part = narrowed(correction, &self.space, &term.powers);
                        fold_depth_powers(&part, first, weight, &self.depth, &space)
                    }
                    false => Jet::zero(&space),
                }));
            }
            terms.push(term);
        }
        Ok(PowerCorrections { exponents, terms })
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
        let at_zero_depth = correction.terms().filter(|(powers, _)| powers[0] == 0);
        let displacement = at_zero_depth.map(|(_, value)| value.magnitude()).fold(0.0, f64::max);
        // The image contains the state itself, whose size determines the rounding.
        let scale = largest(image).max(1.0);
        if displacement.is_nan() || displacement > 1e6 * S::ROUNDOFF * scale {
            let surface = passage.surface.clone();
            return Err(ExpansionError::ResetNotIdentityAtTangency { surface, displacement });
        }
        Ok(())
    }
}

/// A jet in `(y; coordinates; parameters)` with further variables, in a space that has them last.
fn widened<S: Real>(jet: &Jet<S>, space: &Arc<JetSpace>) -> Jet<S> {
    let same: Vec<_> = (0..jet.space().variables()).map(Some).collect();
    if jet.is_in(space) { jet.clone() } else { jet.reinterpret(space, &same) }
}

/// Coefficient of a product of powers of the last variables of a jet, in a space without them; no
/// powers stand for the zeroth.
fn narrowed<S: Real>(jet: &Jet<S>, space: &Arc<JetSpace>, powers: &[u8]) -> Jet<S> {
    let mut narrow = Jet::zero(space);
    for (exponents, value) in jet.terms() {
        let (own, last) = exponents.split_at(space.variables());
        let mut wanted = powers.iter().chain(std::iter::repeat(&0));
        if last.iter().all(|power| Some(power) == wanted.next())
            && let Some(monomial) = space.monomial(own)
        {
            narrow.coefficients_mut()[monomial] = value;
        }
    }
    narrow
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

    /// Exponents of `y` in the powers that are variables of their own, the last of the image.
    pub(super) fn own_variables(&self) -> Vec<Dd> {
        match self {
            Self::Reset(_) | Self::Contact { .. } => Vec::new(),
            Self::Powers(flight) => flight.own_variables(),
        }
    }

    /// Number of weights by which the image is less exact than the state on the surface.
    pub(super) fn lost_weights(&self) -> u32 {
        match self {
            Self::Reset(_) | Self::Powers(_) => 0,
            Self::Contact { release, .. } => release.lost_weights(),
        }
    }
}

/// Whether a contact of an orbit has no release near its graze: its field does not push back, or
/// its release function has no root there. `false` where the law has no expansion for any other
/// reason.
pub fn lacks_release(scene: &Scene, orbit: &GrazingOrbit) -> bool {
    (0..orbit.passages.len()).any(|number| {
        let graze = Graze::new(scene, orbit, number);
        let through = graze.as_ref().ok().map(Through::of);
        matches!(
            through,
            Some(Err(ExpansionError::ContactLaw(
                ContactLawError::Acceleration { .. } | ContactLawError::NoRelease { .. }
            )))
        )
    })
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
