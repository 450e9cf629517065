//! Parameters fitted to measured section points, by least squares.
//!
//! One idea: a series of measured points is cut into pieces of a few returns, each with a start of
//! its own, so that what an orbit stretches does not drown what its parameters do. A piece's start
//! is eliminated by the QR decomposition of the piece, and what is left of all pieces is a problem
//! in the parameters alone: the work is that of the pieces, however many there are.
//!
//! Images and their derivatives are those of guarded iteration: the map's, exact, inside its
//! window, and those of direct simulation outside. Steps are those of Levenberg and Marquardt, with
//! the damping of `Nielsen1999`. Without noise that is stated, its size in every coordinate is
//! that of the residuals, estimated again until it settles (feasible generalised least squares).
//!
//! Where a start lies on one side of its graze and its orbit on the other, no derivative says so:
//! starts near the measurement are tried, on both sides, before each descent.
//!
//! The orbit is taken to be deterministic: noise is that of the measurement.

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

/// What is asked of [`fit()`].
#[derive(Clone, Debug, PartialEq)]
pub struct FitRequest {
    /// Numbers, among the active ones, of the parameters that are fitted.
    pub parameters: Vec<usize>,
    /// Offsets of all active parameters: those that are fitted begin there.
    pub at: Vec<f64>,
    /// What was measured.
    pub series: Vec<MeasuredSeries>,
    /// Standard deviation of the measurement in every coordinate; `None`: that of the residuals.
    pub noise: Option<Vec<f64>>,
    /// Returns of a piece that has a start of its own; 0: a series is one piece.
    pub piece: usize,
    /// Points at the end of every series that are not fitted but predicted.
    pub withheld: usize,
    /// What computes images.
    pub method: Method,
}

impl FitRequest {
    /// Returns of a piece where none are named.
    pub const PIECE: usize = 10;
}

/// Section points of one orbit, return by return.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSeries {
    /// What is known to be added to the parameters while it was measured: offsets of all active
    /// ones.
    pub controls: Vec<f64>,
    /// Offsets of the coordinates, one point after another; NaN where a coordinate was not
    /// measured.
    pub points: Vec<Vec<f64>>,
}

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FitEnd {
    /// At a least sum of squares.
    Converged,
    /// At a sum of squares more than five standard deviations above what the stated noise makes:
    /// starts on the wrong side of their graze, more noise, or data of another model.
    Misfit,
    /// No step lowers the sum of squares, and it is no smooth minimum: the orbits graze there.
    Stalled,
    /// After the most steps that are taken.
    Steps,
    /// The data do not determine all of the parameters.
    Undetermined,
    /// An orbit from the data has no image at the parameters that the fit begins with.
    NoImage,
    /// An orbit has an image without derivatives.
    NoDerivative,
}

impl FitEnd {
    /// What is to be said of it; nothing of a fit that converged.
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
    /// Its name.
    pub parameter: String,
    /// Its offset from the grazing value.
    pub offset: f64,
    /// The value itself.
    pub value: f64,
    /// Standard error; NaN where the data do not determine it.
    pub standard_error: f64,
}

/// How points that were not fitted are predicted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithheldPoints {
    /// How many.
    pub points: usize,
    /// Root of the mean square of prediction less measurement, over the noise, by coordinate: 1
    /// where predictions are right.
    pub error_over_noise: Vec<f64>,
}

/// Fitted parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The parameters, in the order in which they were named.
    pub parameters: Vec<FittedParameter>,
    /// Their covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the measurement in every coordinate.
    pub noise: Vec<f64>,
    /// Whether it was stated; estimated otherwise.
    pub noise_is_known: bool,
    /// Sum of the squares of the residuals over the noise.
    pub sum_of_squares: f64,
    /// Numbers measured less unknowns: what the sum of squares is to be near.
    pub freedom: usize,
    /// Numbers that were fitted.
    pub measured: usize,
    /// Pieces, each with a start of its own.
    pub pieces: usize,
    /// Steps of the least squares.
    pub steps: usize,
    /// How they ended.
    pub end: FitEnd,
    /// Share of the images that the map made; the others are direct simulation.
    pub by_map: f64,
    /// Share of the returns that begin outside the window.
    pub outside: f64,
    /// Points that were predicted; `None` where none were withheld.
    pub withheld: Option<WithheldPoints>,
}

/// Most steps of the least squares of one round.
const STEPS: usize = 100;
/// Most times that the size of the noise is estimated again.
const ROUNDS: usize = 20;
/// Most times that starts are tried on both sides of their graze.
const SIDES: usize = 20;
/// Change of the size of the noise, relative to itself, at which it has settled.
const SETTLED: f64 = 1e-3;
/// Step over the unknowns' sizes, and change of the sum of squares over itself, at which the least
/// squares have converged.
const CONVERGED: f64 = 1e-12;
/// Standard deviations of a sum of squares by which it may be larger than its mean.
const MISFIT: f64 = 5.0;
/// Largest damping: no step lowers the sum of squares.
const MOST_DAMPING: f64 = 1e16;

/// Parameters of a scene fitted to measured section points.
///
/// # Errors
///
/// [`AnalysisError::Length`] for points and offsets of another length,
/// [`AnalysisError::TooFewMeasured`] for fewer numbers than unknowns,
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
    if request.method != Method::Direct {
        check_contacts(map)?;
    }
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let run = HornerMap::new(map);
    let problem = Problem::new(map, request)?;
    let guarded = || GuardedMap::new(&run, &map.window, &direct);
    Ok(match request.method {
        Method::Map => fitted(&problem, &|| &run, request, progress),
        Method::Guarded => fitted(&problem, &guarded, request, progress),
        Method::Direct => fitted(&problem, &|| direct.clone(), request, progress),
    })
}

/// The fit with a map that every thread makes for itself.
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

/// How far a sum of squares is above its mean, in units of what chance explains; negative below.
pub fn misfit(sum: f64, freedom: f64) -> f64 {
    (sum - freedom) / (MISFIT * (2.0 * freedom).sqrt())
}

/// Least squares with a size of the noise.
struct Round<'a, M> {
    problem: &'a Problem<'a>,
    map: &'a (dyn Fn() -> M + Sync),
    noise: &'a [f64],
}

impl<M: DifferentiableMap> Round<'_, M> {
    /// The sum of squares; infinite where an orbit has no image.
    fn sum(&self, unknowns: &[f64]) -> f64 {
        self.problem.sum_of_squares(self.map, unknowns, self.noise)
    }

    /// Steps down to the least sum of squares: how many, and how they ended.
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

    /// Covariance of the parameters; `None` where the data do not determine them.
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

/// The upper triangle of a QR decomposition, square in the columns.
fn triangle(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let columns = matrix.ncols();
    let rows = matrix.nrows().max(columns);
    matrix.resize_vertically(rows, 0.0).qr().r()
}

/// The solution of an upper triangular system; `None` where it is singular.
fn solved(triangle: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let solution = triangle.solve_upper_triangular(right)?;
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}
