//! From a passage to its flown contact: the pieces, the plan, and the check that the plan is
//! enough.

use nalgebra::DMatrix;

use super::arithmetic::Numbers;
use super::contact::{ContactTime, FlightPlan, FlownContact};
use super::reference::{FlownReference, MOST_STEPS, Reference};
use super::smooth::{SmoothExpansion, SmoothPieces};
use super::start::fit;
use super::{AffineLaw, FlightError};
use crate::expansion::ExpansionError;
use crate::expansion::contact_law::ContactLaw;
use crate::expansion::passage::Passage;
use crate::expansion::release::ReleaseBalance;
use crate::expansion::section_chart::SectionChart;
use crate::expansion::variables::Variables;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real, Scalar};

/// Smallest depth variable at which contacts are checked: a depth of 1e-32.
const SHALLOWEST: f64 = 1e-16;
/// Depth variables per decade at which contacts are checked.
const PER_DECADE: f64 = 5.0;
/// Depth variables per decade to which the contact time is fitted: none of them is checked.
const FITTED_PER_DECADE: f64 = 12.0;
/// Contact times over `y` that differ by less are fitted once.
const DISTINCT: f64 = 2e-3;
/// Depths are checked a little beyond the window.
const MARGIN: f64 = 1.1;
/// Points of the window besides its middle at which each depth is checked.
const CORNERS: usize = 6;
/// Longest step, times the largest eigenvalue: half a period of a stiff stop and a little, where
/// the terms of a step grow to at most 8 before they fall.
const LONGEST_STEP: f64 = 3.6;
/// Most steps of a flight.
const MOST_FLOWN_STEPS: usize = 16;
/// Rounding of a double: what a truncation or a Newton step must be below.
const EXACT: f64 = 1e-16;
/// The same one step earlier: the slope in the last step, and with it the Jacobian, is as exact as
/// that.
const NEARLY: f64 = 1e-8;
/// Relative error of what a contact adds that is still rounding.
const ROUNDING: f64 = 1e-14;
/// Most Newton steps.
const MOST_NEWTON: usize = 8;

/// Where contacts are to be flown.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightWindow {
    /// Largest `y²`.
    pub depth: f64,
    /// Half-widths of the coordinates, then of the parameters, in offsets.
    pub half_widths: Vec<f64>,
}

/// Expands a passage about an exactly flown contact; `None` for a rigid stop.
///
/// The image errs by weight `weight + 1`, with the constants of the free flow whatever the
/// stiffness of the contact. What is flown is checked on the window from a depth of 1e-32 on,
/// contact by contact, against steps that are finer and more: the shape is refused where its fixed
/// number of steps is not enough.
///
/// # Errors
///
/// [`FlightError`] if the law is not affine or a contact of the window is not flown to rounding;
/// [`ExpansionError`] as for a discontinuity mapping.
pub fn flown_contact(
    passage: &Passage,
    chart: &SectionChart,
    variables: &Variables,
    weight: u32,
    window: &FlightWindow,
) -> Result<Option<FlownContact>, ExpansionError> {
    let ContactLaw::Compliant { field, flight } = &passage.law else {
        return Ok(None);
    };
    let affine = flight.as_ref().as_ref().map_err(Clone::clone)?;
    let balance = ReleaseBalance::new(passage, field, chart, variables)?;
    if balance.power() != 1 {
        return Err(FlightError::ContactTime {
            surface: passage.surface.clone(),
            power: balance.power(),
        }
        .into());
    }
    if !(window.depth > 0.0 && window.depth.is_finite()) {
        return Err(FlightError::Depth {
            surface: passage.surface.clone(),
            depth: window.depth,
        }
        .into());
    }
    let pieces = SmoothExpansion::new(passage, affine, chart, variables, weight)?.pieces()?;
    let planner = Planner {
        surface: &passage.surface,
        factor: balance.factor().to_f64(),
        rate: spectral_radius(affine)?,
        samples: samples(window),
        highest: highest(window),
        middle: vec![Dd::ZERO; window.half_widths.len()],
    };
    let contact = planner.plan(unplanned(pieces, balance.factor()))?;
    if !contact.is_finite() {
        return Err(ExpansionError::NotFinite { part: "D" });
    }
    Ok(Some(contact.map_scalars(Real::to_f64)))
}

fn unplanned(pieces: SmoothPieces, factor: Dd) -> FlownContact<Dd> {
    FlownContact {
        largest: vec![0.0; pieces.section.len()],
        depth: pieces.depth,
        gap: pieces.gap,
        entry: pieces.entry,
        law: pieces.law,
        back: pieces.back,
        section: pieces.section,
        contact_time: ContactTime {
            numerator: vec![factor],
            denominator: vec![Dd::ONE],
        },
        plan: FlightPlan {
            entry: MOST_NEWTON,
            steps: 1,
            order: 1,
            release: 0,
        },
    }
}

fn spectral_radius(affine: &AffineLaw) -> Result<f64, ExpansionError> {
    let rows = affine.matrix.len();
    let matrix = DMatrix::from_fn(rows, rows, |i, j| affine.matrix[i][j].to_f64());
    let largest = eigenvalues(&matrix)?
        .first()
        .map_or(0.0, |value| value.norm());
    Ok(largest.max(f64::MIN_POSITIVE))
}

/// Depth variables from the highest down, so many per decade.
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
        std::iter::once(middle)
            .chain((0..CORNERS).map(corner))
            .collect()
    };
    let depths = depths(highest(window), PER_DECADE).enumerate();
    depths
        .map(|(number, y)| (Dd::from(y), points(number)))
        .collect()
}

/// The highest depth variable at which contacts are checked.
fn highest(window: &FlightWindow) -> f64 {
    MARGIN * window.depth.sqrt()
}

/// Corners of a box, spread evenly over them.
fn sign(number: usize, corner: usize, variable: usize) -> f64 {
    let turns = (number * CORNERS + corner + 1) as f64 * (variable as f64 + 2.0).sqrt();
    if turns.fract() < 0.5 { -1.0 } else { 1.0 }
}

/// Finds the fewest steps that fly every contact of the window.
struct Planner<'a> {
    surface: &'a str,
    factor: f64,
    rate: f64,
    samples: Vec<(Dd, Vec<Vec<Dd>>)>,
    highest: f64,
    middle: Vec<Dd>,
}

/// A contact flown by the reference.
struct Checked {
    y: Dd,
    point: Vec<Dd>,
    exact: FlownReference,
}

impl Planner<'_> {
    fn plan(&self, mut contact: FlownContact<Dd>) -> Result<FlownContact<Dd>, ExpansionError> {
        let checked = self.references(&contact)?;
        if checked.first().is_some_and(|first| first.exact.sign > 0.0) {
            contact.law = contact.law.turned();
        }
        contact.contact_time = self.contact_time(&contact)?;
        let longest = checked
            .iter()
            .map(|c| c.exact.time.to_f64())
            .fold(0.0, f64::max);
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
                Ok(Checked {
                    y,
                    point: point.clone(),
                    exact: self.reference(contact, y, point)?,
                })
            })
            .collect()
    }

    fn reference(
        &self,
        contact: &FlownContact<Dd>,
        y: Dd,
        point: &[Dd],
    ) -> Result<FlownReference, FlightError> {
        let reference = Reference {
            contact,
            factor: self.factor,
            rate: self.rate,
        };
        reference
            .fly(y, point)
            .ok_or_else(|| FlightError::NoRelease {
                surface: self.surface.to_owned(),
                depth: (y * y).to_f64(),
                steps: MOST_STEPS,
            })
    }

    /// The contact time along the middle of the window, as a function of `y`.
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
        let fit = fit(&samples);
        let exact = |numbers: Vec<f64>| numbers.into_iter().map(Dd::from).collect();
        Ok(ContactTime {
            numerator: exact(fit.numerator),
            denominator: exact(fit.denominator),
        })
    }

    fn check(&self, contact: &FlownContact<Dd>, checked: &[Checked]) -> Result<(), FlightError> {
        let errors = checked
            .iter()
            .map(|sample| (sample.y, error(contact, sample)));
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

/// Powers of time after which a step of this length (times the largest eigenvalue) is exact.
fn order(reach: f64) -> usize {
    let mut term = 1.0;
    let mut order = 0;
    while term > EXACT {
        order += 1;
        term *= reach / order as f64;
    }
    order + 1
}

/// The fewest Newton steps whose error is rounding, and that of one step fewer nearly so.
fn fewest(error: impl Fn(usize) -> f64) -> usize {
    let enough = |&steps: &usize| error(steps) <= EXACT && error(steps - 1) <= NEARLY;
    (1..MOST_NEWTON).find(enough).unwrap_or(MOST_NEWTON)
}

fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst, error| {
        if error.is_nan() {
            f64::INFINITY
        } else {
            worst.max(error)
        }
    })
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
    let size = exact
        .iter()
        .map(|value| value.magnitude())
        .fold(0.0, f64::max);
    let pairs = found.iter().zip(exact);
    worst(pairs.map(|(found, exact)| (*found - *exact).magnitude() / size))
}

fn largest_corrections(contact: &FlownContact<Dd>, checked: &[Checked]) -> Vec<f64> {
    let coordinates = 0..contact.dimension();
    let of = |coordinate: usize| {
        let corrections = checked
            .iter()
            .map(|sample| &sample.exact.corrections[coordinate]);
        corrections
            .map(|value| value.magnitude())
            .fold(0.0, f64::max)
    };
    coordinates.map(of).collect()
}
