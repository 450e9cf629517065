//! One half of a manifold, point by point.
//!
//! One idea: a point is named by its generation and its place on the first piece of the curve, as
//! one number `k + t` with `t` from 0 to 1: it is the `k`-th image of the point at
//! `δ fᵗ` beside the saddle, `f` the factor by which the curve grows. Steps in that number are cut
//! until neighbours lie near each other and the curve does not turn too much between them.

use std::collections::BTreeMap;

use super::ManifoldEnd;
use super::preimage::Returns;

/// Largest distance of neighbours, in half-ranges of the plane.
const SPACING: f64 = 0.02;
/// Largest product of the distance and the angle by which a curve turns, and a distance below
/// which it may turn.
const TURNING: f64 = 5e-4;
const FINEST: f64 = 1e-4;
/// Longest curve, in half-ranges, and most places at which a point is looked for.
const LONGEST: f64 = 60.0;
const MOST_PLACES: usize = 40_000;
/// Most generations.
const GENERATIONS: f64 = 300.0;
/// First and longest step, and the shortest, at which the map is taken to jump.
const FIRST_STEP: f64 = 1.0 / 16.0;
const SHORTEST_STEP: f64 = 1e-11;
/// Halvings of the place where a curve is interrupted.
const BORDER_HALVINGS: usize = 36;
/// Neighbours nearer than this, in half-ranges, have a straight curve between them.
const STRAIGHT: f64 = 1e-7;
/// A generation shorter than this, in half-ranges, and than the one before is at rest.
const AT_REST: f64 = 1e-5;

/// First distances from the saddle, in half-ranges: the largest and the smallest, and by how much
/// they differ; and the largest deviation from growth in proportion.
const FARTHEST: f64 = 1e-4;
const NEAREST: f64 = 1e-10;
const NEARER: f64 = 0.2;
const DEVIATION: f64 = 1e-3;

/// The first piece of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seed {
    saddle: [f64; 2],
    /// To the first point.
    offset: [f64; 2],
    /// Growth from generation to generation.
    factor: f64,
}

impl Seed {
    /// The largest piece beside a saddle on which the curve grows in proportion; `None` if none is
    /// found. `direction` is one half-range long.
    pub(super) fn beside(
        returns: &Returns<'_>,
        saddle: [f64; 2],
        direction: [f64; 2],
        factor: f64,
    ) -> Option<Self> {
        let mut distance = FARTHEST;
        while distance >= NEAREST {
            let offset = direction.map(|value| distance * value);
            let seed = Self { saddle, offset, factor };
            let expected = seed.at(1.0);
            let grown = returns.next(seed.at(0.0), expected);
            let near = |grown| returns.distance(grown, expected) <= DEVIATION * factor * distance;
            if grown.is_ok_and(near) {
                return Some(seed);
            }
            distance *= NEARER;
        }
        None
    }

    /// The point of a place on the piece, from 0 to 1.
    fn at(&self, place: f64) -> [f64; 2] {
        let length = self.factor.powf(place);
        [0, 1].map(|axis| self.saddle[axis] + length * self.offset[axis])
    }
}

/// A point, or why there is none.
type Node = Result<[f64; 2], ManifoldEnd>;

/// A curve on its way.
pub(super) struct Course<'a> {
    returns: &'a Returns<'a>,
    seed: Seed,
    /// By the bits of their places, which are not negative.
    nodes: BTreeMap<u64, Node>,
    pieces: Vec<Vec<[f64; 2]>>,
    /// The place of the last point.
    place: f64,
    step: f64,
    length: f64,
}

impl<'a> Course<'a> {
    pub(super) fn new(returns: &'a Returns<'a>, seed: Seed) -> Self {
        let first = seed.at(0.0);
        Self {
            returns,
            seed,
            nodes: BTreeMap::from([(0.0_f64.to_bits(), Ok(first))]),
            pieces: vec![vec![seed.saddle, first]],
            place: 0.0,
            step: FIRST_STEP,
            length: 0.0,
        }
    }

    /// The pieces of the curve, and why it ends.
    pub(super) fn run(mut self) -> (Vec<Vec<[f64; 2]>>, ManifoldEnd) {
        let end = self.end();
        self.pieces.retain(|piece| piece.len() > 1);
        (self.pieces, end)
    }

    fn end(&mut self) -> ManifoldEnd {
        let (mut generation, mut begun, mut before) = (1.0, 0.0, f64::INFINITY);
        while self.length < LONGEST && self.nodes.len() < MOST_PLACES && self.place < GENERATIONS {
            if self.place >= generation {
                let grown = self.length - begun;
                if grown < AT_REST && grown < before {
                    return ManifoldEnd::Rest;
                }
                (generation, begun, before) = (self.place.floor() + 1.0, self.length, grown);
            }
            if let Err(end) = self.advance() {
                return end;
            }
        }
        ManifoldEnd::Length
    }

    /// Takes the next point, or passes an interruption; an error where the curve ends.
    fn advance(&mut self) -> Result<(), ManifoldEnd> {
        let last = self.last();
        let mut halvings = 0;
        loop {
            match self.point(self.place + self.step, last) {
                Ok(next) if self.is_smooth(next) => {
                    let distance = self.returns.distance(last, next);
                    self.push(self.place + self.step, next);
                    let growth = (0.7 * SPACING / distance.max(1e-3 * SPACING)).clamp(0.5, 2.0);
                    self.step = (self.step * growth).min(FIRST_STEP);
                    return Ok(());
                }
                Ok(next) if self.step <= SHORTEST_STEP => {
                    // The map jumps.
                    self.pieces.push(Vec::new());
                    self.push(self.place + self.step, next);
                    self.step = FIRST_STEP;
                    return Ok(());
                }
                Err(end) if halvings >= BORDER_HALVINGS || self.step <= SHORTEST_STEP => {
                    return self.pass(end);
                }
                Err(_) => {
                    halvings += 1;
                    self.step *= 0.5;
                }
                Ok(_) => self.step *= 0.5,
            }
        }
    }

    /// Goes on after an interruption: at the first point of the generation before that is sent back
    /// near the plane.
    fn pass(&mut self, end: ManifoldEnd) -> Result<(), ManifoldEnd> {
        let last = self.last();
        let mut without = self.place + self.step;
        let parents = self.nodes.range((without - 1.0).max(0.0).to_bits()..);
        let parents = parents.filter_map(|(&bits, node)| node.ok().map(|_| f64::from_bits(bits)));
        for place in parents.map(|place| place + 1.0).collect::<Vec<_>>() {
            let Ok(mut found) = self.point_anywhere(place, last) else {
                without = without.max(place);
                continue;
            };
            let mut with = place;
            for _ in 0..BORDER_HALVINGS {
                let middle = 0.5 * (without + with);
                match self.point(middle, found) {
                    Ok(point) => (with, found) = (middle, point),
                    Err(_) => without = middle,
                }
            }
            if self.returns.distance(last, found) > 2.0 * SPACING {
                self.pieces.push(Vec::new());
            }
            self.push(with, found);
            self.step = (place - with).clamp(SHORTEST_STEP, FIRST_STEP);
            return Ok(());
        }
        Err(end)
    }

    /// The point of a place; a preimage is looked for near `guess`, then about the plane.
    fn point_anywhere(&mut self, place: f64, guess: [f64; 2]) -> Node {
        let mut node = self.point(place, guess);
        let mut starts = self.returns.starts().into_iter();
        while node == Err(ManifoldEnd::NoPreimage) {
            let Some(start) = starts.next() else { break };
            node = self.point(place, start);
        }
        node
    }

    /// Whether a point is near the last one, and the curve does not turn much there.
    fn is_smooth(&self, next: [f64; 2]) -> bool {
        let (last, returns) = (self.last(), self.returns);
        let distance = returns.distance(last, next);
        if distance > SPACING || distance <= FINEST {
            return distance <= SPACING;
        }
        let before = self.pieces.last().and_then(|piece| piece.len().checked_sub(2));
        let Some(before) = before.map(|place| self.pieces[self.pieces.len() - 1][place]) else {
            return true;
        };
        let leg = |from: [f64; 2], to: [f64; 2]| {
            [0, 1].map(|axis| (to[axis] - from[axis]) / returns.scales[axis])
        };
        let (a, b) = (leg(before, last), leg(last, next));
        let turn = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs();
        turn * distance <= TURNING
    }

    fn last(&self) -> [f64; 2] {
        let last = self.pieces.iter().rev().find_map(|piece| piece.last());
        last.copied().unwrap_or(self.seed.saddle)
    }

    fn push(&mut self, place: f64, point: [f64; 2]) {
        let last = self.last();
        self.place = place;
        if let Some(piece) = self.pieces.last_mut() {
            if !piece.is_empty() {
                self.length += self.returns.distance(last, point);
            }
            piece.push(point);
        }
    }

    /// The point of a place; a preimage is looked for near `guess`.
    fn point(&mut self, place: f64, guess: [f64; 2]) -> Node {
        if place < 1.0 {
            let point = self.seed.at(place);
            self.nodes.insert(place.to_bits(), Ok(point));
            return Ok(point);
        }
        let parent = self.parent(place - 1.0);
        let node = parent.and_then(|parent| self.returns.next(parent, guess));
        self.nodes.insert(place.to_bits(), node);
        node
    }

    /// The point of a place that the curve has passed.
    fn parent(&mut self, place: f64) -> Node {
        if place < 1.0 {
            return Ok(self.seed.at(place));
        }
        let bits = place.to_bits();
        let below = self.nodes.range(..=bits).next_back().map(|(&bits, &node)| (bits, node));
        let above = self.nodes.range(bits..).next().map(|(&bits, &node)| (bits, node));
        let (Some((low, before)), Some((high, after))) = (below, above) else {
            return Err(ManifoldEnd::NoImage);
        };
        let (before, after) = (before?, after?);
        let (low, high) = (f64::from_bits(low), f64::from_bits(high));
        let share = if high > low { (place - low) / (high - low) } else { 0.0 };
        let between = [0, 1].map(|axis| before[axis] + share * (after[axis] - before[axis]));
        if high == low || self.returns.distance(before, after) <= STRAIGHT {
            return Ok(between);
        }
        self.point(place, between)
    }
}
