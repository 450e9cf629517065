//! Start of the search for the grazing orbit at a special point of a branch: its state at the
//! graze, and the stops that it hits.
//!
//! One idea: the orbit is simulated once. The moment at which it comes nearest to touching the
//! surface is the guess, and the surfaces of its impacts are the hits.

use std::collections::BTreeSet;

use crate::analysis::error::AnalysisError;
use crate::analysis::progress::NoProgress;
use crate::analysis::section_frame::{SectionFrame, Values};
use crate::analysis::time_series::{EarlyEnd, TimeSeriesRequest, time_series};
use crate::hybrid::MomentEvent;
use crate::model::{NodeId, Scene};
use crate::numeric::{Dd, converted};
use crate::orbit::{BRIEF, GrazingOrbit, PoincareSectionKind};

/// States per return from which the range of the gap is taken.
const SAMPLES: usize = 100;
/// Largest depth of a touch that counts as a graze, as a part of the largest gap of its surface.
const TOUCHES: f64 = 1e-9;

/// Special point of a branch at which one passage grazes.
#[derive(Clone, Debug, PartialEq)]
pub struct BranchGraze {
    /// Offsets of the active parameters.
    pub parameters: Vec<f64>,
    /// Offsets of the section point before the graze.
    pub start: Vec<f64>,
    /// Surface that grazes (index).
    pub surface: usize,
    /// Number of the passage that grazes, from 0, in the order in which passages follow the
    /// section; `None` for a surface without one.
    pub passage: Option<usize>,
    /// Number of nominal returns of the orbit.
    pub returns: usize,
    /// Forcing periods of the orbit beyond those of its nominal returns.
    pub turns: i32,
}

/// Start of the search for a grazing orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct GrazeGuess {
    /// Full state near the graze.
    pub state: Vec<f64>,
    /// All parameters of the model.
    pub parameters: Vec<Dd>,
    /// Surfaces that the orbit hits, increasing (indices).
    pub hits: Vec<usize>,
    /// Shortest hit of the surface that grazes, if it is too short to count as a hit.
    pub brief: Option<BriefHit>,
}

/// Hit that is taken for a graze because it is short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BriefHit {
    /// Normal velocity at which the surface is met.
    pub speed: f64,
    /// Time that the free flow would stay beyond the surface.
    pub stay: f64,
    /// Shortest stay of a hit.
    pub least: f64,
}

/// Starts the search for the grazing orbit at a special point of a branch of `orbit`; the early end
/// if the orbit of the point cannot be simulated for its period.
///
/// # Errors
///
/// [`AnalysisError::Length`]; [`AnalysisError::Hybrid`] if the simulator refuses the parameters.
pub fn graze_guess(
    scene: &Scene,
    orbit: &GrazingOrbit,
    graze: &BranchGraze,
) -> Result<Result<GrazeGuess, EarlyEnd>, AnalysisError> {
    let mut frame = SectionFrame::<Dd>::new(scene, orbit);
    frame.place(&converted(&graze.start), &converted(&graze.parameters))?;
    let forcing = frame.periods().max(1) as f64;
    let length = graze.returns as f64 + f64::from(graze.turns) / forcing;
    let request = TimeSeriesRequest {
        start: graze.start.clone(),
        parameters: graze.parameters.clone(),
        settle: 0,
        returns: length.ceil() as usize,
        samples: SAMPLES,
    };
    let series = time_series(scene, orbit, &request, &NoProgress)?;
    if let Some(end) = series.early_end {
        return Ok(Err(end));
    }
    let span = length * series.duration;
    let rows: Vec<_> = series.points.iter().filter(|row| row.time < span).collect();
    let gaps = rows.iter().map(|row| row.gaps[graze.surface].abs());
    let touches = TOUCHES * gaps.fold(0.0, f64::max);
    let model = &scene.model;
    let nodes = model.surfaces.iter();
    let nodes = nodes.flat_map(|surface| [surface.normal_velocity, surface.normal_acceleration]);
    let mut normal = Values::<f64>::new(model, &model.graph, &nodes.collect::<Vec<NodeId>>());
    let (mut hits, mut closest) = (BTreeSet::new(), None::<(f64, Vec<f64>)>);
    let mut shortest = None::<(f64, f64)>;
    for row in rows {
        let Some((event, surface)) = row.event else { continue };
        let here = normal.evaluate(&row.state, &series.parameters);
        let (velocity, acceleration) = (here.get(2 * surface), here.get(2 * surface + 1));
        let depth = match event {
            MomentEvent::Impact | MomentEvent::Contact => velocity.powi(2) / (2.0 * acceleration),
            MomentEvent::Minimum => row.gaps[surface],
            MomentEvent::Release => continue,
        };
        // An acceleration towards the surface has no depth: the free flow does not turn back.
        if surface == graze.surface && depth.abs() <= touches {
            if closest.as_ref().is_none_or(|(nearest, _)| depth.abs() < *nearest) {
                closest = Some((depth.abs(), row.state.clone()));
            }
            continue;
        }
        if event == MomentEvent::Minimum {
            continue;
        }
        hits.insert(surface);
        let stay = 2.0 * velocity.abs() / acceleration;
        let least = shortest.map_or(f64::INFINITY, |(_, least)| least);
        if surface == graze.surface && acceleration > 0.0 && stay < least {
            shortest = Some((velocity.abs(), stay));
        }
    }
    let on_section = graze.passage == Some(0) && frame.kind() == PoincareSectionKind::Tangency;
    let at_section = converted(frame.state());
    let state = match closest {
        Some((_, state)) if !on_section => state,
        _ => at_section,
    };
    // Without forcing every contact counts as a hit.
    let least = model.phase.as_ref().map_or(0.0, |_| BRIEF * series.duration / forcing);
    let brief = shortest.filter(|(_, stay)| *stay <= least);
    Ok(Ok(GrazeGuess {
        state,
        parameters: frame.parameters().to_vec(),
        hits: hits.into_iter().collect(),
        brief: brief.map(|(speed, stay)| BriefHit { speed, stay, least }),
    }))
}
