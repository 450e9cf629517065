//! Observables of the orbits of branches beside their section points, and branches drawn over the
//! iterates of a diagram.

use serde::{Deserialize, Serialize};

use super::data::{BranchPoint, BranchRequest, Branches};
use crate::analysis::diagram::{Diagram, Observer, diagram};
use crate::analysis::direct_image::{DirectEnd, DirectImage};
use crate::analysis::direct_map::DirectMap;
use crate::analysis::error::AnalysisError;
use crate::analysis::motion::MotionEvents;
use crate::analysis::periodic::FoundOrbit;
use crate::analysis::progress::{NoProgress, Progress};
use crate::analysis::section_frame::SectionFrame;
use crate::analysis::time_series::{SeriesPoint, TimeSeriesRequest, time_series};
use crate::expansion::LocalMap;
use crate::hybrid::{HybridSystem, MomentEvent};
use crate::iteration::parallel;
use crate::model::{DiagramRequest, Method, Scene, Spacing};
use crate::orbit::GrazingOrbit;

/// Largest error of the time of a contact, relative to the period of its orbit.
const ROUNDING: f64 = 1e-6;
/// States per return from which an amplitude is computed.
const SAMPLES: usize = 400;
/// Most parameter values at which iterates are drawn behind branches.
const MOST_VALUES: usize = 400;

/// Scalar observable of an orbit of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BranchObservable {
    /// Event function of the section's surface at the first section point: `−y²` of a contact.
    #[serde(rename = "h")]
    Gap,
    /// Largest speed of a contact; 0 without contact.
    ImpactSpeed,
    /// Time in contact with compliant surfaces per period of the orbit.
    ContactTime,
    /// Half the range of the gap of the section's surface along the orbit.
    Amplitude,
}

impl BranchObservable {
    /// Name in tables and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gap => "h",
            Self::ImpactSpeed => "impact_speed",
            Self::ContactTime => "contact_time",
            Self::Amplitude => "amplitude",
        }
    }
}

/// Values of an observable by branch and point. Contact times, amplitudes, and impact speeds of
/// orbits that hit stops between their grazes are computed by direct simulation of the orbits,
/// whatever method found them. NaN if the simulation ends early, and for virtual orbits except for
/// the gap.
///
/// # Errors
///
/// [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
pub fn observed(
    scene: &Scene,
    orbit: &GrazingOrbit,
    found: &Branches,
    observable: BranchObservable,
) -> Result<Vec<Vec<f64>>, AnalysisError> {
    let value = |point: &BranchPoint| of_orbit(scene, orbit, point, observable);
    parallel::try_map(&found.branches, |branch| parallel::try_map(&branch.points, value))
}

fn of_orbit(
    scene: &Scene,
    orbit: &GrazingOrbit,
    point: &BranchPoint,
    observable: BranchObservable,
) -> Result<f64, AnalysisError> {
    let found = &point.orbit;
    // Virtual orbits are not motions of the oscillator and cannot be simulated.
    if !found.physical && observable != BranchObservable::Gap {
        return Ok(f64::NAN);
    }
    let mut frame = SectionFrame::<f64>::new(scene, orbit);
    frame.place(&found.states[0], &found.parameters)?;
    match observable {
        BranchObservable::Gap => return Ok(frame.gap()),
        BranchObservable::ImpactSpeed if scene.grazing.hits.surfaces.is_empty() => {
            let speeds = found.contacts.iter().map(|contact| contact.speed);
            return Ok(speeds.fold(0.0, f64::max));
        }
        _ => {}
    }
    let mut request = TimeSeriesRequest {
        start: found.states[0].clone(),
        parameters: found.parameters.clone(),
        settle: 0,
        returns: found.nominal_returns(frame.periods()),
        samples: SAMPLES,
    };
    if observable == BranchObservable::ImpactSpeed {
        let events = MotionEvents::of(scene, orbit, &request)?;
        return Ok(events.map_or(f64::NAN, |events| events.impact_speed()));
    }
    let period = match observable {
        BranchObservable::ContactTime => period(scene, orbit, found, &mut frame)?,
        _ => None,
    };
    // A contact that begins within the period may end after it.
    request.returns += usize::from(period.is_some());
    let series = time_series(scene, orbit, &request, &NoProgress)?;
    if series.early_end.is_some() {
        return Ok(f64::NAN);
    }
    Ok(match observable {
        BranchObservable::ContactTime => {
            period.map_or(f64::NAN, |period| contact_time(&series.points, period))
        }
        _ => {
            let gaps = series.points.iter();
            let gaps = gaps.map(|point| (point.time, point.gaps[frame.surface()]));
            let gaps: Vec<(f64, f64)> = gaps.collect();
            0.5 * (largest(&gaps, 1.0) - largest(&gaps, -1.0))
        }
    })
}

/// Time in which an orbit repeats; `None` without one of its images.
fn period(
    scene: &Scene,
    orbit: &GrazingOrbit,
    found: &FoundOrbit,
    frame: &mut SectionFrame<f64>,
) -> Result<Option<f64>, AnalysisError> {
    let returns = found.itinerary.period();
    if frame.periods() > 0 {
        let beyond = f64::from(found.turns) / frame.periods() as f64;
        return Ok(Some(frame.duration() * (returns as f64 + beyond)));
    }
    let system = HybridSystem::new(&scene.model);
    let mut image = DirectImage::<f64>::new(&system, scene, orbit)?;
    let (mut state, mut total) = (found.states[0].clone(), 0.0);
    for _ in 0..returns {
        let next = image.image(&state, &found.parameters)?;
        if next.end != DirectEnd::Returned {
            return Ok(None);
        }
        total += next.elapsed;
        state = next.offsets;
    }
    Ok(Some(total))
}

/// Total time, to their releases, of the contacts that begin within a period.
fn contact_time(points: &[SeriesPoint], period: f64) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    // A contact at the start comes again at the end, to rounding.
    let end = first.time + period * (1.0 - ROUNDING);
    let mut since: Vec<(usize, f64)> = Vec::new();
    let mut total = 0.0;
    for point in points {
        let Some((event, surface)) = point.event else { continue };
        match event {
            MomentEvent::Contact if point.time < end => since.push((surface, point.time)),
            MomentEvent::Release => {
                if let Some(place) = since.iter().position(|(begun, _)| *begun == surface) {
                    total += point.time - since.remove(place).1;
                }
            }
            _ => {}
        }
    }
    total
}

/// Largest value, or smallest for a negative sign: the extremum of the parabola through three rows
/// if they are evenly spaced.
fn largest(rows: &[(f64, f64)], sign: f64) -> f64 {
    let signed = |place: usize| sign * rows[place].1;
    let Some(at) = (0..rows.len()).max_by(|&a, &b| signed(a).total_cmp(&signed(b))) else {
        return f64::NAN;
    };
    if at == 0 || at + 1 == rows.len() {
        return rows[at].1;
    }
    let (before, after) = (rows[at].0 - rows[at - 1].0, rows[at + 1].0 - rows[at].0);
    let [a, b, c] = [rows[at - 1].1, rows[at].1, rows[at + 1].1];
    let bend = a - 2.0 * b + c;
    match (before - after).abs() <= 1e-6 * after && bend != 0.0 {
        true => b - (a - c).powi(2) / (8.0 * bend),
        false => b,
    }
}

/// Branches and iterates over the same range, for one drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct BranchDiagram {
    /// Guarded iterates over the range of the branches.
    pub diagram: Diagram,
    /// Observable by branch, point and return.
    pub values: Vec<Vec<Vec<f64>>>,
}

/// First diagram of a scene over the varied parameter, recomputed over the range of the branches;
/// `None` if there is none, or if another parameter is away from the graze.
///
/// # Errors
///
/// [`AnalysisError::Expansion`] if an impact speed cannot be expanded, [`AnalysisError::Hybrid`] if
/// the simulator refuses the parameters.
pub fn branch_diagram(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BranchRequest,
    found: &Branches,
    progress: &dyn Progress,
) -> Result<Option<BranchDiagram>, AnalysisError> {
    let along = scene.expansion.active[request.along];
    let asked = scene.diagrams.iter().find(|diagram| diagram.parameter == along);
    let others = request.at.iter().enumerate().filter(|(place, _)| *place != request.along);
    let (Some(asked), true) = (asked, { others }.all(|(_, &offset)| offset == 0.0)) else {
        return Ok(None);
    };
    let observer = Observer::new(scene, orbit, map, &asked.observe)?;
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let value = |state: &Vec<f64>, parameters: &[f64]| match request.direct {
        true => observer.by_simulation(&direct, state, parameters),
        false => observer.by_map(state, parameters),
    };
    let values = found.branches.iter().map(|branch| {
        let points = branch.points.iter().map(|point| {
            let states = point.orbit.states.iter();
            states.map(|state| value(state, &point.orbit.parameters)).collect()
        });
        points.collect()
    });
    let [a, b] = request.range;
    let over = DiagramRequest {
        range: [a.min(b), a.max(b)],
        points: asked.points.min(MOST_VALUES),
        spacing: Spacing::Even,
        with: vec![Method::Guarded],
        ..asked.clone()
    };
    let diagram = diagram(scene, orbit, map, &over, progress)?;
    Ok(Some(BranchDiagram { diagram, values: values.collect() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(time: f64, event: Option<MomentEvent>) -> SeriesPoint {
        let event = event.map(|event| (event, 0));
        SeriesPoint { time, state: Vec::new(), gaps: vec![0.0], event }
    }

    #[test]
    fn contact_time_is_that_of_contacts_that_end() {
        let rows = [
            row(-0.1, Some(MomentEvent::Contact)),
            row(0.2, Some(MomentEvent::Release)),
            row(1.0, None),
            row(1.5, Some(MomentEvent::Contact)),
            row(1.75, Some(MomentEvent::Release)),
            // The first contact, a period later.
            row(1.9, Some(MomentEvent::Contact)),
            row(2.2, Some(MomentEvent::Release)),
        ];
        assert!((contact_time(&rows, 2.0) - 0.55).abs() < 1e-15);
        assert_eq!(contact_time(&rows[2..3], 2.0), 0.0);
    }

    #[test]
    fn an_extent_is_that_of_the_curve_and_not_of_its_samples() {
        let time = |number: i32| 0.37 + f64::from(number) * std::f64::consts::TAU / 400.0;
        let rows: Vec<(f64, f64)> =
            (0..=400).map(|number| (time(number), 3.0 + 2.0 * time(number).sin())).collect();
        let half = 0.5 * (largest(&rows, 1.0) - largest(&rows, -1.0));
        // Error of the fourth power of the spacing; samples alone err by 1e-4.
        assert!((half - 2.0).abs() < 1e-8, "{half}");
    }
}
