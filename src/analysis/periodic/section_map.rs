//! A section map over any number, whatever evaluates it.

use crate::analysis::{DirectEnd, DirectImage, MapEvaluation};
use crate::iteration::{DiscreteMap, PassageSet};
use crate::numeric::Real;

/// A map `(x, p) ↦ x⁺` in offsets, in double precision or in double-double.
pub trait SectionMap<S: Real> {
    /// The image of a point; `None` where there is none.
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>>;
}

/// One image.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionStep<S> {
    /// Offsets of the image.
    pub offsets: Vec<S>,
    /// Passages that made contact, in the order in which they follow the section.
    pub contacts: PassageSet,
    /// Smallest of their depths ([`Stepped`] maps say the largest), in units in which it goes with
    /// `y²`; 0 without contact.
    ///
    /// How near the point is to where the map has no derivative. A local map says `y²`, direct
    /// simulation the square of the impact speed.
    pub depth: S,
    /// Contacts that no passage accounts for; 0 of a local map, which knows none.
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
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        let image = DirectImage::image(self, state, parameters).ok()?;
        if image.end != DirectEnd::Returned {
            return None;
        }
        let speeds = image.passages.into_iter();
        let depths = speeds.map(|speed| speed.map(|speed| speed * speed));
        SectionStep::new(image.offsets, depths, image.extra_contacts)
    }
}

/// A map that is iterated in double precision, as a section map: compiled, frozen, interpreted, or
/// simulated.
#[derive(Clone, Copy, Debug)]
pub struct Stepped<M>(pub M);

impl<M: DiscreteMap> SectionMap<f64> for Stepped<M> {
    fn image(&mut self, state: &[f64], parameters: &[f64]) -> Option<SectionStep<f64>> {
        let mut offsets = vec![f64::NAN; state.len()];
        let info = self.0.step(state, parameters, &mut offsets);
        info.valid.then_some(SectionStep {
            offsets,
            contacts: info.passages,
            depth: info.depth,
            extra_contacts: 0,
        })
    }
}

/// A reference to a map is a map.
impl<S: Real, M: SectionMap<S> + ?Sized> SectionMap<S> for &mut M {
    fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
        (**self).image(state, parameters)
    }
}
