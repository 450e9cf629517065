//! Jet transport by collocation in time, order by order in the jets' degree.
//!
//! One idea: Taylor's method multiplies jets thousands of times. Here the Gauss nodes of an element
//! are lanes, the field's program runs once over them per degree, and one small matrix solves for
//! every coefficient. See docs/mathematics/flow.md.
//!
//! The element of one transport is kept for the next one of the same thread: preparing an element
//! costs as much as computing jets of low order, and new memory from the system costs as much as a
//! quarter of those of order 6.

use std::cell::RefCell;
use std::sync::Arc;

use super::element::Element;
use super::gauss::{GAUSS, NODES, NodeValues, ZERO};
use super::plan::{CacheKey, Inputs};
use super::solver::Resolution;
use crate::flow::integrator::are_finite;
use crate::flow::{Field, FlowError, Integrator};
use crate::interruption::check;
use crate::jet::{Jet, JetSpace};

/// Jets of a flow over a time, with an estimate of their error.
#[derive(Clone, Debug)]
pub struct JetFlow {
    /// Jets of the state at the end.
    pub image: Vec<Jet<f64>>,
    /// Number of elements.
    pub elements: usize,
    /// Estimated error, relative to the largest coefficient of the same degree; roundoff is not
    /// included.
    pub error_estimate: f64,
}

/// Largest number of elements of one transport.
const MAX_ELEMENTS: usize = 10_000;

/// Tolerance of a guess on the step of its series.
const GUESS: f64 = 1e-6;

/// Expected number of Taylor steps in the first element: for jets of high order, and the number
/// added for jets of first order.
const STEPS_PER_ELEMENT: [f64; 2] = [3.0, 3.0];

/// Jets of the state after a duration of either sign, from jets of the state and of all parameters.
///
/// All jets live in one space and may have any content; jets of bound parameters are ignored. The
/// duration is cut into elements of 16 Gauss nodes until the estimated error of every element is
/// below `tolerance`, relative to the largest coefficient of the same degree.
///
/// # Errors
///
/// [`FlowError::NotFinite`] if a coefficient is not finite, [`FlowError::TooManySteps`] if 10 000
/// elements do not suffice.
///
/// # Panics
///
/// If the jets' spaces differ.
pub fn jet_transport(
    field: &Field,
    initial: &[Jet<f64>],
    parameters: &[Jet<f64>],
    duration: f64,
    tolerance: f64,
) -> Result<JetFlow, FlowError> {
    let Some(first) = initial.first() else {
        return Ok(JetFlow { image: Vec::new(), elements: 0, error_estimate: 0.0 });
    };
    let mut transport = Transport::new(field, first, initial, parameters, tolerance);
    let result = transport.run(duration);
    let flow = result.map(|()| transport.flow(first.space()));
    give_back(transport.element);
    flow
}

/// State of a transport.
struct Transport<'a> {
    integrator: Integrator<'a, f64>,
    element: Box<Element>,
    parameters: Vec<f64>,
    tolerance: f64,
    /// Coefficients of every component at the present time, one jet after another.
    jets: Vec<f64>,
    /// Coefficients of every component at the end of the element.
    image: Vec<f64>,
    stride: usize,
    /// Heads of the jets, then values of the nominal orbit at the nodes.
    state: Vec<f64>,
    nodes: Vec<NodeValues>,
    /// Number of Taylor steps that the next element may span.
    steps: f64,
    elements: usize,
    error: f64,
}

impl<'a> Transport<'a> {
    fn new(
        field: &'a Field,
        first: &Jet<f64>,
        initial: &[Jet<f64>],
        parameters: &[Jet<f64>],
        tolerance: f64,
    ) -> Self {
        let inputs = initial.iter().chain(parameters).map(Jet::coefficients);
        let inputs = Inputs::new(first.space(), inputs);
        let mut element = spare_element(field, first.space(), inputs);
        let constants: Vec<_> = parameters.iter().map(Jet::coefficients).collect();
        element.set_parameters(&constants);
        let [least, more] = STEPS_PER_ELEMENT;
        let order = element.key.factors(first.space().order());
        let mut jets = Vec::with_capacity(initial.len() * first.space().len());
        for jet in initial {
            jets.extend_from_slice(jet.coefficients());
        }
        Self {
            integrator: Integrator::with_tolerance(field, GUESS),
            element,
            parameters: parameters.iter().map(Jet::head).collect(),
            tolerance: tolerance.max(f64::EPSILON),
            image: jets.clone(),
            jets,
            stride: first.space().len(),
            state: vec![0.0; initial.len()],
            nodes: vec![ZERO; initial.len()],
            steps: least + more / order.max(1) as f64,
            elements: 0,
            error: 0.0,
        }
    }

    fn run(&mut self, duration: f64) -> Result<(), FlowError> {
        let mut remaining = duration;
        for _ in 0..MAX_ELEMENTS {
            if remaining == 0.0 {
                return Ok(());
            }
            check();
            let Attempt { length, steps, resolution } = self.attempt(remaining)?;
            match resolution {
                Some(resolution) if resolution.meets(self.tolerance) => {
                    remaining = if length == remaining { 0.0 } else { remaining - length };
                    std::mem::swap(&mut self.jets, &mut self.image);
                    self.elements += 1;
                    self.error += resolution.error;
                    self.steps = steps * self.room(resolution).min(2.0);
                }
                rejected => {
                    let factor = rejected.map_or(0.5, |r| (0.9 * self.room(r)).clamp(0.5, 0.8));
                    self.steps = steps * factor;
                }
            }
        }
        Err(FlowError::TooManySteps { limit: MAX_ELEMENTS, remaining })
    }

    fn flow(&self, space: &Arc<JetSpace>) -> JetFlow {
        let jet = |coefficients: &[f64]| Jet::from_coefficients(space, coefficients.to_vec());
        JetFlow {
            image: self.jets.chunks_exact(self.stride).map(jet).collect(),
            elements: self.elements,
            error_estimate: self.error,
        }
    }

    /// Factor by which the length may change to just meet the tolerance: the error grows as the
    /// power 32 of the length.
    fn room(&self, resolution: Resolution) -> f64 {
        (self.tolerance / resolution.error.max(f64::MIN_POSITIVE)).powf(1.0 / 32.0)
    }

    /// Computes one element, as long as allowed; the last two are of equal length.
    fn attempt(&mut self, remaining: f64) -> Result<Attempt, FlowError> {
        let heads = self.jets.iter().step_by(self.stride);
        self.state.iter_mut().zip(heads).for_each(|(value, &head)| *value = head);
        let most = self.steps;
        let length = |step: f64| {
            let least = remaining.abs() / (most * step);
            if least > 2.0 {
                (most * step).copysign(remaining)
            } else {
                remaining / least.ceil().max(1.0)
            }
        };
        let Guess { length, steps } = guess_orbit(
            &mut self.integrator,
            &self.state,
            &self.parameters,
            length,
            &mut self.nodes,
        )?;
        let resolution = self.element.transport(
            &mut self.nodes,
            length,
            self.tolerance,
            &self.jets,
            &mut self.image,
        );
        if resolution.is_some() && !are_finite(&self.image) {
            return Err(FlowError::NotFinite { degree: 0 });
        }
        Ok(Attempt { length, steps, resolution })
    }
}

/// Result of an element that may be too long.
struct Attempt {
    length: f64,
    /// Length in Taylor steps at the start of the element.
    steps: f64,
    /// Error estimate; `None` if the equations are singular.
    resolution: Option<Resolution>,
}

/// Largest number of values on a tape that is kept: 32 MB.
const LONGEST: usize = 1 << 18;

thread_local! {
    static SPARE: RefCell<Option<Box<Element>>> = const { RefCell::new(None) };
}

/// An element for a field and inputs; its memory may come from an earlier one.
fn spare_element(field: &Field, space: &Arc<JetSpace>, inputs: Inputs) -> Box<Element> {
    match SPARE.take() {
        Some(element) if element.key.is(field, space, &inputs) => element,
        other => Box::new(Element::new(CacheKey::new(field, space, inputs), other)),
    }
}

/// Keeps an element for the next transport of this thread.
fn give_back(element: Box<Element>) {
    if element.remainders.tape_len() <= LONGEST {
        SPARE.replace(Some(element));
    }
}

/// Largest number of Taylor steps in one guess.
const MAX_STEPS: usize = 1000;

/// Factor by which an expansion is used beyond its own step: a few digits remain there, and
/// Newton's method adds the others.
const STRETCH: f64 = 3.0;

/// Largest length of an element in units of the length on which features are resolved, anywhere in
/// the element: its nodes are then less than half a unit apart.
const RESOLVED_LENGTHS: f64 = 4.0;

/// Factor by which an expansion is used beyond that length, so as not to pass the feature itself.
const RESOLVED_STRETCH: f64 = 2.0;

/// Element of a guess.
pub(super) struct Guess {
    /// Length, of the requested sign.
    pub(super) length: f64,
    /// Length in Taylor steps at the start of the element.
    pub(super) steps: f64,
}

/// Fills the nodes of an element with a guess of the orbit from a state, accurate to a few digits.
///
/// The element's length, of either sign, is chosen from the length of the first Taylor step. The
/// element ends before a feature that is narrow relative to it.
pub(super) fn guess_orbit(
    integrator: &mut Integrator<'_, f64>,
    state: &[f64],
    parameters: &[f64],
    length: impl FnOnce(f64) -> f64,
    nodes: &mut [NodeValues],
) -> Result<Guess, FlowError> {
    let start = state;
    let mut state = start.to_vec();
    let mut step = integrator.step(&state, parameters)?;
    let first = step.length;
    let mut length = length(first);
    nodes.fill(ZERO);
    let (mut time, mut next) = (0.0, 0);
    for _ in 0..MAX_STEPS {
        let resolved = step.resolved(length.abs());
        if RESOLVED_LENGTHS * resolved < length.abs() {
            length = if next == 0 && time == 0.0 {
                (RESOLVED_LENGTHS * resolved).copysign(length)
            } else {
                time
            };
            (time, next) = (0.0, 0);
            state.copy_from_slice(start);
            step = integrator.step(&state, parameters)?;
            continue;
        }
        let remaining = length - time;
        let reach = (STRETCH * step.length).min(RESOLVED_STRETCH * resolved);
        let reach = reach.min(remaining.abs());
        while next < NODES && (GAUSS.nodes[next] * length - time).abs() <= reach {
            for (component, values) in nodes.iter_mut().enumerate() {
                values.0[next] = step.component_at(component, GAUSS.nodes[next] * length - time);
            }
            next += 1;
        }
        if next == NODES {
            return Ok(Guess { length, steps: length.abs() / first });
        }
        let advance = reach.copysign(length);
        step.state_at(advance, &mut state);
        time += advance;
        step = integrator.step(&state, parameters)?;
    }
    Err(FlowError::TooManySteps { limit: MAX_STEPS, remaining: length - time })
}
