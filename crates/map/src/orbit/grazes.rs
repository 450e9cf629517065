//! Which passages of a period graze, what decides each (an equation, the symmetry, or nothing), and
//! the half-period symmetry `(x, theta) -> (-x, theta + period/2)`.

use super::outcome::OrbitError;
use super::section::{Geometry, reduced};
use crate::model::{Model, Scene, Symmetry};
use crate::numeric::{Dd, Real, Scalar};

/// The grazing passages of a scene's orbit.
///
/// The first `independent` ones are equations of the orbit, one adjusted parameter each. With the
/// half-period symmetry the second half of the passages mirrors the first. Passages that are
/// neither have to touch of themselves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grazes {
    /// Surfaces grazed in one period, in order.
    pub(super) surfaces: Vec<usize>,
    /// Number of grazes that are equations.
    pub(super) independent: usize,
    /// Symmetry of the orbit.
    pub(super) symmetry: Symmetry,
}

impl Grazes {
    /// The grazes a scene asks for.
    ///
    /// NOTE: an orbit of an even number of forcing periods cannot be its own mirror image. Half of
    /// it lasts whole periods, and `(x, theta) -> (-x, theta + period/2)` shifts the phase by
    /// half of one.
    pub(super) fn of(scene: &Scene) -> Result<Self, OrbitError> {
        let grazing = &scene.grazing;
        let (surfaces, symmetry) = (grazing.passages.clone(), grazing.symmetry);
        let (named, passages) = (grazing.solve_for.len(), surfaces.len());
        if symmetry == Symmetry::HalfPeriod {
            if grazing.periods.is_multiple_of(2) {
                let periods = grazing.periods;
                return Err(OrbitError::EvenPeriods { periods });
            }
            if !passages.is_multiple_of(2) {
                return Err(OrbitError::UnpairedPassages { passages });
            }
        }
        let grazes = Self { surfaces, independent: named, symmetry };
        let most = grazes.unmirrored();
        if named == 0 || named > most {
            return Err(OrbitError::AdjustedParameters { named, most });
        }
        Ok(grazes)
    }

    /// Number of passages that mirror no other.
    pub(super) fn unmirrored(&self) -> usize {
        match self.symmetry {
            Symmetry::None => self.surfaces.len(),
            Symmetry::HalfPeriod => self.surfaces.len() / 2,
        }
    }

    /// The first graze alone.
    pub(super) fn first(&self) -> Self {
        Self { surfaces: self.surfaces[..1].to_vec(), independent: 1, symmetry: self.symmetry }
    }

    /// The part of the period after which the orbit is known: all of it, or half.
    pub(super) fn share(&self) -> f64 {
        match self.symmetry {
            Symmetry::None => 1.0,
            Symmetry::HalfPeriod => 0.5,
        }
    }

    /// The factor by which the states return after that part: 1, or −1.
    pub(super) fn image(&self) -> f64 {
        match self.symmetry {
            Symmetry::None => 1.0,
            Symmetry::HalfPeriod => -1.0,
        }
    }

    /// Phase a forced orbit runs through in a period, from the phase's own period.
    pub(super) fn advance(scene: &Scene) -> Option<Dd> {
        let periods = Dd::from(scene.grazing.periods as f64);
        let phase = scene.model.phase.as_ref();
        phase.map(|phase| phase.period * periods)
    }
}

/// A passage that touches its surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Touch<S> {
    /// The surface.
    pub(super) surface: usize,
    /// Time since the first graze, in `[0, period of the orbit)`.
    pub(super) time: S,
    /// Full state; the phase in `[0, period)`.
    pub(super) state: Vec<S>,
}

/// Largest departure from the symmetry, relative to the largest rate of a state, that is rounding
/// in double-double.
const ROUNDING: f64 = 1e-24;

/// The mirror image of a full state, its phase in `[0, period)`.
pub(super) fn mirrored<S: Real>(model: &Model, state: &[S]) -> Vec<S> {
    let mut image: Vec<S> = state.iter().map(|&value| -value).collect();
    if let (Some(clock), Some(phase), Some(&value)) = (&model.phase, image.last_mut(), state.last())
    {
        let shifted = value.to_dd() + clock.period * Dd::from(0.5);
        *phase = S::from_dd(reduced(shifted, clock.period));
    }
    image
}

/// Checks `f(-x, theta + period/2) = -f(x, theta)` at full states where the field is finite.
///
/// # Errors
///
/// [`OrbitError::NotSymmetric`] with the largest departure.
pub(super) fn check_field(
    model: &Model,
    geometry: &Geometry,
    points: &[Vec<Dd>],
    parameters: &[Dd],
) -> Result<(), OrbitError> {
    let rates = |state: &[Dd]| geometry.at(state, parameters).flow();
    let mut largest = 0.0_f64;
    let mut worst: Option<(f64, OrbitError)> = None;
    for point in points {
        let image = mirrored(model, point);
        let pairs = rates(point).into_iter().zip(rates(&image));
        for (component, (here, there)) in pairs.enumerate().take(model.states.len()) {
            let departure = (here + there).magnitude();
            if !departure.is_finite() {
                continue;
            }
            largest = largest.max(here.magnitude());
            if worst.as_ref().is_none_or(|(most, _)| departure > *most) {
                let error = OrbitError::NotSymmetric {
                    component: model.states[component].clone(),
                    phase: point.last().map_or(f64::NAN, |phase| phase.to_f64()),
                    rate: here.to_f64(),
                    mirrored: there.to_f64(),
                };
                worst = Some((departure, error));
            }
        }
    }
    match worst {
        Some((departure, error)) if departure > ROUNDING * largest => Err(error),
        _ => Ok(()),
    }
}
