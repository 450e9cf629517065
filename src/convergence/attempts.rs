//! Which maps of one expansion are measured, and in which order.

use super::ConvergenceError;
use super::candidates::Candidate;
use super::data::Polynomials;
use super::judge::{Bench, Trial};
use super::level::Level;
use crate::model::Shape;

/// A map is measured where its forecast is within this many times the tolerance.
pub(super) const SLACK: f64 = 2.0;

/// Further ones are tried where the forecast of their stages is within this many times the
/// tolerance: folding can leave out less than they do.
pub(super) const COMPOSED_SLACK: f64 = 100.0;

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
pub(super) fn try_level(
    bench: &mut Bench<'_>,
    level: &Level<'_>,
    trial: &mut Trial,
) -> Result<(), ConvergenceError> {
    let shape = bench.scene().emit.shape;
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
            bench.judge(
                level,
                candidate,
                Shape::Factored,
                Polynomials::Taylor,
                trial,
            )
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
            bench.judge(
                level,
                candidate,
                Shape::Composed,
                Polynomials::Taylor,
                trial,
            )
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
