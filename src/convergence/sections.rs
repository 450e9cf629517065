//! The cheapest map of every other section for the same tolerance on the same window.
//!
//! One idea: the points by which maps of the scene's section are judged are carried along the free flow to the other section, so
//! that both are asked for the same orbits. See docs/mathematics/convergence.md.

use serde::{Deserialize, Serialize};

use super::ConvergenceError;
use super::choice::ChoiceOptions;
use super::chooser::Chooser;
use super::data::Choice;
use super::judge::JudgingPoints;
use super::sample::SamplePoint;
use crate::analysis::SectionChange;
use crate::expansion::MapOrders;
use crate::hybrid::HybridSystem;
use crate::model::{Scene, Section, StroboscopicPhase};
use crate::numeric::Dd;
use crate::orbit::{GrazingOrbit, PoincareSectionKind, locate};

/// How long before the first passage stroboscopic sections are taken, over the period of the orbit.
const AHEAD: [f64; 4] = [0.0, 0.125, 0.25, 0.5];

/// By how much the orders of a map of another section may exceed those of the scene's own: it would not be cheaper.
const BEYOND: MapOrders = MapOrders {
    smooth_order: 2,
    contact_weight: 4,
};

/// Sections nearer than this share of a period are the same.
const SAME: f64 = 1e-6;

/// The cheapest map of another section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionChoice {
    /// How long before the first passage a stroboscopic section is, over the period; `None` for the tangency section.
    pub ahead: Option<f64>,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Its cheapest map; `None` where the section has none.
    pub choice: Option<Choice>,
    /// Why it has none.
    pub problem: Option<String>,
}

/// The cheapest maps of the tangency section and of stroboscopic ones at the graze and an eighth, a quarter and half a period
/// before it, without the scene's own.
///
/// Their windows are that of the scene, its points carried along the free flow; errors are in the offsets of each section. `own` is
/// the choice on the scene's section: maps of orders far beyond its own are not tried.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no points.
pub fn choose_sections(
    scene: &Scene,
    orbit: &GrazingOrbit,
    options: &ChoiceOptions,
    own: &Choice,
) -> Result<Vec<SectionChoice>, ConvergenceError> {
    let limit = MapOrders {
        smooth_order: own.smooth_order + BEYOND.smooth_order,
        contact_weight: own.contact_weight + BEYOND.contact_weight,
    };
    let points = JudgingPoints::of_scene(scene, orbit, options.fresh)?;
    let others = others(scene, orbit).into_iter();
    Ok(others
        .map(|(ahead, section)| {
            let chosen = choose_on((scene, orbit), section, &points, (options.tolerance, limit));
            SectionChoice {
                ahead,
                phase: match section {
                    Section::Stroboscopic(StroboscopicPhase::At(phase)) => Some(phase.to_f64()),
                    Section::Stroboscopic(StroboscopicPhase::Grazing) | Section::Tangency => None,
                },
                problem: chosen.as_ref().err().cloned(),
                choice: chosen.ok(),
            }
        })
        .collect())
}

/// Other sections, with how long they are before the first passage.
fn others(scene: &Scene, orbit: &GrazingOrbit) -> Vec<(Option<f64>, Section)> {
    let tangency = orbit.section.kind == PoincareSectionKind::Tangency;
    let mut others = Vec::new();
    if !tangency {
        others.push((None, Section::Tangency));
    }
    let Some(clock) = &scene.model.phase else {
        return others;
    };
    let passages = orbit.passages_after_section(scene);
    let first = passages.iter().find(|passage| passage.place == 0);
    let own = first.filter(|_| !tangency).map(|first| first.share);
    let graze = orbit.grazing_point().state[scene.model.dimension() - 1];
    let advance = clock.period * Dd::from(scene.grazing.periods as f64);
    let ahead = AHEAD
        .into_iter()
        .filter(|ahead| own.is_none_or(|own| (own - ahead).abs() > SAME));
    others.extend(ahead.map(|ahead| {
        let phase = match ahead {
            0.0 => StroboscopicPhase::Grazing,
            _ => StroboscopicPhase::At(graze - advance * Dd::from(ahead)),
        };
        (Some(ahead), Section::Stroboscopic(phase))
    }));
    others
}

/// The choice on another section; why there is none.
fn choose_on(
    (scene, orbit): (&Scene, &GrazingOrbit),
    section: Section,
    points: &JudgingPoints,
    (tolerance, limit): (f64, MapOrders),
) -> Result<Choice, String> {
    let mut other = scene.clone();
    other.section = section;
    let location = locate(&other).map_err(|error| error.to_string())?;
    let moved = location.into_result().map_err(|error| error.to_string())?;
    let system = HybridSystem::new(&scene.model);
    let change = SectionChange::<f64>::new(&system, (scene, orbit), (&other, &moved));
    let mut change = change.map_err(|error| error.to_string())?;
    let points = points.map(|point| {
        let carried = change.carry(&point.state, &point.parameters).ok()??;
        Some(SamplePoint {
            state: carried,
            ..point.clone()
        })
    });
    for (place, &component) in moved.section.coordinates.iter().enumerate() {
        other.window.state[component] = points.half_width(place);
    }
    let chooser = Chooser::on_points(&other, &moved, points);
    let chosen = chooser.and_then(|chooser| chooser.within(limit).choose(tolerance));
    chosen.map_err(|error| error.to_string())
}
