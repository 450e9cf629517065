//! What an expansion needs to know of one grazing passage, lowered for jets.

use std::sync::Arc;

use super::ExpansionError;
use super::analyticity::{Corner, corner_under};
use super::contact_law::{ContactLaw, ContactLawError};
use super::flown::AffineLaw;
use crate::flow::{Field, InputKind, Program, bound_but};
use crate::jet::{Jet, JetSpace};
use crate::model::{Model, NodeId, Response, Surface};
use crate::numeric::{Dd, Real};

/// The surface, its contact law and the free field around a graze, inactive parameters folded in.
#[derive(Clone, Debug)]
pub struct Passage {
    /// Name of the surface.
    pub surface: String,
    /// Free field with the event function watched, for its series in time and its jets.
    pub field: Field,
    /// What happens at the surface.
    pub law: ContactLaw,
    /// `h'`, then its derivative with respect to each component of the full state, over jets.
    pub normal_velocity: Program,
    dimension: usize,
    parameters: Vec<Dd>,
    active: Vec<usize>,
}

impl Passage {
    /// Lowers the passage of surface `number`; `state` and `parameters` are the values at the
    /// graze.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::ContactLaw`] if a contact field or release function is not analytic at
    /// `state`, the grazing point.
    pub fn new(
        model: &Model,
        number: usize,
        state: &[Dd],
        parameters: &[Dd],
        active: &[usize],
    ) -> Result<Self, ExpansionError> {
        let surface = &model.surfaces[number];
        let inputs = jet_inputs(model.dimension(), parameters, active);
        let law = match &surface.response {
            Response::Impact { reset } => ContactLaw::Rigid {
                reset: Program::new(&model.graph, reset, &inputs),
            },
            Response::Contact { field, release } => {
                let graze: Vec<Dd> = state.iter().chain(parameters).copied().collect();
                refuse_corners(model, surface, field, *release, &graze)?;
                let watched = [*release, surface.event];
                let kinds = bound_but(active, parameters);
                let flight = AffineLaw::new(
                    model,
                    number,
                    [field, &[*release]],
                    [state, parameters],
                    active,
                );
                ContactLaw::Compliant {
                    field: Field::new(&model.graph, field, &watched, &kinds),
                    flight: Box::new(flight),
                }
            }
        };
        let mut graph = model.graph.clone();
        let slopes = (0..model.dimension())
            .map(|component| graph.derivative(surface.normal_velocity, component));
        let normal_velocity: Vec<_> = std::iter::once(surface.normal_velocity)
            .chain(slopes)
            .collect();
        Ok(Self {
            surface: surface.name.clone(),
            field: Field::free_bound(model, &[surface.event], active, parameters),
            law,
            normal_velocity: Program::new(&graph, &normal_velocity, &inputs),
            dimension: model.dimension(),
            parameters: parameters.to_vec(),
            active: active.to_vec(),
        })
    }

    /// Expressions of the model as a program over jets, the inactive parameters folded in.
    pub fn jet_program(&self, model: &Model, outputs: &[NodeId]) -> Program {
        let inputs = jet_inputs(self.dimension, &self.parameters, &self.active);
        Program::new(&model.graph, outputs, &inputs)
    }

    /// Values of all parameters at the graze.
    pub(super) fn parameter_values(&self) -> &[Dd] {
        &self.parameters
    }

    /// Length of the full state.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// All parameters as jets: active ones are `p* + variable`, the first active one being variable
    /// `first_variable` of the space.
    pub fn parameter_jets<S: Real>(
        &self,
        space: &Arc<JetSpace>,
        first_variable: usize,
    ) -> Vec<Jet<S>> {
        parameter_jets(&self.parameters, &self.active, space, first_variable)
    }
}

/// A contact field or a release function at a corner of one of its functions has no expansion.
fn refuse_corners(
    model: &Model,
    surface: &Surface,
    field: &[NodeId],
    release: NodeId,
    graze: &[Dd],
) -> Result<(), ContactLawError> {
    let outputs: Vec<_> = field.iter().copied().chain([release]).collect();
    match corner_under(&model.graph, &outputs, graze) {
        None => Ok(()),
        Some(Corner { function, argument }) => Err(ContactLawError::NotAnalytic {
            surface: surface.name.clone(),
            function,
            argument,
        }),
    }
}

/// All parameters as jets, the active ones as variables from `first_variable` on.
fn parameter_jets<S: Real>(
    parameters: &[Dd],
    active: &[usize],
    space: &Arc<JetSpace>,
    first_variable: usize,
) -> Vec<Jet<S>> {
    let mut jets: Vec<_> = parameters
        .iter()
        .map(|&value| Jet::constant(space, S::from_dd(value)))
        .collect();
    for (position, &parameter) in active.iter().enumerate() {
        jets[parameter] = Jet::variable(
            space,
            first_variable + position,
            S::from_dd(parameters[parameter]),
        );
    }
    jets
}

/// How each input enters a program over jets: states and active parameters vary, the rest is folded
/// in.
fn jet_inputs(dimension: usize, parameters: &[Dd], active: &[usize]) -> Vec<InputKind> {
    let states = (0..dimension).map(|_| InputKind::Variable);
    states.chain(bound_but(active, parameters)).collect()
}
