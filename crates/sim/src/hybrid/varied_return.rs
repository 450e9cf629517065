//! A return with its first variations: its derivatives with respect to the section point and to
//! parameters.

use super::HybridError;
use super::return_map::DirectReturn;
use super::trajectory::{Return, ReturnOutcome, ReturnSection};
use super::variation::{At, Change, Variation};
use crate::numeric::Real;

/// Compiles variations here, once, for the scalars of other packages.
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

/// A return with the variations of its end, one for each direction; `None` if there is no return,
/// or if it rests on a rigid surface.
pub type VariedReturn<S> = (Return<S>, Option<Vec<Variation<S>>>);

impl<S: Real> DirectReturn<'_, S> {
    /// The next section point with its variations in some directions along the section, including
    /// the change of the return time.
    ///
    /// # Errors
    ///
    /// The errors of [`image`](Self::image).
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
            let way = [state, &event.states[0]];
            at.fly(event.regimes[0], way, event.time - time, &mut changes)?;
            at.pass(event, &mut changes)?;
            (state, time) = (&event.states[1], event.time);
        }
        let end = simulator.state();
        at.fly(simulator.regime(), [state, end], simulator.time() - time, &mut changes)?;
        let rates = at.rates(at.of.field(simulator.regime())?, end);
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

    /// Variations of [`first_gap`](Self::first_gap) in some directions; `None` if there is no gap.
    ///
    /// # Errors
    ///
    /// The errors of [`first_gap`](Self::first_gap).
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

    /// Changes one component of directions so that they lie along a tangency section, `δh' = 0`.
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

    /// Largest rate of a component in the free field, and largest change of a rate at the beginning
    /// of a compliant contact with this surface; `None` for a rigid surface.
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

    /// Rates of the free field at a state, and their variations in some directions.
    pub fn free_rates(&self, state: &[S], directions: &[Variation<S>]) -> (Vec<S>, Vec<Vec<S>>) {
        let simulator = &self.simulator;
        let at = At { of: simulator.system.linearisation(), parameters: &simulator.parameters };
        let field = &at.of.free;
        let slopes = directions.iter().map(|change| at.values(&field.slopes, state, change));
        (at.rates(field, state), slopes.collect())
    }
}
