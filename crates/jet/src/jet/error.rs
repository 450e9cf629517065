//! Errors of operations on jets.

/// Error of an operation on jets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JetError {
    /// A weight of a variable is zero.
    #[error("variable {variable} has weight 0; weights are at least 1")]
    ZeroWeight {
        /// Number of the variable.
        variable: usize,
    },
    /// The order exceeds what exponents can hold.
    #[error("order {order} exceeds 255")]
    OrderTooHigh {
        /// The order asked for.
        order: usize,
    },
    /// The space would not fit in memory.
    #[error(
        "{variables} variables at order {order} need {coefficients} coefficients and {products} \
            coefficient products; at most {limit} products are allowed"
    )]
    TooLarge {
        /// Number of variables.
        variables: usize,
        /// Weighted order.
        order: usize,
        /// Coefficients of one jet.
        coefficients: u128,
        /// Coefficient products of one product.
        products: u128,
        /// The limit.
        limit: u128,
    },
    /// A map without components.
    #[error("a map needs at least one component")]
    Empty,
    /// Jets of different spaces in one map.
    #[error("component {component} lies in another space than component 0")]
    SpaceMismatch {
        /// Number of the component.
        component: usize,
    },
    /// Numbers of components, variables or equations that do not fit.
    #[error("expected {expected} components, found {found}")]
    DimensionMismatch {
        /// The number needed.
        expected: usize,
        /// The number given.
        found: usize,
    },
    /// A component of a map to be inverted begins below its variable's weight.
    #[error(
        "component {component} has a term of degree {degree}; at least its weight {weight} is \
            needed"
    )]
    DegreeTooLow {
        /// Number of the component.
        component: usize,
        /// Its lowest degree.
        degree: usize,
        /// Weight of its variable.
        weight: u32,
    },
    /// A matrix of jets that is singular at the expansion point.
    #[error("singular at the expansion point: no pivot in column {column}")]
    Singular {
        /// The column.
        column: usize,
    },
    /// Newton's method met a value that is not finite.
    #[error("a coefficient is not finite after Newton step {step}")]
    NotFinite {
        /// Number of the step, from 0.
        step: usize,
    },
    /// Newton's method did not settle.
    #[error("no convergence in {steps} Newton steps; the last relative change is {change:e}")]
    NoConvergence {
        /// Steps made.
        steps: usize,
        /// Relative change in the last step.
        change: f64,
    },
}
