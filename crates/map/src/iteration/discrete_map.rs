//! The contract of every map that can be iterated, the contacts of a step, and the names of
//! periodic orbits: hits at each surface, and forcing periods.

use serde::{Deserialize, Serialize};

use super::phase_circle::PhaseCircle;

/// A map `(x, p) ↦ x⁺` in offsets: interpreted, frozen, compiled, or evaluated by direct
/// simulation.
pub trait DiscreteMap: Sync {
    /// Number of coordinates of a state.
    fn dimension(&self) -> usize;

    /// Number of parameters.
    fn parameters(&self) -> usize;

    /// Coordinate that is a phase: images lie within half a period of 0 in it. None for a
    /// polynomial map.
    fn circle(&self) -> PhaseCircle {
        PhaseCircle::none()
    }

    /// One step: writes the image of `state` (length [`dimension`](Self::dimension)) to `image`.
    ///
    /// A step never panics on finite input. Without an image, [`StepInfo::valid`] is `false` and
    /// the image is NaN.
    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo;

    /// One step with the Jacobian `∂x⁺_i/∂x_j`, row by row, into `jacobian` (length `dimension²`).
    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo;

    /// One step of a state and of a tangent vector at it: the image, and the Jacobian times the
    /// vector.
    fn step_tangent(
        &self,
        [state, tangent]: [&[f64]; 2],
        parameters: &[f64],
        [image, carried]: [&mut [f64]; 2],
    ) -> StepInfo {
        let mut jacobian = vec![0.0; state.len() * state.len()];
        let info = self.step_jacobian(state, parameters, image, &mut jacobian);
        let rows = jacobian.chunks_exact(state.len());
        for (value, row) in carried.iter_mut().zip(rows) {
            *value = row.iter().zip(tangent).map(|(a, b)| a * b).sum();
        }
        info
    }
}

/// A map that also has derivatives by its parameters.
pub trait DifferentiableMap: DiscreteMap + Send {
    /// One step with the derivatives of the image by the coordinates and then by the parameters,
    /// row by row, into `derivatives` (length `dimension × (dimension + parameters)`).
    fn step_derivatives(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        derivatives: &mut [f64],
    ) -> StepInfo;
}

/// Forwards to the map behind a reference.
impl<M: DifferentiableMap + ?Sized> DifferentiableMap for &M {
    fn step_derivatives(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        derivatives: &mut [f64],
    ) -> StepInfo {
        (**self).step_derivatives(state, parameters, image, derivatives)
    }
}

/// Contacts, depth and validity of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepInfo {
    /// Grazing passages that made contact, numbered in the order in which they follow the section.
    pub passages: PassageSet,
    /// Largest `y²` over the passages, 0 without contact.
    pub depth: f64,
    /// Whether the image exists and is finite.
    pub valid: bool,
    /// Whether the image was computed by direct simulation.
    pub simulated: bool,
    /// Whole periods of the phase that the step took beyond the nominal ones, negative if it took
    /// fewer. [`PhaseCircle::reduce`] has removed them from the image.
    pub turns: i32,
}

impl StepInfo {
    /// Number of grazing passages that made contact.
    pub fn contacts(&self) -> u32 {
        self.passages.len() as u32
    }

    /// Records the depth of a passage, numbered from 0; contact is made if it is positive.
    pub fn add_passage(&mut self, passage: usize, depth: f64) {
        if depth > 0.0 {
            self.passages.insert(passage);
            self.depth = self.depth.max(depth);
        }
    }

    /// Sets [`valid`](Self::valid): whether every number of the image is finite.
    pub fn checked(self, image: &[f64]) -> Self {
        Self { valid: image.iter().all(|value| value.is_finite()), ..self }
    }
}

/// Forwards to the map behind a reference.
impl<M: DiscreteMap + ?Sized> DiscreteMap for &M {
    fn dimension(&self) -> usize {
        (**self).dimension()
    }

    fn parameters(&self) -> usize {
        (**self).parameters()
    }

    fn circle(&self) -> PhaseCircle {
        (**self).circle()
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        (**self).step(state, parameters, image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        (**self).step_jacobian(state, parameters, image, jacobian)
    }

    fn step_tangent(
        &self,
        start: [&[f64]; 2],
        parameters: &[f64],
        end: [&mut [f64]; 2],
    ) -> StepInfo {
        (**self).step_tangent(start, parameters, end)
    }
}

/// A set of passages, by their numbers in one return, from 0.
///
/// Serialized as the list of their numbers. At most [`CAPACITY`](Self::CAPACITY) passages, as many
/// as a scene may name; larger numbers are dropped.
///
/// ```
/// use grazemap_map::iteration::PassageSet;
///
/// let made: PassageSet = [0, 2].into_iter().collect();
/// assert_eq!((made.len(), made.contains(1), made.contains(2)), (2, false, true));
/// ```
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(into = "Vec<usize>", from = "Vec<usize>")]
pub struct PassageSet {
    mask: u64,
}

impl PassageSet {
    /// Most passages of a set.
    pub const CAPACITY: usize = 64;

    /// The empty set.
    pub const NONE: Self = Self { mask: 0 };

    /// Adds a passage.
    pub fn insert(&mut self, passage: usize) {
        self.mask |= Self::bit(passage);
    }

    /// Whether a passage is in the set.
    pub fn contains(self, passage: usize) -> bool {
        self.mask & Self::bit(passage) != 0
    }

    /// Number of passages in the set.
    pub fn len(self) -> usize {
        self.mask.count_ones() as usize
    }

    /// Whether no passage is in the set.
    pub fn is_empty(self) -> bool {
        self.mask == 0
    }

    /// Passages in the set, in increasing order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..Self::CAPACITY).filter(move |&passage| self.contains(passage))
    }

    /// Bit of a passage; 0 for a number beyond the capacity.
    fn bit(passage: usize) -> u64 {
        u32::try_from(passage).ok().and_then(|passage| 1u64.checked_shl(passage)).unwrap_or(0)
    }
}

impl FromIterator<usize> for PassageSet {
    fn from_iter<I: IntoIterator<Item = usize>>(passages: I) -> Self {
        let mut set = Self::default();
        passages.into_iter().for_each(|passage| set.insert(passage));
        set
    }
}

impl From<PassageSet> for Vec<usize> {
    fn from(set: PassageSet) -> Self {
        set.iter().collect()
    }
}

impl From<Vec<usize>> for PassageSet {
    fn from(passages: Vec<usize>) -> Self {
        passages.into_iter().collect()
    }
}

/// Grazing passages of one return of a map: the surface of each, and the forcing periods of the
/// return.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Itinerary {
    /// Names of the surfaces that graze, in the order in which the model declares them.
    pub surfaces: Vec<String>,
    /// The surface of each passage, an index into [`surfaces`](Self::surfaces), in the order of
    /// the passages' numbers.
    pub passages: Vec<usize>,
    /// Hits of the nominal orbit at each surface in one return, beside its passages.
    pub nominal_hits: Vec<u32>,
    /// Forcing periods of one return; 1 for an autonomous system.
    pub periods: usize,
}

/// Name of a periodic orbit: hits at each surface that grazes, then periods, printed `(1,1,3)`.
///
/// The periods are those of the forcing (returns of an autonomous system): the orbit's period under
/// its map times the forcing periods of one return.
///
/// ```
/// use grazemap_map::iteration::OrbitName;
///
/// let name = OrbitName { hits: vec![1, 1], periods: 3 };
/// assert_eq!(name.to_string(), "(1,1,3)");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct OrbitName {
    /// Hits at each surface, in the order of [`Itinerary::surfaces`].
    pub hits: Vec<u32>,
    /// Forcing periods.
    pub periods: usize,
}

impl Itinerary {
    /// Number of hits per surface in one return, given the passages that made contact.
    pub fn hits(&self, made: PassageSet) -> Vec<u32> {
        let mut hits = self.nominal_hits.clone();
        let contacts = self.passages.iter().enumerate();
        for (_, &surface) in contacts.filter(|&(passage, _)| made.contains(passage)) {
            if let Some(hits) = hits.get_mut(surface) {
                *hits += 1;
            }
        }
        hits
    }

    /// Name of an orbit, from the hits of each return in one of its periods and the whole periods
    /// of the phase that these returns took beyond the nominal ones.
    pub fn name(&self, returns: impl IntoIterator<Item = Vec<u32>>, turns: i32) -> OrbitName {
        let (mut hits, mut count) = (vec![0; self.surfaces.len()], 0);
        for own in returns {
            hits.iter_mut().zip(own).for_each(|(sum, hits)| *sum += hits);
            count += 1;
        }
        OrbitName { hits, periods: self.periods_of(count, turns) }
    }

    /// Forcing periods of a number of returns that took `turns` whole periods beyond the nominal
    /// ones.
    pub fn periods_of(&self, returns: usize, turns: i32) -> usize {
        (self.periods * returns).saturating_add_signed(turns as isize)
    }

    /// Period, in nominal returns, of an orbit of `periods` forcing periods: after that many the
    /// orbit is at the same state on any section.
    pub fn nominal_returns(&self, periods: usize) -> usize {
        let (mut divisor, mut rest) = (self.periods, periods);
        while rest > 0 {
            (divisor, rest) = (rest, divisor % rest);
        }
        periods / divisor.max(1)
    }
}

impl std::fmt::Display for OrbitName {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("(")?;
        for hits in &self.hits {
            write!(formatter, "{hits},")?;
        }
        write!(formatter, "{})", self.periods)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_in_up_to_its_capacity() {
        let set: PassageSet = [3, 0, 63, 64, 1 << 40].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 3, 63]);
        assert_eq!(set.len(), 3);
        assert!(!set.contains(64) && PassageSet::default().is_empty());
    }

    /// Passages right, left, right in two forcing periods; the model declares the left stop first.
    fn itinerary() -> Itinerary {
        Itinerary {
            surfaces: ["left", "right"].map(str::to_owned).to_vec(),
            passages: vec![1, 0, 1],
            nominal_hits: vec![0, 0],
            periods: 2,
        }
    }

    #[test]
    fn hits_are_counted_by_surface() {
        let made = [0, 2].into_iter().collect();
        assert_eq!(itinerary().hits(made), [0, 2]);
        assert_eq!(itinerary().hits([1].into_iter().collect()), [1, 0]);
        let hits_right = Itinerary { nominal_hits: vec![0, 3], ..itinerary() };
        assert_eq!(hits_right.hits([1].into_iter().collect()), [1, 3]);
    }

    #[test]
    fn a_period_in_nominal_returns_is_that_of_a_stroboscopic_section() {
        // Returns of two forcing periods: an orbit of period three repeats after three of them.
        let returns = [2, 3, 4, 6, 1].map(|periods| itinerary().nominal_returns(periods));
        assert_eq!(returns, [1, 3, 2, 3, 1]);
    }

    #[test]
    fn a_name_sums_the_hits_and_the_forcing_periods_of_all_returns() {
        let returns = || [vec![0, 2], vec![1, 0], vec![0, 0]];
        assert_eq!(itinerary().name(returns(), 0).to_string(), "(1,2,6)");
        assert_eq!(itinerary().name(returns(), -1).to_string(), "(1,2,5)");
    }
}
