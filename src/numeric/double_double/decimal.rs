//! Decimal text of [`Dd`].
/// Why a text is no number.
#[derive(Debug)]
pub struct ParseDdError;
