//! The orbits of an itinerary of a map as equations to be continued.
//!
//! One idea: with the depth variable `y` of each contact among the unknowns, a map is a polynomial
//! with exact derivatives, and a branch of orbits passes its graze `y = 0` as any other point. See
//! docs/mathematics/dynamics.md.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::contact_itinerary::ContactItinerary;
use super::orbit::{finite_or_one, window_scales};
use crate::analysis::continuation::{CurveEquations, CurvePoint, Linearised, TestValue, bordered};
use crate::analysis::evaluation::MapEvaluation;
use crate::expansion::MapWindow;
use crate::iteration::{Tangent, Tangents};
use crate::numeric::Real;
use crate::numeric::linear::inverse;

/// The orbits of an itinerary, in one or two parameters:
///
/// ```text
/// u = (x/X, y/Y, p/P):   (P_n(… P_1(x; y, p) …) − x)/X = 0,   (depth_j − y_j²)/Y² = 0
/// ```
///
/// with `x` the first section point, `y` the depth variables of the contacts, in order, `p` the
/// free parameters, and the half-widths of the window as units. `d + m` equations for `d`
/// coordinates and `m` contacts.
#[derive(Clone, Debug)]
pub struct MapOrbitEquations<'a, S: Real> {
    map: &'a MapEvaluation<S>,
    itinerary: &'a ContactItinerary,
    dimension: usize,
    /// Active parameters that are unknowns.
    free: Vec<usize>,
    /// All active parameters; the free ones are not used.
    at: Vec<S>,
    /// `Y`.
    depth_unit: f64,
    units: Vec<f64>,
    ranges: Vec<[f64; 2]>,
    /// Work done and most of it, in coefficients evaluated.
    work: u64,
    most_work: u64,
}

/// What is known of an orbit beside its equations.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PassagesOfOrbit<S> {
    /// The section points of the period, as offsets.
    pub states: Vec<Vec<S>>,
    /// Depth over `Y²` of each passage without contact, in order: return, passage, value.
    pub free: Vec<(usize, usize, S)>,
    /// Return, passage and the point (coordinates; parameters) that each contact is reached with.
    pub arrivals: Vec<(usize, usize, Vec<S>)>,
}

/// Offsets this near are one, in the unit of the coordinate.
const ROUNDING: f64 = 1e-13;
/// Points of an orbit that agree to this share of their offsets are one.
const REPEATED: f64 = 1e-5;

impl<'a, S: Real> MapOrbitEquations<'a, S> {
    /// The equations of an itinerary with the parameters `free` among the unknowns and the others
    /// at the offsets `at`.
    ///
    /// Coordinates and depth variables are followed up to `reach` of their units, parameters as far
    /// as [`with_range`](Self::with_range) says, and without bound until then.
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

    /// The same with a free parameter (its place among the free ones) within a range of offsets.
    #[must_use]
    pub fn with_range(mut self, place: usize, range: [f64; 2]) -> Self {
        let unknown = self.first_parameter() + place;
        self.ranges[unknown] = range.map(|value| value / self.units[unknown]);
        self
    }

    /// The same with a free parameter's range, and lengths that suit it: parameters vary with the
    /// square of depth variables, so that these and the coordinates have units smaller by the root.
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

    /// The same with depth variables that are not followed below zero: of contacts that are flown.
    #[must_use]
    pub fn with_positive_depths(mut self) -> Self {
        for unknown in self.dimension..self.first_parameter() {
            self.ranges[unknown][0] = 0.0;
        }
        self
    }

    /// The same with a limit of its work: nothing is evaluated any more where so much has been
    /// done.
    #[must_use]
    pub fn within_work(mut self, most: u64) -> Self {
        self.most_work = most;
        self
    }

    /// Work done so far, in coefficients evaluated.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Counts an evaluation; `None` where no more work may be done.
    fn counted(&mut self) -> Option<()> {
        let is_spent = <Self as CurveEquations<S>>::is_spent(self);
        self.work += self.map.terms() * self.itinerary.period() as u64;
        (!is_spent).then_some(())
    }

    /// The first depth variable among the unknowns.
    pub fn first_depth_variable(&self) -> usize {
        self.dimension
    }

    /// The first free parameter among the unknowns.
    pub fn first_parameter(&self) -> usize {
        self.dimension + self.itinerary.contacts()
    }

    /// The itinerary.
    pub fn itinerary(&self) -> &ContactItinerary {
        self.itinerary
    }

    /// The unit of each unknown.
    pub fn units(&self) -> &[f64] {
        &self.units
    }

    /// Unknowns of a first point, depth variables and all active parameters, in offsets.
    pub fn unknowns(&self, state: &[S], depth_variables: &[S], parameters: &[S]) -> Vec<S> {
        let free = self.free.iter().map(|&place| parameters[place]);
        let values = state.iter().chain(depth_variables).copied().chain(free);
        values.zip(&self.units).map(|(value, &unit)| value / S::from_f64(unit)).collect()
    }

    /// The first point, the depth variables and all active parameters, in offsets.
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

    /// Residuals and Jacobian by all unknowns: `d + m` rows.
    pub fn at(&self, unknowns: &[S]) -> Option<Linearised<S, PassagesOfOrbit<S>>> {
        let mut there = self.evaluated(unknowns, unknowns.len());
        for (column, &unit) in self.units.iter().enumerate() {
            let unit = S::from_f64(unit);
            there.jacobian.column_mut(column).iter_mut().for_each(|entry| *entry *= unit);
        }
        let finite = there.residual.iter().chain(&there.jacobian).all(|value| value.is_finite());
        finite.then_some(there)
    }

    /// Residuals with derivatives by the offsets of all unknowns or of none: in `size` directions.
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

    /// `det(J − s I) Π(−2 y_j)`, as a determinant without the root: it vanishes where `s` is a
    /// multiplier, and is smooth through the graze.
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

    /// Whether the orbit goes through the same points after so many returns, to this share of
    /// their offsets.
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

    /// Whether the orbit is one of a shorter period.
    pub fn is_repeated(&self, orbit: &PassagesOfOrbit<S>, tolerance: f64) -> bool {
        let later = (1..self.itinerary.period()).filter(|&by| self.itinerary.repeats_after(by));
        { later }.any(|later| self.repeats_after(orbit, later, tolerance))
    }

    /// The square Jacobian by coordinates and depth variables with `x⁺ − s x` for `x⁺ − x`: it is
    /// singular where `s` is a multiplier.
    pub fn shifted(&self, jacobian: &DMatrix<S>, multiplier: f64) -> DMatrix<S> {
        let rows = self.first_parameter();
        let mut matrix = jacobian.columns(0, rows).into_owned();
        for place in 0..self.dimension {
            matrix[(place, place)] += S::from_f64(1.0 - multiplier);
        }
        matrix
    }

    /// A function that vanishes where two multipliers are each other's reciprocal, smooth through
    /// the graze: a Neimark–Sacker point where they are complex. `None` of maps of one coordinate.
    ///
    /// ```text
    /// Π_{i<j} (μ_i μ_j − 1) · (Π 2 y_j/Y)^(d−1)
    /// ```
    pub fn reciprocity<X>(&self, point: &CurvePoint<S, X>) -> Option<TestValue<S>> {
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

    /// The Jacobian of the period's map by the section's coordinates, the depth variables
    /// following them: `A − B E⁻¹ C`; `None` where a depth variable vanishes.
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

/// In one free parameter: the turn of the parameter (a fold), `det(J + I)` (a flip), each depth
/// variable and each depth of a passage without contact (grazes), the determinant with the tangent
/// (a branch point), and reciprocal multipliers.
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

    fn tests(&self, point: &CurvePoint<S, Self::Extra>) -> Vec<TestValue<S>> {
        let mut tests = vec![
            TestValue::turn(point, self.first_parameter()),
            self.characteristic(&point.linearised, -1.0),
        ];
        let depths = &point.unknowns[self.dimension..self.first_parameter()];
        tests.extend(depths.iter().map(|&y| TestValue { value: y, size: 1.0 }));
        let free = point.linearised.extra.free.iter();
        tests.extend(free.map(|&(_, _, depth)| TestValue { value: depth, size: 1.0 }));
        tests.push(bordered(&point.linearised.jacobian, &point.tangent));
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

    /// A branch of doubled orbits ends on that of the orbits that double, and would go on as the
    /// same orbits begun later.
    fn is_last(&self, point: &CurvePoint<S, Self::Extra>) -> bool {
        self.is_repeated(&point.linearised.extra, REPEATED)
    }
}

/// Whether two offsets agree to a share of themselves and of their unit, or to rounding in it.
pub(super) fn is_same<S: Real>([a, b]: [S; 2], unit: f64, share: f64) -> bool {
    let size = a.magnitude().max(b.magnitude()).min(unit);
    (a - b).magnitude() <= share * size + ROUNDING * unit
}

/// Whether an itinerary repeats after half a period.
pub(super) fn repeats_after_half(itinerary: &ContactItinerary) -> bool {
    let half = itinerary.period() / 2;
    itinerary.period() == 2 * half && itinerary.repeats_after(half)
}

/// The difference of the first of some variables and that half a period later: it vanishes on the
/// orbits of half the period. 1 of orbits that are not `doubled` ones.
pub(super) fn halves<S: Real>(variables: &[S], half: usize, doubled: bool) -> TestValue<S> {
    let value = if doubled { variables[0] - variables[half] } else { S::one() };
    TestValue { value, size: 1.0 }
}

/// A function that vanishes where two multipliers are each other's reciprocal, by the Jacobian of
/// the period's map, which is singular where `product` vanishes; without a Jacobian nothing is
/// told.
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

/// The matrix of all minors of two rows and two columns: its eigenvalues are the products of two
/// of the matrix's.
fn second_compound<S: Real>(matrix: &DMatrix<S>) -> DMatrix<S> {
    let size = matrix.nrows();
    let pairs: Vec<(usize, usize)> =
        (0..size).flat_map(|i| (i + 1..size).map(move |j| (i, j))).collect();
    DMatrix::from_fn(pairs.len(), pairs.len(), |row, column| {
        let ((i, j), (k, l)) = (pairs[row], pairs[column]);
        matrix[(i, k)] * matrix[(j, l)] - matrix[(i, l)] * matrix[(j, k)]
    })
}
