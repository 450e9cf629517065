//! The discontinuity mapping, as jets in `(y; coordinates; parameters)`.
//!
//! One idea: with the depth variable `y² = −h_min` every step of a grazing passage is analytic. The
//! passage is followed as it happens, each step a jet: down to the minimum of the gap, back by `y
//! σ` to the surface, through the reset or the contact, and on to the section. No formula of a
//! paper is coded. Derivation: docs/mathematics/discontinuity.md and
//! docs/mathematics/contact-laws.md (after Nordmark 1991 and di Bernardo et al. 2008).

use std::sync::Arc;

use super::approach::{Approach, DepthVariable};
use super::departure::Through;
use super::passage::Passage;
use super::section_chart::SectionChart;
use super::variables::{Variables, coefficient_of_depth_power, fold_depth_powers, respace};
use super::{Contact, DepthForm, ExpansionError};
use crate::jet::Jet;
use crate::numeric::Real;
use crate::orbit::PoincareSectionKind;

/// Expands the discontinuity mapping on a section to the weighted degree `weight`.
///
/// The result is canonical: image = coordinates + `y · linear` + `y² · quadratic`, with `linear` to
/// weight `weight − 1`, `quadratic` to `weight − 2` and `depth = −h_min` to `weight + 1`, so that
/// each contributes an error of weight `weight + 1`.
///
/// # Errors
///
/// [`ExpansionError`] if the graze is not simple, the reset is no identity at zero normal velocity,
/// the contact law has no expansion in powers of `y` ([`ContactLawError`](super::ContactLawError)),
/// or a jet space would be too large.
pub fn discontinuity<S: Real>(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    weight: u32,
) -> Result<Contact<S>, ExpansionError> {
    let through = Through::of(passage, chart, variables)?;
    let kept = weight + through.lost_weights();
    let kind = DepthVariable::Replacing;
    let approach = Approach::<S>::new(passage, chart, variables, kept, kind)?;
    let image = approach.image(passage, chart, &through)?;
    approach.canonical(passage, chart, variables, weight, &image)
}

impl<S: Real> Approach<S> {
    /// The image of the section point: at zero net time, or on the tangency section.
    pub(super) fn image(
        &self,
        passage: &Passage,
        chart: &SectionChart,
        through: &Through<'_>,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let departure = self.departure(passage, through)?;
        match chart.section.kind {
            PoincareSectionKind::Tangency => departure.project_to_tangency(passage),
            PoincareSectionKind::Stroboscopic { .. } => departure.back_to_zero_time(passage),
        }
    }

    /// Takes the identity off, orders by powers of `y`, and replaces `y²` beyond the first by the
    /// depth.
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
        let mut corrections = Vec::new();
        for &component in &chart.section.coordinates {
            let correction = &image[component] - &self.start[component];
            self.check_identity_at_zero_depth(passage, &image[component], &correction)?;
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
            corrections.push(correction.truncate(weight as usize));
        }
        let form = |replaced| {
            Arc::new(DepthForm {
                replaced,
                corrections,
            })
        };
        Ok(Contact {
            depth: self.depth_to(variables, weight)?,
            linear,
            quadratic,
            depth_form: self.replaced.map(form),
        })
    }

    /// `−h_min` to the weight `weight + 1`.
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
        // The state itself is in the image: its size is what was rounded.
        let scale = largest(image).max(1.0);
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

fn largest<S: Real>(jet: &Jet<S>) -> f64 {
    jet.coefficients()
        .iter()
        .map(|value| value.magnitude())
        .fold(0.0, f64::max)
}
