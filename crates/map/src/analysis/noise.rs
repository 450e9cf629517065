//! Section points under noise: parameters that are drawn afresh at every return.
//!
//! One idea: the parameters of a step are the noise. Restitution, gap or forcing are parameters
//! like any other, so that what is random is named by the scene, and a return is that of guarded
//! iteration at the parameters drawn for it. See `SimpsonHoganKuske2013` on noise near a graze.
//!
//! Every orbit has a generator of its own, begun by the seed and the number of the orbit alone, and
//! densities are counts: no result depends on threads.

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

/// What is asked of [`noise`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRequest {
    /// Means of the parameters: offsets of all active ones.
    pub at: Vec<f64>,
    /// Standard deviations of all active parameters; 0 for those without noise.
    pub deviations: Vec<f64>,
    /// How they are drawn.
    pub law: NoiseLaw,
    /// Offsets at which every orbit starts.
    pub start: Vec<f64>,
    /// How many orbits.
    pub orbits: usize,
    /// Returns before anything is counted.
    pub transient: usize,
    /// Returns that are counted.
    pub keep: usize,
    /// First and last offset of every coordinate between which a density is counted.
    pub ranges: Vec<[f64; 2]>,
    /// Cells along every coordinate.
    pub cells: usize,
    /// Begins the generators.
    pub seed: u64,
    /// What computes the returns.
    pub method: Method,
}

/// How noise is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLaw {
    /// Normal.
    #[default]
    Normal,
    /// Uniform, of the same standard deviation.
    Uniform,
}

/// What orbits under noise do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoisyOrbits {
    /// Points that were counted, those outside the ranges too.
    pub points: u64,
    /// Mean of every coordinate.
    pub mean: Vec<f64>,
    /// Covariance of the coordinates, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Counts in the cells of every coordinate.
    pub marginals: Vec<Vec<u64>>,
    /// Counts in the cells of the first two coordinates, row by row of the second; empty with one.
    pub joint: Vec<u64>,
    /// Share of the returns with contact.
    pub contacts: f64,
    /// Share of the returns that the map made; the others are direct simulation.
    pub by_map: f64,
    /// Share of the returns that begin outside the window.
    pub outside: f64,
    /// Orbits that ended early: a return had no image.
    pub ended: usize,
}

/// Orbits whose parameters are drawn afresh at every return.
///
/// # Errors
///
/// [`AnalysisError::Length`] for another number of coordinates or parameters; as
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
        let mut part = Part::new(map, &run, &direct, request, orbits);
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

/// Orbits that go in step: sums over them are taken in the same order on any number of threads.
pub(super) const CHUNK: usize = 256;

/// Some of the orbits.
struct Part<'a> {
    map: &'a LocalMap,
    run: &'a HornerMap,
    direct: DirectMap<'a>,
    request: &'a NoiseRequest,
    generators: Vec<Generator>,
    states: Vec<f64>,
    going: Vec<bool>,
    counts: Counts,
}

impl<'a> Part<'a> {
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

    /// One return of every orbit.
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
        // NOTE: one row of parameters is one for all orbits, and the same for one orbit.
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
                Method::Direct => false,
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

/// What was counted.
#[derive(Clone, Debug)]
struct Counts {
    points: u64,
    /// Sums of offsets from the start, and of their products.
    sums: Vec<f64>,
    products: Vec<f64>,
    marginals: Vec<Vec<u64>>,
    joint: Vec<u64>,
    /// Returns with contact, of the map, from outside the window.
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
        // A phase counts from within half a period of the start.
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

/// The generator SplitMix64 (Steele, Lea, Flood 2014), begun by a seed and the number of an orbit.
#[derive(Clone, Debug)]
struct Generator {
    state: u64,
    /// The second of a pair of normal numbers.
    spare: Option<f64>,
}

impl Generator {
    fn new(seed: u64, orbit: u64) -> Self {
        // Scrambled twice: generators of neighbouring orbits do not go through the same numbers.
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

    /// Between −1 and 1.
    fn even(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A number of mean 0 and standard deviation 1.
    fn draw(&mut self, law: NoiseLaw) -> f64 {
        match law {
            NoiseLaw::Uniform => 3f64.sqrt() * self.even(),
            NoiseLaw::Normal => self.normal(),
        }
    }

    /// The polar method of Marsaglia.
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
            // Five standard deviations of each mean.
            assert!((sum / count).abs() < 5.0 / count.sqrt());
            assert!((squares / count - 1.0).abs() < 5.0 * (2.0 / count).sqrt());
            assert!((products / count).abs() < 5.0 / count.sqrt());
            let kurtosis = if law == NoiseLaw::Normal { 3.0 } else { 1.8 };
            assert!((fourth / count - kurtosis).abs() < 5.0 * (96.0 / count).sqrt());
        }
    }
}
