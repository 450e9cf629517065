//! Dropping monomials that the tolerance does not need.
//!
//! A term contributes at most `|c| Π b_i^{e_i}` where `b` bounds the variables. The smallest terms
//! of each coordinate are dropped while the sum of their contributions, amplified by the stages
//! that follow, stays below the share of the tolerance. Nothing is dropped before a contact (the
//! root amplifies without bound), from a depth, or where the window is unbounded.

use std::collections::BTreeMap;

use super::{ComposedMap, Contact, DepthPolynomial, Leg, LocalMap, Stage};
use crate::jet::Jet;

/// The part of the tolerance that dropped monomials may use.
const SHARE: f64 = 0.1;

/// What was dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PruneReport {
    /// Monomials dropped.
    pub dropped: usize,
    /// Monomials kept.
    pub kept: usize,
    /// Bound of the error that this adds to a coordinate of the image, on the window.
    pub bound: f64,
}

/// The map without the monomials that a tolerance (absolute, per coordinate of the image) does not
/// need.
pub fn prune(map: &LocalMap, tolerance: f64) -> (LocalMap, PruneReport) {
    let mut pruned = map.clone();
    let mut report = PruneReport::default();
    let bounds = stage_bounds(map);
    let mut amplification = 1.0;
    let share = SHARE * tolerance / map.stages.len().max(1) as f64;
    for (stage, bounds) in pruned.stages.iter_mut().zip(&bounds).rev() {
        let budget = share / amplification;
        let next = amplification * lipschitz(stage, bounds, map.dimension());
        let before = report.bound;
        let mut lost = 0.0f64;
        match stage {
            Stage::Leg(Leg { image }) => {
                for jet in image {
                    lost = lost.max(drop_smallest(&mut [(jet, 1.0)], bounds, budget, &mut report));
                }
            }
            Stage::Flown(flown) => {
                report.kept += flown.polynomials().map(Jet::nonzero).sum::<usize>()
            }
            Stage::Contact(Contact { depth, linear, quadratic, depth_form }) => {
                *depth_form = None;
                report.kept += depth.nonzero();
                lost = drop_contact(
                    linear,
                    quadratic,
                    bounds,
                    map.window.depth,
                    0.5 * budget,
                    &mut report,
                );
            }
        }
        report.bound = before + if lost > 0.0 { lost * amplification } else { 0.0 };
        amplification = next;
    }
    (pruned, report)
}

/// The composed form without the monomials that a tolerance does not need.
pub fn prune_composed(
    map: &LocalMap,
    composed: &ComposedMap,
    tolerance: f64,
) -> (ComposedMap, PruneReport) {
    let mut pruned = composed.clone();
    let mut report = PruneReport {
        kept: composed.depths.iter().map(DepthPolynomial::coefficients).sum(),
        ..PruneReport::default()
    };
    let bounds = [map.window.state.as_slice(), &map.window.parameter].concat();
    for polynomial in &mut pruned.image {
        let mut classes: BTreeMap<Vec<u8>, Vec<(&mut Jet<f64>, f64)>> = BTreeMap::new();
        for term in &mut polynomial.terms {
            let degree: i32 = term.powers.iter().map(|&power| i32::from(power)).sum();
            let factor = map.window.depth.sqrt().powi(degree);
            let class = term.powers.iter().map(|&power| folded(power)).collect();
            let parts = classes.entry(class).or_default();
            parts.push((&mut term.coefficient, factor));
        }
        let budget = SHARE * tolerance / classes.len() as f64;
        let lost = classes
            .values_mut()
            .fold(0.0, |lost, parts| lost + drop_smallest(parts, &bounds, budget, &mut report));
        report.bound = report.bound.max(lost);
    }
    (pruned, report)
}

/// The power of a depth variable that is left once its square is the depth, but for the first: what
/// shares a budget.
fn folded(power: u8) -> u8 {
    match power {
        0 => 0,
        _ => 2 - power % 2,
    }
}

/// Drops from both polynomials of a contact; the largest contribution lost.
fn drop_contact(
    linear: &mut [Jet<f64>],
    quadratic: &mut [Jet<f64>],
    bounds: &[f64],
    depth: f64,
    budget: f64,
    report: &mut PruneReport,
) -> f64 {
    let mut lost = 0.0f64;
    for (linear, quadratic) in linear.iter_mut().zip(quadratic) {
        let first = drop_smallest(&mut [(linear, depth.sqrt())], bounds, budget, report);
        let second = drop_smallest(&mut [(quadratic, depth)], bounds, budget, report);
        lost = lost.max(first + second);
    }
    lost
}

/// Of polynomials, each with what it is multiplied by, drops the smallest terms while their sum
/// stays within the budget; the sum.
fn drop_smallest(
    parts: &mut [(&mut Jet<f64>, f64)],
    bounds: &[f64],
    budget: f64,
    report: &mut PruneReport,
) -> f64 {
    let mut contributions: Vec<(f64, usize, usize)> = Vec::new();
    for (part, (jet, factor)) in parts.iter().enumerate() {
        let terms = jet.terms().enumerate();
        let nonzero = terms.filter(|&(_, (_, coefficient))| coefficient != 0.0);
        contributions.extend(nonzero.map(|(number, (exponents, coefficient))| {
            let size = factor * contribution(exponents, coefficient, bounds);
            (size, part, number)
        }));
    }
    contributions.sort_by(|left, right| left.0.total_cmp(&right.0));
    let mut lost = 0.0;
    let mut dropped = 0;
    for &(size, part, number) in &contributions {
        if lost + size > budget {
            break;
        }
        lost += size;
        parts[part].0.coefficients_mut()[number] = 0.0;
        dropped += 1;
    }
    report.dropped += dropped;
    report.kept += contributions.len() - dropped;
    lost
}

fn contribution(exponents: &[u8], coefficient: f64, bounds: &[f64]) -> f64 {
    let powers =
        exponents.iter().zip(bounds).map(|(&exponent, bound)| bound.powi(i32::from(exponent)));
    coefficient.abs() * powers.product::<f64>()
}

/// Bound of a polynomial where every variable stays within its bound.
fn magnitude(jet: &Jet<f64>, bounds: &[f64]) -> f64 {
    let nonzero = jet.terms().filter(|&(_, coefficient)| coefficient != 0.0);
    nonzero.map(|(exponents, coefficient)| contribution(exponents, coefficient, bounds)).sum()
}

/// Bounds of (coordinates; parameters) in front of every stage.
fn stage_bounds(map: &LocalMap) -> Vec<Vec<f64>> {
    let mut bounds = [map.window.state.as_slice(), &map.window.parameter].concat();
    let (mut all, y) = (Vec::with_capacity(map.stages.len()), map.window.depth.sqrt());
    for stage in &map.stages {
        all.push(bounds.clone());
        let next: Vec<f64> = match stage {
            Stage::Leg(leg) => leg.image.iter().map(|jet| magnitude(jet, &bounds)).collect(),
            Stage::Flown(flown) => {
                let corrections = flown.largest_corrections().iter();
                let pairs = corrections.zip(&bounds);
                pairs.map(|(correction, bound)| bound + correction).collect()
            }
            Stage::Contact(contact) => {
                let corrections = contact.linear.iter().zip(&contact.quadratic);
                let sizes = corrections
                    .map(|(l, q)| y * magnitude(l, &bounds) + y * y * magnitude(q, &bounds));
                sizes.zip(&bounds).map(|(correction, bound)| bound + correction).collect()
            }
        };
        bounds[..next.len()].copy_from_slice(&next);
    }
    all
}

/// Bound of how much a stage enlarges a difference of states (largest coordinate).
fn lipschitz(stage: &Stage, bounds: &[f64], dimension: usize) -> f64 {
    let Stage::Leg(leg) = stage else {
        return f64::INFINITY;
    };
    let row = |jet: &Jet<f64>| -> f64 {
        (0..dimension).map(|j| derivative_magnitude(jet, j, bounds)).sum()
    };
    leg.image.iter().map(row).fold(0.0, f64::max)
}

fn derivative_magnitude(jet: &Jet<f64>, variable: usize, bounds: &[f64]) -> f64 {
    let nonzero = jet
        .terms()
        .filter(|&(exponents, coefficient)| coefficient != 0.0 && exponents[variable] > 0);
    let sizes = nonzero.map(|(exponents, coefficient)| {
        let mut lowered = exponents.to_vec();
        lowered[variable] -= 1;
        f64::from(exponents[variable]) * contribution(&lowered, coefficient, bounds)
    });
    sizes.sum()
}
