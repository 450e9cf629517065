//! Faults of a scene that only some commands mind: sweeps of frozen parameters, and resets that
//! move a state which only touches.

use super::document::Table;
use super::{Scene, load};
use crate::model::error::{Checked, Fault, SceneError, SceneProblem};
use crate::model::graph::NodeId;
use crate::model::oscillator::Response;
use crate::numeric::Dd;

impl Scene {
    /// Refuses diagrams of a parameter that the map does not keep.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::NotActive`] at the first of them.
    pub fn check_diagrams(&self) -> Result<(), SceneError> {
        self.check_swept("diagram", "parameter")
    }

    /// Refuses charts of parameters that the map does not keep.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::NotActive`] at the first of them.
    pub fn check_charts(&self) -> Result<(), SceneError> {
        self.check_swept("chart", "parameters")
    }

    /// Refuses a parameter that is not active under a key of a list of tables.
    fn check_swept(&self, list: &str, key: &str) -> Result<(), SceneError> {
        self.located(|root| {
            let tables = root.field(list).map_or(Ok(Vec::new()), |field| field.tables())?;
            for table in &tables {
                for entry in table.require(key)?.one_or_list("a parameter's name")? {
                    let name = entry.text("a parameter's name")?;
                    let mut active = self.expansion.active.iter();
                    if !active.any(|&parameter| self.model.parameters[parameter].name == name) {
                        let (key, name) = (entry.path.clone(), name.to_owned());
                        return Err(entry.fault(SceneProblem::NotActive { key, name }));
                    }
                }
            }
            Ok(())
        })
    }

    /// Refuses an impact at a surface that grazes which moves every state tried that touches with
    /// zero normal velocity: no orbit has a map near its graze then.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::MovesTangentState`] at the `impact` of the first such surface.
    pub fn check_tangent_states(&self) -> Result<(), SceneError> {
        let mut surfaces = self.grazing.passages.iter();
        let moved = surfaces.find_map(|&surface| Some((surface, self.moved(surface)?)));
        let Some((number, (component, displacement))) = moved else {
            return Ok(());
        };
        let problem = SceneProblem::MovesTangentState {
            surface: self.model.surfaces[number].name.clone(),
            component: self.model.full_state_names()[component].to_owned(),
            displacement,
        };
        self.located(|root| {
            let model = root.require("model")?.table()?;
            let surfaces = model.require("surface")?.tables()?;
            let impact = surfaces.get(number).map(|surface| surface.require("impact"));
            Err(impact
                .transpose()?
                .map_or(Fault::nowhere(problem.clone()), |impact| impact.fault(problem)))
        })
    }

    /// What a check finds in the scene's text.
    fn located(&self, check: impl FnOnce(&Table<'_>) -> Checked<()>) -> Result<(), SceneError> {
        let found = load::parsed(&self.text)
            .and_then(|document| check(&Table::root(&self.text, document.as_table())));
        found.map_err(|fault| fault.in_file(&self.file_name, &self.text))
    }

    /// The component that the reset at a surface moves farthest, and how far, at the first of
    /// several states that touch with zero normal velocity; `None` unless all of them are moved.
    fn moved(&self, surface: usize) -> Option<(usize, f64)> {
        let surface = &self.model.surfaces[surface];
        let Response::Impact { reset } = &surface.response else {
            return None;
        };
        let conditions = [surface.event, surface.normal_velocity];
        let starts = (0..SAMPLES).map(|sample| self.start(sample));
        let touching = starts.filter_map(|start| self.touching(start, conditions));
        let mut first = None;
        let mut count = 0;
        for state in touching {
            let image = self.values(&state, reset);
            let moves = image.iter().zip(&state).map(|(after, before)| after - before).enumerate();
            let farthest = moves.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            if farthest.1.abs() <= MOVED * size(&state) || !farthest.1.is_finite() {
                return None;
            }
            count += 1;
            first.get_or_insert(farthest);
        }
        first.filter(|_| count >= LEAST)
    }

    /// A state to begin from: the guess of the scene, and others about it.
    fn start(&self, sample: usize) -> Vec<f64> {
        let dimension = self.model.dimension();
        let guess = self.grazing.guess.clone().unwrap_or_else(|| vec![0.0; dimension]);
        let wave = |component: usize| (1.3 * sample as f64 + 2.1 * component as f64).sin();
        let spread = |(component, value): (usize, f64)| match sample {
            0 => value,
            _ => value + wave(component) * 0.3 * value.abs().max(1.0),
        };
        guess.into_iter().enumerate().map(spread).collect()
    }

    /// The state near another at which both conditions vanish: Newton's method of least change,
    /// derivatives by differences.
    fn touching(&self, mut state: Vec<f64>, conditions: [NodeId; 2]) -> Option<Vec<f64>> {
        for _ in 0..ITERATIONS {
            let found = self.values(&state, &conditions);
            let small = found.iter().all(|value| value.abs() <= TOUCHES * size(&state));
            if small {
                return Some(state);
            }
            let rows: Vec<Vec<f64>> = (0..state.len())
                .map(|component| {
                    let step = DIFFERENCE * state[component].abs().max(1.0);
                    let mut beside = state.clone();
                    beside[component] += step;
                    let ahead = self.values(&beside, &conditions);
                    ahead.iter().zip(&found).map(|(a, b)| (a - b) / step).collect()
                })
                .collect();
            let product =
                |a: usize, b: usize| -> f64 { rows.iter().map(|row| row[a] * row[b]).sum() };
            let (aa, ab, bb) = (product(0, 0), product(0, 1), product(1, 1));
            let determinant = aa * bb - ab * ab;
            let first = (bb * found[0] - ab * found[1]) / determinant;
            let second = (aa * found[1] - ab * found[0]) / determinant;
            for (value, row) in state.iter_mut().zip(&rows) {
                *value -= row[0] * first + row[1] * second;
            }
            if !state.iter().all(|value| value.is_finite()) {
                return None;
            }
        }
        None
    }

    /// Values of nodes at a state and the scene's parameters.
    fn values(&self, state: &[f64], nodes: &[NodeId]) -> Vec<f64> {
        let parameters = self.model.parameters.iter().map(|parameter| parameter.value);
        let parameters = parameters.map(Dd::to_f64);
        let inputs: Vec<f64> = state.iter().copied().chain(parameters).collect();
        let mut values = Vec::new();
        self.model.graph.evaluate(&inputs, &mut values);
        nodes.iter().map(|node| values[node.index()]).collect()
    }
}

/// States tried.
const SAMPLES: usize = 8;
/// Fewest of them that must be found to touch.
const LEAST: usize = 3;
/// A displacement that is none, relative to the size of the state.
const MOVED: f64 = 1e-6;
/// Where a condition counts as met, relative to the size of the state.
const TOUCHES: f64 = 1e-10;
/// Step of a difference, relative to the component.
const DIFFERENCE: f64 = 1e-7;
/// Most steps of Newton's method.
const ITERATIONS: usize = 40;

/// The size of a state, at least 1.
fn size(state: &[f64]) -> f64 {
    state.iter().fold(1.0, |size, value| size.max(value.abs()))
}
