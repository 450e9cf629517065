//! The smooth pieces of a flown passage: series of the free flow about its minimum of the gap.
//!
//! This module also removes the impulse of a damper from a contact law if it is zero at the
//! release.
//!
//! A force `b h'` adds `O(y²)` on the way in and removes it on the way out: if the contact ends on
//! the surface nothing of it remains, only the `O(y³)` of a spring. Computed as a difference of its
//! own terms, that impulse loses a share `1/y` of its digits, and an error in the time of the
//! release counts as much again.
//!
//! Let the release function `ρ` be a multiple `c` of the gap along the free flow, and let
//!
//! ```text
//! u = z − β (ρ(x_f) + r·z),   β = b/c
//! ```
//!
//! The new variable `u` equals `z` at the entry and at the release, where the parenthesis vanishes,
//! and obeys a law of the same form without `b h'`: with `r·β = 0`,
//!
//! ```text
//! u' = (I − β rᵀ) A (I + β rᵀ) u + (I − β rᵀ) A β c h + c_0 + a h,   release where ρ(x_f) + r·u =
//! 0.
//! ```

use std::sync::Arc;

use num_traits::Zero;

use super::{ContactTime, Drive, FlightPlan, FlownContact, LinearLaw};
use crate::expansion::approach::{Approach, DepthVariable, series_about_minimum, time_of_minimum};
use crate::expansion::error::ExpansionError;
use crate::expansion::passage::AffineLaw;
use crate::expansion::routes::Graze;
use crate::expansion::variables::respace;
use crate::flow::{LocalSeries, at_series_time, local_series};
use crate::jet::{Jet, JetSpace};
use crate::numeric::{Dd, Scalar};
use crate::orbit::PoincareSectionKind;

/// Weight to which the starting value of the entry's Newton steps is expanded.
const ENTRY_WEIGHT: u32 = 3;
/// Coefficients below this share of the largest of their series are zero; expansions are in
/// double-double.
pub(super) const VANISHING: f64 = 1e-22;
/// The rest of a force, beside a combination of the gap and its rate, is rounding below this share
/// of the force.
const SAME: f64 = 1e-20;

/// Expansion of one passage.
pub(super) struct SmoothExpansion<'a> {
    graze: &'a Graze,
    affine: &'a AffineLaw,
    weight: u32,
    /// Time from the section point to the minimum.
    minimum_time: Jet<Dd>,
    /// Series of the free flow about the minimum.
    series: LocalSeries<Dd>,
}

impl<'a> SmoothExpansion<'a> {
    /// Expands the free flow about the minimum of the gap; the image then has an error of weight
    /// `weight + 1`.
    pub(super) fn new(
        graze: &'a Graze,
        affine: &'a AffineLaw,
        weight: u32,
    ) -> Result<Self, ExpansionError> {
        let Graze { passage, chart, variables } = graze;
        let space = variables.smooth_space(weight + 1)?;
        let parameters = passage.parameter_jets(&space, variables.coordinates);
        let start = chart.embed(passage, &space, 0)?;
        let kept = vec![space.order(); (weight as usize + 1).max(2) + 1];
        let (minimum_time, series) =
            series_about_minimum(&affine.field, &start, &parameters, kept)?;
        Ok(Self { graze, affine, weight, minimum_time, series })
    }

    /// Expands all pieces of a contact, with an approximate contact time and a plan.
    pub(super) fn contact(
        &self,
        contact_time: ContactTime<Dd>,
        plan: FlightPlan,
    ) -> Result<FlownContact<Dd>, ExpansionError> {
        let gap = self.series.watched(0);
        let mut depth = -&gap[0];
        // The depth vanishes on the grazing orbit: its constant term is rounding.
        depth.coefficients_mut()[0] = Dd::ZERO;
        let quotient = gap.iter().enumerate().skip(2);
        let quotient: Result<_, _> = quotient.map(|(power, jet)| self.cut(jet, power)).collect();
        Ok(FlownContact {
            depth,
            gap: quotient?,
            entry: self.entry()?,
            law: self.law()?,
            back: self.back()?,
            section: self.section()?,
            contact_time,
            plan,
            largest: Vec::new(),
        })
    }

    /// Coefficient of the time's `power`, truncated at the remaining weight.
    fn cut(&self, jet: &Jet<Dd>, power: usize) -> Result<Jet<Dd>, ExpansionError> {
        let weight = (self.weight + 1).saturating_sub(power as u32);
        Ok(respace(jet, &self.graze.variables.smooth_space(weight)?))
    }

    fn entry(&self) -> Result<Jet<Dd>, ExpansionError> {
        let approach = Approach::new(self.graze, ENTRY_WEIGHT, DepthVariable::Added)?;
        approach.entry_time_over_depth(&approach.depth_variable())
    }

    fn law(&self) -> Result<LinearLaw<Dd>, ExpansionError> {
        let forced = self.affine.forced.iter().enumerate();
        let forces = forced
            .map(|(number, &component)| Ok((component, self.drive(2 + number)?)))
            .collect::<Result<_, ExpansionError>>()?;
        let law = LinearLaw {
            matrix: self.affine.matrix.clone(),
            forces,
            release_row: self.affine.release_row.clone(),
            release: self.drive(1)?,
        };
        Ok(law.without_passing_impulse())
    }

    /// A watched function as a combination of 1, the gap and its rate, and the rest.
    fn drive(&self, watched: usize) -> Result<Drive<Dd>, ExpansionError> {
        let (series, gap) = (self.series.watched(watched), self.series.watched(0));
        let ([constant, gap, gap_rate], rest) = decomposed(series, gap);
        let rest = rest.iter().enumerate();
        Ok(Drive {
            constant,
            gap,
            gap_rate,
            rest: rest.map(|(power, jet)| self.cut(jet, power)).collect::<Result<_, _>>()?,
        })
    }

    /// Free flow backwards by `s` from `x_free(s) + z`, minus `x_free(0)`.
    fn back(&self) -> Result<Vec<Jet<Dd>>, ExpansionError> {
        let moved = self.affine.components.len();
        let carried = if self.affine.free_is_affine { 0 } else { self.graze.variables.len() };
        let weights: Vec<u32> = std::iter::once(1)
            .chain(self.added_weights())
            .chain(self.graze.variables.weights[..carried].iter().copied())
            .collect();
        let space = JetSpace::new(&weights, self.weight as usize)?;
        let time = Jet::variable(&space, 0, Dd::ZERO);
        let first = 1 + moved;
        let mut state: Vec<_> = (0..self.graze.passage.dimension())
            .map(|component| {
                let series = self.series.state(component).iter();
                let lifted: Vec<_> =
                    series.map(|jet| self.lift(jet, &space, first, carried)).collect();
                at_series_time(&lifted, &time)
            })
            .collect();
        self.add_variables(&mut state, &space, 1);
        let parameters = self.parameters(&space, first, carried);
        let order = self.weight as usize + 1;
        let series = local_series(&self.graze.passage.field, &state, &parameters, order);
        let back = -&time;
        let components = self.affine.components.iter();
        Ok(components
            .map(|&component| {
                let image = at_series_time(series.state(component), &back);
                depending_on(&image, 1..first)
            })
            .collect())
    }

    /// Corrections of the coordinates, as jets in the contribution of the contact at the minimum.
    fn section(&self) -> Result<Vec<Jet<Dd>>, ExpansionError> {
        let moved = self.affine.components.len();
        let weights: Vec<u32> =
            self.added_weights().chain(self.graze.variables.weights.iter().copied()).collect();
        let space = JetSpace::new(&weights, self.weight as usize)?;
        let carried = self.graze.variables.len();
        let mut state: Vec<_> = (0..self.graze.passage.dimension())
            .map(|component| {
                let jet = &self.series.state(component)[0];
                self.lift(jet, &space, moved, carried)
            })
            .collect();
        self.add_variables(&mut state, &space, 0);
        let parameters = self.parameters(&space, moved, carried);
        let order = (self.weight as usize + 1).max(2);
        let series = local_series(&self.graze.passage.field, &state, &parameters, order);
        let time = match self.graze.chart.section.kind {
            PoincareSectionKind::Tangency => {
                time_of_minimum(series.watched(0), &Jet::zero(&space))?
            }
            PoincareSectionKind::Stroboscopic { .. } => {
                -&self.lift(&self.minimum_time, &space, moved, carried)
            }
        };
        let coordinates = self.graze.chart.section.coordinates.iter();
        Ok(coordinates
            .map(|&component| {
                let image = at_series_time(series.state(component), &time);
                depending_on(&image, 0..moved)
            })
            .collect())
    }

    /// Weight of the contribution to each moved component: a force acts for a time `O(y)`.
    fn added_weights(&self) -> impl Iterator<Item = u32> {
        self.affine.distances.iter().map(|distance| 1 + distance)
    }

    /// Converts a jet in (coordinates; parameters) to a space in which these begin at `first`;
    /// without carried variables, to its value at the graze.
    fn lift(&self, jet: &Jet<Dd>, space: &Arc<JetSpace>, first: usize, carried: usize) -> Jet<Dd> {
        if carried == 0 {
            return Jet::constant(space, jet.head());
        }
        let places: Vec<_> = (first..first + carried).map(Some).collect();
        jet.reinterpret(space, &places)
    }

    fn parameters(&self, space: &Arc<JetSpace>, first: usize, carried: usize) -> Vec<Jet<Dd>> {
        if carried > 0 {
            let first = first + self.graze.variables.coordinates;
            return self.graze.passage.parameter_jets(space, first);
        }
        let values = self.graze.passage.parameters.iter();
        values.map(|&value| Jet::constant(space, value)).collect()
    }

    /// Adds a variable to each moved component, numbered from `first` on.
    fn add_variables(&self, state: &mut [Jet<Dd>], space: &Arc<JetSpace>, first: usize) {
        for (position, &component) in self.affine.components.iter().enumerate() {
            state[component] += &Jet::variable(space, first + position, Dd::ZERO);
        }
    }
}

/// Factors `[c, a, b]` and the rest of `series = c + a h + b h' + rest`.
///
/// At the grazing point the rest has no term in `1`, `t` and `t²`. It contains nothing proportional
/// to the gap or its rate, and these follow the depth exactly.
fn decomposed(series: &[Jet<Dd>], gap: &[Jet<Dd>]) -> ([Dd; 3], Vec<Jet<Dd>>) {
    let scale = series.iter().map(Jet::max_abs).fold(0.0, f64::max);
    let clean = |value: Dd| rounded_away(value, VANISHING * scale);
    let head = |jets: &[Jet<Dd>], power: usize| jets.get(power).map_or(Dd::ZERO, Jet::head);
    let number = |value: usize| Dd::from(value as f64);
    let rate = clean(head(series, 1) / (number(2) * head(gap, 2)));
    let bent = number(3) * head(gap, 3);
    let factor = clean((head(series, 2) - rate * bent) / head(gap, 2));
    let constant = clean(head(series, 0));
    let mut rest: Vec<_> = (0..series.len() - 1)
        .map(|power| {
            let next = gap[power + 1].scale(rate * number(power + 1));
            let known = &gap[power].scale(factor) + &next;
            let offset = if power == 0 { constant } else { Dd::ZERO };
            let rest = (&series[power] - &known).add_constant(-offset);
            rest.map_scalars(|value| rounded_away(value, SAME * scale))
        })
        .collect();
    while rest.last().is_some_and(|jet| jet.max_abs() == 0.0) {
        rest.pop();
    }
    ([constant, factor, rate], rest)
}

/// The value, or 0 if it is no larger than rounding.
fn rounded_away(value: Dd, rounding: f64) -> Dd {
    if value.magnitude() <= rounding { Dd::ZERO } else { value }
}

/// Terms of a jet in which one of these variables occurs.
fn depending_on(jet: &Jet<Dd>, variables: std::ops::Range<usize>) -> Jet<Dd> {
    let largest = jet.max_abs();
    let mut result = Jet::zero(jet.space());
    for (monomial, &value) in jet.coefficients().iter().enumerate() {
        let exponents = &jet.space().exponents(monomial)[variables.clone()];
        let rounding = value.magnitude() <= VANISHING * largest;
        if !rounding && exponents.iter().any(|&exponent| exponent > 0) {
            result.coefficients_mut()[monomial] = value;
        }
    }
    result
}

impl LinearLaw<Dd> {
    /// Law without the impulse of a damper, in the variable `u` of
    /// [`passing_share`](Self::passing_share); unchanged if no force is proportional to the gap's
    /// rate, or if the release function is not proportional to the gap.
    fn without_passing_impulse(mut self) -> Self {
        let Some(share) = self.passing_share() else {
            return self;
        };
        let row = self.release_row.clone();
        let onto_release = columns(&self.matrix).map(|column| dot(&row, &column));
        let onto_release: Vec<_> = onto_release.collect();
        for (entries, &share) in self.matrix.iter_mut().zip(&share) {
            for (entry, &slope) in entries.iter_mut().zip(&onto_release) {
                *entry = sum(*entry, -(share * slope));
            }
        }
        let rates: Vec<_> = self.matrix.iter().map(|row| dot(row, &share)).collect();
        for (entries, &rate) in self.matrix.iter_mut().zip(&rates) {
            for (entry, &slope) in entries.iter_mut().zip(&row) {
                *entry = sum(*entry, rate * slope);
            }
        }
        let slope = self.release.gap;
        for (component, rate) in rates.into_iter().enumerate() {
            self.press(component, rate * slope);
        }
        self
    }

    /// Vector `β`, if a force is proportional to the gap's rate and the release function to the
    /// gap.
    fn passing_share(&self) -> Option<Vec<Dd>> {
        let release = &self.release;
        let by_gap = release.constant.is_zero()
            && release.gap_rate.is_zero()
            && !release.gap.is_zero()
            && release.rest.is_empty();
        let mut forces = self.forces.iter();
        // A force on the release function itself would change it immediately.
        let apart = forces.all(|&(component, _)| self.release_row[component].is_zero());
        let mut share = vec![Dd::ZERO; self.matrix.len()];
        for (component, force) in &self.forces {
            share[*component] = force.gap_rate / release.gap;
        }
        let damped = share.iter().any(|share| !share.is_zero());
        (by_gap && apart && damped).then_some(share)
    }

    /// Replaces the damper of a component by a spring on the gap.
    fn press(&mut self, component: usize, stiffness: Dd) {
        let mut forces = self.forces.iter();
        if let Some(own) = forces.position(|&(forced, _)| forced == component) {
            let force = &mut self.forces[own].1;
            force.gap_rate = Dd::ZERO;
            force.gap = sum(force.gap, stiffness);
        } else if !stiffness.is_zero() {
            let spring =
                Drive { constant: Dd::ZERO, gap: stiffness, gap_rate: Dd::ZERO, rest: Vec::new() };
            self.forces.push((component, spring));
        }
    }
}

fn columns(matrix: &[Vec<Dd>]) -> impl Iterator<Item = Vec<Dd>> {
    (0..matrix.len()).map(|column| matrix.iter().map(|row| row[column]).collect())
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    let terms = a.iter().zip(b).map(|(&a, &b)| a * b);
    terms.fold(Dd::ZERO, sum)
}

/// Sum `a + b`, and 0 if the terms cancel to rounding: a zero term would cost operations.
fn sum(a: Dd, b: Dd) -> Dd {
    rounded_away(a + b, VANISHING * a.magnitude().max(b.magnitude()))
}
