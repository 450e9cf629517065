//! Measurement of the window of a map: the bounds that a scene leaves open, and the error of the
//! map inside.
//!
//! As a window shrinks by a factor `s` the error of a map falls faster than `s`, so there is a
//! largest window of a given shape on which the map keeps a tolerance. The shape is that of the
//! [natural sizes](NaturalWindow) of the map. The size is found by bisection, then each bound is
//! widened separately, all against direct simulation in double-double. Points that do not return,
//! or have contacts other than those of the grazing passages, are not part of such a window. The
//! error stated for the window found is the largest that [ascents](super::ascent) reach on it.

use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};

use super::ConvergenceError;
use super::ascent::{Ascents, Largest};
use super::sample::{SamplePoint, WindowSample};
use super::truth::{
    ExactImage, ExactImages, ExactReturns, MOST_PRODUCTS, SampleSummary, errors, rounding_of,
};
use crate::expansion::{LocalMap, MapWindow, NaturalWindow};
use crate::hybrid::HybridSystem;
use crate::iteration::{DiscreteMap, parallel};
use crate::model::{Orders, Scene};
use crate::numeric::{decimal_above, decimal_below, last_that_holds};
use crate::orbit::GrazingOrbit;

/// Error of a coordinate relative to its half-width, if a scene states no tolerance.
const DEFAULT_SHARE: f64 = 1e-6;

/// Numbers of points of each kind, besides the corners, at which a window is tried or measured.
#[derive(Clone, Copy, Debug)]
struct Points {
    /// Number of the first point in the sequence, beyond those that orders are chosen by.
    first: usize,
    /// Number of points with up to four variables.
    most: usize,
    /// Smallest number of points: with more variables there are fewer, because a return of a large
    /// system takes long and most of the window is in its corners.
    least: usize,
}

/// Points at which a window is tried.
const TRIED: Points = Points { first: 40_000, most: 16, least: 4 };

/// Points at which the window found is measured.
const MEASURED: Points = Points { first: 128, most: 200, least: 40 };

impl Points {
    /// Points of this kind in the window of a sample.
    fn of(self, sample: &WindowSample) -> Vec<SamplePoint> {
        sample.inside(self.first, self.count(sample))
    }

    fn count(self, sample: &WindowSample) -> usize {
        (4 * self.most / sample.widths().len().max(1)).clamp(self.least, self.most)
    }
}

/// Smallest number of windows that the work limit of a search allows; if a return takes long, each
/// is tried at fewer points.
const WINDOWS: usize = 8;

/// Share of the tolerance for which a window is tried, because it is measured at more points.
const MARGIN: f64 = 0.7;

/// Largest number of octaves by which the natural sizes are scaled down, and halvings of the last
/// one.
///
/// NOTE: a stop 1e-9 beyond the orbit is met by contacts of speed 1e-9 and depth 1e-18.
const DOWN: (i32, usize) = (72, 2);

/// Factors by which bounds are widened one by one.
const WIDER: [f64; 2] = [2.0, 1.4];

/// Largest bound, relative to its natural size.
const WIDEST: f64 = 4.0;

/// Number of decimal digits of a measured bound: the same on every machine.
const DIGITS: u32 = 2;

/// Largest factor of one narrowing of a window that does not hold at all measured points, and the
/// largest number of narrowings.
const NARROWER: (f64, usize) = (0.8, 6);

/// Smallest factor of one narrowing of a window.
const LEAST_NARROWER: f64 = 0.1;

/// Factor from the largest error found to the error stated: ascents end within a fiftieth of a
/// summit.
const SHORT_OF_SUMMIT: f64 = 1.02;

/// Bounds contradict each other if the depth reached is below this share of the window's.
const CONTRADICTION: f64 = 0.5;

/// Narrowed bounds may cause less than this factor of the errors caused by stated bounds alone.
const BESIDE_STATED: f64 = 2.0;

/// Tolerance of a map on its window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WindowTolerance {
    /// Tolerance that the scene states: largest error of a coordinate, in the units of the offsets.
    Error(f64),
    /// Largest error of a coordinate, relative to its half-width.
    Share(f64),
}

impl WindowTolerance {
    /// The tolerance that a scene states, or 1e-6 of each half-width.
    pub fn of(scene: &Scene) -> Self {
        match (scene.expansion.orders, scene.emit.tolerance) {
            (Orders::Tolerance(error), _) | (_, Some(error)) => Self::Error(error),
            (Orders::Fixed(_), None) => Self::Share(DEFAULT_SHARE),
        }
    }

    /// Largest allowed error of each coordinate on a window.
    fn limits(self, window: &MapWindow) -> Vec<f64> {
        let limit = |width: &f64| match self {
            Self::Error(error) => error,
            Self::Share(share) => share * width,
        };
        window.state.iter().map(limit).collect()
    }
}

/// Origin of a bound of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoundOrigin {
    /// The scene states the bound.
    Scene,
    /// The scene states a larger depth; the bound is the radius of convergence of the series in
    /// `y`.
    Radius,
    /// The scene states the depth and leaves this coordinate or parameter open; the bound is as
    /// wide as that depth needs.
    Depth,
    /// The scene leaves the bound open, and it was measured.
    Measured,
    /// The scene leaves the bound open, and there are no contacts to measure it with; the bound is
    /// a share of the natural size.
    Assumed,
}

/// Kind of the quantity that is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoundKind {
    /// The depth `y²`.
    Depth,
    /// A coordinate of the section.
    State,
    /// An active parameter.
    Parameter,
}

/// One bound of a window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowBound {
    /// Kind of the quantity that is bounded.
    pub kind: BoundKind,
    /// Name of the coordinate or parameter; `depth` for the depth.
    pub name: String,
    /// Largest `y²`, or half-width.
    pub value: f64,
    /// Origin of the bound.
    pub origin: BoundOrigin,
}

/// Error of one coordinate of an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoordinateError {
    /// Name of the coordinate.
    pub coordinate: String,
    /// Largest error measured, rounded up to two digits; `None` if an image is not finite or there
    /// is nothing to compare with.
    pub error: Option<f64>,
    /// Tolerance of the coordinate.
    pub limit: f64,
    /// Half-width of the window in this coordinate.
    pub half_width: f64,
    /// Whether the error is that large only on the verge of contact, at depths below a thousandth
    /// of the window's; there it is the square root of the error of the depth.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub verge: bool,
}

impl CoordinateError {
    /// Error divided by the tolerance; infinite if there is no error.
    pub fn excess(&self) -> f64 {
        self.error.map_or(f64::INFINITY, |error| error / self.limit)
    }

    /// Whether the error is within the tolerance.
    pub fn is_within(&self) -> bool {
        self.error.is_some_and(|error| error <= decimal_above(self.limit, DIGITS))
    }
}

/// Window of a map, and its errors on the window by direct simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredWindow {
    /// Tolerance of the map.
    pub tolerance: WindowTolerance,
    /// Bounds of the depth, of each coordinate, of each parameter.
    pub bounds: Vec<WindowBound>,
    /// Largest error of each coordinate.
    pub errors: Vec<CoordinateError>,
    /// Points at which errors were measured, and from which ascents start; `excluded` counts points
    /// of the window for which the map gives an image that does not exist.
    pub sample: SampleSummary,
    /// Largest depth over the half-widths, if it is less than half of the window's depth: the
    /// bounds then contradict each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reached: Option<f64>,
}

impl MeasuredWindow {
    /// Window of a map whose contacts are not expanded; no errors are measured on it.
    pub fn assumed(scene: &Scene, orbit: &GrazingOrbit, local: &LocalMap) -> Self {
        let stated = MapWindow::stated(scene, orbit);
        let origins = stated.bounds().map(|bound| match bound.is_finite() {
            true => BoundOrigin::Scene,
            false => BoundOrigin::Assumed,
        });
        Self {
            tolerance: WindowTolerance::of(scene),
            bounds: named_bounds(local, &local.window, origins),
            errors: Vec::new(),
            sample: SampleSummary { points: 0, excluded: 0 },
            reached: None,
        }
    }

    /// Whether the map keeps its tolerance, and every point of the window has an image.
    pub fn is_kept(&self) -> bool {
        self.sample.excluded == 0 && self.errors.iter().all(CoordinateError::is_within)
    }

    /// Largest error of a coordinate; `None` if an error is not known.
    pub fn largest_error(&self) -> Option<f64> {
        let mut errors = self.errors.iter().map(|error| error.error);
        errors.try_fold(0.0, |largest: f64, error| Some(largest.max(error?)))
    }

    /// Whether a bound was measured.
    pub fn is_measured(&self) -> bool {
        self.bounds.iter().any(|bound| bound.origin == BoundOrigin::Measured)
    }
}

/// Result of [`measure_window`].
#[derive(Clone, Debug)]
pub struct WindowMeasurement {
    /// The window; all bounds are finite.
    pub window: MapWindow,
    /// Bounds and errors of the window.
    pub measured: MeasuredWindow,
    /// Points with their images, to measure other forms of the map with; `None` if no point has an
    /// image to compare with.
    pub images: Option<ExactImages>,
}

/// Measures the window of a map: the bounds that its scene leaves open, and the error inside.
///
/// Stated bounds are kept, except that a depth beyond the radius of convergence is reduced to it.
/// Open bounds are the largest, of the natural shape and then one by one, with which the map keeps
/// its tolerance. If stated bounds prevent that, open bounds are the largest that cause no more
/// than twice the errors of the stated bounds alone. Open bounds have two decimal digits.
///
/// `run` is the map that is measured, in any shape and precision.
///
/// # Errors
///
/// [`ConvergenceError::Analysis`] if direct simulation cannot be set up for the scene.
pub fn measure_window(
    (scene, orbit): (&Scene, &GrazingOrbit),
    local: &LocalMap,
    run: &dyn DiscreteMap,
    natural: &NaturalWindow,
) -> Result<WindowMeasurement, ConvergenceError> {
    let system = HybridSystem::new(&scene.model);
    let sample = WindowSample::new(local);
    let mut search = Search {
        returns: ExactReturns::new(&system, scene, orbit)?,
        spent: AtomicUsize::new(0),
        run,
        tolerance: WindowTolerance::of(scene),
        bounds: Bounds::new(scene, orbit, natural).with_implied(&sample),
        sample,
        least: vec![0.0; local.dimension()],
        skips: false,
    };
    let mut kept = true;
    let mut window = search.bounds.narrowest();
    if search.bounds.are_open() {
        window = match search.largest() {
            Some(window) => window,
            None => {
                kept = false;
                search.allow_stated_errors();
                search.largest().unwrap_or(window)
            }
        };
        window = search.widened(window);
    }
    let measure = |window: &MapWindow| {
        let points = MEASURED.of(&search.sample.resized(window));
        match ExactImages::new(scene, orbit, points) {
            Ok(images) => Ok((Some(images), 0)),
            Err(ConvergenceError::NoTruth { tried }) => Ok((None, tried)),
            Err(error) => Err(error),
        }
    };
    let may_narrow = kept && search.bounds.are_open();
    let mut narrowings = 0..if may_narrow { NARROWER.1 } else { 0 };
    loop {
        let (images, lost) = measure(&window)?;
        let largest = search.largest_errors(&window, images.as_ref());
        let measured = search.measured(local, &window, &largest, images.as_ref(), lost);
        let excess = search.excess(&measured, &largest);
        if excess <= 1.0 || narrowings.next().is_none() {
            return Ok(WindowMeasurement { window, measured, images });
        }
        let factor = match excess.is_finite() {
            true => excess.powf(-0.5).clamp(LEAST_NARROWER, NARROWER.0),
            false => NARROWER.0,
        };
        window = search.bounds.narrower(window, factor);
    }
}

impl MeasuredWindow {
    /// Window with the errors of another form of the map (composed, pruned or in another
    /// precision). Ascents start from the points at which the map was measured; an error is `None`
    /// if an image is not finite.
    ///
    /// # Errors
    ///
    /// [`ConvergenceError::Analysis`] if direct simulation cannot be set up for the scene.
    pub fn of_form(
        &self,
        (scene, orbit): (&Scene, &GrazingOrbit),
        local: &LocalMap,
        form: &dyn DiscreteMap,
        images: &ExactImages,
    ) -> Result<Self, ConvergenceError> {
        let system = HybridSystem::new(&scene.model);
        let returns = ExactReturns::new(&system, scene, orbit)?;
        let sample = WindowSample::new(local);
        let ascents = Ascents { returns: &returns, run: form, sample: &sample };
        let largest = ascents.largest(images);
        let mut window = self.clone();
        for (coordinate, error) in window.errors.iter_mut().enumerate() {
            error.error = claimed(largest.errors[coordinate]);
            error.verge = largest.is_on_verge(coordinate);
        }
        Ok(window)
    }
}

impl ExactImages {
    /// Points of a map's window with their images.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn of_window(
        scene: &Scene,
        orbit: &GrazingOrbit,
        local: &LocalMap,
    ) -> Result<Self, ConvergenceError> {
        Self::new(scene, orbit, MEASURED.of(&WindowSample::new(local)))
    }
}

/// Error stated for a largest error found: larger by the amount that an ascent may end below its
/// summit, and rounded up to two digits, which are the same on machines whose arithmetic differs in
/// the last place. `None` if the error is not finite.
fn claimed(error: f64) -> Option<f64> {
    error.is_finite().then(|| decimal_above(SHORT_OF_SUMMIT * error, DIGITS))
}

/// Bounds of a window: stated values, and natural sizes of the open ones.
#[derive(Clone, Debug)]
struct Bounds<'a> {
    /// Stated bounds; open ones are infinite.
    stated: MapWindow,
    /// Whether the depth that the scene states is beyond the radius.
    cut: bool,
    /// Numbers of the bounds implied by the stated depth.
    implied: Vec<usize>,
    natural: &'a NaturalWindow,
}

impl<'a> Bounds<'a> {
    fn new(scene: &Scene, orbit: &GrazingOrbit, natural: &'a NaturalWindow) -> Self {
        let mut stated = MapWindow::stated(scene, orbit);
        let reach = natural.reach.filter(|_| stated.depth.is_finite());
        let cut = reach.filter(|reach| *reach < stated.depth);
        if let Some(reach) = cut {
            stated.depth = decimal_below(reach, DIGITS);
        }
        Self { stated, cut: cut.is_some(), implied: Vec::new(), natural }
    }

    /// Adds the bounds that the stated depth implies. If no point of the stated half-widths reaches
    /// that depth at a passage, the open variable that moves the depth most becomes as wide as the
    /// depth needs; otherwise no deep point would lie in the window.
    fn with_implied(mut self, sample: &WindowSample) -> Self {
        if !self.stated.depth.is_finite() {
            return self;
        }
        for passage in 0..sample.steepest.len() {
            let (depth, stated) = (self.stated.depth, self.at(0.0));
            let reached = sample.resized(&stated).deepest_of(passage);
            let open = |variable: &usize| {
                self.stated.bounds().nth(variable + 1).is_some_and(f64::is_infinite)
            };
            let natural = sample.resized(&self.at(1.0));
            let variable = natural.by_reach(passage).into_iter().find(open);
            let Some(variable) = variable.filter(|_| reached < depth) else { continue };
            let width = natural.reaches(passage, variable, depth);
            let widest = self.natural.scaled(WIDEST).bounds().nth(variable + 1);
            let width = width.map(|width| decimal_above(width, DIGITS));
            let width = width.filter(|&width| widest.is_some_and(|widest| width <= widest));
            if let (Some(bound), Some(width)) = (self.stated.bounds_mut().nth(variable + 1), width)
            {
                *bound = width;
                self.implied.push(variable + 1);
            }
        }
        self
    }

    /// Whether the scene states any bound.
    fn are_stated(&self) -> bool {
        self.stated.bounds().any(f64::is_finite)
    }

    /// Numbers of the open bounds, the depth last: the depth of points depends on the others.
    fn open(&self) -> Vec<usize> {
        let bounds = self.stated.bounds().enumerate();
        let open = bounds.filter(|(_, bound)| !bound.is_finite()).map(|(number, _)| number);
        let mut open: Vec<usize> = open.collect();
        open.sort_by_key(|&number| (number == 0, number));
        open
    }

    fn are_open(&self) -> bool {
        self.stated.bounds().any(|bound| !bound.is_finite())
    }

    /// Window with its open bounds at this factor of their natural sizes.
    fn at(&self, factor: f64) -> MapWindow {
        let mut window = self.stated.clone();
        let sizes = self.natural.scaled(factor);
        for (bound, size) in window.bounds_mut().zip(sizes.bounds()) {
            if !bound.is_finite() {
                *bound = decimal_below(size, DIGITS);
            }
        }
        window
    }

    fn narrowest(&self) -> MapWindow {
        self.at(f64::from(-DOWN.0).exp2())
    }

    /// Narrows the open bounds of a window.
    fn narrower(&self, mut window: MapWindow, factor: f64) -> MapWindow {
        for (bound, stated) in window.bounds_mut().zip(self.stated.bounds()) {
            if !stated.is_finite() {
                *bound = decimal_below(factor * *bound, DIGITS);
            }
        }
        window
    }

    /// Widens one bound of a window; `None` beyond the largest factor of its natural size or the
    /// radius of convergence.
    fn wider(&self, window: &MapWindow, number: usize, factor: f64) -> Option<MapWindow> {
        let mut wider = window.clone();
        let bound = wider.bounds_mut().nth(number)?;
        *bound = decimal_below(factor * *bound, DIGITS);
        let mut widest = self.natural.scaled(WIDEST);
        widest.depth = self.natural.reach.map_or(widest.depth, |reach| widest.depth.min(reach));
        (*bound <= widest.bounds().nth(number)?).then_some(wider)
    }

    fn origins(&self) -> impl Iterator<Item = BoundOrigin> {
        self.stated.bounds().enumerate().map(|(number, bound)| match (number, bound) {
            (0, _) if self.cut => BoundOrigin::Radius,
            (number, _) if self.implied.contains(&number) => BoundOrigin::Depth,
            (_, f64::INFINITY) => BoundOrigin::Measured,
            _ => BoundOrigin::Scene,
        })
    }
}

/// Bounds of a window of a map, with their names and origins.
fn named_bounds(
    local: &LocalMap,
    window: &MapWindow,
    origins: impl Iterator<Item = BoundOrigin>,
) -> Vec<WindowBound> {
    let kinds = std::iter::once(BoundKind::Depth)
        .chain(std::iter::repeat_n(BoundKind::State, local.dimension()))
        .chain(std::iter::repeat(BoundKind::Parameter));
    let parameters = local.parameters.iter().map(|active| &active.name);
    let names = local.section.coordinates.iter().chain(parameters).cloned();
    let names = std::iter::once("depth".to_owned()).chain(names);
    let bounds = kinds.zip(names).zip(window.bounds().zip(origins));
    bounds
        .map(|((kind, name), (value, origin))| WindowBound { kind, name, value, origin })
        .collect()
}

/// Search for the largest window on which a map keeps its tolerance.
struct Search<'a> {
    returns: ExactReturns<'a>,
    /// Products of series in the images of windows on which the map keeps its tolerance. Other
    /// windows end at the first failure, which depends on the threads, and do not count.
    spent: AtomicUsize,
    run: &'a dyn DiscreteMap,
    sample: WindowSample,
    tolerance: WindowTolerance,
    bounds: Bounds<'a>,
    /// Errors that are allowed in any case, by coordinate.
    least: Vec<f64>,
    /// Whether points without an image are skipped.
    skips: bool,
}

impl Search<'_> {
    /// Largest window of the natural shape on which the map keeps its tolerance.
    fn largest(&self) -> Option<MapWindow> {
        let holds = |octave: f64| self.holds(&self.bounds.at(octave.exp2()));
        let mut octaves = (0..=DOWN.0).map(|octave| f64::from(-octave));
        let first = octaves.find(|&octave| holds(octave))?;
        let octave = match first {
            0.0 => first,
            _ => last_that_holds(first, first + 1.0, DOWN.1, |octave| {
                self.may_go_on() && holds(octave)
            }),
        };
        Some(self.bounds.at(octave.exp2()))
    }

    /// Allows twice the errors that stated bounds cause by themselves, and points without image if
    /// those bounds contain some.
    fn allow_stated_errors(&mut self) {
        let points = self.points(&self.bounds.narrowest());
        let tried = points.len();
        let add =
            |returns: &mut ExactReturns<'_>, point: &SamplePoint| self.errors(returns, point).0;
        let errors = parallel::map_with(&points, || self.returns.clone(), add);
        let errors: Vec<Vec<f64>> = errors.into_iter().flatten().collect();
        self.skips = self.bounds.are_stated() && errors.len() < tried;
        for errors in errors {
            for (least, error) in self.least.iter_mut().zip(errors) {
                *least = least.max(BESIDE_STATED * error);
            }
        }
    }

    /// Widens the open bounds of a window in turn while the map keeps its tolerance; the depth is
    /// no larger than that of its points.
    fn widened(&self, mut window: MapWindow) -> MapWindow {
        let reached = |window: &MapWindow| {
            let sample = self.sample.resized(window);
            sample.deepest_reached(MEASURED.count(&sample))
        };
        for factor in WIDER {
            let mut open = self.bounds.open();
            let mut changed = true;
            while std::mem::take(&mut changed) {
                open.retain(|&number| {
                    if number == 0 && window.depth > reached(&window) {
                        return true;
                    }
                    let wider = self.bounds.wider(&window, number, factor);
                    let wider = wider.filter(|wider| self.may_go_on() && self.holds(wider));
                    changed |= wider.is_some();
                    wider.map(|wider| window = wider).is_some()
                });
            }
        }
        let reached = reached(&window);
        if self.bounds.open().contains(&0) && reached > 0.0 {
            window.depth = window.depth.min(decimal_above(reached, DIGITS));
        }
        window
    }

    fn points(&self, window: &MapWindow) -> Vec<SamplePoint> {
        let points = TRIED.of(&self.sample.resized(window));
        let one_of = self.returns.one_of(points.len(), MOST_PRODUCTS / WINDOWS);
        points.into_iter().step_by(one_of).collect()
    }

    /// Whether the search is below its work limit.
    fn may_go_on(&self) -> bool {
        self.spent.load(Ordering::Relaxed) < MOST_PRODUCTS
    }

    /// Whether the map keeps its tolerance on a window; stops at the first failure.
    fn holds(&self, window: &MapWindow) -> bool {
        let limits = self.tolerance.limits(window);
        let limits: Vec<f64> = limits
            .iter()
            .zip(&self.least)
            .map(|(limit, &least)| least.max(MARGIN * limit))
            .collect();
        let points = self.points(window);
        let meets = |returns: &mut ExactReturns<'_>, point: &SamplePoint| {
            let (errors, products) = self.errors(returns, point);
            let met = match errors {
                Some(errors) => {
                    let within = |least: &[f64]| {
                        let limits = limits.iter().zip(least).map(|(a, b)| a.max(*b));
                        errors.iter().zip(limits).all(|(&error, limit)| error <= limit)
                    };
                    within(&limits) || within(&rounding_of(self.run, point))
                }
                None => self.skips,
            };
            if met { Ok(products) } else { Err(()) }
        };
        let products = parallel::try_map_with(&points, || self.returns.clone(), meets);
        let Ok(products) = products else { return false };
        self.spent.fetch_add(products.iter().sum(), Ordering::Relaxed);
        !points.is_empty()
    }

    /// Errors at a point (`None` without an image to compare with, 0 outside the model), and the
    /// products of series that its image took.
    fn errors(
        &self,
        returns: &mut ExactReturns<'_>,
        point: &SamplePoint,
    ) -> (Option<Vec<f64>>, usize) {
        match returns.image(point) {
            Ok((ExactImage::Known(exact), products)) => {
                (Some(errors(self.run, point, &exact)), products)
            }
            Ok((ExactImage::None, products)) => (None, products),
            Ok((ExactImage::Outside, products)) => {
                (Some(vec![0.0; self.run.dimension()]), products)
            }
            Err(_) => (None, 0),
        }
    }

    /// Largest errors on a window, with ascents from these points.
    fn largest_errors(&self, window: &MapWindow, images: Option<&ExactImages>) -> Largest {
        let sample = self.sample.resized(window);
        let ascents = Ascents { returns: &self.returns, run: self.run, sample: &sample };
        let none = || Largest::none(window.state.len());
        images.map_or_else(none, |images| ascents.largest(images))
    }

    /// Largest error divided by its tolerance; infinite if points have no image.
    ///
    /// NOTE: a share of each half-width, the default tolerance, is not applied on the verge of
    /// contact: windows would be hundreds of times narrower because of a layer as thin as the error
    /// of the depth.
    fn excess(&self, measured: &MeasuredWindow, largest: &Largest) -> f64 {
        if measured.sample.excluded > 0 {
            return f64::INFINITY;
        }
        let errors = match self.tolerance {
            WindowTolerance::Error(_) => &largest.errors,
            WindowTolerance::Share(_) => &largest.off_verge,
        };
        let pairs = errors.iter().zip(&measured.errors);
        let excess = pairs.map(|(&error, measured)| match claimed(error) {
            Some(claim) if claim <= decimal_above(measured.limit, DIGITS) => 0.0,
            Some(claim) => claim / measured.limit,
            None => f64::INFINITY,
        });
        excess.fold(0.0, f64::max)
    }

    /// Report on a window measured at these points, or on one none of whose points has an image.
    fn measured(
        &self,
        local: &LocalMap,
        window: &MapWindow,
        largest: &Largest,
        images: Option<&ExactImages>,
        lost: usize,
    ) -> MeasuredWindow {
        let limits = self.tolerance.limits(window).into_iter().zip(&window.state);
        let errors = local.section.coordinates.iter().enumerate().zip(limits);
        let errors = errors.map(|((number, coordinate), (limit, &half_width))| CoordinateError {
            coordinate: coordinate.clone(),
            error: claimed(largest.errors[number]),
            limit,
            half_width,
            verge: largest.is_on_verge(number),
        });
        let none = SampleSummary { points: 0, excluded: lost };
        let sample = self.sample.resized(window);
        let reached = sample.deepest_reached(MEASURED.count(&sample));
        let contradicts = |&reached: &f64| reached < CONTRADICTION * window.depth;
        MeasuredWindow {
            tolerance: self.tolerance,
            bounds: named_bounds(local, window, self.bounds.origins()),
            errors: errors.collect(),
            sample: images.map_or(none, ExactImages::summary),
            reached: Some(reached.max(0.0)).filter(contradicts),
        }
    }
}
