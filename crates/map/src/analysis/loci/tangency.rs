//! Quadratic tangency of folds and flips with the grazing curve at a point of codimension two, from
//! the jets of the map.
//!
//! One idea: near the point an orbit is determined by the depth variable `η` of the grazing contact
//! and the first parameter `τ`; all else is analytic in them. A locus is a line `η = m τ` to first
//! order, and leaves the grazing curve `η = 0` by `κ τ²`. See docs/mathematics/loci.md.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::equations::{begins_smoothly, null_vectors};
use crate::analysis::MapEvaluation;
use crate::analysis::periodic::ContactItinerary;
use crate::expansion::Arithmetic;
use crate::jet::{Jet, JetSpace, implicit_roots, substitute_all};
use crate::numeric::{Real, Scalar};

/// Largest value of a singular form, relative to its slopes.
const SINGULAR: f64 = 1e-6;

/// Numbers with their derivatives to the order of a space.
struct JetNumbers<S: Scalar> {
    space: Arc<JetSpace>,
    scalar: std::marker::PhantomData<S>,
}

impl<S: Real> Arithmetic for JetNumbers<S> {
    type Scalar = S;
    type Value = Jet<S>;

    fn constant(&mut self, value: S) -> Jet<S> {
        Jet::constant(&self.space, value)
    }

    fn add(&mut self, a: &Jet<S>, b: &Jet<S>) -> Jet<S> {
        a + b
    }

    fn multiply(&mut self, a: &Jet<S>, b: &Jet<S>) -> Jet<S> {
        a * b
    }

    fn multiply_add(&mut self, a: &Jet<S>, b: &Jet<S>, c: &Jet<S>) -> Jet<S> {
        &(a * b) + c
    }

    fn root_of_positive_part(&mut self, a: &Jet<S>) -> Jet<S> {
        match a.head() > S::zero() {
            true => a.sqrt(),
            false => Jet::zero(&self.space),
        }
    }

    fn half_reciprocal(&mut self, a: &Jet<S>) -> Jet<S> {
        match a.head() > S::zero() {
            true => &Jet::constant(&self.space, S::from_f64(0.5)) / a,
            false => Jet::zero(&self.space),
        }
    }

    /// Keeps derivatives, so that the steps of a solver determine the higher derivatives of its
    /// root.
    fn held(&mut self, a: &Jet<S>) -> Jet<S> {
        a.clone()
    }

    fn polynomial(&mut self, jet: &Jet<S>, point: &[Jet<S>]) -> Jet<S> {
        let mut image = substitute_all(std::slice::from_ref(jet), point);
        image.pop().unwrap_or_else(|| Jet::zero(&self.space))
    }
}

/// An orbit of a map at a point of codimension two, in offsets.
#[derive(Clone, Debug)]
pub(super) struct TangencyPoint<'a, S> {
    pub(super) itinerary: &'a ContactItinerary,
    /// First section point.
    pub(super) state: Vec<S>,
    /// Depth variables of the contacts.
    pub(super) depth_variables: Vec<S>,
    /// Index of the grazing contact.
    pub(super) grazing: usize,
    /// All active parameters.
    pub(super) parameters: Vec<S>,
    /// Indices of the two parameters of the plane.
    pub(super) plane: [usize; 2],
}

/// Departure of a locus from the grazing curve: `y = slope τ + …`, `Q − Q_G = coefficient τ² + …`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leaving<S> {
    pub(super) slope: S,
    pub(super) coefficient: S,
}

impl<S: Real> TangencyPoint<'_, S> {
    /// Departure of the locus of a multiplier, 1 or −1, from the grazing curve; `None` at a
    /// degenerate point, and at compliant stops, where multipliers do not jump at a graze.
    ///
    /// `units` are the lengths of the unknowns: coordinates, depth variables, both parameters.
    pub(super) fn leaving(
        &self,
        map: &MapEvaluation<S>,
        units: &[f64],
        multiplier: f64,
    ) -> Option<Leaving<S>> {
        let (d, contacts) = (self.state.len(), self.depth_variables.len());
        let rows = d + contacts;
        let equations = self.equations(map, units)?;
        let plane = JetSpace::uniform(2, 2).ok()?;
        // All unknowns except y of the grazing contact and the first parameter.
        let solved: Vec<usize> =
            (0..rows + 2).filter(|&u| u != d + self.grazing && u != rows).collect();
        let along = |roots: &[Jet<S>]| -> Vec<Jet<S>> {
            let mut roots = roots.iter();
            let variable = |number| Jet::variable(&plane, number, S::zero());
            (0..rows + 2)
                .map(|unknown| match unknown {
                    unknown if unknown == d + self.grazing => variable(0),
                    unknown if unknown == rows => variable(1),
                    _ => match roots.next() {
                        Some(root) => root.clone().add_constant(-S::one()),
                        None => Jet::zero(&plane),
                    },
                })
                .collect()
        };
        let slopes: Vec<Vec<Jet<S>>> = equations
            .iter()
            .map(|jet| (0..rows + 2).map(|variable| jet.derivative(variable)).collect())
            .collect();
        // NOTE: roots converge relative to their size, which is rounding at the point itself; they
        // are therefore solved for with 1 added.
        let start = vec![Jet::constant(&plane, S::one()); solved.len()];
        let roots = implicit_roots(&start, |roots| {
            let point = along(roots);
            let jacobian = slopes.iter().map(|row| {
                let row: Vec<Jet<S>> = solved.iter().map(|&u| row[u].clone()).collect();
                substitute_all(&row, &point)
            });
            (substitute_all(&equations, &point), jacobian.collect())
        })
        .ok()?;
        let second = roots.last()?;
        let (bend, mixed) = (second.coefficient(&[2, 0]), second.coefficient(&[1, 1]));
        // det K vanishes on η = m τ: wᵀ (K_η m + K_τ) v = 0.
        let point = along(&roots);
        let entries: Vec<Vec<Jet<S>>> =
            slopes.iter().map(|row| substitute_all(&row[..rows], &point)).collect();
        let part = |powers: &[u8]| {
            DMatrix::from_fn(rows, rows, |row, column| entries[row][column].coefficient(powers))
        };
        let mut singular = part(&[0, 0]);
        if begins_smoothly(&singular, d + self.grazing, 1.0) {
            return None;
        }
        for place in 0..d {
            singular[(place, place)] += S::from_f64(1.0 - multiplier);
        }
        let [v, w]: [DVector<S>; 2] = null_vectors(&singular)?;
        // If no multiplier of the locus is critical here, the locus does not reach the point.
        let left = w.dot(&(&singular * &v)).magnitude();
        let along_depth = w.dot(&(part(&[1, 0]) * &v));
        let along_parameter = w.dot(&(part(&[0, 1]) * &v));
        let slope = -along_parameter / along_depth;
        let coefficient = slope * (mixed + slope * bend);
        let [depth, first, second] =
            [units[d + self.grazing], units[rows], units[rows + 1]].map(S::from_f64);
        let found = Leaving {
            slope: slope * depth / first,
            coefficient: coefficient * second / (first * first),
        };
        let is_there = left < SINGULAR * along_depth.magnitude().max(along_parameter.magnitude());
        (is_there && found.slope.is_finite() && found.coefficient.is_finite()).then_some(found)
    }

    /// Equations of the orbit as jets of degree 2 in all unknowns, over their units.
    fn equations(&self, map: &MapEvaluation<S>, units: &[f64]) -> Option<Vec<Jet<S>>> {
        let (d, contacts) = (self.state.len(), self.depth_variables.len());
        let rows = d + contacts;
        let space = JetSpace::uniform(rows + 2, 2).ok()?;
        let mut arithmetic = JetNumbers { space: space.clone(), scalar: std::marker::PhantomData };
        let variable = |unknown: usize, value: S| {
            let mut jet = Jet::variable(&space, unknown, S::zero());
            jet.scale_in_place(S::from_f64(units[unknown]));
            jet.add_constant(value)
        };
        let parameters: Vec<Jet<S>> = (0..self.parameters.len())
            .map(|number| {
                let value = self.parameters[number];
                let place = self.plane.iter().position(|&parameter| parameter == number);
                place.map_or_else(
                    || Jet::constant(&space, value),
                    |place| variable(rows + place, value),
                )
            })
            .collect();
        let first: Vec<Jet<S>> =
            self.state.iter().enumerate().map(|(place, &value)| variable(place, value)).collect();
        let (mut point, mut lacking, mut contact) = (first.clone(), Vec::new(), 0);
        for made in self.itinerary.returns() {
            point.extend(parameters.iter().cloned());
            let mut passage = 0;
            point = map.image_in(&mut arithmetic, point, |_, depth| {
                passage += 1;
                if !made.contains(passage - 1) {
                    return None;
                }
                let y = variable(d + contact, self.depth_variables[contact]);
                contact += 1;
                lacking.push(depth - &(&y * &y));
                Some(y)
            });
        }
        let closing = point.iter().zip(&first).map(|(end, start)| end - start);
        let all = closing.chain(lacking).enumerate().map(|(row, mut jet)| {
            let unit = S::from_f64(units[row]);
            jet.scale_in_place(S::one() / if row < d { unit } else { unit * unit });
            jet
        });
        Some(all.collect())
    }
}
