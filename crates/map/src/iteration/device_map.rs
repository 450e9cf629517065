//! Orbits on another processor, such as a GPU, which runs one kernel on many points at once.
//!
//! The kernel only iterates: kept states, depths and the growth of tangent vectors come back
//! unprocessed. Periods, contacts and exponents are then found from the same bits by the same code
//! as for every other orbit.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::discrete_map::StepInfo;
use super::lyapunov::{Growth, LyapunovExponent};
use super::orbit::{MapOrbit, OrbitEnd, OrbitRequest};
use super::parallel::locked;
use crate::expansion::MapWindow;

/// A processor that runs the kernel `*_orbits` of a map emitted in CUDA. The emitted code defines
/// the settings, inputs, constants, numbers and words.
pub trait PointKernel: std::fmt::Debug + Send + Sync {
    /// Name of the processor, for users.
    fn name(&self) -> &str;

    /// Runs the kernel on points; `take` receives its output, piece by piece, in order.
    ///
    /// # Errors
    ///
    /// The processor's error message.
    fn run(
        &self,
        points: &KernelPoints<'_>,
        take: &mut dyn FnMut(KernelPiece<'_>),
    ) -> Result<(), String>;
}

/// Points that a kernel runs on.
#[derive(Clone, Copy, Debug)]
pub struct KernelPoints<'a> {
    /// Number of points.
    pub count: usize,
    /// Numbers of iterates: dropped, kept, and dropped for the direction of the tangent vector.
    pub settings: [i64; 3],
    /// Coordinates and parameters, point after point.
    pub inputs: &'a [f64],
    /// Bounds shared by all points.
    pub constants: &'a [f64],
    /// Number of outputs of each point.
    pub numbers: usize,
}

/// Output of a kernel for some points, row by row: one value of each point per row.
#[derive(Clone, Copy, Debug)]
pub struct KernelPiece<'a> {
    /// Number of points.
    pub count: usize,
    /// Rows of numbers.
    pub numbers: &'a [f64],
    /// Rows of words, [`WORDS`](Self::WORDS) per point: end, iterate, code of the exponent.
    pub words: &'a [i64],
}

impl KernelPiece<'_> {
    /// Number of words per point.
    pub const WORDS: usize = 3;
}

/// A local map on another processor.
#[derive(Debug)]
pub struct DeviceMap {
    kernel: Box<dyn PointKernel>,
    dimension: usize,
    passages: usize,
    made: AtomicU64,
    handed_back: AtomicU64,
    left_direct: AtomicBool,
    failure: Mutex<Option<String>>,
}

/// Counts of a [`DeviceMap`], and its failure if there was one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceReport {
    /// Name of the processor, for users.
    pub name: String,
    /// Number of orbits computed there.
    pub made: u64,
    /// Number of orbits handed back because they left the window or began outside.
    pub handed_back: u64,
    /// Whether direct simulation was requested, which the device does not offer.
    pub left_direct: bool,
    /// The processor's error message; after it the device is not used.
    pub failure: Option<String>,
}

/// An orbit computed by another processor, with its largest Lyapunov exponent.
pub type DeviceOrbit = (MapOrbit, Option<LyapunovExponent>);

impl DeviceMap {
    /// A map with its kernel and its numbers of coordinates and passages.
    pub fn new(kernel: Box<dyn PointKernel>, dimension: usize, passages: usize) -> Self {
        Self {
            kernel,
            dimension,
            passages,
            made: AtomicU64::new(0),
            handed_back: AtomicU64::new(0),
            left_direct: AtomicBool::new(false),
            failure: Mutex::default(),
        }
    }

    /// Counts and failure so far.
    pub fn report(&self) -> DeviceReport {
        DeviceReport {
            name: self.kernel.name().to_owned(),
            made: self.made.load(Ordering::Relaxed),
            handed_back: self.handed_back.load(Ordering::Relaxed),
            left_direct: self.left_direct.load(Ordering::Relaxed),
            failure: locked(&self.failure).clone(),
        }
    }

    /// Notes that direct simulation was requested.
    pub(crate) fn leave_direct(&self) {
        self.left_direct.store(true, Ordering::Relaxed);
    }

    /// Whether the processor has failed; it is not used again.
    pub(crate) fn has_failed(&self) -> bool {
        locked(&self.failure).is_some()
    }

    /// Number of outputs for each orbit that keeps this many states.
    pub fn numbers(&self, keep: usize) -> usize {
        2 * self.dimension + keep * (self.dimension + self.passages + 1)
    }

    /// Orbits from given states, each at its own parameters, with the exponents of completed
    /// orbits; the tangent vector first turns for `turning` iterates. Equal to those of
    /// [`FrozenLanes`](super::FrozenLanes) bit for bit.
    ///
    /// An element is `None` if the orbit leaves the window; the result is `None` if the processor
    /// fails, and the [report](Self::report) then holds its message.
    pub fn orbits(
        &self,
        starts: &[[&[f64]; 2]],
        request: &OrbitRequest,
        turning: usize,
        window: Option<&MapWindow>,
    ) -> Option<Vec<Option<DeviceOrbit>>> {
        let inside = |parameters: &[f64]| window.is_none_or(|w| w.holds(&[], parameters, &[]));
        let sent: Vec<bool> = starts.iter().map(|[_, parameters]| inside(parameters)).collect();
        let used = starts.iter().zip(&sent).filter(|(_, sent)| **sent);
        let inputs: Vec<f64> = used.flat_map(|(start, _)| start.concat()).collect();
        let points = KernelPoints {
            count: sent.iter().filter(|sent| **sent).count(),
            settings: [request.transient as i64, request.keep as i64, turning as i64],
            inputs: &inputs,
            constants: &self.constants(request, window),
            numbers: self.numbers(request.keep),
        };
        let mut found = Vec::with_capacity(points.count);
        let mut take = |piece: KernelPiece<'_>| {
            found.extend((0..piece.count).map(|point| self.orbit(piece, point, request)));
        };
        if points.count > 0
            && let Err(failure) = self.kernel.run(&points, &mut take)
        {
            let mut noted = locked(&self.failure);
            noted.get_or_insert(failure);
            return None;
        }
        let made = found.iter().flatten().count();
        self.made.fetch_add(made as u64, Ordering::Relaxed);
        self.handed_back.fetch_add((starts.len() - made) as u64, Ordering::Relaxed);
        let mut found = found.into_iter();
        Some(
            sent.into_iter().map(|sent| if sent { found.next().flatten() } else { None }).collect(),
        )
    }

    /// Half-widths of the window, its depth, bounds of an escape, component of the unit tangent
    /// vector.
    fn constants(&self, request: &OrbitRequest, window: Option<&MapWindow>) -> Vec<f64> {
        let unbounded = vec![f64::INFINITY; self.dimension];
        let widths = window.map_or(&unbounded, |window| &window.state);
        let depth = window.map_or(f64::INFINITY, |window| window.depth);
        let unit = 1.0 / (self.dimension as f64).sqrt();
        [&widths[..], &[depth], &request.escape, &[unit]].concat()
    }

    /// Orbit and exponent of a point of a piece; `None` if the orbit left the window.
    fn orbit(
        &self,
        piece: KernelPiece<'_>,
        point: usize,
        request: &OrbitRequest,
    ) -> Option<DeviceOrbit> {
        let number = |row: usize| piece.numbers[row * piece.count + point];
        let word = |row: usize| piece.words[row * piece.count + point];
        let (dimension, width) = (self.dimension, self.dimension + self.passages);
        let iterate = usize::try_from(word(1)).unwrap_or(0);
        let end = match word(0) {
            0 => OrbitEnd::Completed,
            1 => OrbitEnd::Escaped { iterate },
            2 => OrbitEnd::NoImage { iterate },
            _ => return None,
        };
        let last: Vec<f64> = (0..dimension).map(number).collect();
        let mut orbit = MapOrbit::begin(&last, request);
        orbit.end = end;
        let made = match end {
            OrbitEnd::Completed => iterate,
            _ => iterate.saturating_sub(1),
        };
        let kept = made.saturating_sub(request.transient);
        if kept > 0 {
            orbit.enter((dimension..2 * dimension).map(number));
        }
        for row in (0..kept).map(|kept| 2 * dimension + kept * width) {
            let mut info = StepInfo { valid: true, ..StepInfo::default() };
            for passage in 0..self.passages {
                info.add_passage(passage, number(row + dimension + passage));
            }
            orbit.keep((row..row + dimension).map(number), info);
        }
        orbit.settle(request);
        let growths = 2 * dimension + request.keep * width;
        let exponent = match word(2) {
            0 if end == OrbitEnd::Completed => {
                let mut sum = Growth::new(0.0, request.keep);
                (0..request.keep).for_each(|n| sum.add(number(growths + n).ln()));
                sum.exponent(|sum| sum)
            }
            4 => Some(LyapunovExponent::ANNIHILATED),
            _ => None,
        };
        Some((orbit, exponent))
    }
}
