//! The commands of the program as calls of the library: keys with defaults, an answer.
//!
//! The program's options and Python's arguments are the keys. What a scene asks for in its tables
//! (`[[diagram]]`, `[[chart]]`, `[[basin]]`) is asked there ([`Map::asking`](super::Map::asking)).

mod continuation;
mod curve;
mod direct;
mod fit;
mod orbits;

use serde::Deserialize;

use super::{Answer, Error, Map, OrbitsOf, Source};
use crate::analysis::{Progress, Shard};

pub(super) use continuation::diagram_branches;
pub use continuation::{BranchKeys, LociKeys};
pub use curve::{CurveKeys, NearestKeys};
pub use direct::{AskedTrajectory, ConvergenceKeys, TrajectoryKeys};
pub(super) use direct::{study_answer, trajectory_answer};
pub use fit::{FitKeys, NoiseKeys};
pub use orbits::OrbitsKeys;

/// A command with its keys.
///
/// ```
/// use grazemap::analysis::NoProgress;
/// use grazemap::pipeline::{Command, Source};
/// use grazemap::prelude::*;
///
/// let command = Command::from_json(r#"{"trajectory": {"periods": 2, "samples": 10}}"#)?;
/// let scene = Scene::load("scenes/linear.toml")?;
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
}

impl Command {
    /// The command of an object with one member: its name, and an object of its keys.
    ///
    /// # Errors
    ///
    /// [`Error::NoCommand`] for another text, a key that the command does not have, and a value of
    /// another kind.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|fault| Error::NoCommand { reason: fault.to_string() })
    }

    /// A share of its pieces. Commands that have none find nothing, and leave all to what joins the
    /// shares.
    ///
    /// # Errors
    ///
    /// As [`answer`](Self::answer).
    pub fn share(&self, source: Source, shard: &Shard<'_>) -> Result<(), Error> {
        match self {
            Self::Branch(keys) => keys.share(&searched(source, keys.using)?, shard),
            _ => Ok(()),
        }
    }

    /// What it computes, laid out.
    ///
    /// # Errors
    ///
    /// Those of its keys, and of the steps of the pipeline that it takes.
    pub fn answer(&self, source: Source, progress: &dyn Progress) -> Result<Answer, Error> {
        match self {
            Self::Branch(keys) => keys.answer(&searched(source, keys.using)?, progress),
            Self::Loci(keys) => keys.answer(&searched(source, keys.using)?, progress),
            Self::Orbits(keys) => keys.answer(&searched(source, keys.using)?, progress),
            Self::Trajectory(keys) => keys.answer(&source.settle()?, progress),
            Self::Converge(keys) => keys.answer(&source.settle()?, progress),
            Self::Curve(keys) => keys.answer(source.scene(), progress),
            Self::Nearest(keys) => keys.answer(source.scene(), progress),
            Self::Noise(keys) => keys.answer(&source.map()?, progress),
        }
    }
}

/// The map in which orbits are looked for; of direct simulation the free flight where there is
/// none.
fn searched(source: Source, using: OrbitsOf) -> Result<Map, Error> {
    match using {
        OrbitsOf::Map => source.map(),
        OrbitsOf::Direct => source.map_or_free_flight(),
    }
}
