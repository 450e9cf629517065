//! The section map by direct simulation, in offsets.

use super::error::AnalysisError;
use super::section_frame::{SectionFrame, phase_circle};
use crate::flow::Field;
use crate::hybrid::{DirectReturn, HybridSystem, Outcome, ReturnOutcome};
use crate::iteration::PhaseCircle;
use crate::model::{Model, Response, Scene, Section, Surface};
use crate::numeric::{Dd, Real, Scalar as _};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// The image of a section point by direct simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionImage<S> {
    /// Offsets of the image, the nominal advance of the phase and whole periods removed; NaN where
    /// there is no image.
    pub offsets: Vec<S>,
    /// Whole periods removed from the phase beyond the nominal advance.
    pub turns: i32,
    /// Speed at which each passage met its surface, in the order in which they follow the section;
    /// `None` without contact.
    pub passages: Vec<Option<S>>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Contacts beyond one per passage, and those at surfaces that do not graze.
    pub extra_contacts: usize,
    /// All contacts per surface of the model.
    pub hits: Vec<usize>,
    /// Speed of the first contact; 0 without one.
    pub impact_speed: S,
    /// How it ended.
    pub end: DirectEnd,
}

/// How one direct return ended.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DirectEnd {
    /// At the section.
    Returned,
    /// No section point within sixteen nominal return times.
    NoReturn,
    /// The start is beyond a rigid surface, and no free flight leads there from it.
    Penetrating,
    /// The section falls inside a contact that its coordinates do not tell.
    Ambiguous,
    /// Two surfaces hold the state at once, and no field of the model stands for both.
    HeldTwice,
    /// Two rigid surfaces are met at the same instant, and the state behind depends on which of
    /// them acts first.
    HitTogether {
        /// The surfaces.
        surfaces: [usize; 2],
        /// Time since the section.
        time: f64,
    },
    /// The simulation ended otherwise: a state that is not finite, no sticking field, too many
    /// steps.
    Ended,
}

impl DirectEnd {
    /// Why there is no image, in words for the user of a scene.
    pub fn reason(&self, scene: &Scene) -> String {
        let tangency = scene.section == Section::Tangency;
        let rigid = |surface: &Surface| matches!(surface.response, Response::Impact { .. });
        let reason = match *self {
            Self::Returned => "it is not finite",
            Self::NoReturn => "no section point within sixteen return times",
            Self::Penetrating => "it is beyond the surface, and no free flight leads there",
            Self::Ambiguous if tangency => {
                "another surface holds the state where the section is reached, and the \
                 coordinates of a tangency section do not tell which; a section of \
                 `kind = \"stroboscopic\"` at a phase between the contacts does"
            }
            Self::Ambiguous if scene.model.surfaces.iter().all(rigid) => {
                "the coordinates of its section do not tell whether an impact lies before or \
                 behind it; choose another `section.phase`, at which nothing is hit"
            }
            Self::Ambiguous => {
                "its section falls inside a contact that the coordinates do not tell; choose \
                 another `section.phase`, at which nothing is in contact"
            }
            Self::HeldTwice => {
                "two surfaces hold the state at once, and the model has no field for both"
            }
            Self::HitTogether { surfaces, time } => {
                return format!(
                    "{}, {time} after the section",
                    hit_together(&scene.model, surfaces)
                );
            }
            Self::Ended => "the simulation ended before the section",
        };
        reason.to_owned()
    }
}

/// Two surfaces hit at the same instant, in words.
pub(super) fn hit_together(model: &Model, surfaces: [usize; 2]) -> String {
    let [a, b] = surfaces.map(|surface| &model.surfaces[surface].name);
    format!(
        "surfaces `{a}` and `{b}` are hit at the same instant, and the state after depends on \
         which of them acts first"
    )
}

/// The section map of a scene by direct simulation, over `f64` or double-double.
///
/// The map is `P = P_smooth ∘ D` with the contact as it is: a section point beyond the surface is
/// taken back along the free flow to the surface and goes through the contact and all that follows;
/// the last approach to the section is flown with the surface ignored.
#[derive(Clone, Debug)]
pub struct DirectImage<'a, S: Real> {
    system: &'a HybridSystem,
    frame: SectionFrame<S>,
    circle: PhaseCircle<S>,
    returns: DirectReturn<'a, S>,
    /// Most steps of an image.
    limit: usize,
}

/// Most products of series in `f64` that an image forms: 2 to 5 s.
const MOST_PRODUCTS: usize = 13_000_000;

/// What a product of series in double-double costs beside one in `f64`.
const IN_DOUBLE_DOUBLE: usize = 20;

/// Products of series in a Taylor step of the free flow of a scene.
pub(crate) fn products_of_step(scene: &Scene) -> usize {
    Field::free(&scene.model, &[]).time_program().products().max(1)
}

impl<'a, S: Real> DirectImage<'a, S> {
    /// The map of a scene about its grazing orbit; `system` is the scene's model, lowered.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
    pub fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, AnalysisError> {
        let precise = S::ROUNDOFF <= Dd::ROUNDOFF;
        let most = if precise { MOST_PRODUCTS / IN_DOUBLE_DOUBLE } else { MOST_PRODUCTS };
        let circle = phase_circle(scene, orbit);
        let limit = most / products_of_step(scene);
        Self::in_frame(system, (SectionFrame::new(scene, orbit), circle), limit)
    }

    /// So many returns as one, from a section point straight to the last: none is needed between
    /// them. The passages are those of the first return, then of the next.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub(super) fn over(&self, returns: usize) -> Result<Self, AnalysisError> {
        let limit = self.limit.saturating_mul(returns);
        Self::in_frame(self.system, (self.frame.clone().over(returns), self.circle), limit)
    }

    fn in_frame(
        system: &'a HybridSystem,
        (mut frame, circle): (SectionFrame<S>, PhaseCircle<S>),
        limit: usize,
    ) -> Result<Self, AnalysisError> {
        let (section, duration) = (frame.return_section(), frame.duration());
        let mut returns =
            DirectReturn::new(system, frame.parameters(), section, duration, frame.periods())?
                .with_passages(&frame.nominal_passages(duration))?;
        returns.set_step_limit(limit);
        Ok(Self { system, circle, frame, returns, limit })
    }

    /// Limits the steps of an image; a point that needs more has none. As many as take some
    /// seconds are the default.
    pub fn set_step_limit(&mut self, limit: usize) {
        self.limit = limit;
        self.returns.set_step_limit(limit);
    }

    /// Steps that the last image took.
    pub fn steps(&self) -> usize {
        self.returns.steps()
    }

    /// The frame and the return map at fixed parameters.
    pub(super) fn at(
        &self,
        parameters: &[S],
    ) -> Result<(SectionFrame<S>, DirectReturn<'a, S>), AnalysisError> {
        let (mut frame, mut returns) = (self.frame.clone(), self.returns.clone());
        let origin = vec![S::zero(); frame.dimension()];
        frame.place(&origin, parameters)?;
        let duration = frame.duration();
        returns.set_parameters(frame.parameters(), duration)?;
        Ok((frame, returns))
    }

    /// Whether images may be computed in lanes.
    pub(super) fn fits_lanes(&self) -> bool {
        self.returns.fits_lanes()
    }

    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.frame.dimension()
    }

    /// Number of active parameters.
    pub fn parameters(&self) -> usize {
        self.frame.active()
    }

    /// The places in [`GrazingOrbit::passages`] of the passages of one return.
    pub(super) fn passage_places(&self) -> Vec<usize> {
        self.frame.passage_places()
    }

    /// The gap at the first passage of a section point along the free flow, `−y²` of a contact: on
    /// a tangency section at the point itself. NaN where there is no such passage.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`]; [`AnalysisError::Hybrid`] if an offset is not finite.
    pub(super) fn gap(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<S, AnalysisError> {
        self.frame.place(offsets, parameter_offsets)?;
        if self.frame.kind() == PoincareSectionKind::Tangency {
            return Ok(self.frame.gap());
        }
        let duration = self.frame.duration();
        self.returns.set_parameters(self.frame.parameters(), duration)?;
        let gap = self.returns.first_gap(self.frame.state())?;
        Ok(gap.unwrap_or(S::from_f64(f64::NAN)))
    }

    /// The phase among the coordinates, where it is one.
    pub fn circle(&self) -> PhaseCircle<S> {
        self.circle
    }

    /// The image of a section point, everything in offsets, with the whole periods that its phase
    /// took: it depends continuously on the point, and is that of a polynomial map.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    pub fn lifted_image(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<SectionImage<S>, AnalysisError> {
        let mut image = self.image(offsets, parameter_offsets)?;
        self.circle.lift(&mut image.offsets, image.turns);
        image.turns = 0;
        Ok(image)
    }

    /// The image of a section point, everything in offsets, the phase within half a period of 0.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`]; [`AnalysisError::Hybrid`] if an offset is not finite.
    pub fn image(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<SectionImage<S>, AnalysisError> {
        self.frame.place(offsets, parameter_offsets)?;
        let duration = self.frame.duration();
        self.returns.set_parameters(self.frame.parameters(), duration)?;
        let image = self.returns.image(self.frame.state())?;
        let end = end_of(&image.outcome);
        let mut offsets = match end {
            DirectEnd::Returned => self.frame.offsets(&image.state),
            _ => vec![S::from_f64(f64::NAN); self.frame.dimension()],
        };
        let turns = self.circle.reduce(&mut offsets);
        Ok(SectionImage {
            offsets,
            turns,
            impact_speed: image.impact_speeds.first().copied().unwrap_or(S::zero()),
            passages: image.passages,
            contacts: image.contacts,
            extra_contacts: image.extra_contacts,
            hits: image.hits,
            end,
        })
    }
}

/// One image of a section point by direct simulation: [`DirectImage`] for a single use.
///
/// # Errors
///
/// As [`DirectImage::new`] and [`DirectImage::image`].
pub fn direct_image<S: Real>(
    scene: &Scene,
    orbit: &GrazingOrbit,
    offsets: &[S],
    parameter_offsets: &[S],
) -> Result<SectionImage<S>, AnalysisError> {
    let system = HybridSystem::new(&scene.model);
    DirectImage::new(&system, scene, orbit)?.image(offsets, parameter_offsets)
}

fn end_of<S: Real>(outcome: &ReturnOutcome<S>) -> DirectEnd {
    match outcome {
        ReturnOutcome::Returned => DirectEnd::Returned,
        ReturnOutcome::NoReturn { .. } => DirectEnd::NoReturn,
        ReturnOutcome::Ambiguous { .. } => DirectEnd::Ambiguous,
        ReturnOutcome::Ended(Outcome::Penetrating { .. }) => DirectEnd::Penetrating,
        ReturnOutcome::Ended(Outcome::HeldTwice { .. }) => DirectEnd::HeldTwice,
        ReturnOutcome::Ended(Outcome::HitTogether { surfaces, time }) => {
            DirectEnd::HitTogether { surfaces: *surfaces, time: time.to_f64() }
        }
        ReturnOutcome::Ended(_) => DirectEnd::Ended,
    }
}
