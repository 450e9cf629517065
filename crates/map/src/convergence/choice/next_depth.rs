//! Effect of a contact on the depth of the next one, if `xi_1` is near 0.
//!
//! A tolerance bounds the error of one step and does not involve `xi_1`. A contact of depth `y²`
//! moves the next depth by `−ξ y + η y²`. If the first term does not dominate on the window, a map
//! without the second term gives wrong stability, however small its error is. See
//! docs/mathematics/orders.md.

use serde::{Deserialize, Serialize};

use crate::analysis::MapEvaluation;
use crate::convergence::sample::WindowSample;
use crate::expansion::{LocalMap, MapOrders, Stage};
use crate::iteration::DiscreteMap;
use crate::numeric::Scalar;

/// Lowest orders that contain the terms of second order in `y` of the next depth.
const LEAST: MapOrders = MapOrders::new(2, 3);

/// Depth variables at which the effect of a contact is compared, relative to the window's largest.
const SHARES: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01];

/// Depth variables from which the terms in `y` and `y²` are determined, relative to the window's
/// largest.
const SMALL: [f64; 2] = [0.01, 0.02];

/// Allowed relative error of the effect of a contact near the graze, and its increase up to the
/// window's edge: an error of the slope is the same at all depths, a truncation error appears only
/// at the edge.
const PART: [f64; 2] = [0.01, 0.09];

/// The point without contact is short of contact by this share of a depth.
const SHORT: f64 = 1e-6;

/// A stretch below this counts as zero: the law has no square root.
const NO_STRETCH: f64 = 1e-10;

/// Lowest orders of the maps that are chosen from, with the reason: on the window a contact of
/// depth `y²` moves the next depth by `linear y + quadratic y²`, and the first term, which belongs
/// to `xi_1`, is somewhere less than twice the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeastOrders {
    /// Lowest truncation orders.
    #[serde(flatten)]
    pub orders: MapOrders,
    /// Coefficient of `y` at `p*`, proportional to `xi_1`.
    pub linear: f64,
    /// Change of that coefficient over the half-widths of the parameters.
    pub spread: f64,
    /// Coefficient of `y²` in the next depth.
    pub quadratic: f64,
    /// Largest depth variable of the window.
    pub largest: f64,
}

impl LeastOrders {
    /// Whether orders are at least as high as these.
    pub(super) fn allow(&self, orders: MapOrders) -> bool {
        orders.reaches(self.orders)
    }

    /// Orders raised to at least these.
    pub(super) fn raised(&self, orders: MapOrders) -> MapOrders {
        orders.max(self.orders)
    }
}

/// Effect of contacts at the last passage of a return on the depth of the first passage of the next
/// return.
#[derive(Clone, Debug)]
pub(super) struct NextDepth {
    pub(super) least: LeastOrders,
    sample: WindowSample,
    demands: Vec<Demand>,
}

/// Effect of a contact at a point, and its allowed error in a map.
#[derive(Clone, Debug)]
struct Demand {
    pair: Pair,
    /// Change of the next depth by the contact.
    effect: f64,
    /// Largest allowed error of that change.
    allowed: f64,
}

impl NextDepth {
    /// Effects computed by a map of orders above the lowest; `None` if the term of `xi_1` dominates
    /// on the window, or the law has no square root.
    pub(super) fn new(map: &LocalMap, sample: &WindowSample) -> Option<Self> {
        let law = map.stages.iter().rev().find_map(|stage| match stage {
            Stage::Contact(contact) => Some(contact),
            Stage::Leg(_) | Stage::Flown(_) => None,
        })?;
        let origin = vec![0.0; law.depth.space().variables()];
        let stretch = law.linear.iter().map(|jet| jet.evaluate(&origin).abs());
        if stretch.fold(0.0, f64::max) < NO_STRETCH {
            return None;
        }
        let exact = MapEvaluation::<f64>::new(map);
        let image = |state: &[f64], parameters: &[f64]| exact.image(state, parameters).offsets;
        let ends = parameter_ends(sample, map.parameters.len());
        let largest = sample.deepest().sqrt();
        let terms = |parameters: &Vec<f64>| {
            let [(near, below), (far, above)] = SMALL.map(|share| {
                let y = share * largest;
                let pair = Pair::new(sample, y, parameters);
                (y, pair.map(|pair| pair.effect(sample, &image) / y))
            });
            let slope = (above? - below?) / (far - near);
            Some([below? - slope * near, slope])
        };
        let found: Vec<[f64; 2]> = ends.iter().map(terms).collect::<Option<_>>()?;
        let [linear, quadratic] = found[0];
        // Both ends of each parameter in turn: a zero of the first term lies within the sum of the
        // changes.
        let change = |pair: &[[f64; 2]]| {
            let sizes = pair.iter().map(|terms| (terms[0] - linear).abs());
            sizes.fold(0.0, f64::max)
        };
        let spread: f64 = found[1..].chunks(2).map(change).sum();
        if linear.abs() > spread + 2.0 * quadratic.abs() * largest {
            return None;
        }
        let demands = ends.iter().zip(&found).flat_map(|(parameters, terms)| {
            SHARES.map(|share| {
                let y = share * largest;
                let pair = Pair::new(sample, y, parameters)?;
                let effect = pair.effect(sample, &image);
                let size = terms[0].abs().max(quadratic.abs() * y) * y;
                Some(Demand { effect, allowed: (PART[0] + PART[1] * share) * size, pair })
            })
        });
        Some(Self {
            least: LeastOrders { orders: LEAST, linear, spread, quadratic, largest },
            demands: demands.flatten().collect(),
            sample: sample.clone(),
        })
    }

    /// Whether a map has the right effect on the next depth: to a hundredth near the graze, to a
    /// tenth at the window's edge.
    pub(super) fn keeps(&self, map: &dyn DiscreteMap) -> bool {
        let image = |state: &[f64], parameters: &[f64]| {
            let mut image = vec![0.0; map.dimension()];
            map.step(state, parameters, &mut image);
            image
        };
        self.demands.iter().all(|demand| {
            let error = demand.pair.effect(&self.sample, &image) - demand.effect;
            error.magnitude() <= demand.allowed
        })
    }
}

/// A point at a depth of the last passage, and a point just short of contact.
#[derive(Clone, Debug)]
struct Pair {
    touching: Vec<f64>,
    short: Vec<f64>,
    parameters: Vec<f64>,
}

impl Pair {
    fn new(sample: &WindowSample, y: f64, parameters: &[f64]) -> Option<Self> {
        let coordinates = sample.widths().len() - parameters.len();
        let last = sample.steepest.len().checked_sub(1)?;
        // Where a parameter alone moves the depth, contact has no effect on the next one.
        if sample.steepest[last] >= coordinates {
            return None;
        }
        let at = |depth: f64| {
            let placed = sample.placed(last, vec![0.0; coordinates], parameters, depth);
            placed.map(|(point, _)| point.state)
        };
        Some(Self {
            touching: at(y * y)?,
            short: at(-SHORT * y * y)?,
            parameters: parameters.to_vec(),
        })
    }

    /// Difference of the next depths of the two points.
    fn effect(&self, sample: &WindowSample, image: &impl Fn(&[f64], &[f64]) -> Vec<f64>) -> f64 {
        let next = |state: &[f64]| {
            let image = image(state, &self.parameters);
            sample.depth(0, &[image.as_slice(), &self.parameters].concat())
        };
        next(&self.touching) - next(&self.short)
    }
}

/// Zero offsets of the parameters, then each parameter at both of its half-widths.
fn parameter_ends(sample: &WindowSample, parameters: usize) -> Vec<Vec<f64>> {
    let widths = sample.widths();
    let widths = &widths[widths.len() - parameters..];
    let end = |number: usize, sign: f64| {
        let mut offsets = vec![0.0; parameters];
        offsets[number] = sign * widths[number];
        offsets
    };
    let ends = (0..parameters).flat_map(|number| [end(number, 1.0), end(number, -1.0)]);
    [vec![0.0; parameters]].into_iter().chain(ends).collect()
}
