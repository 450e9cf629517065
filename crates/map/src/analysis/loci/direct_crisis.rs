//! Crises by direct simulation, solved for from the map's crises.
//!
//! One idea: a crisis is an orbit from a saddle back to it, and the map's orbit is near enough to
//! start Newton's method. Residuals are computed in double-double, slopes in `f64`.

use nalgebra::{DMatrix, DVector};

use super::connection::Connection;
use super::crisis::Crisis;
use super::data::{LociRequest, Locus, LocusPoint};
use super::direct::DirectPlane;
use crate::analysis::error::AnalysisError;
use crate::analysis::periodic::ContactItinerary;
use crate::analysis::progress::{Progress, SubProgress, resumed};
use crate::continuation::{CurveEquations, largest};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::model::Scene;
use crate::numeric::linear::factorize;
use crate::numeric::{Dd, converted};
use crate::orbit::GrazingOrbit;

/// Most points of a crisis.
const POINTS: usize = 9;
/// Most Newton steps with fresh slopes, then most with the last slopes.
const STEPS: usize = 8;
const MORE: usize = 12;
/// Length of a step from which on slopes are reused.
const NEAR: f64 = 1e-7;
/// Length of the last step, and the largest length of a last step that no longer shrinks.
const LAST: f64 = 1e-20;
const STALLED: f64 = 1e-14;

/// Crises of direct simulation in a plane of parameters.
pub(super) struct DirectCrises<'a> {
    plane: DirectPlane<'a>,
}

impl<'a> DirectCrises<'a> {
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
        request: &'a LociRequest,
    ) -> Result<Self, AnalysisError> {
        // Units are of the order of the window, where the manifolds lie.
        let widths = request.plane.map(|place| map.window.parameter[place]);
        let free = [0, 1].map(|at| (request.plane[at], [-widths[at], widths[at]]));
        Ok(Self { plane: DirectPlane::new(system, scene, orbit, map, (request, free))? })
    }

    /// Crises by direct simulation at some physical points of the map's crises with a corner; empty
    /// on stroboscopic sections.
    pub(super) fn all(&self, by_map: &[Crisis], progress: &dyn Progress) -> Vec<Locus> {
        let with_corner = by_map.iter().filter(|crisis| crisis.corner.is_some());
        let loci = with_corner.enumerate();
        loci.filter_map(|(number, crisis)| self.locus(crisis, &SubProgress::new(progress, number)))
            .collect()
    }

    fn locus(&self, crisis: &Crisis, progress: &dyn Progress) -> Option<Locus> {
        self.plane.units.gap?;
        let all = crisis.locus.points.iter().zip(&crisis.saddles);
        let physical: Vec<_> = all.filter(|(point, _)| point.physical && point.inside).collect();
        let count = POINTS.min(physical.len());
        let place = |number: usize| number * (physical.len() - 1) / (count - 1).max(1);
        let places: Vec<usize> = (0..count).map(place).collect();
        progress.expect(count as u64);
        let points = parallel::map(places, |place| {
            let (point, saddle) = physical[place];
            let found = || self.point(crisis, point, saddle);
            let found: Option<LocusPoint> = resumed(progress, &[place as u64], found);
            progress.advance(1);
            found
        });
        let points: Vec<LocusPoint> = points.into_iter().flatten().collect();
        (!points.is_empty()).then(|| Locus { points, ..crisis.locus.clone() })
    }

    /// Crisis at the first parameter of a point of the map's crisis.
    fn point(
        &self,
        crisis: &Crisis,
        point: &LocusPoint,
        saddle: &[Vec<f64>],
    ) -> Option<LocusPoint> {
        let period = crisis.locus.itinerary.period();
        let (corner, _) = crisis.corner?;
        let passages = crisis.locus.itinerary.passages();
        let all = &ContactItinerary::new(passages, crisis.made.clone());
        let plane = &self.plane;
        let mut near = Connection { returns: plane.equations(&plane.rounded, all), period };
        let states = [saddle, &point.states].concat();
        let mut unknowns = near.returns.unknowns(&states, &point.parameters)?;
        let (replaced, _) = self.plane.units.gap?;
        let grazing = corner * near.returns.dimension() + replaced;
        let (size, held) = (unknowns.len(), unknowns.len() - 2);
        unknowns[grazing] = 0.0;
        // Both conditions hold at the start; the steps preserve them.
        let squared = |jacobian: &DMatrix<f64>| {
            let mut matrix = jacobian.clone().resize(size, size, 0.0);
            matrix[(size - 2, grazing)] = 1.0;
            matrix[(size - 1, held)] = 1.0;
            matrix
        };
        let mut settled = None;
        for _ in 0..STEPS {
            let there = near.linearised(&unknowns)?;
            let matrix = factorize(&squared(&there.jacobian)).ok()?;
            let right = (-&there.residual).resize_vertically(size, 0.0);
            let step = matrix.solve(&right).ok()?;
            unknowns.iter_mut().zip(step.iter()).for_each(|(value, change)| *value += change);
            if step.amax() <= NEAR {
                settled = Some((matrix, near.ends(&there.extra.returns)?));
                break;
            }
        }
        let (matrix, ends) = settled?;
        let multiplier = ends.multiplier;
        let ends = ends.converted::<Dd>();
        let mut fine = Connection { returns: plane.equations(&plane.exact, all), period };
        let mut found: Vec<Dd> = converted(&unknowns);
        let mut last = f64::INFINITY;
        let mut flown = Vec::new();
        for _ in 0..MORE {
            let returns = 0..crisis.made.len();
            let all = returns.map(|number| fine.returns.return_at(number, &found, false));
            flown = all.collect::<Option<Vec<_>>>()?;
            let residual = fine.residual(&flown, &ends);
            // Solved in `f64`, scaled so that small residuals keep their digits.
            let largest = largest(&residual);
            let scale = if largest > 0.0 { largest } else { 1.0 };
            let scaled = residual.iter().map(|&r| -(r / Dd::from(scale)).to_f64());
            let right = DVector::from_iterator(size - 2, scaled).resize_vertically(size, 0.0);
            let step = matrix.solve(&right).ok()?;
            let length = step.amax() * scale;
            for (value, &change) in found.iter_mut().zip(step.iter()) {
                *value += Dd::from(change) * Dd::from(scale);
            }
            if length <= LAST || length >= 0.5 * last {
                last = length;
                break;
            }
            last = length;
        }
        if last > STALLED {
            return None;
        }
        let parameters = converted(&fine.returns.parameters(&found));
        let state = |values: &[Dd]| -> Vec<f64> {
            let pairs = values.iter().zip(&self.plane.units.state);
            pairs.map(|(value, unit)| value.to_f64() * unit).collect()
        };
        let all: Vec<Vec<f64>> = flown.iter().map(|one| state(&one.point)).collect();
        let inside = plane.holds(&all, &parameters);
        let states = all[period..].to_vec();
        Some(LocusPoint {
            depth_variables: self.speeds(&states, &parameters, corner - period)?,
            states,
            parameters,
            multipliers: vec![[multiplier, 0.0]],
            inside,
            ..point.clone()
        })
    }

    /// Speed of each contact of an excursion; 0 for the grazing one.
    fn speeds(&self, states: &[Vec<f64>], parameters: &[f64], grazing: usize) -> Option<Vec<f64>> {
        let mut image = self.plane.rounded.clone();
        let mut speeds = Vec::new();
        for (number, state) in states.iter().enumerate() {
            if number == grazing {
                speeds.push(0.0);
                continue;
            }
            let flown = image.image(state, parameters).ok()?;
            speeds.extend(flown.passages.into_iter().flatten());
        }
        Some(speeds)
    }
}
