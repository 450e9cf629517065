//! What is found on both sides of a graze, by guarded iteration: beside what theory expects there.

use std::cell::OnceCell;

use serde::Serialize;

use super::diagram::{Entry, Found, SweepSubject, kept_contacts, name, settle};
use super::error::AnalysisError;
use super::escape::escape_bounds;
use crate::expansion::LocalMap;
use crate::iteration::{OrbitEnd, OrbitName, OrbitRequest, Period};
use crate::model::{Method, Observable, Scene};
use crate::orbit::GrazingOrbit;

/// Shares of the parameter's half-width at which is measured, on both sides.
const SHARES: [f64; 4] = [-0.1, -0.01, 0.01, 0.1];
/// By how much an attractor near the graze may be larger at ten times the offset: by a square root
/// it grows by 3.2, and by less where its period is shorter there.
const GROWTH: f64 = 5.0;
/// Iterates before an orbit has settled, and those kept.
const TRANSIENT: usize = 3000;
const KEPT: usize = 256;

/// What a map settles on at an offset of a parameter from the graze.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredSide {
    /// The offset.
    pub offset: f64,
    /// Period in returns.
    pub period: Period,
    /// Name of the orbit; `None` without a period.
    pub orbit: Option<OrbitName>,
    /// Whether it makes contact.
    pub contact: bool,
    /// Largest Lyapunov exponent per return, where the map made all of it.
    pub lyapunov: Option<f64>,
    /// Whether it is near the graze: in the window of the map, or, at the larger offset, not much
    /// larger than one that is at the smaller offset.
    pub near: bool,
    /// Largest distance of a coordinate from the graze, in half-widths of the window.
    pub size: f64,
    /// How the orbit ended.
    pub end: OrbitEnd,
}

/// What guarded iteration settles on at a tenth and a hundredth of the window's half-width of a
/// parameter to both sides of the graze, from beside the orbit without contact.
///
/// # Errors
///
/// [`AnalysisError::NotActive`] if the parameter is no variable of the map;
/// [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn measure_graze(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    parameter: &str,
) -> Result<Vec<MeasuredSide>, AnalysisError> {
    let place = map.parameters.iter().position(|active| active.name == parameter);
    let place =
        place.ok_or_else(|| AnalysisError::NotActive { parameter: parameter.to_owned() })?;
    let observe = &Observable::EventFunction;
    let subject = SweepSubject { scene, orbit, map, observe, system: OnceCell::new() };
    let swept = subject.swept(Method::Guarded)?;
    let bounds: Vec<f64> = escape_bounds(scene, orbit).iter().map(|bound| bound.offset).collect();
    let request = OrbitRequest::new(TRANSIENT, KEPT, &map.window.state).escaping_at(&bounds);
    let entry = |share: f64| {
        let mut parameters = vec![0.0; map.parameters.len()];
        parameters[place] = share * map.window.parameter[place];
        Entry { parameters, carried: None }
    };
    let entries: Vec<Entry> = SHARES.into_iter().map(entry).collect();
    let found = settle(&*swept, entries.clone(), None, &request);
    let side = |(found, entry): (Found, Entry)| {
        let (settled, parameters) = (found.settled, entry.parameters);
        let near = settled.orbit.end == OrbitEnd::Completed
            && settled.orbit.states().all(|state| map.window.holds(state, &parameters, &[]));
        let widths = map.window.state.iter();
        let reached = settled.orbit.extent().into_iter().zip(widths);
        let reached = reached.map(|([low, high], width)| low.abs().max(high.abs()) / width);
        MeasuredSide {
            offset: parameters[place],
            period: settled.orbit.period,
            orbit: name(&*swept, &settled.orbit, &parameters),
            contact: kept_contacts(&settled.orbit) > 0,
            lyapunov: settled.lyapunov,
            near,
            size: reached.fold(0.0, f64::max),
            end: settled.orbit.end,
        }
    };
    let mut sides: Vec<MeasuredSide> = found.into_iter().zip(entries).map(side).collect();
    for (far, close) in [(0, 1), (3, 2)] {
        let is_near = sides[close].near && sides[far].end == OrbitEnd::Completed;
        sides[far].near |= is_near && sides[far].size <= GROWTH * sides[close].size;
    }
    Ok(sides)
}
