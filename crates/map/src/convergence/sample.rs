//! Points of a window: evenly spread, at its corners, and at joint contacts of two passages in a
//! row; the same in every run.
//!
//! A contact of depth `y²` moves the next passage by `O(y)`, far beyond the window's depth, so an
//! even sample contains hardly a point with two contacts. At such a joint point the second depth
//! has its largest error `δ`, which moves the image by `δ/2y`; joint points are therefore sought
//! separately. See docs/mathematics/orders.md.

use crate::analysis::{DepthEvaluation, MapEvaluation};
use crate::expansion::{LocalMap, MapWindow};
use crate::interruption::check;
use crate::numeric::{Bracket, low_discrepancy};

/// Smallest depth of a sample, relative to the window's.
pub(super) const SHALLOWEST: f64 = 1e-4;

/// Number of points of the sequence per joint point that is sought.
const POINTS_TO_JOINT: usize = 4;

/// Number of variables whose signs are combined in corners; further variables share their signs.
const CORNERS: usize = 5;

/// Largest number of Newton steps to a depth.
const NEWTON_STEPS: usize = 30;

/// Largest change of a depth along a coordinate, relative to that along a parameter, that is
/// rounding.
const UNMOVED: f64 = 1e-20;
/// Step of a difference quotient, relative to a half-width, when a depth is met to rounding.
const FINE_STEP: f64 = 1e-6;

/// Largest residual of a depth, relative to the window's, that is accepted when Newton's method
/// stalls.
const STALLED: f64 = 1e-12;

/// Number of cells, over both sides of a half-width, in which a depth is sought.
const CELLS: usize = 16;

/// One starting point, in offsets.
#[derive(Clone, Debug, PartialEq)]
pub struct SamplePoint {
    /// One offset per coordinate.
    pub state: Vec<f64>,
    /// One offset per active parameter.
    pub parameters: Vec<f64>,
    /// Depth `y²` of the deepest passage, by the map that was sampled.
    pub depth: f64,
}

/// Samples the contact part of a window with a low-discrepancy sequence.
///
/// Depths are spread evenly in their logarithm over four decades up to the window's, all other
/// variables evenly over the half-widths. The coordinate along which the depth is steepest is
/// solved for; a parameter, if no coordinate moves the depth. An infinite half-width counts as the
/// window's depth, the size of a deviation of weight 2. With several passages each is placed at the
/// depth in turn, which determines the depths of the others within the window; joint contacts of
/// two passages are sampled [separately](Self::joint_points).
#[derive(Clone, Debug)]
pub struct WindowSample {
    depths: DepthEvaluation<f64>,
    deepest: f64,
    state: Vec<f64>,
    parameters: Vec<f64>,
    /// For each passage, the variable along which its depth is steepest, which is solved for.
    pub(super) steepest: Vec<usize>,
}

impl WindowSample {
    /// Sample of the window of a map.
    pub fn new(map: &LocalMap) -> Self {
        let window = &map.window;
        let width = |&width: &f64| {
            if width.is_finite() { width } else { window.depth }
        };
        let sample = Self {
            depths: MapEvaluation::depths(map),
            deepest: window.depth,
            state: window.state.iter().map(width).collect(),
            parameters: window.parameter.iter().map(width).collect(),
            steepest: vec![0; map.passages()],
        };
        sample.with_steepest()
    }

    /// Finds the steepest variable of each passage.
    fn with_steepest(mut self) -> Self {
        let passages = 0..self.steepest.len();
        self.steepest = passages.map(|passage| self.steepest_variable(passage)).collect();
        self
    }

    /// Multiplies the window's depth and its half-widths (coordinates; parameters) by factors.
    ///
    /// # Panics
    ///
    /// If there is not one factor per variable.
    pub fn scaled(&self, depth: f64, variables: &[f64]) -> Self {
        assert_eq!(variables.len(), self.state.len() + self.parameters.len());
        let (state, parameters) = variables.split_at(self.state.len());
        let times = |widths: &[f64], factors: &[f64]| {
            let pairs = widths.iter().zip(factors);
            pairs.map(|(width, factor)| width * factor).collect()
        };
        Self {
            deepest: self.deepest * depth,
            state: times(&self.state, state),
            parameters: times(&self.parameters, parameters),
            ..self.clone()
        }
    }

    /// Sample of another window of the same map; all its bounds are finite.
    pub(super) fn resized(&self, window: &MapWindow) -> Self {
        let resized = Self {
            deepest: window.depth,
            state: window.state.clone(),
            parameters: window.parameter.clone(),
            ..self.clone()
        };
        resized.with_steepest()
    }

    /// Largest depth of the window.
    pub fn deepest(&self) -> f64 {
        self.deepest
    }

    /// Depth `y²` of a passage, negative without contact, at offsets of the variables (coordinates;
    /// parameters).
    pub(super) fn depth(&self, passage: usize, offsets: &[f64]) -> f64 {
        let (state, parameters) = offsets.split_at(self.state.len());
        self.depths.at(state, parameters)[passage]
    }

    /// Depths of all passages at offsets.
    pub(super) fn depths_at(&self, state: &[f64], parameters: &[f64]) -> Vec<f64> {
        self.depths.at(state, parameters)
    }

    /// Number of variables that are coordinates.
    pub(super) fn coordinates(&self) -> usize {
        self.state.len()
    }

    /// Half-widths of the variables (coordinates; parameters), with infinite ones replaced.
    pub fn widths(&self) -> Vec<f64> {
        [self.state.as_slice(), &self.parameters].concat()
    }

    /// Point number `index` of the sequence; `None` if no state of that depth is near.
    pub fn point(&self, index: usize) -> Option<SamplePoint> {
        let (depth, state, parameters) = self.spread(index);
        let passage = index % self.steepest.len().max(1);
        self.at_depth(passage, state, parameters, depth)
    }

    /// Element `index` of the sequence: a depth, even in its logarithm, and even offsets of the
    /// coordinates and parameters.
    pub(super) fn spread(&self, index: usize) -> (f64, Vec<f64>, Vec<f64>) {
        let widths = self.widths();
        let shares = low_discrepancy(index, widths.len() + 1);
        let spread = |(&width, &share): (&f64, &f64)| width * (2.0 * share - 1.0);
        let offsets: Vec<f64> = widths.iter().zip(&shares[1..]).map(spread).collect();
        let (state, parameters) = offsets.split_at(self.state.len());
        let depth = self.deepest * SHALLOWEST.powf(1.0 - shares[0]);
        (depth, state.to_vec(), parameters.to_vec())
    }

    /// Points at the window's depth with all other variables at their half-widths, for each
    /// combination of signs. Errors are largest there, and a sequence that fills the window rarely
    /// reaches them. At most 32 per passage.
    pub fn corners(&self) -> Vec<SamplePoint> {
        let ends = self.ends();
        let passages = 0..self.steepest.len();
        let corner = |(passage, (state, parameters)): (usize, &(Vec<f64>, Vec<f64>))| {
            self.at_depth(passage, state.clone(), parameters.clone(), self.deepest)
        };
        let corners = passages.flat_map(|passage| ends.iter().map(move |end| (passage, end)));
        corners.filter_map(corner).collect()
    }

    /// All variables at their half-widths, for each combination of signs: offsets of coordinates
    /// and of parameters.
    pub(super) fn ends(&self) -> Vec<(Vec<f64>, Vec<f64>)> {
        let widths = self.widths();
        let end = |signs: usize| {
            let sign = |variable: usize| 1.0 - 2.0 * (signs >> (variable % CORNERS) & 1) as f64;
            let offsets = widths.iter().enumerate();
            let offsets: Vec<f64> = offsets.map(|(i, width)| sign(i) * width).collect();
            let (state, parameters) = offsets.split_at(self.state.len());
            (state.to_vec(), parameters.to_vec())
        };
        (0..1usize << widths.len().min(CORNERS)).map(end).collect()
    }

    /// Points by which a map is judged: corners, points `first..first + count` of the sequence, a
    /// quarter as many joint points, and joint corners.
    pub(super) fn judging(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        let corners = [self.joint_corners(), self.corners()].concat();
        [corners, self.fresh(first, count)].concat()
    }

    /// Points as from [`judging`](Self::judging), without the corners.
    pub(super) fn fresh(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        let joint = self.joint_points(first, count / POINTS_TO_JOINT);
        [self.points(first, count), joint].concat()
    }

    /// Points in the window: those of [`judging`](Self::judging), further ones in contact or on its
    /// verge, and as many spread evenly over the window and its corners, with or without contact.
    /// Statements on a window concern all its points, and no others.
    pub(super) fn inside(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        let points = self.judging(first, count).into_iter();
        let points = points.chain(self.touching(first, count)).chain(self.anywhere(first, count));
        points.filter(|point| self.holds(point)).collect()
    }

    /// Points at which a passage makes contact. Each variable in turn is solved for, with the
    /// others at their half-widths: at the full depth (except for the steepest coordinate), which
    /// gives the corners that the depth cuts off the window, and on the verge. In addition, the
    /// variable that moves the depth most over its half-width is solved for, with the others spread
    /// as in [`point`](Self::point).
    ///
    /// NOTE: if a parameter moves the depth by far more than the window is deep, contact is made in
    /// a thin layer of the window. Points with the parameter spread over its half-width are in that
    /// layer only with the coordinate beyond its half-width.
    fn touching(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        let joined = |(state, parameters): (Vec<f64>, Vec<f64>)| [state, parameters].concat();
        let ends: Vec<Vec<f64>> = self.ends().into_iter().map(joined).collect();
        let mut touching = Vec::new();
        for (passage, &steepest) in self.steepest.iter().enumerate() {
            for variable in 0..self.widths().len() {
                // The initial sign of the variable solved for does not matter.
                let ends = ends.iter().filter(|offsets| offsets[variable] > 0.0);
                let deep = ends.clone().filter(|_| variable != steepest);
                touching.extend(deep.filter_map(|end| {
                    self.solved_for(passage, variable, end.clone(), self.deepest)
                }));
                touching.extend(ends.filter_map(|end| {
                    let mut offsets = end.clone();
                    offsets[variable] = 0.0;
                    self.solved(passage, variable, &mut offsets, VERGE * self.deepest)?;
                    Some(self.point_at(offsets))
                }));
            }
            let variable = self.widest_variable(passage);
            let numbers = (first..first + count).filter(|_| variable != steepest);
            touching.extend(numbers.filter_map(|index| {
                let (depth, state, parameters) = self.spread(index);
                self.solved_for(passage, variable, joined((state, parameters)), depth)
            }));
        }
        touching
    }

    /// Number of the coordinate or parameter that moves the depth of a passage most over its
    /// half-width.
    fn widest_variable(&self, passage: usize) -> usize {
        let steps = self.widths().into_iter().map(|width| 1e-4 * width);
        self.most_moving(passage, &steps.collect::<Vec<_>>())
    }

    /// Moves a variable until a passage has a given depth; returns the point.
    fn solved_for(
        &self,
        passage: usize,
        variable: usize,
        offsets: Vec<f64>,
        depth: f64,
    ) -> Option<SamplePoint> {
        let step = 1e-4 * self.widths()[variable];
        Some(self.moved_to(passage, (variable, step), offsets, depth)?.0)
    }

    /// Moves a variable as in [`solve`](Self::solve); returns the point and the depths of all
    /// passages.
    fn moved_to(
        &self,
        passage: usize,
        along: (usize, f64),
        mut offsets: Vec<f64>,
        depth: f64,
    ) -> Option<(SamplePoint, Vec<f64>)> {
        let depths = self.solve(passage, along, &mut offsets, depth)?;
        let parameters = offsets.split_off(self.state.len());
        let depth = depths.iter().copied().fold(depths[passage], f64::max);
        Some((SamplePoint { state: offsets, parameters, depth }, depths))
    }

    /// Point at offsets of all variables.
    pub(super) fn point_at(&self, mut state: Vec<f64>) -> SamplePoint {
        let parameters = state.split_off(self.state.len());
        let depths = self.depths_at(&state, &parameters);
        let depth = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        SamplePoint { state, parameters, depth }
    }

    /// Moves a variable from its value until a passage has a given depth, 0 included, to rounding.
    /// Newton's method is used or, if that leaves the half-width, a bracket between two evenly
    /// spaced offsets whose depths enclose the given one. `None` if neither succeeds.
    pub(super) fn solved(
        &self,
        passage: usize,
        variable: usize,
        offsets: &mut [f64],
        depth: f64,
    ) -> Option<()> {
        let (start, width) = (offsets[variable], self.widths()[variable]);
        let lacks = |offsets: &mut [f64], offset: f64| {
            offsets[variable] = offset;
            self.depth(passage, offsets) - depth
        };
        let tolerance = (1e-9 * depth.abs()).max(f64::EPSILON * self.deepest);
        let mut here = start;
        for _ in 0..NEWTON_STEPS {
            let value = lacks(offsets, here);
            if value.abs() <= tolerance {
                return Some(());
            }
            let step = FINE_STEP * width;
            let next = here - value * step / (lacks(offsets, here + step) - value);
            let stays = (next - here).abs() <= 2.0 * f64::EPSILON * here.abs();
            if stays && value.abs() <= STALLED * self.deepest {
                offsets[variable] = here;
                return Some(());
            }
            if next.is_nan() || next.abs() > width || stays {
                break;
            }
            here = next;
        }
        let even = |cell: usize| width * (2.0 * cell as f64 / CELLS as f64 - 1.0);
        let values: Vec<f64> = (0..=CELLS).map(|cell| lacks(offsets, even(cell))).collect();
        let changes = |&cell: &usize| (values[cell] > 0.0) != (values[cell + 1] > 0.0);
        let far = |cell: usize| (even(cell) + even(cell + 1) - 2.0 * start).abs();
        let nearest = |&a: &usize, &b: &usize| far(a).total_cmp(&far(b));
        let cell = (0..CELLS).filter(changes).min_by(nearest)?;
        let ends = (values[cell], values[cell + 1]);
        let bracket = Bracket::new(even(cell), even(cell + 1), ends.0, ends.1).ok()?;
        let found = bracket.itp(ends, f64::EPSILON * width, |offset| lacks(offsets, offset));
        offsets[variable] = found.root()?;
        Some(())
    }

    /// Variables in decreasing order of their effect on the depth of a passage over their
    /// half-widths.
    pub(super) fn by_reach(&self, passage: usize) -> Vec<usize> {
        let widths = self.widths();
        let moved = |&variable: &usize| self.moved(passage, variable, FINE_STEP * widths[variable]);
        let mut variables: Vec<usize> = (0..widths.len()).collect();
        variables.sort_by(|a, b| moved(b).total_cmp(&moved(a)));
        variables
    }

    /// Moves a variable until a passage has a given depth, by Newton's method with difference
    /// quotients over a step; returns the depths of all passages there.
    fn solve(
        &self,
        passage: usize,
        (variable, step): (usize, f64),
        offsets: &mut [f64],
        depth: f64,
    ) -> Option<Vec<f64>> {
        offsets[variable] = 0.0;
        for _ in 0..NEWTON_STEPS {
            let (state, parameters) = offsets.split_at(self.state.len());
            let depths = self.depths.at(state, parameters);
            let here = depths[passage];
            if (here - depth).abs() <= 1e-9 * depth.abs() {
                return Some(depths);
            }
            let mut shifted = offsets.to_vec();
            shifted[variable] += step;
            let slope = (self.depth(passage, &shifted) - here) / step;
            offsets[variable] += (depth - here) / slope;
        }
        None
    }

    /// Largest depth of a passage over the corners of the half-widths, whatever the window's depth.
    pub(super) fn deepest_of(&self, passage: usize) -> f64 {
        let depths = self.ends().into_iter();
        let depths = depths.map(|(state, parameters)| self.depths_at(&state, &parameters)[passage]);
        depths.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Absolute offset of one variable, with the others zero, at which a passage has a given depth.
    pub(super) fn reaches(&self, passage: usize, variable: usize, depth: f64) -> Option<f64> {
        let mut offsets = vec![0.0; self.widths().len()];
        let step = 1e-4 * self.widths()[variable];
        self.solve(passage, (variable, step), &mut offsets, depth)?;
        Some(offsets[variable].abs())
    }

    /// Largest depth over the corners and `count` points of the half-widths, whatever the window's
    /// depth.
    pub(super) fn deepest_reached(&self, count: usize) -> f64 {
        let anywhere = self.anywhere(0, count);
        anywhere.map(|point| point.depth).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Corners of the half-widths and points spread evenly over them, whatever their depth.
    fn anywhere(&self, first: usize, count: usize) -> impl Iterator<Item = SamplePoint> {
        let spread = (first..first + count).map(|index| {
            let (_, state, parameters) = self.spread(index);
            (state, parameters)
        });
        self.ends().into_iter().chain(spread).map(|(state, parameters)| {
            let depths = self.depths.at(&state, &parameters);
            let depth = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
            SamplePoint { state, parameters, depth }
        })
    }

    /// Whether a point lies in the window. The tolerance exceeds that to which depths are solved
    /// for.
    pub(super) fn holds(&self, point: &SamplePoint) -> bool {
        let offsets = point.state.iter().chain(&point.parameters);
        let mut pairs = offsets.zip(self.state.iter().chain(&self.parameters));
        point.depth <= self.deepest * (1.0 + 1e-6)
            && pairs.all(|(offset, width)| offset.abs() <= *width)
    }

    /// Points `first..first + count` of the sequence, as far as they exist.
    pub fn points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        (first..first + count).filter_map(|index| self.point(index)).collect()
    }

    /// Moves the steepest variable of a passage until that passage has a given depth; `None` if
    /// another passage is then deeper than the window.
    fn at_depth(
        &self,
        passage: usize,
        state: Vec<f64>,
        parameters: Vec<f64>,
        depth: f64,
    ) -> Option<SamplePoint> {
        let (point, depths) = self.placed(passage, state, &parameters, depth)?;
        (point.depth <= self.deepest.max(depths[passage])).then_some(point)
    }

    /// Moves the steepest variable of a passage until that passage has a given depth; returns the
    /// point and the depths of all passages.
    pub(super) fn placed(
        &self,
        passage: usize,
        state: Vec<f64>,
        parameters: &[f64],
        depth: f64,
    ) -> Option<(SamplePoint, Vec<f64>)> {
        check();
        let along = (*self.steepest.get(passage)?, 1e-4 * self.deepest);
        self.moved_to(passage, along, [state.as_slice(), parameters].concat(), depth)
    }

    /// Coordinate along which the depth of a passage changes most; the parameter, if the
    /// coordinates move it by rounding alone.
    fn steepest_variable(&self, passage: usize) -> usize {
        let steps = vec![1e-4 * self.deepest; self.state.len() + self.parameters.len()];
        let [coordinate, any] =
            [self.state.len(), steps.len()].map(|count| self.most_moving(passage, &steps[..count]));
        let moved = |variable| self.moved(passage, variable, steps[variable]);
        if moved(coordinate) > UNMOVED * moved(any) { coordinate } else { any }
    }

    /// Variable that moves the depth of a passage most, each by its own step.
    fn most_moving(&self, passage: usize, steps: &[f64]) -> usize {
        let moved = |variable: usize| self.moved(passage, variable, steps[variable]);
        (0..steps.len()).max_by(|&a, &b| moved(a).total_cmp(&moved(b))).unwrap_or(0)
    }

    /// Magnitude of the depth of a passage where one variable has an offset.
    fn moved(&self, passage: usize, variable: usize, offset: f64) -> f64 {
        let mut offsets = vec![0.0; self.state.len() + self.parameters.len()];
        offsets[variable] = offset;
        self.depth(passage, &offsets).abs()
    }
}

/// Depth of the second contact at joint corners, relative to the window's.
///
/// NOTE: with a hundred times this depth, two of the catalogue's choices exceed their tolerance,
/// each at two of ten thousand even points.
const VERGE: f64 = SHALLOWEST / 100.0;

/// Accuracy of the first depth variable at joint points, relative to the window's largest: a
/// hundredth of the shallowest second depth.
const RESOLUTION: f64 = 1e-9;

impl WindowSample {
    /// Joint points: points `first..first + count` of a sequence, moved along the steepest
    /// coordinate of a passage's depth until that passage and the next one both make contact.
    /// Depths of the second contact are spread evenly in their logarithm over four decades up to
    /// the window's. Points that cannot be moved there are left out; with one passage there are
    /// none.
    pub fn joint_points(&self, first: usize, count: usize) -> Vec<SamplePoint> {
        let Some(pairs) = self.pairs() else {
            return Vec::new();
        };
        let joint = |index: usize| {
            let (depth, state, parameters) = self.spread(index);
            self.joint(index % pairs, state, parameters, depth)
        };
        (first..first + count).filter_map(joint).collect()
    }

    /// Joint points with every other variable at its half-width, for each combination of signs, and
    /// the second contact on the verge: the second depth has its largest error there, amplified
    /// most.
    pub fn joint_corners(&self) -> Vec<SamplePoint> {
        let verge = VERGE * self.deepest();
        let ends = self.ends();
        let pairs = 0..self.pairs().unwrap_or(0);
        let corners = pairs.flat_map(|pair| ends.iter().map(move |end| (pair, end)));
        corners
            .filter_map(|(pair, (state, parameters))| {
                self.joint(pair, state.clone(), parameters.clone(), verge)
            })
            .collect()
    }

    /// Number of passages followed by another one in the same return, if there are any.
    fn pairs(&self) -> Option<usize> {
        self.steepest.len().checked_sub(1).filter(|&pairs| pairs > 0)
    }

    /// Moves a point until a passage makes contact and the next one has the depth `second`.
    fn joint(
        &self,
        passage: usize,
        state: Vec<f64>,
        parameters: Vec<f64>,
        second: f64,
    ) -> Option<SamplePoint> {
        let at = |y: f64| self.placed(passage, state.clone(), &parameters, y * y);
        let excess = |y: f64| at(y).map_or(f64::NAN, |(_, depths)| depths[passage + 1] - second);
        let ends = [SHALLOWEST, 1.0].map(|share: f64| (share * self.deepest()).sqrt());
        let [shallow, deep] = ends.map(excess);
        let bracket = Bracket::new(ends[0], ends[1], shallow, deep).ok()?;
        let tolerance = RESOLUTION * ends[1];
        let y = bracket.itp((shallow, deep), tolerance, excess).root()?;
        let (point, _) = at(y)?;
        (point.depth <= self.deepest()).then_some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_fills_the_cube_evenly() {
        let points: Vec<_> = (0..256).map(|index| low_discrepancy(index, 3)).collect();
        for coordinate in 0..3 {
            for eighth in 0..8 {
                let inside = |point: &&Vec<f64>| (point[coordinate] * 8.0) as usize == eighth;
                let count = points.iter().filter(inside).count();
                // 32 expected; the worst of 24 cells of a random sample would be off by about 12.
                assert!((26..=38).contains(&count), "{coordinate}, {eighth}: {count}");
            }
        }
    }
}
