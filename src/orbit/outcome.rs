//! How the search for a grazing orbit ended.

use super::point::GrazingOrbit;

/// How the search for a grazing orbit ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Location {
    /// A grazing orbit.
    Located(Box<GrazingOrbit>),
    /// None, and why.
    NotLocated(NotLocated),
}

impl Location {
    /// The orbit, or why there is none.
    ///
    /// # Errors
    ///
    /// [`NotLocated`] where the search ended without an orbit.
    pub fn into_result(self) -> Result<GrazingOrbit, NotLocated> {
        match self {
            Location::Located(orbit) => Ok(*orbit),
            Location::NotLocated(reason) => Err(reason),
        }
    }
}

/// Why no grazing orbit was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotLocated {
    /// The free flow has no periodic orbit that shooting could find.
    #[error(
        "no periodic orbit of the free flow found at {parameter} = {value}: after {periods} periods a period still moves the state by {change:.3e}"
    )]
    NoPeriodicOrbit {
        /// Name of the adjusted parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// Periods flown to settle.
        periods: usize,
        /// What a period still changes; NaN where the flow left the finite numbers.
        change: f64,
    },
    /// The periodic orbit does not come to touch the surface.
    #[error(
        "the periodic orbit never touches `{surface}`: over {tried} values of {parameter} its closest approach was h = {clearance:.6e}, at {parameter} = {value}"
    )]
    NeverTouches {
        /// Name of the surface.
        surface: String,
        /// Name of the adjusted parameter.
        parameter: String,
        /// Its value at the closest approach.
        value: f64,
        /// Lowest value of the event function there, signed.
        clearance: f64,
        /// Number of parameter values tried.
        tried: usize,
    },
    /// The orbit touches the surface without a simple minimum of the event function.
    #[error(
        "degenerate graze at {parameter} = {value}: h'' = {normal_acceleration:.6e} (h'' T²/max h = {relative:.3e}); a simple graze has h'' > 0"
    )]
    DegenerateGraze {
        /// Name of the adjusted parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// `h''` at the point.
        normal_acceleration: f64,
        /// `h''` in units of the largest `h` over the squared period.
        relative: f64,
    },
    /// The orbit cannot be adjusted with this parameter here.
    #[error(
        "the equations of the grazing orbit are singular in {parameter} at {parameter} = {value} (reciprocal condition {condition:.3e}); the multiplier nearest 1 is {re:.12} + {im:.12}i"
    )]
    Singular {
        /// Name of the adjusted parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// Reciprocal condition of the scaled Jacobian.
        condition: f64,
        /// Real part of the multiplier nearest 1.
        re: f64,
        /// Imaginary part of the multiplier nearest 1.
        im: f64,
    },
    /// Newton's method did not end at a root.
    #[error(
        "Newton's method did not converge: residual {first:.3e} at the start, {last:.3e} after {} iterations, at {parameter} = {value}",
        .history.len()
    )]
    NotConverged {
        /// Name of the adjusted parameter.
        parameter: String,
        /// Its last value.
        value: f64,
        /// First residual.
        first: f64,
        /// Last residual.
        last: f64,
        /// All residuals.
        history: Vec<f64>,
    },
}
