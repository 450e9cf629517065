//! Speed against accuracy: the maps that no other one beats in both.

use serde::{Deserialize, Serialize};

use super::data::{DirectSummary, OrderResult};
use crate::expansion::MapOrders;
use crate::model::Shape;

/// One method on the front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// The map; `None` for direct simulation in double precision.
    pub map: Option<ParetoMap>,
    /// The method of direct simulation; `None` for a map.
    #[serde(default)]
    pub direct: Option<String>,
    /// Nanoseconds of one step, or of one return.
    pub step_ns: f64,
    /// Largest error on the window, against double-double.
    pub error: f64,
}

/// Which map a point of the front is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParetoMap {
    /// Its truncation orders.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Shape.
    pub shape: Shape,
}

/// The front, fastest first, direct simulation last by every method whether beaten or not.
pub(super) fn pareto<'d>(
    orders: &[OrderResult],
    direct: impl IntoIterator<Item = &'d DirectSummary>,
) -> Vec<ParetoPoint> {
    let point = |result: &OrderResult| {
        Some(ParetoPoint {
            map: Some(ParetoMap {
                orders: result.orders,
                shape: result.shape,
            }),
            direct: None,
            step_ns: result.step_ns,
            error: result.error.max?,
        })
    };
    let mut points: Vec<ParetoPoint> = orders.iter().filter_map(point).collect();
    let speed = |point: &ParetoPoint| (point.step_ns, point.error);
    points.sort_by(|a, b| {
        let ((a_ns, a_error), (b_ns, b_error)) = (speed(a), speed(b));
        a_ns.total_cmp(&b_ns).then(a_error.total_cmp(&b_error))
    });
    let mut best = f64::INFINITY;
    points.retain(|point| {
        let better = point.error < best;
        best = best.min(point.error);
        better
    });
    points.extend(direct.into_iter().map(|direct| ParetoPoint {
        map: None,
        direct: Some(direct.method.clone()),
        step_ns: direct.period_ns,
        error: direct.error_estimate,
    }));
    points
}
