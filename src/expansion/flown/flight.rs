//! A flown contact at work, operation by operation, on any [`Arithmetic`].

use num_traits::{One, Zero};

use super::arithmetic::Arithmetic;
use super::contact::{ContactTime, Drive, FlownContact, LinearLaw};
use crate::jet::Jet;
use crate::numeric::Scalar;

/// The free flow seen from the entry.
pub(super) struct Entry<V> {
    /// Time from the minimum of the gap, negative.
    pub(super) time: V,
    /// Coefficients of each force, in the time since the entry.
    pub(super) forces: Vec<Vec<V>>,
    /// Coefficients of the release function along the free flow.
    pub(super) release: Vec<V>,
}

/// One Taylor step: coefficients in the time over the length of the step.
pub(super) struct Step<V> {
    /// Of each moved component.
    pub(super) states: Vec<Vec<V>>,
    /// Of the release function.
    pub(super) release: Vec<V>,
}

impl<S: Scalar> FlownContact<S> {
    /// The image of a point (coordinates; parameters), and its depth.
    pub fn act<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        point: &[A::Value],
    ) -> (Vec<A::Value>, A::Value) {
        let depth = arithmetic.polynomial(&self.depth, point);
        let y = arithmetic.root_of_positive_part(&depth);
        (self.act_at(arithmetic, &y, point), depth)
    }

    /// What a contact of depth variable `y` adds to each coordinate.
    pub(super) fn corrections<A: Arithmetic<Scalar = S>>(
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

    /// From the entry to the release: the contact time and what the contact has added to each moved
    /// component.
    pub(super) fn fly<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        entry: &Entry<A::Value>,
    ) -> (A::Value, Vec<A::Value>) {
        let contact_time = self.contact_time(arithmetic, y);
        let share = arithmetic.constant(S::one() / S::from_f64(self.plan.steps as f64));
        let length = arithmetic.multiply(&contact_time, &share);
        // How a flight is cut into steps does not change where it ends.
        let length = arithmetic.held(&length);
        let step = self.last_step(arithmetic, entry, &length);
        let part = self.release_part(arithmetic, &step.release);
        let states = step.states.iter();
        let added = states
            .map(|series| horner(arithmetic, series, &part))
            .collect();
        let before = arithmetic.constant(S::from_f64(self.plan.steps as f64 - 1.0));
        let flown = arithmetic.add(&part, &before);
        (arithmetic.multiply(&flown, &length), added)
    }

    /// Corrections of the coordinates from what a contact has added up to the time `s` from the
    /// minimum.
    pub(super) fn on_section<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        time: &A::Value,
        added: &[A::Value],
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let mut exit = [std::slice::from_ref(time), added, point].concat();
        // Where the free field is affine the way back does not depend on the point.
        exit.truncate(self.back.first().map_or(0, |jet| jet.space().variables()));
        let back = all(arithmetic, &self.back, &exit);
        all(arithmetic, &self.section, &[&back, point].concat())
    }

    /// Newton's steps for `σ`, `0 = −1 + σ² Q(−y σ)` with `Q(s) = Σ_{k≥2} H_k s^{k−2}`, and the
    /// free flow about the entry.
    pub(super) fn entry<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
    ) -> Entry<A::Value> {
        let quotient = all(arithmetic, &self.gap, point);
        let [minus_one, minus_two, two, zero] =
            [-1.0, -2.0, 2.0, 0.0].map(|value| arithmetic.constant(S::from_f64(value)));
        let minus_y = arithmetic.multiply(y, &minus_one);
        let around = [std::slice::from_ref(y), point].concat();
        let mut sigma = arithmetic.polynomial(&self.entry, &around);
        for _ in 0..self.plan.entry {
            // At a root Newton's step has the root's derivative, whatever the derivative of where
            // it begins.
            sigma = arithmetic.held(&sigma);
            let time = arithmetic.multiply(&minus_y, &sigma);
            let (value, slope) = horner_with_slope(arithmetic, &quotient, &time);
            let scaled = arithmetic.multiply(&sigma, &value);
            let residual = arithmetic.multiply_add(&sigma, &scaled, &minus_one);
            // The derivative: 2 σ Q + s σ Q'.
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
        // The gap vanishes on entry; what rounding leaves of it is not part of the law.
        gap[0] = zero;
        let forces = self.law.forces.iter();
        Entry {
            forces: forces
                .map(|(_, force)| force.about_entry(arithmetic, &gap, &time, point))
                .collect(),
            release: self.law.release.about_entry(arithmetic, &gap, &time, point),
            time,
        }
    }

    /// `y κ(y)`.
    pub(super) fn contact_time<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
    ) -> A::Value {
        let ContactTime {
            numerator,
            denominator,
        } = &self.contact_time;
        let [numerator, denominator] = [numerator, denominator].map(|numbers| {
            let values: Vec<_> = numbers.iter().map(|&n| arithmetic.constant(n)).collect();
            horner(arithmetic, &values, y)
        });
        let half = arithmetic.half_reciprocal(&denominator);
        let scaled = arithmetic.multiply(&numerator, &half);
        let twice = arithmetic.add(&scaled, &scaled);
        arithmetic.multiply(&twice, y)
    }

    /// Flies all steps; the last one.
    fn last_step<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        entry: &Entry<A::Value>,
        length: &A::Value,
    ) -> Step<A::Value> {
        let mut forces = scaled_all(arithmetic, &entry.forces, length);
        let mut release = scaled(arithmetic, &entry.release, length);
        let zero = arithmetic.constant(S::zero());
        let start = vec![zero; self.law.matrix.len()];
        let order = self.plan.order;
        let mut step = self
            .law
            .step(arithmetic, &forces, &release, start, length, order);
        for _ in 1..self.plan.steps {
            let start = step.states.iter().map(|series| sum(arithmetic, series));
            let start = start.collect();
            forces
                .iter_mut()
                .for_each(|series| shift(arithmetic, series, None));
            shift(arithmetic, &mut release, None);
            step = self
                .law
                .step(arithmetic, &forces, &release, start, length, order);
        }
        step
    }

    /// Newton's steps for the part of the last step at which the contact is released, from 1 on.
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
    /// One Taylor step of this length: `Z_{k+1} = length (A Z_k + G_k)/(k + 1)`.
    pub(super) fn step<A: Arithmetic<Scalar = S>>(
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

    /// `(A Z_k + G_k)_i`.
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
    /// Coefficients in the time since the entry; `gap` holds those of the gap, `time` is that of
    /// the entry.
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
    jets.iter()
        .map(|jet| arithmetic.polynomial(jet, point))
        .collect()
}

/// `base + Σ_i row_i (series_i)_power`.
fn dot<A: Arithmetic>(
    arithmetic: &mut A,
    row: &[A::Scalar],
    series: &[Vec<A::Value>],
    power: usize,
    base: A::Value,
) -> A::Value {
    let terms = row
        .iter()
        .zip(series)
        .filter(|&(&entry, _)| entry != A::Scalar::zero());
    terms.fold(base, |sum, (&entry, series)| {
        let entry = arithmetic.constant(entry);
        arithmetic.multiply_add(&entry, &series[power], &sum)
    })
}

/// The coefficients of a polynomial in `t` as those of one in `t/length`.
pub(super) fn scaled<A: Arithmetic>(
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

/// The same for several polynomials.
pub(super) fn scaled_all<A: Arithmetic>(
    arithmetic: &mut A,
    polynomials: &[Vec<A::Value>],
    length: &A::Value,
) -> Vec<Vec<A::Value>> {
    let polynomials = polynomials.iter();
    polynomials
        .map(|coefficients| scaled(arithmetic, coefficients, length))
        .collect()
}

/// The coefficients about another point (`None`: about 1), by repeated synthetic division.
pub(super) fn shift<A: Arithmetic>(
    arithmetic: &mut A,
    coefficients: &mut [A::Value],
    by: Option<&A::Value>,
) {
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

/// A polynomial, lowest power first.
fn horner<A: Arithmetic>(arithmetic: &mut A, coefficients: &[A::Value], at: &A::Value) -> A::Value {
    let Some((last, lower)) = coefficients.split_last() else {
        return arithmetic.constant(A::Scalar::zero());
    };
    let lower = lower.iter().rev();
    lower.fold(last.clone(), |sum, coefficient| {
        arithmetic.multiply_add(&sum, at, coefficient)
    })
}

/// A polynomial and its derivative.
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
