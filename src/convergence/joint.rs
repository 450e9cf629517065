//! Points of a window at which two passages in a row make contact.
//!
//! One idea: a contact of depth `y²` moves the next passage by `O(y)`, far beyond the window's
//! depth, so that hardly a point of an even sample makes both. Where both are made the second depth
//! is known worst, and its error moves the image by `δ/2y`: such points have to be looked for. See
//! docs/mathematics/orders.md.

use super::sample::{SHALLOWEST, SamplePoint, WindowSample};
use crate::numeric::Bracket;

/// Depth of the second contact at corners over the window's deepest.
///
/// NOTE: at a hundred times as much, two of the catalogue's choices have two of ten thousand even
/// points each that err by more than their tolerance.
const VERGE: f64 = SHALLOWEST / 100.0;

/// To how much of the window's largest depth variable the first one is found: a hundredth of the
/// shallowest second depth.
const RESOLUTION: f64 = 1e-9;

impl WindowSample {
    /// Those of the points `first..first + count` of a sequence that can be moved, along the
    /// coordinate of the first one's depth, to where a passage and the next one both make
    /// contact, the second by a depth that is spread evenly in its logarithm over four
    /// decades up to the window's. None where there is one passage.
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

    /// The same with every other variable at its half-width, each sign in turn, and the second
    /// contact on the verge: where the second depth errs most, and its error is amplified most.
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

    /// Passages that are followed by another one in the same return, if any.
    fn pairs(&self) -> Option<usize> {
        self.solved()
            .len()
            .checked_sub(1)
            .filter(|&pairs| pairs > 0)
    }

    /// The point moved until the passage after one that makes contact has a depth.
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
        let (state, depths) = at(y)?;
        let deepest = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        (deepest <= self.deepest()).then_some(SamplePoint {
            state,
            parameters,
            depth: deepest,
        })
    }
}
