//! Removal of monomials that the tolerance does not need, and of those that are only rounding.
//!
//! A term contributes at most `|c| Π b_i^{e_i}`, with `b` the bounds of the variables. The smallest
//! terms of each coordinate are dropped while the sum of their contributions, amplified by the
//! stages that follow, stays below the share of the tolerance. Nothing is dropped before a contact
//! (the root amplifies without bound), from a depth, or if the window is unbounded.

use std::collections::BTreeMap;
use std::iter;
use std::sync::Arc;

use super::composition::{ComposedMap, DepthPolynomial};
use super::local_map::{Contact, Leg, LocalMap, Stage};
use crate::jet::Jet;
use crate::numeric::{Dd, Scalar};

/// Share of the tolerance that dropped monomials may use.
const SHARE: f64 = 0.1;

/// Numbers of monomials dropped and kept, and the error that this adds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PruneReport {
    /// Number of monomials dropped.
    pub dropped: usize,
    /// Number of monomials kept.
    pub kept: usize,
    /// Bound of the error added to a coordinate of the image, on the window.
    pub bound: f64,
}

/// Removes monomials of a map that a tolerance (absolute, per coordinate of the image) does not
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
            Stage::Contact(Contact { depth, linear, quadratic, powers, depth_form }) => {
                *depth_form = None;
                report.kept += powers.polynomials().map(Jet::nonzero).sum::<usize>();
                report.kept += depth.nonzero();
                let (budget, depth) = (0.5 * budget, map.window.depth);
                for (linear, quadratic) in linear.iter_mut().zip(quadratic) {
                    let linear = &mut [(linear, depth.sqrt())];
                    let first = drop_smallest(linear, bounds, budget, &mut report);
                    let quadratic = &mut [(quadratic, depth)];
                    let second = drop_smallest(quadratic, bounds, budget, &mut report);
                    lost = lost.max(first + second);
                }
            }
        }
        report.bound = before + if lost > 0.0 { lost * amplification } else { 0.0 };
        amplification = next;
    }
    (pruned, report)
}

/// Removes monomials of the composed form that a tolerance does not need.
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
    let exponents = composed.depth_variables();
    let exponents = exponents.map(|(_, exponent)| exponent.map(|exponent| exponent.to_f64()));
    let exponents: Vec<Option<f64>> = exponents.collect();
    for polynomial in &mut pruned.image {
        let mut classes: BTreeMap<Vec<u8>, Vec<(&mut Jet<f64>, f64)>> = BTreeMap::new();
        for term in &mut polynomial.terms {
            let powers = || term.powers.iter().zip(&exponents);
            let whole = powers().filter(|(_, exponent)| exponent.is_none());
            let degree: i32 = whole.map(|(&power, _)| i32::from(power)).sum();
            let own =
                powers().filter_map(|(&power, exponent)| Some(f64::from(power) * (*exponent)?));
            let y = map.window.depth.sqrt();
            let factor = own.fold(y.powi(degree), |factor, exponent| factor * y.powf(exponent));
            let class = powers().map(|(&power, exponent)| match exponent {
                None => folded(power),
                Some(_) => power,
            });
            let class = class.collect();
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

/// Power of a depth variable that remains if all its squares but the first are replaced by the
/// depth; terms with equal remaining powers share a budget.
fn folded(power: u8) -> u8 {
    match power {
        0 => 0,
        _ => 2 - power % 2,
    }
}

/// Drops the smallest terms of polynomials, each given with its factor, while their sum stays
/// within the budget; returns the sum.
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

/// Size of a monomial in variables of given sizes.
pub(super) fn monomial_size(exponents: &[u8], sizes: &[f64]) -> f64 {
    let powers = exponents.iter().zip(sizes);
    powers.map(|(&exponent, size)| size.powi(i32::from(exponent))).product()
}

fn contribution(exponents: &[u8], coefficient: f64, bounds: &[f64]) -> f64 {
    coefficient.abs() * monomial_size(exponents, bounds)
}

/// Bound of a polynomial with every variable within its bound.
fn magnitude(jet: &Jet<f64>, bounds: &[f64]) -> f64 {
    let nonzero = jet.terms().filter(|&(_, coefficient)| coefficient != 0.0);
    nonzero.map(|(exponents, coefficient)| contribution(exponents, coefficient, bounds)).sum()
}

/// Bounds of (coordinates; parameters) before every stage.
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
                let powers = contact.powers.with_exponents();
                let powers = powers
                    .map(|(exponent, term)| (y.powf(exponent), &term.linear, &term.quadratic));
                let terms = std::iter::once((1.0, &contact.linear, &contact.quadratic));
                let mut next = bounds[..contact.linear.len()].to_vec();
                for (factor, linear, quadratic) in terms.chain(powers) {
                    for (bound, (l, q)) in next.iter_mut().zip(linear.iter().zip(quadratic)) {
                        let (l, q) = (magnitude(l, &bounds), magnitude(q, &bounds));
                        *bound += factor * y * (l + y * q);
                    }
                }
                next
            }
        };
        bounds[..next.len()].copy_from_slice(&next);
    }
    all
}

/// Bound on the factor by which a stage enlarges a difference of states (largest coordinate).
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

/// Coefficients below this share of those compared with are rounding. Double-double has 2^-104,
/// 5e-32, and expansions lose a digit or two of it; a double's rounding, 1e-16, is far above.
const ROUNDING: f64 = 1e-28;

/// Sizes of the variables, which make coefficients comparable.
#[derive(Clone, Debug)]
pub(super) struct Sizes {
    /// Size of the depth variable.
    pub(super) depth: f64,
    /// Sizes of the coordinates, then of the parameters.
    pub(super) variables: Vec<f64>,
}

impl Sizes {
    /// Sizes with the depth variable as the first variable.
    fn with_depth(&self) -> Self {
        let variables = iter::once(&self.depth).chain(&self.variables);
        Self { depth: self.depth, variables: variables.copied().collect() }
    }
}

/// Sets coefficients of a contact that are rounding to zero: those that, scaled by the sizes of the
/// variables and of the corrected coordinate, are less than 1e-28 of the largest coefficient of
/// their monomial, or of that times one variable, in any coordinate and power of `y` (in the depth
/// form, `y` is one of the variables).
///
/// A coefficient that is zero in exact arithmetic is in double-double some 1e-32 of the terms whose
/// difference it is. Such terms appear at the same monomial in other corrections, or at that
/// monomial times one more factor. The coefficient changes with every change of the arithmetic,
/// affects no image, and costs an operation in every step.
///
/// NOTE: monomials farther apart are not compared. If a contact is stiff, coefficients of high
/// powers of one variable exceed those of another by more digits than double-double has.
pub(super) fn without_rounding(mut contact: Contact<Dd>, sizes: &Sizes) -> Contact<Dd> {
    let depth = Part { factor: 1.0, jet: &mut contact.depth };
    clear(&mut [depth], sizes);
    let linear = contact.linear.iter_mut().zip(&sizes.variables);
    let linear = linear.map(|(jet, size)| Part { factor: sizes.depth / size, jet });
    let quadratic = contact.quadratic.iter_mut().zip(&sizes.variables);
    let quadratic =
        quadratic.map(|(jet, size)| Part { factor: sizes.depth * sizes.depth / size, jet });
    // The first polynomial has all monomials of the others.
    clear(&mut linear.chain(quadratic).collect::<Vec<_>>(), sizes);
    for term in &mut contact.powers.terms {
        let part = |power: f64| move |(jet, size)| Part { factor: power / size, jet };
        let linear = term.linear.iter_mut().zip(&sizes.variables).map(part(sizes.depth));
        let quadratic = term.quadratic.iter_mut().zip(&sizes.variables);
        let quadratic = quadratic.map(part(sizes.depth * sizes.depth));
        clear(&mut linear.chain(quadratic).collect::<Vec<_>>(), sizes);
    }
    if let Some(form) = contact.depth_form.as_mut().map(Arc::make_mut) {
        let corrections = form.corrections.iter_mut().zip(&sizes.variables);
        let corrections = corrections.map(|(jet, size)| Part { factor: 1.0 / size, jet });
        clear(&mut corrections.collect::<Vec<_>>(), &sizes.with_depth());
    }
    contact
}

/// A polynomial, and the factor that makes its coefficients comparable with those of others.
struct Part<'a> {
    factor: f64,
    jet: &'a mut Jet<Dd>,
}

impl Part<'_> {
    /// Powers and scaled size of every term.
    fn terms(&self, sizes: &Sizes) -> Vec<(Vec<u8>, f64)> {
        let term = |(powers, value): (&[u8], Dd)| {
            let monomial = monomial_size(powers, &sizes.variables);
            (powers.to_vec(), value.magnitude() * monomial * self.factor)
        };
        self.jet.terms().map(term).collect()
    }
}

/// Sets rounding to zero in polynomials that are expanded together.
fn clear(parts: &mut [Part<'_>], sizes: &Sizes) {
    let Some(first) = parts.first() else { return };
    let space = first.jet.space().clone();
    let terms: Vec<_> = parts.iter().map(|part| part.terms(sizes)).collect();
    let mut largest = vec![0.0f64; space.len()];
    let mut raise = |powers: &[u8], size: f64| {
        if let Some(monomial) = space.monomial(powers) {
            largest[monomial] = largest[monomial].max(size);
        }
    };
    for (powers, size) in terms.iter().flatten() {
        raise(powers, *size);
        for variable in 0..powers.len() {
            let mut fewer = powers.clone();
            if let Some(power) = fewer[variable].checked_sub(1) {
                fewer[variable] = power;
                raise(&fewer, *size);
            }
        }
    }
    for (part, terms) in parts.iter_mut().zip(&terms) {
        let coefficients = part.jet.coefficients_mut().iter_mut();
        for (coefficient, (powers, size)) in coefficients.zip(terms) {
            let monomial = space.monomial(powers);
            if monomial.is_some_and(|monomial| *size < ROUNDING * largest[monomial]) {
                *coefficient = Dd::from(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expansion::DepthForm;
    use crate::expansion::PowerCorrections;
    use crate::jet::JetSpace;

    /// Clears a contact with one coordinate and one parameter, of sizes 1e-3 and 10. Arguments are
    /// the coefficients of 1, x and p in the factors of `y` and `y²`, and in the depth.
    fn cleared(linear: [f64; 3], quadratic: [f64; 3], depth: [f64; 3]) -> [Vec<f64>; 3] {
        let space = JetSpace::uniform(2, 1).unwrap();
        let jet = |coefficients: [f64; 3]| {
            Jet::from_coefficients(&space, coefficients.map(Dd::from).to_vec())
        };
        let contact = Contact {
            depth: jet(depth),
            linear: vec![jet(linear)],
            quadratic: vec![jet(quadratic)],
            powers: PowerCorrections::default(),
            depth_form: None,
        };
        let sizes = Sizes { depth: 0.1, variables: vec![1e-3, 10.0] };
        let found = without_rounding(contact, &sizes).to_f64();
        [&found.linear[0], &found.quadratic[0], &found.depth].map(|jet| jet.coefficients().to_vec())
    }

    #[test]
    fn what_is_rounding_beside_the_law_is_zero_and_the_rest_is_as_it_was() {
        // In sizes: y 1e-31 of the coordinate, y x and y p are 1; y² 1e-32, y² x 1e-31, y² p 1e-27.
        let found = cleared([1e-33, 10.0, 1e-3], [1e-33, 1e-29, 1e-29], [0.0; 3]);
        assert_eq!(found[0], [0.0, 10.0, 1e-3]);
        assert_eq!(found[1], [0.0, 0.0, 1e-29]);
    }

    #[test]
    fn the_depth_form_loses_its_rounding_too() {
        let space = JetSpace::uniform(3, 2).unwrap();
        let monomials =
            [[1, 0, 0], [1, 1, 0], [1, 0, 1]].map(|powers| space.monomial(&powers).unwrap());
        let correction = |values: [f64; 3]| {
            let mut jet = Jet::zero(&space);
            for (monomial, value) in monomials.into_iter().zip(values) {
                jet.coefficients_mut()[monomial] = Dd::from(value);
            }
            jet
        };
        // In sizes: y 1e-27, y u 1 and y v 1e-27 of the first coordinate; y 1e-29 and y u 1e-30 of
        // the second.
        let corrections = vec![correction([1e-29, 10.0, 1e-30]), correction([1e-27, 1e-25, 0.0])];
        let flat = Jet::zero(&JetSpace::uniform(2, 1).unwrap());
        let contact = Contact {
            depth: flat.clone(),
            linear: vec![flat.clone(), flat.clone()],
            quadratic: vec![flat.clone(), flat],
            powers: PowerCorrections::default(),
            depth_form: Some(Arc::new(DepthForm { replaced: 0, corrections })),
        };
        let sizes = Sizes { depth: 0.1, variables: vec![1e-3, 10.0] };
        let form = without_rounding(contact, &sizes).depth_form.unwrap();
        let found = [0, 1].map(|coordinate| {
            let coefficients = form.corrections[coordinate].coefficients();
            monomials.map(|monomial| coefficients[monomial].to_f64())
        });
        assert_eq!(found, [[1e-29, 10.0, 1e-30], [0.0; 3]]);
    }

    #[test]
    fn monomials_of_different_variables_are_not_compared() {
        let found = cleared([0.0, 1e40, 1.0], [0.0; 3], [0.0, 1e40, 1.0]);
        assert_eq!(found[0], [0.0, 1e40, 1.0]);
        assert_eq!(found[2], [0.0, 1e40, 1.0]);
    }

    #[test]
    fn small_laws_of_their_own_stay() {
        let found = cleared([1e-40, 0.0, 0.0], [1e-41, 0.0, 0.0], [0.0, 1e-40, 0.0]);
        assert_eq!(found[0][0], 1e-40);
        assert_eq!(found[1][0], 1e-41);
        assert_eq!(found[2][1], 1e-40);
    }
}
