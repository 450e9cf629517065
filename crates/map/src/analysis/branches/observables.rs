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
use crate::analysis::section_frame::{SectionFrame, Values};
use crate::analysis::time_series::{SeriesPoint, TimeSeriesRequest, time_series};
use crate::expansion::LocalMap;
use crate::hybrid::{HybridSystem, MomentEvent};
use crate::iteration::parallel;
use crate::model::{DiagramRequest, Method, Scene, Spacing};
use crate::numeric::polynomial::extrema;
use crate::orbit::GrazingOrbit;

/// Largest error of the time of a contact, relative to the period of its orbit.
const ROUNDING: f64 = 1e-6;
/// States per return from which an amplitude is computed at first and at most, their growth, and
/// the relative change at which it stays.
const SAMPLES: usize = 400;
const MOST_SAMPLES: usize = 102_400;
const FINER: usize = 4;
const RESOLVED: f64 = 1e-10;
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
/// orbits with more contacts than one per passage are computed by direct simulation of the orbits,
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
        // Every contact has its speed, unless there are more than one per passage.
        BranchObservable::ImpactSpeed
            if scene.grazing.hits.surfaces.is_empty() && found.extra_contacts == 0 =>
        {
            let speeds = found.contacts.iter().map(|contact| contact.speed);
            return Ok(speeds.fold(0.0, f64::max));
        }
        _ => {}
    }
    let Some(time) = period(scene, orbit, found, &mut frame)? else { return Ok(f64::NAN) };
    let mut request = TimeSeriesRequest {
        start: found.states[0].clone(),
        parameters: found.parameters.clone(),
        settle: 0,
        returns: (time / frame.duration() - ROUNDING).ceil() as usize,
        samples: SAMPLES,
    };
    let value = match observable {
        BranchObservable::Amplitude => amplitude(scene, orbit, &mut request, frame.surface())?,
        BranchObservable::ContactTime => {
            // A contact that begins within the period may end after it.
            request.returns += 1;
            let series = time_series(scene, orbit, &request, &NoProgress)?;
            series.early_end.is_none().then(|| contact_time(&series.points, time))
        }
        _ => {
            let events = MotionEvents::of(scene, orbit, &request)?;
            events.map(|events| events.impact_speed())
        }
    };
    Ok(value.unwrap_or(f64::NAN))
}

/// Half the range of a surface's gap along a motion, on samples that grow in number until it stays;
/// `None` if the simulation ends early.
fn amplitude(
    scene: &Scene,
    orbit: &GrazingOrbit,
    request: &mut TimeSeriesRequest,
    surface: usize,
) -> Result<Option<f64>, AnalysisError> {
    let model = &scene.model;
    let mut velocity =
        Values::<f64>::new(model, &model.graph, &[model.surfaces[surface].normal_velocity]);
    let mut known = f64::INFINITY;
    loop {
        let series = time_series(scene, orbit, request, &NoProgress)?;
        if series.early_end.is_some() {
            return Ok(None);
        }
        let rows: Vec<[f64; 3]> = (series.points.iter())
            .map(|row| {
                let slope = velocity.evaluate(&row.state, &series.parameters).get(0);
                [row.time, row.gaps[surface], slope]
            })
            .collect();
        let [least, most] = range(&rows);
        let found = 0.5 * (most - least);
        if (found - known).abs() <= RESOLVED * found || request.samples >= MOST_SAMPLES {
            return Ok(Some(found));
        }
        known = found;
        request.samples *= FINER;
    }
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

/// Least and largest value of a function by rows of time, value and slope: of the rows, and of the
/// cubics between them.
fn range(rows: &[[f64; 3]]) -> [f64; 2] {
    let between = rows.windows(2).flat_map(|ends| {
        let &[[start, from, slope], [end, to, last]] = ends else { return Vec::new() };
        let (time, rise) = (end - start, to - from);
        if slope * last >= 0.0 || time <= 0.0 {
            return Vec::new();
        }
        let [slope, last] = [slope * time, last * time];
        extrema(&[from, slope, 3.0 * rise - 2.0 * slope - last, slope + last - 2.0 * rise], 1.0)
    });
    let values = rows.iter().map(|row| row[1]).chain(between.map(|extremum| extremum.value));
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
        [least.min(value), most.max(value)]
    })
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
        let row = |time: f64| [time, 3.0 + 2.0 * time.sin(), 2.0 * time.cos()];
        let rows: Vec<[f64; 3]> = (0..=400).map(|number| row(time(number))).collect();
        let [least, most] = range(&rows);
        // Error of the fourth power of the spacing; samples alone err by 1e-4.
        assert!((least - 1.0).abs() < 1e-9 && (most - 5.0).abs() < 1e-9, "{least} {most}");
    }
}
