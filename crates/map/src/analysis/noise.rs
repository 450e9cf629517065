//! Orbits under noise: parameters are drawn anew at every return.
//!
//! One idea: noise acts through parameters. Restitution, gap and forcing are parameters like any
//! other, so the scene names what is random, and each return is one of guarded iteration at the
//! parameters drawn for it. See `SimpsonHoganKuske2013` on noise near a graze.
//!
//! Each orbit has its own generator, seeded by the seed and the number of the orbit alone, and
//! densities are counts, so results do not depend on threads.

use serde::{Deserialize, Serialize};

use super::direct_map::DirectMap;
use super::error::{AnalysisError, check_contacts, check_length};
use super::progress::Progress;
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::iteration::{Batch, DiscreteMap, HornerMap, PhaseCircle};
use crate::model::{Method, Scene};
use crate::orbit::GrazingOrbit;

/// Request of [`noise`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRequest {
    /// Means of all active parameters, as offsets.
    pub at: Vec<f64>,
    /// Standard deviations of all active parameters; 0 for those without noise.
    pub deviations: Vec<f64>,
    /// Distribution of the noise.
    pub law: NoiseLaw,
    /// Offsets at which every orbit starts.
    pub start: Vec<f64>,
    /// Number of orbits.
    pub orbits: usize,
    /// Returns of each orbit before counting begins.
    pub transient: usize,
    /// Returns of each orbit that are counted.
    pub keep: usize,
    /// Range of each coordinate in which densities are counted: first and last offset.
    pub ranges: Vec<[f64; 2]>,
    /// Number of cells along every coordinate.
    pub cells: usize,
    /// Seed of the generators.
    pub seed: u64,
    /// Method that computes the returns.
    pub method: Method,
}

/// Distribution of the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLaw {
    /// Normal distribution.
    #[default]
    Normal,
    /// Uniform distribution with the same standard deviation.
    Uniform,
}

/// Statistics of orbits under noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoisyOrbits {
    /// Number of points counted, including those outside the ranges.
    pub points: u64,
    /// Mean of every coordinate.
    pub mean: Vec<f64>,
    /// Covariance of the coordinates, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Counts in the cells of each coordinate's range.
    pub marginals: Vec<Vec<u64>>,
    /// Counts in the cells of the first two coordinates, one row per cell of the second; empty for
    /// a single coordinate.
    pub joint: Vec<u64>,
    /// Fraction of returns with contact.
    pub contacts: f64,
    /// Fraction of returns computed by the map; the others are simulated.
    pub by_map: f64,
    /// Fraction of returns that start outside the window.
    pub outside: f64,
    /// Number of orbits that ended early because a return had no image.
    pub ended: usize,
}

/// Iterates orbits whose parameters are drawn anew at every return.
///
/// # Errors
///
/// [`AnalysisError::Length`] for a wrong number of coordinates or parameters; as
/// [`DirectMap::new`].
pub fn noise(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &NoiseRequest,
    progress: &dyn Progress,
) -> Result<NoisyOrbits, AnalysisError> {
    let (dimension, active) = (map.dimension(), map.parameters.len());
    check_length("offsets of the parameters", active, request.at.len())?;
    check_length("standard deviations", active, request.deviations.len())?;
    check_length("coordinates of the start", dimension, request.start.len())?;
    check_length("ranges", dimension, request.ranges.len())?;
    if request.method == Method::Atlas {
        return Err(AnalysisError::NotTabulated { what: "noise" });
    }
    if request.method != Method::Direct {
        check_contacts(map)?;
    }
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let run = HornerMap::new(map);
    let returns = request.transient + request.keep;
    let chunks = request.orbits.div_ceil(CHUNK);
    progress.expect((chunks * returns) as u64);
    let part = |chunk: usize| {
        let orbits = chunk * CHUNK..request.orbits.min((chunk + 1) * CHUNK);
        let mut part = NoiseChunk::new(map, &run, &direct, request, orbits);
        for number in 0..returns {
            part.step(number >= request.transient);
            progress.advance(1);
        }
        part.counts
    };
    let mut counts = Counts::new(request);
    parallel::map(0..chunks, part).iter().for_each(|part| counts.add(part));
    Ok(counts.results(request))
}

/// Number of orbits iterated together; sums over a chunk are always taken in the same order.
pub(super) const CHUNK: usize = 256;

/// One chunk of the orbits.
struct NoiseChunk<'a> {
    map: &'a LocalMap,
    run: &'a HornerMap,
    direct: DirectMap<'a>,
    request: &'a NoiseRequest,
    generators: Vec<Generator>,
    states: Vec<f64>,
    going: Vec<bool>,
    counts: Counts,
}

impl<'a> NoiseChunk<'a> {
    fn new(
        map: &'a LocalMap,
        run: &'a HornerMap,
        direct: &DirectMap<'a>,
        request: &'a NoiseRequest,
        orbits: std::ops::Range<usize>,
    ) -> Self {
        Self {
            map,
            run,
            direct: direct.clone(),
            request,
            states: request.start.repeat(orbits.len()),
            going: vec![true; orbits.len()],
            generators: orbits.map(|orbit| Generator::new(request.seed, orbit as u64)).collect(),
            counts: Counts::new(request),
        }
    }

    /// Makes one return of every orbit; `counted` adds it to the counts.
    fn step(&mut self, counted: bool) {
        let (d, active) = (self.map.dimension(), self.request.at.len());
        let mut parameters = Vec::with_capacity(self.going.len() * active);
        for generator in &mut self.generators {
            let drawn = self.request.at.iter().zip(&self.request.deviations);
            parameters.extend(drawn.map(|(&mean, &deviation)| match deviation {
                0.0 => mean,
                _ => mean + deviation * generator.draw(self.request.law),
            }));
        }
        // NOTE: one row of parameters is shared by all orbits, which is right for one orbit too.
        let Batch { rows, width } = self.run.batch(&self.states, &parameters, false);
        for (number, row) in rows.chunks_exact(width).enumerate() {
            if !self.going[number] {
                continue;
            }
            let state = &mut self.states[number * d..][..d];
            let own = &parameters[number * active..][..active];
            let (image, depths) = row.split_at(d);
            let inside = self.map.window.holds(state, own, depths);
            let by_map = match self.request.method {
                Method::Map => true,
                Method::Guarded => inside,
                Method::Direct | Method::Atlas => false,
            };
            let mut contact = depths.iter().any(|&depth| depth > 0.0);
            if by_map {
                state.copy_from_slice(image);
            } else {
                let mut image = vec![0.0; d];
                contact = !self.direct.step(state, own, &mut image).passages.is_empty();
                state.copy_from_slice(&image);
            }
            self.going[number] = state.iter().all(|value| value.is_finite());
            if !self.going[number] {
                self.counts.ended += 1;
            } else if counted {
                let circle = self.direct.circle();
                self.counts.take(self.request, circle, state, [contact, by_map, !inside]);
            }
        }
    }
}

/// Counts of one chunk or of all.
#[derive(Clone, Debug)]
struct Counts {
    points: u64,
    /// Sums of the offsets from the start, and sums of their products.
    sums: Vec<f64>,
    products: Vec<f64>,
    marginals: Vec<Vec<u64>>,
    joint: Vec<u64>,
    /// Numbers of returns with contact, by the map, and from outside the window.
    shares: [u64; 3],
    ended: usize,
}

impl Counts {
    fn new(request: &NoiseRequest) -> Self {
        let d = request.start.len();
        let joint = if d > 1 { request.cells * request.cells } else { 0 };
        Self {
            points: 0,
            sums: vec![0.0; d],
            products: vec![0.0; d * d],
            marginals: vec![vec![0; request.cells]; d],
            joint: vec![0; joint],
            shares: [0; 3],
            ended: 0,
        }
    }

    fn take(
        &mut self,
        request: &NoiseRequest,
        circle: PhaseCircle,
        state: &[f64],
        shares: [bool; 3],
    ) {
        let d = state.len();
        // A phase is taken within half a period of the start.
        let mut state = state.to_vec();
        circle.bring_near(&mut state, &request.start);
        self.points += 1;
        for (row, value) in state.iter().enumerate() {
            let own = value - request.start[row];
            self.sums[row] += own;
            for (column, other) in state.iter().enumerate() {
                self.products[row * d + column] += own * (other - request.start[column]);
            }
        }
        let cell = |(coordinate, (&value, [from, to])): (usize, (&f64, &[f64; 2]))| {
            let value = circle.near(coordinate, value, 0.5 * (from + to));
            let place = ((value - from) / (to - from) * request.cells as f64).floor();
            (0.0..request.cells as f64).contains(&place).then_some(place as usize)
        };
        let cells: Vec<_> = state.iter().zip(&request.ranges).enumerate().map(cell).collect();
        for (counts, cell) in self.marginals.iter_mut().zip(&cells) {
            if let Some(count) = cell.and_then(|cell| counts.get_mut(cell)) {
                *count += 1;
            }
        }
        if let [Some(first), Some(second), ..] = cells[..] {
            self.joint[second * request.cells + first] += 1;
        }
        for (count, is) in self.shares.iter_mut().zip(shares) {
            *count += u64::from(is);
        }
    }

    fn add(&mut self, other: &Self) {
        self.points += other.points;
        let sums = self.sums.iter_mut().chain(&mut self.products);
        let others = other.sums.iter().chain(&other.products);
        sums.zip(others).for_each(|(sum, other)| *sum += other);
        let counts = self.marginals.iter_mut().flatten().chain(&mut self.joint);
        let counts = counts.chain(&mut self.shares);
        let others = other.marginals.iter().flatten().chain(&other.joint).chain(&other.shares);
        counts.zip(others).for_each(|(count, other)| *count += other);
        self.ended += other.ended;
    }

    fn results(self, request: &NoiseRequest) -> NoisyOrbits {
        let d = request.start.len();
        let count = self.points as f64;
        let mean: Vec<f64> = self.sums.iter().map(|sum| sum / count).collect();
        let entry = |row: usize, column: usize| {
            self.products[row * d + column] / count - mean[row] * mean[column]
        };
        let share = |number: usize| self.shares[number] as f64 / count;
        NoisyOrbits {
            points: self.points,
            covariance: (0..d)
                .map(|row| (0..d).map(|column| entry(row, column)).collect())
                .collect(),
            contacts: share(0),
            by_map: share(1),
            outside: share(2),
            mean: mean.iter().zip(&request.start).map(|(mean, start)| mean + start).collect(),
            marginals: self.marginals,
            joint: self.joint,
            ended: self.ended,
        }
    }
}

/// Generator SplitMix64 (Steele, Lea, Flood 2014), seeded by a seed and the number of an orbit.
#[derive(Clone, Debug)]
struct Generator {
    state: u64,
    /// Second number of a pair of normal numbers.
    spare: Option<f64>,
}

impl Generator {
    fn new(seed: u64, orbit: u64) -> Self {
        // Mixed twice, so that generators of neighbouring orbits do not share a sequence.
        let mut begin = Self { state: seed, spare: None };
        let mixed = begin.next() ^ orbit.wrapping_mul(0xd134_2543_de82_ef95);
        let mut generator = Self { state: mixed, spare: None };
        generator.state = generator.next();
        generator
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// Uniform number between −1 and 1.
    fn even(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Random number with mean 0 and standard deviation 1.
    fn draw(&mut self, law: NoiseLaw) -> f64 {
        match law {
            NoiseLaw::Uniform => 3f64.sqrt() * self.even(),
            NoiseLaw::Normal => self.normal(),
        }
    }

    /// Normal number by the polar method of Marsaglia.
    fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (a, b) = (self.even(), self.even());
            let square = a * a + b * b;
            if square > 0.0 && square < 1.0 {
                let length = (-2.0 * square.ln() / square).sqrt();
                self.spare = Some(b * length);
                return a * length;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Generator, NoiseLaw};

    #[test]
    fn what_is_drawn_has_mean_0_and_deviation_1_and_orbits_draw_apart() {
        for law in [NoiseLaw::Normal, NoiseLaw::Uniform] {
            let (mut sum, mut squares, mut products, mut fourth) = (0.0, 0.0, 0.0, 0.0);
            let count = 200_000;
            let (mut own, mut next) = (Generator::new(7, 0), Generator::new(7, 1));
            for _ in 0..count {
                let (a, b) = (own.draw(law), next.draw(law));
                sum += a;
                squares += a * a;
                fourth += a.powi(4);
                products += a * b;
            }
            let count = f64::from(count);
            // Tolerance: five standard deviations of each mean.
            assert!((sum / count).abs() < 5.0 / count.sqrt());
            assert!((squares / count - 1.0).abs() < 5.0 * (2.0 / count).sqrt());
            assert!((products / count).abs() < 5.0 / count.sqrt());
            let kurtosis = if law == NoiseLaw::Normal { 3.0 } else { 1.8 };
            assert!((fourth / count - kurtosis).abs() < 5.0 * (96.0 / count).sqrt());
        }
    }
}
