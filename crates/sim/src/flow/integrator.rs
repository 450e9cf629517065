//! Taylor's method: the integrator for every scalar type, with dense output, for one solution or
//! for several, one in each lane.
//!
//! Order and step follow Jorba and Zou (2005); see [`step_control`](super::step_control). Narrow
//! features, which coefficients may not show, shorten the step; see
//! [`resolution`](super::resolution). In lanes the coefficients of the solutions are computed
//! together, for any states, parameters and times; each lane has its own step length and evaluates
//! its polynomials at its own time. Every lane has the bits of a single solution.

use num_traits::Zero as _;

use super::FlowError;
use super::corners::{Corner, cut};
use super::field::Field;
use super::series::Series;
use super::step_control::{log2_step, margin_for, order_for_numbers};
use crate::interruption::check;
use crate::numeric::{Branched, Lanes, Mask, Real, Scalar, Vectorised, polynomial};

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
    /// Length of the interval on which the polynomials meet the tolerance, finite; 0 if there is
    /// none, because a coefficient is not finite.
    pub length: S,
}

/// One Taylor step of each lane.
pub type LaneStep<'s, const N: usize> = Step<'s, Lanes<N>>;

/// Result of carrying solutions through durations.
#[derive(Clone, Copy, Debug)]
pub struct Carried<S: Branched> {
    /// Mask: a coefficient of the solution is not finite.
    pub not_finite: S::Mask,
    /// Remaining durations.
    pub remaining: S,
    /// Number of steps that ended at a corner, in any lane.
    pub corners: usize,
}

/// Compiles flows here, once, for the scalars of other packages: instances that are never inlined
/// are shared with dependants.
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

/// Largest number of steps of one flow.
const MAX_STEPS: usize = 1_000_000;

/// Share of the full step below which a step that ends at a corner does not lead away from it.
pub(crate) const SLIDES: f64 = 1e-9;

/// Largest number of steps in a row that do not lead away from a corner; with more, the solution
/// slides along it.
pub(crate) const MOST_SLIDES: usize = 100;

/// Default of the longest step; reached only if the solution is a polynomial in time.
const DEFAULT_MAX_STEP: f64 = 1e3;

impl<'a, S: Branched> Integrator<'a, S> {
    /// Integrator whose tolerance is the roundoff of the scalar.
    pub fn new(field: &'a Field) -> Self {
        Self::with_tolerance(field, S::ROUNDOFF)
    }

    /// Integrator with a relative local tolerance, at least the scalar's roundoff.
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

    /// Sets the longest step, a positive number.
    pub fn with_max_step(self, max_step: f64) -> Self {
        Self { max_step, ..self }
    }

    /// Order of the method.
    pub fn order(&self) -> usize {
        self.series.order()
    }

    /// Expands the solutions about states, given component by component. A step of length 0 has
    /// failed.
    ///
    /// `parameters` holds one value per parameter of the field; those of bound ones are ignored.
    pub fn expand(&mut self, state: &[S], parameters: &[S]) -> Step<'_, S> {
        self.series.expand(state, parameters);
        self.expanded()
    }

    /// Step about the states that were expanded last.
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

    /// Carries states through durations of either sign. States that fail stay at the start of their
    /// last step.
    pub fn carry(&mut self, state: &mut [S], parameters: &[S], durations: S) -> Carried<S> {
        self.carry_within(state, parameters, durations, &mut { MAX_STEPS })
    }

    /// Carries states like [`carry`](Self::carry), in at most `steps_left` steps; lowers that
    /// number by the steps taken.
    fn carry_within(
        &mut self,
        state: &mut [S],
        parameters: &[S],
        durations: S,
        steps_left: &mut usize,
    ) -> Carried<S> {
        let zero = S::zero();
        let (mut not_finite, mut remaining) = (S::Mask::NONE, durations);
        let (mut corners, mut slides) = (0, 0);
        while *steps_left > 0 {
            let going = !remaining.is_equal(zero) & !not_finite;
            if !going.any() {
                break;
            }
            *steps_left -= 1;
            check();
            let step = self.expand(state, parameters);
            let flown = going & zero.is_below(step.length);
            not_finite |= going & !flown;
            let is_last = remaining.abs().is_at_most(step.length);
            let whole = S::select(is_last, remaining, step.length * remaining.signum());
            let length = step.until_corner(whole);
            let is_cut = flown & !length.is_equal(whole);
            if is_cut.any() {
                let slow = is_cut & length.abs().is_at_most(step.length * S::from_f64(SLIDES));
                (corners, slides) = (corners + 1, if slow.any() { slides + 1 } else { 0 });
                if slides > MOST_SLIDES {
                    break;
                }
            }
            S::dispatch(Advance { step, time: length, wanted: flown, state: &mut *state });
            remaining = S::select(flown, remaining - length, remaining);
        }
        Carried { not_finite, remaining, corners }
    }
}

impl<S: Real> Integrator<'_, S> {
    /// Expands the solution about a state.
    ///
    /// `parameters` holds one value per parameter of the field; those of bound ones are ignored.
    ///
    /// # Errors
    ///
    /// [`FlowError::NotFinite`] if a coefficient of the solution is not finite, or if the step is
    /// too short to be a number.
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

    /// The state after a duration of either sign, in a limited number of steps, which is lowered by
    /// the steps taken.
    ///
    /// # Errors
    ///
    /// The errors of [`flow`](Self::flow), with [`FlowError::TooManySteps`] at the given limit.
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

    /// Error with the degree of the first coefficient that is not finite; the order if all are
    /// finite.
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

    /// Length on which a watched function's polynomial meets the tolerance of the states; infinite
    /// if it is not shorter than the step.
    pub fn watched_length(&self, watched: usize) -> S::Rounded {
        if self.field.series().is_combination(self.slot_of(watched)) {
            return S::Rounded::from_f64(f64::INFINITY);
        }
        S::dispatch(WatchedLength {
            coefficients: self.watched_coefficients(watched),
            margin: self.margin,
            longest: self.log2_length,
        })
    }

    /// Lower bound of a watched function on `[0, length]`.
    #[inline(always)]
    pub(crate) fn watched_lower_bound(&self, watched: usize, length: S::Rounded) -> S::Rounded {
        polynomial::lower_bound(self.watched_coefficients(watched), length)
    }

    /// Sets the wanted states to their values at times since the start of the step.
    #[inline(always)]
    pub(crate) fn states_at(&self, time: S, wanted: S::Mask, state: &mut [S]) {
        for (component, value) in state.iter_mut().enumerate() {
            let there = polynomial::value(self.state_coefficients(component), time);
            *value = S::select(wanted, there, *value);
        }
    }

    /// A length of either sign, cut just behind the first corner of the field on the way.
    pub(crate) fn until_corner(&self, length: S) -> S {
        let corners = self.field.series().corners();
        cut(corners, |slot| self.series.coefficients(slot), length)
    }

    /// A state component at a time since the start of the step.
    pub fn component_at(&self, component: usize, time: S) -> S {
        polynomial::value(self.state_coefficients(component), time)
    }

    /// A length, shortened until every argument of a function that may have a narrow feature stays
    /// within its room: the length on which the features are resolved, independent of the step.
    pub(super) fn resolved(&self, length: S::Rounded) -> S::Rounded {
        self.field.series().arguments().iter().fold(length, |length, argument| {
            argument.resolved(self.series.coefficients(argument.slot()), length)
        })
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

/// Binary logarithm of the length of an expanded step, infinite if the solution is a polynomial in
/// time; and the length.
struct Lengths<'i, 'a, S: Branched>(&'i Integrator<'a, S>);

impl<S: Branched> Vectorised for Lengths<'_, '_, S> {
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
        // NOTE: near a corner the solution may be a polynomial, and then only the corner's zero
        // decides where the step ends.
        for slot in field.series().corners().iter().flat_map(Corner::slots) {
            log2_length = log2_length.min(log2_step(series.coefficients(slot), margin));
        }
        let length = log2_length.mapped(f64::exp2);
        let mut length = length.min(S::Rounded::from_f64(max_step));
        for argument in field.series().arguments() {
            length = argument.resolved(series.coefficients(argument.slot()), length);
        }
        (log2_length, S::Rounded::select(is_finite, length, zero))
    }
}

/// Vectorised work of [`Step::watched_length`].
struct WatchedLength<'s, S: Branched> {
    coefficients: &'s [S],
    margin: f64,
    longest: S::Rounded,
}

impl<S: Branched> Vectorised for WatchedLength<'_, S> {
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

/// Vectorised work: moves states to times of a step.
struct Advance<'s, S: Branched> {
    step: Step<'s, S>,
    time: S,
    wanted: S::Mask,
    state: &'s mut [S],
}

impl<S: Branched> Vectorised for Advance<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.step.states_at(self.time, self.wanted, self.state);
    }
}

/// Zero; NaN if a coefficient is not finite.
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

/// Value of a polynomial with coefficients in ascending powers.
pub fn horner<S: Real>(coefficients: &[S], at: S) -> S {
    coefficients.iter().rev().fold(S::zero(), |sum, &coefficient| sum.mul_add(at, coefficient))
}

#[cfg(test)]
mod tests {
    //! Taylor's method against closed forms and conserved quantities.

    use super::*;
    use crate::flow::{InputKind, samples};
    use crate::numeric::Dd;

    /// Undamped linear oscillator off resonance: `x = A cos ωt + B cos t + C sin t`.
    fn linear_error<S: Real>(periods: f64) -> f64 {
        let field = samples::linear(&[InputKind::HeadOnly; 3]);
        let (omega, amplitude) = (S::from_f64(1.5), S::from_f64(0.7));
        let state = [S::from_f64(0.3), S::from_f64(-0.2), S::zero()];
        let duration = S::from_dd(Dd::TWO_PI) * S::from_f64(periods) / omega;
        let end =
            Integrator::new(&field).flow(&state, &[S::zero(), amplitude, omega], duration).unwrap();
        let forced = amplitude / (S::one() - omega * omega);
        let (sine, cosine) = duration.sin_cos();
        let (b, c) = (state[0] - forced, state[1]);
        let expected = [forced + b * cosine + c * sine, c * cosine - b * sine];
        (0..2).map(|i| (end[i] - expected[i]).magnitude()).fold(0.0, f64::max)
    }

    #[test]
    fn linear_oscillator_returns_to_roundoff_after_one_period() {
        assert!(linear_error::<f64>(1.0) < 4e-15, "{:e}", linear_error::<f64>(1.0));
        assert!(linear_error::<Dd>(1.0) < 1e-30, "{:e}", linear_error::<Dd>(1.0));
    }

    #[test]
    fn backward_time_is_as_accurate() {
        assert!(linear_error::<f64>(-1.0) < 4e-15);
        assert!(linear_error::<Dd>(-1.0) < 1e-30);
    }

    /// Relative error of `x = 1/(1 − t)` at `t = 1 − 2^{−10}`.
    fn pole_error<S: Real>() -> f64 {
        let field = samples::quadratic();
        let end = Integrator::new(&field)
            .flow(&[S::one()], &[], S::from_f64(1.0 - 1.0 / 1024.0))
            .unwrap();
        (end[0] / S::from_f64(1024.0) - S::one()).magnitude()
    }

    #[test]
    fn solution_of_the_square_is_followed_to_its_pole() {
        // The flow multiplies relative errors by 1024; about fifty steps of an ulp each.
        assert!(pole_error::<f64>() < 50.0 * 1024.0 * 1.2e-16, "{:e}", pole_error::<f64>());
        assert!(pole_error::<Dd>() < 100.0 * 1024.0 * 2e-32, "{:e}", pole_error::<Dd>());
    }

    /// Change of the pendulum's energy during a time.
    fn energy_change<S: Real>(duration: f64) -> f64 {
        let field = samples::pendulum();
        let mut integrator = Integrator::new(&field);
        let start = [S::from_f64(2.5), S::from_f64(0.3)];
        let before = integrator.step(&start, &[]).unwrap().watched_coefficients(0)[0];
        let end = integrator.flow(&start, &[], S::from_f64(duration)).unwrap();
        let after = integrator.step(&end, &[]).unwrap().watched_coefficients(0)[0];
        (after - before).magnitude()
    }

    #[test]
    fn pendulum_keeps_its_energy() {
        assert!(energy_change::<f64>(100.0) < 3e-14, "{:e}", energy_change::<f64>(100.0));
        assert!(energy_change::<Dd>(100.0) < 1e-29, "{:e}", energy_change::<Dd>(100.0));
    }

    /// Distance from the start after one revolution of eccentricity one half.
    fn kepler_error<S: Real>() -> f64 {
        let start = [S::from_f64(0.5), S::zero(), S::zero(), S::from_f64(3.0).sqrt()];
        let end =
            Integrator::new(&samples::kepler()).flow(&start, &[], S::from_dd(Dd::TWO_PI)).unwrap();
        (0..4).map(|i| (end[i] - start[i]).magnitude()).fold(0.0, f64::max)
    }

    #[test]
    fn kepler_orbit_closes() {
        assert!(kepler_error::<f64>() < 1e-13, "{:e}", kepler_error::<f64>());
        assert!(kepler_error::<Dd>() < 1e-28, "{:e}", kepler_error::<Dd>());
    }

    #[test]
    fn polynomial_solutions_take_the_longest_step() {
        let field = samples::linear(&[InputKind::HeadOnly; 3]);
        let mut integrator = Integrator::new(&field).with_max_step(7.0);
        let step = integrator.step(&[0.0, 0.0, 1.0], &[0.1, 0.0, 2.0]).unwrap();
        assert_eq!(step.length, 7.0);
        assert_eq!(integrator.flow(&[0.0; 3], &[0.1, 0.0, 2.0], 30.0).unwrap(), [0.0, 0.0, 60.0]);
    }

    #[test]
    fn a_large_phase_does_not_change_the_step() {
        let field = samples::linear(&[InputKind::HeadOnly; 3]);
        let mut integrator = Integrator::new(&field);
        let mut length =
            |theta: f64| integrator.step(&[0.3, 0.1, theta], &[0.1, 2.0, 2.0]).unwrap().length;
        assert!((length(1e6 * std::f64::consts::TAU) / length(0.0) - 1.0).abs() < 0.01);
    }

    #[test]
    fn leaving_the_domain_is_an_error() {
        let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
        let result = Integrator::new(&field).flow(&[1.0, 0.0, 0.5], &[0.02, 0.3, 0.6], 1.0);
        assert!(matches!(result, Err(FlowError::NotFinite { .. })), "{result:?}");
        let blow_up = Integrator::new(&samples::quadratic()).flow(&[1.0], &[], 2.0);
        assert!(blow_up.is_err(), "{blow_up:?}");
    }

    #[test]
    fn bound_parameters_give_the_same_orbit() {
        let values = [0.05, 0.7, 1.5];
        let bound = values.map(|value| InputKind::Bound(Dd::from(value)));
        let (given, folded) = (samples::linear(&[InputKind::HeadOnly; 3]), samples::linear(&bound));
        let state = [0.3, -0.2, 0.1];
        let end = Integrator::new(&given).flow(&state, &values, 3.0).unwrap();
        let other = Integrator::new(&folded).flow(&state, &[0.0; 3], 3.0).unwrap();
        assert!(end.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-14), "{end:?} {other:?}");
    }

    const STARTS: [[f64; 3]; 8] = [
        [0.3, 0.1, 0.4],
        [0.0, 0.0, 0.0],
        [-0.2, 0.05, 1.3],
        [0.1, -0.3, 2.9],
        [0.25, 0.0, -0.7],
        [0.05, 0.2, 0.1],
        [0.31, -0.1, 0.9],
        [0.2, 0.2, -2.0],
    ];

    /// Parameters, state and duration of a lane.
    fn lane(lane: usize) -> ([f64; 3], [f64; 3], f64) {
        let shift = lane as f64 / 64.0;
        let duration = [5.0, -3.0, 0.0, 1e-3, 4.0, 9.0, 2.0, 7.0][lane];
        ([0.02 + shift, 0.2 - shift, 0.6 + shift], STARTS[lane], duration)
    }

    fn in_lanes(value: impl Fn(usize, usize) -> f64) -> [Lanes<8>; 3] {
        std::array::from_fn(|input| Lanes::from_fn(|lane| value(lane, input)))
    }

    #[test]
    fn every_lane_has_the_bits_of_the_integrator_alone() {
        let kinds = [InputKind::HeadOnly; 3];
        for field in [samples::electrostatic(&kinds), samples::linear(&kinds)] {
            let parameters = in_lanes(|at, input| lane(at).0[input]);
            let mut state = in_lanes(|at, input| lane(at).1[input]);
            let durations = Lanes::from_fn(|at| lane(at).2);
            let carried = LaneIntegrator::new(&field).carry(&mut state, &parameters, durations);
            assert_eq!(carried.remaining, Lanes::splat(0.0));
            for at in 0..8 {
                let (parameters, start, duration) = lane(at);
                let alone = Integrator::new(&field).flow(&start, &parameters, duration);
                let found: Vec<_> = state.iter().map(|value| value[at].to_bits()).collect();
                let expected: Vec<_> = alone.unwrap().iter().map(|v| v.to_bits()).collect();
                assert_eq!(found, expected, "lane {at}");
            }
        }
    }

    #[test]
    fn functions_of_states_have_the_bits_of_the_integrator_too() {
        let field = samples::pendulum();
        let mut lanes = LaneIntegrator::<4>::new(&field);
        let state = [Lanes([0.7, -2.0, 0.0, 3.1]), Lanes([0.4, 0.0, 0.0, -1.0])];
        let step = lanes.expand(&state, &[]);
        let mut alone = Integrator::new(&field);
        for lane in 0..4 {
            let single = alone.step(&state.map(|value| value[lane]), &[]).unwrap();
            assert_eq!(step.length[lane], single.length, "lane {lane}");
            let energy = step.watched_coefficients(0).iter().map(|c| c[lane].to_bits());
            let expected = single.watched_coefficients(0).iter().map(|c| c.to_bits());
            assert!(energy.eq(expected), "lane {lane}");
        }
    }

    #[test]
    fn a_lane_that_leaves_the_domain_fails_alone() {
        let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
        let mut state = [Lanes([0.3, 1.0]), Lanes([0.1, 0.0]), Lanes([0.4, 0.5])];
        let parameters = [0.02, 0.3, 0.6].map(Lanes::splat);
        let duration = Lanes::splat(1.0);
        let carried = LaneIntegrator::new(&field).carry(&mut state, &parameters, duration);
        assert_eq!(carried.remaining[0], 0.0);
        assert!(!carried.not_finite.holds(0) && carried.not_finite.holds(1));
        let alone = Integrator::new(&field).flow(&[0.3, 0.1, 0.4], &[0.02, 0.3, 0.6], 1.0);
        assert_eq!(alone.unwrap()[0], state[0][0]);
    }
}
