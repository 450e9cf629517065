//! Stable and unstable manifolds of saddles as curves, on sections of two coordinates.
//!
//! One idea: every point of an invariant curve is the image, after a number of returns, of a point
//! on a short first piece near the saddle. A curve is parametrised by the place on that piece and
//! the number of returns together, so that each point is computed from an orbit of its own and
//! errors do not accumulate along the curve. The unstable manifold takes images, the stable one
//! preimages, which Newton's method finds on the map itself, with whatever contacts they make.
//!
//! Reference: `KrauskopfOsinga1998`, for the control of spacing and turning.

mod curve;
mod data;
mod preimage;

pub(super) use data::ManifoldPlane;
pub use data::{ManifoldBranch, ManifoldEnd, ManifoldKind, ManifoldSide, Manifolds, Saddle};

use nalgebra::DMatrix;

use super::known::{product_from, refine};
use crate::analysis::diagram::SweptMap;
use crate::analysis::error::AnalysisError;
use crate::analysis::orbits::{FoundOrbit, OrbitsRequest, orbits};
use crate::analysis::periodic::{ContactItinerary, finite_or_one};
use crate::analysis::progress::{Progress, resumed_if};
use crate::expansion::LocalMap;
use crate::iteration::{DiscreteMap, parallel};
use crate::model::{Method, Scene};
use crate::orbit::GrazingOrbit;
use curve::{ManifoldCurve, ManifoldSeed};
use preimage::Returns;

/// Largest distance from the plane's centre up to which curves are followed, in half-ranges.
const SURROUNDINGS: f64 = 4.0;
/// Points nearer than this, in half-ranges, count as equal.
const ONE_POINT: f64 = 1e-7;
/// First number of the key under which a computed branch is kept. The keys of the rounds of cells
/// begin with the number of the round, which is smaller.
const KEPT: u64 = u64::MAX;
/// Least growth factor of a curve in the returns that are taken at a time.
const LEAST_GROWTH: f64 = 1.5;
/// Most passes through a saddle's period that are taken at a time.
const MOST_PASSES: f64 = 64.0;

/// Manifolds of the saddles up to a period, by the method and at the parameters of a request, on a
/// section of two coordinates.
///
/// Saddles are taken from the orbit search: with [`Method::Map`] orbits in the map's window,
/// otherwise orbits of direct simulation, near and far.
///
/// # Errors
///
/// [`AnalysisError::Itinerary`] for a period with too many itineraries, and as
/// [`orbits`](crate::analysis::orbits::orbits).
pub(super) fn manifolds(
    (scene, orbit, map): (&Scene, &GrazingOrbit, &LocalMap),
    request: &ManifoldPlane<'_>,
    longest_period: usize,
    swept: &dyn SweptMap,
    progress: &dyn Progress,
) -> Result<Manifolds, AnalysisError> {
    let itineraries = ContactItinerary::all(map.passages(), longest_period)?;
    let direct = request.method != Method::Map;
    let asked = OrbitsRequest {
        itineraries,
        at: vec![request.parameters.to_vec()],
        direct,
        far: direct,
        loci: None,
    };
    let found = orbits(scene, orbit, map, &asked, progress)?.orbits;
    let fixed = swept.at(request.parameters);
    let tracer = Tracer::new(request, map, &*fixed);
    let mut saddles: Vec<Local> = Vec::new();
    for local in found.iter().filter_map(|orbit| tracer.saddle(orbit)) {
        if !saddles.iter().any(|known| tracer.is_same(known, &local)) {
            saddles.push(local);
        }
    }
    let cases: Vec<_> = saddles
        .iter()
        .enumerate()
        .flat_map(|(saddle, local)| (0..local.points.len()).map(move |point| (saddle, point)))
        .flat_map(|at| ManifoldKind::ALL.map(|kind| (at, kind)))
        .flat_map(|(at, kind)| ManifoldSide::ALL.map(|side| (at, kind, side)))
        .collect();
    progress.expect(cases.len() as u64);
    let branch = |(number, &((saddle, point), kind, side)): (usize, &((usize, usize), _, _))| {
        let place = [KEPT, number as u64];
        let fits = |branch: &ManifoldBranch| {
            (branch.kind, branch.saddle, branch.point, branch.side) == (kind, saddle, point, side)
        };
        let branch = resumed_if(progress, &place, fits, || {
            let fixed = swept.at(request.parameters);
            let tracer = Tracer { map: &*fixed, ..tracer };
            let (pieces, end) = tracer.curve(&saddles[saddle], point, kind, side);
            ManifoldBranch { kind, saddle, point, side, pieces, end }
        });
        progress.advance(1);
        branch
    };
    let branches = parallel::map(cases.iter().enumerate(), branch);
    let saddles = saddles.into_iter().map(|local| local.saddle).collect();
    Ok(Manifolds { longest_period, saddles, branches })
}

/// A saddle with the Jacobian of the map of its period at each of its points.
struct Local {
    saddle: Saddle,
    points: Vec<([f64; 2], DMatrix<f64>)>,
}

/// Computes the curves of one map.
#[derive(Clone, Copy)]
struct Tracer<'a> {
    request: &'a ManifoldPlane<'a>,
    local: &'a LocalMap,
    map: &'a dyn DiscreteMap,
    /// Centre and half-range of the plane, by coordinate.
    middle: [f64; 2],
    scales: [f64; 2],
}

impl<'a> Tracer<'a> {
    fn new(request: &'a ManifoldPlane<'a>, local: &'a LocalMap, map: &'a dyn DiscreteMap) -> Self {
        let (mut middle, mut scales) = ([0.0; 2], [1.0; 2]);
        for (&axis, [from, to]) in request.axes.iter().zip(&request.ranges) {
            middle[axis] = 0.5 * (from + to);
            scales[axis] = finite_or_one(0.5 * (to - from));
        }
        Self { request, local, map, middle, scales }
    }

    /// Refines an orbit on the iterated map; `None` unless it is a saddle near the plane.
    fn saddle(&self, found: &FoundOrbit) -> Option<Local> {
        let inside = self.request.method != Method::Map || found.inside;
        if !found.physical || !inside {
            return None;
        }
        let widths: Vec<f64> = self.local.window.state.iter().copied().map(finite_or_one).collect();
        let (states, jacobians) = refine(self.map, &found.states, &widths)?;
        if !states.iter().any(|state| self.is_near([state[0], state[1]])) {
            return None;
        }
        let local = |(number, state): (usize, &Vec<f64>)| {
            ([state[0], state[1]], product_from(&jacobians, number))
        };
        let points: Vec<_> = states.iter().enumerate().map(local).collect();
        let multipliers = real_eigenvalues(&points.first()?.1)?;
        let [large, small] = multipliers.map(f64::abs);
        if !(large > 1.0 && small < 1.0 && small > 0.0) {
            return None;
        }
        let itinerary = found.itinerary.clone();
        Some(Local { saddle: Saddle { itinerary, states, multipliers }, points })
    }

    /// Whether two saddles are the same orbit, found twice.
    fn is_same(&self, known: &Local, found: &Local) -> bool {
        let first = found.points[0].0;
        let apart = |point: &[f64]| self.map.circle().apart(point, &first, &self.scales);
        known.points.iter().any(|(point, _)| apart(point) <= ONE_POINT)
    }

    fn is_near(&self, point: [f64; 2]) -> bool {
        let place = |axis: usize| (point[axis] - self.middle[axis]) / self.scales[axis];
        (0..2).all(|axis| place(axis).abs() <= SURROUNDINGS)
    }

    /// Pieces of one branch, and the reason why it ends.
    fn curve(
        &self,
        local: &Local,
        point: usize,
        kind: ManifoldKind,
        side: ManifoldSide,
    ) -> (Vec<Vec<[f64; 2]>>, ManifoldEnd) {
        let (at, derivative) = &local.points[point];
        let [large, small] = local.saddle.multipliers;
        let (multiplier, factor) = match kind {
            ManifoldKind::Unstable => (large, large),
            ManifoldKind::Stable => (small, 1.0 / small),
        };
        // A reflecting saddle needs two passes; slow growth needs enough passes to grow.
        let reflects = usize::from(factor < 0.0) + 1;
        let growth = factor.abs().ln() * reflects as f64;
        let passes = (LEAST_GROWTH.ln() / growth).ceil().clamp(1.0, MOST_PASSES);
        let Some(direction) = self.direction(derivative, multiplier, side) else {
            return (Vec::new(), ManifoldEnd::NotSmooth);
        };
        let returns = Returns {
            map: self.map,
            kind,
            count: local.points.len() * reflects * passes as usize,
            middle: self.middle,
            scales: self.scales,
            window: (self.request.method == Method::Map)
                .then_some((&self.local.window, self.request.parameters)),
            is_near: &|point| self.is_near(point),
        };
        let factor = (growth * passes).exp();
        match ManifoldSeed::beside(&returns, *at, direction, factor) {
            Some(seed) => ManifoldCurve::new(&returns, seed).run(),
            None => (Vec::new(), ManifoldEnd::NotSmooth),
        }
    }

    /// Eigenvector on a side, one half-range long.
    fn direction(
        &self,
        derivative: &DMatrix<f64>,
        multiplier: f64,
        side: ManifoldSide,
    ) -> Option<[f64; 2]> {
        let shifted = derivative - DMatrix::identity(2, 2) * multiplier;
        // Both rows have the same kernel; the larger row gives it more accurately.
        let kernels = [0, 1].map(|row| [-shifted[(row, 1)], shifted[(row, 0)]]);
        let length = |v: &[f64; 2]| (v[0] / self.scales[0]).hypot(v[1] / self.scales[1]);
        let size = |row: usize| {
            (shifted[(row, 0)] * self.scales[0]).hypot(shifted[(row, 1)] * self.scales[1])
                / self.scales[row]
        };
        let vector = if size(0) >= size(1) { kernels[0] } else { kernels[1] };
        let horizontal = self.request.axes[0];
        let is_upper = match vector[horizontal] {
            0.0 => vector[1 - horizontal] > 0.0,
            value => value > 0.0,
        };
        let sign = if is_upper == (side == ManifoldSide::Upper) { 1.0 } else { -1.0 };
        let scaled = vector.map(|value| sign * value / length(&vector));
        scaled.iter().all(|value| value.is_finite()).then_some(scaled)
    }
}

/// Eigenvalues of a 2 × 2 matrix, the one with the larger magnitude first; `None` if not real.
fn real_eigenvalues(matrix: &DMatrix<f64>) -> Option<[f64; 2]> {
    let half = 0.5 * (matrix[(0, 0)] + matrix[(1, 1)]);
    let determinant = matrix[(0, 0)] * matrix[(1, 1)] - matrix[(0, 1)] * matrix[(1, 0)];
    let root = (half * half - determinant).sqrt();
    // Avoids cancellation: the smaller one follows from the product.
    let large = half + root.copysign(half);
    let found = [large, determinant / large];
    found.iter().all(|value| value.is_finite()).then_some(found)
}
