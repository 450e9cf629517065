//! What truncation leaves out, forecast from one expansion of higher order.
//!
//! At a point of the sample the stages act one after another. Where a monomial `m` of a stage lies beyond a cut, `c m(x)` at the
//! stage's own input is what the cut leaves out there, and the Jacobian of the stages that follow carries it to the
//! image. Monomials are summed by weighted degree, so that one pass forecasts every cut.

use super::sample::SamplePoint;
use crate::analysis::MapEvaluation;
use crate::expansion::{Contact, DEVIATION_WEIGHT, LocalMap, MapOrders, Stage};
use crate::jet::Jet;

/// Difference quotients are taken over this part of the state.
const STEP: f64 = 1e-6;

/// Forecasts for one choice of weights: at each point, what each cut leaves out of the image.
#[derive(Clone, Debug)]
pub(super) struct Forecast {
    /// By point, then by degree from 1: effects of the legs.
    smooth: Vec<Vec<Vec<f64>>>,
    /// By point, then by weight from 1: effects of the contacts.
    contact: Vec<Vec<Vec<f64>>>,
}

impl Forecast {
    /// At sample points, by a map, with the weights of (coordinates; parameters).
    pub(super) fn new(map: &LocalMap, weights: &[u32], points: &[SamplePoint]) -> Self {
        let mut forecast = Self {
            smooth: Vec::new(),
            contact: Vec::new(),
        };
        let rests: Vec<_> = (1..=map.stages.len()).map(|from| rest(map, from)).collect();
        for point in points {
            let (smooth, contact) = at_point(map, weights, point, &rests);
            forecast.smooth.push(smooth);
            forecast.contact.push(contact);
        }
        forecast
    }

    /// Largest coordinate of what a pair of orders leaves out, over the points: no bound, as higher terms are missing.
    pub(super) fn error(&self, orders: MapOrders) -> f64 {
        let (n, w) = (
            orders.smooth_order as usize - 1,
            orders.contact_weight as usize - 1,
        );
        let pairs = self.smooth.iter().zip(&self.contact);
        let sizes = pairs.flat_map(|(smooth, contact)| {
            let sums = smooth[n].iter().zip(&contact[w]);
            sums.map(|(leg, contact)| (leg + contact).abs())
        });
        sizes.fold(0.0, f64::max)
    }
}

/// The stages from one on.
fn rest(map: &LocalMap, from: usize) -> MapEvaluation<f64> {
    let mut rest = map.clone();
    rest.stages.drain(..from);
    MapEvaluation::new(&rest)
}

type Effects = Vec<Vec<f64>>;

fn at_point(
    map: &LocalMap,
    weights: &[u32],
    point: &SamplePoint,
    rests: &[MapEvaluation<f64>],
) -> (Effects, Effects) {
    let dimension = map.dimension();
    let orders = map.orders;
    let mut smooth = vec![vec![0.0; dimension]; orders.smooth_order as usize];
    let mut contact = vec![vec![0.0; dimension]; orders.contact_weight as usize];
    let mut here = [point.state.as_slice(), &point.parameters].concat();
    for (stage, rest) in map.stages.iter().zip(rests) {
        let (image, cuts, effects) = match stage {
            Stage::Leg(leg) => {
                let image: Vec<f64> = leg.image.iter().map(|jet| jet.evaluate(&here)).collect();
                let sums = leg.image.iter().map(|jet| Sums::new(jet, weights, &here));
                let sums: Vec<_> = sums.collect();
                let left = |cut: usize| {
                    let degree = DEVIATION_WEIGHT as usize * cut;
                    sums.iter().map(|sums| sums.beyond(degree)).collect()
                };
                let cuts: Effects = (1..=smooth.len()).map(left).collect();
                (image, cuts, &mut smooth)
            }
            Stage::Contact(law) => {
                let (image, cuts) = contact_cuts(law, weights, &here, contact.len());
                (image, cuts, &mut contact)
            }
            // A family's maps are series.
            Stage::Flown(_) => continue,
        };
        let jacobian = jacobian(rest, &image, &point.parameters);
        for (effect, cut) in effects.iter_mut().zip(&cuts) {
            for (row, sum) in jacobian.iter().zip(effect.iter_mut()) {
                *sum += row.iter().zip(cut).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        here[..dimension].copy_from_slice(&image);
    }
    (smooth, contact)
}

/// The image of a contact `x + y B + y² C`, and what each weight leaves out of it: the terms of `B` and `C` beyond the cut, and
/// those of the depth through `δy = δ(y²)/2y`.
fn contact_cuts(law: &Contact, weights: &[u32], here: &[f64], count: usize) -> (Vec<f64>, Effects) {
    let depth = law.depth.evaluate(here);
    if depth <= 0.0 {
        let dimension = law.linear.len();
        return (
            here[..dimension].to_vec(),
            vec![vec![0.0; dimension]; count],
        );
    }
    let y = depth.sqrt();
    let depths = Sums::new(&law.depth, weights, here);
    let parts = law.linear.iter().zip(&law.quadratic);
    let parts: Vec<_> = parts
        .map(|(b, c)| (Sums::new(b, weights, here), Sums::new(c, weights, here)))
        .collect();
    let image = parts.iter().zip(here);
    let image = image.map(|((b, c), x)| x + y * (b.total() + y * c.total()));
    let left = |weight: usize| {
        let shift = 0.5 * depths.beyond(weight + 1) / y;
        let of_coordinate = |(b, c): &(Sums, Sums)| {
            let quadratic = match weight.checked_sub(2) {
                Some(degree) => c.beyond(degree),
                None => c.total(),
            };
            let steepness = b.total() + 2.0 * y * c.total();
            y * (b.beyond(weight - 1) + y * quadratic) + shift * steepness
        };
        parts.iter().map(of_coordinate).collect()
    };
    (image.collect(), (1..=count).map(left).collect())
}

/// Sums of a polynomial's terms at a point, by weighted degree.
struct Sums(Vec<f64>);

impl Sums {
    fn new(jet: &Jet<f64>, weights: &[u32], here: &[f64]) -> Self {
        let mut sums = Vec::new();
        for (exponents, coefficient) in jet.terms() {
            let (mut degree, mut value) = (0, coefficient);
            for ((&exponent, &weight), x) in exponents.iter().zip(weights).zip(here) {
                degree += usize::from(exponent) * weight as usize;
                value *= x.powi(i32::from(exponent));
            }
            if sums.len() <= degree {
                sums.resize(degree + 1, 0.0);
            }
            sums[degree] += value;
        }
        Self(sums)
    }

    fn beyond(&self, degree: usize) -> f64 {
        self.0.iter().skip(degree + 1).sum()
    }

    fn total(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// The Jacobian of the stages that follow, row by row.
fn jacobian(rest: &MapEvaluation<f64>, state: &[f64], parameters: &[f64]) -> Vec<Vec<f64>> {
    let size = state.iter().fold(0.0f64, |max, value| max.max(value.abs()));
    let step = STEP * if size > 0.0 { size } else { 1.0 };
    let mut rows = vec![vec![0.0; state.len()]; state.len()];
    for column in 0..state.len() {
        let at = |sign: f64| {
            let mut shifted = state.to_vec();
            shifted[column] += sign * step;
            rest.image(&shifted, parameters).offsets
        };
        let (above, below) = (at(1.0), at(-1.0));
        for (row, (a, b)) in rows.iter_mut().zip(above.iter().zip(&below)) {
            row[column] = (a - b) / (2.0 * step);
        }
    }
    rows
}
