//! Saved orbits and maps, and the inputs that a command accepts in place of a scene.
//!
//! A saved value contains the text of its scene, so that direct simulation and the page need no
//! other file. A listing for people stands beside the numbers that are read back.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::map::Parts;
use super::{Error, FindGraze, Graze, Map, Plan, Settled};
use crate::convergence::{Choice, SectionVerdict};
use crate::expansion::{LocalMap, Stage, WindowEdge, check_orders};
use crate::jet::Jet;
use crate::model::{Digest, Scene, Section, SectionRule, Window, catalogue, nearest};
use crate::orbit::{GrazingOrbit, PoincareSection};
use crate::report::{
    Document, DocumentKind, MapListing, OrbitListing, ReportError, to_json, write_atomically,
};

/// Name of standard input in messages.
const STANDARD_INPUT: &str = "standard input";

/// Whether a path means standard input.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Input of a command: a scene, or a result that was saved.
#[derive(Clone, Debug)]
pub enum Source {
    /// Scene.
    Scene(Box<Scene>),
    /// Grazing orbit of a scene.
    Graze(Graze),
    /// Map of a scene.
    Map(Map),
}

impl Source {
    /// Opens the scene file, saved orbit or saved map at a path; if there is no such file, the
    /// scene of that name in the catalogue. `-` is a scene on standard input.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] for a scene with a fault, [`Error::NotSaved`] for a JSON document that is
    /// not an orbit or a map, [`Error::FixedValues`] for overrides of saved results.
    pub fn open(path: &Path, overrides: &[(String, String)]) -> Result<Self, Error> {
        if is_standard(path) {
            let text = io::read_to_string(bounded(io::stdin().lock()))
                .map_err(|source| Error::Unreadable { path: STANDARD_INPUT.into(), source })?;
            let scene = Scene::parse_with(&text, STANDARD_INPUT, overrides)?;
            return Ok(Self::Scene(Box::new(scene)));
        }
        let extension = path.extension();
        if path.exists() && extension.is_some_and(|extension| extension == "json") {
            return match overrides.first() {
                None => Self::from_json(&read(path)?, path),
                Some((key, _)) => {
                    Err(Error::FixedValues { path: path.to_owned(), key: key.clone() })
                }
            };
        }
        let name = path.display().to_string();
        // NOTE: a folder of results often has the name of its scene.
        let hidden = path.exists() && !path.is_dir();
        let scene = match path.to_str().and_then(catalogue::text).filter(|_| !hidden) {
            Some(text) => Scene::parse_with(text, &format!("{name}.toml"), overrides)?,
            None if path.exists() => Scene::load_with(path, overrides)?,
            None => {
                return Err(Error::NoSuchScene {
                    path: path.to_owned(),
                    nearest: nearest(&name, catalogue::names()),
                });
            }
        };
        Ok(Self::Scene(Box::new(scene)))
    }

    /// Parses a saved orbit or map. `path` is its name in messages.
    fn from_json(text: &str, path: &Path) -> Result<Self, Error> {
        let refused = |reason: String| Error::NotSaved { path: path.to_owned(), reason };
        let kind = kind_of(text).map_err(refused)?;
        match kind {
            DocumentKind::Orbit => graze_from(text).map(Self::Graze).map_err(refused),
            DocumentKind::Map => map_from(text).map(Self::Map).map_err(refused),
            other => Err(refused(format!("it is a document of kind {other:?}"))),
        }
    }

    /// Scene.
    pub fn scene(&self) -> &Scene {
        match self {
            Self::Scene(scene) => scene,
            Self::Graze(graze) => graze.scene(),
            Self::Map(map) => map.settled().scene(),
        }
    }

    /// Scene with its grazing orbit.
    ///
    /// # Errors
    ///
    /// As [`FindGraze::graze`].
    pub fn graze(self) -> Result<Graze, Error> {
        match self {
            Self::Scene(scene) => scene.graze(),
            Self::Graze(graze) => Ok(graze),
            Self::Map(map) => Ok(map.settled().graze().clone()),
        }
    }

    /// Map, read or expanded.
    ///
    /// # Errors
    ///
    /// As [`settle`](Self::settle), [`Settled::plan`] and [`Plan::expand`].
    pub fn map(self) -> Result<Map, Error> {
        match self {
            Self::Map(map) => Ok(map),
            other => other.settle()?.plan()?.expand(),
        }
    }

    /// Free flight alone, for requests answered by direct simulation; a saved map is returned as it
    /// is.
    ///
    /// A scene that allows any section gets the one that its map would have.
    ///
    /// # Errors
    ///
    /// As [`settle`](Self::settle) and [`Settled::free_flight`].
    pub fn free_flight(self) -> Result<Map, Error> {
        match self {
            Self::Map(map) => Ok(map),
            other if matches!(other.scene().section_rule, SectionRule::Any) => {
                other.settle()?.free_flight()
            }
            other => Settled { graze: other.graze()?, verdict: None }.free_flight(),
        }
    }

    /// Map, or the free flight alone if contacts have no expansion: for requests answered by direct
    /// simulation in which a map helps.
    ///
    /// # Errors
    ///
    /// As [`free_flight`](Self::free_flight).
    pub fn map_or_free_flight(self) -> Result<Map, Error> {
        let graze = match self {
            Self::Map(map) => return Ok(map),
            other => other.graze()?,
        };
        let expanded = check_orders(graze.scene()).map_err(Error::from).and_then(|()| graze.map());
        expanded.or_else(|error| Ok(Self::Graze(graze).free_flight()?.missing_contacts(&error)))
    }

    /// Scene with its orbit, on the section of its map.
    ///
    /// # Errors
    ///
    /// As [`graze`](Self::graze) and [`Graze::settle`].
    pub fn settle(self) -> Result<Settled, Error> {
        match self {
            Self::Map(map) => Ok(map.settled().clone()),
            other => other.graze()?.settle(),
        }
    }
}

/// Text of a scene, and the settings that differ from it once the scene is settled.
#[derive(Serialize, Deserialize)]
struct SavedScene {
    identifier: String,
    text: String,
    section: Section,
    section_rule: SectionRule,
    window: Window,
}

impl SavedScene {
    fn of(scene: &Scene) -> Self {
        Self {
            identifier: scene.identifier.clone(),
            text: scene.text.to_string(),
            section: scene.section,
            section_rule: scene.section_rule,
            window: scene.window.clone(),
        }
    }

    fn read(self) -> Result<Scene, String> {
        let file = format!("{}.toml", self.identifier);
        let mut scene = Scene::parse(&self.text, &file).map_err(|error| error.to_string())?;
        let lengths = [&scene.window, &self.window].map(|w| (w.state.len(), w.parameter.len()));
        expect(lengths[0] == lengths[1], "half-widths")?;
        scene.identifier = self.identifier;
        (scene.section, scene.section_rule) = (self.section, self.section_rule);
        scene.window = self.window;
        Ok(scene)
    }
}

/// Saved orbit without its listing.
#[derive(Serialize, Deserialize)]
struct SavedOrbit<O> {
    source: SavedScene,
    orbit: O,
}

/// Part of a map's document that is read back; the listing for people stands beside it. The types
/// are references when it is written, and owned values when it is read.
#[derive(Serialize, Deserialize)]
struct SavedMap<O, V, C, E, M> {
    source: SavedScene,
    orbit: O,
    verdict: V,
    choice: C,
    window_edges: E,
    map: M,
}

type ReadMap =
    SavedMap<GrazingOrbit, Option<SectionVerdict>, Option<Choice>, Vec<WindowEdge>, LocalMap>;

/// Listing for people, together with the values that are read back.
#[derive(Serialize)]
struct Both<L, S> {
    #[serde(flatten)]
    listing: L,
    #[serde(flatten)]
    saved: S,
}

impl Graze {
    /// JSON document of the orbit, for people, programs and [`from_json`](Self::from_json).
    ///
    /// # Errors
    ///
    /// Never in practice: all keys are text.
    pub fn to_json(&self) -> Result<String, Error> {
        self.to_json_with(&())
    }

    /// JSON document of the orbit with further fields about the graze, which are not read back.
    /// `more` must serialise to named fields.
    ///
    /// # Errors
    ///
    /// As [`to_json`](Self::to_json).
    pub fn to_json_with(&self, more: &impl Serialize) -> Result<String, Error> {
        let (scene, orbit) = (self.scene(), self.orbit());
        let saved = SavedOrbit { source: SavedScene::of(scene), orbit };
        let listing = OrbitListing::new(scene, orbit);
        let both = Both { listing: Both { listing, saved: more }, saved };
        sealed(&Document::new(DocumentKind::Orbit, scene, both))
    }

    /// Reads an orbit from its JSON document, bit by bit.
    ///
    /// # Errors
    ///
    /// [`Error::NotSaved`] for any other text.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        of_kind(text, DocumentKind::Orbit, graze_from).map_err(in_text)
    }

    /// Writes the JSON document of the orbit atomically.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        Ok(write_atomically(path.as_ref(), self.to_json()?.as_bytes())?)
    }

    /// Reads a saved orbit.
    ///
    /// # Errors
    ///
    /// [`Error::Unreadable`], [`Error::NotSaved`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let orbit = of_kind(&read(path)?, DocumentKind::Orbit, graze_from);
        orbit.map_err(|reason| Error::NotSaved { path: path.to_owned(), reason })
    }
}

impl Map {
    /// JSON document of the map: coefficients by name, for people and programs, and everything that
    /// [`from_json`](Self::from_json) needs.
    ///
    /// # Errors
    ///
    /// As [`listing`](Self::listing).
    pub fn to_json(&self) -> Result<String, Error> {
        let (settled, scene) = (self.settled(), self.settled().scene());
        let untimed = |choice: &Choice| Choice { seconds: 0.0, ..choice.clone() };
        let verdict = settled.verdict.as_deref().map(|verdict| {
            let mut verdict = verdict.clone();
            let others = verdict.others.iter_mut();
            for section in others.chain([&mut verdict.taken]) {
                section.choice = section.choice.as_ref().map(untimed);
            }
            verdict
        });
        let saved = SavedMap {
            source: SavedScene::of(scene),
            orbit: self.orbit(),
            verdict,
            choice: self.choice().map(untimed),
            window_edges: self.window_edges(),
            map: self.local(),
        };
        let listing = self.listing()?;
        let both = Both { listing, saved };
        sealed(&Document::new(DocumentKind::Map, scene, both))
    }

    /// Reads a map from its JSON document, bit by bit.
    ///
    /// # Errors
    ///
    /// [`Error::NotSaved`] for any other text.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        of_kind(text, DocumentKind::Map, map_from).map_err(in_text)
    }

    /// Writes the JSON document of the map atomically.
    ///
    /// # Errors
    ///
    /// As [`to_json`](Self::to_json); [`Error::Report`] if the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        Ok(write_atomically(path.as_ref(), self.to_json()?.as_bytes())?)
    }

    /// Reads a saved map.
    ///
    /// # Errors
    ///
    /// [`Error::Unreadable`], [`Error::NotSaved`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let map = of_kind(&read(path)?, DocumentKind::Map, map_from);
        map.map_err(|reason| Error::NotSaved { path: path.to_owned(), reason })
    }
}

fn in_text(reason: String) -> Error {
    Error::NotSaved { path: "the text".into(), reason }
}

/// Text of a file.
pub(super) fn read(path: &Path) -> Result<String, Error> {
    let text = File::open(path).and_then(|file| io::read_to_string(bounded(file)));
    text.map_err(|source| Error::Unreadable { path: path.to_owned(), source })
}

/// Limit of bytes read of a document or a table: more than any map needs.
const LARGEST_INPUT: u64 = 1 << 30;

/// Reader that fails if its input has 2^30 bytes or more: a device or a line may be endless.
pub fn bounded(reader: impl Read) -> impl Read {
    Bounded(reader.take(LARGEST_INPUT))
}

struct Bounded<R>(io::Take<R>);

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(bytes)?;
        match self.0.limit() {
            0 => Err(io::Error::new(
                io::ErrorKind::FileTooLarge,
                format!("it has {LARGEST_INPUT} bytes or more"),
            )),
            _ => Ok(count),
        }
    }
}

/// Key of the digest in a saved document.
const INTEGRITY: &str = "integrity";

/// Document as text, with the digest of its other members.
fn sealed(document: &impl Serialize) -> Result<String, Error> {
    let mut value = serde_json::to_value(document).map_err(ReportError::from)?;
    let digest = content_digest(&value);
    value[INTEGRITY] = digest.to_string().into();
    Ok(to_json(&value)?)
}

/// Digest of all members except the digest itself, independent of order and layout.
fn content_digest(document: &Value) -> Digest {
    let mut content = document.clone();
    if let Some(members) = content.as_object_mut() {
        members.remove(INTEGRITY);
    }
    content.sort_all_objects();
    Digest::of(&content.to_string())
}

/// Refuses a document that was changed after it was saved. A document without a digest is accepted.
fn check_integrity(text: &str) -> Result<(), String> {
    let document: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    match document.get(INTEGRITY) {
        Some(stated) if *stated != content_digest(&document).to_string() => Err(format!(
            "its numbers are not those that were saved; to use it as it is now, remove its \
             `{INTEGRITY}`"
        )),
        _ => Ok(()),
    }
}

/// Kind of a document.
pub(super) fn kind_of(text: &str) -> Result<DocumentKind, String> {
    #[derive(Deserialize)]
    struct Heading {
        document: DocumentKind,
        format: u32,
    }
    let heading: Heading = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let (expected, found) = (DocumentKind::FORMAT, heading.format);
    if expected != found {
        return Err(format!("expected format {expected}, found format {found}"));
    }
    Ok(heading.document)
}

fn of_kind<T>(
    text: &str,
    expected: DocumentKind,
    of: impl Fn(&str) -> Result<T, String>,
) -> Result<T, String> {
    match kind_of(text)? {
        found if found == expected => of(text),
        found => Err(format!("expected a document of kind {expected:?}, found {found:?}")),
    }
}

fn graze_from(text: &str) -> Result<Graze, String> {
    check_integrity(text)?;
    let saved: SavedOrbit<GrazingOrbit> =
        serde_json::from_str(text).map_err(|error| error.to_string())?;
    let scene = saved.source.read()?;
    check_orbit(&scene, &saved.orbit)?;
    Ok(Graze::new(scene, saved.orbit))
}

fn map_from(text: &str) -> Result<Map, String> {
    check_integrity(text)?;
    let wrong = |error: serde_json::Error| error.to_string();
    let saved: ReadMap = serde_json::from_str(text).map_err(wrong)?;
    let listing: MapListing = serde_json::from_str(text).map_err(wrong)?;
    let scene = saved.source.read()?;
    check_orbit(&scene, &saved.orbit)?;
    check_map(&scene, &saved.map)?;
    saved.orbit.physical(&scene).map_err(|reason| reason.to_string())?;
    let window = listing.window.clone();
    expect(window.bounds.len() == saved.map.window.bounds().count(), "bounds")?;
    expect(window.errors.len() == saved.map.dimension(), "errors")?;
    let settled =
        Settled { graze: Graze::new(scene, saved.orbit), verdict: saved.verdict.map(Arc::new) };
    let plan = Plan::new(settled, saved.map.orders, saved.choice);
    Ok(Map::new(Parts {
        window_edges: saved.window_edges,
        listing: OnceLock::from(listing),
        ..Parts::new(plan, saved.map, window)
    }))
}

fn expect(holds: bool, what: &str) -> Result<(), String> {
    match holds {
        true => Ok(()),
        false => Err(format!("its {what} are not those of its scene")),
    }
}

/// Checks the sizes of an orbit against its scene: the file may have been written by anyone.
fn check_orbit(scene: &Scene, orbit: &GrazingOrbit) -> Result<(), String> {
    let (model, passages) = (&scene.model, scene.grazing.passages.len());
    let dimension = model.dimension();
    let fits = |section: &PoincareSection| {
        let coordinates = (0..dimension).filter(|&component| component != section.eliminated);
        section.eliminated < dimension && coordinates.eq(section.coordinates.iter().copied())
    };
    expect(orbit.digest == scene.digest, "digests")?;
    expect(orbit.passages.len() == passages, "passages")?;
    for graze in &orbit.passages {
        expect(graze.surface < model.surfaces.len(), "surfaces")?;
        expect(graze.state.len() == dimension, "states")?;
        expect(graze.parameters.len() == model.parameters.len(), "parameters")?;
        expect(fits(&graze.section), "sections")?;
    }
    let passes_through = orbit.clearance.is_some_and(|clearance| clearance < 0.0);
    if passes_through && orbit.penetration.is_none() {
        return Err(
            "its orbit passes through a surface, as an earlier version accepted it; begin \
                    with its scene"
                .to_owned(),
        );
    }
    let beyond = orbit.penetration.iter();
    let mut beyond = beyond.map(|at| (at.surface, at.state.len()));
    expect(beyond.all(|at| at.0 < model.surfaces.len() && at.1 == dimension), "penetrations")?;
    let rows = orbit.monodromy.iter().all(|row| row.len() + 1 == dimension);
    expect(rows && orbit.monodromy.len() + 1 == dimension, "multipliers")?;
    let mut pairs = orbit.conditions.iter();
    expect(pairs.all(|pair| pair.from.max(pair.to) < passages), "conditions")?;
    expect(fits(&orbit.section) && orbit.section_point.len() == dimension, "sections")
}

/// Checks the sizes of a map against its scene.
fn check_map(scene: &Scene, map: &LocalMap) -> Result<(), String> {
    let coordinates = scene.model.dimension() - 1;
    let parameters = scene.expansion.active.len();
    let variables = coordinates + parameters;
    let all = |jets: &[Jet<f64>], count: usize, variables: usize| {
        let mut spaces = jets.iter().map(|jet| jet.space().variables());
        jets.len() == count && spaces.all(|found| found == variables)
    };
    expect(map.digest == scene.digest, "digests")?;
    let section = &map.section;
    let lengths = [section.coordinates.len(), section.point.len(), map.window.state.len()];
    expect(lengths == [coordinates; 3], "coordinates")?;
    let lengths = [map.parameters.len(), map.window.parameter.len()];
    expect(lengths == [parameters; 2], "parameters")?;
    let passages = scene.grazing.passages.len();
    expect([map.surfaces.len(), map.passages()] == [passages; 2], "passages")?;
    for stage in &map.stages {
        let fits = match stage {
            Stage::Leg(leg) => all(&leg.image, coordinates, variables),
            Stage::Contact(contact) => {
                let form = contact.depth_form.as_ref();
                all(&contact.linear, coordinates, variables)
                    && all(&contact.quadratic, coordinates, variables)
                    && contact.depth.space().variables() == variables
                    && contact.powers.fits(coordinates, parameters)
                    && form.is_none_or(|form| {
                        form.replaced < coordinates
                            && all(&form.corrections, coordinates, variables + 1)
                    })
            }
            Stage::Flown(flown) => flown.fits(coordinates, parameters),
        };
        expect(fits, "polynomials")?;
    }
    Ok(())
}
