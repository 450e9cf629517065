//! The rows of the study, as plain data.

use serde::Serialize;

use crate::expansion::MapOrders;

/// Decimal digits by which a measured accuracy may fall short of its estimate: both are orders of
/// magnitude.
const SLACK: f64 = 1.0;

/// What is taken to its end.
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
    /// The numbers the coefficients are kept in.
    Coefficients,
}

impl ExtremeAxis {
    /// All axes, in the order of the study.
    pub const ALL: [Self; 11] = [
        Self::Depth,
        Self::Restitution,
        Self::Damping,
        Self::Resonance,
        Self::NormalAcceleration,
        Self::Multiplier,
        Self::Frequency,
        Self::Stiffness,
        Self::Orders,
        Self::Scale,
        Self::Coefficients,
    ];

    /// What is varied, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Depth => "depth y²",
            Self::Restitution => "restitution r",
            Self::Damping => "damping zeta",
            Self::Resonance => "resonance, omega - 1",
            Self::NormalAcceleration => "h'' over its usual size",
            Self::Multiplier => "double multiplier 1, omega - 1/2",
            Self::Frequency => "frequency omega",
            Self::Stiffness => "stiffness ratio k2/k1",
            Self::Orders => "orders N = W",
            Self::Scale => "scale of lengths",
            Self::Coefficients => "bits of the coefficients",
        }
    }

    /// A name for files.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Restitution => "restitution",
            Self::Damping => "damping",
            Self::Resonance => "resonance",
            Self::NormalAcceleration => "normal-acceleration",
            Self::Multiplier => "multiplier",
            Self::Frequency => "frequency",
            Self::Stiffness => "stiffness",
            Self::Orders => "orders",
            Self::Scale => "scale",
            Self::Coefficients => "coefficients",
        }
    }
}

/// The numbers in which a map's coefficients are kept and its contact is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coefficients {
    /// Rounded to single precision, computed with in double.
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
    /// What is taken to its end.
    pub axis: ExtremeAxis,
    /// How far.
    pub value: f64,
    /// The scene.
    pub scene: String,
    /// Truncation orders.
    pub orders: MapOrders,
    /// Depth `y²` of the point measured at.
    pub depth: f64,
    /// Numbers of the coefficients.
    pub coefficients: Coefficients,
    /// What came of it.
    pub outcome: ExtremeOutcome,
}

/// What came of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ExtremeOutcome {
    /// A map, and how good it is.
    Measured(Measured),
    /// None, and what was said.
    Refused {
        /// Where: `scene`, `orbit`, `expansion` or `simulation`.
        stage: String,
        /// The message.
        message: String,
    },
}

/// Decimal digits, `−log10` of a relative error; `None` where there is nothing to compare with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Of the grazing value of the adjusted parameter, against its closed form.
    pub grazing: Option<f64>,
    /// Of the contact's correction `D(x) − x`, against a closed form or double-double flights.
    pub contact: f64,
    /// The digits of that truth itself.
    pub contact_truth: f64,
    /// Of the map, relative to `P − P_smooth`, against direct simulation in double-double.
    pub map: Option<f64>,
    /// The digits of that truth itself.
    pub map_truth: f64,
    /// Digits that the truncation of the contact leaves, as predicted by its series in `y`; all
    /// where the series ends.
    pub truncation: f64,
    /// Digits of the numbers used, less [`LostDigits`](crate::expansion::LostDigits) of the
    /// contact.
    pub rounding: f64,
    /// The same of the legs, over the kick: rounding is relative to the image, which may be much
    /// larger.
    pub leg_rounding: f64,
    /// Digits that cutting the legs leaves: what their last degree does to the image, over the
    /// kick.
    pub leg_truncation: f64,
}

impl Measured {
    /// Digits of the contact that its estimates promise.
    pub fn promised(&self) -> f64 {
        self.truncation.min(self.rounding).max(0.0)
    }

    /// Digits of the map that its estimates promise.
    pub fn promised_of_map(&self) -> f64 {
        self.promised()
            .min(self.leg_rounding)
            .min(self.leg_truncation)
            .max(0.0)
    }

    /// Whether a measurement falls short of what was promised, as far as the truth can tell.
    pub fn is_silent_loss(&self) -> bool {
        let short = |digits: f64, promised: f64, truth: f64| {
            let told = promised.min(truth);
            told >= SLACK && (digits.is_nan() || digits < told - SLACK)
        };
        let of_map = |digits| short(digits, self.promised_of_map(), self.map_truth);
        short(self.contact, self.promised(), self.contact_truth) || self.map.is_some_and(of_map)
    }
}

/// The study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExtremesStudy {
    /// One row per case.
    pub rows: Vec<ExtremeRow>,
}

impl ExtremesStudy {
    /// The rows whose measured digits fall short of the estimates that stand with the expansion.
    pub fn silent_losses(&self) -> impl Iterator<Item = &ExtremeRow> {
        let silent = |row: &&ExtremeRow| match &row.outcome {
            ExtremeOutcome::Measured(measured) => measured.is_silent_loss(),
            ExtremeOutcome::Refused { .. } => false,
        };
        self.rows.iter().filter(silent)
    }
}
