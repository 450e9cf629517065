//! One branch of a manifold, point by point.
//!
//! One idea: a point is identified by one number `k + t`, its generation `k` and its place `t` from
//! 0 to 1 on the first piece of the curve: it is the `k`-th image of the point at distance `δ fᵗ`
//! from the saddle, with `f` the growth factor of the curve. Steps in that number are shortened
//! until neighbours are near each other and the curve turns little between them.

use std::collections::BTreeMap;

use super::data::ManifoldEnd;
use super::preimage::Returns;

/// Largest distance of neighbours, in half-ranges of the plane.
const SPACING: f64 = 0.02;
/// Largest product of the angle by which a curve turns at a point and the distance to a neighbour,
/// and the distance below which any angle is allowed.
const TURNING: f64 = 5e-4;
const FINEST: f64 = 1e-4;
/// Greatest length of a curve, in half-ranges, and most points computed for it.
const LONGEST: f64 = 60.0;
const MOST_PLACES: usize = 40_000;
/// Most generations of a curve.
const GENERATIONS: f64 = 300.0;
/// Fraction of the expected distance below which a curve is taken to have folded in between.
const FOLDED: f64 = 0.5;
/// First step, which is the longest; and the shortest, at which the map is taken to jump.
const FIRST_STEP: f64 = 1.0 / 16.0;
const SHORTEST_STEP: f64 = 1e-11;
/// Bisections of the place where a curve is interrupted.
const BORDER_HALVINGS: usize = 36;
/// Neighbours nearer than this, in half-ranges, are joined by a straight line.
const STRAIGHT: f64 = 1e-7;
/// Length of a generation, in half-ranges, below which a curve that shortens is at rest.
const AT_REST: f64 = 1e-5;

/// Distances of the first point from the saddle, in half-ranges: largest, smallest, and their ratio
/// from try to try. Then the largest deviation from linear growth: across the curve, and along it
/// as a fraction.
const FARTHEST: f64 = 1e-5;
const NEAREST: f64 = 1e-10;
const NEARER: f64 = 0.2;
const DEVIATION: f64 = 1e-9;
const DEVIATING: f64 = 1e-2;

/// First piece of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct ManifoldSeed {
    saddle: [f64; 2],
    /// Offset of the first point from the saddle.
    offset: [f64; 2],
    /// Growth factor from generation to generation.
    factor: f64,
}

impl ManifoldSeed {
    /// Largest piece near a saddle on which the curve grows linearly; `None` if there is none.
    /// `direction` is one half-range long.
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
            // Errors along the curve matter little.
            let near = |grown: [f64; 2]| {
                let scaled = |v: [f64; 2]| [0, 1].map(|axis| v[axis] / returns.scales[axis]);
                let error = scaled([grown[0] - expected[0], grown[1] - expected[1]]);
                let unit = scaled(direction);
                let along = (error[0] * unit[0] + error[1] * unit[1]).abs();
                let across = (error[0] * unit[1] - error[1] * unit[0]).abs();
                across <= DEVIATION && along <= DEVIATING * factor * distance
            };
            if grown.is_ok_and(near) {
                return Some(seed);
            }
            distance *= NEARER;
        }
        None
    }

    /// Point at a place on the piece, from 0 to 1.
    fn at(&self, place: f64) -> [f64; 2] {
        let length = self.factor.powf(place);
        [0, 1].map(|axis| self.saddle[axis] + length * self.offset[axis])
    }
}

/// A point, or the reason why there is none.
type Node = Result<[f64; 2], ManifoldEnd>;

/// A curve under construction.
pub(super) struct ManifoldCurve<'a> {
    returns: &'a Returns<'a>,
    seed: ManifoldSeed,
    /// Points by the bits of their places, which sort correctly as places are not negative.
    nodes: BTreeMap<u64, Node>,
    pieces: Vec<Vec<[f64; 2]>>,
    /// Place of the last point, and of the point before it in its piece.
    place: f64,
    before: Option<f64>,
    step: f64,
    length: f64,
    /// Number of points computed.
    tried: usize,
}

impl<'a> ManifoldCurve<'a> {
    pub(super) fn new(returns: &'a Returns<'a>, seed: ManifoldSeed) -> Self {
        let first = seed.at(0.0);
        Self {
            returns,
            seed,
            nodes: BTreeMap::from([(0.0_f64.to_bits(), Ok(first))]),
            pieces: vec![vec![seed.saddle, first]],
            place: 0.0,
            before: None,
            step: FIRST_STEP,
            length: 0.0,
            tried: 0,
        }
    }

    /// Pieces of the curve, and the reason why it ends.
    pub(super) fn run(mut self) -> (Vec<Vec<[f64; 2]>>, ManifoldEnd) {
        let end = self.end();
        self.pieces.retain(|piece| piece.len() > 1);
        (self.pieces, end)
    }

    fn end(&mut self) -> ManifoldEnd {
        let (mut generation, mut begun, mut before) = (1.0, 0.0, 0.0);
        while self.length < LONGEST && self.tried < MOST_PLACES && self.place < GENERATIONS {
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

    /// Adds the next point, or passes an interruption; an error ends the curve.
    fn advance(&mut self) -> Result<(), ManifoldEnd> {
        let last = self.last();
        let mut halvings = 0;
        loop {
            match self.point(self.place + self.step, last) {
                Ok(next) if self.turns_before(next) => {
                    self.step_back();
                    return Ok(());
                }
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

    /// Continues after an interruption, at the first point whose parent, a generation before, is
    /// sent back near the plane.
    fn pass(&mut self, end: ManifoldEnd) -> Result<(), ManifoldEnd> {
        let last = self.last();
        let mut without = self.place + self.step;
        let parents = self.nodes.range((without - 1.0).max(0.0).to_bits()..);
        let parents = parents.filter_map(|(&bits, node)| node.ok().map(|_| f64::from_bits(bits)));
        for place in parents.map(|place| place + 1.0).collect::<Vec<_>>() {
            let Ok(mut found) =
                self.node(place, |returns, parent| returns.next_anywhere(parent, last))
            else {
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
            // The turn here is not tested: a step back would lead into the interruption.
            self.before = None;
            self.step = (place - with).clamp(SHORTEST_STEP, FIRST_STEP);
            return Ok(());
        }
        Err(end)
    }

    /// Whether a point is near the last one and the curve turns little on the way to it.
    fn is_smooth(&self, next: [f64; 2]) -> bool {
        let distance = self.returns.distance(self.last(), next);
        let speed = self.before.zip(self.second_last()).map(|(place, before)| {
            self.returns.distance(before, self.last()) / (self.place - place)
        });
        // A curve that goes out and back is longer than the distance of its ends.
        let expected = speed.map_or(0.0, |speed| speed * self.step);
        if expected > FINEST && distance < FOLDED * expected {
            return false;
        }
        distance <= FINEST || (distance <= SPACING && self.turn(next) * distance <= TURNING)
    }

    /// Whether the curve turned before the last point, so that a corner may have been cut.
    fn turns_before(&self, next: [f64; 2]) -> bool {
        let (Some(before), Some(end)) = (self.second_last(), self.before) else { return false };
        let distance = self.returns.distance(before, self.last());
        let near = self.returns.distance(self.last(), next) <= FINEST;
        let divisible = self.place - end > 4.0 * SHORTEST_STEP;
        near && divisible && distance > FINEST && self.turn(next) * distance > TURNING
    }

    /// Removes the last point and halves the step that led to it.
    fn step_back(&mut self) {
        let (Some(before), Some(end)) = (self.second_last(), self.before.take()) else { return };
        self.length -= self.returns.distance(before, self.last());
        self.step = (0.5 * (self.place - end)).max(SHORTEST_STEP);
        self.place = end;
        if let Some(piece) = self.pieces.last_mut() {
            piece.pop();
        }
    }

    /// Angle by which the curve turns at its last point.
    fn turn(&self, next: [f64; 2]) -> f64 {
        let Some(before) = self.second_last() else { return 0.0 };
        let (last, scales) = (self.last(), self.returns.scales);
        let leg = |from: [f64; 2], to: [f64; 2]| {
            [0, 1].map(|axis| (to[axis] - from[axis]) / scales[axis])
        };
        let (a, b) = (leg(before, last), leg(last, next));
        (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs()
    }

    /// Point before the last one of its piece.
    fn second_last(&self) -> Option<[f64; 2]> {
        let piece = self.pieces.last()?;
        piece.len().checked_sub(2).map(|place| piece[place])
    }

    fn last(&self) -> [f64; 2] {
        let last = self.pieces.iter().rev().find_map(|piece| piece.last());
        last.copied().unwrap_or(self.seed.saddle)
    }

    fn push(&mut self, place: f64, point: [f64; 2]) {
        let last = self.last();
        let begins = self.pieces.last().is_none_or(Vec::is_empty);
        self.before = (!begins).then_some(self.place);
        self.place = place;
        if let Some(piece) = self.pieces.last_mut() {
            if !piece.is_empty() {
                self.length += self.returns.distance(last, point);
            }
            piece.push(point);
        }
    }

    /// Point at a place; a preimage is looked for near `guess`.
    fn point(&mut self, place: f64, guess: [f64; 2]) -> Node {
        self.node(place, |returns, parent| returns.next(parent, guess))
    }

    /// Point at a place, found by `next` from its parent in the generation before.
    fn node(&mut self, place: f64, next: impl FnOnce(&Returns<'_>, [f64; 2]) -> Node) -> Node {
        self.tried += 1;
        let node = match place < 1.0 {
            true => Ok(self.seed.at(place)),
            false => self.parent(place - 1.0).and_then(|parent| next(self.returns, parent)),
        };
        self.nodes.insert(place.to_bits(), node);
        node
    }

    /// Point at a place that the curve has passed.
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

#[cfg(test)]
mod tests {
    use super::super::data::ManifoldKind;
    use super::*;
    use crate::iteration::{DiscreteMap, StepInfo};

    /// A map of the plane and its Jacobian.
    struct Plane<F, D>(F, D);

    impl<F, D> DiscreteMap for Plane<F, D>
    where
        F: Fn([f64; 2]) -> [f64; 2] + Sync,
        D: Fn([f64; 2]) -> [f64; 4] + Sync,
    {
        fn dimension(&self) -> usize {
            2
        }
        fn parameters(&self) -> usize {
            0
        }
        fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
            image.copy_from_slice(&self.0([state[0], state[1]]));
            let mut info = StepInfo::default().checked(image);
            info.add_passage(0, state[0]);
            info
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            jacobian.copy_from_slice(&self.1([state[0], state[1]]));
            self.step(state, parameters, image)
        }
    }

    /// A branch in a square of the given half-range about 0, followed up to twice that far.
    fn curve(
        map: &dyn DiscreteMap,
        kind: ManifoldKind,
        half_range: f64,
        (saddle, direction, factor): ([f64; 2], [f64; 2], f64),
    ) -> (Vec<Vec<[f64; 2]>>, ManifoldEnd) {
        let returns = Returns {
            map,
            kind,
            count: 1,
            middle: [0.0; 2],
            scales: [half_range; 2],
            window: None,
            is_near: &|point| point.iter().all(|value| value.abs() <= 2.0 * half_range),
        };
        let length = direction[0].hypot(direction[1]) / half_range;
        let direction = direction.map(|value| value / length);
        let seed =
            ManifoldSeed::beside(&returns, saddle, direction, factor).expect("a smooth saddle");
        ManifoldCurve::new(&returns, seed).run()
    }

    /// `(x, y) ↦ (2x, y/2 + 7x²)` has the unstable manifold `y = 2x²`; its mirror image under
    /// exchange of the coordinates and of time has it as the stable one.
    #[test]
    fn curves_of_a_quadratic_map_are_the_parabolas_of_the_closed_form() {
        let forwards = Plane(
            |[x, y]: [f64; 2]| [2.0 * x, 0.5 * y + 7.0 * x * x],
            |[x, _]: [f64; 2]| [2.0, 0.0, 14.0 * x, 0.5],
        );
        // The inverse: (x, y) ↦ (x/2, 2 (y − 7 x²/4)).
        let backwards = Plane(
            |[x, y]: [f64; 2]| [0.5 * x, 2.0 * y - 3.5 * x * x],
            |[x, _]: [f64; 2]| [0.5, 0.0, -7.0 * x, 2.0],
        );
        let maps: [(&dyn DiscreteMap, ManifoldKind); 2] =
            [(&forwards, ManifoldKind::Unstable), (&backwards, ManifoldKind::Stable)];
        for (map, kind) in maps {
            let (pieces, end) = curve(map, kind, 1.0, ([0.0; 2], [1.0, 0.0], 2.0));
            assert_eq!((pieces.len(), end), (1, ManifoldEnd::Plane), "{kind:?}");
            let last = pieces[0][pieces[0].len() - 1];
            assert!((last[1] - 2.0).abs() < 1e-6, "{kind:?} ends at {last:?}");
            for &[x, y] in &pieces[0] {
                assert!((y - 2.0 * x * x).abs() < 1e-9, "{kind:?} ({x}, {y})");
            }
            for pair in pieces[0].windows(2) {
                let apart = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
                assert!(apart <= SPACING, "{kind:?} {apart}");
            }
        }
    }

    /// Distance of a point from the segment between two others.
    fn off_segment(point: [f64; 2], pair: &[[f64; 2]]) -> f64 {
        let from = |other: [f64; 2]| [other[0] - pair[0][0], other[1] - pair[0][1]];
        let (leg, to) = (from(pair[1]), from(point));
        let size = (leg[0] * leg[0] + leg[1] * leg[1]).max(f64::MIN_POSITIVE);
        let share = ((to[0] * leg[0] + to[1] * leg[1]) / size).clamp(0.0, 1.0);
        (to[0] - share * leg[0]).hypot(to[1] - share * leg[1])
    }

    /// The map of Lozi, `(x, y) ↦ (1 − a|x| + y, b x)`: both curves are broken lines.
    #[test]
    fn curves_of_a_piecewise_linear_map_turn_where_it_does() {
        const A: f64 = 1.7;
        const B: f64 = 0.5;
        let lozi = |[x, y]: [f64; 2]| [1.0 - A * x.abs() + y, B * x];
        let map = Plane(lozi, |[x, _]: [f64; 2]| [-A * x.signum(), 1.0, B, 0.0]);
        // The fixed point where x > 0; multipliers m with m² + a m − b = 0, vectors (m, b).
        let fixed = 1.0 / (1.0 + A - B);
        let root = (A * A / 4.0 + B).sqrt();
        let [unstable, stable] = [-A / 2.0 - root, -A / 2.0 + root];
        let saddle = [fixed, B * fixed];
        let two = |map: &dyn DiscreteMap, kind, multiplier: f64, direction: [f64; 2]| {
            let returns = Returns {
                map,
                kind,
                count: 2,
                middle: [0.0; 2],
                scales: [2.0; 2],
                window: None,
                is_near: &|point| point.iter().all(|value| value.abs() <= 6.0),
            };
            let factor = if kind == ManifoldKind::Stable { 1.0 / multiplier } else { multiplier };
            let seed = ManifoldSeed::beside(&returns, saddle, direction, factor.powi(2));
            ManifoldCurve::new(&returns, seed.expect("a linear saddle")).run().0
        };
        // Unstable: the line through the saddle to x = 0; the images of that point are corners.
        let pieces = two(&map, ManifoldKind::Unstable, unstable, [unstable, B]);
        let crossing = [0.0, saddle[1] - saddle[0] * B / unstable];
        let mut turn = crossing;
        for _ in 0..3 {
            turn = lozi(lozi(turn));
            let pairs = pieces.iter().flat_map(|piece| piece.windows(2));
            let nearest = pairs.map(|pair| off_segment(turn, pair)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 2.0 * TURNING, "the turn {turn:?} is {nearest} off the curve");
        }
        // Stable: the line to x = 0; beyond it, the preimage of that line under the left branch.
        let pieces = two(&map, ManifoldKind::Stable, stable, [-stable, -B]);
        let on_line = |[x, y]: [f64; 2]| (y - saddle[1]) - (x - saddle[0]) * B / stable;
        let first = pieces[0].iter().take_while(|point| point[0] > 0.0);
        assert!(first.clone().count() > 50);
        first.for_each(|&point| assert!(on_line(point).abs() < 1e-9, "{point:?}"));
        let beyond = pieces[0].iter().skip_while(|point| point[0] > 0.0).take(20);
        let beyond: Vec<_> = beyond.filter(|point| point[0] < -1e-3).collect();
        assert!(!beyond.is_empty());
        for point in beyond {
            assert!(on_line(*point).abs() > 1e-4 && on_line(lozi(*point)).abs() < 1e-9);
        }
    }

    /// Nordmark's map with a square root, whose derivative is unbounded at `x = 0`.
    #[test]
    fn the_stable_curve_of_a_map_with_a_root_goes_on_beyond_its_grazes() {
        const RHO: f64 = 0.05;
        let image = |[x, y]: [f64; 2]| match x > 0.0 {
            true => [-x.sqrt() + y + RHO, -0.5 * x],
            false => [0.9 * x + y + RHO, -0.8 * x],
        };
        let map = Plane(image, |[x, _]: [f64; 2]| match x > 0.0 {
            true => [-0.5 / x.sqrt(), 1.0, -0.5, 0.0],
            false => [0.9, 1.0, -0.8, 0.0],
        });
        // The saddle: x = −√x − x/2 + ρ.
        let depth = (-1.0 + (1.0 + 6.0 * RHO).sqrt()) / 3.0;
        let saddle = [depth * depth, -0.5 * depth * depth];
        let half = -0.25 / depth;
        let large = half - (half * half - 0.5).sqrt();
        let small = 0.5 / large;
        let returns = Returns {
            map: &map,
            kind: ManifoldKind::Stable,
            count: 2,
            middle: [0.0; 2],
            scales: [0.1; 2],
            window: None,
            is_near: &|point| point.iter().all(|value| value.abs() <= 0.4),
        };
        let direction = [small, -0.5].map(|value| 0.1 * value / small.hypot(0.5));
        let mut sides = [false; 2];
        for sign in [1.0, -1.0] {
            let direction = direction.map(|value| sign * value);
            let seed = ManifoldSeed::beside(&returns, saddle, direction, small.powi(-2));
            let (pieces, _) = ManifoldCurve::new(&returns, seed.expect("a saddle")).run();
            for &point in pieces.iter().flatten() {
                sides[usize::from(point[0] > 0.0)] = true;
                let orbit = (0..60).scan(point, |state, _| {
                    *state = image(*state);
                    Some(*state)
                });
                let nearest = orbit.map(|[x, y]| (x - saddle[0]).hypot(y - saddle[1]));
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-6, "{point:?} comes to {nearest}");
            }
        }
        assert_eq!(sides, [true; 2]);
    }
}
