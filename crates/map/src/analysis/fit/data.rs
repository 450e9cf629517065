//! Requests and results of a fit.

use serde::{Deserialize, Serialize};

use crate::model::Method;

/// What is asked of [`fit`](super::fit()).
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
