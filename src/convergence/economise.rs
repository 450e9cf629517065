//! Economised maps: the coefficients of a truncated map moved so that its error on the window is smaller.
//!
//! One idea: a Taylor polynomial is best at the graze and worst at the window's edge. With the same monomials, and so
//! at the same cost of a step, least squares on points of the window (Chebyshev's density along every axis) spread what
//! was cut off over the whole of it. The grazing point stays fixed: no constant term enters, and the coefficient of `y`
//! there is kept. See docs/mathematics/convergence.md.

use nalgebra::{DMatrix, DVector};

use super::sample::{WindowSample, low_discrepancy};
use super::{ConvergenceError, MapFamily};
use crate::expansion::{Contact, Leg, LocalMap, MapOrders, Stage};
use crate::jet::Jet;

/// Points for every coefficient that is fitted.
const POINTS_PER_COEFFICIENT: usize = 6;

/// Fewest points of a fit.
const FEWEST_POINTS: usize = 400;

/// Points tried for one that is kept.
const TRIALS: usize = 40;

/// Below this share of the window's largest depth variable an error of the depth counts as at it.
const LEAST_DEPTH_VARIABLE: f64 = 1e-2;

/// Singular values below this share of the largest move no coefficient.
const NEGLIGIBLE: f64 = 1e-10;

impl MapFamily<'_> {
    /// The map at lower orders with its coefficients fitted to the map of the highest ones on its window.
    ///
    /// The monomials are those of [`map`](Self::map); infinite half-widths count as the window's depth. Each stage is
    /// fitted where the stages before it put the points of the window.
    ///
    /// ```
    /// use grazemap::convergence::MapFamily;
    /// use grazemap::expansion::MapOrders;
    /// use grazemap::model::{Scene, catalogue};
    /// use grazemap::orbit::locate;
    ///
    /// let text = catalogue::text("linear").expect("in the catalogue");
    /// let scene = Scene::parse(text, "linear.toml")?;
    /// let orbit = locate(&scene)?.into_result()?;
    /// let highest = MapOrders { smooth_order: 5, contact_weight: 7 };
    /// let family = MapFamily::new(&scene, &orbit, highest)?;
    /// let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    /// assert_eq!(family.economised(orders)?.orders, orders);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`ConvergenceError::Expansion`] if a space is too large, [`ConvergenceError::NoTruth`] if the window holds no point
    /// within its depth.
    pub fn economised(&self, orders: MapOrders) -> Result<LocalMap, ConvergenceError> {
        let (mut map, exact) = (self.map(orders)?, self.map(self.highest())?);
        let mut points = window_points(&exact, wanted(&map))?;
        let deepest = map.window.depth;
        for (stage, exact) in map.stages.iter_mut().zip(&exact.stages) {
            let images = match (stage, exact) {
                (Stage::Leg(leg), Stage::Leg(exact)) => fit_leg(leg, exact, &points),
                (Stage::Contact(contact), Stage::Contact(exact)) => {
                    fit_depth(contact, exact, &points, deepest);
                    fit_contact(contact, exact, &points)
                }
                // Both maps are cut from one expansion: their stages are of the same kinds.
                _ => Vec::new(),
            };
            for (point, image) in points.iter_mut().zip(images) {
                point[..image.len()].copy_from_slice(&image);
            }
        }
        Ok(map)
    }
}

/// Points that determine the largest of a map's fits.
fn wanted(map: &LocalMap) -> usize {
    let coefficients = |stage: &Stage| match stage {
        Stage::Leg(leg) => leg.image.first().map_or(0, length),
        Stage::Contact(contact) => {
            let parts = [contact.linear.first(), contact.quadratic.first()];
            parts.into_iter().flatten().map(length).sum()
        }
        // A family's maps are series.
        Stage::Flown(_) => 0,
    };
    let most = map.stages.iter().map(coefficients).max().unwrap_or(0);
    FEWEST_POINTS.max(POINTS_PER_COEFFICIENT * most)
}

fn length(jet: &Jet<f64>) -> usize {
    jet.coefficients().len()
}

/// Points (coordinates; parameters) of the window whose passages are no deeper than it allows.
fn window_points(map: &LocalMap, wanted: usize) -> Result<Vec<Vec<f64>>, ConvergenceError> {
    let sample = WindowSample::new(map);
    let widths = sample.widths();
    let point = |number: usize| -> Vec<f64> {
        let shares = low_discrepancy(number, widths.len());
        let pairs = widths.iter().zip(shares);
        pairs
            .map(|(width, share)| width * (std::f64::consts::PI * share).cos())
            .collect()
    };
    let tried = (0..TRIALS * wanted).map(point);
    let shallow = |point: &Vec<f64>| {
        let mut passages = 0..map.passages();
        passages.all(|passage| sample.depth(passage, point) <= sample.deepest())
    };
    let kept = tried.filter(shallow);
    let points: Vec<_> = kept.take(wanted).collect();
    if points.len() < wanted / 4 {
        return Err(ConvergenceError::NoTruth {
            tried: TRIALS * wanted,
        });
    }
    Ok(points)
}

/// Fits a leg without its constant terms; the exact images.
fn fit_leg(leg: &mut Leg, exact: &Leg, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let images: Vec<Vec<f64>> = points
        .iter()
        .map(|point| values(&exact.image, point))
        .collect();
    let Some(space) = leg.image.first().map(|jet| jet.space().clone()) else {
        return images;
    };
    let mut row = Vec::new();
    let rows = points.iter().map(|point| {
        space.monomials_at(point, &mut row);
        row[1..].to_vec()
    });
    let fit = Fit::new(rows.collect());
    for (coordinate, jet) in leg.image.iter_mut().enumerate() {
        let residuals = points.iter().zip(&images);
        let residuals = residuals.map(|(point, image)| image[coordinate] - jet.evaluate(point));
        let change = fit.solve(residuals.collect());
        add(&mut jet.coefficients_mut()[1..], &change);
    }
    images
}

/// Fits a depth without its constant term, so that the depth variable `y` errs little: `δy = δ(y²)/2y`.
fn fit_depth(contact: &mut Contact, exact: &Contact, points: &[Vec<f64>], deepest: f64) {
    let space = contact.depth.space().clone();
    let least = LEAST_DEPTH_VARIABLE * deepest.sqrt();
    let weights: Vec<f64> = points
        .iter()
        .map(|point| 0.5 / exact.depth.evaluate(point).abs().sqrt().max(least))
        .collect();
    let mut monomials = Vec::new();
    let rows = points.iter().zip(&weights).map(|(point, weight)| {
        space.monomials_at(point, &mut monomials);
        monomials[1..].iter().map(|value| weight * value).collect()
    });
    let fit = Fit::new(rows.collect());
    let residuals = points.iter().zip(&weights);
    let residuals = residuals.map(|(point, weight)| {
        weight * (exact.depth.evaluate(point) - contact.depth.evaluate(point))
    });
    let change = fit.solve(residuals.collect());
    add(&mut contact.depth.coefficients_mut()[1..], &change);
}

/// Fits the correction of a contact on the points that touch, its leading coefficient kept; the exact images of all points.
fn fit_contact(contact: &mut Contact, exact: &Contact, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let dimension = contact.linear.len();
    let depths: Vec<f64> = points
        .iter()
        .map(|point| exact.depth.evaluate(point).max(0.0).sqrt())
        .collect();
    let correction = |contact: &Contact, coordinate: usize, point: &[f64], y: f64| {
        let quadratic = contact.quadratic[coordinate].evaluate(point);
        y * (contact.linear[coordinate].evaluate(point) + y * quadratic)
    };
    let touching: Vec<_> = points
        .iter()
        .zip(&depths)
        .filter(|(_, y)| **y > 0.0)
        .collect();
    if let (Some(linear), Some(quadratic)) = (contact.linear.first(), contact.quadratic.first()) {
        let spaces = [linear.space().clone(), quadratic.space().clone()];
        let mut monomials = Vec::new();
        let rows = touching.iter().map(|&(point, &y)| {
            let mut row = Vec::new();
            spaces[0].monomials_at(point, &mut monomials);
            row.extend(monomials[1..].iter().map(|value| y * value));
            spaces[1].monomials_at(point, &mut monomials);
            row.extend(monomials.iter().map(|value| y * y * value));
            row
        });
        let fit = Fit::new(rows.collect());
        for coordinate in 0..dimension {
            let residuals = touching.iter().map(|&(point, &y)| {
                correction(exact, coordinate, point, y) - correction(contact, coordinate, point, y)
            });
            let change = fit.solve(residuals.collect());
            let (linear, quadratic) = change.split_at(spaces[0].len() - 1);
            add(
                &mut contact.linear[coordinate].coefficients_mut()[1..],
                linear,
            );
            add(contact.quadratic[coordinate].coefficients_mut(), quadratic);
        }
    }
    let image = |(point, &y): (&Vec<f64>, &f64)| {
        (0..dimension)
            .map(|coordinate| point[coordinate] + correction(exact, coordinate, point, y))
            .collect()
    };
    points.iter().zip(&depths).map(image).collect()
}

fn values(jets: &[Jet<f64>], point: &[f64]) -> Vec<f64> {
    jets.iter().map(|jet| jet.evaluate(point)).collect()
}

fn add(coefficients: &mut [f64], change: &[f64]) {
    let pairs = coefficients.iter_mut().zip(change);
    pairs.for_each(|(coefficient, change)| *coefficient += change);
}

/// Least squares for many right sides, every column scaled to its largest entry.
struct Fit {
    decomposition: Option<nalgebra::SVD<f64, nalgebra::Dyn, nalgebra::Dyn>>,
    scales: Vec<f64>,
}

impl Fit {
    fn new(rows: Vec<Vec<f64>>) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let largest = |column: usize| rows.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        let scales: Vec<f64> = (0..columns)
            .map(largest)
            .map(|scale| if scale > 0.0 { scale } else { 1.0 })
            .collect();
        let decomposition = (columns > 0).then(|| {
            DMatrix::from_fn(rows.len(), columns, |row, column| {
                rows[row][column] / scales[column]
            })
            .svd(true, true)
        });
        Self {
            decomposition,
            scales,
        }
    }

    /// The smallest change of the coefficients that removes most of the residuals.
    fn solve(&self, residuals: Vec<f64>) -> Vec<f64> {
        let right = DVector::from_vec(residuals);
        let solved = self.decomposition.as_ref().and_then(|svd| {
            let threshold = NEGLIGIBLE * svd.singular_values.max();
            svd.solve(&right, threshold).ok()
        });
        match solved {
            Some(change) => change
                .iter()
                .zip(&self.scales)
                .map(|(c, s)| c / s)
                .collect(),
            None => vec![0.0; self.scales.len()],
        }
    }
}
