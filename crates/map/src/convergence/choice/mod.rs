//! The map, and the section, chosen for a tolerance: the one with the fewest operations that meets
//! it.
//!
//! The cost of a map is known from its coefficients, and its error is forecast from one expansion
//! of higher order. Only maps that may be the answer are measured. One expansion and one simulation
//! serve all tolerances. See docs/mathematics/convergence.md.

mod candidates;
mod data;
mod economise;
mod forecast;
mod judge;
mod next_depth;
mod sections;

use std::time::Instant;

use super::ConvergenceError;
use super::family::{MapFamily, PROBE};
use super::sample::SamplePoint;
use crate::analysis::Progress;
use crate::expansion::MapOrders;
use crate::model::{EmitPrecision, Scene, Shape};
use crate::numeric::FloatFormat;
use crate::orbit::GrazingOrbit;
use candidates::{Candidate, Level, highest_orders};
use judge::{Bench, Trial};

pub(super) use data::Form;
pub use data::{Choice, Limit, Monomials, Polynomials, chosen_map};
pub use forecast::{Decay, OrderRule};
pub use next_depth::LeastOrders;
pub use sections::{SectionChoice, SectionVerdict, SettledScene, choose_sections, settle_section};

/// Settings of a choice.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceOptions {
    /// Largest error of a coordinate of one image on the window, in the units of the offsets.
    pub tolerance: f64,
    /// Number of fresh points on which a map also has to meet the tolerance.
    pub fresh: usize,
}

impl ChoiceOptions {
    /// A tolerance, checked on a thousand fresh points.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, fresh: 1000 }
    }
}

/// The cheapest map whose error on the window is at most `tolerance`, checked on a thousand fresh
/// points. If there is none, the result is the most accurate map tried, and [`Choice::met`] is
/// `false`.
///
/// A scene with `expansion.tolerance` uses this choice.
///
/// # Errors
///
/// [`ConvergenceError`] if the scene cannot be expanded, or its window has no point to compare at.
pub fn choose_orders(
    scene: &Scene,
    orbit: &GrazingOrbit,
    tolerance: f64,
) -> Result<Choice, ConvergenceError> {
    choose(scene, orbit, &ChoiceOptions::new(tolerance))
}

/// Chooses as [`choose_orders`], with a given number of fresh points.
///
/// # Errors
///
/// As [`choose_orders`].
pub fn choose(
    scene: &Scene,
    orbit: &GrazingOrbit,
    options: &ChoiceOptions,
) -> Result<Choice, ConvergenceError> {
    Chooser::new(scene, orbit, options.fresh)?.choose(options.tolerance)
}

/// Degrees and weights of an expansion beyond the predicted ones: orders can be exchanged for one
/// another, and forecasts and fits need terms beyond the truncation.
const MARGIN: MapOrders = MapOrders::new(1, 2);

/// Step by which the orders of an insufficient expansion grow.
const STEP: MapOrders = MapOrders::new(2, 3);

/// An error that falls by a smaller factor from one expansion to the next has reached its limit.
const FALLS: f64 = 0.5;

/// An error is rounding if the forecast truncation error is less than this share of it.
const TRUNCATION: f64 = 0.1;

/// An error is also rounding if it is within this number of roundings of the image.
const ROUNDINGS: f64 = 32.0;

/// A tolerance below this share of the rounding of the largest image is met by no map in that
/// precision: the largest of many roundings is at least about a quarter of it.
const HOPELESS: f64 = 0.1;

/// A search for the cheapest map that runs in a given precision.
struct ChoiceSearch {
    trial: Trial,
    /// Reason why the series that were tried do not meet the tolerance.
    limit: Option<Limit>,
}

impl ChoiceSearch {
    fn new(tolerance: f64, precision: FloatFormat) -> Self {
        Self { trial: Trial::new(tolerance, precision), limit: None }
    }

    /// The map found, or the one nearest to the tolerance with the reason why none meets it.
    fn end(self) -> Result<Choice, ConvergenceError> {
        let best = self.trial.best();
        let mut choice = best.ok_or(ConvergenceError::NoTruth { tried: 0 })?;
        choice.limit = (!choice.met).then_some(self.limit.unwrap_or(Limit::Orders));
        Ok(choice)
    }
}

/// Chooses maps of one scene for any tolerance.
///
/// ```
/// use grazemap_map::convergence::Chooser;
/// use grazemap_map::model::Scene;
/// use grazemap_map::orbit::locate;
///
/// let scene = Scene::of_catalogue("linear")?;
/// let orbit = locate(&scene)?.into_result()?;
/// let mut chooser = Chooser::new(&scene, &orbit, 100)?;
/// let [coarse, fine] = [1e-3, 1e-6].map(|tolerance| chooser.choose(tolerance));
/// assert!(coarse?.operations < fine?.operations);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Chooser<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    bench: Bench<'a>,
    /// Highest orders of the first search.
    limit: MapOrders,
    /// Highest orders of a second search, if the first fails.
    deepest: MapOrders,
    levels: Vec<Level<'a>>,
    /// Whether contacts are flown if no series meets the tolerance.
    flies: bool,
}

impl<'a> Chooser<'a> {
    /// Expands to low orders and simulates the points that maps are chosen by; `fresh` is the
    /// number of points on which a map also has to meet the tolerance.
    ///
    /// # Errors
    ///
    /// [`ConvergenceError`] if the scene cannot be expanded, or its window has no point to compare
    /// at.
    pub fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        fresh: usize,
    ) -> Result<Self, ConvergenceError> {
        let family = MapFamily::new(scene, orbit, PROBE)?;
        let bench = Bench::new(scene, orbit, &family.map(PROBE)?, fresh)?;
        let probe = Level::new(family, &bench.forecast_points)?;
        let [limit, deepest] = highest_orders(probe.family.expander().variables());
        Ok(Self { scene, orbit, bench, limit, deepest, levels: vec![probe], flies: true })
    }

    /// Limits the orders; contacts are flown only if the scene requests it.
    fn within(mut self, orders: MapOrders) -> Self {
        self.limit = self.limit.min(orders);
        self.deepest = self.limit;
        self.flies = false;
        self
    }

    /// Keeps measurements of candidates, and reuses those that an earlier run kept.
    pub(super) fn resuming(mut self, progress: &'a dyn Progress) -> Self {
        self.bench.progress = progress;
        self
    }

    /// Rule with which searches begin.
    pub fn rule(&self) -> OrderRule {
        self.levels[0].rule.clone()
    }

    /// Points of the window, from a number of the sequence on. Points beyond the first 128 and the
    /// requested number of fresh ones are not used for any choice.
    pub fn points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        self.bench.sample.points(first, count)
    }

    /// Joint points of two passages in a row; see
    /// [`WindowSample::joint_points`](super::WindowSample::joint_points).
    pub fn joint_points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        self.bench.sample.joint_points(first, count)
    }

    /// Cheapest map for a tolerance; see [`choose_orders`]. The map is judged in the precision that
    /// the scene states; if it states none, in single precision first.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn choose(&mut self, tolerance: f64) -> Result<Choice, ConvergenceError> {
        let clock = Instant::now();
        let found = |search: &ChoiceSearch| search.trial.found().is_some();
        let mut searches = Vec::new();
        for precision in self.precisions(tolerance) {
            let mut search = ChoiceSearch::new(tolerance, precision);
            self.search(&mut search)?;
            searches.push(search);
            if searches.iter().any(found) {
                break;
            }
        }
        for at in 0..searches.len() {
            if searches.iter().any(found) {
                break;
            }
            // Series to the highest orders, if those of the first search were too low.
            let search = &mut searches[at];
            if search.limit == Some(Limit::Orders) {
                search.limit = self.choose_deeper(&mut search.trial)?;
            }
        }
        let at = searches.iter().position(found);
        let search = searches.swap_remove(at.unwrap_or(searches.len() - 1));
        let mut choice = search.end()?;
        choice.predicted = self.rule().orders(tolerance);
        choice.seconds = clock.elapsed().as_secs_f64();
        Ok(choice)
    }

    /// Precisions in which a map may run, the cheapest first; at least one.
    fn precisions(&self, tolerance: f64) -> Vec<FloatFormat> {
        let hopeless = HOPELESS * self.bench.rounding(FloatFormat::F32);
        match self.scene.emit.precision {
            EmitPrecision::Given(format) => vec![format],
            EmitPrecision::Any if tolerance < hopeless => vec![FloatFormat::F64],
            EmitPrecision::Any => vec![FloatFormat::F32, FloatFormat::F64],
        }
    }

    /// Tries series, and contacts that are flown, up to the orders of a first search.
    fn search(&mut self, search: &mut ChoiceSearch) -> Result<(), ConvergenceError> {
        let shape = self.scene.emit.shape;
        if shape != Shape::Flown {
            search.limit = self.choose_series(&mut search.trial)?;
        }
        let serves = search.trial.found().is_some();
        match shape {
            Shape::Flown => self.choose_flown(&mut search.trial),
            Shape::Auto if self.flies && !serves => self.choose_flown(&mut search.trial),
            _ => Ok(()),
        }
    }

    /// Expands from the predicted orders on until a map meets the tolerance; returns the reason if
    /// none does.
    fn choose_series(&mut self, trial: &mut Trial) -> Result<Option<Limit>, ConvergenceError> {
        let rounding = self.bench.rounding(trial.precision);
        let reachable = trial.tolerance.max(rounding);
        let predicted = self.rule().orders(reachable);
        let least = self.bench.least_orders();
        let mut highest =
            self.clamped(least.map_or(predicted, |l| l.raised(predicted)).plus(MARGIN));
        let slack = match self.scene.emit.shape {
            Shape::Factored => SLACK,
            _ => COMPOSED_SLACK,
        };
        let mut last = f64::INFINITY;
        loop {
            let Some(at) = self.finite_level(highest)? else {
                // The probe replaces the expansion that overflowed.
                try_level(&mut self.bench, &self.levels[0], trial)?;
                return Ok(Some(Limit::Orders).filter(|_| trial.found().is_none()));
            };
            let level = &self.levels[at];
            let remainder = level.remainder();
            let next = self.next(level, reachable);
            if remainder <= slack * reachable || next == highest {
                try_level(&mut self.bench, level, trial)?;
                if trial.found().is_some() {
                    return Ok(None);
                }
                let error = trial.nearest_error();
                let ended = error > FALLS * last;
                if ended || next == highest {
                    let rounded = error <= ROUNDINGS * rounding;
                    return Ok(Some(match level.rule.converges() {
                        false => Limit::Radius,
                        true if rounded || remainder < TRUNCATION * error => Limit::Rounding,
                        true => Limit::Orders,
                    }));
                }
                last = error;
            }
            highest = next;
        }
    }

    /// Expands beyond the limit of the first search, from the highest expansion made, until a map
    /// meets the tolerance; returns the reason if none does.
    ///
    /// The error of the most accurate map is assumed to fall as the terms of the contacts do.
    fn choose_deeper(&mut self, trial: &mut Trial) -> Result<Option<Limit>, ConvergenceError> {
        let reachable = trial.tolerance.max(self.bench.rounding(trial.precision));
        let weight = |level: &&Level<'_>| level.family.highest().contact_weight;
        let Some(top) = self.levels.iter().max_by_key(weight) else {
            return Ok(Some(Limit::Orders));
        };
        let (mut here, mut contacts) = (top.family.highest(), top.rule.contacts.clone());
        let mut error = trial.nearest_error();
        while here.contact_weight < self.deepest.contact_weight {
            let steps = (error / reachable).ln() / -contacts.ratio.ln();
            let further = (steps.ceil() as u32).max(STEP.contact_weight);
            here.contact_weight = (here.contact_weight + further).min(self.deepest.contact_weight);
            let Some(at) = self.finite_level(here)? else {
                return Ok(Some(Limit::Orders));
            };
            let level = &self.levels[at];
            try_level(&mut self.bench, level, trial)?;
            if trial.found().is_some() {
                return Ok(None);
            }
            let last = std::mem::replace(&mut error, trial.nearest_error());
            if error > FALLS * last {
                let rounded = error <= ROUNDINGS * self.bench.rounding(trial.precision);
                return Ok(Some(if rounded { Limit::Rounding } else { Limit::Orders }));
            }
            contacts = level.rule.contacts.clone();
        }
        Ok(Some(Limit::Orders))
    }

    /// Orders of the next expansion: one step towards those that this expansion predicts, or a step
    /// of both factors if it predicts no higher ones.
    fn next(&self, level: &Level<'_>, tolerance: f64) -> MapOrders {
        let here = level.family.highest();
        let predicted = level.rule.orders(tolerance);
        let legs = predicted.smooth_order > here.smooth_order;
        let contacts = predicted.contact_weight > here.contact_weight;
        let grown = |grows: bool, order: u32, step: u32| order + if grows { step } else { 0 };
        self.clamped(MapOrders {
            smooth_order: grown(legs || !contacts, here.smooth_order, STEP.smooth_order),
            contact_weight: grown(contacts || !legs, here.contact_weight, STEP.contact_weight),
        })
    }

    /// Clamps orders to the highest ones; at least 2, so that terms can be seen to fall.
    fn clamped(&self, orders: MapOrders) -> MapOrders {
        orders.min(self.limit).max(MapOrders::new(2, 4))
    }

    /// The expansion to some orders; `None` if its coefficients overflow, which ends a search.
    fn finite_level(&mut self, highest: MapOrders) -> Result<Option<usize>, ConvergenceError> {
        match self.level(highest) {
            Err(error) if error.is_overflow() => Ok(None),
            at => at.map(Some),
        }
    }

    /// Number of the expansion to some orders, which is made once.
    fn level(&mut self, highest: MapOrders) -> Result<usize, ConvergenceError> {
        let made = |level: &Level<'_>| level.family.highest() == highest;
        if let Some(at) = self.levels.iter().position(made) {
            return Ok(at);
        }
        let families: Vec<_> = self.levels.iter().map(|level| &level.family).collect();
        let family = MapFamily::sharing(self.scene, self.orbit, highest, &families)?;
        let level = Level::new(family, &self.bench.forecast_points)?;
        self.levels.push(level);
        Ok(self.levels.len() - 1)
    }

    /// Tries maps with flown contacts, whose truncation error no series forecasts: finds by
    /// bisection the lowest weight that meets the tolerance with a degree as high, then lowers the
    /// degree and the weight separately.
    fn choose_flown(&mut self, trial: &mut Trial) -> Result<(), ConvergenceError> {
        let top = self.limit.smooth_order.min(self.limit.contact_weight);
        let orders = MapOrders::new;
        let asked = self.scene.emit.shape == Shape::Flown;
        let at = match self.level(orders(top, top)) {
            Err(error) if !asked && error.is_overflow() => return Ok(()),
            at => at?,
        };
        let family = &self.levels[at].family;
        // A law that cannot be flown has no flown map; a scene that requests one gets the error.
        match family.flown_map(orders(1, 2)) {
            Err(error) if !asked && error.is_not_flown() => return Ok(()),
            map => map?,
        };
        let bench = &mut self.bench;
        let least = bench.least_orders();
        let mut meets = |smooth_order: u32, contact_weight: u32| {
            if least.is_some_and(|least| !least.allow(orders(smooth_order, contact_weight))) {
                return Ok::<_, ConvergenceError>(false);
            }
            match family.flown_map(orders(smooth_order, contact_weight)) {
                Ok(map) => bench.judge_flown(map, trial),
                Err(error) if error.is_not_flown() => Ok(false),
                Err(error) => Err(error.into()),
            }
        };
        let (mut fails, mut serves) = (1, 2);
        while !meets(serves, serves)? {
            if serves == top {
                return Ok(());
            }
            (fails, serves) = (serves, (2 * serves).min(top));
        }
        while serves - fails > 1 {
            let middle = (fails + serves) / 2;
            if meets(middle, middle)? {
                serves = middle;
            } else {
                fails = middle;
            }
        }
        for degree in (1..serves).rev() {
            if !meets(degree, serves)? {
                break;
            }
        }
        for weight in (2..serves).rev() {
            if !meets(serves, weight)? {
                break;
            }
        }
        Ok(())
    }
}

/// A map is measured if its forecast is within this multiple of the tolerance.
const SLACK: f64 = 2.0;

/// Composed maps are also tried if the forecast of their stages is within this multiple of the
/// tolerance: composition can have a smaller truncation error than its stages.
const COMPOSED_SLACK: f64 = 100.0;

/// An economised map is tried if the forecast of its truncation is within this multiple of the
/// tolerance: fits gain a factor of 2 to 20.
const GAIN: f64 = 20.0;

/// Number of maps tried after the first that meets the tolerance: more monomials may be dropped
/// from a more expensive one.
const FURTHER: usize = 3;

/// Number of maps within the slack, from the cheapest, whose composed form is tried.
const FEW: usize = 8;

/// Number of composed and of economised maps tried, from the lowest forecast.
const LIKELIEST: usize = 24;

/// Largest number of products of coefficients in a composition that is tried once a map meets the
/// tolerance: some tenths of a second each, for thirty of them.
const COMPOSED_PRODUCTS: u128 = 100_000_000;

/// Largest number of products of coefficients in a composition that is tried while no map meets the
/// tolerance.
const LAST_PRODUCTS: u128 = 1_000_000_000;

/// Tries the maps of one expansion that may be the answer: Taylor maps, factored and composed, then
/// economised ones that are cheaper than the cheapest of them.
fn try_level(
    bench: &mut Bench<'_>,
    level: &Level<'_>,
    trial: &mut Trial,
) -> Result<(), ConvergenceError> {
    let shape = bench.scene.emit.shape;
    let tolerance = trial.tolerance;
    let least = bench.least_orders();
    let likely = |slack: f64| {
        let bound = slack * tolerance;
        let allowed = move |candidate: &&Candidate| {
            candidate.forecast <= bound && least.is_none_or(|least| least.allow(candidate.orders))
        };
        level.candidates.iter().filter(allowed)
    };
    let taylor: Vec<&Candidate> = likely(SLACK).collect();
    let mut most = (usize::MAX, usize::MAX);
    if shape != Shape::Composed {
        most = try_all(&taylor, |candidate| {
            bench.judge(level, candidate, Shape::Factored, Polynomials::Taylor, trial)
        })?;
    }
    let most_products = match trial.found() {
        _ if shape == Shape::Composed => u128::MAX,
        Some(_) => COMPOSED_PRODUCTS,
        None => LAST_PRODUCTS,
    };
    let small = |candidate: &&Candidate| level.products(candidate) <= most_products;
    if shape != Shape::Factored {
        let mut judge = |candidate: &Candidate| {
            bench.judge(level, candidate, Shape::Composed, Polynomials::Taylor, trial)
        };
        let few: Vec<_> = likely(SLACK).filter(small).take(FEW).collect();
        let found = try_all(&few, &mut judge)?;
        for candidate in likeliest(likely(COMPOSED_SLACK).filter(small), found) {
            judge(candidate)?;
        }
        most = most.min(found);
    }
    let fitted = likeliest(likely(GAIN), most);
    let shapes = [Shape::Factored, Shape::Composed].into_iter();
    for of in shapes.filter(|&of| shape == Shape::Auto || shape == of) {
        let few = fitted.iter().copied();
        for candidate in few.filter(|candidate| of == Shape::Factored || small(candidate)) {
            bench.judge(level, candidate, of, Polynomials::Economised, trial)?;
        }
    }
    Ok(())
}

/// Candidates with the lowest forecasts, among those no more expensive than `most`.
fn likeliest<'c>(
    candidates: impl Iterator<Item = &'c Candidate>,
    most: (usize, usize),
) -> Vec<&'c Candidate> {
    let cheaper = candidates.filter(|candidate| candidate.cost <= most);
    let mut cheaper: Vec<_> = cheaper.collect();
    cheaper.sort_by(|a, b| a.forecast.total_cmp(&b.forecast));
    cheaper.truncate(LIKELIEST);
    cheaper
}

/// Tries candidates until a few after the first that meets the tolerance; returns the cost of that
/// one.
fn try_all(
    candidates: &[&Candidate],
    mut judge: impl FnMut(&Candidate) -> Result<bool, ConvergenceError>,
) -> Result<(usize, usize), ConvergenceError> {
    let mut first = None;
    for (number, candidate) in candidates.iter().enumerate() {
        if first.is_some_and(|first| number > first + FURTHER) {
            break;
        }
        if judge(candidate)? && first.is_none() {
            first = Some(number);
        }
    }
    Ok(first.map_or((usize::MAX, usize::MAX), |first| candidates[first].cost))
}
