//! Resolves the keys of a command: names of parameters and coordinates, itineraries, ends of
//! ranges.
//!
//! Keys are the program's options and the arguments of Python's functions alike.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{ContactItinerary, ItineraryError};
use crate::expansion::LocalMap;
use crate::model::{Scene, nearest};
use crate::numeric::Shown;
use crate::report::Named;

/// Default for the longest period searched, in passages.
const DEFAULT_PASSAGES: usize = 4;

/// Invalid value of a key.
#[derive(Clone, Debug, thiserror::Error)]
pub enum KeyError {
    /// A name is unknown.
    #[error(
        "{key}: {} `{}`{}; {} are {known}",
        .kind[0], .name.escape_default(), meant(.nearest), .kind[1]
    )]
    UnknownName {
        /// Key.
        key: &'static str,
        /// Words about the unknown name, and about the known names.
        kind: [&'static str; 2],
        /// Name given.
        name: String,
        /// Nearest known name.
        nearest: Option<String>,
        /// Known names.
        known: String,
    },
    /// A name is given twice.
    #[error("{key} names `{name}` twice")]
    NamedTwice {
        /// Key.
        key: &'static str,
        /// Name given.
        name: String,
    },
    /// A number is not finite.
    #[error("{key} must be a finite number, found {value}")]
    NotFinite {
        /// Key.
        key: &'static str,
        /// Number given.
        value: f64,
    },
    /// A number is not positive.
    #[error("{key} must be above 0, found {value}")]
    NotPositive {
        /// Key.
        key: &'static str,
        /// Number given.
        value: f64,
    },
    /// A tolerance is a share of a value that is 0.
    #[error("tolerance of {name} is a share of its value in the scene, which is 0")]
    ShareOfZero {
        /// Name of the parameter.
        name: String,
    },
    /// A number is not in its range.
    #[error("{key} must be from {} to {}, found {}", .range[0], .range[1], Shown(*.value))]
    Outside {
        /// Key.
        key: &'static str,
        /// Smallest and largest number.
        range: [f64; 2],
        /// Number given.
        value: f64,
    },
    /// Two keys are given of which only one may be.
    #[error("{} and {} are both given; expected one of them", .keys[0], .keys[1])]
    BothGiven {
        /// Keys.
        keys: [&'static str; 2],
    },
    /// A count is not in its range.
    #[error("{key} must be from 1 to {most}, found {found}")]
    Count {
        /// Key.
        key: &'static str,
        /// Number given.
        found: u64,
        /// Largest number.
        most: u64,
    },
    /// A range does not increase.
    #[error("range of `{name}` does not increase: {from} to {to}")]
    Decreasing {
        /// Name of the axis.
        name: String,
        /// First offset.
        from: f64,
        /// Last offset.
        to: f64,
    },
    /// A negative size.
    #[error("{key} must not be negative, found {value}")]
    Negative {
        /// Key.
        key: &'static str,
        /// Number given.
        value: f64,
    },
    /// The ends of a range are equal or in the wrong order.
    #[error("from must be below to: `{name}` from {} to {}", Shown(*.from), Shown(*.to))]
    Reversed {
        /// Name of the parameter.
        name: String,
        /// First offset.
        from: f64,
        /// Last offset.
        to: f64,
    },
    /// A value is given for a variable that varies.
    #[error("{key} names `{name}`, which varies")]
    Varies {
        /// Key.
        key: &'static str,
        /// Name given.
        name: String,
    },
    /// A key has no effect without another one.
    #[error("{key} needs {needed}")]
    Needs {
        /// Key.
        key: &'static str,
        /// Missing key or condition.
        needed: &'static str,
    },
    /// A list has no names.
    #[error("{key} names none")]
    NothingNamed {
        /// Key.
        key: &'static str,
    },
    /// The number of parameters does not fit a plane.
    #[error(
        "plane takes two parameters; of `orbits` also one, the one that is solved for; found \
         {found}"
    )]
    NotAPlane {
        /// Number of parameters given.
        found: usize,
    },
    /// A range is given for a coordinate that is not an axis.
    #[error("range names `{name}`, which is no axis of the basin")]
    NoAxis {
        /// Name given.
        name: String,
    },
    /// A scale is given for a parameter that is held fixed.
    #[error("scale names `{name}`, which is no parameter that changes")]
    NotNearest {
        /// Name given.
        name: String,
    },
    /// The number of axes, or of cell counts, does not fit a plane.
    #[error("a basin has two axes; found {found}")]
    NotTwoAxes {
        /// Number given.
        found: usize,
    },
    /// Starts are given for orbits of the map, which are solved for without them.
    #[error("start is for orbits of direct simulation (`direct`); those of the map are solved for")]
    StartsOfMap,
    /// The second parameter is one that is adjusted already.
    #[error("`{name}` is already adjusted so that the orbit grazes; continue in another parameter")]
    AlreadyAdjusted {
        /// Name of the parameter.
        name: String,
    },
    /// The map has no parameters.
    #[error("the map has no parameter; name some in `expansion.active`")]
    NoParameter,
    /// The itinerary is invalid, or does not fit the scene.
    #[error(transparent)]
    Itinerary(#[from] ItineraryError),
}

impl KeyError {
    /// Whether the message begins with the key.
    pub fn begins_with_key(&self) -> bool {
        match self {
            Self::UnknownName { .. } | Self::NamedTwice { .. } | Self::NotFinite { .. } => true,
            Self::NotPositive { .. } | Self::NothingNamed { .. } | Self::Count { .. } => true,
            Self::Outside { .. } | Self::BothGiven { .. } => true,
            Self::NotAPlane { .. } | Self::NoAxis { .. } | Self::NotNearest { .. } => true,
            Self::Decreasing { .. } | Self::Negative { .. } | Self::Reversed { .. } => true,
            Self::Varies { .. } | Self::Needs { .. } | Self::ShareOfZero { .. } => true,
            Self::StartsOfMap => true,
            Self::NotTwoAxes { .. } | Self::AlreadyAdjusted { .. } => false,
            Self::NoParameter | Self::Itinerary(_) => false,
        }
    }
}

/// ` (did you mean ...?)`, or the empty text.
fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// Method that computes periodic orbits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OrbitsOf {
    /// The local map.
    #[default]
    Map,
    /// Direct simulation.
    Direct,
}

/// Words about an unknown name and about the known names, for active parameters and coordinates.
pub(super) const ACTIVE: [&str; 2] = ["the map has no variable", "active parameters"];
pub(super) const COORDINATES: [&str; 2] = ["the section has no coordinate", "coordinates"];

/// Offsets in the order of the known names; 0 if not named.
pub(super) fn named_offsets(
    key: &'static str,
    kind: [&'static str; 2],
    named: &Named<f64>,
    known: &[impl AsRef<str>],
) -> Result<Vec<f64>, KeyError> {
    let mut offsets = vec![None; known.len()];
    for (name, offset) in &named.0 {
        let place = place_of(key, kind, name, known)?;
        if offsets[place].replace(finite(key, *offset)?).is_some() {
            return Err(KeyError::NamedTwice { key, name: name.clone() });
        }
    }
    Ok(offsets.into_iter().map(Option::unwrap_or_default).collect())
}

/// Index of a name among the known names.
pub(super) fn place_of(
    key: &'static str,
    kind: [&'static str; 2],
    name: &str,
    known: &[impl AsRef<str>],
) -> Result<usize, KeyError> {
    let name = name.trim();
    let known = || known.iter().map(AsRef::as_ref);
    known().position(|known| known == name).ok_or_else(|| KeyError::UnknownName {
        key,
        kind,
        name: name.to_owned(),
        nearest: nearest(name, known()),
        known: known().collect::<Vec<&str>>().join(", "),
    })
}

/// Refuses a number that is not finite.
pub(super) fn finite(key: &'static str, value: f64) -> Result<f64, KeyError> {
    if value.is_finite() { Ok(value) } else { Err(KeyError::NotFinite { key, value }) }
}

/// Itineraries named, or all of short periods if none is named.
pub(super) fn itineraries(
    named: &[String],
    period: Option<u8>,
    passages: usize,
) -> Result<Vec<ContactItinerary>, ItineraryError> {
    if named.is_empty() {
        return ContactItinerary::all(passages, longest_period(period, passages));
    }
    named.iter().map(|digits| ContactItinerary::parse(digits, passages)).collect()
}

/// Longest period searched, in returns.
pub(super) fn longest_period(period: Option<u8>, passages: usize) -> usize {
    period.map_or((DEFAULT_PASSAGES / passages.max(1)).max(1), usize::from)
}

/// Active parameters of a map, by name.
pub(super) struct ActiveParameters<'a> {
    scene: &'a Scene,
    local: &'a LocalMap,
    pub(super) names: Vec<&'a str>,
}

impl<'a> ActiveParameters<'a> {
    pub(super) fn of(scene: &'a Scene, local: &'a LocalMap) -> Self {
        let names = local.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        Self { scene, local, names }
    }

    /// Index of a parameter.
    pub(super) fn place(&self, key: &'static str, name: &str) -> Result<usize, KeyError> {
        place_of(key, ACTIVE, name, &self.names)
    }

    /// Indices of several distinct parameters.
    pub(super) fn distinct(
        &self,
        key: &'static str,
        names: &[String],
    ) -> Result<Vec<usize>, KeyError> {
        let places = names.iter().map(|name| self.place(key, name));
        let places = places.collect::<Result<Vec<_>, _>>()?;
        let twice = (1..places.len()).find(|&last| places[..last].contains(&places[last]));
        match twice {
            Some(last) => Err(KeyError::NamedTwice { key, name: names[last].trim().to_owned() }),
            None => Ok(places),
        }
    }

    /// Indices of at most two distinct parameters.
    pub(super) fn plane(&self, names: &[String]) -> Result<Vec<usize>, KeyError> {
        match names.len() > 2 {
            true => Err(KeyError::NotAPlane { found: names.len() }),
            false => self.distinct("plane", names),
        }
    }

    /// Index of the first active parameter that is adjusted to graze, else of the first active
    /// parameter.
    pub(super) fn first(&self) -> Result<usize, KeyError> {
        let adjusted = self.scene.grazing.solve_for.iter();
        let mut adjusted = adjusted.map(|&parameter| &self.scene.model.parameters[parameter].name);
        let place = adjusted.find_map(|name| self.names.iter().position(|known| known == name));
        let any = (!self.names.is_empty()).then_some(0);
        place.or(any).ok_or(KeyError::NoParameter)
    }

    /// Half-width of the window in a parameter.
    pub(super) fn width(&self, place: usize) -> f64 {
        self.local.window.parameter[place]
    }

    /// Offsets of all parameters, 0 except one.
    pub(super) fn one(&self, place: usize, offset: f64) -> Vec<f64> {
        let mut offsets = vec![0.0; self.names.len()];
        offsets[place] = offset;
        offsets
    }

    /// Offsets of all parameters; 0 if not named.
    pub(super) fn offsets(
        &self,
        key: &'static str,
        named: &Named<f64>,
    ) -> Result<Vec<f64>, KeyError> {
        named_offsets(key, ACTIVE, named, &self.names)
    }

    /// Offsets given by the key `at`.
    pub(super) fn at(&self, named: &Named<f64>) -> Result<Vec<f64>, KeyError> {
        self.offsets("at", named)
    }

    /// Offsets given by the key `at`, of parameters other than those that vary.
    pub(super) fn at_beside(
        &self,
        named: &Named<f64>,
        varying: &[usize],
    ) -> Result<Vec<f64>, KeyError> {
        let offsets = self.at(named)?;
        let mut names = varying.iter().map(|&place| self.names[place]);
        match names.find(|name| named.0.iter().any(|(given, _)| given.trim() == *name)) {
            Some(name) => Err(KeyError::Varies { key: "at", name: name.to_owned() }),
            None => Ok(offsets),
        }
    }

    /// Range of a parameter: as given, else that of the window.
    pub(super) fn range(
        &self,
        place: usize,
        from: Option<f64>,
        to: Option<f64>,
    ) -> Result<[f64; 2], KeyError> {
        if let (Some(from), Some(to)) = (from, to)
            && from >= to
        {
            return Err(KeyError::Reversed { name: self.names[place].to_owned(), from, to });
        }
        let width = self.width(place);
        Ok([finite("from", from.unwrap_or(-width))?, finite("to", to.unwrap_or(width))?])
    }
}
