//! Itineraries of periodic orbits: the passages that make contact, return by return.
//!
//! One idea: an itinerary is written in digits, 1 for a contact and 0 for none. Itineraries that
//! differ by a rotation belong to one orbit; the largest of them as a number represents all.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::iteration::PassageSet;

/// Most passages of a period for which all itineraries are listed: 352 for twelve with one passage
/// a return.
const MOST_LISTED: usize = 12;
/// Most digits of an itinerary that is parsed.
const LONGEST: usize = 64;

/// Passages of a periodic orbit that make contact, return by return.
///
/// Printed as one digit for each passage in the order in which they follow the section, 1 if it
/// makes contact; returns of several passages are separated by points.
///
/// ```
/// use grazemap_map::analysis::periodic::ContactItinerary;
///
/// let itinerary = ContactItinerary::parse("100", 1)?;
/// assert_eq!((itinerary.period(), itinerary.contacts()), (3, 1));
/// assert_eq!(ContactItinerary::parse("10 01", 2)?.to_string(), "10.01");
/// # Ok::<(), grazemap_map::analysis::periodic::ItineraryError>(())
/// ```
///
/// In files it is the same text, with a point after a single return of several passages.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct ContactItinerary {
    passages: usize,
    returns: Vec<PassageSet>,
}

/// Error in an itinerary, or in a request for all itineraries.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ItineraryError {
    /// A character is neither a digit nor a separator.
    #[error(
        "itinerary `{}`: found `{}` where 1 (contact) or 0 (none) was \
            expected", .text.escape_default(), .found.escape_default()
    )]
    NotADigit {
        /// Text of the itinerary.
        text: String,
        /// Offending character.
        found: char,
    },
    /// The digits do not form whole returns.
    #[error(
        "itinerary `{text}` has {found} digits; a return has {passages}, one for each grazing \
            passage"
    )]
    NotWholeReturns {
        /// Text of the itinerary.
        text: String,
        /// Number of digits.
        found: usize,
        /// Passages of a return.
        passages: usize,
    },
    /// There are too many digits.
    #[error("an itinerary of {found} digits; at most {limit} are expected")]
    TooLong {
        /// Number of digits.
        found: usize,
        /// Largest number.
        limit: usize,
    },
    /// There are too many itineraries to list.
    #[error(
        "a period of {period} returns has {found} passages; all itineraries are tried up to \
         {limit} passages: ask for a shorter period, or name itineraries"
    )]
    TooMany {
        /// Longest period, in returns.
        period: usize,
        /// Number of its passages.
        found: usize,
        /// Largest number.
        limit: usize,
    },
}

impl ContactItinerary {
    /// Itinerary of an orbit of a map with `passages` passages a return.
    pub fn new(passages: usize, returns: Vec<PassageSet>) -> Self {
        Self { passages, returns }
    }

    /// Parses digits; spaces, commas, points and dashes between them are skipped.
    ///
    /// # Errors
    ///
    /// [`ItineraryError::NotADigit`], [`ItineraryError::NotWholeReturns`] and
    /// [`ItineraryError::TooLong`].
    pub fn parse(text: &str, passages: usize) -> Result<Self, ItineraryError> {
        let digits = text.chars().filter(|c| !" ,.-".contains(*c));
        let digit = |found| match found {
            '0' => Ok(false),
            '1' => Ok(true),
            _ => Err(ItineraryError::NotADigit { text: text.to_owned(), found }),
        };
        let digits: Vec<bool> = digits.map(digit).collect::<Result<_, _>>()?;
        let found = digits.len();
        if found > LONGEST {
            let limit = LONGEST;
            return Err(ItineraryError::TooLong { found, limit });
        }
        if passages == 0 || found == 0 || !found.is_multiple_of(passages) {
            return Err(ItineraryError::NotWholeReturns { text: text.to_owned(), found, passages });
        }
        Ok(Self::of_digits(passages, &digits))
    }

    /// All itineraries of periods up to `longest` returns, each in its largest rotation and once,
    /// shorter periods first. Of the itineraries without contact, which are orbits of `P_smooth`,
    /// only the shortest is listed.
    ///
    /// Itineraries that repeat a shorter one are included: an orbit may make the same contacts
    /// twice at different depths, as after a flip.
    ///
    /// # Errors
    ///
    /// [`ItineraryError::TooMany`] for more than twelve passages.
    pub fn all(passages: usize, longest: usize) -> Result<Vec<Self>, ItineraryError> {
        let found = passages.saturating_mul(longest);
        if found > MOST_LISTED {
            return Err(ItineraryError::TooMany { period: longest, found, limit: MOST_LISTED });
        }
        let of_period = |period: usize| {
            let length = period * passages;
            let words = (0..1_u32 << length).rev();
            words.filter_map(move |word| {
                let digit = |place: usize| (word >> (length - 1 - place)) & 1 == 1;
                let digits: Vec<bool> = (0..length).map(digit).collect();
                let rotated = |by: usize| digits.iter().cycle().skip(by * passages).take(length);
                let largest = (1..period).all(|by| rotated(by).le(digits.iter()));
                let listed = largest && (word > 0 || period == 1);
                listed.then(|| Self::of_digits(passages, &digits))
            })
        };
        Ok((1..=longest).flat_map(of_period).collect())
    }

    fn of_digits(passages: usize, digits: &[bool]) -> Self {
        let made = |digits: &[bool]| {
            let made = digits.iter().enumerate().filter(|(_, made)| **made);
            made.map(|(passage, _)| passage).collect()
        };
        Self { passages, returns: digits.chunks(passages).map(made).collect() }
    }

    /// Number of passages in a return.
    pub fn passages(&self) -> usize {
        self.passages
    }

    /// Number of returns in a period.
    pub fn period(&self) -> usize {
        self.returns.len()
    }

    /// Passages that make contact, return by return.
    pub fn returns(&self) -> &[PassageSet] {
        &self.returns
    }

    /// Number of contacts in a period.
    pub fn contacts(&self) -> usize {
        self.returns.iter().map(|made| made.len()).sum()
    }

    /// Whether a rotation by `returns` returns leaves the itinerary unchanged.
    pub fn repeats_after(&self, returns: usize) -> bool {
        self.begun_after(returns % self.period()) == self.returns
    }

    /// Rotation that is the largest as a number, and the number of returns it starts later.
    pub fn largest_rotation(&self) -> (Self, usize) {
        let digits = |returns: &[PassageSet]| -> Vec<bool> {
            let made = |made: &PassageSet| {
                let made = *made;
                (0..self.passages).map(move |passage| made.contains(passage)).collect::<Vec<_>>()
            };
            returns.iter().flat_map(made).collect()
        };
        // Of equal rotations the first is taken.
        let largest = (0..self.period()).rev().max_by_key(|&by| digits(&self.begun_after(by)));
        let by = largest.unwrap_or(0);
        (self.begun_at(by), by)
    }

    /// Itineraries in their largest rotation, without duplicates.
    pub fn listed(itineraries: &[Self]) -> Vec<Self> {
        let mut listed: Vec<Self> = Vec::new();
        for (largest, _) in itineraries.iter().map(Self::largest_rotation) {
            if !listed.contains(&largest) {
                listed.push(largest);
            }
        }
        listed
    }

    /// Number of returns by which this itinerary must start later to equal the other; `None` if it
    /// is no rotation of it.
    pub fn rotation_to(&self, other: &Self) -> Option<usize> {
        (0..self.period()).find(|&by| self.begun_after(by) == other.returns)
    }

    /// Itinerary with the contact of a passage of a return added.
    pub(in crate::analysis) fn with_contact(&self, number: usize, passage: usize) -> Self {
        let mut with = self.clone();
        with.returns[number].insert(passage);
        with
    }

    /// Itinerary with the contact of a passage of a return removed.
    pub(in crate::analysis) fn without_contact(&self, number: usize, passage: usize) -> Self {
        let mut without = self.clone();
        let made = self.returns[number].iter();
        without.returns[number] = made.filter(|&other| other != passage).collect();
        without
    }

    /// Itinerary started after a number of returns.
    pub(in crate::analysis) fn begun_at(&self, returns: usize) -> Self {
        Self { returns: self.begun_after(returns), ..*self }
    }

    /// Returns, rotated to start after a number of returns.
    fn begun_after(&self, returns: usize) -> Vec<PassageSet> {
        let mut begun = self.returns.clone();
        begun.rotate_left(returns);
        begun
    }
}

impl fmt::Display for ContactItinerary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, made) in self.returns.iter().enumerate() {
            if number > 0 && self.passages > 1 {
                formatter.write_str(".")?;
            }
            for passage in 0..self.passages {
                formatter.write_str(if made.contains(passage) { "1" } else { "0" })?;
            }
        }
        Ok(())
    }
}

impl From<ContactItinerary> for String {
    fn from(itinerary: ContactItinerary) -> Self {
        let alone = itinerary.passages > 1 && itinerary.period() == 1;
        itinerary.to_string() + if alone { "." } else { "" }
    }
}

impl TryFrom<String> for ContactItinerary {
    type Error = ItineraryError;

    fn try_from(text: String) -> Result<Self, ItineraryError> {
        Self::parse(&text, text.find('.').unwrap_or(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(passages: usize, longest: usize) -> Vec<String> {
        let all = ContactItinerary::all(passages, longest).expect("a short period");
        all.iter().map(ContactItinerary::to_string).collect()
    }

    #[test]
    fn every_itinerary_is_listed_once_beginning_with_contacts() {
        assert_eq!(
            listed(1, 4),
            ["1", "0", "11", "10", "111", "110", "100", "1111", "1110", "1100", "1010", "1000"]
        );
        assert_eq!(
            listed(2, 2),
            [
                "11", "10", "01", "00", "11.11", "11.10", "11.01", "11.00", "10.10", "10.01",
                "10.00", "01.01", "01.00"
            ]
        );
        // Necklaces of two colours with up to twelve beads; only one without contact.
        assert_eq!(listed(1, 12).len(), 801 - 11);
    }

    #[test]
    fn what_is_no_itinerary_is_refused() {
        let refused = |text: &str, passages| ContactItinerary::parse(text, passages).err();
        assert!(matches!(refused("1L0", 1), Some(ItineraryError::NotADigit { found: 'L', .. })));
        assert!(matches!(
            refused("101", 2),
            Some(ItineraryError::NotWholeReturns { found: 3, .. })
        ));
        assert!(refused("", 1).is_some() && refused(&"1".repeat(65), 1).is_some());
        assert!(ContactItinerary::all(2, 7).is_err());
    }

    #[test]
    fn itineraries_of_one_orbit_differ_by_a_rotation() {
        let of = |text| ContactItinerary::parse(text, 1).expect("digits");
        assert_eq!(of("001").rotation_to(&of("100")), Some(2));
        assert_eq!(of("110").rotation_to(&of("100")), None);
        assert!(of("1010").repeats_after(2) && !of("1010").repeats_after(1));
    }

    #[test]
    fn the_largest_rotation_is_that_which_is_listed() {
        for (text, passages, largest, by) in
            [("001", 1, "100", 2), ("0101", 1, "1010", 1), ("01 11 10", 2, "11.10.01", 1)]
        {
            let itinerary = ContactItinerary::parse(text, passages).expect("digits");
            let (found, after) = itinerary.largest_rotation();
            assert_eq!((found.to_string().as_str(), after), (largest, by), "{text}");
        }
    }

    #[test]
    fn an_itinerary_reads_back_from_its_file() {
        for (text, passages) in [("100", 1), ("1", 1), ("10 01", 2), ("10", 2)] {
            let itinerary = ContactItinerary::parse(text, passages).expect("digits");
            let written = serde_json::to_string(&itinerary).expect("text");
            let read: ContactItinerary = serde_json::from_str(&written).expect("its text");
            assert_eq!(read, itinerary, "{written}");
        }
    }
}
