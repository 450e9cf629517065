//! The machine's numbers, `f64` and `f32`, as scalars.

use super::scalar::inherent;
use super::sine::sin_cos;
use super::{Dd, Real, Scalar};

macro_rules! float {
    ($float:ident) => {
        impl Scalar for $float {
            const ROUNDOFF: f64 = $float::EPSILON as f64 / 2.0;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $float
            }

            #[inline(always)]
            fn from_dd(value: Dd) -> Self {
                value.hi as $float
            }

            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                if cfg!(target_feature = "fma") {
                    $float::mul_add(self, a, b)
                } else {
                    self * a + b
                }
            }

            inherent!($float: sqrt(), exp(), ln(), asin(), acos(), atan(), atan2(x));
            inherent!($float: powf(exponent), abs(), min(other), max(other));

            fn sin_cos(self) -> (Self, Self) {
                let (sine, cosine) = sin_cos(f64::from(self));
                (sine as $float, cosine as $float)
            }

            fn sinh_cosh(self) -> (Self, Self) {
                (self.sinh(), self.cosh())
            }

            /// `0` at zero, unlike the inherent function; NaN stays NaN.
            #[inline(always)]
            fn signum(self) -> Self {
                if self == 0.0 {
                    0.0
                } else {
                    $float::signum(self)
                }
            }

            #[inline(always)]
            fn magnitude(self) -> f64 {
                f64::from($float::abs(self))
            }

            #[inline(always)]
            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }
        }

        impl Real for $float {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn to_dd(self) -> Dd {
                Dd::from(f64::from(self))
            }

            #[inline(always)]
            fn floor(self) -> Self {
                $float::floor(self)
            }
        }
    };
}

float!(f64);
float!(f32);

/// Which of the machine's numbers a map is run in.
///
/// ```
/// use grazemap_jet::numeric::FloatFormat;
/// assert_eq!(FloatFormat::F32.to_string(), "f32");
/// assert_eq!(FloatFormat::F32.roundoff(), 2f64.powi(-24));
/// ```
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum FloatFormat {
    /// Single precision: 24 bits, half the memory, twice as many lanes.
    F32,
    /// Double precision: 53 bits.
    #[default]
    F64,
}

impl FloatFormat {
    /// Unit roundoff: half the distance from 1 to the next number.
    pub fn roundoff(self) -> f64 {
        match self {
            Self::F32 => f32::ROUNDOFF,
            Self::F64 => f64::ROUNDOFF,
        }
    }
}

impl std::fmt::Display for FloatFormat {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}
