//! `trajectory` and `converge`, which use direct simulation: time series and phase portraits;
//! truncation orders, errors and speed.

use serde::{Deserialize, Serialize};

use super::orbits::searched;
use crate::analysis::orbits::{OrbitsRequest, orbits};
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::{
    Progress, SectionFrame, TimeSeries, TimeSeriesRequest, series_bytes, time_series,
};
use crate::convergence::ConvergenceStudy;
use crate::model::Shape;
use crate::pipeline::answer::edge_remark;
use crate::pipeline::keys::{ACTIVE, COORDINATES, KeyError, named_offsets};
#[cfg(feature = "cli")]
use crate::pipeline::options::positions;
use crate::pipeline::positions::{Counting, Origin, Position};
use crate::pipeline::{Answer, Ended, Error, Settled, Source, StudyRequest, refuse_memory};
use crate::report::{
    Document, DocumentKind, Named, SectionDocument, TimeSeriesListing, convergence_figures,
    convergence_table, convergence_text, counted, time_series_figures, time_series_table,
    time_series_text, to_json, without_times,
};

/// Keys of `trajectory`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct TrajectoryKeys {
    /// Offsets of active parameters from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Start at these offsets of section coordinates (0 if not named). Default: on the grazing
    /// orbit.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub start: Option<Named<Position>>,
    /// Start on the periodic orbit with this itinerary: 1 for contact, 0 for none, passage by
    /// passage and return by return.
    #[cfg_attr(feature = "cli", arg(long, value_name = "DIGITS", conflicts_with = "start"))]
    pub itinerary: Option<String>,
    /// Returns to the section that are simulated first and not written, so that the orbit settles.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "K",
            default_value_t = 0,
            value_parser = clap::value_parser!(u32).range(0..=10_000_000)
        )
    )]
    pub settle: u32,
    /// Number of periods of the orbit to simulate, or of returns to the section if the start is not
    /// a periodic orbit.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "K",
            default_value_t = 1,
            value_parser = clap::value_parser!(u32).range(1..=10_000_000)
        )
    )]
    pub periods: u32,
    /// Write the derivatives of the state at the end, by the state at the start and the active
    /// parameters, to this order (1 to 8) in the place of rows.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            conflicts_with = "settle",
            value_parser = clap::value_parser!(u32).range(1..=8)
        )
    )]
    pub derivatives: Option<u32>,
    /// Number of rows per return to the section, evenly spaced in time; events add rows.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = TrajectoryKeys::SAMPLES,
            value_parser = clap::value_parser!(u32).range(1..=1_000_000)
        )
    )]
    pub samples: u32,
}

impl Default for TrajectoryKeys {
    /// The grazing orbit over one return, in 400 rows.
    fn default() -> Self {
        Self {
            at: None,
            values: Counting::default(),
            start: None,
            itinerary: None,
            settle: 0,
            periods: 1,
            derivatives: None,
            samples: Self::SAMPLES,
        }
    }
}

/// Request for a trajectory, with remarks on its start.
pub type AskedTrajectory = (TimeSeriesRequest, Vec<String>);

impl TrajectoryKeys {
    /// Default number of rows per return.
    pub const SAMPLES: u32 = 400;

    /// Request with numbers in place of names, and remarks on it.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] for unknown names, invalid numbers and itineraries, [`Error::Ended`] if no
    /// orbit of the itinerary is found.
    pub fn request(
        &self,
        settled: &Settled,
        progress: &dyn Progress,
    ) -> Result<AskedTrajectory, Error> {
        if self.itinerary.is_some() && self.start.as_ref().is_some_and(|start| !start.is_empty()) {
            return Err(KeyError::BothGiven { keys: ["start", "itinerary"] }.into());
        }
        let origin = Origin::new(settled.graze(), self.values);
        let (at, start) = (origin.offsets(self.at.as_ref()), origin.offsets(self.start.as_ref()));
        let scene = settled.scene();
        let active = scene.expansion.active.iter();
        let active: Vec<&str> =
            active.map(|&parameter| scene.model.parameters[parameter].name.as_str()).collect();
        let coordinates = settled.orbit().section_coordinates(scene);
        let coordinates: Vec<&str> = coordinates.into_iter().map(|(name, _)| name).collect();
        let mut request = TimeSeriesRequest {
            start: named_offsets("start", COORDINATES, &start, &coordinates)?,
            parameters: named_offsets("at", ACTIVE, &at, &active)?,
            settle: self.settle as usize,
            returns: self.periods as usize,
            samples: self.samples as usize,
        };
        let mut remarks = origin.remarks("at", self.at.as_ref());
        if let Some(digits) = &self.itinerary {
            let at = &request.parameters;
            let (start, returns) = periodic_start(digits, settled, at, progress, &mut remarks)?;
            request.start = start;
            request.returns *= returns;
        }
        Ok((request, remarks))
    }

    /// Simulates the time series, or computes the derivatives at its end if they are asked for, and
    /// lays it out.
    ///
    /// # Errors
    ///
    /// As [`request`](Self::request); [`Error::Analysis`] if the simulator refuses the offsets;
    /// [`Error::Derivatives`] where a derivative does not exist.
    pub fn answer(&self, settled: &Settled, progress: &dyn Progress) -> Result<Answer, Error> {
        if let Some(order) = self.derivatives {
            return self.derivatives_answer(settled, order, progress);
        }
        let (request, remarks) = self.request(settled, progress)?;
        refuse_memory(series_bytes(settled.scene(), &request))?;
        let series = time_series(settled.scene(), settled.orbit(), &request, progress)?;
        let answer = trajectory_answer(settled, &request, &series)?;
        Ok(Answer { remarks, ..answer })
    }
}

/// Lays out a time series.
pub(in crate::pipeline) fn trajectory_answer(
    settled: &Settled,
    request: &TimeSeriesRequest,
    series: &TimeSeries,
) -> Result<Answer, Error> {
    let (scene, orbit) = (settled.scene(), settled.orbit());
    let listing = TimeSeriesListing::new(scene, settled.section(), request, series);
    let document = to_json(&Document::new(DocumentKind::Trajectory, scene, listing))?;
    let (text, table) = (time_series_text(scene, series), time_series_table(&scene.model, series));
    Ok(Answer {
        ended: series.early_end.clone().map(Ended::Trajectory),
        ..Answer::new("trajectory", text, document, table)
            .with_figures(time_series_figures(scene, orbit, series))
    })
}

/// First point of a physical orbit with this itinerary, by direct simulation, and its returns.
fn periodic_start(
    digits: &str,
    settled: &Settled,
    parameters: &[f64],
    progress: &dyn Progress,
    remarks: &mut Vec<String>,
) -> Result<(Vec<f64>, usize), Error> {
    let map = Source::Graze(settled.graze().clone()).map_or_free_flight()?;
    let itinerary = ContactItinerary::parse(digits, map.local().passages());
    let itinerary = itinerary.map_err(KeyError::from)?;
    let request = OrbitsRequest {
        itineraries: vec![itinerary],
        at: vec![parameters.to_vec()],
        direct: true,
        far: true,
        loci: None,
    };
    let found = orbits(map.scene(), map.orbit(), map.local(), &request, progress)?;
    let searched = || searched(&map, &request, &found);
    let none = || Ended::NoOrbits { at: 1, searched: searched() };
    let first = found.orbits.first().ok_or_else(none)?;
    if found.orbits.len() > 1 {
        let others = counted(found.orbits.len() - 1, "other orbit");
        remarks.push(format!("the first of its itinerary; {others}: `orbits` lists them"));
    }
    let periods = SectionFrame::<f64>::new(map.scene(), map.orbit()).periods();
    Ok((first.states[0].clone(), first.nominal_returns(periods)))
}

/// Keys of `converge`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct ConvergenceKeys {
    /// Number of new points at which the chosen map is compared with direct simulation.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = Self::default().fresh,
            value_parser = clap::value_parser!(u32).range(1..=1_000_000)
        )
    )]
    pub fresh: u32,
}

impl Default for ConvergenceKeys {
    /// The number of new points of [`StudyRequest::FRESH`].
    fn default() -> Self {
        Self { fresh: StudyRequest::FRESH as u32 }
    }
}

impl ConvergenceKeys {
    /// Computes the study and lays it out.
    ///
    /// # Errors
    ///
    /// As [`Settled::study`].
    pub fn answer(&self, settled: &Settled, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = StudyRequest { fresh: self.fresh as usize, sections: true, chosen: None };
        let study = settled.study(&request, progress)?;
        let weights = study.orders.iter().map(|result| result.orders.contact_weight);
        let edges = settled.window_edges(weights.max().unwrap_or(1))?;
        // NOTE: flown contacts are not truncated.
        let series = settled.scene().emit.shape != Shape::Flown;
        let remark = edge_remark(&edges).filter(|_| series);
        let identifier = &settled.scene().identifier;
        let remark = remark.map(|words| format!("warning: `{identifier}`: {words}"));
        let answer = study_answer(&study, &settled.section())?;
        Ok(Answer { remarks: remark.into_iter().collect(), ..answer })
    }
}

/// Lays out a study. Tables named `speed` hold measured times; the others are reproducible.
pub(in crate::pipeline) fn study_answer(
    study: &ConvergenceStudy,
    section: &SectionDocument,
) -> Result<Answer, Error> {
    let untimed = without_times(study);
    let (text, document) = (convergence_text(study), StudyDocument::new(study, section));
    let timeless = to_json(&StudyDocument::new(&untimed, section))?;
    let figures = convergence_figures(study).into_iter();
    let answer = Answer::new("convergence", text, to_json(&document)?, convergence_table(&untimed))
        .with_figures(figures.map(|(ending, figure, _)| (ending, figure)));
    let mut answer = Answer { timeless: Some(timeless), ..answer };
    answer.tables.push(("convergence-speed", convergence_table(study)));
    Ok(answer)
}

/// JSON document of a study.
#[derive(Serialize)]
struct StudyDocument<'a> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    study: &'a ConvergenceStudy,
    section: &'a SectionDocument,
}

impl<'a> StudyDocument<'a> {
    fn new(study: &'a ConvergenceStudy, section: &'a SectionDocument) -> Self {
        Self { document: DocumentKind::Convergence, format: DocumentKind::FORMAT, study, section }
    }
}
