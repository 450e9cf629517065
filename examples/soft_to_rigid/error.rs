//! How far two maps are from a compliant contact: the series in `y`, cut, and the rigid stop with
//! `r = 1`.

use grazemap::expansion::DepthSeries;
use grazemap::numeric::{Dd, Scalar};

use crate::direct::{DirectJump, Jump};
use crate::family::{Family, Stop};

/// Twice the natural frequency over that of the forcing, in every measurement.
pub(crate) const M: &str = "2.4";
/// Power of `y` to which series are known.
const ORDER: u32 = 24;
/// Halvings of a bracket of `log y`: a hundred-thousandth of a decade.
const HALVINGS: usize = 22;
/// Largest depth variable asked: the free motion has turned back well within its period.
pub(crate) const DEEPEST: f64 = 0.3;

/// A compliant stop of some stiffness, its series and its rigid limit.
pub(crate) struct Measured<'a> {
    pub(crate) family: Family,
    pub(crate) stiffness: f64,
    pub(crate) stop: Stop,
    pub(crate) direct: DirectJump,
    /// The correction of `v`, `w` at zero net time, by powers of `y`.
    pub(crate) series: DepthSeries,
    rigid: &'a DirectJump,
}

impl<'a> Measured<'a> {
    pub(crate) fn new(family: Family, decade: i32, rigid: &'a DirectJump) -> Self {
        let stop = family.stop(&format!("1e{decade}"), M);
        let series = stop.expander().depth_series(0, ORDER).expect("a release");
        Self { family, stiffness: 10f64.powi(decade), direct: stop.direct(), series, stop, rigid }
    }

    /// Where the contact turns stiff, in `y`.
    pub(crate) fn turn(&self) -> f64 {
        self.family.turn(self.stop.acceleration(), self.stiffness)
    }

    /// The radius in `y` of the uniform law.
    pub(crate) fn law_radius(&self) -> f64 {
        self.family.radius(self.stop.acceleration(), self.stiffness)
    }

    /// The jump of the compliant stop and that of the rigid one.
    pub(crate) fn jumps(&self, y: f64) -> (Jump, Jump) {
        (self.direct.at(Dd::from(y)), self.rigid.at(Dd::from(y)))
    }

    /// Error of the series cut at a weight, relative to the jump of the velocity.
    pub(crate) fn series_error(&self, weight: u32, y: f64) -> f64 {
        let jump = self.direct.at(Dd::from(y)).change[1];
        let terms = self.series.coefficients[1][..=weight as usize].iter().rev();
        let cut = terms.fold(Dd::ZERO, |sum, &coefficient| sum * Dd::from(y) + coefficient);
        ((cut - jump) / jump).magnitude()
    }

    /// Error of the rigid stop in the place of the compliant one, relative to the jump of the
    /// velocity.
    pub(crate) fn rigid_error(&self, y: f64) -> f64 {
        let (soft, rigid) = self.jumps(y);
        ((rigid.change[1] - soft.change[1]) / soft.change[1]).magnitude()
    }

    /// The largest `y` up to which the series cut at a weight is within a tolerance.
    pub(crate) fn series_reach(&self, weight: u32, tolerance: f64) -> f64 {
        let radius = self.law_radius();
        let ends = (1e-7 * radius, 3.0 * radius);
        boundary(ends, |y| self.series_error(weight, y) <= tolerance)
    }

    /// The smallest `y` from which the rigid stop is within a tolerance; NaN if it is not at
    /// [`DEEPEST`].
    pub(crate) fn rigid_reach(&self, tolerance: f64) -> f64 {
        if self.rigid_error(DEEPEST) > tolerance {
            return f64::NAN;
        }
        boundary((0.1 * self.turn(), DEEPEST), |y| self.rigid_error(y) > tolerance)
    }

    /// The `y` at which the series cut at a weight and the rigid stop are equally wrong.
    pub(crate) fn crossing(&self, weight: u32) -> f64 {
        let ends = (0.1 * self.law_radius(), 30.0 * self.turn());
        boundary(ends, |y| self.series_error(weight, y) <= self.rigid_error(y))
    }
}

/// Where a condition that holds at the lower end stops holding, by bisection of the logarithm.
fn boundary((low, high): (f64, f64), holds: impl Fn(f64) -> bool) -> f64 {
    let (mut good, mut bad) = (low.ln(), high.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if holds(middle.exp()) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good.exp()
}
