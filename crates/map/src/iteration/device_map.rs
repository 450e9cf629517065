//! Orbits on another processor, which runs one kernel on many points at once.
//!
//! One idea: the kernel iterates, and nothing else: kept states, depths and the growth of tangent
//! vectors come back as they are, so that periods, contacts and exponents are found by the text
//! that finds those of every other orbit, from the same bits.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::discrete_map::StepInfo;
use super::lyapunov::{Growth, LyapunovExponent};
use super::orbit::{MapOrbit, OrbitEnd, OrbitRequest};
use super::parallel::locked;
use crate::expansion::MapWindow;

/// A processor with the kernel `*_orbits` of a map that was emitted in CUDA, which says what
/// settings, inputs, constants, numbers and words are.
pub trait PointKernel: std::fmt::Debug + Send + Sync {
    /// What people call the processor.
    fn name(&self) -> &str;

    /// Runs the kernel on points; `take` is given what it wrote, piece by piece, in order.
    ///
    /// # Errors
    ///
    /// What the processor said.
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
    /// Iterates dropped, iterates kept, iterates in which a tangent vector turns.
    pub settings: [i64; 3],
    /// Coordinates and parameters, point after point.
    pub inputs: &'a [f64],
    /// Bounds that all points have in common.
    pub constants: &'a [f64],
    /// Numbers that are written for each point.
    pub numbers: usize,
}

/// What a kernel wrote for some points: one number after another, of all points each.
#[derive(Clone, Copy, Debug)]
pub struct KernelPiece<'a> {
    /// Number of points.
    pub count: usize,
    /// The numbers.
    pub numbers: &'a [f64],
    /// The words, [`WORDS`](Self::WORDS) of each point.
    pub words: &'a [i64],
}

impl KernelPiece<'_> {
    /// Words of a point.
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

/// What a [`DeviceMap`] did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceReport {
    /// What people call the processor.
    pub name: String,
    /// Orbits that were made there.
    pub made: u64,
    /// Orbits that left the window there, or began outside, and were handed back.
    pub handed_back: u64,
    /// Whether direct simulation was asked for, which is not there.
    pub left_direct: bool,
    /// What the processor said when it failed; everything from there on was made without it.
    pub failure: Option<String>,
}

/// An orbit that another processor made, with its largest Lyapunov exponent.
pub type DeviceOrbit = (MapOrbit, Option<LyapunovExponent>);

impl DeviceMap {
    /// A map of so many coordinates and passages, by its kernel.
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

    /// What it did so far.
    pub fn report(&self) -> DeviceReport {
        DeviceReport {
            name: self.kernel.name().to_owned(),
            made: self.made.load(Ordering::Relaxed),
            handed_back: self.handed_back.load(Ordering::Relaxed),
            left_direct: self.left_direct.load(Ordering::Relaxed),
            failure: locked(&self.failure).clone(),
        }
    }

    /// Notes that direct simulation was asked for.
    pub(crate) fn leave_direct(&self) {
        self.left_direct.store(true, Ordering::Relaxed);
    }

    /// Whether the processor failed: it is not asked again.
    pub(crate) fn has_failed(&self) -> bool {
        locked(&self.failure).is_some()
    }

    /// Numbers that come back for each orbit.
    pub fn numbers(&self, keep: usize) -> usize {
        2 * self.dimension + keep * (self.dimension + self.passages + 1)
    }

    /// The orbits from some states at parameters of their own, with the exponents of those that
    /// were completed after `turning` iterates of their tangent vectors; the very orbits of
    /// [`FrozenLanes`](super::FrozenLanes).
    ///
    /// `None` for an orbit that leaves the window, if one is given; `None` for all where the
    /// processor fails, which the [report](Self::report) says.
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

    /// Half-widths of the window and its depth, sizes of escape, a component of a unit vector.
    fn constants(&self, request: &OrbitRequest, window: Option<&MapWindow>) -> Vec<f64> {
        let unbounded = vec![f64::INFINITY; self.dimension];
        let widths = window.map_or(&unbounded, |window| &window.state);
        let depth = window.map_or(f64::INFINITY, |window| window.depth);
        let unit = 1.0 / (self.dimension as f64).sqrt();
        [&widths[..], &[depth], &request.escape, &[unit]].concat()
    }

    /// What came back for a point of a piece; `None` if its orbit left the window.
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
