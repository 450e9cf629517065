//! Linear oscillator with a stop, by its exact flight between impacts; independent of the
//! simulator.

use std::f64::consts::TAU;

/// Oscillator `x'' + 2 ζ x' + x = α cos θ`, `θ' = ω`, with a stop at `δ` and restitution `r`, by
/// its solution in closed form: `x = A cos θ + B sin θ + e^{-ζ t} (C cos ν t + D sin ν t)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Oscillator {
    pub(crate) zeta: f64,
    pub(crate) alpha: f64,
    pub(crate) omega: f64,
    pub(crate) stop: f64,
    pub(crate) r: f64,
}

/// State: position, velocity, phase.
pub(crate) type Motion = [f64; 3];

/// Speed below which a chatter counts as finished: the rest of it lasts about as short a time.
pub(crate) const SLOW: f64 = 1e-5;

impl Oscillator {
    /// State after a time, without the stop.
    pub(crate) fn flown(&self, [x, v, theta]: Motion, time: f64) -> Motion {
        let Self { zeta, alpha, omega, .. } = *self;
        let (stiff, damped) = (1.0 - omega * omega, 2.0 * zeta * omega);
        let scale = alpha / (stiff * stiff + damped * damped);
        let (a, b) = (scale * stiff, scale * damped);
        let forced = |phase: f64| {
            let (sin, cos) = phase.sin_cos();
            [a * cos + b * sin, omega * (b * cos - a * sin)]
        };
        let nu = (1.0 - zeta * zeta).sqrt();
        let [own, speed] = forced(theta);
        let (c, d) = (x - own, (v - speed + zeta * (x - own)) / nu);
        let ((sin, cos), decay) = ((nu * time).sin_cos(), (-zeta * time).exp());
        let [own, speed] = forced(theta + omega * time);
        let free = decay * (c * cos + d * sin);
        let slope = decay * nu * (d * cos - c * sin) - zeta * free;
        [own + free, speed + slope, theta + omega * time]
    }

    /// Time and state of the next impact within a time. Maxima of the position between samples are
    /// checked too, so that no dip is missed.
    pub(crate) fn impact(&self, from: Motion, within: f64) -> Option<(f64, Motion)> {
        let step = (TAU / self.omega).min(TAU) / 60.0;
        let beyond = |time: f64| self.flown(from, time)[0] > self.stop;
        let bisected = |mut low: f64, mut high: f64, above: &dyn Fn(f64) -> bool| {
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if above(middle) { high = middle } else { low = middle }
            }
            high
        };
        let (mut before, mut at) = (0.0, step.min(within));
        loop {
            let [start, end] = [before, at].map(|time| self.flown(from, time));
            // From the stop itself the first step begins below it.
            let top = (start[1] > 0.0 && end[1] < 0.0)
                .then(|| bisected(before, at, &|time| self.flown(from, time)[1] < 0.0));
            let reached = top.filter(|&top| beyond(top)).or(beyond(at).then_some(at));
            if let Some(reached) = reached {
                let time = bisected(before, reached, &beyond);
                return Some((time, self.flown(from, time)));
            }
            if at >= within {
                return None;
            }
            (before, at) = (at, (at + step).min(within));
        }
    }

    /// State after a time, with the phases and speeds of the impacts on the way.
    pub(crate) fn simulated(&self, mut state: Motion, time: f64) -> (Motion, Vec<[f64; 2]>) {
        let (mut impacts, mut rest) = (Vec::new(), time);
        loop {
            let held = self.held(state).min(rest);
            if held > 0.0 {
                state = [self.stop, 0.0, state[2] + self.omega * held];
                rest -= held;
            }
            let Some((at, [_, speed, theta])) = self.impact(state, rest) else { break };
            impacts.push([theta, speed]);
            state = [self.stop, -self.r * speed, theta];
            rest -= at;
        }
        (self.flown(state, rest), impacts)
    }

    /// Time for which the force holds a state that rests on the stop or is at the end of a chatter.
    fn held(&self, [x, v, theta]: Motion) -> f64 {
        let presses = self.alpha * theta.cos() > self.stop;
        if x != self.stop || v.abs() > SLOW || !presses {
            return 0.0;
        }
        ((self.stop / self.alpha).acos() - theta).rem_euclid(TAU) / self.omega
    }

    /// Attractor that a state leads to: hits, forcing periods, and the impacts of one period;
    /// `None` without a period of up to eight.
    pub(crate) fn attractor(
        &self,
        start: Motion,
        transient: usize,
    ) -> Option<(usize, usize, Vec<[f64; 2]>)> {
        let period = TAU / self.omega;
        let (mut state, _) = self.simulated(start, transient as f64 * period);
        // Away from an impact, so that none falls on the border of a period.
        let (_, impacts) = self.simulated(state, period);
        if let Some([theta, _]) = impacts.first() {
            let lead = (theta - state[2]) / self.omega;
            state = self.simulated(state, 0.5 * lead.max(1e-3)).0;
        }
        let from = state;
        let mut met = Vec::new();
        for periods in 1..=8 {
            let (next, impacts) = self.simulated(state, period);
            met.extend(impacts);
            state = next;
            let near = |place: usize| (state[place] - from[place]).abs() < 1e-7;
            if near(0) && near(1) {
                return Some((met.len(), periods, met));
            }
        }
        None
    }

    /// Acceleration in free flight.
    fn acceleration(&self, [x, v, theta]: Motion) -> f64 {
        self.alpha * theta.cos() - 2.0 * self.zeta * v - x
    }

    /// Derivatives of the state after a free flight by initial position and velocity, row by row.
    fn spread(&self, time: f64) -> [f64; 4] {
        let nu = (1.0 - self.zeta * self.zeta).sqrt();
        let ((sin, cos), decay) = ((nu * time).sin_cos(), (-self.zeta * time).exp());
        let (sin, cos) = (decay * sin / nu, decay * cos);
        [cos + self.zeta * sin, sin, -sin, cos - self.zeta * sin]
    }

    /// Trace and determinant of a periodic orbit that begins at an impact, its closing error, and
    /// its impacts.
    ///
    /// Flight between impacts spreads as `exp(A t)`. At an impact with the accelerations `a⁻`, `a⁺`
    /// before and after it `δx⁺ = −r δx`, `δv⁺ = −r δv + (a⁺ + r a⁻) δx/v⁻`.
    pub(crate) fn periodic(&self, from: [f64; 2], time: f64) -> ([f64; 2], f64, Vec<[f64; 2]>) {
        let [first, met] = from;
        let product = |a: [f64; 4], b: [f64; 4]| {
            let entry =
                |row: usize, column: usize| a[2 * row] * b[column] + a[2 * row + 1] * b[2 + column];
            [entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1)]
        };
        let kick = |theta: f64, speed: f64| {
            let [before, after] =
                [speed, -self.r * speed].map(|v| self.acceleration([self.stop, v, theta]));
            [-self.r, 0.0, (after + self.r * before) / speed, -self.r]
        };
        let mut total = kick(first, met);
        let mut impacts = vec![from];
        let (mut state, mut rest) = ([self.stop, -self.r * met, first], time);
        // The last impact is the first one again, a rounding before or behind the end.
        let slack = 1e-9 * time;
        loop {
            let next = self.impact(state, rest + slack).filter(|(at, _)| *at < rest - slack);
            let Some((at, [_, speed, theta])) = next else { break };
            total = product(kick(theta, speed), product(self.spread(at), total));
            impacts.push([theta, speed]);
            state = [self.stop, -self.r * speed, theta];
            rest -= at;
        }
        let total = product(self.spread(rest), total);
        let [x, v, _] = self.flown(state, rest);
        let apart = (x - self.stop).abs().max((v - met).abs());
        ([total[0] + total[3], total[0] * total[3] - total[1] * total[2]], apart, impacts)
    }

    /// Number of maxima of the position in free flight.
    pub(crate) fn maxima(&self, from: Motion, time: f64) -> usize {
        let steps = 4000;
        let speed = |step: usize| self.flown(from, time * step as f64 / steps as f64)[1];
        (0..steps).filter(|&step| speed(step) > 0.0 && speed(step + 1) <= 0.0).count()
    }

    /// Forcing amplitude and phase at the impact, for an orbit with one impact of this speed in a
    /// whole number of forcing periods.
    pub(crate) fn one_impact(&self, speed: f64, time: f64) -> [f64; 2] {
        let [a, b, c, d] = self.spread(time);
        let (a, d) = (a - 1.0, d - 1.0);
        // The deviation from the forced motion comes back with (1 + r) v less of velocity.
        let determinant = a * d - b * c;
        let lost = (1.0 + self.r) * speed;
        let [apart, slower] = [-b * lost / determinant, a * lost / determinant];
        let (x, v) = (self.stop - apart, -self.r * speed - slower);
        let Self { zeta, omega, .. } = *self;
        let (stiff, damped) = (1.0 - omega * omega, 2.0 * zeta * omega);
        let quarter = -v / omega;
        // x = A cos θ + B sin θ with (A, B) = α (stiff, damped)/gain².
        let phase = quarter.atan2(x) + damped.atan2(stiff);
        [x.hypot(quarter) * stiff.hypot(damped), phase]
    }
}

/// Quasi-random numbers between two ends: a Kronecker sequence for each `place`.
pub(crate) fn drawn(number: usize, place: usize, [from, to]: [f64; 2]) -> f64 {
    let step = [0.754_877_666_2, 0.569_840_290_9, 0.430_159_709_0, 0.324_717_957_2][place];
    from + (to - from) * (0.5 + (number + 1) as f64 * step).fract()
}
