//! One grazing passage lowered for jets: the surface, its contact law and the free field, with
//! checks that the law is analytic, and whether it is affine, as an exact flight requires.
//!
//! An operation of the expression graph is analytic wherever its value and the derivatives of its
//! own function are finite. It is therefore enough to check the arguments of the few operations
//! that have a corner (`abs`, `sign`, `min`, `max`) or a branch point or pole (`sqrt`, `log`,
//! powers that are not whole, quotients).

use std::sync::Arc;

use super::error::{ContactLawError, ExpansionError, FlightError, LawKind};
use super::power_law::{PowerLaw, Rewritten};
use crate::flow::{Field, InputKind, Program, bound_but};
use crate::jet::{Jet, JetSpace};
use crate::model::{Binary, ExpressionGraph, Model, Node, NodeId, Response, Unary};
use crate::numeric::{Dd, Real};

/// The surface, its contact law and the free field around a graze, with inactive parameters folded
/// in.
#[derive(Clone, Debug)]
pub struct Passage {
    /// Name of the surface.
    pub surface: String,
    /// Free field that watches the event function, for its series in time and its jets.
    pub field: Field,
    /// Contact law of the surface.
    pub law: ContactLaw,
    /// Program over jets for `h'` and its derivatives in each component of the full state.
    pub normal_velocity: Program,
    dimension: usize,
    /// Values of all parameters at the graze.
    pub(super) parameters: Vec<Dd>,
    active: Vec<usize>,
}

impl Passage {
    /// Lowers the passage of surface `number`; `state` and `parameters` are the values at the
    /// graze.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::ContactLaw`] if a reset, contact field or release function is not analytic
    /// at `state`, the grazing point.
    pub fn new(
        model: &Model,
        number: usize,
        state: &[Dd],
        parameters: &[Dd],
        active: &[usize],
    ) -> Result<Self, ExpansionError> {
        let surface = &model.surfaces[number];
        let inputs = jet_inputs(model.dimension(), parameters, active);
        let graze: Vec<Dd> = state.iter().chain(parameters).copied().collect();
        let analytic = |graph: &ExpressionGraph, outputs: &[NodeId], at: &[Dd], law: LawKind| {
            let Some(corner) = corner_under(graph, outputs, at) else {
                return Ok(());
            };
            let (Corner { function, argument }, surface) = (corner, surface.name.clone());
            Err(ContactLawError::NotAnalytic { surface, law, function, argument })
        };
        let law = match &surface.response {
            Response::Impact { reset } => {
                analytic(&model.graph, reset, &graze, LawKind::Impact)?;
                ContactLaw::Rigid { reset: Program::new(&model.graph, reset, &inputs) }
            }
            Response::Contact { field, release } => {
                let outputs: Vec<_> = field.iter().copied().chain([*release]).collect();
                match Rewritten::new(model, number, &outputs, &graze, active)? {
                    Some(law) => {
                        let at = law.inputs(&graze);
                        analytic(&law.graph, &law.outputs, &at, LawKind::Contact)?;
                        ContactLaw::Powers(Box::new(law.lowered(model, number, inputs.clone())?))
                    }
                    None => {
                        analytic(&model.graph, &outputs, &graze, LawKind::Contact)?;
                        let laws = [&field[..], &[*release]];
                        let at = [state, parameters];
                        let flight = AffineLaw::new(model, number, laws, at, active);
                        let watched = [*release, surface.event];
                        let kinds = bound_but(active, parameters);
                        ContactLaw::Compliant {
                            field: Field::new(&model.graph, field, &watched, &kinds),
                            flight: Box::new(flight),
                        }
                    }
                }
            }
        };
        let mut graph = model.graph.clone();
        let slopes = (0..model.dimension())
            .map(|component| graph.derivative(surface.normal_velocity, component));
        let normal_velocity: Vec<_> =
            std::iter::once(surface.normal_velocity).chain(slopes).collect();
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

    /// Lowers expressions of the model to a program over jets, with inactive parameters folded in.
    pub fn jet_program(&self, model: &Model, outputs: &[NodeId]) -> Program {
        let inputs = jet_inputs(self.dimension, &self.parameters, &self.active);
        Program::new(&model.graph, outputs, &inputs)
    }

    /// Length of the full state.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// All parameters as jets. Active ones are `p* + variable`; the first active one is variable
    /// `first_variable` of the space.
    pub fn parameter_jets<S: Real>(
        &self,
        space: &Arc<JetSpace>,
        first_variable: usize,
    ) -> Vec<Jet<S>> {
        let values = self.parameters.iter().map(|&value| S::from_dd(value));
        let mut jets: Vec<_> = values.map(|value| Jet::constant(space, value)).collect();
        for (position, &parameter) in self.active.iter().enumerate() {
            let value = S::from_dd(self.parameters[parameter]);
            jets[parameter] = Jet::variable(space, first_variable + position, value);
        }
        jets
    }
}

/// Kind of each input of a program over jets: states and active parameters vary, the others are
/// folded in.
fn jet_inputs(dimension: usize, parameters: &[Dd], active: &[usize]) -> Vec<InputKind> {
    let states = (0..dimension).map(|_| InputKind::Variable);
    states.chain(bound_but(active, parameters)).collect()
}

/// Contact law of a surface, with inactive parameters folded in.
#[derive(Clone, Debug)]
pub enum ContactLaw {
    /// A reset: the state jumps.
    Rigid {
        /// The reset, a program over jets.
        reset: Program,
    },
    /// A contact field with powers of the penetration.
    Powers(Box<PowerLaw>),
    /// A contact field, followed until its release function vanishes.
    Compliant {
        /// Contact field that watches the release function, then the event function.
        field: Field,
        /// The law in affine form for an exact flight, or the reason why it is not affine.
        flight: Box<Result<AffineLaw, FlightError>>,
    },
}

/// An operation that is not analytic at a point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Corner {
    /// Name of the function, with its exponent for a power.
    pub(super) function: String,
    /// Argument of the function.
    pub(super) argument: f64,
}

/// An argument within this distance of a corner, relative to the size of the inputs, is on the
/// corner.
const ON_THE_CORNER: f64 = 1e-13;

/// The first operation under `outputs` that is not analytic at `inputs` (full state, then
/// parameters).
fn corner_under(graph: &ExpressionGraph, outputs: &[NodeId], inputs: &[Dd]) -> Option<Corner> {
    let mut values = Vec::new();
    graph.evaluate(inputs, &mut values);
    let scale = inputs.iter().fold(1.0_f64, |m, v| m.max(v.to_f64().abs()));
    let needed = graph.needed_by(outputs);
    let operations = graph.nodes().iter().zip(needed);
    operations
        .filter(|(_, needed)| *needed)
        .find_map(|(node, _)| corner_of(node, &values, scale * ON_THE_CORNER))
}

/// The corner of an operation, if its argument is within `near` of it or outside its domain.
fn corner_of(node: &Node, values: &[Dd], near: f64) -> Option<Corner> {
    let value = |id: NodeId| values[id.index()].to_f64();
    let (function, argument, distance) = match *node {
        Node::Unary(Unary::Abs, a) => ("abs".to_owned(), value(a), value(a).abs()),
        Node::Unary(Unary::Sign, a) => ("sign".to_owned(), value(a), value(a).abs()),
        Node::Unary(Unary::Sqrt, a) => ("sqrt".to_owned(), value(a), value(a)),
        Node::Unary(Unary::Log, a) => ("log".to_owned(), value(a), value(a)),
        Node::Unary(Unary::Asin, a) => ("asin".to_owned(), value(a), 1.0 - value(a).abs()),
        Node::Unary(Unary::Acos, a) => ("acos".to_owned(), value(a), 1.0 - value(a).abs()),
        Node::Binary(Binary::Min, a, b) => {
            let difference = value(a) - value(b);
            ("min".to_owned(), difference, difference.abs())
        }
        Node::Binary(Binary::Max, a, b) => {
            let difference = value(a) - value(b);
            ("max".to_owned(), difference, difference.abs())
        }
        Node::Binary(Binary::Div, _, b) => ("the reciprocal".to_owned(), value(b), value(b).abs()),
        Node::PowerInteger(a, exponent) if exponent < 0 => {
            (format!("power {exponent}"), value(a), value(a).abs())
        }
        Node::PowerReal(a, exponent) => {
            (format!("power {}", exponent.to_f64()), value(a), value(a))
        }
        _ => return None,
    };
    // NOTE: a distance of NaN does not count as safe.
    let on_it = distance <= near || distance.is_nan();
    on_it.then_some(Corner { function, argument })
}

/// A contact law that is affine in the states (not the phase) with constant coefficients.
///
/// With `z = x − x_free`, the contribution of the contact, the law is
///
/// ```text
/// z' = A z + g,   g = f_c(x_free) − f(x_free),   release where ρ(x_free) + r·z = 0
/// ```
#[derive(Clone, Debug)]
pub struct AffineLaw {
    /// Components of the full state that a contact moves, in order.
    pub(super) components: Vec<usize>,
    /// Rows of `A`, one per moved component.
    pub(super) matrix: Vec<Vec<Dd>>,
    /// Row `r` of the release.
    pub(super) release_row: Vec<Dd>,
    /// Positions, among the moved components, of those with a force.
    pub(super) forced: Vec<usize>,
    /// Number of steps through the two fields from a force to each moved component:
    /// `z_i = O(t^{1 + distance})`.
    pub(super) distances: Vec<u32>,
    /// Whether the free field is also affine in the moved components with constant coefficients.
    pub(super) free_is_affine: bool,
    /// Free field that watches the event function, the release function, then the forces.
    pub(super) field: Field,
}

impl AffineLaw {
    /// Reads the law of a surface; `inputs` are the state and the parameters at the graze.
    ///
    /// # Errors
    ///
    /// [`FlightError::Field`] and [`FlightError::Release`] if the field or the release is not
    /// affine.
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

/// Finds derivatives that are constant: they depend on no state and on no active parameter.
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

/// Number of steps through the fields from a component with a force to each component; `None` if
/// there is no path.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(build: impl Fn(&mut ExpressionGraph, NodeId) -> NodeId, at: f64) -> Option<String> {
        let mut graph = ExpressionGraph::new();
        let x = graph.input(0);
        let output = build(&mut graph, x);
        corner_under(&graph, &[output], &[Dd::from(at)]).map(|corner| corner.function)
    }

    #[test]
    fn corners_are_named_only_where_they_are() {
        let abs = |graph: &mut ExpressionGraph, x| graph.unary(Unary::Abs, x);
        assert_eq!(corner(abs, 0.0).as_deref(), Some("abs"));
        assert_eq!(corner(abs, 0.5), None);
        let square = |graph: &mut ExpressionGraph, x| graph.mul(x, x);
        assert_eq!(corner(square, 0.0), None);
    }

    #[test]
    fn branch_points_and_what_lies_beyond_them_are_named() {
        let root = |graph: &mut ExpressionGraph, x| graph.unary(Unary::Sqrt, x);
        assert_eq!(corner(root, 0.0).as_deref(), Some("sqrt"));
        assert_eq!(corner(root, -1.0).as_deref(), Some("sqrt"));
        assert_eq!(corner(root, 1.0), None);
    }
}
