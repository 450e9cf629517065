//! One grazing passage in its place on the orbit.

use super::ExpansionError;
use super::description::variables;
use super::passage::Passage;
use super::routes::grazing_chart;
use super::section_chart::SectionChart;
use super::variables::Variables;
use crate::model::Scene;
use crate::orbit::GrazingOrbit;

/// A passage with the chart in which its contact acts and the variables of that chart.
#[derive(Clone, Debug)]
pub(super) struct Graze {
    pub(super) passage: Passage,
    pub(super) chart: SectionChart,
    pub(super) variables: Variables,
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
