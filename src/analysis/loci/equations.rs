//! The defining systems of loci: the equations of an itinerary's orbits in two parameters, and one
//! condition more.
//!
//! One idea: a multiplier `s` makes `K(s) = F_z + (1 − s) E` singular, which a bordered linear
//! system tells without a determinant; its null vectors give the condition's gradient from the
//! Jacobian at two neighbouring points. See docs/mathematics/loci.md.

use nalgebra::{DMatrix, DVector};

use crate::analysis::continuation::{CurveEquations, CurvePoint, Linearised, TestValue};
use crate::analysis::periodic::{MapOrbitEquations, PassagesOfOrbit};
use crate::numeric::Real;
use crate::numeric::linear::{factorize, inverse};

/// The equations of an itinerary's orbits with two free parameters, by the map or by direct
/// simulation: `u = (z, p)`, `F(u) = 0`, as many equations as `z` has components.
pub(super) trait OrbitEquations<S: Real> {
    /// What is known of an orbit beside its equations.
    type Extra: Clone;

    /// Residuals and Jacobian by all unknowns.
    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>>;
    /// The unknowns that vanish with a contact's depth, in order.
    fn depth_variables(&self) -> std::ops::Range<usize>;
    /// The first section point's coordinates among the unknowns come first; how many there are.
    fn coordinates(&self) -> usize;
    /// Depths of the passages without contact, in order.
    fn free_depths(extra: &Self::Extra) -> Vec<S>;
    /// The range of an unknown.
    fn range(&self, unknown: usize) -> [f64; 2];
}

impl<S: Real> OrbitEquations<S> for MapOrbitEquations<'_, S> {
    type Extra = PassagesOfOrbit<S>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>> {
        self.at(unknowns)
    }

    fn depth_variables(&self) -> std::ops::Range<usize> {
        self.first_depth_variable()..self.first_parameter()
    }

    fn coordinates(&self) -> usize {
        self.first_depth_variable()
    }

    fn free_depths(extra: &Self::Extra) -> Vec<S> {
        extra.free.iter().map(|&(_, _, depth)| depth).collect()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        CurveEquations::range(self, unknown)
    }
}

/// The condition that makes a curve of the orbits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Condition {
    /// A multiplier is 1 or −1.
    Multiplier(f64),
    /// A pair of multipliers is `exp(±iθ)`; `θ` is one more unknown, the last.
    Pair,
    /// The depth variable of a contact, by its place among them, is 0.
    Graze(usize),
}

/// Orbits of an itinerary with a condition: a curve in two parameters.
#[derive(Debug)]
pub(super) struct LocusEquations<O, S> {
    pub(super) orbits: O,
    pub(super) condition: Condition,
    /// Conditions `ξ_n` that are followed along a graze of orbits without another contact.
    pub(super) conditions: usize,
    /// Right and left border, the null vectors found last.
    borders: Option<[DVector<S>; 2]>,
}

/// Residuals and Jacobian at a point of a locus, with the test functions there.
type Tested<S> = Linearised<S, Vec<TestValue<S>>>;

/// A test function of a locus, whose zeros are points of codimension two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CodimensionTwo {
    /// `ξ_n = 0` where the orbit without contact grazes.
    Xi(usize),
    /// Cusp: two saddle-nodes meet.
    Cusp,
    /// Two multipliers 1.
    R1,
    /// Two multipliers −1.
    R2,
    /// Multipliers `exp(±2πi/3)`.
    R3,
    /// Multipliers `±i`.
    R4,
    /// A saddle-node at a graze.
    FoldGraze,
    /// A flip at a graze.
    FlipGraze,
    /// A Neimark–Sacker point at a graze.
    TorusGraze,
    /// Two grazes.
    DoubleGraze,
}

impl CodimensionTwo {
    /// The label of the field.
    pub fn label(self) -> String {
        match self {
            Self::Xi(n) => return format!("xi_{n}"),
            Self::Cusp => "CP",
            Self::R1 => "R1",
            Self::R2 => "R2",
            Self::R3 => "R3",
            Self::R4 => "R4",
            Self::FoldGraze => "SN-GR",
            Self::FlipGraze => "PD-GR",
            Self::TorusGraze => "NS-GR",
            Self::DoubleGraze => "GR-GR",
        }
        .to_owned()
    }
}

/// The bordered system of a condition: its value, null vectors, and the gradient.
struct Singular<S> {
    value: S,
    gradient: Vec<S>,
    /// `wᵀ F_zz v v`, of unit vectors.
    bend: S,
    /// `wᵀ E v`, of unit vectors: 0 where the multiplier is a double one.
    rate: S,
}

/// Length of the step of a derivative along a null vector: central differences lose a third of the
/// digits.
fn step<S: Real>() -> f64 {
    S::ROUNDOFF.cbrt()
}

impl<S: Real, O: OrbitEquations<S>> LocusEquations<O, S> {
    /// The locus of a condition.
    pub(super) fn new(orbits: O, condition: Condition, conditions: usize) -> Self {
        Self { orbits, condition, conditions, borders: None }
    }

    fn rows(&self) -> usize {
        self.orbits.depth_variables().end
    }

    /// `K(s)` of a real multiplier.
    fn shifted(&self, jacobian: &DMatrix<S>, multiplier: f64) -> DMatrix<S> {
        let mut matrix = jacobian.columns(0, self.rows()).into_owned();
        for place in 0..self.orbits.coordinates() {
            matrix[(place, place)] += S::from_f64(1.0 - multiplier);
        }
        matrix
    }

    /// The derivative of the Jacobian along a direction of the orbit's unknowns.
    fn bent(&mut self, unknowns: &[S], direction: &DVector<S>) -> Option<DMatrix<S>> {
        let step = S::from_f64(step::<S>());
        let mut side = |sign: f64| {
            let mut moved = unknowns.to_vec();
            for (value, &along) in moved.iter_mut().zip(direction.iter()) {
                *value += S::from_f64(sign) * step * along;
            }
            Some(self.orbits.linearised(&moved)?.jacobian)
        };
        let (up, down) = (side(1.0)?, side(-1.0)?);
        Some((up - down) / (step + step))
    }

    /// The condition of a real multiplier.
    fn singular(
        &mut self,
        unknowns: &[S],
        jacobian: &DMatrix<S>,
        multiplier: f64,
    ) -> Option<Singular<S>> {
        let rows = self.rows();
        let matrix = self.shifted(jacobian, multiplier);
        let [right, left] = match self.borders.take().filter(|[right, _]| right.len() == rows) {
            Some(borders) => borders,
            None => null_vectors(&matrix)?,
        };
        let (value, v) = bordered(&matrix, &left, &right)?;
        let (_, w) = bordered(&matrix.transpose(), &right, &left)?;
        let bent = self.bent(unknowns, &v)?;
        let gradient = w.transpose() * &bent;
        let (long, high) = (length(&v), length(&w));
        let bend = gradient.columns(0, rows).transpose().dot(&v) / (long * long * high);
        let coordinates = 0..self.orbits.coordinates();
        let rate = coordinates.map(|place| w[place] * v[place]).sum::<S>() / (long * high);
        self.borders = Some([&v / long, &w / high]);
        Some(Singular {
            value,
            gradient: gradient.iter().map(|&value| -value).collect(),
            bend,
            rate,
        })
    }

    fn real(&mut self, unknowns: &[S], multiplier: f64) -> Option<Tested<S>> {
        let orbit = self.orbits.linearised(unknowns)?;
        let found = self.singular(unknowns, &orbit.jacobian, multiplier)?;
        let mut tests = Vec::new();
        if multiplier > 0.0 {
            tests.push(TestValue { value: found.bend, size: 1.0 });
        }
        tests.push(TestValue { value: found.rate, size: 1.0 });
        tests.extend(self.grazes(unknowns, &orbit));
        Some(with_condition(orbit, found.value, &found.gradient, tests))
    }

    /// Depth variables and the depths of passages without contact.
    fn grazes(&self, unknowns: &[S], orbit: &Linearised<S, O::Extra>) -> Vec<TestValue<S>> {
        let depths = self.orbits.depth_variables().map(|place| unknowns[place]);
        let depths = depths.chain(O::free_depths(&orbit.extra));
        depths.map(|value| TestValue { value, size: 1.0 }).collect()
    }

    fn graze(&mut self, unknowns: &[S], contact: usize) -> Option<Tested<S>> {
        let orbit = self.orbits.linearised(unknowns)?;
        let place = self.orbits.depth_variables().start + contact;
        let mut gradient = vec![S::zero(); unknowns.len()];
        gradient[place] = S::one();
        let mut tests = Vec::new();
        match self.conditions {
            0 => {
                for multiplier in [1.0, -1.0] {
                    let matrix = self.shifted(&orbit.jacobian, multiplier);
                    tests.push(TestValue::determinant(&matrix));
                    let without = matrix.remove_row(place).remove_column(place);
                    tests.push(TestValue::determinant(&without));
                }
            }
            count => tests.extend(self.xi(&orbit.jacobian, count)),
        }
        let others = self.grazes(unknowns, &orbit).into_iter().enumerate();
        tests.extend(others.filter(|(other, _)| *other != contact).map(|(_, test)| test));
        Some(with_condition(orbit, unknowns[place], &gradient, tests))
    }

    /// `ξ_n ∝ ∇d · Mⁿ⁻¹ (M c)` for `n = 1 …`, over the sizes of its factors.
    fn xi(&self, jacobian: &DMatrix<S>, count: usize) -> Vec<TestValue<S>> {
        let (d, place) = (self.orbits.coordinates(), self.orbits.depth_variables().start);
        let matrix = self.shifted(jacobian, 0.0);
        let period = matrix.view((0, 0), (d, d)).into_owned();
        let mut kicked: DVector<S> = matrix.view((0, place), (d, 1)).column(0).into_owned();
        let depth: DVector<S> = matrix.view((place, 0), (1, d)).row(0).transpose();
        let mut tests = Vec::new();
        for _ in 0..count {
            let size = length(&kicked) * length(&depth);
            tests.push(TestValue { value: depth.dot(&kicked) / size, size: 1.0 });
            kicked = &period * kicked;
        }
        tests
    }

    fn pair(&mut self, unknowns: &[S]) -> Option<Tested<S>> {
        let (rows, last) = (self.rows(), unknowns.len() - 1);
        let orbit = self.orbits.linearised(&unknowns[..last])?;
        let (sin, cos) = unknowns[last].sin_cos();
        let d = self.orbits.coordinates();
        let real = self.shifted(&orbit.jacobian, 1.0);
        // The complex matrix a + ib as a real one, [a −b; b a].
        let mut matrix = DMatrix::from_element(2 * rows, 2 * rows, S::zero());
        for part in 0..2 {
            matrix.view_mut((part * rows, part * rows), (rows, rows)).copy_from(&real);
            for place in 0..d {
                matrix[(part * rows + place, part * rows + place)] += S::one() - cos;
            }
        }
        for place in 0..d {
            matrix[(place, rows + place)] += sin;
            matrix[(rows + place, place)] -= sin;
        }
        let [right, left] = match self.borders.take().filter(|[right, _]| right.len() == 2 * rows) {
            Some(borders) => borders,
            None => null_vectors(&matrix)?,
        };
        let (value, v) = bordered_complex(&matrix, &left, &right)?;
        let (_, w) = bordered_complex(&matrix.transpose(), &right, &left)?;
        let halves = |vector: &DVector<S>| {
            [vector.rows(0, rows).into_owned(), vector.rows(rows, rows).into_owned()]
        };
        let ([vr, vi], [wr, wi]) = (halves(&v), halves(&w));
        let (by_vr, by_vi) =
            (self.bent(&unknowns[..last], &vr)?, self.bent(&unknowns[..last], &vi)?);
        // dg = −w* dK v, with w* the conjugate transpose.
        let product = |a: &DVector<S>, matrix: &DMatrix<S>| a.transpose() * matrix;
        let along_real = product(&wr, &by_vr) + product(&wi, &by_vi);
        let along_imaginary = product(&wr, &by_vi) - product(&wi, &by_vr);
        let mut gradients =
            [along_real, along_imaginary].map(|row| row.iter().map(|&a| -a).collect::<Vec<S>>());
        // dK/dθ = −i exp(iθ) E.
        let (mut by_angle_real, mut by_angle_imaginary) = (S::zero(), S::zero());
        for place in 0..d {
            let turned = [sin * vr[place] + cos * vi[place], sin * vi[place] - cos * vr[place]];
            by_angle_real -= wr[place] * turned[0] + wi[place] * turned[1];
            by_angle_imaginary -= wr[place] * turned[1] - wi[place] * turned[0];
        }
        gradients[0].push(by_angle_real);
        gradients[1].push(by_angle_imaginary);
        let (long, high) = (length(&v), length(&w));
        self.borders = Some([v / long, w / high]);
        let mut tests = vec![
            TestValue { value: cos + S::from_f64(0.5), size: 1.0 },
            TestValue { value: cos, size: 1.0 },
        ];
        tests.extend(self.grazes(unknowns, &orbit));
        let columns = unknowns.len();
        let mut jacobian = orbit.jacobian.resize(rows + 2, columns, S::zero());
        let mut residual = orbit.residual.resize_vertically(rows + 2, S::zero());
        for (row, gradient) in gradients.iter().enumerate() {
            residual[rows + row] = value[row];
            for (column, &entry) in gradient.iter().enumerate() {
                jacobian[(rows + row, column)] = entry;
            }
        }
        Some(Linearised { residual, jacobian, extra: tests })
    }

    /// What the zeros of the test functions are, in their order.
    pub(super) fn kinds(&self, free_passages: usize) -> Vec<CodimensionTwo> {
        use CodimensionTwo as Kind;
        let contacts = self.orbits.depth_variables().len() + free_passages;
        let repeated = |kind: Kind, count: usize| std::iter::repeat_n(kind, count);
        match self.condition {
            Condition::Multiplier(s) if s > 0.0 => {
                let own = [Kind::Cusp, Kind::R1].into_iter();
                own.chain(repeated(Kind::FoldGraze, contacts)).collect()
            }
            Condition::Multiplier(_) => {
                std::iter::once(Kind::R2).chain(repeated(Kind::FlipGraze, contacts)).collect()
            }
            Condition::Pair => {
                let own = [Kind::R3, Kind::R4].into_iter();
                own.chain(repeated(Kind::TorusGraze, contacts)).collect()
            }
            Condition::Graze(_) => {
                let own: Vec<Kind> = match self.conditions {
                    0 => vec![Kind::FoldGraze, Kind::FoldGraze, Kind::FlipGraze, Kind::FlipGraze],
                    count => (1..=count).map(Kind::Xi).collect(),
                };
                own.into_iter().chain(repeated(Kind::DoubleGraze, contacts - 1)).collect()
            }
        }
    }
}

impl<S: Real, O: OrbitEquations<S>> CurveEquations<S> for LocusEquations<O, S> {
    type Extra = Vec<TestValue<S>>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>> {
        match self.condition {
            Condition::Multiplier(multiplier) => self.real(unknowns, multiplier),
            Condition::Pair => self.pair(unknowns),
            Condition::Graze(contact) => self.graze(unknowns, contact),
        }
    }

    fn tests(&self, point: &CurvePoint<S, Self::Extra>) -> Vec<TestValue<S>> {
        point.linearised.extra.clone()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        if self.condition == Condition::Pair && unknown == self.rows() + 2 {
            return [ANGLE, std::f64::consts::PI - ANGLE];
        }
        match self.condition {
            // Held at 0, which may be the end of its range.
            Condition::Graze(contact)
                if unknown == self.orbits.depth_variables().start + contact =>
            {
                [-1.0, 1.0]
            }
            _ => self.orbits.range(unknown),
        }
    }
}

/// How near to 0 and π the angle of a pair is followed: at them the pair is a double multiplier.
const ANGLE: f64 = 1e-3;

/// The orbit's equations with one more.
fn with_condition<S: Real, X: Clone>(
    orbit: Linearised<S, X>,
    value: S,
    gradient: &[S],
    tests: Vec<TestValue<S>>,
) -> Tested<S> {
    let rows = orbit.residual.len();
    let mut jacobian = orbit.jacobian.insert_row(rows, S::zero());
    let residual = orbit.residual.insert_row(rows, value);
    for (column, &entry) in gradient.iter().enumerate() {
        jacobian[(rows, column)] = entry;
    }
    Linearised { residual, jacobian, extra: tests }
}

/// Solves `[K b; cᵀ 0] (v; g) = (0; 1)`: `g` vanishes where `K` is singular, and `v` is then its
/// null vector.
fn bordered<S: Real>(
    matrix: &DMatrix<S>,
    column: &DVector<S>,
    row: &DVector<S>,
) -> Option<(S, DVector<S>)> {
    let size = matrix.nrows();
    let mut whole = matrix.clone().resize(size + 1, size + 1, S::zero());
    for place in 0..size {
        whole[(place, size)] = column[place];
        whole[(size, place)] = row[place];
    }
    let mut right = DVector::from_element(size + 1, S::zero());
    right[size] = S::one();
    let found = factorize(&whole).ok()?.solve(&right).ok()?;
    let finite = found.iter().all(|value| value.is_finite());
    finite.then(|| (found[size], found.rows(0, size).into_owned()))
}

/// The same of a complex matrix written as a real one; `g` has two parts.
fn bordered_complex<S: Real>(
    matrix: &DMatrix<S>,
    column: &DVector<S>,
    row: &DVector<S>,
) -> Option<([S; 2], DVector<S>)> {
    let size = matrix.nrows();
    let half = size / 2;
    let mut whole = matrix.clone().resize(size + 2, size + 2, S::zero());
    for place in 0..half {
        let (column_real, column_imaginary) = (column[place], column[half + place]);
        let (row_real, row_imaginary) = (row[place], row[half + place]);
        whole[(place, size)] = column_real;
        whole[(half + place, size)] = column_imaginary;
        whole[(place, size + 1)] = -column_imaginary;
        whole[(half + place, size + 1)] = column_real;
        // The row is the conjugate transpose of a null vector.
        whole[(size, place)] = row_real;
        whole[(size, half + place)] = row_imaginary;
        whole[(size + 1, place)] = -row_imaginary;
        whole[(size + 1, half + place)] = row_real;
    }
    let mut right = DVector::from_element(size + 2, S::zero());
    right[size] = S::one();
    let found = factorize(&whole).ok()?.solve(&right).ok()?;
    let finite = found.iter().all(|value| value.is_finite());
    finite.then(|| ([found[size], found[size + 1]], found.rows(0, size).into_owned()))
}

/// Right and left vectors of nearly the smallest singular value, by inverse iteration.
pub(super) fn null_vectors<S: Real>(matrix: &DMatrix<S>) -> Option<[DVector<S>; 2]> {
    let size = matrix.nrows();
    // A shift of rounding keeps a matrix that is singular within its digits invertible. Entries are
    // of order one where they do not all vanish.
    let largest = matrix.iter().fold(1.0, |most: f64, entry| most.max(entry.magnitude()));
    let shift = DMatrix::identity(size, size) * S::from_f64(largest * S::ROUNDOFF.sqrt());
    let iterated = |matrix: &DMatrix<S>| {
        let inverse = inverse(matrix).or_else(|_| inverse(&(matrix + &shift))).ok()?;
        let normal = &inverse * inverse.transpose();
        let mut vector = DVector::from_fn(size, |place, _| S::from_f64(1.0 / (1.5 + place as f64)));
        for _ in 0..ITERATIONS {
            vector = &normal * vector;
            vector = &vector / length(&vector);
        }
        Some(vector)
    };
    Some([iterated(matrix)?, iterated(&matrix.transpose())?])
}

fn length<S: Real>(vector: &DVector<S>) -> S {
    vector.dot(vector).sqrt()
}

/// Steps of inverse iteration: borders need not be exact.
const ITERATIONS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::continuation::{StepControl, Turn, follow};

    /// A map of one or two coordinates in two parameters, without contacts: its image and the
    /// derivatives by coordinates and parameters, in rows.
    type Plain = fn(&[f64]) -> (Vec<f64>, Vec<Vec<f64>>);

    struct Smooth {
        coordinates: usize,
        map: Plain,
    }

    impl OrbitEquations<f64> for Smooth {
        type Extra = ();

        fn linearised(&mut self, unknowns: &[f64]) -> Option<Linearised<f64>> {
            let (image, rows) = (self.map)(unknowns);
            let d = self.coordinates;
            let mut jacobian = DMatrix::from_fn(d, d + 2, |row, column| rows[row][column]);
            for place in 0..d {
                jacobian[(place, place)] -= 1.0;
            }
            let residual = image.iter().zip(unknowns).map(|(end, start)| end - start);
            let residual = DVector::from_iterator(d, residual);
            Some(Linearised { residual, jacobian, extra: () })
        }

        fn depth_variables(&self) -> std::ops::Range<usize> {
            self.coordinates..self.coordinates
        }

        fn coordinates(&self) -> usize {
            self.coordinates
        }

        fn free_depths(_: &()) -> Vec<f64> {
            Vec::new()
        }

        fn range(&self, _: usize) -> [f64; 2] {
            [-3.0, 3.0]
        }
    }

    /// `(x, y) ↦ (y, a y − b x + x y)`: at the origin multipliers have the sum `a` and the product
    /// `b`.
    fn delayed(u: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let [x, y, a, b] = [u[0], u[1], u[2], u[3]];
        let slopes = vec![vec![0.0, 1.0, 0.0, 0.0], vec![y - b, a + x, y, -x]];
        (vec![y, a * y - b * x + x * y], slopes)
    }

    /// The zeros of the test functions along a locus, by kind, with their parameters.
    fn special(
        map: Plain,
        condition: Condition,
        start: &[f64],
        along: &[f64],
    ) -> Vec<(CodimensionTwo, [f64; 2])> {
        let coordinates = start.len() - 2 - usize::from(condition == Condition::Pair);
        let mut equations = LocusEquations::new(Smooth { coordinates, map }, condition, 0);
        let kinds = equations.kinds(0);
        let course = follow(&mut equations, start, along, &StepControl::DEFAULT);
        let course = course.expect("a locus");
        let of = |turn: &Turn| {
            let at = &course.points[turn.point].unknowns;
            (kinds[turn.test], [at[coordinates], at[coordinates + 1]])
        };
        course.turns.iter().map(of).collect()
    }

    fn assert_at(found: &[(CodimensionTwo, [f64; 2])], kind: CodimensionTwo, at: [f64; 2]) {
        let near = |found: &[f64; 2]| {
            found.iter().zip(&at).all(|(found, exact)| (found - exact).abs() < 1e-9)
        };
        let there = found.iter().any(|(other, found)| *other == kind && near(found));
        assert!(there, "{kind:?} at {at:?}: {found:?}");
    }

    #[test]
    fn a_pair_on_the_circle_has_its_resonances_where_their_sums_are() {
        let start = [0.0, 0.0, 2.0 * 1.0_f64.cos(), 1.0, 1.0];
        let found = special(delayed, Condition::Pair, &start, &[0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_at(&found, CodimensionTwo::R4, [0.0, 1.0]);
        assert_at(&found, CodimensionTwo::R3, [-1.0, 1.0]);
    }

    #[test]
    fn a_flip_has_a_second_one_where_sum_and_product_say() {
        let start = [0.0, 0.0, -1.5, 0.5];
        let along = [0.0, 0.0, -1.0, 1.0];
        let found = special(delayed, Condition::Multiplier(-1.0), &start, &along);
        assert_at(&found, CodimensionTwo::R2, [-2.0, 1.0]);
    }

    #[test]
    fn two_folds_meet_in_the_cusp_of_a_cubic() {
        // x ↦ x + p + q x − x³: folds at q = 3x², p = −2x³.
        let cubic: Plain = |u| {
            let [x, p, q] = [u[0], u[1], u[2]];
            (vec![x + p + q * x - x * x * x], vec![vec![1.0 + q - 3.0 * x * x, 1.0, x]])
        };
        let start = [0.5, -0.25, 0.75];
        let found = special(cubic, Condition::Multiplier(1.0), &start, &[-1.0, 0.0, 0.0]);
        assert_at(&found, CodimensionTwo::Cusp, [0.0, 0.0]);
    }

    #[test]
    fn a_fold_has_a_second_multiplier_one_at_a_bogdanov_point() {
        // y⁺ = y + p + q y + x² + x y, x⁺ = x + y⁺: folds at x = y = p = 0, multipliers 1, 1 + q.
        let bogdanov: Plain = |u| {
            let [x, y, p, q] = [u[0], u[1], u[2], u[3]];
            let next = y + p + q * y + x * x + x * y;
            let by = [2.0 * x + y, 1.0 + q + x, 1.0, y];
            let first = vec![1.0 + by[0], by[1], by[2], by[3]];
            (vec![x + next, next], vec![first, by.to_vec()])
        };
        let start = [0.0, 0.0, 0.0, -0.5];
        let found = special(bogdanov, Condition::Multiplier(1.0), &start, &[0.0, 0.0, 0.0, 1.0]);
        assert_at(&found, CodimensionTwo::R1, [0.0, 0.0]);
    }
}
