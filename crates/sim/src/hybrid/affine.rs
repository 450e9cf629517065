//! A model whose free flight is affine, taken apart for its exact flow.
//!
//! One idea: with all expressions as rows over one extended state (`flow::AffineExpressions`),
//! flows, gaps, their derivatives and resets are products with it. Free flight goes by exact steps
//! from event to event (`exact_step`): a test of each gap on each piece of a span (`enclosure`) by
//! what its control points say (`polygon`), zeros and minima (`newton`, `parabolas`). Taylor-like
//! steps (`flight`) are for contacts and for what exact steps leave undecided. What is not affine
//! (a contact's field, a reset) keeps the general way. One text serves one orbit (`tools`) and
//! several in lanes (`lane_tools`).

mod enclosure;
mod exact_step;
mod extended;
mod flight;
mod lane_tools;
mod newton;
mod parabolas;
mod polygon;
mod surface;
mod tools;

use crate::flow::AffineExpressions;
use crate::model::{Model, NodeId, Response};

pub(super) use lane_tools::LaneTools;
pub(super) use tools::{AffineTools, LeapEnd, OrbitTables};

/// The affine expressions of a model. Numbers are places in their list.
#[derive(Clone, Debug)]
pub(super) struct AffineSystem {
    expressions: AffineExpressions,
    phase_rate: Option<usize>,
    /// Derivative of each state in free flight.
    free: Vec<usize>,
    surfaces: Vec<AffineSurface>,
}

#[derive(Clone, Debug)]
struct AffineSurface {
    event: usize,
    /// Each state after an impact, where that is affine and the phase stays.
    reset: Option<Vec<usize>>,
    contact: Option<AffineContact>,
}

/// A contact with an affine field and release function.
#[derive(Clone, Debug)]
struct AffineContact {
    derivatives: Vec<usize>,
    release: usize,
    /// The other surfaces, watched after the release.
    others: Vec<usize>,
}

impl AffineSystem {
    /// Takes a model apart; `None` unless free flight and all events are affine.
    pub(super) fn new(model: &Model) -> Option<Self> {
        let mut list = List::default();
        let states = model.states.len();
        let phase = model.phase.as_ref();
        let phase_rate = phase.map(|phase| list.push(phase.rate));
        let free = list.push_all(&model.flow[..states]);
        let surfaces: Vec<_> = (0..model.surfaces.len())
            .map(|surface| list.surface(model, surface))
            .collect();
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
        AffineSurface {
            event,
            reset,
            contact,
        }
    }
}
