//! Least-squares problem of a fit: pieces, residuals and their derivatives.
//!
//! The unknowns are the parameters, followed by the start of every piece.

use nalgebra::{DMatrix, DVector};

use super::{Fit, FitEnd, FitRequest, FittedParameter, WithheldPoints, solved, triangle};
use crate::analysis::error::{AnalysisError, check_length};
use crate::expansion::LocalMap;
use crate::iteration::{DifferentiableMap, PhaseCircle, parallel};

/// Number of starts tried along a coordinate, and their largest distance from the measurement in
/// standard deviations of the noise.
const TRIALS: usize = 7;
const REACH: f64 = 3.0;
/// Most coordinates in which starts are tried.
const MOST_TRIED: usize = 3;
/// Newton steps from the best start tried.
const REFINEMENTS: usize = 8;
/// Smallest relative decrease of a sum of squares that counts.
const SMALL: f64 = 1e-6;

/// Fitted parameters, data and map of a fit.
pub(super) struct Problem<'a> {
    local: &'a LocalMap,
    request: &'a FitRequest,
    pieces: Vec<SeriesPiece<'a>>,
    dimension: usize,
}

/// Consecutive returns of a series.
struct SeriesPiece<'a> {
    controls: &'a [f64],
    points: &'a [Vec<f64>],
    /// Points after the piece that are predicted from it.
    withheld: &'a [Vec<f64>],
}

/// An orbit from the start of a piece.
struct PieceOrbit {
    /// States, starting with the start; fewer than the piece's points if one has no image.
    states: Vec<Vec<f64>>,
    /// Number of images computed by the map.
    by_map: usize,
    /// Number of returns that start outside the window.
    outside: usize,
}

/// Derivatives of a piece with its start eliminated: triangle over start, parameters and residual.
struct Reduced(DMatrix<f64>);

/// The problem linearised at some unknowns.
pub(super) struct LinearisedFit {
    pieces: Vec<Reduced>,
    /// Squared norms of the columns, one per unknown.
    squares: Vec<f64>,
    /// Half the gradient of the sum of squares, one entry per unknown.
    gradient: Vec<f64>,
    parameters: usize,
    dimension: usize,
}

impl<'a> Problem<'a> {
    pub(super) fn new(local: &'a LocalMap, request: &'a FitRequest) -> Result<Self, AnalysisError> {
        let (dimension, active) = (local.dimension(), local.parameters.len());
        check_length("offsets of the parameters", active, request.at.len())?;
        check_numbers("an offset of a parameter", &request.at)?;
        for &noise in request.noise.iter().flatten() {
            let is_good = noise > 0.0 && noise.is_finite();
            is_good.then_some(()).ok_or(AnalysisError::NotAStandardDeviation { found: noise })?;
        }
        let mut pieces = Vec::new();
        for series in &request.series {
            check_length("controls of a series", active, series.controls.len())?;
            check_numbers("a control of a series", &series.controls)?;
            for point in &series.points {
                check_length("coordinates of a point", dimension, point.len())?;
                let measured: Vec<f64> = point.iter().copied().filter(|x| !x.is_nan()).collect();
                check_numbers("a measured coordinate", &measured)?;
            }
            let kept = series.points.len().saturating_sub(request.withheld);
            let (fitted, withheld) = series.points.split_at(kept);
            pieces.extend(cut(fitted, withheld, &series.controls, request.piece));
        }
        let problem = Self { local, request, pieces, dimension };
        let (measured, unknowns) = (problem.measured(), problem.unknowns());
        match measured > unknowns {
            true => Ok(problem),
            false => Err(AnalysisError::TooFewMeasured { measured, unknowns }),
        }
    }

    fn parameters(&self) -> usize {
        self.request.parameters.len()
    }

    fn unknowns(&self) -> usize {
        self.parameters() + self.pieces.len() * self.dimension
    }

    /// Number of measured numbers that are fitted.
    fn measured(&self) -> usize {
        (0..self.dimension).map(|coordinate| self.measured_of(coordinate)).sum()
    }

    fn measured_of(&self, coordinate: usize) -> usize {
        let points = self.pieces.iter().flat_map(|piece| piece.points);
        points.filter(|point| point[coordinate].is_finite()).count()
    }

    pub(super) fn freedom(&self) -> usize {
        self.measured() - self.unknowns()
    }

    /// Initial unknowns: starts are as measured.
    pub(super) fn start(&self) -> Vec<f64> {
        let parameters = self.request.parameters.iter().map(|&place| self.request.at[place]);
        let starts = self.pieces.iter().flat_map(|piece| piece.points[0].iter().copied());
        parameters.chain(starts).collect()
    }

    /// Standard deviation of the measured values in every coordinate; 1 if it is 0.
    pub(super) fn spread(&self) -> Vec<f64> {
        let spread = |coordinate: usize| {
            let values = || {
                let points = self.pieces.iter().flat_map(|piece| piece.points);
                points.map(|point| point[coordinate]).filter(|value| value.is_finite())
            };
            let count = values().count() as f64;
            let mean = values().sum::<f64>() / count;
            let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
            if variance > 0.0 { variance.sqrt() } else { 1.0 }
        };
        (0..self.dimension).map(spread).collect()
    }

    /// Offsets of all active parameters during a piece.
    fn offsets(&self, piece: &SeriesPiece<'_>, unknowns: &[f64]) -> Vec<f64> {
        let mut offsets = self.request.at.clone();
        for (&place, &value) in self.request.parameters.iter().zip(unknowns) {
            offsets[place] = value;
        }
        offsets.iter().zip(piece.controls).map(|(offset, control)| offset + control).collect()
    }

    /// Index of the start of a piece among the unknowns.
    fn place(&self, number: usize) -> usize {
        self.parameters() + number * self.dimension
    }

    /// Orbit of a piece from its start, for `returns` returns.
    fn orbit<M: DifferentiableMap>(
        &self,
        map: &M,
        (start, offsets): (&[f64], &[f64]),
        returns: usize,
    ) -> PieceOrbit {
        let mut orbit = PieceOrbit { states: vec![start.to_vec()], by_map: 0, outside: 0 };
        for place in 0..returns {
            let mut image = vec![0.0; self.dimension];
            let state = &orbit.states[place];
            let info = map.step(state, offsets, &mut image);
            if !info.valid {
                break;
            }
            orbit.by_map += usize::from(!info.simulated);
            let holds = self.local.window.holds(state, offsets, &[info.depth]);
            orbit.outside += usize::from(!holds);
            orbit.states.push(image);
        }
        orbit
    }

    /// Residuals of a piece, prediction minus measurement, for the numbers measured, each with its
    /// coordinate; `None` without an image.
    fn residuals<M: DifferentiableMap>(
        &self,
        map: &M,
        piece: &SeriesPiece<'_>,
        point: (&[f64], &[f64]),
    ) -> Option<Vec<(usize, f64)>> {
        let orbit = self.orbit(map, point, piece.points.len() - 1);
        (orbit.states.len() == piece.points.len())
            .then(|| differences(&orbit.states, piece.points, map.circle()).collect())
    }

    /// Sum of the squared residuals of a piece over the noise; infinite without an image.
    fn piece_sum<M: DifferentiableMap>(
        &self,
        map: &M,
        piece: &SeriesPiece<'_>,
        point: (&[f64], &[f64]),
        noise: &[f64],
    ) -> f64 {
        let residuals = self.residuals(map, piece, point);
        residuals.map_or(f64::INFINITY, |residuals| {
            residuals.iter().map(|&(place, value)| (value / noise[place]).powi(2)).sum()
        })
    }

    /// Start of a piece with a lower sum of squares at the same parameters, if one is near its
    /// measurement.
    ///
    /// A start without contact has no information about the other side of its graze, where the sum
    /// of squares may be lower: starts on a grid about the measurement are tried.
    fn better_start<M: DifferentiableMap>(
        &self,
        map: &M,
        piece: &SeriesPiece<'_>,
        (now, offsets): (&[f64], &[f64]),
        noise: &[f64],
    ) -> Option<Vec<f64>> {
        let sum = |start: &[f64]| self.piece_sum(map, piece, (start, offsets), noise);
        let now = sum(now);
        let mut best = (f64::INFINITY, Vec::new());
        for cell in 0..TRIALS.pow(self.dimension as u32) {
            let mut rest = cell;
            let start: Vec<f64> = piece.points[0]
                .iter()
                .zip(noise)
                .map(|(measured, noise)| {
                    let place = rest % TRIALS;
                    rest /= TRIALS;
                    let reach = 2.0 * place as f64 / (TRIALS - 1) as f64 - 1.0;
                    measured + REACH * reach * noise
                })
                .collect();
            let sum = sum(&start);
            if sum < best.0 {
                best = (sum, start);
            }
        }
        if !best.0.is_finite() {
            return None;
        }
        for _ in 0..REFINEMENTS {
            let (held, start) = &best;
            let rows = self.rows(map, piece, (start, offsets), noise)?;
            let d = self.dimension;
            let own = triangle(rows.remove_columns(d, self.parameters()));
            let residual: DVector<f64> = own.view((0, d), (d, 1)).column(0).into();
            let change = solved(&own.view((0, 0), (d, d)).into(), &-residual)?;
            let trial: Vec<f64> = start.iter().zip(change.iter()).map(|(a, b)| a + b).collect();
            let reached = sum(&trial);
            if reached >= held * (1.0 - SMALL) {
                break;
            }
            best = (reached, trial);
        }
        (best.0 < now * (1.0 - SMALL)).then_some(best.1)
    }

    /// Replaces starts by better ones near the measurements; returns whether there were any.
    pub(super) fn try_starts<M: DifferentiableMap>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &mut [f64],
        noise: &[f64],
    ) -> bool {
        if self.dimension > MOST_TRIED {
            return false;
        }
        let found = self
            .each(map, unknowns, |map, piece, point| self.better_start(map, piece, point, noise));
        let mut any = false;
        for (number, start) in found.into_iter().enumerate() {
            let Some(start) = start else { continue };
            unknowns[self.place(number)..][..self.dimension].copy_from_slice(&start);
            any = true;
        }
        any
    }

    /// Runs `work` on every piece, with its start and parameters, on all cores, with one map per
    /// thread; results are in the order of the pieces.
    fn each<M: DifferentiableMap, R: Send>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &[f64],
        work: impl Fn(&M, &SeriesPiece<'_>, (&[f64], &[f64])) -> R + Sync,
    ) -> Vec<R> {
        let of_piece = |map: &mut M, (number, piece): (usize, &SeriesPiece<'_>)| {
            let start = &unknowns[self.place(number)..][..self.dimension];
            work(map, piece, (start, &self.offsets(piece, unknowns)))
        };
        parallel::map_with(self.pieces.iter().enumerate(), map, of_piece)
    }

    /// Sum of the squared residuals over the noise; infinite if an orbit has no image.
    pub(super) fn sum_of_squares<M: DifferentiableMap>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &[f64],
        noise: &[f64],
    ) -> f64 {
        let sum = |map: &M, piece: &SeriesPiece<'_>, point: (&[f64], &[f64])| {
            self.piece_sum(map, piece, point, noise)
        };
        self.each(map, unknowns, sum).iter().sum()
    }

    /// Standard deviation of the residuals in every coordinate, corrected for the number of
    /// unknowns by the same factor in all coordinates.
    pub(super) fn noise<M: DifferentiableMap>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &[f64],
        noise: &[f64],
    ) -> Vec<f64> {
        let share = self.freedom() as f64 / self.measured() as f64;
        let all = self.each(map, unknowns, |map, piece, point| self.residuals(map, piece, point));
        let mut sums = vec![0.0; self.dimension];
        for (place, value) in all.iter().flatten().flatten() {
            sums[*place] += value * value;
        }
        let deviation = |(coordinate, sum): (usize, f64)| {
            let count = self.measured_of(coordinate) as f64 * share;
            let deviation = (sum / count).sqrt();
            // Data without noise, or without this coordinate, give no estimate.
            let floor = 1e-15 * noise[coordinate];
            if deviation > floor { deviation } else { floor.max(f64::MIN_POSITIVE) }
        };
        sums.into_iter().enumerate().map(deviation).collect()
    }

    /// Residuals and derivatives, with the start of every piece eliminated; `None` if an image has
    /// no derivatives.
    pub(super) fn linearised<M: DifferentiableMap>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &[f64],
        noise: &[f64],
    ) -> Option<LinearisedFit> {
        let rows =
            self.each(map, unknowns, |map, piece, point| self.rows(map, piece, point, noise));
        let (parameters, dimension) = (self.parameters(), self.dimension);
        let mut linear = LinearisedFit {
            pieces: Vec::with_capacity(rows.len()),
            squares: vec![0.0; unknowns.len()],
            gradient: vec![0.0; unknowns.len()],
            parameters,
            dimension,
        };
        for (number, rows) in rows.into_iter().enumerate() {
            let rows = rows?;
            let last = rows.ncols() - 1;
            let own = parameters + number * dimension;
            for column in 0..last {
                let place = if column < dimension { own + column } else { column - dimension };
                linear.squares[place] += rows.column(column).norm_squared();
                linear.gradient[place] += rows.column(column).dot(&rows.column(last));
            }
            linear.pieces.push(Reduced(triangle(rows)));
        }
        Some(linear)
    }

    /// Rows of a piece: derivatives by its start, by the parameters, and the residual.
    fn rows<M: DifferentiableMap>(
        &self,
        map: &M,
        piece: &SeriesPiece<'_>,
        (start, offsets): (&[f64], &[f64]),
        noise: &[f64],
    ) -> Option<DMatrix<f64>> {
        let (d, q) = (self.dimension, self.parameters());
        let width = d + offsets.len();
        let mut state = start.to_vec();
        // Derivatives of the state by the start, and by the parameters.
        let mut tangent = DMatrix::identity(d, d).resize_horizontally(d + q, 0.0);
        let mut rows = Vec::new();
        for (place, point) in piece.points.iter().enumerate() {
            if place > 0 {
                let (mut image, mut derivatives) = (vec![0.0; d], vec![0.0; d * width]);
                let info = map.step_derivatives(&state, offsets, &mut image, &mut derivatives);
                if !info.valid || derivatives.iter().any(|value| !value.is_finite()) {
                    return None;
                }
                let derivatives = DMatrix::from_row_slice(d, width, &derivatives);
                tangent = derivatives.columns(0, d) * tangent;
                for (column, &parameter) in self.request.parameters.iter().enumerate() {
                    let mut by = tangent.column_mut(d + column);
                    by += derivatives.column(d + parameter);
                }
                state = image;
            }
            for coordinate in (0..d).filter(|&coordinate| point[coordinate].is_finite()) {
                let apart = state[coordinate] - point[coordinate];
                let residual = map.circle().shortest(coordinate, apart);
                let row = tangent.row(coordinate);
                let row = row.iter().copied().chain([residual]);
                rows.extend(row.map(|value| value / noise[coordinate]));
            }
        }
        Some(DMatrix::from_row_slice(rows.len() / (d + q + 1), d + q + 1, &rows))
    }

    /// Results of a fit at its final unknowns.
    pub(super) fn outcome<M: DifferentiableMap>(
        &self,
        map: &(dyn Fn() -> M + Sync),
        unknowns: &[f64],
        noise: &[f64],
        covariance: Option<&DMatrix<f64>>,
    ) -> Fit {
        let orbits = self.each(map, unknowns, |map, piece, point| {
            self.orbit(map, point, piece.points.len() - 1 + piece.withheld.len())
        });
        let q = self.parameters();
        let entry = |row, column| covariance.map_or(f64::NAN, |matrix| matrix[(row, column)]);
        let parameter = |(number, &place): (usize, &usize)| {
            let active = &self.local.parameters[place];
            FittedParameter {
                parameter: active.name.clone(),
                offset: unknowns[number],
                value: active.value.to_f64() + unknowns[number],
                standard_error: entry(number, number).sqrt(),
            }
        };
        let images: usize = orbits.iter().map(|orbit| orbit.states.len() - 1).sum();
        let share = |count: fn(&PieceOrbit) -> usize| {
            orbits.iter().map(count).sum::<usize>() as f64 / images.max(1) as f64
        };
        Fit {
            parameters: self.request.parameters.iter().enumerate().map(parameter).collect(),
            covariance: (0..q)
                .map(|row| (0..q).map(|column| entry(row, column)).collect())
                .collect(),
            noise: noise.to_vec(),
            noise_is_known: false,
            sum_of_squares: f64::NAN,
            freedom: self.freedom(),
            measured: self.measured(),
            pieces: self.pieces.len(),
            steps: 0,
            end: FitEnd::Converged,
            by_map: share(|orbit| orbit.by_map),
            outside: share(|orbit| orbit.outside),
            withheld: self.predicted(&orbits, noise, map().circle()),
        }
    }

    fn predicted(
        &self,
        orbits: &[PieceOrbit],
        noise: &[f64],
        circle: PhaseCircle,
    ) -> Option<WithheldPoints> {
        let (mut sums, mut counts) = (vec![0.0; self.dimension], vec![0usize; self.dimension]);
        let mut points = 0;
        for (piece, orbit) in self.pieces.iter().zip(orbits) {
            let states = orbit.states.get(piece.points.len()..).unwrap_or_default();
            points += piece.withheld.len();
            // A point that the orbit does not reach counts as infinitely far.
            let lost = piece.withheld.len() - states.len();
            for (place, difference) in differences(states, piece.withheld, circle) {
                sums[place] += (difference / noise[place]).powi(2);
                counts[place] += 1;
            }
            if lost > 0 {
                sums.fill(f64::INFINITY);
            }
        }
        let error = |(sum, count): (&f64, &usize)| (sum / (*count).max(1) as f64).sqrt();
        (points > 0).then(|| WithheldPoints {
            points,
            error_over_noise: sums.iter().zip(&counts).map(error).collect(),
        })
    }
}

/// Largest number, in size, that is fitted: the squares of residuals are numbers beside it.
const LARGEST: f64 = 1e100;

/// Refuses numbers whose squares may overflow, infinity and NaN.
fn check_numbers(what: &'static str, numbers: &[f64]) -> Result<(), AnalysisError> {
    let beyond = numbers.iter().find(|number| number.is_nan() || number.abs() > LARGEST);
    beyond.map_or(Ok(()), |&found| Err(AnalysisError::Unbounded { what, found, largest: LARGEST }))
}

/// Cuts a series into pieces of `returns` returns; each starts at a point with all coordinates
/// measured.
fn cut<'a>(
    fitted: &'a [Vec<f64>],
    withheld: &'a [Vec<f64>],
    controls: &'a [f64],
    returns: usize,
) -> Vec<SeriesPiece<'a>> {
    let is_whole = |point: &Vec<f64>| point.iter().all(|value| value.is_finite());
    let length = if returns == 0 { usize::MAX } else { returns.saturating_add(1) };
    let (mut pieces, mut rest) = (Vec::new(), fitted);
    while let Some(first) = rest.iter().position(is_whole) {
        rest = &rest[first..];
        let (points, after) = rest.split_at(length.min(rest.len()));
        // A single point left at the end of a series joins the piece before it.
        let points = if after.len() == 1 { rest } else { points };
        rest = if after.len() == 1 { &[] } else { after };
        if points.len() > 1 {
            pieces.push(SeriesPiece { controls, points, withheld: &[] });
        }
    }
    if let Some(last) = pieces.last_mut() {
        last.withheld = withheld;
    }
    pieces
}

/// Prediction minus measurement with its coordinate, for the numbers measured.
fn differences<'a>(
    states: &'a [Vec<f64>],
    points: &'a [Vec<f64>],
    circle: PhaseCircle,
) -> impl Iterator<Item = (usize, f64)> + 'a {
    states.iter().zip(points).flat_map(move |(state, point)| {
        let pairs = state.iter().zip(point).enumerate();
        let pairs = pairs.filter(|(_, (_, measured))| measured.is_finite());
        pairs.map(move |(place, (value, measured))| {
            (place, circle.shortest(place, value - measured))
        })
    })
}

impl LinearisedFit {
    /// Raises the scales of the unknowns to the norms of their columns; scales never shrink.
    pub(super) fn widen(&self, scales: &mut [f64]) {
        for (scale, square) in scales.iter_mut().zip(&self.squares) {
            *scale = scale.max(square.sqrt());
        }
    }

    /// Triangular matrix of the parameters, and its right-hand side.
    pub(super) fn parameters(&self, damping: f64, scales: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let (d, q) = (self.dimension, self.parameters);
        let damped = self.pieces.iter().enumerate();
        let damped: Vec<_> =
            damped.map(|(number, piece)| self.damped(number, piece, damping, scales)).collect();
        let mut all = DMatrix::zeros(damped.len() * (q + 1) + q, q + 1);
        for (number, piece) in damped.iter().enumerate() {
            let part = piece.view((d, d), (q + 1, q + 1));
            all.view_mut((number * (q + 1), 0), (q + 1, q + 1)).copy_from(&part);
        }
        for column in 0..q {
            all[(damped.len() * (q + 1) + column, column)] = damping.sqrt() * scales[column];
        }
        let all = triangle(all);
        (all.view((0, 0), (q, q)).into(), -all.view((0, q), (q, 1)).column(0))
    }

    /// Triangle of a piece with the damping of its start.
    fn damped(
        &self,
        number: usize,
        Reduced(piece): &Reduced,
        damping: f64,
        scales: &[f64],
    ) -> DMatrix<f64> {
        let (d, columns) = (self.dimension, piece.ncols());
        let mut rows = piece.clone().resize_vertically(columns + d, 0.0);
        for column in 0..d {
            let scale = scales[self.parameters + number * d + column];
            rows[(columns + column, column)] = damping.sqrt() * scale;
        }
        triangle(rows)
    }

    /// Damped step; `None` if the problem is singular.
    pub(super) fn step(&self, damping: f64, scales: &[f64]) -> Option<Vec<f64>> {
        let (d, q) = (self.dimension, self.parameters);
        let (matrix, right) = self.parameters(damping, scales);
        let by_parameters = solved(&matrix, &right)?;
        let mut change = by_parameters.as_slice().to_vec();
        for (number, piece) in self.pieces.iter().enumerate() {
            let rows = self.damped(number, piece, damping, scales);
            let residual: DVector<f64> = rows.view((0, d + q), (d, 1)).column(0).into();
            let right = -(residual + rows.view((0, d), (d, q)) * &by_parameters);
            change.extend(solved(&rows.view((0, 0), (d, d)).into(), &right)?.iter());
        }
        Some(change)
    }

    /// Decrease of the linearised problem's sum of squares by a damped step.
    pub(super) fn expected(&self, change: &[f64], damping: f64, scales: &[f64]) -> f64 {
        let terms = change.iter().zip(&self.gradient).zip(scales);
        let term = |((&change, &gradient), &scale): ((&f64, &f64), &f64)| {
            change * (damping * scale * scale * change - gradient)
        };
        terms.map(term).sum()
    }
}
