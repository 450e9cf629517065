//! `atlas`: a map over a whole region about the grazing orbit, measured against direct simulation;
//! and its file.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::analysis::{
    AnalysisError, AtlasRegion, AtlasStudy, AtlasWork, Progress, StroboscopicPoint, atlas_bytes,
    atlas_study,
};
use crate::atlas::{AtlasOptions, RegionError, SavedAtlas};
use crate::model::{Digest, Scene};
use crate::numeric::Dd;
use crate::pipeline::keys::{KeyError, finite};
#[cfg(feature = "cli")]
use crate::pipeline::options::{positions, ranges};
#[cfg(feature = "cli")]
use crate::pipeline::positions::finite as finite_number;
use crate::pipeline::positions::{Counting, Ends, Origin, Position};
use crate::pipeline::{Answer, Error, Graze, bounded, parameter_number, refuse_memory};
use crate::report::{
    AtlasListing, Document, DocumentKind, Named, atlas_figure, to_json, write_atomically,
};

/// First line of a saved atlas; the digest of the rest is the second line.
const HEADING: &str = "grazemap atlas 1";

/// Keys of `atlas`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct AtlasKeys {
    /// First and last offset of states, and of parameters that become coordinates, from the
    /// grazing orbit at the phase, or with `@` their values. Default: states within a twentieth of
    /// their extent along the orbit.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=FROM:TO,...",
            value_parser = ranges,
            conflicts_with = "load"
        )
    )]
    pub range: Option<Named<Ends>>,
    /// Offsets of parameters that are fixed (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=OFFSET,...",
            value_parser = positions,
            conflicts_with = "load"
        )
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Phase of the section. Default: the scene's, or the phase farthest from all stops.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "PHASE",
            value_parser = finite_number,
            conflicts_with = "load"
        )
    )]
    pub phase: Option<f64>,
    /// Largest error, in widths of the region.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "E",
            default_value = "1e-6",
            value_parser = finite_number,
            conflicts_with = "load"
        )
    )]
    pub tolerance: f64,
    /// Order of the polynomials, from 3 to 20.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = AtlasKeys::ORDER,
            conflicts_with = "load",
            value_parser = clap::value_parser!(u32).range(3..=20)
        )
    )]
    pub order: u32,
    /// Most halvings of a box; smaller boxes are simulated.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = AtlasKeys::DEPTH,
            conflicts_with = "load",
            value_parser = clap::value_parser!(u32).range(0..=60)
        )
    )]
    pub depth: u32,
    /// Most boxes that are expanded, from here on; points of other boxes are simulated.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = AtlasKeys::BOXES,
            value_parser = clap::value_parser!(u32).range(0..=100_000_000)
        )
    )]
    pub boxes: u32,
    /// Number of points at which the atlas is made and compared with direct simulation.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = AtlasKeys::POINTS,
            value_parser = clap::value_parser!(u32).range(1..=10_000_000)
        )
    )]
    pub points: u32,
    /// Whether the plane of the first two axes is drawn.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub plane: bool,
}

impl Default for AtlasKeys {
    /// Tolerance 1e-6, order 6, 20 halvings, 2000 boxes, 500 points, no picture.
    fn default() -> Self {
        Self {
            range: None,
            at: None,
            values: Counting::default(),
            phase: None,
            tolerance: Self::TOLERANCE,
            order: Self::ORDER,
            depth: Self::DEPTH,
            boxes: Self::BOXES,
            points: Self::POINTS,
            plane: false,
        }
    }
}

impl AtlasKeys {
    /// Default tolerance.
    pub const TOLERANCE: f64 = 1e-6;
    /// Default order.
    pub const ORDER: u32 = 6;
    /// Default number of halvings.
    pub const DEPTH: u32 = 20;
    /// Default number of boxes.
    pub const BOXES: u32 = 2000;
    /// Default number of points.
    pub const POINTS: u32 = 500;

    /// Makes an atlas, or goes on with a saved one, and measures it.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] and [`Error::NoSuchParameter`] for names and numbers that cannot be used;
    /// [`Error::Analysis`] for a scene or a region that cannot be tabulated.
    pub fn answer(&self, graze: &Graze, progress: &dyn Progress) -> Result<Answer, Error> {
        self.measured(graze, None, progress).map(|(answer, _)| answer)
    }

    /// Answer with the atlas, to be saved. A saved atlas brings its region and settings; of the
    /// keys the numbers of boxes and points count.
    ///
    /// # Errors
    ///
    /// As [`answer`](Self::answer).
    pub fn measured(
        &self,
        graze: &Graze,
        saved: Option<&AtlasFile>,
        progress: &dyn Progress,
    ) -> Result<(Answer, AtlasFile), Error> {
        let scene = graze.scene();
        let options = AtlasOptions {
            tolerance: self.tolerance,
            order: self.order as usize,
            depth: self.depth,
            boxes: self.boxes as usize,
            ..AtlasOptions::default()
        };
        let region = match saved {
            Some(file) => file.region.clone(),
            None => self.region(graze)?,
        };
        let points = self.points as usize;
        refuse_memory(atlas_bytes(scene, region.ranges.len(), &options, points))?;
        let work = AtlasWork { saved: saved.map(|file| &file.atlas), points, drawn: self.plane };
        let study = atlas_study(scene, &region, &options, work, progress)?;
        let answer = answer(scene, &study)?;
        let AtlasStudy { region, saved, .. } = study;
        Ok((answer, AtlasFile { scene: scene.digest, region, atlas: saved }))
    }

    /// Region with values in place of offsets.
    fn region(&self, graze: &Graze) -> Result<AtlasRegion, Error> {
        let (scene, orbit) = (graze.scene(), graze.orbit());
        let model = &scene.model;
        let phase = self.phase.map(|phase| finite("phase", phase)).transpose()?;
        let mut parameters: Vec<Dd> = orbit.parameters().to_vec();
        let point = StroboscopicPoint::new(scene, orbit, phase)?;
        let states = Named::new(model.states.iter().cloned().zip(point.states.iter().copied()));
        let counted = Origin::new(graze, self.values).with_coordinates(states);
        let ranged = counted.ranges(self.range.as_ref());
        for (name, offset) in &counted.offsets(self.at.as_ref()).0 {
            let parameter = parameter_number(scene, name)?;
            if ranged.get(name).is_some() {
                return Err(
                    KeyError::NamedTwice { key: "range with at", name: name.clone() }.into()
                );
            }
            let offset = Dd::from(finite("at", *offset)?);
            parameters[parameter] += offset;
        }
        let origin = |name: &str| {
            let state = model.states.iter().position(|state| state == name);
            let parameter = || model.parameters.iter().position(|known| known.name == name);
            let of_parameter = || parameter().map(|parameter| orbit.parameters()[parameter]);
            state.map(|state| Dd::from(point.states[state])).or_else(of_parameter)
        };
        let mut ranges = Vec::new();
        for (name, ends) in &ranged.0 {
            let unknown = || RegionError::UnknownName { name: name.clone() };
            let from = origin(name).ok_or_else(unknown).map_err(AnalysisError::from)?;
            ranges.push((name.clone(), ends.map(|end| (from + Dd::from(end)).to_f64())));
        }
        let states = model.states.iter().zip(&point.states).zip(&point.half_widths);
        for ((name, value), half) in states {
            if !ranges.iter().any(|(ranged, _)| ranged == name) {
                ranges.push((name.clone(), [value - half, value + half]));
            }
        }
        Ok(AtlasRegion { phase: point.phase, periods: scene.grazing.periods, ranges, parameters })
    }
}

/// Answer with the listing of a study.
fn answer(scene: &Scene, study: &AtlasStudy) -> Result<Answer, Error> {
    let listing = AtlasListing::new(study);
    let document =
        |listing: &AtlasListing| to_json(&Document::new(DocumentKind::Atlas, scene, listing));
    let text = listing.text(&scene.identifier);
    let mut answer = Answer::new("atlas", text, document(&listing)?, listing.table());
    answer.timeless = Some(document(&listing.without_times())?);
    answer.remarks = listing.remarks();
    let figure = study.plane.as_ref().map(|plane| ("", atlas_figure(plane, &scene.model)));
    Ok(answer.with_figures(figure))
}

/// An atlas with its region, as a file.
///
/// The file holds a heading, the digest of the rest, and the rest in binary form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtlasFile {
    /// Digest of the scene.
    scene: Digest,
    region: AtlasRegion,
    atlas: SavedAtlas,
}

impl AtlasFile {
    /// Writes the file, atomically.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let content = postcard::to_stdvec(self)
            .map_err(|error| refused(path, &format!("it cannot be written: {error}")))?;
        let mut bytes = format!("{HEADING}\n{}\n", Digest::of_bytes(&content)).into_bytes();
        bytes.extend(content);
        Ok(write_atomically(path, &bytes)?)
    }

    /// Reads the file of a scene.
    ///
    /// # Errors
    ///
    /// [`Error::Unreadable`]; [`Error::NotAnAtlas`] for another file, a damaged one, and the atlas
    /// of another scene.
    pub fn read(path: &Path, scene: &Scene) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| bounded(file).read_to_end(&mut bytes))
            .map_err(|source| Error::Unreadable { path: path.to_owned(), source })?;
        let mut lines = bytes.splitn(3, |&byte| byte == b'\n');
        let mut line = || lines.next().unwrap_or_default();
        if line() != HEADING.as_bytes() {
            return Err(refused(path, &format!("its first line is not `{HEADING}`")));
        }
        let (digest, content) = (line(), line());
        if digest != Digest::of_bytes(content).to_string().as_bytes() {
            return Err(refused(path, "its content does not match its digest; it is damaged"));
        }
        let file: Self = postcard::from_bytes(content)
            .map_err(|error| refused(path, &format!("its content cannot be read: {error}")))?;
        match file.scene == scene.digest {
            true => Ok(file),
            false => Err(refused(
                path,
                &format!(
                    "it was made for a scene with the digest {}, and `{}` has {}",
                    file.scene, scene.identifier, scene.digest
                ),
            )),
        }
    }
}

fn refused(path: &Path, reason: &str) -> Error {
    Error::NotAnAtlas { path: path.to_owned(), reason: reason.to_owned() }
}
