//! Errors of two maps of a compliant contact: the truncated series in `y`, and the rigid stop with
//! `r = 1`.

use grazemap::expansion::DepthSeries;
use grazemap::numeric::{Dd, Scalar};
use grazemap_studies::soft_to_rigid::direct::{DirectJump, Jump};
use grazemap_studies::soft_to_rigid::family::{Family, Stop};

/// Twice the ratio of natural to forcing frequency, in every measurement.
pub(crate) const M: &str = "2.4";
/// Highest power of `y` in the series.
const ORDER: u32 = 24;
/// Number of bisections of a bracket of `log y`: to a hundred-thousandth of a decade.
const HALVINGS: usize = 22;
/// Largest depth variable: the free motion turns back well within its period.
pub(crate) const DEEPEST: f64 = 0.3;

/// Compliant stop of some stiffness, with its series and its rigid limit.
pub(crate) struct Measured<'a> {
    pub(crate) family: Family,
    pub(crate) stiffness: f64,
    pub(crate) stop: Stop,
    pub(crate) direct: DirectJump,
    /// Correction of `v` and `w` at zero net time, by powers of `y`.
    pub(crate) series: DepthSeries,
    rigid: &'a DirectJump,
}

impl<'a> Measured<'a> {
    pub(crate) fn new(family: Family, decade: i32, rigid: &'a DirectJump) -> Self {
        let stop = family.stop(&format!("1e{decade}"), M);
        let series = stop.expander().depth_series(0, ORDER).expect("a release");
        Self { family, stiffness: 10f64.powi(decade), direct: stop.direct(), series, stop, rigid }
    }

    /// Value of `y` at which the contact turns stiff.
    pub(crate) fn turn(&self) -> f64 {
        self.family.turn(self.stop.acceleration(), self.stiffness)
    }

    /// Radius in `y` of the uniform law.
    pub(crate) fn law_radius(&self) -> f64 {
        self.family.radius(self.stop.acceleration(), self.stiffness)
    }

    /// Jumps of the compliant and of the rigid stop.
    pub(crate) fn jumps(&self, y: f64) -> (Jump, Jump) {
        (self.direct.at(Dd::from(y)), self.rigid.at(Dd::from(y)))
    }

    /// Error of the series truncated at a weight, relative to the jump of the velocity.
    pub(crate) fn series_error(&self, weight: u32, y: f64) -> f64 {
        let jump = self.direct.at(Dd::from(y)).change[1];
        let terms = self.series.coefficients[1][..=weight as usize].iter().rev();
        let cut = terms.fold(Dd::ZERO, |sum, &coefficient| sum * Dd::from(y) + coefficient);
        ((cut - jump) / jump).magnitude()
    }

    /// Error of the rigid stop as a model of the compliant one, relative to the jump of the
    /// velocity.
    pub(crate) fn rigid_error(&self, y: f64) -> f64 {
        let (soft, rigid) = self.jumps(y);
        ((rigid.change[1] - soft.change[1]) / soft.change[1]).magnitude()
    }

    /// Largest `y` up to which the series truncated at a weight is within a tolerance.
    pub(crate) fn series_reach(&self, weight: u32, tolerance: f64) -> f64 {
        let radius = self.law_radius();
        let ends = (1e-7 * radius, 3.0 * radius);
        boundary(ends, |y| self.series_error(weight, y) <= tolerance)
    }

    /// Smallest `y` from which the rigid stop is within a tolerance; NaN if it is not at
    /// [`DEEPEST`].
    pub(crate) fn rigid_reach(&self, tolerance: f64) -> f64 {
        if self.rigid_error(DEEPEST) > tolerance {
            return f64::NAN;
        }
        boundary((0.1 * self.turn(), DEEPEST), |y| self.rigid_error(y) > tolerance)
    }

    /// Value of `y` at which the series truncated at a weight and the rigid stop have equal errors.
    pub(crate) fn crossing(&self, weight: u32) -> f64 {
        let ends = (0.1 * self.law_radius(), 30.0 * self.turn());
        boundary(ends, |y| self.series_error(weight, y) <= self.rigid_error(y))
    }
}

/// Point at which a condition that holds at the lower end fails, by bisection of the logarithm.
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
