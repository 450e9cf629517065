//! Solution of the driven linear oscillator `x'' + 2ζ x' + x = α cos θ` with a rigid stop, without
//! a map or an integrator.
//!
//! Deviations are separate small numbers. The free flight through the deepest point is a Taylor
//! series whose derivatives obey `x^(n+2) = (α cos θ)^(n) − 2ζ x^(n+1) − x^(n)`. The kick of the
//! impact is carried back by the homogeneous equation. No large numbers are subtracted, so that all
//! digits are right at any depth.

use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

/// Number of derivatives of the free flight: `t^60/60!` is below the roundoff of double-double for
/// `t ≤ 4`.
const DERIVATIVES: usize = 60;
/// Number of Newton steps in time, each of which doubles the digits.
const NEWTON_STEPS: usize = 40;

/// The oscillator's parameters, at their grazing values.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearOscillator {
    zeta: Dd,
    omega: Dd,
    alpha: Dd,
    restitution: Dd,
    theta: Dd,
}

/// `α* = δ |1 − ω² + 2iζω|`.
pub(super) fn grazing_force(scene: &Scene) -> Option<Dd> {
    let value = |name: &str| {
        let found = scene.model.parameters.iter().find(|parameter| parameter.name == name);
        found.map(|parameter| parameter.value)
    };
    let (zeta, omega, delta) = (value("zeta")?, value("omega")?, value("delta")?);
    let real = (Dd::ONE - omega) * (Dd::ONE + omega);
    let imaginary = Dd::from(2.0) * zeta * omega;
    Some(delta * (real * real + imaginary * imaginary).sqrt())
}

impl LinearOscillator {
    /// Oscillator of the scene `linear` near its orbit.
    pub(super) fn new(scene: &Scene, orbit: &GrazingOrbit) -> Option<Self> {
        let value = |name: &str| {
            let place = scene.model.parameters.iter().position(|parameter| parameter.name == name);
            place.map(|place| orbit.parameters()[place])
        };
        Some(Self {
            zeta: value("zeta")?,
            omega: value("omega")?,
            alpha: value("alpha")?,
            restitution: value("r")?,
            theta: *orbit.grazing_point().state.last()?,
        })
    }

    /// Correction `D(x) − x` in `(x, theta)` at the section point `(depth, 0)`; the leading law is
    /// in `theta`.
    pub(super) fn correction(&self, delta: Dd, depth: Dd) -> [Dd; 2] {
        let flight = self.flight(delta + depth);
        let entry = entry_time(&flight, depth);
        let speed = value(&flight[1..], entry);
        // The kick (0, −(1 + r) v) is carried over the time −entry back to the section point by the
        // homogeneous flow.
        let kick = self.homogeneous(-(Dd::ONE + self.restitution) * speed);
        let (kick_x, kick_v) = (value(&kick, -entry), value(&kick[1..], -entry));
        // Flight to v = 0, with the kick added to the free flight.
        let after = self.added(&flight, kick_x, kick_v);
        let time = zero_time(&after[1..]);
        let moved = value(&after, time) - after[0];
        [kick_x + moved, self.omega * time]
    }

    /// Derivatives of the free flight through the section point, at that point.
    fn flight(&self, x: Dd) -> Vec<Dd> {
        self.derivatives(x, Dd::ZERO, self.alpha)
    }

    /// Derivatives of the homogeneous motion from `(0, v)`.
    fn homogeneous(&self, v: Dd) -> Vec<Dd> {
        self.derivatives(Dd::ZERO, v, Dd::ZERO)
    }

    fn added(&self, flight: &[Dd], x: Dd, v: Dd) -> Vec<Dd> {
        let kick = self.derivatives(x, v, Dd::ZERO);
        flight.iter().zip(&kick).map(|(&a, &b)| a + b).collect()
    }

    fn derivatives(&self, x: Dd, v: Dd, alpha: Dd) -> Vec<Dd> {
        let (sine, cosine) = self.theta.sin_cos();
        let mut force = [cosine, -sine, -cosine, sine].map(|value| value * alpha);
        let mut all = vec![x, v];
        for n in 0..DERIVATIVES {
            let next = force[n % 4] - Dd::from(2.0) * self.zeta * all[n + 1] - all[n];
            all.push(next);
            force = force.map(|value| value * self.omega);
        }
        all
    }
}

/// `Σ c_n t^n / n!`.
fn value(derivatives: &[Dd], time: Dd) -> Dd {
    let terms = derivatives.iter().enumerate().rev();
    terms.fold(Dd::ZERO, |sum, (n, &derivative)| derivative + sum * time / Dd::from((n + 1) as f64))
}

/// Time before the deepest point at which the flight meets the stop: `Σ_{n≥2} x^(n) t^n/n! =
/// −depth`.
fn entry_time(flight: &[Dd], depth: Dd) -> Dd {
    let mut rise = flight.to_vec();
    (rise[0], rise[1]) = (Dd::ZERO, Dd::ZERO);
    let start = -(Dd::from(2.0) * depth / -flight[2]).sqrt();
    let newton = |time: Dd, _| time - (value(&rise, time) + depth) / value(&rise[1..], time);
    (0..NEWTON_STEPS).fold(start, newton)
}

/// Zero of a function of time, near 0.
fn zero_time(derivatives: &[Dd]) -> Dd {
    let newton = |time: Dd, _| time - value(derivatives, time) / value(&derivatives[1..], time);
    (0..NEWTON_STEPS).fold(Dd::ZERO, newton)
}
