//! Forces composed at random of functions with narrow features, against Gauss' rule: what the
//! lists of [`narrow_features`](super::narrow_features) do not name.

use std::f64::consts::TAU;

use crate::narrow_features::{flown_freely, flown_in_contact};
use crate::quadrature::even_integral;
use crate::support::synthetic::Numbers;

/// A force of the phase: its text and its values.
struct Composed {
    text: String,
    value: Box<dyn Fn(f64) -> f64>,
    /// Largest relative slope: the inverse of the width of the narrowest feature.
    sharpness: f64,
}

/// Random choices that depend on a number alone.
struct Draws(Numbers);

impl Draws {
    /// A number from 0 to 1.
    fn share(&mut self) -> f64 {
        0.5 * (self.0.next() + 1.0)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.share() * count as f64) as usize
    }

    /// A number between two positive ones, evenly in its logarithm, with three digits.
    fn scale(&mut self, least: f64, most: f64) -> f64 {
        let value = least * (most / least).powf(self.share());
        format!("{value:.2e}").parse().expect("a number")
    }

    /// A wave of a size: `A (sin(n θ + φ) − c)`, with a level that it crosses, touches or misses.
    fn wave(&mut self) -> Composed {
        let (size, turns) = (self.scale(1.0, 300.0), 1.0 + self.below(3) as f64);
        let shift = self.scale(0.1, 6.0);
        let level = [0.0, 0.31, -0.77, 1.0, -1.0, 1.02, -1.3][self.below(7)];
        Composed {
            text: format!("({size}*(sin({turns}*theta + {shift}) - ({level})))"),
            value: Box::new(move |t| size * ((turns * t + shift).sin() - level)),
            sharpness: size * turns,
        }
    }

    /// A function with a narrow feature of an argument of its own.
    fn feature(&mut self) -> Composed {
        match self.below(12) {
            0 => {
                let power = 2 + self.below(100) as i32;
                let shift = self.scale(0.1, 6.0);
                Composed {
                    text: format!("(0.5 + 0.5*cos(theta + {shift}))^{power}"),
                    value: Box::new(move |t| (0.5 + 0.5 * (t + shift).cos()).powi(power)),
                    sharpness: f64::from(power),
                }
            }
            1 => {
                let (sharpness, shift) = (self.scale(1.0, 1e4), self.scale(0.1, 6.0));
                Composed {
                    text: format!("exp(-{sharpness}*(1 - cos(theta + {shift})))"),
                    value: Box::new(move |t| (-sharpness * (1.0 - (t + shift).cos())).exp()),
                    sharpness: sharpness.sqrt(),
                }
            }
            kind => {
                let argument = self.wave();
                applied(kind - 2, argument)
            }
        }
    }

    /// One or two features: a product, a sum, a quotient, or a function of a function.
    fn force(&mut self) -> Composed {
        let (a, form) = (self.feature(), self.below(5));
        if form < 2 {
            let factor = self.scale(0.5, 20.0);
            let inner = Composed {
                text: format!("{factor}*({})", a.text),
                value: Box::new(move |t| factor * (a.value)(t)),
                sharpness: factor * a.sharpness,
            };
            return applied(self.below(10), inner);
        }
        let b = self.feature();
        let sharpness = a.sharpness + b.sharpness;
        let (x, y) = (a.value, b.value);
        let (text, value): (_, Box<dyn Fn(f64) -> f64>) = match form {
            2 => (format!("({})*({})", a.text, b.text), Box::new(move |t| x(t) * y(t))),
            3 => (format!("{} - {}", a.text, b.text), Box::new(move |t| x(t) - y(t))),
            _ => (
                format!("({})/(1 + ({})^2)", a.text, b.text),
                Box::new(move |t| x(t) / (1.0 + y(t) * y(t))),
            ),
        };
        Composed { text, value, sharpness }
    }
}

/// A bounded function of an argument.
fn applied(kind: usize, argument: Composed) -> Composed {
    let (form, function): (&str, fn(f64) -> f64) = match kind {
        0 => ("tanh(A)", f64::tanh),
        1 => ("1/(1 + A^2)", |a| 1.0 / (1.0 + a * a)),
        2 => ("exp(-A^2)", |a| (-a * a).exp()),
        3 => ("1/cosh(A)", |a| a.cosh().recip()),
        4 => ("1/(1 + exp(A))", |a| (1.0 + a.exp()).recip()),
        5 => ("atan(A)", f64::atan),
        6 => ("1/sqrt(0.1 + A^2)", |a| (0.1 + a * a).sqrt().recip()),
        7 => ("A/(1 + A^4)", |a| a / (1.0 + a.powi(4))),
        8 => ("log(1 + A^2)/9", |a| (a * a).ln_1p() / 9.0),
        _ => ("sin(2*tanh(A))", |a| (2.0 * a.tanh()).sin()),
    };
    let value = argument.value;
    Composed {
        text: form.replace('A', &format!("({})", argument.text)),
        value: Box::new(move |t| function(value(t))),
        sharpness: argument.sharpness,
    }
}

/// Integrals of many forces over a period and a half, in free flight and in a contact.
#[test]
fn integrals_over_forces_composed_at_random_are_those_of_gauss_rule() {
    let (from, to) = (0.3, 0.3 + 1.5 * TAU);
    let count = std::env::var("COMPOSED_FORCES").map_or(150, |n| n.parse().expect("a number"));
    for number in 0..count {
        let force = Draws(Numbers::new(number)).force();
        let exact = even_integral(&force.value, [from, to], 40_000);
        let coarse = even_integral(&force.value, [from, to], 20_000);
        let size = even_integral(|t| (force.value)(t).abs(), [from, to], 20_000);
        for (name, found) in [
            ("free", flown_freely(&force.text, from, to - from)),
            ("contact", flown_in_contact(&force.text, from, to - from)),
        ] {
            let error = (found - exact).abs();
            let most = 4.0 * (exact - coarse).abs()
                + (1e-13 + 20.0 * f64::EPSILON * force.sharpness) * (1.0 + size);
            assert!(error < most, "{number}: {} {name}: {error:e} of {exact}", force.text);
        }
    }
}
