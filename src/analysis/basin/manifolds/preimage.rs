//! Images and preimages of a point after some returns.
//!
//! One idea: flow and impacts can be run backwards wherever the law of contact can be inverted, so
//! a section map has one preimage there, and Newton's method with the map's own derivative finds it
//! from the preimage of a point nearby. Where the derivative is not bounded, at a graze, steps that
//! do not come nearer are halved.

use nalgebra::{Matrix2, Vector2};

use super::{ManifoldEnd, ManifoldKind};
use crate::expansion::MapWindow;
use crate::iteration::DiscreteMap;

/// Newton steps to a preimage.
const NEWTON_STEPS: usize = 40;
/// Halvings of a step that does not come nearer.
const HALVINGS: usize = 30;
/// How far the image of a preimage may be from what it is the preimage of, in half-ranges.
const RESIDUAL: f64 = 1e-10;
/// A residual at which no further step is taken.
const ROUNDING: f64 = 1e-14;

/// Some returns of a map at a time, forwards or backwards.
pub(super) struct Returns<'a> {
    pub(super) map: &'a dyn DiscreteMap,
    pub(super) kind: ManifoldKind,
    /// Returns at a time.
    pub(super) count: usize,
    /// Half-ranges of the plane.
    pub(super) scales: [f64; 2],
    /// The window and the parameters, where the map is used alone.
    pub(super) window: Option<(&'a MapWindow, &'a [f64])>,
    /// Whether a point is in the surroundings of the plane.
    pub(super) is_near: &'a dyn Fn([f64; 2]) -> bool,
}

impl Returns<'_> {
    /// The distance of two points, in half-ranges.
    pub(super) fn distance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        ((a[0] - b[0]) / self.scales[0]).hypot((a[1] - b[1]) / self.scales[1])
    }

    /// Where a point goes, or comes from: near `guess` then.
    pub(super) fn next(&self, point: [f64; 2], guess: [f64; 2]) -> Result<[f64; 2], ManifoldEnd> {
        let next = match self.kind {
            ManifoldKind::Unstable => {
                (0..self.count).try_fold(point, |point, _| self.image(point))?
            }
            ManifoldKind::Stable => self.source(point, guess)?,
        };
        if (self.is_near)(next) { Ok(next) } else { Err(ManifoldEnd::Plane) }
    }

    /// One return.
    fn image(&self, point: [f64; 2]) -> Result<[f64; 2], ManifoldEnd> {
        let mut image = [f64::NAN; 2];
        let step = self.map.step(&point, &[], &mut image);
        let holds = |(window, parameters): (&MapWindow, &[f64])| {
            window.holds(&point, parameters, &[step.depth])
        };
        match step.valid {
            _ if !self.window.is_none_or(holds) => Err(ManifoldEnd::Window),
            true => Ok(image),
            false => Err(ManifoldEnd::NoImage),
        }
    }

    /// The point that comes here, near a guess.
    fn source(&self, point: [f64; 2], guess: [f64; 2]) -> Result<[f64; 2], ManifoldEnd> {
        let mut guesses = vec![guess];
        for _ in 1..self.count {
            let last = guesses[guesses.len() - 1];
            guesses.push(self.image(last).unwrap_or(last));
        }
        let found = guesses.into_iter().rev().try_fold(point, |point, guess| {
            self.preimage(point, guess).ok_or(ManifoldEnd::NoPreimage)
        })?;
        // The window is asked at every return: what is outside is not the map's.
        (0..self.count).try_fold(found, |point, _| self.image(point))?;
        Ok(found)
    }

    /// The preimage of one return.
    fn preimage(&self, target: [f64; 2], guess: [f64; 2]) -> Option<[f64; 2]> {
        let mut state = guess;
        let mut defect = self.defect(state, target)?;
        for _ in 0..NEWTON_STEPS {
            if defect.norm() <= ROUNDING {
                break;
            }
            let Some(step) = self.derivative(state).and_then(|by| by.lu().solve(&defect)) else {
                break;
            };
            let mut share = 1.0;
            let nearer = (0..HALVINGS).find_map(|_| {
                let moved = [0, 1].map(|axis| state[axis] - share * step[axis] * self.scales[axis]);
                share *= 0.5;
                let left = self.defect(moved, target)?;
                (left.norm() < defect.norm()).then_some((moved, left))
            });
            let Some(nearer) = nearer else { break };
            (state, defect) = nearer;
        }
        (defect.norm() <= RESIDUAL).then_some(state)
    }

    /// By how much an image is not what it is to be, in half-ranges.
    fn defect(&self, state: [f64; 2], target: [f64; 2]) -> Option<Vector2<f64>> {
        let mut image = [f64::NAN; 2];
        let valid = self.map.step(&state, &[], &mut image).valid;
        let defect = |axis: usize| (image[axis] - target[axis]) / self.scales[axis];
        valid.then(|| Vector2::new(defect(0), defect(1)))
    }

    /// The derivative of one return, in half-ranges; at a graze that of a point beside it.
    fn derivative(&self, state: [f64; 2]) -> Option<Matrix2<f64>> {
        /// Places beside a point where the map has no derivative, in half-ranges.
        const BESIDE: [f64; 3] = [0.0, 1e-9, -1e-9];
        BESIDE.into_iter().find_map(|offset| {
            let state = [0, 1].map(|axis| state[axis] + offset * self.scales[axis]);
            let (mut image, mut rows) = ([0.0; 2], [f64::NAN; 4]);
            self.map.step_jacobian(&state, &[], &mut image, &mut rows);
            let entry = |row: usize, column: usize| {
                rows[2 * row + column] * self.scales[column] / self.scales[row]
            };
            let matrix = Matrix2::new(entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1));
            matrix.iter().all(|entry| entry.is_finite()).then_some(matrix)
        })
    }
}
