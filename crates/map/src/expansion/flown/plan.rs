//! The flown contact of a passage: its pieces, the plan of its steps, and the check that the plan
//! is sufficient.
//!
//! The plan is checked against contacts of single points that are flown step by step to their first
//! release. Newton steps for the release begin at the contact time as a rational function of `y`.
//! The contact time over `y` falls from one power law to the next where another force becomes
//! dominant, on scales of `y` that may lie decades apart; a sum of `c_j/(1 + y/y_j)` follows it.
//! The scales `y_j` are selected one by one.

use nalgebra::{DMatrix, DVector};

use super::smooth::SmoothExpansion;
use super::{ContactTime, FlightPlan, FlownContact, Numbers, scaled, scaled_all, shift};
use crate::expansion::error::{ExpansionError, FlightError};
use crate::expansion::passage::{AffineLaw, ContactLaw};
use crate::expansion::release::ReleaseBalance;
use crate::expansion::routes::Graze;
use crate::numeric::linear::eigenvalues;
use crate::numeric::polynomial::{CrossingDirection, crossings, evaluate};
use crate::numeric::{Dd, Real, Scalar, converted};

/// Smallest depth variable at which contacts are checked: a depth of 1e-32.
const SHALLOWEST: f64 = 1e-16;
/// Number of depth variables per decade at which contacts are checked.
const PER_DECADE: f64 = 5.0;
/// Number of depth variables per decade to which the contact time is fitted: none of them is
/// checked.
const FITTED_PER_DECADE: f64 = 12.0;
/// Contact times over `y` with a relative difference below this are fitted once.
const DISTINCT: f64 = 2e-3;
/// Factor by which the depth variables checked exceed the window.
const MARGIN: f64 = 1.1;
/// Number of points of the window, besides its middle, at which each depth is checked.
const CORNERS: usize = 6;
/// Longest step, times the largest eigenvalue: slightly more than half a period of a stiff stop;
/// the terms of a step grow to at most 8 before they fall.
const LONGEST_STEP: f64 = 3.6;
/// Largest number of steps of a flight.
const MOST_FLOWN_STEPS: usize = 16;
/// Rounding of a double; a truncation error or Newton step must be smaller.
const EXACT: f64 = 1e-16;
/// Bound on the error one Newton step earlier: the slope in the last step, and with it the
/// Jacobian, has that accuracy.
const NEARLY: f64 = 1e-8;
/// Largest relative error of the contribution of a contact that counts as rounding.
const ROUNDING: f64 = 1e-14;
/// Largest number of Newton steps.
const MOST_NEWTON: usize = 8;

/// Window in which contacts are flown.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightWindow {
    /// Largest depth `y²`.
    pub depth: f64,
    /// Half-widths of the coordinates, then of the parameters, in offsets.
    pub half_widths: Vec<f64>,
}

/// Expands a passage with an exactly flown contact; `None` for a rigid stop.
///
/// The image has an error of weight `weight + 1`, with the constants of the free flow, for any
/// stiffness of the contact. The flight is checked on the window, from a depth of 1e-32 on, contact
/// by contact, against finer and more steps. It is refused if its fixed number of steps is not
/// sufficient.
///
/// # Errors
///
/// [`FlightError`] if the law is not affine or a contact of the window is not flown to rounding;
/// [`ExpansionError`] as for a discontinuity mapping.
pub fn flown_contact(
    graze: &Graze,
    weight: u32,
    window: &FlightWindow,
) -> Result<Option<FlownContact>, ExpansionError> {
    let passage = &graze.passage;
    let (field, flight) = match &passage.law {
        ContactLaw::Compliant { field, flight } => (field, flight),
        ContactLaw::Rigid { .. } => return Ok(None),
        ContactLaw::Powers(_) => {
            return Err(FlightError::Powers { surface: passage.surface.clone() }.into());
        }
    };
    let affine = flight.as_ref().as_ref().map_err(Clone::clone)?;
    let balance = ReleaseBalance::new(graze, field)?;
    if balance.power != 1 {
        return Err(FlightError::ContactTime {
            surface: passage.surface.clone(),
            power: balance.power,
        }
        .into());
    }
    if !(window.depth > 0.0 && window.depth.is_finite()) {
        return Err(
            FlightError::Depth { surface: passage.surface.clone(), depth: window.depth }.into()
        );
    }
    let small = ContactTime { numerator: vec![balance.factor], denominator: vec![Dd::ONE] };
    let plan = FlightPlan { entry: MOST_NEWTON, steps: 1, order: 1, release: 0 };
    let unplanned = SmoothExpansion::new(graze, affine, weight)?.contact(small, plan)?;
    let planner = Planner {
        surface: &passage.surface,
        factor: balance.factor.to_f64(),
        rate: spectral_radius(affine)?,
        samples: samples(window),
        highest: highest(window),
        middle: vec![Dd::ZERO; window.half_widths.len()],
    };
    let contact = planner.plan(unplanned)?;
    if !contact.is_finite() {
        return Err(ExpansionError::NotFinite { part: "D" });
    }
    Ok(Some(contact.map_scalars(Real::to_f64)))
}

fn spectral_radius(affine: &AffineLaw) -> Result<f64, ExpansionError> {
    let rows = affine.matrix.len();
    let matrix = DMatrix::from_fn(rows, rows, |i, j| affine.matrix[i][j].to_f64());
    let largest = eigenvalues(&matrix)?.first().map_or(0.0, |value| value.norm());
    Ok(largest.max(f64::MIN_POSITIVE))
}

/// Depth variables in decreasing order from the highest, a given number per decade.
fn depths(highest: f64, per_decade: f64) -> impl Iterator<Item = f64> {
    let count = ((highest / SHALLOWEST).log10() * per_decade).ceil();
    (0..=count as u32).map(move |number| highest * 0.1_f64.powf(f64::from(number) / per_decade))
}

/// Depth variables, each with the points of the window at which it is checked; the first point is
/// the middle.
fn samples(window: &FlightWindow) -> Vec<(Dd, Vec<Vec<Dd>>)> {
    let points = |number: usize| -> Vec<Vec<Dd>> {
        let corner = |corner: usize| {
            let widths = window.half_widths.iter().enumerate();
            let signed = |(variable, &width): (usize, &f64)| {
                Dd::from(width * sign(number, corner, variable))
            };
            widths.map(signed).collect()
        };
        let middle = vec![Dd::ZERO; window.half_widths.len()];
        std::iter::once(middle).chain((0..CORNERS).map(corner)).collect()
    };
    let depths = depths(highest(window), PER_DECADE).enumerate();
    depths.map(|(number, y)| (Dd::from(y), points(number))).collect()
}

/// Highest depth variable at which contacts are checked.
fn highest(window: &FlightWindow) -> f64 {
    MARGIN * window.depth.sqrt()
}

/// Sign of a variable at a corner of the window; the corners used are spread evenly.
fn sign(number: usize, corner: usize, variable: usize) -> f64 {
    let turns = (number * CORNERS + corner + 1) as f64 * (variable as f64 + 2.0).sqrt();
    if turns.fract() < 0.5 { -1.0 } else { 1.0 }
}

/// Search for the smallest numbers of steps that fly every contact of the window.
struct Planner<'a> {
    surface: &'a str,
    /// Contact time over `y` at small depths.
    factor: f64,
    /// Largest magnitude of an eigenvalue of the contact's matrix.
    rate: f64,
    samples: Vec<(Dd, Vec<Vec<Dd>>)>,
    highest: f64,
    middle: Vec<Dd>,
}

/// A contact flown by the reference method.
struct Checked {
    y: Dd,
    point: Vec<Dd>,
    exact: FlownReference,
}

/// Result of the reference method for a contact.
struct FlownReference {
    /// Contact time.
    time: Dd,
    /// Sign of the release function before the release.
    sign: f64,
    /// Corrections of the coordinates.
    corrections: Vec<Dd>,
}

impl Planner<'_> {
    fn plan(&self, mut contact: FlownContact<Dd>) -> Result<FlownContact<Dd>, ExpansionError> {
        let checked = self.references(&contact)?;
        if checked.first().is_some_and(|first| first.exact.sign > 0.0) {
            contact.law = contact.law.turned();
        }
        contact.contact_time = self.contact_time(&contact)?;
        let longest = checked.iter().map(|c| c.exact.time.to_f64()).fold(0.0, f64::max);
        let reach = self.rate * longest * MARGIN;
        contact.plan.steps = self.steps(reach)?;
        // Without stiffness the force, of degree `W + 1`, is integrated once for every component.
        let degree = contact.gap.len() + 1 + contact.law.matrix.len();
        contact.plan.order = order(reach / contact.plan.steps as f64).max(degree);
        contact.plan.entry = fewest(|steps| entry_error(&contact, &checked, steps));
        contact.plan.release = fewest(|steps| release_error(&contact, &checked, steps));
        self.check(&contact, &checked)?;
        contact.largest = largest_corrections(&contact, &checked);
        Ok(contact)
    }

    fn steps(&self, reach: f64) -> Result<usize, FlightError> {
        let steps = (reach / LONGEST_STEP).ceil().max(1.0);
        if steps <= MOST_FLOWN_STEPS as f64 {
            return Ok(steps as usize);
        }
        Err(FlightError::TooLong {
            surface: self.surface.to_owned(),
            steps,
            most: MOST_FLOWN_STEPS,
        })
    }

    fn references(&self, contact: &FlownContact<Dd>) -> Result<Vec<Checked>, FlightError> {
        let samples = self.samples.iter();
        let points = samples.flat_map(|(y, points)| points.iter().map(move |point| (*y, point)));
        points
            .map(|(y, point)| {
                Ok(Checked { y, point: point.clone(), exact: self.reference(contact, y, point)? })
            })
            .collect()
    }

    /// Flies the contact of depth variable `y > 0` at a point by the slow and safe reference
    /// method.
    fn reference(
        &self,
        contact: &FlownContact<Dd>,
        y: Dd,
        point: &[Dd],
    ) -> Result<FlownReference, FlightError> {
        let numbers = &mut Numbers::default();
        let entry = contact.entry(numbers, &y, point);
        let time = (self.factor * y.to_f64()).min(1.0 / self.rate);
        let length = Dd::from(time / STEPS_PER_TIME);
        let mut forces = scaled_all(numbers, &entry.forces, &length);
        let mut release = scaled(numbers, &entry.release, &length);
        let law = &contact.law;
        let mut state = vec![Dd::ZERO; law.matrix.len()];
        let mut sign = None;
        for number in 0..MOST_STEPS {
            let step = law.step(numbers, &forces, &release, state, &length, ORDER);
            let part = first_change(&step.release, &mut sign);
            let at = part.unwrap_or(Dd::ONE);
            let added = step.states.iter().map(|series| evaluate(series, at).0);
            let added: Vec<_> = added.collect();
            if let (Some(_), Some(sign)) = (part, sign) {
                let time = (Dd::from(number as f64) + at) * length;
                let since_minimum = entry.time + time;
                let corrections = contact.on_section(numbers, &since_minimum, &added, point);
                return Ok(FlownReference { time, sign, corrections });
            }
            state = added;
            forces.iter_mut().for_each(|series| shift(numbers, series, None));
            shift(numbers, &mut release, None);
        }
        Err(FlightError::NoRelease {
            surface: self.surface.to_owned(),
            depth: (y * y).to_f64(),
            steps: MOST_STEPS,
        })
    }

    /// Contact time over `y` at the middle of the window, as a function of `y`.
    fn contact_time(&self, contact: &FlownContact<Dd>) -> Result<ContactTime<Dd>, FlightError> {
        let mut samples: Vec<(f64, f64)> = Vec::new();
        for (number, y) in depths(MARGIN * self.highest, FITTED_PER_DECADE).enumerate() {
            let exact = self.reference(contact, Dd::from(y), &self.middle)?;
            let factor = exact.time.to_f64() / y;
            let last = samples.last().map_or(0.0, |sample| sample.1);
            let whole_decade = number.is_multiple_of(FITTED_PER_DECADE as usize);
            if whole_decade || (factor - last).abs() > DISTINCT * factor {
                samples.push((y, factor));
            }
        }
        let ContactTime { numerator, denominator } = fit(&samples);
        Ok(ContactTime { numerator: converted(&numerator), denominator: converted(&denominator) })
    }

    fn check(&self, contact: &FlownContact<Dd>, checked: &[Checked]) -> Result<(), FlightError> {
        let errors = checked.iter().map(|sample| (sample.y, error(contact, sample)));
        let worst = errors.max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((y, error)) if error.is_nan() || error > ROUNDING => Err(FlightError::Inexact {
                surface: self.surface.to_owned(),
                depth: (y * y).to_f64(),
                error,
            }),
            _ => Ok(()),
        }
    }
}

/// Number of powers of time after which a step of this length (times the largest eigenvalue) is
/// exact.
fn order(reach: f64) -> usize {
    let mut term = 1.0;
    let mut order = 0;
    while term > EXACT {
        order += 1;
        term *= reach / order as f64;
    }
    order + 1
}

/// Smallest number of Newton steps whose error is rounding, while that of one step fewer is nearly
/// so.
fn fewest(error: impl Fn(usize) -> f64) -> usize {
    let enough = |&steps: &usize| error(steps) <= EXACT && error(steps - 1) <= NEARLY;
    (1..MOST_NEWTON).find(enough).unwrap_or(MOST_NEWTON)
}

fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

fn entry_error(contact: &FlownContact<Dd>, checked: &[Checked], steps: usize) -> f64 {
    let with = |steps: usize| {
        let mut contact = contact.clone();
        contact.plan.entry = steps;
        contact
    };
    let (few, many) = (with(steps), with(MOST_NEWTON));
    worst(checked.iter().map(|Checked { y, point, .. }| {
        let time =
            |contact: &FlownContact<Dd>| contact.entry(&mut Numbers::default(), y, point).time;
        let exact = time(&many);
        ((time(&few) - exact) / exact).magnitude()
    }))
}

fn release_error(contact: &FlownContact<Dd>, checked: &[Checked], steps: usize) -> f64 {
    let mut contact = contact.clone();
    contact.plan.release = steps;
    worst(checked.iter().map(|Checked { y, point, exact }| {
        let numbers = &mut Numbers::default();
        let entry = contact.entry(numbers, y, point);
        let time = contact.fly(numbers, y, &entry).0;
        ((time - exact.time) / exact.time).magnitude()
    }))
}

/// Error of a contact, relative to the largest of its corrections.
fn error(contact: &FlownContact<Dd>, sample: &Checked) -> f64 {
    let found = contact.corrections(&mut Numbers::default(), &sample.y, &sample.point);
    let exact = &sample.exact.corrections;
    let size = exact.iter().map(|value| value.magnitude()).fold(0.0, f64::max);
    let pairs = found.iter().zip(exact);
    worst(pairs.map(|(found, exact)| (*found - *exact).magnitude() / size))
}

fn largest_corrections(contact: &FlownContact<Dd>, checked: &[Checked]) -> Vec<f64> {
    let coordinates = 0..contact.dimension();
    let of = |coordinate: usize| {
        let corrections = checked.iter().map(|sample| &sample.exact.corrections[coordinate]);
        corrections.map(|value| value.magnitude()).fold(0.0, f64::max)
    };
    coordinates.map(of).collect()
}

/// Number of steps within the shorter of the contact time at small depths and the law's own time.
const STEPS_PER_TIME: f64 = 4.0;
/// Number of powers of time in a step: `(1/4)^25/25!` is below the rounding of double-double.
const ORDER: usize = 24;
/// Part of the first step after which the sign of the release function is not rounding.
const SETTLED: f64 = 0.125;
/// Number of steps after which a contact counts as one without release.
const MOST_STEPS: usize = 4096;

/// First point of `[0, 1]` at which a polynomial has a sign other than `sign`; an unknown `sign` is
/// set to that of the value at [`SETTLED`].
fn first_change(release: &[Dd], sign: &mut Option<f64>) -> Option<Dd> {
    let (sign, from) = match *sign {
        Some(sign) if release[0].to_f64() * sign < 0.0 => return Some(Dd::ZERO),
        Some(sign) => (sign, Dd::ZERO),
        None => {
            let settled = Dd::from(SETTLED);
            let value = evaluate(release, settled).0.to_f64();
            (*sign.insert(value.signum()), settled)
        }
    };
    let out = match sign > 0.0 {
        true => CrossingDirection::Entering,
        false => CrossingDirection::Leaving,
    };
    let crossings = crossings(release, Dd::ONE).into_iter();
    let mut changes = crossings.filter(|crossing| crossing.direction == out);
    let first = changes.find(|change| change.time > from);
    first.map(|change| change.time)
}

/// Number of candidate scales per decade of `y`.
const SCALES_PER_DECADE: f64 = 4.0;
/// Factor by which candidate scales extend beyond the sampled depths.
const BEYOND: f64 = 100.0;
/// Largest number of scales selected.
const MOST_SCALES: usize = 10;
/// Relative error at which no further scale is selected.
const CLOSE: f64 = 3e-3;

/// Fits `κ` to pairs `(y, κ)` with a small relative error.
fn fit(samples: &[(f64, f64)]) -> ContactTime<f64> {
    let candidates = candidates(samples);
    let mut scales: Vec<f64> = Vec::new();
    let mut best = solve(samples, &scales);
    while best.error > CLOSE && scales.len() < MOST_SCALES {
        let tried = candidates.iter().filter(|scale| !scales.contains(scale));
        let fits = tried.map(|&scale| solve(samples, &[&scales[..], &[scale]].concat()));
        match fits.min_by(|a, b| a.error.total_cmp(&b.error)) {
            Some(next) if next.error < best.error => best = next,
            _ => break,
        }
        scales.clone_from(&best.scales);
    }
    best.rational()
}

fn candidates(samples: &[(f64, f64)]) -> Vec<f64> {
    let depths = || samples.iter().map(|&(y, _)| y);
    let lowest = depths().fold(f64::INFINITY, f64::min) / BEYOND;
    let highest = depths().fold(0.0, f64::max) * BEYOND;
    let count = ((highest / lowest).log10() * SCALES_PER_DECADE).ceil();
    let place = |number: u32| lowest * (highest / lowest).powf(f64::from(number) / count);
    (0..=count as u32).map(place).collect()
}

/// Approximation `κ ≈ c_0 + Σ c_j/(1 + y/y_j)`.
struct Fit {
    scales: Vec<f64>,
    factors: Vec<f64>,
    error: f64,
}

/// Least-squares fit of the relative error.
fn solve(samples: &[(f64, f64)], scales: &[f64]) -> Fit {
    let term = |y: f64, column: usize| match column {
        0 => 1.0,
        _ => 1.0 / (1.0 + y / scales[column - 1]),
    };
    let matrix = DMatrix::from_fn(samples.len(), scales.len() + 1, |row, column| {
        let (y, factor) = samples[row];
        term(y, column) / factor
    });
    let ones = DVector::from_element(samples.len(), 1.0);
    let svd = matrix.clone().svd(true, true);
    let factors = svd.solve(&ones, 1e-12);
    let factors = factors.unwrap_or_else(|_| DVector::zeros(scales.len() + 1));
    let error = (&matrix * &factors - ones).amax();
    Fit {
        scales: scales.to_vec(),
        factors: factors.iter().copied().collect(),
        error: if error.is_nan() { f64::INFINITY } else { error },
    }
}

impl Fit {
    /// Writes the sum over the common denominator `Π (1 + y/y_j)`.
    fn rational(&self) -> ContactTime<f64> {
        let denominator = product(&self.scales);
        let mut numerator = denominator.iter().map(|d| self.factors[0] * d).collect::<Vec<_>>();
        for (number, factor) in self.factors[1..].iter().enumerate() {
            let mut others = self.scales.clone();
            others.remove(number);
            for (sum, term) in numerator.iter_mut().zip(product(&others)) {
                *sum += factor * term;
            }
        }
        ContactTime { numerator, denominator }
    }
}

/// Product `Π (1 + y/y_j)`, coefficients from the lowest power up.
fn product(scales: &[f64]) -> Vec<f64> {
    scales.iter().fold(vec![1.0], |product, scale| {
        let mut next = product.clone();
        next.push(0.0);
        for (power, value) in product.iter().enumerate() {
            next[power + 1] += value / scale;
        }
        next
    })
}
