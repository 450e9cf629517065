//! Attractors that were found: a periodic orbit, or the cells visited by an orbit without a period,
//! with states known to be attracted.
//!
//! One idea: about every point of a periodic orbit, the norm in which the derivative contracts
//! defines ellipsoids. Ellipsoids are tried from the smallest up, as long as the map is seen to
//! send them into themselves with the contacts of the orbit, so that none reaches over a graze into
//! another basin; an orbit that enters one need not be followed further. An attractor
//! without a period is known by the cells of a grid over its extent (`DatserisWagemakers2022`): an
//! orbit that stays in them is on it.

use crate::numeric::low_discrepancy;
use std::collections::HashSet;

use nalgebra::{Complex, DMatrix, DVector};

use crate::iteration::{DiscreteMap, MapOrbit, PassageSet, PhaseCircle};
use crate::numeric::linear::eigenvalues;

/// Most Newton steps to the points of a periodic orbit.
const NEWTON_STEPS: usize = 12;
/// Largest distance, in scales, that Newton's method may move a point and still be at the same
/// orbit.
const NEARBY: f64 = 1e-3;
/// Largest last Newton step, in scales.
const CONVERGED: f64 = 1e-11;
/// Points nearer than this, in scales, count as equal.
const ONE_POINT: f64 = 1e-7;

/// Radius of the smallest ellipsoid, in scales, and the ratio of successive radii.
const SMALLEST: f64 = 1e-7;
const GROWTH: f64 = 1.4;
/// Number of ellipsoids tried: the largest has a radius of some ten thousand scales.
const ELLIPSOIDS: usize = 75;
/// Number of points tried on each.
const DIRECTIONS: usize = 48;
/// Fraction of the largest contracting radius that is used.
const SAFE: f64 = 0.6;
/// Largest factor per period in the norm for the derivative; the factor is otherwise the square
/// root of the largest multiplier.
const SLOWEST: f64 = 1.0 - 1e-9;

/// Binary logarithm of the number of cells along a coordinate, in the grid over an attractor
/// without a period.
const CELL_BITS: u32 = 6;
/// Smallest side of a cell, in scales: a flat attractor may still be approached from the side.
const SMALLEST_CELL: f64 = 1e-6;

/// Ellipsoid about a point of a periodic orbit that the map of the period contracts.
#[derive(Clone, Debug)]
struct Trap {
    centre: DVector<f64>,
    circle: PhaseCircle,
    form: DMatrix<f64>,
    /// Bound of the quadratic form on the ellipsoid.
    largest: f64,
    /// Passages that make contact in each return of a period from the point on.
    contacts: Vec<PassageSet>,
}

impl Trap {
    fn value(&self, state: &[f64]) -> f64 {
        let offset = DVector::from_fn(state.len(), |place, _| {
            self.circle.shortest(place, state[place] - self.centre[place])
        });
        offset.dot(&(&self.form * &offset))
    }

    /// Whether the kept states of an orbit, a period apart and counted back from the last one, come
    /// nearer and nearer with the contacts of the orbit about the point.
    fn draws(&self, orbit: &MapOrbit) -> bool {
        let (states, period) = (orbit.states().collect::<Vec<_>>(), self.contacts.len());
        let first = (states.len() - 1) % period;
        let starts: Vec<usize> = (first..states.len()).step_by(period).collect();
        starts.len() > 1
            && starts.windows(2).all(|pair| {
                let made = orbit.steps[pair[0] + 1..=pair[1]].iter().map(|step| step.passages);
                made.eq(self.contacts.iter().copied())
                    && self.value(states[pair[1]]) < self.value(states[pair[0]])
            })
    }
}

/// A periodic orbit with its multipliers and ellipsoids.
#[derive(Clone, Debug)]
pub(super) struct Cycle {
    pub(super) points: Vec<Vec<f64>>,
    /// Multipliers, largest magnitude first; empty if the orbit was not refined.
    pub(super) multipliers: Vec<Complex<f64>>,
    circle: PhaseCircle,
    traps: Vec<Trap>,
}

impl Cycle {
    /// Periodic orbit near the points that an orbit settled on: refined by Newton's method if that
    /// converges nearby, otherwise the points as they are.
    pub(super) fn near(map: &dyn DiscreteMap, settled: &[Vec<f64>], scales: &[f64]) -> Self {
        let refined = refine(map, settled, scales);
        Self::new(map, refined.unwrap_or_else(|| (settled.to_vec(), Vec::new())), scales)
    }

    /// Attracting periodic orbits that Newton's method finds from a state, which may be far from
    /// them, with periods up to the longest.
    pub(super) fn around(
        map: &dyn DiscreteMap,
        state: &[f64],
        longest: usize,
        scales: &[f64],
    ) -> impl Iterator<Item = Self> {
        (1..=longest).filter_map(move |period| {
            let found = newton(map, (state, period), scales, f64::INFINITY)?;
            Some(Self::new(map, found, scales)).filter(Self::attracts)
        })
    }

    /// Whether the last state of an orbit lies in one of the ellipsoids, or its kept states come
    /// nearer and nearer to the periodic orbit.
    pub(super) fn draws(&self, orbit: &MapOrbit) -> bool {
        self.holds(&orbit.last) || self.traps.iter().any(|trap| trap.draws(orbit))
    }

    /// The orbit through points, with the ellipsoids that the Jacobians there give.
    fn new(map: &dyn DiscreteMap, (points, jacobians): RefinedOrbit, scales: &[f64]) -> Self {
        let circle = map.circle();
        let mut cycle = Self { points, multipliers: Vec::new(), circle, traps: Vec::new() };
        if jacobians.is_empty() {
            return cycle;
        }
        cycle.multipliers = eigenvalues(&product_from(&jacobians, 0)).unwrap_or_default();
        if cycle.attracts() {
            let product = |point: usize| product_from(&jacobians, point);
            let traps = (0..cycle.points.len())
                .filter_map(|point| trap(map, &cycle.points, point, &product(point), scales));
            cycle.traps = traps.collect();
        }
        cycle
    }

    /// Whether all multipliers are known and inside the unit circle.
    fn attracts(&self) -> bool {
        !self.multipliers.is_empty() && self.largest_multiplier() < SLOWEST
    }

    /// Magnitude of the largest multiplier; 0 if none is known.
    pub(super) fn largest_multiplier(&self) -> f64 {
        self.multipliers.first().map_or(0.0, |multiplier| multiplier.norm())
    }

    /// Whether a state lies in one of the ellipsoids.
    pub(super) fn holds(&self, state: &[f64]) -> bool {
        self.traps.iter().any(|trap| trap.value(state) < trap.largest)
    }

    /// Whether the first of `points` is a point of the orbit, within `tolerance` scales.
    pub(super) fn passes(&self, points: &[Vec<f64>], scales: &[f64], tolerance: f64) -> bool {
        let first = points.first();
        first.is_some_and(|first| {
            self.points.iter().any(|own| self.circle.apart(own, first, scales) <= tolerance)
        })
    }

    /// Whether Newton's method refined the orbit.
    pub(super) fn is_refined(&self) -> bool {
        !self.multipliers.is_empty()
    }
}

/// Whether two settled orbits lie on one periodic orbit: Newton's method finds the same orbit from
/// the points of both.
pub(in crate::analysis) fn are_one_cycle(
    map: &dyn DiscreteMap,
    settled: [&[Vec<f64>]; 2],
    scales: &[f64],
) -> bool {
    let [Some((a, _)), Some((b, _))] = settled.map(|points| refine(map, points, scales)) else {
        return false;
    };
    let is_first = |point: &Vec<f64>| map.circle().apart(&a[0], point, scales) <= ONE_POINT;
    a.len() == b.len() && b.iter().any(is_first)
}

/// Points of a periodic orbit, and the Jacobian at each.
pub(super) type RefinedOrbit = (Vec<Vec<f64>>, Vec<DMatrix<f64>>);

/// Jacobian of the map of the period at point `first`, from the Jacobians at all points.
pub(super) fn product_from(jacobians: &[DMatrix<f64>], first: usize) -> DMatrix<f64> {
    let (before, after) = jacobians.split_at(first);
    let dimension = jacobians.first().map_or(0, DMatrix::nrows);
    let identity = DMatrix::identity(dimension, dimension);
    after.iter().chain(before).fold(identity, |product, jacobian| jacobian * product)
}

/// Periodic orbit near the points that an orbit settled on, by Newton's method.
pub(super) fn refine(
    map: &dyn DiscreteMap,
    settled: &[Vec<f64>],
    scales: &[f64],
) -> Option<RefinedOrbit> {
    newton(map, (settled.first()?, settled.len()), scales, NEARBY)
}

/// Newton's method for a fixed point of the map of the period, at most `farthest` scales from the
/// first iterate.
fn newton(
    map: &dyn DiscreteMap,
    (first, period): (&[f64], usize),
    scales: &[f64],
    farthest: f64,
) -> Option<RefinedOrbit> {
    let dimension = scales.len();
    let mut start = first.to_vec();
    map.circle().reduce(&mut start);
    for _ in 0..NEWTON_STEPS {
        let ((points, jacobians), mut image) = around(map, &start, period)?;
        map.circle().bring_near(&mut image, &start);
        let identity = DMatrix::identity(dimension, dimension);
        let defect = DVector::from_vec(image) - DVector::from_column_slice(&start);
        let step = (identity - product_from(&jacobians, 0)).lu().solve(&defect)?;
        let size = step.iter().zip(scales).map(|(step, scale)| (step / scale).abs());
        let size = size.fold(0.0, f64::max);
        start.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
        if size.is_nan() || map.circle().apart(&start, first, scales) > farthest {
            return None;
        }
        if size <= CONVERGED {
            return Some(shortest((points, jacobians), map.circle(), scales));
        }
    }
    None
}

/// Points from `start` on over a period, the Jacobians there, and the last image.
fn around(map: &dyn DiscreteMap, start: &[f64], period: usize) -> Option<(RefinedOrbit, Vec<f64>)> {
    let dimension = start.len();
    let (mut state, mut image) = (start.to_vec(), vec![0.0; dimension]);
    let mut rows = vec![0.0; dimension * dimension];
    let (mut points, mut jacobians) = (Vec::new(), Vec::new());
    for _ in 0..period {
        let step = map.step_jacobian(&state, &[], &mut image, &mut rows);
        if !step.valid || rows.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        jacobians.push(DMatrix::from_row_slice(dimension, dimension, &rows));
        points.push(state.clone());
        state.copy_from_slice(&image);
    }
    Some(((points, jacobians), state))
}

/// Cuts the orbit to its shortest period.
fn shortest(
    (mut points, mut jacobians): RefinedOrbit,
    circle: PhaseCircle,
    scales: &[f64],
) -> RefinedOrbit {
    let count = points.len();
    let repeats = |&period: &usize| {
        count.is_multiple_of(period)
            && (period..count)
                .all(|at| circle.apart(&points[at], &points[at - period], scales) <= ONE_POINT)
    };
    if let Some(period) = (1..count).find(repeats) {
        points.truncate(period);
        jacobians.truncate(period);
    }
    (points, jacobians)
}

/// Ellipsoid about a point: all smaller ones were seen to be sent into themselves with the contacts
/// of the orbit. `None` if not even the smallest is.
fn trap(
    map: &dyn DiscreteMap,
    points: &[Vec<f64>],
    number: usize,
    product: &DMatrix<f64>,
    scales: &[f64],
) -> Option<Trap> {
    let centre = DVector::from_column_slice(&points[number]);
    let form = contracted_form(product, scales)?;
    let root = form.clone().cholesky()?.l();
    // Points where the form is 1: L⁻ᵀ of the unit sphere.
    let sphere: Vec<DVector<f64>> = (0..DIRECTIONS)
        .filter_map(|number| root.tr_solve_lower_triangular(&direction(number, scales.len())))
        .collect();
    let (_, contacts) = image(map, centre.as_slice(), points.len())?;
    let mut trap = Trap { centre, circle: map.circle(), form, largest: 0.0, contacts };
    let is_trapped = |radius: f64| {
        sphere.iter().all(|direction| {
            let start = &trap.centre + direction * radius;
            let image = image(map, start.as_slice(), points.len());
            image.is_some_and(|(image, made)| {
                made == trap.contacts && trap.value(&image) < radius * radius
            })
        })
    };
    let radii = (0..ELLIPSOIDS).map(|number| SMALLEST * GROWTH.powi(number as i32));
    let largest = radii.take_while(|&radius| is_trapped(radius)).last()?;
    trap.largest = (SAFE * largest).powi(2);
    Some(trap)
}

/// `Σ (Mᵏ/ρᵏ)ᵀ S⁻² (Mᵏ/ρᵏ)` with `ρ` between the spectral radius and 1: a quadratic form that
/// decreases by `ρ²` or more under `M`.
fn contracted_form(product: &DMatrix<f64>, scales: &[f64]) -> Option<DMatrix<f64>> {
    let radius = eigenvalues(product).ok()?.first()?.norm();
    let slowed = product / radius.sqrt().clamp(0.05, SLOWEST);
    let inverse = scales.iter().map(|scale| 1.0 / (scale * scale));
    let mut sum = DMatrix::from_diagonal(&DVector::from_iterator(scales.len(), inverse));
    let mut power = slowed;
    // Doubling: after k rounds the sum has 2ᵏ terms.
    for _ in 0..40 {
        let added = power.transpose() * &sum * &power;
        let is_small = added.norm() <= 1e-12 * sum.norm();
        sum += added;
        if is_small {
            break;
        }
        power = &power * &power;
    }
    sum.iter().all(|entry| entry.is_finite()).then_some(sum)
}

/// Unit vector number `number` of an even spread over all directions.
fn direction(number: usize, dimension: usize) -> DVector<f64> {
    let direction = match dimension {
        1 => DVector::from_element(1, if number.is_multiple_of(2) { 1.0 } else { -1.0 }),
        2 => {
            let angle = std::f64::consts::TAU * (number as f64 + 0.5) / DIRECTIONS as f64;
            DVector::from_vec(vec![angle.cos(), angle.sin()])
        }
        _ => {
            let cube = low_discrepancy(number, dimension).into_iter();
            DVector::from_iterator(dimension, cube.map(|share| 2.0 * share - 1.0))
        }
    };
    let length = direction.norm();
    direction / length.max(f64::MIN_POSITIVE)
}

/// Image of a state after `steps` steps, and the passages that make contact in each; `None` if a
/// step is not valid.
fn image(
    map: &dyn DiscreteMap,
    start: &[f64],
    steps: usize,
) -> Option<(Vec<f64>, Vec<PassageSet>)> {
    let (mut state, mut image) = (start.to_vec(), vec![0.0; start.len()]);
    let mut contacts = Vec::with_capacity(steps);
    for _ in 0..steps {
        let step = map.step(&state, &[], &mut image);
        if !step.valid {
            return None;
        }
        contacts.push(step.passages);
        std::mem::swap(&mut state, &mut image);
    }
    Some((state, contacts))
}

/// Cells visited by an orbit without a period, in a grid over its extent.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Lower bound of the grid and side of a cell, by coordinate.
    sides: Vec<[f64; 2]>,
    circle: PhaseCircle,
    visited: HashSet<u64>,
}

impl Cells {
    pub(super) fn of(orbit: &MapOrbit, scales: &[f64]) -> Self {
        let count = f64::from(1u32 << CELL_BITS);
        // The outermost states lie at the centres of their cells.
        let side = |([least, greatest], scale): ([f64; 2], &f64)| {
            let side = ((greatest - least) / (count - 1.0)).max(SMALLEST_CELL * scale);
            [least - 0.5 * side, side]
        };
        let sides = orbit.extent().into_iter().zip(scales).map(side).collect();
        let circle = orbit.circle();
        let mut cells = Self { sides, circle, visited: HashSet::new() };
        cells.visited = orbit.states().filter_map(|state| cells.cell(state)).collect();
        cells
    }

    /// Number of the cell of a state, over as many coordinates as fit into 64 bits; `None` outside
    /// the grid.
    fn cell(&self, state: &[f64]) -> Option<u64> {
        let room = (u64::BITS / CELL_BITS) as usize;
        let pairs = state.iter().zip(&self.sides).take(room).enumerate();
        pairs.into_iter().try_fold(0, |number, (coordinate, (value, [least, side]))| {
            let middle = least + 0.5 * f64::from(1u32 << CELL_BITS) * side;
            let place = (self.circle.near(coordinate, *value, middle) - least) / side;
            let inside = (0.0..f64::from(1u32 << CELL_BITS)).contains(&place);
            inside.then_some((number << CELL_BITS) | place as u64)
        })
    }

    pub(super) fn hold(&self, state: &[f64]) -> bool {
        self.cell(state).is_some_and(|cell| self.visited.contains(&cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iteration::{OrbitRequest, StepInfo};

    /// `z ↦ m z + c |z|² z` in the plane, `m` a rotation by one radian that shrinks by 0.9: the
    /// basin of 0 is bounded by the circle with `0.9 + c r² = 1`.
    struct Spiral {
        cubic: f64,
    }

    impl DiscreteMap for Spiral {
        fn dimension(&self) -> usize {
            2
        }
        fn parameters(&self) -> usize {
            0
        }
        fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
            let (x, y) = (state[0], state[1]);
            let factor = 0.9 + self.cubic * (x * x + y * y);
            let (sine, cosine) = 1.0_f64.sin_cos();
            image[0] = factor * (cosine * x - sine * y);
            image[1] = factor * (sine * x + cosine * y);
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            let (x, y) = (state[0], state[1]);
            let (factor, slope) = (0.9 + self.cubic * (x * x + y * y), 2.0 * self.cubic);
            let (sine, cosine) = 1.0_f64.sin_cos();
            let (p, q) = (cosine * x - sine * y, sine * x + cosine * y);
            jacobian.copy_from_slice(&[
                factor * cosine + slope * x * p,
                -factor * sine + slope * y * p,
                factor * sine + slope * x * q,
                factor * cosine + slope * y * q,
            ]);
            self.step(state, parameters, image)
        }
    }

    #[test]
    fn what_a_trap_holds_is_attracted_and_is_most_of_the_basin_about_a_focus() {
        let map = Spiral { cubic: 0.1 };
        let cycle = Cycle::near(&map, &[vec![1e-5, -2e-5]], &[1.0, 1.0]);
        assert!(cycle.points[0].iter().all(|value| value.abs() < 1e-12), "{:?}", cycle.points);
        assert!((cycle.largest_multiplier() - 0.9).abs() < 1e-12);
        // The boundary of the basin is the unit circle.
        let holds = |radius: f64| cycle.holds(&[0.6 * radius, 0.8 * radius]);
        assert!(holds(0.4) && !holds(1.0), "{:?}", cycle.traps);
    }

    #[test]
    fn an_orbit_that_was_given_twice_is_taken_once() {
        let map = Spiral { cubic: 0.0 };
        let twice = [vec![1e-6, 0.0], vec![0.0, 1e-6]];
        assert_eq!(Cycle::near(&map, &twice, &[1.0, 1.0]).points.len(), 1);
    }

    #[test]
    fn cells_hold_the_orbit_they_were_made_of_and_nothing_beside_it() {
        let map = Spiral { cubic: 0.0 };
        let orbit = MapOrbit::of(&map, &[1.0, 0.0], &[], &OrbitRequest::new(0, 400, &[1.0; 2]));
        let cells = Cells::of(&orbit, &[1.0; 2]);
        assert!(orbit.states().all(|state| cells.hold(state)));
        assert!(!cells.hold(&[0.9, 0.9]) && !cells.hold(&[5.0, 0.0]));
    }
}
