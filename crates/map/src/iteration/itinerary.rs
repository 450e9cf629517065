//! The name of a periodic orbit: how often it hits each surface, in how many periods.

use serde::{Deserialize, Serialize};

use super::discrete_map::PassageSet;

/// The grazing passages of one return of a map: which surface each meets, and what one return
/// counts for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Itinerary {
    /// Names of the surfaces that graze, in the order in which the model declares them.
    pub surfaces: Vec<String>,
    /// The surface of each passage, an index into [`surfaces`](Self::surfaces), in the order of
    /// the passages' numbers.
    pub passages: Vec<usize>,
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
    /// Periods.
    pub periods: usize,
}

impl Itinerary {
    /// Hits per surface of the passages that made contact.
    pub fn hits(&self, made: PassageSet) -> Vec<u32> {
        let mut hits = vec![0; self.surfaces.len()];
        let contacts = self.passages.iter().enumerate();
        for (_, &surface) in contacts.filter(|&(passage, _)| made.contains(passage)) {
            if let Some(hits) = hits.get_mut(surface) {
                *hits += 1;
            }
        }
        hits
    }

    /// The name of an orbit from the hits of each return in one of its periods.
    pub fn name(&self, returns: impl IntoIterator<Item = Vec<u32>>) -> OrbitName {
        let mut name = OrbitName { hits: vec![0; self.surfaces.len()], periods: 0 };
        for hits in returns {
            let sums = name.hits.iter_mut().zip(hits);
            sums.for_each(|(sum, hits)| *sum += hits);
            name.periods += self.periods;
        }
        name
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

    /// Right, left, right in two forcing periods; the model declares the left stop first.
    fn itinerary() -> Itinerary {
        Itinerary {
            surfaces: ["left", "right"].map(str::to_owned).to_vec(),
            passages: vec![1, 0, 1],
            periods: 2,
        }
    }

    #[test]
    fn hits_are_counted_by_surface() {
        let made = [0, 2].into_iter().collect();
        assert_eq!(itinerary().hits(made), [0, 2]);
        assert_eq!(itinerary().hits([1].into_iter().collect()), [1, 0]);
    }

    #[test]
    fn a_name_sums_the_hits_and_the_forcing_periods_of_all_returns() {
        let name = itinerary().name([vec![0, 2], vec![1, 0], vec![0, 0]]);
        assert_eq!(name.to_string(), "(1,2,6)");
    }
}
