//! Cases: scenes of the catalogue with one number taken to its extreme.

use super::data::{Coefficients, ExtremeAxis};
use grazemap::expansion::MapOrders;

/// Orders, unless they are the axis.
const ORDERS: MapOrders = MapOrders::new(5, 8);

/// Depth `y²`, unless it is the axis.
const DEPTH: f64 = 1e-6;

/// Name of a scene whose graze can be made flat.
pub(super) const FLAT_TOP: &str = "flat_top";

/// Scene with overrides, a point and the orders of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtremeCase {
    /// Quantity taken to its extreme.
    pub axis: ExtremeAxis,
    /// Value of that quantity.
    pub value: f64,
    /// Name of the scene: one of the catalogue, or `flat_top`.
    pub scene: &'static str,
    /// Overrides of the scene.
    pub overrides: Vec<(String, String)>,
    /// Truncation orders.
    pub orders: MapOrders,
    /// Depth `y²` of the point measured; all other offsets are zero.
    pub depth: f64,
    /// Number format of the coefficients.
    pub coefficients: Coefficients,
}

impl ExtremeCase {
    fn new(axis: ExtremeAxis, value: f64, scene: &'static str) -> Self {
        Self {
            axis,
            value,
            scene,
            overrides: Vec::new(),
            orders: ORDERS,
            depth: DEPTH,
            coefficients: Coefficients::Double,
        }
    }

    fn with(mut self, key: &str, value: impl ToString) -> Self {
        self.overrides.push((key.to_owned(), value.to_string()));
        self
    }

    fn at_depth(self, depth: f64) -> Self {
        Self { depth, ..self }
    }

    fn cut_at(self, smooth_order: u32, contact_weight: u32) -> Self {
        let orders = MapOrders::new(smooth_order, contact_weight);
        Self { orders, ..self }
    }

    /// Linear oscillator with the closed form as the guess of its graze, to the digits of a double.
    fn linear(axis: ExtremeAxis, value: f64, damping: &str, frequency: &str, length: &str) -> Self {
        let read = |text: &str| text.parse().unwrap_or(f64::NAN);
        let (zeta, omega, delta): (f64, f64, f64) = (read(damping), read(frequency), read(length));
        let (real, imaginary) = (1.0 - omega * omega, 2.0 * zeta * omega);
        Self::new(axis, value, "linear")
            .with("zeta", damping)
            .with("omega", frequency)
            .with("delta", format!("{delta:e}"))
            .with("alpha", format!("{:e}", delta * real.hypot(imaginary)))
            .with("grazing.guess.x", format!("{delta:e}"))
            .with("grazing.guess.theta", format!("{:e}", imaginary.atan2(real)))
    }
}

/// All cases of the study.
pub fn extreme_cases() -> Vec<ExtremeCase> {
    let axes = [
        depths(),
        restitutions(),
        dampings(),
        resonances(),
        accelerations(),
        multipliers(),
        frequencies(),
        stiffnesses(),
        orders(),
        scales(),
        coefficients(),
    ];
    axes.into_iter().flatten().collect()
}

fn depths() -> Vec<ExtremeCase> {
    let decades = [-30, -24, -18, -12, -8, -6, -4, -3, -2, -1];
    let case = |scene| {
        move |&decade: &i32| {
            let depth = 10f64.powi(decade);
            ExtremeCase::new(ExtremeAxis::Depth, depth, scene).at_depth(depth)
        }
    };
    let scenes = ["linear", "soft_a", "soft_b", "soft_c", "mems"];
    scenes.iter().flat_map(|scene| decades.iter().map(case(scene))).collect()
}

fn restitutions() -> Vec<ExtremeCase> {
    let values = ["0", "1e-12", "0.5", "0.999999999999", "1"];
    let case = |text: &&str| {
        let value = text.parse().unwrap_or(f64::NAN);
        ExtremeCase::new(ExtremeAxis::Restitution, value, "linear").with("r", text)
    };
    values.iter().map(case).collect()
}

fn dampings() -> Vec<ExtremeCase> {
    let values = ["0", "1e-15", "1e-12", "1e-8", "1e-4", "0.05", "1", "2", "5"];
    let case = |text: &&str| {
        let value = text.parse().unwrap_or(f64::NAN);
        ExtremeCase::linear(ExtremeAxis::Damping, value, text, "1.8", "1")
    };
    values.iter().map(case).collect()
}

/// Cases near resonance: undamped, where the orbit exists only off resonance, and weakly damped.
fn resonances() -> Vec<ExtremeCase> {
    let distances = ["0.1", "1e-3", "1e-6", "1e-9", "1e-12", "0"];
    let case = |damping: &'static str| {
        move |distance: &&str| {
            let value: f64 = distance.parse().unwrap_or(f64::NAN);
            let frequency = format!("{:?}", 1.0 + value);
            ExtremeCase::linear(ExtremeAxis::Resonance, value, damping, &frequency, "1")
        }
    };
    let dampings = ["0", "1e-6", "0.05"];
    dampings.iter().flat_map(|damping| distances.iter().map(case(damping))).collect()
}

fn accelerations() -> Vec<ExtremeCase> {
    let ratios = [1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 0.0, -1e-4, -1e-2];
    let case = |depth: f64| {
        move |&ratio: &f64| {
            let harmonic = (ratio - 1.0) / 3.0;
            ExtremeCase::new(ExtremeAxis::NormalAcceleration, ratio, FLAT_TOP)
                .with("b", format!("{harmonic:?}"))
                .with("alpha", format!("{:?}", 1.0 - harmonic))
                .at_depth(depth)
        }
    };
    let depths = [1e-12, 1e-6];
    depths.iter().flat_map(|&depth| ratios.iter().map(case(depth))).collect()
}

/// Cases with multipliers near 1. Undamped and driven at half its frequency, the oscillator makes
/// two turns in a period: both multipliers are 1.
fn multipliers() -> Vec<ExtremeCase> {
    let distances = ["0.1", "1e-3", "1e-6", "1e-9", "1e-12", "0"];
    let case = |distance: &&str| {
        let value: f64 = distance.parse().unwrap_or(f64::NAN);
        let frequency = format!("{:?}", 0.5 + value);
        ExtremeCase::linear(ExtremeAxis::Multiplier, value, "0", &frequency, "1")
    };
    distances.iter().map(case).collect()
}

fn frequencies() -> Vec<ExtremeCase> {
    let values = ["0.05", "0.2", "1", "5", "20", "50"];
    let case = |text: &&str| {
        let value = text.parse().unwrap_or(f64::NAN);
        ExtremeCase::linear(ExtremeAxis::Frequency, value, "0.05", text, "1")
    };
    values.iter().map(case).collect()
}

fn stiffnesses() -> Vec<ExtremeCase> {
    let decades = [0, 2, 4, 6, 8];
    let case = |(scene, depth): (&'static str, f64)| {
        move |&decade: &i32| {
            let value = 10f64.powi(decade);
            ExtremeCase::new(ExtremeAxis::Stiffness, value, scene)
                .with("k2", format!("{value:e}"))
                .at_depth(depth)
        }
    };
    let scenes = [("soft_a", 1e-6), ("soft_a", 1e-12), ("soft_b", 1e-12), ("soft_c", 1e-12)];
    scenes.into_iter().flat_map(|scene| decades.iter().map(case(scene))).collect()
}

fn orders() -> Vec<ExtremeCase> {
    let orders = [1, 2, 5, 10, 16, 24, 30];
    let case = |(scene, depth): (&'static str, f64)| {
        move |&order: &u32| {
            ExtremeCase::new(ExtremeAxis::Orders, order.into(), scene)
                .with("expansion.active", "[]")
                .cut_at(order, order)
                .at_depth(depth)
        }
    };
    let scenes = [("linear", 1e-2), ("soft_a", 2e-3), ("soft_c", 1e-2)];
    scenes.into_iter().flat_map(|scene| orders.iter().map(case(scene))).collect()
}

/// Cases with lengths from 1e-15 to 1e15, at a frequency of 1.8.
fn scales() -> Vec<ExtremeCase> {
    let lengths = ["1e-15", "1e-9", "1e-3", "1", "1e3", "1e9", "1e15"];
    let case = |text: &&str| {
        let value: f64 = text.parse().unwrap_or(f64::NAN);
        ExtremeCase::linear(ExtremeAxis::Scale, value, "0.05", "1.8", text).at_depth(DEPTH * value)
    };
    lengths.iter().map(case).collect()
}

fn coefficients() -> Vec<ExtremeCase> {
    let kinds = [
        (Coefficients::Single, 24.0),
        (Coefficients::Double, 53.0),
        (Coefficients::DoubleDouble, 106.0),
    ];
    let case = |scene| {
        move |&(coefficients, bits): &(Coefficients, f64)| ExtremeCase {
            coefficients,
            ..ExtremeCase::new(ExtremeAxis::Coefficients, bits, scene)
                .with("expansion.active", "[]")
                .cut_at(5, 24)
        }
    };
    let scenes = ["linear", "soft_a", "mems"];
    scenes.iter().flat_map(|scene| kinds.iter().map(case(scene))).collect()
}
