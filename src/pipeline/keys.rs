//! What the keys of a command name: parameters, coordinates, itineraries, ends of ranges.
//!
//! The program's options and the arguments of Python's functions are the same keys; what they
//! stand for is found here once.

use serde::{Deserialize, Serialize};

use crate::analysis::periodic::{ContactItinerary, ItineraryError};
use crate::expansion::LocalMap;
use crate::model::{Scene, nearest};
use crate::report::Named;

/// Passages of the longest period that is looked for where none is named.
const DEFAULT_PASSAGES: usize = 4;

/// A key whose value asks for nothing that there is.
#[derive(Clone, Debug, thiserror::Error)]
pub enum KeyError {
    /// A name that is none of those known; what it would have to be, and what those known are.
    #[error(
        "{key}: {} `{}`{}; {} are {known}",
        .kind[0], .name.escape_default(), meant(.nearest), .kind[1]
    )]
    UnknownName {
        /// The key.
        key: &'static str,
        /// What is said of a name that is not known, and of those known.
        kind: [&'static str; 2],
        /// The name.
        name: String,
        /// The nearest name.
        nearest: Option<String>,
        /// The names known.
        known: String,
    },
    /// A name that stands twice.
    #[error("{key} names `{name}` twice")]
    NamedTwice {
        /// The key.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A number that is not finite.
    #[error("{key} must be a finite number, found {value}")]
    NotFinite {
        /// The key.
        key: &'static str,
        /// The number.
        value: f64,
    },
    /// A number that is to be above 0.
    #[error("{key} must be above 0, found {value}")]
    NotPositive {
        /// The key.
        key: &'static str,
        /// The number.
        value: f64,
    },
    /// A list without names.
    #[error("{key} names none")]
    NothingNamed {
        /// The key.
        key: &'static str,
    },
    /// More parameters than a locus has.
    #[error(
        "in takes two parameters; of `orbits` also one, the one that is solved for; found {found}"
    )]
    NotAPlane {
        /// How many were named.
        found: usize,
    },
    /// A range along what is no axis.
    #[error("range names `{name}`, which is no axis of the basin; name it in --axes")]
    NoAxis {
        /// The name.
        name: String,
    },
    /// A scale of a parameter that does not change.
    #[error("scale names `{name}`, which is no parameter of --nearest")]
    NotNearest {
        /// The name.
        name: String,
    },
    /// Another number of axes, or of numbers of cells, than a plane has.
    #[error("a basin has two axes; found {found}")]
    NotTwoAxes {
        /// How many were named.
        found: usize,
    },
    /// Starts of orbits that need none.
    #[error("start is for orbits of direct simulation (`direct`); those of the map are solved for")]
    StartsOfMap,
    /// A second parameter that is the first one.
    #[error("`{name}` is already adjusted so that the orbit grazes; continue in another parameter")]
    AlreadyAdjusted {
        /// The parameter.
        name: String,
    },
    /// A map without parameters.
    #[error("the map has no parameter; name some in `expansion.active`")]
    NoParameter,
    /// No itinerary, or not of this scene.
    #[error(transparent)]
    Itinerary(#[from] ItineraryError),
}

impl KeyError {
    /// Whether the words begin with the key.
    pub fn begins_with_key(&self) -> bool {
        match self {
            Self::UnknownName { .. } | Self::NamedTwice { .. } | Self::NotFinite { .. } => true,
            Self::NotPositive { .. } | Self::NothingNamed { .. } => true,
            Self::NotAPlane { .. } | Self::NoAxis { .. } | Self::NotNearest { .. } => true,
            Self::StartsOfMap => true,
            Self::NotTwoAxes { .. } | Self::AlreadyAdjusted { .. } => false,
            Self::NoParameter | Self::Itinerary(_) => false,
        }
    }
}

/// ` (did you mean ...?)`, or nothing.
fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// Whose orbits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OrbitsOf {
    /// The local map's.
    #[default]
    Map,
    /// Those of direct simulation.
    Direct,
}

/// What a name would have to be: what is said of one that is not known, and of those known.
pub(super) const ACTIVE: [&str; 2] = ["the map has no variable", "active parameters"];
pub(super) const COORDINATES: [&str; 2] = ["the section has no coordinate", "coordinates"];

/// Offsets by name among those known; those not named are 0.
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

/// The place of a name among those known.
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

/// A number that is finite.
pub(super) fn finite(key: &'static str, value: f64) -> Result<f64, KeyError> {
    if value.is_finite() { Ok(value) } else { Err(KeyError::NotFinite { key, value }) }
}

/// The itineraries named, or all of short periods.
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

/// Returns of the longest period that is looked for.
pub(super) fn longest_period(period: Option<u8>, passages: usize) -> usize {
    period.map_or((DEFAULT_PASSAGES / passages.max(1)).max(1), usize::from)
}

/// The active parameters of a map by name.
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

    /// The number of a parameter.
    pub(super) fn place(&self, key: &'static str, name: &str) -> Result<usize, KeyError> {
        place_of(key, ACTIVE, name, &self.names)
    }

    /// The numbers of several, none named twice.
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

    /// The numbers of at most two that span a plane.
    pub(super) fn plane(&self, names: &[String]) -> Result<Vec<usize>, KeyError> {
        match names.len() > 2 {
            true => Err(KeyError::NotAPlane { found: names.len() }),
            false => self.distinct("in", names),
        }
    }

    /// The first that is adjusted so that the orbit grazes; where the map has none of those, its
    /// first.
    pub(super) fn first(&self) -> Result<usize, KeyError> {
        let adjusted = self.scene.grazing.solve_for.iter();
        let mut adjusted = adjusted.map(|&parameter| &self.scene.model.parameters[parameter].name);
        let place = adjusted.find_map(|name| self.names.iter().position(|known| known == name));
        let any = (!self.names.is_empty()).then_some(0);
        place.or(any).ok_or(KeyError::NoParameter)
    }

    /// Its half-width in the window.
    pub(super) fn width(&self, place: usize) -> f64 {
        self.local.window.parameter[place]
    }

    /// Offsets, all 0 but one.
    pub(super) fn one(&self, place: usize, offset: f64) -> Vec<f64> {
        let mut offsets = vec![0.0; self.names.len()];
        offsets[place] = offset;
        offsets
    }

    /// Offsets by name; those not named are 0.
    pub(super) fn offsets(
        &self,
        key: &'static str,
        named: &Named<f64>,
    ) -> Result<Vec<f64>, KeyError> {
        named_offsets(key, ACTIVE, named, &self.names)
    }

    /// Offsets by name under `at`.
    pub(super) fn at(&self, named: &Named<f64>) -> Result<Vec<f64>, KeyError> {
        self.offsets("at", named)
    }

    /// The range of a parameter: as given, or that of the window.
    pub(super) fn range(
        &self,
        place: usize,
        from: Option<f64>,
        to: Option<f64>,
    ) -> Result<[f64; 2], KeyError> {
        let width = self.width(place);
        Ok([finite("from", from.unwrap_or(-width))?, finite("to", to.unwrap_or(width))?])
    }
}
