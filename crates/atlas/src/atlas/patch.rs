//! Polynomials of a map on one box, in coordinates that are `−1` to `1` across the box.

use std::sync::Arc;

use crate::jet::{Jet, JetError, JetSpace};

/// Spaces of jets, each made once with its tables of products.
#[derive(Clone, Debug, Default)]
pub(super) struct SharedSpaces(Vec<Arc<JetSpace>>);

impl SharedSpaces {
    /// Space of these weights and this order.
    pub(super) fn of(&mut self, weights: &[u32], order: usize) -> Result<Arc<JetSpace>, JetError> {
        let is_wanted =
            |space: &&Arc<JetSpace>| space.weights() == weights && space.order() == order;
        if let Some(space) = self.0.iter().find(is_wanted) {
            return Ok(Arc::clone(space));
        }
        let space = JetSpace::new(weights, order)?;
        self.0.push(Arc::clone(&space));
        Ok(space)
    }
}

/// Polynomials of all components of a map, with their coefficients side by side.
#[derive(Clone, Debug)]
pub struct Patch {
    space: Arc<JetSpace>,
    components: usize,
    /// Coefficients of all components, monomial by monomial.
    coefficients: Vec<f64>,
}

impl Patch {
    /// Patch of jets of one space.
    ///
    /// # Panics
    ///
    /// If there is no jet, or the spaces differ.
    pub fn new(jets: &[Jet<f64>]) -> Self {
        let space = Arc::clone(jets[0].space());
        assert!(jets.iter().all(|jet| jet.is_in(&space)), "the jets of a patch share a space");
        let row = |monomial: usize| jets.iter().map(move |jet| jet.coefficients()[monomial]);
        let coefficients = (0..space.len()).flat_map(row).collect();
        Self::of(space, jets.len(), coefficients)
    }

    /// Patch of coefficients, monomial by monomial.
    pub(super) fn of(space: Arc<JetSpace>, components: usize, coefficients: Vec<f64>) -> Self {
        Self { space, components, coefficients }
    }

    /// Space of the polynomials.
    pub fn space(&self) -> &Arc<JetSpace> {
        &self.space
    }

    /// Number of components.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Coefficients of all components, monomial by monomial.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Values of all components at a point; `monomials` is working memory.
    pub fn evaluate(&self, point: &[f64], monomials: &mut Vec<f64>, values: &mut [f64]) {
        self.space.monomials_at(point, monomials);
        values.fill(0.0);
        let rows = self.coefficients.chunks_exact(self.components);
        for (row, &monomial) in rows.zip(monomials.iter()).rev() {
            for (value, &coefficient) in values.iter_mut().zip(row) {
                // NOTE: a fused operation is a call where the processor is not known to have it.
                *value += coefficient * monomial;
            }
        }
    }

    /// Estimate of the terms left out, by component: a geometric series through the sums of the
    /// coefficients of the last two orders and of the two before.
    ///
    /// Infinite if the sums do not fall by half.
    pub fn tails(&self) -> Vec<f64> {
        let order = self.space.order();
        let sum = |component: usize, first: usize, last: usize| -> f64 {
            let range = self.space.degree_range(first).start..self.space.degree_range(last).end;
            range
                .map(|monomial| self.coefficients[monomial * self.components + component].abs())
                .sum()
        };
        let tail = |component: usize| {
            let all = sum(component, 0, order);
            let last = sum(component, order.saturating_sub(1), order);
            let before = sum(component, order.saturating_sub(3), order.saturating_sub(2));
            let ratio = last / before;
            match last <= ROUNDING * all {
                true => last,
                false if ratio <= LARGEST_RATIO => last * ratio / (1.0 - ratio),
                false => f64::INFINITY,
            }
        };
        (0..self.components).map(tail).collect()
    }

    /// Decrease of the sum of the coefficients of the last two orders, relative to `scales`, if the
    /// box is halved along each of the first `axes` variables.
    pub fn gains(&self, axes: usize, scales: &[f64]) -> Vec<f64> {
        let last = self.space.order().saturating_sub(1);
        let mut gains = vec![0.0; axes];
        for monomial in self.space.degree_range(last).start..self.space.len() {
            let row = &self.coefficients[monomial * self.components..][..self.components];
            let size: f64 = row.iter().zip(scales).map(|(value, scale)| value.abs() / scale).sum();
            for (gain, &power) in gains.iter_mut().zip(self.space.exponents(monomial)) {
                *gain += size * (1.0 - 0.5_f64.powi(i32::from(power)));
            }
        }
        gains
    }

    /// Largest possible slope by the last variable on the box, by component.
    fn last_slopes(&self) -> Vec<f64> {
        let last = self.space.variables() - 1;
        let mut slopes = vec![0.0; self.components];
        for (monomial, row) in self.coefficients.chunks_exact(self.components).enumerate() {
            let power = f64::from(self.space.exponents(monomial)[last]);
            slopes.iter_mut().zip(row).for_each(|(slope, value)| *slope += power * value.abs());
        }
        slopes
    }

    /// Bytes of the coefficients.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.coefficients[..])
    }
}

/// Largest ratio of sums of coefficients that are extrapolated.
const LARGEST_RATIO: f64 = 0.5;
/// Sum of the last coefficients, relative to all, that is rounding.
const ROUNDING: f64 = 1e-15;

/// Polynomials of a map on one box.
#[derive(Clone, Debug)]
pub enum Piece {
    /// No graze in the box: one word of contacts, one polynomial.
    Smooth(Patch),
    /// A graze in the box: `depth` is `−h_min`, scaled so that it is at most 1.
    Grazed {
        /// Depth, in the coordinates of the box.
        depth: Patch,
        /// Map where the depth is at most 0.
        missing: Patch,
        /// Map where the depth is positive; its last variable is the root of the depth.
        touching: Patch,
    },
}

/// Part of a piece that gives an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The box has no graze.
    Smooth,
    /// The orbit passes the surface without contact.
    Missing,
    /// The orbit touches the surface.
    Touching,
}

impl Piece {
    /// Values at a point of the box; `memory` holds the point with room for one variable more, and
    /// monomials.
    pub(super) fn evaluate(
        &self,
        point: &mut Vec<f64>,
        monomials: &mut Vec<f64>,
        values: &mut [f64],
    ) -> Side {
        match self {
            Self::Smooth(patch) => {
                patch.evaluate(point, monomials, values);
                Side::Smooth
            }
            Self::Grazed { depth, missing, touching } => {
                let mut found = [0.0];
                depth.evaluate(point, monomials, &mut found);
                if found[0] <= 0.0 {
                    missing.evaluate(point, monomials, values);
                    return Side::Missing;
                }
                point.push(found[0].sqrt());
                touching.evaluate(point, monomials, values);
                Side::Touching
            }
        }
    }

    /// Estimate of the error on the box, relative to `scales`: the tails of the polynomials, and
    /// the root of the tail of a depth times the slope by the depth variable.
    pub(super) fn error(&self, scales: &[f64]) -> f64 {
        let largest = |values: Vec<f64>| {
            values.iter().zip(scales).map(|(value, scale)| value / scale).fold(0.0, f64::max)
        };
        match self {
            Self::Smooth(patch) => largest(patch.tails()),
            Self::Grazed { depth, missing, touching } => {
                let patches = largest(missing.tails()).max(largest(touching.tails()));
                patches + largest(touching.last_slopes()) * depth.tails()[0].sqrt()
            }
        }
    }

    /// Gains of a halving along each axis, of the part of the error that is largest.
    pub(super) fn gains(&self, axes: usize, scales: &[f64], tolerance: f64) -> Vec<f64> {
        match self {
            Self::Smooth(patch) => patch.gains(axes, scales),
            Self::Grazed { depth, missing, touching } => {
                let largest = |values: Vec<f64>| {
                    values
                        .iter()
                        .zip(scales)
                        .map(|(value, scale)| value / scale)
                        .fold(0.0, f64::max)
                };
                let patches = largest(missing.tails()).max(largest(touching.tails()));
                if patches <= 0.5 * tolerance {
                    return depth.gains(axes, &[1.0]);
                }
                let both =
                    missing.gains(axes, scales).into_iter().zip(touching.gains(axes, scales));
                both.map(|(missing, touching)| missing + touching).collect()
            }
        }
    }

    /// Bytes of the coefficients.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Smooth(patch) => patch.bytes(),
            Self::Grazed { depth, missing, touching } => {
                depth.bytes() + missing.bytes() + touching.bytes()
            }
        }
    }
}
