//! Numbers of parameters and coordinates as people give them: offsets from the graze or, with `@`,
//! values.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Graze;
use crate::numeric::Dd;
use crate::report::Named;

/// Number of a parameter or of a coordinate of the section.
///
/// In JSON an offset is a number, and a value a text, as `"@2.25"`.
///
/// ```
/// use grazemap::pipeline::Position;
///
/// assert_eq!("-1e-3".parse(), Ok(Position::Offset(-1e-3)));
/// assert_eq!("@2.25".parse(), Ok(Position::Value(2.25)));
/// assert_eq!(Position::from(0.5), Position::Offset(0.5));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub enum Position {
    /// Offset from the graze.
    Offset(f64),
    /// Value.
    Value(f64),
}

/// Position in JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Offset(f64),
    Text(String),
}

impl TryFrom<Written> for Position {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        match written {
            Written::Offset(offset) => Ok(Self::Offset(offset)),
            Written::Text(text) => text.parse(),
        }
    }
}

impl From<Position> for Written {
    fn from(position: Position) -> Self {
        match position {
            Position::Offset(offset) => Self::Offset(offset),
            Position::Value(_) => Self::Text(position.to_string()),
        }
    }
}

impl From<f64> for Position {
    /// An offset.
    fn from(offset: f64) -> Self {
        Self::Offset(offset)
    }
}

impl fmt::Display for Position {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Offset(offset) => write!(formatter, "{offset:?}"),
            Self::Value(value) => write!(formatter, "@{value:?}"),
        }
    }
}

impl FromStr for Position {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().strip_prefix('@') {
            Some(value) => finite(value).map(Self::Value),
            None => finite(text).map(Self::Offset),
        }
    }
}

/// First and last position of a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ends(pub [Position; 2]);

impl From<[f64; 2]> for Ends {
    /// A range of offsets.
    fn from(ends: [f64; 2]) -> Self {
        Self(ends.map(Position::Offset))
    }
}

impl FromStr for Ends {
    type Err = String;

    /// Reads `FROM:TO`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (from, to) = text.split_once(':').ok_or("expected NAME=FROM:TO")?;
        Ok(Self([from.parse()?, to.parse()?]))
    }
}

/// Reads a finite number.
///
/// # Errors
///
/// Words about the text.
pub fn finite(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is no finite number"))
}

/// Whether all numbers of parameters and coordinates are values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(transparent)]
pub struct Counting {
    /// Read all numbers of parameters and coordinates as values, as if each were written with `@`.
    #[cfg_attr(feature = "cli", arg(long))]
    pub values: bool,
}

/// Graze that offsets are counted from.
#[derive(Debug)]
pub struct Origin<'a> {
    graze: &'a Graze,
    /// Values of coordinates by name, for a section that is not that of the graze.
    coordinates: Option<Named<f64>>,
    counting: Counting,
}

impl<'a> Origin<'a> {
    /// Origin of a graze.
    pub fn new(graze: &'a Graze, counting: Counting) -> Self {
        Self { graze, coordinates: None, counting }
    }

    /// Origin with its own values of coordinates, in the place of those of the section.
    pub(super) fn with_coordinates(self, coordinates: Named<f64>) -> Self {
        Self { coordinates: Some(coordinates), ..self }
    }

    /// Value of a parameter, or of a coordinate of the section, at the graze; 0 for another name,
    /// which whoever takes the offset refuses.
    fn grazing(&self, name: &str) -> Dd {
        let (scene, orbit) = (self.graze.scene(), self.graze.orbit());
        let mut parameters = scene.model.parameters.iter();
        if let Some(number) = parameters.position(|parameter| parameter.name == name) {
            return orbit.parameters()[number];
        }
        if let Some(Named(coordinates)) = &self.coordinates {
            let known = coordinates.iter().find(|(known, _)| known == name);
            return known.map_or(Dd::ZERO, |(_, value)| Dd::from(*value));
        }
        let mut coordinates = orbit.section_coordinates(scene).into_iter();
        coordinates.find(|(known, _)| *known == name).map_or(Dd::ZERO, |(_, value)| value)
    }

    /// Offset of one position.
    fn offset(&self, name: &str, position: Position) -> f64 {
        match position {
            Position::Offset(offset) if !self.counting.values => offset,
            Position::Offset(value) | Position::Value(value) => {
                (Dd::from(value) - self.grazing(name.trim())).to_f64()
            }
        }
    }

    /// Offsets of positions by name; none where none are given.
    pub fn offsets<'p>(&self, positions: impl Into<Option<&'p Named<Position>>>) -> Named<f64> {
        let positions = positions.into().into_iter().flat_map(|Named(positions)| positions);
        Named(positions.map(|(name, at)| (name.clone(), self.offset(name, *at))).collect())
    }

    /// Offsets of both ends of ranges by name; none where none are given.
    pub fn ranges<'r>(&self, ranges: impl Into<Option<&'r Named<Ends>>>) -> Named<[f64; 2]> {
        let ends = |(name, Ends(ends)): &(String, Ends)| {
            (name.clone(), ends.map(|end| self.offset(name, end)))
        };
        Named(ranges.into().into_iter().flat_map(|Named(ranges)| ranges).map(ends).collect())
    }

    /// Whether a position is counted from the graze.
    fn is_offset(&self, position: Position) -> bool {
        matches!(position, Position::Offset(_)) && !self.counting.values
    }

    /// Remarks on positions by name that are counted from the graze and look like values.
    pub(super) fn remarks<'p>(
        &self,
        key: &str,
        positions: impl Into<Option<&'p Named<Position>>>,
    ) -> Vec<String> {
        let positions = positions.into().into_iter().flat_map(|Named(positions)| positions);
        let remarks =
            positions.filter_map(|(name, at)| self.range_remark(key, name, [Some(*at), None]));
        remarks.collect()
    }

    /// Remark on the ends of a range of one parameter, if they are counted from the graze and look
    /// like values.
    pub fn range_remark(
        &self,
        key: &str,
        name: &str,
        ends: [Option<Position>; 2],
    ) -> Option<String> {
        let given = ends.into_iter().flatten();
        if !given.clone().all(|end| self.is_offset(end)) {
            return None;
        }
        let offsets: Vec<f64> = given.map(|end| self.offset(name, end)).collect();
        self.graze.offset_remark(key, name, &offsets)
    }

    /// Offsets of both ends of a range of one parameter.
    pub fn range(&self, name: &str, ends: [Option<Position>; 2]) -> [Option<f64>; 2] {
        ends.map(|end| end.map(|end| self.offset(name, end)))
    }
}
