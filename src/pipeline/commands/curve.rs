//! `curve`: the grazing curve in two parameters, or its point nearest to the scene.

use serde::{Deserialize, Serialize};

use super::stops::{SAME, grazing, stops};
use crate::analysis::{PartProgress, Progress};
use crate::model::Scene;
use crate::orbit::{
    self, CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, Margin, MarginOutcome,
};
use crate::pipeline::keys::{KeyError, finite};
use crate::pipeline::{Answer, Ended, Error, parameter_number};
use crate::report::{
    CurveListing, Document, DocumentKind, MarginListing, Named, curve_figures, to_json,
};

/// Keys of `curve` along a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurveKeys {
    /// Second parameter.
    #[serde(alias = "with")]
    pub along: String,
    /// First value of the second parameter.
    pub from: f64,
    /// Last value of the second parameter.
    pub to: f64,
    /// Number of functions `xi_n` that are computed and whose zeros are found.
    #[serde(default = "one")]
    pub xi: u16,
}

fn one() -> u16 {
    1
}

impl CurveKeys {
    /// Computes the curve and lays it out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] and [`Error::NoSuchParameter`] for an unknown parameter or invalid ends,
    /// [`Error::NotLocated`] if no orbit grazes at the scene.
    pub fn answer(&self, scene: &Scene, progress: &dyn Progress) -> Result<Answer, Error> {
        let with = parameter_number(scene, &self.along)?;
        if scene.grazing.solve_for.contains(&with) {
            return Err(KeyError::AlreadyAdjusted { name: self.along.clone() }.into());
        }
        scene.check_period(&[with])?;
        let (from, to) = (finite("from", self.from)?, finite("to", self.to)?);
        let settings = CurveOptions { xi_count: self.xi as usize, ..CurveOptions::default() };
        let watch = whole(progress);
        let watch = |share| watch.reach(share);
        let outcome = orbit::watched_curve(scene, with, [from, to], &settings, &watch)?;
        let (curve, started) = match outcome {
            CurveOutcome::Traced(curve) => (curve, true),
            CurveOutcome::StartNotReached(curve) => (curve, false),
            CurveOutcome::NotLocated(reason) => return Err(reason.into()),
        };
        let listing = CurveListing::new(scene, &curve);
        let (text, table) = (listing.text(), listing.table());
        let figures = curve_figures(&listing);
        let ended = self.ended(&listing, &curve, started, with);
        let document = to_json(&Document::new(DocumentKind::Curve, scene, listing))?;
        Ok(Answer { ended, ..Answer::new("curve", text, document, table).with_figures(figures) })
    }

    /// Outcome of a curve that did not reach its end.
    fn ended(
        &self,
        listing: &CurveListing,
        curve: &GrazingCurve,
        started: bool,
        with: usize,
    ) -> Option<Ended> {
        if let Some(words) = listing.never_physical() {
            return Some(Ended::NoPhysicalGraze { words });
        }
        if started && curve.end == CurveEnd::Reached {
            return None;
        }
        Some(Ended::Curve {
            parameter: self.along.clone(),
            goal: if started { self.to } else { self.from },
            last: curve.points.last().map_or(f64::NAN, |point| point.parameters[with]),
            end: curve.end.clone(),
        })
    }
}

/// Progress of a computation that knows the share that is done.
pub(super) fn whole(progress: &dyn Progress) -> PartProgress<'_> {
    PartProgress::announce(progress, 1);
    PartProgress::new(progress, 1)
}

/// Keys of `curve` for the smallest change that grazes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NearestKeys {
    /// Parameters that may change.
    pub nearest: Vec<String>,
    /// Unit of change of each parameter. Default: its absolute value, or 1 if that is 0.
    pub scale: Named<f64>,
}

impl NearestKeys {
    /// Computes the smallest change and lays it out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] and [`Error::NoSuchParameter`] for unknown parameters, [`Error::NotLocated`]
    /// and [`Error::Ended`] if no orbit grazes.
    pub fn answer(&self, scene: &Scene, progress: &dyn Progress) -> Result<Answer, Error> {
        let names = self.nearest.iter();
        let parameters = names.map(|name| parameter_number(scene, name));
        let parameters = parameters.collect::<Result<Vec<_>, _>>()?;
        scene.check_period(&parameters)?;
        let own = |&parameter: &usize| match scene.model.parameters[parameter].value.to_f64().abs()
        {
            0.0 => 1.0,
            size => size,
        };
        let mut scales: Vec<f64> = parameters.iter().map(own).collect();
        for (name, scale) in &self.scale.0 {
            let place = self.nearest.iter().position(|parameter| parameter == name);
            let place = place.ok_or_else(|| KeyError::NotNearest { name: name.clone() })?;
            scales[place] = *scale;
        }
        let stops = stops(scene);
        PartProgress::announce(progress, stops.len());
        let margin_of = |scene: &Scene| {
            let part = PartProgress::new(progress, 1);
            let watch = |share| part.reach(share);
            orbit::watched_margin(scene, &parameters, &scales, &watch)
        };
        let mut nearest = match margin_of(scene)? {
            MarginOutcome::Found(margin) => Ok((stops[0], margin)),
            MarginOutcome::NotLocated(reason) => Err(reason),
        };
        let mut lost = Vec::new();
        // A stop that the orbit goes beyond comes before all others.
        let is_nearer = |margin: &Margin, known: &Margin| {
            (margin.clears, margin.distance) < (known.clears, (1.0 - SAME) * known.distance)
        };
        for &stop in &stops[1..] {
            match margin_of(&grazing(scene, stop)) {
                Ok(MarginOutcome::Found(margin)) => {
                    let known = nearest.as_ref().ok();
                    if known.is_none_or(|(_, known)| is_nearer(&margin, known)) {
                        nearest = Ok((stop, margin));
                    }
                }
                _ => lost.push(stop),
            }
        }
        let (stop, margin) = nearest?;
        let listing = MarginListing::new(scene, &margin, stop, &lost);
        let (text, table) = (listing.text(), listing.table());
        let document = to_json(&Document::new(DocumentKind::Margin, scene, listing))?;
        Ok(Answer::new("margin", text, document, table))
    }
}
