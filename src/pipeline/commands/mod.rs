//! Commands of the program as calls of the library: keys with defaults, and an answer.
//!
//! Keys are declared once: their fields are the program's options (feature `cli`, which reads the
//! attributes of `clap`), and the keys of the JSON that Python passes. Diagrams and charts are
//! tables of the scene (`[[diagram]]` ...), added by [`Map::asking`](super::Map::asking).

mod atlas;
mod contact;
mod continuation;
mod curve;
mod derivatives;
mod direct;
mod fit;
mod orbits;
mod safe;
mod stops;

use serde::Deserialize;

use super::{Answer, Error, Map, OrbitsOf, Source};
use crate::analysis::{Progress, Shard};

pub use atlas::{AtlasFile, AtlasKeys};
pub use contact::ContactKeys;
pub(super) use continuation::diagram_branches;
pub use continuation::{BranchKeys, LociKeys};
pub use curve::{CurveKeys, NearestKeys};
pub use derivatives::DerivativesKeys;
pub use direct::{AskedTrajectory, ConvergenceKeys, TrajectoryKeys};
pub(super) use direct::{study_answer, trajectory_answer};
pub use fit::{FitKeys, NoiseKeys};
pub use orbits::{FoldsAndFlips, OrbitsKeys};
pub use safe::SafeKeys;

/// Command with its keys.
///
/// ```
/// use grazemap::analysis::NoProgress;
/// use grazemap::pipeline::{Command, Source};
/// use grazemap::prelude::*;
///
/// let command = Command::from_json(r#"{"trajectory": {"periods": 2, "samples": 10}}"#)?;
/// let scene = Scene::of_catalogue("linear")?;
/// let answer = command.answer(Source::Scene(Box::new(scene)), &NoProgress)?;
/// assert_eq!(answer.table().expect("a table").columns()[0].header, "t");
/// # Ok::<(), grazemap::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Command {
    /// `branch`.
    Branch(BranchKeys),
    /// `loci`.
    Loci(LociKeys),
    /// `orbits`.
    Orbits(OrbitsKeys),
    /// `trajectory`.
    Trajectory(TrajectoryKeys),
    /// `converge`.
    Converge(ConvergenceKeys),
    /// `curve` along a parameter.
    Curve(CurveKeys),
    /// `curve` for the smallest change that grazes.
    Nearest(NearestKeys),
    /// Orbits under noise.
    Noise(NoiseKeys),
    /// `safe`.
    Safe(SafeKeys),
    /// `derivatives`.
    Derivatives(DerivativesKeys),
    /// `contact`.
    Contact(ContactKeys),
    /// `atlas`.
    Atlas(AtlasKeys),
}

impl Command {
    /// Parses an object with one member: the command's name, with an object of its keys.
    ///
    /// # Errors
    ///
    /// [`Error::NoCommand`] for any other text, an unknown key, or a value of the wrong type.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|fault| {
            // The place is of a text that nobody wrote.
            let words = fault.to_string();
            let reason = words.split(" at line ").next().unwrap_or_default().to_owned();
            Error::NoCommand { reason }
        })
    }

    /// Computes a share of the command's pieces. A command without pieces computes nothing here;
    /// the join computes it whole.
    ///
    /// # Errors
    ///
    /// As [`answer`](Self::answer).
    pub fn share(&self, source: Source, shard: &Shard<'_>) -> Result<(), Error> {
        match self {
            Self::Branch(keys) => keys.share(&searched(source, keys.method)?, shard),
            _ => Ok(()),
        }
    }

    /// Computes the result and lays it out.
    ///
    /// # Errors
    ///
    /// Those of its keys, and of the steps of the pipeline that it takes.
    pub fn answer(&self, source: Source, progress: &dyn Progress) -> Result<Answer, Error> {
        match self {
            Self::Branch(keys) => keys.answer(&searched(source, keys.method)?, progress),
            Self::Loci(keys) => keys.answer(&searched(source, keys.method)?, progress),
            Self::Orbits(keys) => keys.answer(&searched(source, keys.method)?, progress),
            Self::Trajectory(keys) => keys.answer(&source.settle()?, progress),
            Self::Converge(keys) => keys.answer(&source.settle()?, progress),
            Self::Curve(keys) => keys.answer(source.scene(), progress),
            Self::Nearest(keys) => keys.answer(source.scene(), progress),
            Self::Noise(keys) => keys.answer(&source.map()?, progress),
            Self::Safe(keys) => keys.answer(source.scene(), progress),
            Self::Derivatives(keys) => keys.answer(source.scene(), progress),
            Self::Contact(keys) => keys.answer(Some(&source.graze()?), progress),
            Self::Atlas(keys) => keys.answer(&source.graze()?, progress),
        }
    }

    /// Computes the result of a command that needs no scene, without one.
    ///
    /// # Errors
    ///
    /// [`Error::NoCommand`] for a command that needs a scene; those of its keys.
    pub fn answer_alone(&self, progress: &dyn Progress) -> Result<Answer, Error> {
        match self {
            Self::Contact(keys) => keys.answer(None, progress),
            _ => Err(Error::NoCommand { reason: "the command needs a scene".to_owned() }),
        }
    }
}

/// Map in which orbits are searched for. For direct simulation, the free flight if there is no map.
fn searched(source: Source, method: OrbitsOf) -> Result<Map, Error> {
    match method {
        OrbitsOf::Map => source.map(),
        OrbitsOf::Direct => source.map_or_free_flight(),
    }
}
