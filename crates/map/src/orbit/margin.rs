//! The margin of a scene: the smallest change of one or two parameters at which the orbit grazes.
//!
//! The point of the grazing curve nearest to the scene's own values is one at which the distance is
//! stationary, a special point like others. The curve is not followed beyond the smallest distance
//! known so far. At the nearest point, the equations of the grazing orbit give the derivatives of
//! the margin in every parameter, and the side on which the scene lies.

use nalgebra::{DMatrix, DVector};

use super::curve::curve_towards;
use super::curve_context::Distance;
use super::effort::Effort;
use super::grazing_curve::{CurveEnd, CurvePoint, MOST_PRODUCTS, SpecialKind, SpecialPoint};
use super::grazing_orbit::{Grazes, GrazingOrbit, Location};
use super::locate::locate;
use super::outcome::{NotLocated, OrbitError};
use super::search::clear_interval;
use super::system::ExtendedSystem;
use crate::flow::Field;
use crate::model::Scene;
use crate::numeric::{Dd, converted};

/// A sample of the curve that is nearer than every stationary point by more than this, relative to
/// its distance, lies at an end of the curve.
const NEARER: f64 = 1e-9;

/// The smallest change of parameters at which the orbit of a scene grazes.
#[derive(Clone, Debug, PartialEq)]
pub struct Margin {
    /// The parameters that change.
    pub parameters: Vec<usize>,
    /// Scale of each parameter: changes are measured in these units.
    pub scales: Vec<f64>,
    /// All parameters of the nearest graze.
    pub nearest: Vec<Dd>,
    /// Changes of the parameters, from the scene's own values to the nearest graze.
    pub changes: Vec<f64>,
    /// Euclidean length of the changes, each in its scale.
    pub distance: f64,
    /// Derivative of the distance in every parameter of the model.
    pub sensitivities: Vec<f64>,
    /// Whether the orbit of the free flow stays clear of the surface at the scene's values; where
    /// it cannot be followed there, to first order in the change.
    pub clears: bool,
    /// Full state at the graze.
    pub state: Vec<f64>,
    /// Ends of the curve on both sides: value of the second parameter, and reason. `None` if no
    /// curve was followed, as with one parameter.
    pub range: Option<[(f64, CurveEnd); 2]>,
    /// Whether the distance is stationary at the graze; otherwise the graze is an end of the curve.
    pub stationary: bool,
}

/// Outcome of the search for the smallest change.
#[derive(Clone, Debug, PartialEq)]
pub enum MarginOutcome {
    /// The nearest graze.
    Found(Box<Margin>),
    /// The reason why there is no grazing orbit of the oscillator with its stops: none to start
    /// from, or every one on the curve passes through a surface.
    NotLocated(NotLocated),
}

/// The smallest change of one or two parameters of a scene at which its orbit grazes, and its
/// derivatives in every parameter.
///
/// Changes are measured in `scales`, one for each parameter. The orbit that grazes at the scene's
/// own value of the second parameter is located first. With two parameters the grazing curve
/// through it is followed to both sides as far as a nearer point is possible; the result is the
/// nearest point with a stationary distance, in double-double. Other branches of the curve are not
/// searched. With one parameter the graze is the nearest of the orbit that the free flow settles on
/// ([`clear_interval`]), and where it does not graze, the one that [`locate`] finds.
///
/// ```
/// use grazemap_map::model::Scene;
/// use grazemap_map::orbit::{MarginOutcome, margin};
///
/// let scene = Scene::of_catalogue("linear")?;
/// let [alpha, omega] = ["alpha", "omega"].map(|name| {
///     scene.model.parameters.iter().position(|known| known.name == name).expect("there")
/// });
/// let MarginOutcome::Found(margin) = margin(&scene, &[alpha, omega], &[2.25, 1.8])? else {
///     panic!("the orbit grazes near by");
/// };
/// // The amplitude alpha/|1 − ω² + 2iζω| is a little above the gap: less is enough along both.
/// assert!(!margin.clears && margin.distance < 2.78e-3 / 2.25);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// [`OrbitError::MarginParameters`], [`OrbitError::MarginScale`] and [`OrbitError::MarginGrazes`]
/// for input without a margin; otherwise as [`locate`].
pub fn margin(
    scene: &Scene,
    parameters: &[usize],
    scales: &[f64],
) -> Result<MarginOutcome, OrbitError> {
    watched_margin(scene, parameters, scales, &|_| {})
}

/// Computes [`margin()`] and reports the share done, from 0 to 1.
///
/// # Errors
///
/// As [`margin()`].
pub fn watched_margin(
    scene: &Scene,
    parameters: &[usize],
    scales: &[f64],
    watch: &dyn Fn(f64),
) -> Result<MarginOutcome, OrbitError> {
    check(scene, parameters, scales)?;
    let adjusted = |parameter: usize| {
        let mut scene = scene.clone();
        scene.grazing.solve_for = vec![parameter];
        scene
    };
    let mut search = MarginSearch {
        scene: adjusted(parameters[0]),
        parameters: parameters.to_vec(),
        scales: scales.to_vec(),
    };
    let interval = clear_interval(scene, parameters[0], None)?.ok();
    let near = interval.as_ref().and_then(|interval| interval.at_graze(&search.scene));
    let mut located = locate(near.as_ref().unwrap_or(&search.scene))?;
    if let (Location::NotLocated(_), [first, second]) = (&located, parameters) {
        // The curve may turn back before it reaches the scene's value of the second parameter.
        let other = adjusted(*second);
        if let found @ Location::Located(_) = locate(&other)? {
            located = found;
            search = MarginSearch {
                scene: other,
                parameters: vec![*second, *first],
                scales: vec![scales[1], scales[0]],
            };
        }
    }
    let mut outcome = match located {
        Location::Located(orbit) => search.from(&orbit, watch)?,
        Location::NotLocated(reason) => MarginOutcome::NotLocated(reason),
    };
    if let (MarginOutcome::Found(margin), Some(interval)) = (&mut outcome, interval) {
        margin.clears = interval.gap >= 0.0;
    }
    Ok(outcome)
}

fn check(scene: &Scene, parameters: &[usize], scales: &[f64]) -> Result<(), OrbitError> {
    let mut distinct = parameters.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    distinct.retain(|&parameter| parameter < scene.model.parameters.len());
    let found = distinct.len();
    if !(1..=2).contains(&found) || found != parameters.len() || found != scales.len() {
        return Err(OrbitError::MarginParameters { found });
    }
    if let Some(&scale) = scales.iter().find(|scale| !(**scale > 0.0 && scale.is_finite())) {
        return Err(OrbitError::MarginScale { scale });
    }
    match scene.grazing.solve_for.len() {
        1 => Ok(()),
        found => Err(OrbitError::MarginGrazes { found }),
    }
}

/// A graze that may be the nearest.
struct Candidate {
    parameters: Vec<Dd>,
    state: Vec<f64>,
    period: f64,
    distance: f64,
}

struct MarginSearch {
    /// The scene, with the first parameter adjusted.
    scene: Scene,
    parameters: Vec<usize>,
    scales: Vec<f64>,
}

impl MarginSearch {
    /// The scene's own value of a parameter.
    fn own(&self, parameter: usize) -> f64 {
        self.scene.model.parameters[parameter].value.to_f64()
    }

    fn distance(&self, least: f64) -> Distance {
        let from = self.parameters.iter().map(|&parameter| self.own(parameter)).collect();
        Distance { from, scales: self.scales.clone(), least }
    }

    /// Changes from the scene's own values to `parameters`, exact to rounding.
    fn changes(&self, parameters: &[Dd]) -> Vec<f64> {
        let change = |&parameter: &usize| {
            (parameters[parameter] - self.scene.model.parameters[parameter].value).to_f64()
        };
        self.parameters.iter().map(change).collect()
    }

    fn candidate(&self, parameters: Vec<Dd>, state: &[f64], period: f64) -> Candidate {
        let changes = self.changes(&parameters).into_iter().zip(&self.scales);
        let distance = changes.map(|(change, scale)| (change / scale).powi(2)).sum::<f64>().sqrt();
        Candidate { parameters, state: state.to_vec(), period, distance }
    }

    /// The nearest graze on the curve through an orbit.
    fn from(&self, orbit: &GrazingOrbit, watch: &dyn Fn(f64)) -> Result<MarginOutcome, OrbitError> {
        let graze = orbit.grazing_point();
        let state: Vec<f64> = converted(&graze.state);
        let here = self.candidate(orbit.parameters().to_vec(), &state, orbit.period.to_f64());
        let refusal = orbit.physical(&self.scene).err();
        let (Some(&with), true) = (self.parameters.get(1), here.distance > 0.0) else {
            return match refusal {
                None => self.found(here, None, true),
                Some(reason) => Ok(MarginOutcome::NotLocated(reason)),
            };
        };
        let reach = here.distance * self.scales[1];
        let (mut ends, mut samples, mut stationary) = (Vec::new(), Vec::new(), Vec::new());
        let mut least = here.distance;
        let field = Field::free(&self.scene.model, &[]);
        for (number, side) in self.sides(&here)?.into_iter().enumerate() {
            let reach = side * reach;
            let watch_side = |share: f64| watch(0.5 * (number as f64 + share));
            let effort = Effort::new(&field).within(MOST_PRODUCTS / 5);
            let (to, distance) = (self.own(with) + reach, self.distance(least));
            let here = (&self.scene, orbit);
            let curve = curve_towards(here, (with, to), distance, &effort, &watch_side)?;
            let physical = |point: &&CurvePoint| point.is_physical();
            samples.extend(curve.points.iter().filter(physical).map(|point| {
                self.candidate(converted(&point.parameters), &point.state, point.period)
            }));
            let nearest = curve.special.iter().filter(|at| at.kind == SpecialKind::Nearest);
            let nearest = nearest.filter(|at| at.point.is_physical());
            stationary.extend(nearest.map(|SpecialPoint { parameters, point, .. }| {
                self.candidate(parameters.clone(), &point.state, point.period)
            }));
            let found = samples.iter().chain(&stationary);
            least = found.map(|found: &Candidate| found.distance).fold(least, f64::min);
            let last = curve.points.last().map_or(to, |point| point.parameters[with]);
            ends.push((last, curve.end));
        }
        let range = <[(f64, CurveEnd); 2]>::try_from(ends).ok();
        let least = |candidates: Vec<Candidate>| {
            candidates.into_iter().min_by(|a, b| a.distance.total_cmp(&b.distance))
        };
        match (least(stationary), least(samples), refusal) {
            (Some(point), Some(end), _) if end.distance < (1.0 - NEARER) * point.distance => {
                self.found(end, range, false)
            }
            (Some(point), _, _) => self.found(point, range, true),
            (None, Some(end), _) => self.found(end, range, false),
            (None, None, Some(reason)) => Ok(MarginOutcome::NotLocated(reason)),
            // The orbit at which the curve begins is one of its points.
            (None, None, None) => self.found(here, range, false),
        }
    }

    /// Signs of the change of the second parameter, first the one along which the distance falls,
    /// so that little of the other side has to be followed.
    fn sides(&self, here: &Candidate) -> Result<[f64; 2], OrbitError> {
        let Slopes { slopes, .. } = self.slopes(here)?;
        let change = self.changes(&here.parameters)[0];
        // Along the curve the first parameter changes by −g_Q/g_P of the second.
        let growth = -change * slopes[self.parameters[1]] / slopes[self.parameters[0]];
        Ok(if growth > 0.0 { [-1.0, 1.0] } else { [1.0, -1.0] })
    }

    fn found(
        &self,
        nearest: Candidate,
        range: Option<[(f64, CurveEnd); 2]>,
        stationary: bool,
    ) -> Result<MarginOutcome, OrbitError> {
        let changes = self.changes(&nearest.parameters);
        let Slopes { slopes, gap } = self.slopes(&nearest)?;
        // The graze is a zero of a function of the parameters; its gradient is taken in the scales.
        let named = || self.parameters.iter().zip(&self.scales);
        let length = named().map(|(&p, scale)| (slopes[p] * scale).powi(2)).sum::<f64>().sqrt();
        let along = |&(&parameter, change): &(&usize, &f64)| slopes[parameter] * -change;
        let value: f64 = self.parameters.iter().zip(&changes).map(|pair| along(&pair)).sum();
        let side = if value < 0.0 { -1.0 } else { 1.0 };
        Ok(MarginOutcome::Found(Box::new(Margin {
            parameters: self.parameters.clone(),
            scales: self.scales.clone(),
            changes,
            distance: nearest.distance,
            // Adding 0 removes the sign of a zero.
            sensitivities: slopes.iter().map(|slope| side * slope / length + 0.0).collect(),
            clears: value * gap >= 0.0,
            nearest: nearest.parameters,
            state: nearest.state,
            range,
            stationary,
        })))
    }

    fn slopes(&self, at: &Candidate) -> Result<Slopes, OrbitError> {
        slopes(&self.scene, &converted(&at.state), Dd::from(at.period), &at.parameters)
    }
}

/// Derivative of the lowest gap of the orbit without contact in every parameter, at a graze.
pub(super) fn gap_slopes(
    scene: &Scene,
    state: &[Dd],
    period: Dd,
    parameters: &[Dd],
) -> Result<Vec<f64>, OrbitError> {
    let Slopes { slopes, gap } = slopes(scene, state, period, parameters)?;
    Ok(slopes.into_iter().map(|slope| slope / gap + 0.0).collect())
}

/// Gradient, in all parameters, of a function that vanishes if the orbit grazes, and its derivative
/// in the gap of the orbit.
///
/// The equations of the graze are one more than the unknowns of its orbit. The function is the
/// linear combination of equations that the unknowns do not change.
fn slopes(
    scene: &Scene,
    state: &[Dd],
    period: Dd,
    parameters: &[Dd],
) -> Result<Slopes, OrbitError> {
    let all: Vec<usize> = (0..scene.model.parameters.len()).collect();
    let system = ExtendedSystem::new(scene, Grazes::of(scene)?, parameters, &all);
    let unknowns = system.assemble(state, period, &[], parameters);
    let (_, jacobian) = system.differentiate(&converted(&unknowns))?;
    let first = system.first_parameter();
    let combination = left_null(&jacobian.columns(0, first).into_owned());
    let slope = |parameter: usize| jacobian.column(first + parameter).dot(&combination);
    let slopes = all.into_iter().map(slope).collect();
    Ok(Slopes { slopes, gap: combination[system.states] })
}

struct Slopes {
    slopes: Vec<f64>,
    gap: f64,
}

/// Unit vector orthogonal to all columns of a matrix with one more row than columns, by
/// Gram-Schmidt orthogonalisation, done twice.
fn left_null(matrix: &DMatrix<f64>) -> DVector<f64> {
    let rows = matrix.nrows();
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let remainder = |mut vector: DVector<f64>, basis: &[DVector<f64>]| {
        for _ in 0..2 {
            for unit in basis {
                let share = unit.dot(&vector);
                vector -= unit * share;
            }
        }
        vector
    };
    for column in matrix.column_iter() {
        let size = column.norm();
        let rest = remainder(column.into_owned(), &basis);
        let length = rest.norm();
        if length > 1e-13 * size {
            basis.push(rest / length);
        }
    }
    let units = (0..rows).map(|row| {
        let unit = DVector::from_fn(rows, |at, _| if at == row { 1.0 } else { 0.0 });
        remainder(unit, &basis)
    });
    let longest = units.max_by(|a, b| a.norm().total_cmp(&b.norm()));
    longest.map_or_else(|| DVector::zeros(rows), |vector| vector.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_left_over_is_orthogonal_to_every_column() {
        let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 1e6, -3.0, 0.5, 1e-3]);
        let direction = left_null(&matrix);
        assert!((direction.norm() - 1.0).abs() < 1e-15);
        for column in matrix.column_iter() {
            assert!(direction.dot(&column).abs() < 1e-14 * column.norm());
        }
    }
}
