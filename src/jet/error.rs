//! What can go wrong with jets.

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
        "{variables} variables at order {order} need {coefficients} coefficients and {products} coefficient products; at most {limit} products are allowed"
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
}
