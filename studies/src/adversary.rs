//! Adversary of the errors that a map claims on its window: random points, points at corners, edges
//! and faces, points on the verge of contact on both sides, and ascents from the worst of them.
//!
//! It shares only the map and direct simulation with the measurement. Points are random instead of
//! a sequence, depths are met by bisection instead of Newton's method in any variable, and ascents
//! are mutations with an adaptive step instead of a search along axes.

use grazemap::Map;
use grazemap::analysis::{DepthEvaluation, DirectEnd, DirectImage, MapEvaluation};
use grazemap::expansion::MapWindow;
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::DiscreteMap;
use grazemap::numeric::{Dd, Real};

/// Share of points used for ascents.
const ASCENTS: f64 = 0.4;
/// Number of points of one ascent.
const CLIMB: usize = 150;
/// Number of decades below the window's depth in which contacts are shallow.
const DECADES: f64 = 15.0;
/// Number of bisections that meet a depth: to the last bit of the variable that is moved.
const HALVINGS: usize = 60;
/// Largest share of a claim that the rounding of a simulated image may have: errors of images with
/// more are taken from double-double.
const BLURRED: f64 = 0.01;
/// Bound on the rounding of an image by direct simulation in double precision.
const ROUNDING: f64 = 1e-11;
/// Bound on the rounding of a depth in double precision; an impact speed near 0 is a square root of
/// its depth.
const ROUNDING_OF_DEPTHS: f64 = 1e-15;
/// Factors of a mutation's step after success and after failure; the step stays constant if one in
/// five succeeds (Rechenberg).
const ADAPTS: [f64; 2] = [1.5, 0.903];

/// Findings of an adversary.
#[derive(Clone, Debug)]
pub struct Found {
    /// Number of points of the window that were compared.
    pub points: usize,
    /// Number of points of the window that do not return, or have contacts elsewhere.
    pub lost: usize,
    /// Largest ratio of error to claim, for each coordinate.
    pub excess: Vec<f64>,
    /// Points of these errors.
    pub worst: Vec<Point>,
}

impl Found {
    /// Coordinate with the largest ratio of error to claim, the ratio, and its point.
    pub fn largest(&self) -> (usize, f64, &Point) {
        let (coordinate, excess) = largest(&self.excess);
        (coordinate, excess, &self.worst[coordinate])
    }
}

/// Point of a window.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Offsets of coordinates and parameters, over their half-widths.
    pub shares: Vec<f64>,
    /// Passage, variable that is moved until the passage has a depth, and this depth over the
    /// window's; negative for no contact.
    pub held: Option<(usize, usize, f64)>,
}

/// Attacks the errors that a map claims, or these claims about another form of it, with a number of
/// points.
pub fn attack(
    map: &Map,
    form: &dyn DiscreteMap,
    claims: &[f64],
    (points, seed): (usize, u64),
) -> Result<Found, grazemap::Error> {
    let system = HybridSystem::new(&map.scene().model);
    let dimension = map.local().dimension();
    let mut adversary = Adversary {
        window: &map.local().window,
        depths: MapEvaluation::depths(map.local()),
        passages: map.local().passages(),
        direct: DirectImage::new(&system, map.scene(), map.orbit())?,
        exact: DirectImage::new(&system, map.scene(), map.orbit())?,
        form,
        claims,
        random: Random(seed),
        found: Found {
            points: 0,
            lost: 0,
            excess: vec![0.0; dimension],
            worst: vec![Point::default(); dimension],
        },
    };
    adversary.attack(points);
    Ok(adversary.found)
}

struct Adversary<'a> {
    window: &'a MapWindow,
    depths: DepthEvaluation<f64>,
    passages: usize,
    direct: DirectImage<'a, f64>,
    exact: DirectImage<'a, Dd>,
    form: &'a dyn DiscreteMap,
    claims: &'a [f64],
    random: Random,
    found: Found,
}

impl Adversary<'_> {
    fn attack(&mut self, points: usize) {
        let climbs = (ASCENTS * points as f64) as usize / CLIMB;
        let strewn = points - climbs * CLIMB;
        // Each part of the random points yields one ascent: it begins at the worst point of the
        // part, for the coordinate with the largest ratio of error to claim.
        let mut starts: Vec<(f64, Point, usize)> = Vec::new();
        let part = (strewn / climbs.max(1)).max(1);
        let mut worst: Option<(f64, Point, usize)> = None;
        let mut tried = 0;
        while self.found.points < strewn && tried < 20 * points {
            tried += 1;
            let point = self.anywhere();
            let Some(excess) = self.excess(&point) else { continue };
            let (coordinate, value) = largest(&excess);
            if worst.as_ref().is_none_or(|worst| value > worst.0) {
                worst = Some((value, point, coordinate));
            }
            if self.found.points.is_multiple_of(part) {
                starts.extend(worst.take());
            }
        }
        for (value, point, coordinate) in starts {
            self.climb(value, point, coordinate);
        }
        for coordinate in 0..self.claims.len() {
            let best = self.found.worst[coordinate].clone();
            self.climb(self.found.excess[coordinate], best, coordinate);
        }
    }

    /// Random point: at the corners, edges or faces of the window or inside, unchanged or moved
    /// until a passage has a depth, the window's or a shallow one on either side.
    fn anywhere(&mut self) -> Point {
        let variables = self.window.state.len() + self.window.parameter.len();
        let outer = [0.0, 0.5, 0.8, 1.0][self.random.below(4)];
        let mut share = || match self.random.unit() {
            chance if chance < outer => [1.0, -1.0][self.random.below(2)],
            _ => 2.0 * self.random.unit() - 1.0,
        };
        let shares: Vec<f64> = (0..variables).map(|_| share()).collect();
        let passage = self.random.below(self.passages.max(1));
        let variable = self.random.below(variables);
        let shallow = 10_f64.powf(-DECADES * self.random.unit());
        let held = match self.random.below(6) {
            0 => None,
            1 => Some((passage, variable, 1.0 - 1e-9)),
            2 => Some((passage, variable, -shallow)),
            _ => Some((passage, variable, shallow)),
        };
        Point { shares, held: held.filter(|_| self.passages > 0) }
    }

    /// Mutates a point, and keeps mutations with a larger error.
    fn climb(&mut self, mut value: f64, mut point: Point, coordinate: usize) {
        if point.shares.is_empty() {
            return;
        }
        let mut step = 0.3;
        for _ in 0..CLIMB {
            let mut other = point.clone();
            let few = self.random.below(2) == 0;
            let alone = self.random.below(other.shares.len() + 1);
            for (number, share) in other.shares.iter_mut().enumerate() {
                if !few || number == alone {
                    *share = (*share + step * self.random.normal()).clamp(-1.0, 1.0);
                }
            }
            if let Some((.., depth)) = &mut other.held
                && (!few || alone == point.shares.len())
            {
                *depth = (*depth * (6.0 * step * self.random.normal()).exp()).min(1.0 - 1e-9);
            }
            let reached = self.excess(&other).map(|excess| excess[coordinate]);
            let better = reached.filter(|&reached| reached > value);
            step = (step * ADAPTS[usize::from(better.is_none())]).clamp(1e-9, 1.0);
            if let Some(reached) = better {
                (value, point) = (reached, other);
            }
        }
    }

    /// Ratios of a point's errors to the claims; `None` if the point is outside the window, or
    /// lost. Ratios that would be the largest so far are taken from double-double, and so are those
    /// that the rounding of double precision blurs.
    fn excess(&mut self, point: &Point) -> Option<Vec<f64>> {
        let (state, parameters) = self.offsets(point)?;
        let depths = self.depths.at(&state, &parameters);
        if !self.window.holds(&state, &parameters, &depths) {
            return None;
        }
        let mut image = vec![0.0; state.len()];
        self.form.step(&state, &parameters, &mut image);
        let depth = depths.iter().fold(f64::INFINITY, |least, depth| depth.abs().min(least));
        let rounding = ROUNDING + ROUNDING_OF_DEPTHS / depth.max(ROUNDING_OF_DEPTHS).sqrt();
        let pairs = || self.claims.iter().zip(&self.found.excess);
        let is_sharp = pairs().all(|(claim, _)| rounding < BLURRED * claim);
        let is_known = |errors: &Vec<f64>| {
            let largest = pairs().map(|(claim, excess)| claim * excess);
            errors.iter().zip(largest).all(|(error, largest)| error + rounding < largest)
        };
        let in_double = match is_sharp {
            true => errors(&state, &parameters, &image, &mut self.direct).filter(is_known),
            false => None,
        };
        let exact = || errors(&state, &parameters, &image, &mut self.exact);
        let Some(errors) = in_double.or_else(exact) else {
            self.found.lost += 1;
            return None;
        };
        self.found.points += 1;
        let pairs = errors.iter().zip(self.claims);
        let excess: Vec<f64> = pairs.map(|(error, claim)| error / claim).collect();
        for (coordinate, &value) in excess.iter().enumerate() {
            // NOTE: NaN exceeds every claim.
            if value.is_nan() || value > self.found.excess[coordinate] {
                self.found.excess[coordinate] = value;
                self.found.worst[coordinate] = point.clone();
            }
        }
        Some(excess)
    }

    /// Offsets of a point: shares of the half-widths, with one moved until a depth is met.
    fn offsets(&self, point: &Point) -> Option<(Vec<f64>, Vec<f64>)> {
        let widths = self.window.state.iter().chain(&self.window.parameter);
        let mut offsets: Vec<f64> =
            widths.clone().zip(&point.shares).map(|(width, share)| width * share).collect();
        let split = self.window.state.len();
        if let Some((passage, variable, depth)) = point.held {
            let width = *widths.clone().nth(variable)?;
            let mut lacks = |offset: f64| {
                offsets[variable] = offset;
                let (state, parameters) = offsets.split_at(split);
                self.depths.at(state, parameters)[passage] - depth * self.window.depth
            };
            // Ends of the bisection: the side of contact, and the other side, around the given
            // share.
            let (mut inside, mut outside) = (-width, width);
            if lacks(inside) < 0.0 {
                (inside, outside) = (outside, inside);
            }
            if lacks(inside) < 0.0 || lacks(outside) >= 0.0 {
                return None;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (inside + outside);
                match lacks(middle) < 0.0 {
                    true => outside = middle,
                    false => inside = middle,
                }
            }
            offsets[variable] = if depth < 0.0 { outside } else { inside };
        }
        let parameters = offsets.split_off(split);
        Some((offsets, parameters))
    }
}

/// Errors of the image of a point, held against direct simulation; `None` if there is no return, or
/// one with contacts elsewhere.
fn errors<S: Real>(
    state: &[f64],
    parameters: &[f64],
    image: &[f64],
    direct: &mut DirectImage<'_, S>,
) -> Option<Vec<f64>> {
    let lifted = |values: &[f64]| values.iter().map(|&it| S::from_f64(it)).collect::<Vec<S>>();
    let truth = direct.image(&lifted(state), &lifted(parameters)).ok()?;
    if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
        return None;
    }
    let pairs = image.iter().zip(&truth.offsets);
    Some(pairs.map(|(&value, &exact)| (S::from_f64(value) - exact).to_f64().abs()).collect())
}

fn largest(values: &[f64]) -> (usize, f64) {
    let pairs = values.iter().copied().enumerate();
    pairs.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// Reproducible random numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        word ^ (word >> 31)
    }

    /// Uniform random number between 0 and 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// Approximately Gaussian random number of variance 1: the sum of twelve uniform ones.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}
