//! Search for the grazing orbit at a special point of a saved branch document.
//!
//! A graze that `branch` marks becomes a scene: the parameters of the point, the surface that it
//! grazes, the surfaces that it hits, and a guess of its state.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Deserialize;

use super::saved::{kind_of, read};
use super::{BranchPlaceError, Error, Source};
use crate::analysis::branches::{BranchGraze, BranchLabel, GrazeGuess, graze_guess};
use crate::model::{Digest, Scene, Symmetry};
use crate::report::{DocumentKind, Named};

/// Special point of a saved branch document, written `branch.json#3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BranchPlace {
    /// Path of the document.
    pub path: PathBuf,
    /// Number of the special point, from 1, in the order in which the document lists them.
    pub number: usize,
}

impl FromStr for BranchPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.rsplit_once('#').filter(|(path, _)| !path.is_empty());
        let place = parts.and_then(|(path, number)| {
            let number = number.parse().ok().filter(|&number| number > 0)?;
            Some(Self { path: path.into(), number })
        });
        place.ok_or_else(|| {
            format!(
                "expected FILE#N, the JSON document of `branch` and the number of a special \
                 point from 1, as in `branch.json#3`; found `{text}`"
            )
        })
    }
}

/// Scene that searches for the graze at a special point of a branch, and what was changed in it.
#[derive(Clone, Debug)]
pub struct SearchFromBranch {
    /// Scene with the guess and the hits of the point.
    pub scene: Scene,
    /// Keys and values that differ from the original scene, as `--set` takes them.
    pub changes: Vec<(String, String)>,
}

/// Fields of a branch document that are read back.
#[derive(Deserialize)]
struct SavedBranches {
    scene: String,
    digest: Digest,
    along: String,
    passages: Vec<String>,
    branches: Vec<SavedBranch>,
}

#[derive(Deserialize)]
struct SavedBranch {
    points: Vec<SavedPoint>,
}

#[derive(Deserialize)]
struct SavedPoint {
    parameters: Named<f64>,
    states: Vec<Vec<f64>>,
    physical: bool,
    #[serde(default)]
    turns: i32,
    label: Option<BranchLabel>,
    #[serde(default)]
    grazing: Vec<[usize; 2]>,
    surface: Option<String>,
}

impl Source {
    /// Scene whose grazing orbit is that of a special point of a branch of this scene.
    ///
    /// The graze from which the branches start is located for the origin of their offsets.
    ///
    /// # Errors
    ///
    /// [`Error::BranchPlace`] for a file that is no branch document of this scene, and for a point
    /// that is no graze of one passage; [`Error::Unreadable`]; as [`Source::settle`].
    pub fn at_branch_graze(self, place: &BranchPlace) -> Result<SearchFromBranch, Error> {
        let document = read(&place.path)?;
        self.at_graze_of(&document, place)
    }

    /// [`at_branch_graze`](Source::at_branch_graze) of a branch document in memory; the path of the
    /// place is its name in messages.
    ///
    /// # Errors
    ///
    /// As [`at_branch_graze`](Source::at_branch_graze), except [`Error::Unreadable`].
    pub fn at_graze_of(
        self,
        document: &str,
        place: &BranchPlace,
    ) -> Result<SearchFromBranch, Error> {
        let refused = |reason| refusal(&place.path, reason);
        let saved = branches(document).map_err(refused)?;
        let scene = self.scene();
        if saved.digest != scene.digest {
            return Err(refused(BranchPlaceError::OtherScene {
                name: saved.scene,
                found: saved.digest,
                expected: scene.digest,
            }));
        }
        let point = saved.special(place.number).map_err(refused)?;
        let scene = scene.clone();
        let graze = saved.graze(&scene, place.number, point).map_err(refused)?;
        let settled = self.settle()?;
        let guess = match graze_guess(settled.scene(), settled.orbit(), &graze)? {
            Ok(guess) => guess,
            Err(end) => {
                return Err(refused(BranchPlaceError::EndsEarly { number: place.number, end }));
            }
        };
        if let Some(brief) = guess.brief {
            return Err(refused(BranchPlaceError::BriefHit {
                number: place.number,
                surface: scene.model.surfaces[graze.surface].name.clone(),
                speed: brief.speed,
                stay: brief.stay,
                least: brief.least,
            }));
        }
        let changes = changes(&scene, &saved.along, &graze, &guess);
        let mut found = Scene::parse_with(&scene.text, &scene.file_name, &changes)?;
        found.identifier = scene.identifier;
        Ok(SearchFromBranch { scene: found, changes })
    }
}

fn refusal(path: &Path, reason: BranchPlaceError) -> Error {
    Error::BranchPlace { path: path.to_owned(), reason: Box::new(reason) }
}

/// Parses a branch document.
fn branches(text: &str) -> Result<SavedBranches, BranchPlaceError> {
    let refused = |reason| BranchPlaceError::NotBranches { reason };
    match kind_of(text).map_err(refused)? {
        DocumentKind::Branch => {
            serde_json::from_str(text).map_err(|error| refused(error.to_string()))
        }
        other => Err(refused(format!("it is a document of kind {other:?}"))),
    }
}

impl SavedBranches {
    /// Special points, in the order of the document.
    fn specials(&self) -> impl Iterator<Item = (BranchLabel, &SavedPoint)> {
        let points = self.branches.iter().flat_map(|branch| &branch.points);
        points.filter_map(|point| Some((point.label?, point)))
    }

    /// Special point of a number that is a graze.
    fn special(&self, number: usize) -> Result<&SavedPoint, BranchPlaceError> {
        let found = number.checked_sub(1).and_then(|place| self.specials().nth(place));
        match found {
            Some((BranchLabel::Graze, point)) => Ok(point),
            Some((label, _)) => {
                let grazes = self.specials().zip(1..);
                let grazes = grazes.filter(|((label, _), _)| *label == BranchLabel::Graze);
                let grazes = grazes.map(|(_, number)| number).collect();
                Err(BranchPlaceError::NotAGraze { number, label, grazes })
            }
            None => Err(BranchPlaceError::NoSuchPoint { number, count: self.specials().count() }),
        }
    }

    /// Graze of a special point, on the shortest period of its orbit.
    fn graze(
        &self,
        scene: &Scene,
        number: usize,
        point: &SavedPoint,
    ) -> Result<BranchGraze, BranchPlaceError> {
        if !point.physical {
            return Err(BranchPlaceError::Virtual { number });
        }
        let wrong = |reason: &str| BranchPlaceError::NotBranches { reason: reason.to_owned() };
        let all = point.states.len();
        let (first, passage, name, runs) = match (point.grazing.first(), &point.surface) {
            (Some(&[first, passage]), _) => {
                // An orbit that runs several times through a shorter one grazes in each of its
                // runs.
                let runs = point.grazing.len();
                let is_run = |(run, &[at, which]): (usize, &[usize; 2])| {
                    which == passage && (at - first.min(at)) * runs == run * all
                };
                if !all.is_multiple_of(runs) || !point.grazing.iter().enumerate().all(is_run) {
                    return Err(BranchPlaceError::SeveralGrazes { number, grazes: runs });
                }
                (first, Some(passage), self.passages.get(passage), runs)
            }
            (None, Some(surface)) => (0, None, Some(surface), 1),
            (None, None) => return Err(wrong("a graze names the passage or surface that grazes")),
        };
        let returns = all / runs;
        if scene.model.phase.is_none() && returns > 1 {
            return Err(BranchPlaceError::SeveralReturns { number, returns });
        }
        let surface = name
            .and_then(|name| scene.model.surfaces.iter().position(|surface| surface.name == *name));
        let active = scene.expansion.active.iter();
        let offset = |&parameter: &usize| {
            point.parameters.get(&scene.model.parameters[parameter].name).copied()
        };
        let parameters: Option<Vec<f64>> = active.map(offset).collect();
        Ok(BranchGraze {
            parameters: parameters.ok_or_else(|| wrong("a point has every active parameter"))?,
            start: point
                .states
                .get(first)
                .cloned()
                .ok_or_else(|| wrong("a graze is one of a return of the orbit"))?,
            surface: surface.ok_or_else(|| wrong("a passage has a surface of the scene"))?,
            passage,
            returns,
            turns: point.turns / runs as i32,
        })
    }
}

/// Keys and values of a scene that searches for a graze from its guess.
fn changes(
    scene: &Scene,
    along: &str,
    graze: &BranchGraze,
    guess: &GrazeGuess,
) -> Vec<(String, String)> {
    let (model, grazing) = (&scene.model, &scene.grazing);
    let quoted = |name: &str| format!("\"{name}\"");
    let surface = |number: usize| quoted(&model.surfaces[number].name);
    let mut changes: Vec<(String, String)> = Vec::new();
    let mut set = |key: String, value: String| changes.push((key, value));
    for (parameter, &value) in model.parameters.iter().zip(&guess.parameters) {
        if parameter.name == along {
            set(along.to_owned(), value.to_f64().to_string());
        } else if value != parameter.value {
            set(parameter.name.clone(), value.to_string());
        }
    }
    if grazing.passages != [graze.surface] || grazing.hits.order.is_some() {
        set("grazing.surface".to_owned(), surface(graze.surface));
    }
    // A surface that is named and not hit changes nothing: `hits` allows any number.
    let named = guess.hits == grazing.hits.surfaces && grazing.hits.order.is_none();
    if !named && !guess.hits.is_empty() {
        let hits: Vec<String> = guess.hits.iter().map(|&number| surface(number)).collect();
        set("grazing.hits".to_owned(), format!("[{}]", hits.join(", ")));
    }
    let solved = grazing.solve_for.iter().map(|&number| model.parameters[number].name.as_str());
    if !solved.eq([along]) {
        set("grazing.solve_for".to_owned(), quoted(along));
    }
    if grazing.symmetry != Symmetry::None {
        set("grazing.symmetry".to_owned(), quoted("none"));
    }
    let periods = i64::from(graze.turns) + (grazing.periods * graze.returns) as i64;
    if model.phase.is_some() && periods != grazing.periods as i64 {
        set("grazing.periods".to_owned(), periods.to_string());
    }
    for (name, value) in model.full_state_names().into_iter().zip(&guess.state) {
        set(format!("grazing.guess.{name}"), value.to_string());
    }
    changes
}
