//! Observables of a diagram, evaluated at states of the section.

use std::sync::Mutex;

use crate::analysis::direct_map::DirectMap;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::section_frame::{SectionFrame, Values};
use crate::expansion::{Expander, ImpactSpeed, LocalMap};
use crate::iteration::parallel::locked;
use crate::model::{NodeId, Observable, Scene};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// Evaluates an observable at states of a section.
///
/// - `h` at a state of the map on a tangency section is `−depth(x, p)`, the map's own polynomial;
///   otherwise the event function at the full state.
/// - `impact_speed` by the map is the speed at which the surface of the first passage is met, an
///   expansion in `y` to the weight of the map's contacts. By direct simulation it is the speed of
///   the first contact that is none of the hits of the grazing orbit. 0 without contact.
/// - An expression is evaluated at the full state.
#[derive(Debug)]
pub struct Observer {
    kind: Kind,
    depths: DepthEvaluation<f64>,
    tangency: bool,
    arrival: MapEvaluation<f64>,
    /// Impact speed by the map; `None` if it is not observed or contacts are not expanded.
    speed: Option<ImpactSpeed>,
    /// Frame and expression; locked because evaluation needs working memory.
    expression: Mutex<(SectionFrame<f64>, Values<f64>)>,
}

/// Axis label of an observable: `h`, `impact_speed`, or the expression as the user wrote it.
pub(super) fn label(observable: &Observable) -> &str {
    match observable {
        Observable::EventFunction => "h",
        Observable::ImpactSpeed => "impact_speed",
        Observable::Expression { text, .. } => text,
    }
}

/// Observable of the grazing orbit on its section; the impact speed is 0 there.
pub(super) fn at_graze(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    observable: &Observable,
) -> f64 {
    let node = match observable {
        Observable::ImpactSpeed => return 0.0,
        Observable::EventFunction => grazing_event(scene, orbit),
        Observable::Expression { node, .. } => *node,
    };
    let mut frame = SectionFrame::new(scene, orbit);
    let mut values = Values::new(&scene.model, &scene.model.graph, &[node]);
    let zeros = |count: usize| vec![0.0; count];
    match frame.place(&zeros(map.section.coordinates.len()), &zeros(map.parameters.len())) {
        Ok(()) => values.evaluate(frame.state(), frame.parameters()).get(0),
        Err(_) => f64::NAN,
    }
}

/// Event function of the surface that grazes.
fn grazing_event(scene: &Scene, orbit: &GrazingOrbit) -> NodeId {
    scene.model.surfaces[orbit.grazing_point().surface].event
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    EventFunction,
    ImpactSpeed,
    Expression,
}

impl Observer {
    /// Observer for a map of a scene.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Expansion`] if the impact speed is observed and cannot be expanded.
    pub fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &LocalMap,
        observe: &Observable,
    ) -> Result<Self, AnalysisError> {
        let event = grazing_event(scene, orbit);
        let (kind, node): (Kind, NodeId) = match observe {
            Observable::EventFunction => (Kind::EventFunction, event),
            Observable::ImpactSpeed => (Kind::ImpactSpeed, event),
            Observable::Expression { node, .. } => (Kind::Expression, *node),
        };
        let values = Values::new(&scene.model, &scene.model.graph, &[node]);
        let speed = match kind {
            Kind::ImpactSpeed if map.has_contacts() => {
                let expander = Expander::new(scene, orbit)?;
                Some(expander.impact_speed(0, map.orders.contact_weight)?)
            }
            _ => None,
        };
        Ok(Self {
            kind,
            depths: MapEvaluation::depths(map),
            tangency: orbit.section.kind == PoincareSectionKind::Tangency,
            arrival: MapEvaluation::arrival(map),
            speed,
            expression: Mutex::new((SectionFrame::new(scene, orbit), values)),
        })
    }

    /// Whether the observable is `−depth` of the first passage at a state of the map.
    pub fn is_depth_of_map(&self) -> bool {
        self.kind == Kind::EventFunction && self.tangency
    }

    /// Observable at a state of the map.
    pub fn by_map(&self, state: &[f64], parameters: &[f64]) -> f64 {
        match self.kind {
            Kind::EventFunction if self.is_depth_of_map() => -self.depth(state, parameters),
            Kind::ImpactSpeed => self.speed_by_map(state, parameters),
            Kind::EventFunction | Kind::Expression => self.at_full_state(state, parameters),
        }
    }

    /// Observable at a state of a direct simulation.
    pub fn by_simulation(&self, map: &DirectMap<'_>, state: &[f64], parameters: &[f64]) -> f64 {
        match self.kind {
            Kind::ImpactSpeed => map.impact_speed(state, parameters),
            Kind::EventFunction | Kind::Expression => self.at_full_state(state, parameters),
        }
    }

    fn speed_by_map(&self, state: &[f64], parameters: &[f64]) -> f64 {
        let y = self.depth(state, parameters).max(0.0).sqrt();
        let mut point = self.arrival.image(state, parameters).offsets;
        point.extend_from_slice(parameters);
        let speed = self.speed.as_ref();
        speed.map_or(f64::NAN, |speed| speed.at(y, &point))
    }

    /// Depth of the first passage after the section; `−∞` without one.
    fn depth(&self, state: &[f64], parameters: &[f64]) -> f64 {
        let depths = self.depths.at(state, parameters);
        depths.first().copied().unwrap_or(f64::NEG_INFINITY)
    }

    fn at_full_state(&self, state: &[f64], parameters: &[f64]) -> f64 {
        let mut expression = locked(&self.expression);
        let (frame, values) = &mut *expression;
        match frame.place(state, parameters) {
            Ok(()) => values.evaluate(frame.state(), frame.parameters()).get(0),
            Err(_) => f64::NAN,
        }
    }
}
