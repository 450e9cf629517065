//! The map, and the section, chosen for a tolerance: the one with the fewest operations that meets
//! it.
//!
//! The cost of a map is known from its coefficients and its error is forecast from one expansion of
//! higher order, so that only maps that may be the answer are measured. What is expanded and
//! simulated once serves all tolerances. See docs/mathematics/convergence.md.

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

/// What is asked of a choice.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceOptions {
    /// Largest error of a coordinate of one image on the window, in the units of the offsets.
    pub tolerance: f64,
    /// Fresh points on which a map has to hold too.
    pub fresh: usize,
}

impl ChoiceOptions {
    /// A tolerance, tried on a thousand fresh points.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, fresh: 1000 }
    }
}

/// The cheapest map whose error on the window is at most `tolerance`, checked on a thousand fresh
/// points; the most accurate one tried, and [`Choice::met`] `false`, where none is.
///
/// This is what a scene with `expansion.tolerance` gets.
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

/// [`choose_orders`] with the number of fresh points named.
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

/// Degrees and weights that an expansion has beyond the predicted ones: orders can be exchanged for
/// one another, and forecasts and fits need terms beyond what they cut.
const MARGIN: MapOrders = MapOrders::new(1, 2);

/// By how much an expansion grows that was not high enough.
const STEP: MapOrders = MapOrders::new(2, 3);

/// An error that falls by less from one expansion to the next has come to its end.
const FALLS: f64 = 0.5;

/// An error of which truncation is forecast to be less than this share is rounding.
const TRUNCATION: f64 = 0.1;

/// And one of so many roundings of the image.
const ROUNDINGS: f64 = 32.0;

/// A tolerance that is a smaller share of a rounding of the largest image is met by no map in these
/// numbers: the largest of many roundings comes near to a quarter of it at least.
const HOPELESS: f64 = 0.1;

/// A search for the cheapest map that is run in some numbers.
struct Search {
    trial: Trial,
    /// Why the series that were tried do not serve.
    limit: Option<Limit>,
}

impl Search {
    fn new(tolerance: f64, precision: FloatFormat) -> Self {
        Self { trial: Trial::new(tolerance, precision), limit: None }
    }

    /// The map found, or the nearest to the tolerance with what keeps it from it.
    fn end(self) -> Result<Choice, ConvergenceError> {
        let best = self.trial.best();
        let mut choice = best.ok_or(ConvergenceError::NoTruth { tried: 0 })?;
        choice.limit = (!choice.met).then_some(self.limit.unwrap_or(Limit::Orders));
        Ok(choice)
    }
}

/// Chooses maps of one scene.
///
/// ```
/// use grazemap_map::convergence::Chooser;
/// use grazemap_map::model::{Scene, catalogue};
/// use grazemap_map::orbit::locate;
///
/// let text = catalogue::text("linear").expect("in the catalogue");
/// let scene = Scene::parse(text, "linear.toml")?;
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
    /// Highest orders where these do not serve.
    deepest: MapOrders,
    levels: Vec<Level<'a>>,
    /// Whether contacts are flown where no series serves.
    flies: bool,
}

impl<'a> Chooser<'a> {
    /// Expands to low orders and simulates the points that maps are chosen by; `fresh` is the
    /// number of points on which a map has to hold too.
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

    /// The same with orders limited, and contacts flown only if the scene asks for it.
    fn within(mut self, orders: MapOrders) -> Self {
        self.limit = self.limit.min(orders);
        self.deepest = self.limit;
        self.flies = false;
        self
    }

    /// The same, keeping what is measured of candidates; what an earlier run kept is not measured
    /// again.
    pub(super) fn resuming(mut self, progress: &'a dyn Progress) -> Self {
        self.bench.progress = progress;
        self
    }

    /// The rule that searches begin with.
    pub fn rule(&self) -> OrderRule {
        self.levels[0].rule.clone()
    }

    /// Points of the window, from a number of the sequence on: nothing is chosen by those beyond
    /// the first 128 and as many fresh ones as were asked for.
    pub fn points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        self.bench.sample.points(first, count)
    }

    /// Points at which two passages in a row make contact; see
    /// [`WindowSample::joint_points`](super::WindowSample::joint_points).
    pub fn joint_points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        self.bench.sample.joint_points(first, count)
    }

    /// The cheapest map for a tolerance: see [`choose_orders`]. It is judged
    /// in the numbers in which the scene has it run; where that is left open, in single
    /// precision first.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn choose(&mut self, tolerance: f64) -> Result<Choice, ConvergenceError> {
        let clock = Instant::now();
        let found = |search: &Search| search.trial.found().is_some();
        let mut searches = Vec::new();
        for precision in self.precisions(tolerance) {
            let mut search = Search::new(tolerance, precision);
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
            // Series to the highest orders, where those of the first search were too low.
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

    /// The numbers in which a map may be run, the cheapest first; at least one.
    fn precisions(&self, tolerance: f64) -> Vec<FloatFormat> {
        let hopeless = HOPELESS * self.bench.rounding(FloatFormat::F32);
        match self.scene.emit.precision {
            EmitPrecision::Given(format) => vec![format],
            EmitPrecision::Any if tolerance < hopeless => vec![FloatFormat::F64],
            EmitPrecision::Any => vec![FloatFormat::F32, FloatFormat::F64],
        }
    }

    /// Series, and contacts that are flown, to the orders of a first search.
    fn search(&mut self, search: &mut Search) -> Result<(), ConvergenceError> {
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

    /// Expansions from the predicted orders on until a map meets the tolerance; why none does.
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
                // The probe stands for the orders before.
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

    /// Expansions beyond the limit of the first search, from the highest one made on, until a map
    /// meets the tolerance; why none does.
    ///
    /// The error of the most accurate map is taken to fall as the terms of the contacts do.
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

    /// The orders of the next expansion: one step towards those that this one predicts, or of both
    /// factors where it predicts no higher ones.
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

    /// Within the highest orders; at least 2, so that terms can be seen to fall.
    fn clamped(&self, orders: MapOrders) -> MapOrders {
        orders.min(self.limit).max(MapOrders::new(2, 4))
    }

    /// The expansion to some orders; `None` where its coefficients overflow, which ends a search.
    fn finite_level(&mut self, highest: MapOrders) -> Result<Option<usize>, ConvergenceError> {
        match self.level(highest) {
            Err(error) if error.is_overflow() => Ok(None),
            at => at.map(Some),
        }
    }

    /// The expansion to some orders, made once.
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

    /// Maps with flown contacts, no series forecasting what their truncation leaves out: the least
    /// weight that serves with a degree as high, by bisection, then the least degree.
    fn choose_flown(&mut self, trial: &mut Trial) -> Result<(), ConvergenceError> {
        let top = self.limit.smooth_order.min(self.limit.contact_weight);
        let orders = MapOrders::new;
        let asked = self.scene.emit.shape == Shape::Flown;
        let at = match self.level(orders(top, top)) {
            Err(error) if !asked && error.is_overflow() => return Ok(()),
            at => at?,
        };
        let family = &self.levels[at].family;
        // A law that cannot be flown has no flown map to offer; a scene that asks for one gets
        // the error.
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

/// A map is measured where its forecast is within this many times the tolerance.
const SLACK: f64 = 2.0;

/// Further ones are tried where the forecast of their stages is within this many times the
/// tolerance: folding can leave out less than they do.
const COMPOSED_SLACK: f64 = 100.0;

/// An economised one where that of its truncation is: fits gain a factor of 2 to 20.
const GAIN: f64 = 20.0;

/// Maps tried after the first that meets the tolerance: of a dearer one more monomials may be
/// dropped.
const FURTHER: usize = 3;

/// Maps within the slack whose composed form is tried, from the cheapest.
const FEW: usize = 8;

/// So many of them, and of economised maps, from the least forecast.
const LIKELIEST: usize = 24;

/// Most products of coefficients of a composition that is tried where a map serves already: some
/// tenths of a second, and thirty are.
const COMPOSED_PRODUCTS: u128 = 100_000_000;

/// The same where none does.
const LAST_PRODUCTS: u128 = 1_000_000_000;

/// The maps of one expansion that may be the answer: Taylor maps, factored and composed, then
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

/// Of candidates no dearer than one that serves, those of the least forecast.
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

/// Tries candidates until a few after the first that meets the tolerance; the cost of that one.
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
