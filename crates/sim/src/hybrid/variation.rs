//! First variations of a return: its derivatives by the section point and by parameters.
//!
//! One idea: between events a variation follows the linearised field of the regime. An event acts
//! on it through the time at which it happens: where `g` is zero there, `R` is the reset (the
//! identity where only the field changes), and `f⁻`, `f⁺` are the fields before and after,
//!
//! ```text
//! δt = −δg(δx, δp) / δg(f⁻, 0),     δx⁺ = δR(δx + f⁻ δt, δp) − f⁺ δt
//! ```
//!
//! (the saltation matrix). Nothing is differenced, so derivatives have the digits of the return
//! itself however small the orbit is. Parameters are components of rate zero here: one field serves
//! variations by states and by parameters.

use super::HybridError;
use super::motion::{Evaluator, Regime};
use super::return_map::DirectReturn;
use super::trajectory::{Return, ReturnOutcome, ReturnSection};
use crate::flow::{Field, InputKind, Integrator, Program};
use crate::model::{ExpressionGraph, Model, NodeId, Response};
use crate::numeric::Real;

/// A direction in which a section point and the parameters are varied, or a variation that
/// followed from one.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation<S> {
    /// Variation of the full state.
    pub state: Vec<S>,
    /// Variation of all parameters of the model.
    pub parameters: Vec<S>,
}

/// An event at a surface: a change of the state or of the field.
#[derive(Clone, Debug)]
pub(super) struct Change<S> {
    pub(super) kind: ChangeKind,
    pub(super) surface: usize,
    pub(super) time: S,
    /// The states just before and just after.
    pub(super) states: [Vec<S>; 2],
    pub(super) regimes: [Regime; 2],
}

/// Kinds of changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangeKind {
    /// A reset where the gap is zero.
    Impact,
    /// A compliant contact begins where the gap is zero.
    Begin,
    /// A compliant contact ends where its release function is zero.
    Release,
    /// A chatter is completed, a rest begins or ends: no variation is known.
    Rest,
}

/// The linearised fields and events of a model.
#[derive(Clone, Debug)]
pub(super) struct Linearisation {
    dimension: usize,
    parameters: usize,
    phase: Option<usize>,
    free: VariedField,
    surfaces: Vec<VariedSurface>,
}

/// A field with its variation, its rates alone, and their variation.
#[derive(Clone, Debug)]
struct VariedField {
    flow: Field,
    rates: Program,
    slopes: Program,
}

/// Variations of the expressions of a surface.
#[derive(Clone, Debug)]
struct VariedSurface {
    gap: Program,
    normal_velocity: Program,
    reset: Option<Program>,
    /// The contact field, and the variation of the release function.
    contact: Option<(VariedField, Program)>,
}

/// The expressions of a model and of its variations: inputs are the state, the parameters, and the
/// variations of both.
struct Lowering<'m> {
    graph: ExpressionGraph,
    model: &'m Model,
}

impl Lowering<'_> {
    fn inputs(&self) -> usize {
        self.model.dimension() + self.model.parameters.len()
    }

    /// The variation of an expression.
    fn varied(&mut self, node: NodeId) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for input in 0..self.inputs() {
            let slope = self.graph.derivative(node, input);
            let change = self.graph.input(self.inputs() + input);
            let term = self.graph.mul(slope, change);
            sum = self.graph.add(sum, term);
        }
        sum
    }

    fn program(&self, outputs: &[NodeId]) -> Program {
        Program::new(&self.graph, outputs, &vec![InputKind::Variable; 2 * self.inputs()])
    }

    fn variation(&mut self, node: NodeId) -> Program {
        let varied = self.varied(node);
        self.program(&[varied])
    }

    fn field(&mut self, rates: &[NodeId]) -> VariedField {
        let still = vec![self.graph.number(0.0); self.model.parameters.len()];
        let varied: Vec<NodeId> = rates.iter().map(|&rate| self.varied(rate)).collect();
        let all = [rates, &still, &varied, &still].concat();
        VariedField {
            flow: Field::new(&self.graph, &all, &[], &[]),
            rates: self.program(rates),
            slopes: self.program(&varied),
        }
    }
}

impl Linearisation {
    pub(super) fn new(model: &Model) -> Self {
        let mut lowering = Lowering { graph: model.graph.clone(), model };
        let free = lowering.field(&model.flow);
        let surfaces = model.surfaces.iter().map(|surface| {
            let (reset, contact) = match &surface.response {
                Response::Impact { reset } => {
                    let varied: Vec<_> = reset.iter().map(|&node| lowering.varied(node)).collect();
                    (Some(lowering.program(&varied)), None)
                }
                Response::Contact { field, release } => {
                    (None, Some((lowering.field(field), lowering.variation(*release))))
                }
            };
            VariedSurface {
                gap: lowering.variation(surface.event),
                normal_velocity: lowering.variation(surface.normal_velocity),
                reset,
                contact,
            }
        });
        let surfaces = surfaces.collect();
        Self {
            dimension: model.dimension(),
            parameters: model.parameters.len(),
            phase: model.phase.is_some().then(|| model.dimension() - 1),
            free,
            surfaces,
        }
    }

    /// The field of a regime; `None` for a rest.
    fn field(&self, regime: Regime) -> Option<&VariedField> {
        match regime {
            Regime::Free => Some(&self.free),
            Regime::Contact { surface } => Some(&self.surfaces[surface].contact.as_ref()?.0),
            Regime::Stick { .. } => None,
        }
    }
}

/// A linearisation at parameters.
struct At<'l, S> {
    of: &'l Linearisation,
    parameters: &'l [S],
}

impl<S: Real> At<'_, S> {
    fn values(&self, program: &Program, state: &[S], change: &Variation<S>) -> Vec<S> {
        let inputs = [state, self.parameters, &change.state, &change.parameters].concat();
        Evaluator::new(program, program.outputs()).evaluate(&inputs, &[]).to_vec()
    }

    fn value(&self, program: &Program, state: &[S], change: &Variation<S>) -> S {
        self.values(program, state, change)[0]
    }

    /// A change of the state alone.
    fn of_state(&self, state: Vec<S>) -> Variation<S> {
        Variation { state, parameters: vec![S::zero(); self.of.parameters] }
    }

    fn rates(&self, field: &VariedField, state: &[S]) -> Vec<S> {
        self.values(&field.rates, state, &self.of_state(vec![S::zero(); self.of.dimension]))
    }

    /// Carries variations along a field from a state for a time of either sign.
    fn carry(
        &self,
        field: &VariedField,
        state: &[S],
        duration: S,
        changes: &mut [Variation<S>],
    ) -> Option<()> {
        let start = self.of.dimension + self.of.parameters;
        let mut integrator = Integrator::new(&field.flow);
        for change in changes {
            let from = [state, self.parameters, &change.state, &change.parameters].concat();
            let end = integrator.flow(&from, &[], duration).ok()?;
            change.state.copy_from_slice(&end[start..start + self.of.dimension]);
        }
        Some(())
    }

    /// Moves variations along the field to where a function is zero, and the time that takes.
    fn meet(
        &self,
        function: &Program,
        (state, rates): (&[S], &[S]),
        changes: &mut [Variation<S>],
    ) -> Vec<S> {
        let slope = self.value(function, state, &self.of_state(rates.to_vec()));
        let delays = changes.iter_mut().map(|change| {
            let delay = -(self.value(function, state, change) / slope);
            self.delay(change, rates, delay);
            delay
        });
        delays.collect()
    }

    fn delay(&self, change: &mut Variation<S>, rates: &[S], by: S) {
        for (value, &rate) in change.state.iter_mut().zip(rates) {
            *value += rate * by;
        }
    }

    /// Takes variations through an event; `None` where none are known.
    fn pass(&self, event: &Change<S>, changes: &mut [Variation<S>]) -> Option<()> {
        let surface = &self.of.surfaces[event.surface];
        let function = match event.kind {
            ChangeKind::Impact | ChangeKind::Begin => &surface.gap,
            ChangeKind::Release => &surface.contact.as_ref()?.1,
            ChangeKind::Rest => return None,
        };
        let [before, after] = &event.states;
        let [from, to] = event.regimes.map(|regime| self.of.field(regime));
        let (from, to) = (self.rates(from?, before), self.rates(to?, after));
        let delays = self.meet(function, (before, &from), changes);
        for (change, delay) in changes.iter_mut().zip(delays) {
            if event.kind == ChangeKind::Impact {
                change.state = self.values(surface.reset.as_ref()?, before, change);
            }
            self.delay(change, &to, -delay);
        }
        Some(())
    }
}

/// Compiles variations here, once, for the numbers of the packages above.
macro_rules! compile_for {
    ($($instances:ident: $number:ty),*) => {$(
        #[cfg(not(test))]
        #[used]
        static $instances: (
            fn(
                &mut DirectReturn<'static, $number>,
                &[$number],
                &[Variation<$number>],
            ) -> Result<VariedReturn<$number>, HybridError>,
            fn(
                &mut DirectReturn<'static, $number>,
                &[$number],
                &[Variation<$number>],
            ) -> Result<Option<Vec<$number>>, HybridError>,
        ) = (DirectReturn::<$number>::varied, DirectReturn::<$number>::varied_gap);
    )*};
}

compile_for!(IN_F64: f64, IN_DOUBLE_DOUBLE: crate::numeric::Dd);

/// A return with the variations of its end, one for each direction; none where there is no return
/// or where it rests on a rigid surface.
pub type VariedReturn<S> = (Return<S>, Option<Vec<Variation<S>>>);

impl<S: Real> DirectReturn<'_, S> {
    /// The next section point with its variations in some directions along the section, the time
    /// of the return included.
    ///
    /// # Errors
    ///
    /// As [`image`](Self::image).
    #[inline(never)]
    pub fn varied(
        &mut self,
        state: &[S],
        directions: &[Variation<S>],
    ) -> Result<VariedReturn<S>, HybridError> {
        self.simulator.changes = Some(Vec::new());
        let returned = self.image(state);
        let events = self.simulator.changes.take().unwrap_or_default();
        let returned = returned?;
        if returned.outcome != ReturnOutcome::Returned {
            return Ok((returned, None));
        }
        let count = self.simulator.motion.changes;
        let changes = self.carried(state, &events[..count], directions.to_vec());
        Ok((returned, changes))
    }

    /// Variations carried from a section point, through events, to the section point at which the
    /// simulator stands.
    fn carried(
        &self,
        state: &[S],
        events: &[Change<S>],
        mut changes: Vec<Variation<S>>,
    ) -> Option<Vec<Variation<S>>> {
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let (mut state, mut time) = (state, S::zero());
        for event in events {
            let field = at.of.field(event.regimes[0])?;
            at.carry(field, state, event.time - time, &mut changes)?;
            at.pass(event, &mut changes)?;
            (state, time) = (&event.states[1], event.time);
        }
        let field = at.of.field(simulator.regime())?;
        at.carry(field, state, simulator.time() - time, &mut changes)?;
        let (end, rates) = (simulator.state(), at.rates(field, simulator.state()));
        match (self.section, at.of.phase) {
            (ReturnSection::Tangency { surface }, _) => {
                at.meet(&at.of.surfaces[surface].normal_velocity, (end, &rates), &mut changes);
            }
            (_, Some(phase)) => {
                for change in &mut changes {
                    let delay = -(change.state[phase] / rates[phase]);
                    at.delay(change, &rates, delay);
                    change.state[phase] = S::zero();
                }
            }
            _ => return None,
        }
        let mut values = changes.iter().flat_map(|change| &change.state);
        values.all(|value| value.is_finite()).then_some(changes)
    }

    /// Variations of [`first_gap`](Self::first_gap) in some directions; `None` where there is no
    /// gap.
    ///
    /// # Errors
    ///
    /// As [`first_gap`](Self::first_gap).
    #[inline(never)]
    pub fn varied_gap(
        &mut self,
        state: &[S],
        directions: &[Variation<S>],
    ) -> Result<Option<Vec<S>>, HybridError> {
        let Some((surface, _)) = self.itinerary.first() else { return Ok(None) };
        if self.first_gap(state)?.is_none() {
            return Ok(None);
        }
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let mut changes = directions.to_vec();
        let there = match self.section {
            ReturnSection::Tangency { .. } => state,
            _ => {
                if at.carry(&at.of.free, state, simulator.time(), &mut changes).is_none() {
                    return Ok(None);
                }
                simulator.state()
            }
        };
        let gap = &at.of.surfaces[surface].gap;
        Ok(Some(changes.iter().map(|change| at.value(gap, there, change)).collect()))
    }

    /// Changes a component of directions so that they lie along a tangency section, `δh' = 0`.
    pub fn onto_section(&self, state: &[S], component: usize, directions: &mut [Variation<S>]) {
        let ReturnSection::Tangency { surface } = self.section else { return };
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let function = &at.of.surfaces[surface].normal_velocity;
        let unit = (0..at.of.dimension).map(|other| match other == component {
            true => S::one(),
            false => S::zero(),
        });
        let slope = at.value(function, state, &at.of_state(unit.collect()));
        for direction in directions {
            direction.state[component] = S::zero();
            direction.state[component] = -(at.value(function, state, direction) / slope);
        }
    }

    /// Acceleration of the gap of a surface along the free flow.
    ///
    /// # Errors
    ///
    /// [`HybridError::StateLength`], [`HybridError::NotFinite`].
    pub fn normal_acceleration(&mut self, surface: usize, state: &[S]) -> Result<S, HybridError> {
        self.simulator.set_state(state)?;
        Ok(self.simulator.sense(surface).acceleration)
    }

    /// The largest rate of a component by the free field, and the largest change of one where a
    /// compliant contact of this surface begins; `None` for a rigid surface.
    pub fn change_at_contact(&self, surface: usize, state: &[S]) -> Option<[S; 2]> {
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let (contact, _) = at.of.surfaces[surface].contact.as_ref()?;
        let (free, held) = (at.rates(&at.of.free, state), at.rates(contact, state));
        let most = |values: &mut dyn Iterator<Item = S>| values.fold(S::zero(), S::max);
        let rate = most(&mut free.iter().map(|rate| rate.abs()));
        let change = most(&mut free.iter().zip(&held).map(|(&a, &b)| (a - b).abs()));
        Some([rate, change])
    }

    /// The rates of the free field at a state, and their variations in some directions.
    pub fn free_rates(&self, state: &[S], directions: &[Variation<S>]) -> (Vec<S>, Vec<Vec<S>>) {
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let field = &at.of.free;
        let slopes = directions.iter().map(|change| at.values(&field.slopes, state, change));
        (at.rates(field, state), slopes.collect())
    }
}
