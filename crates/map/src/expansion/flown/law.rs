//! Whether a contact law is affine, its matrix, and why a contact cannot be flown.

use crate::expansion::error::FlightError;
use crate::flow::{Field, bound_but};
use crate::model::{ExpressionGraph, Model, NodeId};
use crate::numeric::Dd;

/// A contact law that is affine in the states (but the phase) with constant coefficients.
///
/// With `z = x − x_free` the contact adds to the free flight, the law is
///
/// ```text
/// z' = A z + g,   g = f_c(x_free) − f(x_free),   release where ρ(x_free) + r·z = 0
/// ```
#[derive(Clone, Debug)]
pub struct AffineLaw {
    /// Full-state components that a contact moves, in order.
    pub(super) components: Vec<usize>,
    /// Rows of `A`, one per moved component.
    pub(super) matrix: Vec<Vec<Dd>>,
    /// `r`.
    pub(super) release_row: Vec<Dd>,
    /// Positions among the moved components that have a force.
    pub(super) forced: Vec<usize>,
    /// Steps through the two fields from a force to each moved component: `z_i = O(t^{1 +
    /// distance})`.
    pub(super) distances: Vec<u32>,
    /// Whether the free field too is affine in the moved components with constant coefficients.
    pub(super) free_is_affine: bool,
    /// The free field; watched are the event function, the release function, then the forces.
    pub(super) field: Field,
}

impl AffineLaw {
    /// Reads the law of a surface; `inputs` are the state and the parameters at the graze.
    ///
    /// # Errors
    ///
    /// [`FlightError::Field`] and [`FlightError::Release`] where it is not affine.
    pub(in crate::expansion) fn new(
        model: &Model,
        surface: usize,
        [field, release]: [&[NodeId]; 2],
        [state, parameters]: [&[Dd]; 2],
        active: &[usize],
    ) -> Result<Self, FlightError> {
        let dimension = model.dimension();
        let mut slopes = Slopes { graph: model.graph.clone(), dimension, active };
        let distances = distances(model, field);
        let components: Vec<usize> = (0..dimension).filter(|&i| distances[i].is_some()).collect();
        let name = |component: usize| model.states.get(component).cloned().unwrap_or_default();
        let surface_name = || model.surfaces[surface].name.clone();
        let mut rows = Vec::new();
        for &component in &components {
            for &state in &components {
                let slope = slopes.constant(field[component], state);
                rows.push(slope.ok_or_else(|| FlightError::Field {
                    surface: surface_name(),
                    component: name(component),
                    state: name(state),
                })?);
            }
        }
        let mut release_row = Vec::new();
        for &state in &components {
            let slope = slopes.constant(release[0], state);
            release_row.push(slope.ok_or_else(|| FlightError::Release {
                surface: surface_name(),
                state: name(state),
            })?);
        }
        let free_is_affine = components.iter().all(|&component| {
            let mut states = components.iter();
            states.all(|&state| slopes.constant(model.flow[component], state).is_some())
        });
        let mut graph = slopes.graph;
        let moved = components.iter().enumerate();
        let forced: Vec<usize> = moved
            .filter(|&(_, &component)| field[component] != model.flow[component])
            .map(|(position, _)| position)
            .collect();
        let forces = forced.iter().map(|&position| {
            let component = components[position];
            graph.sub(field[component], model.flow[component])
        });
        let watched: Vec<_> =
            [model.surfaces[surface].event, release[0]].into_iter().chain(forces).collect();
        let kinds = bound_but(active, parameters);
        let mut values = Vec::new();
        graph.evaluate(&[state, parameters].concat(), &mut values);
        let value = |node: NodeId| values[node.index()];
        Ok(Self {
            matrix: rows
                .chunks(components.len().max(1))
                .map(|row| row.iter().map(|&node| value(node)).collect())
                .collect(),
            release_row: release_row.into_iter().map(value).collect(),
            distances: components.iter().filter_map(|&i| distances[i]).collect(),
            field: Field::new(&graph, &model.flow, &watched, &kinds),
            components,
            forced,
            free_is_affine,
        })
    }
}

/// Derivatives that are constant: they depend on no state and on no active parameter.
struct Slopes<'a> {
    graph: ExpressionGraph,
    dimension: usize,
    active: &'a [usize],
}

impl Slopes<'_> {
    fn constant(&mut self, node: NodeId, state: usize) -> Option<NodeId> {
        let slope = self.graph.derivative(node, state);
        let moves = |&input: &usize| {
            input < self.dimension || self.active.contains(&(input - self.dimension))
        };
        let dependencies = self.graph.dependencies(slope);
        (!dependencies.iter().any(moves)).then_some(slope)
    }
}

/// Steps through the fields from a component with a force to each component; `None` where none
/// leads.
fn distances(model: &Model, field: &[NodeId]) -> Vec<Option<u32>> {
    let dimension = model.dimension();
    let forced = |component: usize| field[component] != model.flow[component];
    let mut distances: Vec<Option<u32>> = (0..dimension).map(|i| forced(i).then_some(0)).collect();
    for distance in 0..dimension as u32 {
        for component in 0..dimension {
            let inputs = [field[component], model.flow[component]]
                .map(|node| model.graph.dependencies(node))
                .concat();
            let mut reached = inputs.iter().filter(|&&input| input < dimension);
            if distances[component].is_none()
                && reached.any(|&input| distances[input] == Some(distance))
            {
                distances[component] = Some(distance + 1);
            }
        }
    }
    distances
}
