//! Equations of an itinerary's orbits of a map, for continuation.
//!
//! One idea: with the depth variable `y` of each contact among the unknowns, a map is a polynomial
//! with exact derivatives, and a branch of orbits passes a graze `y = 0` like any other point. See
//! docs/mathematics/dynamics.md.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::contact_itinerary::ContactItinerary;
use super::kept_orbit::{KeptOrbit, lengths};
use super::orbit::{finite_or_one, window_scales};
use crate::analysis::evaluation::MapEvaluation;
use crate::continuation::{ContinuationPoint, CurveEquations, Linearised, TestValue, crossing};
use crate::expansion::MapWindow;
use crate::iteration::{Tangent, Tangents};
use crate::numeric::Real;
use crate::numeric::linear::inverse;

/// Equations of the orbits of an itinerary, in one or two parameters:
///
/// ```text
/// u = (x/X, y/Y, p/P):   (P_n(… P_1(x; y, p) …) − x)/X = 0,   (depth_j − y_j²)/Y² = 0
/// ```
///
/// with `x` the first section point, `y` the depth variables of the contacts, in order, `p` the
/// free parameters, and the half-widths of the window as units. There are `d + m` equations for `d`
/// coordinates and `m` contacts.
#[derive(Clone, Debug)]
pub struct MapOrbitEquations<'a, S: Real> {
    map: &'a MapEvaluation<S>,
    itinerary: &'a ContactItinerary,
    dimension: usize,
    /// Indices of the active parameters that are unknowns.
    free: Vec<usize>,
    /// Offsets of all active parameters; those of the free ones are ignored.
    at: Vec<S>,
    /// Unit `Y` of the depth variables.
    depth_unit: f64,
    units: Vec<f64>,
    ranges: Vec<[f64; 2]>,
    /// Work done and its bound, in coefficients evaluated.
    work: u64,
    most_work: u64,
}

/// Data of an orbit beside its equations.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PassagesOfOrbit<S> {
    /// Section points of the period, in offsets.
    pub states: Vec<Vec<S>>,
    /// Passages without contact, in order: return, passage, and depth over `Y²`.
    pub free: Vec<(usize, usize, S)>,
    /// Contacts, in order: return, passage, and point of arrival (coordinates; parameters).
    pub arrivals: Vec<(usize, usize, Vec<S>)>,
}

impl KeptOrbit for PassagesOfOrbit<f64> {
    fn states(&self) -> &[Vec<f64>] {
        &self.states
    }

    fn is_like(&self, computed: &Self, _: &ContactItinerary) -> bool {
        let free = |orbit: &Self| -> Vec<[usize; 2]> {
            orbit.free.iter().map(|&(number, passage, _)| [number, passage]).collect()
        };
        let arrivals = |orbit: &Self| -> Vec<[usize; 3]> {
            let arrivals = orbit.arrivals.iter();
            arrivals.map(|(number, passage, point)| [*number, *passage, point.len()]).collect()
        };
        lengths(&self.states) == lengths(&computed.states)
            && free(self) == free(computed)
            && arrivals(self) == arrivals(computed)
    }
}

/// Difference of offsets that counts as rounding, in the unit of the coordinate.
const ROUNDING: f64 = 1e-13;
/// Relative difference up to which points of an orbit count as equal.
const REPEATED: f64 = 1e-5;

impl<'a, S: Real> MapOrbitEquations<'a, S> {
    /// Equations of an itinerary; the parameters in `free` are unknowns, the others are fixed at
    /// the offsets `at`.
    ///
    /// `reach` bounds coordinates and depth variables, in their units. Parameters are unbounded
    /// until [`with_range`](Self::with_range) bounds them.
    pub fn new(
        map: &'a MapEvaluation<S>,
        itinerary: &'a ContactItinerary,
        window: &MapWindow,
        free: &[usize],
        at: &[f64],
        reach: [f64; 2],
    ) -> Self {
        let scales = window_scales(window);
        let dimension = window.state.len();
        let depth = finite_or_one(window.depth.sqrt());
        let units = scales[..dimension].iter().copied();
        let units = units.chain(std::iter::repeat_n(depth, itinerary.contacts()));
        let units = units.chain(free.iter().map(|&place| scales[dimension + place]));
        let units: Vec<f64> = units.collect();
        let followed = dimension + itinerary.contacts();
        let range = |unknown: usize| match unknown {
            unknown if unknown < dimension => [-reach[0], reach[0]],
            unknown if unknown < followed => [-reach[1], reach[1]],
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        };
        Self {
            map,
            itinerary,
            dimension,
            free: free.to_vec(),
            at: at.iter().map(|&value| S::from_f64(value)).collect(),
            ranges: (0..units.len()).map(range).collect(),
            depth_unit: depth,
            units,
            work: 0,
            most_work: u64::MAX,
        }
    }

    /// Bounds a free parameter, given by its index among the free ones, to a range of offsets.
    #[must_use]
    pub fn with_range(mut self, place: usize, range: [f64; 2]) -> Self {
        let unknown = self.first_parameter() + place;
        self.ranges[unknown] = range.map(|value| value / self.units[unknown]);
        self
    }

    /// Bounds a free parameter and adapts the units to its range: parameters vary with the square
    /// of depth variables, so these and the coordinates get units smaller by the root.
    #[must_use]
    pub fn in_units_of(mut self, place: usize, range: [f64; 2]) -> Self {
        let first = self.first_parameter();
        let share = (0.5 * (range[1] - range[0]).abs() / self.units[first + place]).min(1.0);
        if share > 0.0 {
            let root = share.sqrt();
            let shares = (0..self.units.len()).map(|unknown| match unknown < first {
                true => root,
                false => share,
            });
            for (unknown, share) in shares.enumerate() {
                self.units[unknown] *= share;
                self.ranges[unknown] = self.ranges[unknown].map(|end| end / share);
            }
            self.depth_unit *= root;
        }
        self.with_range(place, range)
    }

    /// Bounds depth variables below by zero, as flown contacts require.
    #[must_use]
    pub fn with_positive_depths(mut self) -> Self {
        for unknown in self.dimension..self.first_parameter() {
            self.ranges[unknown][0] = 0.0;
        }
        self
    }

    /// Bounds the work; nothing more is evaluated once it is used up.
    #[must_use]
    pub fn within_work(mut self, most: u64) -> Self {
        self.most_work = most;
        self
    }

    /// Work so far, in coefficients evaluated.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Counts an evaluation; `None` if the bound on work is reached.
    fn counted(&mut self) -> Option<()> {
        let is_spent = <Self as CurveEquations<S>>::is_spent(self);
        self.work += self.map.terms() * self.itinerary.period() as u64;
        (!is_spent).then_some(())
    }

    /// Index of the first depth variable among the unknowns.
    pub fn first_depth_variable(&self) -> usize {
        self.dimension
    }

    /// Index of the first free parameter among the unknowns.
    pub fn first_parameter(&self) -> usize {
        self.dimension + self.itinerary.contacts()
    }

    /// Itinerary of the orbits.
    pub fn itinerary(&self) -> &ContactItinerary {
        self.itinerary
    }

    /// Unit of each unknown.
    pub fn units(&self) -> &[f64] {
        &self.units
    }

    /// Unknowns from a first point, depth variables and all active parameters, in offsets.
    pub fn unknowns(&self, state: &[S], depth_variables: &[S], parameters: &[S]) -> Vec<S> {
        let free = self.free.iter().map(|&place| parameters[place]);
        let values = state.iter().chain(depth_variables).copied().chain(free);
        values.zip(&self.units).map(|(value, &unit)| value / S::from_f64(unit)).collect()
    }

    /// First point, depth variables and all active parameters, in offsets, from unknowns.
    pub fn offsets(&self, unknowns: &[S]) -> (Vec<S>, Vec<S>, Vec<S>) {
        let values = unknowns.iter().zip(&self.units);
        let values: Vec<S> = values.map(|(&value, &unit)| value * S::from_f64(unit)).collect();
        let (state, rest) = values.split_at(self.dimension);
        let (depth_variables, free) = rest.split_at(self.itinerary.contacts());
        let mut parameters = self.at.clone();
        for (&place, &value) in self.free.iter().zip(free) {
            parameters[place] = value;
        }
        (state.to_vec(), depth_variables.to_vec(), parameters)
    }

    /// Residuals and Jacobian by all unknowns, with `d + m` rows; `None` if they are not finite.
    pub fn at(&self, unknowns: &[S]) -> Option<Linearised<S, PassagesOfOrbit<S>>> {
        let mut there = self.evaluated(unknowns, unknowns.len());
        for (column, &unit) in self.units.iter().enumerate() {
            let unit = S::from_f64(unit);
            there.jacobian.column_mut(column).iter_mut().for_each(|entry| *entry *= unit);
        }
        let finite = there.residual.iter().chain(&there.jacobian).all(|value| value.is_finite());
        finite.then_some(there)
    }

    /// Residuals with derivatives by the offsets of all unknowns (`size` of them) or of none (0).
    fn evaluated(&self, unknowns: &[S], size: usize) -> Linearised<S, PassagesOfOrbit<S>> {
        let (state, depth_variables, parameters) = self.offsets(unknowns);
        let rows = self.first_parameter();
        let mut tangents = Tangents::new(size);
        let place_of = |parameter: usize| {
            let place = self.free.iter().position(|&free| free == parameter);
            place.map_or(size, |place| rows + place)
        };
        let mut point: Vec<Tangent<S>> = tangents.variables(&state);
        let fixed = parameters.iter().enumerate();
        let fixed: Vec<Tangent<S>> =
            fixed.map(|(number, &value)| tangents.variable(place_of(number), value)).collect();
        let mut extra =
            PassagesOfOrbit { states: Vec::new(), free: Vec::new(), arrivals: Vec::new() };
        let depth_unit = S::from_f64(self.depth_unit * self.depth_unit);
        let mut residual = DVector::from_element(rows, S::zero());
        let mut jacobian = DMatrix::from_element(rows, size, S::zero());
        let mut contact = 0;
        for (number, made) in self.itinerary.returns().iter().enumerate() {
            extra.states.push(point.iter().map(|value| value.value).collect());
            point.extend(fixed.iter().cloned());
            let mut passage = 0;
            let variables = tangents;
            point = self.map.image_in(&mut tangents, point, |arrival, depth| {
                let here = passage;
                passage += 1;
                if !made.contains(here) {
                    extra.free.push((number, here, depth.value / depth_unit));
                    return None;
                }
                let (row, y) = (self.dimension + contact, depth_variables[contact]);
                contact += 1;
                residual[row] = (depth.value - y * y) / depth_unit;
                for column in 0..size {
                    let own = if column == row { y + y } else { S::zero() };
                    jacobian[(row, column)] = (depth.tangent[column] - own) / depth_unit;
                }
                let arrival = arrival.iter().map(|value| value.value).collect();
                extra.arrivals.push((number, here, arrival));
                Some(variables.variable(row, y))
            });
        }
        for (row, (end, &start)) in point.iter().zip(&state).enumerate() {
            let unit = S::from_f64(self.units[row]);
            residual[row] = (end.value - start) / unit;
            for column in 0..size {
                let own = if column == row { S::one() } else { S::zero() };
                jacobian[(row, column)] = (end.tangent[column] - own) / unit;
            }
        }
        Linearised { residual, jacobian, extra }
    }

    /// Test function `det(J − s I) Π(−2 y_j)` as a determinant without the root: it vanishes if `s`
    /// is a multiplier, and is smooth through a graze.
    ///
    /// ```text
    /// [A − s I   B]      x⁺ = A dx + B dy
    /// [  C       E],      0 = C dx + E dy,   E triangular with −2 y_j on its diagonal
    /// ```
    pub fn characteristic<X>(
        &self,
        linearised: &Linearised<S, X>,
        multiplier: f64,
    ) -> TestValue<S> {
        TestValue::determinant(&self.shifted(&linearised.jacobian, multiplier))
    }

    /// Whether the orbit repeats after `returns` returns, to a relative tolerance of its offsets.
    pub fn repeats_after(
        &self,
        orbit: &PassagesOfOrbit<S>,
        returns: usize,
        tolerance: f64,
    ) -> bool {
        let count = orbit.states.len();
        let near = |(number, state): (usize, &Vec<S>)| {
            let later = &orbit.states[(number + returns) % count];
            let mut pairs = state.iter().zip(later).zip(&self.units);
            pairs.all(|((&a, &b), unit)| is_same([a, b], *unit, tolerance))
        };
        orbit.states.iter().enumerate().all(near)
    }

    /// Whether the orbit has a shorter period.
    pub fn is_repeated(&self, orbit: &PassagesOfOrbit<S>, tolerance: f64) -> bool {
        let later = (1..self.itinerary.period()).filter(|&by| self.itinerary.repeats_after(by));
        { later }.any(|later| self.repeats_after(orbit, later, tolerance))
    }

    /// Square Jacobian by coordinates and depth variables of the equations with `x⁺ − s x` in place
    /// of `x⁺ − x`: singular if `s` is a multiplier.
    pub fn shifted(&self, jacobian: &DMatrix<S>, multiplier: f64) -> DMatrix<S> {
        let rows = self.first_parameter();
        let mut matrix = jacobian.columns(0, rows).into_owned();
        for place in 0..self.dimension {
            matrix[(place, place)] += S::from_f64(1.0 - multiplier);
        }
        matrix
    }

    /// Test function that vanishes where two multipliers are reciprocal, smooth through a graze; a
    /// zero with complex multipliers is a Neimark–Sacker point. `None` for maps of one coordinate.
    ///
    /// ```text
    /// Π_{i<j} (μ_i μ_j − 1) · (Π 2 y_j/Y)^(d−1)
    /// ```
    pub fn reciprocity<X>(&self, point: &ContinuationPoint<S, X>) -> Option<TestValue<S>> {
        if self.dimension < 2 {
            return None;
        }
        let depths = &point.unknowns[self.dimension..self.first_parameter()];
        let product = depths.iter().fold(S::one(), |product, &y| product * (y + y));
        if self.dimension == 2 {
            // det J Π(−2y) and Π(−2y), without a division.
            let whole = TestValue::determinant(&self.shifted(&point.linearised.jacobian, 0.0));
            let sign = if depths.len().is_multiple_of(2) { S::one() } else { -S::one() };
            let size = whole.size.max(product.magnitude());
            return Some(TestValue { value: whole.value - sign * product, size });
        }
        Some(reciprocal_pairs(self.jacobian(&point.linearised), product))
    }

    /// Jacobian `A − B E⁻¹ C` of the map of the period by the section's coordinates, with the depth
    /// variables eliminated; `None` if a depth variable vanishes.
    pub fn jacobian<X>(&self, linearised: &Linearised<S, X>) -> Option<DMatrix<S>> {
        let (d, rows) = (self.dimension, self.first_parameter());
        let matrix = self.shifted(&linearised.jacobian, 0.0);
        let block = |r, c, nr, nc| matrix.view((r, c), (nr, nc)).into_owned();
        let mut by_state: DMatrix<S> = block(0, 0, d, d);
        if rows > d {
            let followed =
                inverse(&block(d, d, rows - d, rows - d)).ok()? * block(d, 0, rows - d, d);
            by_state -= block(0, d, d, rows - d) * followed;
        }
        for (row, unit) in self.units[..d].iter().enumerate() {
            for (column, other) in self.units[..d].iter().enumerate() {
                by_state[(row, column)] *= S::from_f64(*unit) / S::from_f64(*other);
            }
        }
        by_state.iter().all(|entry| entry.is_finite()).then_some(by_state)
    }
}

/// Test functions in one free parameter: the turn of the parameter (a fold), `det(J + I)` (a flip),
/// depth variables and depths of passages without contact (grazes), the determinant with the
/// tangent (a branch point), the difference of both halves of a period, and reciprocal multipliers.
/// Point of a branch of orbits of the map.
type OrbitPoint<S> = ContinuationPoint<S, PassagesOfOrbit<S>>;

impl<S: Real> MapOrbitEquations<'_, S> {
    /// Test function of an index at a point of a branch.
    pub fn test(&self, point: &OrbitPoint<S>, index: usize) -> TestKind {
        let contacts = self.first_parameter() - self.dimension;
        TestKind::of(index, [contacts, point.linearised.extra.free.len()])
    }
}

impl<S: Real> CurveEquations<S> for MapOrbitEquations<'_, S> {
    type Extra = PassagesOfOrbit<S>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>> {
        self.counted()?;
        self.at(unknowns)
    }

    fn residual(&mut self, unknowns: &[S]) -> Option<DVector<S>> {
        self.counted()?;
        Some(self.evaluated(unknowns, 0).residual)
    }

    fn tests(&self, point: &ContinuationPoint<S, Self::Extra>) -> Vec<TestValue<S>> {
        let mut tests = vec![
            TestValue::turn(point, self.first_parameter()),
            self.characteristic(&point.linearised, -1.0),
        ];
        let depths = &point.unknowns[self.dimension..self.first_parameter()];
        tests.extend(depths.iter().map(|&y| TestValue { value: y, size: 1.0 }));
        let free = point.linearised.extra.free.iter();
        tests.extend(free.map(|&(_, _, depth)| TestValue { value: depth, size: 1.0 }));
        tests.push(crossing(&point.linearised.jacobian, &point.tangent));
        let half = self.itinerary.contacts() / 2;
        tests.push(halves(depths, half, half > 0 && repeats_after_half(self.itinerary)));
        tests.extend(self.reciprocity(point));
        tests
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        self.ranges[unknown]
    }

    fn is_spent(&self) -> bool {
        self.work >= self.most_work
    }

    /// Whether the orbit has half the period: a branch of doubled orbits ends there, as it would
    /// continue with the same orbits started half a period later.
    fn is_last(&mut self, [_, point]: [&ContinuationPoint<S, Self::Extra>; 2]) -> bool {
        self.is_repeated(&point.linearised.extra, REPEATED)
    }
}

/// Test function along a branch of orbits. Equations give them in the order of this list, one for
/// every contact and every passage without contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestKind {
    /// Component of the tangent along the parameter: it turns at a fold.
    Turn,
    /// `det(J + I)`: zero at a flip.
    Flip,
    /// Depth variable of a contact, with its index among the contacts: zero at a graze.
    Contact(usize),
    /// Depth of a passage without contact, with its index among those: zero at a graze.
    Passage(usize),
    /// Determinant that vanishes where another branch passes through.
    Crossing,
    /// Difference of the two halves of a period.
    Halves,
    /// Determinant that vanishes at reciprocal multipliers.
    Reciprocal,
}

impl TestKind {
    /// Test function of an index, of orbits with so many contacts and passages without contact.
    pub fn of(index: usize, [contacts, passages]: [usize; 2]) -> Self {
        match index {
            0 => return Self::Turn,
            1 => return Self::Flip,
            _ => {}
        }
        match (index - 2).checked_sub(contacts) {
            None => Self::Contact(index - 2),
            Some(place) if place < passages => Self::Passage(place),
            Some(place) => match place - passages {
                0 => Self::Crossing,
                1 => Self::Halves,
                _ => Self::Reciprocal,
            },
        }
    }
}

/// Whether two offsets agree to a share of their size (at most of their unit), or to rounding.
pub(super) fn is_same<S: Real>([a, b]: [S; 2], unit: f64, share: f64) -> bool {
    let size = a.magnitude().max(b.magnitude()).min(unit);
    (a - b).magnitude() <= share * size + ROUNDING * unit
}

/// Whether an itinerary consists of two equal halves.
pub(super) fn repeats_after_half(itinerary: &ContactItinerary) -> bool {
    let half = itinerary.period() / 2;
    itinerary.period() == 2 * half && itinerary.repeats_after(half)
}

/// Test function that vanishes on orbits of half the period: the difference of the first variable
/// and that half a period later. 1 unless the itinerary is `doubled`.
pub(super) fn halves<S: Real>(variables: &[S], half: usize, doubled: bool) -> TestValue<S> {
    let value = if doubled { variables[0] - variables[half] } else { S::one() };
    TestValue { value, size: 1.0 }
}

/// Test function that vanishes where two multipliers are reciprocal, from the Jacobian of the map
/// of the period, which is singular where `product` vanishes. Without a Jacobian its size is 0.
pub(super) fn reciprocal_pairs<S: Real>(jacobian: Option<DMatrix<S>>, product: S) -> TestValue<S> {
    let Some(jacobian) = jacobian else {
        return TestValue { value: S::zero(), size: 0.0 };
    };
    let mut pairs = second_compound(&jacobian);
    for place in 0..pairs.nrows() {
        pairs[(place, place)] -= S::one();
    }
    let test = TestValue::determinant(&pairs);
    let power = (1..jacobian.nrows()).fold(S::one(), |power, _| power * product);
    TestValue { value: test.value * power, size: test.size * power.magnitude() }
}

/// Second compound matrix: all minors of two rows and two columns. Its eigenvalues are the products
/// of pairs of eigenvalues.
fn second_compound<S: Real>(matrix: &DMatrix<S>) -> DMatrix<S> {
    let size = matrix.nrows();
    let pairs: Vec<(usize, usize)> =
        (0..size).flat_map(|i| (i + 1..size).map(move |j| (i, j))).collect();
    DMatrix::from_fn(pairs.len(), pairs.len(), |row, column| {
        let ((i, j), (k, l)) = (pairs[row], pairs[column]);
        matrix[(i, k)] * matrix[(j, l)] - matrix[(i, l)] * matrix[(j, k)]
    })
}
