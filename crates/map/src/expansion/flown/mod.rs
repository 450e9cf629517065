//! Contacts flown exactly: passages of a compliant stop whose contact field is affine.
//!
//! The difference of contact and free flight, `z = x − x_free`, obeys a linear equation
//! `z' = A z + g(t)` with a force `g` that is smooth on the scale of the free flight. A Taylor
//! series in time with a fixed number of terms solves it to rounding for any stiffness, so only
//! series of the free flow are truncated. Derivation: docs/mathematics/flown-contacts.md.
//!
//! This module holds the contact itself (the polynomials of the free flow about it, its linear law)
//! and the operations by which it acts, on any [`Arithmetic`].

mod plan;
mod smooth;

use std::sync::Arc;

use num_traits::{One, Zero};
use serde::{Deserialize, Serialize};

use crate::jet::{Jet, JetSpace};
use crate::numeric::{Real, Scalar};

pub use plan::{FlightWindow, flown_contact};

/// A grazing passage whose contact is flown exactly:
///
/// ```text
/// y = √max(0, depth(x, p)),   entry at s_e = −y σ from the minimum of the gap,
/// z' = A z + g(s),            release where ρ(s) + r·z = 0,
/// x ↦ x + section(back(s, z; x, p); x, p)
/// ```
///
/// The free flow's gap, force `g` and release function `ρ` are series in the time `s` from the
/// minimum. The passage is exactly the identity at `y = 0`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FlownContact<S: Scalar = f64> {
    /// Depth `−h_min`, a polynomial in (coordinates; parameters) without constant term.
    pub depth: Jet<S>,
    /// Coefficients `H_2, H_3, …` of the gap `h = −y² + Σ H_k s^k`.
    gap: Vec<Jet<S>>,
    /// Start of the Newton steps for `σ`, to low weight, in `(y; coordinates; parameters)`.
    entry: Jet<S>,
    /// Linear law of the contact.
    law: LinearLaw<S>,
    /// Contribution of the contact, carried back to the time of the minimum, in `(s; z)` or
    /// `(s; z; coordinates; parameters)`.
    back: Vec<Jet<S>>,
    /// Correction of each coordinate, in (contribution of the contact; coordinates; parameters).
    section: Vec<Jet<S>>,
    /// Approximation of the contact time over `y`.
    contact_time: ContactTime<S>,
    /// Numbers of steps and powers.
    plan: FlightPlan,
    /// Largest correction of each coordinate over the window, for bounds.
    largest: Vec<f64>,
}

/// Law `z' = A z + g`, released at a zero of `ρ + r·z` at which that function rises.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct LinearLaw<S: Scalar> {
    matrix: Vec<Vec<S>>,
    /// Indices of the components with a force, and the forces along the free flow.
    forces: Vec<(usize, Drive<S>)>,
    release_row: Vec<S>,
    /// Release function along the free flow.
    release: Drive<S>,
}

/// A function along the free flow: a combination of 1, the gap and its rate, and a series for the
/// rest.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Drive<S: Scalar> {
    constant: S,
    gap: S,
    gap_rate: S,
    /// Coefficients of the rest in the time from the minimum; empty if there is no rest.
    rest: Vec<Jet<S>>,
}

/// Rational function `κ(y) = P(y)/Q(y)`, positive; coefficients from the lowest power up.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ContactTime<S> {
    numerator: Vec<S>,
    denominator: Vec<S>,
}

/// Fixed numbers of steps with which every contact is flown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlightPlan {
    /// Newton steps for the entry.
    pub entry: usize,
    /// Taylor steps along the contact.
    pub steps: usize,
    /// Powers of time in each Taylor step.
    pub order: usize,
    /// Newton steps for the release.
    pub release: usize,
}

impl<S: Scalar> FlownContact<S> {
    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.section.len()
    }

    /// Number of coefficients, those used in every Taylor step counted once per step.
    pub(crate) fn terms(&self) -> usize {
        let of = |jets: &[Jet<S>]| jets.iter().map(|jet| jet.coefficients().len()).sum::<usize>();
        let drives = self.law.forces.iter().map(|(_, drive)| drive).chain([&self.law.release]);
        let flown: usize = drives.map(|drive| of(&drive.rest)).sum();
        let once = [&self.depth, &self.entry].map(|jet| jet.coefficients().len());
        let once = once.iter().sum::<usize>() + of(&self.gap) + of(&self.back) + of(&self.section);
        once + self.plan.steps * (self.plan.order + flown)
    }

    /// Numbers of steps and powers of the flight.
    pub fn plan(&self) -> FlightPlan {
        self.plan
    }

    /// Largest correction of each coordinate on the window.
    pub fn largest_corrections(&self) -> &[f64] {
        &self.largest
    }

    /// Image of a point (coordinates; parameters) by a contact of depth variable `y`, irrespective
    /// of the depth at the point.
    pub fn act_at<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let corrections = self.corrections(arithmetic, y, point);
        let pairs = corrections.iter().zip(point);
        let image = pairs.map(|(correction, start)| arithmetic.add(correction, start));
        image.collect()
    }

    /// All polynomials of the passage.
    pub fn polynomials(&self) -> impl Iterator<Item = &Jet<S>> {
        let drives = self.law.forces.iter().map(|(_, force)| force);
        let rests = drives.chain([&self.law.release]).flat_map(|d| &d.rest);
        let rest = self.gap.iter().chain(&self.back).chain(&self.section);
        [&self.depth, &self.entry].into_iter().chain(rests).chain(rest)
    }
}

impl FlownContact {
    /// Whether its parts have the sizes of a map with so many coordinates and parameters.
    pub fn fits(&self, coordinates: usize, parameters: usize) -> bool {
        let (plain, moved) = (coordinates + parameters, self.law.matrix.len());
        let in_space = |jets: &[Jet<f64>], allowed: &[usize]| {
            let mut spaces = jets.iter().map(|jet| jet.space().variables());
            spaces.all(|found| allowed.contains(&found))
        };
        let drives = self.law.forces.iter().map(|(_, force)| force);
        let mut drives = drives.chain([&self.law.release]);
        let one = std::slice::from_ref;
        in_space(one(&self.depth), &[plain])
            && in_space(one(&self.entry), &[plain + 1])
            && in_space(&self.gap, &[plain])
            && in_space(&self.back, &[1 + moved, 1 + moved + plain])
            && in_space(&self.section, &[self.back.len() + plain])
            && drives.all(|drive| in_space(&drive.rest, &[plain]))
            && self.law.matrix.iter().all(|row| row.len() == moved)
            && self.law.forces.iter().all(|&(place, _)| place < moved)
            && self.law.release_row.len() == moved
            && [self.section.len(), self.largest.len()] == [coordinates; 2]
            && !(self.contact_time.numerator.is_empty() || self.contact_time.denominator.is_empty())
    }
}

impl<S: Scalar> LinearLaw<S> {
    /// Changes the sign of the release function.
    fn turned(self) -> Self {
        let release = self.release;
        Self {
            release_row: self.release_row.into_iter().map(|value| -value).collect(),
            release: Drive {
                constant: -release.constant,
                gap: -release.gap,
                gap_rate: -release.gap_rate,
                rest: release.rest.iter().map(|jet| -jet).collect(),
            },
            ..self
        }
    }
}

impl<S: Real> FlownContact<S> {
    /// Converts the numbers to another type.
    pub fn map_scalars<T: Real>(&self, convert: impl Fn(S) -> T + Copy) -> FlownContact<T> {
        let jets = |jets: &[Jet<S>]| jets.iter().map(|jet| jet.map_scalars(convert)).collect();
        let numbers = |numbers: &[S]| numbers.iter().copied().map(convert).collect();
        let drive = |drive: &Drive<S>| Drive {
            constant: convert(drive.constant),
            gap: convert(drive.gap),
            gap_rate: convert(drive.gap_rate),
            rest: jets(&drive.rest),
        };
        let forces = self.law.forces.iter();
        FlownContact {
            depth: self.depth.map_scalars(convert),
            gap: jets(&self.gap),
            entry: self.entry.map_scalars(convert),
            law: LinearLaw {
                matrix: self.law.matrix.iter().map(|row| numbers(row)).collect(),
                forces: forces.map(|(i, force)| (*i, drive(force))).collect(),
                release_row: numbers(&self.law.release_row),
                release: drive(&self.law.release),
            },
            back: jets(&self.back),
            section: jets(&self.section),
            contact_time: ContactTime {
                numerator: numbers(&self.contact_time.numerator),
                denominator: numbers(&self.contact_time.denominator),
            },
            plan: self.plan,
            largest: self.largest.clone(),
        }
    }

    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        let law = self.law.matrix.iter().flatten().chain(&self.law.release_row);
        let time = &self.contact_time;
        let numbers = law.chain(&time.numerator).chain(&time.denominator);
        self.polynomials().all(Jet::is_finite) && numbers.copied().all(Scalar::is_finite)
    }
}

/// Arithmetic of a flown contact: numbers, values with tangents, or the operations of a kernel.
///
/// The sequence of operations is written once and run on all of them, so that the map evaluated
/// from its coefficients, the kernel and the emitted code perform the same operations.
pub trait Arithmetic {
    /// Numbers of the coefficients.
    type Scalar: Scalar;
    /// Value of an expression.
    type Value: Clone;

    /// Constant value.
    fn constant(&mut self, value: Self::Scalar) -> Self::Value;
    /// Sum `a + b`.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// Product `a b`.
    fn multiply(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// Product and sum `a b + c`.
    fn multiply_add(&mut self, a: &Self::Value, b: &Self::Value, c: &Self::Value) -> Self::Value;
    /// Root `√max(0, a)`.
    fn root_of_positive_part(&mut self, a: &Self::Value) -> Self::Value;
    /// Half of the reciprocal, `1/(2a)`; 0 if `a` is not positive.
    fn half_reciprocal(&mut self, a: &Self::Value) -> Self::Value;
    /// Value of `a`, as a constant in differentiation: for choices that no result depends on.
    fn held(&mut self, a: &Self::Value) -> Self::Value;
    /// Value of a polynomial at a point.
    fn polynomial(&mut self, jet: &Jet<Self::Scalar>, point: &[Self::Value]) -> Self::Value;
}

/// Arithmetic of plain numbers. Polynomials of one space at one point share the monomials.
#[derive(Clone, Debug)]
pub struct Numbers<S> {
    known: Vec<KnownMonomials<S>>,
}

/// Monomials of a space at the last point of its polynomials.
#[derive(Clone, Debug)]
struct KnownMonomials<S> {
    space: Arc<JetSpace>,
    point: Vec<S>,
    values: Vec<S>,
}

impl<S: Real> Numbers<S> {
    /// Arithmetic of plain numbers.
    pub fn new() -> Self {
        Self { known: Vec::new() }
    }

    /// Monomials of a space at a point.
    fn monomials(&mut self, space: &Arc<JetSpace>, point: &[S]) -> &[S] {
        let known = self.known.iter().position(|known| Arc::ptr_eq(&known.space, space));
        let place = known.unwrap_or_else(|| {
            let (point, values) = (Vec::new(), Vec::new());
            self.known.push(KnownMonomials { space: Arc::clone(space), point, values });
            self.known.len() - 1
        });
        let known = &mut self.known[place];
        if known.point != point {
            known.point.clear();
            known.point.extend_from_slice(point);
            space.monomials_at(point, &mut known.values);
        }
        &known.values
    }
}

impl<S: Real> Default for Numbers<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: Real> Arithmetic for Numbers<S> {
    type Scalar = S;
    type Value = S;

    fn constant(&mut self, value: S) -> S {
        value
    }

    fn add(&mut self, a: &S, b: &S) -> S {
        *a + *b
    }

    fn multiply(&mut self, a: &S, b: &S) -> S {
        *a * *b
    }

    fn multiply_add(&mut self, a: &S, b: &S, c: &S) -> S {
        a.mul_add(*b, *c)
    }

    fn root_of_positive_part(&mut self, a: &S) -> S {
        if *a > S::zero() { a.sqrt() } else { S::zero() }
    }

    fn half_reciprocal(&mut self, a: &S) -> S {
        if *a > S::zero() { S::from_f64(0.5) / *a } else { S::zero() }
    }

    fn held(&mut self, a: &S) -> S {
        *a
    }

    fn polynomial(&mut self, jet: &Jet<S>, point: &[S]) -> S {
        jet.evaluate_on(self.monomials(jet.space(), point))
    }
}

/// The free flow about the entry.
struct EntryFlow<V> {
    /// Time from the minimum of the gap, negative.
    time: V,
    /// Coefficients of each force, in the time since the entry.
    forces: Vec<Vec<V>>,
    /// Coefficients of the release function along the free flow, in the time since the entry.
    release: Vec<V>,
}

/// One Taylor step: coefficients in the time divided by the length of the step.
struct Step<V> {
    /// Series of each moved component.
    states: Vec<Vec<V>>,
    /// Series of the release function.
    release: Vec<V>,
}

impl<S: Scalar> FlownContact<S> {
    /// Image of a point (coordinates; parameters), and its depth.
    pub fn act<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        point: &[A::Value],
    ) -> (Vec<A::Value>, A::Value) {
        let depth = arithmetic.polynomial(&self.depth, point);
        let y = arithmetic.root_of_positive_part(&depth);
        (self.act_at(arithmetic, &y, point), depth)
    }

    /// Correction of each coordinate by a contact of depth variable `y`.
    fn corrections<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let entry = self.entry(arithmetic, y, point);
        let (flown, added) = self.fly(arithmetic, y, &entry);
        let time = arithmetic.add(&entry.time, &flown);
        self.on_section(arithmetic, &time, &added, point)
    }

    /// Flies from the entry to the release; returns the contact time and the contribution of the
    /// contact to each moved component.
    fn fly<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        entry: &EntryFlow<A::Value>,
    ) -> (A::Value, Vec<A::Value>) {
        let contact_time = self.contact_time(arithmetic, y);
        let share = arithmetic.constant(S::one() / S::from_f64(self.plan.steps as f64));
        let length = arithmetic.multiply(&contact_time, &share);
        // The division of a flight into steps does not change its end.
        let length = arithmetic.held(&length);
        let step = self.last_step(arithmetic, entry, &length);
        let part = self.release_part(arithmetic, &step.release);
        let states = step.states.iter();
        let added = states.map(|series| horner(arithmetic, series, &part)).collect();
        let before = arithmetic.constant(S::from_f64(self.plan.steps as f64 - 1.0));
        let flown = arithmetic.add(&part, &before);
        (arithmetic.multiply(&flown, &length), added)
    }

    /// Corrections of the coordinates from the contribution of a contact up to the time `s` from
    /// the minimum.
    fn on_section<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        time: &A::Value,
        added: &[A::Value],
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let mut exit = [std::slice::from_ref(time), added, point].concat();
        // If the free field is affine, the flow back does not depend on the point.
        exit.truncate(self.back.first().map_or(0, |jet| jet.space().variables()));
        let back = all(arithmetic, &self.back, &exit);
        all(arithmetic, &self.section, &[&back, point].concat())
    }

    /// Newton steps for `σ`, `0 = −1 + σ² Q(−y σ)` with `Q(s) = Σ_{k≥2} H_k s^{k−2}`, and the free
    /// flow about the entry.
    fn entry<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
    ) -> EntryFlow<A::Value> {
        let quotient = all(arithmetic, &self.gap, point);
        let [minus_one, minus_two, two, zero] =
            [-1.0, -2.0, 2.0, 0.0].map(|value| arithmetic.constant(S::from_f64(value)));
        let minus_y = arithmetic.multiply(y, &minus_one);
        let around = [std::slice::from_ref(y), point].concat();
        let mut sigma = arithmetic.polynomial(&self.entry, &around);
        for _ in 0..self.plan.entry {
            // At a root Newton's step has the root's derivative, whatever the derivative of its
            // starting value.
            sigma = arithmetic.held(&sigma);
            let time = arithmetic.multiply(&minus_y, &sigma);
            let (value, slope) = horner_with_slope(arithmetic, &quotient, &time);
            let scaled = arithmetic.multiply(&sigma, &value);
            let residual = arithmetic.multiply_add(&sigma, &scaled, &minus_one);
            // Derivative: 2 σ Q + s σ Q'.
            let bend = arithmetic.multiply(&time, &slope);
            let bent = arithmetic.multiply(&bend, &sigma);
            let derivative = arithmetic.multiply_add(&two, &scaled, &bent);
            let half = arithmetic.half_reciprocal(&derivative);
            let half = arithmetic.held(&half);
            let step = arithmetic.multiply(&residual, &half);
            sigma = arithmetic.multiply_add(&step, &minus_two, &sigma);
        }
        let time = arithmetic.multiply(&minus_y, &sigma);
        let depth = arithmetic.multiply(&minus_y, y);
        let mut gap = [&[depth, zero.clone()], quotient.as_slice()].concat();
        shift(arithmetic, &mut gap, Some(&time));
        // The gap vanishes on entry; its rounding is not part of the law.
        gap[0] = zero;
        let forces = self.law.forces.iter();
        EntryFlow {
            forces: forces
                .map(|(_, force)| force.about_entry(arithmetic, &gap, &time, point))
                .collect(),
            release: self.law.release.about_entry(arithmetic, &gap, &time, point),
            time,
        }
    }

    /// Contact time `y κ(y)`, approximately.
    fn contact_time<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
    ) -> A::Value {
        let ContactTime { numerator, denominator } = &self.contact_time;
        let [numerator, denominator] = [numerator, denominator].map(|numbers| {
            let values: Vec<_> = numbers.iter().map(|&n| arithmetic.constant(n)).collect();
            horner(arithmetic, &values, y)
        });
        let half = arithmetic.half_reciprocal(&denominator);
        let scaled = arithmetic.multiply(&numerator, &half);
        let twice = arithmetic.add(&scaled, &scaled);
        arithmetic.multiply(&twice, y)
    }

    /// Flies all steps; returns the last one.
    fn last_step<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        entry: &EntryFlow<A::Value>,
        length: &A::Value,
    ) -> Step<A::Value> {
        let mut forces = scaled_all(arithmetic, &entry.forces, length);
        let mut release = scaled(arithmetic, &entry.release, length);
        let zero = arithmetic.constant(S::zero());
        let start = vec![zero; self.law.matrix.len()];
        let order = self.plan.order;
        let mut step = self.law.step(arithmetic, &forces, &release, start, length, order);
        for _ in 1..self.plan.steps {
            let start = step.states.iter().map(|series| sum(arithmetic, series));
            let start = start.collect();
            forces.iter_mut().for_each(|series| shift(arithmetic, series, None));
            shift(arithmetic, &mut release, None);
            step = self.law.step(arithmetic, &forces, &release, start, length, order);
        }
        step
    }

    /// Time of the release as a share of the last step, by Newton's method from 1.
    fn release_part<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        release: &[A::Value],
    ) -> A::Value {
        let minus_two = arithmetic.constant(S::from_f64(-2.0));
        let mut part = arithmetic.constant(S::one());
        for _ in 0..self.plan.release {
            part = arithmetic.held(&part);
            let (value, slope) = horner_with_slope(arithmetic, release, &part);
            let half = arithmetic.half_reciprocal(&slope);
            let half = arithmetic.held(&half);
            let step = arithmetic.multiply(&value, &half);
            part = arithmetic.multiply_add(&step, &minus_two, &part);
        }
        part
    }
}

impl<S: Scalar> LinearLaw<S> {
    /// One Taylor step of a given length: `Z_{k+1} = length (A Z_k + G_k)/(k + 1)`.
    fn step<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        forces: &[Vec<A::Value>],
        release: &[A::Value],
        start: Vec<A::Value>,
        length: &A::Value,
        order: usize,
    ) -> Step<A::Value> {
        let mut states: Vec<Vec<_>> = start.into_iter().map(|value| vec![value]).collect();
        for power in 0..order {
            let inverse = arithmetic.constant(S::one() / S::from_f64(power as f64 + 1.0));
            let factor = arithmetic.multiply(length, &inverse);
            let next: Vec<_> = (0..states.len())
                .map(|component| {
                    let rate = self.rate(arithmetic, forces, &states, component, power);
                    arithmetic.multiply(&factor, &rate)
                })
                .collect();
            let pairs = states.iter_mut().zip(next);
            pairs.for_each(|(series, coefficient)| series.push(coefficient));
        }
        let release = (0..=order)
            .map(|power| {
                let zero = arithmetic.constant(S::zero());
                let free = release.get(power).cloned().unwrap_or(zero);
                dot(arithmetic, &self.release_row, &states, power, free)
            })
            .collect();
        Step { states, release }
    }

    /// Rate `(A Z_k + G_k)_i` of a component.
    fn rate<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        forces: &[Vec<A::Value>],
        states: &[Vec<A::Value>],
        component: usize,
        power: usize,
    ) -> A::Value {
        let own = self.forces.iter().position(|&(i, _)| i == component);
        let force = own.and_then(|number| forces[number].get(power)).cloned();
        let force = force.unwrap_or_else(|| arithmetic.constant(S::zero()));
        dot(arithmetic, &self.matrix[component], states, power, force)
    }
}

impl<S: Scalar> Drive<S> {
    /// Coefficients in the time since the entry; `gap` holds the coefficients of the gap, `time` is
    /// the time of the entry.
    fn about_entry<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        gap: &[A::Value],
        time: &A::Value,
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let by_gap = arithmetic.constant(self.gap);
        let term = |power: usize| {
            let constant = if power == 0 { self.constant } else { S::zero() };
            let mut sum = arithmetic.constant(constant);
            if let Some(next) = gap.get(power + 1) {
                let rate = self.gap_rate * S::from_f64(power as f64 + 1.0);
                let rate = arithmetic.constant(rate);
                sum = arithmetic.multiply_add(&rate, next, &sum);
            }
            arithmetic.multiply_add(&by_gap, &gap[power], &sum)
        };
        let mut sum: Vec<_> = (0..gap.len()).map(term).collect();
        let mut rest = all(arithmetic, &self.rest, point);
        shift(arithmetic, &mut rest, Some(time));
        for (sum, rest) in sum.iter_mut().zip(&rest) {
            *sum = arithmetic.add(sum, rest);
        }
        sum
    }
}

fn all<A: Arithmetic>(
    arithmetic: &mut A,
    jets: &[Jet<A::Scalar>],
    point: &[A::Value],
) -> Vec<A::Value> {
    jets.iter().map(|jet| arithmetic.polynomial(jet, point)).collect()
}

/// Sum `base + Σ_i row_i (series_i)_power`.
fn dot<A: Arithmetic>(
    arithmetic: &mut A,
    row: &[A::Scalar],
    series: &[Vec<A::Value>],
    power: usize,
    base: A::Value,
) -> A::Value {
    let terms = row.iter().zip(series).filter(|&(&entry, _)| entry != A::Scalar::zero());
    terms.fold(base, |sum, (&entry, series)| {
        let entry = arithmetic.constant(entry);
        arithmetic.multiply_add(&entry, &series[power], &sum)
    })
}

/// Converts the coefficients of a polynomial in `t` to those in `t/length`.
fn scaled<A: Arithmetic>(
    arithmetic: &mut A,
    coefficients: &[A::Value],
    length: &A::Value,
) -> Vec<A::Value> {
    let mut power = arithmetic.constant(A::Scalar::one());
    let scale = |coefficient: &A::Value| {
        let value = arithmetic.multiply(&power, coefficient);
        power = arithmetic.multiply(&power, length);
        value
    };
    coefficients.iter().map(scale).collect()
}

/// Converts several polynomials, as [`scaled`] does one.
fn scaled_all<A: Arithmetic>(
    arithmetic: &mut A,
    polynomials: &[Vec<A::Value>],
    length: &A::Value,
) -> Vec<Vec<A::Value>> {
    let polynomials = polynomials.iter();
    polynomials.map(|coefficients| scaled(arithmetic, coefficients, length)).collect()
}

/// Shifts a polynomial to another origin (`None`: to 1), by repeated synthetic division.
fn shift<A: Arithmetic>(arithmetic: &mut A, coefficients: &mut [A::Value], by: Option<&A::Value>) {
    for first in 0..coefficients.len().saturating_sub(1) {
        for place in (first..coefficients.len() - 1).rev() {
            let (lower, upper) = (&coefficients[place], &coefficients[place + 1]);
            coefficients[place] = match by {
                Some(by) => arithmetic.multiply_add(by, upper, lower),
                None => arithmetic.add(lower, upper),
            };
        }
    }
}

/// Value of a polynomial, coefficients from the lowest power up.
fn horner<A: Arithmetic>(arithmetic: &mut A, coefficients: &[A::Value], at: &A::Value) -> A::Value {
    let Some((last, lower)) = coefficients.split_last() else {
        return arithmetic.constant(A::Scalar::zero());
    };
    let lower = lower.iter().rev();
    lower.fold(last.clone(), |sum, coefficient| arithmetic.multiply_add(&sum, at, coefficient))
}

/// Value of a polynomial and of its derivative.
fn horner_with_slope<A: Arithmetic>(
    arithmetic: &mut A,
    coefficients: &[A::Value],
    at: &A::Value,
) -> (A::Value, A::Value) {
    let zero = arithmetic.constant(A::Scalar::zero());
    let Some((last, lower)) = coefficients.split_last() else {
        return (zero.clone(), zero);
    };
    let (mut value, mut slope) = (last.clone(), zero);
    for coefficient in lower.iter().rev() {
        slope = arithmetic.multiply_add(&slope, at, &value);
        value = arithmetic.multiply_add(&value, at, coefficient);
    }
    (value, slope)
}

fn sum<A: Arithmetic>(arithmetic: &mut A, values: &[A::Value]) -> A::Value {
    let zero = arithmetic.constant(A::Scalar::zero());
    let mut values = values.iter().rev();
    let last = values.next().cloned().unwrap_or(zero);
    values.fold(last, |sum, value| arithmetic.add(&sum, value))
}
