//! What can go wrong with an emission.

/// Error of an emission.
#[derive(Debug, thiserror::Error)]
pub enum EmissionError {
    /// A name is no identifier.
    #[error("`{}` cannot name emitted code: expected [a-z_][a-z0-9_]* and no keyword of \
        Rust", name.escape_default())]
    NotAnIdentifier {
        /// The name.
        name: String,
    },
    /// Two modules of one crate have the same name.
    #[error("two emitted modules are named `{name}`")]
    DuplicateModule {
        /// The name.
        name: String,
    },
    /// A coefficient, a window or an error is not a finite number.
    #[error("{what} is {value}; emitted numbers are finite")]
    NonFinite {
        /// What the number is.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A coefficient or a half-width of the window is no number of single precision.
    #[error(
        "{what} is {value:e}, beyond the largest number of single precision, 3.4e38: emit in \
            double precision"
    )]
    TooLarge {
        /// What the number is.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A map in single precision among those of the catalogue's crate.
    #[error(
        "`{name}` is in single precision; the catalogue's crate holds maps in double precision"
    )]
    SingleInCatalogue {
        /// The map.
        name: String,
    },
    /// The number of lanes cannot be used.
    #[error("{lanes} lanes: expected 1 to 64")]
    Lanes {
        /// Lanes asked for.
        lanes: usize,
    },
    /// The composed shape was asked for, but no composed form was handed over.
    #[error("the composed shape needs the composed form of the map")]
    NoComposedForm,
    /// A polynomial or a list has not the shape the map's dimension asks for.
    #[error("{what}: expected {expected}, found {found}")]
    Shape {
        /// What has the wrong shape.
        what: &'static str,
        /// Expected number.
        expected: usize,
        /// Number found.
        found: usize,
    },
    /// A template could not be rendered.
    #[error("the layout of emitted code could not be rendered")]
    Layout(#[from] tera::Error),
}
