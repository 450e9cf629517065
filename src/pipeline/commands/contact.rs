//! `contact`: soft stops of a wanted restitution, and the error of a rigid stop in their place.

use serde::{Deserialize, Serialize};

use crate::analysis::Progress;
use crate::analysis::soft_stop::{SoftStop, StopInScene, StopLaw, StopSize, WantedImpact};
use crate::pipeline::keys::{KeyError, finite};
#[cfg(feature = "cli")]
use crate::pipeline::positions::finite as finite_number;
use crate::pipeline::{Answer, Error, Graze};
use crate::report::{
    ContactListing, Document, DocumentKind, SoftImpactListing, SoftStopListing, StopNames,
    stop_law_words, to_json,
};

/// Least and largest restitution.
const RESTITUTIONS: [f64; 2] = [0.01, 1.0];

/// Least and largest exponent.
const EXPONENTS: [f64; 2] = [0.1, 20.0];

/// Hertz's exponent, that of two balls.
const HERTZ: f64 = 1.5;

/// Speeds of the impacts that are listed, in units of the speed at which the restitution is wanted.
const SPEEDS: [f64; 7] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// Keys of `contact`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(deny_unknown_fields)]
pub struct ContactKeys {
    /// Restitution that the stops have at the speed, from 0.01 to 1.
    #[cfg_attr(feature = "cli", arg(long, value_name = "R", value_parser = finite_number))]
    pub restitution: f64,
    /// Contact time at the speed. Default: a hundredth of the period of the grazing orbit; 1
    /// without a scene.
    #[serde(default)]
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "T",
            conflicts_with = "stiffness",
            value_parser = finite_number
        )
    )]
    pub time: Option<f64>,
    /// Stiffness of the spring, in the place of the contact time.
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "K", value_parser = finite_number))]
    pub stiffness: Option<f64>,
    /// Speed at which the stops have the restitution. Default: a tenth of the largest normal speed
    /// along the grazing orbit; 1 without a scene.
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "V", value_parser = finite_number))]
    pub speed: Option<f64>,
    /// Exponent of the spring of laws that are not linear, from 0.1 to 20.
    #[serde(default = "hertz")]
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "P", default_value_t = hertz(), value_parser = finite_number)
    )]
    pub exponent: f64,
    /// Effective mass; with 1, stiffness and damper are those of an acceleration.
    #[serde(default = "unit")]
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "M", default_value_t = unit(), value_parser = finite_number)
    )]
    pub mass: f64,
}

fn hertz() -> f64 {
    HERTZ
}

fn unit() -> f64 {
    1.0
}

impl ContactKeys {
    /// Keys with a restitution, all else by default.
    pub fn new(restitution: f64) -> Self {
        Self { restitution, time: None, stiffness: None, speed: None, exponent: HERTZ, mass: 1.0 }
    }

    /// Finds the stops and lays them out, with their errors at the stop of a scene if there is one.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] for a number out of range, [`Error::StopDirection`] if the stop of the scene
    /// does not act on the velocity with which it is met, [`Error::Analysis`] if a flight fails.
    pub fn answer(&self, graze: Option<&Graze>, progress: &dyn Progress) -> Result<Answer, Error> {
        let given = self.checked()?;
        let stop = graze.map(|graze| StopInScene::new(graze.scene(), graze.orbit())).transpose()?;
        let wanted = given.wanted(stop.as_ref());
        let names = match (graze, &stop) {
            (Some(graze), Some(stop)) => StopNames::of_scene(graze.scene(), stop),
            _ => StopNames::standard(),
        };
        progress.expect(StopLaw::ALL.len() as u64);
        let mut laws = Vec::new();
        let mut remarks = Vec::new();
        for law in StopLaw::ALL {
            match SoftStop::with_restitution(law, &wanted) {
                Some(soft) => {
                    let impacts = impacts(&soft, &wanted, stop.as_ref())?;
                    laws.push(SoftStopListing::new(&soft, &names, impacts));
                }
                None => remarks.push(format!(
                    "note: no stop of the law `{}` was found with this restitution and size",
                    stop_law_words(law)
                )),
            }
            progress.advance(1);
        }
        let listing = ContactListing {
            surface: stop.as_ref().map(|stop| stop.surface().to_owned()),
            restitution: wanted.restitution,
            speed: wanted.speed,
            mass: wanted.mass,
            exponent: wanted.exponent,
            laws,
        };
        let scene = graze.map(Graze::scene);
        let document = to_json(&Document::about(DocumentKind::Contact, scene, &listing))?;
        let text = listing.text(scene.map(|scene| &*scene.identifier), &names);
        Ok(Answer { remarks, ..Answer::new("contact", text, document, listing.table()) })
    }

    /// Keys, if all numbers are in their ranges.
    fn checked(&self) -> Result<&Self, KeyError> {
        let within = |key: &'static str, value: f64, range: [f64; 2]| match (range[0]..=range[1])
            .contains(&finite(key, value)?)
        {
            true => Ok(()),
            false => Err(KeyError::Outside { key, range, value }),
        };
        within("restitution", self.restitution, RESTITUTIONS)?;
        within("exponent", self.exponent, EXPONENTS)?;
        let positive = [
            ("time", self.time),
            ("stiffness", self.stiffness),
            ("speed", self.speed),
            ("mass", Some(self.mass)),
        ];
        for (key, value) in positive {
            if let Some(value) = value
                && finite(key, value)? <= 0.0
            {
                return Err(KeyError::NotPositive { key, value });
            }
        }
        match (self.time, self.stiffness) {
            (Some(_), Some(_)) => Err(KeyError::BothGiven { keys: ["time", "stiffness"] }),
            _ => Ok(self),
        }
    }

    fn wanted(&self, stop: Option<&StopInScene<'_>>) -> WantedImpact {
        let time = || self.time.or_else(|| stop.map(StopInScene::usual_time)).unwrap_or(1.0);
        WantedImpact {
            restitution: self.restitution,
            speed: self.speed.or_else(|| stop.map(StopInScene::usual_speed)).unwrap_or(1.0),
            mass: self.mass,
            exponent: self.exponent,
            size: self.stiffness.map_or_else(|| StopSize::Time(time()), StopSize::Stiffness),
        }
    }
}

/// Impacts with a stop over the range of speeds.
fn impacts(
    soft: &SoftStop,
    wanted: &WantedImpact,
    stop: Option<&StopInScene<'_>>,
) -> Result<Vec<SoftImpactListing>, Error> {
    let restitution = wanted.restitution;
    let listed = |share: f64| {
        let speed = share * wanted.speed;
        let impact = soft.impact(speed);
        let error = stop.map(|stop| stop.error_of_rigid(soft, restitution, speed)).transpose()?;
        Ok(SoftImpactListing {
            speed,
            restitution: impact.map(|impact| impact.restitution),
            difference: impact.map(|impact| impact.restitution - restitution),
            time: impact.map(|impact| impact.time),
            depth: impact.map(|impact| impact.depth),
            error_of_return: error.flatten(),
        })
    };
    SPEEDS.into_iter().map(listed).collect()
}
