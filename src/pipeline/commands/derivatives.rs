//! `derivatives`: the state after hits, with its derivatives by the start and the parameters.

use serde::{Deserialize, Serialize};

use super::TrajectoryKeys;
use super::curve::whole;
use crate::analysis::{Progress, SectionFrame};
use crate::expansion::sides_of_graze;
use crate::model::Scene;
use crate::numeric::{Dd, converted};
use crate::orbit::{JetsAlong, watched_jets_along};
use crate::pipeline::keys::{KeyError, finite, named_offsets};
#[cfg(feature = "cli")]
use crate::pipeline::options::{positive, values};
use crate::pipeline::{Answer, Error, Settled, parameter_number};
use crate::report::{DerivativesListing, Document, DocumentKind, Named, to_json};

/// Names of states in messages.
const STATES: [&str; 2] = ["state", "states"];

/// Highest order of derivatives.
const MOST_ORDERS: u32 = 8;

/// Keys of `derivatives`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct DerivativesKeys {
    /// States and phase at the start (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=VALUE,...", value_parser = values)
    )]
    pub start: Option<Named<f64>>,
    /// Time after which the derivatives are taken.
    #[cfg_attr(
        feature = "cli",
        arg(long = "time", value_name = "T", value_parser = positive, conflicts_with = "returns")
    )]
    pub at: Option<f64>,
    /// Forcing periods after which the derivatives are taken, those of the return by the phase.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "K",
            default_value_t = 1,
            value_parser = clap::value_parser!(u32).range(1..=1_000_000)
        )
    )]
    pub returns: u32,
    /// Parameters by which derivatives are taken. Default: the active ones of the scene.
    #[cfg_attr(feature = "cli", arg(long, value_name = "P,...", value_delimiter = ','))]
    pub parameters: Option<Vec<String>>,
    /// Highest order of the derivatives, from 1 to 8.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = 1,
            value_parser = clap::value_parser!(u32).range(1..=8)
        )
    )]
    pub order: u32,
    /// Give the series on both sides of a graze, in the place of an error.
    #[cfg_attr(feature = "cli", arg(long))]
    pub sides: bool,
}

impl Default for DerivativesKeys {
    /// Gradient of the return after one forcing period.
    fn default() -> Self {
        Self { start: None, at: None, returns: 1, parameters: None, order: 1, sides: false }
    }
}

/// Trajectory of `derivatives`, as its keys say.
struct Asked {
    start: Vec<Dd>,
    free: Vec<usize>,
    /// Time, or forcing periods.
    span: (Option<Dd>, usize),
    order: u32,
}

impl DerivativesKeys {
    /// Computes the state at the end of the trajectory and its derivatives, in double-double.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] and [`Error::NoSuchParameter`] for unknown names and numbers out of range,
    /// [`Error::Derivatives`] where a derivative does not exist.
    pub fn jets(&self, scene: &Scene, progress: &dyn Progress) -> Result<JetsAlong, Error> {
        self.asked(scene)?.jets(scene, progress)
    }

    /// Computes the derivatives and lays them out; with [`sides`](Self::sides) also those on both
    /// sides of a graze.
    ///
    /// # Errors
    ///
    /// As [`jets`](Self::jets), and [`Error::Sides`] where a trajectory that grazes has no series.
    pub fn answer(&self, scene: &Scene, progress: &dyn Progress) -> Result<Answer, Error> {
        let asked = self.asked(scene)?;
        if !self.sides {
            return asked.answer(scene, &asked.jets(scene, progress)?);
        }
        let Asked { start, free, span, order } = &asked;
        check_order(*order)?;
        let watch = whole(progress);
        let watch = |share| watch.reach(share);
        match sides_of_graze(scene, (start, free), *span, *order, &watch)? {
            None => asked.answer(scene, &asked.jets(scene, progress)?),
            Some(sides) => {
                let order = *order as usize;
                laid_out(scene, DerivativesListing::beside_graze(scene, &sides, free, order))
            }
        }
    }

    fn asked(&self, scene: &Scene) -> Result<Asked, Error> {
        let given = self.start.clone().unwrap_or_default();
        let start = named_offsets("start", STATES, &given, &scene.model.full_state_names())?;
        let at = self.at.map(|at| finite("at", at)).transpose()?;
        if let Some(value) = at.filter(|at| *at <= 0.0) {
            return Err(KeyError::NotPositive { key: "at", value }.into());
        }
        if at.is_some() && self.returns != 1 {
            return Err(KeyError::BothGiven { keys: ["at", "returns"] }.into());
        }
        let span = (at.map(Dd::from), self.returns as usize);
        Ok(Asked { start: converted(&start), free: self.free(scene)?, span, order: self.order })
    }

    fn free(&self, scene: &Scene) -> Result<Vec<usize>, Error> {
        let Some(names) = &self.parameters else {
            return Ok(scene.expansion.active.clone());
        };
        let mut free = Vec::with_capacity(names.len());
        for name in names {
            let number = parameter_number(scene, name)?;
            if free.contains(&number) {
                return Err(KeyError::NamedTwice { key: "parameters", name: name.clone() }.into());
            }
            free.push(number);
        }
        Ok(free)
    }
}

impl TrajectoryKeys {
    /// Derivatives of the state at the end of the trajectory, by the full state at its start and
    /// the active parameters.
    ///
    /// # Errors
    ///
    /// As [`request`](Self::request), and [`Error::Derivatives`] where a derivative does not exist.
    pub(super) fn derivatives_answer(
        &self,
        settled: &Settled,
        order: u32,
        progress: &dyn Progress,
    ) -> Result<Answer, Error> {
        let (request, remarks) = self.request(settled, progress)?;
        let mut frame = SectionFrame::<Dd>::new(settled.scene(), settled.orbit());
        frame.place(&converted(&request.start), &converted(&request.parameters))?;
        let mut scene = settled.scene().clone();
        for (parameter, &value) in scene.model.parameters.iter_mut().zip(frame.parameters()) {
            parameter.value = value;
        }
        let free = scene.expansion.active.clone();
        let duration = frame.duration() * Dd::from(request.returns as f64);
        let span = match scene.model.phase {
            Some(_) => (None, frame.periods() * request.returns),
            None => (Some(Dd::from(duration.to_f64())), 0),
        };
        let asked = Asked { start: frame.state().to_vec(), free, span, order };
        let jets = asked.jets(&scene, progress)?;
        Ok(Answer { remarks, ..asked.answer(&scene, &jets)? })
    }
}

impl Asked {
    fn jets(&self, scene: &Scene, progress: &dyn Progress) -> Result<JetsAlong, Error> {
        let Self { start, free, span, order } = self;
        check_order(*order)?;
        let watch = whole(progress);
        let watch = |share| watch.reach(share);
        Ok(watched_jets_along(scene, start, free, *span, *order, &watch)?)
    }

    fn answer(&self, scene: &Scene, jets: &JetsAlong) -> Result<Answer, Error> {
        laid_out(scene, DerivativesListing::new(scene, jets, &self.free, self.order as usize))
    }
}

fn check_order(order: u32) -> Result<(), KeyError> {
    let (found, most) = (u64::from(order), u64::from(MOST_ORDERS));
    if (1..=most).contains(&found) {
        Ok(())
    } else {
        Err(KeyError::Count { key: "order", found, most })
    }
}

fn laid_out(scene: &Scene, listing: DerivativesListing) -> Result<Answer, Error> {
    let text = listing.text(&scene.identifier);
    let table = listing.table();
    let document = to_json(&Document::new(DocumentKind::Derivatives, scene, &listing))?;
    Ok(Answer::new("derivatives", text, document, table))
}
