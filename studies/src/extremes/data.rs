//! Rows of the study, as plain data.

use serde::Serialize;

use grazemap::expansion::MapOrders;

/// Decimal digits by which a measured accuracy may fall short of its estimate; both are only orders
/// of magnitude.
const SLACK: f64 = 1.0;

/// Quantity taken to its extreme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExtremeAxis {
    /// The depth `y²`.
    Depth,
    /// The coefficient of restitution.
    Restitution,
    /// The damping ratio.
    Damping,
    /// The distance of the forcing from resonance.
    Resonance,
    /// `h''` at the graze.
    NormalAcceleration,
    /// The distance of a multiplier from 1.
    Multiplier,
    /// The frequency of the forcing.
    Frequency,
    /// Stiffness of the stop over that of the oscillator.
    Stiffness,
    /// The truncation orders.
    Orders,
    /// Scales of the parameters.
    Scale,
    /// Number format of the coefficients.
    Coefficients,
}

/// Number format in which a map's coefficients are stored and its contact is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coefficients {
    /// Rounded to single precision, computed in double.
    Single,
    /// Double precision.
    #[default]
    Double,
    /// Double-double.
    DoubleDouble,
}

/// One case of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExtremeRow {
    /// Quantity taken to its extreme.
    pub axis: ExtremeAxis,
    /// Value of that quantity.
    pub value: f64,
    /// The scene.
    pub scene: String,
    /// Truncation orders.
    pub orders: MapOrders,
    /// Depth `y²` of the point measured.
    pub depth: f64,
    /// Number format of the coefficients.
    pub coefficients: Coefficients,
    /// Outcome.
    pub outcome: ExtremeOutcome,
}

/// Outcome of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ExtremeOutcome {
    /// A map was made; its accuracy was measured.
    Measured(Measured),
    /// No map was made.
    Refused {
        /// Stage that failed: `scene`, `orbit`, `expansion` or `simulation`.
        stage: String,
        /// Message.
        message: String,
    },
}

/// Decimal digits, `−log10` of a relative error; `None` without a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Digits of the grazing value of the adjusted parameter, against its closed form.
    pub grazing: Option<f64>,
    /// Digits of the contact's correction `D(x) − x`, against a closed form or double-double
    /// flights.
    pub contact: f64,
    /// Digits of that reference itself.
    pub contact_truth: f64,
    /// Digits of the map, relative to `P − P_smooth`, against direct simulation in double-double.
    pub map: Option<f64>,
    /// Digits of that reference itself.
    pub map_truth: f64,
    /// Digits left by the truncation of the contact, as predicted by its series in `y`; all digits
    /// if the series terminates.
    pub truncation: f64,
    /// Digits of the numbers used, less the [`LostDigits`](grazemap::expansion::LostDigits) of
    /// the contact.
    pub rounding: f64,
    /// Digits left by the rounding of the legs, relative to the kick: rounding is relative to the
    /// image, which may be much larger.
    pub leg_rounding: f64,
    /// Digits left by the truncation of the legs: the effect of their last degree on the image,
    /// relative to the kick.
    pub leg_truncation: f64,
}

impl Measured {
    /// Digits of the contact that its estimates promise.
    pub fn promised(&self) -> f64 {
        self.truncation.min(self.rounding).max(0.0)
    }

    /// Digits of the map that its estimates promise.
    pub fn promised_of_map(&self) -> f64 {
        self.promised().min(self.leg_rounding).min(self.leg_truncation).max(0.0)
    }

    /// Whether a measurement falls short of its promise, as far as the reference can tell.
    pub fn is_silent_loss(&self) -> bool {
        let short = |digits: f64, promised: f64, truth: f64| {
            let told = promised.min(truth);
            told >= SLACK && (digits.is_nan() || digits < told - SLACK)
        };
        let of_map = |digits| short(digits, self.promised_of_map(), self.map_truth);
        short(self.contact, self.promised(), self.contact_truth) || self.map.is_some_and(of_map)
    }
}
