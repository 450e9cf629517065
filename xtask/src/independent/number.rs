//! Numbers for the evaluation of formulas: doubles, double-doubles, and dual numbers over either.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use grazemap::numeric::Dd;

/// Function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    Negative,
    Sqrt,
    Exp,
    Log,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Abs,
    Sign,
}

impl Function {
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "sqrt" => Self::Sqrt,
            "exp" => Self::Exp,
            "log" => Self::Log,
            "sin" => Self::Sin,
            "cos" => Self::Cos,
            "tan" => Self::Tan,
            "asin" => Self::Asin,
            "acos" => Self::Acos,
            "atan" => Self::Atan,
            "sinh" => Self::Sinh,
            "cosh" => Self::Cosh,
            "tanh" => Self::Tanh,
            "abs" => Self::Abs,
            "sign" => Self::Sign,
            _ => return None,
        })
    }
}

/// Number type of an integration.
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Unit in the last place of 1.
    const EPSILON: f64;
    /// Largest number of columns of an extrapolation.
    const COLUMNS: usize;

    /// Nearest number.
    fn exact(value: Dd) -> Self;
    /// Nearest double.
    fn double(self) -> f64;
    /// Value of a function.
    fn apply(self, function: Function) -> Self;

    /// Number of a double.
    fn of(value: f64) -> Self {
        Self::exact(Dd::from(value))
    }
    /// Zero.
    fn zero() -> Self {
        Self::of(0.0)
    }
    /// Power with a whole exponent.
    fn whole_power(self, power: i32) -> Self {
        let size = (0..power.unsigned_abs()).fold(Self::of(1.0), |product, _| product * self);
        if power < 0 { Self::of(1.0) / size } else { size }
    }
    /// Whether the number is below zero, to the last digit.
    fn is_negative(self) -> bool;
    /// Absolute value, as a double.
    fn size(self) -> f64 {
        self.double().abs()
    }
}

impl Number for f64 {
    const EPSILON: f64 = f64::EPSILON;
    const COLUMNS: usize = 8;

    fn exact(value: Dd) -> Self {
        value.to_f64()
    }

    fn double(self) -> f64 {
        self
    }

    fn of(value: f64) -> Self {
        value
    }

    fn is_negative(self) -> bool {
        self < 0.0
    }

    fn apply(self, function: Function) -> Self {
        match function {
            Function::Negative => -self,
            Function::Sqrt => self.sqrt(),
            Function::Exp => self.exp(),
            Function::Log => self.ln(),
            Function::Sin => self.sin(),
            Function::Cos => self.cos(),
            Function::Tan => self.tan(),
            Function::Asin => self.asin(),
            Function::Acos => self.acos(),
            Function::Atan => self.atan(),
            Function::Sinh => self.sinh(),
            Function::Cosh => self.cosh(),
            Function::Tanh => self.tanh(),
            Function::Abs => self.abs(),
            Function::Sign => match self {
                x if x > 0.0 => 1.0,
                x if x < 0.0 => -1.0,
                _ => 0.0,
            },
        }
    }
}

impl Number for Dd {
    const EPSILON: f64 = 4.93e-32;
    const COLUMNS: usize = 14;

    fn exact(value: Dd) -> Self {
        value
    }

    fn double(self) -> f64 {
        self.to_f64()
    }

    fn is_negative(self) -> bool {
        self < Dd::ZERO
    }

    fn apply(self, function: Function) -> Self {
        let one = Dd::from(1.0);
        match function {
            Function::Negative => -self,
            Function::Sqrt => self.sqrt(),
            Function::Exp => self.exp(),
            Function::Log => self.ln(),
            Function::Sin => self.sin_cos().0,
            Function::Cos => self.sin_cos().1,
            Function::Tan => self.sin_cos().0 / self.sin_cos().1,
            Function::Asin => self.asin(),
            Function::Acos => self.acos(),
            Function::Atan => self.atan(),
            Function::Sinh => self.sinh_cosh().0,
            Function::Cosh => self.sinh_cosh().1,
            // NOTE: of a decaying exponential, so that nothing overflows.
            Function::Tanh => {
                let decay = (-self.abs() - self.abs()).exp();
                let size = (one - decay) / (one + decay);
                if self.is_negative() { -size } else { size }
            }
            Function::Abs => self.abs(),
            Function::Sign => Dd::from(self.to_f64().apply(Function::Sign)),
        }
    }
}

/// Number with its derivative along a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual<N> {
    /// Value.
    pub(super) value: N,
    /// Derivative along the direction.
    pub(super) slope: N,
}

impl<N: Number> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl<N: Number> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, slope: self.slope - other.slope }
    }
}

impl<N: Number> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let slope = self.slope * other.value + self.value * other.slope;
        Self { value: self.value * other.value, slope }
    }
}

impl<N: Number> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, slope: (self.slope - value * other.slope) / other.value }
    }
}

impl<N: Number> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope }
    }
}

impl<N: Number> Number for Dual<N> {
    const EPSILON: f64 = N::EPSILON;
    const COLUMNS: usize = N::COLUMNS;

    fn exact(value: Dd) -> Self {
        Self { value: N::exact(value), slope: N::zero() }
    }

    fn double(self) -> f64 {
        self.value.double()
    }

    fn is_negative(self) -> bool {
        self.value.is_negative()
    }

    fn apply(self, function: Function) -> Self {
        let x = self.value;
        let (one, value) = (N::of(1.0), x.apply(function));
        let slope = match function {
            Function::Negative => -one,
            Function::Sqrt => one / (value + value),
            Function::Exp => value,
            Function::Log => one / x,
            Function::Sin => x.apply(Function::Cos),
            Function::Cos => -x.apply(Function::Sin),
            Function::Tan => one + value * value,
            Function::Asin => one / (one - x * x).apply(Function::Sqrt),
            Function::Acos => -(one / (one - x * x).apply(Function::Sqrt)),
            Function::Atan => one / (one + x * x),
            Function::Sinh => x.apply(Function::Cosh),
            Function::Cosh => x.apply(Function::Sinh),
            Function::Tanh => one - value * value,
            Function::Abs => x.apply(Function::Sign),
            Function::Sign => N::zero(),
        };
        Self { value, slope: slope * self.slope }
    }
}
