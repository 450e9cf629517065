//! Defining systems of loci: the equations of an itinerary's orbits in two parameters, with one
//! additional condition.
//!
//! One idea: a multiplier `s` makes `K(s) = F_z + (1 − s) E` singular, with `E` the derivative of
//! the section point on which the period closes. A bordered linear system detects that without a
//! determinant; its null vectors give the gradient of the condition from derivatives at two
//! neighbouring points. See docs/mathematics/loci.md.

use nalgebra::{DMatrix, DVector};

use crate::analysis::periodic::MapOrbitEquations;
use crate::continuation::{ContinuationPoint, CurveEquations, Linearised, TestValue, unit_vector};
use crate::numeric::Real;
use crate::numeric::linear::{factorize, inverse};

/// Equations of an itinerary's orbits with two free parameters, by the map or by direct simulation:
/// `u = (z, p)`, `F(u) = 0`, as many equations as `z` has components.
pub(super) trait OrbitEquations<S: Real>: CurveEquations<S> {
    /// Derivatives of the first section point by all unknowns, in the rows that close the period.
    fn first_point(&self, there: &Linearised<S, Self::Extra>) -> DMatrix<S>;
    /// Whether the orbits are closed; others have no multipliers.
    fn closes(&self) -> bool {
        true
    }
    /// Number of unknowns, both parameters included.
    fn count(&self) -> usize;
    /// Indices of the unknowns that vanish where a contact begins, in the order of the contacts.
    fn depth_variables(&self) -> Vec<usize>;
    /// Functions that change sign at a graze, each with its contact if it has one: depth variables,
    /// and depths of passages without contact. Empty if a graze is the border of the range.
    fn grazes(&self, unknowns: &[S], extra: &Self::Extra) -> Vec<(Option<usize>, S)>;
    /// `F_z` and `E` of the orbit without a contact, at the graze of that contact.
    fn without(
        &mut self,
        unknowns: &[S],
        there: &Linearised<S, Self::Extra>,
        contact: usize,
    ) -> Option<[DMatrix<S>; 2]>;
    /// Factors of `ξ_n` at a graze of the orbit without contact.
    fn unfolding(
        &mut self,
        unknowns: &[S],
        there: &Linearised<S, Self::Extra>,
    ) -> Option<Unfolding<S>>;
    /// Rounding of the Jacobian relative to that of the number type.
    fn rounding() -> f64;
}

/// Factors of `ξ_n ∝ ∇d · Mⁿ⁻¹ (M c)`.
pub(super) struct Unfolding<S> {
    /// Monodromy matrix `M`.
    pub(super) period: DMatrix<S>,
    /// Derivative `M c` of the image by the depth variable.
    pub(super) kick: DVector<S>,
    /// Gradient `∇d` of the depth.
    pub(super) depth: DVector<S>,
}

impl<S: Real> Unfolding<S> {
    /// Conditions `ξ_n` for `n = 1 …`, relative to the sizes of their factors. They are 1 if a
    /// contact begins without a kick, as at a compliant stop: orbits then unfold with the depth
    /// everywhere alike.
    fn conditions(&self, count: usize, rounding: f64) -> Vec<TestValue<S>> {
        let mut kicked = self.kick.clone();
        let is_smooth = length(&kicked).magnitude() <= (rounding * S::ROUNDOFF).sqrt();
        let conditions = (0..count).map(|_| {
            if is_smooth {
                return TestValue { value: S::one(), size: rounding };
            }
            let value = self.depth.dot(&kicked) / (length(&kicked) * length(&self.depth));
            kicked = &self.period * &kicked;
            TestValue { value, size: rounding }
        });
        conditions.collect()
    }
}

impl<S: Real> OrbitEquations<S> for MapOrbitEquations<'_, S> {
    fn first_point(&self, there: &Linearised<S, Self::Extra>) -> DMatrix<S> {
        let (rows, columns) = there.jacobian.shape();
        let d = self.first_depth_variable();
        DMatrix::from_fn(
            rows,
            columns,
            |row, column| {
                if row == column && row < d { S::one() } else { S::zero() }
            },
        )
    }

    fn count(&self) -> usize {
        self.units().len()
    }

    fn depth_variables(&self) -> Vec<usize> {
        (self.first_depth_variable()..self.first_parameter()).collect()
    }

    fn grazes(&self, unknowns: &[S], extra: &Self::Extra) -> Vec<(Option<usize>, S)> {
        let depths = self.depth_variables().into_iter().enumerate();
        let depths = depths.map(|(contact, place)| (Some(contact), unknowns[place]));
        depths.chain(extra.free.iter().map(|&(_, _, depth)| (None, depth))).collect()
    }

    fn without(
        &mut self,
        _: &[S],
        there: &Linearised<S, Self::Extra>,
        contact: usize,
    ) -> Option<[DMatrix<S>; 2]> {
        let place = self.first_depth_variable() + contact;
        let both = [there.jacobian.clone(), self.first_point(there)];
        Some(both.map(|matrix| matrix.remove_row(place).remove_column(place)))
    }

    fn unfolding(&mut self, _: &[S], there: &Linearised<S, Self::Extra>) -> Option<Unfolding<S>> {
        let d = self.first_depth_variable();
        let matrix = &there.jacobian + self.first_point(there);
        Some(Unfolding {
            period: matrix.view((0, 0), (d, d)).into_owned(),
            kick: matrix.view((0, d), (d, 1)).column(0).into_owned(),
            depth: matrix.view((d, 0), (1, d)).row(0).transpose(),
        })
    }

    fn rounding() -> f64 {
        1.0
    }
}

/// Condition that defines a locus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Condition {
    /// A multiplier is 1 or −1.
    Multiplier(f64),
    /// A pair of multipliers is `exp(±iθ)`; `θ` is one more unknown, the last.
    Pair,
    /// The depth variable of the contact with this index is 0.
    Graze(usize),
}

/// Orbits of an itinerary with a condition: a curve in two parameters.
#[derive(Debug)]
pub(super) struct LocusEquations<O, S> {
    pub(super) orbits: O,
    pub(super) condition: Condition,
    /// Number of conditions `ξ_n` evaluated along a graze of orbits without another contact.
    pub(super) conditions: usize,
    /// Right and left border: the last null vectors.
    borders: Option<[DVector<S>; 2]>,
}

/// Residuals and Jacobian at a point of a locus, with the test functions.
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
    /// Label used in the literature.
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

/// Solution of the bordered system: value of the condition, null vectors, gradient.
struct Singular<S> {
    value: S,
    gradient: Vec<S>,
    /// `wᵀ F_zz v v` with unit vectors.
    bend: S,
    /// `wᵀ E v` with unit vectors: 0 at a double multiplier.
    rate: S,
}

/// Step of central differences along a null vector, which lose a third of the digits.
fn step<S: Real>() -> f64 {
    S::ROUNDOFF.cbrt()
}

impl<S: Real, O: OrbitEquations<S>> LocusEquations<O, S> {
    /// Locus of a condition.
    pub(super) fn new(orbits: O, condition: Condition, conditions: usize) -> Self {
        Self { orbits, condition, conditions, borders: None }
    }

    /// Derivatives, along a direction of the orbit's unknowns, of the Jacobian and of the
    /// derivatives of the first section point.
    fn bent(&mut self, unknowns: &[S], direction: &DVector<S>) -> Option<[DMatrix<S>; 2]> {
        let step = S::from_f64(step::<S>());
        let mut side = |sign: f64| {
            let mut moved = unknowns.to_vec();
            for (value, &along) in moved.iter_mut().zip(direction.iter()) {
                *value += S::from_f64(sign) * step * along;
            }
            let there = self.orbits.linearised(&moved)?;
            let first = self.orbits.first_point(&there);
            Some([there.jacobian, first])
        };
        let ([up, first_up], [down, first_down]) = (side(1.0)?, side(-1.0)?);
        Some([(up - down) / (step + step), (first_up - first_down) / (step + step)])
    }

    /// Last borders, or null vectors of a matrix if there are none of its size.
    fn borders_of(&mut self, matrix: &DMatrix<S>) -> Option<[DVector<S>; 2]> {
        let last = self.borders.take().filter(|[right, _]| right.len() == matrix.nrows());
        last.or_else(|| null_vectors(matrix))
    }

    /// Condition of a real multiplier, with its gradient.
    fn singular(
        &mut self,
        unknowns: &[S],
        [jacobian, first]: [&DMatrix<S>; 2],
        multiplier: f64,
    ) -> Option<Singular<S>> {
        let rows = jacobian.nrows();
        let share = S::from_f64(1.0 - multiplier);
        let matrix = (jacobian + first * share).columns(0, rows).into_owned();
        let [right, left] = self.borders_of(&matrix)?;
        let ([value], v) = bordered(&matrix, [&left], [&right])?;
        let (_, w) = bordered(&matrix.transpose(), [&right], [&left])?;
        let [bent, first_bent] = self.bent(unknowns, &v)?;
        let gradient = w.transpose() * (bent + first_bent * share);
        let (long, high) = (length(&v), length(&w));
        let bend = gradient.columns(0, rows).transpose().dot(&v) / (long * long * high);
        let rate = w.dot(&(first.columns(0, rows) * &v)) / (long * high);
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
        let first = self.orbits.first_point(&orbit);
        let found = self.singular(unknowns, [&orbit.jacobian, &first], multiplier)?;
        let mut tests = Vec::new();
        if multiplier > 0.0 {
            // A difference of rounded derivatives; for a polynomial map it is nearly exact.
            let size = if O::rounding() > 1.0 { O::rounding() / step::<S>() } else { 1.0 };
            tests.push(TestValue { value: found.bend, size });
        }
        if self.orbits.closes() {
            tests.push(TestValue { value: found.rate, size: O::rounding() });
        }
        tests.extend(self.grazes(unknowns, &orbit, None));
        Some(with_condition(orbit, found.value, &found.gradient, tests))
    }

    /// Graze functions except that of one contact: other depth variables, and depths of passages
    /// without contact.
    fn grazes(
        &self,
        unknowns: &[S],
        orbit: &Linearised<S, O::Extra>,
        but: Option<usize>,
    ) -> Vec<TestValue<S>> {
        let all = self.orbits.grazes(unknowns, &orbit.extra).into_iter();
        let others = all.filter(|(contact, _)| contact.is_none() || *contact != but);
        others.map(|(_, value)| TestValue { value, size: 1.0 }).collect()
    }

    fn graze(&mut self, unknowns: &[S], contact: usize) -> Option<Tested<S>> {
        let orbit = self.orbits.linearised(unknowns)?;
        let place = self.orbits.depth_variables()[contact];
        let gradient: Vec<S> = unit_vector(unknowns.len(), place);
        let mut tests = Vec::new();
        match self.conditions {
            _ if !self.orbits.closes() => {}
            0 => {
                let with = [orbit.jacobian.clone(), self.orbits.first_point(&orbit)];
                let both = [with, self.orbits.without(unknowns, &orbit, contact)?];
                let smooth = begins_smoothly(&orbit.jacobian, place, O::rounding());
                for multiplier in [1.0, -1.0] {
                    for (number, [jacobian, first]) in both.iter().enumerate() {
                        if number == 0 && smooth {
                            tests.push(TestValue { value: S::one(), size: 1.0 });
                            continue;
                        }
                        let matrix = jacobian + first * S::from_f64(1.0 - multiplier);
                        let square = matrix.columns(0, matrix.nrows()).into_owned();
                        let test = TestValue::determinant(&square);
                        tests.push(TestValue { size: test.size * O::rounding(), ..test });
                    }
                }
            }
            count => {
                let unfolding = self.orbits.unfolding(unknowns, &orbit)?;
                tests.extend(unfolding.conditions(count, O::rounding()));
            }
        }
        tests.extend(self.grazes(unknowns, &orbit, Some(contact)));
        Some(with_condition(orbit, unknowns[place], &gradient, tests))
    }

    fn pair(&mut self, unknowns: &[S]) -> Option<Tested<S>> {
        let last = unknowns.len() - 1;
        let orbit = self.orbits.linearised(&unknowns[..last])?;
        let rows = orbit.residual.len();
        let (sin, cos) = unknowns[last].sin_cos();
        let first = self.orbits.first_point(&orbit).columns(0, rows).into_owned();
        let real = orbit.jacobian.columns(0, rows) + &first * (S::one() - cos);
        let imaginary = &first * -sin;
        // The complex matrix a + ib as a real one, [a −b; b a].
        let mut matrix = DMatrix::from_element(2 * rows, 2 * rows, S::zero());
        for part in 0..2 {
            matrix.view_mut((part * rows, part * rows), (rows, rows)).copy_from(&real);
        }
        matrix.view_mut((0, rows), (rows, rows)).copy_from(&(-&imaginary));
        matrix.view_mut((rows, 0), (rows, rows)).copy_from(&imaginary);
        let [right, left] = self.borders_of(&matrix)?;
        let (value, v) = bordered_complex(&matrix, &left, &right)?;
        let (_, w) = bordered_complex(&matrix.transpose(), &right, &left)?;
        let halves = |vector: &DVector<S>| {
            [vector.rows(0, rows).into_owned(), vector.rows(rows, rows).into_owned()]
        };
        let ([vr, vi], [wr, wi]) = (halves(&v), halves(&w));
        let [by_vr, first_by_vr] = self.bent(&unknowns[..last], &vr)?;
        let [by_vi, first_by_vi] = self.bent(&unknowns[..last], &vi)?;
        let share = S::one() - cos;
        let by_vr = by_vr + &first_by_vr * share + &first_by_vi * sin;
        let by_vi = by_vi + first_by_vi * share - first_by_vr * sin;
        // dg = −w* dK v, with w* the conjugate transpose.
        let product = |a: &DVector<S>, matrix: &DMatrix<S>| a.transpose() * matrix;
        let along_real = product(&wr, &by_vr) + product(&wi, &by_vi);
        let along_imaginary = product(&wr, &by_vi) - product(&wi, &by_vr);
        let mut gradients =
            [along_real, along_imaginary].map(|row| row.iter().map(|&a| -a).collect::<Vec<S>>());
        // dK/dθ = −i exp(iθ) E.
        let turned = [&first * (&vr * sin + &vi * cos), &first * (&vi * sin - &vr * cos)];
        gradients[0].push(-(wr.dot(&turned[0]) + wi.dot(&turned[1])));
        gradients[1].push(-(wr.dot(&turned[1]) - wi.dot(&turned[0])));
        let (long, high) = (length(&v), length(&w));
        self.borders = Some([v / long, w / high]);
        let mut tests = vec![
            TestValue { value: cos + S::from_f64(0.5), size: O::rounding() },
            TestValue { value: cos, size: O::rounding() },
        ];
        tests.extend(self.grazes(unknowns, &orbit, None));
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

    /// Kinds of the zeros of the test functions, in order; `contacts` of them are grazes.
    pub(super) fn kinds(&self, contacts: usize) -> Vec<CodimensionTwo> {
        use CodimensionTwo as Kind;
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
                let others = contacts.saturating_sub(1);
                own.into_iter().chain(repeated(Kind::DoubleGraze, others)).collect()
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

    fn tests(&self, point: &ContinuationPoint<S, Self::Extra>) -> Vec<TestValue<S>> {
        point.linearised.extra.clone()
    }

    fn bring_near(&self, unknowns: &mut [S], other: &[S]) {
        self.orbits.bring_near(unknowns, other);
    }

    fn is_spent(&self) -> bool {
        self.orbits.is_spent()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        match self.condition {
            // The variable is held at 0, which may be the end of its range.
            Condition::Graze(contact) if unknown == self.orbits.depth_variables()[contact] => {
                [-1.0, 1.0]
            }
            Condition::Pair if unknown == self.orbits.count() => {
                [ANGLE, std::f64::consts::PI - ANGLE]
            }
            _ => self.orbits.range(unknown),
        }
    }
}

/// Smallest distance of the angle of a pair from 0 and π, where the pair becomes a double
/// multiplier.
const ANGLE: f64 = 1e-3;

/// Whether the depth variable of a grazing contact has no effect to first order, as at compliant
/// stops: multipliers then equal those without the contact.
pub(super) fn begins_smoothly<S: Real>(jacobian: &DMatrix<S>, place: usize, rounding: f64) -> bool {
    length(&jacobian.column(place).into_owned()).magnitude() <= (rounding * S::ROUNDOFF).sqrt()
}

/// Appends a condition to the orbit's equations.
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

/// Solves `[K B; C 0] (v; g) = (0; 1, 0 …)` for given columns of `B` and rows of `C`: `g` vanishes
/// where `K` is singular, and `v` is its null vector there.
fn bordered<S: Real, const N: usize>(
    matrix: &DMatrix<S>,
    columns: [&DVector<S>; N],
    rows: [&DVector<S>; N],
) -> Option<([S; N], DVector<S>)> {
    let size = matrix.nrows();
    let mut whole = matrix.clone().resize(size + N, size + N, S::zero());
    for (border, (column, row)) in columns.iter().zip(rows).enumerate() {
        for place in 0..size {
            whole[(place, size + border)] = column[place];
            whole[(size + border, place)] = row[place];
        }
    }
    let right = DVector::from_vec(unit_vector(size + N, size));
    let found = factorize(&whole).ok()?.solve(&right).ok()?;
    let finite = found.iter().all(|value| value.is_finite());
    let values = std::array::from_fn(|border| found[size + border]);
    finite.then(|| (values, found.rows(0, size).into_owned()))
}

/// Solution as by [`bordered`] for a complex matrix written as a real one; the border row is the
/// conjugate transpose of a vector.
fn bordered_complex<S: Real>(
    matrix: &DMatrix<S>,
    column: &DVector<S>,
    row: &DVector<S>,
) -> Option<([S; 2], DVector<S>)> {
    let half = matrix.nrows() / 2;
    // The vector times i.
    let turned = |vector: &DVector<S>| {
        DVector::from_fn(2 * half, |place, _| match place < half {
            true => -vector[half + place],
            false => vector[place - half],
        })
    };
    bordered(matrix, [column, &turned(column)], [row, &turned(row)])
}

/// Right and left singular vectors of nearly the smallest singular value, by inverse iteration.
pub(super) fn null_vectors<S: Real>(matrix: &DMatrix<S>) -> Option<[DVector<S>; 2]> {
    let size = matrix.nrows();
    // A shift of the size of rounding keeps a numerically singular matrix invertible. Entries are
    // of order one unless all vanish.
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

/// Number of inverse iterations: borders need not be exact.
const ITERATIONS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::continuation::{StepControl, Turn, follow};

    /// A map of one or two coordinates in two parameters, without contacts: returns the image, and
    /// the derivatives by coordinates and parameters as rows.
    type Plain = fn(&[f64]) -> (Vec<f64>, Vec<Vec<f64>>);

    struct Smooth {
        coordinates: usize,
        map: Plain,
    }

    impl CurveEquations<f64> for Smooth {
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

        fn tests(&self, _: &ContinuationPoint<f64>) -> Vec<TestValue<f64>> {
            Vec::new()
        }

        fn range(&self, _: usize) -> [f64; 2] {
            [-3.0, 3.0]
        }
    }

    impl OrbitEquations<f64> for Smooth {
        fn first_point(&self, _: &Linearised<f64>) -> DMatrix<f64> {
            DMatrix::identity(self.coordinates, self.coordinates + 2)
        }

        fn count(&self) -> usize {
            self.coordinates + 2
        }

        fn depth_variables(&self) -> Vec<usize> {
            Vec::new()
        }

        fn grazes(&self, _: &[f64], (): &()) -> Vec<(Option<usize>, f64)> {
            Vec::new()
        }

        fn without(
            &mut self,
            _: &[f64],
            _: &Linearised<f64>,
            _: usize,
        ) -> Option<[DMatrix<f64>; 2]> {
            None
        }

        fn unfolding(&mut self, _: &[f64], _: &Linearised<f64>) -> Option<Unfolding<f64>> {
            None
        }

        fn rounding() -> f64 {
            1.0
        }
    }

    /// `(x, y) ↦ (y, a y − b x + x y)`: multipliers at the origin have sum `a` and product `b`.
    fn delayed(u: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let [x, y, a, b] = [u[0], u[1], u[2], u[3]];
        let slopes = vec![vec![0.0, 1.0, 0.0, 0.0], vec![y - b, a + x, y, -x]];
        (vec![y, a * y - b * x + x * y], slopes)
    }

    /// Zeros of the test functions along a locus: kinds and parameters.
    fn special(
        map: Plain,
        condition: Condition,
        start: &[f64],
        along: &[f64],
    ) -> Vec<(CodimensionTwo, [f64; 2])> {
        let coordinates = start.len() - 2 - usize::from(condition == Condition::Pair);
        let mut equations = LocusEquations::new(Smooth { coordinates, map }, condition, 0);
        let kinds = equations.kinds(0);
        let curve = follow(&mut equations, start, along, &StepControl::DEFAULT);
        let curve = curve.expect("a locus");
        let of = |turn: &Turn| {
            let at = &curve.points[turn.point].unknowns;
            (kinds[turn.test], [at[coordinates], at[coordinates + 1]])
        };
        curve.turns.iter().map(of).collect()
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
