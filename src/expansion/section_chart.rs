//! From section coordinates to the full state and back, as jets.

use std::sync::Arc;

use super::ExpansionError;
use super::passage::Passage;
use crate::flow::evaluate;
use crate::jet::{Jet, JetSpace, implicit_root};
use crate::numeric::{Dd, Real};
use crate::orbit::{PoincareSection, PoincareSectionKind};

/// A chart of a section about a point of the orbit.
#[derive(Clone, Debug)]
pub struct SectionChart {
    /// Which section, and which components of the full state are its coordinates.
    pub section: PoincareSection,
    /// Full state at the origin of the chart.
    pub point: Vec<Dd>,
}

impl SectionChart {
    /// The full state as jets: coordinate `i` is `point + variable first_variable + i`.
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
        let mut state: Vec<_> = self
            .point
            .iter()
            .map(|&value| Jet::constant(space, S::from_dd(value)))
            .collect();
        for (position, &component) in self.section.coordinates.iter().enumerate() {
            state[component] = Jet::variable(
                space,
                first_variable + position,
                S::from_dd(self.point[component]),
            );
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

/// The component `eliminated` as a jet that makes `h'` vanish, the other components given.
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
