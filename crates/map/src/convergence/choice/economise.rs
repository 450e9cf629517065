//! Economised maps: truncated maps with coefficients adjusted so that the error on the window is
//! smaller.
//!
//! A Taylor polynomial is best at the graze and worst at the window's edge. With the same
//! monomials, and so at the same cost of a step, least squares on points of the window (Chebyshev's
//! density along every axis) distribute the truncation error over the whole window. The truncated
//! terms are known one by one, so one matrix of inner products of the monomials serves every
//! truncation. The grazing point stays fixed: no constant term enters, and the coefficient of `y`
//! there is kept. See docs/mathematics/convergence.md.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::analysis::MapEvaluation;
use crate::convergence::ConvergenceError;
use crate::convergence::family::MapFamily;
use crate::convergence::sample::WindowSample;
use crate::expansion::{Contact, Leg, LocalMap, MapOrders, Stage};
use crate::jet::{Jet, JetSpace};
use crate::numeric::{Scalar, low_discrepancy};

/// Number of points per monomial of a fit.
const POINTS_PER_MONOMIAL: usize = 4;

/// Smallest number of points of a fit.
const FEWEST_POINTS: usize = 400;

/// Number of points tried per point kept.
const TRIALS: usize = 40;

/// Errors of the depth at depth variables below this share of the window's largest are weighted as
/// at this share.
const LEAST_DEPTH_VARIABLE: f64 = 1e-2;

/// Number added to the diagonal of the matrix of inner products, which is all ones, so that
/// dependent monomials change no coefficient. If rounding still leaves the matrix indefinite, it is
/// multiplied by a hundred, and so on.
const RIDGE: f64 = 1e-13;

/// Number of values tried for [`RIDGE`], each a hundred times the one before.
const RIDGES: i32 = 4;

impl MapFamily<'_> {
    /// The map at lower orders, with its coefficients fitted to the map of the highest orders on
    /// its window.
    ///
    /// The monomials are those of [`map`](Self::map) whose coefficients are not zero; infinite
    /// half-widths count as the window's depth. Each stage is fitted at the images of the window's
    /// points by the stages before it.
    ///
    /// ```
    /// use grazemap_map::convergence::MapFamily;
    /// use grazemap_map::expansion::MapOrders;
    /// use grazemap_map::model::Scene;
    /// use grazemap_map::orbit::locate;
    ///
    /// let scene = Scene::of_catalogue("linear")?;
    /// let orbit = locate(&scene)?.into_result()?;
    /// let highest = MapOrders { smooth_order: 5, contact_weight: 7 };
    /// let family = MapFamily::new(&scene, &orbit, highest)?;
    /// let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    /// assert_eq!(family.economised(orders)?.fitted_to, Some(highest));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`ConvergenceError::Expansion`] if a space is too large, [`ConvergenceError::NoTruth`] if
    /// the window holds no point within its depth.
    pub fn economised(&self, orders: MapOrders) -> Result<LocalMap, ConvergenceError> {
        let fits = Economiser::new(self.map(self.highest())?)?;
        Ok(fits.economise(self.map(orders)?))
    }
}

/// Fits the coefficients of truncations of one map.
#[derive(Debug)]
pub(super) struct Economiser {
    exact: LocalMap,
    fits: Vec<StageFit>,
}

/// Inner products of the monomials of a stage.
#[derive(Debug)]
enum StageFit {
    Leg(Fit),
    /// Fits of the depth and of the correction; columns of the latter are `y` times the monomials
    /// of its linear part, then `y²` times those of the quadratic part.
    Contact(Fit, Fit),
    None,
}

impl Economiser {
    /// Prepares fits to a map on its window.
    pub(super) fn new(exact: LocalMap) -> Result<Self, ConvergenceError> {
        let mut points = window_points(&exact, wanted(&exact))?;
        let deepest = exact.window.depth;
        let mut fits = Vec::new();
        for (number, stage) in exact.stages.iter().enumerate() {
            fits.push(match stage {
                Stage::Leg(leg) => leg_fit(leg, &points),
                // Their coefficients would be fitted beside those of the other terms.
                Stage::Contact(contact) if !contact.powers.is_empty() => StageFit::None,
                Stage::Contact(contact) => contact_fit(contact, &points, deepest),
                // Maps of a family are series.
                Stage::Flown(_) => StageFit::None,
            });
            let stage = MapEvaluation::stages(&exact, number..number + 1);
            for point in &mut points {
                let (state, parameters) = point.split_at_mut(exact.dimension());
                state.copy_from_slice(&stage.image(state, parameters).offsets);
            }
        }
        Ok(Self { exact, fits })
    }

    /// Number of monomials in the largest fit of a map; the time of a fit grows as its square.
    pub(super) fn size(exact: &LocalMap) -> usize {
        exact.stages.iter().map(stage_size).max().unwrap_or(0)
    }

    /// Fits the remaining coefficients of a truncation of the map.
    pub(super) fn economise(&self, mut map: LocalMap) -> LocalMap {
        let stages = map.stages.iter_mut().zip(&self.exact.stages);
        for ((stage, exact), fit) in stages.zip(&self.fits) {
            match (stage, exact, fit) {
                (Stage::Leg(leg), Stage::Leg(exact), StageFit::Leg(fit)) => {
                    for (jet, exact) in leg.image.iter_mut().zip(&exact.image) {
                        fit.apply(&mut [jet], &[exact]);
                    }
                }
                (
                    Stage::Contact(contact),
                    Stage::Contact(exact),
                    StageFit::Contact(depth, correction),
                ) => {
                    contact.depth_form = None;
                    depth.apply(&mut [&mut contact.depth], &[&exact.depth]);
                    let parts = contact.linear.iter_mut().zip(&mut contact.quadratic);
                    let exact = exact.linear.iter().zip(&exact.quadratic);
                    for ((linear, quadratic), exact) in parts.zip(exact) {
                        correction.apply(&mut [linear, quadratic], &[exact.0, exact.1]);
                    }
                }
                // Both maps are cut from one expansion, so their stages are of the same kinds.
                _ => {}
            }
        }
        map.fitted_to = Some(self.exact.orders);
        map
    }
}

/// Number of points that determine the largest fit of a map.
fn wanted(map: &LocalMap) -> usize {
    FEWEST_POINTS.max(POINTS_PER_MONOMIAL * Economiser::size(map))
}

/// Number of monomials in the largest fit of a stage.
fn stage_size(stage: &Stage) -> usize {
    let length = |jet: Option<&Jet<f64>>| jet.map_or(0, |jet| jet.coefficients().len());
    match stage {
        Stage::Leg(leg) => length(leg.image.first()),
        Stage::Contact(contact) => {
            let correction = length(contact.linear.first()) + length(contact.quadratic.first());
            correction.max(length(Some(&contact.depth)))
        }
        Stage::Flown(_) => 0,
    }
}

/// Fit of a leg.
fn leg_fit(leg: &Leg, points: &[Vec<f64>]) -> StageFit {
    let space = leg.image.first().map(Jet::space);
    let rows = space.map_or(Vec::new(), |space| {
        let row = |point: &Vec<f64>| monomials(space, point, 1.0);
        points.iter().map(row).collect()
    });
    StageFit::Leg(Fit::new(rows))
}

/// Fits of a contact: of the depth, weighted such that the error of the depth variable is small,
/// `δy = δ(y²)/2y`; of the correction, at the points in contact.
fn contact_fit(contact: &Contact, points: &[Vec<f64>], deepest: f64) -> StageFit {
    let depth = |point: &Vec<f64>| contact.depth.evaluate(point);
    let depths: Vec<f64> = points.iter().map(depth).collect();
    let least = LEAST_DEPTH_VARIABLE * deepest.sqrt();
    let pairs = || points.iter().zip(&depths);
    let weighted = pairs().map(|(point, depth)| {
        let weight = 0.5 / depth.abs().sqrt().max(least);
        monomials(contact.depth.space(), point, weight)
    });
    let depth_fit = Fit::new(weighted.collect());
    let touching = pairs().filter(|(_, depth)| **depth > 0.0);
    let correction = touching.map(|(point, depth)| {
        let part = |jets: &[Jet<f64>], factor: f64| {
            let space = jets.first().map(Jet::space);
            space.map_or(Vec::new(), |space| monomials(space, point, factor))
        };
        [part(&contact.linear, depth.sqrt()), part(&contact.quadratic, *depth)].concat()
    });
    StageFit::Contact(depth_fit, Fit::new(correction.collect()))
}

/// Monomials of a space at a point, times a factor.
fn monomials(space: &JetSpace, point: &[f64], factor: f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(space.len());
    space.monomials_at(point, &mut values);
    values.iter_mut().for_each(|value| *value *= factor);
    values
}

/// Points (coordinates; parameters) of the window at which no passage is deeper than the window.
fn window_points(map: &LocalMap, wanted: usize) -> Result<Vec<Vec<f64>>, ConvergenceError> {
    let sample = WindowSample::new(map);
    let widths = sample.widths();
    let point = |number: usize| -> Vec<f64> {
        let shares = low_discrepancy(number, widths.len());
        let pairs = widths.iter().zip(shares);
        pairs
            .map(|(width, share)| width * Scalar::sin_cos(std::f64::consts::PI * share).1)
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
        return Err(ConvergenceError::NoTruth { tried: TRIALS * wanted });
    }
    Ok(points)
}

/// Inner products of monomials over points; every monomial is scaled to norm 1.
#[derive(Debug)]
struct Fit {
    products: DMatrix<f64>,
    scales: Vec<f64>,
}

impl Fit {
    fn new(rows: Vec<Vec<f64>>) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let size = |column: usize| rows.iter().map(|row| row[column].powi(2)).sum::<f64>().sqrt();
        let scales = (0..columns).map(size);
        let scales: Vec<f64> = scales.map(|size| if size > 0.0 { size } else { 1.0 }).collect();
        let scaled = |column: usize, row: usize| rows[row][column] / scales[column];
        let transposed = DMatrix::from_fn(columns, rows.len(), scaled);
        Self { products: &transposed * transposed.transpose(), scales }
    }

    /// Adjusts the nonzero coefficients of polynomials, except the very first, so that the
    /// difference from the exact polynomials is least. The columns of the polynomials follow each
    /// other in this fit.
    fn apply(&self, jets: &mut [&mut Jet<f64>], exact: &[&Jet<f64>]) {
        // No point of the window makes this contact, so there is nothing to fit.
        if self.scales.is_empty() {
            return;
        }
        let mut lacking = DVector::zeros(self.scales.len());
        let (mut places, mut columns, mut first) = (Vec::new(), Vec::new(), 0);
        for (number, (jet, exact)) in jets.iter().zip(exact).enumerate() {
            for (column, value) in exact.coefficients().iter().enumerate() {
                lacking[first + column] = *value;
            }
            for (place, (exponents, value)) in jet.terms().enumerate() {
                if let Some(column) = exact.space().monomial(exponents).filter(|_| value != 0.0) {
                    lacking[first + column] -= value;
                    if first + column > 0 {
                        places.push((number, place));
                        columns.push(first + column);
                    }
                }
            }
            first += exact.coefficients().len();
        }
        lacking.iter_mut().zip(&self.scales).for_each(|(value, scale)| *value *= scale);
        let rows = self.products.select_rows(&columns);
        let change = solve(rows.select_columns(&columns), &(rows * lacking));
        for (((number, place), column), change) in places.into_iter().zip(columns).zip(&change) {
            jets[number].coefficients_mut()[place] += change / self.scales[column];
        }
    }
}

/// Solution of the normal equations; zero change if there is none.
fn solve(products: DMatrix<f64>, right: &DVector<f64>) -> Vec<f64> {
    let ridged = (0..RIDGES).find_map(|power| {
        let mut ridged = products.clone();
        let ridge = RIDGE * 100f64.powi(power);
        (0..ridged.nrows()).for_each(|place| ridged[(place, place)] += ridge);
        Cholesky::new(ridged)
    });
    match ridged {
        Some(cholesky) => cholesky.solve(right).iter().copied().collect(),
        None => vec![0.0; right.len()],
    }
}
