//! Pseudo-arclength continuation of solution curves: one equation less than unknowns.
//!
//! One idea: a curve is followed along its tangent, so that no unknown is special and folds are
//! regular points. A problem supplies three things ([`CurveEquations`]): residuals with their
//! Jacobian, test functions whose zeros are special points, and the range of the unknowns. All
//! unknowns are scaled to be of order one.
//!
//! ```text
//! F: Rⁿ⁺¹ → Rⁿ,  F(u) = 0,   tangent t: F' t = 0, |t| = 1
//! predictor u + ds t,  corrector F = 0 and t · (u' − u − ds t) = 0
//! ```
//!
//! Examples: grazing orbits in two parameters and orbits of the free flow in one (`orbit`); orbits
//! of an itinerary in one parameter (`analysis::periodic`); a locus in two parameters, which has
//! one more unknown and one more residual, a test function of the orbits that must vanish
//! (`analysis::loci`). Every step is sampled at the Chebyshev points, so that the number of zeros
//! in a step is either known or reported as unknown. Numbers are `f64` or double-double.

mod curve;
mod sampled;
mod step;
mod vectors;

pub use curve::{ContinuationEnd, Curve, Turn, follow};
pub use step::{
    ContinuationPoint, Solution, StepControl, by_chords, corrected, searched, tangent_at,
    zero_between, zero_near,
};
pub(crate) use step::{any_tangent, bordered, point_on, zero_on_chord};
pub(crate) use vectors::{apart, between, dot, farthest, largest, moved, normalised, unit_vector};

use nalgebra::{DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::numeric::Real;

/// Equations whose solutions form a curve.
pub trait CurveEquations<S: Real> {
    /// Data computed with the residuals that the test functions need, such as values at passages
    /// and their derivatives.
    type Extra: Clone;

    /// Residuals (`n`) and their Jacobian (`n × (n + 1)`); `None` where the equations are
    /// undefined.
    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>>;

    /// Residuals alone, if they are cheaper.
    fn residual(&mut self, unknowns: &[S]) -> Option<DVector<S>> {
        self.linearised(unknowns).map(|there| there.residual)
    }

    /// Solution on the plane through `origin` normal to `normal`, from a start near it. By Newton's
    /// method unless the equations have several forms.
    fn solution(
        &mut self,
        start: &[S],
        [origin, normal]: [&[S]; 2],
    ) -> Option<Solution<S, Self::Extra>> {
        corrected(self, start, origin, normal)
    }

    /// Adds data that no equation needs to a point of the curve, before its test functions; returns
    /// whether the curve has such a point.
    fn complete(&mut self, _point: &mut ContinuationPoint<S, Self::Extra>) -> bool {
        true
    }

    /// Test functions at a point of the curve, as many and in the same order at every point. They
    /// are smooth along the curve; [`TestValue::turn`] is the one for a turn of an unknown. Steps
    /// of a curve without test functions are not sampled.
    fn tests(&self, point: &ContinuationPoint<S, Self::Extra>) -> Vec<TestValue<S>>;

    /// Range of an unknown: the curve ends where an unknown leaves its range, at a point solved for
    /// on the border.
    fn range(&self, unknown: usize) -> [f64; 2];

    /// Shifts unknowns that are phases by whole periods to within half a period of another point,
    /// which may lack the last unknowns.
    fn bring_near(&self, _unknowns: &mut [S], _other: &[S]) {}

    /// Whether the bound on work is reached; no more points are found then.
    fn is_spent(&self) -> bool {
        false
    }

    /// Whether the curve may pass from one point to the next; a shorter step is tried if not.
    fn is_passable(&mut self, _ends: [&ContinuationPoint<S, Self::Extra>; 2]) -> bool {
        true
    }

    /// Whether the curve ends at the last of two successive points. Called once for every point of
    /// the curve after the first, in order.
    fn is_last(&mut self, _ends: [&ContinuationPoint<S, Self::Extra>; 2]) -> bool {
        false
    }
}

/// Residuals with their Jacobian.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound(
    serialize = "S: Real + Serialize + DeserializeOwned, X: Serialize",
    deserialize = "S: Real + Serialize + DeserializeOwned, X: Deserialize<'de>"
))]
pub struct Linearised<S, X = ()> {
    /// `F(u)`.
    #[serde(with = "saved")]
    pub residual: DVector<S>,
    /// `F'(u)`.
    #[serde(with = "saved")]
    pub jacobian: DMatrix<S>,
    /// Data for the test functions.
    pub extra: X,
}

/// Determinant of the Jacobian with the tangent as its last row: zero where another branch passes
/// through the point.
pub fn crossing<S: Real>(jacobian: &DMatrix<S>, tangent: &[S]) -> TestValue<S> {
    TestValue::determinant(&bordered(jacobian, tangent))
}

/// Rounding of a test function relative to its size, in units of the roundoff.
const NOISE: f64 = 64.0;

/// A test function at a point of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestValue<S> {
    /// Value.
    pub value: S,
    /// Magnitude that the rounding of the value is relative to.
    pub size: f64,
}

impl<S: Real> TestValue<S> {
    /// Component of the tangent along an unknown: zero where that unknown turns back.
    pub fn turn<X>(point: &ContinuationPoint<S, X>, unknown: usize) -> Self {
        Self { value: point.tangent[unknown], size: 1.0 }
    }

    /// Value that is known up to `noise`.
    pub(crate) fn known_to(value: S, noise: f64) -> Self {
        Self { value, size: noise / (NOISE * S::ROUNDOFF) }
    }

    /// Value; 0 if it is within rounding.
    pub(crate) fn beyond_rounding(&self) -> S {
        match self.value.magnitude() <= self.noise() {
            true => S::zero(),
            false => self.value,
        }
    }

    /// Rounding of the value.
    pub(crate) fn noise(&self) -> f64 {
        NOISE * S::ROUNDOFF * self.size
    }

    /// `det M`, with rounding relative to the product of the rows' largest entries.
    pub fn determinant(matrix: &DMatrix<S>) -> Self {
        let rows = matrix.row_iter();
        let largest = rows.map(|row| row.iter().fold(0.0, |most: f64, a| most.max(a.magnitude())));
        let value = crate::numeric::linear::determinant(matrix);
        Self { value: value.unwrap_or(S::from_f64(f64::NAN)), size: largest.product() }
    }
}

/// Serialisation of matrices in kept pieces, for `#[serde(with)]`: shape, and entries by columns.
pub(crate) mod saved {
    use nalgebra::{DMatrix, DVector};
    use serde::de::{DeserializeOwned, Error};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// A type that is serialised in another form.
    pub(crate) trait Saved: Sized {
        type Form: Serialize + DeserializeOwned;

        fn form(&self) -> Self::Form;

        /// Value of a form; `None` if the form is invalid.
        fn of(form: Self::Form) -> Option<Self>;
    }

    impl<S: nalgebra::Scalar + Serialize + DeserializeOwned> Saved for DMatrix<S> {
        type Form = (usize, Vec<S>);

        fn form(&self) -> Self::Form {
            (self.nrows(), self.as_slice().to_vec())
        }

        fn of((rows, entries): Self::Form) -> Option<Self> {
            let columns = entries.len().checked_div(rows).unwrap_or(0);
            (rows * columns == entries.len()).then(|| Self::from_vec(rows, columns, entries))
        }
    }

    impl<S: nalgebra::Scalar + Serialize + DeserializeOwned> Saved for DVector<S> {
        type Form = Vec<S>;

        fn form(&self) -> Self::Form {
            self.as_slice().to_vec()
        }

        fn of(form: Self::Form) -> Option<Self> {
            Some(Self::from_vec(form))
        }
    }

    impl<T: Saved> Saved for Vec<T> {
        type Form = Vec<T::Form>;

        fn form(&self) -> Self::Form {
            self.iter().map(T::form).collect()
        }

        fn of(form: Self::Form) -> Option<Self> {
            form.into_iter().map(T::of).collect()
        }
    }

    impl<T: Saved> Saved for [T; 2] {
        type Form = [T::Form; 2];

        fn form(&self) -> Self::Form {
            [self[0].form(), self[1].form()]
        }

        fn of([first, second]: Self::Form) -> Option<Self> {
            Some([T::of(first)?, T::of(second)?])
        }
    }

    pub(crate) fn serialize<T: Saved, S: Serializer>(
        value: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.form().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, T: Saved, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        let form = T::Form::deserialize(deserializer)?;
        T::of(form).ok_or_else(|| D::Error::custom("entries of no matrix"))
    }
}
