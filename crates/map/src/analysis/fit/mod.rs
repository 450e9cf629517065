//! Least-squares fits of parameters to measured section points.
//!
//! One idea: a series of measured points is cut into pieces of a few returns, each with its own
//! unknown start, so that the growth of errors along an orbit does not hide the effect of the
//! parameters. The start of a piece is eliminated by a QR decomposition of the piece, and the
//! reduced pieces form a problem in the parameters alone: the work grows linearly with the pieces.
//!
//! Images and derivatives are those of guarded iteration: exact derivatives of the map inside its
//! window, direct simulation outside. Steps are those of Levenberg and Marquardt, with the damping
//! of `Nielsen1999`. If the noise is not stated, its size in every coordinate is estimated from the
//! residuals, repeatedly until it settles (feasible generalised least squares).
//!
//! Derivatives cannot tell that a start lies on the wrong side of its graze. Starts near the
//! measurement, on both sides, are therefore tried before each descent. A fit that ends in a false
//! minimum all the same is begun again at the parameters that pieces of one return give: their
//! contacts are told by the measured points alone.
//!
//! Orbits are assumed to be deterministic; all noise is measurement noise.

mod problem;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::direct_map::{DirectMap, GuardedMap};
use super::error::{AnalysisError, check_contacts};
use super::progress::Progress;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{DifferentiableMap, HornerMap};
use crate::model::{Method, Scene};
use crate::orbit::GrazingOrbit;
use problem::Problem;

/// Request of [`fit()`].
#[derive(Clone, Debug, PartialEq)]
pub struct FitRequest {
    /// Indices of the fitted parameters among the active ones.
    pub parameters: Vec<usize>,
    /// Offsets of all active parameters; fitted ones start there.
    pub at: Vec<f64>,
    /// Measured series.
    pub series: Vec<MeasuredSeries>,
    /// Standard deviation of the measurement in every coordinate; `None`: estimated from the
    /// residuals.
    pub noise: Option<Vec<f64>>,
    /// Returns of a piece, which has its own start; 0: each series is one piece.
    pub piece: usize,
    /// Points at the end of every series that are predicted, not fitted.
    pub withheld: usize,
    /// Method that computes images.
    pub method: Method,
}

impl FitRequest {
    /// Default number of returns of a piece.
    pub const PIECE: usize = 10;
}

/// Section points of one orbit, one per return.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSeries {
    /// Known changes of the parameters during the measurement: offsets of all active parameters.
    pub controls: Vec<f64>,
    /// Offsets of the coordinates, one row per point; NaN for a coordinate that was not measured.
    pub points: Vec<Vec<f64>>,
}

/// End of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FitEnd {
    /// A minimum of the sum of squares was found.
    Converged,
    /// The sum of squares is more than five standard deviations above the value expected from the
    /// stated noise: starts on the wrong side of their graze, more noise, or data of another model.
    Misfit,
    /// No step lowers the sum of squares, but there is no smooth minimum: the orbits graze there.
    Stalled,
    /// The largest number of steps was reached.
    Steps,
    /// The data do not determine all parameters.
    Undetermined,
    /// An orbit from the data has no image at the initial parameters.
    NoImage,
    /// An orbit has an image without derivatives.
    NoDerivative,
}

impl FitEnd {
    /// Warning for the user; `None` for a fit that converged.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Self::Converged => None,
            Self::Misfit => Some(
                "the sum of squares is larger than the noise makes it: a false minimum with \
                 contacts that are not those of the data (begin nearer, `at`), more noise than \
                 stated, or another model; standard errors do not hold",
            ),
            Self::Stalled => Some(
                "no step lowers the sum of squares: orbits graze there, and standard errors do \
                 not hold",
            ),
            Self::Steps => Some("the least squares have not converged"),
            Self::Undetermined => Some("the data do not determine the parameters"),
            Self::NoImage => Some(
                "an orbit from the data has no image at the parameters that the fit begins with; \
                 begin nearer (`at`) or guard the map (`using` guarded)",
            ),
            Self::NoDerivative => Some("an orbit has an image without derivatives"),
        }
    }
}

/// A fitted parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// Name of the parameter.
    pub parameter: String,
    /// Offset from the grazing value.
    pub offset: f64,
    /// Value of the parameter.
    pub value: f64,
    /// Standard error; NaN if the data do not determine the parameter.
    pub standard_error: f64,
}

/// Quality of the prediction of points that were not fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithheldPoints {
    /// Number of points.
    pub points: usize,
    /// Root mean square of prediction minus measurement, over the noise, by coordinate: about 1 for
    /// correct predictions.
    pub error_over_noise: Vec<f64>,
}

/// Result of [`fit()`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Fitted parameters, in the order of the request.
    pub parameters: Vec<FittedParameter>,
    /// Covariance of the parameters, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the measurement in every coordinate.
    pub noise: Vec<f64>,
    /// Whether the noise was stated; otherwise it was estimated.
    pub noise_is_known: bool,
    /// Sum of the squares of the residuals over the noise.
    pub sum_of_squares: f64,
    /// Degrees of freedom: measured numbers minus unknowns, the expected sum of squares.
    pub freedom: usize,
    /// Number of measured numbers that were fitted.
    pub measured: usize,
    /// Number of pieces, each with its own start.
    pub pieces: usize,
    /// Number of steps of the least squares.
    pub steps: usize,
    /// End of the least squares.
    pub end: FitEnd,
    /// Fraction of the images computed by the map; the others are direct simulation.
    pub by_map: f64,
    /// Fraction of the returns that start outside the window.
    pub outside: f64,
    /// Predicted points; `None` if none were withheld.
    pub withheld: Option<WithheldPoints>,
}

/// Most least-squares steps of one round.
const STEPS: usize = 100;
/// Most estimates of the size of the noise.
const ROUNDS: usize = 20;
/// Most times that starts on both sides of their graze are tried.
const SIDES: usize = 20;
/// Relative change of the size of the noise below which it has settled.
const SETTLED: f64 = 1e-3;
/// Convergence of the least squares: step relative to the unknowns, or change of the sum of squares
/// relative to itself.
const CONVERGED: f64 = 1e-12;
/// Standard deviations above its mean from which on a sum of squares is a misfit.
const MISFIT: f64 = 5.0;
/// Damping at which the descent is given up: no step lowers the sum of squares.
const MOST_DAMPING: f64 = 1e16;

/// Fits parameters of a scene to measured section points.
///
/// # Errors
///
/// [`AnalysisError::Length`] for points and offsets of a wrong length,
/// [`AnalysisError::TooFewMeasured`] if there are not more numbers than unknowns,
/// [`AnalysisError::Unbounded`] for a number beyond 1e100 in size (a coordinate that is NaN was not
/// measured), [`AnalysisError::NotAStandardDeviation`] for a noise that is not positive; as
/// [`DirectMap::new`](super::DirectMap::new).
pub fn fit(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &FitRequest,
    progress: &dyn Progress,
) -> Result<Fit, AnalysisError> {
    if !request.method.is_direct() {
        check_contacts(map)?;
    }
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let run = HornerMap::new(map);
    let guarded = || GuardedMap::new(&run, &map.window, &direct);
    match request.method {
        Method::Map => best_fit(map, &|| &run, request, progress),
        Method::Guarded => best_fit(map, &guarded, request, progress),
        Method::Direct => best_fit(map, &|| direct.clone(), request, progress),
        Method::Atlas => Err(AnalysisError::NotTabulated { what: "a fit" }),
    }
}

/// Fit from the parameters of the request; if it misses the stated noise, or none is stated, also
/// from those that pieces of one return give. The better one of both.
fn best_fit<M: DifferentiableMap>(
    local: &LocalMap,
    map: &(dyn Fn() -> M + Sync),
    request: &FitRequest,
    progress: &dyn Progress,
) -> Result<Fit, AnalysisError> {
    let fit = |request: &FitRequest| -> Result<Fit, AnalysisError> {
        Ok(fitted(&Problem::new(local, request)?, map, request, progress))
    };
    let found = fit(request)?;
    if request.piece == 1 || (found.noise_is_known && found.end == FitEnd::Converged) {
        return Ok(found);
    }
    // Where coordinates were not measured, short pieces may have more unknowns than numbers.
    let Ok(short) = fit(&FitRequest { piece: 1, ..request.clone() }) else { return Ok(found) };
    let mut at = request.at.clone();
    for (&place, parameter) in request.parameters.iter().zip(&short.parameters) {
        at[place] = parameter.offset;
    }
    let again = fit(&FitRequest { at, ..request.clone() })?;
    Ok(if again.misses_less(&found) { again } else { found })
}

/// Factor by which a sum of squares, or an estimated noise, is smaller in a better fit.
const BETTER: f64 = 0.99;

impl Fit {
    /// Whether the residuals are smaller than those of another fit to the same data: over the
    /// noise if it was stated, otherwise by the noise that they give.
    fn misses_less(&self, other: &Self) -> bool {
        let size = |fit: &Self| match fit.noise_is_known {
            true => fit.sum_of_squares,
            false => fit.noise.iter().product(),
        };
        let (own, others) = (size(self), size(other));
        own < BETTER * others || (own.is_finite() && !others.is_finite())
    }
}

/// Fits from one start, with a map that every thread creates for itself.
fn fitted<M: DifferentiableMap>(
    problem: &Problem<'_>,
    map: &(dyn Fn() -> M + Sync),
    request: &FitRequest,
    progress: &dyn Progress,
) -> Fit {
    let mut unknowns = problem.start();
    let known = request.noise.is_some();
    let mut noise = request.noise.clone().unwrap_or_else(|| problem.spread());
    let (mut steps, mut end) = (0, FitEnd::NoImage);
    let rounds = if known { 1 } else { ROUNDS };
    for _ in 0..rounds {
        progress.expect(1);
        let round = Round { problem, map, noise: &noise };
        for side in 0..SIDES {
            let changed = problem.try_starts(map, &mut unknowns, &noise);
            if side > 0 && !changed {
                break;
            }
            let made;
            (made, end) = round.descend(&mut unknowns);
            steps += made;
        }
        progress.advance(1);
        if known || end == FitEnd::NoImage {
            break;
        }
        let again = problem.noise(map, &unknowns, &noise);
        let change = again.iter().zip(&noise).map(|(new, old)| (new / old - 1.0).abs());
        let settled = change.fold(0.0, f64::max) < SETTLED;
        noise = again;
        if settled {
            break;
        }
    }
    let round = Round { problem, map, noise: &noise };
    let covariance = round.covariance(&unknowns);
    let (sum, freedom) = (round.sum(&unknowns), problem.freedom());
    if known && end == FitEnd::Converged && misfit(sum, freedom as f64) > 1.0 {
        end = FitEnd::Misfit;
    }
    let outcome = problem.outcome(map, &unknowns, &noise, covariance.as_ref());
    Fit { steps, end, sum_of_squares: sum, freedom, noise_is_known: known, ..outcome }
}

/// Excess of a sum of squares over its mean, in units of five standard deviations: above 1 is a
/// misfit, negative is below the mean.
pub fn misfit(sum: f64, freedom: f64) -> f64 {
    (sum - freedom) / (MISFIT * (2.0 * freedom).sqrt())
}

/// Least squares for a fixed size of the noise.
struct Round<'a, M> {
    problem: &'a Problem<'a>,
    map: &'a (dyn Fn() -> M + Sync),
    noise: &'a [f64],
}

impl<M: DifferentiableMap> Round<'_, M> {
    /// Sum of squares; infinite if an orbit has no image.
    fn sum(&self, unknowns: &[f64]) -> f64 {
        self.problem.sum_of_squares(self.map, unknowns, self.noise)
    }

    /// Descends to a minimum of the sum of squares; returns the number of steps and the end.
    fn descend(&self, unknowns: &mut Vec<f64>) -> (usize, FitEnd) {
        let mut sum = self.sum(unknowns);
        if !sum.is_finite() {
            return (0, FitEnd::NoImage);
        }
        let mut scales = vec![0.0; unknowns.len()];
        let (mut damping, mut growth) = (1e-3, 2.0);
        let mut linear = None;
        for step in 0..STEPS {
            let held = match linear.take() {
                Some(held) => held,
                None => {
                    let fresh = self.problem.linearised(self.map, unknowns, self.noise);
                    let Some(fresh) = fresh else {
                        return (step, FitEnd::NoDerivative);
                    };
                    fresh.widen(&mut scales);
                    fresh
                }
            };
            let Some(change) = held.step(damping, &scales) else {
                return (step, FitEnd::Undetermined);
            };
            let trial: Vec<f64> = unknowns.iter().zip(&change).map(|(a, b)| a + b).collect();
            let expected = held.expected(&change, damping, &scales);
            let reached = self.sum(&trial);
            let gain = (sum - reached) / expected;
            let length = norm(&change, &scales) / norm(unknowns, &scales).max(f64::MIN_POSITIVE);
            if length <= CONVERGED || expected <= CONVERGED * sum {
                if reached < sum {
                    *unknowns = trial;
                }
                return (step + 1, FitEnd::Converged);
            }
            if gain > 0.0 {
                *unknowns = trial;
                sum = reached;
                damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                growth = 2.0;
            } else {
                damping *= growth;
                growth *= 2.0;
                linear = Some(held);
                if damping > MOST_DAMPING {
                    return (step + 1, FitEnd::Stalled);
                }
            }
        }
        (STEPS, FitEnd::Steps)
    }

    /// Covariance of the parameters; `None` if the data do not determine them.
    fn covariance(&self, unknowns: &[f64]) -> Option<DMatrix<f64>> {
        let linear = self.problem.linearised(self.map, unknowns, self.noise)?;
        let none = vec![0.0; unknowns.len()];
        let (triangle, _) = linear.parameters(0.0, &none);
        let inverse = triangle.try_inverse()?;
        let covariance = &inverse * inverse.transpose();
        covariance.iter().all(|value| value.is_finite()).then_some(covariance)
    }
}

fn norm(values: &[f64], scales: &[f64]) -> f64 {
    let squares = values.iter().zip(scales).map(|(value, scale)| (value * scale).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Upper triangular factor of a QR decomposition, square with one row per column.
fn triangle(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let columns = matrix.ncols();
    let rows = matrix.nrows().max(columns);
    matrix.resize_vertically(rows, 0.0).qr().r()
}

/// Solution of an upper triangular system; `None` if it is singular.
fn solved(triangle: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let solution = triangle.solve_upper_triangular(right)?;
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}
