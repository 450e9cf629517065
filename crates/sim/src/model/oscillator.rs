//! A checked oscillator: names, expression graph, free field and surfaces.

use super::graph::{ExpressionGraph, NodeId};
use crate::numeric::Dd;

/// An oscillator with its surfaces, every expression resolved into one [`ExpressionGraph`].
///
/// The *full state* is `states` followed by the phase if there is one; its length is
/// [`dimension`](Model::dimension). Inputs of the graph are the full state, then the parameters.
#[derive(Clone, Debug)]
pub struct Model {
    /// Name of the model.
    pub name: String,
    /// Source of the model, such as a publication.
    pub source: Option<String>,
    /// Names of the states, without the phase.
    pub states: Vec<String>,
    /// The forcing phase; `None` for an autonomous system.
    pub phase: Option<Phase>,
    /// Parameters with their values in the scene.
    pub parameters: Vec<Parameter>,
    /// Every expression of the model.
    pub graph: ExpressionGraph,
    /// Time derivative of each component of the full state in free flight (the phase's rate last).
    pub flow: Vec<NodeId>,
    /// The stops.
    pub surfaces: Vec<Surface>,
}

/// The forcing phase `theta`, with `dtheta/dt = rate`, taken modulo `period`.
#[derive(Clone, Debug)]
pub struct Phase {
    /// Name of the phase.
    pub name: String,
    /// Rate of the phase, an expression of parameters only.
    pub rate: NodeId,
    /// Period of the phase, a positive number.
    pub period: Dd,
}

/// A parameter and its value in the scene, exactly the decimal literal in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: Dd,
}

/// A stop: its event function is positive in free flight and 0 at contact.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name of the surface.
    pub name: String,
    /// The event function `h(x, p)`.
    pub event: NodeId,
    /// Normal velocity `h' = L_f h` along the free flow (built by symbolic differentiation).
    pub normal_velocity: NodeId,
    /// Normal acceleration `h'' = L_f² h` along the free flow.
    pub normal_acceleration: NodeId,
    /// Response of the oscillator at the surface.
    pub response: Response,
}

/// Response of an oscillator at a surface.
#[derive(Clone, Debug)]
pub enum Response {
    /// Rigid stop: the full state jumps to these values.
    Impact {
        /// State after the impact, one node per component of the full state (others are unchanged).
        reset: Vec<NodeId>,
    },
    /// Compliant stop: the full state follows this field until `release` vanishes on the way out.
    Contact {
        /// Time derivative of each full-state component in contact.
        field: Vec<NodeId>,
        /// The release function.
        release: NodeId,
    },
}

impl Model {
    /// Length of the full state: the states, and the phase if there is one.
    pub fn dimension(&self) -> usize {
        self.states.len() + usize::from(self.phase.is_some())
    }

    /// Input number of a parameter in the graph.
    pub fn parameter_input(&self, parameter: usize) -> usize {
        self.dimension() + parameter
    }

    /// Names of the full state: the states, then the phase.
    pub fn full_state_names(&self) -> Vec<&str> {
        self.states
            .iter()
            .map(String::as_str)
            .chain(self.phase.iter().map(|phase| phase.name.as_str()))
            .collect()
    }

    /// Names of all parameters.
    pub fn parameter_names(&self) -> Vec<&str> {
        let parameters = self.parameters.iter();
        parameters.map(|parameter| parameter.name.as_str()).collect()
    }

    /// Values of all parameters in the scene.
    pub fn parameter_values(&self) -> Vec<Dd> {
        let parameters = self.parameters.iter();
        parameters.map(|parameter| parameter.value).collect()
    }
}
