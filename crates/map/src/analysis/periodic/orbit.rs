//! Periodic orbits: problem, multipliers, and solution by Newton's method.

use nalgebra::{Complex, DMatrix, DVector};

use super::section_map::{SectionMap, linearise};
use crate::expansion::MapWindow;
use crate::iteration::PassageSet;
use crate::numeric::linear::{determinant, eigenvalues, solve};
use crate::numeric::{NewtonOutcome, NumericError, Real, damped_newton};

/// Specification of a periodic orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicProblem {
    /// Returns of the map in one period of the orbit.
    pub returns: usize,
    /// Index of the parameter that may vary, among the active ones.
    pub free: usize,
    /// Passages that make contact, return by return; `None` accepts any contacts.
    pub itinerary: Option<Vec<PassageSet>>,
    /// Length scales of the map: of the coordinates, then of the active parameters.
    pub scales: Vec<f64>,
}

/// Variable that is held fixed while the others are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// The free parameter: finds the orbit at that parameter.
    Parameter,
    /// A coordinate of the first point: finds the parameter at which the orbit has that coordinate.
    Coordinate(usize),
}

/// Start of a search: the first point of an orbit and all active parameters, in offsets.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess<S> {
    /// One offset per coordinate.
    pub state: Vec<S>,
    /// One offset per active parameter.
    pub parameters: Vec<S>,
}

/// Outcome of a search.
#[derive(Clone, Debug, PartialEq)]
pub enum PeriodicOutcome<S> {
    /// An orbit with the itinerary asked for.
    Found(PeriodicOrbit<S>),
    /// An orbit with other contacts: the one asked for does not exist there.
    OtherItinerary(PeriodicOrbit<S>),
    /// An iterate of the search has no image or no derivative.
    NoImage {
        /// Newton steps taken.
        steps: usize,
    },
    /// The equations are singular: a fold, if the parameter is held.
    Singular {
        /// Newton steps taken.
        steps: usize,
    },
    /// No step came nearer, or the steps did not shrink.
    NotConverged {
        /// Length of the last step, in the scales.
        last_step: f64,
    },
}

impl<S> PeriodicOutcome<S> {
    /// The orbit, if it is the one asked for.
    pub fn found(self) -> Option<PeriodicOrbit<S>> {
        match self {
            Self::Found(orbit) => Some(orbit),
            _ => None,
        }
    }
}

/// Length scales of a map: half-widths of its window, 1 if unbounded.
pub fn window_scales(window: &MapWindow) -> Vec<f64> {
    let widths = window.state.iter().chain(&window.parameter);
    widths.map(|&width| finite_or_one(width)).collect()
}

/// Half-width of a window; 1 if unbounded.
pub(in crate::analysis) fn finite_or_one(width: f64) -> f64 {
    if width.is_finite() { width } else { 1.0 }
}

/// A periodic orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicOrbit<S> {
    /// Points in order, in offsets.
    pub states: Vec<Vec<S>>,
    /// All active parameters, in offsets.
    pub parameters: Vec<S>,
    /// Passages that made contact, return by return.
    pub itinerary: Vec<PassageSet>,
    /// Contacts of the period beyond one per passage, or at other surfaces; an orbit that makes any
    /// is not an orbit of the local map.
    pub extra_contacts: usize,
    /// Whole periods of the phase beyond the nominal ones of the returns.
    pub turns: i32,
    /// Jacobian of the map of the period at the first point.
    pub jacobian: DMatrix<S>,
    /// Largest difference of a coordinate between the image of the last point and the first point,
    /// in the scales.
    pub residual: f64,
}

impl<S: Real> PeriodicOrbit<S> {
    /// Characteristic multipliers, largest magnitude first.
    ///
    /// # Errors
    ///
    /// As [`eigenvalues`].
    pub fn multipliers(&self) -> Result<Vec<Complex<f64>>, NumericError> {
        eigenvalues(&self.jacobian)
    }

    /// Whether all multipliers are inside the unit circle.
    ///
    /// # Errors
    ///
    /// As [`eigenvalues`].
    pub fn is_stable(&self) -> Result<bool, NumericError> {
        let multipliers = self.multipliers()?;
        Ok(multipliers.iter().all(|multiplier| multiplier.norm() < 1.0))
    }

    /// Trace of the Jacobian.
    pub fn trace(&self) -> S {
        self.jacobian.trace()
    }

    /// Determinant of the Jacobian.
    ///
    /// # Errors
    ///
    /// As [`determinant`].
    pub fn determinant(&self) -> Result<S, NumericError> {
        determinant(&self.jacobian)
    }

    /// `det(J − s I)`, zero if `s` is a multiplier.
    ///
    /// # Errors
    ///
    /// As [`determinant`].
    pub fn characteristic(&self, multiplier: f64) -> Result<S, NumericError> {
        let mut shifted = self.jacobian.clone();
        for place in 0..shifted.nrows() {
            shifted[(place, place)] -= S::from_f64(multiplier);
        }
        determinant(&shifted)
    }

    /// Start for the search of a neighbouring orbit: this orbit.
    pub fn guess(&self) -> Guess<S> {
        Guess { state: self.states[0].clone(), parameters: self.parameters.clone() }
    }
}

/// Most Newton steps.
const STEPS: usize = 60;
/// Most halvings of a step that does not reduce the residual.
const HALVINGS: usize = 19;

/// Periodic orbit of a map near a guess, with one variable held.
///
/// Newton's method for `Pⁿ(x, p) = x` with all variables unknown except the held one. A step is
/// halved if the orbit at its end has no image or no derivative, loses contacts asked for that it
/// had before, or closes less well. Iteration ends at a step below `ε^(3/4)` of the scales, because
/// the next step would be of the size of its square.
///
/// # Panics
///
/// If the lengths of guess, scales or itinerary do not fit the map and the problem.
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
    let Some(period) = Period::of(map, problem, guess) else {
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
        // Accepts a share of a step if the period exists there, keeps the contacts asked for, and
        // closes better.
        |from, (step, length), share| {
            let next = from.moved(step, S::from_f64(share), problem.free);
            let next = Period::of(map, problem, &next)?;
            let keeps = problem.itinerary.as_ref().is_some_and(|asked| *asked == from.itinerary);
            // Residuals of steps this short are rounding.
            let nearer =
                *length <= S::ROUNDOFF.sqrt() || next.residual(problem) < from.residual(problem);
            ((!keeps || next.itinerary == from.itinerary) && nearer).then_some(next)
        },
        |_, &(_, length)| {
            // At the resolution of the number type steps no longer shrink.
            let rounding = length >= last_step && length <= S::ROUNDOFF.sqrt();
            last_step = length;
            length <= S::ROUNDOFF.powf(0.75) || rounding
        },
    );
    match outcome {
        NewtonOutcome::Root(period) => period.outcome(problem),
        NewtonOutcome::NotNearer { step: (_, last_step), .. } => {
            PeriodicOutcome::NotConverged { last_step }
        }
        NewtonOutcome::StepLimit(_) => PeriodicOutcome::NotConverged { last_step },
        NewtonOutcome::NoStep { reason, steps, .. } => match reason {
            NumericError::Singular { .. } => PeriodicOutcome::Singular { steps },
            _ => PeriodicOutcome::NoImage { steps },
        },
    }
}

impl PeriodicProblem {
    /// Scale of a variable: a coordinate, or after all coordinates the free parameter.
    fn scale(&self, number: usize, dimension: usize) -> f64 {
        self.scales[if number < dimension { number } else { dimension + self.free }]
    }

    /// Largest component of a step, in the scales; the last one is the free parameter.
    fn length<S: Real>(&self, step: &DVector<S>) -> f64 {
        let components = step.iter().enumerate();
        let components = components
            .map(|(number, value)| value.magnitude() / self.scale(number, step.len() - 1));
        components.fold(0.0, |max, value| if value <= max { max } else { value })
    }
}

/// One period of the map from a point that need not be periodic.
struct Period<S> {
    states: Vec<Vec<S>>,
    image: Vec<S>,
    parameters: Vec<S>,
    itinerary: Vec<PassageSet>,
    extra_contacts: usize,
    turns: i32,
    by_state: DMatrix<S>,
    by_parameter: DVector<S>,
}

impl<S: Real> Period<S> {
    /// Points of a period from a guess, with derivatives of the last image by the first point and
    /// by the parameter.
    fn of(
        map: &mut (impl SectionMap<S> + ?Sized),
        problem: &PeriodicProblem,
        guess: &Guess<S>,
    ) -> Option<Self> {
        let dimension = guess.state.len();
        let (mut state, mut states) = (guess.state.clone(), Vec::new());
        let mut itinerary = Vec::new();
        let mut extra_contacts = 0;
        let mut by_state = DMatrix::identity(dimension, dimension);
        let mut by_parameter = DVector::from_element(dimension, S::zero());
        for _ in 0..problem.returns {
            let (free, scales) = (problem.free, &problem.scales);
            let here = linearise(&mut *map, &state, &guess.parameters, free, scales)?;
            by_state = &here.by_state * by_state;
            by_parameter = &here.by_state * by_parameter + here.by_parameter;
            itinerary.push(here.step.contacts);
            extra_contacts += here.step.extra_contacts;
            states.push(std::mem::replace(&mut state, here.step.offsets));
        }
        // Points whose phases differ by a period are the same.
        let turns = map.circle().bring_near(&mut state, &guess.state);
        Some(Self {
            states,
            image: state,
            parameters: guess.parameters.clone(),
            itinerary,
            extra_contacts,
            turns,
            by_state,
            by_parameter,
        })
    }

    /// Newton step of all coordinates and, last, of the free parameter.
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
        // Columns in units of the scales, so that pivots are comparable.
        let scale = |column| S::from_f64(problem.scale(column, dimension));
        for column in 0..size {
            matrix.column_mut(column).iter_mut().for_each(|entry| *entry *= scale(column));
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

    /// Largest difference of a coordinate between the last image and the first point, in the
    /// scales.
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
            turns: self.turns,
            jacobian: self.by_state,
            residual,
        };
        if same { PeriodicOutcome::Found(orbit) } else { PeriodicOutcome::OtherItinerary(orbit) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::section_map::SectionStep;
    use super::*;
    use crate::numeric::Dd;

    /// One-dimensional square-root map: `x ↦ p + x/2` without contact, `x ↦ p − k √x` with contact,
    /// `k = 3/10`.
    struct SquareRoot;

    const KICK: f64 = 0.3;

    impl<S: Real> SectionMap<S> for SquareRoot {
        fn image(&mut self, state: &[S], parameters: &[S]) -> Option<SectionStep<S>> {
            let (x, p) = (state[0], parameters[0]);
            let contact = x > S::zero();
            let image = match contact {
                true => p - S::from_f64(KICK) * x.sqrt(),
                false => p + S::from_f64(0.5) * x,
            };
            Some(SectionStep {
                offsets: vec![image],
                contacts: contact.then_some(0).into_iter().collect(),
                depth: x.max(S::zero()),
                extra_contacts: 0,
            })
        }
    }

    fn problem(contact: bool) -> PeriodicProblem {
        let made: PassageSet = contact.then_some(0).into_iter().collect();
        PeriodicProblem { returns: 1, free: 0, itinerary: Some(vec![made]), scales: vec![1.0, 1.0] }
    }

    fn guess<S: Real>(state: f64, parameter: f64) -> Guess<S> {
        Guess { state: vec![S::from_f64(state)], parameters: vec![S::from_f64(parameter)] }
    }

    /// The orbit with contact satisfies `x + k √x = p` and has the multiplier `−k/(2√x)`.
    #[test]
    fn the_orbit_of_the_square_root_map_is_where_algebra_has_it() {
        let x = 0.04;
        let held = Held::Coordinate(0);
        let found = periodic_orbit(&mut SquareRoot, &problem(true), held, &guess(x, 0.0));
        let orbit: PeriodicOrbit<f64> = found.found().expect("an orbit");
        assert!((orbit.parameters[0] - (x + KICK * x.sqrt())).abs() < 1e-13, "{orbit:?}");
        let multiplier = orbit.multipliers().expect("a number")[0].re;
        // In double precision derivatives have twelve digits.
        assert!((multiplier + KICK / (2.0 * x.sqrt())).abs() < 1e-10, "{multiplier}");
    }

    #[test]
    fn an_orbit_of_other_contacts_is_not_the_one_asked_for() {
        // Without contact x = 2p, which is beyond the stop for p > 0.
        let held = Held::Parameter;
        let found = periodic_orbit(&mut SquareRoot, &problem(false), held, &guess(0.3, 0.2));
        let PeriodicOutcome::<f64>::OtherItinerary(orbit) = &found else {
            panic!("{found:?}");
        };
        assert!(orbit.states[0][0] > 0.0, "{found:?}");
        let found = periodic_orbit(&mut SquareRoot, &problem(false), held, &guess(-0.1, -0.2));
        let orbit: PeriodicOrbit<f64> = found.found().expect("x = 2p");
        assert!((orbit.states[0][0] + 0.4).abs() < 1e-14 && orbit.is_stable() == Ok(true));
    }

    #[test]
    fn a_fixed_point_of_no_map_is_not_found() {
        /// `x ↦ x + 1 + p²`: never fixed.
        struct Shift;
        impl SectionMap<f64> for Shift {
            fn image(&mut self, state: &[f64], parameters: &[f64]) -> Option<SectionStep<f64>> {
                Some(SectionStep {
                    offsets: vec![state[0] + 1.0 + parameters[0].powi(2)],
                    contacts: PassageSet::default(),
                    depth: 0.0,
                    extra_contacts: 0,
                })
            }
        }
        let found = periodic_orbit(&mut Shift, &problem(false), Held::Parameter, &guess(0.0, 0.5));
        let parted = |outcome: &PeriodicOutcome<f64>| {
            matches!(
                outcome,
                PeriodicOutcome::Singular { .. } | PeriodicOutcome::NotConverged { .. }
            )
        };
        assert!(parted(&found), "{found:?}");
        let held = Held::Coordinate(0);
        let found = periodic_orbit(&mut Shift, &problem(false), held, &guess(0.0, 0.5));
        assert!(parted(&found), "{found:?}");
    }

    #[test]
    fn a_small_multiplier_has_the_digits_of_a_jacobian_in_double_double() {
        let entries = [Dd::ONE, Dd::ONE, Dd::ONE, Dd::new(1.0, 1e-20)];
        let orbit = PeriodicOrbit {
            states: vec![vec![Dd::ZERO; 2]],
            parameters: Vec::new(),
            itinerary: vec![PassageSet::default()],
            extra_contacts: 0,
            turns: 0,
            jacobian: DMatrix::from_row_slice(2, 2, &entries),
            residual: 0.0,
        };
        let multipliers = orbit.multipliers().expect("finite entries");
        // The determinant is 1e-20 and the trace 2.
        assert!((multipliers[1].re - 0.5e-20).abs() < 1e-35, "{multipliers:?}");
    }
}
