//! Matrices in kept pieces, for `#[serde(with)]`: their shape, and their entries column by column.

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
