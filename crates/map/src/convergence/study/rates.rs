//! Rates at which errors fall with the size of the deviations: of the map, of `D` only, of
//! `P_smooth` only.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::analysis::{DirectImage, FreeFlight, MapEvaluation};
use crate::convergence::ConvergenceError;
use crate::convergence::family::{cut_contact, cut_contacts, cut_legs};
use crate::convergence::sample::WindowSample;
use crate::convergence::truth::{distance, tells_order};
use crate::expansion::{Contact, Expander, Legs, MapOrders};
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::model::Scene;
use crate::numeric::{Dd, Scalar, low_discrepancy};
use crate::orbit::GrazingOrbit;

/// A measured exponent and the expected one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Slope of the error in logarithms; `None` if rounding leaves too short a range.
    pub measured: Option<f64>,
    /// Standard error of the slope.
    pub uncertainty: Option<f64>,
    /// Exponent that truncation alone would give.
    pub expected: f64,
    /// Range of the small variable used, in units of the window's edge.
    pub range: Option<[f64; 2]>,
}

/// Rate of one factor of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactorRate {
    /// Truncation order: a weight of `D`, a degree of `P_smooth`.
    pub order: u32,
    /// Rate of the factor.
    pub rate: Rate,
    /// Data of the fit: sizes in units of the window's edge, and root-mean-square errors.
    pub errors: Vec<[f64; 2]>,
}

/// Number of directions in which deviations are scaled.
const DIRECTIONS: usize = 4;

/// Number of sizes per direction, a factor of √2 apart.
const SIZES: usize = 24;

/// Largest size, in units of the window's edge.
const LARGEST: f64 = 2.0;

/// Number of points of the sample among which directions are sought.
const CANDIDATES: usize = 1000;

/// A point counts as deep from this share of the window's depth.
const DEEP: f64 = 0.1;

/// An error counts as truncation if it exceeds the rounding of the coefficients by this factor.
const CLEAR: f64 = 1e3;

/// Deviations of several sizes in several directions, with their exact images.
pub(super) struct ScaledPoints {
    /// Sizes of the deviations, each with its points; size 1 reaches the edge of the window.
    sizes: Vec<(f64, Vec<ScaledPoint>)>,
}

/// A point of one size.
struct ScaledPoint {
    state: Vec<Dd>,
    parameters: Vec<Dd>,
    image: Vec<Dd>,
}

/// Exact image of a factor at a state and parameters; `None` if there is none to compare with.
type Exact<'f> = dyn FnMut(&[Dd], &[Dd]) -> Result<Option<Vec<Dd>>, ConvergenceError> + 'f;

impl ScaledPoints {
    /// Points whose variable `i` is `scale(size, i)` times its component of a direction.
    fn new(
        directions: &[Vec<f64>],
        coordinates: usize,
        scale: impl Fn(f64, usize) -> f64,
        exact: &mut Exact<'_>,
    ) -> Result<Self, ConvergenceError> {
        let mut sizes = Vec::new();
        for step in 0..SIZES {
            let size = size(step);
            let mut points = Vec::new();
            for direction in directions {
                let offset =
                    |(variable, &edge): (usize, &f64)| Dd::from(edge * scale(size, variable));
                let offsets: Vec<Dd> = direction.iter().enumerate().map(offset).collect();
                let (state, parameters) = offsets.split_at(coordinates);
                if let Some(image) = exact(state, parameters)? {
                    points.push(ScaledPoint {
                        state: state.to_vec(),
                        parameters: parameters.to_vec(),
                        image,
                    });
                }
            }
            if points.len() == directions.len() {
                sizes.push((size, points));
            }
        }
        Ok(Self { sizes })
    }

    /// Rate of a map on these points, and the sizes and errors of the fit; `rounding` is that of
    /// its coefficients, relative to the image. The exact images have an error too: the rounding of
    /// the depth, which moves the kick by `1/y` of it.
    fn rate_and_errors(
        &self,
        map: &MapEvaluation<Dd>,
        rounding: f64,
        expected: f64,
    ) -> (Rate, Vec<[f64; 2]>) {
        let points: Vec<_> = self
            .sizes
            .iter()
            .map(|(size, points)| {
                let error = root_mean_square(points.iter().map(|point| point.error(map)));
                let image = root_mean_square(points.iter().map(ScaledPoint::size));
                (*size, error, CLEAR * (rounding * image + Dd::ROUNDOFF / image))
            })
            .collect();
        let fit = fit_slope(&points);
        let rate = Rate {
            measured: fit.map(|fit| fit.slope),
            uncertainty: fit.map(|fit| fit.uncertainty),
            expected,
            range: fit.map(|fit| fit.range),
        };
        let errors = points.iter().map(|&(size, error, _)| [size, error]).collect();
        (rate, errors)
    }

    /// Rates of a factor cut at every order up to the highest.
    fn factor_rates(
        &self,
        highest: u32,
        cut: impl Fn(u32) -> Result<MapEvaluation<Dd>, ConvergenceError> + Sync,
    ) -> Result<Vec<FactorRate>, ConvergenceError> {
        let rate = |order: u32| {
            let map = cut(order)?;
            let expected = map.omitted_exponent(order);
            let (rate, errors) = self.rate_and_errors(&map, Dd::ROUNDOFF, expected);
            Ok(FactorRate { order, rate, errors })
        };
        parallel::try_map(1..=highest, rate)
    }
}

impl ScaledPoint {
    fn error(&self, map: &MapEvaluation<Dd>) -> f64 {
        distance(&map.image(&self.state, &self.parameters).offsets, &self.image)
    }

    fn size(&self) -> f64 {
        distance(&self.image, &vec![Dd::ZERO; self.image.len()])
    }
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Directions in which all variables are scaled: points at the edge of the window at which the
/// section's passage makes contact, at every size. A point that is beyond the surface only by the
/// depth's quadratic terms leaves it when scaled down.
fn contact_directions(sample: &WindowSample, expander: &Expander<'_>) -> Vec<Vec<f64>> {
    let (passage, weights) = (expander.section_passage(), &expander.variables().weights);
    let smallest = size(SIZES - 1);
    let deep = |offsets: &Vec<f64>| {
        let scaled = offsets.iter().zip(weights);
        let scaled: Vec<_> =
            scaled.map(|(offset, &weight)| offset * smallest.powi(weight as i32)).collect();
        let limit = DEEP * sample.deepest();
        sample.depth(passage, offsets) > limit
            && sample.depth(passage, &scaled) > limit * smallest * smallest
    };
    let points = (0..CANDIDATES).filter_map(|index| sample.point(index));
    points
        .map(|point| [point.state, point.parameters].concat())
        .filter(deep)
        .take(DIRECTIONS)
        .collect()
}

/// Size of a step, in units of the window's edge.
fn size(step: usize) -> f64 {
    LARGEST * 0.5f64.powf(0.5 * step as f64)
}

/// Directions over the whole window, each with its opposite, so that odd powers of the distance
/// cancel.
fn smooth_directions(sample: &WindowSample) -> Vec<Vec<f64>> {
    let widths = sample.widths();
    let direction = |index: usize| -> Vec<f64> {
        let shares = low_discrepancy(index, widths.len());
        widths.iter().zip(&shares).map(|(width, share)| width * (2.0 * share - 1.0)).collect()
    };
    (0..DIRECTIONS / 2)
        .flat_map(|index| {
            let there = direction(index);
            let back = there.iter().map(|value| -value).collect();
            [there, back]
        })
        .collect()
}

impl ScaledPoints {
    /// Points at which the section's passage makes contact; deviations of weight `w` are scaled as
    /// `size^w`, so that `y` is proportional to the size.
    fn in_contact(
        expander: &Expander<'_>,
        sample: &WindowSample,
        exact: &mut Exact<'_>,
    ) -> Result<Self, ConvergenceError> {
        let variables = expander.variables();
        let scale = |size: f64, variable: usize| size.powi(variables.weights[variable] as i32);
        Self::new(&contact_directions(sample, expander), variables.coordinates, scale, exact)
    }

    /// Points in contact, with exact images of the whole map.
    pub(super) fn of_maps(
        expander: &Expander<'_>,
        sample: &WindowSample,
        system: &HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
    ) -> Result<Self, ConvergenceError> {
        let mut direct = DirectImage::<Dd>::new(system, scene, orbit)?;
        Self::in_contact(expander, sample, &mut |state, parameters| {
            let image = direct.lifted_image(state, parameters)?;
            Ok(tells_order(&image).then_some(image.offsets))
        })
    }

    /// Rate of a map at these orders. After a contact the state is `O(y)`, so that a leg cut at
    /// degree `N` has an error `y^(N+1)`, and a contact cut at weight `W` an error `y^(W+1)`, or
    /// that of the first power between.
    pub(super) fn rate(&self, map: &MapEvaluation<Dd>, rounding: f64, orders: MapOrders) -> Rate {
        let smooth = f64::from(orders.smooth_order + 1);
        let expected = smooth.min(map.omitted_exponent(orders.contact_weight));
        self.rate_and_errors(map, rounding, expected).0
    }
}

/// Factors of a scene, expanded at their first use.
pub(super) struct LazyFactors<'f, 'a> {
    expander: &'f Expander<'a>,
    highest: MapOrders,
    made: OnceLock<ExactFactors<'f, 'a>>,
}

impl<'f, 'a> LazyFactors<'f, 'a> {
    pub(super) fn new(expander: &'f Expander<'a>, highest: MapOrders) -> Self {
        Self { expander, highest, made: OnceLock::new() }
    }

    pub(super) fn get(&self) -> Result<&ExactFactors<'f, 'a>, ConvergenceError> {
        if let Some(known) = self.made.get() {
            return Ok(known);
        }
        let made = ExactFactors::new(self.expander, self.highest)?;
        Ok(self.made.get_or_init(|| made))
    }
}

/// Factors of a scene with coefficients in double-double, for rates without the rounding of
/// coefficients.
pub(super) struct ExactFactors<'f, 'a> {
    expander: &'f Expander<'a>,
    legs: Legs<Dd>,
    contacts: Vec<Contact<Dd>>,
    highest: MapOrders,
}

impl<'f, 'a> ExactFactors<'f, 'a> {
    fn new(expander: &'f Expander<'a>, highest: MapOrders) -> Result<Self, ConvergenceError> {
        Ok(Self {
            expander,
            legs: expander.legs_by_taylor(highest.smooth_order)?,
            contacts: (0..expander.passages())
                .map(|passage| expander.contact_in(passage, highest.contact_weight))
                .collect::<Result<_, _>>()?,
            highest,
        })
    }

    /// The factored map; `None` beyond the highest orders.
    pub(super) fn map(
        &self,
        orders: MapOrders,
    ) -> Result<Option<MapEvaluation<Dd>>, ConvergenceError> {
        let highest = self.highest;
        if !highest.reaches(orders) {
            return Ok(None);
        }
        let legs = cut_legs(self.expander, &self.legs, orders.smooth_order)?;
        let contacts = cut_contacts(self.expander, &self.contacts, orders.contact_weight)?;
        Ok(Some(MapEvaluation::of_parts(legs, contacts)))
    }
}

/// Rates of the discontinuity mapping at the section's passage only, cut at each weight, in
/// double-double.
pub(super) fn discontinuity_rates(
    sample: &WindowSample,
    factors: &ExactFactors<'_, '_>,
    system: &HybridSystem,
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<Vec<FactorRate>, ConvergenceError> {
    let expander = factors.expander;
    let contact = &factors.contacts[expander.section_passage()];
    let variables = expander.variables();
    let mut flight = FreeFlight::<Dd>::new(system, scene, orbit)?;
    let scaled = ScaledPoints::in_contact(expander, sample, &mut |state, parameters| {
        let flown = flight.discontinuity(state, parameters)?;
        Ok(flown.and_then(|(image, depth)| (depth > Dd::ZERO).then_some(image)))
    })?;
    scaled.factor_rates(factors.highest.contact_weight, |weight| {
        let contact = cut_contact(variables, contact, weight)?;
        Ok(MapEvaluation::contact(contact))
    })
}

/// Rates of `P_smooth` only, cut at each degree, in double-double.
pub(super) fn smooth_rates(
    sample: &WindowSample,
    factors: &ExactFactors<'_, '_>,
    system: &HybridSystem,
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<Vec<FactorRate>, ConvergenceError> {
    let (expander, legs) = (factors.expander, &factors.legs);
    let variables = expander.variables();
    let mut flight = FreeFlight::<Dd>::new(system, scene, orbit)?;
    let mut exact = |state: &[Dd], parameters: &[Dd]| Ok(flight.smooth(state, parameters)?);
    // A deviation of the default weight 2 is proportional to the size.
    let scale =
        |size: f64, variable: usize| size.powf(0.5 * f64::from(variables.weights[variable]));
    let directions = smooth_directions(sample);
    let scaled = ScaledPoints::new(&directions, variables.coordinates, scale, &mut exact)?;
    scaled.factor_rates(factors.highest.smooth_order, |degree| {
        Ok(MapEvaluation::legs(cut_legs(expander, legs, degree)?))
    })
}

/// A straight line through the logarithms of a size and of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeFit {
    /// Exponent of the error.
    pub slope: f64,
    /// Standard error of the slope.
    pub uncertainty: f64,
    /// Smallest and largest size used.
    pub range: [f64; 2],
}

/// Fewest points for the fit of a slope.
const FEWEST: usize = 4;

/// Most points for the fit of a slope: larger sizes are further from the asymptotic law.
const MOST: usize = 8;

/// Fits `error ≈ c size^slope` by least squares in logarithms.
///
/// `points`: size, error, and the floor that rounding sets to the error, by descending size. Used
/// are at most eight of the smallest sizes at which, from the largest size down, the error still
/// exceeds the floor. `None` if there are fewer than four.
pub fn fit_slope(points: &[(f64, f64, f64)]) -> Option<SlopeFit> {
    let clear = |&&(_, error, floor): &&(f64, f64, f64)| error.is_finite() && error > floor;
    let usable: Vec<_> =
        points.iter().skip_while(|point| !clear(point)).take_while(clear).collect();
    let used = &usable[usable.len().saturating_sub(MOST)..];
    if used.len() < FEWEST {
        return None;
    }
    let logs: Vec<_> = used.iter().map(|(size, error, _)| (size.ln(), error.ln())).collect();
    let (slope, uncertainty) = least_squares(&logs);
    Some(SlopeFit { slope, uncertainty, range: [used[used.len() - 1].0, used[0].0] })
}

/// Slope of a line and its standard error.
fn least_squares(points: &[(f64, f64)]) -> (f64, f64) {
    let count = points.len() as f64;
    let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|point| point.1).sum::<f64>() / count;
    let spread: f64 = points.iter().map(|point| (point.0 - mean_x).powi(2)).sum();
    let slope =
        points.iter().map(|point| (point.0 - mean_x) * (point.1 - mean_y)).sum::<f64>() / spread;
    let residual = |point: &(f64, f64)| point.1 - mean_y - slope * (point.0 - mean_x);
    let variance = points.iter().map(|point| residual(point).powi(2)).sum::<f64>() / (count - 2.0);
    (slope, (variance / spread).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_over_a_floor_keeps_its_exponent() {
        let size = |k: i32| 2.0f64.powf(-0.5 * f64::from(k));
        let points: Vec<_> =
            (0..60).map(|k| (size(k), 3.0 * size(k).powi(5) + 1e-18, 1e-15)).collect();
        let fit = fit_slope(&points).expect("many points");
        // The floor adds at most a share of 1e-3 at the smallest of eight sizes.
        assert!((fit.slope - 5.0).abs() < 1e-3 && fit.uncertainty < 1e-3, "{fit:?}");
        assert!(fit.range[0] < fit.range[1]);
    }

    #[test]
    fn too_short_a_range_has_no_slope() {
        let points: Vec<_> =
            (0..20).map(|k| (2.0f64.powi(-k), 2.0f64.powi(-9 * k), 1e-7)).collect();
        assert_eq!(fit_slope(&points), None);
    }
}
