//! A contact force that is a power of the depth which is not whole (Hertz), integrated on its own:
//! the leading law in closed form of docs/mathematics/contact-laws.md.
//!
//! This way uses neither an expansion, which has that law too (`tests/maps/power_laws.rs`), nor the
//! simulator.

/// The linear oscillator of the scene `soft_a`: damping, frequency of the forcing, stiffness of
/// the stop.
const DAMPING: f64 = 0.03;
const STIFFNESS: f64 = 33.0;
/// Steps of the integration over one contact: its own error is 1e-9.
const STEPS: usize = 200_000;

/// `q`, `q'` of `u = σ + y² q(s)`, `t = y s`, about the grazing phase.
type Scaled = [f64; 2];

struct Oscillator {
    frequency: f64,
    amplitude: f64,
    phase: f64,
}

impl Oscillator {
    /// Grazes `u = 1` at time 0.
    fn grazing() -> Self {
        let frequency = 2.0 * (1.0_f64 - 0.015 * 0.015).sqrt() / 2.4;
        let (real, imaginary) = (1.0 - frequency * frequency, DAMPING * frequency);
        Self { frequency, amplitude: real.hypot(imaginary), phase: imaginary.atan2(real) }
    }

    /// `d/ds (q, q')`, with the contact force `−k (u − σ)^exponent` where it acts.
    fn slope(&self, s: f64, [q, slope]: Scaled, y: f64, contact: Option<f64>) -> Scaled {
        let drive = self.amplitude * (self.phase + self.frequency * y * s).cos() - 1.0;
        let force = contact.map_or(0.0, |power| STIFFNESS * (y * y * q.max(0.0)).powf(power));
        [slope, drive - DAMPING * y * slope - y * y * q - force]
    }

    /// One step of the classical method of fourth order.
    fn step(&self, s: f64, at: Scaled, h: f64, y: f64, contact: Option<f64>) -> Scaled {
        let moved = |k: Scaled, share: f64| [at[0] + share * h * k[0], at[1] + share * h * k[1]];
        let a = self.slope(s, at, y, contact);
        let b = self.slope(s + 0.5 * h, moved(a, 0.5), y, contact);
        let c = self.slope(s + 0.5 * h, moved(b, 0.5), y, contact);
        let d = self.slope(s + h, moved(c, 1.0), y, contact);
        [0, 1].map(|i| at[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }

    /// Flies from a state to `q = 0` (`until_surface`) or for a time, and says when it was there.
    fn fly(
        &self,
        (mut s, mut at): (f64, Scaled),
        h: f64,
        y: f64,
        contact: Option<f64>,
    ) -> (f64, Scaled) {
        loop {
            let next = self.step(s, at, h, y, contact);
            if next[0] <= 0.0 {
                // The rest of the way to the surface by Newton's method on the length of the step.
                let mut rest = h * at[0] / (at[0] - next[0]);
                for _ in 0..8 {
                    let there = self.step(s, at, rest, y, contact);
                    rest -= there[0] / there[1];
                }
                return (s + rest, self.step(s, at, rest, y, contact));
            }
            (s, at) = (s + h, next);
        }
    }

    /// The jump of the velocity at zero net time of `(σ + y², 0)`, by integration.
    fn jump(&self, y: f64, power: f64) -> f64 {
        let h = 4.0 / STEPS as f64;
        let (entry, met) = self.fly((0.0, [1.0, 0.0]), -h, y, None);
        // The first step leaves the surface before its end can be looked for.
        let inside = (entry + h, self.step(entry, met, h, y, Some(power)));
        let (exit, left) = self.fly(inside, h, y, Some(power));
        let mut at = left;
        let steps = (exit.abs() / h).ceil();
        for k in 0..steps as usize {
            let s = exit * (1.0 - k as f64 / steps);
            at = self.step(s, at, -exit / steps, y, None);
        }
        y * at[1]
    }
}

/// `B(1/2, β + 1)` for half whole `β` by its recurrence `B(1/2, x + 1) = B(1/2, x) x/(x + 1/2)`.
fn beta_half(power: f64) -> f64 {
    let half = power.fract() != 0.0;
    let (mut x, mut value) = if half { (0.5, std::f64::consts::PI) } else { (1.0, 2.0) };
    while x < power + 1.0 {
        value *= x / (x + 0.5);
        x += 1.0;
    }
    value
}

/// `Δv = −k √(2/a) B(1/2, β + 1) y^{2β+1}`; what is left out begins two powers of `y` later (a
/// quarter at half `y`).
#[test]
fn jump_of_a_power_of_the_depth_tends_to_its_beta_function() {
    let oscillator = Oscillator::grazing();
    let acceleration = oscillator.frequency * oscillator.frequency;
    for power in [1.0, 1.5, 2.0, 2.5] {
        let law = -STIFFNESS * (2.0 / acceleration).sqrt() * beta_half(power);
        let ratio = |y: f64| oscillator.jump(y, power) / (law * y.powf(2.0 * power + 1.0)) - 1.0;
        let errors = [1e-1, 5e-2, 2.5e-2].map(ratio);
        println!(
            "power {power}: {law:.6}, measured over law minus 1 at y = 0.1, 0.05, 0.025: {errors:?}"
        );
        for pair in errors.windows(2) {
            assert!(pair[1].abs() < 0.4 * pair[0].abs(), "{power}: {pair:?}");
        }
        assert!(errors[2].abs() < 0.05, "{power}: {errors:?}");
    }
}
