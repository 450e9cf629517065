//! Charts of sections along the grazing orbit, and the passages and legs of one period in the order
//! in which they follow the section.

use std::sync::Arc;

use super::error::ExpansionError;
use super::passage::Passage;
use super::variables::{Variables, variables};
use crate::flow::evaluate;
use crate::jet::{Jet, JetSpace, implicit_root};
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::{GrazingOrbit, PoincareSection, PoincareSectionKind};

/// One end of a leg.
#[derive(Clone, Debug)]
pub struct RouteEnd {
    /// Chart of the section at this end.
    pub chart: SectionChart,
    /// Number, counted from the section, of the passage at which a tangency section is.
    pub passage: usize,
}

/// A leg: its two ends on the grazing orbit, and its duration.
#[derive(Clone, Debug)]
pub struct Route {
    /// Section that the leg leaves.
    pub from: RouteEnd,
    /// Section that the leg reaches.
    pub to: RouteEnd,
    /// Duration of the leg on the grazing orbit.
    pub duration: Dd,
    /// Phase to add to that of the far chart: whole forcing periods.
    pub phase_advance: Dd,
}

/// Itinerary of one period, as legs between places on the grazing orbit.
#[derive(Clone, Debug)]
pub struct Routes {
    /// Passages (indices into [`GrazingOrbit::passages`]) in the order in which they follow the
    /// section.
    pub passages: Vec<usize>,
    /// Leg from the section to the first passage; `None` if the section is at that passage.
    pub before: Option<Route>,
    /// Legs from each passage to the next, and from the last to the next section point.
    pub after: Vec<Route>,
    /// Leg from the section to the section one period later.
    pub whole: Route,
}

/// A place on the grazing orbit: end of a leg, and time since the section.
#[derive(Clone, Debug)]
struct Place {
    end: RouteEnd,
    time: Dd,
}

impl Routes {
    /// Itinerary of a scene's section along its grazing orbit.
    pub fn of(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let met = orbit.passages_after_section(scene);
        let about = met.iter().position(|passage| passage.place == 0);
        let section = |time: Dd| Place {
            end: RouteEnd {
                chart: SectionChart {
                    section: orbit.section.clone(),
                    point: orbit.section_point.clone(),
                },
                passage: about.unwrap_or(0),
            },
            time,
        };
        let (start, end) = (section(Dd::ZERO), section(orbit.period));
        let grazes = met.iter().enumerate().map(|(passage, graze)| {
            let chart = grazing_chart(orbit, graze.place);
            let end = RouteEnd { chart, passage };
            let time = graze.time;
            Place { end, time }
        });
        let mut places: Vec<_> = grazes.chain([end.clone()]).collect();
        let route = |from: &Place, to: &Place| route(scene, orbit, from, to);
        let before = places.first().filter(|first| first.time > Dd::ZERO);
        let before = before.map(|first| route(&start, first));
        if before.is_none()
            && let Some(first) = places.first_mut()
        {
            first.end.chart = start.end.chart.clone();
        }
        Self {
            passages: met.into_iter().map(|passage| passage.place).collect(),
            after: places.windows(2).map(|pair| route(&pair[0], &pair[1])).collect(),
            whole: route(&start, &end),
            before,
        }
    }
}

/// Chart in which the contact of a passage acts: the scene's section, through the grazing point.
fn grazing_chart(orbit: &GrazingOrbit, passage: usize) -> SectionChart {
    let graze = &orbit.passages[passage];
    SectionChart { section: graze.section.clone(), point: graze.state.clone() }
}

/// The leg between two places.
fn route(scene: &Scene, orbit: &GrazingOrbit, from: &Place, to: &Place) -> Route {
    let duration = to.time - from.time;
    let phase_advance = scene.model.phase.as_ref().map_or(Dd::ZERO, |clock| {
        let phase = scene.model.dimension() - 1;
        let all = clock.period * Dd::from(scene.grazing.periods as f64);
        let flown = all * duration / orbit.period;
        // The phases of the charts already differ by the advance, up to whole periods.
        let turns =
            (flown - (to.end.chart.point[phase] - from.end.chart.point[phase])) / clock.period;
        clock.period * (turns + Dd::from(0.5)).floor()
    });
    Route { from: from.end.clone(), to: to.end.clone(), duration, phase_advance }
}

/// A chart of a section about a point of the orbit.
#[derive(Clone, Debug)]
pub struct SectionChart {
    /// The section and its coordinates.
    pub section: PoincareSection,
    /// Full state at the origin of the chart.
    pub point: Vec<Dd>,
}

impl SectionChart {
    /// Full state as jets: coordinate `i` is `point + variable first_variable + i`.
    ///
    /// On a tangency section the eliminated component solves `h' = 0`.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if `h'` does not depend on the eliminated component.
    pub fn embed<S: Real>(
        &self,
        passage: &Passage,
        space: &Arc<JetSpace>,
        first_variable: usize,
    ) -> Result<Vec<Jet<S>>, ExpansionError> {
        let mut state: Vec<_> =
            self.point.iter().map(|&value| Jet::constant(space, S::from_dd(value))).collect();
        for (position, &component) in self.section.coordinates.iter().enumerate() {
            state[component] =
                Jet::variable(space, first_variable + position, S::from_dd(self.point[component]));
        }
        if self.section.kind == PoincareSectionKind::Tangency {
            let eliminated = self.section.eliminated;
            let parameters =
                passage.parameter_jets(space, first_variable + self.section.coordinates.len());
            state[eliminated] = solve_tangency(passage, &state, &parameters, eliminated)?;
        }
        Ok(state)
    }

    /// Offsets of the coordinates of a full state from `origin`.
    pub fn offsets<S: Real>(&self, state: &[Jet<S>], origin: &[Dd]) -> Vec<Jet<S>> {
        self.section
            .coordinates
            .iter()
            .map(|&component| state[component].add_constant(-S::from_dd(origin[component])))
            .collect()
    }
}

/// Solves `h' = 0` for the component `eliminated` as a jet, with the other components given.
fn solve_tangency<S: Real>(
    passage: &Passage,
    state: &[Jet<S>],
    parameters: &[Jet<S>],
    eliminated: usize,
) -> Result<Jet<S>, ExpansionError> {
    let mut inputs: Vec<_> = state.iter().chain(parameters).cloned().collect();
    let root = implicit_root(&state[eliminated], |component| {
        inputs[eliminated] = component.clone();
        let mut values = evaluate(&passage.normal_velocity, component.space(), &inputs);
        let slope = values.swap_remove(1 + eliminated);
        (values.swap_remove(0), slope)
    })?;
    Ok(root)
}

/// A passage with the chart in which its contact acts and the variables of that chart.
#[derive(Clone, Debug)]
pub struct Graze {
    /// The surface, its contact law and the free field.
    pub passage: Passage,
    /// Chart in which the contact acts.
    pub chart: SectionChart,
    /// Variables of that chart.
    pub variables: Variables,
}

impl Graze {
    /// Passage `number` of an orbit.
    pub(super) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        number: usize,
    ) -> Result<Self, ExpansionError> {
        let (graze, active) = (&orbit.passages[number], &scene.expansion.active);
        let (state, parameters) = (&graze.state, &graze.parameters);
        Ok(Self {
            passage: Passage::new(&scene.model, graze.surface, state, parameters, active)?,
            chart: grazing_chart(orbit, number),
            variables: variables(scene, &graze.section),
        })
    }
}
