//! The cheapest map of every section for one tolerance, and the section chosen for a scene that
//! accepts any.
//!
//! The window is carried along the free flow to the other section, so that all sections are
//! compared on the same orbits. The window there is the smallest box about the carried points. See
//! docs/mathematics/convergence.md.

use std::mem;

use serde::{Deserialize, Serialize};

use super::data::Choice;
use super::{ChoiceOptions, Chooser, choose};
use crate::analysis::{NoProgress, Progress, SectionChange, SubProgress};
use crate::convergence::family::{MapFamily, PROBE};
use crate::convergence::sample::{SamplePoint, WindowSample};
use crate::convergence::{ConvergenceError, resumed};
use crate::expansion::MapOrders;
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::model::{Orders, Scene, Section, SectionRule, StroboscopicPhase};
use crate::numeric::{Dd, decimal_above};
use crate::orbit::{GrazingOrbit, PoincareSectionKind, locate};

/// Times of stroboscopic sections before the first passage, in periods of the orbit.
const AHEAD: [f64; 4] = [0.0, 0.125, 0.25, 0.5];

/// Largest excess of the orders of another section's map over those of the scene's own section:
/// beyond it the map would not be cheaper.
const BEYOND: MapOrders = MapOrders::new(2, 4);

/// Sections within this share of a period are the same.
const SAME: f64 = 1e-6;

/// Number of points of a window that are carried, in addition to its corners; half-widths are then
/// accurate to about a hundredth.
const CARRIED: usize = 1000;

/// Number of digits of a carried half-width, rounded up.
const DIGITS: u32 = 3;

/// The cheapest map of one section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionChoice {
    /// Time of a stroboscopic section before the first passage, in periods of the orbit; `None` for
    /// the tangency section.
    pub ahead: Option<f64>,
    /// Phase of a stroboscopic section.
    pub phase: Option<f64>,
    /// Cheapest map of the section; `None` if it has none.
    pub choice: Option<Choice>,
    /// Reason why the section has no map.
    pub problem: Option<String>,
}

/// The section chosen of several, and the costs of the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionVerdict {
    /// Section with the cheapest map; the tangency section if its map costs no more than others, or
    /// if no section has a map within the tolerance.
    pub taken: SectionChoice,
    /// Cheapest maps of the other sections.
    pub others: Vec<SectionChoice>,
}

/// A scene on the section on which its map is taken.
#[derive(Clone, Debug)]
pub struct SettledScene {
    /// The scene, with its section named and its window stated on that section.
    pub scene: Scene,
    /// The orbit of the scene on that section.
    pub orbit: GrazingOrbit,
    /// Comparison of the sections; `None` if the scene names its section.
    pub verdict: Option<SectionVerdict>,
}

impl SettledScene {
    /// Cheapest map on the section, if sections were compared.
    pub fn choice(&self) -> Option<&Choice> {
        self.verdict.as_ref()?.taken.choice.as_ref()
    }
}

/// The scene on the section on which its map is taken: the section that it names or, if it accepts
/// any, the one whose cheapest map for the tolerance has the fewest operations.
///
/// A scene that accepts any section states its window on the tangency section, and `orbit` is its
/// orbit there. Sections tried are that one and stroboscopic ones at the graze and an eighth, a
/// quarter and half a period before it. On each, the window is the smallest box about the scene's
/// window carried by the free flow, with half-widths rounded up to three digits. Errors are in the
/// offsets of each section.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no points.
pub fn settle_section(
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<SettledScene, ConvergenceError> {
    let (mut scene, orbit) = (scene.clone(), orbit.clone());
    let rule = mem::replace(&mut scene.section_rule, SectionRule::Named);
    let (SectionRule::Any, Orders::Tolerance(tolerance)) = (rule, scene.expansion.orders) else {
        return Ok(SettledScene { scene, orbit, verdict: None });
    };
    let options = ChoiceOptions::new(tolerance);
    let mut chooser = Chooser::new(&scene, &orbit, options.fresh)?;
    let own = chooser.choose(tolerance)?;
    let trial = SectionTrial::new(&scene, &orbit, &options, &own, &chooser.bench.sample);
    let trials = parallel::map(others(&scene, &orbit), |section| trial.of(section, &NoProgress));
    let tangency = SectionChoice { ahead: None, phase: None, choice: Some(own), problem: None };
    let mut settled = cheapest((scene, orbit, tangency), trials);
    if let Some(verdict) = settled.verdict.as_mut().filter(|verdict| verdict.taken.ahead.is_some())
    {
        // The final choice is the one that the section would get by name: trials have no orders far
        // beyond those of the tangency section.
        verdict.taken.choice = Some(choose(&settled.scene, &settled.orbit, &options)?);
    }
    Ok(settled)
}

/// Chooses the first of the sections whose maps have the fewest operations.
fn cheapest(
    (mut scene, mut orbit, mut taken): (Scene, GrazingOrbit, SectionChoice),
    trials: Vec<TriedSection>,
) -> SettledScene {
    let mut others = Vec::new();
    for trial in trials {
        others.push(match trial.place {
            Some(place) if trial.choice.costs_less_than(&taken) => {
                (scene, orbit) = place;
                mem::replace(&mut taken, trial.choice)
            }
            _ => trial.choice,
        });
    }
    // The tangency section first, the nearest to the graze next: the order of the trials.
    let order = |section: &SectionChoice| section.ahead.unwrap_or(-1.0);
    others.sort_by(|a, b| order(a).total_cmp(&order(b)));
    SettledScene { scene, orbit, verdict: Some(SectionVerdict { taken, others }) }
}

/// Cheapest maps of the tangency section and of stroboscopic sections at the graze and an eighth, a
/// quarter and half a period before it, except the scene's own section.
///
/// Windows and errors are as for [`settle_section`]. `own` is the choice on the scene's section:
/// maps of orders far beyond its own are not tried.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no points.
pub fn choose_sections(
    scene: &Scene,
    orbit: &GrazingOrbit,
    options: &ChoiceOptions,
    own: &Choice,
    progress: &dyn Progress,
) -> Result<Vec<SectionChoice>, ConvergenceError> {
    let map = MapFamily::new(scene, orbit, PROBE)?.map(PROBE)?;
    let window = WindowSample::new(&map);
    let trial = SectionTrial::new(scene, orbit, options, own, &window);
    let chosen = |(number, section): (usize, _)| {
        let part = SubProgress::new(progress, number);
        resumed(&part, &[0], || Ok(trial.of(section, &SubProgress::new(&part, 1)).choice))
    };
    parallel::try_map(others(scene, orbit).into_iter().enumerate(), chosen)
}

/// A section that was tried.
struct TriedSection {
    choice: SectionChoice,
    /// The scene and its orbit on the section, if it has a map.
    place: Option<(Scene, GrazingOrbit)>,
}

/// Data for trials of other sections.
struct SectionTrial<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    options: &'a ChoiceOptions,
    /// Highest orders that are tried.
    limit: MapOrders,
    /// Points of the scene's window, on its own section.
    points: Vec<SamplePoint>,
}

impl<'a> SectionTrial<'a> {
    /// Trials for a scene whose own section has this choice.
    fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        options: &'a ChoiceOptions,
        own: &Choice,
        window: &WindowSample,
    ) -> Self {
        let (limit, points) = (own.orders.plus(BEYOND), window.judging(0, CARRIED));
        Self { scene, orbit, options, limit, points }
    }

    /// Tries a section; its window contains the same orbits.
    fn of(
        &self,
        (ahead, section): (Option<f64>, Section),
        progress: &dyn Progress,
    ) -> TriedSection {
        let moved = moved(self.scene, self.orbit, section, &self.points);
        let chosen = moved.and_then(|(scene, orbit)| {
            let chooser = Chooser::new(&scene, &orbit, self.options.fresh);
            let chosen = chooser.and_then(|chooser| {
                let mut chooser = chooser.within(self.limit).resuming(progress);
                chooser.choose(self.options.tolerance)
            });
            let choice = chosen.map_err(|error| error.to_string())?;
            Ok((choice, (scene, orbit)))
        });
        let problem = chosen.as_ref().err().cloned();
        let (choice, place) = chosen.ok().unzip();
        let phase = place.as_ref().and_then(|(_, orbit)| phase(orbit));
        TriedSection { choice: SectionChoice { ahead, phase, choice, problem }, place }
    }
}

/// Other sections, with their times before the first passage in periods of the orbit.
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
    let ahead = AHEAD.into_iter().filter(|ahead| own.is_none_or(|own| (own - ahead).abs() > SAME));
    others.extend(ahead.map(|ahead| {
        let phase = match ahead {
            0.0 => StroboscopicPhase::Grazing,
            _ => StroboscopicPhase::At(graze - advance * Dd::from(ahead)),
        };
        (Some(ahead), Section::Stroboscopic(phase))
    }));
    others
}

/// The scene and its orbit on another section, with the smallest window there that contains these
/// points; or the reason why there is none.
fn moved(
    scene: &Scene,
    orbit: &GrazingOrbit,
    section: Section,
    points: &[SamplePoint],
) -> Result<(Scene, GrazingOrbit), String> {
    let mut other = scene.clone();
    other.section = section;
    let location = locate(&other).map_err(|error| error.to_string())?;
    let moved = location.into_result().map_err(|error| error.to_string())?;
    let system = HybridSystem::new(&scene.model);
    let change = SectionChange::<f64>::new(&system, (scene, orbit), (&other, &moved));
    let mut change = change.map_err(|error| error.to_string())?;
    let mut widths = vec![0.0_f64; moved.section.coordinates.len()];
    for point in points {
        let carried = change.carry(&point.state, &point.parameters);
        let carried = carried.map_err(|error| error.to_string())?;
        for (width, offset) in widths.iter_mut().zip(carried.iter().flatten()) {
            *width = width.max(offset.abs());
        }
    }
    other.window.state.fill(f64::INFINITY);
    for (&component, &width) in moved.section.coordinates.iter().zip(&widths) {
        other.window.state[component] = decimal_above(width, DIGITS);
    }
    Ok((other, moved))
}

/// Phase of a stroboscopic section; `None` for a tangency section.
fn phase(orbit: &GrazingOrbit) -> Option<f64> {
    match orbit.section.kind {
        PoincareSectionKind::Tangency => None,
        PoincareSectionKind::Stroboscopic { phase } => Some(phase.to_f64()),
    }
}

impl SectionChoice {
    /// Operations of a step, if the section's map meets the tolerance.
    pub fn operations(&self) -> Option<usize> {
        let met = self.choice.as_ref().filter(|choice| choice.met);
        met.map(|choice| choice.operations)
    }

    /// Whether this section costs fewer operations; a map that meets the tolerance costs less than
    /// none.
    fn costs_less_than(&self, other: &Self) -> bool {
        let cost = |section: &Self| section.operations().unwrap_or(usize::MAX);
        cost(self) < cost(other)
    }
}
