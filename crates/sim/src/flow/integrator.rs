//! Taylor's method: the integrator of every scalar, with dense output, for one solution or for
//! several side by side, one in each lane.
//!
//! Order and step follow Jorba and Zou (2005); see [`step_control`](super::step_control). In lanes
//! the coefficients of the solutions are computed in step, whatever their states, parameters and
//! times; each lane has its own step length and evaluates its polynomials at its own time. Every
//! lane has the bits of one solution alone.

use num_traits::Zero as _;

use super::FlowError;
use super::field::Field;
use super::series::Series;
use super::step_control::{log2_step, margin_for, order_for_numbers};
use crate::numeric::{Branched, Kernel, Lanes, Mask, Real, Scalar, polynomial};

/// Taylor integrator of one field over `f64`, double-double or lanes.
///
/// ```text
/// x(t + s) = Σ_{k=0}^{n} x_k s^k,   x_{k+1} = f_k / (k + 1)
/// ```
#[derive(Clone, Debug)]
pub struct Integrator<'a, S: Branched> {
    field: &'a Field,
    max_step: f64,
    /// Margin of the step per degree.
    margin: f64,
    series: Series<'a, S>,
}

/// Taylor integrator of one field for `N` solutions.
pub type LaneIntegrator<'a, const N: usize> = Integrator<'a, Lanes<N>>;

/// One Taylor step: polynomials in the time since its start, valid on `[0, length]`
/// (and, backwards, on `[-length, 0]`).
#[derive(Clone, Copy, Debug)]
pub struct Step<'s, S: Branched> {
    field: &'s Field,
    series: &'s Series<'s, S>,
    margin: f64,
    log2_length: S::Rounded,
    /// Length of the interval on which the polynomials meet the tolerance, finite; 0 where there
    /// is none, because a coefficient is not finite.
    pub length: S,
}

/// One Taylor step of each lane.
pub type LaneStep<'s, const N: usize> = Step<'s, Lanes<N>>;

/// How far solutions were carried.
#[derive(Clone, Copy, Debug)]
pub struct Carried<S: Branched> {
    /// Where a coefficient of the solution is not finite.
    pub not_finite: S::Mask,
    /// What is left of the durations.
    pub remaining: S,
}

/// Compiles flows here, once, for the numbers of the packages above: instances that are never
/// inlined are shared with dependants.
macro_rules! compile_for {
    ($($instance:ident: $number:ty),*) => {$(
        #[cfg(not(test))]
        #[used]
        static $instance: fn(
            &mut Integrator<'static, $number>,
            &[$number],
            &[$number],
            $number,
        ) -> Result<Vec<$number>, FlowError> = Integrator::flow;
    )*};
}

compile_for!(IN_F64: f64, IN_DOUBLE_DOUBLE: crate::numeric::Dd);

/// Most steps one flow may take.
const MAX_STEPS: usize = 1_000_000;

/// Longest step where nothing was asked: reached only where the solution is a polynomial in time.
const DEFAULT_MAX_STEP: f64 = 1e3;

impl<'a, S: Branched> Integrator<'a, S> {
    /// An integrator with the tolerance of the scalar's own roundoff.
    pub fn new(field: &'a Field) -> Self {
        Self::with_tolerance(field, S::ROUNDOFF)
    }

    /// An integrator with a relative local tolerance, at least the scalar's roundoff.
    pub fn with_tolerance(field: &'a Field, tolerance: f64) -> Self {
        let tolerance = tolerance.max(S::ROUNDOFF);
        let series = Series::new(field.series(), order_for_numbers::<S>(tolerance));
        Self {
            field,
            max_step: DEFAULT_MAX_STEP,
            margin: margin_for::<S>(tolerance, series.order()),
            series,
        }
    }

    /// The integrator with another longest step, a positive number.
    pub fn with_max_step(self, max_step: f64) -> Self {
        Self { max_step, ..self }
    }

    /// Order of the method.
    pub fn order(&self) -> usize {
        self.series.order()
    }

    /// Expands the solutions about states, one component after another; a step of length 0 has
    /// failed.
    ///
    /// `parameters` holds one value per parameter of the field; those of bound ones are ignored.
    pub fn expand(&mut self, state: &[S], parameters: &[S]) -> Step<'_, S> {
        self.series.expand(state, parameters);
        self.expanded()
    }

    /// The step about the states that were expanded last.
    fn expanded(&self) -> Step<'_, S> {
        let (log2_length, length) = S::dispatch(Lengths(self));
        Step {
            field: self.field,
            series: &self.series,
            margin: self.margin,
            log2_length,
            length: S::from_rounded(length),
        }
    }

    /// Carries states through durations of either sign; those that fail stay where their last step
    /// began.
    pub fn carry(&mut self, state: &mut [S], parameters: &[S], durations: S) -> Carried<S> {
        self.carry_within(state, parameters, durations, &mut { MAX_STEPS })
    }

    /// As [`carry`](Self::carry), in a number of steps, which those taken lower.
    fn carry_within(
        &mut self,
        state: &mut [S],
        parameters: &[S],
        durations: S,
        steps_left: &mut usize,
    ) -> Carried<S> {
        let zero = S::zero();
        let (mut not_finite, mut remaining) = (S::Mask::NONE, durations);
        while *steps_left > 0 {
            let going = !remaining.is_equal(zero) & !not_finite;
            if !going.any() {
                break;
            }
            *steps_left -= 1;
            let step = self.expand(state, parameters);
            let flown = going & zero.is_below(step.length);
            not_finite |= going & !flown;
            let is_last = remaining.abs().is_at_most(step.length);
            let length = S::select(is_last, remaining, step.length * remaining.signum());
            S::dispatch(Advance { step, time: length, wanted: flown, state: &mut *state });
            remaining = S::select(flown, remaining - length, remaining);
        }
        Carried { not_finite, remaining }
    }
}

impl<S: Real> Integrator<'_, S> {
    /// Expands the solution about a state.
    ///
    /// `parameters` holds one value per parameter of the field; those of bound ones are ignored.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] if a coefficient of the solution is not finite, or no step is long
    /// enough to be a number.
    pub fn step(&mut self, state: &[S], parameters: &[S]) -> Result<Step<'_, S>, FlowError> {
        self.series.expand(state, parameters);
        let step = self.expanded();
        match step.length > S::zero() {
            true => Ok(step),
            false => Err(self.not_finite()),
        }
    }

    /// The state after a duration of either sign.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] as [`step`](Self::step), [`FlowError::TooManySteps`] after a
    /// million steps.
    #[inline(never)]
    pub fn flow(
        &mut self,
        state: &[S],
        parameters: &[S],
        duration: S,
    ) -> Result<Vec<S>, FlowError> {
        self.flow_within(state, parameters, duration, &mut { MAX_STEPS })
    }

    /// The state after a duration of either sign, in a number of steps, which those taken lower.
    ///
    /// # Errors
    ///
    /// As [`flow`](Self::flow), [`FlowError::TooManySteps`] after the steps given.
    pub fn flow_within(
        &mut self,
        state: &[S],
        parameters: &[S],
        duration: S,
        steps_left: &mut usize,
    ) -> Result<Vec<S>, FlowError> {
        let (mut state, limit) = (state.to_vec(), *steps_left);
        let carried = self.carry_within(&mut state, parameters, duration, steps_left);
        if carried.not_finite {
            return Err(self.not_finite());
        }
        match carried.remaining == S::zero() {
            true => Ok(state),
            false => Err(FlowError::TooManySteps { limit, remaining: carried.remaining.to_f64() }),
        }
    }

    /// The degree of the first coefficient that is not finite; the order where all are.
    fn not_finite(&self) -> FlowError {
        let coefficients = |component| self.series.coefficients(component).iter();
        let degree = |component| coefficients(component).position(|value| !value.is_finite());
        let degree = (0..self.field.dimension()).find_map(degree);
        FlowError::NotFinite { degree: degree.unwrap_or(self.order()) }
    }
}

impl<S: Branched> Step<'_, S> {
    /// Taylor coefficients of a state component.
    pub fn state_coefficients(&self, component: usize) -> &[S] {
        self.series.coefficients(component)
    }

    /// Taylor coefficients of a watched function.
    pub fn watched_coefficients(&self, watched: usize) -> &[S] {
        self.series.coefficients(self.slot_of(watched))
    }

    /// Length on which a watched function's polynomial meets the tolerance as the states' do,
    /// infinite where it is not shorter than the step.
    pub(crate) fn watched_length(&self, watched: usize) -> S::Rounded {
        if self.field.series().is_combination(self.slot_of(watched)) {
            return S::Rounded::from_f64(f64::INFINITY);
        }
        S::dispatch(WatchedLength {
            coefficients: self.watched_coefficients(watched),
            margin: self.margin,
            longest: self.log2_length,
        })
    }

    /// A lower bound of a watched function on `[0, length]`.
    #[inline(always)]
    pub(crate) fn watched_lower_bound(&self, watched: usize, length: S::Rounded) -> S::Rounded {
        polynomial::lower_bound(self.watched_coefficients(watched), length)
    }

    /// Puts the wanted states at times since the start of the step.
    #[inline(always)]
    pub(crate) fn states_at(&self, time: S, wanted: S::Mask, state: &mut [S]) {
        for (component, value) in state.iter_mut().enumerate() {
            let there = polynomial::value(self.state_coefficients(component), time);
            *value = S::select(wanted, there, *value);
        }
    }

    /// A state component at a time since the start of the step.
    pub fn component_at(&self, component: usize, time: S) -> S {
        polynomial::value(self.state_coefficients(component), time)
    }

    fn slot_of(&self, watched: usize) -> usize {
        let output = self.field.dimension() + watched;
        self.field.time_program().output(output)
    }
}

impl<S: Real> Step<'_, S> {
    /// The state at a time since the start of the step.
    pub fn state_at(&self, time: S, state: &mut [S]) {
        self.states_at(time, true, state);
    }
}

/// The binary logarithm of the length of a step that was expanded, infinite where the solution is a
/// polynomial in time, and the length.
struct Lengths<'i, 'a, S: Branched>(&'i Integrator<'a, S>);

impl<S: Branched> Kernel for Lengths<'_, '_, S> {
    type Output = (S::Rounded, S::Rounded);

    #[inline(always)]
    fn run(self) -> (S::Rounded, S::Rounded) {
        let Integrator { field, max_step, margin, ref series } = *self.0;
        let zero = S::Rounded::zero();
        let (mut sum, mut log2_length) = (zero, S::Rounded::from_f64(f64::INFINITY));
        for component in 0..field.dimension() {
            sum += zeros(series.coefficients(component));
        }
        let is_finite = sum.is_equal(zero);
        for &component in field.series().limiting() {
            let own = log2_step(series.coefficients(component), margin);
            log2_length = log2_length.min(own);
        }
        let length = log2_length.mapped(f64::exp2);
        let length = length.min(S::Rounded::from_f64(max_step));
        (log2_length, S::Rounded::select(is_finite, length, zero))
    }
}

/// The length of [`Step::watched_length`].
struct WatchedLength<'s, S: Branched> {
    coefficients: &'s [S],
    margin: f64,
    longest: S::Rounded,
}

impl<S: Branched> Kernel for WatchedLength<'_, S> {
    type Output = S::Rounded;

    #[inline(always)]
    fn run(self) -> S::Rounded {
        let own = log2_step(self.coefficients, self.margin);
        let shorter = own.is_below(self.longest);
        let mut length = S::Rounded::from_f64(f64::INFINITY);
        if shorter.any() {
            length = S::Rounded::select(shorter, own.mapped(f64::exp2), length);
        }
        length
    }
}

/// The states at times of a step.
struct Advance<'s, S: Branched> {
    step: Step<'s, S>,
    time: S,
    wanted: S::Mask,
    state: &'s mut [S],
}

impl<S: Branched> Kernel for Advance<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.step.states_at(self.time, self.wanted, self.state);
    }
}

/// Zeros; NaN where a coefficient is not finite.
#[inline(always)]
fn zeros<S: Branched>(coefficients: &[S]) -> S::Rounded {
    let zero = S::Rounded::zero();
    let mut sums = [zero; 4];
    let (chunks, rest) = coefficients.as_chunks::<4>();
    for chunk in chunks {
        for place in 0..4 {
            sums[place] += chunk[place].rounded() * zero;
        }
    }
    for value in rest {
        sums[0] += value.rounded() * zero;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Whether all coefficients are finite.
pub(super) fn are_finite<S: Real>(coefficients: &[S]) -> bool {
    zeros(coefficients) == 0.0
}

/// Value of a polynomial, coefficients in ascending powers.
pub fn horner<S: Real>(coefficients: &[S], at: S) -> S {
    coefficients.iter().rev().fold(S::zero(), |sum, &coefficient| sum.mul_add(at, coefficient))
}

#[cfg(test)]
mod tests;
