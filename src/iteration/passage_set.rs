//! Which grazing passages made contact.

/// A set of passages, by their numbers in one return, from 0.
///
/// In files it is the list of their numbers. It holds [`CAPACITY`](Self::CAPACITY) passages, as many as a scene may name; higher numbers are
/// not kept.
///
/// ```
/// use grazemap::iteration::PassageSet;
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

    /// The passages in the set, increasing.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..Self::CAPACITY).filter(move |&passage| self.contains(passage))
    }

    /// The bit of a passage; 0 beyond the last.
    fn bit(passage: usize) -> u64 {
        u32::try_from(passage)
            .ok()
            .and_then(|passage| 1u64.checked_shl(passage))
            .unwrap_or(0)
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
}
