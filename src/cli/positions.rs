//! Numbers as they are typed: offsets from the graze or, with `@`, values.

use std::str::FromStr;

use clap::Args;

use grazemap::numeric::Dd;
use grazemap::pipeline::Graze;
use grazemap::report::Named;

/// Number of a parameter or of a coordinate of the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Position {
    /// Offset from the graze.
    Offset(f64),
    /// Value, typed with `@`.
    Value(f64),
}

impl FromStr for Position {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().strip_prefix('@') {
            Some(value) => value.parse().map(|Finite(value)| Self::Value(value)),
            None => text.parse().map(|Finite(offset)| Self::Offset(offset)),
        }
    }
}

/// Number that is finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Finite(pub(super) f64);

impl FromStr for Finite {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.map(Self).ok_or(format!("`{text}` is no finite number"))
    }
}

/// Number that is finite and above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Positive(pub(super) f64);

impl FromStr for Positive {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Finite(number) = text.parse()?;
        match number > 0.0 {
            true => Ok(Self(number)),
            false => Err(format!("expected a number above 0, found {number}")),
        }
    }
}

/// Option of commands that take positions.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(super) struct Counting {
    /// Read all numbers of parameters and coordinates as values, as if each were written with `@`
    #[arg(long)]
    pub(super) values: bool,
}

/// Graze that offsets are counted from.
pub(super) struct Origin<'a> {
    graze: &'a Graze,
    /// Values of coordinates by name, for a section that is not that of the graze.
    coordinates: Option<Named<f64>>,
    counting: Counting,
}

impl<'a> Origin<'a> {
    pub(super) fn new(graze: &'a Graze, counting: Counting) -> Self {
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
    pub(super) fn offset(&self, name: &str, position: Position) -> f64 {
        match position {
            Position::Offset(offset) if !self.counting.values => offset,
            Position::Offset(value) | Position::Value(value) => {
                (Dd::from(value) - self.grazing(name.trim())).to_f64()
            }
        }
    }

    /// Offsets of positions by name.
    pub(super) fn offsets(&self, positions: &Named<Position>) -> Named<f64> {
        let positions = positions.0.iter();
        Named(positions.map(|(name, at)| (name.clone(), self.offset(name, *at))).collect())
    }

    /// Offsets of positions by name; none where none are given.
    pub(super) fn named(&self, positions: Option<&Named<Position>>) -> Named<f64> {
        positions.map(|positions| self.offsets(positions)).unwrap_or_default()
    }

    /// Offsets of both ends of a range.
    pub(super) fn range(&self, name: &str, ends: [Option<Position>; 2]) -> [Option<f64>; 2] {
        ends.map(|end| end.map(|end| self.offset(name, end)))
    }
}
