//! Images and preimages of a point under a number of returns.
//!
//! One idea: flow and impacts can be reversed wherever the contact law can be inverted. There a
//! section map has a unique preimage, and Newton's method with the map's own derivative finds it
//! from the preimage of a nearby point. At a graze the derivative is unbounded: steps that do not
//! come nearer are halved, and further starts beside the first one lie beyond the graze.

use nalgebra::{Matrix2, Vector2};

use super::data::{ManifoldEnd, ManifoldKind};
use crate::expansion::MapWindow;
use crate::iteration::DiscreteMap;

/// Most Newton steps to a preimage, and the residual and distance from the plane, in half-ranges,
/// beyond which the search is given up.
const NEWTON_STEPS: usize = 20;
const DIVERGED: f64 = 1e3;
/// Steps along a graze, and the distance for the difference that gives its direction, in
/// half-ranges.
const SLIDES: usize = 4;
const ASIDE: f64 = 1e-4;
/// Most halvings of a step that does not come nearer.
const HALVINGS: usize = 24;
/// Largest residual of a preimage, in half-ranges.
const RESIDUAL: f64 = 1e-10;
/// Displacements of further starts from the first one, in half-ranges.
const FURTHER: [f64; 4] = [1e-5, -1e-5, 1e-2, -1e-2];
/// Residual below which no further step is taken.
const ROUNDING: f64 = 1e-14;

/// Effort of a search for a preimage.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PreimageEffort {
    /// Newton's method with halved steps, also from starts beyond a graze, near a known preimage.
    Near,
    /// Newton's method only, from an arbitrary start.
    Far,
}

/// A number of returns of a map at a time, forwards or backwards.
pub(super) struct Returns<'a> {
    pub(super) map: &'a dyn DiscreteMap,
    pub(super) kind: ManifoldKind,
    /// Number of returns at a time.
    pub(super) count: usize,
    /// Centre and half-ranges of the plane.
    pub(super) middle: [f64; 2],
    pub(super) scales: [f64; 2],
    /// The window and the parameters, if the map is used alone.
    pub(super) window: Option<(&'a MapWindow, &'a [f64])>,
    /// Whether a point lies in the neighbourhood of the plane.
    pub(super) is_near: &'a dyn Fn([f64; 2]) -> bool,
}

impl Returns<'_> {
    /// Distance of two points, in half-ranges.
    pub(super) fn distance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        ((a[0] - b[0]) / self.scales[0]).hypot((a[1] - b[1]) / self.scales[1])
    }

    /// Next point of the curve: the image, or for a stable manifold the preimage near `guess`.
    pub(super) fn next(&self, point: [f64; 2], guess: [f64; 2]) -> Result<[f64; 2], ManifoldEnd> {
        self.followed(point, guess, PreimageEffort::Near)
    }

    /// Next point, found as by [`next`](Self::next), with starts all over the plane if there is no
    /// preimage near `guess`.
    pub(super) fn next_anywhere(
        &self,
        point: [f64; 2],
        guess: [f64; 2],
    ) -> Result<[f64; 2], ManifoldEnd> {
        let mut next = self.followed(point, guess, PreimageEffort::Far);
        for start in self.starts() {
            if next != Err(ManifoldEnd::NoPreimage) {
                break;
            }
            next = self.followed(point, start, PreimageEffort::Far);
        }
        next
    }

    fn followed(
        &self,
        point: [f64; 2],
        guess: [f64; 2],
        effort: PreimageEffort,
    ) -> Result<[f64; 2], ManifoldEnd> {
        let next = match self.kind {
            ManifoldKind::Unstable => {
                (0..self.count).try_fold(point, |point, _| self.image(point))?
            }
            ManifoldKind::Stable => self.source(point, guess, effort)?,
        };
        if (self.is_near)(next) { Ok(next) } else { Err(ManifoldEnd::Plane) }
    }

    /// Starts for preimages that are not near a known one.
    fn starts(&self) -> Vec<[f64; 2]> {
        const PLACES: [f64; 3] = [0.0, -0.6, 0.6];
        let place = |axis: usize, offset: f64| self.middle[axis] + offset * self.scales[axis];
        let rows = PLACES.into_iter().map(|offset| place(1, offset));
        rows.flat_map(|row| PLACES.map(|offset| [place(0, offset), row])).collect()
    }

    /// Image under one return.
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

    /// Preimage of a point under all returns, near a guess.
    fn source(
        &self,
        point: [f64; 2],
        guess: [f64; 2],
        effort: PreimageEffort,
    ) -> Result<[f64; 2], ManifoldEnd> {
        let mut guesses = vec![guess];
        for _ in 1..self.count {
            let last = guesses[guesses.len() - 1];
            guesses.push(self.image(last).unwrap_or(last));
        }
        let found = guesses.into_iter().rev().try_fold(point, |point, guess| {
            self.preimage(point, guess, effort).ok_or(ManifoldEnd::NoPreimage)
        })?;
        // The window is checked at every return: points outside do not belong to the map.
        (0..self.count).try_fold(found, |point, _| self.image(point))?;
        Ok(found)
    }

    /// Preimage under one return.
    fn preimage(
        &self,
        target: [f64; 2],
        guess: [f64; 2],
        effort: PreimageEffort,
    ) -> Option<[f64; 2]> {
        if effort == PreimageEffort::Far {
            return self.newton(target, guess, 1);
        }
        let beside = |(axis, offset): (usize, f64)| {
            let mut start = guess;
            start[axis] += offset * self.scales[axis];
            self.newton(target, start, 1)
        };
        let further = FURTHER.into_iter().flat_map(|offset| [(0, offset), (1, offset)]);
        // Full steps first: a step across a graze comes nearer only with the next one.
        let near = [1, HALVINGS].into_iter().find_map(|most| self.newton(target, guess, most));
        let near = near.or_else(|| self.newton(target, self.beyond_graze(target, guess)?, 1));
        near.or_else(|| further.into_iter().find_map(beside))
    }

    /// Start beyond a graze: the preimage without the contact, moved along the graze until its
    /// image is as near as possible.
    ///
    /// A contact of depth `y²` adds `−c y` to the smooth map, along one direction and mostly along
    /// the graze. Newton's method without that term mistakes `(c y)²` for a depth.
    fn beyond_graze(&self, target: [f64; 2], start: [f64; 2]) -> Option<[f64; 2]> {
        let derivative = self.derivative(start)?;
        let step = derivative.lu().solve(&self.defect(start, target)?)?;
        let moved = |state: [f64; 2], by: Vector2<f64>| {
            [0, 1].map(|axis| state[axis] + by[axis] * self.scales[axis])
        };
        let mut state = moved(start, -step);
        let depth = self.depth(state);
        if depth <= 0.0 {
            return None;
        }
        let slope = |axis: usize| {
            let aside = |offset: f64| {
                let mut by = Vector2::zeros();
                by[axis] = offset;
                let other = self.depth(moved(state, by));
                (other > 0.0).then_some((other - depth) / offset)
            };
            aside(ASIDE).or_else(|| aside(-ASIDE))
        };
        let along = Vector2::new(-slope(1)?, slope(0)?).try_normalize(0.0)?;
        let changes = derivative * along;
        for _ in 0..SLIDES {
            let share = changes.dot(&self.defect(state, target)?) / changes.norm_squared();
            state = moved(state, -share * along);
        }
        Some(state)
    }

    /// Depth of the contacts of one return.
    fn depth(&self, state: [f64; 2]) -> f64 {
        self.map.step(&state, &[], &mut [0.0; 2]).depth
    }

    /// Newton's method with full steps (`tries` = 1), or with steps halved until they come nearer.
    fn newton(&self, target: [f64; 2], start: [f64; 2], tries: usize) -> Option<[f64; 2]> {
        let mut state = start;
        let mut defect = self.defect(state, target)?;
        for _ in 0..NEWTON_STEPS {
            if defect.norm() <= ROUNDING || self.is_lost(state, defect) {
                break;
            }
            let Some(step) = self.derivative(state).and_then(|by| by.lu().solve(&defect)) else {
                break;
            };
            let mut share = 1.0;
            let nearer = (0..tries).find_map(|_| {
                let moved = [0, 1].map(|axis| state[axis] - share * step[axis] * self.scales[axis]);
                share *= 0.5;
                let left = self.defect(moved, target)?;
                (tries == 1 || left.norm() < defect.norm()).then_some((moved, left))
            });
            let Some(nearer) = nearer else { break };
            if nearer.1.norm() >= defect.norm() && defect.norm() <= RESIDUAL {
                break;
            }
            (state, defect) = nearer;
        }
        (defect.norm() <= RESIDUAL).then_some(state)
    }

    /// Whether a search has gone far from the plane.
    fn is_lost(&self, state: [f64; 2], defect: Vector2<f64>) -> bool {
        defect.norm() > DIVERGED || self.distance(state, self.middle) > DIVERGED
    }

    /// Residual: image minus target, in half-ranges; `None` without an image.
    fn defect(&self, state: [f64; 2], target: [f64; 2]) -> Option<Vector2<f64>> {
        let mut image = [f64::NAN; 2];
        let valid = self.map.step(&state, &[], &mut image).valid;
        let defect = |axis: usize| {
            self.map.circle().shortest(axis, image[axis] - target[axis]) / self.scales[axis]
        };
        valid.then(|| Vector2::new(defect(0), defect(1)))
    }

    /// Jacobian of one return in half-ranges; at a graze the Jacobian at a point beside it.
    fn derivative(&self, state: [f64; 2]) -> Option<Matrix2<f64>> {
        /// Displacements to a point with a derivative, in half-ranges.
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
