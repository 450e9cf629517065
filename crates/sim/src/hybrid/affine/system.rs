//! The affine expressions of a model: what is read off its graph once, for all parameters.

use crate::flow::AffineExpressions;
use crate::model::{Model, NodeId, Response};

/// The affine expressions of a model. Numbers are places in their list.
#[derive(Clone, Debug)]
pub(in crate::hybrid) struct AffineSystem {
    pub(super) expressions: AffineExpressions,
    pub(super) phase_rate: Option<usize>,
    /// Derivative of each state in free flight.
    pub(super) free: Vec<usize>,
    pub(super) surfaces: Vec<AffineSurface>,
}

#[derive(Clone, Debug)]
pub(super) struct AffineSurface {
    pub(super) event: usize,
    /// Each state after an impact, where that is affine and the phase stays.
    pub(super) reset: Option<Vec<usize>>,
    pub(super) contact: Option<AffineContact>,
}

/// A contact with an affine field and release function.
#[derive(Clone, Debug)]
pub(super) struct AffineContact {
    pub(super) derivatives: Vec<usize>,
    pub(super) release: usize,
    /// The other surfaces, watched after the release.
    pub(super) others: Vec<usize>,
}

impl AffineSystem {
    /// Takes a model apart; `None` unless free flight and all events are affine.
    pub(in crate::hybrid) fn new(model: &Model) -> Option<Self> {
        let mut list = List::default();
        let states = model.states.len();
        let phase = model.phase.as_ref();
        let phase_rate = phase.map(|phase| list.push(phase.rate));
        let free = list.push_all(&model.flow[..states]);
        let surfaces: Vec<_> =
            (0..model.surfaces.len()).map(|surface| list.surface(model, surface)).collect();
        let expressions = AffineExpressions::new(
            &model.graph,
            &list.nodes,
            model.dimension(),
            phase.map(|_| states),
            model.parameters.len(),
        );
        let affine = |&place: &usize| expressions.is_affine(place);
        let needed = surfaces.iter().map(|surface| surface.event);
        let needed = needed.chain(phase_rate).chain(free.iter().copied());
        if !needed.into_iter().all(|place| affine(&place)) {
            return None;
        }
        let without_others = |surface: AffineSurface| AffineSurface {
            event: surface.event,
            reset: surface.reset.filter(|reset| reset.iter().all(affine)),
            contact: surface.contact.filter(|contact| {
                affine(&contact.release) && contact.derivatives.iter().all(affine)
            }),
        };
        Some(Self {
            surfaces: surfaces.into_iter().map(without_others).collect(),
            expressions,
            phase_rate,
            free,
        })
    }
}

/// Expressions in the order in which they are listed.
#[derive(Default)]
struct List {
    nodes: Vec<NodeId>,
}

impl List {
    fn push(&mut self, node: NodeId) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn push_all(&mut self, nodes: &[NodeId]) -> Vec<usize> {
        nodes.iter().map(|&node| self.push(node)).collect()
    }

    fn surface(&mut self, model: &Model, index: usize) -> AffineSurface {
        let surface = &model.surfaces[index];
        let states = model.states.len();
        let event = self.push(surface.event);
        let (mut reset, mut contact) = (None, None);
        match &surface.response {
            Response::Impact { reset: image } => {
                let keeps_phase = (image.get(states)).is_none_or(|&phase| {
                    model.graph.node(phase) == crate::model::Node::Input(states)
                });
                reset = keeps_phase.then(|| self.push_all(&image[..states]));
            }
            Response::Contact { field, release } => {
                let keeps_rate = field.get(states) == model.flow.get(states);
                let others = (0..model.surfaces.len()).filter(|&other| other != index);
                contact = keeps_rate.then(|| AffineContact {
                    derivatives: self.push_all(&field[..states]),
                    release: self.push(*release),
                    others: others.collect(),
                });
            }
        }
        AffineSurface { event, reset, contact }
    }
}
