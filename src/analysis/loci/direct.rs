//! Loci by direct simulation: the physical parts, begun at physical orbits of the map's loci and
//! followed as far as the orbits make their contacts.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint};
use super::equations::{CodimensionTwo, LocusEquations, OrbitEquations};
use super::trace::{Trace, TracePoint, condition_of, is_stable, joined};
use crate::analysis::continuation::{Linearised, StepControl, corrected};
use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::periodic::{
    ContactItinerary, parameter_slopes, state_jacobian, window_scales,
};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real};
use crate::orbit::{CurveOptions, CurveOutcome, GrazingOrbit, curve};

/// Steps along a locus; near a graze they become as short as the depth is shallow.
const STEPS: StepControl = StepControl { first: 0.01, longest: 0.25, shortest: 1e-4, most: 120 };
/// Points of a locus that are solved for in double-double.
const POINTS: usize = 48;

/// A period by direct simulation in the section's coordinates and two parameters.
struct DirectEquations<'a, S: Real> {
    image: DirectImage<'a, S>,
    itinerary: &'a ContactItinerary,
    plane: [usize; 2],
    at: Vec<S>,
    /// Lengths of the coordinates and all parameters.
    scales: Vec<f64>,
    /// Range of the first parameter in its unit.
    range: [f64; 2],
}

impl<S: Real> DirectEquations<'_, S> {
    fn units(&self) -> Vec<f64> {
        let d = self.image.dimension();
        let parameters = self.plane.map(|place| self.scales[d + place]);
        self.scales[..d].iter().copied().chain(parameters).collect()
    }

    /// The first point and all parameters, in offsets.
    fn offsets(&self, unknowns: &[S]) -> (Vec<S>, Vec<S>) {
        let values = unknowns.iter().zip(self.units());
        let mut values: Vec<S> = values.map(|(&value, unit)| value * S::from_f64(unit)).collect();
        let free = values.split_off(self.image.dimension());
        let mut parameters = self.at.clone();
        for (place, value) in self.plane.into_iter().zip(free) {
            parameters[place] = value;
        }
        (values, parameters)
    }
}

impl<S: Real> OrbitEquations<S> for DirectEquations<'_, S> {
    /// The section points.
    type Extra = Vec<Vec<S>>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Vec<Vec<S>>>> {
        let (mut state, parameters) = self.offsets(unknowns);
        let (d, first) = (state.len(), state.clone());
        let mut states = Vec::new();
        let mut jacobian = DMatrix::identity(d, d + 2);
        jacobian.columns_mut(d, 2).fill(S::zero());
        for made in self.itinerary.returns() {
            let (step, by_state) =
                state_jacobian(&mut self.image, &state, &parameters, &self.scales)?;
            if step.contacts != *made || step.extra_contacts > 0 {
                return None;
            }
            let slopes = parameter_slopes(
                &mut self.image,
                &step,
                &state,
                &parameters,
                &self.plane,
                &self.scales,
            )?;
            jacobian = by_state * jacobian;
            for (column, slope) in slopes.iter().enumerate() {
                let sum = jacobian.column(d + column) + slope;
                jacobian.set_column(d + column, &sum);
            }
            states.push(std::mem::replace(&mut state, step.offsets));
        }
        let units = self.units();
        for row in 0..d {
            jacobian[(row, row)] -= S::one();
            for (column, unit) in units.iter().enumerate() {
                jacobian[(row, column)] *= S::from_f64(unit / units[row]);
            }
        }
        let closing = state.iter().zip(&first).zip(&units);
        let closing = closing.map(|((&end, &start), &unit)| (end - start) / S::from_f64(unit));
        let residual = nalgebra::DVector::from_iterator(d, closing);
        let finite = residual.iter().chain(jacobian.iter()).all(|value| value.is_finite());
        finite.then_some(Linearised { residual, jacobian, extra: states })
    }

    /// Simulation knows no depth that a contact could have: none are unknowns.
    fn depth_variables(&self) -> std::ops::Range<usize> {
        let d = self.image.dimension();
        d..d
    }

    fn coordinates(&self) -> usize {
        self.image.dimension()
    }

    fn free_depths(_: &Vec<Vec<S>>) -> Vec<S> {
        Vec::new()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        match unknown == self.image.dimension() {
            true => self.range,
            false => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

/// The loci of direct simulation beside those of a map.
pub(super) struct DirectLoci<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    request: &'a LociRequest,
    rounded: DirectImage<'a, f64>,
    exact: DirectImage<'a, Dd>,
    depths: DepthEvaluation<f64>,
}

impl<'a> DirectLoci<'a> {
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &'a LocalMap,
        request: &'a LociRequest,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            scene,
            orbit,
            map,
            request,
            rounded: DirectImage::new(system, scene, orbit)?,
            exact: DirectImage::new(system, scene, orbit)?,
            depths: MapEvaluation::depths(map),
        })
    }

    fn equations<'e, S: Real>(
        &'e self,
        image: &DirectImage<'e, S>,
        itinerary: &'e ContactItinerary,
    ) -> DirectEquations<'e, S>
    where
        'a: 'e,
    {
        let scales = window_scales(&self.map.window);
        let unit = scales[self.map.dimension() + self.request.plane[0]];
        let [from, to] = self.request.range;
        DirectEquations {
            image: image.clone(),
            itinerary,
            plane: self.request.plane,
            at: self.request.at.iter().map(|&value| S::from_f64(value)).collect(),
            scales,
            range: [from.min(to) / unit, from.max(to) / unit],
        }
    }

    /// The loci next to those of the map, and the grazing curve of the orbit without contact.
    pub(super) fn beside(&self, traces: &[Trace], described: &[Locus]) -> Vec<Locus> {
        let mut found: Vec<Trace> = Vec::new();
        for (trace, locus) in traces.iter().zip(described) {
            if trace.kind == LocusKind::Graze {
                continue;
            }
            for seed in self.seeds(trace, locus) {
                self.add(&mut found, trace, &seed);
            }
        }
        let mut loci = self.graze().into_iter().collect::<Vec<_>>();
        loci.extend(found.iter().filter_map(|trace| self.described(trace)));
        loci
    }

    /// The deepest orbit of every physical stretch of a locus of the map, in units.
    fn seeds(&self, trace: &Trace, locus: &Locus) -> Vec<Vec<f64>> {
        let depth = |point: &LocusPoint| {
            point.depth_variables.iter().fold(f64::INFINITY, |least, &y| least.min(y))
        };
        let d = self.map.dimension();
        let stretches = locus.points.chunk_by(|a, b| a.physical == b.physical);
        let stretches = stretches.filter(|stretch| stretch[0].physical);
        let deepest = stretches.filter_map(|stretch| {
            stretch.iter().filter(|point| point.inside).chain(stretch).max_by(|a, b| {
                (a.inside, depth(a))
                    .partial_cmp(&(b.inside, depth(b)))
                    .unwrap_or(std::cmp::Ordering::Equal)
            })
        });
        let scales = window_scales(&self.map.window);
        let unknowns = |point: &LocusPoint| {
            let state = point.states[0].iter().zip(&scales).map(|(value, unit)| value / unit);
            let plane = self.request.plane;
            let free = plane.map(|place| point.parameters[place] / scales[d + place]);
            let angle = match trace.kind {
                LocusKind::Torus => point.multipliers.first().map(|[re, im]| im.abs().atan2(*re)),
                _ => None,
            };
            state.chain(free).chain(angle).collect()
        };
        deepest.map(unknowns).collect()
    }

    fn add(&self, found: &mut Vec<Trace>, near: &Trace, seed: &[f64]) {
        let condition = condition_of(near.kind);
        let equations = self.equations(&self.rounded, &near.itinerary);
        let mut equations = LocusEquations::new(equations, condition, 0);
        let kinds = equations.kinds(0);
        let of_kind = found
            .iter()
            .filter(|trace| trace.kind == near.kind && trace.itinerary == near.itinerary);
        let Some((points, ends)) = joined(&mut equations, seed, of_kind, &STEPS) else { return };
        let share = points.len().div_ceil(POINTS).max(1);
        let kept: Vec<(TracePoint, Option<usize>)> = points
            .into_iter()
            .enumerate()
            .filter(|(place, (_, test))| place % share == 0 || test.is_some())
            .map(|(_, point)| point)
            .collect();
        let fine = |(point, test): &(TracePoint, Option<usize>)| {
            let exact = self.equations(&self.exact, &near.itinerary);
            let mut exact = LocusEquations::new(exact, condition, 0);
            let convert = |values: &[f64]| -> Vec<Dd> {
                values.iter().map(|&value| Dd::from(value)).collect()
            };
            let (at, along) = (convert(&point.unknowns), convert(&point.tangent));
            let (unknowns, _) = corrected(&mut exact, &at, &at, &along)?;
            Some(TracePoint {
                unknowns: unknowns.iter().map(|value| value.to_f64()).collect(),
                tangent: point.tangent.clone(),
                label: test.map(|test| kinds[test]),
            })
        };
        let points: Vec<TracePoint> = kept.par_iter().filter_map(fine).collect();
        if !points.is_empty() {
            found.push(Trace { kind: near.kind, itinerary: near.itinerary.clone(), points, ends });
        }
    }

    fn described(&self, trace: &Trace) -> Option<Locus> {
        let points: Vec<LocusPoint> =
            trace.points.iter().filter_map(|point| self.point(trace, point)).collect();
        (!points.is_empty()).then(|| Locus {
            kind: trace.kind,
            itinerary: trace.itinerary.clone(),
            grazing: None,
            points,
            ends: trace.ends,
        })
    }

    fn point(&self, trace: &Trace, point: &TracePoint) -> Option<LocusPoint> {
        let mut equations = self.equations(&self.rounded, &trace.itinerary);
        let d = self.map.dimension();
        let (_, parameters) = equations.offsets(&point.unknowns[..d + 2]);
        let there = equations.linearised(&point.unknowns[..d + 2])?;
        let mut jacobian = there.jacobian.columns(0, d).into_owned();
        for place in 0..d {
            jacobian[(place, place)] += 1.0;
        }
        let multipliers = eigenvalues(&jacobian).ok()?;
        let (mut speeds, mut inside) = (Vec::new(), true);
        for state in &there.extra {
            let image = equations.image.image(state, &parameters).ok()?;
            speeds.extend(image.passages.into_iter().flatten());
            let depths = self.depths.at(state, &parameters);
            inside &= self.map.window.holds(state, &parameters, &depths);
        }
        Some(LocusPoint {
            parameters,
            states: there.extra,
            depth_variables: speeds,
            stable: is_stable(trace.kind, &multipliers, point.unknowns.last().copied()),
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            physical: true,
            inside,
            label: point.label,
        })
    }

    /// The grazing curve of the orbit without contact, where the second parameter is the one that
    /// is adjusted so that it grazes.
    fn graze(&self) -> Option<Locus> {
        let active = &self.scene.expansion.active;
        let [first, second] = self.request.plane.map(|place| active[place]);
        let asked = self.request.kinds.contains(&LocusKind::Graze);
        let is_plane = self.scene.grazing.solve_for == [second];
        if !asked || !is_plane || self.request.at.iter().any(|&offset| offset != 0.0) {
            return None;
        }
        let centre: Vec<f64> =
            active.iter().map(|&place| self.orbit.parameters()[place].to_f64()).collect();
        let [from, to] = self.request.range.map(|end| centre[self.request.plane[0]] + end);
        let periods = self.request.itineraries.iter().map(ContactItinerary::period);
        let options =
            CurveOptions { xi_count: periods.max().unwrap_or(1), ..CurveOptions::default() };
        let Ok(CurveOutcome::Traced(curve)) = curve(self.scene, first, from, to, &options) else {
            return None;
        };
        let offsets = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
            active.iter().zip(&centre).map(|(&place, centre)| values(place) - centre).collect()
        };
        let mut points: Vec<LocusPoint> = curve
            .points
            .iter()
            .map(|point| graze_point(point, offsets(&|place| point.parameters[place]), None))
            .collect();
        for (n, _, special) in curve.codim2() {
            let values = offsets(&|place| special.parameters[place].to_f64());
            let label = Some(CodimensionTwo::Xi(n));
            let along = |point: &LocusPoint| point.parameters[self.request.plane[0]];
            let special = graze_point(&special.point, values, label);
            let place = points.iter().position(|point| {
                (along(point) > along(&special)) == (to > from) && along(point) != along(&special)
            });
            points.insert(place.unwrap_or(points.len()), special);
        }
        let passages = self.map.passages();
        let itinerary = ContactItinerary::new(passages, vec![Default::default()]);
        let window = &self.map.window;
        for point in &mut points {
            point.inside = window.holds(&[] as &[f64], &point.parameters, &[]);
        }
        let ends = [LocusEnd::Border, LocusEnd::Border];
        Some(Locus { kind: LocusKind::Graze, itinerary, grazing: Some([0, 0]), points, ends })
    }
}

/// A point of the grazing curve.
fn graze_point(
    point: &crate::orbit::CurvePoint,
    parameters: Vec<f64>,
    label: Option<CodimensionTwo>,
) -> LocusPoint {
    let modulus = |[re, im]: &[f64; 2]| re.hypot(*im);
    LocusPoint {
        parameters,
        states: Vec::new(),
        depth_variables: vec![0.0],
        multipliers: point.multipliers.clone(),
        stable: point.multipliers.iter().all(|value| modulus(value) < 1.0),
        physical: point.is_physical(),
        inside: true,
        label,
    }
}
