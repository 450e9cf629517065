//! Section maps over any number type, and their derivatives: exact ones where a map has them,
//! otherwise differences within one branch of the root.

use nalgebra::{DMatrix, DVector};

use crate::analysis::direct_image::{DirectEnd, DirectImage, SectionImage};
use crate::analysis::evaluation::MapEvaluation;
use crate::iteration::{DiscreteMap, PassageSet, PhaseCircle};
use crate::numeric::Real;

/// A map `(x, p) ↦ x⁺` in offsets, in double precision or in double-double.
pub trait SectionMap<S: Real> {
    /// Phase as one of the coordinates, if any: points whose phases differ by a period are the
    /// same.
    fn circle(&self) -> PhaseCircle<S> {
        PhaseCircle::none()
    }

    /// Image of a point, a continuous function of it: a phase keeps its whole periods. `None` if
    /// there is no image.
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>>;

    /// Image with its derivatives by the coordinates and then by the parameters in `free`, if the
    /// map has them without differences.
    fn varied(
        &mut self,
        _state: &[S],
        _parameters: &[S],
        _free: &[usize],
    ) -> Option<(SectionStep<S>, DMatrix<S>)> {
        None
    }
}

/// Image of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionStep<S> {
    /// Offsets of the image.
    pub offsets: Vec<S>,
    /// Passages that made contact, in the order in which they follow the section.
    pub contacts: PassageSet,
    /// Smallest depth of these passages (the largest for [`Stepped`] maps), in units proportional
    /// to `y²`; 0 without contact.
    ///
    /// Measures the distance to points without a derivative. It is `y²` for a local map, the square
    /// of the impact speed for direct simulation.
    pub depth: S,
    /// Contacts beyond one per passage, or at other surfaces; 0 for a local map, which has none.
    pub extra_contacts: usize,
}

impl<S: Real> SectionStep<S> {
    fn new(offsets: Vec<S>, depths: impl Iterator<Item = Option<S>>, extra: usize) -> Option<Self> {
        let mut step = Self {
            offsets,
            contacts: PassageSet::default(),
            depth: S::zero(),
            extra_contacts: extra,
        };
        for (passage, depth) in depths.enumerate() {
            let Some(depth) = depth else { continue };
            let first = step.contacts.is_empty();
            step.contacts.insert(passage);
            step.depth = if first { depth } else { step.depth.min(depth) };
        }
        let finite = step.offsets.iter().all(|value| value.is_finite());
        finite.then_some(step)
    }

    /// Image by direct simulation; `None` if there is none.
    fn simulated(image: SectionImage<S>) -> Option<Self> {
        if image.end != DirectEnd::Returned {
            return None;
        }
        let speeds = image.passages.into_iter();
        let depths = speeds.map(|speed| speed.map(|speed| speed * speed));
        Self::new(image.offsets, depths, image.extra_contacts)
    }
}

impl<S: Real> SectionMap<S> for MapEvaluation<S> {
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        let image = MapEvaluation::image(self, state, parameters);
        let depths = image.depths.into_iter();
        let depths = depths.map(|depth| (depth > S::zero()).then_some(depth));
        SectionStep::new(image.offsets, depths, 0)
    }
}

impl<S: Real> SectionMap<S> for DirectImage<'_, S> {
    fn circle(&self) -> PhaseCircle<S> {
        DirectImage::circle(self)
    }

    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        SectionStep::simulated(self.lifted_image(state, parameters).ok()?)
    }

    fn varied(
        &mut self,
        state: &[S],
        parameters: &[S],
        free: &[usize],
    ) -> Option<(SectionStep<S>, DMatrix<S>)> {
        let (image, slopes) = DirectImage::varied(self, state, parameters, free).ok()?;
        Some((SectionStep::simulated(self.lifted(image))?, slopes?))
    }
}

/// A map iterated in double precision as a section map: compiled, frozen, interpreted, or
/// simulated.
#[derive(Clone, Copy, Debug)]
pub struct Stepped<M>(pub M);

impl<M: DiscreteMap> SectionMap<f64> for Stepped<M> {
    fn circle(&self) -> PhaseCircle {
        self.0.circle()
    }

    fn image(&mut self, state: &[f64], parameters: &[f64]) -> Option<SectionStep<f64>> {
        let mut offsets = vec![f64::NAN; state.len()];
        let info = self.0.step(state, parameters, &mut offsets);
        self.0.circle().lift(&mut offsets, info.turns);
        info.valid.then_some(SectionStep {
            offsets,
            contacts: info.passages,
            depth: info.depth,
            extra_contacts: 0,
        })
    }
}

/// Forwards to the map referred to.
impl<S: Real, M: SectionMap<S> + ?Sized> SectionMap<S> for &mut M {
    fn circle(&self) -> PhaseCircle<S> {
        (**self).circle()
    }

    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        (**self).image(state, parameters)
    }

    fn varied(
        &mut self,
        state: &[S],
        parameters: &[S],
        free: &[usize],
    ) -> Option<(SectionStep<S>, DMatrix<S>)> {
        (**self).varied(state, parameters, free)
    }
}

/// Most reductions of a step before a derivative is given up.
const SHORTENINGS: usize = 24;
/// Factor by which a step that meets other contacts is shortened.
const OTHER_CONTACTS: f64 = 1e-2;

/// An image with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearisation<S> {
    /// Image.
    pub step: SectionStep<S>,
    /// `∂x⁺/∂x`.
    pub by_state: DMatrix<S>,
    /// `∂x⁺/∂p` by the free parameter.
    pub by_parameter: DVector<S>,
}

/// Image of a point with its derivatives by the state and by one parameter: those of the map
/// itself, first variations of direct simulation, or central differences of fourth order.
///
/// A depth variable `y` varies on the scale of the depth itself. A step of a difference is
/// therefore shortened until it changes the depth by at most a share `ρ = ε^(1/5)` of itself and
/// both sides make the contacts of the centre: truncation and rounding then both leave an error of
/// about `ε^(4/5)` of an entry. `scales` are length scales of the map, of the coordinates and of
/// the parameters.
///
/// `None` if the map has no image or is at a corner.
pub fn linearise<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    state: &[S],
    parameters: &[S],
    free: usize,
    scales: &[f64],
) -> Option<Linearisation<S>> {
    let (step, all) = derivatives(map, state, parameters, &[free], scales)?;
    let by_state = all.columns(0, state.len()).into_owned();
    let by_parameter = all.column(state.len()).into_owned();
    Some(Linearisation { step, by_state, by_parameter })
}

/// Derivatives by the coordinates and then by the parameters in `free`, computed as by
/// [`linearise`].
pub(in crate::analysis) fn derivatives<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    state: &[S],
    parameters: &[S],
    free: &[usize],
    scales: &[f64],
) -> Option<(SectionStep<S>, DMatrix<S>)> {
    if let Some(known) = map.varied(state, parameters, free) {
        return Some(known);
    }
    let step = map.image(state, parameters)?;
    let mut point = DifferencePoint::new(state, parameters);
    let variables = (0..state.len()).chain(free.iter().map(|place| state.len() + place));
    let slopes = variables.map(|variable| point.slope(map, &step, variable, scales[variable]));
    let columns: Vec<DVector<S>> = slopes.collect::<Option<_>>()?;
    Some((step, DMatrix::from_columns(&columns)))
}

/// Point at which derivatives are taken.
struct DifferencePoint<S> {
    variables: Vec<S>,
    dimension: usize,
}

impl<S: Real> DifferencePoint<S> {
    fn new(state: &[S], parameters: &[S]) -> Self {
        Self { variables: [state, parameters].concat(), dimension: state.len() }
    }

    /// Derivative by one variable.
    fn slope(
        &mut self,
        map: &mut (impl SectionMap<S> + ?Sized),
        centre: &SectionStep<S>,
        variable: usize,
        scale: f64,
    ) -> Option<DVector<S>> {
        let share = S::ROUNDOFF.powf(0.2);
        let mut length = share * scale;
        for _ in 0..SHORTENINGS {
            match self.pair(map, centre, variable, 2.0 * length) {
                Ok((outer, change)) if change <= 4.0 * share => {
                    let inner = self.pair(map, centre, variable, length).ok()?.0;
                    return Some(fourth_order(&inner, &outer, length));
                }
                // A step with half of the allowed change is safely within it.
                Ok((_, change)) => length *= (share / change).max(1e-12),
                Err(OtherBranch) => length *= OTHER_CONTACTS,
            }
        }
        None
    }

    /// Difference of the images on both sides, and the relative change of the depth.
    fn pair(
        &mut self,
        map: &mut (impl SectionMap<S> + ?Sized),
        centre: &SectionStep<S>,
        variable: usize,
        length: f64,
    ) -> Result<(DVector<S>, f64), OtherBranch> {
        let mut side = |sign: f64| {
            let kept = self.variables[variable];
            self.variables[variable] += S::from_f64(sign * length);
            let (state, parameters) = self.variables.split_at(self.dimension);
            let image = map.image(state, parameters);
            self.variables[variable] = kept;
            image.filter(|image| image.contacts == centre.contacts).ok_or(OtherBranch)
        };
        let (up, down) = (side(1.0)?, side(-1.0)?);
        let change = if centre.contacts.is_empty() {
            0.0
        } else {
            ((up.depth - down.depth) / centre.depth).magnitude()
        };
        let pairs = up.offsets.iter().zip(&down.offsets);
        let difference = DVector::from_iterator(self.dimension, pairs.map(|(&a, &b)| a - b));
        Ok((difference, change))
    }
}

/// Reason to shorten a step: no image, or other contacts than at the centre.
struct OtherBranch;

/// Derivative of fourth order `(8 Δ(h) − Δ(2h)) / 12h`.
fn fourth_order<S: Real>(inner: &DVector<S>, outer: &DVector<S>, length: f64) -> DVector<S> {
    let (eight, step) = (S::from_f64(8.0), S::from_f64(12.0) * S::from_f64(length));
    inner.zip_map(outer, |inner, outer| (eight * inner - outer) / step)
}
