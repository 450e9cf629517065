//! The section map by direct simulation, in offsets, with its derivatives.

use nalgebra::{Complex, DMatrix, DVector};

use super::error::AnalysisError;
use super::section_frame::{SectionFrame, phase_circle};
use crate::flow::Field;
use crate::hybrid::{DirectReturn, HybridSystem, Outcome, Return, ReturnOutcome, Variation};
use crate::iteration::PhaseCircle;
use crate::model::{Model, NodeId, Response, Scene, Section, Surface};
use crate::numeric::linear::{eigenvalues, solve};
use crate::numeric::{Dd, Real, Scalar as _, converted};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// The image of a section point by direct simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionImage<S> {
    /// Offsets of the image, the nominal advance of the phase and whole periods removed; NaN where
    /// there is no image.
    pub offsets: Vec<S>,
    /// Whole periods removed from the phase beyond the nominal advance.
    pub turns: i32,
    /// Time from the section point to the next.
    pub elapsed: S,
    /// Speed at which each passage met its surface, in the order in which they follow the section;
    /// `None` without contact.
    pub passages: Vec<Option<S>>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Contacts beyond one per passage, and contacts at surfaces that do not graze.
    pub extra_contacts: usize,
    /// Contacts at each surface of the model.
    pub hits: Vec<usize>,
    /// Speed of the first contact that is none of the hits of the grazing orbit; 0 without one.
    pub impact_speed: S,
    /// Largest share of an impact's speed with which the state still moves into a rigid surface
    /// after its reset, as for a restitution below zero; 0 if it never does.
    pub passed: S,
    /// End of the simulation.
    pub end: DirectEnd,
}

/// An equilibrium of the free flow.
#[derive(Clone, Debug)]
pub(super) struct Equilibrium {
    /// Offsets of the coordinates of the section.
    pub(super) offsets: Vec<f64>,
    /// Eigenvalues of the flow linearised there.
    pub(super) eigenvalues: Vec<Complex<f64>>,
}

/// End of one direct return.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DirectEnd {
    /// The section was reached.
    Returned,
    /// No section point within sixteen nominal return times.
    NoReturn,
    /// The start is beyond a rigid surface, and no free flight leads there from it.
    Penetrating,
    /// The reset of a rigid surface leaves the state moving into the surface.
    GoesThrough,
    /// The section falls inside a contact, which its coordinates do not determine.
    Ambiguous,
    /// Two surfaces hold the state at once, and the model has no field for both.
    HeldTwice,
    /// Two rigid surfaces are hit at the same instant, and the state after depends on which of them
    /// acts first.
    HitTogether {
        /// Indices of the surfaces.
        surfaces: [usize; 2],
        /// Time since the section.
        time: f64,
    },
    /// The simulation ended before the section: a state that is not finite, no sticking field, or
    /// too many steps.
    Ended,
}

impl DirectEnd {
    /// Reason why there is no image, in words for the user of a scene.
    pub fn reason(&self, scene: &Scene) -> String {
        let tangency = scene.section == Section::Tangency;
        let rigid = |surface: &Surface| matches!(surface.response, Response::Impact { .. });
        let reason = match *self {
            Self::Returned => "it is not finite",
            Self::NoReturn => "no section point within sixteen return times",
            Self::Penetrating => "it is beyond the surface, and no free flight leads there",
            Self::GoesThrough => "the reset of a rigid surface leaves it moving into the surface",
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

/// Message that two surfaces are hit at the same instant.
pub(super) fn hit_together(model: &Model, surfaces: [usize; 2]) -> String {
    let [a, b] = surfaces.map(|surface| &model.surfaces[surface].name);
    format!(
        "surfaces `{a}` and `{b}` are hit at the same instant, and the state after depends on \
         which of them acts first"
    )
}

/// The section map of a scene by direct simulation, over `f64` or double-double.
///
/// The map is `P = P_smooth ∘ D` with the exact contact. A section point beyond the surface is
/// taken back along the free flow to the surface and simulated from there; the last approach to the
/// section is flown with the surface ignored.
#[derive(Clone, Debug)]
pub struct DirectImage<'a, S: Real> {
    system: &'a HybridSystem,
    frame: SectionFrame<S>,
    circle: PhaseCircle<S>,
    returns: DirectReturn<'a, S>,
    /// Most steps of an image.
    limit: usize,
    /// Products of series in one step.
    products: usize,
}

/// Largest relative jump of a field at the start of a contact that counts as no jump.
const SMOOTH: f64 = 1e-9;

/// Most products of series in `f64` for one image: 2 to 5 s.
const MOST_PRODUCTS: usize = 13_000_000;

/// Cost of a product of series in double-double, relative to one in `f64`.
const IN_DOUBLE_DOUBLE: usize = 20;

/// Cost of one Taylor step of the free flow of a scene and of the gaps of all its surfaces, in
/// products of series.
pub(crate) fn products_of_step(scene: &Scene) -> usize {
    let surfaces = scene.model.surfaces.iter();
    let events: Vec<NodeId> = surfaces.map(|surface| surface.event).collect();
    Field::free(&scene.model, &events).time_program().cost_in_products().max(1)
}

impl<'a, S: Real> DirectImage<'a, S> {
    /// Section map of a scene about its grazing orbit; `system` is the scene's model, lowered.
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
        let products = products_of_step(scene);
        let frame = (SectionFrame::new(scene, orbit), phase_circle(scene, orbit));
        let mut image = Self::in_frame(system, frame, [most / products, products])?;
        if image.frame.periods() == 0 {
            image.returns = image.returns.ending_at_first(&converted(&orbit.section_point))?;
        }
        Ok(image)
    }

    /// The map that makes `returns` returns in one flight, without section points in between. Its
    /// passages are those of the first return, then of the next, and so on.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub(super) fn over(&self, returns: usize) -> Result<Self, AnalysisError> {
        let limit = self.limit.saturating_mul(returns);
        let frame = (self.frame.clone().over(returns), self.circle);
        Self::in_frame(self.system, frame, [limit, self.products])
    }

    fn in_frame(
        system: &'a HybridSystem,
        (mut frame, circle): (SectionFrame<S>, PhaseCircle<S>),
        [limit, products]: [usize; 2],
    ) -> Result<Self, AnalysisError> {
        let (section, duration) = (frame.return_section(), frame.duration());
        let mut returns =
            DirectReturn::new(system, frame.parameters(), section, duration, frame.periods())?
                .with_passages(&frame.nominal_passages(duration))?;
        returns.set_step_limit(limit);
        Ok(Self { system, circle, frame, returns, limit, products })
    }

    /// Limits the steps of an image; a point that needs more has no image. The default allows a few
    /// seconds.
    pub fn set_step_limit(&mut self, limit: usize) {
        self.limit = limit;
        self.returns.set_step_limit(limit);
    }

    /// Work of the last image, in products of series in `f64`.
    pub(super) fn work(&self) -> u64 {
        let each = if S::ROUNDOFF <= Dd::ROUNDOFF { IN_DOUBLE_DOUBLE } else { 1 };
        (self.returns.steps() * self.products * each) as u64
    }

    /// Number of steps of the last image.
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

    /// Whether images can be computed in lanes.
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

    /// Indices in [`GrazingOrbit::passages`] of the passages of one return.
    pub(super) fn passage_places(&self) -> Vec<usize> {
        self.frame.passage_places()
    }

    /// Gap at the first passage after a section point along the free flow, `−y²` at a contact; on a
    /// tangency section the gap at the point itself. NaN if there is no such passage.
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
        if self.is_on_tangency() {
            return Ok(self.frame.gap());
        }
        let duration = self.frame.duration();
        self.returns.set_parameters(self.frame.parameters(), duration)?;
        let gap = self.returns.first_gap(self.frame.state())?;
        Ok(gap.unwrap_or(S::from_f64(f64::NAN)))
    }

    /// The phase as a coordinate of the section, if it is one.
    pub fn circle(&self) -> PhaseCircle<S> {
        self.circle
    }

    /// Image of a section point in offsets, with the whole periods of its phase kept: it depends
    /// continuously on the point, as the image of a polynomial map does.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    pub fn lifted_image(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<SectionImage<S>, AnalysisError> {
        let image = self.image(offsets, parameter_offsets)?;
        Ok(self.lifted(image))
    }

    /// Adds the whole periods of the phase to an image.
    pub(super) fn lifted(&self, mut image: SectionImage<S>) -> SectionImage<S> {
        self.circle.lift(&mut image.offsets, image.turns);
        image.turns = 0;
        image
    }

    /// Image of a section point in offsets, the phase within half a period of 0.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`]; [`AnalysisError::Hybrid`] if an offset is not finite.
    pub fn image(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<SectionImage<S>, AnalysisError> {
        self.place(offsets, parameter_offsets)?;
        let image = self.returns.image(self.frame.state())?;
        Ok(self.in_offsets(image))
    }

    fn place(&mut self, offsets: &[S], parameter_offsets: &[S]) -> Result<(), AnalysisError> {
        self.frame.place(offsets, parameter_offsets)?;
        let duration = self.frame.duration();
        Ok(self.returns.set_parameters(self.frame.parameters(), duration)?)
    }

    fn in_offsets(&self, image: Return<S>) -> SectionImage<S> {
        let end = end_of(&image.outcome);
        let mut offsets = match end {
            DirectEnd::Returned => self.frame.offsets(&image.state),
            _ => vec![S::from_f64(f64::NAN); self.frame.dimension()],
        };
        let turns = self.circle.reduce(&mut offsets);
        SectionImage {
            offsets,
            turns,
            elapsed: image.elapsed,
            impact_speed: image.first_speed.unwrap_or(S::zero()),
            passed: image.passed,
            passages: image.passages,
            contacts: image.contacts,
            extra_contacts: image.extra_contacts,
            hits: image.hits,
            end,
        }
    }

    /// Image of a section point with its derivatives by the coordinates and then by the active
    /// parameters in `free`, from first variations, not differences. There are no derivatives if
    /// the return rests on a rigid surface.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    pub(super) fn varied(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
        free: &[usize],
    ) -> Result<(SectionImage<S>, Option<DMatrix<S>>), AnalysisError> {
        self.place(offsets, parameter_offsets)?;
        let (state, directions) = self.directions(free);
        let (image, changes) = self.returns.varied(&state, &directions)?;
        let slopes = changes.map(|changes: Vec<Variation<S>>| {
            let columns = changes.iter().flat_map(|change| {
                self.frame.components().iter().map(|&component| change.state[component])
            });
            let columns: Vec<S> = columns.collect();
            DMatrix::from_vec(self.frame.dimension(), directions.len(), columns)
        });
        Ok((self.in_offsets(image), slopes))
    }

    /// Derivatives of the [gap](Self::gap) by the coordinates and then by the active parameters in
    /// `free`; `None` if there is no gap.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    pub(super) fn varied_gap(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
        free: &[usize],
    ) -> Result<Option<Vec<S>>, AnalysisError> {
        self.place(offsets, parameter_offsets)?;
        let (state, directions) = self.directions(free);
        Ok(self.returns.varied_gap(&state, &directions)?)
    }

    /// State placed last, and the directions along the section of the coordinates and of the active
    /// parameters in `free`.
    fn directions(&self, free: &[usize]) -> (Vec<S>, Vec<Variation<S>>) {
        let state = self.frame.state().to_vec();
        let mut directions = self.frame.directions(free);
        self.returns.onto_section(&state, self.frame.eliminated(), &mut directions);
        (state, directions)
    }

    /// Whether the section is a tangency section.
    pub(super) fn is_on_tangency(&self) -> bool {
        self.frame.kind() == PoincareSectionKind::Tangency
    }

    /// Acceleration of the gap along the free flow at a section point: positive at a local minimum
    /// of the gap, as every point of a tangency section is.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    pub(super) fn normal_acceleration(
        &mut self,
        offsets: &[S],
        parameter_offsets: &[S],
    ) -> Result<S, AnalysisError> {
        self.place(offsets, parameter_offsets)?;
        Ok(self.returns.normal_acceleration(self.frame.surface(), self.frame.state())?)
    }

    /// Whether the contact of the first passage begins without a jump of the field, so that the
    /// image is differentiable by the depth at depth zero.
    pub(super) fn begins_smoothly(&self, orbit: &GrazingOrbit) -> bool {
        let first = self.passage_places().first().map(|&place| &orbit.passages[place]);
        let change = first.and_then(|graze| {
            let state: Vec<S> = converted(&graze.state);
            self.returns.change_at_contact(graze.surface, &state)
        });
        change.is_some_and(|[rate, change]| change.to_f64() <= SMOOTH * rate.to_f64())
    }
}

/// Most Newton steps to an equilibrium.
const NEWTON_STEPS: usize = 40;

impl DirectImage<'_, f64> {
    /// Whether there is no forcing, so that equilibria are possible.
    pub(super) fn is_autonomous(&self) -> bool {
        self.frame.periods() == 0
    }

    /// Equilibrium of the free flow near a section point, by Newton's method; `None` if none is
    /// found.
    pub(super) fn equilibrium(
        &mut self,
        offsets: &[f64],
        parameter_offsets: &[f64],
    ) -> Option<Equilibrium> {
        self.place(offsets, parameter_offsets).ok()?;
        let mut state = self.frame.state().to_vec();
        let directions = self.frame.state_directions();
        let size = state.len();
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            let (rates, slopes) = self.returns.free_rates(&state, &directions);
            let matrix = DMatrix::from_fn(size, size, |row, column| slopes[column][row]);
            let step = solve(&matrix, &DVector::from_vec(rates)).ok()?;
            let length = step.amax();
            if !length.is_finite() {
                return None;
            }
            if length == 0.0 || length >= last {
                let offsets = self.frame.offsets(&state);
                return Some(Equilibrium { offsets, eigenvalues: eigenvalues(&matrix).ok()? });
            }
            last = length;
            state.iter_mut().zip(step.iter()).for_each(|(value, &change)| *value -= change);
        }
        None
    }
}

/// Image of one section point by direct simulation: [`DirectImage`] for a single use.
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
        ReturnOutcome::Ended(Outcome::GoesThrough { .. }) => DirectEnd::GoesThrough,
        ReturnOutcome::Ended(Outcome::HeldTwice { .. }) => DirectEnd::HeldTwice,
        ReturnOutcome::Ended(Outcome::HitTogether { surfaces, time }) => {
            DirectEnd::HitTogether { surfaces: *surfaces, time: time.to_f64() }
        }
        ReturnOutcome::Ended(_) => DirectEnd::Ended,
    }
}
