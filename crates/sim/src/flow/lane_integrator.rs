//! Taylor's method for several solutions side by side, one in each lane.
//!
//! One idea: the coefficients of the solutions are computed in step, whatever their states,
//! parameters and times; each lane has its own step length and evaluates its polynomials at its own
//! time. Every lane has the bits of [`Integrator`](super::Integrator) alone.

use super::FlowError;
use super::field::Field;
use super::integrator::{DEFAULT_MAX_STEP, MAX_STEPS};
use super::series::Series;
use super::step_control::{log2_steps, margin_for, order_for_numbers};
use crate::numeric::{Branched, Kernel, LaneMask, Lanes, Scalar, polynomial, widest};

/// Taylor integrator of one field for `N` solutions.
#[derive(Clone, Debug)]
pub struct LaneIntegrator<'a, const N: usize> {
    field: &'a Field,
    margin: f64,
    series: Series<'a, Lanes<N>>,
}

/// One Taylor step of each lane: polynomials in the time since its start.
#[derive(Clone, Copy, Debug)]
pub struct LaneStep<'s, const N: usize> {
    field: &'s Field,
    series: &'s Series<'s, Lanes<N>>,
    margin: f64,
    log2_lengths: Lanes<N>,
    /// Lengths of the intervals on which the polynomials meet the tolerance; zero where a lane's
    /// solution has none, because a coefficient is not finite.
    pub lengths: Lanes<N>,
}

impl<'a, const N: usize> LaneIntegrator<'a, N> {
    /// An integrator with the tolerance of roundoff.
    pub fn new(field: &'a Field) -> Self {
        let tolerance = <f64 as Scalar>::ROUNDOFF;
        let series = Series::new(field.series(), order_for_numbers::<f64>(tolerance));
        Self {
            field,
            margin: margin_for::<f64>(tolerance, series.order()),
            series,
        }
    }

    /// Expands the solutions about their states, one component after another, with one value per
    /// parameter of the field.
    pub fn step(&mut self, state: &[Lanes<N>], parameters: &[Lanes<N>]) -> LaneStep<'_, N> {
        self.series.expand(state, parameters);
        let (log2_lengths, lengths) = widest(Lengths {
            series: &self.series,
            field: self.field,
            margin: self.margin,
        });
        LaneStep {
            field: self.field,
            series: &self.series,
            margin: self.margin,
            log2_lengths,
            lengths,
        }
    }

    /// Carries the states through durations of either sign; a lane that fails stays where its last
    /// step began.
    ///
    /// # Errors
    ///
    /// Per lane, as [`Integrator::flow`](super::Integrator::flow).
    pub fn flow(
        &mut self,
        state: &mut [Lanes<N>],
        parameters: &[Lanes<N>],
        durations: Lanes<N>,
    ) -> [Result<(), FlowError>; N] {
        let degree = self.series.order();
        let mut results = std::array::from_fn(|_| Ok(()));
        let mut remaining = durations;
        for _ in 0..MAX_STEPS {
            if remaining == Lanes::splat(0.0) {
                return results;
            }
            let step = self.step(state, parameters);
            let mut lengths = Lanes::splat(0.0);
            for lane in 0..N {
                let (length, left) = (step.lengths[lane], remaining[lane]);
                if length == 0.0 && left != 0.0 {
                    results[lane] = Err(FlowError::NotFinite { degree });
                    remaining[lane] = 0.0;
                } else {
                    lengths[lane] = length.min(left.abs()).copysign(left);
                    remaining[lane] = left - lengths[lane];
                }
            }
            step.advance(lengths, state);
        }
        for (lane, result) in results.iter_mut().enumerate() {
            if remaining[lane] != 0.0 {
                *result = Err(FlowError::TooManySteps {
                    limit: MAX_STEPS,
                    remaining: remaining[lane],
                });
            }
        }
        results
    }
}

impl<const N: usize> LaneStep<'_, N> {
    /// Taylor coefficients of a state component.
    pub fn state_coefficients(&self, component: usize) -> &[Lanes<N>] {
        self.series.coefficients(component)
    }

    /// Taylor coefficients of a watched function.
    pub fn watched_coefficients(&self, watched: usize) -> &[Lanes<N>] {
        self.series.coefficients(self.slot_of(watched))
    }

    /// Lengths on which a watched function's polynomials meet the tolerance as the states' do,
    /// infinite where they are not shorter than the steps.
    pub(crate) fn watched_lengths(&self, watched: usize) -> Lanes<N> {
        if self.field.series().is_combination(self.slot_of(watched)) {
            return Lanes::splat(f64::INFINITY);
        }
        widest(WatchedLengths {
            step: self,
            watched,
        })
    }

    /// Lower bounds of a watched function on `[0, length]`.
    #[inline(always)]
    pub(crate) fn watched_lower_bounds(&self, watched: usize, lengths: Lanes<N>) -> Lanes<N> {
        polynomial::lower_bound(self.watched_coefficients(watched), lengths)
    }

    /// Puts the states of the wanted lanes at times since the start of the step.
    #[inline(always)]
    pub(crate) fn states_at(&self, times: Lanes<N>, wanted: LaneMask<N>, states: &mut [Lanes<N>]) {
        for (component, state) in states.iter_mut().enumerate() {
            let there = polynomial::value(self.state_coefficients(component), times);
            *state = Lanes::select(wanted, there, *state);
        }
    }

    fn slot_of(&self, watched: usize) -> usize {
        let output = self.field.dimension() + watched;
        self.field.time_program().output(output)
    }

    /// Takes each lane's state at its time since the start of the step; lanes at time zero keep
    /// theirs.
    pub fn advance(&self, times: Lanes<N>, state: &mut [Lanes<N>]) {
        widest(Advance {
            step: self,
            times,
            state,
        });
    }
}

/// The binary logarithms of the lengths of the steps of all lanes, and the lengths.
struct Lengths<'s, const N: usize> {
    series: &'s Series<'s, Lanes<N>>,
    field: &'s Field,
    margin: f64,
}

impl<const N: usize> Kernel for Lengths<'_, N> {
    type Output = (Lanes<N>, Lanes<N>);

    #[inline(always)]
    fn run(self) -> (Lanes<N>, Lanes<N>) {
        let mut log2_lengths = Lanes::splat(f64::INFINITY);
        let mut zeros = Lanes::splat(0.0);
        for component in 0..self.field.dimension() {
            for &coefficient in self.series.coefficients(component) {
                zeros += coefficient * Lanes::splat(0.0);
            }
        }
        for &component in self.field.series().limiting() {
            let coefficients = self.series.coefficients(component);
            log2_lengths = log2_lengths.zip_map(log2_steps(coefficients, self.margin), f64::min);
        }
        let lengths = log2_lengths.zip_map(zeros, |log2_length, zero| {
            if zero == 0.0 {
                log2_length.exp2().min(DEFAULT_MAX_STEP)
            } else {
                0.0
            }
        });
        (log2_lengths, lengths)
    }
}

/// The lengths of [`LaneStep::watched_lengths`].
struct WatchedLengths<'s, const N: usize> {
    step: &'s LaneStep<'s, N>,
    watched: usize,
}

impl<const N: usize> Kernel for WatchedLengths<'_, N> {
    type Output = Lanes<N>;

    #[inline(always)]
    fn run(self) -> Lanes<N> {
        let coefficients = self.step.watched_coefficients(self.watched);
        let lengths = log2_steps(coefficients, self.step.margin);
        lengths.zip_map(self.step.log2_lengths, |own, states| {
            if own < states {
                own.exp2()
            } else {
                f64::INFINITY
            }
        })
    }
}

/// The states at the ends of the steps.
struct Advance<'s, const N: usize> {
    step: &'s LaneStep<'s, N>,
    times: Lanes<N>,
    state: &'s mut [Lanes<N>],
}

impl<const N: usize> Kernel for Advance<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (component, value) in self.state.iter_mut().enumerate() {
            let at_end = polynomial::value(self.step.state_coefficients(component), self.times);
            for lane in 0..N {
                if self.times[lane] != 0.0 {
                    value[lane] = at_end[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::{InputKind, Integrator, samples};

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
        (
            [0.02 + shift, 0.2 - shift, 0.6 + shift],
            STARTS[lane],
            duration,
        )
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
            let results = LaneIntegrator::new(&field).flow(&mut state, &parameters, durations);
            for (at, result) in results.iter().enumerate() {
                let (parameters, start, duration) = lane(at);
                let alone = Integrator::new(&field).flow(&start, &parameters, duration);
                assert!(result.is_ok());
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
        let step = lanes.step(&state, &[]);
        let mut alone = Integrator::new(&field);
        for lane in 0..4 {
            let single = alone.step(&state.map(|value| value[lane]), &[]).unwrap();
            assert_eq!(step.lengths[lane], single.length, "lane {lane}");
            let energy = step
                .watched_coefficients(0)
                .iter()
                .map(|c| c[lane].to_bits());
            let expected = single.watched_coefficients(0).iter().map(|c| c.to_bits());
            assert!(energy.eq(expected), "lane {lane}");
        }
    }

    #[test]
    fn a_lane_that_leaves_the_domain_fails_alone() {
        let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
        let mut state = [Lanes([0.3, 1.0]), Lanes([0.1, 0.0]), Lanes([0.4, 0.5])];
        let parameters = [0.02, 0.3, 0.6].map(Lanes::splat);
        let results = LaneIntegrator::new(&field).flow(&mut state, &parameters, Lanes::splat(1.0));
        assert!(results[0].is_ok());
        assert!(matches!(results[1], Err(FlowError::NotFinite { .. })));
        let alone = Integrator::new(&field).flow(&[0.3, 0.1, 0.4], &[0.02, 0.3, 0.6], 1.0);
        assert_eq!(alone.unwrap()[0], state[0][0]);
    }
}
