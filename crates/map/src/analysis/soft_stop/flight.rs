//! Isolated impact with a soft stop, in units of its own: Taylor steps from the surface back to it.

use crate::numeric::Bracket;
use crate::numeric::polynomial::evaluate;

/// Terms of a Taylor series.
const TERMS: usize = 31;

/// Largest last term of a series over a step, in units of the speed of the impact.
const LAST_TERM: f64 = 1e-19;

/// Change of the speed, relative, that the spring makes over the depth where steps begin and end.
const UNSPRUNG: f64 = 1e-17;

/// Longest step, in times in which the speed would cover the depth: the force is not smooth at the
/// surface.
const REACH: f64 = 0.6;

/// Most steps of an impact. One that takes more does not come back.
const MOST_STEPS: usize = 4000;

/// Force of a stop in units of an impact: `x^p (1 + w x') + g x'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ScaledForce {
    /// Exponent `p` of the spring.
    pub(super) exponent: f64,
    /// Damper `w` that grows with the spring's force.
    pub(super) with_depth: f64,
    /// Linear damper `g`.
    pub(super) viscous: f64,
    /// Whether the stop lets go where its force is zero, and not at the surface.
    pub(super) lets_go: bool,
}

/// Impact in units of its speed and of the length and time that the spring makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ScaledImpact {
    /// Speed at the end of the contact.
    pub(super) restitution: f64,
    /// Duration of the contact.
    pub(super) time: f64,
    /// Largest depth.
    pub(super) depth: f64,
}

/// Taylor coefficients of a motion about one of its points, in a unit of time in which the depth
/// changes by at most itself.
struct ImpactSeries {
    unit: f64,
    depth: [f64; TERMS + 1],
    speed: [f64; TERMS],
    force: [f64; TERMS],
}

impl ScaledForce {
    /// Impact of a unit mass at unit speed; `None` if the mass does not come back.
    ///
    /// `x'' = −x^p (1 + w x') − g x'` from `x = 0`, `x' = 1`. The motion is analytic but for its
    /// ends. Up to a depth at which the spring is below rounding the damper alone acts, in closed
    /// form; from there Taylor steps grow and shrink in proportion to the depth.
    pub(super) fn impact(&self) -> Option<ScaledImpact> {
        let start = self.unsprung_depth();
        // With the damper alone `x' + g x` is constant.
        let (mut x, mut v) = (start, 1.0 - self.viscous * start);
        let mut time = self.unsprung_time(start, 1.0);
        let mut deepest = None;
        for _ in 0..MOST_STEPS {
            let series = self.series(x, v);
            let step = series.step();
            let (next, _) = evaluate(&series.depth, step);
            let (speed, _) = evaluate(&series.speed, step);
            if speed <= 0.0 && deepest.is_none() {
                let turn = root(&series.speed, step)?;
                deepest = Some(evaluate(&series.depth, turn).0);
            }
            if self.lets_go && speed < 0.0 && evaluate(&series.force, step).0 <= 0.0 {
                let end = root(&series.force, step)?;
                let restitution = -evaluate(&series.speed, end).0;
                let time = time + series.unit * end;
                return Some(ScaledImpact { restitution, time, depth: deepest? });
            }
            (x, v, time) = (next, speed, time + series.unit * step);
            if v <= 0.0 && x <= start {
                let speed = v + self.viscous * x;
                let time = time + self.unsprung_time(x, speed);
                let impact = ScaledImpact { restitution: -speed, time, depth: deepest? };
                return (speed < 0.0).then_some(impact);
            }
        }
        None
    }

    /// Depth up to which the spring changes the speed by less than its rounding.
    fn unsprung_depth(&self) -> f64 {
        let by_spring = (UNSPRUNG / (1.0 + self.with_depth)).powf(1.0 / (1.0 + self.exponent));
        by_spring.min(0.1 / self.viscous)
    }

    /// Time from or to the surface, passed at a speed of either sign, by the damper alone.
    fn unsprung_time(&self, depth: f64, speed: f64) -> f64 {
        match self.viscous == 0.0 {
            true => (depth / speed).abs(),
            false => ((-self.viscous * depth / speed).ln_1p() / self.viscous).abs(),
        }
    }

    /// Taylor series of the motion from a depth and a speed.
    fn series(&self, x: f64, v: f64) -> ImpactSeries {
        let mut power = [0.0; TERMS];
        let mut series = ImpactSeries {
            unit: (x / v.abs()).min(1.0),
            depth: [0.0; TERMS + 1],
            speed: [0.0; TERMS],
            force: [0.0; TERMS],
        };
        let ImpactSeries { unit, depth, speed, force } = &mut series;
        (depth[0], speed[0], power[0]) = (x, v, x.powf(self.exponent));
        for k in 0..TERMS {
            depth[k + 1] = *unit * speed[k] / (k + 1) as f64;
            if k > 0 {
                // x (x^p)' = p x^p x'
                let term = |j: usize| {
                    (self.exponent * j as f64 - (k - j) as f64) * depth[j] * power[k - j]
                };
                power[k] = (1..=k).map(term).sum::<f64>() / (k as f64 * x);
            }
            let product = (0..=k).map(|j| power[j] * speed[k - j]).sum::<f64>();
            force[k] = power[k] + self.with_depth * product + self.viscous * speed[k];
            if k + 1 < TERMS {
                speed[k + 1] = -*unit * force[k] / (k + 1) as f64;
            }
        }
        series
    }
}

impl ImpactSeries {
    /// Length of a step that the series resolves to rounding, and that stays inside the stop.
    fn step(&self) -> f64 {
        let last = [TERMS - 2, TERMS - 1];
        let last = last.map(|k| (LAST_TERM / self.speed[k].abs()).powf(1.0 / k as f64));
        let reach = REACH * self.depth[0] / (self.unit * self.speed[0].abs());
        let mut step = last[0].min(last[1]).min(reach);
        while evaluate(&self.depth, step).0 < (1.0 - REACH) * self.depth[0] {
            step *= 0.5;
        }
        step
    }
}

/// Zero of a series that changes sign over a step.
fn root(series: &[f64], step: f64) -> Option<f64> {
    let bracket = Bracket::new(0.0, step, series[0], evaluate(series, step).0).ok()?;
    bracket.newton(0.0, |time| evaluate(series, time)).root()
}
