//! Jet transport by Taylor's method: series in time whose coefficients are jets, their sums at a
//! jet-valued time, and the flow with its first derivatives as jets of order 1.
//!
//! Slow and general: for any scalar, including double-double. The step is controlled on the parts
//! of every degree of every component.
//!
//! The Taylor coefficients of a solution in time follow one power after another: `x' = f(x, p)`
//! gives `x_{k+1} = f_k / (k + 1)`, and a program gives `f_k` from `x_0 … x_k` in any algebra
//! graded by powers of time, with numbers or jets as coefficients.

use nalgebra::DMatrix;

use crate::flow::step_control::{component_step, margin_at, order_for};
use crate::flow::{Field, FlowError};
use crate::interruption::check;
use crate::jet::{Graded, Jet, JetError, JetSeries, JetSpace, power_series_at};
use crate::numeric::{Real, Scalar};

/// Largest number of steps of one flow.
pub(crate) const MAX_STEPS: usize = 100_000;

/// Jets of the state after a duration of either sign, from jets of the state and of all parameters.
///
/// All jets live in one space and may have any content; jets of bound parameters are ignored.
///
/// # Errors
///
/// [`FlowError::NotFinite`] if a coefficient is not finite, [`FlowError::TooManySteps`] after 100
/// 000 steps.
///
/// # Panics
///
/// If the jets' spaces differ.
pub fn jet_transport_taylor<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    duration: S,
) -> Result<Vec<Jet<S>>, FlowError> {
    jet_transport_taylor_within(field, initial, parameters, duration, &mut { MAX_STEPS })
}

/// Computes [`jet_transport_taylor`] in a limited number of steps, which is lowered by the steps
/// taken.
///
/// # Errors
///
/// The errors of [`jet_transport_taylor`], with [`FlowError::TooManySteps`] at the given limit.
///
/// # Panics
///
/// If the jets' spaces differ.
pub fn jet_transport_taylor_within<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    duration: S,
    steps_left: &mut usize,
) -> Result<Vec<Jet<S>>, FlowError> {
    watched_jet_transport_taylor(field, initial, parameters, duration, steps_left, &mut |_| {})
}

/// Computes [`jet_transport_taylor_within`], and tells the remaining duration after every step.
///
/// # Errors
///
/// The errors of [`jet_transport_taylor_within`].
///
/// # Panics
///
/// If the jets' spaces differ.
pub fn watched_jet_transport_taylor<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    duration: S,
    steps_left: &mut usize,
    watch: &mut dyn FnMut(S),
) -> Result<Vec<Jet<S>>, FlowError> {
    let mut state = initial.to_vec();
    let mut remaining = duration;
    if state.is_empty() {
        return Ok(state);
    }
    let algebra = JetSeries::new(state[0].space(), order_for(S::ROUNDOFF));
    let (mut expansion, limit) = (JetExpansion::new(field, algebra), *steps_left);
    while remaining != S::zero() {
        if *steps_left == 0 {
            return Err(FlowError::TooManySteps { limit, remaining: remaining.to_f64() });
        }
        *steps_left -= 1;
        check();
        expansion.expand(&state, parameters);
        let longest = S::from_f64(expansion.step_length(remaining.magnitude())?);
        let length =
            if remaining.abs() <= longest { remaining } else { longest * remaining.signum() };
        for (component, jet) in state.iter_mut().enumerate() {
            expansion.sum_at(component, length, jet.coefficients_mut());
        }
        remaining -= length;
        watch(remaining);
    }
    Ok(state)
}

/// Products of coefficients in one step of [`jet_transport_taylor`]: the measure of its cost.
pub fn products_of_jet_step<S: Real>(field: &Field, space: &JetSpace) -> f64 {
    let powers = order_for(S::ROUNDOFF) + 1;
    let of_series = (powers * (powers + 1) / 2) as f64;
    field.time_program().products().max(1) as f64 * of_series * space.products() as f64
}

/// Tape of one field over series in time of jets.
struct JetExpansion<'a, S: Real> {
    field: &'a Field,
    algebra: JetSeries,
    tape: Vec<S>,
    scratch: Vec<S>,
}

impl<'a, S: Real> JetExpansion<'a, S> {
    pub(crate) fn new(field: &'a Field, algebra: JetSeries) -> Self {
        let len = Graded::<S>::element_len(&algebra);
        Self {
            field,
            tape: vec![S::zero(); field.time_program().slots() * len],
            scratch: vec![S::zero(); algebra.space().len()],
            algebra,
        }
    }

    /// Expands the solution about a jet-valued state.
    pub(crate) fn expand(&mut self, state: &[Jet<S>], parameters: &[Jet<S>]) {
        let len = Graded::<S>::element_len(&self.algebra);
        for (input, jet) in state.iter().chain(parameters).enumerate() {
            let head = input * len..input * len + jet.coefficients().len();
            self.tape[head].copy_from_slice(jet.coefficients());
        }
        expand(self.field, &self.algebra, &mut self.tape, &mut self.scratch);
    }

    /// Coefficients of one power of time of a slot.
    pub(crate) fn coefficients(&self, slot: usize, power: usize) -> &[S] {
        let (len, part) =
            (Graded::<S>::element_len(&self.algebra), Graded::<S>::part(&self.algebra, power));
        &self.tape[slot * len + part.start..slot * len + part.end]
    }

    /// Longest step, at most `limit`, that the step control of every part of every component
    /// allows.
    fn step_length(&self, limit: f64) -> Result<f64, FlowError> {
        let order = Graded::<S>::order(&self.algebra);
        let mut step = limit;
        for component in 0..self.field.dimension() {
            for power in 0..=order {
                if self.coefficients(component, power).iter().any(|value| !value.is_finite()) {
                    return Err(FlowError::NotFinite { degree: power });
                }
            }
            for degree in 0..=self.algebra.space().order() {
                let magnitude = |power| self.magnitude(component, power, degree);
                let magnitudes: Vec<f64> = (0..=order).map(magnitude).collect();
                step = step.min(component_step(&magnitudes, margin_at(order)));
            }
        }
        for argument in self.field.series().arguments() {
            let head = |power| self.coefficients(argument.slot(), power)[0];
            let heads: Vec<S> = (0..=order).map(head).collect();
            step = argument.resolved(&heads, step);
        }
        if step > 0.0 || limit == 0.0 {
            Ok(step)
        } else {
            Err(FlowError::NotFinite { degree: order })
        }
    }

    /// Largest coefficient of a power of time among the monomials of a degree.
    fn magnitude(&self, component: usize, power: usize, degree: usize) -> f64 {
        let part = &self.coefficients(component, power)[self.algebra.space().degree_range(degree)];
        part.iter().map(|value| value.magnitude()).fold(0.0, f64::max)
    }

    /// Horner's sum of the series of a component at a time.
    fn sum_at(&self, component: usize, time: S, out: &mut [S]) {
        out.fill(S::zero());
        for power in (0..=Graded::<S>::order(&self.algebra)).rev() {
            for (value, &coefficient) in out.iter_mut().zip(self.coefficients(component, power)) {
                *value = value.mul_add(time, coefficient);
            }
        }
    }
}

/// Fills the tape of a field with the Taylor coefficients of all its slots up to the algebra's
/// order.
///
/// The heads of the inputs must be set, and the inputs of the parameters must be zero beyond their
/// heads.
pub(crate) fn expand<S: Scalar, A: Graded<S>>(
    field: &Field,
    algebra: &A,
    tape: &mut [S],
    scratch: &mut [S],
) {
    let (program, len, order) = (field.time_program(), algebra.element_len(), algebra.order());
    for degree in 0..=order {
        program.advance(algebra, degree, tape, scratch);
        if degree == order {
            return;
        }
        let (from, to) = (algebra.part(degree), algebra.part(degree + 1));
        let factor = S::one() / S::from_f64((degree + 1) as f64);
        for component in 0..field.dimension() {
            let source = program.output(component) * len + from.start;
            let target = component * len + to.start;
            for offset in 0..from.len() {
                tape[target + offset] = tape[source + offset] * factor;
            }
        }
    }
}

/// The state after a duration of either sign, and its derivatives with respect to chosen inputs.
///
/// `directions` lists inputs of the field: `0..dimension` are the initial state's components,
/// `dimension + i` is parameter `i`. The matrix has one row per state component and one column per
/// direction. Derivatives by bound parameters are zero.
///
/// # Errors
///
/// The errors of [`jet_transport_taylor`]; [`FlowError::Jet`] if the jets of the directions do not
/// fit in memory.
pub fn flow_with_jacobian<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    duration: S,
    directions: &[usize],
) -> Result<(Vec<S>, DMatrix<S>), FlowError> {
    flow_with_jacobian_within(field, state, parameters, duration, directions, &mut { MAX_STEPS })
}

/// Computes [`flow_with_jacobian`] in a limited number of Taylor steps, which is lowered by the
/// steps taken.
///
/// The derivatives may need shorter steps than the state: those of `x^n` grow as `n`.
///
/// # Errors
///
/// The errors of [`flow_with_jacobian`], with [`FlowError::TooManySteps`] at the given limit.
pub fn flow_with_jacobian_within<S: Real>(
    field: &Field,
    state: &[S],
    parameters: &[S],
    duration: S,
    directions: &[usize],
    steps_left: &mut usize,
) -> Result<(Vec<S>, DMatrix<S>), FlowError> {
    first_derivatives(state, parameters, directions, |initial, parameters| {
        jet_transport_taylor_within(field, initial, parameters, duration, steps_left)
    })
}

/// Image of a state and its derivatives by chosen inputs, from a function that carries jets.
///
/// Inputs are numbered, and derivatives laid out, as by [`flow_with_jacobian`]; `carry` takes jets
/// of the state and of all parameters.
///
/// # Errors
///
/// Those of `carry`, and of a space of jets that does not fit in memory.
pub fn first_derivatives<S: Real, E: From<JetError>>(
    state: &[S],
    parameters: &[S],
    directions: &[usize],
    carry: impl FnOnce(&[Jet<S>], &[Jet<S>]) -> Result<Vec<Jet<S>>, E>,
) -> Result<(Vec<S>, DMatrix<S>), E> {
    let space = JetSpace::uniform(directions.len(), 1)?;
    let jet = |(input, &value): (usize, &S)| match directions.iter().position(|&d| d == input) {
        Some(variable) => Jet::variable(&space, variable, value),
        None => Jet::constant(&space, value),
    };
    let inputs: Vec<_> = state.iter().chain(parameters).enumerate().map(jet).collect();
    let (initial, parameters) = inputs.split_at(state.len());
    let image = carry(initial, parameters)?;
    let slope = |row: usize, column: usize| {
        space
            .linear_monomial(column)
            .map_or(S::zero(), |monomial| image[row].coefficients()[monomial])
    };
    let matrix = DMatrix::from_fn(image.len(), directions.len(), slope);
    Ok((image.iter().map(Jet::head).collect(), matrix))
}

/// Taylor coefficients in time, as jets, of every state component and watched function.
#[derive(Clone, Debug)]
pub struct LocalSeries<S: Real> {
    states: Vec<Vec<Jet<S>>>,
    watched: Vec<Vec<Jet<S>>>,
}

impl<S: Real> LocalSeries<S> {
    /// Coefficients of a state component, by power of time.
    pub fn state(&self, component: usize) -> &[Jet<S>] {
        &self.states[component]
    }

    /// Coefficients of a watched function, by power of time.
    pub fn watched(&self, watched: usize) -> &[Jet<S>] {
        &self.watched[watched]
    }

    /// The state at a jet-valued time, with the series summed as in [`at_series_time`].
    pub fn state_at(&self, time: &Jet<S>) -> Vec<Jet<S>> {
        self.states.iter().map(|series| at_series_time(series, time)).collect()
    }
}

/// Expands the solution about a jet-valued state, up to a power of time.
///
/// `initial` holds one jet per state component, `parameters` one per parameter of the field (those
/// of bound ones are ignored), all of one space, with any content. Outside the domain of the field
/// the coefficients are not finite.
///
/// # Panics
///
/// If there is no state component, or the jets' spaces differ.
pub fn local_series<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    order: usize,
) -> LocalSeries<S> {
    let degree = initial[0].space().order();
    local_series_kept_to(field, initial, parameters, vec![degree; order + 1])
}

/// [`local_series`] whose coefficient of each power of time is computed to a degree of its own, and
/// is 0 beyond it.
///
/// A series to be summed at a time of lowest degree `l` needs its coefficients to the order minus
/// `l` times the power only: a small part of the work.
///
/// # Panics
///
/// If there is no state component, the jets' spaces differ, no power is kept, or a degree exceeds
/// that of a lower power.
pub fn local_series_kept_to<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    kept: Vec<usize>,
) -> LocalSeries<S> {
    let space = initial[0].space();
    let powers = 0..kept.len();
    let algebra = JetSeries::kept_to(space, kept);
    let mut expansion = JetExpansion::new(field, algebra.clone());
    expansion.expand(initial, parameters);
    let jets = |slot: usize| -> Vec<Jet<S>> {
        let jet = |power| {
            let coefficients = expansion.coefficients(slot, power).to_vec();
            let jet = Jet::from_coefficients(space, coefficients);
            jet.truncate(algebra.kept(power))
        };
        powers.clone().map(jet).collect()
    };
    let output = |watched| field.time_program().output(field.dimension() + watched);
    LocalSeries {
        states: (0..field.dimension()).map(&jets).collect(),
        watched: (0..field.watched()).map(|watched| jets(output(watched))).collect(),
    }
}

/// `Σ_k c_k τ^k` for a time `τ` without constant term, by Horner's rule.
///
/// Exact to the order of the space if `coefficients` reaches the power at which `τ^k` vanishes: the
/// order divided by the lowest degree of `τ`.
///
/// # Panics
///
/// If `coefficients` is empty, or the jets' spaces differ.
pub fn at_series_time<S: Real>(coefficients: &[Jet<S>], time: &Jet<S>) -> Jet<S> {
    assert!(!coefficients.is_empty(), "a series has its term of power 0");
    power_series_at(coefficients, time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::{InputKind, Integrator, samples};
    use crate::jet::JetSpace;
    use crate::numeric::Dd;

    #[test]
    fn derivatives_agree_with_differences_of_flows() {
        let field = samples::electrostatic(&[InputKind::Variable; 3]);
        let point = [0.2, 0.1, 0.3, 0.02, 0.3, 0.6].map(Dd::from);
        let duration = Dd::PI / point[5];
        let (image, matrix) =
            flow_with_jacobian(&field, &point[..3], &point[3..], duration, &[0, 1, 2, 4, 5])
                .unwrap();
        let step = Dd::from(1e-8);
        for (column, input) in [0, 1, 2, 4, 5].into_iter().enumerate() {
            let shifted = |offset: Dd| {
                let mut at = point;
                at[input] += offset;
                Integrator::new(&field).flow(&at[..3], &at[3..], duration).unwrap()
            };
            let (up, down, middle) = (shifted(step), shifted(-step), shifted(Dd::ZERO));
            for row in 0..3 {
                let difference = (up[row] - down[row]) / (step + step);
                // The difference quotient errs by step² times a third derivative.
                assert!((difference - matrix[(row, column)]).to_f64().abs() < 1e-12);
                assert!((middle[row] - image[row]).to_f64().abs() < 1e-28);
            }
        }
    }

    #[test]
    fn series_at_a_jet_time_is_the_closed_flow_of_the_square() {
        let space = JetSpace::uniform(2, 7).unwrap();
        let x = Jet::variable(&space, 0, 0.5_f64);
        let time = Jet::variable(&space, 1, 0.0);
        let series = local_series(&samples::quadratic(), std::slice::from_ref(&x), &[], 7);
        let sum = at_series_time(series.state(0), &time);
        let expected = &x / &(-&(&x * &time)).add_constant(1.0);
        for (value, exact) in sum.coefficients().iter().zip(expected.coefficients()) {
            assert!((value - exact).abs() < 1e-14 * exact.abs().max(1.0), "{value} {exact}");
        }
    }

    #[test]
    fn coefficients_kept_to_a_degree_are_those_of_the_whole_series_up_to_it() {
        let space = JetSpace::new(&[1, 2], 6).unwrap();
        let state = [Jet::variable(&space, 0, 0.7), Jet::variable(&space, 1, 0.4)];
        let whole = local_series(&samples::pendulum(), &state, &[], 6);
        let kept = |power: usize| 6 - power;
        let degrees = (0..=6).map(kept).collect();
        let series = local_series_kept_to(&samples::pendulum(), &state, &[], degrees);
        for component in 0..2 {
            for power in 0..=6 {
                let expected = whole.state(component)[power].truncate(kept(power));
                assert_eq!(series.state(component)[power], expected, "{power}");
            }
        }
    }

    #[test]
    fn watched_energy_of_the_pendulum_is_constant_as_a_jet() {
        let space = JetSpace::uniform(2, 4).unwrap();
        let state = [Jet::variable(&space, 0, 0.7_f64), Jet::variable(&space, 1, 0.4)];
        let series = local_series(&samples::pendulum(), &state, &[], 8);
        for power in 1..=8 {
            let largest =
                series.watched(0)[power].coefficients().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            assert!(largest < 1e-14, "power {power}: {largest:e}");
        }
    }
}
