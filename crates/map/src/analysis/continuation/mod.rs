//! Pseudo-arclength continuation of the solutions of one equation fewer than unknowns.
//!
//! One idea: a curve is followed along its tangent, so that no unknown is special and folds are
//! regular points. What is followed says three things ([`CurveEquations`]): its residuals with
//! their Jacobian, the test functions whose zeros are special points, and the range in which it is
//! of interest. All unknowns are in units in which they are of order one.
//!
//! ```text
//! F: Rⁿ⁺¹ → Rⁿ,  F(u) = 0,   tangent t: F' t = 0, |t| = 1
//! predictor u + ds t,  corrector F = 0 and t · (u' − u − ds t) = 0
//! ```
//!
//! Orbits of an itinerary in one parameter are such equations by the map
//! (`periodic::MapOrbitEquations`); a locus in two parameters has one
//! more unknown and one more residual: a test function of the orbits that is required to vanish.
//! Every step is sampled at the Chebyshev points, so that the number of zeros in a step is known
//! or said not to be. Numbers are `f64` or double-double.

mod course;
mod step;
mod vectors;

pub use course::{Course, CourseEnd, Turn, follow};
pub(in crate::analysis) use step::any_tangent;
pub use step::{
    CurvePoint, Solution, StepControl, by_chords, corrected, searched, tangent_at, zero_between,
    zero_near,
};
pub(in crate::analysis) use vectors::{
    apart, between, farthest, largest, moved, normalised, unit_vector,
};

use nalgebra::{DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::numeric::Real;

/// Equations whose solutions form a curve.
pub trait CurveEquations<S: Real> {
    /// What is computed beside the residuals and that the test functions need: nothing, or values
    /// at passages, derivatives of them.
    type Extra: Clone;

    /// Residuals, `n` of them, and their Jacobian, `n × (n + 1)`; `None` where the equations are
    /// not defined.
    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>>;

    /// The residuals alone, where they cost less.
    fn residual(&mut self, unknowns: &[S]) -> Option<DVector<S>> {
        self.linearised(unknowns).map(|there| there.residual)
    }

    /// Test functions at a point of the curve, as many and in the same order at every point. They
    /// are smooth along the curve; a turn of an unknown is [`TestValue::turn`].
    fn tests(&self, point: &CurvePoint<S, Self::Extra>) -> Vec<TestValue<S>>;

    /// The range of every unknown: the curve ends where one leaves it, solved for on the border.
    fn range(&self, unknown: usize) -> [f64; 2];

    /// Moves unknowns that are phases by whole periods, to within half a period of those of another
    /// point, which may lack the last unknowns: points a period apart are one.
    fn bring_near(&self, _unknowns: &mut [S], _other: &[S]) {}

    /// Whether the work that may be done is done: nothing is found any more.
    fn is_spent(&self) -> bool {
        false
    }

    /// Whether the curve is not followed beyond a point, which is then its last.
    fn is_last(&self, _point: &CurvePoint<S, Self::Extra>) -> bool {
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
    /// What test functions need beside them.
    pub extra: X,
}

/// The determinant of the Jacobian with the tangent as its last row: zero where another branch
/// passes through the point.
pub fn bordered<S: Real>(jacobian: &DMatrix<S>, tangent: &[S]) -> TestValue<S> {
    let size = tangent.len();
    let entry = |i, j| if i + 1 < size { jacobian[(i, j)] } else { tangent[j] };
    TestValue::determinant(&DMatrix::from_fn(size, size, entry))
}

/// A test function at a point of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestValue<S> {
    /// Its value.
    pub value: S,
    /// What the rounding of the value is relative to.
    pub size: f64,
}

impl<S: Real> TestValue<S> {
    /// The component of the tangent along an unknown: zero where that unknown turns back.
    pub fn turn<X>(point: &CurvePoint<S, X>, unknown: usize) -> Self {
        Self { value: point.tangent[unknown], size: 1.0 }
    }

    /// `det M`, its rounding relative to the product of the rows' largest entries.
    pub fn determinant(matrix: &DMatrix<S>) -> Self {
        let rows = matrix.row_iter();
        let largest = rows.map(|row| row.iter().fold(0.0, |most: f64, a| most.max(a.magnitude())));
        let value = crate::numeric::linear::determinant(matrix);
        Self { value: value.unwrap_or(S::from_f64(f64::NAN)), size: largest.product() }
    }
}

/// Matrices in kept pieces, for `#[serde(with)]`: their shape, and their entries column by column.
pub(in crate::analysis) mod saved {
    use nalgebra::{DMatrix, DVector};
    use serde::de::{DeserializeOwned, Error};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// What is written in another form.
    pub(in crate::analysis) trait Saved: Sized {
        type Form: Serialize + DeserializeOwned;

        fn form(&self) -> Self::Form;

        /// `None` for a form of no value.
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

    pub(in crate::analysis) fn serialize<T: Saved, S: Serializer>(
        value: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.form().serialize(serializer)
    }

    pub(in crate::analysis) fn deserialize<'de, T: Saved, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        let form = T::Form::deserialize(deserializer)?;
        T::of(form).ok_or_else(|| D::Error::custom("entries of no matrix"))
    }
}
