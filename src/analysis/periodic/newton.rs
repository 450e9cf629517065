//! Newton's method for a periodic orbit.

use nalgebra::{DMatrix, DVector};

use super::derivative::linearise;
use super::orbit::PeriodicOrbit;
use super::problem::{Guess, Held, PeriodicOutcome, PeriodicProblem};
use super::section_map::SectionMap;
use crate::iteration::PassageSet;
use crate::numeric::linear::solve;
use crate::numeric::{NewtonOutcome, NumericError, Real, damped_newton};

/// Newton steps made at most.
const STEPS: usize = 60;
/// Halvings of a step that leads nowhere nearer.
const HALVINGS: usize = 19;

/// The periodic orbit of a map near a guess, one variable held.
///
/// Newton's method for `Pⁿ(x, p) = x` with all variables but the held one unknown. A step is halved
/// while the orbit of its end has no image, or no derivative, loses the contacts asked for where
/// the start had them, or misses the first point by more. Steps below `ε^(3/4)` of the scales end
/// it: the method squares them.
///
/// # Panics
///
/// If the guess, the scales or the itinerary have not the lengths of the map and the problem.
pub fn periodic_orbit<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    held: Held,
    guess: &Guess<S>,
) -> PeriodicOutcome<S> {
    assert_eq!(
        problem.scales.len(),
        guess.state.len() + guess.parameters.len(),
        "lengths of the guess and the scales"
    );
    let mut search = Search { map, problem };
    let Some(period) = search.period(guess) else {
        return PeriodicOutcome::NoImage { steps: 0 };
    };
    let mut last_step = f64::INFINITY;
    let outcome = damped_newton(
        period,
        [STEPS, HALVINGS],
        |period: &Period<S>| {
            let step = period.newton_step(problem, held)?;
            let length = problem.length(&step);
            Ok((step, length))
        },
        |period, (step, length), share| search.nearer(period, step, *length, share),
        |_, &(_, length)| {
            // At the resolution of the numbers steps no longer shrink.
            let rounding = length >= last_step && length <= S::ROUNDOFF.sqrt();
            last_step = length;
            length <= S::ROUNDOFF.powf(0.75) || rounding
        },
    );
    match outcome {
        NewtonOutcome::Root(period) => period.outcome(problem),
        NewtonOutcome::NotNearer {
            step: (_, last_step),
            ..
        } => PeriodicOutcome::NotConverged { last_step },
        NewtonOutcome::StepLimit(_) => PeriodicOutcome::NotConverged { last_step },
        NewtonOutcome::NoStep { reason, steps, .. } => match reason {
            NumericError::Singular { .. } => PeriodicOutcome::Singular { steps },
            _ => PeriodicOutcome::NoImage { steps },
        },
    }
}

impl PeriodicProblem {
    /// Largest component of a step, in the scales; the last one is that of the free parameter.
    fn length<S: Real>(&self, step: &DVector<S>) -> f64 {
        let dimension = step.len() - 1;
        let scale = |number: usize| match number {
            number if number < dimension => self.scales[number],
            _ => self.scales[dimension + self.free],
        };
        let components = step.iter().enumerate();
        let components = components.map(|(number, value)| value.magnitude() / scale(number));
        components.fold(0.0, |max, value| if value <= max { max } else { value })
    }
}

/// A map and what is looked for in it.
struct Search<'a, M: ?Sized> {
    map: &'a mut M,
    problem: &'a PeriodicProblem,
}

impl<M: ?Sized> Search<'_, M> {
    /// The points from a guess on, with the derivatives of the last image by the first point and
    /// the parameter.
    fn period<S: Real>(&mut self, guess: &Guess<S>) -> Option<Period<S>>
    where
        M: SectionMap<S>,
    {
        let dimension = guess.state.len();
        let (mut state, mut states) = (guess.state.clone(), Vec::new());
        let mut itinerary = Vec::new();
        let mut extra_contacts = 0;
        let mut by_state = DMatrix::identity(dimension, dimension);
        let mut by_parameter = DVector::from_element(dimension, S::zero());
        for _ in 0..self.problem.returns {
            let (free, scales) = (self.problem.free, &self.problem.scales);
            let here = linearise(&mut *self.map, &state, &guess.parameters, free, scales)?;
            by_state = &here.by_state * by_state;
            by_parameter = &here.by_state * by_parameter + here.by_parameter;
            itinerary.push(here.step.contacts);
            extra_contacts += here.step.extra_contacts;
            states.push(std::mem::replace(&mut state, here.step.offsets));
        }
        Some(Period {
            states,
            image: state,
            parameters: guess.parameters.clone(),
            itinerary,
            extra_contacts,
            by_state,
            by_parameter,
        })
    }

    /// The period a share of a step away, unless it does not exist, loses the contacts asked for or
    /// misses its start by more.
    fn nearer<S: Real>(
        &mut self,
        from: &Period<S>,
        step: &DVector<S>,
        length: f64,
        share: f64,
    ) -> Option<Period<S>>
    where
        M: SectionMap<S>,
    {
        let next = self.period(&from.moved(step, S::from_f64(share), self.problem.free))?;
        let asked = self.problem.itinerary.as_ref();
        let keeps = asked.is_some_and(|asked| *asked == from.itinerary);
        // Residuals of steps this short are rounding.
        let nearer = length <= S::ROUNDOFF.sqrt()
            || next.residual(self.problem) < from.residual(self.problem);
        ((!keeps || next.itinerary == from.itinerary) && nearer).then_some(next)
    }
}

/// One period from a point on that need not be periodic.
struct Period<S> {
    states: Vec<Vec<S>>,
    image: Vec<S>,
    parameters: Vec<S>,
    itinerary: Vec<PassageSet>,
    extra_contacts: usize,
    by_state: DMatrix<S>,
    by_parameter: DVector<S>,
}

impl<S: Real> Period<S> {
    /// The step of all coordinates and, last, of the free parameter.
    fn newton_step(
        &self,
        problem: &PeriodicProblem,
        held: Held,
    ) -> Result<DVector<S>, NumericError> {
        let dimension = self.image.len();
        let size = dimension + 1;
        let mut matrix = DMatrix::from_element(size, size, S::zero());
        let mut right = DVector::from_element(size, S::zero());
        for row in 0..dimension {
            for column in 0..dimension {
                matrix[(row, column)] = self.by_state[(row, column)];
            }
            matrix[(row, row)] -= S::one();
            matrix[(row, dimension)] = self.by_parameter[row];
            right[row] = self.states[0][row] - self.image[row];
        }
        let kept = match held {
            Held::Parameter => dimension,
            Held::Coordinate(coordinate) => coordinate,
        };
        matrix[(dimension, kept)] = S::one();
        // Columns in units of the scales: pivots are then compared like with like.
        let scale = |column: usize| match column {
            column if column < dimension => S::from_f64(problem.scales[column]),
            _ => S::from_f64(problem.scales[dimension + problem.free]),
        };
        for column in 0..size {
            for row in 0..size {
                matrix[(row, column)] *= scale(column);
            }
        }
        let mut step = solve(&matrix, &right)?;
        for (number, value) in step.iter_mut().enumerate() {
            *value *= scale(number);
        }
        Ok(step)
    }

    fn moved(&self, step: &DVector<S>, share: S, free: usize) -> Guess<S> {
        let (mut state, mut parameters) = (self.states[0].clone(), self.parameters.clone());
        let dimension = state.len();
        for (value, &change) in state.iter_mut().zip(step.iter()) {
            *value += share * change;
        }
        parameters[free] += share * step[dimension];
        Guess { state, parameters }
    }

    /// Largest difference of a coordinate of the last image and the first point, in the scales.
    fn residual(&self, problem: &PeriodicProblem) -> f64 {
        let gaps = self.image.iter().zip(&self.states[0]).zip(&problem.scales);
        let gaps = gaps.map(|((&image, &first), scale)| (image - first).magnitude() / scale);
        gaps.fold(0.0, f64::max)
    }

    fn outcome(self, problem: &PeriodicProblem) -> PeriodicOutcome<S> {
        let residual = self.residual(problem);
        let asked = problem.itinerary.as_ref();
        let same = asked.is_none_or(|asked| *asked == self.itinerary);
        let orbit = PeriodicOrbit {
            states: self.states,
            parameters: self.parameters,
            itinerary: self.itinerary,
            extra_contacts: self.extra_contacts,
            jacobian: self.by_state,
            residual,
        };
        if same {
            PeriodicOutcome::Found(orbit)
        } else {
            PeriodicOutcome::OtherItinerary(orbit)
        }
    }
}
